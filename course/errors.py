"""Every error that the course raises on purpose, in one tree.

CourseError                 an error that the reader can correct; a notebook shows only its message
    LiveError               the live session cannot do what it was asked to do
        CallTimeout         a service, a future or a node did not answer in time
            NodeFailed      nor will it: the node has died, or raised an exception
        ExerciseError       the file of an exercise's cell could not be written
    InterfaceError          a .msg, .srv or .action file that ROS 2 cannot build
    ToolChainError          ROS 2's generators or the compiler are missing, or have failed
    RosError                a `ros2` command lacks something: a type, a package, an answer
        NotInstalled        no installed package has that interface, or there is no such package
        WrongKind           a type of another kind: a message in the place of a service
    WorldError              an invalid room, place, scanner, scan or drive
        NoDriver            nobody drives the robot
    FigureError             a figure cannot draw what it was given, or cannot be saved
    RecorderError           a recorder cannot record or show what it was asked for
    ArgumentError           a call with a missing, superfluous or unusable argument
    CheckError              a check of `course doctor` has failed
    UnreadableNotebook      a file that is not a notebook
    BadArchive              a file that is not a zip archive, or an archive that must not be unpacked
    WorkspaceError          an exercise that cannot be laid out as ROS 2 packages
    HandInError             a folder whose exercise cannot be handed in
    FeedbackError           a file cannot be shown as feedback
"""


class CourseError(RuntimeError):
    """An error that the reader can correct; a notebook shows its message, without a traceback."""

    def _render_traceback_(self) -> list[str]:
        """Return the lines that IPython shows of the error."""
        return [f"{type(self).__name__}: {self}"]


class LiveError(CourseError):
    """The live session cannot do what it was asked to do."""


class CallTimeout(LiveError, TimeoutError):
    """A service, a future or a node did not answer within its time limit."""


class NodeFailed(CallTimeout):
    """The node that was waited for has died, or raised an exception, so no answer will come.  The message says how.

    `source` is the text of its program or its cell; '' if that is not known.
    """

    source = ""


class ExerciseError(LiveError):
    """The file that the cell names could not be written."""


class InterfaceError(CourseError, ValueError):
    """A definition that ROS 2 cannot build; the message names the file and the line and says what to write."""


class ToolChainError(CourseError):
    """ROS 2's generators or the compiler are missing, or have failed on a valid definition."""


class RosError(CourseError):
    """A name, a type or an answer that a `ros2` command needs is not there; it prints the message and returns 1."""


class NotInstalled(RosError):
    """No installed package has the interface, or there is no such package."""


class WrongKind(RosError, ValueError):
    """The type exists, but is of another kind (message, service or action) than expected."""


class WorldError(CourseError, ValueError):
    """An invalid room, place, scanner, scan or drive; the message says what to choose."""


class NoDriver(WorldError, TimeoutError):
    """No node that drives the robot has appeared in time."""


class FigureError(CourseError):
    """A figure cannot draw what it was given, or cannot be saved; the message says what to give it."""


class RecorderError(CourseError):
    """A recorder cannot record or show what it was asked for; the message says what to write."""


class ArgumentError(CourseError):
    """A function was called with a missing, superfluous or unusable argument; the message says what it takes."""


class CheckError(CourseError):
    """A check of `course doctor` has failed; the message says what was found."""


class UnreadableNotebook(CourseError, ValueError):
    """The file is not a notebook; the message says why."""


class BadArchive(CourseError, ValueError):
    """The file is not a zip archive, or must not be unpacked; the message says why, in a few words."""


class WorkspaceError(CourseError):
    """The exercise cannot be laid out as ROS 2 packages; the message says what to do."""


class HandInError(CourseError):
    """The folder's exercise cannot be handed in; the message says what to do."""


class FeedbackError(CourseError):
    """The file cannot be shown as feedback; the message says why."""
