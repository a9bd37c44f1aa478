"""What an instructor sees of results: the report of each submission, with the hidden inputs, what was expected and got."""

from collections.abc import Iterator
from pathlib import Path

from autograder.errors import UsageError
from autograder.records import Report
from autograder.results.output import RESULTS, read_details, read_results


def reports(
    folder: Path, student: str | None = None, assignment: str | None = None
) -> Iterator[tuple[Report, dict[str, str]]]:
    """The last report of each submission in an output folder, with the details by test; raises UsageError if none."""
    found = read_results(folder)
    chosen = {
        key: report for key, report in found.items() if student in (None, key[0]) and assignment in (None, key[1])
    }
    if not chosen:
        which = " of that student and assignment" if found else f": there is no {RESULTS}, or nothing in it"
        raise UsageError(f"no results in {folder}{which}")
    details = {
        (entry["student"], entry["assignment"], entry["seed"]): entry["details"] for entry in read_details(folder)
    }
    for key, report in chosen.items():
        yield report, details.get((*key, report.seed), {})
