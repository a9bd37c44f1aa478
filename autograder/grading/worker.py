"""The process that grades: `python -m autograder.grading.worker`, in network and process namespaces of its own.

Reads jobs from stdin and has a fork of itself grade each of them, so that ROS 2 and pytest are loaded once.  The fork
runs the exercise's hidden suite and writes to stdout a Verdict for each test, then Finished; when it has ended, the
parent writes Ended.  All of these are records, a line of JSON each.  What the student wrote is never imported.
"""

import contextlib
import ctypes
import gc
import os
import select
import signal
import sys
from pathlib import Path

import pytest

import autograder.hidden
from autograder.records import Ended, Finished, Job, Message, from_line, to_line
from autograder.sandbox.box import Sandbox
from autograder.submissions.exercises import load
from autograder.suitekit import actions, fixtures, live, parameters, topics  # noqa: F401  loaded once, for all suites
from autograder.suitekit.bench import Bench
from autograder.suitekit.clock import Clock
from autograder.suitekit.judge import Judge
from course.interfaces import Built

PR_SET_PDEATHSIG = 1
OVERTIME = 10.0  # s that the running test may go on after the time for all tests is used up


def main() -> None:
    """Grade jobs until stdin ends; then the grading that is going on ends too."""
    answers = os.dup(1)
    os.dup2(2, 1)  # whatever prints, prints to the log
    gc.freeze()
    for line in sys.stdin.buffer:
        child = os.fork()
        if not child:
            ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
            job = from_line(line)
            assert isinstance(job, Job), f"a worker is sent jobs, not {job}"
            run_suite(job, answers)
            os._exit(0)  # every thread is idle, and waiting for Fast DDS to leave costs time
        child_ended = os.pidfd_open(child)
        if child_ended not in select.select([child_ended, sys.stdin], [], [])[0]:
            break  # nobody waits for the result
        os.close(child_ended)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        if os.getpid() == 1:
            end_all_others()
        os.write(answers, to_line(Ended(status)))


def end_all_others() -> None:
    """Kill every process of this namespace but the first: whatever a grading has left running."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(-1, signal.SIGKILL)
    with contextlib.suppress(ChildProcessError):
        while True:
            os.wait()


def run_suite(job: Job, answers: int) -> None:
    """Run the hidden suite of one job; what comes of it goes to the descriptor `answers`."""

    def tell(message: Message) -> None:
        os.write(answers, to_line(message))

    autograder.hidden.__path__ = [job.hidden]
    exercise = load(job.exercise, Path(job.hidden))
    interfaces = Path(job.interfaces) if job.interfaces else None
    if interfaces:
        Built(exercise.package, interfaces).use()
    clock = Clock(exercise.time_limit * max(1.0, job.patience), job.patience)
    bench = Bench(job.files, Sandbox(job.box, job.files, interfaces), clock, job.seed)
    judge = Judge(bench, tell)
    logs: dict[str, str] = {}
    signal.signal(signal.SIGALRM, judge.interrupt)
    signal.setitimer(signal.ITIMER_REAL, clock.left + OVERTIME)
    suite = str(exercise.folder / "suite.py")
    options = ["-c", f"{job.hidden}/pytest.ini", "--rootdir", str(exercise.folder)]
    options += ["--assert=plain", "-q", "-p", "no:cacheprovider"]
    try:
        bench.begin(exercise.early)
        status = pytest.main([*options, suite], plugins=[judge, fixtures])
        logs = bench.logs()
    finally:
        bench.close()
    tell(Finished(int(status), judge.fault, logs))


if __name__ == "__main__":
    main()
