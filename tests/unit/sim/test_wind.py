import numpy as np
import pytest

from common.kernels import TICK_S
from sim.wind import turbulence_scales, wind_model
from tests.unit.sim.fleet import Fleet

FEET_M = 0.3048


def air_at(height_m, wind, ticks, vehicles=64, seed=5):
    """Wind over time at vehicles held still, shape (ticks, vehicles, 3)."""
    fleet = Fleet(np.tile([0.0, 0.0, -height_m], (vehicles, 1)), wind=wind, seeds=seed)
    samples = np.empty((ticks, vehicles, 3))
    for k in range(ticks):
        fleet.state["pos_ned"] = [0.0, 0.0, -height_m]
        fleet.state["vel_ned"] = 0.0
        fleet.fly(1)
        samples[k] = fleet.air["wind_ned"]
    return samples


@pytest.mark.parametrize(("from_deg", "towards"), [(0.0, [-5, 0, 0]), (90.0, [0, -5, 0]), (270.0, [0, 5, 0])])
def test_steady_wind_blows_from_its_direction(from_deg, towards):
    wind = air_at(10.0, wind_model(5.0, from_deg), 3, vehicles=1)
    np.testing.assert_allclose(wind, np.broadcast_to(towards, wind.shape), atol=1e-5)


def test_gusts_rise_and_fall_smoothly_along_the_wind_and_stay_within_their_bound():
    wind = air_at(10.0, wind_model(8.0, 180.0, gust_m_s=4.0), 9000, vehicles=4)
    extra = wind[:, :, 0] - 8.0
    np.testing.assert_allclose(wind[:, :, 1:], 0.0, atol=1e-5)
    assert extra.min() >= -1e-5
    assert extra.max() <= 4.0
    windows = extra.reshape(3, 3000, 4)  # 12 s each
    assert (windows.max(axis=1) >= 2.0 - 1e-3).all()
    assert (windows[:, 0] == 0.0).all()
    assert np.abs(np.diff(extra, axis=0)).max() < 4.0 * np.pi / 3.0 * TICK_S * 1.01  # half the bound times 2 pi / 3 s
    assert len(np.unique(windows.max(axis=1).round(4))) == 12  # each window and vehicle draws its own


def test_turbulence_intensity_and_scale_follow_the_specification():
    ratio, length_ratio = turbulence_scales(50.0 * FEET_M)
    assert ratio == pytest.approx(1 / (0.177 + 0.000823 * 50.0) ** 0.4)
    assert length_ratio == pytest.approx(1 / (0.177 + 0.000823 * 50.0) ** 1.2)
    assert turbulence_scales(1000.0 * FEET_M)[0] == pytest.approx(1.0, abs=2e-3)
    assert turbulence_scales(0.0)[0] == turbulence_scales(10.0 * FEET_M)[0]


HEIGHT_M, SPEED_M_S = 10.0, 12.0


@pytest.fixture(scope="module")
def turbulence():
    """Six seconds of it without the steady wind, at 4,096 vehicles."""
    wind = wind_model(SPEED_M_S, 180.0, turbulence=1.0)
    return air_at(HEIGHT_M, wind, 1500, vehicles=4096) - [SPEED_M_S, 0.0, 0.0]


def test_turbulence_has_the_variance_of_dryden_from_the_start_on(turbulence):
    std_w = 0.1 * SPEED_M_S
    expected = np.array([std_w * turbulence_scales(HEIGHT_M)[0]] * 2 + [std_w])
    wind = turbulence
    for k in (1, 750, 1499):  # the body tells its height from the first tick on
        np.testing.assert_allclose(wind[k].std(axis=0), expected, rtol=0.05)  # 4 sigma of 4,096 draws
        assert (np.abs(wind[k].mean(axis=0)) < 4 * expected / 64).all()
        assert np.abs(np.corrcoef(wind[k].T) - np.eye(3)).max() < 4 / 64
    fourth_moment = (wind[-1] / expected) ** 4
    np.testing.assert_allclose(fourth_moment.mean(axis=0), 3.0, rtol=0.15)  # normal though the noise is uniform


def test_turbulence_decorrelates_as_dryden_says(turbulence):
    """Autocorrelations of the two shaping filters: exp(-s) and exp(-s) (1 - s / 2), s = V t / L."""
    wind = turbulence
    length_w = HEIGHT_M
    length_uv = length_w * turbulence_scales(HEIGHT_M)[1]
    for lag in (250, 700, 1499):
        got = (wind[0] * wind[lag]).mean(axis=0) / (wind[0].std(axis=0) * wind[lag].std(axis=0))
        s_uv, s_w = SPEED_M_S * lag * TICK_S / length_uv, SPEED_M_S * lag * TICK_S / length_w
        want = [np.exp(-s_uv), np.exp(-s_uv) * (1 - s_uv / 2), np.exp(-s_w) * (1 - s_w / 2)]
        np.testing.assert_allclose(got, want, atol=4 / 64)


def test_the_same_seed_gives_the_same_air_and_another_seed_another():
    wind = wind_model(8.0, 30.0, turbulence=1.0, gust_m_s=3.0)
    first, again, other = (air_at(10.0, wind, 50, vehicles=8, seed=seed) for seed in (3, 3, 4))
    assert first.tobytes() == again.tobytes()
    assert (first[-1] != other[-1]).all()
    assert len(np.unique(first[-1, :, 2])) == 8
