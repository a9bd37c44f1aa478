"""Mutants: one slip each, all of them, and the test that finds each."""

import ast
import time

import pytest

from course.errors import ExerciseError
from course.notebook import mutants
from course.notebook.mutants import HANGS, mutants_of, try_tests

PROGRAM = '''"""A program."""
LIMIT = -0.5


def near(distance, walls):
    while walls and not distance < LIMIT + 1.0:
        return True
    return distance * 2 == 4 or distance / 2 != 1 - walls


if __name__ == "__main__":
    print(near(1.0, 2) == True)
'''


def test_each_slip_is_made_once_by_itself():
    mutants = list(mutants_of(PROGRAM))
    assert [(mutant.line, mutant.slip) for mutant in mutants] == [
        (2, "-0.5 becomes 0.5"),
        (2, "0.5 becomes 0.0"),
        (6, "and becomes or"),
        (6, "< becomes <="),
        (6, "+ becomes -"),
        (6, "1.0 becomes 0.0"),
        (7, "True becomes False"),
        (8, "or becomes and"),
        (8, "== becomes !="),
        (8, "* becomes +"),
        (8, "!= becomes =="),
        (8, "/ becomes *"),
        (8, "- becomes +"),
    ]
    assert len({mutant.source for mutant in mutants}) == len(mutants)
    assert not any("print" in mutant.source for mutant in mutants), "what a program that is imported does not run"


class NotMine:
    """An object that another library has attached to a syntax tree: a copy would take seconds."""

    def __deepcopy__(self, memo):
        raise AssertionError("copied")


def test_mutants_copy_nothing_that_a_traceback_has_left_on_the_nodes_that_all_trees_share(monkeypatch):
    shared = ast.parse("a").body[0].value.ctx
    assert ast.parse("b").body[0].value.ctx is shared
    monkeypatch.setattr(shared, "parent", NotMine(), raising=False)
    assert len(list(mutants_of(PROGRAM))) == 13


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "near.py"
    path.write_text("def near(distance):\n    return distance < 0.5\n")
    return path


def test_the_test_that_finds_a_mutant_is_named_and_what_survives_is_said(file):
    tests = "from near import near\n\n\ndef test_far(): assert not near(2.0)\ndef test_near(): assert near(0.4)\n"
    assert repr(try_tests(file, tests)).splitlines() == [
        "line 2: < becomes <=          survives",
        "line 2: 0.5 becomes 0.0       found by test_near",
        "1 of 2 mutants found",
    ]
    assert [mutant.slip for mutant in try_tests(file, tests).survivors] == ["< becomes <="]


def test_a_mutant_that_does_not_end_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr("course.session.stacks.SPENT", 1.0)
    (tmp_path / "count.py").write_text("def count(n):\n    while not n == 0:\n        n = n - 1\n    return n\n")
    trial = try_tests(
        tmp_path / "count.py", "from count import count\ndef test_it(): assert count(3) == 0\n", timeout=3
    )
    assert [test for _, test in trial.found] == ["test_it", HANGS]


@pytest.mark.parametrize("line", ["while True: pass", "threading.Event().wait()"])
def test_tests_that_do_not_end_are_told_with_their_line(file, line, monkeypatch):
    monkeypatch.setattr(mutants, "USUAL", 300.0)
    monkeypatch.setattr("course.session.stacks.SPENT", 1.0)
    began = time.monotonic()
    with pytest.raises(ExerciseError) as error:
        tests = f"import threading, near\ndef test_it():\n    {line}\n"
        try_tests(file, tests, timeout=300.0 if "while" in line else 3.0)
    assert time.monotonic() - began < 200  # not only after its limit
    assert str(error.value).startswith("the tests do not end for the unchanged near.py. After ")
    assert str(error.value).endswith(f"they were here:\n  the tests, line 3, in test_it\n    {line}")


def test_swapped_arguments_are_told(file):
    with pytest.raises(ExerciseError, match="takes the name of the file first, and then the text of the tests"):
        try_tests("def test_it():\n    pass\n", str(file))


def test_a_file_without_its_ending_is_named_with_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "near.py").write_text("near = 1\n")
    with pytest.raises(ExerciseError, match=r"there is no file near: write try_tests\('near.py', ...\)"):
        try_tests("near", "def test_it():\n    pass\n")


CORRECT = ". Find out which of the two is wrong, near.py or the test, and correct it first"


@pytest.mark.parametrize(
    ("text", "tests", "said"),
    [
        (None, "import near\ndef test_it(): pass", "near.py is missing: run the cell that writes it first"),
        ("def near(:\n", "def test_it(): pass", "near.py, line 1: invalid syntax"),
        (
            "near = 1\n",
            "from near import near\ndef test_it(): assert near == 2\n",
            f"test_it fails for the unchanged near.py (assert 1 == 2){CORRECT}",
        ),
        (
            "near = 1\n",
            "import near\nimport nowhere\ndef test_it(): pass\n",
            f"the import fails for the unchanged near.py (ModuleNotFoundError: No module named 'nowhere'){CORRECT}",
        ),
        (
            "def near():\n    raise ValueError('far')\n",
            "from near import near\ndef test_it(): near()\n",
            f"test_it fails for the unchanged near.py (ValueError: far){CORRECT}",
        ),
        (
            "near = 1\n",
            "import pytest, near\n@pytest.fixture\ndef calculate(): pass\ndef test_it_computes(): calculate(1)\n",
            (
                "test_it_computes fails for the unchanged near.py (it calls the fixture 'calculate' like a function: "
                f"name 'calculate' among its arguments){CORRECT}"
            ),
        ),
        (
            "def main():\n    input()\n\n\nmain()\n",
            "import near\ndef test_it(): pass\n",
            (
                "near.py, line 5: `main()` runs when the tests import the file, too: put it below "
                "`if __name__ == '__main__':`"
            ),
        ),
        ("near = 1\n", "import near\ndef test_it()\n    pass", "the tests, line 2: expected ':'"),
        (
            "near = 1\n",
            "def test_it(): assert 2 + 2 == 4",
            "the tests never import near, so they cannot find anything: `import near`",
        ),
        (
            "near = 1\n",
            "from near import near\n",
            "there are no tests: a test is a function whose name begins with test_",
        ),
    ],
)
def test_what_cannot_be_tried_is_a_sentence(file, monkeypatch, text, tests, said):
    monkeypatch.setenv("FORCE_COLOR", "1")  # as in a kernel
    if text is None:
        file.unlink()
    else:
        file.write_text(text)
    with pytest.raises(ExerciseError) as error:
        try_tests(file, tests)
    assert str(error.value) == said


@pytest.mark.parametrize(
    ("named", "told"), [("it_refuses", True), ("test_it_refuses", False), ("refuses", False), ("helper", False)]
)
def test_a_test_that_pytest_does_not_run_is_told(file, capsys, named, told):
    text = f"def test_it(): refuses()\ndef {named}():\n    {'pass' if named == 'helper' else 'assert 1'}\n"
    with pytest.raises(ExerciseError):  # the tests do not import the file
        try_tests(file, text)
    says = f"name begins with test_; '{named}' is not called, so it is not a test."
    assert (says in capsys.readouterr().err) == told
