"""The learning platforms, in one table: what they call downloaded files, what they take back, and how grades go in.

`autograder collect` finds the student in a file's name, `autograder return` names and packs pages so that a platform
gives each to its student, and the exporters write the grades that a platform imports.  An archive of `course hand-in`
(`ada-calculator-20261102T093005Z.zip`, with a receipt inside) is of no platform.
"""

import re
from dataclasses import dataclass
from pathlib import PurePosixPath

FILES = "files"  # the form of pages that go back one by one, each called as its student
TABLE = "csv"  # the form of grades for anything that reads a table
NUMBER = r"[0-9]{1,18}"


@dataclass(frozen=True)
class Platform:
    """A learning platform: its names, what it takes back, and how grades go in."""

    name: str

    # Collecting.
    download: re.Pattern[str]  # names in a bulk download: groups `name`, `user`, `file`, perhaps `late`, `upload`
    mark: re.Pattern[str]  # what makes a name this platform's; a name with two marks could be of two people
    trace: re.Pattern[str]  # what only this platform puts into names, also into one that has no such form
    folders: bool  # whether folders of a download have such names; otherwise files alone
    again: re.Pattern[str]  # what the platform adds to the name of a file that was handed in again
    marks_late: bool  # whether it marks what is late, so that what it has not marked is on time
    global_users: bool  # whether a user's number is the same in each download; otherwise in one alone

    # Returning.
    page: str  # the name of a page in the archive that goes back
    upload: str  # where an instructor uploads that archive

    # Grades.
    grades: str  # the usual name of a file of grades
    columns: tuple[str, ...]  # by which the import finds students, the most usual first

    @property
    def form(self) -> str:
        """Its name on the command line and in file names."""
        return self.name.lower()


# Download, *Download Submissions*: `doejane_LATE_1234_5678_calculator.zip`, which is the name without spaces, the mark
# of a late one, the user's number and the upload's; a file handed in again gets `-1`, `-2`, ... before its suffix.
# Return, *Upload Submissions* of an assignment that was downloaded: a zip archive of files called as those downloaded.
# It looks for two numbers between underscores, the student's and that of a file which the student has handed in
# (app/models/assignment.rb, `infer_comment_context_from_filename`); the rest of the name is free.
# Grades: Canvas Instructor Guide, "How do I import grades in the Gradebook?", and lib/gradebook_importer.rb.
CANVAS_NAME = rf"(?P<name>[^/]+?)_(?:(?P<late>LATE)_)?(?P<user>{NUMBER})_(?P<upload>{NUMBER})_(?P<file>.+)"
CANVAS = Platform(
    name="Canvas",
    download=re.compile(CANVAS_NAME, re.DOTALL),
    mark=re.compile(rf"\A{CANVAS_NAME}\Z", re.DOTALL),
    trace=re.compile(rf"_{NUMBER}_{NUMBER}_"),
    folders=False,
    again=re.compile(r"-\d{1,3}(?=\.[A-Za-z]+$)"),
    marks_late=True,
    global_users=True,
    page="{name}_{late}{user}_{upload}_{page}",
    upload="the assignment, Upload Submissions",
    grades="canvas.csv",
    columns=("SIS User ID", "SIS Login ID", "ID"),
)

# Download, *Download all submissions*: a folder `Jane Doe_1234_assignsubmission_file_`, or the same before each file's
# name when folders are switched off; 1234 is the participant's number.
# Return, *Upload multiple feedback files in a zip*: a folder for each student, called as in the download, with the
# student's name and number (mod/assign/feedback/file/importziplib.php); older and newer versions take the same form.
# Grades: Moodle documentation, "Grade import", and grade/import/csv/classes/load_data.php.
MOODLE = Platform(
    name="Moodle",
    download=re.compile(rf"(?P<name>[^/]+)_(?P<user>{NUMBER})_assignsubmission_file_?(?P<file>.*)", re.DOTALL),
    mark=re.compile(rf"_{NUMBER}_assignsubmission_file"),
    trace=re.compile(rf"_{NUMBER}_assignsubmission_", re.IGNORECASE),
    folders=True,
    again=re.compile(r"(?!)"),  # it replaces the file, and adds nothing
    marks_late=False,
    global_users=False,
    page="{name}_{user}_assignsubmission_file_/{page}",
    upload="the assignment, Upload multiple feedback files in a zip",
    grades="moodle.csv",
    columns=("username", "email", "idnumber"),
)

# What somebody calls themselves, or a file, may look like what Canvas adds: `identify` asks whose it is.
ANOTHER_USER = re.compile(rf"(?=_({NUMBER})_{NUMBER}_.)", re.DOTALL)

PLATFORMS = {platform.name: platform for platform in (MOODLE, CANVAS)}


@dataclass(frozen=True)
class Origin:
    """The content of a file's name: who handed it in, as the platform calls them, and the file's own name."""

    names: tuple[str, ...]  # of the student, the number first: any of them may be in the roster
    file: str
    late: bool = False  # marked so by the platform
    platform: str = ""  # a key of PLATFORMS, or ""
    upload: int = 0  # the platform's number of it, which grows
    others: tuple[str, ...] = ()  # further users that the name could be of, if it is divided elsewhere


def origin(path: PurePosixPath) -> Origin | None:
    """Return what the path of a file in a bulk download tells; None when it is of no known form.

    Students choose how their files are called.  A name that could be of two people is nobody's.
    """
    for number, part in enumerate(path.parts):
        rest = path.parts[number + 1 :]
        possible = [platform for platform in PLATFORMS.values() if platform.folders or not rest]
        if sum(len(platform.mark.findall(part)) for platform in possible) > 1:
            return None
        for platform in possible:
            if found := platform.download.fullmatch(part):
                said = found.groupdict()
                own = platform.again.sub("", rest[-1] if rest else said["file"])
                late, upload = bool(said.get("late")), int(said.get("upload") or 0)
                others = tuple(sorted({each[1] for each in ANOTHER_USER.finditer(part)} - {said["user"]}))
                names = said["user"], said["name"]
                return Origin(names, own, late, platform.name, upload, others) if own else None
    return None


def is_traced(path: PurePosixPath) -> bool:
    """Return True if a platform has named this file or a folder around it, whether or not the name tells a student."""
    *folders, file = path.parts
    return any(
        platform.trace.search(part)
        for platform in PLATFORMS.values()
        for part in (file, *(folders if platform.folders else ()))
    )


def marks_late(platform: str) -> bool:
    """Return True if this platform marks what was handed in late."""
    return platform in PLATFORMS and PLATFORMS[platform].marks_late


def users_are_global(platform: str) -> bool:
    """Return True if two numbers of users on this platform are two people, whatever downloads they are from."""
    return platform in PLATFORMS and PLATFORMS[platform].global_users


def instruction(form: str) -> str:
    """Return how an instructor gives pages of this form back: a platform's form, or FILES."""
    for platform in PLATFORMS.values():
        if platform.form == form:
            return f"upload it in {platform.name}: {platform.upload}"
    return "send each to the student whose name it has"
