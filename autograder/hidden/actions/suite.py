"""Tests of the lift of section 3.2, as a conversation with the student's server and client.

Points add up to 20.  The message of a failure speaks of the task; the numbers that were drawn stay with the grader.
"""

import random
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from itertools import groupby
from typing import Any

from autograder.errors import Fault
from autograder.hidden.actions.busy import AT_MOST, BUSY_STEP, LOW_TOP, SOON, Busy, ended
from autograder.hidden.actions.conversation import (
    ACTION,
    BLOCK,
    NOT_ACCEPTED,
    OFFERED,
    SLOW_STEP,
    STEP,
    TOP,
    Cancelled,
    Quick,
    Server,
    Slow,
    accepted,
)
from autograder.hidden.actions.each_way import BLOCKED, CANCEL, PREEMPT, EachWay
from autograder.hidden.actions.encounter import LONG, MOST_FEEDBACK, WIDE, Called, Encounter, drawn_numbers
from autograder.hidden.actions.idle import PLACE, SHAFT, Idle
from autograder.hidden.actions.judging import (
    EARLIEST,
    SHORTEST,
    compared,
    expect_able,
    expect_aborted_results,
    expect_arrival,
    expect_each_direction,
    expect_for_ros,
    expect_in_time,
    expect_kept_place,
    expect_lengths,
    expect_no_floor_twice,
    expect_no_other_step,
    expect_no_result,
    expect_no_step_of_its_own,
    expect_no_step_when_cancelled,
    expect_one_cabin,
    expect_outcome,
    expect_outcome_last,
    expect_over,
    expect_preempted_result,
    expect_rejection,
    expect_result,
    expect_result_of_last_step,
    expect_result_of_waiting,
    expect_running,
    expect_slow_steps,
    expect_so_far,
    expect_status,
    expect_steps_in_turn,
    expect_taken_over,
    expect_turns,
    expect_waiting_result,
    expect_whole_or_no_step,
    expect_word,
    last_outcome,
    left_elsewhere,
    makes_more_steps,
    says_elsewhere,
)
from autograder.hidden.actions.rides import Ride, counted, floors_heard, follows, steps, way
from autograder.suitekit import Bench, Crashed, TimedOut, Wrong, expect_gives_up, expect_usage, numbers, points, twice
from autograder.suitekit.actions import Goal

MOMENT = 1.0  # s that something may take that must not wait for a long step
FOUND = 1.0  # s for which the client must wait for a server, by the task
# s that the fastest of many short steps may take longer than step_period: with the longest of QUICK_STEPS less than
# 0.1, so that the verdict on steps of whole tenths of a second does not depend on what is drawn.
SLOWER = 0.05
MANY = 6  # goals that are told of
MANY_FLOORS = 30  # of a goal that must be accepted
AGAIN = [2, 1, 2, 1, 2]  # floors come again, though not in a row, also when the cabin stands at the first of them
WHEN = {
    "succeed": "When the goal has succeeded,",
    "reject": "When the goal is rejected,",
    "abort": "When the goal is aborted,",
    "cancel": "When the goal is cancelled,",
    "late": f"When a goal that the client has cancelled succeeds all the same, {LONG:.0f} s after it began,",
    "at once": "When a goal that the client has cancelled is aborted all the same,",
    "few": f"When a goal succeeds after {LONG:.0f} s, and before the client has received N feedback messages,",
}


@points(0.5, cell="lift-server")
@twice
def test_ride(quick: Quick) -> None:
    """A goal succeeds when all its stops are made, in their order."""
    with quick.sample() as ride:
        ended(ride, "SUCCEEDED", "Once all stops are made, the goal must succeed: goal_handle.succeed().", quick)
        stops, floor = list(ride.goal.result.stops), ride.goal.result.floor
        if stops != ride.floors:
            raise Wrong(
                "The result of a goal that succeeds must hold its floors in `stops`, in the order of the goal. "
                "Of a goal "
                f"with {len(ride.floors)} floors, `stops` {compared(stops, ride.floors)}.",
                f"{ride.floors}: {stops}",
            )
        if floor != ride.floors[-1]:
            raise Wrong(
                "`floor` of the result must say where the cabin is at the end: at the last of the goal's floors. "
                f"It says {floor}.",
                f"{ride.floors}: {floor}",
            )
    goal = quick.run(AGAIN)
    if goal.status and goal.status == ride.end and list(goal.result.stops) != AGAIN:
        raise Wrong(
            "A floor that comes again later in a goal is another stop: the result of a goal for the floors "
            f"{AGAIN} held {list(goal.result.stops)} in `stops`."
        )


