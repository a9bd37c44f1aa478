"""The inspector and the graph in JupyterLab: calls and goals from a form, what passed, and who is there."""

import re

import nbformat
import pytest
from playwright.sync_api import expect

from tests.browser.conftest import WAIT
from tests.browser.pages import (
    barriers,
    cell,
    choose,
    expect_no_barriers,
    keep_picture,
    open_page,
    run_cell,
    show_panel,
    wait_until_run,
)
from tests.lab.test_inspector import SERVERS

expect.set_options(timeout=WAIT)
# A goal is not aborted by a number that is too large for an int32 before a slow page has cancelled it.
LASTING = SERVERS.replace("steps[-1] + steps[-2]", "(steps[-1] + steps[-2]) % 1_000_000_000")


def begin(page, lab, name, servers=LASTING):
    """A notebook with a service and an action, and its session begun."""
    folder = lab[2] / name
    folder.mkdir(exist_ok=True)
    (folder / "servers.py").write_text(servers)
    sources = [
        "import course\n\nros = course.live()",
        "ros.start('servers.py')",
        "import pathlib\nros.until(pathlib.Path('end').exists, 600)",  # it runs on
    ]
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    cells = [nbformat.v4.new_code_cell(source) for source in sources]
    nbformat.write(nbformat.v4.new_notebook(cells=cells, metadata=kernel), folder / f"{name}.ipynb")
    open_page(page, lab, f"{name}/{name}.ipynb")
    panel = show_panel(page, "Inspector")
    expect(panel).to_contain_text("Run the notebook’s first cell: ros = course.live()")
    choose(page, "Run", "Run All Cells")
    expect(panel.get_by_role("combobox", name="Service", exact=True)).to_contain_text("/add_two_ints")
    return panel


def check_a_parameter(panel) -> None:
    """A wrong limit is marked, and a parameter that is chosen again has the value of its node."""
    panel.get_by_label("What to do").select_option("Set a parameter")
    panel.get_by_role("combobox", name="Parameter", exact=True).select_option("speed")
    speed = panel.get_by_label("speed double")
    expect(speed).to_have_value("1.0")
    speed.fill("5")
    limit = panel.get_by_label("Wait at most")
    limit.fill("x")
    expect(limit).to_have_attribute("aria-invalid", "true")
    panel.get_by_role("button", name="Set", exact=True).click()
    expect(panel).to_contain_text("Wait at most: write a number")
    expect(panel.get_by_role("region", name="Timeline")).to_have_count(0)  # nothing was sent
    limit.fill("5")
    expect(panel).not_to_contain_text("Wait at most: write a number")
    panel.get_by_role("button", name="Set", exact=True).click()
    refusal = panel.get_by_role("group", name="Result")
    expect(refusal).to_contain_text("Result, rejected:")
    expect(refusal).to_be_in_viewport(ratio=0.99)  # it is scrolled to
    keep_picture(panel.page, "inspector-rejected")
    expect(speed).to_have_value("5")  # with the reason below
    limit.fill("x")
    panel.get_by_role("button", name="Set", exact=True).click()
    expect(panel).to_contain_text("Not sent. One field needs another look. The timeline below is that of the last one")
    panel.get_by_role("combobox", name="Parameter", exact=True).select_option("serial")
    expect(panel.get_by_label("serial string")).to_be_disabled()  # it is read-only
    expect(panel.get_by_role("button", name="Set", exact=True)).to_be_disabled()
    expect(panel.get_by_label("The line", exact=True)).to_have_text("(its node refuses to set it)")
    fixed = "Not in the list, because a form cannot set them: open (not set), raw (byte array)."
    expect(panel).to_contain_text(fixed)
    panel.get_by_role("combobox", name="Parameter", exact=True).select_option("lines")
    expect(panel.get_by_label("lines string")).to_have_value("a\nb")  # an input would show "ab"
    expect(panel).to_contain_text(re.compile(r"The node’s values were read at \d\d:\d\d:\d\d\."))
    panel.get_by_role("combobox", name="Parameter", exact=True).select_option("use_sim_time")
    expect(panel.get_by_role("button", name="Set", exact=True)).to_be_enabled()
    panel.get_by_role("combobox", name="Parameter", exact=True).select_option("speed")
    expect(speed).to_have_value("1.0")
    panel.get_by_label("What to do").select_option("Send a goal")
    expect(panel).to_contain_text("s until it is accepted")
    expect(limit).to_have_value("5")  # what was wrong in another form is not brought along


