"""Tests of the calculator of section 3.5, as a conversation with the student's server and client.

Points add up to 20, 5 of them for what the exercise is about: a server that refuses what cannot be done, says so, and
goes on.  The message of a failure says what the program did, beside what the task asks; the numbers that were drawn
stay with the grader.  A refusal, a log or an end earns points only with a program that also does something: see
`Calculator.abilities` and `ClientRuns.expect_call`.
"""

import contextlib
import json
import math
import random
import re
from collections.abc import Callable, Mapping
from functools import cache
from itertools import product
from typing import Any

from calculator_interfaces.srv import Calculate

from autograder.hidden.calculator.arithmetic import ANSWERS, plain_numbers
from autograder.hidden.calculator.conversation import (
    CHATTER,
    FEW,
    ROUNDING,
    SERVICE,
    Calculator,
    Call,
    ClientRuns,
    LeftAlone,
    about_right,
    has_right_result,
    in_one_line,
    quoted,
    same,
    told,
)
from autograder.sandbox.cleaning import CONTROL
from autograder.suitekit import (
    TimedOut,
    Wrong,
    expect_patience,
    expect_patience_when_asked,
    expect_words,
    numbers,
    on_wrong,
    plain_lines,
    points,
    twice,
    when_changed,
)
from course.foundation.waiting import wait_until
from course.interfaces import InterfaceError, parse
from course.interfaces.definition import Field

REQUEST = [("float64", "a"), ("float64", "b"), ("string", "operation")]
RESPONSE = [("float64", "result"), ("bool", "success"), ("string", "message")]
FLOAT64 = 1e-15  # of the numbers' size: several ways to compute the same are right, rounding to 14 digits is not
LEAST = 5e-324  # the smallest float64 above 0
SHOWN = 0.06  # what rounding to one decimal may cost a result that the client prints
INFINITE = re.compile(r"(?<![a-z])inf(inity)?(?![a-z])|∞", re.IGNORECASE)  # and not as in "[INFO]"
FOUND = 1.0  # s for which the client must wait for a server, and then for its answer, by the task
WRITTEN = 3.0  # s until a log line has arrived
LEFT = 6.0  # s for which nobody asks the server for anything
LATER = 2.5  # s after a refusal for which the server is seen to go on
REFUSALS = 8  # in a row, each of which must be one
LETTERS = "bdfgklmnp"  # of words that are no operation
BY_ZERO = "division by zero"  # in the task's words
OF_PYTHON = re.compile(  # its messages for what is wrong with the arguments, with no word of the program's own
    r"(ValueError: |IndexError: )?(not enough values to unpack \(expected \d+, got \d+\)"
    r"|too many values to unpack \(expected \d+(, got \d+)?\)"
    r"|could not convert string to float: '\w*'|list index out of range)"
)
UNANSWERED = "with a server that gives no answer"
TESTED_WITH = "(Your programs were tested with the correct definition.)"


@points(1, cell="calculate-srv")
def test_interface_request(submission: Mapping[str, bytes]) -> None:
    """Calculate.srv has the request of the task."""
    request, _ = sections(submission)
    expect_fields("request", request, REQUEST)


@points(0.5, cell="calculate-srv")
def test_interface_response(submission: Mapping[str, bytes]) -> None:
    """Calculate.srv has the response of the task."""
    _, response = sections(submission)
    expect_fields("response", response, RESPONSE)


@points(0.5, cell="calculate-srv")
def test_interface_nothing_else(submission: Mapping[str, bytes]) -> None:
    """Calculate.srv has no other fields, no defaults and no constants."""
    for fields, right in zip(sections(submission), (REQUEST, RESPONSE), strict=True):
        for field in fields:
            if field.value is not None:
                raise Wrong(
                    f"Calculate.srv must have no defaults and no constants; {field.name} has a value. {TESTED_WITH}"
                )
        if len(fields) > len(right):
            raise Wrong(f"Calculate.srv must have the fields of the task and nothing else. {TESTED_WITH}")


def sections(submission: Mapping[str, bytes]) -> tuple[tuple[Field, ...], ...]:
    """The fields of the request and of the response in the submitted Calculate.srv."""
    try:
        text = submission["Calculate.srv"].decode()
    except UnicodeDecodeError:
        raise Wrong("Calculate.srv is not UTF-8 text: save it as UTF-8, or leave out letters like ä and é.") from None
    for mark, name in (("\ufeff", "a byte order mark (BOM)"), ("\0", "a NUL character")):
        if mark in text:
            raise Wrong(f"Calculate.srv contains {name}, which ROS 2 cannot read: save the file as plain UTF-8 text.")
    read = parsed(text)
    if isinstance(read, InterfaceError):
        raise Wrong(str(read) if str(read).endswith("?") else f"{read}.")
    return read


