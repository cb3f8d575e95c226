"""MAVSDK 3's gRPC client, as the scripts of most tutorials use it: `make test-mavsdk3`. The tests follow one another.

Runs in MAVSDK 3's environment: nothing of the project is imported. Its timers run on the wall clock.
"""

import asyncio
import os
import signal
import socket
import subprocess
from itertools import pairwise
from math import cos, hypot, radians
from pathlib import Path

import pytest
from mavsdk import System
from mavsdk.action import OrbitYawBehavior
from mavsdk.mission import MissionItem, MissionPlan
from mavsdk.offboard import OffboardError, PositionNedYaw, VelocityNedYaw
from mavsdk.telemetry import FlightMode, LandedState

ROOT = Path(__file__).parents[2]
SPEED = 3.0  # times real time
METRES_PER_DEG = 111_194.9
HOME_LAT, HOME_LON = 47.397742, 8.545594


def free_port():
    """A UDP port that is free, and the vehicle's own end with it."""
    for port in range(31_000 + os.getpid() % 2000, 45_000, 7):
        try:
            for each in (port, port + 40, port + 1, port + 4021):
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                    probe.bind(("127.0.0.1", each))
        except OSError:
            continue
        return port
    raise RuntimeError("no free ports")


@pytest.fixture(scope="module")
def port(tmp_path_factory):
    """Where MAVSDK listens for a vehicle that waits for it."""
    folder = tmp_path_factory.mktemp("mavsdk3")
    port = free_port()
    words = ["fly", "--idle", "--trees", 0, "--speed", SPEED, "--api-port", port, "--gcs-port", port + 1]
    command = [ROOT / ".venv" / "bin" / "honeyguide", *words, "--run-folder", folder / "flight"]
    with (folder / "vehicle.txt").open("w") as output:
        vehicle = subprocess.Popen([str(word) for word in command], stdout=output, stderr=output, cwd=ROOT)
        yield port
        vehicle.send_signal(signal.SIGINT)
        vehicle.wait(60.0)


async def first(stream, condition=lambda _: True, seconds=60.0):
    """The first value of a stream that fulfils a condition."""

    async def search():
        async for value in stream:
            if condition(value):
                return value
        return None

    return await asyncio.wait_for(search(), seconds)


async def fly(port):
    drone = System()
    await drone.connect(system_address=f"udpin://127.0.0.1:{port}")
    telemetry = drone.telemetry
    await first(drone.core.connection_state(), lambda state: state.is_connected)
    await first(telemetry.health(), lambda health: health.is_armable and health.is_home_position_ok)

    assert await drone.param.get_param_int("SYS_AUTOSTART") > 0
    await drone.param.set_param_float("MPC_XY_CRUISE", 6.0)
    assert await drone.param.get_param_float("MPC_XY_CRUISE") == pytest.approx(6.0)
    version = await drone.info.get_version()
    assert version.flight_sw_major >= 1

    await drone.action.set_takeoff_altitude(8.0)
    await drone.action.arm()
    await drone.action.takeoff()
    await first(telemetry.position(), lambda position: abs(position.relative_altitude_m - 8.0) < 0.4)
    await first(telemetry.landed_state(), lambda state: state == LandedState.IN_AIR)
    home = await first(telemetry.home())

    latitude = home.latitude_deg + 15.0 / METRES_PER_DEG
    await drone.action.goto_location(latitude, home.longitude_deg, home.absolute_altitude_m + 10.0, 90.0)
    await first(telemetry.position(), lambda here: abs(here.latitude_deg - latitude) * METRES_PER_DEG < 0.5)

    await drone.offboard.set_position_ned(PositionNedYaw(15.0, 5.0, -10.0, 0.0))
    for _ in range(20):  # it sends setpoints by the wall clock: the vehicle wants to have heard some
        try:
            await drone.offboard.start()
            break
        except OffboardError:
            await asyncio.sleep(0.2)
    await first(telemetry.flight_mode(), lambda mode: mode == FlightMode.OFFBOARD)
    await first(
        telemetry.position_velocity_ned(),
        lambda each: hypot(each.position.north_m - 15.0, each.position.east_m - 5.0) < 0.4,
    )
    await drone.offboard.set_velocity_ned(VelocityNedYaw(0.0, -1.0, 0.0, 0.0))
    await first(telemetry.position_velocity_ned(), lambda each: each.velocity.east_m_s < -0.7)
    await drone.offboard.stop()

    def item(north, east, height):
        nan = float("nan")
        place = (
            HOME_LAT + north / METRES_PER_DEG,
            HOME_LON + east / METRES_PER_DEG / cos(radians(HOME_LAT)),
        )
        no_camera = MissionItem.CameraAction.NONE
        vehicle_action = MissionItem.VehicleAction.NONE
        return MissionItem(*place, height, 5.0, True, nan, nan, no_camera, nan, nan, nan, nan, nan, vehicle_action)

    await drone.mission.set_return_to_launch_after_mission(True)
    await drone.mission.upload_mission(MissionPlan([item(15.0, 15.0, 10.0), item(0.0, 15.0, 10.0)]))
    assert len((await drone.mission.download_mission()).mission_items) == 2
    await drone.mission.start_mission()
    await first(drone.mission.mission_progress(), lambda progress: progress.current == progress.total, 120.0)
    await first(telemetry.armed(), lambda armed: not armed, 180.0)
    here = await first(telemetry.position_velocity_ned())
    assert hypot(here.position.north_m, here.position.east_m) < 3.0
    await circle(drone, home)


async def circle(drone, home):
    """As the example do_orbit: 10 m above where it stands, told above sea level. Then the rate of highres_imu."""
    telemetry = drone.telemetry
    height_m = (await first(telemetry.position())).absolute_altitude_m + 10.0
    await drone.action.set_takeoff_altitude(2.5)
    await drone.action.arm()
    await drone.action.takeoff()
    await first(telemetry.landed_state(), lambda state: state == LandedState.IN_AIR)
    place = (home.latitude_deg + 30.0 / METRES_PER_DEG, home.longitude_deg)
    await drone.action.do_orbit(10.0, 2.0, OrbitYawBehavior.HOLD_FRONT_TO_CIRCLE_CENTER, *place, height_m)
    heights_m, times_us = [], []

    async def watch(stream, take):
        async for value in stream:
            take(value)

    await telemetry.set_rate_imu(200.0)
    watchers = [
        asyncio.create_task(
            watch(telemetry.position(), lambda position: heights_m.append(position.relative_altitude_m))
        ),
        asyncio.create_task(watch(telemetry.imu(), lambda imu: times_us.append(imu.timestamp_us))),
    ]
    await asyncio.sleep(45.0 / SPEED)
    for watcher in watchers:
        watcher.cancel()
    assert max(heights_m) < 13.0
    assert heights_m[-1] == pytest.approx(10.0, abs=2.0)
    reported_us = sorted(after - before for before, after in pairwise(times_us))
    assert reported_us[len(reported_us) // 2] <= 8_000  # 200 Hz out of ticks of 4 ms
    await drone.action.return_to_launch()
    await first(telemetry.armed(), lambda armed: not armed, 180.0)


def test_a_tutorial_flight(port):
    """Parameters, arming, take-off, goto, offboard, a mission with return, landing; an orbit."""
    asyncio.run(asyncio.wait_for(fly(port), 300.0))
