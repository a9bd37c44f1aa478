"""The comparison of two checkouts by the benchmark of a mixed class."""

import importlib.util
import sys
from pathlib import Path

import pytest

BENCHMARK = Path(__file__).parents[1] / "benchmarks/mixed_class.py"


@pytest.fixture(scope="module")
def mixed_class():
    before = [*sys.path]
    spec = importlib.util.spec_from_file_location("mixed_class", BENCHMARK)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sys.path[:] = before
    return module


def result(student, status="graded", flags=(), **outcomes):
    tests = [{"id": test, "outcome": outcome} for test, outcome in outcomes.items()]
    return {"student": student, "status": status, "flags": [*flags], "tests": tests}


def test_each_verdict_that_differs_is_told(mixed_class):
    one = [result("ada", add="passed", divide="failed"), result("bob", add="passed"), result("eve", add="passed")]
    other = [
        result("bob", add="passed"),
        result("ada", add="passed", divide="timed_out", flags=["busy_machine"]),
        result("eve", status="infrastructure_error"),
    ]
    assert mixed_class.differences(one, one) == []
    assert mixed_class.differences(one, other) == [
        "ada: divide failed, timed_out (busy_machine)",
        "eve: graded, infrastructure_error; add passed, None",
    ]
    assert mixed_class.differences(one[:1], []) == ["ada: graded, missing; add passed, None; divide failed, None"]


def test_the_slowest_of_a_kind_stands_beside_the_median(mixed_class):
    assert mixed_class.ratio([10.0, 10.0, 45.0], 10.0) == "1.0 (max 4.5)"
    assert mixed_class.ratio([], 10.0) == "-"
