"""What the services of section 3.1 must do, as a conversation with the student's motor service and relay.

Points add up to 20.  The message of a failure speaks of the task; the numbers that were drawn stay with the grader.
"""

import random
import time
from typing import Any

from autograder.hidden.services.conversation import (
    ADD,
    CALLERS,
    DISABLED,
    ENABLE,
    ENABLED,
    HELD,
    RELAY,
    SENT,
    STATUS,
    STOP,
    STOPPED,
    Motors,
    Relay,
    draw,
    says,
    told,
)
from autograder.suitekit import Wrong, points, twice
from course.waiting import wait_until

QUIET = 0.3  # s in which nobody calls the relay


@points(1, cell="motor-service")
def test_motors_start_disabled(motors: Motors) -> None:
    """The motors are disabled at first."""
    motors.expect(DISABLED, "Right after the start")


@points(1, cell="motor-service")
@twice
def test_enable_and_disable(motors: Motors) -> None:
    """SetBool enables the motors and disables them."""
    for on, before, after in [(True, DISABLED, ENABLED), (False, ENABLED, DISABLED)]:
        motors.bring(before)
        if says(motors.status().message) == after:
            raise Wrong(f"The motors cannot be brought to '{before}', so {ENABLE} with data {on} cannot be tested.")
        response = motors.command(ENABLE, on)
        motors.expect(after, f"After {ENABLE} with data {on}")
        expect_success(response, f"{ENABLE} with data {on}")


def expect_success(response: Any, request: str) -> None:
    """A request that could be done is answered with success True."""
    if not response.success:
        raise Wrong(f"{request} was done, so success must be True.", f"got {response}")


@points(1, cell="motor-service")
@twice
def test_enable_says_state(motors: Motors) -> None:
    """The answer to enabling and disabling says the new state."""
    if says(motors.command(ENABLE, False).message) == STOPPED:
        motors.command(STOP, False)
    for on in (True, False, True, True, False, False):
        message, state = motors.command(ENABLE, on).message, ENABLED if on else DISABLED
        if says(message) != state:
            raise Wrong(
                f"The message of {ENABLE} with data {on} must contain the word '{state}', and neither of the others.",
                f"got {message!r}",
            )


@points(1, cell="motor-service")
@twice
def test_status(motors: Motors) -> None:
    """Trigger tells the state with success True, and does not change it."""
    for on in (True, False):
        motors.command(ENABLE, on)
        first, again = motors.status(), motors.status()
        if not (first.success and again.success):
            raise Wrong(
                f"{STATUS} can always tell the state, so success must be True, whatever the state is.", f"got {first}"
            )
        if told(first) != told(again):
            raise Wrong(f"Asking {STATUS} must not change the state.", f"got {first}, then {again}")


@points(1, cell="motor-service")
@twice
def test_emergency_stop(motors: Motors) -> None:
    """The emergency stop stops the motors, whether they were enabled or not."""
    for state in (ENABLED, DISABLED):
        motors.bring(state)
        response = motors.command(STOP, True)
        motors.expect(STOPPED, f"After {STOP} with data True")
        expect_success(response, f"{STOP} with data True")
        if says(response.message) != STOPPED:
            raise Wrong(
                f"The message of {STOP} must contain the state after the request: 'stopped' after data True.",
                f"got {response}",
            )


@points(2, cell="motor-service")
@twice
def test_stopped_motors_refuse(motors: Motors) -> None:
    """While the motors are stopped, enabling them is refused, and nothing changes."""
    motors.bring(DISABLED)
    ordinary = motors.command(ENABLE, True)
    motors.command(STOP, True)
    before = motors.status()
    refusal, after = motors.command(ENABLE, True), motors.status()
    if refusal.success:
        raise Wrong(f"While the emergency stop is on, {ENABLE} with data True must be refused: success False.")
    if told(after) != told(before):
        raise Wrong(f"{ENABLE} with data True must not change the state of motors that are stopped.", f"got {after}")
    # A message that never names a state loses the point of another test.
    if says(ordinary.message) and says(refusal.message) != STOPPED:
        raise Wrong(
            f"The message of a refused {ENABLE} must contain the state after the request, which is still 'stopped', "
            "and neither of the other two words.",
            f"got {refusal}",
        )


