"""What PX4's and ArduPilot's own tests ask of messages rather than of flight.

Each test quotes what is published.
"""

from math import degrees, nan

import numpy as np
import pytest

from autopilot.interface.vehicle_state import Mode
from common.geodesy import DEFAULT_HOME
from sim.faults import set_fault
from tests.system.published.published_rules import E7, Flown, Sticks

GET_INTERVAL, SET_INTERVAL, REQUEST_MESSAGE = 510, 511, 512
MESSAGE_INTERVAL, ATTITUDE, VFR_HUD = 244, 30, 74
SET_HOME = 179


@pytest.mark.parametrize("dialect", ["px4", "ardupilot"])
def test_message_interval_is_the_same_however_it_is_asked_for(dialect):
    """ArduPilot: "message intervals: MESSAGE_INTERVAL equal through GET_MESSAGE_INTERVAL and REQUEST_MESSAGE, long and
    int"."""
    flown = Flown(config={"dialect": dialect})
    found = {}

    async def ask(drone, number, params, *, is_int):
        with drone.subscribe("MESSAGE_INTERVAL") as inbox:
            if is_int:
                await drone.command_int(number, 0, (*params, 0.0, 0.0), 0, 0, 0.0, name="ask")
            else:
                await drone.command(number, *params, name="ask")
            message = await inbox.next(1.0, "the interval")
        return message.message_id, message.interval_us

    async def script(drone):
        await drone.wait_ready()
        for message, interval_us in ((ATTITUDE, 100_000), (VFR_HUD, 500_000), (ATTITUDE, -1), (VFR_HUD, 0)):
            await drone.command(SET_INTERVAL, float(message), float(interval_us), name="set")
            found[message, interval_us] = {
                await ask(drone, number, params, is_int=is_int)
                for is_int in (False, True)
                for number, params in (
                    (GET_INTERVAL, (float(message), 0.0)),
                    (REQUEST_MESSAGE, (float(MESSAGE_INTERVAL), float(message))),
                )
            }
        await drone.command(SET_INTERVAL, float(ATTITUDE), 200_000.0, name="set")
        with drone.subscribe("ATTITUDE") as inbox:
            await drone.sleep(4.0)
            found["count"] = len(inbox._queue)

    flown.run(script)
    assert found[ATTITUDE, 100_000] == {(ATTITUDE, 100_000)}
    assert found[VFR_HUD, 500_000] == {(VFR_HUD, 500_000)}
    assert found[ATTITUDE, -1] == {(ATTITUDE, -1)}
    assert len(found[VFR_HUD, 0]) == 1  # the default
    assert found["count"] == pytest.approx(20, abs=1)


def test_home_yaw_without_local_position():
    """PX4: "home yaw without local position: within 20 deg"."""
    flown = Flown()
    set_fault(flown.faults, "gnss", "off")
    q_ned_from_frd = flown.flight.rig.rows["body"]["q_ned_from_frd"]
    q_ned_from_frd[0] = (0.0, 0.0, np.sin(0.6), np.cos(0.6))  # faces 69 deg

    async def script(drone):
        sticks = Sticks(drone)
        sticks.axes["z"] = 0
        await drone.sleep(8.0)
        await drone.command(176, 1.0, 7.0, name="stabilized")
        place = round(DEFAULT_HOME.lat_deg * E7), round(DEFAULT_HOME.lon_deg * E7)
        await drone.command_int(SET_HOME, 0, (0.0, 0.0, 0.0, nan), *place, DEFAULT_HOME.alt_m, name="home")
        await drone.arm()
        await drone.sleep(1.0)
        assert flown.state.mode is Mode.STABILIZED
        return drone.latest("HOME_POSITION").q

    w, _, _, z = flown.run(script)
    assert degrees(2.0 * np.arctan2(z, w)) == pytest.approx(degrees(1.2), abs=5.0)
