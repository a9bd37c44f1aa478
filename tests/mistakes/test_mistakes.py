"""Every mistake of the collection tells its own story, in time; and the page made from it is up to date."""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from itertools import chain
from pathlib import Path

import pytest

from autograder.gradebook.leaks import ANSWER, secrets
from course.explaining.hints import hint
from course.foundation import cells
from tests.mistakes import INTERRUPT, SOLUTIONS, Mistake, collection
from tests.mistakes.page import CONTENTS, DOCS, pages
from tests.mistakes.run import Kernels

ALL = list(collection())
ERROR = re.compile(r"(?:[a-z_]\w*\.)*[A-Z]\w*(?:Error|Exception)\b.*$")
HINT = "Hint: "
OF_THE_KERNEL = {  # whose hint is made from what the kernel has: an interface that was built, the session, another file
    "actions/execute_raises_under_a_client",
    "actions/file_hides_a_module_of_python",
    "actions/import_from_another_module",
    "actions/recorder_misused",
    "actions/result_of_a_future_in_a_cell",
    "actions/wait_forgotten_in_a_cell",
    "ai_integration/agent_returns_nothing",
    "ai_integration/agent_without_brackets",
    "ai_integration/class_handed_over",
    "ai_integration/file_hides_numpy",
    "ai_integration/function_of_python_overwritten",
    "ai_integration/function_of_python_overwritten_in_a_file",
    "ai_integration/function_without_return",
    "ai_integration/topic_of_another_type",
    "ai_integration/misspelt_own_module",
    "ai_integration/ros_is_something_else",
    "calculator/else_if",
    "calculator/folder_hides_the_package",
    "calculator/misspelt_response_field",
    "calculator/type_instead_of_request",
    "calculator/wrong_import",
    "parameters/pre_set_returns_nothing",
    "services/before_the_session",
    "services/client_of_another_type_in_a_cell",
    "services/module_for_its_class",
    "services/result_too_early",
    "services/shell_line_without_its_mark",
    "services/type_in_quotes",
    "services/uses_a_node_that_has_ended",
}
ELSEWHERE = {  # whose message each run tests without a kernel, by the module that tests it
    "actions/accepted_goal_never_begins": "tests/explaining/test_source.py",
    "actions/accepted_goal_never_begins_in_the_notebook": "tests/explaining/test_source.py",
    "actions/action_of_another_type": "tests/notebook/test_public_checks.py",
    "actions/blocking_cancel_in_a_feedback_callback": "tests/explaining/test_endless_waits.py",
    "actions/cancel_callback_ends_the_goal": "tests/notebook/test_public_checks.py",
    "actions/cancel_callback_returns_true": "tests/explaining/test_source.py",
    "actions/client_blocks": "tests/explaining/test_endless_waits.py",
    "actions/client_loops": "tests/notebook/test_terminal.py",
    "actions/client_of_a_dead_server": "tests/notebook/test_terminal.py",
    "actions/client_prints_at_the_end": "tests/notebook/test_public_checks.py",
    "actions/client_raises": "tests/notebook/test_terminal.py",
    "actions/client_spins_for_ever": "tests/explaining/test_endless_waits.py",
    "actions/client_waits_for_another_future": "tests/explaining/test_endless_waits.py",
    "actions/empty_result_of_a_cancel": "tests/notebook/test_public_checks.py",
    "actions/execute_raises_under_a_client": "tests/notebook/test_terminal.py",
    "actions/execute_without_brackets": "tests/explaining/test_source.py",
    "actions/executor_without_a_node": "tests/explaining/test_source.py",
    "actions/exit_in_a_goal": "tests/session/test_doing.py",
    "actions/feedback_before_the_step": "tests/notebook/test_public_checks.py",
    "actions/file_hides_a_module_of_python": "tests/explaining/test_failure_report.py",
    "actions/goal_callback_raises": "tests/session/test_doing.py",
    "actions/goal_callback_returns_a_bool_in_the_notebook": "tests/session/test_starts.py",
    "actions/goal_callback_returns_nothing": "tests/explaining/test_failure_report.py",
    "actions/goal_callback_returns_true": "tests/explaining/test_failure_report.py",
    "actions/goal_ended_by_its_follower": "tests/explaining/test_hints.py",
    "actions/import_from_another_module": "tests/explaining/test_failure_report.py",
    "actions/lock_never_released": "tests/notebook/test_public_checks.py",
    "actions/lock_taken_twice": "tests/notebook/test_public_checks.py",
    "actions/loops_while_blocked": "tests/notebook/test_public_checks.py",
    "actions/main_without_brackets": "tests/notebook/test_command_line.py",
    "actions/number_for_a_list": "tests/ros2/test_topic.py",
    "actions/period_not_read": "tests/notebook/test_public_checks.py",
    "actions/recorder_misused": "tests/course/test_recorders.py",
    "actions/result_of_a_future_in_a_cell": "tests/explaining/test_failure_report.py",
    "actions/ros_wait_in_a_callback": "tests/explaining/test_source.py",
    "actions/server_of_another_name": "tests/session/test_offered.py",
    "actions/server_stopped_under_a_goal": "tests/course/test_recorders.py",
    "actions/spin_in_a_feedback_callback": "tests/explaining/test_endless_waits.py",
    "actions/spun_by_rclpy": "tests/notebook/test_judging.py",
    "actions/threads_as_text": "tests/session/test_session.py",
    "actions/two_goals_move_the_cabin": "tests/notebook/test_public_checks.py",
    "actions/wait_forgotten_in_a_cell": "tests/explaining/test_failure_report.py",
    "actions/waits_for_a_server_in_a_cell": "tests/session/test_matching.py",
    "actions/wrong_action_name": "tests/ros2/test_service.py",
    "ai_integration/agent_loops": "tests/notebook/test_judging.py",
    "ai_integration/agent_without_brackets": "tests/explaining/test_failure_report.py",
    "ai_integration/class_handed_over": "tests/explaining/test_failure_report.py",
    "ai_integration/comma_in_a_period": "tests/explaining/test_slips.py",
    "ai_integration/compared_with_nan": "tests/explaining/test_slips.py",
    "ai_integration/exit_in_a_callback": "tests/session/test_doing.py",
    "ai_integration/file_hides_numpy": "tests/explaining/test_failure_report.py",
    "ai_integration/function_of_python_overwritten": "tests/explaining/test_failure_report.py",
    "ai_integration/function_of_python_overwritten_in_a_file": "tests/explaining/test_failure_report.py",
    "ai_integration/function_without_return": "tests/explaining/test_failure_report.py",
    "ai_integration/imported_before": "tests/notebook/test_exercise.py",
    "ai_integration/int_of_the_agent": "tests/notebook/test_public_checks.py",
    "ai_integration/method_without_brackets": "tests/explaining/test_slips.py",
    "ai_integration/misspelt_own_module": "tests/explaining/test_failure_report.py",
    "ai_integration/nan_to_num": "tests/notebook/test_shown_by_text.py",
    "ai_integration/product_without_its_star": "tests/explaining/test_slips.py",
    "ai_integration/quality_of_service_in_a_cell": "tests/session/test_matching.py",
    "ai_integration/quality_of_service_in_the_check": "tests/session/test_matching.py",
    "ai_integration/rate_in_a_timer": "tests/notebook/test_judging.py",
    "ai_integration/ros_is_something_else": "tests/explaining/test_failure_report.py",
    "ai_integration/rules_in_another_order": "tests/notebook/test_public_checks.py",
    "ai_integration/scans_without_a_world": "tests/session/test_matching.py",
    "ai_integration/self_forgotten": "tests/explaining/test_failure_report.py",
    "ai_integration/sent_before_it_is_filled": "tests/explaining/test_slips.py",
    "ai_integration/time_of_the_first_scan": "tests/notebook/test_public_checks.py",
    "ai_integration/timer_forgotten": "tests/notebook/test_public_checks.py",
    "ai_integration/timer_in_a_callback": "tests/explaining/test_slips.py",
    "ai_integration/timer_in_hertz": "tests/notebook/test_public_checks.py",
    "ai_integration/topic_of_another_name": "tests/session/test_matching.py",
    "ai_integration/topic_of_another_type": "tests/session/test_matching.py",
    "ai_integration/topic_of_nearly_that_name": "tests/session/test_matching.py",
    "calculator/client_blocks": "tests/explaining/test_endless_waits.py",
    "calculator/client_never_spins": "tests/notebook/test_public_checks.py",
    "calculator/client_of_another_name": "tests/notebook/test_judging.py",
    "calculator/client_of_another_service": "tests/explaining/test_endless_waits.py",
    "calculator/client_spins_on_another_future": "tests/explaining/test_endless_waits.py",
    "calculator/client_without_no_start": "tests/notebook/test_exercise.py",
    "calculator/comment_above_an_interface": "tests/notebook/test_exercise.py",
    "calculator/default_in_the_srv": "tests/notebook/test_public_checks.py",
    "calculator/else_if": "tests/notebook/test_exercise.py",
    "calculator/every_exception_is_hidden": "tests/notebook/test_public_checks.py",
    "calculator/float32_in_the_srv": "tests/notebook/test_public_checks.py",
    "calculator/folder_hides_the_package": "tests/explaining/test_failure_report.py",
    "calculator/int_in_the_client": "tests/notebook/test_public_checks.py",
    "calculator/message_for_success": "tests/notebook/test_public_checks.py",
    "calculator/result_for_success": "tests/explaining/test_slips.py",
    "calculator/server_deleted": "tests/notebook/test_public_checks.py",
    "calculator/server_edited_and_not_run": "tests/notebook/test_public_checks.py",
    "calculator/service_never_created": "tests/session/test_matching.py",
    "calculator/srv_of_another_package": "tests/notebook/test_public_checks.py",
    "calculator/srv_refused": "tests/notebook/test_public_checks.py",
    "calculator/success_compared": "tests/explaining/test_slips.py",
    "calculator/thread_that_stays": "tests/explaining/test_endless_waits.py",
    "parameters/attribute_of_rclpys_name": "tests/explaining/test_failure_report.py",
    "parameters/callback_returns_true_in_a_file": "tests/explaining/test_source.py",
    "parameters/file_for_another_node": "tests/explaining/test_parameter_files.py",
    "parameters/float32_on_a_topic": "tests/notebook/test_public_checks.py",
    "parameters/int_default": "tests/ros2/test_param.py",
    "parameters/int_for_a_double": "tests/notebook/test_public_checks.py",
    "parameters/integral_in_milliseconds": "tests/notebook/test_public_checks.py",
    "parameters/message_hides_the_one_that_came": "tests/explaining/test_slips.py",
    "parameters/misspelt_in_a_callback": "tests/explaining/test_slips.py",
    "parameters/pre_set_returns_nothing": "tests/explaining/test_failure_report.py",
    "parameters/publishes_an_empty_message": "tests/explaining/test_slips.py",
    "parameters/range_of_a_descriptor": "tests/notebook/test_public_checks.py",
    "parameters/range_of_another_type": "tests/explaining/test_source.py",
    "parameters/set_in_a_callback": "tests/explaining/test_failure_report.py",
    "parameters/set_in_vain": "tests/explaining/test_source.py",
    "parameters/sleeps_for_each_message": "tests/notebook/test_judging.py",
    "parameters/wrong_node_name": "tests/ros2/test_param.py",
    "services/another_main": "tests/explaining/test_source.py",
    "services/another_server_in_a_terminal": "tests/session/test_outsiders.py",
    "services/another_type_on_a_command_line": "tests/ros2/test_service.py",
    "services/answer_before_it_is_filled": "tests/notebook/test_public_checks.py",
    "services/asks_itself": "tests/explaining/test_failure_report.py",
    "services/await_in_the_default_group": "tests/explaining/test_failure_report.py",
    "services/best_effort_service": "tests/session/test_matching.py",
    "services/blank_in_exercise": "tests/notebook/test_exercise.py",
    "services/blocking_call": "tests/explaining/test_failure_report.py",
    "services/callback_loops": "tests/session/test_doing.py",
    "services/callback_sleeps": "tests/session/test_doing.py",
    "services/callers_wait_in_turn": "tests/notebook/test_public_checks.py",
    "services/class_left_from_the_stub": "tests/explaining/test_slips.py",
    "services/client_of_another_type_in_a_cell": "tests/session/test_starts.py",
    "services/constructor_that_never_returns": "tests/session/test_starts.py",
    "services/docstring_not_closed": "tests/explaining/test_refused_lines.py",
    "services/domain_changed_in_a_cell": "tests/session/test_matching.py",
    "services/file_of_another_name": "tests/notebook/test_judging.py",
    "services/first_line_of_a_file_deleted": "tests/explaining/test_source.py",
    "services/impossible_domain": "tests/session/test_matching.py",
    "services/init_with_one_underscore": "tests/explaining/test_failure_report.py",
    "services/log_of_another_name": "tests/session/test_session.py",
    "services/loop_at_module_level": "tests/session/test_doing.py",
    "services/loop_before_the_node": "tests/session/test_doing.py",
    "services/module_for_its_class": "tests/explaining/test_failure_report.py",
    "services/node_of_the_session_destroyed": "tests/session/test_starts.py",
    "services/request_for_its_field": "tests/explaining/test_slips.py",
    "services/server_looked_for_by_a_timer": "tests/notebook/test_shown_by_text.py",
    "services/shell_line_without_its_mark": "tests/notebook/test_exercise.py",
    "services/spin_until_in_a_callback": "tests/explaining/test_failure_report.py",
    "services/stop_that_is_not_on": "tests/notebook/test_public_checks.py",
    "services/text_that_no_line_has": "tests/session/test_session.py",
    "services/two_files_of_one_name": "tests/session/test_outsiders.py",
    "services/two_nodes_of_a_class_with_one_name": "tests/session/test_starts.py",
    "services/uses_a_node_that_has_ended": "tests/session/test_starts.py",
    "services/waits_for_a_service_in_a_callback": "tests/explaining/test_failure_report.py",
    "services/waits_in_a_loop": "tests/explaining/test_failure_report.py",
    "services/waits_in_a_loop_of_a_cell": "tests/explaining/test_cell_loops.py",
    "services/words_of_another_language": "tests/explaining/test_refused_lines.py",
    "services/wrong_name": "tests/session/test_matching.py",
    "services/wrong_type": "tests/session/test_matching.py",
}
LONG = {  # which take longest: each run looks for their sentences where the course writes them
    "actions/cancel_rejected",
    "actions/client_exit_status",
    "actions/one_thread",
    "actions/server_raises_under_the_clients_check",
    "actions/state_never_set",
    "ai_integration/agent_returns_nothing",
    "ai_integration/loop_in_the_constructor",
    "ai_integration/safety_stop_of_its_own",
    "calculator/client_decides_itself",
    "calculator/one_line_for_both",
    "calculator/refusal_is_kept",
    "calculator/server_wrong_under_the_client",
    "parameters/attribute_hides_the_callback",
    "parameters/callback_returns_a_bool",
    "parameters/callback_returns_nothing",
    "parameters/efforts_by_a_timer",
    "parameters/first_error_has_a_slope",
    "parameters/integral_stops_at_the_limits",
    "parameters/ki_of_0_does_not_count",
    "parameters/last_error_is_never_kept",
    "parameters/limits_are_compared_with_the_defaults",
    "parameters/one_descriptor_for_all",
    "parameters/sleeps_in_a_callback",
    "parameters/the_same_effort_is_left_out",
    "services/another_folder",
    "services/call_that_nobody_serves",
    "services/callback_loops_under_ros2",
    "services/destroys_its_node",
    "services/gone_is_never_noticed",
    "services/loop_keeps_the_node_from_being_spun",
    "services/parameter_for_its_value",
    "services/relay_never_succeeds",
    "services/self_left_out_in_a_callback",
    "services/service_in_the_default_group",
    "services/shuts_down_in_a_callback",
}
SENTENCE = 40  # letters at least of a sentence that the course writes
LIVE = 2  # mistakes of each exercise at least that are made in each run


