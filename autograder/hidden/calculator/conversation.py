"""The grader's side of the conversation: a client for the student's server, and a server for the student's client."""

import math
import random
import re
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from calculator_interfaces.srv import Calculate

from autograder.errors import Fault
from autograder.hidden.calculator.arithmetic import ABOUT_RIGHT, ANSWERS, SIGNS, UNLIKE, likeness, plain_numbers
from autograder.suitekit import Bench, Run, Server, Wrong, numbers, when_changed
from autograder.suitekit.ros import published
from course.foundation.waiting import wait_until

SERVICE = "/calculator"
CLIENT = "calculator_client.py"
FEW = "with too few arguments"
ROUNDING = 0.0051  # what rounding to two decimals may cost: judged by one test, not by every operation's
SEVEN_DIGITS = 5e-7  # of a number's size: logs may show fewer digits than a result has, but not six
MINUS = re.compile(r"[-\u2212]\s*(?=\d)")  # as a sign may be printed: as "−", or with blanks behind it
SYLLABLE = 4  # letters of a word that may stand in any text, so that it is not hidden from it
TRIES = 3  # runs of a client that has not shown what it must, while a server was there
QUOTED = 60  # characters of a text that a message shows
REAPED = 1.0  # s until the output of a server that has ended is read
CHATTER = 300  # numbers like the right one that a program may print beside it: printing all of them shows none

Question = tuple[float, str, float]  # a, the operation, b


