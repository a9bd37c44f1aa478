"""Steps of nbgrader's Validate that skip cells that no exercise needs, and leave the folder as it is."""

import tempfile
from pathlib import Path
from typing import Any

from nbformat import NotebookNode
from nbgrader.preprocessors import CheckCellMetadata, ClearOutput, Execute, NbGraderPreprocessor

from course.foundation.cells import Cell
from course.notebook.needed_cells import needed_cells


class Needed(NbGraderPreprocessor):
    """Removes the code cells that no exercise needs, so that Validate is fast; keeps Markdown."""

    def preprocess(self, nb: NotebookNode, resources: dict[str, Any]) -> tuple[NotebookNode, dict[str, Any]]:
        """Return the notebook without these cells."""
        kept = set(needed_cells([_cell(cell) for cell in nb.cells]))
        nb.cells = [cell for number, cell in enumerate(nb.cells) if cell.cell_type != "code" or number in kept]
        return nb, resources


class Apart(Execute):
    """Runs the notebook in a folder of links to the student's files: exercise cells replace links, and not files."""

    def preprocess(
        self, nb: NotebookNode, resources: dict[str, Any], **more: Any
    ) -> tuple[NotebookNode, dict[str, Any]]:
        """Return the notebook as run."""
        known = resources.get("metadata", {})
        with tempfile.TemporaryDirectory(prefix="validate-") as place:
            for path in Path(known.get("path", "")).absolute().iterdir():
                if path.name != "__pycache__":
                    Path(place, path.name).symlink_to(path)
            there = {**resources, "metadata": {**known, "path": place}}
            done: tuple[NotebookNode, dict[str, Any]] = super().preprocess(nb, there, **more)
            return done


STEPS = (CheckCellMetadata, ClearOutput, Needed, Apart)


def _cell(cell: NotebookNode) -> Cell:
    return Cell(cell.cell_type, cell.source, cell.metadata.get("nbgrader", {}))
