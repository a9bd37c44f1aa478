"""Answers to the exercise on actions."""

from pathlib import Path

from . import changed, solution

SERVER, CLIENT = "lift_server.py", "lift_client.py"
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
from course_interfaces.action import Lift
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.task import Future
from std_srvs.srv import SetBool

rclpy.init()
node = rclpy.create_node('lift')
period = node.declare_parameter('step_period', 1.0).value
top = node.declare_parameter('top', 9).value
here, blocked, accepted, moving = 0, False, 0, None

def check(goal):
    good = len(goal.floors) > 0 and min(goal.floors) >= 0 and max(goal.floors) <= top
    return GoalResponse.ACCEPT if good else GoalResponse.REJECT

def block(request, response):
    global blocked
    blocked, response.success = request.data, True
    return response

async def step():
    future = Future()
    timer = node.create_timer(period, lambda: future.set_result(None))
    await future
    node.destroy_timer(timer)

async def execute(handle):
    global here, accepted, moving
    accepted += 1
    mine, before, moving = accepted, moving, Future()
    done = moving
    if before:
        await before
    result = Lift.Result()
    floors = handle.request.floors
    end = handle.succeed
    for number, floor in enumerate(floors):
        while here != floor:
            if handle.is_cancel_requested:
                end = handle.canceled
            elif blocked or mine != accepted:
                end = handle.abort
            else:
                await step()
                here += (floor > here) - (floor < here)
                handle.publish_feedback(Lift.Feedback(floor=here, stops_left=len(floors) - number - (here == floor)))
                continue
            break
        if here != floor:
            break
        result.stops.append(floor)
    end()
    result.floor = here
    done.set_result(None)
    return result

server = ActionServer(node, Lift, 'lift', execute, goal_callback=check,
                      cancel_callback=lambda goal: CancelResponse.ACCEPT)
service = node.create_service(SetBool, 'lift/block', block)
rclpy.spin(node)
"""

# The examples' way: whoever accepts a goal aborts the one before at once, and a thread of its own works on each goal.
THREADS = """
import threading, time
import rclpy
from course_interfaces.action import Lift
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.context import Context
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import SetBool

class Cabin(Node):
    def __init__(self, context):
        super().__init__('cabin', context=context, namespace='lab')
        self.declare_parameters('', [('step_period', 1.0), ('top', 9), ('name', 'x')])
        self.floor, self.free = 0, True
        self.handle_now, self.ending, self.moving = None, threading.RLock(), threading.Lock()
        self.server = ActionServer(self, Lift, '/lift', self.execute, goal_callback=self.on_goal,
                                   cancel_callback=self.on_cancel, handle_accepted_callback=self.on_accepted)
        self.create_service(SetBool, '/lift/block', self.on_block)
        self.create_timer(0.05, lambda: self.get_logger().info('tick ' * 50))

    def on_block(self, request, response):
        self.free = not request.data
        response.success, response.message = True, 'ok'
        return response

    def on_goal(self, goal):
        floors = list(goal.floors)
        if not floors or min(floors) < 0 or max(floors) > self.get_parameter('top').value:
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def on_cancel(self, handle):
        return CancelResponse.ACCEPT

    def on_accepted(self, handle):
        with self.ending:
            if self.handle_now is not None and self.handle_now.is_active:
                self.handle_now.abort()
            self.handle_now = handle
        handle.execute()

    async def execute(self, handle):
        done = rclpy.task.Future(executor=self.executor)
        threading.Thread(target=self.work, args=(handle, done), daemon=True).start()
        return await done

    def end(self, handle, how):
        with self.ending:
            if handle.is_active:
                how()

    def work(self, handle, done):
        stops, period = [], self.get_parameter('step_period').value
        with self.moving:
            floors = list(handle.request.floors)
            while floors and handle.is_active:
                if floors[0] == self.floor:
                    stops.append(floors.pop(0))
                    continue
                stop = time.time() + period
                while time.time() < stop and handle.is_active and not handle.is_cancel_requested and self.free:
                    time.sleep(0.005)
                if handle.is_cancel_requested:
                    self.end(handle, handle.canceled)
                    break
                if not self.free:
                    self.end(handle, handle.abort)
                    break
                if not handle.is_active:
                    break
                self.floor += 1 if floors[0] > self.floor else -1
                left = len(floors) - 1 if floors[0] == self.floor else len(floors)
                handle.publish_feedback(Lift.Feedback(floor=self.floor, stops_left=left))
            if not floors:
                self.end(handle, handle.succeed)
            done.set_result(Lift.Result(stops=stops, floor=self.floor))