@points(0.5, cell="lift-server")
@twice
def test_feedback(quick: Quick, cancelled: Cancelled) -> None:
    """Each step of one floor is reported, with the floor and the stops that are left."""
    with quick.sample() as ride:
        heard = [(heard.message.floor, heard.message.stops_left) for heard in ride.goal.heard]
        if not heard:
            raise Wrong("The goal published no feedback: call goal_handle.publish_feedback(...) for each step.")
        ways = [steps(start, ride.floors) for start in range(quick.top + 1)]  # where it starts is another test's
        told = [floor for floor, _ in heard]
        if told not in [[floor for floor, _ in way] for way in ways]:
            right = len(ways[0])
            how = f"as many messages, and the first told floor {told[0]}" if len(told) == right else counted(len(told))
            raise Wrong(
                "There must be one feedback message for each step of one floor, with the floor where the cabin is "
                f"then, all the way to each stop; and no other message. A goal of {right} steps sent {how}.",
                f"{ride.floors}: {heard}",
            )
        if heard not in ways:
            raise Wrong(
                "`stops_left` of the feedback must count the stops still to make: one that this step has reached is "
                f"made. In the first message of a goal with {len(ride.floors)} floors it was {heard[0][1]}, in "
                "the last "
                f"{heard[-1][1]}.",
                f"{ride.floors}: {heard}",
            )
    floors = AGAIN
    goal = quick.run(floors)
    heard = [(heard.message.floor, heard.message.stops_left) for heard in goal.feedback]
    if heard[:1] == [(floors[0], len(floors))]:  # a stop where it stood, told of as a step: another test's
        heard = heard[1:]
    ways = [steps(start, floors) for start in range(quick.top + 1)]
    if heard and heard not in ways and [floor for floor, _ in heard] in [[floor for floor, _ in way] for way in ways]:
        raise Wrong(
            "`stops_left` of the feedback must count the stops still to make, also when a floor comes again later in "
            f"the goal. Of a goal for the floors {floors} the feedback (floor, stops_left) ended with "
            f"{heard[1 - len(floors) :]}."
        )
    with quick.sample() as ride:  # a message that comes with the result has come by now
        expect_no_floor_twice(ride.goal, "succeeded")
    stopped: list[Goal] = []
    with suppress(Crashed, TimedOut, Wrong), cancelled.sample() as goal:  # how it ends is another test's
        stopped.append(goal)
    for goal in stopped:
        expect_no_floor_twice(goal, "was cancelled")


@points(0.25, cell="lift-server")
@twice
def test_keeps_its_place(quick: Quick, idle: Idle, rng: random.Random) -> None:
    """The cabin starts at floor 0, and each goal goes on from where it is."""
    with quick.sample() as ride:
        heard = way(ride.goal)
        if heard and heard[0] not in (0, 1):  # what is told of the first step is another test's
            raise Wrong(
                f"The cabin must start at floor 0; the first message of the first goal told floor {heard[0]}.",
                f"{heard}",
            )
    here, there = rng.randrange(6, 9), rng.randrange(2, 5)
    quick.run([here])
    starts, goal = quick.starts, quick.run([there])
    if goal.fault and quick.starts > starts:  # it has begun at floor 0 again
        raise goal.fault
    if not goal.feedback:
        raise Wrong("No feedback of the goal came, so nothing shows where the cabin was.")
    heard = way(goal)
    if heard and heard[0] not in (here, here - 1):
        raise Wrong(
            f"A goal must go on from the floor where the cabin is. When it stood at floor {here}, the first "
            "message of the "
            f"next goal told floor {heard[0]}.",
            f"from {here} to {there}: {heard}",
        )
    idle.expect(PLACE)


@points(0.25, cell="lift-server")
@twice
def test_stops_where_it_stands(quick: Quick, slow: Slow, rng: random.Random) -> None:
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
                f"and without feedback, each time that it is next. Of a goal with the same floor twice, {count} steps "
                f"away, feedback told of {counted(moves, 'floor')}, and the result held "
                f"{counted(len(goal.result.stops), 'stop')}.",
                f"{floors} from floor 0: {goal.status} {goal.result} {floors_heard(goal)}",
            )
    with quick.sample() as ride:  # of a lift that counts no stop that is just made, two are no other case
        left = [heard.message.stops_left for heard in (*ride.goal.feedback[-1:], *goal.feedback[-1:])]
        if left[:1] == [0] and any(left):
            raise Wrong(
                "When a floor is in `floors` twice in a row, a step that reaches it has made both stops: `stops_left` "
                f"must count neither. At the end it was {left[-1]}."
            )
    with suppress(Crashed, TimedOut), slow.sample() as slowly:
        again = slowly.twice.goal if slowly.twice else None
        # One that tells of a floor has moved: the cabin did not stand there any more, which is another test's.
        if again and not floors_heard(again) and (late := again.ended - again.answered) > MOMENT:
            raise Wrong(
                "A floor that is next in `floors` and where the cabin stands must be a stop at once, each time that it "
                f"is next. A goal for this floor, twice, took {late:.1f} s, where a step takes {SLOW_STEP} s."
            )


