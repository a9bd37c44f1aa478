"""The grader's side of the conversation: it is the robot's laser, its clock, and whoever listens to its wheels.

The agent is asked by a small program of the grader's, and the node is shown scans with an agent that tells what it was
given.  Both run the student's files, and so in the sandbox: see `programs`.
"""

import ast
import contextlib
import itertools
import json
import math
import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import ClassVar, NamedTuple

from geometry_msgs.msg import Twist
from rclpy.parameter import Parameter
from sensor_msgs.msg import LaserScan

from autograder.hidden.ai_integration.rooms import decide
from autograder.hidden.ai_integration.scanner import PLAIN, Scanner
from autograder.hidden.ai_integration.simulated_time import SimulatedTime
from autograder.sandbox.program import Program
from autograder.suitekit import (
    PUBLISH,
    SUBSCRIBE,
    Alive,
    Bench,
    Heard,
    Listener,
    Offers,
    Renamed,
    Run,
    Topic,
    TopicProgram,
    Wrong,
    speaker,
)
from autograder.suitekit.lifecycle import Answer, Question, State
from autograder.suitekit.ros import CLOSED
from autograder.suitekit.untrusted import UNREADABLE
from course.foundation.waiting import wait_until
from course.world import Laser, Room, Simulation
from course.world.node import World

AGENT, NODE = "wall_agent.py", "wall_follower.py"
ASK, ECHO, RIGHT_AGENT = "ask_agent.py", "echo_node.py", "right_agent_node.py"
COURSE = "course.py"  # stands in for the library
PROGRAMS = Path(__file__).parent / "programs"
SCAN = "a subscription to the topic scan (sensor_msgs/LaserScan)"
CMD_VEL = "a publisher of the topic cmd_vel (geometry_msgs/Twist)"
SIMULATED = ("--ros-args", "-p", "use_sim_time:=true")
PERIOD = 0.1  # s of simulated time between two commands

# As in programs/echo_node.py: the numbers that its agent says for 0 m and for each metre more, and what it adds for a
# distance that is infinite, missing or NaN; and where it says what no rule of the task says.
LEAST = {"front": 0.1, "right": 0.3}
A_METRE, FAR, NOTHING, NO_NUMBER = 0.01, 0.17, 0.18, 0.185
STRANGE, STILL, OPPOSITE = 4.25, 4.5, 4.75  # m
BACKWARDS, LEFT, AN_AGENT = -1.0, 1.75, -0.125
FORWARDS, RIGHT = 2.25, -1.5
WIDTH = 0.19  # all numbers for a distance are less than so much above the LEAST
DIGITS = 5  # of these numbers: a millimetre
SAME_SPEED = 1e-6  # m/s and rad/s
A_ROUNDING = 1e-5  # m/s and rad/s: what the 32-bit floats of a scan make of a decision

LONG_ENOUGH = 2.5  # s, in which a robot decides again and again on the same

NEXT = 3  # periods after a scan in which it is fresh whatever the phase of the node's timer
FINE = 0.025  # s of simulated time between two ticks, where a period is too long
TRIES = 6  # ticks until a node must have done what a scan asks for
STAYS = 4  # commands that must then be the same
MORE_TRIES, MORE_STAYS = 30, 11  # the same for a node that cannot be asked, and may have old ticks to work off

SETTLING = 0.5  # s of real time before a rate is measured: discovery, and the commands of before, are over
MEASURED = 2.5  # s of real time in which it is measured: 25 commands, of which a busy machine delays a few
FEWEST = 3  # commands that have a rate
WINDOWS = 3  # times that it is measured, of a node that is right in simulated time, until it is right
FASTEST, FASTEST_TURN = 10.0, 100.0  # m/s and rad/s that no such robot drives

SILENT = 2.0  # s of real time without a command in which a node that keeps its own time sends twenty

STILL_FRESH = (
    0.3  # s of real time for which a scan is certainly fresh: a node that keeps its own time sends two or three
)

DRIVING = 1.0  # s of real time with scans, until a node certainly drives
DRIVING_HERTZ = 20.0  # scans a second then
WATCHED = 3.0  # s of real time without scans: six times as long as a node may drive on

DECISION = 0.2  # s of real time for a command of a drive, until the robot moves on by the one before
DRIVE = 90.0  # s of real time for a drive: more than DECISION for each of its ticks
AGENTS = 2  # that a node may ask: one more than it should, such as one made to try it
IDLE = 20  # ticks of a drive without a command after which it ends
ENDING = 5.0  # s of real time in which a program that has left its topic ends, if it is about to


class Command(NamedTuple):
    """The speeds in a Twist."""

    linear: float  # m/s
    angular: float  # rad/s


