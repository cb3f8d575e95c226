"""To drive a rover into a pose: telemetry and ranges all round in, speed along the nose and yaw rate out.

It drives while it has a goal: the heading there is the
goto's or the waypoint's, or where none was given the way there. Where something stands in the goal it does not go.
"""

from math import atan2, cos, dist, hypot, inf, isfinite, pi, remainder, sin
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from autopilot.mavlink.client_end import AUTOPILOT_COMPONENT
from autopilot.ports import Estimate
from common.attitude import Vector, yaw_of
from common.range_sectors import GROUND_RING
from common.warp_start import start_warp
from policies.companion.decision_log import NO_GOAL
from policies.companion.guard.goal_guard import NoseGuard
from policies.companion.guard.settings import GuardSettings
from policies.companion.ranges import Ranges
from policies.companion.skills.goal_skill import GoalSkill
from policies.companion.skills.skill import Floats, Velocity
from policies.companion.telemetry import NEVER_US, Own
from policies.companion.vector_pilot import DrivingPilot
from policies.companion.vehicle_link import VehicleLink
from policies.companion.where_to.goals import Goal, Goals
from policies.tasks.drive.observe import (
    FRAME,
    SPEED_MAX_M_S,
    YAW_RATE_MAX_RAD_S,
    DriveCommand,
    command_rows,
    observe_rows,
)

ARRIVED_M, ALIGNED_RAD, STANDING_M_S = 0.25, 0.14, 0.25  # by the estimate: training's last lesson
STILL_M_S = 0.05
STUCK_FOR = 300  # decisions in a row without moving; guess
SHOWN_M = 25.0  # training's farthest goals are 30 m away: of one farther off a place on the way is shown
NEAR_M = 4.0  # guess: it stops in less
SCAN_HZ = 50.0
HULL_M = (0.3, 0.15)  # half of a rover's length and width, and no more: what is seen in there is in the way
SEEN_FOR = 30  # decisions in a row: what only comes by is gone by then; guess
REVERSES = "HG_RO_OFFB_BODY"  # parameter, not 0: Offboard may reverse and takes a yaw rate
ASK_US = 2_000_000
NO_REVERSE = f"Offboard does not reverse: set {REVERSES} to 1, or drive by sticks"
TAKEN, STUCK = "something stands there", "stuck"

Pose = tuple[float, float, float]
"""North, east [m] and heading [rad]."""


