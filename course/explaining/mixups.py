"""Hints on one thing used in place of another: a class for its object, a method or a future for its result, a file of
the reader's own for a library.
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from course.explaining.source import (
    CALLBACKS,
    argument,
    calls,
    covers,
    functions,
    name_of,
    named,
    parameter_callbacks,
    parse,
    service_callbacks,
    set_on_self,
    the_method_itself,
)
from course.foundation.syntax import walk

# Methods that return what a program needs next, and that are often written without their brackets.
ASKED = {"result", "exception", "get_clock", "get_logger", "now", "get_parameter", "get_result", "get_name"}
ENDS = ("", ")", "]", "}", "))", ")]", "])")  # one of them may complete the first line of a call
NOT_THERE = r"'(?:function|method|builtin_function_or_method)' object has no attribute '(\w+)'"


def class_for_response(source: str) -> tuple[str, int, str] | None:
    """Return a service callback that fills the class of its response: its name, the line and the class; else None."""
    tree = parse(source)
    names = service_callbacks(tree)
    for function in named(tree, names):
        for node in walk(function):
            if isinstance(node, ast.Assign) and isinstance(node.value, ast.Attribute) and node.value.attr == "Response":
                return function.name, node.lineno, ast.unparse(node.value)
    return None


def class_changed(found: re.Match[str], source: str) -> str:
    """Return the hint on a type whose field was set, as in `result = Lift.Result`, `result.stops = ...`."""
    kind = f"{found[1]}.{found[2]}"
    made = [node for node in walk(parse(source)) if isinstance(node, ast.Assign)]
    for node in made:
        if ast.unparse(node.value) == kind:
            again = "" if "rclpy.init(" in source else RESTART
            return (
                f"Line {node.lineno}: `{ast.unparse(node)}` is the class itself. Create one with brackets: `{kind}()`."
                f"{again}"
            )
    if "rclpy.init(" in source:
        return f"Somewhere a field of the class `{kind}` itself is set. Create one with brackets: `{kind}()`."
    return (
        f"Somewhere `{kind}.{found[3]} = ...` was run, without brackets after `{found[2]}`. It has changed the type "
        "itself, for all of this kernel: correct that line, and restart the kernel (Kernel, Restart Kernel)."
    )


RESTART = (
    " The type itself has been changed, for all of this kernel: correct the line, and restart the kernel (Kernel, "
    "Restart Kernel)."
)
# The parts of a type, with the words in a variable's name that tell which one is meant.
PARTS: dict[str, dict[str, tuple[str, ...]]] = {
    "Service": {"Response": ("response", "answer", "reply"), "Request": ("request", "question")},
    "Action": {"Result": ("result",), "Feedback": ("feedback",), "Goal": ("goal",)},
}
MAKERS_OF = {
    "Service": {"create_service": (0, "srv_type"), "create_client": (0, "srv_type")},
    "Action": {"ActionServer": (1, "action_type"), "ActionClient": (1, "action_type")},
}


def type_for_part(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on `response = SetBool()`: only the parts of a type can be made, and this tells which one."""
    made = re.search(r"\b(?!Action(?:Server|Client)\b)([A-Z]\w*)\(", code)
    kind, of = made[1] if made else "TheType", found[1]
    if re.search(rf"\b(?:ros\.\w+|create_service|create_client|ActionServer|ActionClient)\(.*\b{kind}\(", code):
        of_call = " Its fields are given by name." if "ros.call(" in code else ""
        return f"This takes the type itself: `{kind}`, without brackets after it.{of_call}"
    written = code.partition("=")[0].lower() if re.match(r"\s*[\w.]+\s*=[^=]", code) else ""
    for part, words in PARTS[of].items():
        if any(word in written for word in words):
            return _create(kind, part)
    if "publish_feedback(" in code:
        return _create(kind, "Feedback")
    tree = parse(source)
    sends = any(re.search(rf"\b{method}\(", code) for method in ("call", "call_async", "send_goal", "send_goal_async"))
    server, client = MAKERS_OF[of]
    serves, asks = (
        any(name_of(argument(call, *MAKERS_OF[of][maker])) == kind for call in calls(tree, maker))
        for maker in (server, client)
    )
    if sends or (asks and not serves):
        return _create(kind, "Request" if of == "Service" else "Goal")
    if serves and not asks:
        return _create(kind, "Response" if of == "Service" else "Result")
    parts = [f"`{kind}.{part}()`" for part in reversed(PARTS[of])]
    return f"`{kind}` is the whole type. Create the part of it that you need: {', '.join(parts[:-1])} or {parts[-1]}."