STOP = Command(0.0, 0.0)
STOOD_IN = " (All other tests were run with something in its place.)"
BY_RULES = (
    "The node must publish what decide_action of the WallAgent in wall_agent.py returns: another agent was put in its "
    "place, and the node published what the three rules of the task say."
)
NOT_AS_DECIDED = "The node must give the newest distances to its agent, and publish what that decides as it is"
BY_ORDER = " (In the dict that this agent returns, 'angular' comes first.)"
BEST_EFFORT = (
    "In a drive, the robot hears only reliable commands, and the publisher of cmd_vel in wall_follower.py has the "
    "quality of service best effort: leave that out, as in create_publisher(Twist, 'cmd_vel', 10)."
)
CHANGED = " Or the node has changed what its agent decided, as in another test: mend that first."
SECTORS = {"front": "from -25 to 25 degrees", "right": "from -80 to -40 degrees"}


BOTH = frozenset(SECTORS)


class Eye(NamedTuple):
    """A scanner that a node reads right, at least in some sectors: by it, all else about its sight is judged."""

    scanner: Scanner
    sectors: frozenset[str]


BASES = (PLAIN, Scanner(360, -180.0, 1.0), Scanner(360, 0.0, -1.0), Scanner(360, 180.0, -1.0))


class StandstillError(Exception):
    """The node sends no commands any more."""


class Agent:
    """The student's agent, asked by a program of its own."""

    def __init__(self, bench: Bench):
        self._bench = bench
        self.imports_course = AGENT in importing_course(bench.files)
        self.no_floats = ""  # what it returned when it was asked last and the two speeds were not both floats
        self.of_ros = ""  # a package of ROS that it tried to import when it was asked last, and did without

    def ask(
        self, *asked: tuple[float, float], ros: bool = True, last: int = 0, times: int = 1, pause: float = 0.0
    ) -> list[Command]:
        """Return its decision for each front and right (m), in turn; without `ros`, ROS packages cannot be imported.

        The `last` so many are asked several `times` each, the last time after a `pause` (s), and what it decides then
        is what counts.
        """
        questions = [
            _question(distances, times=times if often else 1, pause=pause if often else 0.0)
            for number, distances in enumerate(asked)
            for often in [number >= len(asked) - last]
        ]
        return self._answers(self._begin(questions, ros), len(asked), ros)

    def begin_long(self, *asked: tuple[float, float]) -> None:
        """Begin to ask for each front and right (m) again and again, an agent of its own each; see `finish_long`."""
        self._asked = len(asked)
        self._long = self._begin(
            [
                _question(distances, pause=PERIOD if each == 0 else 0.0, agent=each)
                for _ in range(round(LONG_ENOUGH / PERIOD))
                for each, distances in enumerate(asked)
            ]
        )

    def finish_long(self) -> list[tuple[Command, ...]]:
        """Return its decision for each front and right that `begin_long` asks for, in turn."""
        answers = self._answers(self._long, self._asked * round(LONG_ENOUGH / PERIOD))
        return [tuple(answers[each :: self._asked]) for each in range(self._asked)]

    def _begin(self, questions: Sequence[Mapping[str, float]], ros: bool = True) -> Run:
        """Start the program that asks these."""
        self._bench.hide(*(one[name] for one in questions for name in SECTORS if math.isfinite(one[name])))

        def start() -> Program:
            domain, mode = self._bench.new_domain(), "ros" if ros else "no-ros"
            files = laid(ASK) | stand_in(self._bench.files)
            program = self._bench.start(ASK, mode, json.dumps(questions), domain=domain, files=files, afresh=not ros)
            program.name = AGENT
            return program

        return Run(AGENT, start, self._bench.clock, self._bench.late)

    def _answers(self, run: Run, number: int, ros: bool = True) -> list[Command]:
        """Return the decisions, `number` of them, that the program has printed when it has ended."""
        program = run.finish("with a few distances" if ros else "without ROS 2")
        said, odd, no_floats, of_ros = (
            [line.removeprefix(about) for line in program.output.splitlines() if line.startswith(about)]
            for about in ("answers: ", "odd: ", "no floats: ", "of ROS: ")
        )
        self.no_floats = no_floats[-1] if no_floats else ""
        self.of_ros = of_ros[-1] if of_ros else ""
        try:
            answers = [Command(float(linear), float(angular)) for linear, angular in json.loads(said[-1])]
        except (IndexError, TypeError, *UNREADABLE):
            answers = []
        if len(answers) != number:
            did = f"it returned {odd[-1]}" if odd else f"{AGENT} ended before decide_action had returned"
            raise Wrong(f"decide_action must return a dict with the numbers 'linear' and 'angular': {did}.", said)
        return answers

    def expect(self, *cases: tuple[float, float, Command, str]) -> None:
        """For each front and right (m) it must decide on this command; the text says for what."""
        got = self.ask(*((front, right) for front, right, _, _ in cases))
        for (front, right, wanted, about), answer in zip(cases, got, strict=True):
            if not math.dist(answer, wanted) < SAME_SPEED:
                raise Wrong(
                    f"{about}, the agent must {words(wanted)}; it said {said(answer)}.",
                    f"front {front}, right {right}: {answer}",
                )


