"""How long a companion takes from an image to its setpoint: a step of what ships, detector and guard included."""

import numpy as np

from bench.row import Row, require
from common.clock import wall_time_s
from mission.flight import FlightConfig
from mission.flight_config import OwnerConfig
from mission.follow.lockstep import flight_with_companion
from mission.script import take_off
from policies.companion.engagement import Phase
from policies.companion.guard.settings import GuardSettings
from policies.companion.names import FOLLOWER
from policies.companion.skills.load_skill import load_follower
from policies.tasks.follow_me.world import FOLLOW_WORLD

COMMAND = "python -m bench companion"
DECISIONS = 300
_HOVER_S, _ENGAGE_S = 40.0, 5.0
_DEAD = {"depth_max_m": 0.0}


def measure() -> list[Row]:
    """Median and 99th percentile of a step in lockstep with a whole flight, with a depth camera and with a dead one."""
    rows = []
    for what, numbers in (("the policy that ships", {}), ("the same with a dead depth camera", _DEAD)):
        median, late = _latency_ms(numbers)
        name = f"companion, image in to setpoint out: {what}"
        rows.append(Row(f"{name}, median", median, "ms", "lower", 5.0, COMMAND))
        rows.append(Row(f"{name}, 99 % within", late, "ms", "lower", 10.0, COMMAND))
    return rows


def _latency_ms(numbers: dict[str, float]) -> tuple[float, float]:
    config = FlightConfig(owner=OwnerConfig(numbers=numbers), world=FOLLOW_WORLD, seed=3)
    pilot, guard = load_follower(FOLLOWER), GuardSettings()
    flight, companion = flight_with_companion(config, pilot, guard=guard, wall_s=wall_time_s)
    flight.fly(take_off, seconds=_HOVER_S)
    end_us = flight.time_us + round((_ENGAGE_S + 0.1 * DECISIONS) * 1e6)
    flight.run(lambda _: flight.time_us >= end_us)
    flight.close()
    require(companion.phase is Phase.FLYING, f"the companion does not fly: {companion.trouble}")
    require(companion.decision_count >= DECISIONS, "too few decisions")
    median, late = np.percentile(np.array(companion.latencies_s) * 1e3, (50.0, 99.0))
    return float(median), float(late)
