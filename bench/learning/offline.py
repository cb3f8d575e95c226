"""How fast are our IQL and TD3+BC beside plain torch, and how good are the policies they make of three datasets?

Hover, flown by its expert through noise: expert, medium and replay datasets (`offline_data.py`). Both sides train the
same networks (2 x 64, batch 256) on the same data for the same steps, on one thread; times are of the processor.
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from bench.learning.naive_offline import NaiveBatches, NaiveIql, NaiveTd3Bc, weights_of
from bench.learning.offline_data import QUALITIES, record
from bench.row import Row, require
from policies.learn.config.behavior import Behavior
from policies.learn.evaluate import evaluate
from policies.learn.networks.policy import Policy
from policies.offline.algorithm import OfflineAlgorithm
from policies.offline.build_offline import build_algorithm
from policies.offline.draws import Draws
from policies.offline.scores import normalized_score
from policies.offline.store import OfflineStore, open_store
from policies.tasks.catalogue import build_task, settings_of

TASK, ARGUMENTS = "Hover", ["has_estimator=false"]
EPISODES, STEPS, HIDDEN, BATCH = 100, 10_000, 64, 256
COMMAND = "python -m bench offline"
NAIVE = {"iql": NaiveIql, "td3_bc": NaiveTd3Bc}


def measure() -> list[Row]:
    """Normalised scores, and the ratio of processor times."""
    torch.set_num_threads(1)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        stores = {quality: _recorded(Path(folder) / quality, quality) for quality in QUALITIES}
    references = random_return(), float(stores["expert"].episode_returns().mean())
    for trainer in NAIVE:
        ratios = []
        for quality, store in stores.items():
            ours, our_s = _ours(trainer, store)
            theirs, their_s = _theirs(trainer, store)
            ratios.append(their_s / our_s)
            scores = [normalized_score(_mean_return(policy), references) for policy in (ours, theirs)]
            require(np.isfinite(scores).all(), f"{trainer} on {quality}: scores {scores}")
            name = f"{TASK}, {quality}: {trainer}, {STEPS // 1000}k steps"
            rows += [
                Row(f"{name}, normalised score", scores[0], "1", "higher", None, COMMAND),
                Row(f"{name}, normalised score of plain torch", scores[1], "1", "higher", None, COMMAND),
            ]
        rows.append(Row(f"{trainer}, 2 x {HIDDEN}: speed over plain torch", min(ratios), "1", "higher", 1.5, COMMAND))
    return rows


def random_return() -> float:
    """The mean return of uniform random actions."""
    task = build_task(TASK, 64, settings_of(TASK, ARGUMENTS))
    task.reset(3)
    rng = np.random.default_rng(3)
    scores = task.take_scores()
    while scores.episode_count < 256:
        task.buffers.continuous.assign(rng.uniform(-1, 1, task.buffers.continuous.shape).astype(np.float32))
        task.step()
        scores = scores + task.take_scores()
    return scores.return_sum / scores.episode_count


def built(trainer: str, store: OfflineStore, hidden: int = HIDDEN, seed: int = 0) -> tuple[Policy, OfflineAlgorithm]:
    """An untrained policy, and the algorithm that trains it."""
    behavior = Behavior.model_validate(
        {
            "trainer_type": trainer,
            "offline": {"dataset": "in memory"},
            "network_settings": {"hidden_units": hidden, "normalize": True},
        }
    )
    policy = Policy(store.layout, behavior.network_settings, torch.Generator().manual_seed(seed), is_squashed=True)
    statistics = store.statistics()
    assert policy.body.normalizer is not None
    policy.body.normalizer.take(statistics.mean, statistics.variance, len(store.rows))
    return policy, build_algorithm(behavior, policy, store, seed=seed)


def _recorded(folder: Path, quality: str) -> OfflineStore:
    record(folder, TASK, ARGUMENTS, quality, EPISODES)
    return open_store([str(folder)])


def _ours(trainer: str, store: OfflineStore) -> tuple[Policy, float]:
    policy, algorithm = built(trainer, store)
    draws, generator = Draws(store, BATCH, 1, 1.0), torch.Generator().manual_seed(0)

    def learn() -> None:
        for _ in range(STEPS // 200):
            for rows in draws.block(200, generator):
                algorithm.step(rows)

    return policy, _processor_s(learn)


def _theirs(trainer: str, store: OfflineStore) -> tuple[Policy, float]:
    torch.manual_seed(0)
    sizes = store.layout.observation_size, len(store.layout.continuous)
    naive = NAIVE[trainer](sizes, HIDDEN, NaiveBatches(store, BATCH, 0))

    def learn() -> None:
        for _ in range(STEPS):
            naive.step()

    spent_s = _processor_s(learn)
    policy, _ = built("bc", store)
    assert policy.heads.mean is not None
    layers = [*policy.body.layers, policy.heads.mean]
    ours = [parameter for layer in layers for parameter in layer.parameters()]
    with torch.no_grad():
        for there, here in zip(ours, weights_of(naive.policy), strict=True):
            there.copy_(here)
    return policy, spent_s


def _processor_s(work: Callable[[], None]) -> float:
    start_s = time.process_time()
    work()
    return time.process_time() - start_s


def _mean_return(policy: Policy) -> float:
    return evaluate(policy, TASK, settings_of(TASK, ARGUMENTS), episodes=100, seed=11).mean_return
