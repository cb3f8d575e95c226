"""What the documents' cars see: unit vectors to centres, in the car's frame or the world's. Ranges are not observed."""

import warp as wp

from policies.tasks.episode import StepBuffers
from policies.tasks.layout import Element
from policies.tasks.parking.arena import CAR_HEIGHT

wp.set_module_options({"enable_backward": False})

_CAR_HEIGHT = wp.constant(CAR_HEIGHT)
_AXES = ("x", "y", "z")


def unit_elements(name: str, is_goal: bool = False) -> tuple[Element, ...]:
    """Three elements of a unit vector in the car's frame."""
    return tuple(Element(f"{name}_car_{axis}", "1", is_goal=is_goal) for axis in _AXES)


def world_elements(name: str, unit: str = "1", is_goal: bool = False) -> tuple[Element, ...]:
    """Three elements of a vector in the world's axes."""
    return tuple(Element(f"{name}_world_{axis}", unit, is_goal=is_goal) for axis in _AXES)


@wp.func
def write_vector(buffers: StepBuffers, i: int, at: int, vector: wp.vec3) -> int:
    """Writes three floats; returns the next column."""
    buffers.observations[i, at] = vector[0]
    buffers.observations[i, at + 1] = vector[1]
    buffers.observations[i, at + 2] = vector[2]
    return at + 3


@wp.func
def gap_to(car: wp.vec4, x: float, y: float, z: float) -> wp.vec3:
    """From the car's origin to a point, in the world's axes [m]."""
    return wp.vec3(x - car[0], y - _CAR_HEIGHT, z - car[1])


@wp.func
def seen_from(car: wp.vec4, vector: wp.vec3) -> wp.vec3:
    """A vector of the world's axes in the car's frame."""
    return wp.vec3(vector[0] * car[3] - vector[2] * car[2], vector[1], vector[0] * car[2] + vector[2] * car[3])


@wp.func
def unit_to(car: wp.vec4, x: float, y: float, z: float) -> wp.vec3:
    """The unit vector to a point in the car's frame."""
    return seen_from(car, wp.normalize(gap_to(car, x, y, z)))
