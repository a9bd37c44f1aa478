"""A grading may begin while a core is left, or processor time to spare, and with a turn for every command."""

import threading
from collections import Counter, deque
from concurrent.futures import ThreadPoolExecutor

import pytest

from autograder.grading import admission
from course.foundation.waiting import wait_until

CLASS = 6  # submissions that a command grades
SOON = 10.0  # s


@pytest.fixture(autouse=True)
def unknown(monkeypatch):
    """No grading was done before in this process."""
    monkeypatch.setattr(admission, "_taken", {})
    monkeypatch.setattr(admission, "_running", Counter())


@pytest.fixture
def machine(monkeypatch, tmp_path):
    """A machine of which no core is free, and no processor to spare before the event that is returned is set."""
    spare = threading.Event()
    waiting: set[int] = set()
    at_most: list[int] = []

    def look(folder, exercise) -> bool:
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
        with admission.turn("calculator"):
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
    assert [admission._find_spare(tmp_path, "calculator") for _ in shares] == admitted


@pytest.mark.parametrize(("share", "admitted"), [(0.2, False), (2.0, True)])
def test_a_process_that_was_stopped_meanwhile_goes_on(monkeypatch, tmp_path, share, admitted):
    """By Ctrl-Z and `fg`, or by a machine that gave it no time for seconds."""
    now = [100.0]
    monkeypatch.setattr(admission, "_looks", deque([(10.0, 0.0)]))  # of a grading long ago
    monkeypatch.setattr(admission, "_idle", lambda: share * now[0])
    monkeypatch.setattr(admission.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(admission.time, "sleep", lambda _: now.__setitem__(0, now[0] + 2 * admission.LONGER))
    assert [admission._find_spare(tmp_path, "calculator") for _ in range(3)] == [admitted] * 3


@pytest.mark.parametrize(
    ("running", "exercise", "share", "admitted"),
    [
        (["calculator"] * 5, "calculator", 1.0, True),
        (["calculator"] * 8, "calculator", 1.0, True),
        (["calculator"] * 9, "calculator", 1.0, False),  # no room left
        (["calculator"] * 5, "calculator", 0.1, False),  # somebody else uses the machine
        (["ai_integration"], "calculator", 0.5, True),
        (["ai_integration"], "ai_integration", 0.5, True),
        (["ai_integration"] * 2, "ai_integration", 2.0, False),
        (["ai_integration"] * 2, "calculator", 2.0, True),
        (["services"], "calculator", 0.5, False),  # not known yet: by what is idle
        (["services"], "calculator", 0.8, True),
    ],
)
def test_an_extra_grading_begins_when_the_cores_have_room_for_what_it_takes(
    monkeypatch, tmp_path, running, exercise, share, admitted
):
    """By what gradings took before: a fifth of a core, and four fifths."""
    now = [100.0]
    monkeypatch.setattr(admission, "_looks", deque())
    monkeypatch.setattr(admission, "_running", Counter(running))
    monkeypatch.setattr(admission, "cores", lambda: 2)
    monkeypatch.setattr(admission, "_idle", lambda: share * now[0])
    monkeypatch.setattr(admission.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(admission.time, "sleep", lambda seconds: now.__setitem__(0, now[0] + seconds))
    for used in (1.0, 1.8):
        admission.learn("calculator", used, 7.0)
    admission.learn("ai_integration", 8.0, 10.0)
    assert admission._find_spare(tmp_path, exercise) == admitted


def test_a_grading_counts_while_it_runs_and_not_when_it_has_failed(monkeypatch, tmp_path):
    monkeypatch.setattr(admission, "runtime_folder", lambda: tmp_path)
    with pytest.raises(ValueError, match="broken"), admission.turn("services"):
        assert admission._running["services"] == 1
        raise ValueError("broken")
    assert admission._running["services"] == 0
