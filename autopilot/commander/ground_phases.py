"""Between the ground and the air: what an armed vehicle goes through, and when that is over.

In: the commander's state, what the navigator asks for, the class's ground detector. Out: the landed state; motors that
are stopped once nothing is left to do. A class of vehicles that never leaves the ground is under way while it is armed,
as PX4's rovers.
"""

from math import hypot, pi
from typing import Protocol

from autopilot.commander.failsafe import CRASHED
from autopilot.commander.navigator_interface import Flying
from autopilot.interface.mode_spec import ModeTable
from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import LandedState, Mode, Severity, VehicleState
from autopilot.navigator.takeoff_intent import Ask
from autopilot.vehicles.vehicle_class import GroundDetector
from common.params import Parameter, ParameterTable

FRAME_LONGEST_S = 0.1  # longer gaps do not count as landed time
_AIRBORNE_M = 0.5  # height over the take-off place from which the vehicle is in the air
_ON_ITS_SIDE_RAD = 0.25 * pi  # lean from which a vehicle on the ground has not landed but crashed, as for arming
_FALLEN_US = 10_000_000  # after its motors stopped in the air a vehicle is down, whatever the estimate says; guess
_FLIES_M = 5.0  # height over the hand from which a throw has carried; guess
_OFF_GROUND_M = 0.15  # a lower hover is not told from standing; guess


class Acting(Protocol):
    """The guard, as far as the phases need it."""

    def act(self, new: int) -> None: ...


class Authority(Protocol):
    """The commander, as the phases see it."""

    state: VehicleState
    params: ParameterTable
    announcer: Announcer
    modes: ModeTable

    @property
    def guard(self) -> Acting: ...

    def stop_motors(self, text: str) -> None: ...


class GroundPhases(Protocol):
    """The way of an armed vehicle from the ground and back."""

    lift_d: float
    """[m] Down coordinate at which it last left the ground."""
    unpowered_us: int
    """When its motors last stopped."""

    def armed(self) -> None:
        """It has just been armed."""

    def may_disarm(self) -> bool: ...

    def frame(self, flying: Flying, dt_s: float) -> None:
        """Renews the landed state."""


class Driving:
    """Of a vehicle that never leaves the ground: at the end of a return it is disarmed, as PX4's rovers.

    Args:
        commander: whose state is written.
    """

    def __init__(self, commander: Authority) -> None:
        self._commander = commander
        self._state = commander.state
        self._ended_s = 0.0
        self.lift_d = 0.0
        self.unpowered_us = 0
        commander.state.has_ground_contact = True

    def armed(self) -> None:
        self._state.landed_state = LandedState.IN_AIR
        self._state.takeoff_us = self._state.time_us
        self.lift_d = self._state.estimate.pos_ned[2]

    def may_disarm(self) -> bool:
        return True

    def frame(self, flying: Flying, dt_s: float) -> None:
        state = self._state
        self._ended_s = self._ended_s + dt_s if state.is_armed and flying.has_ended else 0.0
        after_s = float(self._commander.params["COM_DISARM_LAND"])
        if 0.0 <= after_s < self._ended_s:
            self._commander.stop_motors("Disarmed at the end of the way")
        state.landed_state = LandedState.IN_AIR if state.is_armed else LandedState.ON_GROUND


