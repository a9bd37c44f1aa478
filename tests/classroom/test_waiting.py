"""Who waits for a server is told what for, and whose turn it is: at nine o'clock all start theirs."""

import asyncio

from autograder.classroom import spawner
from autograder.classroom.line import Line
from autograder.classroom.spawner import STARTING, BoxSpawner
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
        monkeypatch.setattr(BoxSpawner, "_line", Line(2))
        assert await first_message(servers[0]) == "Starting your server."
        let_go = asyncio.Event()

        async def start(each: BoxSpawner) -> None:
            async with each._line.turn(each):
                await let_go.wait()

        tasks = [asyncio.create_task(start(each)) for each in servers]
        await asyncio.sleep(0)
        seconds = STARTING * 8 / 2
        last = f"Starting your server: 7 others are before you, which takes about {seconds:.0f} s."
        assert await first_message(servers[7]) == last
        assert (await first_message(servers[1])).startswith("Starting your server: 1 other is before you")
        let_go.set()
        await asyncio.gather(*tasks)
        assert await first_message(servers[7]) == "Starting your server."

    run_apart(all_at_once())


def test_a_few_start_at_a_time_in_the_order_of_coming_and_who_gives_up_is_passed_over():
    begun = []

    async def all_at_once() -> None:
        line, ends = Line(2), [asyncio.Event() for _ in range(5)]

        async def start(number: int) -> None:
            async with line.turn(number):
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
        assert line.before(4) == 0

    run_apart(all_at_once())
