"""Messages that ArduPilot's clients look for, and those of the machine around the vehicle: its date, its truth."""

from math import isnan
from typing import Any

import pytest

from autopilot.interface.platform import Host
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.wire.codec import message_id
from autopilot.ports import POSITION_VALID, TERRAIN_VALID
from common.clock import SIMULATED_EPOCH_US
from sim.truth import Truth
from tests.unit.autopilot.mavlink.rig import HOME, AskedVehicle, Rig, record

STREAMED = (
    *("RAW_IMU", "SCALED_IMU2", "AHRS", "AHRS2", "POWER_STATUS", "MEMINFO", "HWSTATUS", "MCU_STATUS", "SIMSTATE"),
    *("TERRAIN_REPORT", "ESC_TELEMETRY_1_TO_4", "SYSTEM_TIME"),
)
TRUTHS = ("SIMSTATE", "SIM_STATE", "HIL_STATE_QUATERNION")


def asked(rig: Rig, name: str) -> Any:
    """The message, asked for once by REQUEST_MESSAGE."""
    rig.frame(3)
    for msg_id in rig.server._endpoint.telemetry.builders:
        rig.server._endpoint.channels[0].schedule.set_interval(msg_id, -1)
    rig.client.command(512, message_id(name))
    return rig.only(name)


@pytest.mark.parametrize("name", STREAMED)
def test_streams_as_ardupilot_does(name):
    assert len(Rig(dialect=ARDUPILOT).all(name, 150)) >= 3


@pytest.mark.parametrize("name", [*STREAMED, "SIM_STATE"])
def test_comes_at_the_interval_asked_for(name):
    rig = Rig(dialect=ARDUPILOT)
    assert rig.ack(511, message_id(name), 100_000.0).result == 0
    assert len(rig.all(name, 100)) == pytest.approx(20, abs=1)


@pytest.mark.parametrize("name", sorted(set(STREAMED) - {"SYSTEM_TIME"}))
def test_px4_vehicles_do_not_stream_it(name):
    assert not Rig().all(name, 150)


def test_the_old_request_for_raw_sensors_brings_raw_imu_and_no_other_message_of_the_imu():
    rig = Rig(dialect=ARDUPILOT)
    rig.frame(100)
    rig.client.send("REQUEST_DATA_STREAM", req_stream_id=1, req_message_rate=10, start_stop=1)
    names = [message.name for message in rig.frame(51)]
    assert min(names.count("RAW_IMU"), names.count("SCALED_IMU2")) >= 10
    assert not {"HIGHRES_IMU", "SCALED_IMU"} & set(names)


def test_raw_imu_and_the_second_imu_say_the_same():
    rig = Rig(dialect=ARDUPILOT)
    raw, second = asked(rig, "RAW_IMU"), asked(rig, "SCALED_IMU2")
    assert (raw.zacc, raw.xmag) == (second.zacc, second.xmag) == (-1000, 200)


def test_ahrs_tells_the_bias_and_the_deviations():
    rig = Rig(dialect=ARDUPILOT)
    estimate = rig.vehicle.state.estimate
    rig.update(estimate=estimate._replace(gyro_bias_frd=(0.01, 0.02, 0.03), tilt_std=0.04, yaw_std=0.05))
    assert tuple(asked(rig, "AHRS")) == pytest.approx((0.01, 0.02, 0.03, 0.0, 0.0, 0.04, 0.05))


def test_second_attitude_is_the_only_one():
    ahrs2 = asked(Rig(dialect=ARDUPILOT), "AHRS2")
    assert (ahrs2.roll, ahrs2.pitch, ahrs2.yaw) == pytest.approx((0.05, -0.02, 1.2))
    assert ahrs2.altitude == pytest.approx(HOME.alt_m + 30.0, abs=0.1)
    assert ahrs2.lat == pytest.approx(HOME.lat_deg * 1e7, abs=2000)


