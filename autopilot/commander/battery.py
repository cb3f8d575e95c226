"""Charge left in the battery, counted from current and started and corrected by voltage.

In: battery samples. Out: fraction of the capacity left and charge used. While the sensor is silent, or frozen, the last
current is counted on. Left out: temperature and ageing.
"""

from math import exp, nan

from autopilot.interface.vehicle_state import BatteryLevel
from common.airframe import Battery
from common.params import ParameterTable

_CORRECTION_TIME_S = 120.0  # the count follows the voltage this slowly; guess, longer than any load transient
_CURVE_POINTS = 201
# A voltage that says much less than the count, for longer than any load transient, is believed: the pack was not full,
# or it is failing. Guesses.
_SHORTFALL = 0.2
_SHORTFALL_US = 5_000_000
_SILENT_US = 5_000_000  # a sensor whose values have not changed for that long is not believed; guess


class BatteryEstimator:
    """Charge of one battery. `remaining` is NaN until the first sample with a voltage."""

    __slots__ = (
        "_changed_us", "_counted_us", "_current_a", "_curve_v", "_pack_mah", "_plausible_us", "_resistance_ohm",
        "_sample_us", "_voltage_v", "is_silent", "remaining", "used_mah",
    )  # fmt: skip

    def __init__(self, battery: Battery) -> None:
        self._pack_mah = battery.capacity_mah
        self._resistance_ohm = battery.internal_resistance_ohm
        empty_v = battery.cells * battery.empty_cell_v
        span_v = battery.cells * (battery.full_cell_v - battery.empty_cell_v)
        fractions = [i / (_CURVE_POINTS - 1) for i in range(_CURVE_POINTS)]
        self._curve_v = [empty_v + span_v * _rest_voltage_fraction(fraction) for fraction in fractions]
        self.restart()

    def restart(self) -> None:
        """As at power-on: the next sample's voltage says what is left."""
        self._sample_us = 0  # of the last sample
        self._changed_us = 0  # when it last differed from the one before
        self._plausible_us = 0  # when voltage and count last agreed
        self._counted_us = 0  # up to when charge has been counted
        self._voltage_v = self._current_a = 0.0
        self.is_silent = False
        self.remaining = nan  # [0..1]
        self.used_mah = 0.0

    def update(self, time_us: int, voltage_v: float, current_a: float) -> None:
        """Takes one sample."""
        if voltage_v <= 0.0 or time_us == self._sample_us:
            return
        self._sample_us = time_us
        if voltage_v != self._voltage_v or current_a != self._current_a:
            self._voltage_v, self._current_a = voltage_v, current_a
            self._changed_us = time_us
        elif time_us - self._changed_us > _SILENT_US:
            self._count(time_us)  # frozen: the voltage says nothing about the charge
            return
        by_voltage = self._charge_at(voltage_v + current_a * self._resistance_ohm)
        if self._counted_us == 0:
            self.remaining = by_voltage
            self._counted_us = self._plausible_us = time_us
            return
        dt_s = max((time_us - self._counted_us) * 1e-6, 0.0)
        self._count(time_us)
        if by_voltage > self.remaining - _SHORTFALL:
            self._plausible_us = time_us
        elif time_us - self._plausible_us > _SHORTFALL_US:
            self.remaining = by_voltage
        corrected = self.remaining + (by_voltage - self.remaining) * min(dt_s / _CORRECTION_TIME_S, 1.0)
        self.remaining = min(max(corrected, 0.0), 1.0)

    def count_on(self, now_us: int) -> None:
        """Takes note of the time: the charge of a silent sensor is counted on with its last current."""
        self.is_silent = self._counted_us != 0 and now_us - self._changed_us > _SILENT_US
        if self.is_silent:
            self._count(now_us)

    def _count(self, time_us: int) -> None:
        """Counts the current up to a time."""
        used_mah = max(self._current_a, 0.0) * max(time_us - self._counted_us, 0) * 1e-6 / 3.6
        self._counted_us = time_us
        self.used_mah += used_mah
        self.remaining = max(self.remaining - used_mah / self._pack_mah, 0.0)

    def _charge_at(self, rest_voltage_v: float) -> float:
        """Fraction of the capacity [0..1] at which the pack rests at this voltage."""
        curve = self._curve_v
        if rest_voltage_v >= curve[-1]:
            return 1.0
        if rest_voltage_v <= curve[0]:
            return 0.0
        low, high = 0, len(curve) - 1
        while high - low > 1:
            middle = (low + high) // 2
            if curve[middle] <= rest_voltage_v:
                low = middle
            else:
                high = middle
        part = (rest_voltage_v - curve[low]) / (curve[high] - curve[low])
        return (low + part) / (len(curve) - 1)


def _rest_voltage_fraction(charge: float) -> float:
    """Rest voltage between empty (0) and full (1) of a lithium polymer cell at a charge [0..1].

    M. Chen, G. A. Rincon-Mora, IEEE Trans. Energy Conversion 21(2), 2006, equation 2, scaled to [0, 1].
    """

    def cell_v(s: float) -> float:
        return -1.031 * exp(-35.0 * s) + 3.685 + 0.2156 * s - 0.1178 * s * s + 0.3201 * s**3

    return (cell_v(charge) - cell_v(0.0)) / (cell_v(1.0) - cell_v(0.0))


class VoltageLimits:
    """Voltages below which the battery counts as low or critical, whatever its charge (ArduPilot's BATT_*_VOLT).

    Args:
        params: BATT_LOW_VOLT, BATT_CRT_VOLT, BATT_LOW_TIMER; where they are missing nothing is limited.
    """

    __slots__ = ("_has_limits", "_params", "_since_us")

    def __init__(self, params: ParameterTable) -> None:
        self._params = params
        self._has_limits = "BATT_LOW_VOLT" in params
        self._since_us: dict[BatteryLevel, int] = {}  # since when the voltage has been below

    def level(self, now_us: int, voltage_v: float) -> BatteryLevel:
        """LOW or CRITICAL after the voltage has been too low for long enough; UNDEFINED otherwise."""
        level = BatteryLevel.UNDEFINED
        if not self._has_limits or voltage_v <= 0.0:
            return level
        patience_us = float(self._params["BATT_LOW_TIMER"]) * 1e6
        if patience_us <= 0.0:
            return level
        for limited, name in ((BatteryLevel.LOW, "BATT_LOW_VOLT"), (BatteryLevel.CRITICAL, "BATT_CRT_VOLT")):
            if voltage_v >= float(self._params[name]):
                self._since_us.pop(limited, None)
            elif now_us - self._since_us.setdefault(limited, now_us) >= patience_us:
                level = limited
        return level
