"""Authenticators of the hub: they check the password, limit wrong attempts, and send members to their own address."""

import asyncio
import contextlib
import functools
import secrets
from collections.abc import Callable
from typing import Any
from weakref import WeakValueDictionary

from jupyterhub import orm, roles
from jupyterhub.apihandlers.base import APIHandler
from jupyterhub.apihandlers.users import UserTokenListAPIHandler
from jupyterhub.auth import Authenticator, PAMAuthenticator
from jupyterhub.authenticators.shared import SharedPasswordAuthenticator
from jupyterhub.handlers.base import BaseHandler
from jupyterhub.handlers.login import LogoutHandler
from tornado.web import HTTPError
from traitlets import Float, Unicode

from autograder.classroom import accounts, addresses, attempts
from autograder.classroom.plan import Classroom

KNOWN = "classroom-known"  # the cookie of a browser in which a member has logged in
DAYS = 200
AT_ONCE = 32  # passwords that are checked at the same time
# Of these, at most so many from one address, or from all browsers in which a member has logged in: the others of that
# address or member wait, and delay nobody else.
FROM_ONE_PLACE = 8


class OwnTokens(UserTokenListAPIHandler):
    """Lets users make API tokens only for themselves: those for others would outlive the role of their maker."""

    def get_scope_filter(self, req_scope: str) -> Callable[..., bool]:
        """Return the function that says for which users a scope holds."""
        allowed: Callable[..., bool] = super().get_scope_filter(req_scope)
        if req_scope != "tokens":
            return allowed
        return lambda user, kind=None: user is self.current_user and allowed(user, kind=kind)


class Refused(APIHandler):
    """Refuses shared servers and groups: both would outlive the rights of the user who made them."""

    async def prepare(self) -> None:
        """Refuse every request."""
        raise HTTPError(403, "Sharing servers and groups are disabled in a class.")


class EndsLogins(LogoutHandler):
    """The page to log out, which ends all log-ins of its user: a cookie from before is no longer valid."""

    async def handle_logout(self) -> None:
        """Renew what the cookies of a user are made of."""
        if user := self.current_user:
            user.orm_user.cookie_id = secrets.token_hex(16)
            self.db.commit()


