"""The copy of a handed-in notebook that an instructor is shown."""

from autograder.submissions.notebook import MAX_MARKDOWN, plain, safe
from course.foundation.cells import Cell


def text(source: str) -> Cell:
    return Cell("markdown", source)


def longest(source: str) -> int:
    return max(map(len, source.splitlines()))


def test_no_line_of_markdown_is_so_long_that_a_page_with_it_stops_the_server():
    """nbconvert looks through the rest of a line for each bracket: 100,000 of them in one line took 45 s."""
    for source in ("[" * 100_000, "[" * 20_000 + "](" * 20_000, "a word " * 10_000):
        (cell,) = safe([text(source)]).cells
        assert longest(cell.source) <= 2000
        assert cell.source.replace("\n", "") == source


def test_usual_text_is_shown_as_it_is():
    source = "A paragraph. " * 100 + "\n\n- a list\n- [with](https://example.org) a link\n"
    assert safe([text(source)]).cells[0].source == plain(source)


def test_many_cells_of_markdown_are_cut_off_together():
    cells = safe([text("[" * 40_000) for _ in range(100)]).cells
    assert len(cells) == 100
    assert sum(len(cell.source.replace("\n", "")) for cell in cells) < MAX_MARKDOWN + 100 * 60
    assert cells[-1].source.strip() == "... cut off here: too long to be shown"
