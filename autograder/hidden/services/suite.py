"""Tests of the services of section 3.1, as a conversation with the student's motor service and relay.

Points add up to 20: half of each file's are for what the exercise is about, an emergency stop after which nothing
starts by itself, and callers that do not wait for each other.  The message of a failure says what the program did,
beside what the task asks; the numbers that were drawn stay with the grader.
"""

import random
import time
from contextlib import suppress
from itertools import pairwise
from typing import Any

from autograder.hidden.services.conversation import (
    ADD,
    CALLERS,
    COMMANDS,
    DISABLED,
    ENABLE,
    ENABLED,
    HOLDS,
    LESSON,
    RELAY,
    SENT,
    STARTS,
    STATES,
    STATUS,
    STOP,
    STOPPED,
    STOPS,
    Motors,
    Relay,
    as_parameters,
    draw,
    masked,
    parted,
    quoted,
    says,
    shown,
    whole_numbers,
)
from autograder.suitekit import Crashed, Wrong, offer, on_wrong, points, twice
from autograder.suitekit.hints import last_words
from course.foundation.waiting import wait_until

PROMPT = 5.0  # s in which the relay must answer when /add_two_ints is not available
BEFORE = 1.0  # s for a call without /add_two_ints to a relay that is known to give no answer then
SLACK = 1.5  # s more on a busy machine
STARTED = PROMPT + 2 * SLACK  # s, the same for a program that has only just started
UNASKED = 0.2  # s in which an answer comes that nobody has given yet
QUIET = 0.3  # s in which nobody calls the relay
WATCHED = 2.0  # s after the relay's start until its requests are counted
GOES_ON = f"After a call that failed because nobody offered {ADD}, the relay must keep running; it ended"
WISHES = 4  # refused requests to enable during one emergency stop
OFTEN = 60  # requests to enable and to disable
OFTEN_TAKES = 3.0  # s after which no more of these are sent
KEPT = 6.5  # s for which the motors keep their state when nobody asks for anything
WAITS = 6.0  # s that the relay must wait for an answer at least, by the task
TAKES = 5.3  # s that /add_two_ints takes
AT_ONCE = 0.5  # s in which an answer that is there goes to its caller, by the task
LATER = 1.2  # s until a second caller asks for a slow answer, and for which a relay goes on after a failed call
STAYS = 1.0  # s at least after the end of a long stop, until the motors are looked at once more
LATE = 0.8  # s that a slow answer may be later than a quick one: it cannot be tried often
SOON = 1.2  # s until the relay has found a server that is there, at the best of several tries
IN_TURN = 0.3  # s that a caller waits at least who is made to wait
LOADED = 3  # times as long as another request to the relay takes: on a busy machine an answer may need that, too


def after(state: str, service: str, on: bool) -> str:
    """The state after a command, by the table of the task."""
    if service == STOP:
        return STOPPED if on else DISABLED if state == STOPPED else state
    return state if state == STOPPED else ENABLED if on else DISABLED


@points(0.5, cell="motor-service")
def test_motors_start_disabled(motors: Motors) -> None:
    """The motors are disabled at first, before a command changes this."""
    message = motors.status().message
    motors.learn()
    if motors.named(message) != DISABLED:
        raise Wrong(f"Right after the start the motors must be disabled; {STATUS} says {quoted(message)}.")
    motors.expect_change()


@points(1, cell="motor-service")
@twice
def test_enable_and_disable(motors: Motors) -> None:
    """SetBool enables the motors and disables them."""
    motors.bring(ENABLED)
    motors.bring(DISABLED)
    for on in (True, False, True, False):
        motors.command(ENABLE, on)
        motors.expect(ENABLED if on else DISABLED, f"{ENABLE} with data {on}")


