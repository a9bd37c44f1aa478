"""A program that floods its ROS domain while it is judged gains nothing, and costs nobody else anything.

Whatever it publishes is heard by the process that judges it alone: log lines of any length and at any rate, bytes that
are no messages, topics and services without number.  It must end as a grading, never as a failure of the grader's.
"""

import json

import pytest

from autograder.records import BUSY_MACHINE, FAILED, GRADED, KILLED_JUDGE, NOT_RUN, PASSED, Verdict, to_line
from autograder.sandbox.launching import KEPT, LONGEST, TELL
from autograder.submissions import exercises
from tests import chosen
from tests.hidden.answers.services import REFERENCE

HEAD = """
import threading, time
import rclpy
from rcl_interfaces.msg import Log, Parameter, ParameterEvent, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message
from std_msgs.msg import String

class Attacker(Node):
    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        threading.Thread(target=attack, args=(self,), daemon=True).start()

def attack(node):
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""
ATTACKS = {
    "long and many log lines": """
    log = node.create_publisher(Log, '/rosout', latched)
    for size in (100, 3_000_000) * 200:
        log.publish(serialize_message(Log(name='x', level=20, msg=size * 'x')))
        time.sleep(0.005)
""",
    "bytes that are no messages": """
    made = [node.create_publisher(kind, topic, latched)
            for kind, topic in ((Log, '/rosout'), (ParameterEvent, '/parameter_events'))]
    for _ in range(200):
        for each in made:
            each.publish(bytes([0, 1, 0, 0]) + bytes(12) + bytes([255] * 4) + b'abc')
            each.publish(bytes([0, 1, 0, 0]) + bytes(3))
        time.sleep(0.01)
""",
    "huge parameter events": """
    events = node.create_publisher(ParameterEvent, '/parameter_events', QoSProfile(depth=1))
    value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=40_000_000 * 'x')
    huge = serialize_message(ParameterEvent(node='/x', new_parameters=[Parameter(name='p', value=value)]))
    while True:
        events.publish(huge)
        time.sleep(1.0)
""",
    "a graph without end": """
    for number in range(300):
        node.create_publisher(String, f'/{150 * "t"}{number}', 1)
        node.create_client(SetParameters, f'/{150 * "s"}{number}')
""",
    "responses without end": """
    def answer(request, response):
        response.message = 150_000_000 * 'x'
        return response

    while True:
        for service in [*node.services]:
            if service.srv_name.startswith('/motors/'):
                service.callback = answer
        time.sleep(0.001)
""",
    "the grader's clock": """
    value = ParameterValue(type=ParameterType.PARAMETER_BOOL, bool_value=True)
    tried, end = set(), time.time() + 20
    while time.time() < end:
        for name, space in node.get_node_names_and_namespaces():
            client = node.create_client(SetParameters, f'{space.rstrip("/")}/{name}/set_parameters')
            if name != node.get_name() and name not in tried and client.wait_for_service(1.0):
                tried.add(name)
                request = SetParameters.Request(parameters=[Parameter(name='use_sim_time', value=value)])
                done = client.call_async(request)
                while not done.done() and time.time() < end:
                    time.sleep(0.01)
                print('it was set:', done.result(), flush=True)
            node.destroy_client(client)
        time.sleep(0.1)
""",
}


# Belong to the matrix: a program's words are bounded in test_attacks.py, and bytes flood the judge as names do.
ALIKE = {"long and many log lines", "a graph without end"}


def attacking(attack: str) -> dict[str, bytes]:
    """The right answer, but that each node of its motors attacks as well."""
    text = REFERENCE["motor_service.py"].decode()
    assert "(Node)" in text
    return REFERENCE | {"motor_service.py": (HEAD + attack + text.replace("(Node)", "(Attacker)")).encode()}


@pytest.fixture(scope="module")
def reports(request, grade):
    """The gradings that are asked about, all begun at once, with an honest one among them."""
    asked = chosen.values(request, "name")
    begun = {name: grade(attacking(attack), "services") for name, attack in ATTACKS.items() if name in asked}
    return begun | {"honest": grade(REFERENCE, "services")}


@pytest.mark.parametrize("name", chosen.cases(ATTACKS, ALIKE))
def test_it_is_judged_and_sets_nothing_of_the_graders(reports, name):
    report = reports[name].result()
    assert report.status == GRADED
    assert KILLED_JUDGE in report.flags or NOT_RUN not in [test.outcome for test in report.tests]
    assert "it was set" not in report.logs.get("motor_service.py", "")
    if (
        name in ("bytes that are no messages", "huge parameter events", "the grader's clock")
        and BUSY_MACHINE not in report.flags
    ):
        assert report.score == report.max_score, [test.message for test in report.tests if test.message]


@pytest.mark.parametrize("name", ["responses without end"])
def test_who_sends_without_end_loses_the_tests_of_that_file_alone(reports, name):
    """The judging process outlives it, so nothing is judged again, and the other file keeps its points."""
    report = reports[name].result()
    lost = [test.message for test in report.tests if test.outcome != PASSED]
    assert (report.flags, report.score) == ([], 10), lost
    assert all("motor_service.py" in message and "MiB at once" in message for message in lost)


def test_others_are_not_disturbed(reports):
    report = reports["honest"].result()
    assert (report.score, [test.message for test in report.tests if test.message]) == (report.max_score, [])


def test_the_longest_verdicts_are_told_whole():
    """A judge's messages are limited in size; a student's texts in every verdict must not reach the limit.

    Otherwise the verdicts that come later are missing, as if the grader had failed.
    """
    for name in exercises.names():
        tests = exercises.load(name).tests
        verdicts = [Verdict(test.id, FAILED, 9000 * "\U0001f600", 9000 * "\U0001f600").cut() for test in tests]
        lines = [to_line(verdict) for verdict in verdicts]
        assert sum(map(len, lines)) < KEPT / 1.5
        assert max(len(json.dumps({"do": TELL, "line": line.decode()})) for line in lines) < LONGEST
