"""`%%exercise FILE`: the cell is the file that is handed in, and runs as a live node beside the notebook."""

import shlex
from pathlib import Path

from IPython.core.error import UsageError
from IPython.core.magic_arguments import argument, magic_arguments, parse_argstring

from course.errors import ExerciseError
from course.foundation.cells import content
from course.interfaces import InterfaceError, build
from course.interfaces.definition import SECTIONS
from course.interfaces.kept import keep, packages
from course.notebook.file_differences import remember
from course.session.live import live


@magic_arguments()
@argument("file", help="the file to write, beside the notebook")
@argument("--no-start", action="store_true", help="only write a .py file")
@argument("--package", default="my_package", help="the ROS package that a .srv, .msg or .action belongs to")
@argument("arguments", nargs="*", help="the program's own arguments, after --")
def exercise(line: str, cell: str) -> None:
    """Write the cell to FILE.  A .py file is (re)started as a node in its own process; an interface is built."""
    cell = content(cell)
    line, separator, rest = line.partition(" -- ")
    options = parse_argstring(exercise, line)
    path = Path(options.file)
    if path.name != options.file or path.suffix not in (".py", *(f".{kind}" for kind in SECTIONS)):
        raise UsageError("%%exercise takes the name of a .py, .srv, .msg or .action file beside the notebook")
    if path.suffix != ".py":
        _interface(path, cell, options.package)
        return
    _check_syntax(path, cell)
    path.write_text(cell, encoding="utf-8")
    remember(path, cell)
    if options.no_start:
        print(f"{path.name}: written")
        return

    process = live().start(path, *(shlex.split(rest) if separator else []))
    if process.alive:
        print(f"{path.name}: written, running as {', '.join(process.nodes)}")
    else:
        live().watch.mark_told(process)
        print("\n".join([f"{path.name}: written, but it does not run:", *map(str, process.reports)]))


def _check_syntax(path: Path, cell: str) -> None:
    try:
        compile(cell, path.name, "exec")
    except SyntaxError as error:
        lines = cell.splitlines()
        number = error.lineno or 0
        # Python would read the line from the file, which still is the one of before.
        quoted = lines[number - 1].strip() if 0 < number <= len(lines) else ""
        raise ExerciseError(
            f"{path.name}, line {number}: {error.msg}: {quoted}\n"
            f"Nothing was written: {path.name} is as it was, and what ran before runs on."
        ) from None


def _interface(path: Path, cell: str, package: str) -> None:
    # The other definitions of the package in this folder are built with it: one may use another.
    known = next((kept.files for kept in packages(Path()) if kept.package == package), ())
    texts: dict[str | Path, str] = {
        name: Path(name).read_text(encoding="utf-8") for name in known if Path(name).exists()
    }
    try:
        built = build(package, {**texts, path.name: cell})
    except InterfaceError as error:
        raise ExerciseError(str(error)) from None
    path.write_text(cell, encoding="utf-8")
    remember(path, cell)
    keep(Path(), built, {*known, path.name})
    print(f"{path.name}: written, built as {package}/{path.suffix[1:]}/{path.stem}")
