"""The files that the class works with: the released notebooks in each home folder, and nbgrader's exchange.

nbgrader runs only in the box of an instructor, who owns these files.
"""

import contextlib
import errno
import hashlib
import json
import math
import os
import subprocess
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from autograder.classroom import accounts, box, homes
from autograder.classroom.members import Member
from autograder.classroom.plan import COURSE_ID, WHOSE, Classroom
from autograder.errors import ClassroomError
from autograder.gradebook.release import START_PAGE, pages, start_page
from autograder.sandbox.memory_files import MemoryFiles
from course.foundation import storage
from course.foundation.untrusted import read_regular
from course.notebook.stubs import RELEASED

# The file modes that nbgrader asks for.  The sticky bit of `inbound` keeps students from removing what others have
# handed in; without the right to list the folder they cannot find it.
EXCHANGE = {"outbound": 0o2775, "inbound": 0o3773, "feedback": 0o2771}
MODULE = ("python", "-P", "-m")  # runs an installed module, whatever is in the working folder
ENROLLED = "enrolled.json"  # in `Classroom.state`: who is in the gradebook, and among the members
LONGEST = 300  # s that one command in a box may take
LEAST_ROOM = 4 << 20  # bytes, for the hub's database and its log
LONGEST_SECRET = 1000  # bytes; nbgrader's have some 70


def make_folders(classroom: Classroom) -> None:
    """Make the folders of the classroom, each open to those who need it."""
    for folder, mode in (
        (classroom.folder, 0o711),
        (classroom.homes, 0o711),
        (classroom.state, 0o700),
        (classroom.state / "servers", 0o700),
        (classroom.exchange, 0o755),
    ):
        folder.mkdir(parents=True, exist_ok=True)
        folder.chmod(mode)
    for folder, mode in (
        (classroom.run, 0o700),
        (classroom.run / "servers", 0o700),
        (classroom.hub_socket.parent, 0o755),
    ):
        folder.mkdir(parents=True, exist_ok=True)
        folder.chmod(mode)
    (classroom.run / WHOSE).write_text(str(classroom.folder))


def check_room(classroom: Classroom) -> None:
    """Raise ClassroomError when the disk is too full for a hub to start, before one that runs is ended."""
    known = os.statvfs(classroom.folder)
    if (free := known.f_bfree * known.f_frsize) < LEAST_ROOM:
        raise ClassroomError(
            f"the disk with {classroom.folder} is full: {free >> 10} KiB are left, and the class needs "
            f"{LEAST_ROOM >> 20} MiB to start. Nothing was changed: free some space, and give the command again"
        )


def close(classroom: Classroom) -> None:
    """Close the folders of a class whose users are removed: new users and groups may get their ids."""
    classroom.folder.chmod(0o700)


def make_shared(classroom: Classroom) -> None:
    """Make the folders that instructors share, and those of the exchange.  Raises ClassroomError."""
    staff = accounts.staff_id(classroom)
    classroom.grading.mkdir(exist_ok=True)
    former = classroom.grading.stat().st_gid  # the id of the instructors' group before `down` removed it
    if former != staff:
        for shared in (classroom.grading, classroom.exchange):
            homes.hand_on(shared, int, lambda gid: staff if gid == former else gid)
    os.chown(classroom.grading, 0, staff)
    classroom.grading.chmod(0o2770)
    course = classroom.exchange / COURSE_ID
    course.mkdir(exist_ok=True)
    opened = os.open(course, homes.FOLDER)
    try:
        os.fchown(opened, 0, 0)
        os.fchmod(opened, 0o755)
        for name, mode in EXCHANGE.items():
            with contextlib.suppress(FileExistsError):
                os.mkdir(name, dir_fd=opened)
            _share(opened, name, staff, mode)
    except OSError as error:
        raise ClassroomError(f"{course / name}: {error.strerror}; move it away, and give the command again") from None
    finally:
        os.close(opened)
    # The files of former instructors, released or graded, go to a present one.
    owners = [accounts.ids(classroom, member)[0] for member in classroom.instructors]
    for shared in (classroom.grading, course / "outbound", course / "feedback"):
        homes.hand_on(shared, lambda uid: uid if uid in (0, *owners) else owners[0])
    for member in classroom.instructors:  # as a mount point: making the box would create it as root
        homes.make_folder(classroom.home(member), *accounts.ids(classroom, member), box.GRADING)


