"""Canvas: a region of the image, drawn at a higher resolution and downsampled."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from relpos_env.render.backend import load_pygame
from relpos_env.render.layout import Rect
from relpos_env.render.palette import Colour
from relpos_env.render.parts.dashes import dashed
from tracking.arrays import F64

if TYPE_CHECKING:
    import pygame

SOLID: tuple[float, ...] = ()
DASHED = (6.0, 4.0)
DOTTED = (1.5, 3.0)
DASH_DOT = (7.0, 3.0, 1.5, 3.0)


class Canvas:
    """Drawing surface for a region of the image, in pixels of the whole image.

    The surface is ``fine`` times larger than the region, for antialiasing. It needs no window.
    """

    def __init__(self, region: Rect, fine: int, unit: float) -> None:
        """Create an empty canvas.

        Args:
            region: Region of the image.
            fine: Oversampling factor along each axis.
            unit: Pixels per unit of line widths and dashes.
        """
        self._pg = load_pygame()
        self.region, self.unit = region, unit
        self._fine = fine
        size = (region.width * fine, region.height * fine)
        self._surface: pygame.Surface = self._pg.Surface(size, 0, 32)
        self._small: pygame.Surface = self._pg.Surface((region.width, region.height), 0, 32)

    def fill(self, colour: Colour) -> None:
        """Fill the canvas."""
        self._surface.fill(colour)

    def copy_from(self, other: Canvas) -> None:
        """Copy another canvas of the same region."""
        self._surface.blit(other._surface, (0, 0))

    def paste(self, picture: pygame.Surface) -> None:
        """Copy the downsampled canvas to the image."""
        size = (self.region.width, self.region.height)
        self._pg.transform.smoothscale(self._surface, size, self._small)
        picture.blit(self._small, (self.region.left, self.region.top))

    def polygon(self, points: F64, colour: Colour, alpha: int = 255) -> None:
        """Fill a polygon, (point, 2), with an opacity of 0 to 255."""
        inner = self._inner(points)
        if alpha >= 255:
            self._pg.draw.polygon(self._surface, colour, inner)
            return
        xs, ys = [p[0] for p in inner], [p[1] for p in inner]
        box = self._pg.Rect(
            int(min(xs)), int(min(ys)), int(max(xs) - min(xs)) + 2, int(max(ys) - min(ys)) + 2
        ).clip(self._surface.get_rect())
        if box.width == 0 or box.height == 0:
            return
        glass = self._pg.Surface(box.size, self._pg.SRCALPHA, 32)
        self._pg.draw.polygon(
            glass, (*colour, alpha), [(x - box.left, y - box.top) for x, y in inner]
        )
        self._surface.blit(glass, box.topleft)

    def lines(
        self,
        points: F64,
        colour: Colour,
        width: float = 1.0,
        pattern: Sequence[float] = SOLID,
        *,
        closed: bool = False,
    ) -> None:
        """Draw straight lines from point to point, (point, 2).

        Args:
            points: Corners [pixels].
            colour: Colour of the line.
            width: Width [units].
            pattern: Lengths of stroke, gap, stroke, ... [units]; empty for a solid line.
            closed: True to close the line at the first point.
        """
        inner = self._inner(points)
        if closed:
            inner.append(inner[0])
        scale = self._fine * self.unit
        if pattern:
            strokes = dashed(inner, [scale * length for length in pattern])
            line = self._pg.draw.line
        else:
            strokes = list(zip(inner, inner[1:], strict=False))
            # Aliasing is visible on long lines only; antialiased lines are several times slower.
            line = self._pg.draw.aaline
        wide = max(1, round(width * scale))
        for start, end in strokes:
            line(self._surface, colour, start, end, wide)

    def circle(
        self, centre: Sequence[float] | F64, radius: float, colour: Colour, width: float = 0.0
    ) -> None:
        """Draw a circle, or a disc where the width is 0; radius in pixels, width in units."""
        x, y = self._inner(np.asarray(centre, dtype=np.float64)[None])[0]
        wide = max(1, round(width * self._fine * self.unit)) if width else 0
        self._pg.draw.circle(self._surface, colour, (x, y), radius * self._fine, wide)

    def _inner(self, points: F64) -> list[tuple[float, float]]:
        shifted = (points - (self.region.left, self.region.top)) * self._fine
        return [(x, y) for x, y in shifted.tolist()]