def main(args=None):
    time.sleep(3)
    context = Context()
    rclpy.init(args=args, context=context)
    executor = MultiThreadedExecutor(num_threads=2, context=context)
    executor.add_node(Cabin(context))
    executor.spin()

if __name__ == '__main__':
    main()
"""

# One thread owns the cabin for ever, and takes the newest goal whenever there is one.
WORKER = """
import threading
import rclpy
from action_msgs.msg import GoalStatus
from course_interfaces.action import Lift
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import SetBool

class LiftServer(Node):
    def __init__(self):
        super().__init__('lift_server')
        self.top = self.declare_parameter('top', 9)
        self.step_period = self.declare_parameter('step_period', 1.0)
        self.news = threading.Condition()
        self.waiting, self.results, self.blocked, self.floor = [], {}, False, 0
        group = ReentrantCallbackGroup()
        self.server = ActionServer(self, Lift, 'lift', self.execute, callback_group=group,
                                   goal_callback=self.goal_callback, handle_accepted_callback=self.accepted_callback,
                                   cancel_callback=lambda goal_handle: CancelResponse.ACCEPT)
        self.create_service(SetBool, 'lift/block', self.block, callback_group=group)
        threading.Thread(target=self.work, daemon=True).start()

    def goal_callback(self, goal):
        for floor in goal.floors:
            if floor not in range(self.top.value + 1):
                return GoalResponse.REJECT
        return GoalResponse.ACCEPT if len(goal.floors) else GoalResponse.REJECT

    def accepted_callback(self, goal_handle):
        with self.news:
            self.waiting.append(goal_handle)
            self.news.notify_all()

    def block(self, request, response):
        with self.news:
            self.blocked = request.data
            self.news.notify_all()
        response.success = True
        return response

    def execute(self, goal_handle):
        state, result = self.results.pop(bytes(goal_handle.goal_id.uuid))
        getattr(goal_handle, state)()
        return result

    def finish(self, goal_handle, state, stops):
        self.results[bytes(goal_handle.goal_id.uuid)] = state, Lift.Result(stops=stops, floor=self.floor)
        goal_handle.execute()

    def work(self):
        while True:
            with self.news:
                self.news.wait_for(lambda: self.waiting)
                goal_handle = self.waiting.pop(0)
            self.finish(goal_handle, *self.ride(goal_handle))

    def ride(self, goal_handle):
        stops = []
        while True:
            left = goal_handle.request.floors[len(stops):]
            if not left:
                return 'succeed', stops
            if left[0] == self.floor:
                stops.append(left[0])
                continue
            if goal_handle.is_cancel_requested:
                return 'canceled', stops
            with self.news:
                if self.news.wait_for(lambda: self.waiting or self.blocked, self.step_period.value):
                    return 'abort', stops
            self.floor += 1 if left[0] > self.floor else -1
            goal_handle.publish_feedback(Lift.Feedback(
                floor=self.floor, stops_left=len(left) - (left[0] == self.floor)))

rclpy.init()
rclpy.spin(LiftServer(), MultiThreadedExecutor(4))
"""

# The chapter's client with its callbacks, that ends when the last of them is called.
CALLBACKS = """
import sys
import rclpy
from course_interfaces.action import Lift
from rclpy.action import ActionClient
from rclpy.node import Node

class LiftActionClient(Node):
    def __init__(self, floors, limit):
        super().__init__('lift_action_client')
        self.floors, self.limit, self.count, self.goal_handle = floors, limit, 0, None
        self.status = 1
        self._action_client = ActionClient(self, Lift, 'lift')

    def send_goal(self):
        self.get_logger().info('Waiting for action server...')
        for attempt in range(3):
            if self._action_client.wait_for_server(timeout_sec=0.5):
                break
        else:
            self.get_logger().error('there is none')
            raise SystemExit(3)
        self._action_client.send_goal_async(
            Lift.Goal(floors=self.floors), feedback_callback=self.on_feedback).add_done_callback(self.on_response)

    def on_response(self, future):
        self.goal_handle = future.result()
        if not self.goal_handle.accepted:
            self.get_logger().warning('Goal was rejected :(')
            raise SystemExit(4)
        self.get_logger().info('Goal accepted')
        self.goal_handle.get_result_async().add_done_callback(self.on_result)
        self.check()

    def on_feedback(self, message):
        self.get_logger().info(f'Received feedback: {message.feedback}')
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
        self.get_logger().info(f'Result: {future.result().result}, {words[status]}')
        raise SystemExit(0 if status == 4 else status)

