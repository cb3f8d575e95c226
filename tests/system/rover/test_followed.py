"""A drone follows a rover: two flights side by side, the rover's position streamed as FOLLOW_TARGET."""

from math import nan

import numpy as np

from mission.flight import Flight, FlightConfig
from tests.system.published.published_rules import OPEN_GROUND, airborne, fly_to_end

AUTO, AUTO_FOLLOW = 4, 8
DISTANCE_M, HEIGHT_M = 8.0, 10.0
FRAME_S, REPORT_S, SETTLED_S = 0.02, 0.5, 20.0


def reported(message):
    """What a ground station makes of a vehicle's GLOBAL_POSITION_INT."""
    return {
        "timestamp": 0,
        "est_capabilities": 3,
        "lat": message.lat,
        "lon": message.lon,
        "alt": message.alt / 1000.0,
        "vel": (message.vx / 100.0, message.vy / 100.0, message.vz / 100.0),
        "acc": (nan,) * 3,
        "attitude_q": (1.0, 0.0, 0.0, 0.0),
        "rates": (0.0,) * 3,
        "position_cov": (1.0, 1.0, 1.0),
    }


def test_a_drone_keeps_its_distance_behind_a_rover_that_drives_round_corners():
    rover = Flight(FlightConfig(airframe="rover", world=OPEN_GROUND, seed=1))
    drone_flight = Flight(
        FlightConfig(world=OPEN_GROUND, seed=2, parameters={"FLW_TGT_DST": DISTANCE_M, "FLW_TGT_HT": HEIGHT_M})
    )
    rows = []

    async def drive(driver):
        await driver.wait_ready()
        await driver.arm()
        await driver.sleep(20.0)  # the drone takes off meanwhile
        for corner in ((60.0, 0.0), (60.0, 60.0), (0.0, 60.0)):
            await driver.goto_ned(*corner, 0.0, timeout_s=90.0)

    async def follow(drone):
        await airborne(drone, HEIGHT_M)
        await drone._set_mode(AUTO, AUTO_FOLLOW, "follow")
        begin = len(rows)
        while not driving.is_done:
            drone.send("FOLLOW_TARGET", **reported(rover.drone.latest("GLOBAL_POSITION_INT")))
            await drone.sleep(REPORT_S)
        return begin + round(SETTLED_S / FRAME_S)

    def beside(flight):
        rover.frame()
        rows.append(np.concatenate([each.rig.rows["truth"][0]["pos_ned"] for each in (flight, rover)]))

    driving = rover.drone.start(drive(rover.drone))
    begin = fly_to_end(drone_flight, follow(drone_flight.drone), beside, 300.0)
    rover.close()
    assert driving.error is None
    track = np.array(rows, float)[begin:]
    apart = track[:, :3] - track[:, 3:]
    assert np.abs(np.hypot(*apart[:, :2].T) - DISTANCE_M).max() < 4.0
    assert np.abs(-apart[:, 2] - HEIGHT_M).max() < 1.5
    assert track[-1, 4] > 50.0  # it has been round the corners
