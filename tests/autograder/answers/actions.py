"""Answers to the exercise on actions."""

from . import changed, solution

SERVER, CLIENT = "fibonacci_server.py", "fibonacci_client.py"
# With a client that gives up sooner, so that the tests take less time.
REFERENCE = changed(solution("actions"), CLIENT, ("timeout_sec=5.0", "timeout_sec=1.5"))


def server(*pairs: tuple[str, str]) -> dict[str, bytes]:
    """The reference with a changed server."""
    return changed(REFERENCE, SERVER, *pairs)


def client(*pairs: tuple[str, str]) -> dict[str, bytes]:
    """The reference with a changed client."""
    return changed(REFERENCE, CLIENT, *pairs)


# One thread: the callback awaits a timer's future, and everything else goes on meanwhile.
AWAITING = """
import rclpy
from course_interfaces.action import Fibonacci
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.task import Future

rclpy.init()
node = rclpy.create_node('fib')
group = ReentrantCallbackGroup()
period = node.declare_parameter('step_period', 1.0).value

def check(goal):
    return GoalResponse.ACCEPT if goal.order in range(47) else GoalResponse.REJECT

async def sleep():
    future = Future()
    timer = node.create_timer(period, lambda: future.set_result(None), callback_group=group)
    await future
    node.destroy_timer(timer)

async def execute(handle):
    numbers, feedback = [0], Fibonacci.Feedback()
    a, b = 0, 1
    for _ in range(handle.request.order):
        numbers.append(b)
        a, b = b, a + b
        feedback.partial_sequence = numbers
        handle.publish_feedback(feedback)
        print('so far', numbers)
        await sleep()
        if handle.is_cancel_requested:
            handle.canceled()
            break
    else:
        handle.succeed()
    return Fibonacci.Result(sequence=numbers)

server = ActionServer(node, Fibonacci, 'fibonacci', execute, goal_callback=check, callback_group=group,
                      cancel_callback=lambda goal: CancelResponse.ACCEPT)
rclpy.spin(node)
"""

# A thread of its own for each goal, an own context, a late start, and more logs than anybody reads.
THREADS = """
import threading, time
import numpy as np
import rclpy
from course_interfaces.action import Fibonacci
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.context import Context
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node

class Fib(Node):
    def __init__(self, context):
        super().__init__('fib', context=context, namespace='lab')
        self.declare_parameters('', [('step_period', 1.0), ('name', 'x')])
        self.server = ActionServer(self, Fibonacci, '/fibonacci', self.execute, goal_callback=self.on_goal,
                                   cancel_callback=self.on_cancel)
        self.create_timer(0.05, lambda: self.get_logger().info('tick ' * 50))

    def on_goal(self, goal):
        if goal.order < 0 or goal.order > 46:
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def on_cancel(self, handle):
        return CancelResponse.ACCEPT

    async def execute(self, handle):
        done = rclpy.task.Future(executor=self.executor)
        threading.Thread(target=self.work, args=(handle, done), daemon=True).start()
        return await done

    def work(self, handle, done):
        order, period = handle.request.order, self.get_parameter('step_period').value
        values = np.zeros(order + 1, dtype=np.int32)
        for n in range(order + 1):
            values[n] = n if n < 2 else values[n - 1] + values[n - 2]
            handle.publish_feedback(Fibonacci.Feedback(partial_sequence=values[:n + 1].tolist()))
            end = time.time() + (period if n < order else 0)
            while time.time() < end and not handle.is_cancel_requested:
                time.sleep(0.005)
            if handle.is_cancel_requested:
                handle.canceled()
                break
        else:
            handle.succeed()
        done.set_result(Fibonacci.Result(sequence=values[:n + 1].tolist()))

def main(args=None):
    time.sleep(3)
    context = Context()
    rclpy.init(args=args, context=context)
    executor = MultiThreadedExecutor(num_threads=2, context=context)
    executor.add_node(Fib(context))
    executor.spin()

if __name__ == '__main__':
    main()
"""