# How much further to the right than it begins each wrapped line of a program goes on, px.
ROWS = """program => [...program.querySelectorAll('.ros-Code-line')].flatMap(line => {
  const [begins, rest] = line.childNodes, range = document.createRange();
  const first = /^ */.exec(line.textContent)[0].length;
  range.setStart(begins.firstChild ?? line, begins.firstChild ? first : 0);
  range.setEnd(rest, rest.length);
  const [row, ...others] = [...range.getClientRects()].filter(({ width }) => width > 0);
  return others.filter(({ top }) => top > row.top + 4).map(({ left }) => left - row.left);
})"""


def test_a_parameter_is_set_a_service_called_and_a_goal_canceled_while_a_cell_runs_and_the_graph_shows_it(lab, page):
    panel = begin(page, lab, "inspected")
    size = page.viewport_size
    page.set_viewport_size({"width": 1280, "height": 500})
    check_a_parameter(panel)
    page.set_viewport_size(size)
    panel.get_by_label("What to do").select_option("Call a service")
    panel.get_by_role("combobox", name="Service", exact=True).select_option("/add_two_ints")
    panel.get_by_label("a int64").fill("two")
    expect(panel.get_by_text("write a whole number: int64 does not accept 'two'")).to_be_visible()
    expect(panel.get_by_label("a int64")).to_have_attribute("aria-invalid", "true")
    panel.get_by_label("a int64").fill("9007199254740993")  # which a number of JavaScript cannot hold
    panel.get_by_label("b int64").fill("1")
    panel.get_by_label("b int64").press("Enter")
    expect(panel.get_by_role("region", name="Timeline")).to_contain_text("sum: 9007199254740994")
    line = panel.get_by_label("The line", exact=True)
    expect(line).to_contain_text("ros2 service call /add_two_ints example_interfaces/srv/AddTwoInts")
    expect(line).to_contain_text("{a: 9007199254740993, b: 1}")
    expect(panel.get_by_label("The program", exact=True)).to_contain_text("AddTwoInts.Request(a=9007199254740993, b=1)")
    messages = panel.locator("summary", has_text="The messages")
    messages.click()
    expect(panel.get_by_role("group", name="Result")).to_have_text(re.compile("^Response:.*sum: 9007199254740994"))
    panel.get_by_label("What to do").select_option("Send a goal")
    panel.get_by_label("order int32").fill("12")
    panel.get_by_role("button", name="Send the goal").click()
    expect(panel.get_by_role("group", name="Result")).to_contain_text("succeeded")
    expect(panel.get_by_role("group", name="Result").get_by_text("- 144")).to_be_visible()
    expect(panel.locator(".ros-Events > li")).to_have_count(14)  # not folded while they come
    expect(panel.locator(".ros-Events > li").last).to_be_visible()
    messages.click()
    panel.get_by_label("order int32").fill("1000")
    panel.get_by_role("button", name="Send the goal").click()
    panel.get_by_role("button", name="Cancel the goal").press("Enter")
    expect(panel.get_by_role("button", name="Cancel the goal")).to_have_count(0)
    expect(panel.get_by_role("region", name="Timeline")).to_be_focused()
    flow = panel.get_by_role("region", name="Timeline").get_by_role("img")
    expect(flow).to_have_attribute("aria-label", re.compile("goal, .*accepted, .*cancel, .*canceled"))
    expect(panel.locator(".ros-Events")).to_be_hidden()  # as the reader has left it
    graph = show_panel(page, "Graph")
    listed = graph.get_by_role("list", name="The graph as a list")
    expect(listed).to_contain_text("offers the actions /fibonacci")
    expect(listed).not_to_contain_text("get_parameters")
    expect(graph.get_by_role("group", name="Nodes: 1. Topics, services and actions: 4.")).to_be_visible()
    expect(graph.get_by_label("Which call or goal")).to_contain_text("action /fibonacci")
    expect(show_panel(page, "Inspector").get_by_label("order int32")).to_have_value("1000")  # as it was left
    expect(page.locator('.jp-Notebook-ExecutionIndicator[data-status="busy"]')).to_be_visible()
    expect_no_barriers(page, "#ros2-course-inspector", "inspector")
    page.set_viewport_size({"width": 390, "height": 800})
    assert panel.evaluate("panel => panel.scrollWidth <= panel.clientWidth")
    program = panel.get_by_label("The program", exact=True)
    wrapped = program.evaluate(ROWS)
    assert len(wrapped) > 2
    assert all(further > 0 for further in wrapped), wrapped
    keep_picture(page, "inspector-program-phone")
    (lab[2] / "inspected/end").touch()


