"""What the lift of section 3.2 must do, as a conversation with the student's server and client.

Points add up to 20.  The message of a failure speaks of the task; the numbers that were drawn stay with the grader.
"""

import random
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from itertools import groupby
from typing import Any

from autograder.errors import Fault
from autograder.hidden.actions.busy import AT_MOST, LOW_TOP, SOON, Busy, ended
from autograder.hidden.actions.conversation import (
    ACTION,
    BLOCK,
    NOT_ACCEPTED,
    OFFERED,
    STEP,
    TOP,
    Cancelled,
    Quick,
    accepted,
)
from autograder.hidden.actions.encounter import Encounter
from autograder.hidden.actions.judging import (
    IN_TIME,
    SHORTEST,
    expect_able,
    expect_aborted_results,
    expect_arrival,
    expect_in_time,
    expect_lengths,
    expect_one_cabin,
    expect_outcome,
    expect_preempted_result,
    expect_rejection,
    expect_result,
    expect_running,
    expect_so_far,
    expect_status,
    expect_waiting_result,
)
from autograder.hidden.actions.rides import Ride, floors_heard, follows, later, steps, way
from autograder.suitekit import (
    Bench,
    Crashed,
    Run,
    TimedOut,
    Wrong,
    expect_gives_up,
    expect_usage,
    numbers,
    points,
    twice,
)

SLOWER = 0.06  # s that the fastest of many short steps may take longer than step_period
WHEN = {
    "succeed": "When the goal has succeeded,",
    "reject": "When the goal is rejected,",
    "abort": "When the goal is aborted,",
    "cancel": "When the goal is cancelled,",
    "late": "When a goal that the client has cancelled succeeds all the same,",
    "few": "When a goal succeeds before the client has received N feedback messages,",
}


@points(1, cell="lift-server")
@twice
def test_ride(quick: Quick) -> None:
    """A goal succeeds when all its stops are made, in their order."""
    with quick.sample() as ride:
        ended(ride, "SUCCEEDED", "Once all stops are made, the goal must succeed: goal_handle.succeed().", quick)
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


@points(0.5, cell="lift-server")
@twice
def test_keeps_its_place(quick: Quick, rng: random.Random) -> None:
    """The cabin starts at floor 0, and each goal goes on from where it is."""
    with quick.sample() as ride:
        heard = way(ride.goal)
        if heard and heard[0] not in (0, 1):  # what is told of the first step is another test's
            raise Wrong("The cabin must start at floor 0.", f"{heard}")
    here, there = rng.randrange(6, 9), rng.randrange(2, 5)
    quick.run([here])
    starts, goal = quick.starts, quick.run([there])
    if goal.fault and quick.starts > starts:  # it has begun at floor 0 again
        raise goal.fault
    if not goal.feedback:
        raise Wrong("No feedback of the goal came, so nothing shows where the cabin was.")
    heard = way(goal)
    if heard and heard[0] not in (here, here - 1):
        raise Wrong("A goal must go on from the floor where the cabin is.", f"from {here} to {there}: {heard}")


@points(0.5, cell="lift-server")
@twice
def test_stops_where_it_stands(quick: Quick, rng: random.Random) -> None:
    """A floor that is next and where the cabin stands is a stop at once, without a step."""
    there = rng.randrange(3, 6)
    quick.run([0])
    for floors, count in (([0, 0], 0), ([there, there], there)):  # it begins the second one at floor 0, too
        goal = quick.run(floors)
        if goal.fault:
            raise goal.fault
        moves = len([*groupby(floors_heard(goal))])  # what else is told of it is another test's
        if moves > count or list(goal.result.stops) != floors:
            raise Wrong(
                "A floor that is next in `floors` and where the cabin stands must be a stop at once, without a step "
                "and without feedback, each time that it is next.",
                f"{floors} from floor 0: {goal.status} {goal.result} {floors_heard(goal)}",
            )


@points(1, cell="lift-server")
@twice
def test_cancel(cancelled: Cancelled) -> None:
    """A goal is cancelled within a step, and ends as CANCELED."""
    with cancelled.sample() as goal:
        if not goal.cancel_sent:
            raise Wrong(
                f"A goal of many steps was over after {cancelled.STEPS} of them at most, before it could be cancelled. "
                f"It {cancelled.how(goal.status)}."
            )
        if goal.cancel_accepted is False and goal.status != "CANCELED":
            raise Wrong(
                "The request to cancel was refused. A cancel_callback must accept it while the goal runs: if you have "
                "one, was a thread free to run it?"
            )
        rule = "A cancelled goal must end as CANCELED: call goal_handle.canceled()."
        ended(Ride(cancelled.floors, goal), "CANCELED", rule, cancelled)
        if later(goal, goal.cancel_sent) > IN_TIME or (not goal.feedback and goal.ended - goal.cancel_sent > 3 * STEP):
            raise Wrong(
                "After the cancel was accepted, the goal went on for more than a step.",
                f"{later(goal, goal.cancel_sent)} more messages, ended {goal.ended - goal.cancel_sent} s later",
            )


