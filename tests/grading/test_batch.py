"""Grading a class: nothing is lost when the coordinator, a worker, the disk or the cluster fails."""

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from nbgrader.api import Gradebook

from autograder.errors import ClusterError, UsageError
from autograder.grading import installed_code
from autograder.paths import COURSE, PACKAGE
from autograder.records import GRADED, Report
from autograder.results import output
from autograder.submissions import exercises, listing
from course.foundation.waiting import wait_until
from tests.hidden.answers import SOLUTIONS
from tests.processes import processes, runs

BIN = Path(sys.executable).parent
STUDENTS = ["ada", "bob", "cyd", "dan"]
SLOW = 60.0  # s that a busy machine may take for what an idle one does at once


@pytest.fixture
def submitted(tmp_path) -> Path:
    """Four students who handed in `services`, which is graded quickly.

    The motors end at once, so they are judged quickly, and of one of two the relay errs; the relay is missing; and
    nothing is there.
    """
    folder = tmp_path / "submitted"
    for student in STUDENTS:
        shutil.copytree(SOLUTIONS / "services", folder / student / "services")
    for student in STUDENTS[:2]:
        (folder / student / "services" / "motor_service.py").write_text("def main(:\n")
    relay = folder / "bob" / "services" / "relay.py"
    relay.write_text(relay.read_text().replace("AddTwoInts.Request(a=a, b=b)", "AddTwoInts.Request(a=b, b=a)"))
    (folder / "cyd" / "services" / "relay.py").unlink()
    shutil.rmtree(folder / "dan" / "services")
    (folder / "dan" / "services").mkdir()
    return folder


