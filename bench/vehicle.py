"""How does ReachTarget's car drive, and does that agree with closed forms?

`python -m bench.vehicle` prints the validation table of the documentation: the published prefab gives masses, torques
and slip curves, but nobody published what the car does with them. Run on a platform that is too large to leave.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.reach_target.reach_target_params import PARAMS
from policies.tasks.task import Task

Array = np.ndarray[Any, Any]

NUMBER = {number.name: number.default for number in PARAMS}
WEIGHT_N = NUMBER["mass_kg"] * NUMBER["gravity_m_s2"]
DECISION_S = 0.2


@dataclass(frozen=True, slots=True)
class Check:
    """One line of the table."""

    name: str
    measured: float
    unit: str
    closed_form: float | None
    """What a formula says; None: there is none."""
    remark: str


def car(count: int = 1, half_platform_m: float = 1e6) -> Task:
    """Cars at rest, heading along +z, whose episodes neither end by time nor by a target."""
    task = build_task("ReachTarget", count, task_settings("ReachTarget", {"preset": "as-coded"}))
    task.set_params({"half_platform_m": half_platform_m, "step_limit": 1e6, "half_spawn_m": 0.0})
    task.set_params({"target_height_m": 10.0})  # out of the way
    task.reset(0)
    task.world.q.assign(np.tile(np.array([0.0, 0.0, 0.0, 1.0], np.float32), (count, 1)))  # type: ignore[attr-defined]
    drive(task, (0.0, 0.0, 1.0), 3.0)
    return task


def drive(task: Task, action: tuple[float, float, float], seconds: float) -> Array:
    """Holds steering, throttle and brake; the path as rows of x, y, z, vx, vy, vz every 0.2 s, of the first car."""
    world: Any = task.world  # type: ignore[attr-defined]
    rows = []
    for _ in range(round(seconds / DECISION_S)):
        task.buffers.continuous.assign(np.tile(np.array(action, np.float32), (task.env_count, 1)))
        task.step()
        rows.append(np.concatenate([world.pos.numpy()[0], world.vel.numpy()[0]]))
    return np.array(rows)


def set_rolling(task: Task, speed_m_s: float) -> None:
    """Gives all cars, which head along +z, a speed, wheels turning with it."""
    world: Any = task.world  # type: ignore[attr-defined]
    world.vel.assign(np.tile(np.array([0.0, 0.0, speed_m_s], np.float32), (task.env_count, 1)))
    world.spin.assign(np.full((task.env_count, 4), speed_m_s / NUMBER["wheel_radius_m"], np.float32))


def rest_height() -> Check:
    height = float(drive(car(), (0.0, 0.0, 0.0), 1.0)[-1, 1])
    squeeze = WEIGHT_N / 4.0 / NUMBER["spring_n_m"]
    length = NUMBER["wheel_radius_m"] + NUMBER["suspension_travel_m"] - squeeze
    return Check(
        "height of the centre at rest", height, "m", length - NUMBER["axle_height_m"], "weight on four springs"
    )


def gentle_acceleration() -> Check:
    """At a third of the throttle all wheels hold, and the torque decides."""
    path = drive(car(), (0.0, 1.0 / 3.0, 0.0), 2.0)
    accel = float((path[-1, 5] - path[4, 5]) / (DECISION_S * (len(path) - 5)))
    torque = 4.0 * NUMBER["motor_torque_nm"] / 3.0
    return Check("acceleration at a third of the throttle", accel, "m/s²", _accel(torque), "torque over car and wheels")


def sprint() -> Check:
    speed = drive(car(), (0.0, 1.0, 0.0), 4.0)[:, 5]
    k = int(np.argmax(speed >= 10.0))
    seconds = DECISION_S * (k + (10.0 - speed[k - 1]) / (speed[k] - speed[k - 1]))
    return Check("0 to 10 m/s at full throttle", seconds, "s", None, "the unloaded front wheels spin")


def speed_at_the_edge() -> Check:
    path = drive(car(), (0.0, 1.0, 0.0), 6.0)
    speed = float(np.interp(50.0, path[:, 2], path[:, 5]))
    return Check("speed after 50 m at full throttle", speed, "m/s", None, "from the middle to an edge")


def top_speed() -> Check:
    speed = float(drive(car(), (0.0, 1.0, 0.0), 40.0)[-1, 5])
    return Check(
        "speed after an episode (40 s) at full throttle",
        speed,
        "m/s",
        None,
        f"no drag: wheel damping alone would end it at "
        f"{NUMBER['motor_torque_nm'] / NUMBER['wheel_damping_nms'] * NUMBER['wheel_radius_m']:.0f} m/s",
    )


def braking() -> Check:
    task = car()
    set_rolling(task, 10.0)
    start = float(task.world.pos.numpy()[0, 2])  # type: ignore[attr-defined]
    distance = float(drive(task, (0.0, 0.0, 1.0), 4.0)[-1, 2]) - start
    best = 10.0**2 / (2.0 * _accel(4.0 * NUMBER["brake_torque_nm"]))
    return Check(
        "braking distance from 10 m/s", distance, "m", best, "the brakes' torque, if the rear wheels did not lift"
    )


def braking_gently() -> Check:
    task = car()
    set_rolling(task, 10.0)
    start = float(task.world.pos.numpy()[0, 2])  # type: ignore[attr-defined]
    distance = float(drive(task, (0.0, 0.0, 0.25), 8.0)[-1, 2]) - start
    return Check(
        "braking distance from 10 m/s, a quarter of the brake",
        distance,
        "m",
        10.0**2 / (2.0 * _accel(NUMBER["brake_torque_nm"])),
        "the brakes' torque",
    )


def turn_radius() -> Check:
    task = car()
    drive(task, (1.0, 0.02, 0.0), 5.0)
    path = drive(task, (1.0, 0.0, 0.0), 10.0)
    x, z = path[:, 0], path[:, 2]
    centre = np.linalg.lstsq(np.stack([2 * x, 2 * z, np.ones_like(x)], axis=1), x * x + z * z, rcond=None)[0]
    radius = float(np.sqrt(centre[2] + centre[0] ** 2 + centre[1] ** 2))
    rear = float(np.sqrt(radius**2 - (NUMBER["wheelbase_m"] / 2.0) ** 2))
    kinematic = NUMBER["wheelbase_m"] / np.tan(np.radians(NUMBER["steer_max_deg"]))
    return Check(
        "turn radius of the rear axle, slow",
        rear,
        "m",
        float(kinematic),
        "wheelbase over tan 25 deg; the front wheels stay parallel",
    )


def cornering() -> Check:
    """The most side acceleration on a circle of full steering, while the speed grows."""
    task = car()
    best = 0.0
    world: Any = task.world  # type: ignore[attr-defined]
    for _ in range(150):
        drive(task, (1.0, 0.15, 0.0), DECISION_S)
        rate = float(world.omega_car.numpy()[0, 1])
        best = max(best, abs(rate) * float(np.linalg.norm(world.vel.numpy()[0])))
    limit = NUMBER["side_stiffness"] * NUMBER["side_extremum"] * NUMBER["gravity_m_s2"]
    return Check("greatest side acceleration", best, "m/s²", limit, "peak of the side curve times gravity")


CHECKS = (
    rest_height,
    gentle_acceleration,
    sprint,
    speed_at_the_edge,
    top_speed,
    braking,
    braking_gently,
    turn_radius,
    cornering,
)


def _accel(torque_nm: float) -> float:
    """Of the car by a torque on its wheels, whose own turning takes a fraction of it."""
    wheels_kg = 4.0 * 0.5 * NUMBER["wheel_mass_kg"]
    return torque_nm / NUMBER["wheel_radius_m"] / (NUMBER["mass_kg"] + wheels_kg)


def table() -> str:
    """The validation table, in Markdown."""
    lines = ["| what | measured | closed form | |", "|---|---|---|---|"]
    for check in (measure() for measure in CHECKS):
        closed = "-" if check.closed_form is None else f"{check.closed_form:.3g} {check.unit}"
        lines.append(f"| {check.name} | {check.measured:.3g} {check.unit} | {closed} | {check.remark} |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(table())
