"""Others about in training: solid to critics, to a policy's map where images showed them, and kept off by the rule."""

from typing import Any

import numpy as np
import pytest
import warp as wp

from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.flight.hover_bank import build_rig
from policies.tasks.flight.own_state import Command, OwnState
from policies.tasks.flight.ranges import RANGE_M, RANGES, SECTORS, measure_ranges
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.follow_me_kernels import MEASURES
from policies.tasks.follow_me.follow_me_params import PARAMS, FollowParams
from policies.tasks.follow_me.others import kept_from_others, mark_others, room_between, see_others
from policies.tasks.follow_me.tracked.keep_off import KeepOff, keep_off
from policies.tasks.follow_me.tracked.sight_model import Tracked, make_tracked
from sim.truth import Truth
from sim.world.batch import WorldBatch
from sim.world.people import STATURE_M, Person
from sim.world.world import WorldConfig

AHEAD, RIGHT, BEHIND, BELOW, NOBODY = range(5)
COUNT = 5
FAR_M, YAW = 1.6, 2.2
BODY_M = 0.25
BEARINGS = YAW + np.radians([0.0, 90.0, 180.0, 0.0, 0.0])
UNITS = np.stack([np.cos(BEARINGS), np.sin(BEARINGS)], -1)
WALK_M_S = 1.0


@wp.kernel
def near_others(
    own: wp.array(dtype=OwnState),
    truth: wp.array(dtype=Truth),
    drawn: wp.array2d(dtype=Person),
    tracked: Tracked,
    k: KeepOff,
    commands: wp.array(dtype=Command),
    rooms_m: wp.array(dtype=float),
) -> None:
    i = wp.tid()
    commands[i] = kept_from_others(commands[i], own[i], truth[i], drawn, tracked, 0.1, k, i)
    rooms_m[i] = room_between(truth[i].pos_ned, drawn[i, 1])


@pytest.fixture
def rig() -> Any:
    """Five vehicles over a bare plain, all with the same heading."""
    worlds = WorldBatch(WorldConfig(size_m=128.0, hill_height_m=0.0, trees_per_ha=0.0), COUNT)
    worlds.grow_all(3)
    rig = build_rig(worlds, COUNT, has_estimator=False, threads=1, device="cpu")
    body = rig.rows["truth"]
    body["q_ned_from_frd"] = (0.0, 0.0, np.sin(0.5 * YAW), np.cos(0.5 * YAW))
    body["pos_ned"] = (3.0, -4.0, -1.6)
    body["pos_ned"][BELOW, 2] = -STATURE_M - 1.0
    return rig


@pytest.fixture
def drawn(rig: Any) -> Any:
    """Of each no owner, and one other at the same distance, who walks to the right of the line of sight."""
    people = wp.zeros((COUNT, 4), dtype=Person)
    rows = people.numpy()[:, 1]
    rows["pos_ned"][:, :2] = rig.rows["truth"]["pos_ned"][:, :2] + FAR_M * UNITS
    rows["vel_ned"][:, :2] = WALK_M_S * np.stack([-UNITS[:, 1], UNITS[:, 0]], -1)
    rows["stature_m"] = np.where(np.arange(COUNT) == NOBODY, 0.0, STATURE_M)
    return people


@pytest.fixture
def tracked() -> Any:
    tracked = make_tracked(lambda _, shape, dtype: wp.zeros(shape, dtype=dtype), COUNT)
    tracked.has_depth.fill_(1)
    return tracked


@pytest.fixture
def params() -> Any:
    rows = wp.zeros(COUNT, dtype=FollowParams)
    for number in PARAMS:
        if number.name in rows.numpy().dtype.names:
            rows.numpy()[number.name] = number.default
    return rows


EVERYONE = np.ones(COUNT, bool)


def _near_m(nearness: Any) -> Any:
    return float(RANGE_M) * (1.0 - nearness.numpy()[:, :SECTORS])


