"""Helpers of public checks: what the text of a program, or its log, shows about a promise that it has not kept."""

import ast
import math
import re
from collections.abc import Iterator
from pathlib import Path

from course.explaining.conditions import compared_with_nan
from course.explaining.doubts import LOCKS
from course.explaining.exchanged_limits import exchanged_limits
from course.explaining.failure_report import frame_at
from course.explaining.lost_values import sent_before_filled
from course.explaining.misspelt_texts import operations
from course.explaining.source import (
    CALLBACKS,
    argument,
    calls,
    covers,
    functions,
    inside,
    last_parameter,
    name_of,
    named,
    parameter_callbacks,
    parse,
    service_callbacks,
    signed_number,
    text_at,
)
from course.explaining.unmeant import NOW
from course.explaining.unread import only_none
from course.explaining.whole_values import whole_values
from course.foundation.syntax import walk
from course.session.node_process import NodeProcess
from course.session.watch import Handle

LOOKS = re.compile(r"\b(?:is_cancel_requested|is_active|status|STATUS_CANCELING|goal_cancelled)\b")
LISTED = 6  # lines of a log that are shown


def no_cancel(file: str) -> str:
    """Return a sentence on an action server whose text never asks whether a cancel is requested; '' otherwise."""
    if LOOKS.search(text_at(Path(file))):
        return ""
    return (
        f". Nothing in {file} reads `is_cancel_requested` of the goal handle: the execute callback must look at it "
        "before each step"
    )


def lock_of_a_step(file: str) -> str:
    """Return lines on a lock that a program holds for one step of a goal alone, inside its loop; '' without one."""
    source = text_at(Path(file))
    tree = parse(source)
    locks = {ast.unparse(target) for node in walk(tree) if isinstance(node, ast.Assign)
             and name_of(getattr(node.value, "func", None)) in LOCKS for target in node.targets}  # fmt: skip
    for loop in (node for node in walk(tree) if isinstance(node, (ast.While, ast.For))):
        for block in (node for node in walk(loop) if isinstance(node, ast.With)):
            held = locks & {ast.unparse(item.context_expr) for item in block.items}
            if held and any(calls(block, "sleep")):
                return (
                    f"\n{frame_at(file, block.lineno, source)}\nThis holds the lock for one step alone, so a new goal "
                    "may count its stops while the cabin is still moving for the one before. Hold it from before the "
                    "first look at the floor until the goal ends."
                )
    return ""


def late_newest(file: str) -> str:
    """Return lines on an action server that stores its newest goal only once the one before has ended.

    That is, only when it has its lock, or after a wait in the `handle_accepted_callback`.
    """
    source = text_at(Path(file))
    tree = parse(source)
    executes = {name_of(argument(call, *CALLBACKS["ActionServer"])) for call in calls(tree, "ActionServer")}
    for function in named(tree, executes):
        given = last_parameter(function)
        stored = [node for node in walk(tree) if isinstance(node, ast.Assign) and name_of(node.value) == given]
        blocks = [node for node in walk(function) if isinstance(node, ast.With)]
        held = [node for node in stored if any(node in walk(each) for each in blocks)]
        if held and len(held) == len(stored) and all(isinstance(each.targets[0], ast.Attribute) for each in held):
            return (
                f"\n{frame_at(file, held[0].lineno, source)}\nThis stores the new goal only when it has the lock, "
                "after the previous one has ended, which therefore never learns of it. Store it as soon as it is "
                "accepted, in the `handle_accepted_callback`."
            )
    moving = [node for function in named(tree, executes) for node in walk(function) if isinstance(node, ast.With)]
    locks = {ast.unparse(item.context_expr) for block in moving for item in block.items}
    taking = {name_of(argument(call, 9, "handle_accepted_callback")) for call in calls(tree, "ActionServer")}
    for function in named(tree, taking - {""}):
        given, nodes = last_parameter(function), list(walk(function))
        stored = [node for node in nodes if isinstance(node, ast.Assign) and name_of(node.value) == given]
        waits = [node.lineno for node in nodes if isinstance(node, ast.While)]
        waits += [call.lineno for name in WAITING for call in calls(function, name)]
        waits += [node.lineno for node in nodes if isinstance(node, ast.With)
                  and locks & {ast.unparse(item.context_expr) for item in node.items}]  # fmt: skip
        if stored and waits and min(waits) < stored[0].lineno:
            return (
                f"\n{frame_at(file, min(waits), source)}\nThe new goal waits here, and is stored only after that, in "
                f"line {stored[0].lineno}: the goal that runs does not learn of it. Store it first, and begin it at "
                "once; 'execute' waits for the cabin."
            )
    return ""