def known_hint(mistake: Mistake) -> tuple[str, str, str, str] | None:
    """Return a hint that follows from what is shown above it: error, file, the reader's line, hint; None if none does.

    An error that the collection shortens (`...`) is not enough for that.
    """
    shown = [line for step in mistake.steps for line in step.shown]
    at = next((number for number, line in enumerate(shown) if line.startswith(HINT)), 0)
    errors = [found[0] for line in shown[:at] if (found := ERROR.search(line.removeprefix("NodeFailed: ")))]
    if not errors or "..." in errors[0]:
        return None
    first = mistake.steps[0]
    source = first.cell.partition("\n")[2] if first.file else first.cell
    lines = [line.strip() for line in shown[:at] if line.startswith("    ")]
    return errors[0], source, lines[-1] if lines else "", shown[at].removeprefix(HINT)


def name_of(mistake: Mistake) -> str:
    return f"{mistake.exercise}/{mistake.name}"


HINTED = [mistake for mistake in ALL if known_hint(mistake) and name_of(mistake) not in OF_THE_KERNEL]


@pytest.fixture(scope="module")
def kernels(tmp_path_factory):
    with Kernels(tmp_path_factory.mktemp("mistakes")) as made:
        yield made


def faults(kernels: Kernels, mistake: Mistake) -> tuple[list[str], list[str]]:
    """Run a mistake; return what is not shown, and what takes longer than it may."""
    missing, late = [], []
    for shown in kernels.run(mistake):
        cell = shown.step.cell[:300]
        if shown.missing:
            missing.append(f"{shown.missing!r} is not shown in order by:\n{cell}\nbut:\n{shown.text}")
        if shown.seconds >= shown.step.limit or shown.stayed >= INTERRUPT:
            late.append(f"{shown.seconds:.1f} s, and {shown.stayed:.1f} s after the interruption:\n{cell}")
    return missing, late


