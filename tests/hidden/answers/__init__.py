"""Answers to each exercise, one module each: right ones in several styles, and wrong ones as students err.

A module has RIGHT, the files by name of the style, and WRONG, the files and the tests (without "test_") that they lose
by what is wrong.  Most are the reference with a few lines changed, so that what differs can be seen.  The wrong ones in
SILENT keep the grader waiting: they are graded with less patience, so that the tests take less time.

An answer in WRONG has exactly one mistake, unless it is in NOTHING (programs that do nothing that the task asks for) or
in SEVERAL.  Those in USELESS have one mistake, and one of their programs does nothing useful because of it.  Those in
ABOUT have a mistake in what the exercise is about, those in DETAIL a mistake in a detail; those in BROAD break with one
line most of what it is about, or so many of its details that this costs as much.

The sets in TOGETHER have mistakes that are judged as one program in every run of the tests: in different places of the
reference, and none hides another or changes what is said of it.
"""

import importlib
import pkgutil
from collections.abc import Collection
from difflib import SequenceMatcher
from itertools import pairwise
from pathlib import Path

SOLUTIONS = Path(__file__).parents[3] / "solutions"
# The end of the reference's main() that spins its node, and one that ends by itself.
SPINS_FOR_TWO_SECONDS = (
    "        rclpy.spin(node)\n",
    """
        import time
        end = time.monotonic() + 2
        while time.monotonic() < end:
            rclpy.spin_once(node, timeout_sec=0.1)
""",
)


def names() -> list[str]:
    """The exercises that have answers here."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__))


def solution(exercise: str) -> dict[str, bytes]:
    """The files of the reference solution."""
    return {path.name: path.read_bytes() for path in (SOLUTIONS / exercise).iterdir() if path.is_file()}


def load(exercise: str):
    """The module of that exercise."""
    return importlib.import_module(f"{__name__}.{exercise}")


def files(exercise: str, name: str) -> dict[str, bytes]:
    """Return the files of an answer."""
    module = load(exercise)
    return module.RIGHT[name] if name in module.RIGHT else module.WRONG[name][0]


def seed(exercise: str, name: str) -> int | None:
    """Return the seed of the hidden inputs: for wrong answers the SEED of a module that has one, else None."""
    return getattr(load(exercise), "SEED", None) if name in load(exercise).WRONG else None


def patience(exercise: str, name: str) -> float:
    """Return how patiently an answer is graded."""
    return 0.5 if name in getattr(load(exercise), "SILENT", ()) else 1.0


def is_quick(exercise: str, name: str) -> bool:
    """Return True for an answer that every run of the tests judges by the whole suite: those in its module's QUICK."""
    return name in load(exercise).QUICK


def proofs(exercise: str) -> dict[str, str]:
    """Return for each hidden test (without "test_") a wrong answer that it alone catches.

    Every run of the tests judges it by that test.  It is the first in WRONG, unless that keeps the grader
    waiting and another does not.
    """
    silent, found = named(exercise, "SILENT"), {}
    for name, (_, lost) in sorted(load(exercise).WRONG.items(), key=lambda answer: answer[0] in silent):
        if len(lost) == 1:
            found.setdefault(*lost, name)
    return found


def sets(exercise: str) -> list[set[str]]:
    """Return the module's TOGETHER: none in that of a new exercise."""
    return getattr(load(exercise), "TOGETHER", [])


def together(exercise: str) -> list[dict[str, str]]:
    """Return the `proofs` in groups, each judged as one program (see `merged`): those of TOGETHER, the others alone."""
    known = proofs(exercise)
    groups = [{test: name for test, name in known.items() if name in names} for names in sets(exercise)]
    alone = [{test: name} for test, name in known.items() if not any(test in group for group in groups)]
    return groups + alone


def merged(exercise: str, names: Collection[str]) -> dict[str, bytes]:
    """Return the reference with what each of these answers changes; no two may change the same place."""
    found = {}
    for file, content in load(exercise).REFERENCE.items():
        changes = sorted(change for name in names for change in _changes(exercise, name, file))
        assert all(end < start for (_, end, _), (start, _, _) in pairwise(changes)), f"two change one place of {file}"
        lines = content.decode().splitlines(keepends=True)
        for start, end, new in reversed(changes):
            lines[start:end] = new
        found[file] = "".join(lines).encode()
    return found


def _changes(exercise: str, name: str, file: str) -> list[tuple[int, int, list[str]]]:
    """Return from which line to which an answer's file differs from the reference's, and what stands there instead."""
    old, new = (of[file].decode().splitlines(keepends=True) for of in (load(exercise).REFERENCE, files(exercise, name)))
    found = SequenceMatcher(None, old, new, autojunk=False).get_opcodes()
    return [(start, end, new[begin:stop]) for kind, start, end, begin, stop in found if kind != "equal"]


def named(exercise: str, kind: str) -> set[str]:
    """The wrong answers that the module's set `kind` names, such as NOTHING, SEVERAL, ABOUT or SILENT."""
    return set(getattr(load(exercise), kind, ()))


def changed(files: dict[str, bytes], name: str, *pairs: tuple[str, str]) -> dict[str, bytes]:
    """`files` with each pair's first text replaced by its second in file `name`; every text must be there."""
    text = files[name].decode()
    for old, new in pairs:
        assert old in text, f"{name} no longer has {old!r}"
        text = text.replace(old, new)
    return files | {name: text.encode()}
