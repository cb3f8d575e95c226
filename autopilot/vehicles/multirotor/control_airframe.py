"""What the controller knows of its airframe: mass, inertia, allocation matrices and the motor curve.

Built once on the host from the airframe file; read-only in kernels.
"""

from collections.abc import Callable, Collection
from math import hypot
from typing import Any

import numpy as np
import warp as wp

from common.airframes.multirotor import MultirotorAirframe, speed_at
from common.kernels import MAX_MOTORS, vec8

wp.set_module_options({"enable_backward": False})


@wp.struct
class ControlAirframe:
    rotor_count: int
    mass_kg: float
    inertia_kg_m2: wp.vec3  # principal moments about frd
    arm_roll_m: vec8  # torque about frd x per rotor thrust
    arm_pitch_m: vec8
    arm_yaw_m: vec8
    mix_thrust: vec8  # rotor thrust per newton of collective thrust
    mix_roll: vec8  # [N] per N m
    mix_pitch: vec8
    mix_yaw: vec8
    thrust_n_s2: float  # rotor thrust per squared speed
    max_speed_rad_s: float  # at full command and full battery
    command_curve: float  # a in speed share = a u + (1 - a) sqrt(u)
    idle_command: float
    idle_speed_fraction: float  # speed at that command over the greatest
    motor_time_s: float  # first-order lag, mean of rise and fall
    full_voltage_v: float
    left_out: int  # rotors not to be used, as bits; they stay at idle and count for nothing


def effectiveness(airframe: MultirotorAirframe) -> np.ndarray:
    """Roll, pitch, yaw torque [N m] and collective thrust [N] per newton of each rotor, shape (4, rotors).

    A rotor pushes along -z of frd; a rotor turning counter-clockwise seen from above (spin +1) drags the body
    clockwise, which is positive yaw in frd.
    """
    yaw_arm = airframe.rotor_model.torque_n_m_s2 / airframe.rotor_model.thrust_n_s2
    columns = [(-rotor.y_m, rotor.x_m, rotor.spin * yaw_arm, 1.0) for rotor in airframe.rotors]
    return np.array(columns, dtype=np.float64).T


def mixing(airframe: MultirotorAirframe, left_out: Collection[int] = ()) -> np.ndarray:
    """Rotor thrusts [N] per unit of roll, pitch, yaw torque and collective thrust, shape (rotors, 4).

    The least-effort inverse, without the rotors `left_out`. Where the rest cannot make all four (three rotors), yaw is
    left to itself.
    """
    forward = effectiveness(airframe)
    forward[:, list(left_out)] = 0.0
    inverse = np.zeros((forward.shape[1], 4))
    rows = [0, 1, 2, 3] if np.linalg.matrix_rank(forward, tol=1.0e-6) == 4 else [0, 1, 3]
    inverse[:, rows] = np.linalg.pinv(forward[rows])
    return inverse


def _vec8(values: np.ndarray) -> vec8:
    return vec8(*np.concatenate([values, np.zeros(MAX_MOTORS - len(values))]).astype(float).tolist())


def control_airframe(airframe: MultirotorAirframe, left_out: Collection[int] = ()) -> ControlAirframe:
    """The controller's view of an airframe file, whose rotors `left_out` (from 0) have failed."""
    forward, inverse = effectiveness(airframe), mixing(airframe, left_out)
    forward[:, list(left_out)] = 0.0
    body, rotor = airframe.body, airframe.rotor_model
    row = ControlAirframe()
    row.rotor_count = len(airframe.rotors)
    row.mass_kg = body.mass_kg
    row.inertia_kg_m2 = wp.vec3(body.inertia_xx_kg_m2, body.inertia_yy_kg_m2, body.inertia_zz_kg_m2)
    row.arm_roll_m, row.arm_pitch_m, row.arm_yaw_m = (_vec8(forward[k]) for k in range(3))
    row.mix_roll, row.mix_pitch, row.mix_yaw, row.mix_thrust = (_vec8(inverse[:, k]) for k in range(4))
    row.thrust_n_s2 = rotor.thrust_n_s2
    row.max_speed_rad_s = rotor.max_speed_rad_s
    row.command_curve = rotor.command_curve
    row.idle_command = rotor.idle_command
    curve = rotor.command_curve
    row.idle_speed_fraction = speed_at(rotor.idle_command, curve)
    row.motor_time_s = 0.5 * (rotor.spin_up_time_s + rotor.spin_down_time_s)
    row.left_out = sum(1 << rotor for rotor in left_out)
    row.full_voltage_v = airframe.battery.cells * airframe.battery.full_cell_v
    return row


def opposite_rotor(airframe: MultirotorAirframe, rotor: int) -> int:
    """The rotor that is nearest to the other side of the centre: left out together, the rest stays balanced."""
    hub = airframe.rotors[rotor]
    return min(
        range(len(airframe.rotors)),
        key=lambda other: hypot(airframe.rotors[other].x_m + hub.x_m, airframe.rotors[other].y_m + hub.y_m),
    )


def rotors_leaver(rows: np.ndarray[Any, Any], airframe: MultirotorAirframe) -> Callable[[Collection[int]], None]:
    """A function that lets the control allocation of a vehicle do without some of its rotors.

    Args:
        rows: live structured view, shape (1,), of the vehicle's ControlAirframe row.
        airframe: the vehicle.
    """

    def leave_out(rotors: Collection[int]) -> None:
        row = control_airframe(airframe, sorted({*rotors, *(opposite_rotor(airframe, rotor) for rotor in rotors)}))
        for name in ("arm_roll_m", "arm_pitch_m", "arm_yaw_m", "mix_thrust", "mix_roll", "mix_pitch", "mix_yaw"):
            rows[name][0] = list(getattr(row, name))
        rows["left_out"][0] = row.left_out

    return leave_out
