"""The body kernel against its equations of motion in float64, integrated finely; its contact law written plainly."""

import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from common.airframe import load_airframe
from common.geodesy import GRAVITY_M_S2
from sim.bodies.contact import ContactForce, ContactModel, FootSlip, Surroundings, contact_model, ground_contact
from sim.bodies.multirotor_model import multirotor_model
from sim.wind import wind_model
from tests.unit.sim.fleet import Fleet

wp.set_module_options({"enable_backward": False})

DOWN = np.array([0.0, 0.0, 1.0])
FRICTION = 0.7
FINE_STEPS = 200
FLIGHT_S = 0.2


def derivative(airframe, density, target, wind_ned, height_m, state):
    """Newton and Euler for one quadrotor, from the sources named in the airframe and body files.

    state: position, velocity (ned), quaternion (x, y, z, w), rate (frd), four rotor speeds.
    """
    vel, q, omega, speed = state[3:6], state[6:10], state[10:13], state[13:17]
    body, rotor = airframe.body, airframe.rotor_model
    turn = Rotation.from_quat(q)
    air = turn.inv().apply(vel - wind_ned)
    time_constant = np.where(target > speed, rotor.spin_up_time_s, rotor.spin_down_time_s)
    speed_dot = (target - speed) / time_constant
    force, torque, momentum = np.zeros(3), np.zeros(3), np.zeros(3)
    hub_height = height_m - np.mean([hub.z_m for hub in airframe.rotors])
    lift = 1.0 / (1.0 - (rotor.radius_m / (4.0 * hub_height)) ** 2)
    for hub, w, w_dot in zip(airframe.rotors, speed, speed_dot, strict=True):
        arm = np.array([hub.x_m, hub.y_m, hub.z_m])
        at_hub = air + np.cross(omega, arm)
        thrust = density * lift * (rotor.thrust_n_s2 * w**2 + rotor.inflow_n_s2_m * w * at_hub[2])
        push = -density * rotor.drag_n_s2_m * w * (at_hub - at_hub[2] * DOWN) - thrust * DOWN
        force += push
        torque += np.cross(arm, push)
        torque += hub.spin * (density * rotor.torque_n_m_s2 * w**2 + rotor.inertia_kg_m2 * w_dot) * DOWN
        momentum -= hub.spin * rotor.inertia_kg_m2 * w * DOWN
    area = np.array([body.drag_area_x_m2, body.drag_area_y_m2, body.drag_area_z_m2])
    force -= 0.5 * 1.225 * density * np.linalg.norm(air) * area * air
    torque -= density * body.angular_drag_n_m_s2 * np.abs(omega) * omega
    inertia = np.array([body.inertia_xx_kg_m2, body.inertia_yy_kg_m2, body.inertia_zz_kg_m2])
    omega_dot = (torque - np.cross(omega, inertia * omega + momentum)) / inertia
    accel = turn.apply(force) / body.mass_kg + GRAVITY_M_S2 * DOWN
    x, y, z, w = q
    p, q_rate, r = omega
    q_dot = 0.5 * np.array(
        [
            w * p + y * r - z * q_rate,
            w * q_rate + z * p - x * r,
            w * r + x * q_rate - y * p,
            -x * p - y * q_rate - z * r,
        ]
    )
    return np.concatenate([vel, accel, q_dot, omega_dot, speed_dot])


def integrate(airframe, density, target, wind_ned, height_m, state):
    """Classical Runge-Kutta over the flight; the height for ground effect moves with the state."""
    dt = FLIGHT_S / FINE_STEPS

    def slope(s):
        return derivative(airframe, density, target, wind_ned, height_m - (s[2] - start_d), s)

    start_d = state[2]
    for _ in range(FINE_STEPS):
        k1 = slope(state)
        k2 = slope(state + 0.5 * dt * k1)
        k3 = slope(state + 0.5 * dt * k2)
        k4 = slope(state + dt * k3)
        state = state + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return state


@pytest.mark.parametrize("name", ["x500", "f450"])
@pytest.mark.parametrize("height_m", [2.0, 40.0])
def test_flight_matches_the_equations_of_motion(name, height_m):
    airframe = load_airframe(name)
    model = multirotor_model(airframe, 300.0)
    model.battery.resistance_ohm = 0.0
    rng = np.random.default_rng(1)
    count = 4
    fleet = Fleet(np.tile([0.0, 0.0, -height_m], (count, 1)), model, wind=wind_model(6.0, 130.0))
    wind_ned = 6.0 * np.array([-np.cos(np.radians(130.0)), -np.sin(np.radians(130.0)), 0.0])
    q = Rotation.from_rotvec(rng.normal(0.0, 0.4, (count, 3))).as_quat()
    fleet.state["q_ned_from_frd"] = q
    fleet.state["vel_ned"] = rng.normal(0.0, 2.0, (count, 3))
    fleet.state["omega_frd"] = rng.normal(0.0, 2.0, (count, 3))
    fleet.state["rotor_speed"][:, :4] = rng.uniform(300.0, 700.0, (count, 4))
    command = rng.uniform(0.4, 0.9, (count, 4))
    fields = ["pos_ned", "vel_ned", "q_ned_from_frd", "omega_frd"]
    start = np.hstack([fleet.state[f].astype(float) for f in fields] + [fleet.state["rotor_speed"][:, :4]])
    curve = airframe.rotor_model.command_curve
    target = airframe.rotor_model.max_speed_rad_s * (curve * command + (1.0 - curve) * np.sqrt(command))
    density = model.home_density_ratio * (1.0 - 9.6e-5 * height_m)
    fleet.fly(round(FLIGHT_S / 0.004), command)
    got = np.hstack([fleet.state[f].astype(float) for f in fields] + [fleet.state["rotor_speed"][:, :4]])
    for i in range(count):
        want = integrate(airframe, density, target[i], wind_ned, height_m, start[i])
        np.testing.assert_allclose(got[i, 0:3], want[0:3], atol=1e-3)  # 1 ms steps: first order in the forces
        np.testing.assert_allclose(got[i, 3:6], want[3:6], atol=1e-2)
        turn = Rotation.from_quat(got[i, 6:10]).inv() * Rotation.from_quat(want[6:10])
        assert turn.magnitude() < 1e-3
        np.testing.assert_allclose(got[i, 10:13], want[10:13], atol=2e-2)
        np.testing.assert_allclose(got[i, 13:17], want[13:17], rtol=2e-4)  # the open voltage falls a little


