"""Helpers of public checks: what a program does with its command line and its exit status, by its text."""

import ast
import re
from pathlib import Path

from course.explaining.conditions import asked_by
from course.explaining.failure_report import frame_at
from course.explaining.mixups import assigned
from course.explaining.outline import EXITS, uncalled_main
from course.explaining.source import calls, functions, inside, name_of, parse, text_at
from course.foundation.syntax import walk

STATUSES = 256  # of an exit status, only the remainder by this is kept
LETTERS = ("capitalize", "casefold", "lower", "swapcase", "title", "upper")  # methods that change a word's letters
NO_STATUS = (ast.Attribute, ast.BinOp, ast.JoinedStr, ast.Subscript, ast.Tuple)  # values that may be no status


def lost_status(file: str, status: int) -> str:
    """Return lines about a last line that drops what main() returns, so that the exit status is 0; '' otherwise.

    `status` is the one with which the program ended.
    """
    source = text_at(Path(file))
    tree = parse(source)
    main = next((each for each in functions(tree) if each.name == "main"), None)
    returns = [each.value for each in walk(main) if isinstance(each, ast.Return)] if main else []
    given_to = [each for name in EXITS for call in calls(tree, name) for each in call.args]
    for value in (each for each in (*returns, *given_to) if status == 0 and isinstance(each, ast.Constant)):
        if isinstance(value.value, int) and value.value and value.value % STATUSES == 0:
            return (
                f"\n{frame_at(file, value.lineno, source)}\nAn exit status is a number from 0 to 255, so {value.value} "
                "becomes 0: use 1."
            )
    for handler in (node for node in walk(main or ast.Module([], [])) if isinstance(node, ast.ExceptHandler)):
        for node in (each for statement in handler.body for each in walk(statement)):
            if isinstance(node, ast.Return) and node.value is None and status == 0 and any(returns):
                return (
                    f"\n{frame_at(file, node.lineno, source)}\nThis returns None, which is the status 0: write "
                    "`return 1`, for example."
                )
    for node in inside(main) if main and status == 0 and given_to else ():
        if isinstance(node, ast.Return) and getattr(node.value, "value", None) is False:
            return (
                f"\n{frame_at(file, node.lineno, source)}\nWhat main() returns is the exit status, and False is the "
                "status 0: write `return 1`, for example."
            )
    exits = sum(name_of(node) in EXITS for node in walk(tree) if isinstance(node, (ast.Attribute, ast.Name)))
    given = [call for name in EXITS for call in calls(tree, name) if "main" in map(name_of, map(_function, call.args))]
    if main and not any(returns) and status == 0 and len(given) == exits == 1:
        return (
            f"\n{frame_at(file, main.lineno, source)}\nmain() returns nothing, so `{ast.unparse(given[0])}` ends with "
            "the status 0: return the status from main(), such as `return 1`."
        )
    for call in calls(tree, "main") if any(returns) and not exits and status == 0 else ():
        if any(isinstance(node, ast.Expr) and node.value is call for node in walk(tree)):
            return (
                f"\n{frame_at(file, call.lineno, source)}\nThis drops what main() returns, and the exit status is 0: "
                "write `sys.exit(main())`."
            )
    return ""


def printed_status(file: str, output: str, status: int) -> str:
    """Return lines about what main() returns in place of a status, which `sys.exit` may print; '' otherwise.

    Also about a program that prints nothing.  `output` and `status` are its own; a status of 0 is wanted.
    """
    source = text_at(Path(file))
    tree = parse(source)
    if status == 0 and not output.strip():
        return _nothing_printed(file, source)
    if status and (other := _in_other_letters(tree, output)):
        line, word, shown = other
        return (
            f"\n{frame_at(file, line, source)}\nThis compares with '{word}', and the word is '{shown}': capital and "
            "small letters differ."
        )
    main = next((each for each in functions(tree) if each.name == "main"), None)
    given = [name_of(getattr(each, "func", None)) for name in EXITS for call in calls(tree, name) for each in call.args]
    if status != 1 or main is None or "main" not in given or "Traceback" in output:
        return ""
    returns = [node for node in walk(main) if isinstance(node, ast.Return) and node.value]
    for node in returns:
        if _is_no_status(node.value, source):
            return (
                f"\n{frame_at(file, node.lineno, source)}\nWhat main() returns is the exit status: `sys.exit` prints "
                "anything but a whole number, and ends with 1. After a success, return 0."
            )
    for node in returns:
        literal = isinstance(node.value, ast.Constant) and node.value.value is True
        if literal or _is_success(node.value) or (len(returns) == 1 and _is_true(node.value)):
            return (
                f"\n{frame_at(file, node.lineno, source)}\nWhat main() returns is the exit status, and True is the "
                "status 1. After a success, return 0."
            )
    return ""


