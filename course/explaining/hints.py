"""Hints on the causes of the errors that students of ROS 2 meet most, a sentence each.

There is a hint only if the cause is known.
"""

import ast
import builtins
import difflib
import inspect
import re
import sys
from collections.abc import Callable
from pathlib import Path

from rclpy.node import Node

from course.explaining import wrong_forms
from course.explaining.arguments import (
    argument_count,
    called_by_hand,
    lambda_arguments,
    logged,
    node_without_quotes,
    of_an_argument,
    of_start,
    order_of_arguments,
    self_behind_super,
    unknown_keyword,
    wrong_kind,
)
from course.explaining.clashes import two_types
from course.explaining.endings import around, ended_twice, refused_by_raising
from course.explaining.field_values import no_value
from course.explaining.interface_parts import (
    SENT,
    by_name,
    no_such_argument,
    no_such_field,
    not_a_list,
    not_a_message,
    nothing_sent,
    of_a_goal_handle,
    sent,
    sent_by_name,
    sub_message,
    type_for_goal,
    unknown_field,
    wrapped,
    wrong_type,
)
from course.explaining.missing_names import (
    is_a_module,
    is_module,
    no_such_class,
    of_rclpy,
    of_the_course,
    own_attribute,
    unbound,
    written_outside,
)
from course.explaining.mixups import (
    NOT_THERE,
    UNCALLED,
    class_changed,
    class_for_response,
    class_passed,
    function_to_wait_for,
    hidden_by_file,
    idle_lambda,
    line_tree,
    method_for_result,
    never_set,
    not_a_future,
    not_called,
    not_kept,
    outside_of_functions,
    parameter_counts,
    session_overwritten,
    type_for_part,
)
from course.explaining.nothing import (
    attribute_of_nothing,
    awaited_nothing,
    gave_nothing,
    returned_nothing,
    silent_helper,
)
from course.explaining.of_parameters import list_of_parameters, no_check_result, parameter_kept, parameters_for_one
from course.explaining.operands import NUMBERS, duration_and_number, product, time_without, unfit
from course.explaining.overwritten import (
    NO_TYPE,
    NOT_CALLABLE,
    called,
    hidden_here,
    of_its_part,
    overwritten,
    with_article,
)
from course.explaining.parameter_files import unparsed
from course.explaining.ros_1 import library
from course.explaining.slips import hides_a_property, methods_asked
from course.explaining.source import (
    CALLBACKS,
    argument,
    callbacks,
    called_callback,
    calls,
    functions,
    given_callbacks,
    hidden_method,
    hides_rclpy,
    inside,
    methods,
    misspelt_init,
    name_of,
    named,
    node_classes,
    parameter_callbacks,
    parse,
    service_callbacks,
    spins_a_class,
    the_method_itself,
    undecorated,
    value_for_callback,
    wrong_return,
)
from course.foundation import cells
from course.foundation.syntax import walk

# Attributes of rclpy's node whose names a class may use by mistake.
OF_A_NODE = ("_parameters", "_parameter_overrides", "_descriptors", "_clock", "_logger", "_context")
Function = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda
SENDS = "|".join(SENT)
LOOKED = 4000  # characters: an error may hold all that a program has printed


def hint(error: str, source: str = "", code: str = "") -> str:
    """Return a hint on `error`, the last line of a traceback (`TypeError: ...`), or ''.

    `source` is the text of the program, and `code` the reader's line that caused the error.  Only the first LOOKED
    characters of the error are searched.
    """
    error = error[:LOOKED]
    for pattern, line, text in IN_A_LINE:
        if re.search(pattern, error) and re.search(line, code):
            return text
    for pattern, explain_line in OF_A_LINE:
        if (found := re.search(pattern, error)) and (text := explain_line(found, source, code)):
            return text
    for pattern, explain in KNOWN:
        if (found := re.search(pattern, error, re.DOTALL)) and (text := explain(found, source)):
            return text
    return ""


# --- the causes ---


def _nothing_returned(found: re.Match[str], source: str) -> str:
    tree = parse(source)
    for function in named(tree, service_callbacks(tree)):
        for node in (each for each in inside(function) if isinstance(each, (ast.Yield, ast.YieldFrom))):
            asks = any(isinstance(each, ast.Call) for each in walk(node))
            how = "`await`, and `async def`" if asks else "`return response`"
            return (
                f"`yield` in line {node.lineno} makes a generator of the service callback '{function.name}', which "
                f"runs nothing and returns no response: write {how}."
            )
    if made := class_for_response(source):
        return f"`{made[2]}` is the class of the response. Create one with brackets: `{made[2]}()`."
    if idle := idle_lambda(source):
        return f"The callback `{idle[0]}` calls nothing: pass the method itself, `{idle[2]}`."
    if callback := wrong_return(source):
        name, _, returned = callback
        if re.match(r"\w+ = ", returned):
            return (
                f"In the service callback '{name}', `{returned}` replaces the response that it is given. Set the "
                "fields of the given one instead (`response.field = ...`), and return it."
            )
        if ".Response(" in returned:
            return (
                f"The service callback '{name}' returns `{returned}`, but its service has another type: fill in the "
                "response that it is given, and return that."
            )
        what = f"`{returned}`, not the response" if returned else "nothing"
        return f"The service callback '{name}' returns {what}: end it with `return response`."
    if helper := silent_helper(source):
        return (
            f"The service callback '{helper[2]}' returns what `{helper[0]}` returns, which is nothing: end "
            f"`{helper[0]}` with `return response`, on every path through it."
        )
    return "Did your callback return the response? A service callback must end with `return response`."


