"""Comparison of submissions: every one is compared with every other."""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray

from autograder.similarity.marking import SideBySide, side_by_side
from autograder.similarity.tokens import is_longer, tokens
from autograder.similarity.winnowing import Program, grams, program
from autograder.submissions import exercises
from autograder.suitekit.untrusted import UNREADABLE

ENOUGH = 10  # fingerprints: a program with fewer counts as if it had as many, because it proves little
LONGEST = 50_000  # characters of a file without comments, five times what the exercises need: more would take minutes
LEAST = 1  # score of a pair that is shown
STRIKING = 60  # score of a pair; independent right answers stay below 30
COMMON = 80  # percent in common, striking whoever else has it: as in a ring of copies


@dataclass(frozen=True)
class Pair:
    """Two submissions that are alike."""

    left: str  # student
    right: str  # student
    score: float  # 0 to 100: the share of the shorter one that is in the other, and hardly anywhere else
    shared: float  # 0 to 100: the share of the shorter one that is in the other, common code included
    identical: list[str]  # files that are byte for byte the same
    files: list[SideBySide] = field(default_factory=list)


@dataclass(frozen=True)
class Group:
    """Submissions that striking pairs connect.

    Those have identical files, a score of STRIKING or more, or COMMON percent of the shorter one in common.
    """

    students: list[str]
    pairs: int  # how many striking pairs there are among them
    highest: float  # score of these pairs, or what they have in common (percent) if that is COMMON or more
    identical: list[str]  # files that are byte for byte the same for all of them
    partly: list[str]  # further files, the same for some of them


@dataclass(frozen=True)
class Finding:
    """The result of comparing the submissions to one exercise."""

    assignment: str
    programs: int  # how many were compared
    pairs: list[Pair]  # the most alike first
    scores: list[float]  # of all pairs, rising
    left_out: list[str]  # students without a Python file that can be read and is not too long
    too_long: list[str] = field(default_factory=list)  # other students, each with the files that are too long
    groups: list[Group] = field(default_factory=list)  # of all pairs, the largest first
    hidden: list[str] = field(default_factory=list)  # students, each with the files that do not show what they do
    doubtful: list[str] = field(default_factory=list)  # students, each with further files that may not show all
    replaced: list[str] = field(default_factory=list)  # students whose files are not the graded ones

    @property
    def title(self) -> str:
        """The exercise, as students know it."""
        return exercises.load(self.assignment).title

    def below(self, percent: float) -> float:
        """Return the score below which `percent` of all pairs lie."""
        return self.scores[min(len(self.scores) - 1, int(len(self.scores) * percent / 100))] if self.scores else 0.0


def compare(
    assignment: str,
    handed_in: Iterable[tuple[str, dict[str, str]]],
    known: Iterable[str],
    top: int,
    earlier: Iterable[tuple[str, dict[str, str]]] = (),
    replaced: Iterable[str] = (),
) -> Finding:
    """Compare every submission with every other, and lay the `top` most alike pairs side by side, identical ones first.

    `handed_in` has the texts of each student, by file; code in the texts `known` to all is not compared.  Texts of
    `earlier` courses are compared with these, but not with each other.  `replaced` are the students whose files are not
    those that were graded, which the finding names.
    """
    boilerplate = {gram for text in known for gram in _known(text)}
    too_long: dict[str, list[str]] = {}  # files, by student

    def read(student: str, texts: dict[str, str]) -> Program:
        long = [name for name, text in texts.items() if is_longer(text, LONGEST)]
        too_long.update({student: long} if long else {})
        try:
            return program(student, {name: text for name, text in texts.items() if name not in long}, boilerplate)
        except UNREADABLE:  # whatever is wrong with it, the others are compared
            return Program(student, {}, {}, {}, [], [])

    every = [read(student, texts) for student, texts in handed_in]
    old = [one for one in (read(student, texts) for student, texts in earlier) if one.texts]
    new = [one for one in every if one.texts]
    programs = [*new, *old]
    owners: dict[int, list[int]] = defaultdict(list)  # numbers of the programs that have a fingerprint
    for number, one in enumerate(programs):
        for gram in one.prints:
            owners[gram].append(number)
    scores, shared = _scores(programs, owners)
    large = np.array([len(one.prints) >= ENOUGH for one in programs], dtype=bool)
    alike = np.where((shared >= COMMON) & np.logical_and.outer(large, large), np.maximum(scores, shared), scores)
    left_of, right_of = np.triu_indices(len(programs), 1)
    above = left_of[left_of < len(new)], right_of[left_of < len(new)]  # at least one of each pair is new
    same = _identical(programs, boilerplate)
    ranking = np.lexsort((-scores[above], -same[above]))[:top]  # by the last key first
    order = [place for place in ranking if scores[above][place] >= LEAST or same[above][place]]
    counts = {gram: len(those) for gram, those in owners.items()}
    pairs = []
    for left, right in zip(above[0][order], above[1][order], strict=True):
        one, other = programs[left], programs[right]
        pairs.append(
            Pair(
                one.student,
                other.student,
                float(scores[left, right]),
                float(shared[left, right]),
                [name for name in one.texts if one.texts[name] == other.texts.get(name)],
                side_by_side(one, other, counts, len(programs)),
            )
        )
    left_out = [one.student for one in every if not one.texts]
    long = [f"{student} ({', '.join(files)})" for student, files in too_long.items() if student not in left_out]
    groups = _groups(programs, alike, above[0], above[1], (alike[above] >= STRIKING) | (same[above] > 0))
    hidden = [f"{one.student} ({', '.join(one.hidden)})" for one in new if one.hidden]
    doubtful = [f"{one.student} ({', '.join(one.doubtful)})" for one in new if one.doubtful]
    rising = sorted(map(float, scores[above]))
    return Finding(assignment, len(programs), pairs, rising, left_out, long, groups, hidden, doubtful, [*replaced])


