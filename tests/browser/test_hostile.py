"""Texts that are made to do something, in every panel and page: they are shown, and nothing is run or loaded."""

import contextlib
import json
import os
import urllib.parse
from collections.abc import Iterator
from pathlib import Path

import nbformat
import pytest
from nbconvert.exporters import HTMLExporter
from nbgrader.api import Gradebook
from nbgrader.server_extensions.formgrader import handlers
from playwright.sync_api import Page, expect

from autograder.records import Report, Result
from autograder.results import feedback, summary
from autograder.similarity import comparing, presenting
from autograder.submissions import notebook
from course.foundation.cells import Cell
from course.returned import pages
from course.returned.record import Mark
from tests.browser.conftest import WAIT, serving
from tests.browser.pages import cell, choose, draws_within, mark, open_page, run_from_palette, show_panel
from tests.lab.test_strange_names import MARKUP, STRANGERS

expect.set_options(timeout=WAIT)

RUN = "window.owned=1;alert(1)"
EVIL = (
    f'</script><script>{RUN}</script><img src="https://evil.example/x.png" onerror="{RUN}"><svg onload="{RUN}">'
    f"<iframe srcdoc='<script>parent.{RUN}</script>'></iframe><style>*{{display:none}}</style>"
    f'<form action=https://evil.example><a href="javascript:{RUN}">[x](javascript:{RUN}) ![x](https://evil.example/y)'
    "{{ 7*7 }} ${7*7} %(x)s \" ' ` \x1b]52;c;cm0=\x07\x1b]0;title\x07\x1b[2J\u202egnp.exe\u2066"
)
END = "the end of it"
LONG = 200 * "n"  # a name that has no place to break
FILE = "'<img src=x onerror=window.owned=1>\\u202e.py'"  # a name of a file has no slash
PROGRAM = f"""import math
import rclpy
from geometry_msgs.msg import Point, Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String
from std_srvs.srv import Trigger
from visualization_msgs.msg import Marker

EVIL = {EVIL!r}
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Hostile(Node):
    def __init__(self):
        super().__init__('hostile')
        told = ParameterDescriptor(description=EVIL + 'described ' + {END!r}, additional_constraints=EVIL)
        self.declare_parameter('a' + EVIL, EVIL + {END!r}, told)
        self.declare_parameter('long', 'x' * 3_000_000)
        for number in range(300):
            self.declare_parameter(f'p{{number}}', EVIL)
        self.create_service(Trigger, 'ask', self.ask)
        self.create_service(Trigger, {LONG!r}, self.ask)
        for number in range(60):
            self.create_service(Trigger, f'{{"deep/" * 20}}service_{{number}}', self.ask)
        self.topics = [
            self.create_publisher(LaserScan, 'scan', 1),
            self.create_publisher(Odometry, 'odom', 1),
            self.create_publisher(Twist, 'cmd_vel', 1),
            self.create_publisher(String, 'collision', LATCHED),
            self.create_publisher(Marker, 'walls', LATCHED),
        ]
        self.create_timer(0.5, self.tell)
        self.get_logger().info('W' * 2_000_000)
        print('<b>' + EVIL + 'printed ' + {END!r}, flush=True)

    def ask(self, request, response):
        response.message = EVIL + 'x' * 1_000_000
        return response

    def tell(self):
        self.get_logger().error(EVIL + 'State: <b>logged ' + {END!r})
        scan, odom, go, wall = LaserScan(), Odometry(), Twist(), Marker()
        scan.header.frame_id = odom.header.frame_id = wall.header.frame_id = EVIL
        scan.ranges, scan.angle_increment, scan.range_max = [math.nan, math.inf, -1.0, 3e38] * 25_000, math.inf, 3e38
        odom.pose.pose.position.x = odom.pose.pose.orientation.w = math.nan
        go.linear.x, go.angular.z = math.inf, 1e300
        wall.points = [Point(x=math.nan, y=1e308), Point(x=-1e308, y=math.inf)] * 500
        wall.points += [Point(x=1e17), Point(x=1e17, y=1.0), Point()]
        wall.text = EVIL
        for topic, message in zip(self.topics, (scan, odom, go, String(data=EVIL + ' x=9.9.9 m, y=- m'), wall)):
            topic.publish(message)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(Hostile())


main()
"""
SCRIPT = "</b><script>parent.alert(1)</script>"  # without the sign that makes a constant
INTERFACE = f"""# {EVIL} \\
string a "{SCRIPT}" # */ {EVIL}
---
# {EVIL}
string message # {EVIL} {END}
"""
ANSWERING = f"""from hostile_interfaces.srv import Ask
def answer(request, response):
    response.message = request.a + {END!r}
    return response
answering = ros.node.create_service(Ask, '/commented', answer)
!ros2 interface show hostile_interfaces/srv/Ask
"""
CHART = {  # JupyterLab would draw it, and follow its addresses, in a notebook that is not trusted, too
    "$schema": "https://vega.github.io/schema/vega/v5.json",
    "data": [{"name": "a", "url": "https://evil.example/a.json"}],
}
BUTTON = f'<button data-commandlinker-command="runmenu:run-all" data-commandlinker-args="{{}}">{END}</button>'
DYING = f"import rclpy\nrclpy.init()\nrclpy.create_node('dying')\nraise ValueError({EVIL!r})"
# Ends with the kernel.
NAMED = STRANGERS["markup, with endpoints"].replace(
    "while True:", "import os\nparent = os.getppid()\nwhile os.getppid() == parent:"
)
CELLS = (
    "import course\n\nros = course.live()",
    f"%%exercise hostile.py\n{PROGRAM}",
    f"dying = {DYING!r}\nopen({FILE}, 'w').write(dying)",
    f"try:\n    ros.start({FILE})\nexcept Exception as error:\n    print(error)",
    f"import subprocess, sys\nnamed = subprocess.Popen([sys.executable, '-c', {NAMED!r}])",
    "ros.logs()",
    "ros.nodes()",
    f"print({EVIL!r} + {END!r})",
    f"raise RuntimeError({EVIL!r})",
    f"%%exercise Ask.srv --package hostile_interfaces\n{INTERFACE}",
    ANSWERING,
    "Ask",
)


