"""The fingerprints of programs (Schleimer, Wilkerson, Aiken: Winnowing, SIGMOD 2003).

Every K consecutive tokens are hashed into a gram; of every WINDOW consecutive grams the smallest is a fingerprint.  So
two programs with a common run of K + WINDOW - 1 tokens share a fingerprint, wherever the run is.
"""

from collections import defaultdict
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from hashlib import blake2b
from typing import NamedTuple

from autograder.similarity.hiding import hides, may_hide, parsed
from autograder.similarity.tokens import Token, tokens

K = 12  # tokens in a row that are hashed together
WINDOW = 5  # grams of which one is kept
LONG = 20  # characters of a token: the rest of a longer one, a text, does not count as a part of the program
MAX_PLACES = 20  # shown of one fingerprint in a submission: a million equal lines must not take hours


class Place(NamedTuple):
    """The position of a fingerprint; places are in order by file, then by token."""

    file: str
    token: int  # the number of its first token in the file


@dataclass(frozen=True)
class Program:
    """One student's submission to an exercise: its Python files."""

    student: str
    texts: Mapping[str, str]  # by file
    tokens: Mapping[str, list[Token]]  # by file
    prints: Mapping[int, list[Place]]  # the places of each fingerprint
    hidden: list[str]  # files that do not show what they do, and are not compared
    doubtful: list[str]  # further files that may do something that they do not show


def program(student: str, texts: Mapping[str, str], boilerplate: Collection[int]) -> Program:
    """Return a student's submission, `texts` by file, with its fingerprints, which exclude grams in `boilerplate`.

    A file that does not show what it does has no fingerprints: they would be those of its wrapper.
    """
    nodes = {name: parsed(text) for name, text in texts.items()}
    hidden = [name for name in texts if hides(nodes[name])]
    found = {name: [] if name in hidden else tokens(text) for name, text in texts.items()}
    sizes = {name: sum(min(token.end - token.start, LONG) for token in these) for name, these in found.items()}
    doubtful = [name for name in texts if name not in hidden and may_hide(nodes[name], sizes[name])]
    prints: dict[int, list[Place]] = defaultdict(list)
    for name, these in found.items():
        hashes = grams(these)
        for number in winnow(hashes, boilerplate):
            if len(prints[hashes[number]]) < MAX_PLACES:
                prints[hashes[number]].append(Place(name, number))
    return Program(student, texts, found, dict(prints), hidden, doubtful)


def grams(found: list[Token]) -> list[int]:
    """The hash of every K tokens in a row."""
    kinds = [token.kind.encode() for token in found]
    return [
        int.from_bytes(blake2b(b" ".join(kinds[i : i + K]), digest_size=8).digest()) for i in range(len(kinds) - K + 1)
    ]


def winnow(hashes: list[int], boilerplate: Collection[int]) -> list[int]:
    """Return the indices of the fingerprints: in each window the last of the smallest grams, without boilerplate."""
    numbers = set()
    for begin in range(max(1, len(hashes) - WINDOW + 1)):
        window = [
            (gram, -number)
            for number, gram in enumerate(hashes[begin : begin + WINDOW], begin)
            if gram not in boilerplate
        ]
        if window:
            numbers.add(-min(window)[1])
    return sorted(numbers)
