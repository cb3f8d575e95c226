"""Parameters and mission items as the fields of MAVLink messages, for the scripting client."""

import struct
from math import isnan
from typing import Any

from mission.plan.plan_file import PlanItem

PARAMETER_IS_INTEGER, PARAMETER_IS_REAL = 6, 9  # MAV_PARAM_TYPE_INT32, _REAL32


def parameter_to_wire(value: float, param_type: int) -> int:
    """The bit pattern of a value in PX4's encoding, where an integer's bits travel in the float field."""
    bits = struct.pack("<i", int(value)) if param_type == PARAMETER_IS_INTEGER else struct.pack("<f", value)
    return int.from_bytes(bits, "little")


def parameter_from_wire(message: Any, *, is_real: bool = False) -> float:
    """The value in the fields of a PARAM_VALUE of PX4's encoding.

    Args:
        message: the fields.
        is_real: it comes as a float whatever its type, as ArduPilot sends it.
    """
    bits = message.param_value.to_bytes(4, "little")
    layout = "<i" if message.param_type == PARAMETER_IS_INTEGER and not is_real else "<f"
    return float(struct.unpack(layout, bits)[0])


def item_fields(item: PlanItem) -> dict[str, Any]:
    """The fields of the MISSION_ITEM_INT of a plan's item, without its target."""
    fields = {f"param{k + 1}": value for k, value in enumerate(item.params)}
    return fields | {
        "seq": item.seq,
        "frame": item.frame,
        "command": item.command,
        "current": int(item.seq == 0),
        "autocontinue": int(item.autocontinue),
        "x": 0 if isnan(item.x) else round(item.x * 1e7),
        "y": 0 if isnan(item.y) else round(item.y * 1e7),
        "z": item.z,
    }


def plan_item(message: Any) -> PlanItem:
    """The plan's item in the fields of a MISSION_ITEM_INT."""
    return PlanItem(
        seq=message.seq,
        frame=message.frame,
        command=message.command,
        params=(message.param1, message.param2, message.param3, message.param4),
        x=message.x * 1e-7,
        y=message.y * 1e-7,
        z=message.z,
        autocontinue=bool(message.autocontinue),
    )
