"""Neighbours: the other vehicles in a world, as one of them meets and sees them.

In: where every vehicle is, written between advances by a `NeighbourTable`. Out: contact, ray hits and boxes, with the
vehicle that asks left out. What is written once is read by all until it is written again, so the order in which they
are advanced cannot matter; a neighbour goes on at the velocity it was written with. What flies is a ball, what drives
an upright box. A world of one vehicle costs one comparison.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from sim.world.boxes import Box, box_contact, box_ray_hit

wp.set_module_options({"enable_backward": False})

TICK_MASK = 0x7FFFFFFF  # of `common.rng.draw_tick`
NEAR_M = 2.0  # of gap: at 50 m/s towards each other two vehicles come nearer by 1 m in a frame
_TICK_S = wp.constant(0.004)  # common.kernels.TICK_S
_AHEAD_TICKS = wp.constant(25)  # a pose is not carried on for longer: who asks does not say what time it is
_NOWHERE_M = 1.0e7
_FLAT = wp.constant(1.0e-6)  # [m] a point this near a centre is pushed up


@wp.struct
class Neighbour:
    """One vehicle, as it was at a tick."""

    pos_ned: wp.vec3  # [m] centre of its outline
    vel_ned: wp.vec3  # [m/s]
    cos_yaw: float
    sin_yaw: float
    turn_rate: float  # [rad/s] of its heading
    half_length: float  # [m] of a box, along its heading; of a ball its radius
    half_width: float
    half_height: float
    is_ball: int
    stiffness_n_m: float  # [N/m] of its hull
    tick: int  # as `common.rng.draw_tick` counts


@wp.struct
class Neighbours:
    """All vehicles of one world, and which of them asks."""

    rows: wp.array[Neighbour]
    count: int
    i_own: int


@wp.func
def neighbour_pos(one: Neighbour, tick: int) -> wp.vec3:
    """Its centre at a tick [m]."""
    ahead = one.pos_ned
    if tick > one.tick and tick - one.tick <= _AHEAD_TICKS:
        ahead = one.pos_ned + (_TICK_S * float(tick - one.tick)) * one.vel_ned
    return ahead


@wp.func
def neighbour_box(one: Neighbour, tick: int) -> Box:
    """The box that it is at a tick, or that is round its ball."""
    pos_ned = neighbour_pos(one, tick)
    box = Box()
    box.north = pos_ned[0]
    box.east = pos_ned[1]
    box.cos_yaw = one.cos_yaw
    box.sin_yaw = one.sin_yaw
    box.half_length = one.half_length
    box.half_width = one.half_width
    box.low = -pos_ned[2] - one.half_height
    box.high = -pos_ned[2] + one.half_height
    return box


@wp.func
def neighbour_contact(one: Neighbour, tick: int, pos_ned: wp.vec3, radius: float) -> wp.vec4:
    """Contact of a sphere with one vehicle: unit push-out normal (ned), penetration [m]; negative when apart."""
    if one.is_ball == 0:
        return box_contact(neighbour_box(one, tick), 0, pos_ned, radius)
    off = pos_ned - neighbour_pos(one, tick)
    distance = wp.length(off)
    normal = wp.vec3(0.0, 0.0, -1.0)
    if distance > _FLAT:
        normal = off / distance
    return wp.vec4(normal[0], normal[1], normal[2], radius + one.half_length - distance)


@wp.func
def ball_ray_hit(centre_ned: wp.vec3, radius: float, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> float:
    """Distance [m] along a ray of unit direction to a ball, `max_m` if it is not nearer; 0 from inside it."""
    off = origin_ned - centre_ned
    along = wp.dot(off, dir_ned)
    aside = off - along * dir_ned
    spare = radius * radius - wp.length_sq(aside)
    if spare < 0.0:
        return max_m
    half = wp.sqrt(spare)
    if half - along < 0.0:
        return max_m
    return wp.min(wp.max(-along - half, 0.0), max_m)


@wp.func
def neighbour_ray_hit(one: Neighbour, tick: int, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> float:
    """Distance [m] along a ray to one vehicle, `max_m` if it is not nearer; 0 from inside it."""
    if one.is_ball == 0:
        return box_ray_hit(neighbour_box(one, tick), 0, origin_ned, dir_ned, max_m)
    return ball_ray_hit(neighbour_pos(one, tick), one.half_length, origin_ned, dir_ned, max_m)


@wp.func
def neighbours_contact(others: Neighbours, tick: int, pos_ned: wp.vec3, radius: float) -> wp.vec4:
    """Deepest contact of a sphere with the others: unit push-out normal (ned), penetration [m]; 0 for none."""
    deepest = wp.vec4(0.0, 0.0, 0.0, 0.0)
    for i in range(others.count):
        if i != others.i_own:
            contact = neighbour_contact(others.rows[i], tick, pos_ned, radius)
            if contact[3] > deepest[3]:
                deepest = contact
    return deepest


@wp.func
def neighbours_ray_hit(others: Neighbours, tick: int, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> float:
    """Distance [m] along a ray to the first of the others, `max_m` if none; 0 from inside one."""
    nearest = float(max_m)
    for i in range(others.count):
        if i != others.i_own:
            nearest = wp.min(nearest, neighbour_ray_hit(others.rows[i], tick, origin_ned, dir_ned, nearest))
    return nearest


@wp.func
def neighbour_touched(others: Neighbours, tick: int, pos_ned: wp.vec3, radius: float, depth_m: float) -> int:
    """Which of the others a sphere touches so deeply: it is what the world's deepest contact is with; -1: none."""
    touched = int(-1)
    for i in range(others.count):
        if i != others.i_own and touched < 0:
            if neighbour_contact(others.rows[i], tick, pos_ned, radius)[3] >= depth_m:
                touched = i
    return touched


