"""Files of parameters on a command line that are for no node of the program: ROS 2 says nothing about them."""

import difflib
import itertools
import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml

from course.foundation.untrusted import one_line, read_regular
from course.ros.names import base

FLAG, MARK, ROS_ARGS = "--params-file", "ros__parameters", "--ros-args"
SET = re.compile(r"([\w./]+):=")  # and not `node:name:=value`
OVERRIDE = re.compile(r"Couldn't parse parameter override rule: '-p ([^\s:=]+)=(.*?)'")
NO_VALUE = re.compile(r"Couldn't parse parameter override rule: '-p ([^\s:=]+):='")
NO_RULE = re.compile(r"Couldn't parse parameter override rule: '-p ([^\s:=']+):?'")
DASH = re.compile(r"Couldn't parse parameter override rule: '-p ([^\s:=']*-[^\s:=']*):=(.*?)'")
COMMA = re.compile(r"parameter '(\w+)' to '(-?\d+),(\d+)' of type 'STRING', expecting type 'DOUBLE'")
INTEGER = re.compile(r"to '(-?\d+)' of type 'INTEGER', expecting type 'DOUBLE'")
UNKNOWN = re.compile(r"UnknownROSArgsError: \['([\w./]+:=[^']*)'")
NO_OPTION = re.compile(r"UnknownROSArgsError: \['(--[\w-]+)'(?:, '([^']*)')?")
OPTIONS = (FLAG, "--param", "--remap", "--log-level", "--enclave", "--log-config-file")
UNREADABLE = re.compile(
    r"Couldn't parse params file: '--params-file (.+?)'. Error: Error parsing a event near line (\d+)"
)
NO_FILE = re.compile(r"Couldn't parse params file: '--params-file (.+?)'. Error: Error opening YAML file")
MOST = 1_000_000  # bytes of a file that is read


def unread_files(words: Sequence[str], nodes: Collection[str]) -> list[str]:
    """Return a sentence about each file of parameters in the command line `words` that is for none of these `nodes`."""
    found = []
    own = sorted({base(node) for node in nodes})
    for flag, name in itertools.pairwise(words):
        wanted = _names(Path(name)) if flag == FLAG and own else []
        if wanted and not any("*" in each or base(each) in own for each in wanted):
            found.append(
                f"{name} has parameters for {one_line(' and '.join(wanted))}, and the node is called "
                f"{' and '.join(own)}, so they have no effect: write its name there."
            )
    return found


def unread_words(words: Sequence[str], source: str) -> str:
    """Return the words about parameters in a command line that a program with the text `source` does not read; or ''.

    rclpy reads only what stands behind `--ros-args`.
    """
    before = words[: words.index(ROS_ARGS)] if ROS_ARGS in words else words
    for flag, word in itertools.pairwise(before):
        if (flag == "-p" and ":=" in word) or (flag == FLAG and FLAG.strip("-") not in source):
            return f"{flag} {word}"
    return ""


def set_parameters(words: Sequence[str]) -> list[str]:
    """Return the names of the parameters that the command line `words` sets for all nodes of its program."""
    own = words[words.index(ROS_ARGS) :] if ROS_ARGS in words else []
    found = (SET.match(word) for flag, word in itertools.pairwise(own) if flag in ("-p", "--param"))
    return [each[1] for each in found if each]


def unparsed(error: str) -> str:
    """Return what to write for the part of a command line that rcl could not parse, by its error; '' if unknown."""
    if rule := OVERRIDE.search(error):
        return f"A parameter is set with `:=`: `-p {rule[1]}:={rule[2]}`"
    if rule := NO_RULE.search(error):
        return f"Write the value after `:=`, without a space: `-p {rule[1]}:=2.0`, for example."
    if name := DASH.search(error):
        meant = name[1].replace("-", "_")
        return f"The name of a parameter has no `-`. Did you mean `-p {meant}:={name[2]}`?"
    if number := COMMA.search(error):
        return f"A number has a decimal point: `{number[2]}.{number[3]}`, not `{number[2]},{number[3]}`."
    if whole := INTEGER.search(error):
        return f"The parameter was declared as a double, and {whole[1]} is an integer: write {whole[1]}.0."
    if option := NO_OPTION.search(error):
        near = [FLAG] if (option[2] or "").endswith((".yaml", ".yml")) else []
        near = near or difflib.get_close_matches(option[1], OPTIONS, 1)
        return f"ROS 2 has no option `{option[1]}`. Did you mean `{near[0]}`?" if near else ""
    if unreadable := UNREADABLE.search(error):
        return _without_a_colon(unreadable[1], int(unreadable[2]))
    if unknown := UNKNOWN.search(error):
        return f"A parameter on a command line has `-p` before it: `-p {unknown[1]}`."
    if empty := NO_VALUE.search(error):
        return f"Write the value after `:=`, without a space: `-p {empty[1]}:=2.0`, for example."
    if missing := NO_FILE.search(error):
        return f"The folder {Path.cwd().name}, in which the program runs, has no file {missing[1]}."
    return ""


def _without_a_colon(file: str, near: int) -> str:
    """Return a sentence on the line of a file of parameters, `near` that line or next to it, that YAML cannot read."""
    for number, line in list(enumerate(_text(Path(file)).splitlines(), 1))[max(0, near - 2) : near + 1]:
        text = line.partition(" #")[0].strip()
        if text and text[0] not in "#-[]{}\"'" and not re.search(r":(?:\s|$)", text):
            return (
                f"{file}, line {number}, `{one_line(text)}`: each value is written `name: value`, with a space after "
                "the colon, and a name above others ends with a colon."
            )
    return ""


def with_tabs(words: Sequence[str]) -> list[str]:
    """Return a sentence about each file of parameters in a command line with a tab before a name: YAML has none."""
    found = []
    for flag, name in itertools.pairwise(words):
        text = _text(Path(name)) if flag == FLAG else ""
        lines = [
            number for number, line in enumerate(text.splitlines(), 1) if "\t" in line[: -len(line.lstrip()) or None]
        ]
        if lines:
            found.append(f"{name}, line {lines[0]}, begins with a tab: a parameter file is indented with spaces only.")
    return found


def _text(path: Path) -> str:
    try:
        return read_regular(path, MOST).decode(errors="replace")
    except (OSError, ValueError):
        return ""


def _names(path: Path) -> list[str]:
    """Return the names of the nodes that a file has parameters for; [] if it cannot be read."""
    try:
        return list(dict.fromkeys(_nodes(yaml.safe_load(_text(path)), "")))
    except (ValueError, yaml.YAMLError, RecursionError):
        return []


def _nodes(tree: Any, above: str) -> Iterator[str]:
    """Yield the names of a part of a file: a key is a namespace unless it holds the parameters of a node."""
    for key, value in tree.items() if isinstance(tree, dict) else ():
        name = f"{above}/{key}" if above else str(key)
        if isinstance(value, dict) and MARK in value:
            yield name
        else:
            yield from _nodes(value, name)
