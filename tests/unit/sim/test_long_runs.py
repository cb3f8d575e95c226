"""Time after 99 days: 2 to the power of 31 ticks, which a 32-bit count does not outlive."""

import numpy as np

from common.kernels import FRAME_TICKS, TICK_US
from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig

WRAP = 2**31
SENSORS = ("imu", "baro", "mag", "range", "gnss", "battery")


def flight_at(tick):
    """A flight that has been up for so many ticks, a multiple of a frame's."""
    flight = Flight(FlightConfig(world=WorldConfig(size_m=64.0, trees_per_ha=0.0), wind_m_s=4.0))
    flight.rig.arrays.tick.numpy()[:] = tick
    for count in ("imu_head", "imu_tail"):  # a sample in each tick
        flight.rig.arrays.autopilot.ekf.rows.numpy()[count] = tick
    flight.time_us = tick * TICK_US
    return flight


def test_a_flight_over_the_end_of_32_bits_is_flown_as_any_other():
    start = WRAP - 1500 * FRAME_TICKS - WRAP % FRAME_TICKS  # 30 s before
    flight = flight_at(start)
    times_us = {name: set() for name in SENSORS}

    async def fly(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(5.0)
        await drone.sleep(20.0)
        await drone.goto_ned(10.0, 5.0, -6.0)
        await drone.land()

    running = flight.drone.start(fly(flight.drone))

    def note(flight):
        samples = flight.rig.arrays.sensors.numpy()["samples"][0]
        for name, times in times_us.items():
            times.add(int(samples[name]["time_us"]))
        estimator = flight.rig.arrays.autopilot.ekf.rows.numpy()[0]
        assert int(estimator["estimate"]["time_us"]) == flight.time_us
        assert flight.time_us - int(estimator["horizon_time_us"]) < 200_000 or flight.time_us < start * TICK_US + 1e6

    flight.run(lambda f: running.is_done or f.time_us > (start * TICK_US) + 120_000_000, on_frame=note)
    end_us = flight.time_us
    history = flight.close()
    assert running.error is None
    assert running.is_done
    assert start * TICK_US < WRAP * TICK_US < end_us
    assert not history.is_armed[-1]
    error = history.pos_ned_est[history.is_armed] - history.pos_ned_true[history.is_armed]
    assert np.abs(error[500:]).max() < 3.0
    for name, times in times_us.items():
        every = np.array(sorted(times - {0}))
        apart = np.diff(every[every <= WRAP * TICK_US]), np.diff(every[every > WRAP * TICK_US])
        assert np.median(apart[0]) == np.median(apart[1]), name
        assert np.diff(every).max() <= 2.0 * np.median(apart[0]), name  # at the end of 32 bits one comes early or late
