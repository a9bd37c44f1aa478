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
                ahead = list(floors[number:])
                while ahead[:1] == [here]:
                    ahead.pop(0)
                handle.publish_feedback(Lift.Feedback(floor=here, stops_left=len(ahead)))
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
                while floors and floors[0] == self.floor:
                    stops.append(floors.pop(0))
                handle.publish_feedback(Lift.Feedback(floor=self.floor, stops_left=len(floors)))
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
            while left and left[0] == self.floor:
                stops.append(left.pop(0))
            goal_handle.publish_feedback(Lift.Feedback(floor=self.floor, stops_left=len(left)))

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
from rclpy.utilities import remove_ros_args

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
    arguments = remove_ros_args(sys.argv)[1:]
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
import sys
import threading
from typing import List
import typer
import rclpy
from action_msgs.msg import GoalStatus
from course_interfaces.action import Lift
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.utilities import remove_ros_args

def main(floors: List[int], cancel_after: int = None):
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
    if cancel_after is not None:
        result.add_done_callback(lambda _: heard.release(cancel_after + 1))
        for _ in range(cancel_after):
            heard.acquire()
        if not result.done():
            wait(handle.cancel_goal_async())
    end = wait(result)
    print('=', *end.result.stops, '/', end.result.floor)
    print({GoalStatus.STATUS_SUCCEEDED: 'SUCCEEDED', GoalStatus.STATUS_CANCELED: 'CANCELED'}.get(end.status, 'ABORTED'))
    stop()
    if end.status != GoalStatus.STATUS_SUCCEEDED:
        raise typer.Exit(1)

sys.argv = remove_ros_args(sys.argv)
typer.run(main)
"""

# One thread: a timer is the motor, and each goal's callback awaits its own end.
TIMER = """
import rclpy
from course_interfaces.action import Lift
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import SetBool

class Motor(Node):
    def __init__(self):
        super().__init__('motor')
        self.period = self.declare_parameter('step_period', 1.0).value
        self.top = self.declare_parameter('top', 9).value
        self.blocked = False
        self.floor = 0
        self.goals = []  # the one that moves comes first
        self.timer = self.create_timer(self.period, self.tick, autostart=False)
        ActionServer(self, Lift, 'lift', self.execute,
                     goal_callback=lambda goal: GoalResponse.ACCEPT if self.possible(goal) else GoalResponse.REJECT,
                     cancel_callback=lambda goal: CancelResponse.ACCEPT)
        self.create_service(SetBool, 'lift/block', self.block)

    def possible(self, goal):
        return bool(goal.floors) and set(goal.floors) <= set(range(self.top + 1))

    def block(self, request, response):
        self.blocked = request.data
        response.success, response.message = True, str(self.floor)
        return response

    async def execute(self, goal):
        goal.left, goal.stops, goal.done = list(goal.request.floors), [], Future()
        self.goals.append(goal)
        if len(self.goals) == 1:
            self.look()
        return await goal.done

    def tick(self):
        goal = self.goals[0]
        self.floor += 1 if goal.left[0] > self.floor else -1
        self.stop(goal)
        goal.publish_feedback(Lift.Feedback(floor=self.floor, stops_left=len(goal.left)))
        self.look()

    def stop(self, goal):
        while goal.left[:1] == [self.floor]:
            goal.stops.append(goal.left.pop(0))

    def look(self):
        self.timer.cancel()
        while self.goals:
            goal = self.goals[0]
            self.stop(goal)
            if not goal.left:
                goal.succeed()
            elif goal.is_cancel_requested:
                goal.canceled()
            elif self.blocked or len(self.goals) > 1:
                goal.abort()
            else:
                self.timer.reset()
                return
            self.goals.pop(0)
            goal.done.set_result(Lift.Result(stops=goal.stops, floor=self.floor))

rclpy.init()
rclpy.spin(Motor())
"""

# A model of the lift that knows no ROS, a rate, and an event for each goal that another one ends.
RATE = """
import threading
from dataclasses import dataclass, field
import rclpy
import rclpy.executors
from course_interfaces.action import Lift
from rclpy.action import ActionServer
from rclpy.action.server import CancelResponse, GoalResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from std_srvs.srv import SetBool

@dataclass
class Model:
    floor: int = 0
    free: bool = True
    lock: threading.RLock = field(default_factory=threading.RLock)

    def journey(self, floors):
        # yields None before each step, and a pair after it
        for index, floor in enumerate(floors):
            while self.floor != floor:
                yield None
                self.floor += 1 if self.floor < floor else -1
                rest = floors[index:]
                while rest and rest[0] == self.floor:
                    rest = rest[1:]
                yield self.floor, len(rest)

def main(args=None):
    rclpy.init(args=args)
    node = rclpy.create_node('elevator_control', namespace='/building')
    node.declare_parameter('top', 9)
    node.declare_parameter('step_period', 1.0)
    model, gone = Model(), {}

    def key(handle):
        return bytes(handle.goal_id.uuid)

    def check(goal):
        floors = list(goal.floors)
        if floors == [] or any(f not in range(0, node.get_parameter('top').value + 1) for f in floors):
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def accepted(handle):
        for event in gone.values():
            event.set()
        gone[key(handle)] = threading.Event()
        handle.execute()

    def execute(handle):
        with model.lock:
            try:
                return drive(handle, list(handle.request.floors))
            finally:
                del gone[key(handle)]

    def drive(handle, floors):
        rate = node.create_rate(1.0 / node.get_parameter('step_period').value)
        visited, how = [model.floor], 'succeed'
        for told in model.journey(floors):
            if told is not None:
                visited.append(told[0])
                handle.publish_feedback(Lift.Feedback(floor=told[0], stops_left=told[1]))
            elif handle.is_cancel_requested:
                how = 'canceled'
                break
            elif gone[key(handle)].is_set() or not model.free:
                how = 'abort'
                break
            else:
                rate.sleep()
        rate.destroy()
        getattr(handle, how)()
        stops, rest = [], floors
        for floor in visited:
            while rest and rest[0] == floor:
                stops, rest = stops + rest[:1], rest[1:]
        return Lift.Result(stops=stops, floor=model.floor)

    def block(request, response):
        model.free = not request.data
        response.success = True
        return response

    server = ActionServer(node=node, action_type=Lift, action_name='/lift', execute_callback=execute,
                          callback_group=ReentrantCallbackGroup(), goal_callback=check,
                          handle_accepted_callback=accepted, cancel_callback=lambda _: CancelResponse.ACCEPT)
    node.create_service(SetBool, '/lift/block', block, callback_group=MutuallyExclusiveCallbackGroup())
    executor = rclpy.executors.MultiThreadedExecutor(8)
    executor.add_node(node)
    while rclpy.ok():
        executor.spin_once(timeout_sec=0.5)

if __name__ == '__main__':
    main()
"""

# Ends a goal as soon as anything asks for it: a waiting step is given up, and does not count.
AT_ONCE = """
import threading
import rclpy
from course_interfaces.action import Lift
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import SetBool

class LiftServer(Node):
    def __init__(self):
        super().__init__('lift_server')
        self.declare_parameter('top', 9)
        self.declare_parameter('step_period', 1.0)
        self.here, self.blocked, self.turn, self.serving = 0, False, 0, 1
        self.change = threading.Condition()
        self.create_service(SetBool, '/lift/block', self.on_block)
        self.server = ActionServer(self, Lift, '/lift', self.on_execute, goal_callback=self.on_goal,
                                   handle_accepted_callback=self.on_accepted, cancel_callback=self.on_cancel)

    def on_block(self, request, response):
        with self.change:
            self.blocked = request.data
            self.change.notify_all()
        response.success = True
        return response

    def on_goal(self, goal):
        ok = 0 < len(goal.floors) and 0 <= min(goal.floors) and max(goal.floors) <= self.get_parameter('top').value
        return (GoalResponse.REJECT, GoalResponse.ACCEPT)[ok]

    def on_cancel(self, goal_handle):
        def wake():
            with self.change:
                self.change.notify_all()
        threading.Timer(0.01, wake).start()
        return CancelResponse.ACCEPT

    def on_accepted(self, goal_handle):
        with self.change:
            self.turn += 1
            goal_handle.turn = self.turn
            self.change.notify_all()
        goal_handle.execute()

    def must_end(self, goal_handle):
        return goal_handle.is_cancel_requested or self.blocked or self.turn > goal_handle.turn

    def on_execute(self, goal_handle):
        with self.change:
            self.change.wait_for(lambda: self.serving == goal_handle.turn)
            try:
                return self.ride(goal_handle)
            finally:
                self.serving += 1
                self.change.notify_all()

    def ride(self, goal_handle):
        floors, made = list(goal_handle.request.floors), 0
        while True:
            while made < len(floors) and floors[made] == self.here:
                made += 1
            if made == len(floors):
                goal_handle.succeed()
                break
            period = self.get_parameter('step_period').value
            if self.change.wait_for(lambda: self.must_end(goal_handle), timeout=period):
                goal_handle.canceled() if goal_handle.is_cancel_requested else goal_handle.abort()
                break
            self.here += 1 if floors[made] > self.here else -1
            left = len(floors) - made
            for floor in floors[made:]:
                if floor != self.here:
                    break
                left -= 1
            goal_handle.publish_feedback(Lift.Feedback(floor=self.here, stops_left=left))
        return Lift.Result(stops=floors[:made], floor=self.here)

