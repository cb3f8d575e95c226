"""Vehicles of one world that meet: momentum, impacts, rays and images, against closed forms."""

from functools import partial

import numpy as np
import pytest

from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from sim.bodies.vehicles import class_of
from sim.rig import Rig
from sim.sensors.camera import CameraPose, Renderer
from sim.sensors.fast_camera.fast_camera import QuickCamera
from sim.sensors.ground_ring import GroundRing
from sim.sensors.ray import VEHICLE
from sim.sensors.ring import RAYS, RingSensor
from sim.sensors.sensors import sensor_model
from sim.stepped import SteppedRig
from sim.wind import wind_model
from sim.world.neighbours import NeighbourTable
from sim.world.world import WorldConfig, build_world, shared_world

HIGH_M = 40.0
AHEAD = (0.5, 0.5, 0.5, 0.5)  # a camera that looks north


def stepped_by(engine):
    """What makes a rig with an engine, by its name."""
    if engine == "native":
        return Rig
    if engine == "pybullet":
        pytest.importorskip("pybullet")
        from sim.engines.bullet import BulletEngine

        return partial(SteppedRig, engine=BulletEngine)
    pytest.importorskip("jsbsim")
    from sim.engines.jsbsim_engine import JsbsimEngine

    return partial(SteppedRig, engine=JsbsimEngine)


class Met:
    """Vehicles of one world, written after each tick; the first boots at home, the others north of it."""

    def __init__(self, names, apart_m=3.0, order=None, engine="native"):
        self.names, self.order, self.make_rig = names, order or range(len(names)), stepped_by(engine)
        self.world = build_world(WorldConfig(size_m=100.0, hill_height_m=0.0, trees_per_ha=0.0))
        self.table = NeighbourTable(len(names))
        self.worlds = [shared_world(self.world, self.table.seen_by(i)) for i in range(len(names))]
        self.rigs = [self._rig(i, name, apart_m) for i, name in enumerate(names)]

    def _rig(self, i, name, apart_m):
        airframe = load_airframe(name)
        vehicle, body = class_of(airframe)
        model, air = sensor_model(noise_scale=0.0, home=DEFAULT_HOME), wind_model(0.0, 0.0, 0.0, 0.0)
        classes = {"body": body, "law": vehicle.law}
        rig = self.make_rig(
            airframe, self.worlds[i], model, air, home=DEFAULT_HOME, seed=i, start_ne_m=(apart_m * i, 0.0), **classes
        )
        self.table.join(i, rig.rows["truth"], rig.rows["tick"], body.outline(rig.rows["model"][0]))
        return rig

    def put(self, i, pos_ned, vel_ned=(0.0, 0.0, 0.0)):
        row = self.rigs[i].rows["body"][0]
        row["pos_ned"], row["vel_ned"] = pos_ned, vel_ned
        truth = self.rigs[i].rows["truth"][0]
        truth["pos_ned"], truth["vel_ned"] = pos_ned, vel_ned
        self.table.write()

    def advance(self, ticks):
        for _ in range(ticks):
            for i in self.order:
                self.rigs[i].advance(1)
            self.table.write()

    def truth(self, i):
        return self.rigs[i].rows["truth"][0]

    def momentum(self):
        masses = [load_airframe(name).body.mass_kg for name in self.names]
        return sum(mass * self.truth(i)["vel_ned"].astype(float) for i, mass in enumerate(masses))


@pytest.mark.parametrize("engine", ["native", "pybullet", "jsbsim"])
@pytest.mark.parametrize("names", [("x500", "x500"), ("x500", "f450"), ("f550", "x500")])
def test_a_collision_in_the_air_keeps_the_momentum_and_both_feel_the_same_blow(names, engine):
    met = Met(names, engine=engine)
    met.put(0, (0.0, 0.0, -HIGH_M), (2.0, 0.0, 0.0))
    met.put(1, (1.5, 0.0, -HIGH_M), (-1.0, 0.0, 0.0))
    before = met.momentum()
    met.advance(100)
    after = met.momentum()
    assert met.truth(0)["vel_ned"][0] < met.truth(1)["vel_ned"][0]  # they part again
    assert after[0] == pytest.approx(before[0], abs=0.1)  # the air takes some hundredths in 0.4 s
    impacts = [float(met.truth(i)["impact_speed"]) for i in (0, 1)]
    assert impacts == pytest.approx([3.0, 3.0], abs=0.05)
    assert met.truth(0)["is_crashed"] == met.truth(1)["is_crashed"] == 0


def test_a_fast_collision_crashes_both_even_the_one_that_stood():
    met = Met(("x500", "x500"))
    met.put(0, (0.0, 0.0, -HIGH_M), (8.0, 0.0, 0.0))
    met.put(1, (1.5, 0.0, -HIGH_M))
    met.advance(100)
    assert met.truth(0)["is_crashed"] == met.truth(1)["is_crashed"] == 1


