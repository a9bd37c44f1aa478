"""The hand-in button: a student works, hands in, and has the archive; what is doubtful is asked."""

import json
import zipfile

import nbformat
import pytest
from playwright.sync_api import Route, expect

from tests.browser.conftest import WAIT
from tests.browser.pages import (
    CHECK,
    CHECKS,
    FILE,
    SERVER,
    choose,
    expect_no_barriers,
    keep_picture,
    open_page,
    show_panel,
    write_cell,
    write_greeter,
)

expect.set_options(timeout=WAIT)


def contents_of(archive):
    with zipfile.ZipFile(archive) as opened:
        content = {name: opened.read(name) for name in opened.namelist()}
    return json.loads(content.pop("receipt.json")), content


def test_a_student_works_hands_in_and_keeps_the_archive(lab, page):
    _, _, served = lab
    write_greeter(served / "greeter", answer="...\n")
    open_page(page, lab, "greeter/greeter.ipynb")
    show_panel(page, "Graph")
    page.set_viewport_size({"width": 1280, "height": 800})  # both sidebars are open
    toolbar = page.locator(".jp-NotebookPanel-toolbar")
    expect(toolbar.get_by_role("button", name="Hand in", exact=True)).to_be_visible()
    expect(toolbar.locator(".jp-Notebook-ExecutionIndicator")).to_be_visible()
    write_cell(page, FILE, f"%%exercise greeter.py\n{SERVER}")
    choose(page, "Run", "Run All Cells")
    page.locator(".jp-OutputArea-output pre").get_by_text("as asked").wait_for()
    page.get_by_role("button", name="Hand in", exact=True).click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("greeter.py, greeter.ipynb")
    expect(dialog).not_to_contain_text("Careful")
    expect(dialog).to_contain_text("Not answered: why (3 points).")
    dialog.get_by_label("Your name on the course").fill("Ada Lovelace")
    dialog.get_by_role("button", name="Hand in", exact=True).click()
    page.get_by_text("Running the public checks").first.wait_for()
    expect(dialog).to_contain_text("✓ greets: passed")
    expect(dialog).to_contain_text("1 of 1 public checks passed.")
    expect(dialog).to_contain_text("Not answered: why (3 points).")
    expect(dialog).to_contain_text("Packed: now give this archive to your instructor")
    with page.expect_download() as download:
        dialog.get_by_role("link", name="Download Ada_Lovelace-greeter").click()
    (archive,) = (served / "greeter").glob("*.zip")
    assert download.value.suggested_filename == archive.name
    receipt, content = contents_of(download.value.path())
    assert receipt["student"] == "Ada_Lovelace"
    assert receipt["checks"] == {"greets": "passed"}
    assert content["greeter.py"].decode() == SERVER
    assert SERVER.splitlines()[5] in content["greeter.ipynb"].decode()  # the notebook was saved first


@pytest.mark.matrix  # tests/browser/test_inspector.py loads a page again
def test_a_page_that_is_loaded_again_meanwhile_says_what_was_handed_in(lab, page):
    _, _, served = lab
    path = write_greeter(served / "meanwhile")
    (served / "meanwhile/greeter.py").write_text(SERVER)
    notebook, end = nbformat.read(path, 4), served / "end"
    notebook.cells[CHECKS].source = f"import pathlib\nros.until(pathlib.Path({str(end)!r}).exists, 60)\n{CHECK}"
    nbformat.write(notebook, path)
    open_page(page, lab, "meanwhile/meanwhile.ipynb")
    panel = show_panel(page, "Exercise")
    expect(panel).to_contain_text("0 of 2 parts done")
    panel.get_by_role("button", name="Hand in", exact=True).click()
    page.get_by_role("dialog").get_by_role("button", name="Hand in", exact=True).click()
    page.get_by_text("Running the public checks").first.wait_for()
    held: list[Route] = []

    def hold(route: Route) -> None:
        held.append(route)

    page.route("**/course/exercise*", hold)
    open_page(page, lab, "meanwhile/meanwhile.ipynb")
    expect(show_panel(page, "Exercise")).to_contain_text("Connecting …")
    keep_picture(page, "exercise-connecting")
    for each in held:
        each.continue_()
    page.unroute("**/course/exercise*")
    expect(panel).to_contain_text("A hand-in is under way.")
    end.touch()
    expect(panel).to_contain_text("UTC: greeter.py, meanwhile.ipynb. 1 of 1 public checks passed.")
    (archive,) = (served / "meanwhile").glob("*.zip")
    with page.expect_download() as download:
        panel.get_by_role("link", name=f"Download {archive.name}").click()
    assert download.value.path().read_bytes() == archive.read_bytes()
    expect_no_barriers(page, "#ros2-course-exercise", "exercise-handed-in")
    page.set_viewport_size({"width": 390, "height": 800})
    assert panel.evaluate("panel => panel.scrollWidth <= panel.clientWidth")
    keep_picture(page, "exercise-handed-in-phone")


