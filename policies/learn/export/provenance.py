"""What a policy was made by and of, for its card: the code that trained it, its teacher, and its datasets.

In: the configuration of a run. Out: plain values. A policy is known by the hash of its weights, wherever its file is
moved and whatever its card comes to say; a dataset, which may be large, by what its metadata says.
"""

import hashlib
import json
import subprocess
from collections.abc import Iterator
from dataclasses import asdict
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from policies.datasets.writer import METADATA_FILE, PILOT_KEY, REWARDS_KEY, SEED_KEY
from policies.learn.config.behavior import Behavior, DaggerHyperparameters
from policies.learn.config.signals import GailSettings
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.learn.networks.policy import Policy
from policies.learn.rollout.demonstrations import data_folders

ROOT = Path(__file__).parents[3]  # of the repository, if it lies in one
UNKNOWN = "unknown"
CHANGED = "with changes"
_GIT_S = 10.0  # after which git is not waited for
_OF_DATASET = {
    "episodes": "total_episodes",
    "steps": "total_steps",
    "pilot": PILOT_KEY,
    "seed": SEED_KEY,
    "rewards_by": REWARDS_KEY,
}


@cache
def code_record() -> dict[str, str]:
    """The version of the package, and the commit of the repository that it lies in."""
    try:
        number = version("honeyguide")
    except PackageNotFoundError:
        number = UNKNOWN
    return {"version": number, "commit": commit_of(ROOT)}


def commit_of(root: Path) -> str:
    """The commit that a folder is at, and whether its files differ from it; "unknown": it is no repository's root."""
    top, commit = _git(root, "rev-parse", "--show-toplevel"), _git(root, "rev-parse", "HEAD")
    if not top or not commit or Path(top).resolve() != root.resolve():
        return UNKNOWN
    is_changed = _git(root, "status", "--porcelain", "--untracked-files=no") != ""
    return f"{commit} {CHANGED}" if is_changed else commit


def short_commit(commit: str) -> str:
    """A commit as a page names it, with whether files differed from it."""
    number, _, changed = commit.partition(" ")
    return f"{number[:8]} {changed}".rstrip() or "not kept"


def _git(root: Path, *words: str) -> str | None:
    """What git says; None: it says nothing, or is not there."""
    command = ["git", "-C", str(root), *words]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_GIT_S, check=True)  # noqa: S603
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()


def teacher_record(behavior: Behavior) -> dict[str, Any]:
    """The policy whose actions are learnt: its name, its weights' hash and its card; empty: there is none.

    Raises:
        CheckpointError: it cannot be read.
    """
    if not isinstance(behavior.hyperparameters, DaggerHyperparameters):
        return {}
    name = behavior.hyperparameters.teacher
    policy, card = load_policy(find_policy(name))
    return {"policy": name, "weights_sha256": weights_sha256(policy), "card": asdict(card)}


def weights_sha256(policy: Policy) -> str:
    """The hash of the names, shapes and bytes of a policy's weights, in order of names."""
    digest = hashlib.sha256()
    for name, weights in sorted(policy.state_dict().items()):
        digest.update(f"{name} {tuple(weights.shape)} ".encode() + weights.cpu().numpy().tobytes())
    return digest.hexdigest()


def data_records(behavior: Behavior) -> list[dict[str, Any]]:
    """The datasets that are learnt from: where each lies, what for, and what its metadata says.

    Raises:
        DemonstrationError: nothing is there.
    """
    return [
        {"path": str(folder), "use": use, **_of_dataset(folder)}
        for use, path in _uses(behavior)
        for folder in data_folders(path)
    ]


def _uses(behavior: Behavior) -> Iterator[tuple[str, str]]:
    """What datasets are for, and their paths, as configured."""
    for path in behavior.offline.dataset if behavior.offline is not None else ():
        yield "offline", path
    if behavior.behavioral_cloning is not None:
        yield "behavioral_cloning", behavior.behavioral_cloning.demo_path
    for name, signal in behavior.reward_signals.in_use.items():
        if isinstance(signal, GailSettings):
            yield name, signal.demo_path


def _of_dataset(folder: Path) -> dict[str, Any]:
    """What the metadata says of who flew, and how much; whoever reads its rows finds what is wrong with it."""
    try:
        record = json.loads((folder / METADATA_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return {name: record[key] for name, key in _OF_DATASET.items() if isinstance(record.get(key), int | str)}
