"""No attack earns more than its honest part, reads what is not its own, disturbs another grading, or outlives it."""

import re

import pytest

from autograder.records import GRADED
from autograder.results import feedback
from tests import chosen
from tests.hidden.answers.calculator import REFERENCE
from tests.processes import programs_left

from .programs import ALIKE, ATTACKS, DAEMONS, IDLE_SERVER, LARGE, REPOSITORY, handed_in

CASES = chosen.cases(ATTACKS, ALIKE)


@pytest.fixture(scope="module")
def reports(request, grade):
    """The gradings of the attacks that are asked about, all begun at once, with an honest submission among them."""
    asked = chosen.values(request, "name")
    begun = {name: grade(files, seed=20261) for name, (files, _) in ATTACKS.items() if name in asked}
    return begun | {"honest": grade(REFERENCE)}


@pytest.mark.parametrize("name", CASES)
def test_earns_no_more_than_its_honest_part(reports, name):
    report = reports[name].result()
    assert report.status == GRADED
    assert report.score <= ATTACKS[name][1], [(test.id, test.outcome, test.message) for test in report.tests]
    # What is honest in it is not lost either, but where the attack itself kills it.
    if ATTACKS[name][1] in (0, 2, 20) or "60,000" in name:
        assert report.score == ATTACKS[name][1], [(test.id, test.outcome, test.message) for test in report.tests]
    inside = rf"suite\.py|conversation\.py|{re.escape(str(REPOSITORY))}|/tmp/autograder|hidden/"
    assert not re.search(inside, str(report.public()))
    if "looks" in name:
        assert all("SPY held" in log for log in report.logs.values()) and len(report.logs) == 2, report.logs


@pytest.mark.parametrize("name", CASES)
def test_its_page_is_safe(reports, name):
    report = reports[name].result()
    page = feedback.page(report)
    assert len(page) < 30_000 < LARGE
    assert not re.search(r"<(script|img|iframe|object|a)\b|[\x00-\x08\x0b-\x1f\u202e]", page)
    if "script" in name:
        assert "&lt;script&gt;" in page
    if "templates" in name:
        assert "{% for x in range" in page and "xxx" not in page
    own = b"".join(ATTACKS[name][0].values()).decode(errors="replace")  # what it prints itself may be shown
    for detail in report.details.values():
        for number in re.findall(r"\d{4,}\.\d+", detail):
            assert number in own or number not in page


def test_a_former_grading_answers_no_other(grade):
    """Nothing that a submission leaves behind, in its place or the grader's, helps a later one."""
    assert grade(handed_in(*DAEMONS), seed=1).result().score <= 2
    assert programs_left() == []
    assert grade(handed_in(IDLE_SERVER), seed=1).result().score == 2


def test_what_is_alike_is_an_attack():
    assert {*ALIKE} <= {*ATTACKS}


def test_others_are_not_disturbed(reports):
    honest = reports["honest"].result()
    assert (honest.score, [test.message for test in honest.tests if test.message]) == (20, [])


def test_none_outlives_its_grading(reports):
    for report in reports.values():
        report.result()
    assert programs_left() == []
