"""A confined program's view of the file system, as options of bubblewrap.

It sees the system and the folders of Python and ROS 2, read-only, and a home folder with only the handed-in files.  It
sees nothing of the grader, wherever that is: beside these folders (a checkout with its `.venv`), inside one of them (an
installed package), or both (a checkout in /usr/src).
"""

import os
import sys
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

from autograder import paths
from autograder.paths import COURSE, HIDDEN, PACKAGE
from autograder.sandbox.variables import ros_prefixes
from course import environment

HOME = "/home/student"
JUDGE_HOME = "/run/judging"  # of the judging process: empty for each job
INTERFACES = "/opt/interfaces"
PROFILE = "/opt/discovery.xml"
SYSTEM = ("bin", "sbin", "lib", "lib32", "lib64")  # on most systems links into /usr
CONFIGURATION = ("/etc/ld.so.cache", "/etc/alternatives", "/etc/localtime")
SYSTEM_FILES = {
    "/etc/passwd": "root:x:0:0::/:/bin/false\nstudent:x:{uid}:{uid}::" + HOME + ":/bin/sh\n",
    "/etc/group": "root:x:0:\nstudent:x:{uid}:\n",
    "/etc/hosts": "127.0.0.1 localhost\n",
    "/etc/nsswitch.conf": "passwd: files\ngroup: files\nhosts: files\n",
}
SCRATCH = 64 << 20  # bytes that fit into the home folder, /tmp and /dev/shm together
FILES = 4096  # files and folders in all three; each takes a kilobyte in the kernel, which is counted for no process
STORE = "/mnt"  # where that file system is mounted, in the program's mount namespace
# bubblewrap's own file systems have no limit to the number of files.
MOUNT = f"""set -e
mount -t tmpfs -o size={SCRATCH},nr_inodes={FILES},nosuid,nodev,mode=0755 tmpfs {STORE}
mkdir -m 0777 {STORE}/home
mkdir -m 1777 {STORE}/tmp {STORE}/shm
exec "$@"
"""


def with_store(command: list[str]) -> list[str]:
    """Return a command line that mounts an empty file system for a program's files, and runs bubblewrap's `command`."""
    return ["unshare", "--mount", "--propagation", "private", "sh", "-c", MOUNT, "sh", *command]


def options(
    uid: int, files: Mapping[str, bytes], interfaces: Path | None, to_read: Callable[[bytes], str]
) -> list[str]:
    """Return bubblewrap's options for the file system of a program of user `uid`, with `files` in its home folder.

    `interfaces` is the install prefix of an exercise's own interface package.  `to_read` turns a file's content into a
    descriptor that bubblewrap inherits.
    """
    shown = _shown(tuple(paths.private()), interfaces)
    view = [*_stored_system(uid, to_read), *_stored("home", HOME), *shown]
    view += ["--perms", "0755", "--dir", "/opt", "--ro-bind", str(environment.DISCOVERY_PROFILE), PROFILE]
    if interfaces:
        view += ["--ro-bind", str(interfaces), INTERFACES]
    for name, content in files.items():
        view += ["--perms", "0444", "--file", to_read(content), f"{HOME}/{name}"]
    return [*view, "--remount-ro", "/"]


@cache  # each program of a worker has the same, and finding it takes longer than the rest of its command line
def _shown(private: tuple[Path, ...], interfaces: Path | None) -> list[str]:
    """Return the options for Python, ROS 2 and `interfaces`."""
    return installed(folders([*private]), interfaces)


def of_judge(interfaces: Path, to_read: Callable[[bytes], str]) -> list[str]:
    """Return the same for the judging process: it sees the grader's code, no handed-in files, and no hidden suite.

    It receives the suite of one exercise with the files to judge.  `interfaces` is the folder of all built interface
    packages, which it sees as INTERFACES.
    """
    private = [folder for folder in (paths.checkout(), HIDDEN) if folder]
    needed = {PACKAGE: True, HIDDEN: False, COURSE: True}
    shown = outer_first(folders(private) | needed)
    view = [*_stored_system(0, to_read), *_stored("home", JUDGE_HOME), *installed(shown)]
    view += ["--perms", "0755", "--dir", "/opt", "--ro-bind", str(interfaces), INTERFACES]
    return [*view, "--remount-ro", "/"]


