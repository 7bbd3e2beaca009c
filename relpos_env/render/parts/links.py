"""Radio links between the cars: line of sight, NLOS, or no recent range."""

from __future__ import annotations

from collections.abc import Sequence

from relpos_env.render import palette
from relpos_env.render.canvas import DASHED, DOTTED, SOLID, Canvas
from relpos_env.render.layout import Layout
from relpos_env.render.palette import Colour
from relpos_env.render.snapshot import LINE_OF_SIGHT, NO_LINE_OF_SIGHT, NO_RANGE, Snapshot

Style = tuple[Colour, float, Sequence[float]]
"""Colour, width [units], pattern."""

STYLES: dict[int, Style] = {
    LINE_OF_SIGHT: (palette.SIGHT, 1.2, SOLID),
    NO_LINE_OF_SIGHT: (palette.NO_SIGHT, 1.6, DASHED),
    NO_RANGE: (palette.mix(palette.SILENT, palette.FLOOR, 0.35), 1.3, DOTTED),
}


def draw_links(canvas: Canvas, layout: Layout, snapshot: Snapshot) -> None:
    """Draw a line for every pair of present cars."""
    pixels = layout.pixels(snapshot.pose[:, :2])
    # With many links, those of other cars fade, since the viewer's estimates are shown.
    fade = min(max(0.01 * (len(snapshot.links) - 10), 0.0), 0.7)
    for i, j, kind in snapshot.links.tolist():
        if snapshot.present[i] and snapshot.present[j] and kind in STYLES:
            colour, width, pattern = STYLES[kind]
            if snapshot.viewer not in (i, j):
                colour = palette.mix(colour, palette.FLOOR, fade)
            canvas.lines(pixels[[i, j]], colour, width, pattern)
