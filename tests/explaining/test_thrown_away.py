"""A value that a function computes and does not use is told, and nothing that has another purpose."""

import pytest

from course.explaining.slips import slips

CLASS = """from calculator_interfaces.srv import Calculate
class Some(Node):
    def __init__(self):
        self.stops = []
    def some(self, given, a, b):
        'A text about the method.'
        request = Calculate.Request()
        effort = 2 * given
        {line}
        print(a, b)
        return effort, 1.0, 'enabled'
    def last(self, given):
        'A text about the method.'
        {last}
"""
UNUSED = "nothing uses the value of `{0}`. To {1} it, write `{2}{0}`."
SENT = "\n        request.a = a\n        request.b = b"
KEEP, RETURN = ("keep", "name = "), ("return", "return ")


@pytest.mark.parametrize(
    ("line", "value", "how"),
    [
        ("max(-1.0, min(1.0, effort))", "max(-1.0, min(1.0, effort))", KEEP),
        ("given.age - effort <= 0.5", "given.age - effort <= 0.5", KEEP),
        ("if given: self.now() == 2", "self.now() == 2", RETURN),
        ("if given: 'stopped'", "'stopped'", RETURN),
        ("if given: 0.0", "0.0", RETURN),
        ("if given: {'linear': 0.0}", "{'linear': 0.0}", RETURN),
        ("for each in given: abs(each)", "abs(each)", KEEP),
        ("effort", "effort", KEEP),
        ("effort, given", "(effort, given)", KEEP),
        ("math.degrees(effort)", "math.degrees(effort)", KEEP),
        ("np.degrees(effort) % 360", "np.degrees(effort) % 360", KEEP),
        ("given.text.strip().lower()", "given.text.strip().lower()", KEEP),
        ("not effort", "not effort", KEEP),
        ("f'{effort} m'", "f'{effort} m'", KEEP),
        ("given - effort if given else 0", "given - effort if given else 0", KEEP),
        ("try: abs(given)\n        except KeyboardInterrupt: pass", "abs(given)", RETURN),
    ],
)
def test_a_value_that_nothing_uses_is_told(line, value, how):
    told = slips(CLASS.format(line=line, last="pass"))
    assert told == [f"note: line 9: {UNUSED.format(value, *how)}"]


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("self.sum + given", "`self.sum + given` changes nothing. To change `self.sum`, write `self.sum += given`."),
        (
            "effort - 2 * given",
            "`effort - 2 * given` changes nothing. To change `effort`, write `effort -= 2 * given`.",
        ),
        ("+ 2 * given", ""),
        ("+ f' of {given}'", ""),
        ("- given + effort", ""),
    ],
)
def test_a_line_without_an_equals_sign_or_brackets_is_told(line, told):
    own = "this line is a statement of its own. To continue the line above, put the whole expression in brackets."
    assert slips(CLASS.format(line=line, last="pass")) == [f"note: line 9: {told or own}"]


@pytest.mark.parametrize("value", ["self.get_clock().now() - given <= 0.5", "sum(given) / len(given)"])
def test_a_value_at_the_end_of_a_function_is_meant_to_be_returned(value):
    assert slips(CLASS.format(line="pass", last=value)) == [f"note: line 14: {UNUSED.format(value, *RETURN)}"]


def test_a_comparison_in_a_test_is_meant_to_be_asserted():
    assert slips("def test_it():\n    add(1, 2) == 3\n") == [
        f"note: line 2: {UNUSED.format('add(1, 2) == 3', 'check', 'assert ')}"
    ]


def test_a_long_value_is_cut():
    (told,) = slips(f"def some():\n    [{', '.join(['1.25'] * 40)}]\n")
    assert "..." in told and len(told) < 220


@pytest.mark.parametrize(
    "line",
    [
        "given",  # for a linter that knows no unused arguments
        "given.executor",
        "...",
        "None",
        "'One more text, as a comment.'",
        "'TODO'",
        "try: abs(given)\n        except TypeError: return None",
        "with suppress(TypeError): abs(given)",
        "with pytest.raises(TypeError): given < 'a'",
        "try: numpy\n        except NameError: pass",
        "float(given)",
        "float(a)",
        "given or print(effort)",
        "print(effort) if given else None",
        "[print(each) for each in given]",
        "self.check(given) and effort",
        "np.clip(given, 0, 1, out=given)",
        "max(given, key=self.count)",
        "given[0]",
        "{}",
        "max = print; max(given, effort)",
        "self.stops.append(effort)",
        "others = self.stops.copy()",
        "self.stops.sort()",
        "self.first = self.stops.pop()",
    ],
)
def test_a_line_with_another_purpose_is_not_told(line):
    assert slips(CLASS.format(line=line, last="pass")) == []


@pytest.mark.parametrize(
    ("line", "told"),
    [
        (
            "float(a), float(b)",
            "`float(a), float(b)` converts, and nothing keeps the result. Write `a, b = float(a), flo",
        ),
        ("float(a)", "`float(a)` converts, and nothing keeps the result. Write `a = float(a)`."),
        ("float(a), float(b); request.a = float(a)", ""),
        ("float(a), float(b); request.a, request.b = map(float, (a, b))", ""),
        ("float(a), float(b); a, b = 15.5, 3.2", ""),
        ("float(a), float(b), float(given)", ""),  # `given` is only looked at
    ],
)
def test_numbers_that_nothing_keeps_are_told(line, told):
    found = "".join(
        slips(CLASS.format(line=f"try:\n            {line}\n        except ValueError: return 2{SENT}", last="pass"))
    )
    assert told in found and bool(told) == bool(found), found


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("stops = self.stops; stops = stops.append(given)", "`stops` is None then. Write `stops.append(given)` alone."),
        ("self.stops = self.stops.sort()", "`self.stops` is None then. Write `self.stops.sort()` alone."),
        ("last = self.stops.append(given); print(last)", ""),
        ("given = given.sort().first()", ""),
    ],
)
def test_a_list_that_is_set_to_none_by_its_own_method_is_told(line, told):
    found = slips(CLASS.format(line=f"{line}; print(self.stops, 'stops')", last="pass"))
    assert len(found) == bool(told) and "".join(found).endswith(told), found
