"""The tests that guard each sentence of a task: `python -m tests.hidden.sentences [EXERCISE]...` prints the table.

`sentences/EXERCISE.toml` has an entry for each sentence, list item and table row of the exercise's task, in the order
of the notebook, word for word:

    [[sentence]]
    text = "`success` is `False` for the one request that is refused, and `True` for all others."
    test = "refusal"                                          # the hidden test, without "test_"; or a list of tests
    wrong = ["refuses nothing", "success only with a change"]   # for each test at least two that lose it alone
    together = true   # perhaps: the tests judge the sentence in several settings, so a mistake may lose several

    [[sentence]]
    text = "You hand in two files."
    why = "no claim: how to hand in"                          # instead of test and wrong

What `why` begins with:

- `no claim`: the sentence does not say what an answer must do;
- `told elsewhere`: another sentence of the table says the same;
- `judged by hand`: a person reads and marks it;
- `every test`: without it a program does nothing useful. Such an entry has `wrong`, too.

The task is the text of the notebook's Markdown cells below each heading with "Your turn", up to the next heading of the
same or a higher level, without what is folded below "Hint", "Answer" and "How it is marked"; and the docstrings and
comments that the student finds in the cells `%%exercise`, outside of the solution.
"""

import argparse
import ast
import io
import re
import statistics
import sys
import textwrap
import tokenize
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from autograder.submissions import exercises
from course.foundation import cells

from . import answers

FOLDER = Path(__file__).with_name("sentences")
NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
TASK = "Your turn"
WHY = ("no claim", "told elsewhere", "judged by hand", "every test")
LEAST = 2  # wrong answers for each test that judges a sentence

UNJUDGED = re.compile(r"^<details><summary>(?:Hint|Answer|How it is marked).*?^</details>", re.MULTILINE | re.DOTALL)
FOLD = re.compile(r"^<details><summary>.*?</summary>$|^</details>$", re.MULTILINE)
HEADING = re.compile(r"(#+) +(.*)")
ITEM = re.compile(r"\s*(?:[-*]|\d+\.) +(.*)")
# The end of a sentence, and the beginning of the next one.
END = re.compile(r"""(?<=[.!?])(?<!e\.g\.)(?<!i\.e\.)([)*"'_]*) +(?=[A-Z0-9`"'(*$\[_{-])""")
STUBBED = re.compile(r"^([ \t]*)### BEGIN SOLUTION[ \t]*\n.*?^[ \t]*### END SOLUTION[ \t]*$", re.MULTILINE | re.DOTALL)
MAGIC = re.compile(r"%%exercise +(\S+)")


@dataclass(frozen=True)
class Sentence:
    """An entry of the table."""

    text: str
    tests: tuple[str, ...] = ()  # without "test_"
    wrong: tuple[str, ...] = ()
    why: str = ""
    together: bool = False  # whether a wrong answer may lose several of the tests, and no others


def names() -> list[str]:
    """The exercises that have a table."""
    return sorted(file.stem for file in FOLDER.glob("*.toml"))


def table(exercise: str) -> list[Sentence]:
    """Return what is written down of the sentences of its task."""
    entries = tomllib.loads((FOLDER / f"{exercise}.toml").read_text(encoding="utf-8"))["sentence"]
    return [_entry(exercise, entry) for entry in entries]


def task(exercise: str) -> list[str]:
    """The sentences of its task, as the notebook has them."""
    found, level = [], 0  # level: of the heading "Your turn" that the text is below, or 0
    for cell in cells.read(NOTEBOOKS / exercise / f"{exercise}.ipynb"):
        if cell.kind == "markdown" and not cell.solution:
            for line in _blocks(FOLD.sub("", UNJUDGED.sub("", cell.source))):
                if heading := HEADING.fullmatch(line):
                    depth = len(heading[1])
                    if TASK in heading[2]:
                        level = depth
                    elif depth <= level:
                        level = 0
                elif level:
                    found += _sentences(line)
        elif cell.kind == "code" and cell.solution and (name := MAGIC.match(cell.source)) and name[1].endswith(".py"):
            found += _of_stub(cell.source.partition("\n")[2])
    return found


