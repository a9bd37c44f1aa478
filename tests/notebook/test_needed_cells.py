"""The cells that an exercise needs are found by the names that cells make and use."""

import ast
from pathlib import Path

import pytest

from course.explaining.source import parse, parse_anew
from course.foundation import cells
from course.foundation.cells import Cell
from course.notebook.needed_cells import names_of, needed_cells

NOTEBOOKS = sorted((Path(__file__).parents[2] / "notebooks").glob("[!.]*/*.ipynb"))


def code(source, **mark):
    return Cell("code", source, mark)


def check(source):
    return code(source, grade=True, locked=True, grade_id="check")


def test_the_cells_that_make_what_a_check_uses_are_needed_and_no_others():
    page = [
        code("import course\nros = course.live()"),
        Cell("markdown", "text"),
        code("def shown():\n    return unused"),
        code("first = 1"),
        code("second = first + 1"),
        code("second = 5"),
        code("print(second)"),
        check("assert second == 5 and ros.call('/a')"),
    ]
    assert needed_cells(page) == [0, 5, 7]


def test_what_is_needed_may_need_more():
    page = [code("from a import base"), code("x = 1"), code("def f():\n    return base + x"), check("assert f()")]
    assert needed_cells(page) == [0, 1, 2, 3]


def test_an_exercise_needs_the_session():
    page = [code("ros = object()"), code("y = 2"), code("%%exercise a.py\nprint(y)", solution=True)]
    assert needed_cells(page) == [0, 2]


def test_a_name_that_a_cell_changes_is_needed_from_before():
    page = [code("count = 0"), code("count = count + 1"), check("assert count")]
    assert needed_cells(page) == [0, 1, 2]


@pytest.mark.parametrize(
    ("source", "made", "used"),
    [
        ("import a.b, c as d\nfrom e import f", {"a", "d", "f"}, set()),
        ("x = y\ny = x", {"x", "y"}, {"y"}),
        ("class A(B):\n    def m(self, z):\n        return z + w", {"A"}, {"B", "w"}),
        ("x += 1", {"x"}, {"x"}),
        ("a = [b + c for b in d]", {"a"}, {"c", "d"}),
        ("a = {[b for b in c] for c in d} | {e: f for e, f in g}", {"a"}, {"d", "g"}),
        ("for i in range(n):\n    print(i)", {"i"}, {"n"}),
        ("with open(p) as f:\n    t = f.read()", {"f", "t"}, {"p"}),
        ("def f(x=k):\n    y = x\n    return f(y)", {"f"}, {"k"}),
        ("def f():\n    return later\nlater = 1\nf()", {"f", "later"}, set()),
        ("class A:\n    x = y\n    def m(self):\n        return z", {"A"}, {"y", "z"}),
        ("!ls\n%time 1\nprint(len(q))", set(), {"q"}),
        ("%%exercise a.py\nx = 1", set(), set()),
        ("x = = 1", set(), set()),
    ],
)
def test_the_names_of_a_cell(source, made, used):
    assert names_of(source).made == made
    assert names_of(source).used == used


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_exercises_of_a_section_need_less_than_the_page(path):
    page = cells.read(path)
    kept = needed_cells(page)
    assert {number for number, cell in enumerate(page) if cell.public_check} <= set(kept)
    assert len(kept) < sum(cell.kind == "code" for cell in page)


def test_the_tree_of_a_program_is_kept_and_the_names_of_a_cell_leave_it_as_it_is():
    text = "squares = [number * number for number in range(3)]\n"
    tree = parse(text)
    assert parse(text) is tree and parse_anew(text) is not tree
    before = ast.dump(tree)
    assert names_of(text).made == {"squares"} and ast.dump(tree) == before
