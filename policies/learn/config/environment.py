"""The environment: `environment_parameters` (numbers, samplers, curricula), `env_settings`, `engine_settings`."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, model_validator

from policies.learn.config.config_block import Block, Count, NotNegative, NotNegativeWhole, Positive, Real, Whole
from policies.tasks.task_params import Sampler


class UniformParameters(Block):
    min_value: Real = 0.0
    max_value: Real = 1.0
    seed: Whole = -1
    """-1: as the run."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.min_value > self.max_value:
            raise ValueError(f"min_value {self.min_value:g} is above max_value {self.max_value:g}")
        return self


class GaussianParameters(Block):
    mean: Real = 1.0
    st_dev: NotNegative = 1.0
    seed: Whole = -1
    """-1: as the run."""


class MultiRangeUniformParameters(Block):
    intervals: tuple[tuple[Real, Real], ...] = ((0.0, 1.0),)
    """Pairs of minimum and maximum."""
    seed: Whole = -1
    """-1: as the run."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.intervals:
            raise ValueError("has no intervals")
        for low, high in self.intervals:
            if low > high:
                raise ValueError(f"interval [{low:g}, {high:g}] ends before it begins")
        return self


class ConstantParameters(Block):
    value: Real = 0.0
    seed: Whole = -1
    """Without effect."""


class UniformSampler(Block):
    """Drawn between two bounds."""

    sampler_type: Literal["uniform"]
    sampler_parameters: UniformParameters

    @property
    def sampler(self) -> Sampler:
        """What the task draws from."""
        drawn = self.sampler_parameters
        return Sampler(intervals=((drawn.min_value, drawn.max_value),), seed=max(0, drawn.seed))


class GaussianSampler(Block):
    """Drawn from a normal distribution."""

    sampler_type: Literal["gaussian"]
    sampler_parameters: GaussianParameters

    @property
    def sampler(self) -> Sampler:
        """What the task draws from."""
        drawn = self.sampler_parameters
        return Sampler(mean=drawn.mean, st_dev=drawn.st_dev, seed=max(0, drawn.seed))


class MultiRangeUniformSampler(Block):
    """Drawn from several intervals, each as probable as it is long."""

    sampler_type: Literal["multirangeuniform"]
    sampler_parameters: MultiRangeUniformParameters

    @property
    def sampler(self) -> Sampler:
        """What the task draws from."""
        drawn = self.sampler_parameters
        return Sampler(intervals=drawn.intervals, seed=max(0, drawn.seed))


class ConstantSampler(Block):
    """Always the same."""

    sampler_type: Literal["constant"]
    sampler_parameters: ConstantParameters

    @property
    def sampler(self) -> Sampler:
        """What the task draws from."""
        return Sampler.constant(self.sampler_parameters.value)


_Samplers = UniformSampler | GaussianSampler | MultiRangeUniformSampler | ConstantSampler
_SAMPLERS: Mapping[str, type[_Samplers]] = {
    "uniform": UniformSampler,
    "gaussian": GaussianSampler,
    "multirangeuniform": MultiRangeUniformSampler,
    "constant": ConstantSampler,
}


def _sampler(raw: Any) -> Any:
    """The sampler of a mapping, chosen here so that errors name the key and not every kind it might have been."""
    if not isinstance(raw, Mapping):
        return raw
    if "sampler_type" not in raw:
        raise ValueError("has no sampler_type")
    kind = _SAMPLERS.get(str(raw["sampler_type"]))
    if kind is None:
        raise ValueError(f"sampler_type {raw['sampler_type']!r} is not one of {', '.join(_SAMPLERS)}")
    return kind.model_validate(raw)


def _value(raw: Any) -> Any:
    made = _sampler(raw)
    if isinstance(made, _Samplers):
        return made
    try:
        return float("bool" if isinstance(raw, bool) else raw)
    except (TypeError, ValueError):
        raise ValueError("must be a number or a sampler") from None


Value = Annotated[Real | _Samplers, BeforeValidator(_value)]


class CompletionCriteria(Block):
    """When a lesson is over."""

    behavior: str
    """The behaviour that is measured."""
    measure: Literal["reward", "progress", "success"] = "reward"
    """Mean episode reward, steps / max_steps, or (ours) the fraction of episodes that succeeded."""
    threshold: Real = 0.0
    """The lesson is over when the measure is above this."""
    min_lesson_length: NotNegativeWhole = 0
    """Episodes that must have ended first."""
    signal_smoothing: bool = True
    """Whether the reward (or success) is 0.75 of the new mean and 0.25 of the one before."""
    require_reset: bool = False
    """Whether the environments start anew with the next lesson."""

    @model_validator(mode="after")
    def _fractions_lie_between_0_and_1(self) -> Self:
        if self.measure != "reward" and not 0.0 <= self.threshold <= 1.0:
            raise ValueError(f"threshold {self.threshold:g} of {self.measure} is not between 0 and 1")
        return self


class Lesson(Block):
    """One stage of a curriculum."""

    name: str
    """Shown in summaries."""
    value: Value
    """The number, or what it is drawn from, in this lesson."""
    completion_criteria: CompletionCriteria | None = None
    """When the next lesson begins; the last lesson has none."""

    @property
    def sampler(self) -> Sampler:
        """What the task draws the number from in this lesson."""
        return Sampler.constant(self.value) if isinstance(self.value, float) else self.value.sampler


class Curriculum(Block):
    """Lessons of one parameter, in order."""

    curriculum: tuple[Lesson, ...]
    """The lessons."""

    @model_validator(mode="after")
    def _lessons_lead_on(self) -> Self:
        if not self.curriculum:
            raise ValueError("has no lessons")
        for lesson in self.curriculum[:-1]:
            if lesson.completion_criteria is None:
                raise ValueError(f"lesson {lesson.name} has no completion_criteria and is not the last")
        return self


def _parameter(raw: Any) -> Any:
    if isinstance(raw, Curriculum):
        return raw
    if isinstance(raw, Mapping) and "curriculum" in raw:
        return Curriculum.model_validate(raw)
    return _value(raw)


EnvironmentParameter = Annotated[Real | _Samplers | Curriculum, BeforeValidator(_parameter)]


def lessons_of(name: str, parameter: EnvironmentParameter) -> tuple[Lesson, ...]:
    """The lessons of a parameter; a number or a sampler is a single lesson that never ends."""
    return parameter.curriculum if isinstance(parameter, Curriculum) else (Lesson(name=name, value=parameter),)


class EnvSettings(Block):
    """Which task, and how many environments."""

    env_path: str | None = None
    """The task by name."""
    env_args: Annotated[tuple[str, ...], BeforeValidator(lambda raw: () if raw is None else raw)] = ()
    """Settings of the task, each `name=value`."""
    base_port: Whole = 5005
    """Accepted; the task runs in this process."""
    num_envs: Count = 1
    """Copies of the num_areas environments."""
    num_areas: Count = 1
    """Environments side by side in one batch."""
    timeout_wait: NotNegativeWhole = 60
    """Accepted; there is nobody to wait for."""
    seed: Whole = -1
    """Of every random draw; -1: chosen by the run and noted in its configuration."""
    max_lifetime_restarts: Whole = 10
    """Accepted; nothing is restarted."""
    restarts_rate_limit_n: Whole = 1
    """Accepted; nothing is restarted."""
    restarts_rate_limit_period_s: NotNegativeWhole = 60
    """Accepted; nothing is restarted."""

    @property
    def env_count(self) -> int:
        """Environments in the batch."""
        return self.num_envs * self.num_areas


class EngineSettings(Block):
    """Accepted for compatibility: simulated time runs as fast as it can, and nothing is drawn."""

    width: Count = 84
    """Of the window [pixels]."""
    height: Count = 84
    """Of the window [pixels]."""
    quality_level: NotNegativeWhole = 5
    """Of the graphics."""
    time_scale: Positive = 20.0
    """Of simulated time."""
    target_frame_rate: Whole = -1
    """Of the graphics; -1: none."""
    capture_frame_rate: NotNegativeWhole = 60
    """Of the graphics."""
    no_graphics: bool = False
    """Nothing is ever drawn while training."""
    no_graphics_monitor: bool = False
    """Nothing is ever drawn while training."""
