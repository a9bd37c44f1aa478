"""Starts answering pages and recording in a kernel, as soon as its session has begun."""

import contextlib
import os
from pathlib import Path

from ipykernel.connect import get_connection_file

from course.lab.kernel.bridge import Bridge
from course.lab.kernel.panels import Panels
from course.lab.protocol import socket_path

SERVED = "JPY_SESSION_NAME"  # set by a Jupyter server for a notebook's kernel, but not by tools that execute notebooks

_bridge: list[Bridge] = []


def start() -> None:
    """Start listening for pages, once; in a process that is not a kernel, or cannot listen, the panels stay empty.

    In JupyterLab, also start recording requests.
    """
    if os.environ.get(SERVED):
        from course.lab.kernel import traffic

        traffic.record()
    if _bridge:
        return
    with contextlib.suppress(OSError, RuntimeError, ValueError):
        kernel = Path(get_connection_file()).stem  # kernel-ID
        _bridge.append(Bridge(socket_path(kernel.removeprefix("kernel-")), _panels))


def _panels() -> Panels:
    """Return the methods and topics of all panels.  A new panel is added here."""
    from course.lab.kernel import driving, graph_picture, inspector, knobs, log, nodes, plot, robot

    panels = Panels()
    for panel in (driving, graph_picture, inspector, knobs, log, nodes, plot, robot):
        panel.add(panels)
    return panels
