"""World files from YAML: what is wrong gets one sentence with its place and what is allowed; and what goes out."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from mission.console.option_checks import UserError, check_world
from mission.flight_options import flight_config
from mission.flight_settings import FlightOptions
from mission.world.world_export import export_world
from mission.world.world_reader import read_and_build, read_world
from sim.world.custom.world_file import BoxSolid, MeshSolid, PadSolid, WorldFile
from sim.world.world import build_world
from tests.unit.sim.world.meshes import lump, ray_oracle, rays_at, world_of

GOOD = """\
size_m: 200
boxes:
  - position_ned_m: [10, 0]
    size_m: [4, 6, 3]
    heading_deg: 30
    colour: '#b06030'
pads:
  - position_ned_m: [10, 0, -3]
cylinders:
  - {position_ned_m: [8, 8], radius_m: 1, height_m: 5}
"""


def written(folder, text):
    file = folder / "yard.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def test_a_file_says_what_python_says(tmp_path):
    world = read_world(written(tmp_path, GOOD))
    box = BoxSolid(position_ned_m=(10.0, 0.0), size_m=(4.0, 6.0, 3.0), heading_deg=30.0, colour="#b06030")
    assert world.boxes == (box,)
    assert world.pads == (PadSolid(position_ned_m=(10.0, 0.0, -3.0)),)
    assert (world.size_m, world.hill_height_m, world.trees_per_ha) == (200.0, 0.0, 0.0)


def test_files_are_looked_for_beside_the_file_that_names_them(tmp_path):
    mesh = lump(tmp_path)
    world, built = read_and_build(written(tmp_path, f"meshes: [{{file: {mesh.name}}}]"))
    assert world.meshes[0].file == mesh
    assert len(built.solids.faces) == 1280


@pytest.mark.parametrize(
    ("good", "bad", "sentence"),
    [
        ("[4, 6, 3]", "[4, 6]", "yard.yaml:4: boxes[0].size_m: must be length, width and height [m], not 2 numbers"),
        ("heading_deg: 30", "headng_deg: 30", ":5: boxes[0].headng_deg: unknown key; did you mean heading_deg?"),
        ("'#b06030'", "red", "yard.yaml:6: boxes[0].colour: must be a colour as '#rrggbb', such as '#a8a49e', not red"),
        (
            "[10, 0, -3]", "[1]",
            "yard.yaml:8: pads[0].position_ned_m: must be north, east and down [m], or north and east on the ground, "
            "not 1 numbers",
        ),
        ("height_m: 5", "height_m: -5", "yard.yaml:10: cylinders[0].height_m: must be at least 0.001, not -5"),
        (
            "height_m: 5", "height_m: 5, frotz: 1",
            "yard.yaml:10: cylinders[0].frotz: unknown key; allowed are position_ned_m, radius_m, height_m, colour",
        ),
        ("size_m: 200", "meshes: [{fil: tower.stl}]", "yard.yaml:1: meshes[0].fil: unknown key; did you mean file?"),
        (
            "size_m: 200", "meshes:\n  - heading_deg: 3\n    fil: tower.stl",
            "yard.yaml:3: meshes[0].fil: unknown key; did you mean file?",
        ),
        ("size_m: 200", "meshes: [{heading_deg: 3}]", "yard.yaml:1: meshes[0].file: is required"),
        ("size_m: 200", "size_m: wide", "yard.yaml:1: size_m: must be a number, not 'wide'"),
        (
            "size_m: 200", "heightmap: {file: hills.png}",
            "yard.yaml:1: heightmap: a PNG has no scale of its own: metres_per_pixel and height_min_m and height_max_m "
            "must say what its pixels stand for",
        ),
        ("size_m: 200", "size_m: [", "yard.yaml:3: not YAML:"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_sentence_with_its_place(tmp_path, good, bad, sentence):
    with pytest.raises(UserError) as refused:
        read_world(written(tmp_path, GOOD.replace(good, bad)))
    text = str(refused.value)
    assert sentence in text
    assert "\n" not in text


def test_a_mesh_with_holes_is_refused_where_it_is_named(tmp_path):
    mesh = trimesh.load_mesh(lump(tmp_path))
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)
    mesh.export(tmp_path / "holed.stl")
    with pytest.raises(UserError, match=r"yard.yaml:2: meshes\[0\].file: .*holes \(3 open edges\): close them, or"):
        read_world(written(tmp_path, "meshes:\n  - file: holed.stl\n"))


def test_a_flight_takes_a_file_where_it_takes_a_kind_of_world(tmp_path):
    file = written(tmp_path, GOOD)
    options = FlightOptions(world_kind=str(file))
    check_world(options)
    assert flight_config(options, None).world == read_world(file)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"world_kind": "moon"}, "--world moon: must be hills, forest, walled-forest, course, car-park or a file that"),
        ({"world_kind": "moon.yaml"}, "--world moon.yaml: no such file"),
        ({"trees_per_ha": 3.0}, "--trees: is said in the world file"),
        ({"owner": "walk"}, "--owner and a world file: choose one"),
    ],
)
def test_what_does_not_go_with_a_file_is_said(tmp_path, given, sentence):
    with pytest.raises(UserError, match=sentence):
        check_world(FlightOptions(**{"world_kind": str(written(tmp_path, GOOD))} | given))


def test_what_goes_out_as_gltf_comes_back_as_the_same_surface(tmp_path):
    middle = (12.0, 7.0, -5.0)
    solid = MeshSolid(file=lump(tmp_path), position_ned_m=middle, heading_deg=35.0)
    world = world_of(meshes=[solid], pads=[PadSolid(position_ned_m=(0.0, 0.0))])
    export_world(world, tmp_path / "world.glb")
    scene = trimesh.load_scene(tmp_path / "world.glb")
    assert set(scene.geometry) == {"ground", "mesh0_0", "pad0", "pad0top"}
    assert scene.geometry["pad0top"].visual.material.baseColorTexture is not None
    back = build_world(WorldFile(meshes=[MeshSolid(file=tmp_path / "world.glb", thin=True)]))
    origins, dirs = rays_at(middle, 100)
    meets = np.isfinite(ray_oracle(world, origins, dirs))
    found, _ = back.solids.rays(origins[meets], dirs[meets], 60.0)
    np.testing.assert_allclose(found, ray_oracle(world, origins[meets], dirs[meets]), atol=1e-3)


def test_heights_go_out_with_their_scale(tmp_path):
    hills = world_of(hill_height_m=9.0, size_m=200.0)
    export_world(hills, tmp_path / "ground.png")
    _, back = read_and_build(tmp_path / "ground.yaml")
    assert np.abs(back.heights - hills.heights).max() < 1e-3


def test_an_export_of_another_kind_is_refused(tmp_path):
    with pytest.raises(UserError, match=r"--export world.fbx: must end with .glb \(everything\) or .png"):
        export_world(world_of(), Path("world.fbx"))
