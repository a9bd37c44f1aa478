"""A cell that waits in a loop of its own is told where it is, and why what it waits for may not come."""

import contextlib
import ctypes
import linecache
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from std_srvs.srv import Trigger

from course.explaining import cell_loops
from course.explaining.cell_loops import cell_loop
from course.foundation.waiting import wait_until
from course.session.live import Session


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session()
    yield made
    made.close()


class Stopped(BaseException):
    pass


class Cell:
    """A cell that runs in a thread until it is left."""

    def __init__(self, text: str, **names: object):
        self._name, self._names = f"/tmp/ipykernel_1/{id(self)}.py", names
        linecache.cache[self._name] = (len(text), None, text.splitlines(keepends=True), self._name)
        self._thread = threading.Thread(target=self._run, args=(text,), daemon=True)

    def _run(self, text: str) -> None:
        with contextlib.suppress(Stopped):
            exec(compile(text, self._name, "exec"), self._names)

    def __enter__(self) -> int:
        self._thread.start()
        return self._thread.ident or 0

    def __exit__(self, *_: object) -> None:
        ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(self._thread.ident or 0), ctypes.py_object(Stopped))
        self._thread.join(5.0)


@pytest.mark.parametrize(
    "loop",
    [
        "while not client.wait_for_service(timeout_sec=0.1):\n    pass",
        "while not client.service_is_ready(): time.sleep(0.1)",
    ],
)
def test_a_loop_until_a_server_is_there_tells_which_there_are(session, capsys, loop):
    client = session.node.create_client(Trigger, "/snapshoot")
    with Cell(f"import time\n{loop}", client=client) as thread:
        assert wait_until(lambda: cell_loop(thread), 5.0)
        first = session.tell_of_a_loop(thread, 4.0, None)
        assert capsys.readouterr().err == ""
        session.tell_of_a_loop(thread, 5.0, first)
    told = capsys.readouterr().err
    assert told.startswith("After 5 s this cell still waits in line 2 of the cell, `while not client.")
    assert "There are no services here: has the node been started?" in told
    assert "`wait_for_service(timeout_sec=5.0)` (of an action, `wait_for_server`) returns False after 5 s." in told


def test_a_loop_until_a_message_is_there_tells_how_to_wait(session, capsys):
    with Cell("more = []\nwhile not more:\n    pass") as thread:
        assert wait_until(lambda: cell_loop(thread), 5.0)
        session.tell_of_a_loop(thread, 5.0, cell_loop(thread))
    assert capsys.readouterr().err.endswith(
        "`ros.until(lambda: more)` waits for 5 s at most, and says why nothing has come if it knows.\n"
    )


@pytest.mark.parametrize(
    "text",
    [
        "import time\nend = time.monotonic() + 9\nwhile time.monotonic() < end: time.sleep(0.1)",
        "import time\nwhile True:\n    time.sleep(0.1)\n    done = 1",
        "import time\nwhile True:\n    time.sleep(0.1)",
        "import time\ntime.sleep(9)",
    ],
)
def test_a_cell_with_a_limit_or_that_works_is_left_alone(text):
    with Cell(text) as thread:
        time.sleep(0.3)
        assert cell_loop(thread) is None


@pytest.mark.parametrize(
    ("line", "is_told"),
    [
        ("get_ipython().system('python3 server.py')", True),
        ("!python3 server.py --ros-args -p rate:=2.0", True),
        ("!python3 client.py", False),
        ("!python3 server.py &", False),
        ("!timeout 5 python3 server.py", False),
        ("print('python3 server.py')", False),
    ],
)
def test_a_cell_that_waits_for_the_end_of_a_server(tmp_path, monkeypatch, line, is_told):
    monkeypatch.chdir(tmp_path)
    Path("server.py").write_text("node.create_service(Trigger, 'ask', ask)\n")
    Path("client.py").write_text("node.create_client(Trigger, 'ask')\n")
    frame = SimpleNamespace(f_code=SimpleNamespace(co_filename="<ipython-input-1>"), f_lineno=1, f_back=None)
    monkeypatch.setattr(cell_loops.sys, "_current_frames", lambda: {1: frame})
    monkeypatch.setattr(cell_loops.linecache, "getline", lambda name, number: f"{line}\n")
    assert cell_loops.server_waited_for(1) == ("server.py" if is_told else "")
