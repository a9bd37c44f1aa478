"""Answers to the exercise on services."""

from . import SPINS_FOR_TWO_SECONDS, changed, solution

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

state = 'disabled'

def change(request, response, stop):
    global state
    was = state
    if stop:
        state = 'stopped' if request.data else 'disabled' if state == 'stopped' else state
    elif state != 'stopped':
        state = 'enabled' if request.data else 'disabled'
    response.success = stop or not request.data or state == 'enabled'
    response.message = f'motors: {state.upper()}{" already" if was == state else ""}'
    return response

def status(request, response):
    print('asked')
    return Trigger.Response(success=True, message='The motors are ' + state + '.')

rclpy.init()
node = rclpy.create_node('m')
node.create_service(SetBool, 'motors/enable', lambda *each: change(*each, stop=False))
node.create_service(SetBool, 'motors/emergency_stop', lambda *each: change(*each, stop=True))
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
    stopped = 2

class Motors:
    state = State.disabled

class Switch(Node):
    def __init__(self, motors, context):
        super().__init__('switch', context=context, namespace='motors')
        self.motors = motors
        self.create_timer(0.02, lambda: self.get_logger().debug('alive'))
        self.create_service(SetBool, 'enable', self.on_request, callback_group=ReentrantCallbackGroup())

    async def on_request(self, request, response):
        if self.motors.state is State.stopped:
            if request.data:
                return SetBool.Response(message='refused: motors are stopped')
        else:
            self.motors.state = State(int(request.data))
        response.success = True
        response.message = f'{self.motors.state.name} at {time.time()}'
        return response

class Watch(Node):
    def __init__(self, motors, context):
        super().__init__('watch', context=context, namespace='motors')
        self.create_service(Trigger, '~/../status'.replace('~/..', '/motors'), self.on_request)
        self.create_service(SetBool, 'emergency_stop', self.on_stop)
        self.motors = motors

    def on_stop(self, request, response):
        if request.data:
            self.motors.state = State.stopped
        elif self.motors.state is State.stopped:
            self.motors.state = State.disabled
        return self.on_request(request, response)

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

# The table of what each command makes of each state.
TABLE = """
import rclpy
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

NEXT = {
    ('disabled', 'enable', True): 'enabled', ('disabled', 'enable', False): 'disabled',
    ('enabled', 'enable', True): 'enabled', ('enabled', 'enable', False): 'disabled',
    ('stopped', 'enable', True): None, ('stopped', 'enable', False): 'stopped',
    ('disabled', 'emergency_stop', True): 'stopped', ('disabled', 'emergency_stop', False): 'disabled',
    ('enabled', 'emergency_stop', True): 'stopped', ('enabled', 'emergency_stop', False): 'enabled',
    ('stopped', 'emergency_stop', True): 'stopped', ('stopped', 'emergency_stop', False): 'disabled',
}

class Motors(Node):
    state = 'disabled'

    def __init__(self):
        super().__init__('motors_of_the_table')
        for name in ('enable', 'emergency_stop'):
            self.create_service(SetBool, f'/motors/{name}', lambda *each, name=name: self.command(name, *each))
        self.create_service(Trigger, '/motors/status', self.status)

    def command(self, name, request, response):
        new = NEXT[self.state, name, request.data]
        response.success = new is not None
        self.state = new or self.state
        response.message = '' if response.success else 'Not while the emergency stop is on. '
        response.message += f'State: {self.state}'
        return response

    def status(self, request, response):
        response.success, response.message = True, f'State: {self.state}'
        return response

def main():
    rclpy.init()
    rclpy.spin(Motors())

main()
"""

# The blocking call, done right: a reentrant group, and more threads than callers.
BLOCKING = """
import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger

class Relay(Node):
    def __init__(self):
        super().__init__('my_relay')
        self.declare_parameters('', [('a', 1), ('b', 2), ('verbose', True)])
        self.adder = self.create_client(AddTwoInts, 'add_two_ints', callback_group=MutuallyExclusiveCallbackGroup())
        self.create_service(Trigger, 'relay', self.on_trigger, callback_group=ReentrantCallbackGroup())

    def on_trigger(self, request, response):
        if not self.adder.wait_for_service(timeout_sec=1.0):
            self.get_logger().error('no adder')
            response.message = 'The service add_two_ints is not available.'
            return response
        a, b = (p.value for p in self.get_parameters(['a', 'b']))
        answer = self.adder.call(AddTwoInts.Request(a=a, b=b), timeout_sec=10.0)
        if answer is None:
            response.message = 'no answer'
        else:
            response.success, response.message = True, f'sum={answer.sum:,}'
        return response

def main(args=None):
    rclpy.init(args=args)
    executor = MultiThreadedExecutor(num_threads=9)
    executor.add_node(Relay())
    executor.spin()

main()
"""

# A node of its own for each call, which the callback spins in an executor of its own; threads enough for it.
HELPERS = """
import itertools
import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node('relay')
node.declare_parameter('a', 0)
node.declare_parameter('b', 0)
number = itertools.count()

def relay(request, response):
    helper = rclpy.create_node(f'relay_helper_{next(number)}', use_global_arguments=False)
    executor = SingleThreadedExecutor()
    executor.add_node(helper)
    client = helper.create_client(AddTwoInts, '/add_two_ints')
    if not client.wait_for_service(2.0):
        response.message = 'no server'
    else:
        request = AddTwoInts.Request()
        request.a = node.get_parameter('a').get_parameter_value().integer_value
        request.b = node.get_parameter('b').get_parameter_value().integer_value
        future = client.call_async(request)
        executor.spin_until_future_complete(future, 8.0)
        response.success = future.done()
        response.message = str(future.result().sum) if future.done() else 'silence'
    executor.shutdown()
    helper.destroy_node()
    return response

node.create_service(Trigger, '/relay', relay, callback_group=ReentrantCallbackGroup())
executor = MultiThreadedExecutor(num_threads=9)
executor.add_node(node)
executor.spin()
"""

# One helper node and one thread: while a call waits, nothing else runs.
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
    if not client.wait_for_service(0.5):
        response.message = 'no server'
        return response
    request = AddTwoInts.Request()
    request.a = node.get_parameter('a').get_parameter_value().integer_value
    request.b = node.get_parameter('b').get_parameter_value().integer_value
    future = client.call_async(request)
    executor.spin_until_future_complete(future, 8.0)
    response.success = future.done()
    response.message = str(future.result().sum) if future.done() else 'silence'
    return response

node.create_service(Trigger, '/relay', relay)
rclpy.spin(node)
"""

# Answers later, by a done callback that sets a future of its own, which the service's callback awaits.
FUTURES = """
import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

class Relay(Node):
    def __init__(self):
        super().__init__('relay')
        self.declare_parameter('a', 0)
        self.declare_parameter('b', 0)
        self.adder = self.create_client(AddTwoInts, '/add_two_ints', callback_group=MutuallyExclusiveCallbackGroup())
        self.srv = self.create_service(Trigger, '/relay', self.on_call, callback_group=ReentrantCallbackGroup())

    async def on_call(self, request, response):
        if not self.adder.service_is_ready():
            return Trigger.Response(message='add_two_ints is down')
        text = Future()
        question = AddTwoInts.Request()
        question.a, question.b = [self.get_parameter(name).value for name in 'ab']
        self.adder.call_async(question).add_done_callback(lambda done: text.set_result(f'{done.result().sum}'))
        return Trigger.Response(success=True, message=await text)

def main(args=None):
    rclpy.init(args=args)
    node = Relay()
    while rclpy.ok():
        rclpy.spin_once(node)

if __name__ == '__main__':
    main()
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

# Flags in a bit mask, one callback for both commands, words in a sentence.
FLAGS = """
import enum
import functools
import rclpy
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

class Flag(enum.Flag):
    NONE = 0
    ON = enum.auto()
    STOP = enum.auto()

class Motors(Node):
    def __init__(self):
        super().__init__('flags', namespace='robot')
        self.flags = Flag.NONE
        for name, flag in (('enable', Flag.ON), ('emergency_stop', Flag.STOP)):
            self.create_service(SetBool, '/motors/' + name, functools.partial(self.on_set, flag))
        self.create_service(Trigger, '/motors/status', self.on_status)

    def on_set(self, flag, request, response):
        before = self.flags
        self.flags = before | flag if request.data else before & ~flag
        if Flag.STOP in before and flag is Flag.ON:
            self.flags = before
            response.success = not request.data
        elif flag is Flag.STOP and Flag.STOP in (before | self.flags):
            self.flags &= ~Flag.ON
            response.success = True
        else:
            response.success = True
        response.message = self.sentence()
        return response

    def on_status(self, _, response):
        return Trigger.Response(success=True, message=self.sentence())

    def sentence(self):
        return {Flag.NONE: 'They are disabled.', Flag.ON: 'They are enabled.'}.get(self.flags, 'They are stopped!')

def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=3)
    executor.add_node(Motors())
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass

main()
"""

