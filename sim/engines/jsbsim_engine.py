"""JSBSim moves multirotors: its equations of motion; our rotors, air, battery and contact are forces from outside.

In: motor commands and wind. Out: truth. JSBSim knows the forces of a step only after it has moved by those of the one
before: each millisecond it runs twice, first in place so that it takes up the forces of now, then by the step.
What it makes of them it is asked for in north, east and up from where it was put.
"""

from typing import Any

import numpy as np
import warp as wp

from common.kernels import SUBSTEPS, TICK_S, vec8
from common.rng import draw_tick
from sim.bodies.multirotor import (
    BodyState,
    StepInputs,
    air_wrench,
    body_tick,
    body_truth,
    contact_near,
    drain_battery,
    step_inputs,
    touched,
)
from sim.bodies.multirotor_model import MultirotorModel
from sim.engines.jsbsim_body import JsbsimBody
from sim.engines.jsbsim_planet import FT_M, LBF_N
from sim.engines.left_poses import LeftPoses
from sim.engines.midstep import midstep_torque
from sim.launches import RecordedLaunches
from sim.rig import Rig
from sim.truth import Truth
from sim.world.world import World, world_at

wp.set_module_options({"enable_backward": False})

_SUBSTEP_S = wp.constant(TICK_S / SUBSTEPS)
_FT = wp.constant(FT_M)
_LBF = wp.constant(LBF_N)
vec6 = wp.types.vector(length=6, dtype=wp.float32)
vec12 = wp.types.vector(length=12, dtype=wp.float32)


@wp.kernel(enable_backward=False)
def begin(
    models: wp.array(dtype=MultirotorModel),
    states: wp.array(dtype=BodyState),
    worlds: wp.array(dtype=World),
    i_world: wp.array(dtype=int),
    commands: wp.array(dtype=vec8),
    wind_ned: wp.array(dtype=wp.vec3),
    ticks: wp.array(dtype=wp.int64),
    inputs: wp.array(dtype=StepInputs),
) -> None:
    """What acts over the tick; nothing is felt yet of it. One that is held in hands has its tick here."""
    i = wp.tid()
    world = world_at(worlds[i_world[i]], draw_tick(ticks[i]))
    if states[i].is_held == 1:
        states[i] = body_tick(models[i], states[i], commands[i], wind_ned[i], world)
        return
    inputs[i] = step_inputs(models[i], states[i], commands[i], wind_ned[i], world, _SUBSTEP_S)
    states[i].height_agl_m = inputs[i].around.height_agl_m
    states[i].accel_frd = wp.vec3()
    states[i].gyro_frd = wp.vec3()
    states[i].is_on_ground = 0


@wp.kernel(enable_backward=False)
def push(
    models: wp.array(dtype=MultirotorModel),
    states: wp.array(dtype=BodyState),
    inputs: wp.array(dtype=StepInputs),
    wrenches: wp.array(dtype=vec6),
) -> None:
    """Force [lbf] and moment [lbf ft] along frd in mid-step, the rotors' gyroscopic one included; turns the rotors."""
    i = wp.tid()
    if states[i].is_held == 1:
        return
    model = models[i]
    body = states[i]
    around = inputs[i].around
    r_ned_from_frd = wp.quat_to_matrix(body.q_ned_from_frd)
    r_frd_from_ned = wp.transpose(r_ned_from_frd)
    wrench = air_wrench(model, body, inputs[i], r_frd_from_ned)
    force = wrench.force_frd
    torque = wrench.torque_frd
    if around.is_near_ground + around.is_near_obstacle + around.is_near_solid > 0:
        contact = contact_near(model.contact, body, around, r_ned_from_frd, _SUBSTEP_S)
        force += r_frd_from_ned * contact.force_ned
        torque += contact.torque_frd
        body = touched(model.contact, body, contact)
    body.rotor_speed = wrench.speed
    body.accel_frd += (model.mass_inv / float(SUBSTEPS)) * force
    states[i] = body
    inputs[i].around.obstacle_shift_ned += _SUBSTEP_S * around.obstacle_vel_ned
    force += wp.cross((0.5 * _SUBSTEP_S) * body.omega_frd, force)  # the body turns meanwhile
    torque = midstep_torque(model, body.omega_frd, torque, wrench.momentum_z, _SUBSTEP_S)
    force = force / _LBF
    torque = torque / (_LBF * _FT)
    wrenches[i] = vec6(force[0], force[1], force[2], torque[0], torque[1], torque[2])


