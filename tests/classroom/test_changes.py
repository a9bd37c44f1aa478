"""Idle servers end; HTTPS; a member who leaves the class is out; `down` leaves nothing behind.

These tests have a class of their own, because they change it, one after the other, and end it.
"""

import contextlib
import csv
import grp
import os
import pwd
import re
import secrets
import shutil
import sqlite3
import subprocess
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import requests
import websocket

from autograder.classroom import accounts, course_files, homes, hub, servers
from autograder.classroom.certificate import check_covers, paths, warning
from autograder.classroom.plan import LOCAL, RUN, STAFF_HOST, Classroom
from autograder.errors import UsageError
from autograder.gradebook import members
from course.foundation import processes
from course.foundation.waiting import wait_until
from tests.browser.pages import SERVER
from tests.classroom import theft
from tests.classroom.conftest import COMMAND, ROSTER, run_classroom
from tests.classroom.visitor import NAMED, Kernel, Visitor
from tests.conftest import chromium_options
from tests.ports import free_port

IDLE = 0.25  # minutes until an idle kernel is ended; a kernel must have started in that time
WAIT = 600.0  # s


@pytest.fixture(scope="module")
def ended(able, tmp_path_factory):
    """A class that these tests end, and the arguments of its commands; at first nothing may be idle for long."""
    folder = tmp_path_factory.mktemp("ended")
    folder.parent.chmod(folder.parent.stat().st_mode | 0o011)
    folder.chmod(0o711)
    (folder / "roster.csv").write_text(ROSTER)
    common = ["--folder", str(folder / "class")]
    arguments = [
        *common,
        "--roster",
        str(folder / "roster.csv"),
        "--port",
        str(free_port()),
        "--prefix",
        f"g{secrets.token_hex(2)}-",
        "--host",
        "",  # a plain address
    ]
    done = run_classroom("up", *arguments, "--passwords", "dummy", "--idle", f"{IDLE}")
    try:
        assert done.returncode == 0, done.stderr
        yield Classroom.load(folder / "class"), arguments, common
    finally:
        run_classroom("down", *common, "--delete-homes")


def come_in(classroom: Classroom, name: str, password: str) -> Visitor:
    visitor = Visitor(classroom.address_of(classroom.find(name)), name)
    visitor.session.verify = classroom.certificate or True
    assert visitor.log_in(password)
    return visitor.start()


def passwords(classroom: Classroom) -> dict[str, str]:
    """Return each member's own password."""
    with open(classroom.state / accounts.PASSWORDS, newline="") as file:
        return {line["student"]: line["password"] for line in csv.DictReader(file)}


def programs(uid: int) -> dict[int, str]:
    """Return what the processes of a user run, by their number."""
    found = {}
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # it has ended meanwhile
            if process.stat().st_uid == uid:
                found[int(process.name)] = (process / "cmdline").read_bytes().decode(errors="replace")
    return found


def start_node(visitor: Visitor, uid: int) -> tuple[Kernel, list[int]]:
    """A kernel with a node of its own, and the numbers of their processes.

    On a busy machine a kernel may be ended before it does anything: then another one.
    """
    begin = time.monotonic()
    while time.monotonic() - begin < WAIT:
        live = visitor.kernel()
        with contextlib.suppress(websocket.WebSocketException):
            file = f"get_ipython().run_cell_magic('exercise', 'greeter.py', {SERVER!r})"
            ran = live.run(f"import course\nros = course.live()\n{file}")
            assert "running as /greeter" in ran.text, ran.text
            found = [
                pid
                for pid, command in programs(uid).items()
                if "greeter.py" in command or live.number in command  # which is in the name of its connection file
            ]
            if len(found) > 1:
                return live, found
    raise AssertionError("no kernel lived long enough")


