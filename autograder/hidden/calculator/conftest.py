"""The student's programs, all started before the first test waits for any of them."""

import pytest

from autograder.hidden.calculator.conversation import Answered, Calculator, ClientRuns, Counterpart
from autograder.suitekit import Bench

CONSONANTS = "bdfgklmnprstvz"  # of made-up words, which no program prints by chance


@pytest.fixture(scope="session")
def calculator(bench: Bench) -> Calculator:
    """The student's server, running."""
    calculator = Calculator(bench)
    calculator.begin()
    return calculator


@pytest.fixture(scope="session")
def runs(bench: Bench) -> ClientRuns:
    """The runs of the student's client, by what each is about."""
    rng = bench.random("client")
    a, b = (rng.choice([-1, 1]) * (rng.randrange(10, 900) + rng.choice([0.25, 0.5, 0.75])) for _ in "ab")
    sent = (str(a), str(b), rng.choice(["subtract", "multiply", "divide"]))
    result = rng.randrange(10_000, 90_000) + 0.5
    reason = " ".join("".join(rng.choices(CONSONANTS, k=7)) for _ in range(2))
    word = "".join(rng.choices(CONSONANTS, k=6))
    bench.hide(word)
    answering = Counterpart(bench, result=result, success=True, message="")
    refusing = Counterpart(bench, result=0.0, success=False, message=reason)
    return ClientRuns(
        answered=Answered(answering.run(*sent), sent, answering.requests, result),
        refused=refusing.run("6", "7", sent[2]),
        reason=reason,
        misused={
            "with too few arguments": refusing.run(*["5"] * rng.randrange(3)),
            "with a word in the place of a number": refusing.run(word, "2", "add"),
        },
    )


@pytest.fixture(scope="session", autouse=True)
def begun(calculator: Calculator, runs: ClientRuns) -> None:
    """Have all programs start at once."""