@cache
def parsed(text: str) -> tuple[tuple[Field, ...], ...] | InterfaceError:
    """The sections of a definition, or what is wrong with it; read once, because a long one takes its time."""
    try:
        return tuple(parse(text, "Calculate.srv").sections)
    except InterfaceError as error:
        return error


def expect_fields(section: str, fields: tuple[Field, ...], right: list[tuple[str, str]]) -> None:
    """A section has these types and names in this order; another test judges what it has besides."""
    names = {name for _, name in right}
    if [(field.type, field.name) for field in fields if field.name in names] != right:
        raise Wrong(
            f"The {section} in Calculate.srv must have exactly these fields, in this order: "
            f"{', '.join(' '.join(field) for field in right)}. {TESTED_WITH}"
        )


@points(1, cell="calculator-server")
def test_add(calculator: Calculator, left_alone: LeftAlone, rng: random.Random) -> None:
    """The server adds."""
    judge_operation(calculator, rng, "add")
    left_alone.leave("add", calculator.bench.clock.allow(WRITTEN))  # which later tests look at


@points(1, cell="calculator-server")
def test_subtract(calculator: Calculator, rng: random.Random) -> None:
    """The server subtracts."""
    judge_operation(calculator, rng, "subtract")


@points(1, cell="calculator-server")
def test_multiply(calculator: Calculator, rng: random.Random) -> None:
    """The server multiplies."""
    judge_operation(calculator, rng, "multiply")


@points(1, cell="calculator-server")
def test_divide(calculator: Calculator, rng: random.Random) -> None:
    """The server divides."""
    judge_operation(calculator, rng, "divide")


def judge_operation(calculator: Calculator, rng: random.Random, operation: str) -> None:
    """Ordinary numbers; a result may be rounded."""
    for signs, about in [
        ((1, 1), "ordinary numbers"),
        ((-1, 1), "a negative number"),
        ((1, -1), "a negative number"),
        ((-1, -1), "two negative numbers"),
    ]:
        a, b = calculator.new_numbers(rng)
        calculator.expect(signs[0] * a, operation, signs[1] * b, about, ROUNDING)
    a, b = calculator.new_numbers(rng)
    calculator.expect(a + 0.5, operation, b + 0.75, "numbers that are not whole", ROUNDING)
    calculator.expect(0.0, operation, b, "a = 0", ROUNDING)
    if operation != "divide":
        calculator.expect(a, operation, 0.0, "b = 0", ROUNDING)
    a, _ = calculator.new_numbers(rng)
    if operation in (like := {"add": -a, "subtract": a}):
        calculator.expect(a, operation, like[operation], "numbers that make 0", ROUNDING)


@points(0.5, cell="calculator-server")
def test_precision(calculator: Calculator, rng: random.Random) -> None:
    """Results have the precision of float64, for large, small and fractional numbers."""
    # A wrong operation loses its own point, not this one; if no negative number works, positive ones have to do.
    signed = calculator.operations(*plain_numbers(rng))
    operations, signs = (signed, [-1, 1]) if signed else (dict.fromkeys(calculator.abilities, False), [1])
    for exponents, about in [
        ((0, 0), "numbers with many decimals"),
        ((150, 149), "very large numbers"),
        ((-140, -141), "numbers very close to 0"),
        ((-3, -2), "small fractions"),
        ((100, -100), "a very large and a very small number"),
    ]:
        for operation, success in operations.items():
            a, b = (rng.choice(signs) * rng.uniform(1, 10) * 10.0**exponent for exponent in exponents)
            size = max(abs(a), abs(b)) if operation in ("add", "subtract") else abs(ANSWERS[operation](a, b))
            calculator.expect(
                a,
                operation,
                b,
                f"{about} (do not round the result, and treat only 0 itself as 0)",
                FLOAT64 * size,
                success,
            )
    if "divide" in operations:
        about = "the smallest numbers that float64 has (only 0 itself is 0)"
        calculator.expect(3 * LEAST, "divide", LEAST, about, FLOAT64, operations["divide"])
    if "multiply" in operations:
        about = "small numbers (a float64 holds a result as small as theirs)"
        a, b = rng.randrange(3, 100) * 2.0**-540, 2.0**-530
        calculator.expect(a, "multiply", b, about, LEAST, operations["multiply"])


