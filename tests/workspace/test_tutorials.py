"""The tutorials of docs.ros.org show what they promise, typed letter by letter into terminals of the course."""

import os
import re
from pathlib import Path

import pytest

from tests.terminals import Terminal
from tests.workspace.conftest import ROOT
from tests.workspace.tutorials import FILES, TUTORIALS, Tutorial

PROMPT = re.compile(r"\S+ \(domain \d+(, as you set it)?\) \$ $")
CODES = re.compile(r"\x1b(\[[0-9;?]*[a-zA-Z]|\][^\x07]*\x07)|\r")  # colours, titles, and what readline says to itself
SECONDS = 90.0  # for one line, on a busy machine


class Typist:
    """Somebody at a desk with a few terminals and an editor."""

    def __init__(self, home: Path, environment: dict[str, str]):
        self.home, self.environment = home, environment
        self.terminals: dict[str, Terminal] = {}
        self.waits: set[str] = set()  # terminals in which a line was typed whose prompt has not come back yet

    def type(self, number: str, line: str) -> None:
        """Type a line at a terminal's prompt, or press Ctrl-C; a line without letters is only looked at."""
        if number not in self.terminals:
            self.terminals[number] = Terminal(self.home, self.environment)
            self.waits.add(number)
        terminal = self.terminals[number]
        if line == "^C":
            terminal.type("\x03")
        elif line:
            self.prompt(number)
            terminal.type(f"{line}\n")
            terminal.read_until(r"\n", SECONDS)  # its echo is no answer
        self.waits.add(number)

    def prompt(self, number: str) -> None:
        """Wait until the terminal is ready for the next line."""
        if number in self.waits:
            self.terminals[number].read_until(PROMPT, SECONDS, plain)
            self.waits.remove(number)

    def sees(self, number: str, text: str) -> None:
        """Wait until the terminal shows a text."""
        self.terminals[number].wait_for(text, SECONDS, plain)

    def place(self, path: str) -> Path:
        """Return the file that a student calls so."""
        return self.home / path.removeprefix("~/")

    def write(self, path: str, name: str) -> None:
        """Save a file."""
        self.place(path).write_text(FILES[name])

    def add(self, path: str, rest: str) -> None:
        """Put lines before a place in a file."""
        name, _, before = rest.partition(" -> ")
        file = self.place(path)
        text = file.read_text()
        at = re.search(rf"^ *{re.escape(before)}", text, re.MULTILINE).start()
        file.write_text(text[:at] + FILES[name] + text[at:])

    def entry(self, package: str, line: str) -> None:
        """Add a console script to a package."""
        file = self.home / "ros2_ws/src" / package / "setup.py"
        text = file.read_text()
        assert "'console_scripts': [\n" in text
        file.write_text(text.replace("'console_scripts': [\n", f"'console_scripts': [\n            '{line}',\n"))

    def follow(self, script: str) -> None:
        """Do what a tutorial's script says."""
        number = ""
        for line in filter(None, script.split("\n")):
            if typed := re.fullmatch(r"(\d)\$ ?(.*)", line):
                number = typed[1]
                self.type(number, typed[2])
            elif line.startswith("    "):
                self.sees(number, line[4:])
            else:
                what, path, rest = re.fullmatch(r"(write|add|entry) ([^:]+): (.*)", line).groups()
                for each in list(self.terminals):
                    self.prompt(each)
                getattr(self, what)(path, rest)
        for each in self.terminals:
            self.prompt(each)


def plain(text: str) -> str:
    """Return what is seen of what was sent to a terminal."""
    return CODES.sub("", text)


@pytest.fixture
def typist(tmp_path):
    kept = {name: os.environ[name] for name in ("LANG", "COURSE_CACHE") if name in os.environ}
    home, run = tmp_path / "ada", tmp_path / "run"
    home.mkdir()
    run.mkdir()
    typist = Typist(home, {**kept, "PATH": "/usr/local/bin:/usr/bin:/bin", "USER": "ada", "XDG_RUNTIME_DIR": str(run)})
    yield typist
    for terminal in typist.terminals.values():
        terminal.close()


def cases():
    """One tutorial is typed in every run of the tests: its lines are those of most others."""
    for tutorial in TUTORIALS:
        first = tutorial.page.endswith("Py-Publisher-And-Subscriber")
        yield pytest.param(tutorial, id=tutorial.page.rpartition("/")[2], marks=[] if first else [pytest.mark.matrix])


@pytest.mark.timeout(600)
@pytest.mark.parametrize("tutorial", list(cases()))
def test_each_line_of_a_tutorial_works_as_it_is_printed(typist, tutorial: Tutorial):
    typist.follow(tutorial.script)


def test_the_students_table_of_tutorials_has_each_of_them():
    readme = (ROOT / "docs/student/README.md").read_text()
    row = r"^\| \[([^\]]+)\]\(https://docs.ros.org/en/jazzy/Tutorials/([^)]+)\.html\) \|"
    rows = dict(re.findall(row, readme, re.MULTILINE))
    assert {each.title: each.page for each in TUTORIALS}.items() <= rows.items()
