"""Runs a notebook's public checks in a separate kernel, with only the cells they need, for Validate and the hand-in."""

import os
import re
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import DeadKernelError
from nbformat import NotebookNode

from course import registry
from course.foundation.cells import FAILED, PASSED, UNFINISHED, Cell
from course.notebook.file_differences import written_by
from course.notebook.needed_cells import needed_cells

DOMAIN = "ROS_DOMAIN_ID"
TOLD = ("AssertionError", "CallTimeout", "ExerciseError", "InterfaceError", "LiveError", "NodeFailed")  # by message
CELL = 60  # s that a cell may take
COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def validate_what_is_needed() -> None:
    """Have nbgrader's Validate, in this process, skip cells that no exercise needs, and leave the folder as it is.

    nbgrader has no setting for either.  It is imported here alone, because the hand-in does without it.
    """
    from nbgrader.validator import Validator

    from course.notebook.validating import STEPS

    Validator.preprocessors.default_args = ([*STEPS],)


def outcomes(
    cells: list[Cell], files: Mapping[str, bytes], folder: Path, tell: Callable[[int, int], None] = lambda ran, of: None
) -> dict[str, str]:
    """Return the outcome of each public check of a notebook with these `files`: "passed", or "not yet: " and why.

    `folder` must be empty: `files`, not the exercise cells, are written there, and nothing of a cell whose file is not
    among them.  `tell` is called with the number of
    checks done and their total after each check.
    """
    wanted = [cells[number] for number in needed_cells(cells)]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(_source(cell, files)) for cell in wanted])
    client = NotebookClient(
        notebook,
        timeout=CELL,
        interrupt_on_timeout=True,
        error_on_timeout={"ename": "Timeout", "evalue": f"it had not finished after {CELL} s", "traceback": []},
        allow_errors=True,
        kernel_name="python3",
        resources={"metadata": {"path": str(folder)}},
    )
    checked = [number for number, cell in enumerate(wanted) if cell.public_check]

    def on_cell_executed(cell: NotebookNode, cell_index: int, **_: Any) -> None:
        if cell_index in checked:
            tell(checked.index(cell_index) + 1, len(checked))

    client.on_cell_executed = on_cell_executed
    died = ""
    try:
        client.execute(stderr=subprocess.DEVNULL, env=_kernel_variables())
    except DeadKernelError:
        died = f"{FAILED}the kernel ended before this check had finished"
    checks = zip(wanted, notebook.cells, strict=True)
    return {cell.name: _outcome(ran) or died or PASSED for cell, ran in checks if cell.public_check}


def _kernel_variables() -> dict[str, str]:
    """Return the variables of a kernel that joins no running session: its programs would be in the checks' way."""
    domain = os.environ.get(DOMAIN, "")
    joined = domain.isdecimal() and registry.of_domain(int(domain))
    return {name: value for name, value in os.environ.items() if name != DOMAIN or not joined}


def _source(cell: Cell, files: Mapping[str, bytes]) -> str:
    name = written_by(cell)
    if not name:
        return cell.source
    if name not in files:
        return ""
    first = cell.source.lstrip("\n").partition("\n")[0]
    return f"{first}\n{files[name].decode(errors='replace')}"


def _outcome(ran: NotebookNode) -> str:
    error = next((output for output in ran.outputs if output.output_type == "error"), None)
    if error is None:
        return ""
    if error.ename in ("KeyboardInterrupt", "Interrupted"):  # by the time limit
        marked = re.search(r" in line \d+, (`.*`)\.$", COLOUR.sub("", "\n".join(error.traceback)))
        return f"{UNFINISHED}{CELL} s{f', in {marked[1]}' if marked else ''}"
    why = COLOUR.sub("", error.evalue).strip()
    return f"{FAILED}{why if error.ename in TOLD and why else f'{error.ename}: {why}'}"
