"""Submissions that are alike: disguised copies are found among independent right answers."""

import ast
import base64
import json
import re
import subprocess
import sys
import time
import zlib
from html.parser import HTMLParser
from pathlib import Path

import pytest

from autograder import cli
from autograder.errors import UsageError
from autograder.paths import repository
from autograder.results import output
from autograder.similarity import comparing, find, presenting, sources, winnowing
from autograder.similarity.comparing import compare
from autograder.similarity.tokens import clean, tokens
from autograder.submissions import exercises
from course.foundation import cells
from tests.hidden import answers

STYLES = answers.load("calculator").RIGHT
REFERENCE = STYLES["reference"]


def lines(files: dict[str, bytes]) -> set[bytes]:
    """The lines that tell one program from another at first sight."""
    return {
        line.strip()
        for name, text in files.items()
        if name.endswith(".py")
        for line in text.splitlines()
        if len(line.strip()) > 20
    }


OTHERS: dict[str, dict[str, bytes]] = {}  # written independently of each other and of the reference
for style, handed_in in STYLES.items():
    if all(len(lines(handed_in) & lines(other)) < len(lines(handed_in)) / 3 for other in (REFERENCE, *OTHERS.values())):
        OTHERS[style] = handed_in
NOTEBOOK = repository() / "notebooks" / "calculator" / "calculator.ipynb"
HOSTILE = "</pre><script>alert(1)</script>"


class Disguise(ast.NodeTransformer):
    """New names, no comments, other docstrings and layout, methods in another order."""

    def __init__(self, tree: ast.AST):
        self.own = {
            node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
        }
        self.own |= {node.arg for node in ast.walk(tree) if isinstance(node, ast.arg)}

    def visit_Name(self, node):
        node.id = f"new_{node.id}" if node.id in self.own else node.id
        return node

    def visit_arg(self, node):
        node.arg = f"new_{node.arg}"
        return node

    def visit_Constant(self, node):
        return ast.Constant(f"{node.value}!") if isinstance(node.value, str) else node

    def visit_JoinedStr(self, node):
        return node

    def visit_ClassDef(self, node):
        self.generic_visit(node)
        node.body.sort(key=lambda each: getattr(each, "name", ""), reverse=True)
        return node


def disguised(text: str) -> str:
    tree = ast.parse(text)
    return "# mine\n\n" + ast.unparse(Disguise(tree).visit(tree)).replace("    ", "\t")


def programs(files: dict[str, bytes]) -> dict[str, str]:
    return {name: text.decode(errors="replace") for name, text in files.items() if name.endswith(".py")}


def copy(files: dict[str, bytes]) -> dict[str, str]:
    return {name: disguised(text) for name, text in programs(files).items()}


@pytest.fixture(scope="module")
def known() -> list[str]:
    return sources.given("calculator")


@pytest.fixture(scope="module")
def finding(known):
    """The independent answers, and a disguised copy of two of them."""
    handed_in = [(name, programs(files)) for name, files in OTHERS.items()]
    handed_in += [("reference", programs(REFERENCE)), ("copy of the reference", copy(REFERENCE))]
    first = next(iter(OTHERS))
    return first, compare("calculator", [*handed_in, ("copy of another", copy(OTHERS[first]))], known, 1000)


def test_copies_stand_out(finding):
    first, found = finding
    assert len(OTHERS) >= 4
    ranking = [{pair.left, pair.right} for pair in found.pairs]
    copies = [{"reference", "copy of the reference"}, {first, "copy of another"}]
    assert all(pair in ranking[:2] for pair in copies)
    assert all(pair.score > 60 and pair.shared > 70 for pair in found.pairs[:2])


def test_independent_right_answers_do_not(finding):
    _, found = finding
    rest = [pair for pair in found.pairs if not {pair.left, pair.right} & {"copy of the reference", "copy of another"}]
    assert max(pair.score for pair in rest) < 30 and found.below(50) < 5


def wrapped(text: str) -> str:
    packed = base64.b64encode(zlib.compress(text.encode())).decode()
    return (
        f'import base64, zlib\ncode = zlib.decompress(base64.b64decode("{packed}"))\nexec(code, globals())\n' + NOTHING
    )


