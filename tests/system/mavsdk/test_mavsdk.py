"""MAVSDK 4.1 over UDP: what a script written for PX4 does, against `honeyguide fly --idle`.

MAVSDK's timers run on the wall clock, the flight several times as fast. Waits are counted on the vehicle's clock, which
every telemetry message carries; tolerances are those of PX4's own MAVSDK tests where a comment does not say otherwise.
"""

import time
from math import cos, dist, hypot, nan, radians

import numpy as np
import pytest
from mavsdk import ComponentType, Configuration, ConnectionResult, Mavsdk
from mavsdk.plugins.action import Action, ActionError, ActionResult
from mavsdk.plugins.mission import Mission, MissionItem, MissionPlan
from mavsdk.plugins.mission_raw import MissionItem as RawItem
from mavsdk.plugins.mission_raw import MissionRaw, MissionRawError, MissionRawResult
from mavsdk.plugins.offboard import (
    Attitude,
    Offboard,
    OffboardError,
    PositionNedYaw,
    VelocityBodyYawspeed,
    VelocityNedYaw,
)
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import FlightMode, LandedState, Telemetry
from pyulog import ULog

from tests.system.vehicle import IdleVehicle

SPEED = 8.0  # times real time
OFFBOARD_SPEED = 5.0  # setpoints come at 20 Hz of the wall clock: 4 Hz for the vehicle, which asks for 2
START_UP_S = 120.0  # wall clock, with the kernels to compile on a busy machine
STALL_S = 30.0  # wall clock; a wait that the vehicle's clock does not end has lost the vehicle
METRES_PER_DEG = 111_194.9  # of latitude, on MAVLink's sphere


class Client:
    """MAVSDK's plugins for one vehicle."""

    def __init__(self, port):
        self._mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        assert self._mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}") == ConnectionResult.SUCCESS
        system = self.system = self._mavsdk.first_autopilot(START_UP_S)
        assert system is not None, "no heartbeat"
        self.system = system
        self.action = Action(system)
        self.telemetry = Telemetry(system)
        self.mission = Mission(system)
        self.mission_raw = MissionRaw(system)
        self.offboard = Offboard(system)
        self.param = Param(system)
        self.texts = []
        self.telemetry.subscribe_status_text(lambda text, _: self.texts.append(text.text))

    def close(self):
        self._mavsdk.destroy()

    @property
    def time_s(self):
        return self.telemetry.attitude_euler().timestamp_us * 1e-6

    @property
    def pos_ned(self):
        pos = self.telemetry.position_velocity_ned().position
        return pos.north_m, pos.east_m, pos.down_m

    @property
    def vel_ned(self):
        vel = self.telemetry.position_velocity_ned().velocity
        return vel.north_m_s, vel.east_m_s, vel.down_m_s

    @property
    def height_m(self):
        return self.telemetry.position().relative_altitude_m

    @property
    def from_home_m(self):
        """Horizontal distance; home is where it armed, by its own estimate, and near the local frame's origin only."""
        here, home = self.telemetry.position(), self.telemetry.home()
        north = (here.latitude_deg - home.latitude_deg) * METRES_PER_DEG
        east = (here.longitude_deg - home.longitude_deg) * METRES_PER_DEG * cos(radians(home.latitude_deg))
        return hypot(north, east)

    def until(self, condition, seconds, what):
        """Waits for a condition, at most so long by the vehicle's clock."""
        start_s, wall_s = self.time_s, time.monotonic()
        while not condition():
            assert self.time_s - start_s < seconds, f"not {what} within {seconds} s"
            assert time.monotonic() - wall_s < STALL_S + seconds, f"the vehicle's clock stands: {what}"
            time.sleep(0.005)

    def during(self, seconds, observe):
        """What `observe` returned each time, over so long by the vehicle's clock."""
        start_s, seen = self.time_s, []
        while self.time_s - start_s < seconds:
            seen.append(observe())
            time.sleep(0.01)
        return seen

    def wait_ready(self):
        self.until(lambda: self.telemetry.health_all_ok() and self.telemetry.health().is_armable, 30.0, "healthy")

    def takeoff(self, height_m):
        """Arms, takes off and waits until the vehicle holds."""
        self.action.set_takeoff_altitude(height_m)
        self.action.arm()
        self.action.takeoff()
        self.until(lambda: self.telemetry.flight_mode() == FlightMode.TAKEOFF, 2.0, "taking off")
        self.until(lambda: self.telemetry.flight_mode() == FlightMode.HOLD, 30.0, "holding after take-off")

    def wait_landed(self):
        self.until(lambda: not self.telemetry.armed(), 180.0, "disarmed")
        assert self.telemetry.landed_state() == LandedState.ON_GROUND

    def start_offboard(self):
        """Starts a stream and the mode; a client starved by a busy machine may be told to stream faster."""
        for _ in range(5):
            time.sleep(0.2)
            try:
                self.offboard.start()
            except OffboardError:
                continue
            break
        self.until(lambda: self.telemetry.flight_mode() == FlightMode.OFFBOARD, 2.0, "in offboard")

    def place(self, north_m, east_m):
        """Latitude and longitude [deg] of a place seen from home."""
        home = self.telemetry.home()
        metres_per_deg_east = METRES_PER_DEG * cos(radians(home.latitude_deg))
        return home.latitude_deg + north_m / METRES_PER_DEG, home.longitude_deg + east_m / metres_per_deg_east


