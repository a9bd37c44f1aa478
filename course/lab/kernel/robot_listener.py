"""The robot's state from its topics: scan, odometry, commands, collisions, and the walls around it.

It subscribes only to topics on which a node publishes, so that the view does not change the graph of a session without
a robot.  The session's own hidden node does not count, except when a cell publishes commands with it.
"""

import bisect
import math
import re
import struct
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.client import Client
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String
from visualization_msgs.msg import Marker

from course.errors import LiveError
from course.lab.kernel import sending
from course.lab.kernel.nodes import session
from course.lab.kernel.pad import Pad
from course.robot.sectors import from_scan
from course.ros.names import full, is_hidden
from course.session.following import LogFollower
from course.session.live import Session
from course.session.logs import Entry, decoded
from course.world.controls import LATCHED
from course.world.node import World, latest, watchers
from course.world.simulation import Simulation, advance

NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
LOOK = 0.5  # s between two looks for publishers
SHOWN = 720  # beams of a scan at most: of more the page gets every second, third, ...
HITS = 1000  # collisions that are kept
CROSSES = 20  # collisions that are drawn
SCANS = 50  # poses of the robot that are kept, to find the pose of a scan
AHEAD = 0.5  # s at most for which the robot's motion is extrapolated to a scan
TOLD = 1000  # characters of a collision's text
MOST = 100_000  # beams of a scan that are processed: of more every second, third, ...
LONGEST = 1 << 20  # bytes of the walls, which are read for each picture
TOPICS: dict[str, tuple[type, QoSProfile]] = {
    "/scan": (LaserScan, NEWEST),
    "/odom": (Odometry, NEWEST),
    "/cmd_vel": (Twist, NEWEST),
    "/collision": (String, LATCHED),
    "/walls": (Marker, LATCHED),
}
FARTHEST = 1e6  # m, the most that a range is drawn as; a place that is farther away from the origin is left out
NOTHING, NO_MEASUREMENT = -1, -2  # instead of a range: no obstacle in reach, and not a measurement
SILENT = 1.5  # s without a message, after which a state counts as unknown
STATE = re.compile(r"State: ([A-Za-z]\w{0,39})\b")  # in the driver's log, as in the chapter
PLACE = re.compile(r"x=(-?\d{1,9}(?:\.\d{1,9})?) m, y=(-?\d{1,9}(?:\.\d{1,9})?) m")  # in the text of a collision
Source = tuple[str, tuple[int, ...]]  # a node's full name, and its publisher, which is new after a restart


