"""`python theirs.py JOB.json`: trains with d3rlpy what the job says. It runs in d3rlpy's environment, without ours.

In: a D4RL file of `honeyguide dataset export`, how observations are normalised, sizes. Out: an .npz of the policy's
weights, layer by layer, and the processor's time for the gradient steps alone. Of minibatches in place of a dataset it
makes one step each, and tells all weights before and after.
"""

import json
import sys
import time
from pathlib import Path
from typing import Any

import d3rlpy
import h5py
import numpy as np
import torch

SHOWN = 64  # observations of the first episode, at most, whose actions are told, so that both can be compared


def main(job: dict[str, Any]) -> None:
    """Trains, and writes job["out"]."""
    torch.set_num_threads(1)
    d3rlpy.seed(job["seed"])
    algorithm = _algorithm(job)
    if "batches" in job:
        np.savez(job["out"], **_stepped(algorithm, job))
        return
    dataset = _dataset(job)
    algorithm.build_with_dataset(dataset)
    start_s = time.process_time()
    algorithm.fit(
        dataset,
        n_steps=job["steps"],
        n_steps_per_epoch=job["steps"],
        logger_adapter=d3rlpy.logging.NoopAdapterFactory(),
        show_progress=False,
    )
    spent_s = time.process_time() - start_s
    named = algorithm.impl.policy.state_dict()
    layers = [array.detach().numpy() for name, array in named.items() if "logstd" not in name]
    found = {f"w{k:02d}": array for k, array in enumerate(layers)}
    found |= {"actions": algorithm.predict(dataset.episodes[0].observations[:SHOWN])}
    np.savez(job["out"], spent_s=spent_s, decisions=dataset.transition_count, version=d3rlpy.__version__, **found)


def _stepped(algorithm: Any, job: dict[str, Any]) -> dict[str, Any]:
    """All weights before and after."""
    with np.load(job["batches"]) as file:
        arrays = {name: torch.from_numpy(file[name]) for name in file.files}
    algorithm.create_impl(tuple(arrays["observations"].shape[1:]), arrays["actions"].shape[1])
    size = job["batch"]
    found = _weights(algorithm.impl, "start")
    for k in range(len(arrays["actions"]) // size):
        rows = {name: array[k * size : (k + 1) * size] for name, array in arrays.items()}
        others = {
            "next_actions": rows["actions"],
            "returns_to_go": torch.zeros(size, 1),
            "intervals": torch.ones(size, 1),
        }
        algorithm.impl.update(d3rlpy.torch_utility.TorchMiniBatch(**rows, **others, device="cpu:0"), k)
    return found | _weights(algorithm.impl, "end")


def _weights(impl: Any, when: str) -> dict[str, Any]:
    """Of each network, layer by layer, without the deviation of actions."""
    networks = {"policy": impl.policy, "critics": impl.modules.q_funcs}
    if hasattr(impl.modules, "value_func"):
        networks["value"] = impl.modules.value_func
    found: dict[str, Any] = {}
    for network, module in networks.items():
        layers = [array for name, array in module.state_dict().items() if "logstd" not in name]
        found |= {f"{when} {network} {k:02d}": array.detach().numpy().copy() for k, array in enumerate(layers)}
    return found


def _algorithm(job: dict[str, Any]) -> Any:
    """With d3rlpy's numbers, which are also ours, but for what is given here."""
    encoder = d3rlpy.models.VectorEncoderFactory(hidden_units=[job["hidden"]] * 2, activation="swish")
    parts = {"actor_encoder_factory": encoder, "critic_encoder_factory": encoder}
    sizes = {"batch_size": job["batch"], "gamma": job["gamma"]}
    if job["trainer"] == "iql":
        config = d3rlpy.algos.IQLConfig(**parts, **sizes, value_encoder_factory=encoder)
    else:
        noise = {"target_smoothing_sigma": 0.0} if "batches" in job else {}
        config = d3rlpy.algos.TD3PlusBCConfig(**parts, **sizes, **noise)
    return config.create(device="cpu:0")


def _dataset(job: dict[str, Any]) -> Any:
    with h5py.File(job["dataset"]) as file:
        rows = {name: file[name][()] for name in ("observations", "actions", "rewards", "terminals", "timeouts")}
    mean, deviation = np.array(job["mean"]), np.array(job["deviation"])
    seen = np.clip((rows["observations"] - mean) / deviation, -job["limit"], job["limit"])
    return d3rlpy.dataset.MDPDataset(
        seen.astype(np.float32),
        rows["actions"].astype(np.float32),
        rows["rewards"].astype(np.float32),
        rows["terminals"].astype(np.float32),
        rows["timeouts"].astype(np.float32),
        action_space=d3rlpy.ActionSpace.CONTINUOUS,
    )


if __name__ == "__main__":
    main(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
