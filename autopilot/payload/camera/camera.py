"""The camera: takes photos when asked or triggered, records video, and keeps both on its card.

In: what `CameraCommands` asks of it, frames of the host's `FrameSource`. Out: files, and a `Shot` for each photo to
whoever listens. It works when something is due, on simulated time; the controller calls `frame` then.
"""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from enum import IntEnum

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
from common.attitude import Quat
from common.geodesy import GeoPoint

CAMERA_ID = 100  # MAV_COMP_ID_CAMERA
SHUTTER_US = 200_000  # from one photo to the next at the earliest; guess
PENDING_MAX = 2  # photos that wait for the host
SHOTS_KEPT = 10_000
VIDEO_BYTES_MIN = 1 << 20  # room a recording needs to begin

ListensToShots = Callable[["Shot"], None]


class CameraMode(IntEnum):
    """Numbered as CAMERA_MODE."""

    IMAGE = 0
    VIDEO = 1
    IMAGE_SURVEY = 2


@dataclass(frozen=True, slots=True)
class Shot:
    """One photo: where, when and which way."""

    index: int
    time_us: int
    position: GeoPoint
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

    def on_shot(self, listener: ListensToShots) -> None:
        """`listener` hears of each photo when it is stored."""
        self._listeners.append(listener)

    def on_full(self, listener: Callable[[], None]) -> None:
        """`listener` hears when a recording was stopped because the storage is full."""
        self._full_listeners.append(listener)

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
                shot.index, shot.time_us, shot.position, shot.above_home_m, shot.q_ned_from_frd, shot.name, is_stored
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

    def trigger_by_distance(self, distance_m: float, *, is_now: bool) -> Reply:
        """A photo every so many metres of way, the first one here if `is_now`."""
        refusal = self._refusal()
        if refusal is not None:
            return refusal
        self.trigger.start_distance(distance_m, self._state.estimate.pos_ned, is_now=is_now)
        self._plan()
        return ACCEPTED

    def stop_distance(self) -> None:
        """No photos by distance any more; a series goes on."""
        self.trigger.stop_distance()
        self._plan()

    def trigger_by_interval(self, interval_s: float) -> Reply:
        """A photo every so many seconds from now on, in the place of any series."""
        self.trigger.stop_series()
        refusal = self._refusal()
        if refusal is not None:
            return refusal
        self.trigger.start_series(self._state.time_us, round(interval_s * 1e6), 0)
        self._plan()
        return ACCEPTED

    def count_anew(self) -> None:
        """The next photo is the first."""
        self.shot_count = 0
        self.shots.clear()

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
        """Image, video or survey; both kinds of image can be taken in each."""
        if mode not in (0.0, 1.0, 2.0):
            return Reply(Verdict.DENIED, f"there is no camera mode {mode:g}")
        self.settings.set(MODE, mode)
        return ACCEPTED

    def turn(self, motor: Callable[[int, float], Reply], kind: int, value: float) -> Reply:
        """Has a motor of the lens zoom or focus from where the lens is now."""
        self.lens.update(self._state.time_us)
        return motor(kind, value)

    def reset(self) -> Reply:
        """Everything that can be set, as it came."""
        if self.recording is not None or self.trigger.is_active:
            return Reply(Verdict.TEMPORARILY_REJECTED, "busy taking pictures")
        self.settings.reset()
        self.lens.reset()
        return ACCEPTED

    def format_storage(self) -> Reply:
        """Removes all images."""
        if self.media is None:
            return Reply(Verdict.FAILED, "no storage")
        if self.recording is not None or self.trigger.is_active or self.is_taking_photo:
            return Reply(Verdict.TEMPORARILY_REJECTED, "busy taking pictures")
        self.media.format()
        self.count_anew()
        return ACCEPTED
