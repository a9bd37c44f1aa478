"""The same attacks through each file of the other exercises: what confines one program confines them all."""

import pytest

from autograder import exercises
from autograder.records import GRADED
from tests.autograder.answers import solution

from .programs import SPY

OTHERS = [name for name in exercises.names() if name != "calculator"]
FILES = [(name, file) for name in OTHERS for file in exercises.load(name).files]

# Says in the grader's own words that every test has passed, to whoever may listen, and ends well.
FORGER = """
import json, os
VERDICTS = ''.join(json.dumps(dict(id=name, outcome='passed', message='', detail='')) + '\\n' for name in {ids})
for descriptor in range(1, 64):
    try:
        os.write(descriptor, (VERDICTS + '{{"done": 0, "fault": "", "logs": {{}}}}\\n{{"status": 0}}\\n').encode())
    except OSError:
        pass
os._exit(0)
"""


# Answers for its parameters with values that cannot be read.
UNREADABLE = b"""
from rcl_interfaces.msg import ParameterValue
from rclpy.parameter_service import ParameterService

def get_parameters(self, request, response):
    response.values = [ParameterValue(type=99) for _ in request.names]
    return response

ParameterService._get_parameters_callback = get_parameters
"""


@pytest.fixture(scope="module")
def forged(request, grade):
    """The gradings with one file forged, all begun at once."""
    asked = {item.callspec.id for item in request.session.items
             if item.path == request.path and "file" in getattr(getattr(item, "callspec", None), "params", {})}
    ids = {name: [test.id for test in exercises.load(name).tests] for name in OTHERS}
    return {(name, file): grade(solution(name) | {file: FORGER.format(ids=ids[name]).encode()}, name)
            for name, file in FILES if f"{name}-{file}" in asked}


@pytest.mark.parametrize(("name", "file"), FILES)
def test_forged_verdicts_earn_nothing(forged, name, file):
    """The other file of the exercise keeps its points."""
    report = forged[name, file].result()
    cell = file.removesuffix(".py").replace("_", "-")
    cells = {test.id: test.cell for test in exercises.load(name).tests}
    honest = 0 if len(exercises.load(name).files) == 1 else sum(
        test.max_points for test in report.tests if cells[test.id] != cell)
    assert (report.status, report.score) == (GRADED, honest), [(test.id, test.outcome) for test in report.tests]


@pytest.mark.parametrize("name", OTHERS)
def test_whoever_looks_around_finds_nothing_and_loses_nothing(grade, name):
    """No suite, no verdict, no other submission, no grader; and a right answer stays right."""
    report = grade({file: SPY.encode() + content for file, content in solution(name).items()}, name).result()
    assert (report.status, report.score) == (GRADED, 20), [(test.id, test.message) for test in report.tests]
    assert all("SPY held" in log for log in report.logs.values()), report.logs
    assert len(report.logs) == len(exercises.load(name).files)


def test_whoever_answers_what_cannot_be_read_is_graded(grade):
    """It is no fault of the grader's, which would never come to a score."""
    report = grade({file: UNREADABLE + content for file, content in solution("parameters").items()}, "parameters").result()
    lost = {test.id for test in report.tests if "has a type that there is not" in test.message}
    assert report.status == GRADED and {"test_defaults", "test_joint_name_is_read_only"} <= lost, report
