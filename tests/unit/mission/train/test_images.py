"""`honeyguide train`, `eval` and `export` of a task that shows images; the task is `squares.py`."""

import onnxruntime
import pytest
import torch

from policies.experts.episode_recording import RecordingError, record_episodes
from policies.experts.expert import RandomDriver
from policies.learn import checkpoint
from policies.learn.export.policy_driver import PolicyDriver
from policies.learn.export.policy_file import load_policy
from policies.tasks.catalogue import CATALOGUE, Entry
from tests.unit.mission.train.training_run import RUN, honeyguide, train, write_config
from tests.unit.policies.learn.squares import Squares

NETWORK = {"hidden_units": 8, "num_layers": 1, "vis_encode_type": "compact"}


@pytest.fixture(autouse=True)
def named(monkeypatch):
    """The task in the catalogue."""
    monkeypatch.setitem(CATALOGUE, "Squares", Entry(lambda _settings, count, _device: Squares(count)))


def configured(**behavior):
    write_config(
        env="Squares",
        **{
            "max_steps": 2000,
            "hyperparameters": {"batch_size": 256, "buffer_size": 512, "privileged_critic": True},
            "network_settings": NETWORK,
            **behavior,
        },
    )


@pytest.mark.parametrize("memory", [{}, {"memory": {"sequence_length": 2, "memory_size": 8}}], ids=["plain", "lstm"])
def test_a_run_is_trained_judged_and_exported(memory):
    configured(network_settings={**NETWORK, **memory})
    result = train()
    assert result.exit_code == 0, result.stderr
    judged = honeyguide("eval", "run", "--episodes", 20)
    assert judged.exit_code == 0, judged.stderr
    exported = honeyguide("export", "run", "policy.onnx")
    assert exported.exit_code == 0, exported.stderr
    names = [node.name for node in onnxruntime.InferenceSession("policy.onnx").get_inputs()]
    assert names[:2] == ["obs_0", "obs_1"]


def test_a_run_goes_on_from_its_checkpoint_bit_for_bit():
    configured(checkpoint_interval=1000)
    assert train().exit_code == 0
    whole, _ = load_policy(RUN / "Ball.pt")
    first, second = sorted((RUN / "Ball").glob("*.pt"), key=lambda path: int(path.stem.rpartition("-")[2]))
    assert "final_images" in checkpoint.load(first, "checkpoint")["learner"]["task"]
    second.unlink()
    (RUN / "Ball.pt").unlink()
    again = train("--resume")
    assert again.exit_code == 0, again.stderr
    resumed, _ = load_policy(RUN / "Ball.pt")
    for a, b in zip(whole.parameters(), resumed.parameters(), strict=True):
        assert torch.equal(a, b)


def test_a_policy_drives_by_what_it_sees():
    configured()
    assert train().exit_code == 0
    policy, _ = load_policy(RUN / "Ball.pt")
    task = Squares(4)
    task.reset(0)
    driver = PolicyDriver(policy)
    driver.act(task)
    first = task.buffers.continuous.numpy().copy()
    task.buffers.images.zero_()
    driver.act(task)
    assert (first != task.buffers.continuous.numpy()).all()


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"trainer_type": "sac", "hyperparameters": {}}, "trainer_type: sac sees no images, and Squares as it is set "),
        ({"reward_signals": {"extrinsic": {}, "rnd": {}}}, "reward_signals.rnd: sees no images, and Squares as it is "),
        ({"behavioral_cloning": {"demo_path": "demo"}}, "behavioral_cloning: sees no images, and Squares as it is set"),
        (
            {"network_settings": {"vis_encode_type": "nature_cnn"}},
            "vis_encode_type: nature_cnn needs images of 36 x 36 at least; those of Squares are 32 x 32",
        ),
    ],
)
def test_what_cannot_see_images_is_refused_with_its_place(change, sentence):
    configured(**change)
    result = train()
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith("honeyguide: config.yaml:")
    assert sentence in line
    assert not RUN.exists()


def test_a_privileged_critic_needs_privileged_elements():
    write_config(hyperparameters={"batch_size": 256, "buffer_size": 512, "privileged_critic": True})
    result = train()
    assert result.exit_code == 2
    assert "hyperparameters.privileged_critic: RollerBall as it is set has no privileged elements" in result.stderr


def test_a_privileged_critic_is_not_shared():
    configured(hyperparameters={"privileged_critic": True, "shared_critic": True})
    result = train()
    assert result.exit_code == 2
    assert "privileged_critic: cannot be with shared_critic" in result.stderr


def test_a_shared_critic_does_not_warm_up_alone():
    configured(hyperparameters={"critic_warm_up": 1024, "shared_critic": True})
    result = train()
    assert result.exit_code == 2
    assert "critic_warm_up: cannot be with shared_critic" in result.stderr


def test_demonstrations_of_images_are_refused():
    with pytest.raises(RecordingError, match="Squares: shows images as it is set, and demonstrations hold none"):
        record_episodes(Squares(2), RandomDriver(0), 2, seed=0)
