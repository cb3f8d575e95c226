"""Scripts against a vehicle in another process."""

import pytest

from mission.client import ScriptError
from mission.over_udp import fly_over_udp
from tests.system.vehicle import IdleVehicle, free_ports


async def hop(drone):
    await drone.wait_ready()
    await drone.arm()
    await drone.takeoff(5.0)
    start_us = drone.time_us
    await drone.sleep(10.0)
    await drone.land()
    return start_us


def test_script_flies_a_vehicle_at_its_own_speed(tmp_path):
    with IdleVehicle(tmp_path, "--trees", 0, speed=3.0) as vehicle:
        running = fly_over_udp(hop, port=vehicle.api_port, vehicle_port=vehicle.api_port + 40)
    assert running.error is None
    assert running.result > 3_000_000


def test_nobody_there_is_said_so():
    port, vehicle_port = free_ports()[:2]
    with pytest.raises(ScriptError, match="no vehicle has been heard"):
        fly_over_udp(hop, port=port, vehicle_port=vehicle_port, silence_s=0.2)
