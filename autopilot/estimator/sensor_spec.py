"""What a fused sensor is besides its arithmetic: the row from which logs, health, arming, faults and replays are made.

Each source file ends with the row of its sensor; `sensors.py` lists them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Rows = npt.NDArray[Any]


@dataclass(frozen=True, slots=True)
class AidSpec:
    """One thing that is fused of a sensor's samples: an `Aid` of EstimatorState."""

    name: str  # field of EstimatorState
    axes: int
    unit: str
    logged: Mapping[str, slice]  # fields of estimator_innovations and the axes that they hold


@dataclass(frozen=True, slots=True)
class SampleTopic:
    """A log topic that has a row for each new sample, by the sample's time; recorded flights are read from it too."""

    name: str
    fields: Mapping[str, str]  # ULog's types
    holds: Mapping[str, str]  # fields of the sample, by their names in the log


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSpec:
    """One fused sensor: `samples.NAME`, `NAME_inbox`, `NAME_ring`, `faults.NAME`."""

    name: str
    label: str  # in sentences
    Sample: Any  # kernel struct
    ring_size: int
    aids: tuple[AidSpec, ...]
    topic: SampleTopic | None = None  # None: mission/log/sensor_topics.py fills it from more than the samples
    is_needed_to_arm: bool = False
    status_bit: int = 0  # MAV_SYS_STATUS_SENSOR
    is_optional: bool = False  # shown as present once it has delivered a sample
    parameter: str = ""  # only vehicles that have this parameter have the sensor; empty: all
    failure_unit: int | None = None  # FAILURE_UNIT
    bias_unit: str  # of a fault's bias
    wrong_bias: float  # of a sensor that is made wrong, on each axis; a guess far beyond any gate

    @property
    def dtype(self) -> np.dtype[Any]:
        """NumPy's type of its samples."""
        dtype: np.dtype[Any] = np.dtype(self.Sample.numpy_dtype())
        return dtype
