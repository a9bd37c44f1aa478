"""A wrong argument of a figure is reported at once, in the words of that figure."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from sensor_msgs.msg import LaserScan

from course import figures
from course.errors import CourseError
from course.recorders import Recorder
from course.world import Simulation

NAN = math.nan


def goal():
    record = Recorder("event", "sequence", "message")
    for event in ("goal", "accepted", "feedback", "succeeded"):
        record.add(event=event, sequence=[0, 1] if event == "feedback" else None)
    return record


def sets(value=1.0):
    record = Recorder("name", "value", "accepted", "reason")
    record.add(name="max_speed", value=value, accepted=True, reason="")
    return record


def events(*names):
    record = Recorder("event")
    for name in names:
        record.add(event=name)
    return record


def scan(increment):
    return LaserScan(angle_increment=increment, range_min=0.1, range_max=8.0, ranges=[1.0] * 360)


SCAN = LaserScan(angle_increment=math.pi / 2, range_min=0.1, range_max=8.0, ranges=[1.0] * 4)
WRONG = {
    "the table of a goal": (lambda: figures.feedback(goal().table()), "without `.table()`"),
    "feedback of nothing": (figures.feedback, "missing a required argument: 'goal'"),
    "feedback of a track": (lambda: figures.feedback(Recorder("speed")), "lacks event, sequence"),
    "a list of goals": (lambda: figures.timeline([goal(), goal()]), "`timeline(*goals)`"),
    "the table in a timeline": (lambda: figures.timeline(goal().table()), "without `.table()`"),
    "a label too few": (lambda: figures.timeline(goal(), goal(), labels=("one",)), "labels=('goal 1', 'goal 2')"),
    "a label too many": (lambda: figures.timeline(goal(), labels=("one", "two")), "needs 1 label here"),
    "labels in a text": (lambda: figures.timeline(goal(), labels="a"), "labels=('goal 1',), not 'a'"),
    "a misspelt argument": (lambda: figures.timeline(goal(), label=("one",)), "goals, labels, title, together"),
    "live, swapped": (lambda: figures.live(goal(), figures.feedback), "`live(feedback, recorder)`"),
    "live, called": (lambda: figures.live(figures.feedback(goal()), goal()), "name without brackets"),
    "live without a recorder": (lambda: figures.live(figures.feedback), "missing a required argument: 'recorder'"),
    "live of a table": (lambda: figures.live(figures.feedback, goal().table()), "without `.table()`"),
    "live, never redrawn": (lambda: figures.live(figures.feedback, goal(), rate=0), "a number above 0 for `rate`"),
    "live of a text": (lambda: figures.live(lambda record: "a", goal()).__enter__(), "returns 'a': it must return the"),
    "latencies below zero": (lambda: figures.latencies({"rule": [0.1, -0.2]}), "'rule' has -0.2, which is below zero"),
    "live of nothing": (lambda: figures.live(print, goal()).__enter__(), "must return the figure"),
    "changes, swapped": (lambda: figures.changes("max_speed", sets()), "`changes(sets, 'max_speed')`"),
    "changes of all": (lambda: figures.changes(sets()), "missing a required argument: 'name'"),
    "changes of a number": (lambda: figures.changes(sets(), 3), "takes the name of a parameter"),
    "changes of a track": (lambda: figures.changes(Recorder("speed"), "speed"), "lacks name, value"),
    "a misspelt parameter": (lambda: figures.changes(sets(), "max_sped"), "it has max_speed"),
    "a list beside": (lambda: figures.changes(sets(), "max_speed", beside=[1, 2]), "draws a recorder, not [1, 2]"),
    "response of a goal": (lambda: figures.response(goal()), "lacks angle, target, effort, note"),
    "a limit alone": (lambda: figures.response(track(), limits=10), "limits=(-10.0, 10.0)"),
    "a world": (lambda: figures.drive(SimpleNamespace(simulation=Simulation("hall"))), "`world.node.simulation`"),
    "a path": (lambda: figures.drive(Simulation("hall").path), "`world.node.simulation`"),
    "a list of decisions": (lambda: figures.drive(Simulation("hall"), [1]), "draws a recorder, not [1]"),
    "other decisions": (lambda: figures.drive(Simulation("hall"), goal()), "lacks stamp, state"),
    "the sectors themselves": (lambda: figures.sectors({"front": 1.0}, {}), "a sensor_msgs/LaserScan, not {'front'"),
    "no decision": (lambda: figures.sectors(SCAN, (0.3, 0.0)), "{'linear': 0.3, 'angular': 0.0}, not (0.3, 0.0)"),
    "half a decision": (lambda: figures.sectors(SCAN, {"linear": 0.3}), "not {'linear': 0.3}"),
    "sectors without a reach": (lambda: figures.sectors(SCAN, reach=0), "a number above 0 for `reach`"),
    "a list of distances": (lambda: figures.distances([1.0, 2.0], aim=2.0), "a dict of names and numbers"),
    "no aim": (lambda: figures.distances({"rule": [1.0]}), "missing a required argument: 'aim'"),
    "an aim in words": (lambda: figures.distances({"rule": [1.0]}, "2 m"), "for `aim`, not '2 m'"),
    "a list of latencies": (lambda: figures.latencies([0.1, 0.2]), "such as `latencies({'rule': [0.1, 0.2]}, ...)`"),
    "a number for latencies": (lambda: figures.latencies({"rule": 0.1}), "'rule' has 0.1"),
    "text for latencies": (lambda: figures.latencies({"rule": ["a"]}), "'rule' has ['a']"),
    "latencies without a number": (lambda: figures.latencies({"rule": [NAN]}), "nan is among its numbers"),
    "a limit of nothing": (lambda: figures.latencies({"rule": [0.1]}, 0), "for `limit`, not 0"),
    "too many latencies": (lambda: figures.latencies({key: [0.1] for key in "abcde"}), "4 series at most"),
    "a list of round trips": (lambda: figures.round_trips([0.1, 0.2]), "a dict of names and numbers"),
    "too many round trips": (lambda: figures.round_trips({key: [0.1] for key in "abcde"}), "4 series at most"),
    "no goal": (figures.timeline, "such as `timeline(goal)`"),
    "a misspelt event": (lambda: figures.timeline(events("request", "respons")), "has no mark for the event 'respons'"),
    "an arm": (lambda: figures.response(SimpleNamespace(track=track())), "Give it its recorder, `.track`"),
    "a text's changes": (lambda: figures.changes(sets("a"), "max_speed"), "draws numbers, and 'max_speed' has the"),
    "a list's changes": (lambda: figures.changes(sets([1.0, 2.0]), "max_speed"), "has the value [1.0, 2.0]"),
    "words beside": (lambda: figures.changes(sets(), "max_speed", beside=events("a")), "'event' has ['a']"),
    "live without a record": (lambda: figures.live(lambda: None, goal()), "as in `lambda record: ...`"),
    "a scan's class": (lambda: figures.sectors(LaserScan), "a sensor_msgs/LaserScan, not <class"),
    "a scan of nothing": (lambda: figures.sectors(LaserScan()), "`range_max` (m) must be above"),
    "beams in degrees": (lambda: figures.sectors(scan(1.0)), "the 360 beams of this scan are 1 rad apart"),
    "beams at one angle": (lambda: figures.sectors(scan(0.0)), "the 360 beams of this scan are 0 rad apart"),
    "a file of no format": (lambda: figures.feedback(goal()).save("goal.abc"), "cannot be saved as 'goal.abc'"),
    "a file in no folder": (lambda: figures.feedback(goal()).save("nowhere/goal.png"), "No such file"),
    "no file": (lambda: figures.feedback(goal()).save(), "missing a required argument: 'path'"),
    "a title that is none": (lambda: figures.feedback(goal(), 3), "`title='...'`, not 3"),
    "a title of a drive that is none": (lambda: figures.drive(Simulation("hall"), None, 3), "`title='...'`, not 3"),
}


def track():
    record = Recorder("angle", "target", "effort", "note")
    record.add(angle=0.1, target=0.2, effort=1.0)
    return record


@pytest.mark.parametrize("name", WRONG)
def test_what_is_meant_is_written_out(name):
    wrong, told = WRONG[name]
    with pytest.raises(CourseError) as error:
        wrong()
    assert told in str(error.value)


def test_feedback_without_a_list_is_no_empty_figure():
    record = Recorder("event", "sequence")
    record.add(event="feedback", sequence=None)
    with pytest.raises(CourseError, match="the feedback of this goal has no list"):
        figures.feedback(record)


def test_a_live_figure_needs_its_with_block_and_a_condition():
    shown = figures.live(figures.feedback, goal())
    assert "with live(" in repr(shown)
    with pytest.raises(CourseError, match="write `with live"):
        shown.wait(lambda: True)
    with shown, pytest.raises(CourseError, match="write `lambda:` before the condition"):
        shown.wait(True)
    with shown, pytest.raises(CourseError, match="a function without arguments"):
        shown.wait(lambda track: len(track) > 3)
    with shown, pytest.raises(CourseError, match="a time limit is a number of seconds"):
        shown.wait(lambda: False, timeout="5")


def test_a_figure_that_cannot_be_drawn_is_told_once(monkeypatch):
    monkeypatch.setattr("course.figures.picture.display", lambda *_, **__: SimpleNamespace(update=lambda picture: None))
    record, drawn = goal(), []

    def draw(_):
        drawn.append(True)
        return figures.feedback(goal()) if len(drawn) == 1 else 1 / 0

    with pytest.raises(ZeroDivisionError) as error, figures.live(draw, record, rate=100) as shown:
        shown.wait(lambda: False, timeout=5.0)
    assert error.value.__context__ is None


def test_numbers_may_be_arrays():
    for drawn in (
        figures.distances({"rule": np.array([1.0, math.inf, 2.0])}, aim=2.0),
        figures.latencies({"rule": np.array([0.1])}),
        figures.round_trips({"calls": np.array([0.1])}),
    ):
        assert drawn.alt
