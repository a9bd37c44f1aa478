"""Answers to the exercise on parameters."""

from autograder.submissions import exercises

from . import changed, solution

NODE = "pid_node.py"
REFERENCE = solution("parameters")


def node(*pairs: tuple[str, str]) -> dict[str, bytes]:
    """The reference with some texts replaced."""
    return changed(REFERENCE, NODE, *pairs)


CHECK_ALL = """        limits = {name: self.value(name) for name in ('output_min', 'output_max')}
        for param in params:
            if param.name in limits:
                limits[param.name] = param.value
"""

FUNCTIONS = """
import rclpy
from rclpy.clock import Clock, ClockType
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, ParameterType, SetParametersResult
from std_msgs.msg import Float64

state = {'sum': 0.0, 'before': None, 'ki': 0.0}
steady = Clock(clock_type=ClockType.STEADY_TIME)

def limited(top):
    return ParameterDescriptor(type=ParameterType.PARAMETER_DOUBLE, floating_point_range=[
        FloatingPointRange(from_value=0.0, to_value=float(top), step=0.0)])

def ok(parameters):
    new = {p.name: p.value for p in parameters}
    low = new.get('output_min', node.get_parameter('output_min').value)
    high = new.get('output_max', node.get_parameter('output_max').value)
    return SetParametersResult(successful=low < high, reason='' if low < high else 'limits!')

def on_error(message):
    now = steady.now()
    p, i, d, low, high = (parameter.value for parameter in node.get_parameters(
        ['kp', 'ki', 'kd', 'output_min', 'output_max']))
    out = p * message.data
    if state['before']:
        then, error = state['before']
        dt = (now - then).nanoseconds / 1e9
        state['sum'] += message.data * dt
        out += d * (message.data - error) / dt
    out += i * state['sum']
    state['before'] = now, message.data
    publisher.publish(Float64(data=min(max(out, low), high)))

def changed(parameters):
    for p in parameters:
        if p.name == 'ki' and p.value != state['ki']:
            state.update(ki=p.value, sum=0.0)

rclpy.init()
node = rclpy.create_node('controller')
node.declare_parameters('', [('kp', 1.0, limited(100)), ('ki', 0.0, limited(50)), ('kd', 0.0, limited(10)),
                             ('output_min', -10.0), ('output_max', 10.0),
                             ('joint_name', 'elbow', ParameterDescriptor(read_only=True))])
state['ki'] = node.get_parameter('ki').value
node.add_on_set_parameters_callback(ok)
node.add_post_set_parameters_callback(changed)
publisher = node.create_publisher(Float64, '/effort', 1)
node.create_subscription(Float64, '/error', on_error, 1)
rclpy.spin(node)
"""

CACHED = """
import dataclasses, threading, time
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from std_msgs.msg import Float64

@dataclasses.dataclass
class Pid:
    kp: float = 1.0
    ki: float = 0.0
    kd: float = 0.0
    output_min: float = -10.0
    output_max: float = 10.0
    integral: float = 0.0
    last: tuple = None

    def step(self, error):
        now = time.monotonic()
        dt = now - self.last[0] if self.last else 0.0
        before = self.last[1] if self.last else error
        self.last = now, error
        self.integral += error * dt
        raw = self.kp * error + self.ki * self.integral + (self.kd * (error - before) / dt if dt else 0.0)
        if raw > self.output_max:
            return self.output_max
        return max(raw, self.output_min)

class Helper(Node):
    def __init__(self, context):
        super().__init__('a_helper', context=context)
        self.create_timer(0.02, lambda: self.get_logger().info('beat'))

class Controller(Node):
    def __init__(self, context):
        super().__init__('pid_node', context=context)
        self.lock = threading.Lock()
        self.pid = Pid()
        for field in dataclasses.fields(Pid)[:5]:
            descriptor = ParameterDescriptor(description=field.name)
            top = dict(kp=100.0, ki=50.0, kd=10.0).get(field.name)
            if top:
                descriptor.floating_point_range.append(FloatingPointRange(from_value=0.0, to_value=top))
            setattr(self.pid, field.name, self.declare_parameter(field.name, field.default, descriptor).value)
        self.declare_parameter('joint_name', 'elbow', ParameterDescriptor(read_only=True))
        self.declare_parameter('verbose', False)
        self.add_on_set_parameters_callback(self.validate)
        self.add_post_set_parameters_callback(self.apply)
        group = ReentrantCallbackGroup()
        self.publisher = self.create_publisher(Float64, 'effort', qos_profile_sensor_data)
        self.create_subscription(Float64, 'error', self.heard, qos_profile_sensor_data, callback_group=group)

    def validate(self, parameters):
        wanted = dataclasses.replace(self.pid)
        for parameter in parameters:
            setattr(wanted, parameter.name, parameter.value)
        if not wanted.output_min < wanted.output_max:
            return SetParametersResult(successful=False, reason='output_min must be less than output_max')
        return SetParametersResult(successful=True)

    def apply(self, parameters):
        with self.lock:
            for parameter in parameters:
                if parameter.name == 'ki' and parameter.value != self.pid.ki:
                    self.pid.integral = 0.0
                setattr(self.pid, parameter.name, parameter.value)

    async def heard(self, message):
        with self.lock:
            effort = self.pid.step(message.data)
        self.get_logger().info(f'{self.pid} {effort}')
        self.publisher.publish(Float64(data=effort))

def main(args=None):
    time.sleep(2)
    context = Context()
    rclpy.init(args=args, context=context)
    executor = MultiThreadedExecutor(num_threads=4, context=context)
    for kind in (Helper, Controller):
        executor.add_node(kind(context))
    executor.spin()

if __name__ == '__main__':
    main()
"""

LAZY = """
import math, time
import rclpy
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor as D, SetParametersResult as R
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Float64

class Node2(Node):
    RULES = {'kp': (1.0, 100.0), 'ki': (0.0, 50.0), 'kd': (0.0, 10.0)}

    def __init__(self):
        Node.__init__(self, 'n', allow_undeclared_parameters=True)
        self.add_on_set_parameters_callback(self.check)  # before anything is declared
        for name, (value, top) in self.RULES.items():
            limits = FloatingPointRange(from_value=0., to_value=top)
            self.declare_parameter(name, value, D(floating_point_range=[limits]))
        self.declare_parameter('output_min', -10.0)
        self.declare_parameter('output_max', 10.0)
        self.declare_parameter('joint_name', Parameter.Type.STRING.value and 'elbow', D(read_only=True))
        self.t = self.e = self.ki = None
        self.s = 0
        self.pub = self.create_publisher(Float64, 'effort', 10)
        self.sub = self.create_subscription(Float64, 'error', self.cb, 10)

    def __getitem__(self, name):
        return self.get_parameter_or(name, Parameter(name, value=math.nan)).value

    def check(self, params):
        new = {p.name: p for p in params}
        lo = new['output_min'].value if 'output_min' in new else self['output_min']
        hi = new['output_max'].value if 'output_max' in new else self['output_max']
        if any(p.name.startswith('output_') and math.isnan(p.value) for p in params):
            return R(successful=False, reason='NaN is no limit')
        match lo >= hi:
            case True:
                return R(successful=False, reason=f'{lo} >= {hi}')
            case False:
                return R(successful=True)

    def cb(self, m):
        t = time.perf_counter_ns()
        if self['ki'] != self.ki:  # it has been set since the last message
            self.ki, self.s = self['ki'], 0
        u = self['kp'] * m.data
        if self.t is not None:
            dt = (t - self.t) * 1e-9
            self.s += self.ki * m.data * dt
            u += self.s + self['kd'] * (m.data - self.e) / dt
        self.t, self.e = t, m.data
        u = self['output_min'] if u < self['output_min'] else self['output_max'] if u > self['output_max'] else u
        print('effort', u)
        self.pub.publish(Float64(data=float(u)))

rclpy.init()
try:
    rclpy.spin(Node2())
except KeyboardInterrupt:
    pass
"""

