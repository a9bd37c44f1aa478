"""Calls that are made whenever a kernel's session has begun: by the first cell, an `%%exercise` or a check."""

from collections.abc import Callable

begun: list[Callable[[], object]] = []  # called then
