"""What a user may choose of the parking tasks: a preset, and each of its options by itself.

    honeyguide train Parking1 preset=as-coded observation=ranged reward=progress goals=anywhere resets=clean

An option left empty is as the preset has it. `Rules` carries the choices into the kernels.
"""

from dataclasses import dataclass
from typing import ClassVar, Literal

import warp as wp
from pydantic import Field, field_validator

from policies.tasks.task import TaskSettings

wp.set_module_options({"enable_backward": False})

ObservationKind = Literal["", "as-documented", "as-coded", "ranged"]
RewardKind = Literal["", "as-documented", "as-documented-gail", "as-coded", "progress"]
Positions = Literal["", "published", "anywhere"]
Goals = Literal["", "published", "one", "anywhere"]
Success = Literal["", "touch", "pose"]
Actions = Literal["", "steer", "push-or-turn", "steer-and-drive", "steer-and-shift"]
Repeat = Literal["", "once", "held"]
Resets = Literal["", "clean", "as-coded"]

RAY_TARGETS = ("wall", "obstacle", "goal", "portal")

AS_DOCUMENTED, AS_CODED, RANGED, PROGRESS = 0, 1, 2, 3  # observations and rewards
STEER, PUSH_OR_TURN, STEER_AND_DRIVE, STEER_AND_SHIFT = 0, 1, 2, 3  # actions

_OBSERVATIONS = {"as-documented": AS_DOCUMENTED, "as-coded": AS_CODED, "ranged": RANGED}
_REWARDS = {
    "as-documented": AS_DOCUMENTED,
    "as-documented-gail": AS_DOCUMENTED,
    "as-coded": AS_CODED,
    "progress": PROGRESS,
}
_ACTIONS = {
    "steer": STEER,
    "push-or-turn": PUSH_OR_TURN,
    "steer-and-drive": STEER_AND_DRIVE,
    "steer-and-shift": STEER_AND_SHIFT,
}


class ParkingSettings(TaskSettings):
    """Of both levels."""

    conditions: ClassVar = TaskSettings.conditions | {
        "quarter",
        "starts",
        "goals",
        "obstacles",
        "resets",
        "mirrored",
        "storey",
    }

    quarter: int = Field(default=0, ge=0, le=4)
    """Which quarter of each storey the test places are: 1 (low x and z), 2 (high x), 3 (high z), 4 (high x and z); 0:
    cells all over it."""
    observation: ObservationKind = ""
    """`as-documented` and `as-coded`: unit vectors without ranges; `ranged`: what is where in the car's frame."""
    reward: RewardKind = ""
    """The documents' table (PPO column, PPO+GAIL column, or as the code applies it), or `progress`: ours."""
    starts: Positions = ""
    """The `published` pose, or `anywhere` free, with any yaw."""
    goals: Goals = ""
    """`published` places, `one` of them, or `anywhere` free in the cells of the chosen split. Published places are
    training spots: where nothing is chosen here, the other splits draw from their cells."""
    obstacles: Positions = ""
    """Blocks and moving obstacles at their `published` places, or `anywhere`, others in each episode."""
    success: Success = ""
    """`touch`: any overlap with the pad; `pose`: at its centre, aligned with it, and slow."""
    actions: Actions = ""
    """`steer` (always pushed), `push-or-turn` (code, level 1), `steer-and-drive` (3 x 2), `steer-and-shift` (3 x 3)."""
    repeat: Repeat = ""
    """Whether an action is applied `once` per decision or `held` for all of its physics steps."""
    resets: Resets = ""
    """`clean`, or `as-coded`: a crash keeps goal and velocity, a goal is drawn after a park only."""
    decision_period: int = Field(default=0, ge=0, le=20)
    """Physics steps of 20 ms per decision; 0: as the preset has it."""
    rays: int = Field(default=-1, ge=-1, le=50)
    """Rays to each side of the one ahead; -1: as the preset has it."""
    ray_tags: str = "obstacle"
    """What the ray sensor tells apart, in order, of wall, obstacle, goal, portal, joined by `+`."""

    @field_validator("ray_tags")
    @classmethod
    def _are_targets(cls, tags: str) -> str:
        names = tags.split("+") if tags else []
        if len(set(names)) != len(names) or not set(names) <= set(RAY_TARGETS):
            raise ValueError(f"each of {', '.join(RAY_TARGETS)} at most once, joined by +")
        return tags


class Parking1Settings(ParkingSettings):
    """Level 1 has two sides that are alike."""

    mirrored: bool = False
    """Whether published start, spots and blocks are mirrored, left to right, in one episode of two; with
    `resets=as-coded` in one environment of two."""


class Parking2Settings(ParkingSettings):
    """Level 2 adds a storey."""

    storey: Literal["", "1", "2", "both"] = ""
    """Where goals are: published ones are on storey 2 or, two of them, on storey 1."""


@dataclass(frozen=True, slots=True)
class Choices:
    """The options of a preset, or of a preset and what the user has chosen in it."""

    observation: ObservationKind
    reward: RewardKind
    starts: Positions
    goals: Goals
    obstacles: Positions
    success: Success
    actions: Actions
    repeat: Repeat
    resets: Resets
    decision_period: int
    rays: int  # -1: no ray sensor


def chosen(settings: ParkingSettings, preset: Choices) -> Choices:
    """The preset's options where the user chose none; but held-out goals are never the published ones by themselves."""
    return Choices(
        observation=settings.observation or preset.observation,
        reward=settings.reward or preset.reward,
        starts=settings.starts or preset.starts,
        goals=settings.goals or (preset.goals if settings.split == "train" else "anywhere"),
        obstacles=settings.obstacles or preset.obstacles,
        success=settings.success or preset.success,
        actions=settings.actions or preset.actions,
        repeat=settings.repeat or preset.repeat,
        resets=settings.resets or preset.resets,
        decision_period=settings.decision_period or preset.decision_period,
        rays=preset.rays if settings.rays < 0 else settings.rays,
    )


@wp.struct
class Rules:
    """The choices, the same for all environments."""

    observation: int
    reward: int
    actions: int
    are_starts_anywhere: wp.bool
    are_goals_anywhere: wp.bool
    are_obstacles_anywhere: wp.bool
    needs_pose: wp.bool
    is_held: wp.bool
    is_reset_coded: wp.bool
    is_mirrored: wp.bool  # every other episode; level 1 only
    tick_count: int  # physics steps per decision
    ray_count: int  # to each side; -1: none
    tag_count: int
    wall_tag: int  # column of a ray's one-hot, or -1
    obstacle_tag: int
    goal_tag: int
    portal_tag: int


def rules_of(choices: Choices, ray_tags: str) -> Rules:
    """The choices as the kernels read them."""
    tags = ray_tags.split("+") if ray_tags else []
    rules = Rules()
    rules.observation = _OBSERVATIONS[choices.observation]
    rules.reward = _REWARDS[choices.reward]
    rules.actions = _ACTIONS[choices.actions]
    rules.are_starts_anywhere = choices.starts == "anywhere"
    rules.are_goals_anywhere = choices.goals == "anywhere"
    rules.are_obstacles_anywhere = choices.obstacles == "anywhere"
    rules.needs_pose = choices.success == "pose"
    rules.is_held = choices.repeat == "held"
    rules.is_reset_coded = choices.resets == "as-coded"
    rules.tick_count = choices.decision_period
    rules.ray_count = choices.rays
    rules.tag_count = len(tags)
    for target in RAY_TARGETS:
        setattr(rules, f"{target}_tag", tags.index(target) if target in tags else -1)
    return rules