@points(0.5, cell="motor-service")
@twice
def test_emergency_stop(motors: Motors, alone: Motors) -> None:
    """The emergency stop stops the motors, whether they were enabled or not, or never, and can be ended."""
    for state in (ENABLED, DISABLED):
        if not motors.bring(state) and state == ENABLED:
            continue  # which costs other points
        motors.command(STOP, True)
        motors.expect(STOPPED, f"{STOP} with data True, when they were {state},")
        motors.command(STOP, False)
        if motors.current() == STOPPED:
            raise Wrong(f"{STOP} with data False must end the stop; {motors.witness} says {quoted(motors.said())}.")
        motors.command(STOP, True)
        if motors.attempt(ENABLE, True) is None:
            continue  # which costs other points
        if motors.attempt(STOP, False) and motors.current() == STOPPED:
            said, meanwhile = quoted(motors.said()), f"{ENABLE} was asked for meanwhile, which is refused"
            for on in (False, True, False):
                motors.command(STOP, on)
            if motors.current() == STOPPED:
                meanwhile = f"nothing was asked for meanwhile, not even {STATUS}"
            raise Wrong(
                f"One {STOP} with data False must end the stop, also when {meanwhile}; {motors.witness} says {said}."
            )
        if motors.can_enable:
            motors.command(ENABLE, True)
            motors.expect(ENABLED, f"an emergency stop, its end, and then {ENABLE} with data True,")
    alone.stop_first()
    if alone.current() in (ENABLED, DISABLED):  # the words of its message, another test judges
        raise Wrong(
            f"After {STOP} with data True, when nobody has enabled the motors since the start, they must be stopped; "
            f"{alone.witness} says {quoted(alone.said())}."
        )
    alone.enable_at_first()  # which the last test judges, and looks at now, as this start has just been stopped


def expect_still(motors: Motors, happened: list[str], rule: str) -> None:
    """The motors must not run after these commands."""
    if motors.current() == ENABLED:
        raise Wrong(
            f"When {', then '.join(happened)}, {motors.witness} says {quoted(motors.said())}: the motors {rule}."
        )


@points(1, cell="motor-service")
@twice
def test_success(motors: Motors) -> None:
    """Only one request is refused, to enable stopped motors: success is True for all others."""
    motors.expect_change()
    if not motors.bring(STOPPED):
        motors.up(offer(STOP))
        motors.admit(STOP, True)
        raise Wrong(
            f"A refusal is judged with motors that are stopped: but after {STOP} with data True {motors.witness} says "
            f"{quoted(motors.said())}."
        )
    motors.command(ENABLE, True)  # who cannot refuse without dying loses these points; another end costs others
    with on_wrong(motors.forget):
        for (state, service, on), (response, _) in motors.table().items():
            refused = (state, service, on) == (STOPPED, ENABLE, True)
            expect_success(response, not refused, f"{service} with data {on}", state)
    for state in STATES:
        for service, on in COMMANDS:
            motors.expect_answer(state, service, on)
    for state in STATES if motors.status_answers else ():
        if motors.bring(state):
            expect_success(motors.status(), True, STATUS, state)
    with on_wrong(motors.forget):
        expect_success_after_refusal(motors)
    expect_success_often(motors)


def expect_success_after_refusal(motors: Motors) -> None:
    """A refusal is of one request alone: the next one may be anything else."""
    right_after = f", right after a refused {ENABLE}"
    if motors.status_answers and motors.bring(STOPPED) and motors.attempt(ENABLE, True) is not None:
        expect_success(motors.status(), True, f"{STATUS}{right_after}", STOPPED)
    for service, on in COMMANDS[1:]:
        if motors.bring(STOPPED) and motors.attempt(ENABLE, True) is not None:
            response = motors.attempt(service, on)
            if response is not None:
                expect_success(response, True, f"{service} with data {on}{right_after}", STOPPED)


def expect_success_often(motors: Motors) -> None:
    """Motors that are not stopped must enable and disable with success, however often; within some seconds."""
    end = time.monotonic() + OFTEN_TAKES
    if not motors.bring(DISABLED):
        return  # which costs other points
    for number in range(1, OFTEN + 1):
        on = number % 2 == 1
        response = motors.attempt(ENABLE, on)
        if response is None or time.monotonic() > end:
            return
        if not response.success:
            raise Wrong(
                f"Motors that were not stopped were enabled and disabled again and again. {ENABLE} with data {on} is "
                "not an error, however often: success must be True. In the end it was False, with the message "
                f"{quoted(response.message)}."
            )


def expect_success(response: Any, wanted: bool, request: str, state: str) -> None:
    """A response must have this `success`."""
    if response.success != wanted:
        raise Wrong(
            f"{request}, when the motors are {state}, {'is not an error' if wanted else 'is refused'}: success must be "
            f"{wanted}. It is {response.success}, with the message {quoted(response.message)}."
        )


