"""Tutorials of docs.ros.org (Jazzy) as they are typed here: each command line of a tutorial, letter by letter.

A script is read line by line:

    1$ LINE         is typed into terminal 1, at its prompt; `^C` is the key
        TEXT        is what terminal 1 must show after that line, in any order with the texts beside it
    write PATH: NAME    an editor writes the file NAME of `FILES`
    entry PACKAGE: LINE    an editor adds the LINE to the console scripts of the package's setup.py
    add PATH: OLD -> NEW    an editor puts NEW before OLD

Each terminal is opened when it is first typed into.  The nodes are written afresh.
"""

from typing import NamedTuple


class Tutorial(NamedTuple):
    """A tutorial: its title and its page below https://docs.ros.org/en/jazzy/Tutorials, and what is typed and seen."""

    title: str
    page: str
    script: str


TALKER = """\
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from {package}.msg import {type}


class MinimalPublisher(Node):
    def __init__(self):
        super().__init__("minimal_publisher")
        self.publisher = self.create_publisher({type}, "topic", 10)
        self.timer = self.create_timer(0.5, self.say)
        self.count = 0

    def say(self):
        message = {type}({field}={value})
        self.publisher.publish(message)
        self.get_logger().info(f'Publishing: "{{message.{field}}}"')
        self.count += 1


def main(args=None):
    rclpy.init(args=args)
    try:
        rclpy.spin(MinimalPublisher())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
"""
LISTENER = """\
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from {package}.msg import {type}


class MinimalSubscriber(Node):
    def __init__(self):
        super().__init__("minimal_subscriber")
        self.subscription = self.create_subscription({type}, "topic", self.hear, 10)

    def hear(self, message):
        self.get_logger().info(f'I heard: "{{message.{field}}}"')


def main(args=None):
    rclpy.init(args=args)
    try:
        rclpy.spin(MinimalSubscriber())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
"""
SERVICE = """\
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from {package}.srv import {type}


class MinimalService(Node):
    def __init__(self):
        super().__init__("minimal_service")
        self.service = self.create_service({type}, "{name}", self.add)

    def add(self, request, response):
        response.sum = {sum}
        self.get_logger().info(f"Incoming request\\na: {{request.a}} b: {{request.b}}")
        return response


def main():
    rclpy.init()
    try:
        rclpy.spin(MinimalService())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
"""
CLIENT = """\
import sys

import rclpy
from {package}.srv import {type}


def main():
    rclpy.init()
    node = rclpy.create_node("minimal_client_async")
    client = node.create_client({type}, "{name}")
    while not client.wait_for_service(timeout_sec=1.0):
        node.get_logger().info("service not available, waiting again...")
    numbers = [int(word) for word in sys.argv[1:]]
    future = client.call_async({type}.Request(**dict(zip("abc", numbers))))
    rclpy.spin_until_future_complete(node, future)
    node.get_logger().info(f"Result: for {{' + '.join(map(str, numbers))}} = {{future.result().sum}}")
    node.destroy_node()
    rclpy.shutdown()
"""
PARAMETERS = """\
import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter


class MinimalParam(Node):
    def __init__(self):
        super().__init__("minimal_param_node")
        self.declare_parameter("my_parameter", "world", ParameterDescriptor(description="This parameter is mine!"))
        self.timer = self.create_timer(1, self.greet)

    def greet(self):
        self.get_logger().info(f"Hello {self.get_parameter('my_parameter').value}!")
        self.set_parameters([Parameter("my_parameter", Parameter.Type.STRING, "world")])


def main():
    rclpy.init()
    try:
        rclpy.spin(MinimalParam())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
"""
MONITOR = """\
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_event_handler import ParameterEventHandler


class NodeWithParameters(Node):
    def __init__(self):
        super().__init__("node_with_parameters")
        self.declare_parameter("an_int_param", 0)
        self.handler = ParameterEventHandler(self)
        self.handles = [
            self.handler.add_parameter_callback(parameter_name=name, node_name=node, callback=self.tell)
            for name, node in (
                ("an_int_param", "node_with_parameters"),
                ("a_double_param", "parameter_blackboard"),
            )
        ]

    def tell(self, changed):
        value = parameter_value_to_python(changed.value)
        self.get_logger().info(f"Received an update to parameter: {changed.name}: {value}")


def main():
    rclpy.init()
    try:
        rclpy.spin(NodeWithParameters())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
"""
ACTION_SERVER = """\
import time

import rclpy
from custom_action_interfaces.action import Fibonacci
from rclpy.action import ActionServer
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


class FibonacciActionServer(Node):
    def __init__(self):
        super().__init__("fibonacci_action_server")
        self.server = ActionServer(self, Fibonacci, "fibonacci", self.execute)

    def execute(self, goal):
        self.get_logger().info("Executing goal...")
        feedback = Fibonacci.Feedback(partial_sequence=[0, 1])
        for _ in range(1, goal.request.order):
            feedback.partial_sequence.append(sum(feedback.partial_sequence[-2:]))
            self.get_logger().info(f"Feedback: {feedback.partial_sequence}")
            goal.publish_feedback(feedback)
            time.sleep(0.1)
        goal.succeed()
        return Fibonacci.Result(sequence=feedback.partial_sequence)


def main():
    rclpy.init()
    try:
        rclpy.spin(FibonacciActionServer())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
"""
ACTION_CLIENT = """\
import rclpy
from custom_action_interfaces.action import Fibonacci
from rclpy.action import ActionClient


def main():
    rclpy.init()
    node = rclpy.create_node("fibonacci_action_client")
    client = ActionClient(node, Fibonacci, "fibonacci")
    client.wait_for_server()
    sent = client.send_goal_async(
        Fibonacci.Goal(order=10),
        feedback_callback=lambda each: node.get_logger().info(
            f"Received feedback: {list(each.feedback.partial_sequence)}"
        ),
    )
    rclpy.spin_until_future_complete(node, sent)
    node.get_logger().info("Goal accepted :)" if sent.result().accepted else "Goal rejected :(")
    result = sent.result().get_result_async()
    rclpy.spin_until_future_complete(node, result)
    node.get_logger().info(f"Result: {list(result.result().result.sequence)}")
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
"""
INTERFACES = """\
find_package(geometry_msgs REQUIRED)
find_package(rosidl_default_generators REQUIRED)

rosidl_generate_interfaces(${PROJECT_NAME}
  "msg/Num.msg"
  "msg/Sphere.msg"
  "srv/AddThreeInts.srv"
  DEPENDENCIES geometry_msgs
)

"""
ACTION_RULES = """\
find_package(rosidl_default_generators REQUIRED)

rosidl_generate_interfaces(${PROJECT_NAME}
  "action/Fibonacci.action"
)

"""
GROUP = """\
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
"""
STRING = {"package": "std_msgs", "type": "String", "field": "data", "value": 'f"Hello World: {self.count}"'}
NUM = {"package": "tutorial_interfaces", "type": "Num", "field": "num", "value": "self.count"}
TWO = {
    "package": "example_interfaces", "type": "AddTwoInts", "name": "add_two_ints", "sum": "request.a + request.b",
}  # fmt: skip
THREE = {
    "package": "tutorial_interfaces", "type": "AddThreeInts", "name": "add_three_ints",
    "sum": "request.a + request.b + request.c",
}  # fmt: skip
FILES = {
    "talker": TALKER.format(**STRING),
    "listener": LISTENER.format(**STRING),
    "talker of Num": TALKER.format(**NUM),
    "listener of Num": LISTENER.format(**NUM),
    "service": SERVICE.format(**TWO),
    "client": CLIENT.format(**TWO),
    "service of three": SERVICE.format(**THREE),
    "client of three": CLIENT.format(**THREE),
    "parameters": PARAMETERS,
    "monitor": MONITOR,
    "action server": ACTION_SERVER,
    "action client": ACTION_CLIENT,
    "Num": "int64 num\n",
    "Sphere": "geometry_msgs/Point center\nfloat64 radius\n",
    "AddThreeInts": "int64 a\nint64 b\nint64 c\n---\nint64 sum\n",
    "Fibonacci": "int32 order\n---\nint32[] sequence\n---\nint32[] partial_sequence\n",
    "rules of the interfaces": INTERFACES,
    "rules of the action": ACTION_RULES,
    "group of interfaces": GROUP,
    "geometry": "  <depend>geometry_msgs</depend>\n",
    "needs the interfaces": "  <exec_depend>tutorial_interfaces</exec_depend>\n",
}

