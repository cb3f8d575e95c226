"""World files from Python: heightmaps, meshes from files, pads, and what is refused."""

import numpy as np
import pytest
import trimesh
from pydantic import ValidationError

from sim.world.custom.heightmap import write_heightmap
from sim.world.custom.world_file import BoxSolid, Heightmap, MeshSolid, PadSolid, WallSolid, WorldError, WorldFile
from sim.world.world import WorldConfig, build_world
from tests.unit.sim.world.meshes import lump, world_of


def save_png(file, values):
    import cv2

    cv2.imwrite(str(file), values)
    return file


def ramp_png(folder, dtype, rows=41, columns=31):
    """Rising to the north and, less, to the east."""
    most = np.iinfo(dtype).max
    up = np.linspace(1.0, 0.0, rows)[:, None] * 0.8 + np.linspace(0.0, 1.0, columns)[None] * 0.2
    return save_png(folder / f"ramp{most}.png", np.rint(up * most).astype(dtype))


@pytest.mark.parametrize(("dtype", "step_m"), [(np.uint8, 0.1), (np.uint16, 0.001)])
def test_a_png_is_the_ground_north_up_and_home_at_its_middle(tmp_path, dtype, step_m):
    heightmap = Heightmap(file=ramp_png(tmp_path, dtype), metres_per_pixel=2.0, height_min_m=100.0, height_max_m=120.0)
    world = world_of(heightmap=heightmap)
    assert world.config.size_m == 80.0
    assert world.height(0.0, 0.0) == 0.0
    assert world.height(40.0, 0.0) == pytest.approx(8.0, abs=step_m)
    assert world.height(-20.0, 0.0) == pytest.approx(-4.0, abs=step_m)
    assert world.height(0.0, 30.0) == pytest.approx(2.0, abs=step_m)
    # narrower than it is high: level beyond its sides
    assert world.height(0.0, 40.0) == world.height(0.0, 31.0)


def test_a_heightmap_goes_out_and_comes_back_to_a_fraction_of_a_millimetre(tmp_path):
    hills = build_world(WorldConfig(size_m=200.0, trees_per_ha=0.0))
    png, heightmap = write_heightmap(hills.terrain)
    file = tmp_path / "heights.png"
    file.write_bytes(png)
    back = world_of(heightmap=heightmap.model_copy(update={"file": file}))
    assert back.config.size_m == 200.0
    assert np.abs(back.heights - hills.heights).max() < 1e-3


def test_a_png_without_scale_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(
        WorldError, match=r"^heightmap: a PNG has no scale of its own: metres_per_pixel and height_min_m"
    ):
        world_of(heightmap=Heightmap(file=ramp_png(tmp_path, np.uint8), height_max_m=3.0))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"height_max_m": -1.0}, "must be above height_min_m, 0, not -1"),
        ({"file": "missing.png"}, "no such file or directory"),
    ],
)
def test_what_a_heightmap_cannot_be_is_said(tmp_path, change, sentence):
    given = {"metres_per_pixel": 1.0, "height_min_m": 0.0, "height_max_m": 9.0, "file": ramp_png(tmp_path, np.uint8)}
    with pytest.raises(WorldError, match=sentence):
        world_of(heightmap=Heightmap(**given | change))


def test_a_colour_image_is_no_heightmap(tmp_path):
    file = save_png(tmp_path / "colours.png", np.zeros((8, 8, 3), np.uint8))
    with pytest.raises(WorldError, match="is no PNG of one channel with 8 or 16 bits"):
        world_of(heightmap=Heightmap(file=file, metres_per_pixel=1.0, height_min_m=0.0, height_max_m=9.0))