@points(5, cell="lift-server")
@twice
def test_cancel(cancelled: Cancelled, quick: Quick, each_way: EachWay) -> None:
    """A goal is cancelled within a step: the cabin begins no other, and the next goal is served."""
    with cancelled.sample() as goal:
        if not goal.cancel_sent:
            raise Wrong(
                f"A goal of many steps was over after {cancelled.STEPS} of them at most, before it could be cancelled. "
                f"It {cancelled.how(goal.status)}."
            )
        if goal.cancel_accepted is False and goal.status != "CANCELED":
            raise Wrong(
                f"The request to cancel was refused; the goal then {cancelled.how(goal.status)}. A cancel_callback "
                "must accept it while the goal runs: if you have one, was a thread free to run it?"
            )
        expect_begun(goal)
        expect_over(Ride(cancelled.floors, goal), goal.cancel_sent, STEP, "A goal that is cancelled")
        expect_no_other_step(goal, goal.cancel_answered, "When the request to cancel is accepted,")
        after = cancelled.follow(goal)
        if after is None or not quick.ends_well(after):
            how = "The lift ended"
            if after is not None:
                how = f"It {cancelled.how(after.end)}" if after.end else "It had no end"
            cancelled.end()  # what was cancelled must not spoil the second try
            raise Wrong(f"After a cancel, the next goal must be worked on. {how}.")
    each_way.expect(CANCEL)


def expect_begun(goal: Goal) -> None:
    """A cancelled goal must have made steps, by its feedback or its result: else nothing shows that it makes no other.

    That both tell of each step, other tests judge.
    """
    if not goal.feedback and not goal.result.stops and not goal.result.floor:
        raise Wrong(
            "This is judged only of a lift that moves: before its cancel, a goal told of no step, and its result has "
            "no stop, and floor 0."
        )


@points(0.5, cell="lift-server")
@twice
def test_cancelled_result(cancelled: Cancelled, busy: Busy) -> None:
    """A cancelled goal ends as CANCELED, its result is what was done so far, and the cabin stays where it is."""
    with cancelled.sample() as goal:
        if not goal.cancel_sent:
            raise Wrong("The goal was over before it could be cancelled, so there is no result of a cancelled goal.")
        expect_begun(goal)
        ride = Ride(cancelled.floors, goal)
        ended(ride, "CANCELED", "A cancelled goal must end as CANCELED: call goal_handle.canceled().", cancelled)
        expect_so_far(ride, "a cancelled goal")
        place = goal.result.floor
        # The second time the cabin is there for certain: a lift that tells of a stop at once does so again.
        heard = floors_heard(cancelled.run([place]))
        if {*heard} - {place} or (heard and not floors_heard(cancelled.run([place]))):
            raise Wrong(
                "After a cancel the cabin must stay where it is. A goal for the floor that the cancelled goal's result "
                f"names needed {counted(len(heard), 'step')}: the cabin was elsewhere.",
                f"not at {place}: {heard}",
            )
    played = False
    with suppress(Fault), busy.cancelled():  # how it ends is another test's
        played = True
    if played:
        with busy.cancelled() as seen:
            expect_result_of_waiting(seen, "CANCELED", "cancelled")


@points(0.5, cell="lift-server")
@twice
def test_cancel_while_waiting(busy: Busy, cancelled: Cancelled) -> None:
    """A goal can be cancelled while it waits for the one that runs, and the next goal is served."""
    with busy.cancelled() as seen:
        first, second, *others = seen.rides
        expect_running(busy, first, seen.running, "another one was sent")
        if not second.goal.accepted:
            raise Wrong(
                "While a goal runs, a new one must be accepted; it was rejected, so nothing could be cancelled."
            )
        if second.goal.cancel_accepted is False and second.end != "CANCELED":
            raise Wrong(
                "The request to cancel a goal was refused while that goal waited for the one that ran. A "
                "cancel_callback must accept every request."
            )
        if second.end not in ("CANCELED", cancelled.usual_end) or second.end == "SUCCEEDED":
            ended(second, "CANCELED", "A goal that is cancelled while it waits must end as CANCELED.", busy)
        expect_in_time(second, second.goal.cancel_sent, "After the cancel was accepted, a goal that waited")
        more = True
        with suppress(Fault), cancelled.sample() as goal:  # or else other tests judge it
            more = makes_more_steps(goal)
        if not more:
            expect_no_step_when_cancelled(first.goal, second.goal)
        if busy.takes_over:
            expect_taken_over(first, second)
        if not accepted(others[0].goal).feedback and others[0].goal.result.floor != others[0].floors[-1]:
            raise Wrong(
                f"After a cancel, the next goal must be worked on. It told of no step, and {busy.how(others[0].end)}.",
                f"{others[0].floors}",
            )
        if seen.refused:
            raise Wrong(
                "Every request to cancel must be accepted, also when a newer goal has just taken over and the goal has "
                "not ended yet. It was refused then, twice."
            )


