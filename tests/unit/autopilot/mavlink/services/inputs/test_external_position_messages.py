"""Positions from outside over MAVLink: what is taken, in which frame, how sure, and what is refused."""

from math import atan2, cos, inf, nan, pi, sin

import pytest

from autopilot.mavlink.dialects.ardupilot_aliases import ALIASES
from common.attitude import rotated
from tests.unit.autopilot.mavlink.rig import Rig, texts

POS, HEIGHT, VEL, YAW = 1, 2, 4, 8
UNKNOWN = (nan,) * 21
LOCAL_NED, MOCAP_NED, LOCAL_ENU, LOCAL_FRD, BODY_FRD = 1, 14, 4, 20, 12


def rig(used=15, **params):
    rig = Rig()
    for name, value in {"EKF2_EV_CTRL": used, **params}.items():
        rig.vehicle.params.set(name, value)
    rig.frame(3)
    return rig


def vision(client, **changes):
    fields = {
        "usec": 0, "x": 1.0, "y": 2.0, "z": -3.0, "roll": 0.0, "pitch": 0.0, "yaw": 0.5, "covariance": UNKNOWN,
        "reset_counter": 0,
    }  # fmt: skip
    client.send("VISION_POSITION_ESTIMATE", **(fields | changes))


def odometry(client, **changes):
    fields = {
        "time_usec": 0, "frame_id": LOCAL_NED, "child_frame_id": BODY_FRD, "x": 1.0, "y": 2.0, "z": -3.0,
        "q": (1.0, 0.0, 0.0, 0.0), "vx": 1.0, "vy": 0.0, "vz": 0.0, "rollspeed": nan, "pitchspeed": nan,
        "yawspeed": nan, "pose_covariance": UNKNOWN, "velocity_covariance": UNKNOWN, "reset_counter": 0,
        "estimator_type": 0, "quality": 0,
    }  # fmt: skip
    client.send("ODOMETRY", **(fields | changes))


def turned_about_down(angle):
    return (cos(0.5 * angle), 0.0, 0.0, sin(0.5 * angle))


def taken(rig):
    """The only sample that the next frame brings."""
    said = texts(rig.frame())
    (sample,) = rig.vehicle.external.waiting
    assert not said, said
    rig.vehicle.external.write()
    row = rig.vehicle.external_row[0]
    assert row["time_us"] == sample.time_us
    return sample


def refused(rig):
    """The text with which the next frame refuses."""
    (said,) = texts(rig.frame())
    assert not rig.vehicle.external.waiting
    return said


def test_vision_position_reaches_the_row():
    r = rig()
    vision(r.client)
    taken(r)
    row = r.vehicle.external_row[0]
    assert row["holds"] == POS | HEIGHT | YAW
    assert row["pos_ned"].tolist() == [1.0, 2.0, -3.0]
    assert row["yaw"] == pytest.approx(0.5)
    assert (row["pos_h_std"], row["pos_v_std"], row["yaw_std"]) == pytest.approx((0.1, 0.1, 0.1))


def test_global_vision_is_taken_alike():
    r = rig()
    fields = {"usec": 0, "x": 1.0, "y": 2.0, "z": -3.0, "roll": 0.0, "pitch": 0.0, "yaw": 0.5}
    r.client.send("GLOBAL_VISION_POSITION_ESTIMATE", **fields, covariance=UNKNOWN, reset_counter=0)
    assert taken(r).pos_ned == (1.0, 2.0, -3.0)


def test_speed_is_taken_as_ned():
    r = rig()
    covariance = (0.04, 0.0, 0.0, 0.0, 0.09, 0.0, 0.0, 0.0, 0.01)
    r.client.send("VISION_SPEED_ESTIMATE", usec=0, x=1.0, y=2.0, z=3.0, covariance=covariance, reset_counter=0)
    sample = taken(r)
    assert (sample.holds, sample.vel_ned) == (VEL, (1.0, 2.0, 3.0))
    assert sample.vel_std == pytest.approx(0.3)


def test_mocap_quaternion_is_read_in_its_order():
    r = rig()
    r.client.send("ATT_POS_MOCAP", time_usec=0, q=turned_about_down(1.2), x=1.0, y=2.0, z=3.0, covariance=UNKNOWN)
    sample = taken(r)
    assert sample.holds == POS | HEIGHT | YAW
    assert sample.yaw == pytest.approx(1.2)


def test_body_velocity_is_turned_by_the_attitude_that_is_told():
    r = rig()
    odometry(r.client, q=turned_about_down(0.5 * pi), vx=2.0, vy=0.0, vz=-1.0)
    sample = taken(r)
    assert sample.holds == POS | HEIGHT | VEL | YAW
    assert sample.vel_ned == pytest.approx((0.0, 2.0, -1.0), abs=1e-6)


def test_velocity_without_attitude_is_left_out():
    r = rig()
    odometry(r.client, q=(nan,) * 4)
    assert taken(r).holds == POS | HEIGHT


def test_velocity_in_the_frame_of_the_position_is_not_turned():
    r = rig()
    odometry(r.client, q=turned_about_down(1.0), child_frame_id=LOCAL_NED, vx=1.0, vy=2.0, vz=3.0)
    assert taken(r).vel_ned == (1.0, 2.0, 3.0)