def _create(kind: str, part: str) -> str:
    what = "feedback message" if part == "Feedback" else part.lower()
    return f"Create a {what}: `{kind}.{part}(...)`."


def idle_lambda(source: str) -> tuple[str, int, str] | None:
    """Return a service callback that is a `lambda` without a call: its text, its line and what it returns."""
    for call in calls(parse(source), "create_service"):
        given = argument(call, *CALLBACKS["create_service"])
        if isinstance(given, ast.Lambda) and isinstance(given.body, (ast.Attribute, ast.Name)):
            returned = given.body
            if not (isinstance(returned, ast.Name) and returned.id in [each.arg for each in given.args.args[-1:]]):
                return ast.unparse(given), given.lineno, ast.unparse(returned)
    return None


def method_for_result(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on an attribute of a method that was not called, such as `future.result.accepted`."""
    for used in (node for node in walk(line_tree(code)) if isinstance(node, ast.Attribute) and node.attr == found[1]):
        base = used.value
        if isinstance(base, ast.Attribute) and base.attr == "result" and (sent := _future(base.value, source)):
            return (
                f"`{sent}` returns a future, not the answer: wait for it, as in `ros.wait(...)`."
                if re.search(r"\bros\.\w", source) or outside_of_functions(code, source)
                else f"`{sent}` returns a future, not the answer: spin until it is done, then take `future.result()`."
            )
        given = list(assigned(base, source))
        for _, value in list(given):  # what a function of the program returns
            if isinstance(value, ast.Call):
                given += returned(name_of(value.func), source)
        for line, value in given:
            if isinstance(value, ast.Attribute) and value.attr in ASKED:
                return f"Line {line}: {the_method_itself(ast.unparse(value))}"
        if isinstance(base, ast.Attribute) and base.attr in ASKED:
            return the_method_itself(ast.unparse(base))
    return ""


CALLED_FIRST = {"Lock", "RLock", "Condition", "time", "monotonic", "perf_counter", "now"}
UNCALLED = (
    r"'(?:builtin_function_or_method|method|function)' object (?:does not support the context|is not (?:iter|subscr))|"
    r"(?:operand type|between instances).*'(?:builtin_function_or_method|method|function)'"
)


def not_called(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a function used without its brackets, as in `lock = threading.Lock`."""
    tree = line_tree(code)
    callees = {id(node.func) for node in walk(tree) if isinstance(node, ast.Call)}
    inner = {id(node.value) for node in walk(tree) if isinstance(node, ast.Attribute)}
    for used in walk(tree):
        if not isinstance(used, (ast.Attribute, ast.Name)) or id(used) in callees | inner:
            continue
        for line, value in [(0, used), *assigned(used, source)]:
            if isinstance(value, (ast.Attribute, ast.Name)) and _is_function(value, source):
                text = ast.unparse(value)
                return f"{f'Line {line}: ' if line else ''}`{text}` is the function itself. Call it: `{text}()`."
    return ""


def _is_function(value: ast.Attribute | ast.Name, source: str) -> bool:
    """Return True if a name is that of a function of `time` or `threading`, or a clock's `now`."""
    text, name = ast.unparse(value), name_of(value)
    if name not in CALLED_FIRST or not text.endswith(name):
        return False
    modules = ("time.", "threading.", "multiprocessing.")
    return (
        text.startswith(modules)
        or text.endswith("get_clock().now")
        or (
            isinstance(value, ast.Name)
            and re.search(rf"^from (?:time|threading) import .*\b{name}\b", source, re.MULTILINE) is not None
        )
    )


def never_set(found: re.Match[str], source: str) -> str:
    """Return the hint on an attribute that a class sets without `self.`, or in a method that has not run yet."""
    name = f"self.{found[2]}"
    for cls in (node for node in walk(parse(source)) if isinstance(node, ast.ClassDef) and node.name == found[1]):
        made = [node for node in walk(cls) if isinstance(node, ast.Assign)]
        of_self = [node.lineno for node in made if name in map(ast.unparse, node.targets)]
        begins = next((each for each in functions(cls) if each.name == "__init__"), None)
        inside = [*walk(begins)] if begins else []
        local = [node.lineno for node in made if node in inside and found[2] in map(ast.unparse, node.targets)]
        read = any(
            isinstance(each, ast.Name) and each.id == found[2] and isinstance(each.ctx, ast.Load) for each in inside
        )
        if local and not of_self and not read:
            return (
                f"Line {local[0]} sets `{found[2]}`, a variable of `__init__` that nothing reads. For an attribute of "
                f"the object, write `{name} = ...` there."
            )
        if of_self and not local and "del " not in source and "delattr(" not in source:
            first = "give it a first value in `__init__`"
            later = named(cls, parameter_callbacks(cls, "add_post_set_parameters_callback"))
            if any(covers(function, of_self[0]) for function in later):
                return (
                    f"Line {of_self[0]} sets `{name}` in a callback that is called when a parameter is set, not at the "
                    f"start: {first}, too."
                )
            return f"Line {of_self[0]} sets `{name}`, and has not run yet: {first}."
    return ""


MADE_BY = {  # what makes an object of a node, what it is called, and what is done with it
    "create_publisher": ("publisher", r"publish\b"),
    "create_client": ("client", r"call\b|call_async|service_is_ready|wait_for_service"),
    "ActionClient": ("client of an action", r"send_goal|wait_for_server|server_is_ready"),
    "create_timer": ("timer", r"cancel|reset|is_ready"),
}


def not_kept(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a publisher, client or timer that is used by a name under which no line keeps it."""
    name = found[2]
    used = re.search(rf"\bself\.{name}\.(\w+)", code)
    cls = next((each for each in walk(parse(source)) if isinstance(each, ast.ClassDef) and each.name == found[1]), None)
    maker = next((each for each, (_, uses) in MADE_BY.items() if used and re.match(uses, used[1])), "")
    if not cls or not maker or name in {node.attr for node in set_on_self(cls)}:
        return ""
    what, made = MADE_BY[maker][0], [*calls(cls, maker)]
    thrown = [node.value for node in walk(cls) if isinstance(node, ast.Expr) and node.value in made]
    kept = [
        target for node in walk(cls) if isinstance(node, ast.Assign) and node.value in made for target in node.targets
    ]
    pythons = (
        f" (`{name}s`, which Python proposes, is a list of rclpy's.)" if f"mean: '{name}s'" in found.string else ""
    )
    if thrown:
        call = ast.unparse(thrown[0].func)
        return f"Line {thrown[0].lineno} keeps the {what} under no name: write `self.{name} = {call}(...)`.{pythons}"
    if len(kept) == 1:
        text = ast.unparse(kept[0])
        how = "use that name here, too" if text.startswith("self.") else f"write `self.{name} = ...` there"
        return f"Line {kept[0].lineno} keeps the {what} in `{text}`: {how}.{pythons}"
    return ""


def class_passed(cls: str, source: str) -> int:
    """Return the line in which a program keeps or passes the class `cls` itself; 0 if none does."""
    for node in walk(parse(source)):
        if not isinstance(node, (ast.Assign, ast.Call)):
            continue
        values = [node.value] if isinstance(node, ast.Assign) else node.args
        if any(isinstance(value, ast.Name) and value.id == cls for value in values):
            return node.lineno
    return 0


def parameter_counts(cls: str, method: str, source: str) -> Iterator[int]:
    """Yield the numbers of parameters of a method in a program, or in the own module that it has the class from."""
    texts = [source]
    for node in walk(parse(source)):
        if isinstance(node, ast.ImportFrom) and node.module and any(each.name == cls for each in node.names):
            path = Path(f"{node.module}.py")
            texts += [path.read_text(encoding="utf-8", errors="replace")] if path.is_file() else []
    for text in texts:
        for made in walk(parse(text)):
            if isinstance(made, ast.ClassDef) and made.name == cls:
                yield from (len(each.args.args) for each in functions(made) if each.name == method)


def outside_of_functions(code: str, source: str) -> bool:
    """Return True if a line is one of a cell, outside of functions, where a cell may wait."""
    return re.search(rf"^{re.escape(code)}\s*$", source, re.MULTILINE) is not None and "rclpy.init(" not in source


def not_a_future(found: re.Match[str], source: str) -> str:
    """Return the hint on a response, or something else, where a future is needed."""
    if "'GoalRecorder'" in found[0]:
        return "A recorder is not a future: its `wait_end()` waits for the end of its goal."
    if "GoalHandle'" in found[0]:
        return "A goal handle is not a future: `ros.wait(handle.get_result_async())` waits for the end of its goal."
    what = f"the response of {found[1]}" if found[1] else "None" if "'NoneType'" in found[0] else "something else"
    if not re.search(r"\bros\.\w", source):
        return f"A future is needed here, such as that of `client.call_async(...)`, and this is {what}."
    waited = " `ros.call(...)` has waited already, and returns the response itself." if "ros.call(" in source else ""
    return f"`ros.wait(...)` takes a future, such as that of `client.call_async(...)`, and gets {what}.{waited}"


def function_to_wait_for(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a function that is not called where a future is needed, `ros.wait(asker.send)`; or ''."""
    given = re.search(r"\b(ros\.wait)\(\s*([\w.]+)\s*[,)]", code)
    if given is None:
        return ""
    return (
        f"`{given[2]}` is a function, and without brackets it is not called. Call it, and wait for the future that it "
        f"returns: `{given[1]}({given[2]}(...))`."
    )


def hidden_by_file(found: re.Match[str], source: str) -> str:
    """Return the hint on a module of the reader's folder with the name of an installed one, or ''."""
    name = (found[1] or found[2]).partition(".")[0]
    own = next((each for each in (Path(f"{name}.py"), Path(name)) if each.exists()), None)
    if own is None or (own.suffix and not _imports(source, name) and not _lacks(name, found.string)):
        return ""
    if name not in sys.stdlib_module_names and not _installed(name):
        return ""
    kind = "The folder" if own.is_dir() else "The file"
    return f"{kind} {own} beside the notebook hides the installed module `{name}`: rename it."


def _lacks(name: str, error: str) -> bool:
    """Return True if the module `name` of this kernel, another one, has what the error says that it lacks."""
    lacking = re.search(r"no attribute '(\w+)'|cannot import name '(\w+)'", error)
    module = sys.modules.get(name)
    elsewhere = Path(getattr(module, "__file__", None) or "/").resolve().parent != Path.cwd()
    return lacking is not None and elsewhere and hasattr(module, lacking[1] or lacking[2])


def session_overwritten(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on the name `ros` of a cell that no longer stands for the session."""
    main = vars(sys.modules["__main__"]) if "__main__" in sys.modules else {}
    kind = type(main.get("ros")).__name__
    if "ros" not in main or kind == "Session" or kind != found[1] or not re.search(rf"\bros\.{found[2]}\b", code):
        return ""
    return "A cell has assigned another value to `ros`: run the first code cell, `ros = course.live()`, again."


def _future(node: ast.expr, source: str) -> str:
    """Return the call of `..._async` that an expression is, or is assigned from; '' for another one."""
    for value in [node, *(value for _, value in assigned(node, source))]:
        if isinstance(value, ast.Call) and name_of(value.func).endswith("_async"):
            return f"{ast.unparse(value.func)}(...)"
    return ""


def assigned(target: ast.expr, source: str) -> Iterator[tuple[int, ast.expr]]:
    """Yield the values that a program assigns to an expression such as `self.handle`, the last first, with lines."""
    text = ast.unparse(target)
    made = [node for node in walk(parse(source)) if isinstance(node, ast.Assign)]
    for node in sorted(made, key=lambda node: -node.lineno):
        if any(ast.unparse(each) == text for each in node.targets):
            yield node.lineno, node.value


def returned(function: str, source: str) -> Iterator[tuple[int, ast.expr]]:
    """Yield the values that a function of a program returns, with their lines."""
    for each in functions(parse(source)):
        for node in walk(each) if each.name == function else ():
            if isinstance(node, ast.Return) and node.value is not None:
                yield node.lineno, node.value


def line_tree(code: str) -> ast.Module:
    """Return the syntax tree of a line, which may be the first of a block or of brackets: `if not handle.accepted:`."""
    code = re.sub(r"^el(?=if\b)", "", f"{code} pass" if code.endswith(":") else code)
    return next((tree for end in ENDS if (tree := parse(f"{code}{end}")).body), ast.Module([], []))


def _imports(source: str, name: str) -> bool:
    for node in walk(parse(source)):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        if any(each.partition(".")[0] == name for each in names):
            return True
    return False


def _installed(name: str) -> bool:
    """Return True if a module of this name is installed, outside of the reader's folder."""
    here = Path.cwd()
    roots = [Path(each) for each in sys.path if each and Path(each).resolve() != here]
    return any((root / name).is_dir() or (root / f"{name}.py").is_file() for root in roots)
