"""The command `environment/classroom`."""

import contextlib
import os
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from autograder.classroom import (
    accounts,
    assignments,
    attempts,
    backup,
    certificate,
    course_files,
    deadlines,
    hub,
    members,
    servers,
)
from autograder.classroom.plan import DEFAULT, GIB, LOCAL, SETTINGS, Classroom, Limits
from autograder.errors import AutograderError, ClassroomError, UsageError
from autograder.gradebook.release import names as exercises
from autograder.results.text import counted
from autograder.usage import UsageProblem, told
from course.foundation.untrusted import one_line

PASSWORDS = ("pam", "dummy")
LOOPBACK = "127.0.0.1"
USAGE, FAILED = 2, 3  # exit codes
MIB = 1 << 20
LISTED = 5  # folders that are named when a backup leaves some out
MOST = 5  # members who are named as taking most of the disk

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Run a class on this machine: JupyterHub, with each student's server in a sandbox.",
)
Folder = Annotated[Path, typer.Option(help="The folder with the files of the class.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Show what would be done, without doing it.")]


@app.command()
def up(
    roster_file: Annotated[
        Path | None,
        typer.Option(
            "--roster",
            help="The class, a CSV file with the columns `student` and, for instructors, `role`; default: the members "
            "from the last `up`.",
        ),
    ] = None,
    instructor: Annotated[
        list[str] | None, typer.Option(help="The name of an instructor; repeat the option for several.")
    ] = None,
    folder: Folder = DEFAULT,
    certificate_file: Annotated[
        Path | None, typer.Option("--certificate", help="The certificate for HTTPS, a PEM file.")
    ] = None,
    key: Annotated[Path | None, typer.Option(help="The certificate's key, a PEM file.")] = None,
    port: Annotated[int, typer.Option(min=1, max=65535, help="The port to listen on.")] = 8000,
    ip: Annotated[
        str | None,
        typer.Option(help="The address to listen on; default: all with a certificate, and 127.0.0.1 without."),
    ] = None,
    host: Annotated[
        str | None,
        typer.Option(help="A name of this machine whose subdomains (*.NAME) also lead here: each server gets one."),
    ] = None,
    instructors_port: Annotated[
        int | None, typer.Option(min=1, max=65535, help="The port for instructors, without --host; default: port + 1.")
    ] = None,
    passwords: Annotated[
        str,
        typer.Option(help="pam: a password for each member; dummy: one password for all students, for trials only."),
    ] = "pam",
    prefix: Annotated[str, typer.Option(help="The prefix of the names of the Unix users.")] = "ros-",
    memory: Annotated[float, typer.Option(min=0.5, help="The memory for each student, in GiB.")] = 3.0,
    tasks: Annotated[int, typer.Option(min=100, help="The number of processes and threads for each student.")] = 1000,
    cores: Annotated[float, typer.Option(min=0.1, help="The number of processors for each student.")] = 2.0,
    idle: Annotated[
        float,
        typer.Option(
            min=0.1,
            help="Minutes after which an idle kernel is ended, with its nodes; an idle server after twice as long.",
        ),
    ] = 60,
    dry_run: DryRun = False,
) -> None:
    """Start the class, or start it again with another roster or other settings.

    Running servers continue, except those of members who are no longer in the roster.
    """
    _root()
    if passwords not in PASSWORDS:
        raise UsageError(f"--passwords {passwords}: it must be pam or dummy")
    if wrong := members.wrong(prefix):
        raise UsageError(f"--prefix: {wrong}")
    ip = ip if ip is not None else ("" if certificate_file else LOOPBACK)
    if ip.lower().rstrip(".").endswith(f".{LOCAL}"):
        raise UsageError(f"--ip {ip}: names that end in .{LOCAL} are for --host; give an address such as {LOOPBACK}")
    if host is None:
        host = LOCAL if ip == LOOPBACK and not certificate_file else ""
    elif certificate_file and host:
        certificate.check_covers(certificate_file, host)
    classroom = Classroom(
        folder.resolve(),
        _members(folder.resolve(), roster_file, instructor or []),
        ip,
        port,
        *certificate.paths(certificate_file, key),
        passwords,
        prefix,
        Limits(round(memory * GIB), tasks, cores, round(60 * idle), round(120 * idle)),
        host,
        0 if host else instructors_port or port + 1,
    )
    if missing := hub.missing_tools():
        raise UsageError("; ".join(missing))
    before = _before(classroom)
    new = accounts.missing(classroom)
    if taken := hub.taken_port(classroom, before):
        option = "--port" if taken == classroom.port else "--instructors-port"
        raise UsageError(f"port {taken} is in use: stop the program that listens there, or give another {option}")
    if dry_run:
        _tell_plan(classroom, new)
        return
    with hub.alone(classroom):
        _up(classroom)


