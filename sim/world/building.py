"""Kernels that build the boxes of the chosen worlds of a batch: scattered walls and movers, or a car park.

In: `Growing`, with the hills raised. Out: the boxes of the `World` rows. A thread builds a whole world. A car park has
two rows of spots on either side of an aisle, whose entrance is before home; spots are parted by walls or kerbs, some
hold parked cars, one in each row is free for certain, and the movers run along the aisle. It lies on the ground as that
is. The sizes are those of a 1:5 car park; guesses.
"""

import warp as wp

from common.kernels import TICK_S
from sim.rng_streams import BOXES, MOVERS
from sim.world.boxes import Box, Boxes
from sim.world.growing import Growing
from sim.world.terrain import Terrain, terrain_height
from sim.world.trees import NO_OBSTACLE_M

wp.set_module_options({"enable_backward": False})

SPOT_WIDTH_M = wp.constant(1.1)
SPOT_DEPTH_M = wp.constant(1.3)
AISLE_M = wp.constant(3.2)  # between the rows
ENTRANCE_M = wp.constant(2.5)  # from home to the first spots
_CAR_M = wp.constant(wp.vec3(0.75, 0.45, 0.35))
_PARKED = wp.constant(0.6)  # fraction of spots with a car, but for the one of each row that stays free
_DIVIDER_M = wp.constant(wp.vec2(1.1, 0.06))
_DIVIDER_HEIGHTS_M = wp.constant(wp.vec2(0.12, 0.5))  # a kerb or a wall
_BACK_M = wp.constant(wp.vec2(0.1, 0.6))  # thickness and height of the wall behind a row
_UNDERGROUND_M = wp.constant(1.0)
_HOME_ROOM_M = wp.constant(3.0)  # nothing stands or moves so near to home
_MOVER_M = wp.constant(0.5)  # length and width
_MOVER_HEIGHT_M = wp.constant(1.2)
_MOVER_SPEED_M_S = wp.constant(wp.vec2(0.3, 1.0))
_DARTS = wp.constant(8)
_NO_OBSTACLE = wp.constant(NO_OBSTACLE_M)


def most_boxes(wall_count: int, mover_count: int, spot_count: int) -> int:
    """How many boxes a world has at most: of a car park per row a car, a divider each, one more, and the back."""
    return wall_count + mover_count + (4 * spot_count + 4 if spot_count > 0 else 0)


@wp.func
def lot_yaw(seed: int) -> float:
    """Where the aisle of a world's car park leads, from home [rad]."""
    return 2.0 * wp.pi * wp.randf(wp.rand_init(seed, BOXES))


@wp.func
def lot_place(yaw: float, along: float, right: float) -> wp.vec2:
    """North and east [m] of a place so far along the aisle from home and to its right."""
    return wp.vec2(along * wp.cos(yaw) - right * wp.sin(yaw), along * wp.sin(yaw) + right * wp.cos(yaw))


@wp.func
def spot_pose(seed: int, spot_count: int, i_spot: int) -> wp.vec3:
    """Middle of a spot, north and east [m], and the heading out of it into the aisle [rad]; the right row first."""
    yaw = lot_yaw(seed)
    side = wp.where(i_spot < spot_count, 1.0, -1.0)
    along = ENTRANCE_M + (float(i_spot % spot_count) + 0.5) * SPOT_WIDTH_M
    place = lot_place(yaw, along, side * 0.5 * (AISLE_M + SPOT_DEPTH_M))
    return wp.vec3(place[0], place[1], yaw - side * 0.5 * wp.pi)


@wp.func
def standing_box(terrain: Terrain, place: wp.vec2, yaw: float, length: float, width: float, height: float) -> Box:
    """A box on the ground, as high above it at its middle as asked, and everywhere down into it."""
    box = Box()
    box.north = place[0]
    box.east = place[1]
    box.cos_yaw = wp.cos(yaw)
    box.sin_yaw = wp.sin(yaw)
    box.half_length = 0.5 * length
    box.half_width = 0.5 * width
    ground = terrain_height(terrain, place[0], place[1])
    lowest = ground
    for end in range(2):
        ahead = (2.0 * float(end) - 1.0) * box.half_length
        lowest = wp.min(lowest, terrain_height(terrain, place[0] + ahead * box.cos_yaw, place[1] + ahead * box.sin_yaw))
    box.low = lowest - _UNDERGROUND_M
    box.high = ground + height
    return box


@wp.func
def moving_box(terrain: Terrain, place: wp.vec2, yaw: float, half_way: float, speed_m_s: float, started: float) -> Box:
    """A box that runs to and fro over the ground, `started` of a run [0..1) at tick 0."""
    box = standing_box(terrain, place, yaw, _MOVER_M, _MOVER_M, _MOVER_HEIGHT_M)
    for k in range(5):  # it reaches down to the lowest ground of its way and up over the highest
        ahead = (0.5 * float(k) - 1.0) * half_way
        ground = terrain_height(terrain, place[0] + ahead * box.cos_yaw, place[1] + ahead * box.sin_yaw)
        box.low = wp.min(box.low, ground - _UNDERGROUND_M)
        box.high = wp.max(box.high, ground + _MOVER_HEIGHT_M)
    box.half_way = half_way
    box.period_ticks = wp.max(int(4.0 * half_way / (speed_m_s * TICK_S)), 1)
    box.start_ticks = wp.min(int(started * float(box.period_ticks)), box.period_ticks - 1)
    return box