def _question(distances: tuple[float, float], times: int = 1, pause: float = 0.0, agent: int = 0) -> dict[str, float]:
    """One question of the program that asks the agent."""
    return {**dict(zip(SECTORS, distances, strict=True)), "times": times, "pause": pause, "agent": agent}


def words(command: Command) -> str:
    """Return the task's description of a right decision."""
    if command.linear == 0.0:
        return "turn left on the spot (linear 0, angular 0.5)"
    if command.linear < 0.3:
        return "drive a curve to the right (linear 0.2, angular -0.4)"
    return "follow the wall (linear 0.3, and angular 1.5 · (0.6 - right) between -0.5 and 0.5)"


def said(command: Command) -> str:
    """A decision, in words for the student."""
    return f"linear {command.linear:.4g}, angular {command.angular:.4g}"


def importing_course(files: Mapping[str, bytes]) -> set[str]:
    """The student's files that cannot be loaded where there is no `course`; not those that try it, and do without."""
    found = set()
    for name, content in files.items():
        with contextlib.suppress(*UNREADABLE):
            for line in _lines(ast.parse(content)):
                modules = [alias.name for alias in line.names] if isinstance(line, ast.Import) else []
                modules += [line.module or ""] if isinstance(line, ast.ImportFrom) else []
                if any(module.partition(".")[0] == "course" for module in modules):
                    found.add(name)
    return found


def _lines(node: ast.AST) -> Iterator[ast.AST]:
    """All that stands in a program, in its functions too, but for what it tries."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.Try):
            yield child
            yield from _lines(child)


def stand_in(files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the files to add beside files that import the course's library; {} if none does."""
    return laid(COURSE) if importing_course(files) else {}


def laid(*names: str) -> dict[str, bytes]:
    """Programs of the grader's, to be laid beside the student's files."""
    return {name: (PROGRAMS / name).read_bytes() for name in names}