def begin(submitted, out, *options, **more) -> subprocess.Popen:
    return subprocess.Popen(
        [BIN / "autograder", "grade", submitted, "--output", out, *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **more,
    )


def end(process) -> tuple[int, str, str]:
    output, errors = process.communicate(timeout=4 * SLOW)
    return process.returncode, output, errors


def results(out) -> list[dict]:
    with contextlib.suppress(FileNotFoundError):
        whole, _, _ = (out / "results.jsonl").read_text().rpartition("\n")  # the last line may be on its way
        return [json.loads(line) for line in whole.splitlines()]
    return []


def scores(out) -> dict[str, float]:
    assert len({line["student"] for line in results(out)}) == len(results(out)), "one line a submission"
    return {line["student"]: line["score"] for line in results(out)}


ALL = {"ada": 10, "bob": 9.5, "cyd": 0, "dan": 0}


NIGHTLY = pytest.mark.matrix


@pytest.mark.long("a batch is graded, killed, and taken up again")
@pytest.mark.parametrize(
    "moment", [pytest.param("at once", marks=NIGHTLY), "first result", pytest.param("third result", marks=NIGHTLY)]
)
def test_sigkill_of_the_coordinator_loses_nothing(confinement, submitted, tmp_path, moment):
    """--resume grades what is left, once, and completes pages and gradebook; no worker outlives the coordinator."""
    out = tmp_path / "out"
    process = begin(submitted, out, "--jobs", "2")
    lines = {"at once": 0, "first result": 1, "third result": 3}[moment]
    assert wait_until(lambda: (out / ".lock").exists() and len(results(out)) >= lines, 2 * SLOW)
    workers = psutil.Process(process.pid).children(recursive=True)
    assert workers or moment == "at once"
    process.kill()
    assert end(process)[0] == -signal.SIGKILL
    assert wait_until(lambda: not any(map(runs, workers)), SLOW)
    before = {line["student"]: line for line in results(out)}
    assert end(begin(submitted, out, "--jobs", "1", "--resume"))[::2] == (0, "")
    assert scores(out) == ALL
    assert all(line == before.get(line["student"], line) for line in results(out)), (
        "what was graded was not graded again"
    )
    assert {path.parent.name for path in out.glob("feedback/*/services.html")} == set(STUDENTS)
    with Gradebook(f"sqlite:///{out / 'gradebook.db'}") as book:
        assert {s.student_id: s.score for s in book.assignment_submissions("services")} == ALL


def test_submissions_that_were_moved_can_be_resumed(confinement, submitted, tmp_path):
    """The folder where they were graded before is not needed any more."""
    for student in STUDENTS[:-1]:
        shutil.rmtree(submitted / student)
    assert end(begin(submitted, tmp_path / "out", "--no-gradebook"))[::2] == (0, "")
    moved = submitted.rename(tmp_path / "moved")
    assert end(begin(moved, tmp_path / "out", "--no-gradebook", "--resume"))[::2] == (0, "")
    assert scores(tmp_path / "out") == {"dan": 0}


def test_a_result_of_other_files_in_another_folder_does_not_count(submitted, tmp_path):
    """A namesake of another class, or a second hand-in elsewhere; the result of the same files is kept."""
    here, out = tmp_path / "again", tmp_path / "out"
    for student in ("cyd", "dan"):
        shutil.copytree(submitted / student, here / student)
    (here / "dan" / "services" / "relay.py").write_text("print()\n")  # a file is missing, so nothing is run
    with output.Output(out, resume=False) as first:
        for student in STUDENTS[1:]:
            files = listing.digest(listing.read(submitted, student, "services"))
            suite = exercises.pack("services").digest
            graded = Report(student, "services", GRADED, 10, 20, 1, 1.0, details={"seen": student})
            first.write(graded, output.Basis(str(submitted), suite, files))
    code, said, errors = end(begin(here, out, "--no-gradebook", "--resume"))
    assert (code, errors) == (0, "")
    assert scores(out) == {"bob": 10, "cyd": 10, "dan": 0}
    (look,) = [line for line in said.splitlines() if line.startswith("LOOK: ")]
    assert look.startswith(f"LOOK: {out} has results from {submitted}, and now {here} is graded into it. Graded again,")
    assert f": dan/services (old results: {out / 'history.jsonl'}). " in look and "cyd" not in look
    assert "Handed in again" not in said
    assert {key[0]: basis.submitted for key, basis in output.bases(out).items()} == {
        "bob": str(submitted),
        "cyd": str(here),
        "dan": str(here),
    }
    assert {report.student: details for report, details in output.read_with_details(out, "cyd")} == {
        "cyd": {"seen": "cyd"}
    }
    shutil.rmtree(submitted / "bob")
    before = (out / "details.jsonl").read_bytes()
    code, said, errors = end(begin(here, out, "--no-gradebook", "--resume"))
    assert (code, errors, before) == (0, "", (out / "details.jsonl").read_bytes())
    assert "Graded again" not in said


def test_a_second_coordinator_on_the_same_folder_refuses(submitted, tmp_path):
    """And changes nothing of what the first one writes, which is this process."""
    out = tmp_path / "out"
    with output.Output(out, resume=False) as first:
        code, _, errors = end(begin(submitted, out, "--resume"))
        assert (code, errors) == (2, f"autograder: another grading is writing to {out}\n")
        assert results(out) == []
        first.write(Report("ada", "services", GRADED, 10, 20, 1, 1.0), output.Basis(str(submitted), "", ""))
    assert scores(out) == {"ada": 10}


@pytest.mark.matrix  # that finished work is kept shows SIGKILL
def test_ctrl_c_stops_with_what_is_done_kept(confinement, submitted, tmp_path):
    process = begin(submitted, tmp_path / "out", "--jobs", "1", start_new_session=True)
    assert wait_until(lambda: results(tmp_path / "out"), 2 * SLOW)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    code, _, errors = end(process)
    assert (code, errors) == (130, "autograder: stopped, finished work is kept\n")
    assert results(tmp_path / "out")


@pytest.mark.matrix  # that finished work is kept shows SIGKILL; tests/gradebook/test_term.py fills a disk
@pytest.mark.skipif(os.geteuid() != 0, reason="a file system of its own size needs root")
def test_a_full_disk_stops_it_with_what_is_done_kept(confinement, submitted, tmp_path):
    """And it goes on when there is room again."""
    out = tmp_path / "out"
    out.mkdir()
    try:
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=20k", "tmpfs", out], check=True)
    except subprocess.CalledProcessError:
        pytest.skip("this root may not mount")
    try:
        code, _, errors = end(begin(submitted, out, "--no-gradebook"))
        assert code == 3 and errors == (
            "autograder: stopped, finished work is kept: writing: No space left on device. "
            "Free some space, and run the command again; `grade` continues with --resume\n"
        )
        done = scores(out)
        assert len(done) < len(STUDENTS)
        subprocess.run(["mount", "-o", "remount,size=1m", out], check=True)
        assert end(begin(submitted, out, "--no-gradebook", "--resume"))[::2] == (0, "")
        assert scores(out) == ALL and done.items() <= ALL.items()
    finally:
        subprocess.run(["umount", "-l", out], check=True)


def test_a_folder_that_cannot_be_written_is_refused(submitted, tmp_path):
    (tmp_path / "file").touch()
    code, _, errors = end(begin(submitted, tmp_path / "file" / "out"))
    assert code == 2 and errors == f"autograder: cannot write to {tmp_path / 'file' / 'out'}: Not a directory\n"


@pytest.mark.skipif(os.geteuid() != 0, reason="mounting needs root")
def test_a_read_only_folder_is_refused(submitted, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "ro", "tmpfs", out], capture_output=True).returncode:
        pytest.skip("this root may not mount")
    try:
        code, _, errors = end(begin(submitted, out))
        assert code == 2 and errors == f"autograder: cannot write to {out}: Read-only file system\n"
    finally:
        subprocess.run(["umount", "-l", out], check=True)