@points(0.5, cell="motor-service")
@twice
def test_messages_say_state(motors: Motors) -> None:
    """The message of each answer names the state after the request, and neither of the others."""
    motors.expect_change()
    with on_wrong(motors.forget):
        for (state, service, on), (response, now) in motors.table().items():
            # What the motors do, and what the status says of them, other tests judge.
            if says(response.message) not in {after(state, service, on), now}:
                raise Wrong(
                    f"{service} with data {on}, when the motors are {state}, is answered with the message "
                    f"{quoted(response.message)}: it must contain the word '{after(state, service, on)}', which is the "
                    "state after the request, and neither of the other two."
                )
    if motors.status_answers:
        for state in STATES:
            if motors.bring(state) and says(message := motors.status().message) is None:
                raise Wrong(
                    f"{STATUS}, when the motors are {state}, is answered with the message {quoted(message)}: it must "
                    f"contain the word '{state}', and neither of the other two."
                )
    if motors.unclear:
        service, number, message = motors.unclear
        raise Wrong(
            f"Answer {number} after the start, of {service}, has the message {quoted(message)}: it must contain one of "
            f"the words {', '.join(map(repr, STATES))}, and neither of the other two."
        )


@points(0.5, cell="motor-service")
@twice
def test_status(motors: Motors) -> None:
    """Trigger tells the state, and does not change it."""
    motors.expect_change()
    if not motors.bring(DISABLED):
        return  # which costs other points
    told = set()
    for service, on, state in LESSON:
        response = motors.attempt(service, on)
        first, again = motors.status().message, motors.status().message
        if motors.named(first) != motors.named(again):
            raise Wrong(
                f"Asking {STATUS} must not change the state: it says {quoted(first)}, and when it is asked again "
                f"{quoted(again)}."
            )
        told.add(motors.named(first))
        if response is not None and motors.named(response.message) == state != motors.named(first):
            raise Wrong(
                f"{service} with data {on} is answered with {quoted(response.message)}, but then {STATUS} says "
                f"{quoted(first)}."
            )
    if len(told) == 1:
        raise Wrong(f"{STATUS} says the same after every command: {quoted(first)}.")


@points(0.5, cell="motor-service")
@twice
def test_repeating_changes_nothing(motors: Motors) -> None:
    """A command that has nothing to do changes nothing."""
    motors.expect_change()
    with on_wrong(motors.forget):
        for (state, service, on), (_, now) in motors.table().items():
            if after(state, service, on) == state != now:
                raise Wrong(
                    f"{service} with data {on} has nothing to do when the motors are {state}: they must stay so, but "
                    f"then {motors.witness} says {quoted(now)}."
                )
    for state in STATES:
        for service, on in COMMANDS:
            if after(state, service, on) == state:
                motors.expect_answer(state, service, on)
    ends = []
    for stops in (1, 2):
        motors.bring(DISABLED)
        responses = [motors.attempt(STOP, True) for _ in range(stops)] + [motors.attempt(STOP, False)]
        if None in responses:
            return
        ends.append(motors.current())
    if ends[0] != ends[1]:
        raise Wrong(
            f"A second {STOP} with data True has nothing to do, so one with data False must end the stop: but then "
            f"{motors.witness} says {quoted(motors.said())}."
        )


@points(0.5, cell="relay")
@twice
def test_relay_answers(relay: Relay, motors: Motors, alone: Motors, halted: Motors, rng: random.Random) -> None:
    """The relay answers with the sum that it got from /add_two_ints, whatever it is."""
    for each, commands in ((motors, STARTS), (alone, STOPS), (halted, HOLDS)):
        each.leave(*commands)  # and left alone meanwhile, which the last tests look at
    response = relay.relay()
    if not relay.has_asked(1):
        raise Wrong(f"{RELAY} was called, and did not call {ADD}. It answered {shown(response)}.", f"got {response}")
    if not response.success:
        raise Wrong(
            f"{ADD} has answered, so success must be True: {RELAY} answered {shown(response)}.", f"got {response}"
        )
    if relay.sum_in(response.message) is None:
        raise Wrong(
            f"The message must contain the sum that {ADD} answered, with all digits, not one of the relay's own: it is "
            f"{masked(response.message)}.{parted(response.message, relay.adder.sums)}",
            f"answered {relay.adder.sums}",
        )
    for total, kind in [
        (-rng.randrange(10**8, 10**12), "a negative sum"),
        (0, "a sum of 0"),
        (-1, "a sum of -1"),
        (rng.randrange(2**61, 2**62) | 1, "a sum beyond 2**53"),
    ]:
        adder, asked = relay.adder, len(relay.adder.requests)
        adder.fixed = total
        try:
            response = relay.relay()
        finally:
            adder.fixed = None
        if len(adder.requests) == asked:
            return  # that it must call each time, another test judges
        if not response.success or total not in whole_numbers(response.message):
            raise Wrong(
                f"{ADD} answered {kind}: success must be True, and the message must contain it. {RELAY} answered "
                f"{shown(response)}.",
                f"answered {total}",
            )


