"""ArduPilot's plane: what it is told of ours, and how scripts speak to it."""

from math import cos, degrees, pi, radians, sin

import pytest

from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode, encode
from autopilot.vehicles.plane.defaults import plane_defaults
from autopilot.vehicles.plane.trim import level_flight
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME, GRAVITY_M_S2, ned_from_geodetic
from mission.boards.ardupilot_drone import ArduPilotDrone
from mission.boards.plane_landing import landing_items
from mission.boards.vehicle_params import ardupilot_params
from mission.client_fields import PARAMETER_IS_REAL, parameter_from_wire, parameter_to_wire
from sim.boards.channels import pulse_channels
from sim.bodies.vehicles import class_of

HOME_E7 = round(DEFAULT_HOME.lat_deg * 1e7), round(DEFAULT_HOME.lon_deg * 1e7)
GUIDED, AUTO, LOITER, TAKEOFF = 15, 10, 12, 13
SET_MODE, ARM, REPOSITION = 176, 400, 192
FULL_DEG = 45.0  # ArduPilot's angle of a surface at its end


@pytest.fixture(scope="module")
def params():
    return ardupilot_params(load_airframe("plane"))


def test_its_feed_forward_is_the_surface_of_a_steady_rate(params):
    """Its rate loop: degrees of a surface, at SCALING_SPEED = the airspeed."""
    airframe = load_airframe("plane")
    ours = plane_defaults(airframe)
    ailerons = degrees(params["RLL_RATE_FF"] * 0.7) / FULL_DEG
    assert ailerons == pytest.approx(ours["FW_RR_FF"] * 0.7)
    # what trim has to give for a circle of a loop, as for so much more weight, and the damping of that rate
    trim_m_s, rate_rad_s = ours["FW_AIRSPD_TRIM"], 0.1
    heavier = airframe.body.mass_kg * (1.0 + trim_m_s * rate_rad_s / GRAVITY_M_S2)
    loop = airframe.model_copy(update={"body": airframe.body.model_copy(update={"mass_kg": heavier})})
    pulled = level_flight(loop, trim_m_s).elevator - level_flight(airframe, trim_m_s).elevator
    elevator = degrees(params["PTCH_RATE_FF"] * rate_rad_s) / FULL_DEG
    assert elevator == pytest.approx(pulled + ours["FW_PR_FF"] * rate_rad_s, rel=0.1)


def test_its_speeds_and_limits_are_those_of_the_airframe(params):
    assert (params["AIRSPEED_MIN"], params["AIRSPEED_CRUISE"], params["TRIM_THROTTLE"]) == (17.1, 21.3, 60.0)
    assert params["AIRSPEED_STALL"] < params["AIRSPEED_MIN"] == params["TKOFF_ROTATE_SPD"]
    assert params["TECS_SINK_MIN"] < params["TECS_CLMB_MAX"] < params["AIRSPEED_CRUISE"] * sin(radians(20.0))
    assert "WP_RADIUS" not in params  # a place counts as reached within ours, it may turn from its own on


def test_each_channel_reaches_its_ends_and_has_its_function(params):
    airframe = load_airframe("plane")
    vehicle = class_of(airframe).vehicle
    names = [output.name for output in vehicle.outputs(airframe)]
    number = {n: c.number + 1 for n, c in zip(names, pulse_channels(vehicle, airframe), strict=True) if c is not None}
    assert len(number) == 6
    assert number["nose wheel"] == number["rudder"]
    assert {params[f"SERVO{k}_{end}"] for k in number.values() for end in ("MIN", "MAX")} == {1000.0, 2000.0}
    assert params[f"SERVO{number['brake']}_FUNCTION"] == 3.0


def test_its_names_of_parameters_fit_into_mavlink(params):
    assert max(map(len, params)) <= 16


@pytest.mark.parametrize("yaw_rad", [0.0, 2.0, -1.0])
def test_the_circle_before_a_landing_is_left_along_the_way_to_the_touchdown(yaw_rad):
    circle, land = landing_items(DEFAULT_HOME, yaw_rad)
    assert (land.x, land.y, land.z) == (DEFAULT_HOME.lat_deg, DEFAULT_HOME.lon_deg, 0.0)
    north, east, _ = ned_from_geodetic(circle.x, circle.y, DEFAULT_HOME.alt_m, DEFAULT_HOME)
    ahead = north * cos(yaw_rad) + east * sin(yaw_rad)
    to_right = -north * sin(yaw_rad) + east * cos(yaw_rad)
    assert to_right == pytest.approx(circle.params[1], abs=0.1)  # clockwise round it, its left side leads along the way
    assert degrees(circle.z / -ahead) == pytest.approx(3.6, abs=0.5)


