"""The guard under policies that go to goals: laws of what it lets be flown and driven, whatever a policy wants."""

from collections import deque
from math import cos, radians

import numpy as np
import pytest

from autopilot.mavlink.transport.links import LinkRole, memory_pair
from common.attitude import quat_of
from common.range_sectors import GROUND_RING, SCANNER, RangeLayout
from policies.companion.guard.goal_guard import GoalGuard, GoalStance, NoseGuard
from policies.companion.guard.interventions import OLD_TELEMETRY, TILTED
from policies.companion.guard.limits import way_along_m
from policies.companion.guard.settings import GuardSettings
from policies.companion.ranges import Ranges
from policies.companion.vehicle_link import VehicleLink

S = GuardSettings()
STEP_S, DECISION_STEPS = 0.02, 5
FULL_SPEED = ((7.0, 0.0, 0.0), 0.0)


class Approach:
    """A vehicle that heads north at a wall, its scans late by so much; it brakes no better than it is taken to."""

    def __init__(self, guard: GoalGuard, layout: RangeLayout, wall_m: float, late_s: float) -> None:
        self.guard, self.wall_m, self.late_s = guard, wall_m, late_s
        self.ranges = Ranges(VehicleLink(memory_pair(LinkRole.ONBOARD)[0]), layout)
        self.own = self.ranges._own
        self.own.boot_us, self.own.pos_ned, self.own.vel_ned = 10_000_000, (0.0, 0.0, -2.0), (0.0, 0.0, 0.0)
        self.own.range_m = 2.0
        self.own.attitude_us = self.own.range_us = 0
        self.is_scanning, self.is_seeing = True, True
        self.place = self.speed = self.flown = 0.0
        self._under_way: deque[tuple[int, np.ndarray]] = deque()
        self._commands = deque([0.0] * round(guard.settings.reaction_s / STEP_S))

    def fly(self, seconds: float, wanted=FULL_SPEED) -> None:
        for k in range(round(seconds / STEP_S)):
            self.own.boot_us += round(STEP_S * 1e6)
            self._commands.append(self.flown)
            most = self.guard.settings.brake * STEP_S
            self.speed += float(np.clip(self._commands.popleft() - self.speed, -most, most))
            self.place += STEP_S * self.speed
            self.own.pos_ned, self.own.vel_ned = (self.place, 0.0, -2.0), (self.speed, 0.0, 0.0)
            if k % DECISION_STEPS == 0 and self.is_scanning:
                self._under_way.append((self.own.boot_us, self._scan()))
            while self._under_way and self.own.boot_us >= self._under_way[0][0] + round(self.late_s * 1e6):
                self.ranges.stamp_us, self.ranges.ranges_m = self._under_way.popleft()
                self.ranges.taken_us = self.ranges.stamp_us
            self.ranges.follow()
            self.guard.sense(self.own, self.ranges)
            if k % DECISION_STEPS == 0:
                (self.flown, _, _), _ = self.guard.filtered(wanted, self.own)

    def _scan(self) -> np.ndarray:
        layout = self.ranges.layout
        found = np.full(layout.sectors + len(layout.beam_elevations_deg), layout.range_m, np.float32)
        if not self.is_seeing:
            return found
        for k in range(layout.sectors):
            along = cos(radians(layout.first_edge_deg + (k + 0.5) * layout.sector_deg))
            if along > 0.1:
                found[k] = min((self.wall_m - self.place) / along, layout.range_m)
        found[layout.sectors : layout.sectors + 1] = 4.0  # the ground
        return found


@pytest.mark.parametrize("late_s", [0.0, 0.1, 0.2, 0.3])
def test_full_speed_into_a_wall_stops_before_it_however_late_the_scans(late_s: float) -> None:
    approach = Approach(GoalGuard(S, drives=False), SCANNER, 25.0, late_s)
    approach.fly(20.0)
    assert 22.0 < approach.place < 25.0 - 0.4
    assert approach.speed < 0.05
    assert approach.guard.interventions["near something"] > 10


