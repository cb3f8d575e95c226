"""Calibration of a disarmed vehicle's sensors, step by step, as PX4's ground stations follow it.

In: raw samples, once per frame. Out: offsets, as parameters, which the estimator applies at once; texts "[cal] ...",
whose wording is the protocol that QGroundControl and MAVSDK parse. Someone has to turn the vehicle for accelerometer
and magnetometer: in a simulation the host's turntable does, if there is one; a pilot may do it as well.
"""

from collections.abc import Callable, Generator
from math import asin, atan2, degrees, pi, radians, sqrt
from typing import Protocol

import numpy as np

from autopilot.interface.client_requests import CalibrationKind
from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Severity, VehicleState, Verdict
from common.geodesy import GRAVITY_M_S2
from common.params import ParameterTable

Vector = tuple[float, float, float]
Flow = Generator[None, None, None]

_STILL_RAD_S = 0.15  # faster is not at rest; guess
_AVERAGE_FRAMES = 100  # 2 s
_SIDE_TIMEOUT_FRAMES = 3000  # 60 s until somebody has turned the vehicle; guess
_SETTLE_FRAMES = 25  # at rest on a side before it counts
_SPIN_FRAMES = 300  # 6 s of turning on each side
_CANCEL_FRAMES = 50  # until "cancelled" is told: MAVSDK hangs if it hears that before its command is acknowledged
_SIDE_FRACTION = 0.85  # of gravity along an axis, from which that side is down: 32 deg
_GRAVITY_ERROR = 0.1  # fraction of gravity by which a side may differ
_FIELD_GAUSS = (0.15, 0.8)  # of the Earth, with room
_FIT_ERROR_GAUSS = 0.03  # root mean square by which the field may differ from a sphere; guess
_UPRIGHT_RAD = radians(15.0)  # a board that leans more is not level; guess

# The side that is down, in PX4's words: the axis along which gravity is felt, its sign, and how to get there
SIDES: dict[str, tuple[int, int, float, float]] = {
    "down": (2, -1, 0.0, 0.0),
    "left": (1, 1, -0.5 * pi, 0.0),
    "right": (1, -1, 0.5 * pi, 0.0),
    "front": (0, -1, 0.0, -0.5 * pi),
    "back": (0, 1, 0.0, 0.5 * pi),
    "up": (2, 1, pi, 0.0),
}


class Turntable(Protocol):
    """Somebody who turns the vehicle, a little each frame."""

    def show(self, roll_rad: float, pitch_rad: float) -> None: ...

    def spin(self) -> None:
        """Turns the vehicle about the vertical."""
        ...

    def release(self) -> None: ...


class CalibrationError(Exception):
    """A calibration cannot be finished; the message is the reason."""


