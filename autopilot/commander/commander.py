"""The commander: arming, modes, home, landed state, battery and failsafes of one vehicle, once per 50 Hz frame.

In: the vehicle's state and what clients ask for. Out: mode, arming and landed state, texts. It tells the navigator
which mode to fly through `Flying`, and asks it what it alone can know.
"""

from collections.abc import Sequence
from math import degrees, nan, radians, sqrt

from autopilot.commander.arming import MAGNETIC_INTERFERENCE, WARN_ONLY, arming_reasons
from autopilot.commander.battery import BatteryEstimator
from autopilot.commander.failsafe_executor import Guard
from autopilot.commander.failure_detector import FailureWatch, StationLink
from autopilot.commander.ground_phases import FRAME_LONGEST_S, Driving, GroundPhases, TakeoffAndLanding
from autopilot.commander.home import Home
from autopilot.commander.modes import NO_STICKS, mode_refusal
from autopilot.commander.navigator_interface import Flying
from autopilot.commander.stick_commands import Pilot
from autopilot.interface.mode_spec import Disarmed, ModeTable
from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import ACCEPTED, LandedState, Mode, Reply, Severity, VehicleState, Verdict
from autopilot.ports import AIRSPEED_VALID, HEIGHT_VALID, MAG_DISTURBED, POSITION_VALID, VELOCITY_VALID
from autopilot.vehicles.vehicle_class import ArmingCheck, DriveWatch, GroundDetector
from common.params import Parameter, ParameterTable

_POSITION_FLAGS = POSITION_VALID | VELOCITY_VALID | HEIGHT_VALID
_EPH_FLIGHT_FACTOR = 2.5  # in flight the position may be this much worse than for arming (PX4)
_CHECK_PERIOD_US = 200_000
_TEXT_PERIOD_US = 30_000_000  # "PreArm:" texts, as ground stations expect them
_FIRST_TEXT_US = 10_000_000  # until then the estimator may still be aligning
_RESET_REPORTED_RAD = radians(5.0)  # guess
_RESET_REPORTED_M = 0.5  # smaller jumps of the position are not worth a text; guess


