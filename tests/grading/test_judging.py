"""The process that judges: confined as the programs that it hears, and no way to a score, or to none, when it dies."""

import contextlib
import logging
import os
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import psutil
import pytest

from autograder import cli
from autograder.errors import InfrastructureError, JudgeDied
from autograder.grading import admission, single
from autograder.grading.judge_process import LIMITS
from autograder.grading.launcher import JUDGE
from autograder.paths import HIDDEN, PACKAGE
from autograder.records import (
    BUSY_MACHINE,
    CRASHED,
    FAILED,
    GRADED,
    KILLED_JUDGE,
    NOT_RUN,
    PASSED,
    Submission,
    Verdict,
    from_line,
)
from autograder.results import feedback
from autograder.sandbox import machine_load, seccomp, users
from autograder.sandbox.usage import running
from autograder.submissions import exercises
from course.foundation.waiting import wait_until
from tests.hidden import answers
from tests.hidden.answers.services import REFERENCE

THREADS = 40  # of the judge at least, one for each ROS domain
HALF = REFERENCE | {"motor_service.py": b"def main(:\n"}  # ends at once, so it is judged quickly: 10 of 20 points


def judges() -> list[psutil.Process]:
    """The processes of this test's gradings that judge: forks of the process that has loaded ROS 2.

    A fork of theirs is none, which looks the same until it has become a program.
    """
    found = []
    for process in psutil.Process().children(recursive=True):
        with contextlib.suppress(psutil.Error):
            loaded = process.parent()
            above = loaded and loaded.parent()  # None: one of them has ended meanwhile
            is_fork = above and JUDGE in process.cmdline() and JUDGE in loaded.cmdline()[:6]
            if is_fork and JUDGE not in above.cmdline()[:6]:
                found.append(process)
    return found


def confined(process: psutil.Process) -> bool:
    """Return True if it has given up what it may do."""
    with contextlib.suppress(OSError):
        status = Path(f"/proc/{process.pid}/status").read_text()
        return ("NoNewPrivs:\t1" in status and "Seccomp:\t2" in status) or not seccomp.available()
    return False


@pytest.fixture
def grading(confinement):
    """A grading that has begun; its report is in the list when it has ended."""
    report = []
    thread = threading.Thread(
        target=lambda: report.append(single.grade(Submission("s", "services", HALF), confinement))
    )
    thread.start()
    yield report, thread
    thread.join()


def zombies() -> set[int]:
    """The dead below this process that nobody has waited for."""
    return {child.pid for child in psutil.Process().children(recursive=True) if child.status() == psutil.STATUS_ZOMBIE}


def test_a_worker_buries_what_programs_leave(confinement):
    """Each program ends with its wrapper, and what is left of that falls to the worker: a thousand in a large class."""
    before = zombies()  # which other tests have left, where this is the first process of a container
    part = exercises.load("services").part("test_status", "test_relay_answers")  # a program each
    for _ in range(2):
        judgement = single.judge(part, REFERENCE, confinement, 1, 1.0)
        assert {verdict.outcome for verdict in judgement.verdicts.values()} == {PASSED}
    assert zombies() <= before


AS_FIRST = """
import ctypes, psutil
from autograder.grading.worker import Worker
from course.foundation.waiting import wait_until

assert ctypes.CDLL(None).prctl(36, 1, 0, 0, 0) == 0  # PR_SET_CHILD_SUBREAPER: orphans below come to this process
worker = Worker({confinement!r})
assert wait_until(psutil.Process(worker._process.pid).children, 20)
worker.close()
print(psutil.Process().children(recursive=True))
"""


BURNS = b"import time\nwhile time.process_time() < 1.5: pass\n"


def test_what_programs_use_of_the_processor_is_known_when_they_have_ended(confinement, monkeypatch):
    """By it, the next gradings of the exercise are admitted."""
    learnt = []
    monkeypatch.setattr(admission, "learn", lambda *given: learnt.append(given))
    part = exercises.load("services").part("test_status")
    single.judge(part, REFERENCE | {"motor_service.py": BURNS + REFERENCE["motor_service.py"]}, confinement, 1, 1.0)
    ((name, used, seconds),) = learnt
    assert name == "services" and 1.5 < used < 1.5 + admission.cores() * seconds


