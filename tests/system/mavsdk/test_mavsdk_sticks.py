"""MAVSDK's ManualControl plugin over UDP, as in PX4's own tests of Position and Altitude."""

import pytest
from mavsdk.plugins.manual_control import ManualControl, ManualControlError, ManualControlResult
from mavsdk.plugins.telemetry import FlightMode

from tests.system.mavsdk.test_mavsdk import Client, final_distance_m
from tests.system.vehicle import IdleVehicle

SPEED = 5.0
PATIENCE_S = 5.0  # COM_RC_LOSS_T: the client sends by the wall clock, on a busy machine perhaps not for a while


class Pilot(Client):
    """A client with sticks."""

    def __init__(self, port):
        super().__init__(port)
        self.manual = ManualControl(self.system)
        self.param.set_param_float("COM_RC_LOSS_T", PATIENCE_S)

    def hold(self, seconds, pitch=0.0, roll=0.0, throttle=0.5, yaw=0.0):
        """Holds the sticks there, by the vehicle's clock."""
        self.during(seconds, lambda: self.manual.set_manual_control_input(pitch, roll, throttle, yaw))

    def put_down(self):
        def is_down():
            self.manual.set_manual_control_input(0.0, 0.0, 0.0, 0.0)
            return not self.telemetry.armed()

        self.until(is_down, 90.0, "disarmed")


@pytest.fixture
def vehicle(tmp_path):
    with IdleVehicle(tmp_path, "--trees", 0, speed=SPEED) as vehicle:
        yield vehicle


@pytest.fixture
def pilot(vehicle):
    pilot = Pilot(vehicle.api_port)
    pilot.wait_ready()
    yield pilot
    pilot.close()


@pytest.mark.slow
@pytest.mark.parametrize("mode", [FlightMode.POSCTL, FlightMode.ALTCTL])
def test_a_pilot_takes_off_flies_forward_and_lands(vehicle, pilot, mode):
    start = pilot.manual.start_position_control
    if mode is FlightMode.ALTCTL:
        start = pilot.manual.start_altitude_control
    with pytest.raises(ManualControlError) as refusal:
        start()
    assert refusal.value.result == ManualControlResult.INPUT_NOT_SET
    pilot.hold(1.0)
    start()
    pilot.until(lambda: pilot.telemetry.flight_mode() == mode, 5.0, "in the mode")
    assert pilot.telemetry.rc_status().is_available
    pilot.action.arm()
    pilot.hold(5.0, throttle=1.0)
    assert pilot.height_m > 5.0
    pilot.hold(10.0, pitch=0.5)
    pilot.put_down()
    assert final_distance_m(vehicle) > 5.0
