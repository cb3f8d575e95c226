"""Does a vehicle cost more in a larger batch?"""

import time

from bench.flying.fleet import check, hovering
from bench.row import Row
from sim.rig import Rig

SMALL, LARGE = 1024, 4096
LAUNCH_TICKS = 25
ROUNDS = 5
COMMAND = "python -m bench scaling"


def measure() -> list[Row]:
    small, large = hovering(SMALL), hovering(LARGE)
    _vehicle_cpu_s(small, 4)
    _vehicle_cpu_s(large, 1)
    costs = [(_vehicle_cpu_s(small, 4), _vehicle_cpu_s(large, 1)) for _ in range(ROUNDS)]  # in turn: the same machine
    check(large, has_estimator=True)
    ratio = min(cost for _, cost in costs) / min(cost for cost, _ in costs)
    return [Row("cost of one vehicle at N = 4,096 over N = 1,024", ratio, "x", "lower", 1.1, COMMAND)]


def _vehicle_cpu_s(rig: Rig, launches: int) -> float:
    start = time.process_time()
    for _ in range(launches):
        rig.advance(LAUNCH_TICKS)
    return (time.process_time() - start) / (rig.vehicle_count * launches)
