"""Requests of members' processes to the hub, and its records: as much as there is room for, and nothing else."""

import asyncio
import os
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
import requests
from tornado.web import Application, HTTPError, RequestHandler

from autograder.classroom import authenticators, hub_server, log_keeper
from course.foundation.waiting import wait_until
from tests.classroom.conftest import call_classroom, run_apart

STRANGER = 61001  # a user that this machine does not have
# Opens connections and holds them, as many as it is told, until it is told to go; says how many were taken.
HOLD = """
import socket, sys, time
held = []
for _ in range({count}):
    one = socket.socket(socket.AF_UNIX)
    one.connect({path!r})
    held.append(one)
def goes_on(one):
    one.settimeout(0.5)
    try:
        return one.recv(1) != b''
    except TimeoutError:
        return True
    except OSError:
        return False
print('held', sum(map(goes_on, held[-100:])), 'of', len(held[-100:]))
"""
ASK = """
import socket
one = socket.socket(socket.AF_UNIX)
one.settimeout(20)
one.connect({path!r})
one.send(b'GET {target} HTTP/1.1\\r\\nHost: x\\r\\nX-Forwarded-For: 192.0.2.7\\r\\nConnection: close\\r\\n\\r\\n')
said = b''
while part := one.recv(65536):
    said += part
print(said.decode())
"""


class From(RequestHandler):
    def get(self):
        self.write(f"from {self.request.remote_ip}")

    def post(self):
        self.write(f"read {len(self.request.body)} bytes")


@pytest.fixture
def socket_path():
    if os.geteuid() != 0:
        pytest.skip("connections of another user take root")
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        yield Path(folder) / "hub.sock"


def asked(socket_path, *asks) -> list[str]:
    """Return the result of each coroutine function of `asks`, run in turn while the members' socket is served."""

    async def run():
        pages = [("/hub/api(?:/.*)?", From), ("/hub/login", From)]
        server = hub_server.listen(socket_path, Application([(page, handler) for page, handler in pages]))
        found = [await ask() for ask in asks]
        server.stop()
        return found

    return run_apart(run())


def get(path, target):
    """A coroutine function that asks for something in a process of its own."""

    async def ask():
        text = ASK.format(path=str(path), target=target)
        child = await asyncio.create_subprocess_exec(sys.executable, "-c", text, stdout=asyncio.subprocess.PIPE)
        return (await child.communicate())[0].decode()

    return ask


def test_members_reach_the_api_alone_and_cannot_say_where_they_are(socket_path):
    api, users, login, outside = asked(
        socket_path, *[get(socket_path, path) for path in ("/hub/api", "/hub/api/users", "/hub/login", "/hub/apis")]
    )
    for answer in (api, users):
        assert "200 OK" in answer and "from 0.0.0.0" in answer and "192.0.2.7" not in answer
    for answer in (login, outside):
        assert "404 Not Found" in answer


@pytest.mark.parametrize("headers", ["Content-Length: {0}\r\n\r\n", "Transfer-Encoding: chunked\r\n\r\n{0:x}\r\n"])
def test_a_huge_request_is_not_read(socket_path, headers):
    """The hub has one thread, and parsing a time of 60 MB takes it minutes."""

    def post(size):
        async def ask():
            reader, writer = await asyncio.open_unix_connection(str(socket_path))
            writer.write(f"POST /hub/api HTTP/1.1\r\nHost: x\r\nConnection: close\r\n{headers.format(size)}".encode())
            writer.write(b"2" * size + (b"\r\n0\r\n\r\n" if "chunked" in headers else b""))
            answer = await asyncio.wait_for(reader.read(), 10)
            writer.close()
            return answer.decode()

        return ask

    small, huge = asked(socket_path, post(1000), post(hub_server.LARGEST + 1))
    assert "read 1000 bytes" in small and "read" not in huge


def test_thousands_of_headers_are_not_read(socket_path):
    def ask(count):
        async def asking():
            reader, writer = await asyncio.open_unix_connection(str(socket_path))
            headers = "".join(f"a{number}: b\r\n" for number in range(count))
            writer.write(f"GET /hub/api HTTP/1.1\r\nHost: x\r\nConnection: close\r\n{headers}\r\n".encode())
            answer = await asyncio.wait_for(reader.read(), 10)
            writer.close()
            return answer.decode()

        return asking

    few, many = asked(socket_path, ask(20), ask(1000))
    assert "200 OK" in few and "200 OK" not in many


