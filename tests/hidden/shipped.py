"""The points that the students' files would earn as answers: `python -m tests.hidden.shipped [EXERCISE]...`

It makes the student release, takes from it every ROS program, the shown code of every page, and what a student could
paste together of both, and hands each in under every file name of every exercise.  It prints what each earns, and exits
with 1 when something earns half of an exercise's points.
"""

import argparse
import ast
import os
import re
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from autograder.gradebook.release import hand_out, release
from autograder.grading import single
from autograder.records import GRADED, Report, Submission
from autograder.sandbox import sandbox
from autograder.submissions import exercises
from autograder.submissions.exercises import Exercise
from course.foundation import cells

from . import answers

NOTHING = b"pass\n"  # in the place of a file that is not looked at
INLINED = ("nodes", "robot", "world", "recorders", "ros", "errors", "foundation")  # what a program can need
FENCED = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
NAMED = {"create_publisher", "create_subscription", "create_service", "create_client", "ActionServer", "ActionClient"}
MAIN = re.compile(r"^(?:if __name__ == .__main__.:|rclpy\.init\()", re.MULTILINE)
PATIENCE = 0.5  # most of these programs keep the grader waiting in vain
SPIN = """

def spin_nodes(wanted):
    import rclpy
    from rclpy.executors import MultiThreadedExecutor
    from rclpy.node import Node
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=8)
    for kind in list(globals().values()):
        if isinstance(kind, type) and issubclass(kind, Node) and kind is not Node and wanted in (kind.__name__, ""):
            try:
                executor.add_node(kind())
            except Exception as error:
                print(kind, error)
    executor.spin()


if __name__ == "__main__":
    spin_nodes("{wanted}")
"""

Grade = Callable[..., "Future[Report]"]


def student_files(folder: Path) -> Path:
    """Lay out in `folder` what a student gets, and return where."""
    hand_out(folder / "student", release(folder / "course"))
    return folder / "student"


def candidates(student: Path) -> dict[str, bytes]:
    """The programs that could be handed in, by what they are made of."""
    programs = {
        path.relative_to(student).as_posix(): path
        for path in sorted(student.rglob("*.py"))
        if MAIN.search(path.read_text(encoding="utf-8"))  # without it a file does nothing when it is started
    }
    found = {name: _bundled(student, [path.read_text(encoding="utf-8")]) for name, path in programs.items()}
    nodes = [path.read_text(encoding="utf-8") for path in sorted((student / "course/nodes").glob("*.py"))]
    found["all of course/nodes"] = _bundled(student, nodes, main=False) + spinning()
    robot = [path.read_text(encoding="utf-8") for path in sorted((student / "course/robot").glob("*.py"))]
    found["all of course/nodes and course/robot"] = _bundled(student, [*robot, *nodes], main=False) + spinning()
    every = []
    for notebook in sorted(student.glob("notebooks/[!.]*/*.ipynb")):
        shown = [*_shown(notebook)]
        every += shown
        found[f"code of {notebook.name}"] = _bundled(student, shown, main=False) + spinning()
        for first, text in _written(notebook):
            found[f"{notebook.name}: {first}"] = text
    found["code of all notebooks"] = _bundled(student, every, main=False) + spinning()
    return {name: text.encode() for name, text in found.items()}


def spinning(wanted: str = "") -> str:
    """A main program that makes and spins a node of each class, or of the `wanted` one alone."""
    return SPIN.replace("{wanted}", wanted)


def single_nodes(student: Path, exercise: Exercise) -> dict[str, bytes]:
    """Programs of one node of a page each, for the nodes that use a topic, service or action of the exercise.

    Of all nodes of a page together, one may spoil what another does.
    """
    names = {
        text.value.strip("/")
        for file in programs_of(exercise)
        for call in ast.walk(_parsed(answers.solution(exercise.name)[file].decode()))
        if isinstance(call, ast.Call) and ast.unparse(call.func).split(".")[-1] in NAMED
        for text in _texts(call)
    }
    found = {}
    for notebook in sorted(student.glob("notebooks/[!.]*/*.ipynb")):
        shown = [*_shown(notebook)]
        classes = [part for text in shown for part in _parsed(text).body if isinstance(part, ast.ClassDef)]
        for each in classes:
            if names & {text.value.strip("/") for text in _texts(each)}:
                text = _bundled(student, shown, main=False) + spinning(each.name)
                found[f"{each.name} of {notebook.name}"] = text.encode()
    return found


