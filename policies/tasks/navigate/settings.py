"""Navigate's settings: what the policy sees the forest with, and what a quick training may leave out."""

from typing import ClassVar, Literal

from pydantic import Field

from policies.tasks.flight.settings import RigSettings

NavigatePreset = Literal["improved"]
Observation = Literal["rays", "depth"]


class NavigateSettings(RigSettings):
    """What a user may choose of Navigate."""

    conditions: ClassVar = RigSettings.conditions | {"delay_ms", "image_size"}

    preset: NavigatePreset = "improved"
    """`improved`: ours, the only one; no document describes this task."""
    observation: Observation = "rays"
    """`rays`: what is nearest in each direction, as a scanning rangefinder tells; `depth`: a depth camera's image."""
    delay_ms: int = Field(default=40, ge=0, le=96)
    """From what is seen to the setpoint that is flown, rounded to 4 ms; 40 ms is what it takes over MAVLink."""
    image_size: int = Field(default=64, ge=8, le=256)
    """Width and height of the depth image [pixels]."""
