"""A companion on board a flight in lockstep: it follows, sees what training sees, and gives control back."""

from dataclasses import replace
from math import dist

import numpy as np
import pytest
import warp as wp

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode
from common.geodesy import ned_from_geodetic
from mission.follow.lockstep import flight_with_companion
from mission.follow.owner_device import PHONE_SYSTEM
from mission.script import take_off
from policies.companion.companion import TELEMETRY_OLD_US
from policies.companion.engagement import Phase
from policies.companion.guard.guard import Stance
from policies.companion.guard.settings import GuardSettings
from policies.companion.observation import REPORT_LAG_S
from policies.companion.skills.following import GUARDED_OLD_US, OWNER_LOST_S
from policies.experts.follower import ScriptedFollower
from policies.tasks.flight.flown_vehicle import own_state
from policies.tasks.flight.hover_bank import hover_bank
from policies.tasks.flight.own_state import OwnState
from policies.tasks.follow_me.observe import EGO, OwnerReport, observe_rows, vector_elements
from sim.advance import RigArrays
from tests.unit.mission.follow.follow_flight import advance, config, following, hide, lose
from tests.unit.policies.companion.test_pilot import believer


@wp.kernel
def read_own(rig: RigArrays, own: wp.array(dtype=OwnState)):
    own[0] = own_state(rig, 0, 1)


def distance_m(flight):
    pos = flight.rig.rows["truth"][0]["pos_ned"]
    return dist(tuple(map(float, pos)), flight.owner.chest_ned)


@pytest.fixture(scope="module")
def flown():
    """A companion that has followed for 12 s."""
    flight, companion = following()
    advance(flight, 12.0)
    return flight, companion


def test_the_owner_waits_until_the_vehicle_follows():
    flight, companion = flight_with_companion(config(), ScriptedFollower(), is_reported=False)
    flight.fly(take_off, seconds=40.0)
    advance(flight, 5.0)
    assert companion.phase is Phase.READY
    assert not flight.owner.is_walking
    assert flight.owner.vel_ned == (0.0, 0.0, 0.0)


def test_a_scripted_follower_with_a_good_phone_stays_in_the_band():
    flight, _ = following(numbers={"phone_error": 0.0})
    distances = []
    flight.run(lambda f: distances.append(distance_m(f)) or len(distances) >= 1000)
    inside = np.mean((np.array(distances) >= 1.0) & (np.array(distances) <= 3.2))
    assert flight.owner.is_walking
    assert inside > 0.95


def test_the_companion_sees_what_training_sees():
    flight, companion = following(has_guard=False)  # the last action is what was asked for
    advance(flight, 12.0)
    while True:  # up to a frame with a decision
        count, action = companion.decision_count, companion._action.copy()
        flight.frame()
        if companion.decision_count > count:
            break
    own, report = wp.zeros(1, dtype=OwnState), wp.zeros(1, dtype=OwnerReport)
    wp.launch(read_own, 1, [flight.rig.arrays, own])
    fix = flight.owner._phone[0]["fix"]
    row = report.numpy()[0]
    row["pos_ned"], row["vel_ned"] = fix["pos_ned"], fix["vel_ned"]
    row["age_s"], row["is_known"] = (flight.time_us - int(fix["time_us"])) * 1e-6, 1
    out = wp.zeros((1, len(vector_elements(int(EGO)))), dtype=float)
    actions = wp.array([action], dtype=wp.vec4)
    wp.launch(observe_rows, 1, [int(EGO), own, report, actions, wp.zeros(1, dtype=float), out])
    # a frame of 20 ms of the report's way, centimetres of the range finder and of latitudes
    assert companion.skill.seen == pytest.approx(out.numpy()[0], abs=0.025)
    exact = [k for k, element in enumerate(vector_elements(int(EGO))) if "owner" not in element.name]
    assert companion.skill.seen[exact] == pytest.approx(out.numpy()[0][exact], abs=2e-3)


