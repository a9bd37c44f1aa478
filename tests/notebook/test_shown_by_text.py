"""Remarks of a check from the text of a program: true of the mistake, and none on a right program."""

import math

import pytest

from course.notebook.judging import more_timers, sets_in_a_check, unlike
from course.notebook.shown_by_text import (
    another_name,
    asked_by_a_timer,
    asked_once,
    broken_chain,
    built_early,
    late_newest,
    lock_of_a_step,
    never_reads,
    no_cancel,
    odd_values,
    other_unit,
    published_only_if,
    read_once,
    seen_wrongly,
    still_none,
    unconverted,
    unread_limit,
    unseen_scans,
    zero_replaced,
)
from tests.hidden import answers
from tests.mistakes import SOLUTIONS

LOOP = """class Follower(Node):
    def __init__(self):
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.1, self.loop)
    def loop(self):
        {body}
    def send(self, cmd):
        self.pub.publish(cmd)
"""
ALONE = "\nThis runs in a branch of the `if` of line 6 alone. "


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ("if self.scan:\n            self.pub.publish(cmd)", f"line 7\n    self.pub.publish(cmd){ALONE}"),
        ("if self.scan:\n            self.send(cmd)", f"line 7\n    self.send(cmd){ALONE}"),
        ("if not self.scan:\n            return\n        self.pub.publish(cmd)",
         "line 7\n    return\nThis ends 'loop' without a command. "),
        ("if self.scan:\n            cmd = self.decide()\n        self.pub.publish(cmd)", ""),
        ("if self.scan:\n            self.send(cmd)\n        else:\n            self.send(Twist())", ""),
        ("try:\n            cmd = self.decide()\n        finally:\n            self.send(cmd)", ""),
        ("if not self.scan:\n            self.send(Twist())\n            return\n        self.send(cmd)", ""),
        ("pass", ""),
    ],
)  # fmt: skip
def test_a_command_that_is_published_in_a_branch_alone_is_told(tmp_path, monkeypatch, body, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "follower.py").write_text(LOOP.format(body=body))
    said = published_only_if("follower.py")
    assert says in said and bool(said) == bool(says)


def sees_nothing(file: str) -> str:
    return seen_wrongly(file, nothing=True)


