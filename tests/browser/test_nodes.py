"""The panel of nodes in JupyterLab: what runs and what has died, restart and stop, the log, the kernel killed."""

import re

import nbformat
import pytest
from playwright.sync_api import expect

from course.foundation.waiting import wait_until
from tests.browser.conftest import WAIT
from tests.browser.pages import (
    BUSY,
    CHECKS,
    SERVER,
    TWIN,
    choose,
    draws_within,
    expect_no_barriers,
    keep_picture,
    open_page,
    run_cell,
    run_from_palette,
    show_panel,
    wait_for_kernel,
    wait_until_run,
    write_greeter,
)

expect.set_options(timeout=WAIT)

FLOOD = """import rclpy
from rclpy.node import Node

rclpy.init()
node = Node('flood')


def burst():
    for number in range(1000):
        print('line', number)


timer = node.create_timer(0.1, burst)  # 10,000 lines a second
rclpy.spin(node)
"""

ENDED = """from rclpy.node import Node
careless = Node('careless', context=ros.context)
careless.get_logger().info('was here')
assert ros.until(lambda: 'was here' in str(ros.logs()), 60.0)
careless.destroy_node()"""
# More than a panel shows at once, and a program that the session has not started.
FULL = f"""import subprocess, sys
from pathlib import Path
Path('stranger.py').write_text({SERVER.replace("'greeter'", "'stranger'").replace("'greet'", "'strange'")!r})
subprocess.Popen([sys.executable, 'stranger.py'], start_new_session=True)
assert ros.until(lambda: '/stranger' in ros.nodes(), 60.0)
from rclpy.node import Node
class Full(Node): pass
full = ros.start(Full, 'full').node
for number in range(200):
    full.get_logger().info(f'line {{number}}')
print('all logged')"""


def begin(page, lab, name, **answer):
    """A notebook with a live session and a running node, and the panel beside it."""
    write_greeter(lab[2] / name, **answer)
    open_page(page, lab, f"{name}/{name}.ipynb")
    panel = show_panel(page, "Nodes")
    expect(panel).to_contain_text("Run the notebook’s first cell: ros = course.live()")
    choose(page, "Run", "Run All Cells")
    expect(panel.get_by_role("button", name="/greeter running")).to_be_visible()
    return panel


