"""Hover's numbers and kernels, one thread per environment, in the order of a decision.

act       actions to setpoints                           (then the rig advances)
judge     the vector, the reward, the end                (rows that end start anew:)
prepare   numbers and seeds of the new episode           (then vehicles take their hovers)
place     wind, sensors and mass, the first vector
"""

import warp as wp

from autopilot.ports import SETPOINT_RATE, Estimate, Setpoint
from policies.tasks.episode import (
    HIT_OBSTACLE,
    LOST,
    RUNNING,
    SUCCESS,
    StepBuffers,
    close_step_in_time,
    open_frame,
)
from policies.tasks.flight.episode_start import Start, begin_flight, continuous_action
from policies.tasks.flight.flight_params import FLIGHT_PARAMS, FlightParams
from policies.tasks.flight.flown_vehicle import vary_vehicle, vehicle_estimate
from policies.tasks.task_params import TaskParam
from sim.advance import RigArrays
from sim.truth import has_touched

wp.set_module_options({"enable_backward": False})

POINT_NED = wp.constant(wp.vec3(0.0, 0.0, -2.0))  # [m] where the vehicle is to stay
RATE_MAX = wp.constant(wp.vec3(3.0, 3.0, 2.0))  # [rad/s] of an action of 1


@wp.struct
class HoverParams:
    """One row per environment; declared in `HOVER_PARAMS`, in the same order."""

    ball_m: float
    rate_cost: float
    step_limit: float


HOVER_PARAMS = (
    TaskParam("ball_m", 3.0, 0.5, 20.0, "m", "farther away from the point the episode ends", "guess"),
    TaskParam("rate_cost", 0.1, 0.0, 10.0, "1", "reward lost per decision at 1 rad/s", "guess"),
    TaskParam("step_limit", 500.0, 1.0, 1e6, "1", "decisions of an episode: 10 s", "guess"),
)
PARAMS = (*FLIGHT_PARAMS, *HOVER_PARAMS)


@wp.struct
class HoverState:
    """All that an episode has beside the rig; one row per environment."""

    flight: wp.array(dtype=FlightParams)
    params: wp.array(dtype=HoverParams)
    actions: wp.array(dtype=wp.vec4)  # the last
    has_estimator: int


@wp.func
def rate_setpoint(action: wp.vec4) -> Setpoint:
    """Body rates and thrust from an action in [-1, 1]: roll, pitch, yaw rate, thrust (-1 is none)."""
    setpoint = Setpoint()
    setpoint.kind = SETPOINT_RATE
    setpoint.is_armed = 1
    setpoint.omega_frd = wp.cw_mul(wp.vec3(action[0], action[1], action[2]), RATE_MAX)
    setpoint.thrust = 0.5 * (action[3] + 1.0)
    return setpoint


@wp.kernel(enable_backward=False)
def act(buffers: StepBuffers, rig: RigArrays, state: HoverState) -> None:
    i = wp.tid()
    action = continuous_action(buffers, i)
    state.actions[i] = action
    rig.autopilot.setpoint[i] = rate_setpoint(action)


@wp.func
def write_hover(
    estimate: Estimate, point_ned: wp.vec3, last_action: wp.vec4, out: wp.array2d(dtype=float), i: int, at: int
) -> None:
    """The elements of a frame into row i from column `at`: the point and the motion as the body sees them."""
    q = estimate.q_ned_from_frd
    to_point_frd = wp.quat_rotate_inv(q, point_ned - estimate.pos_ned)
    vel_frd = wp.quat_rotate_inv(q, estimate.vel_ned)
    down_frd = wp.quat_rotate_inv(q, wp.vec3(0.0, 0.0, 1.0))
    for k in range(3):
        out[i, at + k] = to_point_frd[k]
        out[i, at + 3 + k] = vel_frd[k]
        out[i, at + 6 + k] = down_frd[k]
        out[i, at + 9 + k] = estimate.omega_frd[k]
    for k in range(4):
        out[i, at + 12 + k] = last_action[k]


@wp.func
def hover_reward(params: HoverParams, distance_m: float, omega_frd: wp.vec3) -> float:
    """Of one decision after which the vehicle is so far from the point and turns so fast."""
    return 1.0 - distance_m / params.ball_m - params.rate_cost * wp.length(omega_frd)


@wp.func
def hover_outcome(params: HoverParams, distance_m: float, has_touched_any: bool, step: int) -> int:
    """How the episode stands after decision `step`, counted from 1."""
    if has_touched_any:
        return HIT_OBSTACLE
    if distance_m > params.ball_m:
        return LOST
    if float(step) >= params.step_limit:
        return SUCCESS
    return RUNNING


@wp.func
def write_frame(buffers: StepBuffers, rig: RigArrays, state: HoverState, i: int) -> None:
    """What the policy may know: the estimate and its own last action."""
    at = open_frame(buffers, i)
    estimate = vehicle_estimate(rig, i, state.has_estimator)
    write_hover(estimate, POINT_NED, state.actions[i], buffers.observations, i, at)


@wp.kernel(enable_backward=False)
def judge(buffers: StepBuffers, rig: RigArrays, state: HoverState, start: Start) -> None:
    """How well the vehicle stays at the point, 1 at best, and whether it left the ball or touched the ground."""
    i = wp.tid()
    params = state.params[i]
    truth = rig.truth[i]
    distance_m = wp.length(truth.pos_ned - POINT_NED)
    reward = hover_reward(params, distance_m, truth.omega_frd)
    outcome = hover_outcome(params, distance_m, has_touched(truth), buffers.steps[i] + 1)
    write_frame(buffers, rig, state, i)
    start.is_starting[i] = close_step_in_time(buffers, i, reward, outcome)


@wp.kernel(enable_backward=False)
def prepare(buffers: StepBuffers, state: HoverState, start: Start) -> None:
    i = wp.tid()
    if start.is_starting[i]:
        begin_flight(buffers, start, i)
        state.actions[i] = wp.vec4()


@wp.kernel(enable_backward=False)
def place(buffers: StepBuffers, rig: RigArrays, state: HoverState, start: Start) -> None:
    i = wp.tid()
    if start.is_starting[i]:
        vary_vehicle(rig, start.makes, state.flight[i], buffers.seed[i], i, buffers.episodes[i] - 1)
        write_frame(buffers, rig, state, i)
