"""A check of the sandbox's layers on this machine: a program in the sandbox tries each of them."""

import importlib.util
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from autograder import paths
from autograder.errors import SandboxError, SandboxUnavailable
from autograder.sandbox import cgroup, networks, seccomp, users, view
from autograder.sandbox.forkserver import LOADED, SUPPORTED, Forkserver
from autograder.sandbox.program import Program
from autograder.sandbox.sandbox import CONFINEMENTS, LIMITS, Sandbox, choose
from autograder.sandbox.variables import ros_prefixes

PROBE = """
import ctypes, importlib.util, json, os, resource, socket

def error(action):
    try:
        action()
    except OSError as error:
        return type(error).__name__
    return ''

def call(number, *arguments):
    ctypes.set_errno(0)
    return ctypes.get_errno() if libc.syscall(number, *arguments) == -1 else 0

def unexpected(folder):
    # What can be seen in a folder that is not in EXPECTED, nor the way there.
    names = [] if error(lambda: os.listdir(folder)) else os.listdir(folder)
    for path in (os.path.join(folder, name) for name in names):
        if path not in EXPECTED:
            if any(place.startswith(path + '/') for place in EXPECTED) and not os.path.islink(path):
                yield from unexpected(path)
            else:
                yield path

def importable(name):
    try:
        return importlib.util.find_spec(name) is not None
    except ModuleNotFoundError:
        return False

libc = ctypes.CDLL(None, use_errno=True)
status = dict(line.split(':', 1) for line in open('/proc/self/status').read().splitlines())
print(json.dumps(dict(
    namespaces={name: os.readlink(f'/proc/self/ns/{name}') for name in ('net', 'user', 'pid', 'ipc', 'uts')},
    links=[name for _, name in socket.if_nameindex()],
    out=error(lambda: socket.create_connection(('192.0.2.1', 80), 1)),
    processes=sum(name.isdigit() for name in os.listdir('/proc')), host=socket.gethostname(), uid=os.getuid(),
    capabilities=[status[name].strip().strip('0') for name in ('CapInh', 'CapPrm', 'CapEff', 'CapBnd', 'CapAmb')],
    privileges=status['NoNewPrivs'].strip(), filter=status['Seccomp'].strip(),
    written=[path for path in PLACES if not error(lambda: open(os.path.join(path, 'probe'), 'w'))],
    own=error(lambda: open('probe.py', 'a')), scratch=error(lambda: open('/tmp/large', 'w').write('x' * (100 << 20))),
    limits={name: resource.getrlimit(getattr(resource, 'RLIMIT_' + name.upper()))[1] for name in LIMITS},
    calls={name: call(number, 0, 0, 0, 0, 0) for name, number in CALLS.items()},
    files=sorted({path for folder in ['/', *PRIVATE] if os.path.isdir(folder) for path in unexpected(folder)}),
    grader=[name for name in GRADER if importable(name)], variables=sorted(os.environ),
)))
"""
# Run in the judging process after it has confined itself.
JUDGE = """
import importlib.util, json, os, sys
from autograder.grading.judge_process import LIMITS
from autograder.sandbox.confine import confine

confine(int(sys.argv[1]) if sys.argv[1:] else None, LIMITS)
status = dict(line.split(':', 1) for line in open('/proc/self/status').read().splitlines())
print(json.dumps(dict(
    capabilities=[status[name].strip().strip('0') for name in ('CapInh', 'CapPrm', 'CapEff', 'CapAmb')],
    privileges=status['NoNewPrivs'].strip(), filter=status['Seccomp'].strip(), uid=os.getuid(),
    files=[path for path in PRIVATE if os.path.exists(path) and os.listdir(path)],
)))
"""
TRIED = ("ptrace", "process_vm_readv", "unshare", "keyctl", "bpf", "io_uring_setup", "personality")
GRADER = ("autograder.paths", "autograder.hidden")
TRIED_FOR = 60  # s that a probing program may take
SECRET = "SECRET_OF_THE_GRADER"  # an environment variable


@dataclass(frozen=True)
class Layer:
    """One layer, and the result of trying it."""

    name: str
    holds: bool
    seen: str
    required: bool = True  # grading relies on it; other layers are additional


def examine() -> list[Layer]:
    """Try each layer; raises SandboxUnavailable when programs cannot be confined at all, or ROS 2 is not installed."""
    packages = dict.fromkeys(name.partition(".")[0] for name in LOADED.split())
    if lacking := [name for name in packages if not importlib.util.find_spec(name)]:
        raise SandboxUnavailable(
            f"{', '.join(lacking)} cannot be found: run environment/install, and wait until it has ended"
        )
    confinement = choose()
    known = {
        "PLACES": ["/", "/usr", "/etc", "/dev", "/proc", "/opt", sys.prefix, *map(str, ros_prefixes())],
        "LIMITS": list(LIMITS),
        "CALLS": _calls(),
        "EXPECTED": view.expected(),
        "PRIVATE": [str(folder) for folder in paths.private()],
        "GRADER": GRADER,
    }
    probe = "".join(f"{name} = {value!r}\n" for name, value in known.items()) + PROBE
    with Sandbox(confinement, {"probe.py": probe.encode()}) as confined:
        command = [*CONFINEMENTS[confinement], *confined.command(["probe.py"], domain=0)]
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            pass_fds=confined.descriptors,
            timeout=TRIED_FOR,
            env=os.environ | {SECRET: "1"},
        )
    if done.returncode:
        raise SandboxUnavailable(f"the probe ended with status {done.returncode}: {done.stderr.strip()[-300:]}")
    forked = [_forked(probe)] if confinement == "root" else []
    return [*_layers(json.loads(done.stdout), confinement), *forked, _judge(confinement), _group()]


