"""What the skills that go to goals share: gotos and the plan, a ring of ranges, a policy that decides on each scan.

A decision for each new scan (10 Hz), while there is a goal. What is shown of it and how it is reached is the skill's. A
guard that does not believe the policy bounds what it asks for; where no scan comes, it decides on the last once more,
which is older then.
"""

from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from policies.companion.guard.goal_guard import STANDING, GoalGuard, GoalStance
from policies.companion.guard.interventions import BeginningReasons, Interventions
from policies.companion.ranges import OLD_US, Ranges
from policies.companion.skills.pace import Pace
from policies.companion.skills.skill import Floats, Velocity
from policies.companion.telemetry import NEVER_US, Own
from policies.companion.vector_pilot import VectorPilot
from policies.companion.vehicle_link import VehicleLink
from policies.companion.where_to.goals import Goals
from policies.companion.where_to.owner_goal import OwnerGoal
from policies.tasks.layout import Layout

GUARDED_OLD_US = 2_500_000  # the guard stands still before
NO_GOAL = "no goal"


class FrameStack(Protocol):
    """Whoever keeps the last frames of an observation."""

    def reset(self) -> None:
        """As at an episode's start."""
        ...


class GoalSkill:
    """One vehicle's skill to go to goals.

    Args:
        pilot: who decides.
        frames: what it is shown.
        is_ordered_by_goto: a goto to the vehicle is an order to go there.
        guard: who bounds it; None: nobody.
    """

    return_s = resume_s = 0.0  # who goes to goals has lost nobody
    is_by_sight = False
    flying: str
    goals: Goals | OwnerGoal  # this and the next two from `attach` on
    ranges: Ranges
    _vehicle: VehicleLink
    stances = tuple(stance.value for stance in GoalStance)

    def __init__(
        self, pilot: VectorPilot, frames: FrameStack, *, is_ordered_by_goto: bool, guard: GoalGuard | None
    ) -> None:
        self.seen: Floats = np.zeros(0, dtype=np.float32)
        self.wanted: Velocity = ((0.0, 0.0, 0.0), 0.0)
        self._is_ordered_by_goto = is_ordered_by_goto
        self._pilot = pilot
        self._stack = frames
        self._pace = Pace()
        self._is_new = False  # there is a scan that was not decided on
        self.guard = guard
        self._stance = GoalStance.FREE  # as told
        self._beginning = BeginningReasons()

    @property
    def interventions(self) -> Interventions | None:
        return None if self.guard is None else self.guard.interventions

    @property
    def stance(self) -> str:
        return "" if self.guard is None else self.guard.stance.value

    def receive(self, vehicle: VehicleLink, time_us: int, *, is_flying: bool) -> bool:
        self.goals.frame(time_us)
        self.ranges.follow()
        self._is_new = self.ranges.take_new() or self._is_new
        if self.guard is not None:
            self.guard.sense(vehicle.own, self.ranges)
        return self._is_new or (self.guard is not None and is_flying and self._pace.is_due(time_us, is_new=False))

    def is_ordered(self) -> bool:
        return self.goals.is_ordered()

    def blindness(self, own: Own, time_us: int, *, is_flying: bool) -> str:  # noqa: ARG002
        is_guarded = self.guard is not None and is_flying
        return self.ranges.trouble(time_us, GUARDED_OLD_US if is_guarded else OLD_US)

    def loss(self, own: Own, *, is_flying: bool) -> str:  # noqa: ARG002
        return "" if self.goals.goal is not None else self.goals.done or NO_GOAL

    def is_alone(self, own: Own) -> bool:  # noqa: ARG002
        return False

    def is_covered(self, own: Own) -> bool:  # noqa: ARG002
        return False

    def begin(self, own: Own) -> None:
        self._forget()
        self._stance = GoalStance.FREE
        if self.guard is not None:
            self.guard.begin(own)

    @property
    def record_layout(self) -> Layout:
        return replace(self._pilot.task, stack=1)

    @property
    def image_layout(self) -> Layout | None:
        return None

    def keep_records(self) -> None:
        """Has nothing to make ready."""

    def recorded_frame(self, own: Own, flown: Velocity, time_us: int, *, is_flying: bool) -> Floats:  # noqa: ARG002
        return self.seen[-self._pilot.task.frame_size :]

    def recorded_image(self) -> NDArray[np.uint8] | None:
        return None

    def conclude(self, own: Own) -> None:
        """Has nothing left to do."""

    def hint(self, trouble: str) -> str:  # noqa: ARG002
        return ""

    def close(self) -> None:
        """Has nothing to give back."""

    def _is_due(self, time_us: int) -> bool:
        """Whether a decision is due, which is then taken."""
        if not self._pace.is_due(time_us, is_new=self._is_new):
            return False
        self._pace.decided(time_us)
        self._is_new = False
        return True

    def _act(self, vector: Floats, *, is_flying: bool) -> Floats:
        """The action on an observation."""
        self.seen = vector.copy()
        action = self._pilot.act(vector)
        if not is_flying or not np.isfinite(action).all():
            self._forget()
        return action

    def _guarded(self, wanted: Velocity, own: Own) -> Velocity:
        """What the guard lets be flown; its stance is told as it changes, and its reasons as they begin."""
        self.wanted = wanted
        if self.guard is None:
            return wanted
        allowed = self.guard.filtered(wanted, own)
        if self.guard.stance is not self._stance:
            stance = self.guard.stance
            self._vehicle.say(f"Companion: {self.flying if stance is GoalStance.FREE else stance.value}")
            if self._stance in STANDING and stance is GoalStance.FREE:
                self._forget()  # what it remembers is from before
            self._stance = stance
        if text := self._beginning.text(self.guard.interventions.latest, own.boot_us):
            self._vehicle.say(f"Companion: {text}")
        return allowed

    def _forget(self) -> None:
        """An episode begins."""
        self._pilot.reset()
        self._stack.reset()

    def _go_on(self) -> bool:
        """The goal is reached: goes on to the next; whether there is one."""
        reached = self.goals.reached()
        if reached is None or reached.is_last:
            return False
        self._vehicle.say(f"Companion: {reached.name} reached")
        return True

    def _figures(self, left_m: float | None, time_us: int) -> str:
        """How far it is to the goal [m], None without one, and how old the scan is."""
        goal = NO_GOAL if left_m is None else f"goal {left_m:.1f} m"
        scan_us = self.ranges.scan_us
        return f"{goal} | " + ("no scan" if scan_us == NEVER_US else f"scan {(time_us - scan_us) * 1e-3:.0f} ms")