@pytest.mark.matrix  # waits for what is idle; nothing else ends by itself
@pytest.mark.long("waits until kernels and a server have been idle for long enough")
@pytest.mark.timeout(1500)
def test_idle_kernels_end_with_their_nodes_and_then_the_idle_server(ended):
    classroom, _, _ = ended
    ada = classroom.find("ada")
    uid, _ = accounts.ids(classroom, ada)
    password = hub.shared_passwords(classroom)["students"]
    visitor = come_in(classroom, "ada", password)
    server = servers.started(classroom)["ada"]
    live, started = start_node(visitor, uid)  # its page is open, and nothing more is asked of it
    assert wait_until(lambda: not any(Path(f"/proc/{pid}/exe").exists() for pid in started), WAIT)
    assert server.alive and programs(uid), "they ended with the server alone"
    assert wait_until(lambda: not server.alive, WAIT), "the server is still there"
    assert not programs(uid)
    live.disconnect()
    again = come_in(classroom, "ada", password)
    assert again.call("GET", "api/kernels").json() == []
    again.stop()


@pytest.fixture(scope="module")
def certificate(tmp_path_factory):
    """A certificate that nobody has signed, and its key."""
    folder = tmp_path_factory.mktemp("certificate")
    made = folder / "server.pem", folder / "server.key"
    make_certificate(*made)
    return made


def make_certificate(certificate: Path, key: Path, days: int = 2, names: str = "IP:127.0.0.1") -> None:
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", str(days), "-subj", "/CN=class"]
    command += ["-addext", f"subjectAltName={names}", "-out", certificate, "-keyout", key]
    subprocess.run(command, check=True, capture_output=True)


@pytest.mark.matrix  # starts its class again; the tests below hold certificates, names and cookies
@pytest.mark.long("starts a class of its own, and an instructor opens pages of theft in a browser")
def test_with_a_certificate_everything_is_encrypted(ended, certificate, chromium):
    _, arguments, common = ended
    path, key = certificate
    again = run_classroom(
        "up", *arguments, "--ip", "127.0.0.1", "--passwords", "dummy", "--certificate", str(path), "--key", str(key)
    )
    assert again.returncode == 0, again.stderr
    assert "Without a certificate" not in again.stdout and "The certificate expires on " in again.stdout
    classroom = Classroom.load(Path(common[1]))
    assert classroom.url.startswith("https://127.0.0.1:")
    bob = come_in(classroom, "bob", hub.shared_passwords(classroom)["students"])
    assert all(cookie.secure for cookie in bob.session.cookies if cookie.name != "_xsrf")
    assert bob.kernel().run("print(6 * 7)").text == "42\n"
    with pytest.raises(requests.exceptions.SSLError):  # it is this certificate and no other
        requests.get(classroom.url, timeout=WAIT)
    with pytest.raises(requests.ConnectionError):
        requests.get(classroom.url.replace("https", "http"), timeout=WAIT)
    theirs, same = theft.steal(chromium, classroom, bob, hub.shared_passwords(classroom)["instructors"])
    assert any('"token":' in text and "stolen" in text for text in same), "what a page of the hub's own could do"
    assert theft.loot(theirs) == []


@pytest.mark.matrix  # starts its class again; tests/classroom/test_addresses.py has the attack with other names
@pytest.mark.long("starts a class of its own twice")
def test_where_names_are_one_site_a_students_page_gets_nothing_either(ended, chromium):
    """Browsers hold each NAME.localhost for a site of its own; the names of a domain are one, so cookies are sent."""
    classroom, arguments, _ = ended
    again = run_classroom("up", *arguments, "--passwords", "dummy", "--host", NAMED)
    assert again.returncode == 0, again.stderr
    assert f"Each server has its own address, NAME.{NAMED}, " in again.stdout
    classroom = Classroom.load(classroom.folder)
    students, instructors = (hub.shared_passwords(classroom)[who] for who in ("students", "instructors"))
    bob = come_in(classroom, "bob", students)
    # A page of a subdomain may set cookies of the whole domain, which reach the hub beside its own or before them.
    own = {cookie.name: cookie.value for cookie in bob.session.cookies if cookie.path == "/hub/"}
    assert {"_xsrf", "jupyterhub-hub-login"} <= own.keys()
    tossed = [
        f"{name}={value}; domain={NAMED}; path={path}" for name, value in own.items() for path in ("/", "/hub/api")
    ]
    options = chromium_options()
    here = f"--host-resolver-rules=MAP {NAMED} 127.0.0.1,MAP *.{NAMED} 127.0.0.1"
    browser = chromium.browser_type.launch(**options | {"args": [*options["args"], here]})
    try:
        theirs, same = theft.steal(browser, classroom, bob, instructors, tossed)
    finally:
        browser.close()
    assert any('"token":' in text and "stolen" in text for text in same), "what a page of the hub's own could do"
    assert theft.loot(theirs) == []