class Calibrator:
    """The calibrations of one vehicle.

    Args:
        state: the vehicle as of this frame.
        params: where the results go.
        announcer: where the texts go.
        turntable: turns the vehicle; None: a pilot has to.
    """

    __slots__ = ("_announcer", "_flow", "_is_cancelled", "_params", "_state", "_table")

    def __init__(
        self, state: VehicleState, params: ParameterTable, announcer: Announcer, turntable: Turntable | None
    ) -> None:
        self._state = state
        self._params = params
        self._announcer = announcer
        self._table = turntable
        self._flow: Flow | None = None
        self._is_cancelled = False  # and about to end

    def start(self, kind: CalibrationKind) -> Reply:
        """Begins a calibration, which goes on for some frames."""
        if self._state.is_armed:
            return Reply(Verdict.TEMPORARILY_REJECTED, "the vehicle is armed")
        if self._flow is not None:
            return Reply(Verdict.TEMPORARILY_REJECTED, "another calibration is running")
        flows: dict[CalibrationKind, Callable[[], Flow]] = {
            CalibrationKind.GYRO: self._gyro,
            CalibrationKind.MAG: self._mag,
            CalibrationKind.ACCEL: self._accel,
            CalibrationKind.ACCEL_SIMPLE: self._accel_simple,
            CalibrationKind.LEVEL: self._level,
            CalibrationKind.BARO: self._baro,
        }
        self._flow = self._whole(kind.value.split()[0], flows[kind]())
        self._state.is_calibrating = True
        return ACCEPTED

    def cancel(self) -> Reply:
        """Ends the calibration that is running, if there is one; what it has found is dropped."""
        if self._flow is not None and not self._is_cancelled:
            self._flow.close()
            self._flow = self._cancelled()
            self._is_cancelled = True
        return ACCEPTED

    def set_offsets(self, sensor: str, offsets: Vector) -> None:
        """Writes the offsets of a sensor: GYRO, ACC or MAG."""
        for axis, value in zip("XYZ", offsets, strict=True):
            self._params.set(f"CAL_{sensor}0_{axis}OFF", value)

    def frame(self) -> None:
        """Carries the calibration on."""
        if self._flow is not None:
            next(self._flow, None)

    # ---- the flows: one step per frame ----

    def _whole(self, name: str, flow: Flow) -> Flow:
        self._tell(f"calibration started: 2 {name}")
        self._progress(0)
        try:
            yield from flow
        except CalibrationError as error:
            self._end(f"failed: {error}")
        else:
            self._progress(100)
            self._end(f"done: {name}")

    def _cancelled(self) -> Flow:
        for _ in range(_CANCEL_FRAMES):
            if self._table is not None:
                self._table.show(0.0, 0.0)
            yield
        self._end("cancelled")

    def _end(self, how: str) -> None:
        self._flow = None
        self._is_cancelled = False
        self._state.is_calibrating = False
        if self._table is not None:
            self._table.release()
        self._tell(f"calibration {how}")

    def _baro(self) -> Flow:
        """The estimator levels the barometer on the ground by itself: nothing is left to find."""
        yield

    def _gyro(self) -> Flow:
        gyro = yield from self._averaged(lambda: self._state.samples.imu.gyro_frd, (0, 100))
        self.set_offsets("GYRO", gyro)

    def _accel_simple(self) -> Flow:
        accel = yield from self._averaged(lambda: self._state.samples.imu.accel_frd, (0, 100))
        if _side_down(accel) != "down":
            raise CalibrationError("the vehicle is not level")
        self.set_offsets("ACC", (accel[0], accel[1], accel[2] + GRAVITY_M_S2))

    def _level(self) -> Flow:
        accel = yield from self._averaged(lambda: self._state.samples.imu.accel_frd, (0, 100))
        x, y, z = (value - float(self._params[f"CAL_ACC0_{axis}OFF"]) for value, axis in zip(accel, "XYZ", strict=True))
        roll = atan2(-y, -z)
        pitch = asin(min(max(x / sqrt(x * x + y * y + z * z), -1.0), 1.0))
        if max(abs(roll), abs(pitch)) > _UPRIGHT_RAD:
            raise CalibrationError("the vehicle is not level")
        self._params.set("SENS_BOARD_X_OFF", degrees(-roll))
        self._params.set("SENS_BOARD_Y_OFF", degrees(-pitch))

    def _accel(self) -> Flow:
        means: dict[str, Vector] = {}

        def measure(side: str, span: tuple[int, int]) -> Flow:
            means[side] = yield from self._averaged(lambda: self._state.samples.imu.accel_frd, span)

        yield from self._each_side(measure)
        offsets = []
        for axis in range(3):
            high, low = (
                next(
                    means[side][axis] for side, (along, sign, _, _) in SIDES.items() if (along, sign) == (axis, wanted)
                )
                for wanted in (1, -1)
            )
            if abs(0.5 * (high - low) - GRAVITY_M_S2) > _GRAVITY_ERROR * GRAVITY_M_S2:
                raise CalibrationError("gravity is not what it should be")
            offsets.append(0.5 * (high + low))
        self.set_offsets("ACC", (offsets[0], offsets[1], offsets[2]))

    def _mag(self) -> Flow:
        fields: list[Vector] = []

        def measure(side: str, span: tuple[int, int]) -> Flow:
            self._tell("Rotate vehicle around the vertical axis")
            for frame in range(_SPIN_FRAMES):
                if self._table is not None:
                    self._table.spin()
                yield
                if frame % 2 == 0:  # the sensor's rate
                    fields.append(self._state.samples.mag.field_frd_gauss)
                if frame % (_SPIN_FRAMES // 2) == 0:
                    self._tell(f"{side} side calibration: progress <{_between(span, frame / _SPIN_FRAMES)}>")

        yield from self._each_side(measure)
        self.set_offsets("MAG", _sphere_centre(fields))

    def _each_side(self, measure: Callable[[str, tuple[int, int]], Flow]) -> Flow:
        """Lets every side be shown once, in any order, and measures on it."""
        pending = list(SIDES)
        while pending:
            self._tell(f"pending: {' '.join(pending)}")
            self._tell("hold vehicle still on a pending side")
            side = yield from self._shown(pending)
            self._tell(f"{side} orientation detected")
            done = len(SIDES) - len(pending)
            pending.remove(side)
            span = (100 * done // len(SIDES), 100 * (done + 1) // len(SIDES))
            yield from measure(side, span)
            self._progress(span[1])
            self._tell(f"{side} side done, rotate to a different side")
        yield from self._put_down()

    def _shown(self, pending: list[str]) -> Generator[None, None, str]:
        """Waits until a pending side is down and the vehicle at rest."""
        rest_frames = 0
        for _ in range(_SIDE_TIMEOUT_FRAMES):
            if self._table is not None:
                self._table.show(*SIDES[pending[0]][2:])
            yield
            imu = self._state.samples.imu
            side = _side_down(imu.accel_frd)
            rest_frames = rest_frames + 1 if side in pending and _is_still(imu.gyro_frd) else 0
            if rest_frames >= _SETTLE_FRAMES:
                return side
        raise CalibrationError("timeout: no pending side was shown")

    def _put_down(self) -> Flow:
        if self._table is None:
            return
        for _ in range(_SIDE_TIMEOUT_FRAMES):
            self._table.show(0.0, 0.0)
            yield
            imu = self._state.samples.imu
            if _side_down(imu.accel_frd) == "down" and _is_still(imu.gyro_frd):
                return

    def _averaged(self, read: Callable[[], Vector], span: tuple[int, int]) -> Generator[None, None, Vector]:
        """The mean of a value of the IMU over two seconds at rest; `span` is the progress [%] meanwhile."""
        total = [0.0, 0.0, 0.0]
        time_us = self._state.samples.imu.time_us
        for frame in range(_AVERAGE_FRAMES):
            yield
            imu = self._state.samples.imu
            if imu.time_us == time_us:
                raise CalibrationError("reading sensor")
            time_us = imu.time_us
            if not _is_still(imu.gyro_frd):
                raise CalibrationError("the vehicle moved")
            total = [sum_ + value for sum_, value in zip(total, read(), strict=True)]
            if frame and frame % (_AVERAGE_FRAMES // 4) == 0:
                self._progress(_between(span, frame / _AVERAGE_FRAMES))
        return total[0] / _AVERAGE_FRAMES, total[1] / _AVERAGE_FRAMES, total[2] / _AVERAGE_FRAMES

    def _progress(self, percent: int) -> None:
        self._tell(f"progress <{percent}>")

    def _tell(self, text: str) -> None:
        self._announcer.statustext(Severity.INFO, f"[cal] {text}")


def _between(span: tuple[int, int], fraction: float) -> int:
    return int(span[0] + (span[1] - span[0]) * fraction)


def _is_still(gyro_frd: Vector) -> bool:
    return max(map(abs, gyro_frd)) < _STILL_RAD_S


def _side_down(accel_frd: Vector) -> str:
    """The side that is down, by the specific force at rest; empty if none is."""
    for side, (axis, sign, _, _) in SIDES.items():
        if sign * accel_frd[axis] > _SIDE_FRACTION * GRAVITY_M_S2:
            return side
    return ""


def _sphere_centre(points: list[Vector]) -> Vector:
    """The centre of the sphere nearest to the points, by linear least squares.

    Raises:
        CalibrationError: they do not lie on a sphere, or on none of the Earth's size.
    """
    field = np.array(points)
    matrix = np.column_stack([2.0 * field, np.ones(len(field))])
    solution, *_ = np.linalg.lstsq(matrix, (field * field).sum(axis=1), rcond=None)
    centre = solution[:3]
    radius = float(np.sqrt(max(solution[3] + centre @ centre, 0.0)))
    error = float(np.sqrt(np.mean((np.linalg.norm(field - centre, axis=1) - radius) ** 2)))
    if not _FIELD_GAUSS[0] < radius < _FIELD_GAUSS[1] or error > _FIT_ERROR_GAUSS:
        raise CalibrationError("the field is disturbed")
    return float(centre[0]), float(centre[1]), float(centre[2])
