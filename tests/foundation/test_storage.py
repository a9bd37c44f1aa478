"""Writing the files that a person has named."""

import errno
import os
import pty
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from course.foundation import storage


def test_a_link_stays_and_what_it_leads_to_is_replaced(tmp_path):
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared" / "page").write_bytes(b"old")
    (tmp_path / "near").symlink_to("shared/page")
    (tmp_path / "far").symlink_to(tmp_path / "near")
    (tmp_path / "nowhere").symlink_to("shared/new")
    for name in ("far", "nowhere"):
        storage.write(tmp_path / name, name.encode(), storage.PRIVATE)
    assert all((tmp_path / name).is_symlink() for name in ("near", "far", "nowhere"))
    written = {path.name: path.read_bytes() for path in (tmp_path / "shared").iterdir()}
    assert written == {"page": b"far", "new": b"nowhere"}
    assert (tmp_path / "shared" / "page").stat().st_mode & 0o777 == storage.PRIVATE


def socket_at(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(str(path))


def loop_at(path: Path) -> None:
    path.symlink_to(path.name)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (Path.mkdir, "it is a folder: name a file"),
        (socket_at, "it is not an ordinary file: name another one"),
        (loop_at, "Too many levels of symbolic links"),
        (os.mkfifo, "No such device or address"),  # a pipe that nobody reads: nothing is waited for
    ],
)
def test_what_cannot_be_written_is_an_error_and_stays(tmp_path, monkeypatch, make, says):
    monkeypatch.chdir(tmp_path)  # a socket's path is short
    place = Path("place")
    make(place)
    before = place.lstat()
    with pytest.raises(OSError, match=says):
        storage.write(place, b"page")
    assert storage.refused(place) in (says, "")
    assert (place.lstat().st_ino, place.lstat().st_mode, os.listdir()) == (before.st_ino, before.st_mode, ["place"])


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can make a device")
@pytest.mark.parametrize(("number", "written"), [(3, True), (7, False)])  # /dev/null and /dev/full
def test_a_device_stays_what_it_is(tmp_path, number, written):
    place = tmp_path / "device"
    try:
        os.mknod(place, 0o20666, os.makedev(1, number))
        place.open("rb").close()
    except OSError as error:
        pytest.skip(f"no devices here: {error}")
    (tmp_path / "link").symlink_to(place)
    for named in (place, tmp_path / "link"):
        if written:
            storage.write(named, b"page")
        else:
            with pytest.raises(OSError, match="No space left on device"):
                storage.write(named, b"page")
    assert place.is_char_device() and (tmp_path / "link").is_symlink()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can make a device")
def test_a_disk_is_refused(tmp_path):
    os.mknod(tmp_path / "disk", 0o60600, os.makedev(7, 200))
    with pytest.raises(OSError, match="not an ordinary file"):
        storage.write(tmp_path / "disk", b"page")
    assert (tmp_path / "disk").is_block_device()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can make another user's link")
def test_a_link_of_another_user_where_everybody_may_write_is_not_followed(tmp_path):
    tmp_path.chmod(0o1777)
    (tmp_path / "own").write_bytes(b"old")
    (tmp_path / "page").symlink_to("own")
    os.chown(tmp_path / "page", 65534, 65534, follow_symlinks=False)
    with pytest.raises(OSError, match="a link that another user has made"):
        storage.write(tmp_path / "page", b"page")
    assert (tmp_path / "own").read_bytes() == b"old"


WRITE = (
    "from pathlib import Path; from course.foundation import storage; print('before', flush=False); "
    "storage.write(Path({!r}), b'page\\n'); print('after')"
)


@pytest.mark.parametrize("named", ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"])
def test_standard_output_is_written_to_whatever_it_is(tmp_path, named):
    """A pipe, or a file that a shell appends to."""
    command = [sys.executable, "-c", WRITE.format(named)]
    assert subprocess.run(command, capture_output=True, timeout=60).stdout == b"before\npage\nafter\n"
    (tmp_path / "log").write_bytes(b"kept\n")
    with (tmp_path / "log").open("ab") as log:
        subprocess.run(command, stdout=log, check=True, timeout=60)
    assert (tmp_path / "log").read_bytes() == b"kept\nbefore\npage\nafter\n"
    assert Path("/dev/stdout").is_symlink()


def test_a_terminal_is_written_to():
    leader, follower = pty.openpty()
    try:
        storage.write(Path(os.ttyname(follower)), b"page\n")
        assert os.read(leader, 100) == b"page\r\n"
    finally:
        os.close(leader)
        os.close(follower)


@pytest.mark.parametrize(
    ("of", "said"),
    [
        (("a.py", None, "b.py"), "No space left on device"),
        (("a.py",), "No space left on device: 'a.py'"),
        ((), "No space left on device"),
    ],
)
def test_the_reason_of_a_folder_that_was_not_copied_is_told_in_a_few_words(of, said):
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), *of)
    assert storage.why(shutil.Error([("a.py", "b.py", str(full))])) == said
