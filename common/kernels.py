"""Vector types, time constants and launch helpers shared by every kernel module.

One tick is one IMU sample and one pass of the flight controller; a frame is one pass of the Python part.
Array rows are `wp.struct`s: one row per vehicle, one field per physical quantity. On the CPU
`array.numpy()["pos_ned"]` is a live view of that field.
"""

import atexit
import os
import shutil
import sys
import tempfile

import warp as wp

MAX_ROTORS = 8
ERROR_STATES = 24
YAW_MODELS = 5  # headings from which the yaw estimator starts

vec5 = wp.types.vector(length=YAW_MODELS, dtype=wp.float32)
vec8 = wp.types.vector(length=MAX_ROTORS, dtype=wp.float32)
vec24 = wp.types.vector(length=ERROR_STATES, dtype=wp.float32)

TICK_US = 4_000
TICK_S = 0.004
SUBSTEPS = 4  # body steps of 1 ms in a tick
FRAME_TICKS = 5  # ticks in a 50 Hz frame of commander, navigator and MAVLink
FRAME_US = TICK_US * FRAME_TICKS

GRAVITY_M_S2 = 9.80665  # standard gravity, CGPM 1901


@wp.func
def tick_end_us(tick: wp.int64) -> wp.int64:
    """When the tick of an index, counted from power-on, ends [us]; 32 bits would be over after 99 days."""
    return (tick + wp.int64(1)) * wp.int64(TICK_US)


def _start_warp() -> None:
    """Initialises Warp without its greeting, and without its native warning that there is no CUDA driver."""
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
        folder = wp.config.kernel_cache_dir
        if os.access(folder, os.W_OK):
            return
    except OSError as error:
        folder = error.filename
    own = tempfile.mkdtemp(prefix="honeyguide-kernels-")
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    wp.config.kernel_cache_dir = own
    wp.init()
    os.write(2, f"the kernel cache {folder} cannot be written: kernels are compiled anew\n".encode())


_start_warp()
