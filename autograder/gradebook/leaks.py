"""The search for answers in the files that students get.

nbgrader removes the text between the marks of a solution.  One forgotten mark would show an answer to the class, so the
released files are searched for the text of solutions, marking schemes, reference files and hidden suites.
"""

import json
import re
from collections.abc import Iterator
from pathlib import Path

from autograder.paths import COURSE, HIDDEN, repository
from course.foundation import cells
from course.foundation.cells import MARKERS, SOLUTION

TELLTALES = ("BEGIN SOLUTION", "END SOLUTION", "HIDDEN TESTS", "marking scheme", "mark scheme", "autograder")
ANSWER = "the solution or its marking scheme"
TELLING = 2  # lines of an answer in one place: a single one (`response.success = True`) can be in any program
LONG = 16  # characters: shorter lines (`return response`) give nothing away
IMPORT = re.compile(r"(?:from [\w.]+ )?import [\w., ]+$")


def secrets(name: str, notebook: Path) -> dict[str, str]:
    """Return the texts that no released file of an exercise may show, each with a description."""
    marked = cells.read(notebook)
    public = [file.read_text(encoding="utf-8") for file in COURSE.rglob("*.py")]
    stubs = [SOLUTION.sub("", cell.source) for cell in marked if cell.solution]
    shown = _squeeze("\n".join([*public, *stubs]))
    kept = dict.fromkeys(TELLTALES, "a word that is only for instructors")
    for cell in marked:
        for region in SOLUTION.findall(cell.source):
            kept.update(_lines(region, ANSWER, unless=shown))
    for file in sorted((repository() / "solutions" / name).glob("*")):
        if file.is_file():
            kept[_squeeze(MARKERS.sub("", file.read_text(encoding="utf-8")))] = f"all of the solution {file.name}"
    for file in sorted((HIDDEN / name).glob("*.py")):
        # Only lines that say what is asked or expected; `except ValueError:` is in many programs.
        lines = _lines(file.read_text(encoding="utf-8"), "a hidden test", unless="")
        kept.update({line: what for line, what in lines.items() if re.search(r"[\d\"']|test_", line)})
    return kept


def leaks(folder: Path, kept: dict[str, str]) -> Iterator[str]:
    """Yield a line for the instructor for each place where a file below `folder` shows one of the texts."""
    known = {text.lower(): (text, what) for text, what in kept.items()}
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        for place, text_there in _texts(path):
            shown = _squeeze(text_there).lower()
            found = [entry for text, entry in known.items() if text in shown]
            answers = [what for _, what in found].count(ANSWER)
            for text, what in found:
                if what != ANSWER or answers >= TELLING:
                    yield f"{path.name}{place} shows {what}: {text[:60]!r}"


def _texts(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the texts of a file with their places: for a notebook, those of each cell and of the metadata."""
    raw = path.read_text(encoding="utf-8", errors="replace")
    if path.suffix != ".ipynb":
        yield "", raw
    else:
        notebook = json.loads(raw)
        for number, cell in enumerate(notebook.pop("cells")):
            yield f", cell {number}", cells.text_of(cell["source"])
            yield f", cell {number}", "\n".join(_strings([cell.get("outputs", []), cell.get("metadata", {})]))
        yield "'s metadata", "\n".join(_strings(notebook))


def _strings(value: object) -> Iterator[str]:
    """Yield all strings in a JSON value; a list of lines is one string."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield key
            yield from _strings(inner)
    elif isinstance(value, list) and value and all(isinstance(line, str) for line in value):
        yield "".join(value)
    elif isinstance(value, list):
        for inner in value:
            yield from _strings(inner)


def _lines(text: str, what: str, unless: str) -> dict[str, str]:
    """Return the lines of a text that give something away, without those that are in `unless`."""
    lines = map(_squeeze, text.splitlines())
    return {line: what for line in lines if len(line) >= LONG and not IMPORT.match(line) and line not in unless}


def _squeeze(text: str) -> str:
    return re.sub(r"\s+", " ", text).strip()
