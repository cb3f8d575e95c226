"""What renders a flight's images: photos, the live picture, the video for ground stations."""

from collections.abc import Callable
from typing import Any

from autopilot.payload.camera.camera import Camera
from mission.video.mjpeg_server import StreamServer
from mission.video.rtp_video import RtpVideo
from sim.camera_rig import CameraRig
from sim.rig import Rig
from sim.video_rig import VideoRig
from sim.world.world import WorldMap


class FlightCameras:
    """The light in front of one vehicle's camera, for all who look through it.

    Args:
        rig: where the vehicle is.
        world: what is seen.
        stream: serves the live picture.
        video: sends it to ground stations.
        has_thread: photos are rendered while the flight goes on.
    """

    def __init__(
        self, rig: Rig, world: WorldMap, stream: StreamServer | None, video: RtpVideo | None, *, has_thread: bool
    ) -> None:
        self._rig, self._world, self._stream, self._video = rig, world, stream, video
        self.photos = CameraRig(rig, world, has_thread=has_thread)
        self.photos.prepare()
        self._rigs: list[CameraRig | VideoRig] = [self.photos]

    def start(self, camera: Camera | None, cast: Any, on_trouble: Callable[[str], None]) -> None:
        """Gives live picture and video something to show.

        Args:
            camera: the vehicle's.
            cast: who is seen, with `drawn` people and their `clothes`; None: nobody.
            on_trouble: is told why there is no video.
        """
        if self._stream is not None:
            stream_rig = CameraRig(self._rig, self._world, has_thread=True)
            self._rigs.append(stream_rig)
            if camera is not None:
                self._stream.start(camera, stream_rig)
        if self._video is not None:
            seen = (None, None) if cast is None else (cast.drawn, cast.clothes)
            video_rig = VideoRig(self._rig, self._world, *seen)
            self._rigs.append(video_rig)
            if camera is not None:
                self._video.start(camera, video_rig)
            self._video.on_trouble = on_trouble

    def frame(self) -> None:
        """Lets live picture and video take what is due."""
        if self._stream is not None:
            self._stream.frame()
        if self._video is not None:
            self._video.frame()

    def close(self, camera: Camera | None) -> None:
        """Ends the outputs, then the vehicle's camera, then what renders for them."""
        for output in (self._stream, self._video):
            if output is not None:
                output.close()
        if camera is not None:
            camera.close()
        for rig in self._rigs:
            rig.close()
