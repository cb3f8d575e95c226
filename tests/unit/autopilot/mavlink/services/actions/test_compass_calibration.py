"""The magnetometer's calibration by ArduPilot's commands: started, followed, ended."""

import pytest

from autopilot.interface.client_requests import CalibrationKind
from autopilot.interface.vehicle_state import Reply, Severity, Verdict
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from tests.unit.autopilot.mavlink.rig import Rig

START, ACCEPT, CANCEL = 42424, 42425, 42426
ACCEPTED, TEMPORARILY_REJECTED, DENIED = 0, 1, 2
SUCCESS, FAILED = 4, 5


@pytest.fixture
def rig():
    return Rig(dialect=ARDUPILOT)


def tell(rig, text):
    rig.server.statustext(Severity.INFO, f"[cal] {text}")
    return [message.fields for message in rig.frame() if message.name.startswith("MAG_CAL_")]


def test_calibration_is_followed_to_its_end(rig):
    rig.vehicle.params.set("CAL_MAG0_XOFF", 0.02)
    assert rig.ack(START, 0.0, 1.0, 1.0, 0.0, 0.0).result == ACCEPTED
    assert rig.vehicle.calls == [("start", CalibrationKind.MAG)]
    assert rig.ack(ACCEPT, 0.0).result == TEMPORARILY_REJECTED
    (progress,) = tell(rig, "down side calibration: progress <40>")
    assert (progress.completion_pct, progress.cal_mask) == (40, 1)
    (report,) = tell(rig, "calibration done: mag")
    assert (report.cal_status, report.autosaved, report.ofs_x) == (SUCCESS, 1, pytest.approx(-20.0))
    assert rig.ack(ACCEPT, 0.0).result == ACCEPTED
    assert tell(rig, "progress <50>") == []  # of another calibration


def test_failure_and_cancelling_are_told(rig):
    rig.ack(START, 1.0)
    assert [report.cal_status for report in tell(rig, "calibration failed: the field is too weak")] == [FAILED]
    rig.ack(START, 1.0)
    assert rig.ack(CANCEL, 0.0).result == ACCEPTED
    assert rig.vehicle.calls[-1] == ("cancel",)
    assert tell(rig, "calibration cancelled") == []
    assert tell(rig, "progress <50>") == []


def test_what_cannot_be_calibrated_is_refused(rig):
    assert rig.ack(START, 2.0).result == DENIED
    rig.vehicle.reply = Reply(Verdict.TEMPORARILY_REJECTED, "the vehicle is armed")
    assert rig.ack(START, 0.0).result == TEMPORARILY_REJECTED
    assert rig.ack(CANCEL, 0.0).result == ACCEPTED
    assert ("cancel",) not in rig.vehicle.calls
