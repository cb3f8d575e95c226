"""RTK: a receiver that gets corrections of a base station is accurate to centimetres, until they stop.

In: corrections, and the time. Out: the error model of the vehicle's receiver and its error now, changed on live rows.
"""

from typing import Any

from sim.rig import Rig

HOLD_US = 10_000_000  # corrections are good for that long; u-blox F9P: 60 s with growing error; guess
_FIXED = 6  # GPS_FIX_TYPE_RTK_FIXED
_ERROR_FRACTION = 0.02  # of the errors without corrections: 0.6 m becomes 1.2 cm; u-blox F9P data sheet: 1 cm
_REPORTED_STD_M = 0.014


def corrected(model: Any) -> Any:
    """The error model of a receiver (`sim.sensors.gnss.GnssModel`) that gets corrections all the time, changed."""
    for name in ("pos_std_ned", "correlated_std_ned"):
        setattr(model, name, getattr(model, name) * _ERROR_FRACTION)
    model.pos_h_std = model.pos_v_std = _REPORTED_STD_M
    model.fix_type = _FIXED
    return model


class RtkReceiver:
    """The receiver of one vehicle.

    Args:
        rig: its sensors.
        i_vehicle: its row.
    """

    def __init__(self, rig: Rig, i_vehicle: int = 0) -> None:
        self._row: Any = rig.rows["sensor_model"][i_vehicle]["gnss"]
        self._state: Any = rig.rows["sensors"][i_vehicle]["gnss"]
        self._plain = self._row.copy()
        self._until_us = -1  # -1: no corrections

    def correct(self, time_us: int) -> None:
        """Corrections have come in."""
        if self._until_us < 0:
            row = self._row
            for name in ("pos_std_ned", "correlated_std_ned"):
                row[name] = self._plain[name] * _ERROR_FRACTION
            self._state["correlated_ned"] *= _ERROR_FRACTION
            row["pos_h_std"] = row["pos_v_std"] = _REPORTED_STD_M
            row["fix_type"] = _FIXED
        self._until_us = time_us + HOLD_US

    def frame(self, time_us: int) -> None:
        """Goes back to a plain fix once the corrections are too old."""
        if 0 <= self._until_us < time_us:
            self._until_us = -1
            for name in self._plain.dtype.names:
                self._row[name] = self._plain[name]
            self._state["correlated_ned"] /= _ERROR_FRACTION
