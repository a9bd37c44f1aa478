"""Whatever lies below what `autograder collect` was given is laid out, kept or listed."""

import subprocess
from pathlib import Path

import pytest

from autograder.collecting.collect import Collection, collect, describe
from autograder.errors import UsageError
from autograder.submissions import reading
from autograder.submissions.roster import Roster
from course.hand_in import HandIn, write

from .test_collect import AUTOGRADER, EARLY, FILES, archive, counted, handed_in, laid_out


def unplaced(result: Collection) -> dict[str, str]:
    """Return the reasons why hand-ins were not placed, by hand-in."""
    return {line.partition(": ")[0]: line.partition(": ")[2] for line in result.unplaced}


@pytest.fixture
def roster() -> Roster:
    found = Roster()
    for student in ("ada", "bob", "jim", "zoe"):
        found.add(student, [f"{student} of the roster"])
    return found


def test_archives_in_folders_are_found(tmp_path):
    for student, folder in {"ada": "week1", "bob": "week1", "jim": "week1/mailed", "zoe": "."}.items():
        handed_in(tmp_path / "in" / folder, student)
    (tmp_path / "in" / "week2" / "eve" / "services").mkdir(parents=True)
    (tmp_path / "in" / "week2" / "eve" / "services" / "relay.py").write_bytes(b"relay")
    result = collect([tmp_path / "in"], tmp_path / "out")
    assert counted(tmp_path / "out") == {f"{name}/services" for name in ("ada", "bob", "jim", "zoe", "eve")}
    assert result.unplaced == []


def test_what_is_not_laid_out_is_listed(tmp_path):
    folder = tmp_path / "in"
    handed_in(folder / "week1", "ada")
    for name in (
        "week1/notes.txt",
        "relay.py",
        "bob/motor_service.py",
        "work.tar.gz",
        "week1/ada.rar",
        ".a.zip",
        ".DS_Store",
    ):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(b"x")
    (folder / "link").symlink_to("/etc")
    for number in range(25):
        (folder / "pictures").mkdir(exist_ok=True)
        (folder / "pictures" / f"{number:02}.jpg").write_bytes(b"")
    result = collect([folder], folder / "out")  # what is laid out is no source
    again = collect([folder], folder / "out")
    for found in (result, again):
        listed = unplaced(found)
        assert {name for name in listed if not name.startswith("pictures/")} == {
            "week1/notes.txt",
            "relay.py",
            "bob/motor_service.py",
            "work.tar.gz",
            "week1/ada.rar",
            ".a.zip",
            "link",
            str(folder / "pictures"),
        }
        assert listed[str(folder / "pictures")] == "5 more files without a hand-in"
        assert "not a .tar.gz archive that can be read" in listed["work.tar.gz"]
        assert "unpack it, and pack it as .zip" in listed["week1/ada.rar"]
        assert listed["link"] == "a link, which is not followed"
    assert counted(folder / "out") == {"ada/services"}


@pytest.mark.parametrize(
    "name", ["relay (1).py", "relay(2).py", "Relay.py", "relay copy.py", "relay - Copy (2).py", "Copy of relay.py"]
)
def test_a_further_copy_of_a_browser_is_taken_and_flagged(tmp_path, name):
    bulk = archive(tmp_path / "bulk.zip", {f"doejane_1_2_{name}": b"relay", "doejane_1_3_motor_service.py": b"motor"})
    result = collect([bulk], tmp_path / "out")
    assert laid_out(tmp_path / "out") == {
        "doejane/services/relay.py": b"relay",
        "doejane/services/motor_service.py": b"motor",
    }
    assert f"LOOK: {name} is used as relay.py" in describe(result)


def test_of_two_copies_the_one_with_the_right_name_counts_and_is_flagged(tmp_path):
    files = {"relay.py": b"right", "relay (1).py": b"again", "motor_service (1).py": b"1", "motor_service (2).py": b"2"}
    work = archive(tmp_path / "work.zip", files)
    bulk = archive(tmp_path / "bulk.zip", {"doejane_1_2_work.zip": work.read_bytes()})
    result = collect([bulk], tmp_path / "out")
    content = laid_out(tmp_path / "out")
    assert content["doejane/services/relay.py"] == b"right"
    assert content["doejane/services/motor_service.py"] == b"2"
    assert "relay.py counts, and relay (1).py does not: is that right?" in describe(result)


