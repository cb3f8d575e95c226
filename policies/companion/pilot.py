"""Who flies a companion: a policy file, checked against the task it was made for, or the scripted follower.

In: what a user names. Out: a `Pilot`; what cannot fly is refused with one sentence before anything is sent.
"""

from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from common.attitude import Vector
from policies.companion.belief import owner_belief
from policies.companion.names import SCRIPTED, TASK
from policies.companion.observation import image_layout
from policies.companion.skills.following import Pilot
from policies.experts.follower import ScriptedFollower
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import CheckpointError, find_policy
from policies.learn.networks.observations import Observation
from policies.learn.networks.policy import Policy
from policies.shirt_detector import chest_hfrd
from policies.tasks.flight.own_state import ACTIONS
from policies.tasks.follow_me.observe import (
    EGO,
    EGO_BLIND,
    IMAGE_SHAPE,
    LAYOUT_VERSION,
    TRACKED,
    vector_elements,
)
from policies.tasks.follow_me.tracked.vector import TRACKED_ELEMENTS
from policies.tasks.layout import Layout, LayoutError

Floats = NDArray[np.float32]


class PilotError(ValueError):
    """A policy that cannot fly; the text is one sentence for the user."""


class LearnedPilot:
    """A trained policy: its most probable action, its memory kept from image to image.

    Where the owner is seen is what it believes, or if it has no such beliefs where their shirt is in the image.

    Args:
        policy: made for FollowMe in a preset whose actions are setpoints.
        source: where it came from, for the message.

    Raises:
        PilotError: it was made for something else.
    """

    image_shape = IMAGE_SHAPE

    def __init__(self, policy: Policy, source: str) -> None:
        layout = policy.layout
        is_blind = len(layout.frame) == len(vector_elements(int(EGO_BLIND)))
        self.kind = int(EGO_BLIND) if is_blind else int(EGO)
        try:
            image_layout(self.kind).require(layout, source)
        except LayoutError as error:
            raise PilotError(str(error)) from error
        self._policy = policy
        self._memory = policy.start_memory(1)
        self._belief = owner_belief(policy)
        self._down = [k for k, element in enumerate(layout.frame) if element.name in ("down_frd_x", "down_frd_y")]
        self.owner_hfrd: Vector | None = None
        torch.set_num_threads(1)  # one small image: more threads only wait for each other
        self.act(np.zeros(layout.observation_size, np.float32), np.zeros(self.image_shape, np.uint8))  # warms up
        self.reset()

    def reset(self) -> None:
        self._memory = self._policy.start_memory(1)
        self.owner_hfrd = None

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:
        with torch.inference_mode():
            observation = Observation(torch.from_numpy(vector)[None], torch.from_numpy(image)[None])
            actions, self._memory, beliefs = self._policy.act_and_believe(observation, self._memory)
            bounded: Floats = self._policy.bounded(actions)[0].numpy()
        if self._belief is not None and beliefs is not None:
            self.owner_hfrd = self._belief.position(beliefs)
        else:
            down_x, down_y = (float(vector[k]) for k in self._down)
            self.owner_hfrd = chest_hfrd(image, (down_x, down_y))
        return bounded


class TrackedPilot:
    """A trained policy that looks at no image: senses tell it of the owner.

    Args:
        policy: made for FollowMe with `observation=tracked`.
        source: where it came from, for the message.

    Raises:
        PilotError: it was made for something else.
    """

    image_shape = IMAGE_SHAPE  # of the senses
    kind = int(TRACKED)

    def __init__(self, policy: Policy, source: str) -> None:
        try:
            Layout(TASK, LAYOUT_VERSION, TRACKED_ELEMENTS, ACTIONS, stack=policy.layout.stack).require(
                policy.layout, source
            )
        except LayoutError as error:
            raise PilotError(str(error)) from error
        self._policy = policy
        self._frames: Floats = np.zeros((policy.layout.stack, len(TRACKED_ELEMENTS)), np.float32)  # oldest first
        self.owner_hfrd: Vector | None = None
        torch.set_num_threads(1)
        self.reset()
        self.act(self._frames[-1], np.zeros(self.image_shape, np.uint8))
        self.reset()

    def reset(self) -> None:
        """As at an episode's start."""
        self._memory = self._policy.start_memory(1)
        self._frames[:] = 0.0

    def act(self, vector: Floats, image: NDArray[np.uint8]) -> Floats:  # noqa: ARG002  (others look at it)
        self._frames[:-1] = self._frames[1:]
        self._frames[-1] = vector
        with torch.inference_mode():
            observation = Observation(torch.from_numpy(self._frames.ravel())[None], None)
            actions, self._memory = self._policy.act(observation, self._memory)
            bounded: Floats = self._policy.bounded(actions)[0].numpy()
        return bounded


def follower_of(policy: Policy, source: str) -> Pilot:
    """The pilot of a policy of FollowMe: by images, or by what senses tell.

    Raises:
        PilotError: it was made for something else.
    """
    is_tracked = TRACKED_ELEMENTS[-1] in policy.layout.frame
    return TrackedPilot(policy, source) if is_tracked else LearnedPilot(policy, source)


def load_pilot(name: str) -> Pilot:
    """The pilot that a user means: `scripted`, or a policy as `honeyguide play` takes it.

    Raises:
        PilotError: no such policy, damaged, or made for another task, preset or layout.
    """
    if name == SCRIPTED:
        return ScriptedFollower()
    try:
        path: Path = find_policy(name)
        policy, card = load_policy(path)
    except CheckpointError as error:
        raise PilotError(str(error)) from error
    if card.task != TASK:
        raise PilotError(f"{path}: made for {card.task}; a companion flies policies of {TASK}")
    return follower_of(policy, str(path))