@points(0.5, cell="relay")
@twice
def test_relay_sends_parameters(relay: Relay) -> None:
    """The relay sends the parameters a and b that it was started with."""
    asked = relay.asked_by_a_start()
    if asked != relay.numbers:
        how = "b as a, and a as b" if asked == relay.numbers[::-1] else "other numbers"
        raise Wrong(
            "The request to /add_two_ints must hold the parameters a and b of the command line "
            f"(--ros-args -p a:=... -p b:=...); it held {how}.",
            f"sent {asked}, not {relay.numbers}",
        )
    relay.expect_own_sum("A call with the parameters of the command line")


@points(0.5, cell="relay")
@twice
def test_changed_parameters(relay: Relay, rng: random.Random) -> None:
    """Parameters that are set while the relay runs are used from the next call on."""
    a, b = draw(rng)
    (new_a, new_b), (_, last_b) = draw(rng), draw(rng)
    far = rng.randrange(2**62, 2**63)
    for changed, now in [
        ({"a": a, "b": b}, (a, b)),
        ({"a": new_a, "b": new_b}, (new_a, new_b)),
        ({"b": 0}, (new_a, 0)),
        ({"b": last_b}, (new_a, last_b)),
        ({"a": a}, (a, last_b)),
        ({"a": far, "b": last_b - far}, (far, last_b - far)),
        ({"a": 0, "b": last_b}, (0, last_b)),
        ({"a": 0, "b": 0}, (0, 0)),
    ]:
        relay.change(changed)
        shown_as = {0: " (to 0)", far: " (beyond 2**53)", last_b - far: " (beyond 2**53)"}
        what = " and ".join(name + shown_as.get(value, "") for name, value in changed.items())
        try:
            asked = relay.asked_by_a_start(as_parameters(now))
        except Wrong:
            raise Wrong(
                f"After a change of {what} while the relay ran, a call of {RELAY} must ask {ADD}; no request came."
            ) from None
        if sorted(asked) != sorted(now):
            raise Wrong(
                f"After a change of {what} while the relay ran, the next request to {ADD} must hold the current values "
                "of a and b; it held other numbers.",
                f"sent {asked}, not {now}",
            )
        relay.expect_own_sum(f"After a change of {what} while the relay ran, a call")


@points(0.5, cell="relay")
@twice
def test_several_callers(relay: Relay, rng: random.Random) -> None:
    """Six callers at once each get their own answer."""
    alone = relay.relay()
    relay.vary(rng)
    before = len(relay.adder.requests)
    responses = relay.together()
    together = len(relay.adder.held)
    if not relay.has_asked(before + CALLERS):
        raise Wrong(
            f"{CALLERS} clients called {RELAY} at once, so {CALLERS} requests must go out to {ADD}; "
            f"{len(relay.adder.requests) - before} came."
        )
    if 1 < together < CALLERS:  # of one at a time, another test judges
        raise Wrong(
            f"{CALLERS} clients called {RELAY} at once, so {CALLERS} requests must go out to {ADD} at once, before any "
            f"of them is answered: {together} came within {SENT:.0f} s of the first, and the others later."
        )
    odd = [response for response in responses if response.success != alone.success]
    if odd:
        raise Wrong(
            f"{CALLERS} clients called {RELAY} at once: one was answered with {shown(odd[0])}, while one client alone "
            f"is answered with {shown(alone)}."
        )
    answered = relay.adder.sums[before:]
    sums = [next((n for n in whole_numbers(response.message) if n in answered), None) for response in responses]
    if None in sums or len(set(sums)) < CALLERS:
        raise Wrong(
            f"{CALLERS} clients called {RELAY} at once, and each must get the answer of {ADD} to its own call: of "
            f"{CALLERS} different sums {len({*sums} - {None})} arrived.",
            f"{responses}",
        )