@wp.kernel(enable_backward=False)
def take(
    states: wp.array(dtype=BodyState), motions: wp.array(dtype=vec12), origins_ned: wp.array(dtype=wp.vec3)
) -> None:
    """What JSBSim has made of it, and what the gyroscopes felt of the tick so far."""
    i = wp.tid()
    if states[i].is_held == 1:
        return
    body = states[i]
    m = motions[i]
    body.pos_ned = origins_ned[i] + _FT * wp.vec3(m[0], m[1], -m[2])
    body.vel_ned = _FT * wp.vec3(m[3], m[4], m[5])
    roll = wp.quat_from_axis_angle(wp.vec3(1.0, 0.0, 0.0), m[6])
    pitch = wp.quat_from_axis_angle(wp.vec3(0.0, 1.0, 0.0), m[7])
    yaw = wp.quat_from_axis_angle(wp.vec3(0.0, 0.0, 1.0), m[8])
    body.q_ned_from_frd = wp.normalize(yaw * pitch * roll)
    omega_frd = wp.vec3(m[9], m[10], m[11])
    body.gyro_frd += (0.5 / float(SUBSTEPS)) * (body.omega_frd + omega_frd)
    body.omega_frd = omega_frd
    states[i] = body


@wp.kernel(enable_backward=False)
def conclude(
    models: wp.array(dtype=MultirotorModel),
    states: wp.array(dtype=BodyState),
    inputs: wp.array(dtype=StepInputs),
    truths: wp.array(dtype=Truth),
) -> None:
    """The tick is over: battery and truth."""
    i = wp.tid()
    if states[i].is_held == 0:
        states[i] = drain_battery(models[i], states[i], inputs[i].density_ratio, TICK_S)
    truths[i] = body_truth(states[i])


class JsbsimEngine:
    """See sim/engines/engine.py.

    Args:
        rig: whose multirotors it moves, on the CPU.

    Raises:
        ValueError: the rig has other vehicles.
    """

    def __init__(self, rig: Rig) -> None:
        if rig.body.State is not BodyState:
            raise ValueError("the engine jsbsim moves multirotors; other vehicles have the native one")
        self._rig = rig
        self._states: Any = rig.arrays.body.numpy()  # live
        self._bodies = [JsbsimBody(model) for model in rig.arrays.model.numpy()]
        self._inputs: Any = wp.zeros(rig.vehicle_count, dtype=StepInputs)
        self._wrenches: Any = wp.zeros(rig.vehicle_count, dtype=vec6)
        self._motions: Any = wp.zeros(rig.vehicle_count, dtype=vec12)
        self._origins_ned: Any = wp.zeros(rig.vehicle_count, dtype=wp.vec3)
        self._launches = RecordedLaunches(self._record)
        self._left = LeftPoses(self._states)

    def boot(self, is_chosen: Any) -> None:
        self._rig.place(is_chosen)
        self._left.forget(is_chosen.numpy())

    def step(self, commands: Any, wind_ned: Any) -> None:
        for moved in self._left.moved():
            self._origins_ned.numpy()[moved] = self._bodies[moved].put(self._states[moved])
        begun, pushed, taken, concluded = self._launches.of(commands, wind_ned)
        begun.launch()
        free = np.flatnonzero(self._states["is_held"] == 0)
        wrenches, motions = self._wrenches.numpy(), self._motions.numpy()
        for _ in range(SUBSTEPS):
            pushed.launch()
            for i in free:
                motions[i] = self._bodies[i].moved(wrenches[i].tolist())
            taken.launch()
        concluded.launch()
        self._left.leave()

    def _record(self, commands: Any, wind_ned: Any) -> list[Any]:
        a = self._rig.arrays
        inputs = {
            begin: [a.model, a.body, a.worlds, a.i_world, commands, wind_ned, a.tick, self._inputs],
            push: [a.model, a.body, self._inputs, self._wrenches],
            take: [a.body, self._motions, self._origins_ned],
            conclude: [a.model, a.body, self._inputs, a.truth],
        }
        count = self._rig.vehicle_count
        return [wp.launch(kernel, count, of, record_cmd=True) for kernel, of in inputs.items()]
