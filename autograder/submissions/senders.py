"""The senders of hand-ins: the platform's number of each, compared with the student's number in the roster."""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from autograder.platforms import PLATFORMS, users_are_global
from autograder.submissions import provenance
from autograder.submissions.provenance import Source
from autograder.submissions.roster import Roster


@dataclass(frozen=True)
class Senders:
    """The senders of the hand-ins that were collected from a platform, by student and exercise, and the roster."""

    roster: Roster | None
    came: dict[tuple[str, str], list[Source]]  # those from a platform alone, the laid-out hand-in's last

    @classmethod
    def read(cls, submitted: Path, keys: Iterable[tuple[str, str]], roster: Roster | None) -> "Senders":
        """Read where these hand-ins came from."""
        found = {key: [came for came in provenance.read(submitted, *key) if came.platform in PLATFORMS] for key in keys}
        return cls(roster, {key: came for key, came in found.items() if came})

    def number(self, key: tuple[str, str], platform: str) -> str:
        """Return the platform's number of the laid-out hand-in's sender; '' if it did not come from there."""
        came = self.came.get(key)
        return came[-1].user if came and came[-1].platform == platform else ""

    def contradicted(self, key: tuple[str, str]) -> tuple[Source, str, str] | None:
        """Return the origin of a hand-in whose sender is not its student, and the student's number and its column."""
        if key not in self.came:
            return None
        last = self.came[key][-1]
        own = self.other(key, last.platform, last.user)
        return (last, *own) if own else None

    def other(self, key: tuple[str, str], platform: str, number: str) -> tuple[str, str] | None:
        """Return the student's number and its column if `number` of the platform, for the exercise, is not theirs."""
        student, assignment = key
        columns = self._columns[_scope(platform, assignment)]
        return self.roster.other_number(student, number, columns) if self.roster else None

    @cached_property
    def _columns(self) -> dict[tuple[str, str], set[str]]:
        """Return the roster's columns that hold the numbers of a platform: those with a sender's number.

        So does the column called after a platform whose numbers are the same everywhere, such as `canvas_id`.
        """
        columns: dict[tuple[str, str], set[str]] = defaultdict(set)
        if not self.roster:
            return columns
        for name, platform in PLATFORMS.items():
            if platform.global_users and self.roster.has_numbers(f"{platform.form}_id"):
                columns[_scope(name, "")].add(f"{platform.form}_id")
        for (student, assignment), every in self.came.items():
            for came in every:
                columns[_scope(came.platform, assignment)] |= self.roster.columns(student, came.user)
        return columns


def _scope(platform: str, assignment: str) -> tuple[str, str]:
    """Return the scope in which a user's number means one person: everywhere for Canvas, an exercise for Moodle."""
    return platform, "" if users_are_global(platform) else assignment
