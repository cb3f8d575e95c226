"""Episodes of the batch simulator collected in shards, each with a seed of its own, by whoever has time.

In: what is to be collected. Out: one dataset, the same bytes whoever collected which shard, in whichever order, and
however often it was interrupted. Finished shards lie in `NAME.shards` beside the dataset until all are there; each is
written whole or not at all, and none is collected twice.
"""

import hashlib
import json
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from common.files import part_path, write_whole
from policies.datasets.editing import merge
from policies.datasets.episodes import DatasetError
from policies.datasets.writer import MAIN_FILE, METADATA_FILE

ORDER_FILE = "order.json"
MAX_SHARDS = 500  # files that a merge has open (guess: half of what a process may have, 1024)


@dataclass(frozen=True, slots=True)
class ShardOrder:
    """One shard: sent to whoever collects it."""

    number: int
    task: str
    policy: str
    episodes: int
    noise: float
    seed: int
    env_args: tuple[str, ...]
    weights: bytes | None = None  # of a policy's file, which another machine has not

    @property
    def name(self) -> str:
        """Of its folder."""
        return f"shard-{self.number:04d}"


class Collectors(Protocol):
    """Who collects shards."""

    def collect(self, orders: Sequence[ShardOrder], folder: Path) -> Iterator[ShardOrder]:
        """Puts the dataset of each into the folder, whole, and returns it.

        Raises:
            DatasetError: nobody is left to collect; what is done is kept.
        """
        ...


def shard_orders(whole: ShardOrder, count: int) -> list[ShardOrder]:
    """A collection cut into shards, whose seeds follow from its own.

    Args:
        whole: with all episodes.
        count: of shards.

    Raises:
        DatasetError: more shards than episodes, or than can be merged.
    """
    most = min(whole.episodes, MAX_SHARDS)
    if count > most:
        raise DatasetError(f"--shards {count}: at most {most} for {whole.episodes} episodes")
    seeds = np.random.SeedSequence((whole.seed, 0x5348)).generate_state(count) % 2**31
    each, more = divmod(whole.episodes, count)
    return [
        replace(whole, number=k, episodes=each + (k < more), seed=int(seed)) for k, seed in enumerate(seeds.tolist())
    ]


def collect_shards(
    whole: ShardOrder, count: int, out: Path, collectors: Collectors, note: Callable[[int], None]
) -> int:
    """Collects what is missing, then makes one dataset of all; returns its number of episodes.

    Args:
        whole: with all episodes.
        count: of shards.
        out: the dataset's folder, to be made.
        collectors: who collects.
        note: told how many episodes there are, after every shard.

    Raises:
        DatasetError: the shards there are of another collection, or nobody is left to collect.
    """
    orders = shard_orders(whole, count)
    folder = out.with_name(out.name + ".shards")
    _open(folder, whole, count)
    done = sum(order.episodes for order in orders if (folder / order.name).is_dir())
    note(done)
    missing = [order for order in orders if not (folder / order.name).is_dir()]
    try:
        for order in collectors.collect(missing, folder) if missing else ():
            done += order.episodes
            note(done)
    except BaseException:
        if not any(folder.glob("shard-*[0-9]")):  # nothing worth keeping, and nothing to stand in the way
            shutil.rmtree(folder)
        raise
    episodes = merge([folder / order.name for order in orders], out, seed=whole.seed)
    shutil.rmtree(folder)
    return episodes


def _open(folder: Path, whole: ShardOrder, count: int) -> None:
    """Makes the folder of shards, or finds it to be of the same collection."""
    record = asdict(whole) | {"shards": count, "env_args": list(whole.env_args)}
    record["weights"] = hashlib.sha256(whole.weights).hexdigest() if whole.weights is not None else None
    try:
        folder.mkdir(exist_ok=True)
        file = folder / ORDER_FILE
        if file.is_file():
            there = json.loads(file.read_text(encoding="utf-8"))
            for key, value in record.items():
                if there.get(key) != value:
                    raise DatasetError(
                        f"{folder}: holds shards of another collection: {key} is {there.get(key)} there, "
                        f"and here {value}; remove it to begin anew"
                    )
        else:
            write_whole(file, json.dumps(record, indent=2).encode())
    except OSError as error:
        raise DatasetError(f"{folder}: cannot be read or written: {error.strerror or error}") from error
    except ValueError as error:
        if isinstance(error, DatasetError):
            raise
        raise DatasetError(f"{folder / ORDER_FILE}: is damaged; remove {folder} to begin anew") from error


def files_of(folder: Path) -> dict[str, bytes]:
    """A dataset as it is sent from one machine to another."""
    return {name: (folder / name).read_bytes() for name in (METADATA_FILE, MAIN_FILE)}


def place(folder: Path, files: dict[str, bytes]) -> None:
    """Writes a dataset that was sent, whole.

    Raises:
        DatasetError: it cannot be written.
    """
    part = part_path(folder)
    try:
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir()
        for name, content in files.items():
            (part / name).write_bytes(content)
        part.replace(folder)
    except OSError as error:
        shutil.rmtree(part, ignore_errors=True)
        raise DatasetError(f"{folder}: cannot be written: {error.strerror or error}") from error
