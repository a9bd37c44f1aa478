"""Values that the kernel's side of the panels leaves out or mends: the page shows what it can, and goes on.

The test plays the kernel, so that they reach the page.
"""

import json
import re
import time
from typing import Any

import pytest
from playwright.sync_api import Page, WebSocketRoute, expect

from tests.browser.conftest import WAIT
from tests.browser.pages import draws_within, open_page, run_from_palette, write_greeter

expect.set_options(timeout=WAIT)

SCAN = {
    "first": 0.0,
    "step": 0.1,
    "beams": 2,
    "reach": 5.0,
    "ranges": [100, -1],
    "from": None,
    "sectors": {"front": 1.0, "left": None, "right": None},
}
SEEN = {"nodes": {"sees": ["/far"], "drives": []}, "scan": SCAN}
KNOB = {"name": "gain", "kind": "double", "value": 0.5, "from": 0.0, "to": 1.0, "step": 0.1, "fixed": False}


class Played:
    """The kernel's end of the panels' connection, which the test plays."""

    def __init__(self, page: Page):
        self._page = page
        self._topics: dict[str, int] = {}
        self._socket: WebSocketRoute | None = None
        page.route_web_socket(re.compile("/course/lab/"), self._open)

    def _open(self, socket: WebSocketRoute) -> None:
        self._socket = socket
        socket.on_message(lambda text: self._hear(json.loads(text)))
        self._say(link="up")

    def _say(self, **message: Any) -> None:
        assert self._socket
        self._socket.send(json.dumps(message))

    def _hear(self, message: dict[str, Any]) -> None:
        if "method" in message:
            if message["method"] == "subscribe":
                self._topics[message["params"]["topic"]] = message["id"]
            if message["method"] == "unsubscribe":
                left = message["params"]["id"]
                self._topics = {each: number for each, number in self._topics.items() if number != left}
            result = {"plot.fields": ["data"], "robot.rooms": {}}.get(message["method"])
            self._say(id=message["id"], result=result)

    def wait_until_left(self, topic: str) -> None:
        """Wait until the page does not follow a topic any more."""
        while topic in self._topics:
            self._page.wait_for_timeout(20)

    def tell(self, topic: str, **said: Any) -> None:
        """Send an event of a topic, with its `data` or an `error`, as soon as the page follows the topic."""
        while topic not in self._topics:
            self._page.wait_for_timeout(20)  # until which the page's messages are heard
        self._say(id=self._topics[topic], topic=topic, **said)
        if "error" in said:  # which ends it
            del self._topics[topic]


@pytest.fixture
def played(lab, page):
    """A page with a notebook, to whose panels the test speaks as the kernel."""
    write_greeter(lab[2] / "open")
    kernel = Played(page)
    open_page(page, lab, "open/open.ipynb")
    return kernel


@pytest.fixture
def view(page, played):
    """The robot view of that page."""
    run_from_palette(page, "ROS course", "Robot")
    played.tell("robot", data=SEEN)
    view = page.get_by_role("tabpanel", name="Robot", exact=True)
    view.locator(".ros-Robot-canvas").wait_for()
    return view


def knobs(**nodes: dict[str, Any]) -> dict[str, Any]:
    """The parameters of these nodes, one of each."""
    return {"nodes": [{"name": f"/{name}", "parameters": [KNOB | has]} for name, has in nodes.items()]}


@pytest.mark.matrix  # tests/lab/test_robot.py has what a kernel tells of it
def test_a_parameter_of_another_type_than_it_had_is_shown(page, played, view):
    gain = view.get_by_label("gain")
    for kind, value, shown in (
        ("double", 0.5, re.compile(r"^100$")),
        ("double", "a text", ""),
        ("string", "a text", "a text"),
        ("double", 0.25, re.compile(r"^50$")),
        ("string", 7, "7"),
        ("integer", None, ""),
    ):
        played.tell("robot.knobs", data=knobs(far={"kind": kind, "value": value}))
        expect(gain).to_have_value(shown)
    played.tell("robot.knobs", data=knobs(far={"kind": "bool", "value": "a text"}))
    expect(view.get_by_role("checkbox", name="gain")).to_be_checked()


def test_what_cannot_be_drawn_takes_nothing_else_away_and_a_feed_that_ends_is_followed_again(page, played, view):
    nothing = {"far": {"name": {}}, "near": {"name": "gauge"}}  # a name that is no text
    played.tell("robot.knobs", data=knobs(**nothing))
    expect(view).to_contain_text("The parameters of /far cannot be drawn now (Error: ")
    expect(view.get_by_label("gauge")).to_have_value("100")
    played.tell("robot.knobs", data=knobs(far={}, near={"name": "gauge"}))
    expect(view.get_by_label("gain")).to_have_value("100")
    expect(view).not_to_contain_text("cannot be drawn")

    played.tell("robot", data={"nodes": {"sees": {"length": 1}, "drives": []}})  # which is no list
    expect(view).to_contain_text("Robot cannot be drawn now (TypeError: ")
    played.wait_until_left("robot")
    played.tell("robot", data=SEEN)  # as soon as it is followed again
    expect(view.get_by_role("application")).to_be_visible()
    expect(view).not_to_contain_text("cannot be drawn")

    played.tell("robot", error="ValueError: it cannot be told")
    expect(view).to_contain_text("ValueError: it cannot be told")
    expect(view.get_by_role("application")).to_have_count(0)
    played.tell("robot", data=SEEN)
    expect(view.get_by_role("application")).to_be_visible()
    expect(view).not_to_contain_text("it cannot be told")


@pytest.mark.matrix  # the hostile session of test_hostile.py has a wall far away
def test_a_picture_of_places_and_numbers_of_any_size_is_drawn_at_once(page, played, view):
    for far in (1e16, -1e17, 1e308):
        walls = [far, 0.0, far, 1.0]
        played.tell("robot", data={"room": {"name": f"{far:g}", "walls": walls, "began": far}})
        expect(view).to_contain_text(f"room: {far:g}")
        assert draws_within(page, 3000)  # ms, on a busy machine
        pose = [far, far, far]
        room = {"name": f"without {far:g}", "walls": [], "began": 0.0}
        played.tell("robot", data={"room": room, "robot": {"pose": pose, "moves": [far, far]}})
        expect(view).to_contain_text(f"room: without {far:g}")
        played.tell("robot", data={"scan": SCAN | {"from": pose, "first": far, "step": far, "reach": far}})
        assert draws_within(page, 3000)
    run_from_palette(page, "ROS course", "Plot")
    plot = page.get_by_role("tabpanel", name="Plot", exact=True)
    played.tell("plot.topics", data=[["/far", "std_msgs/msg/Float64"]])
    expect(plot.get_by_label("Field")).to_have_value("data")
    plot.get_by_role("button", name="Add to the plot").click()
    for far in ([1e16, 1e16 + 2], [-1e308, 1e308], [0.0, 5e-324], [-1e17, -1e17]):
        clock = {"id": "1", "now": time.time(), "rate": 1.0, "simulated": False}
        points = [[time.time(), value] for value in far]
        played.tell("plot", data={"points": points, "says": "", "clock": clock})
        expect(plot.get_by_role("listitem").locator("output")).to_have_text(re.compile(r"\d"))
        assert draws_within(page, 3000)
