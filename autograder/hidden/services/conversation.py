"""The grader's side of the conversation: clients of the student's servers, and an /add_two_ints of its own."""

import math
import random
import re
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

from example_interfaces.srv import AddTwoInts
from rclpy.callback_groups import ReentrantCallbackGroup
from std_srvs.srv import SetBool, Trigger

from autograder.errors import Fault
from autograder.suitekit import ANSWER, SETTLED, Alive, Bench, Crashed, Offers, Parameters, Ros, Server, Wrong, offer
from autograder.suitekit.lifecycle import State
from autograder.suitekit.printed_numbers import GROUPED
from course.foundation.waiting import wait_until

ENABLE, STOP, STATUS = "/motors/enable", "/motors/emergency_stop", "/motors/status"
ENABLED, DISABLED, STOPPED = "enabled", "disabled", "stopped"
STATES = (DISABLED, ENABLED, STOPPED)
# Commands, and what the motors are after each.
LESSON = ((ENABLE, False, DISABLED), (ENABLE, True, ENABLED), (STOP, True, STOPPED), (STOP, False, DISABLED))
# How the motors get into a state that they are not in, when they are not stopped: one way, and another.
WAYS = {
    DISABLED: [[(ENABLE, False)], [(STOP, True), (STOP, False)]],
    ENABLED: [[(ENABLE, True)], [(ENABLE, False), (ENABLE, True)]],
    STOPPED: [[(STOP, True)]],
}
STARTS = ((ENABLE, True),)  # what disabled motors are left with when they must keep running
STOPS = ((ENABLE, True), (STOP, True), (STOP, False))  # and when they must stand still
HOLDS = ((ENABLE, True), (STOP, True))  # and when they must stay stopped
COMMANDS = ((ENABLE, True), (ENABLE, False), (STOP, True), (STOP, False))
QUOTED = 100  # characters of a message that its student is shown
RELAY, ADD = "/relay", "/add_two_ints"
CALLERS = 6  # at once
SUMS = 10**8, 2 * 10**9  # what /add_two_ints answers: such as no message has by chance, and 32 bits hold
HELD = 4.0  # s that /add_two_ints holds an answer back at most, until the grader has seen what it wanted to see
TRIES = 4  # calls that are timed at most
COMES = 3  # times at most that /add_two_ints comes back, until the relay finds it soon
OVERDUE = 0.75  # s longer than usual, after which a call is taken for lost that was made when /add_two_ints left
PAUSE = 0.05  # s between two calls, until the relay has found /add_two_ints
OVERLAPS = (0.25, 0.1, 0.04, 0.015, 0.005, 0.0)  # s after a request until the next one is sent, to meet it under way
SLOW = 0.05  # s after which a request that is still under way is slow, and shorter overlaps show nothing new
EARLY = 0.2  # s in which a caller is answered who waits for nothing
SENT = 2.0  # s until a request has arrived, when its answer was not waited for
UNASKED = 3  # waits for a request that were in vain, in a row, after which the relay is known not to ask
UNASKED_FOR = 0.15  # s until a request has arrived that a relay sends when its parameters are set
LOOKS = 0.05  # s between two looks at whether a program offers its service
OFFERED = 3.0  # s until a program that has been started offers its service, when it is not waited for otherwise
SENT_BY_SUCH = 0.5  # s until the request of such a relay has arrived, if it does ask after all


Table = dict[tuple[str, str, bool], tuple[Any, str]]  # the response to each command in each state, and the state then


