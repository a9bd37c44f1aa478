"""Answers to the calculator exercise."""

from .. import changed, solution
from . import programs

SRV, SERVER, CLIENT = "Calculate.srv", "calculator_server.py", "calculator_client.py"
# With a client that gives up sooner, so that the tests take less time.
REFERENCE = changed(solution("calculator"), CLIENT, ("timeout_sec=5.0", "timeout_sec=1.5"))


def server(*pairs: tuple[str, str]) -> dict[str, bytes]:
    """The reference with a changed server."""
    return changed(REFERENCE, SERVER, *pairs)


def client(*pairs: tuple[str, str]) -> dict[str, bytes]:
    """The reference with a changed client."""
    return changed(REFERENCE, CLIENT, *pairs)


def written(server: str, client: str, encoding: str = "utf-8", **more: bytes) -> dict[str, bytes]:
    """The reference's definition with these programs."""
    return REFERENCE | {SERVER: server.encode(encoding), CLIENT: client.encode()}


def windows(files: dict[str, bytes]) -> dict[str, bytes]:
    """The files with the line ends of Windows, the programs with a byte order mark too."""
    return {
        name: (b"\xef\xbb\xbf" if name.endswith(".py") else b"") + content.replace(b"\n", b"\r\n")
        for name, content in files.items()
    }


FIRST = "        if request.operation == 'add':\n"

RIGHT = {
    "reference": REFERENCE,
    "functions and a table; argparse": written(programs.FUNCTIONS, programs.ARGPARSE_CLIENT),
    "threads, async, own context, slow start": REFERENCE | {SERVER: programs.THREADS.encode()},
    "comments and blanks in the definition": changed(
        REFERENCE, SRV, ("float64 b\n", "\n# the second\nfloat64   b\n\n")
    ),
    "a node in a plain object, %-logging; an executor": written(programs.COMPOSED, programs.EXECUTOR_CLIENT),
    "all at level debug; a callback": written(programs.VERBOSE, programs.CALLBACK_CLIENT),
    "comma-separated log by print; a thread": written(programs.COMMA_SEPARATED, programs.THREAD_CLIENT),
    "more than asked, messages with times; async": written(programs.MORE_THAN_ASKED, programs.ASYNC_CLIENT),
    "Decimal, JSON log, 20 ms an answer": REFERENCE | {SERVER: programs.DECIMAL.encode()},
    "Latin-1 with a decorator": written(programs.LATIN_1, programs.EXECUTOR_CLIENT, "latin-1"),
    "line ends of Windows": windows(REFERENCE),
    "one expression, a log without words": server(
        (
            "f'Request: a={request.a} b={request.b} operation={request.operation}'",
            "f'{request.a}{request.operation}{request.b}'",
        ),
        (
            (
                "            f'Response: result={response.result} success={response.success} '\n"
                "            f'message={response.message}')"
            ),
            "            f'={response.result}{response.message}')",
        ),
    ),
    "client in colour, with the sum as a sentence": client(
        (
            "print(f'{a} {operation} {b} = {response.result}')",
            (
                "print(f'\\x1b[1mThe result of {operation} for {a:,} and {b:,} is: '\n"
                "              f'\\x1b[32m{response.result:,.1f}\\x1b[0m.')"
            ),
        )
    ),
}

RIGHT |= {
    "one line of log for both, operations by class, numpy; says what it does": written(
        programs.ONE_LINE, programs.WORDY_CLIENT
    ),
    "a response made anew; a client with JSON in a context of its own": written(
        programs.COMPOSED, programs.JSON_CLIENT
    ),
    "the whole response in the log, a message with both quotes": server(
        (
            (
                "            f'Response: result={response.result} success={response.success} '\n"
                "            f'message={response.message}')"
            ),
            "            str(response))",
        ),
        ("response.message = 'Division by zero'", """response.message = 'One can\\'t "divide" by zero'"""),
    ),
    "one dictionary of refusals and results; a client that asks first": server(
        (FIRST, "        self.get_logger().info('One moment')\n" + FIRST)
    ),
}

SERVER_TESTS = {
    "add",
    "subtract",
    "multiply",
    "divide",
    "precision",
    "refuses_and_goes_on",
    "division_by_zero",
    "unknown_operation",
    "each_answer_stands_alone",
    "survives_bad_requests",
    "logs_requests",
    "logs_responses",
}
REFUSE_ZERO = """        elif request.b == 0.0:
            response.success = False
            response.message = 'Division by zero'
"""
RESULT = "response.result = request.a {} request.b"
UNKNOWN = """            response.success = False
            response.message = f"Unknown operation '{request.operation}'"
"""
LOG_RESPONSE = """        self.get_logger().info(
            f'Response: result={response.result} success={response.success} '
            f'message={response.message}')
"""
SUCCEEDS = "        response.success = True\n"
REENTRANT = (
    "self.calculate)",
    "self.calculate,\n            callback_group=rclpy.callback_groups.ReentrantCallbackGroup())",
)
FOUR_THREADS = ("rclpy.spin(node)", "rclpy.spin(node, rclpy.executors.MultiThreadedExecutor(4))")
RETURN = "        return response\n"
ELSE_FIRST = FIRST.replace("if", "elif")
OPERATIONS = {"add", "subtract", "multiply", "divide"}
INTERFACE = {"interface_request", "interface_response", "interface_nothing_else"}
CLIENT_TESTS = {
    "client_sends",
    "client_shows_result",
    "client_shows_message",
    "client_without_server",
    "client_without_answer",
    "client_arguments",
    "client_exit_status",
}
SLEEPS = "        import time\n        time.sleep(0.5)\n"
ASKS = "        rclpy.spin_until_future_complete(self, future, timeout_sec=timeout_sec)\n"

LOG_REQUEST = """        self.get_logger().info(
            f'Request: a={request.a} b={request.b} operation={request.operation}')
"""


def indented(lines: str) -> str:
    """A statement of two or more lines, four columns to the right but for the first line, which follows four blanks."""
    return lines.replace("\n    ", "\n        ")


def keeps(key: str) -> dict[str, bytes]:
    """A server that answers what it has computed before, found by `key`."""
    return server(
        (
            LOG_RESPONSE,
            "        if response.success:\n"
            "            self.known = getattr(self, 'known', {})\n"
            f"            response.result = self.known.setdefault({key}, response.result)\n" + LOG_RESPONSE,
        )
    )


