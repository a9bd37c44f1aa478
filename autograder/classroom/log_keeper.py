"""Keeps the end of what a program says: `python -m autograder.classroom.log_keeper FILE` reads it from standard input.

The hub and its proxy write a line for many a request, with the address that somebody has made up.
"""

import logging
import sys
from logging.handlers import RotatingFileHandler

MOST = 8 << 20  # bytes of FILE, and of FILE.1, which has what came before
LONGEST = 2000  # bytes of a line that are kept


def main() -> None:
    """Read until nobody writes any more."""
    log = RotatingFileHandler(sys.argv[1], maxBytes=MOST, backupCount=1, encoding="utf-8")
    begun = False
    while part := sys.stdin.buffer.readline(LONGEST):
        if not begun:
            log.emit(logging.makeLogRecord({"msg": part.decode(errors="replace").rstrip("\n")}))
        begun = not part.endswith(b"\n")


if __name__ == "__main__":
    main()
