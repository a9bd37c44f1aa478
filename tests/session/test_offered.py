"""What a program's text can offer: names that are written out, and none other."""

import pytest

from course.session.offered import _has_none, other_names

SERVER = "class Server(Node):\n    def __init__(self):\n        self.create_service(Ask, {name}, self.ask)\n"


@pytest.mark.parametrize(("name", "found"), [("'/asks'", "/asks"), ("'asks'", "asks")])
def test_a_name_that_is_written_out_and_is_another_one(name, found):
    assert other_names(SERVER.format(name=name), "create_service", "/ask") == [(found, 3)]


@pytest.mark.parametrize("name", ["'/ask'", "'ask'", "'~/ask'", "NAME", "f'{space}/ask'", "'/a' + 'sk'"])
def test_a_name_that_may_be_the_wanted_one(name):
    assert other_names(SERVER.format(name=name), "create_service", "/ask") == []


@pytest.mark.parametrize("name", ["'ask'", "'~/ask'"])
def test_a_name_in_a_namespace(name):
    assert other_names(SERVER.format(name=name), "create_service", "/robot/ask") == []


def test_one_of_several_names_is_the_wanted_one():
    text = SERVER.format(name="'/asks'") + "        self.create_service(Ask, '/ask', self.ask)\n"
    assert other_names(text, "create_service", "/ask") == []


def test_a_program_that_makes_none_at_all(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "from agent import Agent\n\nclass Server(Node):\n    pass\n"
    assert _has_none(text, "create_service")
    assert not _has_none(text.replace("(Node)", "(Base)"), "create_service")  # its base may make one
    assert not _has_none("print('no class')", "create_service")
    (tmp_path / "agent.py").touch()  # it may make one for the node
    assert not _has_none(text, "create_service")