class RobotListener:
    """A session's listener for the robot; messages are kept as they come, and parsed only when a page asks."""

    def __init__(self, live: Session):
        self.live = live
        self.publishers: dict[str, tuple[Source, ...]] = dict.fromkeys(TOPICS, ())
        self.count = dict.fromkeys(TOPICS, 0)
        self._hits: deque[_Hit] = deque(maxlen=HITS)
        self.pad = Pad(live)
        self.takes: set[str] = set()  # the message types of subscriptions to commands
        self.commanders: list[str] = []  # the publishers of commands, without the pad
        self._cells = 0  # cells' publishers of commands at the last look
        self._last: dict[str, bytes] = {}
        self._fast: Simulation | None = None  # of the last world in fast mode, until one shows its walls
        self._poses: deque[bytes] = deque(maxlen=SCANS)  # the last odometry
        self._commanded = -math.inf  # when the last command came, s of time.monotonic
        self._driven = -math.inf  # when one came that was not the pad's, or somebody came who may send one
        self._subscriptions: dict[str, Subscription] = {}
        self._publishers: dict[str, Publisher] = {}
        self._clients: dict[tuple[str, str], Client] = {}
        self._looked = -math.inf
        self._lock = threading.Lock()
        self._log: LogFollower = live.follow_logs(self._is_state)
        self._state, self._state_at = "", -math.inf
        watchers.append(self._hear_of)

    def _hear_of(self, world: World) -> None:
        """Look at once when a world of this process begins or ends something; called in the world's thread."""
        if world.context is self.live.context:
            self._looked = -math.inf
            self.look()
            self._fast_simulation()

    def look(self) -> None:
        """Update the list of publishers, at most twice a second, and subscribe to them."""
        with self._lock:
            if time.monotonic() - self._looked < LOOK:
                return
            before, self._looked = self._looked, time.monotonic()
            node = self.live.node
            for topic, (kind, qos) in TOPICS.items():
                found = {
                    (full(each.node_name, each.node_namespace), tuple(each.endpoint_gid))
                    for each in node.get_publishers_info_by_topic(topic)
                }
                known, commanders = set(self.publishers[topic]), set(self.commanders)
                self.publishers[topic] = tuple(sorted(each for each in found if not is_hidden(each[0])))
                if topic == "/cmd_vel":
                    self._look_at_commands([name for name, _ in found])
                    if set(self.publishers[topic]) - known or set(self.commanders) - commanders:
                        self._driven = time.monotonic()
                if topic == "/collision" and not known & set(self.publishers[topic]):
                    self._forget_hits(before)
                speaks = bool(self.commanders if topic == "/cmd_vel" else self.publishers[topic])
                if speaks and topic not in self._subscriptions:
                    hear = cast(Callable[[bytes], None], self._hear(topic))  # takes the message's info as well
                    self._subscriptions[topic] = node.create_subscription(kind, topic, hear, qos, raw=True)
                elif not speaks and topic in self._subscriptions:
                    node.destroy_subscription(self._subscriptions.pop(topic))
                    if topic == "/cmd_vel":
                        self._commanded = -math.inf

    def _look_at_commands(self, names: list[str]) -> None:
        """Update the receivers and senders of commands: nodes, the `ros2` command, by the session's node the others."""
        node = self.live.node
        own = node.get_fully_qualified_name()
        takers = node.get_subscriptions_info_by_topic("/cmd_vel")
        self.takes = {each.topic_type for each in takers if not is_hidden(each.node_name)}
        others = {"the ros2 command" if name.startswith("/_ros2cli") else name for name in names if name != own}
        # The pad's own publisher may come or go during a look, so a cell's must be there at two looks.
        inspector = sending.publishes("/cmd_vel")
        cells, self._cells = self._cells, names.count(own) - self.pad.publishes - inspector
        inside = {"the Inspector": inspector, "a cell of the notebook": min(cells, self._cells)}
        self.commanders = [*sorted(others), *(name for name, count in inside.items() if count > 0)]

    def close(self) -> None:
        """Remove all subscriptions, clients and publishers."""
        self.pad.stop()
        watchers.remove(self._hear_of)
        with self._lock:
            for subscription in self._subscriptions.values():
                if self.live.ok:
                    self.live.node.destroy_subscription(subscription)
            for publisher in self._publishers.values():
                if self.live.ok:
                    self.live.node.destroy_publisher(publisher)
            for client in self._clients.values():
                if self.live.ok:
                    self.live.node.destroy_client(client)
            self._subscriptions.clear()
            self._publishers.clear()
            self._clients.clear()

    def publisher(self, topic: str, kind: type) -> Publisher:
        """The session's own publisher on a topic, made at the first call."""
        with self._lock:
            if topic not in self._publishers:
                self._publishers[topic] = self.live.node.create_publisher(kind, topic, 10)
            return self._publishers[topic]

    def client(self, kind: type, node: str, service: str) -> Client:
        """The session's own client of a node's service, made at the first call."""
        with self._lock:
            if (node, service) not in self._clients:
                self._clients[node, service] = self.live.node.create_client(kind, f"{node}/{service}")
            return self._clients[node, service]

    def forget(self, node: str) -> None:
        """Destroy the clients of a node that has ended: they might not find the next node of its name."""
        with self._lock:
            for key in [key for key in self._clients if key[0] == node]:
                self.live.node.destroy_client(self._clients.pop(key))

    @property
    def silent(self) -> list[str]:
        """Return the publishers of commands if none has sent one for `SILENT` s: none of them drives."""
        return self.commanders if _is_old(self._driven) else []

    def nodes(self, topic: str) -> list[str]:
        """Return the nodes that publish on a topic."""
        return list(dict.fromkeys(name for name, _ in self.publishers[topic]))

    @property
    def seen(self) -> str:
        """Return a text that differs between worlds, also those of one name: who publishes the scan; "" for nobody."""
        return " ".join(f"{name} {bytes(publisher).hex()}" for name, publisher in self.publishers["/scan"])

    def _is_state(self, entry: Entry) -> bool:
        drivers = [name.strip("/").replace("/", ".") for name in self.nodes("/cmd_vel")]
        return len(drivers) == 1 and entry.node == drivers[0] and STATE.match(entry.text) is not None

    def state(self) -> str:
        """Return the state of the driving node from its log, in which the chapter's controller writes it.

        '' if it logs none, has logged none for `SILENT` s, or several nodes drive: none is better than a wrong one.
        """
        entries, _ = self._log.read(1)
        for entry in entries:
            if found := STATE.match(entry.text):
                self._state, self._state_at = found[1], time.monotonic()
        if len(self.nodes("/cmd_vel")) != 1 or _is_old(self._state_at):
            self._state = ""
        return self._state

    def own_world(self) -> World | None:
        """Return this kernel's world that publishes the scan: its path is known."""
        world = latest()
        if world is not None and world.context is self.live.context and "/world" in self.nodes("/scan"):
            return world
        return None

    def fast_world(self) -> World | None:
        """Return this kernel's world that publishes the scan in fast mode; it publishes no walls."""
        world = self.own_world()
        return world if world is not None and world.fast else None

    def _fast_simulation(self) -> Simulation | None:
        """Return the simulation of the world in fast mode that there is, or was last if none has shown its walls since.

        Its last scan is still drawn when it has ended, and belongs into its room.
        """
        if world := self.fast_world():
            self._fast = world.simulation
        return self._fast

    def _forget_hits(self, until: float) -> None:
        """Forget the collisions received before `until` (s of time.monotonic), which belong to an earlier world."""
        self._hits = deque((hit for hit in self._hits if hit.heard >= until), maxlen=HITS)

    def _hear(self, topic: str) -> Callable[[bytes, dict[str, Any]], None]:
        def hear(message: bytes, info: dict[str, Any]) -> None:
            self._last[topic] = message
            self.count[topic] += 1
            if topic == "/odom":
                self._poses.append(message)
            elif topic == "/walls":
                self._fast = None
            elif topic == "/cmd_vel":
                self._commanded = time.monotonic()
                if not self._is_pads(message):
                    self._driven = self._commanded
            elif topic == "/collision":
                text = (decoded(message, String) or String()).data[:TOLD]
                self._hits.append(_Hit(info["source_timestamp"], time.monotonic(), text, _place(text)))

        return hear

    def _is_pads(self, message: bytes) -> bool:
        """Return True if a command is one that the pad sends: a message does not tell its publisher."""
        if not self.pad.publishes or (command := decoded(message, Twist)) is None:
            return False
        return self.pad.has_said(command.linear.x, command.angular.z)

    # Data for the page

    def scan(self) -> dict[str, Any] | None:
        """Return the last scan for drawing: ranges (cm), the pose, the nearest distance in each sector (m)."""
        if "/scan" not in self._last or (scan := decoded(self._last["/scan"], LaserScan)) is None:
            return None
        beams = len(scan.ranges)
        if (thinned := math.ceil(beams / MOST)) > 1:
            scan.ranges, scan.angle_increment = scan.ranges[::thinned], thinned * scan.angle_increment
        step = max(1, math.ceil(len(scan.ranges) / SHOWN))
        return {
            "first": _finite(scan.angle_min, 4),
            "step": _finite(scan.angle_increment * step, 6),
            "beams": beams,
            "reach": _near(scan.range_max, 2),
            "ranges": [_centimetres(value, scan.range_min, scan.range_max) for value in scan.ranges[::step]],
            "from": self._pose_at(_stamp(self._last["/scan"])),
            "sectors": {name: _near(value, 2) for name, value in from_scan(scan).items()},
        }

    def robot(self) -> dict[str, Any] | None:
        """Return the robot's reported pose, [x m, y m, heading rad], and velocity, [m/s, rad/s]."""
        if "/odom" not in self._last or (odometry := decoded(self._last["/odom"], Odometry)) is None:
            return None
        twist = odometry.twist.twist
        return {"pose": _pose(self._last["/odom"]), "moves": [_finite(twist.linear.x, 3), _finite(twist.angular.z, 3)]}

    def _pose_at(self, stamp: int) -> list[float] | None:
        """Return the pose at that time (ns), interpolated between known ones or extrapolated from the last."""
        poses = sorted(self._poses.copy(), key=_stamp)
        number = bisect.bisect_left(poses, stamp, key=_stamp)
        if number < len(poses) and (number == 0 or _stamp(poses[number]) == stamp):
            return _pose(poses[number])
        if not poses or (before := _pose(poses[number - 1])) is None:
            return None
        since = (stamp - _stamp(poses[number - 1])) / 1e9
        if number < len(poses) and (after := _pose(poses[number])) is not None:
            share = since / ((_stamp(poses[number]) - _stamp(poses[number - 1])) / 1e9)
            return _between(before, after, share)
        return _moved_on(before, poses[number - 1], min(since, AHEAD))

    def command(self) -> list[float | None] | None:
        """Return the last command, [m/s, rad/s]; None if none has come for `SILENT` s."""
        if pad := self.pad.command():
            return [_finite(speed, 3) for speed in pad]
        if _is_old(self._commanded) or (command := decoded(self._last["/cmd_vel"], Twist)) is None:
            return None
        return [_finite(command.linear.x, 3), _finite(command.angular.z, 3)]

    def collisions(self) -> dict[str, Any]:
        """Return the collisions since the robot was put at its start: number, last one's text, places [x m, y m]."""
        if simulation := self._fast_simulation():
            texts = [str(each) for each in list(simulation.collisions)]
            hits = [(text, _place(text)) for text in texts]
        else:
            hits = [(hit.text, hit.place) for hit in self._hits.copy() if hit.at >= self.began]
        places = [place for _, place in hits[-CROSSES:] if place]
        return {"count": len(hits), "last": hits[-1][0] if hits else "", "places": places}

    @property
    def began(self) -> int:
        """Return when the robot was put at its start (ns of its world's time); 0 if unknown."""
        return _stamp(self._last.get("/walls", b""))

    def walls(self) -> tuple[object, str, list[float]]:
        """Return a value that changes with the walls, the name of the room, and x, y (m) of each wall's two ends.

        A world of this kernel in fast mode publishes no walls; they are taken from its room.
        """
        if simulation := self._fast_simulation():
            room = simulation.room
            return room, room.name, [round(float(value), 2) for value in room.segments.reshape(-1)]
        if "/walls" not in self._last:
            return None, "", []
        message = self._last["/walls"]
        marker = decoded(message, Marker) if len(message) <= LONGEST else None
        if marker is None:
            return message, "", []
        walls = zip(marker.points[::2], marker.points[1::2], strict=False)
        ends = [(one.x, one.y, other.x, other.y) for one, other in walls]
        return message, marker.text, [round(value, 2) for wall in ends if all(map(_is_near, wall)) for value in wall]


