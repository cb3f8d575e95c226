"""The layout of a task: what each element of an observation and of an action is. It is saved with every policy.

A policy that was trained for one layout is refused for another, with the first element that differs.
"""

from dataclasses import asdict, dataclass, field
from typing import Any


class LayoutError(ValueError):
    """A policy, a checkpoint or a recording made for another layout; the message is one sentence for the user."""


@dataclass(frozen=True, slots=True)
class Element:
    """One float of an observation, or one continuous action in [-1, 1]."""

    name: str  # quantity_frame, with the axis: "vel_car_x"
    unit: str  # SI, "1" of ratios and unit vectors
    scale: float = 1.0  # the float times this is the quantity in its unit
    is_goal: bool = False  # part of the goal: hyper-networks and hindsight replay use it


@dataclass(frozen=True, slots=True)
class Branch:
    """One discrete action: the names of its choices, in order."""

    name: str
    choices: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ImageElement:
    """The image of an observation, bytes of 0 to 255, beside its floats; it is never stacked."""

    height: int
    width: int
    channels: tuple[str, ...]  # "red", "green", "blue", "nearness"

    @property
    def shape(self) -> tuple[int, int, int]:
        """Height, width, channels."""
        return self.height, self.width, len(self.channels)


@dataclass(frozen=True, slots=True)
class Layout:
    """Observation and action of a task in one preset. A change of meaning raises `version`."""

    task: str
    version: int
    frame: tuple[Element, ...]  # one observation, before stacking
    continuous: tuple[Element, ...] = ()
    branches: tuple[Branch, ...] = ()
    stack: int = 1  # the last frames, oldest first, zeros before an episode's start
    image: ImageElement | None = None  # the newest one
    privileged: tuple[Element, ...] = ()  # what critics may see in training, and no policy

    @property
    def frame_size(self) -> int:
        return len(self.frame)

    @property
    def observation_size(self) -> int:
        return len(self.frame) * self.stack

    @property
    def image_shape(self) -> tuple[int, int, int]:
        """Height, width, channels; zeros without an image."""
        return self.image.shape if self.image is not None else (0, 0, 0)

    @property
    def branch_sizes(self) -> tuple[int, ...]:
        return tuple(len(branch.choices) for branch in self.branches)

    @property
    def goal_indices(self) -> tuple[int, ...]:
        """Where the newest frame's goal elements lie in an observation."""
        first = self.frame_size * (self.stack - 1)
        return tuple(first + k for k, element in enumerate(self.frame) if element.is_goal)

    def record(self) -> dict[str, Any]:
        """As plain data, for JSON."""
        return asdict(self)

    @staticmethod
    def from_record(record: dict[str, Any]) -> "Layout":
        """What `record` wrote."""
        return Layout(
            task=record["task"],
            version=record["version"],
            frame=tuple(Element(**element) for element in record["frame"]),
            continuous=tuple(Element(**element) for element in record["continuous"]),
            branches=tuple(Branch(branch["name"], tuple(branch["choices"])) for branch in record["branches"]),
            stack=record["stack"],
            image=_image(record.get("image")),  # of older files: none
            privileged=tuple(Element(**element) for element in record.get("privileged", ())),
        )

    def require(self, other: "Layout", source: str) -> None:
        """Refuses what was made for another layout; what only critics see may differ.

        Args:
            other: the layout that came with the policy, checkpoint or recording.
            source: where it came from, for the message.

        Raises:
            LayoutError: they differ.
        """
        difference = _first_difference(self, other)
        if difference:
            raise LayoutError(f"{source}: made for another task or preset: {difference}")


def _image(record: dict[str, Any] | None) -> ImageElement | None:
    return ImageElement(record["height"], record["width"], tuple(record["channels"])) if record else None


@dataclass(slots=True)
class _Pair:
    what: str
    here: Any
    there: Any
    differs: bool = field(init=False)

    def __post_init__(self) -> None:
        self.differs = self.here != self.there


def _first_difference(here: Layout, there: Layout) -> str:
    pairs = [
        _Pair("task", here.task, there.task),
        _Pair("layout version", here.version, there.version),
        _Pair("stacked frames", here.stack, there.stack),
        _Pair("observation size", here.observation_size, there.observation_size),
        *(
            _Pair(f"observation {k}", a.name, b.name)
            for k, (a, b) in enumerate(zip(here.frame, there.frame, strict=False))
        ),
        *(_Pair(f"scale of {a.name}", a.scale, b.scale) for a, b in zip(here.frame, there.frame, strict=False)),
        _Pair("image", _words(here.image), _words(there.image)),
        _Pair("continuous actions", [a.name for a in here.continuous], [a.name for a in there.continuous]),
        _Pair("discrete actions", [a.choices for a in here.branches], [a.choices for a in there.branches]),
    ]
    return next((f"{pair.what} is {pair.there} there and {pair.here} here" for pair in pairs if pair.differs), "")


def _words(image: ImageElement | None) -> str:
    return f"{image.height} x {image.width} of {', '.join(image.channels)}" if image is not None else "none"
