"""What a policy that looks at no image is told and says in flight, by the very kernel functions it was trained with.

In: telemetry, and what senses know. Out: one observation vector, and the setpoint that an action leads to: it goes on
from what was flown last, which a guard may have changed.
"""

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.attitude import Vector, yaw_of
from common.warp_start import start_warp
from policies.companion.observation import write_own_row
from policies.companion.senses.senses import Senses
from policies.companion.telemetry import Own
from policies.tasks.flight.own_state import Command, OwnState
from policies.tasks.follow_me.tracked.vector import (
    REACH_M,
    SECTORS,
    TRACKED_ELEMENTS,
    next_command_rows,
    observe_tracked_rows,
)

Floats = NDArray[np.float32]


class TrackedObserver:
    """One vehicle's observations and commands, of a policy that looks at no image.

    Args:
        senses: what it is told; fed by somebody else.
    """

    def __init__(self, senses: Senses) -> None:
        start_warp()
        self._senses = senses
        own, action, command = wp.zeros(1, dtype=OwnState), wp.zeros(1, dtype=wp.vec4), wp.zeros(1, dtype=Command)
        age, has_depth = wp.zeros(1, dtype=float), wp.zeros(1, dtype=int)
        nearness, out = wp.zeros((1, SECTORS), dtype=float), wp.zeros((1, len(TRACKED_ELEMENTS)), dtype=float)
        self._own: NDArray[Any] = own.numpy()  # live views, as of the others
        self._action: Floats = action.numpy()
        self._command: NDArray[Any] = command.numpy()
        self._age_s: Floats = age.numpy()
        self._has_depth: NDArray[Any] = has_depth.numpy()
        self._nearness: Floats = nearness.numpy()
        self._out: Floats = out.numpy()
        self._inputs = [own, command, age, senses.seen.filters, has_depth, nearness, out]
        self._ask = wp.launch(next_command_rows, 1, [action, own, command], record_cmd=True)

    def begin(self, own: Own) -> None:
        """It takes over: goes on as the vehicle moves."""
        self.flown((own.vel_ned[0], own.vel_ned[1], 0.0), 0.0)

    def flown(self, vel_ned: Vector, yaw_rate: float) -> None:
        """From what the next action goes on."""
        self._command["vel_ned"][0] = vel_ned
        self._command["yaw_rate"][0] = yaw_rate if yaw_rate == yaw_rate else 0.0

    def vector(self, own: Own, image_age_s: float) -> Floats:
        """The observation as of now.

        Args:
            own: telemetry.
            image_age_s: since the newest image was taken.
        """
        senses = self._senses
        write_own_row(self._own[0], own)
        self._age_s[0] = image_age_s
        self._has_depth[0] = int(senses.map.has_depth)  # measured, not told from colours
        near_m = senses.map.nearest_m(own.pos_ned, yaw_of(own.q_ned_from_frd), own.boot_us)
        self._nearness[0] = np.clip(1.0 - near_m / float(REACH_M), 0.0, 1.0)
        self._inputs[3] = senses.seen.at(own.boot_us)
        wp.launch(observe_tracked_rows, 1, self._inputs)
        vector: Floats = self._out[0]
        return vector

    def setpoint(self, action: Floats, own: Own) -> tuple[Vector, float]:
        """Velocity in ned [m/s] and yaw rate [rad/s] of an action in [-1, 1], shape (4,)."""
        self._own["q_ned_from_frd"][0] = own.q_ned_from_frd
        self._action[0] = action
        self._ask.launch()
        row = self._command[0]
        north, east, down = (float(element) for element in row["vel_ned"])
        return (north, east, down), float(row["yaw_rate"])
