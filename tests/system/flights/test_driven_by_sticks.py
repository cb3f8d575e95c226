"""A rover driven by a pilot's sticks, over MAVLink in lockstep: y steers, z drives, 500 of it stands."""

import numpy as np
import pytest

from mission.drive_benchmarks import OPEN_HILLS
from mission.flight import Flight, FlightConfig

STICKS_HZ = 20
SET_MODE, CUSTOM = 176, 1.0
MANUAL, POSCTL, ACRO, STABILIZED = 1.0, 3.0, 5.0, 7.0
LIMIT = {"RO_SPEED_LIM": 4.0}


def driven(mode, *moves, airframe="rover", parameters=LIMIT):
    """Arms in a mode and moves the sticks: (seconds, throttle -1..1, steering -1..1) each; the history at 50 Hz."""
    flight = Flight(FlightConfig(airframe=airframe, world=OPEN_HILLS, noise=0.0, parameters=parameters))

    async def pilot(drone):
        def hold(throttle, steering):
            drone.send("MANUAL_CONTROL", target=1, x=0, y=round(1000 * steering), z=round(500 + 500 * throttle), r=0,
                       buttons=0)  # fmt: skip

        async def keep(seconds, throttle, steering):
            for _ in range(round(seconds * STICKS_HZ)):
                hold(throttle, steering)
                await drone.sleep(1.0 / STICKS_HZ)

        await drone.wait_ready()
        await keep(0.5, 0.0, 0.0)
        await drone.command(SET_MODE, CUSTOM, mode)
        await drone.arm()
        for move in moves:
            await keep(*move)

    running = flight.fly(pilot, seconds=90.0)
    history = flight.close()
    if running.error is not None:
        raise running.error
    return history


def yaw_deg(q):
    x, y, z, w = (float(element) for element in q)
    return np.degrees(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def nose_speed(history, frame=-1):
    yaw = np.radians(yaw_deg(history.q_true[frame]))
    return float(history.vel_ned_true[frame, 0] * np.cos(yaw) + history.vel_ned_true[frame, 1] * np.sin(yaw))


def turned_deg(history, seconds):
    """By how much the heading has changed over the last seconds, to the right."""
    before, now = yaw_deg(history.q_true[-1 - round(50 * seconds)]), yaw_deg(history.q_true[-1])
    return (now - before + 180.0) % 360.0 - 180.0


def test_manual_gives_the_motor_and_the_steering_what_the_sticks_say():
    history = driven(MANUAL, (3.0, 0.4, 0.0), (1.0, 0.4, 0.5))
    assert nose_speed(history) == pytest.approx(0.4 * 8.0, rel=0.1)
    assert turned_deg(history, 0.5) > 15.0


def test_manual_drives_backwards_with_the_throttle_below_its_middle():
    assert nose_speed(driven(MANUAL, (3.0, -0.3, 0.0))) == pytest.approx(-0.3 * 8.0, rel=0.1)


def test_position_keeps_the_speed_of_the_stick_and_the_heading_while_it_is_in_the_middle():
    history = driven(POSCTL, (3.0, 0.55, 0.6), (8.0, 0.55, 0.0))
    stick = (0.55 - 0.1) / 0.9  # behind the dead zone
    assert nose_speed(history) == pytest.approx(4.0 * stick, abs=0.1)
    assert abs(turned_deg(history, 4.0)) < 1.0


@pytest.mark.parametrize("mode", [ACRO, STABILIZED, POSCTL])
def test_steering_right_turns_right_forward_and_left_backwards(mode):
    assert turned_deg(driven(mode, (3.0, 0.4, 0.0), (1.5, 0.4, 0.4)), 1.0) > 5.0
    assert turned_deg(driven(mode, (3.0, -0.4, 0.0), (1.5, -0.4, 0.4)), 1.0) < -5.0


def test_sticks_in_the_middle_stop_it():
    history = driven(POSCTL, (3.0, 0.6, 0.0), (4.0, 0.0, 0.0))
    assert abs(nose_speed(history)) < 0.05


def test_a_skid_steer_rover_turns_on_the_spot_by_its_sticks():
    history = driven(MANUAL, (3.0, 0.0, 0.4), airframe="rover-skid", parameters={})
    assert turned_deg(history, 1.0) > 15.0
    assert np.hypot(*history.vel_ned_true[-1, :2]) < 0.1
