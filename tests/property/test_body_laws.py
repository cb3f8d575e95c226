"""Laws of the multirotor body: what must hold for every motion, wherever the numbers come from."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from common.airframe import load_airframe
from common.geodesy import GRAVITY_M_S2
from common.kernels import TICK_S
from sim.bodies.multirotor import density_ratio
from sim.bodies.multirotor_model import multirotor_model
from sim.wind import wind_model
from tests.unit.sim.fleet import SEA_LEVEL_M, Fleet, rotated

FEW = settings(max_examples=25, deadline=None)  # the first example compiles a kernel
seeds = st.integers(0, 2**31 - 1)
HIGH_M = 500.0
INERTIA_KG_M2 = np.array([0.012, 0.017, 0.026])  # all different: an Euler top


def vacuum_model():
    """No air: nothing but gravity and the rotors' inertia."""
    model = multirotor_model(load_airframe("x500"), SEA_LEVEL_M)
    model.home_density_ratio = 0.0
    model.inertia_frd = tuple(INERTIA_KG_M2)
    model.inertia_inv_frd = tuple(1.0 / INERTIA_KG_M2)
    return model


def tumbling(seed, count=4, rate=8.0, model=None, speed=5.0):
    """Vehicles with drawn attitudes, velocities and rates."""
    rng = np.random.default_rng(seed)
    fleet = Fleet(np.tile([0.0, 0.0, -HIGH_M], (count, 1)), model or vacuum_model())
    q = rng.normal(size=(count, 4))
    fleet.state["q_ned_from_frd"] = q / np.linalg.norm(q, axis=1, keepdims=True)
    fleet.state["vel_ned"] = rng.normal(0.0, speed, (count, 3))
    fleet.state["omega_frd"] = rng.normal(0.0, rate, (count, 3))
    return fleet, rng


def angular_momentum_ned(fleet):
    """Of body and rotors together [N m s], shape (vehicles, 3)."""
    state = fleet.state
    momentum = INERTIA_KG_M2 * state["omega_frd"].astype(float)
    spin = np.array(fleet.model.rotor_spin)
    momentum[:, 2] -= fleet.model.rotor_inertia_kg_m2 * state["rotor_speed"].astype(float) @ spin
    return rotated(state["q_ned_from_frd"], momentum)


@FEW
@given(seed=seeds)
def test_free_fall_is_a_parabola(seed):
    fleet, _ = tumbling(seed)
    start_pos, start_vel = fleet.state["pos_ned"].astype(float), fleet.state["vel_ned"].astype(float)
    fleet.fly(500)
    fall = np.array([0.0, 0.0, GRAVITY_M_S2])
    np.testing.assert_allclose(fleet.state["vel_ned"], start_vel + 2.0 * fall, atol=2e-3)  # float32, 2,000 steps
    np.testing.assert_allclose(fleet.state["pos_ned"], start_pos + 2.0 * start_vel + 2.0 * fall, atol=3e-2)
    np.testing.assert_allclose(fleet.state["accel_frd"], 0.0, atol=1e-6)


@FEW
@given(seed=seeds)
def test_a_tumbling_body_keeps_its_energy_and_its_angular_momentum(seed):
    fleet, _ = tumbling(seed)
    momentum = angular_momentum_ned(fleet)
    energy = (INERTIA_KG_M2 * fleet.state["omega_frd"].astype(float) ** 2).sum(axis=1)
    fleet.fly(500)
    size = np.linalg.norm(momentum, axis=1, keepdims=True)
    assert (np.abs(angular_momentum_ned(fleet) - momentum) / size).max() < 2e-3
    after = (INERTIA_KG_M2 * fleet.state["omega_frd"].astype(float) ** 2).sum(axis=1)
    np.testing.assert_allclose(after, energy, rtol=2e-3)


@FEW
@given(seed=seeds)
def test_body_and_rotors_exchange_angular_momentum_and_lose_none(seed):
    """In a vacuum rotors feel no drag: their reaction and gyroscopic torques must balance exactly."""
    fleet, rng = tumbling(seed, rate=3.0)
    fleet.state["rotor_speed"][:, :4] = rng.uniform(0.0, 900.0, (4, 4))
    momentum = angular_momentum_ned(fleet)
    for _ in range(10):
        fleet.fly(25, rng.uniform(0.0, 1.0, (4, 4)))
    size = np.maximum(np.linalg.norm(momentum, axis=1, keepdims=True), 0.03)
    assert (np.abs(angular_momentum_ned(fleet) - momentum) / size).max() < 5e-3


@FEW
@given(height_m=st.floats(5.0, 60.0), home_alt_m=st.floats(0.0, 3000.0))
def test_the_hover_command_hovers(height_m, home_alt_m):
    model = multirotor_model(load_airframe("x500"), home_alt_m)
    model.battery.resistance_ohm = 0.0
    fleet = Fleet([0.0, 0.0, -height_m], model)
    speed = np.sqrt(1.5 * GRAVITY_M_S2 / (4 * model.thrust_n_s2 * density_ratio(model, -height_m)))
    fleet.state["rotor_speed"][:, :4] = speed
    voltage = 16.8
    for _ in range(50):  # the command follows the falling voltage
        fleet.fly(5, speed / 1000.0 * 16.8 / voltage)
        voltage = float(fleet.state["battery_voltage_v"][0])
    assert np.abs(fleet.state["vel_ned"]).max() < 0.02
    assert np.abs(fleet.state["pos_ned"][0] - [0.0, 0.0, -height_m]).max() < 0.02
    np.testing.assert_allclose(fleet.state["accel_frd"][0], [0.0, 0.0, -GRAVITY_M_S2], atol=0.02)