# One service on its own node for each state change, three nodes in one executor; logs a lot.
THREE_NODES = """
import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import SetBool, Trigger

memory = {'wanted': False, 'halt': False}

def word():
    return 'stopped' if memory['halt'] else ('disabled', 'enabled')[memory['wanted']]

def enable(request, response):
    if memory['halt'] and request.data:
        return SetBool.Response(success=False, message=f'no: {word()}')
    memory['wanted'] = request.data and not memory['halt']
    return SetBool.Response(success=True, message=f'ok: {word()}')

def halt(request, response):
    if request.data or memory['halt']:
        memory['wanted'] = False
    memory['halt'] = request.data
    return SetBool.Response(success=True, message=f'ok: {word()}')

def status(request, response):
    response.success, response.message = True, word()
    return response

rclpy.init()
executor = SingleThreadedExecutor()
callbacks = ((SetBool, 'enable', enable), (SetBool, 'emergency_stop', halt), (Trigger, 'status', status))
for kind, name, callback in callbacks:
    node = rclpy.create_node('motors_' + name)
    node.create_service(kind, f'/motors/{name}', callback)
    executor.add_node(node)
executor.spin()
"""

# A timer looks for answers: the service's callback awaits a future that the timer's callback sets.
POLLING = """
import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

class Relay(Node):
    def __init__(self):
        super().__init__('polling')
        self.a, self.b = (self.declare_parameter(name, 0) for name in 'ab')
        self.waiting = []
        self.adder = self.create_client(AddTwoInts, '/add_two_ints', callback_group=MutuallyExclusiveCallbackGroup())
        self.create_timer(0.01, self.look, callback_group=MutuallyExclusiveCallbackGroup())
        self.create_service(Trigger, '/relay', self.on_call, callback_group=ReentrantCallbackGroup())

    def look(self):
        for asked, told in list(self.waiting):
            if asked.done():
                self.waiting.remove((asked, told))
                told.set_result(asked.result())

    async def on_call(self, request, response):
        if not self.adder.service_is_ready():
            response.message = 'I cannot find /add_two_ints'
            return response
        a, b = (self.get_parameter(name).value for name in 'ab')
        told = Future()
        self.waiting.append((self.adder.call_async(AddTwoInts.Request(a=a, b=b)), told))
        answer = await told
        response.success = True
        response.message = f'the sum is {answer.sum:d}.'
        return response

def main():
    rclpy.init()
    rclpy.spin(Relay())

if __name__ == '__main__':
    main()
"""

# A thread of its own for the client: another node, spun all the time; the callbacks wait for an event.
CLIENT_NODE = """
import threading
import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from std_srvs.srv import Trigger

rclpy.init()
asker = rclpy.create_node('asker', use_global_arguments=False)
client = asker.create_client(AddTwoInts, '/add_two_ints')
background = SingleThreadedExecutor()
background.add_node(asker)
threading.Thread(target=background.spin, daemon=True).start()

node = rclpy.create_node('relay')
node.declare_parameters('', [('a', 0), ('b', 0)])

def on_relay(request, response):
    if not client.wait_for_service(timeout_sec=2.0):
        response.message = 'nobody offers /add_two_ints'
        return response
    question = AddTwoInts.Request(**{name: node.get_parameter(name).value for name in ('a', 'b')})
    answer = client.call(question, timeout_sec=9.0)
    response.success = answer is not None
    response.message = f'{answer.sum}' if answer else 'no answer'
    return response

node.create_service(Trigger, '/relay', on_relay, callback_group=ReentrantCallbackGroup())
executor = MultiThreadedExecutor(num_threads=8)
executor.add_node(node)
executor.spin()
"""

RIGHT = {
    "reference": REFERENCE,
    "functions; blocking calls with more threads than callers": {MOTORS: FUNCTIONS.encode(), RELAY: BLOCKING.encode()},
    "two nodes, own context, slow start; a node for each call": {MOTORS: TWO_NODES.encode(), RELAY: HELPERS.encode()},
    "many threads, a parameter callback, a namespace": relay() | {RELAY: THREADS.encode()},
    "a table of states; a future of its own": {MOTORS: TABLE.encode(), RELAY: FUTURES.encode()},
    "relay awaits with two threads": relay(
        ("import ExternalShutdownException", "import ExternalShutdownException, MultiThreadedExecutor"),
        ("rclpy.spin(node)", "rclpy.spin(node, executor=MultiThreadedExecutor(num_threads=2))"),
    ),
    "relay starts 3 s late, logs much and waits a little": relay(
        ("    rclpy.init(args=args)", "    import time\n    time.sleep(3)\n    rclpy.init(args=args)"),
        ("if not self.client.service_is_ready()", "if not self.client.wait_for_service(timeout_sec=0.5)"),
        ("        a, b = ", "        self.get_logger().warning('a call of mine ' * 500)\n        a, b = "),
    ),
    "motors with words of their own": motors(
        ("f'Motors {self.state()}'\n        return", "f'OK; state={self.state().upper()}; errors: 0'\n        return")
    ),
}

RIGHT |= {
    "flags and one callback; a timer that looks for answers": {MOTORS: FLAGS.encode(), RELAY: POLLING.encode()},
    "three nodes and a dictionary; a node that is spun in a thread": {
        MOTORS: THREE_NODES.encode(),
        RELAY: CLIENT_NODE.encode(),
    },
    "table of states; blocking calls": {MOTORS: TABLE.encode(), RELAY: BLOCKING.encode()},
}

READY = """        if not self.client.service_is_ready():
            response.success = False
            response.message = '/add_two_ints is not there'
            return response
"""
SWITCH = "self.enabled = request.data and response.success"
COUNT = """self.count = max(0, getattr(self, 'count', 0) + (1 if request.data else -1))
        self.enabled = self.count > 0 and not self.stopped"""
REFUSE = "response.success = not (request.data and self.stopped)"
STATUS = 'Say the state, and leave it alone."""\n        response.success = True'
ENABLE_SAYS = "response.message = f'Motors {self.state()}'\n        return response\n\n    def emergency_stop"
SAYS = "response.success = True\n        response.message = f'Motors {self.state()}'\n        return response\n\n"
STOP_SAYS = SAYS + "    def status"
STOPS = """        self.stopped = request.data
        if self.stopped:
            self.enabled = False
"""
RESET = (STOPS, STOPS + "            self.count = 0\n")
ASK = "        a, b = self.get_parameter('a').value, self.get_parameter('b').value\n"
GROUP = (", callback_group=group", "")
AWAIT = "await self.client.call_async(AddTwoInts.Request(a=a, b=b))"
SUCCESS = "        response.success = True\n        response.message = f'{a}"
THREADED = [
    ("import ExternalShutdownException", "import ExternalShutdownException, MultiThreadedExecutor"),
    ("rclpy.spin(node)", "rclpy.spin(node, executor=MultiThreadedExecutor(num_threads=4))"),
]
BLOCK = [("async def", "def"), (AWAIT, "self.client.call(AddTwoInts.Request(a=a, b=b))")]

ONE_BY_ONE = {"no_caller_waits_for_another"}
ALONE = ONE_BY_ONE | {"goes_on_serving"}
SERVED = ALONE | {
    "relay_answers",
    "relay_asks_each_time",
    "relay_sends_parameters",
    "several_callers",
    "changed_parameters",
    "slow_answer",
}
UNTOLD = {"relay_answers", "relay_sends_parameters", "changed_parameters", "several_callers", "slow_answer"}
ABSENT = {"without_add_two_ints", "goes_on_afterwards"}
STOP_TESTS = {"emergency_stop", "stays_still", "success"}
MOTOR_TESTS = STOP_TESTS | {
    "motors_start_disabled",
    "enable_and_disable",
    "messages_say_state",
    "status",
    "repeating_changes_nothing",
    "last_command_counts",
}