WAITING = ("acquire", "join", "sleep", "wait")


def stopped_clock(file: str) -> str:
    """Return lines on a node that sets its own use_sim_time to True; '' if its text does not show that."""
    source = text_at(Path(file))
    for call in (node for node in walk(parse(source)) if isinstance(node, ast.Call)):
        given = [each.value for each in walk(call) if isinstance(each, ast.Constant)]
        if "use_sim_time" in given and any(each is True for each in given):
            return (
                f"\n{frame_at(file, call.lineno, source)}\nWith use_sim_time the clock of this node, and its timers, "
                "stand still until something publishes /clock. Leave it out: it is set at the start, where a "
                "simulation runs."
            )
    return ""


MILLISECONDS = 100  # seconds, so many or more of which are meant as milliseconds
OF_SECTORS = {25, 40, 80}  # degrees, the ends of the follower's sectors


def unconverted(file: str) -> str:
    """Return a sentence on a program that uses the angles of a scan and sectors in degrees, and converts nothing."""
    tree = parse(text_at(Path(file)))
    code = ast.unparse(tree)  # without comments
    numbers = {node.value for node in walk(tree) if isinstance(node, ast.Constant) and not isinstance(node.value, str)}
    called = {name_of(node.func) for node in walk(tree) if isinstance(node, ast.Call)}
    converts = called & {"degrees", "rad2deg", "radians", "deg2rad"} or re.search(
        r"\b(?:180|360|57\.|0\.017|deg=)", code
    )
    if "angle_increment" not in code or not numbers >= OF_SECTORS or converts:
        return ""
    return (
        f". The angles of a scan are in radians, those of the sectors in {file} are in degrees, and nothing in it "
        "converts one to the other, as `np.degrees(...)` does"
    )


def _reversed(file: str) -> str:
    """Return a sentence on a program that turns the order of a scan's beams round; '' if its text does not."""
    for line, code in enumerate(text_at(Path(file)).splitlines(), 1):
        if "ranges" in code and re.search(r"\[::-1\]|\breversed\(|\.reverse\(|\bflip", code):
            return (
                f". Line {line} of {file}, `{code.strip()}`, reverses the order of the beams: the first one is at "
                "angle_min, and the angles of the others grow by angle_increment"
            )
    return ""


def _without_sign(file: str) -> str:
    """Return lines on a program that takes the sign from the increment of a scan's angles; '' if its text does not."""
    source = text_at(Path(file))
    nodes = [*walk(parse(source))]
    compared = {part for node in nodes if isinstance(node, ast.Compare) for part in walk(node)}
    for call in (node for node in nodes if isinstance(node, ast.Call) and node not in compared):
        unsigned = name_of(call.func) in ("abs", "fabs", "absolute")
        if unsigned and call.args and name_of(call.args[0]) == "angle_increment":
            return (
                f"\n{frame_at(file, call.lineno, source)}\nThe angle_increment of a scanner that turns clockwise is "
                f"negative: without its sign the beams on the right are taken for those on the left. Leave out "
                f"`{name_of(call.func)}`."
            )
    return ""


def unread_limit(file: str, field: str) -> str:
    """Return a sentence on a program that never reads this limit of a scan's ranges; '' if it may."""
    return "" if _may_read(file, field) else f". Nothing in {file} reads `{field}` of the scan"


def _may_read(file: str, field: str) -> bool:
    """Return True if a program has the name of a field, or may read it by another way."""
    source = text_at(Path(file))
    return re.search(rf"\b{field}\b", ast.unparse(parse(source))) is not None or "getattr" in source