class Careful(Authenticator):
    """A base that counts wrong passwords, and sends instructors to their own address; `check` tries a password."""

    classroom: Classroom
    auth_refresh_age = Float(1e-6)  # s: each request checks for a new password; 0 would mean never

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self._attempts = attempts.Attempts()
        self._places: WeakValueDictionary[str, asyncio.Semaphore] = WeakValueDictionary()

    async def authenticate(self, handler: Any, data: dict[str, str]) -> str | None:
        """Return the member's name if the password is right, or None; raises HTTPError when it is not even tried."""
        name = self.normalize_username(data.get("username", ""))
        try:
            member = self.classroom.find(name)
        except KeyError:
            return None
        if not addresses.belongs(self.classroom, member.instructor, handler.request.host):
            raise HTTPError(403, f"Log in at {self.classroom.address_of(member)}")
        browser = _browser(handler, name)
        self._attempts.forget_before(name, attempts.unlocked(self.classroom, name))
        place = browser or handler.request.remote_ip
        if wait := self._attempts.begin(name, place, bool(browser)):
            raise HTTPError(429, f"Too many wrong passwords: try again in {wait:.0f} s, or ask your instructor.")
        whose = f"{name}:" if browser else place  # a member can have any number of browsers
        async with self._places.setdefault(whose, asyncio.Semaphore(FROM_ONE_PLACE)):
            if not await self.check(handler, data):
                return None
        self._attempts.succeeded(name, place)
        if user := handler.find_user(name):
            self._end_logins(user)
        if not browser:
            options = {"httponly": True, "samesite": "Lax", "secure": bool(self.classroom.certificate), "path": "/hub/"}
            value = f"{name}:{secrets.token_hex(16)}"
            handler.set_secure_cookie(KNOWN, value, expires_days=DAYS, **options)
        return name

    def get_handlers(self, app: Any) -> list[tuple[str, type[Any]]]:
        """Return the handlers of the log-in, and what comes before the hub's own."""
        _roll_back_whatever_fails()
        # When `refresh_user` says no, the hub (6.1) asks whether a request came by a token: by a cookie, it fails.
        BaseHandler._token_authenticated = getattr(BaseHandler, "_token_authenticated", False)
        for kind in (orm.Share, orm.ShareCode, orm.Group):  # in the database of a class that still had them
            for each in app.db.query(kind):
                app.db.delete(each)
        app.db.commit()
        refused = (r"/api/(?:shares|share-codes|groups)(?:/.*)?", r"/api/users/[^/]+/shared(?:/.*)?")
        own = [
            (r"/logout", EndsLogins),
            (r"/api/users/([^/]+)/tokens", OwnTokens),
            *((path, Refused) for path in refused),
        ]
        return [*super().get_handlers(app), *own]

    async def check(self, handler: Any, data: dict[str, str]) -> bool:
        """Return True if the password is right."""
        raise NotImplementedError

    def validate_username(self, username: str) -> bool:
        """Return True for a member: the hub forgets others when it starts, with their cookies and tokens."""
        return super().validate_username(username) and any(each.name == username for each in self.classroom.members)

    async def refresh_user(self, user: Any, handler: Any = None) -> bool:
        """Return False if a user logged in with a password that has been replaced.

        The class's roster alone decides who is an instructor, whatever was set in the hub.  Raises HTTPError for a
        request by a token from before the new password, which the hub (6.1) would serve once more.
        """
        instructor = any(each.name == user.name for each in self.classroom.instructors)
        if bool(user.orm_user.admin) is not instructor:
            user.orm_user.admin = instructor
            roles.assign_default_roles(user.db, user.orm_user)
            user.db.commit()
        ended = self._end_logins(user)
        if ended and getattr(handler, "_token_authenticated", False) and handler._jupyterhub_user is user:
            raise HTTPError(403, f"The password of {user.name} has changed: log in again.")
        return not ended

    def _end_logins(self, user: Any) -> bool:
        """End a user's logins from before a new password was set; return False if there is nothing to end.

        A code that the hub has given to a browser could be exchanged for a token later, so codes go, too.
        """
        if not accounts.take_renewal(self.classroom, user.name):
            return False
        user.orm_user.cookie_id = secrets.token_hex(16)
        for given in [*user.orm_user.api_tokens, *user.orm_user.oauth_codes]:
            user.db.delete(given)
        user.db.commit()
        return True


class MembersPAM(Careful, PAMAuthenticator):
    """Checks passwords of the Unix users, whose names have a prefix that nobody has to type."""

    prefix = Unicode().tag(config=True)

    async def check(self, handler: Any, data: dict[str, str]) -> bool:
        """Return True if PAM accepts the password."""
        return bool(
            await PAMAuthenticator.authenticate(self, handler, data | {"username": self.prefix + data["username"]})
        )

    def system_user_exists(self, user: Any) -> bool:
        """Return True: each member's Unix user, whose name is not the member's, was made before the hub was started."""
        return True


class SharedPassword(Careful, SharedPasswordAuthenticator):
    """One password for all students, and one for the instructors."""

    async def check(self, handler: Any, data: dict[str, str]) -> bool:
        """Return True if the password is that of the member's role."""
        return bool(await SharedPasswordAuthenticator.authenticate(self, handler, data))


def _roll_back_whatever_fails() -> None:
    """Have a request that leaves the database session unusable roll it back: all requests share one session.

    The hub (6.1) does so after an error of the database, but not when a value cannot be written at all, such as half
    of a surrogate pair (`"\\ud800"`) in the note of a token.
    """
    finish = BaseHandler.finish
    if hasattr(finish, "__wrapped__"):
        return

    @functools.wraps(finish)
    def rolling_back(self: BaseHandler, *args: Any, **kwargs: Any) -> Any:
        if not self.db.is_active:
            self.db.rollback()
        return finish(self, *args, **kwargs)

    BaseHandler.finish = rolling_back


def _browser(handler: Any, name: str) -> str:
    """Return the cookie of a browser in which this user has logged in before; '' for any other browser."""
    with contextlib.suppress(ValueError):
        found = (handler.get_secure_cookie(KNOWN, max_age_days=DAYS) or b"").decode()
        if found.startswith(f"{name}:"):
            return found
    return ""
