"""For every test: the course comes first, because it prepares the environment that message classes read."""

import gc
import os
import secrets
import shutil
import signal
import sys
from collections.abc import Collection
from concurrent.futures import ThreadPoolExecutor

import psutil
import pytest
from playwright.sync_api import sync_playwright

import course  # noqa: F401
from autograder.errors import SandboxUnavailable
from autograder.grading import single
from autograder.records import Submission
from autograder.sandbox import sandbox
from autograder.submissions import exercises
from course.foundation.waiting import wait_until

# A shell that starts the tests in the background has them, and all that they start, ignore Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)
# Some containers set this: every process of every test would compile what it imports, and pytest every test.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

ENDS = 10  # s for what the tests have told to end
BROWSERS = ("chromium-headless-shell", "chromium", "google-chrome")  # the first takes an eighth less of the processor
QUIET = (  # Chromium looks for nothing outside of this machine, and leaves what only pays in a page that lives long
    "--no-sandbox",
    "--js-flags=--no-maglev --no-opt",  # no compiling for speed: a sixth less of the processor for a page of JupyterLab
    "--disable-site-isolation-trials",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


def chromium_options() -> dict:
    """Return the options that launch the system's browser; skip the tests without one."""
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if not program:
        pytest.skip("no Chromium is installed")
    return {"executable_path": program, "args": list(QUIET)}


@pytest.fixture(scope="session")
def chromium():
    """The system's browser; what is opened in it begins with nothing."""
    options = chromium_options()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(**options)
        yield browser
        browser.close()


@pytest.fixture(scope="session", autouse=True)
def nothing_is_left(tmp_path_factory):
    """No test leaves a process behind that works in a folder of the tests."""
    base = str(tmp_path_factory.getbasetemp())

    def left() -> list[str]:
        found = (process.info for process in psutil.process_iter(["cwd", "cmdline"]))  # leaves out who ends meanwhile
        lines = (" ".join((each["cwd"] or "", *(each["cmdline"] or ()))) for each in found)
        return [line for line in lines if base in line]

    yield
    assert wait_until(lambda: not left(), ENDS), left()


@pytest.fixture(autouse=True)
def own_environment():
    """Undo what a test sets for its process, such as the search paths of an interface package that it builds."""
    variables, path = dict(os.environ), list(sys.path)
    yield
    os.environ.clear()
    os.environ.update(variables)
    sys.path[:] = path


@pytest.fixture(scope="session")
def confinement() -> str:
    """The way in which this machine confines programs."""
    try:
        return sandbox.choose()
    except SandboxUnavailable as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def gradings():
    """The queue of all gradings: a few at a time, in the order in which they are asked for."""
    with ThreadPoolExecutor(os.cpu_count() + 1) as pool:
        yield pool


@pytest.fixture(scope="session")
def grade(confinement, gradings):
    """A function that begins to grade files, and returns the future report."""

    def begin(files, exercise="calculator", **options):
        return gradings.submit(single.grade, Submission("student", exercise, files), confinement, **options)

    return begin


@pytest.fixture(scope="session")
def judge(confinement, gradings):
    """A function that begins to judge files by some hidden tests alone, and returns the future judgement."""

    def begin(files, exercise, *tests, seed=None, patience=1.0):
        seed = secrets.randbits(32) if seed is None else seed
        return gradings.submit(single.judge, exercises.load(exercise).part(*tests), files, confinement, seed, patience)

    return begin


# Tests that share what takes long to make run in one worker: a class's server, a JupyterLab with its browser, the queue
# of gradings, kernels.  Those that take longest begin first.
SHARED = {
    "gradings": ("tests/attacks/", "tests/hidden/", "tests/grading/test_bad_input.py"),
    "browser": ("tests/browser/",),
    "checks": ("tests/notebook/test_public_checks.py",),
    "classroom": ("tests/classroom/",),
    "mistakes": ("tests/mistakes/",),
}
# What mostly waits for a program: its files come between those that work, so that the processor is never idle.
WAITING = (
    "notebooks/",
    "tests/session/",
    "tests/notebook/",
    "tests/lab/",
    "tests/ros2/",
    "tests/nodes/",
    "tests/world/",
)


# What a page or a hub does at moments of its own is waited for; a second try is granted all the same, and named.
DRIVEN = {  # by the fixture that a test uses; one that starts a hub of its own has the marker
    "chromium": "JupyterLab draws, takes the focus and connects to kernels when it likes",
    "up": "JupyterHub, its proxy and the members' servers start and end by themselves",
    "ended": "JupyterHub and the members' servers end by themselves, and start again",
}

LONG = 30  # s that a test may take on a quiet machine without the marker that says why
QUEUE = "its gradings wait in the queue of all"


def group(nodeid: str) -> str:
    """Return the group of tests that a test belongs to: what it shares, or else its file."""
    return next((name for name, places in SHARED.items() if nodeid.startswith(places)), nodeid.partition("::")[0])


def pytest_configure(config):
    """Tell pytest of the markers that grant a second try, and time; no garbage is looked for until all is collected."""
    gc.disable()
    config.addinivalue_line("markers", "drives(reason): drives a browser or a hub; a second try is granted, and named")
    config.addinivalue_line("markers", f"long(reason): takes more than {LONG} s on a quiet machine")


@pytest.hookimpl(trylast=True)  # of those that are not run, nothing is asked
def pytest_collection_modifyitems(items):
    """Begin with the groups that take longest; the order within a file stays as it is written."""
    for item in items:
        for fixture in DRIVEN.keys() & getattr(item, "fixturenames", ()):  # a cell of a notebook has none
            item.add_marker(pytest.mark.drives(DRIVEN[fixture]))
        if driving := item.get_closest_marker("drives"):
            assert driving.args, f"{item.nodeid}: the marker drives needs a reason"
            item.add_marker(pytest.mark.flaky(reruns=1))
        if group(item.nodeid) == "gradings":
            item.add_marker(pytest.mark.long(QUEUE))
        if long := item.get_closest_marker("long"):
            assert long.args, f"{item.nodeid}: the marker long needs a reason"
    turn = turns(dict.fromkeys(group(item.nodeid) for item in items))
    items.sort(key=lambda item: turn[group(item.nodeid)])


def turns(names: Collection[str]) -> dict[str, float]:
    """Return when each group of tests begins: from 0 to 1 what is shared, and from 1 to 2 the other files, mixed."""

    def rank(name: str) -> int:
        return next((number for number, place in enumerate(WAITING) if name.startswith(place)), len(WAITING))

    shared = [name for name in SHARED if name in names]
    files = sorted((name for name in names if name not in SHARED), key=rank)
    waiting = [name for name in files if rank(name) < len(WAITING)]
    turn = {name: number / len(shared) for number, name in enumerate(shared)}
    for part in (waiting, files[len(waiting) :]):
        turn |= {name: 1 + number / len(part) for number, name in enumerate(part)}
    return turn


def pytest_collection_finish():
    """Spare the tests what costs a second each time: alembic for a new gradebook, and a look for garbage among them."""
    if "nbgrader" in sys.modules:
        from autograder.gradebook import database

        database.read_version_in_process()
    gc.collect()
    gc.freeze()
    gc.enable()


def pytest_xdist_make_scheduler(config, log):
    """Give each worker whole groups of tests (environment/test runs several workers)."""
    from xdist.scheduler.loadscope import LoadScopeScheduling

    class ByGroup(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            return group(nodeid)

    config.option.loadscopereorder = False
    return ByGroup(config, log)


def pytest_terminal_summary(terminalreporter):
    """Show why each second try was needed, and which tests were long without a reason."""
    reports = terminalreporter.getreports("rerun")
    if reports:
        terminalreporter.section("why a second try was needed")
    for report in reports:
        terminalreporter.write_line(f"{report.nodeid}\n{report.longreprtext}\n")
    slow = [
        report
        for report in terminalreporter.getreports("passed")
        if report.when == "call" and report.duration > LONG and "long" not in report.keywords
    ]
    if slow:
        terminalreporter.section(f"longer than {LONG} s: on a quiet machine, these need the marker long(reason)")
    for report in slow:
        terminalreporter.write_line(f"{report.duration:.0f} s  {report.nodeid}")