@pytest.mark.parametrize("late_s", [0.0, 0.2])
def test_a_rover_stops_before_a_wall_and_may_back_off(late_s: float) -> None:
    approach = Approach(NoseGuard(S), GROUND_RING, 6.0, late_s)
    approach.fly(12.0, ((2.0, 0.0, 0.0), 0.0))
    assert 5.2 < approach.place + S.hull_half_length_m < 6.0
    approach.fly(2.0, ((-1.0, 0.0, 0.0), 0.0))
    assert approach.speed < -0.8


def test_where_nothing_stands_it_lets_fly_as_the_policy_asks() -> None:
    approach = Approach(GoalGuard(S, drives=False), SCANNER, 1e3, 0.0)
    approach.fly(4.0, ((5.5, 0.0, 0.0), 0.3))
    assert approach.flown == 5.5
    assert approach.guard.stance is GoalStance.FREE
    assert not approach.guard.interventions


def test_scans_that_stop_make_it_slower_and_then_stop_it_and_it_goes_on_when_they_come_again() -> None:
    approach = Approach(GoalGuard(S, drives=False), SCANNER, 1e3, 0.0)
    approach.fly(3.0)
    approach.is_scanning = False
    approach.fly(0.6)
    assert 0.0 < approach.flown < 6.0
    assert approach.guard.stance is GoalStance.SLOW
    approach.fly(0.3)
    assert (approach.flown, approach.guard.stance) == (0.0, GoalStance.STOP)
    approach.is_scanning = True
    approach.fly(0.3)
    assert approach.flown > 5.0


def test_scans_without_any_return_make_it_slower_and_then_stop_it() -> None:
    approach = Approach(GoalGuard(S, drives=False), SCANNER, 1e3, 0.0)
    approach.fly(3.0)
    approach.is_seeing = False
    approach.fly(1.0)
    assert (approach.flown, approach.guard.stance) == (S.no_depth_speed, GoalStance.DIM)
    approach.fly(2.0)
    assert (approach.flown, approach.guard.stance) == (0.0, GoalStance.DARK)


def test_it_goes_slowly_to_where_it_has_not_looked() -> None:
    approach = Approach(GoalGuard(S, drives=False), SCANNER, 1e3, 0.0)
    approach.fly(0.5, ((0.0, 0.0, 0.0), 0.0))
    (north, _, _), _ = approach.guard.filtered(((-5.0, 0.0, 0.0), 0.0), approach.own)
    assert -1.0 <= north < 0.0


@pytest.mark.parametrize(("height_m", "down", "flown"), [(0.5, 1.0, -0.5), (5.0, -2.0, 0.3), (2.0, 0.5, 0.5)])
def test_it_keeps_between_its_heights(height_m: float, down: float, flown: float) -> None:
    approach = Approach(GoalGuard(S, drives=False), SCANNER, 1e3, 0.0)
    approach.fly(0.5)
    approach.own.range_m = height_m
    assert approach.guard.filtered(((0.0, 0.0, down), 0.0), approach.own)[0][2] == flown


def test_it_does_not_climb_into_a_crown_that_its_beams_see() -> None:
    approach = Approach(GoalGuard(S, drives=False), SCANNER, 1e3, 0.0)
    approach.fly(0.5)
    approach.ranges.ranges_m = approach.ranges.ranges_m.copy()
    approach.ranges.ranges_m[-1] = 1.2  # 30 degrees up: 0.6 m above
    approach.ranges.stamp_us += 1
    approach.guard.sense(approach.own, approach.ranges)
    assert approach.guard.filtered(((0.0, 0.0, -1.0), 0.0), approach.own)[0][2] == 0.0


def test_a_sector_that_tells_nothing_is_not_clear() -> None:
    approach = Approach(GoalGuard(S, drives=False), SCANNER, 1e3, 0.0)
    approach.ranges.is_known[6:42] = False  # all that is ahead
    approach.fly(2.0)
    assert approach.flown <= S.unseen_speed + 1e-9


def test_a_sector_that_misses_once_opens_nothing_and_one_that_tells_so_twice_does() -> None:
    """A wall 4 m ahead that all sectors miss: what lies behind it is clear with the second scan."""
    for scans, low, high in ((1, 0.0, 4.0), (2, 5.5, 5.5)):
        approach = Approach(GoalGuard(S, drives=False), SCANNER, 4.0, 0.0)
        approach.fly(0.5, ((0.0, 0.0, 0.0), 0.0))
        for _ in range(scans):
            approach.ranges.stamp_us += 1
            approach.ranges.ranges_m = np.full_like(approach.ranges.ranges_m, SCANNER.range_m)
            approach.guard.sense(approach.own, approach.ranges)
        flown = approach.guard.filtered(((5.5, 0.0, 0.0), 0.0), approach.own)[0][0]
        assert low <= flown <= high


