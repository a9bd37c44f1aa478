"""The student's programs, all started before the first test waits for any of them."""

import math

import pytest

from autograder.hidden.calculator.conversation import CLIENT, FEW, Calculator, Call, ClientRuns, Counterpart, LeftAlone
from autograder.suitekit import Bench
from autograder.suitekit.fixtures import used

CONSONANTS = "bdfgklmnprstvz"  # of made-up words, which no program prints by chance
FOR_ROS = ("--ros-args", "--log-level", "info")


@pytest.fixture(scope="session")
def calculator(bench: Bench) -> Calculator:
    """The student's server, running."""
    calculator = Calculator(bench)
    calculator.begin()
    return calculator


@pytest.fixture(scope="session")
def left_alone(bench: Bench) -> LeftAlone:
    """The same once more: it is left alone after its first requests."""
    left_alone = LeftAlone(bench)
    left_alone.begin()
    return left_alone


@pytest.fixture(scope="session")
def runs(bench: Bench) -> ClientRuns:
    """The runs of the student's client, by what each is about."""
    rng = bench.random("client")

    def word(length: int) -> str:
        return "".join(rng.choices(CONSONANTS, k=length))

    a, b = (rng.choice([-1, 1]) * (rng.randrange(10, 900) + rng.choice([0.25, 0.5, 0.75])) for _ in "ab")
    operation = rng.choice(["subtract", "multiply", "divide"])
    result = -rng.randrange(1_000_000_000, 9_000_000_000) - 0.5  # with its decimal, all digits that most formats lose
    # As a message may be: of two lines, longer than one, with capitals, two blanks in a row and at both ends, letters
    # outside of ASCII and of Latin-1, what a template has (% and {}), and punctuation at its end too.  With a result,
    # which means nothing in a refusal.
    start = f"{word(6).capitalize()} {word(4).upper()}: {word(7)} ({word(5)}), {word(8)}-{word(3)}"
    template = f"{rng.randrange(20, 90)} %s {{{word(4)}}}"
    rest = f"{template} {' '.join(word(7) for _ in range(12))}.  {word(4).capitalize()}ü{word(3)}éж!.."
    reason = f"  {start};\n{rest}  "
    noise = word(6)
    bench.hide(noise)
    answering = Counterpart(bench, result=result, success=True, message=word(9))
    refusing = Counterpart(bench, result=-rng.randrange(1000, 9000) - 0.5, success=False, message=reason)
    refusing_unknown = Counterpart(bench, result=refusing.response.result, success=False, message=reason.strip())
    wrongly = Counterpart(bench, result=refusing.response.result, success=False, message=reason)  # that nobody may call
    zero = Counterpart(bench, result=0.0, success=True, message=word(9))
    infinite = Counterpart(bench, result=math.inf, success=True, message=word(9))
    speechless = Counterpart(bench, result=0.0, success=False, message="")  # as what the task's example answers
    silent = Counterpart(bench, result=1.0, success=True, message=word(9), silent=True)
    p, q = (str(rng.randrange(10, 900)) for _ in "pq")
    return ClientRuns(
        answered=Call(answering, str(a), str(b), operation),
        refused=Call(refusing, p, "0", "divide"),
        refused_unknown=Call(refusing_unknown, p, q, word(8)),
        nameless=Call(zero, p, q, ""),
        unknown=Call(infinite, p, q, word(6)),
        unusual=Call(silent, f"{p}e-12", f"+.{q}", f" {word(5).capitalize()} ", *FOR_ROS),
        speechless=Call(speechless, p, "0", "divide"),
        absent=bench.early["absent"],
        misused={
            FEW: wrongly.run(p, q),
            "with too many arguments": wrongly.run(p, q, operation, "add"),
            "without any argument": wrongly.run(),
            "with a word in the place of the first number": wrongly.run(noise, q, operation),
            "with a word in the place of the second number": wrongly.run(p, noise, operation),
        },
        wrongly=wrongly,
        misused_alone=bench.run(CLIENT, p, q, domain=bench.new_domain()),
    )


@pytest.fixture(scope="session", autouse=True)
def begun(request: pytest.FixtureRequest) -> None:
    """Have all programs start at once that a test uses."""
    for name in ("calculator", "left_alone", "runs"):
        if name in used(request):
            request.getfixturevalue(name)
