"""What each parameter means, for a ground station's editor: COMP_METADATA_TYPE_PARAMETER, from the declarations."""

import re
from math import isfinite
from typing import Any

from autopilot.mavlink.services.parameter_view import ParameterView

_TYPES = {2: "Int8", 4: "Int16", 6: "Int32", 9: "Float"}  # by MAV_PARAM_TYPE
_CHOICE = re.compile(r"(?:^|[,:] )(-?\d+)(?: and (-?\d+))?:? (.+?)(?=, -?\d|$)")
_AT_POWER_ON = "read at power-on"


def parameter_metadata(view: ParameterView) -> dict[str, Any]:
    """The file that tells clients type, unit, bounds, default and meaning of every parameter."""
    return {"version": 1, "parameters": [_entry(view, name) for name in view.names]}


def _entry(view: ParameterView, name: str) -> dict[str, Any]:
    meaning, unit = view.meaning(name), view.unit(name)
    entry: dict[str, Any] = {
        "name": name,
        "type": _TYPES[view.param_type(name)],
        "shortDesc": meaning[:1].upper() + meaning[1:],
        "group": name.partition("_")[0],
        "category": "Standard",
        "default": view.default(name),
    }
    if unit:
        entry["units"] = unit
    low, high = view.bounds(name)
    entry |= {key: bound for key, bound in (("min", low), ("max", high)) if isfinite(bound)}
    if _AT_POWER_ON in meaning:
        entry["rebootRequired"] = True
    if view.is_integer(name) and low < high:
        flags, values = bits(meaning, high), choices(meaning, low, high)
        if flags:
            entry["bitmask"] = [{"index": index, "description": text} for index, text in flags.items()]
        elif values:
            entry["values"] = [{"value": value, "description": text} for value, text in values.items()]
    return entry


def bits(meaning: str, high: float) -> dict[int, str]:
    """What the bits of a mask stand for, by their index; empty if the parameter is none or does not tell."""
    start = meaning.find("bit 0 ")
    if start >= 0:
        named = choices(": " + meaning[start:].replace("bit ", ""), 0.0, high)
        return named if max(named, default=0) < int(high).bit_length() else {}
    masks = choices(meaning, 1.0, high)
    is_mask = len(masks) > 2 and all(value & value - 1 == 0 for value in masks) and high == 2 * max(masks) - 1
    return {value.bit_length() - 1: text for value, text in masks.items()} if is_mask else {}


def choices(meaning: str, low: float, high: float) -> dict[int, str]:
    """What an integer parameter's values stand for, if its meaning tells; empty if it is a number like any other."""
    found: dict[int, str] = {}
    for first, second, text in _CHOICE.findall(meaning):
        for number in filter(None, (first, second)):
            found[int(number)] = text[:1].upper() + text[1:]
    if len(found) > 1 and all(low <= value <= high for value in found):
        return dict(sorted(found.items()))
    return {0: "Disabled", 1: "Enabled"} if (low, high) == (0, 1) else {}
