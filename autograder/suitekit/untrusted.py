"""Exceptions that come of reading what a student wrote, or what a student's program printed or sent."""

# What reading raises that no code of the grader's raises by itself: it neither recurses deeply nor has huge numbers.
NEVER_OURS = (RecursionError, OverflowError)

# What a parser (`ast.parse`, `json.loads`, `float`) may raise for a student's text.  Python's own says MemoryError when
# a program is nested too deeply, though there is memory enough.
UNREADABLE = (ValueError, SyntaxError, MemoryError, *NEVER_OURS)
