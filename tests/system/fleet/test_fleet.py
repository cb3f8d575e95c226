"""Several vehicles in one world: each flies as it would alone, until it meets another."""

import asyncio
from math import dist

import pytest

from common.airframe import load_airframe
from mission.client import ScriptError
from mission.fleet.fleet_flight import FleetFlight
from mission.fleet.fleet_options import Member
from mission.fleet.fleet_script import Fleet
from mission.fleet.roster import fleet_configs
from mission.flight import Flight
from mission.flight_config import FlightConfig, start_of
from mission.plan.plan_file import default_plan, moved_plan, read_plan
from mission.script import fly_plan
from mission.simulator.flight_rig import flight_world
from sim.world.world import WorldConfig

BASE = FlightConfig(wind_m_s=3.0, world=WorldConfig(size_m=300.0, trees_per_ha=20.0))
MIXED = [Member(name) for name in ("x500", "rover", "x500", "rover-skid")]
LOGS = ("flight.ulg", "flight.tlog")


@pytest.fixture(scope="module")
def world():
    return flight_world(BASE)


def start_plan(flight):
    plan = read_plan(default_plan(load_airframe(flight.config.airframe).vehicle))
    flight.drone.start(fly_plan(flight.drone, moved_plan(plan, start_of(flight.config))))


def fly_together(configs, world, folder, seconds=20.0):
    """The logs of each vehicle, by its number."""
    fleet = FleetFlight(configs, world, folder=folder)
    for flight in fleet.flights:
        start_plan(flight)
    fleet.run(lambda flown: flown.time_us >= seconds * 1e6)
    ticks = {int(flight.rig.rows["tick"][0]) for flight in fleet.flights}
    assert ticks == {round(seconds * 250)}  # one clock: no vehicle is a tick ahead of another
    fleet.close()
    return {
        flight.drone.system_id: [(folder / f"vehicle-{i}" / name).read_bytes() for name in LOGS]
        for i, flight in enumerate(fleet.flights, 1)
    }


def test_a_vehicles_logs_are_the_same_alone_and_among_others_in_any_order(world, tmp_path):
    configs = fleet_configs(BASE, MIXED, world)
    together = fly_together(configs, world, tmp_path / "all")
    assert fly_together(configs[::-1], world, tmp_path / "backwards") == together
    for number in (2, 3):
        alone = Flight(configs[number - 1], folder=tmp_path, world=world)
        start_plan(alone)
        alone.run(lambda flown: flown.time_us >= 20.0 * 1e6)
        alone.close()
        assert [(tmp_path / name).read_bytes() for name in LOGS] == together[number]


def fly(script, vehicles, folder=None, config=BASE, **options):
    """What an asynchronous script of a fleet returns."""

    async def whole():
        async with Fleet(vehicles, config, folder=folder, **options) as fleet:
            return await script(fleet)

    return asyncio.run(whole())


def in_line(number):
    """Where a vehicle of ten is in the formation [m], ned: each at a height of its own, so that ways may cross."""
    return 20.0, 6.0 * number - 33.0, -4.0 - 2.0 * number


async def formation(fleet):
    """Ten take off, fly away in a line and land."""
    await fleet.each(lambda drone: drone.wait_ready())
    await fleet.each(lambda drone: drone.arm())
    await fleet.each(lambda drone: drone.takeoff(-in_line(drone.system_id)[2]))
    await fleet.each(lambda drone: drone.goto_ned(*in_line(drone.system_id)))
    there = [drone.pos_ned for drone in fleet]
    await fleet.each(lambda drone: drone.land())
    return there, [flight.is_crashed for flight in fleet.flights.flights]


def test_ten_fly_in_formation_and_the_same_each_time(tmp_path):
    folders = (tmp_path / "first", tmp_path / "second")
    (there, crashed), again = (fly(formation, 10, folder) for folder in folders)
    assert again == (there, crashed)
    assert not any(crashed)
    for i, pos_ned in enumerate(there):
        assert dist(pos_ned, in_line(i + 1)) < 1.0  # the first to arrive wait, in wind
    for i in range(1, 11):
        first, second = (folder / f"vehicle-{i}" / "flight.ulg" for folder in folders)
        assert first.read_bytes() == second.read_bytes()


def test_one_that_fails_is_named_and_the_others_go_on():
    async def script(fleet):
        await fleet.each(lambda drone: drone.wait_ready())
        await fleet.each(lambda drone: drone.arm())
        with pytest.raises(ScriptError, match="vehicle 2: takeoff") as refused:
            await fleet.each(lambda drone: drone.takeoff(5.0))
        assert "vehicle 1" not in str(refused.value)
        return [drone.pos_ned[2] for drone in fleet]

    up, driven, up_too = fly(script, "x500:1,rover:1,x500:1")
    assert up < -4.5
    assert up_too < -4.5
    assert driven > -1.0


@pytest.mark.parametrize("engine", ["native", "pybullet", "jsbsim"])
def test_two_that_fly_to_one_place_strike_each_other(engine):
    if engine != "native":
        pytest.importorskip(engine)

    async def script(fleet):
        first, second = fleet
        await fleet.each(lambda drone: drone.wait_ready())
        await fleet.each(lambda drone: drone.arm())
        await fleet.each(lambda drone: drone.takeoff(10.0))
        await second.goto_ned(20.0, 0.0, -10.0)
        first.start(first.goto_ned(20.0, 0.0, -10.0))
        second.start(second.goto_ned(0.0, 0.0, -10.0))
        truths = [flight.rig.rows["truth"] for flight in fleet.flights.flights]
        await first.until(lambda: truths[0]["impact_speed"][0] > 1.0, 20.0, "a blow")
        return [float(truth["impact_speed"][0]) for truth in truths]

    impacts = fly(script, 2, config=BASE.model_copy(update={"wind_m_s": 0.0, "noise": 0.0, "engine": engine}))
    assert impacts[0] > 2.0
    assert impacts[0] == pytest.approx(impacts[1], rel=0.1)


@pytest.mark.parametrize("has_transponders", [False, True])
def test_vehicles_hear_each_other_by_transponder(world, has_transponders):
    fleet = FleetFlight(fleet_configs(BASE, MIXED, world), world, has_transponders=has_transponders)
    fleet.run(lambda flown: flown.time_us >= 5e6)
    heard = fleet.flights[0].controller.traffic.known()
    fleet.close()
    assert {aircraft.callsign for aircraft in heard} == ({"HG002", "HG003", "HG004"} if has_transponders else set())
    for aircraft in heard:
        other = fleet.flights[int(aircraft.callsign[2:]) - 1]
        place = start_of(other.config)
        assert aircraft.lat_deg == pytest.approx(place.lat_deg, abs=1e-4)  # 10 m
        assert aircraft.lon_deg == pytest.approx(place.lon_deg, abs=1e-4)
