"""The grader's side of the conversation: clients of the student's servers, and an /add_two_ints of its own."""

import random
import re
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

from example_interfaces.srv import AddTwoInts
from rclpy.callback_groups import ReentrantCallbackGroup
from std_srvs.srv import SetBool, Trigger

from autograder.errors import Fault
from autograder.suitekit import SETTLED, Alive, Bench, Crashed, Offers, Parameters, Ros, Server, Wrong, numbers, offer
from course.foundation.waiting import wait_until

ENABLE, STOP, STATUS = "/motors/enable", "/motors/emergency_stop", "/motors/status"
ENABLED, DISABLED, STOPPED = "enabled", "disabled", "stopped"
STATES = (DISABLED, ENABLED, STOPPED)
RELAY, ADD = "/relay", "/add_two_ints"
CALLERS = 6  # at once
SLOW = 0.15  # s that /add_two_ints takes then, so that the calls overlap
HELD = 4.0  # s that /add_two_ints holds an answer back at most, until the grader has seen what it wanted to see
SENT = 2.0  # s until a request has arrived, when its answer was not waited for


class Motors(Server):
    """The student's motor_service.py, with two clients for each of its services."""

    def __init__(self, bench: Bench):
        super().__init__(bench, "motor_service.py", {ENABLE: SetBool, STOP: SetBool, STATUS: Trigger})
        self._pressed = False  # whether the emergency stop was asked for last, and not its end
        self._last = ""  # the message of the last command's response
        self._tells: bool | None = None  # whether the status tells the state, in whatever way it changes
        self._changed = False  # whether a command has ever changed the state

    def connect(self) -> Offers:
        """The clients, of the grader's node and of a second one."""
        self._pressed, self._last = False, ""
        self.second = self.bench.enter(self.ros.domain)
        self.second_clients = {name: self.second.node.create_client(kind, name) for name, kind in self.services.items()}
        return super().connect()

    def command(self, service: str, on: bool, second: bool = False) -> Any:
        """The response of /motors/enable or /motors/emergency_stop, asked by the first or the second client."""
        if service == STOP:
            self._pressed = on
        response = self._call(service, SetBool.Request(data=on), second)
        self._last = response.message
        return response

    def attempt(self, service: str, on: bool) -> Any:
        """The same, or None when there is no response: that costs other points."""
        try:
            return self.command(service, on)
        except Fault:
            if self.bench.clock.left <= 0:
                raise  # the time for all tests is used up
            return None

    def status(self, second: bool = False) -> Any:
        """The response to asking for the state."""
        return self._call(STATUS, Trigger.Request(), second)

    def current(self, second: bool = False) -> str:
        """What the motors are said to be, by the status.

        Where the status names no state it is the last command's response, so that a mistake in the status does not hide
        what the other services do.
        """
        if self._tells is None:
            try:
                self._tells = says(self.status().message) is not None
            except Fault:
                self._tells = False
        return told(self.status(second).message if self._tells else self._last)

    def bring(self, state: str) -> bool:
        """Bring the motors into that state before a test begins, as far as they let themselves be brought.

        False when they gave no answer, which costs other points.
        """
        now = self.current() if self._tells is not False else ""
        if state != STOPPED and (self._pressed or now in (STOPPED, "")):
            self.attempt(STOP, False)
            now = self.current() if self._tells else ""
        if now == state:
            return True
        response = self.attempt(STOP, True) if state == STOPPED else self.attempt(ENABLE, state == ENABLED)
        return response is not None

    def expect(self, state: str, when: str) -> None:
        """They must be said to be in this state."""
        now = self.current()
        if now != state:
            by = f"the message of {STATUS}" if self._tells else "the message of the response"
            raise Wrong(f"{when}, {by} must contain the word '{state}', and neither of the other two.", f"got {now!r}")

    def expect_change(self) -> None:
        """Some command must have an effect: only then it is judged what stays as it is."""
        for service in (ENABLE, STOP):
            if not self._changed:
                self.bring(DISABLED)
                before = self.current()
                self._changed = self.attempt(service, True) is not None and self.current() != before
        if not self._changed:
            raise Wrong(
                "This is judged with motors that do something: but their state is the same after every command."
            )

    def _call(self, name: str, request: Any, second: bool) -> Any:
        def question(limit: float, alive: Alive) -> Any:
            ros, clients = (self.second, self.second_clients) if second else (self.ros, self.clients)
            return ros.call(clients[name], request, limit, alive)

        return self.converse(question, f"a request to {name}", offer(name))


