"""Late penalties: nbgrader's late-submission plug-in with a policy that a course sets in its `nbgrader_config.py`.

    c.LatePolicy.percent_per_day = 10                  # of the score, for each day begun after the due date
    c.LatePolicy.grace_days = 1                        # the first day of each assignment costs nothing
    c.LatePolicy.extensions = {"ada": 3, "bob": {"calculator": "2026-05-08 23:59 UTC"}}

`autograder extend` gives extensions, too (`extensions`).  With none of these set there is no penalty.  nbgrader takes
the due date from the gradebook (Formgrader sets it) and the time of handing in from `timestamp.txt` in the submission's
folder, and calls the plug-in in its step AssignLatePenalties (nbgrader, user guide, "Configuring late submission
plugin").  `autograder grade` runs the same step, so both ways give the same penalty.  nbgrader does not run it again
after manual grading; the exporters do.
"""

import logging
import math
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from nbformat.v4 import new_notebook
from nbgrader.api import SubmittedAssignment
from nbgrader.plugins import LateSubmissionPlugin
from nbgrader.utils import parse_utc
from traitlets import Bunch, Dict, Enum, Float, Integer, TraitError, validate
from traitlets.config import Config, PyFileConfigLoader

from autograder.errors import UnknownTime, UsageError
from autograder.gradebook import address, course_folder, extensions
from autograder.submissions import provenance, reading

DAY = 86_400  # s
POLICY = "AssignLatePenalties.plugin_class"  # set where a course has a policy
log = logging.getLogger(__name__)
quiet = logging.getLogger(f"{__name__}.nbgrader")  # nbgrader logs three warnings for every late submission
quiet.setLevel(logging.ERROR)


