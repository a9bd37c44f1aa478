"""`autograder similar`: pairs of submissions that are more alike than the exercise makes them.

Each program is reduced to what stays when it is disguised: Python's own tokens without names, values, comments,
docstrings and layout.  Of every K tokens in a row a hash is made, and of every WINDOW such hashes the smallest is a
fingerprint (Schleimer, Wilkerson, Aiken: Winnowing, SIGMOD 2003), so that two programs with a run of K + WINDOW - 1
tokens in common share one, wherever it stands.  What every student was given - the notebooks' stubs and examples, the
chapter's nodes - leaves no fingerprints.

Right answers to a short exercise are alike by nature.  So a shared fingerprint counts the more the fewer submissions
have it, and the score of a pair is the share of the shorter program that is found in the other and hardly elsewhere.
It is a reason to look at the two, not a verdict.

Written here rather than taken from copydetect (MIT, 0.5.0 of 2024, the same algorithm): it reads files by path, follows
links, compares each pair in turn, counts what all share like what two share, and its page loads scripts from elsewhere.
"""

import io
import keyword
import math
import re
import statistics
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from hashlib import blake2b
from itertools import groupby
from pathlib import Path

import numpy as np

from autograder.errors import UsageError
from autograder.paths import COURSE, repository
from autograder.results import output, storage
from autograder.results.feedback import template
from autograder.submissions import exercises, listing, reading
from course.notebook import cells
from course.notebook.cells import SOLUTION

K = 12  # tokens in a row that are hashed together
WINDOW = 5  # hashes of which one is kept
ENOUGH = 10  # fingerprints: a shorter program counts as if it had as many, for it shows little
MAX_RESTARTS = 100  # after what Python cannot read in a file
MAX_PLACES = 20  # that are shown of one fingerprint in a submission: a million equal lines must not take hours
COMMAND = re.compile(r"^[%!].*$", re.MULTILINE)  # Jupyter's, not Python's


@dataclass(frozen=True)
class Token:
    """A token of a program, reduced, and where it stands in the text."""

    kind: str
    start: int
    end: int


@dataclass(frozen=True)
class Program:
    """What one student handed in for an exercise: its Python files."""

    student: str
    texts: dict[str, str]
    tokens: dict[str, list[Token]]
    prints: dict[int, list[tuple[str, int]]]  # for each fingerprint the places, as file and number of the token


@dataclass(frozen=True)
class Piece:
    """A part of a text; number 0 is not alike, the others are, each with the part of that number opposite."""

    text: str
    number: int
    common: bool = False  # many other submissions have it as well
    first: bool = False  # of its number in this text: what a link leads to


@dataclass(frozen=True)
class Pair:
    """Two submissions that are alike."""

    left: str
    right: str
    score: float  # 0 to 100: the share of the shorter one that is in the other, and hardly elsewhere
    shared: float  # 0 to 100: the same, wherever else it is
    identical: list[str]  # files that are the same to the byte
    files: list[tuple[str, list[Piece], list[Piece]]] = field(default_factory=list)


@dataclass(frozen=True)
class Finding:
    """All about one exercise."""

    assignment: str
    programs: int
    pairs: list[Pair]  # the most alike first
    scores: list[float]  # of all pairs, rising
    left_out: list[str]  # students who handed in no Python file that can be read

    @property
    def title(self) -> str:
        """The exercise, as students know it."""
        return exercises.load(self.assignment).title

    def below(self, percent: float) -> float:
        """The score that so many of all pairs do not pass."""
        return self.scores[min(len(self.scores) - 1, int(len(self.scores) * percent / 100))] if self.scores else 0.0


def find(folder: Path, assignment: str | None, top: int) -> list[Finding]:
    """The pairs of submissions that are most alike, by exercise; raises UsageError.

    The folder is what `autograder grade` was given, or its output, which says for each result where the files are.
    """
    handed_in = defaultdict(list)
    for (student, name), submitted in sorted(_places(folder, assignment).items()):
        handed_in[name].append((student, submitted))
    return [
        compare(
            name,
            [(student, files(submitted, student, name)) for student, submitted in places],
            given(name, {submitted for _, submitted in places}),
            top,
        )
        for name, places in handed_in.items()
    ]