@points(5, cell="calculator-server")
def test_refuses_and_goes_on(calculator: Calculator, rng: random.Random) -> None:
    """A division by zero and an unknown operation are refused, and the server keeps running."""
    question, answer = next(iter(calculator.answers([plain_numbers(rng)]).items()))
    word, starts = "".join(rng.choices(LETTERS, k=9)), calculator.starts
    for operation, b, about in [("divide", 0.0, "A division by zero"), (word, 2.5, "An unknown operation")]:
        calculator.expect_refused(rng.uniform(1, 9), operation, b, about)
        if not same(after := calculator.ask(*question), answer):
            raise Wrong(
                f"{about} must change nothing, but the request after it is answered otherwise than before: with "
                f"{told(after, answer)}.",
                f"got {after}",
            )
    program = calculator.program
    wait_until(lambda: not program.alive, LATER)
    calculator.ask(*question)
    if calculator.starts != starts:
        raise Wrong("The server answered what cannot be done, but then it ended. It must go on.")
    for _ in range(REFUSALS):
        calculator.expect_refused(rng.uniform(1, 9), "divide", 0.0, "Each division by zero, one after the other,")


@points(0.5, cell="calculator-server")
def test_division_by_zero(calculator: Calculator, rng: random.Random) -> None:
    """Dividing by zero is refused with a message, and dividing by other numbers is not."""
    a, b = plain_numbers(rng)
    abilities, response = calculator.abilities, calculator.ask(a, "divide", b)
    if not response.success and "divide" not in abilities:
        raise Wrong("A division by another number than 0 is not done either: this shows nothing of a division by zero.")
    for a, b in [(rng.uniform(1, 100), 0.0), (rng.uniform(-100, -1), 0.0), (0.0, 0.0), (rng.uniform(1, 100), -0.0)]:
        calculator.expect_refusal(a, "divide", b, "0 divided by 0" if a == 0 else "A division by zero")


@points(0.5, cell="calculator-server")
def test_unknown_operation(calculator: Calculator, rng: random.Random) -> None:
    """An operation that does not exist is refused with a message of its own, and known ones are not."""
    word = "".join(rng.choices(LETTERS, k=9))
    unknown = {"modulo": "The operation 'modulo'", word: "An unknown operation", "": "An empty operation"}
    for name in calculator.abilities:
        for near in (name + word[:4], name[:-1], name[:3], name[0] + word):
            if near != name:
                unknown[near] = f"An unknown operation whose name begins as '{name}' does"
    for operation, about in unknown.items():
        if not operation:  # right after a request that was done: it must not be done again
            calculator.ask(rng.uniform(1, 9), calculator.abilities[0], rng.uniform(1, 9))
        calculator.expect_refusal(rng.uniform(1, 9), operation, rng.uniform(1, 9), about)
    by_zero = calculator.provoke(rng.uniform(1, 9), "divide", 0.0)
    for b, about in [(rng.uniform(1, 9), "An unknown operation"), (0.0, "An unknown operation with b = 0")]:
        message = calculator.provoke(rng.uniform(1, 9), word, b)
        if message and reason(message) == reason(by_zero):
            raise Wrong(
                f"{about} is refused with the message {quoted(message)}, which is the same as that for a division by "
                "zero: the message must say why.",
                f"got {message!r}",
            )
        if BY_ZERO in message.lower() and b and says_unknown(by_zero):
            raise Wrong(
                f"{about} is refused with the message {quoted(message)}, and a division by zero with "
                f"{quoted(by_zero)}: the message must say why.",
                f"got {message!r} and {by_zero!r}",
            )


def says_unknown(message: str) -> bool:
    """Return True if a message says in the task's words that an operation is unknown, and does not mention zero."""
    return "unknown" in message.lower() and not re.search("zero|0", message, re.IGNORECASE)


def reason(message: str) -> str:
    """A message without the numbers in it, which may count requests."""
    return re.sub(r"\d+", "", in_one_line(message))


