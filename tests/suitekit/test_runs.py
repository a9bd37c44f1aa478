"""A program that must end on its own: its command line, its end and its words, with fake programs, no ROS."""

import random
import time
from types import SimpleNamespace

import pytest

from autograder.errors import Crashed, Fault, TimedOut, Wrong
from autograder.suitekit import hints
from autograder.suitekit.bench import Bench
from autograder.suitekit.clock import Clock
from autograder.suitekit.runs import (
    Run,
    drawn,
    expect_gives_up,
    expect_patience,
    expect_patience_when_asked,
    expect_status,
    expect_usage,
    expect_words,
)
from course.session.domains import claim_domain

DOING = "without a server"


class Program:
    """A fake program that has ended, or never ends."""

    def __init__(self, status=1, output="nobody is there", raised=False, stopped="", ends=True, signal=""):
        self.output, self.raised, self.stopped = output, raised, stopped
        self.alive, self.exit_status = not ends, status if ends else None
        self.started, self.duration, self.signal = time.monotonic(), 0.01, signal

    def wait(self, timeout):
        return not self.alive

    def kill(self, why=""):
        pass

    def last_words(self):
        return self.stopped or self.output


def run(*programs, patience=0.001, late=None):
    """A run of these programs, one after the other; `late` files had another run that was late."""
    plan = [*programs]
    started = []

    def start():
        started.append(plan.pop(0) if len(plan) > 1 else plan[0])
        return started[-1]

    made = Run("client.py", start, Clock(60, patience), late)
    made.all_starts = started
    return made


def test_a_command_line_is_drawn():
    line = ["client.py", "{10..12}", "{-3..-3}", "{add|divide}", "{}", "5", "{x}"]
    lines = [drawn(line, random.Random(seed)) for seed in range(50)]
    assert {words[1] for words in lines} == {"10", "11", "12"}
    assert {words[3] for words in lines} == {"add", "divide"}
    assert all(words[:1] + words[2:3] + words[4:] == ["client.py", "-3", "{}", "5", "{x}"] for words in lines)
    assert drawn(line, random.Random(7)) == drawn(line, random.Random(7))


def test_a_client_that_was_late_in_another_run_is_not_run_a_second_time_for_being_late():
    late = set()
    for starts in (2, 1):
        hanging = run(Program(ends=False), late=late)
        with pytest.raises(TimedOut):
            hanging.finish(DOING)
        assert hanging.starts == starts
    killed = run(Program(status=134, signal="SIGABRT"), Program(), late=late)
    assert (killed.finish(DOING).exit_status, killed.starts) == (1, 2)


def test_a_client_that_gives_up_with_words_passes():
    expect_gives_up(run(Program()), "/sum")
    expect_usage(run(Program(status=2)), "with too few arguments")
    expect_gives_up(run(Program(status=255)), "/sum")  # sys.exit(-1)


@pytest.mark.parametrize(
    ("program", "kind", "message"),
    [
        (Program(status=0), Wrong, "exit status other than 0"),
        (Program(output=" \n"), Wrong, "it printed nothing"),
        (Program(status=134, signal="SIGABRT"), Crashed, "ended by the signal SIGABRT"),
        (Program(status=134, signal="SIGABRT"), Crashed, "a thread that still spins when main ends"),
        (Program(status=139, signal="SIGSEGV"), Crashed, "ended by the signal SIGSEGV"),
        (Program(raised=True, output="ValueError"), Crashed, "died: ValueError"),
        (Program(raised=True, output="ValueError", status=2), Crashed, "printed a traceback: ValueError"),
        (Program(stopped="it printed too much"), Crashed, "was stopped: it printed too much"),
        (Program(ends=False), TimedOut, "still running after 10 s"),
    ],
)
def test_a_client_that_does_not_give_up_rightly_is_told(program, kind, message):
    with pytest.raises(kind, match=message):
        expect_gives_up(run(program), "/sum")


def test_a_client_that_waits_too_little_or_says_what_it_always_says_is_told():
    with pytest.raises(Wrong, match=r"gave up 0\.0 s after its start\. .* wait for it for 1 s at least"):
        expect_gives_up(run(Program()), "/sum", least=1.0)
    with pytest.raises(Wrong, match="it only printed what it prints in other cases, too"):
        expect_gives_up(run(Program()), "/sum", beside="nobody is there\nREJECTED\n")
    expect_gives_up(run(Program()), "/sum", beside="REJECTED\n")


@pytest.mark.parametrize(
    ("asked", "lasted", "waits"),
    [
        ([0.5], 1.5, True),
        ([0.5, 1.4], 1.6, True),
        ([], 0.7, True),
        ([-3.0, 0.5], 1.6, True),  # by the run before
        ([0.5], 0.9, False),
        ([0.5], 1.4, False),
        ([0.5, 0.9], 1.1, False),
        ([-3.0, 2.0], 2.5, False),
    ],
)
def test_how_long_a_client_waits_for_an_answer_is_counted_from_its_request(asked, lasted, waits):
    program = Program()
    program.duration = lasted
    call = run(program, patience=1), "so", [program.started + after for after in asked], 1.0
    if waits:
        expect_patience_when_asked(*call)
        return
    with pytest.raises(Wrong, match=r"^So, the client gave up 0\.. s after its request: .* for 1 s at least"):
        expect_patience_when_asked(*call)