def says(message: str) -> str | None:
    """The one state that a message names; None when it names none or several."""
    words = set(re.findall(rf"(?<![a-z])(?:{'|'.join(STATES)})(?![a-z])", message.lower()))
    return words.pop() if len(words) == 1 else None


def told(message: str) -> str:
    """What a message tells, in whatever words, to be compared with another."""
    return says(message) or message


class Adder:
    """The grader's own /add_two_ints.  Each response is another random number, which cannot be computed."""

    def __init__(self, ros: Ros, rng: random.Random):
        self.delay = 0.0  # s that an answer takes
        self.requests: list[tuple[int, int]] = []
        self.sums: list[int] = []
        self.held: list[threading.Event] = []  # what lets go each answer that is held back, in the order of requests
        self.fixed: int | None = None  # what is answered instead of random numbers
        self._holds = False
        self._rng, self._lock = rng, threading.Lock()
        self._node = ros.node
        self._service = ros.node.create_service(AddTwoInts, ADD, self._answer, callback_group=ReentrantCallbackGroup())

    def leave(self) -> None:
        """Offer the service no more."""
        self._node.destroy_service(self._service)

    def hold_no_more(self) -> None:
        """Answer further requests at once; those that are held stay so."""
        self._holds = False

    @contextmanager
    def holding(self) -> Iterator[None]:
        """Hold back each answer in this block, until its event is set, at most for HELD s."""
        self.held.clear()
        self._holds = True
        try:
            yield
        finally:
            self._holds = False
            for let_go in self.held:
                let_go.set()

    def _answer(self, request: Any, response: Any) -> Any:
        let_go = threading.Event()
        with self._lock:
            response.sum = self._rng.randrange(10**8, 10**12) if self.fixed is None else self.fixed
            self.requests.append((request.a, request.b))
            self.sums.append(response.sum)
            if self._holds:
                self.held.append(let_go)
            else:
                let_go.set()
        let_go.wait(HELD)
        time.sleep(self.delay)
        return response


