"""The navigator: one object per vehicle that turns the flight mode into setpoints, at 50 Hz."""

from math import hypot

from autopilot.interface.client_requests import ModeRequest, Report
from autopilot.interface.mode_spec import FlightMode, ModeTable
from autopilot.interface.vehicle_state import ACCEPTED, Mode, Reply, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.fence.fence import Fence
from autopilot.navigator.fence.rally_points import RallyPoints
from autopilot.navigator.mission.mission import Mission
from autopilot.navigator.mode_parts import ModeParts
from autopilot.navigator.modes.takeoff import Climb, Takeoff, is_high
from autopilot.navigator.paths.breadcrumbs import Breadcrumbs
from autopilot.navigator.takeoff_intent import Ask, standing_d, vertical_ask
from autopilot.ports import TERRAIN_VALID

_STANDING_M_S = 0.1
_WAITS_US = 2_000_000  # a take-off that is interrupted on the ground, for a position to go to; guess
_SETTLE_THRUST = (
    0.06  # fraction of the maximum, under which a vehicle settles on its feet; below LandingDetector's; guess
)


class Navigator:
    """The flight modes of one vehicle.

    Args:
        context: state, parameters, setpoint; shared by the modes.
        mission: the stored mission, which is mode Mission.
        modes: those that the vehicle has.
    """

    __slots__ = (
        "_active",
        "_climb",
        "_is_rising",
        "_listeners",
        "_reverse_ends",
        "_specs",
        "_takeoff",
        "_takeoff_us",
        "ask",
        "context",
        "crumbs",
        "fence",
        "mission",
        "modes",
        "rally",
    )

    def __init__(self, context: NavContext, mission: Mission, modes: ModeTable) -> None:
        self.context = context
        self.mission = mission
        self.fence = Fence(context)
        mission.connect(self.fence)
        self.rally = RallyPoints()
        self.crumbs = Breadcrumbs(context)
        parts = ModeParts(context, mission, self.fence, self.rally, self.crumbs)
        built = {build: build(parts) for build in {spec.build: None for spec in modes.values()}}
        self._specs = modes
        self.modes = {mode: built[spec.build] for mode, spec in modes.items()}
        self._listeners: dict[type, dict[FlightMode, None]] = {}  # by the kind of report
        for mode, spec in modes.items():
            for kind in spec.takes:
                self._listeners.setdefault(kind, {})[self.modes[mode]] = None
        self._takeoff = next((flown for flown in built.values() if isinstance(flown, Takeoff)), None)
        self._active = context.flown = self.modes[context.state.mode]
        self._climb: Climb | None = None  # of a take-off, which is finished before the active mode goes elsewhere
        self._reverse_ends = False  # once it stands: DO_SET_REVERSE was for the mode before
        self._is_rising = False  # a take-off has begun, and the vehicle has not been high since
        self._takeoff_us = 0  # when mode Takeoff was last flown
        self.ask = Ask.STAY  # of the setpoint flown

    def refusal(self, mode: Mode) -> str:
        """Why a mode cannot be flown now, as far as the navigator knows; empty if it can."""
        spec = self._specs.get(mode)
        if spec is None:
            return f"mode {mode.name} is not supported"
        if spec.needs_height and not self.context.has_height:
            return "no valid height"
        return self.modes[mode].refusal()

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
        return self.context.state.is_armed and (self._is_in_takeoff or self._is_rising)

    @property
    def _is_in_takeoff(self) -> bool:
        return self._active is self._takeoff

    @property
    def is_underway(self) -> bool:
        """Whether the present mode has been sent to a position, and the vehicle is still on its way there."""
        return self._active.is_underway

    @property
    def has_ended(self) -> bool:
        """Whether a vehicle that stays on the ground stands where its mode was to lead it."""
        return self.context.has_ended

    @property
    def is_landing(self) -> bool:
        """Whether the mode is on its last descent."""
        return self.context.is_landing

    def needs_position(self, mode: Mode) -> bool:
        """Whether a mode can only be flown with a position, as its row and what it would fly now say."""
        return self._specs[mode].needs_position and self.modes[mode].needs_position()

    def stream_age_us(self) -> int:
        return self._active.stream_age_us()

    def tell_position(self, *, is_valid: bool) -> None:
        """The commander's judgement of the position estimate."""
        self.context.has_position = is_valid

    def enter(self, mode: Mode) -> None:
        """Changes to a mode: at once in flight, when armed otherwise."""
        self._active.leave(mode)
        self._forget_requests(mode)
        if self.modes[mode] is not self._active:
            self._reverse_ends = mode is Mode.HOLD and self.context.setpoint.is_reversed
            self.context.setpoint.is_reversed = self._reverse_ends  # DO_SET_REVERSE is for the mode flown
        is_low = self.is_taking_off and not is_high(self.context)
        was_climbing = self._is_in_takeoff or self._climb is not None
        self._active = self.context.flown = self.modes[mode]
        self._is_rising = is_low and self._active.finishes_takeoff
        self.context.heading.end_turn()
        self._climb = self._takeoff.climb if self._takeoff and is_low and self._active.goes_away() else None
        if self._climb is None:
            if self.context.state.is_armed:
                self._active.start()
        elif not was_climbing:
            self._climb.resume()

    def stay(self) -> None:
        """Stays where it is in the present mode: what it was sent to is given up."""
        self._active.forget()
        self.enter(self.context.state.mode)

    def begin_here(self, mode: Mode) -> None:
        """Begins a mode anew, or another, without what clients have asked of it: where the vehicle is."""
        self._forget_requests(None)
        self.enter(mode)

    def _forget_requests(self, kept: Mode | None) -> None:
        """A position or a height that was asked of a mode does not wait for the next time it is entered."""
        for mode, flown in self.modes.items():
            if mode is not kept:
                flown.forget()

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
        context.wants_lift = state.awaits_launch = False
        context.is_landing = context.has_ended = False
        setpoint = context.setpoint
        wish: Mode | None = None
        if state.is_armed:
            self.crumbs.frame()
            self._watch_takeoff()
            if self._climb is None or self._has_climbed(self._climb):
                self._active.frame()
            if self._reverse_ends and hypot(*state.estimate.vel_ned[:2]) < _STANDING_M_S:
                self.set_reversed(is_reversed=False)
            if context.heading.is_active or context.yaw_mode:
                context.heading.frame()
            wish = context.wish
            context.wish = None
        if context.is_on_ground or not state.is_armed or state.mode is Mode.TERMINATION:
            setpoint.idle()
            setpoint.as_asked()
            self.ask = Ask.STAY
        elif context.craft.ground is not None and context.craft.ground.settles:
            self._respect_ground()
        state.goal_ned, state.path_start_ned = setpoint.pos_ned, setpoint.path_start_ned
        may_turn = state.is_armed and state.mode is not Mode.TERMINATION
        setpoint.set_flags(is_armed=may_turn, is_landed=context.is_on_ground)
        return wish

    def _watch_takeoff(self) -> None:
        """A client may choose Hold before it says where to go (MAVSDK): on the ground the take-off waits a little."""
        context = self.context
        if self._is_in_takeoff:
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
        """Lets the vehicle settle where it touches the ground, and go down gently to a position on the ground.

        Leaning into the wind against the ground would tip it over, and so would a sideways touch without any control.
        """
        context = self.context
        state, setpoint, ground = context.state, context.setpoint, context.ground
        stand_d = standing_d(state, context.craft.standing_height_m)
        ask = self.ask = vertical_ask(setpoint, state.estimate, stand_d, context.craft.lift_thrust)
        if state.has_ground_contact and ask is not Ask.UP:
            setpoint.settle(_SETTLE_THRUST, state.yaw_rad)
        elif (
            ask is Ask.DOWN
            and setpoint.pos_ned[2] == setpoint.pos_ned[2]
            and stand_d - state.estimate.pos_ned[2] < context.number(ground.crawl_height)
        ):
            is_measured = state.estimate.flags & TERRAIN_VALID
            setpoint.press(context.number(ground.crawl_speed if is_measured else ground.land_speed))
        else:
            setpoint.as_asked()

    # ---- what clients ask for ----

    def mode_for(self, request: ModeRequest) -> Mode | None:
        """The mode that carries out a request: the present one, the one it names, or the first that takes it."""
        able = [mode for mode, spec in self._specs.items() if type(request) in spec.takes]
        if request.stays and self.context.state.mode in able:
            return self.context.state.mode
        if request.mode in able:
            return request.mode
        return able[0] if able else None

    def may_go(self, mode: Mode) -> bool:
        """Whether the vehicle can be sent somewhere by a mode: it is in the air, or about to be."""
        flown = self.modes.get(mode)
        is_taking_off = self.is_taking_off
        return self.context.state.is_flying or (flown is not None and flown.may_go(is_taking_off=is_taking_off))

    def take(self, mode: Mode, request: ModeRequest) -> Reply:
        """Hands a request to the mode that carries it out; the caller enters that."""
        return self.modes[mode].take(request)

    def begin_request(self, mode: Mode) -> None:
        """Begins what the present mode has just been asked for."""
        if self.modes[mode].begins_anew:
            self.enter(mode)

    @property
    def goes_round(self) -> bool:
        """Whether a landing that is given up leads round by the mode's own way: of what cannot stop in the air."""
        ground = self.context.craft.ground
        return ground is not None and not ground.settles

    def go_around(self, height_m: float) -> Reply:
        """Gives up the landing being flown, of what goes round."""
        return self._active.go_around(height_m)

    def report(self, report: Report) -> Reply:
        """Hands what a client tells to the modes that take it, flown or not."""
        for flown in self._listeners.get(type(report), ()):
            flown.take(report)
        return ACCEPTED

    def set_reversed(self, *, is_reversed: bool) -> Reply:
        """Whether ways are driven backwards, until the mode changes."""
        if self.context.craft.ground is not None:
            return Reply(Verdict.UNSUPPORTED, "it does not drive")
        self._reverse_ends = False
        self.context.setpoint.set_reversed(is_reversed=is_reversed)
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
