"""Slips that a cell's text shows: each is told, and nothing that is meant."""

import pytest

from course.explaining.doubts import doubts
from course.explaining.slips import slips
from course.foundation import cells
from tests.hidden import answers
from tests.notebook.public_checks import NOTEBOOKS

NODE = """
class Careful(Node):
    def __init__(self):
        super().__init__('careful')
        self.declare_parameter('threshold', 1.0)
        self.add_on_set_parameters_callback(self.check)
        self.free = True

    def is_fresh(self):
        return True

    def check(self, params):
        {line}
        return SetParametersResult(successful=True)
"""


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ("outcome == 'OK'", "does nothing with it. To return it, write `return 0 if outcome == 'OK' else 1`."),
        ("try:\n        outcome == 'OK'\n    finally:\n        stop()", "To return it, write `return 0 if outcome"),
        ("outcome == 'OK'\n    print(outcome)", "To set it, write `outcome = 'OK'`."),
        ("while True:\n        outcome == 'OK'", "To set it, write `outcome = 'OK'`."),
    ],
)
def test_a_comparison_at_the_end_of_a_function_is_meant_to_be_returned(body, says):
    (told,) = slips(f"def main():\n    outcome = run()\n    {body}\n")
    assert says in told


def test_a_value_that_is_looked_up_and_not_used_is_told():
    text = "WORDS = {{4: 'SUCCEEDED'}}\ndef run(status):\n    {}WORDS.get(status)\n"
    (told,) = slips(text.format(""))
    assert told.startswith("note: line 3: ") and "write `return WORDS.get(status)`." in told
    assert slips(text.format("return ")) == slips(text.format("").replace("WORDS =", "WORDS = Queue() or")) == []


def test_a_callback_in_the_place_of_an_attribute_is_not_to_be_called():
    text = (
        "class Lift(Node):\n    def __init__(self):\n        self.{} = False\n"
        "        self.create_service(SetBool, 'block', self.block)\n"
        "    def block(self, request, response):\n        return response\n"
        "    def step(self):\n        return 1 if self.block else 2\n"
    )
    (told,) = slips(text.format("blocked"))
    assert told == "note: line 8: `self.block` is a callback, which is always true. Is `self.blocked` meant?"
    (told,) = slips(text.format("stopped"))
    assert told == "note: line 8: `self.block` is a callback, which is always true: ask for a value."


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("self.free == False",
         "line 13: `self.free == False` compares, and changes nothing. To set it, write `self.free = False`."),
        ("while self.free and not self.is_fresh: pass",
         "line 13: `self.is_fresh` is the method itself, which is always true. Call it: `self.is_fresh()`."),
        ("bad = [each for each in params if each.name == 'treshold']",
         "line 13: no parameter 'treshold' is declared, so this is never true. Did you mean 'threshold'?"),
        ("self.is_fresh",
         "line 13: `self.is_fresh` is the method itself, and calls nothing. Call it: `self.is_fresh()`."),
        ("goal.abort", "line 13: `goal.abort` is the method itself, and calls nothing. Call it: `goal.abort()`."),
        ("self.free", ""),
        ("self.publisher.publish",
         ("line 13: `self.publisher.publish` is the method itself, and calls nothing. Call it: "
          "`self.publisher.publish(...)`.")),
        ("self.publisher.publish(params)", ""),
        ("self.asked = self.goal.cancel_goal_async",
         ("line 13: `self.goal.cancel_goal_async` is the method itself, and asks for nothing. Call it: "
          "`self.goal.cancel_goal_async()`.")),
        ("ask = self.client.call_async",
         ("line 13: `self.client.call_async` is the method itself, and asks for nothing. Call it: "
          "`self.client.call_async(...)`.")),
        ("ask = self.client.call_async; self.answers = ask(params)", ""),
        ("self.create_timer(1.0, self.check)",
         "line 13: 'check' makes one more timer each time that it is called. Make the timer once, in `__init__`."),
        ("if self.free: self.create_timer(1.0, self.check)", ""),
        ("self.timer = self.timer or self.create_timer(1.0, self.check)", ""),
        ("self.create_timer(1.0, self.check).destroy()", ""),
        ("self.decide = params or self.is_fresh", ""),
        ("if params or self.is_fresh: pass",
         "line 13: `self.is_fresh` is the method itself, which is always true. Call it: `self.is_fresh()`."),
        ("if self.free: return []\n        self.timer = self.create_timer(1.0, self.check)", ""),
        ("self.free = self.free == False", ""),
        ("if self.free and self.is_fresh(): pass", ""),
        ("bad = [each for each in params if each.name == 'threshold']", ""),
        ("bad = [each for each in params if each.name == 'speed']", ""),
        ("for each in params: each.name == 'threshold' or print(each)", ""),
        ("if self.free == 'a' or 'b': pass",
         "line 13: `'b'` is always true on its own. Write `self.free == 'a' or self.free == 'b'`."),
        ("while not ('a' or 2 in params): pass",
         "line 13: `'a'` is always true on its own. Write `'a' in params or 2 in params`."),
        ("if params and (self.free != 1 or 2): pass",
         "line 13: `2` is always true on its own. Write `self.free != 1 and self.free != 2`."),
        ("self.free = self.free == 1 or 'b'", ""),
        ("if self.free or 'b': pass",
         "line 13: `'b'` is always true on its own. Compare something with it, or leave it out."),
        ("while self.free == 1 or True: pass", ""),
        ("if self.free == 1 and 'b': pass", ""),
        ("self.free = 1 if params and (each > 0 for each in params) else 0",
         ("line 13: `(each > 0 for each in params)` is a generator, which is always true. Write "
          "`all(each > 0 for each in params)`, or `any(each > 0 for each in params)`.")),
        ("if all(each > 0 for each in params): pass", ""),
        ("if not self.client.service_is_ready: pass",
         ("line 13: `self.client.service_is_ready` is the method itself, which is always true. Call it: "
          "`self.client.service_is_ready()`.")),
        ("while rclpy.ok and self.free: pass",
         "line 13: `rclpy.ok` is the method itself, which is always true. Call it: `rclpy.ok()`."),
        ("if self.future.done: pass", ""),
        ("if params[0] == math.nan: pass",
         ("line 13: `params[0] == math.nan` is always false, because NaN is equal to nothing, not even to NaN. Ask "
          "`np.isnan(params[0])`.")),
        ("if float('nan') != self.free: pass",
         ("line 13: `float('nan') != self.free` is always true, because NaN is equal to nothing, not even to NaN. Ask "
          "`np.isnan(self.free)`.")),
        ("if math.isnan(self.free): pass", ""),
        ("self.get_logger().info('given {params}')",
         "line 13: 'given {params}' shows its braces as they are: write `f` before the first quotation mark."),
        ("self.message = 'Motors {self.is_ok()}'",
         "line 13: 'Motors {self.is_ok()}' shows its braces as they are: write `f` before the first quotation mark."),
        ("self.made = SetParametersResult(reason='not {params!r}' if params else '')",
         "line 13: 'not {params!r}' shows its braces as they are: write `f` before the first quotation mark."),
        ("self.message = 'Motors {self.is_ok()}'.format(self=self)", ""),
        ("self.message = 'Motors {state}'; state = self.message.format(state=1)", ""),
        ("self.message = 'Motors {is_fresh()}'", ""),
        ("self.reason = 'not {self.free:.1f} free'",
         ("line 13: 'not {self.free:.1f} free' shows its braces as they are: write `f` before the first "
          "quotation mark.")),
        ("print(f'given {params}', '{params}')", ""),
        ("print('{params}'.format(params=params))", ""),
        ("print('{a}: {data}')", ""),
        ("reason = '{}'.format(params); print(reason)", ""),
        ("return []; print(params)", "line 13: this never runs: the `return` of line 13 ends the function."),
        ("return []; self.free = True", ""),
        ("return []", ""),
        ("self.server_is_ready = True\n        if self.server_is_ready: pass", ""),
    ],
)  # fmt: skip
def test_a_slip_is_told_with_its_line(line, says):
    cell = NODE.format(line=line)
    assert slips(cell) == [f"note: {says}"] * bool(says)
    assert slips(f"%%exercise careful.py{cell}") == slips(cell[1:])


