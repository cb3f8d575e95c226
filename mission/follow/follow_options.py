"""The flight that the options of `honeyguide follow` describe.

Light to import: what is wrong is told before the policy's packages are loaded.
"""

from typing import cast

from common.airframe import AirframeError, load_airframe
from common.params import ParameterError
from mission.console.option_checks import UserError, check_owner, speed_of
from mission.flight_config import FlightConfig, OwnerConfig, flight_parameters
from mission.flight_options import flight_config
from mission.flight_settings import FollowOptions, Pace
from policies.companion.names import SCRIPTED
from policies.learn.export.policy_path import CheckpointError, find_policy
from policies.tasks.follow_me.world import FOLLOW_WORLD


def check_follow_options(options: FollowOptions) -> None:
    """Refuses what can be seen to be wrong before anything heavy is loaded.

    Raises:
        UserError: an option, an airframe, a parameter or the policy's name is wrong.
    """
    check_owner(options)
    speed_of(options.speed)
    config = follow_config(options)
    try:
        flight_parameters(config, load_airframe(config.airframe))
        if options.policy not in (None, SCRIPTED):
            find_policy(options.policy)
    except (AirframeError, ParameterError, CheckpointError) as error:
        raise UserError(str(error)) from error


def follow_config(options: FollowOptions) -> FlightConfig:
    """The flight that the options describe: the world of training, with their seed, trees and hills."""
    config = flight_config(options.model_copy(update={"owner": None}), None)
    own = {"seed": options.world_seed, "trees_per_ha": options.trees_per_ha, "hill_height_m": options.hill_height_m}
    world = FOLLOW_WORLD.model_copy(update=own)
    return config.model_copy(update={"world": world, "owner": OwnerConfig(pace=cast(Pace, options.owner))})
