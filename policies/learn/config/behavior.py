"""One behaviour: what is trained, by which algorithm, with which numbers. Names and defaults are ML-Agents'."""

from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from policies.learn.config.config_block import (
    Block,
    Count,
    CountOrNone,
    Fraction,
    FractionOrNone,
    NotNegative,
    NotNegativeWhole,
    Positive,
    PositiveOrNone,
    Schedule,
    own_key,
)
from policies.learn.config.gradient import GradientHyperparameters
from policies.learn.config.network import NetworkSettings
from policies.learn.config.offline import (
    AwacHyperparameters,
    BcHyperparameters,
    IqlHyperparameters,
    OfflineHyperparameters,
    OfflineSettings,
    Td3BcHyperparameters,
)
from policies.learn.config.signals import ExtrinsicSettings, RewardSignals


def _as(key: str, otherwise: Any) -> Any:
    """The default of a key that is as another one, declared above it."""
    return Field(default_factory=lambda data: data.get(key, otherwise), json_schema_extra={"as": key})


class HyperparametersBase(GradientHyperparameters):
    """What algorithms have that collect their own steps."""

    batch_size: Count = 1024
    """Steps per gradient step."""
    buffer_size: Count = 10240
    """Steps collected before each update."""

    @model_validator(mode="after")
    def _batch_fits(self) -> Self:
        if self.batch_size > self.buffer_size:
            sizes = f"batch_size {self.batch_size} is larger than buffer_size {self.buffer_size}"
            raise ValueError(f"{sizes}: no batch would ever be full")
        return self


class PpoHyperparameters(HyperparametersBase):
    """`hyperparameters` of `trainer_type: ppo`."""

    learning_rate_schedule: Schedule = "linear"
    """`linear`: falls to 0 at max_steps."""
    beta: NotNegative = 5e-3
    """Weight of the entropy."""
    beta_schedule: Schedule = _as("learning_rate_schedule", "linear")
    """`linear`: falls to 1e-5."""
    epsilon: Positive = 0.2
    """How far the ratio of new to old probability may move before it is clipped."""
    epsilon_schedule: Schedule = _as("learning_rate_schedule", "linear")
    """`linear`: falls to 0.1."""
    lambd: Fraction = 0.95
    """λ of the generalised advantage estimate."""
    num_epoch: Count = 3
    """Passes over the buffer per update."""
    shared_critic: bool = False
    """Whether actor and critic share one body."""
    privileged_critic: bool = own_key(False)
    """Whether the critic sees the task's privileged elements in place of its image; the policy never does."""
    critic_warm_up: NotNegativeWhole = own_key(0)
    """Decisions at the start in which the critic learns alone, so that it does not lead a trained policy astray; its
    values are not clipped then."""
    start_deviation: PositiveOrNone = own_key(None)
    """Most that continuous actions, which are in -1 to 1, deviate at the start of a run from networks of another; none:
    as there."""
    perception_strength: NotNegative = own_key(0.1)
    """Weight of the beliefs that `network_settings` names, if it names any."""
    target_kl: PositiveOrNone = own_key(None)
    """An update ends early when the policy has moved this far (mean KL); none: never."""
    normalize_returns: bool = own_key(False)
    """Whether critics learn returns divided by their running deviation."""
    sharpening: Positive = own_key(1.0)
    """By how much the logits of discrete choices are scaled up between 50 % and 75 % of max_steps: from there on it is
    nearly the most probable choices that are learned from; 1: not at all."""
    joint_ratio: bool = own_key(False)
    """Whether the ratio is of the whole action, not of each branch and dimension by itself."""
    normalize_advantages: Literal["buffer", "minibatch", "none"] = own_key("buffer")
    """Over what advantages are brought to mean 0 and deviation 1."""

    @model_validator(mode="after")
    def _one_body_sees_one_thing(self) -> Self:
        if self.privileged_critic and self.shared_critic:
            raise ValueError("privileged_critic: cannot be with shared_critic: a shared body sees what the policy sees")
        if self.critic_warm_up and self.shared_critic:
            raise ValueError("critic_warm_up: cannot be with shared_critic: a shared body learns with the critic")
        return self