@points(5, cell="relay")
@twice
def test_no_caller_waits_for_another(relay: Relay, rng: random.Random) -> None:
    """Each caller gets its answer as soon as /add_two_ints has given it, whoever called first."""
    relay.relay()
    for index, which in [(0, "first"), (-1, "second")]:
        relay.vary(rng)
        before = len(relay.adder.sums)
        with relay.adder.holding():
            futures = relay.send(count=2)
            relay.adder.hold_no_more()
            relay.expect_no_early_answer(futures)
            of_the_other = relay.adder.sums[-2:][-1 - index]
            relay.adder.held[index].set()
            if not relay.one_answered(futures):
                raise Wrong(
                    f"Two callers wait, and {ADD} answers the question of the {which}: its caller got no answer within "
                    f"{SENT:.0f} s, while the other question was open. The callback must not wait for anything of the "
                    "other call: its spin, its lock, its turn."
                )
            if not futures[index].done():
                raise Wrong(
                    f"Two callers wait, and {ADD} answers the question of the {which}: the other caller was answered."
                )
            message = futures[index].result().message
            told_sum = relay.sum_in(message)  # a message without any sum is judged by other tests
            if told_sum == of_the_other or not (told_sum is None or relay.tells_own_sum(message, before)):
                whose = "the other" if told_sum == of_the_other else "an earlier call"
                raise Wrong(
                    f"Two callers wait, and {ADD} answers the question of the {which}: its caller was told the sum of "
                    f"{whose}."
                )
            other = futures[-1 - index]
            if wait_until(other.done, UNASKED):
                relay.end()  # what it owes must not come later
                raise Wrong(
                    f"Two callers wait, and {ADD} answers the question of the {which}: the other caller was answered, "
                    f"too, while its own question was open, with {shown(other.result())}."
                )
        relay.all_answered(futures)


@points(1, cell="relay")
@twice
def test_goes_on_serving(relay: Relay, rng: random.Random) -> None:
    """While any number of calls wait for /add_two_ints, a parameter can be set, and is used afterwards."""
    usual = relay.relay()
    (first, later), starts = (draw(rng), draw(rng)), relay.starts
    with suppress(Wrong):
        relay.change(as_parameters(first))
    uses = relay.sends(first)  # that it uses what is set at all, another test judges
    relay.vary(rng)
    with relay.adder.holding():
        futures = relay.send()
        while len(relay.adder.held) == len(futures) < CALLERS:
            futures.append(relay.send_another())  # that each goes out is judged by another test
        relay.expect_no_early_answer(futures)
        start, asked = time.monotonic(), relay.starts
        if not relay.can_change(as_parameters(later)):
            raise Wrong(
                f"While callers of {RELAY} wait for {ADD}, a parameter that is set must be set at once: setting a and "
                "b was refused."
            )
        if relay.starts > asked:  # what has answered is another start, of which nobody asks anything else
            raise Wrong(
                f"While callers of {RELAY} wait for {ADD} ({len(futures)} here), the node must go on serving: setting "
                "the parameters a and b got no answer."
            )
        if not relay.adder.given_up:
            relay.expect_no_early_answer(futures, just_sent=False)
        else:
            took = time.monotonic() - start
            raise Wrong(
                f"While callers of {RELAY} wait for {ADD} ({len(futures)} here), the node must go on serving: setting "
                f"the parameters a and b was answered only after {took:.0f} s, when a call had ended."
            )
    with suppress(Crashed):  # that each gets its own answer, another test judges
        relay.all_answered(futures)
    told = [future.result() for future in futures if future.done()]
    if whole_numbers(usual.message) and any(each.success and not whole_numbers(each.message) for each in told):
        raise Wrong(
            f"The parameters a and b were set while callers of {RELAY} waited for {ADD}: these must be answered with "
            "their sums, and one was answered without any."
        )
    if uses and relay.sends(later) is False and relay.starts == starts:
        raise Wrong(
            f"The parameters a and b were set while callers of {RELAY} waited for {ADD}: the next call must send these "
            "values, and it sent others."
        )