def _in_other_letters(tree: ast.Module, output: str) -> tuple[int, str, str] | None:
    """Return the line of a comparison of a variable with a word that is printed in other letters, and both words.

    None if a variable may have the word in those of the comparison.
    """
    texts = [node.value for node in walk(tree) if isinstance(node, ast.Constant)]
    if any(next(calls(tree, name), None) for name in LETTERS):
        return None
    shown = {word.lower(): word for word in re.findall(r"\w+", output.strip().rpartition("\n")[2])}
    for node in walk(tree):
        if isinstance(node, ast.Compare) and len(node.ops) == 1 and isinstance(node.ops[0], (ast.Eq, ast.NotEq)):
            for one, other in ((node.left, node.comparators[0]), (node.comparators[0], node.left)):
                word = getattr(other, "value", None) if isinstance(one, (ast.Name, ast.Attribute)) else None
                printed = shown.get(word.lower(), word) if isinstance(word, str) else word
                if word != printed and texts.count(word) == 1 and printed in texts and isinstance(word, str):
                    return node.lineno, word, str(printed)
    return None


def zero_is_false(file: str, option: str) -> str:
    """Return lines about a number of the command line, such as `cancel_after`, whose 0 counts as false; '' otherwise.

    It is looked for where no other line of the text compares the number with 0 or None.
    """
    source = text_at(Path(file))
    tree = parse(source)

    def is_it(node: ast.AST) -> bool:
        return isinstance(node, (ast.Attribute, ast.Name)) and name_of(node).strip("_") == option

    compared = [node for node in walk(tree) if isinstance(node, ast.Compare)]
    sides = [[node.left, *node.comparators] for node in compared]
    if any(any(map(is_it, each)) and any(isinstance(one, ast.Constant) for one in each) for each in sides):
        return ""
    defaults = [each.value for call in calls(tree, "add_argument") for each in call.keywords if each.arg == "default"]
    if any(getattr(each, "value", 0) is not None for each in defaults):
        return ""
    for node in walk(tree):
        for asked in filter(is_it, asked_by(node)):
            text = ast.unparse(asked)
            return (
                f"\n{frame_at(file, asked.lineno, source)}\nIn a condition, 0 counts as false, as None does: "
                f"`{text} is not None` asks whether there is a number."
            )
    return ""


def _function(node: ast.expr) -> ast.expr | None:
    """Return the function of a call; None for another expression."""
    return node.func if isinstance(node, ast.Call) else None


def _nothing_printed(file: str, source: str) -> str:
    """Return lines that say that a program has printed nothing, with the line that only names main()."""
    lines = f"\n{file} printed nothing."
    if early := return_in_finally(file):
        return f"{lines}{early}"
    if not (uncalled := uncalled_main(source)):
        return lines
    line, why = uncalled
    return f"{lines}\n{frame_at(file, line, source)}\n{why}" if line else f"{lines} {why}"


def return_in_finally(file: str) -> str:
    """Return lines about a `return` in a `finally` of main(), which drops what stands below it; '' if there is none."""
    source = text_at(Path(file))
    for main in (each for each in functions(parse(source)) if each.name == "main"):
        for tried in (node for node in walk(main) if isinstance(node, ast.Try)):
            for node in (each for statement in tried.finalbody for each in walk(statement)):
                if isinstance(node, ast.Return) and main.body[-1] is not tried:
                    return (
                        f"\n{frame_at(file, node.lineno, source)}\nThis `return` is in `finally` and always ends "
                        "main(): what is below it never runs."
                    )
    return ""


def _is_no_status(value: ast.expr | None, source: str) -> bool:
    """Return True for a value that may be something else than a number: a text, or a name that may hold one."""
    if isinstance(value, ast.Name):
        held = [each for _, each in assigned(value, source)]
        return not held or any(isinstance(each, (*NO_STATUS, ast.Call)) for each in held)
    if _is_success(value):
        return False
    return isinstance(value, NO_STATUS) or (isinstance(value, ast.Constant) and isinstance(value.value, str))