class Plane:
    """An ArduPlane as its telemetry shows it: it obeys at once, and is where it is sent to."""

    def __init__(self):
        self.link, client = memory_pair(LinkRole.ONBOARD)
        self.drone = ArduPilotDrone(client)
        self.reader = FrameReader()
        self.time_us, self.mode, self.is_armed = 0, 0, False
        self.pos_ned = [0.0, 0.0, 0.0]
        self.params = {"TKOFF_ALT": 30.0, "WP_LOITER_RAD": 80.0}
        self.commands, self.items = [], []
        self.wind = None

    def say(self, name, **fields):
        self.link.send(encode(name, 1, 1, 0, **fields))

    def frame(self):
        self.time_us += 20_000
        self.say("HEARTBEAT", type=1, autopilot=3, base_mode=1 | 128 * self.is_armed, custom_mode=self.mode)
        self.say("HOME_POSITION", latitude=HOME_E7[0], longitude=HOME_E7[1], altitude=round(DEFAULT_HOME.alt_m * 1e3))
        self.say("LOCAL_POSITION_NED", **dict(zip("xyz", self.pos_ned, strict=True)))
        self.say("ATTITUDE", yaw=0.5)
        self.say("EXTENDED_SYS_STATE", landed_state=2 if self.is_armed else 1)
        if self.wind is not None:
            self.say("WIND", direction=self.wind[0], speed=self.wind[1])
        self.drone.frame(self.time_us)
        for data in self.link.receive():
            for frame in self.reader.feed(data):
                message = decode(frame)
                getattr(self, f"_{message.name.lower()}", lambda _: None)(message.fields)

    def _command_long(self, asked):
        self.commands.append(asked)
        if asked.command == SET_MODE:
            self.mode = int(asked.param2)
        if asked.command == ARM:
            self.is_armed = bool(asked.param1)
        self.say("COMMAND_ACK", command=asked.command, result=0)

    def _command_int(self, asked):
        self._command_long(asked)
        if asked.command == REPOSITION:
            self.mode = GUIDED

    def _param_set(self, asked):
        self.params[asked.param_id] = parameter_from_wire(asked, is_real=True)
        self._param_request_read(asked)

    def _param_request_read(self, asked):
        value = parameter_to_wire(self.params[asked.param_id], PARAMETER_IS_REAL)
        self.say("PARAM_VALUE", param_id=asked.param_id, param_value=value, param_type=PARAMETER_IS_REAL)

    def _mission_count(self, asked):
        self.count, self.items = asked.count, []
        self.say("MISSION_REQUEST_INT", seq=0)

    def _mission_item_int(self, item):
        self.items.append(item)
        if len(self.items) < self.count:
            self.say("MISSION_REQUEST_INT", seq=len(self.items))
        else:
            self.say("MISSION_ACK", type=0)

    def run(self, script, until=lambda: False):
        running = self.drone.start(script)
        for _ in range(2_000):
            self.frame()
            if running.is_done or until():
                break
        if running.error is not None:
            raise running.error
        return running


@pytest.fixture
def plane():
    made = Plane()
    made.frame()
    made.frame()
    return made


def test_a_take_off_is_told_its_height_and_ends_in_a_circle(plane):
    plane.run(plane.drone.arm())
    assert (plane.mode, plane.is_armed) == (GUIDED, True)
    running = plane.run(plane.drone.takeoff(45.0), until=lambda: plane.mode == TAKEOFF)
    assert plane.params["TKOFF_ALT"] == 45.0
    assert not running.is_done
    plane.pos_ned[2] = -41.0
    plane.run(plane.drone.sleep(0.5))
    assert running.is_done
    assert plane.mode == LOITER
    assert plane.drone.px4_mode == (4, 3)  # a script sees Hold


def test_a_goto_ends_when_it_circles_there(plane):
    running = plane.run(plane.drone.goto_ned(500.0, 0.0, -60.0), until=lambda: plane.mode == GUIDED)
    plane.run(plane.drone.sleep(1.0))
    assert not running.is_done
    plane.pos_ned[:] = 420.0, 0.0, -60.0
    plane.run(plane.drone.sleep(0.1))
    assert running.is_done


@pytest.mark.parametrize(("wind", "course_rad"), [((90.0, 4.0), 0.5 * pi), ((90.0, 0.5), 0.5), (None, 0.5)])
def test_it_lands_by_a_mission_against_the_wind_or_as_it_took_off(plane, wind, course_rad):
    plane.run(plane.drone.arm())
    plane.wind = wind
    running = plane.run(plane.drone.land(), until=lambda: plane.mode == AUTO)
    home, circle, land = plane.items
    assert (home.command, circle.command, land.command) == (16, 31, 21)
    north, east, _ = ned_from_geodetic(circle.x * 1e-7, circle.y * 1e-7, DEFAULT_HOME.alt_m, DEFAULT_HOME)
    assert north * cos(course_rad) + east * sin(course_rad) == pytest.approx(-480.0, abs=1.0)
    plane.is_armed = False
    plane.run(plane.drone.sleep(1.0))
    assert running.is_done


def test_a_mission_is_flown_in_auto(plane):
    plane.run(plane.drone.start_mission())
    assert (plane.mode, plane.is_armed) == (AUTO, True)


def test_it_rolls_without_waiting_for_a_throw(params):
    assert params["TKOFF_THR_MINACC"] == 0.0
