"""The version of nbgrader's database schema, read without a program of its own."""

from alembic.config import Config
from alembic.script import ScriptDirectory
from nbgrader import api, dbutil


def version() -> str:
    """Return the newest version of the schema, which nbgrader writes into each new gradebook."""
    config = Config()
    config.set_main_option("script_location", dbutil.ALEMBIC_DIR)
    return ScriptDirectory.from_config(config).get_current_head() or ""


def read_in_process() -> None:
    """Have nbgrader call `version`: it would run the program `alembic`, from PATH and for most of a second."""
    api.get_alembic_version = version
