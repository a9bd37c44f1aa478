"""Hints on what is used in the place of something else: of another type, of ROS 1, or to end what has already ended."""

import pytest

from course.explaining import ros_1
from course.explaining.hints import hint

SWAPPED = """from std_srvs.srv import SetBool
class Motors(Node):
    def __init__(self):
        self.create_service(SetBool, 'enable', self.enable)
    def enable(self, {}):
        self.on = {}.data
"""
REFUSES = """class A(Node):
    def __init__(self):
        self.create_service(SetBool, 'enable', self.enable)
        self.add_on_set_parameters_callback(self.check)
        ActionServer(self, Lift, 'lift', self.execute, goal_callback=self.accept, cancel_callback=self.agree)
    def enable(self, request, response):
        response.success = True
        raise ValueError('enable')
    def check(self, parameters):
        raise ValueError('check')
    def accept(self, goal):
        raise ValueError('accept')
    def agree(self, goal_handle):
        goal_handle.canceled()
    def helper(self):
        raise ValueError('helper')
"""
TAKES_OVER = """def take_over(self, goal_handle):
    self.newest.abort()
def execute(self, goal_handle):
    if self.newest is not goal_handle:
        goal_handle.abort()
"""
MOVES_ON = "def execute(self, goal_handle):\n    while left:\n        goal_handle.abort()\n    goal_handle.succeed()\n"
HANDLE = """def __init__(self):
    self.handle = None
def run(self):
    future = self.client.send_goal_async(goal)
    self.handle = future.result()
    if not self.handle.accepted:
        pass
def later(self):
    self.handle.cancel_goal_async()
"""
SHUTS_DOWN = (
    "def main():\n    rclpy.init()\n    rclpy.spin(node)\n    rclpy.try_shutdown()\n    rclpy.spin_once(node)\n"
)
NO_CONTEXT = "TypeError: 'NoneType' object does not support the context manager protocol"
NESTED = """self.create_service(Trigger, 'ask', self.ask)
def ask(self, request, response):
    executor = SingleThreadedExecutor()
    future = self.client.call_async(request)
"""
FLOATS = "from std_msgs.msg import Float64"
FIBONACCI = "from course_interfaces.action import Fibonacci"
CLASS_CHANGED = "AttributeError: 'Lift_Result' object attribute 'stops' is read-only"
CLASS_OF_RESULT = "def execute(self, goal_handle):\n    result = Lift.Result\n    result.stops = []\n"
SERVICE, ACTION = (f"NotImplementedError: {kind} classes can not be instantiated" for kind in ("Service", "Action"))
OF_A_SERVER = "self.create_service(Add, '/add', self.add)"
OF_A_CLIENT = "self.client = self.create_client(Add, '/add')"
ON_A_CLASS = "TypeError: Agent.decide() missing 1 required positional argument: 'distances'"
HAS_AN_AGENT = "rclpy.init()\nself.agent = Agent()\n"
CALLED_WITH = "TypeError: Client.call_async() got an unexpected keyword argument '{}'"
SENT_WITH = "TypeError: ActionClient.send_goal_async() got an unexpected keyword argument '{}'"
ASKS = "from example_interfaces.srv import AddTwoInts\nself.client = self.create_client(AddTwoInts, '/add')"
SENDS = f"{FIBONACCI}\nself.client = ActionClient(self, Fibonacci, '/fibonacci')"
NO_SUPPORT = "AttributeError: type object 'str' has no attribute '_TYPE_SUPPORT'"
UNDECLARED = "rclpy.exceptions.ParameterNotDeclaredException: Invalid access to undeclared parameter(s): "
NO_ATTRIBUTE = "AttributeError: 'Motors' object has no attribute 'stopped'"
KEEPS = "class Motors:\n    def __init__(self):\n        {}\n    def stop(self):\n"
BUILTIN = "'builtin_function_or_method'"
AMBIGUOUS = "ValueError: The truth value of an array with more than one element is ambiguous. Use a.any() or a.all()"
BITWISE = "TypeError: ufunc 'bitwise_and' not supported for the input types, and the inputs could not be safely"
SCALARS = "TypeError: only 0-dimensional arrays can be converted to Python scalars"
OVERRIDES = "RCLError: failed to initialize rcl: Couldn't parse parameter override rule:"
INVALID = "RCLError: Failed to update goal state: goal_handle attempted invalid transition from state {} with event {}"


