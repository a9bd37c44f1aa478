"""Another user of the same machine against a student's session: what is the student's alone, and what cannot be."""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.request
from pathlib import Path

import pytest

from course import registry
from course.foundation import processes
from course.foundation.folders import runtime_folder
from course.foundation.waiting import wait_until
from tests.ports import free_port

from .programs import REPOSITORY

STUDENT, OTHER = 61201, 61202  # of nobody, and of no program in a grading
pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="only root can become two other users")

# What the student does in a notebook.
WORK = """
import glob, json, os
from jupyter_client import BlockingKernelClient
(connection,) = glob.glob(os.path.expanduser('~/.local/share/jupyter/runtime/kernel-*.json'))
client = BlockingKernelClient(connection_file=connection)
client.load_connection_file()
client.start_channels()
client.wait_for_ready(60)
said = []
def take(message):
    said.append(message['content'].get('text', ''))
for code in ['import course\\nros = course.live()\\nfrom course.nodes.add_two_ints_server import AddTwoIntsServer\\n'
             'ros.start(AddTwoIntsServer)\\nprint("domain", ros.domain_id)', *['print("my" + " grade")'] * 20]:
    assert client.execute_interactive(code, timeout=60, output_hook=take)['content']['status'] == 'ok', said
print(''.join(said), connection)
"""

# What the other user does meanwhile: listens at every port of the student's, and opens every socket and file.
LISTEN = """
import json, os, socket, sys, time
import zmq
STUDENT, home = int(sys.argv[1]), sys.argv[2]
ports = {int(words[1].split(':')[1], 16) for table in ('tcp', 'tcp6') for words in
         map(str.split, list(open('/proc/net/' + table))[1:]) if words[3] == '0A' and int(words[7]) == STUDENT}
listener = zmq.Context().socket(zmq.SUB)
listener.subscribe(b'')
for port in ports:
    listener.connect(f'tcp://127.0.0.1:{port}')
print('ready', flush=True)
heard, end = False, time.monotonic() + 60
poller = zmq.Poller()
poller.register(listener, zmq.POLLIN)
poller.register(0, zmq.POLLIN)
while time.monotonic() < end:
    ready = dict(poller.poll(1000))
    if listener in ready:
        heard |= b'grade' in b''.join(listener.recv_multipart())
    elif 0 in ready:  # the student has finished, and nothing more is waiting
        break
opened = []
for line in open('/proc/net/unix'):
    path = line.split()[-1]
    if path.startswith((home, '/tmp/ros2-course')):
        try:
            socket.socket(socket.AF_UNIX).connect(path)
            opened.append(path)
        except OSError:
            pass
for start in (home + '/.local/share/jupyter/runtime', f'/tmp/ros2-course-{STUDENT}'):
    try:
        opened += [os.path.join(start, name) for name in os.listdir(start) if open(os.path.join(start, name)).read()]
    except OSError:
        pass
def shared(mode):
    found = [file for file in os.scandir('/dev/shm') if os.access(file.path, mode)]  # not what has gone meanwhile
    return [file.path for file in found if owner(file) == STUDENT]
def owner(file):
    try:
        return file.stat().st_uid
    except FileNotFoundError:
        return None
print(json.dumps(dict(heard=heard, opened=opened, ports=len(ports), read=shared(os.R_OK), written=shared(os.W_OK))))
"""

# In a /dev/shm of the test's own, "$1" runs "$2" as the other user, and then "$3" as the student.
ONE_AFTER_THE_OTHER = f"""
mount -t tmpfs -o mode=1777 tmpfs /dev/shm
setpriv --reuid={OTHER} --regid={OTHER} --clear-groups "$1" -S -c "$2"
exec setpriv --reuid={STUDENT} --regid={STUDENT} --clear-groups "$1" -c "$3"
"""
# Takes all names of shared memory that Fast DDS would use.
TAKE = """
import os
for port in [*range(7000, 7040), *range(7400, 7400 + 250 * 102)]:
    for name in (f"fastrtps_port{port}", f"fastrtps_port{port}_el", f"sem.fastrtps_port{port}_mutex"):
        os.close(os.open("/dev/shm/" + name, os.O_CREAT | os.O_EXCL, 0o600))
"""
# Two processes of a session speak.
SPEAK = """
import course, pathlib
from example_interfaces.srv import AddTwoInts
ros = course.live()
pathlib.Path("node.py").write_text("import rclpy, course.nodes.add_two_ints_server as module\\n"
                                   "rclpy.init()\\nrclpy.spin(module.AddTwoIntsServer())\\n")
ros.start("node.py")
print(ros.call("/add_two_ints", AddTwoInts, a=2, b=3).sum)
ros.close()
"""


