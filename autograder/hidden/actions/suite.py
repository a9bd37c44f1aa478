"""What the lift of section 3.2 must do, as a conversation with the student's server and client.

Points add up to 20.  The message of a failure speaks of the task; the numbers that were drawn stay with the grader.
"""

import random
import re
from collections.abc import Mapping, Sequence
from itertools import pairwise

from autograder.hidden.actions.conversation import (
    ACTION,
    BLOCK,
    BUSY_STEP,
    NOT_ACCEPTED,
    OFFERED,
    STEP,
    STILL,
    TOP,
    Busy,
    Cancelled,
    Encounter,
    Quick,
    Ride,
    Server,
    accepted,
    floors_heard,
    later,
    steps,
    stops_made,
    way,
)
from autograder.sandbox.program import Program
from autograder.suitekit import Bench, Goal, Run, Wrong, expect_gives_up, expect_usage, numbers, points, twice

OUTCOMES = {"succe": "SUCCEEDED", "cancel": "CANCELED", "abort": "ABORTED", "reject": "REJECTED"}
WHOLE = 0.9  # of its length that a step must last at least by its publisher's clock, which does not wait for the grader
MEASURED = 0.6  # of its right length that a step must last at least
IN_TIME = 2  # messages after a request: of the step that was under way, and of one that crossed the request


@points(1, cell="lift-server")
@twice
def test_ride(quick: Quick) -> None:
    """A goal succeeds when all its stops are made, in their order."""
    with quick.sample() as ride:
        expect_end(ride.end, "SUCCEEDED", "Once all stops are made, the goal must succeed: goal_handle.succeed().")
        stops, floor = list(ride.goal.result.stops), ride.goal.result.floor
        if stops != ride.floors:
            raise Wrong(
                "The result of a goal that succeeds must hold its floors in `stops`, in the order of the goal.",
                f"{ride.floors}: {stops}",
            )
        if floor != ride.floors[-1]:
            raise Wrong("`floor` of the result must say where the cabin is at the end.", f"{ride.floors}: {floor}")


@points(1, cell="lift-server")
@twice
def test_feedback(quick: Quick) -> None:
    """Each step of one floor is reported, with the floor and the stops that are left."""
    with quick.sample() as ride:
        heard = [(heard.message.floor, heard.message.stops_left) for heard in ride.goal.feedback]
        if not heard:
            raise Wrong("The goal published no feedback: call goal_handle.publish_feedback(...) for each step.")
        ways = [steps(start, ride.floors) for start in range(quick.top + 1)]  # where it starts is another test's
        if [floor for floor, _ in heard] not in [[floor for floor, _ in way] for way in ways]:
            raise Wrong(
                "There must be one feedback message for each step of one floor, with the floor where the cabin is "
                "then, all the way to each stop; and no other message.",
                f"{ride.floors}: {heard}",
            )
        if heard not in ways:
            raise Wrong(
                "`stops_left` of the feedback must count the stops still to make: one that this step has reached is "
                "made.",
                f"{ride.floors}: {heard}",
            )


@points(1, cell="lift-server")
@twice
def test_keeps_its_place(quick: Quick, rng: random.Random) -> None:
    """The cabin starts at floor 0, and each goal goes on from where it is."""
    with quick.sample() as ride:
        heard = way(ride.goal)
        if heard and heard[0] not in (0, 1):  # what is told of the first step is another test's
            raise Wrong("The cabin must start at floor 0.", f"{heard}")
    here, there = rng.randrange(6, 9), rng.randrange(2, 5)
    quick.run([here])
    heard = way(quick.run([there]))
    if heard and heard[0] not in (here, here - 1):
        raise Wrong("A goal must go on from the floor where the cabin is.", f"from {here} to {there}: {heard}")
    goal = quick.run([there, there])
    if goal.feedback or goal.status != "SUCCEEDED" or list(goal.result.stops) != [there, there]:
        raise Wrong(
            "A floor that is next in `floors` and where the cabin stands must be a stop at once, without a step, each "
            "time that it is next.",
            f"{there} twice, standing there: {goal.status} {goal.result} {floors_heard(goal)}",
        )


