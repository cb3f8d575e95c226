"""How long does the Python part of a flight take: commander, navigator and MAVLink?

The recorder and the scripting client are not of the vehicle and are left out; so are the kernels.
"""

import time
from collections.abc import Callable

from bench.row import Row, best_of, require
from mission.flight import Flight, FlightConfig
from mission.plan.plan_file import DEFAULT_PLAN, read_plan
from mission.script import fly_plan

CONFIG = FlightConfig(wind_m_s=5.0)
COMMAND = "python -m bench python_share"


class _Stopwatch:
    """CPU time spent in a function."""

    def __init__(self, function: Callable[[int], None]) -> None:
        self._function = function
        self.total_ns = 0

    def __call__(self, time_us: int) -> None:
        start = time.process_time_ns()
        self._function(time_us)
        self.total_ns += time.process_time_ns() - start


def measure() -> list[Row]:
    share_ms = best_of(4, _share_ms)
    name = "Python share of a flight (commander, navigator, MAVLink)"
    return [Row(name, share_ms, "ms/simulated s", "lower", 3.0, COMMAND)]


def _share_ms() -> float:
    plan = read_plan(DEFAULT_PLAN)
    flight = Flight(CONFIG)
    controller = _Stopwatch(flight.controller.frame)
    recorder = _Stopwatch(flight.recorder.frame)
    flight.controller.frame = controller  # type: ignore[method-assign]
    flight.recorder.frame = recorder  # type: ignore[method-assign]  # runs inside the controller's frame
    running = flight.fly(lambda drone: fly_plan(drone, plan), seconds=600.0)
    flight.close()
    require(running.is_done and running.error is None, f"the mission failed: {running.error}")
    return (controller.total_ns - recorder.total_ns) / flight.time_us  # ns/us is ms/s
