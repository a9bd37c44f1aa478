"""Submissions a minute, graded by this grader and by stock nbgrader: python class_grading.py [--submissions N]

Both grade the same calculators: right answers in several styles.  nbgrader runs each notebook as handed in, with its
public checks and no isolation; this grader runs the hidden suite, in the sandbox.  With --many N it also grades N
copies of `services`, and prints what a submission costs in each tenth of the class, and the coordinator's memory.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
BIN = Path(sys.executable).parent
sys.path.insert(0, str(ROOT))


def right_answers(exercise: str) -> list[dict[str, bytes]]:
    """The files of right answers in several styles."""
    from tests.hidden import answers

    return [files for files in answers.load(exercise).RIGHT.values() if in_a_cell(files)]


def hand_in(folder: Path, exercise: str, count: int, styles: list[dict[str, bytes]]) -> None:
    """`count` submissions in nbgrader's layout: `styles` in turn, each with the notebook that writes its files."""
    import nbformat

    source = nbformat.read(ROOT / "notebooks" / exercise / f"{exercise}.ipynb", 4)
    for number in range(count):
        target = folder / f"student{number:04}" / exercise
        target.mkdir(parents=True)
        for name, content in styles[number % len(styles)].items():
            (target / name).write_bytes(content)
            for cell in source.cells:
                if cell.source.startswith(f"%%exercise {name}\n"):
                    cell.source = f"%%exercise {name}\n{content.decode()}"
        nbformat.write(source, target / f"{exercise}.ipynb")


def in_a_cell(files: dict[str, bytes]) -> bool:
    """Return True if a notebook's cell can write the files: all are UTF-8."""
    try:
        return bool([content.decode() for content in files.values()])
    except UnicodeDecodeError:
        return False


def run(*command, cwd: Path) -> float:
    """Seconds that a command took; its output is shown when it fails."""
    start = time.perf_counter()
    path = f"{BIN}{os.pathsep}{os.environ['PATH']}"  # nbgrader calls alembic
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, env=os.environ | {"PATH": path})
    if done.returncode:
        sys.exit(f"{command}: {done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    return time.perf_counter() - start


def by_nbgrader(folder: Path, count: int) -> float:
    """Seconds by stock nbgrader."""
    source = folder / "source" / "calculator"
    source.mkdir(parents=True)
    shutil.copy(ROOT / "notebooks/calculator/calculator.ipynb", source)
    (folder / "nbgrader_config.py").write_text(
        "c = get_config()\nc.ClearSolutions.code_stub = {'python': '# YOUR CODE HERE'}\n"
    )
    run(BIN / "nbgrader", "generate_assignment", "calculator", cwd=folder)
    hand_in(folder / "submitted", "calculator", count, right_answers("calculator"))
    seconds = run(BIN / "nbgrader", "autograde", "calculator", cwd=folder)
    assert len(list((folder / "autograded").glob("*/calculator"))) == count
    return seconds


def by_this_grader(folder: Path, exercise: str, *options: str) -> float:
    """Seconds by this grader; every answer must earn full points."""
    out = folder / f"out{'-'.join(options)}"
    seconds = run(
        BIN / "autograder",
        "grade",
        folder / "submitted",
        "--assignment",
        exercise,
        "--output",
        out,
        *options,
        cwd=folder,
    )
    results = [json.loads(line) for line in (out / "results.jsonl").read_text().splitlines()]
    assert all(result["score"] == result["max_score"] for result in results), "a right answer lost points"
    return seconds


def many(folder: Path, count: int) -> None:
    """Print what a submission costs in a large class, for each tenth of it."""
    hand_in(folder / "submitted", "services", count, right_answers("services")[:1])
    out = folder / "out"
    process = subprocess.Popen(
        [BIN / "autograder", "grade", folder / "submitted", "--output", out], stdout=subprocess.PIPE, text=True
    )
    marks, memory = [], 0
    start = time.perf_counter()
    for line in process.stdout:
        if line.startswith("["):
            marks.append(time.perf_counter() - start)
            status = Path(f"/proc/{process.pid}/status").read_text()
            memory = max(memory, int(status.partition("VmRSS:")[2].split()[0]) >> 10)
    assert process.wait() == 0
    tenth = count // 10
    costs = [(marks[n + tenth - 1] - (marks[n - 1] if n else 0)) / tenth for n in range(0, tenth * 10, tenth)]
    print(
        f"{count} submissions of services: seconds each, by tenths of the class: {' '.join(f'{c:.2f}' for c in costs)}"
    )
    print(f"memory of the coordinator at most: {memory} MiB")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--submissions", type=int, default=24)
    parser.add_argument("--many", type=int, default=0)
    options = parser.parse_args()
    cores, count = len(os.sched_getaffinity(0)), options.submissions
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        stock = by_nbgrader(folder, count)
        print(f"{count} submissions of calculator on {cores} cores")
        print(f"{'':28}{'s':>8}{'a minute':>10}{'ratio':>8}")
        print(f"{'stock nbgrader autograde':28}{stock:8.1f}{60 * count / stock:10.1f}{1:8.1f}")
        for jobs in (1, cores, 2 * cores):
            seconds = by_this_grader(folder, "calculator", "--jobs", str(jobs))
            name = f"autograder grade --jobs {jobs}"
            print(f"{name:28}{seconds:8.1f}{60 * count / seconds:10.1f}{stock / seconds:8.1f}")
    if options.many:
        with tempfile.TemporaryDirectory() as scratch:
            many(Path(scratch), options.many)


if __name__ == "__main__":
    main()
