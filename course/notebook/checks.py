"""`check()`: runs the notebook's public checks again, with one line of output each."""

import contextlib
import io
from collections.abc import Collection
from pathlib import Path

from IPython import get_ipython

from course.errors import CourseError, ExerciseError
from course.foundation import cells
from course.notebook.extension import reason
from course.notebook.file_differences import differences
from course.notebook.needed_cells import names_of
from course.session.live import current


def check(name: str = "") -> None:
    """Run the public checks called `name`, or all, of the notebook in the kernel's folder, and print each outcome.

    They are the notebook's locked cells as last saved, and use the variables of the cells run so far.  Files that
    differ from their cells are reported first.  Raises ExerciseError for a name that is no text.
    """
    session = current()
    if session and (why := session.elsewhere):
        print(f"note: {why}")
    known = {cell.name: cell.source for path in sorted(Path().glob("*.ipynb")) for cell in cells.read(path)
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
    for found, source in checks.items():
        said = _run(source, {each: known[each] for each in failed})
        failed += [found] if said != cells.PASSED else []
        print(f"{found}: {said}")


def _expect_text(name: object, known: Collection[str]) -> None:
    """Raise ExerciseError for the name of a check without quotation marks, which is also a variable's."""
    if not isinstance(name, str):
        meant = next((each for each in known if get_ipython().user_ns.get(each) is name), next(iter(known), "name"))
        raise ExerciseError(f"the name of a check is a text, in quotation marks: course.check({meant!r})")


def _run(source: str, failed: dict[str, str]) -> str:
    shell = get_ipython()
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            exec(compile(shell.transform_cell(source), "check", "exec"), shell.user_ns)
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
