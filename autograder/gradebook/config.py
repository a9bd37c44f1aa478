"""nbgrader's configuration for this course; a course folder's own `nbgrader_config.py` calls `apply`."""

from nbgrader.preprocessors import AssignLatePenalties
from traitlets.config import Config

from autograder.gradebook.exchange_collect import RegularCollect
from autograder.gradebook.exchange_feedback import ReleaseFeedback
from autograder.gradebook.exchange_list import RegularList
from autograder.gradebook.exchange_release import WholeRelease
from autograder.gradebook.late import LatePolicy
from autograder.gradebook.plugins import FeedbackPage, GradeInSandbox, HandedInNotebook, NameCells
from course.foundation.cells import STUB


def apply(c: Config) -> None:
    """Make nbgrader grade with this package in the course that `c` configures; later settings override these."""
    c.CourseDirectory.course_id = "ros2"
    # The stub is a comment, in Python and in a .srv file: the program starts, and the checks say what is missing.
    c.ClearSolutions.code_stub = {"python": f"# {STUB}"}

    # The handed-in files are graded in the sandbox.  The instructor sees the notebook as handed in; it is never run.
    c.Autograde.exporter_class = HandedInNotebook
    c.Autograde.sanitize_preprocessors = []  # HandedInNotebook has made the notebook harmless
    c.Autograde.autograde_preprocessors = [NameCells, GradeInSandbox, AssignLatePenalties]
    c.GenerateFeedback.exporter_class = FeedbackPage
    c.GenerateFeedback.preprocessors = []
    c.GenerateFeedback.force = True  # a mark by hand changes no file by which nbgrader could see that a page is old

    # An exercise is in the exchange whole, or not at all.
    c.ExchangeFactory.release_assignment = WholeRelease

    # A folder in the exchange that cannot be collected, or is another student's, is named; the others are collected.
    c.ExchangeFactory.collect = RegularCollect
    c.ExchangeFactory.list = RegularList

    # Feedback goes out through the exchange to all whose hand-ins came through it; the others are named.
    c.ExchangeFactory.release_feedback = ReleaseFeedback

    # No late penalty unless the course's own file sets one: c.LatePolicy.percent_per_day and the other options.
    c.AssignLatePenalties.plugin_class = LatePolicy