NOTHING = "".join(
    f"values_{n} = [each + {n} for each in range({n}) if each % 2] or {{'a': ({n}, print)}}\n" for n in range(9)
)


def test_what_executes_a_packed_text_is_named_and_not_compared(known):
    """Two wrappers around different texts are alike in everything that shows; that is no copy."""
    file, texts = "calculator_server.py", programs(REFERENCE)
    other = programs(OTHERS[next(iter(OTHERS))])
    handed_in = [
        ("ada", {file: texts[file]}),
        ("bob", {file: wrapped(texts[file])}),
        ("cy", {file: wrapped(other[file])}),
        ("dee", {file: wrapped(other[file])}),
        ("eve", {file: texts[file] + "\nvalue = eval('1 + 1')\ncode = b'x'.decode()\n"}),
    ]
    found = compare("calculator", handed_in, known, 100)
    assert found.hidden == [f"{student} ({file})" for student in ("bob", "cy", "dee")]
    assert found.doubtful == [f"eve ({file})"]
    alike = {(pair.left, pair.right): pair.score for pair in found.pairs}
    assert alike.keys() == {("ada", "eve"), ("cy", "dee")}  # these two are the same to the letter
    told = presenting.describe(found)
    assert "cannot be compared" in told and "bob (calculator_server.py)" in told
    assert "annot be compared" in presenting.page([found])


PACKED = """
import base64, zlib
T = zlib.decompress(base64.b64decode("{packed}")).decode()
"""
WAYS = {
    "a name put together": "import builtins\ngetattr(builtins, 'ex' + 'ec')(T)\n",
    "a function": "import types\ntypes.FunctionType(compile(T, 'm', 'exec'), globals())()\n",
    "a file": "import runpy\nopen('/tmp/x.py', 'w').write(T)\nrunpy.run_path('/tmp/x.py')\n",
    "another program": "import os, sys\nos.execv(sys.executable, [sys.executable, '-c', T])\n",
    "an interpreter": "import code\ncode.InteractiveInterpreter().runsource(T, 'm', 'exec')\n",
    "a decorator and a class": "@exec\n@lambda f: T\nclass X:\n    pass\n",
    "a loader": "import importlib.abc\nclass L(importlib.abc.InspectLoader):\n    def get_source(self, n): return T\n",
    "an import of ROS 2 that nothing uses": "import rclpy\ndef f(): return [each for each in T]\n",
    "a class for show": "import subprocess, sys\nclass X: pass\nsubprocess.run([sys.executable, '-c', T])\n",
    "ROS 2 for show": "import rclpy, ctypes\nctypes.pythonapi.PyRun_SimpleString(T.encode())\n",
}


def test_a_text_in_many_short_literals_is_named(known):
    file, text = "calculator_server.py", programs(REFERENCE)["calculator_server.py"]
    packed = base64.b64encode(zlib.compress(text.encode())).decode()
    pieces = [packed[at : at + 20] for at in range(0, len(packed), 20)]
    lines = [*(f"p{number} = {piece!r}" for number, piece in enumerate(pieces)), "class X:\n    pass", "run = [p0, p1]"]
    found = compare("calculator", [("ada", {file: text}), ("bob", {file: "\n".join(lines) + "\n"})], known, 5)
    assert (found.hidden, found.doubtful) == ([], [f"bob ({file})"])


def test_of_the_right_answers_only_those_that_execute_a_text_are_named(known):
    right = [("reference", programs(REFERENCE)), *((name, programs(files)) for name, files in OTHERS.items())]
    found = compare("calculator", right, known, 5)
    executing = [f"{name} ({file})" for name, texts in right for file, text in texts.items() if "eval(" in text]
    assert (found.hidden, found.doubtful) == ([], executing)


def named_beside_the_reference(known, lines: str) -> list[str]:
    """Return those who are named when bob hands in these lines as the server, and ada the reference."""
    file = "calculator_server.py"
    found = compare("calculator", [("ada", {file: programs(REFERENCE)[file]}), ("bob", {file: lines})], known, 5)
    return [*found.hidden, *found.doubtful]


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_a_packed_program_is_named_however_it_is_executed(known, way):
    text = programs(REFERENCE)["calculator_server.py"]
    packed = base64.b64encode(zlib.compress(text.encode())).decode()
    assert named_beside_the_reference(known, PACKED.format(packed=packed) + way) == ["bob (calculator_server.py)"]