def _stored_system(uid: int, to_read: Callable[[bytes], str]) -> list[str]:
    files = {path: text.format(uid=uid) for path, text in SYSTEM_FILES.items()}
    return system(files, to_read, _stored("shm", "/dev/shm"), _stored("tmp", "/tmp"))


def system(
    files: Mapping[str, str], to_read: Callable[[bytes], str], shared_memory: list[str], temporary: list[str]
) -> list[str]:
    """Return the options for a read-only system with these `files` of /etc, and a new /proc and /dev.

    `shared_memory` and `temporary` are the options that mount /dev/shm and /tmp.
    """
    view = ["--perms", "0755", "--dir", "/etc"]  # independent of the umask
    for name in SYSTEM:
        link = Path("/", name).is_symlink()
        view += (
            ["--symlink", os.readlink(f"/{name}"), f"/{name}"] if link else ["--ro-bind-try", f"/{name}", f"/{name}"]
        )
    for path in CONFIGURATION:
        view += ["--ro-bind-try", path, path]
    for path, text in files.items():
        view += ["--perms", "0444", "--ro-bind-data", to_read(text.encode()), path]
    view += ["--proc", "/proc", "--dev", "/dev"]
    return [*view, *shared_memory, "--remount-ro", "/dev", *temporary]


def expected() -> list[str]:
    """Return the paths that a program may see, together with everything in them and the folders above them."""
    links = [f"/{name}" for name in SYSTEM]
    mounted = ["/proc", "/dev", "/tmp", HOME, PROFILE, *CONFIGURATION, *SYSTEM_FILES]
    return [*links, *mounted, *(str(folder) for folder, visible in folders(paths.private()).items() if visible)]


def _stored(name: str, path: str) -> list[str]:
    # bubblewrap itself would make the folder above readable by root only.
    return ["--perms", "0755", "--dir", str(Path(path).parent), "--bind", f"{STORE}/{name}", path]


def installed(folders: Mapping[Path, bool], interfaces: Path | None = None) -> list[str]:
    """Return the options for `folders` (see `folders`), and for `interfaces`, although it may be in a hidden one."""
    view: list[str] = []
    decided: dict[Path, bool] = {}
    for folder, visible in folders.items():
        around = next((decided[parent] for parent in folder.parents if parent in decided), False)
        if visible == around or (interfaces and folder.resolve() == interfaces.resolve()):
            continue
        decided[folder] = visible
        if visible:
            # bubblewrap itself would make the folders above readable by root only.
            for parent in reversed(folder.parents[:-1]):
                view += ["--perms", "0755", "--dir", str(parent)]
            view += ["--ro-bind", str(folder), str(folder)]
        else:
            view += ["--perms", "0755", "--tmpfs", str(folder)]
    hidden = [folder for folder, visible in decided.items() if not visible]
    return view + [word for folder in hidden for word in ("--remount-ro", str(folder))]


def folders(private: list[Path]) -> dict[Path, bool]:
    """Return the folders of Python and ROS 2 (True), and the `private` folders in them, which are hidden (False).

    Outer folders come before inner ones, which override them.
    """
    prefixes = [Path("/usr"), Path(sys.prefix), Path(sys.base_prefix), *ros_prefixes()]
    shown = [place for prefix in prefixes for place in (prefix, prefix.resolve())]  # both the link and its target
    found = dict.fromkeys(shown, True)
    for secret in private:
        for folder in shown:
            if secret.is_relative_to(folder.resolve()):
                found[folder / secret.relative_to(folder.resolve())] = False
    return outer_first(found)


def outer_first(folders: Mapping[Path, bool]) -> dict[Path, bool]:
    """Return the same in the order that `installed` needs: an inner folder overrides the one around it."""
    return dict(sorted(folders.items(), key=lambda item: len(item[0].parts)))
