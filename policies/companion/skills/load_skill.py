"""The skill that a policy is for: what a user names, checked and loaded before anything is sent."""

from policies.companion.image_client import StreamCamera
from policies.companion.names import SCRIPTED
from policies.companion.names import TASK as FOLLOW
from policies.companion.pilot import LearnedPilot, PilotError, load_pilot
from policies.companion.skills.driving import Driving
from policies.companion.skills.following import Following
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


def load_skill(name: str, camera: str, *, is_ordered_by_goto: bool) -> Skill:
    """What a policy can do: `scripted`, or a policy as `honeyguide play` takes it.

    Args:
        name: of the policy.
        camera: where images come from, for a skill that needs them.
        is_ordered_by_goto: a goto to the vehicle is an order to navigate or drive there.

    Raises:
        PilotError: no such policy, damaged, or made for another task, preset or layout.
        CameraUrlError: no such address.
    """
    if name == SCRIPTED:
        return Following(StreamCamera(camera), load_pilot(name))
    try:
        path = find_policy(name)
        policy, card = load_policy(path)
    except CheckpointError as error:
        raise PilotError(str(error)) from error
    if card.task == FOLLOW:
        return Following(StreamCamera(camera), LearnedPilot(policy, str(path)))
    if card.task == NAVIGATE:
        return Navigating(NavigationPilot(policy, str(path)), is_ordered_by_goto=is_ordered_by_goto)
    if card.task == NAVIGATE_ROVER:
        return Navigating(RoverNavigationPilot(policy, str(path)), is_ordered_by_goto=is_ordered_by_goto)
    if card.task == DRIVE:
        return Driving(DrivingPilot(policy, str(path)), is_ordered_by_goto=is_ordered_by_goto)
    known = f"{FOLLOW}, {NAVIGATE}, {NAVIGATE_ROVER} and {DRIVE}"
    raise PilotError(f"{path}: made for {card.task}; a companion flies policies of {known}")
