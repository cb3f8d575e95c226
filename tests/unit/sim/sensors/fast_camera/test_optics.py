import cv2
import numpy as np
import pytest

from sim.sensors.fast_camera.fast_camera import QuickCamera
from sim.sensors.ray import GROUND, SKY
from sim.world.world import WorldConfig, build_world

WORLD = build_world(WorldConfig(size_m=128.0, clearing_blend_m=20.0, trees_per_ha=60.0))


def rendered(count=1, turn=(0.5, 0.5, 0.5, 0.5), **optics):
    """Images of cameras that look north from 3 m above home, each with these optics."""
    camera = QuickCamera(WORLD, count, has_optics=True)
    lenses, rows = camera.lenses.numpy(), camera.optics.numpy()
    lenses["pos_ned"] = (0.0, 0.0, -3.0)
    lenses["q_ned_from_rdf"] = turn
    for name, value in optics.items():
        rows[name] = value
    camera.render()
    return camera


def perfect():
    camera = QuickCamera(WORLD, 1)
    camera.lenses.numpy()["pos_ned"] = (0.0, 0.0, -3.0)
    camera.render()
    return camera


def test_optics_of_zero_change_nothing():
    spoilt, clear = rendered(), perfect()
    assert (spoilt.rgb.numpy() == clear.rgb.numpy()).all()
    assert (spoilt.depth_m.numpy() == clear.depth_m.numpy()).all()


def test_noise_has_its_variance_and_the_sky_keeps_its_depth():
    spoilt, clear = rendered(64, read_std=3.0, shot_std=6.0, depth_std_fraction=0.02, seed=np.arange(64)), perfect()
    level = clear.rgb.numpy()[0].astype(float)
    errors = spoilt.rgb.numpy() - level
    is_inside = (level > 25.0) & (level < 230.0)  # of what 8 bits hold
    expected = np.sqrt(9.0 + 36.0 * level / 255.0)
    assert (errors.std(axis=0) / expected)[is_inside].mean() == pytest.approx(1.0, abs=0.02)
    assert abs(errors.mean(axis=0)[is_inside].mean()) < 0.1
    is_sky = clear.kind.numpy()[0] == SKY
    fractions = spoilt.depth_m.numpy() / clear.depth_m.numpy()[0] - 1.0
    assert fractions[:, ~is_sky].std() == pytest.approx(0.02, rel=0.02)
    assert (fractions[:, is_sky] == 0.0).all()


def test_noise_is_named_by_seed_and_tick_whoever_else_is_there():
    noise = {"read_std": 3.0, "depth_std_fraction": 0.02}
    many = rendered(3, seed=[5, 6, 5], tick=[7, 7, 8], **noise)
    alone = rendered(1, seed=6, tick=7, **noise)
    assert (many.rgb.numpy()[1] == alone.rgb.numpy()[0]).all()
    assert (many.depth_m.numpy()[1] == alone.depth_m.numpy()[0]).all()
    assert (many.rgb.numpy()[0] != many.rgb.numpy()[1]).mean() > 0.5
    assert (many.rgb.numpy()[0] != many.rgb.numpy()[2]).mean() > 0.5


def test_a_turning_camera_smears_along_its_rows():
    yawing = rendered(shutter_s=0.02, rate_rdf=(0.0, 4.0, 0.0)).rgb.numpy()[0].astype(float)
    clear = perfect().rgb.numpy()[0].astype(float)
    columns, rows = np.abs(np.diff(yawing, axis=1)).mean(), np.abs(np.diff(yawing, axis=0)).mean()
    assert columns < 0.7 * np.abs(np.diff(clear, axis=1)).mean()
    assert rows > 0.7 * np.abs(np.diff(clear, axis=0)).mean()
    assert yawing.mean() == pytest.approx(clear.mean(), abs=1.0)


def test_what_is_near_is_smeared_by_flight_and_the_sky_is_not():
    climbing = rendered(shutter_s=0.02, vel_rdf=(0.0, -20.0, 0.0))
    clear = perfect()
    change = np.abs(climbing.rgb.numpy()[0].astype(float) - clear.rgb.numpy()[0]).mean(axis=-1)
    kind, depth = clear.kind.numpy()[0], clear.depth_m.numpy()[0]
    assert change[(kind == GROUND) & (depth < 6.0)].mean() > 2.0
    assert change[kind == SKY].max() <= 1.0


@pytest.mark.parametrize("distortion", [-0.1, 0.1])
def test_a_lens_that_bends_lines_shows_what_opencv_makes_of_the_perfect_image(distortion):
    bent, clear = rendered(distortion=distortion), perfect()
    rgb, depth_m = clear.rgb.numpy()[0], clear.depth_m.numpy()[0]
    half = 0.5 * rgb.shape[0]
    v, u = (np.indices(rgb.shape[:2], dtype=np.float32) - (half - 0.5)) / half
    bends = (1.0 + distortion * (u * u + v * v)) / (1.0 + distortion) * half
    maps = [(axis * bends + half - 0.5).astype(np.float32) for axis in (u, v)]
    edge = cv2.BORDER_REPLICATE
    shown = cv2.remap(rgb, *maps, cv2.INTER_LINEAR, borderMode=edge)
    near = cv2.remap(depth_m, *maps, cv2.INTER_NEAREST, borderMode=edge)
    assert np.abs(bent.rgb.numpy()[0].astype(int) - shown).max() <= 8  # its weights are of 5 bits
    assert (bent.depth_m.numpy()[0] == near).mean() > 0.99
    assert (bent.depth_m.numpy()[0] != depth_m).mean() > 0.2


def test_a_barrel_shows_what_is_between_middle_and_edge_farther_out_and_the_edge_as_it_is():
    clear, barrel = perfect().depth_m.numpy()[0], rendered(distortion=0.15).depth_m.numpy()[0]
    size = len(clear)
    for row in (0, size - 1):  # the middles of the upper and the lower edge
        assert barrel[row, size // 2] == pytest.approx(clear[row, size // 2], rel=0.05)
    horizon = [int(np.argmax(image[:, size // 2] < 1e3)) for image in (clear, barrel)]  # a little above the middle
    assert horizon[1] <= horizon[0]