@wp.func
def deck_below(others: Neighbours, tick: int, pos_ned: wp.vec3, within_m: float) -> int:
    """Which of the others, a box, is straight below a point, its top nearer than so much [m]; -1: none."""
    below = int(-1)
    for i in range(others.count):
        if i != others.i_own and others.rows[i].is_ball == 0:
            gap_m = -pos_ned[2] - neighbour_box(others.rows[i], tick).high
            if gap_m > 0.0 and gap_m < within_m and is_over_deck(others.rows[i], tick, pos_ned):
                below = i
    return below


@wp.func
def is_over_deck(one: Neighbour, tick: int, pos_ned: wp.vec3) -> bool:
    """Whether a point is within the ground plan of a box."""
    off = pos_ned - neighbour_pos(one, tick)
    ahead = one.cos_yaw * off[0] + one.sin_yaw * off[1]
    right = one.cos_yaw * off[1] - one.sin_yaw * off[0]
    return wp.abs(ahead) <= one.half_length and wp.abs(right) <= one.half_width


@wp.func
def deck_vel(one: Neighbour, tick: int, pos_ned: wp.vec3) -> wp.vec3:
    """How a point that rides on a box moves [m/s]."""
    off = pos_ned - neighbour_pos(one, tick)
    return one.vel_ned + one.turn_rate * wp.vec3(-off[1], off[0], 0.0)


@wp.func
def carries(others: Neighbours, tick: int, pos_ned: wp.vec3, top_m: float, reach_m: float) -> bool:
    """Whether something that flies is over a vehicle, whose top is so high, within its reach: it may stand there."""
    is_laden = bool(False)
    for i in range(others.count):
        if i != others.i_own and others.rows[i].is_ball == 1:
            off = neighbour_pos(others.rows[i], tick) - pos_ned
            gap_m = -off[2] - top_m
            if (
                gap_m > 0.0
                and gap_m < others.rows[i].half_length
                and off[0] * off[0] + off[1] * off[1] < reach_m * reach_m
            ):
                is_laden = True
    return is_laden


