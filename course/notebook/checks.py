"""`check()`: runs the notebook's public checks again, with one line of output each."""

import builtins
import contextlib
import io
from collections.abc import Collection
from pathlib import Path
from typing import Any

from IPython import get_ipython

from course.errors import CourseError, ExerciseError
from course.foundation import cells
from course.notebook.extension import CHECK, reason
from course.notebook.file_differences import differences
from course.notebook.needed_cells import SESSION, names_of
from course.session.live import Session, current


def check(name: str = "") -> None:
    """Run the public checks called `name`, or all, of the notebook in the kernel's folder, and print each outcome.

    They are the notebook's locked cells as last saved, and use copies of the variables of the cells run so far.  Files
    that differ from their cells are reported first.  Raises ExerciseError for a name that is not text.
    """
    session = current()
    if session and (why := session.elsewhere):
        print(f"note: {why}")
    known = {cell.name: cell.source for path in cells.notebooks(Path()) for cell in cells.read(path)
             if cell.public_check}  # fmt: skip
    _expect_text(name, known)
    checks = {found: source for found, source in known.items() if name in ("", found)}
    if not checks:
        listed = f": there are {', '.join(map(repr, known))}" if known else ""
        print(f"there are no checks {name!r} here{listed}" if name else "there are no checks here")
        return
    for why in differences().values():
        print(f"note: {why}")
    failed: list[str] = []
    names = _names()
    for found, source in checks.items():
        said = _run(source, names, {each: known[each] for each in failed})
        failed += [found] if said != cells.PASSED else []
        print(f"{found}: {said}")


def _expect_text(name: object, known: Collection[str]) -> None:
    """Raise ExerciseError for the name of a check without quotation marks, which is also a variable's."""
    if not isinstance(name, str):
        of_cells = (each for each, value in [*get_ipython().user_ns.items()] if value is name)
        own = (getattr(name, "name", ""), getattr(name, "__name__", ""), type(name).__name__)
        words = [each for each in (*of_cells, *own) if isinstance(each, str)]
        meant = cells.check_meant(words, known) or next(iter(known), "name")
        raise ExerciseError(f"the name of a check is a text, in quotation marks: course.check({meant!r})")


def _names() -> dict[str, Any]:
    """Return the names of the cells run so far, without those that hide a function of Python itself or the session."""
    of_python = {name for name in dir(builtins) if not name.startswith("__")}
    names = {name: value for name, value in get_ipython().user_ns.items() if name not in of_python}
    return {**names, SESSION: session} if (session := current()) else names


def _run(source: str, names: dict[str, Any], failed: dict[str, str]) -> str:
    """Return the outcome of a check, and who else has used its names if that may be why it has failed."""
    session = current()
    said = _outcome(source, names, failed, session)
    others = str(session.meanwhile) if session and said != cells.PASSED else ""
    return f"{said}; note: {others}" if others else said


def _outcome(source: str, names: dict[str, Any], failed: dict[str, str], session: Session | None) -> str:
    shell = get_ipython()
    try:
        own = session.checking(source) if session else contextlib.nullcontext()
        with contextlib.redirect_stdout(io.StringIO()), own:
            exec(compile(shell.transform_cell(source), CHECK, "exec"), names)
    except (AssertionError, CourseError) as error:
        return f"not yet: {error}"
    except NameError as error:
        first = next((name for name, text in failed.items() if error.name in names_of(text).made), "")
        if first:
            return f"not yet: it needs `{error.name}` of the check '{first}', which failed"
        where = reason(error, Path()).removeprefix("Hint: ")
        return f"not yet: {where or f'NameError: {error}'}"
    except Exception as error:
        return f"not yet: {type(error).__name__}: {error}"
    return cells.PASSED