# Each is small enough for itself; together they take more than the server may.
MANY = """
import subprocess, sys, time
hold = "held = b'x' * (300 << 20); print('held', flush=True); input()"
programs = [subprocess.Popen([sys.executable, "-c", hold], stdin=-1, stdout=-1) for _ in range(4)]
while all(each.poll() is None for each in programs):
    time.sleep(0.1)
print({each.poll() for each in programs} <= {None, -9})
"""
# A command whose processes see no control groups.
WITHOUT_GROUPS = ["unshare", "--mount", "sh", "-c", 'mount -t tmpfs tmpfs /sys/fs/cgroup && exec "$@"', "sh"]


@pytest.mark.matrix  # starts its class again; test_memory_limit.py has it without a hub
@pytest.mark.long("the class is started again, and its hub looks at the memory of servers every few seconds")
def test_the_hub_ends_the_largest_of_programs_that_take_too_much_together(ended):
    """On a machine without control groups: the kernel and the server go on, and the log names the student."""
    classroom, arguments, _ = ended
    up = [*WITHOUT_GROUPS, COMMAND, "up", *arguments, "--passwords", "dummy", "--memory", "1"]
    again = subprocess.run(up, capture_output=True, text=True, timeout=WAIT)
    assert again.returncode == 0, again.stderr
    classroom = Classroom.load(classroom.folder)
    bob = come_in(classroom, "bob", hub.shared_passwords(classroom)["students"])
    bob.stop()  # it may have been started with more
    live = bob.start().kernel()
    assert live.run(MANY).text == "True\n"
    assert live.run("for each in programs: each.kill()").error == "" and bob.call("GET", "api/status").ok
    assert not servers.started(classroom)["bob"].groups
    assert "bob took more than 1.0 GiB" in (classroom.state / hub.LOG).read_text()
    bob.stop()


def test_a_wrong_certificate_is_told_in_a_line(ended, certificate, tmp_path):
    _, arguments, _ = ended
    good, key = certificate
    other, others_key, locked, nonsense = (tmp_path / name for name in ("other.pem", "other.key", "locked", "nonsense"))
    make_certificate(other, others_key)
    nonsense.write_text("no certificate")
    lock = ["openssl", "pkey", "-in", key, "-out", locked, "-aes256", "-passout", "pass:secret"]
    subprocess.run(lock, check=True, capture_output=True)
    for wrong, wrong_key, said in (
        (nonsense, key, f"{nonsense} contains no certificate: a PEM file is needed"),
        (good, nonsense, f"{nonsense} contains no key: a PEM file is needed"),
        (good, others_key, f"{others_key} is not the key of {good}"),
        (good, locked, f"{locked} is protected by a password"),
        (good, tmp_path, f"there is no file {tmp_path}"),
    ):
        with pytest.raises(UsageError, match=re.escape(said)):
            paths(wrong, wrong_key)
    done = run_classroom("up", *arguments, "--dry-run", "--certificate", str(good), "--key", str(others_key))
    assert (done.returncode, done.stderr) == (2, f"classroom: {others_key} is not the key of {good}\n")


