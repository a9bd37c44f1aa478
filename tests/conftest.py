"""For every test: the course comes first, because it prepares the environment that message classes read."""

import shutil
import signal

import pytest
from playwright.sync_api import sync_playwright

import course  # noqa: F401

# A shell that starts the tests in the background has them, and all that they start, ignore Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)

QUIET = (  # Chromium looks for nothing outside of this machine
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


@pytest.fixture(scope="session")
def chromium():
    """The system's browser; the tests are skipped without one."""
    program = shutil.which("chromium") or shutil.which("google-chrome")
    if not program:
        pytest.skip("no Chromium is installed")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(QUIET))
        yield browser
        browser.close()


def pytest_collection_modifyitems(items):
    """Try twice what waits for a middleware, a browser or a hub; a fault of the course fails twice.

    The cells of notebooks are run once: a student runs them once.
    """
    for item in items:
        if item.path.suffix == ".py":
            item.add_marker(pytest.mark.flaky(reruns=1))
