"""Flight log writer: ULog version 1, as PX4 writes it (docs.px4.io, "ULog File Format").

A log is a header, the definitions (formats, information, parameters), then the data: one record per topic row and text
message. Topics are declared first; the definitions go out with the first row. Rows are written column-wise, many at a
time. Fields are aligned as a C compiler aligns them, by `_padding` fields that readers skip. Same calls, same bytes.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from re import fullmatch
from struct import Struct, calcsize, pack
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from common.logs.log_file import LogFile

MAGIC = b"ULog\x01\x12\x35\x01"  # and the version, 1
SYNC_MAGIC = bytes((0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12))
SYNC_EVERY_BYTES = 1 << 16  # a reader of a damaged log resumes at the next one
MAX_MESSAGE_BYTES = 0xFFFF
PARAMETER_DEFAULT_OF_SYSTEM = 1

STRUCT_CODES = {
    "int8_t": "b",
    "uint8_t": "B",
    "int16_t": "h",
    "uint16_t": "H",
    "int32_t": "i",
    "uint32_t": "I",
    "int64_t": "q",
    "uint64_t": "Q",
    "float": "f",
    "double": "d",
    "bool": "?",
    "char": "s",
}
_HEADER = Struct("<HB")
_DATA_HEADER: list[tuple[str, str, tuple[int, ...]]] = [
    ("_size", "<u2", ()),
    ("_kind", "u1", ()),
    ("_topic_id", "<u2", ()),
]

Columns = Mapping[str, npt.ArrayLike] | npt.NDArray[Any]
InfoValue = str | int | float | Sequence[str]


class UlogTopic:
    """One logged topic instance, made by `UlogWriter.add_topic`."""

    def __init__(
        self, writer: "UlogWriter", name: str, fields: Mapping[str, str], multi_id: int, topic_id: int
    ) -> None:
        if "timestamp" in fields:
            raise ValueError(f"{name}: the timestamp comes by itself")
        self.name = name
        self.multi_id = multi_id
        self.topic_id = topic_id
        self.field_names = ["timestamp", *fields]
        declarations, dtype, struct_layout = _aligned({"timestamp": "uint64_t", **fields})
        self.format_text = f"{name}:{declarations}"
        self._dtype = np.dtype(_DATA_HEADER + dtype)
        if self._dtype.itemsize - _HEADER.size > MAX_MESSAGE_BYTES:
            raise ValueError(f"{name}: a row is longer than {MAX_MESSAGE_BYTES} bytes")
        self._header = (self._dtype.itemsize - _HEADER.size, ord("D"), topic_id)
        self._pack = Struct("<HBH" + struct_layout).pack
        self._writer = writer
        self._last: npt.NDArray[Any] | None = None

    def write(self, rows: Columns) -> None:
        """Appends rows, given as a structured array or as columns by field name.

        Args:
            rows: `timestamp` [us] and every field of the topic; arrays of shape (rows,) or (rows, length).
        """
        self.append(self.records(rows))

    def records(self, rows: Columns) -> npt.NDArray[Any]:
        """Rows as they are written, for `append`."""
        records = np.zeros(np.asarray(rows["timestamp"]).size, self._dtype)
        records["_size"], records["_kind"], records["_topic_id"] = self._header
        for name in self.field_names:
            records[name] = rows[name]
        return records

    def append(self, records: npt.NDArray[Any]) -> None:
        """Appends what `records` has made, or some of it."""
        if len(records):
            self._last = records[-1:]
            self._writer.append(records.tobytes())

    def latest(self) -> dict[str, Any] | None:
        """The last row by field; None if none has been written."""
        return None if self._last is None else {name: self._last[name][0] for name in self.field_names}

    def write_row(self, time_us: int, *values: float) -> None:
        """Appends one row; array fields are given element by element, in the order of declaration."""
        record = self._pack(*self._header, time_us, *values)
        self._last = np.frombuffer(record, self._dtype)
        self._writer.append(record)


class UlogWriter(LogFile):
    """Writes one log; `close` gives it its name, an interrupted one stays readable under NAME.part."""

    def __init__(
        self,
        target: Path | str | BinaryIO,
        start_us: int,
        info: Mapping[str, InfoValue],
        parameters: Mapping[str, int | float],
        parameter_defaults: Mapping[str, int | float] | None = None,
        on_trouble: Callable[[str], None] | None = None,
    ) -> None:
        """Opens the log.

        Args:
            target: path of the log, or a binary stream.
            start_us: simulated time at which the log begins [us].
            info: PX4's keys such as sys_name, ver_hw, ver_sw; a list of texts becomes a multi information message.
            parameters: values in use at the start.
            parameter_defaults: default values; those that differ from the value in use are noted in the log.
            on_trouble: as of a `LogFile`.

        Raises:
            OSError: the folder is missing or may not be written.
        """
        super().__init__(target, on_trouble)
        self._start_us = start_us
        self._info = [record for key, value in info.items() for record in _info_records(key, value)]
        self._parameters = dict(parameters)
        self._defaults = dict(parameter_defaults or {})
        self._topics: list[UlogTopic] = []
        self.listeners: list[Callable[[bytes], None]] = []  # each gets whole data records, many at a time
        self._has_data = False
        self._bytes_since_sync = 0

    def add_topic(self, name: str, fields: Mapping[str, str], multi_id: int = 0) -> UlogTopic:
        """Declares a topic instance.

        Args:
            name: PX4's topic name where there is one.
            fields: ULog type by field name, such as `{"q": "float[4]"}`; `timestamp` [us] is added in front.
            multi_id: which of several instances of the topic, from 0.
        """
        if self._has_data:
            raise ValueError(f"topic {name} is declared after the first row: readers would not find it")
        topic = UlogTopic(self, name, fields, multi_id, topic_id=len(self._topics))
        for other in self._topics:
            if other.name == name and (other.multi_id == multi_id or other.format_text != topic.format_text):
                raise ValueError(f"topic {name} instance {multi_id} is declared twice or with other fields")
        self._topics.append(topic)
        return topic

    def inform(self, key: str, texts: Sequence[str]) -> None:
        """Adds a multi information message; before the first row."""
        if self._has_data:
            raise ValueError(f"information {key} comes after the first row: readers would not find it")
        self._info += _info_records(key, texts)

    def message(self, time_us: int, level: int, text: str) -> None:
        """Logs a text; level is a syslog and MAV_SEVERITY number, 0 emergency to 7 debug."""
        self.append(_record("L", pack("<BQ", ord("0") + level, time_us) + text.encode()))

    def parameter(self, name: str, value: int | float) -> None:
        """Logs a parameter change, in force from the rows that follow."""
        self._parameters[name] = value
        self.append(_record("P", _key_value(name, value)))

    def append(self, records: bytes) -> None:
        """Appends whole data records."""
        if not self._has_data:
            self._begin_data()
        self.write(records)
        for listener in self.listeners:
            listener(records)
        self._bytes_since_sync += len(records)
        if self._bytes_since_sync >= SYNC_EVERY_BYTES:
            self.write(_record("S", SYNC_MAGIC))
            self._bytes_since_sync = 0

    def go_on(self, start_us: int) -> None:
        """Begins a new part if this one is full; what follows is not before `start_us`."""
        if self.is_full:
            self.next_part()
            self._start_us = start_us
            self._has_data = False
            self._bytes_since_sync = 0

    def close(self) -> None:
        """Completes the log."""
        if not self._has_data:
            self._begin_data()
        super().close()

    def header(self, start_us: int) -> bytes:
        """The log up to its data, with the parameters as they are now: a log of its own may follow from here."""
        formats = dict.fromkeys(topic.format_text for topic in self._topics)
        changed = {name: value for name, value in self._defaults.items() if value != self._parameters.get(name)}
        default = bytes((PARAMETER_DEFAULT_OF_SYSTEM,))
        subscriptions = (
            _record("A", pack("<BH", topic.multi_id, topic.topic_id) + topic.name.encode()) for topic in self._topics
        )
        return b"".join(
            (
                MAGIC + pack("<Q", start_us),
                _record("B", bytes(40)),
                *(_record("F", text.encode()) for text in formats),
                *self._info,
                *(_record("P", _key_value(name, value)) for name, value in self._parameters.items()),
                *(_record("Q", default + _key_value(name, value)) for name, value in changed.items()),
                *subscriptions,
            )
        )

    def _begin_data(self) -> None:
        self._has_data = True
        self.write(self.header(self._start_us))


def _record(kind: str, content: bytes) -> bytes:
    if len(content) > MAX_MESSAGE_BYTES:
        raise ValueError(f"a ULog message holds at most {MAX_MESSAGE_BYTES} bytes, not {len(content)}")
    return _HEADER.pack(len(content), ord(kind)) + content


def _key_value(key: str, value: str | int | float) -> bytes:
    """A typed key and its value: char[n], int32_t or float."""
    if isinstance(value, str):
        typed_key, content = f"char[{len(value.encode())}] {key}", value.encode()
    elif isinstance(value, int):
        typed_key, content = f"int32_t {key}", pack("<i", value)
    else:
        typed_key, content = f"float {key}", pack("<f", value)
    return bytes((len(typed_key.encode()),)) + typed_key.encode() + content


def _info_records(key: str, value: InfoValue) -> list[bytes]:
    if isinstance(value, str | int | float):
        return [_record("I", _key_value(key, value))]
    return [_record("M", bytes((i > 0,)) + _key_value(key, text)) for i, text in enumerate(value)]


def _aligned(fields: Mapping[str, str]) -> tuple[str, list[tuple[str, str, tuple[int, ...]]], str]:
    """The fields' ULog declaration, NumPy layout and struct layout, each field at a multiple of its element size."""
    declarations: list[str] = []
    dtype: list[tuple[str, str, tuple[int, ...]]] = []
    struct_layout = ""
    offset = 0
    for name, type_text in fields.items():
        match = fullmatch(r"(\w+?)(?:\[(\d+)\])?", type_text)
        if match is None or match[1] not in STRUCT_CODES:
            raise ValueError(f"field {name}: {type_text} is no ULog type")
        code = STRUCT_CODES[match[1]]
        length = int(match[2] or 1)
        element_size = calcsize(f"<{code}")
        gap = -offset % element_size
        if gap:
            padding = f"_padding{len(declarations)}"
            declarations.append(f"uint8_t[{gap}] {padding};")
            dtype.append((padding, "u1", (gap,)))
            struct_layout += f"{gap}x"
        declarations.append(f"{type_text} {name};")
        if code == "s":
            dtype.append((name, f"S{length}", ()))
        else:
            dtype.append((name, f"<{code}", (length,) if match[2] else ()))
        struct_layout += f"{length}{code}"
        offset += gap + element_size * length
    return "".join(declarations), dtype, struct_layout
