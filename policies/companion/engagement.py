"""Who flies: the companion's state machine, from waiting for data to handing control back.

In: the situation, at every step of the companion's loop. Out: which setpoints to send, which mode to ask for, what to
tell the pilot. It knows no sockets, no messages and no clock but the one in the situation. The pilot comes first: the
companion never takes back what has been taken from it, and flies again only when it is told again. What it may do by
itself where no pilot has taken anything is in aftermath.py.
"""

from dataclasses import dataclass, field, replace
from enum import Enum

from autopilot.interface.vehicle_state import Mode
from policies.companion.aftermath import Aftermath, Condition, Due, Right, is_falling

ASK_AGAIN_US = 500_000  # a mode that has not come is asked for again
ENGAGE_PATIENCE_US = 3_000_000  # after which a change to Offboard that has not come has failed
HAND_BACK_PATIENCE_US = 3_000_000  # after which the vehicle is left to its own loss-of-offboard failsafe
RETURN_PATIENCE_US = 3_000_000  # after which it stays in Hold
SILENCE_US = 2_000_000  # after control has gone, before setpoints that ask for nothing are offered again


class Phase(Enum):
    """What the companion is doing."""

    WAITING = "waiting"  # something is missing; sends nothing
    READY = (
        "ready"  # offers setpoints that stay where they are, so that the pilot may choose Offboard; sends none in it
    )
    ENGAGING = "engaging"  # was told to engage, and asks for Offboard
    FLYING = "flying"  # the policy's setpoints are flown
    HANDING_BACK = "handing back"  # stays where it is, and asks for Hold
    RELEASED = "released"  # control has gone to somebody else; sends nothing
    REGAINING = "regaining"  # there is a position again: asks for Hold, and waits there until it may go on
    RETURNING = "returning"  # nobody is there to be followed, and asks for Return


_CHOOSING = (Phase.HANDING_BACK, Phase.REGAINING, Phase.ENGAGING, Phase.RETURNING)  # a mode is the companion's


class Sending(Enum):
    """Which setpoints go out."""

    NOTHING = 0
    STAY = 1  # no velocity, no turning
    POLICY = 2


class Wish(Enum):
    """The mode to ask the vehicle for."""

    NONE = 0
    OFFBOARD = 1
    HOLD = 2
    RETURN = 3


@dataclass(frozen=True, slots=True)
class Situation:
    """What the state machine looks at."""

    time_us: int  # on the companion's own clock
    is_offboard: bool  # the vehicle's mode, as last heard
    is_airborne: bool  # armed, and not on the ground
    is_holding: bool  # in mode Hold: waiting for whatever comes next
    mode_name: str = ""  # for the pilot to read
    trouble: str = ""  # why the policy cannot fly now; "" if it can
    is_refused: bool = False  # the vehicle has refused a mode since the last step
    condition: Condition = field(default_factory=Condition)


@dataclass(frozen=True, slots=True)
class Orders:
    """What follows from it."""

    sending: Sending = Sending.NOTHING
    wish: Wish = Wish.NONE
    text: str = ""  # to tell the pilot


