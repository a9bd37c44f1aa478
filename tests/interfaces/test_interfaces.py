"""Interface packages: the released types, and a student's own definition built at run time."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from course import environment
from course.interfaces import InterfaceError, build, parse
from course.interfaces.install import PACKAGES, provided_elsewhere

CALCULATE = (Path(__file__).parents[2] / "solutions/calculator/Calculate.srv").read_text()

# `ros2 interface show` of the released Jazzy packages has these RIHS01 hashes (REP 2016).
RELEASED = {
    "srv/AddTwoInts": "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a",
    "action/Fibonacci": "RIHS01_9508051da1ea4658de144b09bd0690ff3de52104683d847aed764d2915906f51",
}


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.mark.parametrize("name", RELEASED)
def test_example_interfaces_talk_to_released_nodes(name):
    file = Path(sys.prefix) / "share/example_interfaces" / f"{name}.json"
    if not file.exists():
        pytest.skip("a sourced ROS 2 provides example_interfaces")
    hashes = {entry["type_name"]: entry["hash_string"] for entry in json.loads(file.read_text())["type_hashes"]}
    assert hashes[f"example_interfaces/{name}"] == RELEASED[name]


def test_course_fibonacci_has_the_chapters_feedback():
    from course_interfaces.action import Fibonacci

    assert Fibonacci.Feedback.get_fields_and_field_types() == {"partial_sequence": "sequence<int32>"}


def test_a_sourced_installation_wins(tmp_path, monkeypatch):
    (tmp_path / "share/example_interfaces").mkdir(parents=True)
    (tmp_path / "share/example_interfaces/package.xml").touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}:{sys.prefix}")
    assert [package for package in PACKAGES if provided_elsewhere(package)] == ["example_interfaces"]


def run(code: str, cache: Path) -> str:
    """Run `code` in an interpreter of its own, as a kernel would: importing a build changes the process."""
    done = subprocess.run([sys.executable, "-c", code, str(cache)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout


# What ends a comment of C or of Python, or a line of a template, with code behind it; and what a terminal obeys.
COMMENTS = ("*/ int owned(void) { return 1; } /*", '""" + exit() + """', "@[if x", "C:\\users", "\x1b[2J\u202e", "\\")
ABOVE = "".join(f"# {comment}\n" for comment in COMMENTS)
BESIDE = "".join(f"int32 {name} # {comment}\n" for name, comment in zip("abcdef", COMMENTS, strict=True))
COMMENTED = f"{ABOVE}{BESIDE}---\n{ABOVE}int32 K=1 # {COMMENTS[0]}\n{BESIDE}{ABOVE}"
ONCE = {"Calculate.srv": CALCULATE, "Ask.srv": COMMENTED}


def test_the_generators_share_what_each_would_do_again(tmp_path, monkeypatch):
    """Each definition is parsed once, and those of all packages are looked for once."""
    import em
    from rosidl_cli.command import helpers
    from rosidl_parser import parser

    from course.interfaces.generate import generate, spare_what_is_repeated

    asked = []

    def counted(original):
        def call(argument):
            asked.append(original.__name__)
            return original(argument)

        return call

    shared = [(parser, "get_ast_from_idl_string"), (helpers, "dependencies_from_include_paths")]
    for owner, name in [*shared, (em.Scanner, "check")]:
        original = getattr(owner, name)
        monkeypatch.setattr(owner, name, original if owner is em.Scanner else counted(original))
    spare_what_is_repeated()
    (tmp_path / "source/msg").mkdir(parents=True)
    (tmp_path / "source/msg/Told.msg").write_text("string words 'a \"quoted\" word'\n")
    generate("told", *(tmp_path / name for name in ("source", "idl", "output")))
    assert sorted(asked) == sorted(name for _, name in shared)
    assert r'"a \"quoted\" word"' in (tmp_path / "output/told/msg/detail/told__functions.c").read_text()


def test_a_build_is_importable_at_once_and_by_children(cache):
    out = run(
        f"""
