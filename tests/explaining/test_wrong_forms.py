"""Hints on what is used in another form than it has: each mistake is told what to write, and nothing right is."""

import pytest

from course.explaining.failure_report import of_program
from course.explaining.hints import hint

LIFT = """from course_interfaces.action import Lift
class LiftServer(Node):
    def __init__(self):
        ActionServer({given})
    def execute(self, goal_handle):
        if self.is_cancel_requested:
            goal_handle.publish_feedback(self.floor, 2)
"""
SERVER = LIFT.format(given="self, Lift, 'lift', self.execute")
ADD = """from example_interfaces.srv import AddTwoInts
class Adder(Node):
    def __init__(self):
        self.create_service(AddTwoInts, 'add', self.add)
        self.declare_parameter('kp', 1.0)
    def add(self, request, response):
        response.sum = request.a + b + self.a
        self.effort = self.kp * self.b
"""
CLIENT = "class Asker(Node):\n    def __init__(self):\n        self.client = self.create_client(Add, 'add')\n"
HEARS = """from std_msgs.msg import Float64
class Pid(Node):
    def __init__(self):
        self.create_subscription(Float64, 'error', self.hear, 10)
    def hear(self, msg):
        effort = 2 * data
        effort = 3 * error
"""
FOLLOWER = """class Follower(Node):
    def __init__(self):
        self.distances = None
    def laser_callback(self, msg):
        self.distances = {kept}
    def nearest(self, msg):
        return {{}}
def nearest(msg):
    return {{}}
"""
ASKED = "action = self.agent.decide_action(self.distances)"
INDEXED = "TypeError: '{}' object is not subscriptable"
OPTIONS = "parser.add_argument('floors')\nparser.add_argument('--cancel-after', type=int)\n"
AWAITED = "TypeError: object NoneType can't be used in 'await' expression"
STATES = """from enum import Enum
class State(Enum):
    LOOKING = 1
class Agent:
    FAST = 1
    def decide(self):
        self.state = LOOKING
"""
NO_ATTRIBUTE = "AttributeError: '{}' object has no attribute '{}'"
NO_FUTURE = "AttributeError: 'NoneType' object has no attribute 'add_done_callback'"
UNNAMED = "NameError: name '{}' is not defined"


