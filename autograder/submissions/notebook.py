"""A handed-in notebook, read without running or trusting it, and a copy that is safe to show.

Whatever is in the notebook file, the copy is built only from parts of known kinds: text, pictures, and HTML without
scripts, attributes or styles.
"""

import re
from typing import TYPE_CHECKING, Any

from course.errors import UnreadableNotebook
from course.foundation import cells
from course.foundation.cells import Cell, text_of

if TYPE_CHECKING:  # loading it takes time, and most gradings show no notebook
    from nbformat import NotebookNode

MAX_BYTES = 10_000_000  # of a notebook; those of this course have up to 1,000,000
MAX_TEXT = 100_000  # characters of a cell or an output that are shown
MAX_MARKDOWN = 500_000  # characters of all cells with text that are shown; the pages of this course have up to 60,000
# What is shown as one line of Markdown: nbconvert looks through a line again for each bracket that it has.
LINE = re.compile(r"([^\n]{1500}[^\s]{0,500})(?=[^\n])")
# The HTML tags that are shown, without any attributes.
TAGS = "b br code details div em h1 h2 h3 h4 hr i li ol p pre span strong sub summary sup table tbody td th thead tr ul"
JOINER = "\N{WORD JOINER}"  # invisible; breaks up text that would be markup


def parse(text: bytes) -> list[Cell]:
    """The cells of a notebook that was handed in; raises UnreadableNotebook."""
    if len(text) > MAX_BYTES:
        raise UnreadableNotebook(f"it is larger than {MAX_BYTES / 1e6:.0f} MB")
    return cells.parse(text)


def safe(handed_in: list[Cell]) -> "NotebookNode":
    """Return a notebook that shows these cells and does nothing else."""
    from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_raw_cell

    shown, left = [], MAX_MARKDOWN
    for number, cell in enumerate(handed_in):
        more = {"metadata": {"nbgrader": {"grade_id": cell.name}} if cell.name else {}, "id": f"cell-{number}"}
        if cell.kind == "code":
            outputs = [output for output in map(_output, cell.outputs) if output]
            shown.append(new_code_cell(_cut(cell.source), execution_count=cell.count, outputs=outputs, **more))
        else:
            new = new_markdown_cell if cell.kind == "markdown" else new_raw_cell
            text = _cut(cell.source, min(MAX_TEXT, left))
            left -= min(left, len(text))
            shown.append(new(LINE.sub(r"\1\n", plain(text)), **more))
    return new_notebook(
        cells=shown,
        metadata={
            "kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"},
            "language_info": {"name": "python"},
        },
    )


def plain(markdown: str) -> str:
    """Return the Markdown with tags, pictures and `javascript:` links turned into plain text.

    A picture would be fetched by the instructor's browser, and tell its server who is reading.
    """
    markdown = re.sub(r"!(?=\[)", "!" + JOINER, markdown)
    markdown = re.sub(r"<(?=[a-z/!?])", "<" + JOINER, markdown, flags=re.IGNORECASE)
    markdown = re.sub(r"&(?=#|colon;|tab;|newline;)", "&" + JOINER, markdown, flags=re.IGNORECASE)
    return re.sub(r"script(?=\s*[:%\\&])", "script" + JOINER, markdown, flags=re.IGNORECASE)


def _cut(text: str, most: int = MAX_TEXT) -> str:
    return text if len(text) <= most else text[:most] + "\n... cut off here: too long to be shown"


def _output(raw: dict[str, Any]) -> "NotebookNode | None":
    """Return the output without active content; None if nothing is left."""
    from nbformat.v4 import new_output

    try:
        match raw.get("output_type"):
            case "stream":
                name = "stderr" if raw.get("name") == "stderr" else "stdout"
                return new_output("stream", name=name, text=_cut(text_of(raw["text"])))
            case "error":
                name, value, lines = text_of(raw["ename"]), text_of(raw["evalue"]), raw["traceback"][:100]
                return new_output(
                    "error", ename=_cut(name), evalue=_cut(value), traceback=[_cut(text_of(line)) for line in lines]
                )
            case "display_data" | "execute_result":
                return new_output("display_data", data=_bundle(raw["data"]))
    except (KeyError, TypeError, AttributeError):
        pass
    return None


def _bundle(data: dict[str, Any]) -> dict[str, str]:
    """Return the representations of an output that are safe to show, by MIME type."""
    import bleach

    shown: dict[str, str] = {}
    for kind in ("image/png", "image/jpeg"):
        if kind in data and re.fullmatch(r"[A-Za-z0-9+/=\s]*", picture := text_of(data[kind])):
            shown[kind] = picture
    if "text/html" in data and len(html := text_of(data["text/html"])) <= MAX_TEXT:
        shown["text/html"] = bleach.clean(html, tags=set(TAGS.split()), attributes={}, strip=True)
    shown["text/plain"] = _cut(
        text_of(data.get("text/plain", f"(output of the kinds {', '.join(map(str, data))[:200]})"))
    )
    return shown
