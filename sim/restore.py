"""Puts chosen vehicles of a rig where those of a bank are, on the device: how an episode starts without power-on.

In: a bank of vehicles in flight, and per vehicle of the rig which of the bank it takes and its new seed. Out: every
row of the chosen vehicles, their estimators' covariances and waiting samples too. Launched between two advances.
"""

from typing import Any

import warp as wp

from sim.rig import Rig, row_arrays

wp.set_module_options({"enable_backward": False})

_WORD = wp.uint32  # the size of every struct of a row is a multiple of it
_LANES = 32  # threads that share the words of a row on a GPU


@wp.struct
class RowPair:
    """One array of the rig and the same array of the bank, as words: (vehicles, words of a row)."""

    target: wp.array2d[_WORD]
    source: wp.array2d[_WORD]


@wp.kernel(enable_backward=False)
def copy_rows(pairs: wp.array[RowPair], sources: wp.array[wp.int32], is_chosen: wp.array[wp.bool], lanes: int) -> None:
    """Copies the words of the chosen rows of every array."""
    i, k, lane = wp.tid()
    if not is_chosen[i]:
        return
    pair = pairs[k]
    row = sources[i]
    for word in range(lane, pair.target.shape[1], lanes):
        pair.target[i, word] = pair.source[row, word]


@wp.kernel(enable_backward=False)
def give_seeds(rig_seeds: wp.array[wp.int32], is_chosen: wp.array[wp.bool], seeds: wp.array[wp.int32]) -> None:
    """Gives the chosen vehicles noise of their own."""
    i = wp.tid()
    if is_chosen[i]:
        rig_seeds[i] = seeds[i]


class RowRestore:
    """A restore that can be launched again and again; the arrays are read anew each time.

    Args:
        rig: whose vehicles are restored; they stay in their own worlds.
        bank: the vehicles whose rows are taken, on the same device.
        sources: the row of the bank that each vehicle takes, array of int32, (vehicles,); within the bank.
        is_chosen: which vehicles, array of bool, (vehicles,).
        seeds: of the chosen vehicles' noise from now on, array of int32, (vehicles,).
    """

    def __init__(self, rig: Rig, bank: Rig, sources: Any, is_chosen: Any, seeds: Any) -> None:
        self._rigs = (rig, bank)  # their memory is aliased below
        targets, givers = row_arrays(rig.arrays), row_arrays(bank.arrays)
        pairs = []
        for target, giver in zip(targets, givers, strict=True):
            pair = RowPair()
            pair.target, pair.source = _words(target), _words(giver)
            pairs.append(pair)
        self._pairs = wp.array(pairs, dtype=RowPair, device=rig.device)
        count = rig.vehicle_count
        lanes = 1 if self._pairs.device.is_cpu else _LANES
        copied, seeded = [self._pairs, sources, is_chosen, lanes], [rig.arrays.seed, is_chosen, seeds]
        self._arrays = copied + seeded
        self._commands = [
            wp.launch(copy_rows, (count, len(pairs), lanes), inputs=copied, device=rig.device, record_cmd=True),
            wp.launch(give_seeds, count, inputs=seeded, device=rig.device, record_cmd=True),
        ]

    def launch(self) -> None:
        """Restores the vehicles that are chosen now."""
        for command in self._commands:
            command.launch()


def _words(array: Any) -> Any:
    """An array with a row per vehicle as words, the same memory."""
    row_bytes = array.strides[0]
    size = wp.types.type_size_in_bytes(_WORD)
    if not array.is_contiguous or row_bytes % size:
        raise TypeError(f"rows of {row_bytes} bytes cannot be copied as whole words")
    return wp.array(
        ptr=array.ptr, shape=(array.shape[0], row_bytes // size), dtype=_WORD, device=array.device, copy=False
    )