def _members(folder: Path, roster_file: Path | None, instructors: list[str]) -> tuple[members.Member, ...]:
    """Return the members of the roster, or without a roster those that the class had before."""
    if roster_file:
        return tuple(members.read(roster_file, instructors))
    if not (folder / "state" / SETTINGS).exists():
        raise UsageError(f"there is no class in {folder} yet: give --roster")
    before = Classroom.load(folder).members
    if unknown := sorted({*instructors} - {member.name for member in before if member.instructor}):
        raise UsageError(f"{unknown[0]} was not an instructor before; also give --roster")
    return before


def _up(classroom: Classroom) -> None:
    course_files.make_folders(classroom)
    course_files.check_room(classroom)
    instructors_left: list[str] = []
    with contextlib.suppress(UsageError):  # there is no class yet
        roles = {member.name: member.instructor for member in classroom.members}
        before = Classroom.load(classroom.folder)
        gone = {member.name for member in before.members if roles.get(member.name) is not member.instructor}
        instructors_left = sorted(member.name for member in before.instructors if member.name in gone)
        left = servers.started(classroom)
        # A running server knows only the addresses that it was started with, its own and the hub's.
        moved = before.host != classroom.host or (bool(classroom.host) and before.url != classroom.url)
        for name in sorted(left if moved else left.keys() & gone):
            servers.forget(classroom, name, left[name])
            why = "who is no longer in the class or has another role" if name in gone else "whose address changes"
            print(f"Ended the server of {name}, {why}.")
    classroom.save()
    if hub.install_proxy():
        print("Installed the hub's proxy.")
    new = accounts.make(classroom)
    if new:
        print(f"Made {counted(len(new), 'Unix user')}: {_listed([classroom.user(member) for member in new])}.")
    if instructors_left:
        hub.stop(classroom)  # at once: the hub that runs knows them as instructors
    course_files.make_shared(classroom)
    _tend_shared(classroom, instructors_left)
    hub.stop(classroom)
    if classroom.passwords == "pam":
        if without := accounts.without_password(classroom, new):
            written = accounts.set_passwords(classroom, without)
            print(f"Gave passwords to {counted(len(without), 'member')}; they are in {written}.")
        if kept := len(new) - len([member for member in new if member in without]):
            print(f"Kept the passwords that {counted(kept, 'member')} had before `down`.")
    else:
        known = hub.shared_passwords(classroom)
        print("FOR TRIALS ONLY: anybody who knows this password can log in as any student.")
        print(f"Password of all students: {known['students']}")
        print(f"Password of the instructors: {known['instructors']}")
    hub.start(classroom)
    _warn_of_certificate(classroom)
    _warn_of_namesakes(classroom)
    print(f"The class is at {classroom.url}")
    print(_addresses(classroom))
    drafts = [row.name for row in _table(classroom) if row.state == assignments.DRAFT]
    if drafts:
        print(
            f"Drafts, which no student sees: {', '.join(drafts)}. `{classroom.command('release NAME')}` releases one."
        )


