"""The news that a robot has come into a notebook's session, for which JupyterLab opens the robot view."""

from collections.abc import Callable

from comm import create_comm

from course.ros.names import full, is_hidden
from course.session.live import Session

TARGET = "ros2-course:robot"  # the page's name for who hears it: course/lab/ui/src/arrival.ts


def tell() -> None:
    """Tell the pages that show this kernel's notebook, by Jupyter's own channel: the panels' is there when one is open.

    It waits for the first page that shows the notebook, which closes it.  A page without the course's part takes no
    notice.
    """
    create_comm(target_name=TARGET)


class Arrival:
    """Looks whether a node publishes a scan, which is what the robot view shows; tells it once in a kernel's life.

    A world that is started again is not reported: a student who has closed the view does not want it.
    """

    def __init__(self, tell: Callable[[], None] = tell):
        self._tell = tell
        self._told = False

    def look(self, live: Session | None) -> None:
        """Look, for as long as nothing was told."""
        if self._told or live is None or not live.ok:
            return
        seen = live.node.get_publishers_info_by_topic("/scan")
        if any(not is_hidden(full(each.node_name, each.node_namespace)) for each in seen):
            self._told = True
            self._tell()