def as_user(uid: int, home: Path, *command: object, **more) -> subprocess.Popen[str]:
    become = ["setpriv", f"--reuid={uid}", f"--regid={uid}", "--clear-groups", "--"]
    variables = {"PATH": os.environ["PATH"], "HOME": str(home), "LANG": "C.UTF-8"} | more.pop("variables", {})
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True} | more
    return subprocess.Popen([*become, *map(str, command)], env=variables, cwd=home, **pipes)


@pytest.fixture(scope="module")
def homes():
    """The home folders of the two, as useradd makes them on many systems: everybody may enter."""
    if subprocess.run(
        ["setpriv", f"--reuid={OTHER}", f"--regid={OTHER}", "--clear-groups", "test", "-x", REPOSITORY]
    ).returncode:
        pytest.skip("an ordinary user may not enter the folder that this checkout is in")
    around = Path(tempfile.mkdtemp(prefix="ros2-course-homes-"))
    around.chmod(0o755)
    for uid in (STUDENT, OTHER):
        (around / str(uid)).mkdir(mode=0o755)
        os.chown(around / str(uid), uid, uid)
    yield around
    shutil.rmtree(around)
    shutil.rmtree(f"/tmp/ros2-course-{STUDENT}", ignore_errors=True)
    shutil.rmtree(f"/tmp/ros2-course-{OTHER}", ignore_errors=True)


@pytest.fixture(scope="module")
def server(homes):
    """The student's JupyterLab with a kernel; its address."""
    home = homes / str(STUDENT)
    port = free_port()
    with open(home / "log", "w") as log:
        command = [REPOSITORY / "environment/start", "--no-browser", f"--port={port}", "--ServerApp.port_retries=0"]
        process = as_user(STUDENT, home, *command, stdout=log)
    try:

        def token() -> re.Match[str] | None:
            return re.search(r"\?token=(\w+)", (home / "log").read_text())

        said = wait_until(token, 60, unless=lambda: process.poll() is not None, alert=False)
        assert said, (home / "log").read_text()
        request = urllib.request.Request(
            f"http://127.0.0.1:{port}/api/kernels?token={said[1]}", data=b"{}", method="POST"
        )

        def kernel() -> str:
            with urllib.request.urlopen(request, timeout=60) as answer:
                return json.load(answer)["id"]

        def connection() -> dict:
            """Return the kernel's connection file, once there is one."""
            (file,) = (home / ".local/share/jupyter/runtime").glob("kernel-*.json")
            return json.loads(file.read_text())

        def listens() -> bool:
            return (
                subprocess.run(["bash", "-c", f"exec 3<>/dev/tcp/127.0.0.1/{port}"], capture_output=True).returncode
                == 0
            )

        assert wait_until(listens, 20, alert=False)
        assert kernel()
        told = connection()
        assert told["transport"] == "ipc"
        assert wait_until(Path(f"{told['ip']}-{told['hb_port']}").exists, 60, alert=False), "it does not listen"
        yield port
    finally:
        process.terminate()
        process.communicate(timeout=60)


@pytest.fixture(scope="module")
def overheard(homes, server):
    """The output of the student's cells, and the part of it that the other user has got."""
    other = as_user(OTHER, homes / str(OTHER), sys.executable, "-c", LISTEN, STUDENT, homes / str(STUDENT))
    lines = [other.stdout.readline()]
    assert lines == ["ready\n"], other.communicate()
    work = as_user(STUDENT, homes / str(STUDENT), sys.executable, "-c", WORK)
    printed, _ = work.communicate(timeout=180)
    assert work.returncode == 0 and "my grade" in printed, printed
    told, _ = other.communicate("done\n", timeout=90)
    return printed, json.loads(told.splitlines()[-1])


def test_cells_and_their_outputs_are_the_students_alone(overheard):
    """A kernel's TCP ports would publish them to whoever connects: it has none of these.

    Left are the page's, which asks for the token, and one by which the kernel's forks give it their output: ipykernel
    takes what comes there with a secret, and publishes nothing.
    """
    _, got = overheard
    assert not got["heard"] and got["ports"] == 2


def test_no_socket_and_no_file_of_a_session_can_be_opened(overheard):
    _, got = overheard
    assert got["opened"] == [] and got["written"] == []


def test_of_its_shared_memory_only_what_nodes_send_can_be_read(overheard):
    """As it can by whoever joins the domain: rmw_fastrtps has shared memory where discovery stays on the machine."""
    _, got = overheard
    assert [path for path in got["read"] if "/fastrtps_" not in path and "/sem.fastrtps_" not in path] == []


def test_whoever_joins_the_domain_is_let_in_as_the_docs_say(homes, overheard):
    """DDS knows no users."""
    domain = re.search(r"domain (\d+)", overheard[0])[1]
    command = [
        Path(sys.executable).with_name("ros2"),
        "service",
        "call",
        "/add_two_ints",
        "example_interfaces/srv/AddTwoInts",
    ]
    call = as_user(OTHER, homes / str(OTHER), *command, "{a: 2, b: 3}", variables={"ROS_DOMAIN_ID": domain})
    said, _ = call.communicate(timeout=60)
    assert "sum=5" in said, said
    assert "can join your ROS domain" in (REPOSITORY / "docs/faq.md").read_text()


