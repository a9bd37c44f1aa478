"""Attacks on the results: by names, by notebooks, on the gradebook; and what students and instructors are shown."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from autograder.grading import single
from autograder.sandbox import cleaning
from autograder.submissions import exercises
from tests.hidden.answers.calculator import CLIENT, REFERENCE, SERVER, SRV

from .programs import RETURN, handed_in, text

AUTOGRADER = str(Path(sys.executable).with_name("autograder"))
WRONG = text(SERVER, (RETURN, "        response.result += 1.0\n" + RETURN))
NAMES = [
    "$(touch x)",
    "; touch x",
    "x..",
    "'); DROP TABLE grade;--",
    "--output=x",
    "new\nline \x1b[2J",
    "50% {student}",
]
BESIDE = {
    "conftest.py": "import os\nos._exit(0)\n",
    "pytest.ini": "[pytest]\naddopts = --collect-only\n",
    "sitecustomize.py": "import os\nos._exit(0)\n",
    "pytest.py": "def main(*_, **__): return 0\n",
    "rclpy/__init__.py": "raise SystemExit(0)\n",
    "calculator_interfaces/__init__.py": "raise SystemExit(0)\n",
    "calculator_interfaces/srv.py": "raise SystemExit(0)\n",
    "junit.xml": "<testsuite failures='0'/>\n",
    "results.jsonl": '{"student": "<b>x</b>", "assignment": "calculator", "score": 20}\n',
    "suite.py": "",
    "autograder/__init__.py": "raise SystemExit(0)\n",
    "exercise.toml": "points = 20\n",
}
CELL = """import ast, os, sqlite3, IPython
shell = IPython.get_ipython()
shell.displayhook(5.0)
class Drop(ast.NodeTransformer):
    def visit_Assert(self, node):
        return None
shell.ast_transformers.append(Drop())
shell.kernel.do_execute = lambda *_, **__: {'status': 'ok'}
open('RUN', 'w')
sqlite3.connect('gradebook.db').execute('UPDATE grade SET auto_score = 20')
os._exit(0)
"""


def lay(folder: Path, files: dict[str, bytes | str]) -> None:
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)


def notebook(*cells: str) -> str:
    return json.dumps(
        {
            "nbformat": 4,
            "nbformat_minor": 5,
            "metadata": {},
            "cells": [
                {
                    "cell_type": "code",
                    "id": str(number),
                    "metadata": {},
                    "execution_count": None,
                    "outputs": [],
                    "source": cell,
                }
                for number, cell in enumerate(cells)
            ],
        }
    )


@pytest.mark.long("grades a class")
def test_a_class_of_names_and_notebooks(confinement, tmp_path):
    submitted, out = tmp_path / "in", tmp_path / "out"
    lay(submitted / "<b>x" / "calculator", handed_in(WRONG) | BESIDE | {"calculator.ipynb": notebook(CELL)})
    for name in NAMES:
        lay(submitted / name / "calculator", {SRV: "", "../calculator/notes.txt": ""})
    bombs = {
        "deep": b"[" * 3_000_000,
        "cells": notebook(*["x"] * 40_000).encode(),
        "escape": notebook("%%exercise ../../../x.py\nraise SystemExit\n").encode(),
    }
    for name, bomb in bombs.items():
        lay(submitted / name / "calculator", {"calculator.ipynb": bomb})
    lay(submitted / "sparse" / "calculator", {SRV: REFERENCE[SRV]})
    with open(submitted / "sparse" / "calculator" / "calculator.ipynb", "wb") as file:
        file.truncate(20 << 30)
    for name, target in ((SERVER, "../../<b>x/calculator/" + SERVER), (CLIENT, "/dev/zero"), (SRV, "..")):
        (submitted / "links" / "calculator").mkdir(parents=True, exist_ok=True)
        (submitted / "links" / "calculator" / name).symlink_to(target)
    before = {path for path in tmp_path.rglob("*") if not path.is_symlink()}
    done = subprocess.run(
        [AUTOGRADER, "grade", str(submitted), "--output", str(out), "--seed", "7"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=150,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "\x1b" not in done.stdout
    scores = {line["student"]: line["score"] for line in map(json.loads, (out / "results.jsonl").open())}
    assert scores == dict.fromkeys([*NAMES, *bombs, "sparse", "links"], 0) | {"<b>x": 9.25}
    new = {path for path in tmp_path.rglob("*") if not path.is_symlink()} - before
    assert all(path.is_relative_to(out) for path in new)
    assert len(list((out / "feedback").rglob("*.html"))) == len(scores)
    page = (out / "feedback" / "<b>x" / "calculator.html").read_text()
    assert "&lt;b&gt;x" in page and "<b>" not in page

    from nbgrader.api import Gradebook

    with Gradebook(f"sqlite:///{out / 'gradebook.db'}") as book:
        assert {s.student_id: s.score for s in book.assignment_submissions("calculator")} == scores

    # The instructor is shown what the student is not shown.
    details = json.loads(next(line for line in (out / "details.jsonl").open() if "<b>x" in line))
    detail = details["details"]["test_add"]
    assert "expected" in detail and "got" in detail
    assert detail not in page and detail not in (out / "results.jsonl").read_text()
    assert os.stat(out / "details.jsonl").st_mode & 0o077 == 0
    shown = subprocess.run(
        [AUTOGRADER, "show", str(out), "--student", "<b>x"], capture_output=True, text=True, timeout=30
    )
    assert detail in shown.stdout and "seed 7" in shown.stdout
    assert subprocess.run([AUTOGRADER, "show", str(out), "--student", "nobody"], capture_output=True).returncode == 2

    # The same seed gives the same hidden inputs, and so the same details.
    part = exercises.load("calculator").part(*details["details"])  # the tests that are lost
    again = single.judge(part, handed_in(WRONG), confinement, 7, 1.0)
    assert {test: verdict.detail for test, verdict in again.verdicts.items()} == details["details"]


def test_excerpt():
    source = "limit = 42\nprint('limit', limit)\n"
    output = (
        "\x1b[31mred\x1b[0m limit 42 a=17.25 secret \u202ereversed\u202c\n[INFO] [1700000000.123456] [node]: x=-3.5e7\n"
        'File "/srv/x/hidden/calculator_server.py", line 17, in f\n'
    )
    told = cleaning.excerpt(output, source, {"secret", 42.5})
    assert told == 'red limit 42 a=… … reversed\n[INFO] [node]: x=…\nFile "calculator_server.py", line 17, in f'
    own = "node.destroy_node()\nnode.__init__()"  # words that a program has are no hidden inputs of it
    assert (
        cleaning.excerpt("no destroy_node, no invented", own, {"destroy_node", "invented"}) == "no destroy_node, no …"
    )
    assert len(cleaning.excerpt("x" * 50_000_000, "", set())) < 3000
    assert len(cleaning.excerpt("1\n" * 500_000, "", set())) < 3000
