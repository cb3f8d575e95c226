"""What a card says of where a policy comes from: the commit of its code, its teacher, its datasets."""

import subprocess
from dataclasses import asdict

from rich.console import Console

from bench.judged_card import write_judged
from common.intervals import Interval
from mission.train.demonstrate import DemonstrateOptions, demonstrate_task
from policies.learn.config.behavior import Behavior
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.learn.export.provenance import (
    CHANGED,
    UNKNOWN,
    commit_of,
    data_records,
    teacher_record,
    weights_sha256,
)

WHO = ("-c", "user.name=a", "-c", "user.email=a@example.com")


def git(folder, *words):
    done = subprocess.run(["git", "-C", folder, *WHO, *words], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_the_commit_is_that_of_the_repository_whose_root_it_is_and_changes_are_named(tmp_path):
    root = tmp_path / "repository"
    (root / "inside").mkdir(parents=True)
    git(root, "init", "-q")
    assert commit_of(root) == UNKNOWN  # nothing is committed
    (root / "a.py").write_text("1\n")
    git(root, "add", ".")
    git(root, "commit", "-qm", "First")
    head = git(root, "rev-parse", "HEAD")
    assert commit_of(root) == head
    (root / "results.txt").write_text("not the program's")
    assert commit_of(root) == head
    (root / "a.py").write_text("2\n")
    assert commit_of(root) == f"{head} {CHANGED}"
    assert commit_of(root / "inside") == UNKNOWN  # as a package that is installed inside of somebody's repository
    assert commit_of(tmp_path) == UNKNOWN


def test_a_teacher_is_known_by_the_hash_of_its_weights_and_its_card():
    behavior = Behavior(trainer_type="dagger", hyperparameters={"teacher": "follow-me-teacher"})
    record = teacher_record(behavior)
    assert record["policy"] == "follow-me-teacher"
    assert record["weights_sha256"] == weights_sha256(load_policy(find_policy("follow-me-teacher"))[0])
    assert record["card"] == asdict(load_policy(find_policy("follow-me-teacher"))[1])
    assert teacher_record(Behavior()) == {}


def test_the_hash_of_weights_stays_where_the_card_changes_and_changes_with_a_weight(tmp_path):
    source, judged = find_policy("follow-me-teacher"), tmp_path / "judged.pt"
    write_judged(source, judged, "band", Interval(0.9, 0.8, 1.0), 8)
    policy = load_policy(judged)[0]
    assert judged.read_bytes() != source.read_bytes()
    assert weights_sha256(policy) == weights_sha256(load_policy(source)[0])
    next(policy.parameters()).data.view(-1)[0] += 1.0
    assert weights_sha256(policy) != weights_sha256(load_policy(source)[0])


def test_datasets_are_known_by_what_they_are_for_and_of_whom(tmp_path):
    folder = tmp_path / "shown"
    demonstrate_task(DemonstrateOptions("RollerBall", folder, 3, 5, (), False), Console(quiet=True))
    imitated = {"reward_signals": {"gail": {"demo_path": str(folder)}}}
    (gail, cloned) = sorted(
        data_records(Behavior(behavioral_cloning={"demo_path": str(folder)}, **imitated)),
        key=lambda record: record["use"],
        reverse=True,
    )
    assert (gail["use"], cloned["use"]) == ("gail", "behavioral_cloning")
    assert gail["path"] == str(folder)
    assert (gail["episodes"], gail["seed"]) == (3, 5)
    assert gail["steps"] >= 3
    assert gail["pilot"]
    assert data_records(Behavior()) == []
