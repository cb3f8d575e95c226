"""Training from datasets: `offline` of a behaviour, and the hyperparameters of its algorithms. All keys are ours."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from policies.learn.config.config_block import (
    Block,
    Count,
    Fraction,
    NotNegative,
    NotNegativeWhole,
    Positive,
    Real,
    own_key,
)
from policies.learn.config.gradient import GradientHyperparameters


def _listed(raw: Any) -> Any:
    return [raw] if isinstance(raw, str) else raw


class OfflineSettings(Block):
    """`offline` of a behaviour."""

    dataset: Annotated[tuple[str, ...], Field(min_length=1), BeforeValidator(_listed)] = own_key(...)
    """Datasets: a folder, a file in it, a folder of several, or a local id; one, or a list of them."""
    cache: str | None = own_key(None)
    """Folder of the file that a dataset too large for memory is mapped from; none: that of the first dataset."""
    evaluation_interval: Count = own_key(50_000)
    """Gradient steps between evaluations in the simulator."""
    evaluation_episodes: NotNegativeWhole = own_key(100)
    """Of each evaluation; 0: none."""
    reference_returns: tuple[Real, Real] | None = own_key(None)
    """Mean returns of random actions and of an expert: the normalised score is 0 at the first and 100 at the second."""

    @model_validator(mode="after")
    def _references_differ(self) -> Self:
        if self.reference_returns is not None and self.reference_returns[0] == self.reference_returns[1]:
            raise ValueError("reference_returns: must differ: a score is measured from one to the other")
        return self


class OfflineHyperparameters(GradientHyperparameters):
    """What all algorithms on datasets have."""

    actions: Literal["squashed", "clipped"] = own_key("squashed")
    """How the policy keeps actions in -1 to 1: `squashed` as SAC's, which can go on with it; `clipped` as PPO's."""

    @property
    def is_squashed(self) -> bool:
        return self.actions == "squashed"


class BcHyperparameters(OfflineHyperparameters):
    """`hyperparameters` of `trainer_type: bc`."""

    best_fraction: Fraction = own_key(1.0, gt=0.0)
    """Only this fraction of the episodes is cloned, those of the greatest returns."""


class _CriticHyperparameters(OfflineHyperparameters):
    tau: Fraction = own_key(0.005)
    """How far targets follow at each step."""


class Td3BcHyperparameters(_CriticHyperparameters):
    """`hyperparameters` of `trainer_type: td3_bc`."""

    alpha: NotNegative = own_key(2.5)
    """Weight of the critic, whose values are brought to mean size 1, against staying at what was recorded."""
    policy_interval: Count = own_key(2)
    """Steps of the critics per step of the policy."""
    target_noise: NotNegative = own_key(0.2)
    """Deviation of the noise on the next action, which smooths the targets."""
    target_noise_limit: NotNegative = own_key(0.5)
    """Where that noise is cut."""


class IqlHyperparameters(_CriticHyperparameters):
    """`hyperparameters` of `trainer_type: iql`."""

    expectile: Fraction = own_key(0.7, gt=0.0, lt=1.0)
    """How near the value of an observation is to that of the best action recorded there; 0.5: their mean."""
    inverse_temperature: Positive = own_key(3.0)
    """How much more an action counts that is better than the others."""
    greatest_weight: Positive = own_key(100.0)
    """Most that one action counts."""


class AwacHyperparameters(_CriticHyperparameters):
    """`hyperparameters` of `trainer_type: awac`."""

    inverse_temperature: Positive = own_key(1.0)
    """How much more an action counts that is better than the policy's own."""
    greatest_weight: Positive = own_key(100.0)
    """Most that one action counts."""
