"""Policy files: weights, the layout they were made for, the network's settings, and a card saying where they come from.

In: a trained policy. Out: one small file that `honeyguide eval`, `export` and `play` take, and that is refused for any
other task.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import torch
from pydantic import ValidationError

from policies.learn.checkpoint import load, save
from policies.learn.config.network import NetworkSettings
from policies.learn.export.policy_path import CheckpointError
from policies.learn.networks.policy import Policy
from policies.tasks.catalogue import runs_code
from policies.tasks.layout import Layout
from policies.tasks.task_params import Sampler

POLICY = "policy"  # kinds of files
CHECKPOINT = "checkpoint"


@dataclass(frozen=True, slots=True)
class PolicyCard:
    """Where a policy comes from, and how good it was found to be."""

    task: str
    settings: dict[str, Any]  # of the task, all of them
    seed: int
    steps: int
    figures: dict[str, float] = field(default_factory=dict)
    """`training_…`: of the last episodes of the training; the others: of episodes that it was judged by. Bounds are of
    95 %."""
    numbers: dict[str, dict[str, Any]] = field(default_factory=dict)  # of the task, in the last lesson
    parents: list[dict[str, Any]] = field(default_factory=list)
    """The cards of the legs before, the first one first: each began with the networks of the one before."""
    code: dict[str, str] = field(default_factory=dict)
    """Version and commit of the code that trained it; empty: of before this was kept, as of the next two."""
    teacher: dict[str, Any] = field(default_factory=dict)
    """The policy whose actions it learnt: name, its weights' hash and card; empty: it had none."""
    data: list[dict[str, Any]] = field(default_factory=list)
    """The datasets that it learnt from: where each lay, what for, and of whom; empty: from none."""

    def as_parent(self) -> list[dict[str, Any]]:
        """The parents of who begins with these networks."""
        own = asdict(self)
        return [*own.pop("parents"), own]

    def trusted_task(self, path: Path, how: str) -> str:
        """The task, unless building it would run code that nobody but the file has named; `how` says how to name it.

        Raises:
            CheckpointError: it would.
        """
        if runs_code(self.task):
            raise CheckpointError(
                f"{path}: is of {self.task}, whose code is not run because a file names it: name it yourself, as {how}"
            )
        return self.task

    def samplers(self) -> dict[str, Sampler]:
        """What the task's numbers are drawn from, where they are not the settings' own."""
        return {name: Sampler(**record) for name, record in self.numbers.items()}


def save_policy(path: Path, policy: Policy, card: PolicyCard, *, is_half: bool = False) -> None:
    """Writes a policy file.

    Args:
        path: of the file.
        policy: to be saved.
        card: where it comes from.
        is_half: whether weights are rounded to 16 bits: half the size, for policies that see images and ship.

    Raises:
        CheckpointError: it cannot be written.
    """
    record = policy_record(policy)
    if is_half:
        record["weights"] = {
            name: tensor.half() if tensor.dtype is torch.float32 else tensor  # a normaliser's sums stay whole
            for name, tensor in record["weights"].items()
        }
    save(path, {"policy": record, "card": asdict(card)}, POLICY)


def load_policy(path: Path) -> tuple[Policy, PolicyCard]:
    """Reads a policy file, or the policy of a checkpoint.

    Raises:
        CheckpointError: no such file, damaged, or neither of them.
    """
    content = load(path, POLICY, CHECKPOINT)
    try:
        record, card = content["policy"], PolicyCard(**content["card"])
    except (KeyError, TypeError) as error:
        raise CheckpointError(f"{path}: written by another version of honeyguide: {error}") from error
    return policy_of(record, str(path)), card


def policy_record(policy: Policy) -> dict[str, Any]:
    """A policy as plain values and tensors."""
    return {
        "layout": policy.layout.record(),
        "network": policy.settings.model_dump(),
        "is_squashed": policy.is_squashed,
        "weights": policy.state_dict(),
    }


def policy_of(record: Mapping[str, Any], source: str) -> Policy:
    """What `policy_record` returned; `source` is named if it does not fit together.

    Raises:
        CheckpointError: written by another version of this program.
    """
    try:
        settings = NetworkSettings.model_validate(record["network"])
        layout = Layout.from_record(record["layout"])
        policy = Policy(layout, settings, torch.Generator().manual_seed(0), is_squashed=record["is_squashed"])
        policy.load_state_dict(record["weights"])
    except (ValidationError, AttributeError, KeyError, TypeError, ValueError, RuntimeError) as error:
        reason = str(error).strip().splitlines()[-1].strip()
        raise CheckpointError(f"{source}: written by another version of honeyguide: {reason}") from error
    return policy.eval()