@pytest.mark.parametrize("engine", ["native", "pybullet"])
def test_rovers_push_each_other(engine):
    met = Met(("rover", "rover"), engine=engine)
    met.advance(50)
    down = float(met.truth(0)["pos_ned"][2])
    met.put(0, (2.2, 0.0, down), (2.5, 0.0, 0.0))
    met.advance(12)
    speeds = [float(met.truth(i)["vel_ned"][0]) for i in (0, 1)]
    assert speeds[1] > 0.8
    assert sum(speeds) == pytest.approx(2.4, abs=0.25)  # of equal masses; locked wheels take 0.1 m/s in 0.05 s
    assert met.truth(1)["impact_speed"] == pytest.approx(met.truth(0)["impact_speed"], abs=0.1)


def test_the_order_of_advancing_does_not_matter():
    shots = []
    for order in ([0, 1, 2], [2, 0, 1]):
        met = Met(("x500", "x500", "x500"), order=order)
        met.put(0, (0.0, 0.0, -HIGH_M), (2.0, 0.0, 0.0))
        met.put(1, (1.2, 0.1, -HIGH_M), (-1.0, 0.0, 0.0))
        met.put(2, (0.6, 1.0, -HIGH_M), (0.0, -2.0, 0.0))
        met.advance(150)
        shots.append([rig.rows["body"].tobytes() for rig in met.rigs])
        assert met.truth(2)["impact_speed"] > 0.5
    assert shots[0] == shots[1]


def test_a_vehicle_does_not_touch_or_see_itself():
    met = Met(("x500", "rover"), apart_m=20.0)
    met.put(0, (0.0, 0.0, -HIGH_M))
    met.advance(20)
    assert met.truth(0)["impact_speed"] == 0.0
    assert np.isinf(RingSensor(met.rigs[0], met.worlds[0], 0.0, 0).measure(0.0)).all()


def test_range_finders_see_the_others():
    met = Met(("x500", "x500", "rover"))
    met.put(0, (0.0, 0.0, -HIGH_M))
    met.put(1, (5.0, 0.0, -HIGH_M))
    radius = float(met.rigs[1].rows["model"][0]["contact"]["hull_radius_m"])
    ring = RingSensor(met.rigs[0], met.worlds[0], 0.0, 0).measure(0.0)
    assert ring[0] == pytest.approx(5.0 - radius, abs=1e-4)
    assert np.isinf(ring[RAYS // 2])
    met.put(0, (6.0, 0.0, -5.0))  # above the rover
    met.rigs[0].advance(12)
    top = -float(met.truth(2)["pos_ned"][2]) + float(met.rigs[2].rows["model"][0]["hull_top_m"])
    seen = met.rigs[0].rows["sensors"]["samples"]["range"][0]
    here = -float(met.truth(0)["pos_ned"][2])
    assert seen["distance_m"] == pytest.approx(here - top, abs=0.05)  # it falls a centimetre or two between


def test_a_rovers_ring_sees_a_rover_and_not_what_flies_over_it():
    met = Met(("rover", "rover", "x500"))
    met.put(2, (-3.0, 0.0, -10.0))
    rear_m = float(met.rigs[1].rows["model"][0]["hull_rear_m"])
    ring = GroundRing(met.rigs[0], met.worlds[0], 0.0, 0).measure(0.0)
    assert ring[0] == pytest.approx(3.0 - rear_m, abs=0.01)
    assert np.isinf(ring[RAYS // 2])


def test_cameras_see_the_others_where_they_are():
    met = Met(("x500", "x500"))
    met.put(0, (0.0, 0.0, -10.0))
    met.put(1, (4.0, 0.0, -10.0))
    radius = float(met.rigs[1].rows["model"][0]["contact"]["hull_radius_m"])
    image = Renderer(met.worlds[0]).images([CameraPose((0.0, 0.0, -10.0), AHEAD)], 161, 91)
    assert image.kind[0, 45, 80] == VEHICLE
    assert image.depth_m[0, 45, 80] == pytest.approx(4.0 - radius, abs=0.01)
    own = Renderer(met.worlds[1]).images([CameraPose((1.0, 0.0, -10.0), AHEAD)], 161, 91)
    assert own.kind[0, 45, 80] != VEHICLE  # it looks along where it is itself
    camera = QuickCamera(met.worlds[0], 1, width=65, height=65)
    lens = camera.lenses.numpy()[0]
    lens["pos_ned"] = (0.0, 0.0, -10.0)
    camera.render()
    assert camera.kind.numpy()[0, 32, 32] == VEHICLE
    assert camera.depth_m.numpy()[0, 32, 32] == pytest.approx(4.0 - radius, abs=0.05)


def test_near_are_those_that_may_touch_within_a_frame():
    met = Met(("x500", "x500", "x500"), apart_m=10.0)
    assert met.table.near() == set()
    met.put(1, (1.5, 0.0, -0.2))
    assert met.table.near() == {0, 1}
