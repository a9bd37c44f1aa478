"""A run of the follower with another agent, beside its check: the node must publish what that decides, as it is."""

import contextlib
import json
import math
import os
import shutil
import signal
import tempfile
import threading
from pathlib import Path

from course.errors import CourseError, ExerciseError, LiveError
from course.foundation.waiting import wait_until
from course.notebook.judging import run
from course.session.domains import claim_domain
from course.session.live import live
from course.session.node_process import NodeProcess

DECIDED = (-0.25, 1.5)  # m/s and rad/s, which no rule of the task decides
STILL = (0.0, 0.0)  # m/s and rad/s, which no rule decides either
ENOUGH = 10  # commands after the first decision, one of which must say it; after so many decisions it stands still
LATER = 3  # decisions, with which a command that is under way may come
MANY = 4  # agents that a node may have made by then: it needs one
LIMIT = 5.0  # s for which a check waits for it at its end
MOST = 30.0  # s until it has published enough
MORE = 3.0  # s until it has done so once more, standing still
Command = tuple[float, ...]  # m/s, rad/s, and how many agents there were
NEARLY = 1e-6  # m/s and rad/s
AGENT = "wall_agent.py"
# What is put behind the agent's file, in a copy of it: a scanner of its own, and a list of what is published.
BEHIND = """


def _another_agent(cls, decided, still, enough, told):
    import math
    import threading
    import time

    import rclpy
    from geometry_msgs.msg import Twist
    from rclpy.publisher import Publisher
    from sensor_msgs.msg import LaserScan

    made, asked, first, publish = [], [], cls.__init__, Publisher.publish

    def begin(self, *args, **kwargs):
        made.append(self)
        first(self, *args, **kwargs)

    def decide(self, *args, **kwargs):
        asked.append(self)
        print(len(asked), file=told)
        linear, angular = decided if len(asked) <= enough else still
        return {{"angular": angular, "linear": linear}}

    def tell(self, message):
        if isinstance(message, Twist) and asked:
            print(message.linear.x, message.angular.z, len(made), file=told)
        publish(self, message)

    def scan():
        context = rclpy.Context()
        rclpy.init(context=context)
        node = rclpy.create_node("scanner", context=context)
        scanner = node.create_publisher(LaserScan, "scan", 10)
        seen = LaserScan(angle_increment=math.radians(1.0), range_min=0.1, range_max=8.0, ranges=[1.0] * 360)
        while True:
            seen.header.stamp = node.get_clock().now().to_msg()
            publish(scanner, seen)
            time.sleep(0.1)

    cls.__init__, cls.decide_action, Publisher.publish = begin, decide, tell
    threading.Thread(target=scan, daemon=True).start()


_another_agent(WallAgent, {decided}, {still}, {enough}, open({told!r}, "a", buffering=1))
"""


# Distances (m), and the speeds (m/s, rad/s) that the rules of the task decide.
RULES = (
    ({"front": 0.4, "right": 0.6}, (0.0, 0.5)),
    ({"front": 3.0, "right": 2.0}, (0.2, -0.4)),
    ({"front": 3.0, "right": 0.703}, (0.3, -0.1545)),
    ({"front": 3.0, "right": 0.9}, (0.3, -0.45)),
    ({"front": 3.0, "right": 0.5}, (0.3, 0.15)),
    ({"front": 3.0, "right": 0.0}, (0.3, 0.5)),
)
ASK = """
import json, sys, wall_agent
agent = wall_agent.WallAgent()
print()
print(json.dumps([agent.decide_action(seen) for seen in json.loads(sys.argv[1])], default=repr))
"""


def wrong_agent() -> str:
    """Return a sentence on an agent that does not follow the rules by itself; '' if it does, or gives no answer."""
    try:
        decided = json.loads(run(ASK, json.dumps([seen for seen, _ in RULES]), file=AGENT).splitlines()[-1])
        for (seen, wanted), action in zip(RULES, decided, strict=True):
            got = action["linear"], action["angular"]
            if math.dist(got, wanted) > NEARLY:
                return (
                    f"the reason is {AGENT}, whose check comes first: at {seen} it decides {got}, and must decide "
                    f"{wanted}"
                )
    except (CourseError, IndexError, KeyError, TypeError, ValueError):  # its own check tells of that
        return ""
    return ""


class AnotherAgent:
    """A run of the node `file` in a ROS domain of its own, with a scanner, and an agent that decides `DECIDED`.

    After some decisions it decides `STILL`.  It ends by itself, also when the check fails meanwhile.
    """

    def __init__(self, file: str):
        self._file = file
        # The number of each decision, and of each command after it its two speeds and how many agents there were.
        self._told: list[list[float]] = []
        self._over = threading.Event()
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        with contextlib.suppress(LiveError, OSError), tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
            claim, domain = claim_domain()  # unless none is free: then this is left out
            with claim:
                folder, told = Path(name), Path(name, "told")
                told.touch()
                for path in Path().glob("*.py"):
                    shutil.copyfile(path, folder / path.name)
                with (folder / AGENT).open("a", encoding="utf-8") as agent:
                    agent.write(BEHIND.format(decided=DECIDED, still=STILL, enough=ENOUGH, told=str(told)))
                process = NodeProcess(folder / self._file, [], domain=domain)
                for count, most in ((ENOUGH, MOST), (2 * ENOUGH + LATER, MORE)):
                    wait_until(lambda: _commands(told, count) or process.ended, most, alert=False)  # noqa: B023
                self._told = _lines(told)
                with contextlib.suppress(ProcessLookupError):  # a thread of it keeps it from ending as others do
                    os.kill(process.pid, signal.SIGKILL)
                process.stop()
        self._over.set()

    def is_published(self) -> None:
        """Raise ExerciseError if no command says what the agent decided, or if each one has an agent of its own.

        A node that has asked nothing by then is not judged.
        """
        told = self._told if live().until(self._over.is_set, LIMIT) else []
        asked = 0.0
        commands: list[Command] = []
        later: list[Command] = []  # those since it was decided to stand still
        for first, *more in told:
            if more:
                commands.append((first, *more))
                later.extend(commands[-1:] if asked > ENOUGH + LATER else ())
            else:
                asked = first
        if len(commands) >= ENOUGH:
            self._as_decided(commands, later, stands=asked > ENOUGH + 2 * LATER)

    def _as_decided(self, commands: list[Command], later: list[Command], *, stands: bool) -> None:
        linear, angular, made = commands[-1]
        if all(command[:2] != DECIDED for command in commands):
            raise ExerciseError(
                f"{self._file} must publish what its agent decides, as it is: another agent, in the place of "
                f"{AGENT}, decided {DECIDED}, and it published {linear, angular}"
            )
        if stands and all(command[:2] != STILL for command in later):
            said = f"it published {linear, angular}" if later else "it published nothing more"
            raise ExerciseError(
                f"{self._file} must publish what its agent decides, as it is, ten times a second: another agent, in "
                f"the place of {AGENT}, decided to stand still, {STILL}, and {said}"
            )
        if made > MANY:
            raise ExerciseError(
                f"{self._file} must create one WallAgent, in `__init__`, and ask that each time: after {len(commands)} "
                f"commands it has created {made:.0f}"
            )


def _lines(told: Path) -> list[list[float]]:
    """Return the numbers of each whole line."""
    return [
        [float(each) for each in line.split()]
        for line in told.read_text().splitlines(keepends=True)
        if line[-1] == "\n"
    ]


def _commands(told: Path, count: int) -> bool:
    """Return True if so many commands have been published."""
    return sum(len(each) > 1 for each in _lines(told)) >= count
