"""Rows of what failed in the documents, or never really ran: novelty, memory, SAC and others, each beside its like."""

from typing import Any

from bench.cars.experiment import NEW_SPOTS, PARKING2_SPOTS, Experiment, Judged

_SPARSE: dict[str, Any] = {
    "environment_parameters.progress_per_m": 0.0,
    "environment_parameters.time_reward": 0.0,
    "behavior.max_steps": 3_000_000,
    "behavior.success_target": None,
}
_CURIOSITY = {"strength": 0.01, "gamma": 0.99, "network_settings": {"hidden_units": 64}}
_RND = {"strength": 0.01, "gamma": 0.99, "network_settings": {"hidden_units": 64}}
_GAIL = {"strength": 0.01, "demo_path": "recorded", "reward_form": "logit", "batch_size": 512}


def _sparse(name: str, title: str, document: str, signals: dict[str, Any]) -> Experiment:
    """Parking 1 paid at the end only, with another signal beside."""
    changes = _SPARSE | {f"behavior.reward_signals.{signal}": block for signal, block in signals.items()}
    return Experiment(name, title, "parking1", judged=(NEW_SPOTS,), document=document, changes=changes)


SPARSE = (
    _sparse("parking1-sparse", "sparse reward, PPO alone", "", {}),
    _sparse("parking1-sparse-curiosity", "sparse, with curiosity (ICM)", "did not work", {"curiosity": _CURIOSITY}),
    _sparse("parking1-sparse-rnd", "sparse, with RND", "did not work", {"rnd": _RND}),
    _sparse("parking1-sparse-gail", "sparse, with GAIL", "", {"gail": _GAIL}),
)

_HILL: dict[str, Any] = {
    "env_settings.num_areas": 64,
    "behavior.hyperparameters.num_epoch": 5,
    "behavior.max_steps": 100_000,
}


def _hill(name: str, title: str, task: str, document: str, signals: dict[str, Any]) -> Experiment:
    """Gymnasium's MountainCar with another signal beside the reward of the task."""
    changes = _HILL | {"env_settings.env_path": f"bench.cars.sparse_tasks:{task}"}
    changes |= {f"behavior.reward_signals.{signal}": block for signal, block in signals.items()}
    return Experiment(name, title, "gym", judged=(Judged("new starts"),), document=document, changes=changes)


_TOP = "MountainCarAtTop"
HILL = (
    _hill("mountain-car-top", "MountainCar paid at the top, PPO alone", _TOP, "", {}),
    _hill(
        "mountain-car-top-curiosity",
        "the same, with curiosity (ICM)",
        _TOP,
        "",
        {"curiosity": _CURIOSITY | {"strength": 1.0, "network_settings": {"hidden_units": 64, "normalize": True}}},
    ),
    _hill("mountain-car-top-rnd", "the same, with RND", _TOP, "", {"rnd": _RND | {"strength": 1.0}}),
    _hill("mountain-car", "MountainCar as published: -1 a step, PPO alone", "MountainCar", "", {}),
)


def _observation(name: str, title: str, document: str, settings: dict[str, Any], changes: dict[str, Any]) -> Experiment:
    """Parking 1 as the document's car sees it: unit vectors, no range, no speed."""
    settings = {"observation": "as-documented", **settings}
    changes = {"behavior.max_steps": 3_000_000, "behavior.success_target": None, **changes}
    return Experiment(
        name, title, "parking1", settings=settings, changes=changes, judged=(NEW_SPOTS,), document=document
    )


MEMORY = (
    _observation("parking1-seen", "document's observation, feed-forward", "13 % (PPO), 92 % (GAIL)", {}, {}),
    _observation("parking1-seen-stack", "the same, last three stacked", "", {"stack": 3}, {}),
    _observation(
        "parking1-seen-lstm",
        "the same, LSTM",
        "good for one spot; no LSTM was built",
        {},
        {"behavior.network_settings.memory": {"memory_size": 64, "sequence_length": 16}},
    ),
)

OTHERS = (
    Experiment(
        "parking1-gamma",
        "ours with the document's gamma of 0.8",
        "parking1",
        judged=(NEW_SPOTS,),
        document="its setting",
        changes={"behavior.reward_signals.extrinsic.gamma": 0.8, "environment_parameters.discount": 0.8},
    ),
    Experiment(
        "parking2-stack",
        "Parking 2, last three stacked",
        "parking2",
        settings={"stack": 3},
        judged=PARKING2_SPOTS,
        document="stacks three; 32.8 / 47.2 / 22.8 %",
    ),
    Experiment(
        "parking2-seen-stack",
        "Parking 2, document's observation, last three stacked",
        "parking2",
        settings={"observation": "as-documented", "rays": 14, "stack": 3},
        judged=PARKING2_SPOTS,
        document="stacks three; 32.8 / 47.2 / 22.8 %",
    ),
    Experiment("parking1-sac", "SAC", "parking1-sac", judged=(NEW_SPOTS,), document="unstable, abandoned after 20 h"),
    Experiment(
        "roller-ball-hyper",
        "RollerBall, hyper-network on the target's place",
        "roller-ball",
        document="(follow-me document: inert)",
        changes={
            "behavior.network_settings.goal_signal": True,
            "behavior.max_steps": 300_000,
            "behavior.success_target": None,
        },
    ),
    Experiment(
        "roller-ball-plain",
        "RollerBall, the same without",
        "roller-ball",
        document="",
        changes={"behavior.max_steps": 300_000, "behavior.success_target": None},
    ),
)
