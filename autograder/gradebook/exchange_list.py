"""Listing what is in nbgrader's exchange, where anybody in the class may have put anything."""

import contextlib
import itertools
import logging
import os
import stat
import tempfile
from pathlib import Path
from typing import Any

from nbgrader.exchange.default.list import ExchangeList

from autograder.gradebook.course_folder import user_name
from autograder.gradebook.exchange_collect import (
    MOST_BYTES,
    MOST_ENTRIES,
    SECRET,
    SECRETS,
    Few,
    copy_file,
    is_folder,
    shown,
    small_text,
)


class _Originals(logging.LoggerAdapter):
    """Names the original of a file instead of its copy."""

    def process(self, msg: Any, kwargs: Any) -> tuple[Any, Any]:
        """Return the message with each folder of copies exchanged."""
        for copies, originals in (self.extra or {}).items():
            msg = str(msg).replace(copies, str(originals))
        return msg, kwargs


class RegularList(ExchangeList):
    """Lists hand-ins by what their regular files say, and names what cannot be read.

    nbgrader's own class opens whatever has the name of a notebook: a pipe would hold it up, and an unreadable file
    would end the whole list.
    """

    def parse_assignments(self) -> list[dict[str, Any]]:
        """Return what is in the exchange; hand-ins are read from copies of their regular files."""
        if not self.inbound:
            found: list[dict[str, Any]] = super().parse_assignments()
            return found
        paths: list[str] = self.assignments  # type: ignore[has-type]
        with tempfile.TemporaryDirectory(prefix="list-") as place:
            originals = {copy: path for path in paths if (copy := self._copied(path, place))}
            log: Any = self.log  # type: ignore[has-type]
            self.assignments = [*originals]
            named: Any = _Originals(log, {place: self.root})
            self.log = named
            try:
                found = super().parse_assignments()
            finally:
                self.assignments, self.log = paths, log  # `--remove` removes what was there
        for submission in (each for student in found for each in student["submissions"]):
            submission["path"] = originals[submission["path"]]
            for notebook in submission["notebooks"]:
                notebook["path"] = os.path.join(submission["path"], os.path.basename(notebook["path"]))
        return found

    def format_inbound_assignment(self, info: dict[str, Any]) -> str:
        """Return the line about a hand-in, safe in a terminal, with its owner if that is not who it names."""
        line = super().format_inbound_assignment(info)
        with contextlib.suppress(OSError):  # it has just disappeared
            if (owner := user_name(os.lstat(info["path"]).st_uid)) != info["student_id"]:
                line += f", belongs to {owner}"
        return shown(line)

    def _copied(self, path: str, place: str) -> str:
        """Return the folder with what nbgrader reads of a hand-in, in `place`; '' if it is not a hand-in."""
        if not is_folder(path) or not path.isprintable():
            self.log.warning("%s was left out: it is not a hand-in's folder", shown(path))
            return ""
        inbound, name = os.path.split(path)
        copy = Path(place, Path(inbound).parent.name, "inbound", name)  # nbgrader finds the course's name there
        copy.mkdir(parents=True)
        left = Few(self.log)
        try:
            folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
        except OSError as error:
            left.tell("%s cannot be read: %s", shown(path), error.strerror)
            return str(copy)
        try:
            with os.scandir(folder) as entries:
                names = sorted(entry.name for entry in itertools.islice(entries, MOST_ENTRIES))
            wanted = [name for name in names if name.endswith(".ipynb") and not name.startswith(".")]
            space = MOST_BYTES
            for each in [*([SECRETS] if SECRETS in names else []), *wanted]:
                try:
                    if not each.isprintable():
                        raise OSError("its name cannot be printed")
                    if (copy / SECRETS).exists():  # then a notebook's name is enough
                        if not stat.S_ISREG(os.stat(each, dir_fd=folder, follow_symlinks=False).st_mode):
                            raise OSError("it is not a file")
                        (copy / each).touch()
                    else:
                        space -= copy_file(each, folder, copy / each, space)[0]
                    if each == SECRETS and not SECRET.fullmatch(small_text(copy / each) or ""):
                        (copy / each).unlink()
                        raise OSError("it is not a secret as nbgrader writes it")
                except OSError as error:
                    left.tell("%s cannot be read: %s", shown(os.path.join(path, each)), error.strerror or error)
        finally:
            os.close(folder)
        left.end("%s: %d more cannot be read", shown(path))
        return str(copy)
