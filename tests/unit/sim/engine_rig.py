"""One or more vehicles on an engine, for the tests: a world, commands by the clock, no flight controller."""

import numpy as np

from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from common.kernels import TICK_S
from sim.bodies.vehicles import class_of
from sim.sensors.sensors import sensor_model
from sim.stepped import SteppedRig
from sim.wind import wind_model
from sim.world.boxes import BoxesMap, box_type
from sim.world.world import WorldConfig, WorldMap, build_world

PLAIN = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0, size_m=100.0)
STEEP = WorldConfig(
    trees_per_ha=0.0, hill_height_m=7.0, hill_wavelength_m=60.0, octaves=1, size_m=200.0, clearing_radius_m=0.0,
    clearing_blend_m=1.0, seed=5,
)  # fmt: skip


class Sequence:
    """A board that commands by the clock.

    Args:
        commands: of the first channels; one for all time, or pairs of the time [s] until which it holds and it.
    """

    is_fast = False

    def __init__(self, commands):
        self._commands = commands if isinstance(commands, list) else [(np.inf, commands)]
        self._ticks = 0

    def boot(self, is_chosen):
        pass

    def give(self, samples, truth):  # noqa: ARG002
        self._ticks += 1

    def take(self, commands):
        asked = next(command for until_s, command in self._commands if self._ticks * TICK_S <= until_s)
        rows = commands.numpy()
        rows[:] = asked if np.isscalar(asked) else np.resize([*asked, *np.zeros(8 - len(asked))], 8)


def with_boxes(*rows):
    """A plain with boxes: rows of `Box`."""
    bare = build_world(PLAIN)
    placed = BoxesMap(np.array(list(rows), dtype=box_type()))
    kernel = bare.kernel
    kernel.boxes = placed.kernel("cpu")
    return WorldMap(PLAIN, bare.terrain, bare.forest, bare.walls, kernel, placed)


def rig_on(world, engine, commands=0.0, airframe="x500", vehicle_count=1, wind_m_s=0.0):
    """A rig of an airframe in a world that is made or configured."""
    vehicle, body = class_of(load_airframe(airframe))
    return SteppedRig(
        load_airframe(airframe), world if isinstance(world, WorldMap) else build_world(world),
        sensor_model(0.0, DEFAULT_HOME), wind_model(wind_m_s, 0.0), home=DEFAULT_HOME, engine=engine,
        board=lambda _: Sequence(commands), body=body, law=vehicle.law, vehicle_count=vehicle_count,
    )  # fmt: skip


def run(rig, seconds):
    """The truth of the first vehicle then: a copy."""
    rig.advance(round(seconds / TICK_S))
    return rig.truth_row().copy()


def put(rig, north, east, up_m, yaw=0.0, i_vehicle=0):
    """A vehicle level and still over the ground, at a heading [rad]."""
    body = rig.arrays.body.numpy()
    body["pos_ned"][i_vehicle] = (north, east, -float(rig.world.height(north, east)) - up_m)
    body["vel_ned"][i_vehicle] = 0.0
    body["q_ned_from_frd"][i_vehicle] = (0.0, 0.0, np.sin(0.5 * yaw), np.cos(0.5 * yaw))
