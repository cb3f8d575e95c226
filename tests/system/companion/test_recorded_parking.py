"""A recorded drive into a spot becomes a dataset: the way there is one episode, and standing there is none."""

import pytest
from typer.testing import CliRunner

from mission.cli import app
from policies.datasets.reader import DatasetReader


def run(*words):
    result = CliRunner().invoke(app, [*map(str, words)])
    assert result.exit_code == 0, result.output


@pytest.fixture(scope="module")
def parked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("parked") / "run"
    run("park", "--speed", "max", "--world-seed", 1, "--record", "--run-folder", folder)
    return folder


@pytest.mark.parametrize(("judge", "option"), [("truth", "--truth"), ("estimate", "--no-truth")])
def test_a_drive_into_a_spot_is_one_episode(parked, tmp_path, judge, option):
    run("dataset", "build", parked, "--task", "Drive", "--env-args", "preset=park", option, "-o", tmp_path / "set")
    with DatasetReader(tmp_path / "set") as reader:
        (episode,) = list(reader)
        assert reader.origin.rewards_by == judge
    assert episode.outcome == "success"
    assert len(episode) > 50
    assert episode.rewards[-1] > 5.0  # arriving is paid
