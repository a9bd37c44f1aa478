"""JupyterLab, served from a folder of the test's own, and a page of a real browser."""

import contextlib
import json
import os
import secrets
import shutil
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil
import pytest
from playwright.sync_api import Page, expect

from course.foundation.waiting import wait_until
from tests.browser.pages import cell, keep_picture, open_page, run_cell, run_from_palette, show_panel, write_greeter
from tests.conftest import chromium_options
from tests.ports import free_port

ROOT = Path(__file__).parents[2]
JUPYTER = Path(sys.executable).with_name("jupyter")
ENDS = 3  # s until a JupyterLab that was told to end is killed
WAIT = 90_000  # ms for whatever the page must show, on a busy machine


SETTINGS = {
    "notebook-extension/tracker": '{"windowingMode": "none"}'  # or cells that are out of sight are not in the page
}


@pytest.fixture(scope="session")
def served(tmp_path_factory) -> Iterator[tuple[str, str, Path]]:
    """A JupyterLab for all tests: its address, its token, and the folder that it serves."""
    base = tmp_path_factory.mktemp("lab")
    folder = base / "calculator"
    folder.mkdir()
    with serving(base, folder) as (address, token):
        yield address, token, folder


@pytest.fixture
def lab(served) -> Iterator[tuple[str, str, Path]]:
    """The same, as if it had just been started: with the calculator's notebook, no kernels and no terminals."""
    address, token, folder = served
    shutil.copy(ROOT / "notebooks/calculator/calculator.ipynb", folder)
    yield served
    stop_kernels_and_terminals(address, token)
    for path in folder.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    begin_home(folder.parent / "home")


def stop_kernels_and_terminals(address: str, token: str) -> None:
    """End what runs in a JupyterLab."""

    def ask(method: str, path: str) -> Any:
        headers = {"Authorization": f"token {token}"}
        request = urllib.request.Request(f"{address}/api/{path}", headers=headers, method=method)
        with urllib.request.urlopen(request, timeout=WAIT / 1e3) as answer:
            return json.loads(answer.read() or "null")

    for kernel in ask("GET", "kernels"):
        ask("DELETE", f"kernels/{kernel['id']}")
    for terminal in ask("GET", "terminals"):
        ask("DELETE", f"terminals/{terminal['name']}")


def begin_home(home: Path) -> None:
    """Give JupyterLab's user the settings of the tests, and no layout of an earlier test."""
    config = home / "config/lab"
    shutil.rmtree(config, ignore_errors=True)
    for name, text in SETTINGS.items():
        settings = config / f"user-settings/@jupyterlab/{name}.jupyterlab-settings"
        settings.parent.mkdir(parents=True, exist_ok=True)
        settings.write_text(text)


@contextlib.contextmanager
def serving(
    base: Path, folder: Path, before: tuple[str, str] | None = None, **variables: str
) -> Iterator[tuple[str, str]]:
    """A JupyterLab that serves `folder`, with a home below `base`: its address and its token.

    They are those of one `before` if that is given.
    """
    token = before[1] if before else secrets.token_hex(16)
    home = base / "home"
    begin_home(home)
    own = {
        "HOME": str(home),
        "JUPYTER_CONFIG_DIR": str(home / "config"),
        "XDG_RUNTIME_DIR": str(home),
        "COURSE_ARRANGE": "1",  # as environment/start does
        "COURSE_CACHE": str(Path.home() / ".cache" / "ros2-course"),
    }
    port = int(before[0].rpartition(":")[2]) if before else free_port()
    said = base / "jupyterlab.log"
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
    try:
        assert wait_until(lambda: answers(f"{address}/api") or server.poll() is not None, WAIT / 1e3)
        assert server.poll() is None, f"JupyterLab did not start:\n{said.read_text()}"
        yield address, token
    finally:
        end(server)


def end(server: subprocess.Popen) -> None:
    """End a JupyterLab, by force when it does not end by itself.

    jupyter_server 2.21 stops with requests under way; where one of them reads a file, a thread of anyio's is left that
    waits for ever for its task to end.  The kernels are ended before.
    """
    server.terminate()
    try:
        server.wait(ENDS)
    except subprocess.TimeoutExpired:
        server.kill()
        server.wait()


