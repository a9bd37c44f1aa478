"""The inspector and the graph in JupyterLab: calls and goals from a form, what passed, and who is there."""

import re

import nbformat
import pytest
from playwright.sync_api import expect

from tests.browser.conftest import WAIT
from tests.browser.pages import barriers, choose, open_page, set_theme, show_panel
from tests.lab.test_inspector import SERVERS

expect.set_options(timeout=WAIT)


def begin(page, lab, name):
    """A notebook with a service and an action, and its session begun."""
    folder = lab[2] / name
    folder.mkdir()
    (folder / "servers.py").write_text(SERVERS)
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


def test_a_service_is_called_and_a_goal_canceled_while_a_cell_runs_and_the_graph_shows_both(lab, page):
    panel = begin(page, lab, "inspected")
    panel.get_by_role("combobox", name="Service", exact=True).select_option("/add_two_ints")
    panel.get_by_label("a int64").fill("two")
    expect(panel.get_by_text("write a whole number: int64 takes no 'two'")).to_be_visible()
    expect(panel.get_by_label("a int64")).to_have_attribute("aria-invalid", "true")
    panel.get_by_label("a int64").fill("9007199254740993")  # which a number of JavaScript cannot hold
    panel.get_by_label("b int64").fill("1")
    panel.get_by_label("b int64").press("Enter")
    expect(panel.get_by_role("region", name="What passed")).to_contain_text("sum: 9007199254740994")
    line = panel.get_by_label("The line", exact=True)
    expect(line).to_contain_text("ros2 service call /add_two_ints example_interfaces/srv/AddTwoInts")
    expect(line).to_contain_text("{a: 9007199254740993, b: 1}")
    expect(panel.get_by_label("The program", exact=True)).to_contain_text("AddTwoInts.Request(a=9007199254740993, b=1)")
    panel.get_by_label("Do what").select_option("Send a goal")
    panel.get_by_label("order int32").fill("1000")
    panel.get_by_role("button", name="Send the goal").click()
    panel.get_by_role("button", name="Cancel the goal").click()
    flow = panel.get_by_role("region", name="What passed").get_by_role("img")
    expect(flow).to_have_attribute("aria-label", re.compile("goal, .*accepted, .*cancel, .*canceled"))
    graph = show_panel(page, "Graph")
    listed = graph.get_by_role("list", name="The graph as a list")
    expect(listed).to_contain_text("offers the actions /fibonacci")
    expect(listed).not_to_contain_text("get_parameters")
    expect(graph.get_by_role("img", name="Nodes: 1. Topics, services and actions: 4.")).to_be_visible()
    expect(graph.get_by_label("Which call or goal")).to_contain_text("action /fibonacci")
    expect(show_panel(page, "Inspector").get_by_label("order int32")).to_have_value("1000")  # as it was left
    expect(page.locator('.jp-Notebook-ExecutionIndicator[data-status="busy"]')).to_be_visible()
    (lab[2] / "inspected/end").touch()


@pytest.mark.parametrize("theme", ["Light", "Dark"])
def test_everybody_can_use_both(lab, page, theme):
    name = f"inspector-{theme.lower()}"
    panel = begin(page, lab, name)
    set_theme(page, theme)
    panel.get_by_role("button", name="Call").click()
    expect(panel.get_by_role("region", name="What passed")).to_contain_text("response")
    assert barriers(page, "#ros2-course-inspector") == []
    page.set_viewport_size({"width": 390, "height": 800})
    assert panel.evaluate("panel => panel.scrollWidth <= panel.clientWidth")
    page.set_viewport_size({"width": 1500, "height": 950})
    graph = show_panel(page, "Graph")
    expect(graph.get_by_role("list", name="The graph as a list")).to_contain_text("/servers")
    assert barriers(page, "#ros2-course-graph") == []
    (lab[2] / f"{name}/end").touch()