def released(classroom: Classroom) -> set[str]:
    """Return the exercises that are in the exchange."""
    return {PurePosixPath(path).parts[0] for path in _outbound(classroom)}


def release(classroom: Classroom, wanted: Iterable[str]) -> list[str]:
    """Release the notebooks that are not yet in the exchange; return their names.

    Also sets up nbgrader's course folder if it is missing.
    """
    there = released(classroom)
    new = [name for name in wanted if name not in there]
    if new or not (classroom.grading / "nbgrader_config.py").exists():
        run(classroom, classroom.instructors[0], [*MODULE, "autograder.classroom.releasing", box.GRADING, *new])
    return new


def judged(classroom: Classroom) -> tuple[dict[str, set[str]], dict[str, set[str]]]:
    """Return the students whose hand-in is graded, and those whose page is in the exchange, both by exercise.

    Found in an instructor's files, which are read as that user.  Raises ClassroomError.
    """
    uid, gid = accounts.ids(classroom, classroom.instructors[0])
    pages = os.open(classroom.exchange / COURSE_ID / "feedback", homes.FOLDER)
    try:
        answer = homes.act(
            classroom.grading, uid, gid, lambda opened: _judged(opened, pages), [accounts.staff_id(classroom)]
        )
    finally:
        os.close(pages)
    students = {member.name for member in classroom.students}
    graded, returned = ({name: students & {*those} for name, those in found.items()} for found in json.loads(answer))
    return graded, returned


def _judged(grading: int, pages: int) -> bytes:
    """For `act`: return students by exercise, as found in nbgrader's course folder and in the exchange, as JSON."""
    os.fchdir(grading)
    graded: dict[str, list[str]] = {}
    for path in Path("autograded").glob("*/*/"):
        graded.setdefault(path.name, []).append(path.parent.name)
    returned: dict[str, list[str]] = {}
    for path in Path("feedback").glob("*/*/"):
        keys = [page_key(path, html.stem) for html in path.glob("*.html")]
        if any(os.access(f"{key}.html", os.F_OK, dir_fd=pages) for key in keys):
            returned.setdefault(path.name, []).append(path.parent.name)
    return json.dumps([graded, returned]).encode()


def page_key(feedback: Path, notebook: str) -> str:
    """Return nbgrader's name for the page of a notebook in the exchange, see `nbgrader.utils.notebook_hash`."""
    with contextlib.suppress(OSError, ValueError):
        secret = read_regular(feedback / "submission_secret.txt", LONGEST_SECRET)
        return hashlib.md5(secret + notebook.encode(), usedforsecurity=False).hexdigest()
    return ""


