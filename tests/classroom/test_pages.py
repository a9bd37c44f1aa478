"""What a student and an instructor see of JupyterLab, in a real browser."""

import pytest

from autograder.classroom import hub

WAIT = 180_000  # ms, on a busy machine


@pytest.fixture
def page(chromium, room):
    """A page on which somebody has logged in, as a person does."""
    contexts = []

    def open_page(name: str):
        context = chromium.new_context()
        contexts.append(context)
        found = context.new_page()
        found.set_default_timeout(WAIT)
        found.goto(room.url)
        found.fill("#username_input", name)
        known = hub.shared_passwords(room)
        found.fill("#password_input", known["instructors" if room.find(name).instructor else "students"])
        found.click("#login_submit")
        found.wait_for_selector(".jp-Notebook:has-text('The five sections')")
        return found

    yield open_page
    for context in contexts:
        context.close()


def menu(page) -> list[str]:
    page.click(".lm-MenuBar-itemLabel:has-text('Nbgrader')")
    page.wait_for_selector(".lm-Menu-itemLabel:has-text('Assignment List')")
    return page.locator(".lm-Menu-itemLabel").all_inner_texts()


def test_a_student_has_assignments_and_no_formgrader(page):
    student = page("ada")
    shown = menu(student)
    assert not [item for item in shown if "Formgrader" in item or "Course List" in item]
    student.click(".lm-Menu-itemLabel:has-text('Assignment List')")
    student.wait_for_selector(".list_item:has-text('calculator')")
    assert student.get_by_text("official Jupyter news").count() == 0, "it asks about what the box has no way to"


def test_an_instructor_has_formgrader(page):
    instructor = page("teacher")
    assert [item for item in menu(instructor) if "Formgrader" in item]
    instructor.click(".lm-Menu-itemLabel:text-is('Formgrader')")
    instructor.frame_locator("iframe").get_by_role("link", name="calculator", exact=True).first.wait_for()
