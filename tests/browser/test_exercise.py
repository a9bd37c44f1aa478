"""The exercise panel in JupyterLab: checks, hints by grade, what was edited since its last run, reset."""

import re
import shutil

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import WAIT
from tests.browser.pages import (
    BUSY,
    FILE,
    SERVER,
    cell,
    choose,
    expect_no_barriers,
    open_page,
    run_cell,
    show_panel,
    wait_for_kernel,
    wait_until_run,
    write_cell,
    write_greeter,
)

expect.set_options(timeout=WAIT)
STUB = "# say hello\n"
# Whether a long message about a check would have the whole width of the panel, below the button.
BELOW = """item => {
  const [part, button] = [item.querySelector('.ros-part'), item.querySelector('button')];
  const text = part.appendChild(document.createTextNode(' and so on'.repeat(30)));
  const lines = [...part.getClientRects()];
  text.remove();
  const edge = button.getBoundingClientRect();
  return lines.some(line => line.top >= edge.bottom && line.right > edge.left);
}"""


def begin(page, lab, name, checks=("greets",)):
    """The exercise in a course's folder, with what was handed out beside it; no cell has run yet."""
    course = lab[2] / name
    released = write_greeter(course / ".released/greeter", answer=STUB, checks=checks)
    (course / "greeter").mkdir(exist_ok=True)
    shutil.copy(released, course / "greeter")
    open_page(page, lab, f"{name}/greeter/greeter.ipynb")
    return show_panel(page, "Exercise")


def type_answer(page, text):
    write_cell(page, FILE, f"%%exercise greeter.py\n{text}")


@pytest.mark.long("a whole exercise, from the stub to the answer")
def test_a_student_is_told_step_by_step_how_far_the_exercise_is_and_everybody_can_read_it(lab, page):
    panel = begin(page, lab, "steps")
    checks = panel.get_by_role("list", name="Checks and questions")
    expect(panel).to_contain_text("not written yet: run its cell")
    expect(checks).to_contain_text("greets: not run (up to 2 points)")
    expect(checks).to_contain_text("why: not answered (up to 3 points)")
    expect(panel).to_contain_text("0 of 2 parts done")
    type_answer(page, SERVER.replace("'hello'", "'goodbye'"))
    choose(page, "Run", "Run All Cells")
    expect(panel).to_contain_text("the same as in its cell")
    expect(checks).to_contain_text("✗greets: not yet: it must say hello")
    assert checks.get_by_role("listitem").first.evaluate(BELOW)
    type_answer(page, SERVER)
    expect(panel).to_contain_text("edited since it was run")
    panel.get_by_role("button", name="Run the cell of greeter.py").click()
    expect(panel).to_contain_text("the same as in its cell")
    expect(checks).to_contain_text("greets: run it again: greeter.py was written again since")
    run_cell(page, 0, BUSY)
    panel.get_by_role("button", name="Run all checks").click()
    expect(checks).to_contain_text("…greets: waiting for the cell that runs")
    (lab[2] / "steps/greeter/end").touch()
    expect(checks).to_contain_text("✓greets: passed")
    expect(panel).to_contain_text("1 of 2 parts done: so far 2 of 5 points at most")
    # What changes on the disk is seen, and told from a change of the cell.
    (lab[2] / "steps/greeter/greeter.py").write_text(f"{SERVER}# by hand\n")
    expect(panel).to_contain_text("the file was edited, its cell was not")
    expect(checks).to_contain_text("greets: changed since the check: greeter.py")
    panel.get_by_role("button", name="Run all checks").click()
    expect(checks).to_contain_text("✓greets: passed")
    panel.get_by_role("button", name="Run the cell of greeter.py").click()
    expect(cell(page, FILE)).to_contain_text("what it contained is now in greeter.edited-1.py")
    expect(checks).to_contain_text("greets: run it again: greeter.py was written again since")
    type_answer(page, SERVER.replace("def main(args=None):", "def main(args=None)"))
    panel.get_by_role("button", name="Run the cell of greeter.py").click()
    expect(panel).to_contain_text(
        "its cell had an error when it was last run, and nothing was written: greeter.py, line"
    )
    type_answer(page, SERVER)
    panel.get_by_role("button", name="Run the cell of greeter.py").click()
    expect(panel).to_contain_text("the same as in its cell")
    # Hints come one after the other, and are drawn as in the notebook.
    expect(panel).to_contain_text("Tipp 2: open the hint before it first")
    expect(panel.get_by_text("One callback is enough.")).to_have_count(0)
    panel.get_by_text("Hint 1: where to look").click()
    expect(panel.locator(".ros-hint strong")).to_have_text("server")
    show_panel(page, "Nodes")
    expect(panel).to_have_count(0)
    show_panel(page, "Exercise")
    expect(panel.locator(".ros-hint strong")).to_be_visible()
    panel.get_by_text("Tipp 2: die Idee").click()
    expect(panel.get_by_text("One callback is enough.")).to_be_visible()
    type_answer(page, STUB)
    expect(panel).to_contain_text("edited since it was run")
    expect_no_barriers(page, "#ros2-course-exercise", "exercise")
    name = panel.locator(".ros-File h3")
    height = name.bounding_box()["height"]
    name.locator("code").evaluate("each => { each.firstChild.nodeValue = 'calculator_server.py'; }")
    assert name.bounding_box()["height"] == height  # a name is whole: the buttons lie below it
    page.set_viewport_size({"width": 390, "height": 800})
    assert panel.evaluate("panel => panel.scrollWidth <= panel.clientWidth")