def _tend_shared(classroom: Classroom, instructors_left: list[str]) -> None:
    """Do what depends on files that instructors share.  What fails is told, and stops neither the rest nor the class.

    An instructor who leaves could otherwise prevent it.
    """

    def set_aside() -> None:
        if instructors_left and (aside := course_files.set_aside_configuration(classroom)):
            print(
                f"No longer instructors: {_listed(instructors_left)}. They could edit the configuration in "
                f"{classroom.grading}, so it was replaced; the old one is {_listed(aside)}."
            )

    def hand_out() -> None:
        for line in course_files.hand_out_notebooks(classroom):
            print(line)

    if not _attempt("nbgrader's course folder was left alone", set_aside):
        return  # its configuration may be that of somebody who has left, and would run
    _attempt("nbgrader's course folder was not prepared", lambda: course_files.release(classroom, []))
    _attempt("The gradebook's list of students was not updated", lambda: course_files.enrol(classroom))
    _attempt("The dates were not published", lambda: deadlines.publish(classroom))
    _attempt("The notebooks were not copied into the home folders", hand_out)


def _attempt(otherwise: str, work: Callable[[], object]) -> bool:
    """Return True if `work` was done; if it fails, say what that means, and why."""
    try:
        work()
    except ClassroomError as error:
        print(f"{otherwise}: {error}", file=sys.stderr)
        return False
    return True


def _table(classroom: Classroom) -> list[assignments.Row]:
    """Return the state of each exercise; if it cannot be found, say so, and return none."""
    found: list[assignments.Row] = []
    _attempt(
        "The state of the exercises is not known", lambda: found.extend(assignments.table(classroom, datetime.now(UTC)))
    )
    return found


@app.command()
def status(folder: Folder = DEFAULT) -> None:
    """Show the state of the hub, the running servers and the disk use; exit code 1 when the hub does not run."""
    _root()
    classroom = Classroom.load(folder.resolve())
    up_ = hub.running(classroom) is not None
    alive = sorted(name for name, server in servers.started(classroom).items() if server.alive)
    print(f"The hub is at {classroom.url}." if up_ else f"The hub does not run; `{classroom.command('up')}` starts it.")
    if not accounts.made(classroom):
        print(f"The class is down: it has no Unix users. Its files are in {classroom.folder}.")
        raise typer.Exit(1)
    print(_addresses(classroom))
    _warn_of_certificate(classroom)
    _warn_of_namesakes(classroom)
    print("Exercises:")
    for row in _table(classroom):
        print(assignments.shown(row))
    counts = f"Students: {len(classroom.students)}; instructors: {len(classroom.instructors)}"
    print(f"{counts}; running servers: {len(alive)}.")
    for name in alive:
        print(f"  {name}")
    used = course_files.disk(classroom)
    most = ", ".join(
        f"{name} {'too large to measure' if size is None else f'{size / MIB:,.0f} MiB'}"
        for name, size in list(used.items())[:MOST]
    )
    free, total = shutil.disk_usage(classroom.homes).free, sum(size or 0 for size in used.values())
    print(f"Home folders use {total / MIB:,.0f} MiB; {free / GIB:,.0f} GiB are free. Most: {most}.")
    raise typer.Exit(0 if up_ else 1)