# The chapter's client with its callbacks, that ends when the last of them is called.
CALLBACKS = """
import sys
import rclpy
from course_interfaces.action import Fibonacci
from rclpy.action import ActionClient
from rclpy.node import Node

class FibonacciActionClient(Node):
    def __init__(self, order, limit):
        super().__init__('fibonacci_action_client')
        self.order, self.limit, self.count, self.goal_handle = order, limit, 0, None
        self.status = 1
        self._action_client = ActionClient(self, Fibonacci, 'fibonacci')

    def send_goal(self):
        self.get_logger().info('Waiting for action server...')
        for attempt in range(3):
            if self._action_client.wait_for_server(timeout_sec=0.5):
                break
        else:
            self.get_logger().error('there is none')
            raise SystemExit(3)
        self._action_client.send_goal_async(
            Fibonacci.Goal(order=self.order), feedback_callback=self.on_feedback).add_done_callback(self.on_response)

    def on_response(self, future):
        self.goal_handle = future.result()
        if not self.goal_handle.accepted:
            self.get_logger().warning('Goal was rejected :(')
            raise SystemExit(4)
        self.get_logger().info('Goal accepted')
        self.goal_handle.get_result_async().add_done_callback(self.on_result)
        self.check()

    def on_feedback(self, message):
        self.get_logger().info(f'Received feedback: {message.feedback.partial_sequence}')
        self.count += 1
        self.check()

    def check(self):
        if self.goal_handle is not None and self.limit is not None and self.count >= self.limit:
            self.limit = None
            self.get_logger().info('cancelling')
            self.goal_handle.cancel_goal_async()

    def on_result(self, future):
        status = future.result().status
        words = {4: 'Goal succeeded', 5: 'Goal canceled', 6: 'Goal aborted'}
        self.get_logger().info(f'Result: {future.result().result.sequence}, {words[status]}')
        raise SystemExit(0 if status == 4 else status)

def main():
    arguments = sys.argv[1:]
    try:
        limit = None
        if '--cancel-after' in arguments:
            at = arguments.index('--cancel-after')
            limit = int(arguments[at + 1])
            del arguments[at:at + 2]
        order, = map(int, arguments)
    except (ValueError, IndexError) as error:
        print('fibonacci_client.py ORDER [--cancel-after N]:', error, file=sys.stderr)
        sys.exit(64)
    rclpy.init()
    node = FibonacciActionClient(order, limit)
    node.send_goal()
    rclpy.spin(node)

main()
"""

# typer's way of a command line, and a thread that spins.
BACKGROUND = """
import threading
import typer
import rclpy
from action_msgs.msg import GoalStatus
from course_interfaces.action import Fibonacci
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor

def main(order: int, cancel_after: int = 0):
    rclpy.init()
    node = rclpy.create_node('client')
    client = ActionClient(node, Fibonacci, '/fibonacci')
    if not client.wait_for_server(2.0):
        print('No server.')
        raise typer.Exit(1)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spinner = threading.Thread(target=executor.spin)
    spinner.start()

    def stop():
        executor.shutdown()
        spinner.join()
        rclpy.try_shutdown()

    heard = threading.Semaphore(0)

    def on_feedback(message):
        print('...', *message.feedback.partial_sequence, flush=True)
        heard.release()

    def wait(future):
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        done.wait()
        return future.result()

    handle = wait(client.send_goal_async(Fibonacci.Goal(order=order), on_feedback))
    if not handle.accepted:
        print('rejected')
        stop()
        raise typer.Exit(1)
    result = handle.get_result_async()
    if cancel_after:
        for _ in range(cancel_after):
            heard.acquire(timeout=20)
        wait(handle.cancel_goal_async())
    end = wait(result)
    print('=', *end.result.sequence)
    print({GoalStatus.STATUS_SUCCEEDED: 'SUCCEEDED', GoalStatus.STATUS_CANCELED: 'CANCELED'}.get(end.status, 'ABORTED'))
    stop()
    if end.status != GoalStatus.STATUS_SUCCEEDED:
        raise typer.Exit(1)

typer.run(main)
"""

SLEEP = "            time.sleep(period)\n"
PUBLISH = "            goal_handle.publish_feedback(Fibonacci.Feedback(partial_sequence=sequence))\n"
CANCEL = """            if goal_handle.is_cancel_requested:
                goal_handle.canceled()
                self.get_logger().info(f'Canceled: {sequence}')
                return Fibonacci.Result(sequence=sequence)
"""
EXECUTOR = """    # Each goal that runs has a thread; one more must be free to take in a cancel.
    executor = MultiThreadedExecutor(num_threads=8)
    executor.add_node(node)
    try:
        executor.spin()
"""
PERIOD = "        period = self.get_parameter('step_period').value\n"

OFTEN = """            for _ in range(10):
                if not goal_handle.is_cancel_requested:
                    time.sleep(period / 10)
"""