def main():
    rclpy.init()
    node = LiftServer()
    executor = MultiThreadedExecutor(num_threads=6)
    executor.add_node(node)
    try:
        executor.spin()
    except KeyboardInterrupt:
        pass

main()
"""

# A coroutine that the executor works on, and JSON for each event.
COROUTINE = """
import argparse, json, sys
import rclpy
from action_msgs.msg import GoalStatus
from course_interfaces.action import Lift
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.utilities import remove_ros_args

def show(**event):
    print(json.dumps(event), flush=True)

async def converse(client, options):
    heard = 0
    handle = None

    def due():
        return options.cancel_after is not None and heard >= options.cancel_after

    def on_feedback(message):
        nonlocal heard
        show(floor=message.feedback.floor, stops_left=message.feedback.stops_left)
        heard += 1
        if handle is not None and heard == options.cancel_after:
            handle.cancel_goal_async()

    handle = await client.send_goal_async(Lift.Goal(floors=options.floors), feedback_callback=on_feedback)
    if not handle.accepted:
        return 'rejected'
    if due():
        await handle.cancel_goal_async()
    response = await handle.get_result_async()
    show(stops=list(response.result.stops), floor=response.result.floor)
    return {GoalStatus.STATUS_SUCCEEDED: 'succeeded', GoalStatus.STATUS_CANCELED: 'canceled'}.get(
        response.status, 'aborted')

def main():
    parser = argparse.ArgumentParser(prog='lift', usage='lift_client.py FLOOR [FLOOR ...] [--cancel-after N]')
    parser.add_argument('floors', nargs='+', type=int)
    parser.add_argument('--cancel-after', type=int, default=None)
    options = parser.parse_args(remove_ros_args()[1:])
    rclpy.init()
    node = rclpy.create_node('json_client')
    client = ActionClient(node, Lift, 'lift')
    if not client.wait_for_server(timeout_sec=1.5):
        show(error='nobody serves /lift')
        return 2
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    task = executor.create_task(converse, client, options)
    executor.spin_until_future_complete(task)
    show(outcome=task.result())
    return 0 if task.result() == 'succeeded' else 3

sys.exit(main())
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

# A step in which a cancel comes is given up.
OFTEN = """            for _ in range(10):
                if not goal_handle.is_cancel_requested:
                    time.sleep(period / 10)
            if goal_handle.is_cancel_requested:
                continue
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
    "two threads: what comes while one goal moves and another waits is answered a step later": server(
        ("num_threads=4", "num_threads=2")
    ),
    "as many threads as processors, period read at each step": server(
        ("num_threads=4", ""), (PERIOD, ""), ("sleep(period)", "sleep(self.get_parameter('step_period').value)")
    ),
    "looks for a cancel ten times a step": server((SLEEP, OFTEN)),
    "one thread with a timer as the motor; a client that is a coroutine": {
        SERVER: TIMER.encode(),
        CLIENT: COROUTINE.encode(),
    },
    "a model without ROS, a rate, in a namespace": REFERENCE | {SERVER: RATE.encode()},
    "gives up a step at once when anything ends the goal": {SERVER: AT_ONCE.encode(), CLIENT: COROUTINE.encode()},
    "spun by rclpy.spin, logs each step, short of threads": server(
        (EXECUTOR, "    try:\n        rclpy.spin(node, executor=MultiThreadedExecutor(num_threads=3))\n"),
        (PUBLISH, PUBLISH + "            self.get_logger().warning(f'step {left}' * 100)\n"),
    ),
}

SERVER_TESTS = {
    "ride",
    "feedback",
    "keeps_its_place",
    "stops_where_it_stands",
    "cancel",
    "cancelled_result",
    "cancel_while_waiting",
    "rejects",
    "rejected_goal_changes_nothing",
    "preempt",
    "preempt_waiting",
    "blocked",
    "block_is_answered",
    "blocked_before",
    "stops_while_blocked",
    "aborted_result",
    "step_period",
}
CLIENT_TESTS = {
    "client_sends_floors",
    "client_shows_feedback",
    "client_shows_feedback_as_it_comes",
    "client_shows_result",
    "client_says_outcome",
    "client_exit_status",
    "client_cancels",
    "client_cancels_at_once",
    "client_waits_for_the_end",
    "client_without_server",
    "client_arguments",
}
CHECK = "if goal.floors and all(0 <= floor <= top for floor in goal.floors):"
TAKE = "        self.newest = goal_handle\n        goal_handle.execute()\n"
LOCK = "        with self.cabin:\n            return self.move(goal_handle)\n"
BEGIN = "        self.stop(stops, left)\n        while left:\n"
FAILS = "return 0 if outcome == 'SUCCEEDED' else 1"
SHOWN = "        print(f'Result: stops {list(end.result.stops)}, now at {end.result.floor}')\n"
TOLD = "        print(f'Feedback: floor {now.floor}, {now.stops_left} stops left')\n"
DUE = "due = self.cancel_after is not None and self.heard >= self.cancel_after"
CANCELS = "            self.goal_handle.cancel_goal_async()\n"
SAYS = "    print('Outcome:', outcome)\n"
PARSED = """    parser = argparse.ArgumentParser()
    parser.add_argument('floors', type=int, nargs='+', metavar='FLOOR')
    parser.add_argument('--cancel-after', type=int, metavar='N')
    options = parser.parse_args(remove_ros_args(args)[1:])
"""

UNCHECKED = """    cancel = sys.argv.index('--cancel-after') if '--cancel-after' in sys.argv else len(sys.argv)
    options = argparse.Namespace(
        floors=[int(floor) for floor in sys.argv[1:cancel]], cancel_after=int((sys.argv + [0, 0])[cancel + 1]))
    options.cancel_after = options.cancel_after if '--cancel-after' in sys.argv else None
"""
# The chapter's server under another name.
CHAPTER = (Path(__file__).parents[3] / "course/nodes/fibonacci_action_server.py").read_bytes()
CHAPTERS_CLIENT = (Path(__file__).parents[3] / "course/nodes/fibonacci_action_client.py").read_bytes()

# The right action and service, and a goal that does nothing: `{}` is what it does before its result.
EMPTY = """
import time
import rclpy
from course_interfaces.action import Lift
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.executors import MultiThreadedExecutor
from std_srvs.srv import SetBool

rclpy.init()
node = rclpy.create_node('lift')
node.declare_parameters('', [('step_period', 1.0), ('top', 9)])

def execute(handle):
    result = Lift.Result()
    {}
    return result

def block(request, response):
    response.success = True
    return response

server = ActionServer(node, Lift, '/lift', execute, goal_callback=lambda goal: GoalResponse.{},
                      cancel_callback=lambda handle: CancelResponse.ACCEPT)
service = node.create_service(SetBool, '/lift/block', block)
rclpy.spin(node, executor=MultiThreadedExecutor(8))
"""
SAYS_NO = b"import sys\nprint('no')\nsys.exit(1)\n"
# Sends its goal, whatever comes of it, and says `{}`.
SENDS = """
import sys
import rclpy
from course_interfaces.action import Lift
from rclpy.action import ActionClient