class Follower(TopicProgram):
    """The student's node."""

    changes_decisions = False  # whether a test has seen that it publishes something else than its agent decided
    lags = False  # whether most periods of the simulated time that was played last took longer in reality
    advice = "a timer of 10 Hz must publish on cmd_vel, and no callback may wait"
    topics: ClassVar[dict[str, Topic]] = {
        SCAN: Topic("scan", "sensor_msgs/LaserScan", SUBSCRIBE),
        CMD_VEL: Topic("cmd_vel", "geometry_msgs/Twist", PUBLISH),
    }

    def __init__(
        self,
        bench: Bench,
        *args: str,
        renamed: Renamed,
        program: str = "",
        files: dict[str, bytes] | None = None,
        like: "Follower | None" = None,
    ):
        """With a `program` of the grader's, and `files` for it, the node runs in that: see `programs`.

        What never answers, though it is the same node, is `like` it, and waited for as briefly.
        """
        super().__init__(bench, NODE, *args, renamed=renamed)
        self._like = like
        self._program, self.files = program, stand_in(bench.files) | (files or {})

    def launch(self) -> Program:
        """Start the node, with its own agent or the grader's."""
        if not self._program:
            return super().launch()
        domain = self.bench.new_domain()
        files = {**laid(self._program), **(self.files or {})}
        program = self.bench.start(self._program, *self.command_line, domain=domain, files=files)
        program.name = NODE
        self.ros = self.bench.enter(domain)
        self._offers = self.connect()
        return program

    def connect(self) -> Offers:
        """The laser, a subscription of the commands, and the clock."""
        self.commands = Listener(self.ros, "cmd_vel", Twist)
        self.laser = speaker(self.ros, "scan", LaserScan)
        self._time = SimulatedTime(self.ros, self.laser, self.commands, self.allow)
        return {SCAN: lambda: self.laser.get_subscription_count() > 0, CMD_VEL: lambda: self.commands.ready}

    def ask(self, question: Question[Answer], what: str = "a scan") -> Answer:
        """The answer to a question (see `converse`), asked as soon as both topics are there."""

        def gone() -> bool:
            return bool(self.missing((CMD_VEL,)))

        return self.converse(of_the_living(question, gone, self.allow(ENDING)), what, SCAN, CMD_VEL)

    def start_fresh(self) -> None:
        """Have the program running, and no scan shown to it yet."""
        self.ensure_fresh(SCAN, CMD_VEL)

    def renew(self) -> None:
        """End the program, so that the next question begins with a start of its own."""
        if self.state is not State.DOWN:
            self.end()

    def stands_still_in_time(self, seconds: float) -> bool:
        """Return True if it commands to stand still in simulated time, even after this much real time (s)."""

        def look(limit: float, alive: Alive) -> list[Command] | None:
            wait_until(lambda: not alive(), seconds)
            commands = [command for _ in range(STAYS) for command in self.tick()]
            return commands if alive() and commands else None

        return self.ask(look)[-1] == STOP

    def drives_late(self, scan: LaserScan, simulated: float, real: float) -> bool:
        """Return True if it still drives when its last scan is older than this (s), in simulated and in real time.

        Tried with each phase of its timer. That the wall clock makes no difference is looked at only when it drives.
        """
        for _ in range(round(PERIOD / FINE)):
            if self._drives_after(scan, simulated):
                self.tick(period=FINE, wait=False)  # to be in the same phase again
                return self._drives_after(scan, simulated, real)
        return False

    def _drives_after(self, scan: LaserScan, simulated: float, real: float = 0.0) -> bool:
        """Return True if it drives in the period after the scan became so old; False if it cannot be asked."""
        self.expect_driving(scan, "With a fresh scan")

        def look(limit: float, alive: Alive) -> bool | None:
            self.tick(scan, FINE, wait=False)
            wait_until(lambda: not alive(), real)  # it has certainly seen the scan
            for _ in range(round(simulated / FINE)):
                self.tick(period=FINE, wait=False)
            wait_until(lambda: not alive(), real)  # and sent the commands of this time
            before = len(self.commands.heard)
            for _ in range(round(PERIOD / FINE)):
                self.tick(period=FINE, wait=False)
            drives = any(command != STOP for command in commands_of(self.commands.heard[before:]))
            return (drives and self._time.can_be_asked) if alive() else None

        return self.ask(look)

    def says_nothing(self) -> bool:
        """Return True if it sends no command while simulated time moves on, nor in some seconds of real time."""

        def listen(limit: float, alive: Alive) -> bool | None:
            before = len(self.commands.heard)
            for _ in range(STAYS):
                self.tick(wait=False)
            came = self.commands.wait(lambda heard: heard[before:], self.allow(SILENT), alive)
            return not came if alive() else None

        return self.ask(listen)

    def is_mute_in_real_time(self, scan: LaserScan) -> bool:
        """Return True if a node without simulated time never sent a command, not even while it gets this scan."""

        def listen(limit: float, alive: Alive) -> bool | None:
            came = self.commands.wait(lambda heard: heard, self.allow(SILENT), alive)
            if not came:
                self._show(scan, DRIVING_HERTZ, DRIVING)
            return not self.commands.heard if alive() else None

        return self.ask(listen)

    def commands_at(self, scan: LaserScan) -> list[Command]:
        """Return the commands that it sends while it gets this scan again and again; none if it is silent then."""

        def show(limit: float, alive: Alive) -> list[Command] | None:
            self.tick(scan)
            before = len(self.commands.heard)
            for _ in range(STAYS):
                self.tick(scan)
            self.commands.wait(lambda heard: heard[before:], self.allow(STILL_FRESH), alive)
            return commands_of(self.commands.heard[before:]) if alive() else None

        return self.ask(show)

    def tick(self, scan: LaserScan | None = None, period: float = PERIOD, wait: bool = True) -> list[Command]:
        """Move simulated time on by `period` s, with a scan just before; the commands that came of it.

        A node that does not publish by simulated time is waited for, unless told not to `wait`.
        """
        self.fresh = self.fresh and scan is None
        return commands_of(self._time.tick(period, lambda: self.program.alive, scan, wait))

    def simulate(self, seconds: float, step: float, scans: Callable[[int], LaserScan | None]) -> list[Command]:
        """The commands of some simulated time, in which `scans(tick)` is shown at each tick of `step` s."""

        def play(limit: float, alive: Alive) -> list[Command] | None:
            before, times = len(self.commands.heard), [time.monotonic()]
            for tick in range(round(seconds / step)):
                if not alive() or self.bench.clock.left <= 0:
                    return None
                self.tick(scans(tick), step, wait=False)
                times.append(time.monotonic())
            periods = itertools.pairwise(times[:: round(PERIOD / step)])
            self.lags = statistics.median(later - earlier for earlier, later in periods) > PERIOD
            return commands_of(self.commands.heard[before:]) if alive() else None

        return self.ask(play)

    def expect(self, scan: LaserScan, front: float, right: float, about: str, sectors: frozenset[str] = BOTH) -> None:
        """Shown this scan again and again, it must give these distances (m) to the agent, and stay with them.

        Only those of the `sectors` are judged.
        """
        wanted = code_command(front, right)
        got = self._show_until(scan, lambda command: fits(command, wanted, sectors))
        settled = all(fits(command, wanted, sectors) for command in got[-2:])
        for command in got[-STAYS:] if settled else got[-1:]:
            if not fits(command, wanted, sectors):
                changed = CHANGED if self.changes_decisions and is_of_the_agent(command) else ""
                raise Wrong(
                    f"{about}, {difference(command, wanted, sectors)}.{changed}", f"commands {got}, scan {scan}"
                )

    def expect_driving(self, scan: LaserScan, about: str) -> None:
        """Shown this scan again and again, it must do what the agent says, whatever it makes of the scan."""
        got = self._show_until(scan, is_of_the_agent)
        if not is_of_the_agent(got[-1]):
            raise Wrong(f"{about}, {difference(got[-1], got[-1])}.", f"commands {got}, scan {scan}")

    def show_once(self, scan: LaserScan) -> list[Command]:
        """The commands of the time in which this scan, shown once, is fresh whatever the phase of the node's timer."""
        return self.simulate(NEXT * PERIOD, PERIOD, lambda tick: None if tick else scan)

    def expect_at_once(self, scan: LaserScan, front: float, right: float, about: str, sectors: frozenset[str]) -> None:
        """Shown this scan once, it must give these distances (m) to the agent, if it goes by simulated time."""
        wanted = code_command(front, right)
        got = self.show_once(scan)
        if got and self._time.can_be_asked and not any(fits(command, wanted, sectors) for command in got):
            raise Wrong(f"{about}, {difference(got[-1], wanted, sectors)}.", f"commands {got}, scan {scan}")

    def read(self, scan: LaserScan, front: float, right: float) -> frozenset[str]:
        """The sectors whose distances (m) it gives to the agent, shown this scan again and again."""
        wanted = code_command(front, right)
        got = self._show_until(scan, lambda command: fits(command, wanted, BOTH))[-1]
        return frozenset(name for name in BOTH if fits(got, wanted, frozenset([name])))

    def reads(self, scanner: Scanner, eye: Eye, seed: str) -> bool:
        """Return True if it reads the sectors of its eye with this scanner, too."""
        rng = self.bench.random(seed)
        return eye.sectors <= self.read(scanner.flat(rng, front=1.25, right=0.75), 1.25, 0.75)

    def find_eye(self) -> Eye:
        """A scanner that it reads right; raises Wrong when there is none."""
        best = Eye(PLAIN, frozenset())
        for scanner in BASES:
            rng = self.bench.random(f"eye {scanner}")
            read = self.read(scanner.flat(rng, front=1.25, right=0.75), 1.25, 0.75)
            if len(read) > len(best.sectors):
                best = Eye(scanner, read)
            if read == BOTH:
                break
        if not best.sectors:
            last = command_of(self.commands.heard[-1]) if self.commands.heard else STOP
            if self.commands.heard and self._goes_by_rules(1.25, 0.75):
                raise Wrong(f"{BY_RULES} What it makes of scan.ranges could not be tested.")
            decided = code_command(1.25, 0.75)
            if math.dist(last, [round(speed, 2) for speed in decided]) < SAME_SPEED:
                raise Wrong(
                    f"The agent decided on {said(decided)}, and the node published {said(last)}, rounded: it must "
                    "publish what decide_action returns as it is. What it makes of scan.ranges could not be tested."
                )
            did = (
                f"the agent was given {given(last, 'front')} for 'front' and {given(last, 'right')} for 'right'"
                if is_of_the_agent(last)
                else difference(last, last)
            )
            raise Wrong(
                "Shown a wall 1.25 m away everywhere in front, and one 0.75 m away everywhere on the right, by any of "
                f"four scanners, {did}: of what scan.ranges means, nothing could be tested."
            )
        return best

    def _goes_by_rules(self, front: float, right: float) -> bool:
        """Return True if its last command follows the task's rules for these distances (m), and not its agent."""
        twist = self.commands.heard[-1].message
        return math.dist((twist.linear.x, twist.angular.z), decide(front, right)) < A_ROUNDING

    def manner(self, scan: LaserScan) -> dict[str, float]:
        """Return how the agent's speeds reach cmd_vel: their signs, and whether they are swapped."""
        self.expect_driving(scan, "With a fresh scan")
        twist = self.commands.heard[-1].message
        swapped = not is_code(abs(twist.linear.x), "front") and is_code(abs(twist.linear.x), "right")
        return {
            "linear": math.copysign(1.0, twist.linear.x),
            "angular": math.copysign(1.0, twist.angular.z),
            "swapped": swapped,
        }

    def expect_asks_its_agent(self, scan: LaserScan, front: float, right: float) -> None:
        """Its commands must be, word for word, what WallAgent of wall_agent.py has said; the scan shows these (m)."""
        self.expect_driving(scan, "With a fresh scan")
        if self._goes_by_rules(front, right):
            raise Wrong(BY_RULES, self.commands.heard[-1].message)
        self.renamed.expect_none(NODE)
        if NODE in importing_course(self.bench.files):
            raise Wrong(f"{NODE} must not import course: a robot has ROS 2 and NumPy, and no course.{STOOD_IN}")
        twist = self.commands.heard[-1].message
        others = (twist.linear.y, twist.linear.z, twist.angular.x, twist.angular.y)
        if is_code(twist.linear.x, "front") and is_code(twist.angular.z, "right") and not any(others):
            return
        if is_code(-twist.linear.x, "front") and is_code(-twist.angular.z, "right") and not any(others):
            raise Wrong(
                "The node must ask the class WallAgent of wall_agent.py, and publish its numbers with their signs: it "
                "published something else than what that decided.",
                twist,
            )
        for field, number, name in (("linear.x", twist.linear.x, "front"), ("angular.z", twist.angular.z, "right")):
            if not is_code(number, name):
                what = "linear" if name == "front" else "angular"
                swapped = is_code(twist.linear.x, "right") and is_code(twist.angular.z, "front")
                raise Wrong(
                    f"The node must publish '{what}' of what its agent decides as {field}, with its sign: it was "
                    f"{place(twist, name)}.{BY_ORDER if swapped else ''}",
                    twist,
                )
        were = ", ".join(f"{number:.3g}" for number in others)
        raise Wrong(
            "The node must publish 'linear' of what its agent decides as linear.x, 'angular' as angular.z, and 0 in "
            f"the other fields: linear.y, linear.z, angular.x and angular.y were {were}.",
            twist,
        )

    def expect_leaves_it_as_it_is(self, scan: LaserScan, reads: bool) -> None:
        """Expect it to publish its agent's decision, even one that no rule gives; by one agent.

        The scan is `STRANGE`; only a node that `reads` such scans right must show it to its agent so.
        """

        def is_strange(command: Command) -> bool:
            return command.linear <= BACKWARDS and command.angular == LEFT

        got = self._show_until(scan, is_strange)[-1]
        if not reads and not is_strange(got):
            return
        if is_of_the_agent(got):
            raise Wrong(
                f"{NOT_AS_DECIDED}: with {STRANGE} m in front, another agent decides to drive backwards and turn left "
                f"at {LEFT} rad/s. {otherwise(got)}",
                got,
            )
        self.changes_decisions = True  # until it is seen not to
        if not is_strange(got):
            raise Wrong(
                f"The node must publish what its agent decides as it is: another agent decided to drive backwards and "
                f"turn left at {LEFT} rad/s, and the node published {said(got)}.",
                got,
            )
        asked = max(1, round((got.linear - BACKWARDS) / AN_AGENT))
        if abs(got.linear - (right := BACKWARDS + AN_AGENT * asked)) > SAME_SPEED:
            raise Wrong(
                f"The node must publish what its agent decides as it is: another agent decided on {right} m/s, and the "
                f"node published {got.linear}.",
                got,
            )
        self.changes_decisions = False
        if asked > AGENTS:
            raise Wrong(
                f"The node must make one WallAgent, and ask that each time: in these tests it has asked {asked}.", got
            )

    def expect_leaves_the_opposite(self, scan: LaserScan, reads: bool) -> None:
        """The same for a decision with other signs; the scan is `OPPOSITE`."""
        wanted = Command(FORWARDS, RIGHT)

        def is_wanted(command: Command) -> bool:
            return math.dist(command, wanted) < SAME_SPEED

        got = self._show_until(scan, is_wanted)[-1]
        if reads and is_of_the_agent(got):
            raise Wrong(
                f"{NOT_AS_DECIDED}: with {OPPOSITE} m in front, another agent decides on {said(wanted)}. "
                f"{otherwise(got)}",
                got,
            )
        if reads and not is_wanted(got):
            self.changes_decisions = True
            raise Wrong(
                f"The node must publish what its agent decides as it is: another agent decided on {said(wanted)}, and "
                f"the node published {said(got)}.",
                got,
            )

    def _show_until(self, scan: LaserScan, fits: Callable[[Command], bool]) -> list[Command]:
        """The commands that come of showing this scan again and again, until they fit and stay so."""

        def show(limit: float, alive: Alive) -> list[Command] | None:
            got: list[Command] = []
            end = time.monotonic() + limit
            for tries in range(MORE_TRIES):
                if tries >= TRIES and self._time.can_be_asked:
                    break
                got += self.tick(scan)[-1:]
                stays = STAYS if self._time.can_be_asked else MORE_STAYS
                if (len(got) >= stays and all(map(fits, got[-stays:]))) or not alive() or time.monotonic() > end:
                    break
            return got if got and alive() else None

        return self.ask(show)

    def rate(self, scan: LaserScan, hertz: float) -> tuple[float, list[Command]]:
        """Commands a second in real time while scans come at `hertz`, and the commands.

        The rate is by the median of the times between two, which a busy machine hardly moves; or by their mean when
        that makes it higher, as with a node that answers scans and publishes by a timer as well.
        """

        def measure(limit: float, alive: Alive) -> tuple[float, list[Command]] | None:
            if not hertz:  # how it is when scans have stopped coming
                self._show(scan, DRIVING_HERTZ, SETTLING)
                self._show(scan, hertz, SETTLING)
            self._show(scan, hertz, SETTLING)
            before = len(self.commands.heard)
            self._show(scan, hertz, MEASURED)
            # Either the machine stood still, or the node does.
            if len(self.commands.heard) < before + FEWEST and alive():
                self._show(scan, hertz, MEASURED)
            heard = self.commands.heard[before:]
            if len(heard) < FEWEST:
                return (len(heard) / (2 * MEASURED), commands_of(heard)) if alive() else None
            gaps = [later.time - earlier.time for earlier, later in itertools.pairwise(heard)]
            return 1 / min(statistics.median(gaps), statistics.mean(gaps)), commands_of(heard)

        return self.ask(measure)

    def best_rate(self, scan: LaserScan, hertz: float, enough: float) -> float:
        """The highest of some such rates, of which one that is `enough` will do: not each must be of a busy moment."""
        best = 0.0
        for _ in range(WINDOWS):
            best = max(best, self.rate(scan, hertz)[0])
            if best >= enough:
                break
        return best

    def times_to_stop(self, scan: LaserScan) -> tuple[float, float, float]:
        """Return the times (s, real) after the last scan for which it still drives, and until it stands still for good.

        The second is infinite when it does not. The third is the time of its last command; 0 when none came.
        """

        def measure(limit: float, alive: Alive) -> tuple[float, float, float] | None:
            self._show(scan, DRIVING_HERTZ, DRIVING)
            last = time.monotonic()
            wait_until(lambda: not alive(), WATCHED)
            after = [heard for heard in self.commands.heard if heard.time > last]
            standing = [*itertools.takewhile(lambda heard: command_of(heard) == STOP, reversed(after))]
            driving = after[: len(after) - len(standing)]
            return (
                (
                    driving[-1].time - last if driving else 0.0,
                    standing[-1].time - last if standing else math.inf,
                    after[-1].time - last if after else 0.0,
                )
                if alive()
                else None
            )

        return self.ask(measure)

    def drive(self, room: Room, laser: Laser, seed: int, seconds: float) -> Simulation:
        """A drive through a room in simulated time, from a fresh start; `seed` is of the laser's noise."""
        if self._like:
            self.doubt(self._like)
        self.start_fresh()
        if self.commands.best_effort:
            raise Wrong(BEST_EFFORT, certain=True)

        def go(limit: float, alive: Alive) -> Simulation | None:
            self.fresh = False
            settings = [Parameter("fast", value=True), Parameter("seed", value=seed)]
            own = CLOSED | {"parameter_overrides": CLOSED["parameter_overrides"] + settings}
            world = World(room, laser, context=self.ros.node.context, **own)
            watch = StandstillWatch(world, alive)
            try:
                with contextlib.suppress(TimeoutError, StandstillError):
                    world.drive(
                        seconds,
                        on_step=watch.look,
                        find_within=limit,
                        answer_within=DECISION,
                        wall_limit=self.allow(DRIVE),
                        alive=alive,
                    )
            finally:
                world.destroy_node()
            return world.simulation if alive() and world.received else None

        return self.ask(go, "the scans of a drive")

    def beyond_any_robot(self) -> str:
        """The numbers that no robot could carry out of the first such command of this start; empty if there is none."""
        return next(filter(None, (impossible(heard.message) for heard in self.commands.heard)), "")

    def _show(self, scan: LaserScan, hertz: float, seconds: float) -> None:
        """Send the scan again and again, in real time."""
        self.fresh = False
        start = time.monotonic()
        if not hertz:
            time.sleep(seconds)
        for number in range(round(seconds * hertz)):
            time.sleep(max(0.0, start + number / hertz - time.monotonic()))
            scan.header.stamp = self.ros.node.get_clock().now().to_msg()
            self.laser.publish(scan)


