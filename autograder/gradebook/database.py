"""nbgrader's database: its schema version, read without running alembic, and its permissions."""

import stat
from pathlib import Path

from nbgrader import api, dbutil

SHARED = 0o660  # all instructors are in the group of the course folder


def version() -> str:
    """Return the newest schema version, which nbgrader writes into each new gradebook."""
    from alembic.config import Config  # only a new gradebook needs alembic
    from alembic.script import ScriptDirectory

    config = Config()
    config.set_main_option("script_location", dbutil.ALEMBIC_DIR)
    return ScriptDirectory.from_config(config).get_current_head() or ""


def read_version_in_process() -> None:
    """Have nbgrader call `version` instead of running `alembic` from PATH, which takes most of a second."""
    api.get_alembic_version = version


def share(gradebook: Path) -> None:
    """Let all instructors write a gradebook; nbgrader makes it writable by its owner only.

    One that is already shared is left alone: another instructor may own it.
    """
    if stat.S_IMODE(gradebook.stat().st_mode) != SHARED:
        gradebook.chmod(SHARED)
