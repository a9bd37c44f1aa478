"""When a grading may begin: while a core is left, or processor to spare, and with a turn for every command."""

import threading
from collections import deque
from concurrent.futures import ThreadPoolExecutor

import pytest

from autograder.grading import admission
from course.foundation.waiting import wait_until

CLASS = 6  # submissions that a command grades
SOON = 10.0  # s


@pytest.fixture
def machine(monkeypatch, tmp_path):
    """A machine of which no core is free, and no processor to spare before the event that is returned is set."""
    spare = threading.Event()
    waiting: set[int] = set()
    at_most: list[int] = []

    def look(folder) -> bool:
        waiting.add(threading.get_ident())
        at_most.append(len(waiting))
        found = spare.wait(0.01)
        waiting.discard(threading.get_ident())
        return found

    monkeypatch.setattr(admission, "runtime_folder", lambda: tmp_path)
    monkeypatch.setattr(admission, "_take_core", lambda folder, held: False)
    monkeypatch.setattr(admission, "_find_spare", look)
    return spare, at_most


def test_one_grading_of_a_command_waits_for_the_machine_so_that_others_have_their_turn(machine):
    spare, at_most = machine
    begun = threading.Semaphore(0)

    def grade() -> None:
        with admission.turn():
            begun.release()

    with ThreadPoolExecutor(CLASS) as pool:
        gradings = [pool.submit(grade) for _ in range(CLASS)]
        try:
            assert wait_until(lambda: len(at_most) >= CLASS, SOON)
            assert not begun.acquire(blocking=False)
        finally:
            spare.set()
        for grading in gradings:
            grading.result(SOON)
    assert max(at_most) == 1


@pytest.mark.parametrize(
    ("shares", "admitted"),
    [
        ([2.0], [True]),
        ([0.2], [False]),
        ([0.0, 0.0, 2.0, 0.0, 0.0, 2.0], [False] * 6),  # pauses between computations
        ([0.0, 1.2, 1.2, 1.2, 1.2], [False, False, True, True, True]),
        ([0.0, *[1.0] * 8, 0.2], [*[False] * 3, *[True] * 6, False]),
    ],
)
def test_an_extra_grading_begins_when_the_others_leave_processor_now_and_on_average(
    monkeypatch, tmp_path, shares, admitted
):
    """By the share of the cores that is idle in each look."""
    now, idle, left = [100.0], [0.0], [*shares]

    def sleep(seconds: float) -> None:
        now[0] += seconds
        idle[0] += seconds * left.pop(0)

    monkeypatch.setattr(admission, "_looks", deque())
    monkeypatch.setattr(admission, "_idle", lambda: idle[0])
    monkeypatch.setattr(admission.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(admission.time, "sleep", sleep)
    assert [admission._find_spare(tmp_path) for _ in shares] == admitted


@pytest.mark.parametrize(("share", "admitted"), [(0.2, False), (2.0, True)])
def test_a_process_that_was_stopped_meanwhile_goes_on(monkeypatch, tmp_path, share, admitted):
    """By Ctrl-Z and `fg`, or by a machine that gave it no time for seconds."""
    now = [100.0]
    monkeypatch.setattr(admission, "_looks", deque([(10.0, 0.0)]))  # of a grading long ago
    monkeypatch.setattr(admission, "_idle", lambda: share * now[0])
    monkeypatch.setattr(admission.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(admission.time, "sleep", lambda _: now.__setitem__(0, now[0] + 2 * admission.LONGER))
    assert [admission._find_spare(tmp_path) for _ in range(3)] == [admitted] * 3
