"""A policy that was chosen says in its card how good it was found to be."""

import torch

from bench.judged_card import write_judged
from common.intervals import Interval
from mission.train.policy_card import card_rows
from policies.learn.export.policy_file import load_policy
from policies.pretrained.pretrained_policies import pretrained


def test_what_a_policy_was_chosen_by_is_in_its_card_and_the_policy_is_the_same(tmp_path):
    source, chosen = pretrained("drive-reach"), tmp_path / "chosen.pt"
    write_judged(source, chosen, "success", Interval(0.957, 0.943, 0.968), 1000)
    (policy, card), (before, was) = load_policy(chosen), load_policy(source)
    assert dict(card_rows(card))["success, judged"] == (
        "95.70 % (95 %: 94.30 to 96.80) of 1,000 episodes that it did not train on"
    )
    assert (card.seed, card.steps, card.parents, card.code) == (was.seed, was.steps, was.parents, was.code)
    for name, weights in before.state_dict().items():
        assert torch.equal(policy.state_dict()[name], weights), name


def test_the_time_in_the_band_is_told_likewise(tmp_path):
    write_judged(pretrained("drive-reach"), tmp_path / "chosen.pt", "band", Interval(0.7, 0.65, 0.75), 256)
    rows = dict(card_rows(load_policy(tmp_path / "chosen.pt")[1]))
    assert rows["time in the band, judged"].startswith("70.00 % (95 %: 65.00 to 75.00) of 256 ")
    assert "success, judged" not in rows  # which was of other episodes