LIST_OF = "AssertionError: The 'floors' field must be a set or sequence and each value of type 'int' and"
WORDS = "parser.add_argument('floors', {})\n"
LESS_PARAMETER = "TypeError: '<' not supported between instances of 'Parameter' and 'float'"
KEEPS_PARAMETERS = """self.add_on_set_parameters_callback(self.check)
def check(self, params):
    new = {{'low': self.get_parameter('low'){}}}
    for param in params:
        new[param.name] = param
    return new['low'] < 1.0
"""
UNSET = "UnboundLocalError: cannot access local variable 'a' where it is not associated with a value"
EXCEPT = """def main():
    try:
        a, b = words
    except ValueError:
        {}
    call(a)
"""
YIELDS = """create_service(Trigger, 'relay', self.relay)
def relay(self, request, response):
    answer = yield self.client.call_async(request)
    return response
"""
CHECKS = "add_on_set_parameters_callback(self.check)\ndef check(self, parameters):\n    {}\n"
CALLED = "def decide(self, seen):\n    return seen['front']\n"


@pytest.mark.parametrize(
    ("error", "text", "code", "says"),
    [
        (
            LIST_OF,
            WORDS.format("nargs='+'"),
            "goal.floors = floors",
            "for a number, write `type=int` (or `float`) in `add_argument('floors', ...)`.",
        ),
        (LIST_OF, WORDS.format("nargs='+', type=int"), "goal.floors = floors[0]", "takes a list"),
        (LIST_OF, WORDS.format("metavar='F'"), "goal.floors = options.floors", "takes a list"),
        (LIST_OF, WORDS.format("nargs='+'"), "goal.floors = int(options.floors[0])", "takes a list"),
        (LIST_OF, "", "goal = Lift.Goal(floors=sys.argv[1:])", "`[int(word) for word in ...]` makes numbers of them."),
        (LESS_PARAMETER, KEEPS_PARAMETERS.format(".value"), "", "`param.value`."),
        (LESS_PARAMETER, KEEPS_PARAMETERS.format(""), "", "`get_parameter(...)` returns a Parameter"),
        (
            UNSET,
            EXCEPT.format("print(USAGE)"),
            "call(a)",
            "`a` is set in the `try` of line 2, and the `except` in line 4 goes on without it: leave the",
        ),
        (UNSET, EXCEPT.format("return 2"), "call(a)", "No line that sets `a` in this function has run yet"),
        (UNSET, EXCEPT.format("parser.error(USAGE)"), "call(a)", "No line that sets `a`"),
        (
            "TypeError: 'bool' object is not callable",
            "class A:\n    def __init__(self):\n        self.go = 0\n    def go(self):\n        self.go = 1\n",
            "",
            "`self.go = ...` in line 3 replaces the method `go`",
        ),
        (
            'TypeError: can only concatenate str (not "method") to str',
            "class A:\n    def state(self):\n        return ''\n",
            "response.message = 'Motors ' + self.state",
            "`self.state` is the method itself. Call it: `self.state()`.",
        ),
        (
            "RCLError: Failed to create subscription: invalid allocator, at /project/src/rcl/subscription.c:261",
            "self.create_publisher(Twist, 'scan', 10)\nself.create_subscription(LaserScan, '/scan', self.see, 10)\n",
            "",
            "Line 1 gives '/scan' the type Twist, and line 2 the type LaserScan. One name can have only one type",
        ),
        (
            "RCLError: failed to create service: create_service() called for existing request topic name rq/a with",
            "self.create_client(AddTwoInts, '/a')\nself.create_service(Trigger, '/a', self.a)\n",
            "",
            "Line 1 gives '/a' the type AddTwoInts, and line 2 the type Trigger.",
        ),
        (
            "TypeError: tuple indices must be integers or slices, not str",
            CALLED,
            "return seen['front']",
            "`seen` is a tuple, not a dict: its caller passes one. A dict has its keys in braces",
        ),
        (
            "TypeError: Doubler.__init__() got an unexpected keyword argument 'threads'",
            "ros.start(Doubler(1, threads=2))",
            "ros.start(Doubler(1, threads=2))",
            "takes the class, and makes the node itself: `ros.start(Doubler, 1, threads=2)`.",
        ),
        ("TypeError: Doubler.__init__() got an unexpected keyword argument 'threads'", "", "Doubler(threads=2)", ""),
        (
            "NameError: name 'elbow' is not defined",
            "",
            "self.declare_parameter('joint_name', elbow, ParameterDescriptor(read_only=True))",
            "Text is written in quotation marks: `'elbow'`.",
        ),
        ("NameError: name 'elbow' is not defined", "", "self.declare_parameter('kp', elbow)", ""),
        ("TypeError", YIELDS, "", "which runs nothing and returns no response: write `await`, and `async def`."),
        (
            "ValueError: generator already executing",
            "Thread(target=rclpy.spin, args=(node,), daemon=True).start()\nrclpy.spin(node)\n",
            "rclpy.spin(node)",
            "The thread of line 1 and line 2 both spin the node, and two threads cannot spin one executor",
        ),
        (
            "ValueError: generator already executing",
            "Thread(target=self.work).start()\nrclpy.spin(node)\n",
            "rclpy.spin(node)",
            "The executor that runs this callback already spins the node.",
        ),
        (
            "TypeError: '<' not supported between instances of 'Parameter' and 'float'",
            CHECKS.format("new.update((each.name, each) for each in parameters)"),
            "if new['low'] < 3.0:",
            "Line 3 keeps the whole Parameter for each name. Its value is `each.value`.",
        ),
        (
            "TypeError: '<' not supported between instances of 'Parameter' and 'float'",
            CHECKS.format("new = {each.name: each.value for each in parameters}"),
            "if low < 3.0:",
            "`get_parameter(...)` returns a Parameter: its value is `.value`.",
        ),
        (
            "TypeError: Motors.status() missing 2 required positional arguments: 'request' and 'response'",
            "create_service(Trigger, 'a', self.status)\n@property\ndef status(self, request, response):\n    pass\n",
            "self.create_service(Trigger, 'a', self.status)",
            "`@property` in line 2 has `self.status` call the function at once, without arguments. A callback is a",
        ),
        (
            "TypeError: Motors.state() missing 1 required positional argument: 'self'",
            "@classmethod\ndef status(self, request, response):\n    self.state()\n",
            "self.state()",
            "`@classmethod` in line 1 passes the class instead of the node to 'status', so what it calls has no `self`",
        ),
        (
            "TypeError: Can't subtract times with different clock types",
            "self.came = Time()\n",
            "self.get_clock().now() - self.came",
            "`Time()` is of the system's clock, and `self.get_clock().now()` is of the node's.",
        ),
        (
            "IndexError: array index out of range",
            "left = goal.floors\nwhile left != []:\n    go(left[0])\n",
            "go(left[0])",
            "Line 2: an array is never equal to a list. Write `len(left)`, or begin with `list(...)`.",
        ),
        (
            "ValueError: operands could not be broadcast together with shapes (360,) (0,)",
            "angles = np.arange(scan.angle_min, scan.angle_max, scan.angle_increment)\n",
            "seen = ranges[usable & (low <= angles)]",
            "Line 1 counts the angles up to `angle_max`, which need not be as many as the beams.",
        ),
        (
            "AssertionError: The 'x' field must be of type 'float'",
            "",
            "cmd.linear.x = action['linear'], cmd.angular.z == action['angular']",
            "The comma makes a tuple of 2 values: write `action['linear']` here alone.",
        ),
        (
            "KeyError: 'front'",
            CALLED + "decide({'right': 0.4})\n",
            "return seen['front']",
            "which `print(seen)` shows. Line 3 passes `{'right': 0.4}`.",
        ),
        (
            "rclpy.exceptions.ParameterAlreadyDeclaredException: Parameter(s) already declared: ['kp']",
            "super().__init__('pid', automatically_declare_parameters_from_overrides=True)\n",
            "self.declare_parameter('kp', 1.0)",
            "`automatically_declare_parameters_from_overrides` in line 1 declares each parameter that is given at the",
        ),
        (
            "rclpy.exceptions.ParameterAlreadyDeclaredException: Parameter(s) already declared: ['kp']",
            "super().__init__('pid', automatically_declare_parameters_from_overrides=False)\n",
            "self.declare_parameter('kp', 1.0)",
            "A parameter is declared once: this one was declared before.",
        ),
        (
            "rclpy.exceptions.ParameterAlreadyDeclaredException: Parameter(s) already declared: ['kp']",
            "self.declare_parameter('kp', 1.0)\nself.declare_parameter('ki', 1.0)\nself.declare_parameter('kp', 0.0)\n",
            "self.declare_parameter('kp', 0.0)",
            "and lines 1 and 3 declare 'kp': remove one of them, or correct its name.",
        ),
        (
            "rclpy.exceptions.ParameterAlreadyDeclaredException: Parameter(s) already declared: ['name']",
            "for name, default in GAINS:\n    self.declare_parameter('name', default)\n",
            "self.declare_parameter('name', default)",
            "line 2 declares 'name' in each round of its loop. Is `name` meant, without quotation marks?",
        ),
        (
            "rclpy.exceptions.ParameterAlreadyDeclaredException: Parameter(s) already declared: ['kp']",
            "while True:\n    self.declare_parameter('kp', 1.0)\n",
            "self.declare_parameter('kp', 1.0)",
            "line 2 declares 'kp' in each round of its loop.",
        ),
        (
            "ImportError: cannot import name 'GoalStatus' from 'rclpy.action' (/a/rclpy/action/__init__.py)",
            "from rclpy.action import ActionClient, GoalStatus\n",
            "from rclpy.action import ActionClient, GoalStatus",
            "rclpy.action has no GoalStatus. It is in action_msgs.msg",
        ),
        (
            "ImportError: cannot import name 'KeyboardInterrupt' from 'rclpy.executors' (/a/rclpy/executors.py)",
            "from rclpy.executors import KeyboardInterrupt\n",
            "from rclpy.executors import KeyboardInterrupt",
            "`KeyboardInterrupt` is one of Python's own names: it needs no import.",
        ),
        (
            "ImportError: cannot import name 'add_done_callback' from 'rclpy.task' (/a/rclpy/task.py)",
            "from rclpy.task import add_done_callback\n",
            "from rclpy.task import add_done_callback",
            "`add_done_callback` is a method of the class Future in rclpy.task: write `from rclpy.task",
        ),
        (
            "rclpy.exceptions.NotInitializedException: ('rclpy.init() has not been called', 'cannot create node')",
            "class WallAgent(Node):\n    def decide(self):\n        return 1\n",
            "super().__init__('wall_agent')",
            "and 'WallAgent' is a node. If it needs nothing of ROS, leave its base `Node` out.",
        ),
        (
            "rclpy.exceptions.NotInitializedException: ('rclpy.init() has not been called', 'cannot create node')",
            "class Pid(Node):\n    pass\n\ndef main():\n    rclpy.spin(Pid())\n",
            "rclpy.spin(Pid())",
            "`rclpy.init()` must be called before a node is made.",
        ),
        ("KeyError: 'front'", CALLED, "return seen['front']", "It is what the caller of `decide` passes: compare its"),
        (
            "ModuleNotFoundError: No module named 'my_package'",
            "from my_package.msg import LaserScan",
            "from my_package.msg import LaserScan",
            "LaserScan is in sensor_msgs.msg: write `from sensor_msgs.msg import LaserScan`.",
        ),
        (
            "ModuleNotFoundError: No module named 'my_package'",
            "from my_package.srv import Mine",
            "from my_package.srv import Mine",
            "my_package is not built here",
        ),
        (
            "AttributeError: 'SetBool_Response' object has no attribute 'data'",
            SWAPPED.format("response, request", "request"),
            "self.on = request.data",
            "A service callback gets the request first, then the response: `def enable(self, request, response)`.",
        ),
        (
            "AttributeError: 'SetBool_Response' object has no attribute 'data'",
            SWAPPED.format("request, response", "response"),
            "self.on = response.data",
            "The response of SetBool has the fields success, message.",
        ),
        (
            "TypeError: ActionServer.__init__() got an unexpected keyword argument 'handle_accepted'",
            "",
            "self.server = ActionServer(",
            "Did you mean `handle_accepted_callback=`?",
        ),
        ("TypeError: Motors.__init__() got an unexpected keyword argument 'nam'", "", "Motors(nam='a')", ""),
        (
            "AttributeError: type object 'Fibonacci' has no attribute 'default_callback_group'",
            "ActionClient(Fibonacci, 'fibonacci', ros.node)",
            "ActionClient(Fibonacci, 'fibonacci', ros.node)",
            "The arguments of `ActionClient` are in the wrong order: write `ActionClient(ros.node, TheType, '/name')`.",
        ),
        *(
            (
                "AttributeError: type object 'Fibonacci' has no attribute 'default_callback_group'",
                f"{maker}(Fibonacci, {first}, 'fibonacci'{last})",
                f"{maker}(Fibonacci, {first}, 'fibonacci'{last})",
                f"The arguments of `{maker}` are in the wrong order: write `{maker}({first}, TheType, '/name'{last})`.",
            )
            for maker, first, last in (("ActionClient", "ros.node", ""), ("ActionServer", "self", ", self.execute"))
        ),
        (
            "TypeError: Fibonacci.__init__() got an unexpected keyword argument 'order'",
            FIBONACCI,
            "client.send_goal_async(Fibonacci(order=5))",
            "`Fibonacci` is the type of an action, and a goal of it is `Fibonacci.Goal(order=...)`.",
        ),
        ("TypeError: Fibonacci.__init__() got an unexpected keyword argument 'x'", FIBONACCI, "Fibonacci(x=5)", ""),
        ("ValueError: enable", REFUSES, "raise ValueError('enable')", "say so in the response, `response.success = F"),
        ("ValueError: check", REFUSES, "raise ValueError('check')", "`return SetParametersResult(successful=False, re"),
        ("ValueError: accept", REFUSES, "raise ValueError('accept')", "`return GoalResponse.REJECT` does."),
        ("ValueError: helper", REFUSES, "raise ValueError('helper')", ""),
        ("ValueError: could not convert", REFUSES, "response.success = True", ""),
        (INVALID.format("EXECUTING", "CANCELED"), REFUSES, "goal_handle.canceled()", "it returns `CancelResponse.ACC"),
        (INVALID.format("EXECUTING", "CANCELED"), "", "goal_handle.canceled()", "Nobody has asked to cancel this goal"),
        (
            INVALID.format("ABORTED", "ABORT"),
            TAKES_OVER,
            "goal_handle.abort()",
            "by `self.newest.abort()` in line 2. When `is_active` of the goal handle is False, return the result",
        ),
        (
            INVALID.format("ABORTED", "ABORT"),
            TAKES_OVER.replace("    if self", "    while self"),
            "goal_handle.abort()",
            "is False, leave the loop and return the result, without ending the goal again.",
        ),
        (
            INVALID.format("SUCCEEDED", "ABORT"),
            f"{TAKES_OVER}    goal_handle.succeed()\n",
            "self.newest.abort()",
            "`goal_handle.succeed()` in line 6. Check first that it still runs: `if self.newest.is_active:`.",
        ),
        (
            INVALID.format("ABORTED", "ABORT"),
            MOVES_ON,
            "goal_handle.abort()",
            "This goal has already ended, as aborted. After `succeed()`",
        ),
        (
            "TypeError: unsupported operand type(s) for *: 'Float64' and 'float'",
            FLOATS,
            "self.integral += msg * step",
            "This is the whole message: its value is in the field `data` of Float64, as in `msg.data`.",
        ),
        ("TypeError: must be real number, not Float64", FLOATS, "math.sin(msg)", "in the field `data` of Float64"),
        ("TypeError: unsupported operand type(s) for *: 'Float64' and 'float'", "", "", ""),
        ("TypeError: unsupported operand type(s) for *: 'float' and 'Duration'", "", "", "A Duration is not a number"),
        ("TypeError: unsupported operand type(s) for -: 'Time' and 'float'", "", "", "Take both from the same clock"),
        ("TypeError: unsupported operand type(s) for -: 'list' and 'float'", "", "", ""),
        (
            "TypeError: RcutilsLogger.info() takes 2 positional arguments but 3 were given",
            "",
            "self.get_logger().info('a: %s', a)",
            "A logger of rclpy takes one text",
        ),
        (
            "ModuleNotFoundError: No module named 'rospy'",
            "import rospy",
            "import rospy",
            "`rospy` is a library from ROS 1",
        ),
        (
            "NameError: name 'rospy' is not defined. Did you mean: 'rclpy'?",
            "",
            "ki = rospy.get_param('ki')",
            "`rospy.get_param` is from ROS 1. In ROS 2: `self.declare_parameter('name', default)`",
        ),
        (
            "AttributeError: 'NoneType' object has no attribute 'accepted'",
            HANDLE,
            "if not self.handle.accepted:",
            "The response is not there yet: `future.result()`",
        ),
        (
            "AttributeError: 'NoneType' object has no attribute 'cancel_goal_async'",
            HANDLE,
            "self.handle.cancel_goal_async()",
            "",
        ),
        (NO_CONTEXT, SHUTS_DOWN, "rclpy.spin_once(node)", "`rclpy.try_shutdown()` in line 4 has already run"),
        (NO_CONTEXT, SHUTS_DOWN, "rclpy.spin(node)", ""),
        (NO_CONTEXT, SHUTS_DOWN, "", ""),
        (NO_CONTEXT, SHUTS_DOWN.replace("spin_once", "spin"), "", "`rclpy.try_shutdown()` in line 4 has already run"),
        (NO_CONTEXT, "with self.lock:\n    pass", "with self.lock:", ""),
        (NO_CONTEXT, NESTED, "executor = SingleThreadedExecutor()", "A callback needs no executor of its own"),
        (
            "RCLError: Couldn't parse parameter override rule: '-p kp:='. Error: error not set",
            "",
            "rclpy.init(args=args)",
            "Write the value after `:=`, without a space: `-p kp:=2.0`",
        ),
        (
            "RCLError: Couldn't parse params file: '--params-file pids.yaml'. Error: Error opening YAML file, at p.c",
            "",
            "rclpy.init(args=args)",
            ", in which the program runs, has no file pids.yaml.",
        ),
        (NO_CONTEXT, "", "executor = SingleThreadedExecutor()", "`SingleThreadedExecutor(context=node.context)`"),
        (
            CLASS_CHANGED,
            f"{CLASS_OF_RESULT}rclpy.init()",
            "",
            "Line 2: `result = Lift.Result` is the class itself. Create one with brackets: `Lift.Result()`.$",
        ),
        (CLASS_CHANGED, CLASS_OF_RESULT, "", "for all of this kernel: correct the line, and restart the kernel"),
        (CLASS_CHANGED, "rclpy.init()", "", "Create one with brackets: `Lift.Result()`.$"),
        (CLASS_CHANGED, "", "", "Somewhere `Lift.Result.stops = ...` was run"),
        (SERVICE, OF_A_CLIENT, "response = Add()", "Create a response: `Add.Response(...)`."),
        (SERVICE, OF_A_SERVER, "made = Add()", "Create a response: `Add.Response(...)`."),
        (SERVICE, OF_A_SERVER, "request = Add()", "Create a request: `Add.Request(...)`."),
        (SERVICE, OF_A_CLIENT, "made = Add()", "Create a request: `Add.Request(...)`."),
        (SERVICE, OF_A_SERVER, "self.client.call_async(Add())", "Create a request: `Add.Request(...)`."),
        (SERVICE, f"{OF_A_SERVER}\n{OF_A_CLIENT}", "made = Add()", "you need: `Add.Request()` or `Add.Response()`."),
        (SERVICE, "", "ros.call('/add', Add())", "This takes the type itself: `Add`, without brackets after it."),
        (SERVICE, "", "self.create_service(Add(), '/add', self.add)", "This takes the type itself: `Add`"),
        (ACTION, "", "result = Lift()", "Create a result: `Lift.Result(...)`."),
        (ACTION, "", "goal_handle.publish_feedback(Lift())", "Create a feedback message: `Lift.Feedback(...)`."),
        (ACTION, "", "ActionServer(self, Lift(), 'lift', self.execute)", "This takes the type itself: `Lift`"),
        (
            "TypeError: 'bool' object is not callable",
            "",
            "if not handle.accepted():",
            "`accepted` of a goal handle is not a method: leave out the brackets after it.",
        ),
        (
            f"{UNDECLARED}gains.kp",
            "",
            "kp = self.get_parameter('gains.kp')",
            "declare_parameter('gains.kp', default)`.",
        ),
        (f"{UNDECLARED}self.a", "self.declare_parameter('a', 1)", "", "Did you mean 'a'?"),
        (
            ON_A_CLASS,
            HAS_AN_AGENT,
            "action = Agent.decide(self.distances)",
            "called on the class Agent here. Call it on an object of the class: `self.agent.decide(...)`.",
        ),
        (ON_A_CLASS, "", "Agent.decide({})", "of the class, the name that you give to `Agent(...)`."),
        (
            "ImportError: cannot import name 'closest' from 'course.robot.sectors'",
            "",
            "from course.robot.sectors import closest",
            "course.robot.sectors has no closest.$",
        ),
        (
            "ModuleNotFoundError: No module named 'agent.py'; 'agent' is not a package",
            "import agent.py",
            "import agent.py",
            "An import names a module without `.py`: `agent`.",
        ),
        (
            NO_SUPPORT,
            "self.create_client('Add', '/add')",
            "self.create_client('Add', '/add')",
            "The type is not a text: write it without quotation marks, `Add`, and import it.",
        ),
        (
            NO_SUPPORT,
            "ActionServer(self, 'Lift', '/lift', self.execute)",
            "",
            "without quotation marks, `Lift`, and import it.",
        ),
        (NO_SUPPORT, "self.create_client('/add', Add)", "", "are in the wrong order"),
        (
            "TypeError: Failed to register goal execution callback: not callable",
            "ActionServer(self, Lift, self.execute, '/lift')",
            "",
            "are in the wrong order: write `ActionServer(self, TheType, '/name', self.execute)`.",
        ),
        (
            NO_SUPPORT,
            "self.create_service(srv_type='/add', srv_name=Add, callback=self.add)",
            "",
            "`srv_type` is the type and `srv_name` the text: write `srv_type=Add, srv_name='/add'`.",
        ),
        (NO_SUPPORT, "self.create_service(srv_type=Add, srv_name='/add', callback=self.add)", "", ""),
        (
            NO_ATTRIBUTE,
            KEEPS.format("stopped = False") + "        pass",
            "",
            "Line 3 sets `stopped`, a variable of `__init__` that",
        ),
        (NO_ATTRIBUTE, KEEPS.format("stopped = 1; self.state = stopped") + "        pass", "", ""),
        (
            NO_ATTRIBUTE,
            f"{KEEPS.format('pass')}        self.stopped = 1",
            "",
            "Line 5 sets `self.stopped`, and has not",
        ),
        (NO_ATTRIBUTE, KEEPS.format("pass") + "        pass", "", ""),
        (
            f"TypeError: {BUILTIN} object does not support the context manager protocol",
            "self.cabin = threading.Lock",
            "with self.cabin:",
            "Line 1: `threading.Lock` is the function itself. Call it: `threading.Lock()`.",
        ),
        (
            f"TypeError: unsupported operand type(s) for -: {BUILTIN} and 'float'",
            "now = time.monotonic",
            "step = now - self.last",
            "Line 1: `time.monotonic` is the function itself. Call it: `time.monotonic()`.",
        ),
        (f"TypeError: unsupported operand type(s) for -: {BUILTIN} and 'float'", "", "step = len - 1", ""),
        ("NameError: name 'true' is not defined", "", "data=true", "In Python this is written `True`."),
        ("AttributeError: 'ServerGoalHandle' object has no attribute 'cancelled'", "", "", "Did you mean `canceled`?"),
        ("AttributeError: 'ServerGoalHandle' object has no attribute 'zzz'", "", "", ""),
        (
            "AttributeError: 'ServerGoalHandle' object has no attribute 'is_canceled'",
            "",
            "",
            "Did you mean `is_cancel_requested`?",
        ),
        ("AttributeError: 'ClientGoalHandle' object has no attribute 'cancel'", "", "", "`cancel_goal_async`?"),
        ("AttributeError: 'ClientGoalHandle' object has no attribute 'canceled'", "", "", "`cancel_goal_async`?"),
        (
            "AttributeError: 'ClientGoalHandle' object has no attribute 'result'",
            "print(ros.wait(future).result.sequence)",
            "",
            "the goal's end, and is requested separately: `ros.wait(goal_handle.get_result_async()).result`.",
        ),
        (
            "AttributeError: 'ClientGoalHandle' object has no attribute 'sequence'",
            "from example_interfaces.action import Fibonacci\nself.client = ActionClient(self, Fibonacci, 'fib')",
            "",
            "and once that future is done, `future.result().result` is the result.",
        ),
        (
            "AttributeError: 'ClientGoalHandle' object has no attribute 'results'",
            "",
            "",
            "and is requested separately: `future = ",
        ),
        ("AttributeError: type object 'GoalStatus' has no attribute 'SUCCEEDED'", "", "", "`STATUS_SUCCEEDED`?"),
        (AMBIGUOUS, "", "near = ranges[usable and low <= a]", "Arrays are combined with `&` and `|`"),
        (AMBIGUOUS, "", "near = ranges[low <= a <= high]", "Arrays are combined with `&` and `|`"),
        (BITWISE, "", "near = (low <= a) & (a <= high) & ranges >= least", "needs brackets: `& (ranges >= least)`."),
        (BITWISE, "", "near = usable | ranges == inf", "so each comparison needs brackets: `| (ranges == inf)`."),
        (BITWISE, "", "near = ranges & usable", ""),
        (SCALARS, "", "a = math.degrees(angles)", "use that of NumPy, such as `np.degrees(...)`."),
        (SCALARS, "", "a = float(angles)", ""),
        (AMBIGUOUS, "", "if ranges < 0.5 and usable:", ""),
        (AMBIGUOUS, "", "return bool(ranges < 0.5)", ""),
        (
            "TypeError: LiftClient.on_feedback() missing 1 required positional argument: 'message'",
            "self.client.send_goal_async(goal, feedback_callback=self.on_feedback())",
            "future = self.client.send_goal_async(goal, feedback_callback=self.on_feedback())",
            "Pass the method itself, without brackets: `self.on_feedback`.",
        ),
        (
            "AttributeError: 'builtin_function_or_method' object has no attribute 'monotonic'",
            "import time\nfrom time import time\n",
            "now = time.monotonic()",
            "Line 2, `from time import time`, gives the name `time` to a part of the module: keep `import time` alone",
        ),
        (
            "AttributeError: 'builtin_function_or_method' object has no attribute 'monotonic'",
            "from time import monotonic as time\n",
            "now = time.monotonic()",
            "",
        ),
        (
            "AssertionError: The 'result' field must be of type 'float'",
            "",
            "response.result = request.a + request.b,",
            "The comma at the end makes a tuple of it: write `request.a + request.b`, without the comma.$",
        ),
        (
            "AssertionError: The 'x' field must be of type 'float'",
            "def go(self):\n    action = {'linear': 0.1, 'angular': 0.2}\n    cmd.linear.x, cmd.angular.z = action\n",
            "cmd.linear.x, cmd.angular.z = action",
            "`action` is a dict: write one of its values, `action['linear']` or `action['angular']`.$",
        ),
        (
            "AttributeError: 'Trigger_Request' object has no attribute 'data'",
            "from std_srvs.srv import SetBool, Trigger",
            "self.on = request.data",
            "The request of Trigger has no fields. `data` is a field of the request of SetBool.$",
        ),
        (
            "AttributeError: 'Trigger_Request' object has no attribute 'data'",
            "from std_srvs.srv import Trigger",
            "self.on = request.data",
            "The request of Trigger has no fields.$",
        ),
        (
            "AttributeError: 'Trigger_Request' object has no attribute 'message'",
            "from std_srvs.srv import Trigger",
            "request.message = 'on'",
            "The request of Trigger has no fields: `message` is a field of its response.$",
        ),
        (
            "AssertionError: Invalid arguments passed to constructor: data",
            "from std_srvs.srv import Trigger",
            "request = Trigger.Request(data=True)",
            "The request of Trigger has no fields.$",
        ),
        (CALLED_WITH.format("a"), ASKS, "", "with the values in its fields: `AddTwoInts.Request(a=...)`.$"),
        (CALLED_WITH.format("req"), ASKS, "", "Did you mean `request=`?"),
        (CALLED_WITH.format("add_request"), ASKS, "", "Did you mean `request=`?"),
        (CALLED_WITH.format("number"), ASKS, "", "`call_async` takes a request: `AddTwoInts.Request(...)`, with"),
        (SENT_WITH.format("number"), "", "", "`send_goal_async` takes a goal: `TheType.Goal(...)`, with the val"),
        (CALLED_WITH.format("done_callback"), ASKS, "", "`call_async` takes no callback. What is to be called"),
        (
            CALLED_WITH.format("timeout_sec"),
            f"{ASKS}\nrclpy.init()",
            "",
            "no time limit: `rclpy.spin_until_future_complete(node, future, timeout_sec=...)` takes one.$",
        ),
        (CALLED_WITH.format("timeout_sec"), ASKS, "", "limit: `ros.wait(future, timeout=...)` takes one.$"),
        (
            CALLED_WITH.format("timeout_sec"),
            f"{ASKS}\nrclpy.init()\nself.create_service(Trigger, 'relay', self.relay)",
            "",
            "`call_async` returns at once, so it takes no time limit: leave it out.$",
        ),
        ("TypeError: Client.call() got an unexpected keyword argument 'timeout'", ASKS, "", "mean `timeout_sec=`?"),
        (
            "TypeError: Client.call_async() missing 1 required positional argument: 'request'",
            ASKS,
            "future = self.client.call_async()",
            "`call_async` takes a request: `AddTwoInts.Request(...)`, with the values in its fields.$",
        ),
        (SENT_WITH.format("order"), SENDS, "", "with the values in its fields: `Fibonacci.Goal(order=...)`.$"),
        (SENT_WITH.format("goal_msg"), SENDS, "", "Did you mean `goal=`?"),
        (SENT_WITH.format("feedback"), SENDS, "", "Did you mean `feedback_callback=`?"),
        (SENT_WITH.format("goal_callback"), SENDS, "", "takes one callback, `feedback_callback=`. What is to be"),
        ("ModuleNotFoundError: No module named 'rclpy.executor'", "", "", "Did you mean `rclpy.executors`?"),
        ("ModuleNotFoundError: No module named 'rclpy.actions'", "", "", "Did you mean `rclpy.action`?"),
        ("ModuleNotFoundError: No module named 'rclpy.callback_group'", "", "", "mean `rclpy.callback_groups`?"),
        (
            "ModuleNotFoundError: No module named 'rclpy.exception'",
            "from rclpy.exception import ExternalShutdownException",
            "",
            "ExternalShutdownException is in rclpy.executors: write `from rclpy.executors import ExternalShutdownExc",
        ),
        ("ModuleNotFoundError: No module named 'rclpy.motors'", "from rclpy.motors import Motor", "", ""),
        (
            "ImportError: cannot import name 'QoSProfile' from 'rclpy.action' (action.py)",
            "",
            "",
            "QoSProfile is in rclpy.qos: write `from rclpy.qos import QoSProfile`.",
        ),
        (f"{OVERRIDES} '-p max_speed'. Error: E", "", "", "without a space: `-p max_speed:=2.0`, for example."),
        (f"{OVERRIDES} '-p max_speed=2.0'. Error: E", "", "", "A parameter is set with `:=`: `-p max_speed:=2.0`"),
    ],
)
def test_what_is_used_in_another_place_is_told_only_where_it_is_certain(error, text, code, says):
    said = hint(error, text, code)
    assert says.removesuffix("$") in said and bool(says) == bool(said), said
    assert not says.endswith("$") or said.endswith(says[:-1]), said


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("rosservice call /add 1 2", "`rosservice` is from ROS 1. In ROS 2: `ros2 service call /add 1 2`."),
        ("roscore", "`roscore` is from ROS 1. ROS 2 needs nothing in its place: nodes find each other."),
        ("ros2 service list", ""),
        ("", ""),
    ],
)
def test_a_command_of_ros_1_is_told_with_its_counterpart(line, says):
    assert ros_1.command(line) == says
