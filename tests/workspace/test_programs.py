"""`programs.py`, which runs the official examples: who talks with whom."""

import pytest

from tests.workspace.programs import Program, partner

EVERYBODY = [
    Program("minimal_client", "client"),
    Program("minimal_client", "client_async"),
    Program("minimal_service", "service"),
    Program("minimal_action_server", "server"),
    Program("minimal_action_client", "client"),
    Program("demo", "talker"),
    Program("demo", "talker_qos"),
    Program("demo", "listener"),
    Program("demo", "listener_qos"),
    Program("monitor", "topic_monitor"),
    Program("monitor", "data_publisher"),
    Program("alone", "composed"),
]


@pytest.mark.parametrize(
    ("program", "other"),
    [
        (Program("minimal_client", "client_async"), Program("minimal_service", "service")),
        (Program("minimal_service", "service"), Program("minimal_client", "client")),
        (Program("minimal_action_client", "client"), Program("minimal_action_server", "server")),
        (Program("demo", "listener_qos"), Program("demo", "talker_qos")),
        (Program("demo", "talker"), Program("demo", "listener")),
        (Program("monitor", "topic_monitor"), Program("monitor", "data_publisher")),
        (Program("alone", "composed"), None),
        (Program("demo_nodes_py", "async_param_client"), Program("demo_nodes_cpp", "parameter_blackboard")),
    ],
)
def test_a_program_runs_beside_the_one_it_talks_with(program, other):
    assert partner(program, EVERYBODY) == other
