"""Parameters of a log whose vehicle has wheels."""

from pathlib import Path

import numpy as np

from autopilot.estimator.sources.wheels import WHEELS
from mission.estimate.estimate_run import estimator_table
from mission.estimate.sensor_log import BARO_DTYPE, FIX_DTYPE, IMU_DTYPE, MAG_DTYPE, RANGE_DTYPE, Recording, empty


def recorded(wheel_samples: int) -> Recording:
    return Recording(
        Path("flight.ulg"),
        empty(IMU_DTYPE),
        empty(FIX_DTYPE),
        empty(BARO_DTYPE),
        empty(MAG_DTYPE),
        empty(RANGE_DTYPE),
        others={"wheels": np.zeros(wheel_samples, WHEELS.dtype)},
        is_own=True,
        parameters={"EKF2_WHL_POS_X": -0.25},
    )


def test_a_replay_knows_where_the_wheels_are_by_the_log() -> None:
    assert estimator_table(recorded(1), {})["EKF2_WHL_POS_X"] == -0.25


def test_a_replay_without_wheels_has_no_parameters_of_them() -> None:
    assert "EKF2_WHL_POS_X" not in estimator_table(recorded(0), {})
