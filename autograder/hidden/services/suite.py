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
from autograder.suitekit import ANSWER, Wrong, numbers, offer, points, twice
from course.foundation.waiting import wait_until

PROMPT = 5.0  # s in which the relay must answer when nobody offers /add_two_ints
SLACK = 1.5  # s more on a busy machine
QUIET = 1.2  # s in which nobody calls the relay
AT_ONCE = 0.5  # s in which an answer of /add_two_ints goes to its caller, one of TRIES times
TRIES = 5


@points(1, cell="motor-service")
def test_motors_start_disabled(motors: Motors) -> None:
    """The motors are disabled at first, before a command changes this."""
    message = motors.status().message
    if says(message) != DISABLED:
        raise Wrong(
            f"Right after the start, the message of {STATUS} must contain the word 'disabled', and neither of the "
            "other two.",
            f"got {message!r}",
        )
    motors.expect_change()


@points(1, cell="motor-service")
@twice
def test_enable_and_disable(motors: Motors) -> None:
    """SetBool enables the motors and disables them."""
    for on, before, after in [(True, DISABLED, ENABLED), (False, ENABLED, DISABLED)]:
        motors.bring(before)
        if motors.current() == after:
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
    motors.bring(DISABLED)
    for on in (True, False, True, False):
        expect_says(motors.command(ENABLE, on), f"{ENABLE} with data {on}", ENABLED if on else DISABLED)
    if motors.bring(STOPPED) and motors.current() == STOPPED:
        response = motors.command(ENABLE, False)
        if motors.current() == STOPPED:  # that it stays so, another test judges
            expect_says(response, f"{ENABLE} with data False, when the motors are stopped,", STOPPED)


def expect_says(response: Any, request: str, state: str) -> None:
    """A response must name this state."""
    if says(response.message) != state:
        raise Wrong(
            f"The message of {request} must contain the word '{state}', which is the state after the request, and "
            "neither of the others.",
            f"got {response}",
        )


@points(1, cell="motor-service")
@twice
def test_status(motors: Motors) -> None:
    """Trigger tells the state with success True, and does not change it."""
    told_states = set()
    for state in (ENABLED, STOPPED, DISABLED):
        motors.bring(state)
        first, again = motors.status(), motors.status()
        if not (first.success and again.success):
            raise Wrong(
                f"{STATUS} can always tell the state, so success must be True, whatever the state is.", f"got {first}"
            )
        if says(first.message) is None:
            raise Wrong(
                f"The message of {STATUS} must contain one of the words 'enabled', 'disabled' and 'stopped', and "
                "neither of the others.",
                f"got {first}",
            )
        if told(first.message) != told(again.message):
            raise Wrong(f"Asking {STATUS} must not change the state.", f"got {first}, then {again}")
        told_states.add(told(first.message))
    if len(told_states) == 1:
        raise Wrong(f"{STATUS} says the same after every command.", f"{told_states}")


@points(1, cell="motor-service")
@twice
def test_emergency_stop(motors: Motors) -> None:
    """The emergency stop stops the motors, whether they were enabled or not."""
    for state in (ENABLED, DISABLED):
        if not motors.bring(state) and state == ENABLED:
            continue  # which costs other points
        if motors.current() == STOPPED:
            raise Wrong("The motors are said to be stopped before anybody stops them, so a stop cannot be tested.")
        response = motors.command(STOP, True)
        motors.expect(STOPPED, f"After {STOP} with data True")
        expect_success(response, f"{STOP} with data True")
        expect_says(response, f"{STOP} with data True", STOPPED)
    if motors.bring(ENABLED) and motors.current() == ENABLED:
        response = motors.command(STOP, False)
        if motors.current() == ENABLED:  # that they stay so, another test judges
            expect_says(response, f"{STOP} with data False, when the motors are enabled,", ENABLED)


@points(2, cell="motor-service")
@twice
def test_stopped_motors_refuse(motors: Motors) -> None:
    """While the motors are stopped, enabling them is refused, and nothing changes."""
    motors.bring(DISABLED)
    ordinary = motors.command(ENABLE, True)
    if not ordinary.success and motors.current() != ENABLED:
        raise Wrong(
            f"{ENABLE} with data True is refused for motors that are not stopped, too: this shows nothing of stopped "
            "ones.",
            f"got {ordinary}",
        )
    motors.command(STOP, True)
    before = motors.current()
    refusal, after = motors.command(ENABLE, True), motors.current()
    if refusal.success:
        raise Wrong(f"While the emergency stop is on, {ENABLE} with data True must be refused: success False.")
    if after != before:
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
    enabled = motors.current()
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
        expect_says(response, f"{STOP} with data False", DISABLED)
        motors.command(ENABLE, True)
        if motors.current() != enabled or enabled == DISABLED:
            raise Wrong("Once the emergency stop has ended, the motors can be enabled again.")