class Calculator(Server):
    """The student's server."""

    def __init__(self, bench: Bench):
        super().__init__(bench, "calculator_server.py", {SERVICE: Calculate})
        self._first: dict[str, tuple[Question, Any]] = {}  # by operation, the first question with its response
        self._broken: dict[
            str, Fault
        ] = {}  # operations that get no answer to an ordinary request, with what came of it
        self._abilities: list[str] | None = None
        self.logged_all = False
        self._refused: list[str] = []  # operations whose result is right, but not their success
        self._asked: set[float] = set()  # first numbers

    def ask(self, a: float, operation: str, b: float) -> Any:
        """Its response."""
        known = any(name.startswith(operation) for name in ANSWERS)  # a word that the student's own texts have
        words = [] if known else operation.split()
        self.bench.hide(a, b, *(word for word in words if len(word) > SYLLABLE))
        self._asked.add(abs(a))
        return self.call(Calculate.Request(a=a, b=b, operation=operation))

    def new_numbers(self, rng: random.Random) -> tuple[float, float]:
        """Plain numbers, the first of which was never sent: what a server remembers of it changes no answer to them."""
        while True:
            a, b = plain_numbers(rng)
            if a not in self._asked:
                return a, b

    def expect(self, a: float, operation: str, b: float, about: str, tolerance: float, success: bool = True) -> None:
        """Its result must be right within `tolerance`; `about` tells the student what kind of numbers these are."""
        response, right = self.ask(a, operation, b), ANSWERS[operation](a, b)
        self._first.setdefault(operation, ((a, operation, b), response))
        got = f"{operation} {a!r} {b!r}: expected {right!r}, got {response.result!r}, success={response.success}"
        if success and not response.success:
            raise Wrong(
                f"'{operation}' with {about}: success must be True when the operation can be done. It is False, with "
                f"the message {quoted(response.message)}.",
                got,
            )
        if not math.isclose(response.result, right, rel_tol=0, abs_tol=tolerance):
            raise Wrong(
                f"'{operation}' with {about}: result must be a {SIGNS[operation]} b. It is "
                f"{self._likeness(response.result, a, operation, b)}.",
                got,
            )

    def _likeness(self, result: float, a: float, operation: str, b: float) -> str:
        """Return a description of a wrong result; as a number only if no words fit and it is in the program."""
        words = likeness(result, a, operation, b)
        if words == UNLIKE and repr(result) == self.bench.shown(self.file, repr(result)):
            return repr(result)
        return words

    @property
    def abilities(self) -> list[str]:
        """The operations that it has been shown to do: right for two positive numbers, but for rounding and the sign.

        With success True: who refuses everything has shown nothing of what can be done.
        Tests of something else than an operation use these, so that a mistake in one operation costs that one alone.
        Raises Wrong, or what came of asking, when there is none.
        """
        if self._abilities is None:
            rng = self.bench.random("abilities")
            self._abilities, self._refused = [], []
            for operation in ANSWERS:
                tried = self._tried([(a, operation, b) for a, b in (plain_numbers(rng), plain_numbers(rng))])
                if all(response is not None and about_right(question, response) for question, response in tried):
                    succeeds = all(response.success for _, response in tried)
                    (self._abilities if succeeds else self._refused).append(operation)
        if not self._abilities:
            if len(self._broken) == len(ANSWERS):
                raise next(iter(self._broken.values()))
            raise Wrong(
                "This is judged only in a server that gives right answers, and none of the four operations gives the "
                f"right result{' with success True' if self._refused else ''}."
            )
        return self._abilities

    def operations(self, a: float, b: float) -> dict[str, bool]:
        """Of its abilities those that are right for these numbers with any signs, with their success."""
        right = {}
        for operation in self.abilities:
            tried = self._tried([(x, operation, y) for x in (a, -a) for y in (b, -b)])
            if all(response is not None and has_right_result(question, response) for question, response in tried):
                right[operation] = all(response.success for _, response in tried)
        return right

    def _tried(self, questions: Sequence[Question]) -> list[tuple[Question, Any]]:
        """Each question with its response, or None.  An operation that gets no answer is not asked for again."""
        tried: list[tuple[Question, Any]] = []
        for a, operation, b in questions:
            response = None
            if operation not in self._broken:
                try:
                    response = self.ask(a, operation, b)
                except Fault as fault:
                    if self.bench.clock.left <= 0:
                        raise  # the time for all tests is used up
                    self._broken[operation] = fault
            tried.append(((a, operation, b), response))
        return tried

    def expect_refusal(self, a: float, operation: str, b: float, about: str) -> str:
        """It must refuse, and say why; returns what it says."""
        response = self.expect_refused(a, operation, b, about)
        if not response.message.strip():
            raise Wrong(
                f"{about} is refused without a word: message must say why. It is {quoted(response.message)}.",
                f"{operation!r} {a!r} {b!r}: got {response}",
            )
        return str(response.message)

    def expect_refused(self, a: float, operation: str, b: float, about: str) -> Any:
        """Its response must be a refusal."""
        response = self.ask(a, operation, b)
        if response.success:
            result = self._likeness(response.result, a, operation, b)
            raise Wrong(
                f"{about} must be refused: success must be False. It is True, with {result} as result and the message "
                f"{quoted(response.message)}.",
                f"{operation!r} {a!r} {b!r}: got {response}",
            )
        return response

    def provoke(self, a: float, operation: str, b: float) -> str:
        """The message of a response that other tests judge; empty when there is none."""
        try:
            return str(self.ask(a, operation, b).message)
        except Fault:
            if self.bench.clock.left <= 0:
                raise
            return ""

    def gets_answer(self, question: Question) -> bool:
        """Return True if it gets any answer to a question that may end it."""
        try:
            self.ask(*question)
        except Fault:
            if self.bench.clock.left <= 0:
                raise
            return False
        return True

    def logs_result(self, question: Question, limit: float) -> bool:
        """Return True if asking this adds its result to the log within `limit` s, with the sign of a negative one.

        Then `logged_all` is whether the log names the results of all operations, so that nobody learns which was sent.

        A program that logs hundreds of numbers like the result has not logged it; whole numbers, with which many count
        what they do, are not like one that is not whole.
        """
        found: list[float] = []
        seen = Counter(self.log.splitlines())
        result = self.ask(*question).result
        size = abs(result)

        def logged(log: str) -> bool:
            nonlocal seen  # each line is read once: a talkative program pushes its own lines out of what is kept
            lines = Counter(log.splitlines())
            found.extend(numbers(MINUS.sub("-", "\n".join((lines - seen).elements()))))
            seen |= lines
            alike = [abs(number) for number in found if size.is_integer() or not number.is_integer()]
            signed = found if result >= 0.0 else [number for number in found if number < 0.0]
            return sum(size / 2 <= number <= size * 2 + 1 for number in alike) <= CHATTER and _names(signed, result)

        is_logged = wait_until(when_changed(lambda: self.log, logged), limit)
        a, _, b = question
        self.logged_all = is_logged and all(_names(found, compute(a, b)) for compute in ANSWERS.values())
        return is_logged

    def logs_request(self, question: Question, limit: float) -> bool:
        """Return True if asking this adds a line with a, b and the operation to the log within `limit` s.

        The numbers must be such as no other line has; their signs do not count.
        """
        a, operation, b = question
        self.ask(*question)

        def named(log: str) -> bool:
            lines = (numbers(line) for line in log.splitlines() if operation in line)
            return any({abs(a), abs(b)} <= set(map(abs, line)) for line in lines if len(line) <= CHATTER)

        return wait_until(when_changed(lambda: self.log, named), limit)

    def logs_each(self, question: Question, limit: float) -> bool:
        """Return True if asking this twice in a row adds at least two lines with a and b to the log.

        The lines are counted where the log is printed and on /rosout, each by itself: a line may stand in both.
        """
        a, _, b = question
        for _ in "12":
            self.ask(*question)

        def logged(logs: tuple[str, str]) -> bool:
            lines = (map(numbers, log.splitlines()) for log in logs)
            return any(sum({abs(a), abs(b)} <= set(map(abs, line)) for line in log) > 1 for log in lines)

        return wait_until(when_changed(self._both_logs, logged), limit)

    def logs_refusal(self, a: float, operation: str, b: float, limit: float) -> bool:
        """Return True if a refusal adds its message to the log within `limit` s, or nothing is refused in words.

        Whether it is refused is judged by other tests.
        """
        before = [in_one_line(log) for log in self._both_logs()]
        message = self.provoke(a, operation, b)
        if not message.strip():
            return True
        ways = {in_one_line(message), in_one_line(repr(message)[1:-1])}  # as text, and in the log of a whole response

        def logged(logs: tuple[str, str]) -> bool:
            after = [in_one_line(log) for log in logs]
            return any(new.count(way) > old.count(way) for new, old in zip(after, before, strict=True) for way in ways)

        return wait_until(when_changed(self._both_logs, logged), limit)

    def _both_logs(self) -> tuple[str, str]:
        """Return its output, and its log on /rosout."""
        return self.program.output, self.ros.rosout

    def answers(self, pairs: Sequence[tuple[float, float]]) -> dict[Question, Any]:
        """Return its answer to each pair and operation of its abilities.

        What it was asked first it must still answer as it did then.
        """
        for question, before in self._first.values():
            if question[1] in self.abilities and not same(self.ask(*question), before):
                raise Wrong(
                    "The same request was answered differently earlier: an answer must depend on its own request "
                    "alone, not on the requests before it or on the time.",
                    f"{question}: {before}",
                )
        return {(a, operation, b): self.ask(a, operation, b) for a, b in pairs for operation in self.abilities}

    def ask_from_two(self, questions: Sequence[Question]) -> list[tuple[Question, Any]]:
        """Each question with its response, from two clients that ask at the same time in opposite order."""
        orders = [questions, questions[::-1]]
        requests = [[Calculate.Request(a=a, b=b, operation=operation) for a, operation, b in order] for order in orders]
        responses = self.call_at_once(requests)
        return [pair for order, got in zip(orders, responses, strict=True) for pair in zip(order, got, strict=True)]