@pytest.mark.parametrize(
    ("error", "text", "code", "says"),
    [
        ("TypeError: '_thread.lock' object is not callable", "", "with self.cabin():", "`with self.cabin:`."),
        ("TypeError: '_thread.lock' object is not callable", "", "self.cabin()", ""),
        (
            "TypeError: 'Lift_Goal' object is not callable",
            SERVER,
            "left = list(goal_handle.request().floors)",
            "`goal_handle.request` is a message, not a function: leave out the brackets after it.",
        ),
        (
            "TypeError: '<' not supported between instances of 'str' and 'float'",
            "def decide(distances):\n    front, right = distances\n    return front < 0.5\n",
            "if front < 0.5:",
            "takes the keys of a dict, which are texts. Its values are `distances['front'], distances['right']`.",
        ),
        (
            "TypeError: 'array.array' object is not callable",
            "",
            "ranges = np.array(scan.ranges(), dtype=float)",
            "`scan.ranges` is an array, not a function: leave out the brackets after it.",
        ),
        (
            "TypeError: ServerGoalHandle.publish_feedback() takes 2 positional arguments but 3 were given",
            SERVER,
            "goal_handle.publish_feedback(self.floor, 2)",
            "with the values in its fields: `Lift.Feedback(floor=..., stops_left=...)`.",
        ),
        (
            "TypeError: ActionServer.__init__() missing 1 required positional argument: 'execute_callback'",
            LIFT.format(given="Lift, 'lift', self.execute"),
            "",
            "The node comes first: `ActionServer(self, Lift, 'lift', self.execute)`.",
        ),
        ("TypeError: ActionServer.__init__() missing 1 required positional argument: 'x'", SERVER, "", ""),
        (
            NO_ATTRIBUTE.format("LiftServer", "is_cancel_requested"),
            SERVER,
            "if self.is_cancel_requested:",
            "belongs to the handle of the goal, not to the node: `goal_handle.is_cancel_requested`.",
        ),
        (NO_ATTRIBUTE.format("LiftServer", "cabin"), SERVER, "if self.cabin:", ""),
        (
            NO_ATTRIBUTE.format("Asker", "call_async"),
            CLIENT,
            "future = self.call_async(request)",
            "a method of the client, not of the node: `self.client.call_async(...)`.",
        ),
        (
            NO_ATTRIBUTE.format("Service", "wait_for_service"),
            "self.client = self.create_service(Add, 'add', self.call)",
            "self.client.wait_for_service()",
            "This is a server: `create_service` in line 1 makes it. A client is made by `create_client`.",
        ),
        (
            "TypeError: 'Client' object is not callable",
            CLIENT,
            "response = await self.client(question)",
            "`self.client` is a client, not a function: `self.client.call_async(request)` sends a request.",
        ),
        (
            "TypeError: 'ActionClient' object is not callable",
            "lift = ActionClient(ros.node, Lift, 'lift')",
            "future = lift(Lift.Goal(floors=[1]))",
            "`lift.send_goal_async(goal)` sends a goal.",
        ),
        ("TypeError: 'Client' object is not callable", CLIENT, "self.other(question)", ""),
        (
            AWAITED,
            CLIENT,
            "answer = await self.client.call_async(question).result()",
            "`await` itself gives the result of a future, which has none when it is new: leave out `.result()`.",
        ),
        (AWAITED, CLIENT, "answer = await self.ask(question)", ""),
        (
            INDEXED.format("function"),
            FOLLOWER.format(kept="nearest"),
            ASKED,
            "Line 5, `self.distances = nearest`, keeps the function itself: call it, `nearest(...)`.",
        ),
        (INDEXED.format("method"), FOLLOWER.format(kept="self.nearest"), ASKED, "call it, `self.nearest(...)`."),
        (INDEXED.format("function"), FOLLOWER.format(kept="nearest(msg)"), ASKED, ""),
        (INDEXED.format("function"), FOLLOWER.format(kept="nearest"), "front = distances['front']", ""),
        (
            INDEXED.format("function"),
            FOLLOWER,
            "front = nearest['front']",
            "`nearest` is a function here: call it, `nearest(...)`.",
        ),
        (
            INDEXED.format("method"),
            f"{FOLLOWER.format(kept='nearest(msg)')}class Other:\n    def seen(self):\n        self.seen = 1\n",
            "front = self.seen['front']",
            "`self.seen = ...` in line 12 replaces the method `seen`: rename one of the two.",
        ),
        (
            NO_ATTRIBUTE.format("Namespace", "cancel"),
            OPTIONS,
            "node = LiftClient(given.cancel-after)",
            "A hyphen subtracts. The value of `--cancel-after` is `given.cancel_after`, with an underscore.",
        ),
        (NO_ATTRIBUTE.format("Namespace", "cancel"), OPTIONS, "node = LiftClient(given.cancel)", ""),
        (NO_ATTRIBUTE.format("Namespace", "cancel"), "", "node = LiftClient(given.cancel-after)", ""),
        (UNNAMED.format("b"), ADD, "response.sum = request.a + b + self.a", "the request: write `request.b`."),
        (UNNAMED.format("c"), ADD, "response.sum = request.a + b + self.a", ""),
        (
            NO_ATTRIBUTE.format("Adder", "a"),
            ADD,
            "response.sum = request.a + b + self.a",
            "a field of the request: write `request.a`.",
        ),
        (
            NO_ATTRIBUTE.format("Adder", "kp"),
            ADD,
            "self.effort = self.kp * self.b",
            "'kp' is a parameter: its value is `self.get_parameter('kp').value`.",
        ),
        (UNNAMED.format("LOOKING"), STATES, "self.state = LOOKING", "a member of State: write `State.LOOKING`."),
        (UNNAMED.format("SLOW"), STATES, "self.state = SLOW", ""),
        (UNNAMED.format("inf"), "import math\nimport numpy as np", "a = inf", "in the module math: write `math.inf`."),
        (UNNAMED.format("inf"), "import numpy as np", "a = inf", "in the module numpy: write `np.inf`."),
        (UNNAMED.format("inf"), "", "a = inf", ""),
        (
            UNNAMED.format("add"),
            "if word == add:\n    pass\nelif word == 'subtract':\n    pass",
            "if word == add:",
            "Text is written in quotation marks: `'add'`.",
        ),
        (UNNAMED.format("add"), "if word == add:\n    pass\nelif word == 2:\n    pass", "if word == add:", ""),
        (
            NO_FUTURE,
            f"{CLIENT}    def send(self):\n        self.client.call_async(1)\nfuture = node.send()\n",
            "print(ros.wait(future).sum)",
            "`send` returns nothing, so `future` is None. End `send` with a `return` of the future.",
        ),
        (
            NO_FUTURE,
            f"{CLIENT}    def send(self):\n        return self.future\nfuture = node.send()\n",
            "ros.wait(future)",
            "and this is None.",
        ),
        ("TypeError: 'LaserScan' object is not subscriptable", "", "distances['front']", "This is a whole message, a"),
        ("TypeError: 'WallAgent' object is not subscriptable", "", "distances['front']", ""),
        (
            "TypeError: Duration.__init__() takes 1 positional argument but 2 were given",
            "",
            "FRESH = Duration(0.5)",
            "`Duration(seconds=0.5)`",
        ),
        (
            "TypeError: '>=' not supported between instances of 'array.array' and 'float'",
            "",
            "measured = (ranges >= scan.range_min)",
            "convert it first, as in `np.array(scan.ranges)`",
        ),
        (
            "TypeError: only integer scalar arrays can be converted to a scalar index",
            "",
            "scan.ranges[usable]",
            "Make one from the list in the message",
        ),
        (
            "TypeError: unsupported operand type(s) for *: 'float' and 'range'",
            "",
            "a * range(3)",
            "to compute with its numbers, write `np.arange(...)`.",
        ),
        (
            "TypeError: 'Calculate_Response' object does not support item assignment",
            "",
            "response['result'] = 1.0",
            "The fields of a message are attributes: write `response.result = ...`",
        ),
        ("NameError: name 'data' is not defined", HEARS, "effort = 2 * data", "of the message: write `msg.data`."),
        ("NameError: name 'error' is not defined", HEARS, "effort = 3 * error", "The value on the topic 'error' is in"),
        ("NameError: name 'effort' is not defined", HEARS, "effort = 3 * error", ""),
        ("NameError: name 'error' is not defined", f"{HEARS}        error = 1\n", "effort = 3 * error", ""),
        (
            "NameError: name 'time' is not defined",
            "from time import monotonic\nnow = time.monotonic()",
            "now = time.monotonic()",
            "`from time import monotonic` imports the name without its module: write `monotonic`, without `time.`.",
        ),
        (
            "NameError: name 'time' is not defined",
            "from time import monotonic\ntime.sleep(1)",
            "time.sleep(1)",
            "`import time` is missing at the beginning.",
        ),
        ("NameError: name 'time' is not defined", "time.seconds", "time.seconds", ""),
        (
            "TypeError: object.__init__() takes exactly one argument (the instance to initialize)",
            "class Follower:\n    def __init__(self):\n        super().__init__('follower')",
            "super().__init__('follower')",
            "write `class Follower(Node):`.",
        ),
    ],
)
def test_what_has_another_form_is_told_only_where_it_is_certain(error, text, code, says):
    told = hint(error, text, code)
    assert told.endswith(says) or says in told
    assert bool(told) == bool(says)