class SacHyperparameters(HyperparametersBase):
    """`hyperparameters` of `trainer_type: sac`."""

    batch_size: Count = 128
    """Steps per gradient step."""
    buffer_size: Count = 50000
    """Steps the replay buffer holds."""
    buffer_init_steps: NotNegativeWhole = 0
    """Steps of random actions before the first update."""
    init_entcoef: Positive = 1.0
    """Entropy temperature at the start."""
    tau: Fraction = 0.005
    """How far the target network follows at each update."""
    steps_per_update: Positive = 1.0
    """Steps of experience per update."""
    reward_signal_steps_per_update: Positive = _as("steps_per_update", 1.0)
    """Steps of experience per update of the reward signals."""
    save_replay_buffer: bool = False
    """Whether the replay buffer is saved with the checkpoints."""
    prefill: Fraction = own_key(0.0)
    """Fraction of the replay buffer that begins filled with decisions of the dataset that `offline` names."""
    hold: NotNegative = own_key(0.0)
    """Weight, at the start, of staying at the actions of that dataset; against the critics' values at mean size 1."""
    hold_steps: NotNegativeWhole = own_key(0)
    """Steps over which `hold` falls to 0."""
    hindsight: NotNegativeWhole = own_key(0)
    """Copies of each step in which a goal reached later in the episode stands for the goal (HER, `future`)."""


class Augmentation(Block):
    """How images are changed at random while a student learns from them; nothing by default."""

    shift_px: NotNegativeWhole = own_key(0)
    """Images are moved by up to this many pixels; what lies ahead moves with them, so keep it small."""
    exposure: NotNegative = own_key(0.0)
    """Colours are brightened or darkened by up to this many stops."""
    noise: NotNegative = own_key(0.0)
    """Deviation of noise added to colours, of 255."""


class DaggerHyperparameters(HyperparametersBase):
    """`hyperparameters` of `trainer_type: dagger`: a student learns what a teacher does in the states it gets into."""

    teacher: str = own_key(...)
    """The teacher: a policy file, a run, or a task that ships a policy; it sees the task's privileged elements."""
    steps_per_round: Count = own_key(8192)
    """Steps collected before each update."""
    num_epoch: Count = own_key(4)
    """How often each step is learnt from, in the mean, if the buffer holds them all."""
    mixing: Fraction = own_key(0.5)
    """In round i the teacher drives this to the power of i of the environments: all in the first round."""
    perception_strength: NotNegative = own_key(0.1)
    """Weight of the beliefs that `network_settings` names, next to that of the actions."""
    augmentation: Augmentation = own_key(Augmentation())
    """How images are changed at random."""
    save_replay_buffer: bool = own_key(False)
    """Whether the buffer is saved with the checkpoints; without it a resumed run begins to fill it anew."""


Hyperparameters = (
    PpoHyperparameters
    | SacHyperparameters
    | DaggerHyperparameters
    | BcHyperparameters
    | Td3BcHyperparameters
    | IqlHyperparameters
    | AwacHyperparameters
)
HYPERPARAMETERS: Mapping[str, type[Hyperparameters]] = {
    "ppo": PpoHyperparameters,
    "sac": SacHyperparameters,
    "dagger": DaggerHyperparameters,
    "bc": BcHyperparameters,
    "td3_bc": Td3BcHyperparameters,
    "iql": IqlHyperparameters,
    "awac": AwacHyperparameters,
}


def _default_hyperparameters(data: dict[str, Any]) -> Hyperparameters:
    return HYPERPARAMETERS[data.get("trainer_type", "ppo")]()


class BehavioralCloning(Block):
    """Cloning of demonstrations beside the updates."""

    demo_path: str
    """Demonstrations: a file or a folder."""
    steps: NotNegativeWhole = 0
    """Steps over which its learning rate falls to 0; 0: it stays."""
    strength: NotNegative = 1.0
    """Its learning rate is the policy's times this."""
    samples_per_update: NotNegativeWhole = 0
    """Demonstrated steps per update at most; 0: all."""
    num_epoch: CountOrNone = None
    """Passes per update; none: the policy's."""
    batch_size: CountOrNone = None
    """Steps per gradient step; none: the policy's."""


