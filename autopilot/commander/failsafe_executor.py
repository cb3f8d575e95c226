"""The guard: acts on new failures, by the rules of `failsafe`, and tells the pilot; once per frame while armed.

In: the bits that `failure_detector` sets. Out: mode changes, texts, disarming, through the commander. A stronger action
replaces a weaker one, never the other way round; a pilot who chooses a mode takes over, and only a new failure acts
again. When the sticks are lost it first holds for COM_FAIL_ACT_T, in which the pilot may come back or choose a mode
(PX4).
"""

from typing import Protocol

from autopilot.commander.failsafe import FLIGHT_TIME_OVER, OUTCOMES, RULES, STICKS_LOST
from autopilot.interface.failsafe_action import Action
from autopilot.interface.mode_spec import ModeTable
from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import LandedState, Mode, Severity, VehicleState
from common.params import ParameterTable

_DELAYED = frozenset({Action.RETURN, Action.SMART_RETURN, Action.LAND})  # by COM_FAIL_ACT_T


class Authority(Protocol):
    """The commander, as the guard sees it."""

    state: VehicleState
    params: ParameterTable
    announcer: Announcer
    modes: ModeTable
    last_resort: Mode

    def refusal(self, mode: Mode) -> str: ...

    def change_mode(self, mode: Mode) -> None: ...

    def begin_here(self) -> None: ...

    def stop_motors(self, text: str) -> None: ...


class Guard:
    """What has failed on one vehicle, and what is being done about it."""

    __slots__ = ("_action", "_commander", "_due_us", "_modes", "_waiting", "failures")

    def __init__(self, commander: Authority) -> None:
        self._commander = commander
        self._modes = {action: spec.mode for spec in commander.modes.values() for action in spec.carries_out}
        self._action = Action.WARN  # of the failsafe in progress
        self._waiting = Action.WARN  # what lost sticks lead to once their time is over
        self._due_us = 0
        self.failures = 0  # bits as of the last frame

    def reset(self) -> None:
        """The vehicle has just been armed."""
        self.failures = 0
        self.release()

    def release(self) -> None:
        """A pilot has taken over, or the flight is over."""
        commander = self._commander
        if commander.state.is_failsafe:
            commander.state.is_failsafe = False
            commander.announcer.heartbeat_now()  # also where the mode stays: who watches is to know at once
        self._action = self._waiting = Action.WARN

    def refusal(self, mode: Mode) -> str:
        """Why a failure forbids a mode that a client asks for; empty if none does."""
        commander = self._commander
        is_over = self.failures & FLIGHT_TIME_OVER and commander.params["COM_FLT_TIME_ACT"]
        if is_over and mode in commander.modes and commander.modes[mode].strength not in (Action.RETURN, Action.LAND):
            return "the flight time is over: only Return and Land"
        return ""

    def see(self, failures: int) -> None:
        """Takes what is wrong in this frame."""
        if self._waiting is not Action.WARN and self._commander.state.time_us >= self._due_us:
            self._stop_waiting(is_lost=bool(failures & STICKS_LOST))
        if failures == self.failures:
            return
        new, over = failures & ~self.failures, self.failures & ~failures
        self.failures = failures
        if over:
            for rule in RULES:
                if rule.failure & over and rule.recovery:
                    self._commander.announcer.statustext(Severity.NOTICE, rule.recovery)
        if new:
            self.act(new)

    def act(self, new: int) -> None:
        """Takes the strongest action of the failures that are new; announces each of them."""
        commander = self._commander
        strongest = Action.WARN
        for rule in RULES:
            if not rule.failure & new:
                continue
            action = rule.action(commander.params, commander.modes[commander.state.mode])
            if rule.failure == STICKS_LOST:
                action = self._first(action)
            action = self._possible(action)
            strongest = max(strongest, action)
            commander.announcer.statustext(rule.severity, rule.text + self._outcome(action))
        self._take(strongest)

    def _first(self, action: Action) -> Action:
        """What is done at once when the sticks are lost: the action, or Hold until COM_FAIL_ACT_T is over."""
        commander = self._commander
        state = commander.state
        delay_s = 0.0 if state.sticks.is_ardupilot else float(commander.params["COM_FAIL_ACT_T"])
        if delay_s <= 0.0 or action not in _DELAYED or not int(commander.params["NAV_RCL_ACT"]):
            return action
        self._waiting, self._due_us = action, state.time_us + round(delay_s * 1e6)
        return Action.WARN if state.landed_state is LandedState.ON_GROUND else Action.HOLD

    def _stop_waiting(self, *, is_lost: bool) -> None:
        """The sticks have been given their time: acts if they are still lost."""
        action, self._waiting = self._possible(self._waiting), Action.WARN
        if is_lost:
            self._commander.announcer.statustext(Severity.CRITICAL, "Sticks lost" + self._outcome(action))
            self._take(action)

    def _take(self, strongest: Action) -> None:
        """Changes the mode or stops the motors, unless something stronger is under way."""
        commander = self._commander
        state = commander.state
        if strongest is Action.WARN:
            return
        if strongest is Action.DISARM:
            commander.stop_motors("Disarmed by failsafe")
            return
        if state.landed_state is LandedState.ON_GROUND:
            commander.stop_motors("Disarmed by failsafe on the ground")
            return
        state.is_failsafe = True
        if strongest > max(self._action, self._strength()):
            self._action = strongest
            mode = self._modes.get(strongest, commander.last_resort)
            if mode is state.mode:
                commander.begin_here()  # not where a client has sent it
            else:
                commander.change_mode(mode)

    def _strength(self) -> Action:
        """The action that what is being flown stands for: weaker ones, or the same, do not end it."""
        state = self._commander.state
        strength = self._commander.modes[state.mode].strength
        if state.landed_state is LandedState.LANDING:
            return max(strength, Action.RETURN)  # nearly down, in whatever mode: nothing calls it up again
        return min(strength, Action.RETURN) if strength is Action.LAND else strength  # on the way to a landing place

    def _possible(self, action: Action) -> Action:
        """The action, or the next stronger one that can be flown now."""
        if action is Action.SMART_RETURN:
            if not self._commander.refusal(Mode.SMART_RETURN):
                return action
            action = Action.RETURN
        if action in (Action.ALTITUDE, Action.HOLD, Action.RETURN):
            mode = self._modes.get(action)
            if mode is None or (mode is not self._commander.state.mode and self._commander.refusal(mode)):
                return Action.LAND
        if action is Action.TERMINATE and action not in self._modes:
            return Action.DISARM
        return action

    def _outcome(self, action: Action) -> str:
        """What the pilot is told of an action."""
        if action is Action.LAND and action not in self._modes:
            return f": {self._commander.last_resort.name.replace('_', ' ').lower()}"
        return OUTCOMES.get(action, "")