@wp.kernel
def _touch(
    model: ContactModel,
    arounds: wp.array[Surroundings],
    pos: wp.array[wp.vec3],
    vel: wp.array[wp.vec3],
    q: wp.array[wp.quat],
    omega: wp.array[wp.vec3],
    slips: wp.array[FootSlip],
    contacts: wp.array[ContactForce],
):
    i = wp.tid()
    turn = wp.quat_to_matrix(q[i])
    contacts[i] = ground_contact(model, arounds[i], pos[i], vel[i], turn, omega[i], slips[i], 0.001)


def plain_contact(model, airframe, normal, pos, vel, turn, omega, slip):
    """Force (ned) and torque (frd) of the ground plane through the origin, and the feet's new slips."""
    data, radius = airframe.contact, airframe.rotor_model.radius_m
    feet = [(sx * data.leg_x_m, sy * data.leg_y_m, data.leg_z_m) for sy in (1, -1) for sx in (1, -1)]
    outward = [1.0 + radius / np.hypot(r.x_m, r.y_m) for r in airframe.rotors]
    tips = [(k * r.x_m, k * r.y_m, r.z_m) for k, r in zip(outward, airframe.rotors, strict=True)]
    force, torque, slips = np.zeros(3), np.zeros(3), np.zeros((4, 3))
    for i, arm in enumerate(np.array(feet + tips)):
        arm_ned = turn.apply(arm)
        depth = -normal @ (pos + arm_ned)
        if depth <= 0.0:
            continue
        at_point = vel + turn.apply(np.cross(omega, arm))
        rise = normal @ at_point
        slide = at_point - rise * normal
        load = max(0.0, model.normal_n_m * depth - model.normal_n_s_m * rise)
        rub = -model.tangent_n_s_m * slide
        if i < 4:
            stretch = slip[i] + 0.001 * slide
            stretch = stretch - normal * (normal @ stretch)
            most = FRICTION * load / model.tangent_n_m
            stretch *= min(1.0, most / max(np.linalg.norm(stretch), 1e-12))
            slips[i] = stretch
            rub = rub - model.tangent_n_m * stretch
        rub = rub * min(1.0, FRICTION * load / max(np.linalg.norm(rub), 1e-12))
        force += load * normal + rub
        torque += np.cross(arm, turn.inv().apply(load * normal + rub))
    return force, torque, slips


@pytest.mark.parametrize("name", ["x500", "f450"])
def test_ground_contact_matches_its_law(name):
    airframe = load_airframe(name)
    model = contact_model(airframe)
    rng = np.random.default_rng(2)
    count = 200
    normal = rng.normal(0.0, 0.2, (count, 3)) - DOWN
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    pos = rng.uniform([-0.05, -0.05, -0.25], [0.05, 0.05, -0.05], (count, 3)).astype(np.float32)
    vel = rng.normal(0.0, 0.5, (count, 3)).astype(np.float32)
    q = Rotation.from_rotvec(rng.normal(0.0, 0.8, (count, 3))).as_quat().astype(np.float32)
    omega = rng.normal(0.0, 1.0, (count, 3)).astype(np.float32)
    slip = rng.normal(0.0, 0.002, (count, 4, 3)).astype(np.float32)
    arounds, slips = wp.zeros(count, dtype=Surroundings), wp.zeros(count, dtype=FootSlip)
    # the plane passes through the world's origin: its point below pos
    arounds.numpy()["origin_ned"] = pos
    arounds.numpy()["normal_ned"] = normal
    below = -(pos[:, 0] * normal[:, 0] + pos[:, 1] * normal[:, 1]) / normal[:, 2]
    arounds.numpy()["height_agl_m"] = below - pos[:, 2]
    for k, axis in enumerate(("north", "east", "down")):
        slips.numpy()[axis] = slip[:, :, k]
    contacts = wp.zeros(count, dtype=ContactForce)
    rows = [wp.array(pos, dtype=wp.vec3), wp.array(vel, dtype=wp.vec3), wp.array(q, dtype=wp.quat)]
    wp.launch(_touch, count, inputs=[model, arounds, *rows, wp.array(omega, dtype=wp.vec3), slips, contacts])
    got = contacts.numpy()
    touching = 0
    for i in range(count):
        turn = Rotation.from_quat(q[i].astype(float))
        force, torque, new_slip = plain_contact(
            model, airframe, normal[i], pos[i].astype(float), vel[i], turn, omega[i], slip[i]
        )
        touching += bool(force.any())
        scale = max(1.0, np.abs(force).max())
        np.testing.assert_allclose(got["force_ned"][i], force, atol=2e-3 * scale)
        np.testing.assert_allclose(got["torque_frd"][i], torque, atol=2e-3 * scale)
        for k, axis in enumerate(("north", "east", "down")):
            np.testing.assert_allclose(got["foot_slip"][axis][i], new_slip[:, k], atol=1e-6)
    assert count // 2 < touching
