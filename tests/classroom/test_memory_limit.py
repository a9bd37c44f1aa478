"""Without a control group that limits a server's memory, the largest of its processes is ended."""

import subprocess
import sys

import pytest

from autograder.classroom import memory_limit
from autograder.sandbox.usage import children, processes, resident

MIB = 1 << 20
LARGE = 200 * MIB
PARENT = f"""
import subprocess, sys
small = "print('ready', flush=True); input()"
large = "held = b'x' * {LARGE}; " + small
programs = [subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE) for code in (large, small)]
for each in programs:
    each.wait()
    print(each.returncode, flush=True)
"""


@pytest.fixture
def server():
    """A process with a small child and a large one."""
    with subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True) as process:
        assert [process.stdout.readline() for _ in range(2)] == ["ready\n"] * 2
        yield process
        process.kill()


def test_whoever_keeps_within_the_limit_is_left_alone(server):
    assert memory_limit.bound(processes(server.pid), 3 * LARGE) == 0
    assert len(children(server.pid)) == 2


def test_the_largest_process_ends_and_the_others_go_on(server):
    large = max(children(server.pid), key=resident)
    assert memory_limit.bound(processes(server.pid), LARGE) == large
    assert server.stdout.readline() == "-9\n"
    assert len(children(server.pid)) == 1 and server.poll() is None
