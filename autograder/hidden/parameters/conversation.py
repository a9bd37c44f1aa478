"""The grader's side of the conversation: it sets the PID node's parameters, sends errors and hears the efforts."""

import time
from typing import NamedTuple

from std_msgs.msg import Float64

from autograder.errors import Wrong
from autograder.suitekit.live import Live
from autograder.suitekit.parameters import OFFER, Parameters
from autograder.suitekit.topics import Listener, speaker

ERROR = "a subscription to the topic error (std_msgs/Float64)"
EFFORT = "a publisher of the topic effort (std_msgs/Float64)"
DEFAULTS = {"kp": 1.0, "ki": 0.0, "kd": 0.0, "output_min": -10.0, "output_max": 10.0, "joint_name": "elbow"}
RANGES = {"kp": (0.0, 100.0), "ki": (0.0, 50.0), "kd": (0.0, 10.0)}
WIDE = {"output_min": -1e6, "output_max": 1e6}  # limits that clamp nothing
JOINTS = ["wrist", "shoulder", "hip", "knee", "ankle", "neck"]


class Answer(NamedTuple):
    """An effort; the node met the error that it answers between `sent` and `came` (s)."""

    effort: float
    sent: float
    came: float


class PidNode(Live):
    """The student's node."""

    advice = "every message on error must be answered with one on effort, and no callback may wait"

    def __init__(self, bench, *args: str):
        super().__init__(bench, "pid_node.py", *args)
        self.parameters = Parameters(self, topic="error")

    def connect(self):
        """A publisher, a subscription and the clients of the parameter services."""
        self.efforts = Listener(self.ros, "effort", Float64)
        self.errors = speaker(self.ros, "error", Float64)
        self.fresh = True  # no error has been sent to this start of the program
        return {
            ERROR: lambda: self.errors.get_subscription_count() > 0,
            EFFORT: lambda: self.efforts.ready,
            **self.parameters.connect(),
        }

    def send(self, error: float) -> Answer:
        """The answer to an error; raises Crashed or TimedOut when there is none."""
        self.bench.hide(error)

        def ask(limit, alive):
            self.fresh = False
            before, sent = len(self.efforts.heard), time.monotonic()
            self.errors.publish(Float64(data=error))
            heard = self.efforts.wait(lambda heard: heard[before:], limit, alive)
            return heard and Answer(heard[0].message.data, sent, heard[0].time)

        return self.converse(ask, "a message on error", OFFER, ERROR, EFFORT)

    def get(self) -> dict:
        """Its parameters, as far as they are declared."""
        return self.parameters.get(*DEFAULTS)

    def arrange(self, **values: float) -> None:
        """Set gains and limits, by default no gain and no limit, for a test of something else."""
        self.bench.hide(*values.values())
        everything = {"kp": 0.0, "ki": 0.0, "kd": 0.0} | WIDE | values
        if not self.parameters.set_together(everything).successful:
            for _ in (1, 2):  # the first round may have to make room for a limit
                self.parameters.set(everything)
        got = self.get()
        for name, value in values.items():
            if name in RANGES and got.get(name) != value:
                raise Wrong(f"It must be possible to set {name} to any value in its range.", f"{name} {value}: {got}")

    def expect_refusal(self, about: str, **values) -> str:
        """A set of these at once is refused and changes nothing; `about` tells the student what they are."""
        before = self.get()
        if len(values) > 1:
            results = [self.parameters.set_together(values)]
        else:
            results = self.parameters.set(values)
        after = self.get()
        got = f"{values}: {results}, {before} became {after}"
        if any(result.successful for result in results):
            raise Wrong(f"{about} must be refused.", got)
        if after != before:
            raise Wrong(f"{about} must be refused, and then nothing may have changed.", got)
        if not all(result.reason.strip() for result in results):
            raise Wrong(f"{about}: a refusal must give its reason; it is empty.", got)

    def expect_set(self, about: str, **values) -> None:
        """A set of these at once is accepted."""
        result, after = self.parameters.set_together(values), self.get()
        if not result.successful or any(after.get(name) != value for name, value in values.items()):
            raise Wrong(f"{about} must be accepted.", f"{values}: {result}, {after}")

    def expect_effort(self, error: float, effort: float, about: str) -> Answer:
        """It answers with this effort."""
        answer = self.send(error)
        if not near(answer.effort, effort):
            raise Wrong(f"{about}.", f"error {error}: expected {effort}, got {answer.effort}, parameters {self.get()}")
        return answer

    def ensure_fresh(self) -> None:
        """Have the program running, and no error sent to it yet."""
        if not self.fresh:
            self.program.kill()
            self.begin()
        self.up(OFFER, ERROR, EFFORT)
        self.get()  # who has answered, has met the grader's publisher and subscription too


def near(got: float, right: float) -> bool:
    """Whether two numbers are the same but for rounding."""
    return abs(got - right) <= 1e-9 * max(1.0, abs(right))


def between(got: float, ends: tuple[float, float], tolerance: float = 0.02) -> bool:
    """Whether a number lies between two, in any order, widened by `tolerance` of the larger."""
    low, high = sorted(ends)
    room = tolerance * max(abs(low), abs(high)) + 1e-9
    return low - room <= got <= high + room


def overrides(bench, purpose: str) -> dict:
    """Values for all parameters that are none of the defaults."""
    rng = bench.random(purpose)
    values = {
        "kp": rng.randrange(9, 160) / 4,
        "ki": rng.randrange(5, 40) / 8,
        "kd": rng.randrange(5, 40) / 16,
        "output_min": -rng.randrange(5, 39) / 4,
        "output_max": rng.randrange(5, 39) / 4,
        "joint_name": rng.choice(JOINTS),
    }
    bench.hide(*values.values())
    return values
