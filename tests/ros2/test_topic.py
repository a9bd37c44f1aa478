"""`ros2 topic` lists, shows and sends messages as ros2cli does."""

import contextlib
import re
import signal
import subprocess

import pytest

from course.ros2 import topic_statistics

TWIST = (
    "publishing #1: geometry_msgs.msg.Twist(linear=geometry_msgs.msg.Vector3(x=0.5, y=0.0, z=0.0), "
    "angular=geometry_msgs.msg.Vector3(x=0.0, y=0.0, z=1.0))\n\n"
)
INFO = """\
Type: std_msgs/msg/String

Publisher count: 1

Node name: talker
Node namespace: /
Topic type: std_msgs/msg/String
Topic type hash: RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18
Endpoint type: PUBLISHER
GID: GID
QoS profile:
  Reliability: RELIABLE
  History (Depth): UNKNOWN
  Durability: VOLATILE
  Lifespan: Infinite
  Deadline: Infinite
  Liveliness: AUTOMATIC
  Liveliness lease duration: Infinite

Subscription count: 1

Node name: listener
"""
TYPES = """\
/chatter [std_msgs/msg/String]
/cmd_vel [geometry_msgs/msg/Twist]
/heard [std_msgs/msg/String]
/numbers [std_msgs/msg/Float64MultiArray]
/parameter_events [rcl_interfaces/msg/ParameterEvent]
/rosout [rcl_interfaces/msg/Log]
"""
FLOW = """\
layout:
  dim: []
  data_offset: 0
data: [0.5, 0.5, '...']
---
"""
IMU = "0,0,," + ",".join(["0.0,0.0,0.0,1.0", *["0.0"] * (9 + 3 + 9 + 3 + 9)]) + "\n"
NUMBERS = """\
layout:
  dim: []
  data_offset: 0
data:
- 0.5
- 0.5
- '...'
---
"""


def test_list_type_and_find(ros2):
    """Names, types, counts, and from a type back to the names."""
    assert ros2.outputs(
        "topic list", "topic list -t", "topic list -c", "topic type /chatter", "topic find std_msgs/msg/String"
    ) == [
        "/chatter\n/cmd_vel\n/heard\n/numbers\n/parameter_events\n/rosout\n",
        TYPES,
        "6\n",
        "std_msgs/msg/String\n",
        "/chatter\n/heard\n",
    ]


def test_list_makes_no_node_of_its_own(ros2):
    """To load the parts of a node takes as long as all the rest."""
    done = ros2("topic", "list", "-t", PYTHONPROFILEIMPORTTIME="1")
    counted = ros2("topic", "list", "-v", PYTHONPROFILEIMPORTTIME="1")
    loaded = [{line.rpartition("|")[2].strip() for line in each.stderr.splitlines()} for each in (done, counted)]
    assert done.stdout == TYPES and "rclpy" in loaded[0]
    assert ["rclpy.node" in modules for modules in loaded] == [False, True]


def test_list_tells_publishers_and_subscribers(ros2):
    """`-v` has a section for each."""
    said = ros2.output("topic", "list", "-v")
    assert said.startswith("Published topics:\n * /chatter [std_msgs/msg/String] 1 publisher\n * /heard")
    assert said.endswith(
        "\n\nSubscribed topics:\n * /chatter [std_msgs/msg/String] 1 subscriber\n"
        " * /cmd_vel [geometry_msgs/msg/Twist] 1 subscriber\n\n"
    )


def test_a_domain_without_nodes_has_the_command_s_own_topics(alone):
    """As in ros2cli, whose node has them too."""
    assert alone.output("topic", "list") == "/parameter_events\n/rosout\n"


def test_info(ros2):
    """Counts, and with -v each endpoint as rclpy describes it."""
    short, verbose = ros2.outputs("topic info /chatter", "topic info /chatter -v")
    assert short == "Type: std_msgs/msg/String\nPublisher count: 1\nSubscription count: 1\n"
    assert re.sub(r"GID: [0-9a-f.]+", "GID: GID", verbose).startswith(INFO)


def test_an_unknown_topic(ros2):
    """`info` and `echo` say so, `type` fails silently, all with status 1."""
    info, its_type, echo = ros2.each("topic info /nope", "topic type /nope", "topic echo /nope")
    assert (info.returncode, info.stdout, info.stderr) == (1, "", "Unknown topic '/nope'\n")
    assert (its_type.returncode, its_type.stdout, its_type.stderr) == (1, "", "")
    assert (echo.returncode, echo.stdout, echo.stderr) == (
        1,
        "WARNING: topic [/nope] does not appear to be published yet\n",
        "Could not determine the type for the passed topic\n",
    )


def test_a_misspelt_topic_or_type_is_told_with_the_near_one(ros2):
    topic, kind = ros2.each("topic echo /chater --once", "topic echo /chatter std_msgs/msg/Strin --once")
    assert topic.stderr.startswith("Did you mean /chatter?\n"), topic.stderr
    assert kind.stderr == "Did you mean std_msgs/msg/String?\nThe passed message type is invalid\n"


