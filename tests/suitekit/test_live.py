"""Messages on a program that offers the right name with another type."""

import os
from collections import Counter
from types import SimpleNamespace
from typing import ClassVar

import pytest

from autograder.errors import TimedOut
from autograder.suitekit import live, renaming
from autograder.suitekit.clock import Clock
from autograder.suitekit.live import LiveProgram, offer
from autograder.suitekit.renaming import Renamed, Topic, TopicProgram
from autograder.suitekit.topics import PUBLISH, SUBSCRIBE

FORCE = ("/force", "a/msg/Whole")
LIFT = "the action /lift (a/action/Lift)"


class Program(LiveProgram):
    """A program that offers these, and nothing that is wanted."""

    def __init__(self, *offered):
        super().__init__(None, "lift.py")
        self.offered = [*offered]
        self.kinds = {LIFT: ("the action /lift", "a/action/Lift"), offer("/block"): (offer("/block"), "a/srv/Block")}
        self._offers = dict.fromkeys(self.kinds, lambda: False)

    def other_services(self):
        return self.offered


@pytest.mark.parametrize(
    ("offered", "wanted", "said"),
    [
        (
            ["the action /lift (a/action/Ride)"],
            (),
            "lift.py offers the action /lift with the type a/action/Ride; its type must be a/action/Lift.",
        ),
        (
            ["/block (a/srv/Other)"],
            (offer("/block"),),
            "lift.py offers the service /block with the type a/srv/Other; its type must be a/srv/Block.",
        ),
        (["/block (a/srv/Other)"], (LIFT,), ""),
        (["the action /ride (a/action/Ride)", "/lift (a/srv/Ride)"], (), ""),
        (["the action /lift (a/action/Lift)"], (), ""),  # found, and not yet ready
    ],
)
def test_an_action_and_a_service_of_another_type_are_named(offered, wanted, said):
    assert Program(*offered).mistyped(wanted) == said


@pytest.mark.parametrize(
    ("topic", "kind", "said"),
    [
        ("/effort", "a/msg/Half", "node.py publishes the topic effort with the type a/Half; its type must be a/Whole."),
        ("/effort", "a/msg/Whole", ""),
        ("/efforts", "a/msg/Half", ""),
    ],
)
def test_a_topic_of_another_type_is_named(monkeypatch, topic, kind, said):
    monkeypatch.setattr(renaming, "own_topics", lambda ros, publish: [(topic, kind)] if publish else [])
    monkeypatch.setattr(live.LiveProgram, "other_services", lambda self: [])
    program = TopicProgram(None, "node.py", renamed=Renamed())
    program.ros = None
    program.topics = {"one": Topic("effort", "a/Whole", PUBLISH), "other": Topic("error", "a/Whole", SUBSCRIBE)}
    program._offers = dict.fromkeys(program.topics, lambda: False)
    assert program.mistyped(("one", "other")) == said
    assert program.mistyped(("other",)) == ""


class Misnamed(TopicProgram):
    """A node that publishes on /force, unless a rule replaces that; it counts how often it is waited for."""

    topics: ClassVar = {"one": Topic("effort", "a/Whole", PUBLISH)}

    def __init__(self, bench, renamed):
        super().__init__(bench, "node.py", renamed=renamed)
        self.ros, self.lines, self.waits = None, [], 0

    def launch(self):
        self.lines.append([*self.command_line])
        self._offers = {"one": lambda: "/force:=/effort" in self.lines[-1]}
        return SimpleNamespace(alive=True, kill=lambda why: None)

    def has_node(self):
        return True

    def wait_until(self, condition, timeout):
        self.waits += not condition()
        return condition()


def test_a_name_that_another_program_of_the_file_has_shown_is_not_waited_for_again(monkeypatch):
    for module in (live, renaming):
        monkeypatch.setattr(module, "own_topics", lambda ros, publish=SUBSCRIBE: [FORCE] if publish else [])
    monkeypatch.setattr(live.LiveProgram, "other_services", lambda self: [])
    bench, renamed = SimpleNamespace(nodeless=Counter(), with_node=set(), clock=Clock(9, 1.0)), Renamed()
    first, begun, later = (Misnamed(bench, renamed) for _ in range(3))
    rule = ["--ros-args", "-r", "/force:=/effort"]
    begun.begin()
    for program in (first, begun, later):
        program.up("one")
    assert [program.lines for program in (first, begun, later)] == [[[], rule], [[], rule], [rule]]
    assert first.waits and not begun.waits and not later.waits


@pytest.mark.parametrize(
    ("source", "names"),
    [
        (b"executor = EventsExecutor()\n", True),
        (b"executor = rclpy.experimental.EventsExecutor(context=c)\n", True),
        (b"# EventsExecutor() did not work\nexecutor = SingleThreadedExecutor()\n", False),
        (b"from rclpy.experimental import EventsExecutor\n", False),
    ],
)
def test_an_executor_that_calls_no_callback_is_named_where_there_is_no_answer(source, names):
    program = Program()
    program.bench = SimpleNamespace(files={"lift.py": source})
    assert ("EventsExecutor" in program.why_silent()) == names


def test_a_file_that_shows_no_node_in_one_world_is_waited_for_briefly_in_the_others():
    bench = SimpleNamespace(nodeless=Counter(), with_node=set())
    one, same, other = LiveProgram(bench, "lift.py"), LiveProgram(bench, "lift.py"), LiveProgram(bench, "client.py")
    before = one.tries
    one.never_shows_a_node()
    assert same.tries == before[1:] and other.tries == before and len(before) == 2
    same.never_shows_a_node()
    assert one.tries == () and other.tries == before
    with pytest.raises(TimedOut, match="lift.py was started, but within 20 s no node appeared"):
        LiveProgram(bench, "lift.py").up()
    with pytest.raises(TimedOut, match="and it never offered the service /block: does the program wait"):
        LiveProgram(bench, "lift.py").up(offer("/block"))
    other.shows_a_node()
    assert one.tries == ()
    one.shows_a_node()
    assert one.tries == same.tries == before


def test_a_program_has_more_time_to_start_on_a_starved_machine(monkeypatch):
    """A right answer that begins with a pause lost the points of six tests at 45 threads for each core."""
    program = LiveProgram(SimpleNamespace(nodeless=Counter(), with_node=set()), "lift.py")
    for load, times in ((4.9, (20.0, 10.0)), (5.1, (60.0, 30.0))):
        monkeypatch.setattr("os.getloadavg", lambda load=load: (load * (os.cpu_count() or 1), 0.0, 0.0))
        assert program.tries == times
