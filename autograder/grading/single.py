"""Grading one submission from end to end: a worker runs the hidden suite, its verdicts are checked and reported."""

import logging
import secrets
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from autograder.errors import InfrastructureError, JudgeDied
from autograder.grading import admission
from autograder.grading.worker import worker
from autograder.records import (
    BUSY_MACHINE,
    CRASHED,
    DETAIL,
    FAILED,
    FAULT,
    GRADED,
    INFRASTRUCTURE_ERROR,
    INVALID_SUBMISSION,
    KILLED_JUDGE,
    NOT_RUN,
    PASSED,
    STUB_OF,
    TIMED_OUT,
    UNSAFE,
    Job,
    Report,
    Result,
    Submission,
    Verdict,
)
from autograder.sandbox import machine_load, processor_core
from autograder.sandbox.traffic import COUNTED, SUSPICIOUS
from autograder.submissions.exercises import Exercise, contents, load
from course.interfaces import build

TRIES = 3
CALM_TIMEOUT = 30.0  # s to wait for the machine to become less busy
GRACE = 30.0  # s that judging may take beyond the tests' time limit
BROUGHT_DOWN = (
    "Not judged: your files, or messages of your programs, crashed the grading process three times. "
    "Ask your instructor."
)

REFUSED = (
    "it was not run again, because the grading process died after it had sent more than "
    f"{SUSPICIOUS >> 20} MiB at once to other programs, {COUNTED}; send only what the task asks for"
)

log = logging.getLogger("autograder")


@dataclass(frozen=True)
class Judgement:
    """The outcome of one try to judge a submission."""

    status: str  # a report's
    verdicts: dict[str, Verdict] = field(default_factory=dict)  # by test
    logs: dict[str, str] = field(default_factory=dict)  # what each program printed, by file
    fault: str = ""  # the grader's own failure, if any
    flags: list[str] = field(default_factory=list)  # a report's
    busy: float = 0.0  # how busy the machine was, see `sandbox.machine_load`

    @property
    def passed(self) -> int:
        """Return the number of passed tests."""
        return sum(verdict.outcome == PASSED for verdict in self.verdicts.values())

    @property
    def in_doubt(self) -> bool:
        """Return True if a test failed while the machine was so busy that this may be the cause."""
        lost = (verdict for verdict in self.verdicts.values() if verdict.outcome != PASSED)
        return self.status == GRADED and self.busy > machine_load.STARVED and not all(each.certain for each in lost)


def grade(
    submission: Submission,
    confinement: str,
    seed: int | None = None,
    patience: float = 1.0,
    exercise: Exercise | None = None,
) -> Report:
    """Grade a submission of `exercise` (by default this installation's) in `confinement`, see `sandbox.sandbox.choose`.

    The hidden inputs are drawn from `seed`, or from a new one; `patience` multiplies every wait.  When the grader
    itself fails, it tries again; its last failure is reported as such, never as a score.  Raises ValueError when
    `exercise` is only a part of one.
    """
    exercise = exercise or load(submission.assignment)
    if not exercise.whole:
        raise ValueError(f"{exercise.name}: a grade needs all hidden tests")
    seed = secrets.randbits(32) if seed is None else seed
    start = time.monotonic()
    if submission.problems:
        why = " ".join(submission.problems)
        verdicts = {test.id: Verdict(test.id, NOT_RUN, why) for test in exercise.tests}
        judgement = Judgement(INVALID_SUBMISSION, verdicts)
    else:
        judgement = _judge_calmly(submission, exercise, confinement, seed, patience)
    flags = [*judgement.flags, *([UNSAFE] if confinement == UNSAFE else [])]
    flags += [STUB_OF + name for name in submission.stubs]
    return _report(submission, exercise, seed, judgement, flags, time.monotonic() - start)


def given_up(submission: Submission, exercise: Exercise, seed: int, flag: str) -> Report:
    """Return the report on a submission that could not be graded, for the reason in `flag`."""
    return _report(submission, exercise, seed, Judgement(INFRASTRUCTURE_ERROR), [flag], 0.0)


def _judge_calmly(
    submission: Submission, exercise: Exercise, confinement: str, seed: int, patience: float
) -> Judgement:
    """Judge the submission; judge it again, with the same inputs, while a busy machine may have cost points."""
    faults: list[InfrastructureError] = []
    judgement = _try(submission, exercise, confinement, seed, patience, faults)
    for number in range(2, TRIES + 1):
        if not judgement.in_doubt:
            break
        lost = len(judgement.verdicts) - judgement.passed
        log.info(
            "%s/%s: %d tests not passed while the machine was busy (%.0f threads waited for each core): waiting up to "
            "%.0f s until it is calm, then judging again, %d of %d at most",
            *(submission.student, submission.assignment, lost, judgement.busy, CALM_TIMEOUT, number, TRIES),
        )
        machine_load.wait_for_calm(CALM_TIMEOUT)
        again = _with(_certain(judgement), _try(submission, exercise, confinement, seed, patience, faults))
        if again.status == GRADED and (again.passed >= judgement.passed or not again.in_doubt):
            judgement = again
    flags = [*([KILLED_JUDGE] if _deaths(faults) else []), *([BUSY_MACHINE] if judgement.in_doubt else [])]
    return replace(judgement, fault=judgement.fault or "\n".join(map(str, faults[-1:])), flags=flags)