def test_frame_without_north_is_turned_to_the_heading_of_the_vehicle_once():
    r = rig(used=POS | HEIGHT | VEL)  # the rig's heading is 1.2 rad
    odometry(r.client, frame_id=LOCAL_FRD, q=turned_about_down(0.2), x=1.0, y=0.0, z=0.0)
    first = taken(r)
    assert first.yaw == pytest.approx(1.2)
    assert first.pos_ned == pytest.approx((cos(1.0), sin(1.0), 0.0))
    assert atan2(first.vel_ned[1], first.vel_ned[0]) == pytest.approx(1.2)
    odometry(r.client, frame_id=LOCAL_FRD, q=turned_about_down(0.9), x=2.0, y=0.0, z=0.0)
    assert taken(r).pos_ned == pytest.approx((2.0 * cos(1.0), 2.0 * sin(1.0), 0.0))
    odometry(r.client, frame_id=LOCAL_FRD, q=turned_about_down(1.2), x=2.0, y=0.0, z=0.0, reset_counter=1)
    assert taken(r).pos_ned == pytest.approx((2.0, 0.0, 0.0), abs=1e-6)  # begun anew, with the heading of that moment


def test_frame_without_north_is_north_if_its_heading_is_used():
    r = rig()
    odometry(r.client, frame_id=LOCAL_FRD, q=turned_about_down(0.2))
    sample = taken(r)
    assert (sample.pos_ned, sample.yaw) == ((1.0, 2.0, -3.0), pytest.approx(0.2))


def test_told_deviations_count_but_none_below_the_parameters():
    r = rig()
    covariance = [0.0] * 21
    covariance[0], covariance[6], covariance[11], covariance[20] = 0.25, 0.36, 1e-6, 0.04
    vision(r.client, covariance=covariance)
    sample = taken(r)
    assert (sample.pos_h_std, sample.pos_v_std, sample.yaw_std) == pytest.approx((0.6, 0.1, 0.2))
    r.vehicle.params.set("EKF2_EV_NOISE_MD", 1)
    vision(r.client, covariance=covariance)
    assert taken(r).pos_h_std == pytest.approx(0.1)


def test_part_with_infinite_variance_is_left_out():
    r = rig()
    covariance = [0.01] * 21
    covariance[0] = inf
    vision(r.client, covariance=covariance)
    assert taken(r).holds == HEIGHT | YAW


def test_reset_counter_counts_changes_alone():
    r = rig()
    counts = []
    for counter in (7, 7, 8, 8, 255, 0):
        vision(r.client, reset_counter=counter)
        counts.append(taken(r).reset_count)
    assert counts == [0, 0, 1, 1, 2, 3]


def test_time_stamp_counts_if_it_is_on_the_vehicles_clock():
    r = rig(EKF2_EV_DELAY=30.0)
    vision(r.client, usec=r.time_us - 80_000)
    assert taken(r).time_us == r.time_us - 20_000 - 80_000 - 30_000
    for usec in (0, 10**15, r.time_us - 10_000_000 if r.time_us > 10_000_000 else 1):
        vision(r.client, usec=usec)
        assert taken(r).time_us == r.time_us - 30_000


def test_no_two_samples_have_the_same_time_and_the_newest_of_a_kind_counts():
    r = rig()
    for x in (1.0, 2.0, 3.0):
        vision(r.client, x=x)
        r.client.send("VISION_SPEED_ESTIMATE", usec=0, x=x, y=0.0, z=0.0, covariance=(nan,) * 9, reset_counter=0)
    r.frame()
    position, speed = r.vehicle.external.waiting
    assert (position.pos_ned[0], speed.vel_ned[0]) == (3.0, 3.0)
    assert position.time_us != speed.time_us


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"x": inf}, "the position is not one"),
        ({"z": 1e9}, "the position is not one"),
        ({"vx": inf}, "the velocity is not one"),
        ({"q": (2.0, 0.0, 0.0, 0.0)}, "the attitude is not a quaternion of length 1"),
        ({"frame_id": LOCAL_ENU}, "frame 4 is not supported"),
        ({"child_frame_id": LOCAL_ENU}, "velocity in frame 4 is not supported"),
        ({"quality": -1}, "the odometry has failed"),
        ({"quality": 10}, "quality 10 %, 40 % needed"),
    ],
)
def test_bad_odometry_is_refused_once(changes, reason):
    r = rig(EKF2_EV_QMIN=40)
    odometry(r.client, **({"quality": 50} | changes))
    assert refused(r) == f"External position: {reason}"
    odometry(r.client, **({"quality": 50} | changes))
    assert not texts(r.frame())


def test_nothing_is_used_unless_it_is_asked_for():
    r = rig(used=0)
    vision(r.client)
    assert refused(r) == "External position: not used while EKF2_EV_CTRL is 0"


def test_odometry_of_another_vehicle_is_its_own():
    r = rig()
    r.second_client.sysid, r.second_client.compid = 2, 1
    odometry(r.second_client)
    assert not texts(r.frame())
    assert not r.vehicle.external.waiting


def test_flood_of_positions_is_bounded():
    r = rig()
    for i in range(200):
        vision(r.client, x=nan if i % 2 else 1.0, z=nan if i % 3 else 1.0, yaw=nan if i % 5 else 1.0)
    r.frame(20)
    assert len(r.vehicle.external.waiting) <= 4


def test_ardupilots_switch_asks_for_all_but_the_heading():
    (switch,) = (alias for alias in ALIASES if alias.name == "VISO_TYPE")
    assert (switch.ours(0), switch.ours(1)) == (0, POS | HEIGHT | VEL)
    assert [switch.shown(used) for used in (0, 1, 7, 15)] == [0, 1, 1, 1]


def test_rotation_is_the_active_one():
    half = 0.25 * pi
    assert rotated((0.0, 0.0, sin(half), cos(half)), (1.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0))
    assert rotated((sin(half), 0.0, 0.0, cos(half)), (0.0, 1.0, 0.0)) == pytest.approx((0.0, 0.0, 1.0))
