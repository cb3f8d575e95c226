"""A rover's missions, returns and failsafes in ArduPilot's dialect, as ArduPilot's own Rover tests judge them.

Each test quotes what is published. Speeds are scaled where those of ArduPilot's simulated car are above RO_SPEED_LIM.
"""

from dataclasses import replace
from math import nan

import numpy as np
import pytest

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import encode
from common.geodesy import geodetic_from_ned
from mission.plan.plan_file import PlanItem
from tests.system.published.rover_station import AUTO, CHANGE_SPEED, HOLD, MANUAL, POSITION, RTL, Rover

GCS = 6  # MAV_TYPE
HOME_FRAME, WAYPOINT, EXCLUSION = 3, 16, 5002
SQUARE = ((50.0, 0.0), (50.0, 50.0), (0.0, 50.0), (0.0, 0.0))
FENCE = 1  # MAV_MISSION_TYPE
COMPLETE = 5  # MISSION_STATE


def items(rover, places, command=WAYPOINT, params=(0.0, 0.0, 0.0, nan)):
    """Home, as ArduPilot's lists begin, and waypoints."""
    result = []
    for i, (north, east) in enumerate(((0.0, 0.0), *places)):
        lat_deg, lon_deg, _ = geodetic_from_ned(north, east, 0.0, rover.flown.state.origin)
        result.append(PlanItem(i, HOME_FRAME, command, params, lat_deg, lon_deg, 0.0))
    return result


def test_a_square_is_driven_and_its_end_held():
    """ArduPilot: "DriveMission, DriveSquare: waypoint within 5 m, legs of 50 m +-7 m; EndMissionBehavior: holds"."""
    rover = Rover()

    async def script(client):
        await rover.armed(HOLD)
        await client.upload(items(rover, SQUARE))
        await client.command(CHANGE_SPEED, 1.0, 3.0, -1.0, name="speed")
        await rover.mode(AUTO)
        await client.until(lambda: rover.flown.state.mission_state == COMPLETE, 200.0, "finished")
        await client.sleep(10.0)

    rover.run(script)
    track = np.array(rover.flown.rows)[:, 1:3]
    for corner in SQUARE:
        assert np.hypot(*(track - corner).T).min() < 1.5
    assert rover.away(0.0, 0.0) < 1.5
    assert abs(rover.speed) < 0.1


@pytest.mark.parametrize("speed", [1.0, 1.5, 4.5])
def test_a_return_keeps_its_speed(speed):
    """ArduPilot: "RTL_SPEED: 1, 5.5, 1.5, 7.5 m/s held +-0.1 for 10 s"; scaled."""
    rover = Rover()

    async def script(client):
        await rover.armed()
        await client.set_parameter("RTL_SPEED", speed)
        await rover.target(POSITION, x=0.0, y=14.0 * speed + 20.0)
        await rover.there(0.0, 14.0 * speed + 20.0)
        await rover.mode(RTL)
        await client.until(lambda: abs(rover.speed - speed) < 0.05, 20.0, "fast")
        await client.sleep(1.0)
        begin_s = rover.flown.now_s
        await client.sleep(8.0)
        return begin_s

    begin_s = rover.run(script)
    speeds = np.hypot(*rover.flown.since(begin_s)[:, 4:6].T)
    assert abs(speeds[: 8 * 50] - speed).max() < 0.2
    assert speeds[: 8 * 50].mean() == pytest.approx(speed, abs=0.1)


@pytest.mark.parametrize(("action", "mode"), [(1, Mode.RETURN), (2, Mode.HOLD), (3, Mode.SMART_RETURN)])
def test_throttle_failsafe(action, mode):
    """ArduPilot: "throttle failsafe: the mode of FS_ACTION within 10 s"."""
    rover = Rover()

    async def script(client):
        await client.set_parameter("FS_ACTION", action)
        await rover.armed(MANUAL)
        for k in range(60):
            client.send("MANUAL_CONTROL", target=1, x=0, y=0, z=300 if k < 50 else 0, r=0, buttons=0)
            await client.sleep(0.1)
        rover.flown.flight.controller.sticks.is_cut = True
        await client.until(lambda: rover.flown.state.mode is mode, 10.0, mode.name)

    rover.run(script)


@pytest.mark.parametrize(("enabled", "mode"), [(1, Mode.HOLD), (0, Mode.GUIDED)])
def test_station_failsafe(enabled, mode):
    """ArduPilot: "GCS loss per FS_GCS_ENABLE, after FS_GCS_TIMEOUT"."""
    vehicle_end, station = memory_pair(LinkRole.GROUND)
    rover = Rover(links=[vehicle_end])

    async def script(client):
        await client.set_parameter("FS_GCS_ENABLE", enabled)
        await client.set_parameter("FS_GCS_TIMEOUT", 5.0)
        await rover.armed()
        for _ in range(3):
            station.send(encode("HEARTBEAT", 255, 190, 0, type=GCS, autopilot=8, mavlink_version=3))
            await client.sleep(1.0)
        await client.sleep(9.0)
        assert rover.flown.state.mode is mode

    rover.run(script)


def test_a_way_leads_round_what_the_fence_excludes():
    """ArduPilot: "PolyFenceObjectAvoidance: around the fence, home 3 to 7 m"."""
    rover = Rover()
    corners = ((15.0, -6.0), (15.0, 6.0), (25.0, 6.0), (25.0, -6.0))

    async def script(client):
        fence = items(rover, corners, EXCLUSION, (4.0, 0.0, 0.0, 0.0))[1:]
        await client.upload([replace(item, seq=i) for i, item in enumerate(fence)], FENCE)
        await client.set_parameter("FENCE_ENABLE", 1)
        await rover.armed()
        await rover.target(POSITION, x=40.0, y=0.0)
        await rover.there(40.0, 0.0)
        await rover.mode(RTL)
        await rover.there(0.0, 0.0, 1.0)

    rover.run(script)
    track = np.array(rover.flown.rows)[:, 1:3]
    inside = (track[:, 0] > 15.0) & (track[:, 0] < 25.0) & (abs(track[:, 1]) < 6.0)
    assert not inside.any()
    assert not rover.flown.state.fence.breach_count
