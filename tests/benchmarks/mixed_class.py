"""What a class costs that is as classes are: python mixed_class.py [EXERCISE...] [--submissions N] [--checkout FOLDER]

A third of the submissions is right, half has one or two mistakes, and the rest does nothing that the task asks for: a
file that does not start, a program that ends at once.  The answers are those of the project's own tests, drawn with a
fixed seed, so that two checkouts grade the same class.  With --checkout the same class is graded by another checkout's
grader, too, in turn.  Printed are the time of the whole, and what a submission of each kind takes beside a right
one.
"""

import argparse
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

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
sys.path.insert(1, str(ROOT / "tests/benchmarks"))

from class_grading import hand_in, in_a_cell, right_answers  # noqa: E402

from autograder.submissions import exercises  # noqa: E402
from tests.hidden import answers  # noqa: E402

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


def grade(checkout: Path, submitted: Path, exercise: str, out: Path) -> tuple[float, list[dict]]:
    """Return the seconds that a class took, and its results."""
    start = time.perf_counter()
    command = [checkout / ".venv/bin/autograder", "grade", submitted, "--assignment", exercise, "--output", out]
    done = subprocess.run([*command, "--no-gradebook"], capture_output=True, text=True, cwd=submitted)
    seconds = time.perf_counter() - start
    if done.returncode:
        sys.exit(f"{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    return seconds, [json.loads(line) for line in (out / "results.jsonl").read_text().splitlines()]


def show(name: str, kinds: dict[str, str], seconds: float, results: list[dict]) -> None:
    """Print a row for a class, and what each kind takes beside a right one."""
    took = {kind: [r["duration_s"] for r in results if kinds[r["student"]] == kind] for kind in KINDS}
    usual = median(took["right"])
    ratios = "".join(f"{median(took[kind]) / usual:>14.1f}" for kind in KINDS[1:])
    print(f"{name:28}{seconds:8.1f}{60 * len(results) / seconds:10.1f}{usual:9.1f}{ratios}")
    lost = [r["student"] for r in results if kinds[r["student"]] == "right" and r["score"] < r["max_score"]]
    if lost:
        print(f"  right answers that lost points: {', '.join(lost)}")


def main() -> None:
    """Grade a class of each exercise, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("exercises", nargs="*", default=exercises.names())
    parser.add_argument("--submissions", type=int, default=30)
    parser.add_argument("--checkout", type=Path, action="append", default=[])
    options = parser.parse_args()
    print(f"{options.submissions} submissions of each exercise on {len(os.sched_getaffinity(0))} cores")
    print(f"{'':28}{'s':>8}{'a minute':>10}{'right s':>9}" + "".join(f"{k:>14}" for k in KINDS[1:]))
    for exercise in options.exercises:
        with tempfile.TemporaryDirectory() as scratch:
            folder, kinds = Path(scratch), {}
            for number, (kind, files) in enumerate(whole_class(exercise, options.submissions)):
                student = f"student{number:04}"
                kinds[student] = kind
                hand_in(folder / "one", exercise, 1, [files])
                (folder / "submitted").mkdir(exist_ok=True)
                (folder / "one" / "student0000").rename(folder / "submitted" / student)
            for number, checkout in enumerate((ROOT, *options.checkout)):
                graded = grade(checkout.resolve(), folder / "submitted", exercise, folder / f"out{number}")
                show(f"{exercise}{'' if checkout == ROOT else f', {checkout.name}'}", kinds, *graded)


if __name__ == "__main__":
    main()
