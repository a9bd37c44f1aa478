"""An agent that follows the wall on its right. There is no ROS in it."""
from enum import Enum


class State(Enum):
    """The name of the rule that decided last."""
    STOPPED = 0
    WALL_AHEAD = 1
    LOOKING = 2
    FOLLOWING = 3


class WallAgent:
    """Decides where to drive by two distances."""

    def __init__(self):
        self.state = State.STOPPED

    def decide_action(self, distances):
        """Return a dict of 'linear' (m/s) and 'angular' (rad/s, left positive).

        'front' and 'right' are the nearest distances (m), inf where nothing is.
        """
        front, right = distances['front'], distances['right']
        if front < 0.5:
            self.state = State.WALL_AHEAD
            return {'linear': 0.0, 'angular': 0.5}
        if right > 1.2:
            self.state = State.LOOKING
            return {'linear': 0.2, 'angular': -0.4}
        self.state = State.FOLLOWING
        angular = 1.5 * (0.6 - right)
        return {'linear': 0.3, 'angular': max(-0.5, min(0.5, angular))}
