"""Arming: every check gives its reason; automatic disarming; home."""

from math import nan

import pytest

from autopilot.commander.arming import arming_reasons
from autopilot.interface.client_requests import CalibrationKind, ChangeMode, SetHome, TakeOff
from autopilot.interface.vehicle_state import LandedState, Mode, Severity, Verdict
from autopilot.ports import (
    HEIGHT_VALID,
    MAG_DISTURBED,
    MAG_FAULTY,
    POSITION_VALID,
    TILT_ALIGNED,
    VELOCITY_VALID,
    YAW_ALIGNED,
)
from autopilot.vehicles.multirotor.vehicle import MULTIROTOR
from tests.unit.autopilot.kinematic import ALL_VALID, ORIGIN, Kinematic, geo


def estimate_flag(bit):
    def fail(rig):
        rig.flags = ALL_VALID & ~bit

    return fail


def raise_flag(bit):
    def fail(rig):
        rig.flags = ALL_VALID | bit

    return fail


def stop_sensor(name):
    def fail(rig):
        rig.run(3.0)
        publish = rig._publish

        def stale():
            publish()
            rig.samples[name]["time_us"] = 1_000_000

        rig._publish = stale

    return fail


def set_estimate(name, value):
    def fail(rig):
        publish = rig._publish

        def changed():
            publish()
            rig.estimate[name] = value

        rig._publish = changed

    return fail


def set_gnss(name, value):
    def fail(rig):
        publish = rig._publish

        def changed():
            publish()
            rig.samples["gnss"][name] = value

        rig._publish = changed

    return fail


def low_battery(rig):
    rig.battery_v = 14.2


@pytest.mark.parametrize(
    ("fail", "reason"),
    [
        (estimate_flag(TILT_ALIGNED), "attitude not aligned"),
        (estimate_flag(YAW_ALIGNED), "heading not aligned"),
        (estimate_flag(HEIGHT_VALID), "no valid height"),
        (estimate_flag(POSITION_VALID), "no valid position"),
        (estimate_flag(VELOCITY_VALID), "no valid velocity"),
        (stop_sensor("imu"), "IMU: no data"),
        (stop_sensor("baro"), "barometer: no data"),
        (stop_sensor("mag"), "magnetometer: no data"),
        (raise_flag(MAG_FAULTY), "compass contradicts"),
        (stop_sensor("gnss"), "GNSS: no data"),
        (stop_sensor("battery"), "battery: no data"),
        (set_gnss("fix_type", 1), "no 3-D fix"),
        (set_gnss("satellites", 4), "4 satellites, 6 needed"),
        (set_estimate("pos_h_std", 7.0), "horizontal accuracy 7.0 m"),
        (set_estimate("pos_h_std", nan), "horizontal accuracy"),
        (set_estimate("pos_v_std", 9.0), "vertical accuracy 9.0 m"),
        (set_estimate("omega_frd", (0.0, 0.5, 0.0)), "moving"),
        (set_estimate("q_ned_from_frd", (0.6, 0.0, 0.0, 0.8)), "not upright"),
        (set_estimate("gyro_bias_frd", (0.0, 0.1, 0.0)), "gyro bias"),
        (set_estimate("accel_bias_frd", (0.0, 0.0, 2.0)), "accelerometer bias"),
        (low_battery, "battery: "),
    ],
)
def test_each_failed_check_refuses_arming_with_its_reason(fail, reason):
    rig = Kinematic()
    fail(rig)
    rig.run(4.0)
    assert any(reason in text for text in rig.fc.check_arming())
    assert not rig.state.is_ready_to_arm
    reply = rig.fc.arm(force=False)
    assert reply.verdict is Verdict.TEMPORARILY_REJECTED
    assert reply.reason
    assert not rig.state.is_armed


def test_failing_checks_are_told_every_30_s():
    rig = Kinematic()
    rig.flags = 0
    rig.run(9.0)
    assert rig.recorder.texts == []
    rig.run(61.5)
    texts = [text for severity, text in rig.recorder.texts if severity is Severity.CRITICAL]
    assert len(texts) == 3
    assert texts[0].startswith("PreArm: ")


