"""`honeyguide follow`: what it writes, and what it refuses."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from mission.cli import app
from mission.follow.guard_report import guard_row
from mission.simulator.flight_rig import flight_world
from mission.view.film import write_film
from mission.view.film_images import HEIGHT, WIDTH
from mission.view.replay_file import load_recording
from policies.companion.guard.interventions import NEAR_SOMEBODY, NEAR_SOMETHING, NO_DEPTH, TILTED, Interventions
from tests.unit.mission.view.rows import CONFIG, hovering


def run(*arguments):
    return CliRunner().invoke(app, ["follow", *arguments])


def test_it_follows_lands_and_writes_scorecard_and_recording(tmp_path):
    folder = tmp_path / "run"
    result = run("--speed", "max", "--seconds", "5", "--no-mp4", "--run-folder", str(folder))
    assert result.exit_code == 0, result.output
    assert "scorecard" in result.output
    assert "changed by the guard, per minute" in result.output
    summary = json.loads((folder / "summary.json").read_text(), parse_constant=pytest.fail)  # no NaN: strict readers
    assert summary["in_band"] is not None
    guard = summary["guard"]
    assert guard["decisions"] >= 50
    assert guard["changed_per_min"].keys() == guard["changed"].keys()
    assert f"{guard['decisions']} decisions; the guard changed" in result.output
    assert "picture to setpoint" in result.output
    assert "logs and scorecard: " in result.output
    recording = load_recording(folder)
    assert recording.has_owner
    assert recording.rows["height_m"].max() > 2.0
    assert not recording.rows["is_armed"][-1]
    assert {"flight.ulg", "flight.tlog"} <= {path.name for path in folder.iterdir()}


def test_a_rover_follows_on_wheels_and_stops(tmp_path):
    folder = tmp_path / "run"
    result = run("--airframe", "rover", "--speed", "max", "--seconds", "20", "--no-mp4", "--run-folder", str(folder))
    assert result.exit_code == 0, result.output
    assert "navigate-rover-follow follows an owner" in result.output
    summary = json.loads((folder / "summary.json").read_text(), parse_constant=pytest.fail)
    assert summary["collision"] == 0.0
    assert 1.5 < summary["distance_median_m"] < 4.0
    recording = load_recording(folder)
    assert np.ptp(recording.rows["pos_ned"][:, :2], axis=0).max() > 3.0
    assert not recording.rows["is_armed"][-1]


def test_a_film_shows_every_second_frame(tmp_path):
    import av

    recording = hovering(0.4)
    write_film(recording, flight_world(CONFIG), tmp_path / "flight.mp4", Console())
    with av.open(str(tmp_path / "flight.mp4")) as film:
        pictures = list(film.decode(video=0))
    assert len(pictures) == len(recording) // 2
    assert (pictures[0].height, pictures[0].width) == (HEIGHT, WIDTH)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--owner", "swim"), "--owner swim: must be walk or run"),
        (("--policy", "nobody"), "nobody: no such policy"),
        (("--guard-setting", "owner_m=-1"), "--guard-setting owner_m: must be above 0, not -1.0"),
        (("--speed", "-1"), "--speed -1: must be a number above 0"),
        (
            ("--airframe", "rover", "--policy", "follow-me-tracked"),
            "follow-me-tracked: it was made for another kind of vehicle",
        ),
        (("--airframe", "rover", "--policy", "scripted"), "scripted: it was made for another kind of vehicle"),
        (
            ("--policy", "navigate-rover"),
            "made for another kind of vehicle than --airframe x500",
        ),
        (
            ("--policy", "drive-park"),
            "drive-park.pt: made for Drive; those follow who were made for FollowMe",
        ),
    ],
)
def test_wrong_arguments_are_refused_with_one_sentence(arguments, sentence, tmp_path):
    result = run(*arguments, "--run-folder", str(tmp_path / "run"))
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("changed", "row"),
    [
        (None, ("changed by the guard", "no guard")),
        ({}, ("changed by the guard, per minute", "none")),
        (
            {TILTED: 3, NEAR_SOMETHING: 300, NEAR_SOMEBODY: 60, NO_DEPTH: 2},
            ("changed by the guard, per minute", "150 near something, 30 near somebody, 2 tilted"),
        ),
    ],
)
def test_the_scorecard_has_what_the_guard_changed_most_per_minute_of_decisions(changed, row):
    interventions = None if changed is None else Interventions()
    if changed:
        interventions.update(changed)
    skill = SimpleNamespace(interventions=interventions)
    assert guard_row(SimpleNamespace(skill=skill, decision_count=1200)) == row
