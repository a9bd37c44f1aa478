"""A backup of a class in one file: everybody's work, hand-ins, grades, settings and passwords.

The class must be down: tar reads the homes as root, and nobody may change them meanwhile.
"""

import json
import os
import shutil
import stat
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

from autograder.classroom import accounts, homes, hub, servers
from autograder.classroom.plan import SETTINGS, Classroom
from autograder.errors import ClassroomError, UsageError
from course.foundation import storage

TAR = ["tar", "--gzip", "--file=-", "--numeric-owner", "--warning=no-file-ignored"]  # sockets need no backup
LONGEST = os.pathconf("/", "PC_PATH_MAX") // 2  # bytes of a path in the class: a restored path may be longer


def write(classroom: Classroom, file: Path) -> tuple[int, list[str]]:
    """Write the class to the new file `file`; return its size (bytes), and the folders left out as too deep.

    Raises UsageError while the class is up, and ClassroomError when it cannot be written; then there is no file.
    """
    without_user = accounts.missing(classroom)
    if hub.running(classroom) or servers.started(classroom) or len(without_user) < len(classroom.members):
        raise UsageError("the class is up: `down` first; everybody keeps their password")
    if file.exists():
        raise UsageError(f"{file} exists; name another file")
    draft = file.with_name(f".{file.name}.part")
    try:
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, storage.PRIVATE)
        with open(descriptor, "wb") as written, tempfile.TemporaryFile() as names:
            too_deep = _list(classroom.folder, names)
            names.seek(0)
            command = [*TAR, "--create", "--sparse", "--no-recursion", "--null", "--files-from=-"]
            _run(command, classroom.folder, stdin=names, stdout=written)
            written.flush()
            os.fsync(descriptor)
        draft.replace(file)
    except OSError as error:
        raise ClassroomError(f"cannot write {file}: {error.strerror}") from None
    finally:
        draft.unlink(missing_ok=True)
    return file.stat().st_size, too_deep


def _list(folder: Path, names: IO[bytes]) -> list[str]:
    """Write the paths in the class's folder to `names`, each with a null byte; return the folders that are left out.

    A path that is too long could be written, but not restored.
    """
    opened, too_deep = os.open(folder, homes.FOLDER), []
    try:
        device = os.fstat(opened).st_dev
        for path, below, files, at in homes.walk(opened):
            if os.fstat(at).st_dev != device:
                below.clear()
            elif len(os.fsencode(path)) > LONGEST or path.count("/") >= homes.DEEPEST:
                too_deep.append(os.path.normpath(path))
                below.clear()
            else:
                # Records of running processes are useless, because other processes may have their ids after a restore.
                kept = [name for name in files if path != "./state" or not name.endswith(".pid")]
                kept += [
                    name for name in below if stat.S_ISLNK(os.stat(name, dir_fd=at, follow_symlinks=False).st_mode)
                ]
                names.writelines(os.fsencode(os.path.join(path, name)) + b"\0" for name in ("", *kept))
    finally:
        os.close(opened)
    return too_deep


def read(file: Path, folder: Path) -> Classroom:
    """Restore a class into the new folder `folder`; it is down, and closed to all but root.

    Raises UsageError when `file` holds no class, ClassroomError when it cannot be restored; no folder is made then.
    """
    if folder.exists():
        raise UsageError(f"{folder} exists; name another folder with --folder, or move it away")
    draft = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(draft, ignore_errors=True)
    try:
        draft.mkdir(storage.PRIVATE_FOLDER, parents=True)
        with open(file, "rb") as kept:
            try:
                _run([*TAR, "--extract", "--same-owner", "--preserve-permissions"], draft, stdin=kept)
            except ClassroomError as error:
                raise ClassroomError(f"{file} cannot be unpacked: {error}") from None
        draft.chmod(storage.PRIVATE_FOLDER)
        if not (draft / "state" / SETTINGS).exists():
            raise UsageError(f"{file} is no backup of a class")
        classroom = replace(Classroom.load(draft), folder=folder)
        _take_from_who_left(draft, {member.name for member in classroom.members})
        settings = json.loads((draft / "state" / SETTINGS).read_text()) | {"folder": str(folder)}
        storage.replace(draft / "state" / SETTINGS, json.dumps(settings, indent=1).encode(), storage.PRIVATE)
        draft.rename(folder)
    except OSError as error:
        raise ClassroomError(f"cannot restore {file} to {folder}: {error.strerror}") from None
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    return classroom


def _take_from_who_left(folder: Path, members: set[str]) -> None:
    """Give root the homes of former members: somebody else may have their user id on this machine."""
    for home in (folder / "homes").iterdir():
        if home.name not in members:
            homes.give(home, 0, 0)


def _run(command: list[str], folder: Path, **streams: Any) -> None:
    """Run tar in a folder; raises ClassroomError with tar's first line of errors."""
    environment = os.environ | {"LC_ALL": "C"}
    done = subprocess.run(command, cwd=folder, env=environment, stderr=subprocess.PIPE, text=True, **streams)
    if done.returncode:
        said = [line for line in done.stderr.splitlines() if line.strip()]
        raise ClassroomError(said[0] if said else f"tar ended with exit status {done.returncode}")