@pytest.mark.parametrize("name", answers.load("ai_integration").RIGHT)
def test_of_a_right_follower_nothing_is_said(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    for file, text in answers.files("ai_integration", name).items():
        (tmp_path / file).write_bytes(text)
    assert sees_nothing("wall_follower.py") == more_timers("wall_follower.py") == ""


def test_of_a_right_program_nothing_is_said(monkeypatch):
    monkeypatch.chdir(SOLUTIONS / "ai_integration")
    for told in (published_only_if, unconverted, unseen_scans):
        assert told("wall_follower.py") == ""
    monkeypatch.chdir(SOLUTIONS / "actions")
    assert no_cancel("lift_server.py") == late_newest("lift_server.py") == ""


@pytest.mark.parametrize(
    ("degrees", "told"),
    [
        ("np.degrees(angles % (2 * math.pi))", True),
        ("np.degrees(angles % math.tau)", True),
        ("np.degrees(angles) % 360", True),
        ("np.degrees(angles % (2 * math.pi)) - 180", False),
        ("np.degrees(angles % (2 * math.pi) - math.pi)", False),
        ("np.degrees(np.where(angles % math.tau > 3, angles, 0))", False),
        ("np.degrees(angles) % 360\n    degrees[degrees > 180] -= 360", False),
        ("np.degrees(angles) % 360\n    usable &= (degrees - 5) % 360 < 90", False),
    ],
)
def test_angles_that_are_never_negative_are_told(tmp_path, monkeypatch, degrees, told):
    text = (SOLUTIONS / "ai_integration" / "wall_follower.py").read_text()
    right = "np.degrees((angles + math.pi) % (2 * math.pi) - math.pi)"
    assert right in text
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wall_follower.py").write_text(text.replace(right, degrees))
    said = sees_nothing("wall_follower.py")
    assert said.endswith("none of them is from -80 to -40: bring them to -180 to 180.") == told == bool(said)


def test_a_server_that_never_looks_for_a_cancel_is_told(tmp_path, monkeypatch):
    text = (SOLUTIONS / "actions" / "lift_server.py").read_text()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lift_server.py").write_text(text.replace("goal_handle.is_cancel_requested", "False"))
    assert no_cancel("lift_server.py").startswith(". Nothing in lift_server.py reads `is_cancel_requested` of ")


@pytest.mark.parametrize(
    ("has", "says"),
    [
        ({"a": "float32", "name": "string"}, "`a` is a float32 and must be a float64"),
        ({"a": "float64", "nam": "string"}, "`nam` is one too many, `name` is missing"),
        ({"name": "string", "a": "float64"}, "the order must be a, name"),
    ],
)
def test_fields_that_differ_are_told_with_what_they_must_be(has, says):
    assert unlike(has, {"a": "float64", "name": "string"}) == says


@pytest.mark.parametrize(
    ("exercise", "file", "changes", "told", "says"),
    [
        ("actions", "lift_server.py", {"        self.newest = goal_handle\n": "", "        with self.cabin:\n":
         "        with self.cabin:\n            self.newest = goal_handle\n"}, late_newest,
         "\n    self.newest = goal_handle\nThis stores the new goal only when it has the lock"),
        ("actions", "lift_server.py", {"        with self.cabin:\n": "        self.newest = goal_handle\n"
         "        with self.cabin:\n            self.newest = goal_handle\n"}, late_newest, ""),
        ("actions", "lift_server.py", {"        self.newest = goal_handle\n": "        while self.cabin.locked():\n"
         "            time.sleep(0.1)\n        self.newest = goal_handle\n"}, late_newest,
         "\n    while self.cabin.locked():\nThe new goal waits here, and is stored only after that, in line 48: "),
        ("actions", "lift_server.py", {"        self.newest = goal_handle\n":
         "        with self.cabin:\n            self.newest = goal_handle\n"}, late_newest,
         "\nThe new goal waits here"),
        ("actions", "lift_server.py", {"        self.newest = goal_handle\n":
         "        with self.guard:\n            self.newest = goal_handle\n"}, late_newest, ""),
        ("actions", "lift_server.py", {"            time.sleep(period)\n":
         "            with self.cabin:\n                time.sleep(period)\n"}, lock_of_a_step,
         "\n    with self.cabin:\nThis holds the lock for one step alone, so a new goal may count its stops while"),
        ("actions", "lift_server.py", {}, lock_of_a_step, ""),
        ("ai_integration", "wall_follower.py", {}, lambda file: odd_values(file, -math.inf), ""),
        ("ai_integration", "wall_follower.py", {"np.isinf(ranges) |": "np.isfinite(ranges) &",
         "    ranges[np.isneginf(ranges)] = 0.0  # too near to be measured\n": ""},
         lambda file: odd_values(file, -math.inf), "\n-inf is not finite, so this leaves it out. It is a dist"),
        ("ai_integration", "wall_follower.py",
         {"    usable =": "    ranges = np.nan_to_num(ranges, nan=math.inf)\n    usable ="},
         lambda file: odd_values(file, math.nan), ""),
        ("ai_integration", "wall_follower.py", {"    usable =": "    ranges = np.nan_to_num(ranges)\n    usable ="},
         lambda file: odd_values(file, math.nan), "\nThis makes 0.0 of NaN, an obstacle at 0 m. Leave those beams out"),
        ("ai_integration", "wall_follower.py", {"scan.angle_increment *": "abs(scan.angle_increment) *"}, sees_nothing,
         "The angle_increment of a scanner that turns clockwise is negative: without its sign the beams on the right "),
        ("ai_integration", "wall_follower.py", {"    distances = {}\n": "    distances = {}\n"
         "    if abs(scan.angle_increment) < 1e-9:\n        return {}\n"}, sees_nothing, ""),
        ("ai_integration", "wall_follower.py", {"- self.scan_time <= FRESH": "- self.scan_time).nanoseconds <= 0.5",
         "return self.get_clock().now()": "return (self.get_clock().now()"}, sees_nothing,
         "These are nanoseconds, 500,000,000 of which are half a second: divide them by 1e9."),
        ("ai_integration", "wall_follower.py", {}, lambda file: unread_limit(file, "range_max"), ""),
        ("ai_integration", "wall_follower.py", {" & (ranges <= scan.range_max)": ""},
         lambda file: unread_limit(file, "range_max"), "reads `range_max` of the scan"),
        ("services", "relay.py", {}, asked_by_a_timer, ""),
        ("services", "relay.py", {"if not self.client.service_is_ready()": "self.look()\n        if not self.there",
         "    async def relay": "    def look(self):\n        self.there = self.client.service_is_ready()\n"
         "        self.create_timer(9.0, self.look)\n\n    async def relay"}, asked_by_a_timer, ""),
        ("services", "relay.py", {"if not self.client.service_is_ready()": "if not self.there",
         "    async def relay": "    def look(self):\n        self.there = self.client.service_is_ready()\n"
         "        self.create_timer(9.0, self.look)\n\n    async def relay"}, asked_by_a_timer,
         ("\n    self.there = self.client.service_is_ready()\nOnly a timer looks for the server, "
          "`self.create_timer(9.0, self.look)`, so each request is answered by its last look. Look in the callback")),
        ("ai_integration", "wall_follower.py", {"np.degrees(": "("}, unconverted,
         ". The angles of a scan are in radians, those of the sectors in wall_follower.py are in degrees"),
        ("ai_integration", "wall_follower.py", {"np.degrees(": "180 / np.pi * ("}, unconverted, ""),
        ("ai_integration", "wall_follower.py", {"        self.scan_time = self.get_clock().now()\n": "",
         "        cmd = Twist()\n": "        self.scan_time = self.get_clock().now()\n        cmd = Twist()\n"},
         unseen_scans,
         ("\nThis is the time of a command, not of a scan. Keep the time at which a scan comes in 'laser_callback'.")),
        ("ai_integration", "wall_follower.py", {"        cmd = Twist()\n":
         "        self.sent = self.get_clock().now()\n        cmd = Twist()\n"}, unseen_scans, ""),
        ("calculator", "calculator_server.py", {"elif request.operation == 'subtract'":
         "if request.operation == 'subtract'"}, lambda file: broken_chain(file, "add"),
         "This `if` begins a new chain, whose last branches run for 'add' as well: write `elif`."),
        ("calculator", "calculator_server.py", {}, lambda file: broken_chain(file, "add"), ""),
        ("calculator", "calculator_server.py", {"== 'subtract'": "== 'substract'"},
         lambda file: broken_chain(file, "subtract"),
         "`request.operation == 'substract'` compares with 'substract', which no client sends. The op"),
        ("calculator", "calculator_server.py", {"== 'subtract'": "== 'substract'"},
         lambda file: broken_chain(file, "add"), ""),
        ("calculator", "calculator_server.py", {"elif request.operation == 'subtract'":
         "if request.operation == 'subtract'"}, lambda file: broken_chain(file, "subtract"), ""),
        ("ai_integration", "wall_follower.py", {"        self.cmd_vel_pub.publish(cmd)\n": ""}, published_only_if,
         ": nothing in wall_follower.py calls `publish`"),
        ("parameters", "pid_node.py", {"self.last_error, self.last_time = error, now": "self.last_error = error"},
         still_none, "`self.last_time` is None here, and nothing in pid_node.py sets it to anything else."),
        ("parameters", "pid_node.py", {}, still_none, ""),
        ("parameters", "pid_node.py", {"param.name == 'ki'": "param.name == 'kp'"},
         lambda file: another_name(file, "ki"), "\nThis looks at kp, and nothing in the callbacks for new values"),
        ("parameters", "pid_node.py", {}, lambda file: another_name(file, "ki"), ""),
        ("parameters", "pid_node.py", {"get_parameter(name).value": "get_parameter(name).value or 1.0"}, zero_replaced,
         "\nFor `or`, 0 counts as false, so 1.0 is used in the place of 0. Write `self.get_parameter(name).value` al"),
        ("parameters", "pid_node.py", {}, zero_replaced, ""),
        ("calculator", "calculator_client.py", {"if not response.success:": "if not response:"},
         lambda file: never_reads(file, "success"), "Nothing in calculator_client.py reads `success` of the response"),
        ("calculator", "calculator_client.py", {}, lambda file: never_reads(file, "success"), ""),
        ("ai_integration", "wall_follower.py", {"Duration(seconds=0.5)": "Duration(seconds=500)"}, unseen_scans,
         "\nThis is 500 s: half a second is 0.5."),
        ("ai_integration", "wall_follower.py", {"scan.angle_min + scan.angle_increment * np.arange(len(ranges))":
         "np.linspace(scan.angle_min, scan.angle_max, len(ranges))"}, sees_nothing,
         "Do not rely on `angle_max`, which a scanner may leave at 0"),
        ("ai_integration", "wall_follower.py", {"'right': (-80, -40)": "'right': (-40, -80)"}, sees_nothing,
         "\nNo angle is above -40 and below -80: the smaller one comes first."),
        ("ai_integration", "wall_follower.py", {"'right': (-80, -40)": "'right': (40, 80)"}, sees_nothing,
         "\nAngles grow to the left: those on the right are negative, from -80 to -40."),
        ("ai_integration", "wall_follower.py", {"'right': (-80, -40)": "'right': (40, 80)",
         "np.degrees(": "np.degrees(-angles "}, sees_nothing, ""),
        ("ai_integration", "wall_follower.py",
         {"np.degrees((angles + math.pi) % (2 * math.pi) - math.pi)": "np.degrees(angles)"}, sees_nothing,
         "go from 0 to 360 degrees: nothing in wall_follower.py brings them to -180 to 180"),
        ("ai_integration", "wall_follower.py", {"        self.scan_time = self.get_clock().now()\n": ""}, sees_nothing,
         "`self.scan_time` is None here, and nothing in wall_follower.py sets it to anything else."),
        ("ai_integration", "wall_follower.py", {"        self.distances = nearest(msg)\n": "",
         "        self.scan_time = self.get_clock().now()\n": "        return nearest(msg)\n"}, sees_nothing,
         "'laser_callback' is called with each scan, and what it returns is lost: a callback"),
        ("ai_integration", "wall_follower.py", {"'scan', self.laser_callback,": "'scan', nearest,"}, sees_nothing,
         "'nearest' is called with each scan, and what it returns is lost: a callback"),
        ("ai_integration", "wall_follower.py", {"<= FRESH": "> FRESH"}, sees_nothing,
         "\nThis is true for a scan that is older than FRESH, and so may not be used."),
        ("ai_integration", "wall_follower.py", {"        self.scan_time = self.get_clock().now()\n":
         "        self.scan_time = self.get_clock().now()\n        self.control_loop()\n"}, more_timers,
         "\nThis publishes once more for each message that 'laser_callback' gets: the timer alone gives"),
    ],
)  # fmt: skip
def test_a_cause_that_the_text_shows_is_told(tmp_path, monkeypatch, exercise, file, changes, told, says):
    text = (SOLUTIONS / exercise / file).read_text()
    for old, new in changes.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    monkeypatch.chdir(tmp_path)
    (tmp_path / file).write_text(text)
    assert says in told(file) and bool(told(file)) == bool(says)


@pytest.mark.parametrize(
    ("got", "says"),
    [(2.6, ""), (2.5e9, ", 1,000,000,000 times as much: is the step in nanoseconds?"), (2500.0, "in milliseconds?"),
     (40.0, ""), (-2.5e9, "")],
)  # fmt: skip
def test_a_time_in_another_unit_is_asked_about(got, says):
    assert says in other_unit(got, 2.6) and bool(other_unit(got, 2.6)) == bool(says)


MOTORS = """class Motors(Node):
    def __init__(self):
        self.create_service(SetBool, '/motors/stop', self.stop)
        self.create_service(SetBool, '/motors/enable', self.enable)
    def state(self):
        return 'stopped' if self.stopped else 'running'
    def stop(self, request, response):
        {body}
        return response
    def enable(self, request, response):
        response.message = str(self.on)
        self.on = request.data
        return response
"""
EARLY = "response.message = f'Motors {self.state()}'"


@pytest.mark.parametrize(
    ("body", "says"),
    [
        (f"{EARLY}\n        self.stopped = request.data",
         f"line 8\n    {EARLY}\nThis reads `self.stopped` before line 9 changes it. Build the answer last."),
        (f"{EARLY}\n        if request.data:\n            self.stopped = True", "before line 10 changes it."),
        (f"{EARLY}\n        self.stopped = request.data\n        {EARLY}", ""),
        (f"self.stopped = request.data\n        {EARLY}", ""),
        (f"{EARLY}\n        self.count = 1", ""),
        (f"response.success = not self.stopped\n        self.stopped = False\n        {EARLY}", ""),
    ],
)  # fmt: skip
def test_an_answer_that_is_built_before_the_change_is_told(tmp_path, monkeypatch, body, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "motors.py").write_text(MOTORS.format(body=body))
    said = built_early("motors.py", "/motors/stop")
    assert says in said and bool(said) == bool(says)


@pytest.mark.parametrize(
    ("begins", "asks", "told"),
    [
        ("self.ready = self.client.service_is_ready()", "return self.ready", True),
        ("self.client.wait_for_service(timeout_sec=5.0)", "return self.client.service_is_ready()", False),
        ("pass", "return self.client.service_is_ready()", False),
        ("pass", "return True", False),
    ],
)
def test_a_server_that_is_looked_for_once_is_told(tmp_path, monkeypatch, begins, asks, told):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "relay.py").write_text(
        f"class Relay(Node):\n  def __init__(self):\n    {begins}\n  def ask(self):\n    {asks}\n"
    )
    said = asked_once("relay.py")
    assert (f"line 3\n    {begins}\nThis looks for the server once, at the start." in said) == bool(said) == told


