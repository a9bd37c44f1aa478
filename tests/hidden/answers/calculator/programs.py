"""Servers and clients that do what the task says, each in a style of its own."""

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
        except (ValueError, OverflowError) as error:
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

# The node is held by an object that is none; %-formatting; the response is made anew.
COMPOSED = """
import rclpy
from rclpy.executors import SingleThreadedExecutor
from calculator_interfaces.srv import Calculate

class Refused(Exception):
    pass

class Calculator:
    def __init__(self, node):
        self._log = node.get_logger().get_child('requests')
        self._service = node.create_service(Calculate, '/calculator', self)

    def __call__(self, request, _):
        self._log.info('%s %f %f' % (request.operation, request.a, request.b))
        try:
            result = getattr(self, 'do_' + request.operation, self.unknown)(request.a, request.b)
        except Refused as reason:
            self._log.error('refused: %s' % reason)
            return Calculate.Response(result=float('nan'), message=str(reason))
        self._log.info('-> %.2f' % result)
        return Calculate.Response(result=result, success=True)

    def do_add(self, a, b): return a + b
    def do_subtract(self, a, b): return a - b
    def do_multiply(self, a, b): return a * b
    def do_divide(self, a, b):
        if not b:
            raise Refused('you cannot divide by zero')
        return a / b
    def unknown(self, a, b):
        raise Refused('this operation is unknown')

def main():
    rclpy.init()
    node = rclpy.create_node('anything_at_all')
    calculator = Calculator(node)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        executor.spin()
    finally:
        executor.shutdown()

if __name__ == '__main__':
    main()
"""

# Everything at level debug, ROS 2's own words too, and a timer that talks a thousand times a second.
VERBOSE = """
import rclpy
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.node import Node
from calculator_interfaces.srv import Calculate

class Verbose(Node):
    def __init__(self):
        super().__init__('verbose')
        self.get_logger().set_level(LoggingSeverity.DEBUG)
        self.ticks = 0
        self.create_timer(0.001, self.tick)
        self.srv = self.create_service(Calculate, 'calculator', self.calculate)

    def tick(self):
        self.ticks += 1
        self.get_logger().debug('tick %d' % self.ticks)

    def calculate(self, request, response):
        self.get_logger().debug(f'{request.a=}, {request.b=}, {request.operation=}')
        for step in range(30):
            self.get_logger().debug('thinking')
        if request.operation not in ('add', 'subtract', 'multiply', 'divide'):
            response.success, response.message = False, 'Invalid operation: %r' % request.operation
        elif request.operation == 'divide' and request.b == 0:
            response.success, response.message = False, 'Error: division by zero!'
        else:
            sign = {'add': '+', 'subtract': '-', 'multiply': '*', 'divide': '/'}[request.operation]
            response.result = eval(f'a {sign} b', {'a': request.a, 'b': request.b})
            response.success, response.message = True, f'{request.a} {sign} {request.b} = {response.result}'
        self.get_logger().debug(f'{response.result=}, {response.success=}, {response.message=}')
        return response

def main(args=None):
    rclpy.init(args=args)
    set_logger_level('rcl', LoggingSeverity.DEBUG)
    set_logger_level('rclpy', LoggingSeverity.DEBUG)
    print(*(f'start-up line {number} of 5000' for number in range(5000)), sep='\\n')
    rclpy.spin(Verbose())

main()
"""

# Logs by print and by Python's logging, as comma-separated values with the time; no log of ROS 2's.
COMMA_SEPARATED = """
import logging, math, time
import rclpy
from rclpy.node import Node
from calculator_interfaces.srv import Calculate

logging.basicConfig(level=logging.DEBUG, format='%(asctime)s,%(levelname)s,%(message)s')

class S(Node):
    def __init__(self):
        Node.__init__(self, 'S', enable_rosout=False)
        self.create_service(Calculate, '/calculator', self.cb)

    def cb(self, req, res):
        a, b, op = req.a, req.b, req.operation
        print(f'{a},{b},{op}')
        res.success = False
        if op == 'add': res.result = sum((a, b)); res.success = True
        if op == 'subtract': res.result = sum((a, -b)); res.success = True
        if op == 'multiply': res.result = math.prod((a, b)); res.success = True
        if op == 'divide':
            if math.isclose(b, 0.0):
                res.message = 'Cannot divide by zero.'
            else:
                res.result = a / b; res.success = True
        if op not in {'add', 'subtract', 'multiply', 'divide'}:
            res.message = 'Unknown operation.'
        logging.info('%d,%s,%s', res.success, res.result, res.message)
        return res

rclpy.init()
s = S()
try:
    while rclpy.ok():
        rclpy.spin_once(s, timeout_sec=0.1)
except KeyboardInterrupt:
    s.destroy_node()
"""

