"""Call the calculator service once: python3 calculator_client.py A B OPERATION."""
import sys

import rclpy
from calculator_interfaces.srv import Calculate
from rclpy.node import Node
from rclpy.utilities import remove_ros_args

USAGE = 'Usage: python3 calculator_client.py A B add|subtract|multiply|divide'


class CalculatorClient(Node):

    def __init__(self):
        super().__init__('calculator_client')
        self.client = self.create_client(Calculate, '/calculator')

    def call(self, a, b, operation, timeout_sec=5.0):
        """Return the response, or None when there is none within timeout_sec."""
        if not self.client.wait_for_service(timeout_sec=timeout_sec):
            return None
        future = self.client.call_async(Calculate.Request(a=a, b=b, operation=operation))
        rclpy.spin_until_future_complete(self, future, timeout_sec=timeout_sec)
        return future.result()


def main(args=None):
    """Print the result, or why there is none; return the exit status."""
    try:
        _, a, b, operation = remove_ros_args(args)
        a, b = float(a), float(b)
    except ValueError:
        print(USAGE)
        return 2
    rclpy.init(args=args)
    node = CalculatorClient()
    try:
        response = node.call(a, b, operation)
    except KeyboardInterrupt:
        return 130
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    if response is None:
        print('No answer from /calculator: is calculator_server.py running?')
        return 1
    if not response.success:
        print(f'{operation} failed: {response.message}')
        return 1
    print(f'{a} {operation} {b} = {response.result}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