@points(0.5, cell="lift-server")
@twice
def test_rejects(quick: Quick, busy: Busy, cancelled: Cancelled, one_floor: Server, rng: random.Random) -> None:
    """A goal without floors, or with a floor outside 0 to top, is rejected; the parameter top counts, by default 9."""
    expect_rejection(quick, [], "A goal without floors")
    for floors in ([-1], [3, -rng.randrange(2, 50)]):
        expect_rejection(quick, floors, "A goal with a floor below 0")
    for floors in ([quick.top + 1], [0, quick.top + rng.randrange(2, 50), 1]):
        expect_rejection(quick, floors, "A goal with a floor above `top`, as set on the command line,")
    highest = quick.send([quick.top])
    if not highest.accepted:
        raise Wrong(
            f"{NOT_ACCEPTED[:-1]}, where `top` on the command line was {quick.top}, and the goal was for that floor."
        )
    highest.cancel()  # it is far away
    expect_rejection(busy, [LOW_TOP + 1], f"With `top` less than {TOP}, a goal with a floor above it")
    cancelled.join()
    expect_rejection(cancelled, [TOP + 1], f"When top is not set, a goal with a floor above {TOP}")
    accepted(cancelled.send([TOP]))
    with suppress(Crashed, TimedOut):  # what becomes of the goal that is accepted, other tests judge
        goal = one_floor.send([0])
        if not goal.accepted:
            raise Wrong("With 0 as `top` on the command line, a goal for floor 0 must be accepted; it was rejected.")
        expect_rejection(one_floor, [1], "With 0 as `top` on the command line, a goal for floor 1")
        goal.wait(lambda g: g.status, one_floor.allow(AT_MOST))  # who refuses what comes meanwhile loses other points
        if not one_floor.send([0] * MANY_FLOORS).accepted:
            raise Wrong(
                "A goal with at least one floor, and only floors from 0 to top, must be accepted, however many they "
                f"are; one with {MANY_FLOORS} floors was rejected."
            )


@points(0.5, cell="lift-server")
@twice
def test_rejected_goal_changes_nothing(busy: Busy, quick: Quick, rng: random.Random) -> None:
    """A rejected goal does not preempt another one, and leaves the cabin where it is."""
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
            "When a new goal is rejected, the one that runs must go on from where the cabin is, floor by floor to its "
            f"stops. The floors that it told before and after were {floors_heard(goal)[max(0, before - 2) :]}.",
            f"{ride.floors}: {floors_heard(goal)}",
        )
    busy.over(goal, ride.floors, AT_MOST)  # the next test has the lift for itself
    here = rng.randrange(3, 6)
    told = begun_after(quick, here, [[quick.top + 1], [-1], []])
    if told not in (None, here, here + 1) and begun_after(quick, here, []) in (here, here + 1):
        raise Wrong(
            "A goal that is rejected changes nothing, also when no other runs. The cabin stood at floor "
            f"{here}, and after goals that were rejected the first message of a goal for floor {here + 2} told floor "
            f"{told}."
        )


def begun_after(quick: Quick, here: int, impossible: list[list[int]]) -> int | None:
    """The floor that the first message of a goal for two floors above `here` told, sent when others were rejected.

    None when nothing shows that: what is wrong then costs other points.
    """
    with suppress(Crashed, TimedOut, Wrong):
        starts, goal = quick.starts, quick.run([here])
        if quick.endless or goal.status != "SUCCEEDED" or any(quick.send(floors).accepted for floors in impossible):
            return None
        heard = way(quick.run([here + 2]))
        return heard[0] if heard and quick.starts == starts else None
    return None


@points(5, cell="lift-server")
@twice
def test_preempt(busy: Busy, quick: Quick, slow: Slow, each_way: EachWay) -> None:
    """A new goal takes over: the one before ends within a step, then the new one goes on from there to its stops."""
    with busy.preemption() as seen:
        first, second = seen.rides
        expect_running(busy, first, seen.running, "a new one came")
        if not second.goal.accepted:
            raise Wrong("While a goal runs, a new one must be accepted; it was rejected.")
        expect_over(first, second.goal.answered, BUSY_STEP, "When a new goal is accepted, the one that runs")
        if not quick.ends_well(second):
            ended(second, "SUCCEEDED", "A goal that takes over must be worked on, and succeed.", busy)
        if not second.made:
            raise Wrong(
                "A goal that takes over must make its stops. It succeeded, and neither its feedback nor its result "
                "has its last floor.",
                f"{second.floors}: {second.goal.result}",
            )
        expect_one_cabin(seen)
    with slow.sample() as slowly:
        if len(slowly.rides) > 1:
            first, second = slowly.rides
            expect_no_other_step(first.goal, second.goal.answered, "When a new goal is accepted,")
            expect_steps_in_turn(first, second, slowly.back)
    each_way.expect(PREEMPT)


