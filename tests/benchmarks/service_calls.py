"""Service round trips in the live session against the chapter's spin-until-complete loop: python service_calls.py

Prints the median of the first and of the last 100 of 1,500 calls, both measured in this run against one server in a
process of its own, and their ratio.
"""

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import rclpy
from example_interfaces.srv import AddTwoInts

import course

CALLS = 1500
SERVER = """
import rclpy
from example_interfaces.srv import AddTwoInts

def add(request, response):
    response.sum = request.a + request.b
    return response

rclpy.init()
node = rclpy.create_node('adder')
node.create_service(AddTwoInts, 'add_two_ints', add)
try:
    rclpy.spin(node)
except BaseException:
    pass
"""


def milliseconds(call: Callable[[], object]) -> tuple[float, float]:
    """Medians (ms) of the first and the last 100 of the calls."""
    times = []
    for _ in range(CALLS):
        start = time.perf_counter()
        call()
        times.append(1e3 * (time.perf_counter() - start))
    return statistics.median(times[:100]), statistics.median(times[-100:])


def main() -> None:
    ros = course.live()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "adder.py"
        path.write_text(SERVER)
        ros.start(path)
        request = AddTwoInts.Request(a=2, b=3)
        live = milliseconds(lambda: ros.call("add_two_ints", AddTwoInts, request))

        rclpy.init()
        node = rclpy.create_node("chapter")
        client = node.create_client(AddTwoInts, "add_two_ints")
        client.wait_for_service()
        chapter = milliseconds(lambda: rclpy.spin_until_future_complete(node, client.call_async(request)))
        node.destroy_node()
        rclpy.shutdown()
        ros.close()
    print(f"{'':24}first 100   last 100 of {CALLS} calls")
    for name, (first, last) in (("live session", live), ("spin until complete", chapter)):
        print(f"{name:24}{first:6.2f} ms  {last:6.2f} ms")
    print(f"{'ratio':24}{chapter[0] / live[0]:6.1f}     {chapter[1] / live[1]:6.1f}")


if __name__ == "__main__":
    main()
