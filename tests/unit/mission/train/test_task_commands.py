"""`honeyguide demonstrate`, `play` and `drive`: what they leave behind, and what they refuse."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from mission.cli import app
from tests.documents import commands

ROLLER_BALL_AHEAD = 1  # a seed whose first cube lies where a ball pushed forward rolls over it


@pytest.fixture
def pygame(monkeypatch):
    """Pygame with a display that nobody sees; keys are posted before a command opens its window."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    import pygame

    pygame.display.init()
    yield pygame
    pygame.display.quit()


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *words: CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)


def press(pygame, *keys):
    for key in keys:
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key))


def assert_refused(result, sentence, folder):
    assert result.exit_code == 2, result.output
    (line,) = result.stderr.strip().splitlines()
    assert re.search(sentence, line), line
    assert list(folder.iterdir()) == []


def pictures_of(film):
    import av

    with av.open(str(film)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        return float(stream.average_rate), [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]


def test_demonstrate_writes_a_dataset(run, tmp_path):
    from minari import MinariDataset

    result = run("demonstrate", "RollerBall", "--out", "demo", "--episodes", 5, "--seed", 3)
    assert result.exit_code == 0, result.output
    assert "demo: 5 episodes, 5 of them successful" in result.output
    assert MinariDataset(tmp_path / "demo").total_episodes == 5


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["demonstrate", "Flight", "--out", "demo"], "Flight: no such task; there are RollerBall"),
        (["demonstrate", "RollerBall", "--out", "none/demo"], "none/demo: the folder it would lie in does not exist"),
        (["demonstrate", "RollerBall", "--out", "demo", "--env-args", "stack"], "--env-args stack: must be KEY=VALUE"),
        (["demonstrate", "RollerBall", "--out", "demo", "--env-args", "colour=red"], "RollerBall: colour: "),
        (["play", "RollerBall", "--mp4", "none/a.mp4"], "none/a.mp4: the folder it would lie in does not exist"),
        (["drive", "Flight"], "Flight: no such task"),
    ],
)
def test_what_makes_no_sense_is_refused(run, tmp_path, words, sentence):
    assert_refused(run(*words), sentence, tmp_path)


def test_existing_dataset_is_left_alone(run, tmp_path):
    run("demonstrate", "RollerBall", "--out", "demo", "--episodes", 1)
    before = (tmp_path / "demo" / "main_data.hdf5").read_bytes()
    assert run("demonstrate", "RollerBall", "--out", "demo", "--episodes", 2).exit_code == 2
    assert (tmp_path / "demo" / "main_data.hdf5").read_bytes() == before


def in_process(*words):
    """The command in a process of its own, whose files may have 2 kB; bytecode would be cut off: it keeps none."""
    program = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (2048, 2048))\n"
    program += "from mission.cli import main; main()"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[4])}
    line = [sys.executable, "-B", "-c", program, *words]
    return subprocess.run(line, env=environment, text=True, capture_output=True, check=False)


