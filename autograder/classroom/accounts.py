"""The Unix users of a classroom: one for each member, made by root, recorded, and removed again.

Their shell is nologin: a member can log in only through the hub, and then works in their box.
"""

import contextlib
import grp
import json
import os
import pwd
import secrets
import signal
import subprocess
from pathlib import Path

from autograder.classroom import homes
from autograder.classroom.members import Member
from autograder.classroom.plan import COURSE_ID, Classroom
from autograder.errors import ClassroomError, UsageError
from course.foundation import processes, storage
from course.foundation.waiting import wait_until

ACCOUNTS, PASSWORDS = "accounts.json", "passwords.csv"
KEPT = "kept_passwords.json"  # password hashes of members whose Unix users `down` has removed
NUMBERS = (1000, 60000)  # user ids of people, as in login.defs on Debian and Ubuntu
RENEWED = "renewed"  # a folder: a file for each member whose old logins the hub has yet to end
SHADOW = Path("/etc/shadow")
ENDED = 20.0  # s to wait until killed processes are gone


def missing(classroom: Classroom) -> list[Member]:
    """Return the members without a Unix user; raises UsageError when a user of that name was not made by this class."""
    known = noted(classroom)
    found = []
    for member in classroom.members:
        name = classroom.user(member)
        if _exists(name) and name not in known:
            raise UsageError(
                f"the Unix user {name} exists, but not from this class: remove it, or give another --prefix"
            )
        if not _exists(name):
            found.append(member)
    return found


def make(classroom: Classroom) -> list[Member]:
    """Make the group and the missing users, with home folders; return the members whose users are new."""
    new = missing(classroom)
    staff = classroom.staff
    users = {classroom.user(member): classroom.home(member) for member in new}
    _make_groups(classroom, {staff: classroom.grading} | users)
    former = {member: classroom.home(member).stat().st_uid for member in new if classroom.home(member).exists()}
    # Members who can have their old user id back go first, so that nobody else in the class gets it.
    for member in sorted(new, key=lambda member: not former.get(member) or _is_user(former[member])):
        _make_user(classroom, member, former.get(member, 0))
    _hand_on(classroom, former)
    for member in classroom.members:
        home = classroom.home(member)
        user = pwd.getpwnam(classroom.user(member))
        if not home.exists():
            home.mkdir(storage.PRIVATE_FOLDER)
            os.chown(home, user.pw_uid, user.pw_gid)
        elif (home.stat().st_uid, home.stat().st_gid) != (user.pw_uid, user.pw_gid):
            homes.give(home, user.pw_uid, user.pw_gid)
        if (user.pw_name in grp.getgrnam(staff).gr_mem) != member.instructor:
            _run("usermod", "--groups", staff if member.instructor else "", user.pw_name)
    return new


def without_password(classroom: Classroom, new: list[Member]) -> list[Member]:
    """Return the members without a password: the `new` ones, and those missing from the file of passwords.

    A member who had a password before `down` gets it back.
    """
    path = classroom.state / PASSWORDS
    named = {line.partition(",")[0] for line in path.read_text().splitlines()} if path.exists() else set()
    back = _give_back(classroom, new)
    return [
        member for member in classroom.members if member.name not in named or (member in new and member not in back)
    ]


def _give_back(classroom: Classroom, new: list[Member]) -> list[Member]:
    """Give new Unix users the passwords that their members had before `down`; return the members who had one."""
    path = classroom.state / KEPT
    kept: dict[str, str] = json.loads(path.read_text()) if path.exists() else {}
    back = [member for member in new if member.name in kept]
    if back:
        _run("chpasswd", "--encrypted", text="".join(f"{classroom.user(one)}:{kept[one.name]}\n" for one in back))
    return back


def _keep_passwords(classroom: Classroom) -> None:
    """Save the hashes of the members' passwords, readable by root only, before the Unix users are removed.

    They come from the system, so a password that was changed with `passwd` is kept, too.
    """
    path = classroom.state / KEPT
    kept: dict[str, str] = json.loads(path.read_text()) if path.exists() else {}
    shadow = dict(line.split(":")[:2] for line in SHADOW.read_text().splitlines() if ":" in line)
    for member in classroom.members:
        if (word := shadow.get(classroom.user(member), "")).startswith("$"):  # anything else is not a password hash
            kept[member.name] = word
    storage.replace(path, json.dumps(kept).encode(), storage.PRIVATE)


def set_passwords(classroom: Classroom, members: list[Member]) -> Path:
    """Give each of `members` a new password, write it to a file for root to hand out, and return that file."""
    path = classroom.state / PASSWORDS
    lines = path.read_text().splitlines() if path.exists() else ["student,password"]
    given = {member.name: secrets.token_urlsafe(9) for member in members}
    lines = [line for line in lines if line.partition(",")[0] not in given]
    lines += [f"{name},{password}" for name, password in given.items()]
    storage.replace(path, ("\n".join(lines) + "\n").encode(), storage.PRIVATE)
    entries = "".join(f"{classroom.user(member)}:{given[member.name]}\n" for member in members)
    _run("chpasswd", text=entries)
    return path


def renew(classroom: Classroom, member: Member) -> Path:
    """Set a new password as `set_passwords` does, and have logins with the old one ended."""
    written = set_passwords(classroom, [member])
    folder = classroom.state / RENEWED
    folder.mkdir(storage.PRIVATE_FOLDER, exist_ok=True)
    (folder / member.name).touch()
    return written