rclpy.init()
node = rclpy.create_node('client')
client = ActionClient(node, Lift, '/lift')
client.wait_for_server(3)
floors = [int(word) for word in sys.argv[1:] if word.isdigit()]
rclpy.spin_until_future_complete(node, client.send_goal_async(Lift.Goal(floors=floors)), timeout_sec=3)
{}
"""


def nothing(does: str, client: str | bytes = SAYS_NO, answer: str = "ACCEPT") -> dict[str, bytes]:
    """A server whose goals do nothing else than `does`, and a client that says `client` for everything."""
    says = client if isinstance(client, bytes) else SENDS.format(client).encode()
    return {SERVER: EMPTY.format(does, answer).encode(), CLIENT: says}


# What is wrong, and the tests that it loses (without "test_").
WRONG = {
    "the goal after a cancelled one is aborted": (
        server(
            (
                CANCEL,
                CANCEL.replace("                break\n", "                self.over = True\n                break\n"),
            ),
            (
                "            if self.blocked or self.newest is not goal_handle:\n",
                "            if self.blocked or self.newest is not goal_handle or vars(self).pop('over', False):\n",
            ),
        ),
        {"cancel", "cancel_while_waiting"},
    ),
    "ends 0.7 s after a cancel": (
        server(
            ("import threading\n", "import os\nimport threading\n"),
            (
                CANCEL,
                CANCEL.replace(
                    "                break\n",
                    "                threading.Timer(0.7, os._exit, (0,)).start()\n                break\n",
                ),
            ),
        ),
        {"cancel"},
    ),
    # Answers that do nothing of what is asked for.
    "refuses everything; a client that says no": (nothing("pass", answer="REJECT"), SERVER_TESTS | CLIENT_TESTS),
    "every goal is aborted at once; a client that says SUCCEEDED": (
        nothing("handle.abort()", "print('SUCCEEDED')"),
        SERVER_TESTS | CLIENT_TESTS - {"client_sends_floors", "client_waits_for_the_end"},
    ),
    "every goal succeeds at once; a client that says REJECTED": (
        nothing("handle.succeed()", "sys.exit('REJECTED')"),
        SERVER_TESTS | CLIENT_TESTS - {"client_sends_floors"},
    ),
    "a goal succeeds at once with what was asked for; a client that says all": (
        nothing(
            "handle.succeed(); result.stops = handle.request.floors; result.floor = max([0, *result.stops[-1:]])",
            "sys.exit('SUCCEEDED, CANCELED, ABORTED or REJECTED')",
        ),
        SERVER_TESTS - {"ride", "stops_where_it_stands"} | CLIENT_TESTS - {"client_sends_floors"},
    ),
    "no goal ever ends; a client that says no": (
        nothing("while rclpy.ok(): time.sleep(0.1)"),
        SERVER_TESTS - {"block_is_answered"} | CLIENT_TESTS,
    ),
    # Answers with several mistakes.
    "the chapter's programs": ({SERVER: CHAPTER, CLIENT: CHAPTERS_CLIENT}, SERVER_TESTS | CLIENT_TESTS),
    # Answers with one mistake each.
    "another name": (server(("'/lift'", "'/elevator'")), SERVER_TESTS),
    # The rest of the server cannot be judged: goals of the other type have no floors, and its feedback no floor.
    "another type": (
        server(("course_interfaces.action import Lift", "course_interfaces.action import Fibonacci as Lift")),
        SERVER_TESTS,
    ),
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
    "returns no result": (
        server((RESULT, "return None")),
        SERVER_TESTS - {"feedback", "rejects", "rejected_goal_changes_nothing", "block_is_answered", "step_period"},
    ),
    "never begins an accepted goal": (
        server(("        goal_handle.execute()\n", "")),
        SERVER_TESTS - {"rejects", "block_is_answered"},
    ),
    "notes a floor that it passes as a stop": (
        server(
            (
                STEP,
                STEP.replace(
                    "            self.stop",
                    "            if self.floor in left[1:] and self.floor != left[0]:\n"
                    "                stops.append(self.floor)\n            self.stop",
                ),
            )
        ),
        {"ride"},
    ),
    "result has the stops sorted": (
        server((RESULT, "return Lift.Result(stops=sorted(stops), floor=self.floor)")),
        {"ride"},
    ),
    "result without the floor": (
        server((RESULT, "return Lift.Result(stops=stops)")),
        {"ride", "cancelled_result", "aborted_result"},
    ),
    "result says what was asked for": (
        server((RESULT, "return Lift.Result(stops=goal_handle.request.floors, floor=self.floor)")),
        {"cancelled_result", "aborted_result"},
    ),
    "no feedback": (server((PUBLISH, "")), {"feedback", "keeps_its_place", "preempt"}),
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
    "feedback of the floor where a goal begins, too": (
        server((BEGIN, PUBLISH.replace("    " * 3, "    " * 2) + BEGIN)),
        {"feedback"},
    ),
    "stops at each floor once": (
        server(
            (
                "left = [], list(goal_handle.request.floors)",
                "left = [], list(dict.fromkeys(goal_handle.request.floors))",
            )
        ),
        {"ride", "stops_where_it_stands"},
    ),
    "each block aborts a goal, also when the shaft is free again": (
        server(
            ("self.blocked = request.data", "self.blocked = request.data\n        self.due = self.due or request.data"),
            ("            if self.blocked or self.newest", "            if self.blocked or self.due or self.newest"),
            (
                "                goal_handle.abort()\n",
                "                self.due = False\n                goal_handle.abort()\n",
            ),
            ("        self.blocked = False\n", "        self.blocked = self.due = False\n"),
        ),
        {"blocked_before"},
    ),
    "a block counts only while a goal runs": (
        server(
            (
                "        self.blocked = request.data\n",
                """        if not request.data:
            self.blocked = False
        elif self.newest is not None and self.newest.is_active:
            self.blocked = True
""",
            )
        ),
        {"blocked_before"},
    ),
    "to block a blocked shaft frees it when no goal runs": (
        server(
            (
                "        self.blocked = request.data\n",
                """        runs = self.newest is not None and self.newest.is_active
        self.blocked = request.data and (runs or not self.blocked)
""",
            )
        ),
        {"blocked_before"},
    ),
    "to block a blocked shaft frees it": (
        server(("self.blocked = request.data", "self.blocked = request.data and not self.blocked")),
        {"blocked_before"},
    ),
    "feedback before the step": (
        server((STEP + PUBLISH, PUBLISH + STEP)),
        {"feedback", "cancelled_result", "aborted_result"},
    ),
    "a message for each stop, too": (
        server(
            (
                PUBLISH,
                PUBLISH + "            if stops[-1:] == [self.floor]:\n    " + PUBLISH.replace("\n   ", "\n       "),
            )
        ),
        {"feedback"},
    ),
    "a message when all stops are made, too": (
        server(
            (
                "        else:\n",
                "        else:\n            if self.floor != begin:\n    " + PUBLISH.replace("\n   ", "\n       "),
            ),
            (PERIOD, PERIOD + "        begin = self.floor\n"),
        ),
        {"feedback"},
    ),
    "stops_left counts the one just made": (
        server(("stops_left=len(left)", "stops_left=len(left) + (stops[-1:] == [self.floor])")),
        {"feedback"},
    ),
    "stops_left is never set": (server((", stops_left=len(left)", "")), {"feedback"}),
    "does not say that it succeeded": (server(("        else:\n            goal_handle.succeed()\n", "")), {"ride"}),
    "aborts a goal that has made all stops": (server(("goal_handle.succeed()", "goal_handle.abort()")), {"ride"}),
    "every goal starts at floor 0": (
        server((PERIOD, PERIOD + "        self.floor = 0\n")),
        {"keeps_its_place", "cancelled_result", "preempt", "blocked", "aborted_result"},
    ),
    "starts at floor 1": (server(("self.floor = 0", "self.floor = 1")), {"keeps_its_place"}),
    "goes back to floor 0 when all stops are made": (
        server(
            (
                RESULT,
                (
                    "result = Lift.Result(stops=stops, floor=self.floor)\n"
                    "        self.floor = self.floor if left or self.blocked else 0\n        return result"
                ),
            )
        ),
        {"keeps_its_place"},
    ),
    "an idle cabin goes back to floor 0 by itself": (
        server(
            (
                "        self.get_logger().info('Lift ready')\n",
                (
                    "        self.moved = time.monotonic()\n        self.create_timer(0.2, self.go_back)\n"
                    "        self.get_logger().info('Lift ready')\n\n"
                    "    def go_back(self):\n"
                    "        if self.cabin.acquire(blocking=False):\n"
                    "            if time.monotonic() - self.moved > 3.5:\n                self.floor = 0\n"
                    "            self.cabin.release()\n"
                ),
            ),
            (RESULT, f"self.moved = time.monotonic()\n        {RESULT}"),
        ),
        {"keeps_its_place"},
    ),
    "a stop takes a step": (
        server(
            (
                BEGIN,
                (
                    "        if left[0] == self.floor:\n            time.sleep(period)\n"
                    "            goal_handle.publish_feedback(Lift.Feedback(floor=self.floor, stops_left=len(left)))\n"
                    + BEGIN
                ),
            )
        ),
        {"stops_where_it_stands"},
    ),
    "makes one stop where it stands, not two": (
        server(("        while left and left[0] == self.floor:\n", "        if left and left[0] == self.floor:\n")),
        {"stops_where_it_stands"},
    ),
    "takes two stops at the same floor for one": (
        server((RESULT, "stops = [a for a, b in zip(stops, [*stops[1:], None]) if a != b]\n        " + RESULT)),
        {"stops_where_it_stands"},
    ),
    "counts a stop as left that is made twice at once": (
        server(("stops_left=len(left)", "stops_left=len(left) + (stops[-2:] == [self.floor] * 2)")),
        {"stops_where_it_stands"},
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
    "a top of 0 counts as not set": (
        server(("top = self.get_parameter('top').value", "top = self.get_parameter('top').value or 9")),
        {"rejects"},
    ),
    "a top below 9 has no effect": (
        server(("top = self.get_parameter('top').value", "top = max(9, self.get_parameter('top').value)")),
        {"rejects"},
    ),
    "a top above 20 has no effect": (
        server(("top = self.get_parameter('top').value", "top = min(20, self.get_parameter('top').value)")),
        {"rejects"},
    ),
    "rejects more than ten floors": (server(("if goal.floors and", "if 0 < len(goal.floors) <= 10 and")), {"rejects"}),
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
    "no cancel callback": (
        server((", cancel_callback=self.allow_cancel", "")),
        {"cancel", "cancelled_result", "cancel_while_waiting"},
    ),
    "one thread": (
        server((EXECUTOR, "    try:\n        rclpy.spin(node)\n")),
        {
            "cancel",
            "cancelled_result",
            "cancel_while_waiting",
            "preempt",
            "preempt_waiting",
            "blocked",
            "block_is_answered",
            "aborted_result",
        },
    ),
    "waits where it should move": (
        server(
            ("            self.floor += 1 if left[0] > self.floor else -1\n            self.stop(stops, left)\n", ""),
            (PUBLISH, ""),
        ),
        SERVER_TESTS - {"rejects", "block_is_answered"},
    ),
    "never looks for a cancel": (server((CANCEL, "")), {"cancel", "cancelled_result", "cancel_while_waiting"}),
    "cancelled goal has an empty result": (
        server((CANCEL, CANCEL.replace("break", "return Lift.Result()"))),
        {"cancelled_result"},
    ),
    "a goal that is cancelled before its first step has an empty result": (
        server(
            (
                CANCEL,
                CANCEL.replace("break", "return Lift.Result(stops=stops, floor=self.floor) if moved else Lift.Result()")
                + "            moved = True\n",
            ),
            (PERIOD, "        moved = False\n" + PERIOD),
        ),
        {"cancelled_result"},
    ),
    "a cancel past the middle of a step moves the cabin on, untold": (
        server(
            (
                SLEEP,
                """            begun = time.monotonic()
            while time.monotonic() < begun + period and not goal_handle.is_cancel_requested:
                time.sleep(0.01)
            if goal_handle.is_cancel_requested:
                if time.monotonic() > begun + 0.5 * period:
                    self.floor += 1 if left[0] > self.floor else -1
                goal_handle.canceled()
                break