# What is wrong, and the tests that it loses (without "test_").
WRONG = {
    "subtract swapped": (server(("request.a - request.b", "request.b - request.a")), {"subtract"}),
    "adds with math.fsum": (
        server(
            ("import rclpy\n", "import math\n\nimport rclpy\n"),
            (RESULT.format("+"), "response.result = math.fsum([request.a, request.b])"),
        ),
        {"survives_bad_requests"},
    ),
    "looks at the whole part of each number": (
        server(
            (SUCCEEDS, "        self.whole = int(request.a) == request.a and int(request.b) == request.b\n" + SUCCEEDS)
        ),
        {"survives_bad_requests"},
    ),
    "adds by eval": (
        server(("request.a + request.b", "eval(f'{request.a} + {request.b}')")),
        {"survives_bad_requests"},
    ),
    "refuses what follows an empty operation": (
        server(
            (
                "        response.success = True\n",
                """        response.success = not getattr(self, 'empty', False)
        self.empty = request.operation == ''
""",
            )
        ),
        {"each_answer_stands_alone"},
    ),
    "crash on division by zero": (
        server((REFUSE_ZERO, "")),
        {"division_by_zero", "survives_bad_requests", "refuses_and_goes_on"},
    ),
    "division by zero is infinite": (
        server((REFUSE_ZERO, "        elif request.b == 0.0:\n            response.result = float('inf')\n")),
        {"division_by_zero", "refuses_and_goes_on"},
    ),
    "whole division": (server((RESULT.format("/"), RESULT.format("//"))), {"divide"}),
    "tiny is zero": (server(("request.b == 0.0", "abs(request.b) < 1e-9")), {"precision"}),
    "rounded": (
        server(
            (
                "        return response",
                ("        response.result = round(response.result, 2)\n        return response"),
            )
        ),
        {"precision"},
    ),
    "no message": (
        server(("response.message = f\"Unknown operation '{request.operation}'\"", "pass")),
        {"unknown_operation"},
    ),
    "a response kept": (
        server((SUCCEEDS, ("        self.last = response = getattr(self, 'last', response)\n" + SUCCEEDS))),
        {"each_answer_stands_alone"},
    ),
    "no log of requests": (
        server(
            (
                (
                    "        self.get_logger().info(\n            f'Request: a={request.a} b={request.b} "
                    "operation={request.operation}')\n"
                ),
                "",
            )
        ),
        {"logs_requests"},
    ),
    "no log of responses": (server(("result={response.result} ", "")), {"logs_responses"}),
    "request in the node, many threads": (
        server(
            ("import rclpy\n", "import time\nimport rclpy\n"),
            REENTRANT,
            (
                SUCCEEDS,
                (
                    "        self.request = request\n        time.sleep(0.01)\n"
                    "        request = self.request\n        response.success = True\n"
                ),
            ),
            FOUR_THREADS,
        ),
        {"each_answer_stands_alone"},
    ),
    "another name": (server(("'/calculator'", "'/calc'")), SERVER_TESTS),
    "another definition": (
        changed(REFERENCE, SRV, ("bool success\nstring message", "string message\nbool success")),
        {"interface_response"},
    ),
    "client computes": (client(("{response.result}", "{a + b}")), {"client_shows_result"}),
    "client mixes up": (client(("Request(a=a, b=b", "Request(a=b, b=a")), {"client_sends"}),
    "client is silent": (client(("{response.message}", "")), {"client_shows_message"}),
    "client has success without server": (
        client(("running?')\n        return 1", "running?')\n        return 0")),
        {"client_exit_status"},
    ),
    # Operations
    "add and subtract swapped": (
        server(
            (RESULT.format("+"), RESULT.format("?")),
            (RESULT.format("-"), RESULT.format("+")),
            (RESULT.format("?"), RESULT.format("-")),
        ),
        {"add", "subtract"},
    ),
    "divides the wrong way round": (server(("request.a / request.b", "request.b / request.a")), {"divide"}),
    "multiply is power": (
        server((RESULT.format("*"), "response.result = float(abs(request.a) ** min(request.b, 9.0))")),
        {"multiply"},
    ),
    "subtract without sign": (
        server((RESULT.format("-"), "response.result = abs(request.a - request.b)")),
        {"subtract"},
    ),
    "whole numbers": (
        server((RETURN, "        response.result = float(int(response.result))\n" + RETURN)),
        OPERATIONS | {"precision", "survives_bad_requests", "logs_responses"},
    ),
    "requests as whole numbers": (
        server(
            (SUCCEEDS, ("        request.a, request.b = float(int(request.a)), float(int(request.b))\n" + SUCCEEDS))
        ),
        OPERATIONS | {"precision", "survives_bad_requests"},
    ),
    "result is an int": (server((RETURN, "        response.result = int(response.result)\n" + RETURN)), SERVER_TESTS),
    "float32": (
        server(
            ("import rclpy\n", "import numpy\nimport rclpy\n"),
            (RETURN, "        response.result = float(numpy.float32(response.result))\n" + RETURN),
        ),
        {"precision"},
    ),
    "negative numbers are refused": (
        server(
            (
                FIRST,
                "        if request.a < 0.0 or request.b < 0.0:\n            response.success = False\n"
                "            response.message = 'No negative numbers, please'\n" + ELSE_FIRST,
            )
        ),
        OPERATIONS,
    ),
    "zero is taken for missing": (
        server(
            (
                FIRST,
                "        if not request.a:\n            response.success = False\n"
                "            response.message = 'a is missing'\n" + ELSE_FIRST,
            )
        ),
        OPERATIONS,
    ),
    "every operation refuses b = 0": (
        server((REFUSE_ZERO, ""), (FIRST, REFUSE_ZERO.replace("elif", "if", 1) + ELSE_FIRST)),
        {"add", "subtract", "multiply", "unknown_operation"},
    ),
    "computes all operations first": (
        server(
            (
                SUCCEEDS,
                (
                    "        response.success = True\n        results = {'add': request.a + request.b, "
                    "'divide': request.a / request.b}\n"
                ),
            ),
            (RESULT.format("+"), "response.result = results['add']"),
        ),
        {"add", "subtract", "multiply", "division_by_zero", "survives_bad_requests", "refuses_and_goes_on"},
    ),
    "short names of operations": (
        server(("'subtract'", "'sub'"), ("'multiply'", "'mul'"), ("'divide'", "'div'")),
        {"subtract", "multiply", "divide", "division_by_zero"},
    ),
    "knows the short names as well": (
        server(
            ("== 'subtract'", "in ('subtract', 'sub')"),
            ("== 'multiply'", "in ('multiply', 'mul')"),
            ("!= 'divide'", "not in ('divide', 'div')"),
        ),
        {"unknown_operation"},
    ),
    "operations in capitals": (
        server(
            ("'add'", "'ADD'"), ("'subtract'", "'SUBTRACT'"), ("'multiply'", "'MULTIPLY'"), ("'divide'", "'DIVIDE'")
        ),
        SERVER_TESTS,
    ),
    "compares with is": (
        server(
            ("operation == 'add'", "operation is 'add'"),
            ("operation == 'subtract'", "operation is 'subtract'"),
            ("operation == 'multiply'", "operation is 'multiply'"),
            ("operation != 'divide'", "operation is not 'divide'"),
        ),
        SERVER_TESTS,
    ),
    # Success and message
    "success is never set": (server((SUCCEEDS, "")), SERVER_TESTS),
    "adds, and refuses every request with its operation and numbers": (
        server(
            (
                "        if request.operation == 'add'",
                "        response.message = f'no {request.operation} {request.b}'\n        if True",
            ),
            (SUCCEEDS, ""),
        ),
        SERVER_TESTS,
    ),
    "success is always set": (
        server((RETURN, SUCCEEDS + RETURN)),
        {"division_by_zero", "unknown_operation", "refuses_and_goes_on"},
    ),
    "success the other way round": (
        server((RETURN, "        response.success = not response.success\n" + RETURN)),
        SERVER_TESTS,
    ),
    "division by zero succeeds": (
        server((REFUSE_ZERO, REFUSE_ZERO.replace("False", "True"))),
        {"division_by_zero", "refuses_and_goes_on"},
    ),
    "0 / 0 is 0": (
        server((REFUSE_ZERO, REFUSE_ZERO + "            response.success = request.a == 0.0\n")),
        {"division_by_zero"},
    ),
    "0 / 0 raises": (
        server(("elif request.b == 0.0:", "elif request.b == 0.0 and request.a != 0.0:")),
        {"division_by_zero"},
    ),
    "knows zero by its text": (
        server(("elif request.b == 0.0:", "elif str(request.b) == '0.0':")),
        {"division_by_zero"},
    ),
    "knows zero by its sign": (
        server(
            ("import rclpy\n", "import math\n\nimport rclpy\n"),
            ("elif request.b == 0.0:", "elif request.b == 0.0 and math.copysign(1, request.b) > 0:"),
        ),
        {"division_by_zero"},
    ),
    "division by zero without a message": (
        server(("response.message = 'Division by zero'", "pass")),
        {"division_by_zero"},
    ),
    "a blank message": (server(("'Division by zero'", "' '")), {"division_by_zero"}),
    "message in the log only": (
        server((RETURN, "        response.message = ''\n" + RETURN)),
        {"division_by_zero", "unknown_operation"},
    ),
    "unknown operations divide": (
        server(("        elif request.operation != 'divide':\n" + UNKNOWN, "")),
        {"unknown_operation", "refuses_and_goes_on"},
    ),
    "an empty operation is the one before": (
        server(
            (FIRST, "        request.operation = self.operation = request.operation or self.operation\n" + FIRST),
            ("        super().__init__(", "        self.operation = ''\n        super().__init__("),
        ),
        {"unknown_operation"},
    ),
    "an empty operation adds": (server(("== 'add'", "in ('add', '')")), {"unknown_operation"}),
    "unknown operations raise": (
        server((UNKNOWN, "            raise ValueError(request.operation)\n")),
        {"unknown_operation", "survives_bad_requests", "refuses_and_goes_on"},
    ),
    "a refusal has the result 0": (
        server(
            (UNKNOWN, UNKNOWN + "            response.result = 0\n"),
            (REFUSE_ZERO, REFUSE_ZERO + "            response.result = 0\n"),
        ),
        {"division_by_zero", "unknown_operation", "survives_bad_requests", "refuses_and_goes_on"},
    ),
    "returns nothing for a refusal": (
        server((UNKNOWN, UNKNOWN + "            return\n")),
        {"unknown_operation", "survives_bad_requests", "refuses_and_goes_on"},
    ),
    # From one request to the next
    "returns nothing": (server((RETURN, "")), SERVER_TESTS),
    "a misspelt field": (server(("response.success = True", "response.sucess = True")), SERVER_TESTS),
    "a misspelt field of the request": (
        server(("operation={request.operation}", "operation={request.op}")),
        SERVER_TESTS,
    ),
    "a message kept": (
        server(
            (SUCCEEDS, ("        response.message = getattr(self, 'message', '')\n" + SUCCEEDS)),
            (RETURN, "        self.message = response.message\n" + RETURN),
        ),
        {"each_answer_stands_alone"},
    ),
    "refuses all after a refusal": (
        server(
            (
                RETURN,
                "        self.failed = response.success = response.success and not getattr(self, 'failed', False)\n"
                "        self.failed = not self.failed\n" + RETURN,
            )
        ),
        {"refuses_and_goes_on", "each_answer_stands_alone", "survives_bad_requests"},
    ),
    "right to the first 60 requests": (
        server(
            (
                LOG_RESPONSE,
                "        self.count = getattr(self, 'count', 0) + 1\n"
                "        response.result += self.count > 60\n" + LOG_RESPONSE,
            )
        ),
        {"precision", "refuses_and_goes_on", "each_answer_stands_alone", "survives_bad_requests"},
    ),
    "one node for all requests' numbers": (
        server(
            ("import rclpy\n", "import time\nimport rclpy\n"),
            REENTRANT,
            (
                SUCCEEDS,
                (
                    "        self.a, self.b = request.a, request.b\n        time.sleep(0.01)\n"
                    "        request.a, request.b = self.a, self.b\n        response.success = True\n"
                ),
            ),
            FOUR_THREADS,
        ),
        {"each_answer_stands_alone"},
    ),
    # A mistake in one operation alone
    "add without the sign of b": (
        server((RESULT.format("+"), "response.result = request.a + abs(request.b)")),
        {"add"},
    ),
    "add has success for positive sums": (
        server((RESULT.format("+"), RESULT.format("+") + "\n            response.success = response.result > 0.0")),
        {"add"},
    ),
    "add raises": (
        server((RESULT.format("+"), "response.result = request.a + request.c")),
        {"add", "survives_bad_requests"},
    ),
    "add never answers": (
        server((RESULT.format("+"), "import time\n            time.sleep(1000)")),
        {"add", "survives_bad_requests"},
    ),
    "multiply without sign": (
        server((RESULT.format("*"), "response.result = abs(request.a * request.b)")),
        {"multiply"},
    ),
    "multiply raises": (
        server((RESULT.format("*"), "response.result = request.a.mul(request.b)")),
        {"multiply", "survives_bad_requests"},
    ),
    "12 digits": (
        server((LOG_RESPONSE, "        response.result = float(f'{response.result:.12g}')\n" + LOG_RESPONSE)),
        {"precision"},
    ),
    "very tiny is zero": (server(("request.b == 0.0", "abs(request.b) < 1e-300")), {"precision"}),
    # Refusals
    "one message for every refusal": (
        server(("'Division by zero'", "'Error'"), ("f\"Unknown operation '{request.operation}'\"", "'Error'")),
        {"unknown_operation"},
    ),
    "the two reasons exchanged": (
        server(
            ("'Division by zero'", "f\"Unknown operation '{request.operation}'\" "),
            ("f\"Unknown operation '{request.operation}'\"\n", "'Division by zero'\n"),
        ),
        {"unknown_operation"},
    ),
    "knows modulo": (
        server(
            (
                "        elif request.operation != 'divide':",
                (
                    "        elif request.operation == 'modulo':\n            response.result = request.a % request.b\n"
                    "        elif request.operation != 'divide':"
                ),
            )
        ),
        {"unknown_operation"},
    ),
    "one message for every refusal, with a count": (
        server(
            ("'Division by zero'", "self.count()"),
            ("f\"Unknown operation '{request.operation}'\"", "self.count()"),
            (
                "    def calculate(self",
                (
                    "    def count(self):\n        self.refused = getattr(self, 'refused', 0) + 1\n"
                    "        return f'Error {self.refused}'\n\n    def calculate(self"
                ),
            ),
        ),
        {"unknown_operation"},
    ),
    "looks for zero before it knows the operation": (
        server(
            (REFUSE_ZERO, ""),
            (
                "        elif request.operation != 'divide':\n",
                REFUSE_ZERO + "        elif request.operation != 'divide':\n",
            ),
        ),
        {"unknown_operation"},
    ),
    "looks how an operation begins": (
        server(("request.operation == 'add'", "request.operation.startswith('add')")),
        {"unknown_operation"},
    ),
    "looks at the first letter of an operation": (
        server(("request.operation == 'subtract'", "request.operation[:1] == 's'")),
        {"unknown_operation"},
    ),
    "looks whether a name has the operation in it": (
        server(("request.operation == 'multiply'", "request.operation in 'multiply'")),
        {"unknown_operation"},
    ),
    # From one request to the next, again
    "keeps results by operation and a": (keeps("(request.operation, request.a)"), {"each_answer_stands_alone"}),
    "keeps results by six digits of the numbers": (
        keeps("f'{request.a:g} {request.operation} {request.b:g}'"),
        {"each_answer_stands_alone"},
    ),
    "refuses a result that is very small": (
        server(
            (
                RETURN,
                "        if 0.0 < abs(response.result) < 2e-308:\n            response.success = False\n"
                "            response.message = 'The result is too small'\n" + RETURN,
            )
        ),
        {"precision"},
    ),
    "keeps results by operation and numbers in any order": (
        keeps("(request.operation, *sorted([request.a, request.b]))"),
        {"each_answer_stands_alone"},
    ),
    "finds its operations among the node's methods": (
        server(
            (
                FIRST,
                "        method = getattr(self, request.operation, None)\n"
                "        if method and request.operation not in ('add', 'subtract', 'multiply', 'divide'):\n"
                "            response.result = method(request.a, request.b)\n" + ELSE_FIRST,
            )
        ),
        {"survives_bad_requests"},
    ),
    "formats an operation as a template": (
        server(("operation={request.operation}'", "operation={request.operation}'.format()")),
        {"survives_bad_requests"},
    ),
    "writes its log in ASCII": (
        server((SUCCEEDS, "        request.operation.encode('ascii')\n" + SUCCEEDS)),
        {"survives_bad_requests"},
    ),
    "writes its log in Latin-1": (
        server((SUCCEEDS, "        request.operation.encode('latin-1')\n" + SUCCEEDS)),
        {"survives_bad_requests"},
    ),
    # The log
    "logs a word": (
        server(("f'Request: a={request.a} b={request.b} operation={request.operation}'", "'Request received'")),
        {"logs_requests"},
    ),
    "logs b twice": (server(("a={request.a}", "a={request.b}")), {"logs_requests"}),
    "logs a request without its operation": (server((" operation={request.operation}", "")), {"logs_requests"}),
    "logs each value in a line of its own": (
        server(
            (
                LOG_REQUEST,
                (
                    "        for name in ('a', 'b', 'operation'):\n"
                    "            self.get_logger().info(f'{name}={getattr(request, name)}')\n"
                ),
            )
        ),
        {"logs_requests"},
    ),
    "logs the operation of the first request only": (
        server(
            (
                "        self.get_logger().info(\n            f'Request: a={request.a} b={request.b} ",
                (
                    "        self.first = getattr(self, 'first', request.operation)\n"
                    "        self.get_logger().info(\n            f'Request: a={request.a} b={request.b} "
                ),
            ),
            ("operation={request.operation}", "operation={self.first}"),
        ),
        {"logs_requests"},
    ),
    "refuses what comes 4 s after the request before": (
        server(
            ("from rclpy.node import Node\n", "import time\nfrom rclpy.node import Node\n"),
            (
                "        response.success = True\n        if request",
                (
                    "        before, self.latest = getattr(self, 'latest', time.monotonic()), time.monotonic()\n"
                    "        response.success = self.latest - before < 4.0\n"
                    "        if not response.success:\n            response.message = 'session expired'\n"
                    "        elif request"
                ),
            ),
        ),
        {"each_answer_stands_alone", "survives_bad_requests"},
    ),
    "ends after 5 s without a request": (
        server(
            ("from rclpy.node import Node\n", "import time\nfrom rclpy.node import Node\n"),
            (
                "        self.get_logger().info('Calculator ready')\n",
                (
                    "        self.latest = time.monotonic()\n        self.create_timer(0.5, self.look)\n"
                    "        self.get_logger().info('Calculator ready')\n\n"
                    "    def look(self):\n        if time.monotonic() - self.latest > 5.0:\n"
                    "            raise SystemExit('nobody asks')\n"
                ),
            ),
            (
                "        response.success = True\n        if",
                "        self.latest = time.monotonic()\n        response.success = True\n        if",
            ),
        ),
        {"each_answer_stands_alone"},
    ),
    "logs each response but the first": (
        server(
            (
                "        self.get_logger().info(\n            f'Response",
                (
                    "        self.done = getattr(self, 'done', 0) + 1\n"
                    "        if self.done > 1:\n            self.get_logger().info(\n            f'Response"
                ),
            )
        ),
        {"logs_responses"},
    ),
    "logs a refusal without its message": (
        server(("            f'message={response.message}')", "            'message=')")),
        {"logs_responses"},
    ),
    "logs no result of 0": (
        server((LOG_RESPONSE, "        if response.result or response.message:\n" + "    " + indented(LOG_RESPONSE))),
        {"logs_responses"},
    ),
    "logs results without their sign": (
        server(("result={response.result} ", "result={abs(response.result)} ")),
        {"logs_responses"},
    ),
    "logs no refusals": (
        server(
            (LOG_RESPONSE, "        if response.success:\n" + LOG_RESPONSE.replace("        self", "            self"))
        ),
        {"logs_responses"},
    ),
    "logs the response before it is there": (
        server((LOG_RESPONSE, ""), (SUCCEEDS, LOG_RESPONSE + SUCCEEDS)),
        {"logs_responses"},
    ),
    "logs nothing": (
        server(
            (LOG_RESPONSE, ""),
            (
                (
                    "        self.get_logger().info(\n            f'Request: a={request.a} "
                    "b={request.b} operation={request.operation}')\n"
                ),
                "",
            ),
        ),
        {"logs_requests", "logs_responses"},
    ),
    "logs the first request": (
        server(("self.get_logger().info(\n            f'Re", "self.get_logger().info(once=True, message=f'Re")),
        {"logs_requests", "logs_responses"},
    ),
    "logs no refused requests": (
        server(
            (LOG_REQUEST, ""),
            (LOG_RESPONSE, "        if response.success:\n    " + indented(LOG_REQUEST) + LOG_RESPONSE),
        ),
        {"logs_requests"},
    ),
    "logs additions alone": (
        server((LOG_REQUEST, "        if request.operation == 'add':\n    " + indented(LOG_REQUEST))),
        {"logs_requests"},
    ),
    "logs six digits of a request's numbers": (
        server(("a={request.a} b={request.b}", "a={request.a:g} b={request.b:g}")),
        {"logs_requests"},
    ),
    "logs requests in whole numbers": (
        server(("a={request.a} b={request.b}", "a={request.a:.0f} b={request.b:.0f}")),
        {"logs_requests"},
    ),
    "logs the operation in small letters": (
        server(("operation={request.operation}", "operation={request.operation.lower()}")),
        {"logs_requests"},
    ),
    "logs a request only when it is another than the one before": (
        server(
            (
                LOG_REQUEST,
                "        if (asked := (request.a, request.b, request.operation)) != getattr(self, 'asked', None):\n    "
                + indented(LOG_REQUEST)
                + "        self.asked = asked\n",
            )
        ),
        {"logs_requests"},
    ),
    "logs the results of additions alone": (
        server(
            (
                LOG_RESPONSE,
                "        if request.operation == 'add' or not response.success:\n    " + indented(LOG_RESPONSE),
            )
        ),
        {"logs_responses"},
    ),
    "logs the response before": (
        server(
            (
                LOG_RESPONSE,
                "        before, self.now = getattr(self, 'now', 0.0), response.result\n"
                + LOG_RESPONSE.replace("{response.result}", "{before}"),
            )
        ),
        {"logs_responses"},
    ),
    "logs the results of all operations": (
        server(
            (
                LOG_RESPONSE,
                (
                    "        a, b = request.a, request.b\n"
                    "        self.get_logger().info(f'{a + b} {a - b} {a * b} {a / (b or 1.0)} {response.message}')\n"
                ),
            )
        ),
        {"logs_responses"},
    ),
    "logs results in whole numbers": (
        server(("result={response.result}", "result={response.result:.0f}")),
        {"logs_responses"},
    ),
    "logs at a level that is not shown": (
        server(("self.get_logger().info(\n", "self.get_logger().debug(\n")),
        {"logs_requests", "logs_responses"},
    ),
    # Service and node
    "a name in the node's": (server(("'/calculator'", "'~/calculator'")), SERVER_TESTS),
    # The rest of the server cannot be judged: requests of the other type have no numbers and no operation.
    "another type": (
        server(("from calculator_interfaces.srv import Calculate", "from std_srvs.srv import SetBool as Calculate")),
        SERVER_TESTS,
    ),
    "never spins": (
        server(("        rclpy.spin(node)", "        import time\n        time.sleep(1000)")),
        SERVER_TESTS,
    ),
    "spins once": (server(("rclpy.spin(node)", "rclpy.spin_once(node)")), SERVER_TESTS),
    "main is not called": (server(("\n    main()", "\n    pass")), SERVER_TESTS),
    "no rclpy.init": (server(("    rclpy.init(args=args)\n", "")), SERVER_TESTS),
    "no service": (
        server(("        self.srv = self.create_service(Calculate, '/calculator', self.calculate)\n", "")),
        SERVER_TESTS,
    ),
    "a service in a namespace": (
        server(
            ("'/calculator'", "'calculator'"),
            ("super().__init__('calculator_server')", "super().__init__('calculator_server', namespace='math')"),
        ),
        SERVER_TESTS,
    ),
    "ends after a refusal": (
        server(
            ("rclpy.spin(node)", "while not node.refused:\n            rclpy.spin_once(node)"),
            ("        super().__init__(", "        self.refused = False\n        super().__init__("),
            (RETURN, "        self.refused = not response.success\n" + RETURN),
        ),
        SERVER_TESTS - OPERATIONS - {"precision"},
    ),
    "ends 0.7 s after a refusal": (
        server(
            ("import rclpy\n", "import os\nimport threading\n\nimport rclpy\n"),
            (
                RETURN,
                "        if not response.success:\n            threading.Timer(0.7, os._exit, (0,)).start()\n" + RETURN,
            ),
        ),
        {"refuses_and_goes_on"},
    ),
    "ends 2 s after a refusal": (
        server(
            ("import rclpy\n", "import os\nimport threading\n\nimport rclpy\n"),
            (
                RETURN,
                "        if not response.success:\n            threading.Timer(2.0, os._exit, (0,)).start()\n" + RETURN,
            ),
        ),
        {"refuses_and_goes_on"},
    ),
    "does every eighth thing that cannot be done": (
        server(
            (
                RETURN,
                "        self.refusals = getattr(self, 'refusals', 0) + (not response.success)\n"
                "        response.success = response.success or self.refusals % 8 == 0\n" + RETURN,
            )
        ),
        {"refuses_and_goes_on", "unknown_operation"},
    ),
    "a division by zero spoils the next result": (
        server(
            (
                LOG_RESPONSE,
                "        if getattr(self, 'by_zero', False):\n            response.result = 0.0\n"
                "        self.by_zero = response.message == 'Division by zero'\n" + LOG_RESPONSE,
            )
        ),
        {"refuses_and_goes_on"},
    ),
    "a division by zero makes the next request fail": (
        server(
            (
                LOG_RESPONSE,
                "        if getattr(self, 'by_zero', False):\n            response.success = False\n"
                "        self.by_zero = response.message == 'Division by zero'\n" + LOG_RESPONSE,
            )
        ),
        {"refuses_and_goes_on"},
    ),
    # The definition
    "float32 in the definition": (
        changed(REFERENCE, SRV, ("float64 result", "float32 result")),
        {"interface_response"},
    ),
    "a field too many": (
        changed(REFERENCE, SRV, ("string message", "string message\nint32 code")),
        {"interface_nothing_else"},
    ),
    "request and response in one": (changed(REFERENCE, SRV, ("---\n", "")), INTERFACE),
    "a default value": (changed(REFERENCE, SRV, ("float64 b", "float64 b 1.0")), {"interface_nothing_else"}),
    "definition in C": (changed(REFERENCE, SRV, ("float64", "double")), INTERFACE),
    "definition in UTF-16": (REFERENCE | {SRV: REFERENCE[SRV].decode().encode("utf-16")}, INTERFACE),
    "definition with a byte order mark": (REFERENCE | {SRV: b"\xef\xbb\xbf" + REFERENCE[SRV]}, INTERFACE),
    "a constant": (
        changed(REFERENCE, SRV, ("float64 result", "uint8 ADD=1\nfloat64 result")),
        {"interface_nothing_else"},
    ),
    "b before a": (changed(REFERENCE, SRV, ("float64 a\nfloat64 b", "float64 b\nfloat64 a")), {"interface_request"}),
    "an operation by number": (changed(REFERENCE, SRV, ("string operation", "uint8 operation")), {"interface_request"}),
    # The client
    "client asks three times": (
        client(
            (
                (
                    "        future = self.client.call_async(Calculate.Request(a=a, b=b, operation=operation))\n"
                    "        rclpy.spin_until_future_complete(self, future, timeout_sec=timeout_sec)\n"
                ),
                (
                    "        for _ in range(3):\n"
                    "            future = self.client.call_async(Calculate.Request(a=a, b=b, operation=operation))\n"
                    "            rclpy.spin_until_future_complete(self, future, timeout_sec=timeout_sec)\n"
                ),
            )
        ),
        {"client_sends"},
    ),
    "client asks again when it is refused": (
        client(
            (
                "    if not response.success:\n",
                (
                    "    if not response.success:\n        rclpy.init()\n"
                    "        response = CalculatorClient().call(a, b, operation)\n        rclpy.shutdown()\n"
                ),
            )
        ),
        {"client_sends"},
    ),
    "client takes no more than three words": (
        client(("remove_ros_args(args)", "remove_ros_args(args)[:4]")),
        {"client_arguments"},
    ),
    "client calls before it counts its arguments": (
        client(
            ("_, a, b, operation = remove_ros_args(args)", "_, a, b, operation, *more = remove_ros_args(args)"),
            (
                "    rclpy.init(args=args)\n",
                (
                    "    rclpy.init(args=args)\n"
                    "    if more:\n"
                    "        CalculatorClient().call(a, b, operation)\n"
                    "        print(USAGE)\n"
                    "        return 2\n"
                ),
            ),
        ),
        {"client_arguments"},
    ),
    "client looks for the server before its arguments": (
        client(
            (
                "    try:\n        _, a, b, operation",
                (
                    "    rclpy.init(args=args)\n"
                    "    if not CalculatorClient().client.wait_for_service(timeout_sec=1.5):\n"
                    "        print('No answer from /calculator: is calculator_server.py running?')\n"
                    "        return 3\n"
                    "    try:\n        _, a, b, operation"
                ),
            ),
            ("        return 2\n    rclpy.init(args=args)\n", "        return 2\n"),
        ),
        {"client_arguments"},
    ),
    "client prints Python's message in the place of its usage": (
        client(("except ValueError:\n        print(USAGE)", "except ValueError as error:\n        print(error)")),
        {"client_arguments"},
    ),
    "client strips the message": (
        client(("{response.message}", "{response.message.strip()}")),
        {"client_shows_message"},
    ),
    "client shows the first line of the message": (
        client(("{response.message}", "{response.message.partition(chr(10))[0]}")),
        {"client_shows_message"},
    ),
    "client takes the message for a template": (
        client(("f'{operation} failed: {response.message}'", "('{} failed: ' + response.message).format(operation)")),
        {"client_shows_message"},
    ),
    "client takes the message for a format": (
        client(("f'{operation} failed: {response.message}'", "('%s failed: ' + response.message) % operation")),
        {"client_shows_message"},
    ),
    "client takes every refusal but a division's for a success": (
        client(("if not response.success:", "if not response.success and operation == 'divide':")),
        {"client_shows_message", "client_exit_status"},
    ),
    "client prints its usage for a refused operation that it does not know": (
        client(
            (
                "    if not response.success:\n",
                """    if not response.success and operation not in USAGE:
        print(USAGE)
        return 2
    if not response.success:
""",
            )
        ),
        {"client_shows_message"},
    ),
    "client fails only when a division is refused": (
        client(
            ("{response.message}')\n        return 1", "{response.message}')\n        return operation == 'divide'")
        ),
        {"client_exit_status"},
    ),
    "client ends with the result of a refusal": (
        client(("{response.message}')\n        return 1", "{response.message}')\n        return int(response.result)")),
        {"client_exit_status"},
    ),
    "client looks for an option before it counts its arguments": (
        client(
            (
                "        _, a, b, operation = remove_ros_args(args)\n",
                (
                    "        if remove_ros_args(args)[1] == '--help':\n            raise ValueError\n"
                    "        _, a, b, operation = remove_ros_args(args)\n"
                ),
            )
        ),
        {"client_arguments"},
    ),
    "client looks at the first number alone": (
        client(
            ("a, b = float(a), float(b)", "a = float(a)"),
            ("    rclpy.init(args=args)\n", "    b = float(b)\n    rclpy.init(args=args)\n"),
        ),
        {"client_arguments"},
    ),
    "client says the same whatever is wrong": (
        client(
            ("print(USAGE)", "print('Error')"),
            ("'No answer from /calculator: is calculator_server.py running?'", "'Error'"),
        ),
        {"client_without_server", "client_without_answer"},
    ),
    "client refuses a division by zero itself": (
        client(
            (
                "    rclpy.init(args=args)\n",
                (
                    "    if operation == 'divide' and b == 0.0:\n        print('Division by zero')\n        return 1\n"
                    "    rclpy.init(args=args)\n"
                ),
            )
        ),
        {"client_shows_message"},
    ),
    "client takes no 0 for b": (
        client(
            (
                "    rclpy.init(args=args)\n",
                "    if not b:\n        print('B must not be 0')\n        return 2\n    rclpy.init(args=args)\n",
            )
        ),
        {"client_shows_message"},
    ),
    "client writes the message in small letters": (
        client(("{response.message}", "{response.message.lower()}")),
        {"client_shows_message"},
    ),
    "client shows the beginning of the message": (
        client(("{response.message}", "{response.message:.24}")),
        {"client_shows_message"},
    ),
    "client looks at the message for success": (
        client(("if not response.success", "if response.message")),
        {"client_shows_result", "client_exit_status"},
    ),
    "client looks at the result for success": (
        client(("if not response.success", "if not response.result")),
        {"client_shows_result", "client_shows_message", "client_exit_status"},
    ),
    "client shows no sign": (client(("{response.result}", "{abs(response.result)}")), {"client_shows_result"}),
    "client has success when it is refused": (
        client(("{response.message}')\n        return 1", "{response.message}')\n        return 0")),
        {"client_exit_status"},
    ),
    "client fails when it has a result": (
        client(("{response.result}')\n    return 0", "{response.result}')\n    return 3")),
        {"client_exit_status"},
    ),
    "client is killed without a server": (
        client(("running?')\n        return 1", "running?', flush=True)\n        import os\n        os.abort()")),
        {"client_exit_status"},
    ),
    "client says what it does, and nothing without a server": (
        client(
            ("    rclpy.init(args=args)\n", "    print('Calling', a, operation, b)\n    rclpy.init(args=args)\n"),
            ("        print('No answer from /calculator: is calculator_server.py running?')\n", ""),
        ),
        {"client_without_server", "client_without_answer"},
    ),
    "client waits 25 s for a server": (
        client(("wait_for_service(timeout_sec=timeout_sec)", "wait_for_service(timeout_sec=25.0)")),
        {"client_without_server"},
    ),
    "client ignores success": (
        client(("    if not response.success:\n", "    if False:\n")),
        {"client_shows_message", "client_exit_status"},
    ),
    "client leaves out the dots at the message's end": (
        client(("{response.message}", '{response.message.rstrip(".")}')),
        {"client_shows_message"},
    ),
    "client shows its own reason": (client(("{response.message}", "division by zero")), {"client_shows_message"}),
    "client counts the arguments for ROS": (
        client(("_, a, b, operation = remove_ros_args(args)", "_, a, b, operation = args or sys.argv")),
        {"client_sends"},
    ),
    "client knows a number by its digits": (
        client(
            (
                "_, a, b, operation = remove_ros_args(args)\n",
                """_, a, b, operation = remove_ros_args(args)
        if not all(word.lstrip('+-').replace('.', '', 1).isdigit() for word in (a, b)):
            raise ValueError
""",
            )
        ),
        {"client_sends"},
    ),
    "client counts the words of its whole command line": (
        client(
            (
                "_, a, b, operation = remove_ros_args(args)\n",
                """if len(sys.argv) != 4:
            raise ValueError
        _, a, b, operation = remove_ros_args(args)
""",
            )
        ),
        {"client_sends"},
    ),
    "client wants a digit before the point": (
        client(
            ("import sys\n", "import re\nimport sys\n"),
            (
                "        a, b = float(a), float(b)\n",
                (
                    "        if not all(re.match(r'[-+]?\\d', number) for number in (a, b)):\n"
                    "            raise ValueError\n"
                    "        a, b = float(a), float(b)\n"
                ),
            ),
        ),
        {"client_sends"},
    ),
    "client knows a number by a pattern without an exponent": (
        client(
            (
                "_, a, b, operation = remove_ros_args(args)\n",
                """_, a, b, operation = remove_ros_args(args)
        import re
        if not all(re.fullmatch(r'[-+]?[0-9]*[.]?[0-9]+', word) for word in (a, b)):
            raise ValueError
""",
            )
        ),
        {"client_sends"},
    ),
    "client sends the operation in small letters": (
        client(("operation=operation", "operation=operation.lower()")),
        {"client_sends"},
    ),
    "client sends the operation without blanks": (
        client(("operation=operation", "operation=operation.strip()")),
        {"client_sends"},
    ),
    "client takes an empty operation for a missing one": (
        client(
            (
                "        a, b = float(a)",
                "        if not operation:\n            raise ValueError\n        a, b = float(a)",
            )
        ),
        {"client_sends"},
    ),
    "client sends six decimals": (
        client(("float(a), float(b)", "round(float(a), 6), round(float(b), 6)")),
        {"client_sends"},
    ),
    "client takes a result of 0 for a failure": (
        client(("if not response.success:", "if not (response.success and response.result):")),
        {"client_shows_result", "client_exit_status"},
    ),
    "client makes a result a whole number when it is one": (
        client(
            (
                "    print(f'{a} {operation}",
                (
                    "    if response.result == int(response.result):\n        print(int(response.result))\n"
                    "        return 0\n    print(f'{a} {operation}"
                ),
            )
        ),
        {"client_shows_result"},
    ),
    "client knows the signs of the four operations": (
        client(
            (
                "    print(f'{a} {operation}",
                (
                    "    signs = {'add': '+', 'subtract': '-', 'multiply': '*', 'divide': '/'}\n"
                    "    print(f'{a} {signs[operation]}"
                ),
            )
        ),
        {"client_shows_result"},
    ),
    "client shows one blank for two": (
        client(("{response.message}", '{" ".join(response.message.split())}')),
        {"client_shows_message"},
    ),
    "client shows the message in Latin-1": (
        client(("{response.message}", '{response.message.encode("latin-1", "replace").decode("latin-1")}')),
        {"client_shows_message"},
    ),
    "client shows the message in ASCII": (
        client(("{response.message}", "{ascii(response.message)[1:-1]}")),
        {"client_shows_message"},
    ),
    "client wraps the message": (
        client(
            ("import sys\n", "import sys\nimport textwrap\n"),
            ("print(f'{operation} failed: {response.message}')", "print(textwrap.fill(f'Failed: {response.message}'))"),
        ),
        {"client_shows_message"},
    ),
    "client knows the four operations": (
        client(
            (
                "_, a, b, operation = remove_ros_args(args)\n",
                """_, a, b, operation = remove_ros_args(args)
        if operation not in ('add', 'subtract', 'multiply', 'divide'):
            raise ValueError
""",
            )
        ),
        {"client_sends"},
    ),
    "client asks again when no answer comes": (
        client(
            (
                "        return future.result()\n",
                (
                    "        if not future.done():\n"
                    "            future = self.client.call_async(Calculate.Request(a=a, b=b, operation=operation))\n"
                    "            rclpy.spin_until_future_complete(self, future, timeout_sec=timeout_sec)\n"
                    "        return future.result()\n"
                ),
            )
        ),
        {"client_sends"},
    ),
    "logs six digits of a result": (
        server(("result={response.result} ", "result={response.result:g} ")),
        {"logs_responses"},
    ),
    "a result of 0 is refused": (
        server(
            (
                RETURN,
                "        response.success = response.success and response.result != 0.0\n"
                "        response.message = response.message or ('' if response.success else 'No result')\n" + RETURN,
            )
        ),
        OPERATIONS,
    ),
    "a division by zero is as one by a small number": (
        server(("request.b == 0.0", "False"), ("request.a / request.b", "request.a / (request.b or 1e-3)")),
        {"refuses_and_goes_on", "division_by_zero"},
    ),
    "client shows six digits": (client(("{response.result}", "{response.result:g}")), {"client_shows_result"}),
    "client sends whole numbers": (
        client(("float(a), float(b)", "float(int(float(a))), float(int(float(b)))")),
        {"client_sends"},
    ),
    "client shows eight digits": (client(("{response.result}", "{response.result:.8g}")), {"client_shows_result"}),
    "client shows a whole number": (client(("{response.result}", "{response.result:.0f}")), {"client_shows_result"}),
    "client sleeps until the answer is there": (
        client((ASKS, SLEEPS)),
        {"client_shows_result", "client_shows_message", "client_exit_status", "client_without_answer"},
    ),
    "client shows the future": (
        client(("        return future.result()", "        print(future)\n        return future"), (ASKS, SLEEPS)),
        {"client_shows_result", "client_shows_message", "client_without_answer"},
    ),
    "client always adds": (client(("operation=operation", "operation='add'")), {"client_sends"}),
    "client has its numbers in its source": (
        client(("a, b = float(a), float(b)", "float(a), float(b)\n        a, b = 15.5, 3.2")),
        {"client_sends"},
    ),
    "client takes the operation in the middle": (client(("_, a, b, operation", "_, a, operation, b")), CLIENT_TESTS),
    "client takes the operation first": (client(("_, a, b, operation", "_, operation, a, b")), CLIENT_TESTS),
    "client reads from the keyboard": (
        client(("_, a, b, operation = remove_ros_args(args)", "a, b, operation = input('a: '), input('b: '), input()")),
        CLIENT_TESTS,
    ),
    "client calls another name": (client(("'/calculator'", "'/calculate'")), CLIENT_TESTS),
    "client waits for a server for ever": (
        client(("wait_for_service(timeout_sec=timeout_sec)", "wait_for_service()")),
        {"client_without_server"},
    ),
    "client takes a refusal without a message for a success": (
        client(("if not response.success:", "if not response.success and response.message:")),
        {"client_exit_status"},
    ),
    "client waits for the answer for ever": (
        client((ASKS, ASKS.replace(", timeout_sec=timeout_sec", ""))),
        {"client_without_answer"},
    ),
    "client waits 25 s for the answer": (
        client((ASKS, ASKS.replace("timeout_sec=timeout_sec", "timeout_sec=25.0"))),
        {"client_without_answer"},
    ),
    "client dies without an answer": (
        client((ASKS, ASKS + "        future.result().success = bool(future.result().success)\n")),
        {"client_without_answer"},
    ),
    "client says nothing without an answer": (
        client((ASKS, ASKS + "        if not future.done():\n            sys.exit(3)\n")),
        {"client_without_answer"},
    ),
    "client finds no server, and says nothing": (
        client(("            return None\n", "            sys.exit(3)\n")),
        {"client_without_server"},
    ),
    "client takes whatever is missing for a server": (
        client(("            return None\n", "            raise RuntimeError('no server')\n")),
        {"client_without_server"},
    ),
    "client prints its usage when nobody answers": (
        client(("'No answer from /calculator: is calculator_server.py running?'", "USAGE")),
        {"client_without_server", "client_without_answer"},
    ),
    "client prints every line that it might be asked for": (
        client(
            (
                "    rclpy.init(args=args)\n",
                (
                    "    print(USAGE)\n    print('No answer from /calculator: is calculator_server.py running?')\n"
                    "    rclpy.init(args=args)\n"
                ),
            )
        ),
        {"client_without_server", "client_without_answer", "client_arguments"},
    ),
    "client prints the same two lines in each failure": (
        client(
            (
                "        print(USAGE)\n",
                (
                    "        print(USAGE)\n"
                    "        print('No answer from /calculator: is calculator_server.py running?')\n"
                    "        print(*sys.argv)\n"
                ),
            )
        ),
        {"client_without_server", "client_without_answer"},
    ),
    "client dies without server": (
        client(("    if response is None:\n", "    if False:\n")),
        {"client_without_server", "client_without_answer"},
    ),
    "client says nothing without server": (
        client(("        print('No answer from /calculator: is calculator_server.py running?')\n", "")),
        {"client_without_server", "client_without_answer"},
    ),
    "client does not end": (
        client(
            (
                "    if not response.success:",
                ("    import time\n    print(response)\n    time.sleep(1000)\n    if not response.success:"),
            )
        ),
        {"client_exit_status"},
    ),
    "client counts its arguments only": (
        client(
            ("        a, b = float(a), float(b)\n", ""),
            ("    rclpy.init(args=args)\n", ("    a, b = float(a), float(b)\n    rclpy.init(args=args)\n")),
        ),
        {"client_arguments"},
    ),
    "client does not count its arguments": (
        client(
            ("_, a, b, operation = remove_ros_args(args)", "a, b, operation = sys.argv[1], sys.argv[2], sys.argv[3]")
        ),
        {"client_arguments"},
    ),
    "client has success with wrong arguments": (
        client(("print(USAGE)\n        return 2", "print(USAGE)\n        return 0")),
        {"client_exit_status"},
    ),
    "client makes up its words": (
        client(
            (
                "        print(USAGE)\n",
                (
                    "        import random, string\n"
                    "        print(*(''.join(random.choices(string.ascii_lowercase, k=8)) for _ in range(9)))\n"
                ),
            )
        ),
        {"client_arguments"},
    ),
    "client has no word on its usage": (client(("        print(USAGE)\n", "")), {"client_arguments"}),
    "client's main has no exit status": (client(("sys.exit(main())", "main()")), {"client_exit_status"}),
    "client has no usage": (
        client(("    except ValueError:\n        print(USAGE)\n        return 2\n", "    finally:\n        pass\n")),
        {"client_arguments"},
    ),
}