class Motors(Server):
    """The student's motor_service.py, with two clients for each of its services."""

    def __init__(self, bench: Bench, like: "Motors | None" = None):
        """`like` is the same program, of which is learnt in which words it speaks."""
        super().__init__(bench, "motor_service.py", {ENABLE: SetBool, STOP: SetBool, STATUS: Trigger})
        self._like = like
        self.changes = False  # whether a command has ever changed the state
        self.can_enable = False  # whether the motors were ever said to be enabled after they had been enabled
        self.can_stop = False  # and to be stopped
        self.status_answers = False  # whether asking for the state has got an answer
        self._left: tuple[int, float] | None = None  # the start that was left alone, and when (s of time.monotonic)
        self.silence = 0.0  # s for which it was left alone before it was looked at
        self._least = 0.0  # s for which it must be left alone when that is done once more
        self._only_stopped = False  # whether the emergency stop was the first and the only command to this start
        self._wish: tuple[str, str] | None = None  # what `enable_at_first` has seen
        self._failed: dict[
            tuple[str, bool, bool], Fault
        ] = {}  # the commands without a response, and whether stopped then
        self._pressed = False  # whether the emergency stop was asked for last, and not its end
        self._last = ""  # the message of the last command's response
        self._tells: bool | None = None  # whether the status changes with the state, in whatever words; None: not known
        self._table: Table = {}
        self._words: dict[str, str] = {}  # the state that a message means which names none of them, or several
        self.unclear: tuple[str, int, str] | None = None  # the first such message: its service, and which answer it was
        self._answers = 0  # of this start

    def connect(self) -> Offers:
        """The clients, of the grader's node and of a second one, which a program that is like another does not need."""
        self._pressed, self._last, self._answers = False, "", 0
        if self._like is None:
            self.second = self.bench.enter(self.ros.domain)
            node = self.second.node
            self.second_clients = {name: node.create_client(kind, name) for name, kind in self.services.items()}
        return super().connect()

    def command(self, service: str, on: bool, second: bool = False) -> Any:
        """The response of /motors/enable or /motors/emergency_stop, asked by the first or the second client."""
        self._only_stopped = False
        if service == STOP:
            self._pressed = on
        response = self._call(service, SetBool.Request(data=on), second)
        self._last = response.message
        return response

    def attempt(self, service: str, on: bool) -> Any:
        """The same, or None when there is no response: that costs other points, and is not asked for again."""
        asked = (service, on, self._pressed)
        if asked in self._failed:
            return None
        try:
            return self.command(service, on)
        except Fault as fault:
            if self.bench.clock.left <= 0:
                raise  # the time for all tests is used up
            self._failed[asked] = fault
            return None

    def admit(self, service: str, on: bool) -> None:
        """Raise the fault that this command had, if any: it explains the state that the motors are in."""
        for (name, data, _), fault in self._failed.items():
            if (name, data) == (service, on):
                raise fault

    def overlaps(self, state: str, first: tuple[str, bool], second: tuple[str, bool]) -> Iterator[None]:
        """Send two commands to motors in `state`, from two clients, so that the second meets the first under way.

        How long the first takes is not known, so this is done with several times in between.
        """
        slow = False
        for after in OVERLAPS:
            if not self.bring(state):
                return
            met = self._overlap(first, second, after)
            if met is None:
                return
            yield
            if slow:
                return
            slow = met and after > SLOW  # one more, as the first may just have ended when the second arrived

    def _overlap(self, first: tuple[str, bool], second: tuple[str, bool], after: float) -> bool | None:
        """Return whether the first was under way `after` s later; None if one of the two has got no answer."""
        self.up(offer(ENABLE), offer(STOP))
        program = self.program

        def sent(ros: Ros, clients: dict[str, Any], command: tuple[str, bool]) -> Any:
            service, on = command
            if service == STOP:
                self._pressed = on
            return ros.send(clients[service], SetBool.Request(data=on))

        futures = [sent(self.ros, self.clients, first)]
        met = not wait_until(futures[0].done, after)
        futures.append(sent(self.second, self.second_clients, second))
        wait_until(lambda: all(future.done() for future in futures) or not program.alive, self.allow(ANSWER))
        if not all(future.done() for future in futures):
            self.end()
            return None
        self._last = futures[1].result().message
        return met

    def status(self, second: bool = False) -> Any:
        """The response to asking for the state."""
        return self._call(STATUS, Trigger.Request(), second)

    def learn(self) -> None:
        """Find out, once, in which words the program says its states, and whether the status tells and leaves them.

        So a mistake in the words, or in the status, costs its own points, and does not hide what the commands do.
        """
        if self._tells is not None:
            return
        if self._like is not None:
            self._learn_from(self._like)
            return
        meant: dict[str, set[str]] = {}  # by the message without its numbers: after which commands it was said
        statuses, steady = set(), True
        for service, on, state in LESSON:
            response = self.attempt(service, on)
            status, again = self._try_status(), self._try_status()
            steady = steady and (says(status) or plain(status)) == (says(again) or plain(again))
            statuses.add(says(status) or plain(status))
            for message in (status, response.message if response else ""):
                if says(message) is None and message:
                    meant.setdefault(plain(message), set()).add(state)
        self._words = {message: states.pop() for message, states in meant.items() if len(states) == 1}
        self._tells = steady and len(statuses) > 1
        states = {}
        for service, on, _ in LESSON:
            states[service, on] = self.current() if self.attempt(service, on) else ""
        self.changes = len({*states.values()} - {""}) > 1
        self.can_enable, self.can_stop = states[ENABLE, True] == ENABLED, states[STOP, True] == STOPPED

    def _learn_from(self, other: "Motors") -> None:
        other.learn()
        self.changes, self.can_enable, self.can_stop = other.changes, other.can_enable, other.can_stop
        self.status_answers, self._tells, self._words = other.status_answers, other._tells, other._words

    def _try_status(self) -> str:
        try:
            message = self.status().message
        except Fault:
            if self.bench.clock.left <= 0:
                raise
            return ""
        self.status_answers = True
        return message

    def named(self, message: str) -> str:
        """The state that a message names, in whatever words the program has for it; else the message."""
        return says(message) or self._words.get(plain(message)) or message

    def current(self, second: bool = False) -> str:
        """Return the state of the motors, by the status, or by the last command if the status is unusable."""
        self.learn()
        return self.named(self.said(second))

    def said(self, second: bool = False) -> str:
        """The message by which `current` goes."""
        return self.status(second).message if self._tells else self._last

    @property
    def witness(self) -> str:
        """Return the source of `said`, in words for the student."""
        return STATUS if self._tells else "the response"

    def bring(self, state: str) -> bool:
        """Bring the motors into that state before a test begins, as far as they let themselves be brought.

        On a second way where the first fails: what is wrong with one command costs its own points.
        """
        now = self.current()
        for ways in WAYS[state]:
            if now == state:
                break
            if state != STOPPED and (self._pressed or now == STOPPED):
                self.attempt(STOP, False)
                now = self.current()
            if now != state:
                for service, on in ways:
                    self.attempt(service, on)
                now = self.current()
        return now == state

    def table(self) -> Table:
        """Return the result of each command in each state, if the motors can be brought into it, and answer."""
        if not self._table:
            for state in STATES:
                for service, on in COMMANDS:
                    if self.bring(state) and (response := self.attempt(service, on)) is not None:
                        self._table[state, service, on] = response, self.current()
        return self._table

    def expect_answer(self, state: str, service: str, on: bool) -> None:
        """A command that is answered in one state must be answered in this one, too; raises the fault if it is not.

        One that is answered in no state costs other points.
        """
        known = self.table()
        if (state, service, on) not in known and any(row[1:] == (service, on) for row in known) and self.bring(state):
            self.command(service, on)

    def forget(self) -> None:
        """Have `table` and `enable_at_first` find it out once more."""
        self._table, self._wish = {}, None

    def renew(self) -> None:
        """Have the motors disabled after a stop and after having been enabled, so that nothing before counts."""
        self.attempt(STOP, True)
        self.attempt(STOP, False)
        self.bring(ENABLED)
        self.bring(DISABLED)

    def leave(self, *commands: tuple[str, bool]) -> None:
        """Give these commands to disabled motors, to look again when nobody has asked for anything for a while."""
        self._left = None
        with suppress(Fault):
            self.learn()
            if not self.can_enable:
                return
            self.renew()
            if self.current() == DISABLED:
                for command in commands:  # the last word: a look at the status might change the state
                    self.command(*command)
                self._left = self.starts, time.monotonic()

    def after_silence(self, seconds: float, *commands: tuple[str, bool]) -> str:
        """The state so many seconds after `leave`, or more; '' when they cannot be enabled.

        Raises Wrong when the program has ended by itself meanwhile.
        """
        if self._left is None or self._left[0] != self.starts:
            self.leave(*commands)
        if self._left is None:
            return ""
        starts, since = self._left
        self._left = None
        seconds = max(seconds, self._least)
        wait_until(lambda: not self.program.alive, self.allow(since + seconds - time.monotonic()))
        self.silence = time.monotonic() - since
        if self.has_ended:
            raise self.ended("when nobody had asked for anything for some seconds")
        state = self.current()
        return state if self.starts == starts else ""

    def leave_as_long(self) -> None:
        """Have `after_silence` leave them alone for as long as before when something was wrong then."""
        self._least = self.silence

    def stop_first(self) -> None:
        """Give the emergency stop as its first command to a start of the program."""
        self.learn()
        self.ensure_fresh(offer(STOP))
        self.fresh = False
        self.command(STOP, True)
        self._only_stopped = True

    def enable_at_first(self) -> tuple[str, str]:
        """The state when a start of the program is stopped first and then asked to enable, and what was said of it.

        Found out once; ('', '') when a request gets no answer, which costs other points.
        """
        unanswered = (ENABLE, True, True) in (self._like or self)._failed
        if self._wish is None and not unanswered:
            with suppress(Fault):
                if not self._only_stopped:
                    self.stop_first()
                self.command(ENABLE, True)
                said = self.said()
                self._wish = self.named(said), said
        return self._wish or ("", "")

    def expect(self, state: str, after: str) -> None:
        """They must be said to be in this state."""
        message = self.said()
        if self.named(message) != state:
            raise Wrong(f"After {after} the motors must be {state}; {self.witness} says {quoted(message)}.")

    def expect_change(self) -> None:
        """Some command must have an effect: only then it is judged what stays as it is.

        Raises the fault of a program that has never answered.
        """
        self.learn()
        if not self.changes:
            taught = self._like or self
            if not taught.ever_answered:
                taught.admit(*COMMANDS[0])
            raise Wrong(
                "This is judged with motors that do something: but after every command their state is said to be the "
                f"same, {quoted(self.said())}."
            )

    def _call(self, name: str, request: Any, second: bool) -> Any:
        stopped = name == ENABLE and self._pressed

        def question(limit: float, alive: Alive) -> Any:
            ros, clients = (self.second, self.second_clients) if second else (self.ros, self.clients)
            if stopped and not self._pressed and wait_until(self.clients[STOP].service_is_ready, limit):
                # A new start, which knows nothing of the stop during which this is asked.
                self._pressed = self.ros.call(self.clients[STOP], SetBool.Request(data=True), limit, alive) is not None
            return ros.call(clients[name], request, limit, alive)

        what = f"a request to {name}{' during an emergency stop' if stopped else ''}"
        response = self.converse(question, what, offer(name))
        self._answers += 1
        if self.unclear is None and says(response.message) is None:
            self.unclear = name, self._answers, response.message
        return response


