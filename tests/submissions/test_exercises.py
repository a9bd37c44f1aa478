"""The hidden suites as the coordinator knows them, and what the notebook and the solution say of the same."""

import json
import shutil
from pathlib import Path

import pytest

from autograder.errors import BrokenExercise, UnknownExercise
from autograder.grading import single
from autograder.paths import HIDDEN
from autograder.records import INFRASTRUCTURE_ERROR, Submission
from autograder.results.text import describe
from autograder.submissions import exercises

ROOT = Path(__file__).parents[2]
TEST = '@{}\ndef test_a():\n    """It greets."""\n\n'
POINTS = {  # what is no @points(NUMBER, cell="NAME"), and how the message ends
    "points()": r"it is points\(\)",
    "points(2)": r"it is points\(2\)",
    "points(cell='a')": r"it is points\(cell='a'\)",
    "points(2, 'a')": r"it is points\(2, 'a'\)",
    "points(2, cell='a', more=1)": r"it is points\(2, cell='a', more=1\)",
    "points(2, cell='a', cell='b')": r"it is points\(2, cell='a', cell='b'\)",
    "points(2, 3, cell='a')": r"it is points\(2, 3, cell='a'\)",
    "points(*a)": r"it is points\(\*a\)",
    "points(*a, cell='a')": r"\*a is not a number",
    "points(2, **a)": r"it is points\(2, \*\*a\)",
    "points('x', cell='y')": "'x' is not a number",
    "points(True, cell='a')": "True is not a number",
    "points(2j, cell='a')": "2j is not a number",
    "points(number, cell='a')": "number is not a number",
    "points(1 + 1, cell='a')": r"1 \+ 1 is not a number",
    "points(-1, cell='a')": "-1 is not a number of points",
    "points(1e999, cell='a')": "1e309 is not a number of points",
    "points(2, cell=name)": "name is not a cell's name in quotation marks",
    "points(2, cell=3)": "3 is not a cell's name in quotation marks",
    "points(2, cell='')": "'' is not a cell's name in quotation marks",
}
VALUES = [  # key and value in exercise.toml, and how the message ends
    ("title", "3", "3"),
    ("title", "''", "''"),
    ("files", "'x'", "'x'"),
    ("files", "[]", r"\[\]"),
    ("files", "[1]", r"\[1\]"),
    ("files", "['../a.py']", r"\['\.\./a\.py'\]"),
    ("files", "['..']", r"\['\.\.'\]"),
    ("files", "['a.py', 'a.py']", r"\['a\.py', 'a\.py'\]"),
    ("package", "1", "1"),
    ("time_limit", "'60'", "'60'"),
    ("time_limit", "true", "True"),
    ("time_limit", "0", "0"),
    ("time_limit", "inf", "inf"),
    ("time_limit", "nan", "nan"),
    ("early", "[]", r"\[\]"),
    ("early", "{a = 'b'}", r"\{'a': 'b'\}"),
    ("early", "{a = []}", r"\{'a': \[\]\}"),
    ("early", "{a = [1]}", r"\{'a': \[1\]\}"),
]


def toml(**values: str) -> str:
    """An exercise.toml that is right but for these values."""
    right = {"title": "'Greets'", "files": "['a.py']", "time_limit": "60"}
    return "".join(f"{key} = {value}\n" for key, value in (right | values).items())


@pytest.mark.parametrize("name", exercises.names())
def test_fits_notebook_and_solution(name):
    exercise = exercises.load(name)
    solution = ROOT / "solutions" / name
    assert all((solution / file).is_file() for file in exercise.files)
    for definition in exercise.interfaces:
        assert definition.read_text() == (solution / definition.name).read_text()
    assert exercises.difference(name, ROOT / "notebooks" / name / f"{name}.ipynb") == ""


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("exercise.toml", "title = 'Greets'\nfils = []\n", r"exercise\.toml has no 'files'"),
        ("exercise.toml", "title =\n", "cannot be read: .*line 1"),
        ("suite.py", "def test_a():\n    pass)\n", r"suite\.py, line 2: unmatched '\)'"),
        ("suite.py", "def test_a():\n    pass\n", "test_a needs one @points"),
        ("suite.py", "def helper():\n    pass\n", r"suite\.py has no test"),
        ("suite.py", "a = '\0'\n", r"suite\.py: .*null bytes"),
        ("suite.py", TEST.format("points(1, cell='a')") * 2, "line 6: test_a is defined twice"),
        ("suite.py", TEST.format("points(1, cell='a')\n@points(1, cell='a')"), "test_a needs one @points"),
        *(("suite.py", TEST.format(call), f"line 2: test_a needs @points.*; {told}$") for call, told in POINTS.items()),
        *(("exercise.toml", toml(**{key: value}), f"{key} must be .*, not {told}$") for key, value, told in VALUES),
    ],
)
def test_a_mistake_in_an_exercise_is_told_in_a_line(tmp_path, file, text, message):
    shutil.copytree(HIDDEN / "services", tmp_path / "services")
    (tmp_path / "services" / file).write_text(text)
    with pytest.raises(BrokenExercise, match=message) as told:
        exercises.load("services", tmp_path)
    assert "\n" not in str(told.value)


def test_a_mistake_in_a_test_is_no_score_and_is_told_the_instructor_alone(confinement, tmp_path, caplog):
    shutil.copytree(HIDDEN, tmp_path / "hidden")
    suite = tmp_path / "hidden" / "services" / "suite.py"
    name = exercises.load("services").tests[0].id
    suite.write_text(suite.read_text() + f"\n\n{name}.__globals__['twice_two'] = undefined_name\n")
    files = {path.name: path.read_bytes() for path in (ROOT / "solutions" / "services").iterdir() if path.is_file()}
    exercise = exercises.load("services", tmp_path / "hidden")
    report = single.grade(Submission("ada", "services", files), confinement, exercise=exercise)
    assert (report.status, report.score) == (INFRASTRUCTURE_ERROR, None)
    assert "undefined_name" not in str(report.public()) and "undefined_name" in describe(report, report.details)
    assert [record.getMessage().count("\n") for record in caplog.records] == [0] * single.TRIES


def test_a_difference_between_notebook_and_suite_is_told(tmp_path):
    book = ROOT / "notebooks" / "services" / "services.ipynb"
    assert exercises.difference("services", book) == ""
    changed = json.loads(book.read_text())
    cell = next(cell for cell in changed["cells"] if cell["metadata"].get("nbgrader", {}).get("grade_id") == "relay")
    points, cell["metadata"]["nbgrader"]["points"] = cell["metadata"]["nbgrader"]["points"], 3
    (tmp_path / "services.ipynb").write_text(json.dumps(changed))
    assert exercises.difference("services", tmp_path / "services.ipynb") == (
        f"cell relay has 3 points in the notebook, {points} in the suite"
    )


def test_unknown():
    with pytest.raises(UnknownExercise, match="there is no exercise 'nothing'"):
        exercises.load("nothing")