class LatePolicy(LateSubmissionPlugin):
    """The rule for how many points a late submission loses.

    Days are counted from the due date, moved by the student's extension and by `grace_days`: days that have begun
    (`count = "started"`), or whole days ("whole").  The student's `grace_budget` covers the first days, assignment by
    assignment in the order of due dates.  Each further day costs `percent_per_day`, in total at most `cap` percent, and
    never more than the score.  nbgrader's own `penalty_method = "zero"` takes the whole score instead.
    """

    percent_per_day = Float(0, min=0, max=100, help="The penalty for each day, in percent.").tag(config=True)
    percent_of = Enum(
        ("score", "max_score"), "score", help="The base of percentages: the score or the maximum score."
    ).tag(config=True)
    cap = Float(100, min=0, max=100, help="The largest penalty, in percent.").tag(config=True)
    count = Enum(
        ("started", "whole"), "started", help="The days that count: those that have started, or only whole ones."
    ).tag(config=True)
    grace_days = Float(0, min=0, help="Days after the due date without a penalty, for each assignment.").tag(
        config=True
    )
    grace_budget = Integer(0, min=0, help="Days without a penalty, for all assignments of a student together.").tag(
        config=True
    )
    extensions = Dict(
        help="The extension of each student, in days or as a new due date; or one for each assignment."
    ).tag(config=True)

    @validate("extensions")
    def _check_extensions(self, proposal: Bunch) -> dict[str, Any]:
        for student, given in proposal["value"].items():
            for extension in given.values() if isinstance(given, dict) else [given]:
                try:
                    _put_off(datetime(2000, 1, 1), extension)
                except (ValueError, TypeError, OverflowError, AttributeError):
                    raise TraitError(
                        f"LatePolicy.extensions: {student!r} has {extension!r}, which is neither a number "
                        "of days nor a time such as '2026-05-08 23:59 UTC'"
                    ) from None
        return dict(proposal["value"])

    def late_submission_penalty(self, student_id: str, score: float, total_seconds_late: float) -> float | None:
        """Return the points that a notebook loses, or None; called by its parent, nbgrader's AssignLatePenalties."""
        step = self.parent
        late = step.gradebook.find_submission(step.assignment_id, student_id)
        notebook = step.gradebook.find_submission_notebook(step.notebook_id, step.assignment_id, student_id)
        days = self.charged_days(late)
        if days and self.penalty_method == "zero":
            return score
        return self.points(days, score, notebook.max_score) or None

    def points(self, days: int, score: float, max_score: float) -> float:
        """Return the points that `days` days cost: from 0 to the score, rounded to hundredths as in gradebooks."""
        percent = min(self.cap, days * self.percent_per_day)
        lost = percent / 100 * (score if self.percent_of == "score" else max_score)
        return max(0.0, min(round(lost, 2), score))

    def charged_days(self, late: SubmittedAssignment) -> int:
        """Return the days that cost points, after the grace budget has covered work in the order of due dates."""
        left = self.grace_budget
        dated = [other for other in late.student.submissions if other.timestamp and other.assignment.duedate]
        for other in sorted(dated, key=lambda other: (other.assignment.duedate, other.name)):
            days = self.days(other)
            paid = min(left, days)
            left -= paid
            if other is late:
                return days - paid
        return 0

    def days(self, late: SubmittedAssignment) -> int:
        """Return the days by which a submission is late, after extension and grace days."""
        seconds = max(0.0, self.seconds(late) - self.grace_days * DAY)
        return math.ceil(seconds / DAY) if self.count == "started" else int(seconds // DAY)

    def seconds(self, late: SubmittedAssignment) -> float:
        """Return the time (s) from the due date, moved by the student's extension, to handing in; 0 if in time."""
        due = self.moved(late.duedate, late.student.id, late.name)  # already includes nbgrader's own extension
        return max(0.0, (late.timestamp - due).total_seconds())

    def moved(self, time: datetime, student: str, assignment: str) -> datetime:
        """Return when an assignment is due, or ends, for a student, given the time for everybody; both in UTC."""
        given = self.extensions.get(student, 0)
        configured = given.get(assignment, 0) if isinstance(given, dict) else given
        commanded = extensions.of(extensions.read(self.course), student, assignment)
        return max(_put_off(time, extension) for extension in (configured, *commanded))

    @property
    def course(self) -> Path:
        """Return the course folder: the configured one, or the working folder, in which nbgrader's commands run."""
        return Path(self.config.CourseDirectory.get("root", "."))


def _put_off(due: datetime, extension: float | str | datetime) -> datetime:
    """Return the due date moved by some days, or to a time, but never to an earlier one."""
    if isinstance(extension, (str, datetime)):
        return max(due, parse_utc(extension))
    return due + max(timedelta(0), timedelta(days=extension))


def timestamp(submitted: Path, student: str, assignment: str) -> dict[str, datetime | None]:
    """Return the time of handing in (UTC) as an argument for the gradebook: {"timestamp": a time or None}, or {}.

    It is read from the file that nbgrader puts into the submission's folder.  Without that file the gradebook keeps its
    time, unless the submission was collected and its time is unknown.
    """
    try:
        at = reading.handed_in_at(submitted / student / assignment)
    except UnknownTime as error:
        who = f"{student}/{assignment}"
        log.warning("%s: the time of handing in is unknown, so no late penalty is deducted: %s", who, error)
        return {}
    unvouched = provenance.time_of(submitted, student, assignment) in (provenance.ON_TIME, provenance.UNKNOWN)
    return {"timestamp": at} if at or unvouched else {}


def course_config(submitted: Path) -> Config | None:
    """Return the configuration of the nbgrader course that contains a folder of submissions; None if there is none.

    It is run as `course_folder.around` says.  Raises UsageError when it cannot be loaded, or sets an invalid value, or
    the folder cannot be nbgrader's.
    """
    folder = course_folder.around(submitted)
    if not folder:
        return None
    address.expect_usable(folder)
    try:
        config = PyFileConfigLoader(course_folder.CONFIGURATION, path=str(folder)).load_config()
        LatePolicy(config=config)  # reports a mistake before anything is graded
        extensions.read(folder)
    except TraitError as error:
        raise UsageError(f"{folder / course_folder.CONFIGURATION}: {error}") from None
    except UsageError:
        raise
    except Exception as error:  # the configuration is a program, and may raise anything
        raise UsageError(f"{folder / course_folder.CONFIGURATION} cannot be loaded: {error!r}") from error
    config.CourseDirectory.root = str(folder)
    return config


def lateness(config: Config | None, handed_in: SubmittedAssignment) -> float:
    """Return by how much (s) a submission is late, with the extensions of the course that `config` is of, if any."""
    late = float(handed_in.total_seconds_late)
    return LatePolicy(config=config).seconds(handed_in) if late and config and POLICY in config else late


def concerned(handed_in: SubmittedAssignment) -> bool:
    """Return True if the submission has a penalty, or should have one."""
    return bool(handed_in.total_seconds_late or handed_in.late_submission_penalty)


def assign(config: Config, url: str, assignment: str, notebook: str, student: str) -> None:
    """Write the late penalty of a submission's notebook, as nbgrader's autograde does."""
    from nbgrader.preprocessors import AssignLatePenalties  # loads nbconvert, which takes long

    step = AssignLatePenalties(config=config, log=quiet)
    step.preprocess(
        new_notebook(),
        {"nbgrader": {"assignment": assignment, "notebook": notebook, "student": student, "db_url": url}},
    )