class LeftAlone(Calculator):
    """The same server once more: it is asked once, and again when nobody has asked for anything for a while."""

    def __init__(self, bench: Bench):
        super().__init__(bench)
        self._left: tuple[Question, Any, float] | None = None  # what it was asked, its response, and when it came
        self._logged: bool | None = None  # whether the first response of a start was in the log; None: not known

    def leave(self, operation: str, wait: float) -> None:
        """Ask a fresh start something, as long as `wait` s until that is in the log, and leave it alone."""
        self._left = None
        rng = self.bench.random("left alone")
        question = rng.randrange(7009, 8999) + 0.5, operation, rng.randrange(5009, 5999) + 0.25
        with suppress(Fault):
            self.ensure_fresh()
            starts, self.fresh = self.starts, False
            logged = self.logs_result(question, wait)
            response = self.ask(*question)
            if self.starts == starts:
                self._left, self._logged = (question, response, time.monotonic()), logged

    def logs_first(self, operation: str, wait: float) -> bool:
        """Return True if it has logged its very first response, in one of two starts."""
        if self._logged is None:
            self.leave(operation, wait)
        if self._logged is False:
            self.leave(operation, wait)
        return self._logged is not False

    def after_silence(self, operation: str, seconds: float, wait: float) -> str:
        """Return what is wrong with it so many seconds after its last request, twice; '' if nothing is."""
        wrong = ""
        for _ in "12":
            if self._left is None:
                self.leave(operation, wait)
            if not (wrong := self._what_became(seconds)):
                break
        return wrong

    def _what_became(self, seconds: float) -> str:
        if self._left is None:
            return ""
        question, before, since = self._left
        program, starts, self._left = self.program, self.starts, None
        wait_until(lambda: not program.alive, self.allow(since + seconds - time.monotonic()))
        silence = time.monotonic() - since
        if self.has_ended:
            program.wait(REAPED)
            return f"The server ended {silence:.0f} s after its last request: {program.last_words()}. It must go on."
        after = None
        with suppress(Fault):
            after = self.ask(*question)
        if after is None or self.starts != starts or same(after, before):
            return ""
        return (
            "Each answer depends on its own request alone, and not on when it comes: a request that came "
            f"{silence:.0f} s after the same one was answered otherwise, with {told(after, before)}."
        )


