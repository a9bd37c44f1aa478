"""What the action of section 3.2 must do, as a conversation with the student's server and client.

Points add up to 20.  The message of a failure speaks of the task; the numbers that were drawn stay with the grader.
"""

import re

from autograder.errors import Wrong
from autograder.hidden.actions.conversation import ACTION, LAST, STEP, elements
from autograder.suitekit.judge import points
from autograder.suitekit.live import finish, numbers, twice

INT32 = 2**31 - 1
OUTCOMES = ("succe", "cancel", "abort", "reject")
AT_ONCE = 0.05  # s between two messages with no step between them


@points(2, cell="fibonacci-server")
@twice
def test_sequence(quick):
    """A goal of order n succeeds with the elements 0 to n."""
    with quick.sample() as (order, goal):
        expect_elements(goal, order, "An ordinary order")
        if goal.status != "SUCCEEDED":
            raise Wrong(
                "When the sequence is computed, the goal must succeed: goal_handle.succeed(). "
                f"It ended as {goal.status}."
            )


@points(2, cell="fibonacci-server")
@twice
def test_feedback(quick):
    """Each step is reported with the sequence so far."""
    with quick.sample() as (order, goal):
        heard = [list(feedback.message.partial_sequence) for feedback in goal.feedback]
        if not heard:
            raise Wrong("There is no feedback: goal_handle.publish_feedback(...).")
        if any(sequence != elements(order)[: len(sequence)] for sequence in heard):
            raise Wrong("The feedback must be the elements so far.", f"{heard}")
        if [len(sequence) for sequence in heard if len(sequence) > 2] != list(range(3, order + 2)):
            raise Wrong(
                "There must be one feedback message for each step, each one element longer than the one before; "
                "the last is the whole sequence.",
                f"order {order}: {heard}",
            )


@points(1, cell="fibonacci-server")
@twice
def test_smallest_orders(quick):
    """Order 0 gives [0], order 1 gives [0, 1]."""
    for order in (0, 1):
        expect_elements(quick.run(order), order, f"Order {order}")


@points(1, cell="fibonacci-server")
@twice
def test_largest_order(quick):
    """Order 46, the last that fits int32, is computed."""
    expect_elements(quick.run(LAST), LAST, f"Order {LAST}")


def expect_elements(goal, order, about):
    """The result must be right."""
    sequence = list(goal.result.sequence)
    if sequence != elements(order):
        raise Wrong(
            f"{about}: the result must be the elements 0 to order, order + 1 of them.",
            f"order {order}: {goal.status} {sequence}",
        )


@points(1, cell="fibonacci-server")
@twice
def test_rejects_negative(quick, rng):
    """A negative order is rejected."""
    for order in (-1, -rng.randrange(2, 1000)):
        expect_rejection(quick, order, "A negative order")


@points(1, cell="fibonacci-server")
@twice
def test_rejects_too_large(quick, rng):
    """An order whose last element does not fit int32 is rejected."""
    for order in (LAST + 1, LAST + rng.randrange(2, 40), INT32):
        expect_rejection(quick, order, f"An order above {LAST}")


def expect_rejection(quick, order, about):
    """The answer to the goal must be no, of a server that can say yes."""
    if not quick.accepts and not quick.send(2).accepted:
        raise Wrong(f"Every goal with an order from 0 to {LAST} must be accepted.")
    if quick.send(order).accepted:
        raise Wrong(f"{about} must be rejected by a goal_callback; it was accepted.", f"order {order}")


@points(2, cell="fibonacci-server")
@twice
def test_cancel(cancelled):
    """A goal is cancelled within a step, and ends as CANCELED."""
    with cancelled.sample() as goal:
        if goal.cancel_accepted is False and goal.status != "CANCELED":
            raise Wrong(
                "The request to cancel was refused. It must be accepted by a cancel_callback, while the goal runs: "
                "if the callback is there, was there a thread to run it?"
            )
        if goal.status != "CANCELED":
            raise Wrong(
                f"A goal that is cancelled must end as CANCELED: goal_handle.canceled(). It ended as {goal.status}."
            )
        later = [heard for heard in goal.feedback if heard.time > goal.cancel_sent]
        if len(later) > 2 or not goal.feedback and goal.ended - goal.cancel_sent > 3 * STEP:
            raise Wrong(
                "After the cancel was accepted, the goal went on for more than a step.",
                f"{len(later)} more messages, ended {goal.ended - goal.cancel_sent} s later",
            )


@points(1, cell="fibonacci-server")
@twice
def test_cancelled_result(cancelled):
    """The result of a cancelled goal is the sequence so far."""
    with cancelled.sample() as goal:
        sequence = list(goal.result.sequence)
        if len(sequence) > cancelled.ORDER:
            raise Wrong("The goal was not cancelled before its end, so that there is no partial sequence.")
        if sequence != elements(cancelled.ORDER)[: len(sequence)] or len(sequence) < max(cancelled.had, 1):
            raise Wrong(
                "The result of a cancelled goal must be the elements computed so far.",
                f"{cancelled.had} elements were reported, got {sequence}",
            )