PACKAGE = """
1$ mkdir -p ~/ros2_ws/src
1$ cd ~/ros2_ws/src
1$ ros2 pkg create --build-type ament_python --license Apache-2.0 --node-name my_node my_package
    going to create a new package
    package name: my_package
    destination directory:
    package format: 3
    version: 0.0.0
    description: TODO: Package description
    maintainer: ['
    licenses: ['Apache-2.0']
    build type: ament_python
    dependencies: []
    node_name: my_node
    creating folder ./my_package
    creating ./my_package/package.xml
    creating source folder
    creating folder ./my_package/my_package
    creating ./my_package/setup.py
    creating ./my_package/setup.cfg
    creating folder ./my_package/resource
    creating ./my_package/resource/my_package
    creating ./my_package/my_package/__init__.py
    creating folder ./my_package/test
    creating ./my_package/test/test_copyright.py
    creating ./my_package/test/test_flake8.py
    creating ./my_package/test/test_pep257.py
    creating ./my_package/my_package/my_node.py
1$ cd ~/ros2_ws
1$ colcon build
    Summary: 1 package finished
1$ colcon build --packages-select my_package
    Summary: 1 package finished
2$ cd ~/ros2_ws
2$ source install/local_setup.bash
2$ ros2 run my_package my_node
    Hi from my_package.
2$ ls src/my_package
    my_package  package.xml  resource  setup.cfg  setup.py  test
"""

