"""The companion computer: telemetry and its skill's sensors in, Offboard setpoints out. Start here.

In: bytes of a MAVLink link, taken in at every step, and what the skill senses: images, or ranges. Out: a decision of
the policy for each new image or scan (10 Hz), sent at once and repeated at 20 Hz; a change of mode when the state
machine asks for one; texts for the pilot. `frame(time_us)` is the whole loop: a process calls it on the wall clock, a
lockstep flight on simulated time, and then the same flight gives the same bytes.
"""

from collections import deque
from collections.abc import Callable
from math import dist, isfinite

import numpy as np

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.client_end import ByteLink
from policies.companion.aftermath import Aftermath, Condition
from policies.companion.decision_log import Decision, OnDecision, motion_along_nose, motion_of
from policies.companion.engagement import Engagement, Phase, Sending, Situation, Wish
from policies.companion.skills.skill import Floats, Skill, Velocity
from policies.companion.stick_control import StickControl
from policies.companion.telemetry import NEVER_US, Own
from policies.companion.vehicle_link import VehicleLink

SETPOINT_US = 50_000
TELEMETRY_OLD_US = 500_000
HEARTBEAT_OLD_US = 3_000_000  # sent at 1 Hz
MISFIT = "the policy was made for another kind of vehicle"
NO_DECISION = "the policy does not decide"
NO_HEIGHT = "no height above the ground from a range finder that looks down"
NOT_ALONE = "another companion is connected"
LATENCIES_KEPT = 600  # a minute of decisions
_CHANGED = 1e-3  # [m/s, rad/s] a velocity that is so much another is

STILL: Velocity = ((0.0, 0.0, 0.0), 0.0)


