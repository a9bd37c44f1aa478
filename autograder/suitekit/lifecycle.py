"""The life of a handed-in program that runs until the grader ends it, as a state machine that knows no ROS.

A program that has died is started again for the next question, so that each test judges only what it is about.  A
program is blamed only for what happens repeatedly, or what it admits itself with a traceback.

```mermaid
stateDiagram-v2
    [*] --> DOWN
    DOWN --> STARTING: begin()
    STARTING --> SERVING: it offers what is wanted
    STARTING --> DOWN: it died, or shows no node in time; a second try, then a fault for what was wanted
    DOWN --> DOWN: what has shown no node twice is not started again; in another world it has one short try
    SERVING --> SERVING: it answers, or offers more of what is wanted
    STARTING --> DOWN: it shows a node that offers nothing; a second try
    SERVING --> DOWN: it does not offer the rest in time, as above
    SERVING --> DOWN: it died while it was asked; asked once more, unless it raised or was stopped
    DOWN --> DOWN: what it has never answered, but often with silence or the same exception, is not asked again
    SERVING --> DOWN: it was silent, and is killed; asked once more, unless it was silent often
    SERVING --> DOWN: it ended between two questions, which costs a spare life
    SERVING --> SERVING: it answered, but only on the second start: that costs a spare life too
    SERVING --> DOWN: end() by the grader
    SERVING --> HOPELESS: no spare life is left
    SERVING --> HOPELESS: it was silent once too often, and has never answered
    HOPELESS --> [*]: every further question gets the same fault
```

A running program that offers something, but not what is wanted, stays as it is: it can still be asked for the rest.
"""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable
from enum import Enum, auto
from functools import partial
from typing import Protocol, TypeVar

from autograder.errors import Crashed, Fault, TimedOut, Wrong
from autograder.sandbox.machine_load import is_starved
from autograder.suitekit.hints import is_of_text, last_words

USED_UP = "Not tested: your programs were so slow in the tests before that the time was used up."
LEAST = 1.0  # s that a wait must have lasted to be reported
LONGER = 3  # times, on a starved machine
START = 20.0  # s that a program may take to offer what is wanted on the first try; half of it on the second
SETTLED = 6.0  # s, the same once it shows a node
ANSWER = 10.0  # s that an answer may take
SHORT = 3.0  # s, the same for a program that was silent PATIENCE times
PATIENCE = 2  # tolerated silences; after the next one the question is not asked again
SPARE_LIVES = 2  # times that a program may end between two questions
DYING = 0.2  # s in which a silent program may turn out to be dying
REAPED = 1.0  # s to wait until the output of a dead program is read
TOLD = 300  # characters shown of what a program offers instead
NOTHING_YET = (
    "The node has no topics and no services of its own. Does the program wait for something before it makes them?"
)
ANYTHING = "what the task asks for"  # where nothing is named that a program does not offer
GOES_ON = "it must run until it is stopped, so main() must spin the node, and no callback may end the program"

Answer = TypeVar("Answer")
Alive = Callable[[], bool]  # returns whether the program that was asked still runs
Question = Callable[[float, Alive], Answer | None]  # asks, waits at most that many s, and returns the answer or None


class Running(Protocol):
    """The interface of one start of a program; `sandbox.program.Program` is one."""

    stopped: str  # why the grader ended it; empty if it did not

    @property
    def alive(self) -> bool:
        """Return True if it still runs."""

    @property
    def age(self) -> float:
        """Return the time (s) since it was started."""

    @property
    def exit_status(self) -> int | None:
        """Return its exit status, or None while it runs."""

    @property
    def raised(self) -> bool:
        """Return True if it died of a Python exception, which it has printed."""

    @property
    def raised_by_itself(self) -> bool:
        """Return True if its exception was raised by its own code, outside of any callback."""

    def wait(self, timeout: float) -> bool:
        """Wait until it has ended; False when it still runs after `timeout` s."""

    def kill(self, why: str = "") -> None:
        """End it."""

    def last_words(self) -> str:
        """Return why it ended, in a line for the student."""


