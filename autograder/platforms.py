"""The learning platforms, in one table: their names for downloaded files, and how feedback and grades are imported.

`autograder collect` finds the student in a file's name, `autograder return` names and packs pages so that a platform
gives each to its student, and the exporters write the grades that a platform imports.  An archive of `course hand-in`
(`ada-calculator-20261102T093005Z.zip`, with a receipt inside) belongs to no platform.
"""

import re
from dataclasses import dataclass
from pathlib import PurePosixPath

FILES = "files"  # the form of pages that are returned one by one, each named after its student
TABLE = "csv"  # the form of grades for any program that reads a table
NUMBER = r"[0-9]{1,18}"


@dataclass(frozen=True)
class Platform:
    """A learning platform: its file names, and how feedback and grades are imported."""

    name: str

    # Collecting.
    download: re.Pattern[str]  # names in a bulk download: groups `name`, `user`, `file`, optional `late`, `upload`
    mark: re.Pattern[str]  # marks a name as this platform's; a name with two marks could mean two people
    trace: re.Pattern[str]  # a part that only this platform puts into names, even into those of another form
    folders: bool  # whether folders of a download have such names; otherwise only files do
    again: re.Pattern[str]  # the addition to the name of a file that was handed in again
    marks_late: bool  # whether it marks late files, so that unmarked ones are on time
    global_users: bool  # whether a user's number is the same in all downloads; otherwise in one only

    # Returning.
    page: str  # the name of a page in the archive that is returned
    upload: str  # where an instructor uploads that archive

    # Grades.
    grades: str  # the usual name of a file of grades
    columns: tuple[str, ...]  # that the import finds students by, the most usual first

    @property
    def form(self) -> str:
        """Return the platform's name on the command line and in file names."""
        return self.name.lower()


# Download, *Download Submissions*: `doejane_LATE_1234_5678_calculator.zip`, which is the name without spaces, the mark
# of a late hand-in, the user's number and the upload's; a file handed in again gets `-1`, `-2`, ... before its suffix.
# Return, *Upload Submissions* of an assignment that was downloaded: a zip archive of files called as those downloaded.
# It looks for two numbers between underscores, the student's and that of a file which the student has handed in
# (app/models/assignment.rb, `infer_comment_context_from_filename`); the rest of the name is free. Grades: Canvas
# Instructor Guide, "How do I import grades in the Gradebook?", and lib/gradebook_importer.rb.
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
    again=re.compile(r"(?!)"),  # never matches: Moodle replaces the file
    marks_late=False,
    global_users=False,
    page="{name}_{user}_assignsubmission_file_/{page}",
    upload="the assignment, Upload multiple feedback files in a zip",
    grades="moodle.csv",
    columns=("username", "email", "idnumber"),
)

LONGEST = 255  # bytes of a file's name

# The name of a student, or of a file, may look like a part that Canvas adds: `identify` compares with the roster.
ANOTHER_USER = re.compile(rf"(?=_({NUMBER})_{NUMBER}_.)", re.DOTALL)

PLATFORMS = {platform.name: platform for platform in (MOODLE, CANVAS)}


@dataclass(frozen=True)
class Origin:
    """The parts of a downloaded file's name: the platform's name for the student, and the file's own name."""

    names: tuple[str, ...]  # for the student, the number first: any of them may be in the roster
    file: str
    late: bool = False  # marked so by the platform
    platform: str = ""  # a key of PLATFORMS, or ""
    upload: int = 0  # the platform's number of the upload, which increases
    others: tuple[str, ...] = ()  # further users that the name could mean if it is divided differently


def origin(path: PurePosixPath) -> Origin | None:
    """Parse the path of a file in a bulk download; return None if it has no known form.

    Students choose the names of their files.  A name that could mean two people belongs to nobody; nor do files that
    somebody has unpacked from a student's upload into a folder of its name: theirs may be anybody's.
    """
    if any(len(part.encode(errors="replace")) > LONGEST for part in path.parts):
        return None  # no disk has kept it: somebody has written it into an archive
    for number, part in enumerate(path.parts):
        rest = path.parts[number + 1 :]
        possible = [platform for platform in PLATFORMS.values() if platform.folders or not rest]
        if rest and is_unpacked(part):
            return None
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
    """Return True if a platform has named this file or a folder around it, even without identifying a student."""
    *folders, file = path.parts
    return any(map(is_unpacked, folders)) or any(
        platform.trace.search(part)
        for platform in PLATFORMS.values()
        for part in (file, *(folders if platform.folders else ()))
    )


def is_unpacked(folder: str) -> bool:
    """Return True if a folder has the name that a platform gives to a student's file, and to no folder."""
    if any(platform.mark.search(folder) for platform in PLATFORMS.values() if platform.folders):
        return False
    return any(platform.download.fullmatch(folder) for platform in PLATFORMS.values() if not platform.folders)


def marks_late(platform: str) -> bool:
    """Return True if this platform marks late hand-ins."""
    return platform in PLATFORMS and PLATFORMS[platform].marks_late


def users_are_global(platform: str) -> bool:
    """Return True if different user numbers on this platform always mean different people, across downloads."""
    return platform in PLATFORMS and PLATFORMS[platform].global_users


def instruction(form: str) -> str:
    """Return how an instructor returns pages of this form (a platform's form, or FILES)."""
    for platform in PLATFORMS.values():
        if platform.form == form:
            return f"upload it in {platform.name}: {platform.upload}"
    return "send each to the student whose name it has"
