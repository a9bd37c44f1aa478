"""The rooms that the robot drives in, and a way to make others from plain data."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from course.errors import WorldError
from course.world import geometry
from course.world.geometry import Floats, Pose

# Each part of a room: what it looks like in a room's data, and the segments of one of it.
PARTS: dict[str, tuple[str, Callable[[Any], Floats]]] = {
    "boxes": ("[[x_min, y_min, x_max, y_max], ...]", lambda sides: geometry.box(*sides)),
    "circles": ("[[x, y, radius], ...]", lambda circle: geometry.circle(*circle)),
    "polygons": ("[[[x, y], [x, y], ...], ...]", lambda points: geometry.polyline(points, closed=True)),
    "walls": ("[[[x, y], [x, y], ...], ...]", geometry.polyline),
}


@dataclass(frozen=True)
class Room:
    """Walls and obstacles as segments (m, shape (n, 2, 2)), and where the robot starts.

    Heading 0 looks along x, counter-clockwise is positive (REP 103).
    """

    name: str
    segments: Floats = field(repr=False)
    start: Pose = (0.0, 0.0, 0.0)  # x (m), y (m), heading (rad)
    description: str = ""

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> "Room":
        """Make a room from a dict, as in a JSON file: lengths in m, angles in rad, every part optional.

        Its keys: `name`, `description`, `start` [x, y, heading], `boxes` [[x_min, y_min, x_max, y_max], ...],
        `circles` [[x, y, radius], ...], `polygons` (closed) and `walls` (open), each a list of lists of points [x, y].

        Raises WorldError for any other key, and for a number that is missing, infinite or not a number.
        """
        if not isinstance(data, Mapping):
            raise WorldError(f"a room is made from a dict, such as {{'boxes': [[0, 0, 8, 6]]}}, not from {data!r:.40}")
        unknown = set(data) - {"name", "description", "start", *PARTS}
        if unknown:
            raise WorldError(f"a room has no setting called {', '.join(sorted(unknown))}")
        name = str(data.get("name", "room"))
        segments: list[Floats] = []
        for part, (form, make) in PARTS.items():
            try:
                segments += [make(each) for each in data.get(part, ())]
            except (TypeError, ValueError) as error:
                raise WorldError(f"room '{name}': `{part}` is {form}: {error}") from error
        try:
            x, y, heading = (float(value) for value in data.get("start", (0.0, 0.0, 0.0)))
        except (TypeError, ValueError) as error:
            raise WorldError(f"room '{name}': `start` is [x, y, heading]: {error}") from error
        together = np.concatenate([np.empty((0, 2, 2)), *segments])
        if not np.isfinite(together).all() or not np.isfinite([x, y, heading]).all():
            raise WorldError(f"room '{name}': every coordinate must be a finite number")
        if abs(heading) > geometry.MOST_ANGLE:
            raise WorldError(f"room '{name}': the heading at the start is an angle in rad, not {heading}")
        together.setflags(write=False)
        return cls(name, together, (x, y, heading), str(data.get("description", "")))

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Return the smallest rectangle around walls, obstacles and start: (x_min, y_min, x_max, y_max) in m."""
        points = np.vstack([self.segments.reshape(-1, 2), [self.start[:2]]])
        (x_min, y_min), (x_max, y_max) = points.min(axis=0), points.max(axis=0)
        return x_min, y_min, x_max, y_max


def load(path: str | Path) -> Room:
    """Return the room in a JSON file (see `Room.from_data`); raises WorldError for a file that has none."""
    path = Path(path)
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise WorldError(f"the room's file {path} cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise WorldError(f"the room's file {path} is not JSON: {error}") from error
    if not isinstance(data, dict):
        raise WorldError(f"{path}: a room is a JSON object")
    return Room.from_data({"name": path.stem, **data})


def find(room: str | Path | Room) -> Room:
    """Return the room of this name in `ROOMS`, or in this `.json` file; a `Room` is returned unchanged.

    Raises WorldError if there is no such room, and the errors of `load`.
    """
    if isinstance(room, Room):
        return room
    if str(room).endswith(".json"):
        return load(room)
    if isinstance(room, Mapping):
        raise WorldError("a room is made from a dict by `Room.from_data(...)`: give what this returns")
    name = str(room)
    if name not in ROOMS:
        raise WorldError(f"there is no room '{name}': choose one of {', '.join(ROOMS)}, or a .json file")
    return ROOMS[name]


_DATA: tuple[dict[str, Any], ...] = (
    {
        "name": "hall",
        "description": "four walls and nothing else",
        "start": [1.0, 1.2, 0.35],
        "boxes": [[0.0, 0.0, 8.0, 6.0]],
    },
    {
        "name": "pillars",
        "description": "round pillars, wide apart, in a hall",
        "start": [0.9, 3.2, 0.0],
        "boxes": [[0.0, 0.0, 8.0, 6.0]],
        "circles": [[2.4, 1.6, 0.3], [2.6, 4.6, 0.4], [4.3, 3.0, 0.35], [6.1, 1.5, 0.4], [6.0, 4.5, 0.3]],
    },
    {
        "name": "corridor",
        "description": "a corridor around a block, with chamfered outer corners",
        "start": [2.0, 0.8, 0.0],
        "boxes": [[1.7, 1.7, 6.3, 4.3]],
        "polygons": [
            [[1.0, 0.0], [7.0, 0.0], [8.0, 1.0], [8.0, 5.0], [7.0, 6.0], [1.0, 6.0], [0.0, 5.0], [0.0, 1.0]]
        ],
    },
    {
        "name": "office",
        "description": "two rooms joined by a doorway, with desks and a plant",
        "start": [1.2, 4.8, -0.6],
        "boxes": [[0.0, 0.0, 9.0, 6.0], [0.6, 1.2, 2.0, 2.0], [6.8, 4.4, 8.2, 5.1], [6.6, 0.9, 8.0, 1.6]],
        "walls": [[[4.5, 0.0], [4.5, 2.2]], [[4.5, 3.8], [4.5, 6.0]]],
        "circles": [[3.6, 0.9, 0.25]],
    },
    {
        "name": "bends",
        "description": "a narrow way with right-angled bends, closed at both ends",
        "start": [0.8, 0.6, 0.12],
        "polygons": [
            [
                [0.0, 0.0], [4.8, 0.0], [4.8, 3.0], [8.0, 3.0], [8.0, 6.0], [0.0, 6.0],
                [0.0, 4.4], [3.2, 4.4], [3.2, 1.6], [0.0, 1.6],
            ]
        ],
    },
)  # fmt: skip
ROOMS = {room.name: room for room in map(Room.from_data, _DATA)}
