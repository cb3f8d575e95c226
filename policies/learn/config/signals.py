"""Reward signals: `reward_signals` of a behaviour. The order here is the order of value heads and advantages."""

from typing import Literal

from pydantic import field_validator

from policies.learn.config.config_block import Block, CountOrNone, Fraction, NotNegative, Positive, own_key
from policies.learn.config.network import NetworkSettings


class SignalSettings(Block):
    """What every reward signal has."""

    gamma: Fraction = 0.99
    """Discount of this signal's rewards."""
    strength: NotNegative = 1.0
    """The signal's rewards are multiplied by this."""
    network_settings: NetworkSettings = NetworkSettings()
    """The signal's own network; the task's reward needs none."""


class ExtrinsicSettings(SignalSettings):
    """The reward of the task."""


class GailSettings(SignalSettings):
    """Generative adversarial imitation: reward for looking like the demonstrations."""

    demo_path: str
    """Demonstrations: a file or a folder."""
    learning_rate: Positive = 3e-4
    """Of the discriminator."""
    use_actions: bool = False
    """Whether the discriminator sees actions too, not only observations."""
    use_vail: bool = False
    """Whether the discriminator has a variational bottleneck."""
    batch_size: CountOrNone = own_key(None)
    """Steps per update of the discriminator, drawn from the policy's minibatch; none: all of it."""
    reward_form: Literal["ml-agents", "logit", "log"] = own_key("ml-agents")
    """From the discriminator's D: `ml-agents` -log(1 - D), never negative; `logit` log D - log(1 - D); `log` log D."""

    @field_validator("demo_path")
    @classmethod
    def _names_something(cls, path: str) -> str:
        if not path.strip():
            raise ValueError("must name a file or a folder of demonstrations")
        return path


class CuriositySettings(SignalSettings):
    """Intrinsic curiosity (ICM): reward for what a forward model predicts badly."""

    learning_rate: Positive = 3e-4
    """Of the forward and the inverse model."""


class RndSettings(SignalSettings):
    """Random network distillation: reward for what was seen rarely."""

    learning_rate: Positive = 1e-4
    """Of the predictor."""
    normalize_reward: bool = own_key(True)
    """Whether observations and rewards are normalised, as in the RND paper; false: neither, as in ML-Agents."""


class RewardSignals(Block):
    """The signals in use; those that are not named are off, also the task's own."""

    extrinsic: ExtrinsicSettings | None = None
    """The reward of the task."""
    gail: GailSettings | None = None
    """Imitation."""
    curiosity: CuriositySettings | None = None
    """Intrinsic curiosity."""
    rnd: RndSettings | None = None
    """Random network distillation."""

    @property
    def in_use(self) -> dict[str, SignalSettings]:
        """The signals that are on, by name, always in the order of the fields."""
        signals = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: signal for name, signal in signals.items() if signal is not None}
