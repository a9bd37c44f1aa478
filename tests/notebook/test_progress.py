"""`course.progress()`: what the saved notebooks say of their exercises."""

import json

import pytest

import course
from course.foundation import cells
from course.notebook import file_record
from course.notebook.progress import Ran, parts, progress


def mark(name: str, points: float, **more) -> dict:
    return {"nbgrader": {"grade": True, "grade_id": name, "points": points, "locked": True, "solution": False} | more}


def check(name: str = "adder", count: int | None = 3, outputs: tuple = (), points: float = 7) -> dict:
    return {
        "cell_type": "code",
        "metadata": mark(name, points),
        "execution_count": count,
        "outputs": list(outputs),
        "source": "assert total == 3",
    }


def answer(count: int | None) -> dict:
    own = {"nbgrader": {"grade": False, "grade_id": "file", "locked": False, "solution": True}}
    return {"cell_type": "code", "metadata": own, "execution_count": count, "outputs": [], "source": "%%exercise a.py"}


def written(source: str = "x = 1\n") -> dict:
    """A cell whose file is `a.py`; the section's folder has that file with the text x = 1."""
    return answer(2) | {"source": f"%%exercise a.py\n{source}"}


def question(text: str) -> dict:
    return {"cell_type": "markdown", "metadata": mark("why", 5, locked=False, solution=True), "source": text}


@pytest.fixture
def section(tmp_path):
    def write(name: str, *cells: dict) -> None:
        (tmp_path / name).mkdir(exist_ok=True)
        (tmp_path / name / "a.py").write_text("x = 1\n")
        (tmp_path / name / f"{name}.ipynb").write_text(json.dumps({"cells": cells}))

    return write


ERROR = {"output_type": "error", "ename": "AssertionError", "evalue": "1 + 2 gave 4\nsecond line", "traceback": []}

REFUSED = ERROR | {"ename": "ExerciseError", "evalue": "a.py, line 1: invalid syntax: x = 2 +\nNothing was written"}


@pytest.mark.parametrize(
    ("cells", "state"),
    [
        ([written(), check(count=3)], "passed"),
        ([written("x = 2\n"), check(count=3)], "changed since the check: a.py"),
        ([check(count=3), written("x = 2\n")], "passed"),
        ([answer(None), check(count=None)], "not run"),
        ([answer(2), check(outputs=(ERROR,))], "not yet: 1 + 2 gave 4"),
        ([answer(4), check(count=3)], "run it again: a.py was written again since"),
        ([answer(4), check(count=3, outputs=(ERROR,))], "run it again: a.py was written again since"),
        (
            [written("x = 2 +\n") | {"execution_count": 4, "outputs": [REFUSED]}, check(count=3, outputs=(ERROR,))],
            "not yet: 1 + 2 gave 4",
        ),
        ([check(count=3), answer(4)], "passed"),  # the file of a later part
        ([question("YOUR ANSWER HERE")], "not answered"),
        ([question("Because it blocks.")], "answered"),
    ],
)
def test_the_state_of_a_part(section, tmp_path, cells, state):
    section("services", *cells)
    assert [part.state for part in progress(tmp_path)] == [state]


HINT = {"output_type": "stream", "name": "stderr", "text": "a note\nHint: it returns the first number\nin line 3\n"}


@pytest.mark.parametrize(
    ("outputs", "more"),
    [
        ((ERROR,), "second line"),
        ((ERROR, HINT), "second line\nHint: it returns the first number\nin line 3"),
        ((HINT, ERROR | {"evalue": ""}), "Hint: it returns the first number\nin line 3"),
        ((HINT,), ""),
        ((ERROR | {"evalue": "x\n" + 10_000 * "y"},), 4000 * "y"),
    ],
)
def test_the_whole_message_of_a_check_that_has_failed_is_kept(section, tmp_path, outputs, more):
    section("services", written(), check(outputs=outputs))
    assert [part.more for part in progress(tmp_path)] == [more]


@pytest.mark.parametrize("error", [(), (ERROR,)])
def test_what_a_check_has_judged_counts_whatever_kernel_has_numbered_the_cells(section, tmp_path, error):
    """After a restart, a cell that was run before has a higher number than the check."""
    section("services", written() | {"execution_count": 38}, check(count=2, outputs=error))
    folder = tmp_path / "services"
    file_record.note_checked(folder, "adder", {"a.py": file_record.digest(b"x = 1\n")}, passed=not error)
    assert [part.state for part in progress(tmp_path)] == ["not yet: 1 + 2 gave 4" if error else "passed"]
    section("services", written("x = 2\n") | {"execution_count": 1}, check(count=40, outputs=error))
    (folder / "a.py").write_text("x = 2\n")  # by its cell, in another kernel
    file_record.note_written(folder / "a.py", b"x = 2\n")
    assert [part.state for part in progress(tmp_path)] == ["run it again: a.py was written again since"]
    (folder / "a.py").write_text("x = 3\n")  # by hand
    assert [part.state for part in progress(tmp_path)] == ["changed since the check: a.py"]