class State(Enum):
    """The state of a program between two questions."""

    DOWN = auto()  # not started yet, or ended and dealt with
    STARTING = auto()  # started, but not yet seen to offer what is wanted
    SERVING = auto()  # has offered what was wanted, and is being asked
    HOPELESS = auto()  # never started again


class Lifecycle(ABC):
    """A handed-in program that runs until the grader ends it: started, asked, started again, given up."""

    advice = "no callback may wait for long"  # for the student whose program is silent
    program: Running  # the latest start

    def __init__(self, file: str):
        self.file = file
        self.state = State.DOWN
        self.starts = 0
        self.ends = 0  # how often it has ended by itself after it had offered what was wanted
        self.fresh = True  # set to False after a message to this start that changes its behaviour
        self._offered: set[tuple[str, ...]] = set()  # what this start has offered of what was wanted
        self._missed: dict[tuple[str, ...], Fault] = {}  # what the program failed to offer twice
        self._given_up: Fault | None = None  # why it is HOPELESS
        self._shown = False  # whether any of its starts has shown a node
        self._without_node = 0.0  # s that it was waited for a node, twice, and none has ever come
        self._answered: set[str] = set()  # the kinds of questions that it has answered, as the student is told them
        self._deaths: Counter[tuple[str, str]] = Counter()  # by the kind of question, and the exception
        self._silent: Counter[str] = Counter()  # by the kind of question
        self._in_vain: dict[str, Fault] = {}  # the kinds of questions of which it dies, or that it never answers
        self._silences = 0
        self._lives = SPARE_LIVES

    @property
    def ever_answered(self) -> bool:
        """Return True if any of its starts has answered a question."""
        return bool(self._answered)

    @property
    def has_ended(self) -> bool:
        """Return True if the latest start has ended by itself, and nobody has asked it since."""
        return self.state in (State.STARTING, State.SERVING) and not self.program.alive

    @abstractmethod
    def launch(self) -> Running:
        """Start the program in a domain without earlier messages."""

    @abstractmethod
    def missing(self, wanted: tuple[str, ...]) -> list[str]:
        """Return the parts of `wanted`, by default of everything required, that the program does not offer."""

    @abstractmethod
    def has_node(self) -> bool:
        """Return True if the program shows any node."""

    @abstractmethod
    def other_services(self) -> list[str]:
        """The services that the program's nodes offer, beyond those that every node has."""

    def mistyped(self, wanted: tuple[str, ...]) -> str:
        """Return a sentence on what is `wanted` but offered with another type; empty if there is nothing."""
        return ""

    def why_silent(self) -> str:
        """Return a sentence for the student on what its text has that may be why it gives no answer; or nothing."""
        return ""

    def other_topics(self) -> str:
        """Return a sentence for the student on the topics of the program's nodes; empty if there are none."""
        return ""

    @property
    def tries(self) -> tuple[float, ...]:
        """Return the times (s) that the program has to offer what is wanted, one for each of its starts, if any.

        They are longer on a starved machine, where loading ROS 2 and finding a node take long.
        """
        first = START * (LONGER if is_starved() else 1)
        return first, first / 2

    @abstractmethod
    def shows_a_node(self) -> None:
        """Note that the program has shown a node."""

    @abstractmethod
    def never_shows_a_node(self) -> None:
        """Note that the program has shown no node in all of its tries."""

    @abstractmethod
    def allow(self, seconds: float) -> float:
        """Return the time limit (s) for a wait that should take less than `seconds`."""

    @abstractmethod
    def wait_until(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Wait until `condition()` is true, at most `timeout` s; return its last value."""

    def begin(self) -> None:
        """Start the program, without waiting for it."""
        self.program = self.launch()
        self.state, self.fresh = State.STARTING, True
        self._offered.clear()
        self.starts += 1

    def end(self, why: str = "") -> None:
        """End the program without blaming it; `why` goes into its last words."""
        self.program.kill(why)
        self._is_down()

    def up(self, *wanted: str) -> None:
        """Ensure that the program runs and offers what is `wanted` (default: all); raises a Fault after two tries."""
        if self.state is State.SERVING and not self.program.alive:
            self.ends += 1
            self._is_down()
            self._lives -= 1
        if self._lives < 0 and self.state is not State.HOPELESS:
            self._give_up(self._too_many_ends())
        if known := self._missed.get(wanted) or self._given_up:
            raise known
        if self.state is State.SERVING and wanted in self._offered:
            return
        if self._without_node or not self.tries:
            raise self._shows_no_node(" and ".join(wanted) or ANYTHING, self._without_node or START)
        waited = 0.0
        for limit in self.tries:
            if self.state is State.DOWN:
                self.begin()
            waited = max(waited, self.allow(limit))
            if self._comes_up(wanted, limit):
                self._offered.add(wanted)
                self.state = State.SERVING
                return
            fault = self._why_not_up(wanted, waited)
            seen = self.other_services() or self.other_topics()  # and not only a node, whose services may come late
            if isinstance(fault, Wrong) and (fault.certain or seen or self.starts > 1):
                break
            self.end()
        self._missed[wanted] = fault
        if isinstance(fault, TimedOut) and not self._shown and waited >= LEAST:
            self._without_node = waited
            self.never_shows_a_node()
        raise fault

    def ensure_fresh(self, *wanted: str) -> None:
        """Restart the program unless it is `fresh`; raises a Fault as `up` does."""
        if self.state is not State.DOWN and not self.fresh:
            self.end()
        self.up(*wanted)

    def converse(self, question: Question[Answer], what: str, *wanted: str) -> Answer:
        """Ask until `question(limit, alive)` returns an answer that is not None; raises Crashed or TimedOut.

        `what` names the question to the student ("a request to /sum"); `wanted` is what must be offered before.  What
        has never been answered, but PATIENCE times with silence or with the same exception, is asked only once more.
        """
        if what in self._in_vain:
            raise self._in_vain[what]
        died = False
        for _ in range(2):
            self.up(*wanted)
            limit = self.allow(ANSWER if self._silences < PATIENCE else SHORT)
            answer = question(limit, partial(_is_alive, self.program))
            if answer is not None:
                self._answered.add(what)
                if died:  # not because of this question, which it has now answered
                    self._lives -= 1
                return answer
            died = not self.program.alive or self.program.wait(DYING)
            self.ends += died
            fault, again = self._on_death(what) if died else self._on_silence(what, limit)
            if not again:
                break
        raise fault

    def expect_to_run_on(self, seconds: float, *wanted: str) -> None:
        """Raise Wrong if it ends by itself within so many s of a start, and of the next one, too; a Fault as `up` does.

        That it does so once may be the machine's fault.  Until that time nothing is asked.
        """
        for _ in range(2):
            if not self.has_ended:
                self.up(*wanted)
                self.wait_until(lambda: self.has_ended, self.allow(seconds - self.program.age))
            if not self.has_ended:
                return
            self._is_down()
        raise self.ended(f"within {seconds:g} s of its start, unasked")

    def ended(self, when: str) -> Wrong:
        """Return the Wrong of a program that has ended by itself though it was not asked; `when` tells the student."""
        self.program.wait(REAPED)
        return Wrong(f"{self.file} ended by itself {when} ({last_words(self.program)}): {GOES_ON}.")

    def doubt(self, other: "Lifecycle") -> None:
        """Be as patient as with a program that was silent, if `other`, the same one asked otherwise, never answers."""
        given_up = other.state is State.HOPELESS and not other.ever_answered
        if given_up or any(isinstance(fault, TimedOut) for fault in other._in_vain.values()):
            self._silences = max(self._silences, PATIENCE)

    def _comes_up(self, wanted: tuple[str, ...], limit: float) -> bool:
        """Return True if the started program offers what is wanted within `limit` s, or soon after it shows a node."""

        def decided() -> bool:
            return not self.missing(wanted) or not self.program.alive

        if self.wait_until(lambda: decided() or self.has_node(), self.allow(limit)):
            if self.has_node():
                self._shown = True
                self.shows_a_node()
            self.wait_until(decided, self.allow(SETTLED))
        return self.program.alive and not self.missing(wanted)

    def _why_not_up(self, wanted: tuple[str, ...], waited: float) -> Fault:
        promise = " and ".join(self.missing(wanted) or wanted) or ANYTHING
        if not self.program.alive:
            self.program.wait(REAPED)
            if self.program.exit_status == 0:
                return Crashed(
                    f"{self.file} ended by itself right after its start: main() must spin the node, and be called at "
                    "the end of the file."
                )
            died = f"{self.file} did not start: {last_words(self.program)}."
            return Crashed(died, certain=is_of_text(self.program))
        if told := self.mistyped(wanted):
            return Wrong(told, certain=True)
        if services := self.other_services():
            return Wrong(f"{self.file} runs, but does not offer {promise}. It offers: {', '.join(services)[:TOLD]}.")
        if self.has_node():
            return Wrong(
                f"{self.file} runs a node, but it does not offer {promise}. " + (self.other_topics() or NOTHING_YET)
            )
        if waited < LEAST:
            return TimedOut(USED_UP)
        return self._shows_no_node(promise, waited)

    def _shows_no_node(self, promise: str, waited: float) -> Fault:
        return TimedOut(
            f"{self.file} was started, but within {waited:.0f} s no node appeared, and it never offered "
            f"{promise}: does the program wait for something before it creates its node?"
        )

    def _on_silence(self, what: str, limit: float) -> tuple[Fault, bool]:
        """Return the fault of a program that runs but gives no answer, and whether to ask once more."""
        self.end()
        self._silences += 1
        told = f"{self.file} runs, but {what} got no answer within {limit:.0f} s: {self.advice}."
        fault = TimedOut(f"{told} {self.why_silent()}".rstrip())
        self._silent[what] += 1
        if self._silences > PATIENCE and not self._answered:
            self._give_up(fault)
        elif self._silent[what] > PATIENCE and what not in self._answered:
            self._in_vain[what] = fault
        return fault, self._silences <= PATIENCE

    def _on_death(self, what: str) -> tuple[Fault, bool]:
        """Return the fault of a program that ended when it was asked, and whether to ask once more."""
        program = self.program
        program.wait(REAPED)
        self._is_down()
        if program.exit_status == 0 and not program.stopped:
            fault = Crashed(f"{self.file} ended by itself when it got {what}: {GOES_ON}.")
        else:
            when, words = "ended before" if program.raised_by_itself else "died while", last_words(program)
            fault = Crashed(f"{self.file} {when} it answered {what}: {words}.")
            self._deaths[what, words] += program.raised
            if self._deaths[what, words] > PATIENCE and what not in self._answered:
                self._in_vain[what] = fault
        return fault, not (program.raised or program.stopped)

    def _too_many_ends(self) -> Fault:
        """Return the fault of a program that has ended too often between two questions."""
        self.program.wait(REAPED)
        how = "" if self.program.alive else f" ({last_words(self.program)})"
        return Crashed(f"{self.file} answered, but ended by itself afterwards, again and again{how}: {GOES_ON}.")

    def _is_down(self) -> None:
        if self.state is not State.HOPELESS:
            self.state = State.DOWN

    def _give_up(self, fault: Fault) -> None:
        self.state, self._given_up = State.HOPELESS, fault


def _is_alive(program: Running) -> bool:
    return program.alive
