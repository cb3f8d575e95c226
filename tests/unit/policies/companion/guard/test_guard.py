"""The guard over time: what it remembers, and what it must not after a restart."""

import numpy as np
import pytest

from common.attitude import quat_of
from common.image_stream import ImageFrame
from policies.companion.guard.guard import Guard, Stance
from policies.companion.guard.interventions import HEIGHT, NO_GNSS, OLD_TELEMETRY, TILTED
from policies.companion.guard.settings import GuardSettings, guard_settings
from policies.companion.senses.seen_owner import PersonNow
from policies.companion.senses.senses import Senses
from policies.companion.telemetry import RANGE_OLD_US, Own, Owner
from policies.person_detector.detector import Detection
from policies.tasks.follow_me.observe import DEPTH_HALF_M, HFOV_DEG, IMAGE_SIZE, TILT_DEG


class Sees:
    """A detector that sees somebody, three metres ahead at first, or nobody."""

    is_there, ahead_m, aside_m, below_m = True, 3.0, 0.0, 0.6

    def find(self, pixels: object, down_frd: object) -> list[Detection]:  # noqa: ARG002
        return [Detection(0.99, (self.ahead_m, self.aside_m, self.below_m), (32.0, 32.0))] if self.is_there else []


def flown(guard: Guard, own: Own, seconds: float) -> list[float]:
    """Speeds ahead that come of 3 m/s wanted, ten times a second; the vehicle does not move."""
    speeds = []
    for _ in range(round(seconds * 10)):
        own.boot_us += 100_000
        pixels = np.full((IMAGE_SIZE, IMAGE_SIZE, 4), 200, np.uint8)
        image = ImageFrame(own.boot_us, 0, pixels, HFOV_DEG, TILT_DEG, float(DEPTH_HALF_M))
        guard.senses.sense(own, Owner(), image)
        speeds.append(guard.filtered(((3.0, 0.0, 0.0), 0.0), own)[0][0])
    return speeds


@pytest.fixture
def scene() -> tuple[Guard, Own, Sees]:
    sees = Sees()
    own = Own(boot_us=0, pos_ned=(0.0, 0.0, -1.6), vel_ned=(0.0, 0.0, 0.0), range_m=1.6)
    return Guard(GuardSettings(), Senses(detector=sees)), own, sees  # type: ignore[arg-type]