def _parameter_for_value(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a line that gives a field a Parameter, directly or by a name."""
    if re.search(r"get_parameter_value\(\)(?!\s*\.)", code):
        return OF_A_PARAMETER_VALUE
    if not re.search(r"get_parameter\([^()]*\)(?!\s*\.)", code) and not any(
        re.search(rf"(?<![\w.]){re.escape(name)}(?!\s*[\w.(=])", code) for name in _parameters_kept(source)
    ):
        return ""
    return OF_A_PARAMETER


def _parameters_kept(source: str) -> set[str]:
    """Return the names that a program gives to what `get_parameter(...)` returns."""
    made = [node for node in walk(parse(source)) if isinstance(node, ast.Assign)]
    kept = [each for each in made if isinstance(each.value, ast.Call) and name_of(each.value.func) == "get_parameter"]
    return {ast.unparse(target) for each in kept for target in each.targets}


OF_A_LIST = "`set_parameters` takes a list: `set_parameters([Parameter(...)])`."
OF_A_PARAMETER = "`get_parameter(...)` returns a Parameter: its value is `.value`."
OF_ITS_TYPE = (
    "A ParameterValue is a message with a field for each type: the value is in `.double_value`, `.integer_value`, "
    "`.string_value`, ..."
)
OF_A_PARAMETER_VALUE = (
    "`get_parameter_value()` returns a message with a field for each type, such as `.double_value`. Shorter: "
    "`self.get_parameter('kp').value`."
)


def _init_as_context(found: re.Match[str], source: str) -> str:
    tree = parse(source)
    managed = (item.context_expr for node in walk(tree) if isinstance(node, ast.With) for item in node.items)
    if any(isinstance(each, ast.Call) and ast.unparse(each.func) in ("rclpy.init", "init") for each in managed):
        return (
            "`with rclpy.init()` needs a newer release: in ROS 2 Jazzy, `rclpy.init()` returns nothing. Call it on a "
            "line of its own, and `rclpy.try_shutdown()` in a `finally`."
        )
    return ""


def _no_node_name(found: re.Match[str], source: str) -> str:
    if name := misspelt_init(source):
        return f"The constructor is called `__init__`, with two underscores on each side: you have `{name}`."
    return "Give the node a name: `super().__init__('my_node')`."


def _no_constructor(found: re.Match[str], source: str) -> str:
    if name := misspelt_init(source, found[1]):
        return (
            f"The constructor of {found[1]} is called `__init__`, with two underscores on each side: you have `{name}`."
        )
    return ""


def _not_callable(found: re.Match[str], source: str) -> str:
    if hidden := hidden_method(source):
        name, line = hidden
        return f"`self.{name} = ...` in line {line} replaces the method `{name}`: rename one of the two."
    if called := called_callback(source):
        method, line = called
        return f"Line {line} calls `self.{method}()` at once, and passes what it returns: write `self.{method}`."
    for call, given in given_callbacks(parse(source)):
        if isinstance(given, ast.Constant) and isinstance(given.value, str):
            name = given.value.removeprefix("self.")
            return f"Line {call.lineno} gives the callback as a text: write it without quotation marks, `self.{name}`."
    return "What is called here is not a function. Pass a callback by its name, without brackets: `self.add`."


def _wrong_callback(found: re.Match[str], source: str) -> str:
    if hidden_method(source) or called_callback(source):
        return _not_callable(found, source)
    given = [argument(call, *CALLBACKS["create_subscription"]) for call in calls(parse(source), "create_subscription")]
    for each in given:
        if isinstance(each, ast.Call) and name_of(each.func) != "partial":
            called_at_once, function = ast.unparse(each), ast.unparse(each.func)
            return (
                f"`{called_at_once}` is called at once, and the subscription gets what it returns. Pass the function "
                f"itself, `{function}`, or `lambda msg: {called_at_once}`."
            )
        if isinstance(each, ast.Name) and isinstance(getattr(sys.modules.get("__main__"), each.id, None), list):
            return f"`{each.id}` is a list, not a function: pass its method, `{each.id}.append`."
    of_self = not given or any(isinstance(each, ast.Attribute) for each in given)
    example = "(self, msg)" if of_self else "lambda msg: ..."
    return f"The callback of a subscription must take the message: `{example}`."


def _class_for_node(found: re.Match[str], source: str) -> str:
    if spun := spins_a_class(source):
        call, name, line = spun
        return f"`{call}` in line {line} gets the class `{name}`, and needs a node of it: `node = {name}()`."
    return ""


SPINS = re.compile(r"\bspin\w*\(")  # a line that runs the callbacks, and so may show an error of any of them
PLAIN = ("bool", "int", "float", "str", "list", "array", "dict", "tuple")


def _called_here(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on what a line calls, if it calls anything but Python's own functions."""
    names = [name for name in dict.fromkeys(map(ast.unparse, called(code))) if not hasattr(builtins, name)]
    if not code or SPINS.search(code) or hidden_method(source) or called_callback(source):
        return ""
    kind = with_article(found[1])
    properties = {each.name for each in functions(parse(source)) if "property" in map(name_of, each.decorator_list)}
    if len(names) == 1 and (name := names[0].rpartition(".")[2]) in properties:
        return f"`{name}` is a property: leave out the brackets, `{names[0]}`."
    products = _products(code) if found[1] in NUMBERS else []
    if len(names) == 1 and products:
        told = f"`{names[0]}` is {kind} here, not a function. To multiply, write `{products[0]}`."
        return told if names[0][0].isdecimal() else f"{told} If a function is meant, check where it gets its value."
    if len(names) == 1 and names[0].count(".") == 1 and found[1] in PLAIN:  # a field, or an attribute of the node
        if given := of_an_argument(names[0], kind, source):
            return given
        return f"`{names[0]}` is {kind} here, not a function: leave out the brackets after it."
    if len(names) == 1:
        return f"`{names[0]}` is {kind} here, not a function: check where it gets its value."
    told = f"Something that is called in this line is {kind}, not a function: check where each name gets its value."
    return f"{told} A product is written with `*`." if products else told


def _products(code: str) -> list[str]:
    """Return the products for which the calls of a line may be meant; those of Python's own functions are left out."""
    made = [node for node in walk(line_tree(code)) if isinstance(node, ast.Call)]
    return [*filter(None, (product(each) for each in made if not hasattr(builtins, ast.unparse(each.func))))]


def _value_for_callback(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a value that is given in the place of a method: `self.blocked` for `self.block`."""
    given = value_for_callback(source, found[1])
    if not given:
        return ""
    name, line = given
    if code and not SPINS.search(code) and code != source.splitlines()[line - 1].strip():
        return ""
    free = undecorated(functions(parse(source))) - callbacks(parse(source))
    near = difflib.get_close_matches(name, free, 1, 0.7)
    how = f"Is `self.{near[0]}` meant?" if near else "Give a method there, by its name without brackets."
    return f"Line {line} gives `self.{name}`, {with_article(found[1])}, as a callback, which must be a function. {how}"


def _response_for_callback(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on `cancel_callback=CancelResponse.ACCEPT`, or on brackets after such a response."""
    kind, what = found[1], found[1].removesuffix("Response").lower()
    if re.search(rf"\b{kind}\.\w+\(", code):
        return f"`{kind}.ACCEPT` and `{kind}.REJECT` are not functions: leave out the brackets after them."
    given = "goal_handle" if what == "cancel" else "goal"
    return (
        f"`{what}_callback` takes a function that returns the {kind}: "
        f"`{what}_callback=lambda {given}: {kind}.ACCEPT`, for example."
    )


def _of_rclpy(found: re.Match[str], source: str) -> str:
    name = found[1] or found[2]
    return f"rclpy's Node already has an attribute `{name}`: choose another name." if hasattr(Node, name) else ""


GROUP = re.compile(r"=\s*(\w+CallbackGroup)\s*(?:[,)#]|$)", re.MULTILINE)


def _method_indexed(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on square brackets after a method of the session, `ros.nodes["/a"]`."""
    named = re.findall(r"\bros\.(\w+)\[", code)
    return f"`ros.{named[0]}` is a method: call it with round brackets, `ros.{named[0]}(...)`." if named else ""


# What a parameter of a type is called, which texts look like a value of it, and what to write for any other text.
OF_TYPE = {
    "DOUBLE": ("a double", r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", "a number with a point, such as 1.0"),
    "INTEGER": ("an integer", r"[+-]?\d+", "a whole number"),
    "BOOL": ("a bool", "True|False", "True or False"),
}


def _wrong_parameter_type(found: re.Match[str], source: str) -> str:
    if words := unparsed(found.string):
        return words
    if text := re.search(r"to '([^']*)' of type 'STRING', expecting type '(DOUBLE|INTEGER|BOOL)'", found.string):
        kind, pattern, example = OF_TYPE[text[2]]
        value = f"{text[1]}.0" if text[2] == "DOUBLE" and text[1].lstrip("+-").isdecimal() else text[1]
        how = f"write {value} without quotation marks" if re.fullmatch(pattern, text[1]) else f"write {example}"
        return f"The parameter was declared as {kind}, and '{text[1]}' is text: {how}."
    return "The default of a parameter fixes its type: 1.0 makes a double, 1 an integer."


def _name_of_a_check(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on the name of a check without its quotation marks: `course.check(lift-server)`."""
    named = re.search(r"\bcourse\.check\(\s*([A-Za-z_]\w*(?:\s*-\s*\w+)*)\s*\)", code)
    if not named or (found[1] and found[1] not in re.split(r"\s*-\s*", named[1])):
        return ""
    name = re.sub(r"\s", "", named[1])
    known = [cell.name for _, page in cells.readable(cells.notebooks(Path())) for cell in page if cell.public_check]
    name = cells.check_meant([name], known) or name
    return f"The name of a check is a text, in quotation marks: `course.check('{name}')`."


def _after_the_shutdown(source: str) -> str:
    """Return the hint on a node that is used when a program, which calls `init`, has shut rclpy down, or ''."""
    ends = [call for name in ("shutdown", "try_shutdown") for call in calls(parse(source), name)]
    if not ends or not list(calls(parse(source), "init")):
        return ""
    return f"`{ast.unparse(ends[0])}` in line {ends[0].lineno} has already run: call it when all is done."


def _without_a_context(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a spin, or an executor, where rclpy has no context: it is not there yet, or is shut down."""
    if not code:  # the line of a spin in main() is not shown
        late = [each for each in functions(parse(source)) if _spins_after_the_shutdown(each)]
        return _after_the_shutdown(source) if late else ""
    if not re.search(r"\bspin\w*\(|Executor\(", code):
        return ""
    if "rclpy.init(" in source:
        return _after_the_shutdown(source) if _follows_the_shutdown(code, source) else ""
    made = re.search(r"(\w+Executor)\(", code)
    if not made or "context=" in code:
        return ""
    if "call_async(" in source and around(code, source, service_callbacks(parse(source))):
        return (
            "A callback needs no executor of its own to wait for an answer: make it `async def`, and write "
            "`await client.call_async(...)`."
        )
    return f"In a notebook an executor needs the context of the node: `{made[1]}(context=node.context)`."


def _spins_after_the_shutdown(function: ast.AST) -> bool:
    ends = [call.lineno for name in ("shutdown", "try_shutdown") for call in calls(function, name)]
    return any(end < call.lineno for end in ends for call in calls(function, "spin"))


def _follows_the_shutdown(code: str, source: str) -> bool:
    """Return True if a line stands below the call that shuts rclpy down, in the same function."""
    for function in around(code, source):
        ends = [call.lineno for name in ("shutdown", "try_shutdown") for call in calls(function, name)]
        lines = [number for number, line in enumerate(source.splitlines(), 1) if line.strip() == code.strip()]
        if any(end < line for end in ends for line in lines):
            return True
    return False


def _still_none(found: re.Match[str], source: str, code: str) -> str:
    held = re.findall(r"self\.(\w+)", code)
    for name in re.findall(r"(?<![\w.])(\w+)\[", code):
        around = [each for each in functions(parse(source)) if code in (ast.get_source_segment(source, each) or "")]
        text = (ast.get_source_segment(source, around[-1]) or "") if around else source
        held += re.findall(rf"^\s*{name} = self\.(\w+)(?:\s*#.*)?$", text, re.MULTILINE)
        made = re.findall(rf"^\s*{name} = (?:(?:\w+\.)*(\w+)\()?", text, re.MULTILINE)
        if len(made) == 1 and made[0] and not hasattr(builtins, made[0]):
            return f"`{made[0]}` returned None. It must return a value on every path through it."
    if asked := next(methods_asked(parse(source)), None):
        return f"Line {asked[0]}: {asked[1]}"
    if silent := returned_nothing(source, code):
        return silent
    for name in held:
        if re.search(rf"self\.{name} = None\b", source):
            stored = [node for node in walk(parse(source)) if getattr(node, "attr", "") == name]
            if sum(isinstance(node.ctx, ast.Store) for node in stored) == 1 and "setattr" not in source:  # type: ignore[attr-defined]
                return f"`self.{name}` is None, and nothing in this text sets it to anything else."
            return (
                f"`self.{name}` is None until a callback has set it: check `if self.{name} is None` before you use it."
            )
    return ""


def _future(found: re.Match[str], source: str) -> str:
    if "create_service" not in source:
        return (
            "`..._async(...)` returns a future, not the answer: wait with "
            "`rclpy.spin_until_future_complete(node, future)`, then take `future.result()`."
        )
    return (
        "`call_async` returns a future, not the response: in an `async def` callback write "
        "`await client.call_async(...)`."
    )


def _future_used(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a future in a done callback, which has it from rclpy, or outside of functions in a cell."""
    tree = parse(source)
    given = [argument(call, *CALLBACKS["add_done_callback"]) for call in calls(tree, "add_done_callback")]
    callbacks: list[Function] = [each for each in given if isinstance(each, ast.Lambda)]
    callbacks += [each for each in functions(tree) if each.name in {*map(name_of, given)} - {""}]
    for each in callbacks:
        names = {argument.arg for argument in each.args.args}
        for node in walk(each):
            if isinstance(node, ast.Attribute) and node.attr == found[1] and ast.unparse(node.value) in names:
                future = ast.unparse(node.value)
                return (
                    f"A done callback gets the future, not the answer: take that first, `{future}.result().{found[1]}`."
                )
    if code and outside_of_functions(code, source):
        return "`..._async(...)` returns a future, not the answer: wait for it, as in `ros.wait(future)`."
    return ""


OF_PYTHON = {"true": "True", "false": "False", "null": "None", "NULL": "None", "none": "None", "this": "self"}


def _of_arrays(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on arrays compared as if they were numbers: `low <= degrees <= high`, `near and usable`."""
    tree = line_tree(code)
    nodes = [*walk(tree)]
    if any(isinstance(node, (ast.If, ast.While, ast.IfExp, ast.Assert)) for node in nodes):
        return ""  # a single truth value is wanted here
    for node in (each for each in nodes if isinstance(each, ast.Compare) and len(each.ops) == 1):
        joined = node.left
        if isinstance(joined, ast.BinOp) and isinstance(joined.op, (ast.BitAnd, ast.BitOr)):
            sign = "&" if isinstance(joined.op, ast.BitAnd) else "|"
            meant = ast.unparse(ast.Compare(joined.right, node.ops, node.comparators))
            return f"`{sign}` comes before a comparison, so each comparison needs brackets: `{sign} ({meant})`."
    chained = any(isinstance(node, ast.Compare) and len(node.ops) > 1 for node in nodes)
    if not chained and not any(isinstance(node, ast.BoolOp) for node in nodes):
        return ""
    return (
        "Arrays are combined with `&` and `|`, not with `and`, `or` or `low <= a <= high`, and each comparison needs "
        "brackets: `(low <= a) & (a <= high)`."
    )


def _not_declared(found: re.Match[str], source: str) -> str:
    if hidden := hides_rclpy(source, OF_A_NODE):
        return HIDES.format(hidden[1], hidden[0])
    tree = parse(source)
    declared = [call.lineno for call in calls(tree, "declare_parameter") if _names(call, found[1])]
    made = [each for each in functions(tree) if each.name == "__init__"]
    read = [call.lineno for each in made for call in calls(each, "get_parameter") if _names(call, found[1])]
    early = bool(declared) and any(line < declared[0] for line in read)
    for call in calls(tree, "add_on_set_parameters_callback"):
        if declared and call.lineno < declared[0] and not early:
            return (
                f"Each declaration calls the callback that line {call.lineno} registers, also before '{found[1]}' is "
                "declared. Register it after the declarations, or let it read only parameters that it is given."
            )
    texts = (argument(call, 0, "name") for call in calls(tree, "declare_parameter"))
    known = [str(each.value) for each in texts if isinstance(each, ast.Constant)]
    near = [each for each in known if each.lower() == found[1].lower()]  # in other capitals
    near = near or difflib.get_close_matches(found[1], known, 1, 0.8)
    if not declared and (near := near or [each for each in known if found[1] == f"self.{each}"]):
        return f"No parameter '{found[1]}' is declared. Did you mean '{near[0]}'?"
    return f"Declare it in `__init__`, before anything reads it: `self.declare_parameter('{found[1]}', default)`."


def _beam(found: re.Match[str], source: str, code: str) -> str:
    for node in (each for each in walk(parse(source)) if isinstance(each, ast.Compare)):
        if [ast.unparse(each) for each in node.comparators] == ["[]"] and f"{ast.unparse(node.left)}[" in code:
            name = ast.unparse(node.left)
            what = f"Line {node.lineno}: an array is never equal to a list."
            return f"{what} Write `len({name})`, or begin with `list(...)`."
    if "ranges[" not in code or ".ranges" not in code + source:
        return ""
    return "Scanners differ in their number of beams. Find a beam by its angle: angle_min + index * angle_increment."


def _angles_to_the_end(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on angles that are counted up to a scan's `angle_max`, which need not be as many as its beams."""
    for call in calls(parse(source), "arange"):
        if any(name_of(each) == "angle_max" for each in call.args):
            return (
                f"Line {call.lineno} counts the angles up to `angle_max`, which need not be as many as the beams. "
                "There is one for each: `scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))`."
            )
    return ""


def _word_for_number(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a word of the command line that `argparse` was not told to make a number."""
    for call in calls(parse(source), "add_argument"):
        names = [each.value for each in call.args if isinstance(each, ast.Constant) and isinstance(each.value, str)]
        stem = (next((each for each in names if each.startswith("--")), names[0]) if names else "").lstrip("-")
        if (
            stem
            and re.search(rf"\b{stem.replace('-', '_')}\b", code)
            and not {each.arg for each in call.keywords} & {"type", "action", None}
        ):
            return (
                "A word of the command line is text: for a number, write `type=int` (or `float`) in "
                f"`add_argument({names[0]!r}, ...)`."
            )
    return ""


def _words_for_numbers(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a list of words of the command line that a field of numbers is given."""
    if found[1] not in ("int", "float") or re.search(r"\b(?:int|float)\b", code):
        return ""
    if "sys.argv[" in code:
        return f"Words of the command line are text: `[{found[1]}(word) for word in ...]` makes numbers of them."
    lists = "[" in code or any(
        each.arg == "nargs" for call in calls(parse(source), "add_argument") for each in call.keywords
    )
    return _word_for_number(found, source, code) if lists else ""


def _method_in_a_sum(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a method that is used as if it were what it returns: `'Motors ' + self.state`."""
    own = undecorated(functions(parse(source)))
    called_there = {id(node.func) for node in walk(line_tree(code)) if isinstance(node, ast.Call)}
    for node in (each for each in walk(line_tree(code)) if isinstance(each, ast.Attribute)):
        if id(node) not in called_there and name_of(node.value) == "self" and node.attr in own:
            return the_method_itself(ast.unparse(node))
    return ""


def _tuple_for_dict(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a tuple that a line reads as a dict: `distances['front']`."""
    named = re.findall(r"(?<![\w.])(\w+)\[\s*['\"]", code)
    if len({*named}) != 1:
        return ""
    given = any(named[0] in (one.arg for one in each.args.args) for each in around(code, source))
    where = "its caller passes one" if given else "check where it gets its value"
    return f"`{named[0]}` is a tuple, not a dict: {where}. A dict has its keys in braces: `{{'front': ...}}`."


def _hidden_property(found: re.Match[str], source: str) -> str:
    hidden = sorted(methods(source) & {name for name in dir(Node) if isinstance(getattr(Node, name), property)})
    return f"The method `{hidden[0]}` hides rclpy's own: choose another name." if hidden else ""


def _hidden_in_a_class(found: re.Match[str], source: str) -> str:
    hidden = next(hides_a_property(parse(source)), None)
    return f"Line {hidden[0]}: {hidden[1]}" if hidden else ""


def _names(call: ast.Call, name: str) -> bool:
    return bool(call.args) and isinstance(call.args[0], ast.Constant) and call.args[0].value == name


def _without_end(found: re.Match[str], source: str, code: str) -> str:
    tree = parse(source)
    for function in functions(tree):
        if "set_parameters" in code and function.name in parameter_callbacks(tree):
            for call in [*calls(function, "set_parameters"), *calls(function, "set_parameters_atomically")]:
                if name_of(getattr(call.func, "value", None)) == "self":
                    return (
                        f"Setting a parameter in '{function.name}' calls the parameter callbacks again, this one too, "
                        "without end. To change one parameter along with another, add it to the list that a pre-set "
                        "callback returns."
                    )
    return ""


def _of_the_class(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a method called on its class: `Agent` was passed instead of `Agent()`."""
    cls, method = found[1].split(".")[-1], found[2]
    static = (each for each in functions(parse(source)) if "staticmethod" in map(name_of, each.decorator_list))
    if any(each.name == method and [one.arg for one in each.args.args[:1]] == ["self"] for each in static):
        return f"`{method}` is static and gets no `self`: leave out `@staticmethod`, or `self`."
    if re.search(rf"(?<![\w.]){cls}\.{method}\(", code):
        kept = _objects(cls, source)
        example = f": `{kept}.{method}(...)`" if kept else f", the name that you give to `{cls}(...)`"
        return f"`{method}` is called on the class {cls} here. Call it on an object of the class{example}."
    sent = next(calls(parse(code), method), None)
    takes = [_parameters(getattr(getattr(sys.modules.get("__main__"), cls, None), method, None))]
    takes += parameter_counts(cls, method, source)
    if sent and len(sent.args) > 0 and len(sent.args) + 1 in takes:
        line = class_passed(cls, source)
        where = f"line {line} has" if line else "somewhere"
        return (
            f"`{method}` is called on the class {cls}, not on an object: {where} `{cls}`{'' if line else ' is passed'} "
            f"without brackets. Write `{cls}()` there."
        )
    if statement := _class_kept(code, method, source):
        text = f"Line {statement.lineno}, `{ast.unparse(statement)}`, keeps the class itself."
        return f"{text} Create one with brackets: `{ast.unparse(statement.value)}()`."
    return ""


def _class_kept(code: str, method: str, source: str) -> ast.Assign | None:
    """Return the only statement that sets what a line calls a method of, if that keeps a class: `e = Executor`."""
    called = [call.func for call in calls(line_tree(code), method)]
    owners = {ast.unparse(each.value) for each in called if isinstance(each, ast.Attribute)}
    found = (node for node in walk(parse(source)) if isinstance(node, ast.Assign))
    made = [node for node in found if owners & {*map(ast.unparse, node.targets)}]
    return made[0] if len(made) == 1 and re.match(r"[A-Z]\w*[a-z]", name_of(made[0].value)) else None


def _objects(cls: str, source: str) -> str:
    """Return the name of an object of the class: that of a variable of the notebook, or one in the text; '' if none."""
    main = vars(sys.modules["__main__"]) if "__main__" in sys.modules else {}
    made = main.get(cls)
    if "rclpy.init(" not in source and isinstance(made, type):
        return next((name for name, each in main.items() if type(each) is made and not name.startswith("_")), "")
    found = (node for node in walk(parse(source)) if isinstance(node, ast.Assign))
    kept = (node for node in found if isinstance(node.value, ast.Call) and name_of(node.value.func) == cls)
    return next((ast.unparse(node.targets[0]) for node in kept), "")


def _parameters(function: object) -> int:
    """Return the number of a function's parameters, `self` included; 0 for anything else."""
    return len(inspect.signature(function).parameters) if inspect.isfunction(function) else 0


def _class_for_object(found: re.Match[str], source: str) -> str:
    """Return the hint on a method that gets no object: called of the class, perhaps by a method that is given that."""
    for function in functions(parse(source)):
        line = next((each.lineno for each in function.decorator_list if name_of(each) == "classmethod"), 0)
        if line and next(calls(function, found[1]), None):
            return (
                f"`@classmethod` in line {line} passes the class instead of the node to '{function.name}', so what it "
                "calls has no `self`: leave it out."
            )
    return "This is the class, not a node: create a node with brackets, as in `node = TheClass()`."


def _spun_twice(found: re.Match[str], source: str) -> str:
    """Return the hint on an executor that is spun in a callback of its own, or by two threads."""
    tree = parse(source)
    targets = [(call.lineno, argument(call, 1, "target")) for call in calls(tree, "Thread")]
    threads = [line for line, target in targets if target and ast.unparse(target) == "rclpy.spin"]
    spins = [call.lineno for call in calls(tree, "spin") if ast.unparse(call.func) == "rclpy.spin"]
    if threads and spins:
        return (
            f"The thread of line {threads[0]} and line {spins[0]} both spin the node, and two threads "
            "cannot spin one executor: leave one of the two out. To run several callbacks at a time, use a "
            "`MultiThreadedExecutor`."
        )
    return (
        "The executor that runs this callback already spins the node. Make the callback `async def`, and write `await` "
        "before `call_async(...)`."
    )


def _declared_already(found: re.Match[str], source: str) -> str:
    """Return the hint on a parameter that is declared twice, or by rclpy when it is given a value at the start."""
    automatic = "automatically_declare_parameters_from_overrides"
    for node in (each for each in walk(parse(source)) if isinstance(each, ast.keyword)):
        if node.arg == automatic and getattr(node.value, "value", False):
            return (
                f"`{automatic}` in line {node.value.lineno} declares each parameter that is given at the start: leave "
                "it out. `declare_parameter` takes the value that is given in place of its default."
            )
    once = "A parameter is declared once"
    name = given[1] if (given := re.search(r"already declared: \['([^']*)'\]", found.string)) else ""
    tree = parse(source)
    written = [(call, argument(call, 0, "name")) for call in calls(tree, "declare_parameter")]
    lines = [call.lineno for call, each in written if isinstance(each, ast.Constant) and each.value == name]
    for loop in (node for node in walk(tree) if isinstance(node, (ast.For, ast.While)) and len(lines) == 1):
        if loop.lineno < lines[0] <= (loop.end_lineno or 0):
            again = f"line {lines[0]} declares '{name}' in each round of its loop"
            own = isinstance(loop, ast.For) and name in {
                each.id for each in walk(loop.target) if isinstance(each, ast.Name)
            }
            return f"{once}, and {again}{f'. Is `{name}` meant, without quotation marks?' if own else '.'}"
    if len(lines) > 1:
        return (
            f"{once}, and lines {' and '.join(map(str, lines))} declare '{name}': remove one of them, or correct its "
            "name."
        )
    return f"{once}: this one was declared before."


def _not_initialised(found: re.Match[str], source: str) -> str:
    """Return the hint on a node that is made before `rclpy.init()`, as by a class that need not be a node."""
    tree, before = parse(source), "`rclpy.init()` must be called before a node is made"
    nodes = [each.name for each in node_classes(tree)]
    if len(nodes) == 1 and not any(calls(tree, "init")) and "main" not in {each.name for each in functions(tree)}:
        return f"{before}, and '{nodes[0]}' is a node. If it needs nothing of ROS, leave its base `Node` out."
    return f"{before}."


def _no_such_key(found: re.Match[str], source: str, code: str) -> str:
    key = found[1]
    if named := re.search(rf"(\w+)\.pop\(\s*['\"]{re.escape(key)}['\"]\s*\)", code):
        return (
            f"`pop` takes a value out of the dict, which has it no more the next time. Read it with square brackets: "
            f"`{named[1]}['{key}']`."
        )
    if named := re.search(rf"(\w+)\[\s*['\"]{re.escape(key)}['\"]\s*\]", code):
        if _of_a_request(named[1], code, source):
            return (
                f"`{named[1]}` has only the parameters of this request, and '{key}' is not among them: a request may "
                f"set some and not others. Take its stored value then: `{named[1]}.get('{key}', ...)`."
            )
        given = [each.name for each in around(code, source) if named[1] in (one.arg for one in each.args.args)]
        if given:
            return (
                f"`{named[1]}` has no key '{key}'. It is what the caller of `{given[0]}` passes: compare its keys, "
                f"which `print({named[1]})` shows.{_passed_without(key, given[0], source)}"
            )
        return (
            f"`{named[1]}` has no key '{key}'. Compare the spelling with the line that creates the dict; "
            f"`print({named[1]})` shows its keys."
        )
    return ""


def _passed_without(key: str, function: str, source: str) -> str:
    """Return a sentence about a call of `function` in the file with a dict that has not this key; '' without one."""
    for call in calls(parse(source), function):
        for given in (each for each in call.args if isinstance(each, ast.Dict) and None not in each.keys):
            keys = [getattr(each, "value", None) for each in given.keys]
            if key not in keys:
                return f" Line {call.lineno} passes `{ast.unparse(given)}`."
    return ""


def _of_a_request(name: str, code: str, source: str) -> bool:
    """Return True if the line is in a parameter callback that makes the dict `name` of what it is given."""
    tree = parse(source)
    for function in functions(tree):
        text = ast.get_source_segment(source, function) or ""
        for node in walk(function) if function.name in parameter_callbacks(tree) and code in text else ():
            if isinstance(node, ast.Assign) and name in map(name_of, node.targets):
                return isinstance(node.value, (ast.DictComp, ast.Call))  # and not written out
    return False


def _divisor(found: re.Match[str], source: str) -> str:
    refusal = ", and answer with `success=False` if it is 0" if "create_service" in source else ""
    return f"Check the divisor before you divide{refusal}."


def _of_nothing(function: str, default: str, source: str) -> str:
    """Return the hint on the least or the largest of no values; only that of distances is infinite."""
    if re.search(r"LaserScan|\b(?:scan|ranges|distances|sectors?)\b", source):
        example = default.format(function, "-" * (function == "max"))
        return f"The sequence is empty. Give a default: {example}."
    return f"The sequence is empty. Check that before you call `{function}`: what should happen then?"


def _destroyed(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a line that uses something which the program has destroyed, by itself or with its node."""
    tree = parse(source)
    made = [call for name in DESTROYERS for call in calls(tree, name)]
    used = [call for call in made if re.search(rf"(?<![\w.]){re.escape(_gone(call))}(?!\w)", code)]
    for call in used if made else calls(tree, "destroy_node"):
        return (
            f"`{ast.unparse(call)}` in line {call.lineno} has already destroyed what this line uses: call it when "
            "everything is done."
        )
    return ""


def _gone(call: ast.Call) -> str:
    """Return what a call destroys: `self.client` for `self.client.destroy()` and `self.destroy_client(self.client)`."""
    return ast.unparse(call.args[0] if call.args else getattr(call.func, "value", call.func))


DESTROYERS = (
    "destroy",
    "destroy_client",
    "destroy_publisher",
    "destroy_service",
    "destroy_subscription",
    "destroy_timer",
)


def _hides_of_a_node(found: re.Match[str], source: str) -> str:
    """Return the hint on an attribute of rclpy's node that the class has overwritten: `self._clock = now`."""
    hidden = None if re.search(rf"\bclass {found[1]}\b", source) else hides_rclpy(source, OF_A_NODE)
    return HIDES.format(hidden[1], hidden[0]) if hidden else ""


HIDES = "Line {}, `self.{} = ...`, overwrites an attribute of rclpy's node: choose another name."


def _says(text: str) -> Callable[[re.Match[str], str], str]:
    """Return a hint with a fixed text."""
    return lambda found, source: text


# Patterns for the last line of a traceback, with their hints; the first match counts.  Seen with rclpy 7.1.6.
KNOWN: tuple[tuple[str, Callable[[re.Match[str], str], str]], ...] = (
    (r"'(\w+)' object has no attribute '(\w+)'", written_outside),
    (r"'(\w+)' object has no attribute '(\w+)'(?:$|\. Did you mean: '\w+'\?$)", never_set),
    (
        r"'ServerGoalHandle' object has no attribute '(?:cancel|cancel_goal|set_canceled|set_cancelled)'",
        _says("A server ends a goal that was cancelled with `goal_handle.canceled()`."),
    ),
    (r"^TypeError:?\s*$", _nothing_returned),
    (r"'(\w+)' object has no attribute '(?:handle|now|clock_type|info|ok)'", _hides_of_a_node),
    (r"'(Time|Duration)' object has no attribute '(\w+)'", time_without),
    (
        r"'ParameterValue'|not ParameterValue\b",
        lambda found, source: OF_A_PARAMETER_VALUE if "get_parameter_value" in source else OF_ITS_TYPE,
    ),
    (r"'(?:(\w+)_Response|\w+)' object has no attribute 'add_done_callback'", not_a_future),
    (
        r"module '(\w+)' has no attribute|cannot import name '\w+' from '(?!\w+\.(?:srv|msg|action))(\w+)'",
        hidden_by_file,
    ),
    (r"'(\w+)_(GetResult_Response|FeedbackMessage)' object has no attribute '(\w+)'", wrapped),
    (r"'(\w+)_(Request|Response|Goal|Result|Feedback)' object has no attribute '(\w+)'", unknown_field),
    (r"'(\w+)' object has no attribute '(\w+)'", no_such_field),
    (r"'(\w+)' field must be of type '(float|int|str|bool)'", wrong_type),
    (r"'(\w+)' field must be a sub message of type '(\w+)'", sub_message),
    (r"'Future' object has no attribute '(?!add_done_callback)\w+'", _future),
    (
        r"descriptor '__init__' requires a 'super' object",
        _says("Call `super`, too, with brackets: `super().__init__('my_node')`."),
    ),
    (r"Node\.__init__\(\) missing 1 required positional argument: 'node_name'", _no_node_name),
    (
        r"has no attribute '_(?:Node__\w+|default_callback_group|parameters|parameter_overrides|context|logger)'",
        _says("Call `super().__init__('my_node')` first in `__init__`: until then there is no node."),
    ),
    (r"has no attribute '_TYPE_SUPPORT'|incompatible constructor arguments", order_of_arguments),
    (r"(?:type object '\w+'|'str' object) has no attribute 'default_callback_group'", order_of_arguments),
    (rf"(\w+)\.({SENDS})\(\) got an unexpected keyword argument '(\w+)'", sent_by_name),
    (rf"\w+\.({SENDS})\(\) missing 1 required positional argument: '(?:goal|request)'", nothing_sent),
    (r"(\w+)\.(\w+)\(\) got an unexpected keyword argument '(\w+)'", unknown_keyword),
    (r"(\w+)\.__init__\(\) got an unexpected keyword argument '(\w+)'", type_for_goal),
    (
        r"^TypeError: RcutilsLogger\.(\w+)\(\) takes 2 positional arguments",
        lambda found, source: (
            f"A logger of rclpy takes one text, with the values in it: `{found[1]}(f'... {{value}}')`, for example."
        ),
    ),
    (
        r"Logger severity cannot be changed between calls",
        _says(
            "A logging call must keep the severity of its first message, and this one has changed it. Write a call for "
            "each: `.info(...)` in an `if`, and `.error(...)` in its `else`, for example."
        ),
    ),
    (
        r"Node\.get_logger\(\) takes 1 positional argument but",
        _says("`get_logger()` takes no text. A method of the logger logs one: `self.get_logger().info('...')`."),
    ),
    (
        r"object has no attribute '(?:_executor_event|add_entity)'|does not support the context manager protocol",
        _hidden_in_a_class,
    ),
    (r"Expected QoSProfile or int, but received|execution callback: not callable", order_of_arguments),
    (r"^TypeError: spin\(\) missing 1", _says("`rclpy.spin(node)` needs the node whose callbacks it should run.")),
    (r"The (service|message) type provided is not valid \(<class '(\w+)\.(\w+)\..*\.(\w+)'>", wrong_kind),
    (r"property '(\w+)' of '\w+' object has no setter|: (handle) cannot be modified after node", _of_rclpy),
    (
        r"CallbackGroup\.add_entity\(\) missing",
        lambda found, source: (
            "Create a callback group with brackets: "
            f"`{group[1] if (group := GROUP.search(source)) else 'ReentrantCallbackGroup'}()`."
        ),
    ),
    (
        r"^RuntimeError: no running event loop",
        _says(
            "rclpy does not run asyncio: an `async` callback can await futures of rclpy, such as that of "
            "`call_async(...)`, but nothing from `asyncio`."
        ),
    ),
    (r"UnboundLocalError: .*local variable '(\w+)'", unbound),
    (
        r"'method' object does not support the context manager protocol|'\w+' object has no attribute 'pointer'",
        _says("Your node has a method or an attribute called `handle`, which hides rclpy's own: choose another name."),
    ),
    (r"rcl node's context is invalid", lambda found, source: _after_the_shutdown(source)),
    (r"NotInitializedException|rcl node's context is invalid|rclpy\.init\(\) has not been called", _not_initialised),
    (
        r"'LiveNode' object has no attribute '",
        _says("What `ros.start` returns is a handle of the node. The node itself is its `.node`."),
    ),
    (
        r"'Session' object has no attribute '(\w+)'",
        lambda found, source: (
            "`ros` is the session, and its node is `ros.node`: write this here." if hasattr(Node, found[1]) else ""
        ),
    ),
    (
        r"Context\.init\(\) must only be called once",
        _says("`rclpy.init()` is called twice: a program calls it once, in `main`."),
    ),
    (
        r"^TypeError: spin_until_future_complete\(\) missing 1 required positional argument: 'future'",
        _says("The node comes first: `rclpy.spin_until_future_complete(node, future)`."),
    ),
    (r"(\w+)\(\) missing 1 required positional argument: 'self'", _class_for_object),
    (
        r"different clock types",
        _says(
            "`Time()` is of the system's clock, and `self.get_clock().now()` is of the node's. Begin with None, or "
            "with `self.get_clock().now()`."
        ),
    ),
    (
        r"Session\.call\(\) takes .* positional arguments",
        _says("`ros.call` takes the fields of the request by name, as in `a=1`."),
    ),
    (
        r"call_async\(\) takes 2 positional arguments",
        _says("`call_async` takes one request, with the values in its fields: `TheType.Request(...)`."),
    ),
    (r"(\w+)\.__init__\(\) takes 1 positional argument but (\d+)", by_name),
    (
        r"'\w+_(?:Request|Response|Goal|Result|Feedback)' object is not subscriptable",
        _says("The fields of a message are attributes: write `request.a`, not `request['a']`."),
    ),
    (
        r"'dict' object has no attribute '(\w+)'",
        lambda found, source: (
            f"Read the values of a dict with square brackets: `['{found[1]}']`."
            if re.search(rf"\.\s*{found[1]}\b", source)  # or else it is an argument of a function of the course
            and not re.search(rf"\.\s*{found[1]}\s*\(", source)  # or else a method of something else is meant
            else ""
        ),
    ),
    (r"'(\w+)_(Request|Response|Goal|Result|Feedback)' object attribute '(\w+)' is read-only", class_changed),
    (
        r"The 'parameters' field must be a set or sequence and each value of type 'Parameter'",
        _says("Each must be the message of a parameter: `parameters=[Parameter(...).to_parameter_msg()]`."),
    ),
    (r"The '(\w+)' field must be a set or sequence(?:.* each value of type '(\w+)')?", not_a_list),
    (
        r"'str' object cannot be interpreted as an integer|cannot use a str to initialize an array",
        _says("Whole numbers are expected here, not text: convert each one with `int(...)`."),
    ),
    (r"module 'rclpy' has no attribute '([A-Z]\w+)'", of_rclpy),
    (
        r"module 'rclpy' has no attribute '(create_(?!node)\w+)'",
        lambda found, source: f"`{found[1]}` is a method of the node: `self.{found[1]}(...)`.",
    ),
    (r"(?:(\w[\w.]*)\(\)) (?:takes \d+|missing \d+ required) positional argument", argument_count),
    (r"<lambda>\(\) takes (\d+) positional arguments? but (\d+) w|<lambda>\(\) missing (\d+) r", lambda_arguments),
    (r"ParameterNotDeclaredException: .*: (\w+(?:[./]\w+)*)", _not_declared),
    (
        r"The given value is not one of the allowed types '?rcl_interfaces\.msg\.(?:\w+\.)*ParameterDescriptor",
        _says("The default comes before the descriptor: `declare_parameter('kp', 1.0, ParameterDescriptor(...))`."),
    ),
    (
        r"The given value is not one of the allowed types",
        _says(
            "A parameter is a bool, an int, a float, a str, bytes, or a list of one of the first four: convert the "
            "value, as in `float(...)`."
        ),
    ),
    (
        r"First element .* at index 0 in parameters list is not a str",
        _says("The name of the parameter comes first, then its default: `self.declare_parameter('max_speed', 1.5)`."),
    ),
    (
        r"type must be an instance of '<enum 'Type'>'",
        _says("The second argument of `Parameter` is its type. Pass the value by name: `Parameter('x', value=2.0)`."),
    ),
    (r"InvalidParameterValueException.*Callback returned an invalid type", no_check_result),
    (
        r"InvalidParameterValueException.*out of range",
        _says("The value, and the default too, must lie within the descriptor's range."),
    ),
    (
        r"ParameterAlreadyDeclaredException.*use_sim_time",
        _says("rclpy declares `use_sim_time` for each node: remove this declaration."),
    ),
    (r"ParameterAlreadyDeclaredException", _declared_already),
    (r"InvalidParameterTypeException|Wrong parameter type", _wrong_parameter_type),
    (
        r"'(?:NoneType|bool)' object has no attribute '(?:successful|reason)'",
        _says("A parameter callback must return `SetParametersResult(successful=...)`, on every path through it."),
    ),
    (NOT_CALLABLE, _not_callable),
    (
        r"object [A-Z]\w*_(?:Response|Request|Event) can't be used in 'await'",
        _says("Await the future of `call_async(...)`; `call(...)` returns the response directly."),
    ),
    (r"No module named '([\w.]+)'", is_module),
    (r"cannot import name '(\w+)' from '([\w.]+)'", no_such_class),
    (r"ZeroDivisionError", _divisor),
    (r"called for existing [\w ]*name|[Ff]ailed to create \w+: invalid allocator", two_types),
    (
        r"called for existing topic name rt(/\S+) with incompatible type",
        lambda found, source: (
            f"Within one program or notebook a topic can have only one type, and {found[1]} already has another. Stop "
            "what uses it, or choose another name."
        ),
    ),
    (
        r"^EOFError",
        _says(
            "A program that a notebook runs cannot read from the keyboard: take values from the command line, not with "
            "`input()`."
        ),
    ),
    (r"'NoneType' object does not support the context manager protocol", _init_as_context),
    (r"(\w+)\(\) takes no arguments", _no_constructor),
    (r"Expected <class '([\w.]+)\.(\w+)'>, got <class", not_a_message),
    (
        r"OverflowError: .*integer is (greater|less) than|must be an? (?:unsigned )?integer in \[",
        _says(
            "The number does not fit the type of the field: an `int32` holds up to 2147483647, an `int64` up to "
            "9223372036854775807. Refuse such a request."
        ),
    ),
    (r"'method' object is not iterable", _hidden_property),
    (
        r"'Parameter' object is not subscriptable|cannot unpack non-iterable Parameter object",
        _says("A Parameter is an object: its name is `.name`, and its value is `.value`."),
    ),
    (
        r"'Parameter' object is not iterable",
        lambda found, source: OF_A_LIST if re.search(r"set_parameters\w*\(", source) else "",
    ),
    (
        r"'Parameter' object (?:cannot|is not)|(?:operand type|between).*'Parameter'|not '?Parameter",
        lambda found, source: parameter_kept(source) or OF_A_PARAMETER,
    ),
    (
        r"zero-size array to reduction operation f?(min|max)imum",
        lambda found, source: _of_nothing(found[1], "`values.{}(initial={}np.inf)`", source),
    ),
    (
        r"(min|max)\(\) (?:arg|iterable argument) is (?:an )?empty",
        lambda found, source: _of_nothing(found[1], "`{}(values, default={}math.inf)`", source),
    ),
    (r"'property' object is not iterable|has no attribute 'executor'", _class_for_node),
    (r"Subscription\.__init__\(\): callback should", _wrong_callback),
    (
        r"(?:(create_subscription)\(\) )?missing 1 required positional argument: 'qos_profile'",
        lambda found, source: (
            "The last argument is the length of the queue, usually 10: "
            + ("`create_subscription(..., 10)`." if found[1] else "`create_publisher(Twist, 'cmd_vel', 10)`.")
        ),
    ),
    (r"generator already executing|Executor is already spinning", _spun_twice),
    (r"'(ServerGoalHandle|ClientGoalHandle)' object has no attribute '(\w+)'", of_a_goal_handle),
    (r"type object '(GoalStatus)' has no attribute '(\w+)'", of_a_goal_handle),
    (
        rf"name '({'|'.join(OF_PYTHON)})' is not defined",
        lambda found, source: f"In Python this is written `{OF_PYTHON[found[1]]}`.",
    ),
    (r"name '(\w+)' is not defined", own_attribute),
    (r"^TypeError: ", unfit),
    (
        r"Couldn't parse (?:parameter override rule|params file)|UnknownROSArgsError",
        lambda found, source: unparsed(found.string),
    ),
)

NO_TEXT = r"^TypeError:?\s*$"  # raised by rclpy for an argument of the wrong type
# Patterns for an error and the reader's line that caused it, with hints; tried before `KNOWN`.
IN_A_LINE: tuple[tuple[str, str, str], ...] = (
    (
        r"only (?:0-dimensional|length-1|size-1) arrays can be converted",
        r"\bmath\.\w+\(",
        "A function of `math` takes one number. For an array, use that of NumPy, such as `np.degrees(...)`.",
    ),
    (
        r"^IndexError",
        r"\[[^\]]*\+\s*1\]",
        "The last index is one less than the length: for the last element, an index with `+ 1` is out of range.",
    ),
    (
        r"object is not callable",
        r"\.value\(\)",
        "`.value` of a parameter is not a method: leave out the brackets after it.",
    ),
    (
        r"'bool' object is not callable",
        r"\.(?:is_cancel_requested|is_active)\(\)",
        "`is_cancel_requested` and `is_active` of a goal are not methods: leave out the brackets after them.",
    ),
    (
        r"'bool' object is not callable",
        r"(?<!self)\.accepted\(\)",
        "`accepted` of a goal handle is not a method: leave out the brackets after it.",
    ),
    (
        r"float\(\) argument must be .* not '(?:method|function)'",
        r"create_timer\(",
        "First the period in seconds, then the callback: `create_timer(0.1, self.callback)`.",
    ),
    (
        r"asyncio\.run\(\) cannot be called from a running event loop",
        "",
        "In a notebook, write `await` itself in the cell.",
    ),
    (
        r"'str' object cannot be interpreted as an integer",
        r"sleep\(",
        "Seconds are a number, not text: convert it with `float(...)`.",
    ),
    (
        r"incompatible function arguments",
        r"create_(?:publisher|subscription|client|service)\(",
        "The type comes first, then the name: `create_publisher(Twist, 'cmd_vel', 10)`.",
    ),
)
OF_A_LINE: tuple[tuple[str, Callable[[re.Match[str], str, str], str]], ...] = (
    (r"^[\w.]+(?::|$)", refused_by_raising),
    *wrong_forms.TABLE,
    (r"attempted invalid transition from state (\w+) with event (\w+)", ended_twice),
    (r"^(?:ModuleNotFoundError: No module named|NameError: name) '([\w.]+)'", library),
    (r"'NoneType' object does not support the context manager protocol", _without_a_context),
    (r"('(?:builtin_function_or_method|function)' object|type object '[\w.]+') has no attribute '(\w+)'", of_its_part),
    (r"^(?:NameError: name '(\w+)' is not defined|TypeError: unsupported operand type.* for -:)", _name_of_a_check),
    (r"^NameError: name '(\w+)' is not defined", node_without_quotes),
    (r"(\w+)\(\) missing \d+ required positional argument", called_by_hand),
    (r"^AttributeError: '(\w+)' object has no attribute '(\w+)'", not_kept),
    (
        r"'(?:function|method|builtin_function_or_method)' object has no attribute 'add_done_callback'",
        function_to_wait_for,
    ),
    (
        r"not supported between instances of '(?:(Duration)' and '(?:float|int)|(?:float|int)' and 'Duration)'",
        duration_and_number,
    ),
    (r"undeclared parameter\(s\)|'list' object has no attribute 'value'", parameters_for_one),
    (r"undeclared parameter\(s\): (-?[\d.]+|True|False)", wrong_forms.value_for_a_name),
    (r"^TypeError: .* takes \d+ positional arguments? but", self_behind_super),
    (r"^TypeError: (\w+)\.__init__\(\) got an unexpected keyword argument 'threads'", of_start),
    (r"tuple indices must be integers or slices, not str", _tuple_for_dict),
    (r"rclpy_logging_rcutils_log\(\): incompatible function arguments", logged),
    (r"list indices must be integers or slices, not str", list_of_parameters),
    (r"^IndexError", _beam),
    (r"operands could not be broadcast", _angles_to_the_end),
    (r"^TypeError: .* between instances of '(?:(?:int|float)' and 'str|str' and '(?:int|float))'", _word_for_number),
    (r"field must be a set or sequence and each value of type '(\w+)'", _words_for_numbers),
    (NO_TEXT, sent),
    (r"cannot use Destroyable because destruction was requested", _destroyed),
    (r"'module' object is not callable|module\(\) takes at most", is_a_module),
    (r"'method' object is not subscriptable", _method_indexed),
    (r"^TypeError: (\w+)\(\) takes 0 positional arguments but", of_the_course),
    (r"'(\w+)' object has no attribute '(\w+)'", session_overwritten),
    (r"'(\w+)' field must be of type(?: '(\w+)')?", no_value),
    (r"field must be of type", _parameter_for_value),
    (NOT_THERE, method_for_result),
    (UNCALLED, not_called),
    (r"can only concatenate \w+ \(not \"method\"\)|unsupported operand type.*'method'", _method_in_a_sum),
    (r"truth value of an array|ufunc 'bitwise_(?:and|or)' not supported", _of_arrays),
    (r"'Future' object has no attribute '(?!add_done_callback)(\w+)'", _future_used),
    (r"'NoneType' object has no attribute 'add_done_callback'", awaited_nothing),
    (r"'NoneType' object has no attribute '(\w+)'", attribute_of_nothing),
    (r"^RecursionError", _without_end),
    (r"^TypeError: ([\w.]*\w)\.(\w+)\(\) missing 1 required positional argument: '(?!self')", _of_the_class),
    (r"^KeyError: '([^']+)'$", _no_such_key),
    (r"Invalid arguments passed to constructor: (\w+)", no_such_argument),
    (r"(Service|Action) classes can not be instantiated", type_for_part),
    (r"must be (?:a )?real number, not NoneType|not 'NoneType'|'NoneType'$", gave_nothing),
    (r"'(CancelResponse|GoalResponse)' object is not callable", _response_for_callback),
    (r"^TypeError: '\w+' object is not callable", hidden_here),
    (NOT_CALLABLE, overwritten),
    (NO_TYPE, overwritten),
    (NOT_CALLABLE, _value_for_callback),
    (NOT_CALLABLE, _called_here),
    (r"'NoneType' object is not subscriptable|operand type.*'NoneType'|between.*'NoneType'", _still_none),
    (r"'NoneType' object is not subscriptable|operand type.*'NoneType'|between.*'NoneType'", gave_nothing),
)
