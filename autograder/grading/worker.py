"""The process that grades: `python -m autograder.grading.worker`, in network and process namespaces of its own.

Reads Jobs from stdin, a line of JSON each, and has a fork of itself grade each of them, so that ROS 2 and pytest are
loaded once.  The fork runs the exercise's hidden suite and writes a line of JSON to stdout for each Verdict and one
when it is done; then the server tells how the fork has ended.  What the student wrote is never imported.
"""

import contextlib
import ctypes
import gc
import json
import os
import select
import signal
import sys
from dataclasses import asdict
from pathlib import Path

import pytest

import autograder.hidden
from autograder.records import Job
from autograder.sandbox.box import Sandbox
from autograder.submissions.exercises import load
from autograder.suitekit import actions, fixtures, live, parameters, topics  # noqa: F401  what the suites are going to need
from autograder.suitekit.bench import Bench
from autograder.suitekit.clock import Clock
from autograder.suitekit.judge import Judge
from course.interfaces import Built

PR_SET_PDEATHSIG = 1
OVERTIME = 10.0  # s that a test may go on when the time is used up


def main() -> None:
    """Serve until stdin ends; a grading that is going on then ends too."""
    results = os.dup(1)
    os.dup2(2, 1)  # whatever prints is log
    gc.freeze()
    for line in sys.stdin.buffer:
        child = os.fork()
        if not child:
            ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
            grade(Job.from_line(line), results)
            os._exit(0)  # every thread is idle, and waiting for Fast DDS to leave costs time
        ended = os.pidfd_open(child)
        if ended not in select.select([ended, sys.stdin], [], [])[0]:
            break  # nobody waits for the result
        os.close(ended)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        if os.getpid() == 1:
            end_all_others()
        os.write(results, json.dumps({"status": status}).encode() + b"\n")


def end_all_others() -> None:
    """Kill what is left of a grading, whatever became of its parents: all but the first process of the namespace."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(-1, signal.SIGKILL)
    with contextlib.suppress(ChildProcessError):
        while True:
            os.wait()


def grade(job: Job, results: int) -> None:
    """Do one job, and write to the descriptor `results`."""

    def tell(fields: dict) -> None:
        os.write(results, json.dumps(fields).encode() + b"\n")

    autograder.hidden.__path__ = [job.hidden]
    exercise = load(job.exercise, Path(job.hidden))
    interfaces = Path(job.interfaces) if job.interfaces else None
    if interfaces:
        Built(exercise.package, interfaces).use()
    clock = Clock(exercise.time_limit * max(1.0, job.patience), job.patience)
    bench = Bench(job.files, Sandbox(job.box, job.files, interfaces), clock, job.seed)
    judge = Judge(bench, lambda verdict: tell(asdict(verdict)))
    logs: dict[str, str] = {}
    signal.signal(signal.SIGALRM, judge.interrupt)
    signal.setitimer(signal.ITIMER_REAL, clock.left + OVERTIME)
    try:
        bench.begin(exercise.early)
        status = pytest.main(
            [
                "-c",
                f"{job.hidden}/pytest.ini",
                "--rootdir",
                str(exercise.folder),
                "--assert=plain",
                "-q",
                "-p",
                "no:cacheprovider",
                str(exercise.folder / "suite.py"),
            ],
            plugins=[judge, fixtures],
        )
        logs = bench.logs()
    finally:
        bench.close()
    tell({"done": int(status), "fault": judge.fault, "logs": logs})


if __name__ == "__main__":
    main()
