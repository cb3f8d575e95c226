"""Flights in a world of one's own, over MAVLink: from roof to roof, and a camera and a range finder that see them."""

import numpy as np
import pytest
import trimesh

from common.airframe import load_airframe
from mission.flight import Flight, FlightConfig
from sim.bodies.contact import resting_height_m
from sim.world.custom.world_file import BoxSolid, MeshSolid, PadSolid, WorldFile

X500 = load_airframe("x500")


def house(folder):
    """A closed mesh with a flat roof of 6 m by 8 m, 4 m above its floor."""
    mesh = trimesh.creation.box((6.0, 8.0, 4.0)).subdivide().subdivide()
    mesh.apply_translation((0.0, 0.0, 2.0))
    mesh.export(folder / "house.stl")
    return folder / "house.stl"


@pytest.mark.parametrize("engine", ["native", "pybullet", "jsbsim"])
def test_a_vehicle_takes_off_from_one_roof_and_lands_on_another(tmp_path, engine):
    world = WorldFile(
        meshes=[MeshSolid(file=house(tmp_path), position_ned_m=(20.0, 5.0), heading_deg=20.0)],
        boxes=[BoxSolid(position_ned_m=(0.0, 0.0), size_m=(3.0, 3.0, 1.0))],
        pads=[PadSolid(position_ned_m=(20.0, 5.0, -4.0))],
    )
    flight = Flight(FlightConfig(world=world, engine=engine, noise=0.0))
    truth = flight.rig.rows["truth"]
    standing = resting_height_m(X500)
    assert -truth[0]["pos_ned"][2] == pytest.approx(1.0 + standing, abs=0.01)

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(8.0)
        await drone.goto_ned(20.0, 5.0, -8.0)
        await drone.sleep(2.0)
        assert drone.latest("DISTANCE_SENSOR").current_distance == pytest.approx(
            100.0 * (-truth[0]["pos_ned"][2] - 4.05), abs=3.0
        )
        await drone.land()
        await drone.wait_disarmed()

    running = flight.fly(script)
    assert running.error is None, running.error
    start = truth[0]["pos_ned"].copy()
    for _ in range(250):
        flight.frame()
    place = truth[0]["pos_ned"]
    assert np.hypot(place[0] - 20.0, place[1] - 5.0) < 1.0
    assert -place[2] == pytest.approx(4.05 + standing, abs=1e-3 if engine == "native" else 0.01)
    assert np.abs(place - start).max() < 1e-3
    assert truth[0]["is_crashed"] == 0
