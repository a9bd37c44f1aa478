"""Rules that hidden tests of the lift hold its programs to; each raises Wrong with a message for the student."""

import re
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise
from statistics import median

from autograder.hidden.actions.busy import BUSY_STEP, Blocking, Busy, Preemption
from autograder.hidden.actions.conversation import SLOW_STEP, STEP, Server, accepted
from autograder.hidden.actions.encounter import SAID, Encounter
from autograder.hidden.actions.rides import (
    STILL,
    Ride,
    counted,
    floors_heard,
    later,
    lengths,
    moves,
    published_later,
    stops_made,
    way,
)
from autograder.sandbox.program import Program
from autograder.suitekit import Crashed, Goal, Heard, Run, TimedOut, Wrong, numbers, on_wrong

# Lines that are no words of the client: logs for which it need not be responsible, and what Python says at its end.
NOT_SAID = r"\[(DEBUG|INFO|WARN|ERROR|FATAL)\]|Exception ignored"
OUTCOMES = {"succe": "SUCCEEDED", "cancel": "CANCELED", "abort": "ABORTED", "reject": "REJECTED"}
WHOLE = 0.9  # of its length that a step must last at least by its publisher's clock, which does not wait for the grader
SHORTEST = 0.6  # of its length that a step must last at least on average
QUIET = 3  # steps until a goal has ended that tells of none
EARLIEST = 0.5  # of a step that must be over when it is told
APART = 0.75  # of its length that a step must last at least between the messages of two goals
UNCUT = 0.8  # of its length that a step has lasted which was not cut by a cancel in its middle
NOTED = 0.1  # s until a server has noted the goal that it has just accepted
IN_TIME = 2  # messages after a request: of the step that was under way, and of one that crossed the request


def expect_in_time(ride: Ride, moment: float, what: str) -> None:
    """The goal must have made no more than the step that was under way."""
    if later(ride.goal, moment) > IN_TIME:
        raise Wrong(f"{what} went on for more than a step: {counted(later(ride.goal, moment))} came after that.")


def expect_no_other_step(goal: Goal, answered: float, what: str) -> None:
    """The goal must have begun no step after its server had answered, at `answered`, what ends it."""
    if answered and published_later(goal, answered) > 1:
        raise Wrong(
            f"{what} the step under way may be finished, and no other begins; "
            f"{counted(published_later(goal, answered))} were published after that."
        )


def expect_over(ride: Ride, moment: float, period: float, what: str) -> None:
    """The goal must have ended within a step of that moment, however: what it is called then is another test's."""
    if ride.end == STILL:
        raise Wrong(f"{what} must end within a step. It was {STILL}.")
    more, after = later(ride.goal, moment), ride.goal.ended - moment
    if more > IN_TIME or (not ride.goal.feedback and after > QUIET * period):
        told = f"{counted(more)} came after that" if more else f"it went on for {after:.1f} s"
        raise Wrong(f"{what} must end within a step; {told} before it ended as {ride.end}.")
    if way(ride.goal)[-1:] == ride.floors[-1:] or (ride.made and not ride.goal.feedback):
        raise Wrong(
            f"{what} must end within a step; it made all its stops, of many steps, and ended as {ride.end}. If "
            "you look "
            "for what ends it, was a thread free to take that in?"
        )


def expect_running(busy: Busy, ride: Ride, running: bool, event: str) -> None:
    """The goal must have run when something happened, or its effect is unknown."""
    if not running:
        raise Wrong(
            f"A goal of many steps must still run after {Busy.STEPS} of them. Before {event}, it "
            f"{busy.how(ride.goal.status)}."
        )


def expect_rejection(server: Server, floors: Sequence[int], about: str) -> None:
    """The goal must be rejected, by a server that accepts others."""
    if not server.accepts:
        accepted(server.send([2]))
    if server.send(floors).accepted:
        raise Wrong(f"{about} must be rejected by a goal_callback; it was accepted.", f"{floors}")


