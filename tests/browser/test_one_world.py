"""A new student in JupyterLab: the calculator's notebook, terminals beside it, a restart."""

from pathlib import Path

import nbformat
import pytest
from playwright.sync_api import Page

from course.foundation.waiting import wait_until
from tests.browser.conftest import WAIT
from tests.browser.pages import choose, open_page, run_from_palette, wait_for_kernel, wait_until_run

TABS = ("Formgrader", "Course List", "Create assignment", "Assignment List")


def run_all(page: Page) -> None:
    """Run the notebook's cells, and wait for what its exercises print."""
    choose(page, "Run", "Run All Cells")
    printed = page.locator(".jp-OutputArea-output pre")
    printed.get_by_text("calculator_server.py: written, running as /calculator_server").wait_for()
    printed.get_by_text("calculator_client.py: as asked").wait_for()
    wait_until_run(page)


def tabs(page: Page) -> set[str]:
    """Those of nbgrader's tabs that the commands of this JupyterLab open."""
    page.locator(".jp-Launcher").wait_for()
    page.keyboard.press("Control+Shift+C")
    page.locator(".lm-CommandPalette-input").wait_for()
    labels = page.locator(".lm-CommandPalette-itemLabel").all_inner_texts()
    page.locator(".lm-MenuBar-itemLabel").get_by_text("Help", exact=True).wait_for()
    assert "New Launcher" in labels
    return {tab for tab in TABS if any(tab.lower() in label.lower() for label in labels)}


def type_into_terminal(page: Page, folder: Path, command: str, name: str) -> str:
    """Type a command, with what it prints kept in a file; returns that when its exit status is there too."""
    terminal = page.locator(".jp-Terminal:visible")
    terminal.click()
    page.keyboard.type(f"({command}) > {name} 2>&1; echo $? > {name}.status\n")
    assert wait_until(
        lambda: (folder / f"{name}.status").exists() and (folder / f"{name}.status").read_text(), WAIT / 1e3
    )
    return (folder / name).read_text()


@pytest.mark.matrix  # the page runs under nbval, and test_a_terminal_follows_the_notebook_in_front meets a terminal
@pytest.mark.long("runs the whole page of the calculator")
def test_the_notebook_and_a_terminal_are_one_world(lab, page):
    _, _, folder = lab
    open_page(page, lab, "calculator.ipynb")
    run_all(page)
    choose(page, "File", "New", "Terminal")
    page.locator(".jp-Terminal .xterm-screen").wait_for()
    # The notebook's last cell ends its nodes: its server runs on in a terminal, as in the chapter.
    wait_until_run(page)
    terminal = page.locator(".jp-Terminal:visible")
    terminal.click()
    page.keyboard.type("python3 calculator_server.py & sleep 0\n")
    assert "/calculator\n" in type_until(page, folder, "ros2 service list", "/calculator\n")
    assert "18.7" in type_into_terminal(page, folder, "python3 calculator_client.py 15.5 3.2 add", "sum")
    assert (folder / "sum.status").read_text() == "0\n"
    refused = type_into_terminal(page, folder, "python3 calculator_client.py 10 0 divide", "refused")
    assert "zero" in refused.lower() and (folder / "refused.status").read_text() != "0\n"
    request = "{a: 100, b: 25, operation: 'subtract'}"
    call = f'ros2 service call /calculator calculator_interfaces/srv/Calculate "{request}"'
    assert "result=75.0" in type_into_terminal(page, folder, call, "called")


def type_until(page: Page, folder: Path, command: str, wanted: str) -> str:
    """Type a command until it prints what is wanted."""
    for attempt in range(20):
        if wanted in (said := type_into_terminal(page, folder, command, f"look{attempt}")):
            break
    return said


@pytest.mark.matrix  # tests/course/test_shell.py has it without a browser
def test_after_a_restart_the_interface_can_be_imported(lab, page):
    open_page(page, lab, "calculator.ipynb")
    run_all(page)
    choose(page, "Kernel", "Restart Kernel…")
    page.locator(".jp-Dialog-button.jp-mod-accept").click()
    page.locator(".jp-Dialog").wait_for(state="detached")
    choose(page, "File", "New Console for Notebook")
    prompt = page.locator(".jp-CodeConsole-input .cm-content")
    prompt.click()
    page.keyboard.type("from calculator_interfaces.srv import Calculate; print('found', Calculate.Request().a)")
    page.keyboard.press("Shift+Enter")
    page.locator(".jp-CodeConsole .jp-OutputArea-output pre").get_by_text("found 0.0").wait_for()


def test_instructors_and_developers_see_all_of_nbgrader_but_what_needs_an_exchange(lab, page):
    address, token, _ = lab
    page.goto(f"{address}/lab?token={token}&reset")
    assert tabs(page) == {"Formgrader", "Course List", "Create assignment"}


@pytest.mark.matrix  # tests/course/test_shell.py has it without a browser
def test_a_terminal_follows_the_notebook_in_front(lab, page):
    address, token, served = lab
    source = "import course\nros = course.live()\nopen('domain', 'w').write(str(ros.domain_id))\nprint('live')"
    for name in ("one", "two"):
        (served / name).mkdir()
        notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source)])
        notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3"}
        nbformat.write(notebook, served / name / f"{name}.ipynb")

    def run() -> None:
        choose(page, "Run", "Run All Cells")
        page.locator(".jp-NotebookPanel:visible .jp-OutputArea-output pre").get_by_text("live").wait_for()

    def domain(name: str) -> str:
        """Return the ROS domain of the terminal that is typed into, once it has shown its prompt."""
        (served / name).unlink(missing_ok=True)
        page.locator(".jp-Terminal:visible").click()
        page.keyboard.type(f"echo $ROS_DOMAIN_ID > {served}/{name}\n")
        assert wait_until(lambda: (served / name).exists() and (served / name).read_text(), WAIT / 1e3)
        return (served / name).read_text().strip()

    def bring(tab: str) -> None:
        page.locator(".lm-DockPanel-tabBar .lm-TabBar-tab").filter(has_text=tab).click()

    open_page(page, lab, "one/one.ipynb")
    run()
    with page.expect_request(
        lambda request: "/api/workspaces/" in request.url and "terminal:" in (request.post_data or "")
    ):
        run_from_palette(page, "ROS course", "ROS terminal")  # which a page that is loaded later finds there
    page.locator(".jp-Terminal .xterm-screen").wait_for()
    first = (served / "one/domain").read_text()
    assert domain("terminal") == first
    page.goto(f"{address}/lab/tree/two/two.ipynb?token={token}")
    wait_for_kernel(page)
    run()
    second = (served / "two/domain").read_text()
    assert second != first
    bring("Terminal")
    assert domain("terminal") == second
    for name, wanted in (("one", first), ("two", second)):
        with page.expect_response(lambda answer: answer.url.partition("?")[0].endswith("/course/front")):
            bring(f"{name}.ipynb")
        bring("Terminal")
        assert domain("terminal") == wanted