def take_renewal(classroom: Classroom, name: str) -> bool:
    """Return True, once only, if a member has been given a new password."""
    try:
        (classroom.state / RENEWED / name).unlink()
    except FileNotFoundError:
        return False
    return True


def ids(classroom: Classroom, member: Member) -> tuple[int, int]:
    """Return the user id and group id of a member."""
    user = pwd.getpwnam(classroom.user(member))
    return user.pw_uid, user.pw_gid


def made(classroom: Classroom) -> bool:
    """Return True if the class's Unix users exist: `up` makes them, and `down` removes them."""
    try:
        ids(classroom, classroom.instructors[0])
    except KeyError:
        return False
    return True


def staff_id(classroom: Classroom) -> int:
    """Return the id of the instructors' group."""
    return grp.getgrnam(classroom.staff).gr_gid


def noted(classroom: Classroom) -> list[str]:
    """Return the names of users and groups that `up` has made, or was about to make, and that `down` will remove."""
    path = classroom.state / ACCOUNTS
    return list(json.loads(path.read_text())) if path.exists() else []


def remove(classroom: Classroom) -> list[str]:
    """End all processes of the users that were made, remove them and their groups, and return the users' names."""
    known = noted(classroom)
    _keep_passwords(classroom)
    uids = {pwd.getpwnam(name).pw_uid for name in known if _exists(name)}
    if not wait_until(lambda: not _end(uids), ENDED, alert=False):
        raise ClassroomError("processes of students could not be ended; run `down` again")
    removed = []
    for name in sorted(known, key=_exists, reverse=True):  # users before the group
        if _exists(name):
            _run("userdel", name)
            removed.append(name)
        elif _group(name):
            _run("groupdel", name)
    (classroom.state / ACCOUNTS).unlink(missing_ok=True)
    return removed


def _hand_on(classroom: Classroom, former: dict[Member, int]) -> None:
    """Change the owner of members' files in the shared folders to their present user ids."""
    now = {number: ids(classroom, member)[0] for member, number in former.items()}
    moved = {number: new for number, new in now.items() if number and number != new}
    for shared in (classroom.grading, classroom.exchange) if moved else ():
        if shared.exists():
            homes.hand_on(shared, lambda uid: moved.get(uid, uid))


def _unused(classroom: Classroom) -> int:
    """Return an id that no user or group has, and that nobody who has left the class had."""
    inbound = classroom.exchange / COURSE_ID / "inbound"
    left = [path.lstat() for folder in (classroom.homes, inbound) if folder.exists() for path in folder.iterdir()]
    had = {number for each in left for number in (each.st_uid, each.st_gid)}
    free = (number for number in range(*NUMBERS) if not (number in had or _is_user(number) or _is_group(number)))
    if not (found := next(free, 0)):
        raise ClassroomError("all user ids of this machine are taken")
    return found


def _make_user(classroom: Classroom, member: Member, former: int) -> None:
    """Make a member's user, with the `former` user id if it is free."""
    number = former if former and not _is_user(former) else _unused(classroom)
    name, home = classroom.user(member), classroom.home(member)
    command = ["useradd", "--no-create-home", "--home-dir", str(home), "--gid", name, "--no-log-init"]
    command += ["--shell", "/usr/sbin/nologin", "--comment", f"{member.name} of {classroom.folder}"]
    _run(*command, "--uid", str(number), name)


def _make_groups(classroom: Classroom, kept: dict[str, Path]) -> None:
    """Make groups; each gets the id that its kept folder still has, unless another group has taken that id."""
    known = noted(classroom)
    for name in kept:
        if _group(name) and name not in known:
            raise UsageError(
                f"the Unix group {name} exists, but not from this class: remove it, or give another --prefix"
            )
    for again in (True, False):  # these first, so that no other group is given their ids
        for name, folder in kept.items():
            number = folder.stat().st_gid if folder.exists() else 0
            free = bool(number) and not _is_group(number)
            if not _group(name) and free is again:
                _note(classroom, name)
                _run("groupadd", "--gid", str(number if free else _unused(classroom)), name)


def _end(uids: set[int]) -> bool:
    """Kill the processes of these users; return True if there were any."""
    found = False
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if process.stat().st_uid in uids and processes.birth(int(process.name)):
                found = True
                os.kill(int(process.name), signal.SIGKILL)
    return found


def _note(classroom: Classroom, name: str) -> None:
    """Record a name before its user or group is made, so that `down` finds it whatever happens."""
    names = json.dumps([*dict.fromkeys([*noted(classroom), name])])
    storage.replace(classroom.state / ACCOUNTS, names.encode(), storage.PRIVATE)


def _exists(name: str) -> bool:
    with contextlib.suppress(KeyError):
        return bool(pwd.getpwnam(name))
    return False


def _group(name: str) -> bool:
    with contextlib.suppress(KeyError):
        return bool(grp.getgrnam(name))
    return False


def _is_user(number: int) -> bool:
    with contextlib.suppress(KeyError):
        return bool(pwd.getpwuid(number))
    return False


def _is_group(number: int) -> bool:
    with contextlib.suppress(KeyError):
        return bool(grp.getgrgid(number))
    return False


def _run(*command: str, text: str | None = None) -> None:
    done = subprocess.run(command, input=text, text=True, capture_output=True)
    if done.returncode:
        said = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
        raise ClassroomError(f"{command[0]}: {said}")
