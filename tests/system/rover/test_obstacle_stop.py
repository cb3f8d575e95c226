"""A rover stops before what its ring of range finders sees in its lane, whatever mode drives it, and says so once."""

import numpy as np
import pytest

from sim.world.world import WorldConfig
from tests.system.published.published_rules import Sticks
from tests.system.rover.walled import WALL_M, driven, to_behind_the_wall

KEEP_M = 1.0
SET_MODE, POSCTL = 176, 3.0


def test_a_goto_behind_a_wall_ends_before_the_wall():
    texts, history = driven(to_behind_the_wall, CP_DIST=KEEP_M)
    front_m = history.pos_ned_true[:, 0].max() + 0.4
    assert WALL_M - KEEP_M - 0.8 < front_m < WALL_M - KEEP_M + 0.3
    assert np.hypot(*history.vel_ned_true[-100:, :2].T).max() < 0.1
    assert texts.count("Obstacle ahead: stopped") == 1
    assert not any("Stuck" in text for text in texts)


def test_a_pilot_is_stopped_forwards_and_backs_away():
    farthest = []

    async def script(drone):
        sticks = Sticks(drone)
        await drone.sleep(0.5)
        await drone.command(SET_MODE, 1.0, POSCTL)
        for z, seconds in ((900, 15.0), (200, 5.0)):
            await sticks.hold(seconds, z=z)
            farthest.append(drone.pos_ned[0])

    driven(script, CP_DIST=KEEP_M)
    assert WALL_M - KEEP_M - 1.2 < farthest[0] < WALL_M - KEEP_M
    assert farthest[1] < farthest[0] - 3.0


def test_without_the_parameter_nothing_stops_it():
    texts, history = driven(to_behind_the_wall)
    assert history.pos_ned_true[:, 0].max() > WALL_M - 1.0
    assert "Obstacle ahead: stopped" not in texts


def test_without_a_sensor_it_does_not_move_and_says_why():
    texts, history = driven(to_behind_the_wall, has_lidar=False, CP_DIST=KEEP_M)
    assert abs(history.pos_ned_true[:, 0]).max() < 1.0
    assert texts.count("No distances ahead: stopped") == 1
    assert not any("Obstacle" in text for text in texts)


def test_backwards_it_stops_before_what_is_behind_it():
    async def script(drone):
        drone.offboard_velocity(-2.0, 0.0, 0.0, yaw_rad=0.0)
        await drone.start_offboard()
        await drone.sleep(25.0)

    texts, history = driven(script, CP_DIST=KEEP_M, HG_RO_OFFB_BODY=1)
    assert texts.count("Obstacle behind: stopped") == 1
    rear_m = -history.pos_ned_true[:, 0].min() + 0.3
    assert WALL_M - KEEP_M - 1.0 < rear_m < WALL_M - KEEP_M + 0.3
    assert np.hypot(*history.vel_ned_true[-100:, :2].T).max() < 0.1


def test_it_drives_on_when_a_client_reports_the_way_free_again():
    places = []

    async def script(drone):
        def report(distance_cm):
            drone.send("OBSTACLE_DISTANCE", time_usec=0, sensor_type=0, distances=[distance_cm] * 72, increment=5,
                       min_distance=10, max_distance=1000, increment_f=0.0, angle_offset=0.0, frame=12)  # fmt: skip

        drone.offboard_velocity(1.0, 0.0, 0.0)
        report(1001)
        await drone.start_offboard()
        for distance_cm in (1001, 60, 1001):
            for _ in range(50):
                report(distance_cm)
                await drone.sleep(0.1)
            places.append(drone.pos_ned[0])

    texts, _ = driven(script, has_lidar=False, CP_DIST=KEEP_M)
    assert texts.count("Obstacle ahead: stopped") == 1
    assert places[1] < places[0] + 1.0
    assert places[2] > places[1] + 3.0


@pytest.mark.parametrize("airframe", ["rover", "rover-skid"])
def test_stopped_on_a_slope_it_stands_and_is_not_called_stuck(airframe):
    hills = WorldConfig(
        trees_per_ha=0.0, size_m=2 * WALL_M, hill_height_m=4.0, clearing_radius_m=2.0, clearing_blend_m=4.0,
        has_walls=True, wall_height_m=6.0,
    )  # fmt: skip
    texts, history = driven(to_behind_the_wall, airframe=airframe, world=hills, CP_DIST=KEEP_M)
    assert texts.count("Obstacle ahead: stopped") == 1
    assert not any("Stuck" in text for text in texts)
    assert np.hypot(*history.vel_ned_true[-100:, :2].T).max() < 0.1