@points(1, cell="lift-server")
@twice
def test_cancel(cancelled: Cancelled) -> None:
    """A goal is cancelled within a step, and ends as CANCELED."""
    with cancelled.sample() as goal:
        if goal.cancel_accepted is False and goal.status != "CANCELED":
            raise Wrong(
                "The request to cancel was refused. A cancel_callback must accept it while the goal runs: if you have "
                "one, was a thread free to run it?"
            )
        expect_end(goal.status, "CANCELED", "A cancelled goal must end as CANCELED: call goal_handle.canceled().")
        if not goal.cancel_sent:
            raise Wrong(f"The goal was over after {cancelled.STEPS} steps, before it could be cancelled.")
        if later(goal, goal.cancel_sent) > IN_TIME or (not goal.feedback and goal.ended - goal.cancel_sent > 3 * STEP):
            raise Wrong(
                "After the cancel was accepted, the goal went on for more than a step.",
                f"{later(goal, goal.cancel_sent)} more messages, ended {goal.ended - goal.cancel_sent} s later",
            )


@points(1, cell="lift-server")
@twice
def test_cancelled_result(cancelled: Cancelled) -> None:
    """The result of a cancelled goal is what was done so far, and the cabin stays where it is."""
    with cancelled.sample() as goal:
        expect_so_far(Ride(cancelled.floors, goal), "a cancelled goal")
        place = goal.result.floor
        if floors_heard(cancelled.run([place])):
            raise Wrong(
                "After a cancel the cabin must stay where it is; the next goal found it elsewhere.", f"not at {place}"
            )


@points(1, cell="lift-server")
@twice
def test_rejects(quick: Quick, cancelled: Cancelled, rng: random.Random) -> None:
    """A goal without floors, or with a floor outside 0 to top, is rejected; the parameter top counts, by default 9."""
    expect_rejection(quick, [], "A goal without floors")
    for floors in ([-1], [3, -rng.randrange(2, 50)]):
        expect_rejection(quick, floors, "A goal with a floor below 0")
    for floors in ([quick.top + 1], [0, quick.top + rng.randrange(2, 50), 1]):
        expect_rejection(quick, floors, "A goal with a floor above `top`, as set on the command line,")
    if list(quick.run([quick.top]).result.stops) == []:
        raise Wrong("The lift must reach the floor `top`, as set on the command line.")
    with cancelled.sample():
        expect_rejection(cancelled, [TOP + 1], f"When top is not set, a goal with a floor above {TOP}")
        accepted(cancelled.send([TOP]))


def expect_rejection(server: Server, floors: Sequence[int], about: str) -> None:
    """The goal must be rejected, by a server that accepts others."""
    if not server.accepts:
        accepted(server.send([2]))
    if server.send(floors).accepted:
        raise Wrong(f"{about} must be rejected by a goal_callback; it was accepted.", f"{floors}")


@points(2, cell="lift-server")
@twice
def test_preempt(busy: Busy) -> None:
    """A new goal takes over: the one that runs is aborted within a step, and the cabin goes on from where it is."""
    with busy.preemption() as seen:
        first, second = seen.first.goal, seen.second.goal
        if not second.accepted:
            raise Wrong("While a goal runs, a new one must be accepted.")
        expect_end(seen.first.end, "ABORTED", "When a new goal is accepted, the one that runs must end as ABORTED.")
        expect_end(second.status, "SUCCEEDED", "A goal that takes over must be worked on, and succeed.")
        if later(first, second.sent) > IN_TIME:
            raise Wrong(
                "When a new goal was accepted, the one that ran went on for more than a step.",
                f"{later(first, second.sent)} more messages",
            )
        if list(second.result.stops) != seen.second.floors:
            raise Wrong("A goal that takes over must make its stops.", f"{seen.second.floors}: {second.result}")
        expect_one_cabin(first, second)
        expect_so_far(seen.first, "a goal that another one has taken over from", place=False)


def expect_one_cabin(first: Goal, second: Goal) -> None:
    """Two goals must have moved the cabin one after the other: floor by floor, and one step after the other."""
    if not (way(first) and way(second)):
        return  # what is told of the steps is another test's
    path = [*way(first), *way(second)]
    if any(abs(a - b) != 1 for a, b in pairwise(path)):
        raise Wrong(
            "A goal that takes over must go on from where the cabin is, one floor a step: there is one cabin.",
            f"{path}",
        )
    told = [heard.published for heard in [*first.feedback, *second.feedback]]
    between = [b - a for a, b in pairwise(told)]
    if min(between) < WHOLE * BUSY_STEP < max(between):
        raise Wrong(
            "A goal that takes over must begin its first step when the goal before has ended its last one: two goals "
            "must never move the cabin at the same time.",
            f"steps of {between} s",
        )