import subprocess, sys
from pathlib import Path
from course.interfaces import build
build("calculator_interfaces", {ONCE!r}, cache=Path(sys.argv[1]))
from calculator_interfaces.srv import Calculate
print(Calculate.Request(a=1.0, operation="add"))
child = "from calculator_interfaces.srv import Calculate; print(Calculate.Response(success=True))"
print(subprocess.run([sys.executable, "-c", child], capture_output=True, text=True, check=True).stdout)
""",
        cache,
    )
    assert "Calculate_Request(a=1.0, b=0.0, operation='add')" in out
    assert "Calculate_Response(result=0.0, success=True, message='')" in out


def test_a_comment_is_no_code_and_stands_in_no_help(cache):
    """A cell's help shows a type by its fields; the definition keeps its comments."""
    out = run(
        f"""
import ctypes, pydoc, sys
from pathlib import Path
from course.interfaces import build
built = build("calculator_interfaces", {ONCE!r}, cache=Path(sys.argv[1]))
from calculator_interfaces.srv import Ask
print(Ask.Request(f=1), Ask.Response.K)
for part in (Ask, Ask.Request, Ask.Response):
    said = pydoc.render_doc(part, renderer=pydoc.plaintext)
    assert "class Ask" in said and not [comment for comment in {COMMENTS!r} if comment[:-1] and comment in said]
print([hasattr(ctypes.CDLL(str(library)), "owned") for library in sorted((built.prefix / "lib").glob("*.so"))])
print((built.prefix / "share/calculator_interfaces/srv/Ask.srv").read_text() == {COMMENTED!r})
""",
        cache,
    )
    assert out.splitlines() == [
        "calculator_interfaces.srv.Ask_Request(a=0, b=0, c=0, d=0, e=0, f=1) 1",
        "[False, False, False]",
        "True",
    ]


def test_the_same_definition_is_compiled_once(cache, monkeypatch):
    build("calculator_interfaces", ONCE, cache=cache, use=False)
    monkeypatch.setattr("course.interfaces.builder._build", lambda *args: pytest.fail("compiled again"))
    build("calculator_interfaces", ONCE, cache=cache, use=False)


ENDED = (
    "'asking' was ended: it uses edited, which has been built again. Run the cells that import from edited and define "
    "Asking, and then start it again, with ros.start(Asking)."
)
FIRST = {
    "Pair.msg": "geometry_msgs/Point left\nfloat64[3] right\n",
    "Swap.srv": "Pair[] pairs\n---\nint32 count\n",
    "Count.action": "int32 to\n---\nstd_msgs/Header header\n---\nint32[] seen\n",
}
EDITED = {"Swap.srv": "string question\n---\nstring answer\n"}


def test_messages_actions_and_types_of_other_packages_are_carried_until_an_edited_definition_replaces_them(cache):
    """In a live session: what it has loaded of the package goes."""
    out = run(
        f"""
import sys
from pathlib import Path
from course.interfaces import build
from course.session.live import Session
build("edited", {FIRST!r}, cache=Path(sys.argv[1]))
from rclpy.action import ActionServer
from rclpy.node import Node
from edited.msg import Pair
from edited.srv import Swap
from edited.action import Count
session = Session()
ActionServer(session.node, Count, "count", lambda goal: Count.Result())
def count(request, response):
    response.count = len(request.pairs)
    return response
session.node.create_service(Swap, "swap", count)
class Asking(Node):
    def __init__(self):
        super().__init__("asking")
        self.client = self.create_client(Swap, "swap")
session.start(Asking)
print(session.call("swap", Swap, pairs=[Pair(), Pair()]).count, Count.Feedback())
build("edited", {EDITED!r}, cache=Path(sys.argv[1]))
from edited.srv import Swap
def shout(request, response):
    response.answer = request.question.upper()
    return response
session.node.create_service(Swap, "new", shout)
print(session.call("new", Swap, question="why").answer, session.nodes())
print(session.watch.notices()[0])
session.close()
""",
        cache,
    )
    assert out.splitlines() == ["2 edited.action.Count_Feedback(seen=[])", "WHY []", ENDED]


