"""To navigate to a goal through forest: ranges in, the actions of a policy of Navigate or NavigateRover out.

It flies or drives while it has a goal; on the last metres it is slowed down, so that whoever gets the vehicle back gets
it nearly at rest, and not at speed among trees; a rover, which brakes less, at half its speed, and Hold stops it
within a metre. A rover is asked for velocities alone: its heading is theirs. The goal may be somebody with a phone, and
then it goes after them for as long as it hears of them.
"""

from math import dist, hypot, isfinite, nan, sqrt
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.attitude import Vector
from common.range_sectors import RANGES
from common.warp_start import start_warp
from policies.companion.decision_log import NO_GOAL
from policies.companion.guard.goal_guard import GoalGuard
from policies.companion.guard.settings import GuardSettings
from policies.companion.image_client import ImageSource
from policies.companion.observation import CommandKernel, write_own_row
from policies.companion.ranges import Ranges
from policies.companion.senses.senses import Senses
from policies.companion.skills.goal_skill import GoalSkill
from policies.companion.skills.skill import Floats, Velocity
from policies.companion.telemetry import Own
from policies.companion.vector_pilot import NavigationPilot
from policies.companion.vehicle_link import VehicleLink
from policies.companion.where_to.goals import Goals
from policies.companion.where_to.owner_goal import OwnerGoal
from policies.person_detector.detector import LOW_WEIGHTS, WEIGHTS, PersonDetector, shipped
from policies.tasks.flight.own_state import OwnState
from policies.tasks.navigate.observe import observe_rows

BRAKE_M_S2 = (
    3.0  # guess: half of what a drone can; more than a rover does, but a policy drives worst where it is slowed
)
END_M_S = 1.0  # speed at which it is handed back; guess


class Navigating(GoalSkill):
    """One vehicle's skill to navigate.

    Args:
        pilot: who decides.
        is_ordered_by_goto: a goto to the vehicle is an order to fly there.
        camera: to follow the owner by, in place of gotos and plans; None: it does not.
        guard: who bounds it; None: as it ships.
    """

    is_along_nose = False
    action_size = 4

    def __init__(
        self,
        pilot: NavigationPilot,
        *,
        is_ordered_by_goto: bool = False,
        camera: ImageSource | None = None,
        guard: GuardSettings | None = None,
    ) -> None:
        does = ("ready to navigate", "navigating") if camera is None else ("ready to follow", "following")
        self.ready, self.flying = does
        self.camera: ImageSource | None = camera
        self._observer = NavigationObserver(pilot.stack, drives=pilot.drives)
        self.drives = pilot.drives
        self._shown_m, self._arrived_m = pilot.shown_m, pilot.arrived_m
        self._settings = settings = guard or GuardSettings()
        held = GoalGuard(settings, drives=pilot.drives) if settings.is_on else None
        super().__init__(pilot, self._observer, is_ordered_by_goto=is_ordered_by_goto, guard=held)
        self._command = CommandKernel()

    def attach(self, vehicle: VehicleLink) -> None:
        self._vehicle = vehicle
        self.goals = (
            Goals(vehicle, is_ordered_by_goto=self._is_ordered_by_goto)
            if self.camera is None
            else OwnerGoal(vehicle, self.camera, Senses(detector=self._detector()), self._settings)
        )
        self.ranges = Ranges(vehicle)

    def _detector(self) -> PersonDetector:
        """Of people, as the camera is high."""
        return PersonDetector(shipped(LOW_WEIGHTS if self.drives else WEIGHTS))

    def decide(self, own: Own, last_action: Floats, time_us: int, *, is_flying: bool) -> Floats | None:
        if isinstance(self.goals, OwnerGoal):
            self.goals.may_search = is_flying and self._settings.is_on
        if is_flying:
            self._note_arrival(own)
        goal_ned = self.goal_ned(own)
        if goal_ned is None or not self._is_due(time_us):
            return None
        shown_ned = _shown(goal_ned, own, self._shown_m)
        vector = self._observer.vector(own, shown_ned, self.ranges.from_here(), last_action)
        return self._act(vector, is_flying=is_flying)

    def setpoint(self, action: Floats, own: Own) -> Velocity:
        """What an action asks for, slower before the last goal, and as the guard lets it."""
        (north, east, down), yaw_rate = self._command.setpoint(action, own)
        limit = self._speed_limit(own)
        speed = hypot(north, east)
        slower = limit / speed if speed > limit else 1.0
        if self.drives:
            return self._guarded(((slower * north, slower * east, 0.0), nan), own)
        return self._guarded(((slower * north, slower * east, down), yaw_rate), own)

    def action_of(self, flown: Velocity, own: Own, action: Floats) -> Floats:
        return self._command.action_of(*flown, own, action)

    def recorded_goal(self, own: Own) -> Vector:
        return self.goal_ned(own) or NO_GOAL

    def goal_ned(self, own: Own) -> Vector | None:
        """[m] Where it goes; None: nowhere."""
        goal = self.goals.goal
        if goal is None:
            return None
        north, east, down = goal.pos_ned
        return north, east, down if isfinite(down) and not self.drives else own.pos_ned[2]

    def figures(self, own: Own, time_us: int) -> str:
        goal_ned = self.goal_ned(own)
        return self._figures(None if goal_ned is None else dist(goal_ned, own.pos_ned), time_us)

    def close(self) -> None:
        if self.camera is not None:
            self.camera.close()

    def _note_arrival(self, own: Own) -> None:
        """Goes on to the next goal if this one has been reached."""
        goal_ned = self.goal_ned(own)
        if goal_ned is not None and dist(goal_ned[:2], own.pos_ned[:2]) < self._arrived_m:
            self._go_on()

    def _speed_limit(self, own: Own) -> float:
        """Level speed [m/s] at which it stays behind the owner, or can still brake before the last goal."""
        if isinstance(self.goals, OwnerGoal):
            return self.goals.speed_max_m_s
        goal, goal_ned = self.goals.goal, self.goal_ned(own)
        if goal is None or goal_ned is None or not goal.is_last:
            return float("inf")
        room_m = max(dist(goal_ned[:2], own.pos_ned[:2]) - self._arrived_m, 0.0)
        return sqrt(END_M_S**2 + 2.0 * BRAKE_M_S2 * room_m)


