"""What a setpoint asks for near the ground: to leave it, to stay, or to stand on it.

In: a setpoint of any mode, the estimate. Out: the answer, by which ground contact is acted on, the same in every mode.
"""

from enum import IntEnum
from math import hypot, nan
from typing import Any, Protocol

from autopilot.interface.vehicle_state import VehicleState
from autopilot.navigator.setpoint import Vector
from autopilot.ports import SETPOINT_ATTITUDE, SETPOINT_IDLE, SETPOINT_RATE, TERRAIN_VALID

NEAR_START_M = 30.0  # the ground level where it last stood is trusted this far around; guess
_ROUGH_M = 3.0  # ground farther above or below than this is not believed near there: a range finder can lie; guess
_STAND_M = 0.05  # a position lower than this above standing height is on the ground; guess
_LIFT_M = 0.1  # a position this far above the vehicle asks to climb
_SPEED_M_S = 0.05  # vertical speed below which a setpoint asks to stay
_NEAR_M = 2.0  # a position on the ground farther away than this is still to be reached; guess
LIFT_FRACTION = 0.5  # of the hover thrust from which a thrust setpoint asks to climb; above LandingDetector's shares


class Ask(IntEnum):
    """Vertically, what a setpoint asks for."""

    UP = -1
    STAY = 0
    DOWN = 1  # to sink, or to be on the ground


class Wanted(Protocol):
    """What a setpoint port and an offboard setpoint have in common."""

    @property
    def kind(self) -> int: ...
    @property
    def pos_ned(self) -> Vector: ...
    @property
    def vel_ned(self) -> Vector: ...
    @property
    def accel_ned(self) -> Vector: ...
    @property
    def thrust(self) -> float: ...


def standing_d(state: VehicleState, standing_height_m: float) -> float:
    """Down coordinate [m] at which the vehicle stands on the ground below; NaN: not known."""
    estimate = state.estimate
    stand, here = state.stand_ned, estimate.pos_ned
    known_d = stand[2] if stand is not None and is_near_start(state, here[0], here[1]) else nan
    if not estimate.flags & TERRAIN_VALID:
        return known_d
    measured_d: float = estimate.terrain_d - standing_height_m
    return known_d if abs(measured_d - known_d) > _ROUGH_M else measured_d  # NaN: measured


def is_near_start(state: VehicleState, north: float, east: float) -> bool:
    """Whether the ground here is about as high as where the vehicle last stood."""
    stand = state.stand_ned
    return stand is not None and hypot(north - stand[0], east - stand[1]) <= NEAR_START_M


def vertical_ask(wanted: Wanted, estimate: Any, stand_d: float, lift_thrust: float) -> Ask:
    """What a setpoint asks for.

    Args:
        wanted: the setpoint.
        estimate: the Estimate record.
        stand_d: [m] down coordinate at which the vehicle stands, NaN: no position counts as being on the ground.
        lift_thrust: [0..1] thrust that carries the vehicle.
    """
    if wanted.kind == SETPOINT_IDLE:
        return Ask.STAY
    if wanted.kind in (SETPOINT_ATTITUDE, SETPOINT_RATE):
        return Ask.UP if wanted.thrust > LIFT_FRACTION * lift_thrust else Ask.DOWN
    north, east, down = wanted.pos_ned
    if down == down:
        here = estimate.pos_ned
        if down > stand_d - _STAND_M and not hypot(north - here[0], east - here[1]) > _NEAR_M:  # NaN: here
            return Ask.DOWN
        return Ask.UP if down < here[2] - _LIFT_M else Ask.STAY
    speed = wanted.vel_ned[2]
    if speed != speed:
        speed = wanted.accel_ned[2]  # the sign is all that matters
    if speed > _SPEED_M_S:
        return Ask.DOWN
    return Ask.UP if speed < -_SPEED_M_S else Ask.STAY
