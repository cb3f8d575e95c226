"""Images for live video by the fast camera: a FrameSource that renders 640 x 360 at a tenth of the exact one's price.

In: views of the vehicle's camera. Out: frames of its true pose at that moment, made on a thread of their own. Who
walks through the world is seen in them.
"""

from concurrent.futures import Future, ThreadPoolExecutor
from math import radians, tan
from typing import TYPE_CHECKING, Any

from autopilot.payload.camera.ports import RawFrame, View
from sim.camera_rig import CameraRig
from sim.rig import Rig
from sim.sensors.camera import CameraPose
from sim.world.world import WorldMap

if TYPE_CHECKING:
    from sim.sensors.fast_camera.fast_camera import QuickCamera

RANGE_M = 150.0  # fog hides what is farther


class VideoRig:
    """The camera of vehicle 0 of a rig.

    Args:
        rig: where the truth is.
        world: what is seen.
        people: who is seen: an array of `Person`, shape (1, people); None: nobody.
        clothes: likewise.
    """

    def __init__(self, rig: Rig, world: WorldMap, people: Any = None, clothes: Any = None) -> None:
        self._mount = CameraRig(rig, world)
        self._world, self._seen = world, {"people": people, "clothes": clothes}
        self._camera: QuickCamera | None = None  # made for the first image, on its thread
        self._pool = ThreadPoolExecutor(1, "video_rig")

    def capture(self, view: View) -> "Future[RawFrame]":
        """The frame as of now; every view must be of the same size."""
        return self._pool.submit(self._render, self._mount.pose(view), view)

    def _render(self, pose: CameraPose, view: View) -> RawFrame:
        camera = self._camera
        if camera is None:
            from sim.sensors.fast_camera.fast_camera import QuickCamera  # no flight waits for it that nobody watches

            camera = self._camera = QuickCamera(
                self._world, 1, width=view.width, height=view.height, **self._seen, range_m=RANGE_M
            )
        lens: Any = camera.lenses.numpy()[0]
        lens["pos_ned"], lens["q_ned_from_rdf"] = pose.pos_ned, pose.q_ned_from_rdf
        lens["half_width"] = tan(0.5 * radians(pose.hfov_deg))
        lens["exposure"], lens["balance"] = pose.exposure, pose.balance
        camera.render()
        return RawFrame(camera.rgb.numpy()[0].copy(), camera.depth_m.numpy()[0].copy())

    def close(self) -> None:
        """Ends the thread; frames that it has not begun are lost."""
        self._pool.shutdown(cancel_futures=True)