def _shown(goal_ned: Vector, own: Own, shown_m: float) -> Vector:
    """The goal, or a place on the way to it that is no farther than in training."""
    away_m = dist(goal_ned[:2], own.pos_ned[:2])
    if away_m <= shown_m:
        return goal_ned
    fraction = shown_m / away_m
    north, east = (here + fraction * (there - here) for there, here in zip(goal_ned[:2], own.pos_ned[:2], strict=True))
    return north, east, goal_ned[2]


class NavigationObserver:
    """One vehicle's observations, by the kernel function of training.

    Args:
        stack: frames in an observation.
        drives: it is on the ground, without a range finder that looks down.
    """

    def __init__(self, stack: int, *, drives: bool = False) -> None:
        start_warp()
        self._drives = drives
        own, action, goal = wp.zeros(1, dtype=OwnState), wp.zeros(1, dtype=wp.vec4), wp.zeros(1, dtype=wp.vec3)
        ranges, out = wp.zeros((1, RANGES), dtype=float), wp.zeros((1, NavigationPilot.frame_size), dtype=float)
        self._own: NDArray[Any] = own.numpy()  # live views, as of the others
        self._action: Floats = action.numpy()
        self._goal: Floats = goal.numpy()
        self._ranges: Floats = ranges.numpy()
        self._out: Floats = out.numpy()
        self._frames: Floats = np.zeros((stack, NavigationPilot.frame_size), dtype=np.float32)
        self._observe = wp.launch(observe_rows, 1, [1, own, action, goal, ranges, out], record_cmd=True)

    def reset(self) -> None:
        """As at an episode's start."""
        self._frames[:] = 0.0

    def vector(self, own: Own, goal_ned: Vector, ranges_m: Floats, last_action: Floats) -> Floats:
        """The observation as of now: the last frames, oldest first.

        Args:
            own: telemetry.
            goal_ned: [m] where to go.
            ranges_m: of sectors and beams.
            last_action: in [-1, 1], shape (4,).
        """
        write_own_row(self._own[0], own)
        if self._drives:
            self._own[0]["is_height_valid"] = 0
        self._action[0], self._goal[0], self._ranges[0] = last_action, goal_ned, ranges_m
        self._observe.launch()
        self._frames[:-1] = self._frames[1:]
        self._frames[-1] = self._out[0]
        return self._frames.ravel()
