"""A small 2-D world for a robot with a laser: rooms, laser and robot in plain NumPy, and the ROS node around them.

The modules `node`, `controls` and `lockstep` use ROS; the others do not.
"""

from course.world.laser import Laser
from course.world.rooms import ROOMS, Room, find, load
from course.world.simulation import Collision, Robot, Simulation

__all__ = ["ROOMS", "Collision", "Laser", "Robot", "Room", "Simulation", "find", "load"]
