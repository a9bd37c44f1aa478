"""One run of a student's program that must end on its own, such as a client, and checks for every client."""

import random
import re
import time
from collections.abc import Callable, Iterable, Sequence

from autograder.errors import Crashed, TimedOut, Wrong
from autograder.sandbox.cleaning import NUMBER
from autograder.sandbox.program import Program
from autograder.suitekit.clock import Clock
from autograder.suitekit.hints import is_of_text, last_words
from course.foundation.waiting import wait_until

LIMIT = 10.0  # s that a client may run, with or without a server
MOST = 0.95  # of the time that a client must wait for an answer, which may begin before its request is on its way
GRACE = 3.0  # s more for a program to load on a busy machine
UNCAUGHT = 1  # the exit status of a program that an exception ends
SIGNALLED = 128  # exit statuses from here on may mean a signal, and not the program's own exit
CAUSES = {  # what may be behind a signal that the program's text does not name
    "SIGABRT": " A possible cause is a thread that still spins when main ends: stop its executor, or shut rclpy down, "
    "and join the thread first."
}
RANGE = re.compile(r"\{(-?\d+)\.\.(-?\d+)\}")
LETTER = re.compile(r"[^\W\d_]")
CHOICE = re.compile(r"\{([^{}|]+(?:\|[^{}|]+)+)\}")


def drawn(command: Sequence[str], rng: random.Random) -> list[str]:
    """Return a command line with each `{2..9}` replaced by an integer of that range, each `{add|divide}` by a word."""

    def draw(word: str) -> str:
        if found := RANGE.fullmatch(word):
            return str(rng.randint(int(found[1]), int(found[2])))
        if found := CHOICE.fullmatch(word):
            return rng.choice(found[1].split("|"))
        return word

    return [draw(word) for word in command]


class Run:
    """One run of a handed-in program that must end on its own, as `python FILE ARGS`; started by `bench.run`."""

    def __init__(self, file: str, start: Callable[[], Program], clock: Clock, late: set[str] | None = None):
        """Start the program by `start`, which `again` calls once more.

        `late` has the files of which another run was late twice: theirs are not run a second time for being late.
        """
        self.file, self._start, self._clock = file, start, clock
        self._late_files = set() if late is None else late
        self._program = start()
        self.starts = 1
        self._late: TimedOut | None = None  # the fault after waiting for its end twice

    @property
    def output(self) -> str:
        """Return the program's output so far."""
        return self._program.output

    @property
    def raised(self) -> bool:
        """Return True if it died of a Python exception, which it has printed."""
        return self._program.raised

    def again(self) -> None:
        """Run it once more, because something it needed may have been late."""
        self._program.kill()
        self._restart()

    def until(self, condition: Callable[[], bool], limit: float = LIMIT) -> bool:
        """Wait until `condition()` is true or the program has ended, at most `limit` s from its start."""
        program = self._program
        left = program.started + self._clock.allow(limit + GRACE) - time.monotonic()
        wait_until(lambda: condition() or not program.alive, max(0.05, left))
        if not program.alive:
            program.wait(1.0)  # until its last output is read
        return condition()

    def finish(self, doing: str, limit: float = LIMIT) -> Program:
        """Return the program once it has ended; run it a second time if the machine may have slowed the first.

        `doing` describes the run to the student: "without a server".  Raises TimedOut if it took longer than `limit` s
        twice, and Crashed if it raised or was stopped.
        """
        program = self._ended(doing, limit)
        if program.raised:
            # An exception that ends a program makes its exit status 1: with another one it was caught and printed.
            how = "died" if program.exit_status == UNCAUGHT else "printed a traceback"
            died = f"{self.file}, run {doing}, {how}: {last_words(program)}."
            raise Crashed(died, certain=is_of_text(program))
        return program

    def status(self, doing: str, limit: float = LIMIT) -> int:
        """Return its exit status, even if it raised; raises TimedOut or Crashed if it was late, stopped or killed.

        A program that a signal ends has no exit status of its own.
        """
        program = self._ended(doing, limit)
        _expect_own_end(self.file, program, doing)
        return program.exit_status or 0

    def _ended(self, doing: str, limit: float) -> Program:
        if self._late:
            raise self._late
        for last in (False, True):
            program, allowed = self._program, self._clock.allow(limit + GRACE)
            ended = program.wait(max(0.05, program.started + allowed - time.monotonic()))
            in_time = ended and program.duration <= allowed
            own_end = program.raised or (program.exit_status or 0) < SIGNALLED
            if program.stopped or (in_time and own_end) or last or (not in_time and self.file in self._late_files):
                break
            program.kill()
            self._restart()
        if not ended:
            program.kill()
        if program.stopped:
            raise Crashed(f"{self.file}, run {doing}, was stopped: {program.last_words()}.")
        if not in_time:
            self._late = TimedOut(
                f"{self.file}, run {doing}, was still running after {limit:.0f} s. It must exit on its own: print why, "
                "and exit."
            )
            self._late_files.add(self.file)
            raise self._late
        return program

    def _restart(self) -> None:
        self._program = self._start()
        self.starts += 1


