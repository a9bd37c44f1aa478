"""No hidden suite is laxer than the public checks: a program that a check refuses loses points."""

import pytest

from autograder.records import GRADED
from tests.chosen import values
from tests.hidden import answers
from tests.notebook.test_public_checks import MORE, SENTENCES, files_of

# Programs that a check refuses, and that keep all points, each with the reason.
KEEPS = {
    (
        "calculator",
        "15.5 add 3.2 succeeded with the message 'Division by zero' of that refusal: each answer must depend on",
    ): "whether a success has a message is up to the student: the hidden tests look at its success and its result",
    (
        "actions",
        "and '2 1 --fast' it must print its usage, and send no goal; it sent one for the floors [2, 1]",
    ): "an option that nobody asks for: the hidden tests look at wrong floors and numbers",
    (
        "calculator",
        "an operation of 60 letters, all of them x, must not succeed",
    ): "the hidden tests look whether the server goes on after so long an operation, not at its answer",
    (
        "calculator",
        "1.0004 add 2.0 gave 4.0004, and asked once more, 3.0004: each answer must depend on its own request alone",
    ): "wrong after one request of the check alone: the hidden tests draw others",
    (
        "parameters",
        "a refused set of joint_name changed the integral:",
    ): "a callback for this one name: the hidden tests look at the integral after refused sets of gains and limits",
    (
        "parameters",
        "started with kp:=2.0, output_min:=1.0, output_max:=3.0, ki:=5.0, an error of",
    ): "wrong for the output_max of the check alone: the hidden tests draw others",
    (
        "parameters",
        "a refused set of ki changed the integral:",
    ): "wrong for the ki of the check alone: the hidden tests draw others",
    (
        "parameters",
        "a refused set of ki and output_min changed the integral:",
    ): "wrong for a ki above 30 alone: the hidden tests draw smaller ones where the limits are wrong, too",
    (
        "services",
        "a parameter must be set at once, also while callers wait; it took 1.",
    ): "a busy machine may take as long: the hidden tests look whether it is set before a call ends",
}


def mutants() -> dict[tuple[str, str], dict[str, bytes]]:
    """The files of each program that a public check is known to refuse, by exercise and what is wrong."""
    found = {(exercise, name): files_of(exercise, name) for exercise, named in MORE.items() for name in named}
    for case in SENTENCES:
        exercise, _, file, old, new, says = getattr(case, "values", case)
        name = f"{says.strip()} ({new.strip()})" if (exercise, says.strip()) in found else says.strip()
        found[exercise, name] = answers.changed(answers.solution(exercise), file, (old, new))
    return found


MUTANTS = mutants()


@pytest.fixture(scope="module")
def begun(request, grade):
    """The gradings of the chosen mutants: all begin at once."""
    chosen = values(request, "mutant")
    return {each: grade(MUTANTS[each], each[0]) for each in chosen}


def test_all_programs_are_there():
    assert len(MUTANTS) == len(SENTENCES) + sum(map(len, MORE.values()))
    assert {*KEEPS} <= {*MUTANTS}


@pytest.mark.matrix
@pytest.mark.parametrize("mutant", MUTANTS, ids=" ".join)
def test_what_a_public_check_refuses_loses_points(begun, mutant):
    report = begun[mutant].result()
    assert report.status == GRADED
    assert (report.score < report.max_score) == (mutant not in KEEPS)