class Relay(Server):
    """The student's relay.py, started with two numbers; /add_two_ints is there to be called, or not."""

    advice = "a callback that waits for an answer must not keep the answer from being taken in"

    def __init__(self, bench: Bench, rng: random.Random, served: bool):
        self.rng, self.served = rng, served
        self.numbers = a, b = draw(rng)
        bench.hide(a, b)
        super().__init__(bench, "relay.py", {RELAY: Trigger}, "--ros-args", "-p", f"a:={a}", "-p", f"b:={b}")
        self.parameters = Parameters(self, service=RELAY)
        self.failed = 0  # which of its starts answered with success False last
        self._settled = 0  # which of its starts has had time to find /add_two_ints
        self._adder: Adder | None = None
        self._adders: list[Adder] = []
        self._has_succeeded = False

    @property
    def does_something(self) -> bool:
        """Whether any of its starts has asked /add_two_ints, or answered with success True."""
        if not self._has_succeeded and not any(adder.requests for adder in self._adders):
            with suppress(Fault):
                self.relay()
        return self._has_succeeded or any(adder.requests for adder in self._adders)

    @property
    def adder(self) -> Adder:
        """What the relay has to call; only there when it is served."""
        if self._adder is None:
            raise RuntimeError("nobody serves /add_two_ints to this relay")
        return self._adder

    def connect(self) -> Offers:
        """The client, and the server for the program's own client."""
        self._adder = None
        if self.served:
            self.serve()
        return super().connect() | self.parameters.connect()

    def serve(self) -> None:
        """Offer /add_two_ints, unless it is offered already."""
        if self._adder is None:
            self._adder = Adder(self.bench.enter(self.ros.domain, threads=CALLERS + 2), self.rng)
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
        response = self._relay()
        if self.served and self._settled != self.starts:
            response = response if response.success else self.wait_for_success()
            self._settled = self.starts
        if not response.success:
            self.failed = self.starts
        self._has_succeeded = self._has_succeeded or response.success
        return response

    def wait_for_success(self, asking: bool = False) -> Any:
        """Its response, asked again and again until that has success True, or the time to find a server is over.

        With `asking` it must have called /add_two_ints, too.
        """
        responses: list[Any] = []

        def succeeds() -> bool:
            responses.append(self._relay())
            return responses[-1].success and (not asking or bool(self.adder.requests))

        wait_until(succeeds, self.allow(SETTLED))
        return responses[-1]

    def _relay(self) -> Any:
        def question(limit: float, alive: Alive) -> Any:
            # Sent once: a relay that waits for a server that is not there shall not have to do so again.
            return self.ros.call(self.clients[RELAY], Trigger.Request(), limit, alive, again=limit)

        return self.converse(question, f"a request to {RELAY}", offer(RELAY))

    def answers_again(self, limit: float) -> bool:
        """Whether one more call gets an answer within `limit` s."""
        program, client = self.program, self.clients[RELAY]
        limit = self.allow(limit)
        return self.ros.call(client, Trigger.Request(), limit, lambda: program.alive, again=limit) is not None

    def send(self, count: int = 1) -> list[Any]:
        """Call it `count` times without waiting; the futures of the responses, in the order of the held requests.

        For a block in which the adder holds its answers: each call is sent when the request of the one before is
        held.  Raises Wrong when a request of the relay's does not arrive while the others are held, and Crashed.
        """
        client, futures = self.clients[RELAY], []
        for number in range(1, count + 1):
            futures.append(client.call_async(Trigger.Request()))
            if not self._held(number):
                for future in futures:
                    client.remove_pending_request(future)
                raise Wrong(
                    f"The relay must call {ADD} each time that {RELAY} is called; it did not."
                    if number == 1
                    else f"While one call of {RELAY} waits for {ADD}, the next call must not have to wait for it: its "
                    f"request must go out to {ADD} at once.",
                    f"{len(self.adder.held)} of {number} requests arrived",
                )
        return futures

    def _held(self, number: int) -> bool:
        """Whether so many requests are held, soon; raises Crashed."""
        return self._soon(lambda: len(self.adder.held) >= number)

    def one_answered(self, futures: Sequence[Any]) -> bool:
        """Whether one of the futures gets a response, soon; raises Crashed."""
        return self._soon(lambda: any(future.done() for future in futures))

    def all_answered(self, futures: Sequence[Any]) -> bool:
        """Whether all of the futures get a response, soon; raises Crashed."""
        return self._soon(lambda: all(future.done() for future in futures))

    def _soon(self, condition: Callable[[], bool]) -> bool:
        """Whether the condition holds within SENT s; raises Crashed when the program dies before."""
        program = self.program
        wait_until(lambda: condition() or not program.alive, self.allow(SENT))
        if not program.alive:
            self.end()
            raise Crashed(f"{self.file} died while several calls of {RELAY} waited for {ADD}: {program.last_words()}.")
        return condition()

    def asked(self) -> tuple[int, int]:
        """The numbers that it sends to /add_two_ints when it is called once more."""
        self.relay()  # whatever was set before is in effect now
        before = len(self.adder.requests)
        self.relay()
        if not wait_until(lambda: len(self.adder.requests) > before, self.bench.clock.allow(SENT)):
            raise Wrong("The relay must call /add_two_ints each time that /relay is called; it did not.")
        return self.adder.requests[-1]

    def has_been_asked(self, times: int, limit: float) -> bool:
        """Whether /add_two_ints has got so many requests, within `limit` s."""
        return wait_until(lambda: len(self.adder.requests) >= times, limit)

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
        self.bench.hide(*numbers.values())
        if not all(result.successful for result in self.parameters.set(numbers)):
            raise Wrong(
                "The parameters a and b must be declared, and must accept every whole number while the relay runs."
            )

    def sum_in(self, message: str) -> int | None:
        """The answer of /add_two_ints that a message contains, or None."""
        return next((int(number) for number in numbers(message) if number in self.adder.sums), None)

    def together(self) -> list[Any]:
        """The responses to several callers at once, while /add_two_ints takes its time."""
        self.up(offer(RELAY))  # a new start has a new adder
        self.adder.delay = SLOW
        try:
            responses = self.call_at_once(
                [[Trigger.Request()]] * CALLERS,
                "do all threads wait, so that none is left to take in the answers of /add_two_ints?",
            )
        finally:
            self.adder.delay = 0.0
        return [response for (response,) in responses]


def draw(rng: random.Random) -> tuple[int, int]:
    """Two numbers for a and b, of different sign and size."""
    a, b = rng.randrange(100, 10**6), -rng.randrange(10**7, 10**15)
    return (a, b) if rng.random() < 0.5 else (b, a)
