"""The addresses of the servers: chosen so that a student's page cannot act as the instructor who opens it.

Each student controls what is served below /user/NAME, and a browser lets a page act on everything of the same origin.
Where DNS allows it, each server has a host name of its own, and the hub has another one.

Otherwise there are two proxies.  One, on the class's address, leads to the hub and to the students' servers; no
instructor can log in there.  The other, which only this machine can reach, leads to the hub and to the instructors'
servers.  Neither answers at the other's host name.
"""

from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlencode, urlsplit

from jupyterhub.handlers.base import BaseHandler
from jupyterhub.proxy import ConfigurableHTTPProxy
from tornado import web
from traitlets.config import Config

from autograder.classroom import hub
from autograder.classroom.plan import LOCAL, STAFF_HOST, Classroom, as_url

READING = ("GET", "HEAD", "OPTIONS")  # HTTP methods that change nothing


class StaffProxy(ConfigurableHTTPProxy):
    """The proxy that leads to the hub and to the instructors' servers."""

    instructors: frozenset[str] = frozenset()

    async def add_route(self, routespec: str, target: str, data: dict[str, Any]) -> None:
        """Add a route, unless a student's server is behind it."""
        if owner(routespec) in {"", *self.instructors}:
            await super().add_route(routespec, target, data)


class StudentsProxy(ConfigurableHTTPProxy):
    """The proxy that leads to the hub and to the students' servers; it also controls the instructors' proxy."""

    classroom: Classroom

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self._staff = StaffProxy(
            public_url=f"http://127.0.0.1:{self.classroom.staff_port}",
            api_url=as_url(self.classroom.run / "staff-proxy.sock"),
            pid_file=str(hub.staff_proxy_pid(self.classroom)),
            command=command(only=STAFF_HOST),
            auth_token=self.auth_token,
            app=self.app,
            hub=self.hub,
            db_factory=self.db_factory,
            log=self.log,
        )
        self._staff.instructors = frozenset(member.name for member in self.classroom.instructors)

    async def start(self) -> None:
        """Start both proxies; each then checks its own process."""
        await super().start()
        if self._staff.proxy_process is None:
            await self._staff.start()

    def stop(self) -> None:
        """Stop both proxies."""
        super().stop()
        self._staff.stop()

    async def add_route(self, routespec: str, target: str, data: dict[str, Any]) -> None:
        """Add a route to each proxy that may lead there."""
        if owner(routespec) not in self._staff.instructors:
            await super().add_route(routespec, target, dict(data or {}))
        await self._staff.add_route(routespec, target, dict(data or {}))

    async def delete_route(self, routespec: str) -> None:
        """Delete a route from both proxies."""
        await super().delete_route(routespec)
        await self._staff.delete_route(routespec)

    async def get_all_routes(self) -> dict[str, Any]:
        """Return the routes of both proxies."""
        return dict(await self._staff.get_all_routes()) | dict(await super().get_all_routes())


def owner(routespec: str) -> str:
    """Return the member whose server a route leads to; '' for the hub."""
    _, kind, name, *_ = [*routespec.split("/"), "", ""]
    return unquote(name) if kind == "user" else ""


def command(**names: str) -> list[str]:
    """Return the command that starts a proxy.

    It answers at `only` this host name, or at none that ends with `never`; without either, at any.
    """
    loaded = (Path(__file__).with_name("proxy") / "of_a_class.mjs").as_uri()
    return [str(hub.node()), "--import", f"{loaded}?{urlencode(names)}" if names else loaded, str(hub.proxy())]


def keep_apart(c: Config, classroom: Classroom) -> None:
    """Configure the hub to accept each member's log-in only at that member's address, and the routes to match."""
    if classroom.host:
        c.ConfigurableHTTPProxy.command = command()
        c.JupyterHub.subdomain_host = classroom.url.rstrip("/")
        c.JupyterHub.cookie_host_prefix_enabled = bool(classroom.certificate)  # such cookies need HTTPS
    else:
        StudentsProxy.classroom = classroom
        c.JupyterHub.proxy_class = StudentsProxy
        c.ConfigurableHTTPProxy.command = command(never=f".{LOCAL}")
        c.StudentsProxy = c.ConfigurableHTTPProxy
    instructors = {member.name for member in classroom.instructors}
    known = BaseHandler.get_current_user_cookie

    def at_own_address(handler: BaseHandler) -> Any:
        user = known(handler)
        if not user or elsewhere(handler.request.headers.get("Origin"), handler.request.host):
            return None
        return user if belongs(classroom, user.name in instructors, handler.request.host) else None

    BaseHandler.get_current_user_cookie = at_own_address
    prepare = BaseHandler.prepare

    async def prepare_own(handler: BaseHandler) -> None:
        """Refuse changes from pages of another origin, so that none of them logs a visitor in as somebody else."""
        origin = handler.request.headers.get("Origin")
        if handler.request.method not in READING and elsewhere(origin, handler.request.host):
            raise web.HTTPError(403, "A page of another address has asked for this: open the page of your class")
        await prepare(handler)

    BaseHandler.prepare = prepare_own


def elsewhere(origin: str | None, host: str) -> bool:
    """Return True if the request comes from another origin: browsers send cookies to all ports of a host name."""
    return origin is not None and urlsplit(origin).netloc.lower() != host.lower()


def belongs(classroom: Classroom, instructor: bool, address: str) -> bool:
    """Return True if somebody may log in at the address in a request's `Host` header.

    Where each server has a host name, so has the hub, and it must not be used at the others: students' pages are there.
    """
    if classroom.host:
        return address.lower() == urlsplit(classroom.url).netloc.lower()
    return (address.lower() == classroom.staff_address) is instructor
