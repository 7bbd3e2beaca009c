"""Dashed lines."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

Point = tuple[float, float]


def dashed(points: Sequence[Point], pattern: Sequence[float]) -> list[tuple[Point, Point]]:
    """Return the strokes of a dashed line; the pattern continues round its corners.

    Args:
        points: Corners of the line.
        pattern: Lengths of stroke, gap, stroke, gap, ..., all above 0.

    Returns:
        Start and end of every straight stroke.
    """
    strokes: list[tuple[Point, Point]] = []
    part, left = 0, pattern[0]
    for (x0, y0), (x1, y1) in zip(points, points[1:], strict=False):
        length = hypot(x1 - x0, y1 - y0)
        if length == 0.0:
            continue
        ux, uy = (x1 - x0) / length, (y1 - y0) / length
        done = 0.0
        while done < length:
            step = min(left, length - done)
            if part % 2 == 0:
                end = done + step
                strokes.append(((x0 + ux * done, y0 + uy * done), (x0 + ux * end, y0 + uy * end)))
            done += step
            left -= step
            if left <= 0.0:
                part = (part + 1) % len(pattern)
                left = pattern[part]
    return strokes
