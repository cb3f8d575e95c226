"""What a companion notes of each decision, for those who learn from flights: what was shown, chosen, and flown.

Out: a `Decision` to whoever listens, 10 Hz: whoever flies, a policy, a script, or a human or a mission while the
companion only looks on. It holds what came over MAVLink and nothing of a simulator. The functions below give its form
in a ULog: the flight's, or one of the companion's own.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.attitude import Vector, rotated, yaw_of
from policies.companion.guard.interventions import REASONS
from policies.companion.skills.skill import Floats, Velocity
from policies.companion.telemetry import Own
from policies.tasks.layout import Layout

TOPIC = "policy_decision"
LAYOUT_KEY, PILOT_KEY, GUARD_KEY = "decision_layout", "decision_pilot", "decision_guard"  # of the log's information
IMAGE_LAYOUT_KEY = "decision_image_layout"  # where a pilot decides on an image
_TEXT_MAX = 60_000  # [byte] of one piece of information
NO_GOAL: Vector = (nan, nan, nan)


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """One decision, or where the companion does not fly what it would have been made on."""

    time_us: int  # on the companion's clock
    boot_us: int  # on the vehicle's, of its newest attitude
    is_flying: bool  # False: somebody else flies, and `action` is none
    is_first: bool  # since it took over, or let go
    frame: Floats  # the newest frame of the observation, (elements,)
    vector: Floats | None  # beside the image, of a pilot that decides on both, (elements,)
    action: Floats  # in [-1, 1], (actions,); NaN: none
    wanted: Velocity  # what the action asks for
    flown: Velocity  # what was sent, as a guard let it; of who else flies: how the vehicle moves
    stance: str  # of the guard; "": none has looked
    reasons: tuple[str, ...]  # why the guard has changed it
    own: Own
    goal: Vector  # [m] north, east, and down or the heading [rad]; NaN: none
    image: NDArray[np.uint8] | None  # that was looked at, (height, width, channels)


OnDecision = Callable[[Decision], None]


def motion_of(own: Own) -> Velocity:
    """How a vehicle moves: velocity in ned [m/s] and yaw rate [rad/s]."""
    return own.vel_ned, rotated(own.q_ned_from_frd, own.omega_frd)[2]


def motion_along_nose(own: Own) -> Velocity:
    """The same as those are asked for that drive along their nose."""
    nose = rotated(own.q_ned_from_frd, (1.0, 0.0, 0.0))
    speed = sum(a * b for a, b in zip(nose, own.vel_ned, strict=True))
    return (speed, 0.0, 0.0), own.omega_frd[2]


def topic_fields(layout: Layout, image_layout: Layout | None = None) -> dict[str, str]:
    """The topic's ULog fields, in the order of `topic_row`.

    Args:
        layout: of frames.
        image_layout: of vectors and images; None: its pilot decides on no image.
    """
    vector = {} if image_layout is None else {"vector": f"float[{image_layout.frame_size}]"}
    return {
        "boot_us": "uint64_t",
        "frame": f"float[{layout.frame_size}]",
        "action": f"float[{len(layout.continuous)}]",
        **dict.fromkeys(("wanted", "flown"), "float[4]"),  # velocity [m/s] and yaw rate [rad/s]
        **dict.fromkeys(("pos_ned", "vel_ned", "goal"), "float[3]"),
        "yaw": "float",
        "i_image": "int32_t",  # -1: none was kept
        **dict.fromkeys(("is_flying", "is_first"), "bool"),
        "guard_stance": "uint8_t",  # its place in the information's list, from 1; 0: no guard has looked
        "guard_reasons": "uint16_t",  # a bit for each that the information lists
        **vector,
    }


def topic_row(decision: Decision, i_image: int, stances: Sequence[str]) -> tuple[Any, ...]:
    """A decision as a row of the topic, given the stances of its guard."""
    own = decision.own
    return (
        max(decision.boot_us, 0),
        *map(float, decision.frame),
        *map(float, decision.action),
        *decision.wanted[0],
        decision.wanted[1],
        *decision.flown[0],
        decision.flown[1],
        *own.pos_ned,
        *own.vel_ned,
        *decision.goal,
        yaw_of(own.q_ned_from_frd),
        i_image,
        decision.is_flying,
        decision.is_first,
        stances.index(decision.stance) + 1 if decision.stance else 0,
        sum(1 << place for place, reason in enumerate(REASONS) if reason in decision.reasons),
        *(() if decision.vector is None else map(float, decision.vector)),
    )


def topic_info(
    layout: Layout, pilot: str, stances: Sequence[str], image_layout: Layout | None = None
) -> Mapping[str, Sequence[str]]:
    """What the topic is read with; texts by key."""
    info = {
        LAYOUT_KEY: _texts(layout),
        PILOT_KEY: [pilot],
        GUARD_KEY: [json.dumps({"stances": stances, "reasons": REASONS})],
    }
    return info if image_layout is None else info | {IMAGE_LAYOUT_KEY: _texts(image_layout)}


def _texts(layout: Layout) -> Sequence[str]:
    text = json.dumps(layout.record())
    return [text[at : at + _TEXT_MAX] for at in range(0, len(text), _TEXT_MAX)]
