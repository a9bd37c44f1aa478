"""The file that a `%%exercise` cell writes, from the cell's text alone: what it is does not depend on running it."""

import re

# nbgrader's marks around what is taken out of the released notebook: they are not part of the file.
MARKERS = re.compile(r"^[ \t]*### (?:BEGIN|END) SOLUTION[ \t]*\n", re.MULTILINE)


def content(body: str) -> str:
    """What the cell's lines below `%%exercise FILE` are as a file."""
    return MARKERS.sub("", body)
