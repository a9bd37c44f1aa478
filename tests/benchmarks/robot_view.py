"""The robot view while a robot drives: pictures a second and the kernel's load, also while a cell runs; what it sends.

Run it with `python tests/benchmarks/robot_view.py`.
"""

import os
import statistics
import sys
import time
from pathlib import Path

import pytest

from course.foundation.processes import stat

SPAN = 10.0  # s of each measurement
ROUNDS = 3
WAITING = "import pathlib\nros.until(pathlib.Path('end').exists, 600)"
RENDERER = """() => {
  const gl = document.createElement('canvas').getContext('webgl');
  const names = gl && gl.getExtension('WEBGL_debug_renderer_info');
  return names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : 'the processor alone';
}"""
TICK = os.sysconf("SC_CLK_TCK")


def busy(process: int) -> float:
    """The processor time (s) that all threads of a process have taken."""
    fields = stat(process)
    return (int(fields[11]) + int(fields[12])) / TICK


def frames(page) -> int:
    return int(page.locator(".ros-Robot-canvas").get_attribute("data-frames") or 0)


def test_robot_view(lab, page):
    from tests.browser.test_robot import BUSY, DRIVER, begin, open_view, run_cell, start_world

    received = []
    page.on(
        "websocket",
        lambda socket: (
            socket.on("framereceived", lambda frame: received.append(len(frame)))
            if "course/lab" in socket.url
            else None
        ),
    )
    view = begin(page, lab, "measured")
    start_world(view, "pillars")
    run_cell(page, 1, f"{DRIVER}\nimport os, pathlib\n_ = pathlib.Path('process').write_text(str(os.getpid()))")
    view.get_by_label("obstacle_threshold").wait_for()
    process = int((lab[2] / "measured/process").read_text())
    loads: dict[str, list[float]] = {"open": [], "closed": []}
    for _ in range(ROUNDS):
        page.wait_for_timeout(2000)
        began, took, drawn = time.monotonic(), busy(process), frames(page)
        received.clear()
        page.wait_for_timeout(1000 * SPAN)
        span = time.monotonic() - began
        loads["open"].append((busy(process) - took) / span)
        print(f"\n{(frames(page) - drawn) / span:.0f} pictures a second, {sum(received) / span / 1000:.1f} kB a second")
        page.get_by_role("tab", name="Robot", exact=True).locator(".lm-TabBar-tabCloseIcon").click()
        page.wait_for_timeout(2000)
        began, took = time.monotonic(), busy(process)
        page.wait_for_timeout(1000 * SPAN)
        loads["closed"].append((busy(process) - took) / (time.monotonic() - began))
        open_view(page, "measured")
    end = lab[2] / "measured/end"
    for what, cell in (("waits", WAITING), ("computes", BUSY)):
        end.unlink(missing_ok=True)
        run_cell(page, 2, cell)
        page.locator('.jp-Notebook-ExecutionIndicator[data-status="busy"]').wait_for(state="attached")
        page.wait_for_timeout(2000)
        began, took, drawn = time.monotonic(), busy(process), frames(page)
        page.wait_for_timeout(1000 * SPAN)
        span = time.monotonic() - began
        rate, share = (frames(page) - drawn) / span, 100.0 * (busy(process) - took) / span
        print(f"{rate:.0f} pictures a second while a cell {what}; the kernel takes {share:.0f} % of a core")
        end.touch()
        page.locator('.jp-Notebook-ExecutionIndicator[data-status="idle"]').wait_for(state="attached")
    print(f"drawn by {page.evaluate(RENDERER)}; load of the machine: {os.getloadavg()[0]:.1f}, cores: {os.cpu_count()}")
    shares = {name: 100.0 * statistics.median(values) for name, values in loads.items()}
    print(f"kernel with the view: {shares['open']:.1f} % of a core; with the world and its driver alone: "
          f"{shares['closed']:.1f} %; the view takes {shares['open'] - shares['closed']:.1f} %")  # fmt: skip


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))
    sys.exit(pytest.main(["-q", "-s", "-p", "tests.browser.conftest", "--timeout=0", __file__]))
