"""Kills writers of a state folder at random moments, and looks each time at what is left.

Usage: python tests/system/robustness/killed_writers.py FOLDER COUNT SEED. A writer is a fork: it sets parameters, loads
missions and writes logs as fast as it can, and says so only when each is done. What a restart finds is what was said,
or the one step that was under way. Exit code 0 if that was so each time.
"""

import os
import signal
import sys
import time
from io import BytesIO
from pathlib import Path

import numpy as np
from pyulog import ULog

from autopilot.interface.item_lists import ListKind, MissionItem
from autopilot.params import parameter_table
from autopilot.persistence import Persistence
from common.logs.ulog import UlogWriter
from common.state_folder import StateFolder
from mission.log.stored_logs import FlightLogs
from tests.unit.autopilot.test_persistence import Lists

LONGEST_S = 0.05
PARAMETER = "MPC_XY_VEL_MAX"  # 2 to 12
STEP = 2.0**-16  # exact, and many steps fit
ROWS = 200


class Stream:
    """A log in memory whose records go to the listener."""

    def __init__(self):
        self._writer = UlogWriter(BytesIO(), 0, {"sys_name": "x" * 3000}, {})
        self._topic = self._writer.add_topic("count", {"value": "uint32_t"})

    def listen(self, listener):
        self._writer.listeners.append(listener)
        return self._writer.header(0)

    def stop_listening(self, listener):
        self._writer.listeners.remove(listener)

    def grow(self):
        self._topic.write({"timestamp": np.arange(ROWS), "value": np.arange(ROWS)})


def start(folder):
    """A vehicle's memory after a start: parameter table, lists, keeper and problems."""
    state = StateFolder(folder)
    params, lists = parameter_table(), Lists()
    keeper = Persistence(state, params)
    keeper.keep_lists(lists)
    return params, lists, keeper, state


def write_until_killed(folder, done, kind):
    """Never returns; `done` gets a byte after each step."""
    params, lists, keeper, _state = start(folder)
    stream = Stream()
    logs = FlightLogs(folder / "logs", stream, params, print)
    step = 0
    os.write(done, b"R")
    while True:
        step += 1
        if kind == "parameters":
            params.set(PARAMETER, params[PARAMETER] + STEP)
        elif kind == "mission":
            value = count_of(lists) + 1
            lists.load(ListKind.MISSION, [MissionItem(i, 0, 16, (value,) * 4, 0.0, 0.0, value) for i in range(40)])
        else:
            logs.frame(is_armed=bool(step % 4))
            stream.grow()
        if step % 3 == 0:
            keeper.write()
        os.write(done, b".")


def count_of(lists):
    items = lists.items(ListKind.MISSION)
    values = {value for item in items for value in (*item.params, item.z)}
    assert len(values) <= 1, "half of one mission, half of another"
    assert len(items) in (0, 40)
    return int(values.pop()) if values else 0


def kill_one(folder, kind, after_s):
    """Runs a writer until it is killed; returns how many steps it said it had done."""
    reader, done = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        write_until_killed(folder, done, kind)
    os.close(done)
    assert os.read(reader, 1) == b"R"
    time.sleep(after_s)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    said = b""
    while piece := os.read(reader, 1 << 16):
        said += piece
    os.close(reader)
    return len(said)


def check_logs(folder):
    """Each log that is there can be read, and has whole rows in order."""
    for path in sorted((folder / "logs").glob("*.ulg")):
        for data in ULog(str(path)).data_list:
            values = data.data["value"]
            assert (values == np.arange(len(values)) % ROWS).all(), path


def main(folder, count, seed):
    rng = np.random.default_rng(seed)
    value, missions = None, 0
    for i in range(count):
        kind = ("parameters", "mission", "logs")[i % 3]
        steps = kill_one(folder, kind, rng.uniform(0.0, LONGEST_S))
        params, lists, keeper, state = start(folder)
        assert state.problems + keeper.problems == []
        found = params[PARAMETER]
        if value is not None:
            most = steps + 1 if kind == "parameters" else 0
            assert steps * (kind == "parameters") <= (found - value) / STEP <= most, (value, found, steps)
        value = found
        found = count_of(lists)
        most = steps + 1 if kind == "mission" else 0
        assert steps * (kind == "mission") <= found - missions <= most, (missions, found, steps)
        missions = found
        if value > 10.0:  # start again
            params.set(PARAMETER, 3.0)
            value = params[PARAMETER]
        keeper.write()
        state.close()
        check_logs(folder)
        for path in (folder / "logs").glob("*.ulg"):
            path.unlink()
    print(f"{count} kills, {missions} missions, parameter {value}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
