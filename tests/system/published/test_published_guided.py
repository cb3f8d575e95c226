"""Offboard and Guided as PX4's and ArduPilot's own flight tests judge them: the published tolerance or a tighter one.

Each test quotes what is published.
"""

from functools import partial
from math import cos, degrees, hypot, pi, radians, sin

import numpy as np
import pytest

from tests.system.published.published_rules import Flown, Station

SETPOINT_MASK = {"velocity": 0b1101_1100_0111, "position": 0b1101_1111_1000, "velocity and yaw rate": 0b0101_1100_0111,
                 "velocity and yaw": 0b1001_1100_0111}  # fmt: skip
CONDITION_YAW, LAND = 115, 21
LOITER, RTL = 5, 6  # COPTER_MODE


def turned_deg(angle_rad):
    """The angle between -180 and 180."""
    return (degrees(angle_rad) + 180.0) % 360.0 - 180.0


def test_offboard_takeoff_and_land():
    """PX4: "offboard takeoff and land: to 2 m, within 0.3 m (3D) in 90 s; land by velocity 1 m/s; home within 2 m in
    truth"."""
    flown = Flown()

    async def script(drone):
        await drone.wait_ready()
        drone.offboard_position(0.0, 0.0, -2.0)
        await drone.start_offboard()
        await drone.arm()
        begin_s = flown.now_s
        error = lambda: np.linalg.norm(np.array(drone.pos_ned) - (0.0, 0.0, -2.0))  # noqa: E731
        await drone.until(lambda: error() < 0.3, 90.0, "2 m")
        assert flown.now_s - begin_s < 15.0
        await drone.sleep(5.0)
        assert error() < 0.3
        drone.offboard_velocity(0.0, 0.0, 1.0)
        await drone.wait_disarmed(30.0)

    flown.run(script)
    assert flown.home_distance_m < 1.0


def test_offboard_positions():
    """PX4: "offboard position: 5 setpoints 5 m apart with yaw, each within 0.3 m in 10 s; home within 2 m"."""
    flown = Flown()
    places = [(0.0, 0.0, -5.0, 0.0), (0.0, 5.0, -5.0, 90.0), (5.0, 5.0, -5.0, 180.0), (5.0, 0.0, -5.0, 270.0),
              (0.0, 0.0, -5.0, 0.0)]  # fmt: skip
    times_s, headings_deg = [], []

    async def script(drone):
        await drone.wait_ready()
        drone.offboard_position(0.0, 0.0, -5.0)
        await drone.start_offboard()
        await drone.arm()
        await drone.sleep(8.0)
        for *place, yaw_deg in places:
            drone.offboard_position(*place, radians(yaw_deg))
            begin_s = flown.now_s
            near = lambda place=place: np.linalg.norm(np.array(drone.pos_ned) - place) < 0.3  # noqa: E731
            await drone.until(near, 10.0, f"at {place}")
            times_s.append(flown.now_s - begin_s)
            await drone.sleep(2.0)
            headings_deg.append(turned_deg(flown.state.yaw_rad - radians(yaw_deg)))
        await drone.land(60.0)

    flown.run(script)
    assert max(times_s) < 6.0
    assert max(map(abs, headings_deg)) < 3.0
    assert flown.home_distance_m < 1.0


async def target(client, kind, seconds, *, rate_hz=4.0, **fields):
    """Sends a setpoint in the local frame at a rate."""
    values = dict.fromkeys(("x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate"), 0.0)
    for _ in range(max(round(seconds * rate_hz), 1)):
        client.send(
            "SET_POSITION_TARGET_LOCAL_NED", time_boot_ms=0, target_system=1, target_component=1, coordinate_frame=1,
            type_mask=SETPOINT_MASK[kind], **(values | fields),
        )  # fmt: skip
        await client.sleep(1.0 / rate_hz)


def test_local_position_target():
    """ArduPilot: "local position target: 30,30 m: within 60 s, then within 3 m for 5 s"."""
    station = Station()
    flown = station.flown

    async def script(client):
        await station.airborne()
        await target(client, "position", 0.0, x=30.0, y=30.0, z=-10.0)  # once: it is kept
        begin_s = flown.now_s
        away = lambda: hypot(flown.pos[0] - 30.0, flown.pos[1] - 30.0)  # noqa: E731
        await client.until(lambda: away() < 1.5, 60.0, "there")
        assert flown.now_s - begin_s < 30.0
        begin_s = flown.now_s
        await client.sleep(5.0)
        assert np.hypot(*(flown.since(begin_s)[:, 1:3] - 30.0).T).max() < 1.5

    station.run(script)


def test_overridden_channels_move_the_vehicle_and_let_it_go():
    """ArduPilot: "overrides: mode change within 10 s; override speed < 2 m/s and back"."""
    station = Station()
    flown = station.flown

    async def override(client, seconds, pitch):
        channels = {f"chan{i}_raw": 65535 for i in range(5, 9)}
        for _ in range(round(seconds * 10)):
            client.send(
                "RC_CHANNELS_OVERRIDE", target_system=1, target_component=1, chan1_raw=1500, chan2_raw=pitch,
                chan3_raw=1500, chan4_raw=1500, **channels,
            )  # fmt: skip
            await client.sleep(0.1)

    async def script(client):
        await station.airborne()
        await override(client, 1.0, 1500)
        begin_s = flown.now_s
        await station.mode(LOITER)
        assert flown.now_s - begin_s < 1.0
        await override(client, 5.0, 1350)
        assert 0.5 < hypot(*flown.vel[:2]) < 2.0
        await override(client, 4.0, 1500)
        assert hypot(*flown.vel[:2]) < 0.3
        down = flown.pos[2]
        await client.sleep(8.0)  # without overrides the simulated radio has the sticks again, and Loiter holds
        assert client.latest("HEARTBEAT").custom_mode == LOITER
        assert flown.pos[2] == pytest.approx(down, abs=0.5)
        flown.flight.controller.sticks.is_cut = True
        await client.until(lambda: client.latest("HEARTBEAT").custom_mode == RTL, 2.0, "return without a radio")

    station.run(script)


