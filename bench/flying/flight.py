"""How much faster than real time does one vehicle fly a mission, with everything on?

World, wind, body, sensors, estimator, control, commander, navigator, MAVLink with the default telemetry streams over
the memory link, the scripting client, ULog and tlog.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from bench.row import Row, require
from mission.flight import Flight, FlightConfig
from mission.log.flight_summary import planned_path, summarise
from mission.plan.plan_file import DEFAULT_PLAN, read_plan
from mission.script import fly_plan

CONFIG = FlightConfig(wind_m_s=5.0)
COMMAND = "python -m bench flight"


def measure() -> list[Row]:
    plan = read_plan(DEFAULT_PLAN)
    rates = []
    for _ in range(4):
        with TemporaryDirectory() as folder:
            flight = Flight(CONFIG, folder=Path(folder))
            start = time.process_time()
            running = flight.fly(lambda drone: fly_plan(drone, plan), seconds=600.0)
            cpu_s = time.process_time() - start
            summary = summarise(flight, flight.close(), running, planned_path(plan, CONFIG.home))
        require(summary.is_success, f"the mission ended with: {summary.result}")
        require(summary.cross_track_p95_m < 1.5, f"cross-track error {summary.cross_track_p95_m:.2f} m")
        rates.append(flight.time_us * 1e-6 / cpu_s)
    name = "one vehicle, default mission, everything on, lockstep in memory"
    return [Row(name, max(rates[1:]), "simulated s/CPU s", "higher", 200.0, COMMAND)]  # the first one loads kernels
