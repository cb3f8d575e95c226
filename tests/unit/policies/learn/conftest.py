import pytest
import torch

from policies.experts.catalogue import build_expert
from policies.experts.demonstration_file import Origin, write_demonstrations
from policies.experts.episode_recording import record_episodes
from policies.tasks.catalogue import build_task, task_settings


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    """Threads only get in each other's way in networks as small as these."""
    torch.set_num_threads(1)


@pytest.fixture(scope="session")
def demonstrations(tmp_path_factory):
    """A folder in which an expert of RollerBall was recorded."""
    folder = tmp_path_factory.mktemp("roller_ball") / "expert"
    task = build_task("RollerBall", 64)
    episodes = record_episodes(task, build_expert("RollerBall"), 64, seed=1)
    write_demonstrations(folder, Origin(task.layout, task_settings("RollerBall", {}), "scripted", 1), episodes)
    return str(folder)