def test_echo_prints_a_message_in_yaml(ros2):
    """One message, a field of it, arrays cut or described, and comma separated values."""
    assert ros2.outputs(
        "topic echo --once /chatter",
        "topic echo --once /chatter std_msgs/msg/String --qos-reliability reliable",
        "topic echo --once /chatter --field data",
        "topic echo --once /chatter --no-str",
        "topic echo --once /numbers --truncate-length 2",
        "topic echo --once /numbers --no-arr --csv",
        "topic echo --once /numbers --truncate-length 2 --flow-style",
    ) == [
        "data: Hello\n---\n",
        "data: Hello\n---\n",
        "Hello\n---\n",
        "data: '<string length: <5>>'\n---\n",
        NUMBERS,
        "<sequence type: std_msgs/msg/MultiArrayDimension, length: 0>,0,<sequence type: double, length: 200>\n",
        FLOW,
    ]


def test_echo_filters_in_python(ros2):
    """`--filter` sees the message as `m`; what is no Python, or no field, is one line."""
    kept, dropped, broken, no_field = ros2.each(
        "topic echo --once /chatter --filter 'm.data.startswith(\"Hel\")'",
        "topic echo /chatter --filter 'm.data == 1' --timeout 0.5",
        "topic echo /chatter --filter 'm.data =='",
        "topic echo /chatter --field nothing",
    )
    assert (kept.returncode, kept.stdout) == (0, "data: Hello\n---\n")
    assert (dropped.returncode, dropped.stdout, dropped.stderr) == (0, "", "")
    assert broken.returncode == 1 and broken.stderr.startswith("Invalid filter expression 'm.data =='")
    assert (no_field.returncode, no_field.stderr) == (
        1,
        "Invalid field 'nothing': 'String' object has no attribute 'nothing'\n",
    )


def test_echo_ends_with_ctrl_c(ros2):
    """Status 2, as ros2cli, which returns the number of SIGINT; no traceback."""
    status, said, errors = ros2.interrupted("topic", "echo", "/chatter", after="---")
    assert (status, errors) == (2, "")
    assert said.startswith("data: Hello\n---\n")


def test_echo_into_a_pipe_that_closes(ros2):
    """`| head -1` leaves no traceback."""
    command = " ".join(ros2.words("topic", "echo", "/chatter")) + " | head -1"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, timeout=20, env=ros2.environment)
    assert (done.stdout, done.stderr) == ("data: Hello\n", "")


def test_hz_prints_the_rate(ros2):
    """The talker publishes twenty times a second; the form is ros2cli's."""
    status, said, errors = ros2.interrupted("topic", "hz", "/chatter", after="window")
    assert (status, errors) == (2, "")
    form = r"average rate: ([\d.]+)\n\tmin: [\d.]+s max: [\d.]+s std dev: [\d.]{7}s window: \d+\n"
    rate = float(re.match(form, said)[1])
    assert 10 < rate < 30


def test_hz_waits_for_a_topic(alone):
    """It says so once, and waits."""
    line = "WARNING: topic [/nope] does not appear to be published yet\n"
    assert alone.interrupted("topic", "hz", "/nope", after="WARNING") == (2, line, "")


def test_pub_is_heard_by_a_subscriber(ros2):
    """`--once` waits for the subscriber, publishes, and leaves when the message has."""
    echo = ros2.start("topic", "echo", "--once", "/heard")
    pub = ("topic", "pub", "--once", "/cmd_vel", "geometry_msgs/msg/Twist", "{linear: {x: 0.5}, angular: {z: 1.0}}")
    said = ros2.output(*pub)
    lines = said.split("publisher: beginning loop\n")
    assert lines[0] in ("", "Waiting for at least 1 matching subscription(s)...\n")
    assert lines[1] == TWIST
    # The echo may have come too late for the first; a second message reaches it surely.
    while echo.poll() is None:
        ros2(*pub)
    assert echo.communicate()[0] == "data: 0.5 1.0\n---\n"


def test_pub_repeats(ros2):
    """`-t` counts, `-r` is the rate, `-p` prints only each n-th; without them it goes on until Ctrl-C."""
    counted = ros2.output(
        "topic", "pub", "-t", "3", "-r", "100", "-p", "3", "/cmd_vel", "geometry_msgs/msg/Twist", "{linear: {x: 1}}"
    )
    assert counted.partition("beginning loop\n")[2].startswith("publishing #3: geometry_msgs.msg.Twist(linear=")
    status, said, errors = ros2.interrupted(
        "topic", "pub", "-r", "100", "/shout", "std_msgs/String", "data: hi", after="publishing #3"
    )
    assert (status, errors) == (2, "")
    assert said.startswith("publisher: beginning loop\npublishing #1: std_msgs.msg.String(data='hi')\n\n")


