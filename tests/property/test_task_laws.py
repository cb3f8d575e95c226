"""Laws of every learning task: what no preset, seed or order of its rows may break."""

from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from policies.tasks.catalogue import CATALOGUE, build_task, settings_class, task_settings
from policies.tasks.parking.level1 import Parking1
from policies.tasks.parking.level2 import Parking2
from policies.tasks.parking.parking_params import CarParams, Level1Params, Level2Params
from policies.tasks.reach_target.reach_target import ReachTarget
from policies.tasks.reach_target.reach_target_params import ReachParams
from policies.tasks.roller_ball import RollerBall, RollerBallParams
from policies.tasks.task_params import Sampler

FEW = settings(max_examples=5, deadline=None)  # the first example compiles a kernel
TASKS = [
    (name, preset)
    for name in CATALOGUE
    for preset in (
        ("as-coded",) if name == "RollerBall" else get_args(settings_class(name).model_fields["preset"].annotation)
    )
]
every_task = pytest.mark.parametrize(("name", "preset"), TASKS)
FLOWN = {"FollowMe", "Hover", "Navigate", "NavigateRover", "Drive"}  # the noise of a rig's sensors is keyed by the row
SMALL = {"FollowMe": {"image_size": 16}}  # the laws hold for any size; large pictures take most of the time
seeds = st.integers(0, 2**31 - 1)
STRUCTS = {
    RollerBall: (RollerBallParams,),
    ReachTarget: (ReachParams,),
    Parking1: (CarParams, Level1Params),
    Parking2: (CarParams, Level2Params),
}


def built(name, preset, env_count, seed=0, **more):
    task = build_task(name, env_count, task_settings(name, {"preset": preset, **SMALL.get(name, {}), **more}))
    task.reset(seed)
    return task


def act(task, rng, rows=None):
    """One step; the actions of `rows` (all rows) are drawn for the largest batch, so that a row's are its own."""
    rows = np.arange(task.env_count) if rows is None else rows
    layout = task.layout
    pushed = rng.uniform(-1.0, 1.0, (64, len(layout.continuous)))
    chosen = rng.integers(np.array(layout.branch_sizes, dtype=int), size=(64, len(layout.branches)))
    task.buffers.continuous.assign(pushed[rows].astype(np.float32))
    task.buffers.branches.assign(chosen[rows].astype(np.int32))
    task.step()


def is_same(one, other):
    """Whether two arrays of numbers or structs hold the same values; NaN is one, and padding is none."""
    if one.dtype.names:
        return all(is_same(one[field], other[field]) for field in one.dtype.names)
    return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")


def driven(task, seed, step_count=40):
    """What the rows saw and were paid, (steps, rows, elements + 1)."""
    task.reset(seed)
    rng = np.random.default_rng(seed)
    observation = []
    for _ in range(step_count):
        act(task, rng)
        observation.append(np.column_stack([task.buffers.observations.numpy(), task.buffers.rewards.numpy()]))
    return np.array(observation)


@every_task
def test_the_same_seed_gives_the_same_bytes_and_a_row_is_its_own(name, preset):
    one, other, single = built(name, preset, 24), built(name, preset, 24), built(name, preset, 1)

    @given(seed=seeds)
    @FEW
    def of_any_seed(seed):
        many = driven(one, seed)
        assert many.tobytes() == driven(other, seed).tobytes()
        assert many[:, :1].tobytes() == driven(single, seed).tobytes()
        assert preset != "improved" or not np.array_equal(many[0], driven(other, seed + 1, 1)[0])

    of_any_seed()


@pytest.mark.parametrize(("name", "preset"), [(name, preset) for name, preset in TASKS if name not in FLOWN])
def test_permuted_rows_do_permuted_things(name, preset):
    task, other = built(name, preset, 24), built(name, preset, 24)
    order = np.random.default_rng(1).permutation(24)
    state = task.state()
    other.load_state({key: rows[order] if len(rows) == 24 else rows for key, rows in state.items()})
    rng, other_rng = np.random.default_rng(2), np.random.default_rng(2)
    for _ in range(15):
        act(task, rng)
        act(other, other_rng, order)
    is_same_episode = task.buffers.episodes.numpy() == state["episodes"]  # what is drawn afterwards is keyed by the row
    assert is_same_episode.any()
    for array in ("observations", "returns", "steps"):
        there, here = getattr(task.buffers, array).numpy()[order], getattr(other.buffers, array).numpy()
        assert np.array_equal(there[is_same_episode[order]], here[is_same_episode[order]]), array


def renamed(rows):
    """Saved rows as a version would have saved them that called every field of a struct otherwise."""

    def of(dtype):
        if dtype.names is None:
            return dtype
        parts = [dtype.fields[name] for name in dtype.names]
        names = [f"{name}_before" for name in dtype.names]
        formats, offsets = [of(part[0]) for part in parts], [part[1] for part in parts]
        return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": dtype.itemsize})

    return rows.view(of(rows.dtype))


