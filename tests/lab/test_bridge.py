"""The kernel's side of the lab: it answers pages while a cell runs, and is not noticed otherwise."""

import math
import stat
import threading
from pathlib import Path

import pytest
from jupyter_core.paths import jupyter_runtime_dir

from course.errors import CallTimeout
from course.foundation.waiting import wait_until
from course.lab import protocol
from course.lab.kernel.bridge import AHEAD, Bridge
from course.lab.kernel.panels import Backlog, Changes, Panels, Topic
from tests.kernels import Kernel
from tests.lab.client import WAIT, Client, socket_of


def fail():
    raise CallTimeout("there is no such thing: look again")  # a TimeoutError, and so an OSError


@pytest.fixture
def panels():
    methods = {"double": lambda number: 2 * number, "fail": fail, "divide": lambda: 1 / 0, "endless": lambda: 1e999}
    return Panels(methods)


@pytest.fixture
def bridge(tmp_path, panels):
    path = tmp_path / ("long-" * 30) / "kernel.sock"  # longer than the 107 bytes of a socket's name
    bridge = Bridge(path, lambda: panels)
    yield path
    bridge.close()
    assert not path.exists()


@pytest.fixture
def page(bridge):
    client = Client(bridge)
    yield client
    client.close()


def test_a_request_has_its_result_or_a_sentence(page):
    assert page.ask("double", number=21)["result"] == 42
    assert page.ask("fail")["error"] == "there is no such thing: look again"
    assert page.ask("divide")["error"] == "ZeroDivisionError: division by zero"
    assert "restart the kernel" in page.ask("unheard_of")["error"]
    assert "restart the kernel" in page.ask("subscribe", topic="unheard_of")["error"]
    assert "ValueError" in page.ask("endless")["error"]  # JSON cannot say infinity
    assert "TypeError" in page.ask("double", nonsense=1)["error"]
    assert page.ask("double", number=1)["result"] == 2


def test_a_slow_request_holds_up_no_other(page, panels):
    free = threading.Event()
    panels.methods["slow"] = lambda: free.wait(WAIT)
    slow = page.begin("slow")
    assert page.ask("double", number=1)["result"] == 2
    free.set()
    assert page.answer(slow)["result"] is True


def test_a_page_that_speaks_another_protocol_is_left_alone(bridge, page):
    page.send(nonsense=1)
    assert page.read()["error"] == "KeyError: 'id'"
    page.send_line(b"GET / HTTP/1.1\r\n")
    assert page.ended()
    other = Client(bridge)
    assert other.ask("double", number=1)["result"] == 2
    other.close()


def test_only_this_user_may_connect(bridge):
    assert stat.S_IMODE(bridge.stat().st_mode) == 0o600


def test_a_state_is_told_when_it_changes_to_each_page(bridge, panels, page):
    state = {"value": 1}
    panels.topics["state"] = Topic(lambda: Changes(lambda: dict(state)), 0.01)
    other = Client(bridge)
    numbers = [each.subscribe("state") for each in (page, other)]
    for each, number in zip((page, other), numbers, strict=True):
        assert each.event() == {"id": number, "topic": "state", "data": {"value": 1}}
    state["value"] = 2
    assert [each.event()["data"]["value"] for each in (page, other)] == [2, 2]
    other.close()


def test_a_slow_page_loses_the_oldest_events_and_is_told_how_many(page, panels):
    backlog = Backlog(10)
    panels.topics["events"] = Topic(lambda: backlog, 0.01)
    page.subscribe("events")
    for number in range(AHEAD):
        backlog.put(number)
        assert page.event(ack=False)["data"] == {"events": [number], "lost": 0}
    for number in range(100):  # it has not taken in the first ones yet
        backlog.put(number)
    page.send(ack=page._next)
    assert page.event()["data"] == {"events": list(range(90, 100)), "lost": 90}


def test_a_feed_is_closed_when_its_page_leaves_or_has_enough(bridge, panels):
    left = []
    panels.topics["events"] = Topic(lambda name: Backlog(1, lambda: left.append(name)), 0.01)
    page = Client(bridge)
    page.subscribe("events", name="first")
    second = page.subscribe("events", name="second")
    assert page.ask("unsubscribe", id=second)["result"] is None
    assert wait_until(lambda: left == ["second"], WAIT)
    page.close()
    assert wait_until(lambda: left == ["second", "first"], WAIT)


