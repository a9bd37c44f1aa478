"""The folders of a user: the cache, and the runtime folder for files about running processes.

platformdirs has both, but warns where `XDG_RUNTIME_DIR` is not set, as in containers, and raises an error where
somebody else has taken its name in /tmp; here the cache takes its place.
"""

import contextlib
import os
import stat
import tempfile
from pathlib import Path

NAME = "ros2-course"


def user_cache() -> Path:
    """Return the course's folder in the user's cache, `$XDG_CACHE_HOME` or ~/.cache; it may not exist yet."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / NAME


def runtime_folder() -> Path:
    """Return the runtime folder, made if needed: in `$XDG_RUNTIME_DIR`, or in /tmp, readable by this user only.

    If somebody else has taken the name in /tmp, it is in the user's cache.  Raises PermissionError when none of these
    is possible.
    """
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    if runtime and _is_own(Path(runtime)) and os.access(runtime, os.W_OK):
        places = [Path(runtime, NAME)]
    else:
        places = [Path(tempfile.gettempdir(), f"{NAME}-{os.getuid()}"), _in_cache()]
    for place in places:
        with contextlib.suppress(FileExistsError):
            place.mkdir(mode=0o700, parents=place == _in_cache())
        if _is_own(place):
            place.chmod(0o700)
            return place
    raise PermissionError(f"{places[-1]} belongs to another user")


def _is_own(place: Path) -> bool:
    """Return True for a folder of this user, but not for a link to one."""
    with contextlib.suppress(OSError):
        found = place.lstat()
        return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
    return False


def _in_cache() -> Path:
    """Return a folder named after this boot: machines may share a home, and a home outlives processes."""
    start = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    return user_cache() / f"run-{start}"
