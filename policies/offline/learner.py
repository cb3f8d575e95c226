"""The offline learner: gradient steps on recorded decisions, now and then an evaluation in the simulator.

One iteration is a block of gradient steps, whose minibatches are drawn at once; of several processes, each draws all
and takes its part, and the first evaluates. Its statistics stay tensors until the
block is over. The training loop is that of PPO and SAC: a step is a gradient step.
"""

import copy
from collections.abc import Callable, Mapping
from typing import Any

import torch

from policies.learn.algorithms.learner import Iteration
from policies.learn.algorithms.schedule import RATE_FLOOR, scheduled
from policies.learn.averaging import averaged, call_round, own_part, rank
from policies.learn.config.behavior import Behavior
from policies.learn.config.offline import BcHyperparameters, OfflineHyperparameters
from policies.learn.evaluate import Evaluation
from policies.learn.export.policy_path import CheckpointError
from policies.learn.networks.policy import Policy
from policies.offline.algorithm import OfflineAlgorithm
from policies.offline.draws import Draws
from policies.offline.scores import normalized_score, scores_of
from policies.offline.store import OfflineStore

BLOCK_STEPS = 200  # gradient steps of an iteration, whose minibatches are drawn at once

Judge = Callable[[Policy], Evaluation]


class OfflineLearner:
    """A learner: see `policies/learn/algorithms/learner.py`."""

    def __init__(
        self,
        policy: Policy,
        store: OfflineStore,
        algorithm: OfflineAlgorithm,
        behavior: Behavior,
        *,
        seed: int,
        judge: Judge,
    ) -> None:
        """A learner that has made no step.

        Args:
            policy: trained in place by the algorithm.
            store: what is learnt from.
            algorithm: on that store.
            behavior: with the hyperparameters of an offline algorithm, and `offline`.
            seed: of the order of minibatches.
            judge: plays the policy in the simulator.
        """
        if not isinstance(behavior.hyperparameters, OfflineHyperparameters) or behavior.offline is None:
            raise TypeError("the behaviour is not of an offline algorithm")
        self.steps = 0
        self.policy = policy
        self.algorithm = algorithm
        self._store = store
        self._behavior, self._settings = behavior, behavior.offline
        self._judge = judge
        self._generator = torch.Generator().manual_seed(seed)
        hyperparameters, memory = behavior.hyperparameters, policy.settings.memory
        fraction = hyperparameters.best_fraction if isinstance(hyperparameters, BcHyperparameters) else 1.0
        length = memory.sequence_length if memory else 1
        self._draws = Draws(store, hyperparameters.batch_size, length, fraction)

    def iterate(self) -> Iteration:
        """A block of gradient steps, and an evaluation if one is due."""
        before = self.steps
        steps = min(BLOCK_STEPS, self._behavior.max_steps - before)
        hyperparameters = self._behavior.hyperparameters
        done = before / self._behavior.max_steps
        rate = scheduled(hyperparameters.learning_rate, RATE_FLOOR, hyperparameters.learning_rate_schedule, done)
        self.algorithm.set_learning_rate(rate)
        call_round(goes_on=True)
        rows = own_part(self._draws.block(steps, self._generator), dim=-1)
        made = [self.algorithm.step(each) for each in rows]
        self.steps += steps
        statistics = dict(zip(self.algorithm.tags, averaged(torch.stack(made).mean(dim=0)).tolist(), strict=True))
        statistics["Policy/Learning Rate"] = rate
        interval = self._settings.evaluation_interval
        is_due = self.steps // interval > before // interval or self.steps >= self._behavior.max_steps
        is_judged = bool(self._settings.evaluation_episodes) and is_due and rank() == 0
        evaluation = self._evaluate(statistics) if is_judged else None
        return Iteration(steps, scores_of(evaluation), statistics, evaluation)

    def _evaluate(self, statistics: dict[str, float]) -> Evaluation:
        """Plays the policy; its mean return and score become statistics."""
        evaluation = self._judge(self.policy)
        statistics["Offline/Mean Return"] = evaluation.mean_return
        if self._settings.reference_returns is not None:
            score = normalized_score(evaluation.mean_return, self._settings.reference_returns)
            statistics["Offline/Normalized Score"] = score
        return evaluation

    def restart(self) -> None:
        """No episode is going on."""

    def state(self) -> dict[str, Any]:
        """Networks, optimisers and the generator; of the dataset what tells it from others."""
        return copy.deepcopy(
            {
                "steps": self.steps,
                "policy": self.policy.state_dict(),
                "networks": self.algorithm.state(),
                "generator": self._generator.get_state(),
                "dataset": self._store.identity(),
            }
        )

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on bit for bit.

        Raises:
            CheckpointError: the dataset is another one.
        """
        there, here = state["dataset"], self._store.identity()
        for key, value in here.items():
            if there[key] != value:
                raise CheckpointError(
                    f"offline.dataset: is not the one that the run began with: {key} is {value}, and was {there[key]}"
                )
        self.steps = state["steps"]
        self.policy.load_state_dict(state["policy"])
        self.algorithm.load_state(copy.deepcopy(state["networks"]))
        self._generator.set_state(state["generator"])

    def take_critics(self, state: Mapping[str, Any]) -> None:
        """Starts from another run's critics if they fit."""
        self.algorithm.take_critics(state.get("networks", {}))
