"""Where things stand in 'Park It Right', read in the published scenes: storeys, walls, blocks, portals, starts, spots.

Coordinates are Unity's: x right, z forward, y up, yaw clockwise from +z seen from above. Everything is planar but for
the heights that the documents' unit vectors and distances contain. A pose is (x, z, sin yaw, cos yaw).

The document calls the arena 15 x 15 and its largest displacement 30: we read 15 as the half side, as the code has it.
"""

import math
from collections.abc import Sequence

import numpy as np
import warp as wp
from numpy.typing import NDArray

wp.set_module_options({"enable_backward": False})

STOREY_X = (0.0, 68.86)  # [m] centres
STOREY_Z = (0.0, 0.03)
WALL_CENTRES = (-15.25, 15.24, -15.26, 15.30)  # [m] from a storey's centre: x of two, z of two
WALL_THICKNESS = 0.61  # [m]
INNER_FACES = (  # [m] from a storey's centre; the gaps at the corners are narrower than the car: a closed room
    WALL_CENTRES[0] + WALL_THICKNESS / 2,
    WALL_CENTRES[1] - WALL_THICKNESS / 2,
    WALL_CENTRES[2] + WALL_THICKNESS / 2,
    WALL_CENTRES[3] - WALL_THICKNESS / 2,
)

BLOCK_POSITIONS = ((-3.28, 1.83, -32.3), (-1.99, -5.70, 31.5), (7.19, -1.03, 31.5))  # x, z [m], yaw [deg]

PORTAL_SIZE = (6.0, 0.2)  # [m] a plate 6 x 3 tilted by 75 deg; taken as upright, thickness a guess
PORTAL_POSITIONS = ((-11.75, 12.2, -45.0), (56.31, -11.96, -135.0))
PORTAL_HEIGHTS = (1.23, 1.36)  # [m] of their centres
PORTAL_EXITS = (  # where a car comes out that went into portal 1, portal 2
    (PORTAL_POSITIONS[1][0] + 1.0, PORTAL_POSITIONS[1][1] + 0.5, 45.0),
    (PORTAL_POSITIONS[0][0] + 1.0, PORTAL_POSITIONS[0][1] - 1.0, 135.0),
)

MOVER_POSITIONS = ((-0.51, 3.82), (8.88, 0.0), (68.85, 8.91), (65.05, -0.49))  # x, z [m]; two on each storey
MOVER_MOVES = ((0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (-1.0, 0.0))  # first directions of travel

LEVEL1_START = (-12.70, -13.53, 0.0)
LEVEL1_SPOTS = ((-11.0, -5.0), (-3.2, 12.0), (8.0, 12.0))
LEVEL1_MARKER = (-3.79, 12.20)  # of the scene: the goal before the first park (computed)
LEVEL2_START = (-12.70, -10.02, 56.3)
LEVEL2_SPOT = (78.42, 12.24)
LEVEL2_SPOTS_BELOW = ((-3.2, 12.0), (8.0, 12.0))  # of storey 1, in the code but commented out

CAR_HEIGHT = 0.5  # [m] of the car's origin
SPOT_HEIGHT, BLOCK_HEIGHT, WALL_HEIGHT, MOVER_HEIGHT = 0.3, 0.46, 0.0, 0.0  # [m] of their centres

STOREY_2_FROM_X = wp.constant(34.43)  # [m] halfway between the storeys
STOREY_X_2 = wp.constant(STOREY_X[1])
STOREY_Z_2 = wp.constant(STOREY_Z[1])
WALL_X_LOW, WALL_X_HIGH, WALL_Z_LOW, WALL_Z_HIGH = (wp.constant(face) for face in INNER_FACES)
WALL_CENTRE_X_LOW, WALL_CENTRE_X_HIGH, WALL_CENTRE_Z_LOW, WALL_CENTRE_Z_HIGH = (wp.constant(c) for c in WALL_CENTRES)
PORTAL_HALF_X, PORTAL_HALF_Z = wp.constant(PORTAL_SIZE[0] / 2), wp.constant(PORTAL_SIZE[1] / 2)


def pose(position: Sequence[float]) -> NDArray[np.float32]:
    """(x, z, sin yaw, cos yaw) of x, z [m] and yaw [deg]."""
    yaw_rad = math.radians(position[2])
    return np.array([position[0], position[1], math.sin(yaw_rad), math.cos(yaw_rad)], dtype=np.float32)


@wp.func
def storey_of(x: float) -> int:
    """0 or 1."""
    return wp.where(x > STOREY_2_FROM_X, 1, 0)


@wp.func
def storey_centre(storey: int) -> wp.vec2:
    """[m] x and z."""
    return wp.where(storey == 1, wp.vec2(STOREY_X_2, STOREY_Z_2), wp.vec2(0.0, 0.0))


@wp.func
def forward_of(pose: wp.vec4) -> wp.vec2:
    """Unit vector along the z axis of what stands there."""
    return wp.vec2(pose[2], pose[3])


@wp.func
def right_of(pose: wp.vec4) -> wp.vec2:
    """Unit vector along the x axis of what stands there."""
    return wp.vec2(pose[3], -pose[2])


@wp.func
def position_of(pose: wp.vec4) -> wp.vec2:
    """[m] x and z."""
    return wp.vec2(pose[0], pose[1])


@wp.func
def pose_at(position: wp.vec2, yaw_rad: float) -> wp.vec4:
    """A pose of a place and a yaw."""
    return wp.vec4(position[0], position[1], wp.sin(yaw_rad), wp.cos(yaw_rad))


@wp.func
def into_frame(pose: wp.vec4, point: wp.vec2) -> wp.vec2:
    """A point as (right, forward) of what stands at a pose [m]."""
    gap = point - position_of(pose)
    return wp.vec2(wp.dot(gap, right_of(pose)), wp.dot(gap, forward_of(pose)))
