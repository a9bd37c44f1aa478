"""A student's program that must end on its own, such as a client: one run of it, and what every client must do."""

import time
from collections.abc import Callable

from autograder.errors import Crashed, TimedOut, Wrong
from autograder.sandbox.program import Program
from autograder.suitekit.clock import Clock

LIMIT = 10.0  # s that a client may run, with or without a server
GRACE = 3.0  # s more for a program to load on a busy machine
SIGNALLED = 128  # exit statuses from here on tell of a signal, not of the program's own end


class Run:
    """One run of a handed-in program that must end on its own, as `python FILE ARGS`; `bench.run` begins it."""

    def __init__(self, file: str, start: Callable[[], Program], clock: Clock):
        """`start` starts the program anew."""
        self.file, self._start, self._clock = file, start, clock
        self._program = start()

    @property
    def output(self) -> str:
        """What the program has printed so far."""
        return self._program.output

    def finish(self, doing: str, limit: float = LIMIT) -> Program:
        """The program, once it has ended; it is run a second time when the first may have been the machine's fault.

        `doing` tells the student which run this was: "without a server".  Raises TimedOut when it took longer than
        `limit` s twice, and Crashed when it raised or was stopped.
        """
        for last in (False, True):
            program, allowed = self._program, self._clock.allow(limit + GRACE)
            ended = program.wait(max(0.05, program.started + allowed - time.monotonic()))
            in_time = ended and program.duration <= allowed
            own_end = program.raised or (program.exit_status or 0) < SIGNALLED
            if program.stopped or (in_time and own_end) or last:
                break
            program.kill()
            self._program = self._start()
        if not ended:
            program.kill()
        if program.stopped:
            raise Crashed(f"{self.file}, run {doing}, was stopped: {program.last_words()}.")
        if not in_time:
            raise TimedOut(
                f"{self.file}, run {doing}, was still running after {limit:.0f} s. It must exit on its own: print why, "
                "and exit."
            )
        if program.raised:
            raise Crashed(f"{self.file}, run {doing}, died: {program.last_words()}.")
        return program


def expect_gives_up(run: Run, server: str) -> None:
    """A client that finds no server says so and exits with an error; `server` tells the student which one it lacks."""
    _expect_error(run, "without a server", 1, f"say that it found no server for {server}")


def expect_usage(run: Run, doing: str) -> None:
    """A client that is called wrongly (`doing`: "with too few arguments") prints its usage and exits with an error."""
    _expect_error(run, doing, 2, "print how to use it")


def _expect_error(run: Run, doing: str, status: int, word: str) -> None:
    program = run.finish(doing)
    when = doing[0].upper() + doing[1:]
    if program.exit_status == 0:
        raise Wrong(
            f"{when}, the client must end with an exit status other than 0: sys.exit({status}).", program.output
        )
    if not program.output.strip():
        raise Wrong(f"{when}, the client must {word}; it printed nothing.")
