"""Laws of a rover's body: they hold whatever its numbers are."""

import numpy as np
import pytest

from autopilot.ports import SETPOINT_DRIVE
from common.airframe import AIRFRAME_FOLDER, AirframeError, load_airframe
from common.geodesy import DEFAULT_HOME, GRAVITY_M_S2
from sim.bodies.rover_model import rover_model
from sim.bodies.vehicles import class_of
from sim.rig import Rig
from sim.sensors.sensors import sensor_model
from sim.wind import wind_model
from sim.world.world import WorldConfig, build_world
from tests.unit.sim.rover_fleet import FLAT, RoverFleet, nose_ned, up_ned
from tests.unit.sim.test_rig import same_bits

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


def test_its_motor_gives_it_the_acceleration_of_its_current_limit():
    fleet = RoverFleet([(0.0, 0.0)])
    fleet.drive(1.0, STAND)
    fleet.drive(0.2, (0.0, 1.0, 0.0))  # the force builds up
    before = fleet.speeds()[0]
    fleet.drive(0.3, (0.0, 1.0, 0.0))
    body, wheels = ROVER.body, ROVER.wheels
    force = ROVER.drive.max_force_n - wheels.rolling_resistance * body.mass_kg * GRAVITY_M_S2
    expected = force / (body.mass_kg + 4 * wheels.inertia_kg_m2 / wheels.radius_m**2)
    assert (fleet.speeds()[0] - before) / 0.3 == pytest.approx(expected, rel=0.02)


def test_a_fast_bend_is_wider_than_the_wheels_point_and_the_wider_the_faster():
    fleet = RoverFleet([(0.0, 30.0 * k) for k in range(4)])
    throttle = np.array([0.1, 0.35, 0.6, 0.7])
    fleet.drive(4.0, np.column_stack([np.zeros(4), throttle, np.zeros(4)]))
    state = fleet.drive(4.0, np.column_stack([np.full(4, 0.25), throttle, np.zeros(4)]))
    curvature = np.tan(0.25 * ROVER.steering.max_angle_rad) / ROVER.wheel_base_m
    followed = state["omega_frd"][:, 2] / (fleet.speeds() * curvature)
    assert followed[0] == pytest.approx(1.0, abs=0.01)
    assert np.all(np.diff(followed) < -0.004)
    assert followed[-1] < 0.95


def test_what_brakes_is_missing_for_turning():
    low = model_of(hub_z=0.0, standing_m=0.09, brake_max_n=(400.0, 400.0))  # locks, and slides rather than tips
    fleet = RoverFleet([(0.0, 0.0), (0.0, 30.0)], low)
    fleet.drive(4.0, (0.0, 0.8, 0.0))
    fleet.drive(0.1, [(0.3, 0.8, 0.0), (0.3, 0.0, 1.0)])
    for _ in range(10):
        accel = fleet.drive(0.05, [(0.3, 0.8, 0.0), (0.3, 0.0, 1.0)])["accel_frd"]
        assert np.hypot(accel[1, 0], accel[1, 1]) < 1.05 * ROVER.tyres.friction * GRAVITY_M_S2
        assert abs(accel[1, 1]) < 0.6 * abs(accel[0, 1])


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


def test_rolling_over_crests_it_gains_no_energy_to_speak_of(hills):
    """Steps of slope of up to 39 degrees, at which no side of the hull may be taken to be below ground."""
    fleet = RoverFleet([(0.0, 0.0), (8.0, -9.0), (-7.0, 12.0)], free_rolling(), world=hills, yaws=[0.0, 1.0, 2.5])
    inertia = (ROVER.body.inertia_xx_kg_m2, ROVER.body.inertia_yy_kg_m2, ROVER.body.inertia_zz_kg_m2)
    fleet.drive(1.0, STAND)
    pushed(fleet, 3.0)
    fleet.drive(0.5, ROLL)  # the wheels settle
    least = np.full(3, np.inf)
    for _ in range(100):
        state = fleet.drive(0.1, ROLL)
        moving = 0.5 * ROVER.body.mass_kg * np.sum(state["vel_ned"] ** 2, axis=1)
        turning = 0.5 * state["omega_frd"] ** 2 @ inertia
        turning += 0.5 * ROVER.wheels.inertia_kg_m2 * np.sum(state["wheel_speed"] ** 2, axis=1)
        energy = moving + turning - ROVER.body.mass_kg * GRAVITY_M_S2 * state["pos_ned"][:, 2]
        assert np.all(energy < least + 3.0)  # J of 45 and more; the springs store some of it for a while
        least = np.minimum(least, energy)


def test_one_alone_drives_as_it_does_among_others_to_the_bit(hills):
    places = [(0.0, 0.0), (8.0, -9.0), (-7.0, 12.0)]
    commands = [(0.3, 0.4, 0.0), (-0.8, -0.3, 0.0), (0.0, 0.9, 0.2)]
    together = RoverFleet(places, world=hills).drive(3.0, commands)
    for row, (place, command) in enumerate(zip(places, commands, strict=True)):
        assert RoverFleet([place], world=hills).drive(3.0, command)[0].tobytes() == together[row].tobytes()


@pytest.mark.parametrize("name", ["rover", "rover-skid"])
def test_threads_do_not_change_a_bit(name):
    snapshots = []
    for threads in (1, 2):
        airframe = load_airframe(name)
        vehicle, body = class_of(airframe)
        rig = Rig(
            airframe, build_world(FLAT), sensor_model(), wind_model(4.0), home=DEFAULT_HOME, vehicle_count=5,
            threads=threads, body=body, law=vehicle.law,
        )  # fmt: skip
        rig.advance(750)  # the estimator aligns
        setpoint = rig.rows["autopilot.setpoint"]
        for field, value in {"kind": SETPOINT_DRIVE, "is_armed": 1, "speed": 2.0, "yaw_rate": 0.5}.items():
            setpoint[field] = value
        rig.advance(750)
        assert np.all(np.linalg.norm(rig.rows["truth"]["vel_ned"], axis=1) > 0.5)
        snapshots.append(rig.snapshot())
    assert same_bits(*snapshots)


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


def test_a_limited_current_takes_no_more_power_than_the_motor_turns_into_force_and_heat():
    fleet = RoverFleet([(0.0, 0.0)])
    fleet.drive(1.0, STAND)
    for _ in range(10):
        state = fleet.drive(0.1, (0.0, 1.0, 0.0))[0]
        force = float(state["drive_n"].sum())
        heat_w = force**2 / (ROVER.drive.stall_force_n / ROVER.drive.max_speed_m_s)
        motor_w = (force * float(np.mean(state["tread_m_s"])) + heat_w) / ROVER.battery.motor_efficiency
        drawn_w = float(state["battery_voltage_v"] * state["battery_current_a"]) - ROVER.battery.avionics_w
        assert drawn_w == pytest.approx(motor_w, rel=0.03)


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
