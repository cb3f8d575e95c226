"""How much faster than real time does one vehicle fly a mission, with everything on, and how much faster one drive?

World, wind, body, sensors, estimator, control, commander, navigator, MAVLink with the default telemetry streams over
the memory link, the scripting client, ULog and tlog. The rover takes turns with the multirotor, on the same world.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from bench.row import Row, require
from mission.flight import Flight, FlightConfig
from mission.fly_session import default_plan
from mission.log.flight_summary import planned_path, summarise
from mission.plan.plan_file import read_plan
from mission.script import fly_plan

CONFIG = FlightConfig(wind_m_s=5.0)
ROVER = FlightConfig(wind_m_s=5.0, airframe="rover")
COMMAND = "python -m bench flight"
RUNS = 4  # the first one loads kernels


def measure() -> list[Row]:
    turns = [(rate(CONFIG), rate(ROVER)) for _ in range(RUNS)][1:]
    flown, driven = (max(rates) for rates in zip(*turns, strict=True))
    name = "default mission, everything on, lockstep in memory"
    return [
        Row(f"one vehicle, {name}", flown, "simulated s/CPU s", "higher", 200.0, COMMAND),
        Row(f"one rover, {name}", driven, "simulated s/CPU s", "higher", None, COMMAND),
        Row("one rover over one multirotor", driven / flown, "x", "higher", 1.25, COMMAND),
    ]


def rate(config: FlightConfig) -> float:
    """Simulated seconds per CPU second of a vehicle's default mission."""
    plan = read_plan(default_plan(config.airframe))
    with TemporaryDirectory() as folder:
        flight = Flight(config, folder=Path(folder))
        start = time.process_time()
        running = flight.fly(lambda drone: fly_plan(drone, plan), seconds=600.0)
        cpu_s = time.process_time() - start
        summary = summarise(flight, flight.close(), running, planned_path(plan, config.home))
    require(summary.is_success, f"the mission ended with: {summary.result}")
    require(summary.cross_track_p95_m < 1.5, f"cross-track error {summary.cross_track_p95_m:.2f} m")
    return flight.time_us * 1e-6 / cpu_s
