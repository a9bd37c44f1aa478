"""The IPython extension in every kernel of the course: the `%%exercise` magic, and hints for missing names.

IPython loads it by the environment's configuration (written by environment/install), so that a cell run before
`course.live()` can say which cell to run first.  It loads no ROS, so a kernel starts as fast as without it.
"""

import ast
import contextlib
import difflib
import linecache
import os
import re
import shutil
import sys
import threading
import time
import traceback
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from IPython import get_ipython

from course.errors import CourseError
from course.explaining import ros_1
from course.explaining.cell_loops import server_waited_for
from course.explaining.refused_lines import refused
from course.explaining.slips import slips
from course.explaining.source import is_cell, parse
from course.explaining.values_seen import misread
from course.foundation import cells
from course.notebook.display import cut_messages
from course.notebook.file_differences import written_by
from course.notebook.file_record import digest_of, note_checked
from course.notebook.folder_modules import add_folder
from course.notebook.needed_cells import SESSION, names_of
from course.session.guards import say

# A command that waits for an answer, with the name of the server.
ASKS = re.compile(r"\bros2 +(?:service +call|action +send_goal) +(?:-\S+ +)*[\"']?/?([\w/]+)")
# A command that asks the parameter services of a node, with its name.
PARAMETERS = re.compile(r"\bros2 +param +(?:get|set|list|dump|load|describe|delete) +(?:-\S+ +)*[\"']?/?([\w/]+)")
CHECK = "check"  # the name of the code of a check that `course.check()` runs
ALIKE = 0.8  # least similarity of a magic's name and `exercise`, which may be meant
LATE = 4.0  # s of a cell, after which the reader is told that the server is still in a callback
FOLDED = (str(Path(__file__).parents[1]), contextlib.__file__)  # the course's code, and what runs its contexts
NEXT = 1.0  # s to the second look at a cell that may be in a loop
FOR_A_SHELL = re.compile(r"^(ros2|course|colcon|python3?|pip) +[\w-].*$", re.MULTILINE)

_began = [0.0]  # when the last cell began, s
_looking = [threading.Event()]  # set when the last cell is over

if TYPE_CHECKING:
    from IPython.core.interactiveshell import InteractiveShell


def load_ipython_extension(shell: "InteractiveShell") -> None:
    """Add the magic, the hints and the reports of dead nodes to a shell; loading twice changes nothing."""
    if "exercise" in shell.magics_manager.magics["cell"]:
        return
    from course.interfaces import kept
    from course.notebook.exercise_magic import exercise

    shell.register_magic_function(exercise, magic_kind="cell", magic_name="exercise")  # type: ignore[call-arg]
    # IPython takes `%%exercise` below another line for a line magic of this name.
    shell.register_magic_function(_not_first, magic_kind="line", magic_name="%exercise")  # type: ignore[call-arg, arg-type]
    shell.register_magic_function(_with_a_blank, magic_kind="line", magic_name="%exercise ")  # type: ignore[call-arg, arg-type]
    # From Python 3.13 on, a program started by a kernel would colour its tracebacks, which hints and log readers parse.
    os.environ.setdefault("PYTHON_COLORS", "0")
    kept.use(Path())  # makes the folder's packages importable before there is a session
    if sys.flags.safe_path and "" not in sys.path:
        add_folder(CHECK)
    shell.register_magic_function(_misspelt, magic_kind="line", magic_name="%exercise?")  # type: ignore[call-arg, arg-type]
    shell.input_transformers_cleanup.append(_whole_cell)
    if shell.display_formatter:
        cut_messages(shell.display_formatter)
    shell.set_custom_exc((Exception, KeyboardInterrupt), _explain)
    shell.events.register("pre_run_cell", _news_before)
    shell.events.register("post_run_cell", _news_after)


