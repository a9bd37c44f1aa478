"""A student's server is the student's: a page of it gets nothing from the instructor who opens it."""

import sys
from dataclasses import replace

import pytest
from jupyterhub.handlers.base import BaseHandler
from traitlets.config import Config

from autograder.classroom import addresses, hub
from tests.classroom import theft
from tests.classroom.conftest import run_classroom
from tests.classroom.visitor import Visitor

RAN = "def ran(what):\n    with open('/home/ada/ran', 'a') as file:\n        file.write(what + chr(10))\n"
ENABLED = '{"ServerApp": {"jpserver_extensions": {"planted": true}}}'
SITE = f".local/lib/python{sys.version_info[0]}.{sys.version_info[1]}/site-packages"  # of the user


@pytest.mark.long("the first test of the class: everybody's server starts")
def test_a_students_page_gets_nothing_of_an_instructor(chromium, classroom, ada):
    password = hub.shared_passwords(classroom)["instructors"]
    theirs, same = theft.steal(chromium, classroom, ada, password)
    assert any('"token":' in text and "stolen" in text for text in same), "what a page of the hub's own could do"
    assert theft.loot(theirs) == []


def test_up_and_status_say_what_keeps_servers_apart(classroom):
    said = run_classroom("status", "--folder", str(classroom.folder)).stdout
    assert "Each server has its own address, NAME.localhost, so a student's page cannot act as the person" in said


def test_nobody_is_logged_in_at_a_students_address(classroom, ada):
    there = Visitor(ada.base.partition("user/")[0], "ada")
    assert not there.log_in(hub.shared_passwords(classroom)["students"])
    assert f"Log in at {classroom.url}" in there.answer.text


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


PLANTED = {
    **{
        f".jupyter/{name}_config.py": "ran(__file__)"
        for name in ("jupyter", "jupyter_server", "jupyter_lab", "jupyter_notebook", "jupyter_singleuser", "nbgrader")
    },
    ".jupyter/jupyter_server_config.json": ENABLED,
    ".jupyter/jupyter_server_config.d/planted.json": ENABLED,
    ".local/etc/jupyter/jupyter_server_config.d/planted.json": ENABLED,
    "jupyter_server_config.py": "ran(__file__)",
    "jupyter_config.py": "ran(__file__)",
    "nbgrader_config.py": "ran(__file__)",
    "planted.py": "ran(__file__)",
    **{
        f"{SITE}/{name}.py": "ran(__file__)"
        for name in ("planted", "usercustomize", "sitecustomize", "jupyter_server_config", "jupyterlab_git")
    },
    f"{SITE}/planted.pth": "import planted",
}


def test_a_server_runs_none_of_the_configuration_in_a_home(classroom, ada, kernel):
    """Jupyter's own, that of its extensions, and Python's: all is there before the server starts."""
    home = classroom.home(classroom.find("ada"))
    files = {name: RAN + text if name.endswith(".py") else text for name, text in PLANTED.items()}
    plant = f"""
import os
for name, text in {files!r}.items():
    path = os.path.join("/home/ada", name)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "x") as file:
        file.write(text)
"""
    assert kernel(ada).run(plant).error == ""
    try:
        ada.stop()
        ada.start()
        for path in ("lab", "tree", "assignments?course_id=ros2", "courses", "api/contents", "api/terminals"):
            assert ada.call("GET", path).ok
        assert not (home / "ran").exists(), (home / "ran").read_text()
        # They are where Jupyter looks: a server that is the student's own runs them.
        own = (
            "import subprocess, sys\nsubprocess.run([sys.executable, '-m', 'jupyter_server', 'list'], cwd='/home/ada')"
        )
        kernel(ada).run(own)
        assert "jupyter_config.py" in (home / "ran").read_text()
    finally:
        for name in [*PLANTED, "ran"]:
            (home / name).unlink(missing_ok=True)


@pytest.mark.parametrize("certificate", ["", "/etc/ssl/class.pem"])
def test_a_cookie_is_of_one_host_alone_where_everything_is_encrypted(classroom, certificate, monkeypatch):
    """Browsers take the prefix `__Host-` over HTTPS only, and no page of another name can set such a cookie."""
    monkeypatch.setattr(BaseHandler, "get_current_user_cookie", BaseHandler.get_current_user_cookie)  # put back
    config = Config()
    addresses.keep_apart(config, replace(classroom, host="class.example.org", certificate=certificate))
    assert config.JupyterHub.cookie_host_prefix_enabled is bool(certificate)
    assert config.JupyterHub.subdomain_host.startswith("https://" if certificate else "http://")
