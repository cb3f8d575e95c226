"""Scripts in the manner of pymavlink's tutorials for ArduPilot, each a function of a connection: no test of its own.

`python pymavlink_tutorials.py NAME CONNECTION` runs one in a process of its own, as its user would. Each begins with a
bare `wait_heartbeat()`, answers what it is taught to answer and nothing else, and leaves a disarmed vehicle.
"""

import sys
from math import degrees, hypot

from pymavlink import mavutil, mavwp

PATIENCE_S = 60.0  # wall clock
POSITION_ONLY, VELOCITY_ONLY = 0b110111111000, 0b110111000111
PLACES = [(47.397742, 8.545594, 10.0), (47.397842, 8.545594, 12.0), (47.397842, 8.545694, 12.0)]
TUTORIALS = {}


def tutorial(script):
    TUTORIALS[script.__name__] = script
    return script


def connect(address):
    master = mavutil.mavlink_connection(address)
    master.wait_heartbeat()
    return master


def wait(master, kind, condition=lambda _: True):
    """recv_match in a loop, as scripts have it."""
    while True:
        message = master.recv_match(type=kind, blocking=True, timeout=PATIENCE_S)
        assert message is not None, f"no {kind}"
        if condition(message):
            return message


def acknowledged(master, command):
    return wait(master, "COMMAND_ACK", lambda message: message.command == command).result


def wait_mode(master, name):
    wait(master, "HEARTBEAT", lambda _: master.flightmode == name)


def wait_height(master, height_m):
    wait(master, "GLOBAL_POSITION_INT", lambda message: abs(message.relative_alt / 1000.0 - height_m) < 0.7)


def take_off(master, height_m=8.0):
    master.set_mode(master.mode_mapping()["GUIDED"])
    wait_mode(master, "GUIDED")
    master.arducopter_arm()
    master.motors_armed_wait()
    master.mav.command_long_send(
        master.target_system,
        master.target_component,
        mavutil.mavlink.MAV_CMD_NAV_TAKEOFF,
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        height_m,
    )
    assert acknowledged(master, mavutil.mavlink.MAV_CMD_NAV_TAKEOFF) == mavutil.mavlink.MAV_RESULT_ACCEPTED
    wait_height(master, height_m)


def land(master, mode="LAND"):
    master.set_mode(master.mode_mapping()[mode])
    master.motors_disarmed_wait()


# ---- on the ground ----


@tutorial
def first_heartbeat(address):
    for _ in range(10):
        master = mavutil.mavlink_connection(address)
        assert master.wait_heartbeat().get_srcComponent() == mavutil.mavlink.MAV_COMP_ID_AUTOPILOT1
        assert master.target_system == 1
        assert master.mav_type == mavutil.mavlink.MAV_TYPE_QUADROTOR
        assert master.mode_mapping()["GUIDED"] == 4
        assert not master.motors_armed()
        master.close()


@tutorial
def wait_until_it_may_be_armed(address):
    master = connect(address)
    prearm = mavutil.mavlink.MAV_SYS_STATUS_PREARM_CHECK
    wait(master, "SYS_STATUS", lambda message: message.onboard_control_sensors_health & prearm)


@tutorial
def modes_by_number(address):
    master = connect(address)
    for name in ("STABILIZE", "ALT_HOLD", "ACRO", "POSHOLD", "RTL", "LAND", "CIRCLE", "BRAKE", "LOITER", "GUIDED"):
        master.set_mode(master.mode_mapping()[name])
        assert acknowledged(master, mavutil.mavlink.MAV_CMD_DO_SET_MODE) == mavutil.mavlink.MAV_RESULT_ACCEPTED, name
        wait_mode(master, name)


