"""After a hidden suite has changed: new scores are shown before they are written, and no old result is lost."""

import ast
import json
import shutil
from pathlib import Path

import pytest
from nbgrader.api import Gradebook

from autograder.errors import UnknownExercise, UsageError
from autograder.gradebook.book import Scores
from autograder.grading import batch, regrade
from autograder.grading.dispatch import Pool
from autograder.grading.this_machine import ThisMachine
from autograder.paths import HIDDEN
from autograder.records import FAILED, PASSED, Report
from autograder.results import output, summary
from autograder.results.looks import Look, looks
from autograder.submissions import exercises, listing
from tests.hidden.answers import SOLUTIONS


@pytest.fixture
def suite(tmp_path, monkeypatch) -> Path:
    """The suite of `services` in a copy of the hidden suites that may be changed."""
    hidden = tmp_path / "hidden"
    shutil.copytree(HIDDEN, hidden, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(exercises, "HIDDEN", hidden)
    changed()
    yield hidden / "services" / "suite.py"
    monkeypatch.undo()
    changed()


def changed() -> None:
    exercises.load.cache_clear()
    exercises.pack.cache_clear()


@pytest.fixture(scope="module")
def pool(confinement) -> Pool:
    return ThisMachine(1, 1.0, False)


def run(pool, out, assignment=None, students=(), everything=False, apply=False) -> tuple[int, list[regrade.Move]]:
    """Return how many were graded, and the moves."""
    with (
        output.Output(out, resume=True) as results,
        Scores(f"sqlite:///{out / 'gradebook.db'}") as scores,
        regrade.Regrading(results, assignment, list(students), everything) as again,
    ):
        graded = len([*again.run(pool)])
        moves = again.moves()
        if apply:
            for submitted in again.folders:
                again.apply(submitted, scores.write)
            again.forget()
    return graded, moves


def hand_in(submitted: Path, student: str) -> None:
    """Lay down the right relay, and motors that end at once, which are judged quickly: 10 of 20 points."""
    shutil.copytree(SOLUTIONS / "services", submitted / student / "services", dirs_exist_ok=True)
    (submitted / student / "services" / "motor_service.py").write_text("def main(:\n")


@pytest.mark.long("two submissions are graded, and graded again")
def test_who_moves_is_told_first_and_written_when_asked(pool, suite, tmp_path):
    submitted, out = tmp_path / "submitted", tmp_path / "out"
    for student in ("ada", "bob"):
        hand_in(submitted, student)
    program = submitted / "bob" / "services" / "relay.py"
    program.write_text(program.read_text().replace("AddTwoInts.Request(a=a, b=b)", "AddTwoInts.Request(a=b, b=a)"))
    with output.Output(out, resume=False) as results, Scores(f"sqlite:///{out / 'gradebook.db'}") as scores:
        for report, origin in batch.run(pool, submitted, batch.draw(listing.find(submitted, None, []), 7)):
            results.write(report, origin)
            scores.write(report)
    before = (out / "results.jsonl").read_bytes()
    bob = {line["student"]: line["score"] for line in map(json.loads, before.splitlines())}["bob"]
    assert run(pool, out) == (0, []), "the suite is as it was"

    # The instructor finds that one test asked too much, and drops it.
    text = suite.read_text()
    test = next(test for test in exercises.load("services").tests if outcome(out, "bob", test.id) == FAILED)
    function = next(node for node in ast.parse(text).body if getattr(node, "name", "") == test.id)
    lines = text.splitlines(keepends=True)
    del lines[function.decorator_list[0].lineno - 1 : function.end_lineno]
    suite.write_text("".join(lines))
    changed()
    graded, moves = run(pool, out)
    assert graded == 2
    assert (out / "results.jsonl").read_bytes() == before, "nothing is written before it is asked for"
    by_student = {move.old.student: move for move in moves}
    assert by_student["bob"].why == [f"removed: {test.title}: failed, 0"]
    assert by_student["ada"].why == [f"removed: {test.title}: passed, {test.points:g}"]
    assert by_student["ada"].new.score == 10 - test.points and by_student["ada"].new.seed == 7

    graded, _ = run(pool, out, apply=True)
    assert graded == 0, "what was shown is what is written"
    assert {key[0]: report.score for key, report in read(out).items()} == {"ada": 10 - test.points, "bob": bob}
    assert set((out / "history.jsonl").read_bytes().splitlines()) == set(before.splitlines()), (
        "the old results are readable"
    )
    assert len((out / "results.jsonl").read_text().splitlines()) == 2
    with Gradebook(f"sqlite:///{out / 'gradebook.db'}") as book:
        assert {s.student_id: s.score for s in book.assignment_submissions("services")} == {
            "ada": 10 - test.points,
            "bob": bob,
        }
    assert run(pool, out) == (0, [])


def read(out) -> dict[tuple[str, str], Report]:
    return output.read_results(out)


def outcome(out, student: str, test: str) -> str:
    return next(result.outcome for result in read(out)[student, "services"].tests if result.id == test)


def nothing_handed_in(pool, folder: Path) -> tuple[Path, Path]:
    """Submissions, and their results: Ada has handed in an empty folder."""
    submitted, out = folder / "submitted", folder / "out"
    (submitted / "ada" / "services").mkdir(parents=True)
    with output.Output(out, resume=False) as results:
        for report, origin in batch.run(pool, submitted, {("ada", "services"): 7}):
            results.write(report, origin)
    return submitted, out


def test_files_handed_in_since_are_named(pool, suite, tmp_path):
    submitted, out = nothing_handed_in(pool, tmp_path)
    hand_in(submitted, "ada")
    assert run(pool, out, students=["ada"])[0] == 1, "what was handed in since is graded again without being asked for"
    _, (move,) = run(pool, out, everything=True)
    assert (move.old.status, move.new.status, move.new.score) == ("invalid_submission", "graded", 10)
    assert move.why[0] == "other files were handed in since" and move.moved
    assert (move.old.seed, move.new.seed == 7) == (7, False), "what the last grading asked is not asked again"
    with pytest.raises(UsageError, match="no result of student 'bob'"):
        run(pool, out, students=["bob"])
    with pytest.raises(UnknownExercise, match="there is no exercise 'nothing'"):
        run(pool, out, assignment="nothing")


def test_a_submission_that_is_gone_loses_no_score(pool, suite, tmp_path):
    """A folder that is gone, of a student or of the whole class, is not taken for an empty submission."""
    submitted, out = nothing_handed_in(pool, tmp_path)
    before = (out / "results.jsonl").read_bytes()
    (submitted / "ada").rename(submitted / "eve")
    with pytest.raises(UsageError, match="ada/services is no longer in"):
        run(pool, out, everything=True, apply=True)
    submitted.rename(tmp_path / "elsewhere")
    with pytest.raises(UsageError, match="the submissions of .* are no longer in"):
        run(pool, out, everything=True, apply=True)
    assert (out / "results.jsonl").read_bytes() == before


def report(student: str, *outcomes: str) -> Report:
    return Report.from_fields(
        {
            "student": student,
            "assignment": "services",
            "status": "graded",
            "score": float(outcomes.count(PASSED)),
            "max_score": 3.0,
            "seed": 1,
            "duration_s": 1.0,
            "tests": [
                {
                    "id": f"test_{number}",
                    "title": f"<i>{number}",
                    "outcome": outcome,
                    "points": float(outcome == PASSED),
                    "max_points": 1.0,
                }
                for number, outcome in enumerate(outcomes)
            ],
        }
    )


def test_item_analysis():
    """Shares that passed, tests that everybody or nobody passed, and one that mostly weaker submissions passed."""
    reports = [
        report("a", PASSED, FAILED, FAILED),
        report("b", PASSED, FAILED, PASSED),
        report("c", PASSED, FAILED, PASSED),
        report("<b>d", PASSED, "crashed", FAILED),
    ]
    (services,) = summary.classes(reports)
    assert [item.passed for item in services.items] == [1, 0, 0.5]
    assert [item.remark.split(":")[0] for item in services.items] == ["everybody passed", "nobody passed", ""]
    assert services.histogram == [0, 0, 0, 2, 0, 0, 2, 0, 0, 0]
    assert looks(reports) == [Look("programs crashed", ["<b>d/services (in 1 of 3 tests)"])]
    page = summary.page(reports)
    assert "&lt;b&gt;d" in page and "<b>" not in page and "<i>1" not in page
    odd = [
        report("a", PASSED, PASSED, FAILED),
        report("b", FAILED, FAILED, PASSED),
        report("c", PASSED, PASSED, FAILED),
    ]
    assert summary.classes(odd)[0].items[2].remark == "passed mostly by weaker submissions: is the test right?"