def expect_one_cabin(seen: Preemption) -> None:
    """Two goals must have moved the cabin one after the other: floor by floor, and one step after the other."""
    first, second = (ride.goal for ride in seen.rides[:2])
    heard = [*floors_heard(first), *floors_heard(second)]
    if not second.feedback:
        raise Wrong("No feedback of the goal that took over came, so nothing shows where the cabin was.", f"{heard}")
    # What each goal tells of its own steps is another test's.
    if way(second) and way(first) and abs(second.feedback[0].message.floor - first.feedback[-1].message.floor) != 1:
        raise Wrong(
            "A goal that takes over must go on from where the cabin is, one floor a step, and each step of both goals "
            "must be reported by a feedback message: there is one cabin. The last "
            f"message of the goal before told floor {first.feedback[-1].message.floor}, the first of the new one floor "
            f"{second.feedback[0].message.floor}.",
            f"{heard}",
        )
    between = lengths([*first.feedback[-1:], *second.feedback[:1]])
    own = [*first_step(first), *lengths(first.feedback), *lengths(second.feedback)]
    short = bool(own) and min(own) < WHOLE * BUSY_STEP  # so the time between the two may be that of such a step, too
    if between and (between[0] < 0 or (between[0] < WHOLE * BUSY_STEP and not short)):
        raise Wrong(
            "A goal that takes over must begin its first step when the goal before has ended its last one: two goals "
            f"must never move the cabin at the same time. Where a step takes {BUSY_STEP} s, the last message of one "
            f"and the first of the other were {abs(between[0]):.2f} s apart.",
            f"{between} s apart, steps of {own} s",
        )


def first_step(goal: Goal) -> list[float]:
    """Return the time (s) of the first step of a goal that did not wait, since it was sent; [] without feedback."""
    began = goal.sent + time.time() - time.monotonic()
    return [heard.published - began for heard in goal.feedback[:1]]


def expect_steps_in_turn(first: Ride, second: Ride, back: Goal | None) -> None:
    """Of two goals with long steps, the second must have begun its first step when the first had ended its last.

    The second one's first step may go down, as the goal `back` does, which was sent alone.
    """
    told = [*first.goal.feedback[-1:], *second.goal.feedback[:1]]
    if len(told) < len((first, second)):
        return
    alone = [step for goal in (first.goal, back) if goal for step in first_step(goal)]
    step = min(SLOW_STEP, *alone)  # that it is shorter, another test judges
    if (apart := lengths(told)) and apart[0] < APART * step:
        raise Wrong(
            "A goal that takes over must begin its first step when the goal before has ended its last one, however "
            f"long that takes. Where a step takes {SLOW_STEP} s, the last message of one and the first of the other "
            f"were {apart[0]:.1f} s apart."
        )


def slow_steps(goals: Sequence[Goal]) -> list[float]:
    """Return the times (s) of the steps of goals that moved one after the other, from when the first was sent."""
    began = [goal.sent + time.time() - time.monotonic() for goal in goals[:1]]
    times = [heard.published for goal in goals for heard in goal.feedback]
    return [b - a for a, b in pairwise([*began, *times])]


def expect_slow_steps(goals: Sequence[Goal]) -> None:
    """A step that is longer than the default must take its time, too, and is reported when that is over."""
    took = slow_steps(goals)
    own = [step for goal in goals for step in lengths(goal.feedback)]
    single = [*took[:1], *own]  # between the messages of two goals, a step may be given up
    if single and max(single) < WHOLE * SLOW_STEP:
        raise Wrong(
            "Each step must take step_period seconds, as set on the command line (--ros-args -p step_period:=...). "
            f"They took {max(single):.2f} s at most, where that is {SLOW_STEP} s.",
            f"{took}",
        )
    if took and took[0] < EARLIEST * SLOW_STEP:
        raise Wrong(
            "A step must be reported when its time is over, and the cabin has reached the floor. The first message "
            f"came {took[0]:.2f} s after the goal, when a step takes {SLOW_STEP} s."
        )
    if own and min(own) < EARLIEST * SLOW_STEP:
        raise Wrong(
            "Each step must take step_period seconds, as set on the command line (--ros-args -p step_period:=...), "
            f"also the last one of a goal. One took {min(own):.2f} s, where that is {SLOW_STEP} s.",
            f"{own}",
        )


