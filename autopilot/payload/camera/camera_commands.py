"""What clients and mission items ask of the camera: which commands it takes, and with which parameters.

In: a command's number and parameters. Out: what the camera replies, or why the parameters cannot be meant.
"""

from collections.abc import Callable
from enum import IntEnum
from math import isfinite

from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict
from autopilot.payload.camera.camera import SHUTTER_US, Camera
from autopilot.payload.payloads import Params

INTERVAL_MAX_S = 86_400.0


class Command(IntEnum):
    """What the camera takes, numbered as MAV_CMD."""

    DIGICAM_CONTROL = 203
    TRIGGER_DISTANCE = 206
    TRIGGER_INTERVAL = 214
    SET_MODE = 530
    SET_ZOOM = 531
    SET_FOCUS = 532
    START_PHOTOS = 2000
    STOP_PHOTOS = 2001
    TRIGGER_CONTROL = 2003
    START_VIDEO = 2500
    STOP_VIDEO = 2501


class CameraCommands:
    """The commands of one camera (autopilot.payload.payloads.Payload)."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        self._handlers: dict[int, Callable[[Params, float], Reply]] = {
            Command.DIGICAM_CONTROL: self._digicam,
            Command.TRIGGER_DISTANCE: self._trigger_distance,
            Command.TRIGGER_INTERVAL: self._trigger_interval,
            Command.TRIGGER_CONTROL: self._trigger_control,
            Command.SET_MODE: lambda params, _: camera.set_mode(params[1]),
            Command.SET_ZOOM: lambda params, _: self._turn(camera.lens.set_zoom, params),
            Command.SET_FOCUS: lambda params, _: self._turn(camera.lens.set_focus, params),
            Command.START_PHOTOS: lambda params, _: self._start_photos(params),
            Command.STOP_PHOTOS: lambda _, __: camera.stop_photos(),
            Command.START_VIDEO: lambda _, __: camera.start_video(),
            Command.STOP_VIDEO: lambda _, __: camera.stop_video(),
        }

    def takes(self, command: int) -> bool:
        return command in self._handlers

    def run(self, command: int, params: Params, x: float, _: float, __: float) -> Reply:
        return self._handlers[command](params, x)

    def _start_photos(self, params: Params) -> Reply:
        interval_s, count = params[1], params[2]
        if not isfinite(count) or count < 0 or count != int(count):
            return Reply(Verdict.DENIED, "the number of photos must be 0 or more")
        if count == 1:
            return self._camera.take_photo()
        return _interval_refusal(interval_s) or self._camera.start_photos(interval_s, int(count))

    def _trigger_distance(self, params: Params, _: float) -> Reply:
        distance_m, is_now = params[0], params[2] == 1.0
        if not isfinite(distance_m) or distance_m < 0.0:
            return Reply(Verdict.DENIED, "the trigger distance must be 0 or more")
        if distance_m == 0.0:
            self._camera.stop_distance()
            return self._camera.take_photo() if is_now else ACCEPTED
        return self._camera.trigger_by_distance(distance_m, is_now=is_now)

    def _trigger_interval(self, params: Params, _: float) -> Reply:
        interval_s = 1e-3 * params[0]
        if not isfinite(interval_s):
            return Reply(Verdict.DENIED, "the trigger interval is not a number")
        if interval_s <= 0.0:
            return self._camera.stop_photos()
        return _interval_refusal(interval_s) or self._camera.trigger_by_interval(interval_s)

    def _trigger_control(self, params: Params, _: float) -> Reply:
        if params[1] == 1.0:
            self._camera.count_anew()
        if params[0] == 0.0 or params[2] == 1.0:
            return self._camera.stop_photos()
        if params[0] == 1.0 and not self._camera.trigger.is_active:
            return Reply(Verdict.DENIED, "say how: by a trigger distance or interval")
        return ACCEPTED

    def _digicam(self, params: Params, shoot: float) -> Reply:
        if isfinite(params[2]) and params[2] != 0.0:
            self._camera.turn(self._camera.lens.set_zoom, 0, params[2])
        return self._camera.take_photo() if shoot == 1.0 else ACCEPTED

    def _turn(self, motor: Callable[[int, float], Reply], params: Params) -> Reply:
        if not isfinite(params[0]) or params[0] != int(params[0]):
            return Reply(Verdict.DENIED, "the type is not a number")
        return self._camera.turn(motor, int(params[0]), params[1])


def _interval_refusal(interval_s: float) -> Reply | None:
    if not isfinite(interval_s) or interval_s * 1e6 < SHUTTER_US:
        return Reply(Verdict.DENIED, f"the interval must be at least {SHUTTER_US * 1e-6:g} s")
    if interval_s > INTERVAL_MAX_S:
        return Reply(Verdict.DENIED, "the interval must be a day at most")
    return None
