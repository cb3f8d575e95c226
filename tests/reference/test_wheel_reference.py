"""ReachTarget's car against a plain NumPy version of its wheels, written from the equations."""

import numpy as np
import pytest
import warp as wp

from bench.vehicle import NUMBER as N
from policies.tasks.reach_target.car_model import Car, Wheel, car_of, controls_of, wheel_pull
from policies.tasks.reach_target.reach_target_params import ReachParams

H = 0.01  # [s] sub-step
UP = np.array([0.0, 1.0, 0.0])


def curve(slip, direction):
    """Force over load at a slip of at least 0."""
    extremum_slip, extremum = N[f"{direction}_extremum_slip"], N[f"{direction}_extremum"]
    asymptote_slip, asymptote = N[f"{direction}_asymptote_slip"], N[f"{direction}_asymptote"]
    if slip < extremum_slip:
        fraction = slip / extremum_slip
        value = extremum * fraction * (2.0 - fraction)
    elif slip < asymptote_slip:
        fraction = (slip - extremum_slip) / (asymptote_slip - extremum_slip)
        value = extremum + (asymptote - extremum) * (3.0 * fraction**2 - 2.0 * fraction**3)
    else:
        value = asymptote
    return N[f"{direction}_stiffness"] * value


def reference_wheel(squeeze, rise, along, across, spin, motor, brake):
    """Load, force along, force across and new spin of a wheel on level ground."""
    radius, inertia = N["wheel_radius_m"], 0.5 * N["wheel_mass_kg"] * N["wheel_radius_m"] ** 2
    load = N["spring_n_m"] * squeeze - N["damper_ns_m"] * rise
    load += N["bump_stop_n_m"] * max(squeeze - N["suspension_travel_m"], 0.0)
    load = min(max(load, 0.0), N["mass_kg"] * N["gravity_m_s2"])
    slow = N["slip_speed_m_s"]
    slide = radius * spin - along
    slip = abs(slide) / max(abs(along), abs(radius * spin), slow)
    side_slip = abs(across) / max(abs(along), slow)
    side_force = -np.sign(across) * load * curve(side_slip, "side")
    grip = load * curve(slip, "forward") / abs(slide)  # secant: force per sliding speed

    def turned(force_of_spin, constant):
        mass = inertia + H * (N["wheel_damping_nms"] + radius * force_of_spin)
        free = (inertia * spin + H * (motor - radius * constant)) / mass
        return np.sign(free) * max(abs(free) - H * brake / mass, 0.0)

    new_spin = turned(grip * radius, -grip * along)
    force = grip * (radius * new_spin - along)
    limit = load * N["forward_stiffness"] * N["forward_extremum"]
    if abs(force) > limit:
        force = np.sign(force) * limit
        new_spin = turned(0.0, force)
    return load, force, side_force, new_spin


def wheel_state(rng):
    """Of a wheel on level ground: squeeze, rise, along, across, spin, motor, brake."""
    along = rng.uniform(-15.0, 15.0)
    return (
        rng.uniform(0.01, 0.13),
        rng.uniform(-0.5, 0.5),
        along,
        rng.uniform(-5.0, 5.0),
        along / 0.5 * rng.uniform(0.3, 1.8),
        1500.0 * rng.uniform(-1.0, 1.0),
        2000.0 * max(rng.uniform(-1.0, 1.0), 0.0),
    )


@pytest.fixture(scope="module")
def params():
    params = ReachParams()
    for name, value in N.items():
        setattr(params, name, value)
    return params


def test_one_wheel_pulls_as_the_equations_say(params):
    car: Car = car_of(params)
    rng = np.random.default_rng(0)
    for _ in range(300):
        squeeze, rise, along, across, spin, motor, brake = wheel_state(rng)
        controls = controls_of(params, 0.0, motor / 1500.0, brake / 2000.0)
        wheel = Wheel()
        wheel.hub = wp.vec3(0.0, 0.0, 0.0)
        wheel.drop_m = 0.6 - squeeze
        wheel.heading = wp.vec3(0.0, 0.0, 1.0)
        wheel.spin = spin
        pull = wheel_pull(car, controls, wheel, wp.vec3(*UP), wp.vec3(across, rise, along), wp.vec3(0.0, 0.0, 0.0))
        load, force, side_force, new_spin = reference_wheel(squeeze, rise, along, across, spin, motor, brake)
        assert np.array(pull.force_car) == pytest.approx([side_force, load, force], rel=2e-4, abs=0.5)
        assert pull.spin == pytest.approx(new_spin, rel=1e-4, abs=1e-3)
        arm = np.array([0.0, -(0.6 - squeeze), 0.0])
        assert np.array(pull.moment_car) == pytest.approx(np.cross(arm, [side_force, load, force]), rel=3e-4, abs=0.5)
