"""Students and an instructor in a real browser: the loop from the work to the returned feedback.

By clicking alone, as people do: what the loop leaves on the disk is for other tests.
"""

import os
import shutil
from pathlib import Path

import pytest
from playwright.sync_api import FrameLocator, Locator, Page, expect

from autograder.classroom import hub
from autograder.classroom.plan import COURSE_ID, Classroom
from autograder.paths import repository
from tests.browser.pages import choose, wait_for_kernel

WAIT = 180_000  # ms, on a busy machine
GRADED = 600_000  # ms, the same
SOLUTION = repository() / "solutions" / "calculator"
FILES = {  # with what their cells begin
    "Calculate.srv": "%%exercise Calculate.srv --package calculator_interfaces",
    "calculator_server.py": "%%exercise calculator_server.py",
    "calculator_client.py": "%%exercise calculator_client.py --no-start",
}
ANSWER, COMMENT = "Nothing but the server changes.", "Which message does it send?"
TOOLS = {"Assignment List", "Course List", "Formgrader", "Create assignment"}

expect.set_options(timeout=WAIT)


@pytest.fixture
def page(chromium, classroom, request):
    """A page on which somebody has logged in, as a person does, with JupyterLab as on the first day."""
    pages = []

    def open_page(name: str) -> Page:
        member = classroom.find(name)
        shutil.rmtree(classroom.home(member) / ".jupyter/lab/workspaces", ignore_errors=True)
        found = chromium.new_context(viewport={"width": 1500, "height": 950}).new_page()
        pages.append(found)
        found.set_default_timeout(WAIT)
        found.goto(classroom.url)
        found.fill("#username_input", name)
        known = hub.shared_passwords(classroom)
        found.fill("#password_input", known["instructors" if member.instructor else "students"])
        found.click("#login_submit")
        if member.instructor:
            found.get_by_role("link", name="JupyterLab", exact=True).click()
        found.get_by_role("heading", name="The five sections").wait_for()
        ready(found)
        return found

    yield open_page
    for number, each in enumerate(pages):
        if pictures := os.environ.get("COURSE_PICTURES"):  # a folder, for a person who wants to look
            each.screenshot(path=Path(pictures) / f"{request.node.name}-{number}.png")
        each.context.close()


def notebook(page: Page) -> Locator:
    """The notebook in front."""
    return page.locator(".jp-NotebookPanel:not(.lm-mod-hidden)")


def ready(page: Page) -> None:
    """Wait until the kernel of the notebook in front is idle.

    JupyterLab opens the start page when all plug-ins have been activated; the page takes the focus from an open menu
    when its kernel comes.
    """
    notebook(page).wait_for()
    wait_for_kernel(page)


def tools(page: Page) -> set[str]:
    """Those of nbgrader's tools that its menu offers."""
    page.locator(".lm-MenuBar-itemLabel").get_by_text("Nbgrader", exact=True).click()
    page.locator(".lm-Menu-itemLabel").get_by_text("Assignment List", exact=True).wait_for()
    found = set(page.locator(".lm-Menu-itemLabel").all_inner_texts())
    page.keyboard.press("Escape")
    return found & TOOLS


@pytest.mark.matrix  # each step has a test of its own, and tests/browser/test_handing_in.py is the student's loop
@pytest.mark.long("the whole loop, by clicks of three people")
@pytest.mark.timeout(1500)
def test_from_the_work_to_the_returned_feedback(page, classroom, come_in, kernel):
    """A student has assignments and no Formgrader, an instructor has all of nbgrader's tools."""
    begin_anew(classroom, "carol")
    student = page("carol")
    assert tools(student) == {"Assignment List"}
    assert student.get_by_text("official Jupyter news").count() == 0, "it asks about what the box has no way to"
    open_calculator(student)
    work(student)
    assert hand_in(student).startswith("carol-calculator-")
    hand_in_at_once(come_in("dan"), kernel)

    instructor = page("teacher")
    assert tools(instructor) == TOOLS
    grade(instructor, ["carol", "dan"])
    mark(instructor, "Lovelace, Carol", 3.5)
    return_feedback(instructor)

    shown = feedback_in_the_notebook(student)
    expect(shown).to_contain_text("Calculator service: 23.5 of 25 points")
    expect(shown).to_contain_text(f"exponentiation: 3.5 of 5 points. {COMMENT}")
    assert "23.5 of 25 points" in feedback_in_the_tab(student)

    other = page("dan")
    returned = feedback_in_the_tab(other)
    assert "20 of 25 points" in returned and COMMENT not in returned


def begin_anew(classroom: Classroom, name: str) -> None:
    """The notebook as it was released: this test may be run a second time."""
    own = "notebooks/calculator/calculator.ipynb"
    released = classroom.exchange / COURSE_ID / "outbound" / "calculator" / "calculator.ipynb"
    shutil.copyfile(released, classroom.home(classroom.find(name)) / own)


def open_calculator(page: Page) -> None:
    page.get_by_role("link", name="The calculator").click()
    page.get_by_role("tab", name="calculator.ipynb").wait_for()
    ready(page)


def cell_with(page: Page, text: str) -> Locator:
    found = notebook(page).locator(".jp-Cell").filter(has_text=text).first
    found.scroll_into_view_if_needed()
    return found


def write(page: Page, cell: Locator, text: str) -> None:
    """Replace what a cell says, and run it."""
    cell.locator(".cm-content").click()
    page.keyboard.press("Control+A")
    page.keyboard.insert_text(text)
    page.keyboard.press("Shift+Enter")


