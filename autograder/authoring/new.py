"""`autograder new`: the folders and files of a new exercise, complete and ready to grade.

They hold a small exercise, such as a service that greets, which the author then replaces part by part; docs/ADDING.md
walks through it.  They are made from the templates beside this file, one folder for each kind.  The notebook is run
before it is stored, as every notebook of the course is.
"""

import importlib.util
import keyword
import re
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from autograder.authoring.kinds import Kind
from autograder.errors import UsageError
from autograder.paths import PACKAGE, repository
from course.foundation.cells import content

TEMPLATES = Path(__file__).with_name("templates")
WORTH = re.compile(r"^@points\((\d+)", re.MULTILINE)  # a decorator in a suite
NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
CELL = re.compile(r"^=== (?P<kind>\w+) (?P<id>[\w-]+)(?: (?P<points>\d+))?\n", re.MULTILINE)
CELL_TIMEOUT = 120  # s


def new(name: str, like: Kind = Kind.SERVICE) -> list[Path]:
    """Write the notebook, solution, hidden suite and answers of a new exercise of a kind; return the files.

    Raises UsageError, before anything is written, when the name is invalid or taken.
    """
    places = _places(name)
    notebook = _notebook(_render("notebook.txt.jinja", name, like))
    _run(notebook)
    written = {
        places["notebook"] / f"{name}.ipynb": _text(notebook),
        places["solution"] / f"{name}.py": _solution(notebook),
    }
    for file in ("exercise.toml", "conversation.py", "conftest.py", "suite.py"):
        written[places["hidden"] / file] = _render(f"{file}.jinja", name, like)
    written[places["answers"]] = _render("answers.py.jinja", name, like)
    for path, text in written.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return list(written)


def _places(name: str) -> dict[str, Path]:
    """Return where the parts of the exercise go; raises UsageError when the name is invalid or taken."""
    if not NAME.fullmatch(name) or keyword.iskeyword(name):
        raise UsageError(
            f"'{name}' is not a valid name: it must begin with a letter, have up to 40 lower-case letters, digits and "
            "underscores, and be no keyword of Python"
        )
    root = repository()
    places = {
        "notebook": root / "notebooks" / name,
        "solution": root / "solutions" / name,
        "hidden": PACKAGE / "hidden" / name,
        "answers": root / "tests" / "hidden" / "answers" / f"{name}.py",
    }
    taken = [path for path in (*places.values(), places["answers"].with_suffix("")) if path.exists()]
    if taken:
        raise UsageError(f"'{name}' is taken: there is already {taken[0].relative_to(root)}")
    if importlib.util.find_spec(name):
        raise UsageError(
            f"'{name}' is the name of a Python module, which a student's {name}.py would hide: choose another"
        )
    return places


def _render(template: str, name: str, like: Kind) -> str:
    """Return the kind's own template, or the one that all kinds share, filled in with the exercise's name."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader([TEMPLATES / like, TEMPLATES]), undefined=StrictUndefined, keep_trailing_newline=True
    )
    words = name.replace("_", " ").split()
    worth = WORTH.findall((TEMPLATES / like / "suite.py.jinja").read_text(encoding="utf-8"))
    return environment.get_template(template).render(
        name=name,
        title=" ".join(words).capitalize(),
        camel="".join(word.capitalize() for word in words),
        points=sum(map(int, worth)),
        threads=0,
    )


def _notebook(text: str) -> Any:
    """Return the nbformat notebook that the template describes: each cell begins with a line `=== KIND ID [POINTS]`."""
    from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

    cells = []
    for head, body in _cells(text):
        kind, name = head["kind"], head["id"]
        make = new_markdown_cell if kind == "markdown" else new_code_cell
        cell = make(body.rstrip("\n"), id=name)
        if kind in ("solution", "checks"):
            cell.metadata["nbgrader"] = {
                "cell_type": "code",
                "grade": kind == "checks",
                "grade_id": name,
                "locked": kind == "checks",
                **({"points": int(head["points"])} if head["points"] else {}),
                "schema_version": 3,
                "solution": kind == "solution",
                "task": False,
            }
        cells.append(cell)
    return new_notebook(
        cells=cells,
        metadata={
            "kernelspec": {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        },
    )


def _cells(text: str) -> Iterator[tuple[re.Match[str], str]]:
    heads = list(CELL.finditer(text))
    ends = [head.start() for head in heads[1:]] + [len(text)]
    for head, end in zip(heads, ends, strict=True):
        yield head, text[head.end() : end]


def _run(notebook: Any) -> None:
    """Run the notebook from top to bottom, in a temporary folder that takes the files its cells write.

    Raises UsageError when a cell fails: this machine cannot run the course.
    """
    from nbclient import NotebookClient
    from nbclient.exceptions import CellControlSignal

    metadata = notebook.metadata.copy()
    with tempfile.TemporaryDirectory(prefix="autograder-new-") as folder:
        client = NotebookClient(
            notebook, timeout=CELL_TIMEOUT, record_timing=False, resources={"metadata": {"path": folder}}
        )
        try:
            client.execute(stderr=subprocess.DEVNULL)  # hides the kernel's own warnings
        except (CellControlSignal, RuntimeError) as error:
            last = str(error).strip().splitlines()[-1:]
            raise UsageError(f"the new notebook does not run here: {' '.join(last)}; see `course doctor`") from None
    notebook.metadata = metadata  # the template's: does not name this machine's Python version


def _solution(notebook: Any) -> str:
    """Return the reference answer: the file that the exercise's cell writes."""
    source = next(cell.source for cell in notebook.cells if cell.source.startswith("%%exercise"))
    return content(source.partition("\n")[2] + "\n")


def _text(notebook: Any) -> str:
    import nbformat

    return nbformat.writes(notebook) + "\n"