def test_a_node_is_looked_at_stopped_and_started_its_log_is_searched_and_everybody_can_do_so(lab, page):
    panel = begin(page, lab, "looked")
    node = panel.get_by_role("button", name="/greeter running")
    node.click()
    expect(panel).to_contain_text("/greet std_srvs/srv/Trigger")
    expect(panel).to_contain_text("word = 'hello'")
    expect(panel).to_contain_text(re.compile(r"process \d+, since \d\d:\d\d:\d\d(?! [AP]M)"))
    expect(panel.locator("wbr")).not_to_have_count(0)  # where start_type_description_service is broken
    log = panel.get_by_role("log")
    expect(log).to_contain_text("INFO greeter greeted")
    time = log.locator(".ros-Log-line").filter(has_text="greeted").locator("time")
    expect(time).to_have_text(re.compile(r"^\d\d:\d\d:\d\d$"))
    expect(time).to_have_attribute("title", re.compile(r"^\d{4}-\d\d-\d\d [\d:]{8}(\.\d{9}) \(stamp \d+\1\)$"))
    run_cell(page, CHECKS, "for _ in range(3):\n    ros.call('/greet', Trigger)")
    again = log.locator(".ros-Log-line").filter(has_text="greeted")
    expect(again).to_have_text(re.compile(r"^[\d:]{8} INFO greeter greeted × 4$"))
    panel.get_by_label("Node of the log").select_option("/greeter")
    expect(again).to_have_text(re.compile(r"^[\d:]{8} INFO greeted × 4$"))  # whose it is, is chosen
    panel.get_by_label("Node of the log").select_option("All nodes")
    page.set_viewport_size({"width": 1280, "height": 800})
    run_cell(page, CHECKS, f"{ENDED}\n{FULL}")
    expect(log).to_contain_text("line 199")
    expect(panel.get_by_text("word = 'hello'")).to_be_in_viewport(ratio=1)  # beside a log that is full
    keep_picture(page, "nodes-1280")
    heights = [each.bounding_box()["height"] for each in panel.locator(".ros-Node-row").all()]
    assert min(heights) < 32 and max(heights) < 60  # px: one line, or two
    stranger = panel.get_by_role("listitem").filter(has_text="/stranger")
    stranger.get_by_role("button", name="Stop").click()
    expect(stranger).to_have_count(0)
    panel.get_by_label("Search the log").fill("nothing of the kind")
    expect(log).not_to_contain_text("greeted")
    expect(panel).to_contain_text(re.compile(r"None of the \d+ lines matches\."))
    panel.get_by_label("Search the log").fill("GREETED")
    expect(log).to_contain_text("greeted")
    expect_no_barriers(page, "#ros2-course-nodes", "nodes")
    panel.get_by_label("Level of the log").select_option("WARN and above")
    expect(log).not_to_contain_text("greeted")
    sources = panel.get_by_label("Node of the log")
    expect(sources.locator("option")).to_have_text(["All nodes", "/greeter", "/full", "/careless (ended)"])
    panel.get_by_role("button", name="Stop greeter.py").click()
    expect(panel.get_by_role("button", name="/greeter stopped")).to_be_visible()
    expect(sources.locator("option")).to_have_text(["All nodes", "/greeter (ended)", "/full", "/careless (ended)"])
    panel.get_by_role("button", name="Start greeter.py").press("Enter")  # as without a mouse
    expect(node).to_be_visible()
    expect(sources.locator("option").nth(1)).to_have_text("/greeter")
    panel.get_by_label("Level of the log").select_option("All levels")
    panel.get_by_label("Search the log").fill("")
    sources.select_option("/careless")
    expect(log.locator(".ros-Log-line")).to_have_text([re.compile("INFO was here$")])
    expect(sources.locator("option:checked")).to_have_text("/careless (ended)")
    # The focus stays in the panel, wherever the row goes meanwhile, and the node stays open when it is restarted.
    process = panel.locator(".ros-Node-details > p").first
    before = process.inner_text()
    stop = panel.get_by_role("button", name="Stop greeter.py")
    expect(stop).to_have_attribute("aria-disabled", "false")
    panel.get_by_role("button", name="Restart greeter.py").press("Enter")
    expect(process).not_to_have_text(before)
    expect(process).to_contain_text("greeter.py, process")
    expect(stop).to_have_attribute("aria-disabled", "false")
    assert page.evaluate(FOCUS_IN_PANEL)
    stop.press("Enter")
    expect(panel.get_by_role("button", name="/greeter stopped")).to_be_visible()
    assert page.evaluate(FOCUS_IN_PANEL)
    page.set_viewport_size({"width": 390, "height": 800})
    page.wait_for_function(PHONE)
    assert panel.evaluate("panel => panel.scrollWidth <= panel.clientWidth")
    notebook = page.locator(".jp-NotebookPanel")
    panel.get_by_role("button", name="Back to the notebook").click()
    expect(panel).to_be_hidden()
    assert wait_until(lambda: notebook.bounding_box()["width"] >= 300, WAIT / 1e3)  # px
    run_from_palette(page, "ROS course", "Robot")  # which lies in front of the notebook then
    expect(notebook).to_be_hidden()
    back = panel.get_by_role("button", name="Back to the notebook")
    for leave in (lambda: page.keyboard.press("Escape"), back.click):
        run_from_palette(page, "ROS course", "Nodes")
        expect(panel).to_be_visible()
        leave()
        expect(notebook).to_be_visible()


PHONE = """() => {
    const box = document.querySelector('#ros2-course-nodes').getBoundingClientRect();
    return box.width >= 310 && box.right <= 390;
}"""
FOCUS_IN_PANEL = "() => document.activeElement.closest('#ros2-course-nodes') !== null"
MORE = """class Other(Node): pass
for number in range(6):
    ros.start(Other, f'other_{number}_of_those_that_were_added_later')
print('six more')"""
AT_END = "log => log.scrollTop + log.clientHeight >= log.scrollHeight - 2"
WITHIN = """details => {
    const [inner, outer] = [details, details.closest('.ros-Nodes')].map(each => each.getBoundingClientRect());
    return inner.top < outer.bottom - 40;
}"""


