"""The robot view: its data, and its actions on a world that runs in real time."""

import math
import time
from typing import Any

import numpy as np
from geometry_msgs.msg import PointStamped, PoseWithCovarianceStamped
from std_srvs.srv import Empty

from course.errors import LiveError
from course.foundation.waiting import wait_until
from course.lab.kernel.driving import reason
from course.lab.kernel.nodes import session
from course.lab.kernel.panels import Panels, Topic
from course.lab.kernel.robot_listener import (
    AHEAD,
    RobotListener,
    close_listener,
    listener_in_use,
    open_listener,
    placed,
)
from course.world.geometry import Floats
from course.world.node import World
from course.world.rooms import ROOMS
from course.world.simulation import OBSTACLE, Robot, Simulation, in_the_way, no_room

FOUND = 5.0  # s that the world may take to be discovered, and to react to a command
NEAR = 0.3  # m from the place where the robot was put, because it may drive on
STRIDE = 0.05  # m between two places of a path
ROUNDED = 0.0075  # m by which the walls that are known here may differ from those of the world
JUMP = 0.7  # m between two places: the robot was put there instead of driving
PLACES = 1200  # the last ones of a path, which a page keeps
# The content of a new page.
UNSAID: dict[str, Any] = {
    "command": None,
    "collisions": {"count": 0, "last": "", "places": []},
    "idle": "",
    "silent": [],
    "hand": "",
    "world": "",
}
PERIOD = 0.05  # s at least between two pictures


def add(panels: Panels) -> None:
    """Add the view's methods and topic."""
    panels.methods |= {
        "robot.rooms": rooms,
        "robot.start": start,
        "robot.reset": reset,
        "robot.place": place,
        "robot.drop": drop,
    }
    panels.topics |= {"robot": Topic(RobotFeed, PERIOD)}


class RobotFeed:
    """A feed of news about the robot for a page."""

    def __init__(self, page: str = "") -> None:
        self._page = page
        self._listener: RobotListener | None = None
        self._sent: dict[str, Any] = {}
        self._walls: object = self
        self._path = _Path()
        self._scanned = -math.inf  # s of time.monotonic, when the last scan came
        self._rests: Simulation | None = None  # in which the robot was told to stand, without an odometry

    def read(self) -> dict[str, Any] | None:
        """Return the news of `scan`, `robot`, `command`, `state`, `collisions`, `room`, `path`, `nodes` and the hand.

        `world` is another text for each world, and "" without one; `idle` is why driving by hand is impossible, or "";
        `hand` is who does it, "you" for this page; `silent` is who could drive, and sends no commands.
        """
        listener = open_listener(self)
        if listener is not self._listener:
            self._listener, self._sent, self._walls, self._path = listener, {}, self, _Path()
        listener.look()
        world = listener.own_world()
        fast = world is not None and world.fast
        news = self._measured(listener, world if fast else None)
        silent = list(listener.silent)
        states = {
            "command": listener.command(),
            "collisions": listener.collisions(),
            "idle": reason(listener),
            "silent": silent,
            "hand": self._by_hand(listener),
            "world": listener.seen,
        }
        for name, value in states.items():
            if value != self._sent.get(name, UNSAID[name]):
                self._sent[name] = news[name] = value
        walls, name, lines = listener.walls()
        if walls is not self._walls:
            self._walls = walls
            news["room"] = {"name": name, "walls": lines, "began": listener.began / 1e6}  # ms
        if (state := listener.state()) != self._sent.get("state", ""):
            self._sent["state"] = news["state"] = state
        at = (news.get("robot") or {}).get("pose") if fast else None
        if path := self._path.next_piece(world, bool(listener.nodes("/scan")), at):
            news["path"] = path
        nodes = {"sees": listener.nodes("/scan"), "drives": [] if silent else listener.commanders}
        if nodes != self._sent.get("nodes"):
            self._sent["nodes"] = news["nodes"] = nodes
        return news or None

    def _by_hand(self, listener: RobotListener) -> str:
        """Return who drives by hand, as the page tells it; "" while nobody does."""
        pages = listener.pad.drivers()
        others = len(pages) - (self._page in pages)
        names = ["you"] if self._page in pages else []
        names += ["another page"] if others == 1 else [f"{others} other pages"] if others else []
        return " and ".join(names)

    def _measured(self, listener: RobotListener, fast: World | None) -> dict[str, Any]:
        """Return the news of `scan` and `robot`; `fast` is the world if it is in fast mode.

        Both are of the moment of the scan: until its messages have come the robot drives on, in fast mode some metres.
        Without scans the robot is where the odometry says.
        """
        news: dict[str, Any] = {}
        counts = {"scan": listener.count["/scan"], "robot": listener.count["/odom"]}
        new = [name for name, count in counts.items() if self._sent.get(name, 0) != count]
        if "scan" in new:
            self._scanned = time.monotonic()
        if "scan" in new or (fast and new):
            news["scan"] = listener.scan()
            place = (news["scan"] or {}).get("from")
            robot = (listener.robot() if fast or "robot" in new else None) or {}
            if place:
                robot["pose"] = place
            if robot:
                news["robot"] = robot | ({"fast": True} if fast else {})
        elif new and time.monotonic() - self._scanned > AHEAD:
            news["robot"] = listener.robot()
        else:
            counts["robot"] = self._sent.get("robot", 0)  # it comes with the scan
        if fast and not counts["robot"] and not fast.simulates and fast.simulation is not self._rests:
            # It publishes only while it drives.
            self._rests = fast.simulation
            news["robot"] = {"pose": placed(*fast.simulation.pose), "moves": None, "fast": True}
        self._sent |= counts
        return news

    def close(self) -> None:
        """Stop listening to the robot."""
        close_listener(self)


