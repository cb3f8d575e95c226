"""The policies that ship: each is a small policy file of the task it is called by, and says where it comes from."""

import re
from importlib.resources import files
from pathlib import Path

import pytest

from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.learn.export.provenance import weights_sha256
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


def legs(path):
    """What cards say of each training behind a policy that ships, teachers' too."""
    own = load_policy(path)[1].as_parent()
    teachers = [leg["teacher"]["card"] for leg in own if leg["teacher"]]
    return [*own, *teachers, *(leg for card in teachers for leg in card["parents"])]


def test_the_teacher_that_a_shipped_student_names_ships():
    teachers = [leg["teacher"] for path in SHIPPED for leg in load_policy(path)[1].as_parent() if leg["teacher"]]
    assert teachers
    ships = {weights_sha256(load_policy(path)[0]) for path in SHIPPED}
    assert {teacher["weights_sha256"] for teacher in teachers} <= ships


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_shipped_policy_says_seed_and_commit_of_all_its_legs_and_what_it_was_chosen_by(path):
    for leg in legs(path):
        assert leg["seed"] >= 1
        assert re.fullmatch("[0-9a-f]{40}", leg["code"]["commit"]), leg["code"]
    card = load_policy(path)[1]
    figures, measure = card.figures, "band" if card.task == "FollowMe" else "success"
    assert figures[f"{measure}_low"] < figures[f"{measure}_rate"] < figures[f"{measure}_high"]
    assert figures["episodes"] >= 100
    assert len([name for name in figures if name.endswith("_rate") and not name.startswith("training_")]) == 1
