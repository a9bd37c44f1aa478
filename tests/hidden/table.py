"""The hidden tests that find each mistake: `python -m tests.hidden.table [EXERCISE]...` grades all answers.

It prints a table with a row for each answer and a column for each test: `x` was lost as it should be, `!` was lost but
should not be, `?` should have been lost.  Below it stand the points that an answer with one mistake loses.
Exits with 1 when there is a `!` or a `?`.

With `--right N` each right answer is graded N times instead, and only what loses a point is shown, with its seed.
"""

import argparse
import os
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

from autograder.grading import single
from autograder.records import BUSY_MACHINE, GRADED, PASSED, Submission
from autograder.sandbox import sandbox
from autograder.submissions import exercises

from . import answers, sentences


def main() -> int:
    """Print a table for each exercise that is asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.hidden.table", description=__doc__.partition("\n")[0])
    parser.add_argument("exercise", nargs="*", help=f"of {', '.join(answers.names())}; by default all")
    parser.add_argument("--answer", metavar="TEXT", default="", help="only the answers with TEXT in their name")
    parser.add_argument("--messages", action="store_true", help="show what the student is told, too")
    parser.add_argument("--right", type=int, metavar="N", help="grade only the right answers, each N times")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() + 1, help="gradings at a time (%(default)s)")
    options = parser.parse_args()
    if unknown := set(options.exercise) - {*answers.names()}:
        parser.error(f"no answers to {', '.join(sorted(unknown))}; there are those to {', '.join(answers.names())}")
    confinement = sandbox.choose()
    with ThreadPoolExecutor(options.jobs) as pool:
        how = again if options.right else show
        differences = [how(name, pool, confinement, options) for name in options.exercise or answers.names()]
    return 1 if any(differences) else 0


def again(name: str, pool: ThreadPoolExecutor, confinement: str, options) -> int:
    """Grade each right answer many times; returns how many gradings lost a point, and prints these."""
    start, right = time.monotonic(), answers.load(name).RIGHT
    gradings = [
        (
            style,
            pool.submit(
                single.grade, Submission("student", name, files), confinement, patience=answers.patience(name, style)
            ),
        )
        for _ in range(options.right)
        for style, files in right.items()
        if options.answer in style
    ]
    bad = busy = 0
    for style, grading in gradings:
        report = grading.result()
        lost = [test for test in report.tests if test.outcome != PASSED]
        bad += bool(lost) or report.status != GRADED
        busy += BUSY_MACHINE in report.flags
        if lost or report.status != GRADED:
            print(f"{name}: {style}: {report.status}, seed {report.seed} {report.flags}")
        for test in lost:
            print(
                f"    {test.id}: {test.outcome}: {test.message} [{report.details.get(test.id, '')[:200]}]", flush=True
            )
    took = time.monotonic() - start
    print(f"{name}: {len(gradings)} gradings of right answers in {took:.0f} s, {bad} lost points, {busy} flagged busy")
    return bad


def show(name: str, pool: ThreadPoolExecutor, confinement: str, options) -> int:
    """Print the table of one exercise; returns how many answers are not judged as they should be."""
    module, exercise = answers.load(name), exercises.load(name)
    expected = {style: (files, set()) for style, files in module.RIGHT.items()} | module.WRONG
    expected = {style: value for style, value in expected.items() if options.answer in style}
    if not expected:
        print(f"{name}: no answer has {options.answer!r} in its name\n")
        return 0
    start = time.monotonic()
    reports = {
        style: pool.submit(
            single.grade,
            Submission("student", name, files),
            confinement,
            patience=answers.patience(name, style),
            seed=answers.seed(name, style),
        )
        for style, (files, _) in expected.items()
    }
    tests = [test.id.removeprefix("test_") for test in exercise.tests]
    width = max(map(len, expected))
    for number, test in enumerate(exercise.tests):
        print(f"{' ' * width} {'| ' * number}{tests[number]} ({test.points:g})")
    good, seen, cost = Counter(), Counter(), {}
    for style, grading in reports.items():
        report, wanted = grading.result(), expected[style][1]
        lost = {test.id.removeprefix("test_") for test in report.tests if test.outcome != PASSED}
        good[style in module.WRONG] += lost == wanted and report.status == GRADED
        seen.update(lost & wanted)
        if style in module.WRONG:
            cost[style] = sum(test.max_points - test.points for test in report.tests)
        row = " ".join(
            {(True, True): "x", (True, False): "!", (False, True): "?"}.get((test in lost, test in wanted), ".")
            for test in tests
        )
        print(
            f"{style:{width}} {row} {report.duration_s:5.1f} s, seed {report.seed}"
            f"{'' if report.status == GRADED else f'  {report.status}'}",
            flush=True,
        )
        for test in report.tests:
            if test.message and (options.messages or lost != wanted):
                print(f"    {test.id}: {test.outcome}: {test.message} [{report.details.get(test.id, '')[:200]}]")
    right, wrong = (len({*expected} & {*kind}) for kind in (module.RIGHT, module.WRONG))
    print(f"{'mistakes that lose it':{width}} {' '.join(str(min(seen[test], 9)) for test in tests)}  (9: or more)")
    print(
        f"{name}: {good[False]} of {right} right answers earn all, {good[True]} of {wrong} wrong ones lose what they "
        f"should, {time.monotonic() - start:.0f} s"
    )
    if losses := sentences.losses(name, cost):
        print(f"one mistake costs {losses.median:g} points in the median, {losses.most:g} at most")
    nothing = [exercise.max_score - points for style, points in cost.items() if style in answers.named(name, "NOTHING")]
    if nothing:
        print(f"an answer that does nothing earns {max(nothing):g} points at most")
    print(flush=True)
    return right + wrong - good.total()


if __name__ == "__main__":
    sys.exit(main())
