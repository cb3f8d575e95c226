"""Random transitions for the tests of reward signals."""

import torch

from policies.learn.signals.signal import Transitions
from policies.tasks.layout import Branch, Element, Layout

PUSHED = Layout(
    "Pushed", 1, (Element("pos_x", "m"), Element("pos_z", "m")), (Element("push_x", "1"), Element("push_z", "1"))
)
STEERED = Layout(
    "Steered",
    1,
    (Element("pos_x", "m"), Element("pos_z", "m")),
    branches=(Branch("steer", ("left", "right", "none")), Branch("drive", ("on", "off"))),
)


def drawn(layout, shape, seed=0, centre=0.0):
    generator = torch.Generator().manual_seed(seed)
    observation = torch.randn(*shape, layout.observation_size, generator=generator) + centre
    choices = [torch.randint(size, shape, generator=generator) for size in layout.branch_sizes]
    return Transitions(
        observations=observation,
        next_observations=observation + 0.1 * torch.randn(observation.shape, generator=generator),
        continuous=torch.rand(*shape, len(layout.continuous), generator=generator) * 2.0 - 1.0,
        branches=torch.stack(choices, -1) if choices else torch.zeros(*shape, 0, dtype=torch.int64),
        rewards=torch.rand(shape, generator=generator),
        is_ended=torch.rand(shape, generator=generator) < 0.1,
    )
