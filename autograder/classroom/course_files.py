"""What the class works with: the released notebooks in each home folder, and nbgrader's exchange.

Whatever nbgrader does, it does in the box of an instructor, whose files these are.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

from autograder.classroom import accounts, box
from autograder.classroom.plan import COURSE_ID, Classroom
from autograder.classroom.roster import Member
from autograder.errors import AutograderError
from autograder.gradebook.release import hand_out, names
from autograder.results import storage

PAGES = ("README.md", "when-it-goes-wrong.md", "when-it-goes-wrong")
# Who may do what there: nbgrader asks for these modes.  The first bit of `inbound` keeps students from removing what
# others have handed in; that nobody can list it keeps them from finding it.
EXCHANGE = {"": 0o2775, "outbound": 0o2775, "inbound": 0o3773, "feedback": 0o2771}
ENROLLED = "enrolled.json"  # in `Classroom.state`: whom the gradebook knows
LONGEST = 300  # s that one command in a box may take


def make_folders(room: Classroom) -> None:
    """The folders of the classroom, each open to those who need it."""
    for folder, mode in (
        (room.folder, 0o711),
        (room.homes, 0o711),
        (room.state, 0o700),
        (room.state / "servers", 0o700),
        (room.exchange, 0o755),
    ):
        folder.mkdir(parents=True, exist_ok=True)
        folder.chmod(mode)
    for folder, mode in ((room.run, 0o700), (room.run / "servers", 0o700), (room.hub_socket.parent, 0o755)):
        folder.mkdir(parents=True, exist_ok=True)
        folder.chmod(mode)


def make_shared(room: Classroom) -> None:
    """The folders that instructors share, and those of the exchange."""
    staff = accounts.staff_id(room)
    room.grading.mkdir(exist_ok=True)
    shared = {room.grading: 0o2770}
    shared |= {room.exchange / COURSE_ID / name: mode for name, mode in EXCHANGE.items()}
    for folder, mode in shared.items():
        folder.mkdir(exist_ok=True)
        os.chown(folder, 0, staff)
        folder.chmod(mode)


def release(room: Classroom) -> list[str]:
    """Release the notebooks that are not yet in the exchange; their names."""
    instructor = room.instructors[0]
    there = {path.name for path in (room.exchange / COURSE_ID / "outbound").iterdir()}
    new = [name for name in names() if name not in there]
    if new:
        run(room, instructor, ["python", "-m", "autograder.classroom.releasing", box.GRADING, *new])
        (room.grading / "gradebook.db").chmod(0o660)  # nbgrader makes it for one instructor alone
    return new


def enrol(room: Classroom) -> None:
    """Enter the students in nbgrader's gradebook, whose pages call them by their names; those who have left stay."""
    students = {each.name: {"first_name": each.first_name, "last_name": each.last_name} for each in room.students}
    text = json.dumps(students)
    done = room.state / ENROLLED
    if not done.exists() or done.read_text() != text:
        run(room, room.instructors[0], ["python", "-m", "autograder.classroom.enrolling", box.GRADING], text)
        storage.replace(done, text.encode(), storage.PRIVATE)


def hand_out_notebooks(room: Classroom) -> None:
    """Lay what students get into each home folder; what is there already is left as it is."""
    outbound = room.exchange / COURSE_ID / "outbound"
    hand_out(room.released, sorted(outbound.iterdir()))
    for member in room.members:
        uid, gid = accounts.ids(room, member)
        target = Path(room.home(member))
        for source in [*sorted((room.released / "notebooks").iterdir()), *(room.released / page for page in PAGES)]:
            _lay(source, target / source.relative_to(room.released), uid, gid)


def disk(room: Classroom) -> dict[str, int]:
    """Bytes on the disk in the home folder of each member who has one, the largest first; raises AutograderError."""
    homes = {str(room.home(member)): member.name for member in room.members if room.home(member).exists()}
    command = ["du", "--summarize", "--one-file-system", "--block-size=1", "--files0-from=-"]
    try:
        text = "".join(f"{home}\0" for home in homes)
        done = subprocess.run(command, input=text, capture_output=True, text=True, timeout=LONGEST)
    except subprocess.TimeoutExpired:
        raise AutograderError(f"the files in {room.homes} cannot be counted within {LONGEST} s") from None
    found = {homes[path]: int(size) for size, path in (line.split("\t") for line in done.stdout.splitlines())}
    return dict(sorted(found.items(), key=lambda each: -each[1]))


def run(room: Classroom, member: Member, argv: list[str], text: str = "") -> str:
    """Run one of the environment's programs in a member's box, with `text` to read; what it printed.

    Raises AutograderError.
    """
    contents = box.Contents()
    try:
        command = box.command(room, member, [f"{sys.prefix}/bin/{argv[0]}", *argv[1:]], contents)
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
        raise AutograderError(f"{' '.join(argv)}: {said[-1] if said else f'exit status {done.returncode}'}")
    return done.stdout + done.stderr


def _lay(source: Path, target: Path, uid: int, gid: int) -> None:
    """Copy a file or folder into a home folder, for its user, unless something of that name is there.

    The user may have laid links there: none is followed.
    """
    parent = target.parent
    if parent.is_symlink() or os.path.lexists(target):
        return
    if not parent.exists():
        parent.mkdir()
        os.lchown(parent, uid, gid)
    if source.is_dir():
        shutil.copytree(source, target)
        for path in target.rglob("*"):
            path.chmod(0o700 if path.is_dir() else 0o600)
        target.chmod(0o700)
        accounts.own(target, uid, gid)
    else:
        shutil.copyfile(source, target, follow_symlinks=False)
        target.chmod(0o600)
        os.lchown(target, uid, gid)