def says(message: str) -> str | None:
    """The one state that a message names; None when it names none or several, or only says which it is not."""
    words = set(re.findall(rf"(?<![a-z])(?:{'|'.join(STATES)})(?![a-z])", message.lower()))
    denied = re.search(rf"(?:not|n't|no longer) (?:{'|'.join(STATES)})(?![a-z])", message.lower())
    return words.pop() if len(words) == 1 and not denied else None


def plain(message: str) -> str:
    """A message without what may differ each time: counts and times."""
    return re.sub(r"[\d.]+", "", message)


def quoted(message: str) -> str:
    """Return the program's message, quoted for its student."""
    return repr(message if len(message) <= QUOTED else message[:QUOTED] + "...")


def shown(response: Any) -> str:
    """A response of the relay, for its student."""
    return f"success={response.success} and the message {masked(response.message)}"


def masked(message: str) -> str:
    """A message of the relay, for its student: without its numbers, which were drawn."""
    return quoted(re.sub(r"\d[\d,._]*", "#", message))


def parted(message: str, sums: Sequence[int]) -> str:
    """A sentence for the student on a sum that a message has with other separators than the task allows; or nothing."""
    joined = re.sub(r"(?<=\d)[. '\u2019\u00a0\u202f](?=\d{3}(?!\d))", "", message)
    if {*whole_numbers(joined)}.isdisjoint(sums):
        return ""
    return " It has the digits of the sum, in other groups than the task allows: 1000, 1,000 or 1_000."


