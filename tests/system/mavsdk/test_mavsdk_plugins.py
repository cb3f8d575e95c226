"""MAVSDK 4.1's smaller plugins against the vehicle, in one process: what each of them can do, done once.

The Tune plugin is left
out: its Python binding passes no list of notes to the library (`int(song_elements)`); tunes are tested by message.
"""

import base64
import math
from math import nan

import pytest
from mavsdk.plugins.action import Action, ActionError
from mavsdk.plugins.follow_me import Config, FollowMe, TargetLocation
from mavsdk.plugins.gripper import Gripper, GripperError
from mavsdk.plugins.info import Info
from mavsdk.plugins.rtk import RtcmData, Rtk
from mavsdk.plugins.server_utility import ServerUtility, StatusTextType
from mavsdk.plugins.telemetry import Telemetry
from mavsdk.plugins.transponder import Transponder
from mavsdk.plugins.winch import Winch, WinchError

from autopilot.interface.vehicle_state import Mode
from common.geodesy import DEFAULT_HOME, geodetic_from_ned
from mission.flight import FlightConfig
from tests.system.raw_vehicle import OPEN, RawVehicle
from tests.unit.autopilot.mavlink.services.actions.test_device_commands import rtcm


@pytest.fixture(scope="module")
def vehicle():
    with RawVehicle(FlightConfig(world=OPEN, traffic_count=3)) as vehicle:
        yield vehicle


@pytest.fixture(scope="module")
def telemetry(vehicle):
    telemetry = vehicle.plugin(Telemetry)
    vehicle.until(telemetry.health_all_ok, 30.0, "healthy")
    return telemetry


def test_info(vehicle):
    info = vehicle.plugin(Info)
    version = info.get_version()
    assert (version.flight_sw_major, version.flight_sw_minor) >= (1, 14)
    assert info.get_identification().hardware_uid
    assert info.get_product().vendor_id >= 0


# Every stream of the telemetry plugin that this vehicle feeds, with something that must be true of it.
STREAMS = {
    "position": lambda p: abs(p.latitude_deg - DEFAULT_HOME.lat_deg) < 0.001,
    "home": lambda p: abs(p.latitude_deg - DEFAULT_HOME.lat_deg) < 0.001,
    "in_air": lambda flag: flag is False,
    "landed_state": lambda state: state.name == "ON_GROUND",
    "armed": lambda flag: flag is False,
    "attitude_quaternion": lambda q: abs(q.w**2 + q.x**2 + q.y**2 + q.z**2 - 1.0) < 1e-3,
    "attitude_euler": lambda e: abs(e.roll_deg) < 5.0,
    "attitude_angular_velocity_body": lambda w: abs(w.roll_rad_s) < 0.2,
    "velocity_ned": lambda v: abs(v.north_m_s) < 1.0,
    "gps_info": lambda g: g.num_satellites > 5,
    "raw_gps": lambda g: abs(g.latitude_deg - DEFAULT_HOME.lat_deg) < 0.001,
    "battery": lambda b: 12.0 < b.voltage_v < 17.5 and b.remaining_percent > 50.0,
    "flight_mode": lambda mode: mode.name == "HOLD",
    "health": lambda h: h.is_armable and h.is_global_position_ok,
    "actuator_output_status": lambda a: len(a.actuator) > 0,
    "odometry": lambda o: abs(o.position_body.x_m) < 3.0,
    "position_velocity_ned": lambda p: abs(p.position.north_m) < 3.0,
    "ground_truth": lambda g: abs(g.latitude_deg - DEFAULT_HOME.lat_deg) < 0.001,
    "fixedwing_metrics": lambda m: abs(m.climb_rate_m_s) < 1.0,
    "imu": lambda i: abs(i.acceleration_frd.down_m_s2 + 9.8) < 1.0,
    "scaled_imu": lambda i: i.acceleration_frd.down_m_s2 != 0.0,
    "raw_imu": lambda i: i.acceleration_frd.down_m_s2 != 0.0,
    "health_all_ok": lambda flag: flag is True,
    "unix_epoch_time": lambda t: t >= 0,
    "distance_sensor": lambda d: 0.0 < d.current_distance_m < 1.0,
    "scaled_pressure": lambda p: 800.0 < p.absolute_pressure_hpa < 1100.0,
    "heading": lambda h: 0.0 <= h.heading_deg <= 360.0,
    "altitude": lambda a: abs(a.altitude_relative_m) < 3.0,
}
RATES = {
    "odometry": "odometry", "imu": "imu", "scaled_imu": "scaled_imu", "raw_imu": "raw_imu",
    "actuator_output_status": "actuator_output_status", "ground_truth": "ground_truth",
    "unix_epoch_time": "unix_epoch_time",
}  # fmt: skip
"""Streams that are only sent when asked for."""


@pytest.mark.parametrize("name", STREAMS)
def test_telemetry_stream(vehicle, telemetry, name):
    heard = []
    getattr(telemetry, f"subscribe_{name}")(lambda value, _: heard.append(value))
    if name in RATES:
        getattr(telemetry, f"set_rate_{RATES[name]}")(10.0)
    vehicle.until(lambda: len(heard) > 0, 10.0, f"told {name}")
    assert STREAMS[name](heard[-1]), heard[-1]


def test_telemetry_tells_texts_and_the_origin(vehicle, telemetry):
    heard = []
    telemetry.subscribe_status_text(lambda text, _: heard.append(text.text))
    with pytest.raises(ActionError):
        vehicle.plugin(Action).goto_location(47.0, 8.0, 500.0, nan)
    vehicle.until(lambda: "Goto: not in the air" in heard, 5.0, "told why")
    origin = telemetry.get_gps_global_origin()
    assert origin.latitude_deg == pytest.approx(DEFAULT_HOME.lat_deg, abs=1e-6)


