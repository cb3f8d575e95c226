"""Component metadata: what events and parameters mean, in files that clients fetch by MAVLink FTP.

In: requests for COMPONENT_METADATA. Out: where the general file is; it names the others. They are made
once, and never change while the vehicle runs.
"""

import json
import lzma
import zlib
from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from typing import Any

from autopilot.interface.vehicle_state import Reply
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.service import Command, RequestHandler, Service
from autopilot.mavlink.services.event_texts import events_metadata
from autopilot.mavlink.services.files.parameter_metadata import parameter_metadata
from autopilot.mavlink.services.identity import PROJECT, project_version
from autopilot.mavlink.telemetry.motion import boot_ms
from autopilot.mavlink.wire.codec import known_type

METADATA_FOLDER = "@METADATA"
GENERAL = "general.json.xz"
_PARAMETERS, _EVENTS = "parameters.json.xz", "events.json.xz"
_TYPE_PARAMETER, _TYPE_EVENTS = 1, 4  # COMP_METADATA_TYPE
# What small decoders on the other side take: no filter but LZMA2, a small dictionary, CRC32.
_FILTERS = [{"id": lzma.FILTER_LZMA2, "preset": 6, "dict_size": 1 << 16}]

_COMPONENT_METADATA = known_type("COMPONENT_METADATA")


def checksum(content: bytes) -> int:
    """CRC32 without the inversions at both ends, as PX4 computes it; clients keep files by it."""
    return zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF


class MetadataService(Service):
    """Makes the files and says where they are."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def requests(self) -> Mapping[str, RequestHandler]:
        return {"COMPONENT_METADATA": self._requested}

    def _requested(self, _: Command) -> Sequence[bytes] | Reply:
        """Where the general file is, and its checksum."""
        time_ms = boot_ms(self._endpoint.time_us)
        return [_COMPONENT_METADATA.pack(time_ms, checksum(self.files[GENERAL]), _uri(GENERAL))]

    def prepare(self) -> None:
        """Makes the files: packing them takes a frame."""
        _ = self.files

    @cached_property
    def files(self) -> dict[str, bytes]:
        """Every file, by name."""
        dialect = self._endpoint.dialect
        files = {_EVENTS: _packed_json(events_metadata(dialect))}
        kinds = {_EVENTS: _TYPE_EVENTS}
        if dialect.name == "px4":  # stations know ArduPilot's parameters, and ArduPilot itself tells them nothing
            files[_PARAMETERS] = _packed_json(parameter_metadata(self._endpoint.parameters))
            kinds[_PARAMETERS] = _TYPE_PARAMETER
        described = [
            {"type": kind, "uri": _uri(name), "fileCrc": checksum(files[name])} for name, kind in kinds.items()
        ]
        general = {
            "version": 1, "vendorName": PROJECT, "modelName": PROJECT, "firmwareVersion": project_version(),
            "metadataTypes": described,
        }  # fmt: skip
        files[GENERAL] = _packed_json(general)
        return files


def _uri(name: str) -> str:
    return f"mftp:///{METADATA_FOLDER}/{name}"


def _packed_json(content: Mapping[str, Any]) -> bytes:
    return _packed(json.dumps(content, separators=(",", ":"), allow_nan=False))


@lru_cache(maxsize=8)  # one vehicle after another has the same files
def _packed(text: str) -> bytes:
    return lzma.compress(text.encode("utf-8"), format=lzma.FORMAT_XZ, check=lzma.CHECK_CRC32, filters=_FILTERS)
