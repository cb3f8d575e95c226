"""How far apart are the engines over a whole mission, with sensors, estimator and controller in the loop?

The control is the native engine beside itself, put down 0.1 mm aside: what a flight makes of so little, mostly because
it passes a waypoint a frame of 20 ms sooner or later, no engine can be held to. PyBullet and JSBSim, who both reckon in
double precision, are beside each other, too: what they share is not what the native engine rounds.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.row import Row, require
from mission.flight import Flight, FlightConfig
from mission.flight_settings import EngineName
from mission.plan.plan_file import default_plan, read_plan
from mission.script import fly_plan

COMMAND = "python -m bench missions"
NUDGE_M = 1e-4
OFF_M, OFF_DEG = 0.05, 1.0


class Track(NamedTuple):
    """A mission, one row per frame of 20 ms."""

    pos_ned: NDArray[np.float64]
    """[m], shape (frames, 3)."""
    q_ned_from_frd: NDArray[np.float64]
    """Shape (frames, 4)."""
    modes: NDArray[np.int64]
    """Of the flight controller, shape (frames,)."""


class Apart(NamedTuple):
    """Between two missions, frame by frame."""

    most_m: float
    most_deg: float
    usual_deg: float
    """That 99 of 100 frames stay under."""
    mode_frames: int
    """Between the same change of mode in either, at most; -1: the modes are others."""


def mission(engine: EngineName, airframe: str, noise: float, nudge_m: float = 0.0) -> Track:
    """The default plan of a class of vehicles by an engine.

    Args:
        engine: which.
        airframe: a rover's or a multirotor's.
        noise: scale of the sensors' noise, of the same seed each time.
        nudge_m: so far to the north of home it is put down.
    """
    flight = Flight(FlightConfig(engine=engine, noise=noise, seed=3, airframe=airframe))
    flight.rig.arrays.body.numpy()["pos_ned"][0, 0] += nudge_m
    plan = read_plan(default_plan(flight.airframe.vehicle))
    running = flight.drone.start(fly_plan(flight.drone, plan))
    places, attitudes, modes = [], [], []
    while not running.is_done:
        flight.frame()
        row = flight.rig.truth_row()
        places.append(row["pos_ned"].astype(float))
        attitudes.append(row["q_ned_from_frd"].astype(float))
        modes.append(int(flight.controller.state.mode))
    require(running.error is None, f"{airframe} by {engine}: {running.error}")
    flight.close()
    return Track(np.array(places), np.array(attitudes), np.array(modes))


def apart(one: Track, other: Track) -> Apart:
    """How far two missions are apart, as long as both last."""
    count = min(len(one.modes), len(other.modes))
    off_m = np.linalg.norm(one.pos_ned[:count] - other.pos_ned[:count], axis=1)
    q, other_q = one.q_ned_from_frd[:count], other.q_ned_from_frd[:count]
    chord = np.minimum(np.linalg.norm(q - other_q, axis=1), np.linalg.norm(q + other_q, axis=1))  # good where small
    off_deg = np.degrees(4.0 * np.arcsin(0.5 * chord))
    begun, other_begun = (np.flatnonzero(np.diff(track.modes)) + 1 for track in (one, other))
    are_same = np.array_equal(one.modes[begun], other.modes[other_begun])
    frames = int(np.abs(begun - other_begun).max(initial=0)) if are_same else -1
    return Apart(float(off_m.max()), float(off_deg.max()), float(np.percentile(off_deg, 99)), frames)


def measure() -> list[Row]:
    rows = []
    for airframe in ("x500", "rover"):
        for noise, name in ((0.0, "without noise"), (1.0, "with noise")):
            what = f"mission {name}, {airframe}"
            native, bullet = (mission(engine, airframe, noise) for engine in ("native", "pybullet"))
            rows += rows_of(f"{what}, pybullet beside native", apart(native, bullet), is_target=True)
            if airframe == "x500":  # JSBSim moves what flies
                jsbsim = mission("jsbsim", airframe, noise)
                rows += rows_of(f"{what}, jsbsim beside native", apart(native, jsbsim), is_target=True)
                rows += rows_of(f"{what}, jsbsim beside pybullet", apart(bullet, jsbsim), is_target=True)
            control = apart(native, mission("native", airframe, noise, NUDGE_M))
            rows += rows_of(f"control: {what}, native beside itself 0.1 mm aside", control)
    return rows


def rows_of(name: str, found: Apart, *, is_target: bool = False) -> list[Row]:
    return [
        Row(f"{name}: distance", found.most_m, "m", "lower", OFF_M if is_target else None, COMMAND),
        Row(f"{name}: angle", found.most_deg, "deg", "lower", OFF_DEG if is_target else None, COMMAND),
        Row(f"{name}: angle, 99 of 100 frames", found.usual_deg, "deg", "lower", None, COMMAND),
        Row(f"{name}: mode changes", found.mode_frames, "frames", "lower", 0.0 if is_target else None, COMMAND),
    ]
