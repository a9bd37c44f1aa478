"""What the action of section 3.2 must do, as a conversation with the student's server and client.

Points add up to 20.  The message of a failure speaks of the task; the numbers that were drawn stay with the grader.
"""

import random
import re
from collections.abc import Mapping, Sequence

from autograder.hidden.actions.conversation import (
    ACTION,
    LAST,
    NOT_ACCEPTED,
    STEP,
    Cancelled,
    Encounter,
    Quick,
    elements,
)
from autograder.sandbox.program import Program
from autograder.suitekit import Bench, Goal, Run, Wrong, expect_gives_up, expect_usage, numbers, points, twice

INT32 = 2**31 - 1
OUTCOMES = ("succe", "cancel", "abort", "reject")
AT_ONCE = 0.05  # s between two messages with no step between them
MEASURED = 0.6  # of its right length that a step must last at least


@points(2, cell="fibonacci-server")
@twice
def test_sequence(quick: Quick) -> None:
    """A goal of order n succeeds with the elements 0 to n."""
    with quick.sample() as (order, goal):
        expect_elements(goal, order, "An ordinary order")
        if goal.status != "SUCCEEDED":
            raise Wrong(
                "Once the sequence is computed, the goal must succeed: call goal_handle.succeed(). "
                f"It ended as {goal.status}."
            )


@points(2, cell="fibonacci-server")
@twice
def test_feedback(quick: Quick) -> None:
    """Each step is reported with the sequence so far."""
    with quick.sample() as (order, goal):
        heard = [list(feedback.message.partial_sequence) for feedback in goal.feedback]
        if not heard:
            raise Wrong("The goal published no feedback: call goal_handle.publish_feedback(...) after each step.")
        if any(sequence != elements(order)[: len(sequence)] for sequence in heard):
            raise Wrong("Each feedback message must hold the elements computed so far.", f"{heard}")
        if [len(sequence) for sequence in heard if len(sequence) > 2] != list(range(3, order + 2)):
            raise Wrong(
                "There must be one feedback message for each step, one element longer than the message before; the "
                "last one holds the whole sequence.",
                f"order {order}: {heard}",
            )


@points(1, cell="fibonacci-server")
@twice
def test_smallest_orders(quick: Quick) -> None:
    """Order 0 gives [0], order 1 gives [0, 1]."""
    for order in (0, 1):
        expect_elements(quick.run(order), order, f"Order {order}")


@points(1, cell="fibonacci-server")
@twice
def test_largest_order(quick: Quick) -> None:
    """Order 46, the last that fits int32, is computed."""
    expect_elements(quick.run(LAST), LAST, f"Order {LAST}")


def expect_elements(goal: Goal, order: int, about: str) -> None:
    """The result must be right."""
    sequence = list(goal.result.sequence)
    if sequence != elements(order):
        raise Wrong(
            f"{about}: the result must hold the elements 0 to order, which are order + 1 numbers.",
            f"order {order}: {goal.status} {sequence}",
        )


@points(1, cell="fibonacci-server")
@twice
def test_rejects_negative(quick: Quick, rng: random.Random) -> None:
    """A negative order is rejected."""
    for order in (-1, -rng.randrange(2, 1000)):
        expect_rejection(quick, order, "A negative order")


@points(1, cell="fibonacci-server")
@twice
def test_rejects_too_large(quick: Quick, rng: random.Random) -> None:
    """An order whose last element does not fit int32 is rejected."""
    for order in (LAST + 1, LAST + rng.randrange(2, 40), INT32):
        expect_rejection(quick, order, f"An order above {LAST}")


def expect_rejection(quick: Quick, order: int, about: str) -> None:
    """The goal must be rejected, by a server that accepts others."""
    if not quick.accepts and not quick.send(2).accepted:
        raise Wrong(NOT_ACCEPTED)
    if quick.send(order).accepted:
        raise Wrong(f"{about} must be rejected by a goal_callback; it was accepted.", f"order {order}")


@points(2, cell="fibonacci-server")
@twice
def test_cancel(cancelled: Cancelled) -> None:
    """A goal is cancelled within a step, and ends as CANCELED."""
    with cancelled.sample() as goal:
        if goal.cancel_accepted is False and goal.status != "CANCELED":
            raise Wrong(
                "The request to cancel was refused. A cancel_callback must accept it while the goal runs: if you have "
                "one, was a thread free to run it?"
            )
        if goal.status != "CANCELED":
            raise Wrong(
                f"A cancelled goal must end as CANCELED: call goal_handle.canceled(). It ended as {goal.status}."
            )
        later = [heard for heard in goal.feedback if heard.time > goal.cancel_sent]
        if len(later) > 2 or (not goal.feedback and goal.ended - goal.cancel_sent > 3 * STEP):
            raise Wrong(
                "After the cancel was accepted, the goal went on for more than a step.",
                f"{len(later)} more messages, ended {goal.ended - goal.cancel_sent} s later",
            )


@points(1, cell="fibonacci-server")
@twice
def test_cancelled_result(cancelled: Cancelled) -> None:
    """The result of a cancelled goal is the sequence so far."""
    with cancelled.sample() as goal:
        sequence = list(goal.result.sequence)
        if len(sequence) > cancelled.ORDER:
            raise Wrong("The goal ran to its end before it was cancelled, so its result is no partial sequence.")
        if sequence != elements(cancelled.ORDER)[: len(sequence)] or len(sequence) < max(cancelled.had, 1):
            raise Wrong(
                "The result of a cancelled goal must hold the elements computed so far.",
                f"{cancelled.had} elements were reported, got {sequence}",
            )


