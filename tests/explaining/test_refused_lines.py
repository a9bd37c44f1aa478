"""Lines that Python refuses, and the line that is meant."""

import pytest

from course.explaining.refused_lines import decimal_comma, refused, unquoted_command

MOTORS = """class Motors(Node):
    def __init__(self):
        self.on = False

{enable}(self, request, response):
{body}return response

    async def status(self, request, response):
        return response
"""


def said_of(text):
    """The hint on a text that Python refuses."""
    with pytest.raises(SyntaxError) as raised:
        compile(text, "a.py", "exec")
    return refused(text, raised.value)


@pytest.mark.parametrize(
    ("enable", "body", "told"),
    [
        ("def enable", " " * 8, "Indent it like them."),
        ("async def enable", " " * 8, "Line 8 is right, line 5 is not: `async def enable(self, request, response):`"),
        ("def enable", " " * 4, ""),  # Python refuses line 8 for another reason
        ("    def enable", " " * 10, ""),
        ("     def enable", " " * 8, ""),  # Python names the line itself
    ],
)
def test_a_def_that_has_ended_the_class_is_named(enable, body, told):
    text = MOTORS.format(enable=enable, body=body)
    try:
        compile(text, "motors.py", "exec")
    except SyntaxError as error:
        said = refused(text, error)
    else:
        said = ""
    assert told in said and bool(said) == bool(told)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("if a:\n    pass\nelse if b:\n    pass\n", "In Python, `else if` is one word: `elif`."),
        ("def f():\n        a = 1\n    b = 2\n", ""),
        ("class A:\n    def f(self):\n        pass\ndef g():\n        a = 1\n    def h():\n        pass\n", ""),
    ],
)
def test_only_what_is_certain_is_told_of_a_line_that_python_refuses(text, told):
    said = said_of(text)
    assert told in said and bool(said) == bool(told)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("if a && not b: pass", "In Python, `&&` is `and`."),
        ("if a || b: pass", "In Python, `||` is `or`."),
        ("if a and !self.stopped: pass", "In Python, `!` is `not`."),
        ("response.success = !(a and b)", "In Python, `!` is `not`."),
        ("if !a && !b: pass", "In Python, `&&` is `and`, and `!` is `not`."),
        ("self.floor++", "In Python, `x++` is `x += 1`."),
        ("floors[0]--;", "In Python, `x--` is `x -= 1`."),
        ("all(0 =< floor <= top for floor in floors)", "In Python, `=<` is `<=`."),
        ("if floor => top: pass", "In Python, `=>` is `>=`."),
        ("cmd = new Twist()", "In Python, an object is made without `new`."),
        ("elseif request.data: pass", "In Python, `elseif` is `elif`."),
        ("print('a && b', c || d", "In Python, `||` is `or`."),
        ("print('!a', \"x++\"  # new Twist(), a =< b", ""),
        ("if a != b or f'{a!r}' pass", ""),
        ("later = lambda x => x", ""),
        ("a = [1, 2", ""),
    ],
)
def test_what_other_languages_write_is_told_in_the_words_of_python(line, says):
    assert said_of(line) == says


TEXTS = """class Motors(Node):
    def enable(self):
        {first}
        return 1

    def status(self):
        {second}
        return 2
"""


@pytest.mark.parametrize(
    ("first", "second", "told"),
    [
        ('"""Enable.', '"""Say it."""', "in line 3 lacks its end: the quotation marks of line 7, which"),
        ("'''Enable.", "'''Say it.'''", "close it. Write `'''` where it should end."),
        ('"""Enable."""', '"""Say it.', ""),  # Python names the line itself
        ('"""Enable.', '"""\n        Say it.\n        """', ""),
    ],
)
def test_a_text_that_another_one_ends_is_named(first, second, told):
    said = said_of(TEXTS.format(first=first, second=second))
    assert told in said and bool(said) == bool(told)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("return {'linear': 0.0, 'angular': 0,5}", "A number has a decimal point: `0.5`."),
        ("return {'linear': 1,5, 'angular': 0.5}", "A number has a decimal point: `1.5`."),
        ("if front < 0,5:", "A number has a decimal point: `0.5`."),
        ("elif right >= 1,2 and front > 2:", "A number has a decimal point: `1.2`."),
        ("client.wait_for_server(timeout_sec=5,0)", "A number has a decimal point: `5.0`."),
        ("low = FloatingPointRange(from_value=-1,5, to_value=2)", "A number has a decimal point: `-1.5`."),
        ("if front < 5, 0:", ""),
        ("x = 1,2", ""),
        ("ask(a=1, 2)", ""),
        ("return {1: 2,3: 4", ""),
        ("beam(1,2", ""),
    ],
)
def test_a_decimal_comma_is_told(line, says):
    assert decimal_comma(line) == says


@pytest.mark.parametrize(
    ("line", "told"), [("terminal(python3 client.py 1 2)", True), ("terminal('ros2 node list')", False)]
)
def test_a_command_without_quotation_marks_is_told(line, told):
    assert ("in quotation marks" in unquoted_command(line)) == told
