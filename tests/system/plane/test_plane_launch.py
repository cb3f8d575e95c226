"""Planes that are thrown: the motor stands until the throw is felt; what is not thrown is disarmed."""

from math import hypot, nan

import pytest

from autopilot.interface.vehicle_state import LandedState, Mode
from common.airframe import AirframeError
from mission.flight import Flight, FlightConfig
from mission.flight_config import AIRFIELD
from mission.plan.plan_file import default_plan, read_plan
from mission.script import fly_plan


def thrown(script, seconds=500.0, **config):
    """The flight after a script, and the texts of its flight controller."""
    flight = Flight(FlightConfig(**({"airframe": "easyglider", "world": AIRFIELD} | config)))

    async def whole(drone):
        await drone.wait_ready()
        return await script(drone, flight)

    running = flight.fly(whole, seconds=seconds)
    flight.close()
    if running.error is not None:
        raise running.error
    assert running.is_done
    return flight


async def take_off(drone, height_m=30.0):
    await drone.arm()
    await drone.command(22, nan, 0.0, 0.0, nan, nan, nan, drone.home.alt_m + height_m)


async def up(drone, height_m=30.0):
    await drone.until(lambda: -drone.pos_ned[2] > height_m - 5.0, 60.0, "up")


@pytest.mark.parametrize("seed", [41, 42])
def test_the_default_plan_is_flown_from_hand_to_belly(seed):

    async def script(drone, flight):
        await fly_plan(drone, read_plan(default_plan("plane")))
        await drone.wait_disarmed()
        assert hypot(*drone.pos_ned[:2]) < 40.0

    flight = thrown(script, seed=seed, wind_m_s=3.0, wind_from_deg=60.0)
    assert flight.controller.state.landed_state is LandedState.ON_GROUND
    assert not flight.is_crashed


def test_the_motor_stands_until_the_plane_has_left_the_hand():
    async def script(drone, flight):
        await take_off(drone)
        state = flight.controller.state
        await drone.until(lambda: state.awaits_launch, 5.0, "waiting")
        assert flight.hand.is_holding
        while flight.hand.is_holding:
            assert state.actuators.command[2] == 0.0
            await drone.sleep(0.02)
        await up(drone)
        await drone.until(lambda: state.mode is Mode.HOLD, 30.0, "holding")

    assert not thrown(script, seed=43).is_crashed


def test_who_is_not_thrown_is_disarmed_with_a_reason():
    async def script(drone, flight):
        flight.hand.frame = lambda **_: None  # the thrower has gone to sleep, plane in hand
        await take_off(drone)
        await drone.wait_disarmed(40.0)
        assert "Disarmed: not thrown" in drone.texts

    flight = thrown(script)
    assert flight.controller.state.flight_number == 1


@pytest.mark.parametrize(
    ("parameters", "why"),
    [({"FW_LAUN_AC_THLD": 60.0}, "weaker than the threshold"), ({"FW_LAUN_AC_T": 1.0}, "shorter than the threshold")],
    ids=["weak", "short"],
)
def test_what_is_no_throw_starts_no_motor(parameters, why):
    async def script(drone, flight):
        await take_off(drone)
        state = flight.controller.state
        await drone.until(lambda: not flight.hand.is_holding, 5.0, why)
        for _ in range(20):
            await drone.sleep(0.1)
            assert state.actuators.command[2] == 0.0
        await drone.wait_disarmed(60.0)

    thrown(script, parameters=parameters)


def test_a_throw_that_does_not_carry_stops_the_motor():
    async def script(drone, flight):
        await take_off(drone)
        await drone.wait_disarmed(30.0)
        assert any("Launch failed" in text for text in drone.texts)
        assert -drone.pos_ned[2] < 1.0
        flight.hand.frame = lambda **_: None
        await take_off(drone)
        await drone.sleep(3.0)
        assert flight.controller.state.awaits_launch  # the next take-off waits for the next throw

    thrown(script, seconds=60.0, throw_m_s=3.0, parameters={"FW_LAUN_AC_THLD": 1.0}, seed=46)


def test_a_throw_on_its_side_is_ignored():
    async def script(drone, flight):
        await take_off(drone)
        state, body = flight.controller.state, flight.rig.rows["body"]
        await drone.until(lambda: state.awaits_launch, 5.0, "waiting")
        body["omega_frd"][0] = (2.0, 0.0, 0.0)
        await drone.sleep(0.5)
        body["omega_frd"][0] = 0.0
        await drone.until(lambda: not flight.hand.is_holding, 5.0, "thrown")
        await drone.sleep(0.4)
        assert state.actuators.command[2] == 0.0
        assert any("not held level" in text for text in drone.texts)

    thrown(script, seconds=20.0)


def test_a_catapult_throws_the_aerosonde():
    async def script(drone, flight):
        await take_off(drone)
        await up(drone)

    flight = thrown(script, airframe="plane", throw_m_s=20.0, seed=44)
    assert not flight.is_crashed


def test_it_is_picked_up_and_thrown_again():
    async def script(drone, flight):
        for _ in range(2):
            await drone.until(lambda: flight.hand.is_ready, 30.0, "held")
            await drone.sleep(2.0)
            await take_off(drone)
            await up(drone)
            await drone.return_home()
            await drone.wait_disarmed(300.0)

    flight = thrown(script, seconds=900.0, seed=45)
    assert flight.controller.state.flight_number == 2
    assert not flight.is_crashed


def test_only_a_plane_can_be_thrown():
    with pytest.raises(AirframeError, match="only a plane"):
        Flight(FlightConfig(airframe="x500", throw_m_s=5.0))


def test_a_restart_puts_it_back_into_the_hand():
    async def script(drone, flight):
        await take_off(drone)
        await up(drone)
        flight.restart()
        assert flight.hand.is_holding
        await drone.sleep(5.0)
        assert flight.rig.rows["truth"]["vel_ned"][0] == pytest.approx((0.0, 0.0, 0.0))

    thrown(script, seconds=60.0)