@points(0.5, cell="calculator-server")
def test_each_answer_stands_alone(calculator: Calculator, left_alone: LeftAlone, rng: random.Random) -> None:
    """Each answer depends on its own request alone: not on earlier ones, nor on another client's at the same time."""
    before = calculator.answers([plain_numbers(rng)])
    refused = [(1.0, "modulo", 2.0), (1.0, "", 2.0)]  # what follows a division by zero, another test judges
    for (question, answer), bad in product(before.items(), refused):
        refusal = calculator.provoke(*bad)
        after = calculator.ask(*question)
        if not same(after, answer):
            raise Wrong(
                "After a refused request, an ordinary request must be answered as it was before. The same request is "
                f"answered otherwise now: with {told(after, answer)}.",
                f"got {after}",
            )
        if refusal and after.message == refusal != answer.message:
            raise Wrong(
                "After a refused request, the next answer still has the message of the refusal.", f"got {after}"
            )
    (a, b), (c, d) = plain_numbers(rng), plain_numbers(rng)
    signed = calculator.operations(a, b)
    for operation in calculator.abilities:
        for question in [(a, operation, b), (a, operation, d), (c, operation, b)]:
            if not about_right(question, response := calculator.ask(*question)):
                if question == (a, operation, b) and len(calculator.abilities) > 1:  # of which each was asked for
                    raise Wrong(
                        "When the numbers of an earlier request come with another operation, the answer must fit the "
                        f"new operation. With '{operation}' it does not.",
                        f"{question}: got {response}",
                    )
                raise Wrong(
                    "When only one of the two numbers is another than in an earlier request, the answer must fit the "
                    f"new numbers. With '{operation}' it does not.",
                    f"{question}: got {response}",
                )
        if operation in signed and not has_right_result((b, operation, a), response := calculator.ask(b, operation, a)):
            raise Wrong(
                "When a and b of an earlier request change places, the answer must fit the new request. With "
                f"'{operation}' it does not.",
                f"{operation} {b} {a}: got {response}",
            )
    expect_all_digits_matter(calculator, rng)
    expect_same_for_two_clients(calculator, rng)
    wait = calculator.bench.clock.allow(WRITTEN)
    if wrong := left_alone.after_silence(calculator.abilities[0], LEFT, wait):
        raise Wrong(wrong)


def expect_all_digits_matter(calculator: Calculator, rng: random.Random) -> None:
    """A request that differs from an earlier one only in a late digit gets an answer of its own."""
    a, b = calculator.new_numbers(rng)
    for operation in calculator.abilities:
        first, second = (a + 0.1111111, operation, b), (a + 0.1111112, operation, b)
        before, right = calculator.ask(*first).result, ANSWERS[operation](first[0], b)
        # Rounded results, which other tests judge, may well be the same.
        if math.isclose(before, right, rel_tol=1e-12) and (response := calculator.ask(*second)).result == before:
            raise Wrong(
                f"With '{operation}', and with a number that differs only in its seventh decimal from that of an "
                "earlier request, the answer must fit the new number. It has the result of the earlier request.",
                f"{second}: got {response}",
            )


def expect_same_for_two_clients(calculator: Calculator, rng: random.Random) -> None:
    """Two clients that call at the same time each get their own answers."""
    alone = calculator.answers([plain_numbers(rng) for _ in range(5)])
    together = calculator.ask_from_two([*alone])
    for question, response in together:
        if not same(response, alone[question]):
            raise Wrong(
                f"When two clients call at the same time, a request with '{question[1]}' is answered otherwise than "
                f"when it comes alone: with {told(response, alone[question])}.",
                f"{question}: alone {alone[question]}, together {response}",
            )


@points(0.5, cell="calculator-server")
def test_survives_bad_requests(calculator: Calculator, rng: random.Random) -> None:
    """The server keeps working after unusual requests."""
    question, answer = next(iter(calculator.answers([plain_numbers(rng)]).items()))
    starts = calculator.starts
    for a, operation, b in [
        (1.0, "divide", 0.0),
        (1.0, "modulo", 2.0),
        (1.0, "", 2.0),
        (2.0, "x" * 5000, 3.0),
        (3.0, "Überlauf 除法\n%s{}", 2.0),
        (1.0, "destroy_node", 2.0),  # names of what every node has
        (1.0, "__init__", 2.0),
        (1e308, "add", 1e308),  # no float64 is as large as what these make
        (-1e308, "subtract", 1e308),
        (1e308, "multiply", -10.0),
        (-1e308, "divide", 0.1),
        (math.inf, "subtract", math.inf),
        *((math.inf, operation, 1.0) for operation in ANSWERS),
        *((1.0, operation, math.nan) for operation in ANSWERS),
    ]:
        calculator.ask(a, operation, b)
    after = calculator.ask(*question)
    if calculator.starts != starts:
        raise Wrong("The server answered several unusual requests, but then it ended. It must go on.")
    if not same(after, answer):
        raise Wrong(
            "After several unusual requests, an ordinary request must be answered as it was before. The same request "
            f"is answered otherwise now: with {told(after, answer)}.",
            f"got {after}",
        )