def test_the_requests_of_one_user_are_spread_over_time_and_another_user_waits_for_none():
    time = [0.0]
    pace = hub_server.Pace(lambda: time[0])
    assert [pace.wait(1) for _ in range(hub_server.AT_ONCE)] == [0.0] * hub_server.AT_ONCE
    assert [pace.wait(1) for _ in range(3)] == pytest.approx([hub_server.EACH * number for number in (1, 2, 3)])
    assert pace.wait(2) == 0.0
    for _ in range(10_000):  # asked for and given up
        pace.wait(1)
    time[0] = (hub_server.AT_ONCE + hub_server.MOST) * hub_server.EACH
    assert pace.wait(1) <= 2 * hub_server.EACH, "the wait is bounded"


def test_a_request_that_waits_is_answered_in_its_turn_and_not_at_all_for_who_gives_up(socket_path, monkeypatch):
    handled, waits = [], {"/hub/api/first": 0.3, "/hub/api/given-up": 0.2}
    monkeypatch.setattr(From, "prepare", lambda handler: handled.append(handler.request.path))

    class Turns:
        def wait(self, user):
            assert user == 0
            return [*waits.values()][len(begun) - 1]

    monkeypatch.setattr(hub_server, "Pace", Turns)
    begun = []

    async def ask():
        def begin(path):
            begun.append(path)
            return f"GET {path} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n".encode()

        reader, writer = await asyncio.open_unix_connection(str(socket_path))
        writer.write(begin("/hub/api/first"))
        await asyncio.sleep(0.1)
        _, other = await asyncio.open_unix_connection(str(socket_path))
        other.write(begin("/hub/api/given-up"))
        await other.drain()
        other.close()
        return (await asyncio.wait_for(reader.read(), 10)).decode()

    (answer,) = asked(socket_path, ask)
    assert "200 OK" in answer and handled == ["/hub/api/first"]


def test_the_hub_itself_reads_no_huge_request(classroom):
    found = requests.post(f"{classroom.url}hub/login", data=b"2" * (hub_server.LARGEST + 1))
    assert found.status_code == 400


