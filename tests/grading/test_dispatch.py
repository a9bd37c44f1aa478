"""The choice of a worker for each submission, with workers that exist only here: no Dask, processes or programs."""

import os
import signal
from collections.abc import Callable, Iterator, Mapping

import pytest

from autograder.errors import ClusterError, SandboxUnavailable, WorkerLost
from autograder.grading import dispatch
from autograder.grading.dispatch import Dispatcher, Task
from autograder.grading.single import given_up
from autograder.records import INFRASTRUCTURE_ERROR, KILLED_WORKERS, Report, Submission
from autograder.submissions import exercises

PATIENCE = 20  # looks at the workers after the story is over


class FakeGrading:
    """A grading that ends when the story says so."""

    def __init__(self, task: Task):
        self.task = task
        self._end: Report | Exception | None = None
        self._callback: Callable[[FakeGrading], object] | None = None

    def add_done_callback(self, callback: Callable[["FakeGrading"], object]) -> None:
        self._callback = callback

    def finish(self, error: Exception | None = None) -> None:
        self._end = error or given_up(self.task.submission, exercises.load("services"), self.task.seed, "")
        self._callback(self)

    def report(self) -> Report:
        if isinstance(self._end, Exception):
            raise self._end
        return self._end


class FakePool:
    """Workers, by address; whenever the dispatcher looks at them, the story goes on to its next `yield`."""

    def __init__(self, story: Callable[["FakePool"], Iterator[None]], **there: int):
        self.there: Mapping[str, int] = there
        self.sent: list[FakeGrading] = []
        self.broken_off: list[FakeGrading] = []
        self._story = story(self)
        self._patience = PATIENCE

    def workers(self) -> Mapping[str, int]:
        try:
            next(self._story)
        except StopIteration:
            self._patience -= 1
            assert self._patience, "the story is over, and the dispatcher is still waiting"
        return self.there

    def send(self, task: Task) -> FakeGrading:
        self.sent.append(FakeGrading(task))
        return self.sent[-1]

    def report(self, grading: FakeGrading) -> Report:
        return grading.report()

    def cancel(self, gradings: list[FakeGrading]) -> None:
        self.broken_off += gradings

    @property
    def log(self) -> list[tuple[str, str]]:
        """Return who was sent where."""
        return [(grading.task.submission.student, grading.task.worker) for grading in self.sent]


def tasks(*students: str) -> Iterator[Task]:
    return (Task(Submission(student, "services"), seed) for seed, student in enumerate(students))


def names(reports: list[Report]) -> list[str]:
    return [report.student for report in reports]


@pytest.fixture(autouse=True)
def hurry(monkeypatch):
    monkeypatch.setattr(dispatch, "GLANCE", 0.001)
    before = signal.getsignal(signal.SIGINT)
    yield
    assert signal.getsignal(signal.SIGINT) == before, "Ctrl-C is as it was"


def test_workers_get_what_they_can_do_at_once():
    def story(pool):
        yield  # all free workers are sent something
        assert pool.log == [("ada", "a"), ("bob", "a"), ("cyd", "b")]
        pool.sent[1].finish()
        yield  # its report is given, and then the next is sent
        yield
        assert pool.log[3:] == [("dan", "a")]
        for grading in (pool.sent[3], pool.sent[2], pool.sent[0]):
            grading.finish()
            yield

    pool = FakePool(story, a=2, b=1)
    reports = [*Dispatcher(pool, tasks("ada", "bob", "cyd", "dan")).run()]
    assert names(reports) == ["bob", "dan", "cyd", "ada"], "in the order they are done"
    assert [report.seed for report in reports] == [1, 3, 2, 0]
    assert pool.broken_off == []


def test_submissions_are_taken_one_by_one():
    """A class need not be in memory."""
    taken = []

    def counted() -> Iterator[Task]:
        for task in tasks("ada", "bob", "cyd"):
            taken.append(task.submission.student)
            yield task

    def story(pool):
        for number in range(3):
            yield
            assert len(taken) == len(pool.sent) == number + 1
            pool.sent[-1].finish()
            yield

    pool = FakePool(story, a=1)
    assert names([*Dispatcher(pool, counted()).run()]) == ["ada", "bob", "cyd"]


def test_nothing_to_grade():
    assert [*Dispatcher(FakePool(lambda pool: iter(()), a=1), tasks()).run()] == []


