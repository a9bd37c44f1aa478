"""nbgrader's configuration for this course: load it from a course folder's own `nbgrader_config.py`."""

from nbgrader.preprocessors import AssignLatePenalties

from autograder.late import LatePolicy
from autograder.nbgrader_plugin import FeedbackPage, GradeInSandbox, HandedIn, NameCells

c = get_config()  # noqa: F821  nbgrader's loader defines it

c.CourseDirectory.course_id = "ros2"
# A comment is a stub in Python and in a .srv alike: the program starts, and the checks say what it does not do yet.
c.ClearSolutions.code_stub = {"python": "# YOUR CODE HERE"}

# The files handed in are graded in the sandbox; the notebook is shown to the instructor as handed in, and not run.
c.Autograde.exporter_class = HandedIn
c.Autograde.sanitize_preprocessors = []  # reading it with HandedIn leaves nothing that could do harm
c.Autograde.autograde_preprocessors = [NameCells, GradeInSandbox, AssignLatePenalties]
c.GenerateFeedback.exporter_class = FeedbackPage
c.GenerateFeedback.preprocessors = []

# No penalty for being late, unless the course's own file sets one: c.LatePolicy.percent_per_day and the others.
c.AssignLatePenalties.plugin_class = LatePolicy
