"""Spaces of Gymnasium's environments as a layout: what becomes a float, what the image, and what an action.

In: the spaces of one environment, and what a batch of them shows. Out: elements, and arrays of floats and bytes; the
way back for actions. Vectors, counts and flags become floats in the order of Gymnasium's `flatten` (keys sorted, counts
as one-hot); one image of bytes may stand beside them.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import Space
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete, Tuple
from numpy.typing import NDArray

from policies.tasks.layout import Branch, Element, ImageElement

Array = NDArray[Any]

MAX_FLOATS = 10_000  # of a frame: more is a picture in disguise (guess)
_COLOURS = {1: ("grey",), 3: ("red", "green", "blue"), 4: ("red", "green", "blue", "alpha")}


class UnfitSpace(ValueError):
    """A space that no policy here can see or act in; the message is one sentence for the user."""


@dataclass(frozen=True, slots=True)
class _Leaf:
    """One plain space inside an observation, and the keys that lead there."""

    keys: tuple[Any, ...]
    space: Space[Any]

    @property
    def name(self) -> str:
        return "_".join(map(str, self.keys)) or "observation"

    def of(self, observation: Any) -> Array:
        """Its part of a batch of observations."""
        for key in self.keys:
            observation = observation[key]
        return np.asarray(observation)


class ObservationReader:
    """Batches of observations as floats and an image."""

    def __init__(self, space: Space[Any]) -> None:
        """Finds out what is in a space.

        Raises:
            UnfitSpace: something that is no vector and no image, or several images.
        """
        leaves = list(_leaves(space, ()))
        images = [leaf for leaf in leaves if _is_image(leaf.space)]
        if len(images) > 1:
            raise UnfitSpace(f"its observation shows {len(images)} images; one at most can be seen")
        self._image = images[0] if images else None
        self._floats = [leaf for leaf in leaves if leaf not in images]
        self.elements = tuple(element for leaf in self._floats for element in _elements(leaf))
        if len(self.elements) > MAX_FLOATS:
            raise UnfitSpace(f"its observation has {len(self.elements)} floats; {MAX_FLOATS} at most can be seen")
        shape = (self._image.space.shape if self._image is not None else None) or ()
        self._is_channel_first = len(shape) == 3 and shape[-1] > max(_COLOURS)
        self.image = _image_element(shape, is_channel_first=self._is_channel_first) if shape else None

    def floats(self, observations: Any) -> Array:
        """Shape (rows, elements), float32."""
        columns = [_flat(leaf.space, leaf.of(observations)) for leaf in self._floats]
        return np.concatenate(columns, axis=1, dtype=np.float32)

    def images(self, observations: Any) -> Array:
        """Shape (rows, height, width, channels)."""
        if self._image is None or self.image is None:
            raise ValueError("there is no image")
        pixels = self._image.of(observations)
        pixels = np.moveaxis(pixels, 1, -1) if self._is_channel_first else pixels
        return pixels.reshape(len(pixels), *self.image.shape)


def _leaves(space: Space[Any], keys: tuple[Any, ...]) -> Iterator[_Leaf]:
    if isinstance(space, Dict | Tuple):
        for key, below in space.spaces.items() if isinstance(space, Dict) else enumerate(space.spaces):
            yield from _leaves(below, (*keys, key))
    elif isinstance(space, Box | Discrete | MultiBinary | MultiDiscrete):
        yield _Leaf(keys, space)
    else:
        raise UnfitSpace(
            f"its observation space is {type(space).__name__}; a Box, a Discrete, a MultiDiscrete, a MultiBinary, "
            "or a Dict or Tuple of these can be seen"
        )


def _is_image(space: Space[Any]) -> bool:
    shape = space.shape or ()
    is_bytes = isinstance(space, Box) and space.dtype == np.uint8
    return is_bytes and (len(shape) == 2 or (len(shape) == 3 and min(shape[0], shape[-1]) <= max(_COLOURS)))


def _image_element(shape: tuple[int, ...], *, is_channel_first: bool) -> ImageElement:
    height, width, channels = (*shape[1:], shape[0]) if is_channel_first else (*shape, 1)[:3]
    return ImageElement(height, width, _COLOURS.get(channels, tuple(f"channel_{k}" for k in range(channels))))


def _elements(leaf: _Leaf) -> Iterator[Element]:
    count = _flat(leaf.space, np.zeros((1, *(leaf.space.shape or ())), dtype=leaf.space.dtype), is_start=True).shape[1]
    for k in range(count):
        yield Element(f"{leaf.name}_{k}" if count > 1 else leaf.name, "1")


def _flat(space: Space[Any], values: Array, *, is_start: bool = False) -> Array:
    """A batch of values of a plain space as floats, shape (rows, floats); `is_start`: of values that do not matter."""
    if isinstance(space, Discrete):
        return _one_hot(values - (0 if is_start else space.start), int(space.n))
    if isinstance(space, MultiDiscrete):
        choices = (values - (0 if is_start else space.start)).reshape(len(values), -1)
        sizes = space.nvec.ravel()
        return np.concatenate([_one_hot(choices[:, k], int(size)) for k, size in enumerate(sizes)], axis=1)
    return values.reshape(len(values), -1).astype(np.float32)


def _one_hot(choices: Array, size: int) -> Array:
    return np.eye(size, dtype=np.float32)[choices.astype(np.int64)]


class ActionWriter:
    """Actions of a policy as a batch of actions of a space."""

    def __init__(self, space: Space[Any]) -> None:
        """Finds out what a space takes.

        Raises:
            UnfitSpace: something else than bounded floats or choices.
        """
        self._space = space
        self.continuous: tuple[Element, ...] = ()
        self.branches: tuple[Branch, ...] = ()
        if isinstance(space, Box) and np.issubdtype(space.dtype, np.floating):
            if not (np.isfinite(space.low).all() and np.isfinite(space.high).all()):
                raise UnfitSpace("its action space has no bounds; gymnasium.wrappers.TransformAction can give it some")
            count = int(np.prod(space.shape))
            self.continuous = tuple(Element(f"action_{k}", "1") for k in range(count))
        elif isinstance(space, Discrete):
            self.branches = (_branch("action", int(space.n)),)
        elif isinstance(space, MultiDiscrete | MultiBinary):
            sizes = space.nvec.ravel() if isinstance(space, MultiDiscrete) else [2] * int(np.prod(space.shape))
            self.branches = tuple(_branch(f"action_{k}", int(size)) for k, size in enumerate(sizes))
        else:
            raise UnfitSpace(
                f"its action space is {_words(space)}; a Box of floats, a Discrete, a MultiDiscrete or a MultiBinary "
                "can be acted in"
            )

    def actions(self, continuous: Array, branches: Array) -> Array:
        """As the space has them, shape (rows, …).

        Args:
            continuous: in [-1, 1], shape (rows, continuous actions).
            branches: choices from 0 on, shape (rows, branches).
        """
        space, rows = self._space, len(continuous)
        if isinstance(space, Box):
            fraction = 0.5 * (1.0 + np.clip(continuous, -1.0, 1.0)).reshape(rows, *space.shape)
            return np.asarray(space.low + fraction * (space.high - space.low), dtype=space.dtype)
        if isinstance(space, Discrete):
            return np.asarray(branches[:, 0] + space.start, dtype=space.dtype)
        start = space.start if isinstance(space, MultiDiscrete) else 0
        return np.asarray(branches.reshape(rows, *(space.shape or ())) + start, dtype=space.dtype)


def _branch(name: str, size: int) -> Branch:
    return Branch(name, tuple(map(str, range(size))))


def _words(space: Space[Any]) -> str:
    return f"a Box of {space.dtype}" if isinstance(space, Box) else f"a {type(space).__name__}"
