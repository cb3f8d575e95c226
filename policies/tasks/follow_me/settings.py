"""FollowMe's settings: the preset, and the choices it makes, each of which can be made by itself."""

from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field, field_validator

from common.airframe import AirframeError, load_airframe
from policies.tasks.flight.hover_bank import AIRFRAME
from policies.tasks.flight.settings import RigSettings
from sim.bodies.body import DEFAULT_BODY
from sim.bodies.vehicles import class_of

FollowPreset = Literal["as-documented", "improved", "vision-only"]
Observation = Literal["camera", "tracked", "state"]
OwnerClass = Literal["walks", "runs", "any"]
Terrain = Literal["fresh", "kept"]


class FollowSettings(RigSettings):
    """What a user may choose of FollowMe."""

    conditions: ClassVar = RigSettings.conditions | {"owner", "airframe", "terrain", "image_size"}

    preset: FollowPreset = "improved"  # type: ignore[assignment]  # tasks have presets of their own
    """`as-documented` (the text), `improved` (ours) or `vision-only` (ours, without any word of where the owner is)."""
    observation: Observation = "camera"
    """`camera`: what a policy can know in flight; `tracked`: the same, but of detector, filter and map instead of an
    image, which are drawn from a model of them, and a quicker vehicle, of 7 m/s²; `state`: the truth, for
    teachers."""
    owner: OwnerClass = "walks"
    """The owner's fastest: `walks` up to 2 m/s, `runs` up to 5 m/s, or `any` between 1 and 6 m/s, drawn per episode,
    five in eight above 4 m/s."""
    airframe: str = AIRFRAME
    """Name or TOML file of what flies; of several with + between them one is drawn per episode."""
    terrain: Terrain = "fresh"
    """`fresh` hills and trees every episode, or those of the first one `kept`."""
    image_size: int = Field(default=64, ge=8, le=256)
    """Width and height of the camera's image [pixels]."""

    @property
    def airframes(self) -> tuple[str, ...]:
        """The names in `airframe`."""
        return _airframes(self.airframe)

    @field_validator("airframe")
    @classmethod
    def _hovers(cls, airframe: str) -> str:
        for name in _airframes(airframe):
            try:
                body = class_of(load_airframe(name)).body
            except AirframeError as error:
                raise ValueError(str(error)) from None
            if body is not DEFAULT_BODY:
                raise ValueError(f"{name} cannot hover")
        return airframe


def _airframes(text: str) -> tuple[str, ...]:
    """The names and files that stand in a text with + between them; a file's own path may hold some."""
    parts, found = text.split("+"), list[str]()
    while parts:
        sizes = (k for k in range(1, len(parts) + 1) if _is_file("+".join(parts[:k])))
        size = next(sizes, 1)
        found.append("+".join(parts[:size]))
        parts = parts[size:]
    return tuple(found)


def _is_file(path: str) -> bool:
    return path.endswith(".toml") and Path(path).is_file()