def test_ranges_of_critics_tell_who_stands_in_the_height_of_the_vehicle(rig: Any, drawn: Any) -> None:
    out, everyone = wp.zeros((COUNT, RANGES), dtype=float), wp.array(EVERYONE, dtype=wp.bool)
    wp.launch(measure_ranges, COUNT, [rig.arrays, everyone, out])
    wp.launch(mark_others, COUNT, [rig.arrays, drawn, everyone, out])
    near_m = _near_m(out)
    for who, sector in ((AHEAD, 0), (RIGHT, SECTORS // 4), (BEHIND, SECTORS // 2)):
        assert near_m[who, sector] == pytest.approx(FAR_M - BODY_M, abs=0.02)
        assert (near_m[who] < RANGE_M).sum() <= 3  # half a metre at 1.6 m: 18 degrees
        bearing = 2.0 * np.pi * sector / SECTORS
        pointed = out.numpy()[who, SECTORS + 2 :] / out.numpy()[who, sector]
        assert pointed == pytest.approx([np.cos(bearing), np.sin(bearing)], abs=1e-3)
    for who in (BELOW, NOBODY):
        assert (near_m[who] >= RANGE_M - 1e-3).all()


def _see(rig: Any, params: Any, drawn: Any, tracked: Any, *, is_first: bool = False) -> Any:
    tracked.nearness.zero_()
    rows = wp.array(EVERYONE, dtype=wp.bool)
    wp.launch(see_others, COUNT, [rig.arrays, params, drawn, tracked, int(is_first), rows])
    return _near_m(tracked.nearness)


def test_a_map_knows_whom_an_image_showed_and_keeps_them_until_it_shows_the_place_without(
    rig: Any, params: Any, drawn: Any, tracked: Any
) -> None:
    near_m = _see(rig, params, drawn, tracked, is_first=True)
    assert near_m[AHEAD, 0] == pytest.approx(FAR_M - BODY_M, abs=0.02)
    assert (np.delete(near_m, AHEAD, axis=0) >= RANGE_M - 1e-3).all()
    turned = YAW + np.pi
    rig.rows["truth"]["q_ned_from_frd"] = (0.0, 0.0, np.sin(0.5 * turned), np.cos(0.5 * turned))
    drawn.numpy()[AHEAD, 1]["pos_ned"][:2] -= 2.0 * FAR_M * UNITS[AHEAD]  # comes round it
    near_m = _see(rig, params, drawn, tracked)
    assert near_m[AHEAD, 0] == pytest.approx(FAR_M - BODY_M, abs=0.02)  # seen where they are now
    assert near_m[AHEAD, SECTORS // 2] >= RANGE_M - 1e-3  # and no more where they were
    assert near_m[BEHIND, 0] == pytest.approx(FAR_M - BODY_M, abs=0.02)
    drawn.numpy()[:, 1]["pos_ned"][:, :2] += 20.0  # all have gone, and the place is looked at
    assert (_see(rig, params, drawn, tracked) >= RANGE_M - 1e-3).all()


def test_a_map_keeps_the_last_place_of_who_is_out_of_the_image(rig: Any, params: Any, drawn: Any, tracked: Any) -> None:
    _see(rig, params, drawn, tracked, is_first=True)
    aside = YAW + np.pi / 2.0
    rig.rows["truth"]["q_ned_from_frd"] = (0.0, 0.0, np.sin(0.5 * aside), np.cos(0.5 * aside))
    for _ in range(20):
        near_m = _see(rig, params, drawn, tracked)
    assert near_m[AHEAD, -SECTORS // 4] == pytest.approx(FAR_M - BODY_M, abs=0.02)
    for _ in range(140):
        near_m = _see(rig, params, drawn, tracked)
    assert near_m[AHEAD].min() >= RANGE_M - 1e-3


def test_without_depth_others_are_on_no_map(rig: Any, params: Any, drawn: Any, tracked: Any) -> None:
    params.numpy()["depth_max_m"] = 0.5
    assert (_see(rig, params, drawn, tracked, is_first=True) >= RANGE_M - 1e-3).all()
    assert tracked.others_age_s.numpy()[AHEAD, 0] == 0.0


def test_who_stands_behind_the_owner_is_not_seen(rig: Any, params: Any, drawn: Any, tracked: Any) -> None:
    rows = drawn.numpy()
    rows[AHEAD, 0]["pos_ned"][:2] = rig.rows["truth"]["pos_ned"][AHEAD, :2] + 0.5 * FAR_M * UNITS[AHEAD]
    rows[AHEAD, 0]["stature_m"] = STATURE_M
    assert (_see(rig, params, drawn, tracked, is_first=True) >= RANGE_M - 1e-3).all()


def _towards(rig: Any, drawn: Any, tracked: Any) -> Any:
    """What is left of 3 m/s towards each one's other."""
    own, commands, rooms_m = wp.zeros(COUNT, dtype=OwnState), wp.zeros(COUNT, dtype=Command), wp.zeros(COUNT)
    commands.numpy()["vel_ned"][:, :2] = 3.0 * UNITS
    inputs = [own, rig.arrays.truth, drawn, tracked, keep_off(), commands, rooms_m]
    wp.launch(near_others, COUNT, inputs)
    return np.sum(commands.numpy()["vel_ned"][:, :2] * UNITS, axis=1)


def test_nobody_who_walks_and_was_seen_lately_is_flown_at(rig: Any, drawn: Any, tracked: Any) -> None:
    kept = _towards(rig, drawn, tracked)
    assert (kept[[AHEAD, RIGHT, BEHIND]] < 1.0).all()
    assert kept[NOBODY] == pytest.approx(3.0)
    tracked.others_age_s.fill_(1.0)
    assert _towards(rig, drawn, tracked) == pytest.approx(3.0)


def test_who_stands_is_the_maps_matter_where_there_is_depth(rig: Any, drawn: Any, tracked: Any) -> None:
    drawn.numpy()["vel_ned"] = 0.0
    assert _towards(rig, drawn, tracked) == pytest.approx(3.0)
    tracked.has_depth.zero_()
    assert (_towards(rig, drawn, tracked)[[AHEAD, RIGHT, BEHIND]] < 1.0).all()


def _task(**params: float) -> FollowMe:
    settings = {"observation": "tracked", "has_estimator": "false", "terrain": "kept"}
    task = build_task("FollowMe", 32, task_settings("FollowMe", settings))
    assert isinstance(task, FollowMe)
    task.set_params({"bystanders": 3.0, "trees_per_ha": 0.0, "image_lag_s": 0.0} | params)
    task.reset(5)
    return task


def test_an_episode_charges_for_room_to_others_and_shows_them_to_its_critic() -> None:
    task = _task()
    for _ in range(5):
        task.step()
    truth, people = task.rig.arrays.truth.numpy(), task.follow.drawn.numpy()[:, 1:]
    off = people["pos_ned"] - truth["pos_ned"][:, None]
    off[..., 2] -= np.clip(off[..., 2], 0.0, people["stature_m"])  # to the nearest part of a body
    nearest_m = np.linalg.norm(off, axis=-1).min(axis=1) - BODY_M
    room_m = task.measures.numpy()[:, MEASURES.index("room_m")]
    assert (room_m <= np.minimum(nearest_m, 2.0) + 0.01).all()
    assert (nearest_m < 1.9).sum() > 3
    is_low = np.abs(off[..., 2]).min(axis=1) == 0.0
    level_m = np.hypot(off[..., 0], off[..., 1]).min(axis=1)
    shown_m = _near_m(task.follow.nearness).min(axis=1)
    assert (shown_m[is_low] <= level_m[is_low] - BODY_M + 0.01).all()


def test_the_rule_bounds_what_an_episode_flies_near_others_if_there_is_a_guard() -> None:
    flown = []
    for guard in (0.0, 1.0):
        task = _task(guard=guard, start_distance_min_m=8.0, start_distance_max_m=8.0)
        task.buffers.continuous.assign(np.tile(np.array([0.9, 0.0, 0.0, 0.0], np.float32), (32, 1)))
        for _ in range(10):
            task.step()
        flown.append(np.linalg.norm(task.follow.tracked.commands.numpy()["vel_ned"], axis=1))
    assert (flown[1] < 0.7 * flown[0]).sum() > 1
