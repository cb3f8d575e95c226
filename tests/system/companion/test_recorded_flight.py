"""A recorded flight becomes a dataset whose observations are what the policy saw, and images what it looked at."""

import json

import numpy as np
import pytest
import torch
from pyulog import ULog
from rich.console import Console
from typer.testing import CliRunner

from mission.cli import app
from mission.dataset.build import BuildOptions, build_dataset
from mission.dataset.recording import record_flight
from mission.flight_config import FlightConfig, OwnerConfig
from mission.follow.lockstep import flight_with_companion, follow_for
from policies.companion.decision_log import GUARD_KEY, TOPIC
from policies.companion.guard.interventions import REASONS
from policies.companion.skills.following import Following
from policies.companion.skills.load_skill import load_follower
from policies.datasets.episodes import DatasetError
from policies.datasets.reader import DatasetReader
from policies.learn.export.policy_file import load_policy
from policies.offline.store import open_store
from policies.tasks.follow_me.world import FOLLOW_WORLD

SECONDS = 8.0
TRACKED = ("observation=tracked", "has_estimator=false", "owner=any", "terrain=kept")


class Witness:
    """A pilot that keeps what it was shown and chose."""

    def __init__(self, pilot):
        self._pilot, self.kind, self.image_shape = pilot, pilot.kind, pilot.image_shape
        self.owner_hfrd, self.reset = None, pilot.reset
        self.seen, self.images, self.chosen = [], [], []

    def act(self, vector, image):
        self.seen.append(vector.copy())
        self.images.append(image.copy())
        self.chosen.append(self._pilot.act(vector, image).copy())
        return self.chosen[-1]


def flown(folder, name, *, is_recorded=True):
    folder.mkdir()
    pilot = Witness(load_follower(name))
    runner = OwnerConfig(pace="run")  # behind whom the guard has much to change
    config = FlightConfig(owner=runner, world=FOLLOW_WORLD, seed=3, wind_m_s=2.0)
    flight, companion = flight_with_companion(config, pilot, folder=folder)
    if is_recorded:
        from mission.view.replay_file import keep_for_replay

        keep_for_replay(flight)
        recording = record_flight(flight, companion, folder, name)
    follow_for(flight, companion, SECONDS)
    if is_recorded:
        recording.close()
    return pilot


def built(source, out, **options):
    build_dataset(BuildOptions((source,), "FollowMe", out, **options), Console(quiet=True))
    return out


@pytest.fixture(scope="module")
def tracked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tracked") / "run"
    return folder, flown(folder, "follow-me-tracked")


def test_observations_actions_and_images_are_what_the_policy_saw_and_chose(tracked, tmp_path):
    folder, pilot = tracked
    with DatasetReader(built(folder, tmp_path / "set", has_images=True)) as reader:
        (episode,) = list(reader)
    n = len(episode.observations)
    assert n > 0.9 * 10 * SECONDS
    (first,) = [k for k in range(len(pilot.seen) - n + 1) if np.array_equal(pilot.seen[k], episode.observations[0])]
    assert np.array_equal(np.array(pilot.seen[first : first + n]), episode.observations)
    assert np.array_equal(np.array(pilot.images[first : first + n]), episode.images)
    is_asked = (np.array(pilot.chosen[first : first + n - 1]) == episode.actions).all(axis=1)
    assert is_asked.any()  # where the guard changed nothing
    assert episode.context["wind_m_s"] == 2.0
    assert reader.origin.rewards_by == "truth"


def test_the_log_holds_the_stance_of_the_guard_and_what_it_changed_each_decision_for(tracked):
    folder, _ = tracked
    log = ULog(str(folder / "flight.ulg"), [TOPIC])
    words = json.loads("".join(log.msg_info_multiple_dict[GUARD_KEY][0]))
    assert words == {"stances": list(Following.stances), "reasons": list(REASONS)}
    columns = log.get_dataset(TOPIC).data
    is_flying = columns["is_flying"].astype(bool)
    assert (columns["guard_stance"][is_flying] > 0).all()
    assert not columns["guard_stance"][~is_flying].any()
    assert not columns["guard_reasons"][~is_flying].any()
    changed = np.abs(np.stack([columns[f"wanted[{k}]"] - columns[f"flown[{k}]"] for k in (0, 1)])).max(axis=0) > 0.3
    is_free = columns["guard_stance"] == 1 + words["stances"].index("following")
    assert changed[is_free].any()
    assert columns["guard_reasons"][changed & is_free].all()


