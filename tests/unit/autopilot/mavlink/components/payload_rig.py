"""The MAVLink rig with a vehicle that carries a camera on a gimbal, and a light that is easy to predict."""

from concurrent.futures import Future
from dataclasses import dataclass, field

import numpy as np
from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.platform import Host
from autopilot.interface.vehicle_state import Verdict
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.payload.camera.ports import RawFrame, View
from autopilot.payload.camera.storage import MediaFolder
from tests.unit.autopilot.mavlink.rig import FRAME_US, AskedVehicle, Rig

CAMERA, GIMBAL = 100, 154
ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = (
    Verdict.ACCEPTED,
    Verdict.TEMPORARILY_REJECTED,
    Verdict.DENIED,
    Verdict.UNSUPPORTED,
    Verdict.FAILED,
)
REQUEST, START, STOP = 512, mavlink.MAV_CMD_IMAGE_START_CAPTURE, mavlink.MAV_CMD_IMAGE_STOP_CAPTURE
INFORMATION, SETTINGS_ID, STORAGE, STATUS, CAPTURED = 259, 260, 261, 262, 263


@dataclass
class Light:
    """A frame source: grey, half of it near, and delivered at once unless it is told to wait."""

    views: list[View] = field(default_factory=list)
    waiting: list[Future] = field(default_factory=list)
    is_slow: bool = False
    has_noise: bool = False

    def capture(self, view: View):
        self.views.append(view)
        rgb = np.full((view.height, view.width, 3), 128, np.uint8)
        rgb[:, ::8] = 0
        if self.has_noise:
            rgb = np.random.default_rng(len(self.views)).integers(0, 256, rgb.shape, np.uint8)
        depth = np.full((view.height, view.width), 100.0, np.float32)
        frame: Future[RawFrame] = Future()
        if self.is_slow:
            self.waiting.append(frame)
        else:
            frame.set_result(RawFrame(rgb, depth))
        return frame

    def deliver(self):
        view = self.views[-1]
        rgb = np.zeros((view.height, view.width, 3), np.uint8)
        for frame in self.waiting:
            frame.set_result(RawFrame(rgb, np.ones((view.height, view.width), np.float32)))
        self.waiting.clear()


@dataclass
class Stream:
    """A live picture that nobody serves."""

    uri: str = "http://127.0.0.1:8554/stream.mjpg"
    definition_uri: str = "http://127.0.0.1:8554/camera.xml"
    width: int = 320
    height: int = 180
    rate_hz: float = 10.0
    bitrate: int = 0
    is_rtp: bool = False
    is_running: bool = True

    def media_uri(self, name):
        return f"http://127.0.0.1:8554/media/{name}"


class PayloadVehicle(AskedVehicle):
    """With camera and gimbal."""

    def __init__(self, folder, stream, video=None):
        self.light = Light()
        media = None if folder is None else MediaFolder(folder)
        super().__init__(Host(frames=self.light, media=media, stream=stream, video=video))


class PayloadRig(Rig):
    """Server and client; the camera's frame runs before the server's, as in the controller."""

    def __init__(self, folder=None, stream=None, dialect=PX4, video=None, **options):
        super().__init__(dialect=dialect, vehicle=PayloadVehicle(folder, stream, video), **options)
        self.vehicle.camera.settings.set("CAM_SMOOTH", 0)

    def frame(self, count=1):
        messages = []
        for _ in range(count):
            self.vehicle.state.time_us = self.time_us + FRAME_US
            if self.vehicle.camera.due_us <= self.vehicle.state.time_us:
                self.vehicle.camera.frame()
            messages += super().frame(1)
        return messages

    def to(self, component, command, *params):
        """A COMMAND_LONG to a component; parameters left out are 0."""
        values = (*params, *(0.0,) * (7 - len(params)))
        fields = {f"param{i + 1}": value for i, value in enumerate(values)}
        self.client.send("COMMAND_LONG", target_component=component, command=command, **fields)

    def acks(self, component, command, *params):
        """(component, result) of each acknowledgement of a command, in the next frame."""
        self.to(component, command, *params)
        return [
            (message.compid, message.fields.result)
            for message in self.frame(1)
            if message.name == "COMMAND_ACK" and message.fields.command == command
        ]


def from_camera(messages, name):
    """The fields of the camera's messages of this name."""
    return [message.fields for message in messages if message.name == name and message.compid == CAMERA]


def requested(rig, command, *params):
    """What comes in the frame after a command to the camera."""
    rig.to(CAMERA, command, *params)
    return rig.frame()