WORKER = """
import queue, threading, time
from collections import namedtuple
import rclpy
from rcl_interfaces.msg import FloatingPointRange as Range, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Float64

Gains = namedtuple('Gains', 'kp ki kd output_min output_max', defaults=(1.0, 0.0, 0.0, -10.0, 10.0))

class Pid(Node):


    def __init__(self):
        super().__init__('pid_node')
        for name, top in dict(kp=100.0, ki=50.0, kd=10.0, output_min=None, output_max=None).items():
            about = ParameterDescriptor(description=name)
            if top is not None:
                about.floating_point_range = [Range(from_value=0.0, to_value=top, step=0.0)]
            self.declare_parameter(name, Gains._field_defaults[name], about)
        self.declare_parameter('joint_name', 'elbow', ParameterDescriptor(read_only=True))
        self.gains = Gains(*(p.value for p in self.get_parameters(Gains._fields)))
        self.history = []  # errors times seconds
        self.add_pre_set_parameters_callback(self.as_doubles)
        self.add_on_set_parameters_callback(self.ordered)
        self.add_post_set_parameters_callback(self.take)
        self.todo = queue.SimpleQueue()
        self.out = self.create_publisher(Float64, 'effort', 50)
        self.create_subscription(Float64, 'error', lambda m: self.todo.put((time.monotonic(), m.data)), 50)
        threading.Thread(target=self.work, daemon=True).start()

    def as_doubles(self, parameters):
        return [Parameter(p.name, value=float(p.value)) if p.name in Gains._fields and type(p.value) is int else p
                for p in parameters]

    def ordered(self, parameters):
        wanted = self.gains._replace(**{p.name: p.value for p in parameters if p.name in Gains._fields})
        fine = wanted.output_max - wanted.output_min > 0.0
        return SetParametersResult(successful=fine, reason='' if fine else 'the limits must be in order')

    def take(self, parameters):
        before = self.gains
        self.gains = Gains(*(p.value for p in self.get_parameters(Gains._fields)))
        if self.gains.ki != before.ki:
            self.history = []

    def work(self):
        last = None
        while True:
            now, error = self.todo.get()
            gains, slope = self.gains, 0.0
            if last:
                step = now - last[0]
                self.history.append(error * step)
                slope = (error - last[1]) / step if step else 0.0
            last = now, error
            effort = gains.kp * error + gains.ki * sum(self.history) + gains.kd * slope
            self.out.publish(Float64(data=sorted((gains.output_min, effort, gains.output_max))[1]))

if __name__ == '__main__':
    rclpy.init()
    node = Pid()
    try:
        rclpy.spin(node)
    except BaseException:
        pass
"""

PARTS = """
import math
from time import monotonic
import rclpy, rclpy.executors
from rcl_interfaces.msg import *
from rclpy.node import Node
from std_msgs.msg import Float64 as F

class P:
    def __init__(self, node): self.node = node
    def __call__(self, e, dt): return self.node.p('kp') * e

class I(P):
    total = 0.0
    def __call__(self, e, dt):
        self.total = math.fsum((self.total, e * (dt or 0)))
        return self.node.p('ki') * self.total

class D(P):
    def __call__(self, e, dt):
        de, self.e = e - getattr(self, 'e', e), e
        return self.node.p('kd') * de / dt if dt else 0.0

class PidNode(Node):
    ranges = {'kp': 100.0, 'ki': 50.0, 'kd': 10.0}

    def __init__(self, **kw):
        super(PidNode, self).__init__('pid_node', **kw)
        self.declare_parameters(namespace='', parameters=[
            (n, float(n == 'kp'), ParameterDescriptor(
                floating_point_range=[FloatingPointRange(from_value=0.0, to_value=t)]))
            for n, t in self.ranges.items()] + [('output_min', -10.0), ('output_max', 10.0)])
        self.declare_parameter('joint_name', value='elbow', descriptor=ParameterDescriptor(read_only=True))
        self.parts = P(self), I(self), D(self)
        self.seen = {'ki': self.p('ki')}
        self.add_on_set_parameters_callback(self.on_set)
        self.add_post_set_parameters_callback(self.post_set)
        self.create_subscription(F, 'error', self.step, rclpy.qos.qos_profile_system_default)
        self.pub = self.create_publisher(F, 'effort', rclpy.qos.qos_profile_system_default)
        self.t = None

    def p(self, name): return self.get_parameter(name).get_parameter_value().double_value

    def on_set(self, params):
        low, high = self.p('output_min'), self.p('output_max')
        for x in params:
            low = x.value if x.name == 'output_min' else low
            high = x.value if x.name == 'output_max' else high
        if math.isnan(low) or math.isnan(high) or low >= high:
            return SetParametersResult(successful=False, reason=f'not in order: {low}, {high}')
        return SetParametersResult(successful=True, reason='fine')

    def post_set(self, params):
        for x in params:
            if x.name == 'ki' and x.value != self.seen.get('ki'):
                self.seen['ki'] = x.value
                self.parts[1].total = 0.0

    def step(self, m):
        t, self.t = self.t, monotonic()
        u = sum(part(m.data, self.t - t if t is not None else None) for part in self.parts)
        self.pub.publish(F(data=min(max(u, self.p('output_min')), self.p('output_max'))))

def main(args=None):
    rclpy.init(args=args)
    if True:
        executor = rclpy.executors.SingleThreadedExecutor()
        executor.add_node(PidNode())
        try:
            while rclpy.ok():
                executor.spin_once(timeout_sec=0.5)
        except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
            pass

main()
"""

RIGHT = {
    "reference": REFERENCE,
    "a thread computes, integers become doubles, the integral as a list": {NODE: WORKER.encode()},
    "an object for each part, spin_once": {NODE: PARTS.encode()},
    "stored values looked up in the request first, one post-set callback for each thing": node(
        (
            CHECK_ALL,
            (
                "        wanted = {p.name: p.value for p in params}\n"
                "        low = wanted.get('output_min', self.value('output_min'))\n"
                "        high = wanted.get('output_max', self.value('output_max'))\n"
                "        limits = {'output_min': low, 'output_max': high}\n"
            ),
        ),
        (
            "        self.add_post",
            "        self.add_post_set_parameters_callback(lambda params: None)\n        self.add_post",
        ),
    ),
    "functions, one more name of the node": {NODE: FUNCTIONS.encode()},
    "gains kept in an object, two nodes, threads, async, slow start, best effort": {NODE: CACHED.encode()},
    "integral looked after when it is used, callback before the parameters": {NODE: LAZY.encode()},
    "two callbacks, in a namespace of its own": node(
        (
            "        self.add_post",
            (
                "        self.add_on_set_parameters_callback(\n            lambda params: "
                "SetParametersResult(successful=True))\n        self.add_post"
            ),
        ),
        ("'effort'", "'/effort'"),
        ("'error'", "'/error'"),
        ("'pid_node')", "'pid', namespace='arm')"),
    ),
    "parameter read-only by a callback as well": node(
        (
            "        limits = {",
            (
                "        if any(param.name == 'joint_name' for param in params):\n            return "
                "SetParametersResult(successful=False, reason='joint_name is fixed')\n        limits = {"
            ),
        )
    ),
    "limits must be finite": node(
        ("import time\n", "import math\nimport time\n"),
        (
            "        if not limits",
            (
                "        if not all(map(math.isfinite, limits.values())):\n            return "
                "SetParametersResult(successful=False, reason='a limit must be finite')\n        if not limits"
            ),
        ),
    ),
    "the integral part kept in units of effort": node(
        ("        self.integral += error * step\n", "        self.part += self.value('ki') * error * step\n"),
        ("self.value('ki') * self.integral", "self.part"),
        ("self.integral = 0.0  # error times seconds", "self.part = 0.0  # in units of effort"),
        ("self.ki, self.integral = param.value, 0.0", "self.ki, self.part = param.value, 0.0"),
    ),
    "numpy, nanoseconds": node(
        ("import rclpy\n", "import numpy as np\nimport rclpy\n"),
        ("time.monotonic()", "time.monotonic_ns() / 1e9"),
        (
            "max(self.value('output_min'), min(self.value('output_max'), effort))",
            "float(np.clip(effort, self.value('output_min'), self.value('output_max')))",
        ),
    ),
}

ONLY_DECLARED = {"defaults", "descriptors"}  # what a node keeps that declares its parameters and does nothing with them
EVERYTHING = {test.id.removeprefix("test_") for test in exercises.load("parameters").tests}
REASON = """                successful=False,
                reason='output_min ({output_min}) must be below output_max ({output_max})'
                .format(**limits))"""
RULE = "if not limits['output_min'] < limits['output_max']:"
CLAMP = "max(self.value('output_min'), min(self.value('output_max'), effort))"
RESET = """            if param.name == 'ki' and param.value != self.ki:
                self.ki, self.integral = param.value, 0.0
"""
READY = "        self.integral = 0.0  # error"  # in __init__, when all is declared
CHECK = "        limits = {name: self"  # the begin of check_parameters


def pre_set(value: str) -> dict[str, bytes]:
    """The reference with a pre-set callback that puts `value` in the place of each parameter `p`."""
    return node(
        ("        self.add_post", "        self.add_pre_set_parameters_callback(self.before)\n        self.add_post"),
        (
            "    def parameters_changed(",
            f"    def before(self, params):\n        return [{value} for p in params]\n\n    def parameters_changed(",
        ),
    )


ANY = (
    "    def value(self, name):",
    (
        "    def declare_any(self, name, default, largest, description):\n"
        "        limits = FloatingPointRange(from_value=0.0, to_value=largest)\n"
        "        self.declare_parameter(name, default, ParameterDescriptor(\n"
        "            description=description, dynamic_typing=True, floating_point_range=[limits]))\n\n"
        "    def value(self, name):"
    ),
)

CLOCK = """
import time
import rclpy
from std_msgs.msg import Float64

started = time.monotonic()

def on_error(message):
    publisher.publish(Float64(data=time.monotonic() - started))

rclpy.init()
node = rclpy.create_node(
    'pid_node', allow_undeclared_parameters=True, automatically_declare_parameters_from_overrides=True)
for name, value in dict(kp=1.0, ki=0.0, kd=0.0, output_min=-10.0, output_max=10.0, joint_name='elbow').items():
    if not node.has_parameter(name):
        node.declare_parameter(name, value)
publisher = node.create_publisher(Float64, 'effort', 10)
node.create_subscription(Float64, 'error', on_error, 10)
rclpy.spin(node)
"""

