"""A service server that adds, subtracts, multiplies and divides."""
import rclpy
from calculator_interfaces.srv import Calculate
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


class CalculatorServer(Node):

    def __init__(self):
        super().__init__('calculator_server')
        self.srv = self.create_service(Calculate, '/calculator', self.calculate)
        self.get_logger().info('Calculator ready')

    def calculate(self, request, response):
        """Compute, or refuse: then success is False and message says why."""
        self.get_logger().info(
            f'Request: a={request.a} b={request.b} operation={request.operation}')
        response.success = True
        if request.operation == 'add':
            response.result = request.a + request.b
        elif request.operation == 'subtract':
            response.result = request.a - request.b
        elif request.operation == 'multiply':
            response.result = request.a * request.b
        elif request.operation != 'divide':
            response.success = False
            response.message = f"Unknown operation '{request.operation}'"
        elif request.b == 0.0:
            response.success = False
            response.message = 'Division by zero'
        else:
            response.result = request.a / request.b
        self.get_logger().info(
            f'Response: result={response.result} success={response.success} '
            f'message={response.message}')
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
