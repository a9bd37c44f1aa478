"""What every hidden suite has at hand: the student's programs, started in the sandbox and spoken to with patience.

A program that has died is started again for the next test, so that each test judges its own behaviour.  Only what
happens repeatedly, or what a program itself owns up to with a traceback, is held against it.
"""

import functools
import re
from collections.abc import Callable, Mapping
from typing import Any

from autograder.errors import Crashed, Fault, TimedOut, Wrong
from autograder.sandbox.cleaning import NUMBER
from autograder.sandbox.program import Program
from autograder.suitekit.bench import Bench, Run
from autograder.suitekit.ros import Ros
from course.waiting import wait_until

START = 20.0  # s that a program may take until it offers its services
SETTLED = 6.0  # s, the same once its node is there
ANSWER = 10.0  # s that an answer may take
SHORT = 3.0  # s, the same once a program has been silent before
SPARE_LIVES = 2  # of a program that ends between two questions: started again so often
SPIN = "main() must spin the node until it is stopped"
CLIENT = 10.0  # s that a client may run, with or without a server


class Live:
    """A handed-in program that runs until the grader ends it, with a node of the grader's to speak to it."""

    advice = "no callback may wait for long"  # to the student whose program is silent
    files: Mapping[str, bytes] | None = None  # the grader lays these beside the program

    def __init__(self, bench: Bench, file: str, *args: str):
        self.bench, self.file, self.args = bench, file, args
        self.starts = 0
        self.program: Program | None = None
        self.ros: Ros | None = None
        self._seen: set[tuple[str, ...]] = set()  # what this start of the program has been seen to offer
        self._spent = False
        self._hopeless: dict[tuple[str, ...], Fault] = {}
        self._silences = 0
        self._ends = 0  # of a program that had been there, by itself and not while it answered
        self._answered = False

    def connect(self) -> dict[str, Callable[[], bool]]:
        """Make what `self.ros` speaks to the program with.

        Returns what the program must offer, as the student is told ("the service /sum"), each with a function that
        tells whether it is there.
        """
        raise NotImplementedError

    def begin(self) -> None:
        """Start the program in a new domain, without waiting for it."""
        domain = self.bench.new_domain()
        self.program = self.bench.start(self.file, *self.args, domain=domain, files=self.files)
        self.ros = self.bench.enter(domain)
        self._offers = self.connect()
        self._seen.clear()
        self._spent = False
        self.starts += 1

    def up(self, *wanted: str) -> None:
        """Have the program running and what is `wanted` (by default all) offered; raises a Fault when that fails twice."""
        if fault := self._hopeless.get(wanted) or self._hopeless.get(()):
            raise fault
        alive = self.program is not None and self.program.alive
        if self._seen and not self._spent and not alive:
            self._ends += 1
        if self._ends > SPARE_LIVES:
            self.program.wait(1)
            self._hopeless[()] = Crashed(
                f"{self.file} ended by itself after it had answered, again and again{self._status()}: {SPIN}."
            )
            raise self._hopeless[()]
        if wanted in self._seen and alive:
            return
        for limit in (START, START / 2):
            if self.program is None or self.program.stopped or (self._spent or self._seen) and not self.program.alive:
                self.begin()
            allow = self.bench.clock.allow
            if wait_until(lambda: self._offered(wanted) or not self.program.alive or self.ros.others(), allow(limit)):
                wait_until(lambda: self._offered(wanted) or not self.program.alive, allow(SETTLED))
            if self.program.alive and self._offered(wanted):
                self._seen.add(wanted)
                return
            fault = self._not_up(wanted)
            if isinstance(fault, Wrong):
                break
            self.program.kill()
            self._spent = True
        self._hopeless[wanted] = fault
        raise fault

    def converse(self, question: Callable[[float, Callable[[], bool]], Any], what: str, *wanted: str) -> Any:
        """What `question(limit, alive)` returns, as soon as that is not None; raises Crashed or TimedOut.

        `what` names the question to the student: "a request to /sum".
        """
        died = False
        for attempt in (1, 2):
            self.up(*wanted)
            program, patience = self.program, SHORT if self._silences >= 2 else ANSWER
            limit = self.bench.clock.allow(patience)
            answer = question(limit, lambda p=program: p.alive)
            if answer is not None:
                self._answered = True
                self._ends += attempt == 2 and died  # not of this question
                return answer
            if program.alive and not program.wait(0.2):
                self._silences += 1
                fault = TimedOut(f"{self.file} runs, but {what} got no answer within {limit:.0f} s: {self.advice}.")
                program.kill()
                self._spent = True
                if self._silences > 2:
                    if not self._answered:
                        self._hopeless[()] = fault
                    break
            else:
                program.wait(1)
                self._spent = died = True
                if program.exit_status == 0 and not program.stopped:
                    fault = Crashed(f"{self.file} ended by itself when it got {what}: {SPIN}.")
                else:
                    words = program.last_words()
                    hint = (
                        f": {self.advice}" if words.startswith("TypeError (") else ""
                    )  # what rclpy raises has no words
                    fault = Crashed(f"{self.file} died while it answered {what}: {words}{hint}.")
                if program.raised or program.stopped:
                    break
        raise fault

    @property
    def log(self) -> str:
        """What the program has logged since it was started: printed or on /rosout."""
        return f"{self.program.output}\n{self.ros.rosout}"

    def _status(self) -> str:
        """How it has ended, in brackets; nothing while it runs."""
        return "" if self.program.alive else f" ({self.program.last_words()})"

    def _missing(self, wanted: tuple[str, ...]) -> list[str]:
        return [offer for offer in wanted or self._offers if not self._offers[offer]()]

    def _offered(self, wanted: tuple[str, ...]) -> bool:
        return not self._missing(wanted)

    def _not_up(self, wanted: tuple[str, ...]) -> Fault:
        program, promise = self.program, " and ".join(self._missing(wanted) or wanted or self._offers)
        if not program.alive:
            program.wait(1)
            if program.exit_status == 0:
                return Crashed(
                    f"{self.file} ended by itself right after its start: main() must spin the node, and be "
                    "called at the end of the file."
                )
            return Crashed(f"{self.file} did not start: {program.last_words()}.")
        if offered := self.ros.offered():
            return Wrong(f"{self.file} runs, but does not offer {promise}. It offers: {', '.join(offered)[:300]}.")
        if self.ros.others():
            return Wrong(f"{self.file} runs a node, but it does not offer {promise}.")
        return TimedOut(
            f"{self.file} was started, but even after {self.bench.clock.allow(START):.0f} s there was no "
            f"node and not {promise}: does it wait for something before it creates them?"
        )


