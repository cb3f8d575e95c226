"""The companion on board of a scenario whose vehicle a policy flies. It needs the extra `learn`."""

from collections.abc import Sequence
from pathlib import Path

from autopilot.mavlink.transport.links import Link
from mission.console.option_checks import UserError
from mission.flight import Flight
from mission.flight_config import FlightConfig
from mission.follow.lockstep import flight_with_companion, flight_with_driver, flight_with_navigator
from mission.scenario.scenario import Policy
from policies.companion.companion import Companion
from policies.companion.guard.settings import GuardSettings, guard_settings
from policies.companion.names import SCRIPTED
from policies.companion.pilot import PilotError
from policies.companion.skills.load_skill import load_follower
from policies.companion.vector_pilot import DRIVE, NAVIGATE, NAVIGATE_ROVER, DrivingPilot, NavigationPilot
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import CheckpointError, find_policy


def check_policy(policy: Policy) -> None:
    """Refuses a policy that is not there.

    Raises:
        UserError: it is not.
    """
    try:
        if policy.name != SCRIPTED:
            find_policy(policy.name)
    except CheckpointError as error:
        raise UserError(str(error)) from error


def flight_with_policy(
    config: FlightConfig, policy: Policy, links: Sequence[Link], folder: Path | None
) -> tuple[Flight, Companion]:
    """A flight, and its companion.

    Raises:
        UserError: no such policy, or none for this scenario.
    """
    guard = guard_settings(policy.guard) if policy.has_guard else GuardSettings(is_on=False)
    try:
        if config.owner is not None:
            return flight_with_companion(config, load_follower(policy.name), links=links, folder=folder, guard=guard)
        if policy.name == SCRIPTED:
            raise UserError("policy scripted: follows, so the scenario needs an owner")
        path = find_policy(policy.name)
        network, card = load_policy(path)
        if card.task == DRIVE:
            return flight_with_driver(config, DrivingPilot(network, str(path)), links=links, folder=folder, guard=guard)
        if card.task == NAVIGATE:
            pilot = NavigationPilot(network, str(path))
            return flight_with_navigator(config, pilot, links=links, folder=folder, guard=guard)
    except (PilotError, CheckpointError) as error:
        raise UserError(str(error)) from error
    hint = "; add an owner" if card.task not in (DRIVE, NAVIGATE, NAVIGATE_ROVER) else ""
    raise UserError(f"policy {policy.name}: made for {card.task}, which no step of a scenario uses{hint}")
