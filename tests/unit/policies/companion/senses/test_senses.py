"""Whom the senses take for the owner."""

import numpy as np
import pytest

from common.image_stream import ImageFrame
from policies.companion.senses.senses import Senses
from policies.companion.telemetry import Own, Owner
from policies.person_detector.detector import Detection
from policies.tasks.follow_me.observe import DEPTH_HALF_M, HFOV_DEG, IMAGE_SIZE, TILT_DEG


class Shows:
    """A detector that sees somebody at each of some places ahead and right of the vehicle."""

    places: tuple[tuple[float, float], ...] = ()

    def find(self, pixels: object, down_frd: object) -> list[Detection]:  # noqa: ARG002
        return [Detection(0.99, (x, y, 0.6), (32.0, 32.0)) for x, y in self.places]


class Scene:
    def __init__(self, *, hears: bool = True) -> None:
        self.shows = Shows()
        self.senses = Senses(hears=hears, detector=self.shows)  # type: ignore[arg-type]
        self.phone = Owner()
        self.own = Own(boot_us=0, pos_ned=(0.0, 0.0, -1.6), vel_ned=(0.0, 0.0, 0.0), range_m=1.6)

    def look(self, *places: tuple[float, float], times: int = 1, byte: int = 200) -> None:
        """What is not somebody is all as far off as a byte of the depth channel says: beyond the map, if not given."""
        self.shows.places = places
        for _ in range(times):
            self.own.boot_us += 100_000
            pixels = np.full((IMAGE_SIZE, IMAGE_SIZE, 4), byte, np.uint8)
            frame = ImageFrame(self.own.boot_us, 0, pixels, HFOV_DEG, TILT_DEG, float(DEPTH_HALF_M))
            self.senses.sense(self.own, self.phone, frame)

    def report(self, north_m: float, east_m: float) -> None:
        """The phone says that its owner stands there."""
        self.phone.pos_ned, self.phone.has_velocity = (north_m, east_m, -1.0), True
        self.phone.count += 1

    @property
    def silence_s(self) -> float:
        return self.senses.silence_s(self.own)


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_who_is_seen_first_must_be_there_in_four_images_in_a_row(scene: Scene) -> None:
    scene.look((3.0, 0.0), times=3)
    assert scene.silence_s == float("inf")
    scene.look((3.0, 0.0))
    assert scene.silence_s == 0.0


def test_a_single_ghost_does_not_bring_the_owner_back(scene: Scene) -> None:
    scene.look((3.0, 0.0), times=10)
    scene.look(times=15)
    scene.look((3.5, 0.5))
    scene.look(times=3)
    scene.look((2.5, 0.0))
    assert scene.silence_s > 1.9
    scene.look((2.5, 0.0), times=4)
    assert scene.silence_s == 0.0


def test_a_single_ghost_far_from_where_the_owner_is_expected_is_not_the_owner(scene: Scene) -> None:
    scene.look((3.0, 0.0), times=10)
    scene.look(times=8)
    scene.look((5.0, 1.5))
    assert scene.silence_s > 0.8
    scene.look(times=1)
    scene.look((5.0, 1.5))
    assert scene.silence_s > 1.0


@pytest.mark.parametrize("hears", [True, False])
@pytest.mark.parametrize(("speed", "hidden"), [(2.0, 4), (2.0, 7), (3.0, 4)])
def test_an_owner_who_turns_out_of_sight_is_followed_from_the_second_image_on(
    hears: bool, speed: float, hidden: int
) -> None:
    scene = Scene(hears=hears)
    for k in range(10):
        if k % 5 == 0:
            scene.report(6.0 + 0.1 * speed * k, 0.0)
        scene.look((6.0 + 0.1 * speed * k, 0.0))
    corner = 6.0 + 0.9 * speed
    scene.look(times=hidden)
    for k in range(2):
        scene.look((corner, 0.1 * speed * (hidden + 1 + k)))
    assert scene.silence_s == 0.0


def test_a_fourth_who_comes_while_the_owner_is_gone_is_kept_off_beside_three_who_are_known() -> None:
    scene = Scene(hears=False)
    scene.look((3.0, 0.0), times=10)
    scene.look(times=12)
    walkers = [(20.0, -4.0), (20.0, 0.0), (20.0, 4.0)]
    for k in range(16):
        scene.look(*((x, y + 0.1 * k) for x, y in [*walkers, (16.0, 8.0)][: 3 if k < 6 else 4]))
    assert len(scene.senses.others_now(scene.own)) == 4


@pytest.mark.parametrize("seconds", [1.2, 6.0])
def test_who_walks_about_while_nobody_knows_where_the_owner_is_is_kept_off_too(seconds: float) -> None:
    scene = Scene(hears=False)
    scene.look((3.0, 0.0), times=10)
    scene.look(times=round(10.0 * seconds))
    for k in range(8):
        scene.look((20.0, 8.0 - 0.14 * k))
    assert scene.silence_s > seconds
    (one,) = scene.senses.others_now(scene.own)
    assert one.pos_ned[:2] == pytest.approx([20.0, 7.0], abs=0.3)


def test_who_turns_out_to_be_the_owner_is_nobody_else(scene: Scene) -> None:
    scene.look((3.0, 0.0), times=10)
    scene.look(times=12)
    for k in range(10):
        scene.look((4.0, 0.14 * k))
    assert scene.silence_s == 0.0
    assert not scene.senses.others_now(scene.own)