class Server(Live):
    """A handed-in program that offers services."""

    advice = "the callback must return the response, and not wait for long"

    def __init__(self, bench: Bench, file: str, services: dict[str, type], *args: str):
        """`services` are the types by name; `args` is the program's command line."""
        super().__init__(bench, file, *args)
        self.services = services

    def connect(self) -> dict[str, Callable[[], bool]]:
        """A client for each service."""
        self.clients = {name: self.ros.node.create_client(kind, name) for name, kind in self.services.items()}
        return {f"the service {name}": client.service_is_ready for name, client in self.clients.items()}

    def call(self, request, service: str | None = None):
        """The response of a service, by default the first; raises Crashed or TimedOut."""
        name = service or next(iter(self.services))
        return self.converse(
            lambda limit, alive: self.ros.call(self.clients[name], request, limit, alive),
            f"a request to {name}",
            f"the service {name}",
        )


def twice(test: Callable) -> Callable:
    """Have a test judged again when it finds something wrong: a lost message happens once, a fault always."""

    @functools.wraps(test)
    def judge(*args, **kwargs):
        try:
            test(*args, **kwargs)
        except Wrong:
            test(*args, **kwargs)

    return judge


def finish(run: Run, doing: str, limit: float = CLIENT) -> Program:
    """A client's ended run; raises TimedOut when it took longer than `limit` s, and Crashed when it raised.

    `doing` tells the student which run this was: "without a server".
    """
    program = run.finish(limit, doing)
    if program.raised:
        raise Crashed(f"{run.file} {doing} died: {program.last_words()}.")
    return program


def numbers(text: str) -> list[float]:
    """The numbers in a text, 1,234.5 and 1_234.5 as one, without the times of ROS log lines.

    1234.0,432.0 are two: only groups of three digits belong together, before the point.
    """
    text = re.sub(r"\[\d{9,}\.\d+\]", "", text)
    return [
        float(token)
        for token in NUMBER.findall(
            re.sub(
                r"(?<![\d.])\d{1,3}(?:([,_])\d{3})(?:\1\d{3})*(?!\d)", lambda found: re.sub("[,_]", "", found[0]), text
            )
        )
    ]