""",
            )
        ),
        {"cancelled_result"},
    ),
    "cancelled goal is aborted": (server((CANCEL, CANCEL.replace("canceled", "abort"))), {"cancelled_result"}),
    "cancelled goal succeeds": (
        server((CANCEL, CANCEL.replace("canceled", "succeed"))),
        {"cancelled_result", "cancel_while_waiting"},
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
    "cancelled cabin rolls on to the next floor": (
        server(
            (
                CANCEL,
                CANCEL.replace(
                    "break",
                    "at, self.floor = self.floor, self.floor + (1 if left[0] > self.floor else -1)\n"
                    "                return Lift.Result(stops=stops, floor=at)",
                ),
            )
        ),
        {"cancelled_result"},
    ),
    "ends a cancelled goal at its next stop": (
        server((CANCEL, CANCEL.replace("if goal_handle", "if stops[-1:] == [self.floor] and goal_handle"))),
        {"cancel", "cancel_while_waiting"},
    ),
    "makes two more steps after a cancel": (
        server(
            (
                CANCEL,
                CANCEL.replace(
                    "                goal_handle",
                    "                more -= 1\n            if more < 0:\n                goal_handle",
                ),
            ),
            (PERIOD, PERIOD + "        more = 2\n"),
        ),
        {"cancel"},
    ),
    "looks for a cancel on the way up alone": (
        server((CANCEL, CANCEL.replace("if goal", "if (left[0] > self.floor or not stops) and goal"))),
        {"cancel"},
    ),
    "looks for a cancel on the way down alone": (
        server((CANCEL, CANCEL.replace("if goal", "if (left[0] < self.floor or not stops) and goal"))),
        {"cancel"},
    ),
    "does not look for a cancel near the next stop": (
        server((CANCEL, CANCEL.replace("if goal", "if abs(left[0] - self.floor) > 2 and goal"))),
        {"cancel"},
    ),
    "does not look for a cancel on the way to the last stop": (
        server((CANCEL, CANCEL.replace("if goal", "if (len(left) > 1 or not stops) and goal"))),
        {"cancel"},
    ),
    "makes one more step after a cancel": (
        server(
            (
                CANCEL,
                CANCEL.replace(
                    "                goal_handle",
                    "                more -= 1\n            if more < 0:\n                goal_handle",
                ),
            ),
            (PERIOD, PERIOD + "        more = 1\n"),
        ),
        {"cancel"},
    ),
    "refuses to cancel a goal that another one takes over from": (
        server(
            (
                "        return CancelResponse.ACCEPT",
                (
                    "        newest = goal_handle is self.newest\n"
                    "        return CancelResponse.ACCEPT if newest else CancelResponse.REJECT"
                ),
            )
        ),
        {"cancel_while_waiting"},
    ),
    "refuses to cancel a goal that waits": (
        server(
            (
                "        return CancelResponse.ACCEPT",
                (
                    "        moves = goal_handle is self.moving\n"
                    "        return CancelResponse.ACCEPT if moves else CancelResponse.REJECT"
                ),
            ),
            (PERIOD, "        self.moving = goal_handle\n" + PERIOD),
            ("        self.floor = 0\n", "        self.floor = 0\n        self.moving = None\n"),
        ),
        {"cancel_while_waiting"},
    ),
    "a goal that is cancelled while it waits has not taken over": (
        server(
            (
                "        return CancelResponse.ACCEPT",
                (
                    "        if goal_handle is self.newest and goal_handle is not self.moving:\n"
                    "            self.newest = self.moving\n"
                    "        return CancelResponse.ACCEPT"
                ),
            ),
            (PERIOD, "        self.moving = goal_handle\n" + PERIOD),
            ("        self.floor = 0\n", "        self.floor = 0\n        self.moving = None\n"),
        ),
        {"cancel_while_waiting"},
    ),
    "waits for the cabin for half a second": (
        server(
            (
                LOCK,
                (
                    "        got = self.cabin.acquire(timeout=0.5)\n"
                    "        try:\n            return self.move(goal_handle)\n"
                    "        finally:\n            if got:\n                self.cabin.release()\n"
                ),
            )
        ),
        {"preempt"},
    ),
    "looks for a new goal on the way up alone": (
        server((ABORT, ABORT.replace("self.newest", "(left[0] > self.floor or not stops) and self.newest"))),
        {"preempt", "preempt_waiting"},
    ),
    "does not look for a new goal near the next stop": (
        server((ABORT, ABORT.replace("self.newest", "(abs(left[0] - self.floor) > 2 or not stops) and self.newest"))),
        {"preempt"},
    ),
    "looks for a new goal in the first five steps alone": (
        server(
            (ABORT, ABORT.replace("self.newest", "made < 5 and self.newest")),
            (PERIOD, PERIOD + "        made = 0\n"),
            (SLEEP, SLEEP + "            made += 1\n"),
        ),
        {"preempt"},
    ),
    "looks for a cancel in the first four steps alone": (
        server(
            ("if goal_handle.is_cancel_requested:", "if made < 4 and goal_handle.is_cancel_requested:"),
            (PERIOD, PERIOD + "        made = 0\n"),
            (SLEEP, SLEEP + "            made += 1\n"),
        ),
        {"cancel"},
    ),
    "keeps the first two promises to cancel": (
        server(
            ("if goal_handle.is_cancel_requested:", "if self.cancels <= 2 and goal_handle.is_cancel_requested:"),
            ("        return CancelResponse.ACCEPT", "        self.cancels += 1\n        return CancelResponse.ACCEPT"),
            ("        self.newest = None  #", "        self.cancels = 0\n        self.newest = None  #"),
        ),
        {"cancel"},
    ),
    "a cancelled goal has no result for twelve steps": (
        server(("goal_handle.canceled()\n", "goal_handle.canceled()\n                time.sleep(12 * period)\n")),
        {"cancel", "cancelled_result"},
    ),
    "makes one more step when a new goal comes": (
        server(
            (ABORT, ABORT.replace("self.newest is not goal_handle", "old is not goal_handle")),
            (SLEEP, "            old = self.newest\n" + SLEEP),
            (BEGIN, BEGIN.replace("        while left", "        old = self.newest\n        while left")),
        ),
        {"preempt"},
    ),
    "the second of two stops takes a step": (
        server(
            (
                "            stops.append(left.pop(0))\n",
                (
                    "            if stops and stops[-1] == left[0]:\n"
                    "                time.sleep(self.get_parameter('step_period').value)\n"
                    "            stops.append(left.pop(0))\n"
                ),
            )
        ),
        {"stops_where_it_stands"},
    ),
    "counts two stops at the same floor as one": (
        server(("stops_left=len(left)", "stops_left=len(set(left))")),
        {"feedback"},
    ),
    "counts the stops from the first with this floor": (
        server(
            ("stops_left=len(left))", "stops_left=len(floors) - floors.index(left[0]) if left else 0)"),
            (BEGIN, "        floors = list(left)\n" + BEGIN),
        ),
        {"feedback"},
    ),
    "a shaft that is blocked twice must be freed twice": (
        server(
            (
                "        self.blocked = request.data\n",
                "        self.blocked = max(0, self.blocked + (1 if request.data else -1))\n",
            )
        ),
        {"blocked_before"},
    ),
    "to block waits until nobody moves": (
        server(
            (
                "        self.blocked = request.data\n",
                (
                    "        self.blocked = request.data\n"
                    "        if request.data:\n            with self.cabin:\n                pass\n"
                ),
            )
        ),
        {"block_is_answered"},
    ),
    "a block puts the cabin back to where its goal began": (
        server(
            (
                ABORT,
                ABORT.replace(
                    "                goal_handle.abort()\n",
                    "                goal_handle.abort()\n"
                    "                here, self.floor = self.floor, begun if self.blocked else self.floor\n"
                    "                return Lift.Result(stops=stops, floor=here)\n",
                ),
            ),
            (PERIOD, "        begun = self.floor\n" + PERIOD),
        ),
        {"blocked"},
    ),
    "a step takes a second at most": (
        server((PERIOD, "        period = min(1.0, self.get_parameter('step_period').value)\n")),
        {"step_period"},
    ),
    "forgets a cancel that came while the goal waited": (
        server(
            ("        return CancelResponse.ACCEPT", "        self.asked = True\n        return CancelResponse.ACCEPT"),
            (PERIOD, "        self.asked = False\n" + PERIOD),
            ("if goal_handle.is_cancel_requested:", "if self.asked and goal_handle.is_cancel_requested:"),
        ),
        {"cancel_while_waiting"},
    ),
    "looks for a cancel when a step is over, and not before": (
        server((CANCEL, ""), (PUBLISH, PUBLISH + CANCEL)),
        {"cancel_while_waiting"},
    ),
    "cancels every goal after the one that was cancelled": (
        server(
            ("        return CancelResponse.ACCEPT", "        self.asked = True\n        return CancelResponse.ACCEPT"),
            ("        self.floor = 0\n", "        self.floor = 0\n        self.asked = False\n"),
            (
                CANCEL,
                CANCEL + "            if self.asked:\n                goal_handle.abort()\n                break\n",
            ),
        ),
        {"cancel", "cancel_while_waiting"},
    ),
    "rejects while it is busy": (
        server((CHECK, "if self.cabin.locked():\n            return GoalResponse.REJECT\n        " + CHECK)),
        {"preempt", "preempt_waiting", "cancel_while_waiting"},
    ),
    "goals wait for the one that runs": (
        server((" or self.newest is not goal_handle", "")),
        {"preempt", "preempt_waiting"},
    ),
    "goals move the cabin side by side": (
        server((" or self.newest is not goal_handle", ""), ("        with self.cabin:\n", "        if True:\n")),
        {"preempt", "preempt_waiting", "cancel_while_waiting"},
    ),
    "notes the newest goal when it begins to move": (
        server(
            ("        self.newest = goal_handle\n", ""),
            ("        with self.cabin:\n", "        with self.cabin:\n            self.newest = goal_handle\n"),
        ),
        {"preempt", "preempt_waiting"},
    ),
    "preempts and does not wait for the cabin": (
        server(("        with self.cabin:\n", "        if True:\n")),
        {"preempt", "preempt_waiting", "cancel_while_waiting"},
    ),
    "waits for the cabin for half a step": (
        server(
            (
                LOCK,
                (
                    "        got = self.cabin.acquire(timeout=0.5 * self.get_parameter('step_period').value)\n"
                    "        try:\n            return self.move(goal_handle)\n"
                    "        finally:\n            if got:\n                self.cabin.release()\n"
                ),
            )
        ),
        {"preempt", "preempt_waiting"},
    ),
    "begins where the cabin was when the goal came": (
        server(
            (TAKE, "        goal_handle.start = self.floor\n" + TAKE),
            (PERIOD, PERIOD + "        self.floor = goal_handle.start\n"),
        ),
        {"preempt", "preempt_waiting"},
    ),
    "makes the stops that are due before it has the cabin": (
        server(
            (
                LOCK,
                """        stops, left = [], list(goal_handle.request.floors)
        self.stop(stops, left)
        with self.cabin:
            return self.move(goal_handle, stops, left)