@points(0.25, cell="lift-server")
@twice
def test_preempt_waiting(busy: Busy, quick: Quick) -> None:
    """A goal that waits is aborted without a step when a new one comes; else it begins where the cabin is then."""
    with busy.three() as seen:
        expect_running(busy, seen.rides[0], seen.running, "a new one came")
        if not all(ride.goal.accepted for ride in seen.rides):
            waits = " and another one waits" if seen.rides[1].goal.accepted else ""
            raise Wrong(f"While a goal runs{waits}, a new one must be accepted; it was rejected.")
        first, second, third = seen.rides
        rule = (
            "When a new goal is accepted, one that waits must make no step and end as ABORTED, whatever the two ask "
            "for; here, both asked for the same floor."
        )
        ended(second, "ABORTED", rule, busy)
        expect_in_time(second, third.goal.answered, "When a new goal was accepted, one that waited")
        expect_turns(seen)
        expect_no_step_of_its_own(first.goal, second.goal, third.goal)
        if not quick.ends_well(third):
            ended(third, "SUCCEEDED", "The goal that came last must be worked on, and succeed.", busy)
    with busy.leaving() as left:
        first, second = left.rides
        expect_running(busy, first, left.running, "a new one came")
        if busy.takes_over and second.goal.accepted:  # or else another test judges it
            rule = "When a new goal is accepted, also for the floor that the cabin is just leaving, the one that runs"
            expect_over(first, second.goal.answered, BUSY_STEP, rule)
            if not quick.ends_well(second):
                ended(second, "SUCCEEDED", "A goal for the floor that the cabin is just leaving must succeed.", busy)
        expect_arrival(left)


@points(0.5, cell="lift-server")
@twice
def test_blocked(busy: Busy, each_way: EachWay) -> None:
    """When the shaft is blocked while a goal runs, the goal is aborted within a step."""
    with busy.blocking() as seen:
        expect_running(busy, seen.ride, seen.running, "the shaft was blocked")
        rule = (
            f"A goal that runs while {BLOCK} gets `data: true` must end as ABORTED: call goal_handle.abort(). If you "
            "do, was a thread free to answer the service?"
        )
        ended(seen.ride, "ABORTED", rule, busy)
        expect_in_time(seen.ride, seen.sent, "When the shaft was blocked, the goal")
        expect_no_other_step(seen.ride.goal, seen.answered, f"When {BLOCK} has answered,")
        expect_kept_place(seen)
    each_way.expect(BLOCKED)


@points(0.25, cell="lift-server")
@twice
def test_block_is_answered(busy: Busy, slow: Slow) -> None:
    """The service that blocks the shaft answers at once with success, also while a goal runs."""
    with busy.asked() as seen:
        if not seen.took:
            raise Wrong(
                f"A goal of many steps was over before {BLOCK} could be asked. It {busy.how(seen.goal.status)}."
            )
        if min(seen.took) > SOON:
            raise Wrong(
                f"{BLOCK} must answer at once, also while a goal runs; it answered only after a step, each time. Does "
                "its callback wait for something, or were all threads busy?",
                f"{seen.took} s",
            )
        if not all(seen.success):
            raise Wrong(
                f"{BLOCK} must answer with `success` true, to `data: true` and to `data: false`, each time; "
                f"{seen.success.count(False)} of {len(seen.success)} answers had `success` false."
            )
    with suppress(Crashed, TimedOut), slow.sample() as slowly:  # what happens to the goals is another test's
        if slowly.block_took > MOMENT:
            raise Wrong(
                f"{BLOCK} must answer at once, also to `data: true` while a goal runs; it answered after "
                f"{slowly.block_took:.1f} s, where a step takes {SLOW_STEP} s."
            )