@points(1, cell="motor-service")
@twice
def test_release(motors: Motors) -> None:
    """After an emergency stop the motors are disabled, and can be enabled again."""
    motors.bring(DISABLED)
    motors.command(ENABLE, True)
    enabled = motors.status()
    for disturb in (False, True):
        motors.command(STOP, True)
        if disturb and motors.command(ENABLE, True).success:
            break  # it should have been refused, which another test judges
        response = motors.command(STOP, False)
        if disturb:
            when = f"After {ENABLE} with data True was refused, and then {STOP} with data False"
        else:
            when = f"After an emergency stop of enabled motors, and then {STOP} with data False"
        motors.expect(DISABLED, when)
        expect_success(response, f"{STOP} with data False")
        if says(response.message) != DISABLED:
            raise Wrong(f"The message of {STOP} with data False must contain the new state.", f"got {response}")
        motors.command(ENABLE, True)
        if told(motors.status()) != told(enabled) or says(enabled.message) == DISABLED:
            raise Wrong("Once the emergency stop has ended, the motors can be enabled again.")


@points(1, cell="motor-service")
@twice
def test_repeating_is_no_error(motors: Motors) -> None:
    """A command that has nothing to do is no error, and changes nothing."""
    for first, (service, on) in [
        ((ENABLE, True), (ENABLE, True)),
        ((ENABLE, False), (ENABLE, False)),
        ((STOP, True), (STOP, True)),
        ((STOP, True), (ENABLE, False)),
        ((STOP, False), (STOP, False)),
        ((ENABLE, True), (STOP, False)),
    ]:
        motors.bring(DISABLED)
        motors.command(*first)
        before, response, after = motors.status(), motors.command(service, on), motors.status()
        what = f"{service} with data {on}, when the state is {says(before.message) or 'that already'},"
        if not response.success:
            raise Wrong(f"{what} has nothing to do, and is no error: success must be True.", f"got {response}")
        if told(after) != told(before):
            raise Wrong(f"{what} must leave the motors as they are.", f"{before}, then {after}")


@points(1, cell="motor-service")
@twice
def test_last_command_counts(motors: Motors, rng: random.Random) -> None:
    """After many commands from two clients, the state is what the last ones made of it."""
    commands = [(ENABLE, True), (ENABLE, False), (STOP, False)]  # what follows a stop, other tests judge
    follows = {}  # what a command makes of each state, seen with one client: other tests judge whether it is right
    for state in (DISABLED, ENABLED):
        for command in commands:
            motors.bring(state)
            before = told(motors.status())
            motors.command(*command)
            follows[before, command] = told(motors.status())
    state = told(motors.status())
    if len(set(follows.values())) == 1:
        raise Wrong(f"{STATUS} says the same after every command.", f"{follows}")
    repeated = [(ENABLE, True)] * 2 + [(ENABLE, False)] * 6
    for number, command in enumerate(repeated + rng.choices(commands, weights=[4, 3, 1], k=24)):
        motors.command(*command, second=number % 2 == 1)
        now = told(motors.status(second=rng.random() < 0.5))
        expected, state = follows.setdefault((state, command), now), now
        if state != expected:
            raise Wrong(
                f"After several commands, some repeated and from two clients, {STATUS} does not tell what the last "
                "command makes of the state before it.",
                f"{command}: expected {expected!r}, got {state!r}",
            )


@points(1, cell="relay")
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


@points(1, cell="relay")
@twice
def test_several_callers(relay: Relay) -> None:
    """Several callers at once each get their own answer."""
    alone = relay.relay()
    before = len(relay.adder.requests)
    responses = relay.together()
    if not wait_until(lambda: len(relay.adder.requests) >= before + CALLERS, relay.allow(SENT)):
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
def test_no_caller_waits_for_another(relay: Relay) -> None:
    """Each caller gets its answer as soon as /add_two_ints has given it, whoever called first."""
    relay.relay()
    for index, which in [(0, "first"), (-1, "last")]:
        with relay.adder.holding():
            futures = relay.send(count=2)
            relay.adder.held[index].set()
            if not relay.one_answered(futures):
                raise Wrong(
                    f"Two callers wait, and {ADD} answers the one that asked {which}: that answer must go to its "
                    "caller at once, while the other still waits. (A callback that spins its own node cannot go "
                    "on before all that runs inside that spin has ended.)"
                )
        relay.all_answered(futures)


@points(1, cell="relay")
@twice
def test_goes_on_serving(relay: Relay, rng: random.Random) -> None:
    """While a call waits for /add_two_ints, a parameter can be set."""
    relay.relay()
    with relay.adder.holding():
        futures = relay.send()
        start = time.monotonic()
        relay.change(draw(rng))
        if time.monotonic() - start > HELD / 2:
            raise Wrong(
                f"While a call of {RELAY} waits for {ADD}, the node must go on serving: setting the parameter a had to "
                "wait for the end of the call."
            )
    relay.all_answered(futures)


@points(1, cell="relay")
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
