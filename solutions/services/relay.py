"""A service that asks another service from inside its callback."""
import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_srvs.srv import Trigger


class Relay(Node):

    def __init__(self):
        super().__init__('relay')
        self.declare_parameter('a', 0)
        self.declare_parameter('b', 0)
        # While a callback awaits its response, others must be able to run.
        group = ReentrantCallbackGroup()
        self.client = self.create_client(
            AddTwoInts, '/add_two_ints', callback_group=group)
        self.create_service(Trigger, '/relay', self.relay, callback_group=group)
        self.get_logger().info('Relay ready')

    async def relay(self, request, response):
        """Answer with the sum of a and b, as /add_two_ints computes it."""
        a, b = self.get_parameter('a').value, self.get_parameter('b').value
        if not self.client.service_is_ready():
            response.success = False
            response.message = '/add_two_ints is not there'
            return response
        answer = await self.client.call_async(AddTwoInts.Request(a=a, b=b))
        response.success = True
        response.message = f'{a} + {b} = {answer.sum}'
        return response


def main(args=None):
    rclpy.init(args=args)
    node = Relay()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