def test_it_lets_fly_towards_somebody_far_enough_and_stops_when_they_are_gone(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, sees = scene
    assert min(flown(guard, own, 1.0)[5:]) > 1.0
    sees.is_there = False
    speeds = flown(guard, own, 6.0)
    assert all(abs(speed) < 1e-6 for speed in speeds[21:])
    assert guard.stance is Stance.SEARCH


def test_a_larger_distance_to_the_owner_is_kept(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, sees = scene
    near = flown(guard, own, 1.0)[-1]
    far = Guard(guard_settings({"owner_m": 2.5}), Senses(detector=sees))  # type: ignore[arg-type]
    assert flown(far, own, 1.0)[-1] < near - 0.5


def test_late_setpoints_make_it_stop_sooner_and_as_usual_it_is_as_it_was(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, _ = scene
    own.vel_ned = (2.0, 0.0, 0.0)
    usual = flown(guard, own, 20.0)[-1]  # until the filter of the owner has settled
    guard.reckon_with(0.08)
    assert flown(guard, own, 1.0)[-1] < usual - 0.15
    guard.reckon_with(0.0)
    assert guard.settings == GuardSettings()
    assert flown(guard, own, 1.0)[-1] == usual


def test_what_was_seen_before_a_restart_is_not_taken_for_a_sight_of_now(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, sees = scene
    own.boot_us = 100_000_000
    flown(guard, own, 1.0)
    own.boot_us, sees.is_there = 0, False  # the vehicle's clock begins anew
    assert all(abs(speed) < 1e-6 for speed in flown(guard, own, 1.0))
    assert guard.senses.silence_s(own) == float("inf")


def test_images_that_stop_stop_the_vehicle(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, _ = scene
    flown(guard, own, 1.0)
    for _ in range(10):
        own.boot_us += 100_000
        guard.senses.sense(own, Owner(), None)
        velocity, _ = guard.filtered(((3.0, 0.0, 0.0), 0.0), own)
    assert velocity[:2] == (0.0, 0.0)
    assert guard.stance is Stance.BLIND


def test_pictures_that_get_old_are_said_to_be_what_makes_it_slower(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, sees = scene
    sees.ahead_m = 4.0
    full = flown(guard, own, 1.0)[-1]
    own.boot_us += 650_000
    guard.senses.sense(own, Owner(), None)
    assert 0.0 < guard.filtered(((3.0, 0.0, 0.0), 0.0), own)[0][0] < full
    assert guard.stance is Stance.LATE
    assert "slower: old pictures" in guard.interventions.latest


def test_telemetry_that_stalls_slows_it_down_before_control_goes_back(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, _ = scene
    flown(guard, own, 1.0)
    full, slower, none = guard.filtered(((3.0, 0.0, 0.0), 0.0), own)[0][0], [], []
    for own.late_s, speeds in ((0.2, slower), (0.3, slower), (0.4, none), (0.5, none)):
        speeds.append(guard.filtered(((3.0, 0.0, -0.5), 0.0), own)[0])
    assert [speed for speed, *_ in slower] == [full, pytest.approx(1.5)]
    assert none == [(0.0, 0.0, 0.0)] * 2
    assert guard.interventions[OLD_TELEMETRY] == 3


def test_who_leans_too_far_is_asked_to_go_on_as_it_does(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, _ = scene
    flown(guard, own, 1.0)
    own.vel_ned = (0.4, 0.0, 0.0)
    own.q_ned_from_frd = quat_of(0.0, np.radians(-guard.settings.tilt_max_deg - 5.0))
    assert guard.filtered(((3.0, 0.0, 0.0), 0.0), own)[0][0] == pytest.approx(0.4, abs=0.05)
    assert TILTED in guard.interventions.latest
    own.q_ned_from_frd = quat_of(0.0, np.radians(-guard.settings.tilt_max_deg + 5.0))
    assert guard.filtered(((3.0, 0.0, 0.0), 0.0), own)[0][0] > 0.8
    assert TILTED not in guard.interventions.latest


def test_who_leans_too_far_without_pictures_still_stands(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, _ = scene
    flown(guard, own, 1.0)
    own.vel_ned, own.q_ned_from_frd = (3.0, 0.0, 0.0), quat_of(0.0, np.radians(-60.0))
    own.boot_us += 1_000_000
    guard.senses.sense(own, Owner(), None)
    assert guard.filtered(((3.0, 0.0, 0.0), 0.0), own)[0][:2] == (0.0, 0.0)
    assert guard.stance is Stance.BLIND


@pytest.mark.parametrize(("height_m", "down"), [(3.4, -2.0), (1.1, 2.0), (0.8, 0.0)])
def test_a_height_that_it_does_not_let_be_flown_is_a_reason(
    scene: tuple[Guard, Own, Sees], height_m: float, down: float
) -> None:
    guard, own, _ = scene
    flown(guard, own, 1.0)
    guard.filtered(((0.0, 0.0, 0.0), 0.0), own)
    assert HEIGHT not in guard.interventions.latest
    own.range_m = height_m
    kept = guard.filtered(((0.0, 0.0, down), 0.0), own)[0][2]
    assert abs(kept - down) > 0.29
    assert HEIGHT in guard.interventions.latest


def test_who_leans_is_as_high_as_the_ground_is_below_and_not_as_far_as_the_slant_range(
    scene: tuple[Guard, Own, Sees],
) -> None:
    guard, own, _ = scene
    flown(guard, own, 1.0)
    own.q_ned_from_frd, own.range_m = quat_of(0.0, np.radians(-40.0)), 1.2
    assert own.height_m < guard.settings.height_min_m
    assert guard.filtered(((0.0, 0.0, 0.5), 0.0), own)[0][2] < -0.3


def test_an_owner_who_was_never_seen_is_looked_for_before_it_is_the_end(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, sees = scene
    own.boot_us, sees.is_there = 500_000_000, False
    guard.begin(own)
    flown(guard, own, 5.0)
    assert guard.stance is Stance.SEARCH
    assert not guard.is_lost(own)
    flown(guard, own, GuardSettings().lost_s)
    assert guard.is_lost(own)


def test_an_owner_who_runs_is_no_obstacle_in_late_images(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, sees = scene
    late_us, speed = 300_000, 4.0
    for _ in range(8):
        own.boot_us += 100_000
        taken_us = max(own.boot_us - late_us, 100_000)
        far_m = 2.0 + speed * taken_us * 1e-6
        sees.find = lambda *_, far_m=far_m: [Detection(0.99, (far_m, 0.0, 0.0), (32.0, 32.0))]  # type: ignore[method-assign]
        pixels = np.full((IMAGE_SIZE, IMAGE_SIZE, 4), 212, np.uint8)  # all else is 20 m away
        pixels[:, 30:34, 3] = int(255.0 * far_m / (far_m + float(DEPTH_HALF_M)))  # their body
        guard.senses.sense(own, Owner(), ImageFrame(taken_us, 0, pixels, HFOV_DEG, TILT_DEG, float(DEPTH_HALF_M)))
    north = np.stack([np.arange(0.5, 9.0, 0.25), np.zeros(34)], -1)  # where they run
    room_m, _ = guard.senses.map.clearance(own.pos_ned, own.boot_us).at(north)
    assert (room_m > 0.5).all()


def test_what_things_take_off_a_velocity_the_next_may_go_on_from_but_not_what_people_take(
    scene: tuple[Guard, Own, Sees], monkeypatch: pytest.MonkeyPatch
) -> None:
    guard, own, _ = scene
    monkeypatch.setattr(Guard, "_past_people", lambda *_: (np.array([2.0, 0.0]), []))
    monkeypatch.setattr(Guard, "_past_solids", lambda *_: np.array([0.0, 1.0]))
    flown(guard, own, 1.0)
    from_flown = guard.goes_on_from - (0.0, 1.0)
    assert float(np.hypot(*from_flown)) == pytest.approx(1.5)
    assert from_flown == pytest.approx(1.5 * np.array([2.0, -1.0]) / np.hypot(2.0, 1.0))


@pytest.mark.parametrize("wanted_down", [-2.0, 2.0])
def test_a_policy_that_wants_up_or_down_stays_between_the_heights(
    scene: tuple[Guard, Own, Sees], wanted_down: float
) -> None:
    guard, own, _ = scene
    flown(guard, own, 1.0)
    height_m, climb, heights_m = 2.0, 0.0, []
    for _ in range(150):
        (_, _, down), _ = guard.filtered(((0.0, 0.0, wanted_down), 0.0), own)
        climb += (-down - climb) * 0.1 / 0.35  # as slow as the vehicle answers
        height_m += 0.1 * climb
        own.range_m = height_m
        heights_m.append(height_m)
    s = guard.settings
    assert s.height_min_m - 0.15 < min(heights_m)
    assert max(heights_m) < s.height_max_m + 0.15


def searched(guard: Guard, own: Own, phone_m: float, seconds: float) -> list[tuple[float, float, float]]:
    """Speeds ahead and aside, and yaw rates, of a search while the phone says that its owner is so far ahead."""
    out, phone = [], Owner(has_velocity=True)
    for k in range(round(seconds * 10)):
        own.boot_us += 100_000
        if k % 5 == 0:
            phone.pos_ned = (own.pos_ned[0] + phone_m, 0.0, -1.0)
            phone.count += 1
        pixels = np.full((IMAGE_SIZE, IMAGE_SIZE, 4), 200, np.uint8)
        image = ImageFrame(own.boot_us, 0, pixels, HFOV_DEG, TILT_DEG, float(DEPTH_HALF_M))
        guard.senses.sense(own, phone, image)
        velocity, yaw_rate = guard.filtered(((0.0, 0.0, 0.0), 0.0), own)
        out.append((velocity[0], velocity[1], yaw_rate))
    return out


def test_a_search_looks_then_goes_round_then_turns_wherever_it_came_from(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, sees = scene
    sees.is_there = False
    guard.begin(own)
    far = searched(guard, own, 20.0, 17.0)
    assert max(abs(east) for _, east, _ in far) < 0.1
    near = searched(guard, own, 5.0, 24.0)
    rounds = [k for k, (_, east, _) in enumerate(near) if abs(east) > 0.3]
    turns = [k for k, (*_, yaw_rate) in enumerate(near) if yaw_rate > 0.5]
    assert 35 <= min(rounds) < max(rounds) < min(turns)
    assert len(rounds) > 50
    assert len(turns) > 50


@pytest.mark.parametrize(("ahead_m", "goes_m"), [(3.0, 1.0), (6.0, 4.0)])
def test_an_owner_whom_nobody_hears_is_searched_short_of_where_they_may_be(
    scene: tuple[Guard, Own, Sees], ahead_m: float, goes_m: float
) -> None:
    guard, own, sees = scene
    sees.ahead_m = ahead_m
    flown(guard, own, 1.0)
    sees.is_there = False
    s = guard.settings
    own.pos_ned, own.range_m = (0.0, 0.0, -s.search_height_m), s.search_height_m
    assert max(np.abs(flown(guard, own, s.search_s)[25:])) < 1e-6  # it stands before it searches
    speeds = []
    for _ in range(80):
        speeds += flown(guard, own, 0.1)
        own.vel_ned = (speeds[-1], 0.0, 0.0)
        own.pos_ned = (own.pos_ned[0] + 0.1 * speeds[-1], 0.0, own.pos_ned[2])
        assert guard.filtered(((3.0, 0.0, 0.0), 0.0), own)[1] == s.search_yaw_rate
    assert max(speeds) <= s.search_ahead_speed
    assert own.pos_ned[0] == pytest.approx(goes_m, abs=0.5)
    assert abs(speeds[-1]) < 0.2


def test_a_search_begins_where_the_owner_was_seen_last_whatever_the_last_search_was_for(
    scene: tuple[Guard, Own, Sees],
) -> None:
    guard, own, sees = scene
    own.pos_ned, own.range_m, sees.below_m = (0.0, 0.0, -2.6), 2.6, 1.6
    for aside_m in (0.0, 4.0):  # without images it does not stand and look before
        sees.is_there, sees.ahead_m, sees.aside_m = True, 5.0, aside_m
        flown(guard, own, 3.0)
        sees.is_there = False
        for _ in range(50):
            own.boot_us += 100_000
            guard.filtered(((0.0, 0.0, 0.0), 0.0), own)
        flown(guard, own, 0.3)
        assert guard.stance is Stance.SEARCH
        north, east, _ = guard.filtered(((0.0, 0.0, 0.0), 0.0), own)[0]
        assert north > 0.3
        assert (abs(east) > 0.3 * north) == (aside_m > 0.0)


def test_at_the_end_of_a_search_it_does_not_drift(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, sees = scene
    own.pos_ned, own.range_m, sees.below_m = (0.0, 0.0, -2.6), 2.6, 1.6
    flown(guard, own, 1.0)
    sees.is_there = False
    s = guard.settings
    flown(guard, own, s.search_s + s.search_ahead_s + 0.5)
    for _ in range(400):  # what it asks for is flown, and 7 cm/s besides
        speed = flown(guard, own, 0.1)[0]
        own.pos_ned = (own.pos_ned[0] + 0.1 * (speed + 0.07), 0.0, -2.6)
    assert abs(own.pos_ned[0]) < 0.2


def test_without_time_for_it_a_search_stays_where_it_is(scene: tuple[Guard, Own, Sees]) -> None:
    _, own, sees = scene
    guard = Guard(guard_settings({"search_ahead_s": 0.0, "search_s": 1.5}), Senses(detector=sees))  # type: ignore[arg-type]
    flown(guard, own, 1.0)
    sees.is_there = False
    own.pos_ned, own.range_m = (0.0, 0.0, -2.6), 2.6
    assert max(np.abs(flown(guard, own, 8.0)[20:])) < 1e-6


@pytest.mark.parametrize(("height_m", "is_in_the_way"), [(1.6, True), (2.9, False)])
def test_a_search_passes_over_the_heads_of_people_but_not_through_them(
    scene: tuple[Guard, Own, Sees], monkeypatch: pytest.MonkeyPatch, height_m: float, is_in_the_way: bool
) -> None:
    guard, own, sees = scene
    sees.is_there = False
    somebody = PersonNow(np.array([1.6, 0.0, -1.3]), 0.01 * np.eye(2), np.zeros(2), 0.01 * np.eye(2), 0.0)
    monkeypatch.setattr(Senses, "others_now", lambda *_: [somebody])
    own.pos_ned, own.range_m = (0.0, 0.0, -height_m), height_m
    guard.begin(own)
    ahead = searched(guard, own, 17.0, 10.0)[-1][0]
    assert ahead < 0.5 if is_in_the_way else ahead > 2.0


def test_without_gnss_it_is_as_fast_as_its_velocity_is_known(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, sees = scene
    sees.ahead_m = 9.0
    free = flown(guard, own, 2.0)[-1]
    speeds = []
    for guard.vel_std in (0.1, 0.6, 0.7, 0.8, 2.0):
        speeds.append(flown(guard, own, 2.0)[-1])
    assert speeds[0] == pytest.approx(free)
    assert free > speeds[1] > speeds[2] > 0.0
    assert speeds[3:] == [0.0, 0.0]
    assert guard.interventions[NO_GNSS] > 0


def test_without_gnss_it_stays_where_it_lost_the_owner_and_gives_up_sooner(scene: tuple[Guard, Own, Sees]) -> None:
    guard, own, sees = scene
    guard.begin(own)
    flown(guard, own, 1.0)
    sees.is_there, guard.vel_std = False, 0.1
    speeds = flown(guard, own, 19.0)
    assert guard.stance is Stance.SEARCH
    assert all(abs(speed) < 1e-6 for speed in speeds[21:])
    assert not guard.is_lost(own)
    flown(guard, own, 3.0)
    assert guard.is_lost(own)
    guard.vel_std = None  # GNSS is back: there is time to search
    assert not guard.is_lost(own)


@pytest.mark.parametrize("wanted_down", [-2.0, 2.0])
@pytest.mark.parametrize(("is_heard", "sinks"), [(True, 0.3), (False, 0.0)])
def test_without_a_height_it_does_not_climb_and_sinks_slowly_where_its_range_finder_says_that_nothing_is_near(
    scene: tuple[Guard, Own, Sees], is_heard: bool, sinks: float, wanted_down: float
) -> None:
    guard, own, _ = scene
    flown(guard, own, 1.0)
    own.range_m, own.attitude_us = float("nan"), 10_000_000
    own.range_us = own.attitude_us - (0 if is_heard else RANGE_OLD_US)
    kept = guard.filtered(((0.0, 0.0, wanted_down), 0.0), own)[0][2]
    assert kept == (sinks if wanted_down > 0.0 else 0.0)
