"""The coordinator's side of a worker process: start it, send it jobs, read its answers, keep it for the next job."""

import atexit
import contextlib
import logging
import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from dataclasses import dataclass

from autograder.errors import InfrastructureError, JudgeDied
from autograder.records import UNSAFE, Ended, Finished, Job, Message, Verdict, from_line, to_line
from autograder.sandbox.cleaning import CONTROL
from autograder.sandbox.sandbox import CONFINEMENTS
from autograder.sandbox.usage import children
from autograder.sandbox.variables import ros_variables
from course.environment import prepare

WORKER = f"{__package__}.launcher"
GRACE = 30.0  # s that a worker may take beyond the limit of a job
DEATHS = {getattr(signal, f"SIG{name}") for name in ("SEGV", "ABRT", "BUS", "ILL", "FPE", "TRAP", "SYS")}
LOG_SHOWN = 5000  # bytes at the end of a worker's own log that are shown when it fails

log = logging.getLogger("autograder")


@dataclass(frozen=True)
class Answer:
    """A worker's answer to one job."""

    verdicts: list[Verdict]
    finished: Finished
    busy: float  # see Ended
    used: float  # see Ended


class Worker:
    """A process that grades one submission at a time, see `worker`."""

    def __init__(self, confinement: str):
        prepare()
        self._confinement = confinement
        environment = {
            name: value for name, value in os.environ.items() if not name.startswith(("PYTEST_", "ROS_DOMAIN"))
        }
        environment.update(ros_variables(0, own_network=confinement != UNSAFE), PYTEST_DISABLE_PLUGIN_AUTOLOAD="1")
        self._log = tempfile.TemporaryFile()  # noqa: SIM115  # closed with the worker
        process = subprocess.Popen(
            [*CONFINEMENTS[confinement], sys.executable, "-P", "-m", WORKER, confinement],
            env=environment,
            cwd="/",
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            process_group=0,  # Ctrl-C in the terminal is for the coordinator alone
        )
        assert process.stdin and process.stdout  # both are pipes
        self._process, self._jobs, self._answers = process, process.stdin, process.stdout

    def run(self, job: Job) -> Answer:
        """Have the worker do `job`; return its answer.

        Raises JudgeDied when the judging process died or had to be ended, and InfrastructureError when the worker died
        or did not answer in time.  After an exception the worker cannot be used again.
        """
        self._log.seek(0)
        self._log.truncate()
        ended: Message | None = None
        timer = threading.Timer(job.limit + GRACE, self._kill)
        timer.start()
        try:
            self._jobs.write(to_line(job))
            self._jobs.flush()
            ended = from_line(self._answers.readline())
        except (BrokenPipeError, ValueError) as error:
            log.debug("worker: %s", error)
        finally:
            timer.cancel()
        verdicts, finished = _read(ended.said) if isinstance(ended, Ended) else ([], None)
        said = self._last_log()
        for verdict in verdicts:
            log.debug("%s: %s: %s [%s]", verdict.id, verdict.outcome, verdict.message, verdict.detail)
        log.debug("worker: %s", said)
        if isinstance(ended, Ended) and (ended.stopped or -ended.status in DEATHS):
            why = ended.stopped or f"{signal.Signals(-ended.status).name}"
            raise JudgeDied(f"{said}\nthe process that judges was ended: {why}", verdicts, ended.suspects, ended.busy)
        if finished is None or not isinstance(ended, Ended) or ended.status != 0:
            status = ended.status if isinstance(ended, Ended) else None
            raise InfrastructureError(
                f"the worker ended with status {status} before all tests were judged:\n{said}",
                verdicts,
                ended.busy if isinstance(ended, Ended) else 0.0,
            )
        return Answer(verdicts, finished, ended.busy, ended.used)

    def _kill(self) -> None:
        """End the worker by killing the child of `unshare`, the first process of the worker's namespace.

        `unshare` reaps it.  If `unshare` were killed first, the machine's first process would have to, which in a
        container may not do so: the child would stay a zombie.
        """
        inside: list[int] = []
        if self._confinement != UNSAFE:
            with contextlib.suppress(OSError):
                inside = children(self._process.pid)
        for pid in inside:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        if not inside:  # not begun yet, or there is no `unshare`
            self._process.kill()

    def _last_log(self) -> str:
        size = os.fstat(self._log.fileno()).st_size
        said = os.pread(self._log.fileno(), LOG_SHOWN, max(0, size - LOG_SHOWN)).decode(errors="replace")
        return CONTROL.sub("", said)  # a judging process that was taken over can write there, too

    def close(self) -> None:
        """End the worker, and the grading that it is doing."""
        self._kill()
        self._process.communicate()
        self._log.close()


def _read(said: str) -> tuple[list[Verdict], Finished | None]:
    """Return the messages of the judging process, without those that are neither Verdict nor Finished."""
    verdicts: list[Verdict] = []
    finished = None
    for line in said.splitlines():
        with contextlib.suppress(ValueError):
            message = from_line(line.encode(errors="replace"))
            if isinstance(message, Verdict):
                verdicts.append(message.cut())
            elif isinstance(message, Finished):
                finished = message
    return verdicts, finished


_idle: dict[str, list[Worker]] = {}  # by confinement


@contextlib.contextmanager
def worker(confinement: str) -> Iterator[Worker]:
    """A worker whose programs run in `confinement`; it is kept for the next submission unless the block raises."""
    idle = _idle.setdefault(confinement, [])
    try:
        chosen = idle.pop()
    except IndexError:
        chosen = Worker(confinement)
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