""",
            ),
            ("def move(self, goal_handle):", "def move(self, goal_handle, stops, left):"),
            (
                (
                    "        stops, left = [], list(goal_handle.request.floors)\n"
                    "        self.stop(stops, left)\n        while"
                ),
                "        while",
            ),
        ),
        {"preempt_waiting"},
    ),
    "a step under way is not reported when a new goal comes": (
        server(
            (
                PUBLISH,
                "            if left and self.newest is not goal_handle:\n"
                "                goal_handle.abort()\n                break\n" + PUBLISH,
            )
        ),
        {"preempt"},
    ),
    "a preempted goal succeeds": (
        server(
            (
                ABORT,
                "            if self.newest is not goal_handle:\n                goal_handle.succeed()\n"
                "                break\n" + ABORT,
            )
        ),
        {"preempt_waiting", "aborted_result"},
    ),
    "a preempted goal that has made a stop succeeds": (
        server(
            (
                ABORT,
                "            if self.newest is not goal_handle and stops:\n                goal_handle.succeed()\n"
                "                break\n" + ABORT,
            )
        ),
        {"aborted_result"},
    ),
    "preempts a goal at its next stop alone": (
        server(
            (
                "self.newest is not goal_handle:",
                "(self.newest is not goal_handle and (not stops or stops[-1] == self.floor)):",
            )
        ),
        {"preempt", "preempt_waiting"},
    ),
    "goes on for two steps when a new goal comes": (
        server(
            (
                ABORT,
                """            late -= self.newest is not goal_handle
            if self.blocked or late < 0:
                goal_handle.abort()
                break
""",
            ),
            (PERIOD, PERIOD + "        late = 2 if self.newest is goal_handle else 0\n"),
        ),
        {"preempt", "preempt_waiting"},
    ),
    "a preempted goal has an empty result": (
        server(
            (
                ABORT,
                "            if self.newest is not goal_handle:\n                goal_handle.abort()\n"
                "                return Lift.Result(floor=self.floor)\n" + ABORT,
            )
        ),
        {"aborted_result"},
    ),
    "a goal that is replaced while it waits makes a step": (
        server(
            (" or self.newest is not goal_handle", ""),
            (
                PUBLISH,
                PUBLISH + "            if left and self.newest is not goal_handle:\n"
                "                goal_handle.abort()\n                break\n",
            ),
        ),
        {"preempt_waiting"},
    ),
    "a goal that gives up waiting counts as one that has stopped": (
        server(
            (TAKE, "        goal_handle.before, goal_handle.gone = self.newest, threading.Event()\n" + TAKE),
            (
                LOCK,
                """        before = goal_handle.before
        try:
            while before is not None and not before.gone.wait(0.02):
                if goal_handle.is_cancel_requested:
                    goal_handle.canceled()
                    return Lift.Result(floor=self.floor)
                if self.newest is not goal_handle:
                    goal_handle.abort()
                    return Lift.Result(floor=self.floor)
            return self.move(goal_handle)
        finally:
            goal_handle.gone.set()
""",
            ),
        ),
        {"preempt_waiting"},
    ),
    "tells only the goal that moves of a new one": (
        server(
            (TAKE, "        self.over.append(self.moving)\n" + TAKE),
            ("self.newest is not goal_handle", "any(goal is goal_handle for goal in self.over)"),
            (PERIOD, "        self.moving = goal_handle\n" + PERIOD),
            ("        self.floor = 0\n", "        self.floor = 0\n        self.moving, self.over = None, []\n"),
        ),
        {"preempt_waiting"},
    ),
    "takes a goal for the same floors for the same goal": (
        server(("self.newest is not goal_handle", "self.newest.request.floors != goal_handle.request.floors")),
        {"preempt_waiting"},
    ),
    "whatever is asked for preempts": (
        server(("        top = self.get", "        self.newest = goal\n        top = self.get")),
        {"rejected_goal_changes_nothing"},
    ),
    "an empty goal ends the one that runs": (
        server(
            (
                "        top = self.get",
                "        if not goal.floors:\n            self.newest = None\n        top = self.get",
            )
        ),
        {"rejected_goal_changes_nothing"},
    ),
    "a rejected goal takes the cabin to floor 0": (
        server(("        return GoalResponse.REJECT", "        self.floor = 0\n        return GoalResponse.REJECT")),
        {"rejected_goal_changes_nothing"},
    ),
    "a goal without floors takes an idle cabin to floor 0": (
        server(
            (
                "        return GoalResponse.REJECT",
                (
                    "        if not goal.floors and not self.cabin.locked():\n            self.floor = 0\n"
                    "        return GoalResponse.REJECT"
                ),
            )
        ),
        {"rejected_goal_changes_nothing"},
    ),
    "no service to block the shaft": (
        server(("        self.service = self.create_service(SetBool, '/lift/block', self.block)\n", "")),
        {"blocked", "block_is_answered", "blocked_before", "stops_while_blocked"},
    ),
    "never looks whether it is blocked": (
        server(("if self.blocked or", "if")),
        {"blocked", "blocked_before", "stops_while_blocked"},
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
        {"blocked", "blocked_before", "stops_while_blocked"},
    ),
    "rejects while it is blocked": (
        server((CHECK, "if self.blocked:\n            return GoalResponse.REJECT\n        " + CHECK)),
        {"blocked_before", "stops_while_blocked"},
    ),
    "rejects what needs a step while it is blocked": (
        server(
            (
                CHECK,
                (
                    "if self.blocked and list(goal.floors) != [self.floor]:\n            return GoalResponse.REJECT\n"
                    f"        {CHECK}"
                ),
            )
        ),
        {"blocked_before"},
    ),
    "makes a step before it looks whether it is blocked": (
        server(
            ("if self.blocked or", "if"),
            (
                PUBLISH,
                PUBLISH
                + "            if self.blocked and left:\n                goal_handle.abort()\n                break\n",
            ),
        ),
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
        {"blocked"},
    ),
    "looks for the block on the way up alone": (
        server(
            (ABORT, ABORT.replace("self.blocked or", "self.blocked and (left[0] > self.floor or not moved) or")),
            (PERIOD, PERIOD + "        moved = False\n"),
            (SLEEP, SLEEP + "            moved = True\n"),
        ),
        {"blocked"},
    ),
    "makes one more step when the shaft is blocked": (
        server(
            (
                ABORT,
                """            more -= self.blocked
            if (self.blocked and more < 0) or self.newest is not goal_handle:
                goal_handle.abort()
                break