def test_an_interruption_and_a_restart_end_all_checks_and_a_reset_brings_the_stub_back(lab, page):
    """A running check ends, and so does one that waits for another cell; a new kernel knows no cells of the old one.

    A reset keeps what was written.
    """
    panel = begin(page, lab, "ended", checks=("greets", "later"))
    checks = panel.get_by_role("list", name="Checks and questions")

    def expect_no_further_check(said: str) -> None:
        """Wait until no check runs, and run a cell behind all that were asked for."""
        expect(checks).not_to_contain_text(re.compile("running|waiting"))
        wait_for_kernel(page)
        run_cell(page, 0, f"print('{said}')")
        expect(cell(page, 0)).to_contain_text(f"{said}\n")
        expect(checks).to_contain_text("later: not run")

    for number, busy in enumerate((0, FILE + 1, 0)):
        if busy:
            write_cell(page, busy, BUSY)
        else:
            run_cell(page, busy, BUSY)
        panel.get_by_role("button", name="Run all checks").click()
        expect(checks).to_contain_text("…greets: running" if busy else "…greets: waiting for the cell that runs")
        expect(cell(page, busy).locator(".jp-InputPrompt")).to_have_text("[*]:")
        if number < 2:
            page.get_by_role("button", name="Interrupt the kernel").click()
            wait_until_run(page)
        else:
            page.get_by_role("button", name="Restart the kernel", exact=True).click()
            page.get_by_role("dialog").get_by_role("button", name="Confirm Kernel Restart").click()
        expect_no_further_check(f"new {number}")

    run_cell(page, 0, "import course\n\nros = course.live()")
    wait_until_run(page)
    folder = lab[2] / "ended/greeter"
    for text in (STUB, SERVER):
        type_answer(page, text)
        panel.get_by_role("button", name="Run the cell of greeter.py").click()
        note = panel.get_by_role("region", name="greeter.py").get_by_role("status")
        ended = ", whose last run ended with an error:greeter.py ended with exit status 0."
        expect(note).to_have_text(re.compile(f"^the same as in its cell{ended if text == STUB else '$'}"))
    panel.get_by_role("button", name="Reset greeter.py").click()
    page.get_by_role("dialog").get_by_role("button", name="Cancel").click()
    expect(cell(page, FILE)).to_contain_text("class Greeter")
    expect(cell(page, FILE)).to_contain_text("running as /")
    panel.get_by_role("button", name="Reset greeter.py").click()
    page.get_by_role("dialog").get_by_role("button", name="Reset").click()
    expect(page.get_by_role("dialog")).to_contain_text("What you had written is in greeter.before-reset-1.py.")
    page.get_by_role("dialog").get_by_role("button", name="Close").click()
    expect(cell(page, FILE)).not_to_contain_text("class Greeter")
    expect(cell(page, FILE)).not_to_contain_text("running as /")
    panel.get_by_role("button", name="Reset greeter.py").click()
    expect(page.get_by_role("dialog")).to_contain_text("Nothing to reset in greeter.py")
    page.get_by_role("dialog").get_by_role("button", name="Close").click()
    expect(panel).to_contain_text("edited since it was run: run its cell")
    assert SERVER in (folder / "greeter.before-reset-1.py").read_text()
    assert not (folder / "greeter.before-reset-2.py").exists()
    shutil.rmtree(lab[2] / "ended/.released")
    panel.get_by_role("button", name="Reset greeter.py").click()
    expect(page.get_by_role("dialog")).to_contain_text("there is no copy of greeter.ipynb as it was released")


@pytest.mark.matrix  # tests/notebook/test_checks.py has a check that fails beside others; the first test shows messages
def test_checks_that_need_the_session_are_not_run_without_it_and_each_that_fails_has_its_whole_message(lab, page):
    """One that fails keeps no other from being run."""
    panel = begin(page, lab, "without", checks=("greets", "later"))
    checks = panel.get_by_role("list", name="Checks and questions")
    panel.get_by_role("button", name="Run all checks").click()
    expect(panel).to_contain_text("No check was run. There is no live session yet. Run the notebook’s first cell")
    expect(checks).to_contain_text("greets: not run")
    panel.get_by_role("button", name="Run the first cell").click()
    expect(panel).not_to_contain_text("No check was run")
    wait_until_run(page)
    run_cell(page, 0, "class ros:\n    def call(*_):\n        raise AssertionError('it is late\\nLook at line 3')")
    wait_until_run(page)
    panel.get_by_role("button", name="Run all checks").click()
    for name in ("greets", "later"):
        expect(checks).to_contain_text(f"✗{name}: not yet: it is late")
    expect(checks).to_contain_text("Look at line 3")
