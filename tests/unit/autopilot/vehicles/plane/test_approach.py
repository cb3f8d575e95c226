"""A plane's landing, frame by frame: when it is given up, and by whom."""

import pytest

from autopilot.interface.vehicle_state import BatteryLevel, LandedState, VehicleState, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.setpoint import SetpointPort
from autopilot.params import all_parameters
from autopilot.ports import AIRSPEED_VALID, HEIGHT_VALID, TERRAIN_VALID, Actuators, Estimate, Setpoint
from autopilot.vehicles.plane.modes.approach import Approach
from autopilot.vehicles.plane.vehicle import PLANE
from common.airframe import load_airframe
from common.params import ParameterTable
from common.records import row_reader
from tests.unit.autopilot.kinematic import ORIGIN, Recorder, rows_of

VALID = HEIGHT_VALID | AIRSPEED_VALID


class Landing:
    """An approach northwards to the origin, of a plane that is put wherever a test wants it."""

    def __init__(self, **params):
        table = ParameterTable(all_parameters(PLANE))
        for name, value in params.items():
            table.set(name, value)
        self.recorder = Recorder()
        self.state = VehicleState(origin=ORIGIN, is_armed=True, landed_state=LandedState.IN_AIR)
        craft = PLANE.craft(load_airframe("plane"))
        self.context = NavContext(self.state, table, self.recorder, SetpointPort(rows_of(Setpoint)), craft)
        self.table = table
        self._estimate = rows_of(Estimate)
        self._read = row_reader(self._estimate, 0, "Estimate")
        self.state.actuators = row_reader(rows_of(Actuators), 0, "Actuators")()
        self.put(-500.0, 30.0)
        self.approach = Approach(self.context)
        self.approach.start((0.0, 0.0, 0.0), 0.0, is_lined_up=True)

    def put(self, north, height, *, east=0.0, vel_ned=(20.0, 0.0, 1.0), flags=VALID, airspeed=20.0):
        """Puts it there for a frame later."""
        row = self._estimate[0]
        row["pos_ned"], row["vel_ned"], row["flags"] = (north, east, -height), vel_ned, flags
        row["airspeed"] = airspeed
        self.state.time_us += 20_000
        self.state.estimate = self._read()

    def frame(self, *args, **kwargs):
        self.put(*args, **kwargs)
        self.approach.frame()


def test_a_plane_that_stands_in_the_wind_flies_on():
    landing = Landing(FW_LND_FL_SINK=0.0)
    landing.frame(-100.0, 10.0, vel_ned=(-1.0, 0.0, 0.0))


def test_a_landing_beside_the_runway_is_tried_again_twice():
    landing = Landing()
    for _ in range(3):
        landing.frame(-20.0, 1.5, east=200.0)
        landing.frame(-20.0, 60.0, east=200.0)  # up, and round for the next try
        landing.approach._phase = type(landing.approach._phase).SLOPE
    assert len([text for _, text in landing.recorder.texts if "trying again" in text]) == 2


def test_nobody_goes_round_by_himself_without_charge():
    landing = Landing()
    landing.state.battery_level = BatteryLevel.EMERGENCY
    landing.frame(-20.0, 1.5, east=200.0)
    assert not landing.recorder.texts


@pytest.mark.parametrize(
    ("bits", "is_seen", "is_given_up"), [(1, False, True), (1, True, False), (2, True, True), (2, False, False)]
)
def test_a_landing_without_a_measured_height_is_given_up_if_asked(bits, is_seen, is_given_up):
    landing = Landing(FW_LND_ABORT=bits)
    landing.frame(-300.0, 30.0, flags=VALID | (TERRAIN_VALID if is_seen else 0))
    landing.frame(-20.0, 1.5)
    assert landing.recorder.has_text("no height over ground") == is_given_up


def test_what_does_not_climb_lands_ahead():
    landing = Landing()
    landing.frame(-20.0, 1.5, east=200.0)
    for k in range(450):
        landing.frame(k * 0.4, 1.5 - 0.001 * k, east=200.0)
    assert landing.recorder.has_text("does not climb")
    assert landing.context.is_landing


def test_a_client_may_send_it_round_from_the_slope_alone():
    landing = Landing()
    landing.approach.start((0.0, 0.0, 0.0), 0.0)
    assert landing.approach.go_around(50.0).verdict is Verdict.TEMPORARILY_REJECTED  # it circles down to the slope
    landing.approach.start((0.0, 0.0, 0.0), 0.0, is_lined_up=True)
    assert landing.approach.go_around(50.0).verdict is Verdict.ACCEPTED


def test_going_round_keeps_to_the_fence_and_to_heights_that_there_are():
    landing = Landing()
    assert landing.approach.go_around(1e6).verdict is Verdict.DENIED
    landing.context.position_refusal = lambda pos_ned: "above the fence" if pos_ned[2] < -100.0 else ""
    assert landing.approach.go_around(150.0).reason == "target is above the fence"
    assert landing.approach.go_around(50.0).verdict is Verdict.ACCEPTED


def test_a_flare_closes_the_throttle_in_its_time_also_where_it_does_not_sink():
    landing = Landing()
    for k in range(100):
        landing.state.actuators = landing.state.actuators._replace(
            thrust_sp=0.2 if k < 99 else 0.9
        )  # a gust at the end
        landing.frame(-200.0 + 0.4 * k, 10.0)
    throttles = []
    for _ in range(300):
        landing.frame(-60.0, 1.0)
        throttles.append(float(landing.context.setpoint.thrust))
    assert throttles[1] < 0.3
    assert throttles[-1] == landing.table["FW_THR_IDLE"]


def test_a_flare_that_does_not_come_down_is_tried_again():
    landing = Landing()
    landing.frame(-60.0, 1.5)
    for _ in range(300):
        landing.frame(-60.0, 6.0)
    assert landing.recorder.has_text("too high, trying again")


def test_one_near_its_stall_keeps_its_throttle_into_the_flare():
    landing = Landing()
    stall = landing.table["FW_AIRSPD_STALL"]
    landing.state.actuators = landing.state.actuators._replace(thrust_sp=0.2)
    for k in range(100):
        landing.frame(-200.0 + 0.4 * k, 10.0)
    landing.state.actuators = landing.state.actuators._replace(thrust_sp=0.9)
    landing.frame(-60.0, 1.0, airspeed=stall)
    landing.frame(-60.0, 1.0, airspeed=stall)
    assert landing.context.setpoint.thrust > 0.8
