"""The built pages of the lab are those of the sources, and are installed."""

import hashlib
import json
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
UI, BUILT = ROOT / "course/lab/ui", ROOT / "course/lab/built"


def test_the_built_files_are_those_of_the_sources():
    sources = {
        path.relative_to(UI).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in UI.rglob("*")
        if path.is_file()
    }
    lines = (BUILT / "sources.sha256").read_text().splitlines()
    built = {name: digest for digest, name in (line.split("  ") for line in lines)}
    assert built == sources, "course/lab/ui has changed: run environment/lab-build, which needs Node.js"


def test_what_is_built_is_installed_and_names_no_machine():
    installed = Path(sys.prefix) / "share/jupyter/labextensions/ros2-course-lab"
    files = [path.relative_to(BUILT) for path in BUILT.rglob("*") if path.is_file()]
    assert [name for name in files if (installed / name).read_bytes() != (BUILT / name).read_bytes()] == []
    assert [name for name in files if str(ROOT).encode() in (BUILT / name).read_bytes()] == []
    load = json.loads((BUILT / "package.json").read_text())["jupyterlab"]["_build"]["load"]
    assert (BUILT / load).is_file()
    assert sum((BUILT / name).stat().st_size for name in files) < 500_000  # bytes, for every student
