"""The flight controller of `autopilot` as a board: the same that is fused into the fast rig's launch."""

from typing import Any

import warp as wp

from autopilot.advance import autopilot_kernel
from sim.rig import Rig


class OwnBoard:
    """See sim/boards/board.py.

    Args:
        rig: whose vehicles it flies; its setpoints and parameters are the rig's.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._kernel = autopilot_kernel(rig.law)

    def boot(self, is_chosen: Any) -> None:
        """Its rows are the rig's, which has powered them on."""

    def exchange(self, samples: Any, truth: Any, commands: Any) -> None:  # noqa: ARG002  (it is not told the truth)
        arrays = self._rig.arrays
        inputs = [arrays.autopilot, samples, arrays.tick, commands]
        wp.launch(self._kernel, dim=self._rig.vehicle_count, inputs=inputs, device=self._rig.device)
