"""The judging process: runs hidden suites, which talk to the students' programs over ROS 2 and read all they send.

`python -m autograder.grading.judge_process CONTROL` is started by the launcher.  It has a fork of itself do each job,
so that ROS 2 and pytest are loaded once.  The fork confines itself before it starts any program: even if a program
takes it over by what it sends, it can do no more than that program.  Student code is never imported.
"""

import contextlib
import ctypes
import gc
import os
import select
import signal
import socket
import sys
import tempfile
from pathlib import Path

import pytest

import autograder.hidden
from autograder.records import Finished, Job, Message, Verdict, from_line, to_line
from autograder.sandbox.confine import confine
from autograder.sandbox.launching import LaunchClient
from autograder.sandbox.networks import Threads
from autograder.sandbox.view import FILES, INTERFACES, JUDGE_HOME, SCRATCH
from autograder.submissions.exercises import load
from autograder.suitekit import actions, fixtures, live, parameters, topics  # noqa: F401  loaded once, for all suites
from autograder.suitekit.bench import Bench
from autograder.suitekit.clock import Clock
from autograder.suitekit.judge import Judge
from course.interfaces import Built

PR_SET_PDEATHSIG = 1
MNT_DETACH = 2  # umount(2)
HOME_OPTIONS = f"size={SCRATCH},nr_inodes={FILES},mode=1777".encode()
OVERTIME = 10.0  # s that the running test may go on after the time for all tests is used up
UNUSED = (  # plugins of pytest for what no suite does, which each job would load and search for fixtures
    *("cacheprovider", "debugging", "doctest", "junitxml", "legacypath", "pastebin", "setuponly", "setupplan"),
    *("stepwise", "subtests", "threadexception", "unittest", "unraisableexception"),
)
DESCRIPTORS = 250  # received with a job: the job itself, a socket to the launcher, networks

LIMITS = {  # of the process, by prlimit(1)
    "data": 2 << 30,  # bytes; includes the threads' reserved stacks
    "nofile": 4096,
    "nproc": 1024,  # threads: Fast DDS has ten or so for each domain
    "fsize": 16 << 20,  # bytes
    "core": 0,
    "msgqueue": 0,  # bytes
    "sigpending": 64,
}

_libc = ctypes.CDLL(None, use_errno=True)


def main() -> None:
    """Do what the launcher sends through the socket CONTROL, and send it the exit status of each job."""
    control = socket.socket(fileno=int(sys.argv[1]))
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # the first process of a namespace cannot get it from inside
    gc.freeze()
    while True:
        user, descriptors, _, _ = socket.recv_fds(control, 100, DESCRIPTORS)
        if not descriptors:
            return  # the launcher is gone
        if len(descriptors) > 2:
            renew_home()
        child = os.fork()
        if not child:
            control.close()
            judge(int(user) if user else None, *descriptors)
        for descriptor in descriptors:
            os.close(descriptor)
        child_ended = os.pidfd_open(child)
        while child_ended not in select.select([child_ended, control.fileno()], [], [])[0]:
            control.recv(100)  # returns when the launcher ends the job, or is gone
            os.kill(child, signal.SIGKILL)
        os.close(child_ended)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        if os.getpid() == 1:
            end_all_others()
        control.send(str(status).encode())


def renew_home() -> None:
    """Give the next job an empty folder for its files: it must not see those of the job before."""
    home = JUDGE_HOME.encode()
    if _libc.umount2(home, MNT_DETACH) or _libc.mount(b"tmpfs", home, b"tmpfs", 0, HOME_OPTIONS):
        raise OSError(ctypes.get_errno(), f"{JUDGE_HOME}: {os.strerror(ctypes.get_errno())}")


def end_all_others() -> None:
    """Kill every process of this namespace but the first: everything that a grading has left running."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(-1, signal.SIGKILL)
    with contextlib.suppress(ChildProcessError):
        while True:
            os.wait()


def judge(user: int | None, job_file: int, channel: int, *networks: int) -> None:
    """Do one job in this process, confined, and end it."""
    threads = None
    if networks:
        threads = Threads(dict(enumerate(networks, start=1)))
        confine(user, LIMITS, threads.everywhere)
    _libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    with open(job_file, "rb") as file:
        job = from_line(file.read())
    assert isinstance(job, Job)
    client = LaunchClient(socket.socket(fileno=channel))
    with tempfile.TemporaryDirectory() as hidden:  # in the process's home folder, if it is confined
        for path, content in job.hidden.items():
            target = Path(hidden, path)
            target.parent.mkdir(exist_ok=True)
            target.write_bytes(content)
        run_suite(job, Path(hidden), client, threads)
    os._exit(0)  # all threads are idle, and shutting down Fast DDS takes time


def run_suite(job: Job, hidden: Path, client: LaunchClient, threads: Threads | None) -> None:
    """Run the hidden suite of one job, in the folder `hidden`, and send the results to the launcher."""

    def tell(message: Message) -> None:
        client.tell(to_line(message.cut() if isinstance(message, Verdict) else message).decode())

    autograder.hidden.__path__ = [str(hidden)]
    exercise = load(job.exercise, hidden)
    if job.interfaces:
        Built(exercise.package, _own_view(job.interfaces) if threads else Path(job.interfaces)).use()
    clock = Clock(exercise.time_limit * max(1.0, job.patience), job.patience)
    bench = Bench(job.files, client, threads, clock, job.seed)
    judge = Judge(bench, tell)
    logs: dict[str, str] = {}
    signal.signal(signal.SIGALRM, judge.interrupt)
    signal.setitimer(signal.ITIMER_REAL, clock.left + OVERTIME)
    suite = exercise.folder / "suite.py"
    chosen = [f"{suite}::{test}" for test in job.chosen] or [str(suite)]
    options = ["-c", f"{hidden}/pytest.ini", "--rootdir", str(exercise.folder)]
    # Python's own traceback: for pytest's, each line of it would parse the whole suite again.
    options += ["--assert=plain", "--tb=native", "-q", *(word for name in UNUSED for word in ("-p", f"no:{name}"))]
    try:
        bench.begin(exercise.early, whole=not job.chosen)
        status = pytest.main([*options, *chosen], plugins=[judge, fixtures])
        logs = bench.logs()
    finally:
        bench.close()
    tell(Finished(int(status), judge.fault, logs))


def _own_view(interfaces: str) -> Path:
    """Return the path of an interface package in this process's view, see `view.of_judge`."""
    prefix = Path(interfaces)
    return Path(INTERFACES, prefix.parent.name, prefix.name)


if __name__ == "__main__":
    main()
