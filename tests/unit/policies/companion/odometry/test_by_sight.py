"""When a companion tells the vehicle how fast it goes by sight, and for how good it takes that."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.transport.links import memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode, encode
from common.image_stream import ImageFrame
from policies.companion.odometry.by_sight import AWAY_US, BACK_US, DRIFT_M_S2, INERTIAL_STD_M_S, SILENT_US, BySight
from policies.companion.senses.senses import Senses
from policies.companion.vehicle_link import VehicleLink
from policies.tasks.follow_me.observe import DEPTH_HALF_M, HFOV_DEG, IMAGE_SIZE, TILT_DEG

STEP_US = 20_000


class Blind:
    """A detector that sees nobody."""

    def find(self, pixels: object, down_frd: object) -> list[object]:  # noqa: ARG002
        return []


class Bench:
    """A vehicle that hovers over a ground of blots, and what its companion says."""

    def __init__(self) -> None:
        self.end, companion_end = memory_pair()
        self.link = VehicleLink(companion_end)
        self.senses = Senses(detector=Blind())  # type: ignore[arg-type]
        self.sight = BySight(self.senses, 0.8)
        self.sight.attach(self.link)
        self.us, self.reader, self.sent = 0, FrameReader(), []  # type: ignore[var-annotated]
        self.late_us = 40_000  # pictures
        self.has_velocity = True  # telemetry
        self.north_m_s = lambda us: 0.0  # noqa: ARG005  (as the vehicle takes itself to go)
        self.tell("HEARTBEAT", autopilot=int(PX4.autopilot), base_mode=128)
        rng = np.random.default_rng(1)
        self.ground = np.kron(rng.integers(40, 215, (16, 16, 3)), np.ones((4, 4, 1))).astype(np.uint8)

    def tell(self, name: str, **fields: object) -> None:
        self.end.send(encode(name, 1, 1, 0, **fields))

    def run(self, seconds: float, fix: int | None, *, has_images: bool = True) -> None:
        """Telemetry at 50 Hz, fixes at 5 Hz, pictures at 10 Hz.

        Args:
            seconds: so long.
            fix: its type; None: none is told.
            has_images: pictures come.
        """
        for _ in range(round(seconds * 1e6 / STEP_US)):
            self.us += STEP_US
            self.tell("ATTITUDE_QUATERNION", time_boot_ms=self.us // 1000, q1=1.0)
            if self.has_velocity:
                self.tell("LOCAL_POSITION_NED", time_boot_ms=self.us // 1000, z=-2.0, vx=self.north_m_s(self.us))
            if fix is not None and self.us % 200_000 == 0:
                self.tell("GPS_RAW_INT", fix_type=fix)
            self.link.receive(self.us)
            image = self.image() if has_images and self.us % 100_000 == 0 else None
            self.senses.sense(self.link.own, self.link.owner, None)
            self.sight.step(self.link.own, image, self.us)
            for data in self.end.receive():
                self.sent += [decode(frame) for frame in self.reader.feed(data)]

    def image(self) -> ImageFrame:
        """Taken a while ago, from a lens 2 m before a wall, noise on it."""
        pixels = np.full((IMAGE_SIZE, IMAGE_SIZE, 4), 85, np.uint8)
        noise = np.random.default_rng(self.us).integers(-3, 4, self.ground.shape)
        pixels[..., :3] = np.clip(self.ground.astype(int) + noise, 0, 255)
        return ImageFrame(self.us - self.late_us, 0, pixels, HFOV_DEG, TILT_DEG, float(DEPTH_HALF_M))

    def named(self, name: str) -> list[object]:
        return [message.fields for message in self.sent if message.name == name]

    def told(self) -> list[object]:
        """Velocities, as PX4 takes them."""
        return self.named("ODOMETRY")

    @property
    def texts(self) -> list[str]:
        return [str(fields.text) for fields in self.named("STATUSTEXT")]  # type: ignore[attr-defined]


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_with_gnss_nothing_is_measured_and_nothing_said(bench: Bench) -> None:
    bench.run(3.0, 3)
    assert bench.told() == []
    assert bench.sight.std(bench.link.own) is None
    assert bench.texts == []


def test_a_vehicle_that_never_had_gnss_has_lost_none(bench: Bench) -> None:
    bench.run(3.0, 0)
    assert not bench.sight.is_away
    assert bench.told() == []


@pytest.mark.parametrize(("fix", "after_us"), [(0, AWAY_US), (1, AWAY_US), (None, SILENT_US)])
def test_without_a_fix_it_tells_ten_times_a_second_how_fast_it_goes(
    bench: Bench, fix: int | None, after_us: int
) -> None:
    bench.run(1.0, 3)
    bench.run(6.0, fix)
    told = bench.told()
    assert len(told) == pytest.approx(10.0 * (6.0 - after_us * 1e-6), abs=3.0)
    for fields in told:
        assert max(abs(fields.vx), abs(fields.vy), abs(fields.vz)) < 0.3  # type: ignore[attr-defined]
        assert (fields.frame_id, fields.child_frame_id) == (1, 1)  # type: ignore[attr-defined]
        assert not np.isfinite([fields.x, fields.y, fields.z, *fields.q]).any()  # type: ignore[attr-defined]
        assert np.isfinite(np.array(fields.velocity_covariance)[[0, 6, 11]]).all()  # type: ignore[attr-defined]
        assert fields.velocity_covariance[0] > 0.1**2  # type: ignore[attr-defined]
    stamps = [fields.time_usec for fields in told]  # type: ignore[attr-defined]
    assert all(after - before == 100_000 for before, after in pairwise(stamps))
    assert stamps[-1] == bench.us - 80_000  # as of when the picture before the newest was looked at
    assert bench.texts == ["Companion: no GNSS: by sight"]


def test_what_late_pictures_show_is_told_as_of_now(bench: Bench) -> None:
    """The wall says 0 m/s of the middle between two pictures; since then the vehicle has gone faster or slower."""
    bench.run(1.0, 3)
    bench.late_us = 300_000
    bench.north_m_s = lambda us: 0.5 * abs(us * 1e-6 % 1.0 - 0.5)  # to and fro with 0.5 m/s²
    bench.run(6.0, 0)
    told = bench.told()
    assert len(told) > 30
    gained = []
    for fields in told[5:]:
        taken_us = fields.time_usec - 20_000 - bench.late_us - 50_000  # type: ignore[attr-defined]
        gained.append(bench.north_m_s(fields.time_usec) - bench.north_m_s(taken_us))  # type: ignore[attr-defined]
    assert max(gained) > 0.15
    assert [fields.vx for fields in told[5:]] == pytest.approx(gained, abs=0.1)  # type: ignore[attr-defined]


def test_an_estimate_that_is_reset_and_telemetry_that_stops_are_no_motion(bench: Bench) -> None:
    bench.run(1.0, 3)
    bench.late_us = 300_000
    bench.run(2.0, 0)
    count = len(bench.told())
    bench.north_m_s = lambda us: 2.0  # noqa: ARG005
    bench.run(0.3, 0)
    assert len(bench.told()) <= count + 1  # nothing of images from before the reset
    bench.run(2.0, 0)
    assert max(abs(fields.vx) for fields in bench.told()) < 0.3  # type: ignore[attr-defined]
    count = len(bench.told())
    bench.has_velocity = False
    bench.run(1.0, 0)
    assert len(bench.told()) <= count + 1


def test_an_estimate_that_is_off_comes_to_the_truth_by_late_images(bench: Bench) -> None:
    """An estimator that goes a fifth of the way to each measurement, from 0.5 m/s beside a wall that stands still."""
    bench.run(1.0, 3)
    bench.late_us = 300_000
    off, heard, errors = 0.5, 0, []
    for _ in range(300):
        bench.north_m_s = lambda us: off  # noqa: ARG005, B023
        bench.run(0.02, 0)
        for fields in bench.told()[heard:]:
            off += 0.2 * (fields.vx - off)  # type: ignore[attr-defined]
            heard += 1
        errors.append(off)
    assert heard > 30
    assert min(errors) > -0.35
    assert max(map(abs, errors[-75:])) < 0.1


def test_ardupilot_is_sent_what_it_takes(bench: Bench) -> None:
    bench.tell("HEARTBEAT", autopilot=int(ARDUPILOT.autopilot), base_mode=128)
    bench.run(1.0, 3)
    bench.run(3.0, 0)
    told = bench.named("VISION_SPEED_ESTIMATE")
    assert len(told) > 15
    assert bench.told() == []
    assert max(abs(fields.x) for fields in told) < 0.3  # type: ignore[attr-defined]
    assert all(np.isfinite(fields.covariance).all() for fields in told)  # type: ignore[attr-defined]


def test_it_stops_when_gnss_is_back_for_a_while_and_says_so(bench: Bench) -> None:
    bench.run(1.0, 3)
    bench.run(3.0, 0)
    bench.run(BACK_US * 1e-6 - 0.5, 3)
    assert bench.sight.is_away
    bench.run(1.0, 3)
    assert not bench.sight.is_away
    count = bench.sight.count
    bench.run(1.0, 3)
    assert bench.sight.count == count
    assert bench.texts[-1] == "Companion: GNSS is back"


def test_without_pictures_the_velocity_is_known_worse_and_worse(bench: Bench) -> None:
    bench.run(1.0, 3)
    bench.run(3.0, 0, has_images=False)
    lost_s = 3.0 - AWAY_US * 1e-6
    assert bench.sight.std(bench.link.own) == pytest.approx(INERTIAL_STD_M_S + DRIFT_M_S2 * lost_s, abs=0.05)
    assert bench.texts == []


def test_fixes_of_another_vehicle_are_none_of_its_own(bench: Bench) -> None:
    bench.run(1.0, 3)
    for _ in range(20):
        bench.end.send(encode("GPS_RAW_INT", 2, 1, 0, fix_type=3))
        bench.run(0.2, None)
    assert bench.sight.is_away


def test_over_what_has_no_texture_nothing_is_told(bench: Bench) -> None:
    bench.ground[:] = 120
    bench.run(1.0, 3)
    bench.run(4.0, 0)
    assert bench.told() == []
    std = bench.sight.std(bench.link.own)
    assert std is not None
    assert std > INERTIAL_STD_M_S + 3.0 * DRIFT_M_S2


def test_a_receiver_that_tells_once_a_second_is_there(bench: Bench) -> None:
    for _ in range(5):
        bench.tell("GPS_RAW_INT", fix_type=3)
        bench.run(1.0, None)
    assert not bench.sight.is_away


def test_what_was_measured_before_a_restart_of_the_vehicle_counts_no_more(bench: Bench) -> None:
    bench.run(1.0, 3)
    bench.run(3.0, 0)
    assert bench.sight.motion is not None
    own = replace(bench.link.own, boot_us=1000)
    bench.sight.step(own, None, bench.us)
    assert bench.sight.motion is None
    assert not bench.sight.is_away
