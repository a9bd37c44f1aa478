"""The robot view and the plot in JupyterLab: a world is driven and changed by hand and by keys; a cell's drive."""

import re
import statistics

import nbformat
import pytest
from playwright.sync_api import Locator, Page, Request, expect

from course.foundation.waiting import wait_until
from course.world import ROOMS
from course.world.geometry import clearance
from course.world.simulation import Robot
from tests.browser.conftest import WAIT
from tests.browser.pages import (
    BUSY,
    cell,
    expect_no_barriers,
    keep_picture,
    open_page,
    run_cell,
    run_from_palette,
    set_theme,
    wait_for_kernel,
    wait_until_run,
)

expect.set_options(timeout=WAIT)

PANELS = ["Exercise", "Nodes", "Inspector", "Graph", "Robot", "Plot"]  # in the order that the students' README tells
DRIVER = """from course.nodes.ai_robot_controller import AIRobotController
driver = ros.start(AIRobotController)"""
# As `ros2 param set` does from another program, which tests/lab/test_robot.py starts.
SET = """from rclpy.parameter import Parameter
from course.world.node import latest
driver.node.set_parameters([Parameter('obstacle_threshold', value=2.0)])
latest().set_parameters([Parameter('room', value='office')])"""
NOISE = """from rclpy.parameter import Parameter
from course.world.node import latest
_ = latest().set_parameters([Parameter('noise', value=0.05)])"""
BEAMS = """ros.until(lambda: latest().get_parameter('beams').value == 24, 60.0)
print('beams', latest().get_parameter('beams').value)"""
PUT = r"The robot was put at x = (\d\.\d\d) m, y = (\d\.\d\d) m\."
FAST = """from course import figures
from course.world.node import World
world = ros.start(World, parameters={'room': 'pillars', 'fast': True})
ros.start(AIRobotController, parameters={'use_sim_time': True})
print(world.node.drive(600.0, wall_limit=1.0).room)
figures.drive(world.node.simulation)"""

COMMANDS = """from geometry_msgs.msg import Twist
ros.stop()
ros.start(World, parameters={'room': 'hall'})
commands = ros.node.create_publisher(Twist, 'cmd_vel', 10)
slow = Twist()
slow.linear.x, slow.angular.z = 0.2, 9.0  # it turns as fast as it can
while True:
    commands.publish(slow)
    ros.until(lambda: False, 0.1)"""

CRASH = """import math
from course.world.node import latest
world = latest()
x, y, heading = world.simulation.pose
world.drop(x + 0.36 * math.cos(heading), y + 0.36 * math.sin(heading))
slow.linear.x, slow.angular.z = 0.3, 0.0
_ = ros.until(lambda: commands.publish(slow) or world.simulation.collisions, 60)"""
# The next pictures of the robot, as they are drawn: the scan's points (px), how many crosses, and how opaque the
# pieces of the trail are.
DRAWN = """async ([canvas, pictures]) => {
  const context = canvas.getContext('2d'), { fillRect, stroke } = context, drawn = [];
  const [red, grey] = ['hit', 'trail'].map(
    name => getComputedStyle(canvas).getPropertyValue(`--ros-robot-${name}`).trim());
  let points = [], crosses = 0, trail = [];
  context.fillRect = (x, y, width, height) => {
    points.push(...(width === 3 && height === 3 ? [[x + 1.5, y + 1.5]] : []));
    fillRect.call(context, x, y, width, height);
  };
  context.stroke = () => {
    crosses += context.strokeStyle === red;
    trail.push(...(context.strokeStyle === grey ? [context.globalAlpha] : []));
    stroke.call(context);
  };
  for (let before = canvas.dataset.frames; drawn.length < pictures; before = canvas.dataset.frames) {
    [points, crosses, trail] = [[], 0, []];
    while (canvas.dataset.frames === before) {
      await new Promise(requestAnimationFrame);
    }
    drawn.push({ points, crosses, trail });
  }
  delete context.fillRect;
  delete context.stroke;
  return drawn;
}"""


