"""A student's whole loop: work, hand in, be graded and marked by hand, get it back, and read it in the notebook."""

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import nbformat
import pytest
from nbgrader.api import Gradebook

from autograder.classroom.box import NEVER
from tests.browser.conftest import ROOT, serving
from tests.browser.pages import SERVER, choose, open_page, run_cell, write_greeter
from tests.browser.test_one_world import tabs

PROGRAMS = Path(sys.executable).parent
FAULT = ("response.message = f'Motors {self.state()}'", "response.message = 'no state'")  # the motors' answers


def run(*command: str | Path, cwd: Path) -> str:
    """A command of the course's, as typed in a terminal; it must succeed."""
    program, *arguments = map(str, command)
    done = subprocess.run([PROGRAMS / program, *arguments], cwd=cwd, capture_output=True, text=True, timeout=250)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def settings(base: Path, profile: str) -> Path:
    """JupyterLab's settings, as environment/install writes them for a profile: the folder."""
    function = 'source <(sed -n \'/^jupyterlab() {/,/^}/p\' "$0"); root=$1 profile=$2; cd "$3"; jupyterlab'
    place = base / profile
    place.mkdir()
    command = ["bash", "-ec", function, ROOT / "environment/install", ROOT, profile, place]
    subprocess.run(command, check=True)
    return place / ".venv/etc/jupyter"


@pytest.fixture(scope="module")
def student(tmp_path_factory):
    """JupyterLab as a student has it: its address, its token, its folder, and where an exchange would be."""
    base = tmp_path_factory.mktemp("student")
    folder = base / "work"
    (folder / "services").mkdir(parents=True)
    shutil.copy(ROOT / "notebooks/services/services.ipynb", folder / "services")
    config = settings(base, "student")
    (config / "nbgrader_config.py").write_text(f"get_config().Exchange.root = {str(base / 'exchange')!r}\n")
    with serving(base, folder, JUPYTER_CONFIG_PATH=str(config), COURSE_EXCHANGE="ros2") as (address, token):
        yield address, token, folder, base / "exchange"


@pytest.mark.matrix  # tests/classroom/test_classroom.py asks a class's servers
def test_students_see_what_is_theirs_and_assignments_only_where_there_is_an_exchange(student, page):
    address, token, work, exchange = student
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(f"{address}/lab?token={token}&reset")
    assert tabs(page) == set()
    assert page.locator(".lm-MenuBar-itemLabel").get_by_text("Nbgrader").count() == 0
    exchange.mkdir()
    page.goto(f"{address}/lab?reset")
    assert tabs(page) == {"Assignment List"}
    choose(page, "Nbgrader", "Assignment List")
    page.get_by_text("There are no assignments to fetch.").wait_for()
    for folder in ("inbound", "outbound/greeter"):  # as after `nbgrader release_assignment`
        (exchange / "ros2" / folder).mkdir(parents=True)
    (exchange / "ros2/inbound").chmod(0o733)
    write_greeter(work / "greeter")
    (work / "greeter/greeter.py").write_text(SERVER)
    choose(page, "File", "Open from Path…")
    page.get_by_role("dialog").locator("input").fill("greeter/greeter.ipynb")
    page.get_by_role("dialog").get_by_role("button", name="Open").click()
    page.get_by_role("button", name="Hand in", exact=True).click()
    page.get_by_role("dialog").get_by_role("button", name="Hand in", exact=True).click()
    page.get_by_role("dialog").get_by_role("button", name="Close").click()
    page.get_by_role("tab", name="Assignments").click()
    page.locator("#submitted_assignments_list").get_by_text("greeter").first.wait_for()
    # What costs each page some processor time, or the internet, and is of no use to a student.
    assert [url for url in asked if "/lab/api/build" in url or "/lab/api/news" in url] == []


@pytest.mark.parametrize("profile", ["student", "instructor", "developer"])
def test_nobody_is_asked_whether_to_get_news_or_shown_what_acts_by_itself(tmp_path, profile):
    """JupyterLab asks, looks for updates, and opens what reads files or runs scripts, unless parts are disabled."""
    disabled = json.loads((settings(tmp_path, profile) / "labconfig/page_config.json").read_text())[
        "disabledExtensions"
    ]
    assert all(disabled[name] is True for name in NEVER)  # as in a class


