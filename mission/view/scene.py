"""The 3-D scene in the browser: world, vehicle, owner and trails, in ned.

In: a world once, then moments. Out: nodes of viser's scene; only what moves is sent again. What stands still costs
nothing after a browser has loaded it.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import atan, radians, tan
from typing import Any

import numpy as np
import trimesh
import viser
from numpy.typing import NDArray

from common.airframe import Airframe
from common.attitude import quat_of, yaw_of
from mission.view import shapes
from mission.view.flight_snapshot import Moment
from mission.view.pose_goals import Pose
from sim.world.world import WorldMap

VEHICLE_RGB, OWNER_RGB, GOAL_RGB, PLAN_RGB = (40, 110, 220), (232, 120, 32), (220, 40, 90), (250, 250, 250)
STATURE_M = 1.75
ARRIVED_M = 1.0  # a goal nearer than this is not shown: it would hide the vehicle
PLAN_M, TRAIL_M = 0.25, 0.05  # how thick they are: a plan is seen on both sides of the trail that covers it
TRAIL_LIFT_M = 0.1  # of what walks on the ground, which would hide its trail
TRAIL_POINTS = 600
TRAIL_PERIOD_S = 0.25
BLADE_TURNS_PER_S = 2.7  # shown; at their true speed blades would stand still or seem to turn backwards
RAY_RGB, RAY_M = (240, 200, 60), 0.02
MARK_M = 0.6  # above the ground
ARROW = np.array(
    [[(-0.35, 0.0, 0.0), (0.35, 0.0, 0.0)], [(0.35, 0.0, 0.0), (0.1, -0.2, 0.0)], [(0.35, 0.0, 0.0), (0.1, 0.2, 0.0)]],
    np.float32,
)
JUMP_S = 1.0  # wheels do not catch up with more
SKY_RGB = (190, 212, 232)


@dataclass(frozen=True, slots=True)
class Mount:
    """How a camera is carried, for its frustum."""

    pos_frd: tuple[float, float, float]
    q_frd_from_rdf: tuple[float, float, float, float]
    hfov_deg: float
    width: int  # [pixels]
    height: int


class Scene:
    """One flight's scene.

    Args:
        server: of the page.
        world: what stands still.
        airframe: of the vehicle.
        mount: of its camera; None: it has none.
        path_ned: [m] (n, 3) way that it is to fly; empty without a plan.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        world: WorldMap,
        airframe: Airframe,
        *,
        mount: Mount | None = None,
        path_ned: Sequence[Sequence[float]] = (),
    ) -> None:
        self._api = server.scene
        self._api.set_up_direction("-z")
        self._api.configure_default_lights(cast_shadow=False)  # shadows would cost a weak machine half its frames
        self._api.configure_fog(0.4 * world.config.size_m, 1.4 * world.config.size_m, color=SKY_RGB)
        self._api.set_background_image(np.full((2, 2, 3), SKY_RGB, np.uint8))
        self._world = world
        self._movers: list[tuple[int, viser.FrameHandle]] = []
        self._add_world(world)
        self._shown_s: float | None = None
        self._pose: viser.FrameHandle | None = None  # that the vehicle shall stand in
        self._rays: Any = None  # lines, once there have been some
        self._wheels: list[viser.FrameHandle] = []
        self._vehicle = self._api.add_frame("/vehicle", axes_length=0.4, axes_radius=0.008)
        shape = shapes.vehicle(airframe)
        blade = shape.blade
        self._add_mesh("/vehicle/frame", shape.body)
        self._blades = [
            self._api.add_mesh_simple(
                f"/vehicle/blade{i}", blade.vertices, blade.faces, color=shapes.BLADE, position=hub - (0, 0, 0.03)
            )
            for i, hub in enumerate(shape.hubs)
        ]
        self._spins = shape.spins
        for i, (mesh, hub) in enumerate(zip(shape.wheels, shape.wheel_hubs, strict=True)):
            self._add_mesh(f"/vehicle/wheel{i}/mesh", mesh)
            self._wheels.append(self._api.add_frame(f"/vehicle/wheel{i}", show_axes=False, position=hub))
        self._is_steered = shape.is_steered
        self._turned_rad = np.zeros(len(self._wheels))
        self._owner = self._api.add_frame("/owner", show_axes=False, visible=False)
        self._add_mesh("/owner/body", shapes.person(STATURE_M))
        self._goal = self._api.add_icosphere("/goal", radius=0.35, color=GOAL_RGB, opacity=0.7, visible=False)
        self.frustum = None if mount is None else self._frustum(mount)
        self._trails = {
            "vehicle": Trail(self._api, "/trails/vehicle", VEHICLE_RGB),
            "owner": Trail(self._api, "/trails/owner", OWNER_RGB),
        }
        if len(path_ned) > 1:
            plan = np.array(path_ned, np.float32)
            self._api.add_line_segments("/plan", _segments(plan), PLAN_RGB, thickness=PLAN_M)

    def _add_mesh(self, name: str, mesh: shapes.Mesh) -> None:
        linear = (255.0 * (mesh.colours / 255.0) ** 2.2).astype(np.uint8)  # glTF's vertex colours are linear light
        self._api.add_mesh_trimesh(
            name, trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_colors=linear, process=False)
        )

    def _add_world(self, world: WorldMap) -> None:
        self._add_mesh("/world/ground", shapes.ground(world))
        ring = shapes.walls(world)
        if ring is not None:
            self._add_mesh("/world/walls", ring)
        boxes = shapes.boxes(world, movers=False)
        if boxes is not None:
            self._add_mesh("/world/boxes", boxes)
        for i, mesh in shapes.moving_boxes(world):
            self._movers.append((i, self._api.add_frame(f"/world/mover{i}", show_axes=False)))
            self._add_mesh(f"/world/mover{i}/box", mesh)
        forest = shapes.trees(world)
        count = len(forest.trunk_ned)
        if count == 0:
            return
        upright = np.tile((1.0, 0.0, 0.0, 0.0), (count, 1))
        for name, mesh, where, size, colours in (
            ("trunks", shapes.trunk(), forest.trunk_ned, forest.trunk_size, shapes.BARK),
            ("crowns", shapes.ball(), forest.crown_ned, forest.crown_size, forest.crown_colours),
        ):
            self._api.add_batched_meshes_simple(
                f"/world/{name}",
                mesh.vertices,
                mesh.faces,
                upright,
                where,
                batched_scales=size,
                batched_colors=colours,
                lod="off",
                cast_shadow=False,
            )

    def _frustum(self, mount: Mount) -> viser.CameraFrustumHandle:
        aspect = mount.width / mount.height
        return self._api.add_camera_frustum(
            "/vehicle/camera",
            2.0 * atan(tan(0.5 * radians(mount.hfov_deg)) / aspect),
            aspect,
            scale=0.15,
            thickness=0.006,
            position=mount.pos_frd,
            wxyz=wxyz_of(mount.q_frd_from_rdf),
        )

    @property
    def drives(self) -> bool:
        """Whether the vehicle has wheels."""
        return len(self._wheels) > 0

    def show(self, moment: Moment) -> None:
        """Moves what moves."""
        self._vehicle.position = moment.pos_ned
        self._vehicle.wxyz = wxyz_of(moment.q_ned_from_frd)
        speeds = moment.row["motor_speed"][: len(self._blades)]
        for handle, spin, speed in zip(self._blades, self._spins, speeds, strict=True):
            if speed > 1.0:
                handle.wxyz = wxyz_of(quat_of(2.0 * np.pi * BLADE_TURNS_PER_S * spin * moment.time_s, 0.0))
        self._turn_wheels(moment)
        if self._movers:
            places = self._world.boxes.middle(moment.tick)
            for i, mover in self._movers:
                mover.position = (places[i][0], places[i][1], 0.0)
        if moment.has_owner:
            self._owner.position = moment.owner_ned
            self._owner.wxyz = wxyz_of(quat_of(float(moment.row["owner"]["heading_rad"]), 0.0))
            self._trails["owner"].lead_to(_lifted(moment.owner_ned))
        self._trails["vehicle"].lead_to(moment.pos_ned)
        self._owner.visible = moment.has_owner
        has_goal = bool(np.linalg.norm(moment.goal_ned - moment.pos_ned) > ARRIVED_M)  # False for NaN
        if has_goal:
            self._goal.position = moment.goal_ned
        self._goal.visible = has_goal

    def draw_rays(self, moment: Moment, ranges_m: Sequence[float]) -> None:
        """What a ring of range finders sees, clockwise from the nose; rays that meet nothing are left out."""
        ranges = np.array(ranges_m, np.float32)
        bearing = yaw_of(moment.q_ned_from_frd) + 2.0 * np.pi * np.arange(len(ranges)) / max(len(ranges), 1)
        meets = np.isfinite(ranges)
        level = np.stack([np.cos(bearing), np.sin(bearing), np.zeros(len(ranges))], axis=1)
        ends = moment.pos_ned + (ranges[meets, None] * level[meets]).astype(np.float32)
        starts = np.broadcast_to(moment.pos_ned, ends.shape)
        lines = np.stack([starts, ends], axis=1).astype(np.float32)
        if self._rays is not None:
            self._rays.visible = len(lines) > 0
        if len(lines) and self._rays is None:
            self._rays = self._api.add_line_segments("/rays", lines, RAY_RGB, thickness=RAY_M)
        elif len(lines):
            self._rays.points = lines

    def mark(self, name: str, pose: Pose) -> None:
        """Writes a name over a place on the ground."""
        self._api.add_label(f"/places/{name}", name, position=self._over_ground(pose, MARK_M))

    def show_pose(self, pose: Pose | None) -> None:
        """An arrow on the ground where the vehicle shall stand, the way its nose shall show."""
        if pose is not None and self._pose is None:
            self._pose = self._api.add_frame("/pose", show_axes=False)
            self._api.add_line_segments("/pose/arrow", ARROW, GOAL_RGB, thickness=TRAIL_M)
        if self._pose is not None:
            self._pose.visible = pose is not None
            if pose is not None:
                self._pose.position = self._over_ground(pose, TRAIL_LIFT_M)
                self._pose.wxyz = wxyz_of(quat_of(pose[2], 0.0))

    def _over_ground(self, pose: Pose, above_m: float) -> tuple[float, float, float]:
        return pose[0], pose[1], -float(self._world.height(pose[0], pose[1])) - above_m

    def _turn_wheels(self, moment: Moment) -> None:
        """By what they have turned since the moment shown before; not after a jump in time."""
        passed_s = 0.0 if self._shown_s is None else moment.time_s - self._shown_s
        self._shown_s = moment.time_s
        if abs(passed_s) < JUMP_S:
            self._turned_rad += passed_s * moment.row["motor_speed"][: len(self._wheels)]
        for wheel, turned_rad, is_steered in zip(self._wheels, self._turned_rad, self._is_steered, strict=True):
            steering_rad = float(moment.row["steering_rad"]) if is_steered else 0.0
            wheel.wxyz = wxyz_of(shapes.wheel_attitude(float(turned_rad), steering_rad))

    def extend_trails(self, moment: Moment) -> None:
        """Appends where everybody is; `show` leads on from there."""
        self._trails["vehicle"].extend(moment.time_s, moment.pos_ned)
        if moment.has_owner:
            self._trails["owner"].extend(moment.time_s, _lifted(moment.owner_ned))

    def forget_trails(self) -> None:
        """Somebody has been put elsewhere."""
        for trail in self._trails.values():
            trail.forget()

    def draw_trails(self, rows: NDArray[Any]) -> None:
        """Draws them anew from rows of a recording that may have jumped."""
        self._trails["vehicle"].draw(rows["pos_ned"])
        if len(rows) and Moment(rows[0]).has_owner:
            self._trails["owner"].draw(_lifted(rows["owner"]["pos_ned"]))


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
            self._lines[name].points = _segments(points_ned)
        else:
            self._lines[name] = self._api.add_line_segments(name, _segments(points_ned), self._rgb, thickness=TRAIL_M)