def test_training_flies_with_the_parameters_of_flights(flown):
    there, here = hover_bank(has_estimator=True, device="cpu").arrays.autopilot, flown[0].rig.arrays.autopilot
    for trained, flying in ((there.ekf.params, here.ekf.params), (there.control_params, here.control_params)):
        names = trained.numpy().dtype.names
        differ = [name for name in names if not np.array_equal(trained.numpy()[name][0], flying.numpy()[name][0])]
        assert differ == []


def test_the_phone_is_heard_through_the_vehicle_with_its_lag(flown):
    flight, companion = flown
    fix = flight.owner._phone[0]["fix"]
    assert companion.vehicle.owner.pos_ned == pytest.approx([float(x) for x in fix["pos_ned"]], abs=0.05)
    lag_s = (companion.vehicle.owner.arrived_us - int(fix["time_us"])) * 1e-6
    assert lag_s == pytest.approx(REPORT_LAG_S, abs=0.05)


def test_a_ground_station_hears_the_phone_too():
    vehicle_end, station_end = memory_pair(LinkRole.GROUND)
    flight, _ = flight_with_companion(config(numbers={"phone_error": 0.0}), ScriptedFollower(), links=[vehicle_end])
    advance(flight, 6.0)
    reader = FrameReader()
    messages = [decode(frame) for data in station_end.receive() for frame in reader.feed(data)]
    reports = [message for message in messages if message.name == "FOLLOW_TARGET" and message.sysid == PHONE_SYSTEM]
    assert 8 <= len(reports) <= 12
    fields = reports[-1].fields
    pos = ned_from_geodetic(fields.lat * 1e-7, fields.lon * 1e-7, fields.alt, flight.config.home)
    assert pos == pytest.approx(flight.owner.chest_ned, abs=0.05)


def test_pictures_that_stop_end_in_hold_within_the_stated_time():
    flight, companion = following()
    flight.onboard.way.sinks.clear()
    stopped_us = flight.time_us
    advance(flight, 3.0, lambda: flight.controller.state.mode is Mode.HOLD)
    assert flight.controller.state.mode is Mode.HOLD
    assert flight.time_us - stopped_us <= GUARDED_OLD_US + 200_000
    advance(flight, 0.2)
    assert any("hold: no new pictures" in text for text in flight.drone.texts)
    assert companion.phase is Phase.RELEASED


def test_telemetry_that_stops_ends_in_hold_within_the_stated_time():
    flight, companion = following()
    lose(companion, "LOCAL_POSITION_NED")
    stopped_us = flight.time_us
    advance(flight, 3.0, lambda: flight.controller.state.mode is Mode.HOLD)
    assert flight.controller.state.mode is Mode.HOLD
    assert flight.time_us - stopped_us <= TELEMETRY_OLD_US + 200_000


def test_an_owner_lost_for_five_seconds_ends_in_hold_where_there_is_no_guard():
    flight, companion = following(has_guard=False)
    lose(companion, "FOLLOW_TARGET")
    hide(flight)
    lost_us = flight.time_us
    advance(flight, 8.0, lambda: flight.controller.state.mode is Mode.HOLD)
    assert flight.controller.state.mode is Mode.HOLD
    assert flight.time_us - lost_us == pytest.approx(OWNER_LOST_S * 1e6, abs=1_300_000)  # hidden within a second
    assert companion.trouble == "owner lost"


def test_under_the_guard_it_stands_within_five_seconds_of_the_last_sight_and_says_so():
    flight, companion = following()
    hide(flight)
    advance(flight, 6.0)
    start = tuple(map(float, flight.rig.rows["truth"][0]["pos_ned"][:2]))
    lose(companion, "FOLLOW_TARGET")
    advance(flight, 10.0)
    assert companion.phase is Phase.FLYING
    assert dist(start, tuple(map(float, flight.rig.rows["truth"][0]["pos_ned"][:2]))) < 2.0
    assert any("holding: the owner is not seen" in text for text in flight.drone.texts)
    assert any("searching the owner" in text for text in flight.drone.texts)


class FlatOut(ScriptedFollower):
    """At the owner, as fast as it can."""

    def act(self, vector, image):
        action = super().act(vector, image)
        action[:] = 1.0, 0.0, 0.0, 0.0
        return action


