"""How many simulated seconds do 1,024 vehicles fly per second of one core?"""

import time

from bench.flying.fleet import check, hovering
from bench.row import Row, best_of
from common.kernels import TICK_S

VEHICLES = 1024
LAUNCH_TICKS = 25
LAUNCHES = 10
COMMAND = "python -m bench batch"


def measure() -> list[Row]:
    on = _rate(has_estimator=True)
    off = _rate(has_estimator=False)
    unit = "simulated s/s"
    return [
        Row("1,024 vehicles, one core, estimator and sensors on", on, unit, "higher", 1500.0, COMMAND),
        Row("1,024 vehicles, one core, estimator and sensors off", off, unit, "higher", 4500.0, COMMAND),
    ]


def _rate(*, has_estimator: bool) -> float:
    rig = hovering(VEHICLES, has_estimator=has_estimator)

    def cpu_s() -> float:
        start = time.process_time()
        for _ in range(LAUNCHES):
            rig.advance(LAUNCH_TICKS)
        return time.process_time() - start

    rate = VEHICLES * LAUNCHES * LAUNCH_TICKS * TICK_S / best_of(10, cpu_s)
    check(rig, has_estimator=has_estimator)
    return rate
