"""The names of all nodes, also if one is not valid text.

A program without rclpy can announce any bytes as a node's name, and rclpy raises UnicodeDecodeError for the whole list.
This module then asks the library below it, rcl, as rclpy does (rcl/graph.h, rcutils/types/string_array.h).
"""

import ctypes
from typing import Any


class _Allocator(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("allocate", "free", "reallocate", "zero_allocate", "state")]


class _Strings(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("data", ctypes.POINTER(ctypes.c_char_p)), ("allocator", _Allocator)]


def names_and_namespaces(handle: Any) -> tuple[list[tuple[str, str]], bool]:
    """Return the names and namespaces of all nodes, and True if one is not valid text, with its bytes escaped.

    `handle` is that of one of rclpy's nodes.
    """
    with handle:
        try:
            return handle.get_node_names_and_namespaces(), False
        except UnicodeDecodeError:
            return _escaped(handle.pointer), True


def _escaped(node: int) -> list[tuple[str, str]]:
    rcl, utils = ctypes.CDLL("librcl.so"), ctypes.CDLL("librcutils.so")  # rclpy has loaded them
    utils.rcutils_get_default_allocator.restype = _Allocator
    found = (_Strings(), _Strings())
    rcl.rcl_get_node_names.argtypes = [ctypes.c_void_p, _Allocator, *[ctypes.POINTER(_Strings)] * 2]
    if rcl.rcl_get_node_names(node, utils.rcutils_get_default_allocator(), *map(ctypes.byref, found)):
        return []  # the node is being destroyed
    try:
        names, spaces = ([each.data[at] or b"" for at in range(each.size)] for each in found)
    finally:
        for each in found:
            utils.rcutils_string_array_fini(ctypes.byref(each))
    return [(_text(name), _text(space)) for name, space in zip(names, spaces, strict=True)]


def _text(name: bytes) -> str:
    return name.decode(errors="backslashreplace")
