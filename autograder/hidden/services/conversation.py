"""The grader's side of the conversation: clients of the student's servers, and an /add_two_ints of its own."""

import random
import re
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from example_interfaces.srv import AddTwoInts
from rclpy.callback_groups import ReentrantCallbackGroup
from std_srvs.srv import SetBool, Trigger

from autograder.suitekit import SETTLED, Alive, Bench, Crashed, Offers, Parameters, Ros, Server, Wrong, numbers, offer
from course.waiting import wait_until

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

    def connect(self) -> Offers:
        """The clients, of the grader's node and of a second one."""
        self._pressed = False
        self.second = self.bench.enter(self.ros.domain)
        self.second_clients = {name: self.second.node.create_client(kind, name) for name, kind in self.services.items()}
        return super().connect()

    def command(self, service: str, on: bool, second: bool = False) -> Any:
        """The response of /motors/enable or /motors/emergency_stop, asked by the first or the second client."""
        if service == STOP:
            self._pressed = on
        return self._call(service, SetBool.Request(data=on), second)

    def status(self, second: bool = False) -> Any:
        """The response to asking for the state."""
        return self._call(STATUS, Trigger.Request(), second)

    def bring(self, state: str) -> None:
        """Bring the motors into that state before a test begins, as far as they let themselves be brought."""
        if state != STOPPED and (self._pressed or says(self.status().message) == STOPPED):
            self.command(STOP, False)
        if says(self.status().message) == state:
            return
        if state == STOPPED:
            self.command(STOP, True)
        else:
            self.command(ENABLE, state == ENABLED)

    def expect(self, state: str, when: str) -> None:
        """The status must say this state."""
        message = self.status().message
        if says(message) != state:
            raise Wrong(
                f"{when}, the message of {STATUS} must contain the word '{state}', and neither of the other two.",
                f"got {message!r}",
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


def told(response: Any) -> str:
    """What a response tells, in whatever words, to be compared with another."""
    return says(response.message) or response.message


class Adder:
    """The grader's own /add_two_ints.  Each response is another random number, which cannot be computed."""

    def __init__(self, ros: Ros, rng: random.Random):
        self.delay = 0.0  # s that an answer takes
        self.requests: list[tuple[int, int]] = []
        self.sums: list[int] = []
        self.held: list[threading.Event] = []  # what lets go each answer that is held back, in the order of requests
        self._holds = False
        self._rng, self._lock = rng, threading.Lock()
        ros.node.create_service(AddTwoInts, ADD, self._answer, callback_group=ReentrantCallbackGroup())

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
            response.sum = self._rng.randrange(10**8, 10**12)
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
        self._adder = self._adder or Adder(self.bench.enter(self.ros.domain, threads=CALLERS + 2), self.rng)

    def relay(self) -> Any:
        """Its response; with a server to call, once it has had time to find it."""
        response = self._relay()
        if self.served and self._settled != self.starts:
            response = response if response.success else self.wait_for_success()
            self._settled = self.starts
        if not response.success:
            self.failed = self.starts
        return response

    def wait_for_success(self) -> Any:
        """Its response, asked again and again until that has success True, or the time to find a server is over."""
        responses: list[Any] = []

        def succeeds() -> bool:
            responses.append(self._relay())
            return responses[-1].success

        wait_until(succeeds, self.allow(SETTLED))
        return responses[-1]

    def _relay(self) -> Any:
        def question(limit: float, alive: Alive) -> Any:
            # Sent once: a relay that waits for a server that is not there shall not have to do so again.
            return self.ros.call(self.clients[RELAY], Trigger.Request(), limit, alive, again=limit)

        return self.converse(question, f"a request to {RELAY}", offer(RELAY))

    def send(self, count: int = 1) -> list[Any]:
        """Call it `count` times without waiting; the futures of the responses, once all its requests are held.

        For a block in which the adder holds its answers.  Raises Wrong when a request of the relay's does not arrive
        while the others are held, and Crashed.
        """
        client = self.clients[RELAY]
        futures = [client.call_async(Trigger.Request()) for _ in range(count)]
        if not self._soon(lambda: len(self.adder.held) >= count):
            for future in futures:
                client.remove_pending_request(future)
            raise Wrong(
                f"The relay must call {ADD} each time that {RELAY} is called; it did not."
                if count == 1
                else f"While one call of {RELAY} waits for {ADD}, the next call must not have to wait for it: its "
                f"request must go out to {ADD} at once.",
                f"{len(self.adder.held)} of {count} requests arrived",
            )
        return futures

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

    def change(self, numbers: tuple[int, int]) -> None:
        """Set its parameters a and b while it runs."""
        self.bench.hide(*numbers)
        if not all(result.successful for result in self.parameters.set(dict(zip("ab", numbers, strict=True)))):
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
