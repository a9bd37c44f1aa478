"""What the services of section 3.1 must do, as a conversation with the student's motor service and relay.

Points add up to 20.  The message of a failure speaks of the task; the numbers that were drawn stay with the grader.
"""

import random

from autograder.hidden.services.conversation import CALLERS, STATUS, WORDS, Motors, Relay, draw, says, told
from autograder.suitekit import Wrong, points, twice
from course.waiting import wait_until

QUIET = 0.3  # s in which nobody calls the relay


@points(1, cell="motor-service")
def test_motors_start_disabled(motors: Motors) -> None:
    """The motors are disabled at first."""
    motors.expect(False, "Right after the start")


@points(2, cell="motor-service")
@twice
def test_enable(motors: Motors) -> None:
    """SetBool with data True enables the motors."""
    judge_switch(motors, True)


@points(2, cell="motor-service")
@twice
def test_disable(motors: Motors) -> None:
    """SetBool with data False disables the motors."""
    judge_switch(motors, False)


def judge_switch(motors: Motors, on: bool) -> None:
    """Switching succeeds, and the other service tells the new state."""
    motors.bring(not on)
    if says(motors.status().message) is on:
        raise Wrong(f"The motors cannot be switched to '{WORDS[not on]}', so data {on} cannot be tested.")
    response = motors.enable(on)
    motors.expect(on, f"After /motors/enable with data {on}")
    if not response.success:
        raise Wrong(
            f"/motors/enable with data {on} does what it was asked to do, so success must be True.", f"{response}"
        )


@points(2, cell="motor-service")
@twice
def test_enable_says_state(motors: Motors) -> None:
    """The answer to SetBool says the new state."""
    for on in (True, False, True, True, False, False):
        message = motors.enable(on).message
        if says(message) is not on:
            raise Wrong(
                f"The message of /motors/enable with data {on} must contain the word '{WORDS[on]}' (and not "
                f"'{WORDS[not on]}').",
                f"got {message!r}",
            )


@points(1, cell="motor-service")
@twice
def test_repeating_is_no_error(motors: Motors) -> None:
    """Enabling motors that are enabled, and disabling motors that are disabled, is no error."""
    for on in (True, False):
        motors.bring(not on)
        first, before = motors.enable(on), motors.status()
        again, after = motors.enable(on), motors.status()
        if again.success != first.success:
            raise Wrong(f"Asking for '{WORDS[on]}' a second time is no error: success must be True.", f"got {again}")
        if told(after) != told(before):
            raise Wrong(f"Asking for '{WORDS[on]}' a second time must leave the motors {WORDS[on]}.", f"got {after}")


@points(1, cell="motor-service")
@twice
def test_status(motors: Motors) -> None:
    """Trigger tells the state with success True, and does not change it."""
    for on in (True, False):
        motors.enable(on)
        first, again = motors.status(), motors.status()
        if not (first.success and again.success):
            raise Wrong(
                f"{STATUS} can always tell the state, so success must be True when the motors are {WORDS[on]}, too.",
                f"got {first}",
            )
        if told(first) != told(again):
            raise Wrong(f"Asking {STATUS} must not change the state.", f"got {first}, then {again}")


@points(1, cell="motor-service")
@twice
def test_last_command_counts(motors: Motors, rng: random.Random) -> None:
    """After many commands from two clients, the last one counts."""
    expected = {}
    for on in (True, False):
        motors.bring(not on)
        motors.enable(on)
        expected[on] = told(motors.status())
    if expected[True] == expected[False]:
        raise Wrong(f"{STATUS} says the same after the motors were enabled as after they were disabled.", f"{expected}")
    for number, on in enumerate([True, True, False, *rng.choices([True, False], k=15)]):
        motors.enable(on, second=number % 2 == 1)
        if told(motors.status(second=rng.random() < 0.5)) != expected[on]:
            raise Wrong(
                f"After several commands, some repeated and from two clients, {STATUS} does not tell the state that "
                "the last command asked for."
            )


