"""Several processes of this machine that train one policy together (torch.distributed, Gloo over loopback).

In: a configuration and the learner of the first process, which alone judges, keeps checkpoints and writes curves. The
others begin with its state, which holds all that training depends on, and take part in its rounds until it ends them.
If one is killed, all others end.
"""

import contextlib
import multiprocessing
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

import torch
from torch import distributed

from policies.learn.algorithms.learner import Learner
from policies.learn.averaging import await_round, call_round
from policies.learn.config.behavior import Behavior
from policies.learn.config.offline import BcHyperparameters, OfflineHyperparameters
from policies.learn.config.run import RunConfig
from policies.learn.torch_threads import few_threads
from policies.learn.training_run_folder import RunError

HOST = "127.0.0.1"
START_S = 300.0  # a process that imports torch and reads datasets on a busy machine is given
ROUND_S = 3600.0  # the others wait while the first judges and writes
_END_S = 30.0  # for a process whose connections are gone to be found dead; on a busy machine 5 were too few


def check_processes(config: RunConfig) -> None:
    """Refuses what several processes cannot train.

    Raises:
        RunError: no offline algorithm, not on the CPU, or a minibatch that cannot be divided evenly.
    """
    count, behavior = config.torch_settings.processes, config.behavior
    if count == 1:
        return
    place = f"torch_settings.processes {count}"
    if not isinstance(behavior.hyperparameters, OfflineHyperparameters):
        raise RunError(f"{place}: trainer_type {behavior.trainer_type} trains in one; bc, td3_bc, iql and awac in many")
    if (config.torch_settings.device or "cpu") != "cpu":
        raise RunError(f"{place}: is for the CPU, and torch_settings.device is {config.torch_settings.device}")
    if not distributed.is_available():
        raise RunError(f"{place}: this torch was built without torch.distributed")
    key, parts = _parts(behavior)
    if parts % count:
        raise RunError(f"{place}: {key} {parts} cannot be divided evenly among {count} processes")


def _parts(behavior: Behavior) -> tuple[str, int]:
    """What a minibatch is divided into, and how many of them there are: decisions, or with a memory sequences."""
    size, memory = int(behavior.hyperparameters.batch_size), behavior.network_settings.memory
    if memory is None or not isinstance(behavior.hyperparameters, BcHyperparameters):
        return "batch_size", size
    return "batch_size in sequences", max(1, size // memory.sequence_length)


@contextmanager
def together(config: RunConfig, learner: Learner) -> Iterator[None]:
    """While it is entered, the learner's gradients are those of all processes, which it starts and ends.

    Args:
        config: of the run, with its seed.
        learner: of the first process, as it is to begin.

    Raises:
        RunError: a process has ended before the training has.
    """
    count = config.torch_settings.processes
    if count == 1:
        yield
        return
    os.environ.setdefault("GLOO_SOCKET_IFNAME", "lo")
    store = _store(0, is_master=True)
    processes = [_started(config, store.port, k) for k in range(1, count)]
    try:
        _wait_until_ready(processes)
        _join(store, 0, count)
        distributed.broadcast_object_list([learner.state()], src=0)
        yield
        call_round(goes_on=False)
        for process, _ in processes:
            process.join(_END_S)
    except RuntimeError as error:
        lost = _lost([process for process, _ in processes])
        if lost is None:
            raise
        raise lost from error
    finally:
        for process, connection in processes:
            process.kill()
            process.join()
            connection.close()
        if distributed.is_initialized():
            distributed.destroy_process_group()


def _started(config: RunConfig, port: int, number: int) -> tuple[BaseProcess, "Connection[Any, Any]"]:
    context = multiprocessing.get_context("spawn")
    connection, theirs = context.Pipe()
    process = context.Process(target=_take_part, args=(config, port, number, theirs), daemon=True)
    process.start()
    theirs.close()
    return process, connection


def _wait_until_ready(processes: list[tuple[BaseProcess, "Connection[Any, Any]"]]) -> None:
    """Raises RuntimeError if one ends before."""
    left: set[Any] = {connection for _, connection in processes}
    while left:
        ready: list[Any] = wait(list(left), START_S)
        if not ready:
            raise RuntimeError(f"processes that are to train together have not begun within {START_S:g} s")
        for connection in ready:
            try:
                connection.recv()
            except EOFError:
                raise RuntimeError("a process has ended before it began to train") from None
            left.discard(connection)


def _store(port: int, *, is_master: bool) -> Any:
    """Where processes find each other; port 0 takes a free one."""
    wait_s = timedelta(seconds=START_S)
    make: Any = distributed.TCPStore  # type: ignore[attr-defined]
    return make(HOST, port, is_master=is_master, wait_for_workers=False, timeout=wait_s)


def _join(store: Any, number: int, count: int) -> None:
    distributed.init_process_group(
        "gloo", store=store, rank=number, world_size=count, timeout=timedelta(seconds=ROUND_S)
    )


def _lost(processes: list[BaseProcess]) -> RunError | None:
    """What to tell the user of the process that has ended, if one has: rather of one that was killed."""
    wait([process.sentinel for process in processes], _END_S)
    codes = {k: process.exitcode for k, process in enumerate(processes, start=2) if process.exitcode is not None}
    if not codes:
        return None
    number, code = min(codes.items(), key=lambda item: (item[1], item[0]))  # negative: by a signal
    how = f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
    return RunError(
        f"process {number} of {len(processes) + 1} {how}, and the others with it; "
        "--resume goes on from the newest checkpoint"
    )


def _take_part(config: RunConfig, port: int, number: int, connection: "Connection[Any, Any]") -> None:
    """The life of a process that is not the first."""
    for ignored in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):  # the first ends it
        signal.signal(ignored, signal.SIG_IGN)
    os.environ.setdefault("GLOO_SOCKET_IFNAME", "lo")
    count = config.torch_settings.processes
    learner = _learner(config)
    try:
        store = _store(port, is_master=False)
        connection.send("ready")
        _join(store, number, count)
        state: list[Any] = [None]
        distributed.broadcast_object_list(state, src=0)
        learner.load_state(state[0])
        with few_threads(has_images=learner.policy.body.encoder is not None, processes=count):
            while await_round():
                learner.iterate()
    except (RuntimeError, OSError) as error:
        if not _is_of_the_group(error):
            raise
        if number == 1 and not _has_parent():
            with contextlib.suppress(OSError):
                sys.stderr.write("the first process has ended, and the others with it; --resume goes on\n")
        os._exit(1)
    distributed.destroy_process_group()


def _is_of_the_group(error: Exception) -> bool:
    """Whether it says that another process is gone, rather than that something is wrong here."""
    return isinstance(error, OSError | distributed.DistError) or "gloo" in str(error).lower()


def _has_parent() -> bool:
    parent = multiprocessing.parent_process()
    return parent is not None and parent.is_alive()


def _learner(config: RunConfig) -> Learner:
    from policies.learn.build_learner import build_learner  # noqa: PLC0415  (which need not know of processes)
    from policies.tasks.catalogue import build_task, settings_of  # noqa: PLC0415

    name = config.env_settings.env_path or ""
    task = build_task(name, 1, settings_of(name, config.env_settings.env_args), str(torch.device("cpu")))
    return build_learner(config, task, config.env_settings.seed)
