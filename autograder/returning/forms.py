"""The names and archives in which pages are returned, so that they find their way back.

Canvas, *Upload Submissions* of an assignment that was downloaded: a zip archive of files called as those downloaded.
It looks for two numbers between underscores, the student's and that of a file which the student has handed in
(app/models/assignment.rb, `infer_comment_context_from_filename`); the rest of the name is free.
Moodle, *Upload multiple feedback files in a zip*: a folder for each student, called as in the download, with the
student's name and number (mod/assign/feedback/file/importziplib.php); older and newer versions take the same form.
What came as an archive of `course hand-in` goes back as a page that is called as the student.
"""

from dataclasses import dataclass

from autograder.collecting.provenance import Source

CANVAS, MOODLE, FILES = "canvas", "moodle", "files"
HOW = {
    CANVAS: "upload it in Canvas: the assignment, Upload Submissions",
    MOODLE: "upload it in Moodle: the assignment, Upload multiple feedback files in a zip",
    FILES: "send each to the student whose name it has",
}


@dataclass(frozen=True)
class Way:
    """The way in which one page goes back."""

    form: str  # CANVAS, MOODLE or FILES
    name: str  # of the page: in the archive, or in the folder


def way(student: str, assignment: str, came: list[Source], form: str | None) -> Way:
    """Return how the page of a submission goes back: in `form`, or else the way that it came.

    `came` is what is remembered, the last one what was graded.  Raises LookupError, which says why there is no way.
    """
    page = f"{assignment}-feedback.html"
    known = [source for source in came if source.platform]
    if form == FILES or (form is None and not known):
        return Way(FILES, f"{student}-{page}")
    if not known or form not in (None, known[-1].platform.lower()):
        raise LookupError(f"it did not come from {str(form).capitalize()}: --for files makes a page of it")
    last = known[-1]
    people = sorted({source.user for source in known if source.platform == last.platform})
    if len(people) > 1:
        raise LookupError(
            f"it was handed in by {' and '.join(people)} of {last.platform}: return this page by hand, --for files"
        )
    if last.platform.lower() == MOODLE:
        return Way(MOODLE, f"{last.name}_{last.user}_assignsubmission_file_/{page}")
    late = "LATE_" if last.late else ""
    return Way(CANVAS, f"{last.name}_{late}{last.user}_{last.upload}_{page}")
