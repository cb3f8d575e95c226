"""The light in front of a vehicle's camera: where it truly is, rendered (autopilot.payload.camera.ports.FrameSource).

In: views, which say where the lens points relative to the body. Out: frames of the true pose at that moment. In
lockstep a frame is there at once; with a thread of its own the flight goes on while it is being rendered.
"""

from concurrent.futures import Future, ThreadPoolExecutor
from functools import cached_property

from autopilot.payload.camera import image_file
from autopilot.payload.camera.ports import RawFrame, View
from common.attitude import product, rotated
from sim.rig import Rig
from sim.sensors.camera import CameraPose, Renderer
from sim.world.world import WorldMap

MOUNT_FRD = (0.10, 0.0, 0.06)  # [m] of the lens from the centre of gravity: under the nose; guess


class CameraRig:
    """The camera of one vehicle of a rig.

    Args:
        rig: where the truth is.
        world: what is seen.
        has_thread: frames are rendered while the flight goes on.
        i_vehicle: which vehicle carries it.
    """

    def __init__(self, rig: Rig, world: WorldMap, *, has_thread: bool = False, i_vehicle: int = 0) -> None:
        self._truth = rig.rows["truth"]  # the live rows
        self._world = world
        self._i_vehicle = i_vehicle
        self._pool = ThreadPoolExecutor(1, "camera") if has_thread else None

    @cached_property
    def renderer(self) -> Renderer:
        """Made when the first image is taken."""
        return Renderer(self._world)

    def prepare(self) -> None:
        """Compiles or loads the kernel on the camera's thread, so that the first photo need not wait for it."""
        if self._pool is not None:
            self._pool.submit(self._warm_up)

    def _warm_up(self) -> None:
        image_file.prepare()
        self.renderer.prepare()

    def pose(self, view: View) -> CameraPose:
        """Where the lens truly is now."""
        row = self._truth[self._i_vehicle]
        x, y, z, w = (float(value) for value in row["q_ned_from_frd"])
        q = (x, y, z, w)
        north, east, down = (float(a) + b for a, b in zip(row["pos_ned"], rotated(q, MOUNT_FRD), strict=True))
        q_ned_from_rdf = product(q, view.q_frd_from_rdf)
        return CameraPose((north, east, down), q_ned_from_rdf, view.hfov_deg, view.exposure, view.balance)

    def capture(self, view: View) -> "Future[RawFrame]":
        """The frame as of now."""
        pose = self.pose(view)
        if self._pool is not None:
            return self._pool.submit(self._render, pose, view)
        done: Future[RawFrame] = Future()
        done.set_result(self._render(pose, view))
        return done

    def _render(self, pose: CameraPose, view: View) -> RawFrame:
        images = self.renderer.images([pose], view.width, view.height, samples=2 if view.is_smooth else 1)
        return RawFrame(images.rgb[0], images.depth_m[0])

    def close(self) -> None:
        """Ends the thread; frames that it has not begun are lost."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