class Driving(GoalSkill):
    """One vehicle's skill to drive.

    Args:
        pilot: who decides.
        is_ordered_by_goto: a goto to the vehicle is an order to drive there.
        guard: who bounds it; None: as it ships.
    """

    ready, flying, drives = "ready to drive", "driving", True
    is_along_nose = True
    action_size = 2
    camera = None

    def __init__(
        self, pilot: DrivingPilot, *, is_ordered_by_goto: bool = False, guard: GuardSettings | None = None
    ) -> None:
        self._observer = DriveObserver(pilot.stack)
        settings = guard or GuardSettings()
        held = NoseGuard(settings) if settings.is_on else None
        super().__init__(pilot, self._observer, is_ordered_by_goto=is_ordered_by_goto, guard=held)
        self._reverses = False  # Offboard, as the vehicle has said
        self._asked_us = NEVER_US
        self._goal: Goal | None = None  # that the heading is of
        self._heading = 0.0  # there [rad]
        self._taken_count = 0  # decisions in a row with something in the goal
        self._still_count = 0  # decisions in a row without moving
        self._off = inf  # how far it is off the goal, since it has been there; inf: it has not

    def attach(self, vehicle: VehicleLink) -> None:
        self._vehicle = vehicle
        self.goals = Goals(
            vehicle, is_ordered_by_goto=self._is_ordered_by_goto, near_m=NEAR_M, refusal=self._refusal_of
        )
        self.ranges = Ranges(vehicle, GROUND_RING, SCAN_HZ)
        if not vehicle.is_by_sticks:
            vehicle.listen("PARAM_VALUE", self._parameter_reported)

    def receive(self, vehicle: VehicleLink, time_us: int, *, is_flying: bool) -> bool:
        if self._needs_reverse and vehicle.own.heartbeat_us != NEVER_US and time_us - self._asked_us > ASK_US:
            self._asked_us = time_us
            vehicle.ask("PARAM_REQUEST_READ", param_id=REVERSES, param_index=-1)
        return super().receive(vehicle, time_us, is_flying=is_flying)

    def blindness(self, own: Own, time_us: int, *, is_flying: bool) -> str:
        blindness = super().blindness(own, time_us, is_flying=is_flying)
        return blindness or (NO_REVERSE if self._needs_reverse and not self._reverses else "")

    def loss(self, own: Own, *, is_flying: bool) -> str:
        trouble = super().loss(own, is_flying=is_flying)
        if trouble or self._still_count >= STUCK_FOR:
            return trouble or STUCK
        return TAKEN if self._taken_count >= SEEN_FOR else ""

    def begin(self, own: Own) -> None:
        super().begin(own)
        self._taken_count = self._still_count = 0
        self._off = inf

    def decide(self, own: Own, last_action: Floats, time_us: int, *, is_flying: bool) -> Floats | None:
        if is_flying:
            self._note_arrival(own)
        pose = self.goal_pose(own)
        if pose is None or not self._is_due(time_us):
            return None
        is_still = is_flying and hypot(*own.vel_ned) < STILL_M_S
        self._still_count = self._still_count + 1 if is_still else 0
        ranges_m = self.ranges.from_here()
        self._taken_count = self._taken_count + 1 if is_taken(pose, own, ranges_m) else 0
        vector = self._observer.vector(own, _shown(pose, own), ranges_m, last_action)
        return self._act(vector, is_flying=is_flying)

    def setpoint(self, action: Floats, own: Own) -> Velocity:
        """What an action asks for, along the nose, as the guard lets it."""
        speed, yaw_rate = self._observer.command(action)
        return self._guarded(((speed, 0.0, 0.0), yaw_rate), own)

    def action_of(self, flown: Velocity, own: Own, action: Floats) -> Floats:  # noqa: ARG002
        return self._observer.action_of(flown[0][0], flown[1])

    def recorded_goal(self, own: Own) -> Vector:
        return self.goal_pose(own) or NO_GOAL

    def goal_pose(self, own: Own) -> Pose | None:
        """Where it drives; None: nowhere."""
        goal = self.goals.goal
        if goal is None:
            return None
        if goal is not self._goal:
            self._goal, self._heading = goal, _heading_of(goal, own)
            self._taken_count = 0
        return goal.pos_ned[0], goal.pos_ned[1], self._heading

    def figures(self, own: Own, time_us: int) -> str:
        pose = self.goal_pose(own)
        return self._figures(None if pose is None else dist(pose[:2], own.pos_ned[:2]), time_us)

    @property
    def _needs_reverse(self) -> bool:
        """Whether it is driven in PX4's Offboard, whose velocities are courses where nothing else is set."""
        return not (self._vehicle.is_by_sticks or self._vehicle.is_ardupilot)

    def _parameter_reported(self, sysid: int, compid: int, fields: Any, _: int) -> None:
        is_vehicle = (sysid, compid) == (self._vehicle.system_id, AUTOPILOT_COMPONENT)
        if is_vehicle and fields.param_id == REVERSES:
            self._reverses = fields.param_value != 0

    def _refusal_of(self, goal: Goal) -> str:
        """Why a goto cannot be driven to."""
        own = self._vehicle.own
        pose = (goal.pos_ned[0], goal.pos_ned[1], _heading_of(goal, own))
        return TAKEN if is_taken(pose, own, self.ranges.from_here()) else ""

    def _note_arrival(self, own: Own) -> None:
        """Goes on to the next goal if it stands in this one, as near to its middle as it comes."""
        pose = self.goal_pose(own)
        if pose is None:
            return
        off, was_off, speed = how_far_off(pose, own), self._off, hypot(*own.vel_ned)
        is_in = off < 1.0 and speed < STANDING_M_S
        if not isfinite(was_off) and not is_in:
            return
        self._off = off
        if is_in and off < was_off and speed > STILL_M_S:
            return
        self._off = inf
        if self._go_on():
            self._forget()


def how_far_off(pose: Pose, own: Own) -> float:
    """How far off a pose a vehicle is by its estimate, below 1 if it is there."""
    turn = remainder(pose[2] - yaw_of(own.q_ned_from_frd), 2.0 * pi)
    return max(dist(pose[:2], own.pos_ned[:2]) / ARRIVED_M, abs(turn) / ALIGNED_RAD)


