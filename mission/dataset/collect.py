"""`honeyguide dataset collect`: episodes of the batch simulator as a dataset, by a policy, an expert or chance."""

import os
from collections.abc import Callable

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from mission.console.terminal import print_line
from mission.dataset.shards import Collectors, ShardOrder, collect_shards, shard_orders
from mission.dataset.write_episodes import EXPERT, RANDOM, CollectOptions, write_episodes
from mission.train.play import PlayError
from policies.datasets.episodes import DatasetError
from policies.datasets.reader import DatasetReader
from policies.experts.demonstration_file import check_is_free
from policies.learn.export.policy_path import CheckpointError, find_policy


def collect_dataset(options: CollectOptions, console: Console) -> None:
    """Collects and writes; prints what it came to.

    Raises:
        UnknownTask, NoExpert, PlayError, LayoutError: the task, its settings or the policy cannot be used.
        DatasetError: shards are given numbers, or the dataset cannot be written.
        DemonstrationFileError: the same.
    """
    check_is_free(options.out)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console) as bar:
        line = bar.add_task(options.task, total=options.episodes)
        if options.shards is None:
            write_episodes(options, lambda count: bar.update(line, completed=count))
        else:
            _collect_shards(options, options.shards, lambda count: bar.update(line, completed=count))
    with DatasetReader(options.out) as reader:
        words = f"{reader.count} episodes, {reader.successes} of them successful, {reader.steps} decisions"
    print_line(console, f"{options.out}: {words}")


def _collect_shards(options: CollectOptions, count: int, note: Callable[[int], None]) -> None:
    """Collects by other processes, of this machine or of a cluster."""
    weights = None
    if options.policy not in (EXPERT, RANDOM):
        try:
            path = find_policy(options.policy)
        except CheckpointError as error:
            raise PlayError(str(error)) from None
        weights, policy = path.read_bytes(), path.stem
    else:
        policy = options.policy
    if options.numbers:
        raise DatasetError("numbers of the task cannot be given to shards: collect in one go")
    whole = ShardOrder(
        0, options.task, policy, options.episodes, options.noise, options.seed, options.env_args, weights
    )
    shard_orders(whole, count)  # refuses before anybody is asked
    collect_shards(whole, count, options.out, _collectors(options), note)


def _collectors(options: CollectOptions) -> Collectors:
    if options.ray is not None:
        from mission.dataset.ray_collectors import RayCollectors

        return RayCollectors(options.ray)
    from mission.dataset.process_collectors import ProcessCollectors

    return ProcessCollectors(options.jobs or len(os.sched_getaffinity(0)))
