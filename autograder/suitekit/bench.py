"""One submission being graded: its programs, its ROS domains, its clock."""

import contextlib
import random
import time
from collections.abc import Mapping

from autograder.errors import Crashed, TimedOut
from autograder.sandbox.box import Sandbox
from autograder.sandbox.cleaning import NUMBER, excerpt
from autograder.sandbox.networks import Networks
from autograder.sandbox.program import Program
from autograder.suitekit.clock import Clock
from autograder.suitekit.ros import Ros

GRACE = 3.0  # s more for a program to load on a busy machine, when the task sets a limit
DOMAINS = range(1, 100)
COMMON = {"", 0.0, 1.0, 2.0, 3.0}  # not worth hiding


class Bench:
    """One submission being graded: its files, the sandbox, the clock."""

    def __init__(self, files: dict[str, bytes], sandbox: Sandbox, clock: Clock, seed: int):
        self.files = files
        self.sandbox = sandbox
        self.clock = clock
        self.seed = seed
        self._nodes: list = []
        self._domains = list(DOMAINS)
        random.shuffle(self._domains)  # by no seed: in --unsafe mode, gradings at the same time must not meet
        self._networks = Networks() if sandbox.box != "unsafe" else None
        self.early: dict[str, Run] = {}
        self._hidden: set = set()

    def random(self, name: str) -> random.Random:
        """Random numbers of the grading's seed for one purpose, whatever else was drawn before."""
        return random.Random(f"{self.seed} {name}")

    def new_domain(self) -> int:
        """A ROS domain that nobody has used in this grading, so that nothing said before can be heard in it."""
        if not self._domains:
            raise TimedOut("Not tried: your programs had to be started again too often.")
        return self._domains.pop()

    def enter(self, domain: int, threads: int = 1):
        """A node of the grader's in that domain, a `ros.Ros`, whose callbacks run in so many threads."""
        with self._network(domain):
            self._nodes.append(Ros(domain, threads))
        return self._nodes[-1]

    def _network(self, domain: int):
        return self._networks.inside(domain) if self._networks else contextlib.nullcontext()

    def begin(self, runs: dict[str, list[str]]) -> None:
        """Start the `early` runs, by name, each in a domain with nobody else in it."""
        for name, command in runs.items():
            self.early[name] = Run(self, *command, domain=self.new_domain())

    def start(self, file: str, *args: str, domain: int, files: Mapping[str, bytes] | None = None) -> Program:
        """Start one of the handed-in programs in that domain, with `files` of the grader's beside it."""
        with self._network(domain):
            program = self.sandbox.start(file, *args, domain=domain, files=files)
        program.hidden = self._hidden
        self.hide(*(float(arg) for arg in args if NUMBER.fullmatch(arg)))
        return program

    def hide(self, *values: float | str) -> None:
        """Keep these hidden inputs out of what a student is told of their program's end."""
        self._hidden.update(value for value in values if value not in COMMON)

    def logs(self) -> dict[str, str]:
        """What each file printed, as its student may read it: in the run that raised, or that said most."""
        told = {}
        for name, content in self.files.items():
            runs = [program for program in self.sandbox.programs if program.name == name and program.output.strip()]
            if runs:
                chosen = max(runs, key=lambda program: (program.raised, len(program.output)))
                told[name] = excerpt(chosen.output, content.decode(errors="replace"), self._hidden)
        return told

    def close(self) -> None:
        """End all programs and leave all domains."""
        self.sandbox.close()
        for node in self._nodes:
            node.close()


class Run:
    """One run of a handed-in program that must end by itself, as `python FILE ARGS`."""

    def __init__(self, bench: Bench, file: str, *args: str, domain: int):
        self.file, self.bench = file, bench
        self._start = lambda: bench.start(file, *args, domain=domain)
        self.program = self._start()

    def finish(self, limit: float, doing: str) -> Program:
        """The program, once it has ended; raises TimedOut when it took longer than `limit` s, twice."""
        for last in (False, True):
            program, allowed = self.program, self.bench.clock.allow(limit + GRACE)
            ended = program.wait(max(0.05, program.started + allowed - time.monotonic()))
            in_time = ended and program.duration <= allowed
            if program.stopped or in_time and (program.raised or program.exit_status < 128) or last:
                break
            program.kill()
            self.program = self._start()
        if not ended:
            program.kill("")
        if program.stopped:
            raise Crashed(f"{self.file} {doing} was stopped: {program.last_words()}.")
        if not in_time:
            raise TimedOut(
                f"{self.file} {doing} had not ended after {limit:.0f} s: it must end by itself, or give up and say so."
            )
        return program