def refused(layers: list[Layer]) -> bool:
    """Return True if this machine must not be used for grading."""
    return not all(layer.holds for layer in layers if layer.required)


def _forked(probe: str) -> Layer:
    """Check that the same layers hold for a forked program."""
    name = "forked programs"
    if not SUPPORTED:
        seen = "this Python cannot (3.11 and 3.12 can): each program loads ROS 2 for itself, which takes longer"
        return Layer(name, False, seen, required=False)
    server = Forkserver()
    (network,) = networks.make(1)
    try:
        with Sandbox("root", {"probe.py": probe.encode()}, forkserver=server) as sandbox:
            if not server.runs("probe.py", sandbox.files):
                seen = "this kernel cannot (Linux 5.8 can): each program loads ROS 2 for itself, which takes longer"
                return Layer(name, False, seen, required=False)
            with networks.inside(network):
                started = sandbox.launch("probe.py", domain=0)
            program = Program("probe.py", started.output, started.end, started.process.stop)
            ended = program.wait(TRIED_FOR)
    except SandboxError as error:
        return Layer(name, False, str(error))
    finally:
        os.close(network)
        server.close()
    if not ended or program.exit_status:
        return Layer(name, False, f"the probe did not end well: {program.output.strip()[-300:]}")
    broken = [layer for layer in _layers(json.loads(program.output), "root") if layer.required and not layer.holds]
    seen = "; ".join(f"{layer.name}: {layer.seen}" for layer in broken)
    return Layer(name, not broken, seen or "as confined as those that are started")


def _judge(confinement: str) -> Layer:
    """Check the judging process, started as for a grading."""
    name = "confined judge"
    root = paths.checkout()
    private = [paths.HIDDEN, *([root / "tests", root / "solutions"] if root else [])]
    probe = f"PRIVATE = {list(map(str, private))!r}\n{JUDGE}"
    with users.borrowed(confinement) as user, Sandbox(confinement, {}) as sandbox:
        command = [*CONFINEMENTS[confinement], *sandbox.judge_command(["-c", probe, *([str(user)] if user else [])])]
        done = subprocess.run(command, capture_output=True, text=True, pass_fds=sandbox.descriptors, timeout=TRIED_FOR)
    if done.returncode:
        return Layer(name, False, (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1])
    seen = json.loads(done.stdout)
    held = not any(seen["capabilities"]) and seen["privileges"] == "1" and not seen["files"]
    filtered = seen["filter"] == "2" or not seccomp.available()
    who = f"host user {seen['uid']}" if user else "the user who grades"
    rest = f"sees {', '.join(seen['files'])}" if seen["files"] else "sees one suite, no other file of the grader's"
    return Layer(name, held and filtered and seen["uid"] == (user or 0), f"{who}, no capabilities, {rest}")


def _group() -> Layer:
    """Check the control group for the programs of a grading."""
    group = cgroup.make()
    if group is None:
        return Layer(
            "control group",
            False,
            "not available: each program has limits, and all of a grading share a core",
            required=False,
        )
    group.close()
    seen = f"{cgroup.MEMORY >> 30} GiB and {cgroup.TASKS} processes for all programs of a grading together"
    return Layer("control group", True, seen, required=False)


def _calls() -> dict[str, int]:
    """Return the numbers of system calls that the filter denies; empty if there is no filter for this machine."""
    if not seccomp.available():
        return {}
    column = seccomp.MACHINES[os.uname().machine][1]
    return {name: number for name in TRIED if (number := seccomp.DENIED[name][column]) is not None}


def _layers(seen: dict[str, Any], confinement: str) -> Iterator[Layer]:
    """Yield the layers according to the output of the probing program."""

    def apart(name: str) -> bool:
        return seen["namespaces"][name] != os.readlink(f"/proc/self/ns/{name}")

    yield Layer(
        "network namespace",
        apart("net") and seen["links"] == ["lo"] and bool(seen["out"]),
        f"interfaces: {', '.join(seen['links'])}; connecting out: {seen['out'] or 'possible'}",
    )
    yield Layer("process namespace", apart("pid") and seen["processes"] <= 3, f"sees {seen['processes']} processes")
    yield Layer("IPC namespace", apart("ipc"), "shared memory of its own" if apart("ipc") else "the host's")
    yield Layer("host name namespace", apart("uts"), f"host name {seen['host']}")
    if confinement == "root":
        yield Layer("user of its own", seen["uid"] in users.SPARE, f"host user {seen['uid']}, no user namespace")
    else:
        yield Layer("user namespace", apart("user") and seen["uid"] == users.INSIDE, f"user {seen['uid']} inside")
    yield Layer(
        "no capabilities",
        not any(seen["capabilities"]) and seen["privileges"] == "1",
        "none, and none can be gained" if not any(seen["capabilities"]) else str(seen["capabilities"]),
    )
    yield Layer(
        "read-only system",
        not seen["written"] and bool(seen["own"]),
        f"could write to {', '.join(seen['written'])}" if seen["written"] else "nothing outside home and /tmp",
    )
    secrets = [*seen["files"], *seen["grader"], *(name for name in seen["variables"] if name == SECRET)]
    yield Layer(
        "grader out of sight",
        not secrets,
        f"sees {', '.join(secrets)}" if secrets else "no hidden suite, no environment variable, no file of others",
    )
    yield Layer(
        "limits",
        seen["limits"] == LIMITS and bool(seen["scratch"]),
        ", ".join(f"{name} {value}" for name, value in seen["limits"].items()),
    )
    denied = [name for name, errno in seen["calls"].items() if errno == 1]
    yield Layer(
        "system call filter",
        seen["filter"] == "2" and bool(denied) and len(denied) == len(seen["calls"]),
        f"denied: {', '.join(denied) or 'none'}",
        required=False,
    )
