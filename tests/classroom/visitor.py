"""Somebody in a browser, without the browser: logs in at the hub, starts a server, opens notebooks, runs cells."""

import json
import socket
import time
import uuid
from dataclasses import dataclass, field
from http.cookiejar import Cookie, DefaultCookiePolicy
from typing import Any, Self
from urllib.parse import urlsplit
from urllib.request import Request

import requests
import websocket

SPAWNED = 180.0  # s until a server answers
RUN = 180.0  # s until a cell has run


LOCAL = ".localhost"  # the end of names that browsers look for on their own machine; the C library asks for them
NAMED = "class.example.org"  # a class with names of a domain, as a test has it on this machine
_look_up = socket.getaddrinfo


def _look_up_as_browsers_do(host: Any, *arguments: Any, **options: Any) -> Any:
    local = isinstance(host, str) and host.endswith((LOCAL, NAMED))
    return _look_up("127.0.0.1" if local else host, *arguments, **options)


socket.getaddrinfo = _look_up_as_browsers_do


class AsBrowsersDo(DefaultCookiePolicy):
    """Takes a cookie of `localhost` as that of this host alone; for Python's own it is of a whole top-level domain."""

    def set_ok_domain(self, cookie: Cookie, request: Request) -> bool:
        """Return True if a cookie may be set."""
        if cookie.domain == LOCAL == f".{urlsplit(request.get_full_url()).hostname}":
            cookie.domain, cookie.domain_specified = "localhost.local", False
        return super().set_ok_domain(cookie, request)


@dataclass
class Ran:
    """The result of a cell."""

    text: str = ""  # printed, shown and raised, in that order of coming
    error: str = ""  # the name of what was raised
    seconds: float = 0.0


@dataclass
class Visitor:
    """A person of the class."""

    hub: str  # its URL, with / at its end
    name: str
    session: requests.Session = field(default_factory=requests.Session)
    answer: requests.Response | None = None  # to the last try to log in

    def __post_init__(self) -> None:
        """Ignore the environment's proxies and certificates, which are not for this machine's own pages."""
        self.session.trust_env = False
        self.session.cookies.set_policy(AsBrowsersDo())

    def log_in(self, password: str) -> bool:
        """Log in as a browser does; whether the hub has accepted it."""
        self.session.get(f"{self.hub}hub/login").raise_for_status()
        data = {"username": self.name, "password": password, "_xsrf": self.session.cookies.get("_xsrf", path="/hub/")}
        self.answer = self.session.post(f"{self.hub}hub/login", params={"next": "/hub/home"}, data=data)
        return self.answer.url.endswith("/hub/home")

    def start(self) -> Self:
        """Start the server, and wait until it answers."""
        url = f"{self.hub}hub/api/users/{self.name}/server"
        answer = self.session.post(url, headers=self._headers("/hub/"))
        assert answer.status_code in (201, 202, 400), answer.text  # 400: it runs already

        events = self.session.get(f"{url}/progress", headers=self._headers("/hub/"), stream=True, timeout=SPAWNED)
        said = [json.loads(line.removeprefix(b"data:")) for line in events.iter_lines() if line.startswith(b"data:")]
        assert said and said[-1].get("ready"), f"{self.name}'s server did not start: {said[-1:]}"
        self.session.get(f"{self.base}lab").raise_for_status()  # which logs in at the server itself
        return self

    def stop(self) -> None:
        """End the server with all that runs in it."""
        url = f"{self.hub}hub/api/users/{self.name}/server"
        answer = self.session.delete(url, headers=self._headers("/hub/"), timeout=SPAWNED)
        assert answer.ok, answer.text

    @property
    def base(self) -> str:
        """Return where the own server is: on `localhost`, each has an address of its own."""
        local = self.hub.replace("://localhost:", f"://{self.name}{LOCAL}:")
        return f"{local}user/{self.name}/"

    def call(self, method: str, path: str, **options: Any) -> requests.Response:
        """Ask the own server; any of its answers is returned."""
        prefix = f"/user/{self.name}/"
        return self.session.request(method, self.base + path, headers=self._headers(prefix), **options)

    def cells(self, notebook: str) -> list[str]:
        """The code cells of a notebook."""
        content = self.call("GET", f"api/contents/{notebook}").json()["content"]
        return [cell["source"] for cell in content["cells"] if cell["cell_type"] == "code"]

    def kernel(self, folder: str = "") -> "Kernel":
        """A new kernel in a folder."""
        model = self.call("POST", "api/kernels", json={"name": "python3", "path": folder}).json()
        return Kernel(self, model["id"])

    def _headers(self, path: str) -> dict[str, str]:
        referer = self.hub if path == "/hub/" else self.base
        return {"X-XSRFToken": self.session.cookies.get("_xsrf", path=path) or "", "Referer": referer}


class Kernel:
    """A kernel, through a websocket."""

    def __init__(self, visitor: Visitor, number: str):
        """Connect to the kernel of this number."""
        self.visitor, self.number = visitor, number
        self.connect()

    def connect(self) -> None:
        """Connect, also anew."""
        visitor, number = self.visitor, self.number
        cookies = {cookie.name: cookie.value for cookie in visitor.session.cookies if cookie.path != "/hub/"}
        url = f"{visitor.base}api/kernels/{number}/channels".replace("http", "ws", 1)
        xsrf = visitor.session.cookies.get("_xsrf", path=f"/user/{visitor.name}/")
        self._socket = websocket.create_connection(
            f"{url}?_xsrf={xsrf}",
            timeout=RUN,
            cookie="; ".join(f"{name}={value}" for name, value in cookies.items()),
            origin="{0.scheme}://{0.netloc}".format(urlsplit(visitor.base)),
            sslopt={"ca_certs": visitor.session.verify} if isinstance(visitor.session.verify, str) else {},
        )

    def run(self, code: str) -> Ran:
        """Run a cell, and wait until the kernel is idle again."""
        number, ran, begin = uuid.uuid4().hex, Ran(), time.monotonic()
        header = {"msg_id": number, "msg_type": "execute_request", "username": "", "session": "", "version": "5.3"}
        content = {"code": code, "silent": False, "store_history": True, "allow_stdin": False}
        message = {"header": header, "parent_header": {}, "metadata": {}, "content": content, "channel": "shell"}
        self._socket.send(json.dumps(message))
        while True:
            answer = json.loads(self._socket.recv())
            if answer["parent_header"].get("msg_id") != number:
                continue
            said = answer["content"]
            if answer["msg_type"] == "stream":
                ran.text += said["text"]
            elif answer["msg_type"] in ("execute_result", "display_data"):
                ran.text += said["data"].get("text/plain", "")
            elif answer["msg_type"] == "error":
                ran.error = said["ename"]
                ran.text += f"{said['ename']}: {said['evalue']}"
            elif answer["msg_type"] == "status" and said["execution_state"] == "idle":
                ran.seconds = time.monotonic() - begin
                return ran

    def disconnect(self) -> None:
        """Leave it as it is."""
        self._socket.close()

    def close(self) -> None:
        """End it."""
        self.disconnect()
        self.visitor.call("DELETE", f"api/kernels/{self.number}")
