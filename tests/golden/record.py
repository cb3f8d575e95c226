"""What is kept of a golden flight, and in what two such records differ.

Kept are the figures of its summary, a hash of each ULog topic, and one of each log file. Machines whose processor or
mathematical library rounds otherwise fly a little otherwise: the processor's kind, for networks are computed by what it
can do, and a probe that knows nothing of this project tell them apart, and there the figures are compared within a
tolerance.
"""

import hashlib
import platform
from collections.abc import Callable, Iterator
from math import isclose
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import warp as wp
from pyulog import ULog

from common.warp_start import start_warp
from mission.log.flight_summary import Summary

LOGS = ("flight.ulg", "flight.tlog")
TOLERANCE = 0.05  # of a figure, and absolutely, on a machine that rounds otherwise
PROBES = 256

Record = dict[str, Any]


@wp.kernel
def _probe(x: wp.array(dtype=wp.float32), out: wp.array(dtype=wp.float32)) -> None:
    i = wp.tid()
    a = x[i]
    total = wp.sin(a) * wp.cos(3.0 * a) + wp.exp(-a) * wp.log(1.0 + a) + wp.atan2(a, 1.0 - a) * wp.pow(a, 1.3)
    for _ in range(100):
        total = total * 0.9 + wp.sqrt(wp.abs(total)) * a
    out[i] = total


def machine() -> str:
    """A name for how this machine rounds."""
    start_warp()
    x = np.linspace(0.001, 3.0, PROBES, dtype=np.float32)
    out = wp.zeros(PROBES, dtype=wp.float32, device="cpu")
    wp.launch(_probe, dim=PROBES, inputs=[wp.array(x, device="cpu"), out], device="cpu")
    own = np.concatenate([np.sin(x * 7.0), np.exp(-x), np.linalg.inv(np.outer(x[:6], x[3:9]) + np.eye(6)).ravel()])
    return _hash(out.numpy().tobytes() + own.tobytes() + _processor().encode())


def _processor() -> str:
    """Its family and model and how it can calculate, as Linux tells; elsewhere its name."""
    cpuinfo = Path("/proc/cpuinfo")
    if not cpuinfo.is_file():
        return platform.processor()
    pairs = (line.split(":", 1) for line in cpuinfo.read_text().split("\n\n")[0].splitlines() if ":" in line)
    told = {name.strip(): value.strip() for name, value in pairs}
    kinds = (
        told.get(key, "") for key in ("vendor_id", "cpu family", "model", "CPU implementer", "CPU part", "Features")
    )
    vectors = (flag for flag in sorted(told.get("flags", "").split()) if flag.startswith(("avx", "amx", "fma")))
    return " ".join((*kinds, *vectors))


def flown(flight: Callable[[Path], Summary]) -> Record:
    """Flies, and returns the record."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        figures = flight(folder).as_json()
        hashes = {log: _hash((folder / log).read_bytes()) for log in LOGS}
        return {"figures": figures, "topics": dict(_topics(folder / LOGS[0])), "logs": hashes}


def differences(old: Record, new: Record, *, is_same_machine: bool) -> list[str]:
    """One line for each thing that has changed."""
    if not is_same_machine:
        return [line for line in _differences(old["figures"], new["figures"]) if not line.endswith("(rounding)")]
    lines = _differences(old["figures"], new["figures"])
    for part in ("topics", "logs"):
        names = [*old[part], *(name for name in new[part] if name not in old[part])]
        changed = [name for name in names if old[part].get(name) != new[part].get(name)]
        lines += [f"{name}: {_change(old[part], new[part], name)}" for name in changed]
    return lines


def _change(old: dict[str, str], new: dict[str, str], name: str) -> str:
    return "is new" if name not in old else "is gone" if name not in new else "has other bytes"


def _differences(old: Any, new: Any, name: str = "") -> list[str]:
    if isinstance(old, dict) and isinstance(new, dict):
        names = [*old, *(key for key in new if key not in old)]
        return [line for key in names for line in _differences(old.get(key), new.get(key), f"{name} {key}".strip())]
    if old == new:
        return []
    numbers = [value for value in (old, new) if isinstance(value, int | float) and not isinstance(value, bool)]
    is_close = len(numbers) == 2 and isclose(old, new, rel_tol=TOLERANCE, abs_tol=TOLERANCE)
    return [f"{name}: {old} -> {new}{' (rounding)' if is_close else ''}"]


def _topics(path: Path) -> Iterator[tuple[str, str]]:
    log = ULog(str(path))
    for topic in sorted(log.data_list, key=lambda topic: (topic.name, topic.multi_id)):
        columns = b"".join(field.encode() + topic.data[field].tobytes() for field in sorted(topic.data))
        yield f"{topic.name} {topic.multi_id}", _hash(columns)
    yield "texts", _hash(repr([(message.timestamp, message.message) for message in log.logged_messages]).encode())
    yield "parameters", _hash(repr(sorted(log.initial_parameters.items())).encode())


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]