ELSEWHERE = {  # where the text of a program may be that does not stand in its own statements
    "a comment of the interface": "from pathlib import Path\nT = Path('Calculate.srv').read_text()\n",
    "an open file": "T = next(iter(open('Calculate.srv')))\n",
    "a line of a file": "import linecache\nT = linecache.getline('Calculate.srv', 1)\n",
    "its own comments": "from inspect import getcomments\nT = getcomments(Help)\n",
    "its own docstring": "T = Help.__doc__\n",
}
RUNS = (
    "import rclpy\nrclpy.__dict__['__buil' 'tins__']['ex' 'ec'](T)\n",
    "from unittest import mock\nmock._importer('x')(T)\n",
)


@pytest.mark.parametrize("runs", RUNS, ids=["by rclpy", "by unittest"])
@pytest.mark.parametrize("reads", ELSEWHERE.values(), ids=ELSEWHERE)
def test_a_program_whose_text_is_read_from_elsewhere_is_named(known, reads, runs):
    hiding = f"class Help:\n    pass\n{reads}{runs}"
    assert named_beside_the_reference(known, hiding) == ["bob (calculator_server.py)"]


@pytest.mark.parametrize("module", ["timeit", "cProfile", "pdb", "pickle", "pkgutil", "pydoc"])
def test_a_module_that_runs_other_code_is_named(known, module):
    lines = f"import {module}\n{programs(REFERENCE)['calculator_server.py']}"
    assert named_beside_the_reference(known, lines) == ["bob (calculator_server.py)"]


@pytest.mark.parametrize("lines", ["T = {text!r}\nf = exec\nf(T)\n", '"""{text}"""\nf = exec\nf(__doc__)\n'])
def test_a_program_as_a_literal_is_named(known, lines):
    file, text = "calculator_server.py", programs(REFERENCE)["calculator_server.py"].replace('"""', "")
    found = compare("calculator", [("bob", {file: lines.format(text=text)})], known, 5)
    assert [*found.hidden, *found.doubtful] == [f"bob ({file})"]


PROGRAM = programs(REFERENCE)["calculator_server.py"].replace('"""', "'''")
SHOWN = "from rclpy.node import Node\n\n\nclass Shown(Node):\n    def add(self, a, b):\n        return a + b\n\n\n"
UNSEEN = {  # what evaluates a text without a word that says so
    "hints": "def work(x: 'run(note)'):\n    pass\n\n\nfrom typing import get_type_hints as look\nlook(work)\n",
    "a decorator": "@Shown.work.register\ndef _(x: 'list[run(note)]'):\n    pass\n",
    "a field": "class Pair:\n    x: 'run(note)'\n",
    "a result": "def work() -> 'run(note)':\n    pass\n",
    "a text put together": "def work(x: 'run' + '(note)'):\n    pass\n",
    "a text in a text": "run('print.__self__.exec(note)')\n",
    "a keyword": "import inspect\ninspect.signature(Shown.add, eval_str=True)\n",
    "other instructions": "Shown.add.__code__ = Shown.add.__code__.replace(co_code=note)\n",
    "another loader": "import rclpy\ntype(rclpy.__spec__.loader)('m', 'x.py').load_module()\n",
    "a namespace": "import rclpy\nvars(rclpy)['__loader__'].load_module()\n",
    "the loaded modules": "import sys\nvars(sys.modules['built' + 'ins'])['ex' + 'ec'](note)\n",
    "logging": "import logging.config as a\na.BaseConfigurator({}).resolve('built' + 'ins.ex' + 'ec')(note)\n",
    "a packed text": f"note = '{base64.b85encode(bytes(range(99))).decode()}'\nrun(note)\n",
}


@pytest.mark.parametrize("way", UNSEEN.values(), ids=UNSEEN)
def test_what_evaluates_a_text_is_named_wherever_the_text_is(known, way):
    assert named_beside_the_reference(known, SHOWN + way) == ["bob (calculator_server.py)"]


