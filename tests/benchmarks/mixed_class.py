"""The cost of a mixed class: python mixed_class.py [EXERCISE...] [--submissions N] [--checkout FOLDER]

A third of the submissions is right, half has one or two mistakes, and the rest does nothing that the task asks for: a
file that does not start, a program that ends at once.  The answers are those of the project's own tests, drawn with a
fixed seed, so that two checkouts grade the same class.  With --checkout the same class is graded by another checkout's
grader, too, in turn, by the same hidden inputs.  Printed are the time of the whole, the processor's seconds of a
grading, and what a submission of each kind takes beside a right one: in the median, and at most.  Each verdict that
differs between two checkouts is printed, with the flags of both reports; then the program exits with 1.
"""

import argparse
import contextlib
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median

import psutil

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
sys.path.insert(1, str(ROOT / "tests/benchmarks"))

from class_grading import hand_in, in_a_cell, right_answers  # noqa: E402

from autograder.submissions import exercises  # noqa: E402
from tests.hidden import answers  # noqa: E402

LOOK = 0.2  # s between two looks at the programs of a grading
SEED = "1"  # of the hidden inputs
KINDS = ("right", "one mistake", "two mistakes", "does nothing")


def wrong_answers(exercise: str) -> list[dict[str, bytes]]:
    """The files of all answers with one mistake."""
    several = answers.named(exercise, "NOTHING") | answers.named(exercise, "SEVERAL")
    found = answers.load(exercise).WRONG.items()
    return [files for name, (files, _) in found if name not in several and in_a_cell(files)]


def two_mistakes(exercise: str, draw: random.Random) -> dict[str, bytes]:
    """The files of two answers with one mistake each, in different files where the exercise has several."""
    reference, (one, other) = answers.solution(exercise), draw.sample(wrong_answers(exercise), 2)
    return one | {name: text for name, text in other.items() if one.get(name) == reference.get(name)}


def nothing(exercise: str, draw: random.Random) -> dict[str, bytes]:
    """The files of a submission of which nothing works: two thirds do not start."""
    known = [answers.files(exercise, name) for name in sorted(answers.named(exercise, "NOTHING"))]
    broken = {
        name: b"def main(:\n" + text if name.endswith(".py") else text
        for name, text in answers.solution(exercise).items()
    }
    return draw.choice([*known, broken]) if known and draw.random() < 1 / 3 else broken


def whole_class(exercise: str, count: int) -> Iterator[tuple[str, dict[str, bytes]]]:
    """Yield the kind and the files of each submission."""
    draw = random.Random(exercise)
    right, wrong = right_answers(exercise), wrong_answers(exercise)
    for number in range(count):
        kind = KINDS[(0, 1, 0, 2, 1, 3)[number % 6]]
        made = {
            "right": lambda: draw.choice(right),
            "one mistake": lambda: draw.choice(wrong),
            "two mistakes": lambda: two_mistakes(exercise, draw),
            "does nothing": lambda: nothing(exercise, draw),
        }[kind]()
        yield kind, made


def grade(checkout: Path, submitted: Path, exercise: str, out: Path) -> tuple[float, float, list[dict]]:
    """Return the seconds that a class took, those of a processor, and its results."""
    start, used = time.perf_counter(), {}
    command = [checkout / ".venv/bin/autograder", "grade", submitted, "--assignment", exercise, "--output", out]
    command += ["--no-gradebook", "--seed", SEED]
    grading = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=submitted)
    while True:
        try:
            said, _ = grading.communicate(timeout=LOOK)
            break
        except subprocess.TimeoutExpired:
            look(used)
    seconds = time.perf_counter() - start
    if grading.returncode:
        sys.exit(said[-4000:])
    results = [json.loads(line) for line in (out / "results.jsonl").read_text().splitlines()]
    return seconds, sum(used.values()), results


def look(used: dict[tuple[int, float], float]) -> None:
    """Note what each program below this one has used of the processors (s), by its number and its start.

    Those of a sandbox are in no sum of their parents, so that each is looked at while it runs.
    """
    for process in psutil.Process().children(recursive=True):
        with contextlib.suppress(psutil.Error):
            times = process.cpu_times()
            used[process.pid, process.create_time()] = times.user + times.system


def differences(one: list[dict], other: list[dict]) -> list[str]:
    """Return each verdict of a class that is another in a second grading, in words."""
    found, others = [], {result["student"]: result for result in other}
    for result in one:
        again = others.get(result["student"], {"status": "missing", "tests": [], "flags": []})
        was, now = ({test["id"]: test["outcome"] for test in each["tests"]} for each in (result, again))
        differs = [
            f"{test} {was.get(test)}, {now.get(test)}" for test in {**was, **now} if was.get(test) != now.get(test)
        ]
        if result["status"] != again["status"]:
            differs.insert(0, f"{result['status']}, {again['status']}")
        if differs:
            flags = sorted({*result["flags"], *again["flags"]})
            found.append(f"{result['student']}: {'; '.join(differs)}" + (f" ({', '.join(flags)})" if flags else ""))
    return found


def show(name: str, kinds: dict[str, str], seconds: float, used: float, results: list[dict]) -> None:
    """Print a row for a class, and what each kind takes beside a right one."""
    took = {kind: [r["duration_s"] for r in results if kinds[r["student"]] == kind] for kind in KINDS}
    usual = median(took["right"])
    ratios = "".join(f"{ratio(took[kind], usual):>20}" for kind in KINDS[1:])
    rate, each = 60 * len(results) / seconds, used / len(results)
    print(f"{name:28}{seconds:8.1f}{rate:10.1f}{each:8.1f}{usual:9.1f}{ratios}")
    lost = [r["student"] for r in results if kinds[r["student"]] == "right" and r["score"] < r["max_score"]]
    if lost:
        print(f"  right answers that lost points: {', '.join(lost)}")


def ratio(took: list[float], usual: float) -> str:
    """Return what the gradings of a kind took beside a right one: in the median, and the slowest."""
    return f"{median(took) / usual:.1f} (max {max(took) / usual:.1f})" if took else "-"


def main() -> int:
    """Grade a class of each exercise, and print the table; 1 when checkouts differ in a verdict."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("exercises", nargs="*", default=exercises.names())
    parser.add_argument("--submissions", type=int, default=30)
    parser.add_argument("--checkout", type=Path, action="append", default=[])
    options = parser.parse_args()
    print(f"{options.submissions} submissions of each exercise on {len(os.sched_getaffinity(0))} cores")
    print(f"{'':28}{'s':>8}{'a minute':>10}{'CPU s':>8}{'right s':>9}" + "".join(f"{k:>20}" for k in KINDS[1:]))
    differing = 0
    for exercise in options.exercises:
        with tempfile.TemporaryDirectory() as scratch:
            folder, kinds = Path(scratch), {}
            for number, (kind, files) in enumerate(whole_class(exercise, options.submissions)):
                student = f"student{number:04}"
                kinds[student] = kind
                hand_in(folder / "one", exercise, 1, [files])
                (folder / "submitted").mkdir(exist_ok=True)
                (folder / "one" / "student0000").rename(folder / "submitted" / student)
            first = []
            for number, checkout in enumerate((ROOT, *options.checkout)):
                graded = grade(checkout.resolve(), folder / "submitted", exercise, folder / f"out{number}")
                show(f"{exercise}{'' if checkout == ROOT else f', {checkout.name}'}", kinds, *graded)
                first = first or graded[-1]
                differ = differences(first, graded[-1])
                differing += len(differ)
                for line in differ:
                    print(f"  another verdict: {line}")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
