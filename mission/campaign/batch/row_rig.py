"""One vehicle of a batch, as those who know a rig of one vehicle see it.

In: a rig of many and the number of a row. Out: live rows of length one; what is set is set for this row alone.
"""

from typing import Any

import numpy as np
import warp as wp

from autopilot.estimator.params import estimator_fields
from common.geodesy import GeoPoint
from common.geomagnetic import field_ned_gauss
from common.params import ParameterTable
from sim.rig import Rig
from sim.rows import Rows
from sim.sensors.sensors import SensorModel
from sim.wind import WindModel

_MASK = 0xFFFFFFFF


def _pcg(state: int) -> int:
    """Warp's generator, of which `common.rng.draw_key` begins each draw."""
    b = (state * 747796405 + 2891336453) & _MASK
    c = (((b >> ((b >> 28) + 4)) ^ b) * 277803737) & _MASK
    return (c >> 22) ^ c


def seed_in_row(seed: int, i_vehicle: int) -> int:
    """The seed with which a row draws the noise that row 0 draws with `seed`: a draw begins at pcg(seed + pcg(row))."""
    moved = (seed + _pcg(0) - _pcg(i_vehicle)) & _MASK
    return moved - (1 << 32) if moved > _MASK >> 1 else moved


class _RowOf:
    """The rows of a rig, cut to one vehicle's."""

    def __init__(self, rig: Rig, i_vehicle: int) -> None:
        self._rows, self._chosen = rig.rows, slice(i_vehicle, i_vehicle + 1)

    def __getitem__(self, name: str) -> Rows:
        return self._rows[name][self._chosen]


class RowRig:
    """A vehicle of a batch.

    Args:
        rig: all of them.
        i_vehicle: which.
    """

    def __init__(self, rig: Rig, i_vehicle: int) -> None:
        self.rig, self.i_vehicle = rig, i_vehicle
        self.rows = _RowOf(rig, i_vehicle)

    def seed(self, seed: int) -> None:
        """Draws what a flight with this seed draws."""
        self.rig.arrays.seed.numpy()[self.i_vehicle] = seed_in_row(seed, self.i_vehicle)

    def set_air(self, model: Any) -> None:
        """From now on it flies in this air."""
        self._assign(self.rig.arrays.wind_model, WindModel, model)

    def set_sensors(self, model: Any) -> None:
        """Its sensors have this noise."""
        self._assign(self.rig.arrays.sensor_model, SensorModel, model)

    def load_parameters(self, table: ParameterTable, home: GeoPoint) -> None:
        """Gives its flight controller the values of a parameter table, and the local magnetic field."""
        autopilot = self.rig.arrays.autopilot
        field = {"earth_field_ned_gauss": field_ned_gauss(home.lat_deg, home.lon_deg, home.alt_m)}
        for array, values in (
            (autopilot.ekf.params, estimator_fields(table) | field),
            (autopilot.control_params, table.fields(self.rig.law.parameters)),
        ):
            rows = array.numpy()
            for name, value in values.items():
                rows[name][self.i_vehicle] = value

    def _assign(self, array: Any, kind: Any, value: Any) -> None:
        given: np.ndarray[Any, Any] = wp.array([value], dtype=kind, device="cpu").numpy()
        array.numpy()[self.i_vehicle] = given[0]
