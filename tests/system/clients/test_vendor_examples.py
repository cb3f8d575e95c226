"""What the examples that come with MAVSDK do, over MAVSDK, judged by the simulator's truth: an exit code says little.

Each begins like the example of its name: connected, healthy, then one call after the other with the example's pauses,
in the world of `honeyguide fly --idle`.
"""

from math import degrees, hypot, nan

import numpy as np
import pytest
from mavsdk.plugins.action import Action, OrbitYawBehavior
from mavsdk.plugins.gimbal import Gimbal
from mavsdk.plugins.info import Info
from mavsdk.plugins.manual_control import ManualControl
from mavsdk.plugins.offboard import Offboard, VelocityBodyYawspeed
from mavsdk.plugins.telemetry import Telemetry

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.services.identity import project_version
from common.geodesy import DEFAULT_HOME, geodetic_from_ned
from mission.flight_config import TREELESS_M, FlightConfig
from sim.world.world import WorldConfig
from tests.system.raw_vehicle import RawVehicle

CONFIG = FlightConfig(world=WorldConfig(treeless_radius_m=TREELESS_M))
ORBIT_PLACE = (47.398036222362471, 8.5450146439425509)  # the example's, 53 m from home
GOTO_PLACE = (47.397606, 8.543060)  # the example's, 190 m from home
SLIP_M = 0.5  # a take-off moves no farther sideways below LOW_M
LOW_M = 1.5


class Watched(RawVehicle):
    """A vehicle whose true path is kept."""

    def __init__(self):
        self.path = []  # true position [m] and lean [deg] of each frame
        super().__init__(CONFIG)

    def _frame(self):
        super()._frame()
        body = self.flight.rig.rows["truth"][0]
        x, y, _, _ = body["q_ned_from_frd"]
        lean_deg = degrees(np.arccos(np.clip(1.0 - 2.0 * float(x * x + y * y), -1.0, 1.0)))
        self.path.append((*body["pos_ned"].astype(float), lean_deg))

    def ready(self):
        self.until(self.plugin(Telemetry).health_all_ok, 30.0, "healthy")
        self.until(lambda: self.state.is_ready_to_arm, 30.0, "ready")
        return self.plugin(Action)

    @property
    def pos(self):
        return self.path[-1][:3]

    def heights(self):
        """True heights [m] above where it stood."""
        path = np.array(self.path)
        return path[0, 2] - path[:, 2]

    def slip_m(self):
        """How far it has gone sideways before it was LOW_M high."""
        path = np.array(self.path)
        low = path[: int(np.argmax(self.heights() > LOW_M))]
        return float(np.hypot(low[:, 0] - path[0, 0], low[:, 1] - path[0, 1]).max())

    def clearance_m(self):
        """Least distance to a tree."""
        return float(np.min(self.flight.world.obstacle_distance(np.array(self.path)[:, :3])))


@pytest.fixture
def vehicle():
    with Watched() as vehicle:
        yield vehicle
        assert not vehicle.flight.rig.rows["truth"][0]["is_crashed"]


@pytest.mark.slow
def test_do_orbit_circles_10_m_above_where_it_stood(vehicle):
    action, telemetry = vehicle.ready(), vehicle.plugin(Telemetry)
    vehicle.until(lambda: abs(telemetry.position().absolute_altitude_m - DEFAULT_HOME.alt_m) < 2.0, 10.0, "placed")
    height_m = telemetry.position().absolute_altitude_m + 10.0
    action.arm()
    action.takeoff()
    vehicle.pause(10.0)
    action.do_orbit(10.0, 2.0, OrbitYawBehavior.HOLD_FRONT_TO_CIRCLE_CENTER, *ORBIT_PLACE, height_m)
    vehicle.pause(35.0)
    assert vehicle.state.mode is Mode.ORBIT
    assert vehicle.heights()[-1] == pytest.approx(10.0, abs=1.5)
    assert vehicle.heights().max() < 12.0
    assert telemetry.position().relative_altitude_m == pytest.approx(10.0, abs=1.5)
    centre = vehicle.state.orbit.centre
    assert centre.lat_deg == pytest.approx(ORBIT_PLACE[0])
    north, east, _ = vehicle.pos
    place = geodetic_from_ned(north, east, 0.0, DEFAULT_HOME)
    away_m = hypot((place[0] - ORBIT_PLACE[0]) * 111_195.0, (place[1] - ORBIT_PLACE[1]) * 75_270.0)
    assert away_m == pytest.approx(10.0, abs=1.5)
    assert vehicle.clearance_m() > 5.0


@pytest.mark.slow
def test_goto_one_second_after_take_off_rises_before_it_goes(vehicle):
    action, telemetry = vehicle.ready(), vehicle.plugin(Telemetry)
    vehicle.until(lambda: abs(telemetry.home().absolute_altitude_m - DEFAULT_HOME.alt_m) < 3.0, 10.0, "home told")
    altitude_m = telemetry.home().absolute_altitude_m + 20.0
    action.arm()
    action.takeoff()
    vehicle.pause(1.0)
    action.goto_location(*GOTO_PLACE, altitude_m, 0.0)
    vehicle.until(lambda: hypot(*vehicle.pos[:2]) > 150.0, 60.0, "on its way")
    assert vehicle.slip_m() < SLIP_M
    assert vehicle.clearance_m() > 1.0
    vehicle.until(lambda: abs(vehicle.heights()[-1] - 20.0) < 1.5, 30.0, "20 m up")


