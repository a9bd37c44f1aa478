"""The protocol between a page and a kernel: lines of JSON, through a Unix socket that the Jupyter server relays.

From the page:    {"id": 7, "method": "nodes.stop", "params": {"name": "adder"}}   a request
                  {"id": 8, "method": "subscribe", "params": {"topic": "nodes", "options": {}}}
                  {"ack": 8}                                             it has taken in an event of subscription 8
                  {"id": 9, "method": "unsubscribe", "params": {"id": 8}}
To the page:      {"id": 7, "result": null}  or  {"id": 7, "error": "what happened and what to do"}
                  {"id": 8, "topic": "nodes", "data": ...}               an event
                  {"id": 8, "topic": "nodes", "error": "..."}            the subscription has ended
From the server:  {"link": "up"}, "waiting" for a kernel to make a live session, or "connecting" once more
"""

import contextlib
import json
import math
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from jupyter_core.paths import jupyter_runtime_dir

LINE = 16 * 1024 * 1024  # bytes of a line at most; an event has less, see `course/lab/kernel/bridge.py`
KERNEL_ID = r"[0-9A-Za-z_-]{1,64}"


def socket_path(kernel_id: str) -> Path:
    """Return the socket of the kernel `kernel_id`, in Jupyter's runtime folder, which is private to its user."""
    if not re.fullmatch(KERNEL_ID, kernel_id):
        raise ValueError(f"an invalid kernel id: {kernel_id!r}")
    return Path(jupyter_runtime_dir()) / f"course-lab-{kernel_id}.sock"


@contextlib.contextmanager
def address(path: Path) -> Iterator[str]:
    """Yield a name of at most 107 bytes for the socket at `path`, as Linux requires; raises OSError."""
    folder = os.open(path.parent, os.O_PATH | os.O_DIRECTORY)
    try:
        yield f"/proc/self/fd/{folder}/{path.name}"
    finally:
        os.close(folder)


def encoded(message: Any) -> bytes:
    """Return a message as a line; raises ValueError and TypeError for values that JSON lacks, such as infinity."""
    text = json.dumps(message, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return text.encode(errors="backslashreplace") + b"\n"  # JSON writes half a character as Python does


def finite(data: Any) -> Any:
    """Return JSON data with None in place of each number that JSON lacks: infinity, and what is not a number."""
    if isinstance(data, float):
        return data if math.isfinite(data) else None
    if isinstance(data, dict):
        return {name: finite(value) for name, value in data.items()}
    if isinstance(data, list | tuple):
        return [finite(value) for value in data]
    return data
