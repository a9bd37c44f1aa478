"""Who waits for a server is told what for: at nine o'clock all start theirs."""

import os

from autograder.classroom import spawner
from autograder.classroom.spawner import STARTING, BoxSpawner
from tests.classroom.conftest import run_apart


def first_message(waiting: BoxSpawner) -> dict[str, object]:
    async def ask() -> dict[str, object]:
        telling = waiting.progress()
        try:
            return await anext(telling)
        finally:
            await telling.aclose()

    return run_apart(ask())


def test_who_waits_is_told_how_many_others_do(monkeypatch):
    monkeypatch.setattr(spawner, "TOLD", 0.01)
    servers = [BoxSpawner() for _ in range(30)]
    assert first_message(servers[0])["message"] == "Python loads JupyterLab."
    for each in servers:
        each._spawn_pending = True
    said = first_message(servers[0])
    seconds = STARTING * 30 / (os.cpu_count() or 1)
    assert f"29 other servers start, too: that takes about {seconds:.0f} s in all." in str(said["message"])
    assert 0 <= int(str(said["progress"])) < 100
    for each in servers[2:]:
        each._spawn_pending = False
    assert "1 other server starts, too" in str(first_message(servers[0])["message"])
