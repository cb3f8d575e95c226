"""What the page's scene is given: a trail that ends where its vehicle is, and a plan that a trail does not hide."""

import numpy as np
import pytest

from common.airframe import load_airframe
from mission.simulator.flight_rig import flight_world
from mission.view import shapes
from mission.view.page import PageServer
from mission.view.scene import PLAN_M, TRAIL_M, Scene
from sim.world.batch import grown_world
from sim.world.driving_worlds import COURSE
from tests.unit.mission.view.rows import CONFIG, hovering


@pytest.fixture
def server():
    server = PageServer(0, "Honeyguide")
    yield server
    server.stop()


def nodes(server):
    return server.scene._handle_from_node_name


def test_a_trail_ends_where_its_vehicle_is_also_between_its_points(server):
    scene = Scene(server, flight_world(CONFIG), load_airframe("x500"))
    recording = hovering(1.0)
    recording.rows["pos_ned"][:, 0] = np.linspace(0.0, 5.0, len(recording))
    for index in (0, 15, 20, 24):
        moment = recording.moment(index)
        scene.extend_trails(moment)
        scene.show(moment)
        assert nodes(server)["/trails/vehicle/head"].points[-1, -1] == pytest.approx(moment.pos_ned)
    assert nodes(server)["/trails/vehicle"].points[-1, -1] == pytest.approx(
        nodes(server)["/trails/vehicle/head"].points[0, 0]
    )


def test_a_plan_is_wider_than_the_track_that_covers_it(server):
    Scene(server, flight_world(CONFIG), load_airframe("x500"), path_ned=[(0.0, 0.0, -5.0), (5.0, 0.0, -5.0)])
    assert nodes(server)["/plan"].thickness == PLAN_M > 2.0 * TRAIL_M


def test_wheels_turn_by_what_they_have_rolled_and_only_front_ones_are_steered(server):
    scene = Scene(server, flight_world(CONFIG), load_airframe("rover"))
    recording = hovering(1.0)
    recording.rows["motor_speed"][:, :4] = 10.0
    recording.rows["steering_rad"] = 0.3
    for index in range(11):  # 0.2 s
        scene.show(recording.moment(index))
    front, rear = (np.roll(nodes(server)[f"/vehicle/wheel{i}"].wxyz, -1) for i in (1, 3))
    assert tuple(rear) == pytest.approx(shapes.wheel_attitude(2.0, 0.0), abs=1e-4)
    assert tuple(front) == pytest.approx(shapes.wheel_attitude(2.0, 0.3), abs=1e-4)


def test_boxes_that_run_to_and_fro_are_where_the_simulator_has_them(server):
    world = grown_world(COURSE.model_copy(update={"trees_per_ha": 0.0}), 3)
    scene = Scene(server, world, load_airframe("rover"))
    movers = np.flatnonzero(world.boxes.rows["period_ticks"])
    assert len(movers) > 0
    recording = hovering(1.0)
    for index in (0, 40):
        moment = recording.moment(index)
        scene.show(moment)
        for i in movers:
            expected = world.boxes.middle(round(moment.time_s * 250.0))[i]  # 4 ms each
            assert nodes(server)[f"/world/mover{i}"].position[:2] == pytest.approx(expected)


def test_rays_of_a_ring_end_at_what_it_sees_and_those_that_meet_nothing_are_not_drawn(server):
    scene = Scene(server, flight_world(CONFIG), load_airframe("rover"))
    moment = hovering(1.0).moment(0)
    ranges = np.full(72, np.inf)
    ranges[18] = 3.0  # to the right, which is east
    scene.draw_rays(moment, ranges.tolist())
    assert nodes(server)["/rays"].points[0, 1] == pytest.approx((0.0, 3.0, -1.4), abs=1e-5)
    assert len(nodes(server)["/rays"].points) == 1
    scene.draw_rays(moment, [np.inf] * 72)
    assert not nodes(server)["/rays"].visible
