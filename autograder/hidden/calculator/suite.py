"""What section 3.5 asks of a calculator, as a conversation with the student's server and client.

Points add up to 20.  The message of a failure speaks of the task; the numbers that were drawn stay with the grader.
"""

import math
import random
from collections.abc import Mapping

from calculator_interfaces.srv import Calculate

from autograder.hidden.calculator.conversation import ANSWERS, CHATTER, SERVICE, Calculator, ClientRuns, is_answer, same
from autograder.suitekit import Bench, Wrong, expect_gives_up, expect_usage, numbers, points, twice
from course.interfaces import InterfaceError, parse

SECTIONS = {
    "request": [("float64", "a"), ("float64", "b"), ("string", "operation")],
    "response": [("float64", "result"), ("bool", "success"), ("string", "message")],
}
ROUNDING = 0.0051  # what rounding to two decimals may cost: judged by one test, not by every operation's
FLOAT64 = 1e-12  # of the numbers' size: several ways to compute the same are right
FLOAT32 = 1e-5  # of a number's size: logs may show fewer digits than a result has
SHOWN = 0.06  # what rounding to one decimal may cost a result that the client prints
WRITTEN = 3.0  # s until a log line has arrived


@points(3, cell="calculate-srv")
def test_interface(submission: Mapping[str, bytes]) -> None:
    """Calculate.srv has the request and the response of the task."""
    try:
        text = submission["Calculate.srv"].decode()
        for mark, name in (("\ufeff", "a byte order mark (BOM)"), ("\0", "a NUL character")):
            if mark in text:
                raise Wrong(
                    f"Calculate.srv contains {name}, which ROS 2 cannot read: save the file as plain UTF-8 text."
                )
        definition = parse(text, "Calculate.srv")
    except UnicodeDecodeError:
        raise Wrong("Calculate.srv is not UTF-8 text: save it as UTF-8, or leave out letters like ä and é.") from None
    except InterfaceError as error:
        raise Wrong(str(error) if str(error).endswith("?") else f"{error}.") from None
    for (name, right), fields in zip(SECTIONS.items(), definition.sections, strict=True):
        if [(field.type, field.name) for field in fields] != right or any(field.value is not None for field in fields):
            raise Wrong(
                f"The {name} in Calculate.srv must have exactly these fields, in this order: "
                f"{', '.join(' '.join(field) for field in right)}. "
                "(Your programs were tested with the correct definition.)"
            )


@points(1, cell="calculator-server")
def test_add(calculator: Calculator, rng: random.Random) -> None:
    """The server adds."""
    judge_operation(calculator, rng, "add")


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
        a, b = plain_numbers(rng)
        calculator.expect(signs[0] * a, operation, signs[1] * b, about, ROUNDING)
    a, b = plain_numbers(rng)
    calculator.expect(a + 0.5, operation, b + 0.25, "numbers that are not whole", ROUNDING)
    calculator.expect(0.0, operation, b, "a = 0", ROUNDING)
    if operation != "divide":
        calculator.expect(a, operation, 0.0, "b = 0", ROUNDING)


def plain_numbers(rng: random.Random) -> tuple[float, float]:
    """Two whole numbers whose sum, difference, product and quotient are far from each other and from whole."""
    b = rng.randrange(7, 40)
    return float(b * rng.randrange(2, 10) + rng.randint(round(0.3 * b), round(0.7 * b))), float(b)


@points(1, cell="calculator-server")
def test_precision(calculator: Calculator, rng: random.Random) -> None:
    """Results have the precision of float64, for large, small and fractional numbers."""
    operations = calculator.operations(*plain_numbers(rng))  # a wrong operation loses its own point, not this one
    for exponents, about in [
        ((0, 0), "numbers with many decimals"),
        ((150, 149), "very large numbers"),
        ((-140, -141), "numbers very close to 0"),
        ((-3, -2), "small fractions"),
        ((100, -100), "a very large and a very small number"),
    ]:
        for operation, success in operations.items():
            a, b = (rng.choice([-1, 1]) * rng.uniform(1, 10) * 10.0**exponent for exponent in exponents)
            size = max(abs(a), abs(b)) if operation in ("add", "subtract") else abs(ANSWERS[operation](a, b))
            calculator.expect(
                a,
                operation,
                b,
                f"{about} (do not round the result, and treat only 0 itself as 0)",
                FLOAT64 * size,
                success,
            )


@points(1, cell="calculator-server")
def test_division_by_zero(calculator: Calculator, rng: random.Random) -> None:
    """Dividing by zero is refused with a message."""
    for a, b in [(rng.uniform(1, 100), 0.0), (rng.uniform(-100, -1), 0.0), (0.0, 0.0), (rng.uniform(1, 100), -0.0)]:
        calculator.expect_refusal(a, "divide", b, "Division by zero")


@points(1, cell="calculator-server")
def test_unknown_operation(calculator: Calculator, rng: random.Random) -> None:
    """An operation that does not exist is refused with a message."""
    for operation in ["modulo", "".join(rng.choices("bdfgklmnp", k=9)), ""]:
        calculator.expect_refusal(rng.uniform(1, 9), operation, rng.uniform(1, 9), "An unknown operation")


