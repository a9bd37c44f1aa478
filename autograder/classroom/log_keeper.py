"""Keeps the end of a program's log: `python -m autograder.classroom.log_keeper FILE` reads it from standard input.

The hub and its proxy log many requests with their URLs, which anybody can make up and make long.
"""

import logging
import sys
from logging.handlers import RotatingFileHandler

MOST = 8 << 20  # bytes of FILE, and of FILE.1, which has the lines before it
LONGEST = 2000  # bytes kept of one line


def main() -> None:
    """Read until standard input is closed."""
    log = RotatingFileHandler(sys.argv[1], maxBytes=MOST, backupCount=1, encoding="utf-8")
    begun = False
    while part := sys.stdin.buffer.readline(LONGEST):
        if not begun:
            log.emit(logging.makeLogRecord({"msg": part.decode(errors="replace").rstrip("\n")}))
        begun = not part.endswith(b"\n")


if __name__ == "__main__":
    main()