def answers(address: str) -> bool:
    """Return True if a server answers there."""
    try:
        urllib.request.urlopen(address, timeout=WAIT / 1e3).close()
    except OSError:
        return False
    return True


@pytest.fixture(scope="session")
def profile(chromium, tmp_path_factory):
    """A student's browser, which keeps what it has compiled of JupyterLab from one page to the next."""
    folder, size = tmp_path_factory.mktemp("profile"), {"width": 1500, "height": 950}
    profile = chromium.browser_type.launch_persistent_context(folder, viewport=size, **chromium_options())
    yield profile
    profile.close()


@pytest.fixture
def page(profile, request):
    """An empty page, large enough for a notebook beside a terminal."""
    profile.clear_cookies()
    page = profile.new_page()
    page.set_default_timeout(WAIT)
    yield page
    keep_picture(page, request.node.name)
    page.close()


# A driver that logs ten times a second, and first more than a panel keeps.
DRIVE = """import os
import course
from course.nodes.ai_robot_controller import AIRobotController
from course.world.node import World
ros = course.live()
ros.start(World, parameters={'room': 'hall'})
driver = ros.start(AIRobotController)
for number in range(1200):
    driver.node.get_logger().info(f'line {number}')
print('process', os.getpid())"""


@dataclass(frozen=True)
class Size:
    """The sizes of a page and its kernel at a moment."""

    at: float  # s, of the clock that only goes forward
    heap: int  # bytes of JavaScript's objects that are in use
    elements: int  # nodes of the page's tree
    resident: int  # bytes of the kernel's process


class LeftOpen:
    """A page with Nodes, Graph and Robot open, and how large it was when all three were full."""

    def __init__(self, page: Page, process: int):
        self.page = page
        self._process = psutil.Process(process)
        self._tools = page.context.new_cdp_session(page)
        self._tools.send("Performance.enable")
        self.before = self.measure()

    def measure(self) -> Size:
        """Return how large page and kernel are now, without garbage."""
        self._tools.send("HeapProfiler.collectGarbage")
        found = {each["name"]: each["value"] for each in self._tools.send("Performance.getMetrics")["metrics"]}
        resident = self._process.memory_info().rss
        return Size(time.monotonic(), int(found["JSHeapUsedSize"]), int(found["Nodes"]), resident)


@pytest.fixture(scope="package", autouse=True)
def left_open(request, tmp_path_factory):
    """A page that stays open until the tests of this folder are over; none when no test looks at it."""
    if not any(item.path.name == "test_whole_time.py" for item in request.session.items):
        yield None
        return
    base = tmp_path_factory.mktemp("left-open")
    (base / "served").mkdir()
    write_greeter(base / "served/open")
    with serving(base, base / "served") as (address, token):
        page = request.getfixturevalue("chromium").new_page(viewport={"width": 1500, "height": 950})
        page.set_default_timeout(WAIT)
        open_page(page, (address, token, base / "served"), "open/open.ipynb")
        page.get_by_role("tab", name="Graph", exact=True).click(button="right")
        page.locator(".lm-Menu-itemLabel").get_by_text("Switch Sidebar Side").click()  # where it does not hide Nodes
        page.get_by_role("region", name="Graph", exact=True).wait_for()
        run_from_palette(page, "ROS course", "Robot")
        page.get_by_role("tab", name="open.ipynb").click()
        run_cell(page, 0, DRIVE)
        printed = cell(page, 0).locator(".jp-OutputArea-output pre").get_by_text("process")
        printed.wait_for()
        show_panel(page, "Nodes")  # after the lines were logged: of those that come meanwhile it leaves some out
        expect(page.locator(".ros-Log-line")).to_have_count(1000, timeout=WAIT)
        expect(page.locator(".ros-Graph-list")).to_contain_text("/ai_robot_controller", timeout=WAIT)
        page.locator(".ros-Robot-canvas").wait_for()
        yield LeftOpen(page, int(printed.inner_text().split()[1]))
        page.close()