def _texts(part: ast.AST) -> Iterator[ast.Constant]:
    return (inner for inner in ast.walk(part) if isinstance(inner, ast.Constant) and isinstance(inner.value, str))


def stubs(student: Path, exercise: Exercise) -> dict[str, bytes]:
    """The exercise's programs as the released notebook has them, and its interfaces, which the task gives."""
    path = student / "notebooks" / exercise.name / f"{exercise.name}.ipynb"
    written = {name: cells.exercise_file(cells.read(path), name) for name in programs_of(exercise)}
    return given(exercise) | {name: text if text is not None else NOTHING for name, text in written.items()}


def given(exercise: Exercise) -> dict[str, bytes]:
    """The interface files of an answer, which the task gives word for word."""
    return {file: text for file, text in answers.solution(exercise.name).items() if not file.endswith(".py")}


def programs_of(exercise: Exercise) -> list[str]:
    """The programs that are handed in."""
    return [file for file in exercise.files if file.endswith(".py")]


def _shown(notebook: Path) -> Iterator[str]:
    """The Python of a notebook that can be read there: of its cells, and of the boxes in its text."""
    for cell in cells.read(notebook):
        if cell.kind == "markdown":
            yield from FENCED.findall(cell.source)
        elif cell.kind == "code" and not cell.public_check:
            lines = cell.source.splitlines()
            yield "\n".join("" if line.lstrip().startswith(("!", "%")) else line for line in lines)


def _written(notebook: Path) -> Iterator[tuple[str, str]]:
    """The programs that cells of the page write, other than the exercise's: the cell's first line, and the text."""
    for cell in cells.read(notebook):
        first, _, body = cell.source.lstrip("\n").partition("\n")
        if cell.kind == "code" and first.startswith("%%") and not cell.solution and _parsed(body).body:
            yield first, body


def _bundled(student: Path, texts: Iterable[str], main: bool = True) -> str:
    """One program of several texts, without imports of the course: what they import of it stands before them.

    Without `main`, only what each text defines is left.
    """
    seen: set[Path] = set()
    parts: list[str] = []

    def add(text: str, whole: bool) -> None:
        kept = []
        for part in _parsed(text).body:
            if isinstance(part, ast.ImportFrom) and (part.module or "").split(".")[0] in ("course", "__future__"):
                for path in _sources(student, part):
                    if path not in seen:
                        seen.add(path)
                        add(path.read_text(encoding="utf-8"), whole=False)
            elif whole:
                kept.append(ast.unparse(part))
            elif _defines(part):
                kept.append(ast.unparse(_tried(part)))
        parts.append("\n".join(kept))

    for text in texts:
        add(text, main)
    return "\n\n".join(parts) + "\n"


def _defines(part: ast.stmt) -> bool:
    """Return True if it only defines something; what runs, and an import of the course, does not."""
    if isinstance(part, ast.Import):
        return not any(name.name.split(".")[0] == "course" for name in part.names)
    if isinstance(part, ast.Assign | ast.AnnAssign):
        return not any(isinstance(inner, ast.Name) and inner.id == "ros" for inner in ast.walk(part))
    return isinstance(part, ast.ImportFrom | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)


def _tried(part: ast.stmt) -> ast.stmt:
    """The statement in a `try`: what it needs may have been left out, and the rest is to be tried without it."""
    passed = ast.ExceptHandler(ast.Name("Exception", ast.Load()), None, [ast.Pass()])
    return ast.fix_missing_locations(ast.Try([part], [passed], [], []))


def _sources(student: Path, part: ast.ImportFrom) -> Iterator[Path]:
    """The files of the course that an import names, if a program can need them."""
    rooms = (part.module or "").split(".")
    if len(rooms) > 1 and rooms[1] in INLINED:
        folder = student.joinpath(*rooms)
        named = [folder / f"{name.name}.py" for name in part.names]
        yield from (path for path in (folder.with_suffix(".py"), folder / "__init__.py", *named) if path.is_file())


def _parsed(text: str) -> ast.Module:
    try:
        return ast.parse(text)
    except SyntaxError:  # a sketch, or a shell command
        return ast.Module([], [])