def faults(exercise: str) -> list[str]:
    """Return what is wrong with its table, in words for its author; empty when nothing is."""
    wrong, known = answers.load(exercise).WRONG, {_short(test.id) for test in exercises.load(exercise).tests}
    entries, found = table(exercise), []
    written, told = [entry.text for entry in entries], task(exercise)
    found += [f"in the task, and not in the table: {text}" for text in told if text not in written]
    found += [f"in the table, and not in the task: {text}" for text in written if text not in told]
    if not found and written != told:
        found.append("the sentences of the table are not in the order of the task, or one is there too often")
    for entry in entries:
        missing = [name for name in entry.wrong if name not in wrong]
        if missing:
            found.append(f"{entry.text}: no wrong answer is called {', '.join(missing)}")
        elif entry.why:
            found += _faults_without_test(entry, wrong)
        else:
            found += _faults_of_tests(entry, wrong, known)
    return found


def _faults_without_test(entry: Sentence, wrong: dict[str, tuple[dict[str, bytes], set[str]]]) -> Iterator[str]:
    kind = entry.why.partition(":")[0]
    if kind not in WHY or not entry.why.partition(":")[2].strip():
        yield f"{entry.text}: why is {entry.why!r}; it must begin with one of {', '.join(WHY)}, and a colon"
    if entry.tests or (entry.wrong and kind != "every test"):
        yield f"{entry.text}: has both a test and why there is none"
    if kind == "every test" and sum(len(wrong[name][1]) > LEAST for name in entry.wrong) < LEAST:
        yield f"{entry.text}: needs {LEAST} wrong answers that lose most tests"


def _faults_of_tests(
    entry: Sentence, wrong: dict[str, tuple[dict[str, bytes], set[str]]], known: set[str]
) -> Iterator[str]:
    if not entry.tests:
        yield f"{entry.text}: has no test, and does not say why"
    for test in entry.tests:
        if test not in known:
            yield f"{entry.text}: there is no test {test}"
        if sum(test in wrong[name][1] and _guards(entry, wrong[name][1]) for name in entry.wrong) < LEAST:
            yield f"{entry.text}: needs {LEAST} wrong answers that lose {test} and nothing else"
    for name in entry.wrong:
        if not _guards(entry, wrong[name][1]):
            yield f"{entry.text}: '{name}' loses {', '.join(sorted(wrong[name][1])) or 'nothing'}"


def _guards(entry: Sentence, lost: set[str]) -> bool:
    """Return True if a wrong answer that loses these tests is caught by one test of the entry, and no other."""
    return bool(lost) and (lost <= {*entry.tests} if entry.together else lost in [{test} for test in entry.tests])


def _entry(exercise: str, entry: dict) -> Sentence:
    if unknown := set(entry) - {"text", "test", "wrong", "why", "together"}:
        raise ValueError(f"{exercise}.toml: a sentence has {', '.join(sorted(unknown))}: {entry}")
    tests = entry.get("test", [])
    return Sentence(
        entry["text"],
        (tests,) if isinstance(tests, str) else tuple(tests),
        tuple(entry.get("wrong", ())),
        entry.get("why", ""),
        entry.get("together", False),
    )


def _short(test: str) -> str:
    return test.removeprefix("test_")


def _blocks(text: str) -> Iterator[str]:
    """The headings, list items, table rows, paragraphs and lines of code boxes of a Markdown text, one line each."""
    block: list[str] = []  # the lines of the paragraph or list item so far
    lines = text.splitlines()
    fence = ""
    for number, line in enumerate(lines):
        begins = line.startswith(("#", "|", "```")) or ITEM.fullmatch(line)
        if block and (begins or fence or not line.strip()):
            yield " ".join(block)
            block = []
        if line.startswith("```"):
            fence = "" if fence else line
        elif fence:
            if not fence.endswith("mermaid") and re.search(r"\w", line):
                yield " ".join(line.split())
        elif line.startswith("|"):
            following = lines[number + 1] if number + 1 < len(lines) else ""
            if not _is_rule(line) and not _is_rule(following):  # a row, not the head
                yield " ".join(line.split())
        elif line.startswith("#"):
            yield line.strip()
        elif line.strip():
            item = ITEM.fullmatch(line)
            block.append((item[1] if item else line).strip())
    if block:
        yield " ".join(block)


def _is_rule(line: str) -> bool:
    """Return True if it is the line between the head of a table and its rows."""
    return bool(re.fullmatch(r"\|[-:| ]+\|", line.strip()))