DIES = """import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Dies(Node):
    def __init__(self):
        super().__init__('dies')
        self.create_service(Trigger, 'die', self.die)

    def die(self, request, response):
        raise RuntimeError('as it must')


rclpy.init()
rclpy.spin(Dies())
"""
DEATHS = """import contextlib, time
from course.errors import NodeFailed
ros.start('dies.py')
print('begun')
with contextlib.suppress(NodeFailed):  # told once, in whatever waits
    ros.until(pathlib.Path('again').exists, 600)
while not pathlib.Path('again').exists():
    time.sleep(0.01)
ros.restart('dies.py')
ros.until(pathlib.Path('stop').exists, 600)
ros.stop('dies.py')"""


@pytest.mark.matrix  # tests/lab/test_inspector.py has the goal that is found again, and who serves a name
@pytest.mark.long("a goal, a page that is loaded again, and a server that dies and comes back")
def test_a_form_that_is_loaded_again_shows_the_goal_and_one_whose_server_dies_stays(lab, page):
    panel = begin(page, lab, "reloaded", SERVERS.replace("time.sleep(0.05)", "time.sleep(1)"))
    panel.get_by_label("What to do").select_option("Send a goal")
    panel.get_by_label("order int32").fill("45")
    panel.get_by_role("button", name="Send the goal").click()
    flow = panel.get_by_role("region", name="Timeline").get_by_role("img")
    expect(flow).to_have_attribute("aria-label", re.compile("goal, .*accepted, .*feedback"))
    page.goto(f"{lab[0]}/lab/tree/reloaded/reloaded.ipynb?token={lab[1]}")
    expect(panel.get_by_label("What to do")).to_have_value("action")
    expect(panel.get_by_label("order int32")).to_have_value("45")
    expect(flow).to_have_attribute("aria-label", re.compile("goal, .*accepted, .*feedback"))
    keep_picture(page, "inspector-reloaded")
    panel.get_by_role("button", name="Cancel the goal").click()
    expect(flow).to_have_attribute("aria-label", re.compile("cancel accepted, .*canceled"))
    (lab[2] / "reloaded/end").touch()

    (lab[2] / "reloaded/dies.py").write_text(DIES)
    run_cell(page, 2, DEATHS)
    expect(cell(page, 2).locator(".jp-OutputArea-output")).to_contain_text("begun")
    panel.get_by_label("What to do").select_option("Call a service")
    service = panel.get_by_role("combobox", name="Service", exact=True)
    service.select_option("/die")
    call = panel.get_by_role("button", name="Call", exact=True)
    call.click()
    passed = panel.get_by_role("region", name="Timeline")
    expect(passed).to_contain_text("RuntimeError: as it must")
    expect(panel).to_contain_text("/die is not there now.")
    expect(service).to_have_value("/die std_srvs/srv/Trigger")
    expect(service.locator("option:checked")).to_be_disabled()
    expect(call).to_be_focused()
    keep_picture(page, "inspector-away")
    assert barriers(page, "#ros2-course-inspector") == []
    show_panel(page, "Nodes")
    page.wait_for_timeout(1500)  # a panel is hidden for good after 1 s
    show_panel(page, "Inspector")
    expect(panel).to_contain_text("/die is not there now.")
    expect(passed).to_contain_text("RuntimeError: as it must")
    call.focus()
    (lab[2] / "reloaded/again").touch()
    expect(panel).not_to_contain_text("is not there now")
    expect(service.locator("option:checked")).to_be_enabled()
    expect(call).to_be_focused()
    expect(passed).to_contain_text("RuntimeError: as it must")
    panel.get_by_label("What to do").select_option("Set a parameter")
    node = panel.get_by_role("combobox", name="Node", exact=True)
    node.select_option("/dies")
    panel.get_by_role("combobox", name="Parameter", exact=True).focus()
    (lab[2] / "reloaded/stop").touch()
    expect(panel).to_contain_text("/dies is not there now.")
    expect(node).to_have_value("/dies ")
    expect(panel.get_by_role("combobox", name="Parameter", exact=True)).to_be_focused()


