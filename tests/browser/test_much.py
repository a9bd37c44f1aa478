"""Panels with fifty nodes, two notebooks at once, and a kernel that is killed: they answer, and say what is lost."""

import os
import re
import signal

import nbformat
import pytest
from playwright.sync_api import Page, expect

from course.foundation.waiting import wait_until
from tests.browser.conftest import WAIT, serving
from tests.browser.pages import (
    cell,
    choose,
    draws_within,
    keep_picture,
    open_page,
    run_cell,
    run_from_palette,
    show_panel,
    wait_for_kernel,
    write_greeter,
)
from tests.lab.test_inspector import SERVERS

expect.set_options(timeout=WAIT)
pytestmark = pytest.mark.matrix  # loads, and what the tests of each panel show of it alone

# Keeps the text of a panel whenever it changes.
KEEP = """panel => {
  window.texts = [];
  new MutationObserver(() => texts.push(panel.textContent)).observe(
    panel, { subtree: true, childList: true, characterData: true });
}"""
SMOOTH = 2000  # ms between two pictures at most, on a busy machine
MANY = """import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger


class One(Node):
    def __init__(self, number):
        super().__init__(f'node_{number:02}')
        self.create_service(Trigger, f'serve_{number:02}', self.serve)
        self.publisher = self.create_publisher(String, f'said_{number % 7}', 10)
        self.create_timer(0.1, lambda: self.publisher.publish(String(data=self.get_name())))

    def serve(self, request, response):
        response.message = 'from ' + self.get_name()
        return response


rclpy.init()
executor = SingleThreadedExecutor()
for number in range(50):
    executor.add_node(One(number))
executor.spin()
"""
CALLS = """from std_srvs.srv import Trigger
for number in range(200):
    ros.call(f'/serve_{number % 50:02}', Trigger)
print('all', 'answered')"""


def begin(page: Page, lab, name: str, files: dict[str, str]) -> None:
    """A notebook with empty cells beside some programs, its session begun, and the panel of nodes open."""
    folder = lab[2] / name
    folder.mkdir(exist_ok=True)
    for file, text in files.items():
        (folder / file).write_text(text)
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    cells = [nbformat.v4.new_code_cell() for _ in range(3)]
    nbformat.write(nbformat.v4.new_notebook(cells=cells, metadata=kernel), folder / f"{name}.ipynb")
    open_page(page, lab, f"{name}/{name}.ipynb")
    nodes = show_panel(page, "Nodes")
    expect(nodes).to_contain_text("There is no live session yet")  # there is a kernel
    begin_session(page)
    expect(nodes).to_contain_text("No node runs.")


def begin_session(page: Page) -> None:
    """Run the first cell, which prints the kernel's process."""
    run_cell(page, 0, "import course, os\nros = course.live()\nprint('process', os.getpid())")
    cell(page, 0).locator(".jp-OutputArea-output pre").get_by_text("process").wait_for()


def process(page: Page) -> int:
    """The number of the kernel's process."""
    return int(cell(page, 0).locator(".jp-OutputArea-output pre").inner_text().split()[1])


def robot(page: Page):
    """The robot view, beside the notebook, which has the focus again."""
    run_from_palette(page, "ROS course", "Robot")
    page.get_by_role("tab", name=".ipynb").click()
    return page.get_by_role("tabpanel", name="Robot", exact=True)


