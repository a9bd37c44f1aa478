"""Live nodes in a ROS domain of their own, and a way to run the command against them as a reader does."""

import contextlib
import json
import os
import select
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import pytest

from course.environment import prepare
from course.foundation.waiting import wait_until
from course.session.domains import claim_domain

HERE = Path(__file__).parent
SECONDS = 60  # s until a command that should have ended is killed


class Forked:
    """A command line in a fork of `Loaded`, used as a `subprocess.Popen`."""

    def __init__(self, words: Sequence[str], report: int, stdout: int, stderr: int) -> None:
        self.args, self.returncode = words, None
        self.stdout, self.stderr = os.fdopen(stdout), os.fdopen(stderr)
        self.report = os.fdopen(report, "rb", buffering=0)
        self.pid = int(self.report.readline())

    def wait(self, timeout: float = SECONDS) -> int:
        """Return its status, once it has ended."""
        if self.returncode is None:
            if not select.select([self.report], [], [], timeout)[0]:
                raise subprocess.TimeoutExpired(self.args, timeout)
            with self.report:
                self.returncode = int(self.report.readline())
        return self.returncode

    def poll(self) -> int | None:
        """Return its status if it has ended."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            return self.wait(0)
        return None

    def send_signal(self, number: int) -> None:
        """Send it a signal, if it runs."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def terminate(self) -> None:
        """Ask it to end."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """End it."""
        self.send_signal(signal.SIGKILL)

    def communicate(self, timeout: float = SECONDS) -> tuple[str, str]:
        """Return the rest of what it says, up to its end."""
        with self.stdout, self.stderr, ThreadPoolExecutor(2) as pool:
            said = [pool.submit(stream.read) for stream in (self.stdout, self.stderr)]
            try:
                self.wait(timeout)
            except subprocess.TimeoutExpired:
                self.kill()
                raise
            return said[0].result(), said[1].result()


class Loaded:
    """The process of `loaded.py`, whose forks run command lines: what takes longest is loaded once for all of them."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        self.started: set[tuple[str, ...]] = set()  # the verbs that were run in the ordinary way
        self.control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            program = [sys.executable, str(HERE / "loaded.py"), str(theirs.fileno())]
            self.process = subprocess.Popen(program, pass_fds=[theirs.fileno()], env=environment, cwd=HERE.parents[1])

    def start(
        self, words: Sequence[str], stdin: str, folder: Path | str | None, environment: Mapping[str, str]
    ) -> Forked:
        """Start a command line."""
        request = json.dumps({"words": words, "folder": str(folder or Path.cwd()), "variables": environment})
        pipes = [os.pipe() for _ in range(3)]
        with tempfile.TemporaryFile() as given:
            given.write(stdin.encode())
            given.seek(0)
            (report, told), (stdout, said), (stderr, erred) = pipes
            socket.send_fds(self.control, [request.encode()], [given.fileno(), said, erred, told])
        for _, writing in pipes:
            os.close(writing)
        return Forked(words, report, stdout, stderr)

    def close(self) -> None:
        """End it."""
        self.control.close()
        self.process.wait()


