"""The toolkit for hidden suites: running a student's programs, talking to them over ROS 2, and giving verdicts.

A suite's author finds everything here: `from autograder.suitekit import Server, Wrong, points`.  Importing this package
loads ROS 2, so only the judging process does it, never the coordinator.
"""

from autograder.errors import Crashed, TimedOut, Wrong
from autograder.suitekit.actions import ActionCaller, Goal, offered_actions, serve, sought_actions
from autograder.suitekit.bench import Bench
from autograder.suitekit.judge import on_wrong, points, twice
from autograder.suitekit.lifecycle import ANSWER, SETTLED, START, Alive
from autograder.suitekit.live import LiveProgram, Offers, Server, offer
from autograder.suitekit.parameters import Parameters
from autograder.suitekit.printed_numbers import numbers, when_changed
from autograder.suitekit.renaming import Renamed, Topic, TopicProgram
from autograder.suitekit.ros import Ros
from autograder.suitekit.runs import (
    Run,
    expect_gives_up,
    expect_patience,
    expect_patience_when_asked,
    expect_status,
    expect_usage,
    expect_words,
    plain_lines,
)
from autograder.suitekit.topics import PUBLISH, SUBSCRIBE, Heard, Listener, Rate, speaker
from course.foundation.waiting import wait_until

__all__ = [
    "ANSWER",
    "PUBLISH",
    "SETTLED",
    "START",
    "SUBSCRIBE",
    "ActionCaller",
    "Alive",
    "Bench",
    "Crashed",
    "Goal",
    "Heard",
    "Listener",
    "LiveProgram",
    "Offers",
    "Parameters",
    "Rate",
    "Renamed",
    "Ros",
    "Run",
    "Server",
    "TimedOut",
    "Topic",
    "TopicProgram",
    "Wrong",
    "expect_gives_up",
    "expect_patience",
    "expect_patience_when_asked",
    "expect_status",
    "expect_usage",
    "expect_words",
    "numbers",
    "offer",
    "offered_actions",
    "on_wrong",
    "plain_lines",
    "points",
    "serve",
    "sought_actions",
    "speaker",
    "twice",
    "wait_until",
    "when_changed",
]
