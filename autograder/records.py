"""The records that are passed between the processes of a grading, as lines of JSON.

The coordinator reads submissions and writes results; a worker process runs the hidden suite of one submission at a
time.  This module uses no ROS and makes no decisions.
"""

import base64
import json
from dataclasses import asdict, dataclass, field, replace
from types import UnionType
from typing import Any, TypeVar, get_args, get_origin

# A test's outcome.  Only PASSED earns points.
PASSED = "passed"
FAILED = "failed"  # the student's program did something other than the task asks for
CRASHED = "crashed"  # the student's program died
TIMED_OUT = "timed_out"  # the student's program did not answer
NOT_RUN = "not_run"  # the submission could not be judged at all
OUTCOMES = (PASSED, FAILED, CRASHED, TIMED_OUT, NOT_RUN)

# A submission's status.
GRADED = "graded"
INVALID_SUBMISSION = "invalid_submission"  # the student's fault: files are missing or were refused
INFRASTRUCTURE_ERROR = "infrastructure_error"  # the grader's fault: tried again, and never a score

# A report's flags.
UNSAFE = "unsafe"  # graded without a sandbox
KILLED_WORKERS = "killed_workers"  # given up because workers died while grading it
BUSY_MACHINE = "busy_machine"  # points were lost while all cores had long run queues, and grading again did not help
TIME_UNKNOWN = "time_unknown"  # the time of the hand-in is not certain: no late penalty
STUB_OF = "stub_of:"  # before a file's name: it was not handed in, and the notebook's unsolved cell was graded
KILLED_JUDGE = "killed_judge"  # the judging process died at least once; what it had judged as lost stays lost

MESSAGE, DETAIL = 3000, 4000  # characters of a test's text for the student and for the instructor

FAULT = "fault"  # the key in a report's details for the grader's own failure


# A submission, as read by the coordinator.


@dataclass(frozen=True)
class Submission:
    """A student's submission: the files of the exercise, or why they were refused."""

    student: str
    assignment: str
    files: dict[str, bytes] = field(default_factory=dict)  # content by name
    problems: list[str] = field(default_factory=list)  # for the student; any problem makes the submission invalid
    stubs: list[str] = field(default_factory=list)  # names of files that were missing: the notebook's unsolved cells


# Coordinator to worker, through the worker's stdin.


@dataclass(frozen=True)
class Job:
    """Grade these files."""

    exercise: str  # its name
    hidden: dict[str, bytes]  # the suite: content by path below the folder that holds the exercise's folder
    files: dict[str, bytes]  # the handed-in files: content by name
    seed: int  # the seed of the hidden inputs
    confinement: str  # how programs are confined: a key of `sandbox.sandbox.CONFINEMENTS`
    interfaces: str  # install prefix of the exercise's own interface package, or ""
    limit: float  # s after which the judging has failed
    core: int  # the processor core for the programs, if this machine has no control groups
    patience: float = 1.0  # multiplies every wait, for slow machines
    chosen: list[str] = field(default_factory=list)  # the hidden tests to run; empty for all
    refused: dict[str, str] = field(default_factory=dict)  # handed-in files that are not run, and why, for the student


# From the judging process, through the launcher: a Verdict for each test, and one Finished.


@dataclass(frozen=True)
class Verdict:
    """The outcome of one finished test."""

    id: str  # the test function's name
    outcome: str  # one of OUTCOMES; any but PASSED is the fault of the student's program
    message: str = ""  # for the student, in terms of the task; never a hidden input
    detail: str = ""  # for the instructor: the inputs, the expected and the actual result
    certain: bool = False  # whether a busy machine cannot have caused it

    def cut(self) -> "Verdict":
        """Return the same verdict, cut to MESSAGE and DETAIL characters."""
        return replace(self, message=self.message[:MESSAGE], detail=self.detail[:DETAIL])


@dataclass(frozen=True)
class Finished:
    """The suite has run to its end.  Its absence after a crash or a kill counts as the grader's failure."""

    exit_status: int  # pytest's; it proves nothing, but helps to find faults of the grader
    fault: str  # the grader's own failure, as a traceback; "" for none
    logs: dict[str, str]  # what each program printed, cleaned for the student, by file


# Worker to coordinator, through the worker's stdout.