def seen_wrongly(file: str, *, nothing: bool) -> str:
    """Return why a follower takes a scan for another one, or for `nothing`; '' if its text does not show that."""
    return (
        unconverted(file)
        or _reversed(file)
        or _without_sign(file)
        or _by_the_last_angle(file)
        or _of_the_sectors(file)
        or (_kept_nothing(file) if nothing else "")
    )


def odd_values(file: str, value: float) -> str:
    """Return lines on what a follower makes of the beams that are NaN, or -inf; '' if its text does not show that."""
    source = text_at(Path(file))
    nodes = [*walk(parse(source))]
    made = [node for node in nodes if isinstance(node, ast.Call)]
    if math.isnan(value):
        for line, why in compared_with_nan(nodes):
            return f"\n{frame_at(file, line, source)}\n{why}"
        for call in (each for each in made if name_of(each.func) == "nan_to_num"):
            if len(call.args) == 1 and "nan" not in {each.arg for each in call.keywords}:
                return (
                    f"\n{frame_at(file, call.lineno, source)}\nThis makes 0.0 of NaN, an obstacle at 0 m. Leave "
                    "those beams out: `~np.isnan(ranges)` finds the others."
                )
        return ""
    for call in (each for each in made if name_of(each.func) == "isfinite"):
        if not re.search(r"isinf|isneginf|-\s*(?:\w+\.)?inf|float\('-inf'\)", ast.unparse(parse(source))):
            return (
                f"\n{frame_at(file, call.lineno, source)}\n-inf is not finite, so this leaves it out. It is a distance "
                "of 0: replace it by 0.0 before."
            )
    return ""


def _by_the_last_angle(file: str) -> str:
    """Return lines on a program that takes the angles of a scan from its `angle_max`, without the increment."""
    source = text_at(Path(file))
    tree = parse(source)
    read = [node for node in walk(tree) if isinstance(node, ast.Attribute) and node.attr == "angle_max"]
    if not read or "angle_increment" in ast.unparse(tree):
        return ""
    return (
        f"\n{frame_at(file, read[0].lineno, source)}\nDo not rely on `angle_max`, which a scanner may leave at 0: the "
        "angle of a beam is angle_min + index * angle_increment."
    )


RIGHT = {-80, -40}
TURNS = re.compile(r"%|remainder|fmod|atan2|arctan2|unwrap|360|pi\b|tau|while|\bcos|\bsin")
TURNING = {"remainder", "fmod", "mod", "divmod", "atan2", "arctan2", "unwrap", "where", "cos", "sin"}  # functions
MIRRORS = re.compile(r"-\s*(?:\w+\.)?(?:angle|deg|theta|scan\.angle)")


def _number(node: ast.expr) -> float:
    """Return a number that is written out; NaN for anything else."""
    number = signed_number(node)
    return math.nan if number is None else number


def _of_the_sectors(file: str) -> str:
    """Return lines on the ends of a sector in the wrong order, or on the left, or on angles that are not turned."""
    source = text_at(Path(file))
    tree = parse(source)
    ends = [(node.lineno, [*map(_number, node.elts)]) for node in walk(tree)
            if isinstance(node, (ast.Tuple, ast.List)) and len(node.elts) == 2]  # fmt: skip
    ends += [(node.lineno, [_number(node.left), _number(node.comparators[1])]) for node in walk(tree)
             if isinstance(node, ast.Compare) and len(node.ops) == 2
             and all(isinstance(each, (ast.Lt, ast.LtE)) for each in node.ops)]  # fmt: skip
    for line, (low, high) in ends:
        if {abs(low), abs(high)} <= OF_SECTORS and low > high:
            return (
                f"\n{frame_at(file, line, source)}\nNo angle is above {low:g} and below {high:g}: the smaller "
                "one comes first."
            )
    if any({low, high} == RIGHT for _, (low, high) in ends) and (line := _never_negative(tree)):
        return (
            f"\n{frame_at(file, line, source)}\nThese angles go from 0 to 360 degrees, and none of them is from -80 to "
            "-40: bring them to -180 to 180."
        )
    left = [line for line, (low, high) in ends if {-low, -high} == RIGHT]
    if left and not any({low, high} == RIGHT for _, (low, high) in ends) and not MIRRORS.search(ast.unparse(tree)):
        return (
            f"\n{frame_at(file, left[0], source)}\nAngles grow to the left: those on the right are negative, from -80 "
            "to -40."
        )
    if "angle_increment" in source and left + ends and not TURNS.search(ast.unparse(tree)):
        return (
            f". A scanner may begin anywhere, so its angles may go from 0 to 360 degrees: nothing in {file} brings "
            "them to -180 to 180"
        )
    return ""


