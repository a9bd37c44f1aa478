"""Messages are in plain English: phrases that have to be read twice stay out of what programs say.

Docstrings are read, too: those of commands are help texts, and those of hidden tests are titles that students read.
"""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PRIVATE = {
    r"(?<![Tt]here )\b(is|are|was|were) no (?!longer\b)": "is not a ...",
    r"(?<![Tt]here )\b(is|are) none\b": "is not one; there are no ...",
    r"\bof this course, or\b": "from this course, or",
    r"\bno fault of yours\b": "Your work is safe",
    r"\bnames nobody\b": "contains no students",
    r"\bnothing is known of\b": "say what happened, and what to do",
    r"\bnobody looks at\b": "No ... is open",
    r"\bthat there (cannot be|is not|are not)\b": "invalid; has no ...",
    r"\banew\b(?!\")": "again",
    r"\bnothing (in it )?tells\b": "is unknown; it does not say ...",
    r"\bis nobody's\b": "no longer counts",
    r"\bin each other\b": "nested",
    r"\bnot come yet\b": "is in the future",
    r"\bcalendar has\b": "does not exist",
    r"\bcalled alike\b": "would both be called ...",
    r"\bby no platform\b": "from no platform",
    r"\b(answers|reaches) nobody\b": "does not answer; is lost",
    r"\bwaits for its end\b": "waits for it to end",
    r"\bwhat stands in the place of\b": "a wrong ...",
    r"\bwith(out)? a blank\b": "space",
}
LEFT = {"anew"}  # a key of the panels' protocol


def said(text: str) -> list[str]:
    """Return the texts of a module, each without line breaks."""
    constants = (node.value for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Constant))
    return [re.sub(r"\s+", " ", each) for each in constants if isinstance(each, str) and each not in LEFT]


def private(text: str) -> dict[str, str]:
    """Return the texts with a private phrase, and what to write instead."""
    return {each: better for each in said(text) for phrase, better in PRIVATE.items() if re.search(phrase, each)}


def test_private_phrases_are_found():
    text = '"""A path is\n    none."""\nraise ValueError(f"{path} is no {kind}: make it anew")\n'
    assert private(text) == {
        "A path is none.": "is not one; there are no ...",
        " is no ": "is not a ...",
        ": make it anew": "again",
    }


@pytest.mark.parametrize("package", ["course", "autograder"])
def test_no_message_has_a_private_phrase(package: str):
    paths = sorted((ROOT / package).rglob("*.py"))
    found = {path.relative_to(ROOT).as_posix(): private(path.read_text(encoding="utf-8")) for path in paths}
    assert len(found) > 50
    assert {name: phrases for name, phrases in found.items() if phrases} == {}
