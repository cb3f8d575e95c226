"""The numbers of the guard; each can be set. Sources: measured on the x500 in flight, or guesses.

In: what a user sets by name, on a command line or in a scenario. Out: all of them, checked.
"""

from collections.abc import Mapping
from typing import Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from common.config.refusal import meant_or_known, sentence
from policies.tasks.follow_me.tracked.keep_off import (
    ESCAPE_CLIMB_M_S,
    IMAGE_SLOW_S,
    IMAGE_STOP_S,
    OWNER_BRAKE_M_S2,
    OWNER_M,
    REACTION_S,
    SLOW_S,
    STOP_S,
)

LONG_S = 3600.0
IMAGES_S = 2.5  # without images or scans for so long a companion hands back
SOLID_MAX_M = 0.9  # the map tells no more room than 1 m
_RISING = (
    ("slow_s", "stop_s"),
    ("search_s", "lost_s"),
    ("image_slow_s", "image_stop_s"),
    ("height_min_m", "height_max_m"),
    ("telemetry_slow_s", "telemetry_stop_s"),
    ("scan_slow_s", "scan_stop_s"),
    ("dark_slow_s", "dark_stop_s"),
    ("sight_slow_std", "sight_stop_std"),
)
"""The second of each is above the first."""


class GuardSettingError(ValueError):
    """A setting that is none, or that has a value that it cannot have.

    Args:
        name: of the setting.
        wrong: what is wrong, without the name.
    """

    def __init__(self, name: str, wrong: str) -> None:
        super().__init__(f"{name}: {wrong}")
        self.name, self.wrong = name, wrong