def test_a_long_word_of_few_letters_is_a_line(known):
    lines = f"{SHOWN * 4}print('{'=-' * 70}')\n"
    assert named_beside_the_reference(known, lines) == []


PLACES = ['"""{}"""\n', '"""A note."""\nnote = """{}"""\n', 'class Note:\n    """{}"""\n']


@pytest.mark.parametrize(
    "before", ["", "A note.\n\n", "How it began:\n\n    x = 1\n\n"], ids=["alone", "words", "code"]
)
@pytest.mark.parametrize("place", PLACES, ids=["docstring", "literal", "docstring of a class"])
def test_a_text_that_is_a_program_is_named_whatever_runs_it(known, place, before):
    names = " + ".join(f"value_{number}" for number in range(1000))  # more than all literals
    lines = place.format(before + PROGRAM) + SHOWN + f"result = work({names})\n"
    assert named_beside_the_reference(known, lines) == ["bob (calculator_server.py)"]


def test_an_ordinary_docstring_or_annotation_is_not_named(known):
    task = "\n\n".join(cell.source for cell in cells.read(NOTEBOOK) if cell.kind == "markdown").replace('"""', "")
    example = "For example:\n\n    node = Shown('a')\n    node.add(1, 2)\n\n>>> node.add(1, 2)\n3\n"
    lines = (
        f'r"""The server.\n\n{task}\n\n{example}"""\n{SHOWN}'
        "    mode: Literal['open', 'closed'] = 'open'\n    scan: 'LaserScan | None' = None\n\n"
        "    def take(self, scan: 'list[LaserScan]', *, node: Optional['Node'] = None) -> 'Shown | None':\n"
        "        self.get_logger().info('open (5)')\n        self.get_logger().info('eval')\n"
        "        self.register(scan.range_max, re.compile('a+'))\n        super().__init__(__name__)\n"
    )
    assert named_beside_the_reference(known, lines) == []


@pytest.mark.parametrize("exercise", answers.names())
def test_no_right_answer_seems_to_hide_anything(exercise):
    """One of them calls eval, and is compared all the same."""
    handed_in = {name: programs(files) for name, files in answers.load(exercise).RIGHT.items()}
    evaluating = {name for name, texts in handed_in.items() if "eval(" in "".join(texts.values())}
    found = compare(exercise, handed_in.items(), [], 1)
    assert (found.hidden, {each.partition(" (")[0] for each in found.doubtful}) == ([], evaluating)


JUNK = [
    "x = 0",
    "len('ab')",
    "y = [1, 2]",
    "assert True",
    "z = {1: 2}",
    "if False: pass",
    "a, b = 1, 2",
    "k = max(3, 4)",
    "m: dict[str, int]",
    "x: self.call(y)",
    "import sys",
    "global other",
    "lambda: self.call(y)",
    "request.a + request.b",
]


def test_statements_without_effect_hide_no_copy(known):
    """One after each statement left an eighth in common."""

    class Junk(ast.NodeTransformer):
        def generic_visit(self, node):
            super().generic_visit(node)
            for field in ("body", "orelse", "finalbody"):
                if isinstance(old := getattr(node, field, None), list):
                    setattr(node, field, [new for each in old for new in (each, *self.junk())])
            return node

        def junk(self):
            self.number = getattr(self, "number", 0) + 1
            return ast.parse(JUNK[self.number % len(JUNK)]).body

    texts = programs(REFERENCE)
    mixed = {name: ast.unparse(Junk().visit(ast.parse(text))) for name, text in texts.items()}
    handed_in = [(name, programs(files)) for name, files in OTHERS.items()]
    found = compare("calculator", [*handed_in, ("ada", texts), ("bob", mixed)], known, 1)
    assert {found.pairs[0].left, found.pairs[0].right} == {"ada", "bob"} and found.pairs[0].score > 60