@points(1, cell="lift-server")
@twice
def test_rejected_goal_changes_nothing(busy: Busy) -> None:
    """A rejected goal preempts nobody."""
    impossible = next((floors for floors in ([TOP + 1], [-1], []) if not busy.send(floors).accepted), None)
    if impossible is None:
        raise Wrong("A goal that cannot be reached must be rejected; it was accepted.")
    goal = busy.converse(lambda limit, alive: busy.begin_long(alive, limit), "a goal", OFFERED).goal
    if goal.status or busy.send(impossible).accepted:
        raise Wrong("While a goal of many steps runs, one that cannot be reached must be rejected.", goal.status)
    before = len(goal.feedback)
    goal.wait(lambda g: g.status or len(g.feedback) >= before + 3, busy.bench.clock.allow(10 * STEP))
    if goal.status not in ("", "SUCCEEDED"):
        raise Wrong(f"When a new goal is rejected, the one that runs must go on. It ended as {goal.status}.")
    goal.cancel()
    goal.wait(lambda g: g.status, 3 * STEP)  # the next test has the lift for itself


@points(1, cell="lift-server")
@twice
def test_blocked(busy: Busy) -> None:
    """When the shaft is blocked while a goal runs, the goal is aborted within a step."""
    with busy.blocking() as seen:
        expect_end(
            seen.ride.end,
            "ABORTED",
            f"A goal that runs while {BLOCK} gets `data: true` must end as ABORTED: call goal_handle.abort(). If you "
            "do, was a thread free to answer the service?",
        )
        if not seen.success:
            raise Wrong(f"{BLOCK} must answer with `success` true.")
        if later(seen.ride.goal, seen.sent) > IN_TIME:
            raise Wrong(
                "When the shaft was blocked, the goal went on for more than a step.",
                f"{later(seen.ride.goal, seen.sent)} more messages",
            )


@points(1, cell="lift-server")
@twice
def test_aborted_result(busy: Busy) -> None:
    """The result of an aborted goal is what was done so far."""
    with busy.blocking() as seen:
        expect_so_far(seen.ride, "an aborted goal")


@points(1, cell="lift-server")
@twice
def test_blocked_before(busy: Busy) -> None:
    """A goal that comes while the shaft is blocked makes no step and is aborted; a free shaft serves the next one."""
    with busy.blocking() as seen:
        stuck, freed = seen.stuck, seen.freed
        if not stuck.goal.accepted:
            raise Wrong("While the shaft is blocked, a goal must be accepted. It is aborted when it needs a step.")
        expect_end(stuck.end, "ABORTED", "While the shaft is blocked, a goal that needs a step must end as ABORTED.")
        if {*floors_heard(stuck.goal)} - {seen.here}:
            raise Wrong("While the shaft is blocked, the cabin must not move.", f"{floors_heard(stuck.goal)}")
        if not freed.accepted:
            raise Wrong(NOT_ACCEPTED)
        expect_end(freed.status, "SUCCEEDED", f"After {BLOCK} got `data: false`, a goal must succeed.")


def expect_end(end: str, status: str, rule: str) -> None:
    """The goal must have ended so."""
    if end != status:
        raise Wrong(f"{rule} It {'was' if end == STILL else 'ended as'} {end}.")


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
            f"`stops` in the result of {about} must hold the floors where the cabin has stopped so far for that goal.",
            f"{floors}: heard {heard}, got {stops}",
        )
    if place and heard and goal.result.floor != heard[-1]:
        raise Wrong(
            f"`floor` in the result of {about} must say where the cabin is.", f"heard {heard}, got {goal.result.floor}"
        )


@points(1, cell="lift-server")
@twice
def test_step_period(quick: Quick, cancelled: Cancelled) -> None:
    """The parameter step_period says how long a step takes, by default 1 s."""
    with quick.sample() as ride:
        count = len(ride.goal.feedback) or len(steps(ride.floors[0], ride.floors))
        took, right = ride.goal.ended - ride.goal.sent, count * quick.period
        if not MEASURED * right < took < right + 0.5 * count * (STEP - quick.period):
            raise Wrong(
                "Each step must take step_period seconds, as set on the command line (--ros-args -p step_period:=...).",
                f"took {took} s, expected {right} s",
            )
    with cancelled.sample() as goal:
        times = [heard.time for heard in goal.feedback]
        took = max((b - a for a, b in pairwise(times)), default=STEP)  # a message may be heard late
        if not MEASURED * STEP < took < 3 * STEP:
            raise Wrong(f"When step_period is not set, each step must take {STEP:.0f} s.", f"{times}")


