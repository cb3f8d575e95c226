"""The log's topic of what a replay shows besides the truth, in flights that are to be replayed: a row per frame kept.

In: once per frame, what no kernel row holds: where the vehicle flies to, what a policy on board chose, and the owner.
Out: these with the vehicle's state and its motors' speeds, as a topic of our own; `mission.view.replay_file` reads it.
"""

from typing import Any

import numpy as np

from mission.log.topic import Batch, Columns, Topic
from sim.world.people import Person

ACTIONS = 4  # what a policy chooses: velocity ahead, right and down, and yaw rate, each in [-1, 1]
MOTORS = 8  # as many as a vehicle can have
_PERSON: Any = Person
OWNER = np.dtype(_PERSON.numpy_dtype())
SHOWN = np.dtype(
    [
        ("goal_ned", "f4", 3),  # [m] where the vehicle flies to; NaN: nowhere
        ("action", "f4", ACTIONS),  # of the policy on board; NaN: none
        ("owner", OWNER),  # a stature of 0: nobody
    ]
)
"""What is noted in each frame."""


def _ulog_type(dtype: Any) -> str:
    base, shape = dtype.subdtype or (dtype, ())
    name = "float" if base.kind == "f" else "int32_t"
    return f"{name}[{shape[0]}]" if shape else name


def _columns(batch: Batch) -> Columns:
    shown: Any = batch.shown
    vehicle, truth = batch.vehicle, batch.truth
    return {
        "timestamp": batch.time_us,
        "motor_speed": truth["motor_speed"],
        "is_on_ground": truth["is_on_ground"],
        "battery": vehicle["battery_remaining"],
        "mode": vehicle["mode"],
        "is_armed": vehicle["is_armed"],
        "goal_ned": shown["goal_ned"],
        "action": shown["action"],
        **{f"owner_{name}": shown["owner"][name] for name in OWNER.names or ()},
    }


REPLAY_TOPIC = Topic(
    "replay_frame",
    {
        "motor_speed": f"float[{MOTORS}]",
        "battery": "float",
        "goal_ned": "float[3]",
        "action": f"float[{ACTIONS}]",
        **{f"owner_{name}": _ulog_type(OWNER[name]) for name in OWNER.names or ()},
        "mode": "uint8_t",
        **dict.fromkeys("is_armed is_on_ground".split(), "bool"),
    },
    _columns,
)