@points(1, cell="fibonacci-server")
@twice
def test_two_goals(quick: Quick) -> None:
    """Two goals run at the same time, each with its own sequence."""
    long, short, together = 40, 8, False  # orders; did a goal start while the other ran?
    for _ in range(3):
        first = quick.send(long)
        first.wait(lambda goal: goal.feedback, 10 * quick.period)
        second = quick.send(short)
        if not (first.accepted and second.accepted):
            raise Wrong("While a goal runs, a second one must be accepted.")
        first, second = quick.run(long, first), quick.run(short, second)
        expect_elements(first, long, "Two goals at the same time")
        expect_elements(second, short, "Two goals at the same time")
        together = together or second.sent < first.ended
        if second.ended < first.ended:
            break
        if first.ended - second.sent > 2 * short * quick.period:  # or else the grader was late with the second
            raise Wrong(
                "A short goal that is sent while a long one runs must end before the long one: two goals must run at "
                "the same time."
            )
    if not together and first.ended - first.sent < MEASURED * long * quick.period:  # or else the grader was late
        raise Wrong(
            "A goal of many steps ended at once, so that no second goal could run beside it: each step must take "
            "step_period seconds."
        )


@points(1, cell="fibonacci-server")
@twice
def test_step_period(quick: Quick, cancelled: Cancelled) -> None:
    """The parameter step_period says how long a step takes, by default 1 s."""
    with quick.sample() as (order, goal):
        took, right = goal.ended - goal.sent, order * quick.period
        if not MEASURED * right < took < right + 0.5 * order * (STEP - quick.period):
            raise Wrong(
                "Each step must take step_period seconds, as set on the command line (--ros-args -p step_period:=...).",
                f"took {took} s, expected {right} s",
            )
    with cancelled.sample() as goal:
        heard = [(heard.time, len(heard.message.partial_sequence)) for heard in goal.feedback]
        steps = [time for time, length in heard if length > 2]
        if len(steps) < 2 and len(heard) > 1:
            steps = [time for time, _ in heard]
            if steps[1] - steps[0] < AT_ONCE:  # [0, 1] and the first step, whose time comes after it
                return
        if len(steps) > 1 and not MEASURED * STEP < steps[1] - steps[0] < 3 * STEP:
            raise Wrong(f"When step_period is not set, each step must take {STEP:.0f} s.", f"{heard}")


@points(1, cell="fibonacci-client")
@twice
def test_client_shows_feedback(clients: Mapping[str, Encounter]) -> None:
    """The client sends the order, and prints each feedback message."""
    with clients["succeed"].judged("with a server that succeeds") as program:
        run = clients["succeed"]
        if run.orders[0] != run.order:
            raise Wrong(
                "The client's goal must hold the ORDER from its command line.", f"sent {run.orders}, not {run.order}"
            )
        shown = numbers(program.output)
        if any(number not in shown for sequence in run.feedback for number in sequence):
            raise Wrong(
                "The client must print the partial sequence of each feedback message.",
                f"sent {run.feedback}, shown: {program.output}",
            )


@points(1, cell="fibonacci-client")
@twice
def test_client_shows_result(clients: Mapping[str, Encounter]) -> None:
    """When the goal succeeds, the client prints the result and the outcome, and exits with 0."""
    with clients["succeed"].judged("with a server that succeeds") as program:
        expect_shown(program, clients["succeed"].result, "succe", "SUCCEEDED")
        if program.exit_status:
            raise Wrong(
                "When the goal has succeeded, the client must end with exit status 0; it ended with "
                f"{program.last_words()}.",
                program.output,
            )


@points(1, cell="fibonacci-client")
@twice
def test_client_rejected(clients: Mapping[str, Encounter]) -> None:
    """When the goal is rejected, the client says so, and exits with another status than 0."""
    with clients["reject"].judged("with a server that rejects the goal") as program:
        expect_shown(program, [], "reject", "REJECTED")
        expect_failure(program, "is rejected")


@points(1, cell="fibonacci-client")
@twice
def test_client_aborted(clients: Mapping[str, Encounter]) -> None:
    """When the goal is aborted, the client says so, and exits with another status than 0."""
    with clients["abort"].judged("with a server that aborts the goal") as program:
        expect_shown(program, [], "abort", "ABORTED")
        expect_failure(program, "is aborted")


@points(1, cell="fibonacci-client")
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
        expect_shown(program, run.result, "cancel", "CANCELED")
        expect_failure(program, "is cancelled")


def expect_shown(program: Program, sequence: Sequence[int], part: str, word: str) -> None:
    """The client must have printed the result and the outcome."""
    if any(number not in numbers(program.output) for number in sequence):
        raise Wrong("The client must print the sequence in the result.", f"sent {sequence}, shown: {program.output}")
    if all(re.search(outcome, program.output, re.IGNORECASE) for outcome in OUTCOMES):
        raise Wrong("The client must print the one outcome that happened; it prints all of them.", program.output)
    if not re.search(part, program.output, re.IGNORECASE):
        raise Wrong(f"The client must print the outcome: here, the word {word}.", program.output)


def expect_failure(program: Program, how: str) -> None:
    """The client must report with its exit status that the goal did not succeed."""
    if program.exit_status == 0:
        raise Wrong(f"When the goal {how}, the client must end with an exit status other than 0: sys.exit(1).")


@points(1, cell="fibonacci-client")
def test_client_without_server(bench: Bench) -> None:
    """Without a server the client gives up within 10 s, and says so."""
    expect_gives_up(bench.early["absent"], ACTION)


@points(1, cell="fibonacci-client")
def test_client_arguments(misused: Mapping[str, Run]) -> None:
    """With wrong arguments the client prints how to use it."""
    for doing, run in misused.items():
        expect_usage(run, doing)
