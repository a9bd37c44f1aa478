"""The course's figures: each draws recorded data as a `Picture`; `live` redraws one as data comes in.

They share a colour-blind safe palette (Okabe and Ito, 2008) on an opaque light background, which is readable in
JupyterLab's light and dark themes.
"""

from course.figures.actions import feedback, timeline
from course.figures.parameters import changes, response
from course.figures.picture import Live, Picture, live
from course.figures.room import distances, drive
from course.figures.scan import sectors
from course.figures.timing import latencies, round_trips

__all__ = [
    "Live",
    "Picture",
    "changes",
    "distances",
    "drive",
    "feedback",
    "latencies",
    "live",
    "response",
    "round_trips",
    "sectors",
    "timeline",
]