def test_the_guard_says_when_it_begins_to_keep_a_policy_off_its_owner():
    flight, companion = following(pilot=FlatOut())
    advance(flight, 4.0)
    assert companion.skill.interventions["near somebody"] > 5
    texts = [text for text in flight.drone.texts if "guard: near somebody" in text]
    assert texts == ["Companion: guard: near somebody"]  # once, though it goes on


def test_under_the_guard_an_owner_who_is_back_is_followed_again():
    flight, companion = following()
    hide(flight)
    advance(flight, 7.0)
    assert companion.skill.guard.stance is Stance.SEARCH
    flight.owner.cast.rows.params.numpy()["owner_hides_per_min"] = 0.0
    advance(flight, 15.0, lambda: companion.skill.guard.stance is Stance.FREE)
    assert companion.skill.guard.stance is Stance.FREE
    advance(flight, 5.0)
    assert distance_m(flight) < 4.0


def test_an_owner_who_is_only_seen_is_not_lost():
    flight, companion = following()
    lose(companion, "FOLLOW_TARGET")
    advance(flight, 8.0)
    assert companion.phase is Phase.FLYING


@pytest.mark.parametrize(("in_view", "phase"), [(5.0, Phase.READY), (-5.0, Phase.WAITING)])
def test_who_flies_by_sight_alone_is_ready_when_it_believes_to_see_the_owner(tmp_path, in_view, phase):
    pilot = believer(tmp_path, "vision-only", in_view=in_view)
    guard = GuardSettings(is_on=False)
    flight, companion = flight_with_companion(config(), pilot, is_reported=False, guard=guard)
    advance(flight, 4.0)
    assert companion.phase is phase
    assert companion.decision_count == 0
    assert not companion.action.any()
    if phase is Phase.READY:
        assert companion.skill.owner_distance_m(companion.vehicle.own) == pytest.approx(3.5, abs=0.1)  # as believed


def test_in_the_ardupilot_dialect_it_flies_in_guided_and_hands_back_by_brake():
    ardupilot = config().model_copy(update={"dialect": "ardupilot"})
    flight, companion = flight_with_companion(ardupilot, ScriptedFollower())
    flight.fly(take_off, seconds=40.0)
    advance(flight, 5.0)
    assert (companion.phase, flight.controller.state.mode) == (Phase.FLYING, Mode.GUIDED)
    assert flight.owner.is_walking
    flight.onboard.way.sinks.clear()
    advance(flight, GUARDED_OLD_US * 1e-6 + 0.5)
    assert (companion.phase, flight.controller.state.mode) == (Phase.RELEASED, Mode.BRAKE)


def test_pictures_of_another_lens_end_in_hold():
    flight, companion = following()
    flight.onboard.way.sinks.clear()
    flight.onboard.add_sink(lambda frame: companion.skill.camera.publish(replace(frame, hfov_deg=60.0)))
    advance(flight, 1.0, lambda: flight.controller.state.mode is Mode.HOLD)
    assert flight.controller.state.mode is Mode.HOLD
    assert companion.trouble == "pictures of another lens"


@pytest.mark.parametrize("mode", [Mode.HOLD, Mode.POSITION])
def test_the_pilots_mode_stops_every_setpoint(mode):
    flight, companion = following()
    if mode is Mode.POSITION:
        flight.drone.send("MANUAL_CONTROL", target=1, x=0, y=0, z=500, r=0, buttons=0)
        flight.frame()
    sub = 3 if mode is Mode.HOLD else 0
    main = 4 if mode is Mode.HOLD else 3
    flight.drone.send(
        "COMMAND_LONG", target_system=1, target_component=1, command=176, param1=1, param2=main, param3=sub
    )
    advance(flight, 0.1)
    assert flight.controller.state.mode is mode
    assert companion.phase is Phase.RELEASED
    decisions = companion.decision_count
    advance(flight, 10.0)
    assert flight.controller.state.mode is not Mode.OFFBOARD
    assert companion.decision_count == decisions
