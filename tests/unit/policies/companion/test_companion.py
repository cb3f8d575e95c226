"""The companion's loop in memory: a vehicle that flies in Offboard, images, and a pilot that stops deciding."""

import numpy as np
import pytest

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode, encode
from common.attitude import quat_of
from common.image_stream import ImageFrame
from policies.companion.companion import MISFIT, NO_DECISION, NO_HEIGHT, NOT_ALONE, Companion
from policies.companion.engagement import Phase
from policies.companion.guard.settings import GuardSettings
from policies.companion.observation import CommandKernel
from policies.companion.senses.image_fit import LENS, NO_IMAGES, OTHER_CLOCK, OTHER_LENS, OTHER_SIZE
from policies.companion.skills.driving import DriveObserver
from policies.companion.skills.following import IMAGE_OLD_US, Following
from policies.companion.telemetry import Own
from policies.companion.vehicle_link import COMPONENT
from policies.experts.follower import ScriptedFollower
from policies.tasks.follow_me.observe import EGO, vector_elements

FRAME_US = 20_000


class Images:
    """A camera that takes one at 10 Hz."""

    def __init__(self, shape):
        self.shape = shape

    age_us = 0  # of each image when it comes in
    lens = LENS
    is_stuck = False

    def take(self, time_us):
        if self.is_stuck or time_us % 100_000 != 0:
            return None
        return ImageFrame(time_us - self.age_us, 0, np.zeros(self.shape, np.uint8), *self.lens)

    def close(self):
        pass


class Doubting(ScriptedFollower):
    """Sees the owner 3 m ahead; decides on nothing while `is_lost`."""

    is_lost = False
    resets = 0

    def reset(self):
        super().reset()
        self.resets += 1

    def act(self, *_):
        self.owner_hfrd = (3.0, 0.0, 0.5)
        return np.full(4, np.nan if self.is_lost else 0.5, np.float32)


