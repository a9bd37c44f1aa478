"""What becomes of a test's end that is neither passed nor a Fault."""

import ast
import json
import os
from types import SimpleNamespace

import pytest

from autograder.suitekit import judge
from autograder.suitekit.judge import FULL, Judge
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
