from math import degrees, isnan, nan, pi
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.outputs import Output, OutputKind
from autopilot.interface.vehicle_state import LandedState, Mode
from autopilot.mavlink.telemetry.telemetry_rates import STREAMS, StreamSchedule
from autopilot.mavlink.transport.links import LinkRole
from autopilot.mavlink.wire.codec import message_id
from autopilot.ports import POSITION_VALID, WIND_VALID, Actuators
from tests.unit.autopilot.mavlink.rig import HOME, Rig, record


def request(rig: Rig, name: str) -> Any:
    """The message, asked for with REQUEST_MESSAGE."""
    rig.frame(3)
    for stream in STREAMS:
        rig.server._endpoint.channels[0].schedule.set_interval(message_id(stream.name), -1)
    rig.client.command(512, message_id(name))
    return rig.only(name)


def without(rig: Rig, flag: int) -> None:
    estimate = rig.vehicle.state.estimate
    rig.update(estimate=estimate._replace(flags=estimate.flags & ~flag))


@pytest.mark.parametrize("role", LinkRole)
def test_default_rates(role):
    rig = Rig(role)
    rig.frame(100)
    seconds = 20
    counts: dict[str, int] = {}
    for message in rig.frame(50 * seconds):
        counts[message.name] = counts.get(message.name, 0) + 1
    for stream in STREAMS:
        rate_hz = stream.ground_hz if role is LinkRole.GROUND else stream.onboard_hz
        assert counts.get(stream.name, 0) == pytest.approx(rate_hz * seconds, abs=1), stream.name


def test_messages_are_spread_over_the_frames():
    rig = Rig()
    rig.frame(100)
    counts = [len(rig.frame()) for _ in range(500)]
    assert max(counts) <= 8


def test_what_is_due_on_several_links_is_packed_once():
    rig = Rig()
    rig.frame(3)
    endpoint, built = rig.server._endpoint, {}
    one, other = (StreamSchedule(endpoint.telemetry, LinkRole.GROUND) for _ in range(2))
    first = one.due(rig.time_us, endpoint.vehicle.state, built)
    assert len(first) > 3
    for (kind, payload), (same_kind, same) in zip(
        first, other.due(rig.time_us, endpoint.vehicle.state, built), strict=True
    ):
        assert kind is same_kind
        assert payload is same


@pytest.mark.parametrize("stream", STREAMS, ids=lambda stream: stream.name)
def test_every_stream_can_be_requested(stream):
    rig = Rig()
    rig.update(motor_count=8)
    assert request(rig, stream.name) is not None


def test_attitude():
    rig = Rig()
    attitude = request(rig, "ATTITUDE")
    assert attitude.time_boot_ms == rig.time_us // 1000
    assert attitude[1:] == pytest.approx((0.05, -0.02, 1.2, 0.1, 0.2, 0.3))


def test_quaternion_order_is_w_x_y_z():
    quaternion = request(Rig(), "ATTITUDE_QUATERNION")
    assert (quaternion.q1, quaternion.q2, quaternion.q3, quaternion.q4) == pytest.approx((0.8, 0.0, 0.0, 0.6))
    assert quaternion.repr_offset_q == (0.0,) * 4


def test_global_position():
    position = request(Rig(), "GLOBAL_POSITION_INT")
    assert (position.lat, position.lon) == pytest.approx((473978320, 85458590), abs=2)  # 2 cm
    assert position.alt == 518_000
    assert position.relative_alt == 30_000
    assert (position.vx, position.vy, position.vz) == (100, 200, -50)
    assert position.hdg == round(degrees(1.2) * 100)


def test_local_position():
    position = request(Rig(), "LOCAL_POSITION_NED")
    assert position[1:] == pytest.approx((10.0, 20.0, -30.0, 1.0, 2.0, -0.5))