# Programs that do nothing that the task asks for.
DOING_NOTHING = {
    "refuses everything; says no": written(programs.REFUSER, programs.NO_CLIENT),
    "answers 42; says its usage": written(programs.CONSTANT, programs.USAGE_CLIENT),
    "answers 1 but refuses 0; shows a number of its own": written(programs.CAREFUL, programs.CHEERFUL_CLIENT),
    "returns the response untouched; says no": written(programs.UNTOUCHED, programs.NO_CLIENT),
    "raises; an empty client": written(programs.REFUSER.replace("print(request)", "raise ValueError"), "\n"),
    "no programs": written("\n", "\n"),
}
WRONG |= {name: (files, SERVER_TESTS | CLIENT_TESTS) for name, files in DOING_NOTHING.items()}
NOTHING = {*DOING_NOTHING}
SEVERAL = {"add and subtract swapped", "logs nothing"}
# The server answers nothing, or refuses all.
USELESS = {name for name, (_, lost) in WRONG.items() if lost == SERVER_TESTS}
SILENT = {
    "never spins",
    "add never answers",
    "client waits for a server for ever",
    "client waits 25 s for a server",
    "client waits for the answer for ever",
    "client waits 25 s for the answer",
    "client does not end",
}
# Judged by the whole suite in every run of the tests: what is right, and partial credit of each kind.
QUICK = {
    "crash on division by zero",
    "more than asked, messages with times; async",  # gives up while its executor still has a task
    "reference",
}
BROAD = {
    "whole numbers",
    "requests as whole numbers",
    "client takes the operation in the middle",
    "client takes the operation first",
    "client reads from the keyboard",
    "client calls another name",
}  # one line that breaks each operation, or all that the client does

