"""The outcomes of a hidden test, and the pytest plugin that turns each end into a verdict.

A test that returns is passed.  A test that raises a `Fault` is lost: the student's program did something wrong, died or
gave no answer.  Any other exception is a failure of the grader itself, and no verdict.
"""

import functools
import inspect
import os
import resource
import signal
import sys
import traceback
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from typing import ParamSpec, TypeVar

import pytest

from autograder.errors import Fault, TimedOut, Wrong
from autograder.records import FAILED, PASSED, Verdict
from autograder.sandbox.sandbox import MEMORY
from autograder.sandbox.traffic import WHY
from autograder.suitekit.bench import Bench
from autograder.suitekit.lifecycle import USED_UP
from autograder.suitekit.ros import EMPTIED, LONGEST
from autograder.suitekit.untrusted import NEVER_OURS

BENCH = pytest.StashKey[Bench]()
FULL = MEMORY // 2  # bytes: several times what judging takes, and half of the launcher's limit
TOO_LONG = f" (What is longer than {LONGEST:,} is read as if it were empty: {{}}.)"
NOT_READ = (
    "The grader cannot read your file, or what your program sent or printed here: it is nested too deeply, or a number "
    "in it is too large. Write, send and print only what the task asks for."
)
POSTPONED = 1.0  # s until the next alarm, if the time was used up between two tests

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def points(number: float, cell: str) -> pytest.MarkDecorator:
    """Mark a hidden test with its points, and with the notebook's grade cell that they belong to.

    `submissions.exercises` reads both from the source, so they must be written as literals.
    """
    return pytest.mark.points(number, cell=cell)


def twice(test: Callable[Parameters, None]) -> Callable[Parameters, None]:
    """Run a test again when it finds something wrong: a lost message is rare, but a mistake shows every time."""

    @functools.wraps(test)
    def judge(*args: Parameters.args, **kwargs: Parameters.kwargs) -> None:
        try:
            test(*args, **kwargs)
        except Wrong:
            test(*args, **kwargs)

    return judge


@contextmanager
def on_wrong(again: Callable[[], None]) -> Iterator[None]:
    """Call `again` when the block finds something wrong, to prepare a new sample for the second run of `@twice`."""
    try:
        yield
    except Wrong:
        again()
        raise


class Judge:
    """The pytest plugin: reports one verdict for each test, and stops when the grader itself fails."""

    def __init__(self, bench: Bench, report: Callable[[Verdict], None]):
        """Report by `report`; `bench` is the value of the suites' fixture of that name."""
        self.bench = bench
        self.report = report
        self.fault = ""  # the grader's own failure, as a traceback
        self._ends: dict[str, BaseException] = {}  # the first exception of each test, by name
        self._in_test = False

    def interrupt(self, *_: object) -> None:
        """End the running test when the time is used up; a handler of SIGALRM."""
        if self._in_test:
            raise TimedOut("Your programs were so slow in this test that the time for all tests was used up.")
        signal.setitimer(signal.ITIMER_REAL, POSTPONED)  # an exception inside pytest itself would end pytest

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self) -> Generator[None, Result, Result]:
        """Allow the interruption of a running test."""
        return (yield from self._interruptible())

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self) -> Generator[None, Result, Result]:
        """Allow the interruption of a fixture's set-up."""
        return (yield from self._interruptible())

    def _interruptible(self) -> Generator[None, Result, Result]:
        before, self._in_test = self._in_test, True
        try:
            return (yield)
        finally:
            self._in_test = before

    def pytest_configure(self, config: pytest.Config) -> None:
        """Pass the bench to the fixtures, and register the suites' marker."""
        config.stash[BENCH] = self.bench
        config.addinivalue_line("markers", "points(number, cell): what a test is worth, and in which grade cell")

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Keep why a suite cannot be loaded."""
        if report.failed:
            self.fault = self.fault or str(report.longrepr)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self) -> None:
        """Start no test when the time is used up."""
        if self.bench.clock.left <= 0:
            raise TimedOut(USED_UP)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Judge a test by what its set-up, its call and its tear-down raised."""
        report = yield
        if call.excinfo is not None:
            self._ends.setdefault(item.name, call.excinfo.value)
        if call.when == "teardown":
            self._conclude(item)
        return report

    def _conclude(self, item: pytest.Item) -> None:
        end, emptied = self._ends.pop(item.name, None), [*EMPTIED]
        EMPTIED.clear()
        if end is None:
            self.report(Verdict(item.name, PASSED))
        elif isinstance(end, Fault):
            certain = end.certain or _is_of_files(item) or WHY in end.message or bool(emptied)
            message = end.message + "".join(TOO_LONG.format(what) for what in emptied)
            self.report(Verdict(item.name, end.outcome, message, end.detail, certain))
        elif isinstance(end, NEVER_OURS):
            why = f"{type(end).__name__}: {end}"
            self.report(Verdict(item.name, FAILED, NOT_READ, why, certain=True))
        elif isinstance(end, MemoryError) or _has_taken() > FULL:
            # The student's program has sent more than this process can hold, which counts like a crash.  Lack of memory
            # has many symptoms: no thread can be started, no node can be made.
            sys.stderr.write("".join(traceback.format_exception(end)))
            sys.stderr.flush()
            os.abort()
        else:
            self.fault = "".join(traceback.format_exception(end))
            item.session.shouldstop = "the grader itself failed"


def _is_of_files(item: pytest.Item) -> bool:
    """Return True if a test looks at the handed-in files alone, and runs no program."""
    return isinstance(item, pytest.Function) and {*inspect.signature(item.function).parameters} == {"submission"}


def _has_taken() -> int:
    """Return the peak memory (bytes) of this process."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10