RIGHT = {
    "reference": REFERENCE,
    "one thread that awaits; the chapter's client": {SERVER: AWAITING.encode(), CLIENT: CALLBACKS.encode()},
    "a thread for each goal, own context, slow start; a client with a thread": {
        SERVER: THREADS.encode(),
        CLIENT: BACKGROUND.encode(),
    },
    "sleeps after the report, as the chapter does": server((SLEEP, ""), (PUBLISH, PUBLISH + SLEEP)),
    "reports what is there before the first step": server(("        while len", PUBLISH[4:] + "        while len")),
    "reports before the first step, sleeps after each": server(
        (SLEEP, ""), (PUBLISH, PUBLISH + SLEEP), ("        while len", PUBLISH[4:] + "        while len")
    ),
    "as many threads as processors, period read at each step": server(
        ("num_threads=8", ""), (PERIOD, ""), ("sleep(period)", "sleep(self.get_parameter('step_period').value)")
    ),
    "looks for a cancel ten times a step": server((SLEEP, OFTEN)),
    "spun by rclpy.spin, logs each step, short of threads": server(
        (EXECUTOR, "    try:\n        rclpy.spin(node, executor=MultiThreadedExecutor(num_threads=3))\n"),
        (PUBLISH, PUBLISH + "            self.get_logger().warning(f'step {sequence}' * 100)\n"),
    ),
}

SERVER_TESTS = {
    "sequence",
    "feedback",
    "smallest_orders",
    "largest_order",
    "rejects_negative",
    "rejects_too_large",
    "cancel",
    "cancelled_result",
    "two_goals",
    "step_period",
}
MET = {"client_shows_feedback", "client_shows_result", "client_rejected", "client_aborted", "client_cancels"}
CHECK = "if 0 <= goal.order <= LAST:"
STEP = "            sequence.append(sequence[-1] + sequence[-2])\n"
LOCK = ("        self.server = ", "        self.lock = __import__('threading').Lock()\n        self.server = ")
FAILS = "return 0 if outcome == 'SUCCEEDED' else 1"
PARSED = """    parser = argparse.ArgumentParser()
    parser.add_argument('order', type=int)
    parser.add_argument('--cancel-after', type=int, metavar='N')
    options = parser.parse_args(remove_ros_args(args)[1:])
"""

UNCHECKED = """    options = argparse.Namespace(
        order=int(sys.argv[1]), cancel_after=int(sys.argv[3]) if '--cancel-after' in sys.argv else None)
"""


def begun(line: str) -> tuple[str, str]:
    """A line before a goal is worked on."""
    return "        order = goal", f"        {line}\n        order = goal"


def done(line: str) -> tuple[str, str]:
    """A line when a goal is done."""
    return "        goal_handle.succeed()", f"        {line}\n        goal_handle.succeed()"


