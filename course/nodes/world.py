"""The small 2-D world as a program: `python -m course.nodes.world --ros-args -p room:=pillars`."""

import sys

from course.world.node import World, main

__all__ = ["World", "main"]

if __name__ == "__main__":
    sys.exit(main())