MANY = """from rclpy.node import Node
from std_srvs.srv import Trigger
ros.stop()
class Many(Node):
    def __init__(self):
        super().__init__('offers_all_of_them')
        for number in range(8):
            self.create_service(Trigger, f'service_number_{number}', lambda request, response: response)
ros.start(Many)"""


# Where lines begin and end, to the nearest 10 px of the page.
ENDS = """all => all.map(line => [0, line.getTotalLength()].map(at => {
  const { x, y } = line.getPointAtLength(at).matrixTransform(line.getScreenCTM());
  return `${Math.round(x / 10)} ${Math.round(y / 10)}`;
}))"""


def check_a_graph_of_many_boxes(page) -> None:
    """It can be read in the panel, and has a tab."""
    page.set_viewport_size({"width": 1280, "height": 800})
    panel = show_panel(page, "Graph")
    run_cell(page, 0, MANY)
    names = panel.locator(".ros-Graph-box text")
    expect(names).to_have_count(9)
    assert min(each.bounding_box()["height"] for each in names.all()) > 9  # px
    picture = panel.get_by_role("group", name=re.compile("Nodes: 1"))
    assert picture.bounding_box()["width"] <= panel.bounding_box()["width"]
    lines = picture.locator(".ros-Graph-edge").evaluate_all(ENDS)
    assert not {begin for begin, _ in lines} & {end for _, end in lines}, "a line would have a head at both ends"
    panel.get_by_role("button", name="Open as a tab").click()
    tab = page.locator("#ros2-course-graph-tab")
    expect(tab.locator(".ros-Graph-box text")).to_have_count(9)
    assert tab.bounding_box()["width"] > panel.bounding_box()["width"]
    tab.get_by_role("button", name=re.compile(r"^node \/offers_all_of_them")).click()
    expect(page.get_by_role("region", name="Nodes", exact=True)).to_be_visible()


@pytest.mark.matrix  # the first test has the graph, and test_ways.py opens, enters and leaves it by keys
def test_the_graph_is_walked_and_opened_by_keys_and_by_clicks(lab, page):
    begin(page, lab, "walked")
    graph = show_panel(page, "Graph")
    node = graph.get_by_role("button", name=re.compile(r"^node \/servers: .*serves \/add_two_ints"))
    service = graph.get_by_role("button", name=re.compile(r"^service \/add_two_ints: .*\/servers serves it"))
    expect(service).to_be_visible()
    boxes = graph.locator(".ros-Graph-box[tabindex]")
    expect(graph.locator('.ros-Graph-box[tabindex="0"]')).to_have_count(1)  # the Tab key comes to one of them
    graph.get_by_label("Show built-in topics and services").focus()
    page.keyboard.press("Tab")
    expect(graph.locator(".ros-Graph-box:focus")).to_have_count(1)
    assert visited(page) == set(boxes.evaluate_all("all => all.map(box => box.dataset.box)"))
    service.focus()
    expect(service).to_have_css("outline-style", "none")
    assert service.locator("path").evaluate("path => getComputedStyle(path).strokeWidth") == "3.5px"
    page.keyboard.press("Enter")
    panel = page.get_by_role("region", name="Inspector", exact=True)
    chosen = panel.get_by_role("combobox", name="Service", exact=True)
    expect(chosen).to_be_focused()
    expect(chosen).to_have_value("/add_two_ints example_interfaces/srv/AddTwoInts")
    graph = show_panel(page, "Graph")
    graph.get_by_role("button", name=re.compile(r"^action \/fibonacci")).click()
    expect(panel.get_by_role("combobox", name="Action", exact=True)).to_be_focused()
    graph = show_panel(page, "Graph")
    node.focus()
    page.keyboard.press("Space")
    nodes = page.get_by_role("region", name="Nodes", exact=True)
    expect(nodes.get_by_role("button", name="/servers running")).to_be_focused()
    expect(nodes).to_contain_text("speed = 1.0")
    (lab[2] / "walked/end").touch()
    wait_until_run(page)
    check_a_graph_of_many_boxes(page)


