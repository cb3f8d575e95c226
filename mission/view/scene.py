"""The 3-D scene in the browser: world, vehicle, owner and trails, in ned.

In: a world once, then moments. Out: nodes of viser's scene; only what moves is sent again. What stands still costs
nothing after a browser has loaded it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan, radians, tan
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from common.airframe import Airframe
from common.attitude import quat_of, yaw_of
from mission.view import shapes
from mission.view.flight_snapshot import Moment
from mission.view.pose_goals import Pose
from mission.view.vehicle_nodes import TRAIL_M, Trail, VehicleNodes, add_mesh, segments, wxyz_of
from mission.world.world_shapes import part_mesh
from sim.world.people import STATURE_M
from sim.world.world import WorldMap

VEHICLE_RGB, OWNER_RGB, GOAL_RGB, PLAN_RGB = (40, 110, 220), (232, 120, 32), (220, 40, 90), (250, 250, 250)
ARRIVED_M = 1.0  # a goal nearer than this is not shown: it would hide the vehicle
PLAN_M = 0.25  # how thick it is: it is seen on both sides of the trail that covers it
OTHERS_RGB = ((30, 150, 140), (150, 80, 190), (190, 140, 30), (110, 120, 130), (200, 80, 130), (90, 150, 50))
TRAIL_LIFT_M = 0.1  # of what walks on the ground, which would hide its trail
RAY_RGB, RAY_M = (240, 200, 60), 0.02
MARK_M = 0.6  # above the ground
ARROW = np.array(
    [[(-0.35, 0.0, 0.0), (0.35, 0.0, 0.0)], [(0.35, 0.0, 0.0), (0.1, -0.2, 0.0)], [(0.35, 0.0, 0.0), (0.1, 0.2, 0.0)]],
    np.float32,
)
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
        others: airframes of the other vehicles.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        world: WorldMap,
        airframe: Airframe,
        *,
        mount: Mount | None = None,
        path_ned: Sequence[Sequence[float]] = (),
        others: Sequence[Airframe] = (),
    ) -> None:
        self._api = server.scene
        self._api.set_up_direction("-z")
        self._api.configure_default_lights(cast_shadow=False)  # shadows would cost a weak machine half its frames
        self._api.configure_fog(0.4 * world.config.size_m, 1.4 * world.config.size_m, color=SKY_RGB)
        self._api.set_background_image(np.full((2, 2, 3), SKY_RGB, np.uint8))
        self._world = world
        self._movers: list[tuple[int, viser.FrameHandle]] = []
        self._add_world(world)
        self._pose: viser.FrameHandle | None = None  # that the vehicle shall stand in
        self._rays: Any = None  # lines, once there have been some
        self._vehicle = VehicleNodes(self._api, "vehicle", airframe, VEHICLE_RGB)
        self._others = [
            VehicleNodes(self._api, f"vehicle{k}", other, OTHERS_RGB[k % len(OTHERS_RGB)])
            for k, other in enumerate(others, 2)
        ]
        self._owner = self._api.add_frame("/owner", show_axes=False, visible=False)
        add_mesh(self._api, "/owner/body", shapes.person(float(STATURE_M)))
        self._goal = self._api.add_icosphere("/goal", radius=0.35, color=GOAL_RGB, opacity=0.7, visible=False)
        self.frustum = None if mount is None else self._frustum(mount)
        self._owner_trail = Trail(self._api, "/trails/owner", OWNER_RGB)
        if len(path_ned) > 1:
            plan = np.array(path_ned, np.float32)
            self._api.add_line_segments("/plan", segments(plan), PLAN_RGB, thickness=PLAN_M)

    def _add_world(self, world: WorldMap) -> None:
        add_mesh(self._api, "/world/ground", shapes.ground(world))
        ring = shapes.walls(world)
        if ring is not None:
            add_mesh(self._api, "/world/walls", ring)
        boxes = shapes.boxes(world, movers=False)
        if boxes is not None:
            add_mesh(self._api, "/world/boxes", boxes)
        for i, mesh in shapes.moving_boxes(world):
            self._movers.append((i, self._api.add_frame(f"/world/mover{i}", show_axes=False)))
            add_mesh(self._api, f"/world/mover{i}/box", mesh)
        for part in world.solids.parts:
            self._api.add_mesh_trimesh(f"/world/solids/{part.name}", part_mesh(part))
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
        return self._vehicle.drives

    def show(self, moment: Moment, others: Sequence[Moment] = ()) -> None:
        """Moves what moves.

        Args:
            moment: of the vehicle.
            others: of the other vehicles.
        """
        self._vehicle.show(moment)
        for nodes, other in zip(self._others, others, strict=False):
            nodes.show(other)
        if self._movers:
            places = self._world.boxes.middle(moment.tick)
            for i, mover in self._movers:
                mover.position = (places[i][0], places[i][1], 0.0)
        if moment.has_owner:
            self._owner.position = moment.owner_ned
            self._owner.wxyz = wxyz_of(quat_of(float(moment.row["owner"]["heading_rad"]), 0.0))
            self._owner_trail.lead_to(_lifted(moment.owner_ned))
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

    def extend_trails(self, moment: Moment, others: Sequence[Moment] = ()) -> None:
        """Appends where everybody is; `show` leads on from there."""
        self._vehicle.trail.extend(moment.time_s, moment.pos_ned)
        for nodes, other in zip(self._others, others, strict=False):
            nodes.trail.extend(other.time_s, other.pos_ned)
        if moment.has_owner:
            self._owner_trail.extend(moment.time_s, _lifted(moment.owner_ned))

    def forget_trails(self) -> None:
        """Somebody has been put elsewhere."""
        for trail in (self._vehicle.trail, self._owner_trail, *(nodes.trail for nodes in self._others)):
            trail.forget()

    def draw_trails(self, rows: NDArray[Any], others: Sequence[NDArray[Any]] = ()) -> None:
        """Draws them anew from rows of recordings that may have jumped."""
        self._vehicle.trail.draw(rows["pos_ned"])
        for nodes, other in zip(self._others, others, strict=False):
            nodes.trail.draw(other["pos_ned"])
        if len(rows) and Moment(rows[0]).has_owner:
            self._owner_trail.draw(_lifted(rows["owner"]["pos_ned"]))


def _lifted(points_ned: NDArray[np.float32]) -> NDArray[np.float32]:
    return points_ned - np.array([0.0, 0.0, TRAIL_LIFT_M], np.float32)


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
