"""What engines of others need to turn a body as exactly as the native one does."""

import warp as wp

from sim.bodies.multirotor import angular_accel
from sim.bodies.multirotor_model import MultirotorModel

wp.set_module_options({"enable_backward": False})


@wp.func
def midstep_torque(
    model: MultirotorModel, omega_frd: wp.vec3, torque_frd: wp.vec3, momentum_z: float, dt: float
) -> wp.vec3:
    """Torque [N m] for an engine that turns a body by Euler's rule, w' = w + dt / I (torque - w x I w).

    With it that is the midpoint rule with the momentum of the rotors, of which the engine does not know: Euler's alone
    lets a tumbling body gain energy.
    """
    middle = omega_frd + (0.5 * dt) * angular_accel(model, omega_frd, torque_frd, momentum_z)
    momentum = wp.cw_mul(model.inertia_frd, middle) + wp.vec3(0.0, 0.0, momentum_z)
    return torque_frd - wp.cross(middle, momentum) + wp.cross(omega_frd, wp.cw_mul(model.inertia_frd, omega_frd))
