"""The form in which a time is shown."""

MINUTES = "%Y-%m-%d %H:%M"  # as in 2026-11-30 14:05
