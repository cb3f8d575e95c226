"""The setpoint row: the one position where missions, offboard clients and failsafes say what the vehicle shall do.

In: calls of the navigator's modes. Out: the live kernel row `Setpoint` (autopilot.ports), packed at once per frame and
only if something changed. The control part limits and smooths what is asked here.
"""

import struct
from math import cos, inf, isfinite, nan, sin
from typing import Any

import numpy as np

from autopilot.interface.client_requests import OffboardSetpoint
from autopilot.ports import (
    SETPOINT_ATTITUDE,
    SETPOINT_DRIVE,
    SETPOINT_IDLE,
    SETPOINT_LEAN,
    SETPOINT_RATE,
    SETPOINT_STICKS,
    SETPOINT_TRAJECTORY,
)
from common.kernels import MAX_MOTORS

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]  # x, y, z, w
FREE: Vector = (nan, nan, nan)
_NOT_HOLDING_M_S = 0.01
_LARGEST = 1.0e9  # its square is within single precision
_LEVEL_NORTH = (0.0, 0.0, 0.0, 1.0)
_LAYOUT = f"<3i{31 + MAX_MOTORS}f"  # kind, is_armed, is_landed, then the floats of autopilot.ports.Setpoint
_FIELDS = (
    "kind", "is_armed", "is_landed", "pos_ned", "vel_ned", "accel_ned", "yaw", "yaw_rate", "path_start_ned",
    "cruise_speed", "climb_speed", "descend_speed", "exit_speed", "pass_radius", "q_ned_from_frd", "omega_frd",
    "thrust", "speed", "steering", "ahead_max", "back_max", "motor_test",
)  # fmt: skip