def _is_success(value: ast.expr | None) -> bool:
    """Return True for the field `success` of a response."""
    return isinstance(value, ast.Attribute) and value.attr == "success"


def _is_true(value: ast.expr | None) -> bool:
    """Return True for a value that is True after a success: `True`, or a comparison such as `outcome == 'DONE'`."""
    if isinstance(value, ast.Compare):
        return isinstance(value.ops[0], (ast.Eq, ast.In, ast.Is))
    return isinstance(value, ast.Constant) and value.value is True


def kept_name(file: str) -> str:
    """Return lines about words of the command line from which nothing takes off the program's name; else ''."""
    source = text_at(Path(file))
    tree = parse(source)
    made = list(calls(tree, "remove_ros_args"))
    several = (
        each
        for node in walk(tree)
        for each in ([*node.targets] if isinstance(node, ast.Assign) else [])
        if isinstance(each, (ast.List, ast.Tuple))
    )
    longer = any(len(each.elts) > 3 or any(isinstance(one, ast.Starred) for one in each.elts) for each in several)
    indices = [node.slice for node in walk(tree) if isinstance(node, ast.Subscript)]
    sliced = any(isinstance(each, ast.Slice) and each.lower is not None for each in indices)
    fourth = any(isinstance(each, ast.Constant) and each.value == 3 for each in indices)
    taken_off = any(isinstance(node, ast.Delete) for node in walk(tree))  # `del words[0]`
    taken_off |= any(next(calls(tree, name), None) for name in TAKES_OFF)
    if longer or sliced or fourth or taken_off:
        return _counted(tree, file, source)
    lines = [call.lineno for call in made] or [
        node.lineno
        for node in walk(tree)
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], (ast.List, ast.Tuple))
        if any(map(_is_command_line, _parts(node.value)))
    ]
    if len(lines) != 1:
        return ""
    return (
        f"\n{frame_at(file, lines[0], source)}\nThe first of these words is the program's name, and nothing in the "
        "file removes it."
    )


def _parts(value: ast.expr) -> list[ast.expr]:
    """Return a value, or the members of a tuple or a list."""
    return value.elts if isinstance(value, (ast.Tuple, ast.List)) else [value]


def _is_command_line(value: ast.expr) -> bool:
    """Return True for `sys.argv`, and for its first word, `sys.argv[0]`."""
    first = isinstance(value, ast.Subscript) and isinstance(value.slice, ast.Constant) and value.slice.value == 0
    return ast.unparse(value.value if first else value) == "sys.argv"  # type: ignore[attr-defined]


TAKES_OFF = ("islice", "next", "pop", "popleft", "remove")


def _counted(tree: ast.Module, file: str, source: str) -> str:
    """Return lines about words without the program's name that are counted as if they had it: `len(words) != 4`.

    Or about words with it that are counted as if they had it not: `len(words) != 3`.
    """
    for node in (each for each in walk(tree) if isinstance(each, ast.Compare) and len(each.ops) == 1):
        count, counted = node.comparators[0], node.left
        if not (isinstance(counted, ast.Call) and name_of(counted.func) == "len" and len(counted.args) == 1):
            continue
        held = [value for _, value in assigned(counted.args[0], source)]
        cut = [each.slice for each in held if isinstance(each, ast.Subscript) and isinstance(each.slice, ast.Slice)]
        first = [getattr(each.lower, "value", None) for each in cut if each.upper is None and each.step is None]
        if isinstance(count, ast.Constant) and count.value == 4 and first and first == [1] * len(held):
            name = ast.unparse(counted.args[0])
            return (
                f"\n{frame_at(file, node.lineno, source)}\nThe program's name is not in `{name}` any more: A, B and "
                "OPERATION are 3 words."
            )
        whole = [value for value in held if _is_whole(value)]
        if isinstance(count, ast.Constant) and count.value == 3 and whole and len(whole) == len(held):
            name = ast.unparse(counted.args[0])
            return (
                f"\n{frame_at(file, node.lineno, source)}\nThe first word of `{name}` is the program's name: with A, B "
                "and OPERATION it has 4 words."
            )
    return ""


def _is_whole(value: ast.expr) -> bool:
    """Return True for the whole command line: `sys.argv`, or what `remove_ros_args` returns."""
    return ast.unparse(value) == "sys.argv" or (
        isinstance(value, ast.Call) and name_of(value.func) == "remove_ros_args" and "[" not in ast.unparse(value)
    )