def expect_gives_up(run: Run, server: str, least: float = 0.0, beside: str = "") -> None:
    """Check that a client without a server waits for one, says that there is none, and exits with an error.

    `server` is its name for the student, `least` how long the client must wait (s), and `beside` its output in other
    cases.
    """
    doing = "without a server"
    expect_status(run, doing, 1)
    expect_words(run, doing, f"say that it found no server for {server}", beside=beside)
    expect_patience(run, doing, least)


def expect_usage(run: Run, doing: str) -> None:
    """Check that a client called wrongly (`doing`: "with too few arguments") prints its usage and fails."""
    expect_status(run, doing, 2)
    expect_words(run, doing, "print how to use it")


def expect_status(run: Run, doing: str, status: int) -> None:
    """Check that the run ends with an exit status other than 0; the student is advised to use `status`."""
    program = run.finish(doing)
    _expect_own_end(run.file, program, doing)
    if program.exit_status == 0:
        raise Wrong(
            f"{_capital(doing)}, the client must end with an exit status other than 0: sys.exit({status}).",
            program.output,
        )


def expect_patience(run: Run, doing: str, least: float) -> None:
    """Check that the client, which finds no server, has waited for one for `least` s or longer."""
    if (took := run.finish(doing).duration) < least:
        raise Wrong(
            f"{_capital(doing)}, the client gave up {took:.1f} s after its start. ROS 2 needs a moment to find a "
            f"server: the client must wait for it for {least:.0f} s at least."
        )


def expect_patience_when_asked(run: Run, doing: str, asked: Iterable[float], least: float) -> None:
    """Check that the client, which gets no answer, has waited for one for about `least` s or longer.

    `asked` has the times of all requests (time.monotonic, s), by the clock of who sent them.
    """
    program = run.finish(doing)
    own = [when for when in asked if when >= program.started]
    if own and (took := program.started + program.duration - min(own)) < MOST * least:
        raise Wrong(
            f"{_capital(doing)}, the client gave up {took:.1f} s after its request: it must wait for the answer for "
            f"{least:.0f} s at least."
        )


def expect_words(
    run: Run, doing: str, must: str, *, beside: str = "", unlike: str = "", ignoring: Iterable[str] = ()
) -> None:
    """Check that the run prints something, whatever its exit status.

    The output must have a line that is not in `beside` (its output in other cases), and must differ from `unlike` (its
    output in another case).  Numbers, and the words in `ignoring`, are not compared.
    """
    program = run.finish(doing)
    said, beside_it, unlike_it = (plain_lines(text, ignoring) for text in (program.output, beside, unlike))
    if not said:
        _expect_own_end(run.file, program, doing)  # who has said it may be ended by a signal: the exit status tells
        raise Wrong(f"{_capital(doing)}, the client must {must}; it printed nothing.")
    if not LETTER.search(program.output):
        raise Wrong(f"{_capital(doing)}, the client must {must}; it printed no word.", said)
    if said <= beside_it:
        raise Wrong(
            f"{_capital(doing)}, the client must {must}; it only printed what it prints in other cases, too.", said
        )
    if said == unlike_it:
        raise Wrong(
            f"{_capital(doing)}, the client must {must}; it printed the same as when something else is wrong.", said
        )


def plain_lines(text: str, ignoring: Iterable[str] = ()) -> set[str]:
    """Return the lines of a program's output with `#` for each number and for the words in `ignoring`."""
    words = re.compile("|".join(map(re.escape, ignoring)) or "(?!)")  # or match nothing
    plain = NUMBER.sub("#", words.sub("#", text))
    return {" ".join(line.split()) for line in plain.splitlines() if line.strip()}


def _expect_own_end(file: str, program: Program, doing: str) -> None:
    if not program.raised and (ended_by := program.signal):
        raise Crashed(
            f"{file}, run {doing}, was ended by the signal {ended_by}, and not by its own end: return from main, or "
            f"call sys.exit, when everything is said.{CAUSES.get(ended_by, '')}"
        )


def _capital(doing: str) -> str:
    return doing[0].upper() + doing[1:]
