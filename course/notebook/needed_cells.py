"""The cells that a notebook's exercises need: their own, the public checks, and those that make what these use.

A page shows much that takes its time.  Who only wants to know whether the exercise is right need not run it.
"""

import ast
import builtins
import symtable
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from course.foundation.cells import Cell

SESSION = "ros"  # what the notebooks call the session
MAGIC = "%%exercise"
AT_ONCE = "genexpr"  # a scope of its own that runs where it stands


@dataclass(frozen=True)
class Names:
    """The names of a code cell."""

    made: set[str] = field(default_factory=set)  # that it defines, assigns or imports for the cells after it
    used: set[str] = field(default_factory=set)  # that it reads before it has made them itself


def names_of(source: str) -> Names:
    """The names that a cell makes and uses; none for a cell magic, or a cell that is not Python."""
    if source.lstrip().startswith("%%"):
        return Names()
    lines = ("" if line.lstrip().startswith(("!", "%")) else line for line in source.splitlines())
    try:
        tree = ast.parse("\n".join(lines))
    except SyntaxError:
        return Names()
    made: set[str] = set()
    used: set[str] = set()
    called: set[str] = set()
    for statement in tree.body:
        table = symtable.symtable(ast.unparse(_Comprehensions().visit(statement)), "cell", "exec")
        makes = {symbol.get_name() for symbol in table.get_symbols() if symbol.is_assigned() or symbol.is_imported()}
        reads = set(_read(table, later=False))
        if isinstance(statement, ast.AugAssign):
            reads |= makes
        elif not isinstance(statement, (ast.Assign, ast.AnnAssign)):
            reads -= makes  # as a loop reads its own variable, and a function its own name
        used |= reads - made
        made |= makes
        called |= set(_read(table, later=True))
    used |= called - made  # a function reads when it is called: by then the cell has made all of its names
    return Names(made, used - set(dir(builtins)))


class _Comprehensions(ast.NodeTransformer):
    """Makes generator expressions of all comprehensions: from Python 3.12 on, the others have no scope of their own."""

    def visit_ListComp(self, node: ast.ListComp | ast.SetComp) -> ast.AST:  # ast's own name
        return self.generic_visit(ast.GeneratorExp(node.elt, node.generators))

    visit_SetComp = visit_ListComp  # noqa: N815

    def visit_DictComp(self, node: ast.DictComp) -> ast.AST:
        pair = ast.Tuple([node.key, node.value], ast.Load())
        return self.generic_visit(ast.GeneratorExp(pair, node.generators))


def _read(table: symtable.SymbolTable, *, later: bool, inside: bool = False) -> Iterator[str]:
    """The names of the cell's own scope that a statement reads: at once, or `later`, in the functions it defines."""
    inside = inside or (table.get_type() == "function" and table.get_name() != AT_ONCE)
    if inside == later:
        for symbol in table.get_symbols():
            if symbol.is_referenced() and (table.get_type() == "module" or symbol.is_global()):
                yield symbol.get_name()
    for inner in table.get_children():
        yield from _read(inner, later=later, inside=inside)


def needed_cells(cells: Sequence[Cell]) -> list[int]:
    """The positions of the code cells that the exercises need, in order.

    What a cell changes without giving it a name (it appends to a list, it starts a node) is not seen: a public check
    that relies on that must do it itself.
    """
    names = [names_of(cell.source) if cell.kind == "code" else Names() for cell in cells]
    wanted: set[int] = set()
    missing: set[str] = set()
    for position in range(len(cells) - 1, -1, -1):
        cell = cells[position]
        if cell.kind != "code":
            continue
        exercise = cell.source.lstrip("\n").startswith(MAGIC)
        if exercise:
            missing.add(SESSION)
        if exercise or cell.public_check or cell.solution or names[position].made & missing:
            wanted.add(position)
            missing = (missing - names[position].made) | names[position].used
    return sorted(wanted)