def test_a_number_that_python_does_not_write_hides_no_copy_and_ends_nothing(known):
    long, file = "0x" + "f" * 4000, "calculator_server.py"
    texts = programs(REFERENCE)
    other = {**copy(REFERENCE), file: copy(REFERENCE)[file] + f"\nX = [-{long}]\n"}
    inside = {file: f"X = 'print({long})'\n\n\nclass Y:\n    x: '{long}' = 1\n"}
    found = compare("calculator", [("ada", texts), ("bob", other), ("cy", inside)], known, 1)
    assert {found.pairs[0].left, found.pairs[0].right} == {"ada", "bob"} and found.pairs[0].shared > 70


def test_what_everybody_has_counts_little(known):
    """Twelve hand in the same program; two of them share something else as well."""
    same, more = programs(REFERENCE), copy(OTHERS[next(iter(OTHERS))])
    both = same | {"calculator_client.py": same["calculator_client.py"] + more["calculator_server.py"]}
    found = compare("calculator", [(f"s{i}", same) for i in range(10)] + [("a", both), ("b", both)], known, 1000)
    assert {found.pairs[0].left, found.pairs[0].right} == {"a", "b"} and found.pairs[0].score > 30
    assert found.pairs[1].shared == 100 and found.pairs[1].score < found.pairs[0].score / 2


def test_what_was_given_is_not_compared(known):
    stubs = {f"s{i}": {"calculator_server.py": text} for i, text in enumerate(known) if "rclpy" in text}
    found = compare("calculator", stubs.items(), known, 10)
    assert len(stubs) > 5 and found.pairs == [] and set(found.scores) == {0}


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace("    ", "  "),
        lambda text: "\n".join(
            f"{line}  # {number}" if line.endswith(")") else line for number, line in enumerate(text.split("\n"))
        ),
        lambda text: f'"""Mine."""\n{text}',
        lambda text: text.replace("self", "this").replace("request", "asked"),
    ],
)
def test_layout_comments_and_names_are_nothing(change):
    text = programs(REFERENCE)["calculator_server.py"]
    kinds = [token.kind for token in tokens(clean(text))]
    assert len(kinds) > 100
    assert [token.kind for token in tokens(clean(change(text)))] == kinds


def test_one_line_or_two():
    for one, two in (
        ("if a: b = 1", "if a:\n    b = 1"),
        ("a = 1; b = 2", "a = 1\nb = 2"),
        ("f(a,\n  b)", "f(a, b)"),
        ("x = 'a' 'b'", "x = 'ab'"),
        ("x = f'{a + b}'", "x = 'ab'"),
        ("x = f'{a:{b}}' 'c'", "x = ''"),
        ("async def f(): a.b()", "async def f():\n    a.b()"),
    ):
        assert [token.kind for token in tokens(one)] == [token.kind for token in tokens(two)]


@pytest.mark.parametrize(
    ("typed", "plain"),
    [
        ("x: int = a.b()", "x = a.b()"),
        ("self.x: dict[str, int] = a.b()", "self.x = a.b()"),
        ("x: dict[str, a.b()]", ""),
        ("self.x: a.b", ""),
        ("def f(a: int, *b: 'x', c: dict[str, int] = {}) -> dict[str, int]:\n    a.b()",
         "def f(a, *b, c={}):\n    a.b()"),
        ("async def f() -> None: a.b()", "async def f(): a.b()"),
    ],
)  # fmt: skip
def test_types_are_nothing(typed, plain):
    assert [token.kind for token in tokens(typed)] == [token.kind for token in tokens(plain)]


@pytest.mark.parametrize("text", ["a[b:c] = d.e()", "case [a, b]: c.d()", "case a: c.d()", "a = lambda b: c.d()"])
def test_what_is_no_type_is_compared(text):
    assert [token.kind for token in tokens(text)].count(".") == 1


@pytest.mark.parametrize(
    "text",
    [
        "",
        "\0",
        "'",
        '"""' * 3,
        "(" * 300,
        "\\",
        "if x:\n  a\n b\n",
        "1__2 $ ? é\n",
        "x = 5",
        "def f(:\n" * 500,
        "f'{",
        "\ud800",
        "\f\n\tx\n",
        "x\\\n",
        "'''\n" * 999,
        "%magic\n!ls",
    ],
)
def test_what_is_no_python_stops_nothing(text):
    text = clean(text + "\n" + programs(REFERENCE)["calculator_server.py"])
    for token in tokens(text):
        assert 0 <= token.start <= token.end <= len(text) + 1
    found = compare("calculator", [("a", {"x.py": text}), ("b", {"x.py": text})], [], 5)
    for pair in found.pairs:
        for file in pair.files:
            assert "".join(piece.text for piece in file.left) == text == "".join(piece.text for piece in file.right)


