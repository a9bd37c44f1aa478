"""Parsing a `.msg`, `.srv` or `.action` definition into its fields, or into one message about the first error."""

import contextlib
import difflib
import io
import keyword
import re
from dataclasses import dataclass

from course.errors import InterfaceError

SECTIONS = {"msg": ("message",), "srv": ("request", "response"), "action": ("goal", "result", "feedback")}

# Words, and macros of gcc, that the generated C and C++ code (C++17) cannot have as the name of a field.  Those of
# Python, with which the generated module is no Python, are in `keyword`.
OF_C = (
    "alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t char32_t class compl const "
    "const_cast constexpr continue decltype default delete do double dynamic_cast else enum errno explicit export "
    "extern false float for friend goto if inline int linux long mutable namespace new noexcept not not_eq nullptr "
    "operator or or_eq private protected public register reinterpret_cast restrict return short signed sizeof static "
    "static_assert static_cast struct switch template this thread_local throw true try typedef typeid typename union "
    "unix unsigned using virtual void volatile wchar_t while xor xor_eq"
)


@dataclass(frozen=True)
class Field:
    """One field, or constant, of a section: its type as written (`int32[]`), its name, its default or value."""

    type: str
    name: str
    value: object = None


@dataclass(frozen=True)
class Definition:
    """A parsed definition: `sections` holds the fields of request and response (goal, result, feedback) in order."""

    name: str
    kind: str
    sections: tuple[tuple[Field, ...], ...]

    @property
    def packages(self) -> set[str]:
        """The packages whose messages the fields use."""
        return {field.type.split("/")[0] for section in self.sections for field in section if "/" in field.type}


def parse(text: str, filename: str, package: str = "my_package") -> Definition:
    """Parse the `text` of a definition whose file is called `filename` (`Calculate.srv`).

    Raises InterfaceError for a name or a line that ROS 2 does not accept
    (https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html).
    """
    name, _, kind = filename.rpartition(".")
    if kind not in SECTIONS:
        raise InterfaceError(f"{filename}: the file's name must end in .msg, .srv or .action")
    if not re.fullmatch(r"[A-Z][A-Za-z0-9]*", name):
        raise InterfaceError(
            f"{filename}: the name must begin with a capital and have only letters and digits, as in Calculate.srv"
        )
    blocks: list[list[tuple[int, str]]] = [[]]
    for number, line in enumerate(text.splitlines(), 1):
        if line.rstrip() == "---":
            blocks.append([])
        else:
            blocks[-1].append((number, line))
    parts = SECTIONS[kind]
    if len(blocks) != len(parts):
        wanted = (
            f"needs {len(parts) - 1} line{'s' * (len(parts) > 2)} '---' between {' and '.join(parts)}"
            if len(parts) > 1
            else "has no '---'"
        )
        raise InterfaceError(f"{filename}: a .{kind} {wanted}, but this one has {len(blocks) - 1}{_not_alone(text)}")
    return Definition(name, kind, tuple(_section(block, filename, package) for block in blocks))


def _not_alone(text: str) -> str:
    """Return a sentence on the first line that begins with dashes and is not `---` alone; '' if there is none."""
    for number, line in enumerate(text.splitlines(), 1):
        if re.match(r"\s*--", line) and line.rstrip() != "---":
            return f". Line {number}, `{line.strip()}`: a separator is three dashes alone, and nothing beside them"
    return ""


def without_comments(text: str) -> str:
    """Return a definition without its comments: rosidl copies them into code, where a `\\` or `*/` would end them."""
    return "".join(f"{line.partition('#')[0].rstrip()}\n" for line in text.splitlines())


def _section(lines: list[tuple[int, str]], filename: str, package: str) -> tuple[Field, ...]:
    fields = {}
    for number, line in lines:
        for field in _parse_line(line, f"{filename}, line {number}", package):
            if field.name in fields:
                raise InterfaceError(f"{filename}, line {number}: the field '{field.name}' is defined twice")
            fields[field.name] = field
    return tuple(fields.values())


