"""A plane's modes over MAVLink: it takes off, circles, goes to places, flies plans, comes back and lands."""

from math import atan2, hypot, nan, pi, radians

import numpy as np
import pytest

from autopilot.interface.vehicle_state import LandedState, Mode
from bench.flying.plane import fly_circuit
from common.airframe import load_airframe
from common.geodesy import geodetic_from_ned
from mission.client import CommandRefused
from mission.flight import Flight, FlightConfig
from mission.flight_config import AIRFIELD
from mission.plan.plan_file import default_plan, read_plan
from mission.script import fly_plan
from sim.bodies.vehicles import class_of
from sim.stepped import SteppedRig

PLANE = class_of(load_airframe("plane")).vehicle
RADIUS_M, TRIM_M_S = 80.0, 21.3


def flown(script, seconds=400.0, **config):
    """The flight after a script that begins when the plane may be armed."""
    flight = Flight(FlightConfig(**({"airframe": "plane", "world": AIRFIELD} | config)))

    async def whole(drone):
        await drone.wait_ready()
        return await script(drone, flight)

    running = flight.fly(whole, seconds=seconds)
    flight.close()
    if running.error is not None:
        raise running.error
    assert running.is_done
    assert not flight.is_crashed
    return flight


async def airborne(drone, height_m=40.0):
    await drone.arm()
    await drone.command(22, nan, 0.0, 0.0, nan, nan, nan, drone.home.alt_m + height_m)
    await drone.until(lambda: -drone.pos_ned[2] > height_m - 5.0, 60.0, "up")


def radius_m(drone, north=0.0, east=0.0):
    return hypot(drone.pos_ned[0] - north, drone.pos_ned[1] - east)


def test_it_takes_off_from_the_runway_and_circles():
    async def script(drone, flight):
        await airborne(drone)
        state = flight.controller.state
        await drone.until(lambda: state.mode is Mode.HOLD, 30.0, "holding")
        centre = drone.pos_ned
        await drone.sleep(30.0)
        for _ in range(20):
            await drone.sleep(1.0)
            assert abs(radius_m(drone, *centre[:2]) - RADIUS_M) < 12.0
            assert abs(drone.pos_ned[2] - centre[2]) < 5.0
        hud = drone.latest("VFR_HUD")
        assert abs(hud.airspeed - TRIM_M_S) < 1.5
        assert drone.latest("HEARTBEAT").type == 1  # MAV_TYPE_FIXED_WING
        assert state.landed_state is LandedState.IN_AIR

    flown(script)


def test_a_goto_is_circled_at_its_height():
    async def script(drone, flight):
        await airborne(drone)
        place = flight.controller.state.origin
        lat, lon, _ = geodetic_from_ned(250.0, 200.0, 0.0, place)
        place_e7 = int(lat * 1e7), int(lon * 1e7)
        await drone.command_int(192, 0, (-1.0, 1.0, 0.0, nan), *place_e7, drone.home.alt_m + 60.0)
        await drone.sleep(60.0)
        for _ in range(20):
            await drone.sleep(1.0)
            assert abs(radius_m(drone, 250.0, 200.0) - RADIUS_M) < 12.0
        assert abs(drone.pos_ned[2] + 60.0) < 5.0

    flown(script)


def test_the_default_plan_is_flown_and_ends_on_the_ground_at_home():
    async def script(drone, flight):
        await fly_plan(drone, read_plan(default_plan("plane")))
        await drone.wait_disarmed()
        assert radius_m(drone) < 80.0  # it rolls out after the touchdown

    flight = flown(script)
    assert flight.controller.state.landed_state is LandedState.ON_GROUND


def test_a_return_ends_on_the_ground_at_home():
    async def script(drone, flight):
        await airborne(drone, 50.0)
        await drone.sleep(5.0)
        await drone.return_home()
        await drone.wait_disarmed(200.0)
        assert radius_m(drone) < 80.0

    flown(script, wind_m_s=3.0)


def test_a_landing_is_against_the_wind():
    courses = []

    async def script(drone, flight):
        await airborne(drone, 40.0)
        await drone.sleep(20.0)
        await drone.command(21, nan, 0.0, 0.0, nan, nan, nan, nan)
        await drone.until(lambda: -drone.pos_ned[2] < 2.0, 200.0, "low")
        courses.append(atan2(drone.vel_ned[1], drone.vel_ned[0]))
        await drone.wait_disarmed()

    flown(script, wind_m_s=5.0, wind_from_deg=120.0)
    off = (courses[0] - radians(120.0) + pi) % (2.0 * pi) - pi
    assert abs(off) < radians(25.0)