def pictures(canvas: Locator, count: int) -> list[dict]:
    """The next pictures of the robot: the scan's points, x, y (m), how many crosses, and the trail's opacities."""
    scale, left, bottom = view_of(canvas)
    found = canvas.evaluate(f"canvas => ({DRAWN})([canvas, {count}])")
    for each in found:
        each["points"] = [((x - left) / scale, (bottom - y) / scale) for x, y in each["points"]]
    return found


def open_view(page: Page, name: str) -> Locator:
    """Open the robot view by the launcher, and look at the notebook again."""
    page.get_by_title("New Launcher", exact=True).first.click()
    page.locator(".jp-LauncherCard:visible").get_by_text("Robot", exact=True).wait_for()
    cards = [each.strip() for each in page.locator(".jp-LauncherCard:visible").all_inner_texts()]
    tabs = page.locator(".jp-SideBar.jp-mod-right .lm-TabBar-tabLabel").all_inner_texts()
    assert [each for each in cards if each in PANELS] == PANELS
    assert [each for each in tabs if each in PANELS] == PANELS[:4]
    page.locator(".jp-LauncherCard:visible").get_by_text("Robot", exact=True).click()
    page.get_by_role("tab", name=f"{name}.ipynb").click()
    return page.get_by_role("tabpanel", name="Robot", exact=True)


def begin(page: Page, lab, name: str) -> Locator:
    """A notebook with a live session, and the robot view beside it."""
    (lab[2] / name).mkdir(exist_ok=True)
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    cells = [nbformat.v4.new_code_cell() for _ in range(3)]
    cells.append(nbformat.v4.new_markdown_cell("```mermaid\nsequenceDiagram\nclient->>server: request\n```"))
    nbformat.write(nbformat.v4.new_notebook(cells=cells, metadata=kernel), lab[2] / name / f"{name}.ipynb")
    open_page(page, lab, f"{name}/{name}.ipynb")
    view = open_view(page, name)
    expect(view).to_contain_text("Write and run a cell with ros = course.live()")  # there is none yet
    expect(view.get_by_role("button", name="course.live()")).to_have_count(0)
    run_cell(page, 0, "import course\nros = course.live()")
    expect(view).to_contain_text("No robot yet")
    return view


def start_world(view: Locator, room: str) -> Locator:
    """Start a world by the view; its canvas is returned when the robot is there."""
    view.get_by_label("Room").select_option(room)
    view.get_by_role("button", name="Start a world").click()
    expect(view).to_contain_text(f"room: {room}")
    expect(view.get_by_role("button", name="Pause")).to_be_visible()
    return view.locator("canvas")


def frames(canvas: Locator) -> int:
    return int(canvas.get_attribute("data-frames") or 0)


def heading(facts: Locator) -> int:
    """Return the robot's heading (degrees), as the view says it."""
    return int(re.search(r"([-−]?\d+)°", facts.inner_text())[1].replace("−", "-"))


def view_of(canvas: Locator) -> tuple[float, float, float]:
    """Return the scale of the picture (px in a metre), and the places of x = 0 and y = 0 (px)."""
    scale, left, bottom = map(float, str(canvas.get_attribute("data-view")).split())
    return scale, left, bottom


def place(canvas: Locator, x: float, y: float) -> tuple[float, float]:
    """Return where in the page a place of the room is, x, y (m)."""
    box, (scale, left, bottom) = canvas.bounding_box(), view_of(canvas)
    return box["x"] + left + scale * x, box["y"] + bottom - scale * y


