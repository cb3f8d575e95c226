import numpy as np
import pytest

from autopilot.vehicles.multirotor.control_airframe import effectiveness
from common.airframe import Airframe, load_airframe
from tests.unit.autopilot.vehicles.multirotor.mixer import mix, with_rotors

LOW, HIGH = 0.2, 8.5


@pytest.fixture(scope="module")
def x500() -> Airframe:
    return load_airframe("x500")


@pytest.mark.parametrize(
    ("torque", "more", "less"),
    [
        ((0.1, 0.0, 0.0), (1, 2), (0, 3)),  # roll right: the left rotors push more
        ((0.0, 0.1, 0.0), (0, 2), (1, 3)),  # nose up: the front rotors push more
        ((0.0, 0.0, 0.02), (0, 1), (2, 3)),  # yaw right: the counter-clockwise rotors push more
    ],
)
def test_torque_signs(x500: Airframe, torque: tuple[float, ...], more: tuple[int, ...], less: tuple[int, ...]) -> None:
    thrusts = mix(x500, [torque], [15.0], LOW, HIGH)[0]["thrust_n"][0]
    assert min(thrusts[list(more)]) > max(thrusts[list(less)])


def test_yaw_gives_way_before_thrust_and_tilt(x500: Airframe) -> None:
    results, _, _ = mix(x500, [(0.6, 0.0, 0.5)], [15.0], LOW, HIGH)
    np.testing.assert_allclose(results["torque_frd"][0, :2], (0.6, 0.0), atol=1e-5)
    assert results["collective_n"][0] == pytest.approx(15.0, rel=1e-5)
    assert 0.0 < results["torque_frd"][0, 2] < 0.5


@pytest.mark.parametrize("collective_n", [0.0, 40.0])
def test_thrust_gives_way_before_tilt(x500: Airframe, collective_n: float) -> None:
    results, _, _ = mix(x500, [(1.0, -0.5, 0.0)], [collective_n], LOW, HIGH)
    np.testing.assert_allclose(results["torque_frd"][0, :2], (1.0, -0.5), atol=1e-5)
    assert results["collective_n"][0] != pytest.approx(collective_n)


def test_too_much_tilt_is_scaled_in_its_direction(x500: Airframe) -> None:
    results, _, _ = mix(x500, [(30.0, -10.0, 1.0)], [2.0 * (LOW + HIGH)], LOW, HIGH)
    roll, pitch, yaw = results["torque_frd"][0]
    assert roll / pitch == pytest.approx(-3.0, rel=1e-4)
    assert abs(yaw) < 1e-4
    thrusts = results["thrust_n"][0, :4]
    assert thrusts.max() == pytest.approx(HIGH, abs=1e-4)
    assert thrusts.min() == pytest.approx(LOW, abs=1e-4)


@pytest.mark.parametrize(("asked_n", "most_n"), [(2.0, 14.71), (14.0, 14.71), (16.0, 16.0), (30.0, 30.0)])
@pytest.mark.parametrize("name", ["x500", "f550-fitted"])
def test_leaning_hard_lifts_no_vehicle(name: str, asked_n: float, most_n: float) -> None:
    airframe = load_airframe(name)
    scale = airframe.body.mass_kg / 1.5
    for torque in ((30.0, 0.0, 0.0), (0.0, 30.0, 0.0), (-30.0, 30.0, 0.0)):
        results, _, _ = mix(airframe, [torque], [scale * asked_n], LOW, HIGH)
        assert results["collective_n"][0] <= scale * most_n + 1e-3
        roll, pitch = results["torque_frd"][0, :2]
        assert np.hypot(roll, pitch) > 1.0
        assert roll * torque[0] >= 0.0
        assert pitch * torque[1] >= 0.0


@pytest.mark.parametrize("count", [4, 5, 6, 8])
def test_any_number_of_rotors_achieves_a_small_demand(x500: Airframe, count: int) -> None:
    airframe = with_rotors(x500, count)
    results, _, _ = mix(airframe, [(0.2, -0.1, 0.02)], [20.0], LOW, HIGH)
    np.testing.assert_allclose(results["torque_frd"][0], (0.2, -0.1, 0.02), atol=1e-5)
    assert results["collective_n"][0] == pytest.approx(20.0, rel=1e-5)
    assert not results["thrust_n"][0, count:].any()


def test_three_rotors_achieve_all_but_yaw(x500: Airframe) -> None:
    airframe = with_rotors(x500, 3)
    results, _, _ = mix(airframe, [(0.2, -0.1, 0.3)], [15.0], LOW, HIGH)
    np.testing.assert_allclose(results["torque_frd"][0, :2], (0.2, -0.1), atol=1e-5)
    achieved = effectiveness(airframe)[2] @ results["thrust_n"][0, :3]
    assert results["torque_short_frd"][0, 2] == pytest.approx(0.3 - achieved, abs=1e-5)


@pytest.mark.parametrize("name", ["x500", "f450"])
@pytest.mark.parametrize("voltage_fraction", [0.75, 1.0])
def test_commands_make_the_thrusts_asked_for(name: str, voltage_fraction: float) -> None:
    airframe = load_airframe(name)
    demand = np.linspace(2.0, 18.0, 30)
    results, commands, made = mix(airframe, np.zeros((30, 3)), demand, 0.3, 8.0, voltage_fraction)
    inside = (commands[:, :4] > airframe.rotor_model.idle_command).all(axis=1) & (commands[:, :4] < 1.0).all(axis=1)
    assert inside.sum() > 15
    np.testing.assert_allclose(made[inside], results["thrust_n"][inside], rtol=1e-4)
