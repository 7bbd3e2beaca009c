"""Pictures of snapshots, as arrays or in a window."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from relpos_env.errors import EnvError
from relpos_env.render.backend import load_pygame
from relpos_env.render.layout import size_for
from relpos_env.render.scene import Scene
from relpos_env.render.snapshot import Snapshot

if TYPE_CHECKING:
    import pygame

RENDER_MODES = ("rgb_array", "human")
SMALLEST = (240, 180)
"""[pixels]"""


class Renderer:
    """Draws snapshots.

    Law: the same snapshot gives the same picture, whatever was drawn before.
    """

    def __init__(
        self,
        *,
        mode: str = "rgb_array",
        size: tuple[int, int] | None = None,
        fps: float = 10.0,
        fine: int = 2,
    ) -> None:
        """Prepare; nothing opens before the first picture.

        Args:
            mode: ``rgb_array`` gives arrays and never touches a screen; ``human`` shows a window.
            size: Width, height [pixels]; None takes what suits the first room drawn.
            fps: Pictures a second at most in the mode ``human``, which waits for them.
            fine: Pixels drawn for one shown, along each axis; more is smoother and slower.

        Raises:
            EnvError: An argument out of range, or no pygame.
        """
        if mode not in RENDER_MODES:
            raise EnvError(f"mode: expected one of {', '.join(RENDER_MODES)}, got {mode!r}")
        if size is not None and (size[0] < SMALLEST[0] or size[1] < SMALLEST[1]):
            raise EnvError(f"size: expected at least {SMALLEST}, got {size}")
        if not fps > 0.0:
            raise EnvError(f"fps: expected above 0, got {fps}")
        if not 1 <= fine <= 8:
            raise EnvError(f"fine: expected 1 to 8, got {fine}")
        self._pg = load_pygame()
        self.mode, self.fps = mode, fps
        self._asked, self._fine = size, fine
        self._scene: Scene | None = None
        self._window: pygame.Surface | None = None
        self._clock: Any = None
        self._dismissed = False

    @property
    def dismissed(self) -> bool:
        """The user has closed the window; it stays closed until `close`."""
        return self._dismissed

    def draw(self, snapshot: Snapshot) -> NDArray[np.uint8] | None:
        """Draw one instant.

        Returns:
            Red, green, blue, (height, width, 3), a new array; None in the mode ``human``.
        """
        if self._scene is None:
            self._scene = Scene(self._asked or size_for(snapshot.room), self._fine)
        picture = self._scene.draw(snapshot)
        if self.mode == "human":
            self._show(picture, snapshot.title)
            return None
        width, height = picture.get_size()
        flat = np.frombuffer(self._pg.image.tobytes(picture, "RGB"), dtype=np.uint8)
        return flat.reshape(height, width, 3).copy()

    def close(self) -> None:
        """Close the window and forget the size; the next picture begins again."""
        if self._window is not None:
            self._pg.display.quit()
        self._window, self._scene, self._clock = None, None, None
        self._dismissed = False

    def _show(self, picture: pygame.Surface, title: str) -> None:
        pg = self._pg
        if self._dismissed:
            return
        if self._window is None:
            pg.display.init()
            self._window = pg.display.set_mode(picture.get_size())
            self._clock = pg.time.Clock()
        pg.display.set_caption(title or "relpos-env")
        self._window.blit(picture, (0, 0))
        pg.display.flip()
        for event in pg.event.get():
            escape = event.type == pg.KEYDOWN and event.key == pg.K_ESCAPE
            if event.type == pg.QUIT or escape:
                pg.display.quit()
                self._window, self._dismissed = None, True
                return
        self._clock.tick(self.fps)


def save_snapshot(
    snapshot: Snapshot, path: str | Path, *, size: tuple[int, int] | None = None, fine: int = 4
) -> None:
    """Save a picture for a page or a paper; the ending of the path says in which format.

    Args:
        snapshot: What it shows.
        path: Of the file, ``.png`` or what else pygame writes.
        size: Width, height [pixels]; None takes what suits the room. Everything grows with it,
            so (1920, 1440) is (960, 720) at twice the resolution.
        fine: As of `Renderer`.
    """
    pygame = load_pygame()
    scene = Scene(size or size_for(snapshot.room), fine)
    pygame.image.save(scene.draw(snapshot), str(path))
