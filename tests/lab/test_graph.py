"""The graph, from the kernel's side: who is there and what passes between them, as they come and go."""

from tests.browser.pages import SERVER, TWIN
from tests.lab.client import Client

CROWD = """import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String

rclpy.init()
executor = SingleThreadedExecutor()
for number in range(50):
    node = Node(f'node_{number}', start_parameter_services=False, enable_rosout=False)
    node.create_publisher(String, f'topic_{number}', 1)
    node.create_subscription(String, f'topic_{(number + 1) % 50}', print, 1)
    executor.add_node(node)
executor.spin()
"""


def graph_until(page: Client, there: object) -> dict:
    """The first graph for which `there` holds."""
    while not there(graph := page.event()["data"]):
        pass
    return graph


def test_nodes_and_what_passes_between_them_come_and_go(kernel, page):
    page.subscribe("graph")
    assert page.event()["data"] == {"nodes": [], "things": [], "edges": []}
    (kernel.folder / "greeter.py").write_text(SERVER)
    kernel.run("ros.start('greeter.py')")
    served = ["/greeter", "serves", "service", "/greet"]
    graph = graph_until(page, lambda graph: served in graph["edges"])
    assert graph["nodes"] == ["/greeter"]
    assert graph["things"] == [["service", "/greet", "std_srvs/srv/Trigger"]]
    kernel.run(
        "from rclpy.node import Node\nfrom std_srvs.srv import Trigger\n"
        "class Caller(Node): pass\n"
        "client = ros.start(Caller, 'caller').node.create_client(Trigger, '/greet')"
    )
    called = ["/caller", "calls", "service", "/greet"]
    graph = graph_until(page, lambda graph: called in graph["edges"] and served in graph["edges"])
    assert graph["nodes"] == ["/caller", "/greeter"]
    kernel.run("ros.stop()")
    graph_until(page, lambda graph: graph == {"nodes": [], "things": [], "edges": []})


def test_nodes_of_one_name_are_told(kernel, page):
    (kernel.folder / "twin.py").write_text(TWIN)
    kernel.run(
        "import subprocess, sys\nros.start('twin.py')\n"
        "outside = subprocess.Popen([sys.executable, 'twin.py'], start_new_session=True)"
    )
    page.subscribe("graph")
    graph = graph_until(page, lambda graph: "twins" in graph)
    assert (graph["nodes"], graph["twins"]) == (["/twin"], {"/twin": 2})
    kernel.run("outside.terminate()")
    graph = graph_until(page, lambda graph: "twins" not in graph)
    assert graph["nodes"] == ["/twin"]
    kernel.run("ros.stop()")


def test_what_every_node_has_and_the_courses_own_are_shown_when_asked_for(kernel, page):
    (kernel.folder / "greeter.py").write_text(SERVER)
    kernel.run("ros.start('greeter.py')")
    page.subscribe("graph", everything=True)
    asked = ["/greeter", "serves", "service", "/greeter/get_parameters"]
    graph = graph_until(page, lambda graph: asked in graph["edges"])
    assert "/_course_session" in graph["nodes"]
    kernel.run("ros.stop()")


def test_a_graph_without_end_is_told_in_part_with_how_much_is_left_out(kernel, page):
    page.subscribe("graph")
    kernel.run(
        "from rclpy.node import Node\nfrom std_msgs.msg import String\n"
        "class Many(Node): pass\n"
        "node = ros.start(Many, 'many').node\n"
        "made = [node.create_publisher(String, f'topic_{number}', 1) for number in range(320)]"
    )
    graph = graph_until(page, lambda graph: graph.get("left_out") == 20)
    assert len(graph["things"]) == len(graph["edges"]) == 300
    kernel.run("ros.stop()")


def test_fifty_nodes_are_told_and_the_end_of_the_session(kernel, page):
    (kernel.folder / "crowd.py").write_text(CROWD)
    page.subscribe("graph")
    kernel.run("ros.start('crowd.py')")
    graph = graph_until(page, lambda graph: len(graph["edges"]) == 100)
    assert len(graph["nodes"]) == len(graph["things"]) == 50
    kernel.run("ros.close()")
    graph_until(page, lambda graph: graph["nodes"] is None)