def test_offboard_positions_are_circled_and_velocities_are_courses():
    async def script(drone, flight):
        await airborne(drone, 50.0)
        drone.offboard_velocity(0.0, 22.0, 0.0)
        await drone.sleep(0.5)
        await drone.start_offboard()
        await drone.sleep(12.0)
        assert abs(atan2(drone.vel_ned[1], drone.vel_ned[0]) - 0.5 * pi) < radians(4.0)
        drone.offboard_position(0.0, 0.0, -50.0)
        await drone.sleep(50.0)
        assert abs(radius_m(drone) - RADIUS_M) < 15.0

    flown(script)


@pytest.mark.parametrize(
    ("mode", "sticks", "check"),
    [
        ((2, 0), (0.5, 0.0), lambda d: abs(d["roll"] - radians(22.5)) < 0.05 and abs(d["climb"]) < 1.0),
        ((3, 0), (0.0, 0.0), lambda d: abs(d["roll"]) < 0.05 and abs(d["turned"]) < 0.05 and abs(d["climb"]) < 1.0),
        ((7, 0), (-0.5, 0.0), lambda d: abs(d["roll"] + radians(22.5)) < 0.06),
        ((2, 0), (0.0, -1.0), lambda d: 2.0 < d["climb"] < 4.0),
    ],
    ids=["altitude banks", "position holds its course", "stabilized banks", "altitude climbs"],
)
def test_a_pilot_flies_it(mode, sticks, check):
    roll, pitch = sticks

    async def script(drone, flight):
        await airborne(drone, 60.0)

        async def pilot():
            while True:
                drone.send("MANUAL_CONTROL", target=1, x=int(1000 * pitch), y=int(1000 * roll), z=620, r=0, buttons=0)
                await drone.sleep(0.05)

        drone.start(pilot())
        await drone.sleep(1.0)
        await drone.command(176, 1.0, float(mode[0]), float(mode[1]))
        await drone.sleep(8.0)
        before = atan2(drone.vel_ned[1], drone.vel_ned[0])
        await drone.sleep(2.0)
        after = atan2(drone.vel_ned[1], drone.vel_ned[0])
        state = flight.controller.state
        seen = {"roll": state.roll_rad, "climb": -drone.vel_ned[2], "turned": after - before}
        assert check(seen), seen

    flown(script)


def test_a_plane_without_airspeed_is_not_armed():
    flight = Flight(FlightConfig(airframe="plane", world=AIRFIELD))
    flight.rig.rows["faults"]["airspeed"][0] = (1, 0.0)  # off

    async def script(drone):
        await drone.sleep(8.0)
        with pytest.raises(CommandRefused, match="airspeed"):
            await drone.arm()

    running = flight.fly(script, seconds=30.0)
    flight.close()
    assert running.error is None, running.error


def test_ardupilots_plane_modes_have_its_numbers():
    numbers = {spec.ardupilot.number for spec in PLANE.modes.values() if not isinstance(spec.ardupilot, Mode)}
    assert {0, 1, 5, 6, 7, 10, 11, 12, 13, 15} <= numbers
    assert PLANE.ardupilot.name == "Plane"


@pytest.mark.parametrize("seed", [2, 102], ids=["long first leg", "first leg of 96 m after the take-off"])
def test_a_circuit_in_wind_is_flown_as_closely_as_it_should(seed):
    """What bench.flying.plane measures, on one seed: 95 % of the errors along the settled legs, and the touchdown."""
    circuit = fly_circuit(seed)
    assert circuit.is_landed
    assert np.percentile(circuit.course_deg, 95) < 3.0
    assert np.percentile(circuit.height_m, 95) < 5.0
    assert np.percentile(circuit.airspeed_m_s, 95) < 1.5
    assert circuit.touchdown_m < 30.0


def test_a_pitot_tube_that_falls_silent_in_flight_does_not_end_it():
    """Height and throttle go on without an airspeed, as PX4 flies without one."""

    async def script(drone, flight):
        await airborne(drone, 50.0)
        flight.rig.rows["faults"]["airspeed"][0] = (1, 0.0)  # off
        await drone.sleep(40.0)
        assert abs(drone.pos_ned[2] + 50.0) < 15.0
        await drone.return_home()
        await drone.wait_disarmed(200.0)

    flown(script)


def test_both_rigs_fly_it_to_the_same_bits():
    truths = []
    for make_rig in (None, SteppedRig):
        flight = Flight(FlightConfig(airframe="plane", world=AIRFIELD, wind_m_s=3.0), make_rig=make_rig)
        running = flight.drone.start(fly_plan(flight.drone, read_plan(default_plan("plane"))))
        flight.run(lambda flight: flight.time_us >= 15e6)
        assert running.error is None
        truths.append(flight.rig.truth.numpy()[0].tobytes())
        flight.close()
    assert truths[0] == truths[1]
