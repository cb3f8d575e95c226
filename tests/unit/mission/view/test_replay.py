"""`honeyguide replay`: the HTML file, the film, and what is refused."""

import json
import re
from base64 import b64decode

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from mission.cli import app
from mission.simulator.flight_rig import flight_world
from mission.view.html import STRIDE, page_data
from tests.unit.mission.view.rows import CONFIG, hovering, write_log


def run(*arguments):
    return CliRunner().invoke(app, ["replay", *map(str, arguments)])


@pytest.fixture
def folder(tmp_path):
    write_log(hovering(), tmp_path / "flight.ulg")
    return tmp_path


def test_the_html_file_holds_everything_and_loads_nothing(folder):
    result = run(folder, "--html", folder / "flight.html")
    assert result.exit_code == 0, result.output
    page = (folder / "flight.html").read_text(encoding="utf-8")
    assert re.findall(r'(?:src|href)="', page) == []
    assert "http" not in page.replace("http-equiv", "")
    data = json.loads(re.search(r'type="application/json">(.*?)</script>', page, re.DOTALL).group(1))
    times = np.frombuffer(b64decode(data["track"]["time_s"]["data"]), "<f4")
    assert len(times) == len(hovering()) // STRIDE
    assert len(page) < 1_000_000


def test_the_html_file_has_the_pictures_of_the_onboard_camera():
    onboard = page_data(hovering(4.0).every(STRIDE), flight_world(CONFIG), "x")["onboard"]
    sheet = cv2.imdecode(np.frombuffer(b64decode(onboard["sheet"]), np.uint8), cv2.IMREAD_COLOR)
    assert onboard["count"] == 20
    assert sheet.shape == (onboard["side"], 20 * onboard["side"], 3)
    first = sheet[:, : onboard["side"]].astype(int)
    assert ((first[..., 0] - first[..., 2]) > 60).sum() > 20  # the owner's blue shirt


def test_a_film_is_written(folder):
    result = run(folder, "--mp4", folder / "film.mp4")
    assert result.exit_code == 0, result.output
    assert (folder / "film.mp4").stat().st_size > 1000


@pytest.mark.parametrize("option", ["--html", "--mp4"])
def test_a_file_in_a_folder_that_does_not_exist_is_refused(folder, option):
    result = run(folder, option, folder / "nowhere" / "x")
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1


def test_a_folder_without_a_run_is_refused(tmp_path):
    result = run(tmp_path)
    assert result.exit_code == 2
    assert "holds no run" in result.stderr