@dataclass(frozen=True)
class _Hit:
    """A received collision."""

    at: int  # ns, on the publisher's clock
    heard: float  # when it was received, s of time.monotonic
    text: str
    place: list[float] | None  # x m, y m


def _is_old(at: float) -> bool:
    """Return True if `at` (s of time.monotonic) is more than `SILENT` s ago."""
    return time.monotonic() - at > SILENT


def _place(text: str) -> list[float] | None:
    """Return the place of a collision, x, y (m), or None if its text has none."""
    found = PLACE.search(text)
    place = [float(found[1]), float(found[2])] if found else []
    return place if place and all(map(_is_near, place)) else None


def _stamp(message: bytes) -> int:
    """Return the time (ns) in the header at the beginning of a CDR message; 0 without one.

    Source: Common Data Representation, OMG CORBA 3, 9.3: the first four bytes give the byte order.
    """
    if len(message) < 12:
        return 0
    seconds, nanoseconds = struct.unpack_from("<iI" if message[1] & 1 else ">iI", message, 4)
    return int(seconds) * 10**9 + int(nanoseconds)


def _between(before: list[float], after: list[float], share: float) -> list[float] | None:
    """Return a pose interpolated between two."""
    (x, y, heading), (to_x, to_y, to_heading) = before, after
    turn = math.remainder(to_heading - heading, 2.0 * math.pi)
    return placed(x + share * (to_x - x), y + share * (to_y - y), heading + share * turn)


