"""The training curves: TensorBoard events with ML-Agents' tag names, one point per summary period.

In: what each iteration did. Out: one event file that grows; a run that is resumed goes on in it where its checkpoint
was taken, so that no step is shown twice.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tensorboard.compat.proto.event_pb2 import Event
from tensorboard.compat.proto.summary_pb2 import Summary
from tensorboard.summary.writer.record_writer import RecordWriter

from common.clock import wall_unix_us
from policies.tasks.episode import Outcome
from policies.tasks.task import Scores

NO_SCORES = Scores((0,) * len(Outcome), 0.0, 0.0)


class EventFile:
    """An event file, written at once: nothing is left in memory."""

    def __init__(self, folder: Path, position: Mapping[str, Any] | None = None) -> None:
        """Begins a file in the folder, or goes on in it.

        Args:
            folder: where TensorBoard looks.
            position: what `position` returned when the checkpoint was taken; what came later is cut off.

        Raises:
            OSError: it cannot be written.
        """
        folder.mkdir(parents=True, exist_ok=True)
        unix_s = wall_unix_us() // 1_000_000
        self._path = folder / (position["file"] if position else f"events.out.tfevents.{unix_s:010d}.honeyguide")
        is_new = not self._path.exists()
        self._stream = self._path.open("wb" if is_new else "r+b")
        if position and not is_new:
            self._stream.truncate(position["bytes"])
        self._stream.seek(0, 2)
        self._records = RecordWriter(self._stream)
        if is_new:
            self._write(Event(file_version="brain.Event:2"))

    def write(self, step: int, values: Mapping[str, float]) -> None:
        """One point of each curve."""
        points = [Summary.Value(tag=tag, simple_value=value) for tag, value in values.items()]
        self._write(Event(step=step, summary=Summary(value=points)))

    def position(self) -> dict[str, Any]:
        """How far the file has come."""
        return {"file": self._path.name, "bytes": self._stream.tell()}

    def close(self) -> None:
        self._stream.close()

    def _write(self, event: Event) -> None:
        event.wall_time = wall_unix_us() * 1e-6
        self._records.write(event.SerializeToString())
        self._stream.flush()


class Period:
    """What happened since the last summary: means of the statistics, and the episodes that ended."""

    def __init__(self) -> None:
        self.scores = NO_SCORES
        self._sums: dict[str, tuple[float, int]] = {}

    def add(self, scores: Scores, statistics: Mapping[str, float]) -> None:
        """Counts one iteration."""
        self.scores = self.scores + scores
        for tag, value in statistics.items():
            total, count = self._sums.get(tag, (0.0, 0))
            self._sums[tag] = (total + float(value), count + 1)

    def values(self) -> dict[str, float]:
        """Tag to value; episodes are missing if none ended."""
        values = {tag: total / count for tag, (total, count) in sorted(self._sums.items())}
        episodes = self.scores.episode_count
        if episodes:
            values["Environment/Cumulative Reward"] = self.scores.return_sum / episodes
            values["Environment/Episode Length"] = self.scores.length_sum / episodes
            values["Environment/Success Rate"] = self.scores.count(Outcome.SUCCESS) / episodes
        return values

    def state(self) -> dict[str, Any]:
        """Everything, as plain values."""
        return {"scores": score_record(self.scores), "sums": {tag: list(sums) for tag, sums in self._sums.items()}}

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Restores what `state` returned."""
        self.scores = scores_of(state["scores"])
        self._sums = {tag: (total, count) for tag, (total, count) in state["sums"].items()}


def score_record(scores: Scores) -> list[float]:
    """Scores as plain values, for a checkpoint."""
    return [*scores.outcomes, scores.return_sum, scores.length_sum]


def scores_of(record: list[float]) -> Scores:
    """What `score_record` wrote."""
    return Scores(tuple(int(count) for count in record[:-2]), record[-2], record[-1])