class Engagement:
    """The state machine.

    Args:
        is_reported: to engage as soon as everything is there and the vehicle holds in the air; once.
        ready: what it could do, for the pilot to read.
        flying: what it does.
        aftermath: what it may do by itself; None: nothing.
    """

    def __init__(
        self,
        *,
        is_reported: bool = False,
        ready: str = "ready to follow",
        flying: str = "following",
        aftermath: Aftermath | None = None,
    ) -> None:
        self._ready_text, self._flying_text = f"Companion: {ready}", f"Companion: {flying}"
        self.phase = Phase.WAITING
        self._aftermath = aftermath or Aftermath(0.0, 0.0)
        self._before = Condition()  # when it began to hand back
        self._own_mode: Mode | None = None  # that the companion has brought about, for as long as it lasts
        self._is_reported = is_reported
        self._since_us = 0  # when this phase began
        self._asked_us = 0  # when a mode was last asked for
        self._was_offboard = True  # until seen otherwise: a vehicle found in Offboard is flown by somebody else

    def engage(self, *, is_flown: bool = True) -> None:
        """Tells the companion to take control as soon as everything is there; also if it has just let go.

        Args:
            is_flown: the vehicle is in a mode that it can be flown in; it may have left it since the last step.
        """
        self._is_reported = self.phase is not Phase.FLYING or not is_flown  # who flies has nothing to take
        if self.phase is Phase.RELEASED:
            self.phase = Phase.WAITING

    @property
    def has_chosen(self) -> bool:
        """Whether the vehicle is in its mode by the companion, or by the failsafe that it watches, and by no pilot."""
        return self.phase in _CHOOSING or self._aftermath.right is not Right.NONE or self._own_mode is not None

    def step(self, now: Situation) -> Orders:
        """Takes the next step; at most one change of phase."""
        orders = self._step(now)
        may_go_on = self._aftermath.may_resume(now.time_us) and now.condition.is_well
        if is_falling(now.condition) and not may_go_on:  # PX4 goes back to Offboard by itself, if setpoints come
            return replace(orders, sending=Sending.NOTHING)
        return orders

    def _step(self, now: Situation) -> Orders:
        is_chosen = now.is_offboard and not self._was_offboard  # the pilot has just switched to Offboard
        self._was_offboard = now.is_offboard
        text = self._aftermath.look(now.time_us, now.condition)
        self._note_mode(now.condition.mode)
        if text:
            return Orders(text=text)
        if self.phase in (Phase.WAITING, Phase.READY, Phase.RELEASED) and not now.is_offboard:
            orders = self._after(now)
            if orders is not None:
                return orders
        match self.phase:
            case Phase.WAITING:
                return self._waiting(now, is_chosen)
            case Phase.READY:
                return self._ready(now, is_chosen)
            case Phase.ENGAGING:
                return self._engaging(now)
            case Phase.FLYING:
                return self._flying(now)
            case Phase.HANDING_BACK:
                return self._handing_back(now)
            case Phase.RELEASED:
                return self._released(now, is_chosen)
            case Phase.REGAINING:
                return self._regaining(now, is_chosen)
            case Phase.RETURNING:
                return self._returning(now, is_chosen)

    def _note_mode(self, mode: Mode | None) -> None:
        """Keeps in mind whose the vehicle's mode is."""
        is_sent_home = self.phase is Phase.RETURNING and mode is Mode.RETURN
        if is_sent_home or self._aftermath.right is not Right.NONE:
            self._own_mode = mode
        elif mode is not self._own_mode:
            self._own_mode = None

    def _after(self, now: Situation) -> Orders | None:
        """What it does by itself, though nobody has told it; None: nothing."""
        match self._aftermath.due(now.time_us, now.condition):
            case Due.CATCH:
                self._aftermath.catch()
                return self._ask(Phase.REGAINING, now, Wish.HOLD, "Companion: position is back: hold")
            case Due.RESUME:
                return self._go(Phase.REGAINING, now, Sending.STAY, text="Companion: position is back")
            case Due.RETURN if now.condition.is_covered:
                self._aftermath.end()
                return Orders(_offered(now), text="Companion: owner lost, no way up: stays")
            case Due.RETURN if _is_just_heard(now):
                return self._ask(Phase.RETURNING, now, Wish.RETURN, "Companion: owner lost, returning")
            case _:
                return None

    def _waiting(self, now: Situation, is_chosen: bool) -> Orders:
        if now.trouble:
            return Orders()
        if is_chosen and now.is_airborne:
            return self._fly(now)
        return self._go(Phase.READY, now, _offered(now), text=self._ready_text)

    def _ready(self, now: Situation, is_chosen: bool) -> Orders:
        if now.trouble:
            return self._go(Phase.WAITING, now, text=f"Companion: not ready: {now.trouble}")
        if is_chosen and now.is_airborne:
            return self._fly(now)
        if self._is_reported and now.is_airborne and now.is_holding:  # never out of a takeoff, a landing or a return
            self._is_reported = False
            return self._ask(Phase.ENGAGING, now, Wish.OFFBOARD)
        return Orders(_offered(now))

    def _engaging(self, now: Situation) -> Orders:
        if now.trouble:
            return self._go(Phase.WAITING, now, text=f"Companion: not engaged: {now.trouble}")
        if now.is_offboard:
            return self._fly(now)
        if not now.is_holding:  # nor is it asked for over a pilot who has just chosen something else
            return self._go(Phase.READY, now, Sending.STAY, text=f"Companion: not engaged: mode {now.mode_name}")
        if now.is_refused or now.time_us - self._since_us > ENGAGE_PATIENCE_US:
            return self._go(Phase.READY, now, Sending.STAY, text="Companion: not engaged: Offboard was refused")
        return self._repeat_if_heard(now, Wish.OFFBOARD)

    def _flying(self, now: Situation) -> Orders:
        if not now.is_offboard:
            self._aftermath.let_go(now.time_us, now.condition)
            return self._go(Phase.RELEASED, now, text=_stopped(now))
        if not now.is_airborne:
            return self._go(Phase.RELEASED, now, text="Companion: stopped: not in the air")
        if now.trouble:
            self._before = now.condition
            return self._ask(Phase.HANDING_BACK, now, Wish.HOLD, f"Companion: hold: {now.trouble}")
        return Orders(Sending.POLICY)

    def _handing_back(self, now: Situation) -> Orders:
        if not now.is_offboard:
            self._is_reported &= now.is_holding  # any other mode is a pilot's
            self._aftermath.let_go(now.time_us, now.condition, self._before)
            return self._go(Phase.RELEASED, now)
        if now.time_us - self._since_us > HAND_BACK_PATIENCE_US:
            return self._go(Phase.RELEASED, now, text="Companion: stopped: Hold was not taken")
        return self._repeat(now, Wish.HOLD)

    def _released(self, now: Situation, is_chosen: bool) -> Orders:
        if is_chosen and now.is_airborne and not now.trouble:  # the last setpoints were recent enough to be flown on
            return self._fly(now)
        if now.time_us - self._since_us >= SILENCE_US:
            return self._go(Phase.WAITING, now)
        return Orders()

    def _regaining(self, now: Situation, is_chosen: bool) -> Orders:
        aftermath, condition = self._aftermath, now.condition
        if is_chosen and now.is_airborne and not now.trouble:
            return self._fly(now)
        if aftermath.right is Right.NONE:
            return self._stop(now)
        if aftermath.right is Right.FALLEN:
            if condition.is_unplaced or not aftermath.is_catching:  # lost again, or another failsafe
                aftermath.give_up_catch()
                return self._go(Phase.RELEASED, now)
            if now.time_us - self._since_us > HAND_BACK_PATIENCE_US:
                aftermath.end()
                return self._go(Phase.RELEASED, now, text="Companion: Hold was not taken")
            return self._repeat_if_heard(now, Wish.HOLD)
        if not aftermath.may_resume(now.time_us):
            why = now.trouble or ("the owner is not seen" if condition.is_alone else "the position is not steady")
            return self._go(Phase.RELEASED, now, text=f"Companion: stays in hold: {why}")
        is_due = aftermath.due(now.time_us, condition) is Due.RESUME and _is_just_heard(now)
        if is_due and now.is_airborne and not now.trouble:
            aftermath.asked()
            return self._ask(Phase.ENGAGING, now, Wish.OFFBOARD)
        return Orders(Sending.STAY)

    def _returning(self, now: Situation, is_chosen: bool) -> Orders:
        if is_chosen and now.is_airborne and not now.trouble:
            return self._fly(now)
        if now.condition.mode is Mode.RETURN:
            return self._go(Phase.RELEASED, now)
        if self._aftermath.right is Right.NONE:
            return self._stop(now)
        if now.is_refused or now.time_us - self._since_us > RETURN_PATIENCE_US:
            self._aftermath.end()
            return self._go(Phase.RELEASED, now, text="Companion: stays in hold: Return was refused")
        return self._repeat_if_heard(now, Wish.RETURN)

    def _repeat(self, now: Situation, wish: Wish) -> Orders:
        """Asks for a mode again if that is due."""
        if now.time_us - self._asked_us < ASK_AGAIN_US:
            return Orders(Sending.STAY)
        self._asked_us = now.time_us
        return Orders(Sending.STAY, wish)

    def _repeat_if_heard(self, now: Situation, wish: Wish) -> Orders:
        """The same, but not over a mode that a pilot may have chosen since the last heartbeat."""
        return self._repeat(now, wish) if _is_just_heard(now) else Orders(Sending.STAY)

    def _stop(self, now: Situation) -> Orders:
        """Somebody else has control; nothing that was asked for before counts any more."""
        self._is_reported = False
        return self._go(Phase.RELEASED, now, text=_stopped(now))

    def _fly(self, now: Situation) -> Orders:
        self._is_reported = False
        self._aftermath.end()
        return self._go(Phase.FLYING, now, Sending.POLICY, text=self._flying_text)

    def _go(self, phase: Phase, now: Situation, sending: Sending = Sending.NOTHING, text: str = "") -> Orders:
        self.phase, self._since_us = phase, now.time_us
        return Orders(sending, text=text)

    def _ask(self, phase: Phase, now: Situation, wish: Wish, text: str = "") -> Orders:
        self.phase, self._since_us, self._asked_us = phase, now.time_us, now.time_us
        return Orders(Sending.STAY, wish, text)


def _is_just_heard(now: Situation) -> bool:
    """Whether a heartbeat has come in for this step: the mode is the vehicle's, not one of up to seconds ago."""
    return now.condition.heartbeat_age_us == 0


def _stopped(now: Situation) -> str:
    return f"Companion: stopped: mode {now.mode_name}"


def _offered(now: Situation) -> Sending:
    """What is sent in readiness: nothing to a vehicle in Offboard, which somebody else flies, or nobody."""
    return Sending.NOTHING if now.is_offboard else Sending.STAY
