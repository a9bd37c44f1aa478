"""`progress()`: the results of all sections' public checks, as last saved in the notebooks.

Nothing is run or stored elsewhere: a notebook file contains the outputs of its checks.
"""

import html
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from course.foundation import cells
from course.foundation.cells import PASSED, STUB, Cell

ORDER = ("services", "actions", "parameters", "ai_integration", "calculator")
ANSWERED = "answered"
STUBS = ("YOUR ANSWER HERE", STUB)
HEAD = ("section", "part", "so far", "points")


@dataclass(frozen=True)
class Part:
    """A part of an exercise that gives points: one public check, or one question in words."""

    section: str
    name: str
    state: str  # passed, answered, or what is missing
    points: float  # the points that the hidden tests, or the marker of the answer, can give

    @property
    def done(self) -> bool:
        """Return True if its public check has passed, or its question has an answer."""
        return self.state in (PASSED, ANSWERED)

    def texts(self) -> tuple[str, str, str, str]:
        """Return the texts of the part's row in the table."""
        return self.section, self.name, self.state, f"{self.points:g}"


class Progress(list[Part]):
    """The parts of all exercises, in the order of the course; a notebook shows them as a table."""

    @property
    def summary(self) -> str:
        """Return a sentence on the progress so far."""
        if not self:
            return "There are no exercises here: run this in the folder that holds the sections."
        done = [part for part in self if part.done]
        reached, all_points = (sum(part.points for part in parts) for parts in (done, self))
        return (
            f"{len(done)} of {len(self)} parts done, worth up to {reached:g} of {all_points:g} points: "
            "your instructor's tests decide."
        )

    def __repr__(self) -> str:
        lines = [HEAD, *(part.texts() for part in self)]
        widths = [max(len(line[column]) for line in lines) for column in range(len(HEAD))]
        padded = ("  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)) for line in lines)
        return "\n".join([*(line.rstrip() for line in padded if self), self.summary])

    def _repr_html_(self) -> str:
        def row(texts: tuple[str, ...], tag: str) -> str:
            inner = "".join(f'<{tag} style="text-align:left">{html.escape(text)}</{tag}>' for text in texts)
            return f"<tr>{inner}</tr>"

        body = "\n".join(row((*part.texts()[:2], ("✓ " if part.done else "") + part.state, part.texts()[3]), "td")
                         for part in self)  # fmt: skip
        table = f"<table><thead>{row(HEAD, 'th')}</thead>\n<tbody>{body}</tbody></table>" if self else ""
        return f"{table}<p>{html.escape(self.summary)}</p>"


def progress(folder: Path = Path()) -> Progress:
    """Read the sections' saved notebooks, in the folders of `folder`, or beside it if it is a section's own folder.

    A notebook that cannot be read is left out.
    """
    if not list(_notebooks(folder)):
        folder = folder.resolve().parent
    found = Progress()
    for path, known in cells.readable(_notebooks(folder)):
        found += parts(path.stem, known)
    return found


def parts(section: str, known: list[Cell]) -> Progress:
    """Return the parts of one section from the cells of its notebook."""
    return Progress(
        Part(section, cell.name, _state(cell, known[:at]), _points(cell))
        for at, cell in enumerate(known)
        if cell.mark.get("grade")
    )


def in_order(sections: Iterable[str]) -> list[str]:
    """Return the sections in the course's order; added ones come last, in the given order."""
    return sorted(sections, key=lambda name: ORDER.index(name) if name in ORDER else len(ORDER))


def _notebooks(folder: Path) -> Iterator[Path]:
    """Yield the sections' notebooks: those of the course in order, then added ones."""
    for name in in_order(path.stem for path in sorted(folder.glob("*/*.ipynb")) if path.stem == path.parent.name):
        yield folder / name / f"{name}.ipynb"


def _points(cell: Cell) -> float:
    points = cell.mark.get("points", 0)
    return float(points) if isinstance(points, (int, float)) else 0.0


def _state(cell: Cell, before: list[Cell]) -> str:
    """Return the state of a graded cell; `before` are the cells above it."""
    if cell.solution:
        return ANSWERED if cell.source.strip() and not any(stub in cell.source for stub in STUBS) else "not answered"
    if cell.count is None:
        return "not run"
    if error := next((output for output in cell.outputs if output.get("output_type") == "error"), None):
        lines = cells.text_of(error.get("evalue", "")).strip().splitlines()
        return f"not yet: {lines[0] if lines else error.get('ename', 'an error')}"
    if any(above.solution and (above.count or 0) > cell.count for above in before):
        return "run it again: the file was written again since"
    return PASSED