class Watch:
    """A record of what a page must not do: run a script of ours, ask, open, leave, or load from elsewhere."""

    def __init__(self, page: Page):
        self.seen: list[str] = []
        page.on("dialog", lambda dialog: (self.seen.append(f"dialog {dialog.message}"), dialog.dismiss()))
        page.on("popup", lambda popup: self.seen.append(f"popup {popup.url}"))
        page.on("request", lambda request: self._loads(request.url))
        self._page = page

    def _loads(self, url: str) -> None:
        if not url.startswith(("http://127.0.0.1:", "ws://127.0.0.1:", "file:///", "data:", "blob:", "about:")):
            self.seen.append(f"load {url}")

    def check(self) -> None:
        """Fail if anything was seen, or a script has run."""
        assert self.seen == []
        assert not any(frame.evaluate("() => window.owned") for frame in self._page.frames)


@contextlib.contextmanager
def watched(page: Page) -> Iterator[Watch]:
    watch = Watch(page)
    yield watch
    watch.check()


def obeyed(text: str) -> set[str]:
    """The characters in what a page shows that would turn or hide the rest of it."""
    return set(text) & {"\x1b", "\x07", "\u202e", "\u2066"}


def test_the_watch_sees_what_it_looks_for(page):
    watch = Watch(page)
    page.goto("about:blank")
    page.set_content(f"<!DOCTYPE html><body>{EVIL}", wait_until="commit")
    page.wait_for_function("() => window.owned")
    assert {"dialog 1", "load https://evil.example/x.png"} <= set(watch.seen)
    with pytest.raises(AssertionError):
        watch.check()