@pytest.mark.matrix  # the test of an edited definition would find the old build
def test_the_cache_is_keyed_by_content(cache):
    first = build("keyed", {"A.srv": "int32 a\n---\n"}, cache=cache, use=False)
    second = build("keyed", {"A.srv": "int64 a\n---\n"}, cache=cache, use=False)
    assert first.prefix != second.prefix


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("A.srv", "float a\n---\n", "A.srv, line 1: there is no type 'float'; did you mean float32 or float64?"),
        (
            "A.srv",
            "float64 a b\n---\n",
            "A.srv, line 1: only one field per line; 'b' would be the default of 'a', but is not a valid float64",
        ),
        ("A.srv", "float64 a\nstring\n---\n", "A.srv, line 2: a field is a type and a name"),
        (
            "A.srv",
            "float64 a\n---  # and back\n",
            "has 0. Line 2, `---  # and back`: a separator is three dashes alone",
        ),
        ("A.srv", "float64 a\n", "needs 1 line '---' between request and response, but this one has 0"),
        ("A.action", "int32 a\n---\n", "needs 2 lines '---'"),
        ("A.srv", "---\n\nint32 a, b\n", "A.srv, line 3"),
        ("A.srv", "int32 a\nint64 a\n---\n", "A.srv, line 2: the field 'a' is defined twice"),
        ("A.srv", "float64 a;\n---\n", "a field is a type and a name, without ';': write 'float64 a'"),
        ("A.srv", "float64: a\n---\n", "a field is a type and a name, without ':': write 'float64 a'"),
        ("A.srv", '"""Adds."""\n---\n', "A.srv, line 1: a comment begins with '#', and has no quotation marks"),
        ("A.srv", "int32 Upper\n---\n", "this is 'Upper': write 'upper'"),
        ("A.msg", "int8 a 300\n", "A.msg, line 1"),
        (
            "A.srv",
            "int32 a\nfloat64 class\n---\n",
            "A.srv, line 2: 'class' is a word of Python and C++, so no field can have this name: write 'class_value'",
        ),
        ("A.srv", "---\nfloat64[] from\n", "A.srv, line 2: 'from' is a word of Python, so no field"),
        ("A.action", "---\n---\nbool double\n", "A.action, line 3: 'double' is a word of C++, so no field"),
        ("A.srv", "double a\n---\n", "there is no type 'double'; did you mean float64?"),
        ("A.srv", "int a\n---\n", "there is no type 'int'; did you mean int32 or int64?"),
        (
            "A.srv",
            "Float64 a\n---\n",
            "there is no type 'Float64', and no Float64.msg beside it; did you mean float64?",
        ),
        ("A.srv", "String a\n---\n", "no String.msg beside it; did you mean string?"),
        ("A.msg", "Missing a\n", "there is no type 'Missing', and no Missing.msg beside it"),
        ("A.msg", "nowhere_msgs/Thing a\n", "no installed package has a message nowhere_msgs/Thing"),
        ("a.srv", "---\n", "must begin with a capital"),
        ("A.txt", "", "must end in .msg, .srv or .action"),
    ],
)
def test_a_wrong_definition_is_one_readable_message(name, text, says, cache):
    with pytest.raises(InterfaceError) as raised:
        build("my_package", {name: text}, cache=cache, use=False)
    assert says in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("package", ["My_Package", "a-b", "", "../up", "a__b"])
def test_a_wrong_package_name_is_refused(package, cache):
    with pytest.raises(InterfaceError, match="package"):
        build(package, {"A.srv": "---\n"}, cache=cache, use=False)


def test_a_file_that_is_not_there_is_named(cache):
    with pytest.raises(InterfaceError, match=r"cannot read .*Nowhere\.srv"):
        build("my_package", [Path("Nowhere.srv")], cache=cache, use=False)


def test_parse_tells_fields_types_and_order():
    sections = parse(CALCULATE, "Calculate.srv").sections
    assert [[(f.type, f.name) for f in section] for section in sections] == [
        [("float64", "a"), ("float64", "b"), ("string", "operation")],
        [("float64", "result"), ("bool", "success"), ("string", "message")],
    ]


def test_prepare_keeps_what_the_user_set(monkeypatch):
    monkeypatch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", "/their/own.xml")
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/opt/ros/jazzy")
    environment.prepare()
    import os

    assert os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] == "/their/own.xml"
    assert os.environ["AMENT_PREFIX_PATH"].split(":") == ["/opt/ros/jazzy", sys.prefix]