def is_taken(pose: Pose, own: Own, ranges_m: Floats) -> bool:
    """Whether a range ends where the hull would be in a pose; what is not seen is free."""
    yaw = yaw_of(own.q_ned_from_frd)
    bearing = yaw + np.radians(GROUND_RING.sector_deg) * np.arange(GROUND_RING.sectors)
    north = own.pos_ned[0] + ranges_m * np.cos(bearing) - pose[0]
    east = own.pos_ned[1] + ranges_m * np.sin(bearing) - pose[1]
    ahead = north * cos(pose[2]) + east * sin(pose[2])
    right = east * cos(pose[2]) - north * sin(pose[2])
    is_inside = (np.abs(ahead) < HULL_M[0]) & (np.abs(right) < HULL_M[1])
    return bool((is_inside & (ranges_m < GROUND_RING.range_m)).any())


def _heading_of(goal: Goal, own: Own) -> float:
    """The heading at a goal [rad]: as it was asked for, or that of the way there."""
    if isfinite(goal.yaw):
        return goal.yaw
    return atan2(goal.pos_ned[1] - own.pos_ned[1], goal.pos_ned[0] - own.pos_ned[0])


def _shown(pose: Pose, own: Own) -> Pose:
    """The goal, or a pose on the way to it that is no farther than in training."""
    north, east = pose[0] - own.pos_ned[0], pose[1] - own.pos_ned[1]
    away_m = hypot(north, east)
    if away_m <= SHOWN_M:
        return pose
    fraction = SHOWN_M / away_m
    return own.pos_ned[0] + fraction * north, own.pos_ned[1] + fraction * east, atan2(east, north)


class DriveObserver:
    """One vehicle's observations and commands, by the kernel functions of training.

    Args:
        stack: frames in an observation.
    """

    def __init__(self, stack: int) -> None:
        start_warp()
        estimate, action, goal = wp.zeros(1, dtype=Estimate), wp.zeros(1, dtype=wp.vec2), wp.zeros(1, dtype=wp.vec3)
        ranges, out = wp.zeros((1, GROUND_RING.sectors), dtype=float), wp.zeros((1, len(FRAME)), dtype=float)
        command = wp.zeros(1, dtype=DriveCommand)
        self._estimate: NDArray[Any] = estimate.numpy()  # live views, as of the others
        self._action: Floats = action.numpy()
        self._goal: Floats = goal.numpy()
        self._ranges: Floats = ranges.numpy()
        self._out: Floats = out.numpy()
        self._command: NDArray[Any] = command.numpy()
        self._frames: Floats = np.zeros((stack, len(FRAME)), dtype=np.float32)
        self._observe = wp.launch(observe_rows, 1, [estimate, action, goal, ranges, out], record_cmd=True)
        self._ask = wp.launch(command_rows, 1, [action, command], record_cmd=True)

    def reset(self) -> None:
        """As at an episode's start."""
        self._frames[:] = 0.0

    def vector(self, own: Own, goal: Pose, ranges_m: Floats, last_action: Floats) -> Floats:
        """The observation as of now: the last frames, oldest first.

        Args:
            own: telemetry.
            goal: where to go.
            ranges_m: of the ring's sectors.
            last_action: in [-1, 1], shape (2,).
        """
        row = self._estimate[0]
        row["pos_ned"], row["vel_ned"] = own.pos_ned, own.vel_ned
        row["q_ned_from_frd"], row["omega_frd"] = own.q_ned_from_frd, own.omega_frd
        self._action[0], self._goal[0], self._ranges[0] = last_action, goal, ranges_m
        self._observe.launch()
        self._frames[:-1] = self._frames[1:]
        self._frames[-1] = self._out[0]
        return self._frames.ravel()

    def command(self, action: Floats) -> tuple[float, float]:
        """Speed along the nose [m/s] and yaw rate [rad/s] of an action in [-1, 1], shape (2,)."""
        self._action[0] = action
        self._ask.launch()
        row = self._command[0]
        return float(row["speed"]), float(row["yaw_rate"])

    @staticmethod
    def action_of(speed: float, yaw_rate: float) -> Floats:
        """The other way round."""
        return np.array([speed / float(SPEED_MAX_M_S), yaw_rate / float(YAW_RATE_MAX_RAD_S)], np.float32)
