"""The life of a handed-in program: each transition of its state machine, with fake programs, a fake clock, no ROS."""

import pytest

from autograder.errors import Crashed, TimedOut, Wrong
from autograder.suitekit import lifecycle
from autograder.suitekit.lifecycle import ANSWER, PATIENCE, SETTLED, SHORT, SPARE_LIVES, START, Lifecycle, State

STEP = 0.5  # s of the fake clock between two looks
SUM, STATUS = "the service /sum", "the service /status"


class Clock:
    now = 0.0


class Program:
    """One start of a fake program: it offers things, dies and answers at the times that it is given.

    `ends_at` and the times in `offers` are s after its start; `answers` says what happens to each question in turn:
    the answer itself, None for silence, or an exit status that it ends with instead.
    """

    def __init__(self, clock, offers=None, node_at=0.5, ends_at=None, status=1, answers=(), raised=False, stopped=""):
        self._clock, self._start = clock, clock.now
        self._offers, self._node_at, self._answers = offers or {}, node_at, list(answers)
        self._ends_at, self._status, self._raises, self._stops = ends_at, status, raised, stopped
        self.stopped, self.killed, self.talk = "", False, "exit status 1"

    @property
    def age(self):
        return self._clock.now - self._start

    @property
    def alive(self):
        alive = not self.killed and (self._ends_at is None or self.age < self._ends_at)
        if not alive and not self.killed:
            self.stopped = self._stops
        return alive

    @property
    def exit_status(self):
        return None if self.alive else self._status

    @property
    def raised(self):
        return not self.alive and not self.killed and self._raises

    @property
    def raised_by_itself(self):
        return self.raised and "spin()" in self.talk

    def wait(self, timeout):
        return not self.alive

    def kill(self, why=""):
        if self.alive:
            self.killed, self.stopped = True, why

    def last_words(self):
        return self.stopped or self.talk

    def dies(self, status):
        self._ends_at, self._status = self.age, status

    def offers(self, what):
        return self.alive and self.age >= self._offers.get(what, float("inf"))

    def has_node(self):
        return self.alive and self.age >= self._node_at

    def answer(self, limit):
        """Return the answer to a question, after the time that it takes."""
        event = self._answers.pop(0) if self._answers else "yes"
        if event is None:
            self._clock.now += limit
        elif isinstance(event, int):
            self.dies(event)
            return None
        return event


def serves(**more):
    """Return the behaviour of a program that offers all it must."""
    return {"offers": {SUM: 1.0, STATUS: 1.0}, **more}


class Fake(Lifecycle):
    """A life in which the first start behaves as the first of `plans`, and so on; the last plan holds on."""

    def __init__(self, *plans):
        super().__init__("sum.py")
        self.clock, self.plans, self.launched, self.limits = Clock(), [*plans], [], []
        self.nodeless = 0

    def launch(self):
        plan = self.plans.pop(0) if len(self.plans) > 1 else self.plans[0]
        self.launched.append(Program(self.clock, **plan))
        return self.launched[-1]

    def missing(self, wanted):
        return [offer for offer in wanted or (SUM, STATUS) if not self.program.offers(offer)]

    def has_node(self):
        return self.program.has_node()

    def shows_a_node(self):
        self.with_node = True

    def never_shows_a_node(self):
        self.nodeless += 1

    def other_services(self):
        return [f"{name} (a type)" for name in ("/other",) if self.program.offers(name)]

    def mistyped(self, wanted):
        return f"{wanted[0]} has another type." if self.program.offers("/mistyped") else ""

    def other_topics(self):
        return "It publishes /number (std_msgs/Float64)." if self.program.offers("/number") else ""

    def allow(self, seconds):
        return seconds

    def wait_until(self, condition, timeout):
        end = self.clock.now + timeout
        while not condition() and self.clock.now < end:
            self.clock.now += STEP
        return condition()

    def ask(self, *wanted, what="a request to /sum"):
        """One question; what came of it."""

        def question(limit, alive):
            self.limits.append(limit)
            assert alive()
            return self.program.answer(limit)

        return self.converse(question, what, *wanted)


