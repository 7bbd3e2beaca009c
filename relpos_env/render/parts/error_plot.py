"""Plot of the errors of the last seconds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relpos_env.render import palette
from relpos_env.render.canvas import Canvas
from relpos_env.render.layout import Layout, Rect
from relpos_env.render.parts.lettering import Lettering
from relpos_env.render.snapshot import Snapshot
from tracking.arrays import Bool

if TYPE_CHECKING:
    import pygame

WINDOW = 20.0
"""[s] Time window of the plot."""
_TOPS = (0.05, 0.1, 0.2, 0.4, 0.5, 1.0, 2.0, 4.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""[m] Possible upper limits of the error axis; half of each is a round number."""


def error_axis(snapshot: Snapshot) -> float:
    """Return the upper limit of the error axis: a round number above all displayed errors [m]."""
    shown = snapshot.history_t >= snapshot.t - WINDOW
    errors = np.concatenate([snapshot.formation_error[shown], snapshot.tracking_error[shown]])
    errors = errors[np.isfinite(errors)]
    most = float(errors.max()) if len(errors) else 0.0
    return next((top for top in _TOPS if top >= 1.02 * most), _TOPS[-1])


def axes_of(layout: Layout) -> Rect:
    """Return the area of the plot's axes [pixels]."""
    u, plot = layout.unit, layout.plot
    return Rect(
        plot.left + round(46 * u),
        plot.top + round(42 * u),
        max(plot.width - round(62 * u), 8),
        max(plot.height - round(84 * u), 8),
    )


def draw_errors(canvas: Canvas, layout: Layout, snapshot: Snapshot) -> None:
    """Draw axes and curves."""
    box, u = axes_of(layout), layout.unit
    for k in range(3):
        level = box.bottom - 0.5 * k * box.height
        colour = palette.FAINT_INK if k == 0 else palette.GRID
        canvas.lines(np.array([[box.left, level], [box.right, level]]), colour)
    for seconds in _ticks(snapshot.t):
        tick = box.right + (seconds - snapshot.t) / WINDOW * box.width
        canvas.lines(np.array([[tick, box.bottom], [tick, box.bottom + 4 * u]]), palette.FAINT_INK)
    top = error_axis(snapshot)
    curves = (
        (snapshot.formation_error, palette.FORMATION_ERROR),
        (snapshot.tracking_error, palette.TRACKING_ERROR),
    )
    x = box.right + (snapshot.history_t - snapshot.t) / WINDOW * box.width
    for error, colour in curves:
        y = box.bottom - np.clip(error / top, 0.0, 1.0) * box.height
        shown = np.isfinite(y) & (x >= box.left) & (x <= box.right)
        for part in stretches(shown):
            canvas.lines(np.stack([x[part], y[part]], axis=1), colour, 1.8)


def write_errors(
    picture: pygame.Surface, layout: Layout, snapshot: Snapshot, letters: Lettering
) -> None:
    """Write the labels of the axes and of the curves."""
    box, u, faint = axes_of(layout), layout.unit, palette.FAINT_INK
    top = error_axis(snapshot)
    for k in range(3):
        at = (box.left - 6 * u, box.bottom - 0.5 * k * box.height)
        letters.write(picture, f"{0.5 * k * top:g}", at, 11 * u, faint, anchor=(1.0, 0.5))
    for seconds in _ticks(snapshot.t):
        x = box.right + (seconds - snapshot.t) / WINDOW * box.width
        at = (x, box.bottom + 12 * u)
        letters.write(picture, f"{seconds:g}", at, 11 * u, faint, anchor=(0.5, 0.5))
    middle = (0.5 * (box.left + box.right), box.bottom + 28 * u)
    letters.write(picture, "time [s]", middle, 11 * u, faint, anchor=(0.5, 0.5))
    y, left = layout.plot.top + 18 * u, layout.plot.left + 14 * u
    letters.write(picture, "error [m]", (left, y), 11 * u, faint)
    formation = left + letters.width("error [m]", 11 * u) + 14 * u
    colour = palette.FORMATION_ERROR
    letters.write(picture, "formation", (formation, y), 12 * u, colour, bold=True)
    tracking = formation + letters.width("formation", 12 * u, bold=True) + 12 * u
    colour = palette.TRACKING_ERROR
    letters.write(picture, "tracking", (tracking, y), 12 * u, colour, bold=True)


def stretches(shown: Bool) -> list[slice]:
    """Return the runs of two or more True values of a mask, as slices."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(shown, dtype=np.int8), [0]])))
    runs = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return [slice(first, end) for first, end in runs if end - first > 1]


def _ticks(t: float) -> list[float]:
    first = 5.0 * np.ceil((t - WINDOW) / 5.0)
    return [float(k) for k in np.arange(max(first, 0.0), t + 1e-9, 5.0)]
