"""Answers to the exercise on services."""

from . import changed, solution

MOTORS, RELAY = "motor_service.py", "relay.py"
REFERENCE = solution("services")


def motors(*pairs: tuple[str, str]) -> dict[str, bytes]:
    """The reference with a changed motor service."""
    return changed(REFERENCE, MOTORS, *pairs)


def relay(*pairs: tuple[str, str]) -> dict[str, bytes]:
    """The reference with a changed relay."""
    return changed(REFERENCE, RELAY, *pairs)


FUNCTIONS = """
import rclpy
from std_srvs.srv import SetBool, Trigger

state = {'on': False}

def enable(request, response):
    was, state['on'] = state['on'], request.data
    word = 'ENABLED' if state['on'] else 'DISABLED'
    response.success, response.message = True, f'motors: {word}{" already" if was == state["on"] else ""}'
    return response

def status(request, response):
    print('asked')
    return Trigger.Response(success=True, message='The motors are ' + ['disabled', 'enabled'][state['on']] + '.')

rclpy.init()
node = rclpy.create_node('m')
node.create_service(SetBool, 'motors/enable', enable)
node.create_service(Trigger, 'motors/status', status)
rclpy.spin(node)
"""

TWO_NODES = """
import time
from enum import Enum
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

class State(Enum):
    disabled = 0
    enabled = 1

class Motors:
    state = State.disabled

class Switch(Node):
    def __init__(self, motors, context):
        super().__init__('switch', context=context, namespace='motors')
        self.motors = motors
        self.create_timer(0.02, lambda: self.get_logger().debug('alive'))
        self.create_service(SetBool, 'enable', self.on_request, callback_group=ReentrantCallbackGroup())

    async def on_request(self, request, response):
        self.motors.state = State(int(request.data))
        response.success = True
        response.message = f'{self.motors.state.name} at {time.time()}'
        return response

class Watch(Node):
    def __init__(self, motors, context):
        super().__init__('watch', context=context, namespace='motors')
        self.create_service(Trigger, '~/../status'.replace('~/..', '/motors'), self.on_request)
        self.motors = motors

    def on_request(self, _, response):
        response.message = f'{self.motors.state.name} at {time.time()}'
        response.success = True
        return response

def main(args=None):
    time.sleep(3)
    context = Context()
    rclpy.init(context=context)
    executor = MultiThreadedExecutor(num_threads=4, context=context)
    motors = Motors()
    for kind in (Switch, Watch):
        executor.add_node(kind(motors, context))
    executor.spin()

if __name__ == '__main__':
    main()
"""

# The blocking call, done right: a group for the client, threads enough, one caller after the other.
BLOCKING = """
import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger

class Relay(Node):
    def __init__(self):
        super().__init__('my_relay')
        self.declare_parameters('', [('a', 1), ('b', 2), ('verbose', True)])
        self.adder = self.create_client(AddTwoInts, 'add_two_ints', callback_group=MutuallyExclusiveCallbackGroup())
        self.create_service(Trigger, 'relay', self.on_trigger, callback_group=MutuallyExclusiveCallbackGroup())

    def on_trigger(self, request, response):
        if not self.adder.wait_for_service(timeout_sec=5.0):
            self.get_logger().error('no adder')
            response.message = 'The service add_two_ints is not available.'
            return response
        a, b = (p.value for p in self.get_parameters(['a', 'b']))
        answer = self.adder.call(AddTwoInts.Request(a=a, b=b), timeout_sec=5.0)
        if answer is None:
            response.message = 'no answer'
        else:
            response.success, response.message = True, f'sum={answer.sum:,}'
        return response

def main(args=None):
    rclpy.init(args=args)
    executor = MultiThreadedExecutor(num_threads=2)
    executor.add_node(Relay())
    executor.spin()

main()
"""