@dataclass(frozen=True)
class Ended:
    """The judging process has ended; the worker is ready for the next job."""

    status: int  # its exit status, or minus the signal that killed it
    said: str  # its Verdicts and its Finished, as received, one line each: it may have been taken over by a program
    stopped: str = ""  # why the launcher ended it
    suspects: list[str] = field(default_factory=list)  # handed-in files whose programs sent much, see `sandbox.traffic`
    busy: float = 0.0  # runnable threads per core of the machine, on average over the job
    used: float = 0.0  # s of the processor that the job took, with all its programs


Message = Job | Verdict | Finished | Ended
MESSAGES: dict[str, type[Message]] = {kind.__name__: kind for kind in (Job, Verdict, Finished, Ended)}


def to_line(message: Message) -> bytes:
    """Return the message as one line of JSON that includes the record's type."""
    fields = asdict(message)
    if isinstance(message, Job):
        for name in ("files", "hidden"):
            fields[name] = {key: base64.b64encode(content).decode() for key, content in fields[name].items()}
    return json.dumps({"record": type(message).__name__, **fields}).encode() + b"\n"


def from_line(line: bytes) -> Message:
    """Return the message in a line that `to_line` wrote; raises ValueError for anything else."""
    try:
        fields = json.loads(line)
        kind = MESSAGES[fields.pop("record")]
        if kind is Job:
            for name in ("files", "hidden"):
                fields[name] = {key: base64.b64decode(content) for key, content in fields[name].items()}
        return _checked(kind(**fields))
    except (AttributeError, KeyError, TypeError, RecursionError) as error:
        raise ValueError(f"not a message between coordinator and worker ({error}): {line[:200]!r}") from None


Record = TypeVar("Record")


def _checked(record: Record) -> Record:
    """Return the record; raises TypeError when a field has not the type of its annotation."""
    for name, annotation in type(record).__annotations__.items():
        if not _fits(getattr(record, name), annotation):
            raise TypeError(f"{name} must be of type {annotation}")
    return record


def _fits(value: object, annotation: Any) -> bool:
    """Return True if a value has the type of a field's annotation."""
    kind, parts = get_origin(annotation), get_args(annotation)
    if kind is UnionType:
        return any(_fits(value, part) for part in parts)
    if kind is dict:
        pairs = value.items() if isinstance(value, dict) else [(None, None)]
        return all(_fits(key, parts[0]) and _fits(content, parts[1]) for key, content in pairs)
    if kind is list:
        return isinstance(value, list) and all(_fits(item, parts[0]) for item in value)
    return isinstance(value, (int, float) if annotation is float else annotation)


# The results of grading a submission, as the coordinator writes them.


@dataclass(frozen=True)
class Result:
    """One hidden test's verdict on one submission."""

    id: str  # the test function's name
    title: str  # for the student
    outcome: str  # one of OUTCOMES
    points: float  # earned
    max_points: float
    message: str = ""  # for the student, in terms of the task; never a hidden input


@dataclass(frozen=True)
class Report:
    """The grading of one submission: one line of results.jsonl."""

    student: str
    assignment: str
    status: str  # GRADED, INVALID_SUBMISSION or INFRASTRUCTURE_ERROR
    score: float | None  # None after an infrastructure error: there is no score, not a score of 0
    max_score: float
    seed: int  # the seed of the hidden inputs
    duration_s: float  # wall time of all tries together
    flags: list[str] = field(default_factory=list)  # "unsafe": graded without a sandbox
    tests: list[Result] = field(default_factory=list)
    logs: dict[str, str] = field(default_factory=dict)  # what each program printed, cleaned for the student, by file
    details: dict[str, str] = field(default_factory=dict)  # by test, for the instructor only: inputs, expected, got

    @classmethod
    def from_fields(cls, fields: dict) -> "Report":
        """Return the report that `asdict` turned into a dict; raises ValueError for anything else."""
        try:
            report = _checked(cls(**fields | {"tests": [_checked(Result(**test)) for test in fields["tests"]]}))
        except (KeyError, TypeError) as error:
            raise ValueError(str(error)) from None
        if report.score is not None and not 0 <= report.score <= report.max_score:
            raise ValueError(f"a score of {report.score}")
        for name in (report.student, report.assignment):  # a page is written to FOLDER/STUDENT/ASSIGNMENT.html
            if name in ("", ".", "..") or "/" in name or "\0" in name:
                raise ValueError(f"{name!r} is not the name of a folder")
        return report

    def public(self) -> dict:
        """Return the parts that a student may read."""
        return {name: value for name, value in asdict(self).items() if name != "details"}
