"""`honeyguide picture`: the documented command, and what it refuses."""

import re

import cv2
import pytest
from typer.testing import CliRunner

from mission.cli import app
from tests.unit.test_docs import ROOT


def documented():
    """The arguments of the command in docs/how-to/camera.md."""
    (line,) = re.findall(r"honeyguide picture (camera\.jpg .*)", (ROOT / "docs" / "how-to" / "camera.md").read_text())
    return line.split()


def test_documented_picture_shows_sky_above_trees_and_grass(tmp_path):
    output, *options = documented()
    options[options.index("--size") + 1] = "240x135"
    result = CliRunner().invoke(app, ["picture", str(tmp_path / output), *options])
    assert result.exit_code == 0, result.output
    image = cv2.imread(str(tmp_path / output)).astype(float)
    assert image.shape == (135, 240, 3)
    blue, green, red = image[:10].mean(axis=(0, 1))
    assert blue > red
    blue, green, red = image[-20:].mean(axis=(0, 1))
    assert green > max(blue, red)


@pytest.mark.parametrize("size", ["10x10", "640", "x", "640x99999"])
def test_size_that_makes_no_sense_is_refused(tmp_path, size):
    result = CliRunner().invoke(app, ["picture", str(tmp_path / "a.jpg"), "--size", size])
    assert result.exit_code == 2
    assert not (tmp_path / "a.jpg").exists()


def test_folder_that_does_not_exist_is_refused(tmp_path):
    result = CliRunner().invoke(app, ["picture", str(tmp_path / "none" / "a.jpg"), "--size", "16x16"])
    assert result.exit_code == 2
