"""Kernel rows as Python records: one `struct` unpack instead of one NumPy access per number.

A row of an array of structs becomes a named tuple whose vectors are tuples, with the field names of the struct.
"""

import struct
from collections import namedtuple
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

_CODES = {"f4": "f", "i4": "i", "u4": "I", "i8": "q", "u8": "Q", "f8": "d", "i2": "h", "u2": "H", "i1": "b", "u1": "B"}


@lru_cache(maxsize=1024)  # of a type once: a test makes hundreds of vehicles, a batch as many readers
def record_reader(dtype: np.dtype[Any], name: str) -> Callable[[Any, int], Any]:
    """A function `read(buffer, offset)` that returns one row as a named tuple.

    Args:
        dtype: structured type of the row, as `array.numpy().dtype` of a Warp array of structs gives it.
        name: name of the record type; the same type and name give the same function.
    """
    leaves: list[tuple[int, int, str]] = []  # byte offset, count, code
    scope: dict[str, Any] = {"_new": tuple.__new__}  # a named tuple's own __new__ is one more call of Python
    expression = _record_expression(dtype, name, 0, leaves, scope)
    layout = "<"
    position = 0
    for offset, count, code in leaves:
        layout += f"{offset - position}x{count}{code}"
        position = offset + struct.calcsize(f"<{count}{code}")
    scope["_unpack"] = struct.Struct(layout).unpack_from
    text = f"lambda buffer, offset: (v := _unpack(buffer, offset), {expression})[1]"  # one call for the whole row
    read: Callable[[Any, int], Any] = eval(text, scope)  # noqa: S307  (the text is built from field names alone)
    return read


def row_reader(rows: np.ndarray[Any, Any], i_row: int, name: str, field: str = "") -> Callable[[], Any]:
    """A function that returns the present content of row `i_row` of a live structured view.

    Args:
        rows: a contiguous structured array, shape (rows,).
        i_row: which row.
        name: name of the record type.
        field: reads only this nested struct of the row.
    """
    dtype, offset = _part(rows, i_row, name, field)
    read = record_reader(dtype, name)
    buffer = rows.view(np.uint8).data
    return lambda: read(buffer, offset)


def late_reader(rows: np.ndarray[Any, Any], i_row: int, name: str, field: str = "") -> Callable[[], Any]:
    """As `row_reader`, where little of a row is looked at: a copy whose fields are unpacked when they are asked for."""
    dtype, offset = _part(rows, i_row, name, field)
    if dtype.fields is None or dtype.names is None:
        raise TypeError(f"{name} is not a structured type")
    buffer = rows.view(np.uint8).data[offset : offset + dtype.itemsize]

    def copy(record: Any) -> None:
        record.row = bytes(buffer)

    fields = {each: _late_field(each, *dtype.fields[each][:2], name) for each in dtype.names}
    own = {"__slots__": ("row",), "__init__": copy, "_fields": dtype.names}
    kind: Callable[[], Any] = type(name, (), own | fields)
    return kind


def _late_field(field: str, dtype: np.dtype[Any], offset: int, name: str) -> property:
    """Unpacks one field of a record's bytes."""
    if dtype.names is not None:
        read = record_reader(dtype, f"{name}_{field}")
        return property(lambda record: read(record.row, offset))
    read_one = record_reader(np.dtype([(field, dtype)]), name)
    return property(lambda record: read_one(record.row, offset)[0])


def _part(rows: np.ndarray[Any, Any], i_row: int, name: str, field: str) -> tuple[np.dtype[Any], int]:
    """The type of a row or of a field of it, and where it begins in the array [byte]."""
    dtype, offset = rows.dtype, i_row * rows.dtype.itemsize
    if not field:
        return dtype, offset
    if dtype.fields is None:
        raise TypeError(f"{name} is not a structured type")
    return dtype.fields[field][0], offset + dtype.fields[field][1]


def _record_expression(
    dtype: np.dtype[Any], name: str, start: int, leaves: list[tuple[int, int, str]], scope: dict[str, Any]
) -> str:
    """Python text that builds the record of `dtype` from the unpacked values `v`; fills `leaves` and `scope`."""
    if dtype.names is None or dtype.fields is None:
        raise TypeError(f"{name} is not a structured type")
    arguments = []
    for field in dtype.names:
        field_type, offset = dtype.fields[field][:2]
        if field_type.names is not None:
            arguments.append(_record_expression(field_type, f"{name}_{field}", start + offset, leaves, scope))
            continue
        i_value = sum(count for _, count, _ in leaves)
        count = int(np.prod(field_type.shape)) if field_type.shape else 1
        leaves.append((start + offset, count, _CODES[field_type.base.str[1:]]))
        arguments.append(f"v[{i_value}:{i_value + count}]" if field_type.shape else f"v[{i_value}]")
    scope[name] = namedtuple(name, dtype.names)  # noqa: PYI024
    return f"_new({name}, ({', '.join(arguments)},))"


def assign_rows(array: Any, rows: np.ndarray[Any, Any]) -> None:
    """Puts rows that were saved into a Warp array; those of structs by their place: their fields may have been renamed.

    Raises:
        RuntimeError: they are of another size or type.
    """
    if rows.dtype.names is not None:
        dtype = np.dtype(array.dtype.numpy_dtype())
        if _types(dtype) == _types(rows.dtype):
            rows = rows.view(dtype)
    if rows.shape[: array.ndim] != array.shape:
        raise RuntimeError(f"there are rows of shape {rows.shape}, here of shape {array.shape}")
    array.assign(rows)


def _types(dtype: np.dtype[Any]) -> Any:
    """Type and offset of each field, without its name."""
    if dtype.names is None or dtype.fields is None:
        return dtype
    return [(_types(dtype.fields[name][0]), dtype.fields[name][1]) for name in dtype.names], dtype.itemsize