def test_a_vehicle_that_has_restarted_begins_with_an_empty_map() -> None:
    approach = Approach(GoalGuard(S, drives=False), SCANNER, 8.0, 0.0)
    approach.fly(1.0, ((0.0, 0.0, 0.0), 0.0))
    approach.own.boot_us = 1_000_000
    approach.ranges.follow()
    approach.guard.sense(approach.own, approach.ranges)
    assert approach.guard.filtered(FULL_SPEED, approach.own)[0][0] <= S.unseen_speed + 1e-9


class Posts:
    """A vehicle that flies through a field of posts in the plane, as its guard lets it."""

    radius_m = 0.15

    def __init__(self, seed: int, late_s: float) -> None:
        rng = np.random.default_rng(seed)
        self.posts = np.stack([rng.uniform(4.0, 60.0, 40), rng.uniform(-7.0, 7.0, 40)], -1)
        self.guard = GoalGuard(S, drives=False)
        self.ranges = Ranges(VehicleLink(memory_pair(LinkRole.ONBOARD)[0]), SCANNER)
        self.own = self.ranges._own
        self.own.boot_us, self.own.range_m = 10_000_000, 2.0
        self.own.attitude_us = self.own.range_us = 0
        self.place, self.velocity = np.zeros(2), np.zeros(2)
        self._late_us = round(late_s * 1e6)

    def nearest_m(self, seconds: float) -> float:
        """Flies north at 7 m/s, whatever stands there; how near it came to a post's surface [m]."""
        commands = deque([np.zeros(2)] * round(self.guard.settings.reaction_s / STEP_S))
        under_way: deque[tuple[int, np.ndarray]] = deque()
        flown, nearest = np.zeros(2), np.inf
        for k in range(round(seconds / STEP_S)):
            self.own.boot_us += round(STEP_S * 1e6)
            commands.append(flown)
            change = commands.popleft() - self.velocity
            self.velocity = self.velocity + change * min(1.0, S.brake * STEP_S / max(float(np.hypot(*change)), 1e-9))
            self.place = self.place + STEP_S * self.velocity
            nearest = min(nearest, float(np.hypot(*(self.posts - self.place).T).min()) - self.radius_m)
            self.own.pos_ned, self.own.vel_ned = (*self.place, -2.0), (*self.velocity, 0.0)
            if k % DECISION_STEPS == 0:
                under_way.append((self.own.boot_us, self._scan()))
            while under_way and self.own.boot_us >= under_way[0][0] + self._late_us:
                self.ranges.stamp_us, self.ranges.ranges_m = under_way.popleft()
                self.ranges.taken_us = self.ranges.stamp_us
            self.ranges.follow()
            self.guard.sense(self.own, self.ranges)
            if k % DECISION_STEPS == 0:
                flown = np.array(self.guard.filtered(FULL_SPEED, self.own)[0][:2])
        return nearest

    def _scan(self) -> np.ndarray:
        found = np.full(SCANNER.sectors + 4, SCANNER.range_m, np.float32)
        found[SCANNER.sectors] = 4.0  # the ground
        off = self.posts - self.place
        far = np.hypot(*off.T)
        for bearing, far_m in zip(np.degrees(np.arctan2(off[:, 1], off[:, 0])), far, strict=True):
            half = np.degrees(np.arcsin(min(self.radius_m / far_m, 1.0)))
            first, last = ((bearing + side * half - SCANNER.first_edge_deg) // SCANNER.sector_deg for side in (-1, 1))
            for sector in range(max(int(first), 0), min(int(last), SCANNER.sectors - 1) + 1):
                found[sector] = min(found[sector], far_m - self.radius_m)
        return found


@pytest.mark.parametrize("late_s", [0.0, 0.2])
@pytest.mark.parametrize("seed", range(4))
def test_who_flies_on_blindly_is_led_round_posts_or_stopped_before_them(seed: int, late_s: float) -> None:
    posts = Posts(seed, late_s)
    assert posts.nearest_m(12.0) > 0.2
    assert posts.place[0] > 15.0  # it was led on


def test_an_arc_past_something_is_free_and_one_into_it_is_not() -> None:
    """A post two metres ahead and half a metre to the right."""
    post = np.array([[2.0, 0.5]])
    assert way_along_m(post, 0.0, False, S) == 4.0
    assert 1.0 < way_along_m(post, 0.3, False, S) < 2.0
    assert way_along_m(post, -0.5, False, S) == 4.0
    assert way_along_m(post, 0.3, True, S) == 4.0


def test_who_stands_too_near_already_may_leave_and_come_no_nearer() -> None:
    wall = np.stack([np.full(41, S.hull_half_length_m + 0.02), np.linspace(-1.0, 1.0, 41)], -1)
    assert way_along_m(wall, 0.0, False, S) < 0.05
    assert way_along_m(wall, 0.0, True, S) == 4.0


@pytest.mark.parametrize(("drives", "kept"), [(False, 4.0), (True, 0.0)])
def test_who_leans_too_far_is_asked_to_go_on_as_it_does_or_to_stand_if_it_drives(drives: bool, kept: float) -> None:
    approach = Approach(GoalGuard(S, drives=drives), SCANNER, 100.0, 0.0)
    approach.fly(3.0, ((4.0, 0.0, 0.0), 0.0))
    assert TILTED not in approach.guard.interventions
    approach.own.q_ned_from_frd = quat_of(0.0, radians(-S.tilt_max_deg - 5.0))
    (level, _, _), _ = approach.guard.filtered(FULL_SPEED, approach.own)
    assert level == pytest.approx(kept, abs=0.1)
    assert approach.guard.interventions[TILTED] == 1


def test_who_leans_too_far_with_old_ranges_still_stands() -> None:
    approach = Approach(GoalGuard(S, drives=False), SCANNER, 100.0, 0.0)
    approach.fly(3.0, ((4.0, 0.0, 0.0), 0.0))
    approach.own.boot_us += round(S.scan_stop_s * 1e6) + 100_000
    approach.own.q_ned_from_frd = quat_of(0.0, radians(-60.0))
    (level, _, _), _ = approach.guard.filtered(FULL_SPEED, approach.own)
    assert level == pytest.approx(0.0, abs=1e-6)
    assert approach.guard.stance is GoalStance.STOP


def test_telemetry_that_stalls_slows_it_down_and_then_stops_it() -> None:
    approach = Approach(GoalGuard(S, drives=False), SCANNER, 100.0, 0.0)
    approach.fly(3.0, ((4.0, 0.0, 0.0), 0.0))
    speeds = []
    for approach.own.late_s in (0.2, 0.3, 0.4):
        speeds.append(approach.guard.filtered(((4.0, 0.0, 0.0), 0.0), approach.own)[0][0])
    assert speeds == pytest.approx([4.0, 2.0, 0.0], abs=1e-6)
    assert approach.guard.interventions[OLD_TELEMETRY] == 2


def test_old_scans_slow_a_rover_down_along_the_same_arc_and_it_does_not_turn_blind() -> None:
    approach = Approach(NoseGuard(S), GROUND_RING, 1e3, 0.0)
    approach.fly(1.0, ((1.0, 0.0, 0.0), 0.5))
    approach.is_scanning = False
    ratios = set()
    for _ in range(20):
        approach.own.boot_us += 50_000
        (speed, _, _), yaw_rate = approach.guard.filtered(((1.0, 0.0, 0.0), 0.5), approach.own)
        if speed > 0.0:
            ratios.add(round(yaw_rate / speed, 6))
    assert ratios == {0.5}
    assert (approach.guard.stance, speed, yaw_rate) == (GoalStance.STOP, 0.0, 0.0)
    assert approach.guard.filtered(((0.0, 0.0, 0.0), 0.5), approach.own)[1] == 0.0


def test_a_rover_that_creeps_stops_before_a_wall_as_well() -> None:
    approach = Approach(NoseGuard(S), GROUND_RING, 1.0, 0.0)
    approach.fly(40.0, ((0.049, 0.0, 0.0), 0.0))
    assert approach.place + S.hull_half_length_m < 1.0
