"""Composition of the image: static parts are cached, moving parts drawn every time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relpos_env.render import palette
from relpos_env.render.backend import load_pygame
from relpos_env.render.canvas import Canvas
from relpos_env.render.layout import Layout, Rect
from relpos_env.render.parts.boxes import draw_box
from relpos_env.render.parts.cars import draw_cars, draw_viewer, write_numbers
from relpos_env.render.parts.error_plot import draw_errors, write_errors
from relpos_env.render.parts.estimates import draw_ghosts
from relpos_env.render.parts.floor import draw_floor, write_scale
from relpos_env.render.parts.formation import draw_formation, draw_plan
from relpos_env.render.parts.legend import draw_legend, entries, write_legend
from relpos_env.render.parts.lettering import Lettering
from relpos_env.render.parts.links import draw_links
from relpos_env.render.snapshot import Snapshot

if TYPE_CHECKING:
    import pygame


class Scene:
    """Drawing of snapshots on one surface in memory."""

    def __init__(self, size: tuple[int, int], fine: int) -> None:
        self._pg = load_pygame()
        self._size, self._fine = size, fine
        self._letters = Lettering()
        self._picture: pygame.Surface = self._pg.Surface(size, 0, 32)
        self._still: tuple[object, ...] | None = None

    def draw(self, snapshot: Snapshot) -> pygame.Surface:
        """Draw a snapshot; the returned surface is overwritten by the next call."""
        self._keep_still(snapshot)
        layout, picture = self._layout, self._picture
        picture.blit(self._base, (0, 0))
        canvas = self._floor
        canvas.copy_from(self._still_floor)
        for box in snapshot.boxes[np.asarray(snapshot.movable)]:
            draw_box(canvas, layout, box, movable=True)
        draw_plan(canvas, layout, snapshot)
        draw_links(canvas, layout, snapshot)
        draw_formation(canvas, layout, snapshot)
        draw_viewer(canvas, layout, snapshot)
        draw_ghosts(canvas, layout, snapshot)
        draw_cars(canvas, layout, snapshot)
        canvas.paste(picture)
        write_numbers(picture, layout, snapshot, self._letters)
        write_scale(picture, layout, self._letters)
        if layout.panel:
            self._plot.fill(palette.CARD)
            draw_errors(self._plot, layout, snapshot)
            self._plot.paste(picture)
            write_errors(picture, layout, snapshot, self._letters)
            self._write_head(snapshot)
        return picture

    def _keep_still(self, snapshot: Snapshot) -> None:
        """Draw the static parts again if they have changed."""
        fixed = snapshot.boxes[~np.asarray(snapshot.movable)]
        names = entries(snapshot)
        still = (snapshot.room, fixed.tobytes(), names)
        if still == self._still:
            return
        self._still = still
        layout = self._layout = Layout.fit(self._size, snapshot.room)
        self._floor = Canvas(layout.floor, self._fine, layout.unit)
        self._still_floor = Canvas(layout.floor, self._fine, layout.unit)
        self._still_floor.fill(palette.PAGE)
        draw_floor(self._still_floor, layout)
        for box in fixed:
            draw_box(self._still_floor, layout, box, movable=False)
        base = self._base = self._pg.Surface(self._size, 0, 32)
        base.fill(palette.PAGE)
        if layout.panel:
            self._lay_card(layout, names)

    def _lay_card(self, layout: Layout, names: tuple[str, ...]) -> None:
        """Draw the card with the legend, and create the canvas of the plot."""
        inset = round(3 * layout.unit)
        plot = layout.plot
        self._plot = Canvas(
            Rect(
                plot.left + inset,
                plot.top + inset,
                max(plot.width - 2 * inset, 1),
                max(plot.height - 2 * inset, 1),
            ),
            self._fine,
            layout.unit,
        )
        base, card = self._base, layout.card
        frame = self._pg.Rect(card.left, card.top, card.width, card.height)
        radius = round(8 * layout.unit)
        self._pg.draw.rect(base, palette.CARD, frame, border_radius=radius)
        self._pg.draw.rect(base, palette.CARD_EDGE, frame, 1, border_radius=radius)
        legend = Canvas(layout.legend, self._fine, layout.unit)
        legend.fill(palette.CARD)
        draw_legend(legend, layout, names)
        legend.paste(base)
        # The legend covers the sides of the frame.
        self._pg.draw.rect(base, palette.CARD_EDGE, frame, 1, border_radius=radius)
        write_legend(base, layout, names, self._letters)

    def _write_head(self, snapshot: Snapshot) -> None:
        u, head = self._layout.unit, self._layout.head
        left, most = head.left + 14 * u, head.width - 28 * u
        write = self._letters.write
        write(
            self._picture, snapshot.title, (left, head.top + 23 * u), 16 * u, palette.INK,
            bold=True, most=most,
        )  # fmt: skip
        y = head.top + 46 * u
        write(self._picture, f"t = {snapshot.t:.1f} s", (left, y), 13 * u, palette.INK)
        colour = palette.mix(palette.car_colour(snapshot.viewer), palette.INK, 0.2)
        write(
            self._picture, f"estimates of car {snapshot.viewer}", (head.right - 14 * u, y), 13 * u,
            colour, bold=True, anchor=(1.0, 0.5),
        )  # fmt: skip
