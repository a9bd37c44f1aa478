"""Refusing feedback pages that the course's grader has not made: its own consist of few elements, and do nothing.

A page may come from anywhere, and is opened with a double click.  So whatever the grader does not write is refused,
even if it is harmless: a script, an address, a comment, an element in capitals.  Text is not looked at, for the grader
escapes each `<` in it.
"""

import re

from course.errors import FeedbackError
from course.returned.record import META

# The policy comes before all that it forbids, and the encoding before all text.
BEGIN = re.compile(
    rb'<!doctype html>\s*<html lang="en">\s*<head>\s*<meta charset="utf-8">\s*'
    rb'<meta name="viewport" content="width=device-width, initial-scale=1">\s*'
    rb"""<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">"""
)
TAG = re.compile(rb"<[^<>]*>?")
# In the record no `<` is left either: behind `<title>` a browser would take it for the next element.
WRITTEN = re.compile(
    rb"</?(?:html|head|title|style|body|h1|h2|p|div|strong|ol|li|small|table|tr|th|td|pre)>"
    rb'|<(?:p|div|ol|td) class="[a-z_]*">'
    rb'|<meta name="' + META.encode() + rb'" content="[^"<>]*">'
)


def check(page: bytes) -> None:
    """Raise FeedbackError for a page that the course's grader has not made; takes time in proportion to its size."""
    begin = BEGIN.match(page)
    if not begin or any(not WRITTEN.fullmatch(tag[0]) for tag in TAG.finditer(page, begin.end())):
        raise FeedbackError(
            "it was not made by the course's grader, or was changed afterwards: ask your instructor for the page"
        )
