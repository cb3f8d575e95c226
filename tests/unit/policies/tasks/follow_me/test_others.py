"""Others about in training: solid to ranges, taking room, kept off by the guard's rule where an image shows them."""

from typing import Any

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray

from policies.tasks.flight.hover_bank import build_rig
from policies.tasks.flight.own_state import Command, OwnState
from policies.tasks.flight.ranges import RANGE_M, RANGES, SECTORS, measure_ranges
from policies.tasks.follow_me.others import kept_from_others, mark_others, room_between
from policies.tasks.follow_me.tracked.keep_off import KeepOff, keep_off
from sim.truth import Truth
from sim.world.batch import WorldBatch
from sim.world.people import STATURE_M, Person
from sim.world.world import WorldConfig

AHEAD, RIGHT, BEHIND, BELOW, NOBODY = range(5)
COUNT = 5
FAR_M, YAW = 1.6, 2.2
BODY_M = 0.25


@wp.kernel
def near_others(
    own: wp.array(dtype=OwnState),
    truth: wp.array(dtype=Truth),
    others: wp.array2d(dtype=Person),
    k: KeepOff,
    commands: wp.array(dtype=Command),
    rooms_m: wp.array(dtype=float),
) -> None:
    i = wp.tid()
    commands[i] = kept_from_others(commands[i], own[i], truth[i], others, 0.1, k, i)
    rooms_m[i] = room_between(truth[i].pos_ned, others[i, 0])


@pytest.fixture(scope="module")
def rig() -> Any:
    """Five vehicles over a bare plain, heading anywhere; of each its one other, at the same distance."""
    worlds = WorldBatch(WorldConfig(size_m=128.0, hill_height_m=0.0, trees_per_ha=0.0), COUNT)
    worlds.grow_all(3)
    rig = build_rig(worlds, COUNT, has_estimator=False, threads=1, device="cpu")
    body = rig.rows["truth"]
    body["q_ned_from_frd"] = (0.0, 0.0, np.sin(0.5 * YAW), np.cos(0.5 * YAW))
    body["pos_ned"] = (3.0, -4.0, -1.6)
    body["pos_ned"][BELOW, 2] = -STATURE_M - 1.0
    return rig


@pytest.fixture(scope="module")
def others(rig: Any) -> Any:
    people = wp.zeros((COUNT, 1), dtype=Person)
    rows = people.numpy()[:, 0]
    way = YAW + np.radians([0.0, 90.0, 180.0, 0.0, 0.0])
    rows["pos_ned"][:, :2] = rig.rows["truth"]["pos_ned"][:, :2] + FAR_M * np.stack([np.cos(way), np.sin(way)], -1)
    rows["stature_m"] = np.where(np.arange(COUNT) == NOBODY, 0.0, STATURE_M)
    return people


def _near_m(rig: Any, others: Any) -> NDArray[np.float32]:
    out, everyone = wp.zeros((COUNT, RANGES), dtype=float), wp.full(COUNT, value=True, dtype=wp.bool)
    wp.launch(measure_ranges, COUNT, [rig.arrays, everyone, out])
    wp.launch(mark_others, COUNT, [rig.arrays, others, everyone, out])
    return np.asarray(float(RANGE_M) * (1.0 - out.numpy()[:, :SECTORS]))


def test_ranges_tell_who_stands_in_the_height_of_the_vehicle(rig: Any, others: Any) -> None:
    near_m = _near_m(rig, others)
    for who, sector in ((AHEAD, 0), (RIGHT, SECTORS // 4), (BEHIND, SECTORS // 2)):
        assert near_m[who, sector] == pytest.approx(FAR_M - BODY_M, abs=0.02)
        assert (near_m[who] < RANGE_M).sum() <= 3  # half a metre at 1.6 m: 18 degrees
    for who in (BELOW, NOBODY):
        assert (near_m[who] >= RANGE_M - 1e-3).all()


def _flown(rig: Any, others: Any, vel_ned: NDArray[np.float64]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    own, commands, rooms_m = wp.zeros(COUNT, dtype=OwnState), wp.zeros(COUNT, dtype=Command), wp.zeros(COUNT)
    commands.numpy()["vel_ned"][:] = vel_ned
    wp.launch(near_others, COUNT, [own, rig.arrays.truth, others, keep_off(), commands, rooms_m])
    return commands.numpy()["vel_ned"].copy(), rooms_m.numpy().copy()


def test_nobody_in_the_image_is_flown_at_and_nothing_else_is_changed(rig: Any, others: Any) -> None:
    ahead = 3.0 * np.array([np.cos(YAW), np.sin(YAW), 0.0])
    flown, _ = _flown(rig, others, ahead)
    assert flown[AHEAD] @ ahead < 0.35 * ahead @ ahead
    for who in (RIGHT, BEHIND, NOBODY):
        assert np.allclose(flown[who], ahead)
    aside = 3.0 * np.array([-np.sin(YAW), np.cos(YAW), 0.0])
    assert np.allclose(_flown(rig, others, aside)[0][AHEAD], aside, atol=1e-4)


def test_room_is_to_the_side_of_a_body(rig: Any, others: Any) -> None:
    _, room_m = _flown(rig, others, np.zeros(3))
    assert room_m[:3] == pytest.approx([FAR_M - BODY_M] * 3, abs=0.02)
    assert room_m[BELOW] == pytest.approx(np.hypot(FAR_M, 1.0) - BODY_M, abs=0.02)
    assert room_m[NOBODY] == np.inf
