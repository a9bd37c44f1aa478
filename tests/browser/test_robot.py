"""The robot view in JupyterLab: a world is started, driven, changed by hand and by keys; a cell's drive; the themes."""

import re

import nbformat
import pytest
from playwright.sync_api import Locator, Page, expect

from tests.browser.conftest import WAIT
from tests.browser.pages import expect_no_barriers, open_page, run_cell, wait_for_kernel, wait_until_run

expect.set_options(timeout=WAIT)

DRIVER = """from course.nodes.ai_robot_controller import AIRobotController
ros.start(AIRobotController)"""
BUSY = "import pathlib\nwhile not pathlib.Path('end').exists(): pass"
PUT = r"The robot was put at x = (\d\.\d\d) m, y = (\d\.\d\d) m\."
FAST = """from course.world.node import World
world = ros.start(World, parameters={'room': 'pillars', 'fast': True})
ros.start(AIRobotController, parameters={'use_sim_time': True})
print(world.node.drive(600.0, wall_limit=5.0).room)"""

COMMANDS = """from geometry_msgs.msg import Twist
ros.stop()
ros.start(World, parameters={'room': 'hall'})
commands = ros.node.create_publisher(Twist, 'cmd_vel', 10)
slow = Twist()
slow.linear.x = 0.2
while True:
    commands.publish(slow)
    ros.until(lambda: False, 0.1)"""


def open_view(page: Page, name: str) -> Locator:
    """Open the robot view by the launcher, and look at the notebook again."""
    page.get_by_title("New Launcher", exact=True).first.click()
    page.locator(".jp-LauncherCard:visible").get_by_text("Robot", exact=True).click()
    page.get_by_role("tab", name=f"{name}.ipynb").click()
    return page.get_by_role("tabpanel", name="Robot", exact=True)


def begin(page: Page, lab, name: str) -> Locator:
    """A notebook with a live session, and the robot view beside it."""
    (lab[2] / name).mkdir(exist_ok=True)
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    cells = [nbformat.v4.new_code_cell() for _ in range(3)]
    nbformat.write(nbformat.v4.new_notebook(cells=cells, metadata=kernel), lab[2] / name / f"{name}.ipynb")
    open_page(page, lab, f"{name}/{name}.ipynb")
    view = open_view(page, name)
    expect(view).to_contain_text("Run the notebook’s first cell: ros = course.live()")
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


@pytest.mark.long("all that can be done in the view, one after the other")
def test_a_student_drives_a_world_changes_it_by_hand_and_by_keys_while_a_cell_runs(lab, page):
    view = begin(page, lab, "driven")
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
    expect(view.get_by_role("button", name="Pause")).to_have_attribute("aria-pressed", "true")
    page.keyboard.press("r")
    expect(view).to_contain_text("back at its start")
    page.keyboard.press("ArrowRight")
    expect(view).to_contain_text(re.compile(PUT))
    put = re.search(PUT, view.inner_text())
    page.keyboard.press("o")
    expect(view).to_contain_text("An obstacle was dropped.")
    page.keyboard.press("+")
    expect(view.get_by_label("Speed")).to_have_value("2")
    # The hall is 8 m by 6 m, in the middle of the canvas.
    box = canvas.bounding_box()
    scale = min((box["width"] - 28) / 8.0, (box["height"] - 28) / 6.0)
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(middle[0] + (float(put[1]) - 4.0) * scale, middle[1] - (float(put[2]) - 3.0) * scale)
    page.mouse.down()
    page.mouse.move(*middle, steps=5)
    page.mouse.up()
    expect(view).to_contain_text(re.compile(r"put at x = (3\.9\d|4\.0\d) m, y = (2\.9\d|3\.0\d) m"))
    view.get_by_role("button", name="Drop an obstacle").click()
    page.mouse.click(*middle)
    expect(view).to_contain_text("No obstacle fits there: the robot stands there.")

    slider = view.get_by_label("obstacle_threshold")
    shown = slider.input_value()
    slider.focus()
    page.keyboard.press("ArrowRight")
    expect(slider).not_to_have_value(shown)
    (lab[2] / "driven/end").touch()
    wait_until_run(page)
    run_cell(page, 1, "!ros2 param set /ai_robot_controller obstacle_threshold 2.0\n!ros2 param set /world room office")
    expect(slider).to_have_attribute("aria-valuetext", "2")
    expect(view.get_by_label("Room")).to_have_value("office")
    view.get_by_label("Scanner").select_option("24 beams, the first behind")
    run_cell(page, 2, "!ros2 param get /world beams")
    page.locator(".jp-OutputArea-output pre").get_by_text("Integer value is: 24").wait_for()

    run_cell(page, 2, f"ros.stop('world')\n{DRIVER.splitlines()[0]}\n{FAST}")
    expect(view).to_contain_text("room: pillars")
    expect(view).to_contain_text("a world in fast mode runs as its cell says")
    page.locator(".jp-OutputArea-output pre").get_by_text("pillars").wait_for()
    expect(view.locator(".ros-Robot-facts")).to_contain_text("stopped: no commands come")

    run_cell(page, 2, COMMANDS)
    expect(view.locator(".ros-Robot-facts")).to_contain_text("0.20 m/s")
    page.get_by_role("button", name="Interrupt the kernel").click()
    expect(view.locator(".ros-Robot-facts")).to_contain_text("stopped: no commands come")
    page.get_by_role("button", name="Restart the kernel", exact=True).click()
    page.get_by_role("dialog").get_by_role("button", name="Confirm Kernel Restart").click()
    expect(view).to_contain_text("The kernel was restarted, and its nodes have ended")
    wait_for_kernel(page)
    view.get_by_role("button", name="Run the first cell").click()
    expect(view).to_contain_text("No robot yet")
    start_world(view, "office")
    run_cell(page, 1, DRIVER)
    expect(view.get_by_label("obstacle_threshold")).to_be_visible()
    expect_no_barriers(page, ".ros-Panel", "robot")
    page.set_viewport_size({"width": 390, "height": 800})
    page.get_by_role("tab", name="Robot", exact=True).click()  # on a narrow page it lies behind the notebook
    page.wait_for_function("() => document.querySelector('.ros-Panel').getBoundingClientRect().right <= 390")
    assert view.evaluate("view => view.scrollWidth <= view.clientWidth")
