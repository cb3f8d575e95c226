"""How long a companion takes from an image to its setpoint: a policy's step in flight."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import torch

from bench.row import Row, require
from common.clock import wall_time_s
from mission.flight import FlightConfig
from mission.flight_config import OwnerConfig
from mission.follow.lockstep import flight_with_companion
from mission.script import take_off
from policies.companion.engagement import Phase
from policies.companion.pilot import LAYOUT_VERSION, SCRIPTED, TASK, load_pilot
from policies.companion.skills.following import Pilot
from policies.learn.config.network import NetworkSettings
from policies.learn.export.policy_file import PolicyCard, save_policy
from policies.learn.networks.policy import Policy
from policies.pretrained.pretrained_policies import pretrained
from policies.tasks.flight.own_state import ACTIONS
from policies.tasks.follow_me.observe import EGO, IMAGE_CHANNELS, IMAGE_SIZE, vector_elements
from policies.tasks.follow_me.world import FOLLOW_WORLD
from policies.tasks.layout import ImageElement, Layout

COMMAND = "python -m bench companion"
DECISIONS = 300
_HOVER_S, _ENGAGE_S = 40.0, 5.0
_STAND_IN = {"vis_encode_type": "nature_cnn", "hidden_units": 256, "memory": {"memory_size": 256}}


def measure() -> list[Row]:
    """Median and 99th percentile of a learned policy's step and of the script's, in lockstep with a whole flight."""
    name = TASK if pretrained(TASK) is not None else ""
    with TemporaryDirectory() as folder:
        learned = load_pilot(name or str(_stand_in(Path(folder))))
    what = "the shipped policy" if name else "a policy of its size, untrained"
    median, late = _latency_ms(_Watched(load_pilot(SCRIPTED), learned))
    return [
        Row(f"companion, picture in to setpoint out: {what}, median", median, "ms", "lower", 5.0, COMMAND),
        Row("the same, 99 % within", late, "ms", "lower", 10.0, COMMAND),
    ]


class _Watched:
    """Flies by the script, so that every flight is long enough, after the policy has decided too and is timed."""

    def __init__(self, script: Pilot, learned: Pilot) -> None:
        self.kind, self.image_shape = learned.kind, learned.image_shape
        self._script, self._learned = script, learned
        self.owner_hfrd = script.owner_hfrd
        self.is_finite = True

    def reset(self) -> None:
        self._learned.reset()

    def act(self, vector: np.ndarray, image: np.ndarray) -> np.ndarray:
        action = self._learned.act(vector, image)
        self.is_finite &= bool(np.isfinite(action).all())
        chosen = self._script.act(vector, image)
        self.owner_hfrd = self._script.owner_hfrd
        return chosen


def _latency_ms(pilot: _Watched) -> tuple[float, float]:
    config = FlightConfig(owner=OwnerConfig(), world=FOLLOW_WORLD, seed=3)
    flight, companion = flight_with_companion(config, pilot, wall_s=wall_time_s)
    flight.fly(take_off, seconds=_HOVER_S)
    end_us = flight.time_us + round((_ENGAGE_S + 0.1 * DECISIONS) * 1e6)
    flight.run(lambda _: flight.time_us >= end_us)
    flight.close()
    require(companion.phase is Phase.FLYING, f"the companion does not fly: {companion.trouble}")
    require(pilot.is_finite, "the policy's actions are no numbers")
    require(companion.decision_count >= DECISIONS, "too few decisions")
    median, late = np.percentile(np.array(companion.latencies_s) * 1e3, (50.0, 99.0))
    return float(median), float(late)


def _stand_in(folder: Path) -> Path:
    """A policy file with the network of the recipe, as it begins."""
    image = ImageElement(IMAGE_SIZE, IMAGE_SIZE, IMAGE_CHANNELS)
    layout = Layout(TASK, LAYOUT_VERSION, vector_elements(int(EGO)), ACTIONS, image=image)
    settings = NetworkSettings.model_validate(_STAND_IN)
    path = folder / "policy.pt"
    save_policy(path, Policy(layout, settings, torch.Generator().manual_seed(1)), PolicyCard(TASK, {}, 0, 0))
    return path