def of_the_living(question: Question[Answer], gone: Callable[[], bool], ending: float) -> Question[Answer]:
    """The question, whose answer does not count when the program has died meanwhile, or dies within `ending` s.

    A program that ends has left its topics before; so when it is `gone` from them, its end is waited for.
    """

    def ask(limit: float, alive: Alive) -> Answer | None:
        answer = question(limit, alive)
        if alive() and gone():
            wait_until(lambda: not alive(), ending)
        return answer if alive() else None

    return ask


class StandstillWatch:
    """Ends a drive when the node is dead, or has sent the world no command for IDLE ticks.

    It asks the world itself: whoever else listens may hear of a command many ticks later.
    """

    def __init__(self, world: World, alive: Alive):
        self._world, self._alive = world, alive
        self._received, self._idle = world.received, 0

    def look(self) -> None:
        """After a tick; raises StandstillError."""
        received = self._world.received
        self._idle = self._idle + 1 if received == self._received else 0
        self._received = received
        if self._idle > IDLE or not self._alive():
            raise StandstillError


def impossible(command: Twist) -> str:
    """The numbers of a command that are not finite, or larger than those of any robot, with their names."""
    numbers = {
        f"{part}.{axis}": (getattr(getattr(command, part), axis), limit)
        for part, limit in (("linear", FASTEST), ("angular", FASTEST_TURN))
        for axis in "xyz"
    }
    return " and ".join(f"{name} {number:.3g}" for name, (number, limit) in numbers.items() if not abs(number) <= limit)