def test_a_worker_that_is_ended_leaves_nothing_to_the_first_process_of_a_container(confinement):
    code = AS_FIRST.format(confinement=confinement)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.stdout, done.stderr) == ("[]\n", "")


def test_it_is_confined_in_all_its_threads(confinement, grading):
    report, thread = grading
    assert wait_until(lambda: any(map(confined, judges())), 30)
    judge = judges()[0].pid
    seen = []
    for task in Path(f"/proc/{judge}/task").iterdir():
        lines = (line.split(":", 1) for line in (task / "status").read_text().splitlines())
        seen.append({name: value.strip() for name, value in lines})
    assert len(seen) >= THREADS
    for status in seen:
        assert not any(status[name].strip("0") for name in ("CapInh", "CapPrm", "CapEff", "CapAmb"))
        assert (status["NoNewPrivs"], status["Seccomp"]) == ("1", "2" if seccomp.available() else "0")
        if confinement == "root":
            assert not status["CapBnd"].strip("0")
            assert {int(number) for number in status["Uid"].split()} <= set(users.SPARE)
    limits = Path(f"/proc/{judge}/limits").read_text()
    assert f"Max data size             {LIMITS['data']} " in limits
    root = Path(f"/proc/{judge}/root")
    assert list((root / HIDDEN.relative_to("/")).iterdir()) == []
    for folder in ("notebooks", "solutions", "tests"):
        assert not (root / PACKAGE.parent.relative_to("/") / folder).exists()
    thread.join()
    assert (report[0].status, report[0].score, report[0].flags) == (GRADED, 10, [])


def kill(times: int) -> int:
    """Have the judges of this test's gradings die of a segmentation fault, that many of them; returns how many did."""
    killed = set()
    while len(killed) < times and wait_until(lambda: {judge.pid for judge in judges()} - killed, 20):
        for judge in {judge.pid for judge in judges()} - killed:
            os.kill(judge, signal.SIGSEGV)
            killed.add(judge)
    return len(killed)


def test_one_that_dies_once_costs_nothing_and_is_told(grading):
    report, thread = grading
    assert kill(1) == 1
    thread.join()
    assert (report[0].status, report[0].score, report[0].flags) == (GRADED, 10, [KILLED_JUDGE])
    assert "SIGSEGV" in report[0].details["fault"]
    assert "the process that tests them died" in feedback.page(report[0])


def test_dying_each_time_is_the_doing_of_what_was_handed_in(grading):
    report, thread = grading
    assert kill(single.TRIES) == single.TRIES
    thread.join()
    graded = report[0]
    assert (graded.status, graded.flags) == (GRADED, [KILLED_JUDGE])
    # The longest try may have come to motor_service.py, which does not start.
    assert {test.outcome for test in graded.tests} - {CRASHED} <= {PASSED, NOT_RUN}
    assert NOT_RUN in {test.outcome for test in graded.tests}
    assert graded.score == sum(test.points for test in graded.tests if test.outcome == PASSED) < graded.max_score
    assert all("crashed the grading process" in test.message for test in graded.tests if test.outcome == NOT_RUN)
    assert "SIGSEGV" in graded.details["fault"]


def test_chosen_tests_are_judged_alone_and_make_no_grade(judge):
    chosen = ["test_status", "test_relay_answers"]
    judgement = judge(REFERENCE, "services", *chosen).result()
    assert judgement.status == GRADED
    assert {test: verdict.outcome for test, verdict in judgement.verdicts.items()} == dict.fromkeys(chosen, PASSED)
    part = exercises.load("services").part(*chosen)
    with pytest.raises(ValueError, match="a grade needs all hidden tests"):
        single.grade(Submission("s", "services", REFERENCE), "root", exercise=part)