@every_task
def test_a_restored_task_continues_bit_for_bit_and_what_ran_before_a_reset_does_not_matter(name, preset):
    task = built(name, preset, 8, 3)
    fresh = task.state()
    act(task, np.random.default_rng(0))
    state = task.state()
    ends = []
    for saved in (state, {name: renamed(rows) for name, rows in state.items()}):  # fields have other names since
        task.load_state(saved)
        rng = np.random.default_rng(1)
        for _ in range(40):
            act(task, rng)
        ends.append(task.state())
    assert [key for key in ends[0] if not is_same(ends[0][key], ends[1][key])] == []
    task.reset(3)
    again = task.state()
    of_the_past = {"continuous", "branches", "final_observations", "measures"}
    assert [key for key in fresh if key not in of_the_past and not is_same(fresh[key], again[key])] == []


@every_task
def test_beginning_one_row_touches_only_that_row(name, preset):
    task = built(name, preset, 4)
    before = task.state()
    task.begin(np.array([False, True, False, False]))
    after = task.state()
    assert after["episodes"].tolist() == [1, 2, 1, 1]
    others = [0, 2, 3]
    for key in before.keys() - {"is_starting", "is_growing"}:  # which rows begin
        assert len(before[key]) != 4 or is_same(before[key][others], after[key][others]), key


@pytest.mark.parametrize("task", STRUCTS, ids=lambda task: task.__name__)
def test_numbers_are_declared_in_the_order_of_their_structs_and_start_within_their_bounds(task):
    names = [name for struct in STRUCTS[task] for name in struct.vars]
    assert [number.name for number in task.params] == names
    for number in task.params:
        assert number.minimum <= number.default <= number.maximum
        assert number.meaning
        assert number.source


def around(number, value):
    """Even within half of the value to both sides, as far as the bounds allow."""
    low, high = value - 0.5 * abs(value), value + 0.5 * abs(value)
    return Sampler(intervals=((max(number.minimum, low), min(number.maximum, high)),))


def anywhere(number, _value):
    return Sampler(intervals=((number.minimum, number.maximum),))


@every_task
@pytest.mark.parametrize("spread", [around, anywhere])
def test_every_number_may_be_randomised_at_once_and_nothing_becomes_infinite(name, preset, spread):
    task = built(name, preset, 64)
    declared = task.param_table.declarations
    values = dict(zip(declared, task.buffers.params.numpy()[0].tolist(), strict=True))
    task.set_params({key: spread(declared[key], values[key]) for key in declared if key != "step_limit"})
    task.reset(0)
    rng = np.random.default_rng(0)
    for _ in range(200):
        act(task, rng)
        for array in (task.buffers.observations, task.buffers.final_observations, task.buffers.rewards):
            assert np.isfinite(array.numpy()).all()


@given(x=st.floats(-40.0, 40.0), z=st.floats(-40.0, 40.0), yaw=st.floats(-3.0, 3.0), seed=seeds)
@FEW
def test_a_mirrored_reach_target_is_seen_and_paid_mirrored(x, z, yaw, seed):
    task = built("ReachTarget", "improved", 2)
    rng = np.random.default_rng(seed)
    goal_x, goal_z, goal_yaw = rng.uniform([-40.0, -40.0, -3.0], [40.0, 40.0, 3.0])
    for row, side in enumerate((1.0, -1.0)):
        task.world.pos.numpy()[row] = (side * x, 0.86, z)
        task.world.q.numpy()[row] = (0.0, np.sin(side * yaw / 2), 0.0, np.cos(yaw / 2))
        task.world.target.numpy()[row] = (side * goal_x, 0.5, goal_z)
        task.world.target_yaw.numpy()[row] = side * goal_yaw
    names = [element.name for element in task.layout.frame]
    flipped = ("goal_bearing_sin", "vel_car_x", "yaw_rate", "goal_heading_sin", "steering")
    partners = {"edge_right": "edge_left", "edge_left": "edge_right"}
    columns = [names.index(partners.get(name, name)) for name in names]
    signs = np.array([-1.0 if name in flipped else 1.0 for name in names])
    for _ in range(10):
        steer, throttle, brake = rng.uniform(-1.0, 1.0, 3)
        task.buffers.continuous.numpy()[:] = [(steer, throttle, brake), (-steer, throttle, brake)]
        task.step()
        if task.buffers.outcomes.numpy().any():
            return
        one, other = task.buffers.observations.numpy()
        assert other == pytest.approx(signs * one[columns], abs=2e-3)
        assert task.buffers.rewards.numpy()[0] == pytest.approx(task.buffers.rewards.numpy()[1], abs=1e-3)