def test_fifty_nodes_and_many_calls_leave_every_panel_responsive(lab, page):
    begin(page, lab, "many", {"many.py": MANY})
    nodes = page.get_by_role("region", name="Nodes", exact=True)
    run_cell(page, 1, "ros.start('many.py')")
    expect(nodes.get_by_role("button", name=re.compile(r"node_\d\d running"))).to_have_count(50)
    assert draws_within(page, SMOOTH)
    nodes.get_by_role("button", name="/node_37 running").click()
    expect(nodes).to_contain_text("/serve_37 std_srvs/srv/Trigger")
    graph = show_panel(page, "Graph")
    picture = graph.get_by_role("group", name=re.compile(r"Nodes: 50\. Topics, services and actions: 57\."))
    expect(picture).to_be_visible()
    assert picture.bounding_box()["height"] > 200  # px: more than a line of dots
    view = robot(page)
    view.get_by_role("button", name="Start a world").click()
    expect(view.get_by_role("button", name="Pause")).to_be_visible()
    run_cell(page, 2, CALLS)
    assert draws_within(page, SMOOTH)
    page.locator(".jp-OutputArea-output pre").get_by_text("all answered").wait_for()
    calls = graph.get_by_label("Which call or goal").locator("option")
    expect(calls.first).to_contain_text("service /serve_49")
    assert calls.count() == 20
    before = int(view.locator("canvas").get_attribute("data-frames") or 0)
    page.wait_for_function(f"() => document.querySelector('.ros-Robot-canvas').dataset.frames > {before + 10}")
    inspector = show_panel(page, "Inspector")
    inspector.get_by_role("combobox", name="Service", exact=True).select_option(label="/serve_49")
    inspector.get_by_role("button", name="Call").click()
    expect(inspector.get_by_role("region", name="Timeline")).to_contain_text("from node_49")
    run_cell(page, 2, "ros.stop('many.py')")
    expect(inspector.get_by_role("combobox", name="Service", exact=True)).not_to_contain_text("/serve_")
    expect(show_panel(page, "Graph").get_by_role("list", name="The graph as a list")).not_to_contain_text("/node_")


def test_robot_graph_and_inspector_show_the_notebook_that_one_looks_at(lab, page):
    begin(page, lab, "one", {})
    view = robot(page)
    view.get_by_label("Room").select_option("office")
    view.get_by_role("button", name="Start a world").click()
    expect(view).to_contain_text("room: office")
    graph = show_panel(page, "Graph")
    expect(graph.get_by_role("list", name="The graph as a list")).to_contain_text("/world")
    if not (lab[2] / "other").exists():
        write_greeter(lab[2] / "other")
    page.get_by_role("tab", name="one.ipynb").click()  # the other is opened in the same place
    choose(page, "File", "Open from Path…")
    page.get_by_role("dialog").locator("input").fill("other/other.ipynb")
    page.get_by_role("dialog").get_by_role("button", name="Open").click()
    expect(graph).to_contain_text("There is no live session yet")
    expect(view).to_contain_text("There is no live session yet")
    expect(view).not_to_contain_text("office")
    expect(graph.get_by_role("list", name="The graph as a list")).to_have_count(0)
    choose(page, "Run", "Run All Cells")
    expect(graph.get_by_role("list", name="The graph as a list")).to_contain_text("/greeter")
    expect(graph.get_by_role("list", name="The graph as a list")).not_to_contain_text("/world")
    expect(view).to_contain_text("No robot yet")
    page.get_by_role("tab", name="one.ipynb").click()
    expect(view).to_contain_text("room: office")
    expect(graph.get_by_role("list", name="The graph as a list")).not_to_contain_text("/greeter")
    services = show_panel(page, "Inspector").get_by_role("combobox", name="Service", exact=True)
    expect(services).to_contain_text("/world/reset")
    page.get_by_role("tab", name="other.ipynb").click()
    expect(services).to_contain_text("/greet")
    expect(services).not_to_contain_text("/world")
    # With the robot in front, a page that is loaded again shows the notebook in sight, which is not the last opened.
    with page.expect_request(lambda request: "/api/workspaces/" in request.url and request.method == "PUT"):
        page.get_by_role("tab", name="one.ipynb").click()
        view.locator("canvas").click()
    page.goto(f"{lab[0]}/lab?token={lab[1]}")
    expect(view).to_contain_text("room: office")
    expect(services).to_contain_text("/world/reset")
    expect(services).not_to_contain_text("/greet")


