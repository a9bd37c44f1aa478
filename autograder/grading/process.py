"""The coordinator's side of a worker process: start it, send it jobs, read its answers, keep it for the next job."""

import atexit
import contextlib
import logging
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from dataclasses import dataclass

from autograder.errors import InfrastructureError
from autograder.records import UNSAFE, Ended, Finished, Job, Verdict, from_line, to_line
from autograder.sandbox.box import BOXES
from autograder.sandbox.variables import ros_variables
from course.environment import prepare

WORKER = f"{__package__}.worker"  # loads ROS 2 and pytest, which this process does not need
LOG_SHOWN = 5000  # bytes at the end of a worker's own log that are shown when it fails

log = logging.getLogger("autograder")


@dataclass(frozen=True)
class Answer:
    """All that a worker said about one job."""

    verdicts: list[Verdict]
    finished: Finished


class Worker:
    """A process that grades one submission at a time, see `worker`."""

    def __init__(self, box: str):
        prepare()
        environment = {
            name: value for name, value in os.environ.items() if not name.startswith(("PYTEST_", "ROS_DOMAIN"))
        }
        environment.update(ros_variables(0, own_network=box != UNSAFE), PYTEST_DISABLE_PLUGIN_AUTOLOAD="1")
        self._log = tempfile.TemporaryFile()  # noqa: SIM115  # closed with the worker
        process = subprocess.Popen(
            [*BOXES[box], sys.executable, "-P", "-m", WORKER],
            env=environment,
            cwd="/",
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            process_group=0,  # Ctrl-C in the terminal is for the coordinator alone
        )
        assert process.stdin and process.stdout  # both are pipes
        self._process, self._jobs, self._answers = process, process.stdin, process.stdout

    def run(self, job: Job, limit: float) -> Answer:
        """What the worker says about `job`.

        Raises InfrastructureError when the worker dies, or has not answered after `limit` s.  After an exception the
        worker cannot be used again.
        """
        self._log.seek(0)
        self._log.truncate()
        verdicts: list[Verdict] = []
        finished: Finished | None = None
        ended: Ended | None = None
        timer = threading.Timer(limit, self._process.kill)
        timer.start()
        try:
            self._jobs.write(to_line(job))
            self._jobs.flush()
            for line in self._answers:
                message = from_line(line)
                if isinstance(message, Verdict):
                    verdicts.append(message)
                elif isinstance(message, Finished):
                    finished = message
                elif isinstance(message, Ended):
                    ended = message
                    break
        except (BrokenPipeError, ValueError) as error:
            log.debug("worker: %s", error)
        finally:
            timer.cancel()
        said = self._last_log()
        for verdict in verdicts:
            log.debug("%s: %s: %s [%s]", verdict.id, verdict.outcome, verdict.message, verdict.detail)
        log.debug("worker: %s", said)
        if finished is None or ended is None or ended.status != 0:
            status = ended.status if ended else None
            raise InfrastructureError(f"the worker ended with status {status} before all tests were judged:\n{said}")
        return Answer(verdicts, finished)

    def _last_log(self) -> str:
        size = os.fstat(self._log.fileno()).st_size
        return os.pread(self._log.fileno(), LOG_SHOWN, max(0, size - LOG_SHOWN)).decode(errors="replace")

    def close(self) -> None:
        """End the process, and the grading that it is doing."""
        self._process.kill()
        self._process.communicate()
        self._log.close()


_idle: dict[str, list[Worker]] = {}  # by box


@contextlib.contextmanager
def worker(box: str) -> Iterator[Worker]:
    """A worker whose programs run in `box`; it is kept for the next submission unless the block raises."""
    idle = _idle.setdefault(box, [])
    try:
        chosen = idle.pop()
    except IndexError:
        chosen = Worker(box)
    try:
        yield chosen
    except BaseException:
        chosen.close()
        raise
    idle.append(chosen)


@atexit.register
def _close_idle() -> None:
    for workers in _idle.values():
        for idle in workers:
            idle.close()