def test_a_good_program():
    life = Fake(serves())
    assert (life.state, life.starts) == (State.DOWN, 0)
    life.begin()
    assert (life.state, life.starts) == (State.STARTING, 1)
    life.up()
    assert life.state is State.SERVING
    assert [life.ask(), life.ask(SUM), life.ask(STATUS)] == ["yes"] * 3
    assert (life.state, life.starts, life.clock.now) == (State.SERVING, 1, 1.0)


@pytest.mark.parametrize("waited", [0, 10])
def test_a_program_that_runs_on(waited):
    life = Fake(serves())
    life.begin()
    life.clock.now += waited
    life.expect_to_run_on(5)
    assert (life.state, life.starts, life.clock.now) == (State.SERVING, 1, max(5, waited))


@pytest.mark.parametrize("waited", [0, 10])
def test_a_program_that_ends_unasked_within_some_seconds_twice(waited):
    life = Fake(serves(ends_at=4.0))
    life.begin()
    life.clock.now += waited  # a first end that nobody has seen counts, too
    with pytest.raises(
        Wrong, match="^sum.py ended by itself within 5 s of its start, unasked .exit status 1.: it must"
    ):
        life.expect_to_run_on(5)
    assert (life.state, life.starts) == (State.DOWN, 2)


def test_a_program_that_ends_unasked_once():
    life = Fake(serves(ends_at=4.0), serves())
    life.expect_to_run_on(5)
    assert (life.state, life.starts) == (State.SERVING, 2)


def test_a_program_that_does_not_start_is_not_told_to_have_ended_unasked():
    life = Fake({"ends_at": 0.5})
    life.begin()
    life.clock.now += 1
    with pytest.raises(Crashed, match="^sum.py did not start: exit status 1.$"):
        life.expect_to_run_on(5)


def test_up_starts_what_is_down():
    life = Fake(serves())
    life.up(SUM)
    assert (life.state, life.starts) == (State.SERVING, 1)


def test_dies_at_the_start_twice():
    life = Fake({"ends_at": 2.0})
    with pytest.raises(Crashed, match="^sum.py did not start: exit status 1.$") as first:
        life.up()
    assert (life.state, life.starts) == (State.DOWN, 2)
    with pytest.raises(Crashed) as again:
        life.up()
    assert (again.value, life.starts) == (first.value, 2)  # not tried a third time


def test_ends_at_the_start():
    life = Fake({"ends_at": 0.0, "status": 0})
    with pytest.raises(Crashed, match="sum.py ended by itself right after its start: main\\(\\) must spin the node"):
        life.up()


def test_the_second_start_may_succeed():
    life = Fake({"ends_at": 2.0}, serves())
    life.begin()
    life.clock.now = 5.0  # it has died before anybody waits for it: that is the first try
    life.up()
    assert (life.state, life.starts) == (State.SERVING, 2)
    assert life.ask() == "yes"


def test_no_node_in_time():
    life = Fake({"node_at": 1e9})
    with pytest.raises(
        TimedOut, match=r"no node appeared, and it never offered the service /sum and the service /status:"
    ):
        life.up()
    assert life.clock.now == START + START / 2
    assert (life.state, life.starts, life.launched[-1].killed) == (State.DOWN, 2, True)


def test_what_never_shows_a_node_is_not_started_again_for_something_else():
    life = Fake({"node_at": 1e9})
    for wanted in (SUM, STATUS, SUM):
        with pytest.raises(TimedOut, match=rf"within 20 s no node appeared, and it never offered {wanted}:"):
            life.up(wanted)
    assert (life.starts, life.nodeless, life.clock.now) == (2, 1, START + START / 2)


