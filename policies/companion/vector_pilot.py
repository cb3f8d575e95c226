"""Who navigates or drives a companion: policy files of tasks that show a vector, checked against their task."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
import torch

from policies.companion.pilot import PilotError
from policies.companion.skills.skill import Floats
from policies.learn.networks.observations import Observation
from policies.learn.networks.policy import Policy
from policies.tasks.drive import observe as drive
from policies.tasks.flight.own_state import ACTIONS
from policies.tasks.layout import Layout, LayoutError
from policies.tasks.navigate import observe as navigate

NAVIGATE, NAVIGATE_ROVER, DRIVE = "Navigate", "NavigateRover", "Drive"


class VectorPilot:
    """A trained policy: its most probable action. A subclass says of which task.

    Args:
        policy: made for the task.
        source: where it came from, for the message.

    Raises:
        PilotError: it was made for something else.
    """

    task: ClassVar[Layout]  # of one frame; a policy may take several

    def __init__(self, policy: Policy, source: str) -> None:
        layout = policy.layout
        here = replace(self.task, stack=layout.stack)
        try:
            here.require(layout, source)
        except LayoutError as error:
            raise PilotError(str(error)) from error
        self.stack = layout.stack
        self._policy = policy
        self._memory = policy.start_memory(1)
        self._image = torch.zeros((1, 0, 0, 0), dtype=torch.uint8)
        torch.set_num_threads(1)  # a small network: more threads only wait for each other
        self.act(np.zeros(layout.observation_size, np.float32))  # warms up
        self.reset()

    def reset(self) -> None:
        """Forgets what came before."""
        self._memory = self._policy.start_memory(1)

    def act(self, vector: Floats) -> Floats:
        """The action for an observation: numbers in [-1, 1]."""
        with torch.inference_mode():
            observation = Observation(torch.from_numpy(vector)[None], self._image)
            actions, self._memory = self._policy.act(observation, self._memory, None)
            bounded: Floats = self._policy.bounded(actions)[0].numpy()
        return bounded


class NavigationPilot(VectorPilot):
    """Made for Navigate, on ranges."""

    task = Layout(NAVIGATE, navigate.LAYOUT_VERSION, navigate.frame_elements(has_rays=True), ACTIONS)
    frame_size = task.frame_size
    drives: ClassVar = False
    shown_m: ClassVar = navigate.GOAL_MAX_M
    arrived_m: ClassVar = 2.5  # by the estimate, inside of training's radius: the estimate may be off


class RoverNavigationPilot(NavigationPilot):
    """Made for NavigateRover, on ranges."""

    task = replace(NavigationPilot.task, task=NAVIGATE_ROVER)
    drives: ClassVar = True
    shown_m: ClassVar = navigate.ROVER_GOAL_MAX_M
    arrived_m: ClassVar = 2.0


class DrivingPilot(VectorPilot):
    """Made for Drive: to reach a pose, or to park."""

    task = Layout(DRIVE, drive.LAYOUT_VERSION, drive.FRAME, drive.ACTIONS)