@tutorial
def modes_by_the_old_message(address):
    master = connect(address)
    for name in ("STABILIZE", "GUIDED"):
        flag = mavutil.mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        master.mav.set_mode_send(master.target_system, flag, master.mode_mapping()[name])
        assert acknowledged(master, mavutil.mavlink.MAVLINK_MSG_ID_SET_MODE) == mavutil.mavlink.MAV_RESULT_ACCEPTED
        wait_mode(master, name)


@tutorial
def arm_and_disarm(address):
    master = connect(address)
    master.set_mode("RTL")
    wait_mode(master, "RTL")
    master.arducopter_arm()  # not in this mode
    assert acknowledged(master, mavutil.mavlink.MAV_CMD_COMPONENT_ARM_DISARM) != mavutil.mavlink.MAV_RESULT_ACCEPTED
    master.set_mode("STABILIZE")
    wait_mode(master, "STABILIZE")
    master.arducopter_arm()
    master.motors_armed_wait()
    master.arducopter_disarm()
    master.motors_disarmed_wait()


def mission():
    """Home, a take-off, two waypoints, and the return."""
    loader = mavwp.MAVWPLoader()
    commands = [16, 22, 16, 16]
    for command, place in zip(commands, [PLACES[0], *PLACES], strict=True):
        frame = mavutil.mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
        loader.add(mavutil.mavlink.MAVLink_mission_item_message(1, 1, 0, frame, command, 0, 1, 0, 0, 0, 0, *place))
    loader.add(mavutil.mavlink.MAVLink_mission_item_message(1, 1, 0, 3, 20, 0, 1, 0, 0, 0, 0, 0, 0, 0))
    return loader


@tutorial
def mission_by_the_old_protocol(address):
    master, loader = connect(address), mission()
    master.waypoint_clear_all_send()
    wait(master, "MISSION_ACK")
    master.waypoint_count_send(loader.count())
    for i in range(loader.count()):
        request = wait(master, "MISSION_REQUEST")
        assert request.seq == i
        master.mav.send(loader.wp(request.seq))
    assert wait(master, "MISSION_ACK").type == mavutil.mavlink.MAV_MISSION_ACCEPTED

    master.waypoint_request_list_send()
    assert wait(master, "MISSION_COUNT").count == loader.count()
    for i in range(1, loader.count()):
        master.waypoint_request_send(i)
        item = wait(master, "MISSION_ITEM", lambda message, i=i: message.seq == i)
        assert item.command == loader.wp(i).command
        assert abs(item.x - loader.wp(i).x) < 1e-5


def send_list(master, mission_type, items):
    """Knows MISSION_REQUEST alone, and answers with MISSION_ITEM_INT; returns the result."""
    master.mav.mission_count_send(1, 1, len(items), mission_type)
    for i, (command, p1, lat_deg, lon_deg) in enumerate(items):
        request = wait(master, "MISSION_REQUEST")
        assert (request.seq, request.mission_type) == (i, mission_type)
        place = round(lat_deg * 1e7), round(lon_deg * 1e7)
        master.mav.mission_item_int_send(1, 1, i, 0, command, 0, 1, p1, 0, 0, 0, *place, 20.0, mission_type)
    return wait(master, "MISSION_ACK", lambda message: message.mission_type == mission_type).type


@tutorial
def fence_and_rally_points_by_the_old_protocol(address):
    master = connect(address)
    corners = [(47.395, 8.543), (47.400, 8.543), (47.400, 8.549), (47.395, 8.549)]
    fence = [(mavutil.mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, 4.0, *corner) for corner in corners]
    assert send_list(master, mavutil.mavlink.MAV_MISSION_TYPE_FENCE, fence) == 0
    rally = [(mavutil.mavlink.MAV_CMD_NAV_RALLY_POINT, 0.0, 47.3975, 8.5455)]
    assert send_list(master, mavutil.mavlink.MAV_MISSION_TYPE_RALLY, rally) == 0
    for mission_type in (mavutil.mavlink.MAV_MISSION_TYPE_FENCE, mavutil.mavlink.MAV_MISSION_TYPE_RALLY):
        master.mav.mission_clear_all_send(1, 1, mission_type)
        assert wait(master, "MISSION_ACK", lambda message: message.mission_type == mission_type).type == 0  # noqa: B023