def test_a_future_that_is_asked_without_brackets_is_told():
    (told,) = slips("future = client.call_async(request)\nwhile not future.done:\n    rclpy.spin_once(node)\n")
    assert told == "note: line 2: `future.done` is the method itself, which is always true. Call it: `future.done()`."


POWER = """%%exercise power.py
from std_srvs.srv import SetBool
class Power(Node):
    def __init__(self):
        super().__init__('power')
        self.stopped = self.free = False
        self.create_service(SetBool, 'power', self.power)
    def power(self, request, response):
        response.success = not self.stopped and self.free
        if request.data:
            {line}
        return response
"""
ALONE = "is a variable of 'power' alone, and nothing reads it. "
MESSAGE = "To answer with it, write `response.message = ...`."


def test_a_value_for_a_response_is_told_also_where_its_type_is_not_known():
    others = "            response.message = 'off'\n        else:\n            {line}"
    cell = POWER.replace("std_srvs.srv", "my_interfaces.srv").replace("            {line}", others)
    assert slips(cell.format(line="message = 'on'")) == [f"note: line 12: `message` {ALONE}{MESSAGE}"]


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("message = 'on'", f"`message` {ALONE}{MESSAGE}"),
        (
            "self.message = 'on'",
            f"`self.message` is an attribute of the node, and nothing in the file reads it. {MESSAGE}",
        ),
        ("stopped = True", f"`stopped` {ALONE}To set the attribute of the object, write `self.stopped = ...`."),
        (
            "self.on = request.data in 'add'; print(self.on)",
            (
                "`request.data in 'add'` is also true for an empty text and for each part of the word. To compare, "
                "write `request.data == 'add'`."
            ),
        ),
        ("self.on = request.data in ('add',) or 'a' in request.data; print(self.on)", ""),
        ("self.stoped = True", "nothing in the file reads `self.stoped`. Did you mean `self.stopped`?"),
        (
            "self.message = 'on'; print(response.message)",
            f"`self.message` is an attribute of the node, and nothing in the file reads it. {MESSAGE}",
        ),
        ("message = 'on'; response.message = message", ""),
        ("message = response.message = 'on'", ""),
        ("message = 'on'; response.message = 'on'", ""),
        ("self.message = 'on'; response.message = self.message", ""),
        ("self.message = 'on'; response.message = getattr(self, 'message')", ""),
        ("success = True", ""),  # the response has one in any case
        ("other = True", ""),
        ("stopped = self.stopped = True", ""),
        ("stopped = True; self.stopped = True", ""),
        ("stopped = True; self.free = stopped", ""),
        ("self.stopped = True", ""),
        ("self.stops = True", ""),
        ("power = self.create_service(SetBool, '/power', self.power)", ""),  # a method, which is not to be overwritten
        ("self.stoped = True; self.free = self.stoped", ""),
    ],
)
def test_a_value_in_a_name_that_nothing_reads_is_told(line, says):
    cell = POWER.format(line=line)
    assert slips(cell) == [f"note: line 10: {says}"] * bool(says)
    in_a_cell = slips(cell.partition("\n")[2])  # whose class may be used by another cell
    assert in_a_cell == ([] if "in the file" in says else slips(cell))


SWITCH = """state, count = 'off', 0
on = False
def power(request, response):
    {line}
    return response
def status(request, response):
    response.success = on
    return response
"""


@pytest.mark.parametrize(
    ("line", "is_told"),
    [
        ("on = request.data", True),
        ("if request.data: on = True", True),
        ("on = request.data; response.success = on", False),  # it may be meant for this function alone
        ("global on; on = request.data", False),
        ("other = request.data", False),
        ("count = 5", False),  # no function reads the other one
        ("def inner():\n        return on\n    on = request.data", False),
        ("on = request.data; response.message = str(locals())", False),
    ],
)
def test_a_variable_that_a_function_sets_for_itself_in_vain_is_told(line, is_told):
    at = "note: line 4: `on` is a variable of 'power' alone here, and nothing reads it. To set that of line 2, begin "
    told = [f"{at}'power' with `global on`."] if is_told else []
    for cell in (SWITCH, f"%%exercise switch.py\n{SWITCH}"):
        assert slips(cell.format(line=line)) == told


STOPPED = """%%exercise careful.py
{imports}
try:
    rclpy.spin(node)
except (KeyboardInterrupt, ExternalShutdownException):
    pass
"""
LACKS = (
    "note: line 4: `except` needs `ExternalShutdownException`, which this file does not import: "
    "`from rclpy.executors import ExternalShutdownException`."
)


@pytest.mark.parametrize(
    ("imports", "told"),
    [
        ("import rclpy", [LACKS]),
        ("from rclpy.executors import ExternalShutdownException", []),
        ("from rclpy.executors import *", []),
        ("class ExternalShutdownException(Exception): pass", []),
        ("def spin(self, ExternalShutdownException=ValueError): pass", []),
    ],
)
def test_an_exception_that_a_file_does_not_know_is_told_before_it_is_needed(imports, told):
    assert slips(STOPPED.format(imports=imports)) == told
    assert slips(STOPPED.format(imports=imports).partition("\n")[2]) == []  # another cell may have imported it


AGES = """class Follower(Node):
    def __init__(self):
        self.scan, self.came = None, None
    def laser_callback(self, msg):
        self.came = self.get_clock().now()
    def control_loop(self):
        {line}
    async def answer(self, request):
        return request
    async def other(self):
        await self.answer(1)
        {line}
"""


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (
            "self.answer(1)",
            "`self.answer(...)` alone runs nothing, because `answer` is an `async def`: write `await self.",
        ),
        ("self.agent.answer(1)", ""),
        ("self.task = self.answer(1)", ""),
        ("self.executor.create_task(self.answer(1))", ""),
        ("self.laser_callback(1)", ""),
        (
            "old = (now - self.came).nanoseconds / 1e6 <= 0.5",
            "`.nanoseconds / 1e6` is in milliseconds, so 0.5 means 0.5 m",
        ),
        ("old = (now - self.came).nanoseconds / 1e6 <= 500", ""),
        ("old = (now - self.came).nanoseconds / 1e9 <= 0.5", ""),
        (
            "new = self.came - self.get_clock().now() <= FRESH",
            "`self.came - self.get_clock().now()` is below 0, since now",
        ),
        ("new = self.get_clock().now() - self.came <= FRESH", ""),
        ("age = self.get_clock().now() - self.came\n        new = age <= FRESH", ""),
        ("age = self.came - self.get_clock().now()\n        age = -age\n        new = age <= FRESH", ""),
        ("new = self.deadline - self.get_clock().now() <= FRESH", ""),
        ("self.came += 1\n        new = self.came - self.get_clock().now() <= FRESH", ""),
        ("self.came = 1\n        new = self.came - self.get_clock().now() <= FRESH", ""),
    ],
)
def test_code_that_does_not_do_what_is_meant_is_told(line, says):
    cell = AGES.format(line=line)
    found = slips(cell)
    assert len(found) == (2 if says else 0), found
    for number, told in zip((7, 12), found, strict=False):
        assert told.startswith(f"note: line {number}: {says}")
    assert not says.endswith("`await self.") or [
        each.endswith(", and `async def control_loop`.") for each in found
    ] == [True, False]


RELAY = """class Relay(Node):
    def __init__(self):
        self.create_service(Trigger, '/relay', self.relay)
    {callback}
        {line}
        return response
    async def answer(self, request, response):
        return response
"""


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("self.executor.create_task(self.answer, request, response)", "create_task"),
        ("self.executor.create_task(self.answer(request, response))", "create_task"),
        ("threading.Thread(target=self.answer, args=(request, response)).start()", "Thread"),
        ("each = threading.Thread(target=self.answer, args=(request, response)); each.start(); each.join()", ""),
        ("threading.Thread(target=self.other, args=(request,)).start()", ""),
        ("self.pool.submit(self.answer, request, response).result()", ""),
    ],
)
def test_a_response_that_is_sent_before_it_is_filled_in_is_told(line, told):
    says = f"note: line 5: `{told}` runs it later, and `response` is sent before: make 'relay' an `async def` and "
    found = slips(RELAY.format(callback="def relay(self, request, response):", line=line))
    assert [each.startswith(says) for each in found] == [True] * bool(told)
    awaited = RELAY.format(callback="async def relay(self, request, response):", line=f"self.task = await {line}")
    assert slips(awaited) == []


