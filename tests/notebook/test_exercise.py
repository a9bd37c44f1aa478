"""`%%exercise` in a real kernel: files written, programs restarted, mistakes told in one line."""

import json
from pathlib import Path

import nbformat
import pytest

from course.errors import ExerciseError
from course.notebook import exercise_magic
from course.notebook.judging import as_it_lies
from course.notebook.progress import progress
from tests.kernels import Kernel

SERVER = """%%exercise server.py
import rclpy
from my_package.srv import Ask
from rclpy.node import Node
rclpy.init()
node = Node('asked')
def answer(request, response):
    response.b = request.a {sign} 1
    return response
node.create_service(Ask, 'ask', answer)
try:
    rclpy.spin(node)
except BaseException:
    pass
"""


@pytest.fixture(scope="module")
def kernel(tmp_path_factory):
    kernel = Kernel(tmp_path_factory.mktemp("notebook"))
    kernel.run("import course\nros = course.live()")
    yield kernel
    kernel.stop()


def test_an_interface_is_written_built_and_importable(kernel):
    assert kernel.run("%%exercise Ask.srv\nint32 a\n---\nint32 b\n") == "Ask.srv: written, built as my_package/srv/Ask"
    assert (kernel.folder / "Ask.srv").read_text() == "int32 a\n---\nint32 b\n"
    assert kernel.run("from my_package.srv import Ask\nprint(Ask.Request())") == "my_package.srv.Ask_Request(a=0)"


def test_a_warning_quotes_the_line_of_the_cell_and_not_of_the_file_before(kernel):
    cell = "%%exercise warned.py --no-start\nanswer = 42\nif answer == 42:\n    pass\n"
    assert "Warning" not in kernel.run(cell)
    assert "warned.py:2: SyntaxWarning" in (told := kernel.run(cell.replace("==", "is"))) and "if answer is 42:" in told


@pytest.mark.parametrize(
    ("cell", "told"),
    [
        ("# mine\n\n%%exercise Ask.srv\nint32 a\n---\n", "`%%exercise Ask.srv` must be the first line of its cell"),
        (
            "%%excercise --help\nint32 = 1\n",
            "There is no `%%excercise`. Write `%%exercise --help`. Nothing was written.",
        ),
        ("%% exercise server.py\nint32 = 1\n", "Write `%%exercise server.py`, without a space after `%%`."),
        ("ros2 service list", "Hint: This line is for a shell: in a cell, write it with `!`: `!ros2 service list`"),
        ("rosservice list", "Hint: `rosservice` is from ROS 1. In ROS 2: `ros2 service list`."),
        ("if a:\n    pass\nelse if b:\n    pass", "Hint: In Python, `else if` is one word: `elif`."),
        (
            "%%exercise client.py\nimport sys\nsys.exit('Usage: client.py A')\n",
            "begin its cell with `%%exercise client.py --no-start`",
        ),
    ],
)
def test_a_first_line_that_is_wrong_is_told(kernel, cell, told):
    assert told in kernel.run(cell)


def test_an_exercise_line_in_a_text_is_a_text(kernel):
    assert kernel.run("print('''# mine\n%%exercise a.py''')") == "# mine\n%%exercise a.py"


def test_a_server_is_replaced_when_its_cell_runs_again(kernel):
    kernel.run("%%exercise Ask.srv\nint32 a\n---\nint32 b\n")
    for sign, expected in (("+", "6"), ("-", "4"), ("-", "4")):
        assert kernel.run(SERVER.format(sign=sign)) == "server.py: written, running as /asked"
        assert kernel.run("from my_package.srv import Ask\nprint(ros.call('ask', Ask, a=5).b)") == expected
    assert kernel.run("print(ros.nodes())") == "['/asked']"


def test_what_a_cell_starts_has_no_coloured_traceback(kernel):
    """From Python 3.13 on it would have: a kernel asks every program for colours, and hints read the traceback."""
    broken = "import subprocess, sys\nprint(repr(subprocess.getoutput(f'{sys.executable} -c 1/0')))"
    assert "\\x1b" not in kernel.run(broken)
    assert kernel.run("import os\nprint(os.environ['FORCE_COLOR'], os.environ.get('PYTHON_COLORS'))") == "1 0"


