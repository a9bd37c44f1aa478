"""A file that is not what its exercise cell says is told, with which of the two is newer."""

import json
import os

import pytest

from course.foundation import cells
from course.notebook.file_differences import (
    BOTH_EDITED,
    CELL_OLDER,
    DIFFERS,
    EDITED,
    FILE_EDITED,
    NOT_WRITTEN,
    REFUSED,
    difference_of,
    differences,
    only_in_the_file,
    remember,
    remember_unwritten,
    unlike,
)
from course.notebook.file_record import note_written
from course.notebook.stubs import keep_copy


@pytest.fixture
def folder(tmp_path):
    """A notebook with two exercise cells, and the files as the cells wrote them."""
    sources = [
        "%%exercise server.py\nprint('one')\n### BEGIN SOLUTION\nprint('two')\n### END SOLUTION",
        ["%%exercise Ask.srv --package ask_interfaces\n", "int32 a\n", "---\n"],
        "print('no exercise')",
        "%%exercise ../../outside.py\npass",
    ]
    cells = [{"cell_type": "code", "metadata": {}, "source": source} for source in sources]
    (tmp_path / "section.ipynb").write_text(json.dumps({"cells": cells}))
    (tmp_path / "server.py").write_text("print('one')\nprint('two')\n")
    (tmp_path / "Ask.srv").write_text("int32 a\n---\n")
    return tmp_path


def age(path, seconds: float) -> None:
    moment = path.stat().st_mtime - seconds
    os.utime(path, (moment, moment))


def test_files_that_are_as_their_cells_say_are_left_out(folder):
    assert differences(folder) == {}


def test_a_file_that_was_edited_elsewhere(folder):
    age(folder / "section.ipynb", 60)
    (folder / "server.py").write_text("print('three')\n")
    assert list(differences(folder)) == ["server.py"]
    assert "and is newer: save" in differences(folder)["server.py"]


def test_a_cell_that_was_edited_and_not_run(folder):
    (folder / "server.py").write_text("print('before')\n")
    age(folder / "server.py", 60)
    assert differences(folder)["server.py"].startswith(
        "server.py differs from its cell: since the cell was run, the cell or the file was edited."
    )


@pytest.mark.parametrize(
    ("last", "edited"),
    [
        ("print('before')\n", "the cell was edited"),
        ("print('one')\nprint('two')\n", "the file was edited"),
        ("x\n", "both were edited"),
    ],
)
def test_what_a_cell_has_written_last_tells_which_was_edited(folder, last, edited):
    (folder / "server.py").write_text("print('before')\n")
    age(folder / "server.py", 60)
    note_written(folder / "server.py", last.encode())
    assert f"since the cell was run, {edited}. The file is" in differences(folder)["server.py"]


def test_a_cell_that_was_refused(folder):
    """Nothing was edited since, and running the cell again would not replace the file."""
    age(folder / "Ask.srv", 60)
    (folder / "section.ipynb").write_text((folder / "section.ipynb").read_text().replace("int32 a", "int32 a, b"))
    remember_unwritten(folder / "Ask.srv", "refused: Ask.srv, line 1: only one field per line\nint32 a, b")
    assert differences(folder)["Ask.srv"] == (
        "Ask.srv is not what its cell says: the last run of the cell was refused, and wrote nothing: Ask.srv, line 1: "
        "only one field per line"
    )
    remember(folder / "Ask.srv", "int32 b\n---\n")
    assert "was refused" not in differences(folder)["Ask.srv"]


def test_a_file_that_was_deleted(folder):
    (folder / "Ask.srv").unlink()
    assert differences(folder) == {"Ask.srv": "Ask.srv is missing: run its cell."}


def test_what_is_no_notebook_is_passed_over(folder):
    (folder / "other.ipynb").write_text("{")
    assert differences(folder) == {}


def test_what_a_cell_of_this_kernel_wrote_is_no_difference_until_the_file_is_edited(folder):
    age(folder / "section.ipynb", 60)  # the cell was run and is not saved yet
    (folder / "server.py").write_text("print('three')\n")
    remember(folder / "server.py", "print('three')\n")
    assert difference_of(folder / "server.py") == ""
    (folder / "server.py").write_text("print('four')\n")
    assert "and is newer: save" in difference_of(folder / "server.py")


def test_cells_that_are_not_saved_yet_are_compared_with_their_files(folder):
    known = cells.read(folder / "section.ipynb")
    assert unlike(folder, known) == {"server.py": "", "Ask.srv": ""}
    (folder / "server.py").write_text("print('before')\n")
    (folder / "Ask.srv").unlink()
    assert unlike(folder, known) == {"server.py": DIFFERS, "Ask.srv": NOT_WRITTEN}  # which of the two is not known
    remember(folder / "server.py", "print('before')\n")
    assert unlike(folder, known) == {"server.py": EDITED, "Ask.srv": NOT_WRITTEN}


def test_a_file_that_was_edited_is_told_from_a_cell_that_was(folder):
    known = cells.read(folder / "section.ipynb")
    remember(folder / "server.py", "print('one')\nprint('two')\n")
    (folder / "server.py").write_text("print('mine')\n")
    assert unlike(folder, known)["server.py"] == FILE_EDITED
    remember(folder / "server.py", "print('before')\n")
    assert unlike(folder, known)["server.py"] == BOTH_EDITED
    (folder / ".exercise.json").write_text('["damaged"]')
    assert unlike(folder, known)["server.py"] == DIFFERS


def test_a_cell_that_has_an_earlier_text_than_its_file_is_told_so_and_its_file_is_kept(folder):
    """As when a page is loaded again, and the notebook had not been saved since the cell was run."""
    known, file, later = cells.read(folder / "section.ipynb"), folder / "server.py", "print('later')\n"
    earlier = file.read_text()
    for text in (earlier, later):
        file.write_text(text)
        remember(file, text)
    assert unlike(folder, known)["server.py"] == CELL_OLDER
    assert only_in_the_file(file, earlier) == later.encode()
    assert only_in_the_file(file, "print('new')\n") is None
    (folder / "saved.ipynb").write_text(
        json.dumps({"cells": [{"cell_type": "code", "metadata": {}, "source": f"%%exercise server.py\n{later}"}]})
    )
    assert only_in_the_file(file, earlier) is None


def test_a_cell_with_an_error_has_written_nothing(folder):
    said = "server.py, line 1: invalid syntax: print(\nNothing was written: server.py is unchanged"
    error = {"output_type": "error", "ename": "ExerciseError", "evalue": said}
    broken = cells.Cell("code", "%%exercise server.py\nprint(", outputs=[error])
    assert unlike(folder, [broken]) == {"server.py": f"{REFUSED}: server.py, line 1: invalid syntax: print("}
    right = cells.Cell("code", "%%exercise server.py\nprint('one')\nprint('two')\n", outputs=[error])
    assert unlike(folder, [right]) == {"server.py": ""}


def test_a_text_that_a_copy_has_already_is_not_kept_again(tmp_path):
    texts = (b"1", b"2", b"1", b"2")
    kept = [keep_copy(tmp_path, "[x].py", text, "edited").name for text in texts]
    assert kept == ["[x].edited-1.py", "[x].edited-2.py"] * 2
    (tmp_path / kept[0]).write_bytes(b"1, and more")
    assert keep_copy(tmp_path, "[x].py", b"1", "before-reset").name == "[x].before-reset-1.py"
    assert keep_copy(tmp_path, "[x].py", b"1", "edited").name == "[x].edited-3.py"