PUBSUB = """
1$ source /opt/ros/jazzy/setup.bash
    nothing is to be sourced
1$ mkdir -p ~/ros2_ws/src
1$ cd ~/ros2_ws/src
1$ ros2 pkg create --build-type ament_python --license Apache-2.0 py_pubsub
    creating ./py_pubsub/py_pubsub
write ~/ros2_ws/src/py_pubsub/py_pubsub/publisher_member_function.py: talker
write ~/ros2_ws/src/py_pubsub/py_pubsub/subscriber_member_function.py: listener
entry py_pubsub: talker = py_pubsub.publisher_member_function:main
entry py_pubsub: listener = py_pubsub.subscriber_member_function:main
1$ cd ~/ros2_ws
1$ rosdep install -i --from-path src --rosdistro jazzy -y
    #All required rosdeps installed successfully
1$ colcon build --packages-select py_pubsub
    Summary: 1 package finished
1$ source install/setup.bash
1$ ros2 run py_pubsub talker
    [INFO] [minimal_publisher]: Publishing: "Hello World: 0"
    [INFO] [minimal_publisher]: Publishing: "Hello World: 1"
2$ cd ~/ros2_ws
2$ source install/setup.bash
2$ ros2 run py_pubsub listener
    [INFO] [minimal_subscriber]: I heard: "Hello World:
2$ ^C
1$ ^C
"""

SRVCLI = """
1$ mkdir -p ~/ros2_ws/src
1$ cd ~/ros2_ws/src
1$ ros2 pkg create --build-type ament_python --license Apache-2.0 py_srvcli --dependencies rclpy example_interfaces
    creating ./py_srvcli/py_srvcli
write ~/ros2_ws/src/py_srvcli/py_srvcli/service_member_function.py: service
write ~/ros2_ws/src/py_srvcli/py_srvcli/client_member_function.py: client
entry py_srvcli: service = py_srvcli.service_member_function:main
entry py_srvcli: client = py_srvcli.client_member_function:main
1$ cd ~/ros2_ws
1$ rosdep install -i --from-path src --rosdistro jazzy -y
    #All required rosdeps installed successfully
1$ colcon build --packages-select py_srvcli
    Summary: 1 package finished
1$ source install/setup.bash
1$ ros2 run py_srvcli service
2$ cd ~/ros2_ws
2$ source install/setup.bash
2$ ros2 run py_srvcli client 2 3
    [INFO] [minimal_client_async]: Result: for 2 + 3 = 5
1$
    [INFO] [minimal_service]: Incoming request
    a: 2 b: 3
1$ ^C
"""

