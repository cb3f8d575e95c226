"""The flight controller of `autopilot` as a board: the same that is fused into the fast rig's launch."""

from typing import Any

import warp as wp

from autopilot.advance import autopilot_kernel
from sim.launches import RecordedLaunches
from sim.rig import Rig


class OwnBoard:
    """See sim/boards/board.py.

    Args:
        rig: whose vehicles it flies; its setpoints and parameters are the rig's.
    """

    is_fast = False

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._kernel = autopilot_kernel(rig.law)
        self._launches = RecordedLaunches(self._record)

    def boot(self, is_chosen: Any) -> None:
        """Its rows are the rig's, which has powered them on."""

    def give(self, samples: Any, truth: Any) -> None:  # noqa: ARG002  (it is not told the truth)
        self._samples = samples

    def take(self, commands: Any) -> None:
        self._launches.of(self._samples, commands)[0].launch()

    def _record(self, samples: Any, commands: Any) -> list[Any]:
        rig = self._rig
        inputs = [rig.arrays.autopilot, samples, rig.arrays.tick, commands]
        return [wp.launch(self._kernel, rig.vehicle_count, inputs, device=rig.device, record_cmd=True)]
