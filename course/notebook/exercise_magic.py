"""`%%exercise FILE`: writes the cell to the file that is handed in, and runs it as a live node beside the notebook."""

import contextlib
import difflib
import importlib
import linecache
import os
import re
import shlex
import sys
from argparse import Namespace
from importlib.util import cache_from_source
from pathlib import Path

from IPython.core.error import UsageError
from IPython.core.magic_arguments import argument, magic_arguments, parse_argstring

from course import registry
from course.errors import CourseError, ExerciseError, NodeFailed
from course.explaining.refused_lines import refused
from course.foundation import storage
from course.foundation.cells import MOST, content
from course.foundation.untrusted import read_regular
from course.interfaces import InterfaceError, build
from course.interfaces.builder import read_definition
from course.interfaces.kept import keep, packages
from course.notebook import file_record
from course.notebook.exercise_names import SUFFIXES, not_wanted, wanted_files
from course.notebook.file_differences import last_written, only_in_the_file, remember, remember_unwritten
from course.notebook.stubs import keep_copy
from course.session.live import current, live

ON_PURPOSE = re.compile(r"ended with exit status \d+(: it printed|\.)")  # not by an exception
PACKAGE = "my_package"  # of an interface whose cell names none
OPTIONS = ("--no-start", "--package")


@magic_arguments()
@argument("file", help="the file to write, beside the notebook")
@argument("--no-start", action="store_true", help="only write a .py file")
@argument("--package", default=PACKAGE, help="the ROS package that a .srv, .msg or .action belongs to")
@argument("arguments", nargs="*", help="the program's own arguments, after --")
def exercise(line: str, cell: str) -> None:
    """Write the cell to FILE.  A .py file is (re)started as a node in its own process; an interface is built."""
    cell = content(cell)
    line, separator, rest = line.partition(" -- ")
    options = _options(line)
    path = Path(options.file)
    if path.name != options.file or path.suffix not in SUFFIXES:
        files = ", ".join(wanted_files())
        raise UsageError(
            "%%exercise takes the name of a .py, .srv, .msg or .action file beside the notebook"
            + (f". The checks of this exercise use {files}" if files else "")
        )
    package = f" --package {options.package}" if options.package != PACKAGE else ""
    if why := not_wanted(path.name, package):
        print(f"note: {why}", file=sys.stderr)
    session = current()
    if session and (why := session.elsewhere):
        print(f"note: {why}", file=sys.stderr)
    foreign = _content(path) != last_written(path)
    try:
        if path.suffix == ".py":
            _check_syntax(path, cell)
            _write(path, cell)
        else:
            _interface(path, cell, options.package)
    except CourseError as error:
        remember_unwritten(path, f"refused: {error}".partition("\n")[0])
        raise
    except KeyboardInterrupt:
        remember_unwritten(path, "interrupted")
        print(f"{path.name}: not written, because the cell was interrupted", file=sys.stderr)
        raise
    if foreign:
        _tell_of_others(path)
    if path.suffix != ".py":
        return
    _forget_imports(path)
    if options.no_start:
        print(f"{path.name}: written")
        return

    try:
        process = live().start(path, *(shlex.split(rest) if separator else []))
    except NodeFailed as failure:
        if ON_PURPOSE.search(str(failure)) and "spin(" not in cell:
            raise NodeFailed(
                f"{failure}\n{path.name} was written. If it is to end by itself, as a client does, begin its cell with "
                f"`%%exercise {path.name} --no-start`: that writes the file only."
            ) from None
        raise
    if process.alive:
        print(f"{path.name}: written, running as {', '.join(process.nodes)}")
    else:
        live().watch.mark_told(process)
        print("\n".join([f"{path.name}: written, but it is not running:", *map(str, process.reports)]))


def _options(line: str) -> Namespace:
    """Return what the cell's first line says; raises UsageError, which says what to write."""
    try:
        return parse_argstring(exercise, line)
    except UsageError as error:
        said = str(error)
    if unknown := re.search(r"unrecognized arguments: (\S+)", said):
        near = difflib.get_close_matches(unknown[1], OPTIONS, 1)
        how = f"Did you mean `{near[0]}`?" if near else "A program's own arguments come after ` -- `."
        raise UsageError(f"`%%exercise` has no option `{unknown[1]}`. {how} Nothing was written.")
    if "the following arguments are required" not in said:
        raise UsageError(said)
    wanted = wanted_files()
    example = next((name for name in wanted if name.endswith(".py")), "server.py")
    raise UsageError(
        f"`%%exercise` needs the name of the file to write, as in `%%exercise {example}`"
        + (f". The checks of this exercise use {', '.join(wanted)}" if wanted else "")
    )


