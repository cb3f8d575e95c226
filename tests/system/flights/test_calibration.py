"""Calibrations over MAVLink in lockstep: the simulator's hands turn the vehicle, the sensors' true errors are known."""

import numpy as np
import pytest

from mission.client import CommandRefused
from mission.flight import Flight, FlightConfig
from sim.faults import set_fault
from sim.world.world import WorldConfig

CALIBRATE, REBOOT = 241, 246
GYRO, MAG, ACCEL, LEVEL = (1, 0, 0, 0, 0), (0, 1, 0, 0, 0), (0, 0, 0, 0, 1), (0, 0, 0, 0, 2)


def make_flight(**params):
    return Flight(FlightConfig(seed=3, world=WorldConfig(trees_per_ha=0.0), parameters=params))


async def start(drone, kind):
    await drone.command(CALIBRATE, *map(float, kind), 0.0, 0.0, name="calibrate")


async def finish(drone, kind):
    """Runs a calibration and returns its texts."""
    first = len(drone.texts)
    await start(drone, kind)
    ends = ("[cal] calibration done", "[cal] calibration failed", "[cal] calibration cancelled")
    await drone.until(lambda: any(text.startswith(ends) for text in drone.texts[first:]), 120.0, "an end")
    return drone.texts[first:]


def run(flight, script):
    running = flight.fly(script, seconds=600.0)
    if running.error is not None:
        raise running.error
    assert running.is_done
    return running.result


def offsets(flight, sensor):
    return [flight.params[f"CAL_{sensor}0_{axis}OFF"] for axis in "XYZ"]


def true_errors(flight, sensor, *fields):
    state = flight.rig.arrays.sensors.numpy()[0][sensor]
    return np.sum([state[field] for field in fields], axis=0)


@pytest.mark.parametrize(("kind", "name"), [(GYRO, "gyro"), (ACCEL, "accel"), (MAG, "mag"), (LEVEL, "level")], ids=str)
def test_calibration_tells_its_progress_in_the_words_of_ground_stations(kind, name):
    flight = make_flight()

    async def script(drone):
        await drone.wait_ready()
        texts = await finish(drone, kind)
        await drone.wait_ready()
        return texts

    texts = run(flight, script)
    assert texts[0] == f"[cal] calibration started: 2 {name}"
    assert texts[1] == "[cal] progress <0>"
    assert texts[-2:] == ["[cal] progress <100>", f"[cal] calibration done: {name}"]
    if kind in (ACCEL, MAG):
        for side in ("down", "left", "right", "front", "back", "up"):
            assert f"[cal] {side} orientation detected" in texts
            assert f"[cal] {side} side done, rotate to a different side" in texts


def test_calibrations_find_the_errors_of_the_sensors_and_the_vehicle_flies_with_them():
    flight = make_flight()

    async def script(drone):
        await drone.wait_ready()
        for kind in (GYRO, ACCEL, MAG):
            await finish(drone, kind)
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(5.0)
        await drone.land()

    run(flight, script)
    gyro = true_errors(flight, "imu", "gyro_bias_frd", "gyro_drift_frd")
    accel = true_errors(flight, "imu", "accel_bias_frd", "accel_drift_frd")
    assert offsets(flight, "GYRO") == pytest.approx(gyro, abs=1e-3)
    assert offsets(flight, "ACC") == pytest.approx(accel, abs=0.01)
    assert offsets(flight, "MAG") == pytest.approx(true_errors(flight, "mag", "hard_iron_frd"), abs=5e-4)
    estimate = flight.controller.state.estimate
    assert np.linalg.norm(estimate.gyro_bias_frd) < 2e-3
    assert np.linalg.norm(estimate.accel_bias_frd) < 0.04


def test_large_errors_of_a_sensor_are_found_and_taken_off():
    flight = make_flight()

    async def script(drone):
        set_fault(flight.rig.arrays.faults.numpy()[0], "gyro", "biased", 0.1)
        set_fault(flight.rig.arrays.faults.numpy()[0], "mag", "biased", 0.4)
        await drone.sleep(5.0)
        await finish(drone, GYRO)
        await finish(drone, MAG)
        await drone.command(REBOOT, 1.0, name="reboot")  # the estimator had settled on the wrong field
        await drone.sleep(5.0)
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(5.0)
        await drone.land()

    run(flight, script)
    assert offsets(flight, "GYRO") == pytest.approx([0.1] * 3, abs=0.01)
    assert offsets(flight, "MAG") == pytest.approx([0.4] * 3, abs=0.02)


def test_level_calibration_turns_the_board_by_what_the_accelerometer_says():
    flight = make_flight()

    async def script(drone):
        await drone.wait_ready()
        await finish(drone, LEVEL)
        return drone.texts

    run(flight, script)
    x, y, _ = true_errors(flight, "imu", "accel_bias_frd", "accel_drift_frd")
    assert flight.params["SENS_BOARD_X_OFF"] == pytest.approx(np.degrees(y / 9.81), abs=0.03)
    assert flight.params["SENS_BOARD_Y_OFF"] == pytest.approx(-np.degrees(x / 9.81), abs=0.03)


def test_moved_or_dead_sensor_fails_a_calibration_and_changes_nothing():
    flight = make_flight()

    async def script(drone):
        await drone.wait_ready()
        faults = flight.rig.arrays.faults.numpy()[0]
        set_fault(faults, "gyro", "biased", 0.3)
        moved = await finish(drone, GYRO)
        set_fault(faults, "gyro", "off")
        dead = await finish(drone, GYRO)
        return moved[-1], dead[-1]

    assert run(flight, script) == (
        "[cal] calibration failed: the vehicle moved",
        "[cal] calibration failed: reading sensor",
    )
    assert offsets(flight, "GYRO") == [0.0, 0.0, 0.0]


def test_cancelled_calibration_puts_the_vehicle_down_and_keeps_the_old_offsets():
    flight = make_flight(CAL_ACC0_XOFF=0.01)

    async def script(drone):
        await drone.wait_ready()
        await start(drone, ACCEL)
        await drone.sleep(6.0)
        assert "a calibration is running" in flight.controller.check_arming()
        with pytest.raises(CommandRefused, match="another calibration is running"):
            await start(drone, GYRO)
        await start(drone, (0, 0, 0, 0, 0))
        await start(drone, (0, 0, 0, 0, 0))  # clients send it twice
        await drone.sleep(2.0)
        return drone.texts

    texts = run(flight, script)
    assert texts.count("[cal] calibration cancelled") == 1
    assert offsets(flight, "ACC") == [pytest.approx(0.01), 0.0, 0.0]
    assert not flight.rig.rows["body"]["is_held"][0]


def test_armed_vehicle_is_not_calibrated():
    flight = make_flight()

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        with pytest.raises(CommandRefused, match="armed"):
            await start(drone, GYRO)

    run(flight, script)
