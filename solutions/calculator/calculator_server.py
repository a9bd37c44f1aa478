"""A service server that adds, subtracts, multiplies and divides."""
import operator

import rclpy
from calculator_interfaces.srv import Calculate
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

OPERATIONS = {
    'add': operator.add,
    'subtract': operator.sub,
    'multiply': operator.mul,
    'divide': operator.truediv,
}


class CalculatorServer(Node):

    def __init__(self, **kwargs):
        super().__init__('calculator_server', **kwargs)
        self.srv = self.create_service(Calculate, '/calculator', self.calculate)
        self.get_logger().info('Calculator ready')

    def calculate(self, request, response):
        self.get_logger().info(f'Request: {request.operation} a={request.a} b={request.b}')
        if request.operation not in OPERATIONS:
            response.message = f"Unknown operation '{request.operation}': use one of {', '.join(OPERATIONS)}"
        elif request.operation == 'divide' and request.b == 0.0:
            response.message = 'Division by zero'
        else:
            response.result = OPERATIONS[request.operation](request.a, request.b)
            response.success = True
            response.message = 'OK'
        self.get_logger().info(
            f'Response: result={response.result} success={response.success} message={response.message}')
        return response


def main(args=None):
    rclpy.init(args=args)
    node = CalculatorServer()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
