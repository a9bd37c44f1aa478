"""Every panel at 200 % zoom and on a phone: nothing is cut off, nothing scrolls two ways, each control can be reached.

A page of 1280 px at 200 % is one of 640 CSS px with two pixels each (WCAG 2.2, 1.4.4 and 1.4.10).
"""

import pytest
from playwright.sync_api import Locator, Page, Request, expect

from course.foundation.waiting import wait_until
from tests.browser.conftest import WAIT
from tests.browser.pages import cell, choose, keep_picture, open_page, run_from_palette, show_panel, write_greeter

expect.set_options(timeout=WAIT)

WIDE = {"width": 1280, "height": 950}
SIZES = {"zoom-200": {"width": 640, "height": 475}, "phone": {"width": 390, "height": 800}}
NOTEBOOK, VIEWS = ".jp-NotebookPanel", "#ros2-course-robot:visible, #ros2-course-plot:visible"
DRIVE = """
from course.world.node import World
from course.nodes.ai_robot_controller import AIRobotController
ros.start(World, parameters={'room': 'hall'})
ros.start(AIRobotController)"""
# What is wrong with a panel that is shown: sentences.
WRONG = """async panel => {
  const wrong = [];
  const call = each => `${each.tagName} ${each.className.baseVal ?? each.className} `
    + `"${(each.ariaLabel || each.textContent).slice(0, 40)}"`;
  const inPage = each => {
    const box = each.getBoundingClientRect();
    return box.left >= -0.5 && box.right <= innerWidth + 0.5;
  };
  const drawn = each => each.checkVisibility({ visibilityProperty: true }) && !each.closest('.ros-hidden');
  if (!inPage(panel)) wrong.push('the panel is not in the page');
  if (document.scrollingElement.scrollWidth > innerWidth) wrong.push('the page scrolls to the side');
  for (const each of [panel, ...panel.querySelectorAll('*')].filter(drawn)) {
    const wide = each.scrollWidth > each.clientWidth + 1 && each.clientWidth > 0 && !(each instanceof SVGElement);
    const { overflowX } = getComputedStyle(each);
    if (wide && !['SELECT', 'INPUT'].includes(each.tagName)) {
      if (overflowX === 'auto' || overflowX === 'scroll') wrong.push(`scrolls to the side: ${call(each)}`);
      if (overflowX === 'hidden' || overflowX === 'clip') wrong.push(`is cut off: ${call(each)}`);
    }
  }
  const controls = [...panel.querySelectorAll('button, select, input, summary, a[href], [tabindex="0"]')].filter(drawn);
  if (controls.length === 0) wrong.push('there are no controls');
  for (const each of controls) {
    each.scrollIntoView({ block: 'center', inline: 'nearest' });
    await new Promise(done => requestAnimationFrame(done));
    const { left, right, top, bottom } = each.getBoundingClientRect();
    const hit = document.elementFromPoint((left + right) / 2, (Math.max(top, 0) + Math.min(bottom, innerHeight)) / 2);
    if (!inPage(each)) wrong.push(`is beyond the edge: ${call(each)}`);
    else if (!panel.contains(hit) || !(each.contains(hit) || hit.contains(each))) wrong.push(`covered: ${call(each)}`);
    if (!each.disabled) {
      each.focus();
      if (document.activeElement !== each) wrong.push(`takes no focus: ${call(each)}`);
    }
  }
  panel.scrollTo(0, 0);
  return wrong;
}"""


def is_saved(request: Request) -> bool:
    """Return True if the request stores the page's layout."""
    return "/api/workspaces/" in request.url and request.method == "PUT"


def begin(page: Page, lab, name: str) -> None:
    """A notebook with an exercise that runs, a world and its driver."""
    write_greeter(lab[2] / name)
    open_page(page, lab, f"{name}/{name}.ipynb")
    expect(show_panel(page, "Nodes")).to_contain_text("Run the notebook’s first cell")
    cell(page, 0).locator(".cm-content").click()
    page.keyboard.press("Control+End")
    page.keyboard.insert_text(DRIVE)
    choose(page, "Run", "Run All Cells")