EAR = """from course_interfaces.action import Lift
class Lift(Node):
    def __init__(self):
        self.server = ActionServer(self, Lift, 'lift', self.execute, goal_callback=self.check)
        self.create_subscription(LaserScan, 'scan', self.hear, 10)
    def check(self, goal):
        return {condition}
from sensor_msgs.msg import LaserScan
class Ear(Node):
    def hear(self, msg):
        return {condition}
"""


@pytest.mark.parametrize(
    ("condition", "told"),
    [
        ("msg.ranges == []", "note: line 11: `msg.ranges == []` is always false: the field is an array"),
        ("[] != msg.intensities", "note: line 11: `[] != msg.intensities` is always true: the field is an array"),
        ("list(msg.ranges) == []", ""),
        ("goal.floors == []", "note: line 7: `goal.floors == []` is always false"),
        ("goal.other == []", ""),
        ("self.ranges == []", ""),
        ("msg.header == []", ""),
    ],
)
def test_an_array_of_a_message_beside_a_list_is_told(condition, told):
    found = "\n".join(slips(EAR.format(condition=condition)))
    assert found.startswith(told) and bool(found) == bool(told)


SERVES = """%%exercise motors.py
from example_interfaces.srv import AddTwoInts
from std_srvs.srv import SetBool, Trigger

class Motors(Node):
    def __init__(self):
        super().__init__('motors')
        self.create_service(SetBool, '/motors/enable', self.{enable})
        self.create_service(Trigger, '/motors/status', self.{status})
        self.create_service(AddTwoInts, '/add', self.add)
        {register}

    def enable(self, request, response):
        {line}
        return response

    def status(self, request, response):
        return response

    def add(self, request, response):
        {add}
        return response

    def check(self, params):
        {check}

    def changed(self, params):
        for each in params:
            if each.name == 'ki':
                self.ki = each.value
"""
ALL = "self.add_on_set_parameters_callback(self.check); self.add_post_set_parameters_callback(self.changed)"
RESULT = "return SetParametersResult(successful=True)"


@pytest.mark.parametrize(
    ("part", "written", "says"),
    [
        ("line", "self.on = request.data", ""),
        ("line", "self.on = request.data == 'true'",
         ("line 13: `request.data == 'true'` is always false: the field is True or False, not a text. Use "
          "`request.data` alone, or `not request.data`.")),
        ("line", "self.on = 'on' != request.data", "`'on' != request.data` is always true: the field is True or"),
        ("line", "self.on = request.data == True", ""),
        ("line", "request.data = str(request.data); self.on = request.data == 'True'", ""),
        ("add", "self.big = request.a == '5'", "is always false: the field is a number. Compare it with a number."),
        ("add", "self.big = request.a == 5 and response.sum == '5'", ""),
        ("add", "self.total =+ request.a * 2",
         "line 20: `self.total =+ request.a * 2` replaces its value. To add to it, write `self.total += request.a *"),
        ("add", "self.total = +request.a", ""),
        ("add", "self.total =+ 5", ""),
        ("add", "self.total =+ 1", "`self.total =+ 1` replaces its value. To add to it, write `self.total += 1`."),
        ("add", "self.total =- 1", "`self.total =- 1` replaces its value. To subtract from it, write `self.total -= 1"),
        ("add", "self.total =-1", ""),
        ("add", "self.total = - 1", ""),
        ("add", "question.a = 1\n        question.a = 2",
         ("line 21: `question.a` is set here, and in line 20 just before it, whose value is lost. Is another field "
          "meant in one of the two?")),
        ("add", "question.a = 1\n        question.a = question.a + 2", ""),
        ("add", "question.a = 1\n        question.b = 2", ""),
        ("status", "enable",
         ("line 8: /motors/status is served by `self.enable`, and nothing uses the method `status`. Did you mean "
          "`self.status`?")),
        ("enable", "status", "line 7: /motors/enable is served by `self.status`, and nothing uses the method `enable`"),
        ("check", "SetParametersResult(successful=False)\n        " + RESULT,
         ("line 24: `SetParametersResult(...)` alone neither refuses nor accepts anything: write `return "
          "SetParametersResult(...)`.")),
        ("register", ALL.partition("; ")[0],
         ("line 26: 'changed' looks at the parameters that it is given, and nothing calls or registers it: write "
          "`self.add_post_set_parameters_callback(self.changed)` in `__init__`.")),
        ("register", ALL.partition("; ")[2],
         ("line 23: 'check' returns a SetParametersResult, and nothing calls or registers it: write "
          "`self.add_on_set_parameters_callback(self.check)` in `__init__`.")),
        ("register", f"return\n        self.timer = self.create_timer(1.0, self.tick)\n        {ALL}",
         "line 11: this never runs: the `return` of line 10 ends the function."),
        ("register", f"{ALL.partition('; ')[0]}; getattr(self, 'changed')", ""),
    ],
)  # fmt: skip
def test_what_a_file_makes_and_does_not_use_is_told(part, written, says):
    parts = {"enable": "enable", "status": "status", "register": ALL, "line": "self.on = True", "add": "self.n = 1"}
    parts |= {"check": RESULT, part: written}
    told = "\n".join(slips(SERVES.format(**parts)))
    assert says in told and bool(says) == bool(told), told
    assert says or not slips(SERVES.format(**parts).partition("\n")[2])


PARAMETERS = """class Pid(Node):
    def __init__(self):
        for name, default in (('kp', 1.0), ('ki', 0.0)):
            self.declare_parameter(name, default)
        self.declare_gain('kd', 1.0)
        self.add_post_set_parameters_callback(self.changed)
    def declare_gain(self, name, most):
        self.declare_parameter(name, 0.0)
    def changed(self, params):
        for each in params:
            if {test}:
                self.integral = 0.0
"""


@pytest.mark.parametrize(
    ("test", "says"),
    [
        ("each.name == 'ki'", ""),
        ("each.name == 'Ki'", "line 11: no parameter 'Ki' is declared, so this is never true. Did you mean 'ki'?"),
        ("each.name == 'KD'", "line 11: no parameter 'KD' is declared, so this is never true. Did you mean 'kd'?"),
        ("each.name == 'other'", ""),
        ("each.name == 'ki' and each.value != self.get_parameter('ki').value",
         ("line 11: `each.value != self.get_parameter('ki').value` is always false: a post-set callback runs when "
          "the new value is stored. Keep the value before in an attribute of the node.")),
        ("self.get_parameter(each.name).value == each.value", "(each.name).value == each.value` is always true"),
        ("each.name == 'ki' and each.value != self.get_parameter('kp').value", ""),
        ("each.name == 'ki' and each.value > self.get_parameter('ki').value", ""),
        ("each.name == 'ki' and each.value != self.ki", ""),
    ],
)  # fmt: skip
def test_a_condition_on_a_parameter_that_never_changes_is_told(test, says):
    told = "\n".join(slips(PARAMETERS.format(test=test)))
    assert says in told and bool(says) == bool(told), told


