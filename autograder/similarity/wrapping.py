"""Programs that are not what they show: they decode or unpack a text, and execute it."""

import ast
import warnings

EXECUTING = {"exec", "eval"}
DECODING = {"decompress", "unhexlify", "fromhex", "decode", "decodebytes", "loads", "b64decode", "b85decode"}
DECODING |= {
    "urlsafe_b64decode",
    "standard_b64decode",
    "a85decode",
    "z85decode",
    "b32decode",
    "b16decode",
    "a2b_base64",
}


def wraps(text: str) -> bool:
    """Return True if a Python text executes something, and decodes something: what it does cannot be compared."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text)
        nodes = [*ast.walk(tree)]
    except (SyntaxError, ValueError, RecursionError, MemoryError):  # it cannot be run, either
        return False
    names = {node.id for node in nodes if isinstance(node, ast.Name)}
    attributes = {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    executes = EXECUTING & names or ("builtins" in names and EXECUTING & attributes)
    return bool(executes) and not DECODING.isdisjoint(names | attributes)
