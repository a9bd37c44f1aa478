"""Grading one submission from end to end: a worker runs the hidden suite, its verdicts are checked, a report is made."""

import atexit
import contextlib
import json
import logging
import os
import secrets
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator

from autograder.errors import InfrastructureError
from autograder.records import (
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
from autograder.sandbox.box import BOXES
from autograder.sandbox.variables import ros_variables
from autograder.submissions.exercises import Exercise, load
from course.environment import prepare
from course.interfaces import build

WORKER = f"{__package__}.worker"  # loads ROS 2 and pytest, which this process does not need
FAULT = "fault"  # the key of the details that tells how the grader itself failed
TRIES = 3
GRACE = 30.0  # s that a worker may take beyond what its tests may
WORDS = 5000  # bytes of a worker's own log that are shown when it fails
DETAIL = 4000  # characters of what an instructor is told of a test
UNSAFE = "unsafe"  # the flag of what was graded without a sandbox

log = logging.getLogger("autograder")


def grade(
    submission: Submission, box: str, seed: int | None = None, patience: float = 1.0, exercise: Exercise | None = None
) -> Report:
    """Grade a submission of `exercise` (by default this installation's) in `box` (see `sandbox.choose`).

    The hidden inputs are drawn from `seed`, or from a new one; `patience` stretches every wait.  A failure of the
    grader's own is tried again, and in the end reported as such; it never becomes a score.
    """
    exercise = exercise or load(submission.assignment)
    seed = secrets.randbits(32) if seed is None else seed
    start = time.monotonic()
    verdicts: dict[str, Verdict] = {}
    logs: dict[str, str] = {}
    details: dict[str, str] = {}
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
                details = {FAULT: str(error)[-DETAIL:]}
                log.warning(
                    "%s/%s, try %d of %d: the grader failed: %s",
                    submission.student,
                    submission.assignment,
                    attempt,
                    TRIES,
                    (str(error).strip().splitlines() or ["?"])[-1],
                )
    if status != INFRASTRUCTURE_ERROR:
        details = {verdict.id: verdict.detail[:DETAIL] for verdict in verdicts.values() if verdict.detail}
    return _report(
        submission,
        exercise,
        status,
        seed,
        verdicts,
        [UNSAFE] if box == UNSAFE else [],
        logs,
        details,
        time.monotonic() - start,
    )


def given_up(submission: Submission, exercise: Exercise, seed: int, flag: str) -> Report:
    """The report on a submission that could not be graded for a reason that `flag` names."""
    return _report(submission, exercise, INFRASTRUCTURE_ERROR, seed, {}, [flag], {}, {}, 0.0)


def _report(
    submission: Submission,
    exercise: Exercise,
    status: str,
    seed: int,
    verdicts: dict[str, Verdict],
    flags: list[str],
    logs: dict[str, str],
    details: dict[str, str],
    duration: float,
) -> Report:
    nothing = Verdict("", NOT_RUN, "The grader itself failed; this is no fault of yours, and will be graded again.")
    results = []
    for test in exercise.tests:
        verdict = verdicts.get(test.id, nothing)
        results.append(
            Result(
                test.id,
                test.title,
                verdict.outcome,
                test.points if verdict.outcome == PASSED else 0,
                test.points,
                verdict.message,
            )
        )
    score = None if status == INFRASTRUCTURE_ERROR else sum(result.points for result in results)
    return Report(
        submission.student,
        submission.assignment,
        status,
        score,
        exercise.max_score,
        seed,
        round(duration, 3),
        flags,
        results,
        logs,
        details,
    )


def judge(exercise: Exercise, files: dict[str, bytes], box: str, seed: int, patience: float) -> tuple[dict, dict]:
    """The verdict of every hidden test, by its id, and what the programs printed, by file.

    Raises InfrastructureError when the verdicts are not all there.
    """
    prefix = ""
    if exercise.package:
        prefix = str(build(exercise.package, exercise.interfaces, use=False).prefix)
    job = Job(exercise.name, str(exercise.folder.parent), files, seed, box, prefix, patience)
    with _worker(box) as worker:
        verdicts, end = worker.run(job, exercise.time_limit * max(1.0, patience) + GRACE)
    if end.get("fault"):
        raise InfrastructureError(end["fault"])
    expected = [test.id for test in exercise.tests]
    if sorted(verdict.id for verdict in verdicts) != sorted(expected):
        raise InfrastructureError(f"the verdicts {[verdict.id for verdict in verdicts]} are not those of {expected}")
    if strange := {verdict.outcome for verdict in verdicts} - {PASSED, FAILED, CRASHED, TIMED_OUT}:
        raise InfrastructureError(f"no outcomes of a test: {strange}")
    return {verdict.id: verdict for verdict in verdicts}, end.get("logs", {})


class _Worker:
    """A process that grades one submission at a time, see `worker`."""

    def __init__(self, box: str):
        prepare()
        environment = {
            name: value for name, value in os.environ.items() if not name.startswith(("PYTEST_", "ROS_DOMAIN"))
        }
        environment.update(ros_variables(0, own_network=box != UNSAFE), PYTEST_DISABLE_PLUGIN_AUTOLOAD="1")
        self._words = tempfile.TemporaryFile()  # noqa: SIM115  # closed with the worker
        self._process = subprocess.Popen(
            [*BOXES[box], sys.executable, "-P", "-m", WORKER],
            env=environment,
            cwd="/",
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._words,
            process_group=0,
        )  # Ctrl-C is for whoever asks it to grade

    def run(self, job: Job, limit: float) -> tuple[list[Verdict], dict]:
        """The verdicts on `job` and the grading's last word; raises InfrastructureError after `limit` s, or when it dies.

        Whatever it raises, the worker is of no more use.
        """
        self._words.seek(0)
        self._words.truncate()
        verdicts, end, status = [], None, None
        timer = threading.Timer(limit, self._process.kill)
        timer.start()
        try:
            self._process.stdin.write(job.to_line().encode() + b"\n")
            self._process.stdin.flush()
            for line in self._process.stdout:
                record = json.loads(line)
                if "status" in record:
                    status = record["status"]
                    break
                if "done" in record:
                    end = record
                else:
                    verdicts.append(Verdict(**record))
        except (BrokenPipeError, ValueError) as error:
            log.debug("worker: %s", error)
        finally:
            timer.cancel()
        size = os.fstat(self._words.fileno()).st_size
        said = os.pread(self._words.fileno(), WORDS, max(0, size - WORDS)).decode(errors="replace")
        for verdict in verdicts:
            log.debug("%s: %s: %s [%s]", verdict.id, verdict.outcome, verdict.message, verdict.detail)
        log.debug("worker: %s", said)
        if end is None or status != 0:
            raise InfrastructureError(f"the worker ended with status {status} before all was judged:\n{said}")
        return verdicts, end

    def close(self) -> None:
        """End it, and what it is doing."""
        self._process.kill()
        self._process.communicate()
        self._words.close()


_idle: dict[str, list[_Worker]] = {}  # by box


@contextlib.contextmanager
def _worker(box: str) -> Iterator[_Worker]:
    """A worker that is kept for the next submission when all went well."""
    idle = _idle.setdefault(box, [])
    try:
        worker = idle.pop()
    except IndexError:
        worker = _Worker(box)
    try:
        yield worker
    except BaseException:
        worker.close()
        raise
    idle.append(worker)


@atexit.register
def _close_idle() -> None:
    for workers in _idle.values():
        for worker in workers:
            worker.close()