def _sentences(block: str) -> list[str]:
    """The sentences of a block; a row of a table is one."""
    return [block] if block.startswith("|") else END.sub(r"\1\n", block).splitlines()


def _of_stub(source: str) -> Iterator[str]:
    """The sentences of the docstrings and comments of a program, as the student finds it."""
    stub = STUBBED.sub(r"\1pass", source)
    found = []
    for part in ast.walk(ast.parse(stub)):
        if isinstance(part, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            words = part.body[0] if part.body else None
            if isinstance(words, ast.Expr) and isinstance(words.value, ast.Constant):
                found.append((words.lineno, str(words.value.value)))
    for token in tokenize.generate_tokens(io.StringIO(stub).readline):
        if token.type == tokenize.COMMENT:
            found.append((token.start[0], token.string.lstrip("# ")))
    for _, words in sorted(found):
        for paragraph in re.split(r"\n\s*\n", textwrap.dedent(words)):
            yield from _sentences(" ".join(paragraph.split()))


@dataclass(frozen=True)
class Losses:
    """The points that answers with exactly one mistake lose."""

    median: float
    most: float


def points(exercise: str) -> dict[str, float]:
    """The points of each hidden test, by its name without "test_"."""
    return {_short(test.id): test.points for test in exercises.load(exercise).tests}


def lost(exercise: str) -> dict[str, float]:
    """The points that each wrong answer is expected to lose."""
    worth = points(exercise)
    return {name: sum(worth[test] for test in tests) for name, (_, tests) in answers.load(exercise).WRONG.items()}


def losses(exercise: str, lost: dict[str, float]) -> Losses | None:
    """Return what those of the answers lose that have exactly one mistake; None when there are none."""
    several = answers.named(exercise, "NOTHING") | answers.named(exercise, "SEVERAL")
    single = [points for name, points in lost.items() if name not in several]
    return Losses(statistics.median(single), max(single)) if single else None


def show(exercise: str, console: Console) -> None:
    """Print the table of one exercise."""
    wrong = answers.load(exercise).WRONG
    grid = Table(
        "sentence", "hidden test", "wrong answers that this test alone catches", title=exercise, show_lines=True
    )
    for entry in table(exercise):
        others = [
            f"{sum(tests == {test} for _, tests in wrong.values())} in all for {test}"
            for test in (entry.tests if len(entry.tests) > 1 else ())
        ]
        grid.add_row(
            escape(entry.text),
            escape(", ".join(entry.tests) or f"({entry.why})"),
            escape("\n".join([*entry.wrong, *others])),
        )
    console.print(grid)
    entries = table(exercise)
    judged = [entry for entry in entries if entry.tests]
    guards = {name for entry in entries for name in entry.wrong}
    console.print(
        f"{exercise}: {len(entries)} sentences, {len(judged)} with a hidden test of their own, "
        f"{len(guards)} wrong answers named"
    )
    for fault in faults(exercise):
        console.print(f"[red]{escape(fault)}[/red]")


def main() -> int:
    """Print the table of each exercise that is asked for; 1 when something is wrong with one."""
    parser = argparse.ArgumentParser(prog="python -m tests.hidden.sentences", description=__doc__.partition("\n")[0])
    parser.add_argument("exercise", nargs="*", help=f"of {', '.join(names())}; by default all")
    parser.add_argument("--task", action="store_true", help="print the sentences of the task, as TOML to begin with")
    options = parser.parse_args()
    known = answers.names() if options.task else names()
    if unknown := set(options.exercise) - {*known}:
        parser.error(f"no table for {', '.join(sorted(unknown))}; there are those for {', '.join(known)}")
    chosen = options.exercise or known
    if options.task:
        for exercise in chosen:
            print("\n".join(_as_toml(task(exercise))))
        return 0
    console = Console()
    for exercise in chosen:
        show(exercise, console)
    return 1 if any(faults(exercise) for exercise in chosen) else 0


def _as_toml(texts: Iterable[str]) -> Iterator[str]:
    for text in texts:
        quoted = f"'{text}'" if "'" not in text else "'''" + text + "'''" if not text.endswith("'") else repr(text)
        yield f'[[sentence]]\ntext = {quoted}\ntest = ""\nwrong = ["", ""]\n'


if __name__ == "__main__":
    sys.exit(main())
