"""The members, files and settings of a classroom; kept as JSON for the hub and for `down`."""

import hashlib
import json
import shlex
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Self
from urllib.parse import quote

from autograder.classroom.members import STAFF, STAFF_LABEL, Member
from autograder.errors import UsageError
from course.foundation import storage

COURSE_ID = "ros2"  # nbgrader's name for the course, as in `autograder.gradebook.config`
DEFAULT = Path("/srv/ros2-classroom")  # the folder of a class, if no other is given
SETTINGS = "classroom.json"
WHOSE = "folder"  # a file in a class's folder of sockets: the path of the class
RUN = Path("/run/ros2-classroom")  # for sockets: the paths are short enough, and gone after a reboot
GIB = 1 << 30
LOCAL = "localhost"  # browsers resolve its subdomains to their own machine
STAFF_HOST = f"{STAFF_LABEL}.{LOCAL}"


@dataclass(frozen=True)
class Limits:
    """The limits of a student's server with all its kernels and nodes; an instructor's has four times as much."""

    memory: int = 3 * GIB  # bytes
    tasks: int = 1000  # processes and threads
    cores: float = 2.0  # processor time, in cores
    kernel_idle: int = 3600  # s until a kernel that does nothing is ended, with its nodes
    server_idle: int = 7200  # s until a server without kernels and terminals is ended


@dataclass(frozen=True)
class Classroom:
    """A class on this machine."""

    folder: Path
    members: tuple[Member, ...]
    ip: str = "127.0.0.1"  # that the hub listens on; '' for every address of the machine
    port: int = 8000
    certificate: str = ""
    key: str = ""
    passwords: str = "pam"
    prefix: str = "ros-"  # of the Unix users
    limits: Limits = Limits()
    host: str = ""  # each server has a subdomain of it; '' if the servers share the hub's address
    staff_port: int = 0  # without `host`: the port of the instructors' address, on this machine only

    @property
    def students(self) -> list[Member]:
        """Return the members who are not instructors."""
        return [member for member in self.members if not member.instructor]

    @property
    def instructors(self) -> list[Member]:
        """Return the instructors, at least one."""
        return [member for member in self.members if member.instructor]

    @property
    def state(self) -> Path:
        """Return the folder that only root may read: settings, database, logs, passwords, and users that were made."""
        return self.folder / "state"

    @property
    def homes(self) -> Path:
        """Return the folder of the home folders."""
        return self.folder / "homes"

    @property
    def exchange(self) -> Path:
        """Return the folder of nbgrader's exchange."""
        return self.folder / "exchange"

    @property
    def grading(self) -> Path:
        """Return nbgrader's course folder, which only instructors can open."""
        return self.folder / "grading"

    @property
    def run(self) -> Path:
        """Return the folder of the sockets."""
        return RUN / hashlib.sha256(str(self.folder).encode()).hexdigest()[:8]

    @property
    def hub_socket(self) -> Path:
        """Return the hub's socket for the members' servers, in a folder that they see."""
        return self.run / "hub" / "hub.sock"

    @property
    def proxy_socket(self) -> Path:
        """Return the hub's socket for the proxy; no member sees it."""
        return self.run / "hub.sock"

    @property
    def url(self) -> str:
        """Return the URL of the class for a browser on this machine."""
        scheme, usual = ("https", 443) if self.certificate else ("http", 80)
        port = "" if self.port == usual else f":{self.port}"
        return f"{scheme}://{self.host or self.ip or LOCAL}{port}/"

    @property
    def staff_address(self) -> str:
        """Return the `Host` header of the instructors' address if the servers share an address; '' otherwise.

        It has a host name of its own, because browsers send cookies to all ports of a host.
        """
        return "" if self.host else f"{STAFF_HOST}:{self.staff_port}"

    def address_of(self, member: Member) -> str:
        """Return the URL at which a member finds the class."""
        return f"http://{self.staff_address}/" if member.instructor and self.staff_address else self.url

    def home(self, member: Member) -> Path:
        """Return the home folder of a member, as a path on this machine."""
        return self.homes / member.name

    def socket(self, member: Member) -> Path:
        """Return the socket that a member's server listens on."""
        return self.run / "servers" / f"{member.name}.sock"

    def user(self, member: Member) -> str:
        """Return the name of a member's Unix user."""
        return self.prefix + member.name

    @property
    def staff(self) -> str:
        """Return the name of the instructors' Unix group."""
        return f"{self.prefix}{STAFF}"

    def command(self, words: str) -> str:
        """Return the command line of `environment/classroom` for this class, as its instructors may copy it."""
        folder = "" if self.folder == DEFAULT else f" --folder {shlex.quote(str(self.folder))}"
        return f"environment/classroom {words}{folder}"

    def find(self, name: str) -> Member:
        """Return the member of that name; raises KeyError."""
        return {member.name: member for member in self.members}[name]

    def save(self) -> None:
        """Save the settings; raises OSError."""
        fields = asdict(self) | {"folder": str(self.folder)}
        storage.replace(self.state / SETTINGS, json.dumps(fields, indent=1).encode(), storage.PRIVATE)

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Return the classroom that `save` wrote; raises UsageError when there is none."""
        try:
            fields: dict[str, Any] = json.loads((folder / "state" / SETTINGS).read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise UsageError(f"there is no class in {folder}; `environment/classroom up` makes one") from None
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
        """Return the limits of a member's server."""
        own = self.limits
        if not member.instructor:
            return own
        return replace(own, memory=4 * own.memory, tasks=4 * own.tasks, cores=4 * own.cores)


def as_url(socket: Path) -> str:
    """Return the URL of a server on a Unix socket, in the form of JupyterHub and its proxy."""
    return f"http+unix://{quote(str(socket), safe='')}"
