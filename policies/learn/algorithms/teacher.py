"""A teacher: a trained policy that sees the truth and says what it would do in any state that a student gets into.

Its observation is the privileged part of the student's task, element by element. In: privileged rows. Out: actions.
"""

from collections.abc import Sequence

import torch
from torch import Tensor

from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.learn.networks.action_distributions import Actions
from policies.learn.networks.policy import Policy
from policies.tasks.layout import Element, Layout, LayoutError


class Teacher:
    """A policy that is not trained any more."""

    def __init__(self, policy: Policy, layout: Layout, source: str) -> None:
        """A teacher for a task.

        Args:
            policy: what it does.
            layout: of the student's task.
            source: where the policy comes from, for messages.

        Raises:
            LayoutError: it sees something else than the task's privileged elements, or acts otherwise.
        """
        _require(policy, layout, source)
        self.policy = policy.eval().requires_grad_(False)

    @torch.inference_mode()
    def actions(self, privileged: Tensor) -> Actions:
        """The most probable ones, continuous ones in [-1, 1].

        Args:
            privileged: shape (rows, elements).
        """
        actions, _ = self.policy.act(privileged, self.policy.start_memory(len(privileged)))
        return Actions(self.policy.bounded(actions), actions.branches)


def load_teacher(name: str, layout: Layout, device: torch.device | str = "cpu") -> Teacher:
    """The teacher that a user means: a policy file, a run, or a task that ships a policy.

    Raises:
        CheckpointError: there is none, or it cannot be read.
        LayoutError: it does not fit the task.
    """
    path = find_policy(name)
    policy, _ = load_policy(path)
    return Teacher(policy.to(device), layout, str(path))


def _require(policy: Policy, layout: Layout, source: str) -> None:
    there = policy.layout
    if not layout.privileged:
        raise LayoutError(f"{source}: cannot teach {layout.task} as it is set: it shows a teacher nothing")
    if there.image is not None or there.stack != 1 or policy.memory_size:
        raise LayoutError(f"{source}: a teacher sees the present state alone: no image, no stack, no memory")
    pairs = (("observation", there.frame, layout.privileged), ("action", there.continuous, layout.continuous))
    for what, elements, wanted in pairs:
        if difference := _difference(elements, wanted):
            raise LayoutError(f"{source}: cannot teach {layout.task} as it is set: {what} {difference}")
    if there.branches != layout.branches:
        raise LayoutError(f"{source}: cannot teach {layout.task} as it is set: it has other discrete actions")


def _difference(there: Sequence[Element], here: Sequence[Element]) -> str:
    """The first difference in names or scales; empty if there is none."""
    for k, (a, b) in enumerate(zip(there, here, strict=False)):
        if (a.name, a.scale) != (b.name, b.scale):
            return f"{k} is {a.name} (scale {a.scale:g}) there and {b.name} (scale {b.scale:g}) here"
    return f"count is {len(there)} there and {len(here)} here" if len(there) != len(here) else ""
