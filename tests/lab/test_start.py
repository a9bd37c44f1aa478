"""The panels see a session, whoever has begun it."""

from course.lab.kernel.start import SERVED
from tests.kernels import Kernel
from tests.lab.client import page_of

NODE = """\
%%exercise idle.py
import rclpy


def main():
    rclpy.init()
    rclpy.spin(rclpy.create_node('idle'))


if __name__ == '__main__':
    main()
"""


def test_a_node_of_an_exercise_cell_is_seen_before_the_first_cell_was_run(tmp_path):
    kernel = Kernel(tmp_path, {SERVED: "live.ipynb"})
    try:
        assert kernel.run(NODE) == "idle.py: written, running as /idle"
        page = page_of(kernel)
        page.subscribe("nodes")
        assert [node["name"] for node in page.event()["data"]["nodes"]] == ["/idle"]
        page.close()
        told = kernel.run("import course\nros = course.live()\nprint(ros.nodes())")
        assert "/idle" in told  # the same session
    finally:
        kernel.stop()