@pytest.mark.parametrize("names", [[], ["test_of_nothing"], ["test_status", "test_of_nothing"]])
def test_only_tests_of_the_exercise_can_be_chosen(names):
    with pytest.raises(ValueError, match="must be judged by some of its hidden tests"):
        exercises.load("services").part(*names)


@pytest.mark.parametrize("whole", [True, False])
def test_verdicts_on_other_tests_than_the_expected_are_no_judgement(confinement, whole):
    """More tests than expected when all are run, and fewer when the suite lacks a chosen one."""
    exercise, ended = exercises.load("services"), dict.fromkeys(REFERENCE, b"def main(:\n")  # all is lost at once
    missing = replace(exercise.tests[0], id="test_of_nothing")
    expected = exercise.tests[:1] if whole else (*exercise.tests[:1], missing)
    with pytest.raises(InfrastructureError, match="not on"):
        single.judge(replace(exercise, tests=expected, whole=whole), ended, confinement, 1, 1.0)


def test_a_grade_is_always_by_the_whole_suite(monkeypatch):
    """Whatever the files are called: nothing of a submission decides which tests are run."""
    jobs = []

    class Process:
        def run(self, job):
            jobs.append(job)
            raise InfrastructureError("not run")

    monkeypatch.setattr(single, "worker", lambda confinement: contextlib.nullcontext(Process()))
    files = REFERENCE | {"chosen": b"test_status", "suite.py": b"", "job.json": b'{"chosen": ["test_status"]}'}
    single.grade(Submission("s", "services", files), "root")
    assert [job.chosen for job in jobs] == [[]] * single.TRIES


def judgements(monkeypatch, *each: tuple[float, int]) -> list[float]:
    """Have the next judgements be of a machine that busy, with so many tests lost; returns the list they come from."""
    left = list(each)

    def judge(exercise, *_):
        busy, lost = left.pop(0)
        ids = [test.id for test in exercise.tests]
        verdicts = {test: Verdict(test, FAILED if number < lost else PASSED) for number, test in enumerate(ids)}
        return single.Judgement(GRADED, verdicts, busy=busy)

    monkeypatch.setattr(single, "judge", judge)
    monkeypatch.setattr(single.machine_load, "wait_for_calm", lambda timeout: True)
    return left


STARVED = machine_load.STARVED + 1


@pytest.mark.parametrize(
    ("busy", "suspects", "lost"), [(1.0, [], ["test_status"]), (STARVED, [], []), (1.0, ["relay.py"], ["test_status"])]
)
def test_what_was_lost_before_the_judge_died_stays_lost(monkeypatch, busy, suspects, lost):
    """A program that sees that it loses must not get another chance by killing its judge; who sends much is not run."""
    refused = []

    def judge(exercise, files, confinement, seed, patience, without):
        refused.append([*without])
        if len(refused) == 1:
            raise JudgeDied("killed", [Verdict("test_status", FAILED, "once"), Verdict("odd", FAILED)], suspects, busy)
        return single.Judgement(GRADED, {test.id: Verdict(test.id, PASSED) for test in exercise.tests})

    monkeypatch.setattr(single, "judge", judge)
    report = single.grade(Submission("s", "services", REFERENCE), "root", seed=1)
    assert ([test.id for test in report.tests if test.outcome != PASSED], report.flags) == (lost, [KILLED_JUDGE])
    assert refused == [[], suspects]
    assert len(report.tests) == len(exercises.load("services").tests)


def test_what_was_lost_before_the_grader_failed_in_a_test_stays_lost(monkeypatch):
    """A program that can make a test fail in an unknown way gains nothing by the next try."""
    tried = []

    def judge(exercise, files, confinement, seed, patience, without):
        tried.append(exercise)
        if len(tried) == 1:
            raise InfrastructureError("KeyError", [Verdict("test_status", FAILED, "once")])
        return single.Judgement(GRADED, {test.id: Verdict(test.id, PASSED) for test in exercise.tests})

    monkeypatch.setattr(single, "judge", judge)
    report = single.grade(Submission("s", "services", REFERENCE), "root", seed=1)
    assert [test.id for test in report.tests if test.outcome != PASSED] == ["test_status"]
    assert (report.flags, report.details["fault"]) == ([], "KeyError")