def visited(page) -> set[str]:
    """The boxes that the arrow keys come to, from the one that has the focus."""
    here = "document.activeElement.dataset.box"
    found, new = set(), [page.evaluate(here)]
    while new:
        found.add(start := new.pop())
        for key in ("ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"):
            page.evaluate(f'document.querySelector(`[data-box="${{CSS.escape({start!r})}}"]`).focus()')
            page.keyboard.press(key)
            if (there := page.evaluate(here)) not in found and there not in new:
                new.append(there)
    return found


TWICE = """import subprocess, sys
outside = subprocess.Popen([sys.executable, 'servers.py'], start_new_session=True)
ros.until(pathlib.Path('left').exists, 600)
outside.terminate()"""


@pytest.fixture
def left(lab):
    """The file whose presence ends the second server of the test, however that ends."""
    path = lab[2] / "twice/left"
    path.unlink(missing_ok=True)
    yield path
    path.touch()


@pytest.mark.matrix  # tests/lab/test_inspector.py has the servers, and the test above has the form
def test_two_servers_of_a_name_and_a_message_that_is_not_what_the_form_shows_are_told(lab, page, left):
    panel = begin(page, lab, "twice")
    (lab[2] / "twice/end").touch()
    wait_until_run(page)
    run_cell(page, 2, TWICE)
    expect(panel).to_contain_text("(python servers.py) and by servers.py of this notebook: either may answer.")
    panel.get_by_label("What to do").select_option("Publish a message")
    expect(panel).not_to_contain_text("either may answer")
    panel.get_by_label("Times a second").fill("5")
    panel.get_by_role("button", name="Publish", exact=True).click()
    passed = panel.get_by_role("region", name="Timeline")
    expect(passed).to_contain_text("5 a second, to 2 subscriptions.")
    first, before = panel.get_by_label("x float64").first, "What is published is still the message from before"
    expect(passed).not_to_contain_text(before)
    first.fill("fast")
    expect(passed).to_contain_text(before)
    again = passed.get_by_role("button", name="Publish the new one")
    expect(again).to_have_count(0)
    first.fill("0.5")
    expect(passed).to_contain_text(before)
    expect_no_barriers(page, "#ros2-course-inspector", "inspector-edited")
    again.click()
    expect(passed).to_contain_text("x: 0.5")
    expect(passed).not_to_contain_text(before)
    expect(passed.get_by_role("button", name="Stop")).to_be_visible()
    expect(panel).to_be_focused()
    panel.get_by_label("What to do").select_option("Call a service")
    expect(panel).to_contain_text("either may answer")
    left.touch()
    expect(panel).not_to_contain_text("either may answer")


HELD = """import psutil
(server,) = [each for each in psutil.process_iter(['cwd', 'cmdline'])
             if each.info['cwd'] == str(pathlib.Path.cwd()) and 'servers.py' in (each.info['cmdline'] or [])]
server.suspend()
print('held')
ros.until(pathlib.Path('go').exists, 600)
server.resume()"""


@pytest.mark.matrix  # a node on a busy machine
def test_the_parameters_of_a_node_that_does_not_answer_are_asked_for_again(lab, page):
    panel = begin(page, lab, "held")
    (lab[2] / "held/end").touch()
    wait_until_run(page)
    run_cell(page, 2, HELD)
    expect(cell(page, 2)).to_contain_text("held\n")
    panel.get_by_label("What to do").select_option("Set a parameter")
    expect(panel).to_contain_text("within 5 s")
    (lab[2] / "held/go").touch()
    expect(panel.get_by_role("combobox", name="Parameter", exact=True)).to_contain_text("speed")
    expect(panel).not_to_contain_text("within 5 s")


