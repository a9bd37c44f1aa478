"""Remarks on a client's command line and exit status, from its text."""

import pytest

from course.notebook.command_line import kept_name, lost_status, printed_status, return_in_finally, zero_is_false
from course.notebook.judging import why_silent
from tests.mistakes import SOLUTIONS

CLIENTS = [SOLUTIONS / "calculator" / "calculator_client.py", SOLUTIONS / "actions" / "lift_client.py"]


@pytest.mark.parametrize("client", CLIENTS, ids=lambda path: path.stem)
def test_of_a_right_client_nothing_is_said(monkeypatch, client):
    monkeypatch.chdir(client.parent)
    assert lost_status(client.name, 0) == kept_name(client.name) == ""


@pytest.mark.parametrize(
    ("main", "end", "says"),
    [
        ("return 1", "main()", "\n  client.py, line 4\n    main()\nThis drops what main() returns"),
        ("return 1", "sys.exit(main())", ""),
        ("return 1", "status = main()", ""),
        ("return", "main()", ""),
        ("raise SystemExit(1)", "main()", ""),
        (
            "return",
            "sys.exit(main())",
            "\n  client.py, line 1\n    def main():\nmain() returns nothing, so `sys.exit(main())`",
        ),
        ("return sys.exit(1)", "sys.exit(main())", ""),
        ("return 256", "sys.exit(main())", "\n  client.py, line 2\n    return 256\nAn exit status is a number from 0"),
        (
            "return False",
            "sys.exit(main())",
            "\n  client.py, line 2\n    return False\nWhat main() returns is the exit",
        ),
        ("ok = lambda: False; return 1", "sys.exit(main())", ""),
        ("sys.exit(512)", "main()", "\n  client.py, line 2\n    sys.exit(512)\nAn exit status"),
    ],
)
def test_a_status_that_is_lost(tmp_path, monkeypatch, main, end, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "client.py").write_text(f"def main():\n    {main}\n\n{end}\n")
    assert lost_status("client.py", 0).startswith(says) and bool(lost_status("client.py", 0)) == bool(says)


@pytest.mark.parametrize(
    ("main", "end", "output", "says"),
    [
        ("return response.result", "sys.exit(main())", "18.7\n", True),
        ("return outcome", "raise SystemExit(main())", "SUCCEEDED\n", True),
        ("return outcome", "sys.exit(main())", "Traceback (most recent call last):\n", False),
        ("return 0 if outcome else 1", "sys.exit(main())", "", False),
        ("return outcome", "main()", "", False),
        ("status = 0 if outcome == 'SUCCESS' else 1; return status", "sys.exit(main())", "SUCCEEDED\n", False),
        ("status = outcome.name; return status", "sys.exit(main())", "SUCCEEDED\n", True),
        ("return outcome == 'SUCCEEDED'", "sys.exit(main())", "SUCCEEDED\n", True),
        ("return True", "sys.exit(main())", "SUCCEEDED\n", True),
        ("return 'done'", "sys.exit(main())", "SUCCEEDED\ndone\n", True),
        ("return True if outcome else False", "sys.exit(main())", "SUCCEEDED\n", False),
        ("return outcome != 'SUCCEEDED'", "sys.exit(main())", "ABORTED\n", False),
    ],
)
def test_a_result_in_place_of_the_status(tmp_path, monkeypatch, main, end, output, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "client.py").write_text(f"def main():\n    {main}\n\n{end}\n")
    told = printed_status("client.py", output, 1)
    assert told.startswith(f"\n  client.py, line 2\n    {main}\nWhat main() returns is the exit status") == says
    assert bool(told) == says and printed_status("client.py", output or "SUCCEEDED\n", 0) == ""


WORDS = "WORDS = {4: 'SUCCEEDED', 5: 'CANCELED'}\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (f"{WORDS}status = 0 if outcome == 'succeeded' else 1", True),
        (f"{WORDS}if 'Succeeded' != self.outcome: status = 1", True),
        (f"{WORDS}status = 0 if outcome == 'SUCCEEDED' else 1", False),
        (f"{WORDS}status = 0 if outcome == 'succeeded' else 1\nprint(outcome.upper())", False),
        (f"{WORDS}outcome = 'succeeded'\nstatus = 0 if outcome == 'succeeded' else 1", False),
        ("status = 0 if goal.wait_end() == 'succeeded' else 1\nprint('SUCCEEDED')", False),
        ("status = 0 if outcome == 'succeeded' else 1", False),
    ],
)
def test_a_word_in_other_letters_is_told(tmp_path, monkeypatch, text, told):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "client.py").write_text(f"{text}\n")
    said = printed_status("client.py", "Feedback: floor 1\nOutcome: SUCCEEDED\n", 1)
    assert said.endswith("and the word is 'SUCCEEDED': capital and small letters differ.") == told == bool(said)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("if self.cancel_after and self.count >= self.cancel_after: cancel()", "self.cancel_after"),
        ("if not cancel_after: return", "cancel_after"),
        ("least = given.cancel_after or 1000", "given.cancel_after"),
        ("if self.cancel_after is not None and self.count >= self.cancel_after: cancel()", ""),
        ("if given.cancel_after == 0: cancel()\nif given.cancel_after: later()", ""),
        ("if self.count >= self.cancel_after: cancel()", ""),
        ("if self.cancelled: return", ""),
        ("parser.add_argument('--cancel-after', default=-1)\nif given.cancel_after: later()", ""),
    ],
)
def test_a_number_whose_0_counts_as_false_is_told(tmp_path, monkeypatch, text, told):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "client.py").write_text(f"{text}\n")
    said = zero_is_false("client.py", "cancel_after")
    assert bool(said) == bool(told) and (not told or f"0 counts as false, as None does: `{told} is not None`" in said)


