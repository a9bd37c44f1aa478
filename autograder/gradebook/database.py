"""nbgrader's database: the version of its schema, read without a program of its own, and who may write it."""

import stat
from pathlib import Path

from alembic.config import Config
from alembic.script import ScriptDirectory
from nbgrader import api, dbutil

SHARED = 0o660  # all instructors are in the group that has the course folder


def version() -> str:
    """Return the newest version of the schema, which nbgrader writes into each new gradebook."""
    config = Config()
    config.set_main_option("script_location", dbutil.ALEMBIC_DIR)
    return ScriptDirectory.from_config(config).get_current_head() or ""


def read_version_in_process() -> None:
    """Have nbgrader call `version`: it would run the program `alembic`, from PATH and for most of a second."""
    api.get_alembic_version = version


def share(gradebook: Path) -> None:
    """Let all instructors write a gradebook, which nbgrader makes for one alone.

    One that is shared already may be another instructor's.
    """
    if stat.S_IMODE(gradebook.stat().st_mode) != SHARED:
        gradebook.chmod(SHARED)