def expect_whole_or_no_step(cancelled: Goal) -> None:
    """A step with the default period that was under way at a cancel is given up, or told when its time is over.

    The goal was cancelled when PART of that step was over.
    """
    cut = [heard.time > cancelled.cancel_sent for heard in moves(cancelled)]
    took = lengths(cancelled.feedback)
    if cancelled.cancel_sent and sum(cut) == 1 and cut[-1] and took and took[-1] < UNCUT * STEP:
        raise Wrong(
            "A step takes step_period seconds, also when the goal is cancelled in it: then it is finished, and told "
            "when its time is over, or it is given up, and the cabin stays at the floor before. When step_period is "
            f"not set, the step in which the cancel came was told {took[-1]:.2f} s after the one before it."
        )


def expect_taken_over(first: Ride, second: Ride) -> None:
    """A goal that ran must have ended when another one was accepted, though that one was cancelled while it waited."""
    if not first.goal.fault and first.end in (STILL, "SUCCEEDED"):  # that it ends within a step, another test judges
        raise Wrong(
            "A goal that is accepted takes over, also when it is cancelled while it waits: the one that runs must end "
            f"within a step. {counted(later(first.goal, second.goal.answered))} of it came after that."
        )


def expect_no_step_of_its_own(first: Goal, waited: Goal, newest: Goal) -> None:
    """A goal that was replaced must have made no step, when the one before it still moved the cabin then."""
    moved = first.feedback[-1].published if first.feedback else 0.0
    if moved > newest.answered + NOTED + time.time() - time.monotonic() and waited.feedback:
        raise Wrong(
            "A goal that waits for its first step must make none when a new goal is accepted; "
            f"{counted(len(waited.feedback))} of it came."
        )


def expect_no_step_when_cancelled(first: Goal, waited: Goal) -> None:
    """A goal that was cancelled must have made no step, when the one before it still moved the cabin then."""
    if not (waited.cancel_accepted and first.feedback):
        return
    end = first.feedback[-1]
    known = end.published > waited.cancel_answered + NOTED + time.time() - time.monotonic()
    moved = {*floors_heard(waited)} - {end.message.floor}  # one that tells where it begins has not moved so
    if known and moved:
        raise Wrong(
            "A goal that is cancelled while it waits for its first step must make no step: its cancel was accepted "
            "while the goal before it was still moving the cabin. "
            f"{counted(len(waited.feedback))} of it came."
        )


def makes_more_steps(goal: Goal) -> bool:
    """Return True if a goal began a step after its cancel was accepted, which the test of a cancel judges."""
    return bool(goal.cancel_answered) and published_later(goal, goal.cancel_answered) > 1


def expect_turns(seen: Preemption) -> None:
    """Goals must have moved the cabin one after the other, also when one of them was replaced while it waited."""
    told: list[Heard] = []
    for goal in (ride.goal for ride in seen.rides):
        apart = lengths([*told[-1:], *goal.feedback]) if told else []
        begun = seen.rides[0].goal
        own = lengths(begun.feedback)  # that they are shorter, another test judges
        own += [*first_step(begun), *lengths(goal.feedback)] if own else []
        if own and apart and apart[0] < APART * min(BUSY_STEP, *own):
            raise Wrong(
                "Two goals must never move the cabin at the same time, also when three come one upon the other: each "
                f"begins its first step when all before it have ended their last one. Where a step takes {BUSY_STEP} "
                f"s, the last message of one goal and the first of a later one were {abs(apart[0]):.2f} s apart.",
                f"{told}, then {goal.feedback}",
            )
        told += goal.feedback


