"""nbgrader's configuration for this course; a course folder's own `nbgrader_config.py` calls `apply`."""

from nbgrader.preprocessors import AssignLatePenalties
from traitlets.config import Config

from autograder.gradebook.late import LatePolicy
from autograder.gradebook.plugins import FeedbackPage, GradeInSandbox, HandedInNotebook, NameCells


def apply(c: Config) -> None:
    """Make nbgrader grade with this package in the course that `c` configures; what is set afterwards wins."""
    c.CourseDirectory.course_id = "ros2"
    # A comment is a stub in Python and in a .srv file: the program starts, and the checks say what is still missing.
    c.ClearSolutions.code_stub = {"python": "# YOUR CODE HERE"}

    # The files handed in are graded in the sandbox.  The notebook is shown to the instructor as handed in, never run.
    c.Autograde.exporter_class = HandedInNotebook
    c.Autograde.sanitize_preprocessors = []  # what HandedInNotebook reads can do no harm
    c.Autograde.autograde_preprocessors = [NameCells, GradeInSandbox, AssignLatePenalties]
    c.GenerateFeedback.exporter_class = FeedbackPage
    c.GenerateFeedback.preprocessors = []

    # No penalty for being late, unless the course's own file sets one: c.LatePolicy.percent_per_day and the others.
    c.AssignLatePenalties.plugin_class = LatePolicy
