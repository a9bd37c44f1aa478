"""The cells that a notebook's exercises need: their own, the public checks, and those that define the names used.

Other cells of a page may take long, and need not be run to check the exercise.
"""

import ast
import builtins
import symtable
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from course.explaining.source import parse_anew
from course.foundation.cells import Cell

SESSION = "ros"  # the session's name in the notebooks
MAGIC = "%%exercise"
AT_ONCE = "genexpr"  # a separate scope that runs at once


@dataclass(frozen=True)
class Names:
    """The names of a code cell."""

    made: set[str] = field(default_factory=set)  # names that it defines, assigns or imports for later cells
    used: set[str] = field(default_factory=set)  # names that it reads before defining them itself


def names_of(source: str) -> Names:
    """Return the names that a cell makes and uses; none for a cell magic, or a cell that is not Python."""
    if source.lstrip().startswith("%%"):
        return Names()
    made: set[str] = set()
    used: set[str] = set()
    called: set[str] = set()
    for statement in parse_anew(source).body:
        table = symtable.symtable(ast.unparse(_Comprehensions().visit(statement)), "cell", "exec")
        makes = {symbol.get_name() for symbol in table.get_symbols() if symbol.is_assigned() or symbol.is_imported()}
        reads = set(_read(table, later=False))
        if isinstance(statement, ast.AugAssign):
            reads |= makes
        elif not isinstance(statement, (ast.Assign, ast.AnnAssign)):
            reads -= makes  # a loop reads its own variable, and a function its own name
        used |= reads - made
        made |= makes
        called |= set(_read(table, later=True))
    used |= called - made  # a function reads names when it is called; by then the cell has made all of its own
    return Names(made, used - set(dir(builtins)))


class _Comprehensions(ast.NodeTransformer):
    """Turns all comprehensions into generator expressions, the only ones with a separate scope from Python 3.12 on."""

    def visit_ListComp(self, node: ast.ListComp | ast.SetComp) -> ast.AST:  # the name is given by ast
        return self.generic_visit(ast.GeneratorExp(node.elt, node.generators))

    visit_SetComp = visit_ListComp  # noqa: N815

    def visit_DictComp(self, node: ast.DictComp) -> ast.AST:
        pair = ast.Tuple([node.key, node.value], ast.Load())
        return self.generic_visit(ast.GeneratorExp(pair, node.generators))


def _read(table: symtable.SymbolTable, *, later: bool, inside: bool = False) -> Iterator[str]:
    """Return the names of the cell's scope that a statement reads at once, or `later`, in the functions it defines."""
    inside = inside or (table.get_type() == "function" and table.get_name() != AT_ONCE)
    if inside == later:
        for symbol in table.get_symbols():
            if symbol.is_referenced() and (table.get_type() == "module" or symbol.is_global()):
                yield symbol.get_name()
    for inner in table.get_children():
        yield from _read(inner, later=later, inside=inside)


def needed_cells(cells: Sequence[Cell]) -> list[int]:
    """Return the indices of the code cells that the exercises need, in order.

    Side effects of a cell (appending to a list, starting a node) are not noticed: a public check that relies on them
    must do them itself.
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