@app.command()
def release(
    names: Annotated[list[str] | None, typer.Argument(metavar="NAME...", help="The exercises.")] = None,
    everything: Annotated[bool, typer.Option("--all", help="All exercises.")] = False,
    at: Annotated[
        str | None, typer.Option(help="The release date, such as '2026-11-02 08:00 UTC'; default: now.")
    ] = None,
    due: Annotated[str | None, typer.Option(help="The due date.")] = None,
    until: Annotated[
        str | None, typer.Option(help="The end: later hand-ins are not collected. 'none' removes the end.")
    ] = None,
    folder: Folder = DEFAULT,
) -> None:
    """Release exercises to the students, now or at a date; or change the dates of those that are released."""
    from autograder.gradebook import ends
    from autograder.submissions.times import parse_time

    _root()
    classroom = Classroom.load(folder.resolve())
    known = exercises()
    wanted = known if everything else names or []
    if not wanted:
        raise UsageError(f"name an exercise, or give --all; there are: {', '.join(known)}")
    if unknown := sorted(set(wanted) - set(known)):
        raise UsageError(f"there is no exercise {unknown[0]}; there are: {', '.join(known)}")
    if accounts.missing(classroom):
        raise UsageError("the class is down: run `up` first")
    opens, is_due = (parse_time(time) if time else None for time in (at, due))
    end = ends.parse(until) if until else None
    with hub.alone(classroom):
        now, there = datetime.now(UTC), course_files.released(classroom)
        if at and (open_now := sorted(there & {*wanted})):
            raise UsageError(f"{open_now[0]} is already released: --at cannot change that")
        new = [name for name in wanted if name not in there]
        assignments.change(classroom, wanted, dict.fromkeys(new, opens or now), is_due, end)
        for name in course_files.release(classroom, [name for name in new if (opens or now) <= now]):
            print(f"Released {name}.")
        for line in course_files.hand_out_notebooks(classroom):
            print(line)
        deadlines.publish(classroom, wanted)
    for row in assignments.table(classroom, now):
        if row.name in wanted:
            print(assignments.shown(row))
    if any(row.state == assignments.DATED for row in assignments.table(classroom, now)) and not hub.running(classroom):
        print("The hub does not run: exercises with a date are released once it runs again.")


@app.command()
def unlock(
    name: Annotated[str, typer.Argument(help="The member's name, as in the roster.")], folder: Folder = DEFAULT
) -> None:
    """Let a member log in again at once, after too many wrong passwords."""
    _root()
    classroom = Classroom.load(folder.resolve())
    if name not in {member.name for member in classroom.members}:
        raise UsageError(f"{name} is not in the class")
    attempts.unlock(classroom, name)
    print(f"{name} may try again.")


@app.command()
def password(
    name: Annotated[str, typer.Argument(help="The member's name, as in the roster.")], folder: Folder = DEFAULT
) -> None:
    """Give a member a new password, and name the file with it; end their server, and log them out everywhere."""
    _root()
    classroom = Classroom.load(folder.resolve())
    found = [member for member in classroom.members if member.name == name]
    if not found:
        raise UsageError(f"{name} is not in the class")
    if classroom.passwords != "pam":
        raise UsageError("this class has one password for all (--passwords dummy)")
    if accounts.missing(replace(classroom, members=tuple(found))):
        raise UsageError("the class is down: run `up` first")
    with hub.alone(classroom):
        written = accounts.renew(classroom, found[0])
        attempts.unlock(classroom, name)
        if running := servers.started(classroom).get(name):
            servers.forget(classroom, name, running)
    print(f"The new password of {name} is in the last line of {written}.")


@app.command()
def down(
    folder: Folder = DEFAULT,
    delete_homes: Annotated[
        bool, typer.Option("--delete-homes", help="Remove all files of the class, including hand-ins and grades.")
    ] = False,
    dry_run: DryRun = False,
) -> None:
    """End the class: stop all servers and the hub, and remove its Unix users. Files are kept, unless told otherwise."""
    _root()
    classroom = Classroom.load(folder.resolve())
    if dry_run:
        print(
            f"Would end the hub and {counted(len(servers.started(classroom)), 'server')}, and remove their Unix users."
        )
        print(f"Would {'remove' if delete_homes else 'keep'} {classroom.folder}.")
        return
    with hub.alone(classroom):
        hub.stop(classroom)
        for name, server in servers.started(classroom).items():
            servers.forget(classroom, name, server)
        removed = accounts.remove(classroom)
        shutil.rmtree(classroom.run, ignore_errors=True)
        with contextlib.suppress(OSError):  # another class is there
            classroom.run.parent.rmdir()
        if delete_homes:
            course_files.remove(classroom)
        else:
            course_files.close(classroom)
    print(
        f"The class is ended; removed: {_listed(removed)}." if removed else "The class is ended; it had no Unix users."
    )
    if not delete_homes:
        print(f"Homes, exchange and grades are in {classroom.folder}.")


