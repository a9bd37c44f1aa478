"""Which hidden test sees which mistake: `python -m tests.autograder.table [EXERCISE]...` grades all answers and prints it.

Exits with 1 when a right answer loses a point, or a wrong one another test than it should.
"""

import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor

from autograder import exercises, grading, sandbox
from autograder.records import PASSED, Submission

from . import answers


def main(chosen: list[str]) -> int:
    """Print a table for each exercise: a row for an answer, a column for a test."""
    box, differences = sandbox.choose(), 0
    with ThreadPoolExecutor(os.cpu_count() + 1) as pool:
        for name in chosen or answers.names():
            module, exercise = answers.load(name), exercises.load(name)
            expected = {style: (files, set()) for style, files in module.RIGHT.items()} | module.WRONG
            start = time.monotonic()
            reports = {style: pool.submit(grading.grade, Submission("student", name, files), box,
                                           patience=answers.patience(name, style), seed=answers.seed(name, style))
                       for style, (files, _) in expected.items()}
            tests = [test.id.removeprefix("test_") for test in exercise.tests]
            width = max(map(len, expected))
            for number, test in enumerate(exercise.tests):
                print(f"{' ' * width} {'| ' * number}{test.id.removeprefix('test_')} ({test.points:g})")
            for style, report in reports.items():
                report = report.result()
                lost = {test.id.removeprefix("test_") for test in report.tests if test.outcome != PASSED}
                differs = lost != expected[style][1]
                differences += differs
                print(f"{style:{width}} {' '.join('x' if test in lost else '.' for test in tests)} "
                      f"{report.duration_s:5.1f} s{'  EXPECTED: ' if differs else ''}"
                      f"{', '.join(sorted(expected[style][1])) or 'nothing' if differs else ''}", flush=True)
                if "--messages" in sys.argv:
                    for test in report.tests:
                        if test.message:
                            print(f"    {test.id}: {test.outcome}: {test.message}")
            print(f"{name}: {len(module.RIGHT)} right styles, {len(module.WRONG)} mutants, "
                  f"{time.monotonic() - start:.0f} s\n", flush=True)
    return 1 if differences else 0


if __name__ == "__main__":
    sys.exit(main([name for name in sys.argv[1:] if not name.startswith("-")]))