class Adder:
    """The grader's own /add_two_ints.  Each response is another random number, which cannot be computed."""

    def __init__(self, ros: Ros, rng: random.Random):
        self.requests: list[tuple[int, int]] = []
        self.sums: list[int] = []
        self.held: list[threading.Event] = []  # what lets go each answer that is held back, in the order of requests
        self.fixed: int | None = None  # what is answered instead of random numbers
        self.given_up = False  # whether an answer was held for as long as it could be
        self._holds = 0.0  # s for which an answer is held back
        self._enough = 0  # answers that are held, and let go together when there are so many; 0: never
        self._rng, self._lock = rng, threading.Lock()
        self._node = ros.node
        self._service = ros.node.create_service(AddTwoInts, ADD, self._answer, callback_group=ReentrantCallbackGroup())

    def leave(self) -> None:
        """Offer the service no more."""
        self._node.destroy_service(self._service)

    def hold_no_more(self) -> None:
        """Answer further requests at once; those that are held stay so."""
        self._holds = 0.0

    @contextmanager
    def holding(self, seconds: float = HELD, enough: int = 0) -> Iterator[None]:
        """Hold back each answer in this block, until its event is set, at most for so long.

        With `enough` they are let go when so many are held, or when one has been held for so long: then the others are
        not held either.
        """
        self.held.clear()
        self._holds, self._enough, self.given_up = seconds, enough, False
        try:
            yield
        finally:
            self._enough = 0
            self.let_go()

    def let_go(self) -> None:
        """Answer what is held, and hold no more."""
        self._holds = 0.0
        for let_go in self.held:
            let_go.set()

    def _answer(self, request: Any, response: Any) -> Any:
        let_go = threading.Event()
        with self._lock:
            response.sum = self._rng.randrange(*SUMS) if self.fixed is None else self.fixed
            self.requests.append((request.a, request.b))
            self.sums.append(response.sum)
            holds = self._holds
            if holds:
                self.held.append(let_go)
                if len(self.held) == self._enough:
                    self.let_go()
            else:
                let_go.set()
        if not let_go.wait(holds):
            self.given_up = True
            if self._enough:
                self.let_go()
        return response


class Asking:
    """A record, over all starts of a relay, of whether it calls /add_two_ints: it is not waited for in vain again.

    A relay that has let UNASKED requests in a row be waited for in vain has had time for each.
    """

    def __init__(self) -> None:
        self.in_vain = 0  # waits in a row

    def within(self, seconds: float) -> float:
        """Return how long (s) to wait for a request, or for something that depends on one and may take `seconds`."""
        return seconds if self.in_vain < UNASKED else min(seconds, SENT_BY_SUCH)