@points(2, cell="relay")
@twice
def test_relay_answers(relay: Relay) -> None:
    """The relay answers with the sum that it got from /add_two_ints."""
    response = relay.relay()
    if not relay.adder.requests:
        raise Wrong("The relay did not call /add_two_ints.", f"got {response}")
    if not response.success:
        raise Wrong("When /add_two_ints answers, success must be True.", f"got {response}")
    if relay.sum_in(response.message) is None:
        raise Wrong(
            "The message must contain the sum that /add_two_ints answered (not one that the relay computed).",
            f"answered {relay.adder.sums}, got {response}",
        )


@points(1, cell="relay")
@twice
def test_relay_asks_each_time(relay: Relay) -> None:
    """Every call of the relay calls /add_two_ints anew."""
    relay.relay()
    for _ in range(3):
        relay.asked()
    before = len(relay.adder.requests)
    if wait_until(lambda: len(relay.adder.requests) > before + 1, QUIET):
        raise Wrong(
            "The relay must call /add_two_ints only when it is called itself.",
            f"{len(relay.adder.requests) - before} requests within {QUIET} s without a call",
        )


@points(1, cell="relay")
@twice
def test_relay_sends_parameters(relay: Relay) -> None:
    """The relay sends the parameters a and b that it was started with."""
    asked = relay.asked()
    if asked != relay.numbers:
        raise Wrong(
            "The request to /add_two_ints must hold the parameters a and b of the command line "
            "(--ros-args -p a:=... -p b:=...).",
            f"sent {asked}, not {relay.numbers}",
        )


@points(2, cell="relay")
@twice
def test_several_callers(relay: Relay) -> None:
    """Several callers at once each get their own answer."""
    alone = relay.relay()
    before = len(relay.adder.requests)
    responses = relay.together()
    if len(relay.adder.requests) < before + CALLERS:
        raise Wrong(
            f"When {CALLERS} clients call /relay at once, it must call /add_two_ints for each of them.",
            f"{len(relay.adder.requests) - before} requests",
        )
    if any(response.success != alone.success for response in responses):
        raise Wrong(
            f"When {CALLERS} clients call /relay at once, success must be the same as for one client alone.",
            f"{responses}",
        )
    sums = [relay.sum_in(response.message) for response in responses]
    if relay.sum_in(alone.message) is not None and (None in sums or len(set(sums)) < CALLERS):
        raise Wrong(
            f"When {CALLERS} clients call /relay at once, each must get the answer of /add_two_ints to its own call, "
            "and not another client's.",
            f"{responses}",
        )


@points(2, cell="relay")
@twice
def test_changed_parameters(relay: Relay, rng: random.Random) -> None:
    """Parameters that are set while the relay runs are used from the next call on."""
    for _ in range(2):
        numbers = draw(rng)
        relay.change(numbers)
        asked = relay.asked()
        if sorted(asked) != sorted(numbers):
            raise Wrong(
                "After a and b are set while the relay runs, the next request to /add_two_ints must hold their new "
                "values.",
                f"sent {asked}, not {numbers}",
            )


@points(1, cell="relay")
def test_without_add_two_ints(lonely: Relay) -> None:
    """Without /add_two_ints the relay says so."""
    response = lonely.relay()
    if response.success:
        raise Wrong("When nobody offers /add_two_ints, success must be False.", f"got {response}")
    if not response.message.strip():
        raise Wrong("When nobody offers /add_two_ints, the message must say so; it is empty.")


@points(1, cell="relay")
@twice
def test_goes_on_afterwards(lonely: Relay) -> None:
    """After such a failure the relay keeps running, and works once /add_two_ints is there."""
    if lonely.failed != lonely.starts or not lonely.program.alive:
        lonely.relay()
    starts = lonely.starts
    lonely.serve()
    response = lonely.wait_for_success()
    if not response.success:
        raise Wrong(
            "Once /add_two_ints is there, a call of /relay must succeed, even after earlier calls have failed.",
            f"got {response}",
        )
    if lonely.starts != starts:
        raise Wrong("After a call that failed because nobody offered /add_two_ints, the relay must keep running.")
