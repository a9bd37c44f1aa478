"""The `ros2` command with its modules loaded: a fork of this process runs each command line that it is sent.

A request is JSON, the words, the variables and the folder, with the descriptors of the three standard streams and of a
pipe for the answer: the number of the process, and at its end the status.
"""

import gc
import importlib
import json
import os
import select
import signal
import socket
import sys

from autograder.sandbox.forkserver import LOADED, Tracing
from course.ros2 import main

LONGEST = 1 << 17  # bytes of a request
STREAMS = 3


def serve(control: socket.socket) -> None:
    """Fork for each request until nobody can send one any more; return in the forks alone."""
    tracing, running = Tracing(), {}
    while True:
        for ready in select.select([control, *running], [], [])[0]:
            if ready is not control:
                child, report = running.pop(ready)
                os.write(report, f"{os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])}\n".encode())
                os.close(report)
                os.close(ready)
                continue
            message, descriptors, _, _ = socket.recv_fds(control, LONGEST, STREAMS + 1)
            if not message:
                os._exit(0)
            if not (child := tracing.fork()):
                for opened in (control.detach(), *running, *(report for _, report in running.values())):
                    os.close(opened)
                become(json.loads(message), descriptors)
                tracing.begin()
                return
            os.write(descriptors[-1], f"{child}\n".encode())
            running[os.pidfd_open(child)] = child, descriptors.pop()
            for descriptor in descriptors:
                os.close(descriptor)


def become(request: dict, descriptors: list[int]) -> None:
    """Take the streams, the variables, the folder and the words of a request."""
    for stream, descriptor in enumerate(descriptors[:STREAMS]):
        os.dup2(descriptor, stream)
    for descriptor in descriptors:
        os.close(descriptor)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.environ.clear()
    os.environ.update(request["variables"])
    os.chdir(request["folder"])
    sys.argv = request["words"]


if __name__ == "__main__":
    for module in (*LOADED.split(), *(f"course.ros2.{main.ALIASES.get(name, name)}" for name in main.COMMANDS)):
        importlib.import_module(module)
    gc.freeze()
    serve(socket.socket(fileno=int(sys.argv[1])))
    sys.exit(main.main())