def test_heading_targets():
    """ArduPilot: "heading target: 0, 290, 70, 180, 0 deg held 5 s"; by setpoint and by command."""
    station = Station()
    errors_deg = []

    async def held(client, heading_deg, sending):
        begin_us = client.time_us
        while client.time_us < begin_us + 12_000_000:
            await sending()
            if client.time_us > begin_us + 7_000_000:
                errors_deg.append(abs(turned_deg(station.flown.state.yaw_rad - radians(heading_deg))))

    async def script(client):
        await station.airborne()
        for heading_deg in (0.0, 290.0, 70.0, 180.0, 0.0):
            setpoint = {"yaw": radians(heading_deg)}
            await held(client, heading_deg, partial(target, client, "velocity and yaw", 0.5, **setpoint))
        await target(client, "velocity", 1.0)
        for heading_deg in (290.0, 70.0, 180.0, 0.0):
            await client.command(CONDITION_YAW, heading_deg, 0.0, 0.0, 0.0, name="turn")
            await held(client, heading_deg, lambda: client.sleep(0.1))

    station.run(script)
    assert max(errors_deg) < 3.0


def test_guided_yaw_rate_does_not_depend_on_the_message_rate():
    """ArduPilot: "guided yaw rate ... independent of message rate (10 Hz gives >= 95 % of 1 Hz)"."""
    station = Station()
    rates_deg_s = {}

    async def script(client):
        await station.airborne()
        for kind in ("velocity", "attitude"):
            for rate_hz in (1.0, 10.0):
                yaw, turned = station.flown.state.yaw_rad, 0.0
                begin_us, next_us = client.time_us, 0
                while client.time_us < begin_us + 10_000_000:
                    if client.time_us >= next_us:
                        next_us = client.time_us + int(1e6 / rate_hz)
                        turn(client, kind)
                    await client.sleep(0.02)
                    turned += turned_deg(station.flown.state.yaw_rad - yaw)
                    yaw = station.flown.state.yaw_rad
                rates_deg_s[kind, rate_hz] = turned / 10.0
                await target(client, "velocity", 3.0)

    def turn(client, kind):
        if kind == "velocity":
            client.start(target(client, "velocity and yaw rate", 0.0, yaw_rate=radians(20.0), rate_hz=50.0))
            return
        client.send(
            "SET_ATTITUDE_TARGET", time_boot_ms=0, target_system=1, target_component=1, type_mask=1 | 2,
            q=(1.0, 0.0, 0.0, 0.0), body_roll_rate=0.0, body_pitch_rate=0.0, body_yaw_rate=radians(20.0), thrust=0.5,
        )  # fmt: skip

    station.run(script)
    for kind in ("velocity", "attitude"):
        assert rates_deg_s[kind, 1.0] == pytest.approx(20.0, abs=1.5)
        assert rates_deg_s[kind, 10.0] >= 0.97 * rates_deg_s[kind, 1.0]


def test_guided_changes_between_its_kinds_of_target():
    """ArduPilot: "guided ... submode change": after a take-off each kind of target is flown, whatever came before."""
    station = Station()
    flown = station.flown

    async def script(client):
        await station.airborne()
        start = flown.pos
        await target(client, "velocity", 5.0, vx=3.0)
        assert flown.vel[0] == pytest.approx(3.0, abs=0.4)
        await target(client, "position", 0.0, x=start[0], y=start[1] + 10.0, z=-10.0)
        await client.until(lambda: np.linalg.norm(flown.pos - start - (0.0, 10.0, 0.0)) < 1.5, 20.0, "there")
        half = radians(-5.0)
        for _ in range(20):
            client.send(
                "SET_ATTITUDE_TARGET", time_boot_ms=0, target_system=1, target_component=1, type_mask=7,
                q=(cos(half), 0.0, sin(half), 0.0), body_roll_rate=0.0, body_pitch_rate=0.0, body_yaw_rate=0.0,
                thrust=0.5,
            )  # fmt: skip
            await client.sleep(0.1)
        assert degrees(flown.state.pitch_rad) == pytest.approx(-10.0, abs=3.0)
        assert flown.pos[2] == pytest.approx(-10.0, abs=1.5)
        await client.command(CONDITION_YAW, 90.0, 0.0, 0.0, 0.0, name="turn")
        await client.sleep(6.0)
        assert turned_deg(flown.state.yaw_rad - 0.5 * pi) == pytest.approx(0.0, abs=3.0)
        assert hypot(*flown.vel[:2]) < 0.5  # an attitude is not kept without a stream
        await target(client, "velocity", 4.0, vy=-2.0)
        assert flown.vel[1] == pytest.approx(-2.0, abs=0.4)
        await client.command(LAND, name="land")
        await client.until(lambda: not flown.state.is_armed, 60.0, "disarmed")

    station.run(script)
