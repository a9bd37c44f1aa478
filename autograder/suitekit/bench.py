"""One submission being graded: its files, its programs, its ROS domains and its clock."""

import random
import socket
from collections import Counter
from collections.abc import Callable, Mapping

from autograder.errors import TimedOut
from autograder.sandbox.cleaning import NUMBER, excerpt
from autograder.sandbox.launching import LaunchClient
from autograder.sandbox.networks import Threads
from autograder.sandbox.program import Program
from autograder.suitekit.clock import Clock
from autograder.suitekit.ros import Ros
from autograder.suitekit.runs import Run, drawn
from course.session.domains import claim_domain

COMMON = {"", 0.0, 1.0, 2.0, 3.0}  # not worth hiding: they are in every program


class _WhenAsked(dict[str, Run]):
    """Runs by name, each started when it is first asked for."""

    def __init__(self, start: Callable[[str], Run]):
        super().__init__()
        self._start = start

    def __missing__(self, name: str) -> Run:
        self[name] = self._start(name)
        return self[name]


class Bench:
    """One submission being graded: its files, the sandbox that runs them, and the time that is left."""

    def __init__(
        self, files: dict[str, bytes], sandbox: LaunchClient, threads: Threads | None, clock: Clock, seed: int
    ):
        """Prepare; `threads` are in the networks of the ROS domains that may be used; None without a sandbox."""
        self.files = files
        self.sandbox = sandbox
        self.clock = clock
        self.seed = seed
        self._nodes: list[Ros] = []
        self._threads = threads
        # In another order each time, so that no program can tell from its domain what is being tested.
        self._domains = random.sample(threads.domains, len(threads.domains)) if threads else []
        self._claims: list[socket.socket] = []  # of its domains without a sandbox, until the process ends
        self.early: Mapping[str, Run] = {}
        self._hidden: set[float | str] = set()
        self.nodeless: Counter[str] = Counter()  # by file: in how many worlds its program has shown no node
        self.with_node: set[str] = set()  # the files whose programs have shown a node in some world
        self.late: set[str] = set()  # files of which a run was still going on at its limit, twice
        self.known: set[str] = set()  # what the suite has learned of the programs, in words of its own

    def random(self, name: str) -> random.Random:
        """Return random numbers for one purpose: they depend on the grading's seed and `name`, not on earlier draws."""
        return random.Random(f"{self.seed} {name}")

    def new_domain(self) -> int:
        """Return a ROS domain that this grading has not used yet, so that no earlier messages are received in it.

        Without a sandbox it is one that nobody else on this machine uses; raises LiveError if all are in use.
        """
        if self._threads is None:
            claim, domain = claim_domain()
            self._claims.append(claim)
            return domain
        if not self._domains:
            raise TimedOut(
                "Not tested: the tests before have used up the starts that the grader has for your programs. It starts "
                "a program again when that has ended, when an answer did not come in time, or when a test needs a "
                "fresh start."
            )
        return self._domains.pop()

    def enter(self, domain: int, threads: int = 1) -> Ros:
        """Return a grader's node in that domain, whose callbacks run in `threads` threads."""

        def join() -> Ros:
            return Ros(domain, threads)

        self._nodes.append(self._threads.run(domain, join) if self._threads else join())
        return self._nodes[-1]

    def begin(self, runs: dict[str, list[str]], whole: bool = True) -> None:
        """Start the `early` runs, given as command lines by name (see `drawn`), each alone in a domain.

        Unless the suite is `whole`, each starts when a test first asks for it.
        """

        def run(name: str) -> Run:
            return self.run(*drawn(runs[name], self.random(f"early {name}")), domain=self.new_domain())

        self.early = _WhenAsked(run)
        for name in runs if whole else ():
            self.early[name]

    def run(self, file: str, *args: str, domain: int) -> Run:
        """Start a run of a handed-in program that must end on its own."""
        return Run(file, lambda: self.start(file, *args, domain=domain), self.clock, self.late)

    def start(
        self, file: str, *args: str, domain: int, files: Mapping[str, bytes] | None = None, afresh: bool = False
    ) -> Program:
        """Start one of the handed-in programs in that domain, with the grader's `files` beside it.

        Programs may start with ROS 2 preloaded.  Use `afresh` to test which modules a program has or can import.
        """
        program = self.sandbox.start(file, *args, domain=domain, files=files, afresh=afresh)
        program.hidden = self._hidden
        self.hide(*(float(arg) for arg in args if NUMBER.fullmatch(arg)))
        return program

    def hide(self, *values: float | str) -> None:
        """Hide these inputs in the text that tells a student how their program ended."""
        self._hidden.update(value for value in values if value not in COMMON)

    def logs(self) -> dict[str, str]:
        """Return each file's output, as its student may read it, from the run that raised or else printed most."""
        told = {}
        for name in self.files:
            runs = [program for program in self.sandbox.programs if program.name == name and program.output.strip()]
            if runs:
                chosen = max(runs, key=lambda program: (program.raised, len(program.output)))
                told[name] = self.shown(name, chosen.output)
        return told

    def shown(self, name: str, output: str) -> str:
        """Return the output of a program of the file `name`, as its student may read it."""
        return excerpt(output, self.files[name].decode(errors="replace"), self._hidden)

    def close(self) -> None:
        """End all programs and leave all domains."""
        self.sandbox.close()
        for node in self._nodes:
            node.close()
