"""The setpoint row: whatever is asked for, it is written, and in numbers that the control part can square."""

from math import nan

import numpy as np
import pytest

from autopilot.navigator.setpoint import SetpointPort
from autopilot.ports import Setpoint


@pytest.mark.parametrize("value", [3.5e38, -1e300])
def test_what_single_precision_does_not_hold_is_written_as_far_as_it_goes(value):
    row = np.zeros(1, dtype=np.dtype(Setpoint.numpy_dtype()))
    port = SetpointPort(row)
    port.set_flags(is_armed=True, is_landed=False)
    port.track((1.0, value, nan), (2.0, 0.0, value), 0.5)
    port.write()
    assert row["is_armed"][0] == 1
    assert row["vel_ned"][0][0] == 2.0
    written = np.array([row["pos_ned"][0][1], row["vel_ned"][0][2]])
    assert np.isfinite(written * written).all()
    assert (np.sign(written) == np.sign(value)).all()
    assert np.isnan(row["pos_ned"][0][2])
    port.track((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), 0.5)
    port.write()
    assert row["pos_ned"][0].tolist() == [1.0, 2.0, 3.0]
