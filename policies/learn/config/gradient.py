"""What every algorithm has that goes down a slope by minibatches."""

from policies.learn.config.config_block import Block, Count, Positive, PositiveOrNone, Schedule, own_key


class GradientHyperparameters(Block):
    """What all algorithms have."""

    batch_size: Count = 256
    """Steps per gradient step."""
    learning_rate: Positive = 3e-4
    """Of Adam, at the start."""
    learning_rate_schedule: Schedule = "constant"
    """`linear`: falls to 0 at max_steps."""
    max_grad_norm: PositiveOrNone = own_key(None)
    """Gradients are scaled down to this norm; none: not at all."""