def main():
    arguments = sys.argv[1:]
    try:
        limit = None
        if '--cancel-after' in arguments:
            at = arguments.index('--cancel-after')
            limit = int(arguments[at + 1])
            del arguments[at:at + 2]
        first, *others = map(int, arguments)
    except (ValueError, IndexError) as error:
        print('lift_client.py FLOOR [FLOOR ...] [--cancel-after N]:', error, file=sys.stderr)
        sys.exit(64)
    rclpy.init()
    node = LiftActionClient([first, *others], limit)
    node.send_goal()
    rclpy.spin(node)

main()
"""

# typer's way of a command line, and a thread that spins.
BACKGROUND = """
import threading
from typing import List
import typer
import rclpy
from action_msgs.msg import GoalStatus
from course_interfaces.action import Lift
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor

def main(floors: List[int], cancel_after: int = 0):
    rclpy.init()
    node = rclpy.create_node('client')
    client = ActionClient(node, Lift, '/lift')
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
        print('...', message.feedback.floor, message.feedback.stops_left, flush=True)
        heard.release()

    def wait(future):
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        done.wait()
        return future.result()

    handle = wait(client.send_goal_async(Lift.Goal(floors=floors), on_feedback))
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
    print('=', *end.result.stops, '/', end.result.floor)
    print({GoalStatus.STATUS_SUCCEEDED: 'SUCCEEDED', GoalStatus.STATUS_CANCELED: 'CANCELED'}.get(end.status, 'ABORTED'))
    stop()
    if end.status != GoalStatus.STATUS_SUCCEEDED:
        raise typer.Exit(1)

typer.run(main)
"""

SLEEP = "            time.sleep(period)\n"
PUBLISH = """            goal_handle.publish_feedback(
                Lift.Feedback(floor=self.floor, stops_left=len(left)))
"""
CANCEL = """            if goal_handle.is_cancel_requested:
                goal_handle.canceled()
                break
"""
ABORT = """            if self.blocked or self.newest is not goal_handle:
                goal_handle.abort()
                break
"""
STEP = "            self.floor += 1 if left[0] > self.floor else -1\n            self.stop(stops, left)\n"
EXECUTOR = """    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(node)
    try:
        executor.spin()
"""
PERIOD = "        period = self.get_parameter('step_period').value\n"
RESULT = "return Lift.Result(stops=stops, floor=self.floor)"

OFTEN = """            for _ in range(10):
                if not goal_handle.is_cancel_requested:
                    time.sleep(period / 10)
"""
REENTRANT = (
    ("from rclpy.executors", "from rclpy.callback_groups import ReentrantCallbackGroup\nfrom rclpy.executors"),
    (
        "cancel_callback=self.allow_cancel",
        "cancel_callback=self.allow_cancel,\n            callback_group=ReentrantCallbackGroup()",
    ),
)
# rclpy's example of a server for a single goal: the goal that takes over aborts the one before.
EXAMPLE = (
    (
        "        self.newest = goal_handle\n",
        (
            "        with self.state:\n"
            "            if self.newest is not None and self.newest.is_active:\n"
            "                self.newest.abort()\n"
            "            self.newest = goal_handle\n"
        ),
    ),
    ("        self.cabin =", "        self.state = threading.Lock()\n        self.cabin ="),
    (
        ABORT,
        (
            "            if not goal_handle.is_active:\n                break\n"
            "            if self.blocked:\n                with self.state:\n"
            "                    if goal_handle.is_active:\n                        goal_handle.abort()\n"
            "                break\n"
        ),
    ),
    (
        "            goal_handle.succeed()",
        (
            "            with self.state:\n                if goal_handle.is_active:\n"
            "                    goal_handle.succeed()"
        ),
    ),
)

RIGHT = {
    "reference": REFERENCE,
    "one thread that awaits; the chapter's client": {SERVER: AWAITING.encode(), CLIENT: CALLBACKS.encode()},
    "a thread for each goal, aborted by who accepts, own context, slow start; a client with a thread": {
        SERVER: THREADS.encode(),
        CLIENT: BACKGROUND.encode(),
    },
    "one thread that owns the cabin": REFERENCE | {SERVER: WORKER.encode()},
    "a reentrant group": server(*REENTRANT),
    "as rclpy's example of a single goal": server(*EXAMPLE),
    "reports before the time of the step passes": server((SLEEP, ""), (PUBLISH, PUBLISH + SLEEP)),
    "as many threads as processors, period read at each step": server(
        ("num_threads=4", ""), (PERIOD, ""), ("sleep(period)", "sleep(self.get_parameter('step_period').value)")
    ),
    "looks for a cancel ten times a step": server((SLEEP, OFTEN)),
    "spun by rclpy.spin, logs each step, short of threads": server(
        (EXECUTOR, "    try:\n        rclpy.spin(node, executor=MultiThreadedExecutor(num_threads=3))\n"),
        (PUBLISH, PUBLISH + "            self.get_logger().warning(f'step {left}' * 100)\n"),
    ),
}

SERVER_TESTS = {
    "ride",
    "feedback",
    "keeps_its_place",
    "cancel",
    "cancelled_result",
    "rejects",
    "preempt",
    "rejected_goal_changes_nothing",
    "blocked",
    "aborted_result",
    "blocked_before",
    "step_period",
}
MET = {"client_shows_feedback", "client_shows_result", "client_rejected", "client_aborted", "client_cancels"}
CHECK = "if goal.floors and all(0 <= floor <= top for floor in goal.floors):"
FAILS = "return 0 if outcome == 'SUCCEEDED' else 1"
SHOWN = "        print(f'Result: stops {list(end.result.stops)}, now at {end.result.floor}')\n"
PARSED = """    parser = argparse.ArgumentParser()
    parser.add_argument('floors', type=int, nargs='+', metavar='FLOOR')
    parser.add_argument('--cancel-after', type=int, metavar='N')
    options = parser.parse_args(remove_ros_args(args)[1:])