# Parameters, services, a publisher and operations that nobody asked for; messages that are never the same.
MORE_THAN_ASKED = """
import time
import rclpy
from rclpy.node import Node
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rcl_interfaces.msg import ParameterDescriptor
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger
from calculator_interfaces.srv import Calculate

class Calculator(Node):
    OPERATIONS = {
        'add': lambda a, b: a + b,
        'subtract': lambda a, b: a - b,
        'multiply': lambda a, b: a * b,
        'divide': lambda a, b: a / b,
        'power': lambda a, b: float(pow(a, b)),
        'sqrt': lambda a, b: abs(a) ** 0.5,
        '+': lambda a, b: a + b,
    }

    def __init__(self):
        super().__init__('calculator_node', parameter_overrides=[])
        self.declare_parameter('log_requests', True, ParameterDescriptor(description='whether to log'))
        self.count = 0
        group = ReentrantCallbackGroup()
        self.results = self.create_publisher(Float64, '~/results', 10)
        self.create_service(Calculate, '/calculator', self.calculate, callback_group=group)
        self.create_service(Calculate, '/calculator/verbose', self.calculate, callback_group=group)
        self.create_service(Trigger, '~/count', self.tell, callback_group=MutuallyExclusiveCallbackGroup())
        self.create_subscription(String, 'notes', lambda note: None, 10)

    def tell(self, request, response):
        response.success, response.message = True, str(self.count)
        return response

    def calculate(self, request, response):
        start = time.perf_counter()
        self.count += 1
        number = self.count
        if self.get_parameter('log_requests').value:
            self.get_logger().info(f'#{number}: {request.operation}({request.a:,.1f}, {request.b:_})')
        operation = self.OPERATIONS.get(request.operation.strip().lower())
        if operation is None:
            response.message = f'#{number}: choose one of {", ".join(self.OPERATIONS)}'
        else:
            try:
                response.result = operation(request.a, request.b)
                response.success = True
                response.message = f'#{number} took {time.perf_counter() - start:.9f} s'
            except (ArithmeticError, TypeError) as error:
                response.message = f'#{number}: {type(error).__name__}: {error}'
        self.results.publish(Float64(data=response.result))
        self.get_logger().info(f'#{number}: {response.success} {response.result:.6e} {response.message}')
        return response

def main(args=None):
    rclpy.init(args=args)
    node = Calculator()
    try:
        rclpy.spin(node, MultiThreadedExecutor(4))
    except (KeyboardInterrupt, ExternalShutdownException):
        pass

if __name__ == '__main__':
    main()
"""

# Decimal numbers, a log in JSON in colours, answers that take a while, a spinning thread.
DECIMAL = """
import json, threading, time
from dataclasses import dataclass
from decimal import Decimal, DivisionByZero, InvalidOperation
from enum import Enum
import rclpy
from rclpy.node import Node
from calculator_interfaces.srv import Calculate

class Operation(Enum):
    ADD = 'add'
    SUBTRACT = 'subtract'
    MULTIPLY = 'multiply'
    DIVIDE = 'divide'

@dataclass
class Outcome:
    result: float = 0.0
    success: bool = False
    message: str = ''

def compute(a: float, b: float, name: str) -> Outcome:
    try:
        operation = Operation(name)
    except ValueError as error:
        return Outcome(message=str(error))
    x, y = Decimal(a), Decimal(b)
    try:
        value = {Operation.ADD: x.__add__, Operation.SUBTRACT: x.__sub__, Operation.MULTIPLY: x.__mul__,
                 Operation.DIVIDE: x.__truediv__}[operation](y)
    except (DivisionByZero, InvalidOperation):
        return Outcome(message='b is zero, and nothing can be divided by zero')
    return Outcome(float(value), True, 'OK')

class DecimalServer(Node):
    def __init__(self):
        super().__init__('decimal_server', namespace='/school')
        self.lock = threading.Lock()
        self.create_service(Calculate, '/calculator', self.serve)

    def serve(self, request, response):
        with self.lock:
            print('\\x1b[32m' + json.dumps({'a': request.a, 'b': request.b, 'op': request.operation}) + '\\x1b[0m')
            time.sleep(0.02)
            outcome = compute(request.a, request.b, request.operation)
            response.result, response.success, response.message = outcome.result, outcome.success, outcome.message
            print('\\x1b[33m' + json.dumps(vars(outcome)) + '\\x1b[0m')
            return response

rclpy.init()
thread = threading.Thread(target=rclpy.spin, args=(DecimalServer(),))
thread.start()
thread.join()
"""