@cache
def _known(text: str) -> frozenset[int]:
    """The grams of a text that everybody was given, which is the same for each comparison of an exercise."""
    return frozenset(grams(tokens(text)))


def _groups(
    programs: list[Program],
    alike: NDArray[np.floating],
    left_of: NDArray[np.intp],
    right_of: NDArray[np.intp],
    striking: NDArray[np.bool_],
) -> list[Group]:
    """Return the groups that the `striking` ones of the pairs connect."""
    group_of = {number: {number} for number in range(len(programs))}
    pairs = [(int(left), int(right)) for left, right in zip(left_of[striking], right_of[striking], strict=True)]
    for left, right in pairs:
        if group_of[left] is not group_of[right]:
            group_of[left] |= group_of[right]
            group_of.update(dict.fromkeys(group_of[right], group_of[left]))
    scores_of: dict[int, list[float]] = defaultdict(list)  # by the group's first member
    for left, right in pairs:
        scores_of[min(group_of[left])].append(float(alike[left, right]))
    groups = []
    for first, found in scores_of.items():
        members = [programs[number] for number in sorted(group_of[first])]
        owners = Counter(file for member in members for file in member.texts.items())
        identical = [name for (name, _), count in owners.items() if count == len(members)]
        partly = {name: 0 for (name, _), count in owners.items() if count > 1 and name not in identical}
        students = [member.student for member in members]
        groups.append(Group(students, len(found), max(found), identical, [*partly]))
    return sorted(groups, key=lambda group: (-len(group.students), not group.identical, -group.highest))


def _identical(programs: list[Program], boilerplate: set[int]) -> NDArray[np.floating]:
    """Return the number of identical files of each two programs, shape (programs, programs).

    Files that students were given do not count.
    """
    owners: dict[tuple[str, str], list[int]] = defaultdict(list)
    for number, one in enumerate(programs):
        for name, text in one.texts.items():
            owners[name, text].append(number)
    same = np.zeros((len(programs), len(programs)), dtype=np.float32)
    for (_, text), those in owners.items():
        if len(those) > 1 and not boilerplate.issuperset(grams(tokens(text))):
            same[np.ix_(those, those)] += 1
    return same


def _scores(programs: list[Program], owners: dict[int, list[int]]) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Return the score and the shared part of each two programs, both 0 to 100, shape (programs, programs)."""
    weight = np.zeros((len(programs), len(programs)), dtype=np.float32)
    count = np.zeros_like(weight)
    for those in owners.values():
        if len(those) > 1:
            block = np.ix_(those, those)
            weight[block] += _rarity(len(those), len(programs))
            count[block] += 1
    sizes = np.array([len(one.prints) for one in programs], dtype=np.float32)
    shorter = np.minimum.outer(sizes, sizes)
    return 100 * weight / np.maximum(shorter, ENOUGH), 100 * count / np.maximum(shorter, 1)


def _rarity(owners: int, programs: int) -> float:
    """Return a fingerprint's weight: 1 if only two programs have it, less if more do, little if all do."""
    return math.log((programs + 1) / owners) / math.log((programs + 1) / 2)