@pytest.mark.long("all that can be done in the view, one after the other")
def test_a_student_drives_a_world_changes_it_by_hand_and_by_keys_while_a_cell_runs(lab, page):
    view = begin(page, lab, "driven")
    read, seen = page.locator(".jp-NotebookPanel:visible").bounding_box(), view.bounding_box()
    assert read["width"] > 690 and seen["width"] > 370  # px: what its text needs, and a picture
    expect_no_barriers(page, ".ros-Panel", "no-robot")
    canvas = start_world(view, "hall")
    run_cell(page, 1, DRIVER)
    expect(view).to_contain_text("driven by /ai_robot_controller")
    run_cell(page, 2, BUSY)
    page.locator('.jp-Notebook-ExecutionIndicator[data-status="busy"]').wait_for(state="attached")
    before = frames(canvas)
    expect(view.locator(".ros-Robot-facts")).to_contain_text("0.30 m/s")
    expect(view.locator(".ros-Robot-facts")).to_contain_text(re.compile("state(FORWARD|TURNING_LEFT|TURNING_RIGHT)"))
    page.wait_for_function(f"() => document.querySelector('.ros-Robot-canvas').dataset.frames > {before + 20}")

    canvas.focus()
    page.keyboard.press("Space")
    expect(view.get_by_role("button", name="Continue")).to_be_visible()
    expect(view.locator(".ros-Robot-said")).to_have_text("Paused.")
    page.keyboard.press("r")  # alone it is a letter that one may type by mistake
    page.keyboard.press("Control+Shift+C")
    page.locator(".lm-CommandPalette-input").wait_for()
    page.keyboard.press("Escape")
    expect(view.locator(".ros-Robot-said")).to_have_text("Paused.")
    canvas.focus()
    page.keyboard.press("Shift+R")
    expect(view).to_contain_text("back at its start")
    page.keyboard.press("ArrowRight")
    expect(view.locator(".ros-Robot-said")).to_contain_text("/ai_robot_controller drives now.")
    expect(view.get_by_role("button", name="Drive forward")).to_have_attribute("aria-disabled", "true")
    view.get_by_role("button", name="Move the robot").click()
    canvas.focus()
    page.keyboard.press("ArrowRight")
    expect(view).to_contain_text(re.compile(PUT))
    put = re.search(PUT, view.inner_text())
    page.keyboard.press("o")
    expect(view).to_contain_text("An obstacle was dropped.")
    page.keyboard.press("+")
    expect(view.get_by_label("Simulation speed")).to_have_value("2")
    box = canvas.bounding_box()
    at = place(canvas, float(put[1]), float(put[2]))
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    scale, left, bottom = view_of(canvas)
    wanted = [(box["width"] / 2 - left) / scale, (bottom - box["height"] / 2) / scale]
    page.mouse.move(*at)
    page.mouse.down()
    page.mouse.move(*middle, steps=5)
    page.mouse.up()
    page.wait_for_function("() => / put at x = /.test(document.querySelector('.ros-Robot-said').textContent)")
    put = re.search(PUT, view.inner_text())
    assert [float(put[1]), float(put[2])] == pytest.approx(wanted, abs=0.05)
    dropping, facts = view.get_by_role("button", name="Drop an obstacle"), view.locator(".ros-Robot-facts")
    assert dropping.bounding_box()["y"] < facts.bounding_box()["y"]  # near the picture, in which one clicks then
    tools = view.get_by_role("group", name="Arrow keys and mouse")
    dropping.click()
    page.mouse.click(*middle)
    expect(view).to_contain_text("No obstacle fits there: the robot stands there. Click in the room")
    expect(dropping).to_have_attribute("aria-pressed", "true")  # to be tried elsewhere
    expect(tools.locator("[aria-pressed='true']")).to_have_count(1)
    page.keyboard.press("Escape")
    expect(dropping).to_have_attribute("aria-pressed", "false")
    expect(view.get_by_role("button", name="Move the robot")).to_have_attribute("aria-pressed", "true")

    slider = view.get_by_label("obstacle_threshold")
    shown = slider.input_value()
    slider.focus()
    page.keyboard.press("ArrowRight")
    expect(slider).not_to_have_value(shown)
    (lab[2] / "driven/end").touch()
    wait_until_run(page)
    canvas.focus()
    page.keyboard.press("o")
    expect(view).to_contain_text("An obstacle was dropped.")
    run_cell(page, 1, SET)
    expect(slider).to_have_attribute("aria-valuetext", "2")
    expect(view.get_by_label("Room")).to_have_value("office")
    expect(view).not_to_contain_text("An obstacle was dropped.")
    view.get_by_label("Scanner").select_option("24 beams, the first one behind")
    run_cell(page, 2, BEAMS)
    page.locator(".jp-OutputArea-output pre").get_by_text("beams 24").wait_for()

    view.get_by_role("button", name="Continue").click()
    view.get_by_role("button", name="Reset").click()
    expect(view.locator(".ros-Robot-said")).to_contain_text("back at its start")
    expect(view.locator(".ros-Robot-said")).to_have_text("")  # it drives away from there
    view.get_by_role("button", name="Pause").click()
    view.get_by_role("button", name="Continue").click()
    expect(view.locator(".ros-Robot-said")).to_have_text("The world goes on.")
    run_cell(page, 2, "from course.world.node import World\n_ = ros.start(World)  # in place of the one that was")
    expect(view.locator(".ros-Robot-said")).to_have_text("")
    view.get_by_role("button", name="Pause").click()
    expect(view.locator(".ros-Robot-said")).to_have_text("Paused.")
    canvas.focus()
    page.keyboard.press("o")
    expect(view.locator(".ros-Robot-said")).to_have_text("An obstacle was dropped.")

    def is_refused() -> bool:  # the first one may lie where the robot looked before it stopped
        page.keyboard.press("o")
        return "No obstacle fits there" in view.locator(".ros-Robot-said").text_content()

    assert wait_until(is_refused, WAIT / 1e3)
    dropping.click()
    expect(view.locator(".ros-Robot-said")).to_contain_text("Click in the room, where the obstacle is to be")
    run_cell(page, 2, "ros.stop('world')")
    expect(view).to_contain_text("No robot any more.")
    expect(view.locator(".ros-Robot-said")).to_have_text("")
    expect(view).not_to_contain_text("driven by")
    expect(view.locator(".ros-Robot-facts")).to_have_class(re.compile("ros-mod-old"))
    ages = re.compile(r"measurednothing for (\d+) s.*no scanfor (\d+) s")
    expect(view.locator(".ros-Robot-facts")).to_contain_text(ages)
    measured, seen = map(int, ages.search(view.locator(".ros-Robot-facts").text_content()).groups())
    assert abs(measured - seen) <= 1  # s
    run_cell(page, 2, f"ros.stop('world')\n{DRIVER.splitlines()[0]}\n{FAST}")
    expect(view).to_contain_text("room: pillars")
    expect(view).to_contain_text("a world in fast mode runs as its cell says")
    page.locator(".jp-OutputArea-output pre").get_by_text("pillars").wait_for()
    # A world in fast mode stands still in the middle of the drive: its robot has a speed.
    expect(view.locator(".ros-Robot-facts")).to_contain_text(re.compile("none any more(?!: the robot has stopped)"))
    expect(view.locator(".ros-Robot-facts")).not_to_have_class(re.compile("ros-mod-old"))
    figure = page.locator("img.ros-figure")
    expect(figure).to_have_attribute("alt", re.compile("the robot"))
    diagram = page.locator(".jp-RenderedMermaid img")
    for theme, filtered in (("Light", "none"), ("Dark", "invert")):  # it is dark since the look for barriers
        drawn = diagram.get_attribute("src")
        canvas.evaluate(f"canvas => {{ canvas.seenBefore = '{theme}'; }}")
        set_theme(page, theme)
        assert figure.evaluate("image => getComputedStyle(image).filter").startswith(filtered)
        expect(diagram).not_to_have_attribute("src", drawn)
        assert canvas.evaluate("canvas => canvas.seenBefore") == theme  # and so the view has not begun anew

    run_cell(page, 2, COMMANDS)
    expect(view.locator(".ros-Robot-facts")).to_contain_text("command0.20 m/s")
    expect(view.locator(".ros-Robot-facts")).to_contain_text(f"measured0.20 m/s, {Robot().max_angular:.2f} rad/s")
    for each in pictures(canvas, 8):  # each point on a wall, or nearly all: a wrong heading shows at once
        off = [clearance(point, ROOMS["hall"].segments) for point in each["points"]]
        assert statistics.quantiles(off, n=20)[-1] < 0.05  # m
    assert len(each["trail"]) > 2 and each["trail"] == sorted(set(each["trail"]))  # the older, the fainter
    page.get_by_role("button", name="Interrupt the kernel").click()
    expect(view.locator(".ros-Robot-facts")).to_contain_text("none any more: the robot has stopped")
    run_cell(page, 2, "ros.stop('world')\n_ = ros.start(World, parameters={'room': 'pillars'})")
    expect(view).to_contain_text("room: pillars")
    expect(view.locator(".ros-Robot-facts")).to_contain_text(
        re.compile(r"commandnone(?! any)")
    )  # this world has had no command
    expect(view.locator(".ros-Robot-facts")).to_contain_text("driven by nobody")
    run_cell(page, 2, CRASH)
    expect(view.locator(".ros-Robot-facts")).to_contain_text("collisions1")
    assert pictures(canvas, 1)[0]["crosses"] == 1
    page.get_by_role("button", name="Restart the kernel", exact=True).click()
    page.get_by_role("dialog").get_by_role("button", name="Confirm Kernel Restart").click()
    expect(view).to_contain_text("The kernel was restarted, and its nodes have ended")
    wait_for_kernel(page)
    view.get_by_role("button", name="Run the first cell").click()
    expect(view).to_contain_text("No robot yet")
    canvas = start_world(view, "office")
    speeds = view.locator(".ros-Robot-facts")
    expect(speeds).to_contain_text("collisionsnone")
    assert pictures(canvas, 1)[0]["crosses"] == 0
    view.get_by_role("button", name="Drive", exact=True).click()
    expect(view.get_by_role("button", name="Drive forward")).to_have_attribute("aria-disabled", "false")
    canvas.focus()
    names = ("command", "position", "measured", "collisions")
    parts = [canvas, *(speeds.get_by_text(name, exact=True) for name in names)]
    places = [each.bounding_box() for each in parts]
    page.keyboard.down("ArrowUp")
    expect(speeds).to_contain_text("command0.30 m/s, 0.00 rad/s: forward")
    expect(speeds).to_contain_text("driven by you")
    assert [each.bounding_box() for each in parts] == places  # nothing jumps
    cell(page, 0).locator(".cm-content").click()  # the key is still down, and is the notebook's now
    expect(speeds).to_contain_text("none any more: the robot has stopped")
    page.keyboard.up("ArrowUp")
    for way in ("left", "right"):  # the second one takes the focus from the first
        view.get_by_role("button", name=f"Turn {way}").hover()
        page.mouse.down()
        expect(speeds).to_contain_text(f"turning {way}")
        before = heading(speeds)
        assert wait_until(lambda before=before: abs(heading(speeds) - before) > 20, WAIT / 1e3)  # it is still held
        page.mouse.up()
        expect(speeds).to_contain_text("none any more: the robot has stopped")
    whole = view_of(canvas)[0]
    for name in ("Zoom out", "Fit room"):
        expect(view.get_by_role("button", name=name)).to_have_attribute("aria-disabled", "true")
    view.get_by_role("button", name="Zoom in", exact=True).click()
    expect(view.get_by_text("Zoom in", exact=True).first).to_be_visible()  # `+` alone is the key for a faster world
    canvas.press("i")
    assert wait_until(lambda: view_of(canvas)[0] == pytest.approx(2.25 * whole, abs=0.01), WAIT / 1e3)
    for _ in range(5):
        canvas.press("i")
    expect(view.get_by_role("button", name="Zoom in")).to_have_attribute("aria-disabled", "true")
    view.get_by_role("button", name="Fit room").click()
    expect(view.get_by_role("button", name="Fit room")).to_have_attribute("aria-disabled", "true")
    expect(view.get_by_role("button", name="Zoom in")).to_have_attribute("aria-disabled", "false")
    assert wait_until(lambda: view_of(canvas)[0] == pytest.approx(whole, abs=0.01), WAIT / 1e3)
    run_from_palette(page, "ROS course", "Plot")
    plot = page.get_by_role("tabpanel", name="Plot", exact=True)
    plot.get_by_label("Topic").select_option("/scan")
    expect(plot.get_by_label("Field")).to_have_value("ranges[0]")
    plot.get_by_label("Topic").select_option("/odom")
    expect(plot.get_by_label("Field")).to_have_value("twist.twist.linear.x")
    plot.get_by_label("Field").fill("twist.twist.linear.q")
    plot.get_by_role("button", name="Add to the plot").click()
    expect(plot.get_by_text("/odom has no number twist.twist.linear.q: choose a field")).to_be_in_viewport()
    expect(plot.get_by_role("listitem")).to_have_count(0)
    plot.get_by_label("Field").fill("twist.twist.linear.x")
    expect(plot.get_by_label("Field")).to_have_value("twist.twist.linear.x")
    expect(plot.get_by_text("/odom has no number")).to_have_count(0)
    plot.get_by_role("button", name="Add to the plot").click()
    plot.get_by_label("Field").fill("pose.pose.position.x")
    plot.get_by_role("button", name="Add to the plot").click()
    first = plot.get_by_role("listitem").first.locator("output")
    expect(first).to_have_text("0 m/s")
    run_cell(page, 1, DRIVER)
    expect(first).to_have_text("0.3 m/s")
    removes = plot.get_by_role("button", name="Remove")
    assert removes.first.bounding_box()["x"] == removes.last.bounding_box()["x"]
    plot.get_by_label("Field").fill("seq")
    plot.get_by_role("button", name="Add to the plot").click()
    expect(plot.get_by_text("/odom has no number seq")).to_be_visible()
    plot.get_by_role("button", name="Pause").click()
    expect(plot.get_by_text("/odom has no number seq")).to_have_count(0)
    keep_picture(page, "plot")
    removes.last.click()
    plot.get_by_label("Scroll").press("Home")
    expect(plot.get_by_role("listitem").locator("output")).to_have_text("–")  # before the first
    with page.expect_download() as table:
        plot.get_by_role("button", name="Save as CSV").click()
    head, *rows = table.value.path().read_text().splitlines()
    page.evaluate(WRITTEN)
    assert head == '"world time since the plot began (s)","/odom twist.twist.linear.x"'
    assert -1.0 < float(rows[0].split(",")[0]) < 5.0  # it begins with the plot
    assert {0.0, 0.3} <= {round(float(row.split(",")[1]), 3) for row in rows}
    with page.expect_download() as picture:
        plot.get_by_role("button", name="Save as PNG").click()
    assert picture.value.path().read_bytes().startswith(b"\x89PNG")
    assert "▬ /odom twist.twist.linear.x (m/s)" in page.evaluate("window.written")
    expect_no_barriers(page, "#ros2-course-plot", "plot")
    page.get_by_role("tab", name="Plot", exact=True).locator(".lm-TabBar-tabCloseIcon").click()
    expect(view.get_by_label("obstacle_threshold")).to_be_visible()
    check_a_refusal(page, view)
    expect_no_barriers(page, ".ros-Panel", "robot")
    page.evaluate("() => document.body.appendChild(document.createElement('input')).focus()")  # for a terminal's input
    page.set_viewport_size({"width": 390, "height": 800})
    page.get_by_role("tab", name="Robot", exact=True).wait_for()  # on a narrow page it lies behind the notebook
    assert page.evaluate("() => document.activeElement === document.body.lastElementChild")
    page.get_by_role("tab", name="Robot", exact=True).click()
    page.wait_for_function("() => document.querySelector('.ros-Panel').getBoundingClientRect().right <= 390")
    assert view.evaluate("view => view.scrollWidth <= view.clientWidth")


