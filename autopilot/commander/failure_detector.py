"""The failure watch: what is wrong at this moment, as bits of `failsafe`, each frame while armed.

In: the vehicle's state, the battery's charge, the age of links and streams. Out: bits; what to do about them is the
guard's. Slow things (wind, time, the ground station) are looked at five times a second.
"""

from math import hypot, isnan

from autopilot.commander.battery import BatteryEstimator, VoltageLimits
from autopilot.commander.crash_detector import AttitudeWatch
from autopilot.commander.failsafe import (
    ACCEL_DOUBTED,
    BATTERY_CRITICAL,
    BATTERY_EMERGENCY,
    BATTERY_LOW,
    BATTERY_SILENT,
    COMPASS_FAULTY,
    DEAD_RECKONING,
    ESTIMATOR_FAILED,
    FENCE_BREACHED,
    FLIGHT_TIME_NEAR,
    FLIGHT_TIME_OVER,
    HEIGHT_LOST,
    MOTOR_FAILED,
    OFFBOARD_LOST,
    POSITION_LOST,
    STATION_LOST,
    STUCK,
    TRAFFIC_NEAR,
    WIND_HIGH,
    WIND_STRONG,
)
from autopilot.commander.navigator_interface import Flying
from autopilot.interface.mode_spec import ModeTable
from autopilot.interface.vehicle_state import BatteryLevel, LandedState, VehicleState
from autopilot.ports import ACCEL_DOUBTED as ACCEL_DOUBTED_FLAG
from autopilot.ports import DEAD_RECKONING as DEAD_RECKONING_FLAG
from autopilot.ports import HEIGHT_VALID, MAG_FAULTY, WIND_VALID
from autopilot.vehicles.vehicle_class import DriveWatch
from common.params import Parameter, ParameterTable

_SLOW_PERIOD_US = 200_000
_WIND_EASED = 0.8  # fraction of a limit below which the wind counts as over; gusts would toggle it otherwise; guess
_WIND_TIME_S = 2.0  # gusts shorter than that do not count; guess
_TIME_NEAR_FRACTION = 0.9  # of COM_FLT_TIME_MAX, from which the pilot is told (PX4)
_FIX_STEADY_US = 3_000_000  # after dead reckoning, GNSS counts as used again after so long; guess
# An estimate that is set anew so often is not to be believed: a sensor contradicts the others. Guesses.
_RESETS_MAX = 3
_RESETS_WITHIN_US = 30_000_000
_RESET_M = 3.0  # smaller jumps do no harm
_BATTERY_BITS = {
    BatteryLevel.LOW: BATTERY_LOW,
    BatteryLevel.CRITICAL: BATTERY_LOW | BATTERY_CRITICAL,
    BatteryLevel.EMERGENCY: BATTERY_LOW | BATTERY_CRITICAL | BATTERY_EMERGENCY,
}


class StationLink:
    """Whether a ground station is there: heartbeats of type GCS, on any link."""

    __slots__ = ("heard_us",)

    def __init__(self) -> None:
        self.heard_us = -1  # of the last heartbeat; -1: there has never been a ground station

    def heard(self, time_us: int) -> None:
        """Takes note of a heartbeat."""
        self.heard_us = time_us


