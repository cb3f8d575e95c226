"""A stand-in for the kernel rows: the estimate follows the setpoint with a first-order lag over flat ground.

Whole mode sequences run through the real commander and navigator in milliseconds of wall time.
"""

from dataclasses import dataclass, field
from math import atan2, cos, exp, isfinite, nan, pi, sin

import numpy as np

from autopilot.flight_controller import FlightController, HostPorts
from autopilot.interface.client_requests import OffboardSetpoint, TakeOff
from autopilot.interface.item_lists import MissionItem
from autopilot.interface.vehicle_state import LandedState, Mode, Severity
from autopilot.params import all_parameters
from autopilot.ports import (
    HEIGHT_VALID,
    POSITION_VALID,
    SETPOINT_IDLE,
    SETPOINT_LEAN,
    SETPOINT_TRAJECTORY,
    TERRAIN_VALID,
    TILT_ALIGNED,
    VELOCITY_VALID,
    YAW_ALIGNED,
    Actuators,
    Estimate,
    Samples,
    Setpoint,
)
from autopilot.vehicles.multirotor.defaults import hover_thrust
from autopilot.vehicles.multirotor.vehicle import MULTIROTOR
from common.airframe import load_airframe
from common.geodesy import GRAVITY_M_S2, GeoPoint, geodetic_from_ned
from common.kernels import FRAME_US
from common.params import ParameterTable
from common.records import row_reader

ORIGIN = GeoPoint(47.397742, 8.545594, 488.0)
ALL_VALID = TILT_ALIGNED | YAW_ALIGNED | VELOCITY_VALID | POSITION_VALID | HEIGHT_VALID | TERRAIN_VALID
DT_S = FRAME_US * 1e-6
_LAG_S = 0.2


def rows_of(struct, count=1):
    return np.zeros(count, dtype=np.dtype(struct.numpy_dtype()))


@dataclass
class Recorder:
    """An announcer that keeps what it hears."""

    texts: list = field(default_factory=list)  # (severity, text)
    reached: list = field(default_factory=list)
    current: list = field(default_factory=list)
    homes: int = 0
    heartbeats: int = 0

    def statustext(self, severity: Severity, text: str) -> None:
        self.texts.append((severity, text))

    def mission_item_reached(self, seq: int) -> None:
        self.reached.append(seq)

    def mission_current_changed(self, seq: int) -> None:
        self.current.append(seq)

    def home_changed(self) -> None:
        self.homes += 1

    def heartbeat_now(self) -> None:
        self.heartbeats += 1

    def has_text(self, part: str) -> bool:
        return any(part in text for _, text in self.texts)