""",
            ),
            (PERIOD, PERIOD + "        more = 0 if self.blocked else 1\n"),
        ),
        {"blocked"},
    ),
    "looks for the block at stops alone": (
        server(("if self.blocked or", "if self.blocked and (not stops or stops[-1] == self.floor) or")),
        {"blocked"},
    ),
    "never free again": (server(("self.blocked = request.data", "self.blocked = True")), {"blocked_before"}),
    "each call blocks what is free, and frees what is blocked": (
        server(("self.blocked = request.data", "self.blocked = not self.blocked")),
        {"blocked_before"},
    ),
    "a blocked shaft is free again after 3 s": (
        server(
            (
                "        response.success = True\n",
                (
                    "        if request.data:\n"
                    "            timer = threading.Timer(3.0, lambda: setattr(self, 'blocked', False))\n"
                    "            timer.daemon = True\n            timer.start()\n"
                    "        response.success = True\n"
                ),
            )
        ),
        {"blocked_before"},
    ),
    "an aborted goal frees the shaft": (
        server((ABORT, ABORT.replace("break", "self.blocked = False\n                break"))),
        {"blocked_before"},
    ),
    "block is answered with success false": (
        server(("response.success = True", "response.success = False")),
        {"block_is_answered"},
    ),
    "success says whether the shaft is blocked": (
        server(("response.success = True", "response.success = request.data")),
        {"block_is_answered"},
    ),
    "block is answered when the goal is over": (
        server(
            ("        response.success = True\n", "        with self.cabin:\n            response.success = True\n")
        ),
        {"block_is_answered"},
    ),
    "block is answered a step later": (
        server(
            (
                "        response.success = True\n",
                "        time.sleep(self.get_parameter('step_period').value)\n        response.success = True\n",
            )
        ),
        {"block_is_answered"},
    ),
    "aborts every goal while it is blocked": (
        server(
            (
                PERIOD,
                PERIOD + "        if self.blocked:\n            goal_handle.abort()\n"
                "            return Lift.Result(floor=self.floor)\n",
            )
        ),
        {"stops_while_blocked"},
    ),
    "rejects the floor where it stands while it is blocked": (
        server(
            (
                CHECK,
                (
                    "if self.blocked and list(goal.floors) == [self.floor]:\n            return GoalResponse.REJECT\n"
                    f"        {CHECK}"
                ),
            )
        ),
        {"stops_while_blocked"},
    ),
    "a goal that was replaced while it waited has an empty result": (
        server(
            (
                LOCK,
                """        with self.cabin:
            if self.newest is not goal_handle and not goal_handle.is_cancel_requested:
                goal_handle.abort()
                return Lift.Result()
            return self.move(goal_handle)
""",
            )
        ),
        {"aborted_result"},
    ),
    "aborted goal has an empty result": (
        server((ABORT, ABORT.replace("break", "return Lift.Result()"))),
        {"aborted_result"},
    ),
    "a goal that a new one aborts in its last step has an empty result": (
        server(
            (
                TAKE,
                """        previous, self.newest = self.newest, goal_handle
        if previous is not None and previous.is_active:
            previous.abort()
        goal_handle.execute()
""",
            ),
            (
                "            if self.blocked or self.newest is not goal_handle:\n",
                "            if not goal_handle.is_active:\n                break\n            if self.blocked:\n",
            ),
        ),
        {"aborted_result"},
    ),
    "a blocked goal succeeds": (
        server(
            (
                ABORT,
                "            if self.blocked:\n                goal_handle.succeed()\n                break\n" + ABORT,
            )
        ),
        {"blocked", "blocked_before", "stops_while_blocked"},
    ),
    "step period is fixed": (server(("sleep(period)", "sleep(1.0)")), {"step_period"}),
    "a goal's last step takes no time": (
        server((SLEEP, "            time.sleep(0 if len(left) == 1 and abs(left[0] - self.floor) == 1 else period)\n")),
        {"step_period"},
    ),
    "a step down takes half of its time": (
        server((SLEEP, "            time.sleep(period if left[0] > self.floor else 0.5 * period)\n")),
        {"step_period"},
    ),
    "a step takes less than half of its time": (server(("sleep(period)", "sleep(0.4 * period)")), {"step_period"}),
    "a step takes twice its time": (server(("sleep(period)", "sleep(2 * period)")), {"step_period"}),
    "a step takes whole tenths of a second": (
        server(("sleep(period)", "sleep(max(1, int(period / 0.1)) * 0.1)")),
        {"step_period"},
    ),
    "a step takes a tenth of a second at least": (
        server(("sleep(period)", "sleep(max(0.1, period))")),
        {"step_period"},
    ),
    "reports a step before its time": (server((SLEEP, ""), (PUBLISH, PUBLISH + SLEEP)), {"step_period"}),
    "a cancel cuts its step short, and the cabin moves": (
        server(
            (
                SLEEP,
                """            until = time.monotonic() + period
            while time.monotonic() < until and not goal_handle.is_cancel_requested:
                time.sleep(0.01)