def _never_negative(tree: ast.Module) -> int:
    """Return the line that brings angles to 0 to 360 degrees, if nothing else in the program may turn them; or 0."""
    rests = [node for node in walk(tree) if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mod)]
    called = {name_of(node.func) for node in walk(tree) if isinstance(node, ast.Call)}
    if len(rests) != 1 or called & TURNING:
        return 0
    circle = {*walk(rests[0].right)}
    if not any(_is_of_a_circle(node) for node in circle):
        return 0
    sums = (node for node in walk(tree) if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)))
    turned = any(rests[0] in walk(each) and each not in walk(rests[0]) for each in sums)
    elsewhere = any(_is_of_a_circle(node) for node in walk(tree) if node not in circle)
    return 0 if turned or elsewhere else rests[0].lineno


def _is_of_a_circle(node: ast.AST) -> bool:
    """Return True for pi, and for numbers of degrees that may turn an angle."""
    return name_of(node) in ("pi", "tau") or getattr(node, "value", None) in (180, 270, 280, 320, 360)


def _kept_nothing(file: str) -> str:
    """Return lines on a follower whose callback keeps nothing of a scan, or that takes the old ones for fresh."""
    source = text_at(Path(file))
    tree = parse(source)
    heard = {name_of(argument(call, *CALLBACKS["create_subscription"])) for call in calls(tree, "create_subscription")}
    for function in named(tree, heard):
        nodes = [*walk(function)]
        stored = [node.value if isinstance(node, ast.Subscript) else node for node in nodes
                  if isinstance(node, (ast.Attribute, ast.Subscript)) and isinstance(node.ctx, ast.Store)]  # fmt: skip
        keeps = any(isinstance(each, ast.Attribute) for each in stored)
        keeps |= any(isinstance(node, (ast.Global, ast.Nonlocal)) for node in nodes)
        returned = [node for node in nodes if isinstance(node, ast.Return) and node.value]
        if returned and not keeps and not any(next(calls(function, name), None) for name in KEEPING):
            return (
                f"\n{frame_at(file, returned[0].lineno, source)}\n'{function.name}' is called with each scan, and what "
                "it returns is lost: a callback keeps it in an attribute, `self.distances = ...`."
            )
    if none := still_none(file):
        return none
    for compared in (each for each in walk(tree) if isinstance(each, ast.Compare)):
        limit = signed_number(compared.comparators[0])
        if name_of(compared.left) == "nanoseconds" and limit is not None and 0.0 < limit < MICROSECOND:
            return (
                f"\n{frame_at(file, compared.lineno, source)}\nThese are nanoseconds, 500,000,000 of which are half a "
                "second: divide them by 1e9."
            )
    for function in (each for each in functions(tree) if "fresh" in each.name):
        for node in (each.value for each in walk(function) if isinstance(each, ast.Return)):
            older = isinstance(node, ast.Compare) and isinstance(node.ops[0], (ast.Gt, ast.GtE))
            if older and isinstance(node, ast.Compare) and name_of(node.comparators[0]) == "FRESH":
                return (
                    f"\n{frame_at(file, node.lineno, source)}\nThis is true for a scan that is older than FRESH, and "
                    "so may not be used."
                )
    return ""


MICROSECOND = 1000  # nanoseconds, fewer of which are meant as seconds or milliseconds
KEEPING = ("append", "put", "setattr", "update", "publish", "set_result")


