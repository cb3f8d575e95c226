"""After an owner: what a companion's goal is by camera and phone, and how fast it may be there."""

from types import SimpleNamespace

import numpy as np
import pytest

from common.image_stream import ImageFrame
from policies.companion.guard.guard import GOES_ON_S, SHORT_OF_M
from policies.companion.guard.settings import GuardSettings
from policies.companion.senses.senses import Senses
from policies.companion.telemetry import Own, Owner
from policies.companion.where_to.owner_goal import KEPT_M, OwnerGoal
from policies.person_detector.detector import Detection
from policies.tasks.follow_me.observe import DEPTH_HALF_M, HFOV_DEG, IMAGE_SHAPE, TILT_DEG
from policies.tasks.navigate.walking_goal import CLOSING_HZ

STEP_US = 20_000
GUARD = GuardSettings()
BLANK = np.full(IMAGE_SHAPE, 128, np.uint8)


class Camera:
    """Hands over what was put into it, once."""

    trouble = ""

    def __init__(self):
        self.image = None

    def take(self, _):
        image, self.image = self.image, None
        return image

    def close(self):
        pass


class Shows:
    """A detector that sees somebody so far ahead and to the right of the vehicle; None: nobody."""

    place: tuple[float, float] | None = None

    def find(self, pixels, down_frd):  # noqa: ARG002
        return [] if self.place is None else [Detection(0.99, (*self.place, 1.0), (32.0, 32.0))]