def test_second_attitude_without_a_position_tells_no_place():
    rig = Rig(dialect=ARDUPILOT)
    estimate = rig.vehicle.state.estimate
    rig.update(estimate=estimate._replace(flags=estimate.flags & ~POSITION_VALID))
    assert asked(rig, "AHRS2").lat == 0


def test_terrain_is_told_while_it_is_measured():
    rig = Rig(dialect=ARDUPILOT)
    terrain = asked(rig, "TERRAIN_REPORT")
    assert (terrain.terrain_height, terrain.current_height) == pytest.approx((HOME.alt_m + 1.0, 29.0))
    estimate = rig.vehicle.state.estimate
    rig.update(estimate=estimate._replace(flags=estimate.flags & ~TERRAIN_VALID))
    assert rig.ack(512, message_id("TERRAIN_REPORT")).result == 1


def test_speed_controllers_tell_revolutions_and_voltage():
    rig = Rig(dialect=ARDUPILOT)
    esc = asked(rig, "ESC_TELEMETRY_1_TO_4")
    assert esc.rpm == (4775, 4870, 4966, 5061)
    assert esc.voltage == (1580,) * 4
    assert rig.ack(512, message_id("ESC_TELEMETRY_5_TO_8")).result == 1
    rig.update(motor_count=6)
    assert asked(rig, "ESC_TELEMETRY_5_TO_8").voltage == (1580, 1580, 0, 0)


def test_truth_comes_from_the_host():
    vehicle = AskedVehicle()
    truth = record(
        Truth,
        "Truth",
        q_ned_from_frd=(0.0, 0.0, 0.6, 0.8),
        pos_ned=(100.0, 0.0, -5.0),
        vel_ned=(1.0, 2.0, 3.0),
        omega_frd=(0.1, 0.2, 0.3),
        accel_frd=(0.0, 0.0, -9.5),
    )
    vehicle.host.read_truth = lambda: truth
    rig = Rig(dialect=ARDUPILOT, vehicle=vehicle)
    simstate = asked(rig, "SIMSTATE")
    assert (simstate.yaw, simstate.zacc, simstate.zgyro) == pytest.approx((1.287, -9.5, 0.3), abs=1e-3)
    assert (simstate.lat - HOME.lat_deg * 1e7) * 0.011119 == pytest.approx(100.0, abs=0.5)
    whole = asked(rig, "SIM_STATE")
    assert (whole.q1, whole.alt, whole.vd) == pytest.approx((0.8, HOME.alt_m + 5.0, 3.0), abs=0.01)


@pytest.mark.parametrize("name", TRUTHS)
def test_without_a_simulator_there_is_no_truth(name):
    vehicle = AskedVehicle()
    vehicle.host = Host()
    rig = Rig(dialect=ARDUPILOT, vehicle=vehicle)
    assert rig.ack(512, message_id(name)).result == 1


def test_truth_is_nowhere_in_what_the_flight_controller_reads():
    assert not [name for name in type(AskedVehicle().state).__slots__ if "truth" in name]


def test_date_goes_on_from_that_of_power_on():
    rig = Rig()
    assert asked(rig, "SYSTEM_TIME").time_unix_usec == SIMULATED_EPOCH_US + rig.time_us
    rig.vehicle.host.boot_unix_us = 1_800_000_000_000_000
    time = asked(rig, "SYSTEM_TIME")
    assert time.time_unix_usec == 1_800_000_000_000_000 + rig.time_us
    assert time.time_boot_ms == rig.time_us // 1000


def test_figures_of_the_board_are_numbers():
    rig = Rig(dialect=ARDUPILOT)
    assert asked(rig, "POWER_STATUS").Vcc == asked(rig, "HWSTATUS").Vcc == 5000
    assert asked(rig, "MEMINFO").freemem32 > 0
    assert asked(rig, "MCU_STATUS").MCU_temperature == 2150
    assert not any(isnan(value) for value in asked(rig, "AHRS"))