@pytest.mark.parametrize(("asks", "told"), [("return self.a", True), ("return self.get_parameter('a').value", False)])
def test_a_parameter_that_is_read_once_is_told(tmp_path, monkeypatch, asks, told):
    monkeypatch.chdir(tmp_path)
    text = (
        "class Relay(Node):\n  def __init__(self):\n    self.a = self.get_parameter('a').value\n  def ask(self):\n    "
    )
    (tmp_path / "relay.py").write_text(text + asks)
    said = read_once("relay.py")
    assert ("line 3\n    self.a = self.get_parameter('a').value\nThis reads the parameter once" in said) == told
    assert bool(said) == told


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (
            "self.integral = 0.0",
            "line 5\n    self.integral = 0.0\nThis changes `self.integral` while a change is only being ",
        ),
        ("self.set_parameters(params)", "line 5\n    self.set_parameters(params)\nThis sets a parameter while another"),
        ("integral = self.integral", ""),
    ],
)
def test_an_on_set_callback_that_acts_is_told(tmp_path, monkeypatch, line, says):
    monkeypatch.chdir(tmp_path)
    text = "class Pid(Node):\n  def __init__(self):\n    self.add_on_set_parameters_callback(self.check)\n"
    (tmp_path / "pid.py").write_text(
        f"{text}  def check(self, params):\n    {line}\n    return SetParametersResult()\n"
    )
    said = sets_in_a_check("pid.py")
    assert says in said and bool(says) == bool(said)


