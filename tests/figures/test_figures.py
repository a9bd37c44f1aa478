"""Figures: each draws what is recorded; as text it never changes, so that a stored notebook can be compared."""

import itertools
import math
import re
import threading
import time
from collections.abc import Iterator
from functools import cache
from types import SimpleNamespace

import matplotlib.colors
import matplotlib.style
import numpy as np
import pytest
from IPython.testing.globalipapp import start_ipython
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection, LineCollection, PathCollection
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.spines import Spine
from matplotlib.text import Text
from sensor_msgs.msg import LaserScan

from course import figures
from course.figures import palette
from course.figures.picture import SHARE
from course.figures.room import DISC, LOOKS, MOTIONS
from course.foundation import waiting
from course.recorders import ParameterRecorder, Recorder
from course.world import Simulation
from course.world.geometry import clearance


class Recorded(Recorder):
    """A recorder with rows given."""

    def __init__(self, *columns, rows=()):
        super().__init__(*columns)
        for row in rows:
            self.add(**dict(zip(columns, row, strict=True)))


def goal(*events):
    return Recorded("event", "sequence", rows=[(event, [0, 1] if event == "feedback" else None) for event in events])


def scan(ranges):
    return LaserScan(
        angle_min=0.0, angle_increment=2 * np.pi / len(ranges), range_min=0.1, range_max=8.0, ranges=ranges
    )