@points(0.5, cell="relay")
@twice
def test_slow_answer(relay: Relay, lonely: Relay, rng: random.Random) -> None:
    """An answer that /add_two_ints takes more than 5 s for is waited for, and passed on at once."""
    lonely.call_at_start()  # which the next test judges
    relay.relay()
    start = time.monotonic()
    usual = relay.relay()
    quick = time.monotonic() - start
    relay.vary(rng)
    before = len(relay.adder.sums)
    with relay.adder.holding(TAKES + SLACK):
        futures = relay.send()
        start = time.monotonic()
        relay.wait_for(futures[0].done, LATER)
        if not futures[0].done():
            futures.append(relay.send_another())
            relay.wait_for(futures[0].done, start + TAKES - time.monotonic())
        took = time.monotonic() - start
        if futures[0].done():
            raise Wrong(
                f"{RELAY} must wait for the answer of {ADD} for at least {WAITS:.0f} s: it answered after {took:.1f} s "
                f"with {shown(futures[0].result())}."
            )
        late = relay.release(futures[: len(relay.adder.held)])
    if not futures[0].done():
        raise Wrong(f"{ADD} took {TAKES} s for its answer, and then {RELAY} gave its caller none.")
    response = futures[0].result()
    relay.all_answered(futures)
    if response.success != usual.success:
        raise Wrong(f"{ADD} took {TAKES} s for its answer, and {RELAY} answered with {shown(response)}.")
    if not relay.tells_own_sum(response.message, before):
        raise Wrong(
            f"{ADD} took {TAKES} s for its answer, and the message must contain this sum: {RELAY} answered with "
            f"{shown(response)}."
        )
    if late > quick + max(LATE, LOADED * relay.round_trip()):  # how long a quick answer takes, another test judges
        raise Wrong(
            f"{ADD} took some seconds for its answer, which must go to the caller as soon as it is there: {RELAY} "
            f"passed it on {late:.1f} s later."
        )


@points(0.5, cell="relay")
@twice
def test_without_add_two_ints(lonely: Relay, relay: Relay) -> None:
    """Without /add_two_ints the relay says so within 5 s, to six callers at once, too."""
    lonely.call_at_start()
    lonely.wait_for_first_answer(STARTED)
    lonely.up(offer(RELAY))
    start = time.monotonic()
    response = lonely.relay()
    took = time.monotonic() - start
    if response.success:
        raise Wrong(f"{ADD} is not available, so success must be False: {RELAY} answered {shown(response)}.")
    if not response.message.strip():
        raise Wrong(f"When {ADD} is not available, the message must say so; it is empty.")
    if took > PROMPT + SLACK:
        raise Wrong(f"When {ADD} is not available, the answer must come within {PROMPT:.0f} s; it took {took:.1f} s.")
    with on_wrong(lonely.end):  # once more, by a start of its own
        if (first := lonely.first_answer_took()) > STARTED:
            raise Wrong(
                f"When {ADD} is not available, the answer must come within {PROMPT:.0f} s, also right after the start: "
                f"{RELAY} was called as soon as it was there, and answered after {first:.1f} s. (A later call had its "
                f"answer after {took:.1f} s.)"
            )
    times = lonely.told_after(PROMPT + SLACK)
    in_turn = took > IN_TURN and min((b - a for a, b in pairwise(times)), default=0.0) > took / 2
    if not times or (in_turn and times[-1] > PROMPT + AT_ONCE):
        raise Wrong(
            f"When {ADD} is not available, and {CALLERS} clients call {RELAY} at once, each must have its answer "
            f"within {PROMPT:.0f} s; one had {f'it after {times[-1]:.1f} s' if times else 'none'}. Alone, a client had "
            f"it after {took:.1f} s."
        )
    relay.expect_asking()


@points(0.5, cell="relay")
@twice
def test_goes_on_afterwards(lonely: Relay) -> None:
    """After such a failure the relay keeps running, and works while /add_two_ints is there."""
    if lonely.failed == lonely.starts > 0 and lonely.has_ended:
        raise Wrong(f"{GOES_ON}: {last_words(lonely.program)}.")
    lonely.up(offer(RELAY))
    ends = lonely.ends
    if lonely.failed != lonely.starts:
        # That it must have an answer, and which, another test judges.
        lonely.answers_again(BEFORE if lonely.has_been_silent else PROMPT + SLACK)
    refused = lonely.failed == lonely.starts
    lonely.serve()
    response = lonely.after_offer(PROMPT + SLACK)
    if not lonely.program.alive:
        lonely.end()
        raise Wrong(f"{GOES_ON}: {last_words(lonely.program)}.")
    if response is None:
        serves = lonely.clients[RELAY].service_is_ready()
        lonely.end()
        raise Wrong(
            f"{ADD} is there now, after calls of {RELAY} without it: a call must succeed. It got no answer within "
            f"{PROMPT + SLACK} s{'' if serves else f', because the relay does not offer {RELAY} any more'}."
        )
    if not response.success:
        raise Wrong(
            f"{ADD} is there now, after calls of {RELAY} without it: a call must succeed. It was answered with "
            f"{shown(response)}."
        )
    if not lonely.adder.requests:
        raise Wrong(f"{ADD} is there now: a call of {RELAY} must call it. It answered {shown(response)} without it.")
    if lonely.answers_again(PROMPT + SLACK) is None:
        lonely.end()
        return  # which costs other points
    response = lonely.after_withdrawal(PROMPT + SLACK)
    if response is None:
        lonely.end()
        raise Wrong(
            f"{ADD} was there, and is gone again: a call of {RELAY} got no answer within {PROMPT + SLACK} s. Look at "
            "each call if it is there."
        )
    if response.success and refused:
        raise Wrong(f"{ADD} was there, and is gone again: a call of {RELAY} was answered with {shown(response)}.")
    if refused and lonely.repeats(response.message):
        raise Wrong(
            f"{ADD} was there, and is gone again: the message must say so. {RELAY} was answered with {shown(response)}."
        )
    took, response = lonely.found_again(SOON, PROMPT + SLACK)
    if took > SOON:
        lonely.end()
        if response is None:
            how = f"It got no answer within {PROMPT + SLACK} s."
        elif not response.success:
            how = f"It was answered with {shown(response)}."
        else:
            how = f"The first one that did was made {took:.1f} s later, at best. Look at each call if it is there."
        raise Wrong(f"{ADD} was gone, and is there again: a call of {RELAY} must succeed. {how}")
    if lonely.ends > ends or wait_until(lambda: lonely.has_ended, LATER):
        raise Wrong(f"{GOES_ON}.")