def test_what_is_no_submission_is_named(tmp_path):
    """A folder that may be a submission, but is not in the expected form, is not left out silently."""
    for path in (
        "ada/services/relay.py",
        "jim/Services/relay.py",
        "mia/relay.py",
        "__MACOSX/services/._relay.py",
        "@eaDir/services/x",
        ".git/services/x",
        "leo.zip",
        "zoe/essay/text.md",
    ):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).touch()
    assert listing.find(tmp_path, None, []) == [("ada", "services")]
    assert listing.overlooked(tmp_path) == [
        ".git: left out, because its name begins with a full stop",
        "jim/Services: is that services?",
        "leo.zip: not a student's folder",
        "mia: files that are not in the folder of an exercise",
    ]
    with pytest.raises(UsageError, match="; jim/Services: is that services[?]$"):
        listing.find(tmp_path, None, ["jim"])


def test_results_are_for_the_instructor_alone(tmp_path):
    with output.Output(tmp_path / "out", resume=False):
        pass
    assert (tmp_path / "out").stat().st_mode & 0o777 == 0o700
    assert {path.stat().st_mode & 0o777 for path in (tmp_path / "out").iterdir()} == {0o600}


def test_jobs_and_scheduler_exclude_each_other(submitted, tmp_path):
    code, _, errors = end(begin(submitted, tmp_path / "out", "--jobs", "2", "--scheduler", "tcp://127.0.0.1:1"))
    assert code == 2 and "not both" in errors


def test_no_scheduler_there(submitted, tmp_path, monkeypatch):
    monkeypatch.setenv("DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT", "1s")
    code, _, errors = end(begin(submitted, tmp_path / "out", "--scheduler", "tcp://127.0.0.1:1"))
    assert code == 3 and errors.startswith(
        "autograder: stopped, finished work is kept: no Dask scheduler answers at tcp://127.0.0.1:1"
    )
    assert errors.count("\n") == 1