def _whole_cell(lines: list[str]) -> list[str]:
    """Have a cell whose `%%exercise` is below comments, or written `%% exercise`, say so, whatever else it holds."""
    code = [line for line in lines if line.strip() and not line.startswith("#")]
    first = code[0].strip() if code else ""
    if found := re.match(r"%%\s+exercise\b(.*)", first):
        return [f"get_ipython().run_line_magic('%exercise ', {found[1].strip()!r})\n"]
    if (found := re.match(r"%%(\w+)(.*)", first)) and _is_exercise_misspelt(found[1]):
        return [f"get_ipython().run_line_magic('%exercise?', {f'{found[1]} {found[2].strip()}'!r})\n"]
    if first.startswith("%%exercise ") and not lines[0].startswith("%%"):
        return [f"get_ipython().run_line_magic('%exercise', {first.removeprefix('%%exercise').strip()!r})\n"]
    return lines


def _is_exercise_misspelt(name: str) -> bool:
    """Return True for `%%excercise`: a magic that does not exist, with a name like that of `%%exercise`."""
    shell = get_ipython()
    known = shell is not None and name in shell.magics_manager.magics["cell"]
    return not known and bool(difflib.get_close_matches(name.lower(), ["exercise"], 1, ALIKE))


def _misspelt(line: str) -> None:
    from IPython.core.error import UsageError

    name, _, rest = line.partition(" ")
    raise UsageError(f"There is no `%%{name}`. Write `%%exercise {rest}`. Nothing was written.")


def _with_a_blank(line: str) -> None:
    from IPython.core.error import UsageError

    raise UsageError(f"Write `%%exercise {line}`, without a space after `%%`. Nothing was written.")


def _not_first(line: str) -> None:
    from IPython.core.error import UsageError

    raise UsageError(
        f"`%%exercise {line}` must be the first line of its cell: move the comment, or anything else above it, below "
        "it. Nothing was written."
    )


def _explain(shell: "InteractiveShell", kind: type, error: Any, trace: Any, tb_offset: int | None = None) -> None:
    """Show the error as usual, and below it a hint: the cell to run, or what to do.

    Validate's report begins with a check's message instead of the check's lines.  An interruption (■) is one line.
    """
    if isinstance(error, KeyboardInterrupt) and not hasattr(error, "_render_traceback_"):
        error._render_traceback_ = lambda: [_interrupted(trace)]  # type: ignore[attr-defined]
    if "NBGRADER_VALIDATING" in os.environ and isinstance(error, AssertionError):
        error._render_traceback_ = lambda: [f"{kind.__name__}: {error}"]  # type: ignore[attr-defined]
    shell.showtraceback((kind, error, _folded(trace)), tb_offset=tb_offset)
    session = _session()
    if session is not None and session.meanwhile.goes_on and (others := str(session.meanwhile)):
        print(f"note: {others}", file=sys.stderr)
    unquoted = isinstance(error, NameError) and "course.check(" in _line(trace)
    if why := (unquoted and _known(error)) or reason(error, Path()) or _known(error):
        print(why, file=sys.stderr)


def _folded(trace: TracebackType) -> TracebackType | None:
    """Return a traceback without the course's calls between two cells' lines, as of `ros.start` and of `__init__`."""
    calls: list[TracebackType] = []
    following: TracebackType | None = trace
    while following:
        calls.append(following)
        following = following.tb_next
    files = [each.tb_frame.f_code.co_filename for each in calls]
    own = [at for at, file in enumerate(files) if is_cell(file)]
    shown = None
    for at in reversed(range(len(calls))):
        between = bool(own) and own[0] < at < own[-1]
        if not between or not files[at].startswith(FOLDED):
            call = calls[at]
            shown = TracebackType(shown, call.tb_frame, call.tb_lasti, call.tb_lineno)
    return shown


def _interrupted(trace: Any) -> str:
    at = _in_cells(trace)
    where = f" in line {at[-1].lineno}, `{at[-1].line}`" if at else ""
    return f"KeyboardInterrupt: the cell was interrupted{where}."


def _in_cells(trace: Any) -> list[traceback.FrameSummary]:
    return [frame for frame in traceback.extract_tb(trace) if is_cell(frame.filename)]


def _line(trace: Any) -> str:
    """Return the line of a cell in which an error was raised."""
    at = _in_cells(trace)
    return at[-1].line or "" if at else ""


def _known(error: Exception) -> str:
    """Return the session's hint on an error in the cell itself; '' without a session or a hint."""
    module = sys.modules.get("course.explaining.failure_report")
    return str(module.hint_on(error)) if module and not isinstance(error, CourseError) else ""