@pytest.mark.parametrize(
    ("end", "says"),
    [
        ("main", "\nclient.py printed nothing.\n  client.py, line 4\n    main\n`main` names the function and does not"),
        (
            "sys.exit(main)",
            "\nclient.py printed nothing.\n  client.py, line 4\n    sys.exit(main)\n`sys.exit(main)` names the",
        ),
        ("", "\nclient.py printed nothing. main() is defined, but never called"),
        ("threading.Thread(target=main).start()", "\nclient.py printed nothing."),
        ("main()", "\nclient.py printed nothing."),
    ],
)
def test_a_client_that_prints_nothing_is_told_with_its_last_line(tmp_path, monkeypatch, end, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "client.py").write_text(f"def main():\n    return 0\n\n{end}\n")
    assert printed_status("client.py", "", 0).startswith(says)


@pytest.mark.parametrize(
    ("text", "kept"),
    [
        ("a, b, word = remove_ros_args(args)", True),
        ("words = remove_ros_args(args)\nif len(words) != 3: usage()\na = words[0]", True),
        ("parser.parse_args(remove_ros_args(args))", True),
        ("_, a, b, word = remove_ros_args(args)", False),
        ("a, b, word = remove_ros_args(args)[1:]", False),
        ("_, *words = remove_ros_args(args)", False),
        ("words = remove_ros_args(args)\nword = words[3]", False),
        ("words = remove_ros_args(args)\nwords.pop(0)", False),
        ("words = remove_ros_args(args)\ndel words[0]", False),
        ("a, b, word = remove_ros_args(sys.argv[1:])", False),
        ("a, b, word = sys.argv", True),
        ("a, b, word = sys.argv[0], sys.argv[1], sys.argv[2]", True),
        ("a, b, word = sys.argv[1], sys.argv[2], sys.argv[3]", False),
        ("_, a, b, word = sys.argv", False),
        ("name = sys.argv[0]\na, b, word = read(name)", False),
        ("words = sys.argv\na, b, word = words[1:]", False),
        ("words = remove_ros_args(args)[1:]\nif len(words) != 4: usage()", True),
        ("words = remove_ros_args(args)[1:]\nif len(words) != 3: usage()", False),
        ("words = remove_ros_args(args)\nif len(words) != 4: usage()\na, b, word = words[1:]", False),
        ("words = sys.argv\nif len(words) != 4: usage()\nwords = words[1:]", False),
    ],
)
def test_a_program_name_that_nothing_takes_off(tmp_path, monkeypatch, text, kept):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "client.py").write_text(text)
    assert bool(kept_name("client.py")) == kept


def test_true_among_other_statuses_is_told(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "def main():\n    if usage:\n        return 2\n    return True\n\nsys.exit(main())\n"
    (tmp_path / "client.py").write_text(text)
    said = printed_status("client.py", "18.7\n", 1)
    assert said.startswith("\n  client.py, line 4\n    return True\n") and "True is the status 1" in said


def test_the_success_of_a_response_as_a_status_is_told_as_true(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "def main():\n    if usage:\n        return 2\n    return response.success\n\nsys.exit(main())\n"
    (tmp_path / "client.py").write_text(text)
    said = printed_status("client.py", "18.7\n", 1)
    assert "    return response.success\n" in said and "True is the status 1" in said and "prints anything" not in said


@pytest.mark.parametrize(
    ("last", "below", "told"),
    [("return 0", "print(answer)", True), ("return 0", "", False), ("node.destroy_node()", "return 0", False)],
)
def test_a_return_in_a_finally_is_told_when_something_stands_below_it(tmp_path, monkeypatch, last, below, told):
    monkeypatch.chdir(tmp_path)
    body = f"    try:\n        answer = ask()\n    finally:\n        {last}\n" + (f"    {below}\n" if below else "")
    (tmp_path / "client.py").write_text(f"def main():\n{body}\nsys.exit(main())\n")
    says = "\n  client.py, line 5\n    return 0\nThis `return` is in `finally`"
    assert return_in_finally("client.py").startswith(says) == told == bool(return_in_finally("client.py"))
    assert (says in printed_status("client.py", "", 0)) == (says in why_silent("client.py")) == told


@pytest.mark.parametrize(
    ("ends", "status", "told"), [("return", 0, True), ("return 2", 0, False), ("return", 1, False), ("pass", 0, False)]
)
def test_a_return_without_a_status_is_told_where_a_word_is_no_number(tmp_path, monkeypatch, ends, status, told):
    monkeypatch.chdir(tmp_path)
    text = "def main():\n    try:\n        a = float(word)\n    except ValueError:\n        print(USAGE)\n        {}\n"
    (tmp_path / "client.py").write_text(f"{text.format(ends)}    return 1\n\nsys.exit(main())\n")
    says = "\n  client.py, line 6\n    return\nThis returns None, which is the status 0"
    assert lost_status("client.py", status).startswith(says) == told == bool(lost_status("client.py", status))


@pytest.mark.parametrize(
    ("before", "told"),
    [("", True), ("self.client.wait_for_service(timeout_sec=5.0)", False), ("time.sleep(1.0)", False)],
)
def test_a_client_that_looks_for_no_server_is_told(tmp_path, monkeypatch, before, told):
    monkeypatch.chdir(tmp_path)
    text = f"{before}\nfuture = self.client.call_async(request)\nrclpy.spin_until_future_complete(self, future)\n"
    (tmp_path / "client.py").write_text(text)
    assert ("wait with `self.client.wait_for_service(timeout_sec=...)`" in why_silent("client.py")) == told