class Air:
    """What the vehicle tells, and what it is told."""

    mav_type = 2  # a quadrotor
    height_m = 5.0
    has_range = True

    def __init__(self, guard=None):
        companion_end, self.end = memory_pair(LinkRole.ONBOARD)
        self.pilot = Doubting()
        self.images = Images(self.pilot.image_shape)
        self.companion = Companion(companion_end, Following(self.images, self.pilot, guard))
        self.mode = Mode.HOLD
        self.time_us = 0
        self._reader = FrameReader()

    def run(self, seconds):
        """The messages the companion sends meanwhile."""
        reported = []
        for _ in range(round(seconds * 1e6) // FRAME_US):
            self.time_us += FRAME_US
            mode = PX4.custom_mode(self.mode)
            self._tell("HEARTBEAT", type=self.mav_type, autopilot=12, base_mode=128, custom_mode=mode, system_status=4)
            self._tell("EXTENDED_SYS_STATE", landed_state=2)
            self._tell("ATTITUDE_QUATERNION", time_boot_ms=self.time_us // 1000, q1=1.0)
            self._tell("LOCAL_POSITION_NED", x=1.0, z=-self.height_m)
            if self.has_range:
                cm = round(100.0 * self.height_m)
                self._tell("DISTANCE_SENSOR", min_distance=10, max_distance=4000, current_distance=cm, orientation=25)
            self.companion.frame(self.time_us)
            reported += [decode(frame) for data in self.end.receive() for frame in self._reader.feed(data)]
        return reported

    def _tell(self, name, **fields):
        self.end.send(encode(name, 1, 1, 0, **fields))


def flown_air():
    """Of a companion that was given control."""
    air = Air()
    air.run(1.0)
    air.mode = Mode.OFFBOARD
    air.run(1.0)
    assert air.companion.phase is Phase.FLYING
    return air


def test_the_height_is_carried_on_while_the_range_finder_is_silent_and_then_it_hands_back():
    air = flown_air()
    heights_m = []
    air.pilot.act = lambda vector, _: heights_m.append(vector[:]) or np.zeros(4, np.float32)
    air.run(0.5)
    before = heights_m[-1].copy()
    air.has_range = False
    air.height_m = 6.0
    air.run(3.0)
    assert air.companion.phase is Phase.FLYING
    own = air.companion.vehicle.own
    assert np.isnan(own.height_m)
    assert own.carried_height_m == pytest.approx(6.0)
    changed = heights_m[-1] != before
    assert changed.sum() == 1  # the height alone: it is valid as before
    said = air.run(3.0)
    assert air.companion.trouble == NO_HEIGHT
    assert any(NO_HEIGHT[:30] in message.fields.text for message in said if message.name == "STATUSTEXT")
    air.mode = Mode.HOLD
    air.run(0.5)
    assert air.companion.phase is not Phase.FLYING


def test_a_vehicle_without_a_range_finder_is_not_taken_over():
    air = Air()
    air.has_range = False
    air.run(1.0)
    air.mode = Mode.OFFBOARD
    air.run(1.0)
    assert air.companion.phase is not Phase.FLYING
    assert air.companion.trouble == NO_HEIGHT


def test_images_at_25_hertz_make_ten_decisions_a_second():
    air = flown_air()
    frame = 0

    def take(time_us):
        nonlocal frame
        frame += 1
        is_due = frame % 2 == 0  # each second frame of 20 ms: 25 Hz
        return ImageFrame(time_us, 0, np.zeros(air.images.shape, np.uint8), *air.images.lens) if is_due else None

    air.images.take = take
    before = air.companion.decision_count
    air.run(5.0)
    assert air.companion.decision_count - before == pytest.approx(50, abs=1)


def test_a_pilot_is_shown_what_was_flown_of_its_last_action_by_the_guard(monkeypatch):
    monkeypatch.setattr(Following, "loss", lambda *_, **__: "")  # the owner is known
    at = [element.name for element in vector_elements(EGO)].index("last_forward_sp")
    shown = {}
    for name, guard in (("alone", None), ("guarded", GuardSettings())):  # it sees nobody, and stands
        air = Air(guard)
        vectors = []
        air.pilot.act = lambda vector, _, kept=vectors: kept.append(vector.copy()) or np.full(4, 0.5, np.float32)
        air.run(1.0)
        air.mode = Mode.OFFBOARD
        air.run(4.0)
        assert air.companion.phase is Phase.FLYING
        assert air.companion.action == pytest.approx(np.full(4, 0.5))  # a log keeps what it chose
        shown[name] = vectors[-1][at : at + 3]
    assert shown["alone"] == pytest.approx([0.5, 0.5, 0.5])
    assert shown["guarded"][:2] == pytest.approx([0.0, 0.0], abs=0.1)  # it stays where it was
    assert shown["guarded"][2] < 0.3  # it is too high, and sinks


def test_the_action_of_what_an_action_asks_for_is_that_action():
    rng, command, observer = np.random.default_rng(2), CommandKernel(), DriveObserver(1)
    for _ in range(20):
        yaw = rng.uniform(-np.pi, np.pi)
        own = Own(q_ned_from_frd=quat_of(yaw, 0.0))
        action = rng.uniform(-1.0, 1.0, 4).astype(np.float32)
        assert command.action_of(*command.setpoint(action, own), own, action) == pytest.approx(action, abs=1e-5)
        driven = rng.uniform(0.1, 1.0, 2).astype(np.float32)
        assert observer.action_of(*observer.command(driven)) == pytest.approx(driven, abs=1e-5)
    velocity, _ = command.setpoint(action, own)
    assert command.action_of(velocity, np.nan, own, action)[3] == action[3]  # no yaw rate is sent


def test_a_policy_that_does_not_decide_hands_back_and_sends_no_number_that_is_none():
    air = flown_air()
    air.pilot.is_lost, air.pilot.resets = True, 0
    reported = air.run(0.5)
    assert air.companion.trouble == NO_DECISION
    assert air.companion.phase is Phase.HANDING_BACK
    assert air.pilot.resets > 0
    sent = [m.fields for m in reported if m.name == "SET_POSITION_TARGET_LOCAL_NED"]
    assert sent
    assert np.isfinite([(f.vx, f.vy, f.vz, f.yaw_rate) for f in sent]).all()
    assert (sent[-1].vx, sent[-1].vy, sent[-1].vz, sent[-1].yaw_rate) == (0.0, 0.0, 0.0, 0.0)
    assert np.isfinite(air.companion.action).all()
    air.pilot.is_lost = False
    air.mode = Mode.HOLD
    air.run(3.0)
    assert air.companion.phase is Phase.READY


def test_the_setpoint_of_a_decision_is_sent_before_it_is_noted():
    air = flown_air()
    sent, noted = [], []

    def take(decision):
        sent.extend(decode(frame) for data in air.end.receive() for frame in air._reader.feed(data))
        noted.append((decision.time_us, [m.fields.vx for m in sent if m.name == "SET_POSITION_TARGET_LOCAL_NED"]))
        sent.clear()

    air.companion.skill.keep_records()
    air.companion.on_decision = take
    air.run(0.5)
    assert len(noted) == 5
    assert all(velocities for _, velocities in noted)


def test_two_companions_at_once_hold_until_one_has_gone():
    air = flown_air()
    air.end.send(encode("HEARTBEAT", 1, COMPONENT, 0, type=18, autopilot=8))
    reported = air.run(0.5)
    assert air.companion.phase is Phase.HANDING_BACK
    texts = [m.fields.text for m in reported if m.name == "STATUSTEXT"]
    assert f"Companion: hold: {NOT_ALONE}" in texts
    air.mode = Mode.HOLD
    air.run(2.0)
    assert air.companion.trouble == NOT_ALONE
    air.run(3.0)
    assert air.companion.phase is Phase.READY


@pytest.mark.parametrize(
    ("age_us", "is_taken"), [(IMAGE_OLD_US - 100_000, True), (600_000, False), (50_000_000, False)]
)
def test_pictures_taken_long_ago_are_none_even_if_they_come_in_now(age_us, is_taken):
    air = Air()
    air.time_us = 60_000_000
    air.run(1.0)
    air.mode = Mode.OFFBOARD
    air.run(1.0)
    assert air.companion.phase is Phase.FLYING
    air.images.age_us = age_us
    air.run(1.0)
    assert (air.companion.trouble != NO_IMAGES) is is_taken
    assert (air.companion.phase is Phase.FLYING) is is_taken


def test_control_is_not_given_back_for_pictures_that_grow_old_as_it_is_taken(monkeypatch):
    monkeypatch.setattr(Following, "loss", lambda *_, **__: "")  # the owner is known
    air = Air(GuardSettings())
    air.run(1.0)
    air.images.is_stuck = True
    air.run(0.48)
    air.mode = Mode.OFFBOARD
    air.run(1.0)  # the guard stands and waits for longer than who has not begun yet
    assert air.companion.phase is Phase.FLYING
    air.images.is_stuck = False
    air.run(0.5)
    assert air.companion.phase is Phase.FLYING
    assert air.companion.trouble == ""


@pytest.mark.parametrize("ahead_us", [3_000_000, 600_000_000])
def test_pictures_of_a_clock_that_has_jumped_ahead_are_not_flown_by(ahead_us):
    air = flown_air()
    air.images.age_us = -ahead_us
    reported = air.run(1.0)
    assert air.companion.trouble == OTHER_CLOCK
    assert air.companion.phase is Phase.HANDING_BACK
    assert f"Companion: hold: {OTHER_CLOCK}" in [m.fields.text for m in reported if m.name == "STATUSTEXT"]


def test_pictures_that_telemetry_is_somewhat_later_than_are_flown_by():
    air = flown_air()
    air.images.age_us = -300_000
    air.run(1.0)
    assert air.companion.phase is Phase.FLYING


@pytest.mark.parametrize(
    ("name", "value", "trouble"),
    [
        ("lens", (70.0, *LENS[1:]), OTHER_LENS),
        ("shape", (32, 32, 4), OTHER_SIZE),
        ("shape", (64, 64, 3), OTHER_SIZE),  # no depth
        ("shape", (64, 64), OTHER_SIZE),
    ],
)
def test_pictures_of_another_lens_or_kind_are_flown_by_by_nobody(monkeypatch, name, value, trouble):
    monkeypatch.setattr(Following, "loss", lambda *_, **__: "")  # the owner is known
    air = Air(GuardSettings())
    air.run(1.0)
    air.mode = Mode.OFFBOARD
    air.run(1.0)
    assert air.companion.phase is Phase.FLYING
    senses = air.companion.skill.guard.senses
    taken_us = senses.image_us
    assert taken_us > 0
    setattr(air.images, name, value)
    reported = air.run(1.0)
    assert air.companion.trouble == trouble
    assert air.companion.phase is Phase.HANDING_BACK
    assert f"Companion: hold: {trouble}" in [m.fields.text for m in reported if m.name == "STATUSTEXT"]
    assert senses.image_us == taken_us


def test_one_picture_from_the_future_is_left_out():
    air = flown_air()
    air.images.age_us = -3_000_000
    air.run(0.15)
    air.images.age_us = 0
    air.run(4.0)
    assert air.companion.phase is Phase.FLYING


def test_a_policy_that_flies_is_not_given_a_rover():
    air = Air()
    air.mav_type = 10
    reported = air.run(1.0)
    assert air.companion.trouble == MISFIT
    air.mode = Mode.OFFBOARD
    reported += air.run(1.0)
    assert air.companion.phase is Phase.WAITING
    assert "SET_POSITION_TARGET_LOCAL_NED" not in {message.name for message in reported}
