"""The chapter's obstacle avoidance in plain Python: without ROS, so it can be tested and reused without a robot."""

from collections.abc import Mapping
from enum import Enum

INFINITY = float("inf")


class RobotState(Enum):
    """The states of the agent's finite state machine."""

    FORWARD = 1
    TURNING_LEFT = 2
    TURNING_RIGHT = 3
    STOPPED = 4


class ObstacleAvoidanceAI:
    """Drives forward while the way is clear, and turns on the spot towards the more open side when it is not.

    The next action depends on the distances alone, never on the previous state: `state` only names the last decision.
    """

    def __init__(self, obstacle_distance_threshold: float = 0.5) -> None:
        """Start in FORWARD; an obstacle nearer than `obstacle_distance_threshold` (m) ahead makes the agent turn."""
        self.state = RobotState.FORWARD
        self.obstacle_threshold = obstacle_distance_threshold

    def decide_action(self, laser_data: Mapping[str, float]) -> dict[str, float]:
        """Decide the next velocity command.

        Args:
            laser_data: the nearest distance (m) in each sector, a dict with the keys 'front', 'left' and 'right'.
                A missing sector counts as free (inf).

        Returns:
            {'linear': m/s, 'angular': rad/s}; a positive angular speed turns left, counter-clockwise (REP 103).

        An obstacle exactly at the threshold does not turn the robot, and when both sides are equally open it turns
        right, as in the chapter.
        """
        front = laser_data.get("front", INFINITY)
        left = laser_data.get("left", INFINITY)
        right = laser_data.get("right", INFINITY)

        if front >= self.obstacle_threshold:
            self.state = RobotState.FORWARD
            return {"linear": 0.3, "angular": 0.0}
        if left > right:
            self.state = RobotState.TURNING_LEFT
            return {"linear": 0.0, "angular": 0.5}
        self.state = RobotState.TURNING_RIGHT
        return {"linear": 0.0, "angular": -0.5}

    def stop(self) -> dict[str, float]:
        """Stand still, because there is no fresh data to decide on; the state becomes STOPPED."""
        self.state = RobotState.STOPPED
        return {"linear": 0.0, "angular": 0.0}