@points(0.25, cell="calculator-server")
@twice
def test_logs_requests(calculator: Calculator, rng: random.Random) -> None:
    """The server logs each request, a refused one too, with its numbers and its operation."""

    def numbers_like_no_others() -> list[float]:
        return [number + 0.5 for number in rng.sample(range(100_009, 499_999), 2)]  # of seven digits

    for operation in calculator.abilities:
        a, b = numbers_like_no_others()
        expect_log_of_request(calculator, (a, operation, b), f"a request with '{operation}'")
    a, b = numbers_like_no_others()
    word = "".join(rng.choices(LETTERS, k=9)).capitalize()
    for refused, about in [((a, "divide", 0.0), "a division by zero"), ((b, word, a), "an unknown operation")]:
        if calculator.gets_answer(refused):  # that it gets one, other tests judge
            expect_log_of_request(calculator, refused, about)
    a, b = numbers_like_no_others()
    if not calculator.logs_each((a, calculator.abilities[0], b), calculator.bench.clock.allow(WRITTEN)):
        raise Wrong(
            "When the same request comes twice, one right after the other, the server must log (or print) a line with "
            "a, b and the operation for each of the two. The log has fewer lines with both numbers."
        )


def expect_log_of_request(calculator: Calculator, question: tuple[float, str, float], kind: str) -> None:
    """Asking this adds a, b and the operation to the log."""
    a, _, b = question
    if not calculator.logs_request(question, calculator.bench.clock.allow(WRITTEN)):
        logged = set(map(abs, numbers(calculator.log)))
        if {abs(a), abs(b)} <= logged:
            raise Wrong(
                f"After {kind}, the server must have logged (or printed) a line with a, b and the operation. Both "
                "numbers are in the log, but not in one line with the operation's name as it was asked."
            )
        missing = " and ".join(name for name, number in (("a", a), ("b", b)) if abs(number) not in logged)
        raise Wrong(
            f"After {kind}, the server must have logged (or printed) a line with a, b and the operation. The log does "
            f"not have its {missing}, rounded to two decimals at most."
        )


@points(0.25, cell="calculator-server")
@twice
def test_logs_responses(calculator: Calculator, left_alone: LeftAlone, rng: random.Random) -> None:
    """The server logs each response: its result, or the message of a refusal."""
    wait = calculator.bench.clock.allow(WRITTEN)
    for operation in calculator.abilities:
        # Twice: what a talkative program has said is soon out of reach.
        questions = [(rng.randrange(7009, 8999) + 0.5, operation, rng.randrange(5009, 5999) + 0.25) for _ in "12"]
        if not any(calculator.logs_result(question, wait) for question in questions):
            raise Wrong(
                f"After the response to '{operation}', the server must have logged (or printed) the response's result, "
                "rounded to two decimals at most. No log line since the request has this number."
            )
        if calculator.logged_all:
            raise Wrong(
                f"After the response to '{operation}', the log has the results of all four operations, so that it does "
                "not tell which one was sent: log the response's result alone."
            )
    expect_log_of_results(calculator, rng, wait)
    for operation, about in (("divide", "a division by zero"), ("modulo", "an unknown operation")):
        if not calculator.logs_refusal(rng.uniform(1, 9), operation, 0.0, wait):
            raise Wrong(
                f"After it has refused {about}, the server must have logged (or printed) the message of its response. "
                "No log line since the request has this message."
            )
    if not left_alone.logs_first(calculator.abilities[0], wait):
        raise Wrong(
            "The server must log (or print) each response, also the first one after its start. The log does not have "
            "the result of the first response, in each of two starts; later ones it has."
        )


def expect_log_of_results(calculator: Calculator, rng: random.Random, wait: float) -> None:
    """A result of 0, and a negative one with its sign, are logged as others are."""
    zero, negative = (lambda result: result == 0.0), (lambda result: result < 0.0)
    for about, fits, ways in [
        ("a result of 0", zero, [(1, "subtract", 1), (1, "add", -1)]),
        ("a negative result, with its sign", negative, [(1, "subtract", 3), (-1, "add", -2), (-1, "multiply", 2)]),
    ]:
        for p, operation, q in ways:
            first, *others = [(p * x, operation, q * x) for x in (rng.randrange(1009, 2999) + 0.25 for _ in "123")]
            # Whether it is done, and its result, other tests judge.
            if operation in calculator.abilities and (done := calculator.ask(*first)).success and fits(done.result):
                if not any(calculator.logs_result(question, wait) for question in others):
                    raise Wrong(
                        f"The log must have the result of each response, also {about}. After a response to "
                        f"'{operation}' with such a result, no log line since the request has it."
                    )
                break


