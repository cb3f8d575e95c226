"""Runs flown on a Ray cluster (extra `ray`). A worker that dies has its runs flown again elsewhere.

In: orders. Out: records, as they are done. The cluster is spoken to by a process of its own: where its head dies, Ray
ends that process, not the campaign, which keeps what was flown.
"""

import multiprocessing
import os
import socket
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from logging import ERROR
from multiprocessing.connection import Connection
from typing import Any

from mission.campaign.campaign import Campaign
from mission.campaign.flying import Stopped
from mission.campaign.runs import Order, Record, lost
from mission.console.option_checks import UserError

LOOK_S = 2.0  # between looks whether the head is there
TRIES = 3  # of a run whose worker dies, then it is the run
AHEAD = 4  # runs that wait at the cluster, for each of its cores


class RayCluster:
    """A cluster that flies runs.

    Args:
        campaign: whose.
        address: of its head, HOST:PORT.

    Raises:
        UserError: there is no Ray, or none at the address.
    """

    def __init__(self, campaign: Campaign, address: str) -> None:
        if find_spec("ray") is None:
            raise UserError("--ray: this needs ray, which comes with the extra 'ray' (docs/start/installing.md)")
        self._campaign, self._address = campaign, address
        if not is_there(address):
            raise UserError(f"--ray {address}: no Ray head answers there (HOST:PORT, as `ray start --head` shows it)")
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_drive, args=(campaign, address, theirs))
        self._process.start()
        theirs.close()

    def fly(self, orders: Sequence[Order]) -> Iterator[Record]:
        """The record of each order, as they come.

        Raises:
            Stopped: the head is gone.
        """
        if not orders:
            return
        try:
            self._connection.send(list(orders))
            for _ in orders:
                while not self._connection.poll(LOOK_S):
                    if not self._process.is_alive() or not is_there(self._address):
                        raise Stopped(f"the Ray head at {self._address} is gone")
                answer = self._connection.recv()
                if isinstance(answer, str):
                    raise Stopped(f"the Ray head at {self._address} is gone: {answer}")
                yield answer
        except (EOFError, OSError) as error:
            raise Stopped(f"the Ray head at {self._address} is gone") from error

    def close(self) -> None:
        """Leaves the cluster."""
        self._process.kill()
        self._process.join()
        self._connection.close()


def is_there(address: str) -> bool:
    """Whether somebody listens at HOST:PORT."""
    host, _, port = address.rpartition(":")
    try:
        socket.create_connection((host or "127.0.0.1", int(port)), timeout=5.0).close()
    except (OSError, ValueError):
        return False
    return True


def _drive(campaign: Campaign, address: str, connection: "Connection[Any, Any]") -> None:
    """The life of the process that speaks to the cluster."""
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    import ray

    try:
        ray.init(address=address, log_to_driver=False, logging_level=ERROR)
        remote = ray.remote(max_retries=TRIES, retry_exceptions=False)(_fly)
        shared = ray.put(campaign)
        while True:
            for record in _flown(ray, remote, shared, connection.recv()):
                connection.send(record)
    except (EOFError, BrokenPipeError):  # the campaign is gone
        return
    except (ray.exceptions.RayError, ConnectionError, TimeoutError) as error:
        connection.send(" ".join(str(error).split())[:200] or type(error).__name__)


def _fly(campaign: Campaign, order: Order) -> Record:
    from mission.campaign.workers.fly_run import fly_run

    return fly_run(campaign, order)


def _flown(ray: Any, remote: Any, shared: Any, orders: Sequence[Order]) -> Iterator[Record]:
    waiting, under_way = list(reversed(orders)), dict[Any, Order]()
    ahead = AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))
    while waiting or under_way:
        while waiting and len(under_way) < ahead:
            order = waiting.pop()
            under_way[remote.remote(shared, order)] = order
        done, _ = ray.wait(list(under_way), num_returns=1)
        for each in done:
            order = under_way.pop(each)
            try:
                yield ray.get(each)
            except ray.exceptions.WorkerCrashedError:
                yield lost(order, f"its worker died, {TRIES + 1} times")
            except ray.exceptions.RayTaskError as error:
                yield lost(order, " ".join(str(error.cause or error).split())[:200])