def nodes(page: Page) -> Locator:
    """The panel of nodes, with the details of one; it is open from the beginning."""
    panel = page.get_by_role("region", name="Nodes", exact=True)
    panel.get_by_role("button", name="/greeter running").click()
    expect(panel).to_contain_text("word = 'hello'")
    expect(panel.get_by_role("log")).to_contain_text("greeted")
    return panel


def exercise(page: Page) -> Locator:
    """The exercise panel, with a hint."""
    panel = show_panel(page, "Exercise")
    expect(panel).to_contain_text("1 of 2 parts done")
    panel.get_by_text("Hint 1: where to look").click()
    expect(panel.locator(".ros-hint strong")).to_be_visible()
    return panel


def inspector(page: Page) -> Locator:
    """The inspector, when it has called a service."""
    panel = show_panel(page, "Inspector")
    panel.get_by_role("combobox", name="Service", exact=True).select_option(label="/greet")
    panel.get_by_role("button", name="Call").click()
    expect(panel.get_by_role("region", name="Timeline")).to_contain_text("hello")
    expect(panel.get_by_label("The program", exact=True)).to_contain_text("import rclpy")
    return panel


def graph(page: Page) -> Locator:
    """The graph, and the flow of the inspector's call."""
    panel = show_panel(page, "Graph")
    expect(panel.get_by_role("list", name="The graph as a list")).to_contain_text("/ai_robot_controller")
    expect(panel.get_by_role("region", name="Timeline")).to_contain_text("response")
    return panel


def robot(page: Page) -> Locator:
    """The robot view, which lies beside the notebook."""
    run_from_palette(page, "ROS course", "Robot")
    panel = page.get_by_role("tabpanel", name="Robot", exact=True)
    expect(panel.get_by_label("obstacle_threshold")).to_be_visible()
    panel.get_by_text("Keys and legend").click()
    keys, picture = (panel.locator(each).first.bounding_box() for each in (".ros-Robot-keys dl", ".ros-Robot-stage"))
    assert keys["width"] >= picture["width"]
    expect(page.locator(".jp-Notebook")).to_be_visible()
    return panel


def plot(page: Page) -> Locator:
    """The plot, which lies below the robot view."""
    run_from_palette(page, "ROS course", "Plot")
    panel = page.get_by_role("tabpanel", name="Plot", exact=True)
    panel.get_by_label("Topic").select_option("/odom")
    panel.get_by_role("button", name="Add to the plot").click()
    expect(panel.get_by_role("listitem")).to_contain_text("/odom twist.twist.linear.x")
    panel.get_by_role("button", name="Pause").click()
    return panel


@pytest.mark.matrix  # tests/browser/test_robot.py ends on a narrow page, and test_hand_in.py has one
def test_no_panel_is_cut_off_or_scrolls_two_ways_at_200_percent_and_on_a_phone(lab, chromium):
    page = chromium.new_page(viewport=WIDE, device_scale_factor=2)
    page.set_default_timeout(WAIT)
    begin(page, lab, "reflow")
    for show in (nodes, exercise, inspector, graph, robot, plot):
        panel = show(page)
        for name, size in SIZES.items():
            page.set_viewport_size(size)
            if show in (robot, plot):
                page.get_by_role("tab", name=show.__name__.capitalize(), exact=True).click()  # behind the notebook
                expect(page.locator(".jp-Notebook")).to_be_hidden()
            assert wait_until(lambda panel=panel: panel.evaluate(WRONG) == [], 20), (show, name, panel.evaluate(WRONG))
            keep_picture(page, f"{show.__name__}-{name}")
        page.set_viewport_size(WIDE)
    page.set_viewport_size(SIZES["phone"])  # the notebook's tab shows its name beside those of robot and plot
    tab = page.get_by_role("tab", name="reflow.ipynb", exact=True)
    tab.click()
    label = tab.locator(".lm-TabBar-tabLabel")
    assert wait_until(lambda: label.evaluate("each => each.scrollWidth <= each.clientWidth"), 20), tab.bounding_box()
    expect(page.locator("[data-jp-item-name='kernelName']:visible")).to_have_count(0)  # it would be cut off
    page.set_viewport_size(WIDE)
    expect(page.locator(".jp-Notebook")).to_be_visible()  # beside the robot again
    expect(panel).to_be_visible()
    page.close()