@pytest.mark.parametrize(
    ("line", "product"),
    [
        ("return max(-0.5, min(0.5, 1.5(0.6 - right)))", "1.5 * (0.6 - right)"),
        ("return 2(right)", "2 * right"),
        ("return 1.5 * (0.6 - right)", ""),
        ("return gain(0.6 - right)", ""),
        ("return 1.5()", ""),
    ],
)
@pytest.mark.filterwarnings("ignore:.*object is not callable:SyntaxWarning")
def test_a_number_that_is_called_is_told(line, product):
    number = product.partition(" ")[0]
    told = f"note: line 2: the number {number} is not a function. To multiply, write `{product}`."
    assert slips(f"def decide(right):\n    {line}\n") == ([told] if product else [])


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("self.create_timer(0,1, self.look)", ["0,1"]),
        ("self.create_timer(0,10, callback=self.look)", ["0,10"]),
        ("self.declare_parameter('output_min', -10,0)", ["-10,0"]),
        ("self.declare_parameter(name, 1,0, described)", ["1,0"]),
        ("return max(-0,5, min(0,5, self.turn(right)))", ["-0,5", "0,5"]),
        ("return min(0.5, 1,5 * (0.6 - right))", ["1,5"]),
        ("return np.clip(turn, -0,5, 0,5)", ["-0,5", "0,5"]),
        ("self.create_timer(0.1, self.look)", []),
        ("self.declare_parameter('kp', 1)", []),
        ("return max(0,5,right)", []),
        ("return max(0, 5, right)", []),
        ("return np.clip(turn, 0,5)", []),
        ("return self.turn(0,5, right)", []),
        ("return max(right, 0,\n                   5)", []),
    ],
)
def test_a_decimal_comma_between_two_arguments_is_told(line, told):
    says = "note: line 3: Python takes `{}` for two arguments: a number has a decimal point, `{}`."
    text = f"class Follower(Node):\n    def turns(self, right, turn, name, described):\n        {line}\n"
    assert slips(text) == [says.format(each, each.replace(",", ".")) for each in sorted(told)]
    assert slips(f"x = 1\x0c\n{text}") == [each.replace("line 3", "line 5") for each in slips(text)]


@pytest.mark.parametrize(
    ("given", "returned", "told"),
    [
        ("", "GoalResponse.ACCEPT", "goal_callback"),
        ("", "CancelResponse.REJECT", "cancel_callback"),
        (", goal_callback=self.look", "GoalResponse.ACCEPT", ""),
        (", goal_callback=lambda goal: self.look(goal)", "GoalResponse.ACCEPT", ""),
        ("", "goal.floors", ""),
    ],
)  # fmt: skip
def test_a_callback_that_an_action_server_is_not_given_is_told(given, returned, told):
    text = "class Cabin(Node):\n    def __init__(self):\n        super().__init__('cabin')\n"
    text += f"        self.server = ActionServer(self, Lift, 'lift', self.execute{given})\n"
    text += "    def execute(self, goal_handle):\n        return Lift.Result()\n"
    text += f"    def look(self, goal):\n        return {returned}\n"
    says = f"note: line 7: 'look' returns a {returned.partition('.')[0]}, and nothing calls or registers it: write "
    says += f"`{told}=self.look` where the ActionServer is made."
    assert slips(f"%%exercise cabin.py\n{text}") == ([says] if told else [])


@pytest.mark.parametrize(
    ("sets", "told"),
    [
        ("goal = future.result()", True),
        ("self.goal = goal = future.result()", False),
        ("self.goal = future.result()", False),
        ("done = future.result()", False),
    ],
)
def test_a_variable_beside_an_attribute_that_stays_none_is_told(sets, told):
    text = "class Client(Node):\n    def __init__(self):\n        self.goal = None\n"
    text += f"    def accepted(self, future):\n        {sets}\n        print({sets.split()[0]})\n"
    text += "    def cancel(self):\n        return self.goal.cancel_goal_async()\n"
    says = "note: line 5: `goal` is a variable of 'accepted' alone, and nothing sets `self.goal`, which stays None. To "
    assert slips(f"%%exercise client.py\n{text}") == ([f"{says}set that, write `self.goal = ...`."] if told else [])


@pytest.mark.parametrize(
    ("value", "asked", "told"),
    [
        ("'False'", "if self.stopped:", "False"),
        ("'True'", "while not self.stopped:", "True"),
        ("False", "if self.stopped:", ""),
        ("'False'", "if self.stopped == 'False':", ""),
        ("'no'", "if self.stopped:", ""),
    ],
)
def test_a_text_for_a_bool_is_told(value, asked, told):
    text = f"class Motors:\n    def __init__(self):\n        self.stopped = {value}\n"
    text += f"    def look(self):\n        {asked}\n            return 1\n"
    says = f"note: line 3: `{value}` is a text, and each text but the empty one is true: write `{told}`."
    assert slips(text) == ([says] if told else [])


@pytest.mark.parametrize(
    ("returned", "asked", "told"),
    [
        ("self.came is not None and self.get_clock().now() - self.came", "if self.is_fresh():", True),
        ("self.get_clock().now() - self.came", "if not self.is_fresh():", True),
        ("self.get_clock().now() - self.came < FRESH", "if self.is_fresh():", False),
        ("self.get_clock().now() - self.came", "if self.is_fresh() < FRESH:", False),
    ],
)
def test_a_duration_as_a_condition_is_told(returned, asked, told):
    text = f"class Follower(Node):\n    def is_fresh(self):\n        return {returned}\n"
    text += f"    def look(self):\n        {asked}\n            return 1\n"
    says = "note: line 3: `self.get_clock().now() - self.came` is a Duration, which is always true: compare it with "
    assert slips(text) == ([f"{says}another one, such as `Duration(seconds=0.5)`."] if told else [])


STEPS = """import time
class PidNode(Node):
    def hear(self, msg):
        now = {clock}
        step = {step}
        self.total += msg.data * {used}
        self.last = now
"""


@pytest.mark.parametrize(
    ("clock", "step", "used", "told"),
    [
        ("time.time()", "now - self.last", "step", True),
        ("time.time()", "now - self.last if self.last else 0.0", "step", True),
        ("time.time()", "0.0", "(now - self.last)", True),
        ("time.monotonic()", "now - self.last", "step", False),
        ("time.time()", "now - self.last", "2.0", False),
        ("msg.time()", "now - self.last", "step", False),
        ("time.time()", "now - begin", "step", False),
    ],
)
def test_a_step_by_a_clock_that_may_be_set_is_told(clock, step, used, told):
    says = "note: line 4: `time.time()` jumps when the clock of the computer is set. To measure a step, use "
    says += "`time.monotonic()`, which does not."
    assert slips(STEPS.format(clock=clock, step=step, used=used)) == ([says] if told else [])


@pytest.mark.parametrize("exercise", answers.names())
def test_no_page_and_no_right_answer_has_one(exercise):
    for cell in cells.read(NOTEBOOKS / exercise / f"{exercise}.ipynb"):
        assert cell.kind != "code" or slips(cell.source) == doubts("the cell", cell.source) == [], cell.source
    for name in answers.load(exercise).RIGHT:
        for file, text in answers.files(exercise, name).items():
            assert slips(f"%%exercise {file}\n{text.decode(errors='replace')}") == [], (name, file)
            assert doubts(file, text.decode(errors="replace")) == [], (name, file)


@pytest.mark.parametrize(
    ("sets", "more", "told"),
    [
        ("self.come = 1", "", True),
        ("self.come = self.came = 1", "", False),
        ("self.come = 1", "setattr(self, 'came', 1)", False),
        ("self.come = 1", "print(self.come)", False),
        ("self.home = 1", "", False),
    ],
)
def test_an_attribute_that_stays_none_beside_one_that_nothing_reads_is_told(sets, more, told):
    text = "class Follower(Node):\n    def __init__(self):\n        self.came = None\n"
    text += f"    def hear(self, msg):\n        {sets}\n        {more or 'pass'}\n        return self.came\n"
    says = ["note: line 5: nothing in the file reads `self.come`. Did you mean `self.came`?"] if told else []
    assert slips(f"%%exercise follower.py\n{text}") == says


RELAYS = """class Relay(Node):
    def __init__(self):
        self.create_service(Trigger, '/relay', {callback})
    {define} relay(self, request, response):
        return response
"""


