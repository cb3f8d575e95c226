"""ReachTarget's settings: variant and preset, and the options they choose, each of which can be chosen by itself."""

from typing import ClassVar, Literal

from pydantic import Field

from policies.tasks.task import TaskSettings

Observation = Literal["world", "world-heading", "car", "ego"]
Reward = Literal["sparse", "shaped", "shaped-each-step", "potential"]
Success = Literal["reach", "reach-goes-on", "pose"]
Start = Literal["centre", "anywhere"]
Goals = Literal["everywhere", "split"]
Heights = Literal["local", "stacked"]

_OBSERVATIONS: tuple[Observation, ...] = ("world", "world", "world-heading", "car", "car")
_IS_SHAPED = (False, True, True, True, False)


class ReachSettings(TaskSettings):
    """What a user may choose of ReachTarget. `auto` is what the preset has."""

    conditions: ClassVar = TaskSettings.conditions | {"start", "goals"}

    variant: int = Field(default=4, ge=0, le=4)
    """Which of the article's five agents; `improved` has one agent only and ignores it."""
    observation: Observation | Literal["auto"] = "auto"
    """`world` (A0, A1), `world-heading` (A2), `car` (A3, A4) or `ego` (ours)."""
    reward: Reward | Literal["auto"] = "auto"
    """+1 for the target, and: nothing (`sparse`), speed towards it once per decision (`shaped`) or at every physics
    step (`shaped-each-step`), or a potential-based shaping (`potential`)."""
    success: Success | Literal["auto"] = "auto"
    """`reach` ends the episode at the target; `reach-goes-on` moves the target and goes on; `pose` asks for position,
    heading and speed."""
    start: Start | Literal["auto"] = "auto"
    """`centre`, and after a success where the car is; or `anywhere`."""
    goals: Goals | Literal["auto"] = "auto"
    """`everywhere`, whatever the split: held-out episodes are new draws; or `split`: the targets of the
    three splits lie in disjoint squares of the platform."""
    heights: Heights = "local"
    """`stacked`: world heights as the published scene shows them to A0-A2, 20 m lower for each of 16 platforms."""

    def resolved(self) -> "ReachSettings":
        """The same with every `auto` replaced."""
        is_shaped = _IS_SHAPED[self.variant]
        chosen: dict[str, str] = {
            "observation": _OBSERVATIONS[self.variant],
            "reward": "shaped" if is_shaped else "sparse",
            "success": "reach",
            "start": "centre",
            "goals": "everywhere",
        }
        if self.preset == "as-documented":
            chosen |= {"reward": "shaped-each-step" if is_shaped else "sparse", "success": "reach-goes-on"}
        if self.preset == "improved":
            chosen = {"observation": "ego", "reward": "potential", "success": "pose"}
            chosen |= {"start": "anywhere", "goals": "split"}
        update = {name: value for name, value in chosen.items() if getattr(self, name) == "auto"}
        return self.model_copy(update=update)
