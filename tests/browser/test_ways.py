"""The ways to the lab: the palette, the launcher, and the layout of the first start."""

import nbformat
from playwright.sync_api import expect

from course.foundation.waiting import wait_until
from tests.browser.conftest import WAIT
from tests.browser.pages import choose, open_page, run_from_palette, wait_for_kernel, write_greeter

expect.set_options(timeout=WAIT)


def test_the_start_page_has_robot_and_terminal_beside_it_and_stays_as_one_leaves_it(lab, page):
    address, token, served = lab
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    nbformat.write(nbformat.v4.new_notebook(metadata=kernel), served / "index.ipynb")
    page.goto(f"{address}/lab/tree/index.ipynb?token={token}&reset")
    terminal = page.locator(".jp-Terminal .xterm-screen")
    terminal.wait_for()
    robot = page.locator("#ros2-course-robot")
    notebook = page.locator(".jp-Notebook")
    for place in (robot, notebook):
        place.wait_for()
    read, seen, typed = (place.bounding_box() for place in (notebook, robot, terminal))
    assert min(seen["x"], typed["x"]) >= read["x"] + read["width"] - 1
    assert typed["y"] >= seen["y"] + seen["height"] - 1
    tab = page.locator(".lm-DockPanel-tabBar .lm-TabBar-tab").filter(has_text="Terminal")
    tab.locator(".lm-TabBar-tabCloseIcon").click()
    terminal.wait_for(state="detached")
    # JupyterLab saves its layout a moment later.
    saved = served.parent / "home/config/lab/workspaces"
    assert wait_until(
        lambda: any("arranged" in (text := path.read_text()) and "terminal:" not in text for path in saved.glob("*")),
        WAIT / 1e3,
    )
    page.goto(f"{address}/lab/tree/index.ipynb?token={token}")
    # On a narrow notebook it is folded away.
    page.locator('.jp-Notebook-ExecutionIndicator[data-status="idle"]').wait_for(state="attached")
    robot.wait_for()
    expect(tab).to_have_count(0)
    expect(terminal).to_have_count(0)


def test_a_notebook_opens_beside_notebooks_and_stays_in_front(lab, page):
    """Whatever is in front when it is opened; and when the page is loaded again, at the start page's address."""
    address, token, served = lab
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    link = nbformat.v4.new_markdown_cell("[the section](ways/ways.ipynb)")
    nbformat.write(nbformat.v4.new_notebook(cells=[link], metadata=kernel), served / "index.ipynb")
    write_greeter(served / "ways")
    page.goto(f"{address}/lab/tree/index.ipynb?token={token}&reset")
    terminal = page.locator(".jp-Terminal")
    terminal.wait_for()
    start = page.locator(".jp-NotebookPanel")
    start.wait_for()
    wait_for_kernel(page)
    wide = start.bounding_box()["width"]
    terminal.click()  # its corner is where the next document would open
    choose(page, "File", "Open from Path…")
    page.get_by_role("dialog").locator("input").fill("ways/ways.ipynb")
    page.get_by_role("dialog").get_by_role("button", name="Open").click()
    section = page.get_by_role("tab", name="ways.ipynb", exact=True)
    expect(section).to_have_attribute("aria-selected", "true")
    opened = page.locator(".jp-NotebookPanel:visible")
    expect(opened).to_have_count(1)
    assert opened.bounding_box()["width"] >= wide - 1
    expect(terminal).to_be_visible()
    saved = served.parent / "home/config/lab/workspaces"
    current = '"current":"notebook:ways/ways.ipynb"'
    assert wait_until(lambda: any(current in path.read_text() for path in saved.glob("*")), WAIT / 1e3), [
        path.read_text() for path in saved.glob("*")
    ]
    page.goto(f"{address}/?token={token}")
    expect(page.get_by_role("tab", name="index.ipynb", exact=True)).to_have_attribute("aria-selected", "false")
    expect(section).to_have_attribute("aria-selected", "true")


def test_palette_and_launcher_lead_to_terminal_and_panels(lab, page):
    _, _, served = lab
    write_greeter(served / "ways")
    open_page(page, lab, "ways/ways.ipynb")
    found = run_from_palette(page, "ROS course", "ROS terminal")
    assert {"ROS terminal", "Nodes", "Exercise", "Hand in"} <= found
    page.locator(".jp-Terminal .xterm-screen").wait_for()
    page.locator(".jp-Terminal").click()
    page.keyboard.type("pwd > where\n")
    assert wait_until((served / "ways/where").exists, WAIT / 1e3)  # in the notebook's folder
    choose(page, "File", "New Launcher")
    for name in ("Nodes", "Exercise"):
        page.locator(".jp-LauncherCard").filter(has_text=name).click()
        expect(page.get_by_role("region", name=name, exact=True)).to_be_visible()