def test_a_client_is_only_written_and_runs_in_the_kernels_domain(kernel):
    kernel.run("%%exercise Ask.srv\nint32 a\n---\nint32 b\n")
    kernel.run(SERVER.format(sign="+"))
    out = kernel.run("""%%exercise client.py --no-start
import rclpy
from my_package.srv import Ask
rclpy.init()
node = rclpy.create_node('client')
client = node.create_client(Ask, 'ask')
client.wait_for_service(5)
future = client.call_async(Ask.Request(a=1))
rclpy.spin_until_future_complete(node, future, timeout_sec=5)
print(future.result().b)
""")
    assert out == "client.py: written"
    assert (
        kernel.run("from course.notebook.terminal import terminal\nterminal('python client.py')")
        == "$ python client.py\n2"
    )


def test_a_terminal_ends_a_program_that_runs_on_with_ctrl_c(kernel):
    (kernel.folder / "on.py").write_text(
        "import time\ntry:\n    print('begun')\n    time.sleep(60)\nexcept KeyboardInterrupt:\n    open('ended', 'w')\n"
    )
    kernel.run("from course.notebook.terminal import terminal")
    assert kernel.run("terminal('python on.py', until='begun')") == "$ python on.py\nbegun\n^C"
    assert (kernel.folder / "ended").exists()
    out = kernel.run("terminal('python -c 3', 'python on.py', until='never', timeout=5)")
    late = "(stopped after 5 s: no line contained 'never')\n[exit status 124]"
    assert out == f"$ python -c 3\n$ python on.py\nbegun\n{late}"


def test_solution_marks_are_not_part_of_the_file(kernel):
    kernel.run("%%exercise marked.py --no-start\nif True:\n    ### BEGIN SOLUTION\n    a = 1\n    ### END SOLUTION\n")
    assert (kernel.folder / "marked.py").read_text() == "if True:\n    a = 1\n"


@pytest.mark.parametrize(
    ("cell", "says"),
    [
        ("%%exercise broken.py\ndef f(:\n    pass\n", "ExerciseError: broken.py, line 1: invalid syntax: def f(:"),
        ("%%exercise Wrong.srv\nfloat a\n---\n", "ExerciseError: Wrong.srv, line 1: there is no type 'float'"),
        ("%%exercise ends.py\nraise SystemExit(4)\n", "NodeFailed: ends.py ended with exit status 4"),
        (
            "%%exercise\npass\n",
            "UsageError: `%%exercise` needs the name of the file to write, as in `%%exercise server.py`",
        ),
        ("%%exercise --no-start\npass\n", "`%%exercise` needs the name of the file to write, as in `%%exercise"),
        (
            "%%exercise ends.py --nostart\npass\n",
            "UsageError: `%%exercise` has no option `--nostart`. Did you mean `--no-start`? Nothing was written.",
        ),
        (
            "%%exercise ends.py --cancel-after 2\npass\n",
            "has no option `--cancel-after`. A program's own arguments come after ` -- `. Nothing was written.",
        ),
        ("%%exercise ../up.py\npass\n", "takes the name of a .py, .srv, .msg or .action file beside the notebook"),
        ("%%exercise notes.txt\nhello\n", "takes the name of a .py, .srv, .msg or .action file beside the notebook"),
    ],
)
def test_a_mistake_is_told_without_a_traceback(kernel, cell, says):
    out = kernel.run(cell)
    assert says in out and "Traceback" not in out


def test_a_wrong_definition_does_not_overwrite_the_good_one(kernel):
    kernel.run("%%exercise Kept.srv\nint32 a\n---\n")
    kernel.run("%%exercise Kept.srv\nfloat a\n---\n")
    assert (kernel.folder / "Kept.srv").read_text() == "int32 a\n---\n"