def _try(
    submission: Submission,
    exercise: Exercise,
    confinement: str,
    seed: int,
    patience: float,
    faults: list[InfrastructureError],
) -> Judgement:
    """Judge the submission; when the grader fails, try again, up to TRIES times in all.

    `faults` are the grader's failures so far; more are added to them.
    """
    before = len(faults)
    for attempt in range(1, TRIES + 1):
        try:
            refused = {file: REFUSED for death in _deaths(faults) for file in death.suspects}
            return _at_most(judge(exercise, submission.files, confinement, seed, patience, refused), faults)
        except InfrastructureError as error:
            faults.append(error)
            fault = str(error)
            log.warning(
                "%s/%s, try %d of %d: the grader failed: %s",
                submission.student,
                submission.assignment,
                attempt,
                TRIES,
                (fault.strip().splitlines() or ["?"])[-1],
            )
    if len(_deaths(faults[before:])) == TRIES:
        return _judgement_without_judge(exercise, _deaths(faults))
    return Judgement(INFRASTRUCTURE_ERROR, fault=str(faults[-1]))


def _deaths(faults: list[InfrastructureError]) -> list[JudgeDied]:
    """Return those of the grader's failures that were deaths of the judging process."""
    return [fault for fault in faults if isinstance(fault, JudgeDied)]


def _judgement_without_judge(exercise: Exercise, deaths: list[JudgeDied]) -> Judgement:
    """Return the judgement of a submission that killed the judging process at each try, which is held against it.

    The verdicts of the try that came furthest are kept.
    """
    known = {test.id for test in exercise.tests}
    furthest = max(deaths, key=lambda death: len(death.verdicts))
    verdicts = {test: Verdict(test, NOT_RUN, BROUGHT_DOWN) for test in known}
    verdicts |= {verdict.id: verdict for verdict in furthest.verdicts if verdict.id in known}
    return _at_most(Judgement(GRADED, verdicts, fault=str(furthest)), deaths)


def _at_most(judgement: Judgement, faults: Sequence[InfrastructureError]) -> Judgement:
    """Return the judgement with what was lost before the grader failed: a program must gain nothing by that.

    What was lost on a busy machine does not count: it may not be the program's fault.
    """
    calm = [fault for fault in faults if fault.busy <= machine_load.STARVED]
    return _with([verdict for fault in calm for verdict in fault.verdicts if verdict.outcome != PASSED], judgement)


def _certain(judgement: Judgement) -> list[Verdict]:
    """Return what was lost, and not because the machine was busy: another try must not win it back."""
    return [verdict for verdict in judgement.verdicts.values() if verdict.outcome != PASSED and verdict.certain]


def _with(lost: list[Verdict], judgement: Judgement) -> Judgement:
    """Return the judgement with these verdicts instead of its own on the same tests."""
    known = {verdict.id: verdict for verdict in lost if verdict.id in judgement.verdicts}
    return replace(judgement, verdicts=judgement.verdicts | known)


def judge(
    exercise: Exercise,
    files: dict[str, bytes],
    confinement: str,
    seed: int,
    patience: float,
    refused: dict[str, str] | None = None,
) -> Judgement:
    """Run the hidden suite once, or only the tests in a part of the exercise (see `Exercise.part`).

    The files in `refused` are not run, see `Job`.  Raises InfrastructureError unless each of these tests has exactly
    one verdict, and no other test has any.
    """
    prefix = ""
    if exercise.package:
        prefix = str(build(exercise.package, exercise.interfaces, use=False).prefix)
    limit = exercise.time_limit * max(1.0, patience) + GRACE
    expected = [test.id for test in exercise.tests]
    chosen = [] if exercise.whole else expected
    with processor_core.taken() as number, worker(confinement) as process:
        job = Job(
            *(exercise.name, contents(exercise), files, seed, confinement, prefix, limit, number, patience, chosen),
            refused=refused or {},
        )
        start = time.monotonic()
        answer = process.run(job)
        admission.learn(exercise.name, answer.used, time.monotonic() - start)
    if answer.finished.fault:
        raise InfrastructureError(answer.finished.fault, answer.verdicts, answer.busy)
    given = [verdict.id for verdict in answer.verdicts]
    if sorted(given) != sorted(expected):
        raise InfrastructureError(
            f"verdicts came on {given}, not on {expected}; pytest's exit status was {answer.finished.exit_status}"
        )
    if strange := {verdict.outcome for verdict in answer.verdicts} - {PASSED, FAILED, CRASHED, TIMED_OUT}:
        raise InfrastructureError(f"unknown outcome of a test: {', '.join(sorted(strange))}")
    return Judgement(
        GRADED, {verdict.id: verdict for verdict in answer.verdicts}, answer.finished.logs, busy=answer.busy
    )


def _report(
    submission: Submission, exercise: Exercise, seed: int, judgement: Judgement, flags: list[str], duration: float
) -> Report:
    nothing = Verdict("", NOT_RUN, "The grader failed. Your work is safe and will be graded again.")
    results = []
    for test in exercise.tests:
        verdict = judgement.verdicts.get(test.id, nothing)
        earned = test.points if verdict.outcome == PASSED else 0
        results.append(Result(test.id, test.title, verdict.outcome, earned, test.points, verdict.message))
    details = {verdict.id: verdict.detail for verdict in judgement.verdicts.values() if verdict.detail}
    if judgement.fault:
        details[FAULT] = judgement.fault[-DETAIL:]
    failed = judgement.status == INFRASTRUCTURE_ERROR
    return Report(
        student=submission.student,
        assignment=submission.assignment,
        status=judgement.status,
        score=None if failed else sum(result.points for result in results),
        max_score=exercise.max_score,
        seed=seed,
        duration_s=round(duration, 3),
        flags=flags,
        tests=results,
        logs=judgement.logs,
        details=details,
    )
