"""A PID controller: `error` in, `effort` out, its gains and limits are parameters."""
import time

import rclpy
from rcl_interfaces.msg import (
    FloatingPointRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64


class PidNode(Node):

    def __init__(self):
        super().__init__('pid_node')
        self.declare_gain('kp', 1.0, 100.0, 'effort per unit of error')
        self.declare_gain('ki', 0.0, 50.0, 'effort per unit of error and second')
        self.declare_gain('kd', 0.0, 10.0, 'effort per unit of error change a second')
        self.declare_parameter('output_min', -10.0)
        self.declare_parameter('output_max', 10.0)
        joint = self.declare_parameter(
            'joint_name', 'elbow', ParameterDescriptor(read_only=True)).value

        self.ki = self.value('ki')  # as it was when the integral began
        self.integral = 0.0  # error times seconds
        self.last_error = 0.0
        self.last_time = None  # seconds, of no message yet
        self.add_on_set_parameters_callback(self.check_parameters)
        self.add_post_set_parameters_callback(self.parameters_changed)
        self.effort_pub = self.create_publisher(Float64, 'effort', 10)
        self.error_sub = self.create_subscription(
            Float64, 'error', self.error_callback, 10)
        self.get_logger().info(f"PID controller of joint '{joint}' started")

    def declare_gain(self, name, default, largest, description):
        """Declare a parameter that must be between 0 and largest."""
        limits = FloatingPointRange(from_value=0.0, to_value=largest)
        self.declare_parameter(name, default, ParameterDescriptor(
            description=description, floating_point_range=[limits]))

    def value(self, name):
        return self.get_parameter(name).value

    def check_parameters(self, params):
        """Refuse limits that are not in order. Only look: others may still refuse."""
        limits = {name: self.value(name) for name in ('output_min', 'output_max')}
        for param in params:
            if param.name in limits:
                limits[param.name] = param.value
        if not limits['output_min'] < limits['output_max']:  # so NaN is refused too
            return SetParametersResult(
                successful=False,
                reason='output_min ({output_min}) must be below output_max ({output_max})'
                .format(**limits))
        return SetParametersResult(successful=True)

    def parameters_changed(self, params):
        """Act on new values: by now all of them are accepted and stored."""
        for param in params:
            self.get_logger().info(f'{param.name} is now {param.value}')
            if param.name == 'ki' and param.value != self.ki:
                self.ki, self.integral = param.value, 0.0

    def error_callback(self, msg):
        """Answer each error with an effort, by the gains of this moment."""
        error, now = msg.data, time.monotonic()
        step = 0.0 if self.last_time is None else now - self.last_time
        self.integral += error * step
        slope = (error - self.last_error) / step if step > 0.0 else 0.0
        self.last_error, self.last_time = error, now

        effort = (self.value('kp') * error + self.value('ki') * self.integral
                  + self.value('kd') * slope)
        effort = max(self.value('output_min'), min(self.value('output_max'), effort))
        self.effort_pub.publish(Float64(data=effort))


def main(args=None):
    rclpy.init(args=args)
    node = PidNode()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
