"""Room: floor, metre grid, walls and scale bar."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relpos_env.render import palette
from relpos_env.render.canvas import Canvas
from relpos_env.render.layout import Layout
from relpos_env.render.parts.lettering import Lettering
from tracking.arrays import F64

if TYPE_CHECKING:
    import pygame

_WALL = 5.0
"""[units] Thickness of the walls."""


def rectangle(width: float, depth: float) -> F64:
    """Return the corners of a rectangle round the origin, (4, 2)."""
    half = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width, depth]
    return np.asarray(half, dtype=np.float64)


def draw_floor(canvas: Canvas, layout: Layout) -> None:
    """Draw the floor with a line every metre, the walls and the scale bar."""
    w, d = layout.room
    wall = 2.0 * _WALL * layout.unit / layout.scale
    walls = layout.pixels(rectangle(w + wall, d + wall))
    canvas.polygon(walls + 2.5 * layout.unit, palette.SHADOW, 34)
    canvas.polygon(walls, palette.WALL)
    canvas.polygon(layout.pixels(rectangle(w, d)), palette.FLOOR)
    for x in range(-int(0.5 * w), int(0.5 * w) + 1):
        canvas.lines(layout.pixels(np.array([[x, -0.5 * d], [x, 0.5 * d]])), palette.GRID)
    for y in range(-int(0.5 * d), int(0.5 * d) + 1):
        canvas.lines(layout.pixels(np.array([[-0.5 * w, y], [0.5 * w, y]])), palette.GRID)
    # Lines at the walls would cover half of them.
    canvas.lines(walls, palette.WALL, 0.5, closed=True)
    canvas.lines(_bar(layout), palette.INK, 2.0)
    for end in _bar(layout):
        tick = np.array([end - (0.0, 4.0 * layout.unit), end + (0.0, 4.0 * layout.unit)])
        canvas.lines(tick, palette.INK, 1.5)


def write_scale(picture: pygame.Surface, layout: Layout, letters: Lettering) -> None:
    """Write the length of the scale bar next to it, and the size of the room."""
    bar, unit = _bar(layout), layout.unit
    at = (float(bar[1, 0]) + 9.0 * unit, float(bar[1, 1]))
    letters.write(picture, f"{_length(layout):g} m", at, 12 * unit, palette.INK)
    corner = layout.pixels(np.array([0.5, -0.5]) * layout.room)
    text = f"{layout.room[0]:g} m × {layout.room[1]:g} m"
    at = (float(corner[0]), float(bar[1, 1]))
    letters.write(picture, text, at, 12 * unit, palette.FAINT_INK, anchor=(1.0, 0.5))


def _length(layout: Layout) -> float:
    """Return the length of the scale bar: a round number that suits the scale [m]."""
    for length in (0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0):
        if length * layout.scale >= 40.0 * layout.unit:
            return length if length >= 1.0 or max(layout.room) < 1.5 else 1.0
    return 50.0


def _bar(layout: Layout) -> F64:
    start = layout.pixels(-0.5 * np.array(layout.room))
    start = start + np.array([0.0, (_WALL + 14.0) * layout.unit])
    return np.array([start, start + np.array([_length(layout) * layout.scale, 0.0])])
