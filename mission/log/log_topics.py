"""The flight log's topics: PX4's names and fields, filled from rows of the kernel structs.

Each builder turns a batch of rows, one per 20 ms frame, into the columns of one topic. Quaternions leave as
(w, x, y, z). PX4's fields that could only ever hold one value here are left out.
"""

from mission.log.control_topics import CONTROL_TOPICS
from mission.log.estimator_topics import ESTIMATOR_TOPICS
from mission.log.motion_topics import MOTION_TOPICS
from mission.log.sensor_topics import SENSOR_TOPICS

TOPICS = (*MOTION_TOPICS, *SENSOR_TOPICS, *CONTROL_TOPICS, *ESTIMATOR_TOPICS)
