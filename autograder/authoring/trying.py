"""`autograder try`: runs an exercise's hidden tests on right and wrong answers that an instructor has written.

FOLDER/right has a folder for each right answer, FOLDER/wrong one for each wrong answer.  A file missing from an answer
is taken from the solution.
"""

import secrets
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from autograder.errors import UsageError
from autograder.grading.dispatch import Dispatcher, Pool, Task
from autograder.paths import repository
from autograder.records import GRADED, PASSED, Report
from autograder.results import progress
from autograder.results.text import one_line, score
from autograder.submissions import exercises, reading

RIGHT, WRONG = "right", "wrong"


@dataclass(frozen=True)
class Trial:
    """The reports on all answers, and the hidden tests that no wrong answer fails."""

    reports: dict[str, Report]  # by right/NAME or wrong/NAME
    untouched: list[str]  # hidden tests whose points no wrong answer loses

    @property
    def right(self) -> bool:
        """Return True if right answers keep all points, wrong ones lose some, and each hidden test catches one."""
        return not self.untouched and not any(map(surprising, self.reports.items()))

    def describe(self) -> str:
        """Return the text for the instructor: a line for each answer, and below it the points it loses."""
        lines = []
        for name, report in sorted(self.reports.items()):
            lines.append(f"{one_line(name)}: {score(report)}{_judged(name, report)}")
            for test in report.tests:
                if test.outcome != PASSED:
                    lines.append(f"  -{test.max_points - test.points:g} {test.id}: {one_line(test.message)}")
        if self.untouched:
            lines.append(f"Hidden tests that no wrong answer loses: {', '.join(self.untouched)}.")
        elif any(name.startswith(WRONG) for name in self.reports):
            lines.append("Each hidden test is lost by a wrong answer.")
        return "\n".join(lines)


def surprising(answer: tuple[str, Report]) -> bool:
    """Return True if a right answer has lost points, or a wrong one has not."""
    name, report = answer
    return report.status != GRADED or (report.score == report.max_score) == name.startswith(WRONG)


def run(folder: Path, exercise_name: str, pool: Pool, seed: int | None) -> Trial:
    """Grade all answers in `folder`; raises UsageError when there are none, or one has a file that is not handed in."""
    exercise = exercises.load(exercise_name)
    with tempfile.TemporaryDirectory() as place:
        found = dict(_complete(folder, exercise, Path(place)))
        if not found:
            raise UsageError(
                f"there are no answers in {folder}: put each into a folder of {folder / RIGHT} or .../{WRONG}"
            )
        submissions = [reading.read(at, name, exercise_name, exercise.files) for name, at in found.items()]
    tasks = [Task(one, secrets.randbits(32) if seed is None else seed) for one in submissions]
    dispatcher = Dispatcher(pool, tasks)
    dispatcher.begin()
    reports = {}
    with progress.shown(len(tasks)) as show:
        for report in dispatcher.run():
            reports[report.student] = report
            show(report)
    wrong = [report for name, report in reports.items() if name.startswith(WRONG)]
    lost = {test.id for report in wrong for test in report.tests if test.outcome != PASSED}
    return Trial(reports, [test.id for test in exercise.tests if wrong and test.id not in lost])


def _complete(folder: Path, exercise: exercises.Exercise, place: Path) -> Iterator[tuple[str, Path]]:
    """Copy each answer into `place`, completed with the solution's files; return the copies by name."""
    solution = repository() / "solutions" / exercise.name
    for kind in (RIGHT, WRONG):
        for answer in sorted((folder / kind).glob("*/")):
            if strange := sorted({path.name for path in answer.iterdir()} - exercise.taken - {"__pycache__"}):
                raise UsageError(f"{answer} has {strange[0]}; handed in are {', '.join(exercise.files)}")
            copy = place / kind / answer.name
            copy.mkdir(parents=True)
            for name in exercise.files:
                source = next((each / name for each in (answer, solution) if (each / name).exists()), None)
                if source:
                    shutil.copy(source, copy)
            yield f"{kind}/{answer.name}", copy


def _judged(name: str, report: Report) -> str:
    if not surprising((name, report)):
        return ""
    if report.status != GRADED:
        return f": {report.tests[0].message}"
    return ": no hidden test notices it" if name.startswith(WRONG) else ": it should keep all points"
