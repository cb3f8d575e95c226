"""The names that ArduPilot's scripts and stations touch, each there and each what it says it is."""

import pytest

from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.services.parameter_view import ParameterView
from common.airframe import load_airframe
from mission.flight_config import FlightConfig, flight_parameters

SIMULATOR = """SIM_SPEEDUP SIM_WIND_SPD SIM_WIND_DIR SIM_WIND_TURB SIM_GPS_DISABLE SIM_GPS1_ENABLE SIM_ENGINE_FAIL
SIM_ENGINE_MUL SIM_BATT_VOLTAGE SIM_RC_FAIL SIM_BARO_DISABLE SIM_MAG1_FAIL"""
FAILSAFES = """FS_THR_ENABLE FS_GCS_ENABLE FS_GCS_TIMEOUT FS_EKF_ACTION FS_EKF_THRESH FS_CRASH_CHECK FS_OPTIONS
FENCE_ENABLE FENCE_ACTION FENCE_TYPE FENCE_ALT_MAX FENCE_ALT_MIN FENCE_RADIUS FENCE_MARGIN BATT_MONITOR BATT_CAPACITY
BATT_LOW_VOLT BATT_LOW_TIMER BATT_LOW_MAH BATT_FS_LOW_ACT BATT_CRT_VOLT BATT_CRT_MAH BATT_FS_CRT_ACT ARMING_CHECK
DISARM_DELAY"""
FLYING = """RTL_ALT RTL_SPEED RTL_ALT_FINAL RTL_LOIT_TIME WPNAV_SPEED WPNAV_SPEED_UP WPNAV_SPEED_DN WPNAV_RADIUS
WPNAV_ACCEL LOIT_SPEED LAND_SPEED LAND_SPEED_HIGH ANGLE_MAX PILOT_SPEED_UP PILOT_SPEED_DN PILOT_TKOFF_ALT CIRCLE_RADIUS
WP_YAW_BEHAVIOR GUID_OPTIONS GUID_TIMEOUT ACRO_Y_RATE"""
RADIO = """RC1_MIN RC1_MAX RC1_TRIM RC3_MIN RC1_OPTION RC7_OPTION RC8_OPTION RC16_OPTION RCMAP_ROLL RCMAP_PITCH
RCMAP_THROTTLE RCMAP_YAW FLTMODE1 FLTMODE6 FLTMODE_CH RC_OVERRIDE_TIME"""
GAINS = """ATC_RAT_RLL_P ATC_RAT_RLL_I ATC_RAT_RLL_D ATC_RAT_PIT_P ATC_RAT_YAW_P ATC_ANG_RLL_P ATC_ANG_PIT_P
ATC_ANG_YAW_P ATC_INPUT_TC ATC_ACCEL_R_MAX ATC_SLEW_YAW PSC_POSXY_P PSC_VELXY_P PSC_VELXY_I PSC_VELXY_D PSC_POSZ_P
PSC_VELZ_P"""
OUTPUTS = """MOT_SPIN_MIN MOT_SPIN_ARM MOT_SPIN_MAX MOT_THST_HOVER MOT_THST_EXPO MOT_PWM_MIN MOT_PWM_MAX
SERVO1_FUNCTION SERVO5_FUNCTION SERVO9_FUNCTION SERVO16_FUNCTION SERVO9_MIN SERVO9_MAX SERVO9_TRIM"""
REST = """LOG_BITMASK LOG_DISARMED LOG_BACKEND_TYPE SR0_RAW_SENS SR0_EXT_STAT SR0_RC_CHAN SR0_POSITION SR0_EXTRA1
SR0_EXTRA2 SR0_EXTRA3 SR1_EXTRA1 SR0_PARAMS SYSID_THISMAV SYSID_MYGCS FRAME_CLASS FRAME_TYPE EK3_ENABLE AHRS_EKF_TYPE
GPS_TYPE GPS1_TYPE COMPASS_USE COMPASS_ENABLE RNGFND1_TYPE TERRAIN_ENABLE SCHED_LOOP_RATE STAT_RUNTIME"""
COMMON = [name for names in (SIMULATOR, FAILSAFES, FLYING, RADIO, GAINS, OUTPUTS, REST) for name in names.split()]


def view(airframe="x500", **config):
    chosen = FlightConfig(dialect="ardupilot", airframe=airframe, **config)
    return ParameterView(flight_parameters(chosen, load_airframe(airframe)), ARDUPILOT)


@pytest.fixture(scope="module")
def x500():
    return view()


@pytest.mark.parametrize("name", COMMON)
def test_commonly_used_name_is_there_and_inside_its_bounds(x500, name):
    assert len(name) <= 16
    low, high = x500.bounds(name)
    assert low <= x500.value(name) <= high


@pytest.mark.parametrize("name", COMMON)
def test_what_is_set_is_kept_or_not_taken_at_all(name):
    """No name takes a value and forgets it."""
    own = view()
    before, (low, high) = own.value(name), own.bounds(name)
    for asked in (low, high):
        assert own.set(name, asked) in (asked, before) or own.is_integer(name)
        assert own.value(name) == pytest.approx(own.set(name, asked))


@pytest.mark.parametrize(
    ("theirs", "ours", "asked", "stored"),
    [("PSC_POSXY_P", "MPC_XY_P", 1.2, 1.2), ("PSC_NE_POS_P", "MPC_XY_P", 1.2, 1.2),
     ("ATC_ANG_RLL_P", "MC_ROLL_P", 6.0, 6.0),
     ("FS_EKF_ACTION", "COM_EST_FAIL_ACT", 0.0, 0), ("FS_CRASH_CHECK", "CBRK_FLIGHTTERM", 0.0, 121212),
     ("LOG_DISARMED", "SDLOG_MODE", 1.0, 1), ("RTL_ALT_FINAL", "RTL_DESCEND_ALT", 500.0, 5.0),
     ("SIM_GPS_DISABLE", "SIM_GPS1_ENABLE", 1.0, 0), ("SR1_EXTRA1", "SR0_EXTRA1", 10.0, 10),
     ("MOT_THST_HOVER", "MPC_THR_HOVER", 0.4, 0.4), ("ATC_SLEW_YAW", "MPC_YAWRAUTO_MAX", 3000.0, 30.0)],
)  # fmt: skip
def test_name_sets_ours_in_its_unit(theirs, ours, asked, stored):
    own = view()
    own.set(theirs, asked)
    assert own.value(ours) == pytest.approx(stored)


def test_outputs_are_motors_as_far_as_there_are(x500):
    def motors(of):
        return [of.value(f"SERVO{i}_FUNCTION") for i in range(1, 9)]

    assert motors(x500) == [33, 34, 35, 36, 0, 0, 0, 0]
    assert motors(view("f550")) == [33, 34, 35, 36, 37, 38, 0, 0]


def test_simulators_values_are_the_flights():
    own = view(wind_m_s=5.0, wind_from_deg=90.0)
    assert [own.value(f"SIM_WIND_{name}") for name in ("SPD", "DIR", "TURB")] == [5.0, 90.0, 0.5]
    assert own.value("SIM_BATT_VOLTAGE") == pytest.approx(16.8)


def test_px4_vehicles_have_none_of_the_simulators_names():
    table = flight_parameters(FlightConfig(), load_airframe("x500"))
    assert not [name for name in table if name.startswith(("SIM_", "SR0_", "RC7_OPTION", "BATT_"))]
