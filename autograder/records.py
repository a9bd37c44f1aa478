"""The plain records that pass between the coordinator, the worker that grades, and whoever reads the results.

No logic and no ROS here: everything can be written as JSON, a record a line.
"""

import base64
import json
from dataclasses import asdict, dataclass, field

# A test's outcome.  Only PASSED earns points.
PASSED = "passed"
FAILED = "failed"  # the student's program did something else than the task says
CRASHED = "crashed"  # the student's program died
TIMED_OUT = "timed_out"  # the student's program did not answer
NOT_RUN = "not_run"  # the submission could not be judged at all
OUTCOMES = (PASSED, FAILED, CRASHED, TIMED_OUT, NOT_RUN)

# A submission's status.
GRADED = "graded"
INVALID_SUBMISSION = "invalid_submission"  # the student's to mend: files missing or refused
INFRASTRUCTURE_ERROR = "infrastructure_error"  # ours: retried, and never a score


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
        """What may be written where a student could read it."""
        return {name: value for name, value in asdict(self).items() if name != "details"}


@dataclass(frozen=True)
class Mark:
    """What the instructor wrote to one of the notebook's cells."""

    cell: str
    points: float | None  # earned by hand; for a cell with hidden tests instead of theirs; None: only a comment
    max_points: float  # 0 for what only takes points off
    comment: str = ""
    waiting: bool = False  # still to be marked


@dataclass(frozen=True)
class Submission:
    """What a student handed in: the wanted files, or why they were refused."""

    student: str
    assignment: str
    files: dict[str, bytes] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)  # for the student; not empty: an invalid submission


@dataclass(frozen=True)
class Job:
    """Coordinator to worker: grade these files."""

    exercise: str
    hidden: str  # the folder that its folder is in
    files: dict[str, bytes]
    seed: int
    box: str  # how programs are confined: a name in `sandbox.BOXES`
    interfaces: str  # install prefix of the exercise's own interface package, or ""
    patience: float = 1.0  # stretches every wait, for slow machines

    def to_line(self) -> str:
        """As the line of JSON that `from_line` reads."""
        return json.dumps(asdict(self) | {"files": {k: base64.b64encode(v).decode() for k, v in self.files.items()}})

    @classmethod
    def from_line(cls, line: str) -> "Job":
        """The record in a line."""
        fields = json.loads(line)
        return cls(**fields | {"files": {k: base64.b64decode(v) for k, v in fields["files"].items()}})


@dataclass(frozen=True)
class Verdict:
    """Worker to coordinator: one test is done."""

    id: str
    outcome: str
    message: str = ""
    detail: str = ""  # for the instructor: the inputs, what was expected, what came