@pytest.mark.long("all panels, one after the other")
def test_a_hostile_session_is_shown_by_every_panel_and_obeyed_by_none(lab, page):
    folder = lab[2] / "hostile"
    folder.mkdir()
    cells = [nbformat.v4.new_code_cell(source) for source in CELLS]
    cells[1].metadata = mark("hostile-file", solution=True)
    cells[9].metadata = mark("hostile-interface", solution=True)
    for each in cells[2:9]:
        each.metadata = {"tags": ["raises-exception"]}
    drawn = {"application/vnd.vega.v5+json": CHART, "application/vnd.vegalite.v5+json": CHART, "text/plain": END}
    cells[0].outputs = [nbformat.v4.new_output("display_data", drawn)]
    cells.append(nbformat.v4.new_markdown_cell(BUTTON))
    cells[1].outputs = [nbformat.v4.new_output("display_data", {"text/html": BUTTON})]
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    nbformat.write(nbformat.v4.new_notebook(cells=cells, metadata=kernel), folder / "hostile.ipynb")
    with watched(page) as watch:
        open_page(page, lab, "hostile/hostile.ipynb")
        expect(cell(page, 0).locator(".jp-OutputArea-output")).to_have_text(END)
        for button in (cell(page, 1).get_by_role("button", name=END), cell(page, 12).get_by_role("button", name=END)):
            expect(button).to_be_attached()
            assert not button.get_attribute("data-commandlinker-command")
        nodes = show_panel(page, "Nodes")
        expect(nodes).to_contain_text("Run the notebook’s first cell: ros = course.live()")
        choose(page, "Run", "Run All Cells")
        expect(nodes.get_by_role("button", name="/hostile running")).to_be_visible()
        expect(nodes.get_by_role("log")).to_contain_text(f"logged {END}")
        expect(nodes.get_by_role("log")).to_contain_text(f"printed {END}")
        expect(nodes.get_by_role("log")).to_contain_text("\\x1b]52;c;cm0=\\x07")
        expect(nodes.get_by_role("log")).to_contain_text("characters; `ros.logs()` has more)")
        expect(nodes.get_by_role("button", name="dead")).to_be_visible()
        nodes.get_by_role("button", name="/hostile running").click()
        expect(nodes).to_contain_text("p299 = ")
        nodes.get_by_role("button", name="dead").first.click()
        expect(nodes.locator(".ros-story")).to_contain_text("\\x1b]52;c;cm0=\\x07")
        assert not obeyed(nodes.inner_text())
        assert nodes.evaluate("panel => panel.scrollWidth <= panel.clientWidth")
        assert draws_within(page, 3000)  # ms, on a busy machine
        expect(nodes.get_by_role("button", name=f"/{MARKUP} running")).to_be_visible()
        expect(cell(page, 8).locator(".jp-OutputArea-output").first).to_contain_text("RuntimeError")
        watch.check()

        inspector = show_panel(page, "Inspector")
        inspector.get_by_role("combobox", name="Service", exact=True).select_option("/ask std_srvs/srv/Trigger")
        inspector.get_by_role("button", name="Call", exact=True).click()
        expect(inspector.get_by_role("region", name="Timeline")).to_contain_text("</script><script>")
        assert not obeyed(inspector.inner_text())
        assert inspector.evaluate("panel => panel.scrollWidth <= panel.clientWidth")
        watch.check()

        service = inspector.get_by_role("combobox", name="Service", exact=True)
        service.select_option(f"/{LONG} std_srvs/srv/Trigger")
        expect(service).to_have_attribute("title", f"/{LONG}")
        inspector.get_by_role("button", name="Call", exact=True).click()
        expect(inspector.get_by_role("heading", name="Timeline")).to_contain_text(LONG)
        expect(inspector.get_by_role("region", name="Timeline")).to_contain_text("</script><script>")
        assert inspector.evaluate("panel => panel.scrollWidth <= panel.clientWidth")

        inspector.get_by_label("What to do").select_option("Set a parameter")
        inspector.get_by_role("combobox", name="Node", exact=True).select_option("/hostile ")
        inspector.get_by_role("combobox", name="Parameter", exact=True).select_option(index=0)
        expect(inspector).to_contain_text(f"described {END}")
        assert not obeyed(inspector.inner_text())
        assert inspector.evaluate("panel => panel.scrollWidth <= panel.clientWidth")
        watch.check()

        inspector.get_by_label("What to do").select_option("Call a service")
        service.select_option("/commented hostile_interfaces/srv/Ask")
        expect(inspector.get_by_role("textbox", name="a string")).to_have_value(SCRIPT)
        inspector.get_by_role("button", name="Call", exact=True).click()
        expect(inspector.get_by_role("region", name="Timeline")).to_contain_text(SCRIPT + END)
        assert not obeyed(inspector.inner_text())
        watch.check()

        said = cell(page, 10).locator(".jp-OutputArea-output").first  # of ros2 interface show
        expect(said).to_contain_text(END)
        expect(said).to_contain_text("\\x1b]52;c;cm0=\\x07")
        assert not obeyed(said.inner_text())
        cell(page, 11).locator(".cm-content").press("End")
        page.keyboard.press("Shift+Tab")
        expect(page.locator(".jp-Tooltip")).to_contain_text("hostile_interfaces")
        assert not obeyed(page.locator(".jp-Tooltip").inner_text())
        page.keyboard.press("Escape")
        watch.check()

        graph = show_panel(page, "Graph")
        expect(graph.get_by_role("list", name="The graph as a list")).to_contain_text(f"/{MARKUP}")
        expect(graph.get_by_role("list", name="The graph as a list")).to_contain_text("service_59")
        assert draws_within(page, 3000)  # ms
        watch.check()

        run_from_palette(page, "ROS course", "Plot")
        plot = page.get_by_role("tabpanel", name="Plot", exact=True)
        plot.get_by_label("Topic").select_option("/odom")
        expect(plot.get_by_label("Field")).to_have_value("twist.twist.linear.x")
        assert draws_within(page, 3000)  # ms
        assert not obeyed(plot.inner_text())
        watch.check()

        run_from_palette(page, "ROS course", "Robot")
        robot = page.get_by_role("tabpanel", name="Robot", exact=True)
        expect(robot).to_contain_text("hostile")
        assert draws_within(page, 3000)  # ms
        assert not obeyed(robot.inner_text())
        exercise = show_panel(page, "Exercise")
        expect(exercise).to_contain_text("hostile.py")
        page.get_by_role("tab", name="hostile.ipynb").click()
        page.get_by_role("region", name="Exercise").get_by_role("button", name="Hand in", exact=True).click()
        expect(page.get_by_role("dialog")).to_contain_text("hostile.py")
        page.get_by_role("dialog").get_by_role("button", name="Cancel").click()
        watch.check()
        expect(show_panel(page, "Nodes").get_by_role("button", name="/hostile running")).to_be_visible()