def reason(error: Exception, folder: Path) -> str:
    """Return a sentence that names the cell in `folder` that defines the name missing in `error`, or ''."""
    if isinstance(error, ModuleNotFoundError) and "." not in (error.name or ""):
        return _missing_package((error.name or "").split(".")[0], folder)
    if not isinstance(error, NameError):
        return ""
    name = error.name or ""
    if name == SESSION:
        return "Hint: `ros` is the live session: run the notebook's first code cell, `ros = course.live()`, first."
    if meant := _started(name, _line(error.__traceback__), folder):
        return f"Hint: {meant}"
    for path, cell in _code_cells(folder):
        # Variables of a check are of no use elsewhere, and the check may have one of the name of a node.
        if name in names_of(cell.source).made and (not cell.public_check or _is_in_a_check(error)):
            where = f"the cell of {path.name} {_sign_of(cell.source, name)}"
            return f"Hint: `{name}` is defined in {where}: run that cell first, and let it finish."
    return ""


def _started(name: str, line: str, folder: Path) -> str:
    """Return what a line that starts, stops or restarts the node or file `name`, without quotation marks, must be."""
    found = re.search(rf"\bros\.(start|stop|restart)\(\s*{re.escape(name)}(\.py)?\s*[,)]", line)
    if not found:
        return ""
    if found[2] or (folder / f"{name}.py").is_file():
        return f'`{name}.py` is a file: write its name as text, `ros.{found[1]}("{name}.py")`.'
    classes = [each for _, cell in _code_cells(folder) if not cell.public_check for each in _node_classes(cell.source)]
    cls = next((cls for cls, node in classes if node == name), "")
    if not cls:
        return ""
    if found[1] == "start":
        return f"`{name}` is the name of a node, and `ros.start` takes its class: write `ros.start({cls})`."
    return f'The name of a node is a text: write `ros.{found[1]}("{name}")`.'


def _node_classes(source: str) -> list[tuple[str, str]]:
    """Return the classes of a cell that name their node in `super().__init__("name")`, each with that name."""
    if source.lstrip().startswith("%%"):
        return []
    found = []
    for cls in (each for each in parse(source).body if isinstance(each, ast.ClassDef)):
        named = re.search(r"super\(\)\.__init__\(\s*['\"]/?(\w+)['\"]", ast.unparse(cls))
        found += [(cls.name, named[1])] if named else []
    return found


def _is_in_a_check(error: Exception) -> bool:
    """Return True if an error was raised in a public check of the kernel's folder."""
    files = [frame.filename for frame in traceback.extract_tb(error.__traceback__)]
    return CHECK in files or any(_as_check("".join(linecache.getlines(file)).rstrip("\n")) for file in files)


def _sign_of(source: str, name: str) -> str:
    """Return how a cell is found: by its line that makes the class or function `name`, or else by its first line."""
    lines = [line for line in source.splitlines() if line.strip()]
    made = next((line for line in lines if re.match(rf"(?:async )?(?:def|class) {re.escape(name)}\b", line)), "")
    return f"with the line `{made[:60]}`" if made else f"that begins with `{lines[0][:60]}`"


def _missing_package(package: str, folder: Path) -> str:
    for path, cell in _code_cells(folder):
        first = cell.source.lstrip("\n").partition("\n")[0].split()
        if first[:1] == ["%%exercise"] and package in first[2:]:
            gone = "" if (path.parent / first[1]).exists() else f" ({first[1]} no longer exists)"
            return f"Hint: the cell `{' '.join(first)}` builds {package}: run it first{gone}."
        if first[:1] != ["%%exercise"] and (built := _builds(cell.source, package)):
            return f"Hint: the cell of {path.name} with the line `{built}` builds {package}: run it first."
    return ""


def _builds(source: str, package: str) -> str:
    """Return the line of a cell that builds a package: `build("my_package", {...`; '' if none does."""
    begun = re.compile(rf"\s*(?:\w+ = )?build\(\s*([\"']){re.escape(package)}\1")
    return next((line.strip()[:60] for line in source.splitlines() if begun.match(line)), "")