@pytest.mark.parametrize(("check", "may_arm", "is_reported"), [(0, True, False), (1, False, False), (2, True, True)])
def test_disturbed_compass_is_told_or_refused_by_com_arm_mag_str(check, may_arm, is_reported):
    rig = Kinematic(COM_ARM_MAG_STR=check)
    rig.flags = ALL_VALID | MAG_DISTURBED
    rig.run(4.0)
    assert (rig.fc.arm(force=False).verdict is Verdict.ACCEPTED) is may_arm
    assert rig.recorder.has_text("Strong magnetic interference") is is_reported


def test_heading_that_waits_for_a_disturbed_compass_names_the_reason():
    rig = Kinematic(COM_ARM_MAG_STR=0)
    rig.flags = (ALL_VALID & ~YAW_ALIGNED) | MAG_DISTURBED
    rig.run(4.0)
    assert rig.fc.check_arming()[0] == "strong magnetic interference"


def test_vehicle_without_compass_is_armed_in_modes_that_need_no_position():
    rig = Kinematic(EKF2_MAG_TYPE=5)
    rig.flags = TILT_ALIGNED | HEIGHT_VALID
    stop_sensor("mag")(rig)
    rig.run(4.0)
    needing, other = (arming_reasons(rig.state, rig.table, needs_position=needs) for needs in (True, False))
    assert not other
    assert "heading not aligned" in needing[0]


def test_only_what_flies_must_know_its_height_to_be_armed():
    rig = Kinematic()
    rig.flags = ALL_VALID & ~HEIGHT_VALID
    rig.run(4.0)
    assert arming_reasons(rig.state, rig.table, needs_position=True) == []
    flying = arming_reasons(rig.state, rig.table, MULTIROTOR.arming_checks, needs_position=True)
    assert flying == ["estimator: no valid height"]


def test_forced_arming_skips_the_checks():
    rig = Kinematic()
    rig.flags = 0
    rig.run(1.0)
    assert rig.fc.arm(force=True).verdict is Verdict.ACCEPTED


def test_armed_vehicle_that_does_not_take_off_disarms():
    rig = Kinematic().ready()
    rig.fc.arm(force=False)
    assert rig.disarmed() == pytest.approx(10.0, abs=0.1)
    assert rig.recorder.has_text("no take-off")


@pytest.mark.parametrize(("time_s", "expected_s"), [(2.0, 2.0), (5.0, 5.0)])
def test_landed_vehicle_disarms_after_the_set_time(time_s, expected_s):
    rig = Kinematic(COM_DISARM_LAND=time_s).flying()
    rig.fc.request(ChangeMode(Mode.LAND))
    rig.run_until(lambda: rig.state.landed_state is LandedState.ON_GROUND)
    assert rig.disarmed() == pytest.approx(expected_s, abs=0.1)


def test_negative_disarm_time_means_never():
    rig = Kinematic(COM_DISARM_PRFLT=-1.0).ready()
    rig.fc.arm(force=False)
    rig.run(30.0)
    assert rig.state.is_armed


def test_disarming_in_the_air_needs_force():
    rig = Kinematic().flying()
    reply = rig.fc.disarm(force=False)
    assert (reply.verdict, reply.reason) == (Verdict.TEMPORARILY_REJECTED, "in the air")
    assert rig.fc.disarm(force=True).verdict is Verdict.ACCEPTED
    assert any("not on the ground" in text for text in rig.fc.check_arming())
    rig.run(8.0)
    assert rig.state.landed_state is LandedState.ON_GROUND
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED


def test_takeoff_then_arm_and_arm_then_takeoff_both_fly():
    rig = Kinematic().ready()
    rig.fc.request(TakeOff())
    assert not rig.state.is_armed
    rig.fc.arm(force=False)
    rig.run_until(lambda: rig.state.mode is Mode.HOLD)

    rig = Kinematic().ready()
    rig.fc.arm(force=False)
    rig.run(0.5)
    rig.fc.request(TakeOff())
    rig.run_until(lambda: rig.state.mode is Mode.HOLD)
    assert rig.pos[2] == pytest.approx(-2.5, abs=0.31)


