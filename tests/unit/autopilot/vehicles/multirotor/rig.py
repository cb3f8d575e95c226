"""A small closed loop for tests of the controller: a rigid body with motor lag and drag, no sensors.

Independent of `sim`: the estimate is the truth, the command reaches the motors one tick later.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import warp as wp

from autopilot.ports import SETPOINT_TRAJECTORY, BatterySample, Estimate, Setpoint
from autopilot.vehicles.multirotor.allocation import speed_fraction
from autopilot.vehicles.multirotor.cascade import ControlState, control_tick
from autopilot.vehicles.multirotor.control_airframe import ControlAirframe, control_airframe
from autopilot.vehicles.multirotor.params import ControlParams, control_params
from common.airframe import load_airframe
from common.geodesy import GRAVITY_M_S2
from common.kernels import TICK_S, vec8
from common.rotation import quat_from_rotvec

wp.set_module_options({"enable_backward": False})

_GRAVITY = wp.constant(GRAVITY_M_S2)
_TICK_S = wp.constant(TICK_S)


@wp.struct
class RigBody:
    pos_ned: wp.vec3
    vel_ned: wp.vec3
    q_ned_from_frd: wp.quat
    omega_frd: wp.vec3
    accel_frd: wp.vec3
    speed: vec8
    command: vec8  # of the last tick


@wp.struct
class RigModel:
    rise_s: float
    fall_s: float
    drag_linear: float  # [1/s]
    drag_square: float  # [1/m]
    thrust_scale: float  # true over modelled thrust
    voltage_fraction: float
    has_ground: int  # a floor at height 0 that carries but does not rub
    estimate_offset_ned: wp.vec3
    reset_count: int


@wp.func
def rig_substep(airframe: ControlAirframe, model: RigModel, body: RigBody, wind_ned: wp.vec3, dt: float) -> RigBody:
    after = body
    collective = float(0.0)
    torque = wp.vec3(0.0, 0.0, 0.0)
    for i in range(airframe.rotor_count):
        wanted = (
            airframe.max_speed_rad_s * model.voltage_fraction * speed_fraction(body.command[i], airframe.command_curve)
        )
        time_s = model.fall_s
        if wanted > body.speed[i]:
            time_s = model.rise_s
        after.speed[i] = body.speed[i] + (wanted - body.speed[i]) * (1.0 - wp.exp(-dt / time_s))
        thrust = model.thrust_scale * airframe.thrust_n_s2 * after.speed[i] * after.speed[i]
        collective += thrust
        torque += thrust * wp.vec3(airframe.arm_roll_m[i], airframe.arm_pitch_m[i], airframe.arm_yaw_m[i])
    air = body.vel_ned - wind_ned
    drag = -air * (model.drag_linear + model.drag_square * wp.length(air))
    lift = wp.quat_rotate(body.q_ned_from_frd, wp.vec3(0.0, 0.0, -collective / airframe.mass_kg))
    accel = lift + drag
    if model.has_ground == 1 and body.pos_ned[2] >= 0.0 and accel[2] + _GRAVITY > 0.0:
        accel[2] = -_GRAVITY
        after.vel_ned[2] = wp.min(body.vel_ned[2], 0.0)
    momentum = wp.cw_mul(airframe.inertia_kg_m2, body.omega_frd)
    turn = wp.cw_div(torque - wp.cross(body.omega_frd, momentum), airframe.inertia_kg_m2)
    after.omega_frd = body.omega_frd + turn * dt
    after.q_ned_from_frd = wp.normalize(body.q_ned_from_frd * quat_from_rotvec(after.omega_frd * dt))
    after.vel_ned = after.vel_ned + (accel + wp.vec3(0.0, 0.0, _GRAVITY)) * dt
    after.pos_ned = body.pos_ned + 0.5 * (body.vel_ned + after.vel_ned) * dt
    after.accel_frd = wp.quat_rotate_inv(body.q_ned_from_frd, accel)
    return after


@wp.func
def rig_estimate(model: RigModel, body: RigBody, tick: int) -> Estimate:
    est = Estimate()
    est.time_us = wp.int64(tick + 1) * wp.int64(4000)
    est.flags = 31
    est.q_ned_from_frd = body.q_ned_from_frd
    est.omega_frd = body.omega_frd
    est.accel_frd = body.accel_frd
    est.vel_ned = body.vel_ned
    est.pos_ned = body.pos_ned + model.estimate_offset_ned
    est.pos_reset_ned = model.estimate_offset_ned
    est.reset_count = model.reset_count
    est.accel_ned = wp.quat_rotate(body.q_ned_from_frd, body.accel_frd) + wp.vec3(0.0, 0.0, _GRAVITY)
    return est


@wp.kernel(enable_backward=False)
def rig_kernel(
    params: wp.array(dtype=ControlParams),
    airframes: wp.array(dtype=ControlAirframe),
    model: RigModel,
    setpoints: wp.array(dtype=Setpoint),
    bodies: wp.array(dtype=RigBody),
    states: wp.array(dtype=ControlState),
    wind_ned: wp.array2d(dtype=wp.vec3),
    first_tick: int,
    ticks: int,
    log: wp.array2d(dtype=RigBody),
    state_log: wp.array2d(dtype=ControlState),
):
    i = wp.tid()
    airframe = airframes[0]
    body = bodies[i]
    state = states[i]
    battery = BatterySample()
    battery.voltage_v = model.voltage_fraction * airframe.full_voltage_v
    for step in range(ticks):
        tick = first_tick + step
        wind = wind_ned[i, tick % wind_ned.shape[1]]
        for _sub in range(4):
            body = rig_substep(airframe, model, body, wind, 0.001)
        state = control_tick(params[0], airframe, state, rig_estimate(model, body, tick), setpoints[i], battery, tick)
        body.command = state.actuators.command
        if log.shape[0] > 0:
            log[i, step] = body
            state_log[i, step] = state
    bodies[i] = body
    states[i] = state


@dataclass
class Rig:
    """`vehicle_count` vehicles hovering at the start position; set a setpoint, `run`, read the logs."""

    airframe_name: str = "x500"
    vehicle_count: int = 1
    params: dict[str, float] = field(default_factory=dict)
    drag_linear: float = 0.25
    drag_square: float = 0.02
    thrust_scale: float = 1.0
    voltage_fraction: float = 1.0
    has_ground: bool = False
    start_ned: tuple[float, float, float] = (0.0, 0.0, -10.0)

    def __post_init__(self) -> None:
        data = load_airframe(self.airframe_name)
        airframe = control_airframe(data)
        self.model = RigModel()
        self.model.rise_s = data.rotor_model.spin_up_time_s
        self.model.fall_s = data.rotor_model.spin_down_time_s
        self.model.drag_linear, self.model.drag_square = self.drag_linear, self.drag_square
        self.model.thrust_scale, self.model.voltage_fraction = self.thrust_scale, self.voltage_fraction
        self.model.has_ground = int(self.has_ground)
        self.control_params = wp.array([control_params(self.params)], dtype=ControlParams, device="cpu")
        self.airframes = wp.array([airframe], dtype=ControlAirframe, device="cpu")
        count = self.vehicle_count
        self.setpoints = wp.zeros(count, dtype=Setpoint, device="cpu")
        self.bodies = wp.zeros(count, dtype=RigBody, device="cpu")
        self.states = wp.zeros(count, dtype=ControlState, device="cpu")
        rows = self.bodies.numpy()
        rows["q_ned_from_frd"] = (0.0, 0.0, 0.0, 1.0)
        rows["pos_ned"] = self.start_ned
        thrust = airframe.mass_kg * GRAVITY_M_S2 / airframe.rotor_count / self.thrust_scale
        rows["speed"][:, : airframe.rotor_count] = np.sqrt(thrust / airframe.thrust_n_s2)
        fraction = np.sqrt(thrust / airframe.thrust_n_s2) / airframe.max_speed_rad_s / self.voltage_fraction
        straight = 1.0 - airframe.command_curve
        root = 2.0 * fraction / (straight + np.sqrt(straight**2 + 4.0 * airframe.command_curve * fraction))
        rows["command"][:, : airframe.rotor_count] = root**2
        rows["accel_frd"] = (0.0, 0.0, -GRAVITY_M_S2)
        self.idle_command = data.rotor_model.idle_command
        self.hover_share = thrust / (airframe.thrust_n_s2 * airframe.max_speed_rad_s**2)
        self.wind = wp.zeros((count, 1), dtype=wp.vec3, device="cpu")
        self.tick = 0
        self.set(kind=SETPOINT_TRAJECTORY, is_armed=1, pos_ned=self.start_ned)

    def set(self, **fields: object) -> None:
        """Sets all setpoints: the fields given, NaN or zero for the others."""
        rows = self.setpoints.numpy()
        nan3 = (np.nan,) * 3
        free = {
            "kind": SETPOINT_TRAJECTORY,
            "is_armed": 1,
            "is_landed": 0,
            "pos_ned": nan3,
            "vel_ned": nan3,
            "accel_ned": nan3,
            "yaw": np.nan,
            "yaw_rate": np.nan,
            "path_start_ned": nan3,
            "cruise_speed": np.nan,
            "climb_speed": np.nan,
            "descend_speed": np.nan,
            "exit_speed": 0.0,
            "q_ned_from_frd": (0.0, 0.0, 0.0, 1.0),
            "omega_frd": (0.0, 0.0, 0.0),
            "thrust": 0.0,
        }
        for name, value in {**free, **fields}.items():
            rows[name] = value

    def jump_estimate(self, offset_ned: tuple[float, float, float]) -> None:
        """Lets the estimated position jump once by `offset_ned` [m]."""
        self.model.estimate_offset_ned = wp.vec3(*offset_ned)
        self.model.reset_count += 1

    def blow(self, wind_ned: npt.NDArray[np.float64]) -> None:
        """Wind [m/s] per tick, shape (ticks, 3), the same for all vehicles, repeated."""
        self.wind = wp.array(
            np.tile(wind_ned[None], (self.vehicle_count, 1, 1)).astype(np.float32), dtype=wp.vec3, device="cpu"
        )

    def run(self, seconds: float) -> tuple[npt.NDArray[np.void], npt.NDArray[np.void]]:
        """Flies on; returns bodies and controller states per tick, each of shape (vehicles, ticks)."""
        ticks = round(seconds / TICK_S)
        log = wp.zeros((self.vehicle_count, ticks), dtype=RigBody, device="cpu")
        state_log = wp.zeros((self.vehicle_count, ticks), dtype=ControlState, device="cpu")
        wp.launch(
            rig_kernel,
            dim=self.vehicle_count,
            inputs=[
                self.control_params,
                self.airframes,
                self.model,
                self.setpoints,
                self.bodies,
                self.states,
                self.wind,
                self.tick,
                ticks,
                log,
                state_log,
            ],
            device="cpu",
        )
        self.tick += ticks
        return log.numpy().copy(), state_log.numpy().copy()


def turbulence(seconds: float, mean_m_s: float, seed: int, height_m: float = 10.0) -> npt.NDArray[np.float64]:
    """Low-altitude Dryden turbulence (MIL-F-8785C) on a mean wind from the west, per tick, shape (ticks, 3)."""
    rng = np.random.default_rng(seed)
    feet = height_m / 0.3048
    sigma_w = 0.1 * mean_m_s
    sigma_u = sigma_w / (0.177 + 0.000823 * feet) ** 0.4
    length_u = 0.3048 * feet / (0.177 + 0.000823 * feet) ** 1.2
    ticks = round(seconds / TICK_S)
    wind = np.zeros((ticks, 3))
    for axis, (sigma, length) in enumerate(((sigma_u, length_u), (sigma_u, length_u), (sigma_w, height_m))):
        decay = np.exp(-TICK_S * max(mean_m_s, 1.0) / length)
        noise = rng.standard_normal(ticks) * sigma * np.sqrt(1.0 - decay**2)
        value = 0.0
        for tick in range(ticks):
            value = decay * value + noise[tick]
            wind[tick, axis] = value
    wind[:, 1] += mean_m_s
    return wind
