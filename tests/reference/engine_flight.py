"""The same 20 s by different engines and by a fourth-order integration: steps of 5 and 13 m, a turn, on the truth.

The law is a plain cascade at 250 Hz that sees position, velocity, attitude and rate as they are, so that only who moves
the body differs. The reference is the equations of tests/reference/test_body_reference.py, classical Runge-Kutta.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME, GRAVITY_M_S2
from common.kernels import TICK_S
from sim.bodies.multirotor_model import multirotor_model
from sim.engines.native import NativeEngine
from sim.sensors.sensors import sensor_model
from sim.stepped import SteppedRig
from sim.wind import wind_model
from sim.world.world import WorldConfig, build_world
from tests.reference.test_body_reference import derivative

SECONDS = 20.0
TICKS = round(SECONDS / TICK_S)
START_M = 30.0  # high enough for no ground effect
PLAIN = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0)
SUBSTEPS = 2


def target_of(time_s):
    """Where to be, and the heading."""
    if time_s < 2.0:
        return np.array([0.0, 0.0, -START_M]), 0.0
    if time_s < 10.0:
        return np.array([5.0, 0.0, -START_M]), 0.0
    return np.array([5.0, 13.0, -START_M - 3.0]), 1.0


class Law:
    """Position, velocity, attitude, rate; thrusts to the rotors of an X."""

    def __init__(self, airframe, model):
        self._mass = airframe.body.mass_kg
        self._inertia = np.array([airframe.body.inertia_xx_kg_m2, airframe.body.inertia_yy_kg_m2,
                                  airframe.body.inertia_zz_kg_m2])  # fmt: skip
        rotors, rotor = airframe.rotors, airframe.rotor_model
        ratio = rotor.torque_n_m_s2 / rotor.thrust_n_s2
        per_thrust = [[-1.0, -r.y_m, r.x_m, r.spin * ratio] for r in rotors]
        self._thrusts = np.linalg.inv(np.array(per_thrust).T)
        self._k, self._top = rotor.thrust_n_s2, float(model.max_speed_rad_s)
        self._curve = float(model.command_curve)

    def __call__(self, time_s, pos, vel, q, omega):
        """Commands [0..1] of the four rotors."""
        place, yaw = target_of(time_s)
        wanted = np.clip(1.0 * (place - pos), -4.0, 4.0)
        accel = np.clip(2.5 * (wanted - vel), -6.0, 6.0)
        force = self._mass * (accel - np.array([0.0, 0.0, GRAVITY_M_S2]))
        turn = Rotation.from_quat(q)
        down = -force / np.linalg.norm(force)
        right = np.cross(down, [np.cos(yaw), np.sin(yaw), 0.0])
        right /= np.linalg.norm(right)
        attitude = Rotation.from_matrix(np.column_stack([np.cross(right, down), right, down]))
        error = (turn.inv() * attitude).as_rotvec()
        torque = self._inertia * (18.0 * (np.array([6.0, 6.0, 2.5]) * error - omega))
        thrusts = self._thrusts @ np.array([force @ turn.apply([0.0, 0.0, 1.0]), *torque])
        share = np.sqrt(np.clip(thrusts, 0.0, None) / self._k) / self._top
        root = (np.sqrt((1 - self._curve) ** 2 + 4 * self._curve * np.clip(share, 0.0, 1.0)) - 1 + self._curve) / (
            2 * self._curve
        )
        return root**2


class TruthBoard:
    """A board that knows the truth, and flies the law by it."""

    is_fast = False

    def __init__(self, law, states):
        self._law, self._states = law, states
        self.ticks = 0

    def boot(self, is_chosen):
        """Has nothing to forget."""

    def give(self, samples, truth):  # noqa: ARG002
        self._truth = truth

    def take(self, commands):
        row = self._truth.numpy()[0]
        self._states.append(np.concatenate([row["pos_ned"], row["q_ned_from_frd"]]).astype(float))
        self.ticks += 1
        names = ("pos_ned", "vel_ned", "q_ned_from_frd", "omega_frd")
        asked = self._law(self.ticks * TICK_S, *(row[name].astype(float) for name in names))
        commands.numpy()[0, :4] = asked


def parts():
    airframe = load_airframe("x500")
    model = multirotor_model(airframe, DEFAULT_HOME.alt_m)
    return airframe, model, Law(airframe, model)


def hover_speed(airframe, density):
    """Of each rotor [rad/s]."""
    per_rotor_n = airframe.body.mass_kg * GRAVITY_M_S2 / len(airframe.rotors)
    return np.sqrt(per_rotor_n / (airframe.rotor_model.thrust_n_s2 * density))


def density_at(model, down_m):
    return float(model.home_density_ratio) * (1.0 + 9.6e-5 * down_m)


def flown(engine=NativeEngine):
    """Position and attitude after each tick, shape (ticks, 7)."""
    airframe, model, law = parts()
    states = []
    rig = SteppedRig(
        airframe, build_world(PLAIN), sensor_model(0.0, DEFAULT_HOME), wind_model(0.0), home=DEFAULT_HOME,
        engine=engine, board=lambda _: TruthBoard(law, states),
    )  # fmt: skip
    made, body = rig.arrays.model.numpy(), rig.arrays.body.numpy()
    made["battery"]["resistance_ohm"] = 0.0
    made["battery"]["capacity_c"] *= 1000.0
    body["battery_charge_c"] *= 1000.0
    body["pos_ned"][0] = (0.0, 0.0, -START_M)
    body["rotor_speed"][0, :4] = hover_speed(airframe, density_at(model, -START_M))
    rig.advance(TICKS)
    return np.array(states)


def integrated():
    """The same by Runge and Kutta, in float64."""
    airframe, model, law = parts()
    speed = np.full(4, hover_speed(airframe, density_at(model, -START_M)))
    state = np.concatenate([[0.0, 0.0, -START_M], np.zeros(3), [0.0, 0.0, 0.0, 1.0], np.zeros(3), speed])
    curve, top = float(model.command_curve), float(model.max_speed_rad_s)
    states, command = [], np.zeros(4)
    for tick in range(TICKS):
        target = top * (curve * command + (1.0 - curve) * np.sqrt(command))
        density, dt = density_at(model, state[2]), TICK_S / SUBSTEPS
        for _ in range(SUBSTEPS):

            def slope(at, target=target, density=density):
                return derivative(airframe, density, target, np.zeros(3), 1.0e6, at)

            k1 = slope(state)
            k2 = slope(state + 0.5 * dt * k1)
            k3 = slope(state + 0.5 * dt * k2)
            k4 = slope(state + dt * k3)
            state = state + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            state[6:10] /= np.linalg.norm(state[6:10])
        states.append(np.concatenate([state[:3], state[6:10]]))
        command = law((tick + 1) * TICK_S, state[:3], state[3:6], state[6:10], state[10:13])
    return np.array(states)


def apart(one, other):
    """Greatest distance [m] and angle [deg] between two flights."""
    turns = Rotation.from_quat(one[:, 3:]).inv() * Rotation.from_quat(other[:, 3:])
    return np.linalg.norm(one[:, :3] - other[:, :3], axis=1).max(), np.degrees(turns.magnitude()).max()