CHAIN = """if word == 'add':
    result = 1
{0} word == 'subtract':
    result = 2
{1} word == 'divide':
    result = 3
else:
    success = False
"""


@pytest.mark.parametrize(
    ("words", "word", "says"),
    [
        (("if", "if"), "add", "line 3\n    if word == 'subtract':\nThis `if` begins a new chain, whose last"),
        (("if", "if"), "add", "run for 'add' as well: write `elif`. So do the others below it."),
        (("if", "if"), "subtract", "line 5\n    if word == 'divide':\n"),
        (("elif", "if"), "subtract", "line 5\n    if word == 'divide':\n"),
        (("if", "elif"), "add", "line 3\n    if word == 'subtract':\n"),
        (("if", "if"), "divide", ""),
        (("elif", "elif"), "add", ""),
        (("if", "if"), "power", ""),
    ],
)
def test_a_chain_of_ifs_is_told_for_the_words_that_its_else_runs_for(tmp_path, monkeypatch, words, word, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "server.py").write_text(CHAIN.format(*words))
    said = broken_chain("server.py", word)
    assert says in said and bool(says) == bool(said)


@pytest.mark.parametrize(
    ("test", "told"),
    [
        ("word not in ('add', 'divide')", True),
        ("word in ('multiply', 'power')", True),
        ("word != 'add'", True),
        ("word not in ('divide', 'power')", False),
        ("word in ('add', 'plus')", False),
        ("word not in KNOWN", False),
        ("word in 'multiply'", False),
        ("other not in ('add', 'divide')", False),
    ],
)
def test_a_chain_that_first_asks_for_unknown_words_is_told_of_too(tmp_path, monkeypatch, test, told):
    monkeypatch.chdir(tmp_path)
    chain = f"if word == 'add':\n    result = 1\nif {test}:\n    success = False\nelif b == 0:\n    success = False\n"
    (tmp_path / "server.py").write_text(f"{chain}else:\n    result = a / b\n")
    for sets in ("", "result"):
        assert ("line 3\n" in (said := broken_chain("server.py", "add", sets))) == told == bool(said)
    assert broken_chain("server.py", "add", sets="success") == ""
