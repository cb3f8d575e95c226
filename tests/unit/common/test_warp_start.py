"""Warp starts when it is first needed, quietly, wherever it may write, and whatever standard error is."""

import os
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).parents[3]
SHOW = """
import os, warp
from common.warp_start import start_warp
start_warp()
print(warp.config.kernel_cache_dir, os.readlink("/proc/self/fd/2"))
"""


def started(shell="", **environment):
    """What a process prints that starts Warp, and its standard error."""
    command = ["sh", "-c", f'exec "$0" "$@" {shell}', sys.executable, "-c", SHOW]
    variables = os.environ | {"PYTHONPATH": str(REPOSITORY)} | environment
    process = subprocess.run(command, env=variables, capture_output=True, text=True, check=False)
    assert process.returncode == 0, process.stderr
    return process.stdout.split(), process.stderr


def test_a_cache_that_cannot_be_written_is_told_and_replaced_for_this_process():
    (folder, _), errors = started(WARP_CACHE_PATH="/dev/null/cache")
    assert errors == "the kernel cache /dev/null/cache cannot be written: kernels are compiled anew\n"
    assert "honeyguide-kernels-" in folder
    assert not Path(folder).exists()  # the process has taken it away again


def test_closed_standard_error_is_no_place_for_another_file():
    (_, position), _ = started("2>&-")
    assert position == os.devnull


def output_of(program):
    result = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=REPOSITORY
    )
    assert result.returncode == 0, result.stderr
    return result.stdout + result.stderr


IMPORT_ALL = """
import importlib, pkgutil
for package in ("common", "autopilot", "sim"):
    for module in pkgutil.walk_packages(importlib.import_module(package).__path__, package + "."):
        if not module.name.endswith((".tuning", ".margins", ".derive")):  # design tools: slow to import
            importlib.import_module(module.name)
"""


def test_no_import_starts_warp():
    assert output_of(f"{IMPORT_ALL}import warp; print(warp._src.context.runtime)") == "None\n"


MAKERS = """
import os, sys, warp
from autopilot.estimator.ekf import make_ekf
from mission.estimate.estimate_run import load_kernels
from policies.companion.observation import Observer
from policies.tasks.catalogue import build_task
from sim.world.batch import WorldBatch
from sim.world.world import WorldConfig, build_world

def child(make):
    process = os.fork()
    if process == 0:
        make()
        sys.stdout.flush()
        os._exit(warp._src.context.runtime is None)
    assert os.waitpid(process, 0)[1] == 0, make

for make in (
    build_world,
    lambda: WorldBatch(WorldConfig(), 1),
    lambda: make_ekf(1),
    lambda: build_task("RollerBall", 1),
    lambda: Observer(0),
    load_kernels,
):
    child(make)
build_world()
child(build_world)  # in a process of one that has started it
"""


def test_who_makes_the_first_arrays_starts_warp_without_its_greeting():
    assert output_of(MAKERS) == ""
