"""Two services that share one state: switch the motors, and ask whether they are on."""
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger


class MotorService(Node):

    def __init__(self):
        super().__init__('motor_service')
        self.enabled = False
        self.create_service(SetBool, '/motors/enable', self.enable)
        self.create_service(Trigger, '/motors/status', self.status)
        self.get_logger().info('Motor service ready')

    def state(self):
        return 'enabled' if self.enabled else 'disabled'

    def enable(self, request, response):
        """Switch on (data is True) or off; asking for the state it is in is no error."""
        self.enabled = request.data
        self.get_logger().info(f'Motors {self.state()}')
        response.success = True
        response.message = f'Motors {self.state()}'
        return response

    def status(self, request, response):
        """Say the state, and leave it alone."""
        response.success = True
        response.message = f'Motors {self.state()}'
        return response


def main(args=None):
    rclpy.init(args=args)
    node = MotorService()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
