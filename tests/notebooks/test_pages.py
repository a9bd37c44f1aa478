"""The shape of the sections' pages, so that a reader finds the same things in the same places; and their links."""

import itertools
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from course.foundation import cells
from course.foundation.cells import Cell

ROOT = Path(__file__).parents[2]
START = ROOT / "notebooks/index.ipynb"
SECTIONS = sorted(ROOT.glob("notebooks/[!.]*/*.ipynb"))
PAGES = [START, *SECTIONS, *sorted(ROOT.glob("*.md")), *sorted(ROOT.glob("docs/**/*.md"))]
WORDS = 1600  # of a section, without its exercises and folded answers
FOLDED = re.compile(r"<details>.*?</details>", re.DOTALL)
FLAGS = re.MULTILINE | re.DOTALL
FENCED = re.compile(r"^```.*?^```", FLAGS)
ANSWER = "<details><summary>Answer</summary>\n\n"
PREDICT = "**Predict**:"
HINTS = [f"<details><summary>Hint {hint}</summary>\n\n" for hint in ("1: where to look", "2: the idea",
                                                                    "3: almost the code")]  # fmt: skip
OFFICIAL = re.compile(
    r"https://(docs\.ros\.org/en/jazzy/|design\.ros2\.org/|(www\.)?ros\.org/reps/|reps\.openrobotics)"
)
LINK = re.compile(r"\]\(([^)\s]+)\)|(https?://[^\s)\"'`>]+)")

sections = pytest.mark.parametrize("path", SECTIONS, ids=lambda path: path.stem)


def texts(path: Path) -> list[str]:
    """The page's Markdown cells, without code that is shown in them."""
    return [FENCED.sub("", cell.source) for cell in cells.read(path) if cell.kind == "markdown"]


def parts(path: Path) -> list[tuple[int, str, str]]:
    """The page's headings, each with its level and the text up to the next one."""
    pieces = re.split(r"^(#+) +(.*)$", "\n".join(texts(path)), flags=re.MULTILINE)[1:]
    return [(len(level), title, text) for level, title, text in zip(*[iter(pieces)] * 3, strict=True)]


def part(path: Path, title: str) -> str:
    found = [text for _, heading, text in parts(path) if heading == title]
    assert len(found) == 1, f"the heading '{title}' is there {len(found)} times"
    return found[0]


def items(text: str) -> list[str]:
    return re.findall(r"^(?:[-*]|\d+\.) +\S.*", text, re.MULTILINE)


def test_the_start_page_shows_the_progress_in_a_fresh_kernel(tmp_path, monkeypatch):
    (source,) = (cell.source for cell in cells.read(START) if "course.progress()" in cell.source and cell.kind == "code")
    monkeypatch.chdir(tmp_path)
    exec(source, {})


@sections
def test_the_beginning_says_what_it_needs_how_long_it_takes_and_what_for(path):
    first = cells.read(path)[0].source
    assert first.startswith("# ")
    assert "**You need**" in first
    assert re.search(r"\*\*Time\*\*:? [^\n]*\d+[^\n]* minutes", first)
    after = first.partition("**After it you can**")[2]
    assert len(items(after)) >= 3


def told_after(known: list[Cell], at: int) -> str:
    """The Markdown below the code that comes after cell `at`."""
    below = itertools.dropwhile(lambda cell: cell.kind != "code", known[at + 1 :])
    below = itertools.dropwhile(lambda cell: cell.kind == "code", below)
    return next((cell.source for cell in below), "")


@sections
def test_a_prediction_comes_before_the_code_and_its_answer_after_it(path):
    known = cells.read(path)
    asked = [at for at, cell in enumerate(known) if cell.kind == "markdown" and PREDICT in cell.source]
    assert len(asked) >= 2
    for at in asked:
        question = known[at].source.rpartition(PREDICT)[2].strip()
        if ANSWER in question:  # about what is to be read there
            continue
        assert known[at + 1].kind == "code", f"no code comes after: {question}"
        assert told_after(known, at).startswith(ANSWER), f"no folded answer begins the text after: {question}"


@sections
def test_there_are_things_to_change_and_see(path):
    assert sum(text.count("**Change this and see**") for text in texts(path)) >= 2


