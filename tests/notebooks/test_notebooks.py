"""The notebooks as they are stored and released."""

import base64
import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest

from autograder.gradebook.release import release
from course.foundation.cells import content

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted(ROOT.glob("notebooks/[!.]*/*.ipynb"))
STORED = [ROOT / "notebooks/index.ipynb", *NOTEBOOKS]


def code_cells(path: Path):
    return [cell for cell in nbformat.read(path, 4).cells if cell.cell_type == "code" and cell.source.strip()]


@pytest.mark.parametrize("path", STORED, ids=lambda path: path.stem)
def test_every_code_cell_was_run_before_it_was_stored(path):
    """nbval does not compare a cell that was stored without having been run."""
    assert [cell.source for cell in code_cells(path) if cell.execution_count is None] == []


@pytest.mark.parametrize("path", STORED, ids=lambda path: path.stem)
def test_no_cell_is_stored_with_an_error_that_is_not_meant(path):
    failed = [
        cell.source
        for cell in code_cells(path)
        if any(output.output_type == "error" for output in cell.outputs)
        and "raises-exception" not in cell.metadata.get("tags", [])
    ]
    assert failed == []


@pytest.mark.parametrize("path", STORED, ids=lambda path: path.stem)
def test_a_notebook_was_run_once_from_top_to_bottom(path):
    assert [cell.execution_count for cell in code_cells(path)] == list(range(1, len(code_cells(path)) + 1))


@pytest.mark.parametrize("path", STORED, ids=lambda path: path.stem)
def test_a_figure_has_a_sentence_from_its_title_and_its_data(path):
    """For readers who do not see it: at least the title, and numbers of what is drawn."""
    for cell in code_cells(path):
        for output in cell.outputs:
            if "image/png" in output.get("data", {}):
                title, _, facts = output.metadata["image/png"]["alt"].partition(". ")
                assert len(title) > 10 and len(facts) > 40 and re.search(r"\d", facts), cell.id


@pytest.mark.parametrize("path", STORED, ids=lambda path: path.stem)
def test_a_figure_has_two_pixels_for_each_of_the_page(path):
    for cell in code_cells(path):
        for output in cell.outputs:
            if picture := output.get("data", {}).get("image/png"):
                width = int.from_bytes(base64.b64decode(picture)[16:20], "big")
                assert width == 2 * output.metadata["image/png"]["width"] == 1200, cell.id


@pytest.mark.parametrize("path", STORED, ids=lambda path: path.stem)
def test_a_diagram_has_a_title_and_a_description(path):
    for cell in nbformat.read(path, 4).cells:
        for diagram in re.findall(r"^```mermaid\n(.*?)^```", cell.source, re.MULTILINE | re.DOTALL):
            assert re.search(r"^ *accTitle: .{10,}$", diagram, re.MULTILINE), cell.id
            assert re.search(r"^ *accDescr: .{60,}$", diagram, re.MULTILINE), cell.id


def exercise_cells():
    for path in NOTEBOOKS:
        for cell in code_cells(path):
            first, _, body = cell.source.partition("\n")
            if first.startswith("%%exercise ") and cell.metadata.get("nbgrader", {}).get("solution"):
                yield pytest.param(path.parent.name, first.split()[1], body, id=f"{path.stem}/{first.split()[1]}")


@pytest.mark.parametrize(("section", "name", "body"), list(exercise_cells()))
def test_the_solution_is_what_its_cell_writes(section, name, body):
    assert (ROOT / "solutions" / section / name).read_text() == content(body + "\n")


def test_every_solution_file_has_its_cell():
    written = {(param.values[0], param.values[1]) for param in exercise_cells()}
    assert {(path.parent.name, path.name) for path in ROOT.glob("solutions/*/*") if path.is_file()} == written


@pytest.fixture(scope="module")
def released(tmp_path_factory):
    """The student version of every notebook."""
    folder = tmp_path_factory.mktemp("course")
    release(folder)
    return folder / "release"


def test_the_released_notebook_has_stubs_for_solutions(released):
    for param in exercise_cells():
        section, name, body = param.values
        cells = code_cells(released / section / f"{section}.ipynb")
        cell = next(cell for cell in cells if cell.source.startswith(f"%%exercise {name}"))
        assert "# YOUR CODE HERE" in cell.source
        text = "\n".join(cell.source for cell in nbformat.read(released / section / f"{section}.ipynb", 4).cells)
        for hidden in re.findall(r"### BEGIN SOLUTION\n(.*?)### END SOLUTION", body, re.DOTALL):
            assert hidden.strip() not in text


def test_the_released_notebook_has_no_marking_scheme(released):
    for path in NOTEBOOKS:
        manual = [
            cell
            for cell in nbformat.read(path, 4).cells
            if cell.cell_type == "markdown" and cell.metadata.get("nbgrader", {}).get("grade")
        ]
        assert all("arking scheme" in cell.source for cell in manual)
        assert "Marking scheme" not in (released / path.parent.name / path.name).read_text()


MEASURED = [
    ("median: ≈ 3.2 ms of 20", "median: ≈ 41.75 ms of 20", "PASSED"),
    ("≈ 1,200 calls in ≈0.5 s", "≈ 998 calls in ≈1.5e-3 s", "PASSED"),
    ("median: ≈ 3.2 ms of 20", "median: ≈ 3.2 ms of 21", "FAILED"),
    ("median: ≈ 3.2 ms", "median: ≈ 3.2 s", "FAILED"),
    ("median: 3.2 ms", "median: 3.3 ms", "FAILED"),
]


def test_a_number_behind_the_sign_may_differ_and_no_other(tmp_path):
    """tests/measured.cfg: strict nbval takes `≈` and the number after it for the same in every run."""
    cells = []
    for number, (stored, now, _) in enumerate(MEASURED, 1):
        cells.append(nbformat.v4.new_code_cell(f"print({now!r})", execution_count=number))
        cells[-1].outputs = [nbformat.v4.new_output("stream", name="stdout", text=stored + "\n")]
    nbformat.write(nbformat.v4.new_notebook(cells=cells), tmp_path / "measured.ipynb")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-rpf", "-c", "pyproject.toml", str(tmp_path / "measured.ipynb")],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    told = {
        int(number): verdict for verdict, number in re.findall(r"^([A-Z]+) .*::Cell (\d+)", done.stdout, re.MULTILINE)
    }
    assert [told.get(number) for number in range(len(MEASURED))] == [verdict for *_, verdict in MEASURED], done.stdout
