import numpy as np
import pytest

from common.kernels import TICK_US
from sim.sensors.phone import DROPOUT_MAX_S, LAG_S, PERIOD_S, phone_model
from sim.walking_owner import Owner
from sim.world.people import PERSON_TICKS
from sim.world.world import WorldConfig, build_world

PHONES = 400
STEPS = 1500  # half a minute


@pytest.fixture(scope="module")
def plain():
    return build_world(WorldConfig(size_m=100.0, hill_height_m=0.0, trees_per_ha=0.0))


def record(world, phone, phones=PHONES, steps=STEPS, seed=4):
    """People and fixes at every step, shapes (steps, phones)."""
    owner = Owner(world, np.zeros((phones, 3)), seed, phone=phone)
    people = np.empty((steps, phones), dtype=owner.people.numpy().dtype)
    fixes = np.empty((steps, phones), dtype=owner.phones.numpy()["fix"].dtype)
    for k in range(steps):
        owner.step_to(PERSON_TICKS * k)
        people[k], fixes[k] = owner.people.numpy(), owner.phones.numpy()["fix"]
    return people, fixes


@pytest.fixture(scope="module")
def recorded(plain):
    return record(plain, phone_model())


def errors_of(people, fixes):
    """Errors of all new fixes: place (fixes, 3), velocity (fixes, 3)."""
    k, i = np.nonzero(fixes["is_new"])
    taken = fixes["time_us"][k, i] // (PERSON_TICKS * TICK_US)
    chest = people["pos_ned"][taken, i] - [0.0, 0.0, 1.0]
    return fixes["pos_ned"][k, i] - chest, fixes["vel_ned"][k, i] - people["vel_ned"][taken, i]


def test_fixes_come_late_by_the_lag_and_twice_a_second(recorded):
    _, fixes = recorded
    k, i = np.nonzero(fixes["is_new"])
    late_s = (k * PERSON_TICKS * TICK_US - fixes["time_us"][k, i]) * 1e-6
    np.testing.assert_allclose(late_s, LAG_S, atol=PERSON_TICKS * TICK_US * 1e-6)
    gaps = (
        np.concatenate([np.diff(fixes["time_us"][fixes["is_new"][:, row] == 1, row]) for row in range(PHONES)]) * 1e-6
    )
    assert np.median(gaps) == pytest.approx(PERIOD_S, abs=0.02)
    assert len(np.unique(k[k < PERIOD_S * 50 + 16])) > 10  # phones are not in step with each other


def test_errors_are_those_of_the_model_without_a_noise_scale_there_are_none(plain, recorded):
    pos, vel = errors_of(*recorded)
    np.testing.assert_allclose(pos.std(axis=0), np.hypot(1.5, 0.3) * np.array([1.0, 1.0, 2.0]), rtol=0.15)
    np.testing.assert_allclose(vel.std(axis=0), 0.2, rtol=0.05)
    pos, vel = errors_of(*record(plain, phone_model(error_scale=0.0), phones=4))
    assert np.abs(pos).max() < 1e-5
    assert np.abs(vel).max() < 1e-5


def test_position_error_drifts_over_a_minute(recorded):
    people, fixes = recorded
    first, later = [], []
    for row in range(PHONES):
        pos, _ = errors_of(people[:, row : row + 1], fixes[:, row : row + 1])
        first.append(pos[0, 0])
        later.append([pos[1, 0], pos[-1, 0]])
    soon, late = (np.corrcoef(first, np.array(later)[:, k])[0, 1] for k in (0, 1))
    assert soon > 0.9
    assert late == pytest.approx(np.exp(-29.0 / 60.0) * 0.96, abs=0.15)


def test_some_phones_are_silent_for_seconds_and_none_for_long(recorded):
    _, fixes = recorded
    longest = np.array(
        [np.diff(fixes["time_us"][fixes["is_new"][:, row] == 1, row]).max() * 1e-6 for row in range(PHONES)]
    )
    assert 0.2 < (longest > 1.5).mean() < 0.6  # once a minute on average
    assert longest.max() < 2.0 * DROPOUT_MAX_S + PERIOD_S  # one may follow another


def test_nothing_is_known_before_the_first_fix(recorded):
    _, fixes = recorded
    known_from = np.argmax(fixes["is_known"], axis=0)
    new_from = np.argmax(fixes["is_new"], axis=0)
    assert (known_from == new_from).all()
    assert (fixes["is_known"][0] == 0).all()


def test_one_phone_alone_is_the_first_of_many(plain, recorded):
    _, many = recorded
    _, alone = record(plain, phone_model(), phones=1)
    assert alone[:, 0].tobytes() == np.ascontiguousarray(many[:, 0]).tobytes()


def test_a_lag_of_several_periods_loses_no_fix(plain):
    _, fixes = record(plain, phone_model(lag_s=1.3), phones=20, steps=400)
    gaps = np.concatenate([np.diff(fixes["time_us"][fixes["is_new"][:, row] == 1, row]) for row in range(20)]) * 1e-6
    assert np.median(gaps) == pytest.approx(PERIOD_S, abs=0.02)
