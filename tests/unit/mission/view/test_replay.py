"""`honeyguide replay`: the HTML file, the film, and what is refused."""

import dataclasses
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


def test_the_html_of_a_drive_has_wheels_no_height_and_the_modes_of_its_class():
    flown = hovering(2.0)
    config = flown.config.model_copy(update={"airframe": "rover", "owner": None})
    flown.rows["motor_speed"][:, :4] = 10.0
    driven = dataclasses.replace(flown, config=config)
    data = page_data(driven, flight_world(config), "rover")
    assert data["wheel"] is not None
    assert data["is_steered"] == [True, True, False, False]
    assert [plot["title"] for plot in data["plots"]] == ["speed [m/s]", "battery [%]"]
    assert "Takeoff" not in data["modes"].values()
    turned = np.frombuffer(b64decode(data["track"]["turned_rad"]["data"]), "<f4").reshape(-1, 8)
    assert turned[-1, 0] == pytest.approx(10.0 * (flown.rows["time_s"][-1] - flown.rows["time_s"][0]), rel=1e-3)
    assert page_data(flown, flight_world(CONFIG), "x500")["wheel"] is None
