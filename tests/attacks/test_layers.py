"""The layers of the sandbox, as `autograder doctor` shows them, and the filter of system calls for both machines."""

import os
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from autograder.errors import SandboxUnavailable
from autograder.paths import PACKAGE
from autograder.sandbox import layer_check, seccomp, view
from autograder.sandbox.forkserver import SUPPORTED

AUTOGRADER = str(Path(sys.executable).with_name("autograder"))
ALLOWED, DENIED = seccomp.ALLOW, seccomp._error(1)


def run(rules: bytes, number: int, architecture: int, *arguments: int) -> int:
    """Return what the kernel would do with a system call: an interpreter of the few operations in use."""
    seen = {0: number, 4: architecture, **{16 + 8 * at: value for at, value in enumerate(arguments)}}
    code, at, register = list(struct.iter_unpack("HBBI", rules)), 0, 0
    while True:
        operation, then, otherwise, value = code[at]
        at += 1
        if operation == seccomp.LOAD:
            register = seen.get(value, 0)
        elif operation == seccomp.RETURN:
            return value
        else:
            true = {
                seccomp.EQUAL: register == value,
                seccomp.NOT_LESS: register >= value,
                seccomp.ANY_BIT: bool(register & value),
            }[operation]
            at += then if true else otherwise


@pytest.mark.parametrize("machine", seccomp.MACHINES)
def test_filter(machine):
    rules = seccomp.program(machine)
    abi, column = seccomp.MACHINES[machine]
    read, clone, ioctl, socket = (0, 63)[column], seccomp.CLONE[column], seccomp.IOCTL[column], seccomp.SOCKET[column]
    assert run(rules, read, abi) == ALLOWED
    assert run(rules, read, abi ^ 1) == seccomp.KILL
    for name, numbers in (seccomp.DENIED | seccomp.IN_A_GRADING).items():
        if numbers[column] is not None:
            assert run(rules, numbers[column], abi) == DENIED, name
    assert run(rules, seccomp.CLONE3[column], abi) == seccomp._error(38)
    assert run(rules, clone, abi, 0x3D0F00) == ALLOWED  # a thread, as glibc starts it
    assert run(rules, clone, abi, 0x10000011) == DENIED  # a user namespace
    assert run(rules, clone, abi, 0x8011) == DENIED  # a child of its parent's
    assert run(rules, socket, abi, 2) == ALLOWED
    assert run(rules, socket, abi, 40) == seccomp._error(97)  # AF_VSOCK, which no network namespace holds
    assert run(rules, ioctl, abi, 1, 0x5412) == DENIED
    assert run(rules, ioctl, abi, 1, 0x5401) == ALLOWED
    fcntl = seccomp.FCNTL[column]
    assert {run(rules, fcntl, abi, 3, command) for command in seccomp.LOCKS} == {DENIED}
    assert run(rules, fcntl, abi, 3, 1030) == ALLOWED  # F_DUPFD_CLOEXEC
    if machine == "x86_64":
        assert run(rules, read | seccomp.X32, abi) == seccomp._error(38)


@pytest.mark.parametrize("machine", seccomp.MACHINES)
def test_a_students_server_may_watch_and_lock_files(machine):
    rules = seccomp.program(machine, server=True)
    abi, column = seccomp.MACHINES[machine]
    for name, numbers in seccomp.IN_A_GRADING.items():
        assert not numbers[column] or run(rules, numbers[column], abi) == ALLOWED, name
    assert {run(rules, seccomp.FCNTL[column], abi, 3, command) for command in seccomp.LOCKS} == {ALLOWED}
    assert run(rules, seccomp.DENIED["ptrace"][column], abi) == DENIED


def test_doctor(confinement):
    layers = {layer.name: layer for layer in layer_check.examine()}
    assert [layer for layer in layers.values() if not layer.holds and layer.required] == []
    assert layers["system call filter"].holds == seccomp.available()


def test_doctor_says_in_a_line_that_ros_2_is_not_installed_yet(monkeypatch):
    monkeypatch.setattr(layer_check, "LOADED", "rclpy rclpy.node interfaces_to_come.msg")
    with pytest.raises(SandboxUnavailable, match="^interfaces_to_come cannot be found: run environment/install"):
        layer_check.examine()


def test_doctor_refuses(tmp_path):
    done = subprocess.run(
        [AUTOGRADER, "doctor"], capture_output=True, text=True, timeout=60, env=os.environ | {"PATH": str(tmp_path)}
    )
    assert done.returncode == 1 and "bwrap is not installed" in done.stdout


def test_doctor_sees_what_does_not_hold(confinement, monkeypatch):
    monkeypatch.setattr(seccomp, "available", lambda: False)
    layers = {layer.name: layer for layer in layer_check.examine()}
    assert not layers["system call filter"].holds
    assert not layer_check.refused(list(layers.values()))


@pytest.mark.parametrize("shown", ["/var", str(PACKAGE), str(PACKAGE / "hidden")])
def test_doctor_sees_a_file_too_many(confinement, monkeypatch, shown):
    options = view.options
    more = ["--perms", "0755", "--dir", str(Path(shown).parent), "--ro-bind", shown, shown, "--remount-ro", "/"]
    monkeypatch.setattr(view, "options", lambda *given: [*options(*given)[:-2], *more])
    refused = [layer for layer in layer_check.examine() if not layer.holds and layer.required]
    assert [layer.name for layer in refused] == [
        "grader out of sight",
        *(["forked programs"] if confinement == "root" and SUPPORTED else []),
    ]
    assert all(shown in layer.seen for layer in refused)


def test_doctor_refuses_when_nothing_is_confined(confinement, monkeypatch):
    whole = ["--bind", "/", "/", "--proc", "/proc", "--dev", "/dev", "--tmpfs", view.HOME]
    monkeypatch.setattr(view, "options", lambda *_: whole)
    with pytest.raises(SandboxUnavailable):  # the probe is not even there
        layer_check.examine()