def test_a_student_is_told_of_the_name_that_a_browser_made(tmp_path):
    folder = tmp_path / "ada" / "services"
    folder.mkdir(parents=True)
    (folder / "relay (1).py").write_bytes(b"relay")
    (told,) = reading.read(folder, "ada", "services", ["relay.py"]).problems
    assert "relay.py (there is relay (1).py: rename it)" in told


def test_files_that_the_exercise_does_not_ask_for_are_said(tmp_path):
    work = archive(
        tmp_path / "work.zip", {"relay.py": b"x", "helper.py": b"y", "__pycache__/relay.pyc": b"", "a/b.txt": b""}
    )
    bulk = archive(tmp_path / "bulk.zip", {"doejane_1_2_work.zip": work.read_bytes()})
    result = collect([bulk], tmp_path / "out")
    assert "not used: a/b.txt, helper.py)" in describe(result)


def test_another_kind_of_archive_is_named_as_that(tmp_path):
    bulk = archive(tmp_path / "bulk.zip", {"doejane_1_2_work.7z": b"x"})
    path = tmp_path / "work.tar"
    path.write_bytes(b"x")
    result = collect([bulk, path], tmp_path / "out")
    assert [line.partition(": ")[2] for line in result.unplaced] == [
        "work.7z is a kind of archive that cannot be opened: unpack it, and pack it as .zip",
        "this kind of archive cannot be opened: unpack it, and pack it as .zip",
    ]


def test_another_exercise_than_expected_is_not_laid_out(tmp_path, roster):
    handed_in(tmp_path / "in", "ada")
    write(HandIn("actions", [], {"lift_server.py": b"x"}, {}), tmp_path / "in", "bob", {}, EARLY)
    result = collect([tmp_path / "in"], tmp_path / "out", roster, assignment="services")
    assert counted(tmp_path / "out") == {"ada/services"}
    assert [line.partition(": ")[2] for line in result.unplaced] == ["it is a hand-in of actions, not of services"]
    assert result.missing == {"services": ["bob", "jim", "zoe"]}
    with pytest.raises(UsageError, match="nonsense"):
        collect([tmp_path / "in"], tmp_path / "out", assignment="nonsense")


def test_another_exercise_than_the_rest_of_a_download_is_flagged(tmp_path):
    lift = write(HandIn("actions", [], {"lift_server.py": b"x"}, {}), tmp_path, "x", {}, EARLY).read_bytes()
    files = {f"student{number}_{number}_1{number}_relay.py": b"x" for number in range(3)}
    bulk = archive(tmp_path / "bulk.zip", files | {"doejane_9_19_hand-in.zip": lift})
    result = collect([bulk], tmp_path / "out")
    assert [each.remark for each in result.laid_out if each.student == "doejane"] == [
        "it is a hand-in of actions, and most hand-ins in bulk.zip are of services"
    ]
    assert not any(each.remark for each in result.laid_out if each.student != "doejane")


def test_a_likely_name_is_taken_with_a_roster_and_flagged(tmp_path, roster):
    plain = archive(tmp_path / "work.zip", FILES)
    for name in ("ada.zip", "services-bob.zip", "jim/my work.zip", "stranger.zip"):
        (tmp_path / "in" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "in" / name).write_bytes(plain.read_bytes())
    result = collect([tmp_path / "in"], tmp_path / "out", roster)
    assert counted(tmp_path / "out") == {"ada/services", "bob/services", "jim/services"}
    assert "LOOK: it does not say who handed it in; assigned to bob by its name 'services-bob'" in describe(result)
    assert unplaced(result) == {"stranger.zip": "it does not say who handed it in"}
    assert result.missing == {"services": ["zoe"]}


def test_who_handed_in_nothing_is_listed(tmp_path):
    handed_in(tmp_path / "in", "ada")
    (tmp_path / "roster.csv").write_text("student\nada\nbob\nzoe\n")
    command = [AUTOGRADER, "collect", "in", "--into", "out", "--roster", "roster.csv", "--assignment", "services"]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert ran.returncode == 0, ran.stderr
    assert "services: not handed in by 2 students: bob, zoe" in ran.stdout.splitlines()
    assert Path(tmp_path / "out" / "ada" / "services").is_dir()
