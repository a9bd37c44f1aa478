"""Times that instructors write on a command line."""

import re
from datetime import UTC, datetime

from autograder.errors import UsageError


def parse_time(text: str) -> datetime:
    """Return the time that is written as `2026-11-20 23:59 UTC`, or with an offset; raises UsageError."""
    try:
        time = datetime.fromisoformat(re.sub(r"\s*(UTC|Z)$", "+00:00", text.strip()))
    except ValueError:
        raise UsageError(f"{text!r} is not a time: write it as '2026-11-20 23:59 UTC'") from None
    if not re.search(r"\d[ T]\d", text):
        raise UsageError(f"{text!r} has no time of day: write it as '2026-11-20 23:59 UTC'")
    if time.tzinfo is None:
        raise UsageError(f"{text!r} has no time zone: write '{text} UTC', or an offset as in '{text}+01:00'")
    try:
        return time.astimezone(UTC)
    except OverflowError:
        raise UsageError(f"{text!r} is a date or time that does not exist") from None