def test_who_stands_beside_the_owner_is_somebody_else(scene: Scene) -> None:
    scene.look((3.0, 0.0), times=10)
    scene.look((3.0, 0.0), (2.0, 0.3), times=10)
    assert scene.senses.seen.now(scene.own.boot_us)[0][0] == pytest.approx(3.0, abs=0.05)


def test_who_is_left_when_the_owner_is_gone_is_not_the_owner(scene: Scene) -> None:
    scene.look((3.0, 0.0), times=10)
    scene.look((1.5, 0.3), times=2)
    assert scene.silence_s > 0.1


def test_who_crosses_before_the_owner_and_hides_them_is_not_taken_for_them(scene: Scene) -> None:
    scene.look((3.0, 0.0), times=10)
    for k in range(30):
        aside = -2.0 + 0.14 * k
        others = [(2.3, aside)]
        scene.look(*(others if abs(aside) < 0.3 else [(3.0, 0.0), *others]))
    place = scene.senses.seen.now(scene.own.boot_us)[0]
    assert place[:2] == pytest.approx([3.0, 0.0], abs=0.1)


def test_an_owner_who_comes_back_elsewhere_is_nobody_else(scene: Scene) -> None:
    scene.look((3.0, 0.0), times=10)
    scene.look(times=12)
    scene.look((5.0, 2.0), times=30)
    assert scene.silence_s == 0.0


def test_without_a_phone_the_owner_may_have_turned_and_walked_on_while_gone() -> None:
    scene = Scene(hears=False)
    for k in range(10):
        scene.look((3.0 + 0.14 * k, 0.0))
    scene.look(times=150)
    scene.look((2.0, -11.0), times=10)
    assert scene.silence_s == 0.0


def pass_by(scene: Scene) -> None:
    """Somebody walks past an owner three metres ahead, whose phone says so."""
    for k in range(60):
        if k % 5 == 0:
            scene.report(3.5, 1.0)
        scene.look((3.0, 0.0), (4.5, -3.0 + 0.1 * k))


def test_who_flies_by_sight_alone_finds_the_owner_again_after_somebody_has_passed() -> None:
    scene = Scene(hears=False)
    scene.look((3.0, 0.0), times=10)
    pass_by(scene)
    scene.look(times=15)
    scene.look((3.0, 0.0), times=60)
    assert scene.silence_s == 0.0


def test_the_phone_finds_the_owner_again_where_others_were() -> None:
    scene = Scene()
    scene.look((3.0, 0.0), times=10)
    pass_by(scene)
    scene.look(times=15)
    for _ in range(12):
        scene.report(3.5, 1.0)
        scene.look((3.0, 0.0), (6.0, 4.0), times=5)
    assert scene.silence_s == 0.0
    assert scene.senses.seen.now(scene.own.boot_us)[0][:2] == pytest.approx([3.0, 0.0], abs=0.3)


@pytest.mark.parametrize("phone_down", [-6.0, 4.0])
def test_an_owner_out_of_sight_stands_on_the_ground_whatever_height_their_phone_says(
    scene: Scene, phone_down: float
) -> None:
    for _ in range(10):
        scene.report(3.0, 0.0)
        scene.phone.pos_ned = (3.0, 0.0, phone_down)
        scene.look()
    owner = scene.senses.owner_now(scene.own)
    assert owner is not None
    assert owner.pos_ned[2] == pytest.approx(-1.0)


def test_the_head_below_it_is_not_the_ground(scene: Scene) -> None:
    scene.own.pos_ned = (0.0, 0.0, -3.2)
    for range_m, images in ((3.2, 20), (1.45, 10)):
        scene.own.range_m = range_m
        scene.report(0.5, 0.0)
        scene.look(times=images)
    owner = scene.senses.owner_now(scene.own)
    assert owner is not None
    assert owner.pos_ned[2] == pytest.approx(-1.0)


def test_the_ground_seen_on_take_off_is_nothing_solid(scene: Scene) -> None:
    scene.own.range_m, scene.own.pos_ned = 0.3, (0.0, 0.0, -0.3)
    scene.look(byte=80)
    around = scene.senses.map
    assert np.isinf(around.nearest_m(scene.own.pos_ned, 0.0, scene.own.boot_us)).all()
    scene.own.range_m, scene.own.pos_ned = 1.6, (0.0, 0.0, -1.6)
    scene.look(byte=80)
    assert np.isfinite(around.nearest_m(scene.own.pos_ned, 0.0, scene.own.boot_us)).any()


def test_without_a_range_finder_images_are_taken_in(scene: Scene) -> None:
    scene.own.range_m = float("nan")
    scene.look(byte=80)
    assert np.isfinite(scene.senses.map.nearest_m(scene.own.pos_ned, 0.0, scene.own.boot_us)).any()


@pytest.mark.parametrize(("byte", "count"), [(200, 0), (255, 1)])
def test_who_stands_in_the_way_counts_where_no_depth_puts_them_on_the_map(scene: Scene, byte: int, count: int) -> None:
    scene.look((5.0, 0.0), times=10, byte=byte)
    scene.look((5.0, 0.0), (2.5, 0.6), times=5, byte=byte)
    others = scene.senses.others_now(scene.own)
    assert len(others) == count
    assert all(person.pos_ned[:2] == pytest.approx([2.5, 0.6], abs=0.1) for person in others)
