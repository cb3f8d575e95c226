"""A task that is a model learnt from logs: `model:PATH`. Where no simulator fits, policies are trained in it.

One decision: a member of the ensemble, drawn for every row anew, says what comes (Chua et al. 2018, TS1): its Gaussian
is drawn from, and the reward is its mean. Where the members disagree more than they may, the episode ends and pays the
negative of the greatest recorded reward, times `lost_penalty` (after Kidambi et al. 2020, MOReL).
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import torch
import warp as wp
from numpy.typing import NDArray
from pydantic import Field
from torch import Tensor

from policies.offline.dynamics.model_file import DynamicsModel, ModelError, load_model
from policies.tasks.catalogue import MODEL, UnknownTask
from policies.tasks.episode import OUTCOME_COUNT, Outcome
from policies.tasks.task import Task, TaskSettings


class ModelSettings(TaskSettings):
    """What a user may choose of a model."""

    conditions: ClassVar = TaskSettings.conditions | {"preset", "longest", "lost_penalty"}

    preset: Literal[""] = ""  # type: ignore[assignment]  # there are none
    """There are none."""
    longest: int = Field(default=0, ge=0)
    """Decisions after which an episode is cut; 0: those of the longest recorded one."""
    lost_penalty: float = Field(default=1.0, ge=0.0)
    """What leaving the data costs, in the greatest reward that was recorded of a decision."""


class ModelTask(Task):
    """Environments of one model."""

    model: ClassVar[DynamicsModel]
    params: ClassVar = ()
    settings_class: ClassVar = ModelSettings
    says_success = False
    decision_s = 0.1  # no log says it; nothing is flown at it

    def __init__(self, settings: ModelSettings, env_count: int, device: str = "cpu") -> None:
        super().__init__(self.model.layout, env_count, number_defaults={}, device=device)
        self._longest = settings.longest or self.model.longest
        low, high = self.model.reward_bounds
        self._penalty = settings.lost_penalty * max(abs(low), abs(high))
        self._draws = self._zeros("draws", 1, wp.int32)

    def reset(self, seed: int | Sequence[int], is_chosen: NDArray[np.bool_] | None = None) -> None:
        """Starts environments anew; the same seeds give the same episodes."""
        self._draws.zero_()
        super().reset(seed, is_chosen)

    def _launch_begin(self, is_chosen: NDArray[np.bool_]) -> None:
        self._begin_rows(np.asarray(is_chosen, dtype=np.bool_), self._next_generator())

    def _launch_step(self) -> None:
        generator = self._next_generator()
        seen = torch.from_numpy(self._of("observations").copy())
        actions = torch.from_numpy(self._of("continuous").copy()).clamp(-1.0, 1.0)
        shown, rewards, is_ended, is_lost = self._predicted(seen, actions, generator)
        steps = self._of("steps") + 1
        outcomes = np.where(is_ended, Outcome.ENDED, np.where(steps >= self._longest, Outcome.TIMEOUT, 0))
        outcomes = np.where(is_lost, Outcome.LOST, outcomes).astype(np.int32)
        paid = np.where(is_lost, -self._penalty, rewards).astype(np.float32)
        is_over = outcomes != Outcome.RUNNING
        final, scores = self._of("final_observations").copy(), self._of("scores").copy()
        final[is_over] = shown[is_over]
        returns = self._of("returns") + paid
        scores[is_over, outcomes[is_over]] += 1.0
        scores[is_over, OUTCOME_COUNT] += returns[is_over]
        scores[is_over, OUTCOME_COUNT + 1] += steps[is_over]
        self._put(
            observations=shown, final_observations=final, rewards=paid, outcomes=outcomes, steps=steps, scores=scores,
            returns=returns, is_truncated=outcomes == Outcome.TIMEOUT,
            is_terminated=is_over & (outcomes != Outcome.TIMEOUT),
        )  # fmt: skip
        self._begin_rows(is_over, generator)

    @torch.no_grad()
    def _predicted(self, seen: Tensor, actions: Tensor, generator: torch.Generator) -> tuple[NDArray[Any], ...]:
        """What comes: observations, rewards, whether the episode ends, and whether the model no longer knows."""
        networks = self.model.networks
        found = networks.predict(seen, actions)
        members, rows = torch.randint(len(found.mean), (len(seen),), generator=generator), torch.arange(len(seen))
        noise = torch.randn(found.mean.shape[1:], generator=generator)
        scaled = found.mean[members, rows] + noise * found.log_deviation[members, rows].exp()
        change = scaled * networks.scales["target_deviation"] + networks.scales["target_mean"]
        shown = seen + change[:, :-1]
        # Without its noise, which the bounds would make a gain of where little is paid.
        paid = (
            found.mean[members, rows, -1] * networks.scales["target_deviation"][-1] + networks.scales["target_mean"][-1]
        )
        rewards = paid.clamp(*self.model.reward_bounds)
        is_ended = torch.rand(len(seen), generator=generator) < found.end_logit[members, rows].sigmoid()
        is_lost = (networks.disagreement(found) > self.model.limit) | ~shown.isfinite().all(dim=1)
        shown = torch.where(shown.isfinite(), shown, seen)
        return shown.numpy(), rewards.numpy(), is_ended.numpy(), is_lost.numpy()

    def _begin_rows(self, is_chosen: NDArray[np.bool_], generator: torch.Generator) -> None:
        """Recorded beginnings, drawn for the chosen rows."""
        if not is_chosen.any():
            return
        drawn = torch.randint(len(self.model.starts), (self.env_count,), generator=generator)
        values = {name: self._of(name).copy() for name in ("observations", "steps", "returns", "episodes")}
        values["observations"][is_chosen] = self.model.starts[drawn].numpy()[is_chosen]
        values["steps"][is_chosen] = 0
        values["returns"][is_chosen] = 0.0
        values["episodes"][is_chosen] += 1
        self._put(**values)

    def _next_generator(self) -> torch.Generator:
        """Of this launch's draws: from the seed and how many launches there were, so that a saved task goes on."""
        count = int(self._draws.numpy()[0])
        self._draws.fill_(count + 1)
        key = np.random.SeedSequence([int(self._of("seed")[0]) % 2**32, count]).generate_state(1, np.uint64)[0]
        return torch.Generator().manual_seed(int(key >> 1))

    def _of(self, name: str) -> NDArray[Any]:
        array: NDArray[Any] = getattr(self.buffers, name).numpy()
        return array

    def _put(self, **values: NDArray[Any]) -> None:
        for name, value in values.items():
            getattr(self.buffers, name).assign(value)


def model_class(path: str) -> type[ModelTask]:
    """The task of a model's file.

    Raises:
        UnknownTask: no such file, or no model.
    """
    try:
        return type("ModelTask", (ModelTask,), {"model": load_model(Path(path))})
    except ModelError as error:
        raise UnknownTask(f"{MODEL}{error}") from None