@pytest.mark.matrix  # the test above has every panel in a narrow page
def test_robot_and_plot_come_back_beside_the_notebook_when_the_page_is_wide_again(lab, chromium):
    page = chromium.new_page(viewport=WIDE)
    page.set_default_timeout(WAIT)
    write_greeter(lab[2] / "back")
    open_page(page, lab, "back/back.ipynb")
    views = ("Robot", "Plot")
    for name in views:
        run_from_palette(page, "ROS course", name)
    notebook = page.locator(NOTEBOOK)

    def beside() -> bool:
        boxes = [page.get_by_role("tabpanel", name=name, exact=True).bounding_box() for name in views]
        text = notebook.bounding_box()
        if text is None or None in boxes:
            return False
        robot, plot = boxes
        return text["x"] + text["width"] <= robot["x"] == plot["x"] and robot["y"] + robot["height"] <= plot["y"]

    assert wait_until(beside, 20)
    for front in ("back.ipynb", "Robot", "Plot"):
        with page.expect_request(is_saved):
            page.set_viewport_size(SIZES["phone"])
            page.get_by_role("tab", name=front).click()
            expect(page.locator(f"{NOTEBOOK}:visible, {VIEWS}")).to_have_count(1)
        if front == "Plot":
            page.reload()
            page.locator('.jp-Notebook-ExecutionIndicator[data-status="idle"]').wait_for(state="attached")
            expect(page.locator(f"{NOTEBOOK}:visible, {VIEWS}")).to_have_count(1)
        page.set_viewport_size(WIDE)
        assert wait_until(beside, 20), front
    page.close()


def test_a_panel_that_was_open_on_a_page_as_narrow_as_a_phone_is_no_wider_afterwards(lab, chromium):
    """JupyterLab stores which shares of the page notebook and panel have; on a phone the panel covers the notebook."""
    page = chromium.new_page(viewport=WIDE)
    page.set_default_timeout(WAIT)
    write_greeter(lab[2] / "wider")
    open_page(page, lab, "wider/wider.ipynb")
    with page.expect_request(is_saved):
        panel = show_panel(page, "Nodes")
    width, address = panel.bounding_box()["width"], page.url
    with page.expect_request(is_saved):
        page.set_viewport_size(SIZES["phone"])
        expect(page.get_by_role("button", name="Back to the notebook")).to_be_visible()
    page.goto("about:blank")
    page.set_viewport_size(WIDE)
    page.goto(address)
    panel.wait_for()
    assert wait_until(lambda: abs(panel.bounding_box()["width"] - width) < 2, 20), (panel.bounding_box(), width)
    notebook = page.locator(NOTEBOOK)
    page.set_viewport_size({"width": 600, "height": 800})  # both have room beside each other
    expect(page.get_by_role("button", name="Back to the notebook")).to_be_hidden()
    assert wait_until(lambda: 240 <= notebook.bounding_box()["width"] <= 360, 20), notebook.bounding_box()
    page.set_viewport_size({"width": 590, "height": 800})
    expect(page.get_by_role("button", name="Back to the notebook")).to_be_visible()
    page.set_viewport_size(WIDE)
    assert wait_until(lambda: abs(panel.bounding_box()["width"] - width) < 2, 20), (panel.bounding_box(), width)
    page.close()