def test_an_edited_interface_does_not_end_the_kernel(kernel):
    kernel.run("%%exercise Ask.srv\nint32 a\n---\nint32 b\n")
    kernel.run(SERVER.format(sign="+"))
    assert kernel.run("from my_package.srv import Ask\nprint(ros.call('ask', Ask, a=5).b)") == "6"
    kernel.run("%%exercise Ask.srv\nint32 a\nstring why\n---\nstring reason\nint32 b\n")
    assert kernel.run(SERVER.format(sign="-")).endswith("server.py: written, running as /asked")
    assert kernel.run("from my_package.srv import Ask\nprint(ros.call('ask', Ask, a=5, why='?').b)") == "4"


def test_stop_leaves_no_node(kernel):
    assert kernel.run("ros.stop()\nprint(ros.nodes())") == "[]"


def test_a_saved_notebook_has_the_schema_that_nbformat_knows():
    for path in sorted(Path(__file__).parents[2].glob("notebooks/[!.]*/*.ipynb")):
        nbformat.validate(nbformat.read(path, 4))


def test_a_session_says_when_it_starts_a_file_that_its_cell_did_not_write(kernel):
    source = "%%exercise drifted.py\nimport rclpy\nrclpy.init()\nrclpy.spin(rclpy.create_node('drifted'))\n"
    notebook = {"cells": [{"cell_type": "code", "metadata": {}, "source": source}]}
    (kernel.folder / "drifted.ipynb").write_text(json.dumps(notebook))
    assert kernel.run(source) == "drifted.py: written, running as /drifted"
    with open(kernel.folder / "drifted.py", "a") as file:
        file.write("# edited elsewhere\n")
    assert kernel.run("_ = ros.start('drifted.py')").startswith(
        "drifted.py differs from its cell in the saved notebook"
    )
    (kernel.folder / "drifted.ipynb").unlink()


def test_a_message_and_an_action_of_ones_own_are_used_by_a_program_and_by_ros2(kernel):
    """As in the tutorials on interfaces: the action has a field of the package's own message."""
    package = "--package tutorial_interfaces"
    said = kernel.run(f"%%exercise Sphere.msg {package}\ngeometry_msgs/Point center\nfloat64 radius\n")
    assert said == "Sphere.msg: written, built as tutorial_interfaces/msg/Sphere"
    said = kernel.run(f"%%exercise Blow.action {package}\nfloat64 radius\n---\nSphere last\n---\nfloat64 now\n")
    assert said == "Blow.action: written, built as tutorial_interfaces/action/Blow"
    said = kernel.run("""%%exercise blower.py
import rclpy
from rclpy.action import ActionServer
from tutorial_interfaces.action import Blow
from tutorial_interfaces.msg import Sphere
rclpy.init()
node = rclpy.create_node('blower')
def blow(handle):
    handle.publish_feedback(Blow.Feedback(now=1.0))
    handle.succeed()
    return Blow.Result(last=Sphere(radius=handle.request.radius))
ActionServer(node, Blow, 'blow', blow)
try:
    rclpy.spin(node)
except BaseException:
    pass
""")
    assert said == "blower.py: written, running as /blower"
    sent = kernel.run("!ros2 action send_goal /blow tutorial_interfaces/action/Blow '{radius: 2.5}' --feedback")
    assert "now: 1.0" in sent and "radius: 2.5" in sent and sent.endswith("Goal finished with status: SUCCEEDED")


def test_a_file_that_was_imported_is_imported_anew_after_its_cell(kernel):
    kernel.run("%%exercise gain.py --no-start\nGAIN = 1\n")
    kernel.run("%%exercise user.py --no-start\nfrom gain import GAIN\n")
    assert kernel.run("import user\nprint(user.GAIN)") == "1"
    out = kernel.run("%%exercise gain.py --no-start\nGAIN = 2\n")
    assert "note: this notebook still uses the gain that it imported before gain.py was written again." in out
    assert kernel.run("import user\nfrom gain import GAIN\nprint(GAIN, user.GAIN)") == "2 2"
    assert kernel.run("%%exercise unused.py --no-start\nGAIN = 2\n") == "unused.py: written"


def test_a_folder_of_the_files_name_is_told(kernel):
    (kernel.folder / "taken.py").mkdir()
    said = kernel.run("%%exercise taken.py --no-start\nprint(1)\n")
    assert f"taken.py is a folder in {kernel.folder}" in said and "Rename the folder" in said


