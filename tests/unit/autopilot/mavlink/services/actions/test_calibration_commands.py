"""Calibration commands: which one starts what, and what is refused."""

import pytest

from autopilot.interface.client_requests import CalibrationKind
from autopilot.interface.vehicle_state import Verdict
from tests.unit.autopilot.mavlink.rig import Rig, texts

CALIBRATE, SET_OFFSETS, STORAGE = 241, 242, 245


@pytest.mark.parametrize(
    ("params", "call"),
    [
        ((1.0, 0.0, 0.0, 0.0, 0.0), ("start", CalibrationKind.GYRO)),
        ((0.0, 1.0, 0.0, 0.0, 0.0), ("start", CalibrationKind.MAG)),
        ((0.0, 0.0, 0.0, 0.0, 1.0), ("start", CalibrationKind.ACCEL)),
        ((0.0, 0.0, 0.0, 0.0, 2.0), ("start", CalibrationKind.LEVEL)),
        ((0.0, 0.0, 0.0, 0.0, 4.0), ("start", CalibrationKind.ACCEL_SIMPLE)),
        ((0.0, 0.0, 1.0), ("start", CalibrationKind.BARO)),
        ((0.0,) * 7, ("cancel",)),
    ],
)
def test_calibration_is_asked_of_the_vehicle(params, call):
    rig = Rig()
    assert rig.ack(CALIBRATE, *params).result == Verdict.ACCEPTED
    assert rig.vehicle.calls == [call]


@pytest.mark.parametrize("params", [(0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 0.0, 0.0, 1.0), (3.0,)])
def test_other_calibrations_are_refused_with_a_reason(params):
    rig = Rig()
    rig.client.command(CALIBRATE, *params)
    messages = rig.frame()
    (ack,) = (message.fields for message in messages if message.name == "COMMAND_ACK")
    assert ack.result == Verdict.UNSUPPORTED
    assert any(text.startswith("Calibration: ") for text in texts(messages))
    assert rig.vehicle.calls == []


def test_offsets_that_a_client_knows_are_taken():
    rig = Rig()
    rig.update(is_armed=False)
    assert rig.ack(SET_OFFSETS, 2.0, 0.1, -0.2, 0.25).result == Verdict.ACCEPTED
    ((name, sensor, offsets),) = rig.vehicle.calls
    assert (name, sensor) == ("set_offsets", "MAG")
    assert offsets == pytest.approx((0.1, -0.2, 0.25))


@pytest.mark.parametrize(
    ("is_armed", "params", "result"),
    [
        (True, (0.0, 0.0, 0.0, 0.0), Verdict.TEMPORARILY_REJECTED),
        (False, (0.0, 0.0, 0.0), Verdict.DENIED),
        (False, (3.0, 0.0, 0.0, 0.0), Verdict.UNSUPPORTED),
    ],
)
def test_refused_offsets_change_nothing(is_armed, params, result):
    rig = Rig()
    rig.update(is_armed=is_armed)
    assert rig.ack(SET_OFFSETS, *params).result == result
    assert rig.vehicle.calls == []


@pytest.mark.parametrize(("action", "is_all"), [(2.0, True), (3.0, False)])
def test_parameters_are_set_back(action, is_all):
    rig = Rig()
    rig.update(is_armed=False)
    params = rig.vehicle.params
    params.set("CAL_GYRO0_XOFF", 0.1)
    params.set("MPC_XY_CRUISE", 3.0)
    assert rig.ack(STORAGE, action, -1.0).result == Verdict.ACCEPTED
    assert params["CAL_GYRO0_XOFF"] == 0.0
    assert (params["MPC_XY_CRUISE"] != 3.0) == is_all


@pytest.mark.parametrize(
    ("is_armed", "params", "result"),
    [
        (True, (2.0,), Verdict.TEMPORARILY_REJECTED),
        (False, (1.0,), Verdict.UNSUPPORTED),  # nothing outlives a restart here
        (False, (4.0,), Verdict.UNSUPPORTED),
        (False, (-1.0, 2.0), Verdict.DENIED),
    ],
)
def test_storage_is_refused(is_armed, params, result):
    rig = Rig()
    rig.update(is_armed=is_armed)
    assert rig.ack(STORAGE, *params).result == result
