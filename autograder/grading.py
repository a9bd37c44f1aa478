"""Grading one submission from end to end: a worker runs the hidden suite, its verdicts are checked, a report is made."""

import json
import logging
import os
import secrets
import subprocess
import sys
import tempfile
import threading
import time

from course.environment import prepare
from course.interfaces import build

from .exercises import Exercise, load
from .records import (
    CRASHED,
    FAILED,
    GRADED,
    INFRASTRUCTURE_ERROR,
    INVALID_SUBMISSION,
    NOT_RUN,
    PASSED,
    TIMED_OUT,
    Job,
    Report,
    Result,
    Submission,
    Verdict,
)
from .sandbox import BOXES, ros_variables

TRIES = 3
GRACE = 30.0  # s that a worker may take beyond what its tests may
DETAIL = 4000  # characters of what an instructor is told of a test
UNSAFE = "unsafe"  # the flag of what was graded without a sandbox

log = logging.getLogger("autograder")


class InfrastructureError(RuntimeError):
    """The grader failed: nothing is known of the submission."""


def grade(submission: Submission, box: str, seed: int | None = None, patience: float = 1.0) -> Report:
    """Grade a submission in `box` (see `sandbox.choose`).

    The hidden inputs are drawn from `seed`, or from a new one; `patience` stretches every wait.  A failure of the
    grader's own is tried again, and in the end reported as such; it never becomes a score.
    """
    exercise = load(submission.assignment)
    seed = secrets.randbits(32) if seed is None else seed
    start = time.monotonic()
    verdicts: dict[str, Verdict] = {}
    logs: dict[str, str] = {}
    if submission.problems:
        status = INVALID_SUBMISSION
        why = " ".join(submission.problems)
        verdicts = {test.id: Verdict(test.id, NOT_RUN, why) for test in exercise.tests}
    else:
        status = INFRASTRUCTURE_ERROR
        for attempt in range(1, TRIES + 1):
            try:
                verdicts, logs = judge(exercise, submission.files, box, seed, patience)
                status = GRADED
                break
            except InfrastructureError as error:
                log.warning("%s/%s, try %d of %d: the grader failed: %s", submission.student, submission.assignment,
                            attempt, TRIES, error)
    nothing = Verdict("", NOT_RUN, "The grader itself failed; this is no fault of yours, and will be graded again.")
    results = []
    for test in exercise.tests:
        verdict = verdicts.get(test.id, nothing)
        results.append(Result(test.id, test.title, verdict.outcome, test.points if verdict.outcome == PASSED else 0,
                              test.points, verdict.message))
    score = None if status == INFRASTRUCTURE_ERROR else sum(result.points for result in results)
    return Report(submission.student, submission.assignment, status, score, exercise.max_score, seed,
                  round(time.monotonic() - start, 3), [UNSAFE] if box == UNSAFE else [], results, logs,
                  {verdict.id: verdict.detail[:DETAIL] for verdict in verdicts.values() if verdict.detail})


def judge(exercise: Exercise, files: dict[str, bytes], box: str, seed: int, patience: float) -> tuple[dict, dict]:
    """The verdict of every hidden test, by its id, and what the programs printed, by file.

    Raises InfrastructureError when the verdicts are not all there.
    """
    prepare()
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTEST_", "ROS_DOMAIN"))}
    prefix = ""
    if exercise.package:
        built = build(exercise.package, exercise.interfaces, use=False)
        environment.update(built.variables(environment))
        prefix = str(built.prefix)
    environment.update(ros_variables(0, own_network=box != UNSAFE), PYTEST_DISABLE_PLUGIN_AUTOLOAD="1")
    job = Job(exercise.name, files, seed, box, prefix, patience)
    verdicts, end = _run_worker(job, environment, exercise.time_limit * max(1.0, patience) + GRACE)
    if end.get("fault"):
        raise InfrastructureError(end["fault"])
    expected = [test.id for test in exercise.tests]
    if sorted(verdict.id for verdict in verdicts) != sorted(expected):
        raise InfrastructureError(f"the verdicts {[verdict.id for verdict in verdicts]} are not those of {expected}")
    if strange := {verdict.outcome for verdict in verdicts} - {PASSED, FAILED, CRASHED, TIMED_OUT}:
        raise InfrastructureError(f"no outcomes of a test: {strange}")
    return {verdict.id: verdict for verdict in verdicts}, end.get("logs", {})


def _run_worker(job: Job, environment: dict[str, str], limit: float) -> tuple[list[Verdict], dict]:
    """Run a worker on `job`: its verdicts and its last word."""
    command = [*BOXES[job.box], sys.executable, "-P", "-m", "autograder.worker"]
    verdicts, end = [], None
    with tempfile.TemporaryFile() as words:
        worker = subprocess.Popen(command, env=environment, cwd="/", stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                  stderr=words, text=True)
        timer = threading.Timer(limit, worker.kill)
        timer.start()
        try:
            worker.stdin.write(job.to_line() + "\n")
            worker.stdin.close()
            for line in worker.stdout:
                record = json.loads(line)
                if "done" in record:
                    end = record
                else:
                    verdicts.append(Verdict(**record))
        except (BrokenPipeError, ValueError) as error:
            log.debug("worker: %s", error)
        finally:
            timer.cancel()
            worker.kill()
            worker.wait()
            worker.stdout.close()
        words.seek(0, os.SEEK_END)
        words.seek(max(0, words.tell() - 5000))
        said = words.read().decode(errors="replace")
    for verdict in verdicts:
        log.debug("%s: %s: %s [%s]", verdict.id, verdict.outcome, verdict.message, verdict.detail)
    log.debug("worker: %s", said)
    if end is None:
        raise InfrastructureError(f"the worker ended with status {worker.returncode} before all was judged:\n{said}")
    return verdicts, end