def not_filled(file: str) -> str:
    """Return what a program's text shows of a command that says nothing: sent before it is filled, or half set."""
    source = text_at(Path(file))
    tree = parse(source)
    for line, why in sent_before_filled(tree):
        return f"that is an empty command\n{frame_at(file, line, source)}\n{why}"
    attributes = [node for node in walk(tree) if isinstance(node, ast.Attribute)]
    stored = [ast.unparse(node) for node in attributes if isinstance(node.ctx, ast.Store)]
    words = {name_of(node) or getattr(node, "arg", "") for node in walk(tree)}
    for field, other in (("linear.x", "angular.z"), ("angular.z", "linear.x")):
        if any(each.endswith(f".{other}") for each in stored) and not words & {field.partition(".")[0], "setattr"}:
            return f"{file} sets `{other}` of the command, and nothing in it sets `{field}`"
    return ""


def other_unit(got: float, wanted: float) -> str:
    """Return a question about a value that is as many times too large as a second has parts; '' for another one."""
    for parts, unit in ((1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")):
        if 0.8 * parts * wanted <= got <= 1.25 * parts * wanted:
            return f", {parts:,.0f} times as much: is the step in {unit}?"
    return ""


def unseen_scans(file: str) -> str:
    """Return lines on a follower that keeps the time of a command and takes it for that of a scan; '' otherwise."""
    source = text_at(Path(file))
    tree = parse(source)
    for call in calls(tree, "Duration"):
        seconds = next((_number(each.value) for each in call.keywords if each.arg == "seconds"), 0.0)
        if seconds >= MILLISECONDS:
            return f"\n{frame_at(file, call.lineno, source)}\nThis is {seconds:g} s: half a second is 0.5."
    heard, timed = (
        [*named(tree, {name_of(argument(call, *CALLBACKS[maker])) for call in calls(tree, maker)})]
        for maker in ("create_subscription", "create_timer")
    )
    if len(heard) != 1 or "stamp" in source or any(next(calls(heard[0], name), None) for name in NOW):
        return ""
    own = {each.name for each in functions(tree)}
    if any(name_of(node.func) in own for node in walk(heard[0]) if isinstance(node, ast.Call) and _of_self(node)):
        return ""  # which may keep the time
    for node in (each for function in timed for each in walk(function) if isinstance(each, ast.Assign)):
        if isinstance(node.targets[0], ast.Attribute) and name_of(getattr(node.value, "func", None)) in NOW:
            return (
                f"\n{frame_at(file, node.lineno, source)}\nThis is the time of a command, not of a scan. Keep the time "
                f"at which a scan comes in '{heard[0].name}'."
            )
    return ""


def _of_self(call: ast.Call) -> bool:
    return isinstance(call.func, ast.Attribute) and name_of(call.func.value) == "self"


def published_only_if(file: str) -> str:
    """Return lines on a timer's callback that publishes in a branch alone; '' if it does so on every path."""
    source = text_at(Path(file))
    tree = parse(source)
    publishing = {each.name for each in functions(tree) if next(calls(each, "publish"), None)}
    if source and "publish" not in ast.unparse(tree).replace("create_publisher", "").replace("publisher", ""):
        return f": nothing in {file} calls `publish`"
    timed = {name_of(argument(call, *CALLBACKS["create_timer"])) for call in calls(tree, "create_timer")}
    for function in named(tree, timed):
        others = {*publishing, "publish"} - {function.name}
        sends = [call for name in sorted(others) for call in calls(function, name)]
        if len(sends) != 1:
            continue
        at, why = sends[0].lineno, "A command must be published each time, also before the first scan."
        branches = [node for node in walk(function) if isinstance(node, ast.If)]
        around = [node.lineno for node in branches if sends[0] in walk(node)]
        if around and not _publishes(function.body, sends[0]):
            return (
                f"\n{frame_at(file, at, source)}\nThis runs in a branch of the `if` of line {min(around)} alone. {why}"
            )
        ends = [each.lineno for node in branches for each in walk(node) if isinstance(each, ast.Return)]
        if ends and min(ends) < at:
            return f"\n{frame_at(file, min(ends), source)}\nThis ends '{function.name}' without a command. {why}"
    return ""


def _publishes(body: list[ast.stmt], send: ast.Call) -> bool:
    """Return True if the statement with `send` is one of `body` itself, or of a block there that always runs."""
    for statement in body:
        if isinstance(statement, (ast.With, ast.Try)):
            if _publishes(statement.body, send) or (
                isinstance(statement, ast.Try) and _publishes(statement.finalbody, send)
            ):
                return True
        elif not isinstance(statement, (ast.If, ast.For, ast.While, ast.Match)) and send in walk(statement):
            return True
    return False


def built_early(file: str, service: str) -> str:
    """Return lines on an answer of `service` that is built before what it reads has changed; '' without one."""
    source = text_at(Path(file))
    tree = parse(source)
    for function in named(tree, service_callbacks(tree, service)):
        response = last_parameter(function)
        for block in (function, *inside(function)):
            body = getattr(block, "body", None)
            for number, statement in enumerate(body if isinstance(body, list) else []):
                target = statement.targets[0] if isinstance(statement, ast.Assign) else None
                if not isinstance(target, ast.Attribute) or name_of(target.value) != response:
                    continue
                if target.attr == "success":  # it may say whether the change that follows is refused
                    continue
                read, later = _attributes(statement, tree), body[number + 1 :]  # type: ignore[index]
                changed = [node for each in later for node in _stored(each) if name_of(node) in read]
                again = [node for each in later for node in walk(each) if isinstance(node, ast.Attribute)
                         and isinstance(node.ctx, ast.Store) and ast.unparse(node) == ast.unparse(target)]  # fmt: skip
                if changed and not again:
                    return (
                        f"\n{frame_at(file, statement.lineno, source)}\nThis reads `{ast.unparse(changed[0])}` before "
                        f"line {changed[0].lineno} changes it. Build the answer last."
                    )
    return ""


def _attributes(statement: ast.stmt, tree: ast.AST) -> set[str]:
    """Return the attributes of the node that a statement reads, itself or by a method that it calls."""
    called = {name_of(node.func) for node in walk(statement) if isinstance(node, ast.Call) and _of_self(node)}
    parts = [statement, *named(tree, called)]
    read = (node for part in parts for node in walk(part) if isinstance(node, ast.Attribute))
    return {node.attr for node in read if name_of(node.value) == "self" and isinstance(node.ctx, ast.Load)}


def _stored(statement: ast.stmt) -> list[ast.Attribute]:
    nodes = [node for node in walk(statement) if isinstance(node, ast.Attribute)]
    return [node for node in nodes if name_of(node.value) == "self" and isinstance(node.ctx, ast.Store)]


def asked_whole(file: str) -> str:
    """Return lines on a condition on a whole request in the place of its field; '' without one."""
    source = text_at(Path(file))
    for line, why in sorted(whole_values(parse(source))):
        return f"\n{frame_at(file, line, source)}\n{why}"
    return ""


def asked_once(file: str) -> str:
    """Return lines on a program that looks for a server only in `__init__`, when there may be none yet; else ''."""
    at = _only_at_the_start(file, "service_is_ready", "wait_for_service")
    return at and f"{at}\nThis looks for the server once, at the start. Look in the callback, each time it is called."


def asked_by_a_timer(file: str) -> str:
    """Return lines on a program in which a timer's callback alone looks for a server, and keeps the result; or ''."""
    source = text_at(Path(file))
    tree = parse(source)
    asked = [call for name in ("service_is_ready", "wait_for_service") for call in calls(tree, name)]
    for timer in calls(tree, "create_timer") if len(asked) == 1 else ():
        for function in named(tree, {name_of(argument(timer, *CALLBACKS["create_timer"]))}):
            kept = [node for node in walk(function) if isinstance(node, ast.Assign) and asked[0] in walk(node)]
            of_the_node = any(isinstance(target, ast.Attribute) for node in kept for target in node.targets)
            if of_the_node and not next(calls(tree, function.name), None):
                return (
                    f"\n{frame_at(file, kept[0].lineno, source)}\nOnly a timer looks for the server, "
                    f"`{ast.unparse(timer)}`, so each request is answered by its last look. Look in the callback of "
                    "the service, each time it is called."
                )
    return ""


def read_once(file: str) -> str:
    """Return lines on a program that reads its parameters only in `__init__`, though they may be set later; else ''."""
    at = _only_at_the_start(file, "get_parameter", "get_parameters", "get_parameter_or")
    return at and f"{at}\nThis reads the parameter once, at the start. Read it where it is used, each time."


def _only_at_the_start(file: str, *names: str) -> str:
    """Return the first line in which a program calls one of these, if it does so in `__init__` alone; else ''."""
    source = text_at(Path(file))
    tree = parse(source)
    made = [call for name in names for call in calls(tree, name)]
    begins = [each for each in functions(tree) if each.name == "__init__"]
    if made and all(any(covers(each, call.lineno) for each in begins) for call in made):
        return f"\n{frame_at(file, made[0].lineno, source)}"
    return ""


def log_of(server: Handle) -> str:
    """Return lines with the end of a program's log, and on a level of its text that is not shown."""
    if not isinstance(server, NodeProcess):
        return ""
    lines = [line for line in server.output.splitlines() if line.strip()][-LISTED:]
    shown = "".join(f"\n  {line}" for line in lines)
    found = f"\nThe end of its log is:{shown}" if shown else "\nIts log is empty."
    for call in calls(parse(server.source), "debug"):
        if isinstance(call.func, ast.Attribute) and "log" in ast.unparse(call.func.value).lower():
            at = frame_at(server.name, call.lineno, server.source)
            return f"{found}\n{at}\nWhat is logged with `debug` is not shown by default: use `info`."
    return found


def broken_chain(file: str, word: str, sets: str = "") -> str:
    """Return lines on an `if` in the place of an `elif`, whose last branches run for `word` as well.

    Or on a comparison with another spelling of it; '' if the text shows neither.  With `sets`, the name of a field,
    only on an `if` whose last branch sets that.
    """
    source = text_at(Path(file))
    for line, meant, why in operations(parse(source)):
        if meant == word and not sets:
            return f"\n{frame_at(file, line, source)}\n{why}"
    for node in walk(parse(source)):
        body = getattr(node, "body", [])
        for number, before in enumerate(body if isinstance(body, list) else []):
            branch = next((each for each in _branches(before) if _compares(each.test)[1] == word), None)
            ends = (ast.Return, ast.Raise, ast.Continue, ast.Break)
            if branch is None or _last(before).orelse or isinstance(branch.body[-1], ends):
                continue
            left, chains = _compares(branch.test)[0], []
            for after in body[number + 1 :]:
                asked = [_holds(each.test, left, word) for each in _branches(after)]
                if not isinstance(after, ast.If) or asked[0] is not False or (left, word) in _equal(after):
                    break
                chains.append(after)
                last = _last(after).orelse
                if sets and sets not in map(name_of, (node for each in last for node in walk(each) if _stores(node))):
                    continue
                if after.orelse and (last or None in asked):
                    more = " So do the others below it." if len(chains) > 1 else ""
                    return (
                        f"\n{frame_at(file, chains[0].lineno, source)}\nThis `if` begins a new chain, whose last "
                        f"branches run for '{word}' as well: write `elif`.{more}"
                    )
    return ""


def _branches(node: ast.stmt) -> Iterator[ast.If]:
    """Yield an `if` and each `elif` of it; nothing for another statement."""
    while isinstance(node, ast.If):
        yield node
        node = node.orelse[0] if len(node.orelse) == 1 else ast.Pass()


def _last(node: ast.stmt) -> ast.If:
    return [*_branches(node)][-1]


def _compares(test: ast.expr) -> tuple[str, object]:
    """Return what a condition compares with `==`, and with which constant; ('', None) for another condition."""
    if isinstance(test, ast.Compare) and len(test.ops) == 1 and isinstance(test.ops[0], ast.Eq):
        return ast.unparse(test.left), getattr(test.comparators[0], "value", None)
    return "", None


def _stores(node: ast.AST) -> bool:
    return isinstance(getattr(node, "ctx", None), ast.Store)


def _equal(node: ast.If) -> list[tuple[str, object]]:
    return [_compares(each.test) for each in _branches(node)]


def _holds(test: ast.expr, left: str, word: str) -> bool | None:
    """Return the value of a condition on what is `left`, if that is this word; None for another condition."""
    if not isinstance(test, ast.Compare) or len(test.ops) != 1 or ast.unparse(test.left) != left:
        return None
    other = test.comparators[0]
    known = [getattr(each, "value", None) for each in getattr(other, "elts", [other])]
    if isinstance(test.ops[0], (ast.Eq, ast.NotEq)) and isinstance(other, ast.Constant):
        return (word in known) == isinstance(test.ops[0], ast.Eq)
    if isinstance(test.ops[0], (ast.In, ast.NotIn)) and all(isinstance(each, str) for each in known):
        return (word in known) == isinstance(test.ops[0], ast.In) if hasattr(other, "elts") else None
    return None


def clamped_wrongly(file: str) -> str:
    """Return lines on two limits that a program exchanges; '' if its text does not show that."""
    source = text_at(Path(file))
    for line, why in sorted(exchanged_limits(parse(source))):
        return f"\n{frame_at(file, line, source)}\n{why[0].upper()}{why[1:]}"
    return ""


def never_reads(file: str, field: str) -> str:
    """Return a sentence on a client that never reads this field of the response; '' if it may."""
    if _may_read(file, field):
        return ""
    return f"\nNothing in {file} reads `{field}` of the response, which says whether it was refused."


def still_none(file: str) -> str:
    """Return lines on an attribute that a program reads, and sets to None alone; '' without one."""
    source = text_at(Path(file))
    for cls in (node for node in walk(parse(source)) if isinstance(node, ast.ClassDef)):
        loaded = {node.attr: node for node in walk(cls)
                  if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Load)}  # fmt: skip
        for name in sorted(only_none(cls) & {*loaded}):
            at = frame_at(file, loaded[name].lineno, source)
            return f"\n{at}\n`self.{name}` is None here, and nothing in {file} sets it to anything else."
    return ""


def no_plain_function(file: str, name: str) -> str:
    """Return a sentence on a function that returns a generator or a coroutine in place of its value; else ''."""
    for function in functions(parse(text_at(Path(file)))):
        if function.name == name and isinstance(function, ast.AsyncFunctionDef):
            return f". Line {function.lineno} of {file}: what an `async def` returns must be awaited; leave `async` out"
        yields = [node.lineno for node in inside(function) if isinstance(node, (ast.Yield, ast.YieldFrom))]
        if function.name == name and yields:
            return f". Line {yields[0]} of {file}: a function with `yield` returns a generator; write `return`"
    return ""


def no_steps(file: str) -> str:
    """Return lines on a text that measures whole seconds alone, where the step from one message to the next is less."""
    source = text_at(Path(file))
    for node in walk(parse(source)):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.FloorDiv):
            try:
                by = ast.literal_eval(ast.unparse(node.right).replace("10 ** 9", "1e9"))
            except ValueError:
                continue
            if isinstance(by, (int, float)) and by >= NANOSECONDS:
                at = frame_at(file, node.lineno, source)
                return f"\n{at}\n`//` leaves the fraction out: less than a second is 0. Write `/`."
    return ""