class Scene:
    """A vehicle at home, and an owner whose phone reports without errors."""

    def __init__(self):
        self.texts = []
        self.vehicle = SimpleNamespace(
            own=Own(pos_ned=(0.0, 0.0, 0.0), vel_ned=(0.0, 0.0, 0.0), boot_us=0),
            owner=Owner(),
            clock=SimpleNamespace(pictured=lambda _: None),
            say=lambda text, *_: self.texts.append(text),
        )
        self.camera = Camera()
        self.shows = Shows()
        self.goal = OwnerGoal(self.vehicle, self.camera, Senses(detector=self.shows), GUARD)  # type: ignore[arg-type]

    def pass_by(self, seconds, start_ned=None, vel_ned=(0.0, 0.0, 0.0), pixels=None, late_us=0, hfov_deg=HFOV_DEG):
        """Time passes; the phone reports twice a second if it is there, and the camera shows pixels ten times."""
        own, owner = self.vehicle.own, self.vehicle.owner
        for step in range(round(seconds * 1e6) // STEP_US):
            own.boot_us += STEP_US
            if start_ned is not None and step % 25 == 0:
                moved = [place + rate * step * STEP_US * 1e-6 for place, rate in zip(start_ned, vel_ned, strict=True)]
                owner.pos_ned, owner.vel_ned, owner.std_m = tuple(moved), vel_ned, 0.3
                owner.count += 1
            if pixels is not None and step % 5 == 0:
                lens = (hfov_deg, TILT_DEG, float(DEPTH_HALF_M))
                self.camera.image = ImageFrame(own.boot_us - late_us, step, pixels, *lens)
            self.goal.frame(own.boot_us)


def test_without_a_word_of_the_owner_there_is_no_goal_and_no_speed():
    scene = Scene()
    scene.pass_by(1.0)
    assert scene.goal.goal is None
    assert scene.goal.done == "owner lost"
    assert scene.goal.speed_max_m_s == 0.0


@pytest.mark.parametrize("pixels", [None, BLANK])
def test_the_goal_is_where_the_phone_says_with_a_camera_that_shows_nobody_or_without(pixels):
    scene = Scene()
    scene.pass_by(6.0, (20.0, 5.0, -1.0), pixels=pixels)
    assert scene.goal.goal.pos_ned[:2] == pytest.approx((20.0, 5.0), abs=0.5)
    scene.pass_by(GUARD.search_s + 2.0, pixels=pixels)
    assert scene.goal.goal is None


def test_who_is_seen_is_kept_nearer_to_than_who_is_only_heard_of():
    """By a phone alone the owner may be metres off: it stays back as far."""
    heard, seen = Scene(), Scene()
    place = (6.0, 0.0, -1.0)
    heard.pass_by(10.0, place)
    seen.shows.place = place[:2]
    seen.pass_by(10.0, place, pixels=BLANK)
    limits = []
    for scene in (heard, seen):
        north = scene.goal.goal.pos_ned[0]
        scene.vehicle.own.pos_ned = (north - KEPT_M - 1.0, scene.goal.goal.pos_ned[1], 0.0)
        limits.append(scene.goal.speed_max_m_s)
    assert limits[0] == 0.0
    assert limits[1] > 0.2


def test_it_is_as_fast_as_the_owner_who_leaves_and_closes_up():
    scene = Scene()
    scene.pass_by(10.0, (20.0, 0.0, -1.0), (1.5, 0.0, 0.0))
    away_m = scene.goal.goal.pos_ned[0]
    assert away_m == pytest.approx(35.0, abs=2.0)
    faster = scene.goal.speed_max_m_s - 1.5
    assert 0.5 * CLOSING_HZ * (away_m - KEPT_M) < faster < CLOSING_HZ * (away_m - KEPT_M)


def test_after_a_restart_of_the_vehicle_it_looks_anew():
    scene = Scene()
    scene.pass_by(10.0, (20.0, 0.0, -1.0), pixels=BLANK)
    scene.vehicle.own.boot_us = 0
    scene.pass_by(5.0, (5.0, 0.0, -1.0), pixels=BLANK)
    assert scene.goal.goal.pos_ned[0] == pytest.approx(5.0, abs=0.5)


@pytest.mark.parametrize("late_us", [100_000, 280_000, 320_000, 400_000, 600_000])
def test_old_images_do_not_make_it_forget_what_the_phone_says(late_us):
    scene = Scene()
    scene.pass_by(10.0, (20.0, 5.0, -1.0), pixels=BLANK, late_us=late_us)
    for _ in range(50):
        scene.pass_by(0.1, (20.0, 5.0, -1.0), pixels=BLANK, late_us=late_us)
        assert scene.goal.goal is not None
    assert scene.goal.goal.pos_ned[:2] == pytest.approx((20.0, 5.0), abs=0.7)


def walking(seconds=3.0, speed=1.0):
    """A scene whose camera has seen somebody go north from 5 m ahead, and whose phone has said nothing."""
    scene = Scene()
    scene.goal.may_search = True
    for step in range(round(10 * seconds)):
        scene.shows.place = (5.0 + 0.1 * step * speed, 0.0)
        scene.pass_by(0.1, pixels=BLANK)
    return scene


def test_who_is_neither_seen_nor_heard_of_is_waited_for_and_then_looked_for_where_they_went():
    scene = walking()
    last_m = scene.shows.place[0]
    assert scene.goal.speed_max_m_s > 1.0
    scene.shows.place = None
    scene.pass_by(GUARD.stop_s + 0.2, pixels=BLANK)
    assert scene.goal.goal is not None
    assert scene.goal.speed_max_m_s == 0.0
    scene.pass_by(GUARD.search_s - GUARD.stop_s, pixels=BLANK)
    assert scene.texts == ["Companion: searching the owner"]
    north, east = scene.goal.goal.pos_ned[:2]
    assert (north, east) == pytest.approx((last_m + GOES_ON_S, 0.0), abs=1.0)
    assert 0.5 < scene.goal.speed_max_m_s <= GUARD.search_ahead_speed
    scene.vehicle.own.pos_ned = (north - SHORT_OF_M, east, 0.0)
    assert scene.goal.speed_max_m_s == 0.0


def test_who_is_found_again_is_followed_and_who_is_not_is_lost_in_the_end():
    scene = walking()
    scene.shows.place = None
    scene.pass_by(GUARD.search_s + 1.0, pixels=BLANK)
    scene.shows.place = (9.0, 1.0)
    scene.pass_by(1.0, pixels=BLANK)
    assert scene.texts == ["Companion: searching the owner", "Companion: following"]
    assert scene.goal.goal.pos_ned[:2] == pytest.approx((9.0, 1.0), abs=0.5)
    scene.shows.place = None
    scene.pass_by(GUARD.lost_s - 0.5, pixels=BLANK)
    assert scene.goal.goal is not None
    scene.pass_by(1.0, pixels=BLANK)
    assert scene.goal.goal is None


def test_who_is_lost_before_it_drives_is_lost_at_once():
    scene = walking()
    scene.goal.may_search, scene.shows.place = False, None
    scene.pass_by(GUARD.search_s + 0.2, pixels=BLANK)
    assert scene.goal.goal is None


def test_who_was_heard_of_after_the_last_sight_is_looked_for_from_there():
    scene = walking()
    scene.shows.place = None
    scene.pass_by(20.0, (8.0, 0.0, -1.0), (0.0, 1.5, 0.0), pixels=BLANK)
    scene.pass_by(GUARD.search_s + 1.5, pixels=BLANK)
    assert scene.goal.is_searching
    assert scene.goal.goal.pos_ned[1] > 20.0


@pytest.mark.parametrize("shape", [(64, 64, 3), (128, 128, 4), (48, 64, 4)])
def test_images_that_it_can_make_nothing_of_are_said_once_and_it_goes_by_the_phone(shape):
    scene = Scene()
    scene.pass_by(6.0, (20.0, 5.0, -1.0), pixels=np.full(shape, 128, np.uint8))
    assert scene.goal.goal.pos_ned[:2] == pytest.approx((20.0, 5.0), abs=0.5)
    assert scene.texts == ["Companion: pictures of another size: by the phone alone"]


@pytest.mark.parametrize(
    ("pixels", "late_us", "hfov_deg", "wrong"),
    [
        (None, 0, HFOV_DEG, "no new pictures"),
        (BLANK, 400_000, HFOV_DEG, "old pictures"),
        (BLANK, -400_000, HFOV_DEG, "pictures from the future"),
        (BLANK, 0, 70.0, "pictures of another lens"),
    ],
)
def test_a_camera_that_shows_nothing_to_go_by_is_said_once_and_with_a_silent_phone_it_is_the_end(
    pixels, late_us, hfov_deg, wrong
):
    scene = walking()
    scene.pass_by(12.0, (8.0, 0.0, -1.0), pixels=pixels, late_us=late_us, hfov_deg=hfov_deg)
    assert scene.goal.goal.pos_ned[:2] == pytest.approx((8.0, 0.0), abs=0.7)
    assert scene.texts == [f"Companion: {wrong}: by the phone alone"]
    scene.pass_by(GUARD.search_s + 1.0, pixels=pixels, late_us=late_us, hfov_deg=hfov_deg)
    assert scene.goal.goal is None
    assert len(scene.texts) == 1
    scene.pass_by(1.0, (8.0, 0.0, -1.0), pixels=BLANK)
    assert scene.goal.goal is not None


def test_an_image_that_is_late_now_and_then_is_no_word():
    scene = walking()
    for late_us in (100_000, 400_000) * 10:
        scene.pass_by(0.5, pixels=BLANK, late_us=late_us)
    assert scene.texts == []
