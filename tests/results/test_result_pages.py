"""Pages for students, with one cause that cost several tests, and for instructors, with each student."""

import io
from dataclasses import replace
from html.parser import HTMLParser
from urllib.parse import unquote

from rich.console import Console

from autograder import cli
from autograder.records import CRASHED, FAULT, GRADED, PASSED, Report, Result
from autograder.results import feedback, output, progress, summary
from autograder.submissions import exercises
from course.returned import record

DIED = "motor_service.py died while it answered a request: ZeroDivisionError."


def report(student: str, messages: dict[int, str]) -> Report:
    """A report on `services` with these messages, by the test's number."""
    tests = exercises.load("services").tests
    results = [
        Result(test.id, test.title, *((CRASHED, 0) if number in messages else (PASSED, test.points)), test.points)
        for number, test in enumerate(tests)
    ]
    told = [Result(**vars(result) | {"message": messages.get(number, "")}) for number, result in enumerate(results)]
    score = sum(result.points for result in told)
    return Report(student, "services", GRADED, score, sum(test.points for test in tests), 7, 2.0, [], told)


def test_one_cause_is_said_once_with_the_tests_that_it_cost():
    found = report("ada", {0: DIED, 3: DIED, 5: "Another <b>cause</b>."})
    page = feedback.page(found).partition("<body>")[2]  # without the data for `course feedback`
    assert page.count("ZeroDivisionError") == 1 and "<b>" not in page
    lost = {number: found.tests[number] for number in (0, 3)}
    cost = sum(test.max_points for test in lost.values())
    assert f"Cost {cost:g} points: {'; '.join(test.title for test in lost.values())}" in page
    rows = page.split("<table>")[1].split("<tr>")[2:]
    assert [number for number, row in enumerate(rows) if "crashed (1)" in row] == [0, 3]
    assert [number for number, row in enumerate(rows) if "crashed (2)" in row] == [5]


def test_no_character_that_hides_or_reverses_text_is_in_the_page():
    """Neither in what is seen, nor in the data for `course feedback`."""
    evil = "RuntimeError: \u202e\u2028\u2029\u2066\u200b\ufeff\x1b[2J\ud800"
    page = feedback.page(report("ada", {0: evil}))
    assert not {*"\u202e\u2028\u2029\u2066\u200b\ufeff\x1b\ud800"} & {*page}
    assert record.read(page.encode()).tests[0].message.startswith("RuntimeError: ")


FORGED = "grace/services: 20 of 20, 9.0 s (seed 1)\n  - 0/5  copied from ada [failed]\n\nrelay.py printed:"


def test_no_line_of_a_program_looks_like_one_of_the_report(tmp_path, monkeypatch, capsys):
    found = replace(report("eve", {0: f"The answer was: {FORGED}"}), logs={"motor_service.py": FORGED})
    details = {found.tests[0].id: f"said\n{FORGED}", FAULT: FORGED}
    monkeypatch.setattr(output, "read_with_details", lambda *_: [(found, details)])
    cli.show(tmp_path, "eve")
    own = [line for line in capsys.readouterr().out.splitlines() if not line.startswith(("         ", "  | "))]
    tests = [f"  {'-' if test.message else '+'} " for test in found.tests]
    assert [line[:4] for line in own if line.startswith("  ")] == tests
    assert [line.partition(" ")[0] for line in own if not line.startswith("  ")] == [
        "eve/services:",
        "",
        "motor_service.py",
    ]


class Links(HTMLParser):
    """The links of a page."""

    def __init__(self, page: str):
        super().__init__()
        self.found: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        if tag == "a":
            self.found.append(unquote(dict(attributes)["href"]))


def test_each_student_has_a_line_with_a_link_to_their_page(tmp_path):
    out = tmp_path / "out"
    students = ["ada", "Übung & <3>"]
    for student in students:
        (out / "feedback" / student).mkdir(parents=True)
        (out / "feedback" / student / "services.html").write_text(feedback.page(report(student, {})))
    for target in (out / "report.html", tmp_path / "report of the class.html"):
        summary.write([report(student, {}) for student in students], target, out)
        links = Links(target.read_text()).found
        assert len(links) == len(students)
        assert all((target.parent / link).is_file() for link in links)


def test_the_summary_in_a_terminal_obeys_no_name():
    """Neither the terminal's escapes nor rich's own markup, which would end the command."""
    evil = "\x1b]52;c;cm0=\x07\x1b[2J\u202e\r[/][link=x]"
    refused = Report(evil, "services", "invalid_submission", 0, 20, 1, 0, [], [Result("", "", "not_run", 0, 20, evil)])
    text = io.StringIO()
    summary.show([refused], Console(file=text, force_terminal=True, width=200))
    assert "\\x1b]52;c;cm0=\\x07" in text.getvalue()
    assert "[/][link=x]" in text.getvalue()
    assert not {"\x07", "\u202e", "\r"} & set(text.getvalue())


def test_a_name_makes_no_line_of_progress_of_its_own(capsys):
    report = Report("eve\n[1/1] ada/services: 0 of 20", "services", "graded", 20, 20, 1, 0, [], [])
    with progress.shown(1) as advance:
        advance(report)
    assert capsys.readouterr().out == "[1/1] eve\\x0a[1/1] ada/services: 0 of 20/services: 20 of 20, 0.0 s\n"