def _parse_line(line: str, where: str, package: str) -> list[Field]:
    from rosidl_adapter.parser import PRIMITIVE_TYPES, parse_message_string

    code = line.split("#")[0].rstrip()
    if not code:
        return []
    if code[0].isspace():
        raise InterfaceError(f"{where}: a field must begin in the first column: '{line.strip()}'")
    if "//" in code and '"' not in code and "'" not in code:
        raise InterfaceError(f"{where}: a comment begins with '#', not with '//': '{code}'")
    if code[0] in "\"'":
        raise InterfaceError(f"{where}: a comment begins with '#', and has no quotation marks: '{code}'")
    words = [word.rstrip(":;,") for word in code.split()] if re.match(r"\w+\s*:", code) else code.split()
    if len(words) < 2:
        raise InterfaceError(f"{where}: a field is a type and a name, as in 'float64 a'; this is '{code}'")
    base = words[0].split("[")[0].split("<")[0]
    if base not in PRIMITIVE_TYPES and words[1].split("[")[0] in PRIMITIVE_TYPES:
        raise InterfaceError(f"{where}: the type comes first, then the name: write '{words[1]} {words[0]}'")
    if base not in PRIMITIVE_TYPES and "/" not in base and not base[:1].isupper():
        near = near_types(base) or difflib.get_close_matches(base, PRIMITIVE_TYPES)
        hint = f"; did you mean {' or '.join(near)}?" if near else ""
        raise InterfaceError(f"{where}: there is no type '{base}'{hint}")
    found = re.fullmatch(r"(\w+)\s*(:?)\s*(\w+)\s*([;,]?)", code)
    if found and (mark := found[2] or found[4]):
        raise InterfaceError(f"{where}: a field is a type and a name, without '{mark}': write '{found[1]} {found[3]}'")
    _check_name(code.split(maxsplit=1)[1], where)
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            spec = parse_message_string(package, "Line", line)
    except Exception as error:  # rosidl_adapter raises anything from IndexError to its own classes
        if base in PRIMITIVE_TYPES and len(words) == 3 and re.fullmatch(r"[a-z]\w*", words[2]):
            raise InterfaceError(
                f"{where}: only one field per line; '{words[2]}' would be the default of '{words[1]}', but is "
                f"not a valid {base}: '{code}'"
            ) from None
        raise InterfaceError(f"{where}: {error or 'not a field'}: '{code}'") from None
    if spec.fields and len(words) > 2 and spec.fields[0].default_value is None:
        raise InterfaceError(f"{where}: only one field per line, without ',' or ';': '{code}'")
    return [Field(str(f.type), f.name, f.default_value) for f in spec.fields] + [
        Field(c.type, c.name, c.value) for c in spec.constants
    ]


def near_types(word: str) -> list[str]:
    """Return the types of a definition that `word`, a type of Python, C++ or std_msgs, may stand for."""
    from rosidl_adapter.parser import PRIMITIVE_TYPES

    low = word.lower()
    begun = sorted(each for each in PRIMITIVE_TYPES if each.startswith(low) or low == each)
    return {"double": ["float64"], "str": ["string"], "boolean": ["bool"], "int": ["int32", "int64"]}.get(low, begun)


def _check_name(rest: str, where: str) -> None:
    """Raise InterfaceError for an invalid name of a field or constant, in time linear in its length."""
    name = rest.split("=")[0].split()[0].rstrip(",;")
    if "=" in rest:
        if not re.fullmatch(r"[A-Z](?:_?[A-Z0-9])*", name):
            raise InterfaceError(f"{where}: a constant has a name in capitals, like MAX_SPEED; this is '{name}'")
    elif not re.fullmatch(r"[a-z](?:_?[a-z0-9])*", name):
        near = re.sub(r"_+", "_", re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()).strip("_")
        meant = f": write '{near}'" if re.fullmatch(r"[a-z](?:_?[a-z0-9])*", near) else ""
        raise InterfaceError(
            f"{where}: a field's name has lower-case letters, digits and single underscores, and begins with a "
            f"letter; this is '{name}'{meant}"
        )
    elif name in OF_C.split() or keyword.iskeyword(name):
        languages = " and ".join(["Python"] * keyword.iskeyword(name) + ["C++"] * (name in OF_C.split()))
        raise InterfaceError(
            f"{where}: '{name}' is a word of {languages}, so no field can have this name: write '{name}_value', or "
            "another name"
        )
