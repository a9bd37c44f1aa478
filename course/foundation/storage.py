"""Replacing a file atomically: a reader finds either the old content or the new, even after a power cut."""

import os
from collections.abc import Iterable
from pathlib import Path

PRIVATE, PRIVATE_FOLDER = 0o600, 0o700  # modes for this user only


def draft_of(path: Path) -> Path:
    """Return where `replace` first writes a file."""
    return path.with_name(f".{path.name}.part")


def replace(path: Path, content: bytes | Iterable[bytes], mode: int = 0o666) -> None:
    """Write or replace a file; `mode` as for open(2).  If it raises OSError, nothing has changed."""
    draft = draft_of(path)
    draft.unlink(missing_ok=True)  # left by a killed writer, perhaps with another mode
    try:
        with open(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode), "wb") as file:
            file.writelines([content] if isinstance(content, bytes) else content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(draft, path)
    except BaseException:
        draft.unlink(missing_ok=True)  # frees the space on a full disk
        raise
