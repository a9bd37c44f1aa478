"""The start of a kernel's answers to pages, and of its recording, at its first `course.live()`."""

import contextlib
import os
from pathlib import Path

from ipykernel.connect import get_connection_file

from course.lab.kernel.bridge import Bridge
from course.lab.kernel.panels import Panels
from course.lab.protocol import socket_path

SERVED = "JPY_SESSION_NAME"  # set by a Jupyter server for the kernel of a notebook, and not where one is executed

_bridge: list[Bridge] = []


def start() -> None:
    """Listen for pages, once; in a process that is not a kernel, or may not listen, the panels just stay empty.

    For a notebook in JupyterLab, what passes is recorded from now on.
    """
    if os.environ.get(SERVED):
        from course.lab.kernel import passing

        passing.record()
    if _bridge:
        return
    with contextlib.suppress(OSError, RuntimeError, ValueError):
        kernel = Path(get_connection_file()).stem  # kernel-ID
        _bridge.append(Bridge(socket_path(kernel.removeprefix("kernel-")), _panels))


def _panels() -> Panels:
    """Every panel's methods and topics.  A new panel is added here."""
    from course.lab.kernel import driving, graph_picture, inspector, knobs, log, nodes, plot, robot

    panels = Panels()
    for panel in (driving, graph_picture, inspector, knobs, log, nodes, plot, robot):
        panel.add(panels)
    return panels
