"""The instructors' start page: how far the class is, and more time for students."""

import re
import shutil
from dataclasses import replace
from urllib.parse import urlsplit

import pytest

from autograder.classroom import cli, course_files, hub
from autograder.classroom.class_page import extend
from autograder.classroom.members import Member
from autograder.errors import UsageError
from autograder.gradebook import extensions
from tests.classroom.visitor import Visitor


@pytest.fixture
def instructor(classroom) -> Visitor:
    """The teacher at the hub, without a server."""
    visitor = Visitor(classroom.address_of(classroom.find("teacher")), "teacher")
    assert visitor.log_in(hub.shared_passwords(classroom)["instructors"])
    return visitor


def ask(visitor: Visitor, origin: str | None = None, **fields: str):
    data = {"_xsrf": visitor.session.cookies.get("_xsrf", path="/hub/"), **fields}
    return visitor.session.post(f"{visitor.hub}hub/class", data=data, headers={"Origin": origin} if origin else None)


def test_an_instructor_begins_there_and_sees_the_state_of_each_exercise(instructor):
    page = instructor.session.get(instructor.hub)
    assert page.url.endswith("/hub/class") and page.ok
    text = " ".join(re.sub("<[^>]+>", " ", page.text).split())
    assert re.search(r"calculator released 20\d\d-\d\d-\d\d \d\d:\d\d UTC (\d of 5 ?){3}", text), text
    assert "Carol Lovelace" in text


def test_an_instructor_gives_more_time_and_takes_it_back(instructor, classroom):
    def given() -> extensions.Given:
        return extensions.read(classroom.grading)

    assert ask(instructor, student="carol", exercise="actions", days="2.5").ok
    assert given() == {"carol": {"actions": 2.5}}
    page = ask(instructor, student="carol", exercise=extensions.ALL, until="2099-01-01T10:00")
    assert page.ok and "until 2099-01-01 10:00 UTC" in page.text
    assert given() == {"carol": {"actions": 2.5, "*": "2099-01-01 10:00 UTC"}}
    assert (classroom.grading / extensions.FILE).stat().st_mode & 0o777 == 0o660  # the other instructors', too
    for exercise in (extensions.ALL, "actions"):
        ask(instructor, student="carol", exercise=exercise, take_back="yes")
    assert given() == {}
    refused = ask(instructor, student="carol", exercise="nonsense", days="1")
    assert refused.status_code == 400 and "there is no exercise &#39;nonsense&#39;" in refused.text


def test_what_was_chosen_stays_when_something_is_missing(instructor):
    page = ask(instructor, student="carol", exercise="actions", until="2099-01-01T10:00", days="2")
    assert page.status_code == 400 and "give a number of days or a time" in page.text
    assert re.search(r'<option value="carol" selected>', page.text) and "<option selected>actions</option>" in page.text
    assert 'value="2099-01-01T10:00"' in page.text and re.search(r'name="days"[^>]* value="2"', page.text)


def test_nobody_else_is_let_in(instructor, classroom):
    student = Visitor(classroom.address_of(classroom.find("ada")), "ada")
    assert student.log_in(hub.shared_passwords(classroom)["students"])
    assert student.session.get(f"{student.hub}hub/class").status_code == 403
    assert ask(student, student="ada", days="9").status_code == 403
    stranger = Visitor(classroom.url, "ada")
    assert "/hub/login" in stranger.session.get(f"{classroom.url}hub/class").url
    foreign = instructor.session.post(f"{instructor.hub}hub/class", data={"student": "ada", "days": "9"})
    assert foreign.status_code == 403  # a page of somebody else's does not know the token
    assert extensions.read(classroom.grading) == {}


@pytest.mark.parametrize(
    ("asked", "command"),
    [
        ({"days": "3"}, ["--days=3"]),
        ({"days": "0.5", "exercise": "services"}, ["--assignment=services", "--days=0.5"]),
        ({"until": "2026-11-27T23:59"}, ["--until=2026-11-27 23:59 UTC"]),
        ({"take_back": "yes", "exercise": "*"}, ["--take-back"]),
        ({"exercise": "--course=/", "days": "1"}, ["--assignment=--course=/", "--days=1"]),
    ],
)
def test_the_form_becomes_a_command(quiet, asked, command):
    form = dict.fromkeys(("exercise", "days", "until", "take_back"), "") | {"student": "ada"} | asked
    assert extend(quiet, form) == ["autograder", "extend", "ada", "--course", "grading", *command]