@points(0.5, cell="lift-server")
@twice
def test_cancelled_result(cancelled: Cancelled) -> None:
    """The result of a cancelled goal is what was done so far, and the cabin stays where it is."""
    with cancelled.sample() as goal:
        if not goal.cancel_sent:
            raise Wrong("The goal was over before it could be cancelled, so there is no result of a cancelled goal.")
        expect_so_far(Ride(cancelled.floors, goal), "a cancelled goal")
        place = goal.result.floor
        if floors_heard(cancelled.run([place])):
            raise Wrong(
                "After a cancel the cabin must stay where it is; the next goal found it elsewhere.", f"not at {place}"
            )


@points(0.5, cell="lift-server")
@twice
def test_cancel_while_waiting(busy: Busy, cancelled: Cancelled) -> None:
    """A goal can be cancelled while it waits for the one that runs, and the next goal is served."""
    with busy.cancelled() as seen:
        first, second, *others = seen.rides
        expect_running(busy, first, seen.running, "another one was sent")
        if not second.goal.accepted:
            raise Wrong("While a goal runs, a new one must be accepted; so nothing could be cancelled.")
        if second.goal.cancel_accepted is False and second.end != "CANCELED":
            raise Wrong(
                "The request to cancel a goal was refused while that goal waited for the one that ran. A "
                "cancel_callback must accept every request."
            )
        if second.end not in ("CANCELED", cancelled.usual_end) or second.end == "SUCCEEDED":
            ended(second, "CANCELED", "A goal that is cancelled while it waits must end as CANCELED.", busy)
        expect_in_time(second, second.goal.cancel_sent, "After the cancel was accepted, a goal that waited")
        if not accepted(others[0].goal).feedback and others[0].goal.result.floor != others[0].floors[-1]:
            raise Wrong("After a cancel, the next goal must be worked on.", f"{others[0].floors}: {others[0].end}")


@points(1, cell="lift-server")
@twice
def test_rejects(quick: Quick, busy: Busy, cancelled: Cancelled, rng: random.Random) -> None:
    """A goal without floors, or with a floor outside 0 to top, is rejected; the parameter top counts, by default 9."""
    expect_rejection(quick, [], "A goal without floors")
    for floors in ([-1], [3, -rng.randrange(2, 50)]):
        expect_rejection(quick, floors, "A goal with a floor below 0")
    for floors in ([quick.top + 1], [0, quick.top + rng.randrange(2, 50), 1]):
        expect_rejection(quick, floors, "A goal with a floor above `top`, as set on the command line,")
    accepted(quick.send([quick.top]))
    expect_rejection(busy, [LOW_TOP + 1], f"With `top` less than {TOP}, a goal with a floor above it")
    cancelled.join()
    expect_rejection(cancelled, [TOP + 1], f"When top is not set, a goal with a floor above {TOP}")
    accepted(cancelled.send([TOP]))


@points(1, cell="lift-server")
@twice
def test_rejected_goal_changes_nothing(busy: Busy) -> None:
    """A rejected goal preempts nobody."""
    impossible = [floors for floors in ([TOP + 1], [-1], []) if not busy.send(floors).accepted]
    if not impossible:
        raise Wrong("A goal that cannot be reached must be rejected; it was accepted.")
    ride = busy.converse(lambda limit, alive: busy.begin_long(alive, limit), "a goal", OFFERED)
    goal = ride.goal
    proper = len(goal.feedback) >= busy.STEPS and follows(goal, ride.floors, TOP)  # it tells of each floor
    expect_running(busy, ride, not goal.status, "another one was rejected")
    if fault := busy.hangs(goal):
        busy.end()
        raise fault
    if any(busy.send(floors).accepted for floors in impossible):
        raise Wrong("While a goal of many steps runs, one that cannot be reached must be rejected.", goal.status)
    before = len(goal.feedback)
    goal.wait(lambda g: g.status or len(g.feedback) >= before + 3, busy.bench.clock.allow(10 * STEP))
    if goal.status not in ("", "SUCCEEDED"):
        raise Wrong(f"When a new goal is rejected, the one that runs must go on. It ended as {goal.status}.")
    if not goal.status and len(goal.feedback) <= before:
        raise Wrong("When a new goal is rejected, the one that runs must go on. Nothing more was heard of it.")
    if proper and not follows(goal, ride.floors, TOP):
        raise Wrong(
            "When a new goal is rejected, the one that runs must go on from where the cabin is, floor by floor.",
            f"{ride.floors}: {floors_heard(goal)}",
        )
    busy.over(goal, ride.floors, AT_MOST)  # the next test has the lift for itself


