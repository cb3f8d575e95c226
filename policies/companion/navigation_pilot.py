"""Who navigates a companion: a policy file of Navigate, checked against the task it was made for."""

import numpy as np
import torch

from policies.companion.pilot import PilotError
from policies.companion.skill import Floats
from policies.learn.networks.observations import Observation
from policies.learn.networks.policy import Policy
from policies.tasks.flight.own_state import ACTIONS
from policies.tasks.layout import Layout, LayoutError
from policies.tasks.navigate.observe import LAYOUT_VERSION, frame_elements

TASK = "Navigate"


class NavigationPilot:
    """A trained policy: its most probable action.

    Args:
        policy: made for Navigate, on ranges.
        source: where it came from, for the message.

    Raises:
        PilotError: it was made for something else.
    """

    frame_size = len(frame_elements(has_rays=True))

    def __init__(self, policy: Policy, source: str) -> None:
        layout = policy.layout
        here = Layout(TASK, LAYOUT_VERSION, frame_elements(has_rays=True), ACTIONS, stack=layout.stack)
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
        """The action for an observation: four numbers in [-1, 1]."""
        with torch.inference_mode():
            observation = Observation(torch.from_numpy(vector)[None], self._image)
            actions, self._memory = self._policy.act(observation, self._memory, None)
            bounded: Floats = self._policy.bounded(actions)[0].numpy()
        return bounded
