"""A rover that a policy navigates between trees and walls, by its companion, in lockstep."""

from math import isnan

import numpy as np
import pytest

from autopilot.interface.vehicle_state import Mode
from mission.flight import FlightConfig
from mission.follow.lockstep import flight_with_navigator
from mission.script import take_off
from policies.companion.companion import MISFIT
from policies.companion.engagement import Phase
from policies.companion.vector_pilot import RoverNavigationPilot
from policies.learn.export.policy_file import load_policy
from policies.pretrained.pretrained_policies import pretrained
from sim.world.forest_world import WALLED_FOREST
from tests.unit.mission.follow.forest_flight import config, miss_m
from tests.unit.mission.follow.goto_flight import advance, goto_fields

AUTOPILOT, COMPANION = 1, 191


def shipped_pilot():
    path = pretrained("NavigateRover")
    return RoverNavigationPilot(load_policy(path)[0], str(path))


def standing(seed, **parameters):
    world = WALLED_FOREST.model_copy(update={"seed": seed})
    rover = FlightConfig(airframe="rover", is_forest=True, world=world, seed=seed, parameters=parameters)
    flight, companion = flight_with_navigator(rover, shipped_pilot())

    async def arm(drone):
        await drone.wait_ready()
        await drone.arm()

    flight.fly(arm, seconds=60.0)
    advance(flight, 1.0)
    flight.rig.forget_impacts()
    return flight, companion


@pytest.mark.parametrize("reverses", [0.0, 1.0])
@pytest.mark.parametrize("component", [AUTOPILOT, COMPANION])
def test_a_goto_is_driven_to_between_trees_and_walls_and_handed_back(component, reverses):
    flight, companion = standing(9, HG_RO_OFFB_BODY=reverses)
    goal_ned = (32.0, 18.0, -float(flight.world.height(32.0, 18.0)))
    flight.drone.send("COMMAND_INT", **goto_fields(flight, goal_ned, component))
    advance(flight, 1.0)
    assert companion.phase is Phase.FLYING
    assert isnan(companion.skill.setpoint(companion.action, companion.vehicle.own)[1])  # its heading is its course
    advance(flight, 60.0, lambda: companion.phase is not Phase.FLYING)
    assert np.linalg.norm(flight.rig.rows["truth"][0]["vel_ned"]) < 3.5  # slowed down, from 5 m/s
    advance(flight, 10.0, lambda: companion.phase is Phase.WAITING)
    advance(flight, 3.0)
    assert flight.controller.state.mode is Mode.HOLD
    assert miss_m(flight, goal_ned) < 4.0
    assert float(flight.rig.rows["truth"][0]["impact_speed"]) == 0.0
    flight.close()


def test_it_flies_no_drone():
    flight, companion = flight_with_navigator(config(), shipped_pilot())
    flight.fly(take_off, seconds=40.0)
    advance(flight, 1.0)
    assert companion.trouble == MISFIT
    flight.close()
