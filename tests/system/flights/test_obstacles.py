"""A pilot holds the stick forward towards a wall: collision prevention stops the vehicle, its own eyes open."""

import numpy as np
import pytest

from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig

WALLED = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0, has_walls=True)
POSITION_CTL = 3


def pos_ned(flight):
    return np.array(flight.rig.rows["truth"][0]["pos_ned"], float)


@pytest.mark.parametrize("distance_m", [3.0, 6.0])
def test_stick_forward_ends_before_the_wall(distance_m):
    flight = Flight(FlightConfig(seed=2, world=WALLED, has_lidar=True, parameters={"CP_DIST": distance_m}))
    wall_north_m = flight.world.ray_hit([0.0, 0.0, -3.0], [1.0, 0.0, 0.0], 1000.0)

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(3.0)
        await drone.goto_ned(wall_north_m - 40.0, 0.0, -3.0, yaw_rad=0.0)
        stick(drone, 0.0)
        await drone._set_mode(POSITION_CTL, 0, "position")
        for _ in range(750):
            stick(drone, 1000.0)
            await drone.sleep(0.04)
        assert drone.latest("OBSTACLE_DISTANCE").distances[0] == pytest.approx(100.0 * distance_m, abs=60.0)

    def stick(drone, forward):
        drone.send("MANUAL_CONTROL", target=1, x=int(forward), y=0, z=500, r=0, buttons=0)

    running = flight.fly(script)
    assert running.error is None, running.error
    left_m = wall_north_m - pos_ned(flight)[0]
    assert distance_m - 0.4 < left_m < distance_m + 1.0
    assert flight.controller.state.is_armed


def test_distances_of_a_client_count_too():
    flight = Flight(FlightConfig(seed=3, parameters={"CP_DIST": 2.0}))

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(5.0)
        start = pos_ned(flight)
        for i in range(500):
            drone.send("MANUAL_CONTROL", target=1, x=1000 if i > 10 else 0, y=0, z=500, r=0, buttons=0)
            if i == 5:
                await drone._set_mode(POSITION_CTL, 0, "position")
            if i % 5 == 0:  # a half circle 3 m round it that goes with the vehicle until it has moved 5 m
                gone_m = float(np.linalg.norm(pos_ned(flight)[:2] - start[:2]))
                ahead_cm = int(max(100.0 * (7.0 - gone_m), 30.0))
                distances = tuple(ahead_cm if k <= 18 or k >= 54 else 1201 for k in range(72))
                drone.send(
                    "OBSTACLE_DISTANCE", time_usec=0, sensor_type=0, distances=distances, increment=5,
                    min_distance=20, max_distance=1200, increment_f=5.0, angle_offset=0.0, frame=12,
                )  # fmt: skip
            await drone.sleep(0.04)
        return float(np.linalg.norm(pos_ned(flight)[:2] - start[:2]))

    running = flight.fly(script)
    assert running.error is None, running.error
    assert running.result == pytest.approx(5.0, abs=0.7)