@pytest.mark.matrix  # tests/lab/test_nodes.py has what is told of a log, and the test above a log that is searched
def test_the_log_follows_its_end_and_an_opened_node_comes_into_sight_beside_many_nodes(lab, page):
    panel = begin(page, lab, "many")
    page.set_viewport_size({"width": 1280, "height": 800})
    log = panel.get_by_role("log")
    run_cell(page, CHECKS, FULL)
    expect(log).to_contain_text("line 199")
    run_cell(page, CHECKS, MORE)
    expect(panel.get_by_role("listitem")).to_have_count(9)
    assert wait_until(lambda: log.evaluate(AT_END), WAIT / 1e3)
    show_panel(page, "Inspector")
    expect(log).to_have_count(0)  # not drawn any more
    panel = show_panel(page, "Nodes")
    expect(log).to_contain_text("line 199")
    expect(panel.get_by_role("listitem")).to_have_count(9)
    assert wait_until(lambda: log.evaluate(AT_END), WAIT / 1e3)
    expect(log.locator(".ros-Log-line:not(:has(.ros-source))")).to_have_count(0)  # each names its node
    log.evaluate("log => { log.scrollTop = 0; }")  # as a reader does
    page.set_viewport_size({"width": 1280, "height": 780})
    run_cell(page, CHECKS, "full.get_logger().info('after that')")
    expect(log).to_contain_text("after that")
    assert not log.evaluate(AT_END)
    panel.get_by_role("button", name="/stranger running").click()
    expect(panel.locator(".ros-Node-details")).to_contain_text("parameters")
    assert wait_until(lambda: panel.locator(".ros-Node-details").evaluate(WITHIN), WAIT / 1e3)
    keep_picture(page, "nodes-many-1280")
    panel.get_by_role("listitem").filter(has_text="/stranger").get_by_role("button", name="Stop").click()
    expect(panel.get_by_role("listitem")).to_have_count(8)
    page.get_by_role("button", name="Restart the kernel", exact=True).click()
    page.get_by_role("dialog").get_by_role("button", name="Confirm Kernel Restart").click()
    expect(panel).to_contain_text("The kernel was restarted, and its nodes have ended")
    expect(log.locator(".ros-Log-line")).to_have_count(0)  # they belong to a session that has ended
    wait_for_kernel(page)
    choose(page, "Kernel", "Shut Down Kernel")
    expect(panel).to_contain_text("The notebook has no kernel.")


TWINS = f"""import subprocess, sys
from pathlib import Path
Path('twin.py').write_text({TWIN!r})
ros.start('twin.py')
outside = subprocess.Popen([sys.executable, 'twin.py', 'outside'], start_new_session=True)
print('both begun')"""


PLACES = """() => {
    window.places = [];
    const look = () => {
        const seen = document.querySelector('#ros2-course-nodes [aria-label="Stop keeper"]');
        const place = seen && Math.round(seen.getBoundingClientRect().top);
        if (place !== window.places.at(-1)) window.places.push(place);
        requestAnimationFrame(look);
    };
    look();
}"""
KEEPERS = """from rclpy.node import Node
class Keeper(Node): pass
for name in ('fibonacci_action_server', 'keeper'):
    ros.start(Keeper, name)"""
STEPS = """import pathlib
class Late(Node): pass
ros.until(pathlib.Path('start').exists, 600)
ros.start(Late, 'a_late_one')
ros.until(pathlib.Path('again').exists, 600)
ros.restart('greeter.py')
print('started again')
ros.until(pathlib.Path('stop').exists, 600)
ros.stop('a_late_one')"""


def check_that_no_row_moves_on_a_phone(page, panel, folder) -> None:
    """While other nodes start and end."""
    run_cell(page, CHECKS, KEEPERS)
    expect(panel.get_by_role("button", name="Stop keeper")).to_be_visible()
    run_cell(page, CHECKS, STEPS)
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_function(PHONE)
    page.evaluate(PLACES)
    late = panel.get_by_role("button", name="Stop a_late_one")
    (folder / "start").touch()
    expect(late).to_be_visible()
    keep_picture(page, "nodes-steady-phone")
    (folder / "again").touch()
    page.get_by_text("started again", exact=True).wait_for(state="attached")
    (folder / "stop").touch()
    expect(late).to_have_count(0)
    panel.get_by_role("button", name="Restart greeter.py").click()
    expect(panel.get_by_role("button", name="/greeter starting")).to_be_visible()
    expect(panel.get_by_role("button", name="/greeter running")).to_be_visible()
    panel.get_by_role("button", name="Restart fibonacci_action_server").click()  # whose state does not fit beside it
    expect(panel.get_by_role("button", name="/fibonacci_action_server running")).to_be_visible()
    assert len(page.evaluate("window.places")) == 1


