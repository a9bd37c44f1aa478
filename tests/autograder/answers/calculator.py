"""Answers to the calculator exercise."""

from . import SOLUTIONS, changed

SOLUTION = SOLUTIONS / "calculator"
SRV, SERVER, CLIENT = "Calculate.srv", "calculator_server.py", "calculator_client.py"


def reference() -> dict[str, bytes]:
    """The reference answer, with a client that gives up sooner, so that the tests take less time."""
    files = {name: (SOLUTION / name).read_bytes() for name in (SRV, SERVER, CLIENT)}
    return changed(files, CLIENT, ("timeout_sec=5.0", "timeout_sec=1.5")) if b"timeout_sec=5.0" in files[CLIENT] else files


def server(*pairs: tuple[str, str]) -> dict[str, bytes]:
    """The reference with a changed server."""
    return changed(reference(), SERVER, *pairs)


def client(*pairs: tuple[str, str]) -> dict[str, bytes]:
    """The reference with a changed client."""
    return changed(reference(), CLIENT, *pairs)


FUNCTIONS = """
import operator, rclpy
from calculator_interfaces.srv import Calculate
TABLE = dict(add=operator.add, subtract=operator.sub, multiply=operator.mul, divide=operator.truediv)

def answer(request, response):
    print('asked for', request.operation, 'of', request.a, 'and', request.b)
    try:
        response.result = TABLE[request.operation](request.a, request.b)
        response.success = True
        response.message = 'done'
    except KeyError:
        response.success, response.message = False, f'I do not know {request.operation}'
    except ZeroDivisionError as error:
        response.success, response.message = False, str(error)
    print('answer:', response.result, response.message)
    return response

rclpy.init()
node = rclpy.create_node('calc')
node.create_service(Calculate, 'calculator', answer)
rclpy.spin(node)
"""

THREADS = """
import asyncio, logging, sys, time
from fractions import Fraction
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from calculator_interfaces.srv import Calculate

class Backend:
    async def compute(self, a, b, operation):
        a, b = Fraction(a), Fraction(b)
        match operation:
            case 'add': return float(a + b)
            case 'subtract': return float(a - b)
            case 'multiply': return float(a * b)
            case 'divide' if b: return float(a / b)
            case 'divide': raise ValueError('b must not be 0')
            case other: raise ValueError('no such operation: ' + other)

class Server(Node):
    def __init__(self, context):
        super().__init__('server', context=context)
        self.backend = Backend()
        self.declare_parameter('verbose', True)
        self.create_timer(0.05, lambda: self.get_logger().warning('still here'))
        self.create_service(Calculate, '/calculator', self.on_request, callback_group=ReentrantCallbackGroup())

    async def on_request(self, request, response):
        self.get_logger().info(str(request))
        try:
            response.result = await self.backend.compute(request.a, request.b, request.operation)
            response.success = True
        except ValueError as error:
            response = Calculate.Response(success=False, message=str(error))
        self.get_logger().info(str(response))
        return response

def main(args=None):
    time.sleep(3)
    print('x' * 200_000, file=sys.stderr)
    context = Context()
    rclpy.init(context=context)
    executor = MultiThreadedExecutor(num_threads=8, context=context)
    executor.add_node(Server(context))
    executor.spin()

if __name__ == '__main__':
    main()
"""

OTHER_CLIENT = """
import argparse, sys
import rclpy
from calculator_interfaces.srv import Calculate

parser = argparse.ArgumentParser()
parser.add_argument('a', type=float)
parser.add_argument('b', type=float)
parser.add_argument('operation')
options = parser.parse_args()
rclpy.init()
node = rclpy.create_node('c')
caller = node.create_client(Calculate, 'calculator')
for attempt in range(3):
    if caller.wait_for_service(0.5):
        break
    node.get_logger().warning('waiting')
else:
    sys.exit('the calculator is not there')
request = Calculate.Request()
request.a, request.b, request.operation = options.a, options.b, options.operation
future = caller.call_async(request)
rclpy.spin_until_future_complete(node, future)
if future.result().success:
    node.get_logger().info(f'Result: {future.result().result:,.2f}')
else:
    node.get_logger().error(f'Failed: {future.result().message}')
"""