def test_who_holds_many_connections_leaves_room_for_others(socket_path):
    async def hold():
        held = []
        for _ in range(3 * hub_server.MOST):
            reader, writer = await asyncio.open_unix_connection(str(socket_path))
            held.append((reader, writer))
        closed = 0
        for reader, _ in held[hub_server.MOST :]:
            closed += await asyncio.wait_for(reader.read(), 10) == b""
        assert closed == 2 * hub_server.MOST
        answer = await as_a_stranger()
        for _, writer in held:
            writer.close()
        return answer

    async def as_a_stranger():
        connection = socket.socket(socket.AF_UNIX)
        os.seteuid(STRANGER)  # which the other end is told of this connection
        try:
            connection.connect(str(socket_path))
        finally:
            os.seteuid(0)
        reader, writer = await asyncio.open_unix_connection(sock=connection)
        writer.write(b"GET /hub/api HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
        answer = await asyncio.wait_for(reader.read(), 10)
        writer.close()
        return answer.decode()

    async def later():  # what was closed has room again
        while "200 OK" not in (answer := await get(socket_path, "/hub/api")()):
            await asyncio.sleep(0.05)
        return answer

    for answer in asked(socket_path, hold, later):
        assert "200 OK" in answer


def test_a_log_keeps_its_end_within_bounds(tmp_path):
    path = tmp_path / "hub.log"
    lines = b"".join(b"%d %s\n" % (number, b"x" * 60_000) for number in range(200))
    many = b"".join(b"%s line %d\n" % (b"x" * 1000, number) for number in range(30_000))
    said = lines + many + b"the last line\n"
    subprocess.run([sys.executable, "-m", "autograder.classroom.log_keeper", path], input=said, check=True)
    kept = [path, path.with_name("hub.log.1")]
    assert all(each.stat().st_size <= log_keeper.MOST for each in kept) and {*tmp_path.iterdir()} == {*kept}
    assert path.read_bytes().endswith(b"line 29999\nthe last line\n")


class Slow(authenticators.Careful):
    """Tries each password until it may stop."""

    def __init__(self, **options):
        super().__init__(**options)
        self.trying, self.most, self.stop = [], 0, asyncio.Event()

    async def check(self, handler, data):
        self.trying.append(data["username"])
        self.most = max(self.most, len(self.trying))
        if data["password"] == "wrong":  # a right one is known at once
            await self.stop.wait()
        self.trying.remove(data["username"])
        return data["password"] != "wrong"


class Members:
    certificate = ""

    def find(self, name):
        return type("Member", (), {"instructor": False, "name": name})()


class Handler:
    def __init__(self, place, cookie=None):
        self.request = type("Request", (), {"remote_ip": place, "host": "class"})()
        self.cookie = cookie

    def get_secure_cookie(self, *_, **__):
        return self.cookie

    def set_secure_cookie(self, *_, **__):
        pass

    def find_user(self, name):
        """The hub's user of that name: nobody has come in yet."""


@pytest.mark.parametrize("known", [False, True])
def test_who_tries_many_passwords_at_once_keeps_nobody_else_waiting(monkeypatch, known):
    """From one address, or by any number of browsers in which they have logged in."""
    monkeypatch.setattr(authenticators.Careful, "classroom", Members(), raising=False)
    monkeypatch.setattr(authenticators.addresses, "belongs", lambda *_: True)
    monkeypatch.setattr(authenticators.attempts, "unlocked", lambda *_: 0.0)

    async def run():
        slow = Slow()

        async def guess(number):
            data = {"username": "eve" if known else f"s{number % 30}", "password": "wrong"}
            cookie = f"eve:{number % 30}".encode() if known else None
            try:
                return await slow.authenticate(Handler("192.0.2.1", cookie), data)
            except HTTPError as error:
                return error.status_code

        guesses = [asyncio.create_task(guess(number)) for number in range(300)]
        await asyncio.sleep(0)  # all have begun
        right = slow.authenticate(Handler("192.0.2.2"), {"username": "ada", "password": "right"})
        assert await asyncio.wait_for(right, 10) == "ada"
        at_once = slow.most
        slow.stop.set()
        ended = await asyncio.gather(*guesses)
        return at_once, ended.count(429), ended.count(None)

    at_once, refused, wrong = run_apart(run())
    assert at_once == authenticators.FROM_ONE_PLACE + 1  # and ada
    assert (wrong, refused) == (150, 150)  # five of each name or browser


def test_one_address_cannot_take_all_connections_of_the_proxy(classroom):
    def connected(host):
        one = socket.create_connection(("127.0.0.1", classroom.port), source_address=(host, 0))
        one.setblocking(False)
        return one

    def is_open(one):
        try:
            return one.recv(1) != b""
        except BlockingIOError:
            return True
        except ConnectionError:
            return False

    def is_answered():
        with connected("127.0.0.9") as one:
            one.setblocking(True)
            try:
                one.sendall(b"GET /hub/login HTTP/1.0\r\nHost: localhost\r\n\r\n")
                return one.recv(12).startswith(b"HTTP/1.1 200")
            except ConnectionError:
                return False

    held = [connected("127.0.0.9") for _ in range(2010)]
    assert wait_until(lambda: sum(map(is_open, held)) == 2000, 20.0)
    assert not is_answered()
    assert requests.get(f"http://127.0.0.1:{classroom.port}/hub/login", headers={"Host": "localhost"}, timeout=20).ok
    for one in held:
        one.close()
    assert wait_until(is_answered, 20.0)  # the proxy learns one by one that they are closed


def test_a_member_who_holds_the_hubs_connections_keeps_nobody_out(classroom, ada, bob, kernel):
    hold = HOLD.format(count=600, path=str(classroom.hub_socket))
    live = kernel(bob)
    found = live.run(hold + "held_back = held")
    assert "held 0 of 100" in found.text, found
    assert ada.session.get(f"{classroom.url}hub/home", timeout=60).status_code == 200
    live.run("for one in held: one.close()")
    ask = ASK.format(path=str(classroom.hub_socket), target="/hub/login")
    assert wait_until(lambda: "404 Not Found" in live.run(ask).text, 60.0)  # there is room again, and no page to log in
    assert call_classroom("status", "--folder", str(classroom.folder)).returncode == 0