@points(1, cell="lift-client")
@twice
def test_client_shows_feedback(clients: Mapping[str, Encounter]) -> None:
    """The client sends the floors, and prints each feedback message as it comes."""
    with clients["succeed"].judged("with a server that succeeds") as program:
        run = clients["succeed"]
        if run.goals[0] != run.floors:
            raise Wrong(
                "The client's goal must hold the floors from its command line, in their order.",
                f"sent {run.goals}, not {run.floors}",
            )
        if run.missing(program.output):
            raise Wrong(
                "The client must print each feedback message, its floor and its stops_left.",
                f"sent {run.feedback}, shown: {program.output}",
            )
        if not run.shown:
            raise Wrong("The client must print each feedback message as it comes, not when the goal is over.")


@points(1, cell="lift-client")
@twice
def test_client_shows_result(clients: Mapping[str, Encounter]) -> None:
    """When the goal succeeds, the client prints the result and the outcome, and exits with 0."""
    with clients["succeed"].judged("with a server that succeeds") as program:
        expect_result(program, clients["succeed"], "succeeded")
        expect_outcome(program, "SUCCEEDED")
        if program.exit_status:
            raise Wrong(
                "When the goal has succeeded, the client must end with exit status 0; it ended with "
                f"{program.last_words()}.",
                program.output,
            )


@points(1, cell="lift-client")
@twice
def test_client_rejected(clients: Mapping[str, Encounter]) -> None:
    """When the goal is rejected, the client says so, and exits with another status than 0."""
    with clients["reject"].judged("with a server that rejects the goal") as program:
        expect_outcome(program, "REJECTED")
        expect_failure(program, "is rejected")


@points(1, cell="lift-client")
@twice
def test_client_aborted(clients: Mapping[str, Encounter]) -> None:
    """When the goal is aborted, the client prints the result and says so, and exits with another status than 0."""
    with clients["abort"].judged("with a server that aborts the goal") as program:
        expect_result(program, clients["abort"], "was aborted")
        expect_outcome(program, "ABORTED")
        expect_failure(program, "is aborted")


@points(1, cell="lift-client")
@twice
def test_client_cancels(clients: Mapping[str, Encounter]) -> None:
    """With --cancel-after N the client cancels after N feedback messages."""
    with clients["cancel"].judged("with --cancel-after") as program:
        run = clients["cancel"]
        if run.before_cancel is None:
            raise Wrong("With --cancel-after N, the client did not cancel its goal.", program.output)
        if run.before_cancel != run.cancel_after:
            when = "earlier" if run.before_cancel < run.cancel_after else "later"
            raise Wrong(
                f"With --cancel-after N, the client must cancel after N feedback messages; it did {when}.",
                f"N={run.cancel_after}, after {run.before_cancel}",
            )
        expect_result(program, run, "was cancelled")
        expect_outcome(program, "CANCELED")
        expect_failure(program, "is cancelled")


def expect_result(program: Program, run: Encounter, how: str) -> None:
    """The client must have printed the result."""
    if not {*run.result.stops, run.result.floor} <= set(numbers(program.output)):
        raise Wrong(
            f"The client must print the result, its stops and its floor, however the goal ended; here it {how}.",
            f"sent {run.result}, shown: {program.output}",
        )


def expect_outcome(program: Program, word: str) -> None:
    """The last outcome that the client names must be the one that happened."""
    named = re.findall("|".join(OUTCOMES), program.output, re.IGNORECASE)
    if not named:
        raise Wrong(f"At the end the client must print the outcome: here, the word {word}.", program.output)
    if OUTCOMES[named[-1].lower()] != word:
        raise Wrong(
            f"The last outcome that the client names must be the one that happened: here, {word}.", program.output
        )


def expect_failure(program: Program, how: str) -> None:
    """The client must report with its exit status that the goal did not succeed."""
    if program.exit_status == 0:
        raise Wrong(f"When the goal {how}, the client must end with an exit status other than 0: sys.exit(1).")


@points(1, cell="lift-client")
def test_client_without_server(bench: Bench) -> None:
    """Without a server the client gives up within 10 s, and says so."""
    expect_gives_up(bench.early["absent"], ACTION)


@points(1, cell="lift-client")
def test_client_arguments(misused: Mapping[str, Run]) -> None:
    """With wrong arguments the client prints how to use it."""
    for doing, run in misused.items():
        expect_usage(run, doing)
