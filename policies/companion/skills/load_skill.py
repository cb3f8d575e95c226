"""The skill that a policy is for: what a user names, checked and loaded before anything is sent."""

from pathlib import Path

from policies.companion.guard.settings import GuardSettings
from policies.companion.image_client import StreamCamera
from policies.companion.names import SCRIPTED
from policies.companion.names import TASK as FOLLOW
from policies.companion.pilot import PilotError, follower_of, load_pilot
from policies.companion.skills.driving import Driving
from policies.companion.skills.following import Following, Pilot
from policies.companion.skills.navigating import Navigating
from policies.companion.skills.skill import Skill
from policies.companion.vector_pilot import (
    DRIVE,
    NAVIGATE,
    NAVIGATE_ROVER,
    DrivingPilot,
    NavigationPilot,
    RoverNavigationPilot,
)
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import CheckpointError, find_policy
from policies.learn.networks.policy import Policy

_NAVIGATORS = {NAVIGATE: NavigationPilot, NAVIGATE_ROVER: RoverNavigationPilot}


def load_follower(name: str) -> Pilot | NavigationPilot:
    """Who follows somebody: `scripted`, or a policy of FollowMe, Navigate or NavigateRover.

    Raises:
        PilotError: no such policy, damaged, or made for another task, preset or layout.
    """
    if name == SCRIPTED:
        return load_pilot(name)
    path, policy, task = _loaded(name)
    if task == FOLLOW:
        return follower_of(policy, str(path))
    if task in _NAVIGATORS:
        return _NAVIGATORS[task](policy, str(path))
    known = ", ".join(_NAVIGATORS)
    raise PilotError(f"{path}: made for {task}; those follow who were made for {FOLLOW}, {known}")


def load_skill(
    name: str, camera: str, *, is_ordered_by_goto: bool, follows: bool = False, guard: GuardSettings | None = None
) -> Skill:
    """What a policy can do: `scripted`, or a policy as `honeyguide play` takes it.

    Args:
        name: of the policy.
        camera: where images come from, for a skill that needs them.
        is_ordered_by_goto: a goto to the vehicle is an order to navigate or drive there.
        follows: a policy of Navigate goes after the owner, not to gotos.
        guard: who bounds it; None: as it ships.

    Raises:
        PilotError: no such policy, damaged, or made for another task, preset or layout.
        CameraUrlError: no such address.
    """
    if name == SCRIPTED:
        return _following(camera, load_pilot(name), guard)
    path, policy, task = _loaded(name)
    if task == FOLLOW:
        return _following(camera, follower_of(policy, str(path)), guard)
    if task in _NAVIGATORS:
        eye = StreamCamera(camera) if follows else None
        pilot = _NAVIGATORS[task](policy, str(path))
        return Navigating(pilot, is_ordered_by_goto=is_ordered_by_goto, camera=eye, guard=guard)
    if follows:
        raise PilotError(f"{path}: made for {task}, and does not follow anybody")
    if task == DRIVE:
        return Driving(DrivingPilot(policy, str(path)), is_ordered_by_goto=is_ordered_by_goto, guard=guard)
    known = ", ".join((FOLLOW, *_NAVIGATORS))
    raise PilotError(f"{path}: made for {task}; a companion flies policies of {known} and {DRIVE}")


def _following(camera: str, pilot: Pilot, guard: GuardSettings | None) -> Following:
    return Following(StreamCamera(camera), pilot, guard or GuardSettings())


def _loaded(name: str) -> tuple[Path, Policy, str]:
    """Where a policy is, the policy, and the task it was made for."""
    try:
        path = find_policy(name)
        policy, card = load_policy(path)
    except CheckpointError as error:
        raise PilotError(str(error)) from error
    return path, policy, card.task
