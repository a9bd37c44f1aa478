"""Runs the student's node with an agent that tells what it was given: `python echo_node.py ARGS`, in the sandbox.

The agent is the student's own but for `decide_action`, whose answer has a number for each distance in the place of the
speeds.  So a test of the node reads from `cmd_vel` what the node has made of a scan, whatever the agent would do.  The
numbers are ordinary speeds, and those of `front` and `right` lie in ranges of their own: a node that mixes the speeds
up, or turns a sign, can still be read.

The numbers are above 0 when the node has asked the agent of wall_agent.py, and below 0 when it has asked another class
with a `decide_action`, one of its own.  A class with another name than WallAgent will do, and so will other keys of the
answer than 'linear' and 'angular', or numbers of its parts: the tests of the agent judge that.
"""

import builtins
import contextlib
import importlib
import math
import runpy
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar

LEAST = {"front": 0.1, "right": 0.3}  # the number for 0 m
A_METRE = 0.01  # more for each metre
FAR, NOTHING = 0.17, 0.18  # more for a distance that is infinite, or missing
asked = [0]  # how often WallAgent was asked


def told(distances: Mapping[str, float], name: str) -> float:
    """The number that stands for a distance."""
    try:
        distance = float(distances[name])
    except (KeyError, TypeError, ValueError):
        return LEAST[name] + NOTHING
    if math.isnan(distance):
        return LEAST[name] + NOTHING
    return LEAST[name] + (FAR if math.isinf(distance) else A_METRE * distance)


class Answer(dict[Any, float]):
    """An agent's answer; of other keys, the first one asked for is `linear`, and the second `angular`."""

    others: ClassVar[list[Any]] = []

    def __missing__(self, key: Any) -> float:
        if key not in self.others:
            self.others.append(key)
        return self["linear" if self.others.index(key) == 0 else "angular"]


def telling(own: Any, sign: float) -> Any:
    """The class `own`, whose objects tell what they were given."""
    decide: Callable[..., Any] = own.decide_action

    def decide_action(self: Any, distances: Any, *others: object, **more: object) -> Any:
        """Decide as the student's agent does, and answer with the distances."""
        before, answer = asked[0], None
        with contextlib.suppress(Exception):
            answer = decide(self, distances, *others, **more)
        if asked[0] > before:  # it has asked WallAgent
            return answer
        asked[0] += sign > 0
        return Answer(linear=sign * told(distances, "front"), angular=sign * told(distances, "right"))

    own.decide_action = decide_action
    return own


def build_class(function: Any, name: str, *bases: Any, **more: Any) -> Any:
    """Build a class; one of the node's file that decides tells what it was given, unless it is a node."""
    built = original(function, name, *bases, **more)
    is_node = any(base.__name__ == "Node" for base in getattr(built, "__mro__", ()))
    return telling(built, -1.0) if "decide_action" in vars(built) and not is_node else built


if __name__ == "__main__":
    module: Any = importlib.import_module("wall_agent")
    if isinstance(getattr(module, "WallAgent", None), type):
        module.WallAgent = telling(type("WallAgent", (module.WallAgent,), {}), 1.0)
    else:
        for other in [each for each in vars(module).values() if isinstance(each, type)]:
            if "decide_action" in vars(other):
                telling(other, 1.0)
    original = builtins.__build_class__
    setattr(builtins, "__build_class__", build_class)  # noqa: B010  mypy knows its type better
    runpy.run_path(str(Path("wall_follower.py").resolve()), run_name="__main__")
