"""A deck of slides of each section, `SECTION/slides.html`, made of the same notebook as its page.

A heading begins a slide, and so does each **Predict** and each further cell of code: what a cell prints after a
**Predict** is folded, until the lecturer unfolds it.  Exercises are left out.  A deck is one file, which loads nothing;
printed, it is one slide a page, with all that is folded shown.
"""

import html
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import nbformat
from nbconvert.filters import ansi2html, markdown2html
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import PythonLexer

HEADING = re.compile(r"^(#{1,3}) +(.*)$", re.MULTILINE)
PREDICT = "**Predict**"
FOLDED = re.compile(r"\s*(<details>.*?</details>)?(.*)$", re.DOTALL)  # what is folded at a text's beginning, the rest
LEFT_OUT = ("Your turn", "Ten minutes first", "Where to go on", "Words")
COLOURS = HtmlFormatter(style="a11y-high-contrast-light", nowrap=True)
PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}: slides</title>
<style>
{colours}
{style}
</style></head>
<body>
{slides}
<script>
{script}
</script>
</body></html>
"""
STYLE = (Path(__file__).parent / "static" / "slides.css").read_text(encoding="utf-8")
SCRIPT = (Path(__file__).parent / "static" / "slides.js").read_text(encoding="utf-8")


@dataclass
class Slide:
    """A title, and what is below it, as HTML."""

    title: str
    level: int
    blocks: list[str] = field(default_factory=list)
    asks: bool = False  # for a prediction: what is printed below it is folded
    codes: int = 0


def write(notebook: Path, deck: Path) -> None:
    """Write the deck of a notebook; its links lead to the pages of the site."""
    slides = [slide for slide in _cut(nbformat.read(notebook, 4)) if slide.blocks]
    text = "\n".join(_section(slide, number, len(slides)) for number, slide in enumerate(slides, 1))
    text = re.sub(r'href="([^":]*)\.ipynb', r'href="\1.html', text)
    text = text.replace('href="#', f'href="{notebook.stem}.html#')
    colours = COLOURS.get_style_defs("pre.code")
    filled = {"title": html.escape(slides[0].title), "colours": colours, "style": STYLE, "script": SCRIPT}
    deck.write_text(PAGE.format(slides=text, **filled), encoding="utf-8")


def _section(slide: Slide, number: int, count: int) -> str:
    head = f"h{1 if slide.level == 1 else 2}"
    return "\n".join(
        [
            f'<section class="level{slide.level}">',
            f"<{head}>{_inline(slide.title)}</{head}>",
            *slide.blocks,
            f"<footer>{number} / {count}</footer>",
            "</section>",
        ]
    )


def _inline(title: str) -> str:
    """A heading's text; as a paragraph, one that begins with a number would be a list."""
    return re.sub(r'^<h1[^>]*>|(<a class="anchor-link".*</a>)?</h1>$', "", markdown2html(f"# {title}").strip())


def _cut(notebook: nbformat.NotebookNode) -> Iterator[Slide]:
    """The slides of a notebook, in order."""
    slide, left_out = Slide("", 1), 0  # the level of the heading that is left out, with all below it
    for cell in notebook.cells:
        if cell.cell_type == "code":
            if left_out or not cell.source.strip():
                continue
            if slide.codes:
                yield slide
                slide = Slide(slide.title, 3, asks=slide.asks)
            slide.codes += 1
            slide.blocks += _code(cell, folded=slide.asks)
            continue
        for level, title, text in _parts(cell.source):
            if title:
                if left_out and level > left_out:
                    continue
                yield slide
                slide, left_out = Slide(title, level), level if title.startswith(LEFT_OUT) else 0
            if left_out or not text.strip():
                continue
            folded, rest = FOLDED.match(text).groups()
            if folded:  # the answer stays with the code that it is about
                slide.blocks.append(markdown2html(folded))
            before, asked, question = rest.partition(PREDICT)
            if before.strip():
                if slide.codes:
                    yield slide
                    slide = Slide(slide.title, 3)
                slide.blocks.append(markdown2html(before))
            if asked:
                yield slide
                slide = Slide(slide.title, 3, [markdown2html(asked + question)], asks=True)
    yield slide


def _parts(text: str) -> Iterator[tuple[int, str, str]]:
    """Each heading of a cell with its level and its text; the text before the first one has no title."""
    fences = [range(*found.span()) for found in re.finditer(r"^```.*?^```", text, re.MULTILINE | re.DOTALL)]
    found = [each for each in HEADING.finditer(text) if not any(each.start() in fence for fence in fences)]
    ends = [each.start() for each in found[1:]] + [len(text)]
    yield 0, "", text[: found[0].start()] if found else text
    for each, end in zip(found, ends, strict=False):
        yield len(each[1]), each[2], text[each.end() : end]


def _code(cell: nbformat.NotebookNode, *, folded: bool) -> list[str]:
    """Return a cell of code and its stored outputs."""
    shown = [f'<pre class="code">{highlight(cell.source, PythonLexer(), COLOURS)}</pre>']
    told = "\n".join(filter(None, map(_output, cell.get("outputs", []))))
    if told and folded:
        return [*shown, f"<details><summary>Output</summary>\n{told}\n</details>"]
    return [*shown, told] if told else shown


def _output(output: nbformat.NotebookNode) -> str:
    if output.output_type == "stream":
        return f'<pre class="output">{ansi2html(output.text.rstrip())}</pre>'
    data = output.get("data", {})
    if "image/png" in data:
        alt = html.escape(output.metadata.get("image/png", {}).get("alt", ""))
        return f'<img alt="{alt}" src="data:image/png;base64,{"".join(data["image/png"].split())}">'
    return data.get("text/html") or f'<pre class="output">{html.escape(data.get("text/plain", ""))}</pre>'
