"""When a grading may begin: while a core is left, or processor to spare, and with a turn for every command."""

import threading
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
