"""`course export`: writes an exercise's files as ROS 2 packages into a workspace, without losing existing files."""

import hashlib
import json
import os
import re
import tempfile
from pathlib import Path

from course import environment
from course.errors import WorkspaceError
from course.foundation.untrusted import read_regular
from course.ros.packages import read_manifest
from course.workspace import exercise_files, package_files

# Beside `src`: the digest of each file as last exported, which distinguishes an edited file from an older export.
RECORD = ".course-export.json"
LARGEST = 1_000_000  # bytes of that record, and of a file that is compared with what an export wrote


def export(name: str, workspace: Path, folder: Path = Path(), *, package: str = "", force: bool = False) -> list[str]:
    """Write the files of the exercise `name`, read from `folder`, as ROS 2 packages into `workspace`/src.

    The programs' package is called `package`, by default like the exercise.  Files of an earlier export are updated.
    If one was edited in the workspace, nothing is written, unless `force` is set: then the edited file is kept with `~`
    at its end.  Other files of the workspace are left alone.

    Returns lines for the reader.  Raises WorkspaceError, and InterfaceError for a definition that ROS 2 cannot build.
    """
    read = exercise_files.read(name, folder)
    made = package_files.of_exercise(read, package or name)
    try:
        notes = _check(workspace, made)
        _write(workspace, {f"src/{p}/{path}": text for p, files in made.items() for path, text in files.items()}, force)
    except OSError as error:
        raise WorkspaceError(
            f"cannot write {error.filename2 or error.filename or workspace}: {error.strerror}; make room there, or "
            "choose another WORKSPACE"
        ) from None
    return _summary(workspace, made, [*package_files.notes(read), *notes])


def _summary(workspace: Path, made: dict[str, dict[str, str]], notes: list[str]) -> list[str]:
    lines = []
    for name, files in made.items():
        scripts = [path for path in files if path.startswith(f"{name}/") and not path.endswith("__init__.py")]
        definitions = [path for path in files if path.endswith((".msg", ".srv", ".action"))]
        lines.append(f"{workspace / 'src' / name}: {', '.join(Path(path).name for path in definitions + scripts)}")
    if distribution := environment.foreign_distribution():
        notes.append(
            f"ROS 2 {distribution} is sourced here, and the course is for {environment.DISTRIBUTION}: "
            "build in a terminal that has not sourced it"
        )
    return [*lines, *(f"Note: {note}" for note in notes)]


def _check(workspace: Path, made: dict[str, dict[str, str]]) -> list[str]:
    """Raise WorkspaceError if colcon could not build the packages in this workspace; return warnings."""
    if any("CMakeLists.txt" in files for files in made.values()) and re.search(r"[^!-~]", str(workspace.resolve())):
        raise WorkspaceError(
            f"ROS 2 cannot build interfaces in {workspace.resolve()}: choose a WORKSPACE whose path has no space and "
            "only plain letters (a to z)"
        )
    notes = []
    source = workspace / "src"
    for manifest in sorted(source.rglob("package.xml")):
        place = manifest.parent
        if place.parent == source and place.name in made:
            continue
        try:
            name = (read_manifest(manifest).findtext("name") or "").strip()
        except ValueError as error:
            notes.append(f"colcon will not build {place}: its package.xml is broken ({error}); correct it")
            continue
        if name in made:
            raise WorkspaceError(
                f"{place} is already a package called '{name}', and colcon builds only one package of each name: "
                "move it out of the workspace or choose another WORKSPACE"
            )
    return notes


def _write(workspace: Path, files: dict[str, str], force: bool) -> None:
    """Write the files that have changed: all of them, or none if one cannot be written."""
    wanted = {path: text.encode() for path, text in files.items()}
    recorded = _recorded(workspace)
    for path in wanted:
        _check_place(workspace, path)
    present = {path: _content(workspace / path) for path in wanted if os.path.lexists(workspace / path)}
    changed = {path: content for path, content in wanted.items() if present.get(path) != content}
    edited = [path for path in changed if path in present and _digest(present[path]) != recorded.get(path, "")]
    if edited and not force:
        raise WorkspaceError(
            f"nothing was written: in {workspace}, {', '.join(edited)} was edited, or was not written by an export. "
            "--force replaces it, and keeps the old file as FILE~"
        )
    workspace.mkdir(parents=True, exist_ok=True)
    record = json.dumps({**recorded, **{path: _digest(content) for path, content in wanted.items()}}, indent=1) + "\n"
    with tempfile.TemporaryDirectory(dir=workspace, prefix=".export-") as scratch:
        for number, content in enumerate((*changed.values(), record.encode())):
            (Path(scratch) / str(number)).write_bytes(content)
        for path in changed:
            (workspace / path).parent.mkdir(parents=True, exist_ok=True)
        for path in edited:
            os.replace(workspace / path, _free(workspace / path))
        for number, path in enumerate((*changed, RECORD)):
            os.replace(Path(scratch) / str(number), workspace / path)


def _recorded(workspace: Path) -> dict[str, str]:
    try:
        record = json.loads(read_regular(workspace / RECORD, LARGEST))
    except (FileNotFoundError, ValueError, RecursionError):
        return {}
    return record if isinstance(record, dict) else {}


def _check_place(workspace: Path, path: str) -> None:
    """Raise WorkspaceError if a symbolic link leads from this path of the workspace to a place outside of it."""
    for place in (workspace / part for part in (Path(path), *Path(path).parents[:-1])):
        if place.is_symlink() and not os.path.realpath(place).startswith(f"{workspace.resolve()}{os.sep}"):
            raise WorkspaceError(
                f"nothing was written: {place} is a link to {os.path.realpath(place)}, outside of the workspace. "
                "Remove the link, or choose another WORKSPACE"
            )


def _content(path: Path) -> bytes | None:
    """Return the content of a file; None for a pipe, or a file that no export has written because of its size."""
    try:
        return read_regular(path, LARGEST)
    except ValueError:
        return None


def _digest(content: bytes | None) -> str | None:
    return None if content is None else hashlib.sha256(content).hexdigest()


def _free(path: Path) -> Path:
    """Return `path` with as many `~` at its end as needed for an unused name."""
    kept = path.with_name(f"{path.name}~")
    return _free(kept) if os.path.lexists(kept) else kept