@pytest.mark.parametrize("name", ["GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "ODOMETRY"])
def test_position_that_is_not_known_is_not_sent(name):
    rig = Rig()
    without(rig, POSITION_VALID)
    assert rig.all(name, 100) == []
    rig.client.command(512, message_id(name))
    assert rig.only("COMMAND_ACK").result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED


def test_heading_without_alignment_is_unknown():
    rig = Rig()
    without(rig, 2)
    assert request(rig, "GLOBAL_POSITION_INT").hdg == 65_535


def test_vfr_hud():
    hud = request(Rig(), "VFR_HUD")
    assert hud.groundspeed == pytest.approx(5**0.5)
    assert hud.airspeed == pytest.approx((2.0**2 + 6.0**2 + 0.5**2) ** 0.5)  # wind from the east and the south
    assert (hud.heading, hud.throttle) == (int(degrees(1.2)), 42)
    assert (hud.alt, hud.climb) == pytest.approx((518.0, 0.5), abs=1e-3)


def test_airspeed_without_wind_is_0():
    rig = Rig()
    without(rig, WIND_VALID)
    assert request(rig, "VFR_HUD").airspeed == 0.0


def test_altitude():
    altitude = request(Rig(), "ALTITUDE")
    assert altitude.altitude_amsl == pytest.approx(518.0, abs=1e-3)
    assert altitude.altitude_relative == pytest.approx(30.0, abs=1e-3)
    assert altitude.altitude_local == pytest.approx(30.0, abs=1e-3)
    assert altitude.altitude_terrain == HOME.alt_m + 1.0
    assert altitude.bottom_clearance == 29.0


def test_gps():
    gps = request(Rig(), "GPS_RAW_INT")
    assert (gps.fix_type, gps.satellites_visible) == (3, 14)
    assert gps.lat == pytest.approx(473977420 + 10.1 / 111_180 * 1e7, abs=20)
    assert gps.alt == pytest.approx(518_200, abs=2)
    assert (gps.eph, gps.h_acc, gps.v_acc) == (70, 700, 1000)
    assert gps.vel == 224
    assert gps.cog == pytest.approx(6343, abs=1)


def test_battery():
    rig = Rig()
    battery = request(rig, "BATTERY_STATUS")
    assert battery.voltages == (15_800, *(65_535,) * 9)
    assert (battery.current_battery, battery.current_consumed, battery.battery_remaining) == (1250, 400, 80)
    status = request(rig, "SYS_STATUS")
    assert (status.voltage_battery, status.current_battery, status.battery_remaining) == (15_800, 1250, 80)


def test_unknown_charge_is_minus_1():
    rig = Rig()
    rig.update(battery_remaining=nan)
    assert request(rig, "SYS_STATUS").battery_remaining == -1


def test_everything_enabled_is_healthy_when_all_works():
    rig = Rig()
    status = request(rig, "SYS_STATUS")
    assert status.onboard_control_sensors_enabled & ~status.onboard_control_sensors_health == 0
    assert status.onboard_control_sensors_present & mavlink.MAV_SYS_STATUS_GEOFENCE
    assert status.onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_GEOFENCE
    assert not status.onboard_control_sensors_enabled & mavlink.MAV_SYS_STATUS_GEOFENCE


def test_prearm_bit_is_the_result_of_the_checks():
    rig = Rig()
    rig.update(is_armed=False, is_ready_to_arm=False)
    bit = mavlink.MAV_SYS_STATUS_PREARM_CHECK
    status = request(rig, "SYS_STATUS")
    assert status.onboard_control_sensors_present & status.onboard_control_sensors_enabled & bit
    assert not status.onboard_control_sensors_health & bit
    rig.update(is_ready_to_arm=True)
    assert request(rig, "SYS_STATUS").onboard_control_sensors_health & bit


@pytest.mark.parametrize(
    ("sensor", "bit"),
    [
        ("imu", mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO),
        ("mag", mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG),
        ("baro", mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE),
        ("gnss", mavlink.MAV_SYS_STATUS_SENSOR_GPS),
        ("battery", mavlink.MAV_SYS_STATUS_SENSOR_BATTERY),
    ],
)
def test_sensor_that_went_silent_is_not_healthy(sensor, bit):
    rig = Rig()
    assert request(rig, "SYS_STATUS").onboard_control_sensors_health & bit
    samples = rig.vehicle.state.samples
    rig.update(samples=samples._replace(**{sensor: getattr(samples, sensor)._replace(time_us=3_000_000)}))
    assert not request(rig, "SYS_STATUS").onboard_control_sensors_health & bit


def test_sensor_that_is_stuck_is_not_healthy():
    rig = Rig()
    health = rig.vehicle.state.health
    rig.update(health=health._replace(mag_inbox=health.mag_inbox._replace(is_stuck=1)))
    assert not request(rig, "SYS_STATUS").onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG


def test_range_finder_is_present_once_it_has_spoken():
    rig = Rig()
    bit = mavlink.MAV_SYS_STATUS_SENSOR_LASER_POSITION
    assert request(rig, "SYS_STATUS").onboard_control_sensors_present & bit
    samples = rig.vehicle.state.samples
    rig.update(samples=samples._replace(range=samples.range._replace(time_us=0)))
    assert not request(rig, "SYS_STATUS").onboard_control_sensors_present & bit


def test_distance():
    rig = Rig()
    distance = request(rig, "DISTANCE_SENSOR")
    assert (distance.current_distance, distance.orientation) == (2900, 25)
    samples = rig.vehicle.state.samples
    rig.update(samples=samples._replace(range=samples.range._replace(is_valid=0)))
    assert request(rig, "DISTANCE_SENSOR").current_distance > distance.max_distance


def test_home():
    rig = Rig()
    rig.update(home_yaw_rad=pi / 2, home_ned=(1.0, 2.0, 3.0))
    home = request(rig, "HOME_POSITION")
    assert (home.latitude, home.longitude, home.altitude) == (473977420, 85455940, 488_000)
    assert (home.x, home.y, home.z) == (1.0, 2.0, 3.0)
    assert home.q == pytest.approx((0.5**0.5, 0.0, 0.0, 0.5**0.5))


def test_landed_state_is_message_245():
    rig = Rig()
    rig.update(landed_state=LandedState.LANDING)
    assert message_id("EXTENDED_SYS_STATE") == 245
    assert request(rig, "EXTENDED_SYS_STATE").landed_state == mavlink.MAV_LANDED_STATE_LANDING


def test_mission_progress():
    rig = Rig()
    rig.update(mission_state=mavlink.MISSION_STATE_ACTIVE)
    current = request(rig, "MISSION_CURRENT")
    assert (current.seq, current.total, current.mission_state) == (1, 2, mavlink.MISSION_STATE_ACTIVE)
    assert current.mission_mode == 2  # something else is flown
    rig.update(mode=Mode.MISSION)
    assert request(rig, "MISSION_CURRENT").mission_mode == 1


def test_motors():
    rig = Rig()
    servos = request(rig, "SERVO_OUTPUT_RAW")
    assert (servos.servo1_raw, servos.servo2_raw, servos.servo5_raw) == (1500, 1600, 1000)
    outputs = request(rig, "ACTUATOR_OUTPUT_STATUS")
    assert outputs.active == 0b1111
    assert outputs.actuator[:4] == pytest.approx((0.5, 0.6, 0.5, 0.6))


def test_a_command_out_of_bounds_is_told_as_a_pulse_within_them():
    rig = Rig()
    rig.update(actuators=record(Actuators, "Actuators", command=(70.0, nan, -1.0, 1.0, 0.0, 0.0, 0.0, 0.0)))
    servos = request(rig, "SERVO_OUTPUT_RAW")
    assert (servos.servo1_raw, servos.servo2_raw, servos.servo3_raw, servos.servo4_raw) == (2000, 1000, 1000, 2000)


def test_flown_trajectory_marks_free_elements():
    target = request(Rig(), "POSITION_TARGET_LOCAL_NED")
    assert (target.x, target.y, target.z, target.yaw) == (10.0, 20.0, -30.0, 0.5)
    assert target.type_mask == 2048
    assert target.coordinate_frame == mavlink.MAV_FRAME_LOCAL_NED
    there = request(Rig(), "POSITION_TARGET_GLOBAL_INT")
    assert there.lat_int > 473977420
    assert there.alt == pytest.approx(518.0, abs=0.01)


def test_on_the_way_to_a_goto_the_position_target_is_the_place_gone_to():
    """As PX4 and ArduPilot have it: whoever did not send the goto reads there where it leads."""
    rig = Rig()
    rig.update(mode=Mode.HOLD, goal_ned=(100.0, 0.0, -12.0), path_start_ned=(0.0, 0.0, -10.0))
    there = request(rig, "POSITION_TARGET_GLOBAL_INT")
    assert there.lat_int == pytest.approx(round(HOME.lat_deg * 1e7) + 8994, abs=20)
    assert there.alt == pytest.approx(500.0, abs=0.01)
    rig.update(path_start_ned=(nan, nan, nan))
    assert request(rig, "POSITION_TARGET_GLOBAL_INT").alt == pytest.approx(518.0, abs=0.01)


def test_attitude_target():
    target = request(Rig(), "ATTITUDE_TARGET")
    assert target.q == pytest.approx((1.0, 0.0, 0.0, 0.0))
    assert target.thrust == pytest.approx(0.42)


def test_imu():
    imu = request(Rig(), "HIGHRES_IMU")
    assert imu.zacc == pytest.approx(-9.81)
    assert imu.abs_pressure == pytest.approx(950.0)
    assert imu.pressure_alt == pytest.approx(540.3, abs=0.5)  # ICAO Doc 7488, 950 hPa
    assert imu.fields_updated & 0x1FF == 0x1FF
    scaled = request(Rig(), "SCALED_IMU")
    assert (scaled.zacc, scaled.zmag) == (pytest.approx(-1000, abs=2), 400)
    assert request(Rig(), "SCALED_PRESSURE").temperature == 2150


def test_estimator_status():
    status = request(Rig(), "ESTIMATOR_STATUS")
    assert status.flags & 0x3F == 0x3F
    assert status.pos_horiz_ratio == pytest.approx(0.1)
    assert (status.pos_horiz_accuracy, status.pos_vert_accuracy) == pytest.approx((0.4, 0.3))


def test_estimators_health_may_be_unknown():
    rig = Rig()
    rig.update(health=None)
    assert rig.all("VIBRATION", 100) == []
    assert request(rig, "ESTIMATOR_STATUS").mag_ratio == 0.0


def test_lost_estimate_does_not_stop_the_telemetry():
    rig = Rig()
    state = rig.vehicle.state
    lost = (nan, nan, nan)
    rig.update(
        estimate=state.estimate._replace(pos_ned=lost, vel_ned=lost, omega_frd=lost, q_ned_from_frd=(nan,) * 4),
        yaw_rad=nan,
        actuators=state.actuators._replace(thrust_sp=nan, traj_pos_ned=lost, command=(nan,) * 8),
        samples=state.samples._replace(
            gnss=state.samples.gnss._replace(pos_ned=lost, vel_ned=lost),
            battery=state.samples.battery._replace(voltage_v=nan, current_a=nan),
        ),
    )
    for stream in STREAMS:
        rig.client.command(511, message_id(stream.name), 20_000.0)
    messages = rig.frame(50)
    assert {message.name for message in messages} >= {"GLOBAL_POSITION_INT", "ATTITUDE", "VFR_HUD", "SYS_STATUS"}


def test_position_and_wind():
    wind = request(Rig(), "WIND_COV")
    assert (wind.wind_x, wind.wind_y) == (3.0, -4.0)
    odometry = request(Rig(), "ODOMETRY")
    assert odometry.q == pytest.approx((0.8, 0.0, 0.0, 0.6))
    assert odometry.pose_covariance[0] == pytest.approx(0.16)
    assert isnan(odometry.pose_covariance[1])


def test_data_stream_request_sets_a_group():
    rig = Rig()
    rig.client.send("REQUEST_DATA_STREAM", target_component=1, req_stream_id=10, req_message_rate=2, start_stop=1)
    rig.frame(50)
    assert len(rig.all("ATTITUDE", 500)) == 20
    rig.client.send("REQUEST_DATA_STREAM", target_component=1, req_stream_id=0, req_message_rate=4, start_stop=0)
    rig.frame()
    names = {message.name for message in rig.frame(200)}
    assert "ATTITUDE" not in names
    assert "GLOBAL_POSITION_INT" not in names
    assert "HEARTBEAT" in names


def test_outputs_that_go_both_ways_are_pulses_round_1500_us():
    rig = Rig()
    signed = [Output("steering", OutputKind.SERVO, True), Output("motor", OutputKind.MOTOR, True)]
    command = (-1.0, 0.5, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0)
    actuators = record(Actuators, "Actuators", command=command)
    rig.update(outputs=(*signed, Output("brake", OutputKind.SERVO)), actuators=actuators)
    servos = request(rig, "SERVO_OUTPUT_RAW")
    assert (servos.servo1_raw, servos.servo2_raw, servos.servo3_raw) == (1000, 1750, 1250)
    rig.update(actuators=record(Actuators, "Actuators", command=(0.0, -3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
    servos = request(rig, "SERVO_OUTPUT_RAW")
    assert (servos.servo1_raw, servos.servo2_raw, servos.servo3_raw) == (1500, 1000, 1000)
