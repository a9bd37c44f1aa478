"""The grader's side of the conversation: a client for the student's server, and a server for the student's client."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from calculator_interfaces.srv import Calculate

from autograder.errors import Fault
from autograder.suitekit import Bench, Run, Server, Wrong, numbers
from course.waiting import wait_until

SERVICE = "/calculator"
ANSWERS: dict[str, Callable[[float, float], float]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
}
SIGNS = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"}
CLIENT = "calculator_client.py"
ABOUT_RIGHT = 1e-2  # relative error of a result that the right operation may have given, rounded
CHATTER = 300  # numbers like the right one that a program may print beside it: printing all of them shows none

Question = tuple[float, str, float]  # a, the operation, b


class Calculator(Server):
    """The student's server."""

    def __init__(self, bench: Bench):
        super().__init__(bench, "calculator_server.py", {SERVICE: Calculate})
        self._first: dict[str, tuple[Question, Any]] = {}  # by operation, the first question with its response

    def ask(self, a: float, operation: str, b: float) -> Any:
        """Its response."""
        self.bench.hide(a, operation if operation not in ANSWERS else "", b)
        return self.call(Calculate.Request(a=a, b=b, operation=operation))

    def expect(self, a: float, operation: str, b: float, about: str, tolerance: float, success: bool = True) -> None:
        """Its result must be right within `tolerance`; `about` tells the student what kind of numbers these are."""
        response, right = self.ask(a, operation, b), ANSWERS[operation](a, b)
        self._first.setdefault(operation, ((a, operation, b), response))
        got = f"{operation} {a!r} {b!r}: expected {right!r}, got {response.result!r}, success={response.success}"
        if success and not response.success:
            raise Wrong(f"'{operation}' with {about}: success must be True when the operation can be done.", got)
        if not math.isclose(response.result, right, rel_tol=0, abs_tol=tolerance):
            raise Wrong(f"'{operation}' with {about}: result must be a {SIGNS[operation]} b.", got)

    def operations(self, a: float, b: float) -> dict[str, bool]:
        """The operations that are right for these numbers with any signs, with their success; there must be some."""
        right = {}
        for operation in ANSWERS:
            questions = [(x, operation, y) for x in (a, -a) for y in (b, -b)]
            responses = [self.ask(*question) for question in questions]
            if all(map(has_right_result, questions, responses)):
                right[operation] = all(response.success for response in responses)
        if not right:
            raise Wrong("None of the four operations gives the right result.")
        return right

    def expect_refusal(self, a: float, operation: str, b: float, about: str) -> None:
        """It must refuse, and say why."""
        response = self.ask(a, operation, b)
        got = f"{operation!r} {a!r} {b!r}: got {response}"
        if response.success:
            raise Wrong(f"{about}: success must be False.", got)
        if not response.message.strip():
            raise Wrong(f"{about}: message must say what is wrong; it is empty.", got)

    def provoke(self, a: float, operation: str, b: float) -> str:
        """The message of a response that other tests judge; empty when there is none."""
        try:
            return str(self.ask(a, operation, b).message)
        except Fault:
            return ""

    def logs_of(
        self, question: Question, right: Callable[[set[float]], bool], like: tuple[float, float], limit: float
    ) -> bool:
        """Whether the numbers that a request adds to the log are `right` within `limit` s; their signs do not count.

        A program that logs all the numbers between those of `like` has not logged those of the request.
        """
        before = Counter(map(abs, numbers(self.log)))
        self.ask(*question)

        def logged() -> bool:
            new = Counter(map(abs, numbers(self.log))) - before
            alike = sum(count for number, count in new.items() if like[0] <= number <= like[1])
            return alike <= CHATTER and right(set(new))

        return wait_until(logged, limit)

    def names_operation(self, question: Question, limit: float) -> bool:
        """Whether a line of the log has the operation of an earlier request with its a and b, within `limit` s."""
        a, operation, b = question

        def named() -> bool:
            lines = (line for line in self.log.splitlines() if operation in line)
            return any({abs(a), abs(b)} <= set(map(abs, numbers(line))) for line in lines)

        return wait_until(named, limit)

    def logs_refusal(self, a: float, operation: str, b: float, limit: float) -> bool:
        """Whether a refusal adds its message to the log within `limit` s; True also when nothing is refused in words.

        Whether it is refused is judged by other tests.
        """
        before = [in_one_line(log) for log in (self.program.output, self.ros.rosout)]
        if not (message := in_one_line(self.provoke(a, operation, b))):
            return True

        def logged() -> bool:
            after = [in_one_line(log) for log in (self.program.output, self.ros.rosout)]
            return any(new.count(message) > old.count(message) for new, old in zip(after, before, strict=True))

        return wait_until(logged, limit)

    def answers(self, pairs: Sequence[tuple[float, float]]) -> dict[Question, Any]:
        """What it answers to each pair and operation, right or wrong, but does not refuse; there must be some.

        What it was asked first it must still answer as it did then.
        """
        for question, before in self._first.values():
            if not same(self.ask(*question), before):
                raise Wrong(
                    "The same request was answered differently earlier: an answer must depend on its own request "
                    "alone, not on the requests before it or on the time.",
                    f"{question}: {before}",
                )
        asked = {(a, operation, b): self.ask(a, operation, b) for a, b in pairs for operation in ANSWERS}
        answers = {question: response for question, response in asked.items() if is_answer(question, response)}
        if not answers:
            raise Wrong("The server answers no ordinary request with success True.")
        if len(answers) > 1 and len({response.result for response in answers.values()}) == 1:
            raise Wrong("The server gives the same result for different numbers and operations.")
        return answers

    def ask_from_two(self, questions: Sequence[Question]) -> list[tuple[Question, Any]]:
        """Each question with its response, from two clients that ask at the same time in opposite order."""
        orders = [questions, questions[::-1]]
        requests = [[Calculate.Request(a=a, b=b, operation=operation) for a, operation, b in order] for order in orders]
        responses = self.call_at_once(requests)
        return [pair for order, got in zip(orders, responses, strict=True) for pair in zip(order, got, strict=True)]