@wp.func
def add_box(boxes: Boxes, box: Box) -> Boxes:
    """The boxes with one more, if there is room."""
    if boxes.box_count < boxes.boxes.shape[0]:
        boxes.boxes[boxes.box_count] = box
        boxes.box_count = boxes.box_count + 1
        boxes.top_m = wp.max(boxes.top_m, box.high)
    return boxes


@wp.func
def build_lot(boxes: Boxes, terrain: Terrain, seed: int, spot_count: int) -> Boxes:
    """The rows of a car park."""
    yaw = lot_yaw(seed)
    state = wp.rand_init(int(wp.rand_init(seed, BOXES)), 1)
    divider_height = wp.where(wp.randf(state) < 0.5, _DIVIDER_HEIGHTS_M[0], _DIVIDER_HEIGHTS_M[1])
    for row in range(2):
        side = 1.0 - 2.0 * float(row)
        right = side * 0.5 * (AISLE_M + SPOT_DEPTH_M)
        free = wp.min(int(wp.randf(state) * float(spot_count)), spot_count - 1)
        for k in range(spot_count + 1):
            along = ENTRANCE_M + float(k) * SPOT_WIDTH_M
            across = yaw + 0.5 * wp.pi
            divider = lot_place(yaw, along, right)
            boxes = add_box(boxes, standing_box(terrain, divider, across, _DIVIDER_M[0], _DIVIDER_M[1], divider_height))
            is_parked = wp.randf(state) < _PARKED
            off = wp.vec2(0.1 * (wp.randf(state) - 0.5), 0.2 * (wp.randf(state) - 0.5))
            turn = 0.1 * (wp.randf(state) - 0.5)
            if k < spot_count and k != free and is_parked:
                place = lot_place(yaw, along + 0.5 * SPOT_WIDTH_M + off[0], right + off[1])
                boxes = add_box(boxes, standing_box(terrain, place, across + turn, _CAR_M[0], _CAR_M[1], _CAR_M[2]))
        length = float(spot_count) * SPOT_WIDTH_M
        back = lot_place(yaw, ENTRANCE_M + 0.5 * length, side * (0.5 * AISLE_M + SPOT_DEPTH_M + 0.5 * _BACK_M[0]))
        boxes = add_box(boxes, standing_box(terrain, back, yaw, length, _BACK_M[0], _BACK_M[1]))
    return boxes


@wp.func
def scatter_walls(boxes: Boxes, terrain: Terrain, seed: int, wall_count: int) -> Boxes:
    """Walls and kerbs anywhere but at home."""
    state = wp.rand_init(int(wp.rand_init(seed, BOXES)), 2)
    for _ in range(wall_count):
        length = 1.5 + 3.5 * wp.randf(state)
        width = 0.15 + 0.25 * wp.randf(state)
        height = 0.3 + 0.9 * wp.randf(state)
        if wp.randf(state) < 0.2:
            height = _DIVIDER_HEIGHTS_M[0]
        yaw = 2.0 * wp.pi * wp.randf(state)
        place = free_place(terrain, state, 0.5 * length)
        boxes = add_box(boxes, standing_box(terrain, place, yaw, length, width, height))
        state = wp.rand_init(int(state), 3)
    return boxes


@wp.func
def free_place(terrain: Terrain, key: wp.uint32, reach: float) -> wp.vec2:
    """A place on the map that is farther from home than the room there and a reach [m]."""
    state = wp.rand_init(int(key), 7)
    half = terrain.half_size_m - 2.0
    place = wp.vec2(half, half)
    has_landed = bool(False)
    for _ in range(_DARTS):
        dart = wp.vec2(half * (2.0 * wp.randf(state) - 1.0), half * (2.0 * wp.randf(state) - 1.0))
        if not has_landed and wp.length(dart) > _HOME_ROOM_M + reach:
            place = dart
            has_landed = True
    return place


@wp.func
def send_movers(boxes: Boxes, terrain: Terrain, seed: int, mover_count: int, spot_count: int) -> Boxes:
    """Movers, each on a way of its own: along the aisle of a car park, or anywhere but at home."""
    for k in range(mover_count):
        state = wp.rand_init(int(wp.rand_init(seed, MOVERS)), k)
        speed = wp.lerp(_MOVER_SPEED_M_S[0], _MOVER_SPEED_M_S[1], wp.randf(state))
        started = wp.randf(state)
        half_way = 2.0 + 4.0 * wp.randf(state)
        yaw = 2.0 * wp.pi * wp.randf(state)
        place = free_place(terrain, state, half_way)
        if spot_count > 0:
            yaw = lot_yaw(seed)
            half_way = 0.5 * float(spot_count) * SPOT_WIDTH_M
            place = lot_place(yaw, ENTRANCE_M + half_way, (0.5 * AISLE_M - _MOVER_M) * (2.0 * wp.randf(state) - 1.0))
        boxes = add_box(boxes, moving_box(terrain, place, yaw, half_way, speed, started))
    return boxes


@wp.kernel(enable_backward=False)
def build(growing: Growing, groups: int) -> None:
    """The boxes of the chosen worlds."""
    group = wp.tid()
    for slot in range(group, growing.chosen_count[0], groups):
        i_world = growing.chosen[slot]
        world = growing.worlds[i_world]
        params = growing.params[i_world]
        seed = growing.seeds[i_world]
        boxes = world.boxes
        boxes.box_count = 0
        boxes.top_m = _NO_OBSTACLE
        if params.spot_count > 0:
            boxes = build_lot(boxes, world.terrain, seed, params.spot_count)
        boxes = scatter_walls(boxes, world.terrain, seed, params.wall_count)
        boxes = send_movers(boxes, world.terrain, seed, params.mover_count, params.spot_count)
        world.boxes = boxes
        growing.worlds[i_world] = world
