"""Notices when a student hands in another text than the one that was marked by hand.

nbgrader keeps a mark whatever is handed in afterwards.  So the gradebook gets a further table, with a digest of each
written answer as it was when the submission was graded last.
"""

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path

from nbgrader.api import Grade, Gradebook
from sqlalchemy import Column, MetaData, String, Table, select

from autograder.submissions import reading
from course.errors import UnreadableNotebook

TABLE = Table("written_answer", MetaData(), Column("grade", String(32), primary_key=True), Column("digest", String(64)))


def answers(submission: Path, assignment: str) -> dict[str, str] | None:
    """Return the text of each named cell of the notebook in a submission's folder; None without a readable notebook."""
    try:
        cells = reading.read_notebook(submission / f"{assignment}.ipynb")
    except UnreadableNotebook:
        return None
    return {cell.name: cell.source for cell in reversed(cells) if cell.name}  # the first of a name counts


def noted(book: Gradebook, questions: Iterable[Grade]) -> bool:
    """Return True if one of the questions has ever been graded with its answer."""
    connection = book.db.connection()
    TABLE.create(connection, checkfirst=True)
    known = select(TABLE.c.grade).where(TABLE.c.grade.in_([grade.id for grade in questions]))
    return connection.execute(known).first() is not None


def note(book: Gradebook, questions: Iterable[Grade], texts: Mapping[str, str]) -> list[str]:
    """Note the answers as they are now; return the names of those with a mark for another text, flagged for marking.

    The gradebook's session is not committed.
    """
    connection = book.db.connection()
    TABLE.create(connection, checkfirst=True)
    changed = []
    for grade in questions:
        digest = hashlib.sha256(texts.get(grade.name, "").strip().encode()).hexdigest()
        of = TABLE.c.grade == grade.id
        before = connection.execute(select(TABLE.c.digest).where(of)).scalar()
        if before is None:
            connection.execute(TABLE.insert().values(grade=grade.id, digest=digest))
        elif before != digest:
            connection.execute(TABLE.update().where(of).values(digest=digest))
            if grade.manual_score is not None:
                grade.needs_manual_grade = True
                changed.append(grade.name)
    return changed