# Encoded as Windows does it in Germany.
LATIN_1 = """# -*- coding: latin-1 -*-
import rclpy
from rclpy.node import Node
from calculator_interfaces.srv import Calculate


def protokolliert(methode):
    def mit_protokoll(self, anfrage, antwort):
        self.get_logger().info('Größe a = {}, Größe b = {}, gewünscht: {}'.format(
            anfrage.a, anfrage.b, anfrage.operation))
        antwort = methode(self, anfrage, antwort)
        self.get_logger().info('zurück: {:.3f} {} {}'.format(antwort.result, antwort.success, antwort.message))
        return antwort
    return mit_protokoll


class Rechner(Node):

    def __init__(self):
        super().__init__('rechner')
        self.dienst = self.create_service(Calculate, '/calculator', self.rechne)

    @protokolliert
    def rechne(self, anfrage, antwort):
        a = anfrage.a
        b = anfrage.b
        antwort.success = anfrage.operation in ['add', 'subtract', 'multiply', 'divide']
        if not antwort.success:
            antwort.message = 'Operation ungültig'
            return antwort
        if anfrage.operation == 'divide' and b == 0.0:
            antwort.success = False
            antwort.message = 'Durch 0 teilt man nicht: ungültig'
            return antwort
        antwort.result = (a + b if anfrage.operation == 'add' else a - b if anfrage.operation == 'subtract'
                          else a * b if anfrage.operation == 'multiply' else a / b)
        antwort.message = 'für Sie berechnet'
        return antwort


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(Rechner())
    rclpy.shutdown()


if __name__ == '__main__':
    main()
"""

ARGPARSE_CLIENT = """
import argparse, sys
import rclpy
from rclpy.utilities import remove_ros_args
from calculator_interfaces.srv import Calculate

parser = argparse.ArgumentParser()
parser.add_argument('a', type=float)
parser.add_argument('b', type=float)
parser.add_argument('operation')
options = parser.parse_args(remove_ros_args(sys.argv)[1:])
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
rclpy.spin_until_future_complete(node, future, timeout_sec=3)
if not future.done():
    sys.exit('the calculator is there, but does not answer')
if future.result().success:
    node.get_logger().info(f'Result: {future.result().result:,.2f}')
else:
    node.get_logger().error(f'Failed: {future.result().message}')
    sys.exit(1)
"""

EXECUTOR_CLIENT = """
import sys
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from calculator_interfaces.srv import Calculate

class Client(Node):
    def __init__(self, executor):
        super().__init__('client')
        executor.add_node(self)
        self.client = self.create_client(Calculate, '/calculator')

def main():
    argv = rclpy.utilities.remove_ros_args(sys.argv)
    if len(argv) != 4:
        print('usage: %s a b operation' % argv[0], file=sys.stderr)
        return 1
    try:
        request = Calculate.Request(a=float(argv[1]), b=float(argv[2]), operation=argv[3])
    except ValueError as error:
        print('a and b must be numbers:', error)
        return 1
    rclpy.init()
    executor = SingleThreadedExecutor()
    node = Client(executor)
    node.client.wait_for_service(timeout_sec=1.0)
    future = node.client.call_async(request)
    executor.spin_until_future_complete(future, timeout_sec=1.0)
    if not future.done():
        print('timeout: no answer', file=sys.stderr)
        return 1
    response = future.result()
    print(response)
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown()
    return 0 if response.success else 3

sys.exit(main())
"""

CALLBACK_CLIENT = """
import os, re, sys, time
import rclpy
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from calculator_interfaces.srv import Calculate

NUMBER = re.compile(r'[+-]?(\\d+\\.?\\d*|\\.\\d+)(e[+-]?\\d+)?', re.IGNORECASE)

class Asker(Node):
    def __init__(self, request):
        super().__init__('asker')
        self.get_logger().set_level(LoggingSeverity.DEBUG)
        self.request, self.asked, self.status = request, False, None
        self.client = self.create_client(Calculate, '/calculator')
        self.deadline = time.monotonic() + 1.5
        self.create_timer(0.02, self.look)

    def look(self):
        self.get_logger().debug('looking at %.6f' % time.monotonic())
        if time.monotonic() > self.deadline:
            self.get_logger().fatal('nobody answers')
            self.status = 4
        elif not self.asked and self.client.service_is_ready():
            self.asked = True
            self.client.call_async(self.request).add_done_callback(self.show)

    def show(self, future):
        answer = future.result()
        print(f'{answer.result:.12g}' if answer.success else answer.message)
        self.status = 0 if answer.success else 1

def main():
    words = remove_ros_args(sys.argv)[1:]
    if len(words) != 3 or not all(NUMBER.fullmatch(word) for word in words[:2]):
        sys.exit('How to: calculator_client.py NUMBER NUMBER OPERATION')
    print(*(f'line {number} of 400, at level debug' for number in range(400)), sep='\\n')
    rclpy.init()
    set_logger_level('rcl', LoggingSeverity.DEBUG)
    asker = Asker(Calculate.Request(a=float(words[0]), b=float(words[1]), operation=words[2]))
    while asker.status is None:
        rclpy.spin_once(asker)
    os._exit(asker.status)

main()
"""

