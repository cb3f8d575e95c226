"""What a driving companion makes of messages is what the task shows of the same state."""

import numpy as np
import pytest

from autopilot.mavlink.client_end import ClientEnd
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from common.range_sectors import GROUND_RING
from policies.companion.ranges import Ranges
from policies.companion.skills.driving import DriveObserver, how_far_off, is_taken
from policies.companion.telemetry import Own
from policies.companion.vehicle_link import VehicleLink
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.drive.observe import FRAME, OWN_SIZE

COUNT = 6
CENTIMETRE_NEAR = 4e-3  # a range is in half a centimetre of the simulator's: so much at 0.2 m, less farther off


@pytest.fixture(scope="module")
def task():
    """After some decisions that drive about."""
    task = build_task("Drive", COUNT, task_settings("Drive", {"preset": "park", "has_estimator": True}))
    task.reset(5)
    for _ in range(12):
        task.buffers.continuous.assign(np.array([[0.9 * (-1) ** i, 0.2 * (i - 2)] for i in range(COUNT)], np.float32))
        task.step()
    return task


def heard(estimate, ranges_m):
    """What a companion has after the messages of one state."""
    vehicle_end, our_end = memory_pair(LinkRole.ONBOARD)
    vehicle, autopilot = VehicleLink(our_end), ClientEnd(vehicle_end, 1, 1)
    ranges = Ranges(vehicle, GROUND_RING)
    x, y, z, w = (float(value) for value in estimate["q_ned_from_frd"])
    roll, pitch, yaw = (float(value) for value in estimate["omega_frd"])
    autopilot.send(
        "ATTITUDE_QUATERNION", time_boot_ms=1, q1=w, q2=x, q3=y, q4=z, rollspeed=roll, pitchspeed=pitch, yawspeed=yaw
    )
    place = dict(zip(("x", "y", "z"), map(float, estimate["pos_ned"]), strict=True))
    speed = dict(zip(("vx", "vy", "vz"), map(float, estimate["vel_ned"]), strict=True))
    autopilot.send("LOCAL_POSITION_NED", time_boot_ms=1, **place, **speed)
    centimetres = [3001 if range_m >= GROUND_RING.range_m else round(100.0 * float(range_m)) for range_m in ranges_m]
    autopilot.send(
        "OBSTACLE_DISTANCE",
        time_usec=1,
        distances=tuple(centimetres),
        increment=5,
        min_distance=30,
        max_distance=3000,
        increment_f=5.0,
        angle_offset=0.0,
        frame=12,
    )
    vehicle.receive(1000)
    return vehicle.own, ranges.ranges_m


@pytest.mark.parametrize("i", range(COUNT))
def test_the_observation_of_messages_is_the_tasks_of_the_same_state(task, i):
    shown = task.buffers.observations.numpy()[i][-len(FRAME) :]
    own, ranges_m = heard(task.rig.rows["autopilot.ekf.rows"][i]["estimate"], task.driving.ranges_m.numpy()[i])
    goal = tuple(float(value) for value in task.driving.goals.numpy()[i])
    action = task.driving.actions.numpy()[i]
    vector = DriveObserver(stack=1).vector(own, goal, ranges_m, action)
    first_range = len(FRAME) - 36
    assert np.array_equal(vector[:first_range], shown[:first_range])  # to the bit
    assert vector[first_range:] == pytest.approx(shown[first_range:], abs=CENTIMETRE_NEAR)
    assert np.abs(shown[:OWN_SIZE]).max() > 0.1


def test_what_stands_in_the_goal_is_seen_and_what_stands_beside_it_is_not():
    own, ranges_m = Own(pos_ned=(0.0, 0.0, 0.0)), np.full(72, 10.0, np.float32)
    ranges_m[0] = 2.0  # a wall's face 2 m ahead
    assert is_taken((2.2, 0.0, 0.0), own, ranges_m)
    assert not is_taken((2.4, 0.0, 0.0), own, ranges_m)
    assert not is_taken((2.0, 0.2, 0.0), own, ranges_m)
    assert not is_taken((10.0, 0.0, 0.0), own, ranges_m)  # no return


def test_how_far_off_counts_place_and_heading():
    own = Own(pos_ned=(0.0, 0.0, 0.0), q_ned_from_frd=(0.0, 0.0, 0.0, 1.0))
    assert how_far_off((0.1, 0.0, 0.0), own) == pytest.approx(0.4)
    assert how_far_off((0.1, 0.0, 2.0 * np.pi + 0.14), own) == pytest.approx(1.0)