def test_what_has_shown_a_node_once_is_started_again_for_something_else():
    life = Fake({"ends_at": 5.0}, {"node_at": 1e9}, serves())
    with pytest.raises(TimedOut):
        life.up(SUM)
    life.up(STATUS)
    assert life.starts == 3


def test_time_that_is_used_up_is_no_wait_of_no_seconds(monkeypatch):
    life = Fake({"node_at": 1e9})
    monkeypatch.setattr(life, "allow", lambda seconds: 0.05)
    with pytest.raises(TimedOut, match="^Not tested: your programs were so slow"):
        life.up()


def test_a_slow_offer_is_waited_for():
    life = Fake({"offers": {SUM: SETTLED - 1.0, STATUS: SETTLED - 1.0}})
    life.up()
    assert life.starts == 1


def test_a_node_without_the_offer():
    life = Fake({"offers": {STATUS: 1.0, "/other": 1.0}})
    with pytest.raises(Wrong, match="^sum.py runs, but does not offer the service /sum. It offers: /other"):
        life.up(SUM)
    assert life.clock.now == 0.5 + SETTLED  # not as long as for the node
    assert (life.state, life.starts, life.program.alive) == (State.STARTING, 1, True)
    assert life.ask(STATUS) == "yes"  # of the rest it can still be asked
    assert (life.state, life.starts) == (State.SERVING, 1)
    with pytest.raises(Wrong, match="does not offer the service /sum"):
        life.ask(SUM)
    assert life.clock.now == 0.5 + SETTLED  # known: not waited for again


def test_a_node_that_offers_nothing_is_started_once_more():
    """On a busy machine, what a node offers may be discovered long after its name, or never."""
    life = Fake({"offers": {}}, {"offers": {SUM: 1.0}})
    assert life.ask(SUM) == "yes" and life.starts == 2
    life = Fake({"offers": {}})
    with pytest.raises(
        Wrong, match="^sum.py runs a node, but it does not offer the service /sum. The node has no .* Does "
    ):
        life.up(SUM)
    assert (life.state, life.starts, life.program.alive) == (State.STARTING, 2, True)
    with pytest.raises(Wrong, match="does not offer the service /sum"):
        life.ask(SUM)
    assert life.starts == 2  # known


def test_other_topics_are_told():
    life = Fake({"node_at": 0.5, "offers": {"/number": 0.5}})
    with pytest.raises(Wrong, match=r"the service /sum. It publishes /number \(std_msgs/Float64\).$"):
        life.ask(SUM)


def test_something_else_is_offered():
    life = Fake({"offers": {"/other": 0.0}})
    with pytest.raises(Wrong, match="runs, but does not offer the service /sum. It offers: /other \\(a type\\)."):
        life.up(SUM)


def test_another_type_is_told_before_what_else_is_offered():
    life = Fake({"offers": {"/other": 0.0, "/mistyped": 0.0}})
    with pytest.raises(Wrong, match="^the service /sum has another type.$"):
        life.up(SUM)


def test_dies_while_more_is_waited_for():
    life = Fake({"offers": {STATUS: 1.0}, "ends_at": 3.0}, serves())
    life.up(STATUS)
    life.up(SUM)
    assert (life.state, life.starts) == (State.SERVING, 2)


def test_what_was_offered_once_is_not_looked_at_again():
    life = Fake(serves())
    life.up(SUM)
    life.missing = None
    life.up(SUM)


def test_a_new_start_must_offer_anew():
    life = Fake(serves())
    life.up(SUM)
    life.end()
    before = life.clock.now
    life.up(SUM)
    assert (life.clock.now, life.starts) == (before + 1.0, 2)


def test_a_new_start_may_offer_less():
    life = Fake(serves(), {"offers": {STATUS: 1.0}})
    life.up(SUM)
    life.end()
    life.up(STATUS)
    with pytest.raises(Wrong, match="does not offer the service /sum"):
        life.up(SUM)