@points(0.5, cell="relay")
@twice
def test_relay_asks_each_time(relay: Relay) -> None:
    """Each call sends one request to /add_two_ints, at once; without a call none is sent."""
    starts, unanswered = relay.starts, relay.unanswered
    relay.asked()
    under_way = relay.unanswered - (unanswered if relay.starts == starts else 0)  # their requests may come later
    sent, before = relay.sent, len(relay.adder.requests)
    for calls in range(1, 4):
        relay.relay()
        if not relay.has_asked(before + calls):
            raise Wrong(f"The relay must call {ADD} each time that {RELAY} is called; it did not.")
    wait_until(lambda: len(relay.adder.requests) > before + calls, QUIET)
    relay.watch(WATCHED)
    came = len(relay.adder.requests) - before
    for since, called, has_sent in [
        ("the relay was started", relay.sent, len(relay.adder.requests)),
        ("its first answer", relay.sent - sent + under_way, came),  # at the start some calls may have sent none
    ]:
        if has_sent > called:
            raise Wrong(
                f"Each call of {RELAY} must be one request to {ADD}, and without a call there must be none: since "
                f"{since} it was called {called} times, and has sent {has_sent} requests."
            )
    took, allowed = relay.quickest(AT_ONCE, LOADED)
    if took > allowed:
        raise Wrong(
            f"{ADD} answers in a millisecond, and its answer must go to the caller at once: each of several calls of "
            f"{RELAY} took {took:.1f} s or more."
        )


@points(0.5, cell="motor-service")
@twice
def test_last_command_counts(motors: Motors, rng: random.Random) -> None:
    """The state stays until a command changes it; after many commands from two clients the last ones decide."""
    with on_wrong(motors.leave_as_long):
        if motors.after_silence(KEPT, *STARTS) not in ("", ENABLED):
            raise Wrong(
                f"The motors were enabled, and nobody asked for anything for {motors.silence:.0f} s: they must stay "
                f"enabled, but then {motors.witness} says {quoted(motors.said())}."
            )
    commands = [(ENABLE, True), (ENABLE, False)]  # what follows a stop, other tests judge
    if motors.attempt(STOP, False) is not None:
        commands.append((STOP, False))
    follows = {}  # what a command makes of each state, seen with one client: other tests judge whether it is right
    for state in (DISABLED, ENABLED):
        for command in commands:
            motors.renew()
            motors.bring(state)
            before = motors.current()
            motors.command(*command)
            follows[before, command] = motors.current()
    motors.expect_change()
    motors.renew()
    state = motors.current()
    repeated = [(ENABLE, True)] * 2 + [(ENABLE, False)] * 6
    for number, command in enumerate(repeated + rng.choices(commands, k=24)):
        motors.command(*command, second=number % 2 == 1)
        now = motors.current(second=rng.random() < 0.5)
        before, expected, state = state, follows.setdefault((state, command), now), now
        if state != expected:
            raise Wrong(
                f"After {number + 1} commands, some repeated and from two clients, {command[0]} with data {command[1]} "
                f"made {quoted(state)} of {quoted(before)}; before, it made {quoted(expected)} of it."
            )


