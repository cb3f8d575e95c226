"""Charge left in the battery, counted from current and started and corrected by voltage.

In: battery samples. Out: share of the capacity left and charge used. Left out: temperature and ageing.
"""

from math import exp, nan

from common.airframe import Battery

_CORRECTION_TIME_S = 120.0  # the count follows the voltage this slowly; guess, longer than any load transient
_CURVE_POINTS = 201


class BatteryEstimator:
    """Charge of one battery. `remaining` is NaN until the first sample with a voltage."""

    __slots__ = ("_curve_v", "_last_us", "_pack_mah", "_resistance_ohm", "remaining", "used_mah")

    def __init__(self, battery: Battery) -> None:
        self._pack_mah = battery.capacity_mah
        self._resistance_ohm = battery.internal_resistance_ohm
        empty_v = battery.cells * battery.empty_cell_v
        span_v = battery.cells * (battery.full_cell_v - battery.empty_cell_v)
        shares = [i / (_CURVE_POINTS - 1) for i in range(_CURVE_POINTS)]
        self._curve_v = [empty_v + span_v * _rest_voltage_share(share) for share in shares]
        self._last_us = 0
        self.remaining = nan  # [0..1]
        self.used_mah = 0.0

    def update(self, time_us: int, voltage_v: float, current_a: float) -> None:
        """Takes one sample."""
        if voltage_v <= 0.0 or time_us == self._last_us:
            return
        by_voltage = self._charge_at(voltage_v + current_a * self._resistance_ohm)
        if self._last_us == 0:
            self.remaining = by_voltage
        else:
            dt_s = (time_us - self._last_us) * 1e-6
            used_mah = max(current_a, 0.0) * dt_s / 3.6
            self.used_mah += used_mah
            counted = self.remaining - used_mah / self._pack_mah
            corrected = counted + (by_voltage - counted) * min(dt_s / _CORRECTION_TIME_S, 1.0)
            self.remaining = min(max(corrected, 0.0), 1.0)
        self._last_us = time_us

    def _charge_at(self, rest_voltage_v: float) -> float:
        """Share of the capacity [0..1] at which the pack rests at this voltage."""
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


def _rest_voltage_share(charge: float) -> float:
    """Rest voltage between empty (0) and full (1) of a lithium polymer cell at a charge [0..1].

    M. Chen, G. A. Rincon-Mora, IEEE Trans. Energy Conversion 21(2), 2006, equation 2, scaled to [0, 1].
    """

    def cell_v(s: float) -> float:
        return -1.031 * exp(-35.0 * s) + 3.685 + 0.2156 * s - 0.1178 * s * s + 0.3201 * s**3

    return (cell_v(charge) - cell_v(0.0)) / (cell_v(1.0) - cell_v(0.0))
