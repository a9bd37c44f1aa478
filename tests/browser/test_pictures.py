"""The pictures of README.md, made from what they show: JupyterLab at work, and a page of feedback.

`COURSE_PICTURES=docs/pictures environment/test -m '' tests/browser/test_pictures.py` makes them.  What they show, other
tests of this folder hold.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from PIL import Image
from playwright.sync_api import Browser, Locator, Page, expect

from tests.browser.conftest import ROOT, WAIT
from tests.browser.pages import keep_picture, open_page, run_from_palette, show_panel

expect.set_options(timeout=WAIT)
pytestmark = pytest.mark.matrix


@pytest.fixture
def view(chromium: Browser) -> Iterator[Page]:
    """An empty page of the size of a picture."""
    page = chromium.new_page(viewport={"width": 1280, "height": 820})
    page.set_default_timeout(WAIT)
    yield page
    page.close()


def open_section(page: Page, lab, name: str) -> None:
    """Open a section's notebook as it is stored, in a folder of its name."""
    (lab[2] / name).mkdir()
    shutil.copy(ROOT / f"notebooks/{name}/{name}.ipynb", lab[2] / name)
    open_page(page, lab, f"{name}/{name}.ipynb")


def run_cells(page: Page, *texts: str) -> Locator:
    """Run the code cells that contain these texts, as they are; return the last one."""
    for text in texts:
        editor = page.locator(".jp-Notebook .jp-CodeCell .cm-content").filter(has_text=text)
        editor.click(position={"x": 4, "y": 4})
        page.keyboard.press("Shift+Enter")
    return editor


LABEL = """([name, { x, y, width, height }]) => {
  const frame = document.createElement('div'), label = document.createElement('div');
  const narrow = width < 100, wide = { left: `${x + width - 8}px`, top: `${y + 6}px`, translate: '-100%' };
  const colour = '#8a1c5b';
  Object.assign(frame.style, {
    position: 'fixed', zIndex: 100000, left: `${x}px`, top: `${y}px`, width: `${width}px`, height: `${height}px`,
    boxSizing: 'border-box', border: `2px solid ${colour}`, borderRadius: '4px'
  });
  Object.assign(label.style, {
    position: 'fixed', zIndex: 100001, background: colour, color: 'white', font: 'bold 15px sans-serif',
    padding: '3px 9px', borderRadius: '4px', whiteSpace: 'nowrap',
    ...(narrow ? { left: `${x - 4}px`, top: `${y + height / 2}px`, translate: '-100% -50%' } : wide)
  });
  label.textContent = name;
  document.body.append(frame, label);
}"""


def draw_label(page: Page, name: str, part: Locator) -> None:
    """Draw a frame around a part of the page, and its name: in the corner of a large part, beside a small one."""
    page.evaluate(LABEL, [name, part.bounding_box()])


def test_all_parts_of_the_lab_with_their_names(lab, view):
    view.set_viewport_size({"width": 1600, "height": 1000})
    open_section(view, lab, "ai_integration")
    run_from_palette(view, "ROS course", "ROS terminal")
    terminal = view.locator(".jp-Terminal .xterm-screen")
    terminal.wait_for()
    view.get_by_role("tab", name="ai_integration.ipynb").click()
    world = run_cells(view, "ros = course.live()", "destroy_subscription(listener)")  # a world in real time
    robot = view.get_by_role("tabpanel", name="Robot", exact=True)
    expect(robot).to_contain_text("room: pillars")
    terminal.click()
    view.keyboard.type("python -m course.nodes.ai_robot_controller &>/dev/null & clear\n")
    expect(robot).to_contain_text("driven by /ai_robot_controller")
    view.keyboard.type("ros2 node list; ros2 param get /ai_robot_controller obstacle_threshold\n")
    frames = int(robot.locator("canvas").get_attribute("data-frames") or 0)
    view.wait_for_function(f"() => document.querySelector('.ros-Robot-canvas').dataset.frames > {frames + 300}")
    view.get_by_role("button", name="Smaller").click()
    run_from_palette(view, "ROS course", "Plot")
    plot = view.get_by_role("tabpanel", name="Plot", exact=True)
    plot.get_by_label("Topic").select_option("/odom")
    plot.get_by_role("button", name="Add to the plot").click()
    expect(plot.get_by_role("listitem").locator("output")).to_contain_text("m/s")
    nodes = show_panel(view, "Nodes")
    expect(nodes).to_contain_text("/world")
    view.get_by_role("tab", name="ai_integration.ipynb").click()
    world.evaluate("cell => cell.scrollIntoView({ block: 'start' })")
    notebook = view.locator(".jp-NotebookPanel:visible")
    draw_label(view, "Notebook", notebook)
    draw_label(view, "Hand in", notebook.get_by_role("button", name="Hand in"))
    draw_label(view, "Terminal", view.locator(".jp-Terminal:visible"))
    draw_label(view, "Robot", robot)
    draw_label(view, "Plot", plot)
    draw_label(view, "Nodes", nodes)
    for name in ("Exercise", "Inspector", "Graph"):  # a click opens them where Nodes is
        draw_label(view, name, view.get_by_role("tab", name=name, exact=True))
    keep_picture(view, "jupyterlab")
    if folder := os.environ.get("COURSE_PICTURES"):  # with fewer colours it loads quickly
        path = Path(folder) / "jupyterlab.png"
        with Image.open(path) as picture:
            picture.convert("RGB").quantize(128, dither=Image.Dither.NONE).save(path, optimize=True)


def test_the_graph_and_a_goal_sent_by_a_form(lab, view):
    open_section(view, lab, "actions")
    view.get_by_role("tab", name="Graph", exact=True).click(button="right")
    view.locator(".lm-Menu-itemLabel").get_by_text("Switch Sidebar Side").click()
    inspector = show_panel(view, "Inspector")
    server = run_cells(view, "ros = course.live()", "import Fibonacci as Released", "class ChapterServer(Node)")
    inspector.get_by_label("What to do").select_option("Send a goal")
    inspector.get_by_label("order int32").fill("5")
    inspector.get_by_role("button", name="Send the goal").click()
    expect(inspector.get_by_role("region", name="Timeline")).to_contain_text("succeeded")
    graph = view.get_by_role("region", name="Graph", exact=True)
    expect(graph.get_by_role("list", name="The graph as a list")).to_contain_text("/fibonacci_server")
    server.evaluate("cell => cell.scrollIntoView({ block: 'start' })")
    keep_picture(view, "inspector")


def test_a_page_of_feedback(tmp_path, view):
    work = tmp_path / "submitted/grace/calculator"
    shutil.copytree(ROOT / "solutions/calculator", work)
    server = work / "calculator_server.py"
    server.write_text(server.read_text().replace("request.b == 0.0", "request.b == -0.1"))  # it divides by zero
    autograder = Path(sys.executable).with_name("autograder")
    subprocess.run(
        [autograder, "grade", tmp_path / "submitted", "--output", tmp_path / "out", "--no-gradebook"], check=True
    )
    view.set_viewport_size({"width": 900, "height": 900})
    view.goto((tmp_path / "out/feedback/grace/calculator.html").as_uri())
    expect(view.get_by_text("ZeroDivisionError").first).to_be_visible()
    keep_picture(view, "feedback")
