"""`environment/classroom capacity`: the resources that a class needs, calculated from measured figures."""

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

FIGURES = Path(__file__).with_name("measured.toml")
PASSES = 3  # how often a student runs each cell of a page
SPARE = 1.5  # factor on top, for peaks, the system and the page cache
EXERCISES = 5


@dataclass(frozen=True)
class Wishes:
    """The size of a class, and the way in which it works."""

    students: int
    at_once: float = 1.0  # the share of students who work at the same time
    minutes: float = 30.0  # that a student spends on one page
    hours: float = 1.0  # within which all hand-ins of one exercise are to be graded
    machine_memory: float = 64.0  # GiB of one machine
    machine_cores: int = 16


@dataclass(frozen=True)
class Needs:
    """The resources that a class needs."""

    kernels: int
    memory: float  # GiB while they work
    cores: float  # that are busy while they work
    graders: float  # cores for grading
    grading_memory: float  # GiB
    disk: float  # GiB
    machines: int


def figures() -> dict[str, dict[str, Any]]:
    """Return the measured figures, each group with its origin."""
    return tomllib.loads(FIGURES.read_text(encoding="utf-8"))


def reckon(wishes: Wishes, known: dict[str, dict[str, Any]] | None = None) -> Needs:
    """Return what a class needs, calculated from the measured figures or from others of the same form."""
    known = known or figures()
    student, hub, grader = known["student"], known["hub"], known["grader"]
    kernels = math.ceil(wishes.students * wishes.at_once)
    memory = SPARE * (kernels * student["memory"] + hub["memory"]) / 1024
    cores = SPARE * kernels * PASSES * student["processor"] / (60 * wishes.minutes)
    graders = wishes.students * grader["seconds"] / (3600 * wishes.hours)
    grading_memory = SPARE * math.ceil(graders) * grader["memory"] / 1024
    disk = SPARE * wishes.students * (student["home"] + EXERCISES * student["submission"]) / 1024
    disk += known["machine"]["disk"] / 1024
    machines = max(
        math.ceil((memory + grading_memory) / wishes.machine_memory),
        math.ceil((cores + graders) / wishes.machine_cores),
    )
    return Needs(kernels, memory, cores, graders, grading_memory, disk, machines)