@points(1, cell="lift-server")
@twice
def test_preempt(busy: Busy, quick: Quick) -> None:
    """A new goal takes over: the one that runs is aborted within a step, and the new one makes its stops."""
    with busy.preemption() as seen:
        first, second = seen.rides
        expect_running(busy, first, seen.running, "a new one came")
        if not second.goal.accepted:
            raise Wrong("While a goal runs, a new one must be accepted.")
        ended(first, "ABORTED", "When a new goal is accepted, the one that runs must end as ABORTED.", busy)
        expect_in_time(first, second.goal.answered, "When a new goal was accepted, the one that ran")
        if not quick.ends_well(second):
            ended(second, "SUCCEEDED", "A goal that takes over must be worked on, and succeed.", busy)
        if not second.made:
            raise Wrong("A goal that takes over must make its stops.", f"{second.floors}: {second.goal.result}")


@points(0.5, cell="lift-server")
@twice
def test_one_cabin(busy: Busy) -> None:
    """A goal that takes over goes on from where the cabin is, and two goals never move it at the same time."""
    with busy.preemption() as seen:
        expect_running(busy, seen.rides[0], seen.running, "a new one came")
        if not seen.rides[1].goal.accepted:
            raise Wrong("While a goal runs, a new one must be accepted.")
        expect_one_cabin(seen)
    with busy.leaving() as seen:
        expect_running(busy, seen.rides[0], seen.running, "a new one came")
        expect_arrival(seen)


@points(0.5, cell="lift-server")
@twice
def test_preempt_waiting(busy: Busy, quick: Quick) -> None:
    """A new goal takes over from a goal that still waits, too; it may ask for the same floors."""
    with busy.three() as seen:
        expect_running(busy, seen.rides[0], seen.running, "a new one came")
        if not all(ride.goal.accepted for ride in seen.rides):
            raise Wrong("While a goal runs and another one waits, a new one must be accepted.")
        _, second, third = seen.rides
        rule = "When a new goal is accepted, one that waits must end as ABORTED, also when both ask for the same."
        ended(second, "ABORTED", rule, busy)
        expect_in_time(second, third.goal.answered, "When a new goal was accepted, one that waited")
        if not quick.ends_well(third):
            ended(third, "SUCCEEDED", "The goal that came last must be worked on, and succeed.", busy)


@points(0.5, cell="lift-server")
@twice
def test_blocked(busy: Busy) -> None:
    """When the shaft is blocked while a goal runs, the goal is aborted within a step."""
    with busy.blocking() as seen:
        expect_running(busy, seen.ride, seen.running, "the shaft was blocked")
        rule = (
            f"A goal that runs while {BLOCK} gets `data: true` must end as ABORTED: call goal_handle.abort(). If you "
            "do, was a thread free to answer the service?"
        )
        ended(seen.ride, "ABORTED", rule, busy)
        expect_in_time(seen.ride, seen.sent, "When the shaft was blocked, the goal")


@points(0.5, cell="lift-server")
@twice
def test_block_is_answered(busy: Busy) -> None:
    """The service that blocks the shaft answers at once with success, also while a goal runs."""
    with busy.asked() as seen:
        if not seen.took:
            raise Wrong(
                f"A goal of many steps was over before {BLOCK} could be asked. It {busy.how(seen.goal.status)}."
            )
        if min(seen.took) > SOON:
            raise Wrong(
                f"{BLOCK} must answer at once, also while a goal runs; it answered only after a step, each time. Does "
                "its callback wait for something, or was no thread free?",
                f"{seen.took} s",
            )
        if not all(seen.success):
            raise Wrong(f"{BLOCK} must answer with `success` true, to `data: true` and to `data: false`, each time.")