def expect_long_stop(halted: Motors) -> list[str]:
    """Motors must stay stopped for some seconds, and be disabled when the stop ends; return what happened to them.

    Nothing when they cannot be stopped, or give no answer, which costs other points.
    """
    with on_wrong(halted.leave_as_long):
        state = halted.after_silence(KEPT, *HOLDS)
        if state in (ENABLED, DISABLED) and halted.can_stop:
            raise Wrong(
                f"An emergency stop was on, and nobody asked for anything for {halted.silence:.0f} s: the motors must "
                f"stay stopped, but then {halted.witness} says {quoted(halted.said())}."
            )
    if state != STOPPED or halted.attempt(STOP, False) is None:
        return []
    happened = [
        f"motors that were {ENABLED} got {STOP} with data True",
        f"{STOP} with data False {halted.silence:.0f} s later",
    ]
    expect_still(halted, happened, "must be disabled when the stop ends, and not start")
    return happened


@points(5, cell="motor-service")
@twice
def test_stays_still(motors: Motors, alone: Motors, halted: Motors) -> None:
    """After an emergency stop the motors stand still until somebody enables them when it has ended."""
    motors.expect_change()
    wish = (ENABLE, True)
    for before, meanwhile in [
        (ENABLED, []),
        (ENABLED, [wish, wish]),
        (DISABLED, [wish] * WISHES),  # who ends the stop at one of these starts at the next one
        (ENABLED, [*[(ENABLE, False)] * 3, wish]),
        (ENABLED, [(STOP, True), wish]),
    ]:
        if not motors.bring(before):
            if before == ENABLED:
                motors.admit(ENABLE, True)
                raise Wrong(
                    f"This is judged with motors that run: but after {ENABLE} with data True {motors.witness} says "
                    f"{quoted(motors.said())}."
                )
            continue  # which costs other points
        motors.command(STOP, True)
        happened = [f"motors that were {before} got {STOP} with data True"]
        expect_still(motors, happened, "must not run")
        for service, on in meanwhile:
            motors.command(service, on)  # motors that give no answer have not shown that they stand still
            happened.append(f"{service} with data {on}")
            expect_still(motors, happened, "must stay stopped")
        for _ in "12":
            motors.command(STOP, False)
            happened.append(f"{STOP} with data False")
            expect_still(motors, happened, "must be disabled when the stop ends, and not start")
    long_stop, ended = expect_long_stop(halted), time.monotonic()
    for _ in motors.overlaps(DISABLED, wish, (STOP, True)):
        happened = [f"disabled motors got {ENABLE} with data True", f"{STOP} with data True before that was answered"]
        expect_still(motors, happened, "must be stopped")
        motors.command(STOP, False)
        happened.append(f"{STOP} with data False")
        expect_still(motors, happened, "must be disabled when the stop ends, and not start")
    # In any order they end up stopped; by the status, because either message may be that of the first.
    for _ in motors.overlaps(DISABLED, (STOP, True), wish) if motors.witness == STATUS else ():
        happened = [f"disabled motors got {STOP} with data True", f"{ENABLE} with data True right behind it"]
        expect_still(motors, happened, "must be stopped, in whatever order the two are carried out")
        motors.command(STOP, False)
        happened.append(f"{STOP} with data False")
        expect_still(motors, happened, "must be disabled when the stop ends, and not start")
    for _ in motors.overlaps(ENABLED, (ENABLE, False), (STOP, True)):
        motors.attempt(*wish)
        happened = [f"motors that run got {ENABLE} with data False", f"{STOP} with data True before that was answered"]
        expect_still(motors, [*happened, f"{ENABLE} with data True"], "must stay stopped")
        motors.attempt(STOP, False)
    with on_wrong(alone.leave_as_long):
        if alone.after_silence(KEPT, *STOPS) == ENABLED:
            raise Wrong(
                f"An emergency stop was ended, and nobody asked for anything for {alone.silence:.0f} s: the motors "
                f"must stay disabled, but then {alone.witness} says {quoted(alone.said())}."
            )
    with on_wrong(alone.forget):
        state, said = alone.enable_at_first()
        if state == ENABLED:
            raise Wrong(
                f"When {STOP} with data True was the first command after the start, then {ENABLE} with data True, "
                f"{alone.witness} says {quoted(said)}: the motors must stay stopped, also when nobody has enabled them "
                "before the stop."
            )
    if long_stop and not halted.has_ended:
        wait_until(lambda: halted.has_ended, halted.allow(ended + STAYS - time.monotonic()))
        long_stop.append(f"no other command for {time.monotonic() - ended:.0f} s")
        expect_still(halted, long_stop, "must stay disabled until somebody enables them")
