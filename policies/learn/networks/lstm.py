"""Memory of recurrent networks: one LSTM layer, its state handed in and out as one vector (hidden, then cell).

Acting advances it step by step. Learning passes whole sequences at once, sequence first; where an episode starts
within a sequence, the sequence is taken apart there and the parts go through the LSTM side by side.
"""

import torch
from torch import Tensor, nn
from torch.nn.utils.rnn import PackedSequence


class Recurrence(nn.Module):
    """An LSTM of `memory_size / 2` units."""

    def __init__(self, inputs: int, memory_size: int, generator: torch.Generator) -> None:
        super().__init__()
        self.size = memory_size // 2
        self.memory_size = memory_size
        self.lstm = nn.LSTM(inputs, self.size, device="meta").to_empty(device="cpu")  # no draw from a global generator
        with torch.no_grad():
            for name, parameter in self.lstm.named_parameters():
                for i_gate, gate in enumerate(parameter.chunk(4)):
                    if "weight" in name:
                        nn.init.xavier_uniform_(gate, generator=generator)
                    else:
                        gate.fill_(1.0 if i_gate == 1 else 0.0)  # the forget gate, of both biases, as ML-Agents does

    def step(self, inputs: Tensor, memory: Tensor) -> tuple[Tensor, Tensor]:
        """Outputs of one step (rows, units), and the memory after it (rows, memory)."""
        outputs, state = self.lstm(inputs[None], _state_from(memory))
        return outputs[0], torch.cat(state, dim=-1)[0]

    def forward(self, inputs: Tensor, memory: Tensor, is_start: Tensor) -> Tensor:
        """Outputs of whole sequences.

        Args:
            inputs: shape (steps, sequences, inputs).
            memory: before the first step, shape (sequences, memory).
            is_start: where an episode starts with that step: what was before is forgotten; shape (steps, sequences).

        Returns:
            Shape (steps, sequences, units).
        """
        memory = memory.masked_fill(is_start[0][:, None], 0.0)
        if not is_start[1:].any():
            outputs: Tensor = self.lstm(inputs, _state_from(memory))[0]
            return outputs
        order, batch_sizes, first_rows = _parts(is_start)
        part_memory = memory.new_zeros(int(batch_sizes[0]), memory.shape[1])
        part_memory[first_rows] = memory
        packed = PackedSequence(inputs.flatten(0, 1).index_select(0, order), batch_sizes)
        parts: Tensor = self.lstm(packed, _state_from(part_memory))[0].data
        back = torch.empty_like(order)
        back[order] = torch.arange(len(order), device=order.device)
        return parts.index_select(0, back).view(*is_start.shape, -1)


def _state_from(memory: Tensor) -> tuple[Tensor, Tensor]:
    hidden, cell = memory[None].chunk(2, dim=-1)
    return hidden.contiguous(), cell.contiguous()


def _parts(is_start: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Takes sequences apart where episodes start; long parts come first, as a packed sequence has them.

    Args:
        is_start: shape (steps, sequences).

    Returns:
        For each packed row the flat (step, sequence) row it comes from; how many parts have a k-th step, on the CPU;
        and which part each sequence begins with.
    """
    steps, count = is_start.shape
    device = is_start.device
    is_first = is_start.T.contiguous()
    is_first[:, 0] = True
    is_first = is_first.flatten()  # sequence by sequence, so that a part is a run of rows
    part = is_first.cumsum(0) - 1
    begin = is_first.nonzero()[:, 0]
    row = torch.arange(steps * count, device=device)
    position = row - begin[part]
    lengths = torch.bincount(part)
    rank = torch.empty_like(lengths)
    rank[torch.argsort(lengths, descending=True, stable=True)] = torch.arange(len(lengths), device=device)
    packed = torch.argsort(position * len(lengths) + rank[part])
    order = row % steps * count + row // steps  # the flat (step, sequence) row of each row
    return order[packed], torch.bincount(position).cpu(), rank[part[::steps]]
