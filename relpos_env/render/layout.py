"""Layout of the image, and transformation from the room to pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64

_HEIGHT = 720
"""[pixels] Shorter side of an image in which a unit of lines and letters is one pixel."""
_SMALLEST_UNIT = 0.62
"""[pixels] Minimum unit, for legible letters."""
_NO_PANEL = (400, 300)
"""[pixels] Smaller images show the room only."""
_MARGIN, _WALL = 14.0, 5.0
_PANEL_RIGHT, _PANEL_BELOW = 262.0, 226.0
_FOOT = 26.0
"""[units] Height of the scale bar's strip below the floor."""


@dataclass(frozen=True, slots=True)
class Rect:
    """A rectangle of the image [pixels]."""

    left: int
    top: int
    width: int
    height: int

    @property
    def right(self) -> int:
        """First column to the right of the rectangle."""
        return self.left + self.width

    @property
    def bottom(self) -> int:
        """First row below the rectangle."""
        return self.top + self.height


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Regions of the image of one room."""

    size: tuple[int, int]
    """[pixels] Width, height."""
    room: tuple[float, float]
    """[m] Width along x, depth along y."""
    unit: float
    """[pixels] Unit of line widths and letters."""
    floor: Rect
    """Region of the room, with walls and scale bar."""
    centre: tuple[float, float]
    """[pixels] Centre of the room."""
    scale: float
    """[pixels/m] Scale of the room."""
    head: Rect
    """Region of title and time."""
    legend: Rect
    plot: Rect
    card: Rect
    """Region of title, legend and plot."""
    panel: bool
    """True if the image has a card; small images show the room only."""

    @classmethod
    def fit(cls, size: tuple[int, int], room: tuple[float, float]) -> Layout:
        """Return the layout with the largest room: with the panel right of it or below it."""
        unit = max(_SMALLEST_UNIT, min(size) / _HEIGHT)
        m = round(_MARGIN * unit)
        panel = size[0] >= _NO_PANEL[0] and size[1] >= _NO_PANEL[1]
        right = (size[0] - round(_PANEL_RIGHT * unit) - 2 * m, size[1] - m)
        below = (size[0], size[1] - round(_PANEL_BELOW * unit) - 2 * m)
        is_wide = _scale(right, room, unit) >= _scale(below, room, unit)
        width, height = (right if is_wide else below) if panel else size
        floor = Rect(0, 0, max(width, 8), max(height, 8))
        scale = _scale((width, height), room, unit)
        free = floor.height - _FOOT * unit
        if is_wide:
            card = Rect(floor.right + m, m, size[0] - floor.right - 2 * m, size[1] - 2 * m)
        else:
            card = Rect(m, floor.bottom + m, size[0] - 2 * m, size[1] - floor.bottom - 2 * m)
        head, legend, plot = _columns(card, unit) if not is_wide else _rows(card, unit)
        return cls(
            size=size,
            room=room,
            unit=unit,
            floor=floor,
            centre=(0.5 * floor.width, 0.5 * (free + m)),
            scale=scale,
            head=head,
            legend=legend,
            plot=plot,
            card=card,
            panel=panel,
        )

    def pixels(self, points: F64) -> F64:
        """Transform points of the room, (..., 2), from [m] to [pixels]."""
        placed: F64 = points * (self.scale, -self.scale) + self.centre
        return placed

    def shape(self, outline: F64, x: float, y: float, heading: float) -> F64:
        """Transform an outline in body axes at a pose, (point, 2), from [m] to [pixels]."""
        c, s = self.scale * np.cos(heading), self.scale * np.sin(heading)
        placed: F64 = outline @ np.array([[c, -s], [-s, -c]]) + self.pixels(np.array([x, y]))
        return placed


def size_for(room: tuple[float, float]) -> tuple[int, int]:
    """Return the size that fits a room: 720 pixels high, 720 to 1440 pixels wide, even numbers."""
    free = _HEIGHT - 2 * _MARGIN - _FOOT - 2 * _WALL
    width = room[0] / room[1] * free + 4 * _MARGIN + 2 * _WALL + _PANEL_RIGHT
    return 2 * round(0.5 * min(max(width, 720.0), 1440.0)), _HEIGHT


def _scale(size: tuple[int, int], room: tuple[float, float], unit: float) -> float:
    edge = 2.0 * (_MARGIN + _WALL) * unit
    free = max(size[0] - edge, 4.0), max(size[1] - edge - (_FOOT - _MARGIN) * unit, 4.0)
    return min(free[0] / room[0], free[1] / room[1])


def _rows(card: Rect, unit: float) -> tuple[Rect, Rect, Rect]:
    head, plot = round(66 * unit), round(226 * unit)
    return (
        Rect(card.left, card.top, card.width, head),
        Rect(card.left, card.top + head, card.width, card.height - head - plot),
        Rect(card.left, card.bottom - plot, card.width, plot),
    )


def _columns(card: Rect, unit: float) -> tuple[Rect, Rect, Rect]:
    left, plot = round(0.56 * card.width), round(0.44 * card.width)
    head = round(62 * unit)
    return (
        Rect(card.left, card.top, left, head),
        Rect(card.left, card.top + head, left, card.height - head),
        Rect(card.right - plot, card.top, plot, card.height),
    )