def _lifted(points_ned: NDArray[np.float32]) -> NDArray[np.float32]:
    return points_ned - np.array([0.0, 0.0, TRAIL_LIFT_M], np.float32)


def _segments(points: NDArray[np.floating]) -> NDArray[np.float32]:
    return np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)


def wxyz_of(q_xyzw: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """Warp's order as viser's."""
    x, y, z, w = q_xyzw
    return w, x, y, z


def chase_of(moment: Moment, *, drives: bool = False) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """A place behind and above the vehicle, nearer to what drives, and where to look from there [m], ned."""
    yaw = yaw_of(moment.q_ned_from_frd)
    ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0], np.float32)
    behind_m, above_m = (2.6, 1.1) if drives else (5.0, 2.2)
    place_ned = moment.pos_ned - behind_m * ahead - np.array([0.0, 0.0, above_m], np.float32)
    return place_ned, moment.pos_ned + 2.0 * ahead


def overview_of(
    moment: Moment, places: Sequence[tuple[float, float]]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """A place above and behind the vehicle, seen from places that matter, and where to look from there [m], ned."""
    away = np.mean(np.array(places), axis=0) - moment.pos_ned[:2]
    ahead = np.array([*away, 0.0]) / max(float(np.linalg.norm(away)), 1.0)
    place_ned = moment.pos_ned - 3.5 * ahead - np.array([0.0, 0.0, 4.5])
    return place_ned.astype(np.float32), moment.pos_ned
