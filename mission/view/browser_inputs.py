"""What a browser sends: only messages that a page of ours needs, and only numbers that are finite and inside bounds."""

from collections.abc import Mapping
from math import dist
from typing import Any

import msgspec

NUMBER_MAX = 1e6  # [m], [px], or whatever else: no place or size is larger
LOOK_MIN_M = 1e-3  # from a camera to what it looks at
_CAMERA = {"position": 3, "look_at": 3, "up_direction": 3, "wxyz": 4}  # a camera's vectors
_RAY = {"ray_origin": 3, "ray_direction": 3}


def within(value: Any, low: float, high: float) -> float:
    """A slider's value inside its bounds; `low` if it is no number."""
    return min(max(float(value), low), high) if _is_number(value) else low


def is_sound(raw: bytes | str) -> bool:
    """Whether a message of a browser may be handed to viser, which looks at nothing before it uses it."""
    try:
        message = msgspec.msgpack.decode(raw if isinstance(raw, bytes) else b"")
    except (msgspec.DecodeError, RecursionError, ValueError):
        return False
    if not isinstance(message, dict):
        return False
    match message.get("type"):
        case "ViewerCameraMessage":
            return _is_camera(message)
        case "ScenePointerMessage":
            return _has_vectors(message, _RAY) and any(message["ray_direction"])
        case "GuiUpdateMessage":
            updates = message.get("updates")
            return isinstance(updates, dict) and updates.keys() == {"value"} and _is_value(updates["value"])
        case "SceneNodeClickMessage" | "GuiButtonHoldMessage" | "CommandTriggerMessage":
            return True
        case _:  # uploads, links to share, images: no page of ours asks for them
            return False


def _is_camera(message: Mapping[str, Any]) -> bool:
    numbers = [message.get(name) for name in ("fov", "near", "far", "image_height", "image_width")]
    if not all(map(_is_number, numbers)) or not _has_vectors(message, _CAMERA):
        return False
    is_looking = dist(message["position"], message["look_at"]) >= LOOK_MIN_M
    return is_looking and any(message["up_direction"]) and any(message["wxyz"])


def _has_vectors(message: Mapping[str, Any], lengths: Mapping[str, int]) -> bool:
    return all(
        isinstance(vector := message.get(name), list) and len(vector) == length and all(map(_is_number, vector))
        for name, length in lengths.items()
    )


def _is_value(value: Any) -> bool:
    return isinstance(value, str | bool) or _is_number(value)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and abs(value) <= NUMBER_MAX  # NaN is not
