"""The derivation: committed code is what it writes, and its Jacobians are those of the models."""

import numpy as np
import pytest
import sympy as sp

from autopilot.estimator.derive import COUNT, GENERATED_PATH, generate, jacobian, transition
from tests.unit.autopilot.estimator.flights import quat_conjugate, quat_multiply, quat_rotate, rotvec_from_quat

GRAVITY = np.array([0.0, 0.0, 9.80665])


def from_rotvec(rotvec: np.ndarray) -> np.ndarray:
    angle = np.linalg.norm(rotvec)
    return np.append(0.5 * np.sinc(0.5 * angle / np.pi) * rotvec, np.cos(0.5 * angle))


def test_committed_code_is_what_the_derivation_writes() -> None:
    assert GENERATED_PATH.read_text(encoding="utf-8") == generate()


class Motion:
    """A nominal state, an IMU sample, and the strapdown equations on states with an error."""

    def __init__(self) -> None:
        rng = np.random.default_rng(3)
        self.q = from_rotvec(rng.normal(0.0, 0.7, 3))
        self.gyro, self.accel = rng.normal(0.0, 0.5, 3), rng.normal(0.0, 3.0, 3) - GRAVITY
        self.dt_s = 1e-3

    def moved(self, error: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        q = quat_multiply(from_rotvec(error[0:3]), self.q)
        force_ned = quat_rotate(q, self.accel - error[12:15])
        pos = error[6:9] + error[3:6] * self.dt_s
        vel = error[3:6] + (force_ned + GRAVITY) * self.dt_s
        return quat_multiply(q, from_rotvec((self.gyro - error[9:12]) * self.dt_s)), vel, pos

    def symbols(self) -> dict[sp.Symbol, float]:
        columns = np.stack([quat_rotate(self.q, axis) for axis in np.eye(3)], -1)
        force_ned = quat_rotate(self.q, self.accel) * self.dt_s
        values = {sp.Symbol(f"rot[{r}, {c}]"): columns[r, c] for r in range(3) for c in range(3)}
        values |= {sp.Symbol(f"delta_vel_ned[{k}]", real=True): force_ned[k] for k in range(3)}
        return values | {sp.Symbol("dt_s"): self.dt_s}


def test_transition_is_the_derivative_of_the_strapdown_equations() -> None:
    motion = Motion()
    matrix = np.array(transition().subs(motion.symbols()), dtype=float)
    q0, vel0, pos0 = motion.moved(np.zeros(COUNT))
    step = 1e-6
    for column in range(15):
        error = np.zeros(COUNT)
        error[column] = step
        q, vel, pos = motion.moved(error)
        turn = rotvec_from_quat(quat_multiply(q, quat_conjugate(q0)))
        numeric = np.concatenate([turn, vel - vel0, pos - pos0]) / step
        # the matrix is of first order in the step: its error is of the order of rate times dt_s²
        np.testing.assert_allclose(matrix[:9, column], numeric, atol=2e-6)


def body_axis(error: np.ndarray, q: np.ndarray, k: int) -> np.ndarray:
    return quat_rotate(quat_multiply(from_rotvec(error[0:3]), q), np.eye(3)[k])


@pytest.mark.parametrize("k", [0, 1, 2])
@pytest.mark.parametrize("name", ["mag", "drag", "range", "speed"])
def test_observation_rows_are_the_derivatives_of_the_measurements(name: str, k: int) -> None:
    rng = np.random.default_rng(k)
    q = from_rotvec(rng.normal(0.0, 0.3, 3))
    earth, vel, wind = rng.normal(0.0, 0.4, 3), rng.normal(0.0, 4.0, 3), np.array([2.0, -3.0, 0.0])
    height, linear, square = 7.0, 0.15, 0.01

    def measured(error: np.ndarray) -> float:
        axis = body_axis(error, q, k)
        if name == "mag":
            return float(axis @ (earth + error[15:18]) + error[18 + k])
        if name == "range":
            return float((height + error[23] - error[8]) / body_axis(error, q, 2)[2])
        if name == "speed":
            return float(axis @ (vel + error[3:6]))
        speed = axis @ (vel + error[3:6] - wind - np.append(error[21:23], 0.0))
        return float(-(linear * speed + square * abs(speed) * speed) + error[12 + k])

    axis = body_axis(np.zeros(COUNT), q, 2 if name == "range" else k)
    speed = abs(float(axis @ (vel - wind)))
    values: dict[sp.Symbol, float] = {}
    for vector, numbers in (
        ("axis_ned", axis),
        ("earth_field_ned", earth),
        ("vel_air_ned", vel - wind),
        ("vel_ned", vel),
    ):
        values |= {sp.Symbol(f"{vector}[{m}]", real=True): numbers[m] for m in range(3)}
    for scalar, number in (("linear", linear), ("square", square), ("speed_abs", speed)):
        values[sp.Symbol(scalar, real=True)] = number
    values[sp.Symbol("height")] = height
    entries, picked = jacobian(name)
    row = np.zeros(COUNT)
    for index, entry in entries.items():
        row[index] = float(entry.subs(values))
    if picked >= 0:
        row[picked + k] += 1.0
    step = 1e-6
    numeric = [(measured(step * unit) - measured(-step * unit)) / (2.0 * step) for unit in np.eye(COUNT)]
    np.testing.assert_allclose(row, numeric, atol=1e-6)
