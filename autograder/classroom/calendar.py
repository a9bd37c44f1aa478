"""Releases exercises at their dates, and tells students their dates; a service that the hub starts and ends."""

import contextlib
import os
import sys
import threading
from datetime import UTC, datetime
from pathlib import Path

from autograder.classroom import assignments, course_files, deadlines, hub
from autograder.classroom.plan import Classroom
from autograder.errors import AutograderError

LOOK, AGAIN = 10.0, 60.0  # s between two looks at the dates, and after an error


def release_what_is_due(folder: Path) -> list[str]:
    """Release the exercises whose time has come, and tell students their dates; return the exercises' names.

    Raises AutograderError and OSError.
    """
    classroom = Classroom.load(folder)
    if not assignments.to_release(classroom, datetime.now(UTC)) and not deadlines.out_of_date(classroom):
        return []
    with hub.alone(classroom):
        names = assignments.to_release(classroom, datetime.now(UTC))
        for name in course_files.release(classroom, names):
            print(f"Released {name}, at its date.", flush=True)
        for line in course_files.hand_out_notebooks(classroom) if names else ():
            print(line, flush=True)
        deadlines.publish(classroom)
    return names


def main(folder: Path) -> None:
    """Look at the dates for as long as the hub runs."""
    parent, said = os.getppid(), ""
    while os.getppid() == parent:  # ends when the hub was killed and this process was left behind
        try:
            release_what_is_due(folder)
            said = ""
        except (AutograderError, OSError) as error:
            if str(error) != said:
                said = str(error)
                print(
                    f"Exercises are not released at their dates, nor dates published: {said}",
                    file=sys.stderr,
                    flush=True,
                )
        threading.Event().wait(AGAIN if said else LOOK)


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):  # with which the hub ends it
        main(Path(sys.argv[1]))
