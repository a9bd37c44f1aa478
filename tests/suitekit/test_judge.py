"""What becomes of a test's end that is neither passed nor a Fault."""

import os
from types import SimpleNamespace

import pytest

from autograder.suitekit import judge
from autograder.suitekit.judge import FULL, Judge

NO_THREAD = RuntimeError("can't start new thread")


class Aborted(Exception):
    """os.abort was called."""


def conclude(end: BaseException) -> Judge:
    """A judge that concludes a test which has ended so."""
    plugin = Judge(SimpleNamespace(), print)
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
