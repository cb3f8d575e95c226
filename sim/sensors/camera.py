"""Cameras: images of the world from any number of poses in one launch, with depth and classes beside the colours.

In: poses and lenses of the cameras. Out: 8-bit sRGB, depth along the optical axis, and what each pixel shows. One ray
per pixel (four for smooth edges), and one to the sun. The same source runs on CPU and GPU; asked for stills, for video
at 10 Hz, and by training. The vehicle itself is not in the image. Camera frame rdf: x right, y down, z ahead.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians, tan
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from sim.sensors.ray import CROWN, RAY_MAX_M, SKY, TRUNK, first_hit, is_shadowed, is_trunk
from sim.sensors.shading import (
    SUN_NED,
    lit,
    sky_colour,
    surface_albedo,
    surface_normal_ned,
    with_haze,
)
from sim.sensors.skyline import Skyline, make_skyline
from sim.sensors.solid_paint import SolidPaint, make_paint
from sim.world.world import World, WorldMap

wp.set_module_options({"enable_backward": False, "fast_math": True})

SKY_DEPTH_M = float(RAY_MAX_M)  # depth of pixels that show the sky
_INVERSE_GAMMA = wp.constant(1.0 / 2.2)  # sRGB, nearly


@wp.struct
class Lens:
    """One camera's pose and optics."""

    pos_ned: wp.vec3  # [m]
    q_ned_from_rdf: wp.quat
    half_width: float  # tangent of half the horizontal field of view
    exposure: float  # factor on all light
    balance: wp.vec3  # factor on red, green and blue


@dataclass(frozen=True, slots=True)
class CameraPose:
    """One camera on the host; q is x, y, z, w."""

    pos_ned: tuple[float, float, float]
    q_ned_from_rdf: tuple[float, float, float, float]
    hfov_deg: float = 80.0
    exposure: float = 1.0
    balance: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True, eq=False, slots=True)
class Images:
    """What the cameras see."""

    rgb: NDArray[np.uint8]  # (cameras, height, width, 3)
    depth_m: NDArray[np.float32]  # (cameras, height, width), along the optical axis; SKY_DEPTH_M for the sky
    kind: NDArray[np.uint8]  # (cameras, height, width), SKY, GROUND, TRUNK, CROWN, WALL, VEHICLE, SOLID


@wp.func
def pixel_ray(lens: Lens, x: float, y: float, width: int, height: int) -> wp.vec3:
    """Direction in ned through a position of the image [pixels], 1 along the optical axis."""
    per_pixel = 2.0 * lens.half_width / float(width)
    right = (x - 0.5 * float(width)) * per_pixel
    down = (y - 0.5 * float(height)) * per_pixel
    return wp.quat_rotate(lens.q_ned_from_rdf, wp.vec3(right, down, 1.0))


@wp.func
def encoded(light: float) -> wp.uint8:
    """8-bit sRGB of linear light, its highlights rolled off."""
    rolled = light * (1.0 + 0.12 * light) / (1.0 + light)
    return wp.uint8(wp.clamp(255.0 * wp.pow(1.25 * wp.max(rolled, 0.0), _INVERSE_GAMMA), 0.0, 255.0))