SPACE = "nbgrader-formgrader:nbgrader-formgrader"  # a page that JupyterLab would open at the address of a workspace
FILLED = {"dock": {"type": "tab-area", "currentIndex": 0, "widgets": [SPACE]}, "current": SPACE}
UP = "%2e%2e/%2e%2e/%2e%2e/api/contents"  # from where JupyterLab would write a workspace
WORKSPACES = {
    "page": {
        "data": {SPACE: {"data": {"url": f"javascript:top.{RUN}"}}, "layout-restorer:data": {"main": FILLED}},
        "metadata": {"id": "evil"},
    },
    "path": {"data": {}, "metadata": {"id": f"{UP}/written.py"}, "type": "file", "format": "text", "content": "x"},
}


LEAVING = (
    '<meta http-equiv="refresh" content="0;url=https://evil.example/left"><meta name="referrer" content="unsafe-url">'
)
LOADING = "".join(f"<{each}>" for each in (
    'link rel="prefetch" href="https://evil.example/a"', 'link rel="stylesheet" href="https://evil.example/b"',
    'iframe src="https://evil.example/c"></iframe', 'object data="https://evil.example/d"></object',
    'video src="https://evil.example/e"></video', "style>body{background:url(https://evil.example/f)}</style",
))  # fmt: skip
DRAWING = (
    f'<svg xmlns="http://www.w3.org/2000/svg"><text y="20">{END}</text><script>{RUN}</script>'
    '<image href="https://evil.example/g"/></svg>'
)


