"""`environment/site [OUTPUT]`: the course as a static site that opens from the disk.

The pages are the notebooks as students get them, without solutions, but with the outputs that are stored in them; and
the pages for students.  Nothing is executed, and nothing is fetched, now or when the pages are read.
"""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbformat
import slides
from diagrams import FENCE, drawn, replaced
from links import dead

from autograder.gradebook.leaks import leaks, secrets
from autograder.gradebook.release import PICTURE, START_PAGE, release
from course.notebook.progress import in_order

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent
BUILT = ".buildinfo"  # Sphinx leaves it in what it has built
PAGES = {"student": "How you work here", "when-it-goes-wrong": "When it goes wrong", "faq": "Questions and answers"}
SLIDES = "slides.html"  # beside the page of each section
OWN = "nbval-ignore-output"  # the tag of a cell whose output is the reader's own


def main() -> int:
    """Build the site; the exit status is 1 when a page would show an answer or has a dead link."""
    if len(sys.argv) > 2 or (len(sys.argv) == 2 and sys.argv[1].startswith("-")):
        print("Usage: environment/site [OUTPUT]      (default: build/site)", file=sys.stderr)
        return 2
    output = Path(sys.argv[1]) if len(sys.argv) == 2 else ROOT / "build" / "site"
    if output.exists() and (not output.is_dir() or any(output.iterdir())) and not (output / BUILT).exists():
        print(f"environment/site: {output} is there and is not a site: name another folder", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory(prefix="course-site-") as folder:
        source, built = Path(folder, "source"), Path(folder, "site")
        if found := lay_out(source, Path(folder, "released")):
            print(f"environment/site: {found}", file=sys.stderr)
            return 1
        command = [sys.executable, "-m", "sphinx", "-q", "-c", str(HERE), "-d", f"{folder}/trees", str(source)]
        if status := subprocess.run([*command, str(built)]).returncode:
            return status
        for notebook in source.glob("*/*.ipynb"):
            slides.write(notebook, built / notebook.parent.name / SLIDES)
        if lines := list(dead(built)):
            print("\n".join(["environment/site: dead links:", *lines]), file=sys.stderr)
            return 1
        if output.exists():
            shutil.rmtree(output)
        shutil.copytree(built, output)
    print(f"{output.resolve()}/index.html")
    return 0


def lay_out(source: Path, released: Path) -> str:
    """Write what Sphinx reads to `source`; returns which page would show an answer, or ''."""
    sections = in_order(folder.name for folder in release(released))
    for name in sections:
        notebook = ROOT / "notebooks" / name / f"{name}.ipynb"
        (source / name).mkdir(parents=True)
        nbformat.write(_shown(notebook, released / "release" / name / notebook.name), source / name / notebook.name)
        if found := next(leaks(source / name, secrets(name, notebook)), ""):
            return found
    nbformat.write(_start(sections), source / START_PAGE)
    (source / "student.md").write_text(_text("student/README.md"), encoding="utf-8")
    shutil.copy(ROOT / "docs/student" / PICTURE, source)
    (source / "when-it-goes-wrong.md").write_text(_mistakes(source), encoding="utf-8")
    (source / "faq.md").write_text(_text("faq.md").partition("## From instructors")[0], encoding="utf-8")
    _draw(source)
    return ""


def _text(page: str) -> str:
    return (ROOT / "docs" / page).read_text(encoding="utf-8")


def _mistakes(source: Path) -> str:
    """Return the list of mistakes, and copy the pages that it links, in the order of the sections."""
    text = _text("when-it-goes-wrong.md")
    shutil.copytree(ROOT / "docs/when-it-goes-wrong", source / "when-it-goes-wrong")
    pages = list(dict.fromkeys(re.findall(r"\]\((when-it-goes-wrong/\w+)\.md", text)))
    return "\n".join([text, "```{toctree}", ":hidden:", "", *pages, "```", ""])


def _shown(stored: Path, released: Path) -> nbformat.NotebookNode:
    """The released notebook with the stored outputs, but for those of the cells that a student is to write."""
    outputs = {cell.id: cell.outputs for cell in nbformat.read(stored, 4).cells if cell.cell_type == "code"}
    notebook = nbformat.read(released, 4)
    for cell in notebook.cells:
        if cell.cell_type == "code" and not cell.metadata.get("nbgrader", {}).get("solution"):
            cell.outputs = outputs.get(cell.id, [])
            if figure := _figure(cell.outputs):
                cell.metadata["mystnb"] = {"image": {"alt": figure["alt"], "width": f"{figure['width']}px"}}
    return notebook


def _figure(outputs: list[nbformat.NotebookNode]) -> dict[str, Any]:
    """Return the alternative text (`alt`) and the `width` (pixels) of the figure that a cell shows, or nothing."""
    found = (output.get("metadata", {}).get("image/png", {}) for output in outputs)
    return next((each for each in found if each.get("alt")), {})


def _start(sections: list[str]) -> nbformat.NotebookNode:
    """The start page, which has the book's table of contents, without what is the reader's own."""
    notebook = nbformat.read(ROOT / "notebooks" / START_PAGE, 4)
    for cell in notebook.cells:
        if OWN in cell.metadata.get("tags", []):
            cell.outputs = []
    empty = "On these pages the cells that you write are empty. Their checks show what a finished solution gives."
    notebook.cells.append(nbformat.v4.new_markdown_cell(empty))
    decks = " · ".join(f'<a href="{name}/{SLIDES}">{name.replace("_", " ")}</a>' for name in sections)
    notebook.cells.append(nbformat.v4.new_markdown_cell(f"## Slides\n\nEach section as a deck for a lecture: {decks}"))
    parts = {
        "The sections": [f"{name}/{name}" for name in sections],
        "Help": [f"{title} <{page}>" for page, title in PAGES.items()],
    }
    for caption, lines in parts.items():
        text = "\n".join(["```{toctree}", ":hidden:", f":caption: {caption}", "", *lines, "```"])
        notebook.cells.append(nbformat.v4.new_markdown_cell(text))
    return notebook


def _draw(source: Path) -> None:
    """Put drawings in the place of the diagrams' texts, in every page."""
    notebooks = {path: nbformat.read(path, 4) for path in source.rglob("*.ipynb")}
    texts = [cell for notebook in notebooks.values() for cell in notebook.cells if cell.cell_type == "markdown"]
    figures = drawn(cell.source for cell in texts)
    for cell in texts:
        cell.source = replaced(cell.source, figures)
        if re.search(FENCE, cell.source):
            print("environment/site: without a Chromium, diagrams are shown as their text", file=sys.stderr)
    for path, notebook in notebooks.items():
        nbformat.write(notebook, path)


if __name__ == "__main__":
    sys.exit(main())
