"""The ways to the lab: the palette, the launcher, the layout of the first start, and what comes beside a section."""

import nbformat
import pytest
from playwright.sync_api import Page, expect

from course.foundation.waiting import wait_until
from tests.browser.conftest import ROOT, WAIT
from tests.browser.pages import (
    CHECKS,
    cell,
    choose,
    keep_picture,
    open_page,
    run_cell,
    run_from_palette,
    wait_for_kernel,
    write_cell,
    write_greeter,
)

expect.set_options(timeout=WAIT)

ROW = 15  # px, of a terminal
LINES = """each => {
  const range = document.createRange();
  range.selectNodeContents(each);
  return new Set([...range.getClientRects()].map(line => Math.round(line.bottom))).size;
}"""


@pytest.mark.matrix  # tests/browser/test_handing_in.py works in a terminal below a notebook
def test_the_start_page_has_a_strip_of_a_terminal_below_it_and_stays_as_one_leaves_it(lab, page):
    address, token, served = lab
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    given = nbformat.read(ROOT / "notebooks/index.ipynb", 4)
    for each in given.cells:
        each.update({"outputs": []} if each.cell_type == "code" else {})
    nbformat.write(given, served / "index.ipynb")
    size = page.viewport_size
    page.set_viewport_size({"width": 1280, "height": 800})
    page.goto(f"{address}/lab/tree/index.ipynb?token={token}&reset")
    terminal = page.locator(".jp-Terminal .xterm-screen")
    notebook = page.locator(".jp-Notebook")
    notebook.wait_for()
    check_the_first_screen(page)
    page.set_viewport_size(size)
    page.get_by_role("button", name="Bigger").wait_for()
    tabs = "document.querySelector('.lm-DockPanel-tabBar:has(.ros-Strip-button)').getBoundingClientRect()"
    main = "document.querySelector('#jp-main-dock-panel').getBoundingClientRect()"
    page.wait_for_function(f"() => {main}.bottom - {tabs}.bottom < 12")  # it is folded to its tab

    def expect_height(low: int, high: int) -> None:
        """Wait until the terminal shows so many rows."""
        assert wait_until(lambda: low * ROW <= terminal.bounding_box()["height"] <= high * ROW, WAIT / 1e3)
        read, typed = notebook.bounding_box(), terminal.bounding_box()
        assert typed["y"] >= read["y"] + read["height"] - 1
        assert typed["width"] >= 0.9 * read["width"]

    page.get_by_role("button", name="Bigger").click()
    page.locator(".jp-Terminal:focus-within").wait_for()  # what one types goes into it
    expect_height(25, 45)
    terminal.click()  # it stays tall: one works in it
    page.get_by_role("button", name="Smaller").click()
    expect_height(4, 6)
    tab = page.locator(".lm-DockPanel-tabBar .lm-TabBar-tab").filter(has_text="Terminal")
    tab.click()
    expect_height(25, 45)
    tab.click()
    expect_height(4, 6)
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
    expect(tab).to_have_count(0)
    expect(terminal).to_have_count(0)
    # environment/install disables the question about news, and the look for updates that comes with it.
    assert [url for url in asked if "/lab/api/update" in url or "/lab/api/news" in url] == []


@pytest.mark.matrix  # the test above has the start page alone
def test_a_start_page_that_is_opened_beside_a_terminal_brings_no_second_one(lab, page):
    served = lab[2]
    write_greeter(served / "before")
    nbformat.write(nbformat.v4.new_notebook(), served / "index.ipynb")
    open_page(page, lab, "before/before.ipynb")
    run_from_palette(page, "ROS course", "ROS terminal")
    page.locator(".jp-Terminal .xterm-screen").wait_for()
    choose(page, "File", "Open from Path…")
    page.get_by_role("dialog").locator("input").fill("index.ipynb")
    page.get_by_role("dialog").get_by_role("button", name="Open").click()
    saved = served.parent / "home/config/lab/workspaces"

    def is_arranged() -> bool:
        """Return True once JupyterLab has saved the layout, a moment after it was arranged."""
        texts = [path.read_text() for path in saved.glob("*")]
        return page.title() != "" and any(
            'course:arranged"' in text and '"current":"notebook:index.ipynb"' in text for text in texts
        )

    assert wait_until(is_arranged, WAIT / 1e3)
    expect(page.locator(".lm-DockPanel-tabBar .lm-TabBar-tab").filter(has_text="Terminal")).to_have_count(1)