class GuardSettings(BaseModel):
    """What the guard allows."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True)

    is_on: bool = True
    """Without it what the policy wants is flown."""
    slow_s: float = Field(default=SLOW_S, gt=0.0, le=LONG_S)
    """Without a sight of the owner for so long it becomes slower ..."""
    stop_s: float = Field(default=STOP_S, gt=0.0, le=LONG_S)
    """... until it stands."""
    search_s: float = Field(default=5.0, gt=0.0, le=LONG_S)
    """After so long it searches: towards the phone, if that is heard; otherwise to where they went."""
    search_among_s: float = Field(default=2.5, gt=0.0, le=LONG_S)
    """The same where others were met not long ago and the phone is heard: the owner goes on, behind one of them."""
    lost_s: float = Field(default=60.0, gt=0.0, le=LONG_S)
    """After so long control goes back, in Hold ..."""
    return_s: float = Field(default=60.0, ge=0.0, le=LONG_S)
    """... and after so long in it, the owner still not seen, it asks for Return; 0: stays in Hold."""
    resume_s: float = Field(default=30.0, ge=0.0, le=LONG_S)
    """So long after the position was lost it may follow again by itself, if it is still in the air; 0: never."""
    sight_lost_s: float = Field(default=20.0, gt=0.0, le=LONG_S)
    """As `lost_s`, while GNSS is away: it does not search then, it stays and turns."""
    sight_speed: float = Field(default=4.0, gt=0.0, le=20.0)
    """[m/s] while GNSS is away: what is seen of the ground is near, and pictures are a tenth of a second apart."""
    sight_slow_std: float = Field(default=0.4, gt=0.0, le=20.0)
    """[m/s] From this deviation of the velocity on that odometry tells it becomes slower; without it 0.1 m/s more each
    second ..."""
    sight_stop_std: float = Field(default=0.8, gt=0.0, le=20.0)
    """... until it stands."""
    search_speed: float = Field(default=4.0, gt=0.0, le=20.0)
    """[m/s] towards the phone."""
    search_stand_off_m: float = Field(default=5.0, gt=0.0, le=20.0)
    """It comes no nearer to where the phone says ..."""
    search_among_m: float = Field(default=3.0, gt=0.0, le=20.0)
    """... and than this where others were met: from farther away clothes cannot be told apart."""
    search_round_speed: float = Field(default=1.5, ge=0.0, le=20.0)
    """[m/s] round it, where nobody is seen there."""
    search_ahead_speed: float = Field(default=2.0, ge=0.0, le=20.0)
    """[m/s] at most, without a phone, to 2 m short of where the owner would be 4 s after the last sight; guess ..."""
    search_ahead_s: float = Field(default=5.0, ge=0.0, le=LONG_S)
    """... and for so long at most; then it stays. It turns all the time; guess."""
    search_height_m: float = Field(default=2.6, gt=0.0, le=100.0)
    """Above the ground, where it waits and searches: over people, under crowns ..."""
    search_among_height_m: float = Field(default=2.9, gt=0.0, le=100.0)
    """... and where others were met: so far over their heads that they are no obstacle."""
    search_yaw_rate: float = Field(default=1.2, gt=0.0, le=3.0)
    """[rad/s] to look all round."""
    image_slow_s: float = Field(default=IMAGE_SLOW_S, gt=0.0, le=IMAGES_S)
    """From this age of the picture on it becomes slower ..."""
    image_stop_s: float = Field(default=IMAGE_STOP_S, gt=0.0, le=IMAGES_S)
    """... until it stands."""
    telemetry_slow_s: float = Field(default=0.2, gt=0.0, le=IMAGES_S)
    """Without attitude or position from the vehicle for so long it becomes slower: they come fifty times a second, and
    what is known is told from where it was then; guess ..."""
    telemetry_stop_s: float = Field(default=0.4, gt=0.0, le=IMAGES_S)
    """... until it is asked to stand; after 0.5 s control goes back; guess."""
    owner_m: float = Field(default=OWNER_M, gt=0.0, le=20.0)
    """To the middle of the owner: it comes no nearer."""
    pressed_m: float = Field(default=2.0, gt=0.0, le=20.0)
    """Nearer than this it may give way to where it has not looked, as fast as it has to. It climbs, until above, nearer
    than `owner_m` and as much as they still come nearer while it brakes, or in a third of a second."""
    escape_climb: float = Field(default=ESCAPE_CLIMB_M_S, ge=0.0, le=20.0)
    """[m/s] upwards, nearer to somebody than it may be."""
    owner_brake: float = Field(default=OWNER_BRAKE_M_S2, ge=0.5, le=20.0)
    """[m/s²] with which it is taken to brake before the owner; our flight controller's parameters may tell both ..."""
    brake: float = Field(default=OWNER_BRAKE_M_S2, ge=0.5, le=20.0)
    """... and with which it changes its velocity before what does not move."""
    reaction_s: float = Field(default=REACTION_S, ge=0.0, le=1.0)
    """From a setpoint to the motion, besides the age of the picture; measured."""
    hears_s: float = Field(default=0.2, ge=0.0, le=1.0)
    """The part of that in which nothing is seen of a new velocity; the rest is lag. Before what does not move."""
    solid_m: float = Field(default=0.7, gt=0.0, le=SOLID_MAX_M)
    """From the vehicle's middle to that of a solid cell of the map: it reaches to 0.4 m, half a cell to 0.18 m."""
    unseen_speed: float = Field(default=0.6, ge=0.0, le=20.0)
    """[m/s] to where nothing is known."""
    no_depth_speed: float = Field(default=2.5, ge=0.0, le=20.0)
    """[m/s] without depth."""
    height_min_m: float = Field(default=1.0, ge=0.0, le=100.0)
    """Above the ground: below it climbs."""
    height_max_m: float = Field(default=3.5, gt=0.0, le=100.0)
    """Above the ground: higher it does not climb; crowns begin soon after."""
    tilt_max_deg: float = Field(default=50.0, gt=0.0, le=90.0)
    """Tilted by more it is asked to go on as it does, or to stand if it drives; autopilots tilt to 45."""
    speed_max: float = Field(default=7.5, gt=0.0, le=20.0)
    """[m/s] level, of whoever goes to goals; policies ask for 7."""
    scan_slow_s: float = Field(default=0.4, gt=0.0, le=IMAGES_S)
    """From this age of the ranges on whoever goes to goals becomes slower ..."""
    scan_stop_s: float = Field(default=0.7, gt=0.0, le=IMAGES_S)
    """... until it stands."""
    dark_slow_s: float = Field(default=0.3, gt=0.0, le=60.0)
    """Without any return in the scans for so long it becomes as slow as without depth ..."""
    dark_stop_s: float = Field(default=2.0, gt=0.0, le=60.0)
    """... and after so long it stands, if its beams should see the ground."""
    crown_m: float = Field(default=0.8, gt=0.0, le=100.0)
    """It stays so far below what it has seen overhead."""
    goal_reaction_s: float = Field(default=0.25, ge=0.0, le=1.0)
    """From a setpoint to the motion of whoever goes to goals, besides the age of the ranges; measured: 0.17 s, and
    0.05 s since then by which feedback is as late as the vehicle."""
    goal_solid_m: float = Field(default=0.5, gt=0.0, le=SOLID_MAX_M)
    """As `solid_m`, of whoever goes to goals, between trees that may stand 1.5 m apart."""
    goal_period_s: float = Field(default=0.1, ge=0.0, le=1.0)
    """So long what is allowed is driven along the nose, until the next scan."""
    drive_brake: float = Field(default=2.5, ge=0.5, le=20.0)
    """[m/s²] with which what drives brakes; measured on the rover."""
    drive_reaction_s: float = Field(default=0.2, ge=0.0, le=1.0)
    """As `goal_reaction_s`, of what drives."""
    hull_half_length_m: float = Field(default=0.37, gt=0.0, le=5.0)
    """Of what is driven along its nose; those of the rover."""
    hull_half_width_m: float = Field(default=0.22, gt=0.0, le=5.0)
    """Likewise."""
    hull_room_m: float = Field(default=0.02, ge=0.0, le=5.0)
    """It comes no nearer to anything with its hull."""

    @property
    def changed(self) -> dict[str, float]:
        """The numbers that were set, even to what they ship as: a vehicle may tell a guard another."""
        return self.model_dump(exclude={"is_on"}, exclude_unset=True)

    @model_validator(mode="after")
    def _rises(self) -> Self:
        for low, high in _RISING:
            less, more = getattr(self, low), getattr(self, high)
            if less >= more and low in self.model_fields_set:
                raise GuardSettingError(low, f"must be below {high}, which is {more:g}")
            if less >= more:
                raise GuardSettingError(high, f"must be above {low}, which is {less:g}")
        return self


SETTINGS = tuple(name for name in GuardSettings.model_fields if name != "is_on")
"""Those that are numbers."""


def guard_settings(given: Mapping[str, float]) -> GuardSettings:
    """A guard that is on, with some settings by their names.

    Raises:
        GuardSettingError: the first that is wrong.
    """
    for name in given:
        if name not in SETTINGS:
            raise GuardSettingError(name, f"the guard has no such setting; {meant_or_known(name, SETTINGS)}")
    try:
        return GuardSettings.model_validate(given)
    except ValidationError as error:
        first = error.errors()[0]
        raised = first.get("ctx", {}).get("error")
        if isinstance(raised, GuardSettingError):
            raise raised from error
        raise GuardSettingError(str(first["loc"][0]), sentence(first, GuardSettings)) from error
