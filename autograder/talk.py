"""What every hidden suite has at hand: the student's programs, started in the sandbox and spoken to with patience.

A program that has died is started again for the next test, so that each test judges its own behaviour.  Only what
happens repeatedly, or what a program itself owns up to with a traceback, is held against it.
"""

import random

import pytest

from .faults import Crashed, Fault, TimedOut, Wrong
from .judge import GRADING
from .program import Program
from .ros import Ros, wait_until
from .session import Grading

START = 20.0  # s that a program may take until it offers its services
SETTLED = 6.0  # s, the same once its node is there
ANSWER = 10.0  # s that an answer may take
SHORT = 3.0  # s, the same once a program has been silent before


class Server:
    """A handed-in program that offers a service, with a node of the grader's to call it."""

    def __init__(self, grading: Grading, file: str, service: str, kind: type):
        self.grading, self.file, self.service, self.kind = grading, file, service, kind
        self.starts = 0
        self.program: Program | None = None
        self.ros: Ros | None = None
        self._was_up = False
        self._hopeless: Fault | None = None
        self._silences = 0
        self._answered = False

    def begin(self) -> None:
        """Start the program in a new domain, without waiting for it."""
        domain = self.grading.room()
        self.program = self.grading.start(self.file, domain=domain)
        self.ros = self.grading.enter(domain)
        self.client = self.ros.node.create_client(self.kind, self.service)
        self._was_up = False
        self.starts += 1

    def up(self) -> None:
        """Have the program running and its service offered; raises a Fault when it does not get there twice."""
        if self._hopeless:
            raise self._hopeless
        if self._was_up and self.program.alive:
            return
        for limit in (START, START / 2):
            if self.program is None or self._was_up or self.program.stopped:
                self.begin()
            allow = self.grading.clock.allow
            if wait_until(lambda: self._offered or not self.program.alive or self.ros.others(), allow(limit)):
                wait_until(lambda: self._offered or not self.program.alive, allow(SETTLED))
            if self.program.alive and self._offered:
                self._was_up = True
                return
            fault = self._not_up()
            self.program.kill()
            if isinstance(fault, Wrong):
                break
            self._was_up = True  # have the next one started
        self._hopeless = fault
        raise fault

    def call(self, request):
        """The service's response; raises Crashed or TimedOut."""
        for attempt in (1, 2):
            self.up()
            program, patience = self.program, SHORT if self._silences >= 2 else ANSWER
            limit = self.grading.clock.allow(patience)
            response = self.ros.call(self.client, request, limit, lambda p=program: p.alive)
            if response is not None:
                self._answered = True
                return response
            if program.alive and not program.wait(0.2):
                self._silences += 1
                fault = TimedOut(f"{self.file} runs, but a request to {self.service} got no answer within "
                                 f"{limit:.0f} s: the callback must return the response, and not wait for long.")
                program.kill()
                if self._silences > 2:
                    if not self._answered:
                        self._hopeless = fault
                    break
            else:
                program.wait(1)
                fault = Crashed(f"{self.file} died while it answered a request: {program.last_words()}.")
                if program.raised or program.stopped:
                    break
        raise fault

    @property
    def _offered(self) -> bool:
        return self.client.service_is_ready()

    @property
    def log(self) -> str:
        """What the program has logged since it was started: printed or on /rosout."""
        return f"{self.program.output}\n{self.ros.rosout}"

    def _not_up(self) -> Fault:
        program, promise = self.program, f"the service {self.service}"
        if not program.alive:
            program.wait(1)
            if program.exit_status == 0:
                return Crashed(f"{self.file} ended by itself right after its start: main() must spin the node, and be "
                               "called at the end of the file.")
            return Crashed(f"{self.file} did not start: {program.last_words()}.")
        if offered := self.ros.offered():
            return Wrong(f"{self.file} runs, but does not offer {promise}. It offers: {', '.join(offered)[:300]}.")
        if self.ros.others():
            return Wrong(f"{self.file} runs a node, but it does not offer {promise}.")
        return TimedOut(f"{self.file} was started, but even after {self.grading.clock.allow(START):.0f} s there was no "
                        f"node and no service {self.service}: does it wait for something before it creates them?")


@pytest.fixture(scope="session")
def grading(pytestconfig) -> Grading:
    """The submission being graded."""
    return pytestconfig.stash[GRADING]


@pytest.fixture(scope="session")
def submission(grading: Grading) -> dict[str, bytes]:
    """The handed-in files."""
    return grading.files


@pytest.fixture
def rng(grading: Grading, request) -> random.Random:
    """Random numbers of a test's own."""
    return grading.random(request.node.name)
