"""The highlighter of interface definitions: in a file's editor and in the cell that writes it, in both themes."""

import nbformat
import pytest
from playwright.sync_api import Locator, Page, expect

from course.foundation.waiting import wait_until
from course.interfaces.definition import parse
from tests.browser.conftest import WAIT
from tests.browser.pages import THEMES, cell, choose, keep_picture, open_page, set_theme

expect.set_options(timeout=WAIT)

# Each token of a definition, with the name of the colour that JupyterLab's themes have for it.
LINES = [
    [("# what int32 is for", "comment")],
    [("int32", "keyword"), ("MOST", "def"), ("=", "operator"), ("-0x1F", "number"), ("# a limit", "comment")],
    [("string", "keyword"), ("HELLO", "def"), ("=", "operator"), ('"say \\"hi\\""', "string")],
    [("string", "keyword"), ("WORD", "def"), ("=", "operator"), ("plain words", "string")],
    [("string", "keyword"), ("<=", "operator"), ("5", "number"), ("name", "property"), ("'anon'", "string")],
    [
        *[("float64", "keyword"), ("[", "punctuation"), ("<=", "operator"), ("3", "number"), ("]", "punctuation")],
        *[("samples", "property"), ("[", "punctuation"), ("-1.5", "number"), (",", "punctuation"), ("2e3", "number")],
        ("]", "punctuation"),
    ],
    [("uint8", "keyword"), ("[", "punctuation"), ("4", "number"), ("]", "punctuation"), ("colour", "property")],
    [("bool", "keyword"), ("on", "property"), ("true", "keyword")],
    [("---", "operator")],
    [("geometry_msgs/Point", "variable-2"), ("[]", "punctuation"), ("places", "property")],
    [("int32", "keyword"), ("sum", "property"), ("# of all", "comment")],
]
TEXT = """# what int32 is for
int32 MOST=-0x1F # a limit
string HELLO="say \\"hi\\""
string WORD=plain words
string<=5 name 'anon'
float64[<=3] samples [-1.5, 2e3]
uint8[4] colour
bool on true
---
geometry_msgs/Point[] places
int32 sum# of all
"""
# The coloured words of each line of an editor, with the names of all colours that are theirs: some share one.
COLOURED = """(editor, names) => {
  const probe = document.body.appendChild(document.createElement('span'));
  const colours = names.map(name => {
    probe.style.color = `var(--jp-mirror-editor-${name}-color)`;
    return getComputedStyle(probe).color;
  });
  probe.remove();
  const ofWord = word => names.filter((_, number) => colours[number] === getComputedStyle(word).color);
  const words = line => [...line.querySelectorAll('span')].filter(word => word.textContent.trim());
  const lines = [...editor.querySelectorAll('.cm-line')];
  return lines.map(line => words(line).map(word => [word.textContent, ofWord(word)]));
}"""


def expect_words(editor: Locator, lines: list[list[tuple[str, str]]]) -> None:
    """Wait until the lines of an editor have these words, each in its colour."""
    names = sorted({name for line in LINES for _, name in line})

    def right() -> bool:
        found = editor.evaluate(COLOURED, names)
        return [len(line) for line in found] == [len(line) for line in lines] and all(
            word == text and name in theirs
            for words, wanted in zip(found, lines, strict=True)
            for (word, theirs), (text, name) in zip(words, wanted, strict=True)
        )

    assert wait_until(right, WAIT / 1e3), editor.evaluate(COLOURED, names)


def expect_words_in_both_themes(page: Page, editor: Locator, lines: list[list[tuple[str, str]]], name: str) -> None:
    for theme in THEMES:
        set_theme(page, theme)
        expect_words(editor, lines)
        keep_picture(page, f"language-{name}-{theme.lower()}")


@pytest.mark.matrix  # only colours
def test_a_definition_is_coloured_in_its_file_and_in_the_cell_that_writes_it(lab, page):
    parse(TEXT, "Sensor.srv")  # ROS reads it
    folder = lab[2] / "language"
    folder.mkdir(exist_ok=True)
    (folder / "Sensor.srv").write_text(TEXT)
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    sources = [f"%%exercise Sensor.srv --package sensors\n{TEXT}", "%%exercise sensor.py\nint32 = None"]
    cells = [nbformat.v4.new_code_cell(source) for source in sources]
    nbformat.write(nbformat.v4.new_notebook(cells=cells, metadata=kernel), folder / "cells.ipynb")
    open_page(page, lab, f"{folder.name}/cells.ipynb")
    magic = [("%%exercise Sensor.srv --package sensors", "operator")]
    expect_words_in_both_themes(page, cell(page, 0).locator(".cm-content"), [magic, *LINES, []], "cell")
    python = cell(page, 1).locator(".cm-content")
    expect(python.locator("span").get_by_text("None")).to_be_visible()  # Python's highlighter knows it
    expect(python.locator("span").get_by_text("int32")).to_have_count(0)
    python.click()
    page.keyboard.press("Control+A")
    page.keyboard.insert_text("%%exercise Sensor.msg\nint32 value")
    expect_words(python, [[("%%exercise Sensor.msg", "operator")], [("int32", "keyword"), ("value", "property")]])
    page.keyboard.press("Control+A")
    page.keyboard.insert_text("%%exercise sensor.py\nint32 = None")
    expect(python.locator("span").get_by_text("None")).to_be_visible()
    expect(python.locator("span").get_by_text("int32")).to_have_count(0)
    choose(page, "File", "Open from Path…")
    page.get_by_role("dialog").locator("input").fill(f"{folder.name}/Sensor.srv")
    page.get_by_role("dialog").get_by_role("button", name="Open").click()
    expect_words_in_both_themes(page, page.locator(".jp-FileEditor .cm-content"), [*LINES, []], "file")