def test_a_workspace_that_was_handed_in_is_a_text_and_a_file_in_a_tab_of_its_own_runs_and_loads_nothing(lab, page):
    """By a workspace JupyterLab would arrange itself: with a script in the place of a page, or as another file.

    The tab's address has the token of whoever opened it.  In JupyterLab, a page that is trusted runs its scripts.
    """
    address, token, folder = lab
    for kind, content in WORKSPACES.items():
        (folder / f"{kind}.jupyterlab-workspace").write_text(json.dumps(content))
    first, *others = WORKSPACES
    with watched(page) as watch:
        page.goto(f"{address}/lab/tree/{first}.jupyterlab-workspace?token={token}&reset")
        for kind in (first, *others):
            if kind != first:
                page.locator(".jp-DirListing-item").get_by_text(f"{kind}.jupyterlab-workspace", exact=True).dblclick()
            expect(page.locator(".jp-FileEditor:visible")).to_contain_text(
                f'"id": "{WORKSPACES[kind]["metadata"]["id"]}'
            )
            watch.check()
    assert not (folder / "written.py").exists()

    written = {"page.html": f"<!DOCTYPE html>{LEAVING}<h1>{END}</h1>{LOADING}{EVIL}", "drawing.svg": DRAWING}
    for name, text in written.items():
        (folder / name).write_text(text)
    reached: list[str] = []  # a request that the page's policy refuses is not sent
    page.context.route("https://evil.example/**", lambda route: (reached.append(route.request.url), route.abort()))
    for name in written:
        page.locator(".jp-DirListing-item").get_by_text(name, exact=True).click(button="right")
        with page.context.expect_page() as opened:
            page.get_by_role("menuitem", name="Open in New Browser Tab").click()
        own = opened.value
        own.wait_for_load_state()
        expect(own.get_by_text(END)).to_be_attached()
        assert f"/files/{name}?_xsrf=" in own.url
        assert not any(frame.evaluate("() => window.owned") for frame in own.frames)
        own.close()
    page.context.unroute_all()
    assert reached == []
    (folder / "own.html").write_text(f"<!DOCTYPE html><script>document.write({END!r})</script>")
    page.locator(".jp-DirListing-item").get_by_text("own.html", exact=True).dblclick()
    page.get_by_role("button", name="Trust HTML").click()
    expect(page.frame_locator(".jp-HTMLViewer iframe").get_by_text(END)).to_be_visible()


def hostile_report(student: str) -> Report:
    """A report whose every text is hostile."""
    tests = [Result(EVIL, EVIL, outcome, 0, 4, EVIL * 3) for outcome in ("failed", "crashed", "passed")]
    return Report(student, "services", "graded", 3.0, 12.0, 1, 1.0, [EVIL], tests, {EVIL: EVIL}, {EVIL: EVIL})


def test_a_hostile_class_is_shown_by_the_pages_for_students_and_instructors(page, tmp_path):
    """The student's page, report.html, and the page of similar submissions."""
    report = hostile_report(EVIL.replace("/", ""))
    refused = Report(
        EVIL, "services", "invalid_submission", 0.0, 12.0, 1, 0.0, [], [Result("", EVIL, "not_run", 0, 12, EVIL)]
    )
    by_hand = [Mark("why" + EVIL, 1.0, 3.0, EVIL + END)]
    feedback_page = feedback.page(report, by_hand)
    text = f"{EVIL!r}\n" + "def f(a):\n    return [b * a for b in range(a) if b % 2]\n" * 30
    finding = comparing.compare("services", [(EVIL, {"relay.py": text}), ("x" + EVIL, {"relay.py": text})], [], 5)
    assert finding.pairs
    for name, content in {
        "feedback": feedback_page,
        "report": summary.page([report, refused]),
        "similar": presenting.page([finding]),
    }.items():
        (tmp_path / f"{name}.html").write_bytes(content.encode(errors="replace"))
        with watched(page):
            page.goto((tmp_path / f"{name}.html").as_uri())
            body = page.locator("body")
            expect(body).to_contain_text("<svg onload=")
            expect(body).to_contain_text("\\x1b]52;c;cm0=\\x07")
            assert not obeyed(body.inner_text())
            for link in page.locator("a").all():
                assert not (link.get_attribute("href") or "").strip().lower().startswith("javascript:")
    found, _ = pages.take(tmp_path / "feedback.html")  # the data in the page stay what they are
    assert found.marks[0].comment.endswith(END)
    assert found.student.startswith("<script>")


