"""JupyterLab, served from a folder of the test's own, and a page of a real browser."""

import contextlib
import os
import re
import secrets
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

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
    clean = {name: value for name, value in os.environ.items() if name != "ROS_DOMAIN_ID"}
    server = subprocess.Popen(
        [JUPYTER, "lab", "--no-browser", "--allow-root", "--port=0", f"--IdentityProvider.token={token}"],
        cwd=folder,
        env=clean | own | variables,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert server.stderr is not None
    for line in server.stderr:
        if found := re.search(r"http://(?:localhost|127\.0\.0\.1):(\d+)/lab", line):
            break
    else:
        pytest.fail("JupyterLab did not start")
    drain = subprocess.Popen(["cat"], stdin=server.stderr, stdout=subprocess.DEVNULL)
    yield f"http://127.0.0.1:{found[1]}", token
    server.terminate()
    server.wait(30)
    drain.wait(30)


@pytest.fixture
def page(chromium, request):
    """An empty page, large enough for a notebook beside a terminal."""
    page = chromium.new_page(viewport={"width": 1500, "height": 950})
    page.set_default_timeout(WAIT)
    yield page
    if pictures := os.environ.get("COURSE_PICTURES"):  # a folder, for a person who wants to look
        page.screenshot(path=Path(pictures) / f"{request.node.name}.png")
    page.close()
