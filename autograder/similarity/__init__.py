"""`autograder similar`: pairs of submissions that are more alike than the exercise makes them.

Each program is reduced to tokens that survive disguise: Python's tokens without names, values, comments, docstrings and
layout (`tokens`).  Hashes of some of its runs of tokens are its fingerprints (`winnowing`).  Code that every student
was given - the notebooks' stubs and examples, the chapter's nodes - leaves no fingerprints (`sources`).

Right answers to a short exercise are naturally alike.  So a shared fingerprint counts more if fewer submissions have
it, and the score of a pair is the share of the shorter program that is found in the other one and hardly anywhere else
(`comparing`).  It is a reason to look at the two side by side (`marking`, `presenting`), not a verdict.

Written here rather than taken from copydetect (MIT, 0.5.0 of 2024, the same algorithm): it reads files by path, follows
links, compares the pairs one after the other, does not weight common code less than rare code, and its page loads
scripts from other sites.
"""

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

from autograder.similarity import sources
from autograder.similarity.comparing import Finding, compare

__all__ = ["find"]


def find(folder: Path, assignment: str | None, top: int, earlier: Iterable[Path] = ()) -> list[Finding]:
    """The `top` pairs of submissions that are most alike, by exercise; raises UsageError.

    `folder` is the one that `autograder grade` was given, or its output, which records where the files are.  The
    folders of `earlier` courses can be either, too; their submissions are compared with those in `folder`.
    """
    before = defaultdict(list)
    for other in earlier:
        for (student, name), (submitted, _) in sorted(sources.places(other, assignment).items()):
            before[name].append((f"{student} ({other})", sources.files(submitted, student, name)))
    handed_in, replaced = defaultdict(list), defaultdict(list)
    for (student, name), (submitted, basis) in sorted(sources.places(folder, assignment).items()):
        handed_in[name].append((student, submitted))
        if basis and basis.is_replaced((student, name)):
            replaced[name].append(student)
    return [
        compare(
            name,
            [(student, sources.files(submitted, student, name)) for student, submitted in places],
            sources.given(name, {submitted for _, submitted in places}),
            top,
            before[name],
            replaced[name],
        )
        for name, places in handed_in.items()
    ]
