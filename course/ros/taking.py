"""Taking a message together with the id of its publisher, which rclpy leaves out.

Source: rcl/subscription.h, rmw/types.h and rcutils/types/uint8_array.h of Jazzy.
"""

import ctypes
import functools
import os
from typing import Any


class Allocator(ctypes.Structure):
    """An rcutils_allocator_t."""

    _fields_ = tuple(
        (name, ctypes.c_void_p) for name in ("allocate", "deallocate", "reallocate", "zero_allocate", "state")
    )


class Serialized(ctypes.Structure):
    """An rcl_serialized_message_t."""

    _fields_ = (
        ("buffer", ctypes.c_void_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", Allocator),
    )


class Info(ctypes.Structure):
    """An rmw_message_info_t."""

    _fields_ = (
        ("source_timestamp", ctypes.c_int64),
        ("received_timestamp", ctypes.c_int64),
        ("publication_sequence_number", ctypes.c_uint64),
        ("reception_sequence_number", ctypes.c_uint64),
        ("middleware", ctypes.c_void_p),
        ("publisher", ctypes.c_uint8 * 16),
        ("from_intra_process", ctypes.c_bool),
    )


UNSUPPORTED = (1 << 64) - 1  # RMW_MESSAGE_INFO_SEQUENCE_NUMBER_UNSUPPORTED
NUMBERS = tuple(name for name, *_ in Info._fields_[:4])  # what rclpy tells


def take(subscription: int) -> tuple[bytes, dict[str, Any]] | None:
    """Return the next message of the rcl_subscription_t at this address, serialized, and its info; None without one.

    The info is rclpy's, and the id of the publisher's endpoint as "publisher".  Raises OSError if rclpy has loaded
    other libraries.
    """
    rcl, rcutils, allocator = _libraries()
    message, info = Serialized(), Info()
    if rcutils.rcutils_uint8_array_init(ctypes.byref(message), 0, ctypes.byref(allocator)):
        raise MemoryError("no memory for a message")
    try:
        if rcl.rcl_take_serialized_message(subscription, ctypes.byref(message), ctypes.byref(info), None):
            rcutils.rcutils_reset_error()
            return None
        told = {name: None if (number := getattr(info, name)) == UNSUPPORTED else number for name in NUMBERS}
        return ctypes.string_at(message.buffer, message.length), told | {"publisher": bytes(info.publisher)}
    finally:
        rcutils.rcutils_uint8_array_fini(ctypes.byref(message))


@functools.cache
def _libraries() -> tuple[ctypes.CDLL, ctypes.CDLL, Allocator]:
    rcl, rcutils = (ctypes.CDLL(f"lib{name}.so", mode=os.RTLD_NOLOAD | os.RTLD_LAZY) for name in ("rcl", "rcutils"))
    rcl.rcl_take_serialized_message.argtypes = (ctypes.c_void_p,) * 4
    rcutils.rcutils_uint8_array_init.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p)
    rcutils.rcutils_uint8_array_fini.argtypes = (ctypes.c_void_p,)
    rcutils.rcutils_get_default_allocator.restype = Allocator
    return rcl, rcutils, rcutils.rcutils_get_default_allocator()