def test_a_certificate_that_ends_is_told(certificate):
    path, now = str(certificate[0]), datetime.now(UTC)
    assert warning(path, now).startswith("The certificate expires on ")  # it is valid for two days
    assert warning(path, now + timedelta(days=3)).startswith("The certificate expired on ")
    assert warning(path, now - timedelta(days=1)).startswith("The certificate is not valid before ")
    assert warning(path + ".gone", now) == f"The certificate {path}.gone no longer exists or cannot be read."
    assert warning("", now).startswith("Without a certificate: ")


@pytest.mark.parametrize(
    ("names", "missing"),
    [
        ("DNS:class.example.org,DNS:*.class.example.org", None),
        ("DNS:CLASS.example.org,DNS:*.Class.Example.org", None),  # names of hosts know no capitals
        ("DNS:class.example.org", "*.class.example.org"),
        ("DNS:*.class.example.org", "class.example.org"),
        ("DNS:*.example.org", "class.example.org and *.class.example.org"),  # `*` is one label
        ("IP:127.0.0.1", "class.example.org and *.class.example.org"),
    ],
)
def test_a_certificate_must_hold_for_the_hub_and_for_each_server(tmp_path, names, missing):
    path = tmp_path / "server.pem"
    make_certificate(path, tmp_path / "server.key", names=names)
    if missing is None:
        check_covers(path, "class.example.org")
    else:
        with pytest.raises(UsageError, match=f"is not for {re.escape(missing)}: --host needs one"):
            check_covers(path, "class.example.org")


def test_a_certificate_that_lasts_is_not_spoken_of(tmp_path):
    path = tmp_path / "server.pem"
    make_certificate(path, tmp_path / "server.key", days=90)
    assert warning(str(path), datetime.now(UTC)) == ""


@pytest.mark.long("the class is started again, with PAM, and three people come in")
def test_who_leaves_the_class_is_out_and_pam_knows_each_ones_own_password(ended):
    classroom, arguments, _ = ended
    known = hub.shared_passwords(classroom)
    come_in(Classroom.load(classroom.folder), "bob", known["students"])  # with a certificate, if that test has run
    (classroom.folder.parent / "roster.csv").write_text(ROSTER.replace("bob,student\n", ""))
    many = classroom.exchange / "ros2/outbound/many"  # as an instructor who leaves may have left it
    many.mkdir()
    for number in range(homes.MOST_FILES + 1):
        (many / str(number)).touch()
    again = run_classroom("up", *arguments, "--passwords", "pam")
    shutil.rmtree(many)
    assert again.returncode == 0, again.stderr
    assert "copied into the home folders: " in again.stderr and "outbound: more than 2000 files" in again.stderr
    assert f"instructors log in only at http://{classroom.staff_address}/" in again.stdout
    assert "Ended the server of bob" in again.stdout and not servers.started(classroom)
    assert {*members.read(classroom.grading).values()} == {"ada", "teacher"}  # from whom hand-ins are collected
    own = passwords(classroom)
    assert own.keys() == {"ada", "teacher"}
    assert not Visitor(classroom.url, "bob").log_in(known["students"])
    assert not Visitor(classroom.url, "ada").log_in(own["teacher"])
    for name, password in own.items():
        sleeper = "import subprocess; subprocess.Popen(['setsid', '-f', 'sleep', '1000'])"
        assert come_in(classroom, name, password).kernel().run(sleeper).error == ""


@pytest.mark.long("a student and an instructor come in, and the instructor opens pages of theft in a browser")
def test_without_names_instructors_have_an_address_that_no_students_server_shares(ended, chromium):
    """The class is on a plain address."""
    classroom, _, common = ended
    own = passwords(classroom)
    staff = f"http://{classroom.staff_address}/"
    assert classroom.staff_address and classroom.address_of(classroom.find("teacher")) == staff
    there = Visitor(classroom.url, "teacher")
    assert not there.log_in(own["teacher"]) and f"Log in at {staff}" in there.answer.text
    assert not Visitor(staff, "ada").log_in(own["ada"])
    ada = come_in(classroom, "ada", own["ada"])
    teacher = come_in(classroom, "teacher", own["teacher"])
    assert teacher.call("GET", "api/status").ok
    assert not teacher.session.get(f"{teacher.hub}user/ada/api/status").ok, "ada's server is behind the same address"
    theirs, same = theft.steal(chromium, classroom, ada, own["teacher"])
    assert any('"token":' in text and "stolen" in text for text in same), "what a page of the hub's own could do"
    assert theft.loot(theirs) == []
    assert f"instructors log in only at {staff}" in run_classroom("status", *common).stdout


