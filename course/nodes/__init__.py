"""The chapter's nodes, one file each: `python -m course.nodes.NAME --ros-args ...` runs one as a program."""
