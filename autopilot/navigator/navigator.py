"""The navigator: one object per vehicle that turns the flight mode into setpoints, at 50 Hz."""

from math import isfinite, nan
from typing import Protocol

from autopilot.interface.client_requests import OffboardSetpoint
from autopilot.interface.item_lists import ListKind, item_name
from autopilot.interface.vehicle_state import ACCEPTED, Mode, Reply, Severity, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.fence.fence import Fence
from autopilot.navigator.fence.rally_points import RallyPoints
from autopilot.navigator.mission.mission import Mission
from autopilot.navigator.modes.follow import Follow
from autopilot.navigator.modes.goto import reposition_target
from autopilot.navigator.modes.guided import Guided
from autopilot.navigator.modes.hold import Hold
from autopilot.navigator.modes.land import Land
from autopilot.navigator.modes.offboard import STREAM_PERIOD_US, Offboard
from autopilot.navigator.modes.orbit import Orbit
from autopilot.navigator.modes.rtl import Return
from autopilot.navigator.modes.rtl_destination import Destinations
from autopilot.navigator.modes.smart_return import SmartReturn
from autopilot.navigator.modes.stick_modes import Acro, Altitude, Brake, Position, Stabilized
from autopilot.navigator.modes.takeoff import Climb, Takeoff, is_high
from autopilot.navigator.modes.termination import Termination
from autopilot.navigator.paths.breadcrumbs import Breadcrumbs
from autopilot.navigator.takeoff_intent import Ask, standing_d, vertical_ask
from autopilot.ports import TERRAIN_VALID

_GOING = frozenset({Mode.TAKEOFF, Mode.HOLD, Mode.ORBIT, Mode.FOLLOW, Mode.MISSION})  # in which a take-off is finished
_WAITS_US = 2_000_000  # a take-off that is interrupted on the ground, for a place to go to; guess
_SETTLE_THRUST = 0.06  # share of the maximum, under which a vehicle settles on its feet; below LandingDetector's; guess


class FlightMode(Protocol):
    """What each mode is."""

    def start(self) -> None:
        """Entered while armed, or armed in it."""
        ...

    def frame(self) -> None:
        """Renews the setpoint; called while armed."""
        ...