def driven():
    simulation = Simulation("hall")
    record = Recorded("stamp", "state")
    for step in range(40):
        record.add(stamp=simulation.time, state=["FORWARD", "TURNING_LEFT"][step // 20])
        simulation.step(0.3, 0.5 * (step // 20), 0.1)
    return simulation, record


DRAWN = {
    "feedback": lambda: figures.feedback(goal("goal", "accepted", "feedback", "feedback", "succeeded")),
    "feedback of nothing": lambda: figures.feedback(goal()),
    "timeline": lambda: figures.timeline(
        goal("goal", "accepted", "feedback", "cancel", "canceled"), goal("goal", "rejected"), labels=("one", "two")
    ),
    "timeline on one clock": lambda: figures.timeline(
        goal("goal", "accepted", "feedback", "aborted"), goal("request", "response"), together=True
    ),
    "timeline of nothing": lambda: figures.timeline(goal()),
    "sectors": lambda: figures.sectors(scan([0.4] * 180 + [float("inf")] * 180), {"linear": 0.0, "angular": 0.5}),
    "sectors of no beam": lambda: figures.sectors(scan([float("nan")] * 8), {"linear": 0.3, "angular": 0.0}),
    "drive": lambda: figures.drive(*driven()),
    "drive without decisions": lambda: figures.drive(Simulation("office")),
    "distances": lambda: figures.distances({"rule": [3.0, 2.5, 2.0]}, aim=2.0),
    "latencies": lambda: figures.latencies({"fast": [0.001] * 9, "slow": [0.15] * 9}),
    "latencies of nothing": lambda: figures.latencies({"none": []}),
    "round trips": lambda: figures.round_trips({"calls": [0.001, 0.002]}),
    "changes": lambda: figures.changes(
        Recorded(
            "name",
            "value",
            "accepted",
            "reason",
            rows=[("speed", 1.0, True, ""), ("speed", 9.0, False, "too fast"), ("name", "atlas", True, "")],
        ),
        "speed",
    ),
    "response": lambda: figures.response(
        Recorded(
            "angle",
            "target",
            "effort",
            "note",
            rows=[(0.0, 1.0, 0.0, None), (None,) * 3 + ("ki = 2",), (0.2, 1.0, 9.0, None)],
        )
    ),
    "response of nothing": lambda: figures.response(Recorded("angle", "target", "effort", "note")),
    "changes of nothing": lambda: figures.changes(Recorded("name", "value", "accepted", "reason"), "speed"),
}


@cache
def figure_of(name):
    """One of these figures, for all tests that only look at it."""
    return DRAWN[name]()


@pytest.mark.parametrize("name", DRAWN)
def test_every_figure_is_a_picture_with_a_constant_text(name):
    first, second = figure_of(name), DRAWN[name]()
    png, metadata = first._repr_png_()
    assert png.startswith(b"\x89PNG") and metadata == {"alt": first.alt, "width": 600}
    assert int.from_bytes(png[16:20], "big") == 1200  # twice the page's pixels, for screens and paper that show them
    assert repr(first) == repr(second) and "0x" not in repr(first)


ALTERNATIVES = {
    "feedback": ["Each feedback message", "2 feedback messages", "from 1 to 1"],
    "timeline": [
        "one: sent at 0.0 s",
        "canceled at",
        "1 feedback message",
        "Two: sent",
        "the client sends or receives",
    ],
    "sectors": ["front: 0.40 m", "right: free", "arrow points to the left"],
    "drive": ["touched nothing", "starts at x", "FORWARD 50%", "TURNING_LEFT 50%"],
    "distances": ["aim is 2 m", "Rule: in the second half between 2.00 and 2.50 m"],
    "latencies": ["limit is 100 ms", "Fast: 0% too late", "Slow: 100% too late"],
    "round trips": ["Calls: 2 calls, medians of the first and the last 30: 1.5 ms and 1.5 ms"],
    "changes": ["set to 1.0", "9.0 at", "refused: too fast"],
    "response": ["ki = 2 at", "0.20 rad", "9.0 N m"],
}


@pytest.mark.parametrize("name", ALTERNATIVES)
def test_the_alternative_text_says_what_the_data_say(name):
    alt = figure_of(name).alt
    assert [words for words in ALTERNATIVES[name] if words.lower() not in alt.lower()] == [], alt


@pytest.mark.parametrize("name", [name for name in DRAWN if not {"nothing", "sectors", "response"} & {*name.split()}])
def test_axes_have_a_title_and_labels_with_units(name):
    axes = [each for each in figure_of(name).figure.axes if each.axison]
    assert axes[0].get_title(loc="left")
    assert all(each.get_xlabel() or each.get_shared_x_axes().joined(each, axes[-1]) for each in axes)
    assert axes[-1].get_xlabel()


PHONE = 358  # pixels: the width of a page's text on a telephone


@pytest.mark.parametrize("name", DRAWN)
def test_on_a_telephone_every_text_is_large_enough_and_whole_and_none_is_over_another(name):
    figure = figure_of(name).figure
    figure.draw_without_rendering()
    beyond = {label for axes in figure.axes for label in _beyond(axes)}
    shown = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    shown = [text for text in shown if text not in beyond]
    assert shown
    small = [text.get_text() for text in shown if text.get_fontsize() / 72 * PHONE / figure.get_figwidth() < 9.5]
    assert small == []
    inside = figure.bbox.padded(1)
    boxes = {text.get_text(): text.get_window_extent() for text in shown}
    assert [text for text, box in boxes.items() if not (inside.contains(*box.min) and inside.contains(*box.max))] == []
    titles = [title for title in (figure._suptitle, *(axes._left_title for axes in figure.axes)) if title in shown]
    legends = [legend.get_window_extent() for legend in figure.legends]
    for title in titles:
        box = title.get_window_extent()
        assert not [
            other.get_text() for other in shown if other is not title and box.overlaps(other.get_window_extent())
        ]
    assert not [axes for axes in figure.axes for box in legends if box.overlaps(axes.get_window_extent())]


def _looks(artists: Iterator[Artist]) -> set[tuple[bool, str]]:
    """Return for each artist whether it is a marker, not a line or an area, and its colour without transparency."""
    looks = set()
    for artist in artists:
        if isinstance(artist, Line2D):
            drawn = artist.get_marker() not in ("", "None", None)
            colours, marker = [artist.get_markeredgecolor() if drawn else artist.get_color()], drawn
        elif isinstance(artist, Collection):
            marker = isinstance(artist, PathCollection)
            colours = artist.get_edgecolor() if marker or isinstance(artist, LineCollection) else artist.get_facecolor()
        else:
            colours, marker = [artist.get_facecolor() if artist.get_fill() else artist.get_edgecolor()], False
        looks |= {(marker, matplotlib.colors.to_hex(colour)) for colour in colours}
    return looks


@pytest.mark.parametrize("name", DRAWN)
def test_every_mark_is_explained_in_the_legend_or_at_its_row(name):
    figure = figure_of(name).figure
    drawn = set[tuple[bool, str]]()
    for axes in figure.axes:
        if [label.get_text() for label in axes.get_yticklabels()] in ([*MOTIONS], [*palette.STATES]):
            continue  # a strip, whose rows have names
        artists = [artist for artist in axes.get_children() if isinstance(artist, Line2D | Collection | Patch)]
        arrows = [text.arrow_patch for text in axes.texts if getattr(text, "arrow_patch", None)]
        robot = {(False, DISC)} if name.startswith("drive") else set()
        shown = [
            artist
            for artist in artists
            if artist is not axes.patch
            and not isinstance(artist, Spine)
            and not (isinstance(artist, Line2D) and not len(artist.get_xdata()))
        ]
        drawn |= _looks([*shown, *arrows]) - robot
    explained = _looks(
        artist
        for legend in figure.findobj(Legend)
        for artist in legend.findobj(lambda each: isinstance(each, Line2D | Collection | Patch))
        if artist is not legend.legendPatch
    )
    assert drawn <= explained, (drawn - explained, explained)
    assert all(text.get_text() for legend in figure.legends for text in legend.get_texts()) or name.startswith("drive")


def test_no_two_bars_of_the_strip_overlap_and_each_is_as_wide_as_its_time():
    simulation = Simulation("office")
    for step in range(600):
        simulation.step(*((0.3, 0.0), (0.0, 0.5), (0.0, -0.5))[step % 3], 0.1)
    figure = figures.drive(simulation).figure
    figure.draw_without_rendering()
    strip = figure.axes[1]
    bars = sorted(
        (*path.get_extents().intervalx, number)
        for number, lane in enumerate(strip.collections)
        for path in lane.get_paths()
    )
    assert len(bars) == 600 and {number for *_, number in bars} == {0, 1, 2}
    assert all(end <= begin + 1e-6 for (_, end, _), (begin, _, _) in itertools.pairwise(bars))
    assert sum(end - begin for begin, end, _ in bars) == pytest.approx(60.0, abs=0.01)
    assert [lane for lane in strip.collections if lane.get_linewidth().any() or lane.get_snap() is not False] == []


@pytest.mark.parametrize("name", [name for name in DRAWN if "nothing" not in name])
def test_the_labels_of_axes_are_written_as_in_a_textbook(name):
    figure = figure_of(name).figure
    labels = [label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel())]
    labels = [label for label in [*labels, figure.get_supylabel()] if label]
    counted = ("Number of decisions", "Number of the call", "Newest element", "Value of speed")  # they have no unit
    form = re.compile(r"(?:[A-Z][^()]*|[xy]) \([^()]+\)(?:, [a-z]+ \([^()]+\))?")
    assert [label for label in labels if not form.fullmatch(label) and label not in counted] == []
    for axes in figure.axes:
        for scale, label in ((axes.get_xscale(), axes.get_xlabel()), (axes.get_yscale(), axes.get_ylabel())):
            assert label.endswith(", logarithmic)") == (scale == "log")


def _beyond(axes: Axes) -> Iterator[Text]:
    """The labels of ticks beyond the axes, which Matplotlib keeps and does not draw."""
    for axis in (axes.xaxis, axes.yaxis):
        low, high = sorted(axis.get_view_interval())
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
            if not low <= tick.get_loc() <= high:
                yield tick.label1


def _in_the_dark(color):
    """Return a colour after `invert(0.92) hue-rotate(180deg)` of a dark theme, as Filter Effects 1 defines it."""
    luma = np.array([0.213, 0.715, 0.072])
    return np.clip((2 * np.ones((3, 1)) * luma - np.eye(3)) @ (0.92 - 0.84 * color), 0, 1)


def _luminance(color):
    """WCAG's relative luminance."""
    return np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722]


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("name", ["BLACK", "ORANGE", "SKY", "GREEN", "BLUE", "VERMILLION", "PURPLE", "GREY"])
def test_each_colour_is_seen_on_the_ground_and_keeps_its_hue_in_the_dark(name, theme):
    color, ground = (np.array(matplotlib.colors.to_rgb(each)) for each in (getattr(palette, name), palette.GROUND))
    if theme == "dark":
        hue = matplotlib.colors.rgb_to_hsv(color)[0]
        color, ground = _in_the_dark(color), _in_the_dark(ground)
        turned = abs(matplotlib.colors.rgb_to_hsv(color)[0] - hue)
        assert name in ("BLACK", "GREY") or min(turned, 1 - turned) < 0.05  # an orange line stays orange
    dark, light = sorted((_luminance(color), _luminance(ground)))
    assert (light + 0.05) / (dark + 0.05) >= 3  # WCAG 1.4.11


@pytest.mark.parametrize("name", ["timeline", "timeline on one clock"])
def test_a_timeline_says_that_its_times_are_the_clients(name):
    (legend,) = figure_of(name).figure.legends
    assert legend.get_title().get_text() == "Each mark: when the client sends it, or receives it"


def test_a_request_to_cancel_is_told_from_a_goal_without_its_colour():
    axes = figure_of("timeline").figure.axes[0]
    ground = matplotlib.colors.to_rgba(palette.GROUND)
    hollow = [len(each.get_offsets()) for each in axes.collections if tuple(each.get_facecolor()[0]) == ground]
    assert hollow == [1]


def test_refused_sets_are_not_on_the_line_of_values():
    axes = figure_of("changes").figure.axes[0]
    lines = {line.get_label(): list(line.get_ydata()) for line in axes.get_lines()}
    assert lines["speed"] == [1.0] and lines["accepted"] == [1.0]


def test_a_refused_value_is_marked_at_its_value_or_by_an_arrow_if_far_and_its_reason_is_told():
    rows = [
        ("speed", 1.0, True, ""),
        ("speed", 3.0, True, ""),
        ("speed", 2.0, False, "not now"),
        ("speed", 3.5, False, "too fast"),
        ("speed", 500.0, False, "too fast"),
        ("speed", math.nan, False, "no number"),
        ("name", "atlas", True, ""),
    ]
    record = Recorded("name", "value", "accepted", "reason", rows=rows)
    figure = figures.changes(record, "speed").figure
    axes = figure.axes[0]
    value = next(line for line in axes.get_lines() if line.get_label() == "speed")
    assert list(value.get_ydata()) == [1.0, 3.0]
    low, high = axes.get_ylim()
    assert 0 < low < 1 and 3.5 < high < 4
    marks = [(line.get_marker(), line.get_ydata()[0]) for line in axes.get_lines() if len(line.get_ydata()) == 1]
    assert [mark for mark, _ in marks[-4:]] == ["X", "X", "^", "s"] and [at for _, at in marks[-4:-2]] == [2.0, 3.5]
    assert 3 < marks[-2][1] < high and low < marks[-1][1] < 1  # inside, clear of the title and the axis
    (listed,) = figure.axes[1].texts
    assert listed.get_text().splitlines() == [
        "1  2.0 refused: not now",
        "2  3.5 refused: too fast",
        "3  500.0 refused: too fast",
        "4  nan refused: no number",
    ]


def test_what_follows_the_value_is_drawn_beside_it_in_its_unit():
    sets = Recorded("name", "value", "accepted", "reason", rows=[("max_speed", 1.0, True, "")])
    beside = Recorded("speed", rows=[(0.0,), (0.5,)])
    beside.start = sets.start + 3.0
    axes = figures.changes(sets, "max_speed", unit="m/s", beside=beside).figure.axes[0]
    assert axes.get_ylabel() == "Value of max_speed and speed (m/s)"
    (speed,) = (line for line in axes.get_lines() if line.get_label() == "speed")
    assert list(speed.get_ydata()) == [0.0, 0.5]
    assert 3.0 < min(speed.get_xdata()) < 3.1  # on the clock of the sets
    held = next(line for line in axes.get_lines() if list(line.get_ydata()) == [1.0, 1.0])
    assert held.get_xdata()[-1] == speed.get_xdata()[-1]


class Started(ParameterRecorder):
    """A recorder of parameters with rows given, the first of which was the value at its start."""

    def __init__(self, *rows):
        Recorder.__init__(self, "name", "value", "accepted", "reason")
        for value in rows:
            self.add(name="speed", value=value, accepted=True, reason="")
        self.at_start = 1

    def range(self, name):
        return (0.0, 2.0)


def test_the_value_at_the_start_is_not_taken_for_a_set():
    picture = figures.changes(Started(1.0, 1.5), "speed")
    lines = {line.get_label(): list(line.get_ydata()) for line in picture.figure.axes[0].get_lines()}
    assert lines["speed"] == [1.0, 1.5] and lines["accepted"] == [1.5] and "declared range" in lines
    assert "speed begins at 1.0. speed was set to 1.5 at" in picture.alt
    alone = figures.changes(Started(1.0), "speed")
    assert "speed begins at 1.0. The declared" in alone.alt
    assert "accepted" not in [line.get_label() for line in alone.figure.axes[0].get_lines()]


def test_the_angle_and_the_effort_of_an_arm_are_drawn_with_what_was_done_to_it():
    upper, lower = figure_of("response").figure.axes
    lines = {line.get_label(): list(line.get_ydata()) for line in upper.get_lines()}
    assert lines["angle"] == [0.0, 0.2] and lines["target"] == [1.0, 1.0]
    assert [text.get_text() for text in upper.texts] == ["ki = 2"]
    assert list(lower.get_lines()[0].get_ydata()) == [0.0, 9.0] and lower.get_xlabel()


def test_the_title_and_the_alternative_text_of_an_arm_say_how_far_it_hung_and_swung():
    angles = [0.0, 0.4, 0.4, None, 0.7, 1.1, 1.0, None, 0.9, 0.64, 1.13, 0.99]
    rows = [(None, None, None, "a gain") if angle is None else (angle, 1.0, 6.0, None) for angle in angles]
    record = Recorded("angle", "target", "effort", "note", rows=rows)
    record._rows = [(float(number), *row[1:]) for number, row in enumerate(record._rows)]
    picture = figures.response(record)
    title = picture.figure.axes[0].get_title(loc="left").replace("\n", " ")
    assert title.startswith("Off its target: 0.60 rad before a gain, 0.00 rad before a gain, 0.01 rad at 11.0 s")
    _, first, second, _ = picture.alt.split(" s, with")
    assert re.search(r"; then the angle rises to 1\.10 rad at 5\.0 s\. a gain at", first)
    assert re.search(r"; then the angle falls to 0\.64 rad at 9\.0 s and rises to 1\.13 rad at 10\.0 s\.", second)


def test_the_last_value_holds_to_the_edge_of_the_axis():
    rows = [("speed", 1.0, True, ""), ("speed", 3.0, True, "")]
    axes = figures.changes(Recorded("name", "value", "accepted", "reason", rows=rows), "speed").figure.axes[0]
    axes.plot([0.0, 7.0], [0.0, 3.0])  # what a notebook draws over it
    held = next(line for line in axes.get_lines() if list(line.get_ydata()) == [3.0, 3.0])
    assert 7.0 < axes.get_xlim()[1] < 8.0 < held.get_xdata()[-1]


def test_the_share_of_late_decisions_is_told():
    (legend,) = figure_of("latencies").figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "fast: 0% too late",
        "slow: 100% too late",
        "limit, 100 ms",
    ]


def test_the_path_has_the_colour_of_its_state():
    simulation, record = driven()
    colours = figures.drive(simulation, record).figure.axes[0].collections[0].get_colors()
    assert matplotlib.colors.same_color(colours[0], palette.STATES["FORWARD"])
    assert matplotlib.colors.same_color(colours[-1], palette.STATES["TURNING_LEFT"])


def test_without_decisions_the_colours_show_how_the_robot_moved():
    simulation = Simulation("hall")
    for linear, angular in ((0.3, 0.0), (0.3, 0.5), (0.0, -0.5), (0.0, 0.0)):
        simulation.step(linear, angular, 0.1)
    room, lanes = figures.drive(simulation).figure.axes
    assert [label.get_text() for label in lanes.get_yticklabels()] == [*MOTIONS]
    assert [matplotlib.colors.to_hex(colour).upper() for colour in room.collections[0].get_colors()] == [
        MOTIONS["straight on"],
        MOTIONS["to the left"],
    ]
    spots = {line.get_markeredgecolor() for line in room.lines if line.get_marker() in "os"}
    assert spots == {MOTIONS["to the right"], MOTIONS["not moving"]}


def _room(figure) -> np.ndarray:
    """The pixels of the axes of a room."""
    figure.canvas.draw()
    box, pixels = figure.axes[0].bbox, np.asarray(figure.canvas.buffer_rgba())[:, :, :3].astype(int)
    height = len(pixels)
    return pixels[height - int(box.y1) : height - int(box.y0), int(box.x0) : int(box.x1)]


def test_each_mark_of_a_drive_is_seen_where_many_are_at_one_place():
    simulation = Simulation("hall")
    while not simulation.collisions:
        simulation.step(0.3, 0.0, 0.1)
    for linear, angular in [(0.0, 0.0)] * 3 + [(0.0, 0.9), (0.0, 0.9), (0.0, -0.9), (-0.01, -0.9)] * 5:
        simulation.step(linear, angular, 0.1)
    figure = figures.drive(simulation).figure
    walls = [patch for patch in figure.axes[0].patches if not patch.get_fill()]
    marks = [*figure.axes[0].lines, *walls, *figure.axes[0].collections]  # of the robot, the line to its front
    whole, seen = _room(figure), {}
    for mark in marks:
        mark.set_visible(False)
        seen[mark] = int((np.abs(_room(figure) - whole).sum(axis=2) > 90).sum())
        mark.set_visible(True)
    assert len(marks) == 8 and min(seen.values()) >= 12, seen
    named = [text.get_text() for text in figure.legends[0].get_texts()]
    assert [name for name in named if name] == [
        "wall or obstacle",
        "start",
        "touched something",
        "straight on",
        "to the left, on the spot",
        "to the right, on the spot",
        "not moving",
        "robot at the end, line: front",
    ]


def test_the_states_of_a_path_can_be_told_apart_without_their_colours():
    simulation = Simulation("hall")
    for _ in range(3):
        for angular in (0.0, 0.5, -0.5):
            simulation.step(0.3, angular, 0.1)
    path = figures.drive(simulation).figure.axes[0].collections[0]
    widths = dict[str, set[float]]()
    for colour, width in zip(path.get_colors(), path.get_linewidths(), strict=True):
        widths.setdefault(matplotlib.colors.to_hex(colour).upper(), set()).add(float(width))
    (straight,), (left,), (right,), (core,) = (
        widths[each] for each in (palette.GREEN, palette.BLUE, palette.ORANGE, palette.GROUND.upper())
    )
    assert left >= 2 * straight and core > 1 and right - core >= 2  # thin, thick, and two thin lines
    spots = [look[3:] for look in LOOKS.values()]
    assert len({*spots[:4]}) == 4 and len({look[:4] for look in LOOKS.values()}) == len(LOOKS)


def test_a_collision_is_marked_where_the_robot_touched_the_wall_without_a_gap_in_it():
    simulation = Simulation("hall")
    while not simulation.collisions:
        simulation.step(0.3, 0.0, 0.1)
    picture = figures.drive(simulation)
    axes = picture.figure.axes[0]
    (cross,) = (line for line in axes.lines if line.get_color() == palette.VERMILLION)
    point = cross.get_xydata()[0]
    assert clearance(point, simulation.room.segments) < 1e-6
    assert math.dist(point, simulation.pose[:2]) == pytest.approx(simulation.robot.radius, abs=0.01)
    assert cross.get_marker() == "x"  # its arms have no light edge
    assert all(cross.get_zorder() > patch.get_zorder() for patch in axes.patches)
    assert f"touched something at x {point[0]:.1f} m, y {point[1]:.1f} m" in picture.alt


@pytest.mark.parametrize(("room", "closed", "open_ones"), [("pillars", 6, 0), ("office", 5, 2), ("bends", 1, 0)])
def test_walls_and_pillars_are_lines_with_joined_corners(room, closed, open_ones):
    axes = figures.drive(Simulation(room)).figure.axes[0]
    (walls,) = (patch for patch in axes.patches if not patch.get_fill())
    codes = walls.get_path().codes.tolist()
    assert (codes.count(walls.get_path().CLOSEPOLY), codes.count(walls.get_path().MOVETO)) == (
        closed,
        closed + open_ones,
    )
    assert walls.get_joinstyle() == "miter"


def test_the_robot_is_drawn_no_larger_than_it_is():
    simulation = Simulation("hall")
    figure = figures.drive(simulation).figure
    figure.set_dpi(300)
    axes = figure.axes[0]
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[:, :, 0]
    x, y, heading = simulation.pose

    def light(distance):
        turn = heading + np.radians(np.arange(45, 316, 15))
        places = axes.transData.transform(np.column_stack([x + distance * np.cos(turn), y + distance * np.sin(turn)]))
        return [pixels[len(pixels) - 1 - int(down), int(across)] for across, down in places]

    radius = simulation.robot.radius
    assert min(light(radius + 0.015)) > 200 and max(light(radius - 0.012)) < 100


@pytest.mark.parametrize("angular", [-0.5, 0.5, 0.0])
def test_the_tip_of_the_arrow_is_the_farthest_that_is_drawn_of_a_decision(angular):
    figure = figures.sectors(scan([2.0] * 360), {"linear": 0.3, "angular": angular}).figure
    figure.set_dpi(300)
    axes = figure.axes[0]
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[:, :, :3].astype(int)
    red = np.abs(pixels - np.round(255 * np.array(matplotlib.colors.to_rgb(palette.VERMILLION)))).sum(axis=2) < 10
    down, across = np.nonzero(red)
    places = np.column_stack([across + 0.5, len(pixels) - down - 0.5])
    angle, distance = axes.transData.inverted().transform(places).T
    angle, distance = np.degrees((angle + np.pi) % (2 * np.pi) - np.pi)[distance < 3], distance[distance < 3]
    far, tip = (np.sign(angular) * angle, 75.0) if angular else (distance, 0.45 * 3)
    unit = 1.0 if angular else 0.02
    assert tip - unit < far.max() < tip + 0.3 * unit
    end = far > tip - 2 * unit
    width = (distance if angular else np.radians(angle) * distance)[end]
    assert np.ptp(width) < 0.06  # m of the axes: sharp


def test_a_turn_on_the_spot_is_a_dot_of_its_colour_and_the_lanes_of_the_states_stand_below_the_room():
    simulation, record = driven()
    record.add(stamp=simulation.time, state="TURNING_RIGHT")
    simulation.step(0.0, -0.5, 0.1)
    figure = figures.drive(simulation, record).figure
    room, lanes = figure.axes
    (dots,) = (line for line in room.lines if line.get_marker() == "o")
    assert dots.get_xydata().tolist() == [list(simulation.pose[:2])]
    assert dots.get_markeredgecolor() == palette.STATES["TURNING_RIGHT"]
    assert [label.get_text() for label in lanes.get_yticklabels()] == list(palette.STATES)
    figure.draw_without_rendering()
    assert room.get_position().x0 == lanes.get_position().x0 and room.get_position().x1 == lanes.get_position().x1


def test_a_figure_is_the_same_in_a_notebook_with_a_style_of_its_own():
    record = goal("goal", "accepted", "feedback")
    light = figures.timeline(record)._repr_png_()
    with matplotlib.style.context("dark_background"):
        assert figures.timeline(record)._repr_png_() == light


def test_a_live_figure_shows_what_comes_while_it_waits_and_ends_still():
    record = goal("goal", "accepted")
    drawn = []

    def draw(recorder):
        drawn.append(len(recorder))
        return figures.feedback(recorder)

    timer = threading.Timer(0.1, lambda: record.add(event="feedback", sequence=[0, 1]))
    with figures.live(draw, record) as shown:
        timer.start()
        assert shown.wait(lambda: len(record) == 3, timeout=10)
    assert drawn[0] == 2 and drawn[-1] == 3


def test_a_live_figure_is_redrawn_no_more_often_than_its_rate():
    record, drawn = goal("goal"), []

    def draw(recorder):
        drawn.append(len(recorder))
        return figures.feedback(recorder)

    with figures.live(draw, record, rate=2.0) as shown:
        assert not shown.wait(lambda: bool(record.add(event="feedback", sequence=[0])), timeout=0.6)
    assert len(record) > len(drawn) and len(drawn) <= 5  # at the start, twice or so a second, at the end


def test_a_live_figure_that_is_slow_to_draw_leaves_the_rest_of_the_time_to_the_nodes():
    record, began, takes = goal("goal"), [], 0.03  # s
    shown = figures.live(figures.feedback, record, rate=100.0)

    def slow(picture):
        began.append(time.monotonic())
        time.sleep(takes)

    with shown:
        shown._shown = SimpleNamespace(update=slow)
        assert shown.wait(lambda: record.add(event="feedback", sequence=[0]) or len(began) == 4, timeout=30.0)
    assert all(later - before >= SHARE * takes for before, later in itertools.pairwise(began[:4]))


def test_a_live_figure_gives_up_in_time_and_says_so(monkeypatch):
    told = []
    monkeypatch.setattr(waiting, "tellers", [told.append])
    with figures.live(figures.feedback, goal("goal")) as shown:
        assert not shown.wait(lambda: False, timeout=0.1)
    assert told == ["`wait` has ended after 0.1 s, and its condition has not come true."]


def test_a_timeline_of_nothing_is_told_unless_it_is_live(monkeypatch):
    told = []
    monkeypatch.setattr(waiting, "tellers", [told.append])
    with figures.live(figures.timeline, goal()):
        pass
    figures.timeline(goal(), goal("goal"))
    assert told == []
    figures.timeline(goal())
    assert told == ["Nothing is recorded here yet, so the timeline is empty: was the goal sent, with `.send(...)`?"]


@pytest.fixture(autouse=True, scope="module")
def ipython():
    start_ipython()