@pytest.fixture(params=[SPEED])
def vehicle(tmp_path, request):
    with IdleVehicle(tmp_path, "--trees", 0, speed=request.param) as vehicle:
        yield vehicle


@pytest.fixture
def client(vehicle):
    client = Client(vehicle.api_port)
    client.wait_ready()
    yield client
    client.close()


def final_distance_m(vehicle):
    """How far from where it began the vehicle ended, in truth and horizontally; ends the vehicle."""
    exit_code, output = vehicle.stop()
    assert exit_code == 0, output
    truth = ULog(str(vehicle.folder / "flight.ulg"), ["vehicle_local_position_groundtruth"]).data_list[0].data
    return hypot(truth["x"][-1] - truth["x"][0], truth["y"][-1] - truth["y"][0])


def test_takeoff_goto_mission_with_pause_and_return(vehicle, client):
    telemetry = client.telemetry
    assert telemetry.landed_state() == LandedState.ON_GROUND
    client.takeoff(10.0)
    assert telemetry.in_air()
    client.until(lambda: abs(client.height_m - 10.0) < 0.2, 5.0, "at 10 m")
    heights = client.during(5.0, lambda: client.height_m)
    assert max(abs(height - 10.0) for height in heights) < 0.3

    latitude, longitude = client.place(40.0, 0.0)
    client.action.goto_location(latitude, longitude, telemetry.home().absolute_altitude_m + 12.0, 90.0)
    place = telemetry.position

    def to_target_m():
        here = place()
        north = (here.latitude_deg - latitude) * METRES_PER_DEG
        east = (here.longitude_deg - longitude) * METRES_PER_DEG * cos(radians(latitude))
        return hypot(north, east, here.relative_altitude_m - 12.0)

    client.until(lambda: to_target_m() < 0.5, 30.0, "at the place")  # PX4: 2 m
    assert max(client.during(3.0, to_target_m)) < 0.5
    assert telemetry.heading().heading_deg == pytest.approx(90.0, abs=5.0)

    client.action.goto_location(*client.place(140.0, 0.0), telemetry.home().absolute_altitude_m + 12.0, 0.0)
    client.until(lambda: hypot(*client.vel_ned) > 3.0, 10.0, "on its way")
    stopped_at = client.pos_ned
    client.action.hold()
    client.until(lambda: hypot(*client.vel_ned) < 0.3, 6.0, "standing")
    assert dist(client.pos_ned, stopped_at) < 15.0

    fly_mission(client)
    client.action.set_return_to_launch_altitude(12.0)
    client.action.return_to_launch()
    client.until(lambda: telemetry.flight_mode() == FlightMode.RETURN_TO_LAUNCH, 2.0, "returning")
    client.wait_landed()
    assert final_distance_m(vehicle) < 2.0


def fly_mission(client):
    """Three items, paused and resumed on the way to the second."""
    corners = [(20.0, 0.0, 10.0), (20.0, 20.0, 12.0), (0.0, 20.0, 10.0)]
    items = [
        MissionItem(*client.place(north, east), height, speed_m_s=5.0, is_fly_through=height == 12.0)
        for north, east, height in corners
    ]
    client.mission.upload_mission(MissionPlan(items))
    assert len(client.mission.download_mission().mission_items) == 3
    passed = []
    client.telemetry.subscribe_position_velocity_ned(
        lambda sample, _: passed.append((sample.position.north_m, sample.position.east_m, -sample.position.down_m))
    )
    client.mission.start_mission()
    client.until(lambda: client.mission.mission_progress().current == 1, 40.0, "on the way to the second item")
    client.until(lambda: client.pos_ned[1] > 5.0, 10.0, "on the second leg")
    paused_at = client.pos_ned
    client.mission.pause_mission()
    client.until(lambda: hypot(*client.vel_ned) < 0.3, 6.0, "standing")
    assert dist(client.pos_ned, paused_at) < 15.0
    held = client.pos_ned
    assert client.telemetry.flight_mode() == FlightMode.HOLD
    assert max(client.during(3.0, lambda: dist(client.pos_ned, held))) < 0.5
    assert not client.mission.is_mission_finished()
    client.mission.start_mission()
    client.until(client.mission.is_mission_finished, 60.0, "finished")
    assert client.mission.mission_progress().current == 3
    home_height_m = -client.telemetry.home().local_down_m
    for north, east, height in corners:
        # MAVSDK asks for an acceptance radius of 1 m, of 3 m where the item is flown through; PX4's corridor is 5 m
        assert min(dist(pos, (north, east, height + home_height_m)) for pos in passed) < (
            3.0 if height == 12.0 else 1.0
        )