class Behavior(Block):
    """One entry of `behaviors`."""

    trainer_type: Literal["ppo", "sac", "dagger", "bc", "td3_bc", "iql", "awac"] = "ppo"
    """The algorithm; ours are `dagger`, a student beside a teacher, and `bc`, `td3_bc`, `iql` and `awac`, which learn
    from the dataset that `offline` names."""
    hyperparameters: Hyperparameters = Field(default_factory=_default_hyperparameters)
    """Numbers of the algorithm."""
    network_settings: NetworkSettings = NetworkSettings()
    """Networks of the policy and its critic."""
    reward_signals: RewardSignals = RewardSignals(extrinsic=ExtrinsicSettings())
    """What is rewarded; the default is the task's reward alone."""
    behavioral_cloning: BehavioralCloning | None = None
    """Cloning of demonstrations; none: off."""
    offline: OfflineSettings | None = own_key(None)
    """The dataset that is learnt from; none: what is collected."""
    self_play: None = None
    """Refused: each environment has one agent."""
    max_steps: Count = 500_000
    """Training ends after this many decisions of all environments together; offline, after this many gradient steps."""
    time_horizon: Count = 64
    """Decisions after which a trajectory is cut and its rest estimated."""
    summary_freq: Count = 50_000
    """Steps between summaries."""
    keep_checkpoints: Count = 5
    """How many of the newest checkpoints stay."""
    checkpoint_interval: Count = 500_000
    """Steps between checkpoints."""
    even_checkpoints: bool = False
    """Whether keep_checkpoints are spread evenly over max_steps, in place of checkpoint_interval."""
    threaded: bool = False
    """Accepted; collecting and learning take turns here."""
    init_path: str | None = None
    """Whose networks this one starts from: a policy file or checkpoint, a run, or the name of one that ships."""
    success_target: FractionOrNone = own_key(None)
    """Training ends when this fraction of episodes succeeds; none: at max_steps only."""
    keep_best: bool = own_key(False)
    """Whether the trained policy is the one that did best when it was judged, not the last: at each summary in the last
    lesson, where a success_target is set once that comes near, or, where a dataset is learnt from without one, in its
    evaluations. Success counts, or the mean return of a task that says of none."""

    @field_validator("self_play", mode="before")
    @classmethod
    def _no_opponents(cls, raw: Any) -> None:
        if raw is not None:
            raise ValueError("self-play is not supported: each environment has one agent")

    @field_validator("hyperparameters", mode="before")
    @classmethod
    def _of_the_trainer(cls, raw: Any, info: ValidationInfo) -> Any:
        kind = HYPERPARAMETERS.get(info.data.get("trainer_type", ""))
        if kind is None:  # an unknown trainer is refused under its own key
            return PpoHyperparameters()
        if isinstance(raw, GradientHyperparameters) and not isinstance(raw, kind):
            raise ValueError(f"are those of another trainer than {info.data['trainer_type']}")
        return kind.model_validate(raw)

    @model_validator(mode="after")
    def _best_is_reported(self) -> Self:
        is_offline = isinstance(self.hyperparameters, OfflineHyperparameters)
        if not self.keep_best or self.success_target is not None or not is_offline:
            return self
        if self.offline is not None and not self.offline.evaluation_episodes:
            raise ValueError(
                "keep_best: takes evaluations or a success_target, and evaluation_episodes of offline are 0"
            )
        return self

    @model_validator(mode="after")
    def _data_are_named(self) -> Self:
        if isinstance(self.hyperparameters, OfflineHyperparameters) and self.offline is None:
            raise ValueError(f"offline: is missing: trainer_type {self.trainer_type} learns from a dataset")
        if isinstance(self.hyperparameters, SacHyperparameters):
            if self.offline is None and (self.hyperparameters.prefill or self.hyperparameters.hold):
                raise ValueError("offline: is missing: hyperparameters prefill and hold take its dataset")
        elif self.offline is not None and not isinstance(self.hyperparameters, OfflineHyperparameters):
            raise ValueError(f"offline: has no effect with trainer_type {self.trainer_type}")
        return self

    @model_validator(mode="after")
    def _only_cloned(self) -> Self:
        network, kind = self.network_settings, self.trainer_type
        if network.mixture > 1 and kind != "bc":
            raise ValueError(f"network_settings: mixture: is for trainer_type bc, not for {kind}")
        has_transformer = network.memory is not None and network.memory.memory_type == "transformer"
        if has_transformer and kind not in ("bc", "dagger"):
            what = "memory.memory_type transformer"
            raise ValueError(f"network_settings: {what}: is for trainer_type bc or dagger, not for {kind}")
        return self

    @model_validator(mode="after")
    def _sequences_fit(self) -> Self:
        memory = self.network_settings.memory
        batch = self.hyperparameters.batch_size
        if memory and memory.sequence_length > batch:
            raise ValueError(f"memory: sequence_length {memory.sequence_length} is larger than batch_size {batch}")
        return self

    @property
    def checkpoint_steps(self) -> int:
        """Steps between checkpoints."""
        return max(1, self.max_steps // self.keep_checkpoints) if self.even_checkpoints else self.checkpoint_interval