@pytest.mark.parametrize(
    ("define", "callback", "says"),
    [
        ("async def", "lambda q, r: self.relay(q, r)", "and nothing awaits it. Pass `self.relay` itself."),
        ("async def", "callback=lambda q, r: self.relay(r, q)", "Pass an `async def` that awaits `self.relay`."),
        ("async def", "self.relay", ""),
        ("async def", "lambda q, r: self.executor.create_task(self.relay(q, r)) and r", ""),
        ("def", "lambda q, r: self.relay(q, r)", ""),
    ],
)
def test_a_lambda_that_only_begins_a_coroutine_is_told(define, callback, says):
    told = "".join(slips(RELAYS.format(define=define, callback=callback)))
    assert told.endswith(says) and told.startswith("note: line 3: the lambda only begins `self.relay`") == bool(says)


CALCULATES = """class Calculator(Node):
    def calculate(self, request, response):
        {before}
        if request.operation == '{first}':
            response.result = 1
        elif {word} == '{second}':
            response.result = 2
        elif {word} == 'multiply':
            response.result = 3
        return response
"""
SENDS = "compares with '{}', which no client sends. The operation is called '{}'."


@pytest.mark.parametrize(
    ("before", "word", "first", "second", "says"),
    [
        ("pass", "request.operation", "add", "substract", [f"6: `request.operation == 'substract'` {SENDS}"]),
        ("kind = request.operation", "kind", "Add", "subtract", [f"4: `request.operation == 'Add'` {SENDS}"]),
        ("pass", "request.operation", "add", "subtract", []),
        ("pass", "request.operation", "add", "sub", []),
        ("pass", "request.operation", "add", "Add", []),
        ("x = request.operation.title()", "request.operation", "Add", "subtract", []),
        ("kind = input()", "kind", "add", "substract", []),
    ],
)
def test_an_operation_that_no_client_sends_is_told(before, word, first, second, says):
    text = CALCULATES.format(before=before, word=word, first=first, second=second)
    wrong = ("Add", "add") if first == "Add" else ("substract", "subtract")
    assert slips(f"%%exercise server.py\n{text}") == [f"note: line {each.format(*wrong)}" for each in says]


@pytest.mark.parametrize(
    ("test", "sets", "says"),
    [
        ("self.state == 'stoped'", "self.state = 'stopped'", "is never true. Did you mean 'stopped'?"),
        ("self.state != 'Stopped'", "self.state = 'stopped'", "is always true. Did you mean 'stopped'?"),
        ("self.state == 'stoped'", "self.state = 'on' if request.data else 'stopped'", "Did you mean 'stopped'?"),
        ("self.state == 'stopped'", "self.state = 'stopped'", ""),
        ("self.state == 'broken'", "self.state = 'stopped'", ""),
        ("self.state == 'stoped'", "self.state = 'stopped'; self.state = request.text", ""),
        ("self.state == 'stoped'", "self.state = 'stopped'; setattr(self, 'state', name)", ""),
        ("self.state == 'stoped'", "self.state, self.last = 'stopped', self.state", ""),
        ("self.state == 'stoped'", "self.state = 'stopped'; self.state += 'x'", ""),
    ],
)
def test_a_state_that_nothing_sets_is_told(test, sets, says):
    text = "class Motors(Node):\n    def __init__(self):\n        self.state = 'off'\n"
    text += f"    def enable(self, request, response):\n        response.success = {test}\n        {sets}\n"
    told = "".join(slips(f"%%exercise motors.py\n{text}        return response\n"))
    assert told.endswith(says) and bool(told) == bool(says), told


COUNTS = """class Counter(Node):
    def __init__(self):
        ActionServer(self, Fibonacci, 'count', self.execute)
    def execute(self, goal_handle):
        for number in range(3):
            if goal_handle.is_cancel_requested:
                {ends}
        goal_handle.succeed()
"""


@pytest.mark.parametrize(
    ("ends", "told"),
    [
        ("break", True),
        ("return Fibonacci.Result()", True),
        ("goal_handle.canceled(); break", False),
        ("self.stop()", False),
    ],
)
def test_a_cancel_that_never_ends_the_goal_as_canceled_is_told(ends, told):
    says = "note: line 7: a goal whose cancel is requested ends as canceled only by `goal_handle.canceled()`, which"
    found = slips(COUNTS.format(ends=ends))
    assert len(found) == told and all(each.startswith(says) for each in found)


MANY = """class Many(Node):
    def __init__(self):
        self.create_subscription(Float64, 'error', self.error_callback, 10)
        self.add_on_set_parameters_callback(self.check)
        self.client = self.create_client(Add, 'add')
    def error_callback(self, msg):
        {callback}
    def check(self, params):
        {check}
    def state(self):
        {state}
    def ask(self, a):
        {ask}
        self.client.call_async(request)
        return self.handle.get_result_async()
"""
NEW = "request = Add.Request()\n        "
FILLED = "answer = Float64()\n        answer.data = 2 * msg.data\n        "
LIMITS = "low, high = self.value('output_min'), self.value('output_max')\n        "


@pytest.mark.parametrize(
    ("part", "line", "says"),
    [
        ("callback", "integral = 0.0\n        integral += msg.data",
         "line 7: `integral` begins at 0.0 each time that 'error_callback' is called, and what it gathers is lost."),
        ("callback", "integral = 0.0\n        integral += msg.data\n        self.integral = integral", ""),
        ("callback", "integral = 0.0\n        for each in msg.data: integral += each", ""),
        ("callback", "effort = 0.0\n        effort += msg.data", ""),
        ("callback", "self.last = msg.data\n        slope = (msg.data - self.last) / 2",
         "line 8: `msg.data - self.last` is always 0: line 7 has just set `self.last` to `msg.data`. Set it below"),
        ("callback", "slope = msg.data - self.last\n        self.last = msg.data", ""),
        ("callback", "self.last = msg.data\n        self.state()\n        slope = msg.data - self.last", ""),
        ("callback", "self.last = msg.data\n        msg = self.other\n        slope = msg.data - self.last", ""),
        ("callback", "self.last = msg.data\n        if msg: self.last = 1\n        slope = msg.data - self.last", ""),
        ("callback", FILLED + "self.effort.publish(Float64())",
         "uses `answer`, which is filled below line 7. Write `self.effort.publish(answer)`."),
        ("callback", FILLED + "self.effort.publish(answer if answer.data else Float64())", ""),
        ("callback", FILLED + "self.effort.publish(Float64())\n        self.last = answer", ""),
        ("callback", "answer = Float64()\n        self.effort.publish(Float64())", ""),
        ("callback", FILLED + "self.effort.publish(Float64(data=1.0))", ""),
        ("callback", "effort = min(self.output_min, msg.data)",
         "line 7: `min(self.output_min, msg.data)` is never above the lower limit. `max(output_min, ...)` keeps an"),
        ("callback", "effort = min(max(0, msg.data), self.output_min)", "is never above the lower"),
        ("callback", "effort = max(self.output_min, min(self.output_max, msg.data))", ""),
        ("callback", "if min(self.output_min, self.output_max) < 0: pass", ""),
        ("callback", LIMITS + "effort = min(low, max(high, msg.data))", "is never above the lower limit."),
        ("callback", LIMITS + "if data > low: low = high = 1.0\n        effort = min(low, max(high, msg.data))", ""),
        ("callback", LIMITS + "effort = max(low, min(high, msg.data))", ""),
        ("callback", "low = -self.output_max\n        effort = max(low, msg.data)", ""),
        ("callback", LIMITS + "if effort > high: effort = low",
         "line 8: a value above the upper limit is set to the lower one here: the two are exchanged. Write `ef"),
        ("callback", LIMITS + "if low >= effort: effort = high", "a value below the lower limit is set to the upper"),
        ("callback", LIMITS + "if effort > high: effort = high\n        elif effort < low: effort = low", ""),
        ("callback", LIMITS + "if low > high: low = high", ""),
        ("callback", LIMITS + "if effort > high: print(low)", ""),
        ("callback", "angular = min(-0.5, max(0.5, 1.5 * msg.data))",
         "line 7: `min(-0.5, max(0.5, 1.5 * msg.data))` is always -0.5: the two limits are exchanged. Write `m"),
        ("callback", "angular = max(0.5, min(-0.5, msg.data))", "is always 0.5: the two limits are exchanged."),
        ("callback", "angular = max(-0.5, min(0.5, msg.data))", ""),
        ("callback", "angular = min(0.5, max(-0.5, msg.data))", ""),
        ("callback", "angular = min(0.5, max(low, msg.data))", ""),
        ("callback", "if angular > 0.5: angular = -0.5", "is set to the lower one here: the two are exchanged."),
        ("callback", "if angle > 180: angle = -180", ""),
        ("callback", "if angular > 0.5: angular = 0.5", ""),
        ("callback", "if effort < 0: effort = 0", ""),
        ("check", "if 'low' in params: pass",
         "line 9: `'low' in params` is always false: `params` is a list of Parameters, not of their names. A dict of"),
        ("check", "params = {each.name: each for each in params}\n        if 'low' in params: pass", ""),
        ("check", "if 'low' in [each.name for each in params]: pass", ""),
        ("state", "return f'Motors {self.state}'", "line 11: `{self.state}` shows the method itself. Call it: `{self"),
        ("state", "return f'Motors {self.state()} {self.stopped}'", ""),
        ("state", "if word.lower == 'add': pass",
         "line 11: `word.lower` is the method itself, which is never equal to a text. Call it: `word.lower()`."),
        ("state", "if word.lower() == 'add' or self.lower == 1: pass", ""),
        ("state", "if self.lower == 'add': self.lower = ''", ""),
        ("state", "if end.status == 'SUCCEEDED': pass",
         "compares a number with a text. Write `end.status == GoalStatus.STATUS_SUCCEEDED` (from action_msgs.msg)."),
        ("state", "if WORDS[end.status] == 'SUCCEEDED' or self.status == 'stopped': pass", ""),
        ("state", "if word == 'add': pass\n        elif 'multiply': pass",
         "line 12: `'multiply'` is always true on its own. Write `word == 'multiply'`."),
        ("state", "if 'multiply': pass", "line 11: `'multiply'` is always true on its own. Compare something with it."),
        ("ask", f"{NEW}a = request.a", "line 14: `a = request.a` reads a field of the new `request`. To set it, write"),
        ("ask", f"{NEW}request.a = a\n        a = request.a", ""),
        ("ask", "request = Add.Request(a=a)\n        a = request.a", ""),
        ("ask", f"{NEW}default = request.a", ""),
        ("ask", "a = request.a", ""),
    ],
)  # fmt: skip
def test_a_value_that_is_lost_or_can_be_no_other_is_told(part, line, says):
    cell = MANY.format(**{"callback": "pass", "check": "pass", "state": "pass", "ask": "pass", part: line})
    found = slips(cell)
    assert len(found) == bool(says) and says in "".join(found), found


