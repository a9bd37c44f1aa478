"""Answers to the exercise on parameters."""

from . import changed, solution

NODE = "pid_node.py"
REFERENCE = solution("parameters")


def node(*pairs: tuple[str, str]) -> dict[str, bytes]:
    """The reference with some texts replaced."""
    return changed(REFERENCE, NODE, *pairs)


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
        self.integral += (error + before) / 2 * dt  # trapezoids
        raw = self.kp * error + self.ki * self.integral + (self.kd * (error - before) / dt if dt else 0.0)
        if raw > self.output_max:
            self.integral -= (error + before) / 2 * dt  # no windup
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
                    self.pid.integral, self.pid.last = 0.0, None
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

RIGHT = {
    "reference": REFERENCE,
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

ALL_EFFORTS = {
    "first_message",
    "proportional",
    "new_gain",
    "clamped",
    "integral",
    "monotonic_clock",
    "derivative",
    "ki_starts_the_integral_again",
    "nothing_else_starts_it_again",
    "all_or_nothing",
    "command_line",
    "parameter_file",
}
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
        {"defaults", "clamped", "limits_in_order", "one_limit", "limits_together", "command_line", "parameter_file"},
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
    "fixed time steps": (
        node(("step = 0.0 if self.last_time is None else now - self.last_time", "step = 0.1")),
        {"first_message", "integral", "derivative"},
    ),
    "time steps in milliseconds": (
        node(("else now - self.last_time", "else 1000 * (now - self.last_time)")),
        {"integral", "derivative"},
    ),
    "no integral part": (
        node(("        self.integral += error * step\n", "")),
        {"integral", "ki_starts_the_integral_again", "nothing_else_starts_it_again", "all_or_nothing"},
    ),
    "efforts that are no numbers": (node((CLAMP, "float('nan')")), ALL_EFFORTS - {"monotonic_clock"}),
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
        {
            "first_message",
            "proportional",
            "new_gain",
            "clamped",
            "integral",
            "derivative",
            "ki_starts_the_integral_again",
            "nothing_else_starts_it_again",
            "all_or_nothing",
        },
    ),
    "a new gain counts one message late": (
        node(
            (
                "        error, now = msg",
                ("        gain, self.gain = getattr(self, 'gain', 1.0), self.value('kp')\n        error, now = msg"),
            ),
            ("self.value('kp') * error", "gain * error"),
        ),
        {"first_message", "proportional", "new_gain", "command_line", "parameter_file"},
    ),
    "not clamped": (node((CLAMP, "effort")), {"clamped"}),
    "clamped above alone": (node((CLAMP, "min(self.value('output_max'), effort)")), {"clamped"}),
    "clamped to the defaults": (node((CLAMP, "max(-10.0, min(10.0, effort))")), {"clamped"}),
    "no rule for the limits": (node((RULE, "if False:")), {"limits_in_order", "nan_limits"}),
    "limits may be equal": (node((RULE, RULE.replace("<", "<="))), {"limits_in_order"}),
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
        {"limits_in_order", "nan_limits"},
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
        {"limits_in_order", "one_limit"},
    ),
    "one limit alone is compared with the other as it was at the start": (
        node(
            (READY, "        self.limits = {n: self.value(n) for n in ('output_min', 'output_max')}\n" + READY),
            ("{name: self.value(name) for name in ('output_min', 'output_max')}", "dict(self.limits)"),
        ),
        {"limits_in_order", "one_limit"},
    ),
    "a refused limit is remembered for the rule": (
        node(
            (READY, "        self.limits = {n: self.value(n) for n in ('output_min', 'output_max')}\n" + READY),
            ("{name: self.value(name) for name in ('output_min', 'output_max')}", "self.limits"),
        ),
        {"one_limit"},
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
        {"limits_in_order", "limits_together"},
    ),
    "the rule raises": (
        node(("return SetParametersResult(\n" + REASON, "raise ValueError('wrong order')")),
        {"limits_in_order", "one_limit", "nan_limits", "all_or_nothing"},
    ),
    "no reason": (node((REASON, "                successful=False)")), {"limits_in_order"}),
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
    "integral never starts again": (node((RESET, "")), {"ki_starts_the_integral_again"}),
    "every parameter starts it again": (
        node((RESET, "            self.integral = 0.0\n")),
        {"nothing_else_starts_it_again"},
    ),
    "no overrides": (node(("rclpy.init(args=args)", "rclpy.init(args=[])")), {"command_line", "parameter_file"}),
    "overrides written over": (
        node(
            (
                "        self.integral = 0.0  #",
                ("        self.set_parameters([rclpy.Parameter('kp', value=1.0)])\n        self.integral = 0.0  #"),
            )
        ),
        {"command_line", "parameter_file"},
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
        {"command_line", "parameter_file"},
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
    "another topic": (node(("'effort', 10", "'command', 10")), ALL_EFFORTS),
}
SILENT = {
    "no answer to an error of 0",
    "an effort that has not changed is not published",
    "another topic",
}  # the grader waits for these in vain
