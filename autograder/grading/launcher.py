"""The worker process: `python -m autograder.grading.launcher CONFINEMENT`, in namespaces of its own.

Reads jobs from stdin.  Each is done by the judging process (`judge_process`), which is confined like the students'
programs, runs the hidden suite and talks to the programs over ROS 2.  The launcher has more rights: it starts the
programs and watches their use of resources, but reads nothing that a student's program has sent.  When a job is done,
it writes Ended, a line of JSON with the messages of the judging process.
"""

import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from autograder.records import UNSAFE, Ended, Job, from_line, to_line
from autograder.sandbox import networks, users
from autograder.sandbox.forkserver import SUPPORTED, Forkserver
from autograder.sandbox.launching import LaunchServer
from autograder.sandbox.machine_load import Load
from autograder.sandbox.sandbox import MEMORY, WATCHED, Sandbox
from autograder.sandbox.supervision import GLANCE
from autograder.sandbox.traffic import WHY, Traffic
from autograder.sandbox.usage import children, of_sandbox, processes, running, takes_more, visible
from course.foundation.processes import processor_time
from course.foundation.waiting import wait_until

JUDGE = f"{__package__}.judge_process"  # loads ROS 2 and pytest, which this process does not need
DOMAINS = 40  # ROS domains of a grading
LOAD = 1.0  # s between two looks at the machine's load, which cost more the busier it is
ORPHANED = 1.0  # s until processes killed with their program are gone


def main() -> None:
    """Do jobs until stdin is closed, which also ends the current one."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # prints go to the log
    launcher = Launcher(sys.argv[1])
    for line in sys.stdin.buffer:
        job = from_line(line)
        assert isinstance(job, Job), f"a worker is sent jobs, not {job}"
        ended = launcher.run(job)
        if ended is None:
            break  # nobody is waiting for the result
        answers.write(to_line(ended))
        answers.flush()


class Launcher:
    """The judging process, and the networks for its programs."""

    def __init__(self, confinement: str):
        self.confinement = confinement
        self._control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with Sandbox(confinement, {}) as sandbox:
            self._judging = subprocess.Popen(
                sandbox.judge_command(["-m", JUDGE, str(theirs.fileno())]),
                pass_fds=(*sandbox.descriptors, theirs.fileno()),
                stdin=subprocess.DEVNULL,
            )
        theirs.close()
        self._forkserver = Forkserver() if confinement == "root" and SUPPORTED else None
        numbers = range(1, DOMAINS + 1)
        self._networks = None if confinement == UNSAFE else dict(zip(numbers, networks.make(DOMAINS), strict=True))
        self._counters = {domain: networks.counter(network) for domain, network in (self._networks or {}).items()}

    def run(self, job: Job) -> Ended | None:
        """Have one job done; None if stdin was closed meanwhile."""
        own, before = Path(job.interfaces) if job.interfaces else None, self._used()
        channel, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        sandbox = Sandbox(self.confinement, job.files, own, job.core, self._forkserver)
        with users.borrowed(self.confinement) as user, sandbox, channel:
            server = LaunchServer(channel, sandbox, self._networks, job.refused)
            with theirs:
                self._hand_over(job, user, theirs)
            ended = self._serve(server, channel, user, job.limit)
        wait_until(self._orphans_are_gone, ORPHANED, alert=False)
        return ended and replace(ended, used=round(self._used() - before, 2))

    def _used(self) -> float:
        """Return the processor time (s) of this process, of those that it keeps, and of all that have ended."""
        kept = {os.getpid(), *self._own(), *processes(self._judging.pid)}
        return sum(processor_time(pid, ended=True) for pid in kept)

    def _orphans_are_gone(self) -> bool:
        """Reap the orphans of programs, as the first process of a namespace must; return True if none is left."""
        if os.getpid() != 1:
            return True
        try:
            return all(os.waitpid(child, os.WNOHANG)[0] for child in children(1) if child not in self._own())
        except OSError:  # a thread or child has ended meanwhile
            return False

    def _own(self) -> set[int]:
        """The processes that are kept from one job to the next."""
        return {self._judging.pid, *([self._forkserver.pid] if self._forkserver else [])}

    def _hand_over(self, job: Job, user: int | None, channel: socket.socket) -> None:
        with tempfile.TemporaryFile() as file:
            file.write(to_line(job))
            file.flush()
            file.seek(0)
            descriptors = [file.fileno(), channel.fileno(), *(self._networks or {}).values()]
            socket.send_fds(self._control, [str(user or "").encode()], descriptors)

    def _serve(self, server: LaunchServer, channel: socket.socket, user: int | None, limit: float) -> Ended | None:
        """Serve the requests of the judging process, which runs as `user`, until it has ended.

        Returns None if stdin is closed before.
        """
        stopped, end, load, traffic = "", time.monotonic() + limit, Load(), Traffic(self._counters)
        look = look_at_load = 0.0  # s of time.monotonic, the next ones
        waiting = [channel, self._control, sys.stdin]
        while True:
            ready = select.select(waiting, [], [], GLANCE)[0]
            if channel in ready and not server.serve():
                waiting.remove(channel)
            elif self._control in ready:
                status = int(self._control.recv(100) or -signal.SIGKILL)
                if channel in waiting:
                    server.finish()
                said, suspects = bytes(server.said).decode(errors="replace"), server.files(traffic.suspicious)
                return Ended(status, said, stopped, suspects, round(load.average, 1))
            elif sys.stdin in ready:
                return None
            if not stopped and time.monotonic() > look:
                look = time.monotonic() + GLANCE
                if time.monotonic() > look_at_load:
                    look_at_load = time.monotonic() + LOAD
                    load.look(lambda: running(_others()))  # no program makes its own machine busy
                for domain in traffic.look(server.in_use()):
                    server.stop(domain, WHY)
                stopped = self._too_much(user, end)
                if stopped:
                    self._control.send(b"end")

    def _too_much(self, user: int | None, end: float) -> str:
        """Return why the judging process must be ended; empty if it need not be."""
        if time.monotonic() > end:
            return "it did not come to an end"
        judging = self._judging.pid
        if takes_more(WATCHED.of_user(user) if user else processes(judging) | of_sandbox(judging), MEMORY):
            return f"it took more than {MEMORY >> 30} GiB of memory"
        return ""


def _others() -> list[int]:
    """Return the processes of this worker, without its first: all that it sees, where it is the first of all."""
    found = visible() if os.getpid() == 1 else processes(os.getpid())
    return [pid for pid in found if pid != os.getpid()]


if __name__ == "__main__":
    main()