def code(name: str, distance: float) -> float:
    """The number that the agent which tells what it was given says for a distance (m)."""
    return round(LEAST[name] + (FAR if math.isinf(distance) else A_METRE * distance), DIGITS)


def is_code(number: float, name: str) -> bool:
    """Return True if a number stands for a distance, or for a missing one."""
    return LEAST[name] - SAME_SPEED <= number < LEAST[name] + WIDTH


def code_command(front: float, right: float) -> Command:
    """Return the command of the agent that reports its input, for these distances (m)."""
    return Command(code("front", front), code("right", right))


def fits(command: Command, wanted: Command, sectors: frozenset[str]) -> bool:
    """Return True if a command reports the wanted distances, in these sectors."""
    return is_of_the_agent(command) and all(
        got == right for name, got, right in zip(SECTORS, command, wanted, strict=True) if name in sectors
    )


def is_of_the_agent(command: Command) -> bool:
    """Return True if a command is one of the agent that reports its input."""
    return all(is_code(speed, name) for name, speed in zip(SECTORS, command, strict=True))


def expect_numbers_each_time(commands: Sequence[Command], about: str) -> None:
    """An agent that was given a number for a distance must be given one each time."""
    decided = [command for command in commands if is_of_the_agent(command)]
    for name in SECTORS:
        number = [*SECTORS].index(name)
        without = sum(command[number] == round(LEAST[name] + NOTHING, DIGITS) for command in decided)
        if 0 < without < len(decided):
            raise Wrong(
                f"The agent must be given 'front' and 'right' each time that it is asked, also twice about one scan: "
                f"{about}, in {without} of {len(decided)} commands it was given no number for '{name}'. A dict that "
                "decide_action changes must not be given to it again.",
                commands,
            )