class _Path:
    """The path of this kernel's world, piece by piece.

    In fast mode its robot may cross the room between two looks; in real time a page that comes later sees it, too.
    """

    def __init__(self) -> None:
        self._simulation: Any = None
        self._read = 0  # moments of the simulation
        self._last: tuple[float, float] | None = None

    def next_piece(self, world: World | None, seen: bool, until: list[float] | None = None) -> dict[str, Any] | None:
        """Return {"anew": whether a path begins, "places": [[x m, y m, time s], ...]}; None if nothing is new.

        `until` is where the robot is drawn, [x m, y m, heading rad], if it may have driven on: the path ends there.
        The path of a world that has ended stays until another robot is `seen`, whose path is not told.
        """
        if world is None:
            if not seen or self._simulation is None:
                return None
            self._simulation = None
            return {"anew": True, "places": None}
        simulation = world.simulation
        count, rows = simulation.path_since(self._read)
        anew = simulation is not self._simulation or count < self._read  # the world was reset
        if anew:
            self._simulation, self._last = simulation, None
            self._read = 0
            count, rows = simulation.path_since(0)
        if until is not None and rows:
            place = until[:2]
            reached = min(range(len(rows)), key=lambda number: (math.dist(rows[number][1:3], place), -number))
            rows = rows[: reached + 1]
            count = self._read + len(rows)
        places: list[list[float]] = []
        for at, x, y, _ in rows:
            moved = STRIDE if self._last is None else math.dist(self._last, (x, y))
            if moved > JUMP:
                anew, places = True, []
            if moved >= STRIDE:
                self._last = x, y
                places.append([round(float(value), 2) for value in (x, y, at)])
        self._read = count
        return {"anew": anew, "places": places[-PLACES:]} if places or anew else None


def rooms() -> dict[str, str]:
    """Return the rooms with a description of each."""
    return {name: room.description for name, room in ROOMS.items()}


def start(room: str) -> None:
    """Start the node `world` in this room, in real time, as `ros.start(World, ...)` does."""
    session().start(World, parameters={"room": room})


def reset() -> None:
    """Put the robot back at its start, and remove the obstacles; raises LiveError."""
    session().call(f"{_world(listener_in_use())}/reset", Empty)


def place(x: float, y: float, heading: float) -> None:
    """Put the robot at x, y (m) with this heading (rad); raises LiveError where it cannot stand."""
    listener = listener_in_use()
    if obstacle := in_the_way((x, y), Robot().radius, _segments(listener), _where(listener)):
        raise LiveError(f"The robot cannot stand there: {obstacle}.")
    message = PoseWithCovarianceStamped()
    message.header.frame_id = "odom"
    message.pose.pose.position.x, message.pose.pose.position.y = float(x), float(y)
    message.pose.pose.orientation.z = math.sin(heading / 2.0)
    message.pose.pose.orientation.w = math.cos(heading / 2.0)
    _tell(listener, "initialpose", message)

    def there() -> bool:
        stands = _where(listener)
        return stands is not None and math.dist((x, y), stands) < NEAR

    if not wait_until(there, FOUND, alert=False):
        raise LiveError("The world could not place the robot there; its log says why.")


def drop(x: float, y: float) -> None:
    """Drop an obstacle at x, y (m); raises LiveError where the robot stands, and where it can never be."""
    listener = listener_in_use()
    stands = _where(listener)
    if stands and math.dist((x, y), stands) <= OBSTACLE + Robot().radius:
        raise LiveError("No obstacle fits there: the robot stands there.")
    if stands and (why := no_room((x, y), OBSTACLE + ROUNDED, _segments(listener), stands)):
        raise LiveError(f"No obstacle fits there: {why}.")
    message = PointStamped()
    message.header.frame_id = "odom"
    message.point.x, message.point.y = float(x), float(y)
    before = listener.walls()[0]
    _tell(listener, "clicked_point", message)
    if not wait_until(lambda: listener.walls()[0] is not before, FOUND, alert=False):
        raise LiveError("The world dropped no obstacle: its log says why.")


def _where(listener: RobotListener) -> tuple[float, float] | None:
    """Return where the robot is, x m, y m; None if unknown."""
    x, y, _ = (listener.robot() or {}).get("pose") or (None, None, None)
    return None if x is None or y is None else (x, y)


def _segments(listener: RobotListener) -> Floats:
    return np.array(listener.walls()[2], dtype=float).reshape(-1, 2, 2)


def _tell(listener: RobotListener, topic: str, message: Any) -> None:
    """Publish a command to the world; raises LiveError if there is none."""
    _world(listener)
    publisher = listener.publisher(topic, type(message))
    if not wait_until(publisher.get_subscription_count, FOUND, alert=False):
        raise LiveError(f"No node listens to /{topic}: is the world still running?")
    publisher.publish(message)


def _world(listener: RobotListener) -> str:
    """Return the full name of the node that publishes the scan and can be controlled; raises LiveError."""
    served = {name for name, _ in listener.live.node.get_service_names_and_types()}
    for name in listener.nodes("/scan"):
        if f"{name}/reset" in served:
            return name
    if listener.nodes("/scan"):
        raise LiveError("This world cannot be changed: it runs in fast mode, or is not the course's.")
    raise LiveError("There is no world: start one first.")
