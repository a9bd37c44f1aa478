"""The grader's side of the conversation: clients of the student's servers, and an /add_two_ints of its own."""

import random
import re
import threading
import time
from concurrent.futures import ThreadPoolExecutor

from example_interfaces.srv import AddTwoInts
from rclpy.callback_groups import ReentrantCallbackGroup
from std_srvs.srv import SetBool, Trigger

from autograder.errors import Crashed, TimedOut, Wrong
from autograder.suitekit.live import ANSWER, SETTLED, Server, numbers
from autograder.suitekit.parameters import Parameters
from autograder.suitekit.ros import Ros
from course.waiting import wait_until

ENABLE, STATUS = "/motors/enable", "/motors/status"
WORDS = {True: "enabled", False: "disabled"}
CALLERS = 6  # at once
SLOW = 0.15  # s that /add_two_ints takes then
STUCK = "it was stuck with several callers"
SENT = 2.0  # s until a request has arrived, when its answer was not waited for


class Motors(Server):
    """The student's motor_service.py, with two clients for each of its services."""

    def __init__(self, bench):
        super().__init__(bench, "motor_service.py", {ENABLE: SetBool, STATUS: Trigger})

    def connect(self):
        """The clients, of this node and of a second."""
        self.second = self.bench.enter(self.ros.domain)
        self.second_clients = {name: self.second.node.create_client(kind, name) for name, kind in self.services.items()}
        return super().connect()

    def enable(self, on: bool, second: bool = False):
        """The response to switching."""
        return self._call(ENABLE, SetBool.Request(data=on), second)

    def status(self, second: bool = False):
        """The response to the question for the state."""
        return self._call(STATUS, Trigger.Request(), second)

    def bring(self, on: bool) -> None:
        """Have the motors in that state before a test begins."""
        if says(self.status().message) is not on:
            self.enable(on)

    def expect(self, on: bool, when: str) -> None:
        """The status must say this state."""
        message = self.status().message
        if says(message) is not on:
            raise Wrong(
                f"{when}, the message of {STATUS} must have the word '{WORDS[on]}' (and not '{WORDS[not on]}').",
                f"got {message!r}",
            )

    def _call(self, name, request, second):
        def question(limit, alive):
            ros, clients = (self.second, self.second_clients) if second else (self.ros, self.clients)
            return ros.call(clients[name], request, limit, alive)

        return self.converse(question, f"a request to {name}", f"the service {name}")


def says(message: str) -> bool | None:
    """The one state that a message says, or None."""
    words = set(re.findall(r"(?<![a-z])(?:enabled|disabled)(?![a-z])", message.lower()))
    return next(iter(words)) == WORDS[True] if len(words) == 1 else None


def told(response) -> object:
    """What a response tells, in whatever words: to be compared with another."""
    state = says(response.message)
    return response.message if state is None else state


class Adder:
    """The grader's own /add_two_ints.  Each response is a number of its own, which cannot be computed."""

    def __init__(self, ros: Ros, rng: random.Random):
        self.delay = 0.0  # s that an answer takes
        self.requests: list[tuple[int, int]] = []
        self.sums: list[int] = []
        self._rng, self._lock = rng, threading.Lock()
        ros.node.create_service(AddTwoInts, "/add_two_ints", self._answer, callback_group=ReentrantCallbackGroup())

    def _answer(self, request, response):
        with self._lock:
            response.sum = self._rng.randrange(10**8, 10**12)
            self.requests.append((request.a, request.b))
            self.sums.append(response.sum)
        time.sleep(self.delay)
        return response


class Relay(Server):
    """The student's relay.py, started with two numbers; with an /add_two_ints to call, or without."""

    advice = "a callback that waits for an answer must not keep the answer from being taken in"

    def __init__(self, bench, rng: random.Random, served: bool):
        self.rng, self.served = rng, served
        self.numbers = a, b = draw(rng)
        bench.hide(a, b)
        super().__init__(bench, "relay.py", {"/relay": Trigger}, "--ros-args", "-p", f"a:={a}", "-p", f"b:={b}")
        self.parameters = Parameters(self, service="/relay")
        self.failed = 0  # which of its starts has answered with success False
        self._settled = 0

    def connect(self):
        """The client, and the server for the program's own client."""
        self.adder = None
        if self.served:
            self.serve()
        return super().connect() | self.parameters.connect()

    def serve(self) -> None:
        """Offer /add_two_ints, if that is not done yet."""
        self.adder = self.adder or Adder(self.bench.enter(self.ros.domain, threads=CALLERS + 2), self.rng)

    def relay(self):
        """Its response, once it has had time to find /add_two_ints."""
        response = self._relay()
        if self.served and self._settled != self.starts:
            end = time.monotonic() + self.bench.clock.allow(SETTLED)
            while not response.success and time.monotonic() < end:
                time.sleep(0.1)
                response = self._relay()
            self._settled = self.starts
        if not response.success:
            self.failed = self.starts
        return response

    def _relay(self):
        return self.converse(  # once: who waits for a server that is not there shall not have to do so again
            lambda limit, alive: self.ros.call(self.clients["/relay"], Trigger.Request(), limit, alive, again=limit),
            "a request to /relay",
            "the service /relay",
        )

    def asked(self) -> tuple[int, int]:
        """The numbers that it asked /add_two_ints for in one more call."""
        self.relay()  # whatever was set before is in effect now
        before = len(self.adder.requests)
        self.relay()
        if not wait_until(lambda: len(self.adder.requests) > before, self.bench.clock.allow(SENT)):
            raise Wrong("For each call of /relay, the relay must call /add_two_ints; it did not.")
        return self.adder.requests[-1]

    def change(self, numbers: tuple[int, int]) -> None:
        """Set its parameters while it runs."""
        self.bench.hide(*numbers)
        if not all(result.successful for result in self.parameters.set(dict(zip("ab", numbers, strict=True)))):
            raise Wrong("The parameters a and b must be declared, and accept every whole number while the relay runs.")

    def sum_in(self, message: str) -> int | None:
        """The answer of /add_two_ints that a message has, or None."""
        return next((int(number) for number in numbers(message) if number in self.adder.sums), None)

    def together(self) -> list:
        """The responses to some callers at once, while /add_two_ints takes its time; the program is not started again."""
        self.up()
        self.adder.delay = SLOW
        clients = [self.ros.node.create_client(Trigger, "/relay") for _ in range(CALLERS)]
        wait_until(lambda: all(client.service_is_ready() for client in clients), self.bench.clock.allow(ANSWER))
        limit = self.bench.clock.allow(ANSWER)
        with ThreadPoolExecutor(CALLERS) as pool:
            responses = [
                *pool.map(
                    lambda client: self.ros.call(client, Trigger.Request(), limit, lambda: self.program.alive), clients
                )
            ]
        self.adder.delay = 0.0
        if None not in responses:
            return responses
        if self.program.alive:
            self.program.kill(STUCK)
            raise TimedOut(
                f"With {CALLERS} callers of /relay at once, not each got an answer within {limit:.0f} s: "
                "do they all wait, and nobody is left to take in the answers of /add_two_ints?"
            )
        raise Crashed(f"relay.py died while {CALLERS} clients called it: {self.program.last_words()}.")


def draw(rng: random.Random) -> tuple[int, int]:
    """Two numbers for a and b, of different sign and size."""
    a, b = rng.randrange(100, 10**6), -rng.randrange(10**7, 10**15)
    return (a, b) if rng.random() < 0.5 else (b, a)
