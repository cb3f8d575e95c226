"""One vehicle in the scene of a page: its body, what turns on it, its trail.

In: moments. Out: nodes of viser's scene; only what moves is sent again.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
import trimesh
import viser
from numpy.typing import NDArray

from common.airframe import Airframe
from common.attitude import quat_of
from mission.view import shapes
from mission.view.flight_snapshot import Moment

TRAIL_M = 0.05  # how thick it is
TRAIL_POINTS = 600
TRAIL_PERIOD_S = 0.25
BLADE_TURNS_PER_S = 2.7  # shown; at their true speed blades would stand still or seem to turn backwards
JUMP_S = 1.0  # wheels do not catch up with more


class VehicleNodes:
    """The nodes of one vehicle.

    Args:
        api: of the scene.
        name: of its nodes.
        airframe: of the vehicle.
        rgb: of its trail.
    """

    def __init__(self, api: viser.SceneApi, name: str, airframe: Airframe, rgb: tuple[int, int, int]) -> None:
        shape = shapes.vehicle(airframe)
        blade = shape.blade
        self._frame = api.add_frame(f"/{name}", axes_length=0.4, axes_radius=0.008)
        add_mesh(api, f"/{name}/frame", shape.body)
        self._blades = [
            api.add_mesh_simple(
                f"/{name}/blade{i}", blade.vertices, blade.faces, color=shapes.BLADE, position=hub - (0, 0, 0.03)
            )
            for i, hub in enumerate(shape.hubs)
        ]
        self._spins = shape.spins
        self._wheels: list[viser.FrameHandle] = []
        for i, (mesh, hub) in enumerate(zip(shape.wheels, shape.wheel_hubs, strict=True)):
            add_mesh(api, f"/{name}/wheel{i}/mesh", mesh)
            self._wheels.append(api.add_frame(f"/{name}/wheel{i}", show_axes=False, position=hub))
        self._is_steered = shape.is_steered
        self._turned_rad = np.zeros(len(self._wheels))
        self._shown_s: float | None = None
        self.trail = Trail(api, f"/trails/{name}", rgb)

    @property
    def drives(self) -> bool:
        """Whether it has wheels."""
        return len(self._wheels) > 0

    def show(self, moment: Moment) -> None:
        """Moves it to where it is."""
        self._frame.position = moment.pos_ned
        self._frame.wxyz = wxyz_of(moment.q_ned_from_frd)
        speeds = moment.row["motor_speed"][: len(self._blades)]
        for handle, spin, speed in zip(self._blades, self._spins, speeds, strict=True):
            if speed > 1.0:
                handle.wxyz = wxyz_of(quat_of(2.0 * np.pi * BLADE_TURNS_PER_S * spin * moment.time_s, 0.0))
        self._turn_wheels(moment)
        self.trail.lead_to(moment.pos_ned)

    def _turn_wheels(self, moment: Moment) -> None:
        """By what they have turned since the moment shown before; not after a jump in time."""
        passed_s = 0.0 if self._shown_s is None else moment.time_s - self._shown_s
        self._shown_s = moment.time_s
        if abs(passed_s) < JUMP_S:
            self._turned_rad += passed_s * moment.row["motor_speed"][: len(self._wheels)]
        for wheel, turned_rad, is_steered in zip(self._wheels, self._turned_rad, self._is_steered, strict=True):
            steering_rad = float(moment.row["steering_rad"]) if is_steered else 0.0
            wheel.wxyz = wxyz_of(shapes.wheel_attitude(float(turned_rad), steering_rad))


class Trail:
    """Where something has been, as a line that forgets its beginning."""

    def __init__(self, api: viser.SceneApi, name: str, rgb: tuple[int, int, int]) -> None:
        self._api, self._name, self._rgb = api, name, rgb
        self._points: list[NDArray[np.float32]] = []
        self._lines: dict[str, Any] = {}
        self._next_s = 0.0

    def extend(self, time_s: float, point_ned: NDArray[np.float32]) -> None:
        """Appends a place when it is time for one."""
        if time_s >= self._next_s:
            self._next_s = time_s + TRAIL_PERIOD_S
            self.draw([*self._points[-TRAIL_POINTS:], point_ned])

    def draw(self, points_ned: Iterable[NDArray[np.float32]]) -> None:
        """Draws the line through these places; a single one draws none."""
        self._points = [np.array(point, np.float32) for point in points_ned]
        if len(self._points) > 1:
            self._draw_line(self._name, np.array(self._points))

    def lead_to(self, point_ned: NDArray[np.float32]) -> None:
        """From its newest place to where something is now: a trail does not lag."""
        if self._points:
            self._draw_line(f"{self._name}/head", np.array([self._points[-1], point_ned], np.float32))

    def forget(self) -> None:
        """Begins anew from the next place on."""
        self._points = []

    def _draw_line(self, name: str, points_ned: NDArray[np.float32]) -> None:
        if np.isnan(points_ned).any():
            return
        if name in self._lines:
            self._lines[name].points = segments(points_ned)
        else:
            self._lines[name] = self._api.add_line_segments(name, segments(points_ned), self._rgb, thickness=TRAIL_M)


def add_mesh(api: viser.SceneApi, name: str, mesh: shapes.Mesh) -> None:
    """A mesh with its colours as a node."""
    linear = (255.0 * (mesh.colours / 255.0) ** 2.2).astype(np.uint8)  # glTF's vertex colours are linear light
    api.add_mesh_trimesh(name, trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_colors=linear, process=False))


def segments(points: NDArray[np.floating]) -> NDArray[np.float32]:
    """The line through points, as pairs of them."""
    return np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)


def wxyz_of(q_xyzw: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """Warp's order as viser's."""
    x, y, z, w = q_xyzw
    return w, x, y, z
