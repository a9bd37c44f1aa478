"""The lines that coordinator and worker send each other."""

import pytest

from autograder.records import Ended, Finished, Job, Verdict, from_line, to_line

MESSAGES = [
    Job("services", {"services/suite.py": b""}, {"relay.py": b"\xff\0", "empty.py": b""}, 7, "root", "", 60.0, 1, 0.5),
    Job("services", {}, {}, 7, "root", "", 60.0, 1, 0.5, ["test_status"]),
    Verdict("test_a", "failed", "What\nthe student reads \ud800", "the instructor's"),
    Finished(1, "", {"relay.py": "printed"}),
    Ended(-9, "a line\nanother\n", "it took too much"),
]


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_a_line_says_which_record_it_is(message):
    line = to_line(message)
    assert line.endswith(b"\n") and line.count(b"\n") == 1
    assert from_line(line) == message


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"warning: printed by a library\n",
        b"5\n",
        b'{"status": 0}\n',
        b'{"record": "Mark"}\n',
        b'{"record": "Ended"}\n',
        b'{"record": "Ended", "status": 0, "score": 20}\n',
        b'{"record": "Job", "files": {"a": 5}}\n',
        (
            b'{"record": "Job", "exercise": "services", "hidden": {}, "files": {}, "seed": 7, "confinement": "root", '
            b'"interfaces": "", "limit": 60.0, "core": 1, "chosen": [5]}\n'
        ),
        b'{"record": "Verdict", "id": "test_a", "outcome": "passed", "message": ["not", "a", "text"]}\n',
        b'{"record": "Finished", "exit_status": 0, "fault": "", "logs": {"relay.py": 5}}\n',
        b'{"record": "Finished", "exit_status": 0, "fault": "", "logs": "printed"}\n',
    ],
)
def test_anything_else_is_refused(line):
    with pytest.raises(ValueError):
        from_line(line)