@points(0.5, cell="lift-server")
@twice
def test_blocked_before(busy: Busy, quick: Quick) -> None:
    """A goal that comes while the shaft is blocked makes no step and is aborted; a free shaft serves the next one."""
    with busy.blocking() as seen:
        stuck, freed = seen.stuck, seen.freed
        if not stuck.goal.accepted:
            raise Wrong("While the shaft is blocked, a goal must be accepted. It is aborted when it needs a step.")
        rule = "While the shaft is blocked, a goal that needs a step must end as ABORTED."
        ended(stuck, "ABORTED", rule, busy)
        if {*floors_heard(stuck.goal)} - {seen.here}:
            raise Wrong("While the shaft is blocked, the cabin must not move.", f"{floors_heard(stuck.goal)}")
        if not freed.goal.accepted:
            raise Wrong(NOT_ACCEPTED)
        if not quick.ends_well(freed):
            ended(freed, "SUCCEEDED", f"After {BLOCK} got `data: false`, a goal must succeed.", busy)
    with busy.asked() as asked:
        if asked.freed == "ABORTED":
            raise Wrong(
                f"`data: false` must free the shaft, and leave it free when it was free before. After {BLOCK} got it "
                f"while the shaft was free, the goal that ran {busy.how(asked.freed)}."
            )


@points(0.5, cell="lift-server")
@twice
def test_stops_while_blocked(busy: Busy, quick: Quick) -> None:
    """While the shaft is blocked, a goal that needs no step succeeds."""
    with busy.blocking() as seen:
        if "ABORTED" not in (seen.ride.end, seen.stuck.end):
            raise Wrong("This is judged only of a lift that aborts a goal because the shaft is blocked.")
        if not any(ride.goal.accepted for ride in seen.there):
            raise Wrong("While the shaft is blocked, a goal for the floor where the cabin stands must be accepted.")
        if not any(ride.goal.accepted and quick.ends_well(ride) for ride in seen.there):
            rule = "While the shaft is blocked, a goal that needs no step must succeed."
            ended(seen.there[0], "SUCCEEDED", rule, busy)
            raise Wrong(rule, f"{seen.there[0].goal.result}")


@points(1, cell="lift-server")
@twice
def test_aborted_result(busy: Busy) -> None:
    """The result of an aborted goal is what was done so far, whatever it was aborted for."""
    judged, fault = False, Fault("No goal was aborted when the shaft was blocked, or when another goal took over.")
    scenes: list[tuple[Callable[[], Any], Callable[[Any], bool]]] = [
        (busy.blocking, expect_aborted_results),
        (busy.preemption, expect_preempted_result),
        (busy.three, expect_waiting_result),
    ]
    for scene, expect in scenes:
        try:
            with scene():
                pass  # it is played, unless it was before
        except Fault as other:  # it is held against the lift elsewhere, when the other scene can be judged
            fault = other
        else:
            with scene() as seen:
                judged = expect(seen) or judged
    if not judged:
        raise Wrong(fault.message, fault.detail)


@points(1, cell="lift-server")
@twice
def test_step_period(quick: Quick, cancelled: Cancelled) -> None:
    """The parameter step_period says how long a step takes, by default 1 s."""
    rule = "Each step must take step_period seconds, as set on the command line (--ros-args -p step_period:=...)."
    with quick.sample() as ride:
        if way(ride.goal):
            expect_lengths(ride.goal.feedback, quick.period, quick.period + SLOWER, rule)
        else:
            count = len(ride.goal.feedback) or len(steps(0, ride.floors))
            took, right = ride.goal.ended - ride.goal.sent, count * quick.period
            if not ride.goal.status:
                raise Wrong(f"{rule} No goal came to its end.")
            if not SHORTEST * right < took < right + 0.5 * count * (STEP - quick.period):
                raise Wrong(rule, f"took {took} s, expected {right} s")
    with suppress(Crashed, TimedOut), cancelled.sample() as goal:  # how it ends is another test's
        told = [heard for heard in goal.feedback if heard.time < goal.cancel_sent]  # a cancel may cut a step short
        if len(told) > 1:
            rule = f"When step_period is not set, each step must take {STEP:.0f} s."
            expect_lengths(told, STEP, 1.7 * STEP, rule)


@points(0.5, cell="lift-client")
@twice
def test_client_sends_floors(clients: Mapping[str, Encounter]) -> None:
    """The client sends one goal with its floors, in their order, and leaves it to the server which floors there are."""
    run = clients["wide"]
    with run.judged() as program:
        if run.goals[0] != run.floors:
            raise Wrong(
                "The client's goal must hold the floors from its command line, in their order.",
                f"sent {run.goals}, not {run.floors}: {program.output}",
            )
        if len(run.goals) > 1:
            raise Wrong("The client must send one goal; it sent several.", f"{run.goals}")