def check_the_first_screen(page: Page) -> None:
    """See what the start page is, its sections and its button, without scrolling; the button checks the machine."""
    first = cell(page, 0).locator(".jp-RenderedMarkdown")
    title, table = first.locator("h1"), first.locator("table")
    page.get_by_role("button", name="Bigger").wait_for()  # the terminal has its place
    keep_picture(page, "first-screen")
    button = first.get_by_role("button", name="Check this machine")
    for each in (title, first.locator("p").first, button, table):
        expect(each).to_be_in_viewport(ratio=1)
    for each in (title, *table.locator("td:first-child").all()):
        assert each.evaluate(LINES) == 1
    button.click()
    printed = page.locator(".jp-Cell").filter(has_text="course doctor --brief").locator(".jp-OutputArea-output").first
    expect(printed).to_contain_text("ok  interpreter")
    expect(printed).to_be_in_viewport()


@pytest.mark.matrix  # each other test opens a notebook by its address
@pytest.mark.long("all ways to open a notebook")
def test_a_notebook_opens_beside_notebooks_and_stays_in_front(lab, page):
    """Whatever is in front when it is opened; and when the page is loaded again, at the start page's address."""
    address, token, served = lab
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    link = nbformat.v4.new_markdown_cell("[the section](ways/ways.ipynb), [a draft](draft/draft.ipynb)")
    nbformat.write(nbformat.v4.new_notebook(cells=[link], metadata=kernel), served / "index.ipynb")
    write_greeter(served / "ways")
    prompts: list[str] = []
    page.on("websocket", lambda socket: socket.on("framereceived", lambda frame: prompts.append(str(frame))))
    page.goto(f"{address}/lab/tree/index.ipynb?token={token}&reset")
    terminal = page.locator(".jp-Terminal")
    start = page.locator(".jp-NotebookPanel")
    start.wait_for()
    wait_for_kernel(page)
    start.get_by_role("link", name="a draft").click()
    expect(page.get_by_text("draft/draft.ipynb is not here")).to_be_visible()
    wide = start.bounding_box()["width"]
    page.get_by_role("button", name="Bigger").click()  # it is folded below the start page
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
    # Its prompt, which is there already, goes to the notebook's folder.
    assert wait_until(lambda: page.title() and "ways (domain" in "".join(prompts), WAIT / 1e3), prompts[-5:]
    saved = served.parent / "home/config/lab/workspaces"
    current = '"current":"notebook:ways/ways.ipynb"'
    assert wait_until(lambda: any(current in path.read_text() for path in saved.glob("*")), WAIT / 1e3), [
        path.read_text() for path in saved.glob("*")
    ]
    page.goto(f"{address}/?token={token}")
    expect(page.get_by_role("tab", name="index.ipynb", exact=True)).to_have_attribute("aria-selected", "false")
    expect(section).to_have_attribute("aria-selected", "true")


WORLD = "from course.world.node import World\nros.start(World)\nprint('there')"
AWAY = """from pathlib import Path
from course.lab.kernel import traffic
ros.stop()
assert ros.until(lambda: not ros.node.count_publishers('/scan'), 60.0)
traffic._arrival = traffic.Arrival()  # as in a new kernel
Path('ready').touch()
assert ros.until(Path('away').exists, 60.0)
ros.start(World)
assert ros.until(lambda: ros.node.count_publishers('/scan'), 60.0)
traffic._arrival.look(ros)
Path('started').touch()"""
LONG = f"def long():\n    return ({' + '.join(['1234567'] * 20)})"
# Where the rows of an editor's last line begin, px from its left edge.
ROWS = """editor => {
  const range = document.createRange();
  range.selectNodeContents([...editor.querySelectorAll('.cm-line')].pop());
  const rows = new Map();
  for (const { left, bottom } of range.getClientRects()) {
    rows.set(Math.round(bottom), Math.min(left, rows.get(Math.round(bottom)) ?? left));
  }
  return [...rows.values()].map(left => left - editor.getBoundingClientRect().left);
}"""
LOOKED = """from comm import get_comm_manager
from course.lab.kernel import traffic
assert not [each for each in get_comm_manager().comms.values() if 'robot' in each.target_name], 'no page took the news'
ros.start(World)
assert ros.until(lambda: ros.node.count_publishers('/scan'), 60.0)
traffic._arrival.look(ros)
print('looked')"""  # what is told of it has come to the page before this is printed


