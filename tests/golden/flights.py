"""The golden flights: short, in lockstep, each through another part of the stack."""

from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import encode
from mission.flight import Flight, FlightConfig
from mission.log.flight_summary import Summary, planned_path, summarise
from mission.plan.plan_file import DEFAULT_PLAN, read_plan
from mission.script import Drone, fly_plan
from sim.world.world import WorldConfig
from tests.unit.mission.follow.follow_flight import advance, following

PLAIN = WorldConfig(trees_per_ha=0.0)
SET_MODE, ARM, TAKEOFF, INJECT = 176, 400, 22, 420
GUIDED, SMART_RTL, LOITER = 4, 21, 5  # of ArduPilot's copter
GNSS, OFF = 4, 1
STATION = (255, 190)


def mission_in_wind(folder: Path) -> Summary:
    """The default mission: wind, estimator, every leg, landing, telemetry."""
    plan, config = read_plan(DEFAULT_PLAN), FlightConfig(wind_m_s=6.0, seed=5)
    flight = Flight(config, folder=folder)
    running = flight.fly(lambda drone: fly_plan(drone, plan), seconds=300.0)
    return summarise(flight, flight.close(), running, planned_path(plan, config.home))


def offboard(folder: Path) -> Summary:
    """Setpoints of each kind, then Hold and Land."""

    async def script(drone: Drone) -> None:
        await _climb(drone, 8.0)
        drone.offboard_position(10.0, -5.0, -8.0, 1.0)
        await drone.start_offboard()
        await drone.sleep(5.0)
        drone.offboard_velocity(2.0, 1.0, -0.5, 0.4)
        await drone.sleep(4.0)
        drone.offboard_attitude((0.996, 0.0, -0.087, 0.0), 0.5)
        await drone.sleep(1.0)
        drone.offboard_rates((0.0, 0.1, 0.3), 0.45)
        await drone.sleep(0.5)
        await drone.stop_offboard()
        await drone.sleep(2.0)
        await drone.land()

    return _flown(Flight(FlightConfig(world=PLAIN, seed=2, wind_m_s=3.0), folder=folder), script)


def failsafe_landing(folder: Path) -> Summary:
    """GNSS fails on the way: a blind descent."""

    async def script(drone: Drone) -> None:
        await _climb(drone, 10.0)
        await drone.goto_ned(25.0, 10.0, -10.0)
        await drone.command(INJECT, float(GNSS), float(OFF), 0.0)
        await drone.wait_disarmed()

    config = FlightConfig(world=PLAIN, seed=7, parameters={"SYS_FAILURE_EN": 1.0})
    return _flown(Flight(config, folder=folder), script)


def follow_me(folder: Path) -> Summary:
    """A companion with a camera follows somebody who walks."""
    flight, _ = following(folder, pace="walk", seed=4)
    advance(flight, 12.0)
    return summarise(flight, flight.close(), None, [])


def ardupilot(folder: Path) -> Summary:
    """A ground station of ArduPilot's: parameters, guided flight, camera, return, as its log keeps them."""
    vehicle_end, station = memory_pair(LinkRole.GROUND)
    flight = Flight(FlightConfig(world=PLAIN, seed=9, dialect="ardupilot"), links=[vehicle_end], folder=folder)
    target = {"target_system": 1, "target_component": 1}
    place = {"coordinate_frame": 6, "type_mask": 0b110_111_111_000, "lat_int": 473980000, "lon_int": 85460000}
    said = {
        1.0: ("REQUEST_DATA_STREAM", target | {"req_stream_id": 0, "req_message_rate": 5, "start_stop": 1}),
        2.0: ("PARAM_REQUEST_LIST", target),
        15.0: ("COMMAND_LONG", target | {"command": SET_MODE, "param1": 1.0, "param2": float(GUIDED)}),
        16.0: ("COMMAND_LONG", target | {"command": ARM, "param1": 1.0}),
        17.0: ("COMMAND_LONG", target | {"command": TAKEOFF, "param7": 12.0}),
        26.0: ("SET_POSITION_TARGET_GLOBAL_INT", target | place | {"alt": 15.0}),
        34.0: ("COMMAND_LONG", target | {"command": SET_MODE, "param1": 1.0, "param2": float(LOITER)}),
        37.0: ("COMMAND_LONG", target | {"command": SET_MODE, "param1": 1.0, "param2": float(SMART_RTL)}),
    }
    for seq, (at_s, (name, fields)) in enumerate(said.items()):
        flight.run(lambda flight, at_s=at_s: flight.time_us >= at_s * 1e6)
        station.receive()
        station.send(encode(name, *STATION, seq, **fields))
    advance(flight, 40.0, lambda: flight.time_us > 40e6 and not flight.controller.state.is_armed)
    return summarise(flight, flight.close(), None, [])


FLIGHTS: dict[str, Callable[[Path], Summary]] = {
    flight.__name__: flight for flight in (mission_in_wind, offboard, failsafe_landing, follow_me, ardupilot)
}


async def _climb(drone: Drone, height_m: float) -> None:
    await drone.wait_ready()
    await drone.arm()
    await drone.takeoff(height_m)


def _flown(flight: Flight, script: Callable[[Drone], Coroutine[Any, Any, None]]) -> Summary:
    running = flight.fly(script, seconds=180.0)
    if running.error is not None:
        raise running.error
    return summarise(flight, flight.close(), running, [])
