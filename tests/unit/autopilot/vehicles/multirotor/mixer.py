"""Runs the allocation alone on many demands at once."""

import numpy as np
import numpy.typing as npt
import warp as wp

from autopilot.vehicles.multirotor.allocation import Allocation, allocate, motor_commands, speed_fraction
from autopilot.vehicles.multirotor.control_airframe import ControlAirframe, control_airframe
from common.airframe import Airframe
from common.kernels import vec8

wp.set_module_options({"enable_backward": False})


@wp.kernel(enable_backward=False)
def mixer_kernel(
    airframe: ControlAirframe,
    torque_frd: wp.array(dtype=wp.vec3),
    collective_n: wp.array(dtype=float),
    low: float,
    high: float,
    voltage_fraction: float,
    results: wp.array(dtype=Allocation),
    commands: wp.array(dtype=vec8),
    made_n: wp.array(dtype=vec8),
):
    i = wp.tid()
    result = allocate(airframe, torque_frd[i], collective_n[i], low, high)
    command = motor_commands(airframe, result.thrust_n, voltage_fraction)
    made = vec8()
    for k in range(airframe.rotor_count):
        speed = airframe.max_speed_rad_s * voltage_fraction * speed_fraction(command[k], airframe.command_curve)
        made[k] = airframe.thrust_n_s2 * speed * speed
    results[i] = result
    commands[i] = command
    made_n[i] = made


def mix(
    airframe: Airframe,
    torque_frd: npt.ArrayLike,
    collective_n: npt.ArrayLike,
    low: float,
    high: float,
    voltage_fraction: float = 1.0,
) -> tuple[npt.NDArray[np.void], npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Allocations, motor commands and the rotor thrusts those make, for demands of shape (n, 3) and (n,)."""
    torque = wp.array(np.atleast_2d(np.asarray(torque_frd, np.float32)), dtype=wp.vec3, device="cpu")
    collective = wp.array(np.atleast_1d(np.asarray(collective_n, np.float32)), dtype=float, device="cpu")
    count = len(collective)
    results = wp.zeros(count, dtype=Allocation, device="cpu")
    commands, made = (wp.zeros(count, dtype=vec8, device="cpu") for _ in range(2))
    inputs = [control_airframe(airframe), torque, collective, low, high, voltage_fraction, results, commands, made]
    wp.launch(mixer_kernel, dim=count, inputs=inputs, device="cpu")
    return results.numpy().copy(), commands.numpy().copy(), made.numpy().copy()


def with_rotors(airframe: Airframe, count: int) -> Airframe:
    """The airframe with `count` equal rotors on a circle, turning alternately, the first at 30 deg."""
    arm = 0.25
    angles = np.radians(30.0) + 2.0 * np.pi * np.arange(count) / count
    rotors = [
        airframe.rotors[0].model_copy(
            update={"x_m": arm * float(np.cos(angle)), "y_m": arm * float(np.sin(angle)), "spin": 1 - 2 * (i % 2)}
        )
        for i, angle in enumerate(angles)
    ]
    return airframe.model_copy(update={"rotors": rotors})
