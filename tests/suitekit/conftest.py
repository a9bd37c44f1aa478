"""For every test here: the machine is not starved, whatever else runs on it."""

import pytest


@pytest.fixture(autouse=True)
def calm(monkeypatch):
    monkeypatch.setattr("os.getloadavg", lambda: (0.0, 0.0, 0.0))
