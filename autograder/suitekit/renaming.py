"""Programs whose topics have a wrong name: they are started again with the name remapped.

So a wrong name costs only the points for names, and all other tests judge the program as if the name were right.
"""

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

from autograder.errors import Wrong
from autograder.suitekit.bench import Bench
from autograder.suitekit.lifecycle import State
from autograder.suitekit.live import LiveProgram
from autograder.suitekit.topics import PUBLISH, SUBSCRIBE, own_topics, short


class Topic(NamedTuple):
    """A topic that a program must have."""

    name: str  # without a namespace
    kind: str  # the message type: std_msgs/Float64
    publish: bool  # PUBLISH or SUBSCRIBE


class Renamed(dict[Topic, str]):
    """The topics that have another name in a submission, with that name; one for all programs of one file."""

    def expect_none(self, file: str) -> None:
        """Raise Wrong for a topic with another name."""
        for topic, found in self.items():
            does = "publish" if topic.publish else "subscribe"
            raise Wrong(
                f"{file} must {does} the topic {topic.name} ({topic.kind}). It {does}{'es' if topic.publish else 's'} "
                f"{found} instead. (All other tests were run with this name replaced.)"
            )


class TopicProgram(LiveProgram):
    """A handed-in program that is spoken to over topics."""

    topics: ClassVar[Mapping[str, Topic]] = {}  # the topics that it must offer, by the words of `connect`

    def __init__(self, bench: Bench, file: str, *args: str, renamed: Renamed):
        """Prepare; `args` is the program's command line; `renamed` is shared by all programs of this file."""
        super().__init__(bench, file, *args)
        self.renamed = renamed
        self._known: set[Topic] = set()  # in `renamed` when it was started

    def begin(self) -> None:
        """Start the program, without waiting for it."""
        self._known = set(self.renamed)
        super().begin()

    @property
    def command_line(self) -> list[str]:
        """Return the program's arguments, with remapping rules for the names of topics."""
        rules = [word for topic, found in self.renamed.items() for word in ("-r", f"{found}:=/{topic.name}")]
        return [*self.args, *(["--ros-args", *rules] if rules else [])]

    def up(self, *wanted: str) -> None:
        """Do as `Lifecycle.up`; restart the program with remapping when a topic has another name.

        A name that another program of the file has shown meanwhile is not waited for once more.
        """
        if self.state is State.STARTING and not self.renamed.keys() <= self._known:
            self.forget()
        try:
            super().up(*wanted)
        except Wrong:
            found = self._other_names(wanted)
            if not found:
                raise
            self.renamed.update(found)
            self.forget()
            super().up(*wanted)

    def mistyped(self, wanted: tuple[str, ...]) -> str:
        """Return which of the topics has another type, as a sentence; else which of the services and actions."""
        for topic in (self.topics[offer] for offer in self.missing(wanted) if offer in self.topics):
            for name, kind in own_topics(self.ros, topic.publish):
                if name.strip("/") == topic.name and short(kind) != topic.kind:
                    does = "publishes" if topic.publish else "subscribes to"
                    return (
                        f"{self.file} {does} the topic {topic.name} with the type {short(kind)}; its type must be "
                        f"{topic.kind}."
                    )
        return super().mistyped(wanted)

    def forget(self) -> None:
        """End the program, and forget what it did not offer: it will be started with other arguments."""
        self.end()
        self._missed.clear()

    def _other_names(self, wanted: tuple[str, ...]) -> dict[Topic, str]:
        """Return the topics that the program lacks, each with the one topic of the same type that it has instead."""
        lacking = [self.topics[offer] for offer in self.missing(wanted) if offer in self.topics]
        names = {topic.name for topic in self.topics.values()}
        found = {}
        for topic in lacking:
            others = [
                name
                for name, kind in own_topics(self.ros, PUBLISH if topic.publish else SUBSCRIBE)
                if short(kind) == topic.kind and name.strip("/") not in names
            ]
            if topic not in self._known and len(others) == 1:
                found[topic] = others[0]
        return found