def test_what_ended_by_a_signal_is_run_again():
    twice = run(Program(status=134, signal="SIGABRT"), Program(status=1))
    expect_status(twice, DOING, 1)
    assert len(twice.all_starts) == 2


def test_a_run_that_does_not_end_is_waited_for_twice_only():
    endless = run(Program(ends=False), Program(ends=False))
    for _ in range(3):
        with pytest.raises(TimedOut):
            endless.finish(DOING)
    assert len(endless.all_starts) == 2


def test_the_exit_status_of_what_raised_is_its_own():
    assert run(Program(status=1, raised=True)).status(DOING) == 1
    assert run(Program(status=0)).status(DOING) == 0
    assert run(Program(status=139)).status(DOING) == 139  # sys.exit(139)
    with pytest.raises(Crashed, match="signal SIGKILL"):
        run(Program(status=137, signal="SIGKILL")).status(DOING)


@pytest.mark.parametrize(
    ("output", "how", "message"),
    [
        ("calling 3 4\nnobody", {"beside": "calling 1 2\nresult 3"}, ""),
        ("calling 3 4", {"beside": "calling 1 2\nresult 3"}, "prints in other cases, too"),
        ("calling 3 add", {"beside": "calling 1 divide", "ignoring": ["add", "divide"]}, "prints in other cases, too"),
        ("calling 3 add", {"beside": "calling 1 divide"}, ""),
        ("- 3\n--", {}, "it printed no word"),
        ("没有服务器", {}, ""),
        ("Error 2", {"unlike": "Error 1\n"}, "the same as when something else is wrong"),
        ("usage\nError 2", {"unlike": "Error 1\n"}, ""),
    ],
)
def test_words_must_tell_something(output, how, message):
    try:
        expect_words(run(Program(output=output)), DOING, "say so", **how)
        told = ""
    except Fault as fault:
        told = fault.message
    assert bool(told) == bool(message) and message in told


def test_a_client_that_said_what_it_must_and_was_then_ended_by_a_signal_has_said_it():
    expect_words(run(Program(status=134, signal="SIGABRT")), DOING, "say so")
    with pytest.raises(Crashed, match="ended by the signal SIGABRT"):
        expect_words(run(Program(status=134, signal="SIGABRT", output="")), DOING, "say so")


def test_a_client_looks_for_a_server_for_a_moment():
    program = Program()
    with pytest.raises(Wrong, match=r"gave up 0\.0 s after its start.* for 1 s at least"):
        expect_patience(run(program), DOING, 1.0)
    program.duration = 1.0
    expect_patience(run(program, patience=1.0), DOING, 1.0)


def test_a_run_can_be_waited_for_and_repeated():
    ended = run(Program(), Program(output="more"))
    assert not ended.until(lambda: False)
    ended.again()
    assert ended.until(lambda: ended.output == "more") and not ended.raised


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        ("TypeError: 'method' object does not support the context manager protocol (a.py, line 3)", "Node.handle"),
        ("AttributeError: property 'clients' of 'Relay' object has no setter", "property of that name"),
        (
            "AssertionError: The 'result' field must be of type 'float' (a.py, line 3)",
            "float(...) makes a float of any",
        ),
        ("ValueError: no", ""),
    ],
)
def test_what_lies_behind_an_exception_is_told(words, hint):
    told = hints.last_words(Program(output=words))
    assert told.startswith(words) and hint in told and (bool(hint) or told == words)


def test_no_program_can_tell_from_its_domain_what_is_tested():
    threads = SimpleNamespace(domains=[*range(1, 41)])
    orders = {
        tuple(bench.new_domain() for _ in threads.domains)
        for bench in (Bench({}, None, threads, None, 7) for _ in "ab")
    }
    assert len(orders) == 2 and {frozenset(order) for order in orders} == {frozenset(threads.domains)}


def test_without_a_sandbox_no_domain_is_used_that_anybody_else_uses():
    bench = Bench({}, None, None, None, 7)
    used = {bench.new_domain() for _ in range(3)}
    claims, domains = zip(*(claim_domain() for _ in range(3)), strict=True)
    used |= {bench.new_domain() for _ in range(3)}
    assert len(used) == 6 and used.isdisjoint(domains)
    for claim in claims:
        claim.close()


def test_starts_that_are_used_up_are_not_laid_to_the_programs():
    """Many starts are the grader's own: a test may need a fresh program, and a busy machine may have been slow."""
    bench = Bench({}, None, SimpleNamespace(domains=[7]), None, 7)
    bench.new_domain()
    with pytest.raises(TimedOut) as caught:
        bench.new_domain()
    assert caught.value.message == (
        "Not tested: the tests before have used up the starts that the grader has for your programs. It starts a "
        "program again when that has ended, when an answer did not come in time, or when a test needs a fresh start."
    )
