"""The parking tasks from above: storeys side by side, pad, portals, obstacles, car and the rays of its sensor."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from policies.tasks.parking.arena import (
    INNER_FACES,
    PORTAL_POSITIONS,
    PORTAL_SIZE,
    STOREY_X,
    STOREY_Z,
    WALL_THICKNESS,
)
from policies.tasks.top_view import GOAL, INK, OBSTACLE, VEHICLE, Canvas, Rgb

_FLOOR: Rgb = (255, 255, 255)
_PORTAL: Rgb = (58, 140, 82)
_RAY: Rgb = (214, 178, 108)
_MARGIN_M = 1.5
_GAP_M = 2.0 * 15.3 + 1.0  # [m] between the middles of storeys in the image


class ParkingView:
    """A canvas on which both storeys have room; places are given in the task's coordinates."""

    def __init__(self, storey_count: int, height_px: int) -> None:
        half = INNER_FACES[3] + WALL_THICKNESS + _MARGIN_M
        right = half + _GAP_M * (storey_count - 1)
        self.canvas = Canvas((-half, right), (-half, half), height_px)
        for storey in range(storey_count):
            centre = (STOREY_X[storey], STOREY_Z[storey])
            low_x, high_x, low_z, high_z = INNER_FACES
            for margin, colour in ((WALL_THICKNESS, INK), (0.0, _FLOOR)):
                size = (high_x - low_x + 2 * margin, high_z - low_z + 2 * margin)
                middle = (centre[0] + (low_x + high_x) / 2, centre[1] + (low_z + high_z) / 2)
                self.box((*middle, 0.0, 1.0), size, colour)

    def position(self, x: float, z: float) -> tuple[float, float]:
        """Where a point is drawn."""
        is_above = x > STOREY_X[1] / 2
        return (x - STOREY_X[1] + _GAP_M, z - STOREY_Z[1]) if is_above else (x, z)

    def box(self, pose: Any, size: tuple[float, float], colour: Rgb) -> None:
        """A rectangle at (x, z, sin yaw, cos yaw)."""
        yaw_rad = float(np.arctan2(pose[2], pose[3]))
        self.canvas.box(self.position(float(pose[0]), float(pose[1])), size, -yaw_rad, colour)

    def line(self, a: Any, b: Any, colour: Rgb, width_px: int = 1) -> None:
        """From one point to another on the same storey."""
        self.canvas.line(
            [self.position(float(a[0]), float(a[1])), self.position(float(b[0]), float(b[1]))], colour, width_px
        )

    def car(self, pos: Any, yaw_rad: float, params: dict[str, float]) -> None:
        """Its box, and a line over its nose."""
        nose = np.array([np.sin(yaw_rad), np.cos(yaw_rad)])
        middle = np.asarray(pos) + nose * params["box_ahead_m"]
        self.box((*middle, *nose), (params["car_width_m"], params["car_length_m"]), VEHICLE)
        self.line(middle, middle + nose * params["car_length_m"] / 2, _FLOOR, 2)

    def portals(self) -> None:
        """Where the storeys are left."""
        for x, z, yaw_deg in PORTAL_POSITIONS:
            yaw_rad = np.radians(yaw_deg)
            self.box((x, z, np.sin(yaw_rad), np.cos(yaw_rad)), (PORTAL_SIZE[0], 0.4), _PORTAL)

    def mover(self, pose: Any, params: dict[str, float], colour: Rgb = OBSTACLE) -> None:
        """A capsule."""
        radius = params["mover_radius_m"]
        reach = max(0.0, params["mover_length_m"] / 2 - radius)
        self.box(pose, (2 * radius, 2 * reach), colour)
        for side in (-1.0, 1.0):
            end = self.position(float(pose[0] + side * reach * pose[2]), float(pose[1] + side * reach * pose[3]))
            self.canvas.disc(end, radius, colour)

    def rays(self, pos: Any, yaw_rad: float, casts: NDArray[np.float32], params: dict[str, float]) -> None:
        """Each ray as far as it got, in the sensor's order; `casts` are their fractions."""
        spacing = np.radians(params["ray_degrees"]) / max(1, len(casts) // 2)
        for k, fraction in enumerate(casts):
            angle = yaw_rad + spacing * ((k + 1) // 2) * (1 if k % 2 else -1)
            reach = min(float(fraction) * params["ray_length_m"], 60.0)
            self.line(pos, np.asarray(pos) + reach * np.array([np.sin(angle), np.cos(angle)]), _RAY)


def params_of(task: Any, i_env: int) -> dict[str, float]:
    """The numbers of an environment's episode by name."""
    return dict(zip(task.param_table.names, task.buffers.params.numpy()[i_env].tolist(), strict=True))


def ray_fractions(task: Any, i_env: int) -> NDArray[np.float32]:
    """The last column of each ray in the newest frame."""
    size = task.rules.tag_count + 2
    count = 2 * task.rules.ray_count + 1
    newest = task.buffers.observations.numpy()[i_env, -count * size :] if count > 0 else np.zeros(0, np.float32)
    return np.asarray(newest[size - 1 :: size], dtype=np.float32)


def top_view_of(task: Any, i_env: int, height_px: int) -> NDArray[np.uint8]:
    """One environment of either level."""
    world = task.world
    params = params_of(task, i_env)
    is_level_2 = hasattr(task, "movers")
    image = ParkingView(2 if is_level_2 else 1, height_px)
    pos, yaw_rad = world.pos.numpy()[i_env], float(world.yaw.numpy()[i_env])
    image.box(world.goal.numpy()[i_env], (params["pad_width_m"], params["pad_length_m"]), GOAL)
    image.rays(pos, yaw_rad, ray_fractions(task, i_env), params)
    if is_level_2:
        image.portals()
        for pose in task.movers.numpy()[i_env]:
            image.mover(pose, params)
    else:
        for block in task.blocks.numpy()[i_env]:
            image.box(block, (params["block_width_m"], params["block_length_m"]), OBSTACLE)
    image.car(pos, yaw_rad, params)
    return image.canvas.pixels
