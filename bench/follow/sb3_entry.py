"""An entry of the leaderboard by somebody else's learner: PPO of Stable-Baselines3 on FollowMe, end to end from images.

`python -m bench.follow.sb3_entry --steps 131072` trains and writes results/sb3-follow.zip; the class below flies it:
`honeyguide benchmark follow --policy bench.follow.sb3_entry:Sb3Follower`. Needs the extra `bench`.
"""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
import typer
from numpy.typing import NDArray
from stable_baselines3 import PPO

from bench.learning.sb3 import BatchVecEnv
from policies.tasks.follow_me.observe import EGO, IMAGE_SHAPE

SAVED = Path("results/sb3-follow.zip")
ENVS, ROLLOUT, BATCH, EPOCHS = 64, 128, 512, 2


class Sb3Follower:
    """What the benchmark asks for: a vector and an image in, four numbers in [-1, 1] out, ten times a second."""

    kind = int(EGO)  # of the vector: with what the phone says
    image_shape = IMAGE_SHAPE

    def __init__(self) -> None:
        torch.set_num_threads(1)
        self._model = PPO.load(SAVED, device="cpu")

    def reset(self) -> None:
        """It remembers nothing."""

    def act(self, vector: NDArray[np.float32], image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """The most probable action."""
        action: Any = self._model.predict({"vector": vector, "image": image}, deterministic=True)[0]
        bounded: NDArray[np.float32] = np.clip(action, -1.0, 1.0)
        return bounded


def main(
    steps: Annotated[int, typer.Option(min=1, help="Decisions of all environments together.")] = 131_072,
    seed: Annotated[int, typer.Option(min=0, help="Of networks and worlds.")] = 1,
) -> None:
    envs = BatchVecEnv("FollowMe", ENVS, seed, terrain="kept", has_estimator=False)
    model = PPO(
        "MultiInputPolicy", envs, n_steps=ROLLOUT, batch_size=BATCH, n_epochs=EPOCHS, seed=seed, device="cpu",
        verbose=1, policy_kwargs={"log_std_init": -0.5},
    )  # fmt: skip
    SAVED.parent.mkdir(parents=True, exist_ok=True)
    model.learn(steps)
    model.save(SAVED)


if __name__ == "__main__":
    typer.run(main)
