"""nbgrader's configuration for this course: load it from a course folder's own `nbgrader_config.py`."""

c = get_config()  # noqa: F821  nbgrader's loader defines it

c.CourseDirectory.course_id = "ros2"
# A comment is a stub in Python and in a .srv alike: the program starts, and the checks say what it does not do yet.
c.ClearSolutions.code_stub = {"python": "# YOUR CODE HERE"}