# The page's own classes, with the names that the task gives them: what copying earns.
CAMERA = """
import rclpy
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

class Camera(Node):
    def __init__(self):
        super().__init__('camera')
        self.on, self.pictures = False, 0
        self.create_service(SetBool, '/motors/enable', self.power)
        self.create_service(Trigger, '/motors/status', self.snapshot)

    def power(self, request, response):
        self.on = request.data
        response.success = True
        response.message = f"motors are {'enabled' if self.on else 'disabled'}"
        return response

    def snapshot(self, request, response):
        response.success = True
        response.message = f"motors are {'enabled' if self.on else 'disabled'}"
        return response

rclpy.init()
rclpy.spin(Camera())
"""
AWAITING_DOUBLER = """
import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from std_srvs.srv import Trigger

class AwaitingDoubler(Node):
    def __init__(self, group=None):
        super().__init__('relay')
        self.declare_parameter('a', 0)
        self.declare_parameter('b', 0)
        self.client = self.create_client(AddTwoInts, 'add_two_ints', callback_group=group)
        self.create_service(Trigger, 'relay', self.double_sum)

    async def double_sum(self, request, response):
        a, b = self.get_parameter('a').value, self.get_parameter('b').value
        answer = await self.client.call_async(AddTwoInts.Request(a=a, b=b))
        response.success = True
        response.message = str(answer.sum)
        return response

rclpy.init()
rclpy.spin(AwaitingDoubler(MutuallyExclusiveCallbackGroup()))
"""


def spins(how: str, *more: tuple[str, str]) -> dict[str, bytes]:
    """The relay that waits for its future by spinning in the callback."""
    return relay(
        ("async def", "def"),
        (
            "        answer = " + AWAIT,
            f"        future = {AWAIT.removeprefix('await ')}\n        {how}\n        answer = future.result()",
        ),
        *more,
    )


NODE_SPINS = "rclpy.spin_until_future_complete(self, future)"
EXECUTOR_SPINS = "self.executor.spin_until_future_complete(future)"
HELPER = """import threading
        if not hasattr(self, 'helper'):
            from rclpy.executors import SingleThreadedExecutor
            self.helper = SingleThreadedExecutor()
        rclpy.spin_until_future_complete(self, future, self.helper)"""

# What is lost by a relay that answers before /add_two_ints has.
TOO_EARLY = UNTOLD | ALONE