@pytest.mark.parametrize("before", [check(count=None), check(outputs=(ERROR,)), check()])
def test_a_check_that_has_passed_on_the_file_elsewhere_has_passed_until_it_fails(section, tmp_path, before):
    """As in a hand-in, which runs the checks beside the notebook, whose outputs are of an earlier run or of none."""
    section("services", written() | {"execution_count": 9}, before)
    folder, text = tmp_path / "services", {"a.py": file_record.digest(b"x = 1\n")}
    file_record.note_checked(folder, "adder", text, passed=True)
    assert [part.state for part in progress(tmp_path)] == ["passed"]
    section("services", written() | {"execution_count": 9}, check(count=10, outputs=(ERROR,)))
    file_record.note_checked(folder, "adder", text, passed=False)
    assert [part.state for part in progress(tmp_path)] == ["not yet: 1 + 2 gave 4"]


@pytest.mark.parametrize(
    ("before", "judged"), [(check(count=None), ""), (check(), "y = 1\n"), (check(outputs=(ERROR,)), "y = 1\n")]
)
def test_a_check_that_has_failed_in_a_hand_in_has_failed_for_the_files_as_they_are(section, tmp_path, before, judged):
    section("services", written() | {"execution_count": 9}, before)
    folder, now = tmp_path / "services", {"a.py": file_record.digest(b"x = 1\n")}
    if judged:
        file_record.note_checked(folder, "adder", {"a.py": file_record.digest(judged.encode())}, passed=False)

    def state(files, outcome="not yet: it gave 4\nnot 3"):
        known = cells.read(folder / "services.ipynb")
        (part,) = parts("services", known, folder, Ran(files, {"adder": outcome}))
        return part.state, part.more

    assert state(now) == ("not yet: it gave 4", "not 3")
    old = "run it again: a.py was written again since" if judged else "not run"
    assert state(now, "passed")[0] == state({"a.py": file_record.digest(b"x = 2\n")})[0] == state({})[0] == old
    file_record.note_checked(folder, "adder", now, passed=True)
    assert state(now) == ("passed", "")


def test_a_cell_that_was_edited_and_not_run_makes_each_later_check_old(section, tmp_path):
    later = answer(4) | {"source": "%%exercise b.py\ny = 1\n"}
    section("services", written("x = 2\n"), check("first"), later, check("second", count=5))
    (tmp_path / "services/b.py").write_text("y = 1\n")
    assert [part.state for part in progress(tmp_path)] == ["changed since the check: a.py"] * 2
    assert progress(tmp_path).summary.startswith("0 of 2 parts done")


@pytest.mark.parametrize(
    ("user", "state"), [("y = 1\n", "passed"), ("from a import x\n", "changed since the check: a.py")]
)
def test_a_check_that_names_a_file_depends_on_that_and_what_it_uses(section, tmp_path, user, state):
    named = check(count=4) | {"source": "judge('user.py')"}
    user_cell = answer(3) | {"source": f"%%exercise user.py\n{user}"}
    section("services", written("x = 2\n"), user_cell, named)
    (tmp_path / "services" / "user.py").write_text(user)
    assert [part.state for part in progress(tmp_path)] == [state]
    (tmp_path / "services" / "a.py").unlink()
    assert [part.state for part in progress(tmp_path)] == [state]


def test_points_are_those_of_the_cells_and_are_promised_to_nobody(section, tmp_path):
    section("services", check("relay", points=8), check("motor", count=None, points=12), question("It blocks."))
    told = progress(tmp_path)
    assert told.summary.startswith("2 of 3 parts done: so far 13 of 25 points at most")
    assert repr(told).splitlines()[1].split() == ["services", "relay", "passed", "8"]
    assert told._repr_html_().count("<tr>") == 4 and "✓ passed" in told._repr_html_()


def test_sections_come_in_the_order_of_the_course_and_own_ones_last(section, tmp_path):
    for name in ("added", "calculator", "actions", "services"):
        section(name, check(name))
    section("broken")
    (tmp_path / "broken/broken.ipynb").write_text("{")
    assert [part.section for part in progress(tmp_path)] == ["services", "actions", "calculator", "added"]


def test_it_can_be_asked_for_in_a_sections_own_folder(section, tmp_path, monkeypatch):
    section("services", check())
    monkeypatch.chdir(tmp_path / "services")
    assert [part.section for part in course.progress()] == ["services"]


def test_where_there_is_no_section_it_says_so(tmp_path):
    (tmp_path / "empty").mkdir()
    assert "no exercises here" in repr(progress(tmp_path / "empty"))
    assert "no exercises here" in progress(tmp_path / "empty")._repr_html_()


def test_a_notebook_that_is_damaged_renamed_or_gone_is_named_with_the_reason(section, tmp_path):
    for name in ("services", "actions", "parameters", "calculator"):
        section(name, check(name))
    (tmp_path / "services/services.ipynb").write_text("{")
    (tmp_path / "actions").rename(tmp_path / "my_actions")
    (tmp_path / "parameters/parameters.ipynb").rename(tmp_path / "parameters/my.ipynb")
    (tmp_path / "calculator/calculator.ipynb").unlink()
    told = progress(tmp_path)
    assert told.unread == [
        ("services", "is damaged: it is not a notebook file: not JSON"),
        ("actions", "is in the folder my_actions: rename that folder to actions"),
        ("parameters", "is missing: if my.ipynb is meant, rename it"),
        ("calculator", "is missing: it was deleted or moved"),
    ]
    assert "services    services.ipynb    is damaged" in repr(told)
    assert told._repr_html_().count("<tr>") == 5
    assert told.summary.endswith("Not counted: services, actions, parameters, calculator.")
