"""A window that shows pictures at the pace of the robots' own time, for `render_mode="human"`."""

import os

import numpy as np
from numpy.typing import NDArray

from sim.errors import DisplayError

_NO_SCREEN = "offscreen"  # what SDL falls back to where there is no display


class Window:
    """One window; it opens with the first picture, and once its user has closed it, pictures go nowhere.

    Args:
        title: of the window.
        period: seconds that a picture stays at least.

    Raises:
        DisplayError: pygame is not installed, or there is no display.
    """

    def __init__(self, title: str, period: float) -> None:
        # Only now: it is an extra, and prints a line when it is imported.
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        try:
            import pygame
        except ImportError as error:
            raise DisplayError('render_mode="human" draws with pygame: install the package pygame-ce') from error
        self._pygame = pygame
        try:
            pygame.display.init()
        except pygame.error as error:
            raise DisplayError(f'render_mode="human" needs a display ({error}): use "rgb_array" here') from error
        if pygame.display.get_driver() == _NO_SCREEN and os.environ.get("SDL_VIDEODRIVER") != _NO_SCREEN:
            raise DisplayError('render_mode="human" needs a display, and this machine has none: use "rgb_array" here')
        self._title, self._period = title, period
        self._window: pygame.Window | None = None
        self._clock = pygame.time.Clock()
        self._closed = False

    def show(self, picture: NDArray[np.uint8]) -> None:
        """Show a picture, (height, width, 3) RGB, when the one before has stood for its time."""
        pygame = self._pygame
        if self._closed:
            return
        size = picture.shape[1], picture.shape[0]
        if self._window is None:
            self._window = pygame.Window(self._title, size)
        if self._window.size != size:  # another arena
            self._window.size = size
        pygame.surfarray.blit_array(self._window.get_surface(), picture.swapaxes(0, 1))
        self._clock.tick(1.0 / self._period)
        self._window.flip()
        if any(event.window is self._window for event in pygame.event.get(pygame.WINDOWCLOSE)):
            self.close()
        pygame.event.pump()

    def close(self) -> None:
        """Close the window for good."""
        self._closed = True
        if self._window is not None:
            self._window.destroy()
            self._window = None