@pytest.mark.parametrize("mistake", HINTED, ids=name_of)
def test_a_hint_follows_from_its_error(mistake):
    error, source, line, wanted = known_hint(mistake)
    given = hint(error, source, line)
    assert re.fullmatch(".*".join(map(re.escape, wanted.split("..."))), given), given


def texts() -> Iterator[tuple[str, ...]]:
    """Yield each line of text that the course or a public check may print, as its parts between what it fills in."""
    root = SOLUTIONS.parent
    modules = (path.read_text(encoding="utf-8") for path in (root / "course").rglob("*.py"))
    notebooks = map(cells.read, root.glob("notebooks/*/*.ipynb"))
    checks = (cell.source for notebook in notebooks for cell in notebook if cell.public_check)
    for source in chain(modules, checks):
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.JoinedStr):
                whole = "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                whole = node.value
            else:
                continue
            for line in whole.splitlines():
                yield tuple(re.split(r"\{[^{}]*\}", line))


@cache
def sentences() -> list[re.Pattern[str]]:
    return [
        re.compile(".*".join(map(re.escape, parts)))
        for parts in {*texts()}
        if sum(len(part.strip()) for part in parts) >= SENTENCE
    ]


@pytest.mark.parametrize("mistake", [each for each in ALL if name_of(each) in LONG], ids=name_of)
def test_the_course_writes_the_sentence_of_a_mistake_that_takes_long(mistake):
    shown = [line for step in mistake.steps for line in step.shown]
    assert [line for line in shown if any(each.search(line) for each in sentences())], shown