@points(1, cell="motor-service")
@twice
def test_repeating_is_no_error(motors: Motors) -> None:
    """A command that has nothing to do is no error, and changes nothing."""
    motors.expect_change()
    for first, (service, on) in [
        ((ENABLE, True), (ENABLE, True)),
        ((ENABLE, False), (ENABLE, False)),
        ((STOP, True), (STOP, True)),
        ((STOP, True), (ENABLE, False)),
        ((STOP, False), (STOP, False)),
        ((ENABLE, True), (STOP, False)),
    ]:
        motors.bring(DISABLED)
        if motors.attempt(*first) is None:
            continue  # which costs other points
        before, response = motors.current(), motors.attempt(service, on)
        if response is None:
            continue
        after = motors.current()
        what = f"{service} with data {on}, when the state is {says(before) or 'that already'},"
        if not response.success:
            raise Wrong(f"{what} has nothing to do, and is no error: success must be True.", f"got {response}")
        if after != before:
            raise Wrong(f"{what} must leave the motors as they are.", f"{before}, then {after}")
    ends = []
    for stops in (1, 2):
        motors.bring(DISABLED)
        responses = [motors.attempt(STOP, True) for _ in range(stops)] + [motors.attempt(STOP, False)]
        if None in responses:
            return
        ends.append(motors.current())
    if ends[0] != ends[1]:
        raise Wrong(
            f"A second {STOP} with data True has nothing to do: one with data False must end the stop then, too.",
            f"{ends}",
        )


@points(1, cell="motor-service")
@twice
def test_last_command_counts(motors: Motors, rng: random.Random) -> None:
    """After many commands from two clients, the state is what the last ones made of it."""
    commands = [(ENABLE, True), (ENABLE, False)]  # what follows a stop, other tests judge
    if motors.attempt(STOP, False) is not None:
        commands.append((STOP, False))
    follows = {}  # what a command makes of each state, seen with one client: other tests judge whether it is right
    for state in (DISABLED, ENABLED):
        for command in commands:
            motors.bring(state)
            before = motors.current()
            motors.command(*command)
            follows[before, command] = motors.current()
    state = motors.current()
    if len(set(follows.values())) == 1:
        raise Wrong(f"{STATUS} says the same after every command.", f"{follows}")
    repeated = [(ENABLE, True)] * 2 + [(ENABLE, False)] * 6
    for number, command in enumerate(repeated + rng.choices(commands, k=24)):
        motors.command(*command, second=number % 2 == 1)
        now = motors.current(second=rng.random() < 0.5)
        expected, state = follows.setdefault((state, command), now), now
        if state != expected:
            raise Wrong(
                "After several commands, some repeated and from two clients, the state is not what the last command "
                "makes of the state before it.",
                f"{command}: expected {expected!r}, got {state!r}",
            )


@points(1, cell="relay")
@twice
def test_relay_answers(relay: Relay, rng: random.Random) -> None:
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
    for total in (-rng.randrange(10**8, 10**12), 0):
        adder, asked = relay.adder, len(relay.adder.requests)
        adder.fixed = total
        try:
            response = relay.relay()
        finally:
            adder.fixed = None
        if len(adder.requests) == asked:
            return  # that it must call each time, another test judges
        if not response.success or total not in numbers(response.message):
            raise Wrong(
                "A sum may be negative or 0, too: success must be True, and the message must contain it.",
                f"answered {total}, got {response}",
            )


@points(1, cell="relay")
@twice
def test_relay_asks_each_time(relay: Relay) -> None:
    """Every call of the relay calls /add_two_ints anew."""
    relay.asked()
    before = len(relay.adder.requests)
    for calls in range(1, 4):
        relay.relay()
        if not relay.has_been_asked(before + calls, relay.allow(SENT)):
            raise Wrong(f"The relay must call {ADD} each time that {RELAY} is called; it did not.")
    if relay.has_been_asked(before + calls + 1, QUIET):
        raise Wrong(
            f"Each call of {RELAY} must be one request to {ADD}; there were more.",
            f"{len(relay.adder.requests) - before} requests for {calls} calls, {QUIET} s after the last",
        )