class Kinematic:
    """One vehicle over flat ground at down = 0, and its flight controller."""

    def __init__(self, vehicle=MULTIROTOR, **params):
        self.table = ParameterTable(all_parameters())
        for name, value in params.items():
            self.table.set(name, value)
        self.airframe = load_airframe("x500")
        self.hover = hover_thrust(self.airframe)
        self.estimate = rows_of(Estimate)
        self.samples = rows_of(Samples)
        self.actuators = rows_of(Actuators)
        self.setpoint = rows_of(Setpoint)
        self.flags = ALL_VALID
        self.has_gnss = True
        self.vel_std = 0.1  # [m/s]
        self.battery_v = 16.6
        self.battery_a = 10.0
        self.gust_ned = np.zeros(3)
        self.time_us = 0
        self.pos = np.zeros(3)
        self.vel = np.zeros(3)
        self.yaw = 0.3
        self.thrust = 0.0
        self.history: list[LandedState] = []
        self.track: list[np.ndarray] = []
        self.recorder = Recorder()
        self._publish()
        self.fc = FlightController(
            HostPorts(
                row_reader(self.estimate, 0, "Estimate"),
                row_reader(self.samples, 0, "Samples"),
                row_reader(self.actuators, 0, "Actuators"),
                lambda: None,
                self.setpoint,
            ),
            self.table,
            self.airframe,
            ORIGIN,
            self.recorder,
            vehicle=vehicle,
        )
        self.state = self.fc.state

    # ---- time ----

    def frame(self):
        self.time_us += FRAME_US
        self._move()
        self._publish()
        self.fc.frame(self.time_us)
        if not self.history or self.history[-1] is not self.state.landed_state:
            self.history.append(self.state.landed_state)
        self.track.append(self.pos.copy())

    def run(self, seconds):
        for _ in range(round(seconds / DT_S)):
            self.frame()

    def run_until(self, condition, seconds=300.0):
        """Runs until the condition holds and returns the simulated time it took [s]."""
        for i in range(round(seconds / DT_S)):
            if condition():
                return i * DT_S
            self.frame()
        raise AssertionError(f"not within {seconds} s; at {self.pos}, {self.state.mode}, {self.recorder.texts[-3:]}")

    # ---- shortcuts ----

    def ready(self):
        self.run(1.0)
        assert self.state.is_ready_to_arm, self.fc.check_arming()
        return self

    def flying(self, height_m=10.0):
        """Takes off and holds."""
        self.ready()
        assert self.fc.request(TakeOff(ORIGIN.alt_m + height_m, nan)).verdict == 0
        assert self.fc.arm(force=False).verdict == 0
        self.run_until(lambda: self.state.mode is Mode.HOLD)
        return self

    def pilot(self, roll=0.0, pitch=0.0, yaw=0.0, throttle=0.0):
        """Moves the sticks, once: they are lost after COM_RC_LOSS_T."""
        self.fc.sticks.joystick_moved((255, 190), self.time_us, (roll, pitch, yaw, throttle), 0)

    def piloted(self, seconds, **axes):
        """Runs with the sticks held there."""
        for _ in range(round(seconds / DT_S)):
            self.pilot(**axes)
            self.frame()

    def disarmed(self, seconds=300.0):
        return self.run_until(lambda: not self.state.is_armed, seconds)

    def sp(self, name):
        value = self.setpoint[name][0]
        return value.tolist()

    # ---- the world ----

    def _move(self):
        if self.sp("is_armed") and not self.sp("is_landed") and self.sp("kind") != SETPOINT_IDLE:
            if self.sp("kind") in (SETPOINT_TRAJECTORY, SETPOINT_LEAN):
                self._follow_trajectory()
            else:
                self._follow_thrust()
        else:
            self.thrust = 0.0
            fall = 0.0 if self.pos[2] >= 0.0 else self.vel[2] + GRAVITY_M_S2 * DT_S
            self.vel[:] = (0.0, 0.0, fall)
        self.pos += self.vel * DT_S
        if self.pos[2] >= 0.0:
            self.pos[2] = 0.0
            self.vel[:] = 0.0

    def _follow_trajectory(self):
        pos_sp, vel_sp = np.array(self.sp("pos_ned")), np.array(self.sp("vel_ned"))
        cruise = self.sp("cruise_speed")
        cruise = cruise if isfinite(cruise) else self.table["MPC_XY_CRUISE"]
        up = self.sp("climb_speed")
        up = up if isfinite(up) else self.table["MPC_Z_V_AUTO_UP"]
        wanted = np.zeros(3)
        way = pos_sp - self.pos
        if np.isfinite(way[:2]).all() and np.isfinite(vel_sp[:2]).all():  # a place that moves
            wanted[:2] = vel_sp[:2] + way[:2]
        elif np.isfinite(way[:2]).all():
            distance = float(np.hypot(way[0], way[1]))
            speed = min(cruise, distance + self.sp("exit_speed"))
            wanted[:2] = way[:2] / max(distance, 1e-6) * speed
        elif np.isfinite(vel_sp[:2]).all():
            wanted[:2] = vel_sp[:2]
        if isfinite(way[2]):
            wanted[2] = min(max(1.0 * way[2], -up), self.table["MPC_Z_V_AUTO_DN"])
        elif isfinite(vel_sp[2]):
            wanted[2] = vel_sp[2]
        fraction = DT_S / _LAG_S
        is_pressed = self.pos[2] >= 0.0 and wanted[2] > 0.0  # the ground carries it: the thrust falls away
        self.thrust += ((self.table["MPC_THR_MIN"] if is_pressed else self.hover) - self.thrust) * fraction
        self.vel += (wanted + self.gust_ned - self.vel) * fraction
        yaw = self.sp("yaw")
        if isfinite(yaw):
            self.yaw += ((yaw - self.yaw + pi) % (2 * pi) - pi) * fraction

    def _follow_thrust(self):
        self.thrust = self.sp("thrust")
        self.vel[2] += GRAVITY_M_S2 * (1.0 - self.thrust / self.hover) * DT_S
        self.vel *= exp(-DT_S / 2.0)

    def _publish(self):
        estimate = self.estimate
        estimate["time_us"] = self.time_us
        estimate["flags"] = self.flags
        estimate["q_ned_from_frd"] = (0.0, 0.0, sin(0.5 * self.yaw), cos(0.5 * self.yaw))
        estimate["pos_ned"] = self.pos
        estimate["vel_ned"] = self.vel
        lift = GRAVITY_M_S2 if self.pos[2] >= 0.0 else GRAVITY_M_S2 * self.thrust / self.hover
        estimate["accel_frd"] = (0.0, 0.0, -lift)
        estimate["pos_h_std"] = estimate["pos_v_std"] = 0.5
        estimate["vel_std"] = self.vel_std
        samples = self.samples
        for name in ("imu", "baro", "mag", "battery"):
            samples[name]["time_us"] = self.time_us or 1
        if self.has_gnss:
            samples["gnss"]["time_us"] = self.time_us or 1
        samples["gnss"]["fix_type"] = 3
        samples["gnss"]["satellites"] = 12
        samples["battery"]["voltage_v"] = self.battery_v
        samples["battery"]["current_a"] = self.battery_a
        self.actuators["thrust_sp"] = self.thrust
        self.actuators["traj_yaw"] = self.yaw


def geo(north, east, height=0.0):
    """Latitude, longitude [deg] and altitude [m] of a point over the plane."""
    return geodetic_from_ned(north, east, -height, ORIGIN)


def item(seq, command, north=0.0, east=0.0, height=10.0, params=(0.0, 0.0, 0.0, nan), frame=6, autocontinue=True):
    """A mission item at a place relative to home."""
    lat, lon, _ = geo(north, east)
    return MissionItem(seq, frame, command, tuple(map(float, params)), lat, lon, height, autocontinue)


def do(seq, command, *params):
    """A mission item without a place."""
    filled = (*map(float, params), 0.0, 0.0, 0.0, 0.0)[:4]
    return MissionItem(seq, 2, command, filled, 0.0, 0.0, 0.0)


def position_setpoint(north, east, down, yaw=0.0):
    return OffboardSetpoint(0, int(SETPOINT_TRAJECTORY), pos_ned=(north, east, down), yaw=yaw)


def heading_error(a, b):
    return abs(atan2(sin(a - b), cos(a - b)))