@pytest.mark.parametrize(("age", "told"), [("self.came - self.get_clock().now()", 1), ("self.due - time.time()", 0)])
def test_an_age_with_its_times_swapped_is_told_where_it_is_kept_in_a_variable(age, told):
    cell = AGES.format(line="pass").replace("        pass\n", f"        age = {age}\n        return age <= FRESH\n", 1)
    found = slips(cell)
    assert len(found) == told and all(each.startswith("note: line 7: ") for each in found), found


ANGLES = "angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))"
TELLS = "compares radians with degrees: the angles of a scan are in radians, and `np.degrees(...)` converts them."


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("back = (angles >= 150) & (angles <= 210)", "angles >= 150"),
        ("back = np.abs(angles % 360 - 180) <= 30", "np.abs(angles % 360 - 180) <= 30"),
        ("back = [each for each in beams if 150 < each * scan.angle_increment]", "150 < each * scan.angle_increment"),
        ("back = abs(angles % (2 * math.pi) - math.pi) <= 30", "abs(angles % (2 * math.pi) - math.pi) <= 30"),
        ("back = abs(angles - math.pi) <= 0.5", ""),
        ("back = angles * DEGREE >= 150", ""),
        ("back = (scan.angle_min + scan.angle_increment * DEGREE) >= 150", ""),
        ("factor = 180 / math.pi; back = [each * scan.angle_increment * factor >= 150 for each in beams]", ""),
        ("factor = 180 / math.pi; back = angles >= 150", ""),
        ("angles *= DEGREE; back = angles >= 150", ""),
        ("back = np.degrees(angles) >= 150", ""),
        ("angles = in_degrees(angles); back = angles >= 150", ""),
        ("back = in_degrees(angles) >= 150", ""),
        ("back = angles * 57 >= 150", ""),
        ("back = abs(scan.angle_min + scan.angle_increment * (beam - 180)) < 0.5", ""),
        ("back = angles >= limits['back'] or len(angles) >= 180", ""),
    ],
)
def test_angles_in_radians_that_are_compared_with_degrees_are_told(line, told):
    found = slips(f"def rear(scan):\n    'In degrees.'\n    {ANGLES}\n    {line}\n    return back\n")
    assert found == ([f"note: line 4: `{told}` {TELLS}"] if told else [])


CHECKED = """class Checked(Node):
    def __init__(self):
        super().__init__("checked")
        {}
        self.declare_parameter("threshold", 50.0)
    def validate(self, parameters):
        return SetParametersResult(successful=parameters[0].value < 100.0)
    def changed(self, parameters):
        for each in parameters:
            print(each.name, each.value)
"""


def test_a_check_that_nothing_registers_is_told_in_a_cell_that_starts_its_class():
    cell = CHECKED.format("pass")
    (told,) = slips(f"{cell}ros.start(Checked)\n")
    assert told.startswith("note: line 6: 'validate' returns a SetParametersResult, and nothing calls or registers it")
    registered = CHECKED.format("self.add_on_set_parameters_callback(self.validate)")
    assert slips(cell) == slips(f"{cell}ros.start(Other)\n") == slips(f"{registered}ros.start(Checked)\n") == []


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("if each > top: return False\n        return True", True),
        ("if each > top: return False\n        else: return True", True),
        ("low = each - 1\n        with lock:\n            if low: return low\n            return top", True),
        ("if each > top: return False", False),
        ("return each", False),  # the first one is meant
        ("if each > top: continue\n        if each: return 1\n        return 2", False),
        ("if each > top: break\n        return True", False),
        ("try: return ask(each)\n        except TimeoutError: return None", False),
        ("if each > top: return False\n        print(each)", False),
        ("if each > top: return False\n        elif each: return True", False),
    ],
)
def test_a_loop_that_returns_in_its_first_round_is_told(body, told):
    says = "note: line 2: each path through this loop ends with a `return`, so only the first of `floors` is looked at."
    found = slips(f"def fits(floors, top):\n    for each in floors:\n        {body}\n    return True\n")
    assert len(found) == told and all(each.startswith(says) for each in found), found
    assert slips(f"def fits(top):\n    for each in range(top):\n        {body}\n    return True\n") == []


MOTORS = """%%exercise motors.py
class Motors(Node):
    def __init__(self):
        self.stopped = {first}
    def stop(self, request, response):
        {line}
        if stopped:
            self.enabled = False
        return response
    def state(self):
        return 'stopped' if self.{read} else 'on'
"""


@pytest.mark.parametrize(
    ("line", "first", "read", "told"),
    [
        ("stopped = request.data", "False", "stopped", True),
        ("stopped = self.stopped", "False", "stopped", False),
        ("self.stopped = stopped = request.data", "False", "stopped", False),
        ("stopped = request.data; self.stopped = stopped", "False", "stopped", False),
        ("stopped = request.data; setattr(self, 'stopped', stopped)", "False", "stopped", False),
        ("stopped = request.data and self.stopped", "False", "stopped", False),
        ("stopped = OTHER.data", "False", "stopped", False),
        ("stopped = request.data", "10", "stopped", False),
        ("stopped = request.data", "False", "other", False),
    ],
)
def test_a_variable_that_hides_an_attribute_that_nothing_sets_is_told(line, first, read, told):
    says = (
        "note: line 5: `stopped` is a variable of 'stop' alone, and nothing sets `self.stopped`, which stays False. To"
    )
    found = slips(MOTORS.format(line=line, first=first, read=read))
    assert len(found) == told and all(each.startswith(says) for each in found), found