DEEP = b"""
import os, sys
if "ask_agent" in sys.argv[0]:
    print("\\nanswers: " + %s, flush=True)
    os._exit(0)
"""
AGENT = "class WallAgent:\n    def decide_action(self, distances):\n        return {'linear': 0.0, 'angular': 0.5}\n"


@pytest.mark.parametrize(
    "text",
    [
        DEEP % b"'[' * 100_000",
        DEEP % b"'[[' + '9' * 4000 + ', 1]]'",
        f"{AGENT}x = {'0+' * 200_000}0\n".encode(),
        f"{AGENT}x = {'-' * 300_000}1\n".encode(),
    ],
)
def test_what_cannot_be_read_is_a_lost_test(judge, text):
    """Neither the grader's failure nor the end of the judging process, both of which are judged again."""
    files = answers.load("ai_integration").REFERENCE | {"wall_agent.py": text}
    judgement = judge(files, "ai_integration", "test_wall_ahead").result()
    (verdict,) = judgement.verdicts.values()
    assert (judgement.status, judgement.flags) == (GRADED, [])
    assert verdict.outcome in (FAILED, CRASHED), verdict


def test_a_deep_message_of_a_judge_that_was_taken_over_is_none():
    with pytest.raises(ValueError, match="not a message"):
        from_line(b"[" * 100_000)


@pytest.mark.parametrize(
    ("judged", "lost", "flags"),
    [
        ([(1.0, 3)], 3, []),
        ([(STARVED, 0)], 0, []),
        ([(STARVED, 3), (1.0, 0)], 0, []),
        ([(STARVED, 3), (1.0, 4)], 4, []),
        ([(STARVED, 3), (STARVED, 5), (STARVED, 2)], 2, [BUSY_MACHINE]),
        ([(STARVED, 3), (STARVED, 5), (STARVED, 6)], 3, [BUSY_MACHINE]),
        ([(STARVED, 3), (STARVED, 0)], 0, []),
    ],
)
def test_what_was_lost_on_a_starved_machine_is_judged_again(monkeypatch, judged, lost, flags):
    left = judgements(monkeypatch, *judged)
    report = single.grade(Submission("s", "services", REFERENCE), "root", seed=1)
    assert (sum(test.outcome == FAILED for test in report.tests), report.flags, left) == (lost, flags, [])


@pytest.mark.parametrize(("certain", "flags"), [(True, []), (False, [BUSY_MACHINE])])
def test_what_a_busy_machine_cannot_have_cost_is_not_judged_again(monkeypatch, certain, flags):
    tried = []

    def judge(exercise, *_):
        tried.append(exercise)
        ids = [test.id for test in exercise.tests]
        verdicts = {test: Verdict(test, FAILED if test == ids[0] else PASSED, certain=certain) for test in ids}
        return single.Judgement(GRADED, verdicts, busy=STARVED)

    monkeypatch.setattr(single, "judge", judge)
    monkeypatch.setattr(single.machine_load, "wait_for_calm", lambda timeout: True)
    assert single.grade(Submission("s", "services", REFERENCE), "root").flags == flags
    assert len(tried) == (1 if certain else single.TRIES)


def test_what_was_lost_for_certain_is_not_won_back(monkeypatch):
    """A program that was ended for what it sent gets no second chance because another test was slow."""
    left = [(STARVED, {"test_status": True, "test_success": False}), (1.0, {})]

    def judge(exercise, *_):
        busy, lost = left.pop(0)
        verdicts = [
            Verdict(test.id, FAILED, certain=lost[test.id]) if test.id in lost else Verdict(test.id, PASSED)
            for test in exercise.tests
        ]
        return single.Judgement(GRADED, {verdict.id: verdict for verdict in verdicts}, busy=busy)

    monkeypatch.setattr(single, "judge", judge)
    monkeypatch.setattr(single.machine_load, "wait_for_calm", lambda timeout: True)
    report = single.grade(Submission("s", "services", REFERENCE), "root")
    assert ([test.id for test in report.tests if test.outcome != PASSED], left) == (["test_status"], [])


