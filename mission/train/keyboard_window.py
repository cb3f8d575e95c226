"""A window that shows images and says which keys are held; pygame is imported when it opens."""

import os
from enum import StrEnum
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from policies.experts.keyboard import Control


class WindowError(RuntimeError):
    """There is no display; the message is one sentence for the user."""


class Request(StrEnum):
    """What a person asks for with a key or the mouse."""

    END = "end"
    RESTART = "restart"


class Window:
    """An image on the screen. Arrow keys or WASD steer, space brakes, R restarts, Esc or closing the window ends."""

    def __init__(self, title: str) -> None:
        """Opens nothing yet: the first image says how large the window is.

        Raises:
            WindowError: no display.
        """
        if not any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")):
            raise WindowError("there is no display to open a window on")  # SDL would print a line of its own first
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        import pygame

        self._pygame: Any = pygame
        self._title = title
        self._surface: Any = None
        self.held: set[Control] = set()
        try:
            pygame.display.init()
        except pygame.error as error:
            raise WindowError(f"there is no display to open a window on ({error})") from None
        # SDL falls back to images that nobody sees, unless it was asked for them.
        driver = pygame.display.get_driver()
        if driver == "offscreen" and os.environ.get("SDL_VIDEODRIVER") != driver:
            pygame.display.quit()
            raise WindowError("there is no display to open a window on")
        self._controls = {
            key: control
            for control, keys in {
                Control.FORWARD: (pygame.K_UP, pygame.K_w),
                Control.BACK: (pygame.K_DOWN, pygame.K_s),
                Control.LEFT: (pygame.K_LEFT, pygame.K_a),
                Control.RIGHT: (pygame.K_RIGHT, pygame.K_d),
                Control.BRAKE: (pygame.K_SPACE,),
            }.items()
            for key in keys
        }

    def show(self, image: NDArray[np.uint8], title: str = "") -> None:
        """Shows an RGB image, shape (height, width, 3), under a title."""
        pygame = self._pygame
        height, width = image.shape[:2]
        if self._surface is None:
            self._surface = pygame.display.set_mode((width, height))
        pygame.display.set_caption(title or self._title)
        self._surface.blit(
            pygame.image.frombuffer(np.ascontiguousarray(image).tobytes(), (width, height), "RGB"), (0, 0)
        )
        pygame.display.flip()

    def requests(self) -> set[Request]:
        """What was asked for since the last call; `held` is brought up to date."""
        pygame = self._pygame
        asked: set[Request] = set()
        for event in pygame.event.get():
            if event.type == pygame.QUIT or (event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE):
                asked.add(Request.END)
            elif event.type == pygame.KEYDOWN and event.key == pygame.K_r:
                asked.add(Request.RESTART)
            elif event.type == pygame.KEYDOWN and event.key in self._controls:
                self.held.add(self._controls[event.key])
            elif event.type == pygame.KEYUP and event.key in self._controls:
                self.held.discard(self._controls[event.key])
        return asked

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pygame.display.quit()
