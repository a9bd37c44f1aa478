"""How a hidden test ends, and the pytest plugin that turns each end into a verdict.

A test ends well, or raises a `Fault`: the student's program did wrong, died or did not answer.  Anything else that it
raises is the grader's own failure, and no verdict.
"""

import signal
import traceback
from collections.abc import Callable

import pytest

from autograder.errors import Fault, TimedOut
from autograder.records import PASSED, Verdict

BENCH = pytest.StashKey()


def points(number: float, cell: str) -> Callable:
    """Mark a hidden test with its points, and the notebook's grade cell that they belong to.

    `exercises` reads both from the source, so they must be written as literals.
    """
    return pytest.mark.points(number, cell=cell)


class Judge:
    """The pytest plugin: reports one verdict a test, and stops at the first fault of the grader's own."""

    def __init__(self, bench, report: Callable[[Verdict], None]):
        """`bench` (a `session.Bench`) is what the suites' fixture of that name gives."""
        self.bench = bench
        self.report = report
        self.fault = ""  # the grader's own, as a traceback
        self._ends: dict[str, BaseException | None] = {}
        self._in_test = False

    def interrupt(self, *_) -> None:
        """End the test that goes on after the time is used up; a handler of SIGALRM."""
        if self._in_test:
            raise TimedOut("Your programs were so slow in this test that the time for all tests was used up.")
        signal.setitimer(signal.ITIMER_REAL, 1.0)  # not in the middle of pytest

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item):
        """A test runs."""
        return (yield from self._interruptible())

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef, request):
        """What a test needs is made."""
        return (yield from self._interruptible())

    def _interruptible(self):
        before, self._in_test = self._in_test, True
        try:
            return (yield)
        finally:
            self._in_test = before

    def pytest_configure(self, config):
        """Hand the bench to the suites, and know their one marker."""
        config.stash[BENCH] = self.bench
        config.addinivalue_line("markers", "points(number, cell): what a test is worth, and where")

    def pytest_collectreport(self, report):
        """A suite that cannot be loaded has no tests."""
        if report.failed:
            self.fault = self.fault or str(report.longrepr)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item):
        """Start no test when the time is used up."""
        if self.bench.clock.left <= 0:
            raise TimedOut("Not tried: your programs were too slow in the tests before, and the time was used up.")

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item, call):
        """Judge by what the phases of a test raised."""
        report = yield
        if call.excinfo is not None and not self._ends.get(item.name):
            self._ends[item.name] = call.excinfo.value
        if call.when == "teardown":
            self._conclude(item)
        return report

    def _conclude(self, item) -> None:
        end = self._ends.pop(item.name, None)
        if end is None:
            self.report(Verdict(item.name, PASSED))
        elif isinstance(end, Fault):
            self.report(Verdict(item.name, end.outcome, end.message, end.detail))
        else:
            self.fault = "".join(traceback.format_exception(end))
            item.session.shouldstop = "the grader itself failed"