@wp.kernel
def render_images(
    w: World,
    skyline: Skyline,
    paint: SolidPaint,
    lenses: wp.array[Lens],
    samples: int,  # per side of a pixel
    rgb: wp.array4d[wp.uint8],
    depth_m: wp.array3d[wp.float32],
    kinds: wp.array3d[wp.uint8],
) -> None:
    i_camera, row, column = wp.tid()
    lens = lenses[i_camera]
    height = depth_m.shape[1]
    width = depth_m.shape[2]
    total = wp.vec3(0.0, 0.0, 0.0)
    for i_sample in range(samples * samples):
        x = float(column) + (float(i_sample % samples) + 0.5) / float(samples)
        y = float(row) + (float(i_sample / samples) + 0.5) / float(samples)
        ray = pixel_ray(lens, x, y, width, height)
        length = wp.length(ray)
        dir_ned = ray / length
        hit = first_hit(w, skyline, lens.pos_ned, dir_ned, RAY_MAX_M)
        point = lens.pos_ned + hit.t * dir_ned
        colour = wp.vec3(0.0, 0.0, 0.0)
        if hit.kind == SKY:
            colour = sky_colour(dir_ned)
        else:
            if hit.kind == CROWN:
                if is_trunk(w.forest.trees[hit.i_tree], point):
                    hit.kind = TRUNK
            normal = surface_normal_ned(w, hit, point)
            facing = wp.max(0.05, wp.abs(wp.dot(normal, dir_ned)))
            footprint = hit.t * 2.0 * lens.half_width / float(width) / float(samples) / wp.sqrt(facing)
            albedo = surface_albedo(w, paint, hit, point, normal, footprint)
            is_away = wp.dot(normal, SUN_NED) <= 0.0
            is_shaded = is_away and hit.kind != CROWN  # light comes through leaves
            if not is_away:
                is_shaded = is_shadowed(w, skyline, point + normal * (0.02 + 0.0005 * hit.t), SUN_NED)
            colour = with_haze(lit(albedo, normal, hit.kind, is_shaded), dir_ned, hit.t)
        total = total + colour
        if i_sample == 0:
            depth_m[i_camera, row, column] = hit.t / length
            kinds[i_camera, row, column] = wp.uint8(hit.kind)
            if hit.kind == SKY:
                depth_m[i_camera, row, column] = RAY_MAX_M
    total = total * (lens.exposure / float(samples * samples))
    rgb[i_camera, row, column, 0] = encoded(total[0] * lens.balance[0])
    rgb[i_camera, row, column, 1] = encoded(total[1] * lens.balance[1])
    rgb[i_camera, row, column, 2] = encoded(total[2] * lens.balance[2])


class Renderer:
    """Takes images of one world.

    Args:
        world: its kernel arrays must be on `device`.
        device: a Warp device.
    """

    def __init__(self, world: WorldMap, device: str = "cpu") -> None:
        self._world = world.kernel
        self._seen = world  # kernels' structs do not keep their arrays alive
        self._skyline = make_skyline(world).kernel(device)
        self._paint = make_paint(world.solids, device)
        self._device = device

    def prepare(self) -> None:
        """Compiles or loads the kernel, so that the first image takes no longer."""
        wp.load_module(render_images.module, device=self._device)

    def images(self, poses: Sequence[CameraPose], width: int, height: int, *, samples: int = 1) -> Images:
        """What the cameras see, all at once.

        Args:
            poses: of the cameras.
            width: of each image [pixels].
            height: of each image [pixels].
            samples: rays per side of a pixel: 2 smooths the edges at four times the price. Depth and kind are those of
                the first.
        """
        count, device = len(poses), self._device
        lenses = wp.array([_lens(pose) for pose in poses], dtype=Lens, device=device)
        rgb = wp.empty((count, height, width, 3), dtype=wp.uint8, device=device)
        depth_m = wp.empty((count, height, width), dtype=wp.float32, device=device)
        kinds = wp.empty((count, height, width), dtype=wp.uint8, device=device)
        inputs = [self._world, self._skyline, self._paint, lenses, samples, rgb, depth_m, kinds]
        wp.launch(render_images, dim=(count, height, width), inputs=inputs, device=device)
        return Images(rgb.numpy(), depth_m.numpy(), kinds.numpy())


def _lens(pose: CameraPose) -> Any:
    lens = Lens()
    lens.pos_ned = wp.vec3(*pose.pos_ned)
    lens.q_ned_from_rdf = wp.quat(*pose.q_ned_from_rdf)
    lens.half_width = tan(0.5 * radians(pose.hfov_deg))
    lens.exposure = pose.exposure
    lens.balance = wp.vec3(*pose.balance)
    return lens