# What is wrong, and the tests that it loses (without "test_").
WRONG = {
    "the page's camera and doubler, with the task's names": (
        {MOTORS: CAMERA.encode(), RELAY: AWAITING_DOUBLER.encode()},
        STOP_TESTS | ALONE | ABSENT,
    ),
    "motors start enabled": (
        motors(
            ("self.enabled = False\n        self.stopped = False", "self.enabled = True\n        self.stopped = False")
        ),
        {"motors_start_disabled"},
    ),
    "motors start stopped": (motors(("self.stopped = False", "self.stopped = True")), {"motors_start_disabled"}),
    "enable toggles": (
        motors((SWITCH, "self.enabled = not self.enabled and not self.stopped")),
        {"repeating_changes_nothing"},
    ),
    "enable only enables": (
        motors((SWITCH, "self.enabled = (self.enabled or request.data) and not self.stopped")),
        {"enable_and_disable"},
    ),
    "enable is inverted": (
        motors((SWITCH, "self.enabled = not request.data and response.success")),
        {"enable_and_disable", "repeating_changes_nothing", "stays_still"},
    ),
    "enable counts": (motors((SWITCH, COUNT), RESET), {"last_command_counts"}),
    "repeating is an error": (
        motors(
            (REFUSE, "was = self.enabled\n        " + REFUSE),
            (ENABLE_SAYS, "response.success = response.success and was != request.data\n        " + ENABLE_SAYS),
        ),
        {"success"},
    ),
    "enables with success 30 times": (
        motors(
            (
                ENABLE_SAYS,
                (
                    "self.count = getattr(self, 'count', 0) + 1\n"
                    "        response.success = response.success and self.count <= 30\n"
                    "        " + ENABLE_SAYS
                ),
            )
        ),
        {"success"},
    ),
    "success of enable is the state": (
        motors((ENABLE_SAYS, "response.success = self.enabled\n        " + ENABLE_SAYS)),
        {"success"},
    ),
    "success is always True": (motors((ENABLE_SAYS, "response.success = True\n        " + ENABLE_SAYS)), {"success"}),
    "success is never set": (motors((ENABLE_SAYS, "response.success = False\n        " + ENABLE_SAYS)), {"success"}),
    "enable says the state before": (
        motors(
            (REFUSE, "before = self.state()\n        " + REFUSE),
            (ENABLE_SAYS, ENABLE_SAYS.replace("self.state()", "before")),
        ),
        {"messages_say_state"},
    ),
    "enable says nothing": (
        motors((ENABLE_SAYS, ENABLE_SAYS.replace("response.message = f'Motors {self.state()}'", "pass"))),
        {"messages_say_state"},
    ),
    "a refusal says why, and not the state": (
        motors(
            (
                ENABLE_SAYS,
                ENABLE_SAYS.replace(
                    "f'Motors {self.state()}'", "f'Motors {self.state()}' if response.success else 'emergency stop'"
                ),
            )
        ),
        {"messages_say_state"},
    ),
    "a refusal names two states": (
        motors(
            (
                ENABLE_SAYS,
                ENABLE_SAYS.replace(
                    "f'Motors {self.state()}'",
                    "f'Motors {self.state()}' if response.success else 'stopped: cannot be enabled'",
                ),
            )
        ),
        {"messages_say_state"},
    ),
    "status success is the state": (motors((STATUS, STATUS.replace("True", "self.enabled"))), {"success"}),
    "status toggles": (
        motors((STATUS, STATUS + "\n        self.enabled = not self.enabled and not self.stopped")),
        {"motors_start_disabled", "status"},
    ),
    "status says on and off": (
        motors(
            (
                STATUS,
                STATUS + "\n        response.message = {'enabled': 'on', 'disabled': 'off', 'stopped': 'halt'}"
                "[self.state()]\n        return response",
            )
        ),
        {"messages_say_state"},
    ),
    "status is of a state of its own": (
        motors((STATUS, STATUS + "\n        response.message = 'Motors disabled'\n        return response")),
        {"status"},
    ),
    "status under another name": (motors(("'/motors/status'", "'/motor/status'")), {"motors_start_disabled", "status"}),
    "enable returns nothing": (
        motors((ENABLE_SAYS, ENABLE_SAYS.replace("return response", "pass"))),
        {"enable_and_disable", "last_command_counts", "stays_still", "success"},
    ),
    "no emergency stop": (
        motors(("        self.create_service(SetBool, '/motors/emergency_stop', self.emergency_stop)\n", "")),
        {"emergency_stop", "stays_still", "success"},
    ),
    "the stop only disables": (
        motors((STOPS, "        self.enabled = False\n")),
        {"emergency_stop", "repeating_changes_nothing", "stays_still", "success"},
    ),
    "the stop is not latched": (
        motors((REFUSE, "response.success = True\n        self.stopped = False")),
        {"repeating_changes_nothing", "stays_still", "success"},
    ),
    "the end of a stop enables again": (motors((STOPS, "        self.stopped = request.data\n")), {"stays_still"}),
    "the motors start by themselves a second after the stop has ended": (
        motors(
            (STOPS, STOPS + "        self.ended = None if request.data else self.get_clock().now()\n"),
            (
                "        self.stopped = False\n        self.create_service(",
                """        self.stopped, self.ended = False, None
        self.create_timer(0.2, self.start_again)
        self.create_service(""",
            ),
            (
                "    def enable(self",
                """    def start_again(self):
        if self.ended and (self.get_clock().now() - self.ended).nanoseconds > 1e9:
            self.enabled, self.ended = True, None

    def enable(self""",
            ),
            (SWITCH, f"{SWITCH}\n        self.ended = None"),
            (STATUS, f"{STATUS}\n        self.ended = None"),
        ),
        {"stays_still"},
    ),
    "motors hang instead of refusing": (
        motors(
            (REFUSE, "while request.data and self.stopped:\n            time.sleep(1.0)\n        " + REFUSE),
            ("import rclpy\n", "import time\n\nimport rclpy\n"),
        ),
        {"repeating_changes_nothing", "stays_still", "success"},
    ),
    "motors end instead of refusing": (
        motors((REFUSE, "if request.data and self.stopped:\n            raise SystemExit\n        " + REFUSE)),
        {"repeating_changes_nothing", "stays_still", "success"},
    ),
    "motors hang when there is no stop to end": (
        motors(
            (STOPS, "        while not (request.data or self.stopped):\n            time.sleep(1.0)\n" + STOPS),
            ("import rclpy\n", "import time\n\nimport rclpy\n"),
        ),
        {"repeating_changes_nothing", "stays_still", "success"},
    ),
    "a refused enable is remembered": (motors((SWITCH, "self.enabled = request.data")), {"stays_still"}),
    "the end of a stop that is not on disables": (
        motors((STOPS, "        self.stopped = request.data\n        self.enabled = False\n")),
        {"repeating_changes_nothing"},
    ),
    "the stop toggles": (
        motors(
            (
                STOPS,
                "        self.stopped = not self.stopped\n        self.enabled = self.enabled and not self.stopped\n",
            )
        ),
        {"repeating_changes_nothing", "stays_still"},
    ),
    "disabling ends the stop": (
        motors((SWITCH, SWITCH + "\n        self.stopped = self.stopped and request.data")),
        {"repeating_changes_nothing", "stays_still"},
    ),
    "disabling a stopped motor is refused": (motors((REFUSE, "response.success = not self.stopped")), {"success"}),
    "a second stop is an error": (
        motors(
            (STOPS, "        again = self.stopped and request.data\n" + STOPS),
            (STOP_SAYS, STOP_SAYS.replace("True", "not again")),
        ),
        {"success"},
    ),
    "the stop says nothing": (
        motors((STOP_SAYS, STOP_SAYS.replace("response.message = f'Motors {self.state()}'", "pass"))),
        {"messages_say_state"},
    ),
    "success only when nothing changes": (
        motors(
            (REFUSE, "was = self.enabled\n        " + REFUSE),
            (ENABLE_SAYS, "response.success = response.success and was == self.enabled\n        " + ENABLE_SAYS),
        ),
        {"success"},
    ),
    "no success when motors are switched off": (
        motors(
            (REFUSE, "was = self.enabled\n        " + REFUSE),
            (
                ENABLE_SAYS,
                "response.success = response.success and not (was and not request.data)\n        " + ENABLE_SAYS,
            ),
        ),
        {"success"},
    ),
    "enable says disabled for stopped motors": (
        motors((ENABLE_SAYS, ENABLE_SAYS.replace("{self.state()}", '{self.state() if request.data else "disabled"}'))),
        {"messages_say_state"},
    ),
    "the end of a stop always says disabled": (
        motors((STOP_SAYS, STOP_SAYS.replace("{self.state()}", '{self.state() if request.data else "disabled"}'))),
        {"messages_say_state"},
    ),
    "the beginning of a stop says nothing": (
        motors((STOP_SAYS, STOP_SAYS.replace("{self.state()}", '{"" if request.data else self.state()}'))),
        {"messages_say_state"},
    ),
    "only enabled motors can be stopped": (
        motors((STOPS, STOPS.replace("= request.data", "= request.data and (self.enabled or self.stopped)"))),
        {"emergency_stop", "stays_still", "success"},
    ),
    "stops are counted": (
        motors(
            (
                STOPS,
                (
                    "        self.stops = max(0, getattr(self, 'stops', 0) + (1 if request.data else -1))\n"
                    "        self.stopped = self.stops > 0\n"
                    "        if self.stopped:\n            self.enabled = False\n"
                ),
            )
        ),
        {"repeating_changes_nothing"},
    ),
    "status has no success when stopped": (motors((STATUS, STATUS.replace("True", "not self.stopped"))), {"success"}),
    "status and the end of a stop have the success of the latest enable": (
        motors(
            ("        self.stopped = False\n", "        self.stopped = False\n        self.ok = True\n"),
            ("and response.success\n", "and response.success\n        self.ok = response.success\n"),
            ("response.success = True", "response.success = self.ok"),
        ),
        {"success"},
    ),
    "the end of a stop has the success of the latest enable": (
        motors(
            ("        self.stopped = False\n", "        self.stopped = False\n        self.ok = True\n"),
            ("and response.success\n", "and response.success\n        self.ok = response.success\n"),
            (
                "        response.success = True\n",
                "        response.success = self.ok or not hasattr(request, 'data')\n",
            ),
        ),
        {"success"},
    ),
    "the second refused enable ends the stop": (
        motors(
            ("        self.stopped = False\n", "        self.stopped = False\n        self.asked = 0\n"),
            ("self.stopped = request.data\n", "self.stopped = request.data\n        self.asked = 0\n"),
            (
                "and response.success\n",
                """and response.success
        self.asked += not response.success
        self.stopped = self.stopped and self.asked < 2
""",
            ),
        ),
        {"stays_still"},
    ),
    "status names two states": (
        motors(
            (
                STATUS,
                STATUS
                + "\n        response.message = f'{self.state()} (not stopped or disabled)'\n        return response",
            )
        ),
        {"messages_say_state"},
    ),
    "disabling is counted": (
        motors(
            (
                SWITCH,
                (
                    "count = getattr(self, 'count', 0)\n"
                    "        count = count if self.enabled or count < 0 else 0\n"
                    "        self.count = count if self.stopped else count + (1 if request.data else -1)\n"
                    "        self.enabled = self.count > 0 and not self.stopped"
                ),
            ),
            RESET,
        ),
        {"last_command_counts"},
    ),
    "relay adds by itself": (relay((AWAIT, "AddTwoInts.Response(sum=a + b)")), SERVED | {"goes_on_afterwards"}),
    "relay shows its own sum": (relay(("{answer.sum}", "{a + b}")), UNTOLD),
    "relay shows a number without end": (relay(("{answer.sum}", "1e999")), UNTOLD),
    "relay shows 1 more than the sum": (relay(("{answer.sum}", "{answer.sum + 1}")), UNTOLD),
    "relay says the same each time": (relay(("f'{a} + {b} = {answer.sum}'", "'done'")), UNTOLD),
    "relay shows the sum of the call before": (
        relay(
            (
                "        response.message = f'{a} + {b} = {answer.sum}'\n",
                "        response.message, self.before = str(getattr(self, 'before', answer.sum)), answer.sum\n",
            )
        ),
        UNTOLD | ONE_BY_ONE,
    ),
    "relay has no success": (
        relay((SUCCESS, SUCCESS.replace("True", "False"))),
        {"relay_answers", "goes_on_afterwards"},
    ),
    "relay has no message": (relay(("response.message = f'{a} + {b} = {answer.sum}'", "pass")), UNTOLD),
    "relay keeps its first answer": (
        relay(
            (
                "        answer = " + AWAIT,
                "        if not hasattr(self, 'answer'):\n            self.answer = "
                + AWAIT
                + "\n        answer = self.answer",
            )
        ),
        SERVED - {"relay_answers", "relay_sends_parameters", "changed_parameters"},
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
    "relay blocks each of its threads": (relay(*BLOCK, *THREADED), {"several_callers", "goes_on_serving"}),
    "relay awaits in the default group": (relay(GROUP), SERVED | {"goes_on_afterwards"}),
    "relay awaits, only the client in a group of its own": (
        relay(("self.relay, callback_group=group", "self.relay")),
        ALONE,
    ),
    "relay awaits in a mutually exclusive group of its own": (
        relay(
            ("self.relay, callback_group=group", "self.relay, callback_group=MutuallyExclusiveCallbackGroup()"),
            ("import ReentrantCallbackGroup", "import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup"),
        ),
        ONE_BY_ONE,
    ),
    "relay takes turns with a lock": (
        {
            **REFERENCE,
            RELAY: BLOCKING.replace("ReentrantCallbackGroup())", "MutuallyExclusiveCallbackGroup())")
            .replace("timeout_sec=1.0", "timeout_sec=0.5")
            .encode(),
        },
        ONE_BY_ONE,
    ),
    "relay spins in its callback, all in the default group": (
        spins(NODE_SPINS, GROUP),
        SERVED | {"goes_on_afterwards"},
    ),
    "relay spins in its callback": (spins(NODE_SPINS), ONE_BY_ONE),
    "relay spins its executor in its callback": (spins(EXECUTOR_SPINS), ONE_BY_ONE),
    "relay spins once and again in its callback": (
        spins("while not future.done():\n            rclpy.spin_once(self)"),
        ONE_BY_ONE,
    ),
    "relay spins in its callback, only the client in a group": (
        spins(NODE_SPINS, ("self.relay, callback_group=group", "self.relay")),
        ALONE,
    ),
    "relay spins in its callback, many threads": (spins(NODE_SPINS, *THREADED), SERVED - {"relay_answers"}),
    "relay spins itself in another executor": (spins(HELPER), SERVED - {"relay_answers"}),
    "relay spins a second node, with one thread": ({**REFERENCE, RELAY: SECOND_NODE.encode()}, ALONE),
    "relay does not wait for the answer": (
        relay(
            ("async def", "def"),
            ("answer = " + AWAIT, "future = " + AWAIT.removeprefix("await ")),
            ("{answer.sum}", "{future.result()}"),
        ),
        TOO_EARLY,
    ),
    "relay computes the sum, and asks beside that": (
        relay(("async def", "def"), ("answer = " + AWAIT, AWAIT.removeprefix("await ")), ("{answer.sum}", "{a + b}")),
        TOO_EARLY,
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
        {"several_callers", "no_caller_waits_for_another"},
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
    "relay waits 10 s for a server when it has just started": (
        relay(
            (
                "        self.get_logger().info('Relay ready')\n",
                "        self.client.wait_for_service(timeout_sec=10.0)\n",
            )
        ),
        {"without_add_two_ints"},
    ),
    "relay has success without a server": (
        relay(("response.success = False", "response.success = True")),
        {"without_add_two_ints"},
    ),
    "relay gives up after one failure": (
        relay(("response.success = False", "self.executor.create_task(self.destroy_node)")),
        ABSENT,
    ),
    "relay takes a sum of 0 for no answer": (
        relay((SUCCESS, SUCCESS.replace("True", "bool(answer.sum)"))),
        {"relay_answers"},
    ),
    "relay shows the sum without its sign": (relay(("{answer.sum}", "{abs(answer.sum)}")), {"relay_answers"}),
    "relay asks twice, and calls its server unavailable at first": (
        relay(
            (
                "if not self.client.service_is_ready():",
                (
                    "self.calls = getattr(self, 'calls', 0) + self.client.service_is_ready()\n"
                    "        if self.calls < 12 or not self.client.service_is_ready():"
                ),
            ),
            (
                "        answer = " + AWAIT,
                "        await self.client.call_async(AddTwoInts.Request(a=a, b=b))\n        answer = " + AWAIT,
            ),
        ),
        {"relay_asks_each_time"},
    ),
    "relay asks twice": (
        relay(
            (
                "        answer = " + AWAIT,
                "        await self.client.call_async(AddTwoInts.Request(a=a, b=b))\n        answer = " + AWAIT,
            )
        ),
        {"relay_asks_each_time"},
    ),
    "parameters that are set while a call waits are not used": (
        relay(
            (
                "        self.get_logger().info('Relay ready')",
                (
                    "        self.waiting = 0\n"
                    "        self.take([])\n"
                    "        self.add_post_set_parameters_callback(self.take)\n\n"
                    "    def take(self, parameters):\n"
                    "        if not self.waiting:\n"
                    "            self.used = self.get_parameter('a').value, self.get_parameter('b').value"
                ),
            ),
            (ASK, "        a, b = self.used\n"),
            (
                "        answer = " + AWAIT,
                "        self.waiting += 1\n        answer = " + AWAIT + "\n        self.waiting -= 1",
            ),
        ),
        {"goes_on_serving"},
    ),
    "a call that waits while a parameter is set is answered without the sum": (
        relay(
            (
                "        response.message = f'{a} + {b} = {answer.sum}'",
                (
                    "        same = (a, b) == (self.get_parameter('a').value, self.get_parameter('b').value)\n"
                    "        response.message = f'{a} + {b} = {answer.sum}' if same else 'changed meanwhile'"
                ),
            )
        ),
        {"goes_on_serving"},
    ),
    "a third disable ends the stop": (
        motors(
            (
                "        response.success = not (request.data and self.stopped)",
                (
                    "        self.count = getattr(self, 'count', 0) + 1 if self.stopped and not request.data else 0\n"
                    "        self.stopped = self.stopped and self.count < 3\n"
                    "        response.success = not (request.data and self.stopped)"
                ),
            )
        ),
        {"stays_still"},
    ),
    "relay asks all the time": (
        relay(
            (
                "        self.get_logger().info('Relay ready')",
                (
                    "        self.create_timer(\n"
                    "            0.05, lambda: self.client.service_is_ready() and self.client.call_async(\n"
                    "                AddTwoInts.Request(a=0, b=0)), callback_group=group)"
                ),
            )
        ),
        {"relay_asks_each_time"},
    ),
    "relay sets its parameters at the start": (
        relay(
            (
                "        # While a callback",
                "        self.set_parameters([rclpy.parameter.Parameter('a', value=1)])\n        # While a callback",
            )
        ),
        {"relay_sends_parameters"},
    ),
    "relay reads b once": (
        relay(
            ("self.declare_parameter('b', 0)", "self.b = self.declare_parameter('b', 0).value"),
            ("self.get_parameter('b').value", "self.b"),
        ),
        {"changed_parameters"},
    ),
    "relay reads again when a is set": (
        relay(
            (
                "        self.declare_parameter('b', 0)\n",
                "        self.declare_parameter('b', 0)\n        self.seen = None\n",
            ),
            (
                ASK,
                ASK + "        self.seen = self.seen if self.seen and self.seen[0] == a else (a, b)\n"
                "        a, b = self.seen\n",
            ),
        ),
        {"changed_parameters"},
    ),
    "relay refuses to be set while a call waits": (
        relay(
            (
                "        # While a callback",
                (
                    "        from rcl_interfaces.msg import SetParametersResult\n        self.waiting = 0\n"
                    "        self.add_on_set_parameters_callback(\n"
                    "            lambda _: SetParametersResult(successful=not self.waiting, reason='busy'))\n"
                    "        # While a callback"
                ),
            ),
            (
                "        answer = " + AWAIT,
                "        self.waiting += 1\n        answer = " + AWAIT + "\n        self.waiting -= 1",
            ),
        ),
        {"goes_on_serving"},
    ),
    "relay lets a set wait until no call waits": (
        relay(
            ("import rclpy\n", "import time\nimport rclpy\n"),
            (
                "        # While a callback",
                (
                    "        from rcl_interfaces.msg import SetParametersResult\n        self.waiting = 0\n"
                    "        def wait(_):\n            while self.waiting:\n                time.sleep(0.01)\n"
                    "            return SetParametersResult(successful=True)\n"
                    "        self.add_on_set_parameters_callback(wait)\n        # While a callback"
                ),
            ),
            (
                "        answer = " + AWAIT,
                "        self.waiting += 1\n        answer = " + AWAIT + "\n        self.waiting -= 1",
            ),
            *THREADED,
        ),
        {"goes_on_serving"},
    ),
    "relay has as many threads as callers": (
        {**REFERENCE, RELAY: BLOCKING.replace("num_threads=9", "num_threads=3").encode()},
        {"several_callers", "goes_on_serving"},
    ),
    "relay gives answers to whoever asked first": (
        relay(
            (
                "        answer = " + AWAIT,
                (
                    "        from rclpy.task import Future\n"
                    "        self.queue = getattr(self, 'queue', [])\n"
                    "        mine = Future()\n        self.queue.append(mine)\n"
                    "        self.client.call_async(AddTwoInts.Request(a=a, b=b)).add_done_callback(\n"
                    "            lambda done: self.queue.pop(0).set_result(done.result()))\n"
                    "        answer = await mine"
                ),
            )
        ),
        ONE_BY_ONE,
    ),
    "asks twice a second without a call": (
        relay(
            (
                "        self.get_logger()",
                "        self.create_timer(0.5, self.look, callback_group=group)\n        self.get_logger()",
            ),
            (
                "    async def relay",
                """    def look(self):
        if self.client.service_is_ready():
            self.client.call_async(AddTwoInts.Request())

    async def relay""",
            ),
        ),
        {"relay_asks_each_time"},
    ),
    "looks once a second whether the answer is there": (
        relay(
            (
                "answer = await self.client.call_async(AddTwoInts.Request(a=a, b=b))",
                """future = self.client.call_async(AddTwoInts.Request(a=a, b=b))
        while not future.done():
            time.sleep(1.0)
        answer = future.result()""",
            ),
            ("import rclpy\n", "import time\n\nimport rclpy\n"),
            (
                "    rclpy.init(args=args)\n    node = Relay()\n",
                (
                    "    from rclpy.executors import MultiThreadedExecutor\n"
                    "    rclpy.init(args=args)\n    node = Relay()\n"
                ),
            ),
            ("rclpy.spin(node)", "rclpy.spin(node, MultiThreadedExecutor(num_threads=20))"),
        ),
        {"relay_asks_each_time"},
    ),
    "relay waits 8 s for a server": (
        relay(("if not self.client.service_is_ready()", "if not self.client.wait_for_service(timeout_sec=8.0)")),
        {"without_add_two_ints"},
    ),
    "relay remembers that there was no server": (
        relay(
            (
                "        if not self.client.service_is_ready():\n",
                (
                    "        if not hasattr(self, 'gone'):\n"
                    "            self.gone = not self.client.wait_for_service(timeout_sec=2.0)\n"
                    "        if self.gone:\n"
                ),
            )
        ),
        {"goes_on_afterwards"},
    ),
    "relay gives the first answer to all who wait": (
        relay(
            (
                "        answer = await self.client.call_async(AddTwoInts.Request(a=a, b=b))\n",
                (
                    "        mine = Future()\n"
                    "        self.waiting = [*getattr(self, 'waiting', []), mine]\n"
                    "        self.client.call_async(AddTwoInts.Request(a=a, b=b)).add_done_callback(self.wake)\n"
                    "        answer = await mine\n"
                ),
            ),
            (
                "    async def relay(",
                (
                    "    def wake(self, future):\n"
                    "        for each in self.waiting:\n"
                    "            each.set_result(future.result())\n"
                    "        self.waiting = []\n\n"
                    "    async def relay("
                ),
            ),
            ("from rclpy.node import Node\n", "from rclpy.node import Node\nfrom rclpy.task import Future\n"),
        ),
        {"no_caller_waits_for_another", "several_callers"},
    ),
    "relay ends 0.7 s after it has failed": (
        relay(
            ("import rclpy\n", "import os\nimport threading\n\nimport rclpy\n"),
            (
                "            response.success = False\n",
                "            threading.Timer(0.7, os._exit, (0,)).start()\n            response.success = False\n",
            ),
        ),
        {"goes_on_afterwards"},
    ),
    "relay remembers that there was a server": (
        relay(
            (
                "        if not self.client.service_is_ready():\n",
                (
                    "        self.there = getattr(self, 'there', False) or self.client.service_is_ready()\n"
                    "        if not self.there:\n"
                ),
            )
        ),
        {"goes_on_afterwards"},
    ),
    "the first enable after a stop is ignored": (
        motors(
            (SWITCH, SWITCH + "\n        self.enabled = self.enabled and not self.ended\n        self.ended = False"),
            (STOPS, "        self.ended = self.stopped and not request.data\n" + STOPS),
            ("self.stopped = False\n        self.create", "self.stopped = self.ended = False\n        self.create"),
        ),
        {"emergency_stop"},
    ),
    "a stop must be acknowledged by disabling": (
        motors(
            (
                SWITCH,
                SWITCH + "\n        self.enabled = self.enabled and not self.ended\n"
                "        self.ended = self.ended and request.data",
            ),
            (STOPS, "        self.ended = self.stopped and not request.data\n" + STOPS),
            ("self.stopped = False\n        self.create", "self.stopped = self.ended = False\n        self.create"),
        ),
        {"emergency_stop"},
    ),
    "motors can be disabled once": (
        motors(
            (
                SWITCH,
                (
                    "used, self.used = getattr(self, 'used', False), getattr(self, 'used', False) or (\n"
                    "            self.enabled and not request.data)\n"
                    "        self.enabled = (request.data or (self.enabled and used)) and not self.stopped"
                ),
            )
        ),
        {"enable_and_disable"},
    ),
    "motors are disabled when nobody asks for 5 s": (
        motors(
            (
                "        self.get_logger().info('Motor service ready')",
                "        self.create_timer(5.0, lambda: setattr(self, 'enabled', False))",
            )
        ),
        {"last_command_counts"},
    ),
    "the end of a stop brings the state before it back": (
        motors(
            (
                STOPS,
                (
                    "        if request.data:\n"
                    "            self.before, self.enabled = self.enabled, False\n"
                    "        elif self.stopped:\n            self.enabled = self.before\n"
                    "        self.stopped = request.data\n"
                ),
            )
        ),
        {"stays_still"},
    ),
    "status keeps its first answer": (
        motors(
            (
                STATUS,
                STATUS + "\n        self.said = response.message = getattr(self, 'said', f'Motors {self.state()}')\n"
                "        return response",
            )
        ),
        {"status"},
    ),
    "stopped motors are in emergency stop": (
        motors(("return 'stopped'", "return 'in emergency stop'")),
        {"messages_say_state"},
    ),
    "each message names two states": (
        motors(("f'Motors {self.state()}'", 'f\'Motors {self.state()}, not {"dis" if self.enabled else "en"}abled\'')),
        {"messages_say_state"},
    ),
    "messages name two states until the motors are enabled": (
        motors(
            ("        self.stopped = False\n", "        self.stopped = self.used = False\n"),
            (
                "        if self.stopped:\n            return 'stopped'",
                """        self.used = self.used or self.enabled
        return self.word() + ('' if self.used else ', not enabled since the start')

    def word(self):
        if self.stopped:
            return 'stopped'""",
            ),
        ),
        {"messages_say_state"},
    ),
    "an emergency stop raises before the motors are enabled": (
        motors(
            (SWITCH, SWITCH + "\n        if self.enabled:\n            self.since = self.get_clock().now()"),
            (STOPS, "        if request.data:\n            self.ran = self.get_clock().now() - self.since\n" + STOPS),
        ),
        {"emergency_stop"},
    ),
    "status has another type": (
        motors(("create_service(Trigger, '/motors/status'", "create_service(SetBool, '/motors/status'")),
        {"motors_start_disabled", "status"},
    ),
    "relay takes a sum of -1 for no answer": (
        relay((SUCCESS, SUCCESS.replace("True", "answer.sum != -1"))),
        {"relay_answers"},
    ),
    "relay takes 0 and 0 for parameters that are not set": (
        relay(("not self.client.service_is_ready()", "not self.client.service_is_ready() or not (a or b)")),
        {"changed_parameters"},
    ),
    "relay takes an a of 0 for 1": (
        relay(("self.get_parameter('a').value,", "self.get_parameter('a').value or 1,")),
        {"changed_parameters"},
    ),
    "a refused enable keeps the stop from ending at once": (
        motors(
            (
                STOPS,
                "        if not request.data and self.asked:\n            request.data, self.asked = True, False\n"
                + STOPS,
            ),
            (
                "        self.enabled = request.data and",
                "        self.asked = request.data and self.stopped\n        self.enabled = request.data and",
            ),
            (
                "self.create_service(SetBool, '/motors/em",
                "self.asked = False\n        self.create_service(SetBool, '/motors/em",
            ),
        ),
        {"emergency_stop"},
    ),
    "a stop ends only when the status was asked for": (
        motors(
            (
                "        self.stopped = request.data\n",
                (
                    "        self.stopped = request.data or (self.stopped and not self.looked)\n"
                    "        self.looked = self.looked and not request.data\n"
                ),
            ),
            (
                '        """Say the state, and leave it alone."""\n',
                '        """Say the state, and leave it alone."""\n        self.looked = True\n',
            ),
            (
                "self.create_service(SetBool, '/motors/em",
                "self.looked = False\n        self.create_service(SetBool, '/motors/em",
            ),
        ),
        {"emergency_stop"},
    ),
    "relay shows the sum as a float": (relay(("{answer.sum}", "{float(answer.sum):.0f}")), {"relay_answers"}),
    "relay takes a parameter of 0 for none": (relay((ASK, ASK + "        b = b or 1\n")), {"changed_parameters"}),
    "relay gives up after 5 s": (
        {**REFERENCE, RELAY: THREADS.replace("done.wait(9)", "done.wait(5)").encode()},
        {"slow_answer"},
    ),
    "relay calls for 3 s at most": (
        {**REFERENCE, RELAY: BLOCKING.replace("timeout_sec=10.0", "timeout_sec=3.0").encode()},
        {"slow_answer"},
    ),
    "relay remembers its sums": (
        relay(
            (
                "        answer = " + AWAIT,
                "        self.known = getattr(self, 'known', {})\n"
                "        if (a, b) not in self.known:\n            self.known[a, b] = " + AWAIT + "\n"
                "        answer = self.known[a, b]",
            )
        ),
        {"relay_asks_each_time"},
    ),
    "relay looks for 2 s in its one thread": (
        relay(("if not self.client.service_is_ready()", "if not self.client.wait_for_service(timeout_sec=2.0)")),
        {"without_add_two_ints"},
    ),
    "relay says the last sum when there is no server any more": (
        relay(
            ("            response.success = False\n", "            response.success = hasattr(self, 'last')\n"),
            ("'/add_two_ints is not there'", "getattr(self, 'last', '/add_two_ints is not there')"),
            (
                "        return response\n\n\ndef main",
                "        self.last = response.message\n        return response\n\n\ndef main",
            ),
        ),
        {"goes_on_afterwards"},
    ),
    "motors are disabled 3 s after the last request": (
        motors(
            (
                "        self.get_logger().info('Motor service ready')",
                "        self.idle = self.create_timer(3.0, self.rest)",
            ),
            (
                "    def state(self):\n",
                (
                    "    def rest(self):\n        self.enabled = False\n\n"
                    "    def state(self):\n        self.idle.reset()\n"
                ),
            ),
        ),
        {"last_command_counts"},
    ),
    "relay does not ask for a sum with 0": (
        relay(
            (
                ASK,
                ASK
                + "        if 0 in (a, b):\n            return Trigger.Response(success=True, message=str(a + b))\n",
            )
        ),
        {"changed_parameters"},
    ),
    "relay answers a second later": (
        {
            **REFERENCE,
            RELAY: THREADS.replace("import threading", "import threading\nimport time")
            .replace(
                "        return Trigger.Response(success=True",
                "        time.sleep(1)\n        return Trigger.Response(success=True",
            )
            .encode(),
        },
        {"relay_asks_each_time"},
    ),
    "relay shows 32 bits of the sum": (
        relay(("{answer.sum}", "{(answer.sum + 2**31) % 2**32 - 2**31}")),
        {"relay_answers"},
    ),
    "relay looks for a second in its one thread": (
        relay(("if not self.client.service_is_ready()", "if not self.client.wait_for_service(timeout_sec=1.0)")),
        {"without_add_two_ints"},
    ),
    "an enable that takes half a second overwrites the stop": (
        motors(
            (SWITCH, "if request.data:\n            time.sleep(0.5)\n        " + SWITCH),
            ("import rclpy\n", "import time\n\nimport rclpy\n"),
            (
                "'/motors/enable', self.enable)",
                "'/motors/enable', self.enable, callback_group=ReentrantCallbackGroup())",
            ),
            *THREADED,
            ("from rclpy.node", "from rclpy.callback_groups import ReentrantCallbackGroup\nfrom rclpy.node"),
        ),
        {"stays_still"},
    ),
    "an enable that takes 30 ms overwrites the stop": (
        motors(
            (SWITCH, "if request.data:\n            time.sleep(0.03)\n        " + SWITCH),
            ("import rclpy\n", "import time\n\nimport rclpy\n"),
            (
                "'/motors/enable', self.enable)",
                "'/motors/enable', self.enable, callback_group=ReentrantCallbackGroup())",
            ),
            *THREADED,
            ("from rclpy.node", "from rclpy.callback_groups import ReentrantCallbackGroup\nfrom rclpy.node"),
        ),
        {"stays_still"},
    ),
    "an emergency stop that takes 30 ms lets an enable in": (
        motors(
            (
                "        self.stopped = request.data\n        if self.stopped:\n            self.enabled = False\n",
                (
                    "        if request.data:\n"
                    "            self.enabled = False\n"
                    "            time.sleep(0.03)\n"
                    "        self.stopped = request.data\n"
                ),
            ),
            ("import rclpy\n", "import time\n\nimport rclpy\n"),
            (
                "'/motors/emergency_stop', self.emergency_stop)",
                (
                    "'/motors/emergency_stop', self.emergency_stop,\n"
                    "                            callback_group=ReentrantCallbackGroup())"
                ),
            ),
            *THREADED,
            ("from rclpy.node", "from rclpy.callback_groups import ReentrantCallbackGroup\nfrom rclpy.node"),
        ),
        {"stays_still"},
    ),
    "disabled motors are not enabled": (
        motors(
            ("return 'enabled' if self.enabled else 'disabled'", "return 'enabled' if self.enabled else 'not enabled'")
        ),
        {"messages_say_state"},
    ),
    "relay refuses large numbers": (
        relay(
            (
                ASK,
                ASK + "        if max(abs(a), abs(b)) > 2**61:\n"
                "            return Trigger.Response(success=False, message='too large')\n",
            )
        ),
        {"changed_parameters"},
    ),
    "a disable that takes half a second overwrites the stop": (
        motors(
            (
                SWITCH,
                "if not request.data:\n            stopped = self.stopped\n            time.sleep(0.5)\n"
                "            self.stopped = stopped\n        " + SWITCH,
            ),
            ("import rclpy\n", "import time\n\nimport rclpy\n"),
            (
                "'/motors/enable', self.enable)",
                "'/motors/enable', self.enable, callback_group=ReentrantCallbackGroup())",
            ),
            *THREADED,
            ("from rclpy.node", "from rclpy.callback_groups import ReentrantCallbackGroup\nfrom rclpy.node"),
        ),
        {"stays_still"},
    ),
    "a second end of the stop starts the motors": (
        motors(
            (SWITCH, SWITCH + "\n        if not self.stopped:\n            self.before = self.enabled"),
            (
                STOPS,
                "        if not request.data and not self.stopped:\n            self.enabled = self.before\n" + STOPS,
            ),
            ("        self.stopped = False\n", "        self.stopped = False\n        self.before = False\n"),
        ),
        {"stays_still"},
    ),
    "motors that end by themselves after two seconds": (
        motors(SPINS_FOR_TWO_SECONDS),
        {"last_command_counts", "stays_still"},
    ),
    "motors that die in a timer after three seconds": (
        motors(
            (
                "        self.get_logger().info('Motor service ready')",
                "        self.create_timer(3.0, lambda: self.get_logger().info(self.uptime))",
            )
        ),
        {"last_command_counts", "stays_still"},
    ),
    "the stop ends by itself after 6 s": (
        motors(
            (
                "        self.get_logger().info('Motor service ready')",
                "        self.over = self.create_timer(6.0, lambda: setattr(self, 'stopped', False))",
            ),
            (STOPS, "        self.over.reset()\n" + STOPS),
        ),
        {"stays_still"},
    ),
    "the stop ends by itself after 8 s": (
        motors(
            (
                "        self.get_logger().info('Motor service ready')",
                "        self.over = self.create_timer(8.0, lambda: setattr(self, 'stopped', False))",
            ),
            (STOPS, "        self.over.reset()\n" + STOPS),
        ),
        {"stays_still"},
    ),
    "the end of a stop that lasted more than a second enables again": (
        motors(
            (
                STOPS,
                """        now = self.get_clock().now().nanoseconds / 1e9
        if request.data and not self.stopped:
            self.before, self.since = self.enabled, now
        elif self.stopped and not request.data and now - self.since > 1.0:
            self.enabled = self.before
"""
                + STOPS,
            )
        ),
        {"stays_still"},
    ),
    "enabling ends a stop that came before the motors were ever enabled": (
        motors(
            (
                REFUSE,
                """if request.data and not hasattr(self, 'ran'):
            self.stopped = False
        if request.data:
            self.ran = True
        """
                + REFUSE,
            )
        ),
        {"stays_still"},
    ),
    "an enable that takes a tenth of a second overwrites the stop": (
        motors(
            (SWITCH, "if request.data:\n            time.sleep(0.1)\n        " + SWITCH),
            ("import rclpy\n", "import time\n\nimport rclpy\n"),
            (
                "'/motors/enable', self.enable)",
                "'/motors/enable', self.enable, callback_group=ReentrantCallbackGroup())",
            ),
            *THREADED,
            ("from rclpy.node", "from rclpy.callback_groups import ReentrantCallbackGroup\nfrom rclpy.node"),
        ),
        {"stays_still"},
    ),
    "relay asks once more when a parameter is set": (
        relay(
            (
                "        # While a callback",
                "        self.add_post_set_parameters_callback(self.ask)\n        # While a callback",
            ),
            (
                "    async def relay",
                (
                    "    def ask(self, parameters):\n        if self.client.service_is_ready():\n"
                    "            self.client.call_async(AddTwoInts.Request())\n\n    async def relay"
                ),
            ),
        ),
        {"relay_asks_each_time"},
    ),
    "relay takes half a second before it asks": (
        relay((ASK, ASK + "        time.sleep(0.5)\n"), ("import rclpy\n", "import time\n\nimport rclpy\n")),
        {"several_callers", "relay_asks_each_time"},
    ),
    "relay lets four ask at a time": (
        {
            **REFERENCE,
            RELAY: THREADS.replace(
                "        done = threading", "        self.places.acquire()\n        done = threading"
            )
            .replace(
                "        return Trigger.Response(success=True",
                "        self.places.release()\n        return Trigger.Response(success=True",
            )
            .replace("        group =", "        self.places = threading.Semaphore(4)\n        group =")
            .encode(),
        },
        {"several_callers"},
    ),
    "relay does not look for 3 s after it has found no server": (
        relay(
            (
                "        if not self.client.service_is_ready():\n",
                (
                    "        now = self.get_clock().now().nanoseconds / 1e9\n"
                    "        known = now < getattr(self, 'next_look', 0)\n"
                    "        if known or not self.client.service_is_ready():\n"
                    "            self.next_look = self.next_look if known else now + 3\n"
                ),
            )
        ),
        {"goes_on_afterwards"},
    ),
    "relay looks ever more rarely whether the answer is there": (
        {
            **REFERENCE,
            RELAY: THREADS.replace("import threading", "import threading\nimport time")
            .replace(
                "        if not done.wait(9)",
                "        pause = 0.01\n"
                "        while not done.is_set():\n"
                "            time.sleep(pause)\n"
                "            pause = min(2 * pause, 2)\n"
                "        if not done.wait(9)",
            )
            .encode(),
        },
        {"slow_answer"},
    ),
    "relay looks every 3 s whether there is a server": (
        relay(
            (
                "        # While a callback",
                "        self.there = False\n        self.create_timer(3.0, self.look)\n        # While a callback",
            ),
            (
                "    async def relay",
                "    def look(self):\n        self.there = self.client.service_is_ready()\n\n    async def relay",
            ),
            ("if not self.client.service_is_ready():\n", "if not self.there:\n"),
        ),
        {"goes_on_afterwards"},
    ),
    "relay remembers that there was a server, and waits 9 s for it": (
        {
            **REFERENCE,
            RELAY: THREADS.replace(
                "        if not self.client.service_is_ready()",
                "        self.there = getattr(self, 'there', False) or self.client.service_is_ready()\n"
                "        if not self.there",
            ).encode(),
        },
        {"goes_on_afterwards"},
    ),
    "relay repeats its last message when there is no server any more": (
        relay(
            ("'/add_two_ints is not there'", "getattr(self, 'last', '/add_two_ints is not there')"),
            (
                "        return response\n\n\ndef main",
                "        self.last = response.message\n        return response\n\n\ndef main",
            ),
        ),
        {"goes_on_afterwards"},
    ),
    "relay has a method called handle": (
        relay(("self.relay, callback_group", "self.handle, callback_group"), ("async def relay(", "async def handle(")),
        SERVED | ABSENT,
    ),
    "relay has another name": (relay(("'/relay'", "'/relais'")), SERVED | ABSENT),
}

# Programs that do nothing that the task asks for.
REFUSING = """
import rclpy
from std_srvs.srv import SetBool, Trigger

def answer(request, response):
    response.success, response.message = False, 'no'
    return response

rclpy.init()
node = rclpy.create_node('nothing')
node.create_service(SetBool, '/motors/enable', answer)
node.create_service(SetBool, '/motors/emergency_stop', answer)
node.create_service(Trigger, '/motors/status', answer)
node.create_service(Trigger, '/relay', answer)
node.declare_parameters('', [('a', 0), ('b', 0)])
rclpy.spin(node)
"""


def nothing(text: str) -> dict[str, bytes]:
    """The same program under both names."""
    return {MOTORS: text.encode(), RELAY: text.encode()}


DOING_NOTHING = {
    "refuses everything": nothing(REFUSING),
    "refuses everything, and says disabled": nothing(REFUSING.replace("'no'", "'disabled'")),
    "always has success, and says disabled": nothing(REFUSING.replace("False, 'no'", "True, 'disabled'")),
    "always has success, and says stopped": nothing(REFUSING.replace("False, 'no'", "True, 'stopped'")),
    "always has success, and says 42": nothing(REFUSING.replace("False, 'no'", "True, '42'")),
    "returns the response untouched": nothing(
        REFUSING.replace("response.success, response.message = False, 'no'", "pass")
    ),
    "raises": nothing(REFUSING.replace("response.success, response.message = False, 'no'", "raise ValueError")),
    "nodes without services": nothing("import rclpy\nrclpy.init()\nrclpy.spin(rclpy.create_node('nothing'))\n"),
    "empty files": nothing("\n"),
}
WRONG |= {name: (files, MOTOR_TESTS | SERVED | ABSENT) for name, files in DOING_NOTHING.items()}
NOTHING = {*DOING_NOTHING}
SEVERAL = {"the page's camera and doubler, with the task's names", "status names two states"}
USELESS = {
    name
    for name, (_, lost) in WRONG.items()
    if name not in NOTHING and lost >= SERVED - {"relay_answers"} and "goes_on_afterwards" in lost
}

SILENT = {
    "motors hang instead of refusing",
    "motors hang when there is no stop to end",
    "status under another name",
    "relay has no success",
    "relay blocks its one thread",
    "relay blocks each of its threads",
    "relay awaits in the default group",
    "relay spins in its callback, all in the default group",
    "relay spins in its callback, many threads",
    "relay spins itself in another executor",
    "relay never looks whether there is a server",
    "relay waits for a server for ever",
    "relay gives up after one failure",
    "relay has another name",
    "relay has as many threads as callers",
    "relay lets a set wait until no call waits",
    "relay remembers that there was a server",
    "relay remembers that there was a server, and waits 9 s for it",
}
# Judged by the whole suite in every run of the tests: what is right, and partial credit of each kind.
QUICK = {"reference", "relay raises without a server"}

# Mistakes in what the exercise is about, and mistakes in a detail: `test_weights.py` holds what each costs.
ABOUT = {
    "an emergency stop that takes 30 ms lets an enable in",
    "the stop only disables",
    "the stop is not latched",
    "the end of a stop enables again",
    "the end of a stop brings the state before it back",
    "the motors start by themselves a second after the stop has ended",
    "a refused enable is remembered",
    "an enable that takes half a second overwrites the stop",
    "a disable that takes half a second overwrites the stop",
    "a second end of the stop starts the motors",
    "the stop ends by itself after 6 s",
    "the end of a stop that lasted more than a second enables again",
    "enabling ends a stop that came before the motors were ever enabled",
    "the stop toggles",
    "disabling ends the stop",
    "only enabled motors can be stopped",
    "relay awaits in a mutually exclusive group of its own",
    "relay awaits, only the client in a group of its own",
    "relay takes turns with a lock",
    "relay spins in its callback",
    "relay spins its executor in its callback",
    "relay spins once and again in its callback",
    "relay spins a second node, with one thread",
    "relay gives answers to whoever asked first",
    "relay shares one answer",
}
DETAIL = {
    "motors start enabled",
    "motors start stopped",
    "enable says nothing",
    "a refusal names two states",
    "each message names two states",
    "messages name two states until the motors are enabled",
    "an emergency stop raises before the motors are enabled",
    "stopped motors are in emergency stop",
    "status says on and off",
    "status is of a state of its own",
    "status success is the state",
    "status has another type",
    "status under another name",
    "success is always True",
    "a second stop is an error",
    "stops are counted",
    "enable counts",
    "relay asks twice",
    "relay asks once more when a parameter is set",
    "relay remembers its sums",
    "looks once a second whether the answer is there",
    "relay gives up after 5 s",
    "relay shows the sum as a float",
    "relay takes a parameter of 0 for none",
    "relay reads b once",
    "relay mixes up a and b",
    "relay says nothing without a server",
    "relay raises without a server",
    "relay remembers that there was a server",
    "relay looks every 3 s whether there is a server",
}

# Judged as one program each in every run of the tests, see the package.
TOGETHER = [
    {"motors start enabled", "relay gives up after 5 s"},
    {"enable toggles", "relay lets four ask at a time"},
    {"enable only enables", "enable says the state before", "relay reads its parameters once"},
    {
        "enable counts",
        "relay takes a sum of 0 for no answer",
        "relay asks twice, and calls its server unavailable at first",
    },
    {"parameters that are set while a call waits are not used", "the first enable after a stop is ignored"},
    {
        "repeating is an error",
        "status is of a state of its own",
        "relay mixes up a and b",
        "relay says nothing without a server",
        "relay awaits in a mutually exclusive group of its own",
    },
    {"the end of a stop enables again", "relay remembers that there was no server"},
]