def test_a_class_that_was_written_anew_and_not_started_is_told_at_the_next_call(kernel):
    cell = """
from example_interfaces.srv import AddTwoInts
from rclpy.node import Node
class Adder(Node):
    def __init__(self):
        super().__init__("adder")
        self.create_service(AddTwoInts, "adds", self.add)
    def add(self, request, response):
        response.sum = request.a + request.b  # a comment
        return response
"""
    call = "\nprint(ros.call('adds', AddTwoInts, a=5, b=3).sum)"
    assert kernel.run(cell + "ros.start(Adder)" + call) == "8"
    assert kernel.run(cell.replace("comment", "remark") + call) == "8"
    assert "still runs the old version of the class of adder: start" in kernel.run(cell.replace(" + ", " * ") + call)
    assert kernel.run(cell.replace(" + ", " * ") + "ros.start(Adder)" + call) == "15"


def test_the_line_in_which_a_callback_of_the_notebook_hangs_is_told(kernel):
    said = kernel.run("""
import time
from example_interfaces.srv import AddTwoInts
from rclpy.node import Node
class Sleeper(Node):
    def __init__(self):
        super().__init__("sleeper")
        self.create_service(AddTwoInts, "sleeps", self.add)
    def add(self, request, response):
        time.sleep(8.0)
        return response
ros.start(Sleeper)
ros.call("sleeps", AddTwoInts, timeout=2.0)
""")
    assert "sleeper is here:\n  the cell, line 9, in add\n    time.sleep(8.0)" in said


def test_a_slip_is_told_below_its_cell(kernel):
    out = kernel.run("def f(response):\n    response.sum == 3\n")
    assert out.startswith("note: line 2: `response.sum == 3` compares, and changes nothing. To set it, write ")


def test_what_was_edited_outside_of_a_cell_is_kept_when_the_cell_runs(kernel):
    """In the kernel that wrote it, and in a later one; what a cell wrote itself needs no copy."""
    for said in ("written", "written"):
        assert kernel.run("%%exercise mine.py --no-start\nA = 1\n") == f"mine.py: {said}"
    (kernel.folder / "mine.py").write_text("A = 2  # by hand\n")
    out = kernel.run("%%exercise mine.py --no-start\nA = 3\n")
    assert "note: mine.py had been edited outside of this cell: what it contained is now in mine.edited-1.py." in out
    assert (kernel.folder / "mine.edited-1.py").read_text() == "A = 2  # by hand\n"
    assert (kernel.folder / "mine.py").read_text() == "A = 3\n"
    other = Kernel(kernel.folder)
    try:
        assert "edited" not in other.run("%%exercise mine.py --no-start\nA = 4\n")
    finally:
        other.stop()
    (kernel.folder / "Own.srv").write_text("int64 a\n---\n")
    assert "Own.edited-1.srv" in kernel.run("%%exercise Own.srv\nint32 a\n---\n")
    assert (kernel.folder / "Own.edited-1.srv").read_text() == "int64 a\n---\n"
    assert sorted(path.name for path in kernel.folder.glob("[Om]*.edited-*")) == [
        "Own.edited-1.srv",
        "mine.edited-1.py",
    ]


def test_a_cell_with_an_earlier_text_keeps_the_later_one_of_its_file(kernel):
    for text in ("A = 1", "A = 2"):
        assert kernel.run(f"%%exercise again.py --no-start\n{text}\n") == "again.py: written"
    out = kernel.run("%%exercise again.py --no-start\nA = 1\n")
    assert (
        "note: this cell has an earlier text again: what again.py contained until now is kept in again.edited-1" in out
    )
    assert (kernel.folder / "again.edited-1.py").read_text() == "A = 2\n"
    # There and back again, as by Ctrl-Z: each text is kept once.
    for text, copy in (("A = 2", "again.edited-2.py"), ("A = 1", "again.edited-1.py"), ("A = 2", "again.edited-2.py")):
        assert f"kept in {copy}." in kernel.run(f"%%exercise again.py --no-start\n{text}\n")
    assert len([*kernel.folder.glob("again.edited-*")]) == 2


