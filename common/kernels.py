"""Vector types, time constants and launch helpers shared by every kernel module.

One tick is one IMU sample and one pass of the flight controller; a frame is one pass of the Python part.
Array rows are `wp.struct`s: one row per vehicle, one field per physical quantity. On the CPU
`array.numpy()["pos_ned"]` is a live view of that field.
"""

import os
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


def _start_warp() -> None:
    """Initialises Warp without its greeting, and without its native warning that there is no CUDA driver."""
    wp.config.log_level = wp.LOG_WARNING
    sys.stderr.flush()
    kept = os.dup(2)
    with tempfile.TemporaryFile() as captured:
        os.dup2(captured.fileno(), 2)
        try:
            wp.init()
        finally:
            os.dup2(kept, 2)
            os.close(kept)
        captured.seek(0)
        lines = captured.read().decode(errors="replace").splitlines()
    for line in lines:
        if "NVIDIA CUDA driver" not in line:
            sys.stderr.write(line + "\n")


_start_warp()