def test_what_a_dead_worker_had_goes_to_another_one_first():
    def story(pool):
        yield
        assert pool.log == [("ada", "a"), ("bob", "b")]
        pool.there = {"b": 1}
        yield  # a is missed
        assert pool.broken_off == [pool.sent[0]]
        pool.sent[0].finish()  # nobody waits for it any more
        yield
        pool.sent[1].finish()
        yield
        yield
        assert pool.log[2:] == [("ada", "b")], "cyd waits"
        pool.sent[2].finish()
        yield
        yield
        assert pool.log[3:] == [("cyd", "b")]
        pool.sent[3].finish()

    pool = FakePool(story, a=1, b=1)
    assert names([*Dispatcher(pool, tasks("ada", "bob", "cyd")).run()]) == ["bob", "ada", "cyd"]


@pytest.mark.parametrize("told", [False, True], ids=["the worker is missed", "its grading ends"])
def test_a_submission_that_loses_two_workers_is_given_up(told):
    """And the rest of the class is graded."""

    def story(pool):
        yield
        for worker in ("a", "b"):
            assert pool.log[-1] == ("ada", worker)
            if told:
                pool.sent[-1].finish(WorkerLost("it died"))
            pool.there = {{"a": "b", "b": "c"}[worker]: 1}
            while pool.log[-1][1] == worker:
                yield
        assert pool.log == [("ada", "a"), ("ada", "b"), ("bob", "c")]
        pool.sent[-1].finish()

    pool = FakePool(story, a=1)
    reports = [*Dispatcher(pool, tasks("ada", "bob")).run()]
    assert [(report.student, report.status, report.flags) for report in reports] == [
        ("ada", INFRASTRUCTURE_ERROR, [KILLED_WORKERS]),
        ("bob", INFRASTRUCTURE_ERROR, [""]),
    ]
    assert reports[0].score is None and reports[0].seed == 0


def test_a_lost_scheduler_is_no_workers_death():
    """All gradings are cancelled then, many times over, and nobody is given up."""

    def story(pool):
        yield
        for times in range(1, 5):
            assert pool.log == [("ada", "a")] * times
            pool.there = {}
            yield
            assert pool.broken_off == []
            pool.sent[-1].finish(WorkerLost("cancelled"))
            yield  # asked whether anybody is there
            yield
            pool.there = {"a": 1}
            while len(pool.sent) == times:
                yield
        pool.sent[-1].finish()

    pool = FakePool(story, a=1)
    (report,) = Dispatcher(pool, tasks("ada")).run()
    assert report.flags == [""] and pool.sent[-1].task.lost == 0


def test_without_workers_it_stops_after_a_while(monkeypatch):
    monkeypatch.setattr(dispatch, "WELCOME", 0.2)

    def story(pool):
        yield
        pool.there = {}
        while True:
            yield

    pool = FakePool(story, a=1)
    with pytest.raises(ClusterError, match="there has been no worker for"):
        [*Dispatcher(pool, tasks("ada")).run()]
    assert pool.broken_off == pool.sent


def test_ctrl_c_breaks_off_what_runs():
    def story(pool):
        yield
        pool.sent[0].finish()
        yield
        os.kill(os.getpid(), signal.SIGINT)
        while True:
            yield

    pool, reports = FakePool(story, a=1, b=1), []
    with pytest.raises(KeyboardInterrupt):
        reports.extend(Dispatcher(pool, tasks("ada", "bob")).run())
    assert names(reports) == ["ada"] and pool.broken_off == pool.sent[1:]


def test_looking_for_what_has_ended_never_waits_beyond_its_limit():
    """The shortest limit passes while the wait begins, as a longer one does on a machine that is held up."""
    inbox = dispatch.Inbox()
    assert [inbox.get(1e-9) for _ in range(10_000)] == [None] * 10_000
    inbox.put("first")
    inbox.put("second")
    assert [inbox.get(20.0), inbox.get(20.0)] == ["first", "second"]


def test_what_a_worker_raises_comes_out():
    def story(pool):
        yield
        pool.sent[0].finish(SandboxUnavailable("bwrap is not installed"))
        while True:
            yield

    pool = FakePool(story, a=1, b=1)
    with pytest.raises(SandboxUnavailable, match="bwrap"):
        [*Dispatcher(pool, tasks("ada", "bob")).run()]
    assert pool.broken_off == pool.sent[1:]


def test_a_caller_that_stops_leaves_nothing_running():
    def story(pool):
        yield
        pool.sent[0].finish()

    pool = FakePool(story, a=1, b=1)
    reports = Dispatcher(pool, tasks("ada", "bob")).run()
    assert next(reports).student == "ada"
    reports.close()
    assert pool.broken_off == pool.sent[1:]