# How far below the buttons the picture begins in a view beside an open panel, px.
NARROWEST = """view => {
  const { scrollTop, style } = view, before = style.width; // what is above the picture stays in sight
  view.scrollTop = 0;
  style.width = '190px';
  const [buttons, picture] = ['.ros-Robot-head button', '.ros-Robot-stage'].map(each => view.querySelector(each));
  const below = picture.getBoundingClientRect().top - buttons.getBoundingClientRect().bottom;
  style.width = before;
  view.scrollTop = scrollTop;
  return below;
}"""


def check_a_refusal(page, view) -> None:
    """The refusal of a parameter is scrolled to, and goes when another value is set, wherever that is done."""
    size = page.viewport_size
    page.set_viewport_size({"width": 1280, "height": 800})
    refusal = view.get_by_role("alert")
    view.get_by_label("noise").fill("-3")
    view.get_by_label("noise").press("Enter")
    expect(refusal).to_have_text(re.compile("^/world rejected the change: noise must be"))
    expect(refusal).to_be_in_viewport(ratio=0.99)
    keep_picture(page, "robot-refused")
    assert view.evaluate(NARROWEST) >= 0
    run_cell(page, 1, NOISE)
    expect(view.get_by_label("noise")).to_have_value("0.05")
    expect(refusal).to_have_count(0)
    page.set_viewport_size(size)


