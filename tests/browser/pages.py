"""Actions in JupyterLab for tests of a page, and the exercise that they use."""

import os
import re
from collections.abc import Collection, Iterable
from pathlib import Path

import nbformat
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Locator, Page
from playwright.sync_api import TimeoutError as PlaywrightTimeout

SERVER = """import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Greeter(Node):
    def __init__(self):
        super().__init__('greeter')
        self.declare_parameter('word', 'hello')
        self.create_service(Trigger, 'greet', self.greet)

    def greet(self, request, response):
        response.success = True
        response.message = self.get_parameter('word').value
        self.get_logger().info('greeted')
        return response


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(Greeter())


main()
"""
TWIN = """import sys
import rclpy
from rclpy.node import Node

rclpy.init()
node = Node('twin')
said = sys.argv[1] if len(sys.argv) > 1 else 'inside'
node.create_timer(0.1, lambda: node.get_logger().info(said))
rclpy.spin(node)
"""
CHECK = """from std_srvs.srv import Trigger

assert ros.call('/greet', Trigger).message == 'hello', 'it must say hello'
print('as asked')"""


def mark(name: str, **more: object) -> dict:
    """nbgrader's mark on a cell."""
    plain = {"solution": False, "grade": False, "locked": False, "schema_version": 3, "cell_type": "code"}
    return {"nbgrader": plain | {"grade_id": name} | more}


THEMES = ("Dark", "Light")
WCAG = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]  # axe-core's names of the rules of WCAG 2.2 AA
OF_COLOURS = ["color-contrast", "link-in-text-block"]  # those of them that depend on the theme
FRAMES = """() => new Promise(done => {
  let frames = 0, worst = 0, last = performance.now();
  const draw = now => {
    worst = Math.max(worst, now - last);
    last = now;
    frames++ < 60 ? requestAnimationFrame(draw) : done(worst);
  };
  requestAnimationFrame(draw);
})"""
# A cell that runs until there is a file `end`.
BUSY = "import pathlib, time\nwhile not pathlib.Path('end').exists(): time.sleep(0.01)"
FILE, CHECKS = 2, 3  # the numbers of these cells in the greeter's notebook
# The second is called as in another language: a page is not to depend on English words.
HINTS = """Greet whoever asks.

<details><summary>Hint 1: where to look</summary>

Part 1 has a **server**.

</details>

<details><summary>Tipp 2: die Idee</summary>

One callback is enough.

</details>"""