""",
            )
        ),
        {"step_period"},
    ),
    "another default": (server(("'step_period', 1.0", "'step_period', 0.1")), {"step_period"}),
    "client sends the floors sorted": (
        client(("Goal(floors=floors)", "Goal(floors=sorted(floors)[::-1] + [1])")),
        {"client_sends_floors"},
    ),
    "client refuses floors above 9": (
        client(
            (
                "    rclpy.init(args=args)\n",
                "    if max(options.floors) > 9:\n        return 'no such floor'\n    rclpy.init(args=args)\n",
            )
        ),
        {"client_sends_floors"},
    ),
    "client refuses floors above 100": (
        client(
            (
                "    rclpy.init(args=args)\n",
                "    if max(options.floors) > 100:\n        parser.error('no such floor')\n    rclpy.init(args=args)\n",
            )
        ),
        {"client_sends_floors"},
    ),
    "client takes floors above 9 for 9": (
        client(("Goal(floors=floors)", "Goal(floors=[min(9, floor) for floor in floors])")),
        {"client_sends_floors"},
    ),
    "client sends the goal twice": (
        client(
            (
                "        if not self.goal_handle.accepted:",
                (
                    "        self.client.send_goal_async(Lift.Goal(floors=floors))\n"
                    "        if not self.goal_handle.accepted:"
                ),
            )
        ),
        {"client_sends_floors", "client_shows_feedback"},
    ),
    "client shows no feedback": (client((TOLD, "")), {"client_shows_feedback", "client_shows_feedback_as_it_comes"}),
    "client shows the floor alone": (client((", {now.stops_left} stops left", "")), {"client_shows_feedback"}),
    "client shows no message that is like the one before": (
        client(
            (TOLD, "        if now != self.last:\n    " + TOLD + "        self.last = now\n"),
            ("        self.heard = 0\n", "        self.heard = 0\n        self.last = None\n"),
        ),
        {"client_shows_feedback"},
    ),
    "client shows no message with 0 stops left": (
        client((TOLD, "        if now.stops_left:\n    " + TOLD)),
        {"client_shows_feedback"},
    ),
    "client shows no feedback after its cancel": (
        client(
            (TOLD, "        if not self.over:\n    " + TOLD),
            (CANCELS, CANCELS + "            self.over = True\n"),
            ("        self.heard = 0\n", "        self.heard = 0\n        self.over = False\n"),
        ),
        {"client_shows_feedback"},
    ),
    "client shows the feedback at the end": (
        client(
            ("print(f'Feedback: floor {now.floor}, {now.stops_left} stops left')", "self.story.append(now)"),
            ("        self.heard = 0\n", "        self.heard = 0\n        self.story = []\n"),
            ("        print(f'Result", "        print('Feedback:', self.story)\n        print(f'Result"),
        ),
        {"client_shows_feedback_as_it_comes"},
    ),
    "client shows each message when the next one comes": (
        client(
            (TOLD, "        if self.last:\n            print('Feedback:', self.last)\n        self.last = now\n"),
            ("        self.heard = 0\n", "        self.heard = 0\n        self.last = None\n"),
            ("        print(f'Result", "        print('Feedback:', self.last)\n        print(f'Result"),
        ),
        {"client_shows_feedback_as_it_comes"},
    ),
    "client shows no result": (client((SHOWN, "")), {"client_shows_result"}),
    "client shows the result of a success alone": (
        client((SHOWN, "        if end.status == GoalStatus.STATUS_SUCCEEDED:\n    " + SHOWN)),
        {"client_shows_result"},
    ),
    "client shows the result with stops alone": (
        client((SHOWN, "        if end.result.stops:\n    " + SHOWN)),
        {"client_shows_result"},
    ),
    "client shows the stops of the result alone": (
        client((", now at {end.result.floor}", "")),
        {"client_shows_result"},
    ),
    "client shows the stops of the result from the last to the first": (
        client(("stops {list(end.result.stops)}", "stops {list(end.result.stops)[::-1]}")),
        {"client_shows_result"},
    ),
    "client sorts the stops of the result": (
        client(("stops {list(end.result.stops)}", "stops {sorted(end.result.stops)}")),
        {"client_shows_result"},
    ),
    "client names every outcome, and the right one last": (
        client((SAYS, "    print('SUCCEEDED, CANCELED, ABORTED or REJECTED:', outcome)\n")),
        {"client_says_outcome"},
    ),
    "client says goodbye after the outcome": (
        client((SAYS, SAYS + "    print('Good bye')\n")),
        {"client_says_outcome"},
    ),
    "client shows no outcome": (
        client((SAYS, "")),
        {"client_says_outcome", "client_waits_for_the_end", "client_without_server"},
    ),
    "client names every outcome": (
        client((SAYS, "    print('Outcome:', outcome, 'of REJECTED, ABORTED, CANCELED, SUCCEEDED')\n")),
        {"client_says_outcome"},
    ),
    "client says CANCELED, ABORTED or REJECTED for every end but a success": (
        client(
            (SAYS, "    print('Outcome:', outcome if outcome == 'SUCCEEDED' else 'CANCELED, ABORTED or REJECTED')\n")
        ),
        {"client_says_outcome", "client_without_server"},
    ),
    "client says ABORTED for a cancelled goal": (
        client(("CANCELED: 'CANCELED'", "CANCELED: 'ABORTED'")),
        {"client_says_outcome"},
    ),
    "client always exits with 0": (client((FAILS, "return 0")), {"client_exit_status", "client_without_server"}),
    "client never exits with 0": (client((FAILS, "return 1")), {"client_exit_status", "client_waits_for_the_end"}),
    "client exits with 0 when its goal was cancelled": (
        client((FAILS, "return 0 if outcome in ('SUCCEEDED', 'CANCELED') else 1")),
        {"client_exit_status"},
    ),
    "client exits with 0 when its goal was aborted": (
        client((FAILS, "return 0 if outcome in ('SUCCEEDED', 'ABORTED') else 1")),
        {"client_exit_status"},
    ),
    "client takes every end for a success": (
        client(("OUTCOMES.get(end.status, 'UNKNOWN')", "'SUCCEEDED'")),
        {"client_says_outcome", "client_exit_status"},
    ),
    "client does not look whether it is accepted": (
        client(("        if not self.goal_handle.accepted:\n            return 'REJECTED'\n", "")),
        {"client_says_outcome"},
    ),
    "client prints an empty result of a goal that is rejected": (
        client(
            (
                """        if not self.goal_handle.accepted:
            return 'REJECTED'
        self.cancel_when_heard()
        end = self.wait_for(self.goal_handle.get_result_async())
        print(f'Result: stops {list(end.result.stops)}, now at {end.result.floor}')
        return OUTCOMES.get(end.status, 'UNKNOWN')
""",
                """        result, outcome = Lift.Result(), 'REJECTED'
        if self.goal_handle.accepted:
            self.cancel_when_heard()
            end = self.wait_for(self.goal_handle.get_result_async())
            result, outcome = end.result, OUTCOMES.get(end.status, 'UNKNOWN')
        print(f'Result: stops {list(result.stops)}, now at {result.floor}')
        return outcome
""",
            )
        ),
        {"client_says_outcome"},
    ),
    "client is ended by a signal when it has said everything": (
        client(("import sys\n", "import os\nimport sys\n"), ("    sys.exit(main())", "    main()\n    os.abort()")),
        {"client_exit_status", "client_waits_for_the_end", "client_without_server"},
    ),
    "client cancels one too late": (
        client(
            (DUE, "due = self.cancel_after == 0 or (self.cancel_after is not None and self.heard > self.cancel_after)")
        ),
        {"client_cancels"},
    ),
    "client cancels one too early": (
        client(("self.heard >= self.cancel_after", "self.heard >= self.cancel_after - 1")),
        {"client_cancels"},
    ),
    "client cancels after N seconds": (
        client(
            ("        self.heard += 1\n        self.cancel_when_heard()\n", ""),
            (
                "        self.cancel_when_heard()\n",
                (
                    "        if self.cancel_after is not None:\n"
                    "            self.timer = self.create_timer(max(0.01, self.cancel_after), self.cancel_when_heard)\n"
                ),
            ),
            (" and self.heard >= self.cancel_after", ""),
        ),
        {"client_cancels"},
    ),
    "client cancels after 0.15 s for each of N messages": (
        client(
            ("        self.heard += 1\n        self.cancel_when_heard()\n", ""),
            (
                "        self.cancel_when_heard()\n",
                (
                    "        if self.cancel_after is not None:\n"
                    "            period = max(0.01, 0.15 * self.cancel_after)\n"
                    "            self.timer = self.create_timer(period, self.cancel_when_heard)\n"
                ),
            ),
            (" and self.heard >= self.cancel_after", ""),
        ),
        {"client_cancels"},
    ),
    "client never cancels": (client((CANCELS, "")), {"client_cancels", "client_cancels_at_once"}),
    "client takes --cancel-after 0 for never": (
        client((DUE, "due = self.cancel_after and self.heard >= self.cancel_after")),
        {"client_cancels_at_once"},
    ),
    "client takes --cancel-after 0 for 1": (
        client((DUE, "due = self.cancel_after is not None and self.heard >= max(1, self.cancel_after)")),
        {"client_cancels_at_once"},
    ),
    "a goal for the floor where the cabin is does not take over": (
        server(
            (
                "        self.newest = goal_handle\n",
                """        if any(floor != self.floor for floor in goal_handle.request.floors):
            self.newest = goal_handle
""",
            )
        ),
        {"preempt_waiting"},
    ),
    "a goal waits while the shaft is blocked": (
        server(
            (
                "        self.stop(stops, left)\n        while left:\n",
                """        self.stop(stops, left)
        while self.blocked and not stops and self.newest is goal_handle and not goal_handle.is_cancel_requested:
            time.sleep(0.02)
        while left:
""",
            )
        ),
        {"blocked_before"},
    ),
    "client leaves out floor 0": (
        client(("Lift.Goal(floors=floors)", "Lift.Goal(floors=[floor for floor in floors if floor])")),
        {"client_sends_floors"},
    ),
    "client sends each floor once": (
        client(("Lift.Goal(floors=floors)", "Lift.Goal(floors=list(dict.fromkeys(floors)))")),
        {"client_sends_floors"},
    ),
    "client does not wait for the end of a cancelled goal": (
        client(
            (
                CANCELS,
                "            self.wait = self.goal_handle.cancel_goal_async()\n            sys.exit('CANCELED')\n",
            )
        ),
        {"client_shows_result", "client_waits_for_the_end"},
    ),
    "client says CANCELED whenever it has cancelled": (
        client(
            (CANCELS, CANCELS + "            self.over = True\n"),
            ("        self.heard = 0\n", "        self.heard = 0\n        self.over = False\n"),
            (
                "        return OUTCOMES",
                "        if self.over:\n            return 'CANCELED'\n        return OUTCOMES",
            ),
        ),
        {"client_waits_for_the_end"},
    ),
    "client says CANCELED or ABORTED by whether it has cancelled": (
        client(
            (CANCELS, CANCELS + "            self.over = True\n"),
            ("        self.heard = 0\n", "        self.heard = 0\n        self.over = False\n"),
            (
                "        return OUTCOMES",
                (
                    "        if end.status != GoalStatus.STATUS_SUCCEEDED:\n"
                    "            return 'CANCELED' if self.over else 'ABORTED'\n        return OUTCOMES"
                ),
            ),
        ),
        {"client_waits_for_the_end"},
    ),
    "client shows no message that comes before the answer to its goal": (
        client((TOLD, "        if self.goal_handle:\n    " + TOLD)),
        {"client_shows_feedback"},
    ),
    "client counts no message that comes before the answer to its goal": (
        client(("        self.heard += 1\n", "        self.heard += self.goal_handle is not None\n")),
        {"client_cancels"},
    ),
    "client does not cancel when all N messages came before the answer to its goal": (
        client(
            ("self.heard >= self.cancel_after", "self.heard == self.cancel_after"),
            (
                "        self.cancel_when_heard()\n        end = ",
                "        if self.cancel_after == 0:\n            self.cancel_when_heard()\n        end = ",
            ),
        ),
        {"client_cancels"},
    ),
    "client says CANCELLED": (
        client((SAYS, SAYS.replace("outcome)", "outcome.replace('CANCELED', 'CANCELLED'))"))),
        {"client_says_outcome"},
    ),
    "client waits 2 s for the end of a goal that it has cancelled": (
        client(
            ("import sys\n", "import sys\nimport time\n"),
            (CANCELS, CANCELS + "            self.until = time.monotonic() + 2.0\n"),
            ("        self.heard = 0\n", "        self.heard = 0\n        self.until = float('inf')\n"),
            (
                "        end = self.wait_for(self.goal_handle.get_result_async())\n",
                (
                    "        future = self.goal_handle.get_result_async()\n"
                    "        while not future.done():\n"
                    "            rclpy.spin_once(self, timeout_sec=0.1)\n"
                    "            if time.monotonic() > self.until:\n"
                    "                return 'CANCELED'\n"
                    "        end = future.result()\n"
                ),
            ),
        ),
        {"client_waits_for_the_end"},
    ),
    "client exits with 1 when it was to cancel": (
        client((FAILS, "return 0 if outcome == 'SUCCEEDED' and options.cancel_after is None else 1")),
        {"client_waits_for_the_end"},
    ),
    "client gives up after 8 s, and says that its goal was aborted": (
        client(
            (
                "        end = self.wait_for(self.goal_handle.get_result_async())\n",
                (
                    "        future = self.goal_handle.get_result_async()\n"
                    "        rclpy.spin_until_future_complete(self, future, timeout_sec=8.0)\n"
                    "        if not future.done():\n            return 'ABORTED'\n"
                    "        end = future.result()\n"
                ),
            )
        ),
        {"client_waits_for_the_end"},
    ),
    "client waits 5 s for the end of its goal": (
        client(
            (
                "rclpy.spin_until_future_complete(self, future)",
                "rclpy.spin_until_future_complete(self, future, None, 5.0)",
            )
        ),
        {"client_waits_for_the_end"},
    ),
    "client waits for N messages for ever": (
        client(
            (
                "        end = self.wait_for(self.goal_handle.get_result_async())\n",
                (
                    "        end = self.goal_handle.get_result_async()\n"
                    "        while self.cancel_after is not None:\n            rclpy.spin_once(self)\n"
                    "        end = self.wait_for(end)\n"
                ),
            )
        ),
        {"client_waits_for_the_end"},
    ),
    "client waits for a server for ever": (client(("timeout_sec=1.5", "timeout_sec=None")), {"client_without_server"}),
    "client says nothing without a server": (
        client(("            return 'NO SERVER for /lift'", "            sys.exit(1)")),
        {"client_without_server"},
    ),
    "client says ABORTED without a server": (client(("'NO SERVER for /lift'", "'ABORTED'")), {"client_without_server"}),
    "client ends by an exception without a server": (
        client(("return 'NO SERVER for /lift'", "raise RuntimeError('no server for /lift')")),
        {"client_without_server"},
    ),
    "client prints a dash without a server": (
        client(("            return 'NO SERVER for /lift'", "            sys.exit('-')")),
        {"client_without_server"},
    ),
    "client says REJECTED without a server": (
        client(("'NO SERVER for /lift'", "'REJECTED'")),
        {"client_without_server"},
    ),
    "client has no usage": (client((PARSED, UNCHECKED)), {"client_arguments"}),
    "client takes what is meant for ROS for its own": (client(("remove_ros_args(args)[1:]", "")), {"client_arguments"}),
    "client refuses what is meant for ROS": (
        client(
            (
                "    rclpy.init(args=args)\n",
                "    if '--ros-args' in sys.argv:\n        return 'unknown argument'\n    rclpy.init(args=args)\n",
            )
        ),
        {"client_arguments"},
    ),
    "client takes any word for 10": (
        client(("type=int,", "type=lambda word: int(word) if word.isdigit() else 10,"), ("nargs='+'", "nargs='*'")),
        {"client_arguments"},
    ),
    "client takes any word after --cancel-after for 1": (
        client(
            ("'--cancel-after', type=int", "'--cancel-after', type=lambda word: int(word) if word.isdigit() else 1")
        ),
        {"client_arguments"},
    ),
}

NOTHING = {
    "refuses everything; a client that says no",
    "every goal is aborted at once; a client that says SUCCEEDED",
    "every goal succeeds at once; a client that says REJECTED",
    "a goal succeeds at once with what was asked for; a client that says all",
    "no goal ever ends; a client that says no",
}
SEVERAL = {"the chapter's programs"}
USELESS = {"another name", "another type", "never begins an accepted goal", "waits where it should move"}
SILENT = {
    "another name",
    "no goal ever ends; a client that says no",
    "client waits for a server for ever",
    "client waits for N messages for ever",
}
# Judged by the whole suite in every run of the tests: what is right, and partial credit of each kind.
QUICK = {"reference"}

# Mistakes in what the exercise is about, and mistakes in a detail: `test_weights.py` holds what each costs.
ABOUT = {
    "no cancel callback",
    "never looks for a cancel",
    "rejects while it is busy",
    "goals wait for the one that runs",
    "goals move the cabin side by side",
    "notes the newest goal when it begins to move",
    "preempts and does not wait for the cabin",
    "waits for the cabin for half a step",
    "waits for the cabin for half a second",
    "begins where the cabin was when the goal came",
    "preempts a goal at its next stop alone",
    "goes on for two steps when a new goal comes",
    "makes one more step when a new goal comes",
    "one thread",
}
# Each breaks most of what the exercise is about with one line; the page's public checks fail.
BROAD = {"one thread", "returns no result"}
DETAIL = {
    "notes a floor that it passes as a stop",
    "feedback at stops alone",
    "a message for each stop, too",
    "stops_left counts the one just made",
    "does not say that it succeeded",
    "starts at floor 1",
    "a stop takes a step",
    "counts a stop as left that is made twice at once",
    "accepts floors below 0",
    "rejects the top",
    "another default of the top",
    "cancelled goal has an empty result",
    "cancelled goal is aborted",
    "cancelled goal succeeds",
    "refuses to cancel a goal that waits",
    "makes the stops that are due before it has the cabin",
    "a preempted goal succeeds",
    "a goal that is replaced while it waits makes a step",
    "a goal that gives up waiting counts as one that has stopped",
    "takes a goal for the same floors for the same goal",
    "rejects while it is blocked",
    "each call blocks what is free, and frees what is blocked",
    "success says whether the shaft is blocked",
    "block is answered a step later",
    "aborted goal has an empty result",
    "a goal that a new one aborts in its last step has an empty result",
    "step period is fixed",
    "another default",
    "reports a step before its time",
    "a cancel cuts its step short, and the cabin moves",
    "client sends the goal twice",
    "client refuses floors above 9",
    "client shows the feedback at the end",
    "client shows the result of a success alone",
    "client says ABORTED for a cancelled goal",
    "client always exits with 0",
    "client takes every end for a success",
    "client prints an empty result of a goal that is rejected",
    "client cancels one too late",
    "client takes --cancel-after 0 for never",
    "client says CANCELED whenever it has cancelled",
    "client says CANCELED or ABORTED by whether it has cancelled",
    "client shows no message that comes before the answer to its goal",
    "client counts no message that comes before the answer to its goal",
    "client does not cancel when all N messages came before the answer to its goal",
    "client says CANCELLED",
    "a block counts only while a goal runs",
    "to block a blocked shaft frees it when no goal runs",
    "client waits for a server for ever",
    "client has no usage",
    "client takes what is meant for ROS for its own",
}

# Judged as one program each in every run of the tests, see the package.
TOGETHER = [
    {
        "feedback at stops alone",
        "a stop takes a step",
        "accepts no floors",
        "whatever is asked for preempts",
        "each block aborts a goal, also when the shaft is free again",
    },
    {
        "notes a floor that it passes as a stop",
        "refuses to cancel a goal that another one takes over from",
        "aborts every goal while it is blocked",
    },
    {"starts at floor 1", "a step takes a second at most", "a preempted goal that has made a stop succeeds"},
    {"a block puts the cabin back to where its goal began", "cancelled goal has an empty result"},
    {
        "makes the stops that are due before it has the cabin",
        "to block waits until nobody moves",
        "client says CANCELED whenever it has cancelled",
    },
    {
        "ends 0.7 s after a cancel",
        "client sends the floors sorted",
        "client shows the floor alone",
        "client shows no result",
        "client names every outcome, and the right one last",
        "client cancels one too late",
        "client says nothing without a server",
        "client has no usage",
    },
    {
        "waits for the cabin for half a second",
        "client shows the feedback at the end",
        "client exits with 0 when its goal was cancelled",
        "client takes --cancel-after 0 for never",
    },
]