def difference(command: Command, wanted: Command, sectors: frozenset[str] = BOTH) -> str:
    """Return what is wrong with a command of the agent that reports its input, in words for the student."""
    if command == STOP:
        return "the robot was told to stand still, although a fresh scan was there"
    if not is_of_the_agent(command):
        return (
            "the node must publish what decide_action of the WallAgent in wall_agent.py returns: another agent was put "
            "in its place, and the node did not do what it said"
        )
    for name, got, right in zip(SECTORS, command, wanted, strict=True):
        what = f"`{name}` must be the nearest usable distance {SECTORS[name]}"
        if name not in sectors or got == right:
            continue
        if got in (round(LEAST[name] + NOTHING, DIGITS), round(LEAST[name] + NO_NUMBER, DIGITS), code(name, math.inf)):
            return f"{what}: decide_action was given {given(command, name)} for '{name}'"
        rounded = any(got == round(right, digits) for digits in (2, 3))
        instead = "; or the node has rounded what its agent decided, which it must publish as it is" if rounded else ""
        size = "small" if got < right else "large"
        return f"{what}: the agent was given {given(command, name)}, which is too {size}{instead}"
    return "it must stay so for as long as the scan stays the same"


def given(command: Command, name: str) -> str:
    """Return the distance that the agent was given, in words for the student."""
    said = command[[*SECTORS].index(name)] - LEAST[name]
    known = {FAR: "inf", NOTHING: "no number", NO_NUMBER: "NaN"}
    odd = next((word for value, word in known.items() if abs(said - value) < SAME_SPEED), None)
    return odd or f"{said / A_METRE:.2f} m"