CUSTOM = """
1$ mkdir -p ~/ros2_ws/src
1$ cd ~/ros2_ws/src
1$ ros2 pkg create --build-type ament_cmake --license Apache-2.0 tutorial_interfaces
    creating folder ./tutorial_interfaces/src
1$ cd tutorial_interfaces
1$ mkdir msg srv
write ~/ros2_ws/src/tutorial_interfaces/msg/Num.msg: Num
write ~/ros2_ws/src/tutorial_interfaces/msg/Sphere.msg: Sphere
write ~/ros2_ws/src/tutorial_interfaces/srv/AddThreeInts.srv: AddThreeInts
add ~/ros2_ws/src/tutorial_interfaces/CMakeLists.txt: rules of the interfaces -> if(BUILD_TESTING)
add ~/ros2_ws/src/tutorial_interfaces/package.xml: geometry -> <test_depend>
add ~/ros2_ws/src/tutorial_interfaces/package.xml: group of interfaces -> <test_depend>
1$ cd ~/ros2_ws
1$ colcon build --packages-select tutorial_interfaces
    Summary: 1 package finished
1$ source install/setup.bash
1$ ros2 interface show tutorial_interfaces/msg/Num
    int64 num
1$ ros2 interface show tutorial_interfaces/msg/Sphere
    geometry_msgs/Point center
    float64 radius
1$ ros2 interface show tutorial_interfaces/srv/AddThreeInts
    int64 c
1$ cd src
1$ ros2 pkg create --build-type ament_python --license Apache-2.0 py_pubsub
1$ ros2 pkg create --build-type ament_python --license Apache-2.0 py_srvcli --dependencies rclpy example_interfaces
write ~/ros2_ws/src/py_pubsub/py_pubsub/publisher_member_function.py: talker of Num
write ~/ros2_ws/src/py_pubsub/py_pubsub/subscriber_member_function.py: listener of Num
write ~/ros2_ws/src/py_srvcli/py_srvcli/service_member_function.py: service of three
write ~/ros2_ws/src/py_srvcli/py_srvcli/client_member_function.py: client of three
add ~/ros2_ws/src/py_pubsub/package.xml: needs the interfaces -> <test_depend>
add ~/ros2_ws/src/py_srvcli/package.xml: needs the interfaces -> <test_depend>
entry py_pubsub: talker = py_pubsub.publisher_member_function:main
entry py_pubsub: listener = py_pubsub.subscriber_member_function:main
entry py_srvcli: service = py_srvcli.service_member_function:main
entry py_srvcli: client = py_srvcli.client_member_function:main
1$ cd ~/ros2_ws
1$ colcon build --packages-select py_pubsub
    Summary: 1 package finished
1$ colcon build --packages-select py_srvcli
    Summary: 1 package finished
1$ source install/setup.bash
1$ ros2 run py_pubsub talker
    [INFO] [minimal_publisher]: Publishing: "1"
2$ cd ~/ros2_ws
2$ source install/setup.bash
2$ ros2 run py_pubsub listener
    [INFO] [minimal_subscriber]: I heard: "
2$ ^C
1$ ^C
1$ ros2 run py_srvcli service
2$ ros2 run py_srvcli client 2 3 1
    Result: for 2 + 3 + 1 = 6
1$ ^C
"""

PARAMETER = """
1$ mkdir -p ~/ros2_ws/src
1$ cd ~/ros2_ws/src
1$ ros2 pkg create --build-type ament_python --license Apache-2.0 python_parameters --dependencies rclpy
    creating ./python_parameters/python_parameters
write ~/ros2_ws/src/python_parameters/python_parameters/python_parameters_node.py: parameters
entry python_parameters: minimal_param_node = python_parameters.python_parameters_node:main
1$ cd ~/ros2_ws
1$ rosdep install -i --from-path src --rosdistro jazzy -y
    #All required rosdeps installed successfully
1$ colcon build --packages-select python_parameters
    Summary: 1 package finished
1$ source install/setup.bash
1$ ros2 run python_parameters minimal_param_node
    [INFO] [minimal_param_node]: Hello world!
2$ cd ~/ros2_ws
2$ source install/setup.bash
2$ ros2 param list
    my_parameter
2$ ros2 param describe /minimal_param_node my_parameter
    Type: string
    Description: This parameter is mine!
2$ ros2 param set /minimal_param_node my_parameter earth
    Set parameter successful
1$
    [INFO] [minimal_param_node]: Hello earth!
1$ ^C
"""

