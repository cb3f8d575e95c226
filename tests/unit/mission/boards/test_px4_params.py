"""What PX4 is told of our vehicles, in its own words."""

from math import radians

import pytest

from common.airframe import load_airframe
from mission.boards.px4_params import px4_environment, px4_params
from sim.bodies.vehicles import class_of

# Output functions of PX4 (src/lib/mixer_module/output_functions.yaml): motors from 101, servos from 201, nose wheel 440
FUNCTIONS = {
    "x500": [101, 102, 103, 104],
    "f550": [101, 102, 103, 104, 105, 106],
    "rover": [201, 101],
    "rover-skid": [102, 101],  # left is its second motor
    "plane": [201, 202, 101, 203, 440],
}


def params(name, **more):
    return px4_params(load_airframe(name)) | more


@pytest.mark.parametrize("name", FUNCTIONS)
def test_each_actuator_is_moved_by_its_function_and_no_other_output_is_left(name):
    found = params(name)
    functions = [found[f"PWM_MAIN_FUNC{k}"] for k in range(1, 10)]
    assert functions == FUNCTIONS[name] + [0] * (9 - len(FUNCTIONS[name]))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_names_fit_and_numbers_are_numbers(name):
    for parameter, value in params(name).items():
        assert len(parameter) <= 16
        assert abs(value) < 1e6


def test_every_digit_of_a_parameter_arrives():
    told = px4_environment(load_airframe("x500"), {"COM_FLIGHT_UUID": 1048574.0, "MPC_XY_P": 0.95})
    assert told["PX4_PARAM_COM_FLIGHT_UUID"] == "1048574"
    assert told["PX4_PARAM_MPC_XY_P"] == "0.95"


def test_a_number_of_ones_own_is_refused():
    with pytest.raises(ValueError, match="MAV_SYS_ID"):
        px4_environment(load_airframe("x500"), {"MAV_SYS_ID": 7.0})


def test_a_car_is_told_its_geometry_and_its_gains_in_px4s_units():
    airframe, found = load_airframe("rover"), params("rover")
    assert found["RA_WHEEL_BASE"] == airframe.wheel_base_m
    assert found["RA_MAX_STR_ANG"] == airframe.steering.max_angle_rad
    assert radians(found["RA_STR_RATE_LIM"]) == pytest.approx(airframe.steering.rate_rad_s)
    assert found["RO_MAX_THR_SPEED"] == airframe.drive.max_speed_m_s
    assert found["RO_SPEED_P"] == pytest.approx(2.0 / 8.0)  # throttle per m/s; ours is m/s per m/s, of 8 m/s at most
    assert found["RO_YAW_RATE_P"] == pytest.approx(0.5 * 0.5 / 2.0)  # rad of steering per rad/s at 2 m/s


def test_a_plane_is_told_its_airspeeds_and_which_surface_turns_it_how():
    found = params("plane")
    ours = class_of(load_airframe("plane")).vehicle.defaults(load_airframe("plane"))
    for name in ("FW_AIRSPD_STALL", "FW_AIRSPD_MIN", "FW_AIRSPD_TRIM", "FW_AIRSPD_MAX", "TRIM_PITCH", "FW_THR_TRIM"):
        assert found[name] == ours[name]
    torques = [[found[f"CA_SV_CS{k}_TRQ_{axis}"] for axis in "RPY"] for k in range(3)]
    assert torques == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]  # ailerons, elevator, rudder: positive rolls, pitches, yaws
    assert [found[f"CA_SV_CS{k}_TYPE"] for k in range(3)] == [15, 3, 4]


def test_what_the_user_says_counts_and_the_airframe_is_chosen_by_the_class():
    environment = px4_environment(load_airframe("rover"), {"RO_SPEED_LIM": 3.0})
    assert environment["PX4_PARAM_RO_SPEED_LIM"] == "3"
    models = [px4_environment(load_airframe(name), {})["PX4_SIM_MODEL"] for name in FUNCTIONS]
    assert models == ["none_iris", "none_iris", "gz_rover_ackermann", "gz_rover_differential", "jsbsim_rascal"]