RIGHT = {
    "reference": reference(),
    "functions and a table": reference() | {SERVER: FUNCTIONS.encode(), CLIENT: OTHER_CLIENT.encode()},
    "threads, async, own context, slow start": reference() | {SERVER: THREADS.encode()},
    "comments and blanks in the definition": changed(reference(), SRV, ("float64 b\n", "\n# the second\nfloat64   b\n\n")),
}

SERVER_TESTS = {"add", "subtract", "multiply", "divide", "precision", "division_by_zero", "unknown_operation",
                "each_answer_stands_alone", "survives_bad_requests", "two_clients", "logs_requests", "logs_responses"}
REFUSE_ZERO = """        elif request.b == 0.0:
            response.success = False
            response.message = 'Division by zero'
"""
RESULT = "response.result = request.a {} request.b"

# What is wrong, and the tests that it loses (without "test_").
WRONG = {
    "subtract swapped": (server(("request.a - request.b", "request.b - request.a")), {"subtract"}),
    "crash on division by zero": (server((REFUSE_ZERO, "")), {"division_by_zero", "survives_bad_requests"}),
    "division by zero is infinite": (
        server((REFUSE_ZERO, "        elif request.b == 0.0:\n            response.result = float('inf')\n")),
        {"division_by_zero"}),
    "whole division": (server((RESULT.format("/"), RESULT.format("//"))), {"divide"}),
    "tiny is zero": (server(("request.b == 0.0", "abs(request.b) < 1e-9")), {"precision"}),
    "rounded": (server(("        return response", ("        response.result = round(response.result, 2)\n"
                        "        return response"))), {"precision"}),
    "no message": (server(("response.message = f\"Unknown operation '{request.operation}'\"", "pass")),
                   {"unknown_operation"}),
    "a response kept": (
        server(("        response.success = True\n", ("        self.last = response = getattr(self, 'last', response)\n"
                "        response.success = True\n"))), {"each_answer_stands_alone"}),
    "no log of requests": (server((("        self.get_logger().info(\n            f'Request: a={request.a} b={request.b} "
                                   "operation={request.operation}')\n"), "")), {"logs_requests"}),
    "no log of responses": (server(("result={response.result} ", "")), {"logs_responses"}),
    "request in the node, many threads": (
        server(("import rclpy\n", "import time\nimport rclpy\n"),
               ("self.calculate)", "self.calculate,\n            callback_group=rclpy.callback_groups.ReentrantCallbackGroup())"),
               ("        response.success = True\n", ("        self.request = request\n        time.sleep(0.01)\n"
                "        request = self.request\n        response.success = True\n")),
               ("rclpy.spin(node)", "rclpy.spin(node, rclpy.executors.MultiThreadedExecutor(4))")), {"two_clients"}),
    "another name": (server(("'/calculator'", "'/calc'")), SERVER_TESTS),
    "another definition": (changed(reference(), SRV, ("bool success\nstring message", "string message\nbool success")),
                           {"interface"}),
    "client computes": (client(("{response.result}", "{a + b}")), {"client_shows_result"}),
    "client mixes up": (client(("Request(a=a, b=b", "Request(a=b, b=a")), {"client_shows_result"}),
    "client is silent": (client(("{response.message}", "")), {"client_shows_message"}),
    "client has success without server": (client(("running?')\n        return 1", "running?')\n        return 0")),
                                          {"client_without_server"}),
    "client has no usage": (client(("    except ValueError:\n        print(USAGE)\n        return 2\n",
                                    "    finally:\n        pass\n")), {"client_arguments"}),
}