@points(0.25, cell="lift-server")
@twice
def test_blocked_before(busy: Busy, quick: Quick, idle: Idle) -> None:
    """A goal that comes while the shaft is blocked makes no step and is aborted; a free shaft serves the next one."""
    with busy.blocking() as seen:
        stuck, freed = seen.stuck, seen.freed
        if not stuck.goal.accepted:
            raise Wrong(
                "While the shaft is blocked, a goal must be accepted, and is aborted when it needs a step. It "
                "was rejected."
            )
        rule = "While the shaft is blocked, a goal that needs a step must end as ABORTED."
        ended(stuck, "ABORTED", rule, busy)
        if seen.away.goal.accepted:
            ended(seen.away, "ABORTED", f"{rule[:-1]}, also one that makes no stop before.", busy)
        if {*floors_heard(stuck.goal)} - {seen.here}:
            raise Wrong(
                "While the shaft is blocked, the cabin must not move; a goal that came then told of other floors "
                "than the "
                "one where it stood.",
                f"{floors_heard(stuck.goal)}",
            )
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
        moved = asked.twice and floors_heard(asked.twice.goal)  # one that tells of no step may have needed none
        if asked.twice and moved and asked.twice.end != "ABORTED" and stuck.end == "ABORTED":
            raise Wrong(
                f"To block what is blocked changes nothing: it stays blocked. After {BLOCK} got `data: true` twice, a "
                f"goal that needs a step {busy.how(asked.twice.end)}."
            )
        if asked.after and asked.after.end == "ABORTED" and not quick.ends_well(asked.after):
            raise Wrong(
                f"To block what is blocked changes nothing: one `data: false` frees it. After {BLOCK} got `data: true` "
                f"twice and `data: false` once, a goal {busy.how(asked.after.end)}."
            )
        if asked.unblocked and asked.unblocked.end == "ABORTED" and not quick.ends_well(asked.unblocked):
            raise Wrong(
                f"`data: false` must free the shaft. After {BLOCK} got `data: true` and then `data: false`, with no "
                f"goal in between, a goal {busy.how(asked.unblocked.end)}."
            )
        if asked.freed_by_rejected:
            raise Wrong(
                "A goal that is rejected changes nothing: a blocked shaft stays blocked. A goal that needs a step "
                "ended as ABORTED, and the same one as SUCCEEDED when another had been rejected in between."
            )
    idle.expect(SHAFT)


@points(0.25, cell="lift-server")
@twice
def test_stops_while_blocked(busy: Busy, quick: Quick) -> None:
    """While the shaft is blocked, a goal that needs no step succeeds."""
    with busy.blocking() as seen:
        if "ABORTED" not in (seen.ride.end, seen.stuck.end):
            raise Wrong(
                "This is judged only of a lift that aborts goals because the shaft is blocked. Neither the one that "
                "ran when it was blocked nor one that came then, which stopped where the cabin stood and had another "
                "stop to make, ended as ABORTED."
            )
        if left_elsewhere(seen) or says_elsewhere(seen):
            return  # which costs other points: the goals were for a floor where the cabin was not
        if not any(ride.goal.accepted for ride in seen.there):
            raise Wrong(
                "While the shaft is blocked, a goal for the floor where the cabin stands must be accepted. It "
                "was rejected."
            )
        if not any(ride.goal.accepted and quick.ends_well(ride) for ride in seen.there):
            rule = "While the shaft is blocked, a goal that needs no step must succeed."
            ended(seen.there[0], "SUCCEEDED", rule, busy)
            raise Wrong(rule, f"{seen.there[0].goal.result}")


