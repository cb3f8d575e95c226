"""Laws of a plane's body, against closed forms of flight mechanics and the energy that nothing adds to."""

from math import pi, sqrt

import numpy as np
import pytest

from autopilot.vehicles.plane.trim import level_flight, stall_speed_m_s, thrust_n
from common.airframe import AIRFRAME_FOLDER, AirframeError, load_airframe
from common.geodesy import GRAVITY_M_S2
from sim.bodies.plane_model import plane_model
from sim.world.world import WorldConfig, build_world
from tests.unit.sim.plane_fleet import AIRFRAME, PlaneFleet

SPEED = 22.0
LEVEL = level_flight(AIRFRAME, SPEED)
FULL_V = AIRFRAME.battery.cells * AIRFRAME.battery.full_cell_v


def trimmed(throttle=LEVEL.throttle):
    """In level flight with its propeller turning, and the command that keeps it so."""
    fleet = PlaneFleet()
    fleet.in_flight(SPEED, LEVEL.alpha_rad, LEVEL.elevator, 100.0)
    fleet.state["propeller_rad_s"] = 0.97 * LEVEL.throttle * FULL_V / AIRFRAME.propeller.motor_constant_v_s
    return fleet, (0.0, LEVEL.elevator, throttle)


def gliding(count=1):
    """A glider of the same wing, in level flight: what the propeller does is not what the test is about."""
    model = plane_model(AIRFRAME, 0.0)
    model.prop_diameter_m = 0.01
    fleet = PlaneFleet(count, model)
    fleet.in_flight(SPEED, LEVEL.alpha_rad, LEVEL.elevator)
    return fleet, (0.0, LEVEL.elevator, 0.0)


def test_level_flight_is_where_lift_is_weight_and_thrust_is_drag():
    """By the closed form of autopilot.vehicles.plane.trim; the propeller's torque rolls it over time."""
    fleet, command = trimmed()
    track = fleet.track(4.0, command)
    assert np.abs(track["speed"] - SPEED).max() < 0.3
    assert np.abs(track["climb"]).max() < 0.3
    assert fleet.state["accel_frd"][0] == pytest.approx((1.0, 0.0, -GRAVITY_M_S2), abs=0.7)


def test_speed_and_height_swing_with_lanchesters_period():
    """F. W. Lanchester 1908: a phugoid takes sqrt(2) pi V / g, hardly damped, whatever the plane."""
    fleet, command = gliding()
    fleet.state["vel_ned"][:, 0] += 2.0
    climb = fleet.track(60.0, command)["climb"]
    climb = climb - climb.mean()
    ups = np.nonzero((climb[:-1] < 0.0) & (climb[1:] >= 0.0))[0]
    assert len(ups) >= 4
    period_s = 0.1 * np.diff(ups).mean()
    assert period_s == pytest.approx(sqrt(2.0) * pi * SPEED / GRAVITY_M_S2, rel=0.15)
    assert np.abs(climb[-100:]).max() < 0.7 * np.abs(climb[:100]).max()  # it dies out


def test_a_blow_on_the_nose_is_gone_within_a_second():
    """The short period: well damped, as c_m_q and the lift's slope make it."""
    fleet, command = trimmed()
    fleet.state["omega_frd"][:, 1] = 1.0
    fleet.fly(1.0, command)
    assert abs(fleet.state["omega_frd"][0, 1]) < 0.15


def test_a_glide_is_as_flat_as_lift_over_drag():
    fleet, command = gliding()
    track = fleet.track(100.0, command)
    way_m, lost_m = track["pos"][-1, 0] - track["pos"][300, 0], track["pos"][-1, 2] - track["pos"][300, 2]
    drag_n = thrust_n(AIRFRAME, LEVEL.throttle, SPEED)  # thrust is drag in level flight
    assert lost_m / way_m == pytest.approx(drag_n / (AIRFRAME.body.mass_kg * GRAVITY_M_S2), rel=0.05)


