"""Names of the random streams of the simulator: one number per use, never one for two uses.

A stream is the last counter of a draw (see `common/rng.py`). 1 to 9 belong to the wind, 10 to 49 to the sensors,
50 to 59 to the owner and their phone, 90 to 99 to the growing of worlds.
"""

import warp as wp

IMU_WHITE = wp.constant(10)
GYRO_TURN_ON = wp.constant(11)
ACCEL_TURN_ON = wp.constant(12)
GYRO_DRIFT = wp.constant(13)
ACCEL_DRIFT = wp.constant(14)
GYRO_DRIFT_START = wp.constant(15)
ACCEL_DRIFT_START = wp.constant(16)

GNSS_POSITION = wp.constant(20)
GNSS_VELOCITY = wp.constant(21)
GNSS_CORRELATED = wp.constant(22)
GNSS_CORRELATED_START = wp.constant(23)

BARO_WHITE = wp.constant(30)
BARO_DRIFT = wp.constant(31)
BARO_DRIFT_START = wp.constant(32)
BARO_OFFSET = wp.constant(33)

MAG_WHITE = wp.constant(36)
MAG_HARD_IRON = wp.constant(37)
MAG_SOFT_IRON_DIAGONAL = wp.constant(38)
MAG_SOFT_IRON_CROSS = wp.constant(39)

RANGE_WHITE = wp.constant(42)

CAMERA = wp.constant(43)

PITOT_WHITE = wp.constant(24)
PITOT_OFFSET = wp.constant(25)

BATTERY_VOLTAGE = wp.constant(45)
BATTERY_CURRENT = wp.constant(46)

WHEEL_SCALE_LEFT = wp.constant(47)
WHEEL_SCALE_RIGHT = wp.constant(48)
WHEEL_LEFT_WHITE = wp.constant(49)
WHEEL_RIGHT_WHITE = wp.constant(44)

OWNER_BODY = wp.constant(50)
OWNER_PLAN = wp.constant(51)
CLOTHES = wp.constant(52)
BYSTANDER = wp.constant(53)
DEPTH_HOLES = wp.constant(54)

PHONE_POSITION = wp.constant(55)
PHONE_VELOCITY = wp.constant(56)
PHONE_CORRELATED = wp.constant(57)
PHONE_CORRELATED_START = wp.constant(58)
PHONE_DROPOUT = wp.constant(59)

HILLS = wp.constant(90)
TREE_POSITIONS = wp.constant(91)
TREE_SIZES = wp.constant(92)
BOXES = wp.constant(93)
MOVERS = wp.constant(94)