def _places(folder: Path, assignment: str | None) -> dict[tuple[str, str], Path]:
    """For each student and assignment the folder of submissions."""
    if not (folder / output.RESULTS).exists():
        return dict.fromkeys(listing.find(folder, assignment, []), folder)
    wanted = assignment and exercises.load(assignment).name
    try:
        origins = output.origins(folder)
    except UsageError as error:
        raise UsageError(f"{error}: give their folder instead") from None
    places = {key: Path(origin.submitted) for key, origin in origins.items() if wanted in (None, key[1])}
    if not places:
        raise UsageError(f"{folder} does not tell where the submissions are: give their folder instead")
    return places


def files(submitted: Path, student: str, assignment: str) -> dict[str, str]:
    """The Python files of a submission that can be read, also when others are missing."""
    found = {}
    if not (submitted / student).is_symlink():
        for name in exercises.load(assignment).files:
            if name.endswith(".py"):
                read = reading.read(submitted / student / assignment, student, assignment, [name]).files
                found.update({name: _clean(text.decode(errors="replace")) for name, text in read.items()})
    return found


def given(assignment: str, courses: Iterable[Path] = ()) -> list[str]:
    """The programs that students were given: what the notebooks show, and the chapter's nodes."""
    books = [*(repository() / "notebooks").glob("*/*.ipynb")]
    for submitted in courses:  # the course that it lies in may have changed the notebook
        books.append(submitted.resolve().parent / "release" / assignment / f"{assignment}.ipynb")
    texts = [path.read_text(encoding="utf-8") for path in sorted((COURSE / "nodes").glob("*.py"))]
    for path in books:
        if path.exists():
            texts += [
                COMMAND.sub("", SOLUTION.sub("", cell.source)) for cell in cells.read(path) if cell.kind == "code"
            ]
    return texts


def compare(
    assignment: str, handed_in: Iterable[tuple[str, dict[str, str]]], known: Iterable[str], top: int
) -> Finding:
    """Compare every submission with every other, and take the `top` pairs apart for showing."""
    boilerplate = {gram for text in known for gram in _grams(tokens(text))}
    every = [_program(student, texts, boilerplate) for student, texts in handed_in]
    programs = [program for program in every if program.texts]
    owners = defaultdict(list)
    for number, program in enumerate(programs):
        for gram in program.prints:
            owners[gram].append(number)
    weigh = np.zeros((len(programs),) * 2, dtype=np.float32)
    count = np.zeros_like(weigh)
    for those in owners.values():
        if len(those) > 1:
            block = np.ix_(those, those)
            weigh[block] += _rarity(len(those), len(programs))
            count[block] += 1
    sizes = np.array([len(program.prints) for program in programs], dtype=np.float32)
    shorter = np.minimum.outer(sizes, sizes)
    scores = 100 * weigh / np.maximum(shorter, ENOUGH)
    shared = 100 * count / np.maximum(shorter, 1)
    above = np.triu_indices(len(programs), 1)
    order = [place for place in np.argsort(-scores[above], kind="stable")[:top] if scores[above][place] >= 1]
    pairs = []
    for left, right in zip(above[0][order], above[1][order], strict=True):
        one, other = programs[left], programs[right]
        same = [name for name in one.texts if one.texts[name] == other.texts.get(name)]
        pairs.append(
            Pair(
                one.student,
                other.student,
                float(scores[left, right]),
                float(shared[left, right]),
                same,
                _side_by_side(one, other, {gram: len(those) for gram, those in owners.items()}, len(programs)),
            )
        )
    return Finding(
        assignment,
        len(programs),
        pairs,
        sorted(map(float, scores[above])),
        [program.student for program in every if not program.texts],
    )


