"""Files in memory, which bubblewrap copies into the sandbox of a program or the box of a class member."""

import os


class MemoryFiles:
    """The descriptors of some files in memory; to be closed once the command that inherits them runs."""

    def __init__(self) -> None:
        self.descriptors: list[int] = []

    def __call__(self, content: bytes) -> str:
        """Return a new descriptor to read `content` from, as text for a command line."""
        descriptor = os.memfd_create("file")
        self.descriptors.append(descriptor)
        os.write(descriptor, content)
        os.lseek(descriptor, 0, os.SEEK_SET)
        return str(descriptor)

    def close(self) -> None:
        """Close the descriptors in this process; processes that inherited them keep them."""
        for descriptor in self.descriptors:
            os.close(descriptor)
        self.descriptors.clear()