def test_home_is_set_at_boot_and_again_at_arming():
    rig = Kinematic()
    rig.flags = TILT_ALIGNED
    rig.run(1.0)
    assert rig.state.home is None
    rig.flags = ALL_VALID
    rig.run(0.1)
    assert rig.state.home.lat_deg == pytest.approx(ORIGIN.lat_deg, abs=1e-7)
    rig.pos[0] = 8.0
    rig.run(0.5)
    rig.fc.arm(force=False)
    assert rig.state.home_ned[0] == pytest.approx(8.0)
    assert rig.recorder.homes == 2


def test_home_given_by_a_client_survives_arming():
    rig = Kinematic().ready()
    lat, lon, _ = geo(30.0, 40.0)
    assert rig.fc.request(SetHome(lat, lon, 490.0)).verdict is Verdict.ACCEPTED
    rig.fc.arm(force=False)
    assert rig.state.home_ned[:2] == pytest.approx((30.0, 40.0), abs=1e-3)
    assert rig.fc.request(SetHome(95.0, 0.0, 0.0)).verdict is Verdict.DENIED
    assert rig.fc.request(SetHome(nan, 0.0, 0.0)).verdict is Verdict.DENIED


@pytest.mark.parametrize("mode", [Mode.RETURN, Mode.LAND])
def test_return_and_land_are_refused_on_the_ground(mode):
    rig = Kinematic().ready()
    assert "on the ground" in rig.fc.request(ChangeMode(mode)).reason


@pytest.mark.parametrize("mode", [Mode.TAKEOFF, Mode.MISSION, Mode.RETURN])
def test_position_modes_are_refused_without_a_position(mode):
    rig = Kinematic()
    rig.flags = TILT_ALIGNED | YAW_ALIGNED
    rig.run(1.0)
    reply = rig.fc.request(ChangeMode(mode))
    assert reply.verdict is Verdict.TEMPORARILY_REJECTED
    assert reply.reason


def test_reboot_is_refused_when_armed_or_pointless():
    rig = Kinematic().ready()
    assert rig.fc.reboot().verdict is Verdict.UNSUPPORTED
    rig.fc.arm(force=False)
    assert rig.fc.reboot().verdict is Verdict.TEMPORARILY_REJECTED


def test_parameters_take_effect_in_flight():
    rig = Kinematic().ready()
    rig.fc.arm(force=False)
    rig.table.set("COM_DISARM_PRFLT", 3.0)
    assert rig.disarmed() < 3.1


@pytest.mark.parametrize(("may_go_without", "reason"), [(1, ""), (0, "GNSS: no 3-D fix")])
def test_modes_without_a_position_need_gnss_only_if_it_is_asked_for(may_go_without, reason):
    rig = Kinematic(COM_ARM_WO_GPS=may_go_without).ready()
    set_gnss("fix_type", 0)(rig)
    rig.run(1.0)
    assert arming_reasons(rig.state, rig.table, needs_position=False) == ([reason] if reason else [])


def test_vehicle_that_is_being_calibrated_is_not_armed():
    rig = Kinematic().ready()
    assert rig.fc.calibration.start(CalibrationKind.GYRO).verdict is Verdict.ACCEPTED
    assert rig.fc.arm(force=False).reason == "a calibration is running"
    rig.run(3.0)
    assert rig.recorder.has_text("[cal] calibration done: gyro")
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
    assert rig.fc.calibration.start(CalibrationKind.GYRO).reason == "the vehicle is armed"


def test_reasons_against_arming_wait_while_a_stopped_vehicle_falls_and_a_restarted_one_aligns():
    rig = Kinematic().flying()
    rig.run(31.0)
    rig.fc.disarm(force=True)
    rig.run(2.0)
    assert not rig.recorder.has_text("PreArm")
    rig.run(30.0)
    rig.fc._on_reboot = lambda: None
    rig.fc.reboot()
    rig.flags = 0
    rig.run(2.0)
    assert not rig.recorder.has_text("PreArm")
    rig.run(10.0)
    assert rig.recorder.has_text("PreArm")