def zero_replaced(file: str) -> str:
    """Return lines on an `or` that puts a number into the place of a parameter's value of 0; '' without one."""
    source = text_at(Path(file))
    for node in walk(parse(source)):
        if not (isinstance(node, ast.BoolOp) and isinstance(node.op, ast.Or)):
            continue
        value, last = ast.unparse(node.values[0]), ast.unparse(node.values[-1])
        if re.search(r"value\b|parameter", value) and re.fullmatch(r"[\d.]+", last):
            why = f"For `or`, 0 counts as false, so {last} is used in the place of 0"
            return f"\n{frame_at(file, node.lineno, source)}\n{why}. Write `{value}` alone."
    return ""


NANOSECONDS = 1e9  # in a second


def another_name(file: str, name: str) -> str:
    """Return lines on callbacks for parameters that compare a name, and never with this one; '' otherwise."""
    source = text_at(Path(file))
    tree = parse(source)
    made = [*named(tree, parameter_callbacks(tree, "add_post_set_parameters_callback"))]
    if any(getattr(node, "value", None) == name for function in made for node in walk(function)):
        return ""
    for node in (each for function in made for each in walk(function) if isinstance(each, ast.Compare)):
        word = getattr(node.comparators[0], "value", None)
        if name_of(node.left) == "name" and isinstance(word, str):
            return (
                f"\n{frame_at(file, node.lineno, source)}\nThis looks at {word}, and nothing in the callbacks for new "
                f"values looks at {name}."
            )
    return ""