class Relay(Server):
    """The student's relay.py, started with two numbers; /add_two_ints is there to be called, or not."""

    advice = "a callback that waits for an answer must not keep the answer from being taken in"

    def __init__(self, bench: Bench, rng: random.Random, served: bool, asking: Asking):
        self.rng, self.served, self._asking = rng, served, asking
        if not served:
            self.advice = f"when {ADD} is not available, the answer must come within 5 s"
        self.numbers = a, b = draw(rng)
        bench.hide(a, b)
        super().__init__(bench, "relay.py", {RELAY: Trigger}, "--ros-args", "-p", f"a:={a}", "-p", f"b:={b}")
        self.parameters = Parameters(self, service=RELAY)
        self.failed = 0  # which of its starts answered with success False last
        self._settled = 0  # which of its starts has had time to find /add_two_ints
        self._adder: Adder | None = None
        self._adders: list[Adder] = []
        self._refuses_after = math.inf  # s until an answer with success False, at best
        self._has_succeeded = False
        self._successes: set[str] = set()  # the messages of the latest calls that succeeded
        self._called = 0.0  # and the latest call by `answers_again`
        self._answers = 0  # to calls of this start
        self._unasked: int | None = None  # the requests that it sends when its parameters are set; None: not known
        self._calls_first = False  # whether the next start is called as soon as it offers /relay
        self._first: list[float] = []  # when that call was made (s of time.monotonic), and how long its answer took (s)
        self._latest = "", 0  # the message of the latest call, and the number of sums that were answered before it

    @property
    def has_been_silent(self) -> bool:
        """Return True if a question is known to have no answer."""
        return self._silences > 0

    @property
    def sent(self) -> int:
        """Return the number of calls to this start."""
        return self.ros.sent(RELAY)

    @property
    def unanswered(self) -> int:
        """Return the number of unanswered calls to this start; answers to calls made with `send` do not count."""
        return self.sent - self._answers

    def expect_asking(self) -> None:
        """Some start must have asked /add_two_ints, or answered with success True; raises the fault of what it does."""
        if not self._has_succeeded and not any(adder.requests for adder in self._adders):
            self.relay()
        if not self._has_succeeded and not any(adder.requests for adder in self._adders):
            raise Wrong(
                "This is judged with a relay that asks when it can: "
                f"but where {ADD} is available, it was not called either."
            )

    @property
    def adder(self) -> Adder:
        """Return the server that the relay has to call; it exists only while it is served."""
        if self._adder is None:
            raise RuntimeError("nobody serves /add_two_ints to this relay")
        return self._adder

    def connect(self) -> Offers:
        """The client, and the server for the program's own client."""
        self._adder, self._answers = None, 0
        self._place = self.bench.enter(self.ros.domain, threads=CALLERS + 2)  # seen before its service comes
        if self.served:
            self.serve()
        offers = super().connect() | self.parameters.connect()
        if self._calls_first:
            first: list[float] = []
            self._first = first
            client, ros = self.clients[RELAY], self.ros

            def look() -> None:
                if client.service_is_ready():
                    timer.cancel()
                    first.append(time.monotonic())
                    future = ros.send(client, Trigger.Request())
                    future.add_done_callback(lambda _: first.append(time.monotonic() - first[0]))

            timer = ros.node.create_timer(LOOKS, look)
        return offers

    def call_at_start(self) -> None:
        """Start it unless it runs, and have it called as soon as it offers /relay; nothing of this is waited for."""
        if self.state is State.DOWN:
            self._calls_first = True
            with suppress(Fault):  # of the place where it should start: the next question has it, too
                self.begin()
            self._calls_first = False

    def wait_for_first_answer(self, limit: float) -> None:
        """Wait until the call at its start has its answer, at most `limit` s after it.

        A program that has ended is started again by the next question, which tells why.
        """
        if self.state is not State.STARTING:
            return
        program, first = self.program, self._first
        wait_until(lambda: first or not program.alive, self.allow(OFFERED))
        if first:
            left = first[0] + limit - time.monotonic()
            wait_until(lambda: len(first) > 1 or not program.alive, self.allow(left))
        if not program.alive:
            self.end()

    def first_answer_took(self) -> float:
        """Return the time (s) to the answer of the call at its start; 0 if none came, or it was returned already."""
        first, self._first = self._first, []
        return first[1] if len(first) > 1 else 0.0

    def serve(self) -> None:
        """Offer /add_two_ints, unless it is offered already."""
        if self._adder is None:
            self._adder = Adder(self._place, self.rng)
            self._adders.append(self._adder)

    def withdraw(self) -> None:
        """Offer /add_two_ints no more; returns when this can be seen in the domain, and the relay has had time to."""
        looking = self.ros.node.create_client(AddTwoInts, ADD)
        wait_until(looking.service_is_ready, self.allow(SETTLED))
        self.adder.leave()
        self._adder = None
        wait_until(lambda: not looking.service_is_ready(), self.allow(SETTLED))
        self.parameters.get("a")  # a round trip
        self.ros.node.destroy_client(looking)

    def relay(self) -> Any:
        """Its response; with a server to call, once it has had time to find it."""
        start, adder = time.monotonic(), self._adder
        before = len(adder.sums) if adder else 0
        response = self._relay()
        if self.served and self._settled != self.starts:
            response = response if response.success else self.wait_for_success()
            self._settled = self.starts
        if not response.success:
            self._note_refusal(start)
        self._has_succeeded = self._has_succeeded or response.success
        self._latest = response.message, before if self._adder is adder else 0
        return response

    def expect_own_sum(self, about: str) -> None:
        """The message of the latest call must contain what /add_two_ints has answered to it; `about` tells which."""
        message, before = self._latest
        if not self.tells_own_sum(message, before):
            raise Wrong(
                f"{about} must be answered with the sum that {ADD} answered to this very call: the message is "
                f"{masked(message)}, and does not contain it.{parted(message, self.adder.sums[before:])}",
                f"answered {self.adder.sums[before:]}",
            )

    def tells_own_sum(self, message: str, before: int) -> bool:
        """Return True if a message contains a sum that /add_two_ints answered after its answer number `before`."""
        return not {*whole_numbers(message)}.isdisjoint(self.adder.sums[before:])

    def wait_for_success(self) -> Any:
        """Its response, asked again and again until that has success True, or the time to find a server is over."""
        responses: list[Any] = []

        def succeeds() -> bool:
            responses.append(self._relay())
            return responses[-1].success

        wait_until(succeeds, self.allow(self._asking.within(SETTLED)))
        return responses[-1]

    def after_offer(self, limit: float, requests: int = 1) -> Any:
        """The response to calls once /add_two_ints has come, with success True and a request, if it gets so far.

        With 0 `requests` success True is enough.  None when a call has no answer within `limit` s.  The program is not
        started again.
        """
        end = time.monotonic() + self.allow(self._asking.within(SETTLED))
        while (response := self.answers_again(limit)) is not None and time.monotonic() < end:
            if response.success and len(self.adder.requests) >= requests:
                break
            self.watch(PAUSE, since=time.monotonic())
        return response

    def _relay(self) -> Any:
        def question(limit: float, alive: Alive) -> Any:
            # Sent once: a relay that waits for a server that is not there shall not have to do so again.
            return self.ros.call(self.clients[RELAY], Trigger.Request(), limit, alive, again=limit)

        response = self.converse(question, f"a request to {RELAY}", offer(RELAY))
        self._answers += 1
        return response

    def answers_again(self, limit: float) -> Any:
        """The response to one more call, or None when there is none within `limit` s."""
        program, client = self.program, self.clients[RELAY]
        limit, self._called = self.allow(limit), time.monotonic()
        response = self.ros.call(client, Trigger.Request(), limit, lambda: program.alive, again=limit)
        self._answers += response is not None
        if response is not None and response.success:
            self._successes.add(response.message)
        elif response is not None:
            self._note_refusal(self._called)
        return response

    def _note_refusal(self, start: float) -> None:
        """Note that a call made at `start` (s of time.monotonic) has just been answered with success False."""
        self.failed = self.starts
        self._refuses_after = min(self._refuses_after, time.monotonic() - start)

    def repeats(self, message: str) -> bool:
        """Return True if it has given this message with success True."""
        return message in self._successes

    def told_after(self, limit: float) -> list[float]:
        """The times (s) after which several calls at once are answered, in order; raises Crashed.

        None, unless all are answered within `limit` s.
        """
        start, times = time.monotonic(), []
        futures = [self._send() for _ in range(CALLERS)]
        for future in futures:
            future.add_done_callback(lambda _: times.append(time.monotonic() - start))
        if self.wait_for(lambda: len(times) == CALLERS, limit):
            return times
        self.end()
        return []

    def found_again(self, soon: float, limit: float) -> tuple[float, Any]:
        """Return the shortest time (s) from the return of /add_two_ints to a call that succeeds, and the last response.

        For a relay that has just noticed that it has gone: who looks only now and then has just looked, and takes
        longest.  Where that is longer than `soon` it goes and comes again: on a busy machine, finding a server may take
        longer.
        """
        quickest, response = math.inf, None
        for back in range(COMES):
            if back and self.after_withdrawal(limit) is None:
                break
            self.serve()
            start = time.monotonic()
            response = self.after_offer(limit, requests=0)  # that it must ask each time, another test judges
            if response is not None and response.success:
                quickest = min(quickest, self._called - start)  # how late its answer is, other tests judge
            if quickest <= soon:
                break
        return quickest, response

    def after_withdrawal(self, limit: float) -> Any:
        """The response to a call when /add_two_ints has gone, if possible with success False.  Raises Crashed.

        None when no call has one within `limit` s, or the little that is more than what the relay takes where
        /add_two_ints never was.  A call just when the server leaves may be lost, and a relay may see a little later
        that it has gone: so there are several calls, of which the later ones do not wait for those before.
        """
        self.withdraw()
        usual = self._refuses_after if self._refuses_after < math.inf else 0.0
        limit, start = max(limit, usual + 2 * OVERDUE), time.monotonic()
        futures: list[Any] = []
        responses: list[Any] = []  # in time

        def note(future: Any, latest: float) -> None:
            if time.monotonic() <= latest:
                responses.append(future.result())

        def is_told() -> bool:
            return any(not response.success for response in responses)

        lost = [number * (usual + OVERDUE) for number in range(CALLERS - 1)]  # by then, so many may be
        for after in [*(seconds for seconds in lost if seconds < limit), limit]:
            if self.wait_for(is_told, start + after - time.monotonic()):
                break
            futures.append(self._send())
            futures[-1].add_done_callback(partial(note, latest=time.monotonic() + self.allow(limit)))
        self.wait_for(lambda: is_told() or futures[-1].done(), limit)
        for future in futures:
            self.clients[RELAY].remove_pending_request(future)
        return next((response for response in responses if not response.success), responses[-1] if responses else None)

    def watch(self, seconds: float, since: float | None = None) -> None:
        """Wait until so many seconds have passed since the start, or since `since` (s of time.monotonic)."""
        program, end = self.program, seconds + (self.program.started if since is None else since)
        wait_until(lambda: not program.alive, self.allow(end - time.monotonic()))

    def quickest(self, limit: float, loaded: float) -> tuple[float, float]:
        """Return the time (s) of the quickest of some calls, and its limit.

        That is `limit`, or `loaded` times as long as another request takes: on a busy machine everything takes longer.
        """
        quickest = float("inf")
        for _ in range(TRIES):
            allowed = max(limit, loaded * self.round_trip())
            start = time.monotonic()
            self.relay()
            took = time.monotonic() - start
            quickest = min(quickest, took)
            if took <= allowed:
                return took, allowed
        return quickest, limit

    def round_trip(self) -> float:
        """Return the time (s) of another request to the relay."""
        start = time.monotonic()
        self.parameters.get("a")
        return time.monotonic() - start

    def send(self, count: int = 1) -> list[Any]:
        """Call it `count` times without waiting; the futures of the responses, in the order of the held requests.

        For a block in which the adder holds its answers: each call is sent when the request of the one before is
        held.  Raises Wrong when a request of the relay's does not arrive while the others are held, and Crashed.
        """
        client, futures = self.clients[RELAY], []
        for number in range(1, count + 1):
            futures.append(self._send())
            if not self._held(number):
                for future in futures:
                    client.remove_pending_request(future)
                raise Wrong(
                    f"The relay must call {ADD} each time that {RELAY} is called; it did not."
                    if number == 1
                    else f"While one call of {RELAY} waited for {ADD}, {RELAY} was called once more: the request of "
                    f"this call must go out to {ADD} at once, and none came within {SENT:.0f} s.",
                    f"{len(self.adder.held)} of {number} requests arrived",
                )
        return futures

    def send_another(self) -> Any:
        """The same for one more call; that its request goes out, another test judges."""
        number, future = len(self.adder.held), self._send()
        self._held(number + 1)
        return future

    def release(self, futures: Sequence[Any]) -> float:
        """Let go what is held; how long (s) after that the last of these responses comes.  Raises Crashed."""
        times: list[float] = []
        start = time.monotonic()
        self.adder.let_go()
        for future in futures:
            future.add_done_callback(lambda _: times.append(time.monotonic()))
        self.wait_for(lambda: len(times) == len(futures), 2 * SENT)
        return max(times, default=start) - start

    def _send(self) -> Any:
        """Call it without waiting; the future of the response."""
        return self.ros.send(self.clients[RELAY], Trigger.Request())

    def _held(self, number: int) -> bool:
        """Return True if this many requests are held soon; raises Crashed."""
        limit = self._asking.within(SENT) if number == 1 else SENT
        return self.wait_for(lambda: len(self.adder.held) >= number, limit)

    def one_answered(self, futures: Sequence[Any]) -> bool:
        """Return True if one of the futures gets a response soon; raises Crashed."""
        return self._soon(lambda: any(future.done() for future in futures))

    def expect_no_early_answer(self, futures: Sequence[Any], just_sent: bool = True) -> None:
        """None of the callers may be answered while the adder holds its answers; raises Wrong, and Crashed.

        An adder that has given up holding has answered: that is wrong when the requests were `just_sent`.
        """
        if self.wait_for(lambda: any(future.done() for future in futures), EARLY):
            response = next(future.result() for future in futures if future.done())
            for future in futures:
                self.clients[RELAY].remove_pending_request(future)
            if self.adder.given_up and not just_sent:
                return
            if self.adder.given_up:
                raise Wrong(
                    f"The requests of {len(futures)} calls of {RELAY} must go out to {ADD} at once, while it has not "
                    f"answered the first one: here they took more than {HELD:.0f} s."
                )
            raise Wrong(
                f"{RELAY} must answer with what {ADD} has answered: it gave its caller {shown(response)} while {ADD} "
                "had not answered yet."
            )

    def all_answered(self, futures: Sequence[Any]) -> bool:
        """Return True if all of the futures get a response soon; raises Crashed."""
        return self._soon(lambda: all(future.done() for future in futures))

    def _soon(self, condition: Callable[[], bool]) -> bool:
        """Return True if the condition holds within SENT s; raises Crashed if the program dies first."""
        return self.wait_for(condition, SENT)

    def wait_for(self, condition: Callable[[], bool], limit: float) -> bool:
        """Return True if the condition holds within `limit` s; raises Crashed if the program dies first."""
        program = self.program
        wait_until(lambda: condition() or not program.alive, self.allow(limit))
        if not program.alive:
            self.end()
            raise Crashed(f"{self.file} died while calls of {RELAY} waited for an answer: {program.last_words()}.")
        return condition()

    def asked(self) -> tuple[int, int]:
        """The numbers that it sends to /add_two_ints when it is called once more."""
        self.relay()  # whatever was set before is in effect now
        before = len(self.adder.requests)
        self.relay()
        if not self.has_asked(before + 1):
            raise Wrong("The relay must call /add_two_ints each time that /relay is called; it did not.")
        return self.adder.requests[-1]

    def has_asked(self, times: int) -> bool:
        """Return True if it soon has sent this many requests to /add_two_ints."""
        asked = wait_until(lambda: len(self.adder.requests) >= times, self.allow(self._asking.within(SENT)))
        self._asking.in_vain = 0 if asked else self._asking.in_vain + 1
        return asked

    def sends(self, numbers: tuple[int, int]) -> bool | None:
        """Return True if it sends these numbers to /add_two_ints when called; None if it does not call it at all."""
        try:
            return sorted(self.asked()) == sorted(numbers)
        except Wrong:
            return None

    def asked_by_a_start(self, numbers: dict[str, int] | None = None) -> tuple[int, int]:
        """The same; if it only calls /add_two_ints at its first call, those of a new start, with these parameters set.

        That it must call each time, another test judges.
        """
        try:
            return self.asked()
        except Wrong:
            self.end()
            self.up(offer(RELAY))
            if numbers:
                self.change(numbers)
            self.relay()
            if not self.adder.requests:
                raise
            return self.adder.requests[-1]

    def change(self, numbers: dict[str, int]) -> None:
        """Set its parameters while it runs."""
        if not self.can_change(numbers):
            raise Wrong(
                "The node that offers /relay must declare the parameters a and b, and accept every whole number for "
                "them while it runs."
            )

    def can_change(self, numbers: dict[str, int]) -> bool:
        """Set its parameters; False when it refuses."""
        self.bench.hide(*numbers.values())
        return all(result.successful for result in self.parameters.set(numbers))

    def vary(self, rng: random.Random) -> None:
        """Set its parameters to other numbers: that it asks again for the same ones, or can be set, others judge.

        So do requests that it sends when it is set.  They have come by then, to be told from those of the next calls.
        """
        before = len(self.adder.requests)
        with suppress(Wrong):
            self.change(as_parameters(draw(rng)))
        if self._unasked is None:
            self.watch(UNASKED_FOR, since=time.monotonic())
            self._unasked = len(self.adder.requests) - before
        due = before + self._unasked
        wait_until(lambda: len(self.adder.requests) >= due, self.allow(SENT_BY_SUCH))

    def sum_in(self, message: str) -> int | None:
        """The answer of /add_two_ints that a message contains, or None."""
        return next((number for number in whole_numbers(message) if number in self.adder.sums), None)

    def together(self) -> list[Any]:
        """The responses to several callers at once; /add_two_ints answers when all have asked, or after SENT s."""
        self.up(offer(RELAY))  # a new start has a new adder
        with self.adder.holding(SENT, enough=CALLERS):
            responses = self.call_at_once(
                [[Trigger.Request()]] * CALLERS,
                "do all threads wait, or pause, so that none is left to take in the answers of /add_two_ints?",
            )
        return [response for (response,) in responses]


def whole_numbers(text: str) -> list[int]:
    """The whole numbers in a text, 1,234 and 1_234 as one each."""
    joined = GROUPED.sub(lambda found: re.sub("[,_]", "", found[0]), text)
    return [int(number) for number in re.findall(r"-?(?<!\d)\d{1,30}(?!\d)", joined)]


def draw(rng: random.Random) -> tuple[int, int]:
    """Two numbers for a and b, of different sign and size."""
    a, b = rng.randrange(100, 10**6), -rng.randrange(10**7, 10**15)
    return (a, b) if rng.random() < 0.5 else (b, a)


def as_parameters(values: tuple[int, int]) -> dict[str, int]:
    """Values for the relay's parameters."""
    return dict(zip("ab", values, strict=True))