def test_names_of_shared_memory_that_another_user_took_stop_no_session(homes):
    """The nodes speak by UDP then."""
    command = ["unshare", "--mount", "--propagation", "private", "bash", "-ec", ONE_AFTER_THE_OTHER, "bash"]
    variables = {"PATH": os.environ["PATH"], "HOME": str(homes / str(STUDENT)), "LANG": "C.UTF-8"}
    done = subprocess.run(
        [*command, sys.executable, TAKE, SPEAK],
        cwd=variables["HOME"],
        env=variables,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.stdout == "5\n", done.stdout + done.stderr


# Holds all domains of this machine, without a node in any.
HOLD = """
import socket
held = [socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) for _ in range(1, 101)]
for domain, claim in enumerate(held, 1):
    claim.bind(f"\\0ros2-course-domain-{domain}")
print("held", flush=True)
input()
"""
LIVE = "import course; print(course.live().domain_id)"


def test_who_finds_all_domains_held_by_another_user_can_choose_one(homes):
    """In a network of the test's own, so that no other session is stopped."""
    script = f"""
ip link set lo up
coproc OTHER {{ exec setpriv --reuid={OTHER} --regid={OTHER} --clear-groups "$1" -S -c "$2"; }}
read -r -u "${{OTHER[0]}}"
become="setpriv --reuid={STUDENT} --regid={STUDENT} --clear-groups"
$become "$1" -c "$3" 2>&1 | tail -n 1
ROS_DOMAIN_ID=7 $become "$1" -c "$3"
"""
    home = str(homes / str(STUDENT))
    done = subprocess.run(
        ["unshare", "--net", "bash", "-ec", script, "bash", sys.executable, HOLD, LIVE],
        cwd=home,
        env={"PATH": os.environ["PATH"], "HOME": home, "LANG": "C.UTF-8"},
        capture_output=True,
        text=True,
        timeout=120,
    )
    refused, chosen = done.stdout.splitlines() or [done.stderr, ""]
    assert "set ROS_DOMAIN_ID" in refused and chosen == "7", done.stdout + done.stderr


@pytest.fixture
def shared(tmp_path, monkeypatch):
    """A folder in the place of /tmp, and no runtime folder; the home is the test's."""
    (tmp_path / "shared").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "shared"))
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home/.cache"))
    return tmp_path / "shared" / f"ros2-course-{os.getuid()}"


def own_and_closed(folder: Path) -> bool:
    found = folder.lstat()
    return folder.is_dir() and (found.st_uid, found.st_mode & 0o777) == (os.getuid(), 0o700)


def test_a_link_that_another_user_laid_is_not_followed(shared, tmp_path):
    """It would lead the session's records to where everybody reads them, or over the student's own files."""
    (tmp_path / "open").mkdir(mode=0o755)
    shared.symlink_to(tmp_path / "open")
    os.lchown(shared, OTHER, OTHER)
    registry.write(registry.SessionRecord(os.getpid(), 7, "/", 1.0, processes.birth(os.getpid())))
    assert [record.pid for record in registry.running()] == [os.getpid()]
    assert list((tmp_path / "open").iterdir()) == [] and own_and_closed(runtime_folder())


@pytest.mark.parametrize("kind", ["folder", "file", "link to nothing"])
def test_a_name_that_another_user_took_is_left_to_them(shared, tmp_path, kind):
    """The grader's, too: what it waits for lies in the same folder."""
    if kind == "folder":
        shared.mkdir(mode=0o777)
    elif kind == "file":
        shared.write_text("")
    else:
        shared.symlink_to(tmp_path / "nothing")
    os.lchown(shared, OTHER, OTHER)
    assert own_and_closed(runtime_folder()) and runtime_folder().is_relative_to(tmp_path / "home")
    with registry.lock():
        registry.write(registry.SessionRecord(os.getpid(), 7, "/", 1.0, processes.birth(os.getpid())))
    assert [record.pid for record in registry.running()] == [os.getpid()]


def test_a_folder_that_everybody_may_enter_is_closed(shared):
    shared.mkdir(mode=0o755)
    assert runtime_folder() == shared and own_and_closed(shared)


def test_the_runtime_folder_of_another_user_is_not_used(shared, tmp_path, monkeypatch):
    """As with `sudo -E`: root would write where a student can turn the path elsewhere."""
    (tmp_path / "run").mkdir()
    os.chown(tmp_path / "run", OTHER, OTHER)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
    assert runtime_folder() == shared and list((tmp_path / "run").iterdir()) == []