def _moved_on(pose: list[float], odometry: bytes, seconds: float) -> list[float] | None:
    """Return the pose `seconds` after another one, at the velocity of the odometry."""
    read = decoded(odometry, Odometry)
    linear, angular = (read.twist.twist.linear.x, read.twist.twist.angular.z) if read else (0.0, 0.0)
    if not math.isfinite(linear) or not math.isfinite(angular):
        return pose
    x, y, heading = pose
    return placed(*advance((x, y, heading), linear, angular, seconds))


def _pose(odometry: bytes) -> list[float] | None:
    if not odometry or (read := decoded(odometry, Odometry)) is None:
        return None
    pose = read.pose.pose
    turn = pose.orientation
    heading = math.atan2(2.0 * (turn.w * turn.z + turn.x * turn.y), 1.0 - 2.0 * (turn.y * turn.y + turn.z * turn.z))
    return placed(pose.position.x, pose.position.y, heading)


def placed(x: float, y: float, heading: float) -> list[float] | None:
    """Return a pose for the page: x m, y m, heading rad; None where no robot can be."""
    if not (_is_near(x) and _is_near(y) and math.isfinite(heading)):
        return None
    return [round(x, 3), round(y, 3), round(math.remainder(heading, 2.0 * math.pi), 4)]


def _is_near(value: float) -> bool:
    """Return True for a coordinate that the page can draw; never for NaN."""
    return abs(value) <= FARTHEST


