"""No file that students get, and no join of such files, earns half of an exercise."""

import pytest

from autograder.submissions import exercises
from tests import chosen

from . import shipped


@pytest.fixture(scope="module")
def student(tmp_path_factory):
    """The files that a student gets."""
    return shipped.student_files(tmp_path_factory.mktemp("shipped"))


@pytest.fixture(scope="module")
def programs(student):
    return shipped.candidates(student)


def test_every_program_that_is_shipped_is_tried(programs, student):
    nodes = {path.relative_to(student).as_posix() for path in student.glob("course/nodes/*.py")}
    assert nodes - {*programs} <= {
        "course/nodes/__init__.py",
        "course/nodes/world.py",
    }  # world.py: course/world/node.py
    assert {f"code of {path.name}" for path in student.glob("notebooks/[!.]*/*.ipynb")} <= {*programs}
    for name, text in programs.items():
        compile(text, name, "exec")
        assert b"from course." not in text and b"import course\n" not in text, name


@pytest.fixture(scope="module")
def likeliest(request, programs, grade):
    """The gradings of the programs that are most like the answers of the exercises asked about, all begun at once."""
    asked = chosen.values(request, "name")
    begun = {}
    for exercise in (exercises.load(name) for name in exercises.names() if name in asked):
        files = shipped.given(exercise) | shipped.likeliest(exercise, programs)
        begun[exercise.name] = grade(files, exercise.name, seed=1, patience=shipped.PATIENCE)
    return begun


# They keep the grader waiting in vain, or drive for long: they belong to the matrix.
SLOW = {"actions", "ai_integration", "calculator", "parameters"}
CASES = [pytest.param(name, marks=pytest.mark.matrix if name in SLOW else ()) for name in exercises.names()]


@pytest.mark.parametrize("name", CASES)
def test_the_program_that_is_most_like_the_answer_earns_less_than_half(name, likeliest):
    assert shipped.score(likeliest[name]) < exercises.load(name).max_score / 2


@pytest.mark.matrix
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", exercises.names())
def test_no_shipped_program_earns_half(name, student, programs, grade):
    result = shipped.earned(exercises.load(name), student, programs, grade)
    assert not result.too_much, result
