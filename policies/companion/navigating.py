"""To navigate to a goal through forest: ranges or depth images in, the actions of a policy of Navigate out.

A decision for each new scan or image (10 Hz). It flies while it has a goal; on the last metres it is slowed down, so
that whoever gets the vehicle back gets it nearly at rest, and not at speed among trees.
"""

from math import dist, hypot, isfinite, sqrt
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.attitude import Vector
from common.range_sectors import RANGES
from common.warp_start import start_warp
from policies.companion.goals import Goals
from policies.companion.observation import CommandKernel, write_own_row
from policies.companion.ranges import Ranges
from policies.companion.skill import Floats, Velocity
from policies.companion.vector_pilot import NavigationPilot
from policies.companion.vehicle_link import Own, VehicleLink
from policies.tasks.flight.own_state import OwnState
from policies.tasks.navigate.observe import observe_rows

ARRIVED_M = 2.5  # by the estimate, half a metre inside of training's radius: the estimate may be off
SHOWN_M = 85.0  # the farthest goal of training: of one farther off its direction is shown
BRAKE_M_S2 = 3.0  # guess: half of what the vehicle can
END_M_S = 1.0  # speed at which it is handed back; guess
DECISION_US, DECISION_EARLY_US = 100_000, 10_000
NO_GOAL = "no goal"


class Navigating:
    """One vehicle's skill to navigate.

    Args:
        pilot: who decides.
        is_ordered_by_goto: a goto to the vehicle is an order to fly there.
    """

    ready, flying, drives = "ready to navigate", "navigating", False
    action_size = 4
    goals: Goals  # this and the next from `attach` on
    ranges: Ranges
    _vehicle: VehicleLink

    def __init__(self, pilot: NavigationPilot, *, is_ordered_by_goto: bool = False) -> None:
        self.seen: Floats = np.zeros(0, dtype=np.float32)
        self._is_ordered_by_goto = is_ordered_by_goto
        self._pilot = pilot
        self._observer = NavigationObserver(pilot.stack)
        self._command = CommandKernel()
        self._decided_us = -DECISION_US

    def attach(self, vehicle: VehicleLink) -> None:
        self._vehicle = vehicle
        self.goals = Goals(vehicle, is_ordered_by_goto=self._is_ordered_by_goto)
        self.ranges = Ranges(vehicle)

    def receive(self, vehicle: VehicleLink, time_us: int) -> bool:  # noqa: ARG002  (others need it)
        self.goals.frame(time_us)
        return self.ranges.take_new()

    def is_ordered(self) -> bool:
        return self.goals.is_ordered()

    def blindness(self, own: Own, time_us: int) -> str:  # noqa: ARG002
        return self.ranges.trouble(time_us)

    def loss(self, own: Own) -> str:  # noqa: ARG002
        return "" if self.goals.goal is not None else self.goals.done or NO_GOAL

    def begin(self, own: Own) -> None:  # noqa: ARG002
        self._pilot.reset()
        self._observer.reset()
        self._decided_us = -DECISION_US

    def decide(self, own: Own, last_action: Floats, time_us: int, *, is_flying: bool) -> Floats | None:
        if is_flying:
            self._note_arrival(own)
        goal_ned = self.goal_ned(own)
        if goal_ned is None or time_us - self._decided_us < DECISION_US - DECISION_EARLY_US:
            return None
        self._decided_us = time_us
        vector = self._observer.vector(own, _shown(goal_ned, own), self.ranges.ranges_m, last_action, time_us)
        self.seen = vector.copy()
        action = self._pilot.act(vector)
        if not is_flying or not np.isfinite(action).all():
            self._pilot.reset()
            self._observer.reset()
        return action

    def setpoint(self, action: Floats, own: Own) -> Velocity:
        """What an action asks for, slower before the last goal."""
        (north, east, down), yaw_rate = self._command.setpoint(action, own)
        limit = self._speed_limit(own)
        speed = hypot(north, east)
        slower = limit / speed if speed > limit else 1.0
        return (slower * north, slower * east, down), yaw_rate

    def conclude(self, own: Own) -> None:
        """Has nothing left to do."""

    def goal_ned(self, own: Own) -> Vector | None:
        """[m] Where it goes; None: nowhere."""
        goal = self.goals.goal
        if goal is None:
            return None
        north, east, down = goal.pos_ned
        return north, east, down if isfinite(down) else own.pos_ned[2]

    def hint(self, trouble: str) -> str:  # noqa: ARG002
        return ""

    def figures(self, own: Own, time_us: int) -> str:
        goal_ned = self.goal_ned(own)
        goal = f"goal {dist(goal_ned, own.pos_ned):.1f} m" if goal_ned is not None else NO_GOAL
        return f"{goal} | scan {(time_us - self.ranges.scan_us) * 1e-3:.0f} ms"

    def close(self) -> None:
        """Has nothing to give back."""

    def _note_arrival(self, own: Own) -> None:
        """Goes on to the next goal if this one has been reached."""
        goal_ned = self.goal_ned(own)
        if goal_ned is not None and dist(goal_ned[:2], own.pos_ned[:2]) < ARRIVED_M:
            reached = self.goals.reached()
            if reached is not None and not reached.is_last:
                self._vehicle.say(f"Companion: {reached.name} reached")

    def _speed_limit(self, own: Own) -> float:
        """Level speed [m/s] from which it can still brake before the last goal."""
        goal, goal_ned = self.goals.goal, self.goal_ned(own)
        if goal is None or goal_ned is None or not goal.is_last:
            return float("inf")
        room_m = max(dist(goal_ned[:2], own.pos_ned[:2]) - ARRIVED_M, 0.0)
        return sqrt(END_M_S**2 + 2.0 * BRAKE_M_S2 * room_m)


def _shown(goal_ned: Vector, own: Own) -> Vector:
    """The goal, or a place on the way to it that is no farther than in training."""
    away_m = dist(goal_ned[:2], own.pos_ned[:2])
    if away_m <= SHOWN_M:
        return goal_ned
    fraction = SHOWN_M / away_m
    north, east = (here + fraction * (there - here) for there, here in zip(goal_ned[:2], own.pos_ned[:2], strict=True))
    return north, east, goal_ned[2]


class NavigationObserver:
    """One vehicle's observations, by the kernel function of training.

    Args:
        stack: frames in an observation.
    """

    def __init__(self, stack: int) -> None:
        start_warp()
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

    def vector(self, own: Own, goal_ned: Vector, ranges_m: Floats, last_action: Floats, time_us: int) -> Floats:
        """The observation as of now: the last frames, oldest first.

        Args:
            own: telemetry.
            goal_ned: [m] where to go.
            ranges_m: of sectors and beams.
            last_action: in [-1, 1], shape (4,).
            time_us: the companion's own clock.
        """
        write_own_row(self._own[0], own, time_us)
        self._action[0], self._goal[0], self._ranges[0] = last_action, goal_ned, ranges_m
        self._observe.launch()
        self._frames[:-1] = self._frames[1:]
        self._frames[-1] = self._out[0]
        return self._frames.ravel()