def test_a_hostile_notebook_does_nothing_in_formgrader(page, tmp_path):
    """The notebook as Formgrader shows it: markdown, outputs of each kind, names of cells and of the student."""
    outputs = [
        {"output_type": "stream", "name": "stdout", "text": EVIL},
        {"output_type": "error", "ename": EVIL, "evalue": EVIL, "traceback": [EVIL]},
        *(
            {"output_type": "display_data", "data": {kind: EVIL, "text/plain": EVIL}, "metadata": {}}
            for kind in ("text/html", "image/svg+xml", "application/javascript", "text/latex", "text/markdown")
        ),
    ]
    formula = f"$\\href{{javascript:{RUN}}}{{x}}$ <a href=j&#97;vascript:{RUN}>x</a>"
    told = [
        Cell("markdown", EVIL + formula + END, {"grade_id": EVIL}),
        Cell("raw", EVIL),
        Cell("code", EVIL, {"grade_id": EVIL}, 1, outputs),
    ]
    nbformat.write(notebook.safe(told), tmp_path / "shown.ipynb")
    exporter = HTMLExporter(template_name="formgrade", extra_template_basedirs=[handlers.template_path])
    about = {"base_url": "/", "student": "ada", "notebook_path": "n", "index": 0, "total": 1}
    shown, _ = exporter.from_filename(str(tmp_path / "shown.ipynb"), resources=about)
    (tmp_path / "shown.html").write_text(shown, encoding="utf-8")
    watch = Watch(page)
    page.goto((tmp_path / "shown.html").as_uri(), wait_until="domcontentloaded")
    expect(page.locator("body")).to_contain_text(END)
    for link in page.locator("a[href]").all():
        assert not (link.get_attribute("href") or "").strip().lower().startswith("javascript:")
    assert not [seen for seen in watch.seen if "evil.example" in seen or "dialog" in seen or "popup" in seen]
    assert not any(frame.evaluate("() => window.owned") for frame in page.frames)


FILES = ("a.svg", "a.SVG", "a.xml", "a.htm")  # beside a handed-in notebook, which may link to them
NAMED_BY_MARKUP = f"""<img src=x onerror={RUN}>'";alert(2);" o'Hara"""  # a student's folder has this name


def course_of_one(course: Path) -> str:
    """A course whose one student has hostile names, a graded notebook and comments; the number of that notebook."""
    for folder in ("source/services", *(f"{each}/{NAMED_BY_MARKUP}/services" for each in ("submitted", "autograded"))):
        (course / folder).mkdir(parents=True)
        cell = nbformat.v4.new_markdown_cell(
            END, metadata={"nbgrader": {"grade_id": "why", "points": 3, "grade": True}}
        )
        cell.metadata["nbgrader"] |= {"solution": True, "task": False, "locked": False, "schema_version": 3}
        nbformat.write(nbformat.v4.new_notebook(cells=[cell]), course / folder / "services.ipynb")
    root = f"c = get_config()\nc.CourseDirectory.root = {str(course)!r}\nc.CourseDirectory.course_id = 'ros2'\n"
    (course / "nbgrader_config.py").write_text(root)
    drawing = f'<svg xmlns="http://www.w3.org/2000/svg"><title>{END}</title><script>{RUN}</script></svg>'
    for name in FILES:
        (course / "autograded" / NAMED_BY_MARKUP / "services" / name).write_text(drawing)
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}", "ros2") as book:
        book.add_student(NAMED_BY_MARKUP, first_name=EVIL, last_name=EVIL, email=EVIL)
        book.add_assignment("services")
        book.add_notebook("services", "services")
        book.add_grade_cell("why", "services", "services", max_score=3, cell_type="markdown")
        book.add_solution_cell("why", "services", "services")
        submission = book.add_submission("services", NAMED_BY_MARKUP).notebooks[0]
        submission.grades[0].needs_manual_grade = True
        submission.comments[0].auto_comment = submission.comments[0].manual_comment = EVIL + END
        book.db.commit()
        return submission.id