@pytest.mark.parametrize(
    ("before", "block", "told"),
    [
        ("cabin = threading.Lock()", "with cabin:", True),
        ("cabin = Lock(); cabin.acquire()", "if cabin.release():", True),
        ("cabin = self.cabin = threading.Lock()", "with cabin:", False),
        ("cabin = self.cabin", "with cabin:", False),
        ("cabin = threading.Lock(); self.cabin = cabin", "with cabin:", False),
        ("cabin = threading.Lock(); Thread(target=self.move, args=(cabin,)).start()", "with cabin:", False),
        ("cabin = threading.Lock(); run = lambda: cabin.acquire()", "with cabin:", False),
    ],
)
def test_a_lock_that_each_call_makes_is_told(before, block, told):
    says = "note: line 3: each call of 'execute' makes a lock of its own here, which no other call waits for. Make it"
    text = "class Lift(Node):\n    def execute(self, goal_handle):\n"
    found = slips(f"{text}        {before}\n        {block}\n            self.move()\n")
    assert len(found) == told and all(each.startswith(says) for each in found), found
    once = text.replace("execute", "__init__")
    assert slips(f"{once}        {before}\n        {block}\n            self.move()\n") == []


@pytest.mark.parametrize(
    ("part", "says"),
    [
        ("scan.ranges[-25:25]", "`scan.ranges[-25:25]` is empty where there are 50 beams or more: a slice ends at the"),
        ("scan.ranges[-25:25]", "The two parts are `scan.ranges[-25:]` and `scan.ranges[:25]`."),
        ("ranges[-1:0]", "The two parts are `ranges[-1:]` and `ranges[:0]`."),
        ("ranges[-25:]", ""),
        ("ranges[-25:-5]", ""),
        ("ranges[-25:25:-1]", ""),
        ("ranges[low:high]", ""),
        ("words[-2:2]", ""),
    ],
)  # fmt: skip
def test_a_slice_of_ranges_that_is_empty_is_told(part, says):
    told = "".join(slips(f"def nearest(scan):\n    return min({part})\n"))
    assert says in told and bool(says) == bool(told), told


DOUBLED = """%%exercise motor_service.py
class MotorService(Node):
    def __init__(self):
        super().__init__('motor_service')
        self.create_service(SetBool, 'motors/enable', self.enable)
        {again}

    def enable(self, request, response):
        return response

    {more}
"""


SERVED = "self.create_service(SetBool, {}, self.stop)"
HEARD = "self.create_subscription(Float64, 'error', self.{}, 10)\n        "
LIFT = "self.lift = ActionServer(self, Lift, 'lift', self.go)\n        "
SETTER = (
    "@property\n    def state(self):\n        return 1\n\n    @state.setter\n    def state(self, value):\n        ..."
)


@pytest.mark.parametrize(
    ("again", "more", "says"),
    [
        (SERVED.format("'motors/enable'"), "", "line 5: motors/enable is served twice by this node: each request is"),
        (2 * LIFT, "", "line 6: lift has two action servers in this node: each goal reaches only one of them"),
        (
            2 * HEARD.format("stop"),
            "",
            "line 6: error is subscribed to twice by this node: each message is received twice",
        ),
        (
            "",
            "def enable(self, request, response):\n        ...",
            "line 10: 'enable' is defined in line 7, too, and this",
        ),
        (SERVED.format("'motors/stop'"), "", ""),
        (SERVED.format("'/motors/enable'"), "", ""),  # may be another one, in a namespace
        (f"if self.old:\n            {SERVED.format(repr('motors/enable'))}", "", ""),
        (HEARD.format("stop") + HEARD.format("go"), "", ""),  # two that both listen
        (SERVED.format("'motors/enable'").replace("self", "other", 1), "", ""),
        ("", SETTER, ""),
    ],
)
def test_what_a_text_makes_twice_is_told_with_both_lines(again, more, says):
    told = [line for line in slips(DOUBLED.format(again=again, more=more)) if "twice" in line or "two" in line]
    assert [says in line for line in told] == [True] * bool(says), told


A_NODE = """class Motors(Node):
    {line}


def main(args=None):
    rclpy.spin(Motors())


if __name__ == '__main__':
    main()
"""


@pytest.mark.parametrize(
    ("first", "more", "told"),
    [
        ("%%exercise motors.py\n", A_NODE.format(line="value = 2"),
         "note: line 11: the class 'Motors' is defined in line 1, too. Keep one of the two, and one `main()`."),
        ("%%exercise motors.py\n", "class Motors(Node):\n    value = 2\n",
         "note: line 11: the class 'Motors' is defined in line 1, too. Keep one of the two."),
        ("%%exercise motors.py\n", "class Motors(Motors):\n    value = 2\n", ""),
        ("%%exercise motors.py\n", "class Motor(Node):\n    value = 2\n", ""),
        ("", A_NODE.format(line="value = 2"), ""),
    ],
)  # fmt: skip
def test_a_class_that_a_file_has_twice_is_told_with_both_lines(first, more, told):
    assert slips(f"{first}{A_NODE.format(line='value = 1')}{more}") == ([told] if told else [])


ACCEPTS = """%%exercise lift_server.py
class Lift(Node):
    def __init__(self):
        super().__init__('lift')
        self.server = ActionServer(self, Move, '/lift', self.execute{given})

    def execute(self, goal_handle):
        goal_handle.succeed()
        return Move.Result()

    def take_over(self, goal_handle):
        self.newest = goal_handle
        {begins}
"""


@pytest.mark.parametrize(
    ("given", "begins", "is_told"),
    [
        ("", "goal_handle.execute()", True),
        ("", "threading.Thread(target=goal_handle.execute).start()", True),
        ("", "pass", False),
        (", handle_accepted_callback=self.take_over", "goal_handle.execute()", False),
    ],
)
def test_a_method_that_begins_goals_and_that_nothing_registers_is_told(given, begins, is_told):
    told = "\n".join(slips(ACCEPTS.format(given=given, begins=begins)))
    says = "'take_over' begins an accepted goal, and nothing calls or registers it: write `handle_accepted_callback="
    assert (says in told) == is_told


TWO_NODES = """%%exercise motors.py
class Stop(Node):
    def __init__(self):
        super().__init__('stop')
        {stop}

class Motors(Node):
    def __init__(self):
        super().__init__('motors')
        self.helper = rclpy.create_node('helper')
        {uses}

def main():
    motors = Motors()
    stop = Stop()
    {main}
    {spins}
    stop.destroy_node()
"""


@pytest.mark.parametrize(
    ("parts", "line", "name"),
    [
        ({}, 14, "stop"),
        ({"main": "executor.add_node(stop)"}, 0, ""),
        ({"main": "for each in (stop, motors): executor.add_node(each)"}, 0, ""),
        ({"stop": "self.publisher = self.create_publisher(String, 'a', 10)"}, 0, ""),
        ({"stop": "self.create_client(SetBool, 'a'); rclpy.spin_until_future_complete(self, ask())"}, 0, ""),
        *(
            ({"stop": f"self.create_client(SetBool, 'a'); {spins}"}, 0, "")
            for spins in (
                "rclpy.spin_until_future_complete(node=self, future=ask())",
                "rclpy.spin_once(node=self, timeout_sec=0.1)",
                "rclpy.spin_until_future_complete(self.client, ask())",  # an error says more
                "main(self)",  # a function of the file, which may spin it
            )
        ),
        ({"spins": "run(motors)"}, 0, ""),  # somewhere else, perhaps with all nodes of the program
        ({"main": "executor.add_node(stop)", "uses": "self.helper.create_client(AddTwoInts, 'b')"}, 9, "self.helper"),
        (
            {"main": "add_node(stop); add_node(motors.helper)", "uses": "self.helper.create_client(AddTwoInts, 'b')"},
            0,
            "",
        ),
    ],
)
def test_a_node_with_callbacks_that_nothing_spins_is_told(parts, line, name):
    usual = {"stop": "self.create_service(SetBool, 'stop', self.answer)", "uses": "pass", "main": "pass"}
    told = slips(TWO_NODES.format(**usual | {"spins": "rclpy.spin(motors)"} | parts))
    says = (
        f"note: line {line}: nothing spins the node `{name}`, so its callbacks never run, and no answer reaches its "
        "clients. Make them in the node that is spun, or give both nodes to one executor with `executor.add_node(...)`."
    )
    assert told == ([says] if name else [])


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("self.stopped = False,", "the comma at the end makes a tuple of it: write `False`, without the comma."),
        ("self.stopped = (False,)", ""),
        ("self.first, = values", ""),
        ("first, = values,", ""),
        ("self.both = False, True", ""),
    ],
)
def test_a_comma_that_makes_a_tuple_is_told(line, told):
    text = f"%%exercise motors.py\nclass Motors(Node):\n    def __init__(self):\n        {line}\n"
    assert slips(f"{text}        print(self.stopped, self.first, self.both)\n") == [f"note: line 3: {told}"] * bool(
        told
    )


