import numpy as np
import pytest

from mission.view.box_painter import BoxPainter
from mission.view.chase_camera import looking
from mission.view.flight_snapshot import MOMENT
from mission.view.snapshot_images import Eye
from sim.world.batch import grown_world
from sim.world.driving_worlds import CAR_PARK

NOBODY = np.zeros((), MOMENT)["owner"]


@pytest.fixture(scope="module")
def world():
    return grown_world(CAR_PARK.model_copy(update={"seed": 1}), 1)


def seen(world, place, target, tick=0):
    """An image with its boxes, and the depths before and after they were drawn."""
    eye = Eye(world, 160, 120, 70.0)
    q_ned_from_rdf = looking(np.array(place), np.array(target))
    eye.look(place, q_ned_from_rdf, NOBODY)
    image, before_m = eye.rgb.copy(), eye.depth_m.copy()
    BoxPainter(world).draw(image, eye, tick, np.array(place), q_ned_from_rdf)
    return image, before_m, eye.depth_m


def test_a_box_is_drawn_where_a_ray_meets_it_and_as_far_away(world):
    for row in world.boxes.rows[:8]:
        target = np.array([row["north"], row["east"], -0.5 * (row["high"] + max(row["low"], 0.0))], float)
        place = target * np.array([0.2, 0.2, 0.0]) + np.array([0.0, 0.0, -1.5])
        _, before_m, after_m = seen(world, place, target)
        ray = (target - place) / np.linalg.norm(target - place)
        met_m = world.ray_hit(place, ray, 50.0)
        assert after_m[60, 80] == pytest.approx(met_m, abs=0.1)
        assert (after_m <= before_m).all()


def test_a_cart_is_drawn_where_it_is_at_the_time(world):
    movers = world.boxes.rows["period_ticks"] > 0
    far = world.boxes.middle(0)[movers].mean(axis=0)
    images = [seen(world, (0.0, 0.0, -2.0), (*far, 0.0), tick)[0].astype(int) for tick in (0, 0, 700)]
    assert (images[0] == images[1]).all()
    assert (np.abs(images[0] - images[2]).max(axis=2) > 40).sum() > 20


def test_what_stands_behind_the_eye_is_not_drawn(world):
    middle = world.boxes.middle().mean(axis=0)
    away = -20.0 * middle / np.linalg.norm(middle)
    _, before_m, after_m = seen(world, (0.0, 0.0, -1.0), (*away, -1.0))
    assert (before_m == after_m).all()