def test_a_geotiff_has_its_own_scale(tmp_path):
    rasterio = pytest.importorskip("rasterio", reason="GeoTIFF needs the extra 'geo', which is not installed")
    rows = np.linspace(620.0, 600.0, 21)[:, None] + np.zeros(21, np.float32)
    options = {"driver": "GTiff", "height": 21, "width": 21, "count": 1, "dtype": "float32"}
    place = rasterio.Affine(5.0, 0.0, 465_000.0, 0.0, -5.0, 5_249_000.0)
    for name, crs in (("utm", "EPSG:32632"), ("degrees", "EPSG:4326")):
        with rasterio.open(tmp_path / f"{name}.tif", "w", crs=crs, transform=place, **options) as target:
            target.write(rows.astype(np.float32), 1)
    world = world_of(heightmap=Heightmap(file=tmp_path / "utm.tif"))
    assert world.config.size_m == 100.0
    np.testing.assert_allclose(world.height([-50.0, 0.0, 50.0], 0.0), [-10.0, 0.0, 10.0], atol=1e-4)
    with pytest.raises(WorldError, match="must be in a projection in metres"):
        world_of(heightmap=Heightmap(file=tmp_path / "degrees.tif"))
    with pytest.raises(WorldError, match="metres_per_pixel: a GeoTIFF has its own scale: leave this key out"):
        world_of(heightmap=Heightmap(file=tmp_path / "utm.tif", metres_per_pixel=2.0))


def wedge(file):
    """3 long along x, 2 along y, 1 along z, its highest edge at the far end of x."""
    corners = [(0, 0, 0), (3, 0, 0), (3, 2, 0), (0, 2, 0), (3, 0, 1), (3, 2, 1)]
    trimesh.convex.convex_hull(np.array(corners, float)).export(file)
    return file


@pytest.mark.parametrize("kind", ["stl", "obj", "ply"])
def test_x_is_ahead_y_left_and_z_up(tmp_path, kind):
    file = wedge(tmp_path / f"wedge.{kind}")
    world = world_of(meshes=[MeshSolid(file=file, position_ned_m=(10.0, 20.0, -1.0), scale=2.0)])
    vertices = world.solids.vertices_ned
    np.testing.assert_allclose(vertices.min(axis=0), (10.0, 16.0, -3.0), atol=1e-5)
    np.testing.assert_allclose(vertices.max(axis=0), (16.0, 20.0, -1.0), atol=1e-5)
    assert world.surface(15.9, 18.0) == pytest.approx(1.0 + 2.0 * 5.9 / 6.0, abs=1e-4)


def test_heading_turns_clockwise_and_two_numbers_stand_on_the_ground(tmp_path):
    file = wedge(tmp_path / "wedge.stl")
    world = world_of(meshes=[MeshSolid(file=file, position_ned_m=(50.0, 0.0), heading_deg=90.0)], hill_height_m=5.0)
    ground = float(world.height(50.0, 0.0))
    vertices = world.solids.vertices_ned
    np.testing.assert_allclose(vertices.min(axis=0), (50.0, 0.0, -ground - 1.0), atol=1e-5)
    np.testing.assert_allclose(vertices.max(axis=0), (52.0, 3.0, -ground), atol=1e-5)


def test_gltf_has_y_up_and_its_own_colours(tmp_path):
    mesh = trimesh.creation.box((1.0, 2.0, 3.0))  # x, y up, z ahead
    mesh.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(baseColorFactor=[200, 40, 10, 255])
    )
    mesh.export(tmp_path / "box.glb")
    world = world_of(meshes=[MeshSolid(file=tmp_path / "box.glb", position_ned_m=(0.0, 0.0, -5.0))])
    np.testing.assert_allclose(np.ptp(world.solids.vertices_ned, axis=0), (3.0, 1.0, 2.0), atol=1e-5)
    assert world.solids.parts[0].rgb == (200, 40, 10)
    painted = world_of(meshes=[MeshSolid(file=tmp_path / "box.glb", colour="#0000ff")])
    assert painted.solids.parts[0].rgb == (0, 0, 255)