@points(1, cell="calculator-server")
def test_each_answer_stands_alone(calculator: Calculator, rng: random.Random) -> None:
    """No answer has anything left in it from an earlier one."""
    before = calculator.answers([plain_numbers(rng)])
    for question, answer in before.items():
        refusal = calculator.provoke(1.0, "modulo", 2.0)
        after = calculator.ask(*question)
        if not same(after, answer):
            raise Wrong(
                "After a refused request, an ordinary request must be answered as it was before.", f"got {after}"
            )
        if refusal and after.message == refusal != answer.message:
            raise Wrong(
                "After a refused request, the next answer still has the message of the refusal.", f"got {after}"
            )


@points(1, cell="calculator-server")
def test_survives_bad_requests(calculator: Calculator, rng: random.Random) -> None:
    """The server keeps working after bad requests."""
    question, answer = next(iter(calculator.answers([plain_numbers(rng)]).items()))
    starts = calculator.starts
    for a, operation, b in [
        (1.0, "divide", 0.0),
        (1.0, "", 2.0),
        (2.0, "x" * 5000, 3.0),
        (3.0, "Überlauf\n%s{}", 4.0),
        (-1.0, "divide", 0.0),
    ]:
        calculator.ask(a, operation, b)
    after = calculator.ask(*question)
    if calculator.starts != starts or not same(after, answer):
        raise Wrong(
            "After several bad requests, an ordinary request must be answered as it was before.", f"got {after}"
        )


@points(1, cell="calculator-server")
def test_two_clients(calculator: Calculator, rng: random.Random) -> None:
    """Two clients that call at the same time each get their own answers."""
    alone = calculator.answers([plain_numbers(rng) for _ in range(5)])
    together = calculator.ask_from_two([*alone])
    for question, response in together:
        if not same(response, alone[question]):
            raise Wrong(
                "When two clients call at the same time, an answer differs from what the same request got alone.",
                f"{question}: alone {alone[question]}, together {response}",
            )


@points(1, cell="calculator-server")
def test_logs_requests(calculator: Calculator, rng: random.Random) -> None:
    """The server logs each request, with its numbers and its operation."""
    a, b = rng.sample(range(1009, 4999), 2)
    question = float(a), rng.choice(["subtract", "multiply"]), float(b)
    wait = calculator.bench.clock.allow(WRITTEN)
    if not calculator.logs_of(question, {a, b}.issubset, (1000, 5000), wait):
        raise Wrong("After a request, the server must have logged (or printed) its numbers a and b.")
    if not calculator.names_operation(question, wait):
        raise Wrong("The log line of a request must contain its operation, too, beside a and b.")


@points(1, cell="calculator-server")
@twice
def test_logs_responses(calculator: Calculator, rng: random.Random) -> None:
    """The server logs each response: its result, or the message of a refusal."""
    for operation in ANSWERS:
        a, b = rng.sample(range(5009, 8999), 2)
        question = float(a), operation, float(b)
        response = calculator.ask(*question)
        size = abs(response.result)
        if is_answer(question, response) and math.isfinite(size) and size not in (a, b):
            break
    else:
        raise Wrong("The server answers no ordinary request with success True and a result.")

    def shows_result(logged: set[float]) -> bool:
        return any(abs(number - size) <= ROUNDING + FLOAT32 * size for number in logged)

    # Asked again, because only now it is known which number must be logged.
    wait = calculator.bench.clock.allow(WRITTEN)
    if not calculator.logs_of(question, shows_result, (size / 2, size * 2 + 1), wait):
        raise Wrong("After a response, the server must have logged (or printed) its result.")
    for operation in ("divide", "modulo"):
        if not calculator.logs_refusal(rng.uniform(1, 9), operation, 0.0, wait):
            raise Wrong("After a refusal, the server must have logged (or printed) the message of its response.")


@points(2, cell="calculator-client")
def test_client_shows_result(runs: ClientRuns) -> None:
    """The client sends what it is given and shows the answer."""
    a, b, operation = runs.answered.sent
    right, result = Calculate.Request(a=float(a), b=float(b), operation=operation), runs.answered.result
    output = runs.answered.run.finish("with a server that answers").output
    if not runs.answered.requests:
        raise Wrong(f"The client did not call {SERVICE}.", output)
    if other := [request for request in runs.answered.requests if request != right]:
        raise Wrong(
            "The client's request must hold a, b and the operation from its command line.",
            f"sent {other[0]}, not {right}",
        )
    shown = [number for number in numbers(output) if 10_000 <= number <= 90_000]  # as the results are
    if len(shown) > CHATTER or not any(abs(number - result) < SHOWN for number in shown):
        raise Wrong("The client must show the result of the server's response.", f"answered {result}, shown: {output}")


@points(1, cell="calculator-client")
def test_client_shows_message(runs: ClientRuns) -> None:
    """When the server refuses, the client shows its message."""
    output = runs.refused.finish("with a server that refuses").output
    if runs.reason not in output:
        raise Wrong(
            "When success is False, the client must show the message of the response.",
            f"answered {runs.reason!r}, shown: {output}",
        )


@points(1, cell="calculator-client")
def test_client_without_server(bench: Bench) -> None:
    """Without a server the client gives up within 10 s, and says so."""
    expect_gives_up(bench.early["absent"], SERVICE)


@points(1, cell="calculator-client")
def test_client_arguments(runs: ClientRuns) -> None:
    """With wrong arguments the client prints how to use it."""
    for doing, run in runs.misused.items():
        expect_usage(run, doing)
