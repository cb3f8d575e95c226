"""Vehicles that hover in wind, for the benchmarks of the batch: what they are, and whether they fly as they should."""

from functools import cache
from typing import Any

import numpy as np
import warp as wp

from autopilot.params import parameter_table
from bench.row import require
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from sim.hovering import fly_to_hover
from sim.restore import RowRestore
from sim.rig import Rig, Snapshot
from sim.sensors.sensors import sensor_model
from sim.wind import wind_model
from sim.world.world import build_world

HEIGHT_M = 10.0
_SEED_COUNT = 128  # vehicles flown from power-on; larger fleets are copies with noise of their own


def hovering(vehicle_count: int, *, has_estimator: bool = True, threads: int = 1, device: str = "cpu") -> Rig:
    """X500s 10 m over home in 5 m/s of turbulent wind with gusts, default noise, the default world below."""
    rig = _rig(vehicle_count, has_estimator, threads, device)
    rows = np.arange(vehicle_count)
    sources, seeds = (wp.array(values, dtype=int, device=device) for values in (rows % _SEED_COUNT, rows + 1))
    everyone = wp.full(vehicle_count, True, dtype=wp.bool, device=device)
    RowRestore(rig, _hovers(has_estimator, device), sources, everyone, seeds).launch()
    rig.advance(250)
    check(rig, has_estimator=has_estimator)
    return rig


def check(rig: Rig, *, has_estimator: bool) -> None:
    """Every vehicle holds its position in truth, and by its own estimate where it has one.

    Raises:
        WrongResult: one does not.
    """
    target = np.array([0.0, 0.0, -HEIGHT_M])
    truth = rig.rows["truth"]
    require(not truth["is_crashed"].any(), "a vehicle has crashed")
    error = np.linalg.norm(truth["pos_ned"] - target, axis=1)
    require(error.max() < (5.0 if has_estimator else 0.5), f"a vehicle is {error.max():.2f} m from its place")
    if has_estimator:
        estimate = rig.rows["autopilot.ekf.rows"]["estimate"]["pos_ned"]
        error = np.linalg.norm(estimate - target, axis=1)
        require(error.max() < 1.0, f"a vehicle is {error.max():.2f} m from its place by its own estimate")


def same_bits(first: Snapshot, second: Snapshot) -> bool:
    """Equal to the bit, NaN too; the padding inside rows is left out."""
    pairs = zip(first, second, strict=True)
    return all(a.tobytes() == b.tobytes() for x, y in pairs for a, b in zip(_leaves(x), _leaves(y), strict=True))


def _leaves(rows: np.ndarray[Any, Any]) -> list[np.ndarray[Any, Any]]:
    if rows.dtype.names is None:
        return [rows]
    return [leaf for name in rows.dtype.names for leaf in _leaves(rows[name])]


def _rig(vehicle_count: int, has_estimator: bool, threads: int, device: str) -> Rig:
    rig = Rig(
        load_airframe("x500"),
        build_world(device=device),
        sensor_model(home=DEFAULT_HOME),
        wind_model(5.0, 270.0, 1.0, 1.5),
        home=DEFAULT_HOME,
        vehicle_count=vehicle_count,
        has_estimator=has_estimator,
        threads=threads,
        device=device,
    )
    rig.load_parameters(parameter_table())
    return rig


@cache
def _hovers(has_estimator: bool, device: str) -> Rig:
    rig = _rig(_SEED_COUNT, has_estimator, 1, device)
    fly_to_hover(rig, [((0.0, 0.0, -HEIGHT_M), 0.0)] * _SEED_COUNT)
    return rig
