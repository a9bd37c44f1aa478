"""The same attacks through each file of the other exercises: what confines one program confines them all.

One file shows it in each run; the others belong to the matrix.
"""

import pytest

from autograder.records import GRADED, PASSED
from autograder.submissions import exercises
from tests import chosen
from tests.hidden.answers import solution

from .programs import SPY

OTHERS = [name for name in exercises.names() if name != "calculator"]
FILES = [(name, file) for name in OTHERS for file in exercises.load(name).files]
IN_EACH_RUN = {("services", "relay.py")}  # test_attacks.py has one that looks around in each run

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


def cases(those: list) -> list:
    """Return parameters of which those not IN_EACH_RUN belong to the matrix."""
    return [
        pytest.param(
            *(case if isinstance(case, tuple) else (case,)), marks=() if case in IN_EACH_RUN else pytest.mark.matrix
        )
        for case in those
    ]


@pytest.fixture(scope="module")
def forged(request, grade):
    """The gradings with one file forged, all begun at once."""
    asked = {(each["name"], each["file"]) for each in chosen.parameters(request, "file")}
    ids = {name: [test.id for test in exercises.load(name).tests] for name in OTHERS}
    return {
        (name, file): grade(solution(name) | {file: FORGER.format(ids=ids[name]).encode()}, name)
        for name, file in FILES
        if (name, file) in asked
    }


# What the other file of an exercise keeps, where that is not all of its points: a node cannot run without its agent,
# and an agent drives nothing without its node.
KEPT = {"wall_agent.py": 0, "wall_follower.py": 6}


@pytest.mark.parametrize(("name", "file"), cases(FILES))
def test_forged_verdicts_earn_nothing(forged, name, file):
    """The other file of the exercise keeps its points."""
    report = forged[name, file].result()
    cell = file.removesuffix(".py").replace("_", "-")
    cells = {test.id: test.cell for test in exercises.load(name).tests}
    others = sum(test.max_points for test in report.tests if cells[test.id] != cell)
    honest = 0 if len(exercises.load(name).files) == 1 else KEPT.get(file, others)
    assert (report.status, report.score) == (GRADED, honest), [(test.id, test.outcome) for test in report.tests]


@pytest.mark.parametrize("name", cases(OTHERS))
def test_whoever_looks_around_finds_nothing_and_loses_nothing(grade, name):
    """No suite, no verdict, no other submission, no grader; and a right answer stays right."""
    report = grade({file: SPY.encode() + content for file, content in solution(name).items()}, name).result()
    assert (report.status, report.score) == (GRADED, 20), [(test.id, test.message) for test in report.tests]
    assert all("SPY held" in log for log in report.logs.values()), report.logs
    assert len(report.logs) == len(exercises.load(name).files)


def test_whoever_answers_what_cannot_be_read_is_graded(grade):
    """It is no fault of the grader's, which would never come to a score."""
    report = grade(
        {file: UNREADABLE + content for file, content in solution("parameters").items()}, "parameters"
    ).result()
    lost = {test.id for test in report.tests if "has a type that rcl_interfaces" in test.message}
    assert report.status == GRADED and {"test_defaults", "test_joint_name_is_read_only"} <= lost, report


# Nodes come and go: whoever asks one of them for its services asks too late.
COMING_AND_GOING = """
import itertools, time, rclpy
rclpy.init()
nodes = []
for number in itertools.count():
    time.sleep(0.01)  # for each node, which then lives for most of a second
    nodes.append(rclpy.create_node(f'n{number}', start_parameter_services=False, enable_rosout=False))
    if len(nodes) > 60:
        nodes.pop(0).destroy_node()
"""

# Tells the graph, past rclpy, of a node whose name is not even text.
NO_NAME = r"""
import ctypes, time
import rclpy
from rclpy.serialization import serialize_message
from rmw_dds_common.msg import NodeEntitiesInfo, ParticipantEntitiesInfo

rclpy.init()
node = rclpy.create_node('n')

def library(part):
    return ctypes.CDLL(next(line.split()[-1] for line in open('/proc/self/maps') if '/' + part in line))

class Time(ctypes.Structure):
    _fields_ = [('s', ctypes.c_uint64), ('ns', ctypes.c_uint64)]

class Quality(ctypes.Structure):
    _fields_ = [('history', ctypes.c_int), ('depth', ctypes.c_size_t), ('reliability', ctypes.c_int),
                ('durability', ctypes.c_int), ('deadline', Time), ('lifespan', Time), ('liveliness', ctypes.c_int),
                ('lease', Time), ('plain', ctypes.c_bool)]

class Options(ctypes.Structure):
    _fields_ = [('payload', ctypes.c_void_p), ('unique', ctypes.c_int)]

class Array(ctypes.Structure):
    _fields_ = [('buffer', ctypes.c_char_p), ('length', ctypes.c_size_t), ('capacity', ctypes.c_size_t),
                ('allocator', ctypes.c_void_p * 5)]

rcl, rmw = library('librcl.so'), library('librmw_fastrtps_cpp.so')
kind = getattr(library('librmw_dds_common__rosidl_typesupport_cpp.so'), 'rosidl_typesupport_cpp__get_message_type_'
               'support_handle__rmw_dds_common__msg__ParticipantEntitiesInfo')
kind.restype = rcl.rcl_node_get_rmw_handle.restype = rmw.rmw_create_publisher.restype = ctypes.c_void_p
rcl.rcl_node_get_rmw_handle.argtypes = [ctypes.c_void_p]
rmw.rmw_create_publisher.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p, ctypes.POINTER(Quality),
                                     ctypes.POINTER(Options)]
rmw.rmw_publish_serialized_message.argtypes = [ctypes.c_void_p, ctypes.POINTER(Array), ctypes.c_void_p]
publisher = rmw.rmw_create_publisher(rcl.rcl_node_get_rmw_handle(node.handle.pointer), kind(), b'ros_discovery_info',
                                     Quality(1, 1, 1, 1, Time(), Time(), 1, Time(), True), Options(None, 0))
message = ParticipantEntitiesInfo(node_entities_info_seq=[NodeEntitiesInfo(node_name='aZZZZ', node_namespace='/')])
ends = node.get_publishers_info_by_topic('/rosout')
own = next(list(each.endpoint_gid)[:12] for each in ends if each.node_name == 'n')
message.gid.data = [int(byte) for byte in own + [0, 0, 1, 0xc1]]
data = bytes(serialize_message(message)).replace(b'ZZZZ', b'\xff\xfe\xff\xfe')
while True:
    rmw.rmw_publish_serialized_message(publisher, Array(data, len(data), len(data)), None)
    time.sleep(0.02)
"""

