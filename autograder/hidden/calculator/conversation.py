"""The grader's side of the conversation: a client for the student's server, and a server for the student's client."""

import math
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from calculator_interfaces.srv import Calculate

from autograder.errors import Crashed, Fault, TimedOut, Wrong
from autograder.suitekit.bench import Run
from autograder.suitekit.live import ANSWER, Server, numbers
from autograder.suitekit.ros import Ros
from course.waiting import wait_until

ANSWERS = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
}
SIGNS = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"}
CLIENT = "calculator_client.py"
CHATTER = 300  # numbers like the wanted one that a program may show beside it: who shows all there are, shows none


class Calculator(Server):
    """The student's server."""

    def __init__(self, bench):
        super().__init__(bench, "calculator_server.py", {"/calculator": Calculate})
        self._first: dict = {}  # by operation, a question of the beginning with its response

    def ask(self, a: float, operation: str, b: float):
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
            raise Wrong("No operation gives the right result.")
        return right

    def expect_refusal(self, a: float, operation: str, b: float, about: str) -> None:
        """It must refuse, and say why."""
        response = self.ask(a, operation, b)
        got = f"{operation!r} {a!r} {b!r}: got {response}"
        if response.success:
            raise Wrong(f"{about}: success must be False.", got)
        if not response.message.strip():
            raise Wrong(f"{about}: message must tell what is wrong; it is empty.", got)

    def provoke(self, a: float, operation: str, b: float) -> str:
        """The message of an answer that is judged elsewhere; empty when there is none."""
        try:
            return self.ask(a, operation, b).message
        except Fault:
            return ""

    def logs_of(
        self,
        a: float,
        operation: str,
        b: float,
        wanted: Callable[[set[float]], bool],
        like: tuple[float, float],
        limit: float,
    ) -> bool:
        """Whether the log has `wanted` numbers after a request, which it had not before: without their signs.

        A program that logs all the numbers between those of `like` has not logged those of the request.
        """
        before = Counter(map(abs, numbers(self.log)))
        self.ask(a, operation, b)

        def logged() -> bool:
            new = Counter(map(abs, numbers(self.log))) - before
            alike = sum(count for number, count in new.items() if like[0] <= number <= like[1])
            return alike <= CHATTER and wanted(set(new))

        return wait_until(logged, limit)

    def answers(self, pairs: list[tuple[float, float]]) -> dict:
        """What it answers to each pair and operation, right or wrong, but does not refuse; there must be some.

        What it was asked at the beginning it must answer still as it did then.
        """
        for question, before in self._first.values():
            if not same(self.ask(*question), before):
                raise Wrong(
                    "A request that was answered before gets another answer now: does the server change with "
                    "the requests, or with time?",
                    f"{question}: {before}",
                )
        asked = [(a, operation, b) for a, b in pairs for operation in ANSWERS]
        answers = {question: self.ask(*question) for question in asked}
        answers = {question: response for question, response in answers.items() if is_answer(question, response)}
        if not answers:
            raise Wrong("The server answers no ordinary request with success True.")
        if len(answers) > 1 and len({response.result for response in answers.values()}) == 1:
            raise Wrong("The server answers requests with different numbers and operations by the same result.")
        return answers

    def ask_from_two(self, questions: list[tuple[float, str, float]]) -> list[tuple]:
        """Each question with its response, from two clients that ask at the same time in different order."""
        self.up()
        second = self.bench.enter(self.ros.domain)
        client = second.node.create_client(Calculate, "/calculator")
        wait_until(client.service_is_ready, self.bench.clock.allow(ANSWER))

        def ask_all(ros, client, questions):
            return [(question, self.ask_with(ros, client, *question)) for question in questions]

        with ThreadPoolExecutor(2) as pool:
            asked = [
                pool.submit(ask_all, self.ros, self.clients["/calculator"], questions),
                pool.submit(ask_all, second, client, questions[::-1]),
            ]
            return [answer for future in asked for answer in future.result()]

    def ask_with(self, ros: Ros, client, a: float, operation: str, b: float):
        """The response to another client; the program is not started again."""
        limit = self.bench.clock.allow(ANSWER)
        response = ros.call(client, Calculate.Request(a=a, b=b, operation=operation), limit, lambda: self.program.alive)
        if response is not None:
            return response
        if self.program.alive:
            raise TimedOut("With two clients at once, a request got no answer.")
        raise Crashed(f"{self.file} died while two clients called it: {self.program.last_words()}.")


def has_right_result(question: tuple[float, str, float], response) -> bool:
    """Whether the result is about right."""
    a, operation, b = question
    return math.isclose(response.result, ANSWERS[operation](a, b), rel_tol=1e-2)


def is_answer(question: tuple[float, str, float], response) -> bool:
    """Whether it is no refusal.  Who forgets `success` loses the points of the operations, not all others too."""
    return response.success or has_right_result(question, response)


def same(response, other) -> bool:
    """Whether two responses say the same; their messages may tell a time or a count."""
    return (response.success, response.result) == (other.success, other.result)


class Counterpart:
    """The grader's own /calculator for the student's client.  What it answers cannot be computed from the request."""

    def __init__(self, bench, **response):
        self._bench = bench
        self._domain = bench.new_domain()
        self._response = Calculate.Response(**response)
        bench.hide(response["result"], *response["message"].split())
        self.requests: list = []
        bench.enter(self._domain).node.create_service(Calculate, "/calculator", self._answer)

    def run(self, *args: str) -> Run:
        """A run of the student's client that can call this."""
        return Run(self._bench, CLIENT, *args, domain=self._domain)

    def _answer(self, request, _):
        self.requests.append(request)
        return self._response