def test_instructors_keep_their_tabs(tmp_path):
    for profile in ("instructor", "developer"):
        config = settings(tmp_path, profile)
        assert "nbgrader" not in (config / "labconfig/page_config.json").read_text()
        assert "jpserver_extensions" not in (config / "jupyter_server_config.json").read_text()


def hand_in_and_return(services: Path, folder: Path) -> str:
    """Hand in what lies in `services`, grade it, mark it by hand and return it; what `course feedback` says of it."""
    for old in services.glob("ada-services-*.zip"):
        old.unlink()
    for name in ("motor_service.py", "relay.py"):
        text = (ROOT / "solutions/services" / name).read_text()
        (services / name).write_text(text.replace(*FAULT))
    run("course", "hand-in", "--yes", "--no-check", "--name", "ada", cwd=services)
    (handed_in,) = services.glob("ada-services-*.zip")
    with zipfile.ZipFile(folder / "moodle.zip", "w") as download:
        download.write(handed_in, f"Ada Lovelace_55_assignsubmission_file_/{handed_in.name}")

    run("autograder", "collect", "moodle.zip", "--into", "submitted", cwd=folder)
    run("autograder", "grade", "submitted", "--output", "out", "--seed", "1", cwd=folder)
    with Gradebook(f"sqlite:///{folder / 'out' / 'gradebook.db'}") as book:
        book.find_grade("relay", "services", "services", "Ada_Lovelace").manual_score = 4.5
        book.db.commit()
    assert "1 page returned; 0 not." in run("autograder", "return", "out", cwd=folder)
    with zipfile.ZipFile(folder / "out" / "returned" / "services-moodle.zip") as upload:
        (name,) = upload.namelist()
        upload.extract(name, folder)
    return run("course", "feedback", folder / name, cwd=services)


@pytest.mark.long("the whole loop of one student, with a grading")
def test_from_the_work_to_the_feedback_in_the_terminal(confinement, tmp_path):
    (tmp_path / "work/services").mkdir(parents=True)
    shutil.copy(ROOT / "notebooks/services/services.ipynb", tmp_path / "work/services")
    said = hand_in_and_return(tmp_path / "work/services", tmp_path)
    assert "relay: 4.5 of 10 points" in said and "What to correct:" in said


@pytest.mark.matrix  # test_from_the_work_to_the_feedback_in_the_terminal runs the same commands
@pytest.mark.long("the whole loop of one student, with a grading")
def test_from_the_work_to_the_feedback_in_the_notebook(student, confinement, page, tmp_path):
    address, token, work, _ = student
    services = work / "services"
    points = hand_in_and_return(services, tmp_path).partition(": ")[2].partition(" points")[0]
    notebook = nbformat.read(ROOT / "notebooks/services/services.ipynb", 4)
    number = 1 + next(n for n, each in enumerate(notebook.cells) if each.source.startswith("%%exercise relay.py"))
    notebook.cells.insert(number, nbformat.v4.new_code_cell())
    nbformat.write(notebook, services / "services.ipynb")
    open_page(page, (address, token, work), "services/services.ipynb")
    run_cell(page, number, "import course; course.feedback()")
    output = page.locator(".jp-OutputArea-output").filter(has_text="What to correct")
    output.get_by_text(f"{points} points").first.wait_for()
    output.get_by_text("relay: 4.5 of 10 points").first.wait_for()
    output.scroll_into_view_if_needed()
    assert output.get_by_text("✗ failed").count() > 0
    if pictures := os.environ.get("COURSE_PICTURES"):
        page.screenshot(path=Path(pictures) / "feedback-in-the-notebook.png")
    page.get_by_role("tab", name="File Browser").click()
    page.locator(".jp-DirListing").get_by_text("feedback", exact=True).dblclick()
    page.locator(".jp-DirListing").get_by_text("services.html", exact=True).dblclick()
    returned = page.frame_locator(".jp-HTMLViewer iframe")
    returned.get_by_text(f"{points} points").wait_for()
    assert "allow-scripts" not in page.locator(".jp-HTMLViewer iframe").get_attribute("sandbox")