def test_after_an_error_the_rest_is_read():
    whole = programs(REFERENCE)["calculator_server.py"]
    broken = "x = = $ 'unfinished\n   y\n  z\n" + whole
    assert len(tokens(broken)) >= len(tokens(whole)) - 5


def test_three_hundred_in_seconds(known):
    styles = [programs(files) for files in STYLES.values()]
    handed_in = [
        (
            f"s{number:03}",
            {
                name: text.replace("rclpy.init", f"v{number % 7}.x(1)\n    rclpy.init")
                for name, text in styles[number % len(styles)].items()
            },
        )
        for number in range(300)
    ]
    begin = time.process_time()
    found = compare("calculator", handed_in, known, 20)
    assert time.process_time() - begin < 10
    assert found.programs == 300 and len(found.scores) == 300 * 299 / 2 and len(found.pairs) == 20


class Tags(HTMLParser):
    def __init__(self, text: str):
        super().__init__()
        self.found = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))


def test_the_page_marks_alike_and_runs_nothing(known, tmp_path):
    name = "calculator_server.py"
    text = f"# {HOSTILE} \udcff\n" + programs(REFERENCE)[name] + f"x = '{HOSTILE}'\n"
    handed_in = [(f"ada {HOSTILE}", {name: text}), ("bob", copy({name: REFERENCE[name]}))]
    found = compare("calculator", handed_in, known, 5)
    presenting.write([found], tmp_path / "page.html")
    assert (tmp_path / "page.html").stat().st_mode & 0o77 == 0
    page = (tmp_path / "page.html").read_text()
    tags = Tags(page).found
    assert not {"script", "img", "link", "iframe"} & {tag for tag, _ in tags} and "&lt;script&gt;" in page
    assert "not a verdict" in page and "ada &lt;/pre&gt;" in page
    assert "default-src 'none'" in next(attrs["content"] for tag, attrs in tags if "http-equiv" in attrs)
    marks = [attrs for tag, attrs in tags if tag == "mark"]
    ids = {attrs["id"] for _, attrs in tags if "id" in attrs}
    links = [attrs["href"] for tag, attrs in tags if tag == "a"]
    assert len(marks) >= 4 and len(links) >= 3 and all(link.startswith("#") and link[1:] in ids for link in links)


@pytest.fixture
def submitted(tmp_path) -> Path:
    """Five students: three calculators, one file that cannot be read, one client alone."""
    folder = tmp_path / "submitted"
    for student, files in {
        "ada": REFERENCE,
        "bob": {name: text.encode() for name, text in copy(REFERENCE).items()},
        "cy\x1b[2J": OTHERS[next(iter(OTHERS))],
        "dee": {},
        "eve": {"calculator_client.py": b"x = 1\n"},
    }.items():
        (folder / student / "calculator").mkdir(parents=True)
        for name, text in files.items():
            (folder / student / "calculator" / name).write_bytes(text)
    (folder / "dee" / "calculator" / "calculator_server.py").symlink_to(
        folder / "ada" / "calculator" / "calculator_server.py"
    )
    return folder