def expect_arrival(seen: Preemption) -> None:
    """A goal that succeeds must have brought the cabin to its last floor, wherever that was when the goal came."""
    first, second = seen.rides[:2]
    told, last = [*floors_heard(first.goal), *floors_heard(second.goal)], second.floors[-1]
    if not second.goal.accepted or second.end != "SUCCEEDED":
        return
    went = second.goal.feedback and second.goal.result.floor == last  # what each step tells is another test's
    if told and told[-1] != last and not went:
        raise Wrong(
            "A goal that takes over must make its stops from where the cabin is when the goal before has ended. "
            "One that asked for the floor that the cabin was just leaving succeeded, and the cabin had not gone back "
            "there.",
            f"{second.floors}: {told}, {second.goal.result}",
        )


def expect_lengths(told: Sequence[Heard], shortest: float, longest: float, rule: str) -> None:
    """Steps must take at least most of `shortest` s on average, and the fastest one no more than `longest` s."""
    between = lengths(told)
    if between and (sum(between) < SHORTEST * shortest * len(between) or min(between) > longest):
        mean = sum(between) / len(between)
        raise Wrong(f"{rule} They took {mean:.2f} s on average, where that is {shortest:g} s.", f"{between}")


def expect_each_direction(told: Sequence[Heard], period: float, rule: str) -> None:
    """Most steps up, and most steps down, must take most of `period` s."""
    moved = [*told[:1], *(b for a, b in pairwise(told) if a.message.floor != b.message.floor)]
    for name, sign in (("up", 1), ("down", -1)):
        took = [b.published - a.published for a, b in pairwise(moved) if (b.message.floor - a.message.floor) * sign > 0]
        if took and median(took) < SHORTEST * period:
            raise Wrong(f"{rule} Most steps {name} took {median(took):.3f} s or less, where that is {period:g} s.")


def left_elsewhere(seen: Blocking) -> bool:
    """Return True if the next step shows that the cabin was not where the aborted goal left it."""
    heard = way(seen.ride.goal)
    first = floors_heard(seen.freed.goal)[:1]
    return bool(heard and first) and seen.ride.goal.result.floor == heard[-1] and abs(first[0] - heard[-1]) > 1


def says_elsewhere(seen: Blocking) -> bool:
    """Return True if the result of a goal aborted before its first step names a floor that no step led to.

    Results that are empty, also where the goal had a stop without a step to make, name none.
    """
    if seen.away.end != "ABORTED":
        return False
    results = [ride.goal.result for ride in (seen.stuck, seen.away) if ride.goal.status]
    there = {floor for ride in seen.there for floor in ride.floors}
    is_filled = any(result.stops or result.floor for result in results)
    return is_filled and seen.away.goal.result.floor not in {seen.here, *there}


def expect_kept_place(seen: Blocking) -> None:
    """The cabin must stay where it is when its goal is aborted."""
    if left_elsewhere(seen) and not {*floors_heard(seen.stuck.goal)} - {seen.here}:
        raise Wrong(
            "When a goal is aborted, the cabin must keep its place. The goal's last message told floor "
            f"{floors_heard(seen.ride.goal)[-1]}, and the first step of the next goal floor "
            f"{floors_heard(seen.freed.goal)[0]}."
        )


def compared(stops: Sequence[int], right: Sequence[int]) -> str:
    """Return what is wrong with stops, in words for the student that do not tell the floors."""
    if len(stops) != len(right):
        return f"holds {len(stops)}"
    return "holds them in another order" if sorted(stops) == sorted(right) else "holds others"