@dataclass
class Command:
    """The `ros2` command in one environment; with `loaded`, only the first of each verb is a program of its own."""

    environment: dict[str, str]
    loaded: Loaded | None = None

    def words(self, *words: str) -> list[str]:
        """Return the whole command line."""
        script = shutil.which("ros2", path=str(Path(sys.executable).parent))
        return [*([script] if script else [sys.executable, "-m", "course.ros2.main"]), *words]

    def __call__(self, *words: str, stdin: str = "", cwd=None, **environment: str) -> subprocess.CompletedProcess:
        """Run it to its end."""
        variables = {**self.environment, **environment}
        if self._forks(words, environment):
            child = self.loaded.start(self.words(*words), stdin, cwd, variables)
            said = child.communicate()
            return subprocess.CompletedProcess(child.args, child.returncode, *said)
        return subprocess.run(
            self.words(*words), input=stdin, capture_output=True, text=True, timeout=SECONDS, cwd=cwd, env=variables
        )

    def _forks(self, words: Sequence[str], environment: Mapping[str, str]) -> bool:
        """Return True if this is not the first of its verb; what Python reads at its start is for a program."""
        if not self.loaded or any(name.startswith("PYTHON") for name in environment):
            return False
        before = words[:2] in self.loaded.started
        self.loaded.started.add(words[:2])
        return before

    def output(self, *words: str, **more) -> str:
        """Run it; return its output, which must be all that it says."""
        done = self(*words, **more)
        assert (done.returncode, done.stderr) == (0, ""), done
        return done.stdout

    def each(self, *commands: str) -> list[subprocess.CompletedProcess]:
        """Run command lines side by side, which none of them may notice."""
        with ThreadPoolExecutor(len(commands)) as pool:
            return list(pool.map(lambda command: self(*shlex.split(command)), commands))

    def outputs(self, *commands: str) -> list[str]:
        """Run command lines side by side; return the output of each, which must be all that it says."""
        ran = self.each(*commands)
        assert [(done.returncode, done.stderr) for done in ran] == [(0, "")] * len(ran), ran
        return [done.stdout for done in ran]

    def start(self, *words: str, cwd=None) -> subprocess.Popen | Forked:
        """Start it."""
        if self._forks(words, {}):
            return self.loaded.start(self.words(*words), "", cwd, self.environment)
        return subprocess.Popen(
            self.words(*words),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=cwd,
            env=self.environment,
        )

    def interrupted(self, *words: str, after: str, cwd=None) -> tuple[int, str, str]:
        """Start it, press Ctrl-C once it has printed a line with `after`; return its status and all that it said."""
        child = self.start(*words, cwd=cwd)
        said = ""
        try:
            for line in child.stdout:
                said += line
                if after in line:
                    break
            child.send_signal(signal.SIGINT)
            rest, errors = child.communicate(timeout=SECONDS)
        finally:
            child.kill()
            child.wait()
        return child.returncode, said + rest, errors


@pytest.fixture(scope="session")
def domains() -> Iterator[tuple[int, int]]:
    """Two ROS domains that nobody else takes meanwhile: one for the live nodes, one without any node."""
    claims, found = zip(*(claim_domain() for _ in range(2)), strict=True)
    yield found
    for claim in claims:
        claim.close()


@pytest.fixture(scope="session")
def environment(tmp_path_factory, domains) -> dict[str, str]:
    """The environment of the tests' processes: a domain of their own, and no settings of the caller's."""
    prepare()
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("ROS_", "RMW_", "FASTDDS_"))}
    kept.pop("PYTHONUNBUFFERED", None)
    system = [folder for folder in os.environ["PATH"].split(os.pathsep) if not Path(folder, "ros2").exists()]
    return {
        **kept,
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), *system]),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(domains[0]),
        "COLUMNS": "200",
        "XDG_RUNTIME_DIR": str(tmp_path_factory.mktemp("run")),  # no session of this machine is known there
    }


@pytest.fixture(scope="session")
def live(environment):
    """The nodes of `live_nodes.py`, up until the tests end."""
    child = subprocess.Popen(
        [sys.executable, str(HERE / "live_nodes.py")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    )
    assert child.stdout.readline() == "ready\n"
    yield
    child.kill()
    child.wait()


@pytest.fixture(scope="session")
def loaded(environment) -> Iterator[Loaded]:
    """The command, loaded once."""
    process = Loaded(environment)
    yield process
    process.close()


@pytest.fixture(scope="session")
def ros2(environment, live, loaded) -> Command:
    """The command beside the live nodes."""
    return Command(environment, loaded)


@pytest.fixture(scope="session")
def alone(environment, domains, loaded) -> Command:
    """The command in a domain without any node."""
    return Command({**environment, "ROS_DOMAIN_ID": str(domains[1])}, loaded)


@pytest.fixture
def until():
    """A way to wait for what another process does."""

    def wait(ready, seconds: float = SECONDS) -> None:
        assert wait_until(ready, seconds), "it did not happen in time"

    return wait
