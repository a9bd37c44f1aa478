"""A student's program that runs until the grader ends it, and the grader's node that talks to it."""

import re
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from autograder.errors import Crashed, TimedOut
from autograder.sandbox.program import Program
from autograder.suitekit.bench import Bench
from autograder.suitekit.hints import last_words
from autograder.suitekit.lifecycle import ANSWER, TOLD, Alive, Lifecycle
from autograder.suitekit.ros import Ros
from autograder.suitekit.topics import PUBLISH, own_topics, short
from course.foundation.waiting import wait_until
from course.ros.names import type_name

STUCK = "it was stuck with several callers"
DEAF = (
    "Its text makes an EventsExecutor, which calls no callback in this version of rclpy: if that one spins your node, "
    "take a SingleThreadedExecutor or a MultiThreadedExecutor."
)

Offers = dict[str, Callable[[], bool]]  # what a program must offer, in words for the student, with a test of each


class LiveProgram(Lifecycle):
    """A handed-in program that runs until the grader ends it; see `lifecycle` for when it is started and given up."""

    files: Mapping[str, bytes] | None = None  # the grader's files beside the program
    kinds: Mapping[str, tuple[str, str]] = {}  # name and type of services and actions, by the words of `connect`
    program: Program
    ros: Ros  # the grader's node in the program's domain

    def __init__(self, bench: Bench, file: str, *args: str):
        """Prepare to run `file` with the command line `args`."""
        super().__init__(file)
        self.bench, self.args = bench, args
        self._offers: Offers = {}

    def connect(self) -> Offers:
        """Make the clients, publishers and subscriptions of `self.ros` for the program; called at each of its starts.

        Returns what the program must offer, in words for the student ("the service /sum"), each with a function that
        returns whether it is there.
        """
        raise NotImplementedError

    @property
    def command_line(self) -> Sequence[str]:
        """Return the program's arguments."""
        return self.args

    @property
    def log(self) -> str:
        """Return the program's log since its start: its output and /rosout."""
        return f"{self.program.output}\n{self.ros.rosout}"

    def launch(self) -> Program:
        """Start the program in a new domain, and enter it."""
        domain = self.bench.new_domain()
        program = self.bench.start(self.file, *self.command_line, domain=domain, files=self.files)
        self.ros = self.bench.enter(domain)
        self._offers = self.connect()
        return program

    def missing(self, wanted: tuple[str, ...]) -> list[str]:
        """Return the parts of `wanted`, by default of everything required, that the program does not offer."""
        return [offer for offer in wanted or self._offers if not self._offers[offer]()]

    def has_node(self) -> bool:
        """Return True if there is a node in the domain that is not the grader's."""
        return bool(self.ros.others())

    def other_services(self) -> list[str]:
        """Return the services of the program's nodes with their types, without those that every node has."""
        return self.ros.offered()

    def mistyped(self, wanted: tuple[str, ...]) -> str:
        """Return which of the services and actions is offered with another type, as a sentence; empty when none is."""
        for offered in self.other_services():
            name, _, kind = offered.removesuffix(")").partition(" (")
            for part in self.missing(wanted):
                named, right = self.kinds.get(part, ("", ""))
                if named in (name, offer(name)) and kind != right:
                    return f"{self.file} offers {named} with the type {kind}; its type must be {right}."
        return ""

    def why_silent(self) -> str:
        """Return a sentence on an executor that its text makes and that calls no callback; empty when it makes none."""
        source = self.bench.files[self.file].decode(errors="replace")
        return DEAF if re.search(r"^[^#\n]*\bEventsExecutor\(", source, re.MULTILINE) else ""

    def other_topics(self) -> str:
        """Return a sentence for the student on the topics of the program's nodes, with types."""
        parts = [
            f"{does} {', '.join(f'{name} ({short(kind)})' for name, kind in topics)[:TOLD]}"
            for does, topics in (("publishes", own_topics(self.ros, PUBLISH)), ("subscribes", own_topics(self.ros)))
            if topics
        ]
        return f"It {' and '.join(parts)}." if parts else ""

    @property
    def tries(self) -> tuple[float, ...]:
        """Return the times (s) that the program has to offer what is wanted: fewer if it shows no node elsewhere.

        While its file has shown one in no world, it has one try if there was none in one other world, and none if there
        was none in two.
        """
        return super().tries[0 if self.file in self.bench.with_node else self.bench.nodeless[self.file] :]

    def shows_a_node(self) -> None:
        """Note it for the other worlds in which the same file is started."""
        self.bench.with_node.add(self.file)

    def never_shows_a_node(self) -> None:
        """Note it for the other worlds in which the same file is started."""
        self.bench.nodeless[self.file] += 1

    def allow(self, seconds: float) -> float:
        """Return the time limit (s) for a wait that should take less than `seconds`."""
        return self.bench.clock.allow(seconds)

    def wait_until(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Wait until `condition()` is true, at most `timeout` s; return its last value."""
        return wait_until(condition, timeout)


class Server(LiveProgram):
    """A handed-in program that offers services."""

    advice = "the callback must return the response, and not wait for long"

    def __init__(self, bench: Bench, file: str, services: Mapping[str, type], *args: str):
        """Prepare; `services` are the types by name; `args` is the program's command line."""
        super().__init__(bench, file, *args)
        self.services = services
        self.kinds = {offer(name): (offer(name), type_name(kind)) for name, kind in services.items()}
        self.clients: dict[str, Any] = {}

    def connect(self) -> Offers:
        """Make a client for each service."""
        self.clients = {name: self.ros.node.create_client(kind, name) for name, kind in self.services.items()}
        return {offer(name): client.service_is_ready for name, client in self.clients.items()}

    def call(self, request: Any, service: str | None = None) -> Any:
        """Return the response of a service, by default the first; raises Crashed or TimedOut."""
        name = service or next(iter(self.services))

        def question(limit: float, alive: Alive) -> Any:
            return self.ros.call(self.clients[name], request, limit, alive)

        return self.converse(question, f"a request to {name}", offer(name))

    def call_at_once(self, requests: Sequence[Sequence[Any]], doubt: str = "") -> list[list[Any]]:
        """Call the first service by several clients at once, one for each list of requests; return the responses.

        Each client sends the requests of its list one after the other.  The program is not started again: raises
        TimedOut when a request gets no answer (with the question `doubt` to the student), and Crashed.
        """
        service, kind = next(iter(self.services.items()))
        self.up(offer(service))
        program, limit = self.program, self.allow(ANSWER)
        clients = [self.ros.node.create_client(kind, service) for _ in requests]
        wait_until(lambda: all(client.service_is_ready() for client in clients), limit)

        def ask(client: Any, own: Sequence[Any]) -> list[Any]:
            responses = []
            for request in own:
                response = self.ros.call(client, request, limit, lambda: program.alive)
                if response is None:
                    break
                responses.append(response)
            return responses

        with ThreadPoolExecutor(len(clients)) as pool:
            responses = list(pool.map(ask, clients, requests))
        if all(len(got) == len(sent) for got, sent in zip(responses, requests, strict=True)):
            return responses
        if program.alive:
            self.end(STUCK)
            raise TimedOut(
                f"When {len(clients)} clients called {service} at once, a request got no answer within "
                f"{limit:.0f} s{doubt and ': '}{doubt or '.'}"
            )
        raise Crashed(f"{self.file} died while {len(clients)} clients called {service}: {last_words(program)}.")


def offer(service: str) -> str:
    """Return the text for the student about a service."""
    return f"the service {service}"
