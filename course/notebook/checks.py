"""`check()`: run the notebook's public checks again, at any time and each in one line."""

import contextlib
import io
from pathlib import Path

from IPython import get_ipython

from course.notebook import cells


def check(name: str = "") -> None:
    """Run the public checks called `name`, or all, of the notebook beside the kernel, and say how each ended.

    They are the notebook's locked cells as last saved, and see what you have run so far.
    """
    checks = {
        cell.name: cell.source
        for path in sorted(Path().glob("*.ipynb"))
        for cell in cells.read(path)
        if cell.public_check and name in ("", cell.name)
    }
    if not checks:
        print(f"there are no checks {name!r} here" if name else "there are no checks here")
    for found, source in checks.items():
        print(f"{found}: {_run(source)}")


def _run(source: str) -> str:
    shell = get_ipython()
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            exec(compile(shell.transform_cell(source), "check", "exec"), shell.user_ns)
    except AssertionError as error:
        return f"not yet: {error}"
    except Exception as error:
        return f"not yet: {type(error).__name__}: {error}"
    return "passed"
