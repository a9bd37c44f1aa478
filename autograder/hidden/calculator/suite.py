"""What section 3.5 asks of a calculator, as a conversation with the student's server and client.

Points add up to 20.  The message of a failure speaks of the task; the numbers that were drawn stay with the grader.
"""

import math

from calculator_interfaces.srv import Calculate

from autograder.errors import Wrong
from autograder.hidden.calculator.conversation import ANSWERS, CHATTER, is_answer, same
from autograder.suitekit.judge import points
from autograder.suitekit.live import finish, numbers
from course.interfaces import InterfaceError, parse

SECTIONS = {
    "request": [("float64", "a"), ("float64", "b"), ("string", "operation")],
    "response": [("float64", "result"), ("bool", "success"), ("string", "message")],
}
ROUNDING = 0.0051  # what rounding to two decimals may cost: judged by one test, not by every operation's
FLOAT64 = 1e-12  # of the numbers' size: several ways to compute the same are right
WRITTEN = 3.0  # s until a log line has arrived


@points(3, cell="calculate-srv")
def test_interface(submission):
    """Calculate.srv has the request and the response of the task."""
    try:
        text = submission["Calculate.srv"].decode()
        for mark, name in (("\ufeff", "a byte order mark (BOM)"), ("\0", "a NUL character")):
            if mark in text:
                raise Wrong(f"Calculate.srv has {name} in it, which ROS 2 cannot read: save it as plain UTF-8 text.")
        definition = parse(text, "Calculate.srv")
    except UnicodeDecodeError:
        raise Wrong("Calculate.srv is not UTF-8 text: save it so, or leave out letters like ä and é.") from None
    except InterfaceError as error:
        raise Wrong(str(error) if str(error).endswith("?") else f"{error}.") from None
    for (name, right), fields in zip(SECTIONS.items(), definition.sections, strict=True):
        if [(field.type, field.name) for field in fields] != right or any(field.value is not None for field in fields):
            raise Wrong(
                f"The {name} in Calculate.srv must have these fields, in this order and no more: "
                f"{', '.join(' '.join(field) for field in right)}. "
                "(Your programs were tested with the right definition.)"
            )


@points(1, cell="calculator-server")
def test_add(calculator, rng):
    """The server adds."""
    judge_operation(calculator, rng, "add")


@points(1, cell="calculator-server")
def test_subtract(calculator, rng):
    """The server subtracts."""
    judge_operation(calculator, rng, "subtract")


@points(1, cell="calculator-server")
def test_multiply(calculator, rng):
    """The server multiplies."""
    judge_operation(calculator, rng, "multiply")


@points(1, cell="calculator-server")
def test_divide(calculator, rng):
    """The server divides."""
    judge_operation(calculator, rng, "divide")


def judge_operation(calculator, rng, operation):
    """Ordinary numbers, with room for a rounded result."""
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


def plain_numbers(rng):
    """Two whole numbers whose sum, difference, product and quotient are far from each other and from whole."""
    b = rng.randrange(7, 40)
    return float(b * rng.randrange(2, 10) + rng.randint(round(0.3 * b), round(0.7 * b))), float(b)


@points(1, cell="calculator-server")
def test_precision(calculator, rng):
    """Results have the precision of float64, for large, small and fractional numbers."""
    operations = calculator.operations(*plain_numbers(rng))  # a wrong operation loses its own point, not this one
    for exponents, about in [
        ((0, 0), "numbers with many decimals"),
        ((150, 149), "very large numbers"),
        ((-140, -141), "numbers very near to 0"),
        ((-3, -2), "small fractions"),
        ((100, -100), "a very large and a very small number"),
    ]:
        for operation, success in operations.items():
            a, b = (rng.choice([-1, 1]) * rng.uniform(1, 10) * 10.0**exponent for exponent in exponents)
            size = max(abs(a), abs(b)) if operation in ("add", "subtract") else abs(ANSWERS[operation](a, b))
            calculator.expect(
                a, operation, b, f"{about} (do not round, and nothing but 0 is 0)", FLOAT64 * size, success
            )


@points(1, cell="calculator-server")
def test_division_by_zero(calculator, rng):
    """Dividing by zero is refused with a message."""
    for a, b in [(rng.uniform(1, 100), 0.0), (rng.uniform(-100, -1), 0.0), (0.0, 0.0), (rng.uniform(1, 100), -0.0)]:
        calculator.expect_refusal(a, "divide", b, "Division by zero")


@points(1, cell="calculator-server")
def test_unknown_operation(calculator, rng):
    """An operation that does not exist is refused with a message."""
    for operation in ["modulo", "".join(rng.choices("bdfgklmnp", k=9)), ""]:
        calculator.expect_refusal(rng.uniform(1, 9), operation, rng.uniform(1, 9), "An unknown operation")


