"""The camera: takes photos when asked or triggered, records video, and keeps both on its card.

In: commands of clients and mission items (`run`), frames of the host's `FrameSource`. Out: files, and a `Shot` for each
photo to whoever listens. It works when something is due, on simulated time; the controller calls `frame` then.
"""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from enum import IntEnum
from math import isfinite

import numpy as np

from autopilot.interface.vehicle_state import ACCEPTED, Reply, VehicleState, Verdict
from autopilot.payload.camera.camera_settings import MODE, Settings
from autopilot.payload.camera.image_file import defocused, jpeg_bytes
from autopilot.payload.camera.lens import FOCUS_NEAR_M, Lens
from autopilot.payload.camera.ports import FrameSource, RawFrame, View
from autopilot.payload.camera.storage import MediaFolder
from autopilot.payload.camera.trigger import NEVER_US, Trigger
from autopilot.payload.camera.video import Recording
from autopilot.payload.gimbal.gimbal import Gimbal
from autopilot.payload.payloads import Params
from common.attitude import Quat
from common.geodesy import GeoPoint

CAMERA_ID = 100  # MAV_COMP_ID_CAMERA
SHUTTER_US = 200_000  # from one photo to the next at the earliest; guess
INTERVAL_MAX_S = 86_400.0
PENDING_MAX = 2  # photos that wait for the host
SHOTS_KEPT = 10_000
VIDEO_BYTES_MIN = 1 << 20  # room a recording needs to begin

ListensToShots = Callable[["Shot"], None]


class CameraMode(IntEnum):
    """Numbered as CAMERA_MODE."""

    IMAGE = 0
    VIDEO = 1
    IMAGE_SURVEY = 2


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


@dataclass(frozen=True, slots=True)
class Shot:
    """One photo: where, when and which way."""

    index: int
    time_us: int
    place: GeoPoint
    above_home_m: float
    q_ned_from_frd: Quat  # of the camera body: x ahead
    name: str
    is_stored: bool


