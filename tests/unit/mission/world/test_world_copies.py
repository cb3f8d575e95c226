"""A run in a world of one's own is shown as it was flown, also when it was moved and the world's files are gone."""

import shutil

import cv2
import numpy as np
import pytest

from mission.flight import Flight, FlightConfig
from mission.scenario.keeping import keep_scenario
from mission.scenario.scenario_file import read_scenario
from mission.view.replay_file import keep_for_replay, load_recording
from mission.world.world_reader import read_world
from sim.world.world import build_world

CUBE = """mtllib cube.mtl
v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv -1 -1 2\nv 1 -1 2\nv 1 1 2\nv -1 1 2
usemtl red
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8
"""
WORLD = """heightmap: {file: hill.png, metres_per_pixel: 2, height_min_m: 0, height_max_m: 8}
meshes:
  - {file: parts/cube.obj, position_ned_m: [6, 2]}
"""


@pytest.fixture
def world_file(tmp_path):
    source = tmp_path / "source"
    (source / "parts").mkdir(parents=True)
    (source / "parts" / "cube.obj").write_text(CUBE)
    (source / "parts" / "cube.mtl").write_text("newmtl red\nKd 1 0 0\n")
    north, _ = np.mgrid[-1:1:64j, -1:1:64j]
    cv2.imwrite(str(source / "hill.png"), (60000 * north**2).astype(np.uint16))
    (source / "yard.world.yaml").write_text(WORLD)
    return source / "yard.world.yaml"


def hits(world):
    down = world.ray_hit((6.0, 2.0, -60.0), (0.0, 0.0, 1.0), 100.0)
    level = world.ray_hit((0.0, 2.0, -world.surface(6.0, 2.0) + 1.0), (1.0, 0.0, 0.0), 100.0)
    return [float(down), float(level), float(world.height(40.0, 3.0))]


def test_a_run_that_was_moved_is_shown_in_its_world(world_file, tmp_path):
    world = read_world(world_file)
    expected = hits(build_world(world))
    run = tmp_path / "run"
    run.mkdir()
    flight = Flight(FlightConfig(world=world), folder=run)
    keep_for_replay(flight)
    flight.run(lambda each: each.time_us >= 500_000)
    flight.close()
    run.rename(tmp_path / "moved")
    shutil.rmtree(world_file.parent)
    recording = load_recording(tmp_path / "moved")
    assert hits(build_world(recording.config.world)) == expected
    assert (tmp_path / "moved" / "world").is_dir()
    assert len(list((tmp_path / "moved" / "world").rglob("cube.mtl"))) == 1


def test_a_kept_scenario_has_its_world_beside_it(world_file, tmp_path):
    scenario = world_file.with_name("hop.scenario.yaml")
    scenario.write_text("world: {file: yard.world.yaml}\nvehicle:\n  script: [arm, {takeoff: 3}]\n")
    expected = hits(build_world(read_world(world_file)))
    kept = tmp_path / "kept"
    kept.mkdir()
    keep_scenario(kept, read_scenario(scenario), 1)
    shutil.rmtree(world_file.parent)
    kept.rename(tmp_path / "elsewhere")
    again = read_scenario(tmp_path / "elsewhere" / "hop.scenario.yaml")
    assert hits(build_world(read_world(again.world.file))) == expected
