"""A rover in ArduPilot's dialect as ArduPilot's own Rover tests judge it: the published tolerance or a tighter one.

Each test quotes what is published. Speeds are scaled where those of ArduPilot's simulated car are above RO_SPEED_LIM.
"""

from math import hypot

import numpy as np
import pytest

from mission.script import ScriptError
from tests.system.published.rover_station import (
    ATTITUDE,
    CHANGE_SPEED,
    CIRCLE,
    DOCK,
    FOLLOW,
    HOLD,
    LOITER,
    MANUAL,
    POSITION,
    RTL,
    SET_REVERSE,
    SET_YAW_SPEED,
    SIMPLE,
    SMART_RTL,
    TURN,
    VELOCITY,
    VELOCITY_YAW_RATE,
    YAW,
    YAW_RATE,
    Rover,
)

FRONT_M = 0.37  # of the car, before its centre


def test_local_position_target():
    """ArduPilot: "SET_POSITION_TARGET_LOCAL_NED: (30, 30) within 3 m for 5 s, inside 60 s"."""
    rover = Rover()

    async def script(client):
        await rover.armed()
        await rover.target(POSITION, x=30.0, y=30.0)
        await rover.there(30.0, 30.0, 1.0)
        await client.sleep(3.0)
        begin_s = rover.flown.now_s
        await client.sleep(5.0)
        assert np.hypot(*(rover.flown.since(begin_s)[:, 1:3] - 30.0).T).max() < 0.8

    rover.run(script)


def test_velocities_turns_and_reverse():
    """ArduPilot's masks: velocity, velocity and yaw rate (backwards by its sign), yaw rate alone stands."""
    rover = Rover()

    async def script(client):
        await rover.armed()
        await rover.target(VELOCITY, 8.0, vx=0.0, vy=2.0)
        assert rover.flown.vel[1] == pytest.approx(2.0, abs=0.2)
        await rover.target(VELOCITY_YAW_RATE, 6.0, frame=8, vx=-1.5)
        assert rover.speed == pytest.approx(-1.5, abs=0.2)
        await rover.target(YAW_RATE, 4.0, yaw_rate=0.3)
        assert abs(rover.speed) < 0.15
        await rover.target(VELOCITY_YAW_RATE, 3.0, frame=8, vx=1.5, yaw_rate=0.3)
        await client.sleep(6.0)
        assert rover.said("target not received last 3secs, stopping")
        assert abs(rover.speed) < 0.1

    rover.run(script)


def test_a_skid_steer_turns_on_the_spot_by_yaw_alone():
    """ArduPilot: "SkidSteer headings"."""
    rover = Rover("rover-skid")

    async def script(client):
        await rover.armed()
        here = rover.flown.pos
        for yaw in (1.5, -2.0):
            await rover.target(YAW, 8.0, yaw=yaw)
            assert abs(rover.turned_deg(yaw)) < 5.0
        assert rover.away(*here[:2]) < 1.0

    rover.run(script)


def test_attitude_targets_hold_headings():
    """ArduPilot: "SET_ATTITUDE_TARGET: speed > 5 within 10 s; headings 0, 290, 70, 180, 0 held"; speed scaled."""
    rover = Rover()

    async def script(client):
        await rover.armed()
        for heading_deg in (0.0, 290.0, 70.0, 180.0, 0.0):
            await rover.attitude(ATTITUDE, 0.6, 10.0, yaw=np.radians(heading_deg))
            assert rover.speed == pytest.approx(3.0, abs=0.3)
            assert abs(rover.turned_deg(np.radians(heading_deg))) < 5.0
        await rover.attitude(TURN, -0.4, 6.0)
        assert rover.speed == pytest.approx(-2.0, abs=0.3)

    rover.run(script)


def test_the_speed_of_a_goto_is_changed():
    """ArduPilot: "DO_CHANGE_SPEED: 3, 7, 12, 4 m/s +-0.5 for 5 s"; scaled to 1, 3, 4.5, 2 m/s."""
    rover = Rover()

    async def script(client):
        await rover.armed()
        await rover.target(POSITION, x=0.0, y=150.0)
        for speed in (1.0, 3.0, 4.5, 2.0):
            await client.command(CHANGE_SPEED, 1.0, speed, -1.0, name="speed")
            await client.sleep(6.0)
            begin_s = rover.flown.now_s
            await client.sleep(5.0)
            speeds = np.hypot(*rover.flown.since(begin_s)[:, 4:6].T)
            assert abs(speeds - speed).max() < 0.5

    rover.run(script)


def test_it_returns_and_stops_at_home():
    """ArduPilot: "DriveRTL: stops <= 6.5 m from home"."""
    rover = Rover()

    async def script(client):
        await rover.armed()
        await rover.target(POSITION, x=30.0, y=0.0)
        await rover.there(30.0, 0.0)
        await rover.mode(RTL)
        await rover.there(0.0, 0.0, 1.0)
        await client.sleep(5.0)
        assert rover.away(0.0, 0.0) < 1.0

    rover.run(script)


def test_a_smart_return_goes_back_over_the_corner():
    """ArduPilot: "SmartRTL: corner <= 5 m, home 3 to 7 m"."""
    rover = Rover()

    async def script(client):
        await rover.armed()
        for place in ((25.0, 0.0), (25.0, 25.0)):
            await rover.target(POSITION, x=place[0], y=place[1])
            await rover.there(*place)
        await rover.mode(SMART_RTL)
        await rover.there(25.0, 0.0, 3.0)
        await rover.there(0.0, 0.0, 2.5)

    rover.run(script)