def test_a_program_that_is_far_too_long_is_named_and_costs_nobody_minutes():
    own, long = "x = y + z\nprint(x)\n" * 5, "x = y + z * z\n" * (comparing.LONGEST // 10)
    found = compare("calculator", [("ada", {"x.py": own}), ("bob", {"x.py": own}), ("mal", {"x.py": long})], [], 5)
    assert found.left_out == ["mal"]
    assert [(pair.left, pair.right) for pair in found.pairs] == [("ada", "bob")]


PADDING = {
    "lines of comment": lambda text: "#" * 79 + "\n" + text + ("#" + "-" * 78 + "\n") * 1000,
    "a comment behind each line": lambda text: re.sub(r"(?<=[\w):])$", "  # " + "-" * 2000, text, flags=re.MULTILINE),
    "blank lines": lambda text: text.replace("\n\n", "\n" * 10_000 + " " * 30_000 + "\n"),
}


@pytest.mark.parametrize("pad", PADDING.values(), ids=PADDING)
def test_padding_hides_no_copy(known, pad):
    file, texts = "calculator_server.py", programs(REFERENCE)
    padded = {file: clean(pad(disguised(texts[file])))}
    assert len(padded[file]) > comparing.LONGEST
    handed_in = [*((name, programs(files)) for name, files in OTHERS.items()), ("ada", texts), ("bob", padded)]
    found = compare("calculator", handed_in, known, 1)
    assert {found.pairs[0].left, found.pairs[0].right} == {"ada", "bob"} and found.pairs[0].score > 60
    assert found.too_long == []


def test_a_file_that_is_too_long_is_named_though_others_of_its_student_are_compared(known):
    texts = programs(REFERENCE)
    own = {"calculator_client.py": copy(REFERENCE)["calculator_client.py"]}
    long = {**own, "calculator_server.py": texts["calculator_server.py"] + "x = 0\n" * comparing.LONGEST}
    found = compare("calculator", [("ada", texts), ("eve", long)], known, 3, [("fay (2025)", long)])
    assert found.too_long == ["eve (calculator_server.py)", "fay (2025) (calculator_server.py)"]
    assert (found.programs, found.left_out) == (3, [])
    told = presenting.describe(found)
    assert f"{presenting.TOO_LONG}: eve (calculator_server.py), fay (2025) (calculator_server.py)" in told
    assert "more than 50,000 characters without comments: look at them: eve (calculator_" in presenting.page([found])


def test_a_program_that_cannot_be_examined_costs_only_itself(known, monkeypatch):
    examine = winnowing.may_hide

    def fails(nodes, size):
        if any(isinstance(node, ast.Constant) and node.value == "odd" for node in nodes):
            raise ValueError("odd")
        return examine(nodes, size)

    monkeypatch.setattr(winnowing, "may_hide", fails)
    texts = programs(REFERENCE)
    odd = {**texts, "calculator_server.py": texts["calculator_server.py"] + "\nx = 'odd'\n"}
    found = compare("calculator", [("ada", texts), ("bob", copy(REFERENCE)), ("eve", odd)], known, 5)
    assert [{pair.left, pair.right} for pair in found.pairs] == [{"ada", "bob"}] and found.left_out == ["eve"]


def test_on_the_command_line(submitted, tmp_path):
    command = [
        str(Path(sys.executable).with_name("autograder")),
        "similar",
        str(submitted),
        "--html",
        str(tmp_path / "p.html"),
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0 and done.stderr == ""
    first, best, *_, last = done.stdout.splitlines()
    assert first.startswith("calculator: 4 submissions, 6 pairs; half of them score at most ")
    assert "ada and bob (" in best and "% in common)" in best
    assert (
        last.endswith("not compared, because no program could be read, or it is far too long: dee")
        and "\x1b" not in done.stdout
    )
    assert "<h3" in (tmp_path / "p.html").read_text()


def test_the_output_of_grade_tells_where_the_submissions_are(submitted, tmp_path, capsys):
    out = tmp_path / "out"
    exercise = exercises.load("calculator")
    cli.app(
        ["grade", str(submitted), "--output", str(out), "--student", "dee", "--no-gradebook"], standalone_mode=False
    )
    assert json.loads((out / output.RESULTS).read_text())["max_score"] == exercise.max_score
    capsys.readouterr()
    cli.app(["similar", str(out)], standalone_mode=False)
    assert capsys.readouterr().out.startswith("calculator: 0 submissions, 0 pairs\n")
    submitted.rename(tmp_path / "elsewhere")
    with pytest.raises(UsageError, match="are no longer in .*submitted: give their folder instead"):
        find(out, None, 5)
    (out / output.DETAILS).unlink()
    with pytest.raises(UsageError, match="does not record where its submissions are"):
        find(out, None, 5)


def test_a_student_may_be_called_as_a_file_of_the_grader(tmp_path):
    for name in (output.RESULTS, output.DETAILS):
        (tmp_path / name / "calculator").mkdir(parents=True)
    assert sources.places(tmp_path, "calculator").keys() == {
        (name, "calculator") for name in (output.RESULTS, output.DETAILS)
    }


def test_identical_files_come_first(known):
    """Three hand in the same file, which makes it less rare; a renamed copy is alike to the last token."""
    handed_in = [(name, programs(files)) for name, files in OTHERS.items()]
    same = programs(REFERENCE)
    first = next(iter(OTHERS))
    handed_in += [("one", same), ("two", same), ("three", copy(REFERENCE)), ("four", copy(OTHERS[first]))]
    found = compare("calculator", handed_in, known, 3)
    assert {found.pairs[0].left, found.pairs[0].right} == {"one", "two"}
    assert sorted(found.pairs[0].identical) == sorted(same)
    assert all(not pair.identical for pair in found.pairs[1:])


def test_a_group_of_copies_is_one_line_with_all_names(known):
    """Five hand in the same files, two share a disguised program, and the others are independent."""
    first = next(iter(OTHERS))
    handed_in = [(name, programs(files)) for name, files in OTHERS.items()]
    handed_in += [(name, programs(REFERENCE)) for name in ("ada", "bob", "cy", "dee", "eve")]
    handed_in += [("fay", copy(OTHERS[first]))]
    found = compare("calculator", handed_in, known, 3)
    group, two = presenting.striking(found, 10).items()
    files = ", ".join(programs(REFERENCE))
    assert group[0] == f"calculator: ada, bob, cy, dee and eve (10 pairs; the same to the letter: {files})"
    assert len(group[1]) == 3 and all("the same to the letter" in line for line in group[1])
    assert two[0].startswith(f"calculator: {first} and fay (") and two[1] == []
    assert list(presenting.striking(found, 1)) == [group[0], "calculator: and 1 more group"]
    tail = {**programs(REFERENCE), "calculator_server.py": "class Other:\n    pass\n"}
    (large, _) = compare("calculator", [*handed_in, ("gus", tail)], known, 3).groups
    assert large.students[-1] == "gus" and large.pairs == 15
    assert (large.identical, large.partly) == (["calculator_client.py"], ["calculator_server.py"])


def test_a_ring_of_disguised_copies_does_not_hide_itself_by_its_size(known):
    """Lines that many have count little for a pair's score; lines that only a pair shares still count."""
    ring = [f"student {number}" for number in range(9)]
    handed_in = [(name, programs(files)) for name, files in OTHERS.items()]
    handed_in += [(name, {f: f"# {name}\n{text}" for f, text in copy(REFERENCE).items()}) for name in ring]
    found = compare("calculator", handed_in, known, 1000)
    assert max(pair.score for pair in found.pairs) < comparing.STRIKING
    assert [group.students for group in found.groups] == [ring]
    assert found.groups[0].highest == 100
    (lines,) = presenting.striking(found, 1).values()
    assert len(lines) == 36 and all(line.endswith(" % in common)") for line in lines), lines


def test_what_was_given_is_identical_for_no_one(known):
    given = next(text for text in known if text.count("\n") > 20)
    found = compare("calculator", [("ada", {"a.py": given}), ("bob", {"a.py": given})], known, 3)
    assert found.pairs == [] and found.groups == []


def test_this_year_s_are_compared_with_last_year_s_and_those_not_with_each_other(submitted, tmp_path):
    last = tmp_path / "2025"
    for student in ("fay", "gil"):
        (last / student / "calculator").mkdir(parents=True)
        for name, text in REFERENCE.items():
            (last / student / "calculator" / name).write_bytes(text)
    (found,) = find(submitted, "calculator", 100, [last])
    pairs = [{pair.left, pair.right} for pair in found.pairs]
    assert pairs[:2] == [{"ada", f"fay ({last})"}, {"ada", f"gil ({last})"}]
    assert {f"fay ({last})", f"gil ({last})"} not in pairs
    assert len(found.scores) == 6 + 4 * 2
    command = [str(Path(sys.executable).with_name("autograder")), "similar", str(submitted), str(last), "--top", "1"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert f"ada and fay ({last})" in done.stdout and done.returncode == 0