# What is wrong, and the tests that it loses (without "test_").
WRONG = {
    "one element short": (
        server(("while len(sequence) <= order", "while len(sequence) < order")),
        {"sequence", "feedback", "largest_order", "two_goals"},
    ),
    "begins with 1, 1": (
        server(("sequence = [0, 1]", "sequence = [1, 1]")),
        {"sequence", "feedback", "smallest_orders", "largest_order", "cancelled_result", "two_goals"},
    ),
    "always begins with 0, 1": (server(("[0, 1][:order + 1]", "[0, 1]")), {"smallest_orders"}),
    "no feedback": (server((PUBLISH, "")), {"feedback"}),
    "feedback at the end alone": (
        server((PUBLISH, ""), ("        goal_handle.succeed()", PUBLISH[4:] + "        goal_handle.succeed()")),
        {"feedback"},
    ),
    "feedback has the newest element": (
        server(("partial_sequence=sequence", "partial_sequence=sequence[-1:]")),
        {"feedback"},
    ),
    "feedback before the step": (server((STEP + PUBLISH, PUBLISH + STEP)), {"feedback"}),
    "feedback every second step": (
        server((PUBLISH, "            if len(sequence) % 2:\n    " + PUBLISH)),
        {"feedback"},
    ),
    "does not say that it succeeded": (server(("        goal_handle.succeed()\n", "")), {"sequence"}),
    "rejects nothing": (server((CHECK, "if True:")), {"rejects_negative", "rejects_too_large"}),
    "accepts 47": (server(("LAST = 46", "LAST = 47")), {"rejects_too_large"}),
    "rejects 46": (server(("LAST = 46", "LAST = 45")), {"largest_order"}),
    "rejects 0": (server((CHECK, "if 0 < goal.order <= LAST:")), {"smallest_orders"}),
    "aborts instead of rejecting": (
        server(
            (CHECK, "if True:"),
            (
                PERIOD,
                "        if not 0 <= order <= LAST:\n            goal_handle.abort()\n"
                "            return Fibonacci.Result()\n" + PERIOD,
            ),
        ),
        {"rejects_negative", "rejects_too_large"},
    ),
    "no cancel callback": (server((", cancel_callback=self.allow_cancel", "")), {"cancel", "cancelled_result"}),
    "one thread": (
        server((EXECUTOR, "    try:\n        rclpy.spin(node)\n")),
        {"cancel", "cancelled_result", "two_goals"},
    ),
    "never looks for a cancel": (server((CANCEL, "")), {"cancel", "cancelled_result"}),
    "cancelled goal has an empty result": (
        server(
            ("                return Fibonacci.Result(sequence=sequence)", "                return Fibonacci.Result()")
        ),
        {"cancelled_result"},
    ),
    "cancelled goal is aborted": (server(("                goal_handle.canceled()\n", "")), {"cancel"}),
    "cancelled goal succeeds": (server(("goal_handle.canceled()", "goal_handle.succeed()")), {"cancel"}),
    "looks for a cancel every fourth step": (
        server(("if goal_handle.is_cancel_requested", "if len(sequence) % 4 == 3 and goal_handle.is_cancel_requested")),
        {"cancel"},
    ),
    "one goal at a time": (server(LOCK, begun("self.lock.acquire()"), done("self.lock.release()")), {"two_goals"}),
    "rejects while it is busy": (
        server(
            (CHECK, "if 0 <= goal.order <= LAST and not getattr(self, 'busy', False):"),
            begun("self.busy = True"),
            done("self.busy = False"),
        ),
        {"two_goals"},
    ),
    "one order for all goals": (
        server(("        order = goal", "        order = self.order = goal"), ("<= order:", "<= self.order:")),
        {"two_goals"},
    ),
    "step period is fixed": (server(("sleep(period)", "sleep(1.0)")), {"step_period"}),
    "step period in milliseconds": (server(("sleep(period)", "sleep(period / 1000)")), {"step_period"}),
    "another default": (server(("'step_period', 1.0", "'step_period', 0.1")), {"step_period"}),
    "another name": (server(("'/fibonacci'", "'/fib'")), SERVER_TESTS),
    "the released type": (
        server(("course_interfaces.action", "example_interfaces.action"), ("partial_sequence=", "sequence=")),
        SERVER_TESTS,
    ),
    "client sends 10": (client(("Goal(order=order)", "Goal(order=10)")), {"client_shows_feedback"}),
    "client shows no feedback": (
        client(("        print('Feedback:', list(message.feedback.partial_sequence))\n", "")),
        {"client_shows_feedback"},
    ),
    "client shows the newest element": (
        client(("list(message.feedback.partial_sequence)", "message.feedback.partial_sequence[-1]")),
        {"client_shows_feedback"},
    ),
    "client shows no result": (
        client(("        print('Result:', list(end.result.sequence))\n", "")),
        {"client_shows_result", "client_cancels"},
    ),
    "client shows no outcome": (
        client(("    print('Outcome:', outcome)\n", "")),
        MET - {"client_shows_feedback"} | {"client_without_server"},
    ),
    "client always exits with 0": (
        client((FAILS, "return 0")),
        {"client_rejected", "client_aborted", "client_cancels", "client_without_server"},
    ),
    "client never exits with 0": (client((FAILS, "return 1")), {"client_shows_result"}),
    "client takes every end for a success": (
        client(("OUTCOMES.get(end.status, 'UNKNOWN')", "'SUCCEEDED'")),
        {"client_aborted", "client_cancels"},
    ),
    "client does not look whether it is accepted": (
        client(("        if not self.goal_handle.accepted:\n            return 'REJECTED'\n", "")),
        {"client_rejected"},
    ),
    "client cancels one too late": (
        client(("self.heard >= self.cancel_after", "self.heard > self.cancel_after")),
        {"client_cancels"},
    ),
    "client cancels one too early": (
        client(("self.heard >= self.cancel_after", "self.heard >= self.cancel_after - 1")),
        {"client_cancels"},
    ),
    "client never cancels": (client(("            self.goal_handle.cancel_goal_async()\n", "")), {"client_cancels"}),
    "client does not wait for the end of a cancelled goal": (
        client(
            (
                "            self.goal_handle.cancel_goal_async()\n",
                "            self.wait = self.goal_handle.cancel_goal_async()\n            sys.exit('CANCELED')\n",
            )
        ),
        {"client_cancels"},
    ),
    "client waits for a server for ever": (client(("timeout_sec=1.5", "timeout_sec=None")), {"client_without_server"}),
    "client has no usage": (client((PARSED, UNCHECKED)), {"client_arguments"}),
    "client takes any word for 10": (
        client(
            ("type=int)", "type=lambda word: int(word) if word.isdigit() else 10)"),
            ("('order', ", "('order', nargs='?', default=10, "),
        ),
        {"client_arguments"},
    ),
}

SILENT = {"another name", "the released type", "client waits for a server for ever"}
