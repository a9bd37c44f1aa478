"""A class at work on this machine: python classroom.py N [N...] [--pause SECONDS].  As root; see docs/classroom.md.

It starts a classroom with students enough.  For each N, so many students log in over HTTP, start servers and
kernels at once, run the cells of the calculator with its solution through websockets, and hand in.  Printed are the
memory and processor time of a student, and each cell's time beside its time when one student is alone, which is
measured first.  `--pause` has students think between cells, for up to twice as long, each for a time of their own;
without, all run their cells one after the other as fast as they come, which no class does.  With `--log-in` they log in
and start their servers, and no more: what a server alone takes.
"""

import argparse
import json
import random
import secrets
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from statistics import median
from threading import Barrier

import psutil

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from autograder.classroom import accounts, hub, servers  # noqa: E402  # after the path
from autograder.classroom.plan import Classroom  # noqa: E402
from autograder.sandbox.usage import of_user, processes, proportional, total  # noqa: E402
from tests.classroom.visitor import Visitor  # noqa: E402

TWICE, SHORT = 2.0, 0.2  # a cell may take twice its time alone; what is shorter (s) is taken for as long
ALONE = 3  # students who work alone, one after the other
HAND_IN = "!course hand-in --yes --no-check"
START = "log in, start the server"
KERNEL = "start a kernel"


@dataclass
class Worked:
    """The time and memory that a student's work has taken."""

    seconds: dict[str, float]  # by step
    visitor: Visitor
    server: tuple[int, float]  # bytes and s of a processor of the server, once it has shown JupyterLab
    whole: tuple[int, float]  # the same at the end, with the kernel and its nodes


def steps() -> dict[str, str]:
    """The cells of the calculator as solved, by a name of each, and handing in."""
    notebook = json.loads((ROOT / "notebooks/calculator/calculator.ipynb").read_text())
    sources = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    found = {f"{number:2} {source.splitlines()[0][:40]}": source for number, source in enumerate(sources, 1)}
    return found | {"hand in": HAND_IN}


def work(room: Classroom, name: str, password: str, pause: float, all_started: Barrier | None) -> Worked:
    """One student, from logging in to handing in, or with `all_started` until everybody's server runs."""
    visitor = Visitor(room.address_of(room.find(name)), name)
    begin = time.monotonic()
    assert visitor.log_in(password)
    visitor.start()
    seconds = {START: time.monotonic() - begin}
    if all_started:
        all_started.wait()
    server = _taken(room, name)
    if all_started:
        all_started.wait()
        return Worked(seconds, visitor, server, server)
    begin = time.monotonic()
    kernel = visitor.kernel("calculator")
    kernel.run("pass")
    seconds[KERNEL] = time.monotonic() - begin
    for step, source in steps().items():
        time.sleep(random.uniform(0, 2 * pause))
        ran = kernel.run(source)
        if ran.error:
            print(f"{name}, {step}: {ran.text[-300:]}", file=sys.stderr)
        seconds[step] = ran.seconds
    return Worked(seconds, visitor, server, _taken(room, name))


def class_of(room: Classroom, names: list[str], pause: float, log_in: bool) -> list[Worked]:
    """These students at once, each for the first time: their interfaces are yet to be built."""
    password = hub.shared_passwords(room)["students"]
    all_started = Barrier(len(names)) if log_in else None
    with ThreadPoolExecutor(len(names)) as pool:
        done = list(pool.map(lambda name: work(room, name, password, pause, all_started), names))
        list(pool.map(lambda each: each.visitor.stop(), done))
    return done


def show(count: int, alone: list[Worked], done: list[Worked]) -> bool:
    """Print what a class of `count` has taken; whether each cell was within twice its time alone."""
    print(f"\n{count} students; of memory and of a processor each has taken in the median")
    for what, taken in (
        ("when the server had started", [each.server for each in done]),
        ("at the end", [each.whole for each in done]),
    ):
        memory, processor = (median(values) for values in zip(*taken, strict=True))
        print(f"  {what}: {memory / 2**20:.0f} MiB and {processor:.1f} s")
    print(f"{'s':44}{'alone':>8}{'median':>8}{'worst':>8}{'ratio':>8}")
    within = True
    for step in done[0].seconds:
        base = median(each.seconds[step] for each in alone)
        times = sorted(each.seconds[step] for each in done)
        ratio = max(median(times), SHORT) / max(base, SHORT)
        if step not in (START, KERNEL, "hand in"):
            within = within and ratio <= TWICE
        print(f"{step:44}{base:8.2f}{median(times):8.2f}{times[-1]:8.2f}{ratio:8.1f}")
    print("Each cell is within twice its time alone." if within else "Not each cell is within twice its time alone.")
    return within


def _taken(room: Classroom, name: str) -> tuple[int, float]:
    """Bytes and seconds of a processor of all that runs for a student."""
    user, _ = accounts.ids(room, room.find(name))
    running = {*processes(servers.started(room)[name].pid), *of_user(user)}
    return total(running, proportional), sum(_processor(pid) for pid in running)


def _processor(pid: int) -> float:
    """Processor time (s) of a process and of its children that have ended."""
    try:
        times = psutil.Process(pid).cpu_times()
    except psutil.NoSuchProcess:
        return 0.0
    return times.user + times.system + times.children_user + times.children_system


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("students", type=int, nargs="+", metavar="N")
    parser.add_argument("--pause", type=float, default=0.0, help="seconds between cells, on average")
    parser.add_argument("--log-in", action="store_true", help="log in and start servers alone")
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="classroom-"))
    folder.chmod(0o711)
    roster = folder / "roster.csv"
    names = [f"s{number:04}" for number in range(1 + ALONE + sum(options.students))]
    roster.write_text("\n".join(["student,role", *(f"{name},student" for name in names), "teacher,instructor", ""]))
    common = ["--folder", str(folder / "class")]
    command = [ROOT / "environment" / "classroom"]
    try:
        begin = time.monotonic()
        arguments = ["--roster", roster, "--passwords", "dummy", "--port", "18000"]
        more = ["--prefix", f"b{secrets.token_hex(2)}-"]
        subprocess.run([*command, "up", *common, *arguments, *more], check=True, stdout=subprocess.DEVNULL)
        subprocess.run([*command, "release", "--all", *common], check=True, stdout=subprocess.DEVNULL)
        print(
            f"up with {len(names)} students: {time.monotonic() - begin:.1f} s; {psutil.cpu_count()} processors,", end=""
        )
        print(f" {psutil.virtual_memory().total / 2**30:.0f} GiB, load before: {psutil.getloadavg()[0]:.1f}")
        room = Classroom.load(folder / "class")
        home = sum(path.stat().st_size for path in room.home(room.students[0]).rglob("*") if path.is_file())
        print(f"a new home: {home / 2**20:.1f} MiB")
        fresh = iter(names)
        class_of(room, [next(fresh)], 0.0, options.log_in)  # the first one finds nothing in the machine's caches
        alone = [worked for _ in range(ALONE) for worked in class_of(room, [next(fresh)], 0.0, options.log_in)]
        largest = 0
        for count in options.students:
            if show(count, alone, class_of(room, [*islice(fresh, count)], options.pause, options.log_in)):
                largest = max(largest, count)
        print(f"\nThe largest of these at which each cell is within twice its time alone: {largest or 'none'}")
    finally:
        subprocess.run([*command, "down", *common, "--delete-homes"], stdout=subprocess.DEVNULL)
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