@tutorial
def home_of_an_empty_mission(address):
    master = connect(address)
    master.waypoint_clear_all_send()
    wait(master, "MISSION_ACK")
    master.waypoint_request_list_send()
    assert wait(master, "MISSION_COUNT").count == 0
    master.waypoint_request_send(0)
    home = wait(master, "MISSION_ITEM")
    assert (home.seq, round(home.x, 3), round(home.y, 3)) == (0, 47.398, 8.546)


@tutorial
def parameters(address):
    master = connect(address)
    master.param_fetch_all()
    first = wait(master, "PARAM_VALUE")
    indices = {first.param_index}
    while len(indices) < first.param_count:
        indices.add(wait(master, "PARAM_VALUE", lambda message: message.param_index < first.param_count).param_index)
    for value in (2000.0, 1500.0):
        master.mav.param_set_send(1, 1, b"RTL_ALT", value, mavutil.mavlink.MAV_PARAM_TYPE_REAL32)
        answer = wait(master, "PARAM_VALUE")  # the next one is taken for the answer
        assert (answer.param_id, answer.param_value) == ("RTL_ALT", value)
    master.param_fetch_one("WPNAV_SPEED")
    assert wait(master, "PARAM_VALUE").param_id == "WPNAV_SPEED"


@tutorial
def data_streams(address):
    master = connect(address)
    everything = mavutil.mavlink.MAV_DATA_STREAM_ALL
    master.mav.request_data_stream_send(master.target_system, master.target_component, everything, 4, 1)
    kinds = "ATTITUDE GLOBAL_POSITION_INT GPS_RAW_INT VFR_HUD SYS_STATUS RC_CHANNELS BATTERY_STATUS MISSION_CURRENT"
    for kind in (*kinds.split(), "HEARTBEAT"):
        wait(master, kind)
    place = master.location()
    assert (round(place.lat, 3), round(place.lng, 3)) == (47.398, 8.546)
    assert wait(master, "RC_CHANNELS").chan3_raw == 1000


@tutorial
def message_intervals(address):
    master = connect(address)
    master.mav.command_long_send(
        1, 1, mavutil.mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0,
        mavutil.mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, 100_000, 0, 0, 0, 0, 0,
    )  # fmt: skip
    assert acknowledged(master, mavutil.mavlink.MAV_CMD_SET_MESSAGE_INTERVAL) == 0
    times_ms = [wait(master, "ATTITUDE_QUATERNION").time_boot_ms for _ in range(11)]
    assert 900 <= times_ms[-1] - times_ms[0] <= 1100
    master.mav.command_long_send(
        1,
        1,
        mavutil.mavlink.MAV_CMD_REQUEST_MESSAGE,
        0,
        mavutil.mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
        0,
        0,
        0,
        0,
        0,
        0,
    )
    wait(master, "AUTOPILOT_VERSION")


@tutorial
def calibration_of_the_barometer(address):
    master = connect(address)
    master.mav.command_long_send(1, 1, mavutil.mavlink.MAV_CMD_PREFLIGHT_CALIBRATION, 0, 0, 0, 1, 0, 0, 0, 0)
    assert acknowledged(master, mavutil.mavlink.MAV_CMD_PREFLIGHT_CALIBRATION) == 0


# ---- in the air ----


@tutorial
def takeoff_and_land(address):
    master = connect(address)
    take_off(master)
    land(master)
    wait_mode(master, "LAND")  # it stays


