"""Comparisons that always have one outcome, and class attributes that hide rclpy's: each is told, and nothing right."""

import pytest

from course.explaining.hints import hint
from course.explaining.slips import slips

CHECKS = """class Pid(Node):
    def __init__(self):
        super().__init__('pid')
        self.declare_parameter('ki', 0.0)
        self.add_on_set_parameters_callback(self.check)
        self.add_post_set_parameters_callback(self.noted)
    def check(self, params):
        for param in params:
            if {test}:
                return SetParametersResult(successful=False)
        return SetParametersResult(successful=True)
    def noted(self, params):
        self.changed = [each for each in params if {other}]
"""


@pytest.mark.parametrize(
    ("test", "other", "says"),
    [
        ("param == 'ki'", "True", "line 9: `param == 'ki'` is always false: `param` is a Parameter. Its name is"),
        ("'ki' != param and param.value", "True", "line 9: `'ki' != param` is always true"),
        ("param.name == 'ki'", "each == 'ki'", "line 13: `each == 'ki'` is always false: `each` is a Parameter."),
        ("param.name == 'ki' and param.value == 'a'", "each.name == 'ki'", ""),
        ("(param := param.name) == 'ki'", "True", ""),
        ("param in ('ki', 1)", "True", ""),
    ],
)  # fmt: skip
def test_a_parameter_compared_with_its_name_is_told(test, other, says):
    told = "\n".join(slips(CHECKS.format(test=test, other=other)))
    assert says in told and bool(says) == bool(told), told


def test_the_names_of_parameters_may_be_looped_over():
    text = CHECKS.format(test="param == 'ki'", other="True")
    assert not slips(text.replace("for param in params", "for param in (each.name for each in params)"))
    assert not slips(
        text.replace("        for param", "        params = [each.name for each in params]\n        for param")
    )


ASKS = """from std_srvs.srv import SetBool
class Client(Node):
    def __init__(self):
        super().__init__('client')
        self.client = self.create_client(SetBool, 'enable')
    def ask(self):
        future = self.client.call_async(SetBool.Request(data=True))
        rclpy.spin_until_future_complete(self, future)
        response = {response}
        return 0 if {test} else 1
"""


@pytest.mark.parametrize(
    ("response", "test", "says"),
    [
        ("future.result()", "response.success == 'True'",
         "line 10: `response.success == 'True'` is always false: the field is True or False, not a text. Use"),
        ("future.result()", "response.success != 'False'", "is always true"),
        ("self.client.call(request)", "'true' == response.success", "is always false"),
        ("await self.client.call_async(request)", "response.success == 'True'", "is always false"),
        ("None", "future.result().success == 'True'", "Use `future.result().success` alone, or `not future.result().s"),
        ("future.result()", "response.success == True and response.message != 'on'", ""),
        ("future.result()", "response.success or response.message == 'True'", ""),
        ("self.read()", "response.success == 'True'", ""),
        ("self.success", "response == 'True'", ""),
    ],
)  # fmt: skip
def test_a_truth_value_of_a_response_compared_with_a_text_is_told(response, test, says):
    told = "\n".join(slips(ASKS.format(response=response, test=test)))
    assert says in told and bool(says) == bool(told), told


OPTIONS = """class Client:
    def __init__(self, cancel_after=None):
        self.cancel_after = {kept}
    def heard(self):
        return {test}
def main():
    parser.add_argument('--cancel-after', {how})
    return Client(parser.parse_args().cancel_after)
"""


@pytest.mark.parametrize(
    ("how", "kept", "test", "told"),
    [
        ("action='store_true'", "cancel_after", "self.cancel_after is not None", "always true"),
        ("action='store_true'", "cancel_after", "self.cancel_after is None", "always false"),
        ("action='store_true'", "cancel_after", "self.cancel_after", ""),
        ("action='store_true'", "3 if cancel_after else None", "self.cancel_after is not None", ""),
        ("action='store_true', default=None", "cancel_after", "self.cancel_after is not None", ""),
        ("type=int", "cancel_after", "self.cancel_after is not None", ""),
    ],
)
def test_an_option_that_is_never_none_is_told(how, kept, test, told):
    why = (
        f"note: line 5: `{test}` is {told}: with `action='store_true'`, `--cancel-after` is True or False, never None. "
        "An option with a number has `type=int` in its place."
    )
    assert slips(OPTIONS.format(how=how, kept=kept, test=test)) == ([why] if told else [])


@pytest.mark.parametrize(
    ("base", "attribute", "makes", "hidden"),
    [
        ("Node", "services = {}", "", "services"),
        ("Node", "services: list = ['enable']", "", "services"),
        ("Node", "timers = []", "self.create_timer(0.1, self.step)", "timers"),
        ("Node", "timers = 3", "", "timers"),
        ("Node", "timers = []", "", ""),
        ("Node", "clients = {}", "self.create_client(Trigger, 'a')", "clients"),
        ("Node", "subscriptions = []", "self.create_subscription(Float64, 'a', self.hear, 10)", "subscriptions"),
        ("Node", "subscriptions: list", "self.create_subscription(Float64, 'a', self.hear, 10)", ""),
        ("Node", "waitables = []", "ActionClient(self, Lift, 'lift')", "waitables"),
        ("Node", "waitables = []", "", ""),
        ("Node", "guards = ['front']", "", "guards"),
        ("Node", "publishers = []", "self.create_publisher(Float64, 'a', 10)", ""),  # which harms nothing
        ("Node", "my_services = {}", "", ""),
        ("Motors", "services = {}", "", ""),
    ],
)
def test_an_attribute_of_the_class_that_hides_rclpys_own_is_told(base, attribute, makes, hidden):
    text = f"class Motors({base}):\n    {attribute}\n    def __init__(self):\n        {makes or 'pass'}\n"
    why = f"note: line 2: `{hidden}` hides rclpy's own `{hidden}` of a node, by which the executor finds its {hidden}"
    assert slips(text) == ([f"{why}: choose another name."] if hidden else [])


@pytest.mark.parametrize(
    ("attribute", "error"),
    [
        ("handle", "TypeError: 'int' object does not support the context manager protocol"),
        ("default_callback_group", "AttributeError: 'int' object has no attribute 'add_entity'"),
    ],
)
def test_an_attribute_of_the_class_without_which_no_node_is_made_is_told(attribute, error):
    text = f"class Motors(Node):\n    {attribute} = 3\n"
    why = f"ine 2: `{attribute}` hides rclpy's own `{attribute}` of a node: choose another name."
    assert slips(text) == [f"note: l{why}"]
    assert hint(error, text) == f"L{why}"
