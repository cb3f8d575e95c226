"""One shard collected, in a process of the collection or of a cluster."""

import tempfile
from pathlib import Path

from mission.dataset.shards import ShardOrder, files_of, place
from mission.dataset.write_episodes import CollectOptions, write_episodes
from policies.learn.torch_threads import use_one_thread


def collect_shard(order: ShardOrder) -> dict[str, bytes]:
    """The files of a shard's dataset; torch computes with one thread, so that every process computes the same.

    Raises:
        ValueError: what `collect_dataset` refuses.
    """
    use_one_thread()
    with tempfile.TemporaryDirectory(prefix="honeyguide-shard-") as made:
        folder, policy = Path(made), order.policy
        if order.weights is not None:
            file = folder / f"{order.policy}.pt"
            file.write_bytes(order.weights)
            policy = str(file)
        out = folder / order.name
        write_episodes(CollectOptions(order.task, policy, order.episodes, out, order.noise, order.seed, order.env_args))
        return files_of(out)


def collect_into(order: ShardOrder, folder: Path) -> None:
    """Puts a shard's dataset into a folder of this machine, whole.

    Raises:
        ValueError: what `collect_dataset` refuses.
    """
    place(folder / order.name, collect_shard(order))