@pytest.fixture(scope="module")
def formgrader(tmp_path_factory):
    """A JupyterLab of a course with a hostile student: Formgrader's address, the token, a submission, the folder."""
    base = tmp_path_factory.mktemp("formgrader")
    course = base / "course"
    number = course_of_one(course)
    with serving(base, course) as (address, token):
        yield f"{address}/formgrader", token, number, course


def test_formgrader_shows_hostile_names_and_addresses_as_text(formgrader, page):
    """Its lists, its dialogs, the page for marks by hand, and a link that somebody has made for an instructor."""
    where, token, number, _ = formgrader
    watch = Watch(page)
    page.route(
        "https://cdnjs.cloudflare.com/**", lambda route: route.abort()
    )  # the page for marks by hand loads MathJax
    page.goto(f"{where}?token={token}")
    body = page.locator("body")
    for path in ("manage_students", "manage_submissions/services"):
        page.goto(f"{where}/{path}")
        expect(page.locator("#main-table")).to_contain_text("<svg onload=")
        expect(page.locator("#main-table")).to_contain_text(NAMED_BY_MARKUP)
    page.route("**/autograde", lambda route: route.abort())
    page.locator(".autograde a").click()
    expect(page.locator(".modal-body")).to_contain_text(f"for student '{NAMED_BY_MARKUP}'")
    for path in ("", "/services"):
        page.goto(f"{where}/manage_students/{urllib.parse.quote(NAMED_BY_MARKUP)}{path}")
        expect(page.locator(".breadcrumb")).to_contain_text(NAMED_BY_MARKUP)
        expect(page.locator("#main-table")).to_contain_text("services")  # asked for by the student's name
    page.goto(f"{where}/gradebook/services/services")
    page.get_by_role("button", name="Show All Names").click()
    expect(page.locator("a.name-shown")).to_contain_text("<svg onload=")
    page.goto(f"{where}/submissions/{number}/")
    expect(body).to_contain_text(END)
    expect(body).to_contain_text("<svg onload=")
    expect(page.locator("#why-comment")).to_have_value(EVIL + END)
    for name in FILES:
        assert page.goto(f"{where}/submissions/{number}/{name}").ok
        assert END in page.content() and not page.evaluate("() => window.owned")
    for path in ("manage_students/{}", "manage_submissions/{}", "gradebook/{}", "gradebook/services/{}"):
        page.goto(f"{where}/{path}".format(urllib.parse.quote(f"</script><script>{RUN}<", safe="")))
        expect(page.locator(".breadcrumb")).to_contain_text(f"<script>{RUN}<")
        assert not page.evaluate("() => window.owned")
    assert not [seen for seen in watch.seen if "evil.example" in seen or "dialog" in seen or "popup" in seen]


def test_formgrader_runs_no_configuration_of_another_folder(formgrader, page, tmp_path):
    """As of one that was handed in, which a link or a picture in a notebook would name."""
    where, token, _, course = formgrader
    folder, ran = course / "submitted/handed", tmp_path / "ran"
    folder.mkdir(parents=True)
    (folder / "nbgrader_config.py").write_text(f"open({os.fspath(ran)!r}, 'w').close()\n")
    answer = page.goto(f"{where}?token={token}&path=submitted/handed")
    assert answer.status == 403
    expect(page.locator("body")).to_contain_text("Sorry")
    assert not ran.exists()