@points(1, cell="relay")
@twice
def test_relay_sends_parameters(relay: Relay) -> None:
    """The relay sends the parameters a and b that it was started with."""
    asked = relay.asked_by_a_start()
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
    took: list[float] = []
    while len(took) < TRIES and min(took, default=AT_ONCE) >= AT_ONCE:
        start = time.monotonic()
        relay.relay()
        took.append(time.monotonic() - start)
    if min(took) >= relay.allow(AT_ONCE):
        raise Wrong(
            f"An answer of {ADD} must go to its caller as soon as it is there. {ADD} answered at once, and the caller "
            f"had its answer after {min(took):.1f} s at best, of {TRIES} calls.",
            f"{took} s",
        )
    for index, which in [(0, "first"), (-1, "last")]:
        with relay.adder.holding():
            futures = relay.send(count=2)
            relay.adder.hold_no_more()
            of_the_other = relay.adder.sums[-2:][-1 - index]
            relay.adder.held[index].set()
            if not relay.one_answered(futures):
                raise Wrong(
                    f"Two callers wait, and {ADD} answers the one that asked {which}: that answer must go to its "
                    "caller at once, while the other still waits. (A callback that spins its own node cannot go "
                    "on before all that runs inside that spin has ended.)"
                )
            if not futures[index].done():
                raise Wrong(
                    f"Two callers wait, and {ADD} answers the one that asked {which}: the answer went to the other one."
                )
            message = futures[index].result().message
            if relay.sum_in(message) == of_the_other:
                raise Wrong(
                    f"Each caller must get the answer of {ADD} to its own call, and not another's.", f"got {message!r}"
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
        relay.change(named(draw(rng)))
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
    a, b = draw(rng)
    (new_a, new_b), (_, last_b) = draw(rng), draw(rng)
    for changed, now in [
        ({"a": a, "b": b}, (a, b)),
        ({"a": new_a, "b": new_b}, (new_a, new_b)),
        ({"b": last_b}, (new_a, last_b)),
        ({"a": a}, (a, last_b)),
    ]:
        relay.change(changed)
        asked = relay.asked_by_a_start(named(now))
        if sorted(asked) != sorted(now):
            raise Wrong(
                f"After {' and '.join(changed)} is set while the relay runs, the next request to {ADD} must hold the "
                "current values of a and b.",
                f"sent {asked}, not {now}",
            )


def named(values: tuple[int, int]) -> dict[str, int]:
    """Values for the relay's parameters."""
    return dict(zip("ab", values, strict=True))


@points(1, cell="relay")
@twice
def test_without_add_two_ints(lonely: Relay, relay: Relay) -> None:
    """Without /add_two_ints the relay says so, within 5 s."""
    lonely.up(offer(RELAY))
    start = time.monotonic()
    response = lonely.relay()
    took = time.monotonic() - start
    if response.success:
        raise Wrong(f"When nobody offers {ADD}, success must be False.", f"got {response}")
    if not response.message.strip():
        raise Wrong(f"When nobody offers {ADD}, the message must say so; it is empty.")
    if took > PROMPT + SLACK:
        raise Wrong(f"When nobody offers {ADD}, the answer must come within {PROMPT:.0f} s.", f"it took {took:.1f} s")
    if not relay.does_something:
        raise Wrong(
            f"This is judged with a relay that does something: where {ADD} is offered, it does not call it, and "
            "refuses, too."
        )


@points(1, cell="relay")
@twice
def test_goes_on_afterwards(lonely: Relay) -> None:
    """After such a failure the relay keeps running, and works while /add_two_ints is there."""
    if lonely.failed != lonely.starts or not lonely.program.alive:
        lonely.relay()
    starts = lonely.starts
    lonely.serve()
    response = lonely.wait_for_success(asking=True)
    if not response.success:
        raise Wrong(
            f"Once {ADD} is there, a call of {RELAY} must succeed, even after earlier calls have failed.",
            f"got {response}",
        )
    if lonely.starts != starts:
        raise Wrong(f"After a call that failed because nobody offered {ADD}, the relay must keep running.")
    if not lonely.adder.requests:
        raise Wrong(f"Once {ADD} is there, a call of {RELAY} must call it.", f"got {response}")
    if not lonely.answers_again(PROMPT + SLACK):
        lonely.end()
        return  # which costs other points
    lonely.withdraw()
    # A call just when the server leaves may be lost, and what it answers another test judges.
    if not any(lonely.answers_again(ANSWER) for _ in range(2)):
        lonely.end()
        raise Wrong(
            f"When {ADD} was there and is gone again, a call of {RELAY} got no answer: look each time whether {ADD} is "
            "there."
        )