class Companion:
    """One vehicle's companion.

    Args:
        link: bytes to and from the vehicle.
        skill: what it can do, and who decides.
        is_reported: engage as soon as everything is there; otherwise the pilot chooses Offboard.
        is_by_sticks: what drives is driven by MANUAL_CONTROL in mode Position, and not in Offboard.
        wall_s: a clock in seconds that the latency is measured with; none: it is not measured.
    """

    def __init__(
        self,
        link: ByteLink,
        skill: Skill,
        *,
        is_reported: bool = False,
        is_by_sticks: bool = False,
        wall_s: Callable[[], float] | None = None,
    ) -> None:
        self.vehicle = VehicleLink(link, is_by_sticks=is_by_sticks)
        self._sticks = StickControl(self.vehicle) if is_by_sticks else None
        self.skill = skill
        skill.attach(self.vehicle)
        aftermath = Aftermath(skill.return_s, skill.resume_s)
        self.engagement = Engagement(
            is_reported=is_reported, ready=skill.ready, flying=skill.flying, aftermath=aftermath
        )
        self.latencies_s: deque[float] = deque(maxlen=LATENCIES_KEPT)  # image or scan in to setpoint out
        self.decision_count = 0
        self.trouble = ""  # why it does not fly
        self.on_decision: OnDecision | None = None
        """Is told of each decision."""
        self._was_flying: bool | None = None  # at the decision before
        self._wall_s = wall_s
        self._action: Floats = np.zeros(skill.action_size, dtype=np.float32)
        self._flown: Floats = self._action.copy()  # what was flown of it
        self._setpoint = STILL
        self._is_undecided = False  # the last action was no number
        self._setpoint_due_us = 0
        self._is_sent_in_guided = False  # ArduPilot's own goto is flown in the mode that setpoints are flown in
        self._sending = Sending.NOTHING
        self._begun_us = NEVER_US  # when the policy took over
        self._healthy_then: int | None = None  # what worked then

    def frame(self, time_us: int) -> None:
        """One step of the loop.

        Args:
            time_us: the companion's own clock; never goes back.
        """
        vehicle, skill = self.vehicle, self.skill
        vehicle.receive(time_us)
        vehicle.keep_alive(time_us)
        if self._sticks is not None:
            self._sticks.frame(time_us)
        begun_s = self._wall_s() if self._wall_s is not None else None  # a guard looks at the image as it comes in
        is_flying = self._sending is Sending.POLICY  # so far
        has_sensed = skill.receive(vehicle, time_us, is_flying=is_flying)
        if skill.is_ordered():
            self.engagement.engage(is_flown=vehicle.is_flown)
            self._is_sent_in_guided = vehicle.own.mode is Mode.GUIDED
        blindness = self._blindness(time_us)
        loss = skill.loss(vehicle.own, is_flying=is_flying)
        self.trouble = blindness or loss or (NO_DECISION if self._is_undecided else "")
        orders = self.engagement.step(self._situation(time_us, is_lost=bool(loss) and not blindness))
        if orders.text:
            vehicle.say(orders.text)
        if orders.wish is Wish.HOLD and self._sticks is not None:
            self._sticks.hold(time_us)
        elif orders.wish is not Wish.NONE:
            vehicle.ask_for(orders.wish)
        self._switch(orders.sending, time_us)
        has_looked = has_sensed and not blindness and self._decide(time_us)
        has_decided = has_looked and orders.sending is Sending.POLICY
        is_sending = orders.sending is not Sending.NOTHING or self._sticks is not None
        if is_sending and (has_decided or time_us >= self._setpoint_due_us):
            self._setpoint_due_us = time_us + SETPOINT_US
            self._send()
        if has_decided and begun_s is not None and self._wall_s is not None:
            self.latencies_s.append(self._wall_s() - begun_s)
        if has_looked and self.on_decision is not None:  # only now: the setpoint waits for no disk,
            self.on_decision(self._noted(time_us, is_flying=orders.sending is Sending.POLICY))
        if has_sensed:  # and not for this either
            skill.conclude(vehicle.own)

    @property
    def action(self) -> Floats:
        """What was chosen last, shape (actions,); zeros while it does not fly."""
        return self._action.copy()

    def close(self) -> None:
        """Stops sending; the vehicle notices."""
        self.skill.close()
        self.vehicle.close()

    def _send(self) -> None:
        """Sends the setpoint as the vehicle is driven."""
        if self._sticks is not None:
            self._sticks.send(self._setpoint)
        else:
            self.vehicle.send_setpoint(*self._setpoint, is_along_nose=self.skill.is_along_nose)

    def _switch(self, sending: Sending, time_us: int) -> None:
        """Takes over, or lets go."""
        if sending is Sending.POLICY and self._sending is not Sending.POLICY:
            self.skill.begin(self.vehicle.own)
            self._begun_us, self._healthy_then = time_us, self.vehicle.own.health
        self._sending = sending
        if sending is not Sending.POLICY:
            self._setpoint = STILL
            self._action[:] = 0.0
            self._flown = np.zeros_like(self._action)

    def _decide(self, time_us: int) -> bool:
        """Lets the skill look, and decide if it flies; whether a decision was due."""
        own, is_flying = self.vehicle.own, self._sending is Sending.POLICY
        action = self.skill.decide(own, self._flown, time_us, is_flying=is_flying)
        if action is None:
            return False
        self._is_undecided = not np.isfinite(action).all()
        if self._is_undecided:
            self._setpoint = STILL
            return False
        if is_flying:
            self._action = action
            self._setpoint = self.skill.setpoint(action, own)
            self._flown = action
            if _differ(self._setpoint, self.skill.wanted):
                self._flown = self.skill.action_of(self._setpoint, own, action)
            self.decision_count += 1
        return True

    def _noted(self, time_us: int, *, is_flying: bool) -> Decision:
        """What has just been decided."""
        own, skill = self.vehicle.own, self.skill
        moves = motion_along_nose(own) if skill.is_along_nose else motion_of(own)
        flown = self._setpoint if is_flying else moves
        is_first, self._was_flying = is_flying is not self._was_flying, is_flying
        return Decision(
            time_us=time_us,
            boot_us=own.boot_us,
            is_flying=is_flying,
            is_first=is_first,
            frame=skill.recorded_frame(own, flown, time_us, is_flying=is_flying),
            vector=None if skill.image_layout is None else skill.seen,
            action=self.action if is_flying else np.full(skill.action_size, np.nan, np.float32),
            wanted=skill.wanted if is_flying else flown,
            flown=flown,
            own=own,
            stance=skill.stance if is_flying else "",
            reasons=tuple(skill.interventions.latest) if is_flying and skill.interventions is not None else (),
            goal=skill.recorded_goal(own),
            image=skill.recorded_image(),
        )

    def _situation(self, time_us: int, *, is_lost: bool) -> Situation:
        own = self.vehicle.own
        return Situation(
            time_us=time_us,
            is_offboard=self.vehicle.is_flown,
            is_airborne=own.is_under_way,
            is_holding=own.mode in (Mode.HOLD, Mode.BRAKE) or (self._is_sent_in_guided and own.mode is Mode.GUIDED),
            mode_name=own.mode_name,
            trouble=self.trouble,
            is_refused=self.vehicle.take_refusal(),
            condition=self._condition(time_us, is_lost=is_lost),
        )

    def _condition(self, time_us: int, *, is_lost: bool) -> Condition:
        own, skill = self.vehicle.own, self.skill
        has_attitude = time_us - own.attitude_us <= TELEMETRY_OLD_US
        return Condition(
            mode=own.mode,
            heartbeat_age_us=time_us - own.heartbeat_us,
            is_failsafe=own.is_failsafe,
            is_heard=time_us - own.heartbeat_us <= HEARTBEAT_OLD_US < time_us - self.vehicle.other_us,
            is_down=not own.is_armed or (own.is_on_ground and not own.is_landing),
            is_unplaced=has_attitude and time_us - own.position_us > TELEMETRY_OLD_US,
            is_well=has_attitude and self._is_well(own),
            is_lost=is_lost,
            is_alone=skill.is_alone(own),
            is_by_sight=skill.is_by_sight,
            is_covered=self._sending is not Sending.POLICY and skill.is_covered(own),
            height_m=own.height_m,
            pos_ned=own.pos_ned,
        )

    def _is_well(self, own: Own) -> bool:
        """Whether all works that did when the policy took over, and no emergency was announced since."""
        if self._healthy_then is None or own.health is None or own.is_battery_low:
            return False
        return not self._healthy_then & ~own.health and own.alarm_us < self._begun_us

    def _blindness(self, time_us: int) -> str:
        """Why there is nothing to decide on; "" if there is."""
        own = self.vehicle.own
        if own.is_ground_vehicle != self.skill.drives and own.heartbeat_us != NEVER_US:
            return MISFIT
        if time_us - own.heartbeat_us > HEARTBEAT_OLD_US:
            return "no heartbeat of the vehicle"
        if time_us - self.vehicle.other_us <= HEARTBEAT_OLD_US:
            return NOT_ALONE
        is_placed = isfinite(own.pos_ned[0])
        if not is_placed or time_us - min(own.attitude_us, own.position_us) > TELEMETRY_OLD_US:
            return "no attitude or position from the vehicle"
        if not self.skill.drives and own.is_under_way and not isfinite(own.carried_height_m):
            return NO_HEIGHT
        blindness = self.skill.blindness(own, time_us, is_flying=self._sending is Sending.POLICY)
        return blindness or (self._sticks.trouble if self._sticks is not None else "")

    @property
    def phase(self) -> Phase:
        return self.engagement.phase


def _differ(flown: Velocity, wanted: Velocity) -> bool:
    """Whether what is flown is not what was wanted."""
    return dist(flown[0], wanted[0]) > _CHANGED or abs(flown[1] - wanted[1]) > _CHANGED