@points(0.5, cell="lift-server")
@twice
def test_aborted_result(busy: Busy) -> None:
    """A goal that is replaced ends as ABORTED; the result of an aborted goal is what was done so far."""
    judged, fault = False, Fault("No goal was aborted when the shaft was blocked, or when another goal took over.")
    scenes: list[tuple[Callable[[], Any], Callable[[Any], bool]]] = [
        (busy.blocking, expect_aborted_results),
        (busy.preemption, expect_preempted_result),
        (busy.three, expect_waiting_result),
        (busy.last_step, lambda seen: expect_result_of_last_step(busy, seen)),
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


@points(0.5, cell="lift-server")
@twice
def test_step_period(quick: Quick, cancelled: Cancelled, slow: Slow) -> None:
    """The parameter step_period says how long a step takes, by default 1 s."""
    rule = "Each step must take step_period seconds, as set on the command line (--ros-args -p step_period:=...)."
    with quick.sample() as ride:
        if way(ride.goal):
            expect_lengths(ride.goal.feedback, quick.period, quick.period + SLOWER, rule)
            expect_each_direction(ride.goal.feedback, quick.period, rule)
        else:
            count = len(ride.goal.feedback) or len(steps(0, ride.floors))
            took, right = ride.goal.ended - ride.goal.sent, count * quick.period
            if not ride.goal.status:
                raise Wrong(f"{rule} No goal came to its end.")
            if not SHORTEST * right < took < right + 0.5 * count * (STEP - quick.period):
                raise Wrong(
                    f"{rule} A goal of {count} steps took {took / right:.1f} times as long.", f"{took}: {right} s"
                )
    with suppress(Crashed, TimedOut), cancelled.sample() as goal:  # how it ends is another test's
        told = [heard for heard in goal.feedback if heard.time < goal.cancel_sent]
        if len(told) > 1:
            rule = f"When step_period is not set, each step must take {STEP:.0f} s."
            expect_lengths(told, STEP, 1.7 * STEP, rule)
            if (first := told[0].time - goal.sent) < EARLIEST * STEP:
                raise Wrong(
                    "A step must be reported when its time is over, and the cabin has reached the floor. The first "
                    f"message came {first:.2f} s after the goal, when a step takes {STEP:.0f} s."
                )
            expect_whole_or_no_step(goal)
    with suppress(Crashed, TimedOut), slow.sample() as slowly:
        expect_slow_steps([ride.goal for ride in slowly.rides])


@points(0.5, cell="lift-client")
@twice
def test_client_sends_floors(clients: Mapping[str, Encounter]) -> None:
    """The client sends one goal with its floors, in their order, and leaves it to the server which floors there are."""
    run = clients["wide"]
    with run.judged() as program:
        if len(run.goals) > 1:
            count = ", ".join(str(len(goal)) for goal in run.goals[:MANY])
            raise Wrong(
                f"The client must send one goal with all floors of its command line; called with {len(run.floors)} "
                f"floors it sent {len(run.goals)} goals, with {count} floors.",
                f"{run.goals}",
            )
        if run.goals[0] != run.floors:
            sent = run.goals[0]
            how = "the right floors in another order" if sorted(sent) == sorted(run.floors) else "other floors"
            how = how if len(sent) == len(run.floors) else f"{len(sent)} floors"
            raise Wrong(
                "The client's goal must hold the floors from its command line, in their order, also those that only "
                f"the server can refuse; called with floors of {WIDE[0]} and more, one of them twice, and one of 0, it "
                f"held {how}.",
                f"sent {run.goals}, not {run.floors}: {program.output}",
            )


@points(0.25, cell="lift-client")
@twice
def test_client_shows_feedback(clients: Mapping[str, Encounter]) -> None:
    """The client prints each feedback message."""
    run = clients["succeed"]
    with run.judged() as program:
        printed = Counter(numbers(program.output))
        first, *others = run.feedback[:-1]
        if drawn_numbers(others) <= printed and not drawn_numbers([first]) <= printed:
            raise Wrong(
                "The client must print each feedback message, also one that comes before the answer to its goal. It "
                f"printed the {len(others)} after the answer, and not the one before it.",
                f"sent {first}, shown: {program.output}",
            )
        *others, last = run.feedback
        if not drawn_numbers(others) <= printed:
            floors, left = (Counter(map(float, part)) for part in zip(*others, strict=True))
            raise Wrong(
                "The client must print each feedback message, its floor and its stops_left, also one that is "
                "like the one "
                f"before. Of {len(others)} messages it printed {(floors & printed).total()} floors and "
                f"{(left & printed).total()} stops_left.",
                f"sent {others}, shown: {program.output}",
            )
        if not drawn_numbers([last]) <= printed:
            raise Wrong(
                "The client must print each feedback message, also the last one of a goal that succeeds, with 0 stops "
                f"left. It printed the {len(others)} before that.",
                f"sent {last}, shown: {program.output}",
            )
    late = clients["late"]
    if late.output and late.before_cancel is not None and late.stayed:  # or else it is another test's
        with late.judged() as program:
            printed = Counter(numbers(program.output))
            if not drawn_numbers(late.after_cancel) <= printed:
                floors = drawn_numbers((floor, 0) for floor, _ in late.after_cancel)
                raise Wrong(
                    "The client must print each feedback message as it comes, also after it has sent its cancel: the "
                    f"goal goes on until its end. Of {len(late.after_cancel)} messages that came then, it printed "
                    f"{(floors & printed).total()} floors.",
                    f"sent {late.after_cancel}, shown: {program.output}",
                )


@points(0.25, cell="lift-client")
@twice
def test_client_shows_feedback_as_it_comes(clients: Mapping[str, Encounter]) -> None:
    """The client prints the feedback while the goal runs."""
    run = clients["succeed"]
    with run.judged() as program:
        printed = run.shown & Counter(numbers(program.output))
        if not printed:
            raise Wrong("The client must print each feedback message as it comes; it printed none.", program.output)
        if not printed <= run.early:
            raise Wrong(
                "The client must print each feedback message as it comes. Of the numbers of feedback that it printed, "
                f"{(printed & run.early).total()} of {printed.total()} stood there before the goal had ended."
            )


@points(0.5, cell="lift-client")
@twice
def test_client_shows_result(clients: Mapping[str, Encounter]) -> None:
    """The client prints the result, however the goal ended."""
    for name, how in (("succeed", "succeeded"), ("abort", "was aborted"), ("cancel", "was cancelled")):
        with clients[name].judged() as program:
            expect_result(program, clients[name], how)
    at_once = clients["at once"]
    if at_once.output:  # or else it is another test's
        with at_once.judged() as program:
            expect_result(program, at_once, "ended before its first stop")


@points(0.5, cell="lift-client")
@twice
def test_client_says_outcome(clients: Mapping[str, Encounter]) -> None:
    """At the end the client says how the goal ended, in one word; one that is rejected has no result."""
    for name in ("succeed", "reject", "abort", "cancel"):
        with clients[name].judged() as program:
            expect_outcome(program, clients[name].end, WHEN[name])
            expect_word(program, clients[name], WHEN[name])
            expect_outcome_last(program, clients[name], WHEN[name])
    expect_no_result(clients["reject"], clients["succeed"])


@points(0.5, cell="lift-client")
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
            raise Wrong(
                f"With --cancel-after N, the client did not cancel its goal, of which {MOST_FEEDBACK} feedback "
                "messages "
                "were sent.",
                program.output,
            )
        if run.before_cancel != (wanted := run.cancel_after or 0):
            did = "fewer" if run.before_cancel < wanted else "more"
            first = (
                " (Each message counts, also one that comes before the answer to the goal, or that equals another.)"
                if did == "more"
                else ""
            )
            raise Wrong(
                "With --cancel-after N, the client must cancel as soon as it has received N feedback messages. With "
                f"{wanted} as N it did so after {did} than {wanted}.{first}",
                f"after {run.before_cancel}",
            )
    late = clients["late"]
    if late.output and late.before_cancel is not None and late.before_cancel < (late.cancel_after or 0):
        with late.judged() as program:
            raise Wrong(
                "With --cancel-after N, the client must cancel as soon as it has received N feedback messages, however "
                f"long they take. With {late.cancel_after} as N it did so after {counted(late.before_cancel)}, while "
                "the next one was held back.",
                program.output,
            )
    early = clients["at the answer"]
    if early.output:  # or else it is another test's
        with early.judged() as program:
            if early.before_cancel != early.cancel_after:
                did = f"did so after {early.before_cancel} messages" if early.before_cancel else "did not cancel"
                raise Wrong(
                    "With --cancel-after N, the client must cancel as soon as it has received N feedback messages, "
                    "also when all of them came before the answer to its goal: then it cancels when the answer comes. "
                    f"With 1 as N, and the first message before the answer, it {did}.",
                    program.output,
                )


@points(0.25, cell="lift-client")
@twice
def test_client_cancels_at_once(clients: Mapping[str, Encounter]) -> None:
    """With --cancel-after 0 the client cancels as soon as the goal is accepted."""
    run = clients["at once"]
    with run.judged() as program:
        if run.before_cancel is None:
            raise Wrong("With --cancel-after 0, the client did not cancel its goal.", program.output)
        if run.before_cancel:
            raise Wrong(
                "With --cancel-after 0, the client must cancel as soon as the goal is accepted; it did so after "
                f"{counted(run.before_cancel)}."
            )


@points(0.25, cell="lift-client")
@twice
def test_client_waits_for_the_end(clients: Mapping[str, Encounter]) -> None:
    """With --cancel-after N the client waits for the end of the goal, however it ends, and says which it was."""
    for name in ("late", "few"):
        run = clients[name]
        with run.judged() as program:
            expect_outcome(program, "SUCCEEDED", WHEN[name])
        expect_status(run, WHEN[name])
    at_once = clients["at once"]
    aborted = clients["abort"]
    right = last_outcome(aborted.output) == aborted.end  # of a goal that is aborted, and was not cancelled
    if at_once.output and at_once.before_cancel is not None and right:  # or else it is another test's
        with at_once.judged() as program:
            expect_outcome(program, at_once.end, WHEN["at once"])


@points(0.25, cell="lift-client")
@twice
def test_client_without_server(bench: Bench, clients: Mapping[str, Encounter]) -> None:
    """Without a server the client gives up after 10 s at most, not at once, and says so."""
    expect_able(clients)
    beside = "\n".join(clients[name].output for name in ("succeed", "reject", "abort", "cancel"))
    expect_gives_up(bench.early["absent"], ACTION, FOUND, beside=beside)


@points(0.25, cell="lift-client")
@twice
def test_client_arguments(called: Called, clients: Mapping[str, Encounter]) -> None:
    """With wrong arguments the client prints how to use it; it ignores arguments for ROS."""
    expect_able(clients)
    for doing, run in called.misused.items():
        expect_usage(run, doing)
    if clients["succeed"].exits_with(0):  # what it ends with otherwise is another test's
        expect_for_ros(called.for_ros)
