"""A notebook's kernel for the tests."""

import os
import re
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

from jupyter_client.manager import start_new_kernel

COLOUR = re.compile(r"\x1b\[[0-9;]*m")


class Kernel:
    """A kernel in a folder of its own; `run` gives what a cell printed, or the lines of its error, without colours."""

    def __init__(self, folder: Path, environment: dict[str, str] | None = None):
        """Start it, with the variables of `environment` beside those of this process."""
        self.folder = folder
        self.seconds = 0.0  # that the last cell took
        self.manager, self.client = start_new_kernel(
            kernel_name="python3", cwd=str(folder), env=os.environ | (environment or {}), stderr=subprocess.DEVNULL
        )

    def run(self, cell: str, timeout: float = 60, seen: Callable[[str], None] = lambda text: None) -> str:
        """Run a cell, for at most `timeout` s; `seen` is given all that it has printed whenever more has come."""
        out: list[str] = []

        def collect(message):
            if message["msg_type"].startswith("comm_"):
                return  # for pages
            content = message["content"]
            out.append(
                content.get("text")
                or content.get("data", {}).get("text/plain", "") + "\n" * ("data" in content)
                or "".join(f"{line}\n" for line in content.get("traceback", ()))
            )
            seen(plain())

        def plain() -> str:
            return COLOUR.sub("", "".join(text for text in out if text)).strip()

        began = time.monotonic()
        self.client.execute_interactive(cell, timeout=timeout, output_hook=collect)
        self.seconds = time.monotonic() - began
        return plain()

    def interrupt(self) -> None:
        """Interrupt the kernel, as the button ■ does."""
        self.manager.interrupt_kernel()

    def stop(self) -> None:
        """End it."""
        self.client.stop_channels()
        self.manager.shutdown_kernel(now=True)
