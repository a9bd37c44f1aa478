"""The plan of a classroom: its members, files and settings; kept as JSON for the hub and for `down`."""

import hashlib
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Self
from urllib.parse import quote

from autograder.classroom.members import STAFF, Member
from autograder.errors import UsageError
from course.foundation import storage

COURSE_ID = "ros2"  # nbgrader's name for the course, as in `autograder.gradebook.config`
SETTINGS = "classroom.json"
WHOSE = "folder"  # a file in a class's folder of sockets: where the class is
RUN = Path("/run/ros2-classroom")  # sockets: a path in here is short enough for one, and gone after a restart
GIB = 1 << 30
LOCAL = "localhost"  # whose subdomains browsers look for on their own machine
STAFF_HOST = f"instructors.{LOCAL}"


@dataclass(frozen=True)
class Limits:
    """The limits of a student's server with all its kernels and nodes; an instructor's has four times as much."""

    memory: int = 3 * GIB  # bytes
    tasks: int = 1000  # processes and threads
    cores: float = 2.0  # processors' time
    kernel_idle: int = 3600  # s until a kernel that does nothing is ended, with its nodes
    server_idle: int = 7200  # s until a server without kernels and terminals is ended


@dataclass(frozen=True)
class Classroom:
    """A class on this machine."""

    folder: Path
    members: tuple[Member, ...]
    ip: str = "127.0.0.1"  # where the hub listens; '' on every address of the machine
    port: int = 8000
    certificate: str = ""
    key: str = ""
    passwords: str = "pam"
    prefix: str = "ros-"  # of the Unix users
    limits: Limits = Limits()
    host: str = ""  # whose subdomains are the servers' addresses, one each; '' when they share that of the hub
    staff_port: int = 0  # without `host`: where the instructors' own address is, on the machine itself alone

    @property
    def students(self) -> list[Member]:
        """The members who are not instructors."""
        return [member for member in self.members if not member.instructor]

    @property
    def instructors(self) -> list[Member]:
        """The instructors, of whom there is one at least."""
        return [member for member in self.members if member.instructor]

    @property
    def state(self) -> Path:
        """Return what only root may read: settings, the hub's database, logs, passwords, and what was made."""
        return self.folder / "state"

    @property
    def homes(self) -> Path:
        """The home folders."""
        return self.folder / "homes"

    @property
    def exchange(self) -> Path:
        """nbgrader's exchange."""
        return self.folder / "exchange"

    @property
    def grading(self) -> Path:
        """nbgrader's course folder, for instructors alone."""
        return self.folder / "grading"

    @property
    def run(self) -> Path:
        """The folder of the sockets."""
        return RUN / hashlib.sha256(str(self.folder).encode()).hexdigest()[:8]

    @property
    def hub_socket(self) -> Path:
        """Return the hub's socket for the members' servers, which see the folder that it is in."""
        return self.run / "hub" / "hub.sock"

    @property
    def proxy_socket(self) -> Path:
        """Return the hub's socket for the proxy; no member sees it."""
        return self.run / "hub.sock"

    @property
    def url(self) -> str:
        """Return where a browser on this machine finds it."""
        scheme, usual = ("https", 443) if self.certificate else ("http", 80)
        port = "" if self.port == usual else f":{self.port}"
        return f"{scheme}://{self.host or self.ip or LOCAL}{port}/"

    @property
    def staff_address(self) -> str:
        """Return the instructors' address when the servers share one: as the header `Host` says it; '' otherwise.

        It is a name of its own, because browsers send cookies to all ports of a name.
        """
        return "" if self.host else f"{STAFF_HOST}:{self.staff_port}"

    def address_of(self, member: Member) -> str:
        """The URL at which a member finds the class."""
        return f"http://{self.staff_address}/" if member.instructor and self.staff_address else self.url

    def home(self, member: Member) -> Path:
        """The home folder of a member, as this machine sees it."""
        return self.homes / member.name

    def socket(self, member: Member) -> Path:
        """Return where a member's server listens."""
        return self.run / "servers" / f"{member.name}.sock"

    def user(self, member: Member) -> str:
        """A member's Unix user."""
        return self.prefix + member.name

    @property
    def staff(self) -> str:
        """The Unix group of the instructors."""
        return f"{self.prefix}{STAFF}"

    def find(self, name: str) -> Member:
        """The member of that name; raises KeyError."""
        return {member.name: member for member in self.members}[name]

    def save(self) -> None:
        """Write the settings down; raises OSError."""
        fields = asdict(self) | {"folder": str(self.folder)}
        storage.replace(self.state / SETTINGS, json.dumps(fields, indent=1).encode(), storage.PRIVATE)

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Return what `save` wrote; raises UsageError when there is nothing."""
        try:
            fields: dict[str, Any] = json.loads((folder / "state" / SETTINGS).read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise UsageError(f"there is no classroom in {folder}; `environment/classroom up` makes one") from None
        except (OSError, ValueError) as error:
            raise UsageError(f"{folder / 'state' / SETTINGS} cannot be read: {error}") from None
        try:
            members = tuple(Member(**member) for member in fields.pop("members"))
            limits = Limits(**fields.pop("limits"))
            return cls(**fields | {"folder": Path(fields["folder"]), "members": members, "limits": limits})
        except (TypeError, KeyError) as error:
            raise UsageError(
                f"{folder / 'state' / SETTINGS} is damaged, or was written by a newer version: {error}"
            ) from None

    def limits_of(self, member: Member) -> Limits:
        """Return what a member's server may take."""
        own = self.limits
        if not member.instructor:
            return own
        return replace(own, memory=4 * own.memory, tasks=4 * own.tasks, cores=4 * own.cores)


def as_url(socket: Path) -> str:
    """The URL of a server that listens on a Unix socket, as JupyterHub and its proxy write it."""
    return f"http+unix://{quote(str(socket), safe='')}"