def test_the_same_log_gives_the_same_bytes_and_the_estimate_judges_alike(tracked, tmp_path):
    folder, _ = tracked
    one, other = built(folder, tmp_path / "one"), built(folder / "flight.ulg", tmp_path / "other")
    for name in ("main_data.hdf5", "metadata.json"):
        assert (one / name).read_bytes() == (other / name).read_bytes()
    with DatasetReader(one) as true, DatasetReader(built(folder, tmp_path / "known", has_truth=False)) as known:
        by_truth, by_estimate = true.episode(0), known.episode(0)
        assert known.origin.rewards_by == "estimate"
    assert np.array_equal(by_truth.observations, by_estimate.observations)
    assert abs(by_truth.rewards - by_estimate.rewards).mean() < 0.3  # the owner is known to some decimetres


def test_a_script_is_recorded_as_the_tracked_policy_would_be_shown(tmp_path):
    flown(tmp_path / "run", "scripted")
    with DatasetReader(built(tmp_path / "run", tmp_path / "set")) as reader:
        episode = reader.episode(0)
    names = [element.name for element in reader.layout.frame]
    is_seen = episode.observations[:, names.index("is_owner_seen")]
    assert is_seen.mean() > 0.5
    assert (abs(episode.actions) <= 1.0).all()


def test_logs_of_other_flights_are_refused_with_the_topic(tracked, tmp_path):
    folder, _ = tracked
    flown(tmp_path / "plain", "scripted", is_recorded=False)
    with pytest.raises(DatasetError, match=r"plain/flight.ulg: has no topic policy_decision"):
        built(tmp_path / "plain", tmp_path / "set")
    with pytest.raises(DatasetError, match="policy_decision: made for another task or preset: task is FollowMe there"):
        build_dataset(BuildOptions((folder,), "Drive", tmp_path / "set"), Console(quiet=True))
    with pytest.raises(DatasetError, match=r"policy_decision: was recorded without pictures: images.zip is missing"):
        alone = tmp_path / "alone"
        alone.mkdir()
        (alone / "flight.ulg").write_bytes((folder / "flight.ulg").read_bytes())
        built(alone, tmp_path / "set", has_images=True)
    assert not [path for path in tmp_path.iterdir() if path.name.startswith("set")]


def test_commands_show_and_filter_it(tracked, tmp_path):
    folder, _ = tracked
    run = CliRunner()
    one = built(folder, tmp_path / "one")
    picture, film = tmp_path / "h.png", tmp_path / "e.mp4"
    shown = run.invoke(app, ["dataset", "show", str(one), "--picture", str(picture), "--mp4", str(film)])
    assert shown.exit_code == 0, shown.output
    assert "FollowMe, layout version" in shown.output
    assert picture.stat().st_size > 10_000
    assert film.stat().st_size > 1_000
    refused = run.invoke(app, ["dataset", "filter", str(one), "-o", str(tmp_path / "x"), "--outcome", "lost"])
    assert refused.exit_code == 2
    assert json.loads((one / "metadata.json").read_text())["honeyguide_task"] == "FollowMe"


def test_a_policy_is_cloned_from_its_log(tracked, tmp_path):
    folder, _ = tracked
    dataset = built(folder, tmp_path / "set", env_args=(*TRACKED, "stack=3"))
    recipe = {
        "behaviors": {
            "FollowMe": {
                "trainer_type": "bc",
                "offline": {"dataset": str(dataset), "evaluation_episodes": 0},
                "network_settings": {"normalize": True, "hidden_units": 16, "num_layers": 1},
                "max_steps": 400,
            }
        },
        "env_settings": {"env_path": "FollowMe", "env_args": [*TRACKED, "stack=3"], "num_areas": 1},
    }
    (tmp_path / "bc.yaml").write_text(json.dumps(recipe))
    words = ["train", str(tmp_path / "bc.yaml"), "--run-id", "bc", "--results-dir", str(tmp_path), "--seed", "1"]
    trained = CliRunner().invoke(app, words)
    assert trained.exit_code == 0, trained.output
    policy, card = load_policy(tmp_path / "bc" / "FollowMe.pt")
    assert card.task == "FollowMe"
    store = open_store([str(dataset)], policy.layout)
    with torch.no_grad():
        actions, _ = policy.act(store.observations[store.decisions].contiguous(), policy.start_memory(len(store)))
        apart = (policy.bounded(actions) - store.continuous[store.decisions]).abs().mean()
    recorded = store.continuous[store.decisions]
    assert apart < 0.5 * (recorded - recorded.mean(dim=0)).abs().mean()  # nearer than the mean action is
