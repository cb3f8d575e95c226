"""Vector types, time constants and launch helpers shared by every kernel module.

One tick is one IMU sample and one pass of the flight controller; a frame is one pass of the Python part.
Array rows are `wp.struct`s: one row per vehicle, one field per physical quantity. On the CPU
`array.numpy()["pos_ned"]` is a live view of that field.
"""

import warp as wp

MAX_MOTORS = 8
ERROR_STATES = 24
YAW_MODELS = 5  # headings from which the yaw estimator starts

vec5 = wp.types.vector(length=YAW_MODELS, dtype=wp.float32)
vec8 = wp.types.vector(length=MAX_MOTORS, dtype=wp.float32)
vec24 = wp.types.vector(length=ERROR_STATES, dtype=wp.float32)

TICK_US = 4_000
TICK_S = 0.004
SUBSTEPS = 4  # body steps of 1 ms in a tick
FRAME_TICKS = 5  # ticks in a 50 Hz frame of commander, navigator and MAVLink
FRAME_US = TICK_US * FRAME_TICKS


@wp.func
def tick_end_us(tick: wp.int64) -> wp.int64:
    """When the tick of an index, counted from power-on, ends [us]; 32 bits would be over after 99 days."""
    return (tick + wp.int64(1)) * wp.int64(TICK_US)