@points(1, cell="fibonacci-server")
@twice
def test_two_goals(quick):
    """Two goals run at the same time, each with its own sequence."""
    long, short, together = 40, 8, False
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
                "A short goal, sent while a long one runs, must be over before the long one is: two goals must run "
                "at the same time."
            )
    if not together and first.ended - first.sent < 0.6 * long * quick.period:  # or else the grader was late
        raise Wrong(
            "A goal of many steps is over at once, so that no second one can run beside it: each step takes "
            "step_period seconds."
        )


@points(1, cell="fibonacci-server")
@twice
def test_step_period(quick, cancelled):
    """The parameter step_period says how long a step takes, by default 1 s."""
    with quick.sample() as (order, goal):
        took, right = goal.ended - goal.sent, order * quick.period
        if not 0.6 * right < took < right + 0.5 * order * (STEP - quick.period):
            raise Wrong(
                "A step must take step_period seconds, as set on the command line (--ros-args -p step_period:=...).",
                f"took {took} s, expected {right} s",
            )
    with cancelled.sample() as goal:
        heard = [(heard.time, len(heard.message.partial_sequence)) for heard in goal.feedback]
        steps = [time for time, length in heard if length > 2]
        if len(steps) < 2 and len(heard) > 1:
            steps = [time for time, _ in heard]
            if steps[1] - steps[0] < AT_ONCE:  # [0, 1] and the first step, whose time comes after it
                return
        if len(steps) > 1 and not 0.6 * STEP < steps[1] - steps[0] < 3 * STEP:
            raise Wrong(f"Without the parameter, a step must take {STEP:.0f} s.", f"{heard}")


@points(1, cell="fibonacci-client")
@twice
def test_client_shows_feedback(clients):
    """The client sends the order, and prints each feedback message."""
    with clients["succeed"].judged("with a server that succeeds") as program:
        run = clients["succeed"]
        if run.orders[0] != run.order:
            raise Wrong("The goal must hold the ORDER of the command line.", f"sent {run.orders}, not {run.order}")
        shown = numbers(program.output)
        if any(number not in shown for sequence in run.feedback for number in sequence):
            raise Wrong(
                "The client must print the partial sequence of each feedback message.",
                f"sent {run.feedback}, shown: {program.output}",
            )


@points(1, cell="fibonacci-client")
@twice
def test_client_shows_result(clients):
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
def test_client_rejected(clients):
    """When the goal is rejected, the client says so, and exits with another status than 0."""
    with clients["reject"].judged("with a server that rejects the goal") as program:
        expect_shown(program, [], "reject", "REJECTED")
        expect_failure(program, "is rejected")


@points(1, cell="fibonacci-client")
@twice
def test_client_aborted(clients):
    """When the goal is aborted, the client says so, and exits with another status than 0."""
    with clients["abort"].judged("with a server that aborts the goal") as program:
        expect_shown(program, [], "abort", "ABORTED")
        expect_failure(program, "is aborted")


@points(1, cell="fibonacci-client")
@twice
def test_client_cancels(clients):
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


def expect_shown(program, sequence, part, word):
    """What the client has printed must have the result and the outcome."""
    if any(number not in numbers(program.output) for number in sequence):
        raise Wrong("The client must print the sequence of the result.", f"sent {sequence}, shown: {program.output}")
    if all(re.search(outcome, program.output, re.IGNORECASE) for outcome in OUTCOMES):
        raise Wrong("The client must print the outcome; it prints all that there are.", program.output)
    if not re.search(part, program.output, re.IGNORECASE):
        raise Wrong(f"The client must print the outcome, here the word {word}.", program.output)


def expect_failure(program, how):
    """Only a goal that succeeded is a success."""
    if program.exit_status == 0:
        raise Wrong(f"When the goal {how}, the client must end with an exit status other than 0: sys.exit(1).")


@points(1, cell="fibonacci-client")
def test_client_without_server(bench):
    """Without a server the client gives up within 10 s, and says so."""
    program = finish(bench.early["absent"], "without a server")
    if program.exit_status == 0:
        raise Wrong("When there is no server, the client must end with an exit status other than 0: sys.exit(1).")
    if not program.output.strip():
        raise Wrong(f"When there is no server for {ACTION}, the client must say so.")


@points(1, cell="fibonacci-client")
def test_client_arguments(misused):
    """Wrong arguments get a word on the usage."""
    for about, run in misused.items():
        program = finish(run, about)
        if program.exit_status == 0:
            raise Wrong(f"The client {about} must end with an exit status other than 0: sys.exit(2).")
        if not program.output.strip():
            raise Wrong(f"The client {about} must print how it is to be used.", program.output)
