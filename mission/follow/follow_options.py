"""What `honeyguide follow` is given, and the flight that this describes.

Light to import: what is wrong is told before the policy's packages are loaded.
"""

from dataclasses import dataclass

from common.airframe import AirframeError, load_airframe
from common.params import ParameterError
from mission.flight_config import FlightConfig, OwnerConfig, Pace, flight_parameters
from mission.flight_options import FlightOptions, UserError, flight_config, speed_of
from policies.companion.names import SCRIPTED
from policies.learn.export.policy_path import CheckpointError, find_policy
from policies.tasks.follow_me.world import FOLLOW_WORLD


@dataclass(frozen=True, slots=True)
class FollowOptions:
    """The options of `honeyguide follow`, as given."""

    flight: FlightOptions
    pace: Pace
    policy: str | None  # None: the shipped one, or else the script
    seconds: float
    has_film: bool


def check_follow_options(options: FollowOptions) -> None:
    """Refuses what can be seen to be wrong before anything heavy is loaded.

    Raises:
        UserError: an option, an airframe, a parameter or the policy's name is wrong.
    """
    speed_of(options.flight.speed)
    config = follow_config(options)
    try:
        flight_parameters(config, load_airframe(config.airframe))
        if options.policy not in (None, SCRIPTED):
            find_policy(options.policy)
    except (AirframeError, ParameterError, CheckpointError) as error:
        raise UserError(str(error)) from error


def follow_config(options: FollowOptions) -> FlightConfig:
    """The flight that the options describe: the world of training, with their seed, trees and hills."""
    given = options.flight
    config = flight_config(given, None)
    own = {"seed": given.world_seed, "trees_per_ha": given.trees_per_ha, "hill_height_m": given.hill_height_m}
    world = FOLLOW_WORLD.model_copy(update=own)
    return config.model_copy(update={"world": world, "owner": OwnerConfig(pace=options.pace)})
