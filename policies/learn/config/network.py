"""Networks: `network_settings` of a behaviour and of each reward signal."""

from typing import Literal, Self

from pydantic import field_validator, model_validator

from policies.learn.config.config_block import Block, Count, NotNegativeWhole, own_key

Encoder = Literal["simple", "nature_cnn", "resnet", "match3", "fully_connected", "compact"]


class Memory(Block):
    """A policy that remembers: one LSTM layer behind the body, or a transformer over its last features."""

    sequence_length: Count = 64
    """Decisions per sequence that gradients flow through; at most the batch size. A transformer looks so far back."""
    memory_size: Count = 128
    """Floats of state: half of them hidden, half of them cell."""

    memory_type: Literal["lstm", "transformer"] = own_key("lstm")
    """What remembers; `transformer`, for `bc` and `dagger`, remembers its inputs, and `memory_size` does not count."""
    layers: Count = own_key(2)
    """Of a transformer."""
    heads: Count = own_key(4)
    """Of attention, in each layer of a transformer."""

    @field_validator("memory_size")
    @classmethod
    def _halves(cls, size: int) -> int:
        if size % 2:
            raise ValueError("must be even: half of it is the hidden state, half the cell")
        return size


class NetworkSettings(Block):
    """Body of the actor, of the critic, or of a reward signal's network."""

    hidden_units: Count = 128
    """Width of each dense layer."""
    num_layers: NotNegativeWhole = 2
    """Dense layers."""
    normalize: bool = False
    """Whether vector observations are normalised by their running mean and variance."""
    vis_encode_type: Encoder = "simple"
    """Encoder of images, if the task shows any; `compact` is our own: half the work of `simple`."""
    goal_conditioning_type: Literal["hyper", "none"] = "hyper"
    """Whether goal elements of the observation drive a hyper-network; no effect without a goal signal."""
    goal_signal: bool = own_key(False)
    """Whether the task's goal elements are a goal signal, which ML-Agents declares at the sensor."""
    deterministic: bool = False
    """Whether `--inference` takes the most probable actions instead of drawing them; training draws."""
    memory: Memory | None = None
    """LSTM or transformer; none: feed-forward."""
    mixture: Count = own_key(1)
    """Gaussians that continuous actions are a mixture of, for `trainer_type: bc`; the likeliest one acts."""
    perceives: tuple[str, ...] = own_key(())
    """Privileged elements of the task that the policy also says its belief of; learnt beside a teacher."""

    @model_validator(mode="after")
    def _heads_split_the_width(self) -> Self:
        memory = self.memory
        if memory is not None and memory.memory_type == "transformer":
            if self.hidden_units % memory.heads:
                raise ValueError(
                    f"hidden_units: {self.hidden_units} must be a multiple of memory.heads, which is {memory.heads}"
                )
            if memory.sequence_length < 2:
                raise ValueError("memory: sequence_length: a transformer looks at 2 decisions at least")
        return self