def expect_so_far(ride: Ride, about: str, place: bool = True) -> None:
    """The result must hold the stops made and, if asked, the floor, as far as the feedback tells what was done."""
    if ride.end in ("SUCCEEDED", STILL):
        how = f"was {STILL}" if ride.still else "succeeded"
        raise Wrong(f"The goal {how}, so there is no result of {about}.")
    goal, floors = ride.goal, ride.floors
    stops, heard = list(goal.result.stops), way(goal)
    # Where it started, one floor above or below the first that was heard, may have been a stop as well.
    paths = [[start, *heard] for start in (heard[0] - 1, heard[0] + 1)] if heard else []
    made = [stops_made(path, floors) for path in paths]
    if heard and not any({*some} <= {*stops} <= {*path} & {*floors} for some, path in zip(made, paths, strict=True)):
        raise Wrong(
            f"`stops` in the result of {about} must hold the floors where the cabin has stopped so far for that goal. "
            f"It holds {len(stops)}; the feedback shows {len(made[0])}.",
            f"{floors}: heard {heard}, got {stops}",
        )
    if place and heard and goal.result.floor != heard[-1]:
        raise Wrong(
            f"`floor` in the result of {about} must say where the cabin is, and each step must be reported by a "
            f"feedback message. `floor` says {goal.result.floor}, and the last feedback told floor {heard[-1]}.",
            f"heard {heard}",
        )


def expect_stuck_result(seen: Blocking) -> None:
    """A goal that was aborted before its first step has made the stop where the cabin stood."""
    ride, result = seen.stuck, seen.stuck.goal.result
    if {*floors_heard(ride.goal)} - {seen.here} or seen.there[0].end != "SUCCEEDED":
        return  # where the cabin stood is not certain
    if (list(result.stops), result.floor) != ([seen.here], seen.here):
        raise Wrong(
            "The result of an aborted goal must say what was done so far, also when that is a stop without a step: one "
            f"stop, at the floor where the cabin stands. It says {len(result.stops)} stops, and floor {result.floor}, "
            f"where the cabin stood at floor {seen.here}.",
            f"{ride.floors}: {result}",
        )


def expect_aborted_results(seen: Blocking) -> bool:
    """The results of goals whose shaft was blocked must say how far they have come; False when there is none."""
    if not seen.running or seen.ride.end != "ABORTED":
        return False
    expect_so_far(seen.ride, "an aborted goal")
    if seen.stuck.end == "ABORTED":
        expect_stuck_result(seen)
    return True


def expect_preempted_result(seen: Preemption) -> bool:
    """The result of a goal that another one took over from must say how far it has come; False when there is none."""
    first, second = seen.rides[:2]
    goes_on = first.end == STILL or later(first.goal, second.goal.answered) > IN_TIME  # that is another test's
    if not seen.running or not second.goal.accepted or goes_on:
        return False
    if first.end != "ABORTED":
        raise Wrong(
            "When a new goal is accepted, the one that runs must end as ABORTED: call goal_handle.abort(). It ended as "
            f"{first.end}."
        )
    expect_so_far(first, "a goal that another one has taken over from", place=False)
    here, heard, after = first.goal.result.floor, way(first.goal), way(second.goal)
    # Its last step may end after its result was made.
    if heard and after and here != heard[-1] and abs(after[0] - here) > 1:
        raise Wrong(
            "`floor` in the result of a goal that another one has taken over from must say where the cabin is. It says "
            f"{here}, and the last feedback told floor {heard[-1]}.",
            f"heard {heard}, got {here}, then {after}",
        )
    return True


def expect_result_of_last_step(busy: Busy, seen: Preemption) -> bool:
    """A goal that was aborted because another one came in its last step must say how far it has come.

    False when it was not: such a goal may still succeed.
    """
    first, second = seen.rides
    told = floors_heard(first.goal)[:1] == first.floors[:1]  # that each step is told, another test judges
    if not (seen.last and told and second.goal.accepted and first.end == "ABORTED"):
        return False
    stops, floor = list(first.goal.result.stops), first.goal.result.floor
    if sorted(stops) not in (first.floors[:1], sorted(first.floors)) or floor not in first.floors:
        raise Wrong(
            "Every result must say what was done so far, also of a goal in whose last step a new goal comes. A goal of "
            "two steps had told of its first stop when another goal was accepted. Its result held "
            f"{counted(len(stops), 'stop')} and floor {floor}, and it {busy.how(first.end)}.",
            f"{first.floors}: {stops}, floor {floor}",
        )
    return True