def test_what_a_feed_raises_ends_the_subscription_and_is_told(page, panels):
    panels.topics["broken"] = Topic(lambda: Changes(fail), 0.01)
    number = page.subscribe("broken")
    expected = {"id": number, "topic": "broken", "error": "there is no such thing: look again"}
    assert page.event() == expected
    assert page.ask("double", number=1)["result"] == 2


def test_a_number_that_json_lacks_ends_no_subscription(page, panels):
    state = {"nodes": [{"name": "bad", "step": math.nan}, {"name": "good", "step": 0.1}], "pair": (math.inf, -math.inf)}
    panels.topics["numbers"] = Topic(lambda: Changes(lambda: dict(state)), 0.01)
    page.subscribe("numbers")
    told = [{"name": "bad", "step": None}, {"name": "good", "step": 0.1}]
    assert page.event()["data"] == {"nodes": told, "pair": [None, None]}
    state["nodes"] = []
    assert page.event()["data"] == {"nodes": [], "pair": [None, None]}


# Of what a node can make, more than a line may have, and not more in characters.
LONG = {
    "lines": {"lines": 1100 * [["INFO", "node", 1990 * "\N{GRINNING FACE}"]]},
    "control characters": 260 * [15_500 * "\x01"],
    "names": {f"{number:03}{60_000 * 'é'}": number for number in range(160)},
}


@pytest.mark.parametrize("what", LONG)
def test_a_text_that_is_too_long_for_a_line_is_cut_and_the_link_goes_on(page, panels, what):
    panels.topics["long"] = Topic(lambda: Changes(lambda: LONG[what]), 0.01)
    page.subscribe("long")
    told = page.event()["data"]
    assert len(protocol.encoded(told)) < protocol.LINE
    assert len(told) == len(LONG[what])
    assert page.ask("double", number=21)["result"] == 42


def test_what_cannot_be_cut_is_refused_with_a_sentence_and_the_link_goes_on(page, panels):
    panels.methods["numbers"] = lambda: 66_000 * [10**300]
    panels.topics["numbers"] = Topic(lambda: Changes(panels.methods["numbers"]), 0.01)
    said = "There is too much to show: 19 MiB of at most 16 MiB. Stop the node that causes it."
    assert page.ask("numbers")["error"] == said
    page.subscribe("numbers")
    assert page.event()["error"] == said
    assert page.ask("double", number=21)["result"] == 42


@pytest.fixture
def kernel(tmp_path):
    kernel = Kernel(tmp_path)
    yield kernel
    kernel.stop()


def test_a_kernel_listens_from_its_first_live_on_and_prints_nothing(kernel):
    kernel.run("import course")
    assert not socket_of(kernel).exists()
    assert kernel.run("ros = course.live()") == ""
    assert socket_of(kernel).parent == Path(jupyter_runtime_dir())
    page = Client(socket_of(kernel))
    assert "no method" in page.ask("unheard_of")["error"]
    assert kernel.run("ros = course.live()") == ""
    assert "no method" in page.ask("unheard_of")["error"]
    page.close()


def test_a_kernel_answers_while_a_cell_runs_and_costs_nothing_before(kernel, tmp_path):
    kernel.run("import course, pathlib, sys, threading, time\nros = course.live()")
    # Nothing of a panel is loaded, and its thread sleeps.
    assert kernel.run("[name for name in sys.modules if name.startswith('course.lab.kernel.n')]") == "[]"
    cell = threading.Thread(
        target=kernel.run, args=("pathlib.Path('began').touch()\nwhile not pathlib.Path('end').exists(): pass  # busy",)
    )
    cell.start()
    assert wait_until((tmp_path / "began").exists, WAIT)
    page = Client(socket_of(kernel))
    assert "no method" in page.ask("unheard_of")["error"]
    assert cell.is_alive()
    (tmp_path / "end").touch()
    cell.join(WAIT)
    page.close()


def test_a_restarted_kernel_is_found_at_the_same_place(kernel):
    kernel.run("import course; ros = course.live()")
    page = Client(socket_of(kernel))
    assert "no method" in page.ask("unheard_of")["error"]
    kernel.manager.restart_kernel(now=True)  # killed: it leaves its socket behind
    assert page.ended()
    kernel.client.wait_for_ready(timeout=WAIT)
    kernel.run("import course; ros = course.live()")
    page = Client(socket_of(kernel))
    assert "no method" in page.ask("unheard_of")["error"]
    page.close()