# A second node does the calling, spun by the callback itself.
SECOND_NODE = """
import rclpy
from example_interfaces.srv import AddTwoInts
from std_srvs.srv import Trigger
from rclpy.executors import SingleThreadedExecutor

rclpy.init()
node = rclpy.create_node('relay')
helper = rclpy.create_node('relay_helper', use_global_arguments=False)
a = node.declare_parameter('a', 0)
b = node.declare_parameter('b', 0)
executor = SingleThreadedExecutor()
executor.add_node(helper)
client = helper.create_client(AddTwoInts, '/add_two_ints')

def relay(request, response):
    if not client.wait_for_service(1.0):
        response.message = 'no server'
        return response
    request = AddTwoInts.Request()
    request.a = node.get_parameter('a').get_parameter_value().integer_value
    request.b = node.get_parameter('b').get_parameter_value().integer_value
    future = client.call_async(request)
    executor.spin_until_future_complete(future, 5.0)
    response.success = future.done()
    response.message = str(future.result().sum) if future.done() else 'silence'
    return response

node.create_service(Trigger, '/relay', relay)
rclpy.spin(node)
"""

# Parameters kept up to date by a callback; many threads that block.
THREADS = """
import threading
import rclpy
from example_interfaces.srv import AddTwoInts
from rcl_interfaces.msg import SetParametersResult
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger

class Relay(Node):
    def __init__(self):
        super().__init__('relay', namespace='team7')
        self.a = self.declare_parameter('a', 0).value
        self.b = self.declare_parameter('b', 0).value
        self.add_on_set_parameters_callback(self.on_set)
        group = ReentrantCallbackGroup()
        self.client = self.create_client(AddTwoInts, '/add_two_ints', callback_group=group)
        self.service = self.create_service(Trigger, '/relay', self.on_relay, callback_group=group)

    def on_set(self, parameters):
        for parameter in parameters:
            setattr(self, parameter.name, parameter.value)
        return SetParametersResult(successful=True)

    def on_relay(self, request, response):
        print('relaying', self.a, self.b)
        if not self.client.service_is_ready():
            return Trigger.Response(success=False, message='nobody adds')
        done = threading.Event()
        future = self.client.call_async(AddTwoInts.Request(a=self.a, b=self.b))
        future.add_done_callback(lambda _: done.set())
        if not done.wait(9):
            return Trigger.Response(success=False, message='too slow')
        return Trigger.Response(success=True, message=f'{self.a} and {self.b} make {future.result().sum}')

def main(args=None):
    rclpy.init(args=args)
    executor = MultiThreadedExecutor(num_threads=16)
    executor.add_node(Relay())
    try:
        executor.spin()
    except KeyboardInterrupt:
        pass

if __name__ == '__main__':
    main()
"""

RIGHT = {
    "reference": REFERENCE,
    "functions; blocking calls with a group and two threads": {MOTORS: FUNCTIONS.encode(), RELAY: BLOCKING.encode()},
    "two nodes, own context, slow start; a second node for the calls": {
        MOTORS: TWO_NODES.encode(),
        RELAY: SECOND_NODE.encode(),
    },
    "many threads, a parameter callback, a namespace": relay() | {RELAY: THREADS.encode()},
    "relay awaits with two threads": relay(
        ("import ExternalShutdownException", "import ExternalShutdownException, MultiThreadedExecutor"),
        ("rclpy.spin(node)", "rclpy.spin(node, executor=MultiThreadedExecutor(num_threads=2))"),
    ),
    "relay starts 3 s late, logs much and waits a little": relay(
        ("    rclpy.init(args=args)", "    import time\n    time.sleep(3)\n    rclpy.init(args=args)"),
        ("if not self.client.service_is_ready()", "if not self.client.wait_for_service(timeout_sec=1.0)"),
        ("        a, b = ", "        self.get_logger().warning('a call of mine ' * 500)\n        a, b = "),
    ),
    "motors with a property and words of their own": motors(
        ("f'Motors {self.state()}'\n        return", "f'OK; state={self.state().upper()}; errors: 0'\n        return")
    ),
}

READY = """        if not self.client.service_is_ready():
            response.success = False
            response.message = '/add_two_ints is not there'
            return response
"""
SWITCH = "self.enabled = request.data"
COUNT = """self.count = max(0, getattr(self, 'count', 0) + (1 if request.data else -1))
        self.enabled = self.count > 0"""