NIGHTLY = {*map(name_of, HINTED), *ELSEWHERE, *LONG}  # each run tests what they show without a kernel
MADE = [pytest.param(each, marks=[pytest.mark.matrix] * (name_of(each) in NIGHTLY)) for each in ALL]


@pytest.mark.parametrize("mistake", MADE, ids=name_of)
def test_a_mistake_tells_its_own_story(kernels, mistake):
    """The words must be there at once; only their time is measured again, on a machine that may have been busy."""
    missing, late = faults(kernels, mistake)
    assert missing == [], "\n".join(missing)
    if late:
        assert faults(kernels, mistake) == ([], [])


def test_what_is_left_to_the_night_is_tested_elsewhere():
    root = SOLUTIONS.parent
    assert {*ELSEWHERE} <= {name_of(mistake) for mistake in ALL}
    assert [module for module in ELSEWHERE.values() if not (root / module).is_file()] == []
    made = Counter(mistake.exercise for mistake in ALL if name_of(mistake) not in NIGHTLY)
    assert {exercise for exercise, count in made.items() if count >= LIVE} == {mistake.exercise for mistake in ALL}


def test_there_are_mistakes_of_every_exercise():
    counts = {exercise.name: 0 for exercise in SOLUTIONS.iterdir() if exercise.is_dir()}
    for mistake in ALL:
        counts[mistake.exercise] += 1
        assert any(step.shown for step in mistake.steps), mistake.name
        assert mistake.title and mistake.text
    assert len(ALL) >= 40 and min(counts.values()) >= 5, counts


