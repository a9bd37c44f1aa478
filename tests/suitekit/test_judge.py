"""The verdict on a test that ends neither as passed nor with a Fault."""

import ast
import json
import os
from types import SimpleNamespace

import pytest
from std_msgs.msg import String

from autograder.errors import Wrong
from autograder.suitekit import judge
from autograder.suitekit.judge import FULL, Judge
from autograder.suitekit.ros import LONGEST, sensible
from autograder.suitekit.untrusted import UNREADABLE

NO_THREAD = RuntimeError("can't start new thread")


class Aborted(Exception):
    """os.abort was called."""


def conclude(end: BaseException, report=print) -> Judge:
    """A judge that concludes a test which has ended so."""
    plugin = Judge(SimpleNamespace(), report)
    plugin._ends["test"] = end
    plugin._conclude(SimpleNamespace(name="test", session=SimpleNamespace(shouldstop=False)))
    return plugin


@pytest.mark.parametrize(
    ("end", "taken", "aborts"), [(NO_THREAD, FULL - 1, False), (NO_THREAD, FULL + 1, True), (MemoryError(), 0, True)]
)
def test_a_failure_for_want_of_memory_ends_the_process_and_is_no_fault_of_the_graders(
    monkeypatch, capfd, end, taken, aborts
):
    def abort():
        raise Aborted

    monkeypatch.setattr(os, "abort", abort)
    monkeypatch.setattr(judge, "_has_taken", lambda: taken)
    if aborts:
        with pytest.raises(Aborted):
            conclude(end)
        assert type(end).__name__ in capfd.readouterr().err  # for the instructor
    else:
        assert "can't start new thread" in conclude(end).fault


@pytest.mark.parametrize(
    "read",
    [lambda: json.loads("[" * 100_000), lambda: float(json.loads("9" * 4000)), lambda: ast.parse("0+" * 200_000 + "0")],
)
def test_what_cannot_be_read_is_lost_and_no_fault_of_the_graders(read):
    """Else a program that sees that it loses could have itself judged again."""
    try:
        read()
    except UNREADABLE as error:
        end = error
    verdicts = []
    assert (conclude(end, verdicts.append).fault, len(verdicts)) == ("", 1)


def test_an_answer_that_was_too_long_is_told_in_the_test_that_it_lost_and_no_other():
    """It is judged as if it were empty, and "the message says ''" alone was not true."""
    verdicts = []
    assert sensible(String(data="x" * (LONGEST + 1))) == String()
    conclude(Wrong("status says ''."), verdicts.append)
    conclude(Wrong("Another."), verdicts.append)
    first, other = (verdict.message for verdict in verdicts)
    assert first.endswith("100,000 is read as if it were empty: data of a String had the length 100,001.)")
    assert other == "Another."
    assert verdicts[0].certain