def test_on_a_narrow_page_the_notebook_has_the_room_and_each_panel_is_opened_entered_and_left_by_keys_alone(lab, page):
    write_greeter(lab[2] / "keys")
    size = page.viewport_size
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto(f"{lab[0]}/lab/tree/keys/keys.ipynb?token={lab[1]}&reset")
    page.wait_for_function("() => document.querySelector('.jp-NotebookPanel')?.getBoundingClientRect().width > 280")
    page.set_viewport_size({"width": 640, "height": 400})  # one of 1280 px at 200 %
    for name in ("Exercise", "Nodes", "Inspector", "Graph"):
        tab = page.get_by_role("tab", name=name, exact=True)
        tab.scroll_into_view_if_needed()
        expect(tab).to_be_in_viewport(ratio=0.95)  # but for a part of a pixel
    keep_picture(page, "tabs-of-a-low-page")
    page.set_viewport_size(size)
    wait_for_kernel(page)
    within = "each => each.contains(document.activeElement)"
    notebook = page.locator(".jp-NotebookPanel:visible")
    page.locator(".jp-Cell").first.click()
    for name in ("Nodes", "Exercise", "Inspector", "Graph", "Robot", "Plot"):
        page.keyboard.press("Control+Shift+C")
        page.locator(".lm-CommandPalette-input").wait_for()
        page.keyboard.type(f"ROS course {name}")
        found = page.locator(".lm-CommandPalette-item.lm-mod-active .lm-CommandPalette-itemLabel")
        expect(found).to_have_text(name)
        page.keyboard.press("Enter")
        panel = page.locator(f".ros-Panel[aria-label='{name}']")
        expect(panel).to_be_focused()
        if name == "Nodes":
            expect(panel.get_by_role("button", name="Run the first cell")).to_be_visible()
            page.keyboard.press("Tab")
            expect(panel.locator(":focus")).to_have_count(1)
        page.keyboard.press("Escape")
        expect(page.locator(".ros-Panel:focus-within")).to_have_count(0)
        assert wait_until(lambda: notebook.evaluate(within), WAIT / 1e3), name


@pytest.mark.matrix  # tests/browser/test_robot.py begins with a world's robot beside the notebook
def test_when_a_world_starts_the_robot_appears_once_beside_the_notebook_which_keeps_focus_and_room(lab, page):
    page.set_viewport_size({"width": 1920, "height": 1080})
    write_greeter(lab[2] / "appears")
    open_page(page, lab, "appears/appears.ipynb")
    expect(page.get_by_role("region", name="Nodes", exact=True)).to_be_visible()  # there is room for it
    expect(page.locator(".jp-DirListing")).to_be_hidden()
    page.set_viewport_size({"width": 1280, "height": 800})
    page.get_by_role("tab", name="Nodes", exact=True).click()
    run_cell(page, 0, "import course\nros = course.live()")
    run_cell(page, CHECKS, WORLD)
    robot = page.get_by_role("tabpanel", name="Robot", exact=True)
    expect(robot).to_contain_text("room: hall")
    notebook = page.locator(".jp-NotebookPanel:visible")
    assert notebook.evaluate("panel => panel.contains(document.activeElement)")
    assert notebook.bounding_box()["width"] >= 690  # px
    expect(page.get_by_role("tab", name="appears.ipynb")).to_have_attribute("aria-selected", "true")

    # A long line is wrapped, further to the right than it begins.
    editor = write_cell(page, CHECKS, LONG)
    assert wait_until(lambda: len(editor.evaluate(ROWS)) > 2, WAIT / 1e3)
    first, *others = editor.evaluate(ROWS)
    assert all(each > first + 50 for each in others)
    assert editor.evaluate("each => each.parentElement.scrollWidth <= each.parentElement.clientWidth")

    run_from_palette(page, "ROS course", "Plot")
    page.get_by_role("tabpanel", name="Plot", exact=True).wait_for()
    # Beside both, the notebook's toolbar has what one looks for.
    page.get_by_role("tab", name="Nodes", exact=True).click()
    expect(page.get_by_role("region", name="Nodes", exact=True)).to_be_visible()
    toolbar = notebook.locator(".jp-NotebookPanel-toolbar")
    assert notebook.bounding_box()["width"] < 620  # px
    for name in ("hand-in", "runAll", "kernelName", "executionProgress"):
        expect(toolbar.locator(f":scope > [data-jp-item-name='{name}']"), name).to_be_in_viewport(ratio=1)
    expect(toolbar.locator(":scope > [data-jp-item-name='cellType']")).to_have_count(0)  # it is behind "..."
    page.get_by_role("tab", name="Nodes", exact=True).click()

    pad = robot.get_by_role("group", name="Drive", exact=True)
    for low in ("beside the picture", "below it, where a panel leaves the robot little room"):
        expect(pad.get_by_role("button", name="Drive backward"), low).to_be_in_viewport(ratio=1)
        expect(pad.get_by_role("slider"), low).to_be_in_viewport(ratio=1)
        page.get_by_role("tab", name="Nodes", exact=True).click()

    page.get_by_role("tab", name="Robot", exact=True).locator(".lm-TabBar-tabCloseIcon").click()
    run_cell(page, CHECKS, LOOKED)
    looked = page.locator(".jp-OutputArea-output pre").get_by_text("looked")
    looked.wait_for()
    assert (
        looked.evaluate("each => getComputedStyle(each).wordBreak") == "normal"
    )  # long lines are broken between words
    expect(robot).to_have_count(0)
    # If one opens it, it lies above the plot, which keeps its width.
    plot = page.get_by_role("tabpanel", name="Plot", exact=True)
    width = plot.bounding_box()["width"]
    run_from_palette(page, "ROS course", "Robot")
    robot.wait_for()
    assert robot.bounding_box()["width"] == plot.bounding_box()["width"] == width
    assert robot.bounding_box()["y"] < plot.bounding_box()["y"]
    page.get_by_role("tab", name="Robot", exact=True).locator(".lm-TabBar-tabCloseIcon").click()

    # A page that is loaded again asks the kernel before it runs a cell.
    def load_again() -> None:
        page.goto(f"{lab[0]}/lab/tree/appears/appears.ipynb?token={lab[1]}")
        wait_for_kernel(page)

    saved = lab[2].parent / "home/config/lab/workspaces"
    assert wait_until(lambda: not any("course-robot" in path.read_text() for path in saved.glob("*")), WAIT / 1e3)
    load_again()
    run_cell(page, CHECKS, "print('loaded', 'again')")
    page.locator(".jp-OutputArea-output pre").get_by_text("loaded again").wait_for()
    expect(robot).to_have_count(0)
    # A world that starts while no page is there is shown when one is.
    page.get_by_role("tab", name="Plot", exact=True).locator(".lm-TabBar-tabCloseIcon").click()
    assert wait_until(lambda: not any("course-plot" in path.read_text() for path in saved.glob("*")), WAIT / 1e3)
    folder = lab[2] / "appears"
    run_cell(page, CHECKS, AWAY)
    assert wait_until((folder / "ready").exists, WAIT / 1e3)
    page.goto("about:blank")
    (folder / "away").touch()
    assert wait_until((folder / "started").exists, WAIT / 1e3)
    load_again()
    expect(robot).to_contain_text("room: hall")
    assert notebook.evaluate("panel => panel.contains(document.activeElement)")