@FEW
@given(seed=seeds)
def test_air_only_takes_energy_from_a_body_with_still_rotors(seed):
    model = multirotor_model(load_airframe("x500"), SEA_LEVEL_M)
    fleet, _ = tumbling(seed, model=model, speed=15.0)

    def energy():
        state = fleet.state
        inertia = np.array(model.inertia_frd)
        speed2 = (state["vel_ned"].astype(float) ** 2).sum(axis=1)
        turning = (inertia * state["omega_frd"].astype(float) ** 2).sum(axis=1)
        return 0.5 * model.mass_kg * speed2 + 0.5 * turning - model.mass_kg * GRAVITY_M_S2 * state["pos_ned"][:, 2]

    before = energy()
    for _ in range(20):
        fleet.fly(5)
        after = energy()
        assert (after < before).all()
        before = after


@FEW
@given(seed=seeds)
def test_quaternions_stay_unit_and_everything_finite_under_any_command(seed):
    rng = np.random.default_rng(seed)
    fleet = Fleet(rng.uniform([-40, -40, -3], [40, 40, -0.3], (16, 3)), wind=wind_model(12.0, 70.0, 1.0, 6.0))
    for _ in range(40):
        fleet.fly(10, rng.uniform(0.0, 1.0, (16, 4)))
    for field in fleet.state.dtype.names:
        if fleet.state[field].dtype.kind == "f":
            assert np.isfinite(fleet.state[field]).all(), field
    np.testing.assert_allclose(np.linalg.norm(fleet.state["q_ned_from_frd"], axis=1), 1.0, atol=1e-5)
    assert (fleet.state["rotor_speed"] >= 0.0).all()
    assert (fleet.state["pos_ned"][:, 2] < 0.5).all()  # none falls through the ground


def flight(pos_ned, seed_rows, seed, order=None):
    """States after a windy flight under drawn commands, one row per vehicle in the given order."""
    rng = np.random.default_rng(seed)
    commands = rng.uniform(0.2, 0.9, (10, len(seed_rows), 4))
    rows = np.arange(len(seed_rows)) if order is None else order
    wind = wind_model(8.0, 200.0, turbulence=0.0, gust_m_s=0.0)
    fleet = Fleet(pos_ned[rows], wind=wind, seeds=seed_rows[rows])
    for command in commands:
        fleet.fly(20, command[rows])
    return fleet.state.copy()


@FEW
@given(seed=seeds, chosen=st.integers(0, 63))
def test_one_vehicle_alone_equals_its_row_of_many(seed, chosen):
    pos = np.random.default_rng(seed).uniform([-40, -40, -5], [40, 40, -0.3], (64, 3))
    many = flight(pos, np.full(64, 1), seed)
    alone = flight(pos, np.full(64, 1), seed, order=np.array([chosen]))
    assert alone[0].tobytes() == many[chosen].tobytes()


@FEW
@given(seed=seeds)
def test_permuting_vehicles_permutes_results(seed):
    rng = np.random.default_rng(seed)
    pos = rng.uniform([-40, -40, -5], [40, 40, -0.3], (16, 3))
    order = rng.permutation(16)
    assert flight(pos, np.full(16, 1), seed)[order].tobytes() == flight(pos, np.full(16, 1), seed, order).tobytes()


@FEW
@given(seed=seeds)
def test_a_batch_of_many_leaves_the_wind_of_the_first_vehicle_alone(seed):
    wind = wind_model(8.0, 30.0, turbulence=1.0, gust_m_s=4.0)
    alone = Fleet([[0.0, 0.0, -20.0]], wind=wind, seeds=seed)
    many = Fleet(np.tile([0.0, 0.0, -20.0], (64, 1)), wind=wind, seeds=seed)
    for fleet in (alone, many):
        fleet.fly(100, 0.65)
    assert alone.state[0].tobytes() == many.state[0].tobytes()
    assert alone.air[0].tobytes() == many.air[0].tobytes()


@FEW
@given(seed=seeds, split=st.integers(1, 99))
def test_how_ticks_are_split_into_launches_does_not_matter(seed, split):
    wind = wind_model(5.0, 120.0, turbulence=1.0, gust_m_s=3.0)
    whole = Fleet([0.0, 0.0, -20.0], wind=wind, seeds=seed)
    parts = Fleet([0.0, 0.0, -20.0], wind=wind, seeds=seed)
    whole.fly(100, 0.65)
    parts.fly(split, 0.65)
    parts.fly(100 - split, 0.65)
    assert whole.state.tobytes() == parts.state.tobytes()
    assert whole.air.tobytes() == parts.air.tobytes()
    assert TICK_S * whole.tick == TICK_S * parts.tick
