"""Laws of a rover's body: they hold whatever its numbers are."""

import numpy as np
import pytest

from common.airframe import AIRFRAME_FOLDER, AirframeError, load_airframe
from common.geodesy import GRAVITY_M_S2
from sim.bodies.rover_model import rover_model
from sim.world.world import WorldConfig, build_world
from tests.unit.sim.rover_fleet import RoverFleet, nose_ned, up_ned

STAND, ROLL = (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
ROVER, SKID = load_airframe("rover"), load_airframe("rover-skid")


def model_of(airframe=ROVER, **changes):
    model = rover_model(airframe, 0.0)
    for name, value in changes.items():
        setattr(model, name, value)
    return model


def free_rolling(**changes):
    """Without motor brake and air: what slows it down is what the test is about."""
    return model_of(motor_n_s_m=0.0, drag_area_frd=(0.0, 0.0, 0.0), **changes)


def pushed(fleet, speed):
    """Gives the vehicles a speed along their noses, wheels and all."""
    for row in fleet.state:
        row["vel_ned"] = speed * nose_ned(row["q_ned_from_frd"])
        row["wheel_speed"] = speed / ROVER.wheels.radius_m


def test_a_rover_stands_still_at_its_standing_height():
    fleet = RoverFleet([(0.0, 0.0)])
    state = fleet.drive(5.0, STAND)
    assert abs(-state["pos_ned"][0, 2] - model_of().standing_m) < 1e-3
    assert np.linalg.norm(state["vel_ned"]) < 1e-3
    np.testing.assert_allclose(state["accel_frd"][0], (0.0, 0.0, -GRAVITY_M_S2), atol=1e-2)


def test_rolling_resistance_slows_it_down_by_its_fraction_of_the_weight():
    fleet = RoverFleet([(0.0, 0.0)], free_rolling())
    fleet.drive(1.0, STAND)
    pushed(fleet, 4.0)
    fleet.drive(0.5, ROLL)  # the wheels settle
    before = fleet.speeds()[0]
    fleet.drive(4.0, ROLL)
    wheels = 4 * ROVER.wheels.inertia_kg_m2 / ROVER.wheels.radius_m**2  # they must be slowed down, too
    expected = ROVER.wheels.rolling_resistance * GRAVITY_M_S2 * ROVER.body.mass_kg / (ROVER.body.mass_kg + wheels)
    assert (before - fleet.speeds()[0]) / 4.0 == pytest.approx(expected, rel=0.02)


def test_air_drag_makes_a_head_wind_slow_it_down_and_a_tail_wind_push_it():
    fleet = RoverFleet([(0.0, 0.0), (0.0, 10.0)], model_of(motor_n_s_m=0.0, rolling_resistance=0.0), yaws=[0.0, np.pi])
    fleet.drive(1.0, STAND)
    pushed(fleet, 4.0)
    fleet.drive(2.0, ROLL, wind_ned=(-8.0, 0.0, 0.0))
    against, along = fleet.speeds()
    assert against < 3.7
    assert along > 4.02


def test_full_throttle_reaches_the_motors_speed_and_reverse_the_same_backwards():
    fleet = RoverFleet([(0.0, 0.0), (0.0, 10.0)])
    fleet.drive(8.0, [(0.0, 1.0, 0.0), (0.0, -1.0, 0.0)])
    ahead, back = fleet.speeds()
    assert 0.95 * ROVER.drive.max_speed_m_s < ahead <= ROVER.drive.max_speed_m_s
    assert back == pytest.approx(-ahead, rel=0.01)


def test_slow_circles_have_the_radius_of_ackermann():
    fleet = RoverFleet([(0.0, 0.0), (0.0, 20.0)])
    fleet.drive(6.0, [(1.0, 0.1, 0.0), (0.5, 0.1, 0.0)])
    for row, angle in zip(fleet.state, (1.0, 0.5), strict=True):
        radius = ROVER.wheel_base_m / np.tan(angle * ROVER.steering.max_angle_rad)
        speed = float(np.dot(row["vel_ned"], nose_ned(row["q_ned_from_frd"])))
        assert speed / row["omega_frd"][2] == pytest.approx(radius, rel=0.03)


def test_left_and_right_are_mirror_images():
    fleet = RoverFleet([(0.0, 0.0), (0.0, 0.0)])
    state = fleet.drive(4.0, [(0.7, 0.4, 0.0), (-0.7, 0.4, 0.0)])
    np.testing.assert_allclose(state["pos_ned"][0] * (1, -1, 1), state["pos_ned"][1], atol=2e-3)
    np.testing.assert_allclose(state["omega_frd"][0] * (-1, 1, -1), state["omega_frd"][1], atol=2e-3)


def test_no_turn_is_harder_than_the_tyres_grip():
    fleet = RoverFleet([(0.0, 0.0)], model_of(hub_z=0.0, standing_m=0.09))  # low: it slides rather than tips
    fleet.drive(4.0, (0.0, 0.9, 0.0))
    hardest = 0.0
    for _ in range(40):
        state = fleet.drive(0.05, (1.0, 0.9, 0.0))
        hardest = max(hardest, abs(float(state["accel_frd"][0, 1])))
    assert 0.6 * GRAVITY_M_S2 < hardest < 1.02 * ROVER.tyres.friction * GRAVITY_M_S2


def test_braking_is_no_harder_than_the_brake_and_the_grip():
    weak, strong = model_of(), model_of(brake_max_n=(400.0, 400.0))
    fleet = RoverFleet([(0.0, 0.0), (0.0, 10.0)], [weak, strong])
    fleet.drive(5.0, (0.0, 1.0, 0.0))
    before = fleet.speeds()
    fleet.drive(0.5, STAND)
    decel = (before - fleet.speeds()) / 0.5
    assert decel[1] < 1.02 * ROVER.tyres.friction * GRAVITY_M_S2
    assert 0.7 * ROVER.brake.max_force_n / ROVER.body.mass_kg < decel[0] < decel[1] + 1.0


def test_braking_loads_the_front_wheels():
    fleet = RoverFleet([(0.0, 0.0)])
    fleet.drive(3.0, (0.0, 0.6, 0.0))
    level = nose_ned(fleet.state[0]["q_ned_from_frd"])[2]
    fleet.drive(0.3, STAND)
    assert nose_ned(fleet.state[0]["q_ned_from_frd"])[2] > level + 0.01  # the nose goes down


def _steep(world, low_deg, high_deg):
    """A place on a slope between two angles, and the heading uphill."""
    side = np.arange(-60.0, 60.0, 1.7)
    north, east = (grid.ravel() for grid in np.meshgrid(side, side))
    normal = world.normal_ned(north, east).reshape(-1, 3)
    slope = np.degrees(np.arccos(-normal[:, 2]))
    near = world.normal_ned(north + 0.5, east + 0.5).reshape(-1, 3)  # not at the edge of a triangle
    fits = np.flatnonzero((slope > low_deg) & (slope < high_deg) & (np.abs(near - normal).max(axis=1) < 1e-3))
    place = fits[0]
    uphill = np.arctan2(-normal[place, 1], -normal[place, 0])
    return (north[place], east[place]), uphill, np.radians(slope[place])


@pytest.fixture(scope="module")
def hills():
    return build_world(
        WorldConfig(size_m=200.0, hill_height_m=20.0, hill_wavelength_m=60.0, octaves=1, trees_per_ha=0.0,
                    clearing_radius_m=0.0, clearing_blend_m=1.0)
    )  # fmt: skip


@pytest.mark.parametrize("turn", [0.0, 0.5 * np.pi, np.pi])
def test_braked_it_stands_on_a_slope_of_15_degrees(hills, turn):
    place, uphill, _ = _steep(hills, 14.0, 16.0)
    fleet = RoverFleet([place], world=hills, yaws=uphill + turn)
    fleet.drive(2.0, STAND)
    before = fleet.state["pos_ned"][0].copy()
    fleet.drive(30.0, STAND)
    assert np.linalg.norm(fleet.state["pos_ned"][0] - before) < 1e-3


def test_without_brake_it_rolls_down(hills):
    place, uphill, slope = _steep(hills, 14.0, 16.0)
    fleet = RoverFleet([place], free_rolling(), world=hills, yaws=uphill)
    fleet.drive(0.3, ROLL)
    before = fleet.speeds()[0]
    fleet.drive(0.3, ROLL)
    wheels = 4 * ROVER.wheels.inertia_kg_m2 / ROVER.wheels.radius_m**2
    pull = np.sin(slope) - ROVER.wheels.rolling_resistance * np.cos(slope)
    expected = -pull * GRAVITY_M_S2 * ROVER.body.mass_kg / (ROVER.body.mass_kg + wheels)
    assert (fleet.speeds()[0] - before) / 0.3 == pytest.approx(expected, rel=0.1)


def test_a_skid_steer_rover_turns_on_the_spot():
    fleet = RoverFleet([(0.0, 0.0)], rover_model(SKID, 0.0))
    state = fleet.drive(6.0, (0.3, -0.3, 0.0))
    assert state["omega_frd"][0, 2] > 0.5
    assert np.hypot(*state["pos_ned"][0, :2]) < 0.02


def test_one_with_a_high_centre_of_gravity_tips_over_and_stays_so():
    high = model_of(hub_z=0.4, standing_m=0.475, hull_bottom_m=0.3, hull_top_m=0.2)
    fleet = RoverFleet([(0.0, 0.0)], high)
    fleet.drive(4.0, (0.0, 0.9, 0.0))
    state = fleet.drive(4.0, (1.0, 0.9, 0.0))
    assert state["is_crashed"][0] == 1
    assert up_ned(state["q_ned_from_frd"][0])[2] > -0.3
    assert np.linalg.norm(fleet.drive(10.0, (0.0, 1.0, 0.0))["vel_ned"]) < 0.1  # its motor is dead


def test_a_wall_stops_it():
    world = build_world(WorldConfig(size_m=60.0, hill_height_m=0.0, trees_per_ha=0.0, has_walls=True))
    fleet = RoverFleet([(20.0, 0.0), (28.0, -15.0)], world=world, yaws=[0.0, np.radians(75.0)])
    state = fleet.drive(8.0, (0.0, 0.3, 0.0))
    assert state["pos_ned"][0, 0] + ROVER.hull.front_m < 30.0 + 0.02
    assert abs(fleet.speeds()[0]) < 0.05
    assert state["impact_speed"][0] > 1.0
    glancing = nose_ned(state["q_ned_from_frd"][1])
    assert abs(glancing[0]) < 0.1  # turned along the wall
    assert fleet.speeds()[1] > 1.0


def test_it_does_not_gain_energy_from_bumping_against_a_wall():
    world = build_world(WorldConfig(size_m=60.0, hill_height_m=0.0, trees_per_ha=0.0, has_walls=True))
    fleet = RoverFleet([(28.0, 0.0)], free_rolling(rolling_resistance=0.0), world=world, yaws=0.3)
    fleet.drive(0.5, ROLL)
    pushed(fleet, 3.0)
    fastest = 0.0
    for _ in range(100):
        fastest = max(fastest, float(np.linalg.norm(fleet.drive(0.02, ROLL)["vel_ned"])))
    assert fastest < 3.02


def test_a_dropped_rover_comes_to_rest():
    fleet = RoverFleet([(0.0, 0.0)])
    fleet.state["pos_ned"][0, 2] -= 0.3
    fleet.drive(2.0, STAND)
    assert np.linalg.norm(fleet.state["vel_ned"]) < 1e-3
    assert fleet.state["is_crashed"][0] == 0


def test_the_battery_drains_faster_at_work():
    fleet = RoverFleet([(0.0, 0.0), (0.0, 10.0)])
    state = fleet.drive(10.0, [STAND, (0.0, 1.0, 0.0)])
    assert state["battery_charge_c"][1] < state["battery_charge_c"][0]
    assert state["battery_current_a"][1] > state["battery_current_a"][0]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('layout = { value = "ackermann"', 'layout = { value = "skid"', "max_angle_rad must be 0 for skid steer"),
        ("bottom_m = { value = 0.07", "bottom_m = { value = 0.2", "hull.bottom_m must be above the ground"),
        ("sliding_friction = { value = 0.75", "sliding_friction = { value = 1.5", "must not be above tyres.friction"),
        ('driven = { value = "rear"', 'driven = { value = "front"', r"drive\.driven: "),
    ],
)
def test_a_wrong_airframe_is_refused(tmp_path, old, new, message):
    path = tmp_path / "mine.toml"
    text = (AIRFRAME_FOLDER / "rover.toml").read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(AirframeError, match=message):
        load_airframe(str(path))
