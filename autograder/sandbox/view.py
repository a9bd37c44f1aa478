"""A confined program's view of the file system, as options of bubblewrap.

The system and the folders that Python and ROS 2 are installed in, read-only, and an empty home folder with the
handed-in files in it.  Of the grader nothing, wherever it is: beside these folders (a checkout with its `.venv`),
inside one of them (an installed package), or both (a checkout in /usr/src).
"""

import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from autograder import paths
from autograder.paths import COURSE, HIDDEN, PACKAGE
from autograder.sandbox.variables import ros_prefixes
from course import environment

HOME = "/home/student"
JUDGE_HOME = "/run/judging"  # of the process that judges: empty for each job
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
FILES = 4096  # files and folders, the same; the kernel keeps a kilobyte of each, which counts for no process
STORE = "/mnt"  # where that file system is mounted, in a mount namespace of the program's own
# bubblewrap's own file systems have no limit to the number of files.
MOUNT = f"""set -e
mount -t tmpfs -o size={SCRATCH},nr_inodes={FILES},nosuid,nodev,mode=0755 tmpfs {STORE}
mkdir -m 0777 {STORE}/home
mkdir -m 1777 {STORE}/tmp {STORE}/shm
exec "$@"
"""


def with_store(command: list[str]) -> list[str]:
    """A command line that mounts an empty file system for what a program writes, and runs bubblewrap's `command`."""
    return ["unshare", "--mount", "--propagation", "private", "sh", "-c", MOUNT, "sh", *command]


def options(
    uid: int, files: Mapping[str, bytes], interfaces: Path | None, to_read: Callable[[bytes], str]
) -> list[str]:
    """bubblewrap's options for the file system of a program that runs as user `uid` and has `files` in its home folder.

    `interfaces` is the install prefix of an exercise's own interface package.  `to_read` makes a descriptor, which
    bubblewrap inherits, of a file's content.
    """
    view = [*_stored_system(uid, to_read), *_stored("home", HOME), *installed(folders(paths.private()), interfaces)]
    view += ["--perms", "0755", "--dir", "/opt", "--ro-bind", str(environment.DISCOVERY_PROFILE), PROFILE]
    if interfaces:
        view += ["--ro-bind", str(interfaces), INTERFACES]
    for name, content in files.items():
        view += ["--perms", "0444", "--file", to_read(content), f"{HOME}/{name}"]
    return [*view, "--remount-ro", "/"]


def of_judge(interfaces: Path, to_read: Callable[[bytes], str]) -> list[str]:
    """The same for the process that judges: it sees the grader's code in place of files handed in, but no hidden suite.

    The suite of one exercise is sent to it with the files to judge.  `interfaces` is the folder of all built interface
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
    """The system, read-only, with these `files` of /etc, and a /proc and a /dev of one's own.

    `shared_memory` and `temporary` are the options that mount /dev/shm and /tmp.
    """
    view = ["--perms", "0755", "--dir", "/etc"]  # whatever the umask
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
    """Return what a program may see: these files, folders and all in them, and the way to each from the root folder."""
    links = [f"/{name}" for name in SYSTEM]
    mounted = ["/proc", "/dev", "/tmp", HOME, PROFILE, *CONFIGURATION, *SYSTEM_FILES]
    return [*links, *mounted, *(str(folder) for folder, visible in folders(paths.private()).items() if visible)]


def _stored(name: str, path: str) -> list[str]:
    # bubblewrap would make the folder above readable to root alone.
    return ["--perms", "0755", "--dir", str(Path(path).parent), "--bind", f"{STORE}/{name}", path]


def installed(folders: Mapping[Path, bool], interfaces: Path | None = None) -> list[str]:
    """These `folders` (see `folders`), and the one of `interfaces` although it may lie in a hidden one."""
    view: list[str] = []
    decided: dict[Path, bool] = {}
    for folder, visible in folders.items():
        around = next((decided[parent] for parent in folder.parents if parent in decided), False)
        if visible == around or (interfaces and folder.resolve() == interfaces.resolve()):
            continue
        decided[folder] = visible
        if visible:
            # bubblewrap would make the folders above readable to root alone.
            for parent in reversed(folder.parents[:-1]):
                view += ["--perms", "0755", "--dir", str(parent)]
            view += ["--ro-bind", str(folder), str(folder)]
        else:
            view += ["--perms", "0755", "--tmpfs", str(folder)]
    hidden = [folder for folder, visible in decided.items() if not visible]
    return view + [word for folder in hidden for word in ("--remount-ro", str(folder))]


def folders(private: list[Path]) -> dict[Path, bool]:
    """The folders that Python and ROS 2 are installed in (True), and what is `private` in them and is hidden (False).

    Outer ones come before inner ones, which overrule them.
    """
    prefixes = [Path("/usr"), Path(sys.prefix), Path(sys.base_prefix), *ros_prefixes()]
    shown = [place for prefix in prefixes for place in (prefix, prefix.resolve())]  # links are named and followed
    found = dict.fromkeys(shown, True)
    for secret in private:
        for folder in shown:
            if secret.is_relative_to(folder.resolve()):
                found[folder / secret.relative_to(folder.resolve())] = False
    return outer_first(found)


def outer_first(folders: Mapping[Path, bool]) -> dict[Path, bool]:
    """The same, as `installed` needs them: an inner one overrules the one around it."""
    return dict(sorted(folders.items(), key=lambda item: len(item[0].parts)))
