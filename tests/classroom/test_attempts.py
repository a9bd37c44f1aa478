"""Wrong passwords: some at once, then ever more slowly; nobody keeps another one out for long."""

import pytest
import requests

from autograder.classroom import accounts, attempts, hub
from autograder.classroom.attempts import EVERYWHERE, FREE, FREE_TOGETHER, LONGEST, MOST, Attempts
from tests.classroom.conftest import call_classroom, run_classroom
from tests.classroom.visitor import Visitor


@pytest.fixture
def clock():
    return [1000.0]


@pytest.fixture
def tried(clock):
    return Attempts(lambda: clock[0])


def test_after_some_wrong_ones_each_takes_longer_up_to_a_limit(tried, clock):
    assert [tried.begin("ada", "lab", False) for _ in range(FREE)] == [0.0] * FREE
    waits = []
    for _ in range(8):
        waits.append(tried.begin("ada", "lab", False))
        clock[0] += waits[-1]
        assert tried.begin("ada", "lab", False) == 0.0
    assert waits == [10, 20, 40, 80, 160, LONGEST, LONGEST, LONGEST]


def test_many_at_the_same_time_are_no_more_than_one_after_the_other(tried):
    """None has ended when the next one begins."""
    assert sum(tried.begin("ada", "lab", False) == 0.0 for _ in range(100)) == FREE


def test_the_right_one_ends_it(tried):
    for _ in range(FREE):
        tried.begin("ada", "lab", False)
        tried.succeeded("ada", "lab")
    assert tried.begin("ada", "lab", False) == 0.0


def test_who_guesses_keeps_the_owner_out_nowhere_else(tried):
    for _ in range(FREE + 1):
        tried.begin("ada", "of eve", False)
    assert tried.begin("ada", "of eve", False) > 0
    assert tried.begin("ada", "lab", False) == tried.begin("bob", "of eve", False) == 0.0


def test_many_places_are_counted_together_and_a_known_browser_is_not_kept_out(tried):
    assert not any(tried.begin("ada", f"{number}", False) for number in range(FREE_TOGETHER))
    assert tried.begin("ada", "one more", False) > 0
    assert tried.begin("ada", "ada:browser", True) == 0.0


def test_a_known_browser_waits_too(tried):
    assert sum(tried.begin("ada", "ada:browser", True) == 0.0 for _ in range(100)) == FREE


def test_counts_are_forgotten_and_bounded(tried, clock):
    for number in range(MOST + 10):
        tried.begin("ada", f"{number}", True)
    assert len(tried._counts) <= MOST
    tried.forget_before("ada", clock[0])
    assert not tried._counts and EVERYWHERE == ""


def test_twelve_wrong_ones_lock_and_an_instructor_unlocks(classroom):
    right = hub.shared_passwords(classroom)["students"]
    visitor = Visitor(classroom.url, "erin")
    assert not any(visitor.log_in("guessed") for _ in range(12))
    assert not visitor.log_in(right)
    assert visitor.answer.status_code == 429 and "Too many wrong passwords: try again in " in visitor.answer.text
    assert Visitor(classroom.url, "carol").log_in(right), "another one is kept out"
    done = run_classroom("unlock", "erin", "--folder", str(classroom.folder))
    assert done.returncode == 0 and done.stdout == "erin may try again.\n"
    assert visitor.log_in(right)
    later = Visitor(classroom.url, "erin")
    assert not any(later.log_in("guessed") for _ in range(12))
    assert not later.log_in(right)
    visitor.session.get(f"{classroom.url}hub/logout").raise_for_status()
    assert visitor.log_in(right), "a browser in which erin has been is kept out"
    attempts.unlock(classroom, "erin")


def test_a_forged_address_gains_nothing(classroom):
    guesser = Visitor(classroom.url, "erin")
    for number in range(12):
        guesser.session.headers["X-Real-IP"] = f"192.0.2.{number}"
        guesser.session.headers["X-Forwarded-For"] = f"192.0.2.{number}"
        assert not guesser.log_in("guessed")
    assert guesser.answer.status_code == 429
    attempts.unlock(classroom, "erin")


def test_half_a_character_in_a_token_fails_for_its_sender_alone(classroom):
    """All requests share one session of the database, which such a note leaves unusable."""
    erin, carol = Visitor(classroom.url, "erin"), Visitor(classroom.url, "carol")
    assert all(visitor.log_in(hub.shared_passwords(classroom)["students"]) for visitor in (erin, carol))
    tokens = f"{classroom.url}hub/api/users/erin/tokens"
    for _ in range(3):
        refused = erin.session.post(tokens, json={"note": "\ud800"}, headers=erin._headers("/hub/"))
        page = carol.session.get(f"{classroom.url}hub/home", allow_redirects=False)  # to the login page
        assert (refused.status_code, page.status_code) == (400, 200)


def test_after_a_new_password_a_former_login_leads_to_the_login_page(classroom):
    visitor = Visitor(classroom.url, "erin")
    assert visitor.log_in(hub.shared_passwords(classroom)["students"])
    assert visitor.session.get(f"{classroom.url}hub/home").url.endswith("/hub/home")
    renewed = classroom.state / accounts.RENEWED
    renewed.mkdir(exist_ok=True)
    (renewed / "erin").touch()  # as `password` does, which this class, for trying, does not have
    page = visitor.session.get(f"{classroom.url}hub/home")
    assert page.ok and "/hub/login" in page.url


def test_after_a_new_password_a_former_token_makes_no_further_one(classroom):
    visitor = Visitor(classroom.url, "erin")
    assert visitor.log_in(hub.shared_passwords(classroom)["students"])
    tokens = f"{classroom.url}hub/api/users/erin/tokens"
    visitor.session.get(f"{classroom.url}hub/home").raise_for_status()
    token = visitor.session.post(tokens, json={}, headers=visitor._headers("/hub/")).json()["token"]
    by_token = {"Authorization": f"token {token}"}
    assert requests.get(f"{classroom.url}hub/api/user", headers=by_token).ok
    (classroom.state / accounts.RENEWED).mkdir(exist_ok=True)
    (classroom.state / accounts.RENEWED / "erin").touch()
    assert [requests.post(tokens, json={}, headers=by_token).status_code for _ in range(2)] == [403, 403]


def test_a_cookie_that_was_kept_is_good_for_nothing_after_logging_out(classroom):
    visitor = Visitor(classroom.url, "erin")
    assert visitor.log_in(hub.shared_passwords(classroom)["students"])
    kept = requests.Session()
    kept.cookies.update(visitor.session.cookies)
    assert kept.get(f"{classroom.url}hub/home").url.endswith("/hub/home")
    visitor.session.get(f"{classroom.url}hub/logout").raise_for_status()
    assert "/hub/login" in kept.get(f"{classroom.url}hub/home").url


def test_nobody_else_can_be_unlocked(classroom):
    done = call_classroom("unlock", "eve", "--folder", str(classroom.folder))
    assert done.returncode == 2 and done.stderr == "classroom: eve is not in the class\n"
