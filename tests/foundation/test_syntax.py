"""Syntax trees that several threads make at once."""

import ast
import gc
import threading
import time

import pytest

from course.foundation import syntax
from course.foundation.syntax import syntax_tree

TEXT = "x = [((1 + 2) * 3, {'a': [4, 5]})]\n" * 30


class Slow:
    """An object in a circle, whose finalizer lets other threads run."""

    def __init__(self):
        self.me = self

    def __del__(self):
        time.sleep(1e-4)


def test_threads_that_make_trees_at_once_do_not_disturb_each_other():
    failed, usual = [], gc.get_threshold()

    def make():
        for _ in range(60):
            for _ in range(5):
                Slow()
            try:
                syntax_tree(TEXT)
            except BaseException as error:
                failed.append(error)

    threads = [threading.Thread(target=make) for _ in range(3)]
    gc.set_threshold(20)
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        gc.set_threshold(*usual)
    assert failed == []


def test_a_tree_that_met_one_of_another_thread_is_made_again(monkeypatch):
    met = [SystemError("AST constructor recursion depth mismatch")] * 2

    def parse(text):
        if met:
            raise met.pop()
        return ast.Module([], [])

    monkeypatch.setattr(syntax.ast, "parse", parse)
    assert isinstance(syntax_tree("a"), ast.Module)


@pytest.mark.parametrize("number", ["0x" + "f" * 4000, "0b" + "1" * 20_000, "0o7_" + "7" * 5000])
def test_a_number_with_too_many_digits_for_decimal_ones_is_written(number):
    """Python refuses to write it: ValueError, "Exceeds the limit (4300 digits)"."""
    statement = f"x = [-{number}, 0x10, True]"
    tree = syntax_tree(f"{statement}\nmatch x:\n    case {number}:\n        print(f'{{x:{number}}}')\n")
    written = ast.unparse(tree)
    hexadecimal = hex(ast.literal_eval(number))
    assert written.startswith(f"x = [-{hexadecimal}, 16, True]\n") and f"case {hexadecimal}:" in written
    assert ast.unparse(syntax_tree(written)) == written
    value = tree.body[0].value.elts[0].operand.value
    assert value == ast.literal_eval(number) and {str(value), f"{value}", f"{value!r}"} == {hexadecimal}
    assert hexadecimal in ast.dump(tree)


def test_a_text_that_is_not_python_is_an_error():
    with pytest.raises(SyntaxError):
        syntax_tree("def")
