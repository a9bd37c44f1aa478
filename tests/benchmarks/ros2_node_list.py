"""The time of `ros2 node list` on a graph of 20 nodes: `python tests/benchmarks/ros2_node_list.py [--runs N]`.

Prints the median, the fastest and the slowest of the runs, in seconds of wall time, and how many runs saw all nodes;
asserts nothing.  The nodes are 20 in one process, as in a notebook's kernel, and 2 in each of 10 processes.
"""

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path

from course.environment import prepare
from course.ros.graph import participants_here

NODES = 20
PROCESS = """
import sys
import rclpy
from rclpy.executors import SingleThreadedExecutor
rclpy.init()
executor = SingleThreadedExecutor()
nodes = [rclpy.create_node(name) for name in sys.argv[1:]]
for node in nodes:
    executor.add_node(node)
print("ready", flush=True)
executor.spin()
"""


def measure(processes: int, runs: int, discovery: str) -> None:
    """Start the nodes, time the command, print one line."""
    domain = next(domain for domain in range(60, 80) if participants_here(domain) == 0)
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": discovery}
    names = [f"node_{number:02}" for number in range(NODES)]
    children = [
        subprocess.Popen(
            [sys.executable, "-c", PROCESS, *names[start::processes]], env=environment, stdout=subprocess.PIPE
        )
        for start in range(processes)
    ]
    command = shutil.which("ros2", path=str(Path(sys.executable).parent))
    listing = "".join(f"/{name}\n" for name in names)
    times, complete = [], 0
    try:
        for child in children:
            child.stdout.readline()
        for _ in range(runs + 1):
            began = time.perf_counter()
            done = subprocess.run(
                [command, "node", "list"], env=environment, capture_output=True, text=True, timeout=60
            )
            times.append(time.perf_counter() - began)
            complete += done.stdout == listing
    finally:
        for child in children:
            child.kill()
            child.wait()
    times = times[1:]  # the first run fills the caches
    print(
        f"{NODES} nodes in {processes:2} process(es), {discovery:9}: median {statistics.median(times):.2f} s, "
        f"{min(times):.2f} to {max(times):.2f} s; complete in {complete} of {runs + 1} runs"
    )


def main() -> None:
    """Measure both graphs, in a notebook's discovery range and in ROS's default one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=9)
    runs = parser.parse_args().runs
    prepare()
    for discovery in ("LOCALHOST", "SUBNET"):
        for processes in (1, 10):
            measure(processes, runs, discovery)


if __name__ == "__main__":
    main()