def tokens(text: str) -> list[Token]:
    """The tokens of a Python text without what a copier changes at no cost; what is no Python is passed over."""
    starts = [0]
    for line in text.split("\n"):
        starts.append(starts[-1] + len(line) + 1)
    found: list[Token] = []
    statement: list[Token] = []
    nested = 0  # in f-strings, which are several tokens from Python 3.12 on
    for kind, string, first, last in _raw(text):
        where = starts[first[0] - 1] + first[1], starts[last[0] - 1] + last[1]
        name = tokenize.tok_name[kind]
        nested += (name == "FSTRING_START") - (name == "FSTRING_END")
        if name in ("STRING", "FSTRING_END") or nested:
            if statement and statement[-1].kind == "s":  # 'a' 'b' is one string
                where = statement.pop().start, where[1]
            statement.append(Token("s", *where))
        elif kind == tokenize.NEWLINE or string == ";":
            if any(token.kind != "s" for token in statement):  # a string alone is a docstring
                # `if a: return` is one line or two.
                found += statement if statement[-1].kind == ":" else [*statement, Token("\n", *where)]
            statement = []
        elif kind == tokenize.NAME:
            statement.append(Token(string if keyword.iskeyword(string) else "n", *where))
        elif kind == tokenize.NUMBER:
            statement.append(Token("0", *where))
        elif kind == tokenize.OP:
            statement.append(Token(string, *where))
    return found + statement


def _raw(text: str) -> Iterator[tuple[int, str, tuple[int, int], tuple[int, int]]]:
    """Python's tokens; after an error from the next line on."""
    lines = text.split("\n")
    begin = 0  # lines done
    for _ in range(MAX_RESTARTS):
        reached = 0
        try:
            for token in tokenize.generate_tokens(io.StringIO("\n".join(lines[begin:]) + "\n").readline):
                reached = token.end[0]
                if token.end[0] + begin <= len(lines):
                    yield (
                        token.type,
                        token.string,
                        (token.start[0] + begin, token.start[1]),
                        (token.end[0] + begin, token.end[1]),
                    )
            return
        except (tokenize.TokenError, SyntaxError):
            begin += max(1, reached)
        if begin >= len(lines):
            return


def _grams(found: list[Token]) -> list[int]:
    kinds = [token.kind.encode() for token in found]
    return [
        int.from_bytes(blake2b(b" ".join(kinds[i : i + K]), digest_size=8).digest()) for i in range(len(kinds) - K + 1)
    ]


def winnow(grams: list[int], boilerplate: set[int]) -> list[int]:
    """The places of the fingerprints: in each window the smallest hash, of equal ones the last, but no boilerplate."""
    places = set()
    for begin in range(max(1, len(grams) - WINDOW + 1)):
        window = [
            (gram, -place) for place, gram in enumerate(grams[begin : begin + WINDOW], begin) if gram not in boilerplate
        ]
        if window:
            places.add(-min(window)[1])
    return sorted(places)


def _program(student: str, texts: dict[str, str], boilerplate: set[int]) -> Program:
    found = {name: tokens(text) for name, text in texts.items()}
    prints = defaultdict(list)
    for name, these in found.items():
        grams = _grams(these)
        for place in winnow(grams, boilerplate):
            if len(prints[grams[place]]) < MAX_PLACES:
                prints[grams[place]].append((name, place))
    return Program(student, texts, found, dict(prints))


def _rarity(owners: int, programs: int) -> float:
    """How much a fingerprint counts: 1 when only two have it, less the more there are, little when all have it."""
    return math.log((programs + 1) / owners) / math.log((programs + 1) / 2)


