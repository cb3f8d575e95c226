import numpy as np
import pytest

from common.airframe import AirframeError, airframe_names, load_airframe
from common.geodesy import GRAVITY_M_S2
from common.kernels import TICK_S
from sim.bodies.multirotor import density_ratio, ground_effect
from sim.bodies.multirotor_model import multirotor_model
from tests.unit.sim.fleet import SEA_LEVEL_M, Fleet, rotated

HIGH = [0.0, 0.0, -200.0]


def bare_model(name="x500"):
    """An airframe at sea level in a vacuum but for its rotors' thrust and torque; a stiff battery."""
    model = multirotor_model(load_airframe(name), SEA_LEVEL_M)
    model.drag_area_frd = (0.0, 0.0, 0.0)
    model.angular_drag_n_m_s2 = 0.0
    model.rotor_drag_n_s2_m = 0.0
    model.inflow_n_s2_m = 0.0
    model.battery.resistance_ohm = 0.0
    return model


@pytest.mark.parametrize("name", ["x500", "f450"])
def test_airframes_are_plausible_px4_quads(name):
    airframe = load_airframe(name)
    positions = [(np.sign(r.x_m), np.sign(r.y_m), r.spin) for r in airframe.rotors]
    assert positions == [(1, 1, 1), (-1, -1, 1), (1, -1, -1), (-1, 1, -1)]
    rotor = airframe.rotor_model
    thrust_to_weight = 4 * rotor.thrust_n_s2 * rotor.max_speed_rad_s**2 / (airframe.body.mass_kg * GRAVITY_M_S2)
    assert 2.0 < thrust_to_weight < 3.0
    inertia = airframe.body.inertia_xx_kg_m2, airframe.body.inertia_yy_kg_m2, airframe.body.inertia_zz_kg_m2
    assert inertia[2] <= inertia[0] + inertia[1]  # no body can do otherwise


def test_shipped_airframes_are_known_and_others_refused():
    assert set(airframe_names()) >= {"x500", "f450"}
    with pytest.raises(AirframeError, match=f"unknown airframe 'nimbus'; known: {', '.join(airframe_names())}$"):
        load_airframe("nimbus")


def test_a_number_without_source_is_refused(tmp_path):
    text = (load_airframe.__globals__["AIRFRAME_FOLDER"] / "x500.toml").read_text(encoding="utf-8")
    path = tmp_path / "bad.toml"
    path.write_text(text.replace("mass_kg = { value = 1.5, source", "mass_kg = { value = 1.5, src"))
    with pytest.raises(AirframeError, match=r"bad.toml: body.mass_kg: .*source"):
        load_airframe(str(path))


def test_rotors_follow_first_order_lags_of_their_own_rise_and_fall():
    model = bare_model()
    fleet = Fleet(HIGH, model)
    ticks = 25
    times = TICK_S * np.arange(1, ticks + 1)
    rising = fleet.history(ticks, 0.6)["rotor_speed"][:, 0, 0]
    np.testing.assert_allclose(rising, 600.0 * (1 - np.exp(-times / model.spin_up_time_s)), rtol=3e-3)
    fleet.fly(100, 0.6)
    falling = fleet.history(ticks, 0.3)["rotor_speed"][:, 0, 0]
    np.testing.assert_allclose(falling, 300.0 + 300.0 * np.exp(-times / model.spin_down_time_s), rtol=5e-3)


def test_command_curve_joins_linear_speed_and_linear_thrust():
    model = bare_model()
    commands = np.array([[0.25, 0.25, 0.25, 0.25]])
    for curve, fraction in ((1.0, 0.25), (0.0, 0.5), (0.6, 0.6 * 0.25 + 0.4 * 0.5)):
        model.command_curve = curve
        fleet = Fleet(HIGH, model)
        fleet.fly(100, commands)
        assert fleet.state["rotor_speed"][0, 0] == pytest.approx(fraction * 1000.0, rel=5e-3)  # battery a little down


def test_commands_outside_their_range_are_clipped():
    fleet = Fleet(HIGH, bare_model())
    fleet.fly(50, [[2.0, 1.0, -1.0, 0.0]])
    speed = fleet.state["rotor_speed"][0]
    assert speed[0] == speed[1] > 900.0
    assert speed[2] == speed[3] == 0.0


def test_full_thrust_sags_the_battery_and_slows_the_rotors():
    airframe = load_airframe("x500")
    fleet = Fleet(HIGH, multirotor_model(airframe))
    fleet.fly(100, 1.0)
    state = fleet.state[0]
    density = density_ratio(fleet.model, float(state["pos_ned"][2]))
    shaft_w = 4 * density * airframe.rotor_model.torque_n_m_s2 * state["rotor_speed"][0] ** 3
    assert state["battery_voltage_v"] < 16.8 - 0.5
    power_w = state["battery_voltage_v"] * state["battery_current_a"]
    assert power_w == pytest.approx(shaft_w / 0.75 + 8.0, rel=0.01)
    assert state["rotor_speed"][0] == pytest.approx(1000.0 * state["battery_voltage_v"] / 16.8, rel=2e-3)