class TakeoffAndLanding:
    """Of a vehicle that leaves the ground.

    Args:
        commander: whose state is written.
        detector: says whether it stands.
    """

    def __init__(self, commander: Authority, detector: GroundDetector) -> None:
        self._commander = commander
        self._state = commander.state
        self._detector = detector
        self._landed_since_us = 0
        self._lift_since_us = 0
        self._has_flown = False  # since arming
        self._is_awaited = False  # it was to be thrown, as of the last frame
        self._is_launched = False  # it has been thrown, and has not risen yet
        self.lift_d = 0.0
        self.unpowered_us = 0
        self._load()
        commander.params.on_change(self._on_parameter)

    def armed(self) -> None:
        self._landed_since_us = self._state.time_us
        self._lift_since_us = 0
        self._has_flown = self._is_awaited = self._is_launched = False

    def may_disarm(self) -> bool:
        return self._state.landed_state is LandedState.ON_GROUND

    def frame(self, flying: Flying, dt_s: float) -> None:
        if self._state.landed_state is LandedState.ON_GROUND:
            if self._state.is_armed:
                self._stand(flying)
        else:
            self._fly(flying, dt_s)

    def _stand(self, flying: Flying) -> None:
        """Armed on the ground: releases a take-off, or disarms in time."""
        state = self._state
        now_us = state.time_us
        if flying.wants_lift:
            if now_us - state.armed_since_us >= self._spool_up_us:
                state.landed_state = LandedState.TAKEOFF
                state.takeoff_us = now_us
                self._detector.reset()
                state.has_ground_contact = False
                self._lift_since_us = now_us
                self.lift_d = state.estimate.pos_ned[2]
                self._is_launched, self._is_awaited = self._is_awaited, False
            return
        self._is_awaited = state.awaits_launch
        if state.mode is Mode.TERMINATION:
            self._commander.stop_motors("Disarmed after termination")
            return
        is_done = self._has_flown or not self._commander.modes[state.mode].may_arm
        limit_us = self._disarm_landed_us if is_done else self._disarm_preflight_us
        if 0 <= limit_us <= now_us - self._landed_since_us:
            text = "Disarmed: not thrown" if state.awaits_launch else "Disarmed: no take-off"
            self._commander.stop_motors("Disarmed after landing" if is_done else text)

    def _fly(self, flying: Flying, dt_s: float) -> None:
        """Off the ground: landed state, landing detection."""
        state = self._state
        self._is_launched &= state.is_armed and self.lift_d - state.estimate.pos_ned[2] < _FLIES_M
        if self._is_launched and self._detector.update(state.estimate, 0.0, 0.0, min(dt_s, FRAME_LONGEST_S)):
            self._fail_lift("Launch failed: on the ground again")  # a detector would wait until its motor stands
            return
        if state.landed_state is LandedState.TAKEOFF and not self._has_flown:
            if state.is_armed:
                self._lift(flying)
            else:
                self._touch_down()
            return
        ask = flying.ask
        is_powered = state.is_armed and state.mode is not Mode.TERMINATION
        thrust = state.actuators.thrust_sp if is_powered else 0.0
        descent_sp = state.actuators.traj_vel_ned[2] if ask is Ask.DOWN else 0.0
        is_landed = not self._is_launched and self._detector.update(
            state.estimate, thrust, descent_sp, min(dt_s, FRAME_LONGEST_S)
        )
        if ask is Ask.UP and self._detector.has_contact:
            self._detector.reset()  # off again
            is_landed = False
        state.has_ground_contact = self._detector.has_contact
        if is_landed:
            self._touch_down()
            if hypot(state.roll_rad, state.pitch_rad) < _ON_ITS_SIDE_RAD:
                self._commander.announcer.statustext(Severity.INFO, "Landed")
            elif is_powered:
                self._commander.guard.act(CRASHED)
        elif not is_powered and (self._detector.is_down or state.time_us - self.unpowered_us > _FALLEN_US):
            self._touch_down()
        elif state.landed_state is not LandedState.TAKEOFF or state.mode is not Mode.TAKEOFF:
            state.landed_state = LandedState.LANDING if flying.is_landing else LandedState.IN_AIR

    def _lift(self, flying: Flying) -> None:
        """Released from the ground, but not yet off it."""
        state, needs_sticks = self._state, self._commander.modes[self._state.mode].needs_sticks
        is_put_down = needs_sticks and flying.ask is Ask.DOWN
        risen_m = self.lift_d - state.estimate.pos_ned[2]
        if risen_m > _AIRBORNE_M or flying.is_landing or is_put_down:
            self._has_flown = True
        elif state.time_us - self._lift_since_us > 1e6 * self._detector.lift_timeout_s:
            is_hovering = needs_sticks or flying.ask is not Ask.UP
            if is_hovering and risen_m > _OFF_GROUND_M:  # it shall not go higher
                self._has_flown = True
                return
            self._fail_lift("Takeoff failed: still on the ground")

    def _fail_lift(self, text: str) -> None:
        self._commander.announcer.statustext(Severity.CRITICAL, text)
        self._touch_down()
        self._commander.stop_motors("Disarmed: no take-off")

    def _touch_down(self) -> None:
        self._state.landed_state = LandedState.ON_GROUND
        self._landed_since_us = self._state.time_us

    def _load(self) -> None:
        params = self._commander.params
        self._spool_up_us = int(params["COM_SPOOLUP_TIME"] * 1e6)
        self._disarm_landed_us = int(params["COM_DISARM_LAND"] * 1e6)
        self._disarm_preflight_us = int(params["COM_DISARM_PRFLT"] * 1e6)

    def _on_parameter(self, parameter: Parameter) -> None:
        if parameter.name.startswith("COM_"):
            self._load()
