"""A member who waits for a server sees why, and whose turn it is: at nine o'clock all start theirs."""

import asyncio

import pytest

from autograder.classroom import spawner
from autograder.classroom.spawner import STARTING, BoxSpawner
from autograder.classroom.start_queue import StartQueue
from tests.classroom.conftest import run_apart


async def first_message(waiting: BoxSpawner) -> str:
    telling = waiting.progress()
    try:
        said = await anext(telling)
        assert 0 <= said["progress"] < 100
        return str(said["message"])
    finally:
        await telling.aclose()


def test_who_waits_is_told_how_many_are_before(monkeypatch):
    monkeypatch.setattr(spawner, "AT_ONCE", 2)
    servers = [BoxSpawner() for _ in range(9)]

    async def all_at_once() -> None:
        monkeypatch.setattr(BoxSpawner, "_queue", StartQueue(2))
        assert await first_message(servers[0]) == "Starting your server."
        let_go = asyncio.Event()

        async def start(each: BoxSpawner) -> None:
            async with each._queue.turn(each):
                await let_go.wait()

        tasks = [asyncio.create_task(start(each)) for each in servers]
        await asyncio.sleep(0)
        seconds = STARTING * 8 / 2
        last = f"Starting your server: 7 others are before you. It takes about {seconds:.0f} s."
        assert await first_message(servers[7]) == last
        assert (await first_message(servers[1])).startswith("Starting your server: 1 other is before you")
        let_go.set()
        await asyncio.gather(*tasks)
        assert await first_message(servers[7]) == "Starting your server."

    run_apart(all_at_once())


def test_a_few_start_at_a_time_in_the_order_of_coming_and_who_gives_up_is_passed_over():
    begun = []

    async def all_at_once() -> None:
        queue, ends = StartQueue(2), [asyncio.Event() for _ in range(5)]

        async def start(number: int) -> None:
            async with queue.turn(number):
                begun.append(number)
                await ends[number].wait()

        async def settle() -> None:
            for _ in range(5):
                await asyncio.sleep(0)

        tasks = [asyncio.create_task(start(number)) for number in range(5)]
        await settle()
        assert begun == [0, 1]
        tasks[2].cancel()
        ends[1].set()
        await settle()
        assert begun == [0, 1, 3]
        tasks[0].cancel()  # in the midst of its turn
        await settle()
        assert begun == [0, 1, 3, 4]
        for end in ends:
            end.set()
        await asyncio.gather(*tasks, return_exceptions=True)
        assert queue.ahead_of(4) == 0

    run_apart(all_at_once())


def test_who_waits_longer_than_usual_is_told_so():
    assert spawner._waiting(2, 0.0).startswith("Starting your server: 2 others are before you. It takes about")
    assert spawner._waiting(2, 60.0) == "Starting your server: 2 others are before you. It takes longer than usual."
    assert spawner._waiting(0, 60.0) == "Starting your server. It takes longer than usual."


@pytest.mark.parametrize(
    ("does", "gives_way"),
    [("nothing", True), ("uses the processor for ever", True), ("starts slowly", False), ("answers at once", False)],
)
def test_a_server_that_hangs_does_not_keep_the_others_waiting(monkeypatch, does, gives_way):
    """A student can have their own server wait for ever, by a pipe in place of a file that it reads."""
    monkeypatch.setattr(spawner, "LOOK", 0.001)
    monkeypatch.setattr(spawner, "IDLE", 0.02)
    answered = []

    async def start() -> None:
        used = 0.0

        def processor_time() -> float:
            nonlocal used
            used += {"nothing": 0.0, "uses the processor for ever": 0.5}.get(does, 0.01)
            return used

        async def answer() -> None:
            if does in ("nothing", "uses the processor for ever"):
                await asyncio.Event().wait()
            while does == "starts slowly" and used < 0.1:
                await asyncio.sleep(0)
            answered.append(does)

        await asyncio.wait_for(spawner._while_it_starts(answer(), processor_time, 3.0), 20)

    run_apart(start())
    assert bool(answered) is not gives_way