# Mistakes in what the exercise is about, and mistakes in a detail: `test_weights.py` holds what each costs.
ABOUT = {
    "crash on division by zero",
    "computes all operations first",
    "division by zero is infinite",
    "division by zero succeeds",
    "success is always set",
    "success the other way round",
    "unknown operations divide",
    "unknown operations raise",
    "a refusal has the result 0",
    "returns nothing for a refusal",
    "refuses all after a refusal",
    "ends after a refusal",
}
DETAIL = {
    "a default value",
    "a constant",
    "a field too many",
    "b before a",
    "another definition",
    "float32 in the definition",
    "subtract without sign",
    "whole division",
    "tiny is zero",
    "rounded",
    "12 digits",
    "0 / 0 is 0",
    "0 / 0 raises",
    "no message",
    "a blank message",
    "message in the log only",
    "one message for every refusal",
    "looks for zero before it knows the operation",
    "an empty operation adds",
    "looks how an operation begins",
    "a response kept",
    "a message kept",
    "keeps results by operation and a",
    "keeps results by six digits of the numbers",
    "refuses a result that is very small",
    "request in the node, many threads",
    "adds with math.fsum",
    "writes its log in ASCII",
    "logs nothing",
    "logs no refused requests",
    "logs no refusals",
    "logs no result of 0",
    "logs results without their sign",
    "logs the operation in small letters",
    "logs a request only when it is another than the one before",
    "client asks three times",
    "client counts the arguments for ROS",
    "client knows a number by its digits",
    "client sends the operation in small letters",
    "client sends the operation without blanks",
    "client takes an empty operation for a missing one",
    "client makes a result a whole number when it is one",
    "client looks for an option before it counts its arguments",
    "client wraps the message",
    "client shows one blank for two",
    "client shows the message in ASCII",
    "client shows six digits",
    "client shows eight digits",
    "client writes the message in small letters",
    "client refuses a division by zero itself",
    "client takes no more than three words",
    "client prints its usage when nobody answers",
    "client waits for a server for ever",
    "client waits for the answer for ever",
    "client's main has no exit status",
}

# Judged as one program each in every run of the tests, see the package.
TOGETHER = [
    {
        "subtract swapped",
        "adds with math.fsum",
        "refuses what follows an empty operation",
        "whole division",
        "no log of responses",
        "another definition",
        "client computes",
        "client mixes up",
        "client is silent",
        "client has success without server",
        "multiply is power",
        "0 / 0 is 0",
        "b before a",
        "client dies without an answer",
    },
    {
        "no message",
        "no log of requests",
        "add without the sign of b",
        "ends 0.7 s after a refusal",
        "a field too many",
        "client finds no server, and says nothing",
    },
    {"tiny is zero", "client takes no more than three words"},
]