def test_the_pages_are_made_from_the_collection():
    stored = {path.relative_to(DOCS): path.read_text(encoding="utf-8") for path in DOCS.glob("when-it-goes-wrong/*")}
    stored[Path(CONTENTS)] = (DOCS / CONTENTS).read_text(encoding="utf-8")
    assert stored == pages(), "run: python -m tests.mistakes.page"


def test_the_list_leads_to_every_mistake_by_its_words():
    text = pages()[Path(CONTENTS)]
    assert text.count("\n- [") == len(ALL)
    assert all(f"\n- [{mistake.title}](when-it-goes-wrong/{mistake.exercise}.md#" in text for mistake in ALL)


def test_the_page_gives_no_answer_away(tmp_path):
    """Students get it: of an exercise's solution it may show a line that a message quotes, and never two in a row."""
    text = " ".join(" ".join(pages().values()).split()).lower()
    for name in sorted(path.name for path in SOLUTIONS.iterdir() if path.is_dir()):
        kept = secrets(name, SOLUTIONS.parent / "notebooks" / name / f"{name}.ipynb")
        shown = [line for line, what in kept.items() if what == ANSWER and line.lower() in text]
        assert len(shown) <= 3, shown
        assert not [line for line, what in kept.items() if what != ANSWER and line.lower() in text]
