"""Calls of the course's functions that do not fit: an argument is missing, superfluous or not a number."""

import contextlib
import functools
import inspect
import math
from collections.abc import Callable
from numbers import Integral, Real
from typing import ParamSpec, TypeVar

from course.errors import ArgumentError

Given = ParamSpec("Given")
Got = TypeVar("Got")


def fitting(function: Callable[Given, Got]) -> Callable[Given, Got]:
    """A decorator: a call that does not fit raises ArgumentError, which names the arguments that there are."""

    @functools.wraps(function)
    def call(*args: Given.args, **kwargs: Given.kwargs) -> Got:
        try:
            return function(*args, **kwargs)
        except TypeError:
            form = inspect.signature(function)
            try:
                form.bind(*args, **kwargs)
            except TypeError as error:
                name = function.__qualname__.removesuffix(".__init__").rpartition(".")[2]
                names = ", ".join(each for each in form.parameters if each != "self")
                raise ArgumentError(f"`{name}`: {error}. Its arguments are: {names}") from None
            raise

    return call


def takes(function: object, *args: object) -> bool:
    """Return True for a function that may be called with these arguments."""
    if not callable(function):
        return False
    with contextlib.suppress(ValueError):  # of a function without a signature, which is written in C
        try:
            inspect.signature(function).bind(*args)
        except TypeError:
            return False
    return True


def is_number(value: object, low: float = -math.inf, high: float = math.inf) -> bool:
    """Return True for a finite number from `low` to `high`."""
    return isinstance(value, Real) and math.isfinite(value) and low <= float(value) <= high


def is_whole(value: object, low: float = -math.inf, high: float = math.inf) -> bool:
    """Return True for a whole number from `low` to `high`."""
    return not isinstance(value, bool) and isinstance(value, Integral) and low <= int(value) <= high