def test_gripper(vehicle):
    gripper = vehicle.plugin(Gripper)
    gripper.grab(0)
    gripper.release(0)
    with pytest.raises(GripperError):
        gripper.grab(7)


def test_winch(vehicle):
    winch = vehicle.plugin(Winch)
    heard = []
    winch.subscribe_status(lambda status, _: heard.append(status.line_length_m))
    winch.relative_length_control(0, 2.0, 1.0)
    vehicle.until(lambda: heard and abs(heard[-1] - 2.0) < 0.01, 15.0, "let out")
    for action in (winch.hold, winch.lock, winch.deliver, winch.retract, winch.relax, winch.load_payload):
        action(0)
    winch.rate_control(0, -0.5)
    winch.abandon_line(0)
    with pytest.raises(WinchError):
        winch.deliver(0)
    winch.load_line(0)
    vehicle.until(lambda: abs(heard[-1]) < 0.01, 15.0, "in")


def test_rtk_corrections_make_the_receiver_exact(vehicle, telemetry):
    rtk = vehicle.plugin(Rtk)
    data = base64.b64encode(rtcm(300)).decode()
    for _ in range(5):
        rtk.send_rtcm_data(RtcmData(data))
        vehicle.pause(1.0)
    vehicle.until(lambda: telemetry.gps_info().fix_type.name == "RTK_FIXED", 5.0, "fixed")
    assert telemetry.raw_gps().horizontal_uncertainty_m < 0.05
    vehicle.until(lambda: telemetry.gps_info().fix_type.name == "FIX_3D", 20.0, "a plain fix again")


def test_transponder(vehicle):
    transponder = vehicle.plugin(Transponder)
    heard = {}
    transponder.subscribe_transponder(lambda aircraft, _: heard.setdefault(aircraft.icao_address, aircraft))
    transponder.set_rate_transponder(1.0)
    vehicle.until(lambda: len(heard) == 3, 10.0, "all heard")
    assert all(aircraft.absolute_altitude_m > DEFAULT_HOME.alt_m for aircraft in heard.values())
    assert all(aircraft.callsign.startswith("HB-") for aircraft in heard.values())


def test_server_utility_text_reaches_the_other_links(vehicle):
    vehicle.plugin(ServerUtility).send_status_text(StatusTextType.INFO, "hello from the ground")
    vehicle.until(lambda: "hello from the ground" in vehicle.overheard, 5.0, "passed on")


def test_action_settings_and_outputs(vehicle):
    action = vehicle.plugin(Action)
    action.set_takeoff_altitude(7.0)
    assert action.get_takeoff_altitude() == pytest.approx(7.0)
    action.set_return_to_launch_altitude(25.0)
    assert action.get_return_to_launch_altitude() == pytest.approx(25.0)
    action.set_actuator(2, 0.5)
    vehicle.until(lambda: vehicle.state.aux_pulses_us[1] == 1750, 2.0, "set")
    action.set_relay(1, action_relay_on())
    vehicle.until(lambda: vehicle.state.relays == 2, 2.0, "on")
    with pytest.raises(ActionError):
        action.transition_to_fixedwing()
    action.set_current_speed(3.0)


def action_relay_on():
    from mavsdk.plugins.action import RelayCommand

    return RelayCommand.ON


@pytest.mark.slow
def test_follow_me_and_orbit(vehicle):
    action, follow = vehicle.plugin(Action), vehicle.plugin(FollowMe)
    vehicle.airborne(action)
    config = follow.get_config()
    assert config.follow_distance_m == pytest.approx(8.0)
    follow.set_config(Config(10.0, 12.0, 0.2, config.altitude_mode, 8.0, 180.0))
    assert vehicle.flight.params["FLW_TGT_DST"] == pytest.approx(12.0)
    follow.start()
    vehicle.until(lambda: vehicle.state.mode is Mode.FOLLOW and follow.is_active(), 10.0, "following")
    north = 20.0
    for _ in range(30):
        north += 2.0
        latitude, longitude, altitude = geodetic_from_ned(north, 0.0, 0.0, DEFAULT_HOME)
        follow.set_target_location(TargetLocation(latitude, longitude, altitude, 2.0, 0.0, 0.0))
        vehicle.pause(1.0)
    here = vehicle.state.estimate.pos_ned
    winds = []
    vehicle.plugin(Telemetry).subscribe_wind(lambda wind, _: winds.append(wind))
    vehicle.until(lambda: winds, 5.0, "told the wind")
    assert abs(winds[-1].wind_x_ned_m_s) < 2.0
    assert math.hypot(here[0] - (north - 12.0), here[1]) < 3.0
    follow.stop()
    vehicle.until(lambda: vehicle.state.mode is Mode.HOLD, 5.0, "holding")

    latitude, longitude, _ = geodetic_from_ned(here[0], 30.0, 0.0, DEFAULT_HOME)
    action.do_orbit(10.0, 3.0, orbit_to_centre(), latitude, longitude, DEFAULT_HOME.alt_m + 12.0)
    vehicle.until(lambda: vehicle.state.mode is Mode.ORBIT, 5.0, "in orbit")
    vehicle.pause(15.0)
    here = vehicle.state.estimate.pos_ned
    centre = vehicle.state.orbit.centre
    assert centre.lat_deg == pytest.approx(latitude)
    action.land()
    vehicle.until(lambda: not vehicle.state.is_armed, 60.0, "landed")


def orbit_to_centre():
    from mavsdk.plugins.action import OrbitYawBehavior

    return OrbitYawBehavior.HOLD_FRONT_TO_CIRCLE_CENTER