def test_died_while_it_answered_once():
    life = Fake(serves(answers=[1]), serves())
    assert life.ask() == "yes"
    assert (life.state, life.starts) == (State.SERVING, 2)


def test_died_while_it_answered_twice():
    life = Fake(serves(answers=[1]))
    with pytest.raises(Crashed, match="^sum.py died while it answered a request to /sum: exit status 1.$"):
        life.ask()
    assert (life.state, life.starts) == (State.DOWN, 2)
    life.plans = [serves()]
    assert life.ask() == "yes"  # the next test's question is tried on a new start


def test_ended_by_itself_when_asked():
    life = Fake(serves(answers=[0]))
    with pytest.raises(
        Crashed, match="sum.py ended by itself when it got a request to /sum: it must run until it is stopped, so main"
    ):
        life.ask()


def test_who_raised_is_not_asked_again():
    life = Fake(serves(answers=[1], raised=True))
    with pytest.raises(Crashed, match="died while it answered"):
        life.ask()
    assert (life.state, life.starts) == (State.DOWN, 1)


def test_who_was_stopped_is_not_asked_again():
    life = Fake(serves(answers=[0], stopped="it printed more than 64 MiB"))
    with pytest.raises(Crashed, match="died while it answered a request to /sum: it printed more than 64 MiB.$"):
        life.ask()
    assert life.starts == 1


@pytest.mark.parametrize(
    "words, told",
    [
        (
            "TypeError (sum.py, line 3)",
            r"died while it answered a request to /sum: TypeError \(sum.py, line 3\) \(a callback returned nothing.*$",
        ),
        (
            "TypeError: spin() missing 1 required positional argument: 'node' (sum.py, line 9)",
            r"ended before it answered a request to /sum: TypeError: spin\(\) missing .* \(sum.py, line 9\)\.$",
        ),
    ],
)
def test_an_end_by_an_exception_has_its_cause(words, told):
    life = Fake(serves(answers=[1], raised=True))
    launch = life.launch

    def saying():
        program = launch()
        program.talk = words
        return program

    life.launch = saying
    with pytest.raises(Crashed, match=told):
        life.ask()


def test_silent_once():
    life = Fake(serves(answers=[None]), serves())
    assert life.ask() == "yes"
    assert (life.starts, life.launched[0].killed, life.limits) == (2, True, [ANSWER, ANSWER])


def test_always_silent():
    life = Fake(serves(answers=[None] * 9))
    with pytest.raises(
        TimedOut, match="^sum.py runs, but a request to /sum got no answer within 10 s: no callback may"
    ):
        life.ask()
    assert (life.state, life.starts) == (State.DOWN, PATIENCE)
    with pytest.raises(TimedOut, match="within 3 s") as last:
        life.ask()
    assert (life.state, life.starts, life.limits[-1]) == (State.HOPELESS, PATIENCE + 1, SHORT)
    with pytest.raises(TimedOut) as again:
        life.ask(STATUS)  # for good, whatever it is asked
    assert (again.value, life.starts) == (last.value, PATIENCE + 1)


def test_often_silent_but_has_answered():
    life = Fake(serves(answers=["yes", None]), serves(answers=[None]), serves(answers=[None]), serves())
    assert life.ask() == "yes"
    for _ in range(2):
        with pytest.raises(TimedOut):
            life.ask()
    assert life.state is State.DOWN
    assert life.ask() == "yes"
    assert life.limits[-1] == SHORT


def test_ends_between_two_questions():
    life = Fake(serves())
    assert life.ask() == "yes"
    for number in range(SPARE_LIVES):
        life.program.dies(7)
        assert life.ask() == "yes"
        assert (life.state, life.starts) == (State.SERVING, number + 2)
    life.program.dies(7)
    with pytest.raises(
        Crashed, match="ended by itself afterwards, again and again \\(exit status 1\\): it must"
    ) as first:
        life.ask()
    assert life.state is State.HOPELESS
    with pytest.raises(Crashed) as again:
        life.up(STATUS)
    assert (again.value, life.starts) == (first.value, SPARE_LIVES + 1)