"""

UNCHECKED = """    cancel = sys.argv.index('--cancel-after') if '--cancel-after' in sys.argv else len(sys.argv)
    options = argparse.Namespace(
        floors=[int(floor) for floor in sys.argv[1:cancel]], cancel_after=int((sys.argv + [0, 0])[cancel + 1]))
"""
# The chapter's server under another name.
CHAPTER = (Path(__file__).parents[3] / "course/nodes/fibonacci_action_server.py").read_bytes()
CHAPTERS_CLIENT = (Path(__file__).parents[3] / "course/nodes/fibonacci_action_client.py").read_bytes()

# What is wrong, and the tests that it loses (without "test_").
WRONG = {
    "the chapter's programs": ({SERVER: CHAPTER, CLIENT: CHAPTERS_CLIENT}, SERVER_TESTS | MET),
    "stops wherever it passes": (
        server(
            (
                "        while left and left[0] == self.floor:\n            stops.append(left.pop(0))",
                (
                    "        while self.floor in left:\n            left.remove(self.floor)\n"
                    "            stops.append(self.floor)"
                ),
            )
        ),
        {"ride", "feedback"},
    ),
    "result without the floor": (
        server((RESULT, "return Lift.Result(stops=stops)")),
        {"ride", "cancelled_result", "aborted_result"},
    ),
    "result says what was asked for": (
        server((RESULT, "return Lift.Result(stops=goal_handle.request.floors, floor=self.floor)")),
        {"cancelled_result", "aborted_result", "preempt"},
    ),
    "no feedback": (server((PUBLISH, "")), {"feedback"}),
    "feedback at stops alone": (
        server(
            (
                PUBLISH,
                "            if goal_handle.request.floors[len(stops) - 1] == self.floor:\n    "
                + PUBLISH.replace("\n   ", "\n       "),
            )
        ),
        {"feedback"},
    ),
    "feedback before the step": (
        server((STEP + PUBLISH, PUBLISH + STEP)),
        {"feedback", "cancelled_result", "aborted_result"},
    ),
    "stops_left counts the one just made": (
        server(("stops_left=len(left)", "stops_left=len(left) + (stops[-1:] == [self.floor])")),
        {"feedback"},
    ),
    "stops_left is never set": (server((", stops_left=len(left)", "")), {"feedback"}),
    "does not say that it succeeded": (
        server(("        else:\n            goal_handle.succeed()\n", "")),
        {"ride", "keeps_its_place", "preempt", "blocked_before"},
    ),
    "every goal starts at floor 0": (
        server((PERIOD, PERIOD + "        self.floor = 0\n")),
        {"keeps_its_place", "cancelled_result", "preempt"},
    ),
    "starts at floor 1": (server(("self.floor = 0", "self.floor = 1")), {"keeps_its_place"}),
    "a stop takes a step": (
        server(
            (
                "        self.stop(stops, left)\n        while left:",
                (
                    "        if left[0] == self.floor:\n            time.sleep(period)\n"
                    "            goal_handle.publish_feedback(Lift.Feedback(floor=self.floor, stops_left=len(left)))\n"
                    "        self.stop(stops, left)\n        while left:"
                ),
            )
        ),
        {"keeps_its_place", "cancelled_result"},
    ),
    "rejects nothing": (server((CHECK, "if True:")), {"rejects", "rejected_goal_changes_nothing"}),
    "accepts no floors": (server(("if goal.floors and all", "if all")), {"rejects"}),
    "accepts floors below 0": (server(("all(0 <= floor <= top", "all(floor <= top")), {"rejects"}),
    "accepts the floor above the top": (server(("<= floor <= top", "<= floor <= top + 1")), {"rejects"}),
    "rejects the top": (server(("<= floor <= top", "<= floor < top")), {"rejects"}),
    "looks at the first floor alone": (
        server(("for floor in goal.floors)", "for floor in goal.floors[:1])")),
        {"rejects"},
    ),
    "the top is fixed": (server(("top = self.get_parameter('top').value", "top = 9")), {"rejects"}),
    "another default of the top": (server(("'top', 9", "'top', 10")), {"rejects"}),
    "aborts instead of rejecting": (
        server(
            (CHECK, "if True:"),
            (
                PERIOD,
                "        top = self.get_parameter('top').value\n        floors = goal_handle.request.floors\n"
                "        if not floors or not all(0 <= floor <= top for floor in floors):\n"
                "            goal_handle.abort()\n            return Lift.Result(floor=self.floor)\n" + PERIOD,
            ),
        ),
        {"rejects", "rejected_goal_changes_nothing"},
    ),
    "no cancel callback": (server((", cancel_callback=self.allow_cancel", "")), {"cancel", "cancelled_result"}),
    "one thread": (
        server((EXECUTOR, "    try:\n        rclpy.spin(node)\n")),
        {"cancel", "cancelled_result", "preempt", "blocked", "aborted_result"},
    ),
    "never looks for a cancel": (server((CANCEL, "")), {"cancel", "cancelled_result"}),
    "cancelled goal has an empty result": (
        server((CANCEL, CANCEL.replace("break", "return Lift.Result()"))),
        {"cancelled_result"},
    ),
    "cancelled goal is aborted": (server((CANCEL, CANCEL.replace("canceled", "abort"))), {"cancel"}),
    "cancelled goal succeeds": (
        server((CANCEL, CANCEL.replace("canceled", "succeed"))),
        {"cancel", "cancelled_result"},
    ),
    "cancelled cabin goes back to floor 0": (
        server(
            (
                CANCEL,
                CANCEL.replace(
                    "break", "at, self.floor = self.floor, 0\n                return Lift.Result(stops=stops, floor=at)"
                ),
            )
        ),
        {"cancelled_result"},
    ),
    "ends a cancelled goal at its next stop": (
        server((CANCEL, CANCEL.replace("if goal_handle", "if stops[-1:] == [self.floor] and goal_handle"))),
        {"cancel"},
    ),
    "rejects while it is busy": (
        server((CHECK, "if self.cabin.locked():\n            return GoalResponse.REJECT\n        " + CHECK)),
        {"preempt"},
    ),
    "goals wait for the one that runs": (server((" or self.newest is not goal_handle", "")), {"preempt"}),
    "goals move the cabin side by side": (
        server((" or self.newest is not goal_handle", ""), ("        with self.cabin:\n", "        if True:\n")),
        {"preempt"},
    ),
    "notes the newest goal when it begins to move": (
        server(
            ("        self.newest = goal_handle\n", ""),
            ("        with self.cabin:\n", "        with self.cabin:\n            self.newest = goal_handle\n"),
        ),
        {"preempt"},
    ),
    "preempts and does not wait for the cabin": (
        server(("        with self.cabin:\n", "        if True:\n")),
        {"preempt"},
    ),
    "a preempted goal succeeds": (
        server(
            (ABORT, "            if self.newest is not goal_handle:\n                break\n" + ABORT),
            (
                "        else:\n            goal_handle.succeed()",
                (
                    "        else:\n            goal_handle.succeed()\n"
                    "        if goal_handle.is_active and goal_handle.is_cancel_requested is False:\n"
                    "            goal_handle.succeed()"
                ),
            ),
        ),
        {"preempt"},
    ),
    "a preempted goal has an empty result": (
        server(
            (
                ABORT,
                "            if self.newest is not goal_handle:\n                goal_handle.abort()\n"
                "                return Lift.Result(floor=self.floor)\n" + ABORT,
            )
        ),
        {"preempt"},
    ),
    "whatever is asked for preempts": (
        server(("        top = self.get", "        self.newest = goal\n        top = self.get")),
        {"rejected_goal_changes_nothing"},
    ),
    "no service to block the shaft": (
        server(("        self.service = self.create_service(SetBool, '/lift/block', self.block)\n", "")),
        {"blocked", "aborted_result", "blocked_before"},
    ),
    "never looks whether it is blocked": (
        server(("if self.blocked or", "if")),
        {"blocked", "aborted_result", "blocked_before"},
    ),
    "waits while it is blocked": (
        server(
            ("if self.blocked or", "if"),
            (
                SLEEP,
                SLEEP + "            while self.blocked and self.newest is goal_handle:\n"
                "                time.sleep(0.01)\n",
            ),
        ),
        {"blocked", "aborted_result", "blocked_before"},
    ),
    "rejects while it is blocked": (
        server((CHECK, "if self.blocked:\n            return GoalResponse.REJECT\n        " + CHECK)),
        {"blocked_before"},
    ),
    "looks for the block when a goal begins": (
        server(
            (
                "        while left:\n",
                (
                    "        if left and self.blocked:\n            goal_handle.abort()\n"
                    "            return Lift.Result(stops=stops, floor=self.floor)\n        while left:\n"
                ),
            ),
            ("if self.blocked or", "if"),
        ),
        {"blocked", "aborted_result"},
    ),
    "never free again": (server(("self.blocked = request.data", "self.blocked = True")), {"blocked_before"}),
    "block is answered with success false": (
        server(("response.success = True", "response.success = False")),
        {"blocked"},
    ),
    "aborted goal has an empty result": (
        server((ABORT, ABORT.replace("break", "return Lift.Result()"))),
        {"aborted_result", "preempt"},
    ),
    "a blocked goal succeeds": (
        server(
            (
                ABORT,
                "            if self.blocked:\n                goal_handle.succeed()\n                break\n" + ABORT,
            )
        ),
        {"blocked", "aborted_result", "blocked_before"},
    ),
    "step period is fixed": (server(("sleep(period)", "sleep(1.0)")), {"step_period"}),
    "a step takes less than half of its time": (server(("sleep(period)", "sleep(0.4 * period)")), {"step_period"}),
    "another default": (server(("'step_period', 1.0", "'step_period', 0.1")), {"step_period"}),
    "another name": (server(("'/lift'", "'/elevator'")), SERVER_TESTS),
    "client sends the floors sorted": (
        client(("Goal(floors=floors)", "Goal(floors=sorted(floors)[::-1] + [1])")),
        {"client_shows_feedback"},
    ),
    "client shows no feedback": (
        client(("        print(f'Feedback: floor {now.floor}, {now.stops_left} stops left')\n", "")),
        {"client_shows_feedback"},
    ),
    "client shows the floor alone": (client((", {now.stops_left} stops left", "")), {"client_shows_feedback"}),
    "client shows the feedback at the end": (
        client(
            ("print(f'Feedback: floor {now.floor}, {now.stops_left} stops left')", "self.story.append(now)"),
            ("        self.heard = 0\n", "        self.heard = 0\n        self.story = []\n"),
            ("        print(f'Result", "        print('Feedback:', self.story)\n        print(f'Result"),
        ),
        {"client_shows_feedback"},
    ),
    "client shows no result": (client((SHOWN, "")), {"client_shows_result", "client_aborted", "client_cancels"}),
    "client shows the result of a success alone": (
        client((SHOWN, "        if end.status == GoalStatus.STATUS_SUCCEEDED:\n    " + SHOWN)),
        {"client_aborted", "client_cancels"},
    ),
    "client shows no outcome": (
        client(("    print('Outcome:', outcome)\n", "")),
        MET - {"client_shows_feedback"} | {"client_without_server"},
    ),
    "client names every outcome": (
        client(
            (
                "    print('Outcome:', outcome)\n",
                "    print('Outcome:', outcome, 'of REJECTED, ABORTED, CANCELED, SUCCEEDED')\n",
            )
        ),
        {"client_rejected", "client_aborted", "client_cancels"},
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
        client(("type=int,", "type=lambda word: int(word) if word.isdigit() else 10,"), ("nargs='+'", "nargs='*'")),
        {"client_arguments"},
    ),
}

SILENT = {"another name", "client waits for a server for ever"}