@app.command("backup")
def backup_command(
    file: Annotated[Path, typer.Argument(help="The file to write, for example class.tar.gz.")], folder: Folder = DEFAULT
) -> None:
    """Write a class that is down to one file: home folders, exchange, grades, settings and passwords."""
    _root()
    classroom = Classroom.load(folder.resolve())
    with hub.alone(classroom):
        size, too_deep = backup.write(classroom, file.absolute())
    print(
        f"{file}: {len(classroom.members)} members, {size / MIB:,.1f} MiB. Keep it private: it contains all work, "
        "grades and passwords."
    )
    for path in too_deep[:LISTED]:
        print(one_line(f"  left out: nested too deeply: {path}"))
    if len(too_deep) > LISTED:
        print(f"  left out for the same reason: {len(too_deep) - LISTED} more folders")


@app.command("restore")
def restore_command(file: Annotated[Path, typer.Argument(help="The backup file.")], folder: Folder = DEFAULT) -> None:
    """Restore a class from a backup, on this machine or another; then `up` starts it, with all work and passwords."""
    _root()
    if not file.exists():
        raise UsageError(f"there is no file {file}")
    classroom = backup.read(file.absolute(), folder.resolve())
    print(f"{classroom.folder}: {len(classroom.members)} members, with their work, grades and passwords.")
    print(f"Start it: {classroom.command('up')}, with the options that you gave before.")


@app.command("capacity")
def capacity_command(
    students: Annotated[
        list[int] | None, typer.Option(min=1, help="The number of students; repeat the option for several numbers.")
    ] = None,
    at_once: Annotated[
        float, typer.Option(min=0.01, max=1, help="The share of the students who work at the same time.")
    ] = 1.0,
    minutes: Annotated[float, typer.Option(min=1, help="Minutes that a student needs for a page.")] = 30.0,
    hours: Annotated[float, typer.Option(min=0.1, help="Hours in which an exercise should be graded.")] = 1.0,
    machine_memory: Annotated[float, typer.Option(min=1, help="The memory of a machine, in GiB.")] = 64.0,
    machine_cores: Annotated[int, typer.Option(min=1, help="The number of cores of a machine.")] = 16,
) -> None:
    """Estimate what a class needs from measured figures; default: for 60, 600 and 6,000 students."""
    from rich.console import Console
    from rich.table import Table

    from autograder.classroom import capacity

    counts = students or [60, 600, 6000]
    wishes = [capacity.Wishes(count, at_once, minutes, hours, machine_memory, machine_cores) for count in counts]
    needs = [capacity.reckon(each) for each in wishes]
    table = Table("students", *(f"{count:,}" for count in counts))
    table.add_row("kernels at once", *(f"{each.kernels:,}" for each in needs))
    table.add_row("memory for them", *(f"{each.memory:,.0f} GiB" for each in needs))
    table.add_row("cores for them", *(f"{each.cores:,.1f}" for each in needs))
    table.add_row(f"cores that grade an exercise in {hours:g} h", *(f"{each.graders:,.1f}" for each in needs))
    table.add_row("memory for grading", *(f"{each.grading_memory:,.1f} GiB" for each in needs))
    table.add_row("disk", *(f"{each.disk:,.0f} GiB" for each in needs))
    table.add_row(f"machines of {machine_cores} cores and {machine_memory:g} GiB", *(f"{n.machines}" for n in needs))
    console = Console(width=None if sys.stdout.isatty() else 120)
    console.print(table)
    console.print(
        f"Estimated as {capacity.SPARE} times the measured figures. A page takes {minutes:g} min, in which each cell "
        f"is run {capacity.PASSES} times. Measured:"
    )
    for name, group in capacity.figures().items():
        console.print(f"  {name}: {group['origin']}", markup=False, highlight=False)