def expect_waiting_result(seen: Preemption) -> bool:
    """The result of a goal that was aborted while it waited must say so; False when there is none."""
    return expect_result_of_waiting(seen, "ABORTED", "aborted")


def expect_result_of_waiting(seen: Preemption, end: str, how: str) -> bool:
    """The same for a goal that ended as `end` while it waited."""
    if not seen.running or len(seen.rides) < 3 or seen.rides[0].still or seen.rides[1].end != end:
        return False
    first, waited = seen.rides[0].goal, seen.rides[1].goal
    passed = way(first)[Busy.STEPS - 1 :]  # from the floor at which the other goals were sent
    if waited.feedback or not passed:
        return False
    last = [first.result.floor] if first.status else []  # what was told of the last steps may be lost
    near = {place + by for place in (*passed, *last) for by in (-1, 0, 1)}
    after = floors_heard(seen.rides[2].goal)  # it may hear of its end when the newest goal has had the cabin
    stops, floor = list(waited.result.stops), waited.result.floor
    if stops or floor not in near.union(after):
        raise Wrong(
            f"The result of a goal that was {how} while it waited must say that it has stopped nowhere, and where the "
            f"cabin is. It says {len(stops)} stops and floor {floor}, and the cabin was at floor {passed[0]}.",
            f"cabin at {passed}, then at {after}, result {waited.result}",
        )
    return True


def expect_no_floor_twice(goal: Goal, how: str) -> None:
    """No message may tell of the floor that the one before has told of: the cabin has made no step."""
    told = [heard.message.floor for heard in goal.heard]
    if any(a == b for a, b in pairwise(told)):
        raise Wrong(
            "There must be one feedback message for each step of one floor, and no other message. Of a goal that "
            f"{how}, two messages in a row told of the same floor.",
            f"{told}",
        )


def expect_result(program: Program, run: Encounter, how: str) -> None:
    """The client must have printed the result."""
    printed = {*numbers(program.output)}
    if not {*run.result.stops, run.result.floor} <= printed:
        missing = "" if run.result.floor in printed else ", and not the floor"
        shown = (Counter(run.result.stops) & Counter(numbers(program.output))).total()
        did = f"printed {shown} of {len(run.result.stops)} stops{missing}"
        raise Wrong(
            f"The client must print the result, its stops and its floor, however the goal ended. Here it {how}, "
            f"and the client {did if run.result.stops else 'did not print the floor'}.",
            f"sent {run.result}, shown: {program.output}",
        )
    stops = list(run.result.stops)
    told = [number for number in numbers(program.output) if number in stops]
    if stops and not any(told[at : at + len(stops)] == stops for at in range(len(told))):
        twice = ", the first and the last at the same floor," if stops[0] == stops[-1] else ""
        raise Wrong(
            "The client must print all stops of the result in their order, also a floor that comes twice. Here the "
            f"result had {len(stops)} stops{twice} and the client printed them otherwise.",
            f"sent {run.result}, shown: {program.output}",
        )


def expect_outcome(program: Program, word: str, when: str) -> None:
    """The last outcome that the client names must be the one that happened."""
    named = last_outcome(program.output)
    if not named:
        raise Wrong(
            f"{when} the client must print the outcome at the end: here, the word {word}. It printed none of the four.",
            program.output,
        )
    if named != word:
        raise Wrong(f"{when} the last outcome that the client names must be {word}; it was {named}.", program.output)


def last_outcome(output: str) -> str:
    """The last outcome that a client has named, by the word of the task; empty when it has named none."""
    named = re.findall("|".join(OUTCOMES), output, re.IGNORECASE)
    return OUTCOMES[named[-1].lower()] if named else ""


