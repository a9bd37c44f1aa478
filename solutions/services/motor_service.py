"""Three services that share one state: switch the motors, stop them, ask for their state."""
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger


class MotorService(Node):

    def __init__(self):
        super().__init__('motor_service')
        self.enabled = False
        self.stopped = False
        self.create_service(SetBool, '/motors/enable', self.enable)
        self.create_service(SetBool, '/motors/emergency_stop', self.emergency_stop)
        self.create_service(Trigger, '/motors/status', self.status)
        self.get_logger().info('Motor service ready')

    def state(self):
        if self.stopped:
            return 'stopped'
        return 'enabled' if self.enabled else 'disabled'

    def enable(self, request, response):
        """Enable (data is True) or disable; refuse to enable while the motors are stopped."""
        response.success = not (request.data and self.stopped)
        self.enabled = request.data and response.success
        self.get_logger().info(f'Motors {self.state()}')
        response.message = f'Motors {self.state()}'
        return response

    def emergency_stop(self, request, response):
        """Stop the motors (data is True), or end the stop: what was stopped is disabled then."""
        self.stopped = request.data
        if self.stopped:
            self.enabled = False
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