# What is written on canvases from now on.
WRITTEN = """() => {
  window.written = [];
  const { prototype } = CanvasRenderingContext2D, { fillText } = prototype;
  prototype.fillText = function (text, ...place) {
    window.written.push(text);
    fillText.call(this, text, ...place);
  };
}"""


def pieces(plot: Locator) -> int:
    """Return how many pieces of a line of the first colour a plot shows: parts without an empty column between."""
    return plot.locator("canvas").evaluate("""canvas => {
      const ratio = canvas.width / canvas.clientWidth, { width, height } = canvas;
      const [red, green, blue] = (hex => [1, 3, 5].map(at => parseInt(hex.slice(at, at + 2), 16)))(
        getComputedStyle(canvas).getPropertyValue('--ros-robot-front').trim());
      const { data } = canvas.getContext('2d').getImageData(0, 0, width, height);
      let found = 0, empty = 99;
      for (let x = Math.ceil(62 * ratio); x < width; x++) {
        let drawn = false;
        for (let y = 0; y < height; y++) {
          const at = 4 * (y * width + x);
          drawn ||= Math.abs(data[at] - red) + Math.abs(data[at + 1] - green) + Math.abs(data[at + 2] - blue) < 30;
        }
        found += drawn && empty > 3;
        empty = drawn ? 0 : empty + 1;
      }
      return found;
    }""")