@points(1, cell="calculator-server")
def test_each_answer_stands_alone(calculator, rng):
    """Nothing of an earlier answer is left in the next."""
    before = calculator.answers([plain_numbers(rng)])
    for question, answer in before.items():
        refusal = calculator.provoke(1.0, "modulo", 2.0)
        after = calculator.ask(*question)
        if not same(after, answer):
            raise Wrong("After a refused request, an ordinary one must be answered as it was before.", f"got {after}")
        if refusal and after.message == refusal != answer.message:
            raise Wrong("After a refused request, the next answer still has its message.", f"got {after}")


@points(1, cell="calculator-server")
def test_survives_bad_requests(calculator, rng):
    """The server goes on after bad requests."""
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
        raise Wrong("After some bad requests, an ordinary one must be answered as it was before.", f"got {after}")


@points(1, cell="calculator-server")
def test_two_clients(calculator, rng):
    """Two clients at once get each their own answers."""
    alone = calculator.answers([plain_numbers(rng) for _ in range(5)])
    together = calculator.ask_from_two([*alone])
    for question, response in together:
        if not same(response, alone[question]):
            raise Wrong(
                "With two clients at once, an answer differs from what the same request got alone.",
                f"{question}: alone {alone[question]}, together {response}",
            )


@points(1, cell="calculator-server")
def test_logs_requests(calculator, rng):
    """The server logs each request."""
    a, b = rng.sample(range(1009, 4999), 2)
    wait = calculator.bench.clock.allow(WRITTEN)
    if not calculator.logs_of(float(a), "add", float(b), {a, b}.issubset, (1000, 5000), wait):
        raise Wrong("After a request, its numbers a and b must be in what the server logs (or prints).")


@points(1, cell="calculator-server")
def test_logs_responses(calculator, rng):
    """The server logs each response."""
    for operation in ANSWERS:
        a, b = rng.sample(range(5009, 8999), 2)
        response = calculator.ask(float(a), operation, float(b))
        size = abs(response.result)
        if is_answer((float(a), operation, float(b)), response) and math.isfinite(size) and size not in (a, b):
            break
    else:
        raise Wrong("The server answers no ordinary request with success True and a result.")

    def shows_result(logged):
        return any(abs(number - size) <= ROUNDING + 1e-5 * size for number in logged)

    # Asked again, because what is right to log is known only now.
    wait = calculator.bench.clock.allow(WRITTEN)
    if not calculator.logs_of(float(a), operation, float(b), shows_result, (size / 2, size * 2 + 1), wait):
        raise Wrong("After a response, its result must be in what the server logs (or prints).")


@points(2, cell="calculator-client")
def test_client_shows_result(runs):
    """The client sends what it is given and shows the answer."""
    run, sent, requests, result = runs["answered"]
    output = finish(run, "with a server that answers").output
    right = Calculate.Request(a=float(sent[0]), b=float(sent[1]), operation=sent[2])
    if not requests:
        raise Wrong("The client did not call /calculator.", output)
    if other := [request for request in requests if request != right]:
        raise Wrong(
            "The request that the client sends must hold a, b and the operation of its command line.",
            f"sent {other[0]}, not {right}",
        )
    shown = [number for number in numbers(output) if 10_000 <= number <= 90_000]  # as the results are
    if len(shown) > CHATTER or not any(abs(number - result) < 0.06 for number in shown):
        raise Wrong("The client must show the result that the server answers.", f"answered {result}, shown: {output}")


@points(1, cell="calculator-client")
def test_client_shows_message(runs):
    """When the server refuses, the client shows its message."""
    run, reason = runs["refused"]
    output = finish(run, "with a server that refuses").output
    if reason not in output:
        raise Wrong(
            "When success is False, the client must show the message of the response.",
            f"answered {reason!r}, shown: {output}",
        )


@points(1, cell="calculator-client")
def test_client_without_server(bench):
    """Without a server the client gives up within 10 s, and says so."""
    program = finish(bench.early["absent"], "without a server")
    if program.exit_status == 0:
        raise Wrong("When there is no server, the client must end with an exit status other than 0: sys.exit(1).")
    if not program.output.strip():
        raise Wrong("When there is no server, the client must say so.")


@points(1, cell="calculator-client")
def test_client_arguments(runs):
    """Wrong arguments get a word on the usage."""
    for name, about in [("too few", "with too few arguments"), ("no number", "with a word in the place of a number")]:
        program = finish(runs[name], about)
        if program.exit_status == 0:
            raise Wrong(f"{about.capitalize()}, the client must end with an exit status other than 0: sys.exit(2).")
        if not program.output.strip():
            raise Wrong(f"{about.capitalize()}, the client must print how it is to be used.")