def work(page: Page) -> None:
    """Write and run the files, and answer the question in words."""
    cell_with(page, "ros = course.live()").locator(".cm-content").click()
    page.keyboard.press("Shift+Enter")
    for name, first in FILES.items():
        cell = cell_with(page, first)
        write(page, cell, f"{first}\n{(SOLUTION / name).read_text()}")
        expect(cell.locator(".jp-OutputArea-output")).to_contain_text(f"{name}: written")
    answer = cell_with(page, "YOUR ANSWER HERE")
    answer.locator(".jp-MarkdownOutput").dblclick()
    write(page, answer, ANSWER)


def hand_in(page: Page) -> str:
    """Click the button, and answer its dialogs; the name of the archive that is offered."""
    notebook(page).get_by_role("button", name="Hand in", exact=True).click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text(f"{', '.join(FILES)}, calculator.ipynb")
    expect(dialog).not_to_contain_text("Careful")
    expect(dialog).to_contain_text("You hand in as carol.")
    dialog.get_by_role("button", name="Hand in", exact=True).click()
    expect(dialog).to_contain_text("It is in the exchange of your class.")
    expect(dialog).to_contain_text("3 of 3 public checks passed.")
    with page.expect_download() as download:
        dialog.get_by_role("link", name="Download").click()
    dialog.get_by_role("button", name="Close").click()
    return download.value.suggested_filename


def hand_in_at_once(visitor, kernel) -> None:
    """Hand in the right answer, without written answers and without a browser."""
    files = {name: (SOLUTION / name).read_text() for name in FILES}
    put = f"for name, text in {files!r}.items():\n    open(name, 'w').write(text)"
    live = kernel(visitor, "calculator")
    assert live.run(put).error == ""
    assert "in the exchange of your class" in live.run("!course hand-in --yes --no-check").text


def formgrader(page: Page) -> FrameLocator:
    return page.frame_locator("#formgrader iframe")


def done(page: Page, said: str) -> None:
    """Wait for the dialog that says how it went, and close it."""
    dialog = formgrader(page).locator(".modal-dialog")
    expect(dialog).to_contain_text(said, timeout=GRADED)
    dialog.get_by_role("button", name="OK").click()
    dialog.wait_for(state="detached")


def row_of(page: Page, name: str) -> Locator:
    return formgrader(page).locator("tr").filter(has=page.locator(f"td:text-is('{name}'), td a:text-is('{name}')"))


def grade(page: Page, students: list[str]) -> None:
    """Collect what was handed in, and grade it."""
    choose(page, "Nbgrader", "Formgrader")
    calculator = row_of(page, "calculator")
    calculator.locator(".collect a").click()
    done(page, "Successfully collected submissions of 'calculator'")
    calculator.locator(".num-submissions a").click()
    for name in students:
        row_of(page, name).locator(".autograde a").click()
        done(page, f"Successfully autograded 'calculator' for student '{name}'")
        expect(row_of(page, name)).to_contain_text("20 / 25")


def mark(page: Page, name: str, points: float) -> None:
    """Give points and a comment for the answer in words."""
    frame = formgrader(page)
    frame.get_by_role("link", name="Manual Grading").click()
    frame.locator("td.name a[href$='/gradebook/calculator']").click()
    frame.locator("td.name a[href$='/gradebook/calculator/calculator']").click()
    submission = frame.locator("tr").filter(has=page.locator(f"a.name-shown:text-is('{name}')"))
    submission.locator(".reveal .name-hidden").click()
    submission.locator("a.name-shown").click()
    expect(frame.get_by_text(ANSWER)).to_be_visible()
    # What is typed before the marks and comments have come would be lost.
    frame.locator("#calculate-srv[placeholder]").wait_for()
    frame.locator("#exponentiation-comment[data-autosize-on]").wait_for()
    keep(page, frame.locator("#exponentiation"), f"{points}", "grade")
    keep(page, frame.locator("#exponentiation-comment"), COMMENT, "comment")


def keep(page: Page, field: Locator, text: str, what: str) -> None:
    """Type into a field, leave it, and wait until Formgrader has kept what was typed."""
    field.fill(text)
    with page.expect_response(lambda answer: f"/api/{what}/" in answer.url and answer.request.method == "PUT") as kept:
        field.press("Tab")
    assert kept.value.ok


def return_feedback(page: Page) -> None:
    frame = formgrader(page)
    frame.get_by_role("link", name="Manual Grading").click()
    frame.get_by_role("link", name="Manage Assignments").click()
    for what, said in (("generate", "generated feedback"), ("release", "released feedback")):
        row_of(page, "calculator").locator(f".{what}-feedback a").click()
        done(page, f"Successfully {said} of 'calculator'")


def feedback_in_the_notebook(page: Page) -> Locator:
    """Ask for the feedback in a new cell below the last exercise; what it shows."""
    cell_with(page, FILES["calculator_client.py"]).locator(".cm-content").click()
    for key in ("Escape", "b", "Enter"):
        page.keyboard.press(key)
    page.keyboard.insert_text("import course\n\ncourse.feedback()")
    page.keyboard.press("Shift+Enter")
    return cell_with(page, "course.feedback()").locator(".jp-OutputArea")


def feedback_in_the_tab(page: Page) -> str:
    """Fetch the feedback in the Assignments tab, and open it; the text of the page."""
    choose(page, "Nbgrader", "Assignment List")
    tab = page.locator(".nbgrader-mainarea-widget")
    tab.get_by_role("button", name="Fetch Feedback").click()
    tab.get_by_text("(view feedback)").click()
    page.locator(".jp-DirListing").get_by_text("calculator.html", exact=True).dblclick()
    returned = page.frame_locator(".jp-HTMLViewer iframe").locator("body")
    expect(returned).to_contain_text("points")
    return returned.inner_text()