@points(0.5, cell="lift-client")
@twice
def test_client_shows_feedback(clients: Mapping[str, Encounter]) -> None:
    """The client prints each feedback message."""
    run = clients["succeed"]
    with run.judged() as program:
        if not run.shown <= Counter(numbers(program.output)):
            raise Wrong(
                "The client must print each feedback message, its floor and its stops_left.",
                f"sent {run.feedback}, shown: {program.output}",
            )


@points(0.5, cell="lift-client")
@twice
def test_client_shows_feedback_as_it_comes(clients: Mapping[str, Encounter]) -> None:
    """The client prints the feedback while the goal runs."""
    run = clients["succeed"]
    with run.judged() as program:
        printed = run.shown & Counter(numbers(program.output))
        if not printed:
            raise Wrong("The client must print each feedback message as it comes; it printed none.", program.output)
        if not printed <= run.early:
            raise Wrong("The client must print each feedback message as it comes, not when the goal is over.")


@points(1, cell="lift-client")
@twice
def test_client_shows_result(clients: Mapping[str, Encounter]) -> None:
    """The client prints the result, however the goal ended."""
    for name, how in (("succeed", "succeeded"), ("abort", "was aborted"), ("cancel", "was cancelled")):
        with clients[name].judged() as program:
            expect_result(program, clients[name], how)


@points(1, cell="lift-client")
@twice
def test_client_says_outcome(clients: Mapping[str, Encounter]) -> None:
    """At the end the client says how the goal ended, in one word."""
    for name in ("succeed", "reject", "abort", "cancel"):
        with clients[name].judged() as program:
            expect_outcome(program, clients[name].end, WHEN[name])


@points(1, cell="lift-client")
@twice
def test_client_exit_status(clients: Mapping[str, Encounter]) -> None:
    """The exit status is 0 when the goal succeeded, and another number when it was rejected, aborted or cancelled."""
    for name in ("succeed", "reject", "abort", "cancel"):
        expect_status(clients[name], WHEN[name])


@points(0.5, cell="lift-client")
@twice
def test_client_cancels(clients: Mapping[str, Encounter]) -> None:
    """With --cancel-after N the client cancels as soon as it has received N feedback messages."""
    run = clients["cancel"]
    with run.judged() as program:
        if run.before_cancel is None:
            raise Wrong("With --cancel-after N, the client did not cancel its goal.", program.output)
        if run.before_cancel != run.cancel_after:
            when = "earlier" if run.before_cancel < (run.cancel_after or 0) else "later"
            raise Wrong(
                f"With --cancel-after N, the client must cancel after N feedback messages; it did {when}.",
                f"N={run.cancel_after}, after {run.before_cancel}",
            )


@points(0.5, cell="lift-client")
@twice
def test_client_cancels_at_once(clients: Mapping[str, Encounter]) -> None:
    """With --cancel-after 0 the client cancels as soon as the goal is accepted."""
    run = clients["at once"]
    with run.judged() as program:
        if run.before_cancel is None:
            raise Wrong("With --cancel-after 0, the client did not cancel its goal.", program.output)
        if run.before_cancel:
            raise Wrong(
                "With --cancel-after 0, the client must cancel as soon as the goal is accepted; it waited for feedback."
            )


@points(0.5, cell="lift-client")
@twice
def test_client_waits_for_the_end(clients: Mapping[str, Encounter]) -> None:
    """With --cancel-after N the client waits for the end of the goal, also when the goal succeeds all the same."""
    for name in ("late", "few"):
        run = clients[name]
        with run.judged() as program:
            expect_outcome(program, "SUCCEEDED", WHEN[name])
        expect_status(run, WHEN[name])


@points(0.5, cell="lift-client")
def test_client_without_server(bench: Bench, clients: Mapping[str, Encounter]) -> None:
    """Without a server the client gives up within 10 s, and says so."""
    expect_able(clients)
    expect_gives_up(bench.early["absent"], ACTION)


@points(0.5, cell="lift-client")
def test_client_arguments(misused: Mapping[str, Run], clients: Mapping[str, Encounter]) -> None:
    """With wrong arguments the client prints how to use it."""
    expect_able(clients)
    for doing, run in misused.items():
        expect_usage(run, doing)