@pytest.mark.parametrize(
    ("of_instructors", "name"),
    [
        *[(False, f"{before}{STAFF_HOST}{after}") for before in ("", "x.") for after in ("", ".")],
        *[(False, STAFF_HOST.upper()), (False, f"ada.{LOCAL}")],  # the latter may be of another class
        *[(True, name) for name in (LOCAL, "127.0.0.1", f"x.{STAFF_HOST}", "class.example.org")],
    ],
)
def test_neither_address_answers_at_the_others_name(ended, of_instructors, name):
    """Browsers send the cookies of a name to each of its ports, and take them from there."""
    classroom = Classroom.load(ended[0].folder)
    port = classroom.staff_port if of_instructors else classroom.port
    own = STAFF_HOST if of_instructors else "127.0.0.1"
    upgrade = {"Connection": "Upgrade", "Upgrade": "websocket"}

    def get(host: str, path: str, **headers: str) -> requests.Response:
        headers["Host"] = f"{host}:{port}"
        return requests.get(f"http://127.0.0.1:{port}{path}", headers=headers, allow_redirects=False, timeout=WAIT)

    for path, headers in (("/", {}), ("/hub/login", {}), ("/user/ada/lab", {}), ("/user/ada/api", upgrade)):
        refused = get(name, path, **headers)
        assert refused.status_code == 404 and "Set-Cookie" not in refused.headers, path
    answer = get(own, "/hub/login")
    assert answer.ok and "_xsrf=" in answer.headers["Set-Cookie"]
    assert "domain=" not in answer.headers["Set-Cookie"].lower()  # of this name alone


def test_a_new_password_ends_what_was_logged_in_before(ended):
    """Somebody else may know the former one."""
    classroom, _, _ = ended
    own = passwords(classroom)
    before = come_in(classroom, "ada", own["ada"])
    assert before.call("GET", "api/status").ok and "ada" in servers.started(classroom)
    done = run_classroom("password", "ada", "--folder", str(classroom.folder))
    assert done.returncode == 0, done.stderr
    assert "ada" not in servers.started(classroom)
    assert before.session.get(f"{classroom.url}hub/home").url.partition("?")[0].endswith("/hub/login")
    assert not Visitor(classroom.url, "ada").log_in(own["ada"])
    own = passwords(classroom)
    after = come_in(classroom, "ada", own["ada"])
    assert after.call("GET", "api/status").ok
    assert before.session.get(f"{classroom.url}hub/home").url.partition("?")[0].endswith("/hub/login")


def test_whoever_left_the_class_is_forgotten_by_the_hub(ended):
    """Bob has left: who is entered by that name later begins with no cookie and no token of his."""
    classroom, _, _ = ended
    with sqlite3.connect(f"file:{classroom.state / 'jupyterhub.sqlite'}?mode=ro", uri=True) as hubs:
        assert {name for (name,) in hubs.execute("select name from users")} == {"ada", "teacher"}
    said = (classroom.state / hub.LOG).read_text()
    assert "bob is not in the class any more" in said and "already in db" not in said


def test_a_hubs_log_keeper_ends_with_it_although_servers_go_on(ended):
    classroom, _, _ = ended
    assert servers.started(classroom)
    log = str(classroom.state / hub.LOG).encode()
    assert sum(log in path.read_bytes() for path in Path("/proc").glob("[0-9]*/cmdline")) == 1


def inside(networks: set[str]) -> set[tuple[int, int]]:
    """The processes in these networks, each with its `birth`: the number of a network that is gone is used again."""
    found = set()
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if os.readlink(process / "ns/net") in networks:
                found.add((int(process.name), processes.birth(int(process.name))))
    return found


