"""The texts of two submissions side by side, with common passages marked."""

import statistics
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import NamedTuple

from autograder.similarity.winnowing import WINDOW, K, Place, Program

UNMARKED = 0  # the number of text that is not alike
CLOSE = K + WINDOW  # tokens at most from a fingerprint to the next one of the same passage
NEVER_COMMON = 3  # programs: a passage in no more than these is not common, however small the class
COMMON = 1 / 4  # of all programs: a passage in more of them is common


@dataclass(frozen=True)
class Piece:
    """A part of a text.  Unless its number is UNMARKED, it resembles the opposite parts with the same number."""

    text: str
    number: int
    common: bool = False  # many other submissions have it as well
    first: bool = False  # the first with its number in this text, the target of a link


@dataclass(frozen=True)
class SideBySide:
    """A file of two submissions."""

    name: str
    left: list[Piece]
    right: list[Piece]


class Step(NamedTuple):
    """A fingerprint that two programs share, and where in each."""

    left: Place
    right: Place
    gram: int


class Span(NamedTuple):
    """A run of tokens of a file."""

    file: str
    begin: int  # number of the first token
    end: int  # number of the token after the last


@dataclass(frozen=True)
class Passage:
    """Shared fingerprints that follow each other closely in both programs."""

    steps: list[Step]

    @property
    def left(self) -> Span:
        """The tokens of the passage in the left program."""
        return Span(self.steps[0].left.file, self.steps[0].left.token, self.steps[-1].left.token + K)

    @property
    def right(self) -> Span:
        """The tokens of the passage in the right program."""
        return Span(self.steps[0].right.file, self.steps[0].right.token, self.steps[-1].right.token + K)


class Side:
    """One of the two programs, while its tokens are numbered by passage."""

    def __init__(self, program: Program):
        self._program = program
        self._numbers = {name: [UNMARKED] * len(found) for name, found in program.tokens.items()}
        self._shown: set[int] = set()

    def numbers(self, span: Span) -> list[int]:
        """The numbers of these tokens."""
        return self._numbers[span.file][span.begin : span.end]

    def mark(self, span: Span, number: int) -> None:
        """Give these tokens a number, except those that already have one."""
        self._numbers[span.file][span.begin : span.end] = [old or number for old in self.numbers(span)]

    def pieces(self, name: str, common: Mapping[int, bool]) -> Iterator[Piece]:
        """The text of a file, cut where the numbers of its tokens change; `common` tells which numbers are.

        Call it for one file after the other, in the order in which they are shown.
        """
        text = self._program.texts.get(name, "")
        done = 0
        numbered = zip(self._program.tokens.get(name, []), self._numbers.get(name, []), strict=True)
        for number, group in groupby(numbered, key=lambda each: each[1]):
            tokens = [token for token, _ in group]
            begin, end = tokens[0].start, tokens[-1].end
            end -= len(text[begin:end]) - len(text[begin:end].rstrip())
            begin += len(text[begin:end]) - len(text[begin:end].lstrip())
            if number != UNMARKED and begin < end:
                yield Piece(text[done:begin], UNMARKED)
                yield Piece(text[begin:end], number, common[number], number not in self._shown)
                self._shown.add(number)
                done = end
        yield Piece(text[done:], UNMARKED)


def side_by_side(left: Program, right: Program, owners: Mapping[int, int], programs: int) -> list[SideBySide]:
    """The texts of a pair, file by file, with the passages that are alike numbered from 1, longest first.

    `owners` says how many of the `programs` have each fingerprint.
    """
    one, other = Side(left), Side(right)
    common = {UNMARKED: False}
    for passage in sorted(passages(left, right), key=lambda passage: len(passage.steps), reverse=True):
        # A passage that mostly resembles another one gets the number of that: the left program has it twice.
        opposite = other.numbers(passage.right)
        taken, times = Counter(opposite).most_common(1)[0]
        number = taken if taken != UNMARKED and times > len(opposite) / 2 else len(common)
        if number not in common:
            usual = statistics.median(owners[step.gram] for step in passage.steps)
            common[number] = usual > max(NEVER_COMMON, programs * COMMON)
        one.mark(passage.left, number)
        other.mark(passage.right, number)
    return [
        SideBySide(name, [*one.pieces(name, common)], [*other.pieces(name, common)])
        for name in {**left.texts, **right.texts}
    ]


def passages(left: Program, right: Program) -> Iterator[Passage]:
    """The passages that two programs have in common, in the order of the left one."""
    shared = sorted((place, gram) for gram, places in left.prints.items() if gram in right.prints for place in places)
    steps: list[Step] = []
    for place, gram in shared:
        opposite = right.prints[gram]
        going_on = [there for there in opposite if _goes_on(steps[-1], place, there)] if steps else []
        if going_on:
            steps.append(Step(place, min(going_on), gram))
            continue
        if steps:
            yield Passage(steps)
        steps = [Step(place, opposite[0], gram)]
    if steps:
        yield Passage(steps)


def _goes_on(last: Step, left: Place, right: Place) -> bool:
    """Return True if a shared fingerprint at these places belongs to the passage that ends with `last`."""
    return (
        (left.file, right.file) == (last.left.file, last.right.file)
        and left.token - last.left.token <= CLOSE
        and 0 < right.token - last.right.token <= CLOSE
    )
