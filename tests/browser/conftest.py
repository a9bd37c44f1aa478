"""JupyterLab, served from a folder of the test's own, and a page of a real browser."""

import contextlib
import os
import secrets
import shutil
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from course.waiting import wait_until
from tests.browser.pages import keep_picture
from tests.ports import free_port

ROOT = Path(__file__).parents[2]
JUPYTER = Path(sys.executable).with_name("jupyter")
WAIT = 90_000  # ms for whatever the page must show, on a busy machine


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """The address of a JupyterLab, its token, and the folder that it serves, with the calculator's notebook."""
    base = tmp_path_factory.mktemp("lab")
    folder = base / "calculator"
    folder.mkdir()
    shutil.copy(ROOT / "notebooks/calculator/calculator.ipynb", folder)
    with serving(base, folder) as (address, token):
        yield address, token, folder


@contextlib.contextmanager
def serving(base: Path, folder: Path, **variables: str) -> Iterator[tuple[str, str]]:
    """A JupyterLab that serves `folder`, with a home below `base`: its address and its token."""
    token = secrets.token_hex(16)
    home = base / "home"
    home.mkdir()
    for name, text in {
        "notebook-extension/tracker": '{"windowingMode": "none"}',  # or cells that are out of sight are not in the page
        "apputils-extension/notification": '{"fetchNews": "false"}',
    }.items():
        settings = home / f"config/lab/user-settings/@jupyterlab/{name}.jupyterlab-settings"
        settings.parent.mkdir(parents=True)
        settings.write_text(text)
    own = {
        "HOME": str(home),
        "JUPYTER_CONFIG_DIR": str(home / "config"),
        "XDG_RUNTIME_DIR": str(home),
        "COURSE_ARRANGE": "1",  # as environment/start does
        "COURSE_CACHE": str(Path.home() / ".cache" / "ros2-course"),
    }
    port, said = free_port(), base / "jupyterlab.log"
    clean = {name: value for name, value in os.environ.items() if name != "ROS_DOMAIN_ID"}
    server = subprocess.Popen(
        [
            JUPYTER,
            "lab",
            "--no-browser",
            "--allow-root",
            f"--port={port}",
            "--ServerApp.port_retries=0",
            f"--IdentityProvider.token={token}",
        ],
        cwd=folder,
        env=clean | own | variables,
        stdout=subprocess.DEVNULL,
        stderr=said.open("w"),
    )
    address = f"http://127.0.0.1:{port}"
    assert wait_until(lambda: answers(f"{address}/api") or server.poll() is not None, WAIT / 1e3)
    assert server.poll() is None, f"JupyterLab did not start:\n{said.read_text()}"
    yield address, token
    server.terminate()
    server.wait(WAIT / 1e3)


def answers(address: str) -> bool:
    """Whether a server answers there."""
    try:
        urllib.request.urlopen(address, timeout=WAIT / 1e3).close()
    except OSError:
        return False
    return True


@pytest.fixture
def page(chromium, request):
    """An empty page, large enough for a notebook beside a terminal."""
    page = chromium.new_page(viewport={"width": 1500, "height": 950})
    page.set_default_timeout(WAIT)
    yield page
    keep_picture(page, request.node.name)
    page.close()