def test_charge_falls_by_the_integral_of_current_and_an_empty_pack_cannot_hover():
    fleet = Fleet(HIGH, multirotor_model(load_airframe("x500")))
    currents = fleet.history(200, 0.7)["battery_current_a"][:, 0].astype(float)
    used_c = fleet.model.battery.capacity_c - fleet.state["battery_charge_c"][0]
    assert used_c == pytest.approx(currents.sum() * TICK_S, abs=2e-3)  # float32 of 18,000 C
    fleet.state["battery_charge_c"] = -0.05 * fleet.model.battery.capacity_c
    fleet.fly(250, 1.0)
    assert fleet.state["rotor_speed"][0, 0] < 1.0


def test_speeding_up_the_counter_clockwise_rotors_turns_the_body_clockwise():
    """Their reaction turns the body the other way: clockwise seen from above is positive yaw in frd."""
    fleet = Fleet(HIGH, bare_model())
    fleet.fly(50, 0.65)
    fleet.state["omega_frd"] = 0.0
    fleet.fly(25, [[0.7, 0.7, 0.6, 0.6]])
    omega = fleet.state["omega_frd"][0]
    assert omega[2] > 0.1
    assert np.abs(omega[:2]).max() < 1e-4


@pytest.mark.parametrize(
    ("command", "axis", "sign"),
    [([0.6, 0.7, 0.7, 0.6], 0, 1), ([0.7, 0.6, 0.7, 0.6], 1, 1)],  # more on the left, more in front
)
def test_thrust_differences_roll_and_pitch(command, axis, sign):
    fleet = Fleet(HIGH, bare_model())
    fleet.fly(50, 0.65)
    fleet.fly(5, [command])
    assert np.sign(fleet.state["omega_frd"][0, axis]) == sign
    assert np.argmax(np.abs(fleet.state["omega_frd"][0])) == axis


def test_wind_drags_and_terminal_velocity_balances_gravity():
    model = bare_model()
    model.drag_area_frd = (0.02, 0.02, 0.04)
    fleet = Fleet([0.0, 0.0, -2000.0], model)
    fleet.fly(4000)
    density = 1.225 * density_ratio(model, float(fleet.state["pos_ned"][0, 2]))
    terminal = np.sqrt(2 * 1.5 * GRAVITY_M_S2 / (density * 0.04))
    assert fleet.state["vel_ned"][0, 2] == pytest.approx(terminal, rel=0.02)
    assert np.abs(fleet.state["accel_frd"][0] - [0, 0, -GRAVITY_M_S2]).max() < 0.3


def test_climbing_takes_thrust_away_and_sideslip_drags_at_the_rotors():
    model = bare_model()
    model.inflow_n_s2_m = 2.7e-4
    model.rotor_drag_n_s2_m = 8.0e-5
    fleet = Fleet(np.tile(HIGH, (3, 1)), model)
    fleet.state["rotor_speed"][:, :4] = 650.0
    fleet.state["vel_ned"][1] = [0.0, 0.0, -3.0]
    fleet.state["vel_ned"][2] = [4.0, 0.0, 0.0]
    fleet.fly(1, 0.65)
    still, climbing, sliding = fleet.state["accel_frd"].astype(float)
    density = density_ratio(model, -200.0)
    np.testing.assert_allclose(climbing[2] - still[2], 4 * 2.7e-4 * 650 * 3.0 * density / 1.5, rtol=0.01)
    np.testing.assert_allclose(sliding[0], -4 * 8.0e-5 * 650 * 4.0 * density / 1.5, rtol=0.01)


def test_ground_effect_is_cheeseman_and_bennetts_and_bounded():
    assert ground_effect(0.127, 0.127) == pytest.approx(16 / 15)
    assert ground_effect(0.127, 10.0) == pytest.approx(1.0, abs=2e-5)
    assert ground_effect(0.127, 0.0) == ground_effect(0.127, 0.0635) == pytest.approx(4 / 3)


def test_density_is_that_of_the_standard_atmosphere():
    model = multirotor_model(load_airframe("x500"), 488.0)
    assert model.home_density_ratio == pytest.approx(1.1683 / 1.225, rel=1e-3)
    higher = multirotor_model(load_airframe("x500"), 588.0)
    assert density_ratio(model, -100.0) == pytest.approx(higher.home_density_ratio, rel=3e-4)


def test_the_imu_means_are_the_changes_of_velocity_and_attitude():
    fleet = Fleet(HIGH, multirotor_model(load_airframe("x500")))
    fleet.fly(30, [[0.8, 0.75, 0.75, 0.8]])
    before = fleet.state[0].copy()
    fleet.fly(1, [[0.8, 0.75, 0.75, 0.8]])
    after = fleet.state[0]
    middle = (before["q_ned_from_frd"] + after["q_ned_from_frd"]).astype(float)
    middle /= np.linalg.norm(middle)
    gravity_ned = np.array([0.0, 0.0, GRAVITY_M_S2])
    accel_ned = rotated(middle, after["accel_frd"]) + gravity_ned
    np.testing.assert_allclose((after["vel_ned"] - before["vel_ned"]) / TICK_S, accel_ned, atol=0.02)
    axis = np.array(before["q_ned_from_frd"], float) * [-1, -1, -1, 1]
    x, y, z, w = axis
    turn = np.array([[w, -z, y, x], [z, w, -x, y], [-y, x, w, z], [-x, -y, -z, w]]) @ after["q_ned_from_frd"]
    np.testing.assert_allclose(2 * turn[:3] / TICK_S, after["gyro_frd"], atol=2e-3)
