"""Runs the student's node with an agent that tells what it was given: `python echo_node.py ARGS`, in the sandbox.

The agent is the student's own but for `decide_action`, whose answer has the distances in the place of the speeds, each
plus MORE.  So a test of the node reads from `cmd_vel` what the node has made of a scan, whatever the agent would do.
"""

import contextlib
import importlib
import math
import runpy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

MORE, FAR, NOTHING = 10.0, 100.0, -10.0  # m: told(0.0) is no command to stand still


def told(distances: Mapping[str, float], name: str) -> float:
    """The number that stands for a distance."""
    try:
        distance = float(distances[name])
    except (KeyError, TypeError, ValueError):
        return NOTHING
    if math.isnan(distance):
        return NOTHING
    return FAR if math.isinf(distance) else MORE + distance


if __name__ == "__main__":
    module: Any = importlib.import_module("wall_agent")
    Own: Any = module.WallAgent

    class WallAgent(Own):
        """The student's agent, which tells what it was given."""

        def decide_action(self, distances: Mapping[str, float], *_: object, **__: object) -> dict[str, float]:
            """Decide as the student's agent does, and answer with the distances."""
            with contextlib.suppress(Exception):
                super().decide_action(distances)
            return {"linear": told(distances, "front"), "angular": told(distances, "right")}

    module.WallAgent = WallAgent
    runpy.run_path(str(Path("wall_follower.py").resolve()), run_name="__main__")