@pytest.mark.parametrize(
    "words",
    [
        ("demonstrate", "RollerBall", "--episodes", "20", "--out", "new"),
        ("play", "RollerBall", "--expert", "--mp4", "new"),
    ],
)
def test_full_disk_leaves_nothing_half_written(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = in_process(*words)
    assert result.returncode == 2, result.stderr
    assert result.stderr == "honeyguide: new: cannot be written: File too large\n"
    assert list(tmp_path.iterdir()) == []


def test_drive_without_a_display_says_so(run, tmp_path, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "x11")
    monkeypatch.delenv("DISPLAY", raising=False)
    assert_refused(run("drive", "RollerBall"), "no display to open a window on(?!.*mp4)", tmp_path)


def test_play_without_a_display_points_to_the_film(run, tmp_path, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("SDL_VIDEODRIVER", "x11")
    assert_refused(run("play", "RollerBall"), "no display to open a window on.*--mp4 FILE writes a film", tmp_path)


def test_film_shows_every_decision_at_its_pace(run, tmp_path):
    result = run("play", "RollerBall", "--mp4", "a.mp4", "--episodes", 1, "--seed", 1)
    assert "1 episodes: 1 success" in result.output
    rate, images = pictures_of(tmp_path / "a.mp4")
    assert rate == 5.0
    assert len(images) > 2
    assert images[0].shape == (480, 480, 3)
    assert np.abs(images[0].astype(int) - images[-1]).max() > 100
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]


def test_environments_are_tiled(run, tmp_path):
    run("play", "RollerBall", "--random", "--mp4", "a.mp4", "--episodes", 1, "--envs", 3)
    _, images = pictures_of(tmp_path / "a.mp4")
    assert images[0].shape == (960, 960, 3)
    assert images[0][480:, 480:].max() < 30  # no fourth environment


def policy_file(folder):
    import torch

    from policies.learn.config.network import NetworkSettings
    from policies.learn.export.policy_file import PolicyCard, save_policy
    from policies.learn.networks.policy import Policy
    from policies.tasks.catalogue import build_task

    layout = build_task("RollerBall", 1).layout
    policy = Policy(layout, NetworkSettings(hidden_units=8), torch.Generator().manual_seed(0))
    save_policy(folder / "ball.pt", policy, PolicyCard("RollerBall", {"preset": "as-coded"}, 0, 0))


def test_policy_is_played_by_its_file_alone(run, tmp_path):
    policy_file(tmp_path)
    (tmp_path / "results" / "mine").mkdir(parents=True)
    shutil.copy(tmp_path / "ball.pt", tmp_path / "results" / "mine")
    for words in (["ball.pt"], ["RollerBall", "--policy", "ball.pt"], ["mine"]):
        result = run("play", *words, "--mp4", "a.mp4", "--episodes", 1)
        assert "ball.pt: 1 episodes: " in result.output
    assert len(pictures_of(tmp_path / "a.mp4")[1]) > 1


def test_policy_of_another_layout_is_refused(run, tmp_path):
    policy_file(tmp_path)
    result = run("play", "ball.pt", "--env-args", "stack=2", "--mp4", "a.mp4")
    assert result.exit_code == 2
    assert "ball.pt: made for another task or preset: stacked frames is 1 there and 2 here" in result.stderr


def test_file_that_is_no_policy_is_refused(run, tmp_path):
    (tmp_path / "ball.pt").write_bytes(b"no policy")
    result = run("play", "ball.pt", "--mp4", "a.mp4")
    assert result.exit_code == 2
    assert result.stderr.startswith("honeyguide: ball.pt: ")


def test_window_shows_until_it_is_closed(run, pygame):
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    assert "no episode ended" in run("play", "RollerBall").output


def test_person_drives_and_keeps_what_succeeded(run, pygame, tmp_path):
    from minari import MinariDataset

    press(pygame, pygame.K_UP)
    words = ("--seed", ROLLER_BALL_AHEAD, "--speed", 100, "--episodes", 1, "--record", "demo")
    result = run("drive", "RollerBall", *words)
    assert "1 success; demo: 1 episodes" in result.output
    (episode,) = MinariDataset(tmp_path / "demo").iterate_episodes()
    assert (episode.actions == [0.0, 1.0]).all()


def test_failed_drive_leaves_no_recording(run, pygame, tmp_path):
    press(pygame, pygame.K_a, pygame.K_s)
    words = ("--seed", ROLLER_BALL_AHEAD, "--speed", 100, "--episodes", 1, "--record", "demo")
    assert "1 fell; nothing to record" in run("drive", "RollerBall", *words).output
    assert list(tmp_path.iterdir()) == []


def test_drive_waits_for_the_first_key_and_ends_with_escape(run, pygame):
    press(pygame, pygame.K_r, pygame.K_ESCAPE)
    assert run("drive", "RollerBall").output.strip() == "no episode ended"


DOCUMENTED = [
    line
    for page, line in commands()
    if re.match(r"\.venv/bin/honeyguide (demonstrate|play|drive) ", line)
    and not page.endswith("own-task.md")  # what that page trains first is played by test_own_tasks.py
]


@pytest.mark.parametrize("line", DOCUMENTED)
def test_documented_command_works(run, line, pygame):
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    words = shlex.split(line)[1:]
    shortened = {"demonstrate": ["--episodes", "2"], "play": ["--episodes", "1"], "drive": []}[words[0]]
    result = run(*words, *shortened)
    assert result.exit_code == 0, result.output