def table_of(page, plot) -> list[list[str]]:
    """The rows of a plot that is saved as CSV, without the first."""
    with page.expect_download() as table:
        plot.get_by_role("button", name="Save as CSV").click()
    return [row.split(",") for row in table.value.path().read_text().splitlines()][1:]


@pytest.mark.matrix  # tests/browser/test_inspector.py loads a page again
def test_a_plot_is_there_again_when_its_page_is_loaded_again_until_it_is_closed(lab, page):
    view = begin(page, lab, "again")
    start_world(view, "hall")
    plot = page.get_by_role("tabpanel", name="Plot", exact=True)
    numbers = plot.get_by_role("listitem")

    def is_saved(request: Request) -> bool:
        return "/api/workspaces/" in request.url and "course-plot" in (request.post_data or "")

    with page.expect_request(is_saved):  # the layout, with the plot in it
        run_from_palette(page, "ROS course", "Plot")
    plot.get_by_label("Topic").select_option("/odom")
    plot.get_by_role("button", name="Add to the plot").click()
    expect(numbers.locator("output")).to_have_text("0 m/s")
    before = table_of(page, plot)
    page.goto(f"{lab[0]}/lab/tree/again/again.ipynb?token={lab[1]}")
    expect(numbers).to_contain_text("/odom twist.twist.linear.x")
    expect(numbers.locator("output")).to_have_text("0 m/s")
    after = table_of(page, plot)
    assert after[0] == before[0]
    assert {value for _, value in after} == {"0"}
    plot.get_by_role("button", name="Clear").click()
    plot.get_by_role("combobox", name="Show").select_option("10 s")
    plot.get_by_label("Topic").select_option("/odom")
    expect(plot.get_by_label("Field")).to_have_value("twist.twist.linear.x")  # its fields are known
    plot.get_by_label("Field").fill("seq")
    plot.get_by_role("button", name="Add to the plot").click()
    expect(plot).to_contain_text("/odom has no number seq")
    assert wait_until(lambda: pieces(plot) == 1, WAIT / 1e3)
    run_cell(page, 1, "ros.stop()")
    expect(plot).to_contain_text("No node publishes a topic now.")
    expect(plot).not_to_contain_text("/odom has no number seq")
    start_world(view, "hall")
    expect(numbers.locator("output")).to_have_text("0 m/s")
    assert wait_until(lambda: pieces(plot) == 2, WAIT / 1e3)
    keep_picture(page, "plot-gap")
    page.get_by_role("tab", name="Plot", exact=True).locator(".lm-TabBar-tabCloseIcon").click()
    run_from_palette(page, "ROS course", "Plot")
    expect(plot).to_contain_text("Choose a number of a topic")
    expect(numbers).to_have_count(0)
