"""Shards collected on a Ray cluster (extra `ray`). A worker that dies has its shard collected again elsewhere.

The cluster is spoken to by a process of its own: where its head dies, Ray ends that process, not the collection.
"""

import multiprocessing
import os
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from logging import ERROR
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from mission.campaign.workers.ray_cluster import is_there
from mission.dataset.collect_shard import collect_shard
from mission.dataset.shards import ShardOrder, place
from policies.datasets.episodes import DatasetError

LOOK_S = 2.0  # between looks whether the head is there
TRIES = 3  # of a shard whose worker dies, then it is the shard


class RayCollectors:
    """A cluster that collects.

    Args:
        address: of its head, HOST:PORT.

    Raises:
        DatasetError: there is no Ray, or none at the address.
    """

    def __init__(self, address: str) -> None:
        if find_spec("ray") is None:
            raise DatasetError("--ray: this needs ray, which comes with the extra 'ray' (docs/start/installing.md)")
        if not is_there(address):
            raise DatasetError(
                f"--ray {address}: no Ray head answers there (HOST:PORT, as `ray start --head` shows it)"
            )
        self._address = address

    def collect(self, orders: Sequence[ShardOrder], folder: Path) -> Iterator[ShardOrder]:
        """See `mission.dataset.shards.Collectors`."""
        context = multiprocessing.get_context("spawn")
        connection, theirs = context.Pipe()
        process = context.Process(target=_drive, args=(list(orders), self._address, theirs), daemon=True)
        process.start()
        theirs.close()
        gone = f"{folder}: the Ray head at {self._address} is gone; the finished shards are kept for the next try"
        try:
            for _ in orders:
                while not connection.poll(LOOK_S):
                    if not process.is_alive() or not is_there(self._address):
                        raise DatasetError(gone)
                answer = connection.recv()
                if isinstance(answer, str):
                    raise DatasetError(answer)
                number, files = answer
                order = next(order for order in orders if order.number == number)
                place(folder / order.name, files)
                yield order
        except (EOFError, OSError) as error:
            raise DatasetError(gone) from error
        finally:
            process.kill()
            process.join()
            connection.close()


def _drive(orders: list[ShardOrder], address: str, connection: "Connection[Any, Any]") -> None:
    """The life of the process that speaks to the cluster: sends a shard's number and files, or what went wrong."""
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    import ray

    try:
        ray.init(address=address, log_to_driver=False, logging_level=ERROR)
        remote = ray.remote(max_retries=TRIES, retry_exceptions=False)(_collect)
        under_way = {remote.remote(order): order for order in orders}
        while under_way:
            done, _ = ray.wait(list(under_way), num_returns=1)
            for each in done:
                order = under_way.pop(each)
                connection.send((order.number, ray.get(each)))
    except (EOFError, BrokenPipeError):  # the collection is gone
        return
    except ray.exceptions.WorkerCrashedError:
        connection.send(f"{order.name}: its worker died, {TRIES + 1} times")
    except ray.exceptions.RayTaskError as error:
        connection.send(" ".join(str(error.cause or error).split())[:200])
    except (ray.exceptions.RayError, ConnectionError, TimeoutError) as error:
        connection.send(" ".join(str(error).split())[:200] or type(error).__name__)


def _collect(order: ShardOrder) -> dict[str, bytes]:
    return collect_shard(order)