class DaskCluster:
    """A scheduler and workers that have the installed package, and nothing else of this repository."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.file = folder / "scheduler.json"
        self.processes = [
            self._start(
                "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", self.file
            )
        ]
        assert wait_until(lambda: self.file.exists() and self.file.read_text().endswith("}"), SLOW)
        self.address = json.loads(self.file.read_text())["address"]

    def _start(self, *command, **environment):
        return subprocess.Popen(
            [BIN / "dask", *command],
            cwd=self.folder,
            env=os.environ | environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def worker(self, **environment: str) -> subprocess.Popen:
        """One more worker, which is not started again when it dies."""
        options = ["--nthreads", "1", "--no-nanny", "--no-dashboard"]
        self.processes.append(self._start("worker", self.address, *options, **environment))
        return self.processes[-1]

    def close(self) -> None:
        for process in reversed(self.processes):
            process.kill()
            process.wait()


@pytest.fixture
def dask_cluster(tmp_path):
    cluster = DaskCluster(tmp_path)
    yield cluster
    cluster.close()


def grading_worker(name: str, workers: list[subprocess.Popen]) -> subprocess.Popen:
    """Wait until a worker grades the program of that name, and say which one it is."""

    def graders() -> list[subprocess.Popen]:
        above = set()
        for process in processes():
            with contextlib.suppress(psutil.Error):
                if name in process.info["cmdline"][1:2]:
                    above |= {parent.pid for parent in process.parents()}
        return [worker for worker in workers if worker.pid in above]

    found = []
    assert wait_until(lambda: found.extend(graders()) or bool(found), 2 * SLOW)
    return found[0]


@NIGHTLY  # that of a worker that dies twice is in each run
def test_a_worker_that_dies_loses_nothing(confinement, submitted, dask_cluster, tmp_path):
    """A scheduler and three workers, one of which is killed while it grades."""
    workers = [dask_cluster.worker() for _ in range(3)]
    process = begin(submitted, tmp_path / "out", "--scheduler", dask_cluster.address)
    grading_worker("relay.py", workers).kill()
    assert end(process)[::2] == (0, "")
    assert scores(tmp_path / "out") == ALL


@pytest.mark.matrix  # tests/grading/test_judging.py has it without a cluster
def test_a_submission_that_kills_two_workers_is_given_up(confinement, submitted, dask_cluster, tmp_path):
    """The rest of the class is graded."""
    shutil.copytree(SOLUTIONS / "parameters", submitted / "bob" / "parameters")
    workers = [dask_cluster.worker() for _ in range(3)]
    process = begin(submitted, tmp_path / "out", "--scheduler", dask_cluster.address)
    for _ in range(2):
        worker = grading_worker("pid_node.py", workers)
        worker.kill()
        worker.wait()
    code, output, errors = end(process)
    assert (code, errors) == (3, "")
    lines = {(line["student"], line["assignment"]): line for line in results(tmp_path / "out")}
    given_up = lines.pop(("bob", "parameters"))
    assert (given_up["status"], given_up["score"], given_up["flags"]) == (
        "infrastructure_error",
        None,
        ["killed_workers"],
    )
    assert {student: line["score"] for (student, _), line in lines.items()} == ALL
    words = " ".join(output.split())
    assert "because the grader failed; --resume grades it again: bob/parameters" in words
    assert re.search(r"flagged: killed [^:]*: bob/parameters", words), output


@pytest.mark.matrix  # tests/grading/test_dispatch.py loses a scheduler
@pytest.mark.long("waits as long as for a cluster that may come back")
def test_a_cluster_that_is_lost_is_told(confinement, submitted, dask_cluster, tmp_path):
    """And --resume goes on elsewhere."""
    dask_cluster.worker()
    process = begin(submitted, tmp_path / "out", "--scheduler", dask_cluster.address)
    assert wait_until(lambda: results(tmp_path / "out"), 2 * SLOW)
    dask_cluster.close()
    code, _, errors = end(process)
    assert code == 3 and errors.startswith("autograder: stopped, finished work is kept: ") and errors.count("\n") == 1
    assert end(begin(submitted, tmp_path / "out", "--resume"))[::2] == (0, "")
    assert scores(tmp_path / "out") == ALL


def test_a_worker_with_other_code_is_refused(submitted, dask_cluster, tmp_path):
    """The error says what differs and what to do.  Other hidden suites do not matter, because these are sent along."""
    for package in (PACKAGE, COURSE):
        shutil.copytree(package, tmp_path / "other" / package.name, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "other" / "autograder" / "hidden" / "services" / "suite.py").write_text("")
    with open(tmp_path / "other" / "autograder" / "sandbox" / "sandbox.py", "a") as file:
        file.write("LIMITS.clear()\n")
    dask_cluster.worker(PYTHONPATH=str(tmp_path / "other"))
    code, _, errors = end(begin(submitted, tmp_path / "out", "--scheduler", dask_cluster.address))
    assert code == 3 and errors.startswith("autograder: stopped, finished work is kept: the worker tcp://127.0.0.1:")
    assert errors.endswith(
        " has another version of the course (autograder/sandbox/sandbox.py differs): "
        "install the same one on both machines, then start the worker again\n"
    )


def test_the_code_of_workers_is_compared(tmp_path):
    from autograder.grading import cluster  # Dask, which no worker of pytest need load for another's tests

    mine = installed_code.digests()
    assert {"autograder/grading/launcher.py", "course/discovery.xml", "course/session/live.py"} <= mine.keys()
    assert not [name for name in mine if "__pycache__" in name or "hidden" in name]
    assert installed_code.difference(mine, dict(reversed(mine.items()))) == ""
    cluster.check_code({"tcp://a": mine, "tcp://b": mine})
    names = sorted(mine)
    other = {**mine, "course/new.py": "1", names[0]: "2"}
    del other[names[1]]
    assert installed_code.difference(mine, other) == (
        f"{names[0]} differs, {names[1]} is missing there, course/new.py is missing here"
    )
    assert installed_code.difference(mine, {}).endswith(f"is missing there, and so on, {len(mine)} files in all")
    with pytest.raises(
        ClusterError, match=r"the worker tcp://b cannot grade \(No module.*\): install the course on its"
    ):
        cluster.check_code({"tcp://a": mine, "tcp://b": ModuleNotFoundError("No module named 'autograder'")})


def test_a_worker_needs_no_suite_of_its_own(tmp_path):
    """The exercise that is sent is unpacked elsewhere, and is the same."""
    packed = exercises.pack("services")
    sent = exercises.unpack(packed)
    assert sent.folder != exercises.load("services").folder
    assert (sent.tests, sent.files) == (exercises.load("services").tests, exercises.load("services").files)
    assert exercises.pack("services").digest == packed.digest
    assert exercises.Packed("services", packed.files | {"services/suite.py": b""}).digest != packed.digest
    assert os.stat(sent.folder.parent).st_mode & 0o077 == 0


def test_ctrl_c_while_the_command_line_loads_ends_it_without_a_traceback():
    loading = (
        "import os, signal, sys\n"
        "class Loading:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'autograder.cli':\n"
        "            os.kill(os.getpid(), signal.SIGINT)\n"
        "from autograder.__main__ import main\n"
        "sys.meta_path.insert(0, Loading())\n"
        "main()\n"
    )
    ended = subprocess.run([sys.executable, "-c", loading], capture_output=True, text=True, timeout=60, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (-signal.SIGINT, "", "")