def main() -> None:
    """Run the command line; a problem that the user can solve is one line and exit code 2, any other one and 3."""
    try:
        code = app(prog_name="environment/classroom", standalone_mode=False)
    except UsageProblem as error:
        _fail(told(error))
    except UsageError as error:
        _fail(str(error))
    except AutograderError as error:
        _fail(str(error), FAILED)
    except OSError as error:
        _fail(f"{error.filename or 'writing'}: {error.strerror}", FAILED)
    raise SystemExit(code)


def _fail(message: str, code: int = USAGE) -> NoReturn:
    print(f"classroom: {message}", file=sys.stderr)
    raise SystemExit(code)


def _root() -> None:
    if os.geteuid() != 0:
        raise UsageError("run this command as root, for example with sudo: it creates users and namespaces")


def _warn_of_namesakes(classroom: Classroom) -> None:
    """Warn of equal names in two classes: browsers send cookies to all ports of a host, so log-ins would be shared."""
    own = {member.name for member in classroom.members}
    for other in hub.others(classroom):
        same = sorted(own & {member.name for member in other.members})
        if same and (other.host == classroom.host or not (other.host and classroom.host)):
            print(
                f"WARNING: also in the class of {other.folder}, at the same address: {_listed(same)}. If these are "
                "different people, each can take over the other's server: give one class another --host, or other "
                "names. Nobody can stay logged in to both classes."
            )


def _warn_of_certificate(classroom: Classroom) -> None:
    if said := certificate.warning(classroom.certificate, datetime.now(UTC)):
        print(said)


def _addresses(classroom: Classroom) -> str:
    """Return a line that says what keeps a student's pages from acting as the person who opens them."""
    if classroom.host:
        names = f"NAME.{classroom.host}"
        return f"Each server has its own address, {names}, so a student's page cannot act as the person who opens it."
    return (
        f"Students' servers share an address, so instructors log in only at http://{classroom.staff_address}/, "
        f"from here or by `ssh -L {classroom.staff_port}:localhost:{classroom.staff_port} THIS-MACHINE`."
    )


def _before(classroom: Classroom) -> Classroom | None:
    """Return the classroom that the hub in this folder serves, or served until it was killed; None if there is none."""
    try:
        before = Classroom.load(classroom.folder)
    except UsageError:
        return None
    if before.prefix != classroom.prefix and (hub.left(before) or accounts.noted(before)):
        raise UsageError(f"the prefix of this class is {before.prefix}: run `down` before you change it")
    return before if hub.left(before) else None


def _tell_plan(classroom: Classroom, new: list[members.Member]) -> None:
    limits = classroom.limits
    users = _listed([classroom.user(member) for member in new])
    print(f"Would make {counted(len(new), 'Unix user')}{f': {users}' if new else ''}.")
    print(f"Would keep the class in {classroom.folder}: homes, exchange, grading, state.")
    if not hub.proxy().exists():
        print("Would install the hub's proxy with npm.")
    print(f"Would copy the released notebooks into each new home; `{classroom.command('release')}` releases them.")
    print(
        f"Would give each student {limits.memory / GIB:g} GiB, {limits.tasks} processes and threads, "
        f"{limits.cores:g} processors, and end idle kernels after {limits.kernel_idle / 60:g} min."
    )
    print(f"Would start JupyterHub at {classroom.url}, with {'passwords of ' + classroom.passwords}.")


def _listed(names: list[str], most: int = 8) -> str:
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")


if __name__ == "__main__":
    main()
