"""Runs the student's node with an agent that tells what it was given: `python echo_node.py ARGS`, in the sandbox.

The agent is the student's own but for `decide_action`, whose answer has a number for each distance in the place of the
speeds.  So a test of the node reads from `cmd_vel` what the node has made of a scan, whatever the agent would do.  The
numbers are ordinary speeds, and those of `front` and `right` lie in ranges of their own: a node that mixes the speeds
up, or turns a sign, can still be read.

Shown something in front at exactly `STRANGE` m, it says instead what no rule of the task says: backwards, the faster
the more of its kind have been asked, and to the left faster than any rule turns; and at exactly `OPPOSITE` m, forwards
and to the right, both faster than any rule; and at exactly `STILL` m, to stand still.  So a node that limits what an
agent has decided, makes a new agent for each command, or leaves a decision out, can be told from one that does not.
In its dict `angular` comes first: its keys say which speed is which, and not their order.

The numbers are above 0 when the node has asked the agent of wall_agent.py, and below 0 when it has asked another class
with a `decide_action`, one of its own.  A class with another name than WallAgent will do, and so will other keys of the
answer than 'linear' and 'angular', or another kind of answer, such as a tuple: the tests of the agent judge that.
"""

import builtins
import contextlib
import copy
import importlib
import math
import runpy
import types
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar

LEAST = {"front": 0.1, "right": 0.3}  # the number for 0 m
A_METRE = 0.01  # more for each metre
FAR, NOTHING, NO_NUMBER = 0.17, 0.18, 0.185  # more for a distance that is infinite, missing, or NaN
STRANGE, STILL, OPPOSITE = 4.25, 4.5, 4.75  # m
BACKWARDS, LEFT = -1.0, 1.75  # m/s and rad/s
FORWARDS, RIGHT = 2.25, -1.5  # m/s and rad/s
AN_AGENT = -0.125  # m/s more for each agent that was asked
asked = [0]  # how often WallAgent was asked
agents: list[Any] = []  # those that were


def told(distances: Mapping[str, float], name: str) -> float:
    """The number that stands for a distance."""
    try:
        distance = float(distances[name])
    except (KeyError, TypeError, ValueError):
        return LEAST[name] + NOTHING
    if math.isnan(distance):
        return LEAST[name] + NO_NUMBER
    return LEAST[name] + (FAR if math.isinf(distance) else A_METRE * distance)


def speeds(distances: Mapping[str, float], sign: float, agent: Any) -> tuple[float, float]:
    """The two numbers that tell of the distances, or of the agents that were asked."""
    if sign > 0 and not any(each is agent for each in agents):
        agents.append(agent)
    with contextlib.suppress(KeyError, TypeError, ValueError):
        if abs(float(distances["front"]) - STRANGE) < 1e-3:
            return sign * (BACKWARDS + AN_AGENT * len(agents)), sign * LEFT
        if abs(float(distances["front"]) - OPPOSITE) < 1e-3:
            return sign * FORWARDS, sign * RIGHT
        if abs(float(distances["front"]) - STILL) < 1e-3:
            return 0.0, 0.0
    return sign * told(distances, "front"), sign * told(distances, "right")


def like(answer: Any, linear: float, angular: float) -> Any:
    """These speeds in the form that the student's own agent gives its answer."""
    if isinstance(answer, dict) and {"linear", "angular"} <= {*answer}:
        others = {key: value for key, value in answer.items() if key not in ("linear", "angular")}
        return {"angular": angular, "linear": linear, **others}
    if isinstance(answer, tuple) and hasattr(answer, "_make"):
        return answer._make([linear, angular])
    if isinstance(answer, list | tuple):
        return [linear, angular] if isinstance(answer, list) else (linear, angular)
    if hasattr(answer, "linear") and hasattr(answer, "angular"):
        changed = copy.deepcopy(answer)
        if hasattr(changed.linear, "x"):  # a Twist
            changed.linear.x, changed.angular.z = linear, angular
        else:
            object.__setattr__(changed, "linear", linear)
            object.__setattr__(changed, "angular", angular)
        return changed
    return Answer(linear=linear, angular=angular)


class Answer(dict[Any, float]):
    """An agent's answer; of other keys, the first one asked for is `linear`, and the second `angular`."""

    others: ClassVar[list[Any]] = []

    def __missing__(self, key: Any) -> float:
        if key not in self.others:
            self.others.append(key)
        return self["linear" if self.others.index(key) == 0 else "angular"]


def telling(own: Any, sign: float) -> Any:
    """The class `own`, whose objects tell what they were given."""

    def instead_of(decide: Callable[..., Any]) -> Callable[..., Any]:
        def decide_action(self: Any, distances: Any, *others: object, **more: object) -> Any:
            """Decide as the student's agent does, which may change the distances, and answer with them as they were."""
            before, answer, given = asked[0], None, distances
            with contextlib.suppress(Exception):
                given = copy.copy(distances)
            with contextlib.suppress(Exception):
                answer = decide(self, distances, *others, **more)
            if asked[0] > before:  # it has asked WallAgent
                return answer
            asked[0] += sign > 0
            return like(answer, *speeds(given, sign, self))

        return decide_action

    begin = own.__init__

    def __init__(self: Any, *args: object, **more: object) -> None:  # noqa: N807
        """Begin as the student's agent does, which may choose its `decide_action` now."""
        begin(self, *args, **more)
        chosen = getattr(self, "__dict__", {}).get("decide_action")
        if callable(chosen):
            tell = instead_of(lambda _, *args, **more: chosen(*args, **more))
            object.__setattr__(self, "decide_action", types.MethodType(tell, self))

    if hasattr(own, "decide_action"):
        own.decide_action = instead_of(own.decide_action)
    own.__init__ = __init__
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
