"""A model of dynamics as a file: the layout, the networks, where episodes began, and how far members may disagree."""

from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from common.files import part_path
from policies.offline.dynamics.ensemble import DynamicsEnsemble, ensemble_for
from policies.offline.store import OfflineStore, open_store
from policies.tasks.layout import Layout

_FORMAT = "honeyguide dynamics model 1"
_ALLOWED = 0.99  # quantile of the recorded decisions' disagreement, times _SLACK: more ends an episode
_SLACK = 3.0  # guess
_MOST_ROWS = 8192


class ModelError(ValueError):
    """A dataset no model is made of, or a file that is none; the message is one sentence for the user."""


@dataclass(frozen=True, slots=True, eq=False)
class DynamicsModel:
    """What a task is made of."""

    layout: Layout
    networks: DynamicsEnsemble
    starts: Tensor  # (episodes, elements) first observations of the recorded episodes
    limit: float  # of the members' disagreement
    longest: int  # decisions of the longest recorded episode
    reward_bounds: tuple[float, float]  # of a decision, as recorded


def fit_model(store: OfflineStore, *, steps: int, seed: int = 0, hidden: int = 128) -> DynamicsModel:
    """Learns a model of a store.

    Raises:
        ModelError: a store of choices or images.
    """
    layout = store.layout
    if not layout.continuous or layout.branches or layout.image is not None:
        raise ModelError(f"{layout.task}: a model is made of continuous actions without images only")
    networks = ensemble_for(store, seed=seed, hidden=hidden)
    networks.fit(store, steps)
    rows = store.decisions[:: max(1, len(store) // _MOST_ROWS)]
    with torch.no_grad():
        found = networks.disagreement(networks.predict(store.observations[rows], store.continuous[rows]))
    rewards = store.rewards[store.decisions]
    bounds = float(rewards.min()), float(rewards.max())
    limit = _SLACK * float(found.quantile(_ALLOWED))
    starts = store.observations[store.starts].clone()
    return DynamicsModel(layout, networks, starts, limit, int(store.lengths.max()), bounds)


def save_model(model: DynamicsModel, path: Path) -> None:
    """Writes a model whole.

    Raises:
        ModelError: the file cannot be written.
    """
    content = {
        "format": _FORMAT,
        "layout": model.layout.record(),
        "hidden": model.networks.hidden,
        "weights": model.networks.networks.state_dict(),
        "scales": model.networks.scales,
        "starts": model.starts,
        "limit": model.limit,
        "longest": model.longest,
        "reward_bounds": model.reward_bounds,
    }
    part = part_path(path)
    try:
        torch.save(content, part)
        part.replace(path)
    except (OSError, RuntimeError) as error:
        part.unlink(missing_ok=True)
        raise ModelError(f"{path}: cannot be written: {' '.join(str(error).split())}") from None


def load_model(path: Path) -> DynamicsModel:
    """Reads what `save_model` wrote.

    Raises:
        ModelError: no such file, or no model.
    """
    try:
        content = torch.load(path, weights_only=True)
        if content["format"] != _FORMAT:
            raise ModelError(f"{path}: is no model of this version")
        layout = Layout.from_record(content["layout"])
        networks = DynamicsEnsemble(layout, content["hidden"], content["scales"], torch.Generator())
        networks.networks.load_state_dict(content["weights"])
    except FileNotFoundError:
        raise ModelError(f"{path}: no such file") from None
    except ModelError:
        raise
    except Exception as error:  # torch and pickle raise anything of a file that is none
        raise ModelError(f"{path}: is no model: {type(error).__name__}") from None
    bounds = content["reward_bounds"]
    return DynamicsModel(
        layout, networks, content["starts"], content["limit"], content["longest"], (bounds[0], bounds[1])
    )


def fit_and_save(datasets: list[str], path: Path, *, steps: int, seed: int, hidden: int) -> DynamicsModel:
    """A model of datasets, as a file.

    Raises:
        DemonstrationError: datasets that cannot be read.
        ModelError: as `fit_model` and `save_model`.
    """
    model = fit_model(open_store(datasets), steps=steps, seed=seed, hidden=hidden)
    save_model(model, path)
    return model