@pytest.mark.matrix  # tests/lab/test_nodes.py tells them apart
def test_nodes_of_one_name_are_told_apart_in_their_rows_and_in_the_log_and_no_row_moves_on_a_phone(lab, page):
    page.set_viewport_size({"width": 1280, "height": 800})
    panel = begin(page, lab, "twins")
    run_cell(page, CHECKS, TWINS)
    rows = panel.get_by_role("listitem").filter(has_text="/twin")
    expect(rows.filter(has_text=re.compile(r"process \d+"))).to_have_count(2)
    outside = rows.filter(has_not=page.get_by_role("button", name="Restart twin.py"))
    process = re.search(r"process \d+", outside.inner_text())[0]
    log = panel.get_by_role("log")
    lines = log.locator(".ros-Log-line")
    expect(lines.filter(has_text=f"twin ({process}) outside").first).to_be_visible()
    expect(lines.filter(has_text=re.compile(r"twin \(process \d+\) inside")).first).to_be_visible()
    keep_picture(page, "nodes-twins-1280")
    graph = show_panel(page, "Graph")
    box = graph.get_by_role("button", name=re.compile(r"^node \/twin, 2 of this name"))
    expect(box.locator("text")).to_have_text("/twin (2)")
    expect(graph.get_by_role("list", name="The graph as a list")).to_contain_text("2 nodes have this name.")
    keep_picture(page, "graph-twins-1280")
    show_panel(page, "Nodes")
    panel.get_by_label("Node of the log").select_option(f"/twin, {process}")
    expect(log).not_to_contain_text("inside")
    expect(log).to_contain_text("outside")
    panel.get_by_label("Node of the log").select_option("/twin")
    expect(log).to_contain_text("inside")
    expect(log).to_contain_text("outside")
    expect_no_barriers(page, "#ros2-course-nodes", "nodes-twins")
    page.set_viewport_size({"width": 390, "height": 844})
    keep_picture(page, "nodes-twins-phone")
    outside.get_by_role("button", name=re.compile("Stop")).click()
    expect(rows).to_have_count(1)
    expect(rows).not_to_contain_text("process")
    page.set_viewport_size({"width": 1500, "height": 950})
    check_that_no_row_moves_on_a_phone(page, panel, lab[2] / "twins")


SAID = """window.said = [];
new MutationObserver(() => {
    const shown = document.querySelectorAll('#ros2-course-nodes .ros-Panel-message');
    window.said.push(...[...shown].map(each => each.textContent));
}).observe(document, {subtree: true, childList: true, characterData: true});"""


EMPTY = "Open a notebook: this panel shows what goes on in it."  # before JupyterLab has opened the notebook again


@pytest.mark.matrix  # tests/browser/test_inspector.py loads a page again
def test_a_page_that_is_loaded_again_says_that_it_connects_moves_no_terminal_and_has_all_lines_of_the_log(lab, page):
    """Also those of a node from before its restart."""
    panel = begin(page, lab, "kept")
    log = panel.get_by_role("log")
    expect(log).to_contain_text("greeted")
    process = panel.locator(".ros-Node-details > p").first
    panel.get_by_role("button", name="/greeter running").click()
    before = process.inner_text()
    panel.get_by_role("button", name="Restart greeter.py").click()
    expect(process).not_to_have_text(before)
    expect(process).to_contain_text("greeter.py, process")
    expect(log).to_contain_text("greeted")
    told = []
    page.on("request", lambda request: told.append(request.post_data_json) if "course/front" in request.url else None)
    page.add_init_script(SAID)
    for _ in range(2):
        told.clear()
        page.goto(f"{lab[0]}/lab/tree/kept/kept.ipynb?token={lab[1]}")
        expect(panel.get_by_role("button", name="/greeter running")).to_be_visible()
        expect(log).to_contain_text("greeted")
        assert set(page.evaluate("window.said")) <= {"", "Connecting …", EMPTY}
        assert wait_until(lambda: told, WAIT / 1e3)
        assert all(each["path"] == "kept/kept.ipynb" and each["kernel"] for each in told)