@pytest.mark.matrix  # each panel is opened by its own test
def test_palette_and_launcher_lead_to_terminal_and_panels(lab, page):
    _, _, served = lab
    write_greeter(served / "ways")
    shown: list[str] = []  # what the terminal prints; the page draws it on a canvas
    page.on("websocket", lambda socket: "/terminals/" in socket.url and socket.on("framereceived", keep))

    def keep(frame: str | bytes) -> None:
        shown.append(str(frame))

    open_page(page, lab, "ways/ways.ipynb")
    found = run_from_palette(page, "ROS course", "ROS terminal")
    assert {"ROS terminal", "Nodes", "Exercise", "Hand in"} <= found
    page.locator(".jp-Terminal .xterm-screen").wait_for()
    page.locator(".jp-Terminal").click()
    page.keyboard.type("pwd > where\n")
    assert wait_until((served / "ways/where").exists, WAIT / 1e3)  # in the notebook's folder
    # Its prompt names the notebook's domain before one types again.
    run_cell(page, 0, "import course\nros = course.live()\nprint('in domain', ros.domain_id)")
    printed = page.locator(".jp-OutputArea-output pre").get_by_text("in domain").inner_text()
    wanted = f"ways ({printed.strip().removeprefix('in ')})"
    assert wait_until(lambda: page.title() and wanted in "".join(shown), WAIT / 1e3), shown
    choose(page, "File", "New Launcher")
    for name in ("Nodes", "Exercise"):
        page.locator(".jp-LauncherCard").filter(has_text=name).click()
        expect(page.get_by_role("region", name=name, exact=True)).to_be_visible()
    page.locator(".lm-TabBar-tab").filter(has_text="Launcher").locator(".lm-TabBar-tabCloseIcon").click()
    page.set_viewport_size({"width": 390, "height": 844})  # a terminal leaves it room on a phone
    box = "document.querySelector('#ros2-course-exercise').getBoundingClientRect()"
    page.wait_for_function(f"() => {box}.width >= 200 && {box}.right <= 390")
