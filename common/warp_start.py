"""The start of Warp, on the first call: on the CPU, without its greeting, and wherever its kernel cache may be.

Warp alone would take a GPU by default where there is one, and a flight is a vehicle of the CPU there too: who wants a
GPU names it (`Rig(device="cuda")`, `--torch-device cuda`), and from then on `device=` of Warp's own calls.

Importing kernels starts nothing. Whoever makes the first arrays (a rig, a world, a task, an estimator) calls
`start_warp` before; in a process that has been started already it costs nothing.
"""

import atexit
import os
import shutil
import sys
import tempfile
from functools import cache
from threading import Lock

import warp as wp

_STARTING = Lock()


def start_warp() -> None:
    """Initialises Warp once per process, without its greeting and its native warning that there is no CUDA driver."""
    with _STARTING:
        _started()


@cache
def _started() -> None:
    wp.config.log_level = wp.LOG_WARNING
    try:
        kept = os.dup(2)
    except OSError:  # there is no standard error: let no file of ours take its place, and Warp's lines with it
        nowhere = os.open(os.devnull, os.O_WRONLY)
        if nowhere != 2:
            os.dup2(nowhere, 2)
            os.close(nowhere)
        _init_warp()
        return
    sys.stderr.flush()
    with tempfile.TemporaryFile() as captured:
        os.dup2(captured.fileno(), 2)
        try:
            _init_warp()
        finally:
            os.dup2(kept, 2)
            os.close(kept)
        captured.seek(0)
        lines = captured.read().decode(errors="replace").splitlines()
    for line in lines:
        if "NVIDIA CUDA driver" not in line:
            sys.stderr.write(line + "\n")


def _init_warp() -> None:
    """Initialises Warp; where its cache cannot be written, kernels are compiled for this process alone."""
    try:
        wp.init()
        wp.set_device("cpu")
        folder = wp.config.kernel_cache_dir
        if os.access(folder, os.W_OK):
            return
    except OSError as error:
        folder = error.filename
    own = tempfile.mkdtemp(prefix="honeyguide-kernels-")
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    wp.config.kernel_cache_dir = own
    wp.init()
    wp.set_device("cpu")
    os.write(2, f"the kernel cache {folder} cannot be written: kernels are compiled anew\n".encode())
