"""The flight that the options of `honeyguide follow` describe."""

from typing import cast

from mission.flight_config import FlightConfig, OwnerConfig
from mission.flight_options import flight_config
from mission.flight_settings import FollowOptions, Pace
from mission.follow.vehicle_setup import BY_SIGHT
from policies.tasks.follow_me.world import FOLLOW_WORLD


def follow_config(options: FollowOptions, *, has_scanner: bool = False) -> FlightConfig:
    """The flight that the options describe: the world of training, with their seed, trees and hills.

    Args:
        options: as given.
        has_scanner: it carries what a policy of Navigate sees by.
    """
    config = flight_config(options.model_copy(update={"owner": None}), None)
    own = {"seed": options.world_seed, "trees_per_ha": options.trees_per_ha, "hill_height_m": options.hill_height_m}
    world = FOLLOW_WORLD.model_copy(update=own)
    owner = OwnerConfig(pace=cast(Pace, options.owner))
    parameters = BY_SIGHT | config.parameters if options.board == "own" else config.parameters
    return config.model_copy(
        update={"world": world, "owner": owner, "is_forest": has_scanner, "parameters": parameters}
    )