def test_manual_control_steers_by_y_and_drives_by_z():
    """ArduPilot: "MANUAL_CONTROL"; and a throttle nobody touches stands still."""
    rover = Rover()

    async def script(client):
        await rover.armed(MANUAL)
        await client.sleep(3.0)
        assert abs(rover.speed) < 0.05
        for _ in range(40):
            client.send("MANUAL_CONTROL", target=1, x=0, y=400, z=300, r=0, buttons=0)
            await client.sleep(0.1)
        assert rover.speed > 1.0
        assert abs(rover.turned_deg(0.0)) > 20.0
        for mode in (LOITER, HOLD):
            await rover.mode(mode)
            await client.sleep(5.0)
            assert abs(rover.speed) < 0.1

    rover.run(script)


def test_a_way_is_driven_backwards_and_forwards_again():
    """ArduPilot: "DO_SET_REVERSE: heading 0 and 180 while driving to the north"."""
    rover = Rover()

    async def script(client):
        await rover.armed()
        await rover.target(POSITION, x=300.0, y=0.0)
        for is_reversed, yaw in ((0.0, 0.0), (1.0, np.pi), (0.0, 0.0)):
            await client.command(SET_REVERSE, is_reversed, name="reverse")
            await client.until(lambda yaw=yaw: abs(rover.turned_deg(yaw)) < 5.0, 20.0, "turned")
            await client.sleep(5.0)
            assert abs(rover.turned_deg(yaw)) < 5.0
            assert rover.flown.vel[0] > 2.0

    rover.run(script)


def test_a_heading_with_a_speed():
    """ArduPilot: "NAV_SET_YAW_SPEED: +-0.5 m/s, +-0.5 deg"."""
    rover = Rover()

    async def script(client):
        await rover.armed()
        for heading_deg, fraction, is_relative in ((0.0, 0.4, 0.0), (90.0, 0.4, 0.0), (0.0, -0.3, 1.0)):
            yaw = rover.flown.state.yaw_rad if is_relative else np.radians(heading_deg)
            for _ in range(16):
                await client.command(SET_YAW_SPEED, heading_deg, fraction, is_relative, name="yaw and speed")
                await client.sleep(0.5)
            assert rover.speed == pytest.approx(fraction * 5.0, abs=0.2)
            if not is_relative:
                assert abs(rover.turned_deg(yaw)) < 0.5

    rover.run(script)


@pytest.mark.parametrize("direction", [0, 1])
def test_a_circle_ahead_is_driven_with_its_radius_and_speed(direction):
    """ArduPilot publishes no test of it; ours: the radius within 0.5 m, the speed within 0.2 m/s."""
    rover = Rover(HG_RO_CIRC_RAD=8.0, HG_RO_CIRC_SPD=2.0, HG_RO_CIRC_DIR=direction)

    async def script(client):
        await rover.armed()
        centre = (8.0, 0.0)
        await rover.mode(CIRCLE)
        await client.sleep(15.0)
        begin_s = rover.flown.now_s
        await client.sleep(30.0)
        rows = rover.flown.since(begin_s)
        arm, vel = rows[:, 1:3] - centre, rows[:, 4:6]
        assert abs(np.hypot(*arm.T) - 8.0).max() < 0.5
        assert abs(np.hypot(*vel.T) - 2.0).max() < 0.2
        turning = arm[:, 0] * vel[:, 1] - arm[:, 1] * vel[:, 0]
        assert (turning > 0.0).all() if direction == 0 else (turning < 0.0).all()

    rover.run(script)


def test_dock_stops_before_its_target():
    """ArduPilot: "AutoDock: stops 0.5 m off target"; and without a target the mode is refused."""
    rover = Rover()

    async def script(client):
        await rover.armed()
        with pytest.raises(ScriptError, match="no docking target in sight"):
            await rover.mode(DOCK)
        client.start(rover.shows_dock(6.0, 4.0))
        await client.sleep(1.0)
        await rover.mode(DOCK)
        await client.until(lambda: rover.said("Docked"), 40.0, "docked")
        await client.sleep(3.0)
        assert 0.2 < rover.away(6.0, 4.0) - FRONT_M < 0.5
        assert abs(rover.speed) < 0.05

    rover.run(script)


def test_simple_drives_where_the_sticks_point():
    """ArduPilot publishes no test of it: the stick's direction counts from the heading at which the mode was chosen."""
    rover = Rover()

    async def script(client):
        await rover.armed(SIMPLE)
        for y, z, heading_deg in ((0, 400, 0.0), (400, 0, 90.0), (0, -400, 180.0)):
            for _ in range(80):
                client.send("MANUAL_CONTROL", target=1, x=0, y=y, z=z, r=0, buttons=0)
                await client.sleep(0.1)
            assert abs(rover.turned_deg(np.radians(heading_deg))) < 5.0
            assert rover.speed == pytest.approx(2.0, abs=0.4)

    rover.run(script)


@pytest.mark.parametrize("velocity", [(1.5, 0.0), (0.0, 0.0)])
def test_it_follows_another_vehicle_at_a_distance(velocity):
    """ArduPilot publishes no test of it: it keeps FLW_TGT_DST behind, and stands where the target stands."""
    rover = Rover(FLW_TGT_DST=5.0)

    async def script(client):
        await rover.armed()
        place = np.array((12.0, 3.0))
        await rover.mode(FOLLOW)
        for _ in range(300):
            place += 0.1 * np.array(velocity)
            rover.tell_target(place, velocity)
            await client.sleep(0.1)
        assert hypot(*(rover.flown.pos[:2] - place)) == pytest.approx(5.0, abs=1.0)
        assert rover.speed == pytest.approx(hypot(*velocity), abs=0.25)

    rover.run(script)
