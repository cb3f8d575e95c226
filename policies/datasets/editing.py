"""Datasets made from datasets: merged, split, filtered. Episodes pass through one at a time and stay as they are."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np

from policies.datasets.episodes import NUMBER_NOTE, DatasetError, DatasetOrigin, EpisodeRows
from policies.datasets.reader import DatasetReader
from policies.datasets.writer import DatasetWriter
from policies.tasks.settings_difference import differing_settings, settings_difference


def merge(sources: Sequence[Path], folder: Path, seed: int | None = None) -> int:
    """One dataset of the episodes of several, in order; returns how many there are.

    Args:
        sources: folders of datasets.
        folder: to be made.
        seed: that it is said to come from; none: that of the first.

    Raises:
        DatasetError: they were recorded with different settings or numbers, or one cannot be read or written.
        LayoutError: their layouts differ.
    """
    with ExitStack() as held:
        readers = [held.enter_context(DatasetReader(source)) for source in sources]
        first = readers[0]
        for reader in readers[1:]:
            first.layout.require(reader.layout, str(reader.folder))
            _require_same(first, reader)
        origin = _merged([reader.origin for reader in readers])
        with DatasetWriter(folder, origin if seed is None else replace(origin, seed=seed)) as writer:
            for reader in readers:
                writer.add_all(reader)
        return writer.episodes


def _require_same(first: DatasetReader, other: DatasetReader) -> None:
    """Refuses what saw, did or was paid for something else.

    Raises:
        DatasetError: it was recorded with other settings, or with other numbers of the task.
    """
    here, there = first.origin, other.origin
    difference = settings_difference(here.layout.task, here.settings, there.settings)
    numbers = sorted(name for name in here.notes.keys() | there.notes.keys() if name.startswith(NUMBER_NOTE))
    for name in numbers:
        mine, its = (origin.notes.get(name, "the task's own") for origin in (here, there))
        if mine != its and not difference:
            difference = f"{name} is {its} there and {mine} here"
    if difference:
        raise DatasetError(f"{other.folder}: recorded with other settings than {first.folder}: {difference}")


def _merged(origins: Sequence[DatasetOrigin]) -> DatasetOrigin:
    """What several datasets are of; where they differ, all is said, of settings in the notes."""
    first = origins[0]
    pilots = "+".join(sorted({origin.pilot for origin in origins}))
    rewards_by = "+".join(sorted({origin.rewards_by for origin in origins}))
    notes = {name: text for origin in origins for name, text in origin.notes.items()}
    for name in sorted({name for each in origins[1:] for name in differing_settings(first.settings, each.settings)}):
        note, values = f"setting {name}", dict[str, None]()
        for origin in origins:
            here = origin.notes[note].split(", ") if note in origin.notes else [str(origin.settings.get(name, ""))]
            values |= dict.fromkeys(here)
        notes[note] = ", ".join(filter(None, values))
    return replace(first, pilot=pilots, rewards_by=rewards_by, notes=notes)


def split(source: Path, fraction: float, seed: int, folders: tuple[Path, Path]) -> tuple[int, int]:
    """Two datasets: a fraction of the episodes, drawn by the seed, and the others; returns how many each has.

    Raises:
        DatasetError: one of them would have none, both are the same, or it cannot be read or written.
    """
    if folders[0].resolve() == folders[1].resolve():
        raise DatasetError(f"{folders[1]}: a split makes two folders, and this one is named twice")
    with DatasetReader(source) as reader:
        first = round(fraction * reader.count)
        if not 0 < first < reader.count:
            raise DatasetError(
                f"{source}: a fraction of {fraction:g} of {reader.count} episodes leaves one part without any"
            )
        order = np.random.default_rng(seed).permutation(reader.count)
        chosen = set(order[:first].tolist())
        with DatasetWriter(folders[0], reader.origin) as one, DatasetWriter(folders[1], reader.origin) as other:
            for k, episode in enumerate(reader):
                (one if k in chosen else other).add(episode)
    return one.episodes, other.episodes


def keep(source: Path, folder: Path, is_kept: Callable[[EpisodeRows], bool]) -> int:
    """A dataset of the episodes that are to be kept; returns how many they are.

    Raises:
        DatasetError: none is, or it cannot be read or written.
    """
    with DatasetReader(source) as reader, DatasetWriter(folder, reader.origin) as writer:
        writer.add_all(filter(is_kept, reader))
        if not writer.episodes:
            raise DatasetError(f"{source}: no episode passes the filter")
    return writer.episodes
