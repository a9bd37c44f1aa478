"""Asks the student's agent what it decides: `python ask_agent.py ros|no-ros QUESTIONS`, in the sandbox.

QUESTIONS is a JSON list of the distances that `decide_action` is given, with the number of the `agent` that is asked
(each is an instance of its own), and the `times` that it is asked, the last time after a `pause` (s): the last answer
counts. Prints `answers: ` and a JSON list with the two speeds of each answer; before that `odd: ` and an answer that
has none, `no floats: ` and one whose speeds are not both floats, and `of ROS: ` and a package of ROS that it has tried
to import, for all its answers. With `no-ros`, importing such a package fails as on a computer without ROS, the class
must be called WallAgent, and its answers must be dicts with the right keys.
Otherwise any class with a `decide_action` will do, and any two numbers, so that a wrong name costs one test.
"""

import importlib
import json
import sys
import time
from collections.abc import Sequence
from types import ModuleType
from typing import Any

ROS = ("rclpy", "rcl_interfaces", "rosidl_", "ament_", "rpyutils", "builtin_interfaces", "action_msgs")
MESSAGES = ("_msgs", "_srvs")
TOLD = 100  # characters of an answer without two speeds
tried: list[str] = []  # packages of ROS that were to be imported


class WithoutRos:
    """Finds no package of ROS."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> None:
        """Raise ModuleNotFoundError for a ROS package, and leave all others to the finders behind it."""
        package = name.partition(".")[0]
        if package.startswith(ROS) or package.endswith(MESSAGES):
            tried.append(package)
            raise ModuleNotFoundError(f"No module named '{package}'")


if __name__ == "__main__":
    mode, questions = sys.argv[1:]
    if mode == "no-ros":
        sys.meta_path.insert(0, WithoutRos())
    module = importlib.import_module("wall_agent")
    others = [each for each in vars(module).values() if isinstance(each, type) and hasattr(each, "decide_action")]
    kind = others[-1] if mode == "ros" and others and not hasattr(module, "WallAgent") else module.WallAgent
    agents: dict[int, Any] = {}
    answers: list[tuple[float | None, float | None]] = []
    odd = no_floats = ""
    for question in json.loads(questions):
        times, pause, number = (question.pop(name) for name in ("times", "pause", "agent"))
        if number not in agents:
            agents[number] = kind()
        for left in reversed(range(times)):
            time.sleep(0 if left else pause)
            action = agents[number].decide_action(dict(question))
        try:
            if mode == "ros" and not (isinstance(action, dict) and {"linear", "angular"} <= {*action}):
                linear, angular = action.values() if isinstance(action, dict) else action
            else:
                linear, angular = action["linear"], action["angular"]
            answers.append((float(linear), float(angular)))
            if not (isinstance(linear, float) and isinstance(angular, float)):
                no_floats = no_floats or " ".join(repr(action).split())[:TOLD]
        except (KeyError, TypeError, ValueError):
            answers.append((None, None))
            odd = odd or " ".join(repr(action).split())[:TOLD]
    if odd:
        print(f"\nodd: {odd}")
    if no_floats:
        print(f"\nno floats: {no_floats}")
    if tried:
        print(f"\nof ROS: {tried[0]}")
    print(f"\nanswers: {json.dumps(answers)}", flush=True)
