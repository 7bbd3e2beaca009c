"""Renderer of snapshots, to arrays or to a window."""

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
"""[pixels] Minimum width and height."""


class Renderer:
    """Renderer of snapshots.

    Invariant: an image depends on its snapshot only, not on earlier images.
    """

    def __init__(
        self,
        *,
        mode: str = "rgb_array",
        size: tuple[int, int] | None = None,
        fps: float = 10.0,
        fine: int = 2,
    ) -> None:
        """Check the arguments; a window opens with the first image.

        Args:
            mode: ``rgb_array`` returns arrays and needs no screen; ``human`` shows a window.
            size: Width, height [pixels]; None selects a size that fits the first room.
            fps: Maximum frame rate in mode ``human`` [1/s]; `draw` waits accordingly.
            fine: Oversampling factor along each axis; larger is smoother and slower.

        Raises:
            EnvError: An argument is out of range, or pygame is not installed.
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
        """True if the user has closed the window; it stays closed until `close`."""
        return self._dismissed

    def draw(self, snapshot: Snapshot) -> NDArray[np.uint8] | None:
        """Draw one snapshot.

        Returns:
            Red, green, blue, (height, width, 3), a new array; None in mode ``human``.
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
        """Close the window and reset the size; the next image starts again."""
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
    """Save an image of a snapshot, in the format of the path's suffix.

    Args:
        snapshot: Snapshot to draw.
        path: Path of the file, ``.png`` or another format of pygame.
        size: Width, height [pixels]; None selects a size that fits the room. All parts scale with
            the size, so (1920, 1440) is (960, 720) at twice the resolution.
        fine: As for `Renderer`.
    """
    pygame = load_pygame()
    scene = Scene(size or size_for(snapshot.room), fine)
    pygame.image.save(scene.draw(snapshot), str(path))
