"""What clients ask of the flight besides a mode, a position or a mission: where to look, how to land after all.

In: requests of MAVLink commands. Out: the navigator's heading, the mission's current item, another mode.
"""

from math import isfinite, nan, radians

from autopilot.commander.commander import Commander
from autopilot.interface.vehicle_state import ACCEPTED, Mode, Reply, Severity, Verdict
from autopilot.navigator.modes.goto import target_refusal
from autopilot.navigator.navigator import Navigator
from autopilot.payload.payloads import Params, Payloads

_NOT_FLYING = Reply(Verdict.TEMPORARILY_REJECTED, "not in the air")
_AT_POSITION: Params = (3.0, 0.0, 0.0, 0.0)  # MAV_ROI_LOCATION in parameter 1, for the command's older form
_NOWHERE: Params = (0.0, 0.0, 0.0, 0.0)


class Guidance:
    """One vehicle's (autopilot.interface.vehicle_interface.Guidance)."""

    def __init__(self, commander: Commander, navigator: Navigator, payload: Payloads) -> None:
        self._commander = commander
        self._navigator = navigator
        self._payload = payload
        self._state = navigator.context.state
        self._paused: Mode | None = None  # what was being flown when it was paused

    # ---- where to look ----

    def look_at(self, command: int, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> Reply:
        """The vehicle's nose, and a gimbal if it carries one, towards a position from now on."""
        if not (abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0):
            return Reply(Verdict.DENIED, "a region of interest needs a place on earth")
        context = self._navigator.context
        alt_m = alt_amsl_m if isfinite(alt_amsl_m) else (self._state.home or self._state.position).alt_m
        context.heading.look_at(context.pos_ned_of(lat_deg, lon_deg, alt_m))
        return self._aim(command, lat_deg, lon_deg, alt_m)

    def look_ahead(self, command: int, offset_deg: float) -> Reply:
        """The vehicle's nose as its mode has it, on mission legs turned by an offset."""
        self._navigator.context.heading.look_ahead(radians(offset_deg) if isfinite(offset_deg) else 0.0)
        return self._aim(command, nan, nan, nan)

    def turn(self, angle_deg: float, rate_deg_s: float, direction: float, *, is_relative: bool) -> Reply:
        """Turns on the spot or on the way (autopilot.navigator.heading)."""
        if not self._state.is_flying:
            return _NOT_FLYING
        return self._navigator.context.heading.turn(angle_deg, rate_deg_s, direction, is_relative=is_relative)

    def _aim(self, command: int, lat_deg: float, lon_deg: float, alt_m: float) -> Reply:
        if self._payload.takes(command):
            return self._payload.run(command, _AT_POSITION if isfinite(lat_deg) else _NOWHERE, lat_deg, lon_deg, alt_m)
        return ACCEPTED

    # ---- the way ----

    def pause(self) -> Reply:
        """Stops a mission or a client's setpoints, and holds."""
        mode = self._state.mode
        if mode is not Mode.MISSION and not self._commander.modes[mode].is_offboard:
            return Reply(Verdict.TEMPORARILY_REJECTED, "there is nothing to pause: no mission is being flown")
        reply = self._commander.request_mode(Mode.HOLD)
        if reply.verdict is Verdict.ACCEPTED:
            self._paused = mode
        return reply

    def resume(self) -> Reply:
        """Goes on with what was paused; with the mission if nothing was."""
        paused, self._paused = self._paused, None
        if paused is not None and paused is not Mode.MISSION and self._state.mode is Mode.HOLD:
            return self._commander.request_mode(paused)
        self._navigator.mission.resume()
        return self._commander.request_mode(Mode.MISSION)

    def fly_landing_sequence(self) -> Reply:
        """Goes on with the mission at its nearest DO_LAND_START."""
        return self._fly_from(self._navigator.mission.landing_sequence(), "no DO_LAND_START")

    def fly_return_path(self) -> Reply:
        """Joins the mission at the nearest of its legs after DO_RETURN_PATH_START."""
        return self._fly_from(self._navigator.mission.return_path(), "no DO_RETURN_PATH_START")

    def _fly_from(self, seq: int | None, lacks: str) -> Reply:
        if not self._state.is_flying:
            return _NOT_FLYING
        if seq is None:
            return Reply(Verdict.FAILED, f"the mission has {lacks}")
        reason = self._commander.refusal(Mode.MISSION)
        if reason:
            return Reply(Verdict.TEMPORARILY_REJECTED, reason)
        self._navigator.mission.set_current(seq)
        return self._commander.request_mode(Mode.MISSION)

    def abort_landing(self, height_m: float) -> Reply:
        """Climbs away from a landing and holds.

        Args:
            height_m: above home, at least MIS_TAKEOFF_ALT; NaN or 0: that. A plane goes round instead, to this height
                above the touchdown, at least MIS_LND_ABRT_ALT.
        """
        context = self._navigator.context
        if self._navigator.goes_round:
            reply = self._navigator.go_around(height_m)
            if reply.verdict is Verdict.ACCEPTED:
                self._commander.guard.release()  # a pilot has taken over: a later failsafe may lead it down again
            return reply
        if not self._state.is_flying or not context.is_landing:
            return Reply(Verdict.TEMPORARILY_REJECTED, "not landing")
        reason = self._commander.refusal(Mode.HOLD)
        if reason:
            return Reply(Verdict.TEMPORARILY_REJECTED, reason)
        least_m = context.number("MIS_TAKEOFF_ALT")
        climb_m = max(height_m, least_m) if isfinite(height_m) else least_m
        north, east, down = context.stop_point()
        position = (north, east, min(down, self._state.home_ned[2] - climb_m))
        refusal = target_refusal(context, position)
        if refusal is not ACCEPTED:
            return refusal
        context.next_hold = (position, self._state.yaw_rad, False)
        context.announcer.statustext(Severity.WARNING, "Landing aborted: climbing")
        return self._commander.request_mode(Mode.HOLD)