def _names(logged: Iterable[float], value: float) -> bool:
    """Return True if a logged number is this one, rounded and without its sign."""
    size = abs(value)
    return any(abs(abs(number) - size) <= ROUNDING + SEVEN_DIGITS * size for number in logged)


def in_one_line(text: str) -> str:
    """The text with each run of white space as one blank."""
    return " ".join(text.split())


def has_right_result(question: Question, response: Any) -> bool:
    """Return True if the result is about right."""
    a, operation, b = question
    return math.isclose(response.result, ANSWERS[operation](a, b), rel_tol=ABOUT_RIGHT, abs_tol=ROUNDING)


def about_right(question: Question, response: Any) -> bool:
    """Return True if the result is about right, except for its sign."""
    a, operation, b = question
    return math.isclose(abs(response.result), abs(ANSWERS[operation](a, b)), rel_tol=ABOUT_RIGHT, abs_tol=ROUNDING)


def told(response: Any, other: Any) -> str:
    """Return how a response differs from an earlier one to the same request, in words without the numbers."""
    if response.success != other.success:
        return f"success {response.success}, not {other.success}"
    return "another result"


def quoted(text: str) -> str:
    """A text of the student's program as it is shown to the student; its end is left out when it is long."""
    return repr(text if len(text) <= QUOTED else text[:QUOTED] + "...")


def same(response: Any, other: Any) -> bool:
    """Return True if two responses say the same; their messages may contain a time or a count."""
    return (response.success, response.result) == (other.success, other.result)