class Navigator:
    """The flight modes of one vehicle.

    Args:
        context: state, parameters, setpoint; shared by the modes.
        mission: the stored mission, which is mode Mission.
    """

    __slots__ = (
        "_active",
        "_climb",
        "_is_rising",
        "_mission_checked",
        "_mission_problem",
        "_modes",
        "_takeoff_us",
        "ask",
        "context",
        "crumbs",
        "fence",
        "follow",
        "guided",
        "hold",
        "homing",
        "land",
        "mission",
        "offboard",
        "orbit",
        "precision",
        "rally",
        "takeoff",
    )

    def __init__(self, context: NavContext, mission: Mission) -> None:
        self.context = context
        self.hold = Hold(context)
        self.takeoff = Takeoff(context)
        self.mission = mission
        self.fence = Fence(context)
        mission.connect(self.fence)
        self.rally = RallyPoints()
        self.crumbs = Breadcrumbs(context)
        self.homing = Return(context, Destinations(context, self.rally, mission, self.fence), self.fence, mission)
        self.land = Land(context)
        self.offboard = Offboard(context)
        self.follow = Follow(context)
        self.orbit = Orbit(context)
        self.precision = mission.precision  # landing items use it too
        self.guided = Guided(context)
        stabilized = Stabilized(context)
        self._modes: dict[Mode, FlightMode] = {
            Mode.HOLD: self.hold,
            Mode.TAKEOFF: self.takeoff,
            Mode.MISSION: mission,
            Mode.RETURN: self.homing,
            Mode.SMART_RETURN: SmartReturn(context, self.crumbs),
            Mode.LAND: self.land,
            Mode.OFFBOARD: self.offboard,
            Mode.TERMINATION: Termination(context),
            Mode.FOLLOW: self.follow,
            Mode.ORBIT: self.orbit,
            Mode.GUIDED: self.guided,
            Mode.PRECISION_LAND: self.precision,
            Mode.MANUAL: stabilized,
            Mode.STABILIZED: stabilized,
            Mode.ACRO: Acro(context),
            Mode.ALTITUDE: Altitude(context),
            Mode.POSITION: Position(context),
            Mode.BRAKE: Brake(context),
        }
        self._active: FlightMode = self._modes[Mode.HOLD]
        self._climb: Climb | None = None  # of a take-off, which is finished before the active mode goes elsewhere
        self._is_rising = False  # a take-off has begun, and the vehicle has not been high since
        self._takeoff_us = 0  # when mode Takeoff was last flown
        self.ask = Ask.STAY  # of the setpoint flown
        self._mission_checked: object = None
        self._mission_problem = ""

    def has_mode(self, mode: Mode) -> bool:
        """Whether there is such a mode at all."""
        return mode in self._modes

    def refusal(self, mode: Mode) -> str:
        """Why a mode cannot be flown now, as far as the navigator knows; empty if it can."""
        if mode not in self._modes:
            return f"mode {mode.name} is not supported"
        if mode is Mode.MISSION:
            return self.mission.refusal() or self._mission_outside()
        if mode is Mode.ALTITUDE and not self.context.has_height:
            return "no valid height"
        if mode is Mode.SMART_RETURN:
            return self.crumbs.refusal()
        if mode is Mode.OFFBOARD and self.offboard.age_us(self.context.state.time_us) > STREAM_PERIOD_US:
            return "needs setpoints faster than 2 Hz before the switch"
        return ""

    def _mission_outside(self) -> str:
        """The first item of the mission that lies outside the fence; looked for again when either has changed."""
        fence, mission = self.fence, self.mission
        if not fence.is_active:
            return ""
        checked = (mission.items, fence.version, self.context.state.home_ned)
        if checked != self._mission_checked:
            self._mission_checked = checked
            self._mission_problem = ""
            for seq, place in mission.places():
                reason = fence.refusal(place)
                if reason:
                    self._mission_problem = f"{item_name(seq)} is {reason}"
                    break
        return self._mission_problem

    def warn_of_fence(self, _: ListKind) -> None:
        """Says at once that a mission just loaded leaves the fence, or a fence just loaded excludes the mission."""
        problem = self._mission_outside()
        if problem:
            self.context.announcer.statustext(Severity.WARNING, f"Mission: {problem}")

    def arming_reason(self) -> str:
        """Why the vehicle may not take off here; empty if it may."""
        return self.fence.arming_reason()

    @property
    def wants_lift(self) -> bool:
        """Whether the mode asks to leave the ground."""
        return self.context.wants_lift

    @property
    def is_taking_off(self) -> bool:
        """Whether a take-off has been asked for and is not over, on the ground or above it."""
        return self.context.state.is_armed and (self._active is self.takeoff or self._is_rising)

    @property
    def is_going(self) -> bool:
        """Whether the vehicle is sent to a place and still on its way there, in mode Hold."""
        return self._climb is not None or self.hold.is_underway

    @property
    def is_landing(self) -> bool:
        """Whether the mode is on its last descent."""
        return self.context.is_landing

    @property
    def offboard_needs_position(self) -> bool:
        return self.offboard.needs_position

    def offboard_age_us(self, time_us: int) -> int:
        return self.offboard.age_us(time_us)

    def tell_position(self, *, is_valid: bool) -> None:
        """The commander's judgement of the position estimate."""
        self.context.has_position = is_valid

    def enter(self, mode: Mode) -> None:
        """Changes to a mode: at once in flight, when armed otherwise."""
        if self._active is self.mission and mode is not Mode.MISSION:
            self.mission.leave()
        if self._active is self.guided and mode is not Mode.GUIDED:
            self.guided.leave()
        if mode is not Mode.MISSION and self._active in (self.mission, self.homing):
            self.mission.leave()  # a return may end with its landing part
        if self._active is self.orbit and mode is not Mode.ORBIT:
            self.orbit.leave()
        self._forget_requests(mode)
        is_low = self.is_taking_off and not is_high(self.context)
        self._is_rising = is_low and mode in _GOING
        was_climbing = self._active is self.takeoff or self._climb is not None
        self._active = self._modes[mode]
        self.context.heading.end_turn()
        self._climb = self.takeoff.climb if is_low and self._goes_away(mode) else None
        if self._climb is None:
            if self.context.state.is_armed:
                self._active.start()
        elif not was_climbing:
            self._climb.resume()

    def _goes_away(self, mode: Mode) -> bool:
        """Whether a mode just asked for leads elsewhere at once; a mission takes off by itself."""
        context = self.context
        if mode is Mode.HOLD:
            return context.next_hold is not None and context.next_hold[2]
        return mode in (Mode.ORBIT, Mode.FOLLOW) or (mode is Mode.MISSION and not context.is_on_ground)

    def stay(self) -> None:
        """Holds where it is: what it was sent to is given up."""
        self.context.next_hold = None
        self.enter(Mode.HOLD)

    def begin_here(self, mode: Mode) -> None:
        """Begins a mode anew, or another, without what clients have asked of it: where the vehicle is."""
        self._forget_requests(None)
        self.enter(mode)

    def _forget_requests(self, kept: Mode | None) -> None:
        """A place or a height that was asked of a mode does not wait for the next time it is entered."""
        if kept is not Mode.HOLD:
            self.context.next_hold = None
            self.hold.via = []
        if kept is not Mode.TAKEOFF:
            self.takeoff.forget()
        if kept is not Mode.LAND:
            self.land.request(None, nan)
        if kept is not Mode.ORBIT:
            self.orbit.forget()
        if kept is not Mode.GUIDED:
            self.guided.forget_goto()

    def on_armed(self) -> None:
        """Starts the mode that was chosen before."""
        self.context.reset_speeds()
        self.context.next_hold = None
        self.crumbs.clear()
        self.context.heading.reset()
        self._climb = None
        self._is_rising = False
        self._active.start()

    def frame(self) -> Mode | None:
        """Renews the setpoint and returns the mode that shall follow, if the present one is done."""
        context = self.context
        state = context.state
        context.wants_lift = False
        context.is_landing = False
        setpoint = context.setpoint
        wish: Mode | None = None
        if state.is_armed:
            self.crumbs.frame()
            self._watch_takeoff()
            if self._climb is None or self._has_climbed(self._climb):
                self._active.frame()
            if context.heading.is_active or context.yaw_mode:
                context.heading.frame()
            wish = context.wish
            context.wish = None
        if context.is_on_ground or not state.is_armed or state.mode is Mode.TERMINATION:
            setpoint.idle()
            setpoint.as_asked()
            self.ask = Ask.STAY
        else:
            self._respect_ground()
        state.goal_ned, state.path_start_ned = setpoint.pos_ned, setpoint.path_start_ned
        may_turn = state.is_armed and state.mode is not Mode.TERMINATION
        setpoint.set_flags(is_armed=may_turn, is_landed=context.is_on_ground)
        return wish

    def _watch_takeoff(self) -> None:
        """A client may choose Hold before it says where to go (MAVSDK): on the ground the take-off waits a little."""
        context = self.context
        if self._active is self.takeoff:
            self._is_rising, self._takeoff_us = True, context.state.time_us
        elif self._is_rising and self._climb is None:
            is_given_up = context.is_on_ground and context.state.time_us - self._takeoff_us > _WAITS_US
            self._is_rising = not (is_given_up or is_high(context))

    def _has_climbed(self, climb: Climb) -> bool:
        """Goes on with the take-off; once that is high enough, the mode asked for meanwhile begins."""
        if not climb.frame() and not is_high(self.context):
            return False
        self._climb = None
        self._is_rising = False
        self._active.start()
        return True

    def _respect_ground(self) -> None:
        """Lets the vehicle settle where it touches the ground, and go down gently to a place on the ground.

        Leaning into the wind against the ground would tip it over, and so would a sideways touch without any control.
        """
        context = self.context
        state, setpoint = context.state, context.setpoint
        stand_d = standing_d(state, context.standing_height_m)
        ask = self.ask = vertical_ask(setpoint, state.estimate, stand_d, context.hover_thrust)
        if state.has_ground_contact and ask is not Ask.UP:
            setpoint.settle(_SETTLE_THRUST, state.yaw_rad)
        elif (
            ask is Ask.DOWN
            and setpoint.pos_ned[2] == setpoint.pos_ned[2]
            and stand_d - state.estimate.pos_ned[2] < context.number("MPC_LAND_ALT3")
        ):
            is_measured = state.estimate.flags & TERRAIN_VALID
            setpoint.press(context.number("MPC_LAND_CRWL" if is_measured else "MPC_LAND_SPEED"))
        else:
            setpoint.as_asked()

    # ---- what clients ask for ----

    def set_offboard(self, setpoint: OffboardSetpoint) -> None:
        self.offboard.receive(setpoint)
        if self._active is self.guided:
            self.guided.receive(setpoint)

    def reposition(self, lat_deg: float, lon_deg: float, alt_amsl_m: float, yaw: float, speed_m_s: float) -> Reply:
        """Chooses the next place to hold; the caller changes to Hold."""
        context = self.context
        if not (isfinite(lat_deg) or isfinite(lon_deg) or isfinite(alt_amsl_m) or isfinite(yaw)):
            context.next_hold = (context.stop_point(), context.state.yaw_rad, False)
        else:
            is_holding = context.state.mode is Mode.HOLD and self._climb is None
            base = self.hold.target_ned if is_holding else context.stop_point()
            target = reposition_target(context, base, lat_deg, lon_deg, alt_amsl_m, yaw)
            if isinstance(target, Reply):
                return target
            points = self.fence.way(context.stop_point(), target[0])
            if points is None:
                return Reply(Verdict.DENIED, "there is no way to the target inside the fence")
            self.hold.via = points[:-1]
            context.next_hold = (*target, True)
        if isfinite(speed_m_s) and speed_m_s > 0.0:
            context.cruise_speed = speed_m_s
        return ACCEPTED

    def change_speed(self, speed_m_s: float, kind: int) -> Reply:
        """A speed from now on (SPEED_TYPE), NaN: the default; the control part bounds it by its limits."""
        if speed_m_s <= 0.0 or speed_m_s > 100.0:
            return Reply(Verdict.DENIED, f"{speed_m_s:.1f} m/s is out of range")
        context = self.context
        context.set_speed(kind, speed_m_s)
        context.setpoint.set_speeds(context.cruise_speed, context.climb_speed, context.descend_speed)
        self.mission.renew_speeds()
        return ACCEPTED

    def request_takeoff(self, alt_amsl_m: float, yaw: float) -> Reply:
        """Chooses the height of the next take-off; the caller changes to Takeoff."""
        refusal = self.takeoff_refusal(alt_amsl_m)
        return Reply(Verdict.DENIED, refusal) if refusal else self.takeoff.request(alt_amsl_m, yaw)

    def takeoff_refusal(self, alt_amsl_m: float) -> str:
        """Why the fence lets no take-off end at an altitude here; empty if it does."""
        if not isfinite(alt_amsl_m):
            return ""
        context = self.context
        north, east, _ = context.state.estimate.pos_ned
        refusal = self.fence.refusal((north, east, context.down_of(alt_amsl_m)))
        return f"takeoff would end {refusal}" if refusal else ""

    def request_landing(self, lat_deg: float, lon_deg: float, yaw: float) -> Reply:
        """Chooses where the next landing shall be; the caller changes to Land."""
        if isfinite(lat_deg) != isfinite(lon_deg) or abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0:
            return Reply(Verdict.DENIED, "there is no such latitude and longitude")
        place = None
        if isfinite(lat_deg) and not (lat_deg == 0.0 and lon_deg == 0.0):
            place = self.context.pos_ned_of(lat_deg, lon_deg, self.context.state.position.alt_m)
            refusal = self.fence.refusal(place)
            if refusal:
                return Reply(Verdict.DENIED, f"landing place is {refusal}")
        self.land.request(place, yaw if isfinite(yaw) else nan)
        return ACCEPTED