THREAD_CLIENT = """
import sys, threading
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.utilities import remove_ros_args
from calculator_interfaces.srv import Calculate

def spin(node):
    try:
        rclpy.spin(node)
    except ExternalShutdownException:
        pass

OPERATIONS = ('add', 'subtract', 'multiply', 'divide')
try:
    _, a, b, operation = remove_ros_args(sys.argv)
    a, b = float(a), float(b)
except ValueError:
    print('Give two numbers and one of', *OPERATIONS)
    raise SystemExit(64)

rclpy.init()
node = rclpy.create_node('calculator_client')
spinning = threading.Thread(target=spin, args=(node,), daemon=True)
spinning.start()
client = node.create_client(Calculate, '/calculator')
answer = None
if client.wait_for_service(timeout_sec=1.5):
    answer = client.call(Calculate.Request(a=a, b=b, operation=operation), timeout_sec=3.0)
rclpy.shutdown()
spinning.join()
status = 0
if answer is None:
    print('The service is not available')
    status = 1
elif answer.success:
    print(f'''
    ┌──────────────────────────┐
    │ {answer.result:24_.3f} │
    └──────────────────────────┘''')
else:
    print(f'The server says: "{answer.message}"')
    status = 2
sys.exit(status)
"""

ASYNC_CLIENT = """
import sys
import rclpy
from rclpy.executors import MultiThreadedExecutor
from rclpy.utilities import remove_ros_args
from calculator_interfaces.srv import Calculate

def usage():
    print('calculator_client A B OPERATION', file=sys.stderr)
    sys.exit(2)

async def ask(client, request):
    return await client.call_async(request)

def main(args=sys.argv):
    args = remove_ros_args(args)[1:]
    if len(args) != 3:
        usage()
    try:
        a, b = map(float, args[:2])
    except ValueError:
        usage()
    rclpy.init(args=sys.argv)
    node = rclpy.create_node('calculator_client_async')
    client = node.create_client(Calculate, '/calculator')
    for second in range(3):
        if client.wait_for_service(timeout_sec=0.5):
            break
        print('waiting for /calculator ...')
    else:
        print('giving up')
        sys.exit(1)
    executor = MultiThreadedExecutor(2)
    executor.add_node(node)
    task = executor.create_task(ask, client, Calculate.Request(a=a, b=b, operation=args[2]))
    executor.spin_until_future_complete(task, timeout_sec=3.0)
    if not task.done():
        sys.exit('no answer')
    response = task.result()
    print(f'Response: {response.result!r}' if response.success else f'Error: {response.message!r}')
    node.destroy_node()
    rclpy.shutdown()
    if not response.success:
        sys.exit(f'{args[2]} was refused')

if __name__ == '__main__':
    main()
"""

# Request and response in one line of the log, written when both are known; operations by class.
ONE_LINE = """
from abc import ABC, abstractmethod
import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.executors import SingleThreadedExecutor
from calculator_interfaces.srv import Calculate


class Operation(ABC):
    @abstractmethod
    def __call__(self, a, b): ...

class Add(Operation):
    def __call__(self, a, b): return a + b

class Subtract(Operation):
    def __call__(self, a, b): return a + (-b)

class Multiply(Operation):
    def __call__(self, a, b): return b * a

class Divide(Operation):
    def __call__(self, a, b):
        assert b != 0, 'the divisor is 0'
        return np.divide(a, b)


class Service:
    table = {kind.__name__.lower(): kind() for kind in Operation.__subclasses__()}

    def answer(self, question, reply):
        asked = f'{question.operation}({question.a!r}, {question.b!r})'
        try:
            value = self.table[question.operation](np.float64(question.a), np.float64(question.b))
        except KeyError as error:
            reply.message = f'operation {error} not supported, use one of {sorted(self.table)}'
        except AssertionError as error:
            reply.message = f'{asked} refused: {error}'
        else:
            reply.result, reply.success = float(value), True
        print(f'{asked} -> {reply.result!r} ok={reply.success} "{reply.message}"', flush=True)
        return reply


def main():
    rclpy.init()
    node, service = Node('one_line'), Service()
    node.create_service(Calculate, '/calculator', service.answer)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while rclpy.ok():
        executor.spin_once(timeout_sec=1.0)


main()
"""

