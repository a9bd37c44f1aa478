"""The process that grades one submission: `python -m autograder.worker`, in a network namespace of its own.

Reads a Job as JSON from stdin, runs the exercise's hidden suite, and writes a line of JSON to stdout for each Verdict
and one at the end.  It never imports what the student wrote.
"""

import ctypes
import json
import os
import signal
import sys
from dataclasses import asdict
from pathlib import Path

from . import exercises
from .faults import Clock
from .networks import set_up
from .records import Job, Verdict
from .sandbox import Sandbox
from .session import Grading

PR_SET_PDEATHSIG = 1


def main() -> None:
    """Grade what stdin says."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    results = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # whatever prints is log
    job = Job.from_line(sys.stdin.readline())
    if job.box != "unsafe":
        set_up()
    exercise = exercises.load(job.exercise)
    clock = Clock(exercise.time_limit * max(1.0, job.patience), job.patience)

    def report(verdict: Verdict) -> None:
        print(json.dumps(asdict(verdict)), file=results)

    sandbox = Sandbox(job.box, job.files, Path(job.interfaces) if job.interfaces else None)
    grading = Grading(job.files, sandbox, clock, job.seed)
    logs: dict[str, str] = {}
    try:
        grading.begin(exercise.early)
        import pytest

        from . import talk
        from .judge import Judge

        judge = Judge(grading, report)
        status = pytest.main(
            ["-c", str(exercises.HIDDEN / "pytest.ini"), "--rootdir", str(exercise.folder), "--assert=plain", "-q",
             "-p", "no:cacheprovider", str(exercise.folder / "suite.py")],
            plugins=[judge, talk])
        logs = grading.logs()
    finally:
        grading.close()
    print(json.dumps({"done": int(status), "fault": judge.fault, "logs": logs}), file=results)
    results.flush()
    os._exit(0)  # every thread is idle, and waiting for Fast DDS to leave costs time


if __name__ == "__main__":
    main()