def expect_word(program: Program, run: Encounter, when: str) -> None:
    """The client must print the outcome by the word of the task, wherever it stands; it has named it somehow."""
    if run.end not in program.output.upper():
        line = next(
            line for line in reversed(program.output.splitlines()) if re.search("|".join(OUTCOMES), line.lower())
        )
        raise Wrong(
            f"{when} the client must print the outcome by the word {run.end}, spelled so. It printed "
            f"{run.excerpt(line)[:SAID]!r}.",
            program.output,
        )


def expect_outcome_last(program: Program, run: Encounter, when: str) -> None:
    """The client must name one outcome in its last line, and print nothing of its own after it."""
    lines = [line for line in program.output.splitlines() if line.strip()]
    at = max(number for number, line in enumerate(lines) if re.search("|".join(OUTCOMES), line, re.IGNORECASE))
    if len(named := {*re.findall(r"\b(?:SUCCEEDED|CANCELED|ABORTED|REJECTED)\b", lines[at])}) > 1:
        raise Wrong(
            f"{when} the last line of the client must name one outcome; it named {len(named)}: "
            f"{run.excerpt(lines[at])[:SAID]!r}.",
            program.output,
        )
    if at + 1 < len(lines) and not re.match(NOT_SAID, lines[at + 1]):
        raise Wrong(
            f"{when} the outcome must be in the last line that the client prints. After it, it printed "
            f"{run.excerpt(lines[at + 1])[:SAID]!r}.",
            program.output,
        )


def expect_no_result(run: Encounter, succeeded: Encounter) -> None:
    """Of a goal that was rejected, the client must print nothing like the lines with the result of one that was not.

    The grader's goal that is rejected is not for floor 0, so a 0 in such a line, where there was none in that of the
    other goal, is the floor of an empty result.
    """
    with succeeded.judged() as program:
        lines = program.output.splitlines()
        told = [words(line) for line in lines if succeeded.result.floor in numbers(line) and 0 not in numbers(line)]
    with run.judged() as program:
        for line in program.output.splitlines():
            if 0 in numbers(line) and words(line) and words(line) in told:
                raise Wrong(
                    "A goal that is rejected has no result, so the client must print none. It printed "
                    f"{run.excerpt(line)[:SAID]!r}, and the like for the result of a goal that succeeded.",
                    program.output,
                )


def words(line: str) -> list[str]:
    """The words of a line, without those for an outcome."""
    found: list[str] = re.findall(r"[^\W\d_]+", line.lower())
    return [word for word in found if not word.startswith(tuple(OUTCOMES))]


def expect_status(run: Encounter, when: str) -> None:
    """The client must tell with its exit status whether the goal succeeded; another crash is another test's."""
    try:
        with run.judged() as program:
            succeeded = run.end == "SUCCEEDED"
            if succeeded and program.exit_status:
                raise Wrong(
                    f"{when} the client must end with exit status 0; it ended with {program.last_words()}.",
                    program.output,
                )
            if not succeeded and program.exit_status == 0:
                raise Wrong(f"{when} the client must end with an exit status other than 0: sys.exit(1).")
    except (Crashed, TimedOut):
        if run.end == "SUCCEEDED":
            raise


def expect_for_ros(run: Run) -> None:
    """The client must leave alone what is meant for ROS, and do its work."""
    doing = "with a floor, arguments for ROS behind it (--ros-args ...) and a server"
    program = run.finish(doing)
    if program.exit_status:
        raise Wrong(
            f"Run {doing}, the client ended with {program.last_words()}: it must leave out the arguments "
            "that are meant for ROS, as remove_ros_args does.",
            program.output,
        )


def expect_able(clients: Mapping[str, Encounter]) -> None:
    """The client must do something of its task, or its errors say nothing."""
    run = clients["succeed"]
    with on_wrong(run.again):
        if not run.works():
            raise Wrong(
                "This is judged only of a client that, called rightly, sends its goal and prints something of what "
                "comes back, or ends with exit status 0."
            )
