"""The addresses of the servers, such that no page of a student's can act as the instructor who opens it.

What answers below /user/NAME is in the hands of that student, and its pages may do what a browser lets a page do with
all that has the same address.  Where names allow it, each server has a name of its own, and the hub another one.

Otherwise there are two proxies.  The one on the class's address leads to the hub and to the
students' servers, and the hub takes nobody there for an instructor.  The other one, on the machine itself alone, leads
to the hub and to the instructors' servers.
"""

from typing import Any
from urllib.parse import unquote, urlsplit

from jupyterhub.handlers.base import BaseHandler
from jupyterhub.proxy import ConfigurableHTTPProxy
from tornado import web
from traitlets.config import Config

from autograder.classroom import hub
from autograder.classroom.plan import Classroom, as_url

READING = ("GET", "HEAD", "OPTIONS")  # methods that change nothing


class StaffProxy(ConfigurableHTTPProxy):
    """Leads to the hub, and to the instructors' servers."""

    instructors: frozenset[str] = frozenset()

    async def add_route(self, routespec: str, target: str, data: dict[str, Any]) -> None:
        """Add a route, unless a student's server is behind it."""
        if owner(routespec) in {"", *self.instructors}:
            await super().add_route(routespec, target, data)


class StudentsProxy(ConfigurableHTTPProxy):
    """Leads to the hub, and to the students' servers; the instructors' proxy is started, told and ended with it."""

    classroom: Classroom

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self._staff = StaffProxy(
            public_url=f"http://127.0.0.1:{self.classroom.staff_port}",
            api_url=as_url(self.classroom.run / "staff-proxy.sock"),
            pid_file=str(hub.staff_proxy_pid(self.classroom)),
            command=self.command,
            auth_token=self.auth_token,
            app=self.app,
            hub=self.hub,
            db_factory=self.db_factory,
            log=self.log,
        )
        self._staff.instructors = frozenset(member.name for member in self.classroom.instructors)

    async def start(self) -> None:
        """Start both; each looks after itself then."""
        await super().start()
        if self._staff.proxy_process is None:
            await self._staff.start()

    def stop(self) -> None:
        """End both."""
        super().stop()
        self._staff.stop()

    async def add_route(self, routespec: str, target: str, data: dict[str, Any]) -> None:
        """Add a route to each proxy that may lead there."""
        if owner(routespec) not in self._staff.instructors:
            await super().add_route(routespec, target, dict(data or {}))
        await self._staff.add_route(routespec, target, dict(data or {}))

    async def delete_route(self, routespec: str) -> None:
        """Delete a route from both."""
        await super().delete_route(routespec)
        await self._staff.delete_route(routespec)

    async def get_all_routes(self) -> dict[str, Any]:
        """The routes of both."""
        return dict(await self._staff.get_all_routes()) | dict(await super().get_all_routes())


def owner(routespec: str) -> str:
    """Return whose server a route leads to; '' for the hub."""
    _, kind, name, *_ = [*routespec.split("/"), "", ""]
    return unquote(name) if kind == "user" else ""


def keep_apart(c: Config, classroom: Classroom) -> None:
    """Have the hub take members for who they are at their own address alone, and route to the servers accordingly."""
    if classroom.host:
        c.JupyterHub.subdomain_host = classroom.url.rstrip("/")
        c.JupyterHub.cookie_host_prefix_enabled = bool(classroom.certificate)  # such cookies need HTTPS
    else:
        StudentsProxy.classroom = classroom
        c.JupyterHub.proxy_class = StudentsProxy
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
        """Also for who is not logged in: no page of another address logs a visitor in as somebody else."""
        origin = handler.request.headers.get("Origin")
        if handler.request.method not in READING and elsewhere(origin, handler.request.host):
            raise web.HTTPError(403, "A page of another address has asked for this: open the page of your class")
        await prepare(handler)

    BaseHandler.prepare = prepare_own


def elsewhere(origin: str | None, host: str) -> bool:
    """Return True if a page of another address asks: browsers keep cookies for a name, whatever the port."""
    return origin is not None and urlsplit(origin).netloc.lower() != host.lower()


def belongs(classroom: Classroom, instructor: bool, address: str) -> bool:
    """Return True if somebody may come in at the address that a request's header `Host` says.

    With a name for each server the hub has one, too; it would answer below the others, where students' pages are.
    """
    if classroom.host:
        return address.lower() == urlsplit(classroom.url).netloc.lower()
    return (address.lower() == classroom.staff_address) is instructor
