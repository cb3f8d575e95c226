"""Policy files: what was saved acts the same, and is refused where it does not fit."""

import pytest
import torch

from policies.learn.checkpoint import load, save
from policies.learn.config.network import Memory, NetworkSettings
from policies.learn.export.policy_file import PolicyCard, load_policy, save_policy
from policies.learn.export.policy_path import CheckpointError
from policies.learn.networks.observations import Observation
from policies.learn.networks.policy import Policy
from policies.tasks.catalogue import build_task
from policies.tasks.layout import Element, ImageElement, Layout

CARD = PolicyCard("RollerBall", {"preset": "as-coded"}, 7, 1000, {"success_rate": 0.99})


def make_policy(**network):
    policy = Policy(
        build_task("RollerBall", 1).layout, NetworkSettings(normalize=True, **network), torch.Generator().manual_seed(0)
    )
    policy.body.normalize(torch.randn(50, 8, generator=torch.Generator().manual_seed(1)))
    return policy


@pytest.mark.parametrize("network", [{}, {"memory": Memory(memory_size=16)}])
def test_policy_that_was_saved_acts_the_same(tmp_path, network):
    policy = make_policy(**network)
    save_policy(tmp_path / "a.pt", policy, CARD)
    again, card = load_policy(tmp_path / "a.pt")
    assert card == CARD
    observations = torch.randn(20, 8, generator=torch.Generator().manual_seed(2))
    acted = [each.act(observations, each.start_memory(20)) for each in (policy, again)]
    assert torch.equal(acted[0][0].continuous, acted[1][0].continuous)
    assert torch.equal(acted[0][1], acted[1][1])
    assert again.layout == policy.layout


def test_a_card_of_before_code_teacher_and_data_were_kept_is_read(tmp_path):
    path = tmp_path / "a.pt"
    save_policy(path, make_policy(), CARD)
    content = load(path, "policy")
    for name in ("numbers", "parents", "code", "teacher", "data"):
        del content["card"][name]
    save(path, content, "policy")
    assert load_policy(path)[1] == CARD


def test_policy_file_of_two_layers_of_128_is_small(tmp_path):
    save_policy(tmp_path / "a.pt", make_policy(), CARD)
    assert (tmp_path / "a.pt").stat().st_size < 200_000


def test_policy_of_another_version_is_refused(tmp_path):
    path = tmp_path / "a.pt"
    save_policy(path, make_policy(), CARD)
    content = load(path, "policy")
    del content["policy"]["weights"]["body.layers.0.weight"]
    save(path, content, "policy")
    with pytest.raises(CheckpointError, match=r"a\.pt: written by another version of honeyguide: .*body\.layers\.0"):
        load_policy(path)


def test_a_policy_of_the_follow_me_documents_size_is_below_a_megabyte_in_half_precision(tmp_path):
    frame = tuple(Element(f"e{k}", "1") for k in range(7))
    layout = Layout("T", 1, frame, (Element("push", "1"),), image=ImageElement(64, 64, ("red", "green", "blue")))
    settings = NetworkSettings(hidden_units=256, num_layers=1, vis_encode_type="simple")
    policy = Policy(layout, settings, torch.Generator().manual_seed(0))
    save_policy(tmp_path / "a.pt", policy, CARD, is_half=True)
    assert (tmp_path / "a.pt").stat().st_size < 1_000_000
    again, _ = load_policy(tmp_path / "a.pt")
    assert again.layout == layout
    generator = torch.Generator().manual_seed(2)
    image = torch.randint(0, 256, (20, 64, 64, 3), dtype=torch.uint8, generator=generator)
    observation = Observation(torch.randn(20, 7, generator=generator), image)
    means = [each(observation).mean for each in (policy, again)]
    assert torch.allclose(means[0], means[1], atol=2e-3)
    assert not torch.equal(means[0], means[1])


CONTENTS = {
    "a list": [1, 2],
    "a number": 3,
    "nothing": {},
    "an array that is none": {"npy": [1.0]},
    "an array of objects": {"npy": torch.frombuffer(bytearray(b"\x93NUMPY\x01\x00"), dtype=torch.uint8)},
    "another card": {"policy": {}, "card": {"speed": 3}},
    "a card that is none": {"policy": {}, "card": [1]},
    "a policy that is none": {"policy": [1], "card": {"task": "T", "settings": {}, "seed": 0, "steps": 0}},
    "a layout that is none": {
        "policy": {"network": {}, "layout": [3], "is_squashed": False, "weights": 7},
        "card": {"task": "T", "settings": {}, "seed": 0, "steps": 0},
    },
}


@pytest.mark.parametrize("name", CONTENTS)
def test_any_other_content_is_refused_in_one_sentence(tmp_path, name):
    path = tmp_path / "odd.pt"
    torch.save({"honeyguide": "policy", "content": CONTENTS[name]}, path)
    with pytest.raises(CheckpointError, match=r"odd\.pt: ") as refused:
        load_policy(path)
    assert "\n" not in str(refused.value)