@tutorial
def local_setpoints(address):
    master = connect(address)
    take_off(master)

    def target(frame, mask, position=(0, 0, 0), velocity=(0, 0, 0)):
        master.mav.set_position_target_local_ned_send(
            0, master.target_system, master.target_component, frame, mask, *position, *velocity, 0, 0, 0, 0, 0
        )

    target(mavutil.mavlink.MAV_FRAME_LOCAL_NED, POSITION_ONLY, (6, 4, -10))
    there = wait(master, "LOCAL_POSITION_NED", lambda message: hypot(message.x - 6, message.y - 4) < 1.0)
    wait_height(master, 10.0)
    start = there.x
    while there.x < start + 4.0:
        target(mavutil.mavlink.MAV_FRAME_LOCAL_NED, VELOCITY_ONLY, velocity=(2, 0, 0))
        there = wait(master, "LOCAL_POSITION_NED")
    wait(master, "LOCAL_POSITION_NED", lambda message: abs(message.vx) < 0.2)  # it stops by itself
    land(master, "RTL")
    wait_mode(master, "RTL")


@tutorial
def global_setpoint_and_heading(address):
    master = connect(address)
    take_off(master)
    lat_deg, lon_deg, _ = PLACES[1]
    master.mav.set_position_target_global_int_send(
        0, 1, 1, mavutil.mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, POSITION_ONLY,
        round(lat_deg * 1e7), round(lon_deg * 1e7), 10.0, 0, 0, 0, 0, 0, 0, 0, 0,
    )  # fmt: skip
    wait(master, "GLOBAL_POSITION_INT", lambda message: abs(message.lat / 1e7 - lat_deg) < 1e-5)
    master.mav.command_long_send(1, 1, mavutil.mavlink.MAV_CMD_CONDITION_YAW, 0, 90, 30, 1, 0, 0, 0, 0)
    assert acknowledged(master, mavutil.mavlink.MAV_CMD_CONDITION_YAW) == 0
    wait(master, "ATTITUDE", lambda message: abs(degrees(message.yaw) - 90.0) < 5.0)
    land(master, "RTL")


@tutorial
def overridden_channels(address):
    master = connect(address)
    leave = 65535

    def throttle(pulse_us):
        channels = [leave, leave, pulse_us, *[leave] * 15]
        master.mav.rc_channels_override_send(master.target_system, master.target_component, *channels)

    master.set_mode("ALT_HOLD")
    wait_mode(master, "ALT_HOLD")
    master.arducopter_arm()
    master.motors_armed_wait()
    height_mm = 0
    while height_mm < 4000:
        throttle(1700)
        height_mm = wait(master, "GLOBAL_POSITION_INT").relative_alt
    assert wait(master, "RC_CHANNELS", lambda message: message.chan3_raw == 1700).chan1_raw == 1500
    master.set_mode("LOITER")
    throttle(1500)
    wait_mode(master, "LOITER")
    throttle(0)  # back to the radio: no failsafe
    assert wait(master, "RC_CHANNELS", lambda message: message.chan3_raw == 1000)
    for _ in range(5):
        wait(master, "HEARTBEAT")
        assert master.flightmode == "LOITER"
    land(master)


@tutorial
def auto(address):
    """Flies the mission that the vehicle has."""
    mission_by_the_old_protocol(address)
    master = connect(address)
    master.set_mode("GUIDED")
    wait_mode(master, "GUIDED")
    master.arducopter_arm()
    master.motors_armed_wait()
    master.set_mode("AUTO")
    master.mav.command_long_send(1, 1, mavutil.mavlink.MAV_CMD_MISSION_START, 0, 0, 0, 0, 0, 0, 0, 0)
    for seq in (2, 3):
        wait(master, "MISSION_ITEM_REACHED", lambda message, seq=seq: message.seq == seq)
    master.motors_disarmed_wait()


@tutorial
def reboot(address):
    master = connect(address)
    master.reboot_autopilot()
    assert acknowledged(master, mavutil.mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN) == 0
    master.wait_heartbeat()
    assert not master.motors_armed()


if __name__ == "__main__":
    TUTORIALS[sys.argv[1]](sys.argv[2])
