"""How far it is to a parking target from everywhere on a storey: an eikonal field on a grid, by fast sweeping.

H. Zhao, "A fast sweeping method for Eikonal equations", Math. Comp. 74 (2005): Godunov's upwind difference, swept in
the four diagonal orders. Near obstacles and walls a metre counts for more, so that ways keep clear of them.
Frames are Unity's, in metres from the storey's centre. What moves is not in the field.
"""

import warp as wp

from policies.tasks.parking.arena import WALL_X_HIGH, WALL_X_LOW, WALL_Z_HIGH, WALL_Z_LOW, storey_centre
from policies.tasks.parking.car import box_distance
from policies.tasks.parking.scene import Scene, portal_half
from policies.tasks.parking.spots import clearance

wp.set_module_options({"enable_backward": False})

NODES = 121  # per axis
SPACING_M = 0.25
_NODES = wp.constant(NODES)
_SPACING = wp.constant(SPACING_M)
_FIRST = wp.constant(-15.0)  # [m] of the first node; the walls' faces are at 14.9 to 15
_ROUNDS = wp.constant(3)  # of four sweeps; three blocks bend a way no more often
_SEED_M = wp.constant(0.5)  # nodes so near to the target hold their exact distance
_FAR = wp.constant(1.0e6)
_TIGHT_M = wp.constant(0.7)  # guess: half the car's width and some
_WIDE_M = wp.constant(1.7)  # guess: room to turn round
_TIGHT_COST = wp.constant(20.0)  # guess: a way through here is a last resort
_NEAR_COST = wp.constant(1.5)  # guess: what a metre beside an obstacle counts more


@wp.struct
class Target:
    """A box to be reached; of size 0 if it is a point."""

    pose: wp.vec4
    half: wp.vec2  # [m]


@wp.func
def node_position(storey: int, x: int, z: int) -> wp.vec2:
    """Where a node lies [m]."""
    return storey_centre(storey) + wp.vec2(_FIRST + _SPACING * float(x), _FIRST + _SPACING * float(z))


@wp.func
def wall_clearance(storey: int, point: wp.vec2) -> float:
    """From a point to the nearest wall [m]."""
    local = point - storey_centre(storey)
    return wp.min(
        wp.min(local[0] - WALL_X_LOW, WALL_X_HIGH - local[0]), wp.min(local[1] - WALL_Z_LOW, WALL_Z_HIGH - local[1])
    )


@wp.func
def slowness(clear_m: float) -> float:
    """What a metre counts at a clearance."""
    if clear_m < _TIGHT_M:
        return _TIGHT_COST
    fraction = wp.clamp((_WIDE_M - clear_m) / (_WIDE_M - _TIGHT_M), 0.0, 1.0)
    return 1.0 + _NEAR_COST * fraction * fraction


@wp.func
def update_node(way: wp.array3d(dtype=float), cost: wp.array3d(dtype=float), i: int, x: int, z: int) -> None:
    """One upwind step at a node."""
    left = wp.min(way[i, z, wp.max(x - 1, 0)], way[i, z, wp.min(x + 1, _NODES - 1)])
    below = wp.min(way[i, wp.max(z - 1, 0), x], way[i, wp.min(z + 1, _NODES - 1), x])
    step = cost[i, z, x] * _SPACING
    gap = wp.abs(left - below)
    value = wp.min(left, below) + step
    if gap < step:
        value = 0.5 * (left + below + wp.sqrt(2.0 * step * step - gap * gap))
    way[i, z, x] = wp.min(way[i, z, x], value)


@wp.func
def fill_field(
    way: wp.array3d(dtype=float), cost: wp.array3d(dtype=float), i: int, storey: int, scene: Scene, target: Target
) -> None:
    """Works out the field of a row: `way` [m], shape (rows, nodes along z, nodes along x).

    The scene holds what stands still; a portal in it is to be kept clear of.
    """
    for z in range(_NODES):
        for x in range(_NODES):
            point = node_position(storey, x, z)
            distance = box_distance(target.pose, target.half, point)
            clear_m = wp.min(clearance(scene, point), wall_clearance(storey, point))
            if scene.has_portal:
                clear_m = wp.min(clear_m, box_distance(scene.portal, portal_half(), point))
            cost[i, z, x] = slowness(clear_m)
            way[i, z, x] = wp.where(distance < _SEED_M, distance, _FAR)
    for _round in range(_ROUNDS):
        for sweep in range(4):
            for k in range(_NODES * _NODES):
                z = k // _NODES
                x = k - z * _NODES
                if sweep == 1 or sweep == 2:
                    x = _NODES - 1 - x
                if sweep >= 2:
                    z = _NODES - 1 - z
                update_node(way, cost, i, x, z)


@wp.func
def way_at(way: wp.array3d(dtype=float), i: int, storey: int, point: wp.vec2) -> wp.vec3:
    """The field at a point [m], and its gradient along x and z: bilinear between nodes."""
    at = (point - storey_centre(storey) - wp.vec2(_FIRST, _FIRST)) / _SPACING
    x = wp.clamp(int(wp.floor(at[0])), 0, _NODES - 2)
    z = wp.clamp(int(wp.floor(at[1])), 0, _NODES - 2)
    u = wp.clamp(at[0] - float(x), 0.0, 1.0)
    v = wp.clamp(at[1] - float(z), 0.0, 1.0)
    a = way[i, z, x]
    b = way[i, z, x + 1]
    c = way[i, z + 1, x]
    d = way[i, z + 1, x + 1]
    low = wp.lerp(a, b, u)
    high = wp.lerp(c, d, u)
    along_x = wp.lerp(b - a, d - c, v) / _SPACING
    return wp.vec3(wp.lerp(low, high, v), along_x, (high - low) / _SPACING)