class FailureWatch:
    """What is wrong with one vehicle.

    Args:
        state: the vehicle as of this frame.
        params: COM_*, BAT_*, BATT_*, FD_*.
        battery: the charge estimator.
        station: when a ground station was heard.
        motors: the motor watch, if there is one.
        modes: those that the vehicle has.
        leans: whether it is told how to lean.
    """

    __slots__ = (
        "_attitude", "_battery", "_battery_bits", "_battery_critical", "_battery_emergency", "_battery_low",
        "_except_bits", "_is_position_lost", "_modes", "_motors", "_next_slow_us", "_offboard_loss_us", "_params",
        "_reckoning_us", "_resets_us", "_slow", "_state", "_station", "_station_loss_us", "_time_max_us", "_voltage",
        "_wind_max", "_wind_speed", "_wind_warn", "airborne_us",
    )  # fmt: skip

    def __init__(
        self,
        state: VehicleState,
        params: ParameterTable,
        battery: BatteryEstimator,
        station: StationLink,
        motors: DriveWatch | None,
        modes: ModeTable,
        *,
        leans: bool,
    ) -> None:
        self._state = state
        self._params = params
        self._battery = battery
        self._station = station
        self._motors = motors
        self._modes = modes
        self._attitude = AttitudeWatch(params, leans=leans)
        self._voltage = VoltageLimits(params)
        self._wind_speed = 0.0  # [m/s] low-passed
        self.reset()
        self._load()
        params.on_change(self._on_parameter)

    def reset(self) -> None:
        """The vehicle has just been armed."""
        self._attitude.reset()
        if self._motors is not None:
            self._motors.reset()
        self._next_slow_us = 0
        self._reckoning_us = -_FIX_STEADY_US  # when GNSS was last missed
        self._resets_us: list[int] = []  # when the estimate was last set anew
        self._is_position_lost = False
        self._battery_bits = 0  # the worst charge since arming
        self._slow = 0  # bits of the slow checks
        self._wind_speed = 0.0
        self.airborne_us = -1  # when it left the ground; -1: it has not yet

    def note_reset(self, jump_m: float) -> None:
        """The estimate of a flying vehicle has jumped."""
        if jump_m > _RESET_M:
            self._resets_us = [*self._resets_us[1 - _RESETS_MAX :], self._state.time_us]

    def frame(self, dt_s: float, flying: Flying, *, has_position: bool, needs_position: bool) -> int:
        """All that is wrong now; for an armed vehicle."""
        state = self._state
        mode = state.mode
        is_flying = state.landed_state is not LandedState.ON_GROUND
        failures = self._attitude.update(state, dt_s)
        if self._motors is not None:
            if self._motors.has_failure():
                failures |= MOTOR_FAILED
            if self._motors.is_stuck():
                failures |= STUCK
        if is_flying and self._battery.is_silent:
            failures |= BATTERY_SILENT
        if is_flying and state.fence.breached:
            failures |= FENCE_BREACHED
        # Once lost it stays so until it is back, although landing blindly needs none
        self._is_position_lost = not has_position and (needs_position or self._is_position_lost)
        if self._is_position_lost:
            failures |= POSITION_LOST
        if flying.stream_age_us() > self._offboard_loss_us:
            failures |= OFFBOARD_LOST
        if self._modes[mode].needs_height and not state.estimate.flags & HEIGHT_VALID:
            failures |= HEIGHT_LOST
        if state.battery_level > BatteryLevel.OK:
            self._battery_bits |= _BATTERY_BITS[state.battery_level]
        failures |= self._battery_bits  # in flight a charge does not come back (PX4)
        if state.time_us >= self._next_slow_us:
            self._next_slow_us = state.time_us + _SLOW_PERIOD_US
            self._slow = self._slow_failures(is_flying)
        return failures | self._slow

    def judge_battery(self, voltage_v: float) -> None:
        """Renews the level of the charge; armed or not."""
        remaining = self._battery.remaining
        state = self._state
        state.battery_remaining = remaining
        state.battery_used_mah = self._battery.used_mah
        level = BatteryLevel.UNDEFINED if isnan(remaining) else BatteryLevel.OK
        if remaining < self._battery_low:
            level = BatteryLevel.LOW
            if remaining < self._battery_critical:
                level = BatteryLevel.CRITICAL
            if remaining < self._battery_emergency:
                level = BatteryLevel.EMERGENCY
        state.battery_level = max(level, self._voltage.level(state.time_us, voltage_v))

    @property
    def misses_station(self) -> bool:
        """Whether there was a ground station, is none now, and the mode is not excepted."""
        state, heard_us = self._state, self._station.heard_us
        is_lost = heard_us >= 0 and state.time_us - heard_us > self._station_loss_us
        return is_lost and not self._modes[state.mode].exception & self._except_bits

    def _slow_failures(self, is_flying: bool) -> int:
        state = self._state
        bits = 0
        if is_flying and state.traffic_conflict_us > state.time_us and self._params["NAV_TRAFF_AVOID"]:
            bits |= TRAFFIC_NEAR
        if self.misses_station:
            bits |= STATION_LOST
        if state.estimate.flags & DEAD_RECKONING_FLAG and (is_flying or self._slow & DEAD_RECKONING):
            self._reckoning_us = state.time_us
        if state.time_us - self._reckoning_us < _FIX_STEADY_US:
            bits |= DEAD_RECKONING
        if state.estimate.flags & ACCEL_DOUBTED_FLAG:
            bits |= ACCEL_DOUBTED
        if state.estimate.flags & MAG_FAULTY:
            bits |= COMPASS_FAULTY
        if not is_flying:
            return bits
        if self.airborne_us < 0:
            self.airborne_us = state.time_us
        bits |= self._wind_failures()
        flown_us = state.time_us - self.airborne_us
        if self._time_max_us > 0 and flown_us > _TIME_NEAR_FRACTION * self._time_max_us:
            bits |= FLIGHT_TIME_OVER | FLIGHT_TIME_NEAR if flown_us > self._time_max_us else FLIGHT_TIME_NEAR
        if len(self._resets_us) == _RESETS_MAX and state.time_us - self._resets_us[0] < _RESETS_WITHIN_US:
            bits |= ESTIMATOR_FAILED
        return bits

    def _wind_failures(self) -> int:
        estimate = self._state.estimate
        if self._wind_max <= 0.0 and self._wind_warn <= 0.0:
            return 0
        if estimate.flags & WIND_VALID:
            speed = hypot(estimate.wind_ned[0], estimate.wind_ned[1])
            self._wind_speed += (speed - self._wind_speed) * min(_SLOW_PERIOD_US * 1e-6 / _WIND_TIME_S, 1.0)
        bits = 0
        for bit, limit in ((WIND_HIGH, self._wind_max), (WIND_STRONG, self._wind_warn)):
            fraction = _WIND_EASED if self._slow & bit else 1.0
            if limit > 0.0 and self._wind_speed > fraction * limit:
                bits |= bit
        return bits

    def _load(self) -> None:
        params = self._params
        self._offboard_loss_us = int(params["COM_OF_LOSS_T"] * 1e6)
        self._station_loss_us = int(params["COM_DL_LOSS_T"] * 1e6)
        self._except_bits = int(params["COM_DLL_EXCEPT"])
        self._battery_low = float(params["BAT_LOW_THR"])
        self._battery_critical = float(params["BAT_CRIT_THR"])
        self._battery_emergency = float(params["BAT_EMERGEN_THR"])
        self._wind_max = float(params["COM_WIND_MAX"])
        self._wind_warn = float(params["COM_WIND_WARN"])
        self._time_max_us = int(params["COM_FLT_TIME_MAX"] * 1e6)

    def _on_parameter(self, parameter: Parameter) -> None:
        if parameter.name.startswith(("COM_", "BAT_")):
            self._load()