CONSTANT = """
import rclpy
from std_srvs.srv import SetBool, Trigger
rclpy.init()
node = rclpy.create_node('motors')
def answer(request, response):
    response.success, response.message = True, 'disabled'
    return response
node.create_service(SetBool, '/motors/enable', answer)
node.create_service(SetBool, '/motors/emergency_stop', answer)
node.create_service(Trigger, '/motors/status', answer)
rclpy.spin(node)
"""

# Does everything in turn, and looks at nothing.
BLIND = """
import itertools, rclpy
from geometry_msgs.msg import Twist
rclpy.init()
node = rclpy.create_node('blind')
publisher, turn = node.create_publisher(Twist, 'cmd_vel', 10), itertools.count()
from sensor_msgs.msg import LaserScan
node.create_subscription(LaserScan, 'scan', print, 10)
def drive():
    command, step = Twist(), next(turn) // 2 % 3
    command.linear.x, command.angular.z = [(0.3, 0.0), (0.0, 0.5), (0.0, -0.5)][step]
    publisher.publish(command)
node.create_timer(0.1, drive)
rclpy.spin(node)
"""

SAME = """
class WallAgent:
    def decide_action(self, distances):
        return {'linear': 0.3, 'angular': 0.0}
"""

# What it is, the files that are replaced, and the points of the whole exercise that may be left.
LITTLE = {
    "exit status of no signal": ("services", {"motor_service.py": "raise SystemExit(170)"}, 10),
    "nodes that come and go": ("parameters", {"pid_node.py": COMING_AND_GOING}, 0),
    "a name that is no text": ("services", {"motor_service.py": NO_NAME}, 10),
    "constants": ("services", {"motor_service.py": CONSTANT}, 13),
    "a relay that asks without being called": ("services", {"relay.py": None}, 19.5),
    "drives blindly": ("ai_integration", {"wall_agent.py": SAME, "wall_follower.py": BLIND}, 1),
}


# Belong to the matrix: each has a twin in each run, here or among the wrong answers of its exercise.
ALIKE = {*LITTLE} - {"exit status of no signal"}


def polling() -> str:
    """The reference's relay, with a node beside it that asks all the time."""
    return (
        solution("services")["relay.py"]
        .decode()
        .replace(
            "    main()",
            """
    import threading
    from rclpy.executors import SingleThreadedExecutor
    def ask():
        context = rclpy.Context()
        context.init()
        node = rclpy.create_node('asks', context=context)
        executor = SingleThreadedExecutor(context=context)
        client = node.create_client(AddTwoInts, '/add_two_ints')
        def call():
            client.call_async(AddTwoInts.Request(a=1, b=2))
        node.create_timer(0.02, call)
        executor.add_node(node)
        executor.spin()
    threading.Thread(target=ask, daemon=True).start()
    main()""",
        )
    )


def test_a_name_that_is_no_text_loses_what_its_program_is_judged_by_alone(judge):
    """By one hidden test of each program: the matrix has it wait for all that are lost."""
    files = solution("services") | {"motor_service.py": NO_NAME.encode()}
    tests = ("test_motors_start_disabled", "test_relay_sends_parameters")
    verdicts = judge(files, "services", *tests, patience=0.5).result().verdicts
    assert [verdicts[test].outcome == PASSED for test in tests] == [False, True], verdicts


@pytest.fixture(scope="module")
def little(request, grade):
    """The gradings, all begun at once."""
    asked = chosen.values(request, "kind")
    return {
        kind: grade(
            solution(name) | {file: (text or polling()).encode() for file, text in files.items()}, name, patience=0.5
        )
        for kind, (name, files, _) in LITTLE.items()
        if kind in asked
    }


@pytest.mark.parametrize("kind", chosen.cases(LITTLE, ALIKE))
def test_whoever_does_nothing_or_confuses_the_grader_is_graded_and_earns_little(little, kind):
    report = little[kind].result()
    earned = {test.id: test.points for test in report.tests if test.points}
    assert report.status == GRADED and report.score <= LITTLE[kind][2], earned
    if LITTLE[kind][2] == 10:
        assert report.score == 10, "the other program keeps its points"
