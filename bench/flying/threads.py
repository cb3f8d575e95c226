"""What do two threads gain over one, with the same bits?"""

import time

from bench.flying.fleet import hovering, same_bits
from bench.row import Row, require
from sim.rig import Rig

VEHICLES = 1024
LAUNCH_TICKS = 25
LAUNCHES = 6
ROUNDS = 6
COMMAND = "python -m bench threads"


def measure() -> list[Row]:
    one, two = hovering(VEHICLES), hovering(VEHICLES, threads=2)
    _wall_s(one)
    _wall_s(two)
    require(same_bits(one.snapshot(), two.snapshot()), "two threads give other bits than one")
    times = [(_wall_s(one), _wall_s(two)) for _ in range(ROUNDS)]  # in turn: both see the same machine
    require(same_bits(one.snapshot(), two.snapshot()), "two threads give other bits than one")
    gain = min(first for first, _ in times) / min(second for _, second in times)
    return [Row("two threads over one, 1,024 vehicles, identical bits", gain, "x", "higher", 1.6, COMMAND)]


def _wall_s(rig: Rig) -> float:
    start = time.perf_counter()
    for _ in range(LAUNCHES):
        rig.advance(LAUNCH_TICKS)
    return time.perf_counter() - start