def test_dying_at_a_question_that_it_can_answer_costs_lives():
    life = Fake(*[serves(answers=[1]), serves()] * (SPARE_LIVES + 1))
    for number in range(SPARE_LIVES + 1):
        assert life.ask() == "yes"  # on the second start: what ended the first one was not the question
        assert (life.state, life.starts) == (State.SERVING, 2 * number + 2)
        life.end()
    with pytest.raises(Crashed, match="again and again"):
        life.ask()
    assert life.state is State.HOPELESS


def test_the_grader_may_end_it():
    life = Fake(serves())
    for _ in range(SPARE_LIVES + 3):
        assert life.ask() == "yes"
        life.end("it was stuck")
        assert (life.state, life.program.stopped) == (State.DOWN, "it was stuck")
    assert life.ask() == "yes"


def test_a_fresh_start():
    life = Fake(serves())
    life.ensure_fresh()
    assert life.starts == 1
    life.ensure_fresh()
    assert life.starts == 1  # nothing has been said to it
    life.fresh = False
    life.ensure_fresh()
    assert (life.starts, life.fresh, life.launched[0].killed) == (2, True, True)


def test_a_hopeless_program_is_not_started_fresh():
    life = Fake(serves(answers=[None] * 9))
    for _ in range(2):
        with pytest.raises(TimedOut):
            life.ask()
    life.fresh = False
    with pytest.raises(TimedOut):
        life.ensure_fresh()
    assert (life.state, life.starts) == (State.HOPELESS, PATIENCE + 1)


def test_the_drawing_has_every_state():
    assert all(state.name in lifecycle.__doc__ for state in State)


def test_what_it_dies_of_every_time_is_asked_only_once_more():
    life = Fake(serves(answers=[1], raised=True))
    for _ in range(PATIENCE + 4):
        with pytest.raises(Crashed, match="died while it answered a request to /sum: exit status 1.$"):
            life.ask()
    assert life.starts == PATIENCE + 1


def test_what_it_has_answered_is_asked_again_however_often_it_died_of_it():
    life = Fake(serves(answers=["yes", 1], raised=True), serves(answers=[1], raised=True))
    assert life.ask() == "yes"
    for _ in range(PATIENCE + 2):
        with pytest.raises(Crashed):
            life.ask()
    assert life.starts == PATIENCE + 2


def test_a_kind_of_question_that_is_never_answered_is_given_up_and_no_other():
    life = Fake(serves(answers=["yes"]), serves(answers=[None] * 9))
    assert life.ask(what="a greeting") == "yes"
    life.end()
    for _ in range(PATIENCE + 3):
        with pytest.raises(TimedOut):
            life.ask()
    assert life.limits == [ANSWER, ANSWER, ANSWER, SHORT] and life.starts == PATIENCE + 2
    life.plans = [serves()]
    assert life.ask(what="a greeting") == "yes"
    other = Fake(serves(answers=[None] * 9))
    other.doubt(life)
    with pytest.raises(TimedOut):
        other.ask()
    assert other.limits == [SHORT]


def test_what_never_answers_is_waited_for_briefly_in_another_world():
    silent, other = Fake(serves(answers=[None] * 9)), Fake(serves(answers=[None] * 9))
    for _ in range(2):
        with pytest.raises(TimedOut):
            silent.ask()
    other.doubt(silent)
    with pytest.raises(TimedOut):
        other.ask()
    assert (silent.state, other.starts, other.limits) == (State.HOPELESS, 1, [SHORT])
    fresh = Fake(serves())
    fresh.doubt(silent)
    assert fresh.ask() == "yes" and fresh.limits == [SHORT]
