"""The plain records that pass between the roles of a grading, and the lines of JSON that carry them.

The coordinator reads submissions and writes results; a worker process runs the hidden suite of one submission at a
time.  No ROS here, and no decisions.
"""

import base64
import json
from dataclasses import asdict, dataclass, field, replace
from typing import Any, get_args, get_origin

# A test's outcome.  Only PASSED earns points.
PASSED = "passed"
FAILED = "failed"  # the student's program did something other than what the task says
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
KILLED_WORKERS = "killed_workers"  # given up, because workers died while they graded it
BUSY_MACHINE = "busy_machine"  # points were lost while all cores had long queues, and grading again has not helped
TIME_UNKNOWN = "time_unknown"  # nobody vouches for the time of the hand-in: nothing is taken off for lateness
KILLED_JUDGE = "killed_judge"  # the process that judges it died each time; the points are those of the tests before

MESSAGE, DETAIL = 3000, 4000  # characters of what a student and an instructor are told of a test

FAULT = "fault"  # the key in a report's details that says how the grader itself failed


# What was handed in, as the coordinator reads it.


@dataclass(frozen=True)
class Submission:
    """A student's submission: the files of the exercise, or why they were refused."""

    student: str
    assignment: str
    files: dict[str, bytes] = field(default_factory=dict)  # content by name
    problems: list[str] = field(default_factory=list)  # for the student; if there are any, the submission is invalid


# Coordinator to worker, through the worker's stdin.


@dataclass(frozen=True)
class Job:
    """Grade these files."""

    exercise: str  # its name
    hidden: dict[str, bytes]  # the suite: content by path below the folder that holds the exercise's folder
    files: dict[str, bytes]  # handed in; content by name
    seed: int  # what the hidden inputs are drawn from
    confinement: str  # how programs are confined: a key of `sandbox.sandbox.CONFINEMENTS`
    interfaces: str  # install prefix of the exercise's own interface package, or ""
    limit: float  # s after which the judging has failed
    core: int  # of the processor, for the programs, where this machine gives no control group
    patience: float = 1.0  # stretches every wait, for slow machines
    chosen: list[str] = field(default_factory=list)  # the only hidden tests to run; if empty, all


# From the process that judges, by way of the launcher: a Verdict for each test, and one Finished.


@dataclass(frozen=True)
class Verdict:
    """One test is done."""

    id: str  # the test function's name
    outcome: str  # one of OUTCOMES; anything but PASSED is the fault of the student's program
    message: str = ""  # for the student, in terms of the task; never a hidden input
    detail: str = ""  # for the instructor: the inputs, what was expected, what came

    def cut(self) -> "Verdict":
        """The same, as long as MESSAGE and DETAIL allow."""
        return replace(self, message=self.message[:MESSAGE], detail=self.detail[:DETAIL])


@dataclass(frozen=True)
class Finished:
    """The suite has run to its end.  Missing after a crash or a kill, which is the grader's fault."""

    exit_status: int  # pytest's own; it proves nothing, and helps to find a fault of the grader's
    fault: str  # how the grader itself failed, as a traceback; "" when it did not
    logs: dict[str, str]  # what each program printed, cleaned for the student, by file


# Worker to coordinator, through the worker's stdout.


@dataclass(frozen=True)
class Ended:
    """The process that judged has ended; the worker is ready for the next job."""

    status: int  # its exit status, or minus the signal that killed it
    said: str  # its Verdicts and its Finished, a line each, as they came: what it heard may have taken it over
    stopped: str = ""  # why it was ended
    busy: float = 0.0  # threads that could run meanwhile, for each core of the machine, on average


Message = Job | Verdict | Finished | Ended
MESSAGES: dict[str, type[Message]] = {kind.__name__: kind for kind in (Job, Verdict, Finished, Ended)}


def to_line(message: Message) -> bytes:
    """The message as one line of JSON that says which record it is."""
    fields = asdict(message)
    if isinstance(message, Job):
        for name in ("files", "hidden"):
            fields[name] = {key: base64.b64encode(content).decode() for key, content in fields[name].items()}
    return json.dumps({"record": type(message).__name__, **fields}).encode() + b"\n"


def from_line(line: bytes) -> Message:
    """The message in a line that `to_line` wrote; raises ValueError for anything else."""
    fields = json.loads(line)
    try:
        kind = MESSAGES[fields.pop("record")]
        if kind is Job:
            for name in ("files", "hidden"):
                fields[name] = {key: base64.b64decode(content) for key, content in fields[name].items()}
        message = kind(**fields)
        for name, annotation in kind.__annotations__.items():
            if not _fits(getattr(message, name), annotation):
                raise TypeError(f"{name} must be of type {annotation}")
        return message
    except (AttributeError, KeyError, TypeError) as error:
        raise ValueError(f"not a message between coordinator and worker ({error}): {line[:200]!r}") from None


def _fits(value: object, annotation: Any) -> bool:
    """Return True if a value is of a type that the records' fields have."""
    kind, parts = get_origin(annotation), get_args(annotation)
    if kind is dict:
        pairs = value.items() if isinstance(value, dict) else [(None, None)]
        return all(_fits(key, parts[0]) and _fits(content, parts[1]) for key, content in pairs)
    if kind is list:
        return isinstance(value, list) and all(_fits(item, parts[0]) for item in value)
    return isinstance(value, (int, float) if annotation is float else annotation)


# What grading a submission gives, as the coordinator writes it.


@dataclass(frozen=True)
class Result:
    """One hidden test's verdict on one submission."""

    id: str  # the test function's name
    title: str  # what the student reads
    outcome: str  # one of OUTCOMES
    points: float  # earned
    max_points: float
    message: str = ""  # for the student, in terms of the task; never a hidden input


@dataclass(frozen=True)
class Report:
    """One submission's grading: one line of results.jsonl."""

    student: str
    assignment: str
    status: str  # GRADED, INVALID_SUBMISSION or INFRASTRUCTURE_ERROR
    score: float | None  # None after an infrastructure error: there is no score, not a score of 0
    max_score: float
    seed: int  # what the hidden inputs were drawn from
    duration_s: float  # wall time, all tries together
    flags: list[str] = field(default_factory=list)  # "unsafe": graded without a sandbox
    tests: list[Result] = field(default_factory=list)
    logs: dict[str, str] = field(default_factory=dict)  # what each program printed, cleaned for the student, by file
    details: dict[str, str] = field(default_factory=dict)  # for the instructor alone: inputs, expected, got, by test

    @classmethod
    def from_fields(cls, fields: dict) -> "Report":
        """The record that `asdict` took apart."""
        return cls(**fields | {"tests": [Result(**test) for test in fields["tests"]]})

    def public(self) -> dict:
        """Return what may be written where a student could read it."""
        return {name: value for name, value in asdict(self).items() if name != "details"}
