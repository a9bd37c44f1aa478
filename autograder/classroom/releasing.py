"""Run in an instructor's box: releases notebooks into nbgrader's course folder, and from there into the exchange.

Without names it only sets up the course folder.
"""

import sys
from pathlib import Path

from autograder.errors import UsageError
from autograder.gradebook.release import release, set_up
from autograder.results.targets import GRADEBOOK


def main(course: Path, names: list[str]) -> None:
    """Release these notebooks; ends with one line and exit status 1 when one cannot be released."""
    if not names:
        set_up(course)
        return
    from nbgrader.apps import NbGrader, NbGraderAPI  # takes most of the time of setting up

    from autograder.gradebook import database

    try:
        release(course, names)
    except UsageError as error:
        sys.exit(str(error))
    database.share(course / GRADEBOOK)
    app = NbGrader()
    app.load_config_file()  # names the exchange
    nbgrader = NbGraderAPI(config=app.config)
    for name in names:
        done = nbgrader.release_assignment(name)
        if not done["success"]:
            said = (done.get("error") or done.get("log") or "no reason was given").strip()
            sys.exit(f"nbgrader could not release {name}: {said.splitlines()[-1]}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