def _code_cells(folder: Path) -> list[tuple[Path, cells.Cell]]:
    known = cells.readable(cells.notebooks(folder))
    return [(path, cell) for path, of_one in known for cell in of_one if cell.kind == "code"]


def _news_before(info: Any = None, *_: Any) -> None:
    """Report, before a cell runs, nodes that have died since the last one; look for a loop while it runs."""
    _began[0] = time.monotonic()
    _looking[0].set()
    _looking[0] = threading.Event()
    args = (_looking[0], threading.get_ident(), _began[0])
    threading.Thread(target=_look_for_a_loop, args=args, name="looks for a loop", daemon=True).start()
    for text in _pending():
        print(text, file=sys.stderr)
    source, session = str(getattr(info, "raw_cell", "")), _session()
    if session is not None and _as_check(source):
        session.begin_check(source)


def _look_for_a_loop(over: threading.Event, thread: int, began: float) -> None:
    """Tell the reader of a loop in which the cell of this thread is at two looks, unless the cell is over."""
    loop = None
    for seconds in (LATE, NEXT):
        if over.wait(seconds) or (session := _session()) is None:
            return
        loop = session.tell_of_a_loop(thread, time.monotonic() - began, loop)
    if not over.is_set() and (file := server_waited_for(thread)):
        say(
            f"{file} still runs, and this cell waits for it to end. A server does not end by itself: the ■ button ends "
            f"it, and `ros.start('{file}')` starts it so that the next cells can run."
        )


def _news_after(result: Any, *_: Any) -> None:
    """Report, after a cell, slips in its text and messages from its nodes' callbacks; note a check that has run."""
    cell = str(result.info.raw_cell or "")
    _looking[0].set()
    if result.error_before_exec is None:
        _note_check(cell, passed=bool(result.success))
    if isinstance(result.error_before_exec, SyntaxError):
        _tell_of_shell(cell, result.error_before_exec)
    for line in cell.splitlines():
        if line.startswith("!ros") and (how := ros_1.command(line[1:])) and not shutil.which(line[1:].split()[0]):
            print(f"Hint: {how}", file=sys.stderr)
    shell = get_ipython()
    for text in (*slips(cell), *(misread(cell, shell.user_ns) if shell else ())):
        print(text, file=sys.stderr)
    session = _session()
    if session is not None:
        late = time.monotonic() - _began[0] > LATE
        asked = [*ASKS.findall(cell), *(f"{node}/get_parameters" for node in PARAMETERS.findall(cell))] if late else []
        for at in filter(None, (session.doing(f"/{name}", groups=False) for name in dict.fromkeys(asked))):
            print(at, file=sys.stderr)
        for text in session.watch.notices():
            print(text, file=sys.stderr)


def _tell_of_shell(cell: str, error: SyntaxError) -> None:
    """Tell the reader about a line for a shell, or of another language, in a cell that is not Python."""
    if found := FOR_A_SHELL.search(cell):
        print(f"Hint: This line is for a shell: in a cell, write it with `!`: `!{found[0].strip()}`", file=sys.stderr)
    elif how := ros_1.command(error.text or "") or refused(cell, error):
        print(f"Hint: {how}", file=sys.stderr)


def _note_check(source: str, *, passed: bool) -> None:
    """Note which files a public check of a notebook in the kernel's folder has judged."""
    for path, known, at in _as_check(source):
        digests = {name: digest_of(path.parent / name) for above in known[:at] if (name := written_by(above))}
        note_checked(path.parent, known[at].name, digests, passed=passed)
        if (session := _session()) is not None:
            session.end_check(passed=passed)


def _as_check(source: str) -> list[tuple[Path, list[cells.Cell], int]]:
    """Return the notebooks in the kernel's folder with this public check: path, cells, and the check's index."""
    if "assert" not in source:  # most cells are none, and reading the notebooks takes time
        return []
    pages = cells.readable(cells.notebooks(Path()))
    return [
        (path, known, at)
        for path, known in pages
        for at, cell in enumerate(known)
        if cell.public_check and cell.source == source
    ]


def _pending() -> list[str]:
    session = _session()
    return session.watch.pending() if session is not None else []


def _session() -> Any:
    """Return the live session of this process, if there is one, without loading its module."""
    module = sys.modules.get("course.session.live")
    return module.current() if module else None