def _side_by_side(
    one: Program, other: Program, owners: dict[int, int], programs: int
) -> list[tuple[str, list[Piece], list[Piece]]]:
    """The texts of a pair, file by file, with the passages that are alike numbered, longest first."""
    marks = [{name: [0] * len(found) for name, found in program.tokens.items()} for program in (one, other)]
    common = {0: False}
    for passage in sorted(_passages(one, other), key=len, reverse=True):
        opposite = marks[1][passage[0][2]][passage[0][3] : passage[-1][3] + K]
        taken, times = Counter(opposite).most_common(1)[0]
        number = taken if taken and times > len(opposite) / 2 else len(common)
        if number not in common:
            common[number] = statistics.median(owners[step[4]] for step in passage) > max(3, programs / 4)
        for side, name, begin, end in (
            (0, passage[0][0], passage[0][1], passage[-1][1] + K),
            (1, passage[0][2], passage[0][3], passage[-1][3] + K),
        ):
            these = marks[side][name]
            these[begin:end] = [old or number for old in these[begin:end]]
    names = {**one.texts, **other.texts}
    shown: set[tuple[int, int]] = set()
    return [
        (
            name,
            *(
                list(
                    _pieces(
                        program.texts.get(name, ""),
                        program.tokens.get(name, []),
                        marks[side].get(name, []),
                        common,
                        side,
                        shown,
                    )
                )
                for side, program in enumerate((one, other))
            ),
        )
        for name in names
    ]


def _passages(one: Program, other: Program) -> Iterator[list[tuple[str, int, str, int, int]]]:
    """Runs of shared fingerprints that go on in step: for each its file and place here and there, and itself."""
    steps = sorted((*here, gram) for gram, places in one.prints.items() if gram in other.prints for here in places)
    passage: list[tuple[str, int, str, int, int]] = []
    for name, place, gram in steps:
        nexts = other.prints[gram]
        if passage:
            last = passage[-1]
            gap = place - last[1]
            going_on = [there for there in nexts if there[0] == last[2] and 0 < there[1] - last[3] <= K + WINDOW]
            if name == last[0] and gap <= K + WINDOW and going_on:
                passage.append((name, place, *min(going_on), gram))
                continue
            yield passage
        passage = [(name, place, *nexts[0], gram)]
    if passage:
        yield passage


def _pieces(
    text: str, found: list[Token], marks: list[int], common: dict[int, bool], side: int, shown: set[tuple[int, int]]
) -> Iterator[Piece]:
    """The text cut where the marks of its tokens change."""
    done = 0
    for number, group in groupby(zip(found, marks, strict=True), key=lambda each: each[1]):
        group = [token for token, _ in group]
        begin, end = group[0].start, group[-1].end
        end -= len(text[begin:end]) - len(text[begin:end].rstrip())
        begin += len(text[begin:end]) - len(text[begin:end].lstrip())
        if number and begin < end:
            yield Piece(text[done:begin], 0)
            yield Piece(text[begin:end], number, common[number], (side, number) not in shown)
            shown.add((side, number))
            done = end
    yield Piece(text[done:], 0)


def describe(finding: Finding) -> str:
    """The pairs for a person at a terminal."""
    head = f"{finding.assignment}: {finding.programs} submissions, {len(finding.scores)} pairs"
    if finding.scores:
        head += f"; half score at most {finding.below(50):.0f}, 95 of 100 at most {finding.below(95):.0f}"
    lines = [head]
    for pair in finding.pairs:
        same = f", the same to the letter: {', '.join(pair.identical)}" if pair.identical else ""
        lines.append(f"{pair.score:4.0f}  {pair.left} and {pair.right} ({pair.shared:.0f} % in common{same})")
    if finding.left_out:
        lines.append(f"      not compared, for want of a program that can be read: {', '.join(finding.left_out)}")
    return "\n".join(lines)


def page(findings: Iterable[Finding]) -> str:
    """The pairs side by side, as an HTML page that stands alone.  Everything in it is escaped."""
    return template("similar.html").render(findings=list(findings), number=lambda value: f"{value:.0f}")


def write(findings: Iterable[Finding], target: Path) -> None:
    """Write the page, for the instructor alone."""
    storage.replace(target, page(findings).encode(errors="replace"), storage.PRIVATE)


def _clean(text: str) -> str:
    """With Python's line ends, and without what its tokenizer stops at."""
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n").replace("\0", "\ufffd")