def test_a_file_that_was_edited_is_not_written_over_when_no_copy_can_be_kept(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(exercise_magic, "keep_copy", full)
    (tmp_path / "mine.py").write_text("A = 2  # by hand\n")
    with pytest.raises(ExerciseError, match="Nothing was written; the file is unchanged"):
        exercise_magic.exercise("mine.py --no-start", "A = 3\n")
    assert (tmp_path / "mine.py").read_text() == "A = 2  # by hand\n"


def test_a_build_that_was_interrupted_says_that_the_file_is_as_before(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "Ask.srv").write_text("float32 a\n---\n")

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(exercise_magic, "build", interrupted)
    with pytest.raises(KeyboardInterrupt):
        exercise_magic.exercise("Ask.srv", "float64 a\n---\n")
    assert capsys.readouterr().err == "Ask.srv: not written, because the cell was interrupted\n"
    with pytest.raises(ExerciseError, match="Ask.srv is unchanged, because the last run of its cell was interrupted"):
        as_it_lies("Ask.srv")


def test_a_check_passed_means_that_it_passed_for_the_file_as_it_lies_there(tmp_path):
    def of(source, **mark):
        mark = {"grade": False, "locked": False, "solution": False} | mark
        return {"cell_type": "code", "metadata": {"nbgrader": mark}, "source": source, "outputs": []}

    source = "%%exercise part.py --no-start\nA = 1\n"
    check = "assert 'A = ' in open('part.py').read()\nprint('as asked')"
    written = of(source, solution=True, grade_id="part") | {"execution_count": 1}
    checked = of(check, grade=True, locked=True, grade_id="has-a", points=1) | {"execution_count": 2}
    (tmp_path / "part").mkdir()
    (tmp_path / "part/part.ipynb").write_text(json.dumps({"cells": [written, checked]}))

    def state():
        return progress(tmp_path)[0].state

    kernel = Kernel(tmp_path / "part")
    try:
        kernel.run(source)
        assert kernel.run(check) == "as asked"
        assert state() == "passed"
        (tmp_path / "part/part.py").write_text("A = 2\n")
        assert state() == "changed since the check: part.py"
        assert kernel.run(check) == "as asked"
        assert state() == "passed"
        (tmp_path / "part/part.py").write_text("B = 2\n")
        assert "AssertionError" in kernel.run(check)
        assert state() == "changed since the check: part.py"  # the saved notebook does not have the failure yet
    finally:
        kernel.stop()


def test_a_hint_names_only_what_is_on_the_page(kernel):
    """A package that a cell builds with `build(...)`, and a check's name that a cell also makes as a variable."""
    page = ['patrol = 1\nbuild("own_package", {"Patrol.action": "---\\n---\\n"})', "relay = 2"]
    cells = [
        {"cell_type": "code", "source": each, "metadata": {}, "outputs": [], "execution_count": None} for each in page
    ]
    (kernel.folder / "page.ipynb").write_text(
        json.dumps({"cells": cells, "metadata": {}, "nbformat": 4, "nbformat_minor": 5})
    )
    assert kernel.run("from own_package.action import Patrol").splitlines()[-1] == (
        'Hint: the cell of page.ipynb with the line `build("own_package", {"Patrol.action": "---\\n---\\n"})` builds '
        "own_package: run it first."
    )
    assert kernel.run("course.check(relay)").splitlines()[-1] == (
        "Hint: The name of a check is a text, in quotation marks: `course.check('relay')`."
    )
    (kernel.folder / "page.ipynb").unlink()


def test_between_a_cell_and_the_line_of_its_class_no_call_of_the_course_is_shown(kernel):
    said = kernel.run(
        "from rclpy.node import Node\nclass Late(Node):\n    def __init__(self):\n        super().__init__('late')\n"
        "        self.seen = missing_name\nros.start(Late)"
    )
    assert "ros.start(Late)" in said and "self.seen = missing_name" in said
    assert said.count("NameError: name 'missing_name' is not defined") == 1
    assert "started_nodes.py" not in said and "contextlib.py" not in said
