"""A vehicle of an engine's on a piece of ground, and what is done to it."""

import numpy as np

from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from common.kernels import TICK_S
from mission.flight import Flight, FlightConfig
from sim.bodies.vehicles import class_of
from sim.sensors.sensors import sensor_model
from sim.stepped import SteppedRig
from sim.wind import wind_model
from sim.world.world import WorldConfig, build_world

PLAIN = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0, size_m=100.0)
STEEP = WorldConfig(
    trees_per_ha=0.0, hill_height_m=7.0, hill_wavelength_m=60.0, octaves=1, size_m=200.0, clearing_radius_m=0.0,
    clearing_blend_m=1.0, seed=5,
)  # fmt: skip
SLOPES = [(0.0, 0.0), (20.0, -15.0), (-31.0, 12.0)]  # of 6 to 9 degrees


class Idle:
    """A board that asks for the same all the time, of all motors or of each."""

    is_fast = False

    def __init__(self, command=0.0):
        self._command = np.full(8, command, np.float32)

    def boot(self, is_chosen):
        pass

    def exchange(self, samples, truth, commands):  # noqa: ARG002
        commands.numpy()[:] = self._command


def rig_on(world, engine, command=0.0, airframe="x500", vehicle_count=1, wind_m_s=0.0):
    vehicle, body = class_of(load_airframe(airframe))
    return SteppedRig(
        load_airframe(airframe), build_world(world), sensor_model(0.0, DEFAULT_HOME), wind_model(wind_m_s, 0.0),
        home=DEFAULT_HOME, engine=engine, board=lambda _: Idle(command), body=body, law=vehicle.law,
        vehicle_count=vehicle_count,
    )  # fmt: skip


def run(rig, seconds):
    rig.advance(round(seconds / TICK_S))
    return rig.truth_row()


def drop(rig, north, east, up_m, i=0):
    """Puts a vehicle level and still over the ground."""
    body = rig.arrays.body.numpy()
    body["pos_ned"][i] = (north, east, -float(rig.world.height(north, east)) - up_m)
    body["vel_ned"][i] = 0.0


def short_flight(engine):
    """Modes and places [m] of each frame of a take-off, a goto and a landing, without sensor noise."""
    flight = Flight(FlightConfig(engine=engine, noise=0.0, world=PLAIN))
    modes, places = [], []

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(6.0)
        await drone.goto_ned(8.0, 3.0, -7.0)
        await drone.land()

    running = flight.drone.start(script(flight.drone))
    while not running.is_done:
        flight.frame()
        modes.append(int(flight.controller.state.mode))
        places.append(flight.rig.truth_row()["pos_ned"].copy())
    assert running.error is None
    flight.close()
    return np.array(modes), np.array(places)
