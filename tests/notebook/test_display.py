"""The display of a message below a cell."""

import array

import pytest
from geometry_msgs.msg import Twist
from IPython.core.formatters import DisplayFormatter
from rcl_interfaces.msg import Parameter, ParameterEvent
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Trigger

from course.notebook.display import brief, cut_messages

HUGE = {
    "a text": Trigger.Response(message="x" * 3_000_000),
    "an array": LaserScan(ranges=array.array("f", [1.0]) * 1_000_000),
    "many messages": ParameterEvent(new_parameters=[Parameter(name="n")] * 200_000),
    "many long texts": ParameterEvent(new_parameters=[Parameter(name="n" * 3000)] * 100),
}


@pytest.fixture
def shown():
    """The text that a cell shows for its result."""
    display = DisplayFormatter()
    cut_messages(display)
    return lambda result: display.format(result)[0]["text/plain"]


@pytest.mark.parametrize("name", HUGE)
def test_of_a_huge_message_the_beginning_is_shown(shown, name):
    text = shown(HUGE[name])
    assert len(text) < 300_000
    assert "more, with `print` you see all)" in text


@pytest.mark.parametrize("result", [LaserScan(ranges=[1.0] * 360), Twist(), "x" * 5000, [Twist()], None, 1.5])
def test_all_else_is_shown_as_before(shown, result):
    assert shown(result) == DisplayFormatter().format(result)[0]["text/plain"]


def test_a_short_field_has_the_text_that_rclpy_gives_it():
    for message in (Twist(), Trigger.Response(message="a"), LaserScan(), Parameter(name="n")):
        assert brief(message) == repr(message)


def test_it_is_so_in_a_kernel(tmp_path):
    from tests.kernels import Kernel

    kernel = Kernel(tmp_path)
    try:
        said = kernel.run("from std_srvs.srv import Trigger\nTrigger.Response(message='x' * 3_000_000)")
        assert said.startswith("std_srvs.srv.Trigger_Response(success=False, message='xxx")
        assert len(said) < 2_000
    finally:
        kernel.stop()
