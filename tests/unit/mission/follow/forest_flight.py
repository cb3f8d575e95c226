"""Rig of the tests of navigating: flights in a sparse forest, in lockstep."""

from math import dist

from mission.flight import FlightConfig
from mission.follow.lockstep import flight_with_navigator
from mission.script import take_off
from policies.companion.vector_pilot import NavigationPilot
from policies.learn.export.policy_file import load_policy
from policies.pretrained.pretrained_policies import pretrained
from sim.world.forest_world import FOREST
from tests.unit.mission.follow.goto_flight import advance, goto_fields

AUTOPILOT, COMPANION = 1, 191
SPARSE = FOREST.model_copy(update={"seed": 3, "trees_per_ha": 100.0})
DENSE = FOREST.model_copy(update={"seed": 3, "trees_per_ha": 600.0})


def config(**changed):
    return FlightConfig(**{"is_forest": True, "world": SPARSE, "seed": 3} | changed)


def shipped_pilot():
    path = pretrained("Navigate")
    return NavigationPilot(load_policy(path)[0], str(path))


def hovering(folder=None, *, is_reported=True, links=(), **changed):
    """A flight that holds in the air, and its companion."""
    options = {"is_reported": is_reported, "links": links, "folder": folder}
    flight, companion = flight_with_navigator(config(**changed), shipped_pilot(), **options)
    flight.fly(take_off, seconds=40.0)
    advance(flight, 2.0)
    return flight, companion


def place(flight, north, east):
    """2 m above the ground, in ned [m]."""
    return north, east, -float(flight.world.height(north, east)) - 2.0


def send_goto(flight, goal_ned, component):
    flight.drone.send("COMMAND_INT", **goto_fields(flight, goal_ned, component))


def miss_m(flight, goal_ned):
    """How far the vehicle truly is from a place."""
    return dist([float(axis) for axis in flight.rig.rows["truth"][0]["pos_ned"]], goal_ned)
