"""Legend of the image."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from relpos_env.render import palette
from relpos_env.render.canvas import DASHED, Canvas
from relpos_env.render.layout import Layout
from relpos_env.render.parts import car_shape
from relpos_env.render.parts.boxes import draw_box
from relpos_env.render.parts.cars import draw_car, draw_crossed_antenna, draw_halo
from relpos_env.render.parts.estimates import PATTERNS, draw_ellipse, draw_ghost, ellipse
from relpos_env.render.parts.formation import draw_cross, draw_place
from relpos_env.render.parts.lettering import Lettering
from relpos_env.render.parts.links import STYLES
from relpos_env.render.snapshot import LINE_OF_SIGHT, NO_LINE_OF_SIGHT, NO_RANGE, Snapshot
from tracking.arrays import F64
from tracking.estimate import Status

if TYPE_CHECKING:
    import pygame

_ROW, _SIGN = 21.0, 46.0
"""[units] Height of an entry, width of its symbol."""
_SAMPLE = palette.mix(palette.WALL, palette.CARS[0], 0.35)
"""Colour of the cars in the legend, which represent cars of every colour."""
_LENGTH = 27.0
"""[units] Length of the cars in the legend."""


def entries(snapshot: Snapshot) -> tuple[str, ...]:
    """Return the entries of a snapshot's legend, in order."""
    size = np.asarray(snapshot.boxes)[:, 2:4].min(axis=1) > 0.0
    names = ["car", "viewer", "estimate", "ambiguous", "doubtful", "lost"]
    names += ["sight", "no sight", "no range", "place"]
    names += ["goal"] if snapshot.goal is not None else []
    names += ["path"] if snapshot.path is not None else []
    names += ["fixed"] if np.any(size & ~snapshot.movable) else []
    names += ["movable"] if np.any(size & snapshot.movable) else []
    return (*names, "no power")


def draw_legend(canvas: Canvas, layout: Layout, names: tuple[str, ...]) -> None:
    """Draw the symbols of the entries."""
    for name, at in zip(names, _places(layout, len(names)), strict=True):
        _SIGNS[name](canvas, layout, at)


def write_legend(
    picture: pygame.Surface, layout: Layout, names: tuple[str, ...], letters: Lettering
) -> None:
    """Write the text of the entries next to their symbols."""
    u = layout.unit
    for name, at in zip(names, _places(layout, len(names)), strict=True):
        where = (float(at[0]) + 0.5 * _SIGN * u, float(at[1]))
        letters.write(picture, _WORDS[name], where, 12 * u, palette.INK)


def _places(layout: Layout, n: int) -> F64:
    """Return the centres of the symbols, (entry, 2) [pixels], in one column or two if needed."""
    u, box = layout.unit, layout.legend
    room = box.height - 12.0 * u
    n_columns = 1 if n * 15.0 * u <= room else 2
    n_rows = -(-n // n_columns)
    step = min(_ROW * u, room / n_rows)
    k = np.arange(n)
    x = box.left + (0.5 * _SIGN + 4.0) * u + (k // n_rows) * box.width / n_columns
    return np.stack([x, box.top + (k % n_rows + 0.5) * step + 4.0 * u], axis=1)


def _in_units(layout: Layout, at: F64, length: float) -> tuple[Layout, tuple[float, float]]:
    """Return a layout round a symbol with one metre per unit, and the size of a car in it."""
    return replace(layout, centre=(at[0], at[1]), scale=layout.unit), (length, 0.48 * length)


def _car(canvas: Canvas, layout: Layout, at: F64) -> None:
    room, size = _in_units(layout, at, _LENGTH)
    draw_car(canvas, room, np.zeros(3), 0.35, size, _SAMPLE)


def _viewer(canvas: Canvas, layout: Layout, at: F64) -> None:
    draw_halo(canvas, at, 8.5 * canvas.unit, _SAMPLE)


def _ghost(status: Status) -> Callable[[Canvas, Layout, F64], None]:
    def draw(canvas: Canvas, layout: Layout, at: F64) -> None:
        ok = status == Status.OK
        room, size = _in_units(layout, at, _LENGTH)
        body = room.shape(car_shape.BODY * size, 0.0, 0.0, 0.0)
        if ok:
            around = room.pixels(ellipse(np.diag([72.0, 20.0])))
            draw_ellipse(canvas, around, _SAMPLE, PATTERNS[status], ok=ok)
        draw_ghost(canvas, body, _SAMPLE, PATTERNS[status], ok=ok)

    return draw


def _link(kind: int) -> Callable[[Canvas, Layout, F64], None]:
    def draw(canvas: Canvas, layout: Layout, at: F64) -> None:
        canvas.lines(_stroke(canvas, at), *STYLES[kind])

    return draw


def _stroke(canvas: Canvas, at: F64) -> F64:
    return at + np.array([(-15.0, 0.0), (15.0, 0.0)]) * canvas.unit


def _place(canvas: Canvas, layout: Layout, at: F64) -> None:
    draw_place(canvas, at, 6.0 * canvas.unit, _SAMPLE)


def _goal(canvas: Canvas, layout: Layout, at: F64) -> None:
    draw_cross(canvas, at, 5.0 * canvas.unit, _SAMPLE)


def _path(canvas: Canvas, layout: Layout, at: F64) -> None:
    canvas.lines(_stroke(canvas, at), palette.PLAN, 1.4, DASHED)


def _box(movable: bool) -> Callable[[Canvas, Layout, F64], None]:
    def draw(canvas: Canvas, layout: Layout, at: F64) -> None:
        room, _ = _in_units(layout, at, _LENGTH)
        box = np.array([0.0, 0.0, 8.0 if movable else 13.0, 6.5, 1.0, 0.0])
        draw_box(canvas, room, box, movable=movable)

    return draw


def _no_power(canvas: Canvas, layout: Layout, at: F64) -> None:
    draw_crossed_antenna(canvas, at)


_SIGNS: dict[str, Callable[[Canvas, Layout, F64], None]] = {
    "car": _car,
    "viewer": _viewer,
    "estimate": _ghost(Status.OK),
    "ambiguous": _ghost(Status.AMBIGUOUS),
    "doubtful": _ghost(Status.DOUBTFUL),
    "lost": _ghost(Status.LOST),
    "sight": _link(LINE_OF_SIGHT),
    "no sight": _link(NO_LINE_OF_SIGHT),
    "no range": _link(NO_RANGE),
    "place": _place,
    "goal": _goal,
    "path": _path,
    "fixed": _box(movable=False),
    "movable": _box(movable=True),
    "no power": _no_power,
}
_WORDS = {
    "car": "car, true position",
    "viewer": "car whose estimates are shown",
    "estimate": "estimate, 2σ ellipse",
    "ambiguous": "estimate, ambiguous",
    "doubtful": "estimate, doubtful",
    "lost": "estimate, lost",
    "sight": "line of sight",
    "no sight": "no line of sight",
    "no range": "no range lately",
    "place": "target",
    "goal": "target in the plan",
    "path": "path of the plan",
    "fixed": "obstacle",
    "movable": "obstacle that moves",
    "no power": "tracker without power",
}