@dataclass
class Earned:
    """The points that were earned in an exercise."""

    exercise: Exercise
    nothing: float = 0.0  # by the interface files alone
    stubs: float = 0.0
    alone: dict[str, dict[str, float]] = field(default_factory=dict)  # by file handed in and program: beyond nothing
    together: float = 0.0  # by the best program for each file at once

    @property
    def most(self) -> float:
        """The most that any choice of programs for the files can have earned, or the stubs."""
        chosen = self.nothing + sum(max(each.values(), default=0.0) for each in self.alone.values())
        return max(chosen, self.together, self.stubs)

    @property
    def too_much(self) -> bool:
        """Return True if something shipped earns half of the exercise."""
        return self.most >= self.exercise.max_score / 2


def earned(exercise: Exercise, student: Path, programs: dict[str, bytes], grade: Grade) -> Earned:
    """Hand each program in under each name of the exercise's files, and the best ones together."""
    programs = programs | single_nodes(student, exercise)
    files = programs_of(exercise)
    empty = given(exercise) | dict.fromkeys(files, NOTHING)
    nothing = grade(empty, exercise.name, patience=PATIENCE)
    stub = grade(stubs(student, exercise), exercise.name, patience=PATIENCE)
    gradings = {
        (file, name): grade(empty | {file: text}, exercise.name, patience=PATIENCE)
        for file in files
        for name, text in programs.items()
    }
    result = Earned(exercise, score(nothing), score(stub))
    for (file, name), grading in gradings.items():
        result.alone.setdefault(file, {})[name] = score(grading) - result.nothing
    best = {file: programs[max(gains, key=lambda name: gains[name])] for file, gains in result.alone.items()}
    result.together = score(grade(empty | best, exercise.name, patience=PATIENCE))
    return result


def likeliest(exercise: Exercise, programs: dict[str, bytes]) -> dict[str, bytes]:
    """For each file of the exercise the program that has most of the reference's words and texts, and few others."""

    def likeness(file: str, text: bytes) -> float:
        wanted, there = _words(answers.solution(exercise.name)[file]), _words(text)
        return len(wanted & there) / len(wanted | there)

    return {file: max(programs.values(), key=lambda text: likeness(file, text)) for file in programs_of(exercise)}


def _words(text: bytes) -> set[str]:
    return set(re.findall(r"\w{3,}", text.decode(errors="replace")))


def score(grading: "Future[Report]") -> float:
    """The points of a grading; raises RuntimeError when the grader itself failed."""
    report = grading.result()
    if report.status != GRADED:
        raise RuntimeError(f"{report.assignment}: {report.status}, {report.details}")
    return report.score


def main() -> int:
    """Print what is earned in each exercise that is asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.hidden.shipped", description=__doc__.partition("\n")[0])
    parser.add_argument("exercise", nargs="*", help=f"of {', '.join(exercises.names())}; by default all")
    parser.add_argument("--jobs", type=int, default=(os.cpu_count() or 1) + 1, help="gradings at a time (%(default)s)")
    options = parser.parse_args()
    if unknown := set(options.exercise) - {*exercises.names()}:
        parser.error(f"no exercise {', '.join(sorted(unknown))}; there are {', '.join(exercises.names())}")
    confinement, failed = sandbox.choose(), 0
    with ThreadPoolExecutor(options.jobs) as pool, tempfile.TemporaryDirectory() as folder:

        def grade(files: dict[str, bytes], exercise: str, **how: float) -> "Future[Report]":
            return pool.submit(single.grade, Submission("student", exercise, files), confinement, seed=1, **how)

        student = student_files(Path(folder))
        programs = candidates(student)
        for name in options.exercise or exercises.names():
            result = earned(exercises.load(name), student, programs, grade)
            failed += result.too_much
            _show(result)
    return 1 if failed else 0


def _show(result: Earned) -> None:
    print(f"{result.exercise.name}: {result.exercise.max_score:g} points; nothing earns {result.nothing:g}, ", end="")
    print(f"the stubs earn {result.stubs:g}")
    files = [*result.alone]
    for name in next(iter(result.alone.values())):
        gains = [result.alone[file][name] for file in files]
        if any(gain > 0 for gain in gains):
            print(f"  {name:50}", ", ".join(f"{gain:+g} as {file}" for gain, file in zip(gains, files, strict=True)))
    print("  all others: nothing more under any name")
    print(f"  the best for each file, together: {result.together:g}; at most {result.most:g} ", end="")
    print("TOO MUCH\n" if result.too_much else "(less than half)\n", flush=True)


if __name__ == "__main__":
    sys.exit(main())
