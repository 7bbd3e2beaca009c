"""Obstacles: fixed ones are drawn hatched, movable ones as crates."""

from __future__ import annotations

import numpy as np

from relpos_env.render import palette
from relpos_env.render.canvas import Canvas
from relpos_env.render.layout import Layout
from relpos_env.render.parts.floor import rectangle
from tracking.arrays import F64

_HATCH = 9.0
"""[units] Distance between lines."""


def draw_box(canvas: Canvas, layout: Layout, box: F64, *, movable: bool) -> None:
    """Draw one obstacle with its shadow; ``box`` is a row of `Snapshot.boxes`."""
    x, y, half_width, half_depth, c, s = box.tolist()
    if half_width <= 0.0 or half_depth <= 0.0:
        return
    angle = float(np.arctan2(s, c))
    outline = layout.shape(rectangle(2.0 * half_width, 2.0 * half_depth), x, y, angle)
    canvas.polygon(outline + np.array([3.0, 4.0]) * layout.unit, palette.SHADOW, 40)
    canvas.polygon(outline, palette.CRATE if movable else palette.BOX)
    if movable:
        inset = min(4.0 * layout.unit / layout.scale, 0.4 * half_width, 0.4 * half_depth)
        inner = rectangle(2.0 * (half_width - inset), 2.0 * (half_depth - inset))
        frame = layout.shape(inner, x, y, angle)
        canvas.lines(frame, palette.CRATE_PLANK, 1.5, closed=True)
        canvas.lines(frame[[0, 2]], palette.CRATE_PLANK, 1.5)
        canvas.lines(frame[[1, 3]], palette.CRATE_PLANK, 1.5)
    else:
        for stroke in hatching(half_width, half_depth, _HATCH * layout.unit / layout.scale):
            canvas.lines(layout.shape(stroke, x, y, angle), palette.BOX_HATCH, 1.0)
    edge = palette.CRATE_EDGE if movable else palette.BOX_EDGE
    canvas.lines(outline, edge, 1.5, closed=True)


def hatching(half_width: float, half_depth: float, spacing: float) -> list[F64]:
    """Return diagonal strokes that fill a rectangle round the origin, each (2, 2).

    Invariant: every end lies on the border, and all strokes rise at 45 degrees.
    """
    step = spacing * np.sqrt(2.0)
    strokes = []
    # Lines y = x + offset, clipped to the x for which (x, x + offset) is in the rectangle.
    for offset in np.arange(-half_width - half_depth + step, half_width + half_depth, step):
        x0 = max(-half_width, -half_depth - offset)
        x1 = min(half_width, half_depth - offset)
        if x1 > x0:
            strokes.append(np.array([[x0, x0 + offset], [x1, x1 + offset]]))
    return strokes