@pytest.mark.parametrize(
    ("exercise", "file", "text", "test"),
    [
        ("calculator", "Calculate.srv", b"float64 a\n---\nfloat64 c\n", "test_interface_request"),
        ("services", "motor_service.py", b"import rclpy\nrclpy.innit()\n", "test_status"),
        ("calculator", "calculator_client.py", b"def main(:\n", "test_client_arguments"),
    ],
)
def test_mistakes_in_the_text_are_certain(judge, caplog, exercise, file, text, test):
    caplog.set_level(logging.DEBUG, "autograder")
    right = answers.load(exercise).RIGHT["reference"]
    (verdict,) = judge(right | {file: text}, exercise, test).result().verdicts.values()
    assert verdict.outcome in (FAILED, CRASHED) and verdict.certain, verdict
    told = caplog.text.partition("worker: ")[2]
    assert '\n  File "' in told
    assert "\nE   " not in told, "pytest's own tracebacks, which take longer than all else in a wrong answer's grading"


@pytest.mark.parametrize("text", [b"raise RuntimeError('no server: NameError')\n", b"None.response\n"])
def test_an_exception_that_waiting_too_short_may_cause_is_not_certain(judge, text):
    (verdict,) = judge(REFERENCE | {"relay.py": text}, "services", "test_relay_answers").result().verdicts.values()
    assert verdict.outcome == CRASHED and not verdict.certain


def test_check_says_why_it_judges_again(monkeypatch, tmp_path, caplog):
    """A wrong answer took more than a minute on a busy machine, and nothing said for what."""
    for name, content in REFERENCE.items():
        (tmp_path / name).write_bytes(content)
    monkeypatch.setattr(cli, "choose", lambda unsafe: "root")
    monkeypatch.setattr(logging.getLogger("autograder"), "level", logging.NOTSET)
    judgements(monkeypatch, (STARVED, 3), (1.0, 3))
    monkeypatch.setattr(sys, "argv", ["autograder", "check", str(tmp_path), "--assignment", "services"])
    with pytest.raises(SystemExit):
        cli.main()
    (line,) = [line for line in caplog.text.splitlines() if "judging again" in line]
    assert "3 tests not passed while the machine was busy" in line and "2 of 3 at most" in line


def test_what_a_grading_s_own_programs_do_makes_no_machine_busy(monkeypatch):
    load, cores = machine_load.Load(), len(os.sched_getaffinity(0))
    monkeypatch.setattr(machine_load, "runnable", lambda: 8.0)
    load.look(lambda: 7 * cores)
    assert load.average == 1.0
    monkeypatch.setattr(machine_load, "runnable", lambda: 1.0)
    load.look(lambda: pytest.fail("a calm machine is not looked through"))


def test_a_burst_that_is_over_when_it_is_counted_is_nobody_elses_load(monkeypatch):
    found = iter([40.0, 1.0])
    monkeypatch.setattr(machine_load, "runnable", lambda: next(found))
    load = machine_load.Load()
    load.look(lambda: 0)
    assert load.average == 1.0


def test_a_busy_machine_is_seen(monkeypatch):
    monkeypatch.setattr(machine_load, "WINDOW", 0.3)
    endless = [sys.executable, "-c", "while True: pass"]
    busy = [subprocess.Popen(endless) for _ in range(8 * len(os.sched_getaffinity(0)))]
    try:
        load = machine_load.Load()

        def seen() -> bool:
            load.look()
            return load.average > machine_load.STARVED

        assert wait_until(seen, 20)
        assert not machine_load.wait_for_calm(0.0)
        assert running(process.pid for process in busy) == len(busy)
    finally:
        for process in busy:
            process.kill()
            process.wait()
