"""`honeyguide picture`: what a camera sees from a place in the world, without a flight."""

from dataclasses import dataclass
from math import radians
from pathlib import Path

from autopilot.payload.camera.image_file import jpeg_bytes
from common.attitude import product, quat_of
from common.files import write_whole
from sim.sensors.camera import CameraPose, Renderer
from sim.world.world import WorldConfig, build_world

_RDF_IN_FRD = (0.5, 0.5, 0.5, 0.5)  # a camera that looks ahead


class ImageError(ValueError):
    """Something the user gave is wrong; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """Where the camera is and which way it looks."""

    north_m: float
    east_m: float
    above_ground_m: float
    yaw_deg: float
    pitch_deg: float
    hfov_deg: float


def take_image(output: Path, world: WorldConfig, viewpoint: Viewpoint, size: str) -> None:
    """Writes the image as a JPEG.

    Raises:
        ImageError: the size makes no sense, or the file cannot be written.
    """
    width, height = _size(size)
    world_map = build_world(world)
    ground_m = float(world_map.height(viewpoint.north_m, viewpoint.east_m))
    place = (viewpoint.north_m, viewpoint.east_m, -ground_m - viewpoint.above_ground_m)
    q_ned_from_frd = quat_of(radians(viewpoint.yaw_deg), radians(viewpoint.pitch_deg))
    pose = CameraPose(place, product(q_ned_from_frd, _RDF_IN_FRD), viewpoint.hfov_deg)
    images = Renderer(world_map).images([pose], width, height, samples=2)
    try:
        write_whole(output, jpeg_bytes(images.rgb[0]))
    except OSError as error:
        raise ImageError(f"{output}: {error.strerror}") from error


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and 16 <= int(width) <= 4096 and 16 <= int(height) <= 4096):
        raise ImageError(f"--size {text}: must be WIDTHxHEIGHT, both from 16 to 4096")
    return int(width), int(height)
