"""How much faster than real time do ten vehicles fly their missions in one world, with everything on?

Five multirotors and five rovers, each with a flight controller, links, telemetry, ULog and tlog of its own, on one
clock.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from bench.row import Row, require
from common.airframe import load_airframe
from mission.fleet.fleet_flight import FleetFlight
from mission.fleet.fleet_options import Member
from mission.fleet.roster import fleet_configs
from mission.flight_config import TREELESS_M, FlightConfig, start_of
from mission.plan.plan_file import default_plan, moved_plan, read_plan
from mission.script import fly_plan
from mission.simulator.flight_rig import flight_world
from sim.world.world import WorldConfig

CONFIG = FlightConfig(wind_m_s=5.0, world=WorldConfig(treeless_radius_m=TREELESS_M))  # as the command line's
MEMBERS = [Member("x500")] * 5 + [Member("rover")] * 5
COMMAND = "python -m bench vehicles"
RUNS = 3  # the first one loads kernels


def measure() -> list[Row]:
    rate = max([_rate() for _ in range(RUNS)][1:])
    name = "ten vehicles in one world, default missions, everything on, lockstep in memory"
    return [Row(name, rate, "simulated s/CPU s", "higher", 3.0, COMMAND)]


def _rate() -> float:
    """Simulated seconds of the world per CPU second, until the last mission is done."""
    world = flight_world(CONFIG)
    with TemporaryDirectory() as folder:
        fleet = FleetFlight(fleet_configs(CONFIG, MEMBERS, world), world, folder=Path(folder))
        running = []
        for flight in fleet.flights:
            plan = read_plan(default_plan(load_airframe(flight.config.airframe).vehicle))
            running.append(flight.drone.start(fly_plan(flight.drone, moved_plan(plan, start_of(flight.config)))))
        start = time.process_time()
        fleet.run(lambda flown: flown.time_us >= 300e6 or all(each.is_done for each in running))
        cpu_s = time.process_time() - start
        fleet.close()
    for flight, script in zip(fleet.flights, running, strict=True):
        number = flight.drone.system_id
        require(script.is_done and script.error is None and not flight.is_crashed, f"vehicle {number}: {script.error}")
    return fleet.time_us * 1e-6 / cpu_s
