"""The lab's part of the Jupyter server asks who is there, and serves its folder alone."""

import contextlib
import json
import socket
import urllib.error
import urllib.request

import pytest
import websocket

from course.lab import protocol
from tests.browser.conftest import WAIT
from tests.browser.pages import write_greeter

TIME = WAIT / 1e3  # s


def request(lab, path, body=None, *, token=True, **headers):
    """The status and the JSON of a request; of an answer in several lines, a list of them."""
    address, secret, _ = lab
    headers |= {"Authorization": f"token {secret}"} if token else {}
    data = None if body is None else json.dumps(body).encode()
    try:
        with urllib.request.urlopen(urllib.request.Request(address + path, data, headers), timeout=TIME) as answer:
            said = [json.loads(line) for line in answer]
            return answer.status, said[0] if len(said) == 1 else said
    except urllib.error.HTTPError as error:
        return error.code, {}


def connect(lab, kernel, *, token=True):
    address, secret, _ = lab
    url = f"{address.replace('http', 'ws')}/course/lab/{kernel}"
    header = [f"Authorization: token {secret}"] if token else []
    return websocket.create_connection(url, timeout=TIME, header=header)


@pytest.fixture
def kernel(lab):
    status, made = request(lab, "/api/kernels", {"name": "python3"})
    assert status == 201
    return made["id"]


def test_a_page_waits_until_the_kernel_has_a_session(lab, kernel):
    page = connect(lab, kernel)
    assert json.loads(page.recv()) == {"link": "waiting"}
    page.close()


def test_a_line_that_is_too_long_does_not_pass_for_a_kernel_that_has_ended(lab, kernel):
    """It cannot come from a kernel of this course, but from one that runs since before an update."""
    page = connect(lab, kernel)
    assert json.loads(page.recv()) == {"link": "waiting"}
    with socket.socket(socket.AF_UNIX) as played:
        runtime = next((lab[2].parent / "home").rglob(f"kernel-{kernel}.json")).parent
        path = runtime / protocol.socket_path(kernel).name
        with protocol.address(path) as name:
            played.bind(name)
        played.listen()
        for line in ((protocol.LINE + 1) * b"x" + b"\n", b'"short"\n'):
            assert json.loads(page.recv()) == {"link": "up"}
            with contextlib.suppress(OSError):  # it is not read to its end
                connected = played.accept()[0]
                connected.sendall(line)
            told = json.loads(page.recv())
            assert told == ("short" if line == b'"short"\n' else {"link": "connecting"})
        played.close()
        path.unlink()
        connected.close()
    assert json.loads(page.recv()) == {"link": "waiting"}
    page.close()


def test_a_stranger_has_no_way_to_a_kernel(lab, kernel):
    with pytest.raises(websocket.WebSocketBadStatusException) as refused:
        connect(lab, kernel, token=False)
    assert refused.value.status_code == 403


def test_a_kernel_that_is_not_there_is_not_found(lab):
    with pytest.raises(websocket.WebSocketBadStatusException) as refused:
        connect(lab, "0b0e6f5c-0000-0000-0000-000000000000")
    assert refused.value.status_code == 404


def test_a_picture_of_a_notebook_is_a_file_and_does_nothing_else(lab):
    """The address of a picture may be any of the server's: one that ends the login, for example."""
    (lab[2] / "picture.json").write_text("{}")
    picture = {"Sec-Fetch-Dest": "image"}  # as a browser says it
    assert request(lab, "/files/picture.json", **picture) == (200, {})
    assert [request(lab, path, **picture)[0] for path in ("/logout", "/api/contents")] == [403, 403]
    assert request(lab, "/api/contents")[0] == 200


def test_a_file_that_is_shown_as_a_page_runs_no_script(lab):
    """The policy is sent, except for PDF, which has its own viewer.  test_hostile.py tests that browsers obey it."""
    address, secret, folder = lab
    for name in ("page.html", "drawing.svg", "page.pdf"):
        (folder / name).write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")

    def policy(path: str) -> list[str]:
        asked = urllib.request.Request(address + path, headers={"Authorization": f"token {secret}"})
        with urllib.request.urlopen(asked, timeout=TIME) as answer:
            return [each.strip() for each in answer.headers["Content-Security-Policy"].split(";")]

    for path in ("/files/page.html", "/files/drawing.svg"):
        assert {"sandbox", "default-src 'none'", "frame-ancestors 'self'"} <= {*policy(path)}
    assert {"sandbox", "default-src 'none'"} <= {*policy("/nbconvert/html/calculator.ipynb")}
    assert not [each for each in policy("/files/page.pdf") if each.startswith(("sandbox", "default-src"))]


@pytest.mark.parametrize("path", ["/course/hand-in", "/course/exercise", "/course/exercise/reset"])
def test_files_are_for_whoever_may_log_in_and_below_the_served_folder(lab, path):
    _, _, served = lab
    (served.parent / "outside").mkdir(exist_ok=True)
    body = {"path": "../outside/x.ipynb", "cells": [], "cell": "x", "file": "x.py", "text": "x"}
    assert request(lab, path, body, token=False)[0] == 403
    assert request(lab, path, body)[0] == 404
    assert request(lab, path, {"nonsense": 1})[0] == 400
    assert list((served.parent / "outside").iterdir()) == []


def test_a_hand_in_with_a_failed_check_is_asked_about(lab):
    """Its checks are not run again for the answer, unless a file has changed."""
    folder = lab[2] / "failing"
    write_greeter(folder, answer="print('nobody')\n")
    (folder / "greeter.py").write_text("print('nobody')\n")
    body = {"path": "failing/failing.ipynb", "name": "ada", "agreed": {}}
    _, (*steps, asked) = request(lab, "/course/hand-in", body)
    assert steps == [{"began": True}, {"ran": 1, "of": 1}]
    assert list(asked["ask"]["failed"]) == ["greets"]
    assert list(folder.glob("*.zip")) == []
    status, said = request(lab, "/course/hand-in", body | {"failed": asked["ask"]["failed"]})
    assert (status, list(said)) == (200, ["done"])
    assert said["done"]["checks"]["greets"].startswith("not yet: ")
    assert [path.name for path in folder.glob("*.zip")] == [said["done"]["archive"].rpartition("/")[2]]


@pytest.mark.parametrize("file", ["../x.py", "x", "/tmp/x.py", "x.ipynb"])
def test_a_copy_is_kept_of_exercise_files_alone(lab, file):
    body = {"path": "calculator.ipynb", "cell": "x", "file": file, "text": "x"}
    assert request(lab, "/course/exercise/reset", body)[0] == 400
