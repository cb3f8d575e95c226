"""Hold of a rover: it stops and stands, whatever its position estimate does, and comes back if it has been moved."""

import numpy as np
import pytest

from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig
from tests.system.published.rover_station import HOLD, LOITER, Rover
from tests.unit.autopilot.vehicles.rover.rig import sloped_world

OPEN = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0)
STANDS_M_S = 0.1  # RO_SPEED_TH
RADIUS_M = 0.4  # HG_RO_HOLD_RAD
SPEED_M_S, DECEL_M_S2 = 5.0, 2.5  # RO_SPEED_LIM, RO_DECEL_LIM
AIRFRAMES = ["rover", "rover-skid"]
SLOPE_DEG = 8.0
ICE = 0.05  # of the tyres' grip: less than the slope asks for


def flown(script, *, on_frame=None, world=None, **config):
    """History of a script, from which the vehicle is armed on; columns of what is true, by frame."""
    flight = Flight(FlightConfig(**{"airframe": "rover", "world": OPEN, **config}), world=world)
    armed_us = []

    async def whole(drone):
        await drone.wait_ready()
        await drone.hold()
        await drone.arm()
        armed_us.append(flight.time_us)
        await script(drone)

    running = flight.drone.start(whole(flight.drone))
    flight.run(lambda _: running.is_done, on_frame=on_frame)
    history = flight.close()
    if running.error is not None:
        raise running.error
    is_armed = history.time_us >= armed_us[0]
    pos, est = history.pos_ned_true[is_armed, :2], history.pos_ned_est[is_armed, :2]
    return history.time_us[is_armed] * 1e-6, pos, np.hypot(*history.vel_ned_true[is_armed, :2].T), est


def from_start(place):
    return np.hypot(*(place - place[0]).T)


@pytest.mark.parametrize("airframe", AIRFRAMES)
def test_armed_in_hold_it_stands_while_its_estimate_wanders(airframe):
    """From the first fixes on, when the estimate moves most."""
    wandered_m = []

    async def script(drone):
        await drone.sleep(60.0)

    for seed in range(4):
        _, pos, speed, est = flown(script, airframe=airframe, seed=seed)
        assert speed.max() < STANDS_M_S
        assert from_start(pos).max() < 0.05
        wandered_m.append(from_start(est).max())
    assert sorted(wandered_m)[1] > RADIUS_M  # what it would drive back from, were it moved so far


@pytest.mark.parametrize("mode", [HOLD, LOITER])
def test_armed_in_either_of_ardupilots_modes_it_stands(mode):
    rover = Rover()

    async def script(client):
        await rover.armed(mode)
        await client.sleep(30.0)

    rover.run(script)
    rows = np.array(rover.flown.rows)
    assert np.hypot(*rows[:, 4:6].T).max() < STANDS_M_S
    assert from_start(rows[:, 1:3]).max() < 0.05


@pytest.mark.parametrize("is_turning", [False, True])
@pytest.mark.parametrize("seed", range(2))
def test_hold_at_speed_stops_once_and_stays(seed, is_turning):
    begun_us = []

    async def script(drone):
        drone.offboard_velocity(SPEED_M_S, 0.0, 0.0)
        await drone.start_offboard()
        await drone.sleep(6.0)
        if is_turning:
            drone.offboard_velocity(0.0, SPEED_M_S, 0.0)
            await drone.sleep(0.7)
        begun_us.append(drone.time_us)
        await drone.stop_offboard()
        await drone.sleep(40.0)

    time_s, pos, speed, _ = flown(script, seed=seed)
    since = time_s >= begun_us[0] * 1e-6
    pos, speed = pos[since], speed[since]
    assert speed[0] > 0.9 * SPEED_M_S
    stood = int(np.argmax(speed < STANDS_M_S))
    way_m = np.hypot(*np.diff(pos[: stood + 1], axis=0).T).sum()
    assert way_m < 1.25 * 0.5 * SPEED_M_S**2 / DECEL_M_S2
    assert speed[stood + 5 :].max() < STANDS_M_S  # but for the suspension's last swing
    assert from_start(pos[stood:]).max() < 0.1


@pytest.mark.parametrize("heading_deg", [0.0, 90.0])
@pytest.mark.parametrize("airframe", AIRFRAMES)
def test_what_slides_down_a_slope_in_hold_drives_back(airframe, heading_deg):
    """Its wheels stand, its tyres lose their grip for two seconds, along it or across it."""
    begins_s, ends_s = 15.0, 17.0
    is_icy = [False]

    def freeze(flight):
        asked = begins_s <= flight.time_us * 1e-6 < ends_s
        if asked is not is_icy[0]:
            is_icy[0] = asked
            tyre = flight.rig.rows["model"]["tyre"]
            for force in ("peak", "tail"):
                tyre[force][0] *= ICE if asked else 1.0 / ICE

    async def script(drone):
        await drone.sleep(60.0)

    time_s, pos, speed, _ = flown(
        script, on_frame=freeze, world=sloped_world(SLOPE_DEG), airframe=airframe, start_heading_deg=heading_deg
    )
    assert speed[time_s < begins_s].max() < STANDS_M_S
    assert from_start(pos).max() > 1.5
    assert from_start(pos)[-1] < 1.5 * RADIUS_M
    assert speed[-1000:].max() < STANDS_M_S
