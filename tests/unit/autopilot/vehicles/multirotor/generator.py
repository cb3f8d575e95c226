"""Runs the setpoint trajectory alone, with an estimate that follows it, and records it per frame."""

import numpy as np
import numpy.typing as npt
import warp as wp

from autopilot.ports import Estimate, Setpoint
from autopilot.vehicles.multirotor.params import ControlParams, control_params
from autopilot.vehicles.multirotor.position import velocity_setpoint
from autopilot.vehicles.multirotor.trajectory import TrajectoryState, trajectory_at_estimate, trajectory_step

wp.set_module_options({"enable_backward": False})

FRAME_S = 0.02
FREE = {
    "kind": 1,
    "is_armed": 1,
    "is_landed": 0,
    "pos_ned": (np.nan,) * 3,
    "vel_ned": (np.nan,) * 3,
    "accel_ned": (np.nan,) * 3,
    "yaw": np.nan,
    "yaw_rate": np.nan,
    "path_start_ned": (np.nan,) * 3,
    "cruise_speed": np.nan,
    "climb_speed": np.nan,
    "descend_speed": np.nan,
    "exit_speed": 0.0,
    "q_ned_from_frd": (0.0, 0.0, 0.0, 1.0),
    "omega_frd": (0.0, 0.0, 0.0),
    "thrust": 0.0,
}
"""Setpoint fields that ask for nothing."""


@wp.kernel(enable_backward=False)
def generator_kernel(
    params: ControlParams,
    setpoints: wp.array(dtype=Setpoint),
    estimates: wp.array(dtype=Estimate),
    states: wp.array(dtype=TrajectoryState),
    is_start: int,
    log: wp.array2d(dtype=TrajectoryState),
):
    i = wp.tid()
    est = estimates[i]
    state = states[i]
    if is_start == 1:
        state = trajectory_at_estimate(est, 1)
    for k in range(log.shape[1]):
        state = trajectory_step(params, state, est, setpoints[i], 0.02)
        est.pos_ned = state.pos_ned
        est.vel_ned = state.vel_ned
        log[i, k] = state
    states[i] = state
    estimates[i] = est


@wp.kernel(enable_backward=False)
def command_kernel(
    params: ControlParams,
    setpoints: wp.array(dtype=Setpoint),
    estimates: wp.array(dtype=Estimate),
    states: wp.array(dtype=TrajectoryState),
    vel_sp_ned: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    state = trajectory_step(params, states[i], estimates[i], setpoints[i], 0.02)
    vel_sp_ned[i] = velocity_setpoint(params, state, estimates[i])
    states[i] = state


class Generator:
    """The trajectory generator of `count` vehicles, starting at rest at the origin of ned."""

    def __init__(self, count: int = 1, params: dict[str, float] | None = None) -> None:
        self.params = control_params(params)
        self.setpoints = wp.zeros(count, dtype=Setpoint, device="cpu")
        self.estimates = wp.zeros(count, dtype=Estimate, device="cpu")
        self.states = wp.zeros(count, dtype=TrajectoryState, device="cpu")
        self.estimates.numpy()["q_ned_from_frd"] = (0.0, 0.0, 0.0, 1.0)
        self.count = count
        self.is_started = False

    def ask(self, **fields: object) -> None:
        """Sets all setpoints: the fields given, nothing asked for in the others."""
        rows = self.setpoints.numpy()
        for name, value in {**FREE, **fields}.items():
            rows[name] = value

    def run(self, seconds: float) -> npt.NDArray[np.void]:
        """The trajectory at each 20 ms frame, shape (count, frames)."""
        log = wp.zeros((self.count, round(seconds / FRAME_S)), dtype=TrajectoryState, device="cpu")
        start = 0 if self.is_started else 1
        inputs = [self.params, self.setpoints, self.estimates, self.states, start, log]
        wp.launch(generator_kernel, dim=self.count, inputs=inputs, device="cpu")
        self.is_started = True
        return log.numpy().copy()

    def command(self) -> npt.NDArray[np.float32]:
        """Velocity setpoints [m/s], ned, after one frame in which the estimate stays as it is, shape (count, 3)."""
        vel_sp_ned = wp.zeros(self.count, dtype=wp.vec3, device="cpu")
        inputs = [self.params, self.setpoints, self.estimates, self.states, vel_sp_ned]
        wp.launch(command_kernel, dim=self.count, inputs=inputs, device="cpu")
        return vel_sp_ned.numpy().copy()
