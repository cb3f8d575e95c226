"""What a topic of the flight log is: PX4's name and fields, filled from a batch of rows of the kernel structs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from autopilot.interface.outputs import Output
from common.geodesy import GeoPoint, geodetic_from_ned

Rows = npt.NDArray[Any]
Columns = dict[str, npt.ArrayLike]


@dataclass(frozen=True, slots=True)
class Batch:
    """Rows of some consecutive frames."""

    time_us: Rows  # (frames,)
    estimate: Rows  # Estimate
    samples: Rows  # Samples
    samples_before: Rows  # Samples of the frame before the first, one row
    actuators: Rows  # Actuators
    health: Rows  # EstimatorState
    yaw: Rows  # YawEstimator
    truth: Rows  # Truth
    vehicle: Rows  # STATUS_DTYPE of mission.log.flight_log
    origin: GeoPoint
    shown: Rows | None = None  # SHOWN of mission.log.replay_topic, in flights that are to be replayed
    outputs: Sequence[Output] = ()  # what the commands are for
    begins: tuple[int, ...] = (0,)  # the log gets the frames in pieces: where each of them begins

    def only(self, frames: Rows | slice, samples_before: Rows) -> "Batch":
        """Some of the frames; `samples_before` as of the frame before the first of them."""
        names = ("time_us", "estimate", "samples", "actuators", "health", "yaw", "truth", "vehicle")
        rows = {name: getattr(self, name)[frames] for name in names}
        shown = None if self.shown is None else self.shown[frames]
        return replace(self, samples_before=samples_before, shown=shown, **rows)


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic: its ULog fields and how a batch fills them."""

    name: str
    fields: dict[str, str]
    columns: Callable[[Batch], Columns]
    frames: Callable[[Batch], Rows] | None = None  # marks those that have a row; None: all have
    parameter: str = ""  # only vehicles that have this parameter have the topic; empty: all


def is_fresh(batch: Batch, sensor: str) -> Rows:
    """The frames in which a sample of this sensor is new: its time differs from the frame before and is not 0."""
    times = batch.samples[sensor]["time_us"]
    times_before = np.concatenate([batch.samples_before[sensor]["time_us"], times[:-1]])
    new: Rows = (times != times_before) & (times > 0)
    return new


def fresh(batch: Batch, sensor: str) -> Rows:
    """The new samples of a sensor."""
    rows: Rows = batch.samples[sensor][is_fresh(batch, sensor)]
    return rows


def axes(names: str, vectors: Rows) -> Columns:
    return dict(zip(names.split(), vectors.T, strict=True))


def geodetic(pos_ned: Rows, origin: GeoPoint) -> Rows:
    """Latitude [deg], longitude [deg] and altitude [m] of ned points; shape (rows, 3)."""
    points = [geodetic_from_ned(north, east, down, origin) for north, east, down in pos_ned.tolist()]
    return np.array(points, dtype=float).reshape(-1, 3)


SAMPLED = {"timestamp_sample": "uint64_t"}