def in_one_line(text: str) -> str:
    """The text with each run of white space as one blank."""
    return " ".join(text.split())


def has_right_result(question: Question, response: Any) -> bool:
    """Whether the result is about right."""
    a, operation, b = question
    return math.isclose(response.result, ANSWERS[operation](a, b), rel_tol=ABOUT_RIGHT)


def is_answer(question: Question, response: Any) -> bool:
    """Whether it is no refusal.  A server that forgets `success` loses the operations' points, not all others too."""
    return response.success or has_right_result(question, response)


def same(response: Any, other: Any) -> bool:
    """Whether two responses say the same; their messages may tell a time or a count."""
    return (response.success, response.result) == (other.success, other.result)


class Counterpart:
    """The grader's own /calculator for the student's client.  Its answer cannot be computed from the request."""

    def __init__(self, bench: Bench, *, result: float, success: bool, message: str):
        self._bench = bench
        self._domain = bench.new_domain()
        self._response = Calculate.Response(result=result, success=success, message=message)
        bench.hide(result, *message.split())
        self.requests: list[Any] = []
        bench.enter(self._domain).node.create_service(Calculate, SERVICE, self._answer)

    def run(self, *args: str) -> Run:
        """A run of the student's client that can call this."""
        return self._bench.run(CLIENT, *args, domain=self._domain)

    def _answer(self, request: Any, _: Any) -> Any:
        self.requests.append(request)
        return self._response


@dataclass(frozen=True)
class Answered:
    """A run of the client with a server that answers."""

    run: Run
    sent: tuple[str, str, str]  # its command line
    requests: list[Any]  # that came to the server
    result: float  # that the server answers


@dataclass(frozen=True)
class ClientRuns:
    """The runs of the student's client."""

    answered: Answered
    refused: Run  # by a server that answers with success False
    reason: str  # and this message
    misused: dict[str, Run]  # with a wrong command line, by what is wrong with it