@pytest.mark.slow
def test_manual_control_flies_after_one_message_before_arming_and_five_seconds_of_silence(vehicle):
    action, sticks = vehicle.ready(), vehicle.plugin(ManualControl)
    sticks.set_manual_control_input(0.0, 0.0, 0.5, 0.0)
    action.arm()
    action.takeoff()
    vehicle.pause(5.0)
    assert vehicle.heights()[-1] > 1.5
    sticks.set_manual_control_input(0.0, 0.0, 0.5, 0.0)
    sticks.start_position_control()
    vehicle.until(lambda: vehicle.state.mode is Mode.POSITION, 5.0, "flown by sticks")
    for _ in range(30):
        sticks.set_manual_control_input(0.6, 0.0, 0.8, 0.0)
        vehicle.pause(0.1)
    assert vehicle.state.is_armed
    assert hypot(*vehicle.pos[:2]) > 2.0
    assert vehicle.heights()[-1] > 2.5
    assert not any("Sticks lost" in text for text in vehicle.overheard)


@pytest.mark.slow
def test_offboard_velocity_body_flies_its_circle_clear_of_trees(vehicle):
    """The example's widest figure: 5 m/s forwards at a turn of 30 deg/s, 4 m up, after a way to the north."""
    action, offboard = vehicle.ready(), vehicle.plugin(Offboard)
    action.arm()
    offboard.set_velocity_body(VelocityBodyYawspeed(0.0, 0.0, 0.0, 0.0))
    vehicle.pause(0.5)
    offboard.start()
    for velocity, seconds in (
        ((0.0, 0.0, -1.0, 60.0), 5.0),
        ((0.0, 0.0, 0.0, -60.0), 5.0),
        ((5.0, 0.0, 0.0, 30.0), 15.0),
        ((0.0, 0.0, 0.0, 0.0), 5.0),
        ((0.0, -5.0, 0.0, 30.0), 15.0),
    ):
        offboard.set_velocity_body(VelocityBodyYawspeed(*velocity))
        vehicle.pause(seconds)
    assert 2.5 < vehicle.heights()[-1] < 6.0
    assert vehicle.clearance_m() > 20.0
    offboard.stop()


def test_home_and_region_of_interest_are_above_sea_level(vehicle):
    action = vehicle.ready()
    place = geodetic_from_ned(30.0, 0.0, 0.0, DEFAULT_HOME)
    action.set_home(True, nan, nan, nan)
    action.set_home(False, place[0], place[1], DEFAULT_HOME.alt_m + 3.0)
    vehicle.until(lambda: vehicle.state.home.alt_m == pytest.approx(DEFAULT_HOME.alt_m + 3.0, abs=0.1), 5.0, "set")
    telemetry = vehicle.plugin(Telemetry)
    vehicle.until(
        lambda: abs(telemetry.home().absolute_altitude_m - DEFAULT_HOME.alt_m - 3.0) < 0.1, 5.0, "told: home's height"
    )
    gimbal, known = vehicle.plugin(Gimbal), []
    gimbal.subscribe_gimbal_list(lambda found, _: known.append(found))
    vehicle.until(lambda: known and known[-1].gimbals, 10.0, "found")
    gimbal_id = known[-1].gimbals[0].gimbal_id
    far = geodetic_from_ned(100.0, 0.0, 0.0, DEFAULT_HOME)
    pitches_deg = []
    gimbal.subscribe_attitude(lambda attitude, _: pitches_deg.append(attitude.euler_angle_forward.pitch_deg))
    gimbal.set_roi_location(gimbal_id, far[0], far[1], DEFAULT_HOME.alt_m)
    vehicle.pause(3.0)
    assert abs(pitches_deg[-1]) < 10.0  # not up to 488 m above home


def test_version_and_rates_are_what_they_say(vehicle):
    vehicle.ready()
    version = vehicle.plugin(Info).get_version()
    vendor = (version.flight_sw_vendor_major, version.flight_sw_vendor_minor, version.flight_sw_vendor_patch)
    assert ".".join(map(str, vendor)) == project_version()
    assert len(set(version.flight_sw_git_hash.strip("\0 "))) > 4
    telemetry, heard = vehicle.plugin(Telemetry), []
    telemetry.subscribe_imu(lambda imu, _: heard.append(imu.timestamp_us))
    telemetry.set_rate_imu(200.0)
    vehicle.pause(1.0)
    heard.clear()
    vehicle.pause(2.0)
    assert len(heard) == pytest.approx(400, abs=40)
    assert (heard[-1] - heard[0]) / (len(heard) - 1) == pytest.approx(5_000, rel=0.05)