STATUS = 'Say the state, and leave it alone."""\n        response.success = True'
SAYS = "response.message = f'Motors {self.state()}'\n        return response\n\n    def status"
ASK = "        a, b = self.get_parameter('a').value, self.get_parameter('b').value\n"
GROUP = (", callback_group=group", "")
AWAIT = "await self.client.call_async(AddTwoInts.Request(a=a, b=b))"
SUCCESS = "        response.success = True\n        response.message = f'{a}"
THREADED = [
    ("import ExternalShutdownException", "import ExternalShutdownException, MultiThreadedExecutor"),
    ("rclpy.spin(node)", "rclpy.spin(node, executor=MultiThreadedExecutor(num_threads=4))"),
]
BLOCK = [("async def", "def"), (AWAIT, "self.client.call(AddTwoInts.Request(a=a, b=b))")]

SERVED = {"relay_answers", "relay_asks_each_time", "relay_sends_parameters", "several_callers", "changed_parameters"}
ABSENT = {"without_add_two_ints", "goes_on_afterwards"}
TOLD = {"motors_start_disabled", "enable", "disable"}
MOTOR_TESTS = TOLD | {"enable_says_state", "repeating_is_no_error", "status", "last_command_counts"}

# What is wrong, and the tests that it loses (without "test_").
WRONG = {
    "motors start enabled": (motors(("self.enabled = False", "self.enabled = True")), {"motors_start_disabled"}),
    "enable toggles": (
        motors((SWITCH, "self.enabled = not self.enabled")),
        {"enable_says_state", "repeating_is_no_error", "last_command_counts"},
    ),
    "enable only enables": (
        motors((SWITCH, "self.enabled = self.enabled or request.data")),
        {"disable", "enable_says_state", "last_command_counts"},
    ),
    "enable is inverted": (
        motors((SWITCH, "self.enabled = not request.data")),
        {"enable", "disable", "enable_says_state"},
    ),
    "enable counts": (motors((SWITCH, COUNT)), {"enable_says_state", "repeating_is_no_error", "last_command_counts"}),
    "repeating is an error": (
        motors(
            (SWITCH, "same = self.enabled == request.data\n        " + SWITCH),
            (
                "        response.success = True\n        " + SAYS,
                "        response.success = not same\n        " + SAYS,
            ),
        ),
        {"repeating_is_no_error"},
    ),
    "success is the state": (
        motors(
            (
                "        response.success = True\n        " + SAYS,
                "        response.success = self.enabled\n        " + SAYS,
            )
        ),
        {"disable"},
    ),
    "enable says the state before": (
        motors((SWITCH, "before = self.state()\n        " + SWITCH), (SAYS, SAYS.replace("self.state()", "before"))),
        {"enable_says_state"},
    ),
    "enable says nothing": (
        motors((SAYS, SAYS.replace("response.message = f'Motors {self.state()}'", "pass"))),
        {"enable_says_state"},
    ),
    "status success is the state": (motors((STATUS, STATUS.replace("True", "self.enabled"))), {"status"}),
    "status toggles": (motors((STATUS, STATUS + "\n        self.enabled = not self.enabled")), TOLD | {"status"}),
    "status says on and off": (
        motors(
            (STATUS, STATUS + "\n        response.message = 'on' if self.enabled else 'off'\n        return response")
        ),
        TOLD,
    ),
    "status is of a state of its own": (
        motors((STATUS, STATUS + "\n        response.message = 'Motors disabled'\n        return response")),
        {"enable", "disable", "last_command_counts"},
    ),
    "status under another name": (motors(("'/motors/status'", "'/motor/status'")), MOTOR_TESTS - {"enable_says_state"}),
    "enable returns nothing": (
        motors((SAYS, SAYS.replace("return response", "pass"))),
        MOTOR_TESTS - {"motors_start_disabled"},
    ),
    "relay adds by itself": (
        relay((AWAIT, "AddTwoInts.Response(sum=a + b)")),
        {"relay_answers", "relay_asks_each_time", "relay_sends_parameters", "changed_parameters", "several_callers"},
    ),
    "relay shows its own sum": (relay(("{answer.sum}", "{a + b}")), {"relay_answers"}),
    "relay shows a number without end": (relay(("{answer.sum}", "1e999")), {"relay_answers"}),
    "relay has no success": (
        relay((SUCCESS, SUCCESS.replace("True", "False"))),
        {"relay_answers", "goes_on_afterwards"},
    ),
    "relay has no message": (relay(("response.message = f'{a} + {b} = {answer.sum}'", "pass")), {"relay_answers"}),
    "relay keeps its first answer": (
        relay(
            (
                "        answer = " + AWAIT,
                "        if not hasattr(self, 'answer'):\n            self.answer = "
                + AWAIT
                + "\n        answer = self.answer",
            )
        ),
        {"relay_asks_each_time", "relay_sends_parameters", "changed_parameters", "several_callers"},
    ),
    "relay mixes up a and b": (relay(("(a=a, b=b)", "(a=b, b=a)")), {"relay_sends_parameters"}),
    "relay has numbers of its own": (
        relay((ASK, "        a, b = 5, 3\n")),
        {"relay_sends_parameters", "changed_parameters"},
    ),
    "relay reads its parameters once": (
        relay(
            (ASK, ""),
            ("self.declare_parameter('a', 0)", "self.a = self.declare_parameter('a', 0).value"),
            ("self.declare_parameter('b', 0)", "self.b = self.declare_parameter('b', 0).value"),
            ("(a=a, b=b)", "(a=self.a, b=self.b)"),
            ("{a} + {b} = ", ""),
        ),
        {"changed_parameters"},
    ),
    "relay blocks its one thread": (relay(*BLOCK), SERVED | {"goes_on_afterwards"}),
    "relay blocks each of its threads": (relay(*BLOCK, *THREADED), {"several_callers"}),
    "relay awaits in the default group": (relay(GROUP), SERVED | {"goes_on_afterwards"}),
    "relay spins in its callback": (
        relay(
            ("async def", "def"),
            GROUP,
            (
                "        answer = " + AWAIT,
                "        future = "
                + AWAIT.removeprefix("await ")
                + "\n        rclpy.spin_until_future_complete(self, future)\n"
                "        answer = future.result()",
            ),
        ),
        SERVED | {"goes_on_afterwards"},
    ),
    "relay does not wait for the answer": (
        relay(
            ("async def", "def"),
            ("answer = " + AWAIT, "future = " + AWAIT.removeprefix("await ")),
            ("{answer.sum}", "{future.result()}"),
        ),
        {"relay_answers"},
    ),
    "relay shares one answer": (
        relay(
            (
                "answer = " + AWAIT,
                "self.future = "
                + AWAIT.removeprefix("await ")
                + "\n        await self.future\n        answer = self.future.result()",
            )
        ),
        {"several_callers"},
    ),
    "relay never looks whether there is a server": (relay((READY, "")), ABSENT),
    "relay waits for a server for ever": (
        relay(("if not self.client.service_is_ready()", "if not self.client.wait_for_service()")),
        ABSENT,
    ),
    "relay raises without a server": (
        relay((READY, READY[: READY.index("response")] + "raise RuntimeError('no server')\n")),
        ABSENT,
    ),
    "relay says nothing without a server": (
        relay(("            response.message = '/add_two_ints is not there'\n", "")),
        {"without_add_two_ints"},
    ),
    "relay has success without a server": (
        relay(("response.success = False", "response.success = True")),
        {"without_add_two_ints"},
    ),
    "relay gives up after one failure": (
        relay(("response.success = False", "self.create_timer(0.01, self.destroy_node)")),
        {"goes_on_afterwards"},
    ),
    "relay has another name": (relay(("'/relay'", "'/relais'")), SERVED | ABSENT),
}

SILENT = {
    "status under another name",
    "relay has no success",
    "relay blocks its one thread",
    "relay blocks each of its threads",
    "relay awaits in the default group",
    "relay spins in its callback",
    "relay never looks whether there is a server",
    "relay waits for a server for ever",
    "relay gives up after one failure",
    "relay has another name",
}