def test_a_kernel_killed_under_the_inspector_and_under_the_graph_is_told_and_the_next_one_is_found(lab, page):
    """The panel of nodes and the robot view have tests of their own."""
    begin(page, lab, "shot", {"servers.py": SERVERS})
    inspector, graph = (page.get_by_role("region", name=name, exact=True) for name in ("Inspector", "Graph"))
    show_panel(page, "Inspector")
    for panel in (inspector, graph):
        run_cell(page, 1, "ros.start('servers.py')")
        inspector.get_by_label("What to do").select_option("Send a goal")
        inspector.get_by_label("order int32").fill("1000")
        inspector.get_by_role("button", name="Send the goal").click()
        expect(inspector.get_by_role("button", name="Cancel the goal")).to_be_visible()
        if panel is graph:
            show_panel(page, "Graph")
        expect(panel.get_by_role("region", name="Timeline")).to_contain_text("Waiting for the end of the goal")
        os.kill(process(page), signal.SIGKILL)
        expect(panel).to_contain_text("The kernel was restarted, and its nodes have ended")
        expect(panel.get_by_role("region", name="Timeline")).to_have_count(0)
        expect(panel.get_by_role("list", name="The graph as a list")).to_have_count(0)
        page.get_by_role("dialog").get_by_role("button", name="Ok").click()
        wait_for_kernel(page)
        begin_session(page)
        expect(panel).not_to_contain_text("The kernel has ended")
    expect(graph).to_contain_text("No node runs.")
    show_panel(page, "Inspector")
    inspector.get_by_label("What to do").select_option("Publish a message")
    expect(inspector).to_contain_text("No node has a topic of its own yet, only /parameter_events and /rosout")
    inspector.get_by_label("What to do").select_option("Set a parameter")
    run_cell(page, 1, "from rclpy.node import Node\nros.start(Node, 'plain')")
    first = inspector.get_by_role("combobox", name="Parameter", exact=True)
    expect(first).to_have_value("use_sim_time")  # and not one that is read-only


def test_a_server_that_is_started_again_is_found_within_seconds_and_no_kernel_was_restarted(chromium, tmp_path):
    page = chromium.new_page()
    page.set_default_timeout(WAIT)
    served = tmp_path / "served"
    write_greeter(served / "served_again")
    with serving(tmp_path, served) as server:
        open_page(page, (*server, served), "served_again/served_again.ipynb")
        panel = show_panel(page, "Nodes")
        begin_session(page)
        expect(panel).not_to_contain_text("There is no live session")
        panel.evaluate(KEEP)
        run_from_palette(page, "ROS course", "ROS terminal")
        terminal = page.locator(".jp-Terminal")
        terminal.locator(".xterm-screen").click()
        page.keyboard.type("touch here\n")
        assert wait_until((served / "served_again/here").exists, WAIT / 1e3)
    expect(panel).to_contain_text("Jupyter’s server does not answer.")
    expect(terminal).to_contain_text("Jupyter’s server does not answer.")
    with serving(tmp_path, served, server):
        expect(panel).not_to_contain_text("Jupyter’s server does not answer.", timeout=15_000)
        expect(panel).not_to_contain_text("Connecting")
        assert not [text for text in page.evaluate("texts") if "was restarted" in text or "no live session" in text]
        expect(terminal).to_contain_text("Jupyter’s server has ended this terminal: what is typed here is lost.")
        keep_picture(page, "served-again")
        terminal.get_by_role("button", name="Open a new terminal").click()
        expect(terminal.get_by_role("button")).to_have_count(0)
        expect(terminal).to_have_count(1)
        page.locator(".jp-Terminal:focus-within").wait_for()
        page.keyboard.type("touch again\n")
        assert wait_until((served / "served_again/again").exists, WAIT / 1e3)
    page.close()


def test_without_a_kernel_too_a_panel_says_that_the_server_does_not_answer(chromium, tmp_path):
    """A server that ends has ended the kernels first, and the page may learn that in time."""
    page = chromium.new_page()
    page.set_default_timeout(WAIT)
    served = tmp_path / "served"
    write_greeter(served / "alone")
    with serving(tmp_path, served) as server:
        open_page(page, (*server, served), "alone/alone.ipynb")
        panel = show_panel(page, "Nodes")
        choose(page, "Kernel", "Shut Down Kernel")
        expect(panel).to_contain_text("The notebook has no kernel. Choose one in the Kernel menu.")
    expect(panel).to_contain_text("Jupyter’s server does not answer. Trying again …")
    with serving(tmp_path, served, server):
        expect(panel).to_contain_text("The notebook has no kernel. Choose one in the Kernel menu.", timeout=15_000)
    page.close()