def traces(classroom: Classroom, uids: set[int], members_of_networks: set[tuple[int, int]]) -> list[str]:
    """Everything on this machine that belongs to the class."""
    found = [user.pw_name for user in pwd.getpwall() if user.pw_name.startswith(classroom.prefix)]
    found += [group.gr_name for group in grp.getgrall() if group.gr_name.startswith(classroom.prefix)]
    found += [str(path) for path in Path("/sys/fs/cgroup").glob(f"**/ros2-classroom-{classroom.run.name}-*")]
    found += [str(path) for path in RUN.glob(classroom.run.name)]
    for process in Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().decode(errors="replace")
            variables = (process / "environ").read_bytes().decode(errors="replace")
            if process.stat().st_uid in uids or str(classroom.folder) in words + variables:
                found.append(f"{process.name} {words[:80]}")
            if (int(process.name), processes.birth(int(process.name))) in members_of_networks:
                found.append(f"{process.name} is in a student's network")
            if str(classroom.folder) in (process / "mountinfo").read_text():
                found.append(f"{process.name} has a folder of the class mounted")
        except OSError:  # it has ended meanwhile
            continue
    return found


def test_down_leaves_nothing(ended):
    classroom, _, common = ended
    uids = {accounts.ids(classroom, member)[0] for member in classroom.members}
    networks = {
        os.readlink(f"/proc/{child}/ns/net")
        for server in servers.started(classroom).values()
        for child in children(server.pid)
    }
    assert len(networks) == 2 and os.readlink("/proc/self/ns/net") not in networks
    before = inside(networks)
    assert before and traces(classroom, uids, before), "nothing was found while the class was up"

    dry = run_classroom("down", *common, "--dry-run")
    assert dry.returncode == 0 and "Would end the hub and 2 servers" in dry.stdout
    assert hub.running(classroom)

    down = run_classroom("down", *common)
    assert down.returncode == 0, down.stderr
    assert traces(classroom, uids, before) == []
    kept = classroom.home(classroom.find("ada"))
    assert (kept / "notebooks" / "index.ipynb").exists() and kept.stat().st_uid in uids
    assert classroom.folder.stat().st_mode & 0o077 == 0  # who gets a number of theirs now does not get in


def test_a_group_that_gets_the_number_of_the_instructors_gets_nothing_of_theirs(ended):
    classroom, _, _ = ended
    former = classroom.grading.stat().st_gid
    members = {each.name: classroom.home(each).stat() for each in classroom.members}
    stranger = f"{classroom.prefix}strangers"
    accounts.remove(classroom)
    of_a_group = members["bob"].st_gid  # which a user has, too: these are two things
    taken = Path("/etc/passwd").read_text().splitlines()
    if str(of_a_group) not in [line.split(":")[2] for line in taken]:
        subprocess.run(["useradd", "-M", "-N", "--uid", str(of_a_group), stranger], check=True)
    try:
        for number_is_taken in (False, True):
            if number_is_taken:
                subprocess.run(["groupadd", "--gid", str(former), stranger], check=True)
            course_files.make_folders(classroom)
            accounts.make(classroom)
            course_files.make_shared(classroom)
            assert (accounts.staff_id(classroom) != former) is number_is_taken
            for each in classroom.members:
                assert accounts.ids(classroom, each) == (members[each.name].st_uid, members[each.name].st_gid)
            files = [path for top in (classroom.grading, classroom.exchange) for path in top.rglob("*")]
            theirs = [path for path in files if path.lstat().st_gid == accounts.staff_id(classroom)]
            assert {"gradebook.db", "outbound"} <= {path.name for path in theirs}
            assert [path for path in files if path.lstat().st_gid == former and number_is_taken] == []
            accounts.remove(classroom)
    finally:
        accounts.remove(classroom)
        subprocess.run(["userdel", stranger], check=False)
        subprocess.run(["groupdel", stranger], check=False)


def children(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
