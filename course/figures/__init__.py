"""The course's figures: each takes a recorder (or its table) and gives a `Picture`; `live` redraws one as data comes.

One palette, colour-blind safe (Okabe and Ito, 2008), on an opaque light ground that reads in JupyterLab's light and dark
themes alike.
"""

from .actions import feedback, timeline
from .parameters import changes
from .picture import Live, Picture, live
from .room import drive
from .scan import sectors
from .timing import latencies, round_trips

__all__ = ["Live", "Picture", "changes", "drive", "feedback", "latencies", "live", "round_trips", "sectors", "timeline"]
