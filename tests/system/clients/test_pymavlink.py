"""Scripts as tutorials write them: pymavlink's mavutil over UDP, both dialects. The wall clock is the script's."""

from contextlib import contextmanager
from math import hypot, nan, radians

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mavlink

from common.clock import wall_time_s
from tests.system.vehicle import IdleVehicle

SPEED = 5.0
PATIENCE_S = 60.0  # wall clock
POSITION_ONLY, VELOCITY_ONLY = 0b110111111000, 0b110111000111
LOCAL_NED, BODY_NED, RELATIVE_INT = 1, 8, 6

pytestmark = pytest.mark.slow


class Script:
    """A connection, and the waits that every script has."""

    def __init__(self, connection):
        self.link = connection
        assert connection.wait_heartbeat(timeout=PATIENCE_S) is not None

    def wait(self, kind, condition):
        """The first message of a kind for which the condition holds."""
        end_s = wall_time_s() + PATIENCE_S
        while wall_time_s() < end_s:
            message = self.link.recv_match(type=kind, blocking=True, timeout=5)
            if message is not None and condition(message):
                return message
        raise AssertionError(f"waited in vain for {kind}; mode {self.link.flightmode}")

    def wait_ready(self):
        prearm = mavlink.MAV_SYS_STATUS_PREARM_CHECK
        self.wait("SYS_STATUS", lambda message: message.onboard_control_sensors_health & prearm)

    def wait_mode(self, name):
        self.wait("HEARTBEAT", lambda message: message.get_srcComponent() == 1 and self.link.flightmode == name)

    def wait_height(self, height_m, within_m=0.7):
        self.wait("GLOBAL_POSITION_INT", lambda message: abs(message.relative_alt * 1e-3 - height_m) < within_m)

    def wait_place(self, north, east, within_m=1.0):
        return self.wait("LOCAL_POSITION_NED", lambda message: hypot(message.x - north, message.y - east) < within_m)

    def command(self, number, *params):
        """Sends a COMMAND_LONG and waits for its result."""
        values = (*params, *(0.0,) * (7 - len(params)))
        self.link.mav.command_long_send(1, 1, number, 0, *values)
        return self.wait("COMMAND_ACK", lambda message: message.command == number).result

    def local_target(self, mask, x=0.0, y=0.0, z=0.0, vx=0.0, vy=0.0, vz=0.0, frame=LOCAL_NED):
        self.link.mav.set_position_target_local_ned_send(0, 1, 1, frame, mask, x, y, z, vx, vy, vz, 0, 0, 0, 0, 0)

    def wait_disarmed(self):
        self.wait("HEARTBEAT", lambda message: message.get_srcComponent() == 1 and not message.base_mode & 128)


@contextmanager
def flying(tmp_path, monkeypatch, *arguments):
    monkeypatch.setenv("MAVLINK20", "1")
    with IdleVehicle(tmp_path, *arguments, speed=SPEED) as vehicle:
        link = mavutil.mavlink_connection(f"udpin:127.0.0.1:{vehicle.api_port}", dialect="all")
        try:
            yield Script(link)
        finally:
            link.close()


def test_tutorial_for_ardupilot(tmp_path, monkeypatch):
    with flying(tmp_path, monkeypatch, "--dialect", "ardupilot") as script:
        link = script.link
        script.wait_ready()
        assert link.mode_mapping()["GUIDED"] == 4
        link.set_mode("GUIDED")
        script.wait_mode("GUIDED")
        link.arducopter_arm()
        link.motors_armed_wait()
        assert script.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 8) == 0
        script.wait_height(8.0)

        here = script.wait("GLOBAL_POSITION_INT", lambda _: True)
        north_e7 = here.lat + round(10.0 / 111_320.0 * 1e7)
        link.mav.set_position_target_global_int_send(
            0, 1, 1, RELATIVE_INT, POSITION_ONLY, north_e7, here.lon, 10.0, 0, 0, 0, 0, 0, 0, 0, 0
        )
        script.wait_place(10.0, 0.0)
        script.wait_height(10.0)

        assert script.command(mavlink.MAV_CMD_CONDITION_YAW, 90, 30, 1, 0) == 0
        script.wait("ATTITUDE", lambda message: abs(message.yaw - radians(90.0)) < 0.1)
        end_s = wall_time_s() + 1.5
        while wall_time_s() < end_s:  # ahead is east now
            script.local_target(VELOCITY_ONLY, vx=2.0, frame=BODY_NED)
            script.wait("ATTITUDE", lambda _: True)
        script.wait("LOCAL_POSITION_NED", lambda message: message.y > 8.0)
        script.wait("LOCAL_POSITION_NED", lambda message: abs(message.vy) < 0.2)  # it stops by itself

        # simple_goto of dronekit
        home = script.wait("HOME_POSITION", lambda _: True)
        link.mav.mission_item_send(
            1, 1, 0, 3, mavlink.MAV_CMD_NAV_WAYPOINT, 2, 0, 0, 0, 0, 0, home.latitude * 1e-7, home.longitude * 1e-7, 6.0
        )
        script.wait_place(0.0, 0.0, 1.5)
        link.set_mode("RTL")
        script.wait_mode("RTL")
        script.wait_disarmed()


def test_tutorial_for_px4(tmp_path, monkeypatch):
    with flying(tmp_path, monkeypatch) as script:
        link = script.link
        script.wait_ready()
        assert script.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, nan, nan, nan, nan) == 0
        link.arducopter_arm()
        link.motors_armed_wait()
        script.wait_mode("LOITER")
        end_s = wall_time_s() + 1.0
        while wall_time_s() < end_s:
            script.local_target(POSITION_ONLY, 8.0, 0.0, -6.0)
            script.wait("ATTITUDE", lambda _: True)
        link.set_mode("OFFBOARD")
        end_s = wall_time_s() + PATIENCE_S
        while True:
            script.local_target(POSITION_ONLY, 8.0, 0.0, -6.0)
            place = script.wait("LOCAL_POSITION_NED", lambda _: True)
            if hypot(place.x - 8.0, place.y) < 0.7:
                break
            assert wall_time_s() < end_s
        assert link.flightmode == "OFFBOARD"
        link.set_mode("LOITER")
        script.wait_mode("LOITER")
        link.set_mode_rtl()
        script.wait_mode("RTL")
        script.wait_disarmed()
