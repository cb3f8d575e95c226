"""The policies that ship: each is a small policy file of the task it is called by."""

from importlib.resources import files
from pathlib import Path

from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.pretrained.pretrained_policies import pretrained
from policies.tasks.catalogue import CATALOGUE, build_task, file_stem, task_settings

SHIPPED = sorted(Path(str(files("policies.pretrained"))).glob("*.pt"))


def test_shipped_policies_are_small_and_fit_their_task():
    for path in SHIPPED:
        assert path.stat().st_size < 1_000_000, path
        policy, card = load_policy(path)
        assert path.stem.startswith(file_stem(card.task)), path
        build_task(card.task, 1, task_settings(card.task, card.settings)).layout.require(policy.layout, str(path))


def test_policy_is_found_by_its_task_and_by_its_own_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # where no run of one's own has the name
    for path in SHIPPED:
        assert pretrained(path.stem) == find_policy(path.stem) == path
    assert pretrained("FollowMe") == pretrained("follow-me-tracked")
    for name in CATALOGUE:
        assert pretrained(name) in (None, *SHIPPED)


def test_task_without_a_policy_has_none():
    assert pretrained("Flight") is None