def test_a_default_that_is_asked_once_is_told():
    heard = "%%exercise pid.py\nimport time\ndef hear(self, msg, now={}):\n    self.now = now\n    print(self.now)\n"
    (told,) = slips(heard.format("time.monotonic()"))
    assert told == (
        "note: line 2: `time.monotonic()` is asked once, when 'hear' is made, and not at each call: write it in the "
        "function."
    )
    assert slips(heard.format("None")) == []


@pytest.mark.parametrize(
    ("default", "field", "holds"),
    [
        ("0", "double_value", "integer_value"),
        ("0.0", "integer_value", "double_value"),
        ("True", "integer_value", "bool_value"),
        ("'elbow'", "string_value", ""),
        ("Parameter.Type.DOUBLE", "integer_value", ""),
        ("0", "integer_value", ""),
    ],
)
def test_a_field_of_another_type_than_that_of_a_parameter_is_told(default, field, holds):
    read = f"self.get_parameter('a').get_parameter_value().{field}"
    cell = f"%%exercise relay.py\nself.declare_parameter('a', {default})\nprint({read})\n"
    told = "\n".join(slips(cell))
    assert (
        (f"`{field}` is empty here:" in told and f"so its value is in `{holds}`." in told) == bool(holds) == bool(told)
    )


def test_a_publisher_that_a_callback_makes_is_told():
    heard = "%%exercise a.py\nself.create_subscription(Float64, 'error', self.hear, 10)\n\ndef hear(self, msg):\n    {}"
    (told,) = slips(heard.format("self.create_publisher(Float64, 'effort', 10).publish(msg)"))
    assert told == (
        "note: line 4: 'hear' makes one more publisher each time that it is called. Make the publisher once, in "
        "`__init__`."
    )
    assert slips(heard.format("self.publisher.publish(msg)")) == []


def test_a_server_is_not_looked_for_in_a_list_that_names_clients():
    text = "%%exercise relay.py\nself.client = self.create_client(AddTwoInts, 'add')\n{}"
    (told,) = slips(text.format("there = 'add' in dict(self.get_service_names_and_types())"))
    assert told == (
        "note: line 2: `get_service_names_and_types()` also lists services that only have a client, as this node's "
        "own. Ask the client: `service_is_ready()`."
    )
    assert slips(text.format("there = self.client.service_is_ready()")) == []


WHOLE = """from std_srvs.srv import SetBool
class Motors(Node):
    def __init__(self):
        self.create_service(SetBool, 'stop', self.stop)
    def stop(self, request, response):
        {line}
        return response
"""


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (
            "if request == True: pass",
            "`request == True` is always false, because `request` is the whole request: its value is `request.data`.",
        ),
        ("if request is not False: pass", "is always true, because `request` is the whole request"),
        ("if request: pass", "`request` is the whole request, which is always true: its value is `request.data`."),
        ("self.enabled = not request and response.success", "`request` is the whole request, which is always true"),
        ("if request.data == True: pass", ""),
        ("request = request.data\n        if request: pass", ""),
        ("if request is None: pass", ""),
    ],
)
def test_a_whole_request_as_a_condition_is_told(line, says):
    told = "\n".join(slips(WHOLE.format(line=line)))
    assert says in told and bool(says) == bool(told), told


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("if answer.message: return 1", "`answer.message` may have a text in a success, too. `answer.success` says"),
        ("if answer.message != '': return 1", "`answer.message` may have a text in a success, too."),
        ("if answer.success: print(answer.message)", ""),
        ("print(answer.message or 'nothing')", ""),
        ("print(answer.message)", ""),
    ],
)
def test_a_client_that_asks_for_another_field_than_success_is_told(line, says):
    text = "%%exercise client.py --no-start\nfrom std_srvs.srv import Trigger\nclass Client(Node):\n"
    text += "    def __init__(self):\n        self.client = self.create_client(Trigger, '/status')\n"
    told = "\n".join(slips(f"{text}    def say(self, answer):\n        {line}\n"))
    assert says in told and bool(says) == bool(told), told


DRIVES = """
class Follower(Node):
    def control_loop(self):
        cmd = Twist()
        {first}
        if self.fresh():
            cmd.linear.x = 0.3
        {last}
"""


@pytest.mark.parametrize(
    ("first", "last", "told"),
    [
        ("self.publisher.publish(cmd)", "pass", True),
        ("self.publisher.publish(cmd)", "cmd.angular.z = 0.1", True),
        ("self.publisher.publish(cmd)", "self.publisher.publish(cmd)", False),
        ("self.publisher.publish(cmd)", "self.send(cmd)", False),
        ("self.publisher.publish(cmd)", "return cmd", False),
        ("while self.fresh(): self.publisher.publish(cmd)", "pass", False),
        ("def send(): self.publisher.publish(cmd)", "send()", False),
        ("pass", "self.publisher.publish(cmd)", False),
    ],
)
def test_a_message_that_is_sent_before_it_is_filled_is_told(first, last, told):
    found = slips(f"%%exercise a.py\n{DRIVES.strip()}".format(first=first, last=last))
    text = "note: line 4: This sends `cmd` while it is empty. Send it below the lines that set its fields, the first of"
    assert [each.startswith(f"{text} which is line 6.") for each in found] == [True] * told, found


HEARS = """
class Pid(Node):
    def __init__(self):
        super().__init__('pid')
        self.publisher = self.create_publisher(Float64, 'effort', 10)
        self.create_subscription(Float64, 'error', self.heard, 10)

    def heard(self, msg):
        {first}
        {second}
        self.publisher.publish(msg)
"""


@pytest.mark.parametrize(
    ("first", "second", "told"),
    [
        ("msg = Float64()", "self.total = self.total + msg.data * 2.0", True),
        ("msg = Float64()", "error = msg.data", True),
        ("msg = Float64()", "error, now = msg.data, time.monotonic()", True),
        ("msg = Float64()", "effort = Float64(data=msg.data)", True),
        ("msg = Float64()", "msg.data = max(-1.0, 2.0 * msg.data)", True),
        ("msg = Float64()", "msg.data = 2.0", False),
        ("error = msg.data; msg = Float64()", "msg.data = 2.0 * msg.data", False),
        ("msg = Twist()", "msg.linear.x = 0.5", False),
        ("msg = Twist()", "speed = msg.linear; speed.x = 0.5", False),
        ("msg = LaserScan()", "msg.ranges.append(1.0)", False),
        ("msg = Float64MultiArray()", "values = msg.data; values.append(1.0)", False),
        ("effort = Float64()", "effort.data = 2.0 * msg.data", False),
    ],
)
def test_a_new_message_that_hides_the_one_that_has_come_is_told(first, second, told):
    found = [each for each in slips(HEARS.format(first=first, second=second)) if "hides" in each]
    text = "note: line 9: This hides the `msg` that has come: `msg.data` in line 10 is that of the new, empty one. Give"
    assert [each.startswith(text) for each in found] == [True] * told, found
