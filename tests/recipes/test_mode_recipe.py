"""The recipe "A mode" of CONTRIBUTING.md: the class that flies it and one row in the vehicle's table."""

from dataclasses import replace

import pytest
from pymavlink.dialects.v20 import all as mavlink
from pyulog import ULog

from autopilot.interface.mode_spec import mode_table
from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.vehicles.multirotor.modes import MULTIROTOR_MODES
from autopilot.vehicles.multirotor.vehicle import MULTIROTOR
from mission.flight import Flight, FlightConfig
from mission.script import CommandRefused
from sim.bodies.body import MULTIROTOR_BODY
from sim.bodies.vehicles import SimulatedClass
from sim.world.world import WorldConfig
from tests.recipes.station import Station
from tests.recipes.up_and_down_mode import SPAN_M, UP_AND_DOWN

SET_MODE = mavlink.MAV_CMD_DO_SET_MODE
REQUEST_MESSAGE, AVAILABLE_MODES = mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES
FLIGHT = FlightConfig(world=WorldConfig(size_m=64.0, hill_height_m=0.0, trees_per_ha=0.0), dialect="ardupilot")


def flight_with(monkeypatch, specs, folder, *links, config=FLIGHT):
    """The vehicle's class has these rows; nothing else is told of them."""
    vehicle = replace(MULTIROTOR, modes=mode_table(*specs))
    monkeypatch.setattr("sim.bodies.vehicles.VEHICLES", [SimulatedClass(vehicle, MULTIROTOR_BODY)])
    return Flight(config, links=links, folder=folder)


async def climb(drone):
    await drone.wait_ready()
    await drone.arm()
    await drone.takeoff(8.0)


def test_a_mode_is_unknown_before_it_is_added(tmp_path):
    async def script(drone):
        await drone.wait_ready()
        await drone.command(SET_MODE, 1.0, 4.0, 11.0)

    flight = Flight(FLIGHT, folder=tmp_path)
    running = flight.fly(script, seconds=30.0)
    flight.close()
    assert isinstance(running.error, CommandRefused)


def test_a_mode_that_is_added_is_chosen_flown_shown_and_logged(monkeypatch, tmp_path):
    vehicle_end, station_end = memory_pair(LinkRole.GROUND)
    flight = flight_with(monkeypatch, [*MULTIROTOR_MODES.values(), UP_AND_DOWN], tmp_path, vehicle_end)
    station, downs = Station(station_end), []

    async def script(drone):
        await climb(drone)
        await drone.command(SET_MODE, 1.0, 4.0, 11.0)  # PX4's way: main mode, sub mode
        await drone.until(lambda: drone.px4_mode == (4, 11), 3.0, "the mode in the heartbeat")
        end_us = drone.time_us + 15_000_000
        while drone.time_us < end_us:
            await drone.sleep(0.1)
            downs.append(drone.pos_ned[2])
        await drone.hold()
        station.command(SET_MODE, 1.0, 100.0)  # ArduPilot's way: one number
        await drone.until(lambda: drone.px4_mode == (4, 11), 3.0, "the mode by its other number")
        station.command(REQUEST_MESSAGE, float(AVAILABLE_MODES), 0.0)
        await drone.sleep(2.0)
        await drone.land()

    running = flight.fly(script, seconds=120.0)
    flight.close()
    assert running.error is None
    assert max(downs) - min(downs) == pytest.approx(SPAN_M, abs=0.5)
    heard = station.receive()
    shown = [message.custom_mode for message in heard if message.get_type() == "HEARTBEAT" and message.autopilot == 3]
    assert 100 in shown
    listed = {message.mode_name: message.custom_mode for message in heard if message.get_type() == "AVAILABLE_MODES"}
    assert listed["Up and Down"] == 100
    (status,) = [data for data in ULog(str(tmp_path / "flight.ulg")).data_list if data.name == "vehicle_status"]
    assert UP_AND_DOWN.nav_state in status.data["nav_state"]


def test_a_mode_that_is_added_is_refused_by_what_its_row_says(monkeypatch, tmp_path):
    async def script(drone):
        await drone.wait_ready()
        await drone.command(SET_MODE, 1.0, 4.0, 11.0)

    config = FLIGHT.model_copy(update={"dialect": "px4"})  # ArduPilot lets any mode be chosen on the ground
    flight = flight_with(monkeypatch, [*MULTIROTOR_MODES.values(), UP_AND_DOWN], tmp_path, config=config)
    running = flight.fly(script, seconds=30.0)
    flight.close()
    assert "on the ground already" in str(running.error)


def test_a_class_of_vehicles_may_have_fewer_modes(monkeypatch, tmp_path):
    refusals = []

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        for request in (drone.takeoff(5.0), drone.command(SET_MODE, 1.0, 4.0, 5.0), drone.start_mission()):
            with pytest.raises(CommandRefused) as refused:
                await request
            refusals.append(str(refused.value))
        await drone.command(SET_MODE, 1.0, 4.0, 6.0)

    specs = [MULTIROTOR_MODES[mode] for mode in (Mode.HOLD, Mode.LAND, Mode.STABILIZED, Mode.TERMINATION)]
    flight = flight_with(monkeypatch, specs, tmp_path)
    running = flight.fly(script, seconds=30.0)
    flight.close()
    assert running.error is None
    takeoff, return_home, mission = refusals
    assert "no mode of this vehicle does that" in takeoff
    assert "there is no mode 4/5" in return_home
    assert "mode MISSION is not supported" in mission


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"mode": Mode.HOLD}, "two modes have mode 0"),
        ({"px4": MULTIROTOR_MODES[Mode.LAND].px4}, "two modes have PX4 number"),
        ({"ardupilot": MULTIROTOR_MODES[Mode.LAND].ardupilot}, "two modes have ArduPilot number 9"),
        ({"switch": 4}, "two modes have switch number 4"),
    ],
)
def test_a_table_in_which_two_modes_share_a_number_is_refused(change, reason):
    with pytest.raises(ValueError, match=reason):
        mode_table(*MULTIROTOR_MODES.values(), replace(UP_AND_DOWN, **change))


def test_a_mode_shown_as_one_that_is_not_there_is_refused():
    with pytest.raises(ValueError, match="GUIDED is shown as OFFBOARD"):
        mode_table(MULTIROTOR_MODES[Mode.GUIDED])