NOTHING_DECLARED = """
import rclpy
from std_msgs.msg import Float64

rclpy.init()
node = rclpy.create_node('pid_node')
publisher = node.create_publisher(Float64, 'effort', 10)
node.create_subscription(Float64, 'error', lambda message: publisher.publish(Float64(data=0.0)), 10)
rclpy.spin(node)
"""

# What is wrong, and the tests that it loses (without "test_").
WRONG = {
    "another default": (node(("'kp', 1.0", "'kp', 2.0")), {"defaults"}),
    "a limit forgotten": (
        node(
            (
                "        self.declare_parameter('output_min', -10.0)\n",
                "        self.declare_parameter('min_output', -10.0)\n",
            ),
            ("('output_min', 'output_max')}", "('output_max',)} | {'output_min': self.value('min_output')}"),
            ("max(self.value('output_min')", "max(self.value('min_output')"),
        ),
        {"defaults", "clamped", "limits_in_order", "equal_limits", "one_limit", "limits_together"},
    ),
    "no ranges": (node(("floating_point_range=[limits]", "")), {"descriptors", "out_of_range"}),
    "another range": (node(("'ki', 0.0, 50.0", "'ki', 0.0, 100.0")), {"descriptors", "out_of_range"}),
    "range by the callback alone": (
        node(
            (", floating_point_range=[limits]", ""),
            (
                "        limits = {name",
                (
                    "        tops = {'kp': 100.0, 'ki': 50.0, 'kd': 10.0}\n        for p in params:\n"
                    "            if p.name in tops and not 0.0 <= p.value <= tops[p.name]:\n                return "
                    "SetParametersResult(successful=False, reason='out of range')\n        limits = {name"
                ),
            ),
        ),
        {"descriptors"},
    ),
    "joint_name can be set": (
        node((", ParameterDescriptor(read_only=True)", "")),
        {"descriptors", "joint_name_is_read_only"},
    ),
    "time from the start of the node": (
        node(("self.last_time = None", "self.last_time = time.monotonic()")),
        {"first_message"},
    ),
    "the second step is the time from the start of the node": (
        node(
            ("self.last_time = None", "self.last_time, self.first = time.monotonic(), True"),
            ("step = 0.0 if self.last_time is None else", "step = 0.0 if self.first else"),
            (
                "self.last_error, self.last_time = error, now",
                (
                    "self.last_error = error\n"
                    "        if not self.first:\n            self.last_time = now\n        self.first = False"
                ),
            ),
        ),
        {"first_message"},
    ),
    "the first error is not kept": (
        node(
            (
                "self.last_error, self.last_time = error, now",
                "self.last_error = 0.0 if self.last_time is None else error\n        self.last_time = now",
            )
        ),
        {"first_message"},
    ),
    "fixed time steps": (
        node(("step = 0.0 if self.last_time is None else now - self.last_time", "step = 0.1")),
        {"first_message", "integral", "derivative"},
    ),
    "time steps in milliseconds": (
        node(("else now - self.last_time", "else 1000 * (now - self.last_time)")),
        {"integral", "derivative"},
    ),
    "half a second in the place of each step, in both parts": (
        node(
            ("        self.integral += error * step\n", "        self.integral = error / 2\n"),
            (
                "        slope = (error - self.last_error) / step if step > 0.0 else 0.0\n",
                "        slope = error / 2\n",
            ),
        ),
        {
            "first_message",
            "integral",
            "monotonic_clock",
            "derivative",
            "ki_starts_the_integral_again",
            "nothing_else_starts_it_again",
        },
    ),
    "no integral part": (
        node(("        self.integral += error * step\n", "")),
        {"integral", "ki_starts_the_integral_again", "nothing_else_starts_it_again"},
    ),
    "efforts that are no numbers": (node((CLAMP, "float('nan')")), EVERYTHING - ONLY_DECLARED),
    "integral without time": (node(("error * step", "error")), {"first_message", "integral"}),
    "derivative without time": (
        node(("(error - self.last_error) / step if step > 0.0 else 0.0", "error - self.last_error")),
        {"first_message", "derivative"},
    ),
    "derivative the wrong way round": (node(("error - self.last_error", "self.last_error - error")), {"derivative"}),
    "derivative of an error never kept": (
        node(("self.last_error, self.last_time = error, now", "self.last_time = now")),
        {"derivative"},
    ),
    "gains read at the start alone": (
        node(
            (
                "        self.integral = 0.0  #",
                ("        self.gains = {n: self.value(n) for n in ('kp', 'ki', 'kd')}\n        self.integral = 0.0  #"),
            ),
            ("self.value('kp')", "self.gains['kp']"),
            ("self.value('ki') * self.int", "self.gains['ki'] * self.int"),
            ("self.value('kd')", "self.gains['kd']"),
        ),
        {"new_gain", "ki_starts_the_integral_again"},
    ),
    "a new gain counts one message late": (
        node(
            (
                "        error, now = msg",
                ("        gain, self.gain = getattr(self, 'gain', 1.0), self.value('kp')\n        error, now = msg"),
            ),
            ("self.value('kp') * error", "gain * error"),
        ),
        {"new_gain"},
    ),
    "not clamped": (node((CLAMP, "effort")), {"clamped"}),
    "clamped above alone": (node((CLAMP, "min(self.value('output_max'), effort)")), {"clamped"}),
    "a positive effort is clamped by output_max alone, another by output_min alone": (
        node((CLAMP, "min(effort, self.value('output_max')) if effort > 0 else max(effort, self.value('output_min'))")),
        {"clamped"},
    ),
    "an output_max below 0 is taken without its sign": (
        node((CLAMP, CLAMP.replace("self.value('output_max')", "abs(self.value('output_max'))"))),
        {"clamped"},
    ),
    "clamped to the defaults": (node((CLAMP, "max(-10.0, min(10.0, effort))")), {"clamped"}),
    "no rule for the limits": (node((RULE, "if False:")), {"limits_in_order", "equal_limits", "nan_limits", "reasons"}),
    "limits may be equal": (node((RULE, RULE.replace("<", "<="))), {"equal_limits"}),
    "NaN is accepted": (node((RULE, RULE.replace("not ", "").replace("<", ">="))), {"nan_limits"}),
    "NaN is looked for in output_min alone": (
        node(
            (RULE, "if limits['output_min'] != limits['output_min'] or limits['output_min'] >= limits['output_max']:")
        ),
        {"nan_limits"},
    ),
    "NaN is looked for in a limit set alone": (
        node((RULE, "low, high = limits.values()\n        if low >= high or len(params) == 1 and not low < high:")),
        {"nan_limits"},
    ),
    "a NaN is replaced by the stored value": (
        node(
            (
                "            if param.name in limits:\n",
                "            if param.name in limits and param.value == param.value:\n",
            )
        ),
        {"nan_limits"},
    ),
    "the rule looks at both limits or at none": (
        node((CHECK, "        if len(params) < 2:\n            return SetParametersResult(successful=True)\n" + CHECK)),
        {"limits_in_order", "equal_limits", "nan_limits"},
    ),
    "one limit alone is always refused": (
        node(
            (
                CHECK,
                (
                    "        if [p.name for p in params] in (['output_min'], ['output_max']):\n            return "
                    "SetParametersResult(successful=False, reason='set both limits')\n" + CHECK
                ),
            )
        ),
        {"one_limit"},
    ),
    "one limit alone is compared with the default of the other": (
        node(
            (
                "{name: self.value(name) for name in ('output_min', 'output_max')}",
                "{'output_min': -10.0, 'output_max': 10.0}",
            )
        ),
        {"limits_in_order", "equal_limits", "one_limit"},
    ),
    "one limit alone is compared with the other as it was at the start": (
        node(
            (READY, "        self.limits = {n: self.value(n) for n in ('output_min', 'output_max')}\n" + READY),
            ("{name: self.value(name) for name in ('output_min', 'output_max')}", "dict(self.limits)"),
        ),
        {"limits_in_order", "equal_limits", "one_limit"},
    ),
    "a refused limit is remembered for the rule": (
        node(
            (READY, "        self.limits = {n: self.value(n) for n in ('output_min', 'output_max')}\n" + READY),
            ("{name: self.value(name) for name in ('output_min', 'output_max')}", "self.limits"),
        ),
        {"all_or_nothing"},
    ),
    "limits one by one": (
        node(
            ("                limits[param.name] = param.value\n", "                pass\n"),
            (
                RULE,
                (
                    "if any(p.name == 'output_min' and not p.value < limits['output_max'] or\n               p.name == "
                    "'output_max' and not p.value > limits['output_min'] for p in params):"
                ),
            ),
        ),
        {"equal_limits", "limits_together"},
    ),
    "the rule raises": (
        node(("return SetParametersResult(\n" + REASON, "raise ValueError('wrong order')")),
        {"limits_in_order", "equal_limits", "nan_limits", "reasons"},
    ),
    "every set of a gain is refused": (
        node(
            (
                RULE,
                "if {param.name for param in params} & {'kp', 'ki', 'kd'}:\n"
                "            return SetParametersResult(successful=False, reason='not now')\n        " + RULE,
            )
        ),
        {"all_or_nothing", "ki_starts_the_integral_again", "limits_together", "new_gain", "out_of_range"},
    ),
    "gains have no range, and every set of a limit is refused": (
        node(
            (
                "ParameterDescriptor(\n            description=description, floating_point_range=[limits])",
                "ParameterDescriptor()",
            ),
            (RULE, "if {param.name for param in params} & limits.keys():"),
        ),
        {
            "all_or_nothing",
            "clamped",
            "descriptors",
            "equal_limits",
            "limits_in_order",
            "limits_together",
            "nan_limits",
            "one_limit",
            "out_of_range",
            "reasons",
        },
    ),
    "limits in the wrong order are accepted when both are set": (
        node(
            (
                RULE,
                "if len(params) == 2 and limits['output_min'] > limits['output_max']:\n"
                "            return SetParametersResult(successful=True)\n        " + RULE,
            )
        ),
        {"limits_in_order"},
    ),
    "limits may be equal when both are set": (
        node(
            (
                RULE,
                "if len(params) == 2 and limits['output_min'] == limits['output_max']:\n"
                "            return SetParametersResult(successful=True)\n        " + RULE,
            )
        ),
        {"equal_limits"},
    ),
    "no reason": (node((REASON, "                successful=False)")), {"reasons"}),
    "the integral begins at 1": (node((READY, READY.replace("0.0", "1.0"))), {"first_message"}),
    "refuses by returning nothing": (
        node(("            return SetParametersResult(\n" + REASON, "            return None")),
        {"reasons"},
    ),
    "no reason for NaN": (
        node(
            ("reason='output_min", "reason='' if any(map(math.isnan, limits.values())) else 'output_min"),
            ("import time\n", "import math\nimport time\n"),
        ),
        {"reasons"},
    ),
    "a range with a step": (
        node(("to_value=largest)", "to_value=largest, step=0.1)")),
        {"descriptors", "out_of_range"},
    ),
    "the chapter's way: acts while it looks": (
        node((RESET, ""), ("            if param.name in limits:\n", RESET + "            if param.name in limits:\n")),
        {"all_or_nothing"},
    ),
    "gains taken before all are accepted": (
        node(
            ("        self.integral = 0.0  #", "        self.gain = self.value('kp')\n        self.integral = 0.0  #"),
            (
                "            if param.name in limits:\n",
                (
                    "            if param.name == 'kp':\n                self.gain = "
                    "param.value\n            if param.name in limits:\n"
                ),
            ),
            ("self.value('kp') * error", "self.gain * error"),
        ),
        {"all_or_nothing"},
    ),
    "a refused ki is made up for later": (
        node(
            (READY, "        self.again = False\n" + READY),
            (
                "            if param.name in limits:\n",
                (
                    "            if param.name == 'ki' and param.value != self.value('ki'):\n                "
                    "self.again = True\n            if param.name in limits:\n"
                ),
            ),
            (RESET, "            if self.again:\n                self.again, self.integral = False, 0.0\n"),
        ),
        {"all_or_nothing"},
    ),
    "what was refused is applied later": (
        node(
            (READY, "        self.new, self.gain = {}, self.value('kp')\n" + READY),
            (CHECK, "        self.new.update((param.name, param.value) for param in params)\n" + CHECK),
            (
                "        for param in params:\n            self.get",
                "        self.gain = self.new.get('kp', self.gain)\n        for param in params:\n            self.get",
            ),
            ("self.value('kp') * error", "self.gain * error"),
        ),
        {"all_or_nothing"},
    ),
    "acts before it checks, in a pre-set callback": (
        node(
            (RESET, ""),
            (
                "    def parameters_changed(",
                (
                    "    def before(self, params):\n        for param in params:\n"
                    + RESET
                    + "        return params\n\n"
                    "    def parameters_changed("
                ),
            ),
            (
                "        self.add_post",
                "        self.add_pre_set_parameters_callback(self.before)\n        self.add_post",
            ),
        ),
        {"all_or_nothing"},
    ),
    "only the first of several is acted upon": (
        node(
            (
                "        for param in params:\n            self.get",
                "        for param in params[:1]:\n            self.get",
            )
        ),
        {"ki_starts_the_integral_again"},
    ),
    "ki as it was starts the integral again": (
        node((RESET, RESET.replace(" and param.value != self.ki", ""))),
        {"nothing_else_starts_it_again"},
    ),
    "ki is compared with its value at the start": (
        node((RESET, RESET.replace("self.ki, self.integral = param.value, 0.0", "self.integral = 0.0"))),
        {"nothing_else_starts_it_again"},
    ),
    "the node's clock": (node(("time.monotonic()", "self.get_clock().now().nanoseconds / 1e9")), {"monotonic_clock"}),
    "an effort that has not changed is not published": (
        node(
            (READY, "        self.before = None\n" + READY),
            (
                "        self.effort_pub.publish(",
                (
                    "        before, self.before = self.before, effort\n        if effort != before:\n            "
                    "self.effort_pub.publish("
                ),
            ),
        ),
        {"proportional"},
    ),
    "the derivative part is added to the clamped effort": (
        node(
            ("                  + self.value('kd') * slope)", "                  )"),
            ("Float64(data=effort)", "Float64(data=effort + self.value('kd') * slope)"),
        ),
        {"clamped"},
    ),
    "the integral part is added to the clamped effort": (
        node(
            ("self.value('kp') * error + self.value('ki') * self.integral\n", "self.value('kp') * error\n"),
            (CLAMP + "\n", CLAMP + " + self.value('ki') * self.integral\n"),
        ),
        {"clamped"},
    ),
    "the integral part is clamped by itself": (
        node(
            ("self.value('ki') * self.integral\n", CLAMP.replace("effort", "self.value('ki') * self.integral") + "\n")
        ),
        {"clamped"},
    ),
    "the derivative part is clamped by itself": (
        node(("self.value('kd') * slope", CLAMP.replace("effort", "self.value('kd') * slope"))),
        {"clamped"},
    ),
    "the proportional part is clamped by itself": (
        node(("self.value('kp') * error", CLAMP.replace("effort", "self.value('kp') * error"))),
        {"clamped"},
    ),
    "the rule begins with the limits of the defaults": (
        node(
            (READY, "        self.limits = {'output_min': -10.0, 'output_max': 10.0}\n" + READY),
            (
                "limits = {name: self.value(name) for name in ('output_min', 'output_max')}",
                "limits = dict(self.limits)",
            ),
            (
                "            self.get_logger().info(f'{param",
                (
                    "            if param.name in self.limits:\n"
                    "                self.limits[param.name] = param.value\n"
                    "            self.get_logger().info(f'{param"
                ),
            ),
        ),
        {"one_limit"},
    ),
    "efforts rounded to nine decimals": (
        node(("Float64(data=effort)", "Float64(data=round(effort, 9))")),
        {"proportional"},
    ),
    "a kp of 0 counts as none": (
        node(("(self.value('kp') * error", "((self.value('kp') or 1.0) * error")),
        {"proportional", "integral", "derivative"},
    ),
    "a new kd forgets the error before": (
        node(
            (RESET, "            if param.name == 'kd':\n                self.last_error = None\n" + RESET),
            ("if step > 0.0 else", "if step > 0.0 and self.last_error is not None else"),
        ),
        {"derivative"},
    ),
    "the integral waits at the upper limit alone": (
        node(
            (
                "        self.integral += error * step\n",
                """        if self.value('ki') * (self.integral + error * step) <= self.value('output_max'):
            self.integral += error * step
""",
            )
        ),
        {"integral"},
    ),
    "limits must be a thousandth apart": (
        node((RULE, "if not limits['output_max'] - limits['output_min'] >= 0.001:")),
        {"one_limit"},
    ),
    "a limit of 0 counts as none": (
        node((CLAMP, "max(self.value('output_min') or -10.0, min(self.value('output_max') or 10.0, effort))")),
        {"clamped"},
    ),
    "a new ki forgets the error before": (
        node(
            (
                "self.ki, self.integral = param.value, 0.0",
                "self.ki, self.integral, self.last_error = param.value, 0.0, 0.0",
            )
        ),
        {"derivative"},
    ),
    "a new kp forgets the error before": (
        node(
            (
                "            if param.name == 'ki' and",
                """            if param.name == 'kp':
                self.last_error = 0.0
            if param.name == 'ki' and""",
            )
        ),
        {"derivative"},
    ),
    "the slope is limited": (
        node(
            (
                "        self.last_error, self.last_time =",
                "        slope = max(-100.0, min(100.0, slope))\n        self.last_error, self.last_time =",
            )
        ),
        {"derivative"},
    ),
    "the integral is never below 0": (
        node(
            (
                "        self.integral += error * step\n",
                "        self.integral = max(0.0, self.integral + error * step)\n",
            )
        ),
        {"integral"},
    ),
    "a small error counts as none": (
        node(
            (
                "        error, now = msg.data, time.monotonic()\n",
                """        error, now = msg.data, time.monotonic()
        error = error if abs(error) >= 0.01 else 0.0
""",
            )
        ),
        {"integral", "proportional"},
    ),
    "looks at limits that are not declared yet": (
        node(
            (
                "        self.declare_gain('kp', 1.0",
                """        self.add_on_set_parameters_callback(self.check_parameters)
        self.declare_gain('kp', 1.0""",
            ),
            (
                "        self.add_on_set_parameters_callback(self.check_parameters)\n        self.add_post",
                "        self.add_post",
            ),
            (
                "        limits = {name: self.value(name) for name in ('output_min', 'output_max')}",
                """        limits = {'output_min': -10.0, 'output_max': 10.0}
        limits |= {name: self.value(name) for name in limits if self.has_parameter(name)}""",
            ),
        ),
        {"launch_values"},
    ),
    # The rest cannot be judged: the node ends at its start, with whatever values it is started. The public check
    # refuses it.
    "the limits are checked before they are declared": (
        node(
            (
                "        self.declare_gain('kp', 1.0",
                """        self.add_on_set_parameters_callback(self.check_parameters)
        self.declare_gain('kp', 1.0""",
            ),
            (
                "        self.add_on_set_parameters_callback(self.check_parameters)\n        self.add_post",
                "        self.add_post",
            ),
        ),
        EVERYTHING,
    ),
    "integral never starts again": (node((RESET, "")), {"ki_starts_the_integral_again"}),
    "every parameter starts it again": (
        node((RESET, "            self.integral = 0.0\n")),
        {"nothing_else_starts_it_again", "integral"},
    ),
    "no overrides": (node(("rclpy.init(args=args)", "rclpy.init(args=[])")), {"launch_values"}),
    "overrides written over": (
        node(
            (
                "        self.integral = 0.0  #",
                ("        self.set_parameters([rclpy.Parameter('kp', value=1.0)])\n        self.integral = 0.0  #"),
            )
        ),
        {"launch_values"},
    ),
    "overrides shown but not used": (
        node(
            ("        self.integral = 0.0  #", "        self.gain = 1.0\n        self.integral = 0.0  #"),
            (
                "            if param.name == 'ki'",
                (
                    "            if param.name == 'kp':\n                self.gain = "
                    "param.value\n            if param.name == 'ki'"
                ),
            ),
            ("self.value('kp') * error", "self.gain * error"),
        ),
        {"launch_values_are_used"},
    ),
    "limits taken before all are accepted": (
        node(
            ("        self.integral = 0.0  #", "        self.limits = {}\n        self.integral = 0.0  #"),
            (
                "                limits[param.name] = param.value\n",
                ("                limits[param.name] = param.value\n        self.limits = limits\n"),
            ),
            (
                "max(self.value('output_min'), min(self.value('output_max'), effort))",
                "max(self.limits.get('output_min', -10.0), min(self.limits.get('output_max', 10.0), effort))",
            ),
        ),
        {"all_or_nothing"},
    ),
    "no answer to an error of 0": (
        node(("        error, now = msg", ("        if not msg.data:\n            return\n        error, now = msg"))),
        {"proportional"},
    ),
    "another topic": (node(("'effort', 10", "'command', 10")), {"proportional"}),
    "topics in a namespace": (node(("'pid_node')", "'pid_node', namespace='arm')")), {"proportional"}),
    "an effort at its limit is published once": (
        node(
            (READY, "        self.before = None\n" + READY),
            (
                "        self.effort_pub.publish(",
                (
                    "        before, self.before = self.before, effort\n"
                    "        limits = self.value('output_min'), self.value('output_max')\n"
                    "        if effort != before or effort not in limits:\n            self.effort_pub.publish("
                ),
            ),
        ),
        {"proportional"},
    ),
    "kp and kd are taken over after each message": (
        node(
            (READY, "        self.gains = self.value('kp'), self.value('kd')\n" + READY),
            ("        error, now = msg", "        kp, kd = self.gains\n        error, now = msg"),
            ("self.value('kp') * error", "kp * error"),
            ("self.value('kd') * slope", "kd * slope"),
            (
                "        self.effort_pub.publish(",
                "        self.gains = self.value('kp'), self.value('kd')\n        self.effort_pub.publish(",
            ),
        ),
        {"new_gain"},
    ),
    "a limit counts when both have been set": (
        node(
            (READY, "        self.limits = self.value('output_min'), self.value('output_max')\n" + READY),
            (CLAMP, "max(self.limits[0], min(self.limits[1], effort))"),
            (
                "        for param in params:\n            self.get",
                (
                    "        if len({p.name for p in params} & {'output_min', 'output_max'}) == 2:\n"
                    "            self.limits = self.value('output_min'), self.value('output_max')\n"
                    "        for param in params:\n            self.get"
                ),
            ),
        ),
        {"clamped"},
    ),
    "the first step is a hundredth of a second": (node(("step = 0.0 if", "step = 0.01 if")), {"first_message"}),
    "the first error is answered with 0": (
        node(
            ("        self.last_error, self.last_time = error, now\n", ""),
            (
                "        self.effort_pub.publish(",
                (
                    "        if self.last_time is None:\n            effort = 0.0\n"
                    "        self.last_error, self.last_time = error, now\n        self.effort_pub.publish("
                ),
            ),
        ),
        {"first_message"},
    ),
    "the integral has limits": (
        node(
            ("self.integral += error * step", "self.integral = max(-500.0, min(500.0, self.integral + error * step))")
        ),
        {"integral"},
    ),
    "the integral stops after some clamped efforts": (
        node(
            (
                "        self.integral += error * step",
                "        self.integral += 0.0 if self.held > 3 else error * step",
            ),
            (
                "        self.effort_pub.publish(",
                (
                    "        held = effort in (self.value('output_min'), self.value('output_max'))\n"
                    "        self.held = self.held + 1 if held else 0\n        self.effort_pub.publish("
                ),
            ),
            ("        self.last_error = 0.0\n", "        self.last_error = 0.0\n        self.held = 0\n"),
        ),
        {"integral"},
    ),
    "a step of more than 2 s counts as 2 s": (
        node(("self.integral += error * step", "self.integral += error * min(step, 2.0)")),
        {"integral"},
    ),
    "efforts rounded to two decimals": (
        node(("Float64(data=effort)", "Float64(data=round(effort, 2))")),
        {"proportional", "integral"},
    ),
    "efforts cut off after two decimals": (
        node(("Float64(data=effort)", "Float64(data=int(100 * effort) / 100)")),
        {"proportional", "integral"},
    ),
    "a ki that is changed by little leaves the integral": (
        node(("param.value != self.ki:", "abs(param.value - self.ki) > 0.001:")),
        {"ki_starts_the_integral_again"},
    ),
    "limits above 1e7 are refused": (
        node((RULE, RULE.removesuffix(":") + " or limits['output_max'] > 1e7:")),
        {"limits_together"},
    ),
    "a set of more than three parameters is compared with the old output_min": (
        node(
            (
                RULE,
                "limits['output_min'] = self.value('output_min') if len(params) > 3 else limits['output_min']\n        "
                + RULE,
            )
        ),
        {"limits_together"},
    ),
    "trapezoids": (
        node(("self.integral += error * step", "self.integral += (error + self.last_error) / 2 * step")),
        {"integral"},
    ),
    "the integral grows by the error before": (
        node(("self.integral += error * step", "self.integral += self.last_error * step")),
        {"integral"},
    ),
    "the integral grows after the effort is computed": (
        node(
            ("        self.integral += error * step\n", ""),
            (
                "        self.effort_pub.publish(",
                "        self.integral += error * step\n        self.effort_pub.publish(",
            ),
        ),
        {"integral", "ki_starts_the_integral_again"},
    ),
    "a message whose effort is clamped is not kept": (
        node(
            ("        self.last_error, self.last_time = error, now\n", ""),
            (
                "        effort = " + CLAMP,
                "        if self.value('output_min') <= effort <= self.value('output_max'):\n"
                "            self.last_error, self.last_time = error, now\n"
                "        effort = " + CLAMP,
            ),
        ),
        {"derivative", "integral"},
    ),
    "the error of a message whose effort is clamped is not kept": (
        node(
            ("self.last_error, self.last_time = error, now\n", "self.last_time = now\n"),
            (
                "        effort = " + CLAMP,
                "        if self.value('output_min') <= effort <= self.value('output_max'):\n"
                "            self.last_error = error\n"
                "        effort = " + CLAMP,
            ),
        ),
        {"derivative"},
    ),
    "kp is read by a timer, five times a second": (
        node(
            (READY, "        self.read()\n        self.create_timer(0.2, self.read)\n" + READY),
            (
                "    def value(self, name):",
                "    def read(self):\n        self.gain = self.value('kp')\n\n    def value(self, name):",
            ),
            ("self.value('kp') * error", "self.gain * error"),
        ),
        {"new_gain"},
    ),
    "a new output_max counts one message late": (
        node(
            (
                "        error, now = msg",
                (
                    "        most, self.most = getattr(self, 'most', 10.0), self.value('output_max')\n"
                    "        error, now = msg"
                ),
            ),
            (CLAMP, CLAMP.replace("self.value('output_max')", "most")),
        ),
        {"clamped"},
    ),
    "the integral waits while the effort is clamped": (
        node(
            (
                "        effort = max(",
                (
                    "        if not self.value('output_min') <= effort <= self.value('output_max'):\n"
                    "            self.integral -= error * step\n        effort = max("
                ),
            )
        ),
        {"integral"},
    ),
    "the integral is kept within the limits": (
        node(
            (
                "        slope =",
                (
                    "        low, high = self.value('output_min'), self.value('output_max')\n"
                    "        self.integral = max(low, min(high, self.integral))\n"
                    "        slope ="
                ),
            )
        ),
        {"integral"},
    ),
    "the node's clock for the slope": (
        node(
            (READY, "        self.last_stamp = 0.0\n" + READY),
            (
                "        slope = (error - self.last_error) / step if step > 0.0 else 0.0\n",
                (
                    "        stamp = self.get_clock().now().nanoseconds / 1e9\n"
                    "        gap, self.last_stamp = stamp - self.last_stamp, stamp\n"
                    "        slope = (error - self.last_error) / gap if gap > 0.0 and step > 0.0 else 0.0\n"
                ),
            ),
        ),
        {"monotonic_clock"},
    ),
    "no time passes while use_sim_time is set": (
        node(
            (
                "        self.integral +=",
                "        step = 0.0 if self.value('use_sim_time') else step\n        self.integral +=",
            )
        ),
        {"monotonic_clock"},
    ),
    "half of the slope": (node(("self.value('kd') * slope", "self.value('kd') * slope / 2")), {"derivative"}),
    "a new ki forgets the message before": (
        node(
            (
                RESET,
                RESET.replace(
                    "self.ki, self.integral = param.value, 0.0",
                    "self.ki, self.integral, self.last_time = param.value, 0.0, None",
                ),
            )
        ),
        {"derivative", "ki_starts_the_integral_again"},
    ),
    "a new ki starts again only when it is larger": (
        node(
            (
                RESET,
                RESET.replace("!=", ">").replace(
                    "                self.ki, self.integral = param.value, 0.0\n",
                    "                self.integral = 0.0\n            if param.name == 'ki':\n"
                    "                self.ki = param.value\n",
                ),
            )
        ),
        {"ki_starts_the_integral_again"},
    ),
    "ki is compared with its default": (
        node(("self.ki = self.value('ki')", "self.ki = 0.0")),
        {"nothing_else_starts_it_again"},
    ),
    "an output_max below output_min is accepted when set alone": (
        node(
            (
                CHECK,
                "        low = self.value('output_min')\n"
                "        if [p.name for p in params] == ['output_max'] and params[0].value < low:\n"
                "            return SetParametersResult(successful=True)\n" + CHECK,
            )
        ),
        {"limits_in_order"},
    ),
    "an output_min above output_max is accepted together with a gain": (
        node(
            (
                CHECK,
                "        new = {p.name for p in params}\n"
                "        if {'kp', 'ki', 'kd'} & new and 'output_max' not in new:\n"
                "            return SetParametersResult(successful=True)\n" + CHECK,
            )
        ),
        {"limits_in_order", "nan_limits"},
    ),
    "one limit alone must be on its side of 0": (
        node(
            (
                CHECK,
                "        if len(params) == 1 and (params[0].name == 'output_min' and params[0].value > 0 or\n"
                "                                 params[0].name == 'output_max' and params[0].value < 0):\n"
                "            return SetParametersResult(successful=False, reason='wrong sign')\n" + CHECK,
            )
        ),
        {"one_limit"},
    ),
    "a limit may not be set to the value that it has": (
        node(
            (
                CHECK,
                "        one = params[0]\n"
                "        if len(params) == 1 and one.name[:6] == 'output' and one.value == self.value(one.name):\n"
                "            return SetParametersResult(successful=False, reason='no change')\n" + CHECK,
            )
        ),
        {"one_limit"},
    ),
    "the rule looks after each limit of a set": (
        node(
            (
                "                limits[param.name] = param.value\n",
                (
                    "                limits[param.name] = param.value\n"
                    "                if not limits['output_min'] < limits['output_max']:\n"
                    "                    break\n"
                ),
            )
        ),
        {"limits_together"},
    ),
    "both limits are compared with the stored ones too": (
        node(
            (
                CHECK,
                "        new = {p.name: p.value for p in params}\n"
                "        if (len({'output_min', 'output_max'} & set(new)) == 2 and (\n"
                "                new['output_min'] >= self.value('output_max')\n"
                "                or new['output_max'] <= self.value('output_min'))):\n"
                "            return SetParametersResult(successful=False, reason='beyond the old limits')\n" + CHECK,
            )
        ),
        {"limits_together"},
    ),
    "limits beyond the old ones only when nothing else is set": (
        node(
            (
                CHECK,
                "        new = {p.name: p.value for p in params}\n"
                "        if (len(new) == 3 and len({'output_min', 'output_max'} & set(new)) == 2 and (\n"
                "                new['output_min'] >= self.value('output_max')\n"
                "                or new['output_max'] <= self.value('output_min'))):\n"
                "            return SetParametersResult(successful=False, reason='beyond the old limits')\n" + CHECK,
            )
        ),
        {"limits_together"},
    ),
    "a refused gain, set alone, is used": (
        node(
            (READY, "        self.gain = self.value('kp')\n" + READY),
            ("self.value('kp') * error", "self.gain * error"),
            (
                "    def parameters_changed(",
                (
                    "    def before(self, params):\n        if len(params) == 1 and params[0].name == 'kp':\n"
                    "            self.gain = params[0].value\n        return params\n\n    def parameters_changed("
                ),
            ),
            (
                "        for param in params:\n            self.get",
                "        self.gain = self.value('kp')\n        for param in params:\n            self.get",
            ),
            (
                "        self.add_post",
                "        self.add_pre_set_parameters_callback(self.before)\n        self.add_post",
            ),
        ),
        {"all_or_nothing"},
    ),
    "what was refused is used half a second later": (
        node(
            ("import time\n", "import threading\nimport time\n"),
            (
                "        return self.get_parameter(name).value",
                "        return getattr(self, 'late', {}).get(name, self.get_parameter(name).value)",
            ),
            (
                "  # so NaN is refused too\n",
                """
            late = {p.name: p.value for p in params if p.name in ('kp', 'ki', 'kd')}
            threading.Timer(0.4, self.take, [late]).start()
""",
            ),
            (
                "    def parameters_changed(self, params):\n",
                """    def take(self, late):
        self.late = late

    def parameters_changed(self, params):
        self.late = {}
""",
            ),
        ),
        {"all_or_nothing"},
    ),
    "joint_name is refused by the callback alone": (
        node(
            (", ParameterDescriptor(read_only=True)", ""),
            (
                CHECK,
                "        if any(p.name == 'joint_name' for p in params):\n            return "
                "SetParametersResult(successful=False, reason='joint_name is fixed')\n" + CHECK,
            ),
        ),
        {"descriptors"},
    ),
    "a new joint_name is accepted and ignored": (
        pre_set("rclpy.Parameter('kp', value=self.value('kp')) if p.name == 'joint_name' else p"),
        {"joint_name_is_read_only"},
    ),
    "a new joint_name ends the node": (pre_set("p if p.name != 'joint_name' else 1 / 0"), {"joint_name_is_read_only"}),
    "parameter files are ignored": (
        node(
            (
                "rclpy.init(args=args)",
                (
                    "args = sys.argv[:]\n    if '--params-file' in args:\n        at = args.index('--params-file')\n"
                    "        del args[at:at + 2]\n    rclpy.init(args=args)"
                ),
            ),
            ("import time\n", "import sys\nimport time\n"),
        ),
        {"launch_values"},
    ),
    "the limits of the launch are shown but not used": (
        node(
            (READY, "        self.limits = -10.0, 10.0\n" + READY),
            (CLAMP, "max(self.limits[0], min(self.limits[1], effort))"),
            (
                "        for param in params:\n            self.get",
                (
                    "        if {p.name for p in params} & {'output_min', 'output_max'}:\n"
                    "            self.limits = self.value('output_min'), self.value('output_max')\n"
                    "        for param in params:\n            self.get"
                ),
            ),
        ),
        {"launch_values_are_used"},
    ),
    "the ki of the launch is shown but not used": (
        node(
            (READY, "        self.gain = 0.0\n" + READY),
            ("self.value('ki') * self.integral", "self.gain * self.integral"),
            (
                "        for param in params:\n            self.get",
                (
                    "        self.gain = self.value('ki') if any(p.name == 'ki' for p in params) else self.gain\n"
                    "        for param in params:\n            self.get"
                ),
            ),
        ),
        {"launch_values_are_used"},
    ),
    **{
        f"another default of {name}": (node((old, new)), {"defaults"})
        for name, old, new in (
            ("ki", "'ki', 0.0,", "'ki', 0.5,"),
            ("kd", "'kd', 0.0,", "'kd', 0.5,"),
            ("output_min", "'output_min', -10.0)", "'output_min', -5.0)"),
            ("output_max", "'output_max', 10.0)", "'output_max', 100.0)"),
            ("joint_name", "'elbow'", "'wrist'"),
        )
    },
    **{
        f"{name} takes values of any type": (
            node(
                (f"self.declare_gain('{name}', {default}, {top}, ", f"self.declare_any('{name}', {default}, {top}, "),
                ANY,
            ),
            {"defaults"},
        )
        for name, default, top in (("kp", 1.0, 100.0), ("ki", 0.0, 50.0), ("kd", 0.0, 10.0))
    },
    **{
        f"{name} takes values of any type": (
            node((f"'{name}', {default})", f"'{name}', {default}, ParameterDescriptor(dynamic_typing=True))")),
            {"defaults"},
        )
        for name, default in (("output_min", -10.0), ("output_max", 10.0))
    },
    "no joint by default": (node(("'elbow'", "''")), {"defaults"}),
    **{
        f"{name} is clipped to its range": (
            pre_set(
                f"rclpy.Parameter('{name}', value=min(max(p.value, 0.0), {top}))\n"
                f"                if p.name == '{name}' and isinstance(p.value, float) else p"
            ),
            {"out_of_range"},
        )
        for name, top in (("kp", 100.0), ("ki", 50.0), ("kd", 10.0))
    },
    **{
        f"{name} may not be at the end of its range": (
            node(
                (
                    CHECK,
                    f"        if any(p.name == '{name}' and p.value >= {top} for p in params):\n            return "
                    "SetParametersResult(successful=False, reason='too large')\n" + CHECK,
                )
            ),
            {"out_of_range"},
        )
        for name, top in (("kp", 100.0), ("ki", 50.0), ("kd", 10.0))
    },
    "ki off and on again does not start the integral again": (
        node(("param.name == 'ki' and", "param.name == 'ki' and param.value and")),
        {"ki_starts_the_integral_again"},
    ),
    "the ki that the integral was begun with is not that of the launch": (
        node(
            ("self.ki = self.value('ki')", "self.ki = 0.0"),
            (
                RESET,
                (
                    "        if self.value('ki') != self.ki:\n"
                    "            self.ki, self.integral = self.value('ki'), 0.0\n"
                ),
            ),
        ),
        {"nothing_else_starts_it_again"},
    ),
    "a limit of 0 counts as not asked for": (
        node(("            if param.name in limits:\n", "            if param.name in limits and param.value:\n")),
        {"limits_in_order"},
    ),
    "the limits have a range": (
        node(
            *(
                (
                    f"'{name}', {default})",
                    (
                        f"'{name}', {default}, ParameterDescriptor(floating_point_range=[\n"
                        "            FloatingPointRange(from_value=-1000.0, to_value=1000.0)]))"
                    ),
                )
                for name, default in (("output_min", -10.0), ("output_max", 10.0))
            )
        ),
        {"limits_together"},
    ),
    "a kd of a refused set is used": (
        node(
            (READY, "        self.kd = self.value('kd')\n" + READY),
            (
                "            if param.name in limits:\n",
                (
                    "            if param.name == 'kd':\n                self.kd = param.value\n"
                    "            if param.name in limits:\n"
                ),
            ),
            ("self.value('kd') * slope", "self.kd * slope"),
        ),
        {"all_or_nothing"},
    ),
    "the integral waits from a refused set to the next accepted one": (
        node(
            (READY, "        self.changing = False\n" + READY),
            (
                "        self.add_post",
                "        self.add_pre_set_parameters_callback(self.before)\n        self.add_post",
            ),
            (
                "        for param in params:\n            self.get",
                "        self.changing = False\n        for param in params:\n            self.get",
            ),
            (
                "    def parameters_changed(",
                (
                    "    def before(self, params):\n        self.changing = True\n        return params\n\n"
                    "    def parameters_changed("
                ),
            ),
            (
                "        self.integral += error * step\n",
                "        self.integral += 0.0 if self.changing else error * step\n",
            ),
        ),
        {"all_or_nothing"},
    ),
    "a gain that is given at launch has no range": (
        node(
            (
                "super().__init__('pid_node')",
                "super().__init__('pid_node', automatically_declare_parameters_from_overrides=True)",
            ),
            (
                "        limits = FloatingPointRange(",
                "        if self.has_parameter(name):\n            return\n        limits = FloatingPointRange(",
            ),
            ("'output_min', -10.0)", "'output_min', -10.0) if not self.has_parameter('output_min') else None"),
            ("'output_max', 10.0)", "'output_max', 10.0) if not self.has_parameter('output_max') else None"),
            ("        joint = self.declare", "        joint = self.has_parameter('joint_name') or self.declare"),
            ("ParameterDescriptor(read_only=True)).value", "ParameterDescriptor(read_only=True))"),
        ),
        {"descriptors"},
    ),
    "a new ki counts one message late": (
        node(
            (
                "        error, now = msg",
                "        gain, self.gain = getattr(self, 'gain', self.ki), self.ki\n        error, now = msg",
            ),
            ("self.value('ki') * self.integral", "gain * self.integral"),
        ),
        {"new_gain", "ki_starts_the_integral_again"},
    ),
    "a new kd counts one message late": (
        node(
            (
                "        error, now = msg",
                (
                    "        steep, self.steep = getattr(self, 'steep', self.value('kd')), self.value('kd')\n"
                    "        error, now = msg"
                ),
            ),
            ("self.value('kd') * slope", "steep * slope"),
        ),
        {"new_gain"},
    ),
    "of several gains set together the first one counts": (
        node(
            (
                "        self.integral = 0.0  #",
                ("        self.gains = {n: self.value(n) for n in ('kp', 'ki', 'kd')}\n        self.integral = 0.0  #"),
            ),
            (
                "        for param in params:\n            self.get",
                (
                    "        for param in params:\n            if param.name in self.gains:\n"
                    "                self.gains[param.name] = param.value\n                break\n"
                    "        for param in params:\n            self.get"
                ),
            ),
            ("self.value('kp')", "self.gains['kp']"),
            ("self.value('kd')", "self.gains['kd']"),
        ),
        {"new_gain"},
    ),
    "a new kp is answered with an effort": (
        node(
            (
                RESET,
                RESET + "            if param.name == 'kp':\n"
                "                self.effort_pub.publish(Float64(data=param.value * self.last_error))\n",
            )
        ),
        {"proportional"},
    ),
    "the first effort is not clamped": (node((CLAMP, "effort if step == 0.0 else " + CLAMP)), {"clamped"}),
    "an error before of 0 counts as none": (
        node(
            (
                "if step > 0.0 else 0.0\n        self.last",
                "if step > 0.0 and self.last_error else 0.0\n        self.last",
            )
        ),
        {"derivative"},
    ),
    "the error before is kept only while kd is above 0": (
        node(
            (
                "self.last_error, self.last_time = error, now",
                "self.last_time = now\n        self.last_error = error if self.value('kd') else self.last_error",
            )
        ),
        {"derivative"},
    ),
    "the time is kept only while ki or kd is above 0": (
        node(
            (
                "self.last_error, self.last_time = error, now",
                (
                    "self.last_error = error\n"
                    "        if self.last_time is None or self.value('ki') or self.value('kd'):\n"
                    "            self.last_time = now"
                ),
            )
        ),
        {"derivative"},
    ),
    "no slope in a step below 10 ms": (node(("if step > 0.0", "if step > 0.01")), {"derivative"}),
    "a step of a second at most": (
        node(("self.integral += error * step", "self.integral += error * min(step, 1.0)")),
        {"integral"},
    ),
    "a step of more than a second counts as none": (
        node(
            (
                "        self.integral += error * step\n",
                "        self.integral += error * step if step <= 1.0 else 0.0\n",
            )
        ),
        {"integral"},
    ),
    "the integral of the last 50 messages alone": (
        node(
            (READY, "        self.window = []\n" + READY),
            (
                "        self.integral += error * step\n",
                "        self.window = [*self.window[-49:], error * step]\n        self.integral = sum(self.window)\n",
            ),
            ("self.ki, self.integral = param.value, 0.0", "self.ki, self.integral, self.window = param.value, 0.0, []"),
        ),
        {"integral"},
    ),
    "a ki set from 0 leaves the integral as it is": (
        node((RESET, RESET.replace("0.0\n", "0.0 if self.ki else self.integral\n"))),
        {"ki_starts_the_integral_again"},
    ),
    "an integral below 0 does not start again": (
        node((RESET, RESET.replace("0.0\n", "min(0.0, self.integral)\n"))),
        {"ki_starts_the_integral_again"},
    ),
    "only the first three changes of ki start the integral again": (
        node(
            (READY, "        self.changes = 0\n" + READY),
            (
                RESET,
                """            if param.name == 'ki' and param.value != self.ki and self.changes < 3:
                self.changes += 1
                self.ki, self.integral = param.value, 0.0
""",
            ),
        ),
        {"ki_starts_the_integral_again"},
    ),
    "a refused set of limits freezes kp": (
        node(
            (READY, "        self.frozen = None\n" + READY),
            (
                "            return SetParametersResult(\n" + REASON,
                "            self.frozen = self.value('kp')\n            return SetParametersResult(\n" + REASON,
            ),
            ("(self.value('kp') * error", "((self.value('kp') if self.frozen is None else self.frozen) * error"),
        ),
        {"all_or_nothing"},
    ),
    "no slope in a step of more than a second": (
        node(("if step > 0.0 else", "if 0.0 < step <= 1.0 else")),
        {"derivative"},
    ),
    "the first effort is by the kp of the start": (
        node(
            (READY, "        self.first = self.value('kp')\n" + READY),
            ("(self.value('kp') * error", "((self.value('kp') if step > 0.0 else self.first) * error"),
        ),
        {"new_gain"},
    ),
    "limits must be more than 1e-7 apart": (
        node((RULE, "if not limits['output_max'] - limits['output_min'] > 1e-7:")),
        {"one_limit"},
    ),
    "limits that are not in order are accepted together with kd": (
        node((RULE, RULE.removesuffix(":") + " and 'kd' not in {param.name for param in params}:")),
        {"limits_in_order", "nan_limits"},
    ),
    "one limit is refused when a gain is set with it": (
        node(
            (
                CHECK,
                "        if {p.name in limited for p in params} == {True, False} and len(params) == 2:\n"
                "            return SetParametersResult(successful=False, reason='one by one')\n" + CHECK,
            ),
            (
                "    def check_parameters(self, params):\n",
                "    def check_parameters(self, params):\n        limited = 'output_min', 'output_max'\n",
            ),
        ),
        {"one_limit"},
    ),
    "the integral takes a small error for none": (
        node(("self.integral += error * step", "self.integral += error * step if abs(error) >= 0.01 else 0.0")),
        {"integral"},
    ),
    "limits may be equal when kp is set with them": (
        node(
            (
                RULE,
                "if {p.name for p in params} == {'kp', *limits} and limits['output_min'] == limits['output_max']:\n"
                "            return SetParametersResult(successful=True)\n        " + RULE,
            )
        ),
        {"equal_limits"},
    ),
    "use_sim_time starts the integral again": (
        node(
            (
                RESET,
                """            if param.name == 'use_sim_time' or param.name == 'ki' and param.value != self.ki:
                self.ki, self.integral = self.value('ki'), 0.0
""",
            )
        ),
        {"nothing_else_starts_it_again"},
    ),
    "the integral stays within a million": (
        node(("self.integral += error * step", "self.integral = max(-1e6, min(1e6, self.integral + error * step))")),
        {"integral"},
    ),
    "an error above a million counts as a million": (
        node(("error, now = msg.data", "error, now = max(-1e6, min(1e6, msg.data))")),
        {"integral"},
    ),
    "a kp of a refused set of limits is used 3 s later": (
        node(
            (READY, "        self.late = None\n" + READY),
            (
                "            return SetParametersResult(\n" + REASON,
                (
                    "            wanted = {param.name: param.value for param in params}\n"
                    "            if 'kp' in wanted:\n"
                    "                self.late = time.monotonic() + 3.0, wanted['kp']\n"
                    "            return SetParametersResult(\n" + REASON
                ),
            ),
            (
                "(self.value('kp') * error",
                "((self.late[1] if self.late and now > self.late[0] else self.value('kp')) * error",
            ),
        ),
        {"all_or_nothing"},
    ),
    "right parameters, and no efforts": (
        node(("        self.effort_pub.publish(Float64(data=effort))\n", "")),
        EVERYTHING - ONLY_DECLARED,
    ),
    "right parameters, and every effort is 0": (node((CLAMP, "0.0")), EVERYTHING - ONLY_DECLARED),
    "right parameters, and every effort is infinite": (node((CLAMP, "float('inf')")), EVERYTHING - ONLY_DECLARED),
    "right parameters, and every effort is kp": (node((CLAMP, "self.value('kp')")), EVERYTHING - ONLY_DECLARED),
    "right parameters, and every effort is kp as it was given at launch": (
        node((READY, "        self.kp = self.value('kp')\n" + READY), (CLAMP, "self.kp")),
        EVERYTHING - ONLY_DECLARED,
    ),
    "right parameters, and the effort is the error": (node((CLAMP, "error")), EVERYTHING - ONLY_DECLARED),
    "accepts everything, and the effort is the time": ({NODE: CLOCK.encode()}, EVERYTHING - {"defaults"}),
    "accepts everything, and the effort is the error": (
        {NODE: CLOCK.replace("time.monotonic() - started", "message.data").encode()},
        EVERYTHING - {"defaults"},
    ),
    "refuses everything, and every effort is 0": (node((CLAMP, "0.0"), (RULE, "if True:")), EVERYTHING - ONLY_DECLARED),
    "declares nothing": ({NODE: NOTHING_DECLARED.encode()}, EVERYTHING),
    # The rest is not judged: another name can be remapped when a node is started, another type cannot, and nothing that
    # hears efforts by the task hears these. The public check refuses it.
    "Float32 efforts": (
        node(
            ("(Float64, 'effort'", "(Float32, 'effort'"),
            ("Float64(data=effort)", "Float32(data=effort)"),
            ("import Float64", "import Float32, Float64"),
        ),
        EVERYTHING - ONLY_DECLARED,
    ),
}
NOTHING = {
    "efforts that are no numbers",
    "right parameters, and no efforts",
    "right parameters, and every effort is 0",
    "right parameters, and every effort is infinite",
    "right parameters, and every effort is kp",
    "right parameters, and every effort is kp as it was given at launch",
    "right parameters, and the effort is the error",
    "accepts everything, and the effort is the time",
    "accepts everything, and the effort is the error",
    "refuses everything, and every effort is 0",
    "declares nothing",
}  # they do nothing of what is asked for, but for what stands in their declarations
SEVERAL = {  # more than one mistake
    "gains have no range, and every set of a limit is refused",
    "half a second in the place of each step, in both parts",
}
USELESS = {
    "Float32 efforts",  # nobody hears them
    "the limits are checked before they are declared",  # the node ends at its start
}
ABOUT = {
    "what was refused is used half a second later",
    "gains read at the start alone",
    "no rule for the limits",
    "the rule raises",
    "the chapter's way: acts while it looks",
    "gains taken before all are accepted",
    "a refused ki is made up for later",
    "what was refused is applied later",
    "acts before it checks, in a pre-set callback",
    "a refused gain, set alone, is used",
    "limits taken before all are accepted",
    "a refused limit is remembered for the rule",
    "a kd of a refused set is used",
    "the integral waits from a refused set to the next accepted one",
    "a new ki counts one message late",
}
DETAIL = {
    "efforts rounded to nine decimals",
    "efforts rounded to two decimals",
    "efforts cut off after two decimals",
    "another default",
    "another range",
    "range by the callback alone",
    "a range with a step",
    "joint_name can be set",
    "joint_name is refused by the callback alone",
    "time from the start of the node",
    "limits may be equal",
    "NaN is accepted",
    "no reason",
    "refuses by returning nothing",
    "the integral begins at 1",
    "no reason for NaN",
    "ki as it was starts the integral again",
    "the node's clock",
    "an effort that has not changed is not published",
    "the integral waits while the effort is clamped",
    "limits must be a thousandth apart",
    "trapezoids",
    "half of the slope",
    "another topic",
    "parameter files are ignored",
    "overrides shown but not used",
    "the limits have a range",
    "a gain that is given at launch has no range",
    "a new kp is answered with an effort",
    "an error before of 0 counts as none",
    "no slope in a step below 10 ms",
    "a step of a second at most",
}
BROAD = {"every set of a gain is refused", "a limit forgotten"}
SILENT = {
    "no answer to an error of 0",
    "an effort that has not changed is not published",
    "an effort at its limit is published once",
    "another topic",
    "topics in a namespace",
    "right parameters, and no efforts",
    "Float32 efforts",
}  # the grader waits for these in vain
# Judged by the whole suite in every run of the tests: what is right, and partial credit of each kind.
QUICK = {"reference", "a limit forgotten"}

# Judged as one program each in every run of the tests, see the package.
TOGETHER = [
    {
        "another default",
        "range by the callback alone",
        "time from the start of the node",
        "derivative the wrong way round",
        "not clamped",
        "limits may be equal",
        "no reason",
        "only the first of several is acted upon",
        "ki as it was starts the integral again",
        "a new joint_name is accepted and ignored",
    },
    {
        "one limit alone is always refused",
        "the node's clock",
        "efforts rounded to nine decimals",
        "the integral waits at the upper limit alone",
        "overrides shown but not used",
        "kp is clipped to its range",
    },
    {
        "a refused limit is remembered for the rule",
        "limits in the wrong order are accepted when both are set",
        "a new gain counts one message late",
    },
    {"looks at limits that are not declared yet", "limits above 1e7 are refused"},
]