def write_greeter(folder: Path, answer: str = SERVER, checks: Iterable[str] = ("greets",)) -> Path:
    """An exercise with one file, two hints, the checks, one by default, and one question, in a folder of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    sources = [
        ("import course\n\nros = course.live()", {}),
        (f"%%exercise greeter.py\n{answer}", mark("greeter-file", solution=True)),
        *((CHECK, mark(name, grade=True, locked=True, points=2)) for name in checks),
    ]
    question = mark("why", grade=True, solution=True, points=3) | {"deletable": False}
    cells = [nbformat.v4.new_code_cell(source, metadata=metadata) for source, metadata in sources]
    cells.append(nbformat.v4.new_markdown_cell("YOUR ANSWER HERE", metadata=question))
    cells.append(nbformat.v4.new_markdown_cell(HINTS))
    cells.insert(1, cells.pop())
    path = folder / f"{folder.name}.ipynb"
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    nbformat.write(nbformat.v4.new_notebook(cells=cells, metadata=kernel), path)
    return path


def open_page(page: Page, lab: tuple[str, str, Path], path: str) -> None:
    """Open a notebook of the served folder, and wait until its kernel is there."""
    address, token, _ = lab
    page.goto(f"{address}/lab/tree/{path}?token={token}&reset")
    page.get_by_role("tab", name=path.rpartition("/")[2]).wait_for()
    page.locator(".jp-Notebook .jp-Cell").first.wait_for()
    wait_for_kernel(page)


def wait_for_kernel(page: Page) -> None:
    """Wait until the kernel of the notebook that one looks at is connected and idle.

    The circle in the notebook's toolbar says "idle" before there is a kernel, too, and a cell that is run then is not
    run at all.
    """
    page.locator("#jp-main-statusbar").get_by_text(re.compile(r"\| Idle$")).wait_for()


def wait_until_run(page: Page) -> None:
    """Wait until no cell of the notebook runs any more, whatever one looks at."""
    page.locator('.jp-Notebook-ExecutionIndicator[data-status="idle"]').wait_for(state="attached")


def choose(page: Page, menu: str, *names: str) -> None:
    """Run a command of the menus, by the names on the way to it; a dialog in the way is told."""
    try:
        page.locator(".lm-MenuBar-itemLabel").get_by_text(menu, exact=True).click()
    except PlaywrightTimeout as error:
        error.add_note(f"dialogs: {page.get_by_role('dialog').all_inner_texts()}")
        raise
    for name in names:
        page.locator(".lm-Menu-itemLabel").get_by_text(name, exact=True).last.click()


def run_from_palette(page: Page, search: str, name: str) -> set[str]:
    """Run a command of the palette; returns all that the search has found.

    A notebook that has just been opened takes the focus when it is ready, which closes the palette: then once more.
    """
    labels = page.locator(".lm-CommandPalette-itemLabel")
    for _ in range(10):
        choose(page, "View", "Activate Command Palette")
        try:
            page.locator(".lm-CommandPalette-input").fill(search, timeout=10_000)
            labels.get_by_text(name, exact=True).wait_for(timeout=10_000)
            found = set(labels.all_inner_texts())
            labels.get_by_text(name, exact=True).click(timeout=10_000)
        except PlaywrightTimeout:
            continue
        return found
    raise AssertionError(f"the palette shows no {name} for {search!r}")


def cell(page: Page, number: int) -> Locator:
    """A cell of the notebook, counted from 0."""
    return page.locator(".jp-Notebook .jp-Cell").nth(number)


def write_cell(page: Page, number: int, source: str) -> Locator:
    """Write a cell of the notebook, counted from 0; its editor is returned.

    A notebook that becomes ready takes the focus: what was typed into another cell is typed again.
    """
    editor = cell(page, number).locator(".cm-content")
    first, _, _ = source.partition("\n")
    for _ in range(5):
        editor.click(position={"x": 4, "y": 4})  # not in the middle, where the toolbar of a small cell may lie
        page.keyboard.press("Control+A")
        page.keyboard.insert_text(source)
        if editor.locator(".cm-line").first.inner_text().strip() == first.strip():
            break
    return editor


def run_cell(page: Page, number: int, source: str) -> None:
    """Write a cell of the notebook, counted from 0, and run it."""
    write_cell(page, number, source).press("Shift+Enter")


def show_panel(page: Page, name: str) -> Locator:
    """Open a panel in the sidebar; it is returned."""
    page.get_by_role("tab", name=name, exact=True).click()
    panel = page.get_by_role("region", name=name, exact=True)
    panel.wait_for()
    return panel


def draws_within(page: Page, limit: float) -> bool:
    """Return True if in one of three series of 60 pictures no two are further apart than `limit` (ms).

    A page that is frozen shows it in each; what else the machine does, in one.
    """
    return any(page.evaluate(FRAMES) < limit for _ in range(3))


def set_theme(page: Page, theme: str) -> None:
    """JupyterLab's theme: Light or Dark."""
    choose(page, "Settings", "Theme", f"JupyterLab {theme}")
    page.locator(f"body[data-jp-theme-light='{str(theme == 'Light').lower()}']").wait_for(state="attached")


def keep_picture(page: Page, name: str) -> None:
    """Save what the page shows in the folder COURSE_PICTURES, if that is set, for a person to look at."""
    if folder := os.environ.get("COURSE_PICTURES"):
        Path(folder).mkdir(parents=True, exist_ok=True)
        page.screenshot(path=Path(folder) / f"{name}.png", animations="disabled")


def expect_no_barriers(page: Page, within: str, name: str) -> None:
    """Look at the part of the page that a selector names, at its colours in both themes, and keep a picture of each.

    The page is left in the other theme than it had.
    """
    light = page.locator("body").get_attribute("data-jp-theme-light") == "true"
    first, second = reversed(THEMES) if light else THEMES
    assert barriers(page, within) == []
    keep_picture(page, f"{name}-{first.lower()}")
    set_theme(page, second)
    assert barriers(page, within, OF_COLOURS) == []
    keep_picture(page, f"{name}-{second.lower()}")


def barriers(page: Page, within: str, rules: Collection[str] = ()) -> list[str]:
    """Return what axe-core finds in the part of the page that a selector names, by some rules or all of WCAG 2.2 AA."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(Axe().axe_script)
    only = {"type": "rule", "values": [*rules]} if rules else {"type": "tag", "values": WCAG}
    options = {"runOnly": only, "resultTypes": ["violations"]}
    found = page.evaluate("async ([within, options]) => (await axe.run(within, options)).violations", [within, options])
    return [
        f"{violation['id']}: {node['html'][:200]} ({node['failureSummary']})"
        for violation in found
        for node in violation["nodes"]
    ]
