"""MAVSDK's Failure and Calibration plugins over UDP, against `honeyguide fly --idle`."""

import queue

import pytest
from mavsdk.plugins.calibration import Calibration, CalibrationResult
from mavsdk.plugins.failure import Failure, FailureError, FailureResult, FailureType, FailureUnit

from tests.system.mavsdk.test_mavsdk import Client
from tests.system.vehicle import IdleVehicle

pytestmark = pytest.mark.slow

SPEED = 5.0
CALIBRATION_S = 60.0  # wall clock, for 50 s of the vehicle's at SPEED


class Bench(Client):
    """The plugins for what goes wrong."""

    def __init__(self, port):
        super().__init__(port)
        self.failure = Failure(self.system)
        self.calibration = Calibration(self.system)


@pytest.fixture
def client(tmp_path):
    with IdleVehicle(tmp_path, "--trees", 0, speed=SPEED) as vehicle:
        client = Bench(vehicle.api_port)
        client.wait_ready()
        yield client
        client.close()


def refused(client, *request):
    with pytest.raises(FailureError) as error:
        client.failure.inject(*request)
    return error.value.result


def test_failures_are_injected_once_enabled_and_armed(client):
    gps_off = (FailureUnit.SENSOR_GPS, FailureType.OFF, 0)
    assert refused(client, *gps_off) == FailureResult.DISABLED
    client.param.set_param_int("SYS_FAILURE_EN", 1)
    client.failure = Failure(client.system)  # it reads the parameter once
    assert refused(client, *gps_off) == FailureResult.DENIED  # not armed
    client.takeoff(10.0)
    assert refused(client, FailureUnit.SENSOR_OPTICAL_FLOW, FailureType.OFF, 0) == FailureResult.UNSUPPORTED
    client.failure.inject(FailureUnit.SENSOR_MAG, FailureType.STUCK, 0)
    client.failure.inject(FailureUnit.SENSOR_MAG, FailureType.OK, 0)
    client.failure.inject(*gps_off)
    client.until(lambda: not client.telemetry.armed(), 30.0, "landed blindly")  # PX4's limit
    assert "Position lost: land" in client.texts


def calibrate(client, start):
    """Runs a calibration; returns how it ended, its progress and its instructions."""
    answers = queue.Queue()
    start(lambda result, data, _: answers.put((result, data)))
    progress, instructions = [], []
    while True:
        result, data = answers.get(timeout=CALIBRATION_S)
        if result != CalibrationResult.NEXT:
            return result, progress, instructions
        if data.has_progress:
            progress.append(data.progress)
        if data.has_status_text:
            instructions.append(data.status_text)


def test_every_calibration_runs_to_its_end(client):
    calibration = client.calibration
    for start in (calibration.calibrate_gyro_async, calibration.calibrate_level_horizon_async):
        result, progress, _ = calibrate(client, start)
        assert result == CalibrationResult.SUCCESS
        assert progress[-1] == 1.0
    for start in (calibration.calibrate_accelerometer_async, calibration.calibrate_magnetometer_async):
        result, progress, instructions = calibrate(client, start)
        assert result == CalibrationResult.SUCCESS
        assert progress[-1] == 1.0
        assert sum("orientation detected" in text for text in instructions) == 6


def test_cancelled_calibration_says_so(client):
    answers = queue.Queue()
    client.calibration.calibrate_accelerometer_async(lambda result, data, _: answers.put((result, data.status_text)))
    # MAVSDK hangs if a text arrives while it waits for the acknowledgement: cancel while the vehicle is being turned
    waits = 0
    while waits < 2:
        waits += "hold vehicle still" in answers.get(timeout=10.0)[1]
    client.calibration.cancel()
    while (result := answers.get(timeout=10.0)[0]) == CalibrationResult.NEXT:
        pass
    assert result == CalibrationResult.CANCELLED
