"""A landing that is given up: by command, and by itself where it is hopeless."""

from math import hypot, nan

import pytest

from autopilot.interface.vehicle_state import LandedState, Mode
from mission.client import CommandRefused
from mission.plan.plan_file import default_plan, read_plan
from mission.script import fly_plan
from tests.system.plane.test_plane_modes import RADIUS_M, airborne, flown, radius_m

GO_AROUND = 191
ABORT_M = 30.0  # MIS_LND_ABRT_ALT


async def go_round(drone, height_m=nan):
    await drone.command(GO_AROUND, height_m, *(0.0,) * 6)


async def circles_at(drone, height_m):
    """It circles home at a height for a while."""
    await drone.until(lambda: -drone.pos_ned[2] > height_m - 5.0, 60.0, "up")
    await drone.sleep(50.0)
    for _ in range(10):
        await drone.sleep(1.0)
        assert abs(-drone.pos_ned[2] - height_m) < 5.0
        assert abs(radius_m(drone) - RADIUS_M) < 15.0


@pytest.mark.parametrize("low_m", [15.0, 1.5], ids=["on the slope", "in the flare"])
def test_a_landing_is_given_up_and_flown_again_when_asked(low_m):
    async def script(drone, flight):
        state = flight.controller.state
        await airborne(drone, 40.0)
        await drone.command(21, nan, 0.0, 0.0, nan, nan, nan, nan)
        await drone.until(lambda: -drone.pos_ned[2] < low_m, 300.0, "low")
        await go_round(drone)
        await circles_at(drone, ABORT_M)
        assert state.mode is Mode.LAND
        assert state.landed_state is LandedState.IN_AIR
        await drone.command(21, nan, 0.0, 0.0, nan, nan, nan, nan)
        await drone.wait_disarmed(300.0)
        assert radius_m(drone) < 80.0

    flown(script, seconds=900.0, wind_m_s=3.0, seed=61)


def test_a_missions_landing_is_given_up_and_flown_again():
    async def script(drone, flight):
        state = flight.controller.state
        plan = read_plan(default_plan("plane"))
        drone.start(fly_plan(drone, plan))
        await drone.until(lambda: state.landed_state is LandedState.LANDING and -drone.pos_ned[2] < 12.0, 400.0, "low")
        await go_round(drone, 50.0)
        await circles_at(drone, 50.0)
        assert state.mode is Mode.MISSION
        await drone.command(224, float(state.mission_current), *(0.0,) * 6)
        await drone.until(lambda: not state.is_armed, 400.0, "down")
        assert hypot(*drone.pos_ned[:2]) < 80.0

    flown(script, seconds=1200.0, seed=62)


def test_what_does_not_land_cannot_go_round():
    async def script(drone, flight):
        await airborne(drone, 40.0)
        with pytest.raises(CommandRefused, match="not landing"):
            await go_round(drone)

    flown(script)


def test_a_hopeless_landing_is_given_up_and_tried_again():
    """A gust front from the side carries it off the slope just before the touchdown."""

    async def script(drone, flight):
        await airborne(drone, 40.0)
        await drone.return_home()
        await drone.until(lambda: flight.controller.state.landed_state is LandedState.LANDING, 300.0, "on the slope")
        await drone.until(lambda: -drone.pos_ned[2] < 8.0, 300.0, "low")
        flight.set_wind(18.0, 90.0)
        await drone.until(lambda: any("trying again" in text for text in drone.texts), 30.0, "given up")
        for wind_m_s in (12.0, 6.0, 0.0):
            await drone.sleep(10.0)
            flight.set_wind(wind_m_s, 90.0)
        await drone.wait_disarmed(500.0)
        assert radius_m(drone) < 80.0

    flown(script, seconds=900.0, seed=63, parameters={"HG_FW_LND_OFF": 3.0})