@pytest.mark.parametrize("vehicle", [OFFBOARD_SPEED], indirect=True)
def test_offboard_position_velocity_and_attitude(vehicle, client):
    client.takeoff(10.0)
    offboard = client.offboard
    yaw_deg = 0.0
    offboard.set_position_ned(PositionNedYaw(0.0, 0.0, -10.0, yaw_deg))
    client.start_offboard()
    for north, east, down, yaw_deg in [
        (0, 0, -10, 0),
        (5, 0, -10, 90),
        (5, 5, -10, 180),
        (0, 5, -15, -90),
        (0, 0, -10, 0),
    ]:
        target = (float(north), float(east), float(down))
        offboard.set_position_ned(PositionNedYaw(*target, float(yaw_deg)))
        client.until(lambda target=target: dist(client.pos_ned, target) < 0.3, 10.0, f"at {target}")
    client.until(lambda: abs(client.telemetry.attitude_euler().yaw_deg - yaw_deg) < 5.0, 5.0, "turned")

    offboard.set_velocity_ned(VelocityNedYaw(0.0, 2.0, -0.5, 90.0))
    client.during(4.0, lambda: None)
    errors = client.during(2.0, lambda: dist(client.vel_ned, (0.0, 2.0, -0.5)))
    assert max(errors) < 0.4  # by its own estimate, with default noise
    offboard.set_velocity_body(VelocityBodyYawspeed(0.0, -2.0, 0.0, 0.0))  # to the left: north
    client.during(4.0, lambda: None)
    assert max(client.during(1.0, lambda: dist(client.vel_ned, (2.0, 0.0, 0.0)))) < 0.4

    offboard.set_position_ned(PositionNedYaw(0.0, 0.0, -20.0, 0.0))
    client.until(lambda: dist(client.pos_ned, (0.0, 0.0, -20.0)) < 0.3, 20.0, "back over home")
    offboard.set_attitude(Attitude(0.0, -20.0, 0.0, 0.5))
    client.during(1.0, lambda: None)
    angles = client.during(2.0, client.telemetry.attitude_euler)
    assert max(abs(angle.roll_deg) for angle in angles) < 5.0
    assert max(abs(angle.pitch_deg + 20.0) for angle in angles) < 5.0
    assert client.vel_ned[0] > 3.0

    offboard.stop()
    assert not offboard.is_active()
    client.until(lambda: client.telemetry.flight_mode() == FlightMode.HOLD, 2.0, "holding")
    client.until(lambda: hypot(*client.vel_ned) < 0.3, 8.0, "standing")
    latitude, longitude = client.place(0.0, 0.0)
    client.action.goto_location(latitude, longitude, client.telemetry.home().absolute_altitude_m + 5.0, nan)
    client.until(lambda: client.from_home_m < 0.3 and client.height_m < 5.3, 30.0, "over home")
    client.action.land()
    client.wait_landed()
    assert final_distance_m(vehicle) < 2.0


def test_on_the_ground_everything_is_answered(client):
    param = client.param
    assert param.get_param_int("SYS_AUTOSTART") == 4001
    param.set_param_float("MPC_XY_CRUISE", 4.5)
    assert param.get_param_float("MPC_XY_CRUISE") == 4.5
    assert len(param.get_all_params().float_params) > 50

    with pytest.raises(ActionError) as refused:
        client.action.goto_location(*client.place(10.0, 0.0), 500.0, 0.0)
    assert refused.value.result == ActionResult.COMMAND_DENIED
    client.until(lambda: "Goto: not in the air" in client.texts, 2.0, "told why")

    nan_yaw = (0.0, 1.0, 0.0, nan)
    latitude, longitude = (round(degrees * 1e7) for degrees in client.place(10.0, 0.0))
    good = [RawItem(seq, 6, 16, int(seq == 0), 1, *nan_yaw, latitude, longitude, 10.0, 0) for seq in range(2)]
    client.mission_raw.upload_mission(good)
    vtol = RawItem(1, 6, 84, 0, 1, *nan_yaw, latitude, longitude, 10.0, 0)
    with pytest.raises(MissionRawError) as refused:
        client.mission_raw.upload_mission([good[0], vtol])
    assert refused.value.result == MissionRawResult.UNSUPPORTED
    kept = client.mission_raw.download_mission()
    assert [(item.command, item.x, item.y) for item in kept] == [(16, latitude, longitude)] * 2
    assert np.isnan(kept[0].param4)
    client.mission_raw.clear_mission()
    assert client.mission_raw.download_mission() == []