@points(1, cell="calculator-client")
def test_client_sends(runs: ClientRuns) -> None:
    """The client sends what it is given, once."""
    call = runs.answered
    a, b, operation = call.sent
    right = Calculate.Request(a=float(a), b=float(b), operation=operation)
    runs.expect_call()
    for last in (False, True):
        call.run.until(lambda: False)  # its end
        if other := [request for request in call.requests if request != right]:
            raise Wrong(
                "The client must send a, b and the operation of its command line. Its request has "
                f"{differences(other[0], right)}.",
                f"sent {other[0]}, not {right}",
            )
        if len(call.requests) <= 1:
            break
        if last:
            raise Wrong(f"The client must call {SERVICE} once; it has sent {len(call.requests)} requests.")
        call.repeat()
    refused = [request for request in runs.refused.requests if request.operation == "divide" and request.b == 0.0]
    if len(refused) > 1:
        raise Wrong(f"The client must call {SERVICE} once; when it was refused, it has sent {len(refused)} requests.")
    call = runs.unusual
    a, b, operation = call.sent[:3]
    if not call.reached:
        call.run.finish("with numbers such as 1e-5 and +.5, and an operation that it does not know")
        raise Wrong(
            "With numbers such as 1e-5 and +.5, an operation that only the server can refuse, and arguments for ROS "
            f"behind them (--ros-args ...), no request came to {SERVICE}. {call.what_it_did}",
            call.run.output,
        )
    if (sent := call.requests[0]) != (right := Calculate.Request(a=float(a), b=float(b), operation=operation)):
        raise Wrong(
            "The client must send the two numbers and the operation as they are given, also an operation that it does "
            f"not know. Its request has {differences(sent, right)}.",
            f"{sent}, not {right}",
        )
    if call.run.until(lambda: len(call.requests) > call.run.starts):
        raise Wrong(
            f"The client must call {SERVICE} once, also when no answer comes: with a server that gives none, it has "
            f"sent {len(call.requests)} requests.",
            call.run.output,
        )
    if not (call := runs.nameless).reached or call.requests[0].operation:
        call.run.finish("with an empty operation")
        raise Wrong(
            "Which operations there are, only the server decides, also with an empty one (python3 "
            f'calculator_client.py 3 4 ""): it must go to {SERVICE} as it is given. {call.what_it_did}',
            call.run.output,
        )


@points(1, cell="calculator-client")
def test_client_shows_result(runs: ClientRuns) -> None:
    """The client shows the result of the server's response."""
    runs.expect_call()
    if not runs.answered.comes_to(when_changed(lambda: runs.answered.run.output, lambda _: shows_result(runs))):
        output = runs.answered.run.finish("with a server that answers").output
        raise Wrong(
            "When success is True, the client must show the result of the response, with its sign, rounded to one "
            f"decimal at most. {runs.answered.what_it_did} {how_shown(runs)}",
            f"answered {runs.answered.response}, shown: {output}",
        )
    for call, name, shown in specials(runs):
        if not call.comes_to(lambda call=call, shown=shown: shown(call.run.output)):  # type: ignore[misc]
            output = call.run.finish(answered(call, name)).output
            raise Wrong(
                f"When success is True, the client must show the result of the response, also {answered(call, name)}. "
                f"{call.what_it_did}",
                f"answered {call.response}, shown: {output}",
            )


def specials(runs: ClientRuns) -> list[tuple[Call, str, Callable[[str], bool]]]:
    """Return each call whose result is a special one, with its name, and how the output is seen to show it."""
    return [
        (runs.infinite, "inf", lambda output: bool(INFINITE.search(CONTROL.sub("", output.partition("Traceback")[0])))),
        (runs.zero, "0", lambda output: any(abs(number) < SHOWN for number in numbers(CONTROL.sub("", output)))),
    ]


def answered(call: Call, result: str) -> str:
    """Return which call this is, for the student."""
    operation = call.sent[2]
    kind = "an operation" if operation in ANSWERS else "an operation that only the server knows"
    return f"with {kind if operation else 'an empty operation'} and the result {result}"


def shows_result(runs: ClientRuns) -> bool:
    """Return True if the client has shown the result in the server's response."""
    result = runs.answered.response.result
    found = [number for number in numbers(runs.answered.run.output) if 1e9 <= abs(number) <= 9e9 + 1]  # as results
    return len(found) <= CHATTER and any(abs(number - result) < SHOWN for number in found)