@pytest.mark.parametrize(
    ("asked", "why"),
    [
        ({}, "a number of days or a time"),
        ({"days": "1", "until": "2026-11-27T23:59"}, "a number of days or a time"),
        ({"days": "many"}, "'many' is not a number of days"),
        ({"days": "nan"}, "'nan' is not a number of days"),
        ({"days": "-1"}, "'-1' is not a number of days"),
        ({"until": "tomorrow"}, "is not a time"),
        ({"student": "teacher", "days": "1"}, "choose a student"),
        ({"student": "--help", "days": "1"}, "choose a student"),
    ],
)
def test_a_form_that_says_nothing_is_refused(quiet, asked, why):
    form = dict.fromkeys(("exercise", "days", "until", "take_back"), "") | {"student": "ada"} | asked
    with pytest.raises(UsageError, match=re.escape(why)):
        extend(quiet, form)


def test_a_file_of_extensions_that_cannot_be_read_is_named_on_the_page(instructor, classroom):
    path = classroom.grading / extensions.FILE
    kept = path.read_bytes() if path.exists() else b""
    try:
        path.write_bytes(b'{"ada": ')
        page = instructor.session.get(f"{instructor.hub}hub/class")
        assert page.ok
        assert "extensions.json cannot be read" in page.text
        assert "No extensions." not in page.text
        assert "Carol Lovelace" in page.text
    finally:
        path.write_bytes(kept)


def test_what_an_instructor_gives_away_at_the_hub_does_not_outlive_their_being_one(instructor, classroom):
    """Neither tokens in the name of others, nor rights: who is an instructor is in the roster alone."""

    def asked(method: str, path: str, **content: object):
        headers = {
            "X-XSRFToken": instructor.session.cookies.get("_xsrf", path="/hub/") or "",
            "Referer": instructor.hub,
        }
        return instructor.session.request(method, f"{instructor.hub}hub/api/{path}", json=content, headers=headers)

    assert [asked("POST", f"users/{name}/tokens", note="").status_code for name in ("ada", "teacher")] == [403, 201]
    assert asked("POST", "shares/bob/", user="ada").status_code == 403
    assert asked("POST", "share-codes/bob/").status_code == 403
    assert asked("POST", "groups/friends").status_code == 403
    assert asked("PATCH", "users/ada", admin=True).ok
    student = Visitor(classroom.address_of(classroom.find("ada")), "ada")
    assert student.log_in(hub.shared_passwords(classroom)["students"])
    assert student.session.get(f"{student.hub}hub/api/users").status_code == 403
    assert asked("GET", "users/ada").json()["admin"] is False


def test_a_page_of_another_port_of_the_same_name_does_nothing_in_an_instructors_name(instructor, classroom):
    """It can read the token against forgery, and browsers send the cookies: they keep these for a name alone."""
    data = {"_xsrf": instructor.session.cookies.get("_xsrf", path="/hub/"), "student": "carol", "days": "9"}
    address = urlsplit(instructor.hub)
    for origin in (f"http://{address.hostname}:1", "null"):
        done = instructor.session.post(f"{instructor.hub}hub/class", data=data, headers={"Origin": origin})
        assert not done.url.endswith("/hub/class") or done.status_code == 403
        assert extensions.read(classroom.grading) == {}
    # What was refused has left the browser another token against forgery, good for nobody: the page is opened again.
    assert instructor.session.get(f"{instructor.hub}hub/class").ok
    assert ask(instructor, student="carol", take_back="yes", origin=instructor.hub.rstrip("/")).ok


def test_a_page_of_another_address_logs_nobody_in(classroom):
    """It could have planted a token against forgery of its own: somebody would work in another's name."""
    visitor = Visitor(classroom.address_of(classroom.find("ada")), "ada")
    password = hub.shared_passwords(classroom)["students"]
    visitor.session.headers["Origin"] = "http://elsewhere.example"
    assert not visitor.log_in(password)
    assert visitor.answer is not None and visitor.answer.status_code == 403
    assert visitor.session.get(f"{visitor.hub}hub/home").url.partition("?")[0].endswith("/hub/login")
    visitor.session.headers["Origin"] = visitor.hub.rstrip("/")
    assert visitor.log_in(password)


def test_a_class_at_the_same_address_with_a_member_of_the_same_name_is_told(quiet, tmp_path, capsys):
    """Browsers send the log-in of the one class to the other's servers."""
    other = replace(quiet, folder=tmp_path / "other", host="localhost", members=(Member("bob"), Member("tom", True)))
    apart = replace(quiet, folder=tmp_path / "apart", host="elsewhere.example", members=quiet.members)
    mine = replace(quiet, host="localhost")
    for each in (other, apart):
        course_files.make_folders(each)
        each.save()
    try:
        assert {other.folder, apart.folder} <= {each.folder for each in hub.others(mine)}
        cli._warn_of_namesakes(mine)
        told = capsys.readouterr().out
        assert f"WARNING: also in the class of {other.folder}, at the same address: bob." in told
        assert str(apart.folder) not in told
    finally:
        for each in (other, apart):
            shutil.rmtree(each.run)
