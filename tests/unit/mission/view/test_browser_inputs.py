"""What a browser sends, looked at before anything uses it."""

import msgspec
import pytest

from mission.view.browser_inputs import is_sound, within

CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1.0, 0.0, 0.0, 0.0], "position": [3, 3.5, 3.0], "fov": 1.0, "near": 0.1,
    "far": 100.0, "image_height": 480, "image_width": 640, "look_at": [0.0, 0.0, 0.0], "up_direction": [0.0, 0.0, 1.0],
}  # fmt: skip
CLICK = {
    "type": "ScenePointerMessage",
    "event_type": "click",
    "ray_origin": [0.0] * 3,
    "ray_direction": [0.0, 0.0, 1.0],
}
NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("value", "expected"),
    [(3.0, 3.0), (3, 3.0), (-1.0, 2.0), (1e6, 60.0), (NAN, 2.0), (INF, 2.0), ("9", 2.0), (None, 2.0), (10**400, 2.0)],
)
def test_a_slider_stays_inside_its_bounds(value, expected):
    assert within(value, 2.0, 60.0) == expected


@pytest.mark.parametrize(
    "message",
    [
        CAMERA, CLICK, {"type": "GuiUpdateMessage", "uuid": "1", "updates": {"value": 3.5}},
        {"type": "GuiUpdateMessage", "uuid": "1", "updates": {"value": "1 x"}},
        {"type": "GuiUpdateMessage", "uuid": "1", "updates": {"value": True}},
    ],
)  # fmt: skip
def test_what_a_page_sends_is_taken(message):
    assert is_sound(msgspec.msgpack.encode(message))


@pytest.mark.parametrize(
    "message",
    [
        CAMERA | {"position": [NAN, 0.0, 0.0]}, CAMERA | {"position": [1e300, 0.0, 0.0]}, CAMERA | {"position": [0.0]},
        CAMERA | {"position": None}, CAMERA | {"look_at": CAMERA["position"]}, CAMERA | {"up_direction": [0, 0, 0]},
        CAMERA | {"wxyz": [0.0] * 4}, CAMERA | {"fov": "wide"}, CLICK | {"ray_direction": [0.0] * 3},
        CLICK | {"ray_origin": [INF, 0.0, 0.0]}, CLICK | {"ray_origin": None},
        {"type": "GuiUpdateMessage", "uuid": "1", "updates": {"value": NAN}},
        {"type": "GuiUpdateMessage", "uuid": "1", "updates": {"value": 1.0, "update_cb": []}},
        {"type": "GuiUpdateMessage", "uuid": "1", "updates": {"props": 1}}, {"type": "GuiUpdateMessage"},
        {"type": "ShareUrlRequest"}, {"type": "FileTransferStartUpload"}, {"type": ["list"]}, {}, [], None, 7,
    ],
)  # fmt: skip
def test_what_no_page_sends_is_dropped(message):
    assert not is_sound(msgspec.msgpack.encode(message))


@pytest.mark.parametrize("raw", [b"", b"\xc1", b"\x91" * 10_000, "text", b"\xa1\xff"])
def test_what_is_no_message_is_dropped(raw):
    assert not is_sound(raw)
