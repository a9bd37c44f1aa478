"""The course's figures: each takes what was recorded and returns a `Picture`; `live` redraws one as data comes in.

They share one palette, colour-blind safe (Okabe and Ito, 2008), on an opaque light ground that can be read in
JupyterLab's light and dark themes alike.
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