def how_shown(runs: ClientRuns) -> str:
    """Return how the client has shown the result wrongly, as a sentence for the student."""
    result, found = runs.answered.response.result, numbers(runs.answered.run.output)
    if any(abs(number + result) < SHOWN for number in found):
        return "The sign is not that of the result."
    if any(math.isclose(number, result, rel_tol=1e-4) for number in found):
        return "The result is rounded further."
    return "No number there is near the result."


@points(1, cell="calculator-client")
def test_client_shows_message(runs: ClientRuns) -> None:
    """When the server refuses, the client shows its message as it is."""
    call = runs.refused
    if not call.reached:
        call.run.finish("with a server that refuses")
        raise Wrong(
            f"With a b of 0 and the operation divide, the client did not call {SERVICE}: the server decides what it "
            f"refuses, and the client shows its message. {call.what_it_did}",
            call.run.output,
        )
    expect_message(call, "with a server that refuses", "")
    if runs.refused_unknown.reached:  # that it calls, another test judges
        doing = "with a server that refuses an operation that only the server knows"
        expect_message(runs.refused_unknown, doing, ", also when an operation other than a division is refused")


def expect_message(call: Call, doing: str, also: str) -> None:
    """The client shows the message of a refusal."""
    message = call.response.message
    ways = message, message.replace("\n", "\\n")  # a client may print it in quotes, or the whole response
    if not call.comes_to(lambda: any(way in call.run.output for way in ways)):
        output = call.run.finish(doing).output
        raise Wrong(
            f"When success is False, the client must show the message of the response as it is{also}. "
            f"{call.what_it_did}{how_differs(message, output)}",
            f"answered {message!r}, shown: {output}",
        )


def how_differs(message: str, output: str) -> str:
    """Return how the output differs from a message that it has almost, as a sentence for the student; else nothing."""
    if any(way in output for way in (message.strip(), message.strip().replace("\n", "\\n"))):
        return " It has the message, but for the blanks at its begin or at its end."
    if message.strip().rstrip(".") in output:
        return " It has the message, but for the dots at its end."
    first, second = (line.strip() for line in message.splitlines())
    if first in output and second[:20] not in output:
        return " It has only the first line of the message."
    if in_one_line(message) in in_one_line(output):
        return " It has the words of the message, with other blanks or line ends between them."
    for codec, letters in (("ASCII", "é and ж"), ("Latin-1", "ж")):
        ways = [message.encode(codec, how).decode(codec) for how in ("backslashreplace", "replace", "ignore")]
        if any(way in output for way in (*ways, json.dumps(message)[1:-1], ascii(message)[1:-1])):
            return f" It has the message, but for the letters outside of {codec} (such as {letters})."
    return ""


@points(0.5, cell="calculator-client")
def test_client_without_server(runs: ClientRuns) -> None:
    """Without a server the client gives up after 10 s at most, not at once, and says so."""
    runs.expect_call()
    expect_words(
        runs.absent,
        "without a server",
        f"say that it found no server for {SERVICE}",
        beside=in_other_cases(runs),
        ignoring=ANSWERS,
    )
    expect_patience(runs.absent, "without a server", FOUND)


@points(0.5, cell="calculator-client")
@twice
def test_client_without_answer(runs: ClientRuns) -> None:
    """When the server gives no answer, the client gives up after 10 s at most, not at once, and says so."""
    runs.expect_call()
    if not (call := runs.unanswered).reached:
        call.run.finish(UNANSWERED)
        raise Wrong(f"With a server that gives no answer, no request came to {SERVICE}. {call.what_it_did}")
    expect_words(
        call.run,
        UNANSWERED,
        f"say that {SERVICE} did not answer",
        beside=in_other_cases(runs),
        ignoring=(*ANSWERS, call.sent[2].strip()),  # a line that repeats the operation says nothing new by it
    )
    with on_wrong(call.repeat):
        expect_patience_when_asked(call.run, UNANSWERED, call.asked, FOUND)


def in_other_cases(runs: ClientRuns) -> str:
    """Return what the client prints when /calculator is there and answers, or when it is used wrongly."""
    runs.answered.run.until(lambda: False)  # its end
    runs.refused.run.until(lambda: False)
    printed = [runs.answered.run.output] if shows_result(runs) else []
    printed += [runs.refused.run.output] if runs.refused.response.message in runs.refused.run.output else []
    for run in runs.misused.values():
        run.until(lambda: False)
        printed.append(run.output)
    return "\n".join(printed)


