"""The instructors' start page in the hub: the state of each exercise, and more time for students."""

import asyncio
import json
import math
import sys
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from jupyterhub.handlers.base import BaseHandler
from tornado import web

from autograder.classroom import box, course_files
from autograder.classroom.members import Member
from autograder.classroom.plan import Classroom
from autograder.errors import ClassroomError, UsageError
from autograder.gradebook.extensions import ALL
from course.foundation.times import MINUTES

PAGE = "class"  # below the hub's own prefix
LONGEST = 60.0  # s that finding the state of all exercises may take


def start_page(handler: BaseHandler) -> str:
    """Return the URL that somebody sees after logging in; "" for the hub's own default."""
    user = handler.current_user
    return f"{handler.hub.base_url}{PAGE}" if user and user.admin else ""


class ClassPage(BaseHandler):
    """The page that shows the state of each exercise, and gives students more time."""

    def initialize(self, classroom: Classroom) -> None:
        """Keep the class; its settings may change while the hub runs."""
        self._folder = classroom.folder

    @web.authenticated
    async def get(self) -> None:
        """Show the page."""
        self._instructor()
        await self._show()

    @web.authenticated
    async def post(self) -> None:
        """Give more time, or take it back, and show the result."""
        classroom, member = self._instructor()
        asked = {name: self.get_body_argument(name, "") for name in ARGUMENTS}
        try:
            command = extend(classroom, asked)
            await asyncio.to_thread(course_files.run, classroom, member, command)
        except (UsageError, ClassroomError) as error:
            self.set_status(400)
            await self._show(str(error), asked)
            return
        self.redirect(f"{self.hub.base_url}{PAGE}", status=303)

    def _instructor(self) -> tuple[Classroom, Member]:
        """Return the class and the instructor who asks; raises HTTPError for everybody else."""
        classroom = Classroom.load(self._folder)
        found = [each for each in classroom.instructors if each.name == self.current_user.name]
        if not found or not self.current_user.admin:
            raise web.HTTPError(403, "This page is for the instructors of the class.")
        return classroom, found[0]

    async def _show(self, problem: str = "", asked: Mapping[str, str] = MappingProxyType({})) -> None:
        known = await overview(self._folder)
        html = await self.render_template("class.html", **known, everything=ALL, problem=problem, asked=asked)
        self.finish(html)


ARGUMENTS = ("student", "exercise", "days", "until", "take_back")


def extend(classroom: Classroom, asked: dict[str, str]) -> list[str]:
    """Return the command that does what the form asks for; raises UsageError."""
    from autograder.submissions.times import parse_time

    if asked["student"] not in {member.name for member in classroom.students}:
        raise UsageError("choose a student")
    command = ["autograder", "extend", asked["student"], "--course", box.GRADING]
    if asked["exercise"] not in ("", ALL):
        command += [f"--assignment={asked['exercise']}"]
    if asked["take_back"]:
        return [*command, "--take-back"]
    if bool(asked["days"]) == bool(asked["until"]):
        raise UsageError("give a number of days or a time")
    if asked["until"]:
        return [*command, f"--until={parse_time(asked['until'] + ' UTC'):{MINUTES}} UTC"]
    try:
        days = float(asked["days"])
    except ValueError:
        days = math.nan
    if not 0 < days < math.inf:
        raise UsageError(f"{asked['days']!r} is not a number of days")
    return [*command, f"--days={days:g}"]


async def overview(folder: Any) -> dict[str, Any]:
    """Return what the page shows, found by a separate process; raises HTTPError when that fails."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-P", "-m", "autograder.classroom.overview", str(folder),
        stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE,
    )  # fmt: skip
    try:
        out, errors = await asyncio.wait_for(process.communicate(), LONGEST)
    except TimeoutError:
        process.kill()
        raise web.HTTPError(503, "The state of the class could not be read in time; try again.") from None
    if process.returncode:
        said = errors.decode(errors="replace").strip().splitlines() or ["no reason was given"]
        raise web.HTTPError(500, f"The state of the class could not be read: {said[-1]}")
    return dict(json.loads(out))