def test_a_part_of_an_action_for_its_type_is_told_when_the_program_has_crashed(tmp_path):
    path = tmp_path / "lift.py"
    path.write_text(LIFT.format(given="\n            self, Lift.Goal, 'lift', self.execute"))
    crash = f'Fatal Python error: Segmentation fault\n\nFile "{path}", line 4 in __init__\n'
    told = str(of_program(path, crash, -11))
    assert "`Lift.Goal` is only the class of a goal. This takes the type of the action: `Lift`." in told


OF_A_FLOAT = "TypeError: 'float' object is not callable"
WHERE = "check where each name gets its value."
MEANT = "If a function is meant, check where it gets its value."


@pytest.mark.parametrize(
    ("code", "told"),
    [
        (
            "return {'linear': 0.3, 'angular': max(-0.5, min(0.5, 1.5(0.6 - right)))}",
            "`1.5` is a float here, not a function. To multiply, write `1.5 * (0.6 - right)`.",
        ),
        (
            "self.integral += (msg.data)(step)",
            f"`msg.data` is a float here, not a function. To multiply, write `msg.data * step`. {MEANT}",
        ),
        (
            "effort = kp(error) + ki * self.integral",
            f"`kp` is a float here, not a function. To multiply, write `kp * error`. {MEANT}",
        ),
        (
            "area = (a + b)(abs(c))",
            f"`a + b` is a float here, not a function. To multiply, write `(a + b) * abs(c)`. {MEANT}",
        ),
        (
            "effort = kp(error) + kd(slope)",
            f"Something that is called in this line is a float, not a function: {WHERE} A product is written with `*`.",
        ),
        ("far = msg.data()", "`msg.data` is a float here, not a function: leave out the brackets after it."),
        ("far = msg.data('m')", "`msg.data` is a float here, not a function: leave out the brackets after it."),
        ("far = nearest(sorted(b))", "`nearest` is a float here, not a function: check where it gets its value."),
        ("far = nearest(a, b)", "`nearest` is a float here, not a function: check where it gets its value."),
    ],
)
def test_a_number_with_a_number_in_brackets_may_be_a_product(code, told):
    assert hint(OF_A_FLOAT, f"def decide(a, b):\n    {code}\n", code) == told