DOCTOR = """
1$ ros2 doctor
    checks passed
1$ ros2 wtf
    checks passed
1$ ros2 doctor --report
    NETWORK CONFIGURATION
    PLATFORM INFORMATION
    RMW MIDDLEWARE
    distribution name
    : jazzy
    TOPIC LIST
1$ ros2 run demo_nodes_py talker
    Publishing: "Hello World: 0"
2$ ros2 doctor
    UserWarning: Publisher without subscriber detected on /chatter.
1$ ^C
"""

ACTION = """
1$ mkdir -p ~/ros2_ws/src
1$ cd ~/ros2_ws/src
1$ ros2 pkg create --license Apache-2.0 custom_action_interfaces
    creating folder ./custom_action_interfaces
1$ cd custom_action_interfaces
1$ mkdir action
write ~/ros2_ws/src/custom_action_interfaces/action/Fibonacci.action: Fibonacci
add ~/ros2_ws/src/custom_action_interfaces/CMakeLists.txt: rules of the action -> if(BUILD_TESTING)
add ~/ros2_ws/src/custom_action_interfaces/package.xml: group of interfaces -> <test_depend>
1$ cd ~/ros2_ws
1$ colcon build
    Summary: 1 package finished
1$ source install/local_setup.bash
1$ ros2 interface show custom_action_interfaces/action/Fibonacci
    int32 order
    int32[] partial_sequence
write ~/fibonacci_action_server.py: action server
write ~/fibonacci_action_client.py: action client
1$ cd
1$ python3 fibonacci_action_server.py
2$ source ros2_ws/install/setup.bash
2$ ros2 action send_goal fibonacci custom_action_interfaces/action/Fibonacci "{order: 5}"
    Goal accepted with ID:
    Goal finished with status: SUCCEEDED
2$ ros2 action send_goal --feedback fibonacci custom_action_interfaces/action/Fibonacci "{order: 5}"
    Feedback:
    partial_sequence:
    Goal finished with status: SUCCEEDED
2$ python3 fibonacci_action_client.py
    Goal accepted :)
    Received feedback: [0, 1, 1]
    Result: [0, 1, 1, 2, 3, 5, 8, 13, 21, 34, 55]
1$
    [INFO] [fibonacci_action_server]: Executing goal...
1$ ^C
"""

MONITORING = """
1$ mkdir -p ~/ros2_ws/src
1$ cd ~/ros2_ws/src
1$ ros2 pkg create --build-type ament_python --license Apache-2.0 python_parameter_event_handler --dependencies rclpy
    creating ./python_parameter_event_handler/python_parameter_event_handler
write ~/ros2_ws/src/python_parameter_event_handler/python_parameter_event_handler/parameter_event_handler.py: monitor
entry python_parameter_event_handler: node_with_parameters = python_parameter_event_handler.parameter_event_handler:main
1$ cd ~/ros2_ws
1$ rosdep install -i --from-path src --rosdistro $ROS_DISTRO -y
    #All required rosdeps installed successfully
1$ colcon build --packages-select python_parameter_event_handler
    Summary: 1 package finished
1$ . install/setup.bash
1$ ros2 run python_parameter_event_handler node_with_parameters
2$ ros2 run demo_nodes_cpp parameter_blackboard
    ready
3$ ros2 param set node_with_parameters an_int_param 43
    Set parameter successful
1$
    [INFO] [node_with_parameters]: Received an update to parameter: an_int_param: 43
3$ ros2 param set parameter_blackboard a_double_param 3.45
    Set parameter successful
1$
    [INFO] [node_with_parameters]: Received an update to parameter: a_double_param: 3.45
2$ ^C
1$ ^C
"""