def enter_dates(classroom: Classroom, asked: Mapping[str, object]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Enter dates in nbgrader's course folder by `dating`; return what that prints.  Raises ClassroomError.

    It prints the dates for everybody, and those of students with an extension.
    """
    command = [*MODULE, "autograder.classroom.dating", box.GRADING]
    everybody, own = json.loads(run(classroom, classroom.instructors[0], command, json.dumps(asked)))
    return everybody, own


def read_grading(classroom: Classroom, name: str) -> bytes:
    """Return a small file of nbgrader's course folder, read as an instructor; b"" when there is none.

    Raises ClassroomError when it cannot be read.
    """
    uid, gid = accounts.ids(classroom, classroom.instructors[0])
    return homes.act(
        classroom.grading, uid, gid, lambda opened: homes.small_file(opened, name), [accounts.staff_id(classroom)]
    )


def enrol(classroom: Classroom) -> None:
    """Enter the students in nbgrader's gradebook, where those who have left stay, and the members in the course folder.

    A hand-in is collected from whoever is a member.
    """
    students = {each.name: {"first_name": each.first_name, "last_name": each.last_name} for each in classroom.students}
    members = {accounts.ids(classroom, each)[0]: each.name for each in classroom.members}
    text = json.dumps({"students": students, "members": members})
    done = classroom.state / ENROLLED
    if not done.exists() or done.read_text() != text:
        run(classroom, classroom.instructors[0], [*MODULE, "autograder.classroom.enrolling", box.GRADING], text)
        storage.replace(done, text.encode(), storage.PRIVATE)


def hand_out_notebooks(classroom: Classroom) -> list[str]:
    """Copy what students get into each home folder; nothing that is there already is changed.

    Returns a line for each member whose home folder had no place for it.
    """
    things = {"notebooks/" + START_PAGE: {"": start_page().encode()}}
    for path, content in _outbound(classroom).items():
        name, *inner = PurePosixPath(path).parts
        for thing in (f"notebooks/{name}", f"notebooks/{RELEASED}/{name}"):  # as in `hand_out`
            things.setdefault(thing, {})["/".join(inner)] = content
    for path, page in pages().items():
        thing, _, within = path.partition("/")
        things.setdefault(thing, {})[within] = page.read_bytes()
    failed = []
    for member in classroom.members:
        try:
            without_place = homes.lay(classroom.home(member), *accounts.ids(classroom, member), things)
        except ClassroomError as error:
            failed.append(
                f"The notebooks could not be copied into the home folder of {member.name}: {error}. Correct this, and "
                f"`{classroom.command('up')}` copies them."
            )
            continue
        if without_place:
            names = ", ".join(without_place)
            failed.append(f"Not copied, because {member.name} has something else in that place: {names}.")
    return failed


def disk(classroom: Classroom) -> dict[str, int | None]:
    """Return the disk space (bytes) of each member's home folder, the largest first; None where counting takes long."""
    there = [member for member in classroom.members if classroom.home(member).exists()]
    found = homes.sizes({member.name: (classroom.home(member), *accounts.ids(classroom, member)) for member in there})
    return dict(sorted(found.items(), key=lambda each: -math.inf if each[1] is None else -each[1]))


def remove(classroom: Classroom) -> None:
    """Remove all files of the class, once no member has a process; raises ClassroomError.

    Uses `rm`, which follows no links and copes with folders of any depth.
    """
    done = subprocess.run(["rm", "-rf", "--one-file-system", "--", classroom.folder], capture_output=True, text=True)
    if done.returncode:
        raise ClassroomError((done.stderr.splitlines() or ["rm failed"])[-1])


def run(classroom: Classroom, member: Member, argv: list[str], text: str = "") -> str:
    """Run one of the environment's programs in a member's box, with `text` as its input; return its standard output.

    Raises ClassroomError.
    """
    contents = MemoryFiles()
    try:
        command = box.command(classroom, member, [f"{sys.prefix}/bin/{argv[0]}", *argv[1:]], contents)
        done = subprocess.run(
            command,
            env=box.variables(member),
            pass_fds=contents.descriptors,
            umask=box.umask(member),
            input=text,
            capture_output=True,
            text=True,
            timeout=LONGEST,
            cwd="/",
        )
    finally:
        contents.close()
    if done.returncode:
        said = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
        raise ClassroomError(f"{' '.join(argv)}: {said[-1] if said else f'exit status {done.returncode}'}")
    return done.stdout


def set_aside_configuration(classroom: Classroom) -> list[str]:
    """Rename configuration files that a leaving instructor may have put into the folder of grades; return the names.

    Raises ClassroomError.
    """
    uid, gid = accounts.ids(classroom, classroom.instructors[0])
    said = homes.act(classroom.grading, uid, gid, _set_aside, [accounts.staff_id(classroom)])
    return list(json.loads(said))


def _set_aside(grading: int) -> bytes:
    """For `act`: rename configuration files, which are programs, so that nothing runs them."""
    from autograder.gradebook.exchange_collect import CONFIGURATION

    os.fchdir(grading)
    new = []
    for name in [name for name in sorted(os.listdir()) if CONFIGURATION.fullmatch(name)]:
        number = next(number for number in range(1, 10_000) if not os.path.lexists(f"{name}.{number}"))
        os.rename(name, f"{name}.{number}")
        new.append(f"{name}.{number}")
    return json.dumps(new).encode()


def _outbound(classroom: Classroom) -> dict[str, bytes]:
    """Return the released files by their paths in the exchange, read as an instructor.

    What a release that was killed has left, under a name that begins with a full stop, is left out.
    """
    uid, gid = accounts.ids(classroom, classroom.instructors[0])
    found = homes.read(classroom.exchange / COURSE_ID, "outbound", uid, gid, [accounts.staff_id(classroom)])
    return {path: content for path, content in found.items() if not path.startswith(".")}


def _share(folder: int, name: str, staff: int, mode: int) -> None:
    """Open a folder to the instructors; raises OSError, also when it is a link, or does not belong to root."""
    opened = os.open(name, homes.FOLDER, dir_fd=folder)
    try:
        if os.fstat(opened).st_uid:
            raise PermissionError(errno.EPERM, "it does not belong to root")
        os.fchown(opened, 0, staff)
        os.fchmod(opened, mode)
    finally:
        os.close(opened)
