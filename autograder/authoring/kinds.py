"""The kinds of new exercises."""

from enum import StrEnum


class Kind(StrEnum):
    """The topic of a new exercise; each is a folder of `templates`."""

    SERVICE = "service"
    ACTION = "action"
    PARAMETERS = "parameters"
    TOPIC = "topic"
    ROBOT = "robot"