MANAGED = """
1$ ros2 run lifecycle lifecycle_talker
2$ ros2 lifecycle get /lc_talker
    unconfigured [1]
2$ ros2 lifecycle set /lc_talker configure
    Transitioning successful
1$
    [INFO] [lc_talker]: on_configure() is called.
    Lifecycle publisher is inactive. Messages are not published.
2$ ros2 lifecycle set /lc_talker activate
    Transitioning successful
1$
    Lifecycle publisher is active. Publishing: [Lifecycle HelloWorld #
2$ ros2 lifecycle list lc_talker
    - deactivate [4]
    Start: active
    Goal: deactivating
2$ ros2 lifecycle list lc_talker -a
    Start: unconfigured
2$ ros2 topic echo /lifecycle_chatter --once
    data: 'Lifecycle HelloWorld #
2$ ros2 lifecycle set /lc_talker deactivate
    Transitioning successful
2$ ros2 lifecycle set /lc_talker cleanup
    Transitioning successful
2$ ros2 lifecycle set /lc_talker shutdown
    Transitioning successful
2$ ros2 lifecycle get /lc_talker
    finalized [4]
1$ ^C
"""

INTROSPECTION = """
1$ ros2 run demo_nodes_cpp introspection_service
2$ ros2 run demo_nodes_cpp introspection_client
    [INFO] [introspection_client]: Result of add_two_ints: 5
1$
    [INFO] [introspection_service]: Incoming request
    a: 2 b: 3
3$ ros2 param set /introspection_service service_configure_introspection contents
    Set parameter successful
3$ ros2 param set /introspection_client client_configure_introspection metadata
    Set parameter successful
3$ ros2 param set /introspection_client client_configure_introspection nonsense
    Setting parameter failed: must be one of 'disabled', 'metadata', or 'contents'
3$ ros2 service echo --flow-style /add_two_ints
    event_type: REQUEST_SENT
    event_type: REQUEST_RECEIVED
    event_type: RESPONSE_SENT
    request: [{a: 2, b: 3}]
    response: [{sum: 5}]
3$ ^C
3$ ros2 param set /introspection_service service_configure_introspection disabled
    Set parameter successful
2$ ^C
1$ ^C
"""

ENVIRONMENT = """
1$ printenv | grep -i ROS
    ROS_VERSION=2
    ROS_PYTHON_VERSION=3
    ROS_DISTRO=jazzy
1$ export ROS_DOMAIN_ID=97
1$ ros2 node list
1$ echo "export ROS_DOMAIN_ID=98" >> ~/.bashrc
2$ printenv ROS_DOMAIN_ID
    98
"""

LIBRARIES = "Beginner-Client-Libraries"
TUTORIALS = [
    Tutorial("Configuring environment", "Beginner-CLI-Tools/Configuring-ROS2-Environment", ENVIRONMENT),
    Tutorial("Creating a package", f"{LIBRARIES}/Creating-Your-First-ROS2-Package", PACKAGE),
    Tutorial(
        "Writing a simple publisher and subscriber (Python)",
        f"{LIBRARIES}/Writing-A-Simple-Py-Publisher-And-Subscriber",
        PUBSUB,
    ),
    Tutorial(
        "Writing a simple service and client (Python)", f"{LIBRARIES}/Writing-A-Simple-Py-Service-And-Client", SRVCLI
    ),
    Tutorial("Creating custom msg and srv files", f"{LIBRARIES}/Custom-ROS2-Interfaces", CUSTOM),
    Tutorial("Using parameters in a class (Python)", f"{LIBRARIES}/Using-Parameters-In-A-Class-Python", PARAMETER),
    Tutorial("Using `ros2doctor` to identify issues", f"{LIBRARIES}/Getting-Started-With-Ros2doctor", DOCTOR),
    Tutorial(
        "Creating an action; writing an action server and client (Python)", "Intermediate/Creating-an-Action", ACTION
    ),
    Tutorial(
        "Monitoring for parameter changes (Python)", "Intermediate/Monitoring-For-Parameter-Changes-Python", MONITORING
    ),
    Tutorial("Managing nodes with managed lifecycles", "Demos/Managed-Nodes", MANAGED),
    Tutorial("Configuring service introspection", "Demos/Service-Introspection", INTROSPECTION),
]