def test_the_button_runs_the_sessions_cell_and_while_a_cell_runs_a_death_is_told_and_then_the_kernels(lab, page):
    """Wherever that cell is; the panel tells which node has died and how, and the next kernel is found."""
    look = "self.create_timer(0.05, lambda: 1 / (not os.path.exists('die')))\n        self.create_service"
    path = write_greeter(lab[2] / "died", answer="import os\n" + SERVER.replace("self.create_service", look))
    notebook = nbformat.read(path, 4)
    notebook.cells.insert(0, nbformat.v4.new_code_cell("print('not this one')"))
    nbformat.write(notebook, path)
    open_page(page, lab, "died/died.ipynb")
    panel = show_panel(page, "Nodes")
    expect(panel).to_contain_text("Run the notebook’s cell with ros = course.live()")
    panel.get_by_role("button", name="Run the cell with course.live()").click()
    expect(panel).to_contain_text("No node runs.")
    expect(page.get_by_text("not this one", exact=True)).to_have_count(0)
    choose(page, "Run", "Run All Cells")
    expect(panel.get_by_role("button", name="/greeter running")).to_be_visible()
    run_cell(page, CHECKS + 1, BUSY)
    page.locator('.jp-Notebook-ExecutionIndicator[data-status="busy"]').wait_for()
    (lab[2] / "died/die").touch()
    panel.get_by_role("button", name="/greeter dead").click()
    expect(panel.locator(".ros-story")).to_contain_text("ZeroDivisionError")
    expect(panel).to_contain_text(re.compile(r", from \d\d:\d\d:\d\d to \d\d:\d\d:\d\d"))
    expect(panel.locator(".ros-story")).to_contain_text("greeter.py, line")
    expect(panel.get_by_role("log")).to_contain_text("ENDED greeter.py ended with exit status 1")
    expect(page.locator('.jp-Notebook-ExecutionIndicator[data-status="busy"]')).to_be_visible()
    (lab[2] / "died/end").touch()
    wait_until_run(page)
    run_cell(page, CHECKS + 1, "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)")
    expect(panel).to_contain_text("The kernel was restarted, and its nodes have ended")
    expect(panel.get_by_role("button", name="/greeter")).to_have_count(0)
    page.get_by_role("dialog").get_by_role("button", name="Ok").click()
    wait_for_kernel(page)
    (lab[2] / "died/die").unlink()
    run_cell(page, 0, "import course\nros = course.live()\nros.start('greeter.py')")
    expect(panel.get_by_role("button", name="/greeter running")).to_be_visible()


@pytest.mark.matrix
def test_ten_thousand_lines_a_second_leave_the_page_responsive_and_are_counted(lab, page):
    panel = begin(page, lab, "flooded")
    (lab[2] / "flooded/flood.py").write_text(FLOOD)
    run_cell(page, CHECKS, "ros.start('flood.py')")
    expect(panel).to_contain_text("lines are not shown: they came faster than a page can show them")
    assert draws_within(page, 2000)  # ms, on a busy machine
    panel.get_by_label("Node of the log").select_option("/greeter")
    expect(panel.get_by_role("log")).not_to_contain_text("line")
    expect(panel.get_by_role("log")).to_contain_text("greeted")
    panel.get_by_role("button", name="Stop flood.py").click()
    expect(panel.get_by_role("button", name="/flood stopped")).to_be_visible()


@pytest.mark.matrix  # each other test has one notebook, and a panel that follows it
def test_the_panel_shows_the_notebook_that_one_looks_at(lab, page):
    panel = begin(page, lab, "first")
    write_greeter(lab[2] / "second", answer=SERVER.replace("'greeter'", "'second_greeter'"))
    choose(page, "File", "Open from Path…")
    page.get_by_role("dialog").locator("input").fill("second/second.ipynb")
    page.get_by_role("dialog").get_by_role("button", name="Open").click()
    page.get_by_role("tab", name="second.ipynb").wait_for()
    expect(panel).to_contain_text("Run the notebook’s first cell")
    wait_for_kernel(page)
    choose(page, "Run", "Run All Cells")
    expect(panel.get_by_role("button", name="/second_greeter running")).to_be_visible()
    expect(panel.get_by_role("button", name="/greeter running")).to_have_count(0)
    page.get_by_role("tab", name="first.ipynb").click()
    expect(panel.get_by_role("button", name="/greeter running")).to_be_visible()
    expect(panel.get_by_role("button", name="/second_greeter running")).to_have_count(0)
