"""A student's server is the student's: a page of it gets nothing from the instructor who opens it."""

from dataclasses import replace

import pytest
from jupyterhub.handlers.base import BaseHandler
from traitlets.config import Config

from autograder.classroom import addresses, hub
from tests.classroom import theft
from tests.classroom.conftest import run_classroom
from tests.classroom.visitor import Visitor


@pytest.mark.long("the first test of the class: everybody's server starts")
def test_a_students_page_gets_nothing_of_an_instructor(chromium, classroom, ada):
    password = hub.shared_passwords(classroom)["instructors"]
    theirs, same = theft.steal(chromium, classroom, ada, password)
    assert any('"token":' in text and "stolen" in text for text in same), "what a page of the hub's own could do"
    assert theft.loot(theirs) == []


def test_up_and_status_say_what_keeps_servers_apart(classroom):
    said = run_classroom("status", "--folder", str(classroom.folder)).stdout
    assert "Each server has an address of its own, NAME.localhost: no page of a student's acts as who opens it." in said


def test_nobody_is_logged_in_at_a_students_address(classroom, ada):
    there = Visitor(ada.base.partition("user/")[0], "ada")
    assert not there.log_in(hub.shared_passwords(classroom)["students"])
    assert f"You come in at {classroom.url}" in there.answer.text


def test_a_server_runs_no_configuration_of_nbgraders_from_the_home_folder(ada, kernel):
    """Its assignment list asks for it in the server's folder, which is the one of the assignments, too."""
    live = kernel(ada)
    put = """
import os
for folder in ("/home/ada/notebooks", "/home/ada/.jupyter"):
    os.makedirs(folder, exist_ok=True)
    with open(f"{folder}/nbgrader_config.py", "w") as file:
        file.write("open('/home/ada/ran', 'w')")
"""
    assert live.run(put).error == ""
    try:
        for path in ("assignments?course_id=ros2", "courses"):
            answer = ada.call("GET", path)
            assert answer.ok and answer.json()["success"], answer.text
        assert live.run("import os; print(os.path.exists('/home/ada/ran'))").text == "False\n"
    finally:
        live.run("import os\nfor f in ('notebooks', '.jupyter'): os.remove(f'/home/ada/{f}/nbgrader_config.py')")


@pytest.mark.parametrize("certificate", ["", "/etc/ssl/class.pem"])
def test_a_cookie_is_of_one_host_alone_where_everything_is_encrypted(classroom, certificate, monkeypatch):
    """Browsers take the prefix `__Host-` over HTTPS only, and no page of another name can set such a cookie."""
    monkeypatch.setattr(BaseHandler, "get_current_user_cookie", BaseHandler.get_current_user_cookie)  # put back
    config = Config()
    addresses.keep_apart(config, replace(classroom, host="class.example.org", certificate=certificate))
    assert config.JupyterHub.cookie_host_prefix_enabled is bool(certificate)
    assert config.JupyterHub.subdomain_host.startswith("https://" if certificate else "http://")