@pytest.mark.matrix  # tests/course/test_hand_in.py has the doubts
def test_a_doubt_is_asked_and_no_is_an_answer(lab, page):
    _, _, served = lab
    write_greeter(served / "doubtful", answer="# YOUR CODE HERE\n")
    (served / "doubtful/greeter.py").write_text("# YOUR CODE HERE\n")
    open_page(page, lab, "doubtful/doubtful.ipynb")
    button = page.get_by_role("button", name="Hand in", exact=True)
    button.click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("greeter.py still has a line # YOUR CODE HERE: fill it in")
    expect(dialog.locator("code")).to_have_text("# YOUR CODE HERE")
    keep_picture(page, "hand-in-code")
    dialog.get_by_role("button", name="Cancel").click()
    dialog.wait_for(state="detached")
    (served / "doubtful/greeter.py").write_text("print('edited elsewhere')\n")
    button.click()
    expect(dialog).to_contain_text("greeter.py differs from its cell")
    dialog.get_by_role("button", name="Cancel").click()
    dialog.wait_for(state="detached")
    assert list((served / "doubtful").glob("*.zip")) == []
    button.click()
    dialog.get_by_role("button", name="Hand it in as it is").click()
    expect(dialog).to_contain_text("Careful: a public check has failed:greets: not yet: ")
    keep_picture(page, "hand-in-failed-check")
    dialog.get_by_role("button", name="Cancel").click()
    dialog.wait_for(state="detached")
    assert list((served / "doubtful").glob("*.zip")) == []
    button.click()
    dialog.get_by_role("button", name="Hand it in as it is").click()
    expect(dialog).to_contain_text("a public check has failed")
    dialog.get_by_role("button", name="Hand it in as it is").click()
    expect(dialog).to_contain_text("✗ greets: not yet")
    dialog.get_by_role("button", name="Close").click()
    checks = show_panel(page, "Exercise").get_by_role("list", name="Checks and questions")
    expect(checks).to_contain_text("✗greets: not yet: ")  # which the notebook has not run
    (archive,) = (served / "doubtful").glob("*.zip")
    receipt, content = contents_of(archive)
    assert list(receipt["doubts"]) == ["greeter.py"]
    assert content["greeter.py"] == b"print('edited elsewhere')\n"


@pytest.mark.matrix  # tests/course/test_hand_in.py has the sentences
def test_what_cannot_be_handed_in_is_told_in_a_sentence(lab, page):
    _, _, served = lab
    write_greeter(served / "empty")
    open_page(page, lab, "empty/empty.ipynb")
    page.get_by_role("button", name="Hand in", exact=True).click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("none of the exercise's files exists: run the cells that write greeter.py")
    expect(dialog).not_to_contain_text("Traceback")


@pytest.mark.matrix  # the test above has the button where there is an exercise
def test_a_notebook_without_an_exercise_has_no_button(lab, page):
    """Nor has one without cells of nbgrader's "Validate", which nbgrader would show everywhere."""
    _, _, served = lab
    for name in ("graded", "plain"):
        path = write_greeter(served / name)
        notebook = nbformat.read(path, 4)
        for each in notebook.cells:
            each.source = each.source.replace("%%exercise greeter.py", "# no exercise")
            if name == "plain":
                each.metadata = {}
        nbformat.write(notebook, path)
    open_page(page, lab, "graded/graded.ipynb")
    toolbar = page.locator(".jp-NotebookPanel:not(.lm-mod-hidden) .jp-NotebookPanel-toolbar")
    expect(toolbar.get_by_text("Validate")).to_have_count(1)
    expect(toolbar.get_by_text("Validate")).to_be_visible()
    choose(page, "File", "Open from Path…")
    page.get_by_role("dialog").locator("input").fill("plain/plain.ipynb")
    page.get_by_role("dialog").get_by_role("button", name="Open").click()
    page.get_by_role("tab", name="plain.ipynb").wait_for()
    expect(toolbar.get_by_text("Validate")).to_have_count(1)
    expect(toolbar.get_by_text("Validate")).to_be_hidden()
    expect(page.get_by_role("button", name="Hand in", exact=True)).to_have_count(0)