class Camera:
    """The camera of one vehicle.

    Args:
        state: the vehicle, as of this frame.
        gimbal: which way it looks.
        source: the light in front of it.
        media: its card; None: there is none in it.
    """

    def __init__(self, state: VehicleState, gimbal: Gimbal, source: FrameSource, media: MediaFolder | None) -> None:
        self.lens = Lens()
        self.settings = Settings()
        self.trigger = Trigger()
        self.media = media
        self.gimbal = gimbal
        self.shots: deque[Shot] = deque(maxlen=SHOTS_KEPT)
        self.shot_count = 0
        self.recording: Recording | None = None
        self.due_us = NEVER_US
        self._state = state
        self._source = source
        self._video_count = 0
        self._busy_until_us = 0
        self._pending: deque[tuple[Shot, View, Future[RawFrame]]] = deque()
        self._listeners: list[ListensToShots] = []
        self._full_listeners: list[Callable[[], None]] = []
        self._handlers: dict[int, Callable[[Params, float], Reply]] = {
            Command.DIGICAM_CONTROL: self._digicam,
            Command.TRIGGER_DISTANCE: self._trigger_distance,
            Command.TRIGGER_INTERVAL: self._trigger_interval,
            Command.TRIGGER_CONTROL: self._trigger_control,
            Command.SET_MODE: lambda params, _: self.set_mode(params[1]),
            Command.SET_ZOOM: lambda params, _: self._turn(self.lens.set_zoom, params),
            Command.SET_FOCUS: lambda params, _: self._turn(self.lens.set_focus, params),
            Command.START_PHOTOS: lambda params, _: self._start_photos(params),
            Command.STOP_PHOTOS: lambda _, __: self.stop_photos(),
            Command.START_VIDEO: lambda _, __: self.start_video(),
            Command.STOP_VIDEO: lambda _, __: self.stop_video(),
        }

    def on_shot(self, listener: ListensToShots) -> None:
        """`listener` hears of each photo when it is stored."""
        self._listeners.append(listener)

    def on_full(self, listener: Callable[[], None]) -> None:
        """`listener` hears when a recording was stopped because the storage is full."""
        self._full_listeners.append(listener)

    # autopilot.payload.payloads.Payload

    def takes(self, command: int) -> bool:
        return command in self._handlers

    def run(self, command: int, params: Params, x: float, _: float, __: float) -> Reply:
        return self._handlers[command](params, x)

    # What it is doing

    @property
    def time_us(self) -> int:
        return self._state.time_us

    @property
    def is_taking_photo(self) -> bool:
        return bool(self._pending) or self._state.time_us < self._busy_until_us

    @property
    def available_mib(self) -> float:
        return 0.0 if self.media is None else self.media.free_bytes / (1 << 20)

    def frame(self) -> None:
        """Takes and stores the photos and video frames that are due."""
        now_us = self._state.time_us
        self._develop()
        has_room = len(self._pending) < PENDING_MAX  # a slow host delays a series
        if self.trigger.is_active and has_room and self.trigger.is_due(now_us, self._state.estimate.pos_ned):
            self._shoot()
        recording = self.recording
        if recording is not None:
            while now_us >= recording.due_us:
                if recording.wants_frame:
                    recording.expect(self._source.capture(self.view(recording.size, is_smooth=False)))
                recording.advance()
            if not recording.has_room:
                self.stop_video()
                for tell in self._full_listeners:
                    tell()
        self._plan()

    def _plan(self) -> None:
        """Says when something is due next."""
        now_us = self._state.time_us
        due_us = self.trigger.due_us(now_us)
        if self._pending:
            due_us = now_us
        if self.recording is not None:
            due_us = min(due_us, self.recording.due_us)
        self.due_us = due_us

    def close(self) -> None:
        """Stores what is under way."""
        self.trigger.stop_series()
        self.trigger.stop_distance()
        for _, __, frame in self._pending:
            frame.exception()  # waits
        self._develop()
        if self.recording is not None:
            self.stop_video()

    # Photos

    def view(self, size: tuple[int, int], *, is_smooth: bool) -> View:
        """How the lens looks now."""
        self.lens.update(self._state.time_us)
        settings = self.settings
        q_frd_from_rdf = self.gimbal.q_frd_from_rdf()
        return View(*size, self.lens.hfov_deg, q_frd_from_rdf, settings.exposure, settings.balance, is_smooth)

    def _refusal(self) -> Reply | None:
        """Why no photo can be taken now."""
        if self.media is None:
            return Reply(Verdict.FAILED, "no storage")
        if self.media.free_bytes <= 0:
            return Reply(Verdict.FAILED, "the storage is full")
        return None

    def _start_photos(self, params: Params) -> Reply:
        interval_s, count = params[1], params[2]
        if not isfinite(count) or count < 0 or count != int(count):
            return Reply(Verdict.DENIED, "the number of photos must be 0 or more")
        if count == 1:
            return self.take_photo()
        if not isfinite(interval_s) or interval_s * 1e6 < SHUTTER_US:
            return Reply(Verdict.DENIED, f"the interval must be at least {SHUTTER_US * 1e-6:g} s")
        if interval_s > INTERVAL_MAX_S:
            return Reply(Verdict.DENIED, "the interval must be a day at most")
        return self.start_photos(interval_s, int(count))

    def take_photo(self) -> Reply:
        """One photo now."""
        refusal = self._refusal()
        if refusal is not None:
            return refusal
        if self.is_taking_photo or self.trigger.is_series:
            return Reply(Verdict.TEMPORARILY_REJECTED, "busy taking photos")
        self._shoot()
        self._plan()
        return ACCEPTED

    def start_photos(self, interval_s: float, count: int) -> Reply:
        """A series, the first photo now; 0: until it is stopped."""
        refusal = self._refusal()
        if refusal is not None:
            return refusal
        if self.is_taking_photo or self.trigger.is_series:
            return Reply(Verdict.TEMPORARILY_REJECTED, "busy taking photos")
        self.trigger.start_series(self._state.time_us, round(interval_s * 1e6), count)
        self._plan()
        return ACCEPTED

    def stop_photos(self) -> Reply:
        """Ends every series."""
        self.trigger.stop_series()
        self.trigger.stop_distance()
        self._plan()
        return ACCEPTED

    def _shoot(self) -> None:
        """Opens the shutter; the photo is stored when the host delivers it."""
        state = self._state
        self._busy_until_us = state.time_us + SHUTTER_US
        view = self.view(self.settings.photo_size, is_smooth=self.settings.is_smooth)
        index = self.shot_count
        self.shot_count += 1
        above_home_m = state.home_ned[2] - state.estimate.pos_ned[2]
        name = f"IMG_{index + 1:05d}.jpg"
        q = self.gimbal.q_ned_from_frd()
        shot = Shot(index, state.time_us, state.position, above_home_m, q, name, is_stored=False)
        self._pending.append((shot, view, self._source.capture(view)))
        self._develop()

    def _develop(self) -> None:
        """Stores the photos that have been delivered, in their order."""
        while self._pending and self._pending[0][2].done():
            shot, view, frame = self._pending.popleft()
            is_stored = self._store(shot.name, view, frame.result())
            shot = Shot(
                shot.index, shot.time_us, shot.place, shot.above_home_m, shot.q_ned_from_frd, shot.name, is_stored
            )
            self.shots.append(shot)
            for listener in self._listeners:
                listener(shot)

    def _store(self, name: str, view: View, frame: RawFrame) -> bool:
        if self.media is None:
            return False
        height, width = frame.depth_m.shape
        focus_m = self.lens.focus_m
        if self.lens.is_auto_focus:
            middle = frame.depth_m[height // 3 : height - height // 3, width // 3 : width - width // 3]
            focus_m = max(float(np.median(middle)), FOCUS_NEAR_M)
        rgb = defocused(frame, view.hfov_deg, self.lens.zoom, focus_m)
        return self.media.store(name, jpeg_bytes(rgb, self.settings.jpeg_quality))

    def shot(self, index: int) -> Shot | None:
        """An earlier photo; None if there is none, or it is too long ago."""
        if not self.shots:
            return None
        offset = index - self.shots[0].index
        return self.shots[offset] if 0 <= offset < len(self.shots) else None

    # Triggers

    def _trigger_distance(self, params: Params, _: float) -> Reply:
        distance_m, is_now = params[0], params[2] == 1.0
        if not isfinite(distance_m) or distance_m < 0.0:
            return Reply(Verdict.DENIED, "the trigger distance must be 0 or more")
        if distance_m == 0.0:
            self.trigger.stop_distance()
            self._plan()
            return self.take_photo() if is_now else ACCEPTED
        refusal = self._refusal()
        if refusal is not None:
            return refusal
        self.trigger.start_distance(distance_m, self._state.estimate.pos_ned, is_now=is_now)
        self._plan()
        return ACCEPTED

    def _trigger_interval(self, params: Params, _: float) -> Reply:
        interval_s = 1e-3 * params[0]
        if not isfinite(interval_s):
            return Reply(Verdict.DENIED, "the trigger interval is not a number")
        if interval_s <= 0.0:
            return self.stop_photos()
        if interval_s * 1e6 < SHUTTER_US:
            return Reply(Verdict.DENIED, f"the interval must be at least {SHUTTER_US * 1e-6:g} s")
        if interval_s > INTERVAL_MAX_S:
            return Reply(Verdict.DENIED, "the interval must be a day at most")
        self.trigger.stop_series()
        refusal = self._refusal()
        if refusal is not None:
            return refusal
        self.trigger.start_series(self._state.time_us, round(interval_s * 1e6), 0)
        self._plan()
        return ACCEPTED

    def _trigger_control(self, params: Params, _: float) -> Reply:
        if params[1] == 1.0:
            self.shot_count = 0
            self.shots.clear()
        if params[0] == 0.0 or params[2] == 1.0:
            return self.stop_photos()
        if params[0] == 1.0 and not self.trigger.is_active:
            return Reply(Verdict.DENIED, "say how: by a trigger distance or interval")
        return ACCEPTED

    def _digicam(self, params: Params, shoot: float) -> Reply:
        if isfinite(params[2]) and params[2] != 0.0:
            self.lens.update(self._state.time_us)
            self.lens.set_zoom(0, params[2])
        return self.take_photo() if shoot == 1.0 else ACCEPTED

    # Video, mode, lens

    def start_video(self) -> Reply:
        """Starts a recording."""
        refusal = self._refusal()
        if refusal is not None or self.media is None:
            return refusal or ACCEPTED
        if self.recording is not None:
            return Reply(Verdict.TEMPORARILY_REJECTED, "already recording")
        if self.media.free_bytes < VIDEO_BYTES_MIN:
            return Reply(Verdict.FAILED, "the storage is full")
        self._video_count += 1
        name = f"VID_{self._video_count:05d}.mp4"
        recording = Recording(self.media, name, self.settings.video_size, self._state.time_us)
        if not recording.is_open:
            return Reply(Verdict.FAILED, "the video file cannot be written")
        self.recording = recording
        self._plan()
        return ACCEPTED

    def stop_video(self) -> Reply:
        """Completes the recording, if there is one: the command may be a repeat."""
        if self.recording is None:
            return ACCEPTED
        is_stored = self.recording.close()
        self.recording = None
        self._plan()
        return ACCEPTED if is_stored else Reply(Verdict.FAILED, "the video cannot be stored")

    @property
    def recording_ms(self) -> int:
        return 0 if self.recording is None else (self._state.time_us - self.recording.start_us) // 1000

    @property
    def mode(self) -> CameraMode:
        return CameraMode(int(self.settings[MODE]))

    def set_mode(self, mode: float) -> Reply:
        """Image, video or survey; both kinds of picture can be taken in each."""
        if mode not in (0.0, 1.0, 2.0):
            return Reply(Verdict.DENIED, f"there is no camera mode {mode:g}")
        self.settings.set(MODE, mode)
        return ACCEPTED

    def _turn(self, motor: Callable[[int, float], Reply], params: Params) -> Reply:
        self.lens.update(self._state.time_us)
        if not isfinite(params[0]) or params[0] != int(params[0]):
            return Reply(Verdict.DENIED, "the type is not a number")
        return motor(int(params[0]), params[1])

    def reset(self) -> Reply:
        """Everything that can be set, as it came."""
        if self.recording is not None or self.trigger.is_active:
            return Reply(Verdict.TEMPORARILY_REJECTED, "busy taking pictures")
        self.settings.reset()
        self.lens.reset()
        return ACCEPTED

    def format_storage(self) -> Reply:
        """Removes all pictures."""
        if self.media is None:
            return Reply(Verdict.FAILED, "no storage")
        if self.recording is not None or self.trigger.is_active or self.is_taking_photo:
            return Reply(Verdict.TEMPORARILY_REJECTED, "busy taking pictures")
        self.media.format()
        self.shots.clear()
        self.shot_count = 0
        return ACCEPTED
