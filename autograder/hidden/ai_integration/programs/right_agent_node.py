"""Runs the student's node with an agent that decides by the task's rules: `python right_agent_node.py ARGS`.

For drives that judge the node, when its own agent decides wrongly.  `manner.json` beside it says what becomes of the
agent's speeds in this node, which other tests judge: the agent's answer makes up for it.
"""

import importlib
import json
import runpy
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def decide(front: float, right: float) -> tuple[float, float]:
    """The speeds (m/s, rad/s) that the task asks for at these distances (m)."""
    if front < 0.5:
        return 0.0, 0.5
    if right > 1.2:
        return 0.2, -0.4
    return 0.3, max(-0.5, min(0.5, 1.5 * (0.6 - right)))


if __name__ == "__main__":
    manner = json.loads(Path("manner.json").read_text())

    def decide_action(self: object, distances: Mapping[str, float], *_: object, **__: object) -> dict[str, float]:
        """Decide, so that the node's command is right."""
        linear, angular = decide(distances["front"], distances["right"])
        said = [manner["linear"] * linear, manner["angular"] * angular]
        linear, angular = reversed(said) if manner["swapped"] else said
        return {"angular": angular, "linear": linear}

    module: Any = importlib.import_module("wall_agent")
    for each in [each for each in vars(module).values() if isinstance(each, type) and hasattr(each, "decide_action")]:
        each.decide_action = decide_action
    runpy.run_path(str(Path("wall_follower.py").resolve()), run_name="__main__")
