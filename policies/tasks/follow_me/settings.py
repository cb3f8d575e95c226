"""FollowMe's settings: the preset, and the choices it makes, each of which can be made by itself."""

from typing import ClassVar, Literal

from pydantic import Field

from policies.tasks.task import TaskSettings

FollowPreset = Literal["as-documented", "improved", "vision-only"]
Observation = Literal["camera", "tracked", "state"]
OwnerClass = Literal["walks", "runs", "any"]
Terrain = Literal["fresh", "kept"]


class FollowSettings(TaskSettings):
    """What a user may choose of FollowMe."""

    conditions: ClassVar = TaskSettings.conditions | {"owner", "has_estimator", "terrain", "image_size"}

    preset: FollowPreset = "improved"  # type: ignore[assignment]  # tasks have presets of their own
    """`as-documented` (the text), `improved` (ours) or `vision-only` (ours, without any word of where the owner is)."""
    observation: Observation = "camera"
    """`camera`: what a policy can know in flight; `tracked`: the same, but of detector, filter and map instead of an
    image, which are drawn from a model of them; `state`: the truth, for teachers."""
    owner: OwnerClass = "walks"
    """The owner's fastest: `walks` up to 2 m/s, `runs` up to 5 m/s, or `any` between 1 and 6 m/s, drawn per episode,
    five in eight above 4 m/s."""
    has_estimator: bool = True
    """Whether the flight controller flies on its estimate; if not, on the truth: quicker, in training only."""
    terrain: Terrain = "fresh"
    """`fresh` hills and trees every episode, or those of the first one `kept`."""
    image_size: int = Field(default=64, ge=8, le=256)
    """Width and height of the camera's image [pixels]."""
