"""The box of a member: a bubblewrap sandbox around their server, kernels, nodes and terminals.

Not to be confused with the sandbox of a graded program (`autograder.sandbox`).  Each box has its own network and
process namespaces, its own /tmp and /dev/shm, and a read-only system.  It can be reached only through Unix sockets.  A
student sees their home folder, nbgrader's exchange, the environment of the course and the package `course`, but nothing
of the grader, the solutions or the other members.  An instructor sees the whole checkout, and the folder in which the
class is graded.
"""

import json
import shlex
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from autograder.classroom import accounts, serve
from autograder.classroom.members import Member
from autograder.classroom.plan import COURSE_ID, GIB, Classroom
from autograder.paths import COURSE, private, repository
from autograder.sandbox import networks, seccomp, view
from course import environment

EXCHANGE = "/srv/exchange"
GRADING = "grading"  # nbgrader's course folder, in the home of each instructor
CONFIGURATION = "/opt/classroom"  # Jupyter's configuration, in place of the environment's
SERVER = f"{CONFIGURATION}/serve.py"
# The first program of a box into which a server is forked: it writes to its socket, and ends when that is closed.
HOLD = ["sh", "-c", "echo >&0; read -r _ || :"]
TEMPORARY, SHARED_MEMORY = GIB, GIB // 4  # bytes of /tmp and of /dev/shm
FILE = 2 * GIB  # bytes of one file
DESCRIPTORS = 1024  # of one process of a student, so that a student cannot use up those of the whole machine
TERMINALS = 64  # pseudo-terminals of a student's box; the machine has only some thousands for all
# A network namespace, and a process namespace that ends with its first process.
ALONE = ["unshare", "--net", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc", "--"]
# Mounted over bubblewrap's own file systems, which have no size limit.
MOUNT_TERMINALS = f"mount -t devpts -o newinstance,ptmxmode=0666,mode=620,max={TERMINALS} devpts /dev/pts"
STAFF_ONLY = ("course-list", "create-assignment", "formgrader", "validate-assignment")  # of nbgrader's extensions
STAFFS = {"assignment-list": True} | dict.fromkeys(STAFF_ONLY, True)
STUDENTS = {"assignment-list": True} | dict.fromkeys(STAFF_ONLY, False)
# Of JupyterLab, as in environment/install: news are from the internet; a chart that was handed in reads the files of
# whoever opens it, and a workspace that was handed in runs a script of its author.
NEVER = (
    "@jupyterlab/apputils-extension:announcements",
    "@jupyterlab/apputils-extension:workspaces",
    "@jupyterlab/vega5-extension",
    "@jupyterlab/workspaces-extension",
)


def home(member: Member) -> str:
    """Return the path of the home folder, as the member sees it."""
    return f"/home/{member.name}"


def notebooks(member: Member) -> str:
    """Return the folder that a member's notebooks are in, and that fetched assignments go into."""
    return f"{home(member)}/notebooks"


def command(classroom: Classroom, member: Member, argv: list[str], to_read: Callable[[bytes], str]) -> list[str]:
    """Return the command line, to be run by root, that runs `argv` in a member's box.

    `to_read` turns a file's content into a descriptor that the command inherits.
    """
    uid, gid = accounts.ids(classroom, member)
    bwrap = ["bwrap", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try", "--hostname", "classroom"]
    bwrap += ["--die-with-parent", "--cap-drop", "ALL"]
    bwrap += [word for name in ("SETUID", "SETGID", "SETPCAP") for word in ("--cap-add", f"CAP_{name}")]
    become = ["setpriv", f"--reuid={uid}", f"--regid={gid}", "--inh-caps=-all"]
    # An instructor grades.  Grading makes namespaces, and needs to become root in them, so this box must allow both.
    if member.instructor:
        become += ["--init-groups"]
    else:
        bwrap += ["--unshare-pid"]
        if seccomp.available():
            bwrap += ["--seccomp", to_read(seccomp.program(server=True))]
        become += ["--clear-groups", "--bounding-set=-all", "--no-new-privs"]
    bwrap += _view(classroom, member, to_read)
    limited = ["prlimit", *(f"--{name}={most}" for name, most in limits(classroom, member).items()), "--"]
    inner = [*bwrap, "--", *become, "--", "env", f"--chdir={home(member)}", *limited, *argv]
    terminals = "" if member.instructor else f"{MOUNT_TERMINALS}\n"
    script = f"ip -batch - <<'END'\n{networks.SET_UP}END\n{terminals}exec {shlex.join(inner)}"
    return [*ALONE, "sh", "-ec", script]


def limits(classroom: Classroom, member: Member) -> dict[str, int]:
    """Return the limits of each process of a member, named as for prlimit(1)."""
    most = classroom.limits_of(member)
    # `data`, not `as`: Fast DDS and malloc reserve far more addresses than they use
    found = {"nproc": most.tasks, "data": most.memory, "fsize": FILE, "core": 0}
    return found if member.instructor else found | {"nofile": DESCRIPTORS}


def variables(member: Member) -> dict[str, str]:
    """Return the environment variables of a member's processes."""
    return {
        "COURSE_EXCHANGE": COURSE_ID,
        "COURSE_DATES": f"{EXCHANGE}/{COURSE_ID}/dates/{member.name}.json",
        "HOME": home(member),
        "JUPYTER_CONFIG_PATH": CONFIGURATION,
        "LANG": "C.UTF-8",
        "LOGNAME": member.name,
        "PATH": f"{sys.prefix}/bin:/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin",
        "SHELL": "/bin/bash",
        "USER": member.name,
    }


def configured_by(member: Member) -> dict[str, str]:
    """Return the variable that keeps a student's server from reading configuration at home; none for an instructor."""
    return {} if member.instructor else {serve.ALONE: CONFIGURATION}


def umask(member: Member) -> int:
    """Return the umask of a member's processes: instructors share new files, students do not."""
    return 0o007 if member.instructor else 0o077


def _view(classroom: Classroom, member: Member, to_read: Callable[[bytes], str]) -> list[str]:
    environment.prepare()
    known = classroom.members if member.instructor else (member,)
    shared_memory, temporary = _scratch("/dev/shm", SHARED_MEMORY), _scratch("/tmp", TEMPORARY)
    options = view.system(_system_files(classroom, known), to_read, shared_memory, temporary)
    if member.instructor:
        options += ["--perms", "0755", "--dir", view.STORE]
        options += ["--bind", "/proc", "/proc"]  # a nested namespace can mount /proc only if it sees a whole one here
        shown = {repository(): True}
        hidden: list[Path] = []
    else:
        options += ["--dev-bind", "/dev/pts", "/dev/pts"]
        shown = {COURSE: True, repository() / "environment": True}
        hidden = private()
    options += view.installed(view.outer_first(view.folders(hidden) | shown))
    options += ["--perms", "0755", "--dir", "/home", "--bind", str(classroom.home(member)), home(member)]
    options += ["--perms", "0755", "--dir", "/srv", "--bind", str(classroom.exchange), EXCHANGE]
    options += _folders_to(classroom.hub_socket.parent)
    options += ["--ro-bind", str(classroom.hub_socket.parent), str(classroom.hub_socket.parent)]
    if member.instructor:
        options += ["--bind", str(classroom.grading), _grading(member)]
    options += ["--perms", "0755", "--dir", "/opt", "--perms", "0755", "--dir", CONFIGURATION]
    options += ["--ro-bind", str(Path(serve.__file__)), SERVER]
    for name, text in _configuration(classroom, member).items():
        options += _folders_to(Path(CONFIGURATION, name).parent)
        options += ["--perms", "0444", "--ro-bind-data", to_read(text.encode()), f"{CONFIGURATION}/{name}"]
    return [*options, "--remount-ro", "/"]


def _system_files(classroom: Classroom, known: tuple[Member, ...]) -> Mapping[str, str]:
    """Return /etc/passwd and the like with the members' own names, which nbgrader takes for the owners of hand-ins."""
    staff = ",".join(member.name for member in classroom.instructors)
    people = {member.name: accounts.ids(classroom, member) for member in known}
    users = "".join(f"{name}:x:{uid}:{gid}::/home/{name}:/bin/bash\n" for name, (uid, gid) in people.items())
    groups = "".join(f"{name}:x:{gid}:\n" for name, (_, gid) in people.items())
    return view.SYSTEM_FILES | {
        "/etc/passwd": f"root:x:0:0::/:/bin/false\n{users}",
        "/etc/group": f"root:x:0:\n{groups}staff:x:{accounts.staff_id(classroom)}:{staff}\n",
    }


def _configuration(classroom: Classroom, member: Member) -> dict[str, str]:
    """Return Jupyter's and nbgrader's configuration files, by their path in CONFIGURATION."""
    extensions = STAFFS if member.instructor else STUDENTS
    servers = {f"nbgrader.server_extensions.{name.replace('-', '_')}": on for name, on in extensions.items()}
    for only_a_page in ("create_assignment", "validate_assignment"):  # the server's part of the second does no harm
        servers.pop(f"nbgrader.server_extensions.{only_a_page}")
    idle = classroom.limits
    look = serve.every(idle.kernel_idle)
    server: dict[str, dict[str, object]] = {
        "ServerApp": {"jpserver_extensions": servers, "shutdown_no_activity_timeout": idle.server_idle},
        "MappingKernelManager": {"cull_idle_timeout": idle.kernel_idle, "cull_interval": look, "cull_connected": True},
        "TerminalManager": {"cull_inactive_timeout": idle.kernel_idle, "cull_interval": look},
        "Session": {"username": member.name},
    }
    if member.instructor:  # JupyterLab shows Formgrader in an iframe
        server["ServerApp"]["tornado_settings"] = {"headers": {"Content-Security-Policy": "frame-ancestors 'self'"}}
    disabled = {f"@jupyter/nbgrader:{name}": not on for name, on in extensions.items()}
    page = {
        "disabledExtensions": disabled | dict.fromkeys(NEVER, True),
        "buildAvailable": False,
        "buildCheck": False,  # would run Node.js for each page that is opened
    }
    nbgrader = [
        "c = get_config()",
        f"c.CourseDirectory.course_id = {COURSE_ID!r}",
        f"c.Exchange.root = {EXCHANGE!r}",
        f"c.Exchange.assignment_dir = {notebooks(member)!r}",
        "c.CourseDirectory.groupshared = True",
        "c.ExchangeFactory.submit = 'course.submitting.WholeSubmit'",  # the Assignments tab reads no other file
        "c.CourseDirectory.ignore = ['.ipynb_checkpoints', '*.pyc', '__pycache__', 'feedback', '*.zip', '.*']",
    ]
    if member.instructor:
        nbgrader += [
            "from autograder.gradebook.exchange_collect import OwnersCollect",
            "c.ExchangeFactory.collect = OwnersCollect",
            "c.RegularCollect.by_owner = True",  # is what the course folder's own configuration chooses
            "from autograder.gradebook.exchange_list import RegularList",
            "c.ExchangeFactory.list = RegularList",
            f"c.CourseDirectory.root = {_grading(member)!r}",
        ]
    return {
        "jupyter_server_config.json": json.dumps(server),
        "labconfig/page_config.json": json.dumps(page),
        "nbgrader_config.py": "\n".join([*nbgrader, ""]),
    }


def _grading(member: Member) -> str:
    return f"{home(member)}/{GRADING}"


def _scratch(path: str, size: int) -> list[str]:
    return ["--perms", "1777", "--size", str(size), "--tmpfs", path]


def _folders_to(folder: Path) -> list[str]:
    """Return options that make the folders above: bubblewrap itself would make them readable by root only."""
    return [
        word for each in [*reversed(folder.parents[:-1]), folder] for word in ("--perms", "0755", "--dir", str(each))
    ]