@pytest.mark.matrix  # tests/lab/test_inspector.py publishes at a rate
def test_a_message_is_published_at_a_rate_and_stops_with_the_panel(lab, page):
    panel = begin(page, lab, "repeated")
    panel.get_by_label("What to do").select_option("Publish a message")
    panel.get_by_label("Times a second").fill("1000")
    expect(panel.get_by_text("write a number from 0.1 to 100, in Hz")).to_be_visible()
    panel.get_by_label("Times a second").fill("5")
    expect(panel.get_by_label("The line", exact=True)).to_contain_text("ros2 topic pub --rate 5 /cmd_vel")
    expect(panel.get_by_label("The program", exact=True)).to_contain_text("self.create_timer(0.2, self.publish)")
    panel.get_by_role("button", name="Publish", exact=True).click()
    passed = panel.get_by_role("region", name="Timeline")
    goes_on = re.compile("Published [0-9]+ times so far, 5 a second, to 1 subscription.")
    expect(passed).to_contain_text(goes_on)
    panel.get_by_label("What to do").select_option("Set a parameter")
    apart = panel.get_by_role("group", name="Published on /cmd_vel")
    expect(apart).to_contain_text(goes_on)
    page.wait_for_timeout(2500)  # a publication may be unseen for 0.5 s
    expect(apart).to_contain_text(goes_on)
    keep_picture(page, "inspector-repeats")
    assert barriers(page, "#ros2-course-inspector") == []
    apart.get_by_role("button", name="Stop").click()
    expect(apart).to_have_count(0)
    panel.get_by_label("What to do").select_option("Publish a message")
    expect(passed).to_contain_text("last message")
    panel.get_by_role("button", name="Publish", exact=True).click()
    expect(passed).to_contain_text(goes_on)
    expect(apart).to_have_count(0)
    passed.get_by_role("button", name="Stop").click()
    expect(passed).to_contain_text("last message")
    panel.get_by_role("button", name="Publish", exact=True).click()
    expect(passed.get_by_role("button", name="Stop")).to_be_visible()
    show_panel(page, "Nodes")
    page.wait_for_timeout(2000)  # a publication may be unseen for 0.5 s
    expect(show_panel(page, "Inspector").get_by_role("region", name="Timeline")).to_contain_text("last message")
    expect(passed).to_contain_text("Publishing stopped, because the Inspector of this notebook was no longer shown")
    expect(passed).not_to_contain_text("It goes on while")
    panel.get_by_label("What to do").select_option("Call a service")
    apart.get_by_role("button", name="Close").click()
    expect(apart).to_have_count(0)
    (lab[2] / "repeated/end").touch()


@pytest.mark.matrix  # tests/lab/test_traffic.py has who sends what
def test_what_other_programs_and_cells_send_is_drawn(lab, page):
    folder = lab[2] / "drawn"
    folder.mkdir(exist_ok=True)
    (folder / "servers.py").write_text(SERVERS)
    sources = [
        "import course\n\nros = course.live()",
        "ros.start('servers.py')",
        "!ros2 service call /add_two_ints example_interfaces/srv/AddTwoInts '{a: 20, b: 22}'",
        "!ros2 action send_goal /fibonacci example_interfaces/action/Fibonacci '{order: 3}'",
    ]
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    cells = [nbformat.v4.new_code_cell(source) for source in sources]
    nbformat.write(nbformat.v4.new_notebook(cells=cells, metadata=kernel), folder / "drawn.ipynb")
    open_page(page, lab, "drawn/drawn.ipynb")
    graph = show_panel(page, "Graph")
    page.locator(".jp-Notebook .jp-Cell").first.locator(".cm-content").click()
    page.keyboard.press("Shift+Enter")
    expect(graph).to_contain_text("No node runs.")
    expect(graph).to_contain_text("No calls and no goals yet")
    page.get_by_role("tab", name="Graph", exact=True).click()  # closed: what passes is recorded all the same
    expect(graph).to_be_hidden()
    for _ in sources[1:]:
        page.keyboard.press("Shift+Enter")
    expect(page.locator(".jp-Notebook .jp-Cell").nth(3)).to_contain_text("Goal finished with status: SUCCEEDED")
    page.get_by_role("tab", name="Graph", exact=True).click()
    expect(graph.get_by_role("button", name=re.compile(r"^node \/servers"))).to_be_visible()
    which = graph.get_by_label("Which call or goal")
    expect(which).to_contain_text("action /fibonacci")
    flow = graph.get_by_role("region", name="Timeline").get_by_role("img")
    expect(flow).to_have_attribute("aria-label", re.compile("accepted, feedback, feedback, succeeded"))
    expect(graph).to_contain_text("Seen from the action's topics for status and feedback.")
    option = which.locator("option", has_text="service /add_two_ints")
    which.select_option(option.first.get_attribute("value"))
    expect(graph).to_contain_text("sum: 42")
    expect(graph).to_contain_text("Seen from the server")
    expect_no_barriers(page, "#ros2-course-graph", "graph")