class Counterpart:
    """The grader's own /calculator for the student's client.  Its answer cannot be computed from the request."""

    def __init__(self, bench: Bench, *, result: float, success: bool, message: str, silent: bool = False):
        """A `silent` one takes each request, and sends no response."""
        self._bench = bench
        self._domain = bench.new_domain()
        self.response = Calculate.Response(result=result, success=success, message=message)
        bench.hide(*[result] * (math.isfinite(result) and result != 0.0), *message.split())
        self.requests: list[Any] = []
        service: Any = bench.enter(self._domain).node.create_service(Calculate, SERVICE, self._answer)
        self.asked: list[float] = []  # when a silent one was asked, a time of time.monotonic (s)
        if silent:
            service.send_response = self._keep

    def run(self, *args: str) -> Run:
        """A run of the student's client that can call this."""
        return self._bench.run(CLIENT, *args, domain=self._domain)

    def shown(self, output: str) -> str:
        """Return what the client has printed, as its student may read it."""
        return self._bench.shown(CLIENT, output)

    def _answer(self, request: Any, _: Any) -> Any:
        self.requests.append(request)
        return self.response

    def _keep(self, _: Any, info: Any) -> None:
        """Send nothing, in the place of `Service.send_response`."""
        times = {name: getattr(info, name) for name in ("received_timestamp", "source_timestamp")}
        self.asked.append(time.monotonic() - time.time() + published(times))


class Call:
    """A run of the client where a server answers."""

    def __init__(self, counterpart: Counterpart, *sent: str):
        """`sent` is the client's command line: a, b and the operation."""
        self._counterpart, self._tries = counterpart, 1
        self.sent = sent
        self.response = counterpart.response
        self.run = counterpart.run(*sent)

    @property
    def requests(self) -> list[Any]:
        """The requests that came to the server."""
        return self._counterpart.requests

    @property
    def asked(self) -> list[float]:
        """Return the times when a silent server was asked, of time.monotonic (s)."""
        return self._counterpart.asked

    @property
    def what_it_did(self) -> str:
        """Return the result of the run, as a sentence for the student."""
        called = "It called, and" if self.requests else "It did not call, and"
        lines = self._counterpart.shown(self.run.output).splitlines()
        return f"{called} printed {quoted(lines[-1].strip())}." if lines else f"{called} printed nothing."

    @property
    def reached(self) -> bool:
        """Return True if the client has called the server."""
        return self.comes_to(lambda: bool(self.requests))

    def comes_to(self, condition: Callable[[], bool]) -> bool:
        """Return True if the run meets the condition; it runs again if not, in case it gave up on a busy machine."""
        while not (true := self.run.until(condition)) and self._tries < TRIES:
            self._tries += 1
            self.run.again()
        return true

    def with_words(self, *sent: str) -> "Call":
        """Another run, with another command line, where the same server is."""
        return Call(self._counterpart, *sent)

    def repeat(self) -> None:
        """Run it again, with no request so far."""
        self.requests.clear()
        self.run.again()


@dataclass(frozen=True)
class ClientRuns:
    """The runs of the student's client."""

    answered: Call
    refused: Call  # the server answers with success False
    refused_unknown: Call  # the same, for an operation that only the server knows, and a b that is not 0
    nameless: Call  # an operation without a name; the result is 0
    unknown: Call  # an operation that only the server knows; the result is inf
    unusual: Call  # numbers and an operation as nobody writes them, arguments for ROS, and no answer
    speechless: Call  # the server answers with success False, and without a message
    absent: Run  # there is no server
    misused: dict[str, Run]  # with a wrong command line, by what is wrong with it
    wrongly: Counterpart  # the server that these must not call
    misused_alone: Run  # with too few arguments, where there is no server

    @cached_property
    def unanswered(self) -> Call:
        """A call that gets no answer."""
        return self._reaching(self.unusual)

    @cached_property
    def zero(self) -> Call:
        """A call whose result is 0."""
        return self._reaching(self.nameless)

    @cached_property
    def infinite(self) -> Call:
        """A call whose result is inf."""
        return self._reaching(self.unknown)

    def _reaching(self, call: Call) -> Call:
        """The call, or an ordinary one to the same server from a client that cannot make it."""
        return call if call.reached else call.with_words(*self.answered.sent)

    def expect_call(self) -> None:
        """The client has called the server when it was called rightly: only then its failures are judged."""
        if not self.answered.reached:
            self.answered.run.finish("with a server that answers")
            raise Wrong(
                f"With two numbers and an operation, no request of the client's came to {SERVICE}, which was there. (A "
                "client that ends right after call_async may end before its request is out: wait for the response.) "
                f"{self.answered.what_it_did} Only a client that calls is judged.",
                self.answered.run.output,
            )