def test_without_its_motor_it_only_loses_energy():
    fleet, command = trimmed(throttle=0.0)
    fleet.fly(1.0, command)  # until the propeller windmills
    track = fleet.track(30.0, command)
    energy = 0.5 * track["speed"] ** 2 - GRAVITY_M_S2 * track["pos"][:, 2]
    assert (np.diff(energy) < 0.0).all()


def test_left_and_right_are_alike():
    fleet, _ = gliding(count=2)
    command = np.zeros((2, 4))
    command[:, 1] = LEVEL.elevator
    command[:, 0], command[:, 3] = (0.3, -0.3), (0.2, -0.2)
    right, left = fleet.fly(3.0, command)
    assert right["vel_ned"] == pytest.approx(left["vel_ned"] * (1, -1, 1), abs=1e-2)
    assert right["omega_frd"] == pytest.approx(left["omega_frd"] * (-1, 1, -1), abs=1e-3)
    assert right["pos_ned"][1] > 1.0  # right ailerons lead to the right


def test_below_its_stall_speed_it_cannot_stay_up():
    """Full elevator holds level flight at the stall speed; three quarters of it sinks away."""
    stall = stall_speed_m_s(AIRFRAME)
    assert level_flight(AIRFRAME, stall).elevator == pytest.approx(1.0, abs=0.01)
    slow = level_flight(AIRFRAME, stall)
    fleet = PlaneFleet()
    fleet.in_flight(0.75 * stall, slow.alpha_rad, 1.0, 100.0)
    track = fleet.track(2.0, (0.0, 1.0, 0.0))
    assert track["climb"].min() < -3.0


def test_it_stands_on_its_wheels_without_creeping():
    fleet = PlaneFleet()
    fleet.fly(3.0, (0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    before = fleet.state["pos_ned"].copy()
    fleet.fly(30.0, (0.0, 0.0, 0.0, 0.0, 0.0, 1.0), wind_ned=(0.0, 5.0, 0.0))
    assert fleet.state["pos_ned"] == pytest.approx(before, abs=0.01)
    assert fleet.state["is_on_ground"][0] == 1
    assert not fleet.state["is_crashed"][0]
    assert np.linalg.norm(fleet.state["vel_ned"][0]) < 1e-3


def test_brakes_stop_it_as_coulomb_says():
    """A sixth of the weight is on the nose wheel, which has no brake."""
    fleet = PlaneFleet()
    fleet.fly(2.0)
    fleet.state["vel_ned"][:, 0] = 8.0
    track = fleet.track(6.0, (0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    gear = AIRFRAME.gear
    decel = GRAVITY_M_S2 * (gear.rolling_resistance + 0.8 * gear.brake_friction)
    way_m = track["pos"][-1, 0] - 0.0
    assert track["speed"][-1] < 0.05
    assert way_m == pytest.approx(8.0**2 / (2.0 * decel), rel=0.3)


def test_what_strikes_the_ground_too_fast_breaks():
    fleet = PlaneFleet()
    fleet.in_flight(SPEED, -0.3, 0.0, 5.0)
    fleet.state["vel_ned"][:, 2] = 8.0
    fleet.fly(2.0)
    assert fleet.state["is_crashed"][0] == 1


def test_a_tree_stops_it():
    world = build_world(WorldConfig(size_m=400.0, hill_height_m=0.0, trees_per_ha=600.0, clearing_radius_m=10.0))
    fleet = PlaneFleet(world=world)
    fleet.in_flight(SPEED, LEVEL.alpha_rad, LEVEL.elevator, 3.0)
    fleet.fly(8.0, (0.0, LEVEL.elevator, LEVEL.throttle))
    assert fleet.state["is_crashed"][0] == 1
    assert fleet.state["pos_ned"][0, 0] < 150.0


def test_a_tail_that_turns_the_wrong_way_is_refused(tmp_path):
    text = (AIRFRAME_FOLDER / "plane.toml").read_text(encoding="utf-8")
    path = tmp_path / "odd.toml"
    path.write_text(text.replace("c_m_alpha = { value = -2.74", "c_m_alpha = { value = 2.74"), encoding="utf-8")
    with pytest.raises(AirframeError, match="must be below 0"):
        load_airframe(str(path))