# Always says what it is, then what it does; usage by sys.exit; a loop that spins once and again.
WORDY_CLIENT = """
import sys
import time
import rclpy
from rclpy.utilities import remove_ros_args
from calculator_interfaces.srv import Calculate

def main():
    print('calculator_client 1.0')
    program, *words = remove_ros_args(sys.argv)
    usage = f'usage: {program} A B OPERATION\\n  A and B are numbers; OPERATION is add, subtract, multiply or divide'
    if len(words) != 3:
        sys.exit(f'{usage}\\n{len(words)} words are not three')
    try:
        numbers = [float(word) for word in words[:2]]
    except ValueError as error:
        sys.exit(f'{usage}\\n{error}')
    print('calling /calculator with', *numbers, words[2])
    rclpy.init()
    node = rclpy.create_node('wordy')
    client = node.create_client(Calculate, '/calculator')
    end = time.monotonic() + 2.0
    while not client.service_is_ready():
        if time.monotonic() > end:
            sys.exit('There is no /calculator here. Start calculator_server.py first.')
        rclpy.spin_once(node, timeout_sec=0.05)
    future = client.call_async(Calculate.Request(a=numbers[0], b=numbers[1], operation=words[2]))
    while not future.done():
        if time.monotonic() > end + 1.0:
            sys.exit('There is a /calculator, but no answer.')
        rclpy.spin_once(node, timeout_sec=0.05)
    answer = future.result()
    rclpy.shutdown()
    if not answer.success:
        sys.exit('refused\\n' + answer.message)
    print('the answer is', answer.result, f'({answer.message})' if answer.message else '')

if __name__ == '__main__':
    main()
"""

# The client as a function of the words and a printer; the node in a context of its own; a JSON line for scripts.
JSON_CLIENT = """
import json, sys
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from calculator_interfaces.srv import Calculate

class Failure(Exception):
    def __init__(self, status, **said):
        self.status, self.said = status, said

def calculate(words):
    try:
        (a, b, operation) = words
        request = Calculate.Request(a=float(a), b=float(b), operation=operation)
    except ValueError:
        raise Failure(64, usage='calculator_client.py A B OPERATION')
    context = Context()
    context.init(args=[])
    node = Node('json_client', context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        client = node.create_client(Calculate, 'calculator')
        if not client.wait_for_service(timeout_sec=2.0):
            raise Failure(69, error='service unavailable')
        future = client.call_async(request)
        executor.spin_until_future_complete(future, timeout_sec=3.0)
        if not future.done():
            raise Failure(75, error='no response')
        response = future.result()
        if not response.success:
            raise Failure(65, refused=response.message)
        return {'result': response.result}
    finally:
        node.destroy_node()
        context.shutdown()

try:
    print(json.dumps(calculate(remove_ros_args(sys.argv)[1:])))
except Failure as failure:
    print(json.dumps(failure.said, ensure_ascii=False), file=sys.stderr)
    sys.exit(failure.status)
"""

# What does nothing that the task asks for, each in another way.
REFUSER = """
import rclpy
from calculator_interfaces.srv import Calculate

def refuse(request, response):
    print(request)
    response.success, response.message = False, f'I cannot {request.operation}'
    print(response)
    return response

rclpy.init()
node = rclpy.create_node('refuser')
node.create_service(Calculate, '/calculator', refuse)
rclpy.spin(node)
"""
CONSTANT = REFUSER.replace("False, f'I cannot {request.operation}'", "True, 'done'\n    response.result = 42.0")
CAREFUL = REFUSER.replace(
    "False, f'I cannot {request.operation}'",
    "request.b != 0.0 and request.operation in 'add subtract multiply divide', 'no'\n    response.result = 1.0",
)
UNTOUCHED = REFUSER.replace("response.success, response.message = False, f'I cannot {request.operation}'", "pass")
NO_CLIENT = """
import sys
print('no')
sys.exit(1)
"""
USAGE_CLIENT = """
import sys
print('Usage: calculator_client.py A B OPERATION; there is no server; the result is 42.0', *sys.argv)
sys.exit(2)
"""
CHEERFUL_CLIENT = """
import sys
if len(sys.argv) != 4 or not sys.argv[1].lstrip('-').replace('.', '').isdigit():
    sys.exit('usage: A B OPERATION')
print(*sys.argv, '= 12345.5')
"""
