"""The names of an exercise's files: those that its public checks use, and what is said about others."""

import difflib
import re
from collections.abc import Iterator
from pathlib import Path

from course.explaining.source import parse, text_at
from course.foundation import cells
from course.foundation.syntax import imported
from course.interfaces.definition import SECTIONS

SUFFIXES = (".py", *(f".{kind}" for kind in SECTIONS))
QUOTED = re.compile(rf"""["'](\w+(?:{"|".join(map(re.escape, SUFFIXES))}))["']""")
ALIKE = 0.6  # least similarity of a name and the one that is meant


def wanted_files(folder: Path = Path()) -> list[str]:
    """Return the names of the files that the public checks of the notebooks in `folder` use, sorted."""
    found: set[str] = set()
    for _, known in cells.readable(cells.notebooks(folder)):
        for cell in known:
            found |= set(QUOTED.findall(cell.source)) if cell.public_check else set()
    return sorted(found)


def not_wanted(name: str, options: str = "") -> str:
    """Return a sentence for the name of a file that no check in the kernel's folder uses; '' for one that is used.

    The cell begins with `%%exercise NAME`, and these options.
    """
    wanted = wanted_files()
    if not wanted or name in wanted:
        return ""
    near = difflib.get_close_matches(name, wanted, 1, ALIKE)
    meant = f" If it should be {near[0]}, begin the cell with `%%exercise {near[0]}{options}`." if near else ""
    return f"{name} is not a file that the checks of this exercise use ({', '.join(wanted)}).{meant}"


def left_behind(file: str) -> Iterator[tuple[int, str]]:
    """Yield the line and the name of each module that `file` imports from its folder but no exercise uses."""
    wanted = wanted_files()
    for line, name in imported(parse(text_at(Path(file)))) if wanted else ():
        if Path(f"{name}.py").is_file() and f"{name}.py" not in wanted:
            yield line, name


def instead_of(name: str) -> str:
    """Return a sentence on a file in the kernel's folder that may have been meant as the missing `name`, or ''.

    Without a notebook there, as in the folder of a hand-in's checks, any file may be that of another task.
    """
    wanted = wanted_files()
    beside = [path.name for path in Path().iterdir() if path.suffix == Path(name).suffix and path.name not in wanted]
    near = difflib.get_close_matches(name, beside, 1, ALIKE) if wanted else []
    return f" There is {near[0]}: if that is meant, begin its cell with `%%exercise {name}`." if near else ""