@points(1, cell="calculator-client")
def test_client_arguments(runs: ClientRuns) -> None:
    """With wrong arguments the client prints how to use it."""
    runs.expect_call()
    runs.answered.run.until(lambda: False)  # its end
    always = runs.answered.run.output if shows_result(runs) else ""
    for doing, run in runs.misused.items():
        expect_words(run, doing, must := "print how to use it", beside=always, ignoring=ANSWERS)
        if all(OF_PYTHON.fullmatch(line.strip()) for line in run.output.splitlines() if line.strip()):
            raise Wrong(
                f"{doing[0].upper()}{doing[1:]}, the client must {must}: it printed only the message of Python's "
                "exception.",
                run.output,
            )
        if runs.refused.response.message in run.output:
            raise Wrong(
                f"{doing[0].upper()}{doing[1:]}, the client must print how to use it, and not call {SERVICE}. It "
                "called, and printed the server's message."
            )
    if requests := runs.wrongly.requests:
        raise Wrong(
            f"With wrong arguments, the client must {must}, and not call {SERVICE}. In {len(runs.misused)} runs with "
            f"too few or too many arguments, or with a word in the place of a number, it has called {len(requests)} "
            f"time{'s' * (len(requests) > 1)}.",
            requests,
        )
    doing, alone, few = f"{FEW} and without a server", runs.misused_alone, runs.misused[FEW]
    with_server = plain_lines(few.output, ANSWERS)
    if plain_lines(alone.finish(doing).output, ANSWERS) != with_server:  # the server may make no difference
        expect_words(alone, doing, f"{must}, too", beside=f"{always}\n{runs.absent.output}", ignoring=ANSWERS)
        if not words(alone.output) & words(few.output):
            raise Wrong(
                f"{FEW[0].upper()}{FEW[1:]}, the client must {must}. Run twice in the same way, it printed other words "
                "each time.",
                f"{few.output}\n{alone.output}",
            )


def words(text: str) -> set[str]:
    """Return the words of two letters or more in a text, in small letters."""
    return set(re.findall(r"[^\W\d_]{2,}", text.lower()))


@points(1, cell="calculator-client")
def test_client_exit_status(runs: ClientRuns) -> None:
    """The client's exit status is 0 when it has printed a result, and another number in each failure."""
    runs.expect_call()
    status = runs.answered.run.status("with a server that answers")
    if status and not runs.answered.run.raised:
        raise Wrong(f"When the server has answered with success True, the exit status must be 0. It is {status}.")
    for call, name, _ in specials(runs):
        doing = answered(call, name)
        if (status := call.run.status(doing)) and not call.run.raised:
            raise Wrong(f"{doing[0].upper()}{doing[1:]}, the exit status must be 0. It is {status}.")
    with_server = {"with a server that refuses": runs.refused.run, **runs.misused}
    if runs.refused_unknown.reached:  # that it calls, another test judges
        with_server["with a server that refuses an operation that only the server knows"] = runs.refused_unknown.run
    if runs.speechless.reached:
        with_server["with a server that refuses without a message, and has the result 0"] = runs.speechless.run
    statuses = {doing: run.status(doing) for doing, run in with_server.items()}
    for doing, run in {"without a server": runs.absent, UNANSWERED: runs.unanswered.run}.items():
        with contextlib.suppress(TimedOut):  # another test tells this
            statuses[doing] = run.status(doing)
    for doing, status in statuses.items():
        if not status:
            raise Wrong(
                f"{doing[0].upper()}{doing[1:]}, the client must end with an exit status other than 0, such as "
                "sys.exit(1). It ended with 0.",
                f"{statuses}",
            )


def differences(sent: Any, right: Any) -> str:
    """Return how a request differs from the right one, in words without the numbers."""
    values = {float(right.a): "a", float(right.b): "b"}
    parts = []
    for name in ("a", "b"):
        value, wanted = getattr(sent, name), getattr(right, name)
        if value != wanted:
            another = (
                "a rounded number" if value in (round(wanted, digits) for digits in range(15)) else "another number"
            )
            parts.append(f"{values[value]} in the place of {name}" if value in values else f"{another} as {name}")
    if sent.operation == right.operation.strip() != right.operation:
        parts.append("the operation without the blanks around it")
    elif sent.operation != right.operation:
        parts.append(f"{quoted(sent.operation)} as operation")
    return " and ".join(parts)