class Commander:
    """The authority over one vehicle.

    Args:
        state: written here: mode, arming, landed state, home, battery.
        params: the vehicle's parameters.
        announcer: where texts and events go.
        battery: the charge estimator.
        detector: says whether the vehicle stands on the ground; None: it never leaves it.
        pilot: what the pilot asks for by the sticks.
        motors: the motor watch, if there is one.
        modes: those that the vehicle has.
        last_resort: the mode of a failsafe that has no mode of its own.
        arming_checks: those of its class.
    """

    def __init__(
        self,
        state: VehicleState,
        params: ParameterTable,
        announcer: Announcer,
        battery: BatteryEstimator,
        detector: GroundDetector | None,
        pilot: Pilot,
        motors: DriveWatch | None,
        modes: ModeTable,
        last_resort: Mode,
        arming_checks: Sequence[ArmingCheck],
    ) -> None:
        self.state = state
        self.params = params
        self.announcer = announcer
        self.modes = modes
        self.has_position = False
        self.station = StationLink()
        self.last_resort = last_resort
        self._arming_checks = arming_checks
        self.guard = Guard(self)
        self.home = Home(state, announcer)
        self._battery = battery
        leans = detector is not None
        self._watch = FailureWatch(state, params, battery, self.station, motors, modes, leans=leans)
        self._phases: GroundPhases = Driving(self) if detector is None else TakeoffAndLanding(self, detector)
        self._pilot = pilot
        self._flying: Flying
        self._position_seen_us = -1  # when the position was last valid
        self._next_check_us = 0
        self._next_text_us = _FIRST_TEXT_US
        self._reset_count = 0  # of the estimate
        self._has_airspeed = False
        self._is_ardupilot = False
        self._load()
        params.on_change(self._on_parameter)

    def connect(self, flying: Flying) -> None:
        """Names the navigator; once, before the first frame."""
        self._flying = flying

    def follow_ardupilot(self) -> None:
        """Modes by ArduPilot's rules: any may be chosen on the ground, some are not armable, landing changes none."""
        self._is_ardupilot = True

    # ---- each frame ----

    def frame(self, dt_s: float) -> None:
        """Renews everything the commander decides."""
        state = self.state
        self._judge_position()
        battery = self._battery
        sample = state.samples.battery
        battery.update(sample.time_us, sample.voltage_v, sample.current_a)
        battery.count_on(state.time_us)
        self._watch.judge_battery(sample.voltage_v)
        if state.home is None and self.has_position and state.estimate.pos_h_std <= self._eph:
            # Without a compass it is known in flight only.
            self.home.set_here(self._phases.lift_d if state.is_flying else nan)
        self._phases.frame(self._flying, dt_s)
        if state.estimate.reset_count != self._reset_count:
            self._tell_reset()
        if bool(state.estimate.flags & AIRSPEED_VALID) is not self._has_airspeed:
            self._tell_airspeed()
        self._pilot.frame(self)
        if state.is_armed:
            self._watch_failures(min(dt_s, FRAME_LONGEST_S))
        elif state.time_us >= self._next_check_us:
            self._next_check_us = state.time_us + _CHECK_PERIOD_US
            self._check_before_arming()

    def change_mode(self, mode: Mode) -> None:
        """Changes the mode without asking; for the navigator's wishes and for failsafes."""
        if mode is not self.state.mode:
            if mode is Mode.TERMINATION:
                self._phases.unpowered_us = self.state.time_us
            self.state.mode = mode
            self._flying.enter(mode)
            self.announcer.heartbeat_now()

    def begin_here(self) -> None:
        """Begins the present mode anew where the vehicle is; for failsafes."""
        self._flying.begin_here(self.state.mode)

    # ---- what clients ask for ----

    def arm(self, *, force: bool) -> Reply:
        state = self.state
        if state.is_armed:
            return ACCEPTED
        if not force:
            reasons = self.check_arming()
            if reasons:
                return Reply(Verdict.TEMPORARILY_REJECTED, reasons[0])
        if self.has_position and state.landed_state is LandedState.ON_GROUND:  # not saved from a fall
            state.stand_ned = state.estimate.pos_ned
            if not self.home.is_given:
                self.home.set_here()
        state.is_armed = True
        state.armed_since_us = state.time_us
        state.takeoff_us = 0
        state.flight_number += 1
        self._phases.armed()
        self._watch.reset()
        self.guard.reset()
        self._pilot.on_armed()
        self._flying.on_armed()
        self.announcer.heartbeat_now()
        self.announcer.statustext(Severity.INFO, "Armed")
        if state.estimate.flags & MAG_DISTURBED and int(self.params["COM_ARM_MAG_STR"]) == WARN_ONLY:
            self.announcer.statustext(Severity.WARNING, MAGNETIC_INTERFERENCE.capitalize())
        return ACCEPTED

    def disarm(self, *, force: bool) -> Reply:
        state = self.state
        if not state.is_armed:
            return ACCEPTED
        if not force and not self._phases.may_disarm():
            return Reply(Verdict.TEMPORARILY_REJECTED, "in the air")
        self.stop_motors("Disarmed by command")
        return ACCEPTED

    def check_arming(self) -> list[str]:
        """Reasons why the vehicle may not be armed now; empty when ready."""
        reasons = self._arming_reasons()
        if not self.modes[self.state.mode].may_arm:
            reasons.append(
                "Mode not armable" if self._is_ardupilot else f"mode {self.state.mode.name} does not allow arming"
            )
        return reasons

    def _arming_reasons(self) -> list[str]:
        """Those besides the mode."""
        state = self.state
        mode = state.mode
        reasons = arming_reasons(
            state, self.params, self._arming_checks, needs_position=self._flying.needs_position(mode)
        )
        if state.landed_state is not LandedState.ON_GROUND:
            reasons.append("not on the ground")
        if self.modes[self.state.mode].needs_sticks and not self._pilot.is_heard:
            reasons.append(NO_STICKS)
        if int(self.params["NAV_DLL_ACT"]) and self._watch.misses_station:
            reasons.append("ground station lost")  # the failsafe would disarm it at once (PX4)
        others = self._flying.refusal(mode), self._pilot.arming_reason(mode), self._flying.arming_reason()
        reasons += filter(None, others)
        return reasons

    def request_mode(self, mode: Mode) -> Reply:
        """Changes the mode for a client, or says why not."""
        reason = self.request_refusal(mode)
        if reason:
            return Reply(Verdict.TEMPORARILY_REJECTED, reason)
        self.guard.release()
        self.change_mode(mode)
        return ACCEPTED

    def request_refusal(self, mode: Mode) -> str:
        """Why a client may not choose a mode now; empty if it may."""
        state = self.state
        if state.mode is Mode.TERMINATION and mode is not state.mode:
            return "the flight is terminated"
        if mode is Mode.TERMINATION and state.mode is not mode:
            return "a flight is terminated by command, not by a mode"
        return (self.guard.refusal(mode) if state.is_armed else "") or self.refusal(mode)

    def terminate(self) -> Reply:
        """Stops the motors for good, wherever the vehicle is."""
        state = self.state
        if not state.is_armed:
            return Reply(Verdict.TEMPORARILY_REJECTED, "not armed")
        self.announcer.statustext(Severity.EMERGENCY, "Flight terminated by command")
        if state.landed_state is LandedState.ON_GROUND or Mode.TERMINATION not in self.modes:
            self.stop_motors("Disarmed by termination")
        else:
            state.is_failsafe = True
            self.change_mode(Mode.TERMINATION)
        return ACCEPTED

    def refusal(self, mode: Mode) -> str:
        """Why a mode cannot be entered now; empty if it can. The present mode always can."""
        state = self.state
        if mode is state.mode:
            return ""
        spec = self.modes.get(mode)
        if spec is None:
            return f"mode {mode.name} is not supported"
        is_free = self._is_ardupilot and not state.is_armed  # any mode: arming asks for what it needs
        is_lifting = self._flying.is_taking_off and spec.on_takeoff
        is_lenient = self._is_ardupilot or is_lifting
        return mode_refusal(
            spec,
            has_position=self.has_position or is_free,
            has_home=state.home is not None or is_free,
            is_on_ground=state.landed_state is LandedState.ON_GROUND and not is_lenient,
            needs_position=self._flying.needs_position(mode),
            has_sticks=self._pilot.is_heard,
        ) or self._flying.refusal(mode)

    def set_home(self, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> Reply:
        """Sets home; all NaN: here."""
        return self.home.set(lat_deg, lon_deg, alt_amsl_m, has_position=self.has_position)

    # ---- disarming ----

    def stop_motors(self, text: str) -> None:
        """Disarms, whatever the vehicle is doing."""
        state = self.state
        state.is_armed = False
        self._phases.unpowered_us = state.time_us
        self.guard.release()
        self._next_check_us = 0
        self.hold_reasons_back()
        disarmed = self.modes[self.state.mode].disarmed
        if disarmed is Disarmed.HOLD or (disarmed is Disarmed.USUAL and not self._is_ardupilot):
            self.change_mode(Mode.HOLD)
        self.announcer.heartbeat_now()
        self.announcer.statustext(Severity.INFO, text)

    # ---- checks and failsafes ----

    def restart(self) -> None:
        """The flight controller has been restarted: what is left of the battery is judged anew."""
        self._battery.restart()
        self.hold_reasons_back()

    def hold_reasons_back(self) -> None:
        """No text against arming for a while: the vehicle has just been stopped or restarted."""
        self._next_text_us = max(self._next_text_us, self.state.time_us + _FIRST_TEXT_US)

    def _judge_position(self) -> None:
        """Valid at once, lost after COM_POS_FS_DELAY."""
        state = self.state
        estimate = state.estimate
        eph = self._eph * _EPH_FLIGHT_FACTOR if state.is_armed else self._eph
        if estimate.flags & _POSITION_FLAGS == _POSITION_FLAGS and estimate.pos_h_std <= eph:
            self._position_seen_us = state.time_us
            if not self.has_position:
                self.has_position = True
                self._flying.tell_position(is_valid=True)
        elif self.has_position and state.time_us - self._position_seen_us > self._position_delay_us:
            self.has_position = False
            self._flying.tell_position(is_valid=False)

    def _check_before_arming(self) -> None:
        state = self.state
        if self.modes[self.state.mode].needs_sticks and not self._pilot.is_heard and not self._is_ardupilot:
            self.change_mode(Mode.HOLD)  # the pilot has gone: whoever comes next may need none
        reasons = self._arming_reasons() if self._is_ardupilot else self.check_arming()
        state.is_ready_to_arm = not reasons
        if reasons and state.time_us >= self._next_text_us and not state.is_calibrating:
            self._next_text_us = state.time_us + _TEXT_PERIOD_US
            self.announcer.statustext(Severity.CRITICAL, f"PreArm: {reasons[0]}")

    def _tell_reset(self) -> None:
        """The estimator has set its position, velocity or heading anew."""
        estimate = self.state.estimate
        self._reset_count = estimate.reset_count
        jump_m = sqrt(sum(axis * axis for axis in estimate.pos_reset_ned))
        if not self.state.is_flying:
            return
        self._watch.note_reset(jump_m)
        if jump_m > _RESET_REPORTED_M:
            self.announcer.statustext(Severity.NOTICE, f"Estimator: position reset by {jump_m:.1f} m")
        if abs(estimate.yaw_reset) > _RESET_REPORTED_RAD:
            text = f"Estimator: heading reset by {degrees(estimate.yaw_reset):.0f} deg"
            self.announcer.statustext(Severity.NOTICE, text)

    def _tell_airspeed(self) -> None:
        """The pitot tube has failed, or has come back."""
        self._has_airspeed = not self._has_airspeed
        if self.state.is_flying:
            text = "Airspeed sensor: used again" if self._has_airspeed else "Airspeed sensor failed: flown without"
            self.announcer.statustext(Severity.NOTICE if self._has_airspeed else Severity.CRITICAL, text)

    def _watch_failures(self, dt_s: float) -> None:
        if self.state.mode is Mode.TERMINATION:
            return  # nothing more can be done
        failures = self._watch.frame(
            dt_s,
            self._flying,
            has_position=self.has_position,
            needs_position=self._flying.needs_position(self.state.mode),
        )
        self.guard.see(failures | self._pilot.failures())

    def _load(self) -> None:
        params = self.params
        self._eph = float(params["COM_POS_FS_EPH"])
        self._position_delay_us = int(params["COM_POS_FS_DELAY"] * 1e6)

    def _on_parameter(self, parameter: Parameter) -> None:
        if parameter.name.startswith("COM_"):
            self._load()