def otherwise(command: Command) -> str:
    """Return what a command of the agent that reports its input shows, where the agent had to decide otherwise."""
    return (
        f"Shown such a scan again and again, the node published {said(command)}, which that agent decides for "
        f"{given(command, 'front')} in front and {given(command, 'right')} on the right: it was given other distances "
        "than those of the newest scan, or the node published something else than its newest decision."
    )


def place(twist: Twist, name: str) -> str:
    """Return where the agent's number is in a message, in words for the student."""
    for part in ("linear", "angular"):
        for axis in "xyz":
            number = getattr(getattr(twist, part), axis)
            if is_code(abs(number), name):
                return f"found in {part}.{axis}{', with the other sign' if number < 0 else ''}"
    return "found in no field"


def command_of(heard: Heard) -> Command:
    """Return the agent's two numbers in a message on cmd_vel, wherever they are and with any signs."""
    linear, angular = heard.message.linear, heard.message.angular
    if is_code(linear.x, "front") and is_code(angular.z, "right"):
        return Command(round(linear.x, DIGITS), round(angular.z, DIGITS))
    numbers = [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]
    if not any(numbers):
        return STOP
    found = [next((abs(number) for number in numbers if is_code(abs(number), name)), None) for name in SECTORS]
    front, right = found
    if front is None or right is None:
        return Command(round(linear.x, 3), round(angular.z, 3))
    return Command(round(front, DIGITS), round(right, DIGITS))


def commands_of(heard: Sequence[Heard]) -> list[Command]:
    """Return the commands in messages on cmd_vel."""
    return [command_of(message) for message in heard]