class SetpointPort:
    """One vehicle's setpoint; `write` copies it to the kernel row.

    Args:
        row: live structured view of length 1 of the kernel's `Setpoint` rows.
    """

    __slots__ = (
        "_buffer", "_is_changed", "_motor_test", "_pack_into", "_press_speed", "_room", "_settling", "accel_ned",
        "climb_speed", "cruise_speed", "descend_speed", "exit_speed", "is_armed", "is_landed", "is_reversed", "kind",
        "omega_frd", "pass_radius", "path_start_ned", "pos_ned", "q_ned_from_frd", "speed", "steering", "thrust",
        "vel_ned", "yaw", "yaw_rate",
    )  # fmt: skip

    def __init__(self, row: np.ndarray[Any, Any]) -> None:
        layout = struct.Struct(_LAYOUT)
        if row.shape != (1,) or row.dtype.names != _FIELDS or row.dtype.itemsize != layout.size:
            raise ValueError("the setpoint must be a view of one row of autopilot.ports.Setpoint")
        self._buffer: Any = row.view(np.uint8).reshape(-1)
        self._pack_into = layout.pack_into
        self._is_changed = True
        self._motor_test: tuple[float, ...] = (0.0,) * MAX_MOTORS
        self.is_armed = False
        self.is_landed = True
        self._room = (0.0, 0.0)  # ahead, back, as the law takes them
        self.is_reversed = False  # ways are driven backwards, by what can
        self._settling: tuple[float, float] | None = None  # thrust [0..1] and heading [rad]
        self._press_speed = 0.0  # [m/s]
        self.kind: int = SETPOINT_IDLE
        self.pos_ned: Vector = FREE
        self.vel_ned: Vector = FREE
        self.omega_frd: Vector = FREE
        self.yaw_rate = nan
        self.speed = self.steering = nan
        self._free_all()

    def set_flags(self, *, is_armed: bool, is_landed: bool) -> None:
        """Tells the control part whether to turn the motors, and whether to keep its integrators reset."""
        if is_armed is not self.is_armed or is_landed is not self.is_landed:
            self.is_armed = is_armed
            self.is_landed = is_landed
            self._is_changed = True

    def leave_room(self, ahead_max: float, back_max: float) -> None:
        """Bounds the speeds along the nose and backwards [m/s]; inf: any."""
        room = (_room_written(ahead_max), _room_written(back_max))
        if room != self._room:
            self._room = room
            self._is_changed = True

    @property
    def is_backing(self) -> bool:
        """Whether it is asked to go backwards: by its speed, or on its way."""
        return self.is_reversed or self.speed < 0.0

    def idle(self) -> None:
        """Asks for nothing: motors at idle when armed."""
        if self.kind != SETPOINT_IDLE:
            self._free_all()
            self.kind = SETPOINT_IDLE

    def fly_to(
        self,
        pos_ned: Vector,
        yaw: float,
        *,
        path_start_ned: Vector = FREE,
        cruise_speed: float = nan,
        climb_speed: float = nan,
        descend_speed: float = nan,
        exit_speed: float = 0.0,
        pass_radius: float = 0.0,
    ) -> None:
        """Asks for a position [m]: on the straight line from `path_start_ned` if that is finite."""
        self._free_all()
        self.kind = SETPOINT_TRAJECTORY
        self.pos_ned = pos_ned
        self.yaw = yaw
        self.path_start_ned = path_start_ned
        self.cruise_speed = cruise_speed
        self.climb_speed = climb_speed
        self.descend_speed = descend_speed
        self.exit_speed = exit_speed
        self.pass_radius = pass_radius

    def track(self, pos_ned: Vector, vel_ned: Vector, yaw: float, yaw_rate: float = nan) -> None:
        """Asks for a position [m] that moves with a velocity [m/s]; renewed each frame."""
        self._free_all()
        self.kind = SETPOINT_TRAJECTORY
        self.pos_ned = pos_ned
        self.vel_ned = vel_ned
        self.yaw = yaw
        self.yaw_rate = yaw_rate

    def track_down(self, position: tuple[float, float], vel_ned: Vector, speed_down: float, yaw: float) -> None:
        """Asks for a vertical speed [m/s] over a position [m] that moves with a velocity [m/s]; renewed each frame."""
        self.track((position[0], position[1], nan), (vel_ned[0], vel_ned[1], speed_down), yaw)

    def drift(self, vel_north: float, vel_east: float, down: float, yaw: float) -> None:
        """Asks for a horizontal velocity [m/s] and a height [m]."""
        self._free_all()
        self.kind = SETPOINT_TRAJECTORY
        self.pos_ned = (nan, nan, down)
        self.vel_ned = (vel_north, vel_east, nan)
        self.yaw = yaw

    def descend_at(self, north: float, east: float, speed_down: float, yaw: float, cruise_speed: float = nan) -> None:
        """Asks for a vertical speed [m/s] over a position [m]."""
        if (
            self.kind == SETPOINT_TRAJECTORY
            and self.vel_ned[2] == speed_down
            and self.pos_ned[0] == north
            and self.pos_ned[1] == east
            and (self.yaw == yaw or yaw != yaw)
        ):
            return
        self._free_all()
        self.kind = SETPOINT_TRAJECTORY
        self.pos_ned = (north, east, nan)
        self.vel_ned = (nan, nan, speed_down)
        self.yaw = yaw
        self.cruise_speed = cruise_speed

    def descend_braking(self, speed_down: float, yaw: float) -> None:
        """Asks for a vertical speed [m/s] without moving over ground: the position is lost, the velocity is not.

        The horizontal speed is not quite zero: the control part would hold the position then, and chase a position that
        jumps about by decimetres once nothing measures it.
        """
        self._free_all()
        self.kind = SETPOINT_TRAJECTORY
        self.vel_ned = (_NOT_HOLDING_M_S, _NOT_HOLDING_M_S, speed_down)
        self.yaw = yaw

    def descend_level(self, speed_down: float, yaw: float) -> None:
        """Asks for a vertical speed [m/s] with level attitude: what remains when the position is not known."""
        self._free_all()
        self.kind = SETPOINT_TRAJECTORY
        self.vel_ned = (nan, nan, speed_down)
        self.accel_ned = (0.0, 0.0, nan)
        self.yaw = yaw

    def hover_level(self, thrust: float, yaw: float) -> None:
        """Asks for level attitude and a thrust [0..1]: what remains when the height is not known either."""
        self._free_all()
        self.kind = SETPOINT_ATTITUDE
        self.q_ned_from_frd = (0.0, 0.0, sin(0.5 * yaw), cos(0.5 * yaw))
        self.thrust = thrust

    def glide(
        self, pos_ned: Vector, path_start_ned: Vector, speed_down: float, *, airspeed: float, throttle: float
    ) -> None:
        """Asks a plane for a line, at the height of its end [m] that moves down [m/s]; NaN throttle: as needed."""
        self.fly_to(pos_ned, nan, path_start_ned=path_start_ned, cruise_speed=airspeed)
        self.vel_ned = (nan, nan, speed_down)
        self.thrust = throttle

    # ---- what a pilot asks for: called each frame, written only if something changed ----

    def move(self, vel_ned: Vector, yaw_rate: float) -> None:
        """Asks for a velocity [m/s] and a yaw rate [rad/s]; the position is held where the velocity is zero."""
        if self.kind == SETPOINT_TRAJECTORY and self.vel_ned == vel_ned and self.yaw_rate == yaw_rate:
            return
        self._free_all()
        self.kind = SETPOINT_TRAJECTORY
        self.vel_ned = vel_ned
        self.yaw_rate = yaw_rate

    def lean(self, q_level_from_frd: Quaternion, speed_down: float, yaw_rate: float) -> None:
        """Asks for roll and pitch, a vertical speed [m/s] (0 holds the height) and a yaw rate [rad/s]."""
        if (
            self.kind == SETPOINT_LEAN
            and self.q_ned_from_frd == q_level_from_frd
            and self.vel_ned[2] == speed_down
            and self.yaw_rate == yaw_rate
        ):
            return
        self._free_all()
        self.kind = SETPOINT_LEAN
        self.q_ned_from_frd = q_level_from_frd
        self.accel_ned = (0.0, 0.0, nan)  # over ground the trajectory goes along with the vehicle
        self.vel_ned = (nan, nan, speed_down)
        self.yaw_rate = yaw_rate

    def tilt(self, q_level_from_frd: Quaternion, yaw_rate: float, thrust: float) -> None:
        """Asks for roll and pitch, a yaw rate [rad/s] and a thrust [0..1]."""
        if (
            self.kind == SETPOINT_ATTITUDE
            and self.q_ned_from_frd == q_level_from_frd
            and self.yaw_rate == yaw_rate
            and self.thrust == thrust
        ):
            return
        self._free_all()
        self.kind = SETPOINT_ATTITUDE
        self.q_ned_from_frd = q_level_from_frd
        self.yaw_rate = yaw_rate
        self.thrust = thrust

    def turn(self, omega_frd: Vector, thrust: float) -> None:
        """Asks for body rates [rad/s] and a thrust [0..1]."""
        if self.kind == SETPOINT_RATE and self.omega_frd == omega_frd and self.thrust == thrust:
            return
        self._free_all()
        self.kind = SETPOINT_RATE
        self.omega_frd = omega_frd
        self.thrust = thrust

    def move_surfaces(self, roll: float, pitch: float, yaw: float, throttle: float) -> None:
        """Asks a plane for ailerons, elevator and rudder [-1..1], and a throttle [0..1]."""
        self._free_all()
        self.kind = SETPOINT_STICKS
        self.omega_frd = (roll, pitch, yaw)
        self.thrust = throttle

    def drive(
        self,
        *,
        speed: float = nan,
        throttle: float = nan,
        yaw: float = nan,
        yaw_rate: float = nan,
        steering: float = nan,
    ) -> None:
        """Asks for a speed along the nose [m/s] or a throttle [-1..1], and where to: by one of the other three.

        Args:
            speed: [m/s] negative backwards.
            throttle: [-1..1] where the speed is NaN.
            yaw: [rad] heading of the nose.
            yaw_rate: [rad/s] where the heading is NaN; with it, added to what the heading asks for.
            steering: [-1..1] to the right, where both are NaN.
        """
        asked = (speed, throttle, yaw, yaw_rate, steering)
        if self.kind == SETPOINT_DRIVE and asked == (self.speed, self.thrust, self.yaw, self.yaw_rate, self.steering):
            return
        self._free_all()
        self.kind = SETPOINT_DRIVE
        self.speed, self.thrust, self.yaw, self.yaw_rate, self.steering = asked

    def follow(self, setpoint: OffboardSetpoint, cruise_speed: float) -> None:
        """Asks for what an external client sent."""
        self._free_all()
        self.kind = setpoint.kind
        self.pos_ned = setpoint.pos_ned
        self.vel_ned = setpoint.vel_ned
        self.accel_ned = setpoint.accel_ned
        self.yaw = setpoint.yaw
        self.yaw_rate = setpoint.yaw_rate
        self.q_ned_from_frd = setpoint.q_ned_from_frd
        self.omega_frd = setpoint.omega_frd
        self.thrust = setpoint.thrust
        self.cruise_speed = cruise_speed

    # ---- near the ground, instead of what the mode asks; the mode's own setpoint is kept ----

    def as_asked(self) -> None:
        """From now on what the mode asks is written again."""
        if self._settling or self._press_speed:
            self._settling = None
            self._press_speed = 0.0
            self._is_changed = True

    def settle(self, thrust: float, yaw: float) -> None:
        """From now on: level attitude and a thrust [0..1] under which the vehicle settles on its feet."""
        self._settling = (thrust, yaw)
        self._is_changed = True

    def press(self, speed_down: float) -> None:
        """From now on: down to the ground with a speed [m/s], over the position that the mode asks for."""
        if self._settling or self._press_speed != speed_down:
            self._settling = None
            self._press_speed = speed_down
            self._is_changed = True

    def test_motors(self, commands: tuple[float, ...]) -> None:
        """From now on, while disarmed: the commands [0..1] of the motors."""
        if commands != self._motor_test:
            self._motor_test = commands
            self._is_changed = True

    def set_yaw(self, yaw: float) -> None:
        """Changes the heading [rad] of the setpoint being flown."""
        self.yaw = yaw
        self._is_changed = True

    def set_speeds(self, cruise: float, climb: float, descend: float) -> None:
        """Changes the speeds [m/s] of the setpoint being flown."""
        self.cruise_speed, self.climb_speed, self.descend_speed = cruise, climb, descend
        self._is_changed = True

    def write(self) -> None:
        """Copies the setpoint to the kernel row if it changed."""
        if not self._is_changed:
            return
        self._is_changed = False
        kind, q_ned_from_frd, thrust, yaw_rate = self.kind, self.q_ned_from_frd, self.thrust, self.yaw_rate
        pos_ned, vel_ned, path_start_ned = self.pos_ned, self.vel_ned, self.path_start_ned
        if self._settling:
            kind = SETPOINT_ATTITUDE
            thrust, yaw = self._settling
            q_ned_from_frd, yaw_rate = (0.0, 0.0, sin(0.5 * yaw), cos(0.5 * yaw)), nan
        elif self._press_speed:
            pos_ned = (pos_ned[0], pos_ned[1], nan)
            vel_ned = (vel_ned[0], vel_ned[1], self._press_speed)
            path_start_ned = FREE
        flags = (kind, self.is_armed, self.is_landed)
        values = (
            *pos_ned, *vel_ned, *self.accel_ned, self.yaw,
            yaw_rate, *path_start_ned, self._cruise_speed_written(), self.climb_speed, self.descend_speed,
            self.exit_speed, self.pass_radius,
            *q_ned_from_frd, *self.omega_frd, thrust, self.speed, self.steering,
            *self._room, *self._motor_test,
        )  # fmt: skip
        try:
            self._pack_into(self._buffer, 0, *flags, *values)
        except (
            OverflowError
        ):  # beyond single precision; who asks has failed to bound it, and is flown as far as it goes
            self._pack_into(self._buffer, 0, *flags, *(min(max(value, -_LARGEST), _LARGEST) for value in values))

    def _cruise_speed_written(self) -> float:
        """[m/s] as the law takes it: negative is backwards."""
        if not self.is_reversed:
            return self.cruise_speed
        return -abs(self.cruise_speed) if isfinite(self.cruise_speed) else -_LARGEST

    def set_reversed(self, is_reversed: bool) -> None:
        """Whether ways are driven backwards from now on, by what can."""
        self.is_reversed = is_reversed
        self._is_changed = True

    def _free_all(self) -> None:
        self._is_changed = True
        self.pos_ned = self.vel_ned = self.accel_ned = self.path_start_ned = self.omega_frd = FREE
        self.q_ned_from_frd = _LEVEL_NORTH
        self.yaw = self.yaw_rate = self.cruise_speed = self.climb_speed = self.descend_speed = self.thrust = nan
        self.speed = self.steering = nan
        self.exit_speed = self.pass_radius = 0.0


def _room_written(speed: float) -> float:
    """A bound [m/s] as the law takes it: 0 is any, so that rows of zeros bound nothing; negative is none."""
    return 0.0 if speed == inf else speed or -1.0