@dataclass(frozen=True, slots=True)
class Outline:
    """What others meet of a vehicle: a ball, or a box about a point of its own."""

    half_size_m: tuple[float, float, float]
    """Half length, half width, half height [m]; of a ball its radius three times."""
    is_ball: bool
    stiffness_n_m: float
    """Of its hull [N/m]."""
    ahead_m: float = 0.0
    """The middle of the box from the centre of gravity [m]."""
    above_m: float = 0.0


def ball_outline(model: Any) -> Outline:
    """Of bodies that touch obstacles with the ball of their `ContactModel`.

    Args:
        model: one row of the body's `Model`.
    """
    contact = model["contact"]
    return Outline((float(contact["hull_radius_m"]),) * 3, True, 4.0 * float(contact["normal_n_m"]))  # as four feet


class NeighbourTable:
    """Where all vehicles of one world are.

    Args:
        count: how many there will be.
    """

    def __init__(self, count: int) -> None:
        self._array = wp.zeros(count, dtype=Neighbour, device="cpu")
        self._rows: NDArray[np.void] = self._array.numpy()
        self._rows["pos_ned"][:, 0] = _NOWHERE_M * (1.0 + np.arange(count))  # nobody yet
        self._vehicles: dict[int, tuple[NDArray[np.void], NDArray[np.int64], Outline]] = {}

    def seen_by(self, i_vehicle: int) -> Neighbours:
        """The others, as vehicle `i_vehicle` reads them."""
        seen = Neighbours()
        seen.rows, seen.count, seen.i_own = self._array, len(self._rows), i_vehicle
        return seen

    def join(self, i_vehicle: int, truth: NDArray[np.void], tick: NDArray[np.int64], outline: Outline) -> None:
        """A vehicle is there from now on.

        Args:
            i_vehicle: which.
            truth: live rows of `Truth`, of which the first is the vehicle's.
            tick: live ticks since power-on, likewise.
            outline: what others meet of it.
        """
        self._vehicles[i_vehicle] = (truth, tick, outline)
        row = self._rows[i_vehicle]
        row["half_length"], row["half_width"], row["half_height"] = outline.half_size_m
        row["is_ball"], row["stiffness_n_m"] = outline.is_ball, outline.stiffness_n_m
        self.write((i_vehicle,))

    def write(self, vehicles: Any = None) -> None:
        """Writes where vehicles are now, all of them or those given; nobody may be advancing meanwhile."""
        rows = self._rows
        for i in self._vehicles if vehicles is None else vehicles:
            truth, tick, outline = self._vehicles[i]
            now = truth[0]
            x, y, z, w = now["q_ned_from_frd"].tolist()
            cos_yaw, sin_yaw = 1.0 - 2.0 * (y * y + z * z), 2.0 * (w * z + x * y)
            length = (cos_yaw * cos_yaw + sin_yaw * sin_yaw) ** 0.5 or 1.0
            cos_yaw, sin_yaw = cos_yaw / length, sin_yaw / length
            north, east, down = now["pos_ned"].tolist()
            ahead = outline.ahead_m
            rows["pos_ned"][i] = (north + ahead * cos_yaw, east + ahead * sin_yaw, down - outline.above_m)
            rows["vel_ned"][i] = now["vel_ned"]
            rows["cos_yaw"][i], rows["sin_yaw"][i] = cos_yaw, sin_yaw
            rows["turn_rate"][i] = now["omega_frd"][2]
            rows["tick"][i] = int(tick[0]) & TICK_MASK

    def near(self) -> set[int]:
        """The vehicles that another may touch before a frame of 20 ms is over."""
        pos_ned = self._rows["pos_ned"].astype(np.float64)
        reach = np.sqrt(self._rows["half_length"] ** 2 + self._rows["half_width"] ** 2 + self._rows["half_height"] ** 2)
        gap = np.linalg.norm(pos_ned[:, None] - pos_ned[None], axis=-1) - reach[:, None] - reach[None]
        np.fill_diagonal(gap, np.inf)
        return set(np.flatnonzero((gap < NEAR_M).any(axis=1)).tolist())