def test_a_mesh_with_holes_is_refused_unless_surfaces_are_meant(tmp_path):
    mesh = trimesh.load_mesh(lump(tmp_path))
    mesh.update_faces(np.arange(len(mesh.faces)) > 3)
    mesh.export(tmp_path / "holed.stl")
    with pytest.raises(
        WorldError, match=r"meshes\[0\].file: .*holed.stl has holes \(\d+ open edges\): close them, or say"
    ):
        world_of(meshes=[MeshSolid(file=tmp_path / "holed.stl")])
    world = world_of(meshes=[MeshSolid(file=tmp_path / "holed.stl", thin=True)])
    assert len(world.solids.faces) == len(mesh.faces)


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("a.stl", b"no mesh", "cannot be read as stl|has 0 triangles"),
        ("a.step", b"", "must be one of .stl, .obj, .ply, .gltf, .glb"),
        ("a.obj", b"v 0 0 0\n", "cannot be read as obj|has 0 triangles"),
    ],
)
def test_what_is_no_mesh_is_said(tmp_path, name, content, sentence):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(WorldError, match=sentence):
        world_of(meshes=[MeshSolid(file=tmp_path / name)])


def test_a_scale_that_makes_a_continent_is_refused(tmp_path):
    with pytest.raises(WorldError, match=r"meshes\[0\].scale: .* reaches .* m far, at most 20000"):
        world_of(meshes=[MeshSolid(file=lump(tmp_path), scale=1.0e5)])


def test_an_image_lies_on_the_top_of_a_pad_and_its_upper_edge_points_along_the_heading(tmp_path):
    from sim.sensors.camera import CameraPose, Renderer

    image = np.zeros((8, 8, 3), np.uint8)
    image[:4] = (0, 0, 255)  # OpenCV's red: the upper half
    file = save_png(tmp_path / "half.png", image)
    world = world_of(pads=[PadSolid(position_ned_m=(0.0, 0.0), radius_m=2.0, heading_deg=90.0, texture=file)])
    down = (0.0, 0.0, 0.7071068, 0.7071068)  # looks down, north up in the image
    rgb = Renderer(world).images([CameraPose((0.0, 0.0, -6.0), down, 40.0)], 40, 40).rgb[0].astype(int)
    assert rgb[20, 30, 0] > 100 > rgb[20, 30, 1]  # the eastern half is red
    assert rgb[20, 10].max() < 60


@pytest.mark.parametrize(
    "given",
    [
        {"boxes": [{"position_ned_m": (0.0,), "size_m": (1.0, 1.0, 1.0)}]},
        {"boxes": [{"position_ned_m": (0.0, 0.0), "size_m": (1.0, 0.0, 1.0)}]},
        {"boxes": [{"position_ned_m": (0.0, float("nan")), "size_m": (1.0, 1.0, 1.0)}]},
        {"boxes": [{"position_ned_m": (0.0, 0.0), "size_m": (1.0, 1.0, 1.0), "colour": "red"}]},
        {"walls": [{"points_ne_m": ((0.0, 0.0),), "height_m": 1.0}]},
        {"walls": [{"points_ne_m": ((0.0, 0.0), (0.0, 0.0)), "height_m": 1.0}]},
        {"wall_count": 3},
        {"heightmap": {"file": "a.png"}, "hill_height_m": 3.0},
        {"house": []},
    ],
)
def test_what_makes_no_sense_is_refused(given):
    with pytest.raises(ValidationError):
        WorldFile(**given)


def test_a_world_file_is_the_same_after_its_way_through_json():
    """So a flight's log holds it, and a replay shows it."""
    from mission.flight_config import FlightConfig

    file = WorldFile(
        boxes=[BoxSolid(position_ned_m=(1.0, 2.0), size_m=(1.0, 1.0, 1.0))],
        walls=[WallSolid(points_ne_m=((0.0, 0.0), (5.0, 0.0)), height_m=1.0)],
    )
    for world in (file, WorldFile(), WorldConfig(seed=4)):
        config = FlightConfig(world=world)
        back = FlightConfig.model_validate_json(config.model_dump_json()).world
        assert (type(back), back) == (type(world), world)