def test_pub_gives_up_waiting_for_a_subscriber(ros2):
    """ros2cli's message, its spelling included."""
    done = ros2("topic", "pub", "-1", "--max-wait-time-secs", "0.2", "/alone", "std_msgs/msg/String")
    assert (done.returncode, done.stdout, done.stderr) == (
        1,
        "Waiting for at least 1 matching subscription(s)...\n",
        "Timed out waiting for subscribers: Expected 1 subcribers but only got 0 subscribers\n",
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("/x nowhere/msg/No", "The passed message type is invalid\n"),
        ("/x std_msgs/msg/String '{text: hi}'", "Failed to populate field: 'String' object has no attribute 'text'\n"),
        (
            "/x std_msgs/msg/Float64MultiArray '{data: 1.5}'",
            "Failed to populate field: 'data' takes a list, even for a single value: data: [1.5]\n",
        ),
        ("/x std_msgs/msg/Float64 '{data: [1]}'", "Failed to populate field: "),
        ("/x std_msgs/msg/String hi", "The passed value needs to be a dictionary in YAML format\n"),
        ("/x std_msgs/msg/String '{a: ['", "The passed value needs to be a dictionary in YAML format\n"),
        ("'/no good' std_msgs/msg/String", "Invalid topic name: topic name must not contain characters other than"),
    ],
)
def test_pub_refuses_what_it_cannot_send(ros2, words, message):
    """One message, status 1, no traceback."""
    (done,) = ros2.each(f"topic pub --once {words}")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith(message)


@contextlib.contextmanager
def published(command, *lines: str):
    """Have `topic pub` send messages, one process for each line, and end them with Ctrl-C."""
    children = [command.start("topic", "pub", "-r", "20", *line.split(maxsplit=2)) for line in lines]
    try:
        for child in children:
            assert child.stdout.readline() == "publisher: beginning loop\n"
        yield
    finally:
        for child in children:
            child.send_signal(signal.SIGINT)
            child.communicate(timeout=20)


def test_echo_csv_of_arrays(alone):
    """A float64[9] is nine columns, an empty array is none when nothing stands before it, as in ros2cli."""
    with published(alone, "/imu sensor_msgs/msg/Imu", "/empty std_msgs/msg/Float64MultiArray"):
        assert alone.outputs("topic echo --once --csv /imu", "topic echo --once --csv /empty") == [IMU, "0,\n"]


def test_a_topic_with_two_types(alone):
    """`type` prints both, `echo` does not choose one."""
    with published(alone, "/both std_msgs/msg/String", "/both std_msgs/msg/Int32"):
        assert alone.output("topic", "type", "/both") == "std_msgs/msg/Int32\nstd_msgs/msg/String\n"
        done = alone("topic", "echo", "/both")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == (
        "Cannot echo topic '/both', as it contains more than one type: [std_msgs/msg/Int32, std_msgs/msg/String]\n"
    )


def test_bw_prints_bytes_a_second(ros2):
    """The talker's messages have 16 bytes each; the form is ros2cli's."""
    status, said, errors = ros2.interrupted("topic", "bw", "/chatter", after="mean")
    assert (status, errors) == (2, "")
    form = r"Subscribed to \[/chatter\]\n(\d+) B/s from \d+ messages\n\tMessage size mean: 16 B min: 16 B max: 16 B\n"
    assert 100 < int(re.match(form, said)[1]) < 500


@pytest.mark.parametrize(
    ("sizes", "text"),
    [
        ([100, 300], "400 B/s from 2 messages\n\tMessage size mean: 200 B min: 100 B max: 300 B"),
        ([500, 1500], "2.00 KB/s from 2 messages\n\tMessage size mean: 1.00 KB min: 0.50 KB max: 1.50 KB"),
        ([2500000], "2.50 MB/s from 1 messages\n\tMessage size mean: 2.50 MB min: 2.50 MB max: 2.50 MB"),
    ],
)
def test_the_unit_of_bw_is_that_of_the_rate(sizes, text):
    """Bytes, then thousands, then millions, for every number of a line."""
    assert topic_statistics.bandwidth(sizes, 1.0) == text


def test_delay_prints_the_age_of_messages(alone):
    """The time since the stamp in the header; `auto` sets it to the time of sending."""
    with published(alone, "/point geometry_msgs/msg/PointStamped {header: auto}"):
        status, said, errors = alone.interrupted("topic", "delay", "/point", after="window")
    assert (status, errors) == (2, "")
    form = r"average delay: (-?[\d.]+)\n\tmin: -?[\d.]+s max: [\d.]+s std dev: [\d.]{7}s window: \d+\n"
    assert float(re.match(form, said)[1]) < 1.0


def test_delay_needs_a_header(ros2):
    """ros2cli's message, without its traceback."""
    done = ros2("topic", "delay", "/chatter")
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "msg does not have header\n")