def _content(path: Path) -> bytes | None:
    with contextlib.suppress(OSError, ValueError):
        return read_regular(path, MOST)
    return None


def _write(path: Path, cell: str) -> None:
    """Write the cell's file atomically, so that the old one is kept if the disk is full.

    A text that is nowhere else is kept in a copy, which the reader is told.
    """
    copy, by_a_cell = None, False
    try:
        if (present := only_in_the_file(path, cell)) is not None:
            by_a_cell = file_record.written(path.parent).get(path.name) == file_record.digest(present)
            copy = keep_copy(path.parent, path.name, present, "edited")
        storage.replace(path, cell.encode("utf-8", errors="replace"))
    except IsADirectoryError:
        raise ExerciseError(
            f"{path.name} is a folder in {path.parent.resolve()}, so no file of this name can be written. Rename the "
            "folder, then run the cell again."
        ) from None
    except OSError as error:
        raise ExerciseError(
            f"{path.name} could not be written: {(error.strerror or str(error)).lower()} ({path.parent.resolve()}). "
            "Nothing was written; the file is unchanged. Free some space, or ask the owner of the folder, then run the "
            "cell again."
        ) from None
    remember(path, cell)
    if copy:
        why = f"{path.name} had been edited outside of this cell: what it contained is now in {copy.name}"
        if by_a_cell:
            why = f"this cell has an earlier text again: what {path.name} contained until now is kept in {copy.name}"
        print(f"note: {why}.", file=sys.stderr)


def _tell_of_others(path: Path) -> None:
    """Tell the reader about another kernel in this folder, which may have written the old file."""
    for each in registry.running():
        if Path(each.folder) == Path.cwd() and each.pid != os.getpid():
            print(
                f"note: another kernel (process {each.pid}) also works in this folder. If both write {path.name}, the "
                "last write counts.",
                file=sys.stderr,
            )
            return


def _forget_imports(path: Path) -> None:
    """Have the next import of this file, and of those beside it, load the new text; warn about earlier imports."""
    here = path.resolve().parent
    Path(cache_from_source(str(path))).unlink(missing_ok=True)  # its source may have the same second and size
    beside = {
        name
        for name, module in list(sys.modules.items())
        if (file := Path(getattr(module, "__file__", None) or "")).stem == name and file.resolve() == here / file.name
    }
    if path.stem not in beside:
        return
    for name in beside:
        del sys.modules[name]
    importlib.invalidate_caches()
    print(
        f"note: this notebook still uses the {path.stem} that it imported before {path.name} was written again. Run "
        "the cell with the import again.",
        file=sys.stderr,
    )


def _check_syntax(path: Path, cell: str) -> None:
    # A warning would quote the line from the file, which still has the old text.
    linecache.cache[path.name] = (len(cell), None, cell.splitlines(keepends=True), path.name)
    try:
        compile(cell, path.name, "exec")
    except SyntaxError as error:
        lines = cell.splitlines()
        number = error.lineno or 0
        # Python would read the line from the file, which still has the old text.
        quoted = lines[number - 1].strip() if 0 < number <= len(lines) else ""
        meant = f"\nHint: {why}" if (why := refused(cell, error)) else ""
        raise ExerciseError(
            f"{path.name}, line {number}: {error.msg}: {quoted}{meant}\n"
            f"Nothing was written: {path.name} is unchanged, and a program that was already running goes on."
        ) from None
    finally:
        linecache.cache.pop(path.name, None)


def _interface(path: Path, cell: str, package: str) -> None:
    # The other definitions of the package in this folder are built with it: one may use another.
    known = next((kept.files for kept in packages(Path()) if kept.package == package), ())
    try:
        others = [Path(name) for name in known if name != path.name and Path(name).exists()]
        built = build(package, {**{each.name: read_definition(each) for each in others}, path.name: cell})
    except InterfaceError as error:
        raise ExerciseError(str(error)) from None
    _write(path, cell)
    keep(Path(), built, {*known, path.name})
    print(f"{path.name}: written, built as {package}/{path.suffix[1:]}/{path.stem}")