def _near(value: float, digits: int) -> float | None:
    """Return a rounded distance (m) for JSON, at most `FARTHEST`; None for infinity and NaN."""
    return round(max(-FARTHEST, min(float(value), FARTHEST)), digits) if math.isfinite(value) else None


def _finite(value: float, digits: int) -> float | None:
    """Return the rounded value for JSON; None for infinity and NaN."""
    return round(float(value), digits) if math.isfinite(value) else None


def _centimetres(value: float, least: float, most: float) -> int:
    """Return a range (cm) by REP 117: too close is 0."""
    if value == math.inf:
        return NOTHING
    if value == -math.inf:
        return 0
    return round(100.0 * min(value, FARTHEST)) if least <= value <= most else NO_MEASUREMENT  # never true for NaN


_listener: list[RobotListener] = []
_users: list[object] = []
_sharing = threading.Lock()


def open_listener(user: object) -> RobotListener:
    """Return the listener of the current session, shared by all users; raises LiveError when the session has ended."""
    with _sharing:
        live = session()
        if user not in _users:
            _users.append(user)
        if not _listener or _listener[0].live is not live:
            for old in _listener:
                old.close()
            _listener[:] = [RobotListener(live)]
        return _listener[0]


def listener_in_use() -> RobotListener:
    """Return the listener in use; raises LiveError when the session has ended, or no page uses one."""
    live = session()
    with _sharing:
        if not _listener or _listener[0].live is not live:
            raise LiveError("No robot view is open. Open it again.")
        return _listener[0]


def close_listener(user: object) -> None:
    """Remove this user; the listener is closed after the last one."""
    with _sharing:
        if user in _users:
            _users.remove(user)
        if not _users:
            for listener in _listener:
                listener.close()
            _listener.clear()