@sections
def test_an_exercise_has_numbered_steps_and_hints_in_three_grades(path):
    own = "".join(f"\n{title}\n{text}" for _, title, text in within(path, exercise=True))
    steps = (r"^1\. .*?^2\. .*?^3\. ", r"^Your turn, step 1: .*?^Your turn, step 2: .*?^Your turn, step 3: ")
    assert any(re.search(each, own, re.MULTILINE | re.DOTALL) for each in steps), "there are no numbered steps"
    found = re.findall("|".join(map(re.escape, HINTS)), own)
    assert found and found == HINTS * (len(found) // 3)


def within(path: Path, *, exercise: bool) -> list[tuple[int, str, str]]:
    """The parts that belong to an exercise, `Your turn` or a small one before it and what is below, or the others."""
    chosen, level = [], 0  # of the exercise that this part is in
    for each in parts(path):
        if level and each[0] <= level:
            level = 0
        if each[1].startswith(("Your turn", "Ten minutes first")):
            level = each[0]
        if bool(level) is exercise:
            chosen.append(each)
    return chosen


@sections
def test_the_questions_at_the_end_have_folded_answers(path):
    assert part(path, "Check yourself").count(ANSWER) >= 3


@sections
def test_what_is_folded_can_be_unfolded(path):
    for text in texts(path):
        assert text.count("<details>") == text.count("</details>") == len(FOLDED.findall(text))
        for folded in FOLDED.findall(text):
            assert re.match(r"<details><summary>[^<]+</summary>\n\n.*\n\n</details>$", folded, re.DOTALL), folded[:80]


@sections
def test_a_task_shows_its_core_and_an_example_and_folds_its_stretch_and_its_marks(path):
    """In this order: how a task is written, the core with an example, edge cases, points."""
    written = [cell.source for cell in cells.read(path) if cell.kind == "markdown"]
    tasks = [text for text in written if "<summary>How it is marked" in text]
    assert any("The **core** of a" in text for text in written) and tasks
    for text in tasks:
        core, *folded = re.split(r"<details><summary>(?=Stretch: |How it is marked)", text)
        assert FENCED.search(core) or core.startswith("### Your turn, step 1"), f"no example: {core[:80]}"
        names = [re.match(r"\w+", each)[0] for each in folded]
        assert names == ["Stretch"] * (len(names) - 1) + ["How"], names


@sections
def test_the_summary_has_five_lines(path):
    assert len(items(part(path, "Summary"))) == 5


@sections
def test_the_words_lead_to_the_official_documentation(path):
    found = [link for pair in LINK.findall(part(path, "Words")) for link in pair if link]
    assert len([link for link in found if OFFICIAL.match(link)]) >= 4


@sections
def test_it_says_where_to_go_on(path):
    assert LINK.search(part(path, "Where to go on"))


@sections
def test_what_was_measured_is_explained(path):
    """Once, on the start page, which everybody reads first."""
    if any("≈" in str(cell.outputs) for cell in cells.read(path)):
        assert any("≈ marks what was measured" in text for text in texts(START))


@sections
def test_the_chapter_is_introduced_where_readers_begin(path):
    """They have this folder, and need no book."""
    if any("the chapter's" in text for text in texts(path)):
        assert any("You do not need the book" in text and "**the chapter's listing**" in text for text in texts(START))
    assert [text for text in texts(path) if re.search(r"[Cc]hapter 2|\(3\.\d\.\d\)|`shifted`", text)] == []


@pytest.mark.parametrize("name", ["services", "actions", "parameters", "ai_integration"])
def test_a_long_page_says_what_may_be_left_out(name):
    (path,) = (path for path in SECTIONS if path.stem == name)
    left = re.search(r"\*\*Time\*\*.*leave out \*([^*]+)\*", cells.read(path)[0].source)
    assert left and any(title.endswith(left[1]) for _, title, _ in parts(path))


def words(path: Path) -> int:
    """The words to be read: up to the last exercise, without exercises and folded answers, and the summary."""
    own = within(path, exercise=False)
    titles = [title for _, title, _ in parts(path)]
    last = max((at for at, title in enumerate(titles) if title.startswith("Your turn")), default=len(titles))
    counted = [each for each in own if titles.index(each[1]) < last or each[1] == "Summary"]
    read = " ".join(FOLDED.sub("", f"{title} {text}") for _, title, text in counted)
    return sum(any(map(str.isalnum, word)) for word in read.split())


@sections
def test_a_page_is_not_too_long(path):
    assert words(path) < WORDS


def minutes(path: Path) -> list[str]:
    """The numbers of its line on the time it takes."""
    return re.findall(r"\d+", re.search(r"\*\*Time\*\*(.*)", cells.read(path)[0].source)[1])


def test_the_start_page_has_the_sections_with_their_times():
    rows = re.findall(r"^\|.*\]\((\w+)/\1\.ipynb\).*?(\|[^|]+\|[^|]+\|)$", "\n".join(texts(START)), re.MULTILINE)
    assert {name: re.findall(r"\d+", time) for name, time in rows} == {path.stem: minutes(path) for path in SECTIONS}


@pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_to_the_internet_are_well_formed(path):
    """They are not fetched: the tests need no internet."""
    text = "\n".join(texts(path)) if path.suffix == ".ipynb" else FENCED.sub("", path.read_text(encoding="utf-8"))
    links = [link for pair in LINK.findall(text) for link in pair if link.startswith("http")]
    for link in links:
        parts = urlsplit(link)
        if (parts.hostname or "").rpartition(".")[2] == "localhost":
            continue  # a class's server on this machine
        assert parts.scheme == "https" and re.fullmatch(r"([a-z0-9-]+\.)+[a-z]{2,}", parts.netloc), link
        assert re.fullmatch(r"[\w./~%+@=&?#:,-]*[\w/]", link.partition("://")[2]), link
        if parts.netloc == "docs.ros.org":
            assert re.match(r"/en/(jazzy|api)/", parts.path) and parts.path.endswith((".html", "/")), link


@pytest.mark.parametrize("path", [START, *SECTIONS], ids=lambda path: path.stem)
def test_links_between_the_notebooks_lead_somewhere(path):
    found = [link for text in texts(path) for link, _ in LINK.findall(text) if link and not link.startswith("http")]
    for link in found:
        name, _, anchor = link.partition("#")
        target = (path.parent / name).resolve() if name else path
        assert target.is_file(), link
        if anchor:
            assert anchor in {title.replace(" ", "-") for _, title, _ in parts(target)}, link


def small_exercises():
    """Each exercise that is checked at once and not handed in: its stub, its check and solution, by its title."""
    for path in SECTIONS:
        known = cells.read(path)
        for at, cell in enumerate(known):
            if cell.kind == "markdown" and (
                title := re.search(r"^## Ten minutes first: (.*)$", cell.source, re.MULTILINE)
            ):
                stub, check, answer = known[at + 1 : at + 4]
                held = "".join(each.source for each in known if "class Held" in each.source and "Held" in check.source)
                solution = re.search(r"<summary>One solution</summary>.*?^```python\n(.*?)^```", answer.source, FLAGS)
                yield pytest.param(f"{held}\n{stub.source}", check.source, f"{held}\n{solution[1]}", id=title[1])


# For each page's small exercise: what it imports, and faults of its solution, each with what stands there instead.
IMPORTS = """
import math
import time

import course
import numpy as np
from course.recorders import GoalRecorder
from course_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import LaserScan
from std_srvs.srv import SetBool, Trigger

ros = course.live()
"""
NEXT = "--- the next one\n"
FAULTS = {
    "an alarm": {"self.ringing or ": "", "not self.there_is_smoke": "True"},
    "two questions": {
        "self.sum_twice,\n                            callback_group=group": "self.sum_twice",
        "a=first.sum": "a=request.a",
    },
    "one cancel": {
        "return Fibonacci.Result(sequence=counted)\n            time": "return Fibonacci.Result()\n            time"
    },
    "one rule of two parameters": {"self.get_parameter(name).value": "50.0", ", reason=": ", reason='' and "},
    "one sector": {"angles % (2 * np.pi) - np.pi": "angles - np.pi", "measured & ": ""},
}


@pytest.mark.parametrize(("stub", "check", "solution"), list(small_exercises()))
def test_a_small_exercise_accepts_its_solution_and_says_what_is_wrong_with_the_stub(
    tmp_path, request, stub, check, solution
):
    faults = FAULTS[request.node.callspec.id]
    assert all(fault in solution for fault in faults)
    tried = [solution, stub, *(solution.replace(*each) for each in faults.items())]
    runs = [f"{own}\n{check}\nros.stop()" for own in tried]
    script = f"{IMPORTS}\nfor run in {runs!r}:\n    exec(run, dict(globals()))\n    print({NEXT!r}, end='')"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True
    )
    right, *wrong = done.stdout.split(NEXT)[:-1]
    assert "as asked" in right
    assert len(wrong) == 1 + len(faults) and all("must be" in said for said in wrong), wrong
