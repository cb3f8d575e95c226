"""The example of docs/how-to/worlds.md is a world, and its commands do what the page says."""

import shlex

import numpy as np
import pytest
from typer.testing import CliRunner

from mission.cli import app
from mission.flight import Flight, FlightConfig
from mission.world.world_reader import read_and_build
from tests.documents import ROOT, blocks

PAGE = ROOT / "docs/how-to/worlds.md"


@pytest.fixture
def yard(tmp_path, monkeypatch):
    """The folder with the example's files, the one that is worked in."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "yard.yaml").write_text(blocks(PAGE, "yaml")[0], encoding="utf-8")
    exec(blocks(PAGE, "python")[0], {})
    return tmp_path / "yard.yaml"


def test_the_example_is_a_world_that_a_vehicle_boots_in(yard):
    config, world = read_and_build(yard)
    names = {part.name.partition("_")[0] for part in world.solids.parts}
    assert names == {"box0", "wall0", "cylinder0", "pad0", "pad0top", "pad1", "pad1top", "mesh0", "mesh1"}
    assert world.surface(18.0, -9.0) == pytest.approx(4.05, abs=1e-3)
    assert world.surface(16.0, 10.0) == pytest.approx(5.0, abs=1e-3)
    assert world.surface(8.5, 4.0) == pytest.approx(0.9, abs=1e-3)
    assert len(world.trees) > 100
    flight = Flight(FlightConfig(world=config))
    flight.frame()
    assert -flight.rig.rows["truth"][0]["pos_ned"][2] == pytest.approx(0.05 + 0.2258, abs=2e-3)


@pytest.mark.parametrize("k", range(5))
def test_the_page_s_commands_work(yard, k):
    lines = [line for block in blocks(PAGE, "sh") for line in block.splitlines() if " fly " not in line]
    assert len(lines) == 4
    if k == 4:
        line = "honeyguide fly --world yard.yaml --idle --speed max --seconds 1"
    else:
        line = lines[k].removeprefix(".venv/bin/")
    result = CliRunner().invoke(app, shlex.split(line)[1:])
    assert result.exit_code == 0, result.output
    made = {1: "yard.jpg", 2: "yard.glb", 3: "ground.png"}.get(k)
    assert made is None or (yard.parent / made).stat().st_size > 1000


def test_the_other_heightmap_of_the_page_reads(tmp_path, monkeypatch):
    import cv2

    monkeypatch.chdir(tmp_path)
    cv2.imwrite("hills.png", np.arange(101 * 101, dtype=np.uint16).reshape(101, 101))
    (tmp_path / "hills.yaml").write_text(blocks(PAGE, "yaml")[1], encoding="utf-8")
    _, world = read_and_build(tmp_path / "hills.yaml")
    assert world.config.size_m == 200.0
