"""Driving by hand: publishes a page's commands on `cmd_vel` for as long as the page renews them.

The page is a dead man's switch: it repeats the request ten times a second while a key or a button is down.  When the
requests stop (the key is released, the panel is closed, the page or its computer is gone), the robot is stopped.
"""

from course.errors import LiveError
from course.lab.kernel.panels import Panels
from course.lab.kernel.robot_listener import RobotListener, listener_in_use
from course.world.simulation import Robot

TYPE = "geometry_msgs/msg/Twist"
FAST = "This world is in fast mode: it waits for a node that drives it"
NO_ROBOT = "No robot takes commands: no node subscribes to /cmd_vel."


def add(panels: Panels) -> None:
    """Add the method."""
    panels.methods |= {"robot.drive": drive}


def drive(linear: float, angular: float, page: str = "") -> None:
    """Drive at these speeds (m/s, rad/s) until the next call by this page, for `LIMIT` s at most; 0, 0 stops.

    While several pages drive, the newest command counts.

    Raises LiveError when something else sends commands, or no robot takes commands.
    """
    listener = listener_in_use()
    listener.look()
    if why := reason(listener):
        listener.pad.stop()
        raise LiveError(why)
    listener.pad.steer(*Robot().limit(float(linear), float(angular)), page)


def reason(listener: RobotListener) -> str:
    """Return why driving by hand is impossible now, or ""."""
    if not listener.takes:
        return NO_ROBOT
    if wrong := sorted(listener.takes - {TYPE}):
        return f"The robot takes {wrong[0]} on /cmd_vel. These buttons publish {TYPE}."
    if listener.fast_world():
        return f"{FAST}. To drive yourself, start a world in real time."
    if listener.commanders and not listener.silent:
        *some, last = listener.commanders
        names = f"{', '.join(some)} and {last}" if some else last
        names = names[0].upper() + names[1:]
        return f"{names} drive{'s' * (not some)} now. Stop {'it' if not some else 'them'} to drive yourself."
    return ""
